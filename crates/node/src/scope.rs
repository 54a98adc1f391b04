//! Where a node runs, and so what it gets.

use crate::VehicleId;

/// Where a node runs: on board one vehicle, or on the ground.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Scope {
    /// On board: speaks for this vehicle and gets only what concerns this vehicle.
    Vehicle(VehicleId),
    /// On the ground: gets what concerns any vehicle, and names a vehicle when it publishes or calls.
    Fleet,
}

impl Scope {
    /// The vehicle that a node of this scope belongs to; empty on the ground.
    pub fn vehicle(&self) -> VehicleId {
        match self {
            Scope::Vehicle(vehicle) => vehicle.clone(),
            Scope::Fleet => "".into(),
        }
    }

    /// The vehicle that an effect concerns which names `vehicle`. On board that is always the own vehicle.
    pub fn address(&self, vehicle: Option<VehicleId>) -> VehicleId {
        match (self, vehicle) {
            (Scope::Fleet, Some(vehicle)) => vehicle,
            _ => self.vehicle(),
        }
    }

    /// Whether a node of this scope gets what concerns `vehicle`.
    pub fn covers(&self, vehicle: &VehicleId) -> bool {
        match self {
            Scope::Vehicle(own) => own == vehicle,
            Scope::Fleet => true,
        }
    }
}
