//! Which messages of which vehicle belong to which recording.
//!
//! A recording is one mission: it begins with the first word of a mission manager that has no report
//! yet, preceded by what was heard in the moments before, and ends shortly after the report, or when
//! the vehicle has not been heard of for a while. A mission that is replaced in flight goes on in the
//! same recording. Pure: messages and time in, notes out.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Topic};
use node::VehicleId;

use crate::recording::config::Config;

/// Messages kept from before a mission: some seconds' worth, and so at least one of everything that is
/// repeated.
const PREAMBLE: usize = 64;
/// More vehicles than one gateway is meant for; the names come from the network.
const MOST_VEHICLES: usize = 64;
/// Wall time after the report in which the last messages come in.
const TAIL: Duration = Duration::from_secs(1);
/// Wall time without a word after which a vehicle is gone.
const GONE: Duration = Duration::from_secs(60);

/// A recording.
#[derive(Debug, PartialEq)]
pub struct Take {
    /// Counts up with each start of the gateway.
    pub number: u64,
    /// Whose mission.
    pub vehicle: VehicleId,
    /// When it began.
    pub began: Now,
    /// How many times faster than the wall clock mission time ran.
    pub speed: f64,
}

/// A message of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What it is.
    pub topic: Topic,
    /// When it was heard.
    pub utc_ms: i64,
    /// The message on the wire.
    pub bytes: Vec<u8>,
}

/// What is to be written.
#[derive(Debug, PartialEq)]
pub enum Note {
    /// This, into that recording.
    Entry(Arc<Take>, Entry),
    /// The recording is complete.
    End(Arc<Take>),
}

/// The vehicles heard of.
#[derive(Debug)]
pub struct Tracks {
    pace: Pace,
    /// Mission time from one message of a topic to the next that is kept.
    periods: BTreeMap<Topic, Duration>,
    by_vehicle: BTreeMap<VehicleId, Track>,
    last: u64,
}

#[derive(Debug, Default)]
struct Track {
    /// When the next message of a topic is kept.
    due: BTreeMap<Topic, Time>,
    heard: Time,
    state: State,
}

#[derive(Debug)]
enum State {
    /// No mission is under way.
    Before(VecDeque<Entry>),
    /// `until`: where it ends, once the mission has.
    During { take: Arc<Take>, until: Option<Time> },
}

impl Default for State {
    fn default() -> State {
        State::Before(VecDeque::new())
    }
}

impl Note {
    /// What it takes while it waits.
    pub fn bytes(&self) -> usize {
        match self {
            Note::Entry(_, entry) => entry.bytes.len(),
            Note::End(_) => 0,
        }
    }
}

impl Tracks {
    /// Nothing was heard yet.
    pub fn new(config: &Config, pace: Pace) -> Tracks {
        let periods = config.most_hz.iter().map(|(topic, rate)| (topic.0, pace.wall(rate.period()))).collect();
        Tracks { pace, periods, by_vehicle: BTreeMap::new(), last: 0 }
    }

    /// A vehicle said something.
    pub fn heard(&mut self, now: Now, vehicle: &VehicleId, message: &Message, notes: &mut Vec<Note>) {
        let known = self.by_vehicle.contains_key(vehicle);
        if vehicle.is_empty() || !known && MOST_VEHICLES <= self.by_vehicle.len() {
            return;
        }
        let track = self.by_vehicle.entry(vehicle.clone()).or_default();
        track.heard = now.time;
        if let Message::McmStatus(status) = message {
            let (over, tail) = (status.report.is_some(), self.pace.wall(TAIL));
            track.turn(now.time, over, tail, notes, || {
                self.last += 1;
                Take { number: self.last, vehicle: vehicle.clone(), began: now, speed: self.pace.speed() }
            });
        }
        let topic = message.topic();
        if !track.is_due(now.time, topic, self.periods.get(&topic)) {
            return;
        }
        let entry = Entry { topic, utc_ms: now.utc_ms, bytes: message.encode() };
        match &mut track.state {
            State::During { take, .. } => notes.push(Note::Entry(take.clone(), entry)),
            State::Before(preamble) => {
                if preamble.len() == PREAMBLE {
                    preamble.pop_front();
                }
                preamble.push_back(entry);
            }
        }
    }

