//! One mission of several files: what was read, in the local frame of one origin.

use std::collections::BTreeSet;
use std::path::PathBuf;

use domain::file::{Mistake, Mistakes};
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::Ned;
use domain::hours::WeeklyHours;
use domain::mission::bounds::LONGEST_NAME;
use geo::{Contains as _, Polygon};

use crate::content::{Content, Doubt, Height, Lost, Period, Rule, Site, Survey, Unused, Waypoint, Zone};
use crate::export::utc;
use crate::findings::{Findings, Note, Wrong};
use crate::heights::{self, Band, Terrain};
use crate::local::{self, Side};
use crate::mission_file::{
    AreaEntry, FeedEntry, MissionFile, ObjectiveEntry, SiteEntry, SurveyEntry, corner, one_line,
};
use crate::{Format, Import};

const STRICT: &str = "correct it, or import without --strict: the zone then bars more";

/// What the files do not say.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The mission's name.
    pub name: String,
    /// The take-off point, before the one that the mission's own file names.
    pub origin: Option<Origin>,
    /// The ground lies at most this much above or below the take-off point, in metres.
    pub relief_m: Option<f64>,
    /// A zone that is not understood is a mistake. Otherwise it bars more, and that is said.
    pub strict: bool,
    /// A file of areas may have none.
    pub allow_empty: bool,
}

/// A mission file and what was read differently from how it was published, or not at all.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembled {
    /// The text of the mission file.
    pub text: String,
    /// In the order of the files.
    pub notes: Vec<Note>,
    /// Objectives in it.
    pub objectives: usize,
    /// Areas in it.
    pub areas: usize,
    /// Sites in it.
    pub sites: usize,
}

/// Places and areas of `mission`, and areas of `others`, as one mission file.
///
/// # Errors
/// Every zone and place that cannot be converted, and a take-off point that is not known.
pub fn assemble(mission: &Import, others: &[Import], settings: &Settings) -> Result<Assembled, Mistakes> {
    let (file, notes) = build(mission, others, settings, &[])?;
    let (objectives, areas, sites) = (file.objectives.len(), file.areas.len(), file.sites.len());
    Ok(Assembled { text: file.text(), notes, objectives, areas, sites })
}

/// The areas of `files`, and the files as their feeds: tables for a mission file with this origin, whose own areas have the names
/// `taken`.
///
/// # Errors
/// Every zone that cannot be converted.
pub fn assemble_airspace(
    files: &[Import],
    origin: Origin,
    taken: &[String],
    settings: &Settings,
) -> Result<Assembled, Mistakes> {
    let content = Content { origin: Some(origin), ..Content::default() };
    let none = Import { path: PathBuf::new(), format: Format::GeoJson, content, notes: Vec::new() };
    let (file, notes) = build(&none, files, &Settings { origin: Some(origin), ..settings.clone() }, taken)?;
    Ok(Assembled { text: file.airspace_text(), notes, objectives: 0, areas: file.areas.len(), sites: 0 })
}

