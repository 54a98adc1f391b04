//! From what passed by on the bus to samples. All times in seconds.
//!
//! The mission manager's own marks give the reference's figures. What a user feels is put together
//! from the stamps that every message carries, by its trace: the event that began it, the manager's
//! wake, the command that left the skill manager, and the acknowledgement that the vehicle published
//! while it took the command in, which is the moment at which the command had been received.

use std::collections::HashMap;

use bus::Tapped;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::NodeStatus::{self, Failure, Running, Success};
use kittiwake_proto::v1::{LeafChange, McmStatus, McmTiming, SkillKind, SkillState};
use serde::Serialize;

/// A class of transitions, by the reference's definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Class {
    /// One step's success to the next executor's start.
    N2N,
    /// A step's failure to the start of the transition action.
    N2T,
    /// Plan ready to the executor's start.
    T2N,
}

/// One transition inside the mission manager.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Transition {
    /// Its class.
    pub class: Class,
    /// Whether the action before is position control.
    pub from_position: bool,
    /// Whether the action after is position control.
    pub to_position: bool,
    /// How long it took.
    pub took_s: f64,
}

/// The way from an event to the vehicle, hop by hop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Way {
    /// The event, published, until the mission manager took it in.
    pub to_manager_s: f64,
    /// Until it had decided.
    pub deciding_s: f64,
    /// Until the skill manager, having been asked, published its command.
    pub to_command_s: f64,
    /// Until the vehicle had received it.
    pub to_vehicle_s: f64,
}

impl Way {
    /// The total.
    pub fn total_s(&self) -> f64 {
        self.to_manager_s + self.deciding_s + self.to_command_s + self.to_vehicle_s
    }
}

/// One answered flag.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reaction {
    /// The flag's name in the contingency table.
    pub flag: String,
    /// From the beginning of the tick that sees the flag to the action's start, inside the mission manager.
    pub tick_to_action_s: f64,
    /// From the injector to the vehicle; `None` if the vehicle needed no command.
    pub felt: Option<Way>,
}

/// All that a flight showed.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Samples {
    /// Inside the mission manager.
    pub transitions: Vec<Transition>,
    /// Skill result published to the next command received.
    pub felt_transitions: Vec<Way>,
    /// Transitions that no skill's end began (a permission did), or that needed no command.
    pub transitions_without_command: usize,
    /// Answered flags.
    pub reactions: Vec<Reaction>,
    /// Ticks by their duration: element n counts those of 2^n ns to below 2^(n+1) ns.
    pub tick_histogram: Vec<u64>,
}

impl Samples {
    /// Adds another flight's.
    pub fn add(&mut self, other: Samples) {
        self.transitions.extend(other.transitions);
        self.felt_transitions.extend(other.felt_transitions);
        self.transitions_without_command += other.transitions_without_command;
        self.reactions.extend(other.reactions);
        add_up(&mut self.tick_histogram, &other.tick_histogram);
    }

    /// Durations of a class.
    pub fn of_class(&self, class: Class) -> Vec<f64> {
        self.transitions.iter().filter(|it| it.class == class).map(|it| it.took_s).collect()
    }

    /// Durations between actions of these kinds.
    pub fn between(&self, from_position: bool, to_position: bool) -> Vec<f64> {
        let wanted = |it: &&Transition| (it.from_position, it.to_position) == (from_position, to_position);
        self.transitions.iter().filter(wanted).map(|it| it.took_s).collect()
    }
}

fn add_up(sums: &mut Vec<u64>, counts: &[u64]) {
    sums.resize(sums.len().max(counts.len()), 0);
    sums.iter_mut().zip(counts).for_each(|(sum, it)| *sum += it);
}

/// Puts a flight's messages together.
pub fn analyse(heard: &[Tapped]) -> Samples {
    let index = Index::of(heard);
    let mut samples = Samples::default();
    let mut steps = Steps::default();
    for wake in &index.wakes {
        let Wake { record, trace, .. } = *wake;
        samples.transitions.extend(record.changes.iter().filter_map(|change| steps.take(change, wake)));
        if has_moved_on(record) {
            match index.way(index.skill_end(record, trace), record, trace) {
                Some(way) => samples.felt_transitions.push(way),
                None => samples.transitions_without_command += 1,
            }
        }
        samples.reactions.extend(answers(record).filter_map(|(flag, tick_to_action_s)| {
            let raised = *index.flags.get(&(trace, flag))?;
            Some(Reaction { flag: flag.to_owned(), tick_to_action_s, felt: index.way(Some(raised), record, trace) })
        }));
        samples.tick_histogram.clone_from(&record.tick_histogram);
    }
    samples
}

