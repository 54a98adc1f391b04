//! Watches from outside that what must never happen does not.
//!
//! It knows no service and trusts none: it hears the areas, the permissions and what the mission manager says it does, as
//! everybody does, and judges by where the simulated vehicle is. It reads no clock, so that it looks on in `simulation`'s
//! virtual time as in the real time of a campaign.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use domain::area::{Area, AreaKind};
use domain::fmu::Status;
use domain::geometry::Ned;
use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use others::Others;

pub mod modes;
mod others;
pub mod setpoints;
pub mod true_time;

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
    /// A command or a setpoint was sent while somebody else flew the vehicle, and no operator had ordered that.
    Fought {
        /// When.
        at: Time,
    },
    /// A flight that the autopilot had begun by a failsafe of its own was ended by a command other than to land where the vehicle is, and
    /// no operator had ordered that since.
    EndedFailsafe {
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

impl Breach {
    /// When.
    pub fn at(&self) -> Time {
        match self {
            Breach::Entered { at, .. }
            | Breach::Stayed { at, .. }
            | Breach::TookOff { at }
            | Breach::Fought { at }
            | Breach::EndedFailsafe { at }
            | Breach::NoResponder { at, .. } => *at,
        }
    }

    /// What happened, without the time.
    pub fn what(&self) -> String {
        match self {
            Breach::Entered { area, permission, .. } => {
                format!("it entered area {area} without a permission: {permission:?}")
            }
            Breach::Stayed { area, .. } => format!("it was still in area {area}"),
            Breach::TookOff { .. } => "it took off after the end or in answer to a flag".to_owned(),
            Breach::Fought { .. } => "it was commanded while somebody else flew it".to_owned(),
            Breach::EndedFailsafe { .. } => "a failsafe of the autopilot was ended without an order".to_owned(),
            Breach::NoResponder { phase, .. } => format!("it flew and nothing responded, mission {phase:?}"),
        }
    }
}

impl fmt::Display for Breach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:.0} s {}", self.at().as_secs_f64(), self.what())
    }
}

/// Higher than this above the ground the vehicle flies, if it is armed.
const HIGH_M: f64 = 1.0;
/// Moving less than this is hovering.
const HOVER_RADIUS_M: f64 = 5.0;
/// The slowest that the way to an area's border is flown.
const LEAVING_M_S: f64 = 1.0;

/// How long what must not last may take, in mission time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// A takeoff that was under way when a flag rose may still lift off within this time.
    pub under_way: Duration,
    /// In the air after the end of the mission without a response. (A landing is seen by the land detector once a second.)
    pub without_response: Duration,
    /// In one place without a response, without a reason of the planner's and without an operator's pause: longer than the planner holds for a permission.
    pub hover: Duration,
    /// How long after a status the skill manager may still not know that somebody else, or a failsafe, flies: on a busy machine.
    pub hears: Duration,
    /// Time to notice that an area must be left, on a busy machine.
    pub notice: Duration,
}

/// Those of a system whose processes live.
impl Default for Limits {
    fn default() -> Limits {
        Limits {
            under_way: Duration::from_secs(3),
            without_response: Duration::from_secs(10),
            hover: Duration::from_secs(200),
            notice: Duration::from_secs(20),
            hears: Duration::from_secs(1),
        }
    }
}

/// Knows the areas and permissions as everybody hears of them, and where the vehicle says it is.
#[derive(Debug, Default)]
pub struct Witness {
    limits: Limits,
    breaches: Vec<Breach>,
    areas: Vec<Area>,
    permissions: BTreeMap<String, v1::Permission>,
    inside: BTreeMap<String, Inside>,
    manager: v1::McmStatus,
    /// A mission has ended, and no operator has begun another one since.
    ended: bool,
    /// An operator has ordered the start of one since; it begins once the manager has no report any more.
    start_ordered: bool,
    others: Others,
    /// A flag is answered since then.
    answering: Option<Time>,
    /// The mission is over, the vehicle flies and nothing responds, since then.
    unattended: Option<Time>,
    hover: Option<(Ned, Time)>,
    /// The planner says what it holds for.
    planner_holds: bool,
    /// As the land detector says; before its first message the vehicle stands on the ground.
    reported_airborne: bool,
    /// As the height says. The simulated ground is at height 0.
    is_high: bool,
    airborne: bool,
    status: Option<Status>,
    /// The newest status is the one before once more: whether the vehicle is armed now is not known.
    is_frozen: bool,
    /// Where the vehicle says it is, and whether it said the same before: a real position is never without noise.
    position: Option<Ned>,
    position_is_frozen: bool,
    gripper: v1::Gripper,
    released: Vec<Ned>,
}

