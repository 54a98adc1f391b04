//! A mission as a human writes it: objectives to reach, and areas on the way.

mod area_hours;
mod areas;
pub mod bounds;
pub mod feeds;
mod place;
mod ready;
mod site_entry;
mod sites;
mod survey;
pub mod terms;
mod volume;

use std::ops::Range;

use kittiwake_proto::v1;
use prost::Message as _;
use serde::Deserialize;
use sha2::{Digest as _, Sha256};
use toml::Spanned;

use crate::area::{Area, AreaKind, NO_LANDING_TO_M};
use crate::camera::Camera;
use crate::declared_skill::{DeclaredSkills, ROOM_M};
use crate::feed::Feed;
use crate::file::{MOST_MISTAKES, Mistake, Mistakes, Source};
use crate::geodesy::{LocalFrame, Origin};
use crate::geometry::Ned;
use crate::harm::Ground;
use crate::site::Site;
use crate::survey::Survey;
use crate::task::{Stance, Task};
use area_hours::HoursEntry;
pub use areas::MissionAreas;
use bounds::{LONGEST_NAME, control_character};
use feeds::FeedEntry;
use place::OriginEntry;
use ready::ReadyEntry;
use site_entry::SiteEntry;
use sites::{LOWEST_GROUND_M, Place};
use terms::{Order, Terms};
use volume::VolumeEntry;

/// A mission that may be flown; [`Mission::read`] is the only way to obtain one.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    /// Its name.
    pub name: String,
    /// In the order of the file, or as they are attempted once that is chosen; at least one.
    pub objectives: Vec<Objective>,
    /// Areas with distinct names.
    pub areas: Vec<Area>,
    /// In which order the objectives are attempted.
    pub order: Order,
    /// Where a flight may end early, with distinct names.
    pub sites: Vec<Site>,
    /// Where the mission takes off, and all its places count from; `None`: from wherever the vehicle stands.
    pub origin: Option<Origin>,
    /// The data sets that areas came from, with distinct names; an area that none of them names is the mission's own.
    pub feeds: Vec<Feed>,
}

/// A state to reach.
#[derive(Debug, Clone, PartialEq)]
pub struct Objective {
    /// Unique within the mission.
    pub name: String,
    /// Where to be; at the end of a survey, its last turn.
    pub position: Ned,
    /// Whether to be in the air there.
    pub flying: bool,
    /// Its other requirements.
    pub terms: Terms,
    /// A polygon to be flown over line by line, at the height of the position.
    pub survey: Option<Survey>,
}

/// An objective and its progress.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectiveStatus {
    /// The objective.
    pub objective: Objective,
    /// Its progress.
    pub progress: Progress,
    /// Total number of steps planned for it.
    pub plan_steps: u32,
    /// Number of replans.
    pub replans: u32,
    /// Areas whose permission was requested for it, each once, in the order of the plan.
    pub permissions: Vec<String>,
    /// How far the release of a load has come that it asks for.
    pub release: ReleaseProgress,
    /// How many of its tasks are done.
    pub tasks_done: usize,
    /// Why a task along its leg has failed, if one has: the flight goes on, and the objective fails at its end.
    pub along_failure: Option<String>,
}

impl ObjectiveStatus {
    /// An objective that was not attempted yet.
    pub fn waiting(objective: &Objective) -> ObjectiveStatus {
        ObjectiveStatus {
            objective: objective.clone(),
            progress: Progress::Waiting,
            plan_steps: 0,
            replans: 0,
            permissions: Vec::new(),
            release: ReleaseProgress::NotPlanned,
            tasks_done: 0,
            along_failure: None,
        }
    }
}

/// How far a release has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReleaseProgress {
    /// No plan has it: a gripper that is open then has no load.
    #[default]
    NotPlanned,
    /// A plan with it was given out: an open gripper may be its doing.
    Planned,
    /// The load was seen released at the place, and is not released again.
    Seen,
}

/// The progress of an objective. Success and failure are final.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Progress {
    /// Not attempted yet, or being attempted.
    Waiting,
    /// Reached, as seen in the vehicle's data.
    Success,
    /// Given up, with the reason.
    Failure(String),
}

/// How a mission ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissionOutcome {
    /// Every objective was reached.
    Success,
    /// It ended with objectives that failed.
    Failure,
    /// It was ended by a response.
    Emergency,
    /// The vehicle crashed.
    Crash,
}

