//! A skill manager on a virtual clock, with a small autopilot below it.

pub(crate) mod autopilot;
pub(crate) mod rig;

/// The shipped values.
pub(crate) const CONFIG: &str = r#"
setpoint_rate_hz = 20.0
feedback_rate_hz = 10.0
ack_timeout_s = 1.0
loiter_after_s = 0.2
loiter_tries = 3
position_age_limit_s = 0.5
status_age_limit_s = 1.5
data_wait_s = 1.5
mode_timeout_s = 3.0
position_tolerance_m = 1.0
speed_tolerance_m_s = 0.3
takeoff_tolerance_m = 0.5
climb_rate_tolerance_m_s = 0.3
takeoff_settle_s = 5.0
release_distance_m = 5.0
release_limit_s = 5.0
stop_limit_s = 10.0
landing_stall_s = 10.0
landing_on_target_stall_s = 30.0
landing_least_descent_m = 0.5
landing_blind_s = 240.0
vehicle_speed_m_s = 12.0
vehicle_climb_m_s = 3.0
vehicle_descent_m_s = 1.5
vehicle_takeoff_m_s = 1.5
memory_s = 300.0
"#;