/// How the vehicle is inside an area.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Inside {
    /// While the area does not apply.
    Free,
    Permitted,
    /// Not any more: it must be out by then.
    Leaves(Time),
    Reported,
}

impl Witness {
    /// One with limits of its own, where processes die and come back.
    pub fn with(limits: Limits) -> Witness {
        Witness { limits, ..Witness::default() }
    }

    /// What it has seen so far, in order.
    pub fn breaches(&self) -> &[Breach] {
        &self.breaches
    }

    /// Whether the vehicle flies: armed, and in the air by its land detector or by its height.
    pub fn is_airborne(&self) -> bool {
        self.flies()
    }

    /// Where the vehicle was each time that its gripper let go of a load.
    pub fn loads_released_at(&self) -> &[Ned] {
        &self.released
    }

    /// A request takes no grant away: a tower that has forgotten a grant asks for patience, and the grant counts until its end or until the
    /// tower decides otherwise (docs/decisions.md, "The tower's ledger is stored before it is published").
    fn hear_of(&mut self, permission: &v1::Permission) {
        let before = self.permissions.get(&permission.area).map(v1::Permission::state);
        let forgets =
            before == Some(v1::PermissionState::Granted) && permission.state() == v1::PermissionState::Requested;
        if !forgets {
            self.permissions.insert(permission.area.clone(), permission.clone());
        }
    }

    /// A message passes by at this time.
    pub fn take_in(&mut self, now: Now, message: &Message) {
        let at = now.time;
        let commanded = self.others.take_in(at, message, self.flies(), self.limits.hears);
        self.breaches.extend(commanded);
        match message {
            Message::PlannerStatus(it) => {
                self.areas = it.areas.iter().cloned().filter_map(|it| it.try_into().ok()).collect();
                self.planner_holds = !it.hold.is_empty();
            }
            Message::PermissionLedger(it) => {
                it.permissions.iter().for_each(|it| self.hear_of(it));
            }
            Message::McmStatus(it) => {
                self.manager = it.clone();
                let begins = self.start_ordered && it.report.is_none();
                self.start_ordered &= !begins;
                self.ended = it.report.is_some() || self.ended && !begins;
                self.answering = (!it.acting.is_empty()).then(|| self.answering.unwrap_or(at));
            }
            Message::VehicleLandDetected(it) => {
                self.reported_airborne = !it.landed;
                self.took_off(at);
            }
            Message::VehicleStatus(it) => {
                let status = Status::from(it.clone());
                self.is_frozen = self.status.as_ref().is_some_and(|before| status.repeats(before));
                self.status = Some(status);
                self.took_off(at);
                self.let_go(it.gripper());
            }
            Message::VehicleLocalPosition(it) => {
                if let Some(Ok(position)) = it.position.map(Ned::try_from) {
                    self.position_is_frozen = self.position.replace(position) == Some(position);
                    // A height that wavers about the limit is no takeoff.
                    let limit_m = if self.is_high { HIGH_M / 2.0 } else { HIGH_M };
                    self.is_high = limit_m < position.height_m();
                    self.took_off(at);
                    self.moved(now, position);
                    self.attended(at, position);
                }
            }
            _ => {}
        }
    }

    /// An operator orders the start of a mission: what has ended before is no reason to stay on the ground any more.
    pub fn ordered_to_start(&mut self) {
        self.start_ordered = self.ended;
    }

    fn let_go(&mut self, gripper: v1::Gripper) {
        let held = std::mem::replace(&mut self.gripper, gripper) == v1::Gripper::Holding;
        if held && gripper == v1::Gripper::Released {
            self.released.extend(self.position);
        }
    }

    /// Armed, and in the air by one of two witnesses: a land detector may be stuck, and a position too. Where the status is frozen it may
    /// have disarmed since: then both decide, the detector alone if the position is frozen as well, and otherwise it is as it was.
    fn flies(&self) -> bool {
        let is_armed = self.status.as_ref().is_some_and(|it| it.armed);
        is_armed
            && match (self.reported_airborne, self.is_high) {
                (by_detector, by_height) if !self.is_frozen || by_detector == by_height => by_detector || by_height,
                (by_detector, _) if self.position_is_frozen => by_detector,
                _ => self.airborne,
            }
    }

