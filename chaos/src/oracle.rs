//! Judges a run by where the vehicle is, not by what the system claims: a pure function of what passed by and when.

use std::fmt;
use std::time::Duration;

use domain::geometry::Ned;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use witness::{Breach, Limits, Witness};

use crate::trouble::{Order, Trouble, Victim};

/// Wall time that the death of a process may take: three seconds until one that hangs is killed, three of the longest delay
/// before it is started again, two to start on a busy machine.
pub const INTERRUPTION: Duration = Duration::from_secs(8);
/// In mission time from the order to the ground: down from return height, or home from the farthest area first.
const ABORT_LIMIT: Duration = Duration::from_secs(150);
const RETURN_LIMIT: Duration = Duration::from_secs(300);
/// Moving less than this is resting.
const REST_RADIUS_M: f64 = 5.0;
/// One that rests for this mission time, and this wall time, holds.
const HOLDS: (Duration, Duration) = (Duration::from_secs(40), Duration::from_secs(8));

/// What must not happen.
#[derive(Debug, Clone, PartialEq)]
pub enum Violation {
    /// A rule of the airspace or of takeoffs, or nobody responds.
    Breach(Breach),
    /// The vehicle flew, was heard, and its mission manager was not heard for too long.
    NobodyInCharge {
        /// When.
        at: Time,
    },
    /// An order was accepted, and the vehicle still flies.
    Disobeyed {
        /// Which.
        order: Order,
        /// When it should have been on the ground.
        at: Time,
    },
    /// No order was accepted in flight, for a long time.
    Refused {
        /// Which.
        order: Order,
        /// What was answered last.
        said: String,
    },
    /// The vehicle crashed.
    Crashed,
    /// The launcher gave up, or could not start.
    NotKeptUp(String),
    /// It neither landed nor holds for a reason.
    NeverEnded(String),
}

/// How the vehicle is.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// In the air, on its way.
    Flies,
    /// In the air, at rest for a while, for this reason; none if it is empty.
    Holds(String),
    /// On the ground, and stays there until an operator wants otherwise, for this reason.
    Waits(String),
    /// On the ground, and about to do something.
    Stands,
}

/// Takes in what passes by.
#[derive(Debug)]
pub struct Oracle {
    pace: Pace,
    witness: Witness,
    violations: Vec<Violation>,
    manager: v1::McmStatus,
    /// When the mission manager was last heard, or nothing was to be expected of it.
    manager_heard: Time,
    position: Option<Ned>,
    position_heard: Time,
    rest: Option<(Ned, Time)>,
    path_m: f64,
    /// What must be obeyed, until when.
    order: Option<(Order, Time)>,
}

impl Oracle {
    /// Of a system at that pace.
    pub fn new(pace: Pace) -> Oracle {
        Oracle {
            pace,
            witness: Witness::with(limits(pace)),
            violations: Vec::new(),
            manager: v1::McmStatus::default(),
            manager_heard: Time::ZERO,
            position: None,
            position_heard: Time::ZERO,
            rest: None,
            path_m: 0.0,
            order: None,
        }
    }

    /// A message passes by.
    pub fn hears(&mut self, now: Now, message: &Message) {
        let known = self.witness.breaches().len();
        self.witness.take_in(now, message);
        self.violations.extend(self.witness.breaches().iter().skip(known).cloned().map(Violation::Breach));
        match message {
            Message::McmStatus(it) => (self.manager, self.manager_heard) = (it.clone(), now.time),
            Message::VehicleLocalPosition(it) => {
                if let Some(Ok(position)) = it.position.map(Ned::try_from) {
                    self.moved(now.time, position);
                }
            }
            _ => {}
        }
    }

    fn moved(&mut self, at: Time, position: Ned) {
        if let Some(before) = self.position.replace(position).filter(|_| self.witness.is_airborne()) {
            self.path_m += before.distance_m(position);
        }
        let interruption = self.pace.wall(INTERRUPTION);
        // While nothing is heard at all, the router is away, and the silence of the manager says nothing.
        let was_deaf = self.position_heard + self.pace.wall(Duration::from_secs(1)) < at;
        self.position_heard = at;
        if was_deaf || !self.witness.is_airborne() {
            self.manager_heard = self.manager_heard.max(at);
        }
        if self.manager_heard + interruption < at {
            self.violations.push(Violation::NobodyInCharge { at });
            self.manager_heard = at;
        }
        let rests = |(place, _): &(Ned, Time)| place.distance_m(position) < REST_RADIUS_M;
        self.rest = self.rest.filter(rests).or(Some((position, at)));
        if !self.witness.is_airborne() {
            self.order = None;
        }
        if let Some((order, by)) = self.order.filter(|(_, by)| *by < at) {
            self.violations.push(Violation::Disobeyed { order, at: by });
            self.order = None;
        }
    }

    /// A trouble begins: an order may take longer, or is forgotten with the state that held it, aloud.
    pub fn troubled(&mut self, trouble: &Trouble) {
        let is_forgotten = matches!(trouble, Trouble::GarbledState(Victim::Mcm, _) | Trouble::FullDisk(_));
        let deaths: u32 = trouble.deaths().iter().map(|it| it.1).sum();
        let more = self.pace.wall(INTERRUPTION) * deaths;
        self.order = self.order.filter(|_| !is_forgotten).map(|(order, by)| (order, by + more));
    }

