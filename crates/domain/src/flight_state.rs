//! Whether the vehicle flies: one rule for every process that decides by it.
//!
//! A land detector is one statement of the autopilot, and it fails in both directions: it reports the ground during a whole
//! takeoff and climb, it does not notice a touchdown, or it falls silent. (ArduPilot reports the ground after a forced
//! disarming in the air; PX4's detector needs several stages, 0.7 s, and a height estimate that is up to 0.6 m wrong
//! after a landing.) So it is one witness of three, beside whether the motors are armed, and the height above the
//! place where the vehicle stood last:
//!
//! - Armed and far from that height, the vehicle flies, whatever the detector says.
//! - With its motors off it does not, unless detector and height both say so.
//! - At that height, armed, the detector decides; without one, or by one that has not noticed the flight, what was known last. That the
//!   flight has ended it must say in a landing that no longer comes down, or of a vehicle that rests no higher than a metre: one that speaks
//!   too early, or sticks in a takeoff, says nothing.
//! - At the end of a landing an armed vehicle also stands if it no longer moves and either is back at the height at which it
//!   stood before, or the detector says so that had noticed the beginning of the flight. That is how a landing on
//!   a deck is seen, and a touchdown that the detector does not notice.
//! - Whose status is silent may be landing: it also stands if the detector says so and it has rested for eight seconds, either where it
//!   stood before, or anywhere if the detector had noticed the flight and noticed that it ended.

use std::time::Duration;

use crate::fmu::{FlightMode, LocalPosition, Status};
use crate::time::{Pace, Time};

/// An armed vehicle farther than this from the height at which it stood last flies. (ENG: more than twice the error of PX4's
/// height after a landing, 0.6 m, and less than the lowest climb of a takeoff, 2 m.)
pub const AWAY_FROM_GROUND_M: f64 = 1.5;
/// Nearer than this to the height at which it stood last, it may stand there again. (ENG: above the same error, and
/// below the height at which a landing stops over something that is in the way.)
pub const AT_GROUND_M: f64 = 1.0;
/// A landing that is nearer than this to it touches the ground, or is about to. (ENG: what it sinks in a third of a second, at PX4's
/// MPC_LAND_SPEED, 0.7 m/s.)
const TOUCHES_M: f64 = 0.2;
/// Slower than this it does not move. (ENG: half of PX4's MPC_LAND_SPEED, 0.7 m/s.)
pub const AT_REST_M_S: f64 = 0.35;
/// A height that is estimated may drift by this much within minutes. (A barometer: 8 m for each hectopascal of the weather.)
const DRIFTS_M: f64 = 10.0;
/// Time at rest in a landing after which it stands, by the detector's statement. (PX4: its detector takes 0.7 s.)
const SETTLED: Duration = Duration::from_secs(1);
/// The same against its statement, or without one, or if nobody knows whether it is a landing. (A real PX4 has rested
/// for up to 5.4 s before its detector said so, and until then it ignores a takeoff. ENG: less than the time in which
/// a landing must come down by half a metre, 10 s.)
const SETTLED_UNNOTICED: Duration = Duration::from_secs(8);
/// Older land-detector samples are ignored; wall time at speed factors above 1. (ENG: three of the simulator's 1 Hz;
/// PX4 sends it at 1 Hz or more.)
const DETECTOR_SILENT: Duration = Duration::from_secs(3);
/// An older status, in the same time, does not tell the current mode. (ENG: six samples of 2 Hz, as for the flag
/// `status_stale`.)
const STATUS_SILENT: Duration = Duration::from_secs(3);
/// The same for a position. (ENG: 60 samples of PX4's 123 Hz.)
const POSITION_SILENT: Duration = Duration::from_millis(500);

/// The age from which on a statement of the land detector counts as none, at this pace.
pub fn detector_limit(pace: Pace) -> Duration {
    DETECTOR_SILENT.max(pace.wall(DETECTOR_SILENT))
}

/// The age above which a status does not tell the current mode, at this pace.
pub fn status_limit(pace: Pace) -> Duration {
    STATUS_SILENT.max(pace.wall(STATUS_SILENT))
}

/// What is known at one moment; `None` where nothing is, or nothing recent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evidence {
    /// Whether the motors may turn.
    pub armed: Option<bool>,
    /// The autopilot flies its landing mode.
    pub lands: bool,
    /// The status is silent, and the mode that it told last may be another one by now.
    pub may_land: bool,
    /// Whether the land detector reports the ground.
    pub landed: Option<bool>,
    /// Height above the origin, in metres, if the estimator vouches for it.
    pub height_m: Option<f64>,
    /// Speed in any direction, in metres per second.
    pub speed_m_s: Option<f64>,
    /// Speed up or down, in metres per second.
    pub vertical_m_s: Option<f64>,
}

/// What the status says: the motors, and that a landing is flown, count as they were reported last, however long ago.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Motors {
    /// They may turn.
    pub armed: bool,
    /// The autopilot flies its landing mode.
    pub lands: bool,
}

