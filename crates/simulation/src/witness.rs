//! Watches from outside that what must never happen does not.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::virtual_bus::UTC_START_MS;

/// Something that must never happen.
#[derive(Debug, Clone, PartialEq)]
pub enum Breach {
    /// The vehicle entered an area without a permission that was valid.
    Entered {
        /// When.
        at: Time,
        /// Which area.
        area: String,
        /// How the permission stood.
        permission: v1::PermissionState,
    },
    /// The vehicle left the ground after the mission was over, or in answer to a flag.
    TookOff {
        /// When.
        at: Time,
    },
}

/// A takeoff that was under way when a flag rose may still lift off within so long.
const UNDER_WAY: Duration = Duration::from_secs(3);

/// Knows the areas and permissions as everybody is told, and where the vehicle says it is.
#[derive(Debug, Default)]
pub(crate) struct Witness {
    pub(crate) breaches: Vec<Breach>,
    areas: Vec<Area>,
    permissions: BTreeMap<String, v1::PermissionState>,
    inside: BTreeSet<String>,
    is_over: bool,
    /// A flag is answered since then.
    answering: Option<Time>,
    /// As the land detector says; before it has said anything the vehicle stands on the ground.
    airborne: bool,
}

impl Witness {
    pub(crate) fn take_in(&mut self, at: Time, message: &Message) {
        match message {
            Message::PlannerStatus(it) => {
                self.areas = it.areas.iter().cloned().filter_map(|it| it.try_into().ok()).collect();
            }
            Message::PermissionLedger(it) => {
                self.permissions.extend(it.permissions.iter().map(|it| (it.area.clone(), it.state())));
            }
            Message::McmStatus(it) => {
                self.is_over |= it.report.is_some();
                self.answering = (!it.acting.is_empty()).then(|| self.answering.unwrap_or(at));
            }
            Message::VehicleLandDetected(it) => {
                let answers = self.answering.is_some_and(|since| since + UNDER_WAY < at);
                if !self.airborne && !it.landed && (self.is_over || answers) {
                    self.breaches.push(Breach::TookOff { at });
                }
                self.airborne = !it.landed;
            }
            Message::VehicleLocalPosition(it) => {
                if let Some(Ok(position)) = it.position.map(Ned::try_from) {
                    self.moved(at, position);
                }
            }
            _ => {}
        }
    }

    /// From the ground into the air is entering.
    fn moved(&mut self, at: Time, position: Ned) {
        if !self.airborne {
            self.inside.clear();
            return;
        }
        let utc_ms = UTC_START_MS + at.since_start().as_millis() as i64;
        for area in self.areas.iter().filter(|it| it.is_active(utc_ms)) {
            if !area.contains(position) {
                self.inside.remove(&area.name);
            } else if self.inside.insert(area.name.clone()) {
                let permission = self.permissions.get(&area.name).copied().unwrap_or_default();
                if area.kind == AreaKind::KeepOut || permission != v1::PermissionState::Granted {
                    self.breaches.push(Breach::Entered { at, area: area.name.clone(), permission });
                }
            }
        }
    }
}
