//! What is published, and what reaches a node.

use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Scope};

use crate::stories::contract::probe::{Phase, Probe, Seen};
use crate::stories::contract::shell::Shell;

/// Samples of one burst: far more than a node that comes late may see.
const BURST: u32 = 400;
/// Events that must keep their order.
const EVENTS: u32 = 300;

/// A story's phases.
const MEETING: usize = 0;
const HELD: usize = 1;
const BURSTING: usize = 2;

fn battery(number: u32) -> Effect {
    Effect::publish(v1::BatteryStatus { remaining: f64::from(number), ..Default::default() })
}

fn flag(name: impl ToString) -> Effect {
    Effect::publish(v1::FlagEvent { name: name.to_string(), raised: true, ..Default::default() })
}

fn command(id: u64) -> Effect {
    Effect::publish(v1::VehicleCommand { id, command: None })
}

/// The number of a sample of `vehicle`.
fn sample(event: &Event, vehicle: &str) -> Option<u32> {
    match event {
        Event::Message { vehicle: found, message: Message::BatteryStatus(it) } if &**found == vehicle => {
            Some(it.remaining as u32)
        }
        _ => None,
    }
}

/// Says zero until everybody has met, then everything in one turn, then the last again and again.
fn sampler(phase: &Phase) -> Probe {
    let phase = phase.clone();
    let mut sent = false;
    Probe::listener("monitor", &[]).on_turn(move |effects| match (phase.get(), sent) {
        (BURSTING, false) => {
            effects.extend((1..=BURST).map(battery));
            sent = true;
        }
        (BURSTING, true) => effects.push(battery(BURST)),
        _ => effects.push(battery(0)),
    })
}

/// A node that is busy while samples come gets the newest of each vehicle, and none of the others that have come by then. (How many have, only
/// its mailbox knows: another node may have heard all of them long before.)
pub fn newest_only(shell: &mut dyn Shell) {
    let (phase, gate) = (Phase::default(), shell.gate(&Scope::Fleet));
    let (told, kept) = (phase.clone(), gate.clone());
    let busy = Probe::listener("gateway", &[Topic::BatteryStatus]).on_event(move |_, _| {
        if told.get() == HELD {
            told.set(BURSTING);
            kept.wait();
        }
    });
    let busy = shell.add(Scope::Fleet, busy);
    let witness = shell.add(Scope::Fleet, Probe::listener("control-tower", &[Topic::BatteryStatus]));
    let vehicles = ["uav1", "uav2"];
    for vehicle in vehicles {
        shell.add(Scope::Vehicle(vehicle.into()), sampler(&phase));
    }
    let all_have =
        |seen: &Seen, number| vehicles.iter().all(|it| seen.pick(|event| sample(event, it)).last() == Some(&number));
    shell.wait_for("everybody to meet", &mut || all_have(&busy, 0) && all_have(&witness, 0));
    phase.set(HELD);
    shell.wait_for("the burst to have come by", &mut || all_have(&witness, BURST));
    gate.open();
    shell.wait_for("the newest of both", &mut || all_have(&busy, BURST));
    for vehicle in vehicles {
        let found = busy.pick(|event| sample(event, vehicle));
        assert!(found.is_sorted(), "{vehicle}: an older sample after a newer one: {found:?}");
        let most = busy.turns(|event| sample(event, vehicle)).iter().map(Vec::len).max();
        assert_eq!(most, Some(1), "{vehicle}: samples that it got at once");
    }
}

/// What the probes of a story have of each other.
fn have_met(seen: &Seen) -> bool {
    let commands = seen.any(|event| matches!(event, Event::Message { message: Message::VehicleCommand(_), .. }));
    commands && !seen.flags().is_empty()
}

/// Flags and commands of one turn arrive commands first, each kind in its order.
pub fn commands_first(shell: &mut dyn Shell) {
    let phase = Phase::default();
    let listener = Probe::listener("vehicle-sim", &[Topic::FlagEvent, Topic::VehicleCommand]);
    let seen = shell.add(Scope::Vehicle("uav1".into()), listener);
    let (told, mut sent) = (phase.clone(), false);
    let sender = Probe::listener("skill-manager", &[]).on_turn(move |effects| match told.get() {
        MEETING => effects.extend([flag("meeting"), command(0)]),
        _ if !std::mem::replace(&mut sent, true) => {
            effects.extend([flag("a"), flag("b"), command(1), flag("c"), command(2), flag("d")]);
        }
        _ => {}
    });
    shell.add(Scope::Vehicle("uav1".into()), sender);
    shell.wait_for("both to meet", &mut || have_met(&seen));
    phase.set(BURSTING);
    shell.wait_for("the last flag", &mut || seen.flags().iter().any(|it| it == "d"));
    let order = seen.pick(|event| match event {
        Event::Message { message: Message::FlagEvent(it), .. } => Some(it.name.clone()).filter(|it| it != "meeting"),
        Event::Message { message: Message::VehicleCommand(it), .. } => Some(it.id.to_string()).filter(|it| it != "0"),
        _ => None,
    });
    assert_eq!(order, ["1", "2", "a", "b", "c", "d"]);
}

/// Events of one sender arrive in the order in which they were sent, whether in one turn or in several, and each once, on board and on the
/// ground.
pub fn in_order(shell: &mut dyn Shell) {
    let phase = Phase::default();
    let scope = || Scope::Vehicle("uav1".into());
    let on_board = shell.add(scope(), Probe::listener("mcm", &[Topic::FlagEvent]));
    let on_ground = shell.add(Scope::Fleet, Probe::listener("gateway", &[Topic::FlagEvent]));
    let (told, mut next) = (phase.clone(), 1);
    let sender = Probe::listener("monitor", &[Topic::FlagEvent]).on_turn(move |effects| match told.get() {
        MEETING => effects.push(flag(0)),
        _ => {
            let some = 1 + next % 7;
            effects.extend((next..next + some).filter(|it| *it <= EVENTS).map(flag));
            next += some;
        }
    });
    let sender = shell.add(scope(), sender);
    let listeners = [&on_board, &on_ground];
    shell.wait_for("all to meet", &mut || listeners.iter().all(|it| !it.flags().is_empty()));
    phase.set(BURSTING);
    let last = EVENTS.to_string();
    shell.wait_for("the last event", &mut || listeners.iter().all(|it| it.flags().last() == Some(&last)));
    for seen in listeners {
        let found: Vec<_> = seen.flags().into_iter().filter(|it| it != "0").collect();
        assert_eq!(found, (1..=EVENTS).map(|it| it.to_string()).collect::<Vec<_>>());
    }
    assert!(sender.flags().is_empty(), "nobody hears itself");
}
