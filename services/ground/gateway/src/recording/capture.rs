//! Which messages of which vehicle belong to which recording.
//!
//! A recording is one mission. It begins with the first status of a mission manager that has no report yet, preceded
//! by the messages of the moments before, and ends shortly after the report, or when the vehicle has not been heard
//! for a while. A mission that is replaced in flight stays in the same recording. Pure: messages and time in, jobs for
//! the writer out.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Topic};
use node::VehicleId;

use crate::fleet::MAX_VEHICLES;
use crate::recording::config::Config;

/// Messages kept from before a mission: several seconds of them, and so at least one of every topic
/// that is repeated.
const PREAMBLE: usize = 64;
/// Wall time after the report in which the last messages arrive.
const TAIL: Duration = Duration::from_secs(1);
/// Wall time without a message after which a vehicle is gone.
const GONE: Duration = Duration::from_secs(60);

/// The data that distinguish a recording from others.
#[derive(Debug, PartialEq)]
pub(crate) struct RecordingHeader {
    /// Counts up from the gateway's start.
    pub(crate) number: u64,
    /// The vehicle that flies the mission.
    pub(crate) vehicle: VehicleId,
    /// When it began.
    pub(crate) began: Now,
    /// How many times faster than the wall clock mission time runs.
    pub(crate) speed: f64,
}

/// A message of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordedMessage {
    pub(crate) topic: Topic,
    /// When it arrived.
    pub(crate) utc_ms: i64,
    /// As on the wire.
    pub(crate) bytes: Vec<u8>,
}

/// What the writer has to do.
#[derive(Debug, PartialEq)]
pub(crate) enum WriteJob {
    /// Add a message to a recording.
    Message(Arc<RecordingHeader>, RecordedMessage),
    /// Complete a recording.
    End(Arc<RecordingHeader>),
}

/// The vehicles that were heard.
#[derive(Debug)]
pub(crate) struct Captures {
    pace: Pace,
    /// Mission time from one message of a topic to the next that is recorded.
    periods: BTreeMap<Topic, Duration>,
    by_vehicle: BTreeMap<VehicleId, Capture>,
    last: u64,
}

#[derive(Debug, Default)]
struct Capture {
    /// When the next message of a topic is recorded.
    due: BTreeMap<Topic, Time>,
    heard: Time,
    phase: Phase,
}

#[derive(Debug)]
enum Phase {
    /// No mission is under way; the newest messages.
    Before(VecDeque<RecordedMessage>),
    /// A mission is recorded; `until` is where the recording ends, once the mission has.
    During { header: Arc<RecordingHeader>, until: Option<Time> },
}

impl Default for Phase {
    fn default() -> Phase {
        Phase::Before(VecDeque::new())
    }
}

impl WriteJob {
    /// Its size while it waits.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            WriteJob::Message(_, message) => message.bytes.len(),
            WriteJob::End(_) => 0,
        }
    }
}

impl Captures {
    /// No vehicle was heard yet.
    pub(crate) fn new(config: &Config, pace: Pace) -> Captures {
        let periods = config.most_hz.iter().map(|(topic, rate)| (topic.0, pace.wall(rate.period()))).collect();
        Captures { pace, periods, by_vehicle: BTreeMap::new(), last: 0 }
    }

    /// A message of a vehicle arrived.
    pub(crate) fn on_message(&mut self, now: Now, vehicle: &VehicleId, message: &Message, jobs: &mut Vec<WriteJob>) {
        let known = self.by_vehicle.contains_key(vehicle);
        if vehicle.is_empty() || !known && MAX_VEHICLES <= self.by_vehicle.len() {
            return;
        }
        let capture = self.by_vehicle.entry(vehicle.clone()).or_default();
        capture.heard = now.time;
        if let Message::McmStatus(status) = message {
            let (is_over, tail) = (status.report.is_some(), self.pace.wall(TAIL));
            capture.on_status(now.time, is_over, tail, jobs, || {
                self.last += 1;
                let (number, vehicle, speed) = (self.last, vehicle.clone(), self.pace.speed());
                RecordingHeader { number, vehicle, began: now, speed }
            });
        }
        let topic = message.topic();
        if !capture.is_due(now.time, topic, self.periods.get(&topic)) {
            return;
        }
        let message = RecordedMessage { topic, utc_ms: now.utc_ms, bytes: message.encode() };
        match &mut capture.phase {
            Phase::During { header, .. } => jobs.push(WriteJob::Message(header.clone(), message)),
            Phase::Before(preamble) => {
                if preamble.len() == PREAMBLE {
                    preamble.pop_front();
                }
                preamble.push_back(message);
            }
        }
    }

    /// Time passes.
    pub(crate) fn tick(&mut self, now: Time, jobs: &mut Vec<WriteJob>) {
        let gone = self.pace.wall(GONE);
        for capture in self.by_vehicle.values_mut() {
            if let Phase::During { header, until } = &capture.phase
                && (until.is_some_and(|until| until <= now) || capture.heard + gone <= now)
            {
                jobs.push(WriteJob::End(header.clone()));
                capture.phase = Phase::default();
            }
        }
    }
}

impl Capture {
    fn is_due(&mut self, now: Time, topic: Topic, period: Option<&Duration>) -> bool {
        let Some(period) = period else { return true };
        let due = self.due.entry(topic).or_default();
        if now < *due {
            return false;
        }
        // From the time it was due, so that the rate holds on average; from now after a break.
        *due = (*due + *period).max(now + period.mul_f64(0.5));
        true
    }

