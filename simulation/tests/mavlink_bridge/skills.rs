//! What each skill commands, over both autopilots.

use std::time::Duration;

use domain::declared_skill::{DeclaredSkill, DeclaredSkills};
use domain::file::Source;
use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use fake_autopilots::bridged::BRIDGE_DIES;
use fake_autopilots::wire::Faults;
use fake_autopilots::{
    BATTERY_FAILSAFE, FENCE, Kind, LINK_GAP, OTHER_ARMS, OTHER_SETS_MODE, OTHER_SETS_TARGET, PRECISION_LANDING, RESTART,
};
use kittiwake_proto::v1::{self, FlightMode, TaskState, vehicle_command::Command};

use crate::stories::mavlink_bridge::rig::{ARM, DISARM, LAND, LOITER, OFFBOARD, Published, Rig};

const BOTH: [Kind; 2] = [Kind::Px4, Kind::ArduPilot];

fn is(mode: FlightMode) -> impl Fn(&Published) -> bool {
    move |it| it.status.as_ref().is_some_and(|it| it.actual_mode() == mode)
}

#[test]
fn a_flight_from_the_ground_to_the_ground() {
    for kind in BOTH {
        for faults in [Faults::default(), Faults::LOSSY] {
            let mut rig = Rig::over(kind, faults);
            rig.airborne();
            let target = Ned::new(0.0, 30.0, -10.0);
            rig.target(target, Some(3.0));
            assert_eq!(rig.command(OFFBOARD), Ok(()), "{kind:?}");
            let mut fastest: f64 = 0.0;
            for _ in 0..200 {
                rig.pass(0.1);
                fastest = fastest.max(rig.speed_m_s());
            }
            assert_eq!(rig.status().actual_mode(), FlightMode::Offboard, "{kind:?} {:?}", rig.status());
            assert!(rig.position().distance_m(target) < 1.0, "{kind:?}: {}", rig.position());
            assert!((2.5..3.8).contains(&fastest), "{kind:?} {faults:?}: {fastest} m/s");
            assert_eq!(rig.command(LOITER), Ok(()));
            rig.setpoint = None;
            assert_eq!(rig.command(LAND), Ok(()));
            let commanded_at = rig.now;
            let down = |it: &Published| it.status.as_ref().is_some_and(|it| !it.armed) && it.landed == Some(true);
            assert!(rig.run(Duration::from_secs(60), down), "{kind:?} {:?}", rig.status());
            // PX4 says that it has left the mode before it says that its motors are off.
            let leaves = |(at, it): &&(_, v1::VehicleStatus)| {
                commanded_at < *at && it.armed && it.intended_mode() != FlightMode::Land
            };
            assert_eq!(rig.published.statuses.iter().find(leaves), None, "{kind:?}");
            assert!(!rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
            // The mode that a landing leaves behind cannot be armed in; it is left at once.
            rig.ready();
            assert_eq!(rig.command(ARM), Ok(()), "{kind:?}");
            assert_eq!(rig.command(DISARM), Ok(()), "{kind:?}");
            // And back, as after a delivery.
            rig.airborne();
            let home = Ned::new(0.0, 0.0, -10.0);
            rig.target(home, Some(10.0));
            assert_eq!(rig.command(OFFBOARD), Ok(()), "{kind:?}");
            rig.pass(20.0);
            assert!(rig.position().distance_m(home) < 1.0, "{kind:?}: {}", rig.position());
        }
    }
}

#[test]
fn a_landing_on_a_target_says_whether_it_sees_it_and_is_refused_without_precision_landing() {
    const LAND_ON_TARGET: Command = Command::Land(v1::LandCommand { on_target: true });
    #[track_caller]
    fn check(rig: &mut Rig, seconds: f64, seen: Option<bool>) {
        rig.pass(seconds);
        assert_eq!(rig.status().landing_target_seen, seen, "{:?}", rig.status());
    }
    let mut rig = Rig::new(Kind::ArduPilot);
    rig.airborne();
    let refused = "the autopilot has no precision landing: its PLND_ENABLED is 0";
    assert_eq!(rig.command(LAND_ON_TARGET), Err(refused.into()));
    rig.fault(PRECISION_LANDING, "");
    rig.pass(1.0);
    assert_eq!(rig.command(LAND_ON_TARGET), Ok(()));
    check(&mut rig, 1.0, Some(true));
    rig.fault("hide_target", 100);
    check(&mut rig, 1.5, Some(true));
    check(&mut rig, 1.0, Some(false));
    assert_eq!(rig.command(LOITER), Ok(()));
    check(&mut rig, 1.0, None);
    // It may see it again farther down.
    assert_eq!(rig.command(LAND_ON_TARGET), Ok(()));
    check(&mut rig, 1.0, None);
    rig.fault("hide_target", 0);
    check(&mut rig, 0.5, Some(true));
    // A landing where it is looks for nothing.
    assert_eq!(rig.command(LOITER), Ok(()));
    assert_eq!(rig.command(LAND), Ok(()));
    check(&mut rig, 0.5, None);
}

#[test]
fn a_landing_on_a_target_says_whether_it_is_seen() {
    let mut rig = Rig::new(Kind::Px4);
    rig.airborne();
    assert_eq!(rig.command(Command::Land(v1::LandCommand { on_target: true })), Ok(()));
    for (hidden_below_m, seen) in [(0, true), (50, false), (0, true)] {
        rig.fault("hide_target", hidden_below_m);
        let says = |it: &Published| it.status.as_ref().is_some_and(|it| it.landing_target_seen == Some(seen));
        assert!(rig.run(Duration::from_secs(3), says), "{seen}: {:?}", rig.status());
        assert_eq!(rig.status().actual_mode(), FlightMode::Land);
    }
    let down = |it: &Published| it.status.as_ref().is_some_and(|it| !it.armed);
    assert!(rig.run(Duration::from_secs(60), down), "{:?}", rig.status());
    rig.ready();
    assert!(rig.status().landing_target_seen.is_none() && !rig.status().commanded_by_other, "{:?}", rig.status());
}

#[test]
fn a_winch_that_is_interrupted_stops_or_it_is_said_that_it_goes_on() {
    /// How a task ends that is interrupted after three seconds, by this action of DO_WINCH.
    #[track_caller]
    fn check(kind: Kind, faults: Faults, action: u8, expected: (&str, &str)) {
        let text = format!(
            "version = 1\nsummary = \"Lowers\"\nseconds = 60.0\nlimit_s = 90.0\noutcome = {{ done = \"success\" }}
            [mavlink]\ncommand = \"DO_WINCH\"\nparams = [1, 1, 9]\ncancel = [1, {action}]"
        );
        let skill = DeclaredSkill::read(&Source { path: "lower.toml".into(), text }).unwrap();
        let mut rig = Rig::over(kind, faults).skilled(&DeclaredSkills::of(vec![skill]));
        rig.airborne();
        let order =
            |cancel| v1::TaskOrder { request_id: "r".into(), skill: "lower".into(), cancel, ..Default::default() };
        rig.tell(order(false));
        rig.pass(3.0);
        rig.tell(order(true));
        let is_ended = |it: &Published| it.task.as_ref().is_some_and(|it| it.state() == TaskState::Ended);
        assert!(rig.run(Duration::from_secs(10), is_ended), "{:?}", rig.published.task);
        let report = rig.published.task.unwrap();
        assert_eq!((report.outcome.as_str(), report.reason.as_str()), expected, "{kind:?}");
    }
    const STOPS: u8 = 2;
    const LOCKS: u8 = 3;
    for faults in [Faults::default(), Faults::LOSSY] {
        check(Kind::ArduPilot, faults, STOPS, ("cancelled", ""));
    }
    let goes_on = "the command that ends it is refused by the autopilot: failed: it may go on";
    check(Kind::ArduPilot, Faults::default(), LOCKS, ("error", goes_on));
    // PX4 does not answer this command.
    let unanswered = "the command that ends it is not acknowledged by the autopilot: it may go on";
    check(Kind::Px4, Faults::default(), STOPS, ("error", unanswered));
}

#[test]
fn a_stop_ends_at_rest_in_loiter() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.airborne();
        rig.target(Ned::new(0.0, 200.0, -10.0), Some(8.0));
        assert_eq!(rig.command(OFFBOARD), Ok(()));
        rig.pass(8.0);
        assert!(5.0 < rig.speed_m_s(), "{kind:?} {}", rig.speed_m_s());
        // The stream goes on, as it does until the skill manager hears the answer.
        assert_eq!(rig.command(LOITER), Ok(()));
        rig.pass(6.0);
        assert!(rig.speed_m_s() < 0.3, "{kind:?}: {} m/s", rig.speed_m_s());
        assert_eq!(rig.status().actual_mode(), FlightMode::Loiter, "{kind:?}");
        let height_m = rig.position().height_m();
        assert!((height_m - 10.0).abs() < 1.0, "{kind:?}: {height_m} m");
    }
}

