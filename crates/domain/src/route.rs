//! Straight ways through the areas of a mission: which areas they enter, and how far the vehicle may fly without
//! entering any.
//!
//! Shared by the planner, which asks for permissions, and the mission manager, which must not enter
//! an area while it waits for them. Ways round areas are found elsewhere.

use crate::area::{Area, AreaKind};
use crate::geometry::Ned;
use crate::skill::Goal;

/// A transition shorter than this is not flown, in metres.
pub const WORTH_FLYING_M: f64 = 1.0;

/// The part of the vehicle's state on which a transition depends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whereabouts {
    /// Its position.
    pub position: Ned,
    /// Whether it is in the air.
    pub flying: bool,
}

/// How a transition is flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransitionLimits {
    /// Slower than the plan's own speed, so that the vehicle is still near when a new plan comes.
    pub speed_m_s: f64,
    /// Distance kept to a border that may not be crossed, in metres.
    pub stand_off_m: f64,
}

/// Fractions of the straight way from `from` to `to` at which it enters `area`, ascending.
///
/// Leaving is not entering: a way that starts inside enters only where it comes back. Conservative
/// in height, as [`Area::is_crossed`] is.
pub fn entries(area: &Area, from: Ned, to: Ned) -> Vec<f64> {
    if !area.touches_heights(from.height_m(), to.height_m()) || passes_beside(area, from, to) {
        return Vec::new();
    }
    let polygon = area.polygon();
    let mut was_inside = area.contains(from);
    let mut found = Vec::new();
    for stretch in area.crossings(from, to).windows(2) {
        let middle = from.towards(to, (stretch[0] + stretch[1]) / 2.0);
        let inside = geo::Contains::contains(&polygon, &geo::Point::new(middle.east_m, middle.north_m));
        if inside && !was_inside {
            found.push(stretch[0]);
        }
        was_inside = inside;
    }
    found
}

/// Whether the vehicle may fly straight from `from` to `to` now: no area that applies is entered
/// except those whose permission is in `held`, and no keep-out area at all.
pub fn way_is_clear(from: Ned, to: Ned, areas: &[Area], held: &[String], utc_ms: i64) -> bool {
    barred(areas, held, utc_ms).all(|it| entries(it, from, to).is_empty())
}

/// The goal while no step is flown: in the direction of `step_goal`, slower, and only as far as
/// the next border that may not be crossed; otherwise stop.
///
/// The position goal holds at its target, so that a transition never ends by itself.
pub fn transition_goal(
    vehicle: Whereabouts,
    step_goal: &Goal,
    areas: &[Area],
    held: &[String],
    utc_ms: i64,
    limits: TransitionLimits,
) -> Goal {
    let Goal::Position { target, speed_limit_m_s, yaw_rad, .. } = *step_goal else { return Goal::Stop };
    let from = vehicle.position;
    // A vehicle inside an area without permission must not fly farther into it.
    let trespassing = barred(areas, held, utc_ms).any(|it| it.contains(from));
    if !vehicle.flying || trespassing {
        return Goal::Stop;
    }
    let way_m = from.distance_m(target);
    let border = barred(areas, held, utc_ms)
        .filter_map(|it| entries(it, from, target).first().copied())
        .map(|fraction| fraction * way_m - limits.stand_off_m);
    let allowed_m = border.fold(way_m, f64::min);
    if allowed_m < WORTH_FLYING_M {
        return Goal::Stop;
    }
    Goal::Position {
        target: from.towards(target, allowed_m / way_m),
        speed_limit_m_s: limits.speed_m_s.min(speed_limit_m_s),
        yaw_rad,
        hold_at_target: true,
    }
}

/// The areas that apply now and may not be entered.
pub(crate) fn barred<'a>(areas: &'a [Area], held: &'a [String], utc_ms: i64) -> impl Iterator<Item = &'a Area> {
    areas.iter().filter(move |it| it.is_active(utc_ms) && (it.kind == AreaKind::KeepOut || !held.contains(&it.name)))
}

