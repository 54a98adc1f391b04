//! What is known of the vehicle, with the time at which it was heard. Nothing here is a judgement.

use std::time::Duration;

use domain::fmu::Gripper;
use domain::time::Time;

use crate::heard::{Battery, GlobalPosition, Health, Heard, Heartbeat, LocalPosition};

/// One standard deviation, horizontal and vertical, where it is known.
type AccuracyM = Option<(f64, f64)>;

/// The newest of each message.
#[derive(Debug, Clone, Default)]
pub(crate) struct Vehicle {
    /// Mode, armed, state.
    pub(crate) heartbeat: Option<(Time, Heartbeat)>,
    /// The actual and the intended mode of PX4.
    pub(crate) current_mode: Option<(Time, [u32; 2])>,
    /// MAV_LANDED_STATE.
    pub(crate) landed: Option<(Time, u8)>,
    /// Sensors.
    pub(crate) health: Option<(Time, Health)>,
    /// The battery.
    pub(crate) battery: Option<(Time, Battery)>,
    /// In the local frame.
    pub(crate) local: Option<(Time, LocalPosition)>,
    /// On the globe.
    pub(crate) global: Option<(Time, GlobalPosition)>,
    /// The estimator's flags and accuracy, and whether it does not believe the satellite receiver.
    pub(crate) estimator: Option<(Time, u16, AccuracyM, bool)>,
    /// Fix type and accuracy.
    pub(crate) gnss: Option<(Time, u8, AccuracyM)>,
    /// VIBRATION, as it was said.
    pub(crate) vibration: Option<(Time, [f64; 3])>,
    /// Of the local frame.
    pub(crate) origin: Option<[i32; 3]>,
    /// Where home is.
    pub(crate) home: Option<(Time, [i32; 3])>,
    /// When it was seen to be armed.
    pub(crate) armed_since: Option<Time>,
    /// When it was seen to leave the ground.
    pub(crate) lifted_off: Option<Time>,
    /// When it was seen to be disarmed.
    pub(crate) disarmed_since: Option<Time>,
    /// When the heartbeat began to report a failsafe.
    pub(crate) critical_since: Option<Time>,
    /// What the gripper does, once it has said so.
    pub(crate) gripper: Option<Gripper>,
    /// When it told where the target of a landing is.
    pub(crate) target_heard: Option<Time>,
    /// The texts of the last seconds.
    pub(crate) texts: Texts,
}

/// MAV_STATE: a failsafe.
const CRITICAL: u8 = 5;
/// What is older says nothing about the present. Both autopilots send what is asked for at least once a second.
pub(crate) const FRESH: Duration = Duration::from_secs(3);

impl Vehicle {
    /// Takes in a message.
    pub(crate) fn take_in(&mut self, heard: &Heard, now: Time) {
        match heard {
            Heard::Heartbeat(it) => self.beat(*it, now),
            Heard::CurrentMode { custom_mode, intended } => {
                self.current_mode = Some((now, [*custom_mode, *intended]));
            }
            Heard::Landed(state) => {
                let was_on_ground = self.is_on_ground();
                self.landed = Some((now, *state));
                if was_on_ground && !self.is_on_ground() {
                    self.lifted_off = Some(now);
                }
            }
            Heard::LandingTarget => self.target_heard = Some(now),
            Heard::Health(it) => self.health = Some((now, *it)),
            Heard::Battery(it) => self.battery = Some((now, *it)),
            Heard::LocalPosition(it) => self.local = Some((now, *it)),
            Heard::GlobalPosition(it) => self.global = Some((now, *it)),
            Heard::Estimator { flags, accuracy_m, gnss_glitches } => {
                self.estimator = Some((now, *flags, *accuracy_m, *gnss_glitches));
            }
            Heard::Gnss { fix, accuracy_m } => self.gnss = Some((now, *fix, *accuracy_m)),
            Heard::Vibration(it) => self.vibration = Some((now, *it)),
            Heard::Origin(it) => self.origin = Some(*it),
            Heard::Home(it) => self.home = Some((now, *it)),
            Heard::Text { severity, text } => self.texts.add(*severity, text, now),
            _ => {}
        }
    }

    fn beat(&mut self, heartbeat: Heartbeat, now: Time) {
        let before = self.heartbeat.replace((now, heartbeat)).map(|(_, it)| it);
        if before.map(|it| it.armed) != Some(heartbeat.armed) {
            self.armed_since = heartbeat.armed.then_some(now);
            self.disarmed_since = (!heartbeat.armed).then_some(now);
        }
        match heartbeat.system_status == CRITICAL {
            true => _ = self.critical_since.get_or_insert(now),
            false => self.critical_since = None,
        }
    }

    /// Whether the motors may turn, as it said last.
    pub(crate) fn is_armed(&self) -> bool {
        self.heartbeat.is_some_and(|(_, it)| it.armed)
    }