#[test]
fn a_turn_at_full_speed_is_a_flight_of_its_setpoints() {
    for kind in BOTH {
        for back in [Ned::new(0.0, 0.0, -10.0), Ned::new(150.0, 100.0, -30.0), Ned::new(0.0, 105.0, -10.0)] {
            let mut rig = Rig::new(kind);
            rig.airborne();
            rig.target(Ned::new(0.0, 400.0, -10.0), Some(10.0));
            assert_eq!(rig.command(OFFBOARD), Ok(()));
            rig.pass(14.0);
            let (turn, turned_at) = (rig.position(), rig.now);
            assert!(9.5 < rig.speed_m_s(), "{kind:?} {}", rig.speed_m_s());
            rig.target(back, Some(10.0));
            rig.pass(40.0);
            let unlike =
                |it: &v1::VehicleStatus| it.actual_mode() != FlightMode::Offboard || it.failures().next().is_some();
            let concluded = rig.published.statuses.iter().find(|(at, it)| turned_at < *at && unlike(it));
            assert_eq!(concluded, None, "{kind:?} from {turn} to {back}");
            assert!(rig.position().distance_m(back) < 1.0, "{kind:?} from {turn} to {back}: {}", rig.position());
        }
    }
}

#[test]
fn what_the_autopilot_drops_beyond_its_fence_is_our_conclusion_and_no_failsafe_of_its_own() {
    let mut rig = Rig::new(Kind::ArduPilot);
    rig.airborne();
    rig.fault(FENCE, 60);
    rig.target(Ned::new(0.0, 200.0, -10.0), Some(8.0));
    assert_eq!(rig.command(OFFBOARD), Ok(()));
    let stands = |it: &Published| it.status.as_ref().is_some_and(|it| it.actual_mode() == FlightMode::Loiter);
    assert!(rig.run(Duration::from_secs(60), stands), "{:?}", rig.status());
    let status = rig.status();
    assert!(!status.failsafe && status.failsafe_reason() == v1::FailsafeReason::Setpoints, "{status:?}");
    assert!(status.failures().eq([v1::FailureFlag::OffboardSignalLost]), "{status:?}");
    assert!(status.reason.contains("does not fly its setpoints"), "{status:?}");
    // A failsafe of its own is still reported as one.
    rig.fault(BATTERY_FAILSAFE, 9);
    rig.pass(2.0);
    let status = rig.status();
    assert!(status.failsafe && status.failsafe_reason() != v1::FailsafeReason::Setpoints, "{status:?}");
    assert_eq!(status.actual_mode(), FlightMode::Land, "{status:?}");
}

