//! Watches from outside that what must never happen does not.
//!
//! It knows no service and trusts none: it hears the areas, the permissions and what the mission manager says it does, as
//! everybody does, and judges by where the simulated vehicle says it is, and by the truth where the simulator shows that ([`truth`]). Who knows the mission's file tells it the areas there: a
//! planner that leaves one out is found out. It reads no clock, so that it looks on in `simulation`'s virtual time as in the
//! real time of a campaign.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Duration;

use domain::area::{Area, AreaKind};
use domain::energy::EnergyModel;
use domain::fmu::{FlightMode, Status};
use domain::geometry::Ned;
use domain::harm::Ground;
use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use others::Others;
use truth::{Against, Figures, Heard, Rules};
use vehicle_sim::truth::Truth;

mod inside;
pub mod modes;
mod others;
pub mod setpoints;
pub mod true_time;
pub mod truth;

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
    /// The planner's status lacks an area of the mission's file, or says that it is another one.
    Unlisted {
        /// When.
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
    /// A rule over the truth was broken.
    Truth {
        /// When.
        at: Time,
        /// Which.
        rule: truth::Rule,
        /// What happened.
        what: String,
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
            | Breach::Unlisted { at, .. }
            | Breach::TookOff { at }
            | Breach::Fought { at }
            | Breach::EndedFailsafe { at }
            | Breach::Truth { at, .. }
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
            Breach::Unlisted { area, .. } => {
                format!("the planner's status lacked area {area} as the mission's file has it")
            }
            Breach::TookOff { .. } => "it took off after the end or in answer to a flag".to_owned(),
            Breach::Fought { .. } => "it was commanded while somebody else flew it".to_owned(),
            Breach::EndedFailsafe { .. } => "a failsafe of the autopilot was ended without an order".to_owned(),
            Breach::Truth { what, .. } => what.clone(),
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
    /// A takeoff that was under way when a flag rose, or a permission was withdrawn, may still lift off within this time.
    pub under_way: Duration,
    /// In the air after the end of the mission without a response. (A landing is seen by the land detector once a second.)
    pub without_response: Duration,
    /// In one place without a response, without a reason of the planner's and without an operator's pause: longer than the planner holds for a permission.
    pub hover: Duration,
    /// How long after a status the skill manager may still not know that somebody else, or a failsafe, flies: on a busy machine.
    pub hears: Duration,
    /// Time to notice that an area must be left, on a busy machine.
    pub notice: Duration,
    /// How long after its permission ended early an area may still be entered, and is to be left then: who decides is far away, and the
    /// vehicle has to brake.
    pub heeds: Duration,
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
            heeds: Duration::ZERO,
        }
    }
}

/// Knows the areas and permissions as everybody hears of them, and where the vehicle says it is.
#[derive(Debug, Default)]
pub struct Witness {
    limits: Limits,
    breaches: Vec<Breach>,
    /// Of the mission's file; empty where nobody has told.
    expected: Vec<Area>,
    /// Of these, the ones that the newest status lacks.
    unlisted: BTreeSet<String>,
    /// That are judged by.
    areas: Vec<Area>,
    permissions: BTreeMap<String, v1::Permission>,
    /// By when the vehicle knows, and has braked, that a permission was withdrawn which was not granted again.
    withdrawn: BTreeMap<String, Time>,
    /// Until then somebody who has to heed that is dead, hung or cut off.
    disturbed_until: Time,
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
    /// As the height above the ground says.
    is_high: bool,
    /// The height of the ground under the vehicle: 0 where no truth is shown.
    ground_m: f64,
    /// Where the truth is shown.
    rules: Option<Box<Rules>>,
    airborne: bool,
    /// It has left the ground, and was not high since.
    lifting: Option<Lifting>,
    status: Option<Status>,
    /// The newest status is the one before once more: whether the vehicle is armed now is not known.
    is_frozen: bool,
    /// Where the vehicle says it is, and whether it said the same before: a real position is never without noise.
    position: Option<Ned>,
    position_is_frozen: bool,
    gripper: v1::Gripper,
    released: Vec<Ned>,
}

/// A lift-off that is not a takeoff yet: a land detector stuck or silent in the air reports one while the vehicle
/// stands.
#[derive(Debug, Clone, Copy)]
struct Lifting {
    since: Time,
    /// The vehicle was to stay on the ground then.
    is_forbidden: bool,
}

