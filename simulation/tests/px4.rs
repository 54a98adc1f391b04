//! Whole missions over a PX4, as far as it was measured: the same system, with the bridge in place of the simulated vehicle.

use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use fake_px4::{FakeLink, FakePx4, Trouble};
use kittiwake_proto::v1::{self, MissionOutcome};
use px4_bridge::Px4Bridge;
use px4_bridge::modes::NavState;
use serde::Deserialize;
use simulation::{Machine, Setup, Simulation};
use v1::operator_command::Verb;

const LIMIT: Duration = Duration::from_secs(1800);

#[derive(Deserialize)]
struct Sections {
    px4_bridge: px4_bridge::config::Config,
}

/// The shipped system over a PX4, and that PX4.
fn over_px4(permissions: Policy) -> (Simulation<'static>, FakeLink) {
    fly_over_px4(None, permissions)
}

/// The same with another mission.
fn fly_over_px4(mission: Option<&Path>, permissions: Policy) -> (Simulation<'static>, FakeLink) {
    let config = crate::stories::support::shipped();
    let text = std::fs::read_to_string(config.join("kittiwake.toml")).unwrap();
    let sections: Sections = toml::from_str(&text).unwrap();
    let setup = Setup { config: &config, mission, permissions, seed: 1, machine: Machine::Ideal };
    let mut link = None;
    let simulation = Simulation::with_vehicle(&setup, |vehicle| {
        let px4 = FakeLink::to(FakePx4::new(vehicle, 1));
        link = Some(px4.clone());
        Px4Bridge::new(&sections.px4_bridge, px4)
    });
    (simulation.unwrap(), link.unwrap())
}

#[track_caller]
fn assert_achieved(simulation: &mut Simulation<'_>) {
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("it does not end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}\n{}", report.reason, simulation.decision_log());
    assert_eq!(simulation.breaches(), []);
}

#[test]
fn the_reference_mission_is_flown() {
    let (mut simulation, px4) = over_px4(Policy::Grant);
    assert_achieved(&mut simulation);
    simulation.pass(Duration::from_secs(10));
    assert!(!px4.0.borrow().is_armed());
    // It was down at the goal, and took off again.
    let count = |wanted| px4.0.borrow().commands().iter().filter(|(_, number, ..)| *number == wanted).count();
    assert_eq!((count(22), count(21)), (2, 2), "{:?}\n{}", px4.0.borrow().commands(), simulation.decision_log());
    let flags = simulation.story(&["contingency"]);
    let is_start = |it: &&String| it.contains("autopilot_not_ready");
    assert!(flags.iter().all(|it| is_start(&it)), "nothing was answered but PX4's own start: {flags:?}");
}

