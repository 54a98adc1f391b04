//! One mission of several files: what was read, in the local frame of one origin.

use std::collections::BTreeMap;
use std::path::PathBuf;

use domain::file::{Mistake, Mistakes};
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::Ned;
use domain::ground::GroundModel;
use domain::hours::WeeklyHours;
use domain::mission::bounds::LONGEST_NAME;
use geo::{Contains as _, Polygon};

use crate::clearance;
use crate::content::{
    Content, Doubt, Height, Lost, Outline, Period, Place, Reference, Rule, Site, Survey, Unused, Waypoint, Zone,
};
use crate::export::utc;
use crate::findings::{Findings, Note, Refused, Wrong};
use crate::heights::{self, Band, Terrain};
use crate::local::{self, Side};
use crate::mission_file::{
    AreaEntry, FeedEntry, MissionFile, ObjectiveEntry, SiteEntry, SurveyEntry, corner, one_line,
};
use crate::{Format, Import, LeaveOut, leave_out};

const FAR: &str = "it lies more than 100 km from the take-off point: left out";
const STRICT: &str = "correct it, or import without --strict: the zone then bars more";

/// What the files do not say.
#[derive(Debug, Clone)]
pub struct Settings<'a> {
    /// The mission's name.
    pub name: String,
    /// The take-off point, before the one that the mission's own file names.
    pub origin: Option<Origin>,
    /// The ground lies at most this much above or below the take-off point, in metres.
    pub relief_m: Option<f64>,
    /// The ground, where it is known.
    pub ground: Option<&'a dyn GroundModel>,
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
pub fn assemble(mission: &Import, others: &[Import], settings: &Settings<'_>) -> Result<Assembled, Refused> {
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
    settings: &Settings<'_>,
) -> Result<Assembled, Refused> {
    let content = Content { origin: Some(origin), ..Content::default() };
    let leave_out = LeaveOut::default();
    let none = Import { path: PathBuf::new(), format: Format::GeoJson, content, notes: Vec::new(), leave_out };
    let (file, notes) = build(&none, files, &Settings { origin: Some(origin), ..settings.clone() }, taken)?;
    Ok(Assembled { text: file.airspace_text(), notes, objectives: 0, areas: file.areas.len(), sites: 0 })
}

