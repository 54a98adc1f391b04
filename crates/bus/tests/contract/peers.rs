//! Who is there.

use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Scope};

use crate::stories::contract::probe::{Phase, Probe, Seen};
use crate::stories::contract::shell::Shell;

/// More than any mailbox holds, sent in portions that the sender's own queue takes.
const FLOOD: usize = 6000;
const PORTION: usize = 50;

/// The story's phases.
const HELD: usize = 1;
const FLOODING: usize = 2;
const CHANGING: usize = 3;

fn flag(name: &str) -> Effect {
    Effect::publish(v1::FlagEvent { name: name.into(), raised: true, ..Default::default() })
}

/// A node whose mailbox is full learns of a process that has come and of one that has gone meanwhile.
pub fn not_lost(shell: &mut dyn Shell) {
    let scope = || Scope::Vehicle("uav1".into());
    let (phase, gate) = (Phase::default(), shell.gate(&scope()));
    let (told, kept) = (phase.clone(), gate.clone());
    let busy = Probe::listener("mcm", &[Topic::FlagEvent]).on_event(move |_, _| {
        if told.get() == HELD {
            told.set(FLOODING);
            kept.wait();
        }
    });
    let busy = shell.add(scope(), busy);
    let witness = shell.add(scope(), Probe::listener("gateway", &[Topic::FlagEvent, Topic::Heartbeat]));
    shell.add(scope(), Probe::listener("planner", &[]).until(&phase, CHANGING));
    let (told, mut sent) = (phase.clone(), 0);
    let sender = Probe::listener("monitor", &[]).on_turn(move |effects| match told.get() {
        FLOODING if sent < FLOOD => {
            effects.extend((0..PORTION).map(|_| flag("flood")));
            sent += PORTION;
        }
        FLOODING => effects.push(flag("last")),
        _ => effects.push(flag("meeting")),
    });
    shell.add(scope(), sender);
    let met = |seen: &Seen| !seen.flags().is_empty() && seen.peer("planner", true);
    shell.wait_for("everybody to meet", &mut || met(&busy) && met(&witness));
    phase.set(HELD);
    shell.wait_for("the flood to have come by", &mut || witness.flags().iter().any(|it| it == "last"));
    phase.set(CHANGING);
    shell.add(scope(), Probe::listener("skill-manager", &[]));
    let changed = |seen: &Seen| seen.peer("planner", false) && seen.peer("skill-manager", true);
    shell.wait_for("others to see the change", &mut || changed(&witness));
    gate.open();
    shell.wait_for("the busy node to see the change", &mut || changed(&busy));
    if shell.bounds_mailboxes() {
        shell.wait_for("the busy node to say that its mailbox was full", &mut || {
            witness.any(|event| match event {
                Event::Message { message: Message::Heartbeat(it), .. } => it.service == "mcm" && 0 < it.dropped,
                _ => false,
            })
        });
    }
}
