//! One flight with one or two flags, watched by rules that read the table and what the manager says, and nothing else.

use std::any::Any;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use domain::contingency::{
    Contingencies, LEFT_TO_OTHERS, Moment, Phase, Raised, Row, SOMEBODY_ELSE_FLIES, Severity, responder,
};
use domain::file::Mistakes;
use domain::time::Time;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{MissionPhase, ResumeMission, SkillKind};

use super::stage::Stage;
use crate::chaos::ending::Ending;
use crate::{Simulation, System};

/// How often it is looked at.
const STEP: Duration = Duration::from_millis(100);
/// A status is sent when it changes; what was asked for meanwhile takes effect within a tick.
const SETTLES: Duration = Duration::from_millis(1200);
/// For how long a response that holds is watched: longer than a stop from full speed, and than a landing that it must not be.
const HOLDS: Duration = Duration::from_secs(20);
/// Within this time a response that brings the vehicle down must have done so: over all of the way home, with every try of an action
/// and a wait for a permission.
const COMES_DOWN: Duration = Duration::from_secs(420);
/// Within this time after what raised it is gone, a response that may end must have ended.
const ENDS: Duration = Duration::from_secs(40);
/// A vehicle that holds is slower.
const HOLDING_M_S: f64 = 1.0;
/// How often the flag that is answered may change within one flight: each of two flags comes and goes, the order changes with the
/// phase of the flight, and the end of the mission in the air has a row of its own.
const CHANGES: usize = 8;

/// What is flown.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Case {
    /// When in the mission.
    pub stage: Stage,
    /// The number of the row whose flag is raised.
    pub first: usize,
    /// That of another one, raised this much later.
    pub second: Option<(usize, Duration)>,
}

/// Its result.
#[derive(Debug, Clone)]
pub struct Flown {
    /// What was flown.
    pub case: Case,
    /// The rows that were answered, one after the other.
    pub answered: Vec<usize>,
    /// How it ended.
    pub ending: String,
    /// What there is against it.
    pub faults: Vec<String>,
    /// Every decision from the first flag on.
    pub story: Vec<String>,
    /// Virtual time.
    pub flown: Duration,
}

/// Flies it.
///
/// # Errors
/// Mistakes in the files.
pub fn fly(system: &System, table: &Contingencies, case: &Case) -> Result<Flown, Mistakes> {
    let stage = case.stage;
    let mission = stage.mission(system.skills());
    let mut simulation = system.simulation(&mission, stage.permissions(), stage.ground())?;
    let mut watch = Watch {
        table,
        case,
        faults: Vec::new(),
        answered: Vec::new(),
        heard: Vec::new(),
        wrong_since: None,
        began: Time::ZERO,
    };
    // A panic is a finding of this flight, not the end of the others.
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| watch.fly(&mut simulation))) {
        watch.faults.push(format!("a process panicked: {}", words(&*panic)));
    }
    let line = |(at, it): (Time, kittiwake_proto::v1::DecisionRecord)| {
        (watch.began <= at).then(|| format!("{:6.1} s  {}: {}", at.as_secs_f64(), it.topic, it.text))
    };
    let story = simulation.decisions().into_iter().filter_map(line).collect();
    let (ending, flown) = (Ending::of(&simulation).to_string(), simulation.now().since_start());
    Ok(Flown { case: case.clone(), answered: watch.answered, ending, faults: watch.faults, story, flown })
}

struct Watch<'a> {
    table: &'a Contingencies,
    case: &'a Case,
    faults: Vec<String>,
    answered: Vec<usize>,
    /// The rows whose flags were raised before the end: something is decided about each.
    heard: Vec<usize>,
    /// Since when another row is answered than the order says.
    wrong_since: Option<Time>,
    began: Time,
}

