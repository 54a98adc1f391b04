//! The parameters of the mission manager.

use std::time::Duration;

use domain::aircraft::Aircraft;
use domain::quantity::{Number, Positive, Seconds};
use domain::speeds::Speeds;
use domain::time::Pace;
use domain::way::FlightLimits;
use serde::Deserialize;

/// `[mcm]` in the configuration file.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Longest time between two ticks of the running tree, in milliseconds of wall time. Events
    /// tick it at once. (The reference measured 10, 5 and 1 ms.)
    pub tick_period_ms: Number<1, 1000>,
    /// How long a request to the planner or the skill manager may take, in seconds, never less
    /// than one second of wall time. (ENG: a hundred round trips.)
    pub request_timeout_s: Positive,
    /// Silence after which the monitor counts as lost, in seconds. (ENG: 50 samples of its 100 Hz.)
    pub introspection_limit_s: Seconds<50, 10_000>,
    /// Silence about a skill after which the skill manager is asked for its table, in seconds, never less than
    /// one second of wall time. (ENG: twenty feedbacks.)
    pub skill_silence_s: Seconds<50, 60_000>,
    /// How long an answer of the control tower is awaited, in mission seconds. (SPEC: 10 s.)
    pub permission_answer_s: Positive,
    /// How often a permission is asked for before silence counts as a denial. (SPEC: 3.)
    pub permission_tries: u32,
    /// Mission seconds before its expiry from which on a permission is no longer relied on.
    /// (ENG: the time it takes to cross the reference mission's areas at cruise speed.)
    pub permission_margin_s: Positive,
    /// Pause before the replanning of a step that fails right after another one, in mission seconds; doubled with each
    /// further failure, up to eight times its length. (ENG: longer than any rule takes to raise its flag, so that a
    /// contingency responds first.)
    pub retry_pause_s: Positive,
    /// Nearer than this the vehicle is at the goal of an auxiliary step, in metres. (ENG)
    pub arrival_radius_m: Positive,
    /// Speed of a transition action, in metres per second, so that the vehicle is still near when a new plan comes. (ENG: a third of the
    /// cruise speed.)
    pub transition_speed_m_s: Positive,
    /// No faster than this over ground while a flag slows the vehicle, in metres per second. (ENG: half of the cruise speed: a quarter
    /// of the distance to stop.)
    pub slow_speed_m_s: Positive,
    /// By how much the action `climb` climbs, in metres, no higher than `highest_m` in `[flight]`. (ENG: clear of people and vessels below.)
    pub climb_by_m: Positive,
    /// How it brakes over ground at least, in m/s2: where it would come to rest is looked at ahead. (PX4: MPC_ACC_HOR 3 m/s2.)
    pub braking_m_s2: Positive,
    /// A longer way out of an area is not flown, in metres; the response's next action follows. (ENG)
    pub farthest_out_m: Positive,
    /// How long a step holds before what a flag forbids, in mission seconds; then it fails, and the rest is planned without. (ENG: a minute
    /// of hovering is 4 % of the battery.)
    pub barrier_limit_s: Positive,
    /// Mission seconds before the expiry of a permission, or before an area begins to apply, at which the vehicle must
    /// have left. (ENG)
    pub leave_lead_s: Positive,
    /// Period at which the airspace around and ahead of the vehicle is checked, in mission seconds, never less than
    /// 20 ms of wall time. (ENG: two metres of flight.)
    pub airspace_period_s: Positive,
    /// How long an operator's resume is awaited after a landing that no plan asked for, in mission seconds. (ENG)
    pub go_ahead_limit_s: Positive,
    /// When the mission begins.
    pub start: Start,
    /// Which plans wait for the operator's approval before they are flown.
    pub plan_approval: PlanApproval,
    /// How long a decision about a plan is awaited, in mission seconds. (ENG: time to read a plan.)
    pub plan_approval_limit_s: Positive,
    /// What counts if nobody decides in time.
    pub plan_approval_default: Verdict,
}

/// When a mission begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// As soon as every process and its data are seen.
    AtOnce,
    /// When the operator starts it. A manager that is started again while the vehicle flies continues at once.
    Operator,
}

/// Which plans wait for approval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlanApproval {
    /// None.
    None,
    /// Each one.
    EachPlan,
    /// Each but the first for an objective.
    EachReplanning,
}