fn build(
    mission: &Import,
    others: &[Import],
    settings: &Settings<'_>,
    taken: &[String],
) -> Result<(MissionFile, Vec<Note>), Refused> {
    let origin = settings.origin.or(mission.content.origin).ok_or_else(|| {
        Mistakes(vec![Mistake {
            path: mission.path.clone(),
            place: None,
            message: "the take-off point is not known".into(),
            help: "give it with --origin LATITUDE,LONGITUDE[,ALTITUDE]".into(),
        }])
    })?;
    let terrain = Terrain::at(origin, settings.relief_m, settings.ground);
    let mut assembly = Assembly {
        origin: origin.place,
        frame: LocalFrame::at(origin.place),
        here: origin.place,
        terrain,
        names: Names::default(),
        areas: Vec::new(),
        fences: Vec::new(),
        strict: settings.strict,
        feed: None,
    };
    taken.iter().for_each(|it| assembly.names.take(it, "area"));
    let mut feeds = Vec::new();
    let (mut notes, mut mistakes) = (Vec::new(), Vec::new());
    mistakes.extend(terrain.contradiction(origin, &mission.path));
    let (mut objectives, mut sites) = (Vec::new(), Vec::new());
    let mut leave_outs = Vec::new();
    for (index, import) in std::iter::once(mission).chain(others).enumerate() {
        let mut findings = Findings::about(&import.path).leaving_out(import.leave_out.clone());
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
            if findings.leaves_out(&zone.source, &zone.name) {
                continue;
            }
            let outcome = assembly.zone(zone, &mut findings);
            findings.unless_wrong(outcome);
        }
        let is_empty = assembly.areas.len() == before && !findings.has_mistakes() && !findings.has_left_out();
        if 0 < index && is_empty && !settings.allow_empty {
            let help = "give --allow-empty if it limits no flight";
            findings.wrong(Wrong::at("", format!("no area was found in this file ({})", import.format), help));
        }
        for unused in &import.content.unused {
            let Unused { what, source } = unused;
            if index == 0 {
                let help = "say what it is by its property `kind`, or leave it out with --leave-out";
                findings.wrong(Wrong::at(source, format!("a {what} without `kind`"), help));
            } else {
                findings.note(source, format!("a {what} without a radius: left out"));
            }
        }
        if index == 0 {
            let mut flown = Vec::new();
            for waypoint in &import.content.waypoints {
                if !findings.leaves_out(&waypoint.source, &waypoint.name) {
                    let converted = assembly.objective(waypoint, origin, &mut findings);
                    if let Some((entry, place)) = findings.unless_wrong(converted) {
                        objectives.push(entry);
                        flown.push(Waypoint { at: place, ..waypoint.clone() });
                    }
                }
            }
            for wrong in clearance::of_legs(&flown, &assembly.frame, terrain) {
                findings.wrong(wrong);
            }
            for site in &import.content.sites {
                if !findings.leaves_out(&site.source, &site.name) {
                    let converted = assembly.site(site, &mut findings);
                    sites.extend(findings.unless_wrong(converted));
                }
            }
        } else {
            for waypoint in &import.content.waypoints {
                findings.note(&waypoint.source, "a place to fly to in a file of areas: left out");
            }
            for site in &import.content.sites {
                findings.note(&site.source, "a place to land at in a file of areas: left out");
            }
        }
        notes.extend(import.notes.iter().cloned());
        leave_outs.push((import.path.as_path(), findings.leave_out().clone()));
        match findings.with(()) {
            Ok(((), found)) => notes.extend(found),
            Err(found) => {
                notes.extend(found.notes);
                mistakes.extend(found.mistakes.0);
            }
        }
    }
    mistakes.extend(leave_out::unmatched(leave_outs.into_iter()));
    let file = MissionFile {
        name: one_line(&settings.name, LONGEST_NAME),
        remarks: remarks(mission, others),
        origin: Origin { altitude_m: terrain.altitude_m, ..origin },
        order: mission.content.order,
        objectives,
        areas: assembly.areas,
        sites,
        feeds,
    };
    if mistakes.is_empty() {
        return Ok((file, notes));
    }
    Err(Refused { mistakes: Mistakes(mistakes), notes })
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

struct Assembly<'a> {
    origin: LatLon,
    frame: LocalFrame,
    /// Where the vehicle is after the places so far.
    here: LatLon,
    terrain: Terrain<'a>,
    names: Names,
    areas: Vec<AreaEntry>,
    /// What is not left, to be checked against the places.
    fences: Vec<Polygon<f64>>,
    /// Whether a zone that is not understood is a mistake.
    strict: bool,
    /// The name of the feed that areas come from now.
    feed: Option<String>,
}

