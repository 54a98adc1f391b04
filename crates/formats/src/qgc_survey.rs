//! A survey of QGroundControl (`SurveyComplexItem`): the same polygon, angle and spacing, flown by our own lines.
//!
//! Its angle is the heading of its lines, clockwise from north; its spacing is the footprint of its camera across the flight, less
//! the overlap. What our survey cannot do (follow the terrain, fly the field twice) keeps the item a list of waypoints.

use domain::geodesy::LatLon;
use domain::survey::LEAST_SPACING_M;

use crate::content::{Height, Reference, Survey};
use crate::findings::Wrong;
use crate::json::Node;
use crate::shape::{self, Order};

/// The survey and its height, or why the item cannot be read as one.
pub(crate) fn read(item: &Node<'_>) -> Result<Result<(Survey, Height), &'static str>, Wrong> {
    if item.get("complexItemType").and_then(|it| it.value.as_str()) != Some("survey") {
        return Ok(Err("no survey"));
    }
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
    let corners: Vec<LatLon> = shape::places(&polygon, Order::LatitudeFirst)?;
    let heading_deg = item.get("angle").map(|it| it.number()).transpose()?;
    Ok(Ok((Survey { corners, spacing_m, heading_deg }, Height { metres: distance.number()?, above })))
}

/// What the height of a survey is counted from; `None`: the ground below. Newer files name a mode
/// (`QGroundControlQmlGlobal::AltMode`: 1 is above the take-off point, 2 above sea level), older ones only say whether it is the take-off point.
fn reference(camera: &Node<'_>) -> Result<Option<Reference>, Wrong> {
    if let Some(mode) = camera.get("DistanceMode") {
        return Ok(match mode.number()? as i64 {
            1 => Some(Reference::TakeOff),
            2 => Some(Reference::SeaLevel),
            _ => None,
        });
    }
    let is_relative = camera.get("DistanceToSurfaceRelative").map_or(Ok(true), |it| it.boolean())?;
    Ok(Some(if is_relative { Reference::TakeOff } else { Reference::SeaLevel }))
}
