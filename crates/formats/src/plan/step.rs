//! What an item of a plan means in a mission.

use std::time::Duration;

use domain::geodesy::LatLon;
use domain::mission::terms::Terms;

use super::action;
use super::commands::{self, Meaning};
use super::item::Item;
use crate::content::{Height, Place, Waypoint};
use crate::findings::{Findings, Weight, Wrong};

/// A step of a plan, before the jumps are made.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// The place of its item in the file.
    pub(super) place: String,
    /// The number by which a jump names it.
    pub(super) id: Option<i64>,
    /// What it does.
    pub(super) does: Does,
}

/// What a step does.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Does {
    /// Nothing that a mission knows of.
    Nothing,
    TakeOff,
    /// It leads to a place; after an end nothing is flown. The name has no number yet.
    Lead {
        to: Waypoint,
        is_end: bool,
    },
    /// It releases the load at the place before, or becomes an action.
    Release(String),
    Action(String),
    Stay(Duration),
    Jump {
        to: i64,
        times: u32,
    },
    LandingSequence,
}

/// What is said of an action.
pub(super) const KEPT: &str = "kept, not flown yet: a command to camera, gimbal, speed or other payload";
/// A place nearer to another one than this is the same, in metres.
const SAME_M: f64 = 5.0;
/// A jump more often than this makes more objectives than a mission may have.
const MOST_REPEATS: f64 = 500.0;

/// The steps of an item.
pub(super) fn of(item: &Item, home: Option<LatLon>, findings: &mut Findings) -> Result<Vec<Step>, Wrong> {
    let Some((_, name, meaning)) = commands::find(item.command) else {
        return unknown(item, findings).map(|does| vec![step(item, does)]);
    };
    let mut note = |text: &str| findings.note(&item.place, text);
    let does = match meaning {
        Meaning::Waypoint => lead(item, flown_to(item, seconds(item, 1)?, &mut note)?)?,
        Meaning::LoiterTime => lead(item, flown_to(item, seconds(item, 1)?, &mut note)?)?,
        Meaning::Spline => {
            note("a curve through its place has no counterpart: it is flown to straight");
            lead(item, flown_to(item, seconds(item, 1)?, &mut note)?)?
        }
        Meaning::LoiterTurns => {
            note("turns round a place have no counterpart: the place is flown to");
            lead(item, flown_to(item, Duration::ZERO, &mut note)?)?
        }
        Meaning::LoiterToHeight => {
            note("to circle until a height is reached has no counterpart: the place is flown to at that height");
            lead(item, waypoint(item, "waypoint", item.at()?, item.height()?, true))?
        }
        Meaning::LoiterForever => {
            note(
                "it would stay there for ever: the mission ends there, and the contingency table says what is flown then",
            );
            Does::Lead { to: flown_to(item, Duration::ZERO, &mut note)?, is_end: true }
        }
        Meaning::PayloadPlace => {
            note("a load to be placed is dropped from the height of its item: nothing descends with it");
            let mut to = waypoint(item, "waypoint", item.at()?, item.height()?, true);
            to.terms.drop = true;
            lead(item, to)?
        }
        Meaning::Land | Meaning::VtolLand => {
            if *meaning == Meaning::VtolLand {
                note("the vehicle is a multicopter: it lands like one");
            }
            if item.param(7) != 0.0 {
                note(
                    "the altitude of a landing is not that of the ground: it lands on the ground, as high as the take-off point",
                );
            }
            let mut to = waypoint(item, "land", item.at()?, Height::ON_GROUND, false);
            to.terms.land_on_target = *meaning == Meaning::Land && item.param(2) != 0.0;
            lead(item, to)?
        }
        Meaning::Return => {
            Does::Lead { to: waypoint(item, "return", Place::TakeOff, Height::ON_GROUND, false), is_end: true }
        }
        Meaning::Takeoff => {
            let at = item.at()?;
            findings.say(
                Weight::Furniture,
                &item.place,
                "the planner takes off by itself, and climbs to the height of the next place: no objective",
            );
            if is_elsewhere(at, home) {
                findings.note(
                    &item.place,
                    "an autopilot takes off where it stands: the place of a takeoff is not flown to",
                );
            }
            Does::TakeOff
        }
        Meaning::VtolTakeoff => {
            note("the vehicle is a multicopter: it takes off like one");
            let at = item.at()?;
            let up = step(item, Does::TakeOff);
            if !is_elsewhere(at, home) {
                return Ok(vec![up]);
            }
            let to = lead(item, waypoint(item, "waypoint", at, item.height()?, true))?;
            return Ok(vec![up, Step { id: None, ..step(item, to) }]);
        }
        Meaning::Delay => match item.given(1) {
            Some(seconds) if seconds < 0.0 => {
                return Err(refused(item, name, "it waits for a time of day, which has no counterpart"));
            }
            _ => Does::Stay(seconds(item, 1)?),
        },
        Meaning::Jump => jump(item, name, findings)?,
        Meaning::SetHome => set_home(item, name, home, findings)?,
        Meaning::FenceEnable => {
            // 0 is off, 1 is on, 2 switches the floor off.
            if item.param(1) != 1.0 {
                return Err(refused(item, name, "it switches off what limits the flight"));
            }
            findings.say(Weight::Furniture, &item.place, "a fence is on from the beginning: left out");
            Does::Nothing
        }
        Meaning::LandingSequence => Does::LandingSequence,
        // The number of the gripper, then what it does: 0 is a release.
        Meaning::Gripper if item.param(2) == 0.0 => Does::Release(action::text(item, name)?),
        Meaning::Gripper | Meaning::Action => {
            findings.say(Weight::ForLater, &item.place, KEPT);
            Does::Action(action::text(item, name)?)
        }
        Meaning::Mark(text) => {
            findings.say(Weight::Furniture, &item.place, *text);
            Does::Nothing
        }
        Meaning::Refused(why) => return Err(refused(item, name, why)),
    };
    Ok(vec![step(item, does)])
}