impl Assembly<'_> {
    fn zone(&mut self, zone: &Zone, findings: &mut Findings) -> Result<(), Wrong> {
        let side = if zone.rule == Rule::StayInside { Side::Inscribe } else { Side::Contain };
        if zone.rule != Rule::StayInside && self.is_far(&zone.outline) {
            findings.note(&zone.source, FAR);
            return Ok(());
        }
        let outline = local::polygon(&zone.outline, &self.frame, side);
        if zone.rule == Rule::StayInside {
            let fence = local::checked(outline, &zone.source, findings)?;
            self.inside(&fence, zone)?;
            findings.note(&zone.source, "a fence to stay inside is read as a keep-out area all round it");
            let band = Band { floor_m: None, ceiling_m: None };
            for part in local::frame_round(&fence) {
                self.add(zone, "keep-out", &part, band)?;
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
            findings.note(&zone.source, FAR);
            return Ok(());
        }
        for doubt in &zone.doubts {
            let Doubt { place, message } = doubt;
            self.doubt(Wrong::at(place, message.clone(), STRICT), "it bars more", findings)?;
        }
        let hull = local::hull(&outline);
        let outline = match local::checked(outline, &zone.source, findings) {
            Ok(outline) => outline,
            Err(wrong) => {
                self.doubt(wrong, "it covers all that its corners enclose", findings)?;
                local::checked(hull, &zone.source, findings)?
            }
        };
        let mut zone = zone.clone();
        if let Some(wrong) = heights::exchanged(&zone) {
            self.doubt(wrong, "it has no limits of height", findings)?;
            (zone.lower, zone.upper) = (None, None);
        }
        let zone = &zone;
        let parts = local::cut(outline);
        let corners = parts.iter().flat_map(|it| local::corners(it.exterior()));
        let terrain = self.terrain.over(zone, corners.map(|it| self.frame.lat_lon(it)));
        let Some(band) = heights::band(zone, terrain, findings) else { return Ok(()) };
        let kind = if zone.rule == Rule::Permission { "permission" } else { "keep-out" };
        for part in &parts {
            self.add(zone, kind, part, band)?;
        }
        Ok(())
    }

    /// Whether a zone is out of reach, whatever the order of its numbers, as can be told without a projection. Most zones of a country
    /// are.
    fn is_far(&self, outline: &Outline) -> bool {
        let is_far = |it: &Outline| local::is_far(it, self.origin);
        is_far(outline) && local::exchanged(outline).is_none_or(|it| is_far(&it))
    }

    /// Something that was not understood, which is a mistake only for who asks for that.
    fn doubt(&self, wrong: Wrong, instead: &str, findings: &mut Findings) -> Result<(), Wrong> {
        if self.strict {
            return Err(wrong);
        }
        findings.loud(&wrong.place, &format!("{}: {instead}", wrong.message));
        Ok(())
    }

    /// A zone whose shape cannot be read does not matter if all its places that can be read are far away to one side: those of a zone round
    /// the take-off point may be far away, too.
    fn lost(&self, lost: &Lost, findings: &mut Findings) -> Result<(), Wrong> {
        if lost.places.is_empty() || !self.is_far(&Outline::polygon(lost.places.clone())) {
            return Err(lost.wrong.clone());
        }
        let text = format!("its shape cannot be read ({}), and it lies far away: left out", lost.wrong.message);
        findings.note(&lost.wrong.place, text);
        Ok(())
    }

    /// A fence that is not left has the take-off point in it: otherwise nothing could be flown.
    fn inside(&mut self, fence: &Polygon<f64>, zone: &Zone) -> Result<(), Wrong> {
        if !fence.contains(&geo::Point::new(0.0, 0.0)) {
            let message = "the take-off point lies outside of a fence to stay inside";
            return Err(Wrong::at(&zone.source, message, "move one of them, or leave the fence out"));
        }
        self.fences.push(fence.clone());
        Ok(())
    }

    fn add(&mut self, zone: &Zone, kind: &'static str, part: &Polygon<f64>, band: Band) -> Result<(), Wrong> {
        let area = local::area_of(part);
        // Cutting and framing may leave corners that touch.
        if !area.is_simple() {
            return Err(Wrong::at(&zone.source, "it has no simple outline where it is cut", "simplify it"));
        }
        let degrees = |ring: &Vec<Ned>| ring.iter().map(|it| corner(self.frame.lat_lon(*it))).collect();
        for Period { window, hours } in &zone.periods {
            self.areas.push(AreaEntry {
                remarks: zone.remarks.clone(),
                name: self.names.unique(&zone.name, "area"),
                kind,
                corners_deg: degrees(&area.corners),
                holes_deg: area.holes.iter().map(degrees).collect(),
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

    /// The entry, and its place as it is: no longer where the one before has ended.
    fn objective(
        &mut self,
        waypoint: &Waypoint,
        origin: Origin,
        findings: &mut Findings,
    ) -> Result<(ObjectiveEntry, Place), Wrong> {
        let Height { metres, above } = waypoint.height;
        if waypoint.flying && above == Reference::Ground && metres <= 0.0 {
            let message = format!("it is flown to at {metres} m above the ground");
            return Err(Wrong::at(&waypoint.source, message, "give it a height above 0"));
        }
        let at = match waypoint.at {
            Place::At(at) => at,
            Place::TakeOff => origin.place,
            Place::Here => self.here,
        };
        let (survey, end) = match &waypoint.survey {
            Some(survey) => {
                let (entry, end) = self.survey(survey, waypoint)?;
                (Some(entry), end)
            }
            None => {
                self.within_fences(at, &waypoint.name, &waypoint.source)?;
                (None, at)
            }
        };
        self.here = end;
        let place = if at == origin.place { Place::TakeOff } else { Place::At(at) };
        let [latitude_deg, longitude_deg] = corner(at).map(|it| Some(it).filter(|_| survey.is_none()));
        let entry = ObjectiveEntry {
            name: self.names.unique(&waypoint.name, "objective"),
            latitude_deg,
            longitude_deg,
            height_m: self.height_m(waypoint.height, place.known(), &waypoint.source, findings)?,
            flying: waypoint.flying,
            terms: (&waypoint.terms).into(),
            survey,
        };
        Ok((entry, place))
    }

    /// A survey whose lines can be flown, with all corners inside of all fences; and where its last line ends.
    fn survey(&self, survey: &Survey, waypoint: &Waypoint) -> Result<(SurveyEntry, LatLon), Wrong> {
        if waypoint.height.above == Reference::Ground {
            let message = "a survey above the ground has no counterpart: all its lines are flown at one height";
            return Err(Wrong::at(
                &waypoint.source,
                message,
                "give its height above the take-off point, or leave it out",
            ));
        }
        for at in &survey.corners {
            self.within_fences(*at, &waypoint.name, &waypoint.source)?;
        }
        let corners = survey.corners.iter().map(|it| self.frame.local(*it)).collect();
        let lines = domain::survey::Survey::new(corners, survey.spacing_m, survey.heading_deg);
        let flown = lines.and_then(|it| it.with_pictures(survey.picture_distance_m)).map_err(|invalid| {
            Wrong::at(
                &waypoint.source,
                format!("a survey: {invalid}"),
                "change it in the program that made it, or leave it out",
            )
        })?;
        let end = flown.turns().last().map_or(self.here, |it| self.frame.lat_lon(it.at));
        let entry = SurveyEntry {
            corners_deg: survey.corners.iter().map(|it| corner(*it)).collect(),
            spacing_m: survey.spacing_m,
            picture_distance_m: survey.picture_distance_m,
            heading_deg: survey.heading_deg,
        };
        Ok((entry, end))
    }

    fn site(&mut self, site: &Site, findings: &mut Findings) -> Result<SiteEntry, Wrong> {
        self.within_fences(site.at, &site.name, &site.source)?;
        let [latitude_deg, longitude_deg] = corner(site.at);
        Ok(SiteEntry {
            name: self.names.unique(&site.name, "site"),
            kind: site.kind.word(),
            latitude_deg,
            longitude_deg,
            height_m: self.height_m(site.height, Some(site.at), &site.source, findings)?,
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

    /// How high a place is above the take-off point, which it is itself without `at`.
    fn height_m(
        &self,
        height: Height,
        at: Option<LatLon>,
        source: &str,
        findings: &mut Findings,
    ) -> Result<f64, Wrong> {
        match self.terrain.height_m(height, at) {
            Some(height_m) => Ok((height_m * 100.0).round() / 100.0 + 0.0),
            None if height == Height::ON_GROUND => {
                let text = "the ground there is not known: it counts as high as the take-off point; see --ground";
                findings.note(source, text);
                Ok(0.0)
            }
            None if height.above == Reference::Ground => {
                let message = "its height is above the ground, which is not known there";
                Err(Wrong::at(source, message, "give a model of the ground with --ground, or another frame"))
            }
            None => {
                let help = "give the take-off point's altitude as the third number of --origin";
                Err(Wrong::at(source, "its height cannot be counted from the take-off point", help))
            }
        }
    }
}

/// Names that were given, with the number that each was given last: a feed may have ten thousand zones of one name.
#[derive(Default)]
struct Names(BTreeMap<(&'static str, String), u32>);

impl Names {
    /// Something else has this name.
    fn take(&mut self, name: &str, among: &'static str) {
        self.0.insert((among, name.to_owned()), 1);
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
        let last = self.0.get(&(among, wanted.clone())).copied();
        let free = |it: &(u32, String)| !self.0.contains_key(&(among, it.1.clone()));
        let (number, name) = match last {
            None => (1, wanted.clone()),
            Some(last) => {
                let candidates = (last + 1..).map(|number| (number, numbered(number)));
                candidates.into_iter().find(free).unwrap_or_else(|| (last, wanted.clone()))
            }
        };
        self.0.insert((among, wanted), number);
        self.0.entry((among, name.clone())).or_insert(1);
        name
    }
}