fn build(
    mission: &Import,
    others: &[Import],
    settings: &Settings,
    taken: &[String],
) -> Result<(MissionFile, Vec<Note>), Mistakes> {
    let origin = settings.origin.or(mission.content.origin).ok_or_else(|| {
        Mistakes(vec![Mistake {
            path: mission.path.clone(),
            place: None,
            message: "the take-off point is not known".into(),
            help: "give it with --origin LATITUDE,LONGITUDE[,ALTITUDE]".into(),
        }])
    })?;
    let mut assembly = Assembly {
        frame: LocalFrame::at(origin.place),
        terrain: Terrain::at(Some(origin), settings.relief_m),
        names: Names::default(),
        areas: Vec::new(),
        fences: Vec::new(),
        strict: settings.strict,
        feed: None,
    };
    taken.iter().for_each(|it| assembly.names.take(it, "area"));
    let mut feeds = Vec::new();
    let (mut notes, mut mistakes) = (Vec::new(), Vec::new());
    let (mut objectives, mut sites) = (Vec::new(), Vec::new());
    for (index, import) in std::iter::once(mission).chain(others).enumerate() {
        let mut findings = Findings::about(&import.path);
        let before = assembly.areas.len();
        // The areas of the mission's own file are its own.
        if 0 < index {
            let feed = import.feed();
            let name = assembly.names.unique(&feed.name, "feed");
            assembly.feed = Some(name.clone());
            feeds.push(FeedEntry::new(feed, name));
        }
        for lost in &import.content.lost {
            let outcome = assembly.lost(lost, &mut findings);
            findings.unless_wrong(outcome);
        }
        for zone in &import.content.zones {
            let outcome = assembly.zone(zone, &mut findings);
            findings.unless_wrong(outcome);
        }
        let is_empty = assembly.areas.len() == before && !findings.has_mistakes();
        if 0 < index && is_empty && !settings.allow_empty {
            let help = "give --allow-empty if that is right: no area of it limits the flight";
            findings.wrong(Wrong::at("", format!("no area was found in this file ({})", import.format), help));
        }
        for unused in &import.content.unused {
            let Unused { what, source } = unused;
            if index == 0 {
                let help = "say what it is by its property `kind`, or leave it out with --leave-out";
                findings.wrong(Wrong::at(source, format!("a {what} without `kind`"), help));
            } else {
                findings.note(source, format!("a {what} without a radius is no area: left out"));
            }
        }
        if index == 0 {
            let converted = import.content.waypoints.iter().map(|it| assembly.objective(it, origin));
            objectives = converted.filter_map(|it| findings.unless_wrong(it)).collect();
            let converted = import.content.sites.iter().map(|it| assembly.site(it));
            sites = converted.filter_map(|it| findings.unless_wrong(it)).collect();
        } else {
            for waypoint in &import.content.waypoints {
                findings.note(&waypoint.source, "a place to fly to in a file of areas: left out");
            }
            for site in &import.content.sites {
                findings.note(&site.source, "a place to land at in a file of areas: left out");
            }
        }
        notes.extend(import.notes.iter().cloned());
        match findings.with(()) {
            Ok(((), found)) => notes.extend(found),
            Err(found) => mistakes.extend(found.0),
        }
    }
    let file = MissionFile {
        name: one_line(&settings.name, LONGEST_NAME),
        remarks: remarks(mission, others),
        origin,
        order: mission.content.order,
        objectives,
        areas: assembly.areas,
        sites,
        feeds,
    };
    Mistakes(mistakes).or((file, notes))
}

fn remarks(mission: &Import, others: &[Import]) -> Vec<String> {
    let files = std::iter::once(mission).chain(others);
    let names = files.map(|it| it.path.file_name().map_or_else(String::new, |it| it.to_string_lossy().into_owned()));
    vec![
        format!("Made by `kittiwake mission import` from {}.", names.collect::<Vec<_>>().join(", ")),
        "Heights are above the take-off point. What the files say besides is in docs/formats.md and in the comments."
            .into(),
    ]
}

struct Assembly {
    frame: LocalFrame,
    terrain: Terrain,
    names: Names,
    areas: Vec<AreaEntry>,
    /// What is not left, to be checked against the places.
    fences: Vec<Polygon<f64>>,
    /// Whether a zone that is not understood is a mistake.
    strict: bool,
    /// The name of the feed that areas come from now.
    feed: Option<String>,
}