#[test]
fn a_place_two_kilometres_away_is_reached_where_it_is_on_the_earth() {
    for kind in BOTH {
        for target in [Ned::new(2_100.0, 0.0, -10.0), Ned::new(-1_400.0, 1_600.0, -10.0)] {
            let mut rig = Rig::new(kind);
            rig.airborne();
            rig.target(target, Some(10.0));
            assert_eq!(rig.command(OFFBOARD), Ok(()));
            rig.pass(230.0);
            let origin = rig.status().origin.expect("an origin");
            let place = |latitude_deg, longitude_deg| LatLon::new(latitude_deg, longitude_deg).expect("a place");
            let frame = LocalFrame::at(place(origin.latitude_deg, origin.longitude_deg));
            let globe = rig.published.globe.expect("a position");
            let there = frame.local(place(globe.latitude_deg, globe.longitude_deg)).at_height(10.0);
            assert!(there.distance_m(target) < 1.0, "{kind:?}: {there} instead of {target}");
        }
    }
}

#[test]
fn a_refusal_comes_with_its_reason() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.ready();
        rig.fault("estimator_invalid", "on");
        rig.pass(1.0);
        assert_eq!(rig.status().can_arm, Some(false), "{kind:?} {:?}", rig.status());
        let refused = rig.command(ARM).expect_err("it does not know where it is");
        let expected = if kind == Kind::Px4 { "pre-arm checks" } else { "Need Position Estimate" };
        assert!(refused.contains(expected), "{kind:?}: {refused}");
        assert!(!rig.status().armed);
        let takeoff = Command::Takeoff(v1::TakeoffCommand { altitude_m: 10.0 });
        assert_eq!(rig.command(takeoff), Err("the vehicle is disarmed".into()));
    }
}