    /// The mission manager says whether the mission is over.
    fn on_status(
        &mut self,
        now: Time,
        is_over: bool,
        tail: Duration,
        jobs: &mut Vec<WriteJob>,
        begin: impl FnOnce() -> RecordingHeader,
    ) {
        match (&mut self.phase, is_over) {
            (Phase::Before(preamble), false) => {
                let header = Arc::new(begin());
                jobs.extend(preamble.drain(..).map(|message| WriteJob::Message(header.clone(), message)));
                self.phase = Phase::During { header, until: None };
            }
            (Phase::During { until, .. }, true) => {
                until.get_or_insert(now + tail);
            }
            // The next mission has begun before the tail of the last one was over.
            (Phase::During { header, until: Some(_) }, false) => {
                jobs.push(WriteJob::End(header.clone()));
                self.phase = Phase::During { header: Arc::new(begin()), until: None };
            }
            (Phase::Before(_), true) | (Phase::During { until: None, .. }, false) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    const CONFIG: &str = "
        most_files = 9
        most_total_mb = 9
        most_each_mb = 9
        flush_s = 1.0
        most_hz = { \"monitor/introspection\" = 10.0 }
    ";

    fn at(ms: u64) -> Now {
        Now { time: Time::after(Duration::from_millis(ms)), utc_ms: ms as i64 }
    }

    fn status(over: bool) -> Message {
        v1::McmStatus { report: over.then(v1::MissionReport::default), ..Default::default() }.into()
    }

    /// Plays messages, each with the milliseconds at which it arrives; the jobs in words.
    fn play(speed: f64, messages: Vec<(u64, Message)>, until_ms: u64) -> Vec<String> {
        let pace = Pace::new(speed).unwrap();
        let mut captures = Captures::new(&toml::from_str(CONFIG).unwrap(), pace);
        let mut jobs = Vec::new();
        for (ms, message) in messages {
            captures.tick(at(ms).time, &mut jobs);
            captures.on_message(at(ms), &"uav1".into(), &message, &mut jobs);
        }
        captures.tick(at(until_ms).time, &mut jobs);
        let words = |job: &WriteJob| match job {
            WriteJob::Message(header, message) => {
                format!("{} {} {}", header.number, message.topic.key(), message.utc_ms)
            }
            WriteJob::End(header) => format!("{} ends", header.number),
        };
        jobs.iter().map(words).collect()
    }

    #[test]
    fn a_recording_is_a_mission_from_just_before_its_start_to_just_after_its_report() {
        let decision = || v1::DecisionRecord::default().into();
        let jobs = play(
            1.0,
            vec![
                (10, v1::MissionStatus::default().into()),
                (20, status(false)),
                (500, decision()),
                (1000, status(true)),
                (1500, decision()),
                (2500, status(true)),
                (9000, status(false)),
                (9100, status(true)),
                (9200, status(false)),
            ],
            9300,
        );
        let expected = [
            "1 mission/status 10",
            "1 mcm/status 20",
            "1 mcm/decision 500",
            "1 mcm/status 1000",
            "1 mcm/decision 1500",
            "1 ends",
            // Arrived in between.
            "2 mcm/status 2500",
            "2 mcm/status 9000",
            "2 mcm/status 9100",
            "2 ends",
            "3 mcm/status 9200",
        ];
        assert_eq!(jobs, expected);
    }

    #[test]
    fn the_recording_of_a_vehicle_that_is_gone_ends() {
        assert_eq!(play(1.0, vec![(0, status(false))], 59_999), ["1 mcm/status 0"]);
        assert_eq!(play(1.0, vec![(0, status(false))], 60_000), ["1 mcm/status 0", "1 ends"]);
    }

    #[test]
    fn a_high_rate_is_thinned_by_the_wall_clock_and_every_event_is_recorded() {
        #[track_caller]
        fn check(speed: f64, message: fn() -> Message, expected: usize) {
            let step = (10.0 * speed) as u64;
            let mut messages = vec![(0, status(false))];
            messages.extend((0..1000).map(|n| (n * step, message())));
            // Ten seconds of wall time at 100 Hz.
            assert_eq!(play(speed, messages, 0).len() - 1, expected);
        }
        check(1.0, || v1::Introspection::default().into(), 100);
        check(20.0, || v1::Introspection::default().into(), 100);
        check(1.0, || v1::SkillEvent::default().into(), 1000);
    }

    #[test]
    fn names_from_the_network_and_long_waits_do_not_fill_the_memory() {
        let mut captures = Captures::new(&toml::from_str(CONFIG).unwrap(), Pace::REAL_TIME);
        let mut jobs = Vec::new();
        for n in 0..2 * MAX_VEHICLES {
            captures.on_message(at(0), &n.to_string().into(), &status(true), &mut jobs);
        }
        assert_eq!((captures.by_vehicle.len(), jobs.len()), (MAX_VEHICLES, 0));
        for _ in 0..2 * PREAMBLE {
            captures.on_message(at(0), &"0".into(), &status(true), &mut jobs);
        }
        captures.on_message(at(0), &"0".into(), &status(false), &mut jobs);
        assert_eq!(jobs.len(), PREAMBLE + 1);
    }
}