impl From<&Status> for Motors {
    fn from(status: &Status) -> Motors {
        Motors { armed: status.armed, lands: status.actual == Some(FlightMode::Land) }
    }
}

impl Evidence {
    /// The newest of each source, with its age.
    pub fn new(
        pace: Pace,
        status: Option<(Duration, Motors)>,
        position: Option<(Duration, LocalPosition)>,
        landed: Option<(Duration, bool)>,
    ) -> Evidence {
        let position = position.filter(|(age, it)| it.vertical_valid && *age <= pace.limit(POSITION_SILENT));
        Evidence {
            armed: status.map(|(_, it)| it.armed),
            lands: status.is_some_and(|(_, it)| it.lands),
            may_land: status.is_some_and(|(age, _)| status_limit(pace) < age),
            landed: landed.filter(|(age, _)| *age <= detector_limit(pace)).map(|(_, landed)| landed),
            height_m: position.map(|(_, it)| it.position.height_m()),
            speed_m_s: position.map(|(_, it)| it.velocity.speed_m_s()),
            vertical_m_s: position.map(|(_, it)| it.velocity.climb_rate_m_s().abs()),
        }
    }
}

/// Whether the vehicle flies, as far as all evidence up to now shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlightState {
    flying: Option<bool>,
    /// The height at which it stood last. Until it is seen to stand anywhere that is the origin, the take-off point;
    /// unknown after the frame has moved in flight.
    ground_m: Ground,
    /// The land detector has reported the air since the vehicle stood, and not the ground while it flew.
    noticed: bool,
    at_rest_since: Option<Time>,
    /// Since when it has rested while its mode is not known.
    still_since: Option<Time>,
    /// The land detector began to report the ground when it had just come to rest so.
    touchdown_noticed: bool,
    /// It has stood, or a landing has touched the ground, and it has not been far above that since. Where the mode is not known, what rests
    /// as low as a landing that touches the ground counts as one.
    near_ground: bool,
    latest: Evidence,
}

/// The height at which the vehicle stood last.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ground(Option<f64>);

impl Default for Ground {
    fn default() -> Ground {
        Ground(Some(0.0))
    }
}

impl FlightState {
    /// The local frame moved: heights before and after it cannot be compared. The land detector decides until the vehicle is seen to
    /// stand.
    pub fn frame_moved(&mut self) {
        self.ground_m = Ground(None);
        self.latest.height_m = None;
    }

    /// Whether the vehicle flies; `None` while nothing shows it.
    pub fn flying(&self) -> Option<bool> {
        self.flying
    }

    /// Whether the vehicle stands or touches the ground, or has just lifted off: it has been nowhere higher than [`AT_GROUND_M`] above the
    /// ground since it stood, since a landing touched it, or what may be one because the status is silent, or since it was first seen, in a
    /// landing or at rest. Between that and the detector's statement it may rest there, with its motors on.
    pub fn is_near_ground(&self) -> bool {
        self.near_ground
    }

    /// Whether it may stand, although it counts as flying: the land detector says the ground, nothing moves, and the height is no farther
    /// from that of the ground than an estimate drifts.
    pub fn may_have_drifted(&self) -> bool {
        let Evidence { landed, speed_m_s, .. } = self.latest;
        let is_slow = speed_m_s.is_some_and(|it| it < AT_REST_M_S);
        let is_within = self.distance_m().is_some_and(|it| it <= DRIFTS_M);
        self.flying == Some(true) && landed == Some(true) && is_slow && is_within
    }

    /// Whether the land detector says the opposite; `None` while it says nothing.
    pub fn contradicts_detector(&self) -> Option<bool> {
        Some(self.latest.landed? == self.flying?)
    }

    /// Whether the vehicle stands still at the height of its ground, so that switching its motors off does no harm.
    pub fn stands_still(&self) -> bool {
        let is_slow = self.latest.speed_m_s.is_some_and(|it| it < AT_REST_M_S);
        self.flying == Some(false) && is_slow && self.distance_m().is_some_and(|it| it < AT_GROUND_M / 2.0)
    }

    /// Whether the vehicle is far from the height of its ground, or nothing shows that it is near.
    pub fn is_away(&self) -> bool {
        self.distance_m().is_none_or(|it| AWAY_FROM_GROUND_M < it)
    }

