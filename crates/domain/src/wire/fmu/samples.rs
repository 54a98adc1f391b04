//! Valid values of every type, drawn at random.

use std::ops::Range;

use proptest::prelude::*;

use crate::fmu::{
    Attitude, Battery, Command, CommandAck, CommandId, CommandResult, FailsafeReason, Failure, FlightMode,
    GlobalPosition, Gripper, LandDetected, LocalPosition, OffboardControl, Setpoint, Status, TrafficKind,
    TransponderReport, VehicleCommand, Wind,
};
use crate::geometry::{Ned, NedVelocity};

const FAR: Range<f64> = -1e6..1e6;
const FAST: Range<f64> = -1e3..1e3;
const ANGLE: Range<f64> = -7.0..7.0;
const DEVIATION: Range<f64> = 0.0..1e6;

fn position() -> impl Strategy<Value = Ned> {
    (FAR, FAR, FAR).prop_map(|(north_m, east_m, down_m)| Ned::new(north_m, east_m, down_m))
}

fn velocity() -> impl Strategy<Value = NedVelocity> {
    (FAST, FAST, FAST).prop_map(|(north_m_s, east_m_s, down_m_s)| NedVelocity::new(north_m_s, east_m_s, down_m_s))
}

fn mode() -> impl Strategy<Value = Option<FlightMode>> {
    use FlightMode::{Land, Loiter, Offboard, Return, Takeoff};
    prop::option::of(prop::sample::select(vec![Loiter, Takeoff, Land, Offboard, Return]))
}

pub(super) fn command() -> impl Strategy<Value = VehicleCommand> {
    let command = prop_oneof![
        Just(Command::Arm),
        Just(Command::Disarm),
        FAR.prop_map(|height_m| Command::Takeoff { height_m }),
        Just(Command::Land),
        Just(Command::LandOnTarget),
        Just(Command::Loiter),
        Just(Command::Offboard),
        Just(Command::Release),
    ];
    (any::<u64>(), command).prop_map(|(id, command)| VehicleCommand { id: CommandId(id), command })
}

pub(super) fn ack() -> impl Strategy<Value = CommandAck> {
    let rejected = any::<String>().prop_map(|reason| CommandResult::Rejected { reason });
    let result = prop_oneof![Just(CommandResult::Accepted), rejected];
    (any::<u64>(), result).prop_map(|(id, result)| CommandAck { id: CommandId(id), result })
}

pub(super) fn control() -> impl Strategy<Value = OffboardControl> {
    prop_oneof![Just(OffboardControl::Position), Just(OffboardControl::Velocity)]
}

pub(super) fn setpoint() -> impl Strategy<Value = Setpoint> {
    let (speed_limit, yaw, yaw_rate) = (prop::option::of(0.1..50.0), prop::option::of(ANGLE), prop::option::of(ANGLE));
    prop_oneof![
        (position(), speed_limit, yaw).prop_map(|(target, speed_limit_m_s, yaw_rad)| Setpoint::Position {
            target,
            speed_limit_m_s,
            yaw_rad
        }),
        (velocity(), yaw_rate).prop_map(|(velocity, yaw_rate_rad_s)| Setpoint::Velocity { velocity, yaw_rate_rad_s }),
    ]
}