impl Watch<'_> {
    fn fly(&mut self, simulation: &mut Simulation<'_>) {
        if !self.case.stage.reach(simulation) {
            self.faults.push(format!("the phase `{}` was not reached", self.case.stage));
            return;
        }
        self.began = simulation.now();
        let other = (self.case.stage == Stage::Responding).then(|| self.least_severe()).flatten();
        let mut raised = Vec::new();
        if let Some(other) = other {
            self.raise(simulation, other, &mut raised);
            self.pass(simulation, Duration::from_secs(3));
        }
        self.raise(simulation, self.case.first, &mut raised);
        if let Some((second, gap)) = self.case.second {
            self.pass(simulation, gap);
            self.raise(simulation, second, &mut raised);
        }
        self.respond(simulation);
        for row in &raised {
            simulation.lower_flag(&self.table.rows()[*row].flag);
        }
        self.end(simulation);
        self.judge(simulation);
    }

    fn raise(&mut self, simulation: &mut Simulation<'_>, row: usize, raised: &mut Vec<usize>) {
        let comes_late = is_over(simulation);
        simulation.inject_flag(&self.table.rows()[row].flag);
        raised.push(row);
        if !comes_late {
            self.heard.push(row);
        }
    }

    /// A row that holds on the way and is not raised: the least urgent.
    fn least_severe(&self) -> Option<usize> {
        let is_raised =
            |row: usize| row == self.case.first || self.case.second.is_some_and(|(second, _)| row == second);
        let holds = |(number, row): &(usize, &Row)| {
            !is_raised(*number) && row.severity() == Severity::Hold && row.phases.contains(&Phase::Cruise)
        };
        self.table.rows().iter().enumerate().filter(holds).map(|(number, _)| number).next_back()
    }

    /// Until the response has shown what it does.
    fn respond(&mut self, simulation: &mut Simulation<'_>) {
        let (mut watched, mut same) = (Duration::ZERO, Duration::ZERO);
        // One that stands with running motors comes down by nothing.
        let was_up = !simulation.seen.borrow().is_down();
        let mut brings_down = false;
        while watched < COMES_DOWN {
            let before = acting(self.table, simulation);
            self.pass(simulation, STEP);
            watched += STEP;
            let now = acting(self.table, simulation);
            same = if before == now { same + STEP } else { Duration::ZERO };
            brings_down |= now.is_some_and(|it| comes_down(&self.table.rows()[it]));
            if !brings_down && HOLDS <= watched {
                break;
            }
            if simulation.is_on_ground() && HOLDS <= watched {
                break;
            }
        }
        let Some(now) = acting(self.table, simulation) else { return };
        let row = &self.table.rows()[now];
        if brings_down && !simulation.is_on_ground() {
            self.faults.push(format!(
                "`{}` is to come down, and the vehicle is in the air {} s later",
                row.flag,
                COMES_DOWN.as_secs()
            ));
        } else if row.severity() == Severity::Hold && HOLDS <= same + STEP && was_up {
            let speed_m_s = speed(simulation);
            if simulation.is_on_ground() && !brings_down && self.case.stage != Stage::Landing {
                self.faults.push(format!("`{}` holds by the table, and the vehicle has come down", row.flag));
            } else if !simulation.is_on_ground() && HOLDING_M_S < speed_m_s {
                self.faults
                    .push(format!("`{}` holds by the table, and the vehicle flies {speed_m_s:.1} m/s", row.flag));
            }
        }
    }

    /// What raised them is gone: each response ends, or brings the vehicle down.
    fn end(&mut self, simulation: &mut Simulation<'_>) {
        let mut waited = Duration::ZERO;
        while let Some(row) = acting(self.table, simulation) {
            let limit = if comes_down(&self.table.rows()[row]) { COMES_DOWN } else { ENDS };
            if self.table.rows()[row].flag == SOMEBODY_ELSE_FLIES {
                // Nothing else takes control back.
                simulation.order(Verb::Resume(ResumeMission {}));
            }
            if limit <= waited {
                let flag = &self.table.rows()[row].flag;
                self.faults
                    .push(format!("`{flag}` is answered for {} s after it was lowered: no end", limit.as_secs()));
                return;
            }
            self.pass(simulation, STEP);
            waited += STEP;
        }
        self.pass(simulation, SETTLES);
    }

    /// Time passes while the order is watched.
    fn pass(&mut self, simulation: &mut Simulation<'_>, time: Duration) {
        let mut left = time;
        while !left.is_zero() {
            let step = left.min(STEP);
            simulation.pass(step);
            left -= step;
            self.look(simulation);
        }
    }

    fn look(&mut self, simulation: &Simulation<'_>) {
        let now = acting(self.table, simulation);
        if let Some(row) = now
            && self.answered.last() != Some(&row)
        {
            self.answered.push(row);
        }
        if is_over(simulation) || self.is_right(simulation, now) {
            self.wrong_since = None;
            return;
        }
        let since = *self.wrong_since.get_or_insert(simulation.now());
        if simulation.now() - since == SETTLES {
            let rows = self.table.rows();
            let name = |row: Option<usize>| row.map_or("nothing".to_owned(), |it| format!("`{}`", rows[it].flag));
            let up: Vec<String> =
                simulation.seen.borrow().manager.contingencies.iter().map(|it| it.flag.clone()).collect();
            self.faults.push(format!(
                "{} is answered while {} are up, which is not the order",
                name(now),
                up.join(", ")
            ));
        }
    }

    /// Whether `now` is what the order says, at one of the moments that there may be, with a response under way at any of its
    /// actions: the manager publishes neither.
    fn is_right(&self, simulation: &Simulation<'_>, now: Option<usize>) -> bool {
        let seen = simulation.seen.borrow();
        let rows = self.table.rows();
        let number = |flag: &str| rows.iter().position(|it| it.flag == flag);
        let up: BTreeSet<usize> = seen.manager.contingencies.iter().filter_map(|it| number(&it.flag)).collect();
        let phases: &[Phase] = match seen.manager.skill() {
            _ if seen.is_on_ground() => &[Phase::OnGround],
            _ if seen.is_down() => &[Phase::OnGround, Phase::Landing, Phase::Takeoff, Phase::Waiting],
            SkillKind::Land => &[Phase::Landing, Phase::Waiting, Phase::OnGround, Phase::InsideArea],
            SkillKind::Takeoff => &[Phase::Takeoff, Phase::OnGround, Phase::Waiting],
            _ => &[Phase::Cruise, Phase::Waiting, Phase::InsideArea],
        };
        let under_way = |row: usize, severity: Option<Severity>| {
            let of = |it: usize| severity.filter(|_| it == row);
            let raised = up.iter().map(move |it| Raised {
                row: *it,
                overrides: false,
                is_overridden: false,
                under_way: of(*it),
            });
            raised.collect::<Vec<_>>()
        };
        Moment::ALL.iter().filter(|it| phases.contains(&it.phase)).any(|moment| match now {
            None => responder(rows, under_way(0, None), *moment).is_none(),
            Some(row) => {
                let reached = rows[row].actions.iter().map(|it| Some(it.severity)).chain([None]);
                reached.into_iter().any(|it| responder(rows, under_way(row, it), *moment) == Some(row))
            }
        })
    }

    fn judge(&mut self, simulation: &mut Simulation<'_>) {
        let rows = self.table.rows();
        let said: Vec<String> = simulation.decisions().into_iter().map(|(_, it)| it.text).collect();
        for row in &self.heard {
            let flag = format!("`{}`", rows[*row].flag);
            if !said.iter().any(|it| it.contains(&flag)) {
                self.faults.push(format!("{flag} was raised, and nothing was decided about it"));
            }
        }
        if CHANGES < self.answered.len() {
            let names: Vec<&str> = self.answered.iter().map(|it| rows[*it].flag.as_str()).collect();
            self.faults.push(format!("the response changes {} times: {}", names.len(), names.join(", ")));
        }
        self.faults.extend(simulation.breaches().iter().map(|it| it.what()));
        if let Some(storm) = simulation.mode_storm() {
            self.faults
                .push(format!("the mode was commanded to change {} times for {} causes", storm.changes, storm.causes));
        }
        for ((process, service), count) in simulation.unanswered() {
            self.faults.push(format!("{process} left {count} requests to {} without a reply", service.key()));
        }
        let goes_on = matches!(
            simulation.phase(),
            MissionPhase::Starting | MissionPhase::Nominal | MissionPhase::Replanning | MissionPhase::Ending
        );
        if !goes_on && matches!(Ending::of(simulation), Ending::Adrift { .. }) {
            self.faults.push(format!("a dead end: {}", Ending::of(simulation)));
        }
    }
}

/// After the end of the mission nothing new is answered on the ground.
fn is_over(simulation: &Simulation<'_>) -> bool {
    let seen = simulation.seen.borrow();
    seen.is_down() && (seen.report.is_some() || !seen.manager.ends.is_empty())
}

/// Whether the response of `row` brings the vehicle down: not where the row leaves that to a pilot or the autopilot,
/// because a flag raised by hand makes nobody fly.
fn comes_down(row: &Row) -> bool {
    row.severity().comes_down() && !LEFT_TO_OTHERS.contains(&row.flag.as_str())
}

/// The row that is answered.
fn acting(table: &Contingencies, simulation: &Simulation<'_>) -> Option<usize> {
    let flag = simulation.responder();
    table.rows().iter().position(|it| it.flag == flag)
}

fn speed(simulation: &Simulation<'_>) -> f64 {
    let velocity = simulation.seen.borrow().aircraft.as_ref().and_then(|it| it.velocity).unwrap_or_default();
    velocity.north_m_s.hypot(velocity.east_m_s)
}

fn words(panic: &(dyn Any + Send)) -> String {
    let said = panic.downcast_ref::<&str>().map(|it| (*it).to_owned());
    said.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "it says nothing".to_owned())
}