/// Whether the area that it names may be entered by it.
fn is_valid(permission: &v1::Permission, utc_ms: i64) -> bool {
    permission.state() == v1::PermissionState::Granted && utc_ms < permission.expires_utc_ms
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

    /// Sets the areas of the mission's file. They apply whatever the planner says; only the times at which they do come from its status,
    /// as that is where clocks that are set are reckoned with (see [`true_time`]).
    pub fn expecting(self, areas: Vec<Area>) -> Witness {
        Witness { areas: areas.clone(), expected: areas, ..self }
    }

    /// One that is shown the truth, of a vehicle with these figures.
    pub fn that_sees(self, energy: EnergyModel) -> Witness {
        Witness { rules: Some(Box::new(Rules::new(energy))), ..self }
    }

    /// What is counted.
    pub fn figures(&self) -> Figures {
        self.rules.as_ref().map(|it| it.figures).unwrap_or_default()
    }

    /// Something happens from outside.
    pub fn troubled(&mut self) {
        self.rules.iter_mut().for_each(|it| it.troubled());
    }

    /// Messages are lost until then.
    pub fn losing(&mut self, until: Time) {
        self.rules.iter_mut().for_each(|it| it.losing(until));
    }

    /// The world is like this.
    pub fn see(&mut self, now: Now, truth: &Truth) {
        self.ground_m = truth.ground_m;
        let failsafe = self.status.as_ref().is_some_and(|it| it.failsafe);
        let Some(mut rules) = self.rules.take() else { return };
        let heard = Heard {
            now,
            flies_itself: self.flies() && !failsafe && !self.others.fly(),
            areas: &self.areas,
            permissions: &self.permissions,
            manager: &self.manager,
        };
        let against = rules.see(truth, heard);
        self.rules = Some(rules);
        self.tell(now.time, against);
    }

    fn tell(&mut self, at: Time, against: Vec<Against>) {
        self.breaches.extend(against.into_iter().map(|(rule, what)| Breach::Truth { at, rule, what }));
    }

    /// What it has seen so far, in order.
    pub fn breaches(&self) -> &[Breach] {
        &self.breaches
    }

    /// Whether the vehicle flies: armed, and in the air by its land detector or by its height.
    pub fn is_airborne(&self) -> bool {
        self.flies()
    }

    /// Whether it flies, by its height as well: a land detector that is stuck in the air makes no takeoff.
    pub fn has_lifted_off(&self) -> bool {
        self.flies() && self.is_high
    }

    /// Where the vehicle was each time that its gripper let go of a load.
    pub fn loads_released_at(&self) -> &[Ned] {
        &self.released
    }

    /// A request takes no grant away: a tower that has forgotten a grant asks for patience, and the grant counts until its end or until the
    /// tower decides otherwise (docs/decisions.md, "The tower's ledger is stored before it is published").
    fn hear_of(&mut self, now: Now, permission: &v1::Permission) {
        let area = &permission.area;
        let before = self.permissions.get(area);
        let was_granted = before.is_some_and(|it| it.state() == v1::PermissionState::Granted);
        let was_valid = before.is_some_and(|it| is_valid(it, now.utc_ms));
        match permission.state() {
            v1::PermissionState::Requested if was_granted => return,
            v1::PermissionState::Granted => drop(self.withdrawn.remove(area)),
            // An expiry is known before.
            v1::PermissionState::Denied | v1::PermissionState::Revoked if was_valid => {
                let mode = self.status.as_ref().filter(|it| it.armed).map(|it| it.actual);
                let takes_off = !self.flies() && mode == Some(Some(FlightMode::Takeoff));
                let heeds = if takes_off { self.limits.heeds.max(self.limits.under_way) } else { self.limits.heeds };
                self.withdrawn.insert(area.clone(), now.time.max(self.disturbed_until) + heeds);
            }
            _ => {}
        }
        self.permissions.insert(area.clone(), permission.clone());
    }

    /// For `time` from now on somebody who has to heed a withdrawn permission may be dead, hung or cut off. What is to be done by then may
    /// take longer by that.
    pub fn disturbed(&mut self, at: Time, time: Duration) {
        let before = self.disturbed_until.max(at);
        self.disturbed_until = before.max(at + time);
        let longer_by = self.disturbed_until - before;
        let leaving =
            self.inside.values_mut().filter_map(|it| if let Inside::Leaves(by) = it { Some(by) } else { None });
        // What is known already is not forgotten.
        for by in leaving.chain(self.withdrawn.values_mut()).filter(|by| at <= **by) {
            *by = *by + longer_by;
        }
    }

    /// A message passes by at this time.
    pub fn take_in(&mut self, now: Now, message: &Message) {
        let at = now.time;
        let commanded = self.others.take_in(at, message, self.flies(), self.limits.hears);
        self.breaches.extend(commanded);
        if let Some(rules) = &mut self.rules {
            let against = rules.hear(now.time, message, &self.permissions);
            self.tell(at, against);
        }
        match message {
            Message::MissionStatus(it) => {
                self.listed(at, it.areas.iter().cloned().filter_map(|it| it.try_into().ok()).collect());
                self.planner_holds = !it.hold.is_empty();
            }
            Message::PermissionLedger(it) => {
                it.permissions.iter().for_each(|it| self.hear_of(now, it));
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
                    // A height that wavers about the limit does not count as a takeoff.
                    let limit_m = if self.is_high { HIGH_M / 2.0 } else { HIGH_M };
                    self.is_high = limit_m < position.height_m() - self.ground_m;
                    self.took_off(at);
                    self.moved(now, position);
                    self.attended(at, position);
                }
            }
            _ => {}
        }
    }

    /// The planner's status lists these areas. A missing area is reported once, until it is listed again.
    fn listed(&mut self, at: Time, listed: Vec<Area>) {
        let is_listed = |area: &Area| listed.iter().any(|it| is_same(it, area));
        let unlisted: BTreeSet<String> =
            self.expected.iter().filter(|it| !is_listed(it)).map(|it| it.name.clone()).collect();
        let news = unlisted.difference(&self.unlisted).map(|area| Breach::Unlisted { at, area: area.clone() });
        self.breaches.extend(news);
        let lacking = self.expected.iter().filter(|it| unlisted.contains(&it.name)).cloned();
        let others = listed.into_iter().filter(|it| !unlisted.contains(&it.name));
        self.areas = lacking.chain(others).collect();
        self.unlisted = unlisted;
    }

    /// An operator orders the start of a mission: what has ended before is no reason to stay on the ground any more.
    pub fn ordered_to_start(&mut self) {
        self.start_ordered = self.ended;
    }

    fn let_go(&mut self, gripper: v1::Gripper) {
        let before = std::mem::replace(&mut self.gripper, gripper);
        let may_have_held = matches!(before, v1::Gripper::Holding | v1::Gripper::Silent);
        if may_have_held && gripper == v1::Gripper::Released {
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
        let is_forbidden = self.ended || answers;
        if !flies {
            self.lifting = None;
        } else if !was_airborne {
            self.lifting = Some(Lifting { since: at, is_forbidden });
        }
        // Judged by when it left the ground, which a detector tells before the height does; by now, if that was long ago.
        let Some(it) = self.lifting.take_if(|_| self.is_high) else { return };
        let left_long_ago = it.since + self.limits.under_way < at;
        if !self.others.fly() && if left_long_ago { is_forbidden } else { it.is_forbidden } {
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
        // Where the truth is shown, what may not be landed in is judged by what is there: see `truth::Rule::Landing`.
        let has_truth = self.rules.is_some();
        for area in self.areas.iter().filter(|it| !(has_truth && it.only_bars_landings())) {
            if !inside::is_inside(area, position) {
                self.inside.remove(&area.name);
                continue;
            }
            if !area.is_active(utc_ms) {
                self.inside.insert(area.name.clone(), Inside::Free);
                continue;
            }
            let permission = self.permissions.get(&area.name);
            let is_for_it = |it: &v1::Permission| is_valid(it, utc_ms) && it.extent == Some(area.extent().into());
            let permitted = area.kind == AreaKind::Permission && permission.is_some_and(is_for_it);
            let leave_by = || {
                let way_out = Duration::from_secs_f64(area.distance_to_border_m(position) / LEAVING_M_S);
                Inside::Leaves(at.max(self.disturbed_until) + self.limits.notice + way_out)
            };
            let was_withdrawn_just_now = self.withdrawn.get(&area.name).is_some_and(|known_by| at < *known_by);
            let stands = match self.inside.get(&area.name) {
                _ if permitted => Inside::Permitted,
                // Where a pilot flies is the pilot's affair.
                _ if self.others.fly() => Inside::Reported,
                None if was_withdrawn_just_now => leave_by(),
                _ if self.announces_entry(area) => Inside::Reported,
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

    /// Whether the manager says that it enters `area` without permission, and has a reason: an operator's order, or people who may be below.
    fn announces_entry(&self, area: &Area) -> bool {
        let is_announced = self.manager.entered_without_permission.contains(&area.name);
        let is_ordered = self.manager.acting.starts_with("operator_");
        let people = |it: &Area| it.only_bars_landings() && it.ground == Ground::People;
        is_announced && area.kind == AreaKind::Permission && (is_ordered || self.areas.iter().any(people))
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
        // The planner's reasons end by themselves, and in `no_plan`; a task has its own limit.
        let does_a_task = self.manager.skill() == v1::SkillKind::Task;
        let waits = is_alone && !self.planner_holds && !does_a_task;
        self.hover = waits.then(|| self.hover.filter(rests).unwrap_or((position, at)));
        let unattended = self.unattended.is_some_and(|since| since + self.limits.without_response < at);
        let hovers = self.hover.is_some_and(|(_, since)| since + self.limits.hover < at);
        if unattended || hovers {
            self.breaches.push(Breach::NoResponder { at, phase });
            (self.unattended, self.hover) = (None, None);
        }
    }
}

/// Whether it is the same area, apart from its window: that comes from a clock that may have been set.
fn is_same(listed: &Area, expected: &Area) -> bool {
    let (from_utc_ms, until_utc_ms) = (expected.from_utc_ms, expected.until_utc_ms);
    let has_window = |it: &Area| (it.from_utc_ms.is_some(), it.until_utc_ms.is_some());
    has_window(listed) == has_window(expected) && Area { from_utc_ms, until_utc_ms, ..listed.clone() } == *expected
}

#[cfg(test)]
mod tests;