/// Whether one step succeeded and the next one was started.
fn has_moved_on(record: &McmTiming) -> bool {
    let mut executor = record.changes.iter().filter(|it| it.kind == EXECUTOR);
    executor.any(|it| it.after() == Success) && executor.any(|it| it.after() == Running)
}

/// The flags that were answered within the wake, and the time from the beginning of the tick to the action's start.
fn answers(record: &McmTiming) -> impl Iterator<Item = (&str, f64)> {
    let raised = record.changes.iter().filter(|it| it.kind == "Responds" && it.after() == Success);
    raised.filter_map(|raised| {
        let row = raised.path.strip_suffix("/Responds")?;
        let flag = row.rsplit('/').next()?;
        let response = format!("{row}/respond to {flag}/");
        let action = record.changes.iter().find(|it| it.after() == Running && it.path.starts_with(&response))?;
        Some((flag, seconds(record.ticked_ns, action.at_ns)))
    })
}

/// The leaf that flies the plan's steps.
pub const EXECUTOR: &str = "NominalExecutor";

/// Follows steps and transitions through the changes of a flight.
#[derive(Default)]
struct Steps {
    /// The end of the step that flew last, until something else flies.
    ended: Option<(NodeStatus, u64)>,
    /// The beginning of the wake in which a plan came, until its first step flies.
    plan_ns: Option<u64>,
    /// The skill that was flown last, by the plan or in a transition.
    flown: SkillKind,
}

impl Steps {
    fn take(&mut self, change: &LeafChange, wake: &Wake<'_>) -> Option<Transition> {
        match (change.kind.as_str(), change.before(), change.after()) {
            (EXECUTOR, _, Running) => {
                let ended = self.ended.take();
                let (class, since_ns) = match (self.plan_ns.take(), ended) {
                    (Some(plan_ns), _) => (Class::T2N, plan_ns),
                    (None, Some((Success, ended_ns))) => (Class::N2N, ended_ns),
                    (None, _) => return self.fly(wake, None),
                };
                self.fly(wake, Some((class, seconds(since_ns, change.at_ns))))
            }
            (EXECUTOR, Running, ended @ (Success | Failure)) => {
                self.ended = Some((ended, change.at_ns));
                None
            }
            (EXECUTOR, Running, _) => {
                self.ended = None;
                None
            }
            ("Replan", _, Success) => {
                self.plan_ns = Some(wake.record.woken_ns);
                None
            }
            ("TransitionExecutor", _, Running) => {
                let failed = self.ended.take().filter(|(status, _)| *status == Failure && wake.in_transition);
                self.fly(wake, failed.map(|(_, failed_ns)| (Class::N2T, seconds(failed_ns, change.at_ns))))
            }
            _ => None,
        }
    }

    /// Another skill is flown from here on.
    fn fly(&mut self, wake: &Wake<'_>, transition: Option<(Class, f64)>) -> Option<Transition> {
        let from = std::mem::replace(&mut self.flown, wake.skill);
        let [from_position, to_position] = [from, wake.skill].map(|skill| skill == SkillKind::Offboard);
        transition.map(|(class, took_s)| Transition { class, from_position, to_position, took_s })
    }
}

/// A wake of the mission manager.
struct Wake<'a> {
    record: &'a McmTiming,
    trace: &'a str,
    /// What flies at its end, by the status that is published with each change of step.
    skill: SkillKind,
    in_transition: bool,
}

/// A flight's messages by what they are looked up with.
struct Index<'a> {
    wakes: Vec<Wake<'a>>,
    /// When ends of skills were published, by trace.
    skill_ends: HashMap<&'a str, Vec<u64>>,
    /// When the monitor first listed a flag, by trace and name.
    flags: HashMap<(&'a str, &'a str), u64>,
    /// Publication and id of commands, by trace.
    commands: HashMap<&'a str, Vec<(u64, u64)>>,
    /// When the vehicle acknowledged a command, by id.
    acks: HashMap<u64, u64>,
}