    /// An operator's order was accepted.
    pub fn ordered(&mut self, now: Time, order: Order) {
        let limit = match order {
            Order::Abort => ABORT_LIMIT,
            Order::Return => RETURN_LIMIT,
        };
        if self.witness.is_airborne() {
            self.order = Some((order, now + limit + self.pace.wall(INTERRUPTION)));
        }
    }

    /// An operator's order was not accepted, though it was given again and again.
    pub fn refused(&mut self, order: Order, said: &str) {
        if self.witness.is_airborne() && self.manager.report.is_none() {
            self.violations.push(Violation::Refused { order, said: said.to_owned() });
        }
    }

    /// Everything has lost its power, the vehicle as well: the simulator's next one stands at home. What was over stays over.
    pub fn power_lost(&mut self, now: Now) {
        self.witness = Witness::with(limits(self.pace));
        if self.manager.report.is_some() {
            self.witness.take_in(now, &self.manager.clone().into());
        }
        (self.position, self.rest, self.order, self.manager_heard) = (None, None, None, now.time);
    }

    /// The launcher has ended with this exit code.
    pub fn ended(&mut self, code: Option<i32>, last_words: &str) {
        match code {
            // It ends only once the vehicle is on the ground.
            Some(0 | 3 | 4) => {}
            Some(6) => self.violations.push(Violation::Crashed),
            _ => self.violations.push(Violation::NotKeptUp(last_words.to_owned())),
        }
    }

    /// The time of the run is up.
    pub fn never_ended(&mut self) {
        let how = format!("{:?}, mission {:?}", self.state(self.position_heard), self.manager.phase());
        self.violations.push(Violation::NeverEnded(how));
    }

    /// How the vehicle is.
    pub fn state(&self, now: Time) -> State {
        let reason = if self.manager.start_awaited { "waits for an operator" } else { self.manager.acting.as_str() };
        let (mission, wall) = HOLDS;
        let rests = self.rest.is_some_and(|(_, since)| since + mission.max(self.pace.wall(wall)) < now);
        match (self.witness.is_airborne(), rests) {
            (true, true) => State::Holds(reason.to_owned()),
            (true, false) => State::Flies,
            (false, true) if !reason.is_empty() => State::Waits(reason.to_owned()),
            (false, _) => State::Stands,
        }
    }

    /// Metres flown so far.
    pub fn path_m(&self) -> f64 {
        self.path_m
    }

    /// What it has against the run.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }
}

