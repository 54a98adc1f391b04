//! Watches from outside that what must never happen does not.

use std::collections::BTreeMap;
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
    /// The vehicle entered an area without a permission that was valid; from the ground into the air is entering.
    Entered {
        /// When.
        at: Time,
        /// Which area.
        area: String,
        /// How the permission stood.
        permission: v1::PermissionState,
    },
    /// The area opened round the vehicle, or its permission ended, and the vehicle did not leave it.
    Stayed {
        /// When it should have been out at the latest.
        at: Time,
        /// Which area.
        area: String,
    },
    /// The vehicle left the ground after the mission was over, or in answer to a flag.
    TookOff {
        /// When.
        at: Time,
    },
    /// The vehicle is in the air and nothing brings it down or anywhere.
    NoResponder {
        /// When.
        at: Time,
        /// What the mission manager says it does.
        phase: v1::MissionPhase,
    },
}

/// A takeoff that was under way when a flag rose may still lift off within this time.
const UNDER_WAY: Duration = Duration::from_secs(3);
/// In the air after the end of the mission without a response. (A landing is seen by the land detector once a second.)
const LONGEST_WITHOUT_RESPONSE: Duration = Duration::from_secs(10);
/// In one place without a response and without an operator's pause: longer than the planner holds for a permission.
const LONGEST_HOVER: Duration = Duration::from_secs(200);
/// Moving less than this is hovering.
const HOVER_RADIUS_M: f64 = 5.0;
/// Time to notice that an area must be left, on a busy machine, and the slowest that the way to its border is flown.
const NOTICE: Duration = Duration::from_secs(20);
const LEAVING_M_S: f64 = 1.0;

/// Knows the areas and permissions as everybody hears of them, and where the vehicle says it is.
#[derive(Debug, Default)]
pub(crate) struct Witness {
    pub(crate) breaches: Vec<Breach>,
    areas: Vec<Area>,
    permissions: BTreeMap<String, v1::Permission>,
    inside: BTreeMap<String, Inside>,
    manager: v1::McmStatus,
    /// A flag is answered since then.
    answering: Option<Time>,
    /// The mission is over, the vehicle flies and nothing responds, since then.
    unattended: Option<Time>,
    hover: Option<(Ned, Time)>,
    /// As the land detector says; before its first message the vehicle stands on the ground.
    airborne: bool,
    armed: bool,
}

/// How the vehicle is inside an area.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Inside {
    Permitted,
    /// Not any more: it must be out by then.
    Leaves(Time),
    Reported,
}

impl Witness {
    pub(crate) fn take_in(&mut self, at: Time, message: &Message) {
        match message {
            Message::PlannerStatus(it) => {
                self.areas = it.areas.iter().cloned().filter_map(|it| it.try_into().ok()).collect();
            }
            Message::PermissionLedger(it) => {
                self.permissions.extend(it.permissions.iter().map(|it| (it.area.clone(), it.clone())));
            }
            Message::McmStatus(it) => {
                self.manager = it.clone();
                self.answering = (!it.acting.is_empty()).then(|| self.answering.unwrap_or(at));
            }
            Message::VehicleLandDetected(it) => {
                let answers = self.answering.is_some_and(|since| since + UNDER_WAY < at);
                if !self.airborne && !it.landed && (self.manager.report.is_some() || answers) {
                    self.breaches.push(Breach::TookOff { at });
                }
                self.airborne = !it.landed;
            }
            Message::VehicleStatus(it) => self.armed = it.armed,
            Message::VehicleLocalPosition(it) => {
                if let Some(Ok(position)) = it.position.map(Ned::try_from) {
                    self.moved(at, position);
                    self.attended(at, position);
                }
            }
            _ => {}
        }
    }

    /// With its motors off the vehicle does not fly, although its land detector has fallen silent.
    fn flies(&self) -> bool {
        self.airborne && self.armed
    }

    /// From the ground into the air is entering.
    fn moved(&mut self, at: Time, position: Ned) {
        if !self.flies() {
            self.inside.clear();
            return;
        }
        let utc_ms = UTC_START_MS + at.since_start().as_millis() as i64;
        let lands = self.manager.skill() == v1::SkillKind::Land;
        for area in &self.areas {
            if !area.is_active(utc_ms) || !area.contains(position) {
                self.inside.remove(&area.name);
                continue;
            }
            let permission = self.permissions.get(&area.name);
            let is_valid =
                |it: &v1::Permission| it.state() == v1::PermissionState::Granted && utc_ms < it.expires_utc_ms;
            let permitted = area.kind == AreaKind::Permission && permission.is_some_and(is_valid);
            let opened_here = area.from_utc_ms.is_some_and(|it| (utc_ms - 1_000..=utc_ms).contains(&it));
            let leave_by = || {
                let way_out = Duration::from_secs_f64(area.distance_to_border_m(position) / LEAVING_M_S);
                Inside::Leaves(at + NOTICE + way_out)
            };
            let now = match self.inside.get(&area.name) {
                _ if permitted => Inside::Permitted,
                None if !opened_here => {
                    let permission = permission.map(v1::Permission::state).unwrap_or_default();
                    self.breaches.push(Breach::Entered { at, area: area.name.clone(), permission });
                    Inside::Reported
                }
                None | Some(Inside::Permitted) => leave_by(),
                // Down where it is comes before out of there.
                Some(Inside::Leaves(by)) if *by < at && !lands => {
                    self.breaches.push(Breach::Stayed { at, area: area.name.clone() });
                    Inside::Reported
                }
                Some(before) => *before,
            };
            self.inside.insert(area.name.clone(), now);
        }
    }

    /// Somebody must be bringing the vehicle down, or anywhere, as long as it flies.
    fn attended(&mut self, at: Time, position: Ned) {
        let responds = !self.flies() || !self.manager.acting.is_empty();
        let phase = self.manager.phase();
        let is_over = matches!(phase, v1::MissionPhase::Ending | v1::MissionPhase::Over);
        self.unattended = (is_over && !responds).then(|| self.unattended.unwrap_or(at));
        let rests = |(place, _): &(Ned, Time)| place.distance_m(position) < HOVER_RADIUS_M;
        self.hover = (!responds).then(|| self.hover.filter(rests).unwrap_or((position, at)));
        let unattended = self.unattended.is_some_and(|since| since + LONGEST_WITHOUT_RESPONSE < at);
        let hovers = self.hover.is_some_and(|(_, since)| since + LONGEST_HOVER < at);
        if unattended || hovers {
            self.breaches.push(Breach::NoResponder { at, phase });
            (self.unattended, self.hover) = (None, None);
        }
    }
}