    /// Time passes.
    pub fn tick(&mut self, now: Time, notes: &mut Vec<Note>) {
        let gone = self.pace.wall(GONE);
        for track in self.by_vehicle.values_mut() {
            if let State::During { take, until } = &track.state
                && (until.is_some_and(|it| it <= now) || track.heard + gone <= now)
            {
                notes.push(Note::End(take.clone()));
                track.state = State::default();
            }
        }
    }
}

impl Track {
    fn is_due(&mut self, now: Time, topic: Topic, period: Option<&Duration>) -> bool {
        let Some(period) = period else { return true };
        let due = self.due.entry(topic).or_default();
        if now < *due {
            return false;
        }
        // From the time it was due, so that the rate is kept on average; from now after a break.
        *due = (*due + *period).max(now + period.mul_f64(0.5));
        true
    }

    /// The mission manager says whether the mission is over.
    fn turn(&mut self, now: Time, over: bool, tail: Duration, notes: &mut Vec<Note>, make: impl FnOnce() -> Take) {
        match (&mut self.state, over) {
            (State::Before(preamble), false) => {
                let take = Arc::new(make());
                notes.extend(preamble.drain(..).map(|it| Note::Entry(take.clone(), it)));
                self.state = State::During { take, until: None };
            }
            (State::During { until, .. }, true) => {
                until.get_or_insert(now + tail);
            }
            // The next mission has begun before the last one's tail was over.
            (State::During { take, until: Some(_) }, false) => {
                notes.push(Note::End(take.clone()));
                self.state = State::During { take: Arc::new(make()), until: None };
            }
            (State::Before(_), true) | (State::During { until: None, .. }, false) => {}
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

    /// Plays messages, each with the milliseconds at which it comes; the notes in words.
    fn play(speed: f64, messages: Vec<(u64, Message)>, until_ms: u64) -> Vec<String> {
        let pace = Pace::new(speed).unwrap();
        let mut tracks = Tracks::new(&toml::from_str(CONFIG).unwrap(), pace);
        let mut notes = Vec::new();
        for (ms, message) in messages {
            tracks.tick(at(ms).time, &mut notes);
            tracks.heard(at(ms), &"uav1".into(), &message, &mut notes);
        }
        tracks.tick(at(until_ms).time, &mut notes);
        let words = |it: &Note| match it {
            Note::Entry(take, entry) => format!("{} {} {}", take.number, entry.topic.key(), entry.utc_ms),
            Note::End(take) => format!("{} ends", take.number),
        };
        notes.iter().map(words).collect()
    }

    #[test]
    fn a_recording_is_a_mission_from_just_before_its_start_to_just_after_its_report() {
        let decision = || v1::DecisionRecord::default().into();
        let told = play(
            1.0,
            vec![
                (10, v1::PlannerStatus::default().into()),
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
            "1 planner/status 10",
            "1 mcm/status 20",
            "1 mcm/decision 500",
            "1 mcm/status 1000",
            "1 mcm/decision 1500",
            "1 ends",
            // What came in between.
            "2 mcm/status 2500",
            "2 mcm/status 9000",
            "2 mcm/status 9100",
            "2 ends",
            "3 mcm/status 9200",
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn a_vehicle_that_is_gone_leaves_a_recording_that_ends() {
        assert_eq!(play(1.0, vec![(0, status(false))], 59_999), ["1 mcm/status 0"]);
        assert_eq!(play(1.0, vec![(0, status(false))], 60_000), ["1 mcm/status 0", "1 ends"]);
    }

    #[test]
    fn a_high_rate_is_thinned_by_the_wall_clock_and_events_are_all_kept() {
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
        check(1.0, || v1::FlagEvent::default().into(), 1000);
    }

    #[test]
    fn made_up_vehicles_and_long_waits_do_not_fill_the_memory() {
        let mut tracks = Tracks::new(&toml::from_str(CONFIG).unwrap(), Pace::REAL_TIME);
        let mut notes = Vec::new();
        for n in 0..2 * MOST_VEHICLES {
            tracks.heard(at(0), &n.to_string().into(), &status(true), &mut notes);
        }
        assert_eq!((tracks.by_vehicle.len(), notes.len()), (MOST_VEHICLES, 0));
        for _ in 0..2 * PREAMBLE {
            tracks.heard(at(0), &"0".into(), &status(true), &mut notes);
        }
        tracks.heard(at(0), &"0".into(), &status(false), &mut notes);
        assert_eq!(notes.len(), PREAMBLE + 1);
    }
}
