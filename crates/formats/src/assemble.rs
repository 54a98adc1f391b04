//! One mission of several files: what was read, in the local frame of one origin.

use std::collections::BTreeSet;

use domain::file::{Mistake, Mistakes};
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::Ned;
use domain::ground::GroundModel;
use domain::hours::WeeklyHours;
use domain::mission::bounds::LONGEST_NAME;
use geo::{Contains as _, Polygon};

use crate::Import;
use crate::clearance;
use crate::content::{Height, Reference, Rule, Site, Survey, Waypoint, Zone};
use crate::export::utc;
use crate::findings::{Findings, Note, Wrong};
use crate::heights::{self, Band, Terrain};
use crate::local::{self, Side};
use crate::mission_file::{AreaEntry, MissionFile, ObjectiveEntry, SiteEntry, SurveyEntry, corner, one_line};

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
pub fn assemble(mission: &Import, others: &[Import], settings: &Settings<'_>) -> Result<Assembled, Mistakes> {
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
        frame: LocalFrame::at(origin.place),
        terrain,
        names: Names::default(),
        areas: Vec::new(),
        fences: Vec::new(),
    };
    let (mut notes, mut mistakes) = (Vec::new(), Vec::new());
    mistakes.extend(terrain.contradiction(origin, &mission.path));
    let (mut objectives, mut sites) = (Vec::new(), Vec::new());
    for (index, import) in std::iter::once(mission).chain(others).enumerate() {
        let mut findings = Findings::about(&import.path);
        for zone in &import.content.zones {
            let outcome = assembly.zone(zone, &mut findings);
            findings.unless_wrong(outcome);
        }
        if index == 0 {
            let converted = import.content.waypoints.iter().map(|it| assembly.objective(it, origin, &mut findings));
            let converted: Vec<_> = converted.collect();
            objectives = converted.into_iter().filter_map(|it| findings.unless_wrong(it)).collect();
            for wrong in clearance::of_legs(&import.content.waypoints, &assembly.frame, terrain) {
                findings.wrong(wrong);
            }
            let converted: Vec<_> = import.content.sites.iter().map(|it| assembly.site(it, &mut findings)).collect();
            sites = converted.into_iter().filter_map(|it| findings.unless_wrong(it)).collect();
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
        origin: Origin { altitude_m: terrain.altitude_m, ..origin },
        order: mission.content.order,
        objectives,
        areas: assembly.areas,
        sites,
    };
    let (objectives, areas, sites) = (file.objectives.len(), file.areas.len(), file.sites.len());
    let assembled = Assembled { text: file.text(), notes, objectives, areas, sites };
    Mistakes(mistakes).or(assembled)
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
    frame: LocalFrame,
    terrain: Terrain<'a>,
    names: Names,
    areas: Vec<AreaEntry>,
    /// What is not left, to be checked against the places.
    fences: Vec<Polygon<f64>>,
}

impl Assembly<'_> {
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
        local::checked(&outline, &zone.source)?;
        let parts = Assembly::cut(outline, zone, findings);
        let corners = parts.iter().flat_map(|it| local::corners(it.exterior()));
        let terrain = self.terrain.over(zone, corners.map(|it| self.frame.lat_lon(it)));
        let Some(band) = heights::band(zone, terrain, findings)? else { return Ok(()) };
        let kind = if zone.rule == Rule::Permission { "permission" } else { "keep-out" };
        for part in &parts {
            self.add(zone, kind, part, band)?;
        }
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
        let utc = |moment: Option<i64>| moment.map(utc);
        self.areas.push(AreaEntry {
            remarks: zone.remarks.clone(),
            name: self.names.unique(&zone.name, "area"),
            kind,
            corners_deg: corners.iter().map(|it| corner(self.frame.lat_lon(*it))).collect(),
            floor_m: band.floor_m,
            ceiling_m: band.ceiling_m,
            from_utc: utc(zone.window.from_utc_ms),
            until_utc: utc(zone.window.until_utc_ms),
            hours_utc: zone.hours.as_ref().map(WeeklyHours::to_texts).unwrap_or_default(),
        });
        Ok(())
    }

    fn objective(
        &mut self,
        waypoint: &Waypoint,
        origin: Origin,
        findings: &mut Findings,
    ) -> Result<ObjectiveEntry, Wrong> {
        let Height { metres, above } = waypoint.height;
        if waypoint.flying && above == Reference::Ground && metres <= 0.0 {
            let message = format!("it is flown to at {metres} m above the ground");
            return Err(Wrong::at(&waypoint.source, message, "give it a height above 0"));
        }
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
            height_m: self.height_m(waypoint.height, waypoint.at, &waypoint.source, findings)?,
            flying: waypoint.flying,
            terms: (&waypoint.terms).into(),
            survey,
        })
    }

    /// A survey whose lines can be flown, with all corners inside of all fences.
    fn survey(&self, survey: &Survey, waypoint: &Waypoint) -> Result<SurveyEntry, Wrong> {
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

/// Names that were given.
#[derive(Default)]
struct Names(BTreeSet<(&'static str, String)>);

impl Names {
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