    fn took_off(&mut self, at: Time) {
        let flies = self.flies();
        let was_airborne = std::mem::replace(&mut self.airborne, flies);
        let answers = self.answering.is_some_and(|since| since + self.limits.under_way < at);
        // A detector that is stuck in the air, or fell silent there, says nothing about a takeoff.
        let lifts_off = !was_airborne && self.airborne && self.is_high;
        if lifts_off && !self.others.fly() && (self.ended || answers) {
            self.breaches.push(Breach::TookOff { at });
        }
    }

    /// From the ground into the air is entering.
    fn moved(&mut self, now: Now, position: Ned) {
        if !self.flies() {
            self.inside.clear();
            return;
        }
        let Now { time: at, utc_ms } = now;
        let lands = self.manager.skill() == v1::SkillKind::Land;
        for area in &self.areas {
            if !area.contains(position) {
                self.inside.remove(&area.name);
                continue;
            }
            if !area.is_active(utc_ms) {
                self.inside.insert(area.name.clone(), Inside::Free);
                continue;
            }
            let permission = self.permissions.get(&area.name);
            let is_valid =
                |it: &v1::Permission| it.state() == v1::PermissionState::Granted && utc_ms < it.expires_utc_ms;
            let permitted = area.kind == AreaKind::Permission && permission.is_some_and(is_valid);
            let leave_by = || {
                let way_out = Duration::from_secs_f64(area.distance_to_border_m(position) / LEAVING_M_S);
                Inside::Leaves(at + self.limits.notice + way_out)
            };
            let stands = match self.inside.get(&area.name) {
                _ if permitted => Inside::Permitted,
                // Where a pilot flies is the pilot's affair.
                _ if self.others.fly() => Inside::Reported,
                None => {
                    let permission = permission.map(v1::Permission::state).unwrap_or_default();
                    self.breaches.push(Breach::Entered { at, area: area.name.clone(), permission });
                    Inside::Reported
                }
                Some(Inside::Free | Inside::Permitted) => leave_by(),
                // Down where it is comes before out of there.
                Some(Inside::Leaves(by)) if *by < at && !lands => {
                    self.breaches.push(Breach::Stayed { at, area: area.name.clone() });
                    Inside::Reported
                }
                Some(before) => *before,
            };
            self.inside.insert(area.name.clone(), stands);
        }
    }

