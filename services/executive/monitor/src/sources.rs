//! The newest sample of each source, and when the source last brought something new.
//!
//! A source is silent when nothing arrives, and frozen when the same value arrives again and again
//! while the vehicle is armed. In both cases its age counts from the last sample that was new. A
//! disarmed vehicle on the ground may stand still.

use std::num::NonZeroU32;
use std::time::Duration;

use domain::contingency::rule::DataSource;
use domain::flight_state::{Evidence, FlightState, Motors};
use domain::fmu::{Attitude, Battery, FlightMode, GlobalPosition, LandDetected, LocalPosition, Status};
use domain::time::{Pace, Time};

use crate::config::Config;
use crate::touchdown::Touchdown;

/// What arrives from a source, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Sample {
    Status(Status),
    Attitude(Attitude),
    LocalPosition(LocalPosition),
    GlobalPosition(GlobalPosition),
    LandDetected(LandDetected),
    Battery(Battery),
    /// The ground is heard, and heard the vehicle this much wall time ago.
    GroundContact(Duration),
    /// The loop of the planner turns.
    Planner,
    /// That of the skill manager does.
    SkillManager,
    /// That of the mission manager does.
    MissionManager,
}

/// One source.
#[derive(Debug, Clone)]
pub(crate) struct Source<T> {
    /// `None` where a value may stay as it is.
    freezing: Option<Freezing<T>>,
    latest: Option<Latest<T>>,
}

/// When a source counts as frozen.
#[derive(Debug, Clone)]
struct Freezing<T> {
    /// After this many repetitions in a row.
    after: NonZeroU32,
    /// Whether the second value measures the same as the first. A real sensor is never without
    /// noise, and does not do that for long.
    repeats: fn(&T, &T) -> bool,
}

#[derive(Debug, Clone)]
struct Latest<T> {
    value: T,
    arrived: Time,
    /// When the value was first seen, and how often it was repeated since then.
    new_since: Time,
    repetitions: u32,
}

/// The last time that a source brought something new.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Update {
    /// Its age counts from here.
    pub(crate) at: Time,
    /// Whether it still sends, but always the same.
    pub(crate) frozen: bool,
}

impl<T> Source<T> {
    /// A source whose value may stay as it is: a state that lasts is no sign of a fault.
    fn of_states() -> Source<T> {
        Source { freezing: None, latest: None }
    }

    /// A source that measures, and is frozen after `after` repetitions.
    fn of_measurements(after: NonZeroU32, repeats: fn(&T, &T) -> bool) -> Source<T> {
        Source { freezing: Some(Freezing { after, repeats }), latest: None }
    }

    /// Takes in a value that arrived while the vehicle was, or was not, `armed`.
    fn take(&mut self, now: Time, value: T, armed: bool) {
        let repeats = |earlier: &T| self.freezing.as_ref().is_some_and(|it| (it.repeats)(earlier, &value));
        let (new_since, repetitions) = match &self.latest {
            Some(latest) if armed && repeats(&latest.value) => (latest.new_since, latest.repetitions.saturating_add(1)),
            _ => (now, 0),
        };
        self.latest = Some(Latest { value, arrived: now, new_since, repetitions });
    }

    /// The newest value, however old.
    pub(crate) fn latest(&self) -> Option<&T> {
        self.latest.as_ref().map(|it| &it.value)
    }

    /// When it last brought something new; `None`: it was never heard.
    fn last_update(&self) -> Option<Update> {
        let latest = self.latest.as_ref()?;
        let frozen = self.freezing.as_ref().is_some_and(|it| it.after.get() <= latest.repetitions);
        Some(Update { at: if frozen { latest.new_since } else { latest.arrived }, frozen })
    }
}

/// Everything that the vehicle says, and its contact with the ground.
#[derive(Debug, Clone)]
pub(crate) struct Sources {
    pub(crate) status: Source<Status>,
    pub(crate) attitude: Source<Attitude>,
    pub(crate) local_position: Source<LocalPosition>,
    pub(crate) global_position: Source<GlobalPosition>,
    pub(crate) land_detected: Source<LandDetected>,
    pub(crate) battery: Source<Battery>,
    flight: FlightState,
    touchdown: Touchdown,
    /// When the ground and the vehicle last heard each other.
    contact: Option<Time>,
    /// When each process was last heard.
    planner: Option<Time>,
    skill_manager: Option<Time>,
    mission_manager: Option<Time>,
    first_heard: Option<Time>,
    pace: Pace,
}

impl Sources {
    /// Nothing was heard yet.
    pub(crate) fn new(config: &Config, pace: Pace) -> Sources {
        Sources {
            status: Source::of_states(),
            attitude: Source::of_measurements(config.attitude_frozen_samples, |a, b| a == b),
            // The estimator's trust in itself may change while its input stands still.
            local_position: Source::of_measurements(config.position_frozen_samples, |a, b| {
                a.position == b.position && a.velocity == b.velocity
            }),
            global_position: Source::of_measurements(config.position_frozen_samples, |a, b| place(a) == place(b)),
            land_detected: Source::of_states(),
            battery: Source::of_measurements(config.battery_frozen_samples, |a, b| a == b),
            flight: FlightState::default(),
            touchdown: Touchdown::default(),
            contact: None,
            planner: None,
            skill_manager: None,
            mission_manager: None,
            first_heard: None,
            pace,
        }
    }