/// The report at the end of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionReport {
    /// How it ended.
    pub outcome: MissionOutcome,
    /// Why.
    pub reason: String,
    /// The vehicle's name.
    pub vehicle: String,
    /// The mission's name.
    pub mission: String,
    /// From the first plan to the end, in mission seconds.
    pub duration_s: f64,
    /// What became of each objective.
    pub objectives: Vec<ObjectiveReport>,
}

/// An objective in the report.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectiveReport {
    /// Its name.
    pub name: String,
    /// How it ended.
    pub progress: Progress,
    /// Total number of steps planned for it.
    pub plan_steps: u32,
    /// Number of replans.
    pub replans: u32,
    /// Areas whose permission was requested for it.
    pub permissions: Vec<String>,
}

/// Why an objective is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidObjective {
    /// Its name is empty or has characters that names may not have.
    #[error("an objective has a name of 1 to {LONGEST_NAME} characters, without control characters")]
    Name,
    /// It lies out of range.
    #[error("objective `{0}` is farther than {FARTHEST_M} m from the origin, or higher than {HIGHEST_M} m")]
    TooFar(String),
    /// It lies higher than responses fly.
    #[error("objective `{name}` is at height {height_m} m, expected at most {most_m} m: responses fly no higher")]
    TooHigh {
        /// Its name.
        name: String,
        /// Above the take-off point.
        height_m: f64,
        /// The greatest height of such an objective.
        most_m: f64,
    },
    /// It lies too far below the take-off point, or is to be reached in flight at no height.
    #[error("objective `{name}` is inside the ground: its height is {height_m} m")]
    InTheGround {
        /// Its name.
        name: String,
        /// Above the take-off point.
        height_m: f64,
    },
}

impl Objective {
    /// An objective from outside a file, checked by the same rules.
    ///
    /// # Errors
    /// If it is invalid.
    pub fn new(name: String, position: Ned, flying: bool) -> Result<Objective, InvalidObjective> {
        let height_m = position.height_m();
        let is_too_long = LONGEST_NAME < name.chars().count();
        if name.trim().is_empty() || is_too_long || control_character(&name).is_some() {
            return Err(InvalidObjective::Name);
        }
        let lateral = [position.north_m, position.east_m];
        let sound = lateral.iter().all(|it| it.abs() <= FARTHEST_M) && height_m.abs() <= HIGHEST_M;
        if !sound {
            return Err(InvalidObjective::TooFar(name));
        }
        if height_m < LOWEST_GROUND_M || (flying && height_m <= 0.0) {
            return Err(InvalidObjective::InTheGround { name, height_m });
        }
        if let Some(most_m) = sites::too_high(height_m, flying) {
            return Err(InvalidObjective::TooHigh { name, height_m, most_m });
        }
        Ok(Objective { name, position, flying, terms: Terms::default(), survey: None })
    }

    /// The objective, or the one of its places that is `place`, as the beginning of a sentence.
    fn in_words(&self, place: Ned) -> String {
        let at = self.survey.as_ref().map(|_| format!(" at {place}")).unwrap_or_default();
        format!("objective `{}`{at}", self.name)
    }

    /// Where it leads, in order: its position, or each turn of its survey.
    pub fn places(&self) -> Vec<Ned> {
        let turns = self.survey.iter().flat_map(Survey::turns);
        let turns: Vec<Ned> = turns.map(|it| it.at.at_height(self.position.height_m())).collect();
        if turns.is_empty() { vec![self.position] } else { turns }
    }
}

/// Greatest height above the origin; a higher one is a typing mistake.
const HIGHEST_M: f64 = 10_000.0;
/// Greatest distance from the origin; a longer one is a typing mistake.
const FARTHEST_M: f64 = 100_000.0;