fn step(item: &Item, does: Does) -> Step {
    Step { place: item.place.clone(), id: item.id, does }
}

fn unknown(item: &Item, findings: &mut Findings) -> Result<Does, Wrong> {
    let number = item.command;
    if commands::may_fly(number) || item.has_place() {
        let message = format!("command {number} is not known, and may fly somewhere or change the order");
        return Err(Wrong::at(&item.place, message, ""));
    }
    findings.note(&item.place, format!("command {number} is not known, and has no place: left out"));
    Ok(Does::Nothing)
}

fn refused(item: &Item, name: &str, why: &str) -> Wrong {
    Wrong::at(&item.place, format!("{name} ({}): {why}", item.command), "")
}

fn waypoint(item: &Item, name: &str, at: Place, height: Height, flying: bool) -> Waypoint {
    let source = item.place.clone();
    Waypoint { name: name.into(), at, height, flying, terms: Terms::default(), survey: None, source }
}

/// A place in flight, with what is said of the parameters that a mission does not have.
fn flown_to(item: &Item, dwell: Duration, note: &mut impl FnMut(&str)) -> Result<Waypoint, Wrong> {
    if commands::WAYPOINT == item.command && item.param(3) != 0.0 {
        note("to pass a place at a distance has no counterpart: the place is flown to");
    }
    if item.param(4) != 0.0 {
        note("which way to face has no counterpart: left out");
    }
    let mut to = waypoint(item, "waypoint", item.at()?, item.height()?, true);
    to.terms.dwell = dwell;
    Ok(to)
}

fn lead(item: &Item, to: Waypoint) -> Result<Does, Wrong> {
    if item.is_last_by_itself {
        let message = "`autoContinue` is off: the vehicle would stay there until a person sends it on";
        return Err(Wrong::at(&item.place, message, "switch it on"));
    }
    Ok(Does::Lead { to, is_end: false })
}

fn seconds(item: &Item, number: usize) -> Result<Duration, Wrong> {
    let seconds = item.param(number);
    Duration::try_from_secs_f64(seconds)
        .map_err(|_| Wrong::at(&item.place, format!("found {seconds}, expected seconds from 0 on"), ""))
}

fn is_elsewhere(at: Place, home: Option<LatLon>) -> bool {
    match (at, home) {
        (Place::At(at), Some(home)) => SAME_M < at.distance_m(home),
        (Place::At(_), None) => true,
        _ => false,
    }
}

fn jump(item: &Item, name: &str, findings: &mut Findings) -> Result<Does, Wrong> {
    let (to, times) = (item.param(1), item.param(2));
    if times < 0.0 {
        return Err(refused(item, name, "it repeats for ever"));
    }
    if MOST_REPEATS < times {
        let why = format!("it repeats {times} times, and a mission has at most {MOST_REPEATS} objectives");
        return Err(refused(item, name, &why));
    }
    if to.fract() != 0.0 || times.fract() != 0.0 {
        return Err(refused(item, name, "the number of an item and how often, both whole, are expected"));
    }
    if times == 0.0 {
        findings.say(Weight::Furniture, &item.place, "a jump that is made 0 times: left out");
        return Ok(Does::Nothing);
    }
    Ok(Does::Jump { to: to as i64, times: times as u32 })
}

/// A return leads to the take-off point, so nothing else may become home.
fn set_home(item: &Item, name: &str, home: Option<LatLon>, findings: &mut Findings) -> Result<Does, Wrong> {
    if item.param(1) == 1.0 || is_elsewhere(item.at()?, home) || !item.has_place() {
        return Err(refused(item, name, "a return would lead elsewhere than to the take-off point"));
    }
    findings.say(Weight::Furniture, &item.place, "the home that it sets is the planned one: left out");
    Ok(Does::Nothing)
}