/// The witness's, with the time that the death of a process takes.
fn limits(pace: Pace) -> Limits {
    let interruption = pace.wall(INTERRUPTION);
    let usual = Limits::default();
    Limits {
        under_way: usual.under_way.max(pace.wall(Duration::from_secs(1))),
        without_response: usual.without_response + interruption,
        hover: usual.hover + interruption,
        notice: usual.notice + interruption,
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let s = |at: &Time| at.as_secs_f64();
        match self {
            Violation::Breach(Breach::Entered { at, area, permission }) => {
                write!(f, "at {:.0} s it entered area {area} without a permission: {permission:?}", s(at))
            }
            Violation::Breach(Breach::Stayed { at, area }) => {
                write!(f, "at {:.0} s it was still in area {area}", s(at))
            }
            Violation::Breach(Breach::TookOff { at }) => {
                write!(f, "at {:.0} s it took off after the end or in answer to a flag", s(at))
            }
            Violation::Breach(Breach::NoResponder { at, phase }) => {
                write!(f, "at {:.0} s it flew and nothing responded, mission {phase:?}", s(at))
            }
            Violation::NobodyInCharge { at } => {
                write!(f, "at {:.0} s it flew and the mission manager had not been heard for {INTERRUPTION:?}", s(at))
            }
            Violation::Disobeyed { order, at } => {
                write!(f, "{} was accepted, and at {:.0} s the vehicle still flew", order.verb(), s(at))
            }
            Violation::Refused { order, said } => write!(f, "{} was not accepted in flight: {said}", order.verb()),
            Violation::Crashed => f.write_str("the vehicle crashed"),
            Violation::NotKeptUp(last_words) => write!(f, "the system was not kept up: {last_words}"),
            Violation::NeverEnded(how) => write!(f, "it neither landed nor holds for a reason: {how}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A made-up flight at real time, second by second.
    struct Truth {
        oracle: Oracle,
        at_s: u64,
        east_m: f64,
        height_m: f64,
        manager: Option<v1::McmStatus>,
    }

    impl Truth {
        /// In the air, with a manager that flies a mission.
        fn in_flight() -> Truth {
            let manager = v1::McmStatus { phase: v1::MissionPhase::Nominal.into(), ..Default::default() };
            let oracle = Oracle::new(Pace::REAL_TIME);
            let mut truth = Truth { oracle, at_s: 0, east_m: 0.0, height_m: 0.0, manager: Some(manager) };
            truth.hear(v1::VehicleStatus { armed: true, ..Default::default() }.into());
            truth.fly(2, 0.0);
            truth.height_m = 10.0;
            truth.hear(v1::VehicleLandDetected { landed: false, ..Default::default() }.into());
            truth
        }

        fn now(&self) -> Now {
            Now { time: Time::after(Duration::from_secs(self.at_s)), utc_ms: self.at_s as i64 * 1000 }
        }

        fn hear(&mut self, message: Message) {
            self.oracle.hears(self.now(), &message);
        }

        fn fly(&mut self, seconds: u64, east_m_s: f64) {
            for _ in 0..seconds {
                self.at_s += 1;
                self.east_m += east_m_s;
                if let Some(manager) = self.manager.clone() {
                    self.hear(manager.into());
                }
                let position = v1::Ned { north_m: 0.0, east_m: self.east_m, down_m: -self.height_m };
                self.hear(v1::VehicleLocalPosition { position: Some(position), ..Default::default() }.into());
            }
        }

        fn land(&mut self) {
            self.height_m = 0.0;
            self.hear(v1::VehicleStatus { armed: false, ..Default::default() }.into());
        }

        #[track_caller]
        fn check(&self, expected: &[&str]) {
            let said: Vec<String> = self.oracle.violations().iter().map(ToString::to_string).collect();
            let fits = said.len() == expected.len() && said.iter().zip(expected).all(|(it, part)| it.contains(part));
            assert!(fits, "expected {expected:?}, found {said:?}");
        }
    }

    #[test]
    fn a_flight_that_goes_on_is_no_violation_and_its_way_is_measured() {
        let mut truth = Truth::in_flight();
        truth.fly(60, 10.0);
        truth.check(&[]);
        assert!((truth.oracle.path_m() - 600.0).abs() < 20.0, "{}", truth.oracle.path_m());
    }

    #[test]
    fn a_manager_may_be_away_for_an_interruption_and_no_longer() {
        let mut truth = Truth::in_flight();
        let manager = truth.manager.take();
        truth.fly(7, 10.0);
        truth.manager = manager;
        truth.fly(5, 10.0);
        truth.check(&[]);
        truth.manager = None;
        truth.fly(10, 10.0);
        truth.check(&["had not been heard"]);
    }

    #[test]
    fn silence_of_everybody_is_not_held_against_the_manager() {
        let mut truth = Truth::in_flight();
        truth.at_s += 60;
        truth.fly(1, 0.0);
        truth.check(&[]);
    }

    #[test]
    fn an_order_is_obeyed_in_time_and_a_death_gives_more_time() {
        let mut truth = Truth::in_flight();
        truth.oracle.ordered(truth.now().time, Order::Abort);
        truth.oracle.troubled(&Trouble::Kill(Victim::Mcm));
        truth.fly(164, 1.0);
        truth.check(&[]);
        truth.fly(5, 1.0);
        truth.check(&["abort was accepted"]);
        let mut obeyed = Truth::in_flight();
        obeyed.oracle.ordered(obeyed.now().time, Order::Abort);
        obeyed.fly(60, 1.0);
        obeyed.land();
        obeyed.fly(300, 0.0);
        obeyed.check(&[]);
    }

    #[test]
    fn after_the_end_it_may_not_take_off_even_over_a_loss_of_power() {
        let mut truth = Truth::in_flight();
        truth.land();
        truth.fly(10, 0.0);
        let phase = v1::MissionPhase::Over.into();
        truth.manager = Some(v1::McmStatus { phase, report: Some(v1::MissionReport::default()), ..Default::default() });
        truth.fly(2, 0.0);
        truth.oracle.power_lost(truth.now());
        truth.check(&[]);
        truth.manager = None;
        truth.hear(v1::VehicleStatus { armed: true, ..Default::default() }.into());
        truth.height_m = 10.0;
        truth.fly(1, 0.0);
        truth.check(&["took off after the end"]);
    }

    #[test]
    fn what_rests_for_a_reason_holds_or_waits() {
        let mut truth = Truth::in_flight();
        assert_eq!(truth.oracle.state(truth.now().time), State::Flies);
        truth.manager = Some(v1::McmStatus { acting: "memory_unusable".into(), ..Default::default() });
        truth.fly(60, 0.0);
        assert_eq!(truth.oracle.state(truth.now().time), State::Holds("memory_unusable".into()));
        truth.land();
        truth.fly(60, 0.0);
        assert_eq!(truth.oracle.state(truth.now().time), State::Waits("memory_unusable".into()));
        truth.check(&[]);
    }

    #[test]
    fn an_exit_code_is_an_end_or_a_violation() {
        #[track_caller]
        fn check(code: Option<i32>, expected: &[&str]) {
            let mut truth = Truth::in_flight();
            truth.oracle.ended(code, "router ended 5 times");
            truth.check(expected);
        }
        check(Some(0), &[]);
        check(Some(4), &[]);
        check(Some(5), &["not kept up: router ended 5 times"]);
        check(Some(6), &["crashed"]);
        check(None, &["not kept up"]);
    }
}
