//! A survey of QGroundControl (`SurveyComplexItem`): the same polygon, angle and spacing, flown by our own lines.
//!
//! Its angle is the heading of its lines, clockwise from north; its spacing is the footprint of its camera across the flight, less
//! the overlap, and its footprint along the flight is the distance between two pictures. What our survey cannot do (follow the
//! terrain, fly the field twice) keeps the item a list of waypoints.

use domain::geodesy::LatLon;
use domain::mission::terms::Terms;
use domain::survey::LEAST_SPACING_M;

use super::action;
use super::commands::CAMERA_DISTANCE;
use super::item::{Item, NO_PLACE};
use crate::content::{Height, Place, Reference, Survey, Waypoint};
use crate::findings::Wrong;
use crate::json::Node;
use crate::shape::{self, Order};

/// The survey as a place to fly to, or why the item cannot be read as one.
pub(super) fn read(item: &Node<'_>) -> Result<Result<Waypoint, &'static str>, Wrong> {
    let style = item.get("TransectStyleComplexItem");
    let flag =
        |node: Option<&Node<'_>>, key: &str| node.and_then(|it| it.get(key)).map_or(Ok(false), |it| it.boolean());
    let camera = style.as_ref().and_then(|it| it.get("CameraCalc"));
    let (Some(polygon), Some(camera)) = (item.get("polygon"), camera) else {
        return Ok(Err("its polygon or its camera is missing"));
    };
    let (Some(spacing), Some(distance)) = (camera.get("AdjustedFootprintSide"), camera.get("DistanceToSurface")) else {
        return Ok(Err("its spacing or its height is missing"));
    };
    if flag(style.as_ref(), "FollowTerrain")? {
        return Ok(Err("it follows the terrain"));
    }
    if flag(style.as_ref(), "Refly90Degrees")? {
        return Ok(Err("it is flown twice"));
    }
    if flag(Some(item), "flyAlternateTransects")? {
        return Ok(Err("it skips every second line"));
    }
    let spacing_m = spacing.number()?;
    if spacing_m < LEAST_SPACING_M {
        return Ok(Err("its lines are closer together than 5 m"));
    }
    let Some(above) = reference(&camera)? else { return Ok(Err("its height is above the terrain")) };
    let height = Height { metres: distance.number()?, above };
    let corners: Vec<LatLon> = shape::places(&polygon, Order::LatitudeFirst)?;
    let heading_deg = item.get("angle").map(|it| it.number()).transpose()?;
    let every_m = camera.get("AdjustedFootprintFrontal").map(|it| it.number()).transpose()?.filter(|it| 0.0 < *it);
    let survey = Some(Survey { corners, spacing_m, picture_distance_m: every_m, heading_deg });
    let actions = every_m.map(|it| pictures(item, it)).transpose()?.into_iter().collect();
    let (terms, source) = (Terms { actions, ..Terms::default() }, item.place.clone());
    Ok(Ok(Waypoint { name: "survey".into(), at: Place::Here, height, flying: true, terms, survey, source }))
}

/// A picture every `every_m` metres, the first one at once.
fn pictures(item: &Node<'_>, every_m: f64) -> Result<String, Wrong> {
    let params = [every_m, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    action::text(&Item::of(&item.place, CAMERA_DISTANCE, NO_PLACE, params), "MAV_CMD_DO_SET_CAM_TRIGG_DIST")
}

/// What the height of a survey is counted from; `None`: the ground below. Newer files name a mode
/// (`QGroundControlQmlGlobal::AltMode`: 1 is above the take-off point, 2 above sea level), older ones only say whether it is the take-off point.
fn reference(camera: &Node<'_>) -> Result<Option<Reference>, Wrong> {
    if let Some(mode) = camera.get("DistanceMode") {
        return Ok(match mode.whole()? {
            1 => Some(Reference::TakeOff),
            2 => Some(Reference::SeaLevel),
            _ => None,
        });
    }
    let is_relative = camera.get("DistanceToSurfaceRelative").map_or(Ok(true), |it| it.boolean())?;
    Ok(Some(if is_relative { Reference::TakeOff } else { Reference::SeaLevel }))
}