impl<'a> Index<'a> {
    fn of(heard: &'a [Tapped]) -> Index<'a> {
        let mut it = Index {
            wakes: Vec::new(),
            skill_ends: HashMap::new(),
            flags: HashMap::new(),
            commands: HashMap::new(),
            acks: HashMap::new(),
        };
        let mut in_order: Vec<&Tapped> = heard.iter().collect();
        in_order.sort_by_key(|tapped| tapped.published_ns);
        let mut status = &McmStatus::default();
        for Tapped { message, published_ns, trace, .. } in in_order {
            match message {
                Message::McmStatus(newer) => status = newer,
                Message::McmTiming(record) => {
                    let (skill, in_transition) = (status.skill(), status.in_transition);
                    it.wakes.push(Wake { record, trace, skill, in_transition });
                }
                Message::SkillEvent(event) if event.state() == SkillState::Ended && !trace.is_empty() => {
                    it.skill_ends.entry(trace).or_default().push(*published_ns);
                }
                Message::Introspection(list) if list.flags_changed => {
                    for flag in &list.flags {
                        it.flags.entry((trace, &flag.name)).or_insert(*published_ns);
                    }
                }
                Message::VehicleCommand(command) if !trace.is_empty() => {
                    it.commands.entry(trace).or_default().push((*published_ns, command.id));
                }
                Message::VehicleCommandAck(ack) => {
                    it.acks.insert(ack.id, *published_ns);
                }
                _ => {}
            }
        }
        it
    }

    /// The end of a skill that woke the manager.
    fn skill_end(&self, record: &McmTiming, trace: &str) -> Option<u64> {
        self.skill_ends.get(trace)?.iter().copied().filter(|it| *it <= record.woken_ns).max()
    }

    fn way(&self, began_ns: Option<u64>, record: &McmTiming, trace: &str) -> Option<Way> {
        let began_ns = began_ns?;
        // A trace goes on through several decisions: the command of this one is the first after it.
        let after = self.commands.get(trace)?.iter().filter(|it| record.decided_ns <= it.0);
        let (commanded_ns, id) = *after.min()?;
        let received_ns = *self.acks.get(&id)?;
        Some(Way {
            to_manager_s: seconds(began_ns, record.woken_ns),
            deciding_s: seconds(record.woken_ns, record.decided_ns),
            to_command_s: seconds(record.decided_ns, commanded_ns),
            to_vehicle_s: seconds(commanded_ns, received_ns),
        })
    }
}

fn seconds(from_ns: u64, to_ns: u64) -> f64 {
    (to_ns as f64 - from_ns as f64) / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1::NodeStatus::Idle;
    use kittiwake_proto::v1::{Introspection, RaisedFlag, SkillEvent, VehicleCommand, VehicleCommandAck};

    fn tapped(message: impl Into<Message>, published_ns: u64, trace: &str) -> Tapped {
        let (vehicle, trace) = ("uav1".into(), trace.to_owned());
        Tapped { vehicle, message: message.into(), sequence: 0, published_ns, received_ns: 0, trace, size: 0 }
    }

    fn leaf(path: &str, before: NodeStatus, after: NodeStatus, at_ns: u64) -> LeafChange {
        let kind = path.rsplit('/').next().unwrap_or_default().to_owned();
        LeafChange { kind, path: path.to_owned(), before: before as i32, after: after as i32, at_ns }
    }

    /// A wake with these changes, after which `skill` flies. It takes 100 ns, and its tick begins after 5.
    fn wake(woken_ns: u64, skill: SkillKind, changes: &[LeafChange]) -> [Tapped; 2] {
        let decided_ns = woken_ns + 100;
        let record = McmTiming {
            woken_ns,
            ticked_ns: woken_ns + 5,
            decided_ns,
            changes: changes.to_vec(),
            ..Default::default()
        };
        let in_transition = changes.iter().any(|it| it.kind == "TransitionExecutor");
        let status = McmStatus { skill: skill as i32, in_transition, ..Default::default() };
        [tapped(status, decided_ns + 1, "t"), tapped(record, decided_ns + 2, "t")]
    }

    fn skill_ended(published_ns: u64, trace: &str) -> Tapped {
        tapped(SkillEvent { state: SkillState::Ended as i32, ..Default::default() }, published_ns, trace)
    }

    fn nanoseconds(seconds: f64) -> f64 {
        (seconds * 1e9).round()
    }

    #[test]
    fn steps_and_transitions_fall_into_the_reference_s_classes() {
        use SkillKind::{Offboard, Stop, Takeoff};
        let executor = |before, after, at_ns| leaf("plan/NominalExecutor", before, after, at_ns);
        let replan = |at_ns| leaf("re-plan/Replan", Running, Success, at_ns);
        let transition = |at_ns| leaf("re-plan/TransitionExecutor", Idle, Running, at_ns);
        let heard = [
            // On the ground nothing flies while the first plan is made.
            wake(0, SkillKind::Unspecified, &[executor(Idle, Failure, 10), leaf("re-plan/Replan", Idle, Running, 12)]),
            wake(500, Takeoff, &[replan(510), executor(Idle, Running, 530)]),
            wake(1000, Offboard, &[executor(Running, Success, 1010), executor(Idle, Running, 1050)]),
            wake(2000, Stop, &[executor(Running, Failure, 2010), transition(2015)]),
            wake(3000, Offboard, &[replan(3005), executor(Idle, Running, 3065)]),
            // A contingency in between: neither the halt nor the way back is a transition.
            wake(4000, Stop, &[executor(Running, Idle, 4010)]),
            wake(5000, Stop, &[executor(Idle, Failure, 5010), transition(5020)]),
        ]
        .concat();
        let found: Vec<_> = analyse(&heard)
            .transitions
            .iter()
            .map(|it| (it.class, it.from_position, it.to_position, nanoseconds(it.took_s)))
            .collect();
        let expected = [
            (Class::T2N, false, false, 30.0),
            (Class::N2N, false, true, 40.0),
            (Class::N2T, true, false, 5.0),
            (Class::T2N, false, true, 65.0),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_flag_is_answered_by_the_first_leaf_below_its_response() {
        let changes = [
            leaf("table/flag_01/Responds", Idle, Failure, 1010),
            leaf("table/flag_02/Responds", Idle, Success, 1011),
            leaf("table/flag_02/BeginResponse", Idle, Success, 1012),
            leaf("table/flag_02/respond to flag_02/stop/Stop", Idle, Running, 1025),
        ];
        let flag = RaisedFlag { name: "flag_02".into(), ..Default::default() };
        let raised = Introspection { flags: vec![flag], flags_changed: true, ..Default::default() };
        let wake = wake(1000, SkillKind::Stop, &changes);
        let heard = [[tapped(raised, 900, "t")].as_slice(), &wake].concat();
        let expected = Reaction { flag: "flag_02".into(), tick_to_action_s: 20e-9, felt: None };
        assert_eq!(analyse(&heard).reactions, [expected]);
        assert_eq!(analyse(&wake).reactions, [], "the manager raised the flag itself");
    }

    #[test]
    fn the_way_leads_from_the_event_to_the_first_command_after_the_decision() {
        let moved_on =
            [leaf("plan/NominalExecutor", Running, Success, 1000), leaf("plan/NominalExecutor", Idle, Running, 1001)];
        let heard = [
            [tapped(VehicleCommand { id: 1, command: None }, 500, "t"), skill_ended(900, "t")],
            [
                tapped(VehicleCommand { id: 2, command: None }, 1300, "t"),
                tapped(VehicleCommandAck { id: 2, ..Default::default() }, 1700, ""),
            ],
            wake(1000, SkillKind::Offboard, &moved_on),
        ]
        .concat();
        let samples = analyse(&heard);
        let [way] = samples.felt_transitions[..] else { panic!("{samples:?}") };
        let ns = [way.to_manager_s, way.deciding_s, way.to_command_s, way.to_vehicle_s].map(nanoseconds);
        assert_eq!(ns, [100.0, 100.0, 200.0, 400.0]);
    }
}