/// Whether the bounding boxes do not touch: a cheap check that settles most pairs.
fn passes_beside(area: &Area, from: Ned, to: Ned) -> bool {
    let beside = |of: fn(&Ned) -> f64| {
        let (low, high) = (of(&from).min(of(&to)), of(&from).max(of(&to)));
        area.corners.iter().all(|it| of(it) < low) || area.corners.iter().all(|it| of(it) > high)
    };
    beside(|it| it.north_m) || beside(|it| it.east_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(name: &str, kind: AreaKind, corners: &[(f64, f64)]) -> Area {
        Area {
            name: name.into(),
            kind,
            corners: corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect(),
            floor_m: None,
            ceiling_m: Some(100.0),
            from_utc_ms: None,
            until_utc_ms: Some(1_000),
        }
    }

    fn square() -> Area {
        area("A", AreaKind::Permission, &[(-90.0, 100.0), (90.0, 100.0), (90.0, 300.0), (-90.0, 300.0)])
    }

    fn at(east: f64) -> Ned {
        Ned::new(0.0, east, -10.0)
    }

    #[test]
    fn entering_counts_and_leaving_does_not() {
        #[track_caller]
        fn check(area: &Area, from: Ned, to: Ned, expected: &[f64]) {
            assert_eq!(entries(area, from, to), expected, "{from:?} to {to:?}");
        }
        check(&square(), at(0.0), at(400.0), &[0.25]);
        check(&square(), at(200.0), at(400.0), &[]);
        check(&square(), at(0.0), at(100.0), &[]);
        check(&square(), at(100.0), at(200.0), &[0.0]);
        // From above the ceiling straight down is entering at once, as far as a leg's heights tell.
        check(&square(), at(200.0).at_height(110.0), at(200.0), &[0.0]);
        check(&square(), at(200.0).at_height(0.0), at(200.0), &[]);
        // A horseshoe is entered twice, or once more from inside one of its arms.
        let horseshoe = area(
            "U",
            AreaKind::Permission,
            &[
                (50.0, 0.0),
                (50.0, 400.0),
                (-50.0, 400.0),
                (-50.0, 300.0),
                (20.0, 300.0),
                (20.0, 100.0),
                (-50.0, 100.0),
                (-50.0, 0.0),
            ],
        );
        check(&horseshoe, at(-100.0), at(500.0), &[100.0 / 600.0, 400.0 / 600.0]);
        check(&horseshoe, at(50.0), at(450.0), &[250.0 / 400.0]);
    }

    #[test]
    fn a_way_is_clear_with_the_permission_or_once_the_area_no_longer_applies() {
        #[track_caller]
        fn check(kind: AreaKind, held: &[&str], utc_ms: i64, expected: bool) {
            let areas = [Area { kind, ..square() }];
            let held: Vec<String> = held.iter().map(|it| it.to_string()).collect();
            assert_eq!(way_is_clear(at(0.0), at(400.0), &areas, &held, utc_ms), expected, "{kind:?} {held:?} {utc_ms}");
        }
        check(AreaKind::Permission, &[], 0, false);
        check(AreaKind::Permission, &["A"], 0, true);
        check(AreaKind::Permission, &[], 1_000, true);
        check(AreaKind::KeepOut, &["A"], 0, false);
    }

    #[test]
    fn a_transition_goes_on_slower_and_stops_short_of_the_border() {
        const LIMITS: TransitionLimits = TransitionLimits { speed_m_s: 3.0, stand_off_m: 20.0 };
        #[track_caller]
        fn check(from: Ned, flying: bool, goal: Goal, held: &[String], expected: Option<Ned>) {
            let vehicle = Whereabouts { position: from, flying };
            let expected = expected.map_or(Goal::Stop, |it| position(it, 3.0, true));
            assert_eq!(transition_goal(vehicle, &goal, &[square()], held, 0, LIMITS), expected, "from {from:?}");
        }
        fn position(target: Ned, speed_limit_m_s: f64, hold_at_target: bool) -> Goal {
            Goal::Position { target, speed_limit_m_s, yaw_rad: None, hold_at_target }
        }
        let onward = position(at(400.0), 10.0, false);
        check(at(0.0), true, onward, &[], Some(at(80.0)));
        check(at(0.0), true, onward, &["A".into()], Some(at(400.0)));
        check(at(0.0), false, onward, &[], None);
        check(at(0.0), true, Goal::Land, &[], None);
        // At the stand-off, beyond it, and inside without permission.
        check(at(80.0), true, onward, &[], None);
        check(at(95.0), true, onward, &[], None);
        check(at(200.0), true, onward, &[], None);
        check(at(400.0), true, onward, &[], None);
    }
}