/// The first half of the SHA-256 of these bytes, in hexadecimal.
fn hash_of_bytes(bytes: &[u8]) -> String {
    let hash = Sha256::digest(bytes);
    hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

impl Mission {
    /// The identity of this mission: a hash of its content, the same on every machine and in every build.
    pub fn identity(&self) -> String {
        hash_of_bytes(&v1::MissionStatus::from(self).encode_to_vec())
    }

    /// Parses and checks a mission file; every mistake that can be found is reported at once, up to [`MOST_MISTAKES`]. One beyond
    /// the [`bounds`] is not looked at any further.
    ///
    /// A mission may end in the air: the table of contingencies must have a row that brings it down then.
    ///
    /// # Errors
    /// The mistakes, each with its place.
    pub fn read(source: &Source) -> Result<Mission, Mistakes> {
        Mission::read_checked(source, None, None)
    }

    /// The same with the skills that its tasks may use: each task is checked against its declaration. `ready` names the sites that the
    /// control tower knows, if that is known.
    ///
    /// # Errors
    /// As [`Mission::read`], a task that none of these skills does, and a place that is to be ready and none of these sites.
    pub fn read_with(source: &Source, skills: &DeclaredSkills, ready: Option<&[&str]>) -> Result<Mission, Mistakes> {
        Mission::read_checked(source, Some(skills), ready)
    }

    fn read_checked(
        source: &Source,
        skills: Option<&DeclaredSkills>,
        ready: Option<&[&str]>,
    ) -> Result<Mission, Mistakes> {
        if let Some(mistake) = of_another_program(source) {
            return Err(Mistakes(vec![mistake]));
        }
        let file: MissionFile = source.parse()?;
        let mut check =
            Checker { source, mistakes: Mistakes::default(), frame: None, camera: file.camera, skills, ready };
        check.bounds(&file);
        if !check.mistakes.0.is_empty() {
            return Err(check.mistakes);
        }
        let origin = file.origin.as_ref().and_then(|it| check.origin(it));
        let objectives: Vec<_> = file.objective.iter().map(|it| check.objective(it)).collect();
        let mut areas: Vec<_> = file.area.iter().map(|it| check.area(it)).collect();
        let mut spans: Vec<_> = file.area.iter().map(AreaEntry::corners_span).collect();
        let alternates = check.alternates(&file.site);
        let of_volume = file.volume.as_ref().map(|it| check.volume(it)).unwrap_or_default();
        let of_volume = of_volume.into_iter().map(|(span, area)| (span, area, "a part of the volume"));
        let to_be_ready = check.readiness(&file, &objectives, &alternates).into_iter();
        let to_be_ready = to_be_ready.map(|(span, area)| (span, area, "the air round a place that is to be ready"));
        for (span, area, what) in of_volume.chain(to_be_ready) {
            if let Some(other) = file.area.iter().find(|it| *it.name.as_ref() == area.name) {
                let message = format!("area `{}` has the name of {what}", area.name);
                check.say(Some(other.name.span()), message, "give it another one");
            }
            spans.push(span);
            areas.push(area);
        }
        check.distinct("objective", file.objective.iter().map(|it| &it.name));
        check.distinct("area", file.area.iter().map(|it| &it.name));
        let feeds = check.feeds(&file.feed, &file.area);
        if objectives.is_empty() {
            check.say(None, "a mission without objectives", "add an [[objective]]");
        }
        check.precedence(file.order, &file.objective);
        if check.mistakes.0.is_empty() {
            check.ground(&file, &objectives, &alternates);
            check.sites(&file, &objectives, &areas, &spans);
            check.alternates_among(&file.site, &alternates, &areas);
        }
        let mission =
            Mission { name: file.name, objectives, areas, order: file.order, sites: alternates, origin, feeds };
        check.mistakes.or(mission)
    }

    /// The feed that an area came from; `None` for one of the mission's own.
    pub fn feed_of(&self, area: &str) -> Option<&Feed> {
        self.feeds.iter().find(|it| it.areas.iter().any(|it| it == area))
    }

    /// A sentence for each feed that is not to be used at this moment of UTC. Its areas count all the same.
    pub fn out_of_date_feeds(&self, utc_ms: i64) -> Vec<String> {
        self.feeds.iter().filter_map(|it| it.out_of_date(utc_ms)).collect()
    }

    /// Why `objective`, which is to be inserted, as the last one or not, cannot be flown to: too high, or by an area of this
    /// mission that always applies.
    pub fn unfit_place(&self, objective: &Objective, is_end: bool) -> Option<String> {
        let height_m = objective.position.height_m();
        if let Some(most_m) = sites::too_high(height_m, objective.flying) {
            return Some(format!("objective `{}` is at {height_m} m, the highest is {most_m} m", objective.name));
        }
        let site = Place { position: objective.position, flying: objective.flying, is_end };
        if let Some(why) = sites::against_ground(site, &places_on_ground(&self.objectives, &self.sites)) {
            return Some(format!("objective `{}` {why}", objective.name));
        }
        let unfit = self.areas.iter().filter(|it| it.always_applies()).find_map(|area| sites::unfit(site, area))?;
        Some(format!("objective `{}` {}", objective.name, unfit.in_words()))
    }

    /// The places of this mission that a wind of `wind_m_s` brings too near to a border, a sentence for each of the first
    /// [`MOST_MISTAKES`]. They are not mistakes: the wind need not blow.
    pub fn too_near_in_wind(&self, wind_m_s: f64) -> Vec<String> {
        let start = ("the take-off point".to_owned(), Place::to_end_at(Ned::default()));
        let objectives = self.objectives.iter().map(|it| {
            let site = |place| (it.in_words(place), Place { position: place, flying: it.flying, is_end: false });
            it.places().into_iter().map(site).collect()
        });
        let sites = self.sites.iter().map(|it| vec![(format!("site `{}`", it.name), Place::to_end_at(it.position))]);
        // Of a survey, the first turn near to an area says enough.
        let near = |sites: Vec<(String, Place)>| {
            let near = |area: &Area| {
                let (name, near) = sites
                    .iter()
                    .find_map(|(name, site)| Some((name, sites::too_near_in_wind(*site, area, wind_m_s)?)))?;
                Some(format!(
                    "{name} lies {:.1} m from the border of area `{}`: less than the {:.0} m that a wind of {wind_m_s} m/s asks for",
                    near.distance_m, area.name, near.expected_m
                ))
            };
            self.areas.iter().filter_map(near).collect::<Vec<_>>()
        };
        let mut all = std::iter::once(vec![start]).chain(objectives).chain(sites).flat_map(near);
        let first: Vec<String> = all.by_ref().take(MOST_MISTAKES).collect();
        let more = all.next().map(|_| "more places lie as near to a border".to_owned());
        first.into_iter().chain(more).collect()
    }
}

/// The take-off point, the objectives on the ground, and the sites.
fn places_on_ground(objectives: &[Objective], sites: &[Site]) -> Vec<(String, Ned)> {
    let on_ground = objectives.iter().filter(|it| !it.flying);
    let objectives = on_ground.map(|it| (format!("objective `{}`", it.name), it.position));
    let sites = sites.iter().map(|it| (format!("site `{}`", it.name), it.position));
    std::iter::once(("the take-off point".to_owned(), Ned::default())).chain(objectives).chain(sites).collect()
}

/// Why the vehicle must not be sent to land at `site`, by one of `areas`, which apply then; the end of a sentence that begins with
/// the place. The rule for the places of a mission, for a place that comes in another way.
pub fn unfit_landing_site<'a>(site: Ned, areas: impl IntoIterator<Item = &'a Area>) -> Option<String> {
    let site = Place::to_end_at(site);
    areas.into_iter().find_map(|area| sites::unfit(site, area)).map(|it| it.in_words())
}

