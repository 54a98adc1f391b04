//! The level ground that a camera shows which looks straight down.
//!
//! A pinhole: the sensor and what it shows are the sides of similar triangles, so that one is to the other as the focal length is to
//! the height (Wolf, Dewitt, Wilkinson, Elements of Photogrammetry, 4th ed., chapter 6: the scale of a vertical photograph).

use serde::Deserialize;

use crate::quantity::Positive;

/// A camera, by the true figures of its data sheet: no equivalents of another format.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Across the flight.
    sensor_width_mm: Positive,
    /// Along the flight.
    sensor_height_mm: Positive,
    focal_length_mm: Positive,
}

impl Camera {
    /// The ground that a picture from this height above it shows, in metres: across the flight, and along it.
    pub fn footprint_m(&self, height_m: f64) -> [f64; 2] {
        [self.sensor_width_mm, self.sensor_height_mm].map(|it| it.get() * height_m / self.focal_length_mm.get())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_footprint_agrees_with_what_makers_and_other_programs_say() {
        #[track_caller]
        fn check(camera: &str, height_m: f64, pixels: [f64; 2], expected_cm: f64) {
            let camera: Camera = toml::from_str(camera).unwrap();
            let [across, along] = camera.footprint_m(height_m);
            for pixel_cm in [across / pixels[0] * 100.0, along / pixels[1] * 100.0] {
                assert!((pixel_cm / expected_cm - 1.0).abs() < 0.005, "{pixel_cm} cm, expected {expected_cm} cm");
            }
        }
        // DJI, specifications of the Phantom 4 RTK: a pixel shows H/36.5 cm from H metres.
        let phantom = "sensor_width_mm = 13.2\nsensor_height_mm = 8.8\nfocal_length_mm = 8.8";
        check(phantom, 100.0, [5472.0, 3648.0], 100.0 / 36.5);
        // DJI, specifications of the Zenmuse P1 with its lens of 35 mm: H/80 cm.
        let p1 = "sensor_width_mm = 35.9\nsensor_height_mm = 24.0\nfocal_length_mm = 35.0";
        check(p1, 60.0, [8192.0, 5460.0], 60.0 / 80.0);
    }
}