impl Assembly {
    fn zone(&mut self, zone: &Zone, findings: &mut Findings) -> Result<(), Wrong> {
        let side = if zone.rule == Rule::StayInside { Side::Inscribe } else { Side::Contain };
        let outline = local::polygon(&zone.outline, &self.frame, side);
        if zone.rule == Rule::StayInside {
            local::checked(&outline, &zone.source)?;
            self.inside(&outline, zone)?;
            findings.note(&zone.source, "a fence to stay inside is read as keep-out areas round it, 500 m wide");
            let band = Band { floor_m: None, ceiling_m: None };
            for fence in Assembly::cut(outline, zone, findings) {
                for part in local::frame_round(&fence) {
                    self.add(zone, "keep-out", &part, band)?;
                }
            }
            return Ok(());
        }
        if !local::is_in_reach(&outline) {
            if let Some(exchanged) = local::exchanged(&zone.outline)
                && local::is_in_reach(&local::polygon(&exchanged, &self.frame, side))
            {
                let message = "it lies near the take-off point if its latitudes and longitudes are exchanged";
                return Err(Wrong::at(
                    &zone.source,
                    message,
                    "correct the order of its numbers, or leave the zone out",
                ));
            }
            findings.note(&zone.source, "it lies more than 100 km from the take-off point: left out");
            return Ok(());
        }
        for doubt in &zone.doubts {
            let Doubt { place, message } = doubt;
            self.doubt(Wrong::at(place, message.clone(), STRICT), "it bars more", findings)?;
        }
        let outline = match local::checked(&outline, &zone.source) {
            Ok(()) => outline,
            Err(wrong) => {
                self.doubt(wrong, "it covers all that its corners enclose", findings)?;
                local::hull(&outline)
            }
        };
        let mut zone = zone.clone();
        if let Some(wrong) = heights::exchanged(&zone) {
            self.doubt(wrong, "it has no limits of height", findings)?;
            (zone.lower, zone.upper) = (None, None);
        }
        let Some(band) = heights::band(&zone, self.terrain, findings) else { return Ok(()) };
        let zone = &zone;
        let parts = Assembly::cut(outline, zone, findings);
        let kind = if zone.rule == Rule::Permission { "permission" } else { "keep-out" };
        for part in &parts {
            self.add(zone, kind, part, band)?;
        }
        Ok(())
    }

    /// Something that was not understood, which is a mistake only for who asks for that.
    fn doubt(&self, wrong: Wrong, instead: &str, findings: &mut Findings) -> Result<(), Wrong> {
        if self.strict {
            return Err(wrong);
        }
        findings.note(&wrong.place, format!("NOT UNDERSTOOD: {}: {instead}", wrong.message));
        Ok(())
    }

    /// A zone whose shape cannot be read does not matter if the places of it that can be read are all far away.
    fn lost(&self, lost: &Lost, findings: &mut Findings) -> Result<(), Wrong> {
        let is_far = |it: &LatLon| 2.0 * local::REACH_M < self.frame.local(*it).horizontal_distance_m(Ned::default());
        if lost.places.is_empty() || !lost.places.iter().all(is_far) {
            return Err(lost.wrong.clone());
        }
        let text = format!("its shape cannot be read ({}), and it lies far away: left out", lost.wrong.message);
        findings.note(&lost.wrong.place, text);
        Ok(())
    }

    /// What of a zone a mission file takes.
    fn cut(outline: Polygon<f64>, zone: &Zone, findings: &mut Findings) -> Vec<Polygon<f64>> {
        let (parts, is_cut) = local::cut(outline);
        if is_cut {
            findings.note(&zone.source, "it is cut off 140 km from the take-off point");
        }
        parts
    }

    /// A fence that is not left has the take-off point in it: otherwise its frame may be too narrow to be noticed.
    fn inside(&mut self, fence: &Polygon<f64>, zone: &Zone) -> Result<(), Wrong> {
        if !fence.contains(&geo::Point::new(0.0, 0.0)) {
            let message = "the take-off point lies outside of a fence to stay inside";
            return Err(Wrong::at(&zone.source, message, "move one of them, or leave the fence out"));
        }
        self.fences.push(fence.clone());
        Ok(())
    }

    fn add(&mut self, zone: &Zone, kind: &'static str, part: &Polygon<f64>, band: Band) -> Result<(), Wrong> {
        let corners = local::corners(part.exterior());
        // Cutting and framing may leave corners that touch.
        if !local::area_of(corners.clone()).is_simple() {
            return Err(Wrong::at(&zone.source, "it has no simple outline where it is cut", "simplify it"));
        }
        for Period { window, hours } in &zone.periods {
            self.areas.push(AreaEntry {
                remarks: zone.remarks.clone(),
                name: self.names.unique(&zone.name, "area"),
                kind,
                corners_deg: corners.iter().map(|it| corner(self.frame.lat_lon(*it))).collect(),
                floor_m: band.floor_m,
                ceiling_m: band.ceiling_m,
                from_utc: window.from_utc_ms.map(utc),
                until_utc: window.until_utc_ms.map(utc),
                hours_utc: hours.as_ref().map(WeeklyHours::to_texts).unwrap_or_default(),
                feed: self.feed.clone(),
            });
        }
        Ok(())
    }

