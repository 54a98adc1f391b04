//! What PX4's failsafe flags say: failures in the vocabulary, and reasons in words.

use domain::fmu::Failure;

use crate::cdr::{CdrError, Record};
use crate::modes::NavState;

/// What a flag means. With a mask of modes it matters only in those.
struct Meaning {
    flag: &'static str,
    modes: Option<&'static str>,
    words: &'static str,
}

const fn always(flag: &'static str, words: &'static str) -> Meaning {
    Meaning { flag, modes: None, words }
}

const fn in_modes(flag: &'static str, modes: &'static str, words: &'static str) -> Meaning {
    Meaning { flag, modes: Some(modes), words }
}

/// The flags of `failsafe_flags`, in the order of their reasons.
const MEANINGS: &[Meaning] = &[
    always("fd_critical_failure", "the attitude is out of control"),
    always("fd_motor_failure", "a motor has failed"),
    always("fd_esc_arming_failure", "a motor controller does not arm"),
    always("fd_imbalanced_prop", "a propeller is out of balance"),
    always("battery_unhealthy", "the battery is faulty"),
    always("battery_low_remaining_time", "the battery lasts no longer than the way home"),
    always("geofence_breached", "the geofence is breached"),
    always("wind_limit_exceeded", "the wind is too strong"),
    always("flight_time_limit_exceeded", "the flight took too long"),
    always("position_accuracy_low", "the position is inaccurate"),
    always("navigator_failure", "its navigator has failed"),
    always("mission_failure", "its own mission cannot be flown"),
    in_modes("offboard_control_signal_lost", "mode_req_offboard_signal", "there are no fresh offboard setpoints"),
    in_modes("attitude_invalid", "mode_req_attitude", "the attitude is not known"),
    in_modes("angular_velocity_invalid", "mode_req_angular_velocity", "the turn rates are not known"),
    in_modes("local_altitude_invalid", "mode_req_local_alt", "the height is not known"),
    in_modes("local_position_invalid", "mode_req_local_position", "the position is not known"),
    in_modes("local_position_invalid_relaxed", "mode_req_local_position_relaxed", "the position is not known"),
    in_modes("global_position_invalid", "mode_req_global_position", "the global position is not known"),
    in_modes("global_position_invalid_relaxed", "mode_req_global_position_relaxed", "the global position is not known"),
    in_modes("home_position_invalid", "mode_req_home_position", "the home position is not known"),
    in_modes("auto_mission_missing", "mode_req_mission", "it has no mission of its own"),
    in_modes("manual_control_signal_lost", "mode_req_manual_control", "there is no manual control"),
];

/// The levels of `battery_warning` from which on it counts, and their words.
const BATTERY: [(u64, &str); 3] =
    [(3, "the battery is nearly empty"), (2, "the battery is critical"), (1, "the battery is low")];
const BATTERY_CRITICAL: u64 = 2;

/// The newest flags.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Health {
    /// The failures that hold in any mode.
    failures: Vec<Failure>,
    offboard_lost: bool,
    /// What each true flag means: the modes that it matters in, and the words.
    reasons: Vec<(u32, &'static str)>,
    /// A ground station was there since PX4 was started: only then can it be lost.
    had_ground: bool,
}

impl Health {
    /// Takes in the flags.
    ///
    /// # Errors
    /// If this version of them lacks one.
    pub(crate) fn read(&mut self, flags: &Record<'_>) -> Result<(), CdrError> {
        let is = |name| flags.flag(name);
        let ground_lost = is("gcs_connection_lost")?;
        let battery = flags.unsigned("battery_warning")?;
        let estimator = is("local_position_invalid")? || is("local_altitude_invalid")? || is("attitude_invalid")?;
        let had_ground = self.had_ground || !ground_lost;
        let failures = [
            (is("global_position_invalid")?, Failure::GnssLost),
            (estimator, Failure::Estimator),
            (is("fd_motor_failure")? || is("fd_critical_failure")?, Failure::Motor),
            (BATTERY_CRITICAL <= battery || is("battery_unhealthy")?, Failure::Battery),
            (had_ground && ground_lost, Failure::GroundLinkLost),
        ];
        let mut reasons = Vec::new();
        for Meaning { flag, modes, words } in MEANINGS {
            if is(flag)? {
                let modes = modes.map_or(Ok(u64::from(u32::MAX)), |it| flags.unsigned(it))?;
                reasons.push((modes as u32, *words));
            }
        }
        reasons.extend(BATTERY.iter().find(|(level, _)| *level <= battery).map(|(_, words)| (u32::MAX, *words)));
        if had_ground && ground_lost {
            reasons.push((u32::MAX, "its ground station is not heard"));
        }
        *self = Health {
            failures: failures.into_iter().filter_map(|(holds, failure)| holds.then_some(failure)).collect(),
            offboard_lost: is("offboard_control_signal_lost")?,
            reasons,
            had_ground,
        };
        Ok(())
    }

    /// The failures while this mode is intended, and a failsafe flies or does not: without one, setpoints that begin together with
    /// the mode are not noticed yet.
    pub(crate) fn failures(&self, intended: NavState, failsafe: bool) -> Vec<Failure> {
        let lost = self.offboard_lost && failsafe && intended == NavState::OFFBOARD;
        lost.then_some(Failure::OffboardSignalLost).into_iter().chain(self.failures.iter().copied()).collect()
    }

    /// What is wrong for this mode, in words; empty if nothing is.
    pub(crate) fn reasons(&self, mode: NavState) -> String {
        let bit = 1_u32.checked_shl(u32::from(mode.0)).unwrap_or(0);
        let mut words: Vec<_> = self.reasons.iter().filter(|(modes, _)| modes & bit != 0).map(|it| it.1).collect();
        words.dedup();
        words.join(", ")
    }
}
