//! A mission file, as `kittiwake check` reads it, with remarks as comments.

use domain::control_character::is_control;
use domain::feed::Feed;
use domain::geodesy::{LatLon, Origin};
use domain::mission::bounds::LONGEST_NAME;
use domain::mission::terms::{Order, Terms};
use serde::Serialize;

use crate::export::{degrees, utc};
use crate::terms::task_entry;

/// What is written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MissionFile {
    pub(crate) name: String,
    pub(crate) remarks: Vec<String>,
    pub(crate) origin: Origin,
    pub(crate) order: Order,
    pub(crate) objectives: Vec<ObjectiveEntry>,
    pub(crate) areas: Vec<AreaEntry>,
    pub(crate) sites: Vec<SiteEntry>,
    pub(crate) feeds: Vec<FeedEntry>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ObjectiveEntry {
    pub(crate) name: String,
    /// Absent for a survey.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) latitude_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) longitude_deg: Option<f64>,
    pub(crate) height_m: f64,
    pub(crate) flying: bool,
    #[serde(flatten)]
    pub(crate) terms: TermsEntry,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) survey: Option<SurveyEntry>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TermsEntry {
    #[serde(skip_serializing_if = "Option::is_none")]
    optional: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    worth: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    after: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reach_within_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reach_by_utc: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dwell_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    drop: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    land_on_target: Option<bool>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    actions: Vec<String>,
    #[serde(rename = "do", skip_serializing_if = "Vec::is_empty")]
    tasks: Vec<serde_json::Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    along: Vec<serde_json::Value>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SurveyEntry {
    pub(crate) corners_deg: Vec<[f64; 2]>,
    pub(crate) spacing_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) picture_distance_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) heading_deg: Option<f64>,
}

impl From<&Terms> for TermsEntry {
    fn from(terms: &Terms) -> TermsEntry {
        TermsEntry {
            optional: terms.worth.map(|_| true),
            worth: terms.worth,
            after: terms.after.iter().map(|it| one_line(it, LONGEST_NAME)).collect(),
            reach_within_s: terms.within.map(|it| it.as_secs_f64()),
            reach_by_utc: terms.by_utc_ms.map(utc),
            dwell_s: Some(terms.dwell.as_secs_f64()).filter(|it| 0.0 < *it),
            drop: terms.drop.then_some(true),
            land_on_target: terms.land_on_target.then_some(true),
            actions: terms.actions.clone(),
            tasks: terms.tasks.iter().map(task_entry).collect(),
            along: terms.along.iter().map(task_entry).collect(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SiteEntry {
    pub(crate) name: String,
    pub(crate) kind: &'static str,
    pub(crate) latitude_deg: f64,
    pub(crate) longitude_deg: f64,
    pub(crate) height_m: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct AreaEntry {
    #[serde(skip)]
    pub(crate) remarks: Vec<String>,
    pub(crate) name: String,
    pub(crate) kind: &'static str,
    pub(crate) corners_deg: Vec<[f64; 2]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) holes_deg: Vec<Vec<[f64; 2]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) floor_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) ceiling_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) from_utc: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) until_utc: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) hours_utc: Vec<String>,
    /// The name of the feed that it came from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) feed: Option<String>,
}

/// A data set that areas came from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct FeedEntry {
    pub(crate) name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    provider: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    issued_utc: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    valid_from_utc: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    valid_until_utc: Option<String>,
}

impl FeedEntry {
    /// The feed under a name that is unique in the mission. A moment before 1970 cannot be written.
    pub(crate) fn new(feed: Feed, name: String) -> FeedEntry {
        let moment = |it: Option<i64>| it.filter(|it| 0 <= *it).map(utc);
        FeedEntry {
            name,
            provider: feed.provider,
            issued_utc: moment(feed.issued_utc_ms),
            valid_from_utc: moment(feed.valid_from_utc_ms),
            valid_until_utc: moment(feed.valid_until_utc_ms),
        }
    }
}

#[derive(Serialize)]
struct Head<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<&'static str>,
    origin: OriginEntry,
}

#[derive(Serialize)]
struct OriginEntry {
    latitude_deg: f64,
    longitude_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    altitude_m: Option<f64>,
}

#[derive(Serialize)]
struct Objective<'a> {
    objective: [&'a ObjectiveEntry; 1],
}

#[derive(Serialize)]
struct Site<'a> {
    site: [&'a SiteEntry; 1],
}

#[derive(Serialize)]
struct FeedTable<'a> {
    feed: [&'a FeedEntry; 1],
}

#[derive(Serialize)]
struct Area<'a> {
    area: [&'a AreaEntry; 1],
}

impl MissionFile {
    /// The text of the file.
    pub(crate) fn text(&self) -> String {
        let [latitude_deg, longitude_deg] = corner(self.origin.place);
        let origin = OriginEntry { latitude_deg, longitude_deg, altitude_m: self.origin.altitude_m };
        let order = (self.order == Order::Free).then_some("free");
        let mut text = comments(&self.remarks) + &toml(&Head { name: &self.name, order, origin });
        for objective in &self.objectives {
            text.push('\n');
            text.push_str(&toml(&Objective { objective: [objective] }));
        }
        for site in &self.sites {
            text.push('\n');
            text.push_str(&toml(&Site { site: [site] }));
        }
        text + &self.airspace_text()
    }

    /// The text of the feeds and the areas alone.
    pub(crate) fn airspace_text(&self) -> String {
        let mut text = String::new();
        for feed in &self.feeds {
            text.push('\n');
            text.push_str(&toml(&FeedTable { feed: [feed] }));
        }
        for area in &self.areas {
            text.push('\n');
            text.push_str(&comments(&area.remarks));
            text.push_str(&toml(&Area { area: [area] }));
        }
        text
    }
}

/// A place as a mission file has it.
pub(crate) fn corner(at: LatLon) -> [f64; 2] {
    [degrees(at.latitude_deg()), degrees(at.longitude_deg())]
}

fn toml(table: &impl Serialize) -> String {
    toml::to_string(table).expect("tables of texts and numbers can be written")
}

/// The longest line of a comment, in characters.
const LONGEST_LINE: usize = 500;

/// A line for each. What could end a line, or direct a terminal, is left out.
fn comments(remarks: &[String]) -> String {
    remarks.iter().map(|remark| format!("# {}\n", one_line(remark, LONGEST_LINE))).collect()
}

/// The text on one line, without characters that cannot be seen, and not longer than this.
pub(crate) fn one_line(text: &str, longest: usize) -> String {
    let visible: String = text.chars().map(|it| if is_control(it) { ' ' } else { it }).take(longest).collect();
    visible.split_whitespace().collect::<Vec<_>>().join(" ")
}
