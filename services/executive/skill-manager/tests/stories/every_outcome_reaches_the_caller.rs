//! For any sequence of events: every skill that was accepted ends exactly once, and only one command
//! is in flight at a time. (The autopilot of these tests checks every command and setpoint.)

use domain::geometry::{Ned, NedVelocity};
use domain::skill::Goal;
use kittiwake_proto::v1::{FlightMode, SkillState, WhenBusy};
use proptest::prelude::*;

use crate::stories::support::autopilot::Reaction::{self, *};
use crate::stories::support::autopilot::{Autopilot, Source};
use crate::stories::support::rig::Rig;

#[derive(Debug, Clone)]
enum Happening {
    Ask { goal: Goal, when_busy: WhenBusy, gave_up: u64 },
    Cancel(u64),
    Expect(Reaction),
    Failsafe(Option<FlightMode>),
    SetMode(FlightMode),
    Disarm,
    Freeze(Source),
    Thaw,
    Pass(f64),
}

fn goal() -> impl Strategy<Value = Goal> {
    let position = (-30.0..30.0, -30.0..30.0, -20.0..0.0).prop_map(|(n, e, d)| Ned::new(n, e, d));
    prop_oneof![
        Just(Goal::Land),
        Just(Goal::Stop),
        prop_oneof![1.0..20.0, Just(1e300)].prop_map(|climb_m| Goal::Takeoff { climb_m }),
        (position, prop_oneof![1.0..10.0, Just(1e-300)], any::<bool>()).prop_map(
            |(target, speed_limit_m_s, hold_at_target)| Goal::Position {
                target,
                speed_limit_m_s,
                yaw_rad: Some(0.5),
                hold_at_target
            }
        ),
        prop_oneof![Just(None), Just(Some(1e300)), (0.1..10.0).prop_map(Some)].prop_map(|timeout_s| {
            Goal::Velocity { velocity: NedVelocity::new(1.0, 0.0, 0.1), yaw_rate_rad_s: None, timeout_s }
        }),
    ]
}

fn mode() -> impl Strategy<Value = FlightMode> {
    prop_oneof![Just(FlightMode::Loiter), Just(FlightMode::Land), Just(FlightMode::Return), Just(FlightMode::Offboard)]
}

fn happening() -> impl Strategy<Value = Happening> {
    let when_busy = prop_oneof![4 => Just(WhenBusy::Replace), 1 => Just(WhenBusy::Refuse)];
    let reaction = prop_oneof![Just(Obey), Just(Reject), Just(Lose), Just(ObeySilently), Just(Lie), Just(AckTwice)];
    let source = prop_oneof![Just(Source::Position), Just(Source::Status), Just(Source::Landed)];
    prop_oneof![
        8 => (goal(), when_busy, 0..12u64)
            .prop_map(|(goal, when_busy, gave_up)| Happening::Ask { goal, when_busy, gave_up }),
        3 => (1..12u64).prop_map(Happening::Cancel),
        4 => reaction.prop_map(Happening::Expect),
        1 => proptest::option::of(mode()).prop_map(Happening::Failsafe),
        1 => mode().prop_map(Happening::SetMode),
        1 => Just(Happening::Disarm),
        1 => source.prop_map(Happening::Freeze),
        1 => Just(Happening::Thaw),
        5 => prop_oneof![0.0..0.02, 0.0..0.3, 0.0..3.0, 0.0..30.0].prop_map(Happening::Pass),
    ]
}

fn happen(rig: &mut Rig, happening: Happening, accepted: &mut Vec<u64>) {
    match happening {
        Happening::Ask { goal, when_busy, gave_up } => {
            let reply = rig.ask(goal, when_busy, gave_up);
            assert_ne!(reply.skill_id == 0, reply.refusal.is_empty(), "accepted or refused: {reply:?}");
            accepted.extend(Some(reply.skill_id).filter(|it| *it != 0));
        }
        Happening::Cancel(id) => drop(rig.cancel(id)),
        Happening::Expect(reaction) => drop(rig.expect([reaction])),
        Happening::Failsafe(mode) => rig.autopilot.failsafe = mode,
        Happening::SetMode(mode) => rig.autopilot.intended = mode,
        Happening::Disarm => rig.autopilot.armed = false,
        Happening::Freeze(source) => rig.autopilot.frozen.push(source),
        Happening::Thaw => rig.autopilot.frozen.clear(),
        Happening::Pass(seconds) => drop(rig.run(seconds)),
    }
}

/// Ends all faults; then a stop ends what still runs.
fn bring_to_an_end(rig: &mut Rig) -> u64 {
    rig.autopilot.frozen.clear();
    rig.autopilot.reactions.clear();
    rig.autopilot.failsafe = None;
    rig.run(5.0);
    let stop = rig.take_back(Goal::Stop);
    rig.outcome(stop);
    rig.run(5.0);
    stop
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_skill_that_was_accepted_ends_exactly_once(
        airborne: bool,
        happenings in proptest::collection::vec(happening(), 1..40),
    ) {
        let mut rig = Rig::new(if airborne { Autopilot::flying() } else { Autopilot::default() });
        let mut accepted = Vec::new();
        for happening in happenings {
            happen(&mut rig, happening, &mut accepted);
        }
        accepted.push(bring_to_an_end(&mut rig));
        for id in accepted {
            let events: Vec<_> = rig.events.iter().filter(|it| it.skill_id == id).collect();
            let ended = events.iter().filter(|it| it.state() == SkillState::Ended).count();
            prop_assert_eq!(ended, 1, "skill {}: {:?}", id, events);
            prop_assert_eq!(events[0].state(), SkillState::ProcessRequest);
            prop_assert_eq!(events[events.len() - 1].state(), SkillState::Ended);
        }
        prop_assert!(!rig.autopilot.is_fed(rig.now), "nothing runs, and yet setpoints are streamed");
    }
}