/// One mistake in place of those of a TOML parser, for a file that is to be imported.
fn of_another_program(source: &Source) -> Option<Mistake> {
    let text = source.text.trim_start_matches('\u{feff}').trim_start();
    let format = match text.chars().next()? {
        '{' if text.contains("\"fileType\"") => "a plan of QGroundControl",
        '{' => "JSON",
        '<' => "XML",
        _ if text.starts_with("QGC WPL") => "a mission of QGC WPL",
        _ => return None,
    };
    let message = format!("this is {format}, not a mission file");
    let (path, out) = (source.path.display(), source.path.with_extension("toml"));
    let help = format!("import it first: kittiwake mission import \"{path}\" --out \"{}\"", out.display());
    Some(source.mistake(None, message, help))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MissionFile {
    name: String,
    origin: Option<Spanned<OriginEntry>>,
    volume: Option<Spanned<VolumeEntry>>,
    /// It takes the pictures of surveys.
    camera: Option<Camera>,
    #[serde(default)]
    order: Order,
    #[serde(default)]
    objective: Vec<ObjectiveEntry>,
    #[serde(default)]
    area: Vec<AreaEntry>,
    #[serde(default)]
    site: Vec<SiteEntry>,
    #[serde(default)]
    feed: Vec<FeedEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectiveEntry {
    name: Spanned<String>,
    /// From the take-off point, or in WGS 84; in a mission with an origin either is allowed.
    north_m: Option<Spanned<f64>>,
    east_m: Option<Spanned<f64>>,
    latitude_deg: Option<Spanned<f64>>,
    longitude_deg: Option<Spanned<f64>>,
    /// In place of a position.
    survey: Option<Spanned<survey::SurveyEntry>>,
    /// Above the take-off point.
    height_m: Spanned<f64>,
    flying: bool,
    optional: Option<Spanned<bool>>,
    worth: Option<Spanned<f64>>,
    #[serde(default)]
    after: Vec<Spanned<String>>,
    /// Mission seconds after the first plan.
    reach_within_s: Option<Spanned<f64>>,
    reach_by_utc: Option<Spanned<String>>,
    dwell_s: Option<Spanned<f64>>,
    drop: Option<Spanned<bool>>,
    land_on_target: Option<Spanned<bool>>,
    #[serde(default)]
    actions: Vec<Spanned<String>>,
    #[serde(default, rename = "do")]
    tasks: Vec<Spanned<terms::TaskEntry>>,
    #[serde(default)]
    along: Vec<Spanned<terms::TaskEntry>>,
    /// Who must be ready before it is landed there.
    ready: Option<Spanned<ReadyEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AreaEntry {
    name: Spanned<String>,
    kind: Kind,
    /// `[north, east]` each.
    corners_m: Option<Spanned<Vec<[f64; 2]>>>,
    /// `[latitude, longitude]` each, instead.
    corners_deg: Option<Spanned<Vec<[f64; 2]>>>,
    /// A list of corners for each hole.
    holes_m: Option<Vec<Spanned<Vec<[f64; 2]>>>>,
    /// The same in degrees, instead.
    holes_deg: Option<Vec<Spanned<Vec<[f64; 2]>>>>,
    floor_m: Option<Spanned<f64>>,
    ceiling_m: Option<Spanned<f64>>,
    from_utc: Option<Spanned<String>>,
    until_utc: Option<Spanned<String>>,
    hours_utc: Option<HoursEntry>,
    /// Of one that may not be landed in: what is below. Without it people are.
    ground: Option<Spanned<Ground>>,
    /// The name of the [[feed]] that it came from.
    feed: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Permission,
    KeepOut,
    /// Flown over, and not landed in: `ground` says whether water or people are below.
    NoLanding,
}

struct Checker<'a> {
    source: &'a Source,
    mistakes: Mistakes,
    /// Where the mission's origin is on Earth, if the file says so.
    frame: Option<LocalFrame>,
    camera: Option<Camera>,
    /// What its tasks may use, if that is known here.
    skills: Option<&'a DeclaredSkills>,
    /// The sites that the control tower knows, if they are known here.
    ready: Option<&'a [&'a str]>,
}

impl Checker<'_> {
    fn say(&mut self, span: Option<Range<usize>>, message: impl Into<String>, help: &str) {
        if !self.mistakes.is_full() {
            self.mistakes.push(self.source.mistake(span, message, help));
        }
    }

    fn objective(&mut self, it: &ObjectiveEntry) -> Objective {
        let height_m = self.within("height_m", &it.height_m, -HIGHEST_M, HIGHEST_M);
        if it.flying && height_m <= 0.0 {
            let message =
                format!("objective `{}` is inside the ground: it flies at height {height_m} m", it.name.as_ref());
            self.say(
                Some(it.height_m.span()),
                message,
                "a flying objective has a height above 0, the take-off point's",
            );
        } else if let Some(most_m) = sites::too_high(height_m, it.flying) {
            let message = format!(
                "objective `{}` is at height {height_m} m, expected at most {most_m} m: responses fly no higher",
                it.name.as_ref()
            );
            self.say(
                Some(it.height_m.span()),
                message,
                "lower it: every place of a mission can be left and reached by a response",
            );
        } else if !it.flying && height_m < LOWEST_GROUND_M {
            let message =
                format!("objective `{}` is inside the ground: it stands at height {height_m} m", it.name.as_ref());
            self.say(
                Some(it.height_m.span()),
                message,
                "an objective on the ground lies at most 110 m below the take-off point",
            );
        }
        let survey = self.survey(it);
        let end = match &survey {
            Some((_, end)) => *end,
            None if it.survey.is_some() => Ned::default(),
            None => self.objective_place(it),
        };
        Objective {
            name: it.name.as_ref().clone(),
            position: end.at_height(height_m),
            flying: it.flying,
            terms: self.terms(it, survey.as_ref().and_then(|(survey, _)| survey.picture_distance_m())),
            survey: survey.map(|(survey, _)| survey),
        }
    }

    fn area(&mut self, it: &AreaEntry) -> Area {
        let (corners, holes) = (self.area_corners(it), self.area_holes(it));
        let has_rings = corners.is_some() && holes.is_some();
        let is_below = matches!(it.kind, Kind::NoLanding);
        if let Some(height) = it.floor_m.as_ref().or(it.ceiling_m.as_ref()).filter(|_| is_below) {
            self.say(
                Some(height.span()),
                format!("area `{}` may not be landed in, and has a height", it.name.as_ref()),
                "leave out `floor_m` and `ceiling_m`: such an area is the ground; or say `kind = \"keep-out\"`",
            );
        }
        let ground = it.ground.as_ref().map(|it| *it.as_ref());
        let means_something = is_below && ground != Some(Ground::Nobody);
        if let Some(ground) = it.ground.as_ref().filter(|_| !means_something) {
            self.say(
                Some(ground.span()),
                format!("area `{}` has a kind of ground that bars no landing", it.name.as_ref()),
                "`ground` is \"water\" or \"people\", and belongs to an area with `kind = \"no-landing\"`",
            );
        }
        let area = Area {
            name: it.name.as_ref().clone(),
            kind: match it.kind {
                Kind::Permission => AreaKind::Permission,
                // Nothing comes down through it, so nothing lands in it.
                Kind::KeepOut | Kind::NoLanding => AreaKind::KeepOut,
            },
            corners: corners.unwrap_or_default(),
            holes: holes.unwrap_or_default(),
            floor_m: it.floor_m.as_ref().map(|it| self.within("floor_m", it, -HIGHEST_M, HIGHEST_M)),
            ceiling_m: match is_below {
                true => Some(NO_LANDING_TO_M),
                false => it.ceiling_m.as_ref().map(|it| self.within("ceiling_m", it, -HIGHEST_M, HIGHEST_M)),
            },
            from_utc_ms: it.from_utc.as_ref().and_then(|it| self.moment(it)),
            until_utc_ms: it.until_utc.as_ref().and_then(|it| self.moment(it)),
            hours: it.hours_utc.as_ref().and_then(|it| self.hours(it)),
            ground: if is_below { ground.unwrap_or(Ground::People) } else { Ground::default() },
        };
        if has_rings {
            self.rings(&area, &format!("area `{}`", area.name), &it.ring_spans());
        }
        if let (Some(floor), Some(ceiling)) = (area.floor_m, area.ceiling_m)
            && ceiling <= floor
        {
            let span = it.ceiling_m.as_ref().map(Spanned::span);
            self.say(
                span,
                format!("area `{}` has its ceiling {ceiling} m not above its floor {floor} m", area.name),
                "",
            );
        }
        if let (Some(from), Some(until)) = (area.from_utc_ms, area.until_utc_ms)
            && until <= from
        {
            let span = it.until_utc.as_ref().map(Spanned::span);
            self.say(span, format!("area `{}` ends before it begins", area.name), "");
        }
        area
    }

    /// Where the tasks of an objective are done that ask for another height, each with its name and where it stands.
    fn task_places(&self, entry: &ObjectiveEntry, objective: &Objective) -> Vec<(String, Range<usize>, Ned)> {
        let Objective { position, flying, terms, .. } = objective;
        let place = |(entry, task): (&Spanned<terms::TaskEntry>, &Task)| {
            let height_m = self.skills?.height_m(task, Stance::at_place(*flying), position.height_m())?;
            Some((task.skill.clone(), entry.span(), position.at_height(height_m)))
        };
        let places = entry.tasks.iter().zip(&terms.tasks).filter_map(place);
        places.filter(|(.., it)| it.height_m() != position.height_m()).collect()
    }

    /// Each place against the ground as the others say it.
    fn ground(&mut self, file: &MissionFile, objectives: &[Objective], sites: &[Site]) {
        let on_ground = places_on_ground(objectives, sites);
        for (entry, objective) in file.objective.iter().zip(objectives) {
            let place = |position| Place { position, flying: objective.flying, is_end: false };
            let wrong =
                objective.places().into_iter().find_map(|it| Some((it, sites::against_ground(place(it), &on_ground)?)));
            if let Some((at, why)) = wrong {
                let message = format!("{} {why}", objective.in_words(at));
                self.say(Some(entry.height_m.span()), message, "one of the two heights is wrong");
            }
            for (skill, span, at) in self.task_places(entry, objective) {
                let lowest = place(at.at_height(at.height_m() - ROOM_M));
                if sites::against_ground(lowest, &on_ground).is_some() {
                    let message =
                        format!("`{skill}` would be done at a height of {} m, in known ground", at.height_m());
                    self.say(
                        Some(span),
                        message,
                        "heights count from the take-off point: another place, or another condition",
                    );
                }
            }
        }
        for (entry, site) in file.site.iter().zip(sites) {
            if let Some(why) = sites::against_ground(Place::to_end_at(site.position), &on_ground) {
                self.say(
                    Some(entry.height_span()),
                    format!("site `{}` {why}", site.name),
                    "one of the two heights is wrong",
                );
            }
        }
    }

    /// Where the mission begins, flies to and ends, against each area.
    fn sites(&mut self, file: &MissionFile, objectives: &[Objective], areas: &[Area], spans: &[Range<usize>]) {
        let start = Place::to_end_at(Ned::default());
        for (span, area) in spans.iter().zip(areas).filter(|(_, it)| it.always_applies()) {
            if let Some(unfit) = sites::unfit(start, area) {
                let message = format!("the take-off point {}", unfit.in_words());
                self.say(Some(span.clone()), message, unfit.help());
            }
        }
        for (index, (entry, objective)) in file.objective.iter().zip(objectives).enumerate() {
            // In a free order any of them may be the last.
            let is_last = file.order == Order::Free || index + 1 == objectives.len();
            // As many areas as objectives make very many pairs.
            if self.mistakes.is_full() {
                return;
            }
            for area in areas.iter().filter(|it| it.always_applies()) {
                let site = |position| {
                    let is_end = is_last && position == objective.position;
                    Place { position, flying: objective.flying, is_end }
                };
                let places = objective.places();
                let unfit = places.iter().find_map(|it| Some((it, sites::unfit(site(*it), area)?)));
                if let Some((place, unfit)) = unfit {
                    let message = format!("{} {}", objective.in_words(*place), unfit.in_words());
                    self.say(Some(entry.place_span()), message, unfit.help());
                }
                for (skill, span, at) in self.task_places(entry, objective) {
                    if let Some(unfit) = sites::unfit(site(at), area) {
                        let message = format!("`{skill}` at a height of {} m {}", at.height_m(), unfit.in_words());
                        self.say(Some(span), message, unfit.help());
                    }
                }
            }
        }
    }

    fn within(&mut self, key: &str, value: &Spanned<f64>, least: f64, most: f64) -> f64 {
        let number = *value.as_ref();
        if !(least..=most).contains(&number) {
            let message = format!("`{key}` is {number}, expected metres between {least} and {most}");
            self.say(Some(value.span()), message, "");
        }
        number
    }

    fn moment(&mut self, text: &Spanned<String>) -> Option<i64> {
        let parsed = humantime::parse_rfc3339_weak(text.as_ref()).ok();
        let millis =
            parsed.and_then(|it| it.duration_since(std::time::UNIX_EPOCH).ok()).map(|it| it.as_millis() as i64);
        if millis.is_none() {
            let message = format!("found `{}`, expected a UTC date and time", text.as_ref());
            self.say(Some(text.span()), message, "write it like 2026-05-01T08:00:00Z");
        }
        millis
    }

    fn distinct<'n>(&mut self, what: &str, names: impl Iterator<Item = &'n Spanned<String>>) {
        let mut seen: Vec<&str> = Vec::new();
        for name in names {
            if seen.contains(&name.as_ref().as_str()) {
                self.say(
                    Some(name.span()),
                    format!("two {what}s with the name `{}`", name.as_ref()),
                    "give each its own",
                );
            }
            seen.push(name.as_ref());
        }
    }
}

#[cfg(test)]
mod tests;
