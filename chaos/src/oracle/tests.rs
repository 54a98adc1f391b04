//! Made-up flights.

use super::*;
use crate::trouble::{Victim, Ways};

const INTERRUPTION: Duration = Duration::from_secs(8);

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
        let oracle = Oracle::new(Pace::REAL_TIME, INTERRUPTION);
        let mut truth = Truth { oracle, at_s: 0, east_m: 0.0, height_m: 0.0, manager: Some(manager) };
        truth.hear(
            v1::VehicleStatus { armed: true, intended_mode: v1::FlightMode::Loiter.into(), ..Default::default() }
                .into(),
        );
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
    truth.hear(
        v1::VehicleStatus { armed: true, intended_mode: v1::FlightMode::Loiter.into(), ..Default::default() }.into(),
    );
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

/// A manager that obeys that order.
fn obeying(order: Order) -> v1::McmStatus {
    let row = v1::ActiveContingency { flag: order.flag().into(), ..Default::default() };
    v1::McmStatus { acting: order.flag().into(), contingencies: vec![row], ..Default::default() }
}

#[test]
fn an_order_of_before_a_cut_is_not_obeyed_after_it() {
    #[track_caller]
    fn check(given_before_s: Option<u64>, is_accepted: bool, expected: &[&str]) {
        let mut truth = Truth::in_flight();
        truth.fly(60, 1.0);
        if let Some(before_s) = given_before_s {
            let at = Time::after(Duration::from_secs(truth.at_s - before_s));
            truth.oracle.given(at, Order::Return);
            truth.oracle.answered(Order::Return, is_accepted);
        }
        if is_accepted {
            truth.oracle.ordered(truth.now().time, Order::Return);
        }
        truth.manager = Some(obeying(Order::Return));
        truth.fly(60, 1.0);
        truth.check(expected);
    }
    check(Some(1), false, &[]);
    check(Some(30), true, &[]);
    check(Some(30), false, &["obeyed return, which was given last at"]);
    check(None, false, &["obeyed return, which was given never"]);
}

#[test]
fn a_return_before_the_lift_off_may_look_like_an_abort_and_an_abort_never_like_a_return() {
    #[track_caller]
    fn check(given: Order, seen: Order, expected: &[&str]) {
        let mut truth = Truth::in_flight();
        truth.oracle.given(truth.now().time, given);
        truth.oracle.ordered(truth.now().time, given);
        truth.oracle.answered(given, true);
        truth.manager = Some(obeying(seen));
        truth.fly(2, 1.0);
        truth.check(expected);
    }
    check(Order::Return, Order::Return, &[]);
    check(Order::Return, Order::Abort, &[]);
    check(Order::Abort, Order::Abort, &[]);
    check(Order::Abort, Order::Return, &["obeyed return, which was given never"]);
}

#[test]
fn an_order_may_wait_for_as_long_as_the_link_is_cut() {
    let mut truth = Truth::in_flight();
    truth.oracle.ordered(truth.now().time, Order::Abort);
    truth.oracle.troubled(&Trouble::Cut(Ways::Both, Duration::from_secs(60), None));
    truth.fly(215, 1.0);
    truth.check(&[]);
    truth.fly(5, 1.0);
    truth.check(&["abort was accepted"]);
}

#[test]
fn while_the_sender_of_an_order_waits_it_is_not_known_whether_it_is_accepted() {
    #[track_caller]
    fn check(is_accepted: bool, expected: &[&str]) {
        let mut truth = Truth::in_flight();
        truth.oracle.given(truth.now().time, Order::Return);
        truth.fly(30, 1.0);
        truth.manager = Some(obeying(Order::Return));
        truth.fly(2, 1.0);
        truth.check(&[]);
        truth.oracle.answered(Order::Return, is_accepted);
        truth.check(expected);
    }
    check(true, &[]);
    check(false, &["obeyed return, which was given last at"]);
}
