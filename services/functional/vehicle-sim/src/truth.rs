//! What is true of the vehicle and of the world around it, for judges: nothing on board sees it.

use domain::fmu::TransponderReport;
use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;

use crate::VehicleSim;
use crate::frame::{ned, ned_velocity};
use crate::ground::Surface;

/// The world at one moment, in metres from the origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Where the vehicle is.
    pub position: Ned,
    /// Over ground.
    pub velocity: NedVelocity,
    /// Whether it stands on the ground.
    pub standing: bool,
    /// The height of the ground under it.
    pub ground_m: f64,
    /// What is there.
    pub surface: Surface,
    /// How often it has flown into something from the side.
    pub collisions: u32,
    /// The mean wind, where it blows to.
    pub wind: NedVelocity,
    /// Of the battery, 0 to 1.
    pub charge: f64,
    /// How many times what they should the cells give, the battery's losses included.
    pub drain: f64,
    /// Whether the gripper holds a load.
    pub holds_load: bool,
    /// All other traffic.
    pub traffic: Vec<TransponderReport>,
}

impl Truth {
    /// Above the ground under the vehicle.
    pub fn clearance_m(&self) -> f64 {
        self.position.height_m() - self.ground_m
    }
}

impl VehicleSim {
    /// As of the last step of the physics.
    pub fn truth(&self, now: Time) -> Truth {
        let body = &self.vehicle.body;
        let (ground_m, surface) = body.ground.at(body.position.x, body.position.y);
        Truth {
            position: ned(body.position),
            velocity: ned_velocity(body.velocity),
            standing: body.standing,
            ground_m,
            surface,
            collisions: body.collisions,
            wind: ned_velocity(self.vehicle.wind.mean()),
            charge: self.vehicle.battery.remaining(),
            drain: self.vehicle.battery.strain(),
            holds_load: self.vehicle.gripper.report() == domain::fmu::Gripper::Holding,
            traffic: self.traffic.reports(now).collect(),
        }
    }
}