pub(super) fn status() -> impl Strategy<Value = Status> {
    use Failure::{Battery, Estimator, GnssLost, GroundLinkLost, Motor, OffboardSignalLost};
    let failure = prop::sample::select(vec![OffboardSignalLost, GnssLost, Estimator, Motor, Battery, GroundLinkLost]);
    let origin = prop::option::of(crate::wire::generators::origin());
    let gripper = prop::option::of(prop::sample::select(vec![Gripper::Holding, Gripper::Released, Gripper::Silent]));
    let known = (any::<bool>(), mode(), mode(), any::<bool>(), prop::collection::vec(failure, 0..4), origin, gripper);
    let vibration_m_s2 = prop::option::of(0.0..100.0);
    let told = (any::<bool>(), "[a-z ]{0,8}", any::<Option<bool>>(), any::<u64>(), vibration_m_s2, any::<u64>());
    let reason = prop::option::of(prop::sample::select(vec![FailsafeReason::Setpoints, FailsafeReason::Other]));
    (known, told, reason, any::<Option<bool>>()).prop_map(
        |(
            (armed, intended, actual, failsafe, failures, origin, gripper),
            (commanded_by_other, reason, can_arm, frame_epoch, vibration_m_s2, timestamp_us),
            failsafe_reason,
            landing_target_seen,
        )| Status {
            armed,
            intended,
            actual,
            failsafe,
            failures,
            origin,
            gripper,
            landing_target_seen,
            commanded_by_other,
            reason,
            can_arm,
            frame_epoch,
            vibration_m_s2,
            failsafe_reason,
            timestamp_us,
        },
    )
}

pub(super) fn attitude() -> impl Strategy<Value = Attitude> {
    let rotation = (-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.1..1.0);
    (rotation, ANGLE, ANGLE, ANGLE).prop_map(
        |((x, y, z, w), roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s): ((f64, f64, f64, f64), _, _, _)| {
            let length = (x * x + y * y + z * z + w * w).sqrt();
            let [q_w, q_x, q_y, q_z] = [w, x, y, z].map(|it| it / length);
            Attitude { q_w, q_x, q_y, q_z, roll_rate_rad_s, pitch_rate_rad_s, yaw_rate_rad_s }
        },
    )
}

pub(super) fn local_position() -> impl Strategy<Value = LocalPosition> {
    let valid = (any::<bool>(), any::<bool>());
    (position(), velocity(), ANGLE, valid, DEVIATION, DEVIATION, any::<u64>()).prop_map(
        |(position, velocity, heading_rad, (horizontal_valid, vertical_valid), eph_m, epv_m, timestamp_us)| {
            LocalPosition {
                position,
                velocity,
                heading_rad,
                horizontal_valid,
                vertical_valid,
                eph_m,
                epv_m,
                timestamp_us,
            }
        },
    )
}

pub(super) fn global_position() -> impl Strategy<Value = GlobalPosition> {
    (-90.0..90.0, -180.0..180.0, FAR, DEVIATION, DEVIATION).prop_map(
        |(latitude_deg, longitude_deg, altitude_amsl_m, eph_m, epv_m)| GlobalPosition {
            latitude_deg,
            longitude_deg,
            altitude_amsl_m,
            eph_m,
            epv_m,
        },
    )
}

pub(super) fn land_detected() -> impl Strategy<Value = LandDetected> {
    (any::<bool>(), any::<bool>(), any::<u64>()).prop_map(|(landed, ground_contact, timestamp_us)| LandDetected {
        landed,
        ground_contact,
        timestamp_us,
    })
}

pub(super) fn battery() -> impl Strategy<Value = Battery> {
    let (current_a, temperature_c) = (proptest::option::of(FAR), proptest::option::of(-273.0..1e3));
    (0.0..1e4, current_a, 0.0..=1.0, temperature_c).prop_map(|(voltage_v, current_a, remaining, temperature_c)| {
        Battery { voltage_v, current_a, remaining, temperature_c }
    })
}

pub(super) fn wind() -> impl Strategy<Value = Wind> {
    (FAST, FAST).prop_map(|(north_m_s, east_m_s)| Wind { north_m_s, east_m_s })
}

pub(super) fn transponder_report() -> impl Strategy<Value = TransponderReport> {
    let kind = prop::sample::select(vec![TrafficKind::Crewed, TrafficKind::Uncrewed, TrafficKind::Vessel]);
    ("[a-z0-9-]{1,12}", position(), velocity(), kind).prop_map(|(id, position, velocity, kind)| TransponderReport {
        id,
        position,
        velocity,
        kind,
    })
}
