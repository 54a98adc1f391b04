//! Where on a way to wait for which permissions: at a stand-off before each border that is entered
//! without one, beginning with the border nearest the goal.

use std::time::Duration;

use domain::airspace::Motion;
use domain::geometry::Ned;
use domain::way::{Asked, TimedWay};

use crate::airspace::Airspace;
use crate::rules::Rules;

/// A part of a way, flown as one step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Section {
    /// Where it ends.
    pub to: Ned,
    /// When it ends.
    pub at: Duration,
    /// Zones to be asked for during it, in the order in which they are entered later.
    pub ask: Vec<usize>,
}

/// Two points this close on a way are one, in metres: a step ends this near to its goal.
pub(crate) const SAME_PLACE_M: f64 = 1.0;

/// `way` cut into sections, for a plan that has asked for `asked` before.
pub(crate) fn sections(way: &TimedWay, airspace: &Airspace, asked: &Asked, rules: &Rules) -> Vec<Section> {
    let milestones = milestones(&way.points);
    // The vehicle does not wait on the way out of an area.
    let earliest_m = milestones.get(way.legs_out).copied().unwrap_or(0.0);
    let borders = borders(way, &milestones, airspace, asked, rules);
    let waits = group(borders, rules.aircraft.flight.stand_off_m.get(), earliest_m);
    let mut sections: Vec<(f64, Section)> = std::iter::zip(&milestones, std::iter::zip(&way.points, &way.at))
        .skip(1)
        .map(|(at_m, (to, at))| (*at_m, Section { to: *to, at: *at, ask: Vec::new() }))
        .collect();
    for wait in waits {
        // The end of a section just before the wait serves as well, maybe for several waits.
        let is_here = |at_m: f64| at_m <= wait.at_m && wait.at_m - at_m < SAME_PLACE_M;
        match sections.iter_mut().find(|(at_m, _)| is_here(*at_m)) {
            Some((_, section)) => _ = section.ask.splice(0..0, wait.ask),
            None => {
                let (to, at) = point_at(wait.at_m, way, &milestones);
                let position = sections.partition_point(|(at_m, _)| *at_m < wait.at_m);
                sections.insert(position, (wait.at_m, Section { to, at, ask: wait.ask }));
            }
        }
    }
    sections.into_iter().map(|(_, it)| it).collect()
}

/// The distance of each point of the way from its start, in metres along it.
fn milestones(points: &[Ned]) -> Vec<f64> {
    let mut at_m = 0.0;
    let legs = points.windows(2).map(|leg| leg[0].distance_m(leg[1]));
    std::iter::once(0.0)
        .chain(legs.map(|it| {
            at_m += it;
            at_m
        }))
        .collect()
}

struct Border {
    at_m: f64,
    zone: usize,
}

/// Where each barred zone is entered for the first time, in order. Once asked for, it may be left
/// and entered again.
fn borders(way: &TimedWay, milestones: &[f64], airspace: &Airspace, asked: &Asked, rules: &Rules) -> Vec<Border> {
    let mut asked = asked.clone();
    let mut found = Vec::new();
    let legs = std::iter::zip(way.points.windows(2), &way.at);
    // Nothing is asked for to get out.
    for ((leg, begins), start_m) in std::iter::zip(legs, milestones).skip(way.legs_out) {
        let motion = Motion { begins: *begins, ..Motion::in_air(rules.speeds()) };
        for (fraction, zone) in airspace.first_entries(leg[0], leg[1], motion, &asked) {
            asked.insert(zone);
            found.push(Border { at_m: start_m + fraction * leg[0].distance_m(leg[1]), zone });
        }
    }
    found
}

struct Wait {
    at_m: f64,
    ask: Vec<usize>,
}

/// One wait per border, from the goal backwards. A border between the wait and the border it is for
/// would be crossed before the wait, so it shares it, which then lies before that one too.
fn group(mut borders: Vec<Border>, stand_off_m: f64, earliest_m: f64) -> Vec<Wait> {
    let mut waits = Vec::new();
    while let Some(last) = borders.pop() {
        let mut wait = Wait { at_m: (last.at_m - stand_off_m).max(earliest_m), ask: vec![last.zone] };
        while let Some(near) = borders.pop_if(|it| wait.at_m <= it.at_m) {
            wait.at_m = (near.at_m - stand_off_m).max(earliest_m);
            wait.ask.insert(0, near.zone);
        }
        waits.push(wait);
    }
    waits
}

fn point_at(at_m: f64, way: &TimedWay, milestones: &[f64]) -> (Ned, Duration) {
    let leg = milestones.partition_point(|it| *it <= at_m).clamp(1, milestones.len() - 1);
    let (start_m, end_m) = (milestones[leg - 1], milestones[leg]);
    let fraction = if end_m > start_m { ((at_m - start_m) / (end_m - start_m)).clamp(0.0, 1.0) } else { 0.0 };
    let (before, after) = (way.at[leg - 1], way.at[leg]);
    let at = before.saturating_add(after.saturating_sub(before).mul_f64(fraction));
    (way.points[leg - 1].towards(way.points[leg], fraction), at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_closer_than_the_stand_off_share_a_wait() {
        #[track_caller]
        fn check(borders_m: &[f64], earliest_m: f64, expected: &[(f64, &[usize])]) {
            let borders = borders_m.iter().enumerate().map(|(zone, &at_m)| Border { at_m, zone }).collect();
            let waits = group(borders, 20.0, earliest_m);
            let waits: Vec<_> = waits.iter().map(|it| (it.at_m, it.ask.as_slice())).collect();
            assert_eq!(waits, expected, "{borders_m:?}");
        }
        check(&[100.0, 200.0], 0.0, &[(180.0, &[1]), (80.0, &[0])]);
        check(&[100.0, 115.0, 130.0], 0.0, &[(80.0, &[0, 1, 2])]);
        check(&[100.0, 120.0], 0.0, &[(80.0, &[0, 1])]);
        check(&[100.0, 121.0], 0.0, &[(101.0, &[1]), (80.0, &[0])]);
        check(&[5.0, 10.0], 0.0, &[(0.0, &[0, 1])]);
        check(&[35.0, 45.0], 30.0, &[(30.0, &[0, 1])]);
    }
}