    /// The mode that it flies, as it said last.
    pub(crate) fn custom_mode(&self) -> Option<u32> {
        let of_heartbeat = self.heartbeat.map(|(at, it)| (at, it.custom_mode));
        let of_current = self.current_mode.map(|(at, [actual, _])| (at, actual));
        of_heartbeat.into_iter().chain(of_current).max_by_key(|(at, _)| *at).map(|(_, mode)| mode)
    }

    /// The mode that was asked for, where it says so.
    pub(crate) fn intended(&self, now: Time) -> Option<u32> {
        self.current_mode.filter(|(at, _)| now - *at <= FRESH).map(|(_, [_, intended])| intended)
    }

    /// Whether the land detector reports the ground.
    pub(crate) fn is_on_ground(&self) -> bool {
        self.landed.is_some_and(|(_, state)| state == landed::ON_GROUND)
    }

    /// Whether it could be armed now, where it says so: MAV_SYS_STATUS_PREARM_CHECK.
    pub(crate) fn prearm(&self, now: Time) -> Option<bool> {
        const PREARM_CHECK: u32 = 1 << 28;
        let (_, health) = self.health.filter(|(at, _)| now - *at <= FRESH)?;
        (health.present & PREARM_CHECK != 0).then_some(health.healthy & PREARM_CHECK != 0)
    }

    /// Whether it has the sensor of this bit, as it said last.
    pub(crate) fn has_sensor(&self, bit: u32) -> bool {
        self.health.is_some_and(|(_, it)| it.present & bit != 0)
    }

    /// The names of the sensors that are used and not healthy.
    pub(crate) fn unhealthy(&self, now: Time) -> Vec<&'static str> {
        let Some((_, health)) = self.health.filter(|(at, _)| now - *at <= FRESH) else { return Vec::new() };
        let bad = health.enabled & !health.healthy;
        SENSORS.iter().filter(|(bit, _)| bad & (1 << bit) != 0).map(|(_, name)| *name).collect()
    }

    /// The newest position on the globe, if it was heard after `since` and is recent.
    pub(crate) fn global_since(&self, since: Time, now: Time) -> Option<GlobalPosition> {
        let recent = Duration::from_millis(500);
        self.global.filter(|(at, _)| since <= *at && now - *at <= recent).map(|(_, it)| it)
    }

    /// The newest position in the local frame, if it is recent.
    pub(crate) fn local_now(&self, now: Time) -> Option<LocalPosition> {
        let recent = Duration::from_millis(500);
        self.local.filter(|(at, _)| now - *at <= recent).map(|(_, it)| it)
    }
}

/// MAV_LANDED_STATE.
pub(crate) mod landed {
    pub(crate) const UNDEFINED: u8 = 0;
    pub(crate) const ON_GROUND: u8 = 1;
    pub(crate) const IN_AIR: u8 = 2;
    pub(crate) const TAKEOFF: u8 = 3;
}

/// Bits of SYS_STATUS (MAV_SYS_STATUS_SENSOR) that say something to a human.
const SENSORS: [(u32, &str); 12] = [
    (0, "gyroscope"),
    (1, "accelerometer"),
    (2, "compass"),
    (3, "pressure"),
    (5, "GNSS"),
    (14, "position control"),
    (16, "RC receiver"),
    (20, "geofence"),
    (21, "attitude estimate"),
    (25, "battery"),
    (27, "proximity"),
    (28, "pre-arm checks"),
];

/// The texts that were heard last, with their severity.
#[derive(Debug, Clone, Default)]
pub(crate) struct Texts(Vec<(Time, u8, String)>);

impl Texts {
    /// As many are kept.
    const KEPT: usize = 20;

    fn add(&mut self, severity: u8, text: &str, now: Time) {
        if self.0.len() == Texts::KEPT {
            self.0.remove(0);
        }
        self.0.push((now, severity, text.to_owned()));
    }

    /// Warnings and worse that came at `since` or later, joined; the same text once.
    pub(crate) fn warnings_since(&self, since: Time) -> String {
        /// MAV_SEVERITY_WARNING.
        const WARNING: u8 = 4;
        let mut texts: Vec<&str> = Vec::new();
        for (at, severity, text) in &self.0 {
            if since <= *at && *severity <= WARNING && !texts.contains(&text.as_str()) {
                texts.push(text);
            }
        }
        texts.join("; ")
    }

    /// When the newest text that contains one of `words` came.
    pub(crate) fn newest_of(&self, words: &[&str]) -> Option<Time> {
        let contains = |text: &str| words.iter().any(|word| text.contains(word));
        self.0.iter().rev().find(|(_, _, text)| contains(text)).map(|(at, ..)| *at)
    }
}