#[test]
fn somebody_else_is_not_fought() {
    for (kind, mode) in [(Kind::Px4, 3_u32 << 16), (Kind::ArduPilot, 16)] {
        let mut rig = Rig::new(kind);
        rig.airborne();
        rig.target(Ned::new(0.0, 200.0, -10.0), Some(8.0));
        assert_eq!(rig.command(OFFBOARD), Ok(()));
        rig.pass(3.0);
        assert!(!rig.status().commanded_by_other);
        rig.fault(OTHER_SETS_MODE, mode);
        rig.pass(1.0);
        assert!(rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
        assert!(rig.status().reason.contains("POS"), "{kind:?} {:?}", rig.status());
        // The stream goes on, and does not reach the vehicle.
        rig.pass(10.0);
        assert!(rig.status().commanded_by_other && rig.speed_m_s() < 0.5, "{kind:?} {}", rig.speed_m_s());
        // An order takes it back.
        assert_eq!(rig.command(LOITER), Ok(()));
        rig.pass(0.5);
        assert!(!rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
    }
}

#[test]
fn a_mode_that_is_chosen_while_the_motors_are_off_is_nobodys_take_over_and_is_not_fought() {
    for (kind, mode) in [(Kind::Px4, 3_u32 << 16), (Kind::ArduPilot, 16)] {
        let mut rig = Rig::new(kind);
        rig.ready();
        rig.pass(2.0);
        rig.fault(OTHER_SETS_MODE, mode);
        rig.pass(10.0);
        let status = rig.status().clone();
        assert!(!status.commanded_by_other, "{kind:?} {status:?}");
        assert_eq!(status.actual_mode(), FlightMode::Unspecified, "{kind:?}: it is left");
        // Ours is selected before arming.
        assert_eq!(rig.command(ARM), Ok(()), "{kind:?}");
        assert!(!rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
        assert_eq!(rig.status().actual_mode(), FlightMode::Loiter, "{kind:?}");
    }
}

#[test]
fn whoever_arms_it_flies_it() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.ready();
        rig.fault(OTHER_ARMS, "");
        rig.pass(2.0);
        let status = rig.status();
        assert!(status.armed && status.commanded_by_other, "{kind:?} {status:?}");
        assert!(status.reason.contains("armed by somebody else"), "{kind:?} {status:?}");
    }
}

#[test]
fn setpoints_that_stop_stop_the_vehicle() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.airborne();
        rig.target(Ned::new(0.0, 500.0, -10.0), Some(8.0));
        assert_eq!(rig.command(OFFBOARD), Ok(()));
        rig.pass(6.0);
        let setpoint = rig.setpoint.take();
        rig.pass(8.0);
        let status = rig.status().clone();
        assert!(rig.speed_m_s() < 0.5, "{kind:?} {} m/s", rig.speed_m_s());
        assert_eq!(status.intended_mode(), FlightMode::Offboard, "{kind:?} {status:?}");
        assert_ne!(status.actual_mode(), FlightMode::Offboard, "{kind:?} {status:?}");
        assert!(status.failures().any(|it| it == v1::FailureFlag::OffboardSignalLost), "{kind:?} {status:?}");
        assert!(!status.commanded_by_other);
        // It resumes by itself when they return, as PX4 does.
        rig.setpoint = setpoint;
        assert!(rig.run(Duration::from_secs(3), is(FlightMode::Offboard)), "{kind:?} {:?}", rig.status());
    }
}

