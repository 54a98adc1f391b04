//! The contingency table: what raises which flag, and which response is flown.
//!
//! The table is a file, `config/contingencies.toml`, reviewed like code. The monitor evaluates each
//! row's expression ([`when`]); the mission manager generates its contingency subtree from the rest, and asks
//! [`responder`] which row responds, and [`narrowing`] what is forbidden meanwhile.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use serde::Deserialize;

use crate::quantity::Fraction;
use crate::situation::Situation;

pub mod alarm;
mod arbitration;
pub mod expression;
pub mod group;
pub mod hazard;
pub mod label;
mod lattice;
pub mod listing;
pub mod narrowing;
pub mod needs;
pub mod snapshot;
pub mod source;
mod table;
pub mod unit;
pub mod when;

use alarm::Alarm;
pub use arbitration::{Moment, Raised, responder};
use group::Group;
use hazard::Waiver;
use label::Label;
pub use lattice::Severity;
use narrowing::Narrows;
use needs::Need;
use snapshot::Field;
use when::When;

/// A checked table: rows with distinct flags and priorities, most urgent first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contingencies {
    rows: Vec<Row>,
    waivers: Vec<Waiver>,
}

impl Contingencies {
    /// The rows, most urgent first.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The hazards that it leaves unanswered on purpose, in the order of the file.
    pub fn waivers(&self) -> &[Waiver] {
        &self.waivers
    }

    /// The charge of the battery below which a row has the vehicle land where it is, so that no flight is to end with less; zero
    /// without such a row.
    pub fn lands_below(&self) -> Fraction {
        // Whatever else an expression asks for, it may hold at each charge that it names.
        let of_row = |row: &Row| {
            let thresholds = row.when.as_ref()?.raises.thresholds().into_iter();
            thresholds
                .filter(|it| it.field == Field::BatteryCharge && !it.above)
                .map(|it| it.value / 100.0)
                .reduce(f64::max)
        };
        let landing = self.rows.iter().filter(|row| Severity::Land <= row.severity());
        let levels = landing.filter_map(of_row).filter_map(|it| Fraction::try_from(it).ok());
        levels.fold(Fraction::ZERO, |most, it| if most < it { it } else { most })
    }

    /// The row of a flag.
    pub fn row(&self, flag: &str) -> Option<&Row> {
        self.rows.iter().find(|it| it.flag == flag)
    }
}

/// One flag and the response to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The flag's name.
    pub flag: String,
    /// Lower is more urgent; decides between rows whose responses are equally severe.
    pub priority: u32,
    /// What it is about; `None`: the table does not say. Rows of one group are checked together, so that a group without a flag
    /// costs one check.
    pub group: Option<Group>,
    /// The expression by which the monitor raises it; `None`: it is raised only by hand or by the mission manager itself.
    pub when: Option<When>,
    /// The phases in which it counts; a flag that rises in another phase waits.
    pub phases: BTreeSet<Phase>,
    /// The situations in which its response may begin; a flag that rises in another one waits.
    pub situations: BTreeSet<Situation>,
    /// Tried in order until one succeeds, and from the first one again when all have failed. The last one is the
    /// emergency action.
    pub actions: Vec<Action>,
    /// What is forbidden while its flag is up, whatever is flown.
    pub narrows: BTreeSet<Narrows>,
    /// When the flag is cleared.
    pub clears: Clears,
    /// What follows once the response has ended and the flag is down.
    pub then: Then,
    /// What it is for, safety or comfort: decides before the severity.
    pub label: Label,
    /// How loudly it calls for a human.
    pub alarm: Alarm,
    /// Flags of the same cause. While one of them is up, this one is to be known and calls for nobody: one cause is one alarm
    /// (ISA-18.2, EEMUA 191).
    pub explained_by: BTreeSet<String>,
    /// Where its numbers come from; `None`: the table does not say.
    pub source: Option<String>,
}

