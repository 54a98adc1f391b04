//! Whether the vehicle hovers over a place, for the skills that do something there.

use domain::fmu::FlightMode;
use domain::geometry::Ned;

use super::Ready;
use crate::config::Config;
use crate::vehicle::{FlightStatus, View};

/// How near to a place, and how slow, the vehicle must be.
#[derive(Debug)]
pub(super) struct Hover {
    over: Ned,
    distance_m: f64,
    speed_tolerance_m_s: f64,
}

impl Hover {
    pub(super) fn new(over: Ned, config: &Config) -> Hover {
        let (distance_m, speed_tolerance_m_s) = (config.release_distance_m.get(), config.speed_tolerance_m_s.get());
        Hover { over, distance_m, speed_tolerance_m_s }
    }

    /// The status of a vehicle that hovers, wherever that is.
    ///
    /// # Errors
    /// Why it is not known to hover.
    pub(super) fn status(view: &View) -> Result<FlightStatus, Ready> {
        let Some(status) = view.status else { return Err(Ready::Require("status")) };
        if view.flying == Some(true) && status.is_in(FlightMode::Loiter) {
            return Ok(status);
        }
        let mode = status.actual.map_or_else(|| "one without a name here".to_owned(), |it| it.to_string());
        Err(Ready::Refuse(format!("the vehicle does not hover: its mode is {mode}")))
    }

    /// Whether it is at rest over the place.
    pub(super) fn ready(&self, view: &View) -> Ready {
        let Some(motion) = view.motion else { return Ready::Require("position") };
        let apart_m = motion.position.horizontal_distance_m(self.over);
        let speed_m_s = motion.velocity.speed_m_s();
        if self.distance_m < apart_m {
            Ready::Refuse(format!("the vehicle is {apart_m:.1} m from the place"))
        } else if self.speed_tolerance_m_s < speed_m_s {
            Ready::Refuse(format!("the vehicle still moves at {speed_m_s:.1} m/s"))
        } else {
            Ready::Command
        }
    }
}