/// A vehicle that flies east at 8 m/s.
fn on_the_way(kind: Kind) -> Rig {
    let mut rig = Rig::new(kind);
    rig.airborne();
    rig.target(Ned::new(0.0, 500.0, -10.0), Some(8.0));
    assert_eq!(rig.command(OFFBOARD), Ok(()));
    rig.pass(8.0);
    assert!(7.0 < rig.speed_m_s(), "{kind:?} {}", rig.speed_m_s());
    rig
}

#[test]
fn setpoints_that_pause_or_do_not_come_through_are_nobody_elses() {
    for kind in BOTH {
        for (pause_s, gap_s) in
            [(0.9_f64, 0.0_f64), (1.5, 0.0), (0.0, 1.0), (0.0, 3.0), (0.0, 6.0), (2.0, 1.0), (1.0, 4.0)]
        {
            let mut rig = on_the_way(kind);
            let setpoint = rig.setpoint;
            rig.fault(LINK_GAP, gap_s);
            if 0.0 < pause_s {
                rig.setpoint = None;
            }
            rig.pass(pause_s.max(gap_s));
            rig.setpoint = setpoint;
            rig.pass(6.0);
            let others = rig.published.statuses.iter().find(|(_, it)| it.commanded_by_other);
            assert_eq!(others, None, "{kind:?}, setpoints pause for {pause_s} s, the link for {gap_s} s");
        }
    }
}

