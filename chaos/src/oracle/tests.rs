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
        let oracle = Oracle::new(Pace::REAL_TIME, INTERRUPTION, Vec::new());
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

    /// From the ground, second by second: the motors, the land detector, the height.
    fn take_off(&mut self) {
        let mode = v1::FlightMode::Loiter.into();
        self.hear(v1::VehicleStatus { armed: true, intended_mode: mode, ..Default::default() }.into());
        self.fly(1, 0.0);
        self.hear(v1::VehicleLandDetected { landed: false, ..Default::default() }.into());
        self.fly(1, 0.0);
        self.height_m = 10.0;
        self.fly(1, 0.0);
    }

    /// It stands there at a stop on the way.
    fn standing() -> Truth {
        let mut truth = Truth::in_flight();
        truth.fly(10, 1.0);
        truth.land();
        truth.fly(60, 0.0);
        truth
    }

    /// An operator's order, given and accepted.
    fn order(&mut self, order: Order) {
        let now = self.now();
        self.oracle.given(now.time, order);
        self.oracle.answered(order, true);
        self.oracle.ordered(now.time, order);
    }

    fn land(&mut self) {
        self.height_m = 0.0;
        self.hear(v1::VehicleStatus { armed: false, ..Default::default() }.into());
        self.hear(v1::VehicleLandDetected { landed: true, ..Default::default() }.into());
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
    truth.oracle.troubled(truth.now(), &Trouble::Kill(Victim::Mcm));
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
fn a_launcher_that_ends_as_after_a_landing_leaves_no_vehicle_in_the_air() {
    #[track_caller]
    fn check(code: i32, lands: bool, silent_s: u64, expected: &[&str]) {
        let mut truth = Truth::in_flight();
        truth.fly(30, 10.0);
        if lands {
            truth.land();
        }
        truth.at_s += silent_s;
        let now = truth.now();
        truth.oracle.ended(now, Some(code), "mission over");
        truth.check(expected);
    }
    const LEFT: &[&str] = &["the launcher ended as after a landing, and at 32 s the vehicle still flew"];
    for code in [0, 3, 4] {
        check(code, false, 0, LEFT);
        check(code, false, 2, LEFT);
        check(code, true, 0, &[]);
    }
    // Where it was not heard for longer, it may have landed.
    check(0, false, 3, &[]);
    check(6, false, 0, &["crashed"]);
}

#[test]
fn an_exit_code_is_an_end_or_a_violation() {
    #[track_caller]
    fn check(code: Option<i32>, expected: &[&str]) {
        let mut truth = Truth::standing();
        truth.oracle.ended(truth.now(), code, "router ended 5 times");
        truth.check(expected);
    }
    check(Some(0), &[]);
    check(Some(4), &[]);
    check(Some(5), &["not kept up: router ended 5 times"]);
    check(Some(6), &["crashed"]);
    check(None, &["not kept up"]);
}

/// What a manager says at the end of a mission, or while it waits.
fn said(text: &str) -> v1::McmStatus {
    match text {
        "over" => v1::McmStatus {
            phase: v1::MissionPhase::Over.into(),
            report: Some(v1::MissionReport { outcome: v1::MissionOutcome::Success.into(), ..Default::default() }),
            ..Default::default()
        },
        "start awaited" => v1::McmStatus { start_awaited: true, ..Default::default() },
        flag => v1::McmStatus { acting: flag.into(), ..Default::default() },
    }
}

#[test]
fn what_the_manager_said_counts_until_it_is_silent_for_an_interruption_or_the_power_is_lost() {
    #[track_caller]
    fn check(text: &str, then: impl Fn(&mut Truth), expected: &State) {
        let mut truth = Truth::standing();
        truth.manager = Some(said(text));
        truth.fly(60, 0.0);
        then(&mut truth);
        assert_eq!(truth.oracle.state(truth.now().time), *expected, "{text}");
        truth.check(&[]);
    }
    let silent = |seconds: u64| {
        move |truth: &mut Truth| {
            truth.manager = None;
            truth.fly(seconds, 0.0);
        }
    };
    let loses_power = |truth: &mut Truth| truth.oracle.power_lost(truth.now());
    let ends: [(&str, State); 3] = [
        ("over", State::Over(v1::MissionOutcome::Success)),
        ("start awaited", State::Waits("waits for an operator".into())),
        ("link_lost", State::Waits("link_lost".into())),
    ];
    for (text, end) in &ends {
        check(text, |_| {}, end);
        check(text, silent(8), end);
        check(text, silent(9), &State::Stands);
        check(text, loses_power, &State::Stands);
        check(
            text,
            |it| {
                loses_power(it);
                silent(60)(it)
            },
            &State::Stands,
        );
        // Its successor says so itself.
        check(
            text,
            |it| {
                loses_power(it);
                it.fly(60, 0.0)
            },
            end,
        );
    }
}

#[test]
fn a_run_whose_manager_never_comes_back_has_no_end() {
    let mut truth = Truth::standing();
    truth.manager = Some(said("over"));
    truth.fly(60, 0.0);
    truth.oracle.power_lost(truth.now());
    truth.manager = None;
    truth.fly(200, 0.0);
    truth.oracle.never_ended(truth.now().time);
    truth.check(&["it neither landed nor holds for a reason: Stands, its mission manager is not heard"]);
}

#[test]
fn what_was_over_stays_over_through_two_losses_of_power_before_a_manager_says_so_again() {
    let mut truth = Truth::standing();
    truth.manager = Some(said("over"));
    truth.fly(2, 0.0);
    truth.manager = None;
    for _ in 0..2 {
        truth.oracle.power_lost(truth.now());
        truth.fly(2, 0.0);
    }
    let mode = v1::FlightMode::Loiter.into();
    truth.hear(v1::VehicleStatus { armed: true, intended_mode: mode, ..Default::default() }.into());
    truth.height_m = 10.0;
    truth.fly(1, 0.0);
    truth.check(&["took off after the end"]);
}

/// Heartbeats of these nodes, each with a process id, once a second.
fn beat(truth: &mut Truth, seconds: u64, nodes: &[(&str, u32)]) {
    for _ in 0..seconds {
        truth.fly(1, 0.0);
        for (service, pid) in nodes {
            truth.hear(v1::Heartbeat { service: (*service).into(), pid: *pid, ..Default::default() }.into());
        }
    }
}

#[test]
fn who_is_lost_has_a_successor_in_time_as_far_as_others_beside_it_are_heard() {
    #[track_caller]
    fn check(victim: Victim, then: impl Fn(&mut Truth), expected: &[&str]) {
        let mut truth = Truth::standing();
        beat(&mut truth, 5, &ALL);
        truth.oracle.lost(truth.now().time, victim, 1);
        then(&mut truth);
        truth.check(expected);
    }
    const ALL: [(&str, u32); 4] = [("planner", 1), ("monitor", 2), ("gateway", 1), ("control-tower", 4)];
    const OTHERS: [(&str, u32); 2] = [("monitor", 2), ("control-tower", 4)];
    let back = [ALL.as_slice(), &[("planner", 7), ("gateway", 8)]].concat();
    for victim in [Victim::Planner, Victim::Gateway] {
        let is_not_back = format!("{victim} was lost, and at 86 s its successor had not been heard");
        check(victim, |it| beat(it, 8, &OTHERS), &[]);
        check(victim, |it| beat(it, 60, &OTHERS), &[&is_not_back]);
        // Its own last heartbeats do not count as a successor.
        check(victim, |it| beat(it, 60, &ALL), &[&is_not_back]);
        check(
            victim,
            |it| {
                beat(it, 7, &OTHERS);
                beat(it, 1, &back);
                beat(it, 60, &OTHERS)
            },
            &[],
        );
        // It hung, and goes on.
        check(
            victim,
            |it| {
                it.oracle.continued(it.now().time, 1);
                beat(it, 60, &OTHERS)
            },
            &[],
        );
        // Nobody is heard, because the bus is away: the time limit begins again when it is back.
        check(
            victim,
            |it| {
                beat(it, 60, &[]);
                beat(it, 8, &OTHERS)
            },
            &[],
        );
        // A new system is started.
        check(
            victim,
            |it| {
                it.oracle.power_lost(it.now());
                beat(it, 60, &OTHERS)
            },
            &[],
        );
        // A further death gives more time.
        check(
            victim,
            |it| {
                beat(it, 8, &OTHERS);
                it.oracle.lost(it.now().time, Victim::Router, 9);
                beat(it, 8, &OTHERS);
            },
            &[],
        );
        let lasting = Trouble::FullDisk(Duration::from_secs(20));
        check(
            victim,
            |it| {
                it.oracle.troubled(it.now(), &lasting);
                beat(it, 28, &OTHERS)
            },
            &[],
        );
    }
    // The other side of the link is heard, and says nothing of this one.
    check(Victim::Gateway, |it| beat(it, 60, &[("monitor", 2)]), &[]);
    check(Victim::Planner, |it| beat(it, 60, &[("control-tower", 4)]), &[]);
    check(Victim::Router, |it| beat(it, 60, &OTHERS), &[]);
    // The ground's router is there when anybody behind it is heard, but for what was under way.
    let is_not_back = "ground-router was lost, and at 86 s its successor had not been heard";
    check(Victim::GroundRouter, |it| beat(it, 60, &[("monitor", 2)]), &[is_not_back]);
    check(
        Victim::GroundRouter,
        |it| {
            beat(it, 1, &OTHERS);
            beat(it, 60, &[("monitor", 2)])
        },
        &[is_not_back],
    );
    check(
        Victim::GroundRouter,
        |it| {
            beat(it, 4, &[("monitor", 2)]);
            beat(it, 1, &OTHERS);
            beat(it, 60, &[("monitor", 2)])
        },
        &[],
    );
}

#[test]
fn a_run_waits_for_who_is_lost() {
    let mut truth = Truth::standing();
    truth.oracle.lost(truth.now().time, Victim::Onboard, 1);
    assert!(truth.oracle.awaits_somebody());
    beat(&mut truth, 1, &[("mcm", 1)]);
    assert!(truth.oracle.awaits_somebody());
    beat(&mut truth, 1, &[("mcm", 2)]);
    assert!(!truth.oracle.awaits_somebody());
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
    truth.oracle.troubled(truth.now(), &Trouble::Cut(Ways::Both, Duration::from_secs(60), None));
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

#[test]
fn a_vehicle_that_was_ordered_down_on_the_ground_does_not_take_off() {
    for order in [Order::Abort, Order::Return] {
        let mut truth = Truth::standing();
        truth.order(order);
        truth.fly(4, 0.0);
        truth.check(&[]);
        truth.take_off();
        truth.fly(20, 1.0);
        truth.check(&[&format!("at 79 s it took off, though {} had been accepted", order.verb())]);
    }
    let mut truth = Truth::standing();
    truth.take_off();
    truth.check(&[]);
}

#[test]
fn a_vehicle_that_has_landed_by_an_order_does_not_take_off_again() {
    let mut truth = Truth::in_flight();
    truth.order(Order::Abort);
    truth.fly(5, 0.0);
    truth.land();
    truth.fly(30, 0.0);
    truth.check(&[]);
    truth.take_off();
    truth.check(&["took off, though abort had been accepted"]);
}

#[test]
fn a_loss_of_power_takes_no_order_to_come_down_away_unless_it_could_not_be_saved() {
    #[track_caller]
    fn check(failing: &str, deaths: &[Trouble], loses_power: bool, expected: &[&str]) {
        let mut truth = Truth::in_flight();
        let memory = v1::MemoryHealth { loss: None, failing: failing.into() };
        truth.manager.as_mut().unwrap().memory = Some(memory);
        truth.fly(1, 0.0);
        truth.order(Order::Abort);
        truth.fly(1, 0.0);
        let now = truth.now();
        deaths.iter().for_each(|it| truth.oracle.troubled(now, it));
        if loses_power {
            truth.oracle.power_lost(now);
        }
        truth.manager.as_mut().unwrap().memory = None;
        truth.land();
        truth.fly(30, 0.0);
        truth.take_off();
        truth.check(expected);
    }
    const AFTER: &[&str] = &["took off, though abort had been accepted"];
    check("", &[], true, AFTER);
    check("", &[Trouble::GarbledState(Victim::Mcm, crate::trouble::Garbling::Cut)], false, AFTER);
    // All of a computer die at once: that is one interruption.
    check("", &[Trouble::CompanionOff(Duration::from_secs(6))], false, AFTER);
    check("no space left on device", &[], true, &[]);
    check("no space left on device", &[Trouble::Kill(Victim::Onboard)], false, &[]);
    // The manager, which knows the order, still runs.
    check("no space left on device", &[Trouble::Kill(Victim::SkillManager)], false, AFTER);
}

#[test]
fn an_order_that_was_saved_is_not_forgotten_because_the_disk_fails_later() {
    let mut truth = Truth::in_flight();
    truth.order(Order::Abort);
    truth.fly(3, 0.0);
    let failing = "no space left on device".into();
    truth.manager.as_mut().unwrap().memory = Some(v1::MemoryHealth { loss: None, failing });
    truth.fly(1, 0.0);
    let now = truth.now();
    truth.oracle.troubled(now, &Trouble::Kill(Victim::Mcm));
    truth.land();
    truth.fly(30, 0.0);
    truth.take_off();
    truth.check(&["took off, though abort had been accepted"]);
}

#[test]
fn a_takeoff_that_was_under_way_may_lift_off_and_then_comes_down() {
    /// A vehicle that lifts off this long after an abort, beside a death of one that would stop it.
    #[track_caller]
    fn check(after_s: u64, dies: bool, flies_on_s: u64, expected: &[&str]) {
        let mut truth = Truth::standing();
        let now = truth.now();
        if dies {
            truth.oracle.troubled(now, &Trouble::Kill(Victim::SkillManager));
        }
        truth.order(Order::Abort);
        truth.fly(after_s - 3, 0.0);
        truth.take_off();
        truth.fly(flies_on_s, 1.0);
        truth.check(expected);
    }
    check(3, false, 60, &[]);
    check(4, false, 60, &["took off, though abort"]);
    check(8, true, 60, &[]);
    check(9, true, 60, &["took off, though abort"]);
    check(3, false, 170, &["abort was accepted, and at"]);
}

#[test]
fn the_areas_of_the_mission_s_file_apply_over_a_loss_of_power() {
    let corner = |(north_m, east_m)| Ned { north_m, east_m, down_m: 0.0 };
    let area = Area::new(
        "A",
        domain::area::AreaKind::Permission,
        [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)].map(corner).to_vec(),
    );
    let mut truth = Truth::standing();
    truth.oracle = Oracle::new(Pace::REAL_TIME, INTERRUPTION, vec![area]);
    let now = truth.now();
    truth.oracle.power_lost(now);
    truth.hear(v1::MissionStatus::default().into());
    truth.check(&["lacked area A"]);
    truth.take_off();
    truth.check(&["lacked area A", "entered area A"]);
}