#[test]
fn a_load_is_released() {
    const TEXT: &str = "name = \"drop\"
        [[objective]]\nname = \"buoy\"\nnorth_m = 0\neast_m = 100\nheight_m = 10\nflying = true\ndrop = true
        [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";
    let file = crate::stories::support::mission_file("drop_over_px4", TEXT);
    let (mut simulation, px4) = fly_over_px4(Some(&file), Policy::Grant);
    assert_achieved(&mut simulation);
    assert_eq!(simulation.loads_released_at().len(), 1, "{}", simulation.decision_log());
    assert_eq!(px4.0.borrow().commands().iter().filter(|(_, number, ..)| *number == 211).count(), 1);
}

#[test]
fn it_holds_before_an_area_until_the_tower_grants_it() {
    let (mut simulation, _px4) = over_px4(Policy::Delay);
    assert_achieved(&mut simulation);
}

/// What happens in a story, in order.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// To PX4.
    Does(Trouble),
    Passes(u64),
    /// A process hangs for this many seconds.
    Hangs(&'static str, u64),
    /// A decision that must come within a minute.
    Decides(&'static str),
    /// The row that must respond now.
    Responds(&'static str),
    /// An operator's order.
    Resumes,
}
use Step::{Decides, Does, Hangs, Passes, Responds, Resumes};

/// How a story ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    /// Every objective is achieved.
    Achieved,
    /// Over, on the ground.
    Down,
    /// The vehicle flies this for another minute, and nobody commands it.
    Left(NavState),
}

/// As `docs/px4.md` asks for it: hold without setpoints.
const HOLDS_WITHOUT_SETPOINTS: Step = Does(Trouble::WithoutSetpoints(NavState::LOITER));

/// A flight to its cruise, then these steps.
#[track_caller]
fn check(steps: &[Step], end: End) {
    let (mut simulation, px4) = over_px4(Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(Duration::from_secs(6));
    let minute = Duration::from_secs(60);
    for step in steps {
        match *step {
            Does(trouble) => px4.0.borrow_mut().trouble(trouble),
            Passes(seconds) => simulation.pass(Duration::from_secs(seconds)),
            Hangs(process, seconds) => simulation.freeze(process, Duration::from_secs(seconds)),
            Decides(text) => {
                assert!(simulation.fly_until(text, minute), "{text}\n{}", simulation.decision_log());
            }
            Responds(flag) => assert_eq!(simulation.responder(), flag, "\n{}", simulation.decision_log()),
            Resumes => simulation.order(Verb::Resume(v1::ResumeMission {})),
        }
    }
    match end {
        End::Achieved => assert_achieved(&mut simulation),
        End::Down => {
            simulation.fly(LIMIT).unwrap_or_else(|| panic!("it does not end:\n{}", simulation.decision_log()));
            simulation.pass(Duration::from_secs(10));
            assert!(!px4.0.borrow().is_armed(), "\n{}", simulation.decision_log());
        }
        End::Left(mode) => {
            let commands = px4.0.borrow().commands().len();
            simulation.pass(minute);
            assert_eq!(px4.0.borrow().actual(), mode, "\n{}", simulation.decision_log());
            assert_eq!(px4.0.borrow().commands().len(), commands, "\n{}", simulation.decision_log());
        }
    }
}

#[test]
fn a_gap_in_the_setpoints_is_no_more_than_a_hold() {
    check(&[HOLDS_WITHOUT_SETPOINTS, Hangs("skill-manager", 3), Decides("`offboard_link_lost`")], End::Achieved);
}

#[test]
fn a_link_that_is_cut_for_some_seconds_is_no_more_than_a_hold() {
    let cut = [Does(Trouble::Silent(true)), Passes(5), Does(Trouble::Silent(false))];
    check(&[&[HOLDS_WITHOUT_SETPOINTS], &cut[..]].concat(), End::Achieved);
}

#[test]
fn what_px4_holds_for_by_itself_is_left_alone_and_an_order_takes_it_back_once_that_is_over() {
    let fence = [Does(Trouble::Fence(Some(30.0))), Decides("autopilot_preempts"), Passes(10)];
    let alone = [Responds("autopilot_preempts")];
    let over = [Does(Trouble::Fence(None)), Passes(10)];
    check(&[&[HOLDS_WITHOUT_SETPOINTS], &fence[..], &alone].concat(), End::Left(NavState::LOITER));
    check(&[&[HOLDS_WITHOUT_SETPOINTS], &fence[..], &over, &alone, &[Resumes]].concat(), End::Achieved);
}

#[test]
fn another_ground_station_that_takes_over_is_not_fought_until_an_operator_orders_it() {
    for mode in [NavState(2), NavState::LOITER, NavState::LAND] {
        let taken = [Does(Trouble::Selects(mode)), Decides("flag `somebody_else_flies` raised"), Passes(3)];
        let flies = if mode == NavState::LAND { NavState::OFFBOARD } else { mode };
        check(&taken, End::Left(flies));
        if mode != NavState::LAND {
            check(&[&taken[..], &[Resumes]].concat(), End::Achieved);
        }
    }
}

#[test]
fn a_px4_that_is_started_again_in_flight_and_knows_no_position_is_brought_down() {
    let restart =
        [Does(Trouble::Restarts), Decides("flag `frame_moved` raised"), Decides("`estimator_lost`: land_now")];
    check(&restart, End::Down);
}

#[test]
fn a_topic_that_stops_is_noticed_and_waited_for() {
    for (topic, flag) in [("vehicle_local_position", "local_position_stale"), ("battery_status", "battery_stale")] {
        let gap = [Does(Trouble::Mute(topic)), Decides(flag), Passes(3), Does(Trouble::Unmute)];
        check(&[&[HOLDS_WITHOUT_SETPOINTS], &gap[..]].concat(), End::Achieved);
    }
}

#[test]
fn nothing_takes_off_while_px4_would_not_arm() {
    let (mut simulation, px4) = over_px4(Policy::Grant);
    px4.0.borrow_mut().trouble(Trouble::BatteryWarning(2));
    assert!(simulation.fly_until("the battery is critical", LIMIT), "\n{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(30));
    assert!(px4.0.borrow().commands().iter().all(|(_, number, ..)| *number != 400 && *number != 22));
    px4.0.borrow_mut().trouble(Trouble::BatteryWarning(0));
    assert_achieved(&mut simulation);
}