impl Row {
    /// The severity of its first action.
    pub fn severity(&self) -> Severity {
        self.actions.first().map_or(Severity::Hold, |action| action.severity)
    }

    /// What decides between rows: the greater one responds.
    pub fn order(&self, severity: Severity) -> (bool, Severity, Reverse<u32>) {
        (self.label != Label::Comfort, severity, Reverse(self.priority))
    }

    /// Whether an order with override comes before it.
    pub fn may_be_overridden(&self) -> bool {
        self.label != Label::Binding
    }

    /// The situations in which a response begins where its row names none. One that holds or flies elsewhere and then resumes the mission
    /// waits for a touchdown, since a vehicle on the ground is safest, and for the first sight of the vehicle. Nothing new is answered
    /// after the end.
    fn usual_situations(severity: Severity, then: Then) -> BTreeSet<Situation> {
        let waits = severity < Severity::Land && then == Then::Resume;
        let begins = |it: &Situation| match it {
            Situation::Unseen | Situation::TouchingDown => !waits,
            Situation::Standing | Situation::LiftingOff | Situation::Flying => true,
            Situation::Ended => false,
        };
        Situation::ALL.into_iter().filter(begins).collect()
    }

    /// Whether all that it does is to slow the vehicle, which interrupts nothing: see [`narrowing`].
    pub fn only_slows(&self) -> bool {
        self.severity() == Severity::Slow
    }

    /// Whether its response flies nowhere: what it does holds, also in an area that could be left.
    pub fn only_holds(&self) -> bool {
        let holds = |it: &Action| match it.severity {
            Severity::Hold => true,
            Severity::Leave => !it.needs.contains(&Need::Position),
            _ => false,
        };
        self.actions.iter().all(holds)
    }

    /// Whether the monitor raises and clears it by what it measures.
    pub fn is_watched(&self) -> bool {
        self.when.is_some()
    }

    /// How loudly it calls for a human beside other flags, of which `is_up` says whether they are up.
    pub fn alarm_beside(&self, is_up: impl Fn(&str) -> bool) -> Alarm {
        if self.explained_by.iter().any(|it| is_up(it)) { Alarm::Advisory } else { self.alarm }
    }

    /// Its actions in words: `return_home, else land`.
    pub fn response(&self) -> String {
        self.actions.iter().map(|action| action.tree.as_str()).collect::<Vec<_>>().join(", else ")
    }
}

/// An action of a response.
#[derive(Debug, Clone, PartialEq)]
pub struct Action {
    /// The name of its tree.
    pub tree: String,
    /// How severe it is.
    pub severity: Severity,
    /// How often it is tried before the next action.
    pub tries: u32,
    /// What it cannot be flown without.
    pub needs: BTreeSet<Need>,
}

/// The phase of the flight, by which rows count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// On the ground.
    OnGround,
    /// Climbing from the ground.
    Takeoff,
    /// In the air, on its way.
    Cruise,
    /// In the air, waiting for a permission, a plan or an operator.
    Waiting,
    /// In the air, inside an area.
    InsideArea,
    /// Coming down to land.
    Landing,
}

impl Phase {
    /// Every phase.
    pub const ALL: [Phase; 6] =
        [Phase::OnGround, Phase::Takeoff, Phase::Cruise, Phase::Waiting, Phase::InsideArea, Phase::Landing];
}

/// The name as users read it.
impl std::fmt::Display for Phase {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Phase::OnGround => "on the ground",
            Phase::Takeoff => "during the takeoff",
            Phase::Cruise => "on the way",
            Phase::Waiting => "while waiting",
            Phase::InsideArea => "inside an area",
            Phase::Landing => "while landing",
        })
    }
}

/// When a flag is cleared, but never while its response is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clears {
    /// Once its response has ended.
    AfterAction,
    /// Once its response has ended and its condition no longer holds; the vehicle holds until then.
    WithCondition,
    /// Not before an operator lowers it or the vehicle has landed.
    Never,
}