    /// Somebody must be bringing the vehicle down, or anywhere, as long as it flies.
    fn attended(&mut self, at: Time, position: Ned) {
        let responds = !self.flies() || !self.manager.acting.is_empty();
        let phase = self.manager.phase();
        let is_over = matches!(phase, v1::MissionPhase::Ending | v1::MissionPhase::Over);
        // A detector that is stuck in the air says nothing about a vehicle that stands, until it is disarmed.
        let is_alone = !responds && self.is_high;
        self.unattended = (is_over && is_alone).then(|| self.unattended.unwrap_or(at));
        let rests = |(place, _): &(Ned, Time)| place.distance_m(position) < HOVER_RADIUS_M;
        // The planner's reasons end by themselves, and in `no_plan`.
        let waits = is_alone && !self.planner_holds;
        self.hover = waits.then(|| self.hover.filter(rests).unwrap_or((position, at)));
        let unattended = self.unattended.is_some_and(|since| since + self.limits.without_response < at);
        let hovers = self.hover.is_some_and(|(_, since)| since + self.limits.hover < at);
        if unattended || hovers {
            self.breaches.push(Breach::NoResponder { at, phase });
            (self.unattended, self.hover) = (None, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v1::PermissionState::{Denied, Expired, Granted, Requested, Revoked};

    #[test]
    fn an_area_that_begins_to_apply_around_a_vehicle_is_to_be_left_and_one_that_applies_is_entered() {
        const MS: i64 = 1_000;
        /// What is seen of a vehicle that is inside from 10 s on, by a clock that shows `utc_ms` then and a second later, and goes on.
        #[track_caller]
        fn check(utc_ms: [i64; 2], expected: &[&str]) {
            let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
            let area = v1::Area {
                name: "A".into(),
                kind: v1::AreaKind::Permission as i32,
                corners: [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)].map(corner).to_vec(),
                from_utc_ms: Some(100 * MS),
                ..Default::default()
            };
            let mut witness = Witness::default();
            let mut see = |second: u64, utc_ms: i64, message: Message| {
                witness.take_in(Now { time: Time::after(Duration::from_secs(second)), utc_ms }, &message);
            };
            see(0, utc_ms[0], v1::PlannerStatus { areas: vec![area], ..Default::default() }.into());
            see(0, utc_ms[0], v1::VehicleLandDetected { landed: false, ..Default::default() }.into());
            let mode = v1::FlightMode::Offboard as i32;
            let status =
                v1::VehicleStatus { armed: true, actual_mode: mode, intended_mode: mode, ..Default::default() };
            see(0, utc_ms[0], status.into());
            let at = v1::VehicleLocalPosition {
                position: Some(v1::Ned { north_m: 0.0, east_m: 0.0, down_m: -10.0 }),
                horizontal_valid: true,
                vertical_valid: true,
                ..Default::default()
            };
            see(10, utc_ms[0], at.into());
            for second in 0..100 {
                see(11 + second, utc_ms[1] + second as i64 * MS, at.into());
            }
            let of_place = witness.breaches().iter().filter_map(|it| match it {
                Breach::Entered { .. } => Some("entered"),
                Breach::Stayed { .. } => Some("stayed"),
                _ => None,
            });
            assert_eq!(of_place.collect::<Vec<_>>(), expected, "{utc_ms:?}");
        }
        check([0, MS], &[]);
        check([99 * MS, 100 * MS], &["stayed"]);
        // The clock is set by an hour.
        check([0, 3_600 * MS], &["stayed"]);
        check([100 * MS, 101 * MS], &["entered"]);
        check([100 * MS, 0], &["entered"]);
    }

    #[test]
    fn a_tower_that_asks_for_patience_takes_no_grant_away_and_one_that_decides_does() {
        #[track_caller]
        fn check(heard: &[v1::PermissionState], expected: v1::PermissionState) {
            let mut witness = Witness::default();
            for state in heard {
                let permission = v1::Permission { area: "A".into(), state: *state as i32, ..Default::default() };
                let ledger = v1::PermissionLedger { permissions: vec![permission], ..Default::default() };
                witness.take_in(Now { time: Time::ZERO, utc_ms: 0 }, &ledger.into());
            }
            assert_eq!(witness.permissions["A"].state(), expected, "{heard:?}");
        }
        check(&[Requested, Granted], Granted);
        check(&[Granted, Requested], Granted);
        for decided in [Denied, Revoked, Expired] {
            check(&[Granted, Requested, decided], decided);
            check(&[Granted, decided, Requested], Requested);
        }
    }

    #[test]
    fn a_frozen_status_hides_no_flight_and_makes_none() {
        #[track_caller]
        fn check(lands: bool, detector: bool, freezes_position: bool, expected: bool) {
            let mut witness = Witness::default();
            let mut second = 0;
            let mut see = |height_m: f64, landed: bool, timestamp_us: u64| {
                second += 1;
                let now = Now { time: Time::after(Duration::from_secs(second)), utc_ms: 0 };
                // Its position is never without noise, unless it is frozen.
                let north_m = if freezes_position && timestamp_us == 9 { 0.0 } else { 1e-6 * second as f64 };
                let position = Some(v1::Ned { north_m, east_m: 0.0, down_m: -height_m });
                witness.take_in(now, &v1::VehicleLandDetected { landed, ..Default::default() }.into());
                witness.take_in(now, &v1::VehicleLocalPosition { position, ..Default::default() }.into());
                witness.take_in(now, &v1::VehicleStatus { armed: true, timestamp_us, ..Default::default() }.into());
                witness.is_airborne()
            };
            assert!(!see(0.0, true, 1));
            assert!(see(5.0, false, 2));
            let down_at_m = if lands && !freezes_position { 0.0 } else { 5.0 };
            let flies = [9, 9, 9, 9].map(|frozen| see(down_at_m, detector, frozen));
            assert_eq!(flies[3], expected, "{lands} {detector} {freezes_position}");
        }
        // It has landed, by both, or by the detector where the position is frozen.
        check(true, true, false, false);
        check(true, true, true, false);
        // It flies, by both; one of them that is stuck changes nothing.
        check(false, false, false, true);
        check(false, true, false, true);
        check(true, false, false, true);
    }
}
