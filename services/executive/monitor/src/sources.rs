//! The newest sample of each source, and when the source last brought something new.
//!
//! A source is silent when nothing arrives, and frozen when the same value arrives again and again
//! while the vehicle is armed, or a status with the same time. In both cases its age counts from the last sample that was new. A
//! disarmed vehicle on the ground may stand still.

use std::num::NonZeroU32;
use std::time::Duration;

use domain::area::Area;
use domain::contingency::snapshot::{Field, Fields, Snapshot};
use domain::contingency::source::DataSource;
use domain::flight_state::{Evidence, FlightState, Motors};
use domain::fmu::{
    Attitude, Battery, FlightMode, GlobalPosition, LandDetected, LocalPosition, PreEmption, Status, TrafficKind,
    TransponderReport, Wind,
};
use domain::geometry::Ned;
use domain::quantity::Positive;
use domain::time::{Now, Pace, Time};
use domain::traffic::Mover;
use kittiwake_proto::v1;

use crate::away::Away;
use crate::clock::Clock;
use crate::config::Config;
use crate::gusts::Gusts;
use crate::jumps::Jumps;
use crate::manager::{HeardOutlook, Outlook};
use crate::silence::{counted_s, reached_after};
use crate::skills::Skills;
use crate::touchdown::Touchdown;
use crate::traffic::{Own, Traffic};

/// A wind that was estimated longer ago, in wall time, is not known any more. (ENG: ten estimates at 1 Hz.)
const WIND_SILENT: Duration = Duration::from_secs(10);

/// A land detector that has told the same time this often is frozen. (ENG: three seconds at 1 Hz, as for one that contradicts.)
const DETECTOR_FROZEN_SAMPLES: NonZeroU32 = NonZeroU32::new(3).unwrap();

/// What arrives from a source, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Sample {
    Status(Status),
    Attitude(Attitude),
    LocalPosition(LocalPosition),
    GlobalPosition(GlobalPosition),
    LandDetected(LandDetected),
    Battery(Battery),
    Wind(Wind),
    /// Another aircraft is reported.
    Traffic(TransponderReport),
    /// The ground is heard.
    GroundContact {
        /// It heard the vehicle this much wall time ago.
        ago: Duration,
        /// It does not record the flight although it is to.
        record_fails: bool,
    },
    /// The control tower has told its decisions.
    Ledger,
    /// The mission manager has told what rules read, what the monitor before this one has told, and which declared skills the rest of the
    /// mission uses.
    Manager(Outlook, Before, Vec<String>),
    /// The process of a declared skill has reported.
    Task(v1::TaskReport),
    /// The loop of the planner turns.
    Planner,
    /// That of the skill manager does.
    SkillManager,
    /// That of the mission manager does.
    MissionManager,
}

/// What the mission manager knows from the monitor before this one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Before {
    /// The ground was heard.
    pub(crate) ground_link: bool,
    /// The control tower was heard.
    pub(crate) control_tower: bool,
    /// For how long the vehicle has flown by now.
    pub(crate) flown: Duration,
}

