//! Raises flags in flight, as the reference's test node does: each is up for one publication only.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::{FlagEvent, SkillEvent, SkillKind, SkillState};
use node::{Effect, Event, Node};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

/// Raises the given flags one after the other, each a moment after the vehicle has begun to fly
/// somewhere, so that there is something to stop; the moment is drawn, so that it falls anywhere in
/// the tick period.
pub(crate) struct Injector {
    flags: Vec<String>,
    next: usize,
    raised: Option<String>,
    due: Option<Time>,
    chance: StdRng,
}

impl Injector {
    /// `flags` in the order in which they are raised.
    pub(crate) fn new(flags: Vec<String>, seed: u64) -> Injector {
        Injector { flags, next: 0, raised: None, due: None, chance: StdRng::seed_from_u64(seed) }
    }

    fn hears(&mut self, now: Time, event: &SkillEvent, effects: &mut Vec<Effect>) {
        match (event.kind(), event.state()) {
            (SkillKind::Offboard, SkillState::Execute) => {
                let wait = Duration::from_micros(self.chance.random_range(40_000..120_000));
                self.due = Some(now + wait);
            }
            (SkillKind::Offboard, _) => self.due = None,
            (_, SkillState::Execute) => {
                self.due = None;
                if let Some(flag) = self.raised.take() {
                    effects.push(event_of(flag, false));
                }
            }
            _ => {}
        }
    }
}

impl Node for Injector {
    fn name(&self) -> &'static str {
        "injector"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::SkillEvent]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        if let Event::Message { message: Message::SkillEvent(it), .. } = event {
            self.hears(now.time, &it, effects);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.due.is_some_and(|it| it <= now.time) {
            self.due = None;
            if let Some(flag) = self.flags.get(self.next) {
                self.next += 1;
                self.raised = Some(flag.clone());
                effects.push(event_of(flag.clone(), true));
            }
        }
    }

    fn deadline(&self) -> Option<Time> {
        self.due
    }
}

fn event_of(name: String, raised: bool) -> Effect {
    Effect::publish(FlagEvent { name, raised, reason: "measurement".to_owned(), ..Default::default() })
}
