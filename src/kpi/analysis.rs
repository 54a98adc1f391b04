//! From what passed by on the bus to samples. All times in seconds.
//!
//! The mission manager's own marks give the reference's figures. What a user feels is put together
//! from the stamps that every message carries, by its trace: the event that began it, the manager's
//! wake, the command that left the skill manager, and the acknowledgement that the vehicle published
//! while it took the command in, which is the moment at which the command had been received.

use std::collections::HashMap;

use bus::Tapped;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{McmTiming, SkillKind, SkillState, TimingMark, TimingPoint};
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
    pub class: Class,
    /// Whether the action before, and the one after, is position control.
    pub from_position: bool,
    pub to_position: bool,
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
    /// All of it.
    pub fn total_s(&self) -> f64 {
        self.to_manager_s + self.deciding_s + self.to_command_s + self.to_vehicle_s
    }
}

/// One answered flag.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reaction {
    pub flag: String,
    /// From the monitor leaf to the action, inside the mission manager.
    pub seen_to_action_s: f64,
    /// From the injector to the vehicle; `None` if the vehicle needed no command.
    pub felt: Option<Way>,
}

/// All that a flight showed.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Samples {
    pub transitions: Vec<Transition>,
    /// Skill result published to the next command received.
    pub felt_transitions: Vec<Way>,
    /// Transitions that no skill's end began (a permission did), or that needed no command.
    pub transitions_without_command: usize,
    pub reactions: Vec<Reaction>,
    /// Ticks by their duration: element n counts those of 2^n ns to below 2^(n+1) ns.
    pub tick_histogram: Vec<u64>,
    /// Ticks by how often they allocated memory: never, then 2^(n-1) times to below 2^n.
    pub allocation_histogram: Vec<u64>,
}

impl Samples {
    /// Adds another flight's.
    pub fn add(&mut self, other: Samples) {
        self.transitions.extend(other.transitions);
        self.felt_transitions.extend(other.felt_transitions);
        self.transitions_without_command += other.transitions_without_command;
        self.reactions.extend(other.reactions);
        add_up(&mut self.tick_histogram, &other.tick_histogram);
        add_up(&mut self.allocation_histogram, &other.allocation_histogram);
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
    for (record, trace) in &index.records {
        samples.transitions.extend(record.marks.iter().filter_map(|it| steps.take(it)));
        let moved_on = record.marks.iter().any(|it| it.point() == TimingPoint::StepSucceeded)
            && record.marks.iter().any(|it| it.point() == TimingPoint::StepStarted);
        if moved_on {
            match index.way(index.skill_end(record, trace), record, trace) {
                Some(way) => samples.felt_transitions.push(way),
                None => samples.transitions_without_command += 1,
            }
        }
        samples.reactions.extend(reactions(record).map(|(flag, seen_to_action_s)| {
            let raised = index.flags.get(&(trace, flag.as_str())).copied();
            Reaction { seen_to_action_s, felt: index.way(raised, record, trace), flag }
        }));
        samples.tick_histogram.clone_from(&record.tick_histogram);
        samples.allocation_histogram.clone_from(&record.allocation_histogram);
    }
    samples
}

/// Flags seen and acted on within the wake.
fn reactions(record: &McmTiming) -> impl Iterator<Item = (String, f64)> + '_ {
    let acted = record.marks.iter().filter(|it| it.point() == TimingPoint::ActionTriggered);
    acted.filter_map(|action| {
        let seen = record.marks.iter().find(|it| it.point() == TimingPoint::FlagSeen && it.flag == action.flag)?;
        Some((action.flag.clone(), seconds(seen.at_ns, action.at_ns)))
    })
}

/// Follows steps and transitions through the marks of a flight.
#[derive(Default)]
struct Steps {
    ended: Option<TimingMark>,
    plan: Option<TimingMark>,
    /// The skill of the transition action that flies.
    transition: SkillKind,
}

impl Steps {
    fn take(&mut self, mark: &TimingMark) -> Option<Transition> {
        let is_position = |it: SkillKind| it == SkillKind::Offboard;
        let sample = |class, from: SkillKind, since: &TimingMark| {
            let (from_position, to_position) = (is_position(from), is_position(mark.skill()));
            Some(Transition { class, from_position, to_position, took_s: seconds(since.at_ns, mark.at_ns) })
        };
        match mark.point() {
            TimingPoint::StepSucceeded | TimingPoint::StepFailed | TimingPoint::StepHalted => {
                self.transition = SkillKind::Unspecified;
                self.ended = Some(mark.clone());
                None
            }
            TimingPoint::TransitionStarted => {
                self.transition = mark.skill();
                let failed = self.ended.take().filter(|it| it.point() == TimingPoint::StepFailed)?;
                sample(Class::N2T, failed.skill(), &failed)
            }
            TimingPoint::PlanReady => {
                self.plan = Some(mark.clone());
                None
            }
            TimingPoint::StepStarted => {
                let ended = self.ended.take();
                match self.plan.take() {
                    Some(plan) => sample(Class::T2N, self.transition, &plan),
                    None => {
                        let ended = ended.filter(|it| it.point() == TimingPoint::StepSucceeded)?;
                        sample(Class::N2N, ended.skill(), &ended)
                    }
                }
            }
            TimingPoint::Unspecified | TimingPoint::FlagSeen | TimingPoint::ActionTriggered => None,
        }
    }
}

