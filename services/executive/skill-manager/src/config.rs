//! The skill manager's parameters.

use domain::quantity::{Number, Positive, Seconds};

/// The section `[skill_manager]`. Times are mission seconds where they belong to the flight, and keep
/// a wall-clock floor where they guard the machine; each says which.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Setpoints and proof of life per second of wall time. The autopilot needs 2 Hz by the
    /// reference and leaves offboard 1.0 s after the last one; 20 allows for lost samples.
    pub setpoint_rate_hz: Number<2, 1000>,
    /// Feedback messages per second of wall time while a skill executes.
    pub feedback_rate_hz: Positive,
    /// A command that is not acknowledged within this time counts as rejected. Guards the machine.
    /// Measured acknowledgements of a real autopilot take 1 to 20 ms, 390 ms at worst.
    pub ack_timeout_s: Seconds<50, 60_000>,
    /// A skill that ended in the air waits this long to be replaced before loiter is commanded.
    /// Guards the machine.
    pub loiter_after_s: Positive,
    /// How often that loiter is tried if it is not accepted.
    pub loiter_tries: u32,

    /// Position and velocity older than this are not used. Guards the machine; 123 Hz nominal.
    pub position_age_limit_s: Seconds<50, 10_000>,
    /// A vehicle status older than this is not used; three periods of 2 Hz, which keeps to the
    /// wall clock, and so does this.
    pub status_age_limit_s: Seconds<50, 10_000>,
    /// How long a request waits for the data that it depends on, in wall time. After that a takeoff
    /// fails, and every other skill is commanded: the autopilot judges it.
    pub data_wait_s: Positive,
    /// After an acknowledgement the vehicle's status must show the commanded mode within this wall
    /// time, or the skill fails: an autopilot may accept first and reject later.
    pub mode_timeout_s: Seconds<50, 60_000>,

    /// Closer than this is "at the target". A position step of a real quadrotor overshoots 1.7 m,
    /// then settles well below 0.5 m.
    pub position_tolerance_m: Positive,
    /// Slower than this is "speed near zero".
    pub speed_tolerance_m_s: Positive,
    /// Closer than this to its target height a takeoff is "at the target height".
    pub takeoff_tolerance_m: Positive,
    /// Slower than this up or down is "vertical speed near zero".
    pub climb_rate_tolerance_m_s: Positive,
    /// A takeoff that the autopilot ended by itself must be at its target height after this mission time.
    pub takeoff_settle_s: Positive,

    /// A load is released no farther than this from its place, over ground.
    pub release_distance_m: Positive,
    /// It must be seen released within this mission time, never less than one second of wall time.
    pub release_limit_s: Positive,
    /// A stop must have come to rest within this mission time, never less than one second of wall time.
    pub stop_limit_s: Positive,
    /// A landing must come down by `landing_least_descent_m` within this mission time, again and again until the land
    /// detector reports the ground; never less than one second of wall time.
    pub landing_stall_s: Positive,
    /// The same time for a landing on a target, which an autopilot may approach at its height first.
    pub landing_on_target_stall_s: Positive,
    /// By how much, in metres.
    pub landing_least_descent_m: Positive,
    /// The same time while the height is not known.
    pub landing_blind_s: Positive,

    /// The vehicle's own speed limit over ground; a flight is never expected to be faster.
    pub vehicle_speed_m_s: Positive,
    /// The vehicle's own limit upwards.
    pub vehicle_climb_m_s: Positive,
    /// The vehicle's own limit downwards.
    pub vehicle_descent_m_s: Positive,
    /// The vehicle's speed upwards in its takeoff mode.
    pub vehicle_takeoff_m_s: Positive,

    /// Answers to requests and outcomes of skills are remembered for this long (mission or wall
    /// time, whichever is longer), so that a retry finds its first answer.
    pub memory_s: Positive,
}