/// What follows a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Then {
    /// The mission is replanned and continues.
    Resume,
    /// The mission is over.
    EndMission,
    /// The mission is over by a crash.
    Crashed,
}

/// The target of a landing is not seen: a landing that this row interrupts has failed.
pub const LANDING_TARGET_LOST: &str = "landing_target_lost";
/// Raised by the mission manager when a transition action fails.
pub const TRANSITION_FAILED: &str = "transition_failed";
/// Raised by the mission manager when a task of a declared skill fails.
pub const SKILL_FAILED: &str = "skill_failed";
/// Raised by the mission manager when the monitor is silent.
pub const INTROSPECTION_LOST: &str = "introspection_lost";
/// Raised by the mission manager when the vehicle is in an area without being allowed to, or must leave it now.
pub const AREA_BREACHED: &str = "area_breached";
/// Raised by the mission manager when the vehicle, braking now, would come to rest in an area that it may not enter.
pub const AREA_AHEAD: &str = "area_ahead";
/// Raised by the mission manager when the mission is over and the vehicle is in the air.
pub const ENDED_IN_AIR: &str = "ended_in_air";
/// Raised by the mission manager when what it or the planner knew before a restart is lost.
pub const MEMORY_UNUSABLE: &str = "memory_unusable";
/// Raised by the mission manager when what it or the planner knows cannot be written.
pub const MEMORY_UNWRITABLE: &str = "memory_unwritable";
/// Raised by the mission manager when a pilot or another ground station flies the vehicle.
pub const SOMEBODY_ELSE_FLIES: &str = "somebody_else_flies";
/// Raised by the monitor, and by the mission manager when a skill is pre-empted: the autopilot flies something else than what was asked for.
pub const AUTOPILOT_PREEMPTS: &str = "autopilot_preempts";
/// The same, where the autopilot brings the vehicle down.
pub const AUTOPILOT_COMES_DOWN: &str = "autopilot_comes_down";
/// Raised by the mission manager when positions can no longer be compared with those of the mission.
pub const FRAME_MOVED: &str = "frame_moved";
/// An operator's order to land here.
pub const OPERATOR_ABORT: &str = "operator_abort";
/// An operator's order to fly home.
pub const OPERATOR_RETURN: &str = "operator_return";
/// An operator's order to land at a place.
pub const OPERATOR_LAND: &str = "operator_land";
/// An operator's order to hold.
pub const OPERATOR_PAUSE: &str = "operator_pause";

/// Flags whose rows leave the vehicle to somebody else, until an operator orders something.
pub const LEFT_TO_OTHERS: [&str; 3] = [SOMEBODY_ELSE_FLIES, AUTOPILOT_PREEMPTS, AUTOPILOT_COMES_DOWN];

/// Flags whose rows bring the vehicle down, wherever it flies.
pub(crate) const BRING_DOWN: [&str; 4] = [ENDED_IN_AIR, OPERATOR_ABORT, OPERATOR_RETURN, OPERATOR_LAND];

/// Flags that the mission manager raises itself, so that each must have a row.
pub(crate) const REQUIRED: [&str; 14] = [
    TRANSITION_FAILED,
    INTROSPECTION_LOST,
    AREA_BREACHED,
    AREA_AHEAD,
    ENDED_IN_AIR,
    MEMORY_UNUSABLE,
    MEMORY_UNWRITABLE,
    SOMEBODY_ELSE_FLIES,
    AUTOPILOT_PREEMPTS,
    FRAME_MOVED,
    OPERATOR_ABORT,
    OPERATOR_RETURN,
    OPERATOR_LAND,
    OPERATOR_PAUSE,
];

/// What the monitor must watch, so that a row must read each: the processes by whose heartbeats a hang is seen, and the land
/// detector. (The monitor itself is watched by the mission manager: [`INTROSPECTION_LOST`].)
pub(crate) const REQUIRED_FIELDS: [Field; 4] =
    [Field::PlannerSilence, Field::SkillManagerSilence, Field::ManagerSilence, Field::DetectorContradicts];