/// The fields that say less than they will, since this monitor has heard too little yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Unheard {
    /// Not known, and that may just be too early.
    pub(crate) unknown: Fields,
    /// Silences of sources that it has never heard: they may have lasted for longer.
    pub(crate) silences: Fields,
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
    /// A source whose value may stay as it is: a state that lasts is not a sign of a fault.
    fn of_states() -> Source<T> {
        Source { freezing: None, latest: None }
    }

    /// A source that measures, and is frozen after `after` repetitions.
    fn of_measurements(after: NonZeroU32, repeats: fn(&T, &T) -> bool) -> Source<T> {
        Source { freezing: Some(Freezing { after, repeats }), latest: None }
    }

    /// Takes in a value. One that a sound source never repeats `must_change`: a measurement while the vehicle is armed, and a time. What
    /// was found frozen is so until it changes: that the vehicle disarms by it mends nothing.
    fn take(&mut self, now: Time, value: T, must_change: bool) {
        let must_change = must_change || self.last_update().is_some_and(|it| it.frozen);
        let repeats = |earlier: &T| self.freezing.as_ref().is_some_and(|it| (it.repeats)(earlier, &value));
        let (new_since, repetitions) = match &self.latest {
            Some(latest) if must_change && repeats(&latest.value) => {
                (latest.new_since, latest.repetitions.saturating_add(1))
            }
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
    pre_emption: PreEmption,
    pub(crate) attitude: Source<Attitude>,
    pub(crate) local_position: Source<LocalPosition>,
    pub(crate) global_position: Source<GlobalPosition>,
    pub(crate) land_detected: Source<LandDetected>,
    pub(crate) battery: Source<Battery>,
    wind: Source<Wind>,
    traffic: Traffic,
    clock: Clock,
    away: Away,
    gusts: Gusts,
    jumps: Jumps,
    outlook: HeardOutlook,
    pub(crate) skills: Skills,
    flight: FlightState,
    /// Since when it has flown, and for how long before that, as far as only the monitor before this one has seen it.
    flies_since: Option<Time>,
    flown_before: Duration,
    /// Whether the first status found the vehicle armed: this monitor was started in flight, or shortly before.
    began_armed: bool,
    before: Before,
    touchdown: Touchdown,
    record_fails: Option<bool>,
    /// When the ground and the vehicle last heard each other.
    contact: Option<Time>,
    /// When each process was last heard.
    planner: Option<Time>,
    skill_manager: Option<Time>,
    mission_manager: Option<Time>,
    control_tower: Option<Time>,
    first_heard: Option<Time>,
    /// From the first sample of any source until one that was never heard is silent, in the seconds of a rule.
    absent_after: Positive,
    pace: Pace,
}

impl Sources {
    /// Nothing was heard yet.
    pub(crate) fn new(config: &Config, pace: Pace) -> Sources {
        Sources {
            // Its state lasts, but its timestamp does not, if the autopilot sends one.
            status: Source::of_measurements(NonZeroU32::MIN, |a, b| b.repeats(a)),
            pre_emption: PreEmption::default(),
            attitude: Source::of_measurements(config.attitude_frozen_samples, |a, b| a == b),
            local_position: Source::of_measurements(config.position_frozen_samples, |a, b| b.repeats(a)),
            global_position: Source::of_measurements(config.position_frozen_samples, |a, b| place(a) == place(b)),
            land_detected: Source::of_measurements(DETECTOR_FROZEN_SAMPLES, tells_the_same_time),
            // Without a current nothing in it need change: PX4's simulated battery stays at its lowest charge for good.
            battery: Source::of_measurements(config.battery_frozen_samples, |a, b| a.current_a.is_some() && a == b),
            // An average of some seconds of still air may stay as it is.
            wind: Source::of_states(),
            traffic: Traffic::except(&config.own_transponders),
            clock: Clock::default(),
            away: Away::default(),
            gusts: Gusts::new(pace),
            jumps: Jumps::new(pace),
            skills: Skills::default(),
            outlook: HeardOutlook::default(),
            flight: FlightState::default(),
            flies_since: None,
            flown_before: Duration::ZERO,
            began_armed: false,
            before: Before::default(),
            touchdown: Touchdown::default(),
            record_fails: None,
            contact: None,
            planner: None,
            skill_manager: None,
            mission_manager: None,
            control_tower: None,
            first_heard: None,
            absent_after: config.absent_after_s,
            pace,
        }
    }

    /// Whether the autopilot flies something else than what was asked for, for a reason of its own.
    pub(crate) fn pre_empts(&self) -> Option<bool> {
        self.status.latest().map(|_| self.pre_emption.holds())
    }

    /// Takes in a sample.
    pub(crate) fn take(&mut self, now: Time, sample: Sample) {
        let armed = self.armed();
        match sample {
            Sample::Status(it) => {
                if self.status.latest().is_some_and(|before| before.frame_epoch != it.frame_epoch) {
                    self.flight.frame_moved();
                }
                if self.status.latest().is_none() {
                    self.began_armed = it.armed;
                }
                self.pre_emption.update(now, it.reported());
                self.notice_motors(now, &it);
                // Its time goes on also on the ground.
                self.status.take(now, it, true);
            }
            Sample::Attitude(it) => self.attitude.take(now, it, armed),
            Sample::LocalPosition(it) => {
                if it.vertical_valid {
                    self.touchdown.descends(now, it.position.height_m(), -it.velocity.climb_rate_m_s());
                }
                self.jumps.measure(now, &it);
                self.local_position.take(now, it, armed);
            }
            Sample::GlobalPosition(it) => self.global_position.take(now, it, armed),
            Sample::LandDetected(it) => self.land_detected.take(now, it, armed),
            Sample::Battery(it) => self.battery.take(now, it, armed),
            // Neither says anything about whether the vehicle itself is heard.
            Sample::Wind(it) => {
                self.gusts.feel(now, it);
                return self.wind.take(now, it, armed);
            }
            Sample::Traffic(it) => {
                let intends = self.outlook(now).intends;
                let own = own(&self.local_position, intends);
                return self.traffic.hear(now, self.pace, own, it);
            }
            // The newest contact counts: had the ground heard the vehicle later, it would say so.
            Sample::GroundContact { ago, record_fails } => {
                self.record_fails = Some(record_fails);
                self.contact = Some(Time::after(now.since_start().saturating_sub(self.pace.wall(ago))));
                return;
            }
            Sample::Ledger => return self.control_tower = Some(now),
            Sample::Task(report) => return self.skills.hear(now, report),
            Sample::Manager(outlook, before, needed) => {
                self.skills.needs(now, needed);
                self.outlook.hear(now, outlook);
                return self.learn(now, before);
            }
            // What a process says about itself is not a sign of life of the vehicle.
            Sample::Planner => return self.planner = Some(now),
            Sample::SkillManager => return self.skill_manager = Some(now),
            Sample::MissionManager => return self.mission_manager = Some(now),
        }
        self.first_heard.get_or_insert(now);
        self.judge_flight(now);
    }

    /// The motors of a vehicle that has flown until now may be stopped.
    fn notice_motors(&mut self, now: Time, status: &Status) {
        let stops = self.armed() && !status.armed && self.flight.flying() == Some(true);
        let position = self.local_position.latest();
        let away_m = position.filter(|_| self.flight.is_away()).map(|it| it.position.height_m());
        self.touchdown.motors(status.armed, away_m);
        let is_blind = position.is_some_and(|it| !it.vertical_valid) && status.actual != Some(FlightMode::Land);
        let is_unseen = is_blind || self.touchdown.must_have_fallen(now);
        if let Some(height_m) = away_m.filter(|_| stops && is_unseen) {
            self.touchdown.falls_unseen(height_m);
        }
    }

    fn judge_flight(&mut self, now: Time) {
        let age = |update: Option<Update>| update.map_or(Duration::MAX, |it| now - it.at);
        let status = self.status.latest().map(|it| (age(self.status.last_update()), Motors::from(it)));
        let position = self.local_position.latest().map(|it| (age(self.local_position.last_update()), *it));
        let landed = self.land_detected.latest().map(|it| (age(self.land_detected.last_update()), it.landed));
        self.flight.update(now, Evidence::new(self.pace, status, position, landed));
        if let Some(flying) = self.flight.flying() {
            self.touchdown.flies(now, flying);
            self.flies_since = flying.then(|| self.flies_since.unwrap_or(now));
            if !flying {
                self.flown_before = Duration::ZERO;
            }
        }
    }

    /// Goes on with what the monitor before this one has told. One that was started on the ground begins a flight of its own: a vehicle that
    /// has no ground this time is not to miss that of the last time.
    fn learn(&mut self, now: Time, before: Before) {
        if !self.began_armed {
            return;
        }
        self.before.ground_link |= before.ground_link;
        self.before.control_tower |= before.control_tower;
        if let Some(since) = self.flies_since {
            self.flown_before = self.flown_before.max(before.flown.saturating_sub(now - since));
        }
    }

    /// Whether there is no such source in this flight, as far as this monitor and the one before it have heard.
    fn never_existed(&self, source: DataSource) -> bool {
        let by_one_before = match source {
            DataSource::GroundLink => self.before.ground_link,
            DataSource::ControlTower => self.before.control_tower,
            _ => false,
        };
        source.is_optional() && !by_one_before && self.last_update(source).is_none()
    }

    /// For how long a source has brought nothing new, in the seconds of a rule; `None` where there is none. One that was never heard is
    /// silent since others are heard, after a while in which it might just be late.
    pub(crate) fn silent_s(&self, source: DataSource, now: Time) -> Option<f64> {
        if self.never_existed(source) {
            return None;
        }
        let silent = |since: Time| (now - since).saturating_sub(self.away_since(since));
        let silent = match self.last_update(source) {
            Some(update) => silent(update.at),
            None => self.first_heard.map(silent).filter(|it| self.absent_after(source) <= *it).unwrap_or_default(),
        };
        Some(counted_s(self.pace, source, silent))
    }

    /// When a rule reads that a source has been silent for `silent_s`, if nothing new arrives.
    pub(crate) fn silent_at(&self, source: DataSource, silent_s: f64) -> Option<Time> {
        if self.never_existed(source) {
            return None;
        }
        let reached = reached_after(self.pace, source, silent_s);
        let (since, after) = match self.last_update(source) {
            Some(update) => (update.at, reached),
            None => (self.first_heard?, reached.max(self.absent_after(source))),
        };
        Some(since + after + self.away_since(since))
    }

    fn absent_after(&self, source: DataSource) -> Duration {
        reached_after(self.pace, source, self.absent_after.get())
    }

    /// The fields of `snapshot` that say less than they will.
    pub(crate) fn unheard(&self, snapshot: &Snapshot, now: Time) -> Unheard {
        let absent_after = self.pace.limit(self.absent_after.seconds());
        let is_early = self.first_heard.is_none_or(|first| now < first + absent_after);
        let is_unknown = |field: &Field| is_early && snapshot.get(*field).is_none();
        let is_unheard = |field: &Field| {
            let source = field.silence().filter(|_| snapshot.get(*field).is_some());
            source.is_some_and(|it| self.last_update(it).is_none())
        };
        let all = || Field::ALL.iter().copied();
        Unheard { unknown: Fields::of(all().filter(is_unknown)), silences: Fields::of(all().filter(is_unheard)) }
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
            DataSource::ControlTower => heard(self.control_tower),
        }
    }

    /// How fast the vehicle came down last, in metres per second; 0 in the air, `None` where it was not seen to come down.
    pub(crate) fn touchdown_m_s(&self) -> Option<f64> {
        self.touchdown.speed_m_s()
    }

    /// The height at which the motors were stopped in the air, if it fell from there.
    pub(crate) fn fell_from_m(&self) -> Option<f64> {
        self.touchdown.fell_from_m()
    }

    /// The clocks were read: this process runs.
    pub(crate) fn read_clock(&mut self, now: Now) {
        self.clock.read(now, self.pace);
        self.away.runs(now.time, self.pace);
    }

    /// For how long this process did not run at a time since then.
    fn away_since(&self, time: Time) -> Duration {
        self.away.longest_since(time)
    }

    /// The greatest recent step of the wall clock, in seconds.
    pub(crate) fn clock_step_s(&self, now: Time) -> f64 {
        self.clock.step_s(now)
    }

    /// The wind; `None` without a recent estimate.
    pub(crate) fn wind(&self, now: Time) -> Option<Wind> {
        let update = self.wind.last_update()?;
        self.wind.latest().filter(|_| now - update.at < self.pace.wall(WIND_SILENT)).copied()
    }

    /// The strongest wind of the last minute, in metres per second; `None` without a recent estimate.
    pub(crate) fn gust_m_s(&self, now: Time) -> Option<f64> {
        self.wind(now).map(|_| self.gusts.speed_m_s(now))
    }

    /// The greatest recent jump of the position, in metres; `None` before there was a position.
    pub(crate) fn position_jump_m(&self, now: Time) -> Option<f64> {
        self.local_position.latest().map(|_| self.jumps.greatest_m(now))
    }

    /// For how long it has flown; zero on the ground, `None` while nothing shows whether it flies.
    pub(crate) fn flight_time(&self, now: Time) -> Option<Duration> {
        self.flying()
            .map(|_| self.flies_since.map_or(Duration::ZERO, |since| self.flown_before.saturating_add(now - since)))
    }

    /// Why the rest of the mission cannot use one of its skills, if so; `None` before that is known.
    pub(crate) fn missing_skill(&self, now: Time) -> Option<Option<String>> {
        self.skills.missing(now, self.pace)
    }

    /// Each declared skill as it is now, by what the rules read.
    pub(crate) fn told_skills(&self, snapshot: &Snapshot, now: Time) -> Vec<v1::DeclaredSkill> {
        self.skills.told(snapshot, now, self.pace)
    }

    /// What the mission manager has told recently.
    pub(crate) fn outlook(&self, now: Time) -> Outlook {
        self.outlook.at(now, self.pace)
    }

    /// Whether the ground does not record the flight although it is to; `None` before the ground was heard.
    pub(crate) fn record_fails(&self) -> Option<bool> {
        self.record_fails
    }

    /// How close traffic of this kind comes, in metres; `None` while the vehicle's own place is not known.
    pub(crate) fn closest_approach_m(&self, now: Time, kind: TrafficKind) -> Option<f64> {
        let own = own(&self.local_position, self.outlook(now).intends)?;
        Some(self.traffic.closest_approach_m(now, self.pace, own, kind))
    }

    /// The traffic that comes near.
    pub(crate) fn near_traffic(&self, now: Time) -> Vec<Mover> {
        let own = own(&self.local_position, self.outlook(now).intends);
        own.map(|own| self.traffic.near(now, self.pace, own)).unwrap_or_default()
    }

    /// The areas that are taken by traffic that stands.
    pub(crate) fn occupied(&self, now: Time) -> Vec<Area> {
        self.traffic.occupied(now, self.pace)
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

/// Where the vehicle is, and how it may move; `None` while its place is not known.
fn own(local: &Source<LocalPosition>, intends: Option<(Ned, f64)>) -> Option<Own<'_>> {
    let local = local.latest().filter(|it| it.horizontal_valid && it.vertical_valid)?;
    Some(Own { local, intends })
}

/// Whether the autopilot's own time stands still; one that tells none may be all right.
fn tells_the_same_time(a: &LandDetected, b: &LandDetected) -> bool {
    a.timestamp_us != 0 && a.timestamp_us == b.timestamp_us
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
    fn a_land_detector_whose_time_stands_still_is_frozen_and_one_that_tells_none_is_not() {
        #[track_caller]
        fn check(timestamps_us: [u64; 4], expected: Update) {
            let mut source = Source::of_measurements(DETECTOR_FROZEN_SAMPLES, tells_the_same_time);
            for (n, timestamp_us) in timestamps_us.into_iter().enumerate() {
                let sample = LandDetected { landed: false, ground_contact: false, timestamp_us };
                source.take(at_ms(n as u64 * 1000), sample, true);
            }
            assert_eq!(source.last_update(), Some(expected), "{timestamps_us:?}");
        }
        check([1, 2, 3, 4], Update { at: at_ms(3000), frozen: false });
        check([7, 7, 7, 7], Update { at: at_ms(0), frozen: true });
        check([0, 0, 0, 0], Update { at: at_ms(3000), frozen: false });
    }

    #[test]
    fn what_was_found_frozen_stays_so_when_the_vehicle_disarms_until_it_changes() {
        let mut source = Source::of_measurements(NonZeroU32::new(3).unwrap(), |a, b| a == b);
        let samples = [(0.4, true), (0.4, true), (0.4, true), (0.4, true), (0.4, false), (0.4, false), (0.5, false)];
        let mut frozen = Vec::new();
        for (ms, (sample, armed)) in (0..).zip(samples) {
            source.take(at_ms(ms), sample, armed);
            frozen.push(source.last_update().unwrap().frozen);
        }
        assert_eq!(frozen, [false, false, false, true, true, true, false]);
    }

    #[test]
    fn a_value_that_is_repeated_is_frozen_but_only_when_armed() {
        check(true, &[0.5, 0.4, 0.4, 0.4], Some((300, false)));
        check(true, &[0.5, 0.4, 0.4, 0.4, 0.4], Some((100, true)));
        check(true, &[0.4, 0.4, 0.4, 0.4, 0.3], Some((400, false)));
        check(false, &[0.4, 0.4, 0.4, 0.4, 0.4], Some((400, false)));
    }
}
