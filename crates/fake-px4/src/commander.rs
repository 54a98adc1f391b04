//! The commander: which mode is intended, which flies, and what is refused.

use std::time::Duration;

use domain::fmu::{Command, Setpoint};
use domain::geometry::Ned;
use domain::time::Time;
use kittiwake_proto::v1;
use px4_bridge::modes::NavState;

use crate::FakePx4;

/// The last setpoint is older (`COM_OF_LOSS_T`).
pub(crate) const OFFBOARD_LOSS: Duration = Duration::from_secs(1);
/// A failsafe holds for this long before it acts (`COM_FAIL_ACT_T`).
const HOLD_FIRST: Duration = Duration::from_secs(5);
/// The height of a return (`RTL_RETURN_ALT` is 30 m in SITL), its speed, and how near home it lands.
const RETURN_HEIGHT_M: f64 = 30.0;
const RETURN_M_S: f64 = 8.0;
const HOME_M: f64 = 2.0;

const ACCEPTED: u8 = 0;
const TEMPORARILY_REJECTED: u8 = 1;
const UNSUPPORTED: u8 = 3;

/// In these it does not arm, and once it has disarmed the mode from before comes back.
fn lands(mode: NavState) -> bool {
    mode == NavState::LAND || mode == NavState::PRECISION_LAND
}

#[derive(Debug)]
pub(crate) struct Commander {
    pub(crate) intended: NavState,
    pub(crate) actual: NavState,
    /// The mode from before a landing, which comes back with the disarming.
    pub(crate) before_landing: NavState,
    pub(crate) failsafe: bool,
    pub(crate) takeoff_m: f64,
    pub(crate) alive_at: Option<Time>,
    pub(crate) setpoint: Option<(Time, Setpoint)>,
    pub(crate) battery_warning: u8,
    pub(crate) fence_m: Option<f64>,
    /// What it flies without setpoints (`COM_OBL_RC_ACT`).
    pub(crate) without_setpoints: NavState,
    pub(crate) breached: bool,
    /// Where its frame begins in the body's.
    pub(crate) offset: Ned,
    /// Since when the battery calls for a failsafe.
    pub(crate) battery_since: Option<Time>,
    /// A return that is above home lands.
    pub(crate) returns_down: bool,
    /// What the body was told to do for the mode that flies.
    pub(crate) ordered: Option<NavState>,
    pub(crate) was_armed: bool,
}

impl Default for Commander {
    fn default() -> Commander {
        Commander {
            intended: NavState::LOITER,
            actual: NavState::LOITER,
            before_landing: NavState::LOITER,
            failsafe: false,
            takeoff_m: 0.0,
            alive_at: None,
            setpoint: None,
            battery_warning: 0,
            fence_m: None,
            without_setpoints: NavState::RETURN,
            breached: false,
            offset: Ned::new(0.0, 0.0, 0.0),
            battery_since: None,
            returns_down: false,
            ordered: None,
            was_armed: false,
        }
    }
}

impl Commander {
    /// Somebody selects a mode.
    pub(crate) fn select(&mut self, mode: NavState) {
        if lands(mode) && !lands(self.intended) {
            self.before_landing = self.intended;
        }
        self.intended = mode;
        // A selection clears the failsafes that wait for one.
        self.breached = false;
        self.battery_since = None;
    }
}

impl FakePx4 {
    /// Carries out a command, with its parameters 1, 2, 3 and 7; returns the result.
    pub(crate) fn command(&mut self, number: u64, [p1, p2, p3, p7]: [f64; 4]) -> u8 {
        let (armed, fresh) = (self.is_armed(), self.is_fresh());
        match number {
            176 => {
                let mode = match (p2 as u8, p3 as u8) {
                    (6, _) => NavState::OFFBOARD,
                    (4, 3) => NavState::LOITER,
                    (4, 5) => NavState::RETURN,
                    (4, 9) => NavState::PRECISION_LAND,
                    (3, _) => NavState(2),
                    _ => return UNSUPPORTED,
                };
                if mode == NavState::OFFBOARD && armed && !fresh {
                    return TEMPORARILY_REJECTED;
                }
                self.commander.select(mode);
                ACCEPTED
            }
            400 if p1 == 1.0 => {
                if !armed && !self.checks_pass() {
                    return TEMPORARILY_REJECTED;
                }
                self.order(Command::Arm);
                ACCEPTED
            }
            400 => {
                if self.newest.landed.landed || !armed {
                    self.order(Command::Disarm);
                    ACCEPTED
                } else {
                    TEMPORARILY_REJECTED
                }
            }
            22 => {
                let origin_m = self.newest.status.origin.and_then(|it| it.altitude_amsl_m).unwrap_or_default();
                self.commander.takeoff_m = p7 - origin_m;
                self.commander.select(NavState::TAKEOFF);
                ACCEPTED
            }
            21 => {
                self.commander.select(NavState::LAND);
                ACCEPTED
            }
            _ => UNSUPPORTED,
        }
    }