/// What is decided about a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It is flown.
    Approve,
    /// It is not; the vehicle holds.
    Refuse,
}

/// The land detector speaks once a second (PX4 and ArduPilot as shipped, vehicle-sim): two times may be lost.
const LAND_DETECTOR: Duration = Duration::from_secs(3);

/// The same, with what is computed from it: limits of the machine in mission time with their wall-clock floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) config: Config,
    pub(crate) tick_period: Duration,
    pub(crate) aircraft: Aircraft,
    pub(crate) request_timeout: Duration,
    pub(crate) introspection: Duration,
    /// How long what a skill has confirmed overrides an older land detector message.
    pub(crate) land_detector: Duration,
    pub(crate) skill_silence: Duration,
    pub(crate) permission_answer: Duration,
    pub(crate) permission_tries: u32,
    pub(crate) permission_margin: Duration,
    pub(crate) flight: FlightLimits,
    pub(crate) leave_lead: Duration,
    pub(crate) airspace_period: Duration,
    /// Time after which a vehicle on the ground with its motors off has settled: by then the manager has heard what the
    /// monitor found about the landing.
    pub(crate) settle: Duration,
    pub(crate) pace: Pace,
    /// Period of status and tree without changes.
    pub(crate) report_period: Duration,
}

impl Config {
    pub(crate) fn limits(&self, aircraft: Aircraft, pace: Pace) -> Limits {
        Limits {
            config: *self,
            aircraft,
            tick_period: pace.wall(Duration::from_secs_f64(self.tick_period_ms.get() / 1000.0)),
            request_timeout: pace.limit(self.request_timeout_s.seconds()),
            introspection: pace.limit(self.introspection_limit_s.seconds()),
            land_detector: pace.limit(LAND_DETECTOR),
            skill_silence: pace.limit(self.skill_silence_s.seconds()),
            permission_answer: self.permission_answer_s.seconds(),
            permission_tries: self.permission_tries.max(1),
            permission_margin: self.permission_margin_s.seconds(),
            flight: aircraft.flight.limits(speeds(aircraft)),
            leave_lead: self.leave_lead_s.seconds(),
            airspace_period: self.airspace_period_s.seconds().max(pace.wall(Duration::from_millis(20))),
            settle: Duration::from_secs(1).max(pace.wall(Duration::from_millis(100))),
            pace,
            report_period: pace.wall(Duration::from_millis(500)),
        }
    }
}

/// How fast ways without a plan are flown in the usual wind, as the planner times its plans.
fn speeds(Aircraft { flight, energy }: Aircraft) -> Speeds {
    let in_wind = flight.speeds(energy.usual_wind());
    // In a wind in which nothing is planned, a vehicle that is in the air still needs a way down, and a time for it that ends.
    if in_wind.hold_in_wind() {
        in_wind
    } else {
        Speeds::calm(in_wind.cruise_m_s, in_wind.climb_m_s, in_wind.descent_m_s)
    }
}

#[cfg(test)]
mod tests {
    use domain::aircraft::Flight;
    use domain::energy::EnergyModel;
    use domain::file::Source;
    use domain::geometry::Ned;

    use super::*;

    #[derive(Deserialize)]
    struct Shipped {
        mcm: Config,
        flight: Flight,
        energy: EnergyModel,
    }

    #[test]
    fn ways_without_a_plan_are_timed_in_the_usual_wind() {
        #[track_caller]
        fn check(headwind: &str, expected_s: f64) {
            let text = include_str!("../../../../config/kittiwake.toml").replace("headwind_m_s = 4.0", headwind);
            let Shipped { mcm, flight, energy } = Source { path: "kittiwake.toml".into(), text }.parse().unwrap();
            let speeds = mcm.limits(Aircraft { flight, energy }, Pace::REAL_TIME).flight.speeds;
            let time_s = speeds.time_s(Ned::default(), Ned::new(600.0, 0.0, 0.0));
            assert!((time_s - expected_s).abs() < 1e-6, "{headwind}: {time_s} s, expected {expected_s} s");
        }
        // 15 m/s through the air: 10 m/s over ground until the wind leaves less.
        check("headwind_m_s = 4.0", 60.0);
        check("headwind_m_s = 9.0", 100.0);
        // Nothing is planned in that.
        check("headwind_m_s = 15.0", 60.0);
    }
}