#[test]
fn a_stop_that_is_lost_is_said_again() {
    for (kind, gap_s) in [(Kind::ArduPilot, 0.7_f64), (Kind::ArduPilot, 2.0), (Kind::Px4, 0.7)] {
        let mut rig = on_the_way(kind);
        rig.fault(LINK_GAP, gap_s);
        let (from, begun) = (rig.position(), rig.now);
        let _ = rig.command(LOITER);
        rig.setpoint = None;
        rig.pass(gap_s + 7.0);
        assert!(rig.speed_m_s() < 0.3, "{kind:?}, {gap_s} s: {} m/s", rig.speed_m_s());
        // Through the gap, half a second more, and 2 m/s2 of braking with a reserve; not the 3 s for which ArduPilot goes on by itself.
        let limit_m = 8.0 * (gap_s + 0.5) + 21.0;
        let flown_m = rig.position().distance_m(from);
        assert!(flown_m < limit_m, "{kind:?}, {gap_s} s since {begun:?}: {flown_m} m");
        assert!(!rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
    }
}

#[test]
fn a_setpoint_of_somebody_else_is_not_fought_and_an_order_takes_the_vehicle_back_for_good() {
    for holds in [true, false] {
        let mut rig = on_the_way(Kind::ArduPilot);
        if holds {
            assert_eq!(rig.command(LOITER), Ok(()));
            rig.pass(6.0);
        }
        rig.setpoint = None;
        rig.pass(0.2);
        rig.fault(OTHER_SETS_TARGET, "-80 0 -15");
        rig.pass(if holds { 1.0 } else { 0.3 });
        if !holds {
            // One that is sent between ours is overwritten by the next: it must be sent again and again.
            for _ in 0..8 {
                rig.fault(OTHER_SETS_TARGET, "-80 0 -15");
                rig.pass(0.25);
            }
        }
        assert!(rig.status().commanded_by_other, "{:?}", rig.status());
        rig.pass(12.0);
        assert!(rig.position().north_m < -20.0, "it is left alone: {}", rig.position());
        assert!(rig.status().commanded_by_other, "{:?}", rig.status());
        assert_eq!(rig.command(LOITER), Ok(()));
        rig.pass(10.0);
        assert!(!rig.status().commanded_by_other && rig.speed_m_s() < 0.3, "{:?}", rig.status());
        rig.target(Ned::new(0.0, 500.0, -10.0), Some(8.0));
        assert_eq!(rig.command(OFFBOARD), Ok(()));
        rig.pass(10.0);
        assert!(!rig.status().commanded_by_other && 7.0 < rig.speed_m_s(), "{:?}", rig.status());
    }
}

#[test]
fn a_failsafe_that_has_landed_it_is_none_on_the_ground() {
    let mut rig = on_the_way(Kind::ArduPilot);
    rig.fault(BATTERY_FAILSAFE, "");
    rig.setpoint = None;
    rig.pass(2.0);
    assert!(rig.status().failsafe && !rig.status().commanded_by_other, "{:?}", rig.status());
    let down = |it: &Published| it.status.as_ref().is_some_and(|it| !it.armed) && it.landed == Some(true);
    assert!(rig.run(Duration::from_secs(60), down), "{:?}", rig.status());
    rig.pass(3.0);
    let status = rig.status().clone();
    assert!(!status.failsafe && status.can_arm == Some(false), "{status:?}");
    assert!(rig.command(ARM).expect_err("it is not ready").contains("Battery 1 failed"));
}

#[test]
fn a_link_gap_is_silence_and_no_old_values() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.airborne();
        rig.fault(LINK_GAP, 6);
        rig.pass(0.2);
        let before = rig.published.count;
        rig.pass(5.7);
        assert_eq!(rig.published.count, before, "{kind:?}: nothing is said of what is not heard");
        rig.pass(3.0);
        assert!(before < rig.published.count);
        assert!(!rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
    }
}

#[test]
fn a_restart_in_flight_begins_a_new_frame() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.airborne();
        let epoch = rig.status().frame_epoch;
        rig.fault(RESTART, 1);
        let disarmed = |it: &Published| it.status.as_ref().is_some_and(|it| !it.armed);
        assert!(rig.run(Duration::from_secs(10), disarmed), "{kind:?} {:?}", rig.status());
        rig.pass(5.0);
        assert!(
            rig.run(Duration::from_secs(60), |it| it.status.as_ref().is_some_and(|it| it.frame_epoch != epoch)),
            "{kind:?}"
        );
        // Nothing that was asked for is remembered, so it was asked for again; then it can fly again.
        rig.airborne();
    }
}

#[test]
fn a_bridge_that_dies_in_flight_finds_the_vehicle_again() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.airborne();
        rig.target(Ned::new(0.0, 500.0, -10.0), Some(8.0));
        assert_eq!(rig.command(OFFBOARD), Ok(()));
        rig.pass(5.0);
        let epoch = rig.status().frame_epoch;
        // Long enough for the layers above to have stopped sending.
        let _ = rig.setpoint.take();
        rig.fault(BRIDGE_DIES, 4);
        rig.pass(7.0);
        assert_eq!(rig.status().frame_epoch, epoch, "{kind:?}: the frame is the same");
        assert!(rig.status().armed && !rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
        assert!(rig.speed_m_s() < 0.5, "{kind:?}: it stands: {}", rig.speed_m_s());
        // PX4 still waits for the setpoints of the one that died: they are missed, and nobody has chosen anything.
        let misses_us = rig.status().failures().any(|it| it == v1::FailureFlag::OffboardSignalLost);
        assert_eq!(misses_us, kind == Kind::Px4, "{kind:?} {:?}", rig.status());
        assert_eq!(rig.command(LAND), Ok(()));
        assert!(rig.run(Duration::from_secs(60), |it| it.status.as_ref().is_some_and(|it| !it.armed)));
    }
}