/// A flight's messages by what they are looked up with.
struct Index<'a> {
    records: Vec<(&'a McmTiming, &'a str)>,
    /// When ends of skills were published, by trace.
    skill_ends: HashMap<&'a str, Vec<u64>>,
    /// When a flag was raised, by trace and name.
    flags: HashMap<(&'a str, &'a str), u64>,
    /// Publication and id of commands, by trace.
    commands: HashMap<&'a str, Vec<(u64, u64)>>,
    /// When the vehicle acknowledged a command, by id.
    acks: HashMap<u64, u64>,
}

impl<'a> Index<'a> {
    fn of(heard: &'a [Tapped]) -> Index<'a> {
        let mut it = Index {
            records: Vec::new(),
            skill_ends: HashMap::new(),
            flags: HashMap::new(),
            commands: HashMap::new(),
            acks: HashMap::new(),
        };
        for Tapped { message, published_ns, trace, .. } in heard {
            match message {
                Message::McmTiming(record) => it.records.push((record, trace)),
                Message::SkillEvent(event) if event.state() == SkillState::Ended && !trace.is_empty() => {
                    it.skill_ends.entry(trace).or_default().push(*published_ns);
                }
                Message::FlagEvent(event) if event.raised => {
                    it.flags.insert((trace, &event.name), *published_ns);
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
        it.records.sort_by_key(|(record, _)| record.woken_ns);
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
    use kittiwake_proto::v1::{SkillEvent, VehicleCommand, VehicleCommandAck};

    fn tapped(message: impl Into<Message>, published_ns: u64, trace: &str) -> Tapped {
        let (vehicle, trace) = ("uav1".into(), trace.to_owned());
        Tapped { vehicle, message: message.into(), sequence: 0, published_ns, received_ns: 0, trace, size: 0 }
    }

    fn mark(point: TimingPoint, at_ns: u64, skill: SkillKind) -> TimingMark {
        TimingMark { point: point as i32, at_ns, skill: skill as i32, flag: String::new() }
    }

    fn wake(woken_ns: u64, marks: &[TimingMark]) -> McmTiming {
        McmTiming { woken_ns, decided_ns: woken_ns + 100, marks: marks.to_vec(), ..Default::default() }
    }

    fn ended(published_ns: u64, trace: &str) -> Tapped {
        tapped(SkillEvent { state: SkillState::Ended as i32, ..Default::default() }, published_ns, trace)
    }

    #[test]
    fn steps_and_transitions_fall_into_the_reference_s_classes() {
        use SkillKind::{Offboard, Stop, Takeoff, Unspecified};
        use TimingPoint::*;
        let heard = [
            tapped(wake(0, &[mark(PlanReady, 10, Unspecified), mark(StepStarted, 30, Takeoff)]), 0, "a"),
            tapped(wake(1000, &[mark(StepSucceeded, 1010, Takeoff), mark(StepStarted, 1050, Offboard)]), 0, "b"),
            tapped(wake(2000, &[mark(StepFailed, 2010, Offboard), mark(TransitionStarted, 2015, Stop)]), 0, "c"),
            tapped(wake(3000, &[mark(PlanReady, 3005, Unspecified), mark(StepStarted, 3065, Offboard)]), 0, "d"),
        ];
        let found: Vec<_> = analyse(&heard)
            .transitions
            .iter()
            .map(|it| (it.class, it.from_position, it.to_position, (it.took_s * 1e9).round()))
            .collect();
        let expected = [
            (Class::T2N, false, false, 20.0),
            (Class::N2N, false, true, 40.0),
            (Class::N2T, true, false, 5.0),
            (Class::T2N, false, true, 60.0),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn the_way_leads_from_the_event_to_the_first_command_after_the_decision() {
        let marks = [
            mark(TimingPoint::StepSucceeded, 1000, SkillKind::Takeoff),
            mark(TimingPoint::StepStarted, 1000, SkillKind::Offboard),
        ];
        let heard = [
            tapped(VehicleCommand { id: 1, command: None }, 500, "t"),
            ended(900, "t"),
            tapped(VehicleCommand { id: 2, command: None }, 1300, "t"),
            tapped(wake(1000, &marks), 1200, "t"),
            tapped(VehicleCommandAck { id: 2, ..Default::default() }, 1700, ""),
        ];
        let samples = analyse(&heard);
        let [way] = samples.felt_transitions[..] else { panic!("{samples:?}") };
        let ns = [way.to_manager_s, way.deciding_s, way.to_command_s, way.to_vehicle_s].map(|it| (it * 1e9).round());
        assert_eq!(ns, [100.0, 100.0, 200.0, 400.0]);
    }
}
