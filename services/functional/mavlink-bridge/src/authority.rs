//! Who has chosen the mode that is flown: we, a failsafe of the autopilot, or somebody else.
//!
//! No autopilot says so. Both obey whoever commands last, so that it is our rule not to take a vehicle back that somebody else has
//! taken: that takes a new command of the layers above, which is an operator's order.

use std::time::Duration;

use domain::fmu::FlightMode;
use domain::time::Time;

use crate::personality::{Personality, Submode};
use crate::vehicle::Vehicle;

/// A failsafe says so at about the same time as it changes the mode: 3 ms apart where it was measured.
const EVIDENCE: Duration = Duration::from_millis(1_500);
/// As long it is not judged who has changed the mode.
const DOUBT: Duration = Duration::from_millis(300);
/// As long after we have begun to set a mode it may be seen.
const EXPECTED: Duration = Duration::from_secs(3);

/// Who flies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Author {
    /// We, or nobody yet.
    Ours,
    /// A mode was seen that is not ours, and it is not known yet whose it is.
    InDoubt,
    /// A failsafe of the autopilot.
    Failsafe,
    /// Somebody else, in this way.
    Other(String),
}

/// Follows the modes.
#[derive(Debug)]
pub(crate) struct Authority {
    /// The mode that we set last, or found on the ground.
    commanded: Option<u32>,
    expected: Option<(Time, u32)>,
    changed: Option<Time>,
    author: Author,
}

impl Authority {
    /// Nothing was seen.
    pub(crate) fn new() -> Authority {
        Authority { commanded: None, expected: None, changed: None, author: Author::Ours }
    }

    /// Who flies.
    pub(crate) fn author(&self) -> &Author {
        &self.author
    }

    /// The mode that we set last.
    pub(crate) fn commanded(&self) -> Option<u32> {
        self.commanded
    }

    /// We set this mode. If it is flown already, it is ours from here on.
    pub(crate) fn expect(&mut self, mode: u32, now: Time) {
        self.expected = Some((now, mode));
    }

    /// Somebody else has done something else than set a mode. A mode that we have selected before does not take it back.
    pub(crate) fn taken(&mut self, how: &str) {
        self.expected = None;
        self.author = Author::Other(how.to_owned());
    }

    /// The vehicle was started again: it does what it does by itself.
    pub(crate) fn restarted(&mut self) {
        *self = Authority::new();
    }

    /// Judges what the vehicle says. Only the mode of a vehicle whose motors may turn can be somebody else's choice.
    pub(crate) fn update(&mut self, vehicle: &Vehicle, personality: &dyn Personality, now: Time) {
        let (Some(actual), armed) = (vehicle.custom_mode(), vehicle.is_armed()) else { return };
        let asked = vehicle.intended(now).unwrap_or(actual);
        let expected = self.expected.filter(|(at, _)| now - *at <= EXPECTED).map(|(_, mode)| mode);
        if expected == Some(asked) {
            self.commanded = Some(asked);
            self.changed = None;
            self.author = Author::Ours;
            // A failsafe that flies something else is judged by the mode that is flown.
        } else if let Some(commanded) = self.commanded {
            // That it is disarmed is said up to a second later than the mode.
            let is_down = !armed || vehicle.is_on_ground();
            let by_itself = || personality.changes_by_itself(commanded, asked, is_down);
            if asked == commanded {
                self.changed = None;
                if matches!(self.author, Author::InDoubt | Author::Failsafe) {
                    self.author = Author::Ours;
                }
            } else if !armed || by_itself() {
                // With its motors off nobody flies it: a switch of its remote control, or whoever prepares it, has changed the mode.
                if self.landing(vehicle, personality).is_none() {
                    self.commanded = Some(asked);
                }
            } else {
                self.doubt(vehicle, personality, asked, now);
            }
        } else {
            self.first(vehicle, personality, asked);
        }
        if self.author == Author::Ours && vehicle.intended(now).is_some_and(|it| it != actual) {
            self.author = Author::Failsafe;
        }
    }

    /// The landing that is over, until the motors are seen to be off: PX4 tells the mode that follows it up to a second before that.
    pub(crate) fn landing(&self, vehicle: &Vehicle, personality: &dyn Personality) -> Option<u32> {
        let is_landing = |mode: &u32| personality.mode(*mode, Submode::Holding) == Some(FlightMode::Land);
        let is_over = |mode: &u32| {
            let next = vehicle.custom_mode();
            next.is_some_and(|next| next != *mode && personality.changes_by_itself(*mode, next, vehicle.is_on_ground()))
        };
        self.commanded.filter(is_landing).filter(is_over).filter(|_| vehicle.is_armed())
    }

    /// The first mode that is seen. On the ground nobody has chosen it; in the air we may have, before this process was started again.
    fn first(&mut self, vehicle: &Vehicle, personality: &dyn Personality, asked: u32) {
        let has_name = personality.mode(asked, Submode::Holding).is_some();
        let started = vehicle.heartbeat.is_some_and(|(_, it)| personality.has_started(it.system_status));
        if !vehicle.is_armed() && !started {
            return;
        }
        self.commanded = Some(asked);
        if vehicle.is_armed() && !has_name {
            self.author = Author::Other(format!("{} was flown when it was first heard", personality.mode_name(asked)));
        }
    }

    fn doubt(&mut self, vehicle: &Vehicle, personality: &dyn Personality, asked: u32, now: Time) {
        if matches!(self.author, Author::Other(_)) {
            return;
        }
        let changed = *self.changed.get_or_insert(now);
        let since = Time::ZERO + (changed - Time::ZERO).saturating_sub(EVIDENCE);
        let is_critical = vehicle.critical_since.is_some_and(|it| since <= it);
        if is_critical || vehicle.texts.says_since(personality.failsafe_texts(), since) {
            self.author = Author::Failsafe;
        } else if self.author != Author::Failsafe {
            self.author = match DOUBT <= now - changed {
                true => Author::Other(format!("{} was set by somebody else", personality.mode_name(asked))),
                false => Author::InDoubt,
            };
        }
    }

    /// When the judgement may change by time alone.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.changed.filter(|_| self.author == Author::InDoubt).map(|it| it + DOUBT)
    }
}