    /// Takes in what is known now. To be called whenever anything changes, and at least once a second.
    pub fn update(&mut self, now: Time, evidence: Evidence) {
        let before = std::mem::replace(&mut self.latest, evidence);
        let is_slow = evidence.speed_m_s.is_some_and(|it| it < AT_REST_M_S);
        let may_rest = is_slow && evidence.may_land;
        self.at_rest_since = self.at_rest_since.or(Some(now)).filter(|_| is_slow && evidence.lands);
        self.still_since = self.still_since.or(Some(now)).filter(|_| may_rest);
        let begins_to_report = before.landed == Some(false) && evidence.landed == Some(true);
        let notices_touchdown = begins_to_report && !self.has_been_still(now);
        self.touchdown_noticed =
            may_rest && evidence.landed == Some(true) && (self.touchdown_noticed || notices_touchdown);
        let was_flying = self.flying;
        self.flying = self.judge(now);
        // A process that was just started does not know whether what it finds so low, in a landing or at rest, has touched the ground.
        let is_first = was_flying.is_none();
        let may_lift_off = evidence.armed != Some(false);
        // One that reports the ground while the vehicle moves far above it is stuck.
        let is_away = self.distance_m().is_some_and(|it| AWAY_FROM_GROUND_M < it);
        let moves = evidence.speed_m_s.is_some_and(|it| AT_REST_M_S <= it);
        let is_stuck = evidence.landed == Some(true) && is_away && moves;
        let notices = (self.noticed && !is_stuck) || evidence.landed == Some(false);
        self.noticed = self.flying == Some(true) && notices;
        // While it is armed it may be lifting off.
        let stands = self.flying == Some(false) && (!may_lift_off || was_flying != Some(false));
        if let Some(height_m) = evidence.height_m.filter(|_| stands) {
            self.ground_m = Ground(Some(height_m));
        }
        let is_below = |limit_m: f64| self.distance_m().is_some_and(|it| it < limit_m);
        let is_found_low = is_first && (evidence.lands || is_slow);
        let touches = (evidence.lands || may_rest) && is_below(TOUCHES_M);
        let comes_near = self.flying == Some(false) || is_found_low || touches;
        self.near_ground = is_below(AT_GROUND_M) && (self.near_ground || comes_near);
    }

    fn judge(&self, now: Time) -> Option<bool> {
        let Evidence { armed, landed, .. } = self.latest;
        let is_away = self.distance_m().map(|it| AWAY_FROM_GROUND_M < it);
        match (armed, landed, is_away) {
            (Some(false), Some(false), Some(true)) => Some(true),
            (Some(false), ..) => Some(false),
            (Some(true), _, Some(true)) => Some(!self.has_settled_elsewhere(now)),
            _ if self.has_settled_unnoticed(now) => Some(false),
            // A detector that has not noticed the flight does not notice its end either: near the ground, or where the
            // height is not known.
            (_, Some(true), _) if self.flying == Some(true) && !self.noticed => Some(!self.has_settled_here(now)),
            // One that is stuck while the vehicle climbs, or hovers at a metre, has noticed the flight as well.
            (_, Some(true), _) if self.flying == Some(true) => {
                Some(!self.may_have_landed() && !self.has_settled_elsewhere(now))
            }
            (_, Some(landed), _) => Some(!landed),
            (_, None, _) => self.flying,
        }
    }

    /// At rest in a landing at a height where it did not stand before, by a detector that has noticed the liftoff; where the mode is not
    /// known, by one that has noticed the touchdown, too.
    fn has_settled_elsewhere(&self, now: Time) -> bool {
        let has_rested = self.rests_for(now, SETTLED) || (self.touchdown_noticed && self.has_been_still(now));
        self.noticed && self.latest.landed == Some(true) && has_rested
    }

    /// At rest for long, in whatever mode, which is not known.
    fn has_been_still(&self, now: Time) -> bool {
        self.still_since.is_some_and(|since| SETTLED_UNNOTICED <= now - since)
    }

    /// In a landing that no longer comes down, whatever an estimate that drifts says of its way; or at rest at the height at which it stood
    /// before, in whatever mode. What is not known of height and speed says nothing against it.
    fn may_have_landed(&self) -> bool {
        let is_slow = |speed: Option<f64>| speed.is_none_or(|it| it < AT_REST_M_S);
        let is_low = self.distance_m().is_none_or(|it| it < AT_GROUND_M);
        let is_down = self.latest.lands && is_slow(self.latest.vertical_m_s);
        is_down || (is_slow(self.latest.speed_m_s) && is_low)
    }

    /// At rest in a landing at the height at which it stood before, as the detector says; or for longer, where the mode is not known.
    fn has_settled_here(&self, now: Time) -> bool {
        let has_rested = self.rests_for(now, SETTLED) || self.has_been_still(now);
        self.distance_m().is_some_and(|it| it < AT_GROUND_M) && has_rested
    }

    /// At rest in a landing at the height at which it stood before, although the detector does not say so.
    fn has_settled_unnoticed(&self, now: Time) -> bool {
        self.distance_m().is_some_and(|it| it < AT_GROUND_M) && self.rests_for(now, SETTLED_UNNOTICED)
    }

    fn rests_for(&self, now: Time, time: Duration) -> bool {
        self.at_rest_since.is_some_and(|since| time <= now - since)
    }

    fn distance_m(&self) -> Option<f64> {
        Some((self.latest.height_m? - self.ground_m.0?).abs())
    }
}

#[cfg(test)]
mod tests;