    fn objective(&mut self, waypoint: &Waypoint, origin: Origin) -> Result<ObjectiveEntry, Wrong> {
        let at = waypoint.at.unwrap_or(origin.place);
        let survey = waypoint.survey.as_ref().map(|it| self.survey(it, waypoint)).transpose()?;
        if survey.is_none() {
            self.within_fences(at, &waypoint.name, &waypoint.source)?;
        }
        let [latitude_deg, longitude_deg] = corner(at).map(|it| Some(it).filter(|_| survey.is_none()));
        Ok(ObjectiveEntry {
            name: self.names.unique(&waypoint.name, "objective"),
            latitude_deg,
            longitude_deg,
            height_m: self.height_m(waypoint.height, &waypoint.source)?,
            flying: waypoint.flying,
            terms: (&waypoint.terms).into(),
            survey,
        })
    }

    /// A survey whose lines can be flown, with all corners inside of all fences.
    fn survey(&self, survey: &Survey, waypoint: &Waypoint) -> Result<SurveyEntry, Wrong> {
        for at in &survey.corners {
            self.within_fences(*at, &waypoint.name, &waypoint.source)?;
        }
        let corners = survey.corners.iter().map(|it| self.frame.local(*it)).collect();
        domain::survey::Survey::new(corners, survey.spacing_m, survey.heading_deg).map_err(|invalid| {
            Wrong::at(
                &waypoint.source,
                format!("a survey: {invalid}"),
                "change it in the program that made it, or leave it out",
            )
        })?;
        Ok(SurveyEntry {
            corners_deg: survey.corners.iter().map(|it| corner(*it)).collect(),
            spacing_m: survey.spacing_m,
            heading_deg: survey.heading_deg,
        })
    }

    fn site(&mut self, site: &Site) -> Result<SiteEntry, Wrong> {
        self.within_fences(site.at, &site.name, &site.source)?;
        let [latitude_deg, longitude_deg] = corner(site.at);
        Ok(SiteEntry {
            name: self.names.unique(&site.name, "site"),
            kind: site.kind.word(),
            latitude_deg,
            longitude_deg,
            height_m: self.height_m(site.height, &site.source)?,
        })
    }

    fn within_fences(&self, at: LatLon, name: &str, source: &str) -> Result<(), Wrong> {
        let Ned { north_m, east_m, .. } = self.frame.local(at);
        if self.fences.iter().all(|it| it.contains(&geo::Point::new(east_m, north_m))) {
            return Ok(());
        }
        let message = format!("`{name}` lies outside of a fence to stay inside");
        Err(Wrong::at(source, message, "move one of them"))
    }

    fn height_m(&self, height: Height, source: &str) -> Result<f64, Wrong> {
        match self.terrain.bounds_m(height) {
            Some([low, high]) if low == high => Ok((low * 100.0).round() / 100.0 + 0.0),
            _ => {
                let help = "give the take-off point's altitude as the third number of --origin";
                Err(Wrong::at(source, "its height cannot be counted from the take-off point", help))
            }
        }
    }
}

/// Names that were given.
#[derive(Default)]
struct Names(BTreeSet<(&'static str, String)>);

impl Names {
    /// Something else has this name.
    fn take(&mut self, name: &str, among: &'static str) {
        self.0.insert((among, name.to_owned()));
    }

    /// `wanted`, or with a number that makes it unique.
    fn unique(&mut self, wanted: &str, among: &'static str) -> String {
        let wanted = match one_line(wanted, LONGEST_NAME) {
            empty if empty.is_empty() => among.to_owned(),
            name => name,
        };
        // With its number a name is not longer either.
        let numbered = |number: u32| {
            let number = number.to_string();
            format!("{} {number}", one_line(&wanted, LONGEST_NAME - number.len() - 1))
        };
        let candidates = std::iter::once(wanted.clone()).chain((2..).map(numbered));
        let free = candidates.into_iter().find(|it| !self.0.contains(&(among, it.clone())));
        let name = free.unwrap_or(wanted);
        self.0.insert((among, name.clone()));
        name
    }
}