#[test]
fn a_bridge_that_is_back_at_once_flies_on() {
    for kind in BOTH {
        let mut rig = on_the_way(kind);
        let since = rig.now;
        rig.fault(BRIDGE_DIES, 0.3);
        rig.pass(8.0);
        let later = rig.published.statuses.iter().filter(|(at, _)| since < *at).map(|(_, it)| it).collect::<Vec<_>>();
        let flies = |it: &v1::VehicleStatus| {
            it.intended_mode() == FlightMode::Offboard
                && it.actual_mode() == FlightMode::Offboard
                && !it.commanded_by_other
        };
        assert!(later.iter().all(|it| flies(it)), "{kind:?} {later:?}");
        assert!(7.0 < rig.speed_m_s(), "{kind:?}: {} m/s", rig.speed_m_s());
    }
}

#[test]
fn a_takeoff_from_where_it_has_landed_moves_no_frame() {
    // PX4 takes off again without that it is disarmed, from another place than where it was armed.
    for kind in BOTH {
        let mut rig = on_the_way(kind);
        assert_eq!(rig.command(LOITER), Ok(()));
        rig.setpoint = None;
        rig.pass(6.0);
        assert_eq!(rig.command(LAND), Ok(()));
        assert!(rig.run(Duration::from_secs(60), |it| it.landed == Some(true)), "{kind:?}");
        let epoch = rig.status().frame_epoch;
        if rig.status().armed {
            let climb = Command::Takeoff(v1::TakeoffCommand { altitude_m: 10.0 + rig.position().height_m() });
            assert_eq!(rig.command(climb), Ok(()), "{kind:?} {:?}", rig.status());
            rig.pass(10.0);
        } else {
            rig.airborne();
        }
        assert_eq!(rig.status().frame_epoch, epoch, "{kind:?} {:?}", rig.status());
    }
}

#[test]
fn a_failsafe_of_the_autopilot_is_nobody_elses_doing() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.airborne();
        rig.fault("battery", 0.03);
        assert!(rig.run(Duration::from_secs(5), is(FlightMode::Land)), "{kind:?} {:?}", rig.status());
        rig.pass(2.0);
        let status = rig.status();
        assert!(status.failsafe && !status.commanded_by_other, "{kind:?} {status:?}");
        assert_eq!(status.intended_mode(), FlightMode::Loiter, "{kind:?} {status:?}");
        assert!(kind == Kind::Px4 || status.reason.contains("Battery Failsafe"), "{status:?}");
    }
}

#[test]
fn other_aircraft_are_reported_in_the_local_frame() {
    for kind in BOTH {
        let mut rig = Rig::new(kind);
        rig.ready();
        rig.fault("intruder", "500 100 80 -20 5 uncrewed");
        assert!(rig.run(Duration::from_secs(5), |it| it.traffic.is_some()), "{kind:?}");
        let it = rig.published.traffic.clone().expect("a report");
        let (position, velocity) = (it.position.unwrap_or_default(), it.velocity.unwrap_or_default());
        assert!((position.north_m - 500.0).abs() < 120.0 && (position.east_m - 100.0).abs() < 40.0, "{it:?}");
        assert!((position.down_m + 80.0).abs() < 1.0, "{it:?}");
        assert_eq!(it.kind(), v1::TrafficKind::Uncrewed);
        assert!((velocity.north_m_s + 20.0).abs() < 0.5 && (velocity.east_m_s - 5.0).abs() < 0.5, "{it:?}");
    }
}
