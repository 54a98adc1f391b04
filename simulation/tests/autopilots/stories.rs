//! What may happen in a flight, and the result over either autopilot. To add a story, add a row.

use std::time::Duration;

use control_tower::policy::Policy;
use fake_autopilots::bridged::BRIDGE_DIES;
use fake_autopilots::wire::Faults;
use fake_autopilots::{GNSS_GLITCH, Kind, LINK_GAP, OTHER_SETS_MODE, RESTART};
use kittiwake_proto::v1::MissionOutcome;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision};
use simulation::Simulation;

use crate::stories::support::sample;

use super::{BOTH, LIMIT, reference};

/// A flight of the reference mission.
struct Story<'a> {
    name: &'a str,
    permissions: Policy,
    link: Faults,
    /// What happens, in this order.
    troubles: &'a [(When<'a>, Trouble<'a>)],
    /// How the mission ends; `None`: it does not within a minute after the last of them, and nothing is commanded.
    outcome: Option<MissionOutcome>,
    /// Decided in this order.
    expected: &'a [&'a str],
    /// Never decided.
    never: &'a [&'a str],
}

/// This number of seconds after a decision with this text.
type When<'a> = (&'a str, u64);

/// What happens.
enum Trouble<'a> {
    /// A fault of the vehicle, its autopilot, the link or the bridge.
    Fault(&'a str, &'a [&'a str]),
    /// Somebody else sets a mode: of PX4, of ArduPilot.
    OtherSets(u32, u32),
    /// A flag is raised, and falls after as many seconds.
    Flag(&'a str, u64),
    /// A process does nothing for as many seconds.
    Hangs(&'a str, u64),
    /// The control tower decides about an area.
    Decides(&'a str, Decision),
    /// An operator resumes.
    Resume,
    /// An operator has it return.
    Return,
}

const NOTHING: Story<'_> = Story {
    name: "",
    permissions: Policy::Grant,
    link: Faults { longest_delay: Duration::ZERO, loss: 0.0, doubled: 0.0, cut: 0.0, foreign: 0.0, bursts: 0.0 },
    troubles: &[],
    outcome: Some(MissionOutcome::Success),
    expected: &[],
    // Nothing of all this moves the frame, but a restart.
    never: &["frame_moved"],
};

/// Well on the way of the longest leg, or of the one back.
const ON_THE_WAY: When<'_> = ("step 4 of 5", 10);
/// PX4's POSCTL and AUTO.RTL.
const POSCTL: u32 = 3 << 16;
const PX4_LAND: u32 = 4 << 16 | 6 << 24;
/// ArduPilot's POSHOLD and LAND.
const POSHOLD: u32 = 16;
const LAND: u32 = 9;

#[track_caller]
fn check(story: &Story<'_>) {
    for kind in sample(BOTH) {
        let mut simulation = reference(kind, story.permissions, story.link);
        for ((decision, more_s), trouble) in story.troubles {
            let told = |it: &Simulation<'_>| format!("{} over {kind:?}: {decision}\n{}", story.name, it.decision_log());
            assert!(simulation.fly_until(decision, LIMIT), "{}", told(&simulation));
            simulation.pass(Duration::from_secs(*more_s));
            happens(trouble, kind, &mut simulation);
        }
        let report = match story.outcome {
            Some(_) => simulation.fly(LIMIT),
            None => {
                simulation.pass(Duration::from_secs(60));
                simulation.report()
            }
        };
        let log = simulation.decision_log();
        let told = format!("{} over {kind:?}\n{log}", story.name);
        assert_eq!(report.map(|it| it.outcome()), story.outcome, "{told}");
        let mut lines = log.lines();
        for part in story.expected {
            assert!(lines.any(|it| it.contains(part)), "`{part}` is missing or too early: {told}");
        }
        for part in story.never {
            assert!(!log.contains(part), "`{part}`: {told}");
        }
        assert_eq!(simulation.breaches(), [], "{told}");
    }
}

fn happens(trouble: &Trouble<'_>, kind: Kind, simulation: &mut Simulation<'_>) {
    match trouble {
        Trouble::Fault(name, arguments) => simulation.inject_fault(name, arguments),
        Trouble::OtherSets(px4, ardupilot) => {
            let mode = if kind == Kind::Px4 { px4 } else { ardupilot };
            simulation.inject_fault(OTHER_SETS_MODE, &[&mode.to_string()]);
        }
        Trouble::Flag(name, seconds) => {
            simulation.inject_flag(name);
            simulation.pass(Duration::from_secs(*seconds));
            simulation.lower_flag(name);
        }
        Trouble::Hangs(process, seconds) => simulation.freeze(process, Duration::from_secs(*seconds)),
        Trouble::Decides(area, decision) => simulation.decide(area, *decision),
        Trouble::Return => simulation.order(Verb::Return(v1::ReturnHome { overrides: false })),
        Trouble::Resume => {
            simulation.order(Verb::Resume(v1::ResumeMission {}));
            simulation.pass(Duration::from_secs(1));
        }
    }
}

#[test]
fn a_terminated_flight_is_a_crash_that_no_resume_ends() {
    const FELL: &str = "`crashed`: the motors were stopped at";
    check(&Story {
        name: "terminated",
        troubles: &[
            (ON_THE_WAY, Trouble::Fault("flight_termination", &[])),
            (("flag `crashed` raised: the motors were stopped at", 10), Trouble::Resume),
        ],
        outcome: Some(MissionOutcome::Crash),
        expected: &[&format!("over: {FELL}"), &format!("resume: refused: the mission is over: {FELL}")],
        ..NOTHING
    });
}

#[test]
fn it_waits_before_an_area_until_the_tower_grants_it() {
    check(&Story {
        name: "hold",
        permissions: Policy::Silent,
        troubles: &[
            (("asking for area A", 20), Trouble::Decides("A", Decision::Grant)),
            (("asking for area B", 20), Trouble::Decides("B", Decision::Grant)),
        ],
        expected: &["area A: granted", "step 2 succeeded", "area B: granted", "every objective was achieved"],
        ..NOTHING
    });
}

#[test]
fn a_denied_area_is_flown_round_or_given_up() {
    check(&Story {
        name: "denied",
        permissions: Policy::Deny,
        outcome: Some(MissionOutcome::Failure),
        expected: &["area A: denied", "fly to (100, 100, 10)", "area B: denied", "fly to (0, 0, 10)"],
        ..NOTHING
    });
}

#[test]
fn a_silent_tower_is_flown_round() {
    check(&Story {
        name: "silent",
        permissions: Policy::Silent,
        outcome: Some(MissionOutcome::Failure),
        expected: &["area A: no answer", "fly to (100, 100, 10)", "area B: no answer", "fly to (0, 0, 10)"],
        ..NOTHING
    });
}

#[test]
fn an_obstacle_costs_a_stop_and_a_new_plan() {
    check(&Story {
        name: "obstacle",
        troubles: &[(ON_THE_WAY, Trouble::Flag("obstacle", 5))],
        expected: &["`obstacle`: stop", "`obstacle` is over", "plan 2"],
        ..NOTHING
    });
}

#[test]
fn with_a_low_battery_it_lands_early() {
    check(&Story {
        name: "battery",
        troubles: &[(ON_THE_WAY, Trouble::Fault("battery", &["0.24"]))],
        outcome: Some(MissionOutcome::Emergency),
        expected: &["`battery_low`: divert"],
        never: &["path_deviated", "offboard_link_lost", "autopilot_preempts", "land_elsewhere"],
        ..NOTHING
    });
}

#[test]
fn a_return_out_of_a_cruise_lands_at_home() {
    // It turns round where it comes to rest, and not where the order reaches it.
    check(&Story {
        name: "return",
        troubles: &[(ON_THE_WAY, Trouble::Return)],
        outcome: Some(MissionOutcome::Emergency),
        expected: &["`operator_return`: return_home", "over: `operator_return`"],
        never: &["path_deviated", "offboard_link_lost", "autopilot_preempts", "land_elsewhere", "came down"],
        ..NOTHING
    });
}

#[test]
fn a_receiver_that_the_estimator_does_not_believe_is_lost() {
    check(&Story {
        name: "glitch",
        troubles: &[(ON_THE_WAY, Trouble::Fault(GNSS_GLITCH, &["12"]))],
        expected: &["flag `gnss_lost` raised", "`gnss_lost`: stop", "`gnss_lost` is over"],
        ..NOTHING
    });
}

#[test]
fn a_landing_of_the_autopilots_own_is_left_to_it() {
    check(&Story {
        name: "autopilot's battery failsafe",
        troubles: &[(ON_THE_WAY, Trouble::Fault("battery", &["0.03"]))],
        outcome: Some(MissionOutcome::Emergency),
        expected: &[],
        ..NOTHING
    });
}

#[test]
fn whoever_takes_over_is_not_fought_until_an_operator_resumes() {
    let takes = (ON_THE_WAY, Trouble::OtherSets(POSCTL, POSHOLD));
    check(&Story {
        name: "take-over",
        troubles: &[takes],
        outcome: None,
        expected: &["flag `somebody_else_flies` raised"],
        ..NOTHING
    });
    let takes = (ON_THE_WAY, Trouble::OtherSets(POSCTL, POSHOLD));
    check(&Story {
        name: "take-over and resume",
        troubles: &[takes, (("flag `somebody_else_flies` raised", 20), Trouble::Resume)],
        expected: &["flag `somebody_else_flies` raised", "land"],
        ..NOTHING
    });
}

#[test]
fn whoever_lands_it_has_landed_it() {
    check(&Story {
        name: "landed by another",
        troubles: &[
            (ON_THE_WAY, Trouble::OtherSets(PX4_LAND, LAND)),
            (("the vehicle is on the ground", 5), Trouble::Fault("wind", &["0", "0"])),
        ],
        outcome: None,
        expected: &["flag `somebody_else_flies` raised"],
        ..NOTHING
    });
}

#[test]
fn an_autopilot_that_is_killed_in_flight_has_fallen() {
    check(&Story {
        name: "restart",
        troubles: &[(ON_THE_WAY, Trouble::Fault(RESTART, &["2"]))],
        outcome: Some(MissionOutcome::Crash),
        never: &[],
        ..NOTHING
    });
}

#[test]
fn a_gap_of_the_link_costs_a_stop() {
    check(&Story { name: "gap", troubles: &[(ON_THE_WAY, Trouble::Fault(LINK_GAP, &["6"]))], ..NOTHING });
}

#[test]
fn a_landing_during_which_nothing_is_heard_is_flown_to_its_end() {
    // All of the machine stands for a while: neither the vehicle nor the monitor is heard.
    let land = "step 5 of 5: land";
    check(&Story {
        name: "silent landing",
        troubles: &[((land, 6), Trouble::Fault(LINK_GAP, &["2.5"])), ((land, 0), Trouble::Hangs("monitor", 3))],
        expected: &["`introspection_lost` does not count while landing", "step 5 succeeded", "plan 2: takeoff"],
        ..NOTHING
    });
}

#[test]
fn a_bridge_that_dies_costs_a_stop() {
    check(&Story {
        name: "bridge",
        troubles: &[(ON_THE_WAY, Trouble::Fault(BRIDGE_DIES, &["3"]))],
        expected: &["`local_position_stale`: stop"],
        ..NOTHING
    });
}

#[test]
fn a_bridge_that_is_back_at_once_costs_nothing() {
    for seconds in sample(["0.2", "0.5", "1"]) {
        check(&Story {
            name: "bridge, at once",
            troubles: &[(ON_THE_WAY, Trouble::Fault(BRIDGE_DIES, &[seconds]))],
            never: &["somebody_else_flies", "frame_moved"],
            ..NOTHING
        });
    }
}

#[test]
fn a_frame_that_shakes_too_much_brings_it_home() {
    check(&Story {
        name: "vibration",
        troubles: &[(ON_THE_WAY, Trouble::Fault("vibration", &["70"]))],
        outcome: Some(MissionOutcome::Emergency),
        expected: &["flag `vibration_extreme` raised: vehicle.vibration_m_s2 75", "`vibration_extreme`: return_home"],
        ..NOTHING
    });
}

#[test]
fn a_revoked_area_is_left() {
    check(&Story {
        name: "revoked",
        troubles: &[(ON_THE_WAY, Trouble::Decides("B", Decision::Revoke))],
        outcome: Some(MissionOutcome::Failure),
        expected: &["area B: revoked", "transition: fly to (0, 360, 10)", "fly to (0, 0, 10)"],
        ..NOTHING
    });
}

#[test]
fn a_bad_link_ends_no_mission() {
    check(&Story { name: "lossy", link: Faults::LOSSY, ..NOTHING });
}

#[test]
fn no_process_that_dies_ends_the_mission() {
    for process in sample(["planner", "skill-manager", "mcm", "monitor", "control-tower", "gateway"]) {
        check(&Story { name: process, troubles: &[(ON_THE_WAY, Trouble::Hangs(process, 4))], ..NOTHING });
    }
}