    /// Whether it would arm in the mode of the moment.
    pub(crate) fn checks_pass(&self) -> bool {
        let suits = match self.commander.intended {
            it if lands(it) => false,
            NavState::OFFBOARD => self.is_fresh(),
            _ => true,
        };
        suits && self.knows_position() && self.commander.battery_warning < 2
    }

    /// Decides which mode flies, has the body fly it, and reports it.
    pub(crate) fn review(&mut self) {
        let armed = self.is_armed();
        let body = self.newest.status.clone();
        if self.commander.was_armed && !armed && lands(self.commander.intended) {
            self.commander.intended = self.commander.before_landing;
        }
        self.commander.was_armed = armed;
        let takeoff_ended = self.commander.ordered == Some(NavState::TAKEOFF)
            && body.intended_mode() == v1::FlightMode::Loiter
            && armed;
        if takeoff_ended && self.commander.intended == NavState::TAKEOFF {
            self.commander.intended = NavState::LOITER;
        }
        let other = if armed { self.failsafe() } else { None };
        self.commander.failsafe = other.is_some();
        self.commander.actual = other.unwrap_or(self.commander.intended);
        if armed {
            self.fly();
        } else {
            self.commander.ordered = None;
            self.commander.returns_down = false;
        }
        self.report_status();
    }

    /// The mode that a failsafe flies in place of the intended one.
    fn failsafe(&mut self) -> Option<NavState> {
        let now = self.now;
        let at = self.newest.position.position.unwrap_or_default();
        if self.commander.fence_m.is_some_and(|it| it < at.north_m.hypot(at.east_m)) {
            self.commander.breached = true;
        }
        let since = *self.commander.battery_since.get_or_insert(now);
        let battery = match self.commander.battery_warning {
            0 | 1 => {
                self.commander.battery_since = None;
                None
            }
            _ if now - since < HOLD_FIRST => Some(NavState::LOITER),
            2 => Some(NavState::RETURN),
            _ => Some(NavState::LAND),
        };
        let lost = self.commander.intended == NavState::OFFBOARD && !self.is_fresh();
        let lands = lands(self.commander.intended);
        let fence = self.commander.breached.then_some(NavState::LOITER);
        // "Already landing": nothing weaker than a landing is flown instead.
        battery
            .or(lost.then_some(self.commander.without_setpoints))
            .or(fence)
            .filter(|it| !lands || *it == NavState::LAND)
    }

    fn fly(&mut self) {
        let (actual, ordered) = (self.commander.actual, self.commander.ordered);
        let streams = match actual {
            NavState::OFFBOARD => self.commander.setpoint.map(|it| it.1),
            NavState::RETURN => self.return_home(),
            _ => None,
        };
        if let Some(setpoint) = streams {
            self.fly_to(setpoint);
        }
        if actual != NavState::RETURN {
            self.commander.returns_down = false;
        }
        if ordered == Some(actual) {
            return;
        }
        self.commander.ordered = Some(actual);
        match actual {
            NavState::TAKEOFF => self.order(Command::Takeoff { height_m: self.commander.takeoff_m }),
            NavState::LAND | NavState::DESCEND => self.order(Command::Land),
            NavState::PRECISION_LAND => self.order(Command::LandOnTarget),
            NavState::OFFBOARD | NavState::RETURN => self.order(Command::Offboard),
            _ => self.order(Command::Loiter),
        }
    }

    /// The way home: up, across, and down.
    fn return_home(&mut self) -> Option<Setpoint> {
        let at = self.newest.position.position.unwrap_or_default();
        let speed_limit_m_s = Some(RETURN_M_S);
        if self.commander.returns_down {
            return None;
        }
        let from_home_m = at.north_m.hypot(at.east_m);
        let height_m = RETURN_HEIGHT_M.max(-at.down_m);
        if from_home_m < HOME_M {
            self.commander.returns_down = true;
            self.order(Command::Land);
            return None;
        }
        let target = if -at.down_m < RETURN_HEIGHT_M - 1.0 {
            Ned::new(at.north_m, at.east_m, -height_m)
        } else {
            Ned::new(0.0, 0.0, -height_m)
        };
        Some(Setpoint::Position { target, speed_limit_m_s, yaw_rad: None })
    }
}
