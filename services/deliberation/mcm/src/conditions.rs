//! Whether the state meets a step's precondition or invariant.

use kittiwake_proto::v1;

use crate::vehicle::Vehicle;
use crate::world::World;

/// The first clause that is not met.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unmet {
    pub(crate) what: &'static str,
    pub(crate) found: String,
    pub(crate) wanted: String,
}

impl std::fmt::Display for Unmet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} is {}, wanted {}", self.what, self.found, self.wanted)
    }
}

/// The first clause of `condition` that the world does not meet. The flight mode is only judged once the skill
/// that executes has been seen to fly its own.
pub(crate) fn first_unmet(condition: &v1::Condition, world: &World, judge_mode: bool) -> Option<Unmet> {
    let Some(vehicle) = world.vehicle else {
        let (found, wanted) = ("unknown".to_owned(), "data from the monitor".to_owned());
        return Some(Unmet { what: "the vehicle's state", found, wanted });
    };
    flying(condition, &vehicle)
        .or_else(|| mode(condition, &vehicle).filter(|_| judge_mode))
        .or_else(|| permission(condition, world))
}

fn flying(condition: &v1::Condition, vehicle: &Vehicle) -> Option<Unmet> {
    let wanted = condition.flying.filter(|it| *it != vehicle.flying)?;
    let word = |flying| if flying { "in the air" } else { "on the ground" }.to_owned();
    Some(Unmet { what: "the vehicle", found: word(vehicle.flying), wanted: word(wanted) })
}

fn mode(condition: &v1::Condition, vehicle: &Vehicle) -> Option<Unmet> {
    condition.mode?;
    let wanted = condition.mode();
    if wanted == vehicle.mode {
        return None;
    }
    let word = |mode: v1::FlightMode| mode.as_str_name().trim_start_matches("FLIGHT_MODE_").to_lowercase();
    Some(Unmet { what: "the flight mode", found: word(vehicle.mode), wanted: word(wanted) })
}

fn permission(condition: &v1::Condition, world: &World) -> Option<Unmet> {
    let held = |area: &&String| world.permissions.holds(area, world.now.time, world.limits.permission_margin);
    let missing = condition.permissions.iter().find(|it| !held(it))?;
    let (found, wanted) = ("not held".to_owned(), format!("to enter area {missing}"));
    Some(Unmet { what: "the permission", found, wanted })
}