    /// Takes in a sample.
    pub(crate) fn take(&mut self, now: Time, sample: Sample) {
        let armed = self.armed();
        match sample {
            Sample::Status(it) => self.status.take(now, it, armed),
            Sample::Attitude(it) => self.attitude.take(now, it, armed),
            Sample::LocalPosition(it) => {
                if it.vertical_valid {
                    self.touchdown.descends(now, -it.velocity.climb_rate_m_s());
                }
                self.local_position.take(now, it, armed);
            }
            Sample::GlobalPosition(it) => self.global_position.take(now, it, armed),
            Sample::LandDetected(it) => self.land_detected.take(now, it, armed),
            Sample::Battery(it) => self.battery.take(now, it, armed),
            // The newest contact counts: had the ground heard the vehicle later, it would say so.
            Sample::GroundContact(ago) => {
                self.contact = Some(Time::after(now.since_start().saturating_sub(self.pace.wall(ago))));
                return;
            }
            // What a process says of itself is no sign of the vehicle.
            Sample::Planner => return self.planner = Some(now),
            Sample::SkillManager => return self.skill_manager = Some(now),
            Sample::MissionManager => return self.mission_manager = Some(now),
        }
        self.first_heard.get_or_insert(now);
        self.judge_flight(now);
    }

    fn judge_flight(&mut self, now: Time) {
        let lands = |it: &Status| it.actual == Some(FlightMode::Land);
        let status = self.status.latest().map(|it| Motors { armed: it.armed, lands: lands(it) });
        let age = |update: Option<Update>| update.map_or(Duration::MAX, |it| now - it.at);
        let position = self.local_position.latest().map(|it| (age(self.local_position.last_update()), *it));
        let landed = self.land_detected.latest().map(|it| (age(self.land_detected.last_update()), it.landed));
        self.flight.update(now, Evidence::new(self.pace, status, position, landed));
        if let Some(flying) = self.flight.flying() {
            self.touchdown.flies(flying);
        }
    }

    /// When the first of the vehicle's sources was first heard.
    pub(crate) fn first_heard(&self) -> Option<Time> {
        self.first_heard
    }

    /// When `source` last brought something new; `None`: it was never heard.
    pub(crate) fn last_update(&self, source: DataSource) -> Option<Update> {
        let heard = |at: Option<Time>| at.map(|at| Update { at, frozen: false });
        match source {
            DataSource::Status => self.status.last_update(),
            DataSource::Attitude => self.attitude.last_update(),
            DataSource::LocalPosition => self.local_position.last_update(),
            DataSource::GlobalPosition => self.global_position.last_update(),
            DataSource::LandDetected => self.land_detected.last_update(),
            DataSource::Battery => self.battery.last_update(),
            DataSource::GroundLink => heard(self.contact),
            DataSource::Planner => heard(self.planner),
            DataSource::SkillManager => heard(self.skill_manager),
            DataSource::MissionManager => heard(self.mission_manager),
        }
    }

    /// How fast the vehicle came down last, in metres per second; 0 in the air, `None` where it was not seen to come down.
    pub(crate) fn touchdown_m_s(&self) -> Option<f64> {
        self.touchdown.speed_m_s()
    }

    /// Armed, by the newest status.
    pub(crate) fn armed(&self) -> bool {
        self.status.latest().is_some_and(|it| it.armed)
    }

    /// Whether the vehicle flies, by the rule that all processes share; `None` while nothing shows it.
    pub(crate) fn flying(&self) -> Option<bool> {
        self.flight.flying()
    }

    /// Whether the land detector says the opposite; `None` while it says nothing.
    pub(crate) fn contradicts_detector(&self) -> Option<bool> {
        self.flight.contradicts_detector()
    }
}

fn place(global: &GlobalPosition) -> (f64, f64, f64) {
    (global.latitude_deg, global.longitude_deg, global.altitude_amsl_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays samples 0.1 s apart to a source that is frozen after three repetitions, and compares its last update.
    #[track_caller]
    fn check(armed: bool, samples: &[f64], expected: Option<(u64, bool)>) {
        let mut source = Source::of_measurements(NonZeroU32::new(3).unwrap(), |a, b| a == b);
        for (n, &sample) in samples.iter().enumerate() {
            source.take(at_ms(n as u64 * 100), sample, armed);
        }
        assert_eq!(source.last_update(), expected.map(|(ms, frozen)| Update { at: at_ms(ms), frozen }), "{samples:?}");
    }

    fn at_ms(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    #[test]
    fn the_age_counts_from_the_last_sample_that_was_new() {
        check(true, &[], None);
        check(true, &[0.5], Some((0, false)));
        check(true, &[0.5, 0.4, 0.3], Some((200, false)));
    }

    #[test]
    fn a_value_that_is_repeated_is_frozen_but_only_when_armed() {
        check(true, &[0.5, 0.4, 0.4, 0.4], Some((300, false)));
        check(true, &[0.5, 0.4, 0.4, 0.4, 0.4], Some((100, true)));
        check(true, &[0.4, 0.4, 0.4, 0.4, 0.3], Some((400, false)));
        check(false, &[0.4, 0.4, 0.4, 0.4, 0.4], Some((400, false)));
    }
}
