//! What the values of a rule can be at all: a threshold beyond that is never reached, or always.

use super::rule::Quantity;

/// The least and the greatest value, and the unit in words.
pub(super) fn range(quantity: Quantity) -> (f64, f64, &'static str) {
    match quantity {
        Quantity::BatteryRemaining => (0.0, 1.0, "a share of the full battery, from 0 to 1"),
        Quantity::BatteryVoltage => (0.0, 1000.0, "volts, from 0 to 1000"),
        Quantity::BatteryTemperature => (-60.0, 150.0, "degrees Celsius, from -60 to 150"),
        Quantity::HorizontalAccuracy | Quantity::VerticalAccuracy => (0.0, 10_000.0, "metres, from 0 to 10000"),
        Quantity::Height => (-1000.0, 20_000.0, "metres, from -1000 to 20000"),
        Quantity::DistanceHome => (0.0, 1_000_000.0, "metres, from 0 to 1000000"),
        Quantity::GroundSpeed => (0.0, 300.0, "metres per second, from 0 to 300"),
        Quantity::TouchdownSpeed => (0.0, 100.0, "metres per second, from 0 to 100"),
        Quantity::Tilt => (0.0, std::f64::consts::PI, "radians, from 0 to 3.14"),
    }
}
