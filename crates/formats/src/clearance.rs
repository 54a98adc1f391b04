//! Legs to and from places whose heights are above the ground: what is safe for a program that follows the ground may not be for a straight line.

use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;

use crate::content::{Reference, Waypoint};
use crate::findings::Wrong;
use crate::heights::Terrain;

/// Between the places of a leg at which the ground is looked up, in metres: a third of what a model of one arc second resolves.
const STEP_M: f64 = 10.0;
/// The part of the lower of a leg's two heights above the ground that is left over the highest ground between them.
const LEAST_PART: f64 = 0.5;

/// What is wrong with the legs that begin or end at a place in flight that is given above the ground. A leg is straight in space, and level
/// after a takeoff; it comes nowhere nearer to the ground than half of the lower height above it of its two ends. The way down to a landing
/// is not looked at.
pub(crate) fn of_legs(waypoints: &[Waypoint], frame: &LocalFrame, terrain: Terrain<'_>) -> Vec<Wrong> {
    let before = std::iter::once(None).chain(waypoints.iter().map(Some));
    before.zip(waypoints).filter_map(|(from, to)| of_leg(from, to, frame, terrain)).collect()
}

fn of_leg(from: Option<&Waypoint>, to: &Waypoint, frame: &LocalFrame, terrain: Terrain<'_>) -> Option<Wrong> {
    let in_flight = from.filter(|it| it.flying);
    let is_above_ground = |it: &Waypoint| it.height.above == Reference::Ground;
    let is_survey = |it: &Waypoint| it.survey.is_some();
    let is_checked = to.flying && (is_above_ground(to) || in_flight.is_some_and(is_above_ground));
    if !is_checked || is_survey(to) || from.is_some_and(is_survey) {
        return None;
    }
    let place = |it: &Waypoint| it.at.known().map_or(Ned::default(), |at| frame.local(at));
    // Without the ground at its ends a leg was refused already.
    let position = |it: &Waypoint| Some(place(it).at_height(terrain.height_m(it.height, it.at.known())?));
    let end = position(to)?;
    let begin = match in_flight {
        Some(from) => position(from)?,
        None => from.map_or(Ned::default(), place).at_height(end.height_m()),
    };
    let name = from.map_or("the take-off point", |it| &it.name);
    let leg = format!("the leg from `{name}`");
    let clearance_m = |here: Ned| {
        let at = frame.lat_lon(here);
        terrain.ground_m(at).map(|ground_m| here.height_m() - ground_m).ok_or(at)
    };
    let unknown = |at: LatLon| {
        let message = format!("{leg} leads over {at}, where the ground is not known");
        Wrong::at(&to.source, message, "add its tile to the folder, or give the height above the take-off point")
    };
    let steps = (begin.horizontal_distance_m(end) / STEP_M).ceil().max(1.0) as u32;
    let mut lowest = (f64::INFINITY, begin);
    for step in 0..=steps {
        let here = begin.towards(end, f64::from(step) / f64::from(steps));
        match clearance_m(here) {
            Ok(clearance_m) if clearance_m < lowest.0 => lowest = (clearance_m, here),
            Ok(_) => {}
            Err(at) => return Some(unknown(at)),
        }
    }
    let (Ok(at_begin_m), Ok(at_end_m)) = (clearance_m(begin), clearance_m(end)) else { return None };
    let least_m = LEAST_PART * at_begin_m.min(at_end_m);
    let (found_m, here) = lowest;
    (found_m < least_m).then(|| {
        let at = frame.lat_lon(here);
        let message = format!(
            "{leg} comes within {found_m:.0} m of the ground at {at}, expected {least_m:.0} m: half of the lower of its two heights above the ground"
        );
        Wrong::at(&to.source, message, "add a place to fly to there, or fly higher")
    })
}
