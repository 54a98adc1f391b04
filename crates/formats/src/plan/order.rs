//! The order in which an autopilot flies the items of a plan: jumps are made, and nothing is flown after a return.
//!
//! A jump (177) counts how often it was made, and the count is never set back while a mission is flown (ArduPilot's
//! `get_jump_times_run`, PX4's `do_jump_current_count`): a jump inside of a loop is made in the first round only.

use domain::mission::bounds::{MOST_ACTIONS, MOST_OBJECTIVES};
use domain::mission::terms::LONGEST_S;

use super::step::{Does, KEPT, Step};
use crate::content::{Content, Waypoint};
use crate::findings::{Findings, Weight, Wrong};

/// The most steps that the jumps of a plan may make; a mission takes far fewer.
const MOST_STEPS: usize = 100_000;

/// Adds the places of the steps to `content`, in the order in which they are flown.
pub(super) fn run(steps: &[Step], content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let mut run = Run { made: 0, first_actions: Vec::new(), actions: 0, is_landed: false, content, findings };
    let mut done = vec![false; steps.len()];
    let mut jumped = vec![0; steps.len()];
    let (mut index, mut count) = (0, 0);
    let mut end = None;
    while let Some(step) = steps.get(index) {
        count += 1;
        if MOST_STEPS < count {
            let message = format!("the jumps of the plan make more than {MOST_STEPS} steps");
            return Err(Wrong::at(&step.place, message, "let it repeat less often"));
        }
        if matches!(step.does, Does::LandingSequence) && run.is_landed {
            end = Some((index, "landing"));
            break;
        }
        let is_first = !std::mem::replace(&mut done[index], true);
        index += 1;
        match &step.does {
            Does::Jump { to, times } if jumped[index - 1] < *times => {
                jumped[index - 1] += 1;
                let target = steps.iter().position(|it| it.id == Some(*to));
                let no_item = || Wrong::at(&step.place, format!("a jump to item {to}, and there is none"), "");
                index = target.ok_or_else(no_item)?;
            }
            Does::Lead { is_end: true, .. } => {
                run.step(step, is_first)?;
                end = Some((index, if run.is_landed { "return" } else { "stay without an end" }));
                break;
            }
            _ => run.step(step, is_first)?,
        }
    }
    if MOST_OBJECTIVES < run.made {
        let message = format!("the plan makes {} objectives, at most {MOST_OBJECTIVES} are allowed", run.made);
        return Err(Wrong::at(
            "/mission/items",
            message,
            "cut it to what one flight needs, or let it repeat less often",
        ));
    }
    if MOST_ACTIONS < run.actions {
        let message = format!("the plan makes {} actions, at most {MOST_ACTIONS} are allowed", run.actions);
        return Err(Wrong::at(
            "/mission/items",
            message,
            "cut it to what one flight needs, or let it repeat less often",
        ));
    }
    for waypoint in run.content.waypoints.iter().filter(|it| LONGEST_S < it.terms.dwell.as_secs_f64()) {
        let message = format!("a stay of {} s, expected at most {LONGEST_S} s", waypoint.terms.dwell.as_secs());
        run.findings.wrong(Wrong::at(&waypoint.source, message, ""));
    }
    let rest = end.map_or(steps.len(), |(index, _)| index);
    for (step, _) in steps.iter().zip(&done).take(rest).filter(|(_, is_done)| !**is_done) {
        run.findings.note(&step.place, "a jump always leads past it: never flown, left out");
    }
    let undone = steps.iter().zip(&done).skip(rest).filter(|(_, is_done)| !**is_done).map(|(step, _)| step);
    after_end(undone, end.map_or("", |(_, what)| what), run.findings);
    Ok(())
}

/// After the end only a landing sequence may stand, which only a return uses.
fn after_end<'a>(steps: impl Iterator<Item = &'a Step>, what: &str, findings: &mut Findings) {
    let mut is_in_sequence = false;
    for step in steps {
        is_in_sequence |= matches!(step.does, Does::LandingSequence);
        if is_in_sequence {
            findings.note(
                &step.place,
                format!("after the {what} of the plan, in a landing sequence that only a return uses: left out"),
            );
            is_in_sequence = !matches!(&step.does, Does::Lead { to, .. } if !to.flying);
        } else if matches!(step.does, Does::Nothing | Does::Action(_)) {
            findings.note(
                &step.place,
                format!("it comes after the {what} of the plan, where an autopilot does nothing: left out"),
            );
        } else {
            let message = format!("it comes after the {what} of the plan, where an autopilot flies nothing");
            findings.wrong(Wrong::at(&step.place, message, ""));
        }
    }
}

struct Run<'a> {
    made: usize,
    /// What belongs to no place, since none came before it.
    first_actions: Vec<String>,
    actions: usize,
    is_landed: bool,
    content: &'a mut Content,
    findings: &'a mut Findings,
}

impl Run<'_> {
    fn step(&mut self, step: &Step, is_first: bool) -> Result<(), Wrong> {
        let mut say = |weight, text: &str| {
            if is_first {
                self.findings.say(weight, &step.place, text);
            }
        };
        match &step.does {
            Does::Nothing | Does::Jump { .. } => {}
            Does::TakeOff => self.is_landed = false,
            Does::LandingSequence => {
                say(
                    Weight::Furniture,
                    "the mark of a landing that a return may use does nothing: what follows is flown in the order of the plan",
                );
            }
            Does::Lead { to, .. } => {
                if self.is_landed {
                    say(
                        Weight::Changed,
                        "no takeoff stands between the landing before it and it: an autopilot may stay on the ground there, the planner takes off",
                    );
                }
                self.is_landed = !to.flying;
                self.lead(to);
            }
            Does::Release(_) if self.content.waypoints.is_empty() => {
                return Err(Wrong::at(&step.place, "a release before the first place has no counterpart", ""));
            }
            Does::Release(text) => match self.content.waypoints.last_mut().filter(|it| it.flying && !it.terms.drop) {
                Some(waypoint) => {
                    waypoint.terms.drop = true;
                    if !waypoint.terms.dwell.is_zero() {
                        say(Weight::Changed, "the time to hold before a release becomes a stay after it");
                    }
                }
                None => {
                    say(Weight::ForLater, KEPT);
                    self.action(text);
                }
            },
            Does::Action(text) => self.action(text),
            Does::Stay(time) => match self.content.waypoints.last_mut() {
                Some(waypoint) => waypoint.terms.dwell += *time,
                None => {
                    let message = "a delay before the first place has no counterpart";
                    return Err(Wrong::at(&step.place, message, ""));
                }
            },
        }
        Ok(())
    }

    fn lead(&mut self, to: &Waypoint) {
        self.made += 1;
        if MOST_OBJECTIVES < self.made {
            return;
        }
        let count = self.content.waypoints.len() + 1;
        let name = if to.name == "return" { to.name.clone() } else { format!("{} {count}", to.name) };
        let mut waypoint = Waypoint { name, ..to.clone() };
        self.actions += waypoint.terms.actions.len();
        waypoint.terms.actions.splice(..0, self.first_actions.drain(..));
        self.content.waypoints.push(waypoint);
    }

    /// An action belongs to the place before it, and before the first one to that.
    fn action(&mut self, text: &str) {
        self.actions += 1;
        if MOST_ACTIONS < self.actions {
            return;
        }
        match self.content.waypoints.last_mut() {
            Some(waypoint) => waypoint.terms.actions.push(text.to_owned()),
            None => self.first_actions.push(text.to_owned()),
        }
    }
}
