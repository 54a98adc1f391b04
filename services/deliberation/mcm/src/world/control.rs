//! Who flies: Kittiwake; a pilot or another ground station; or the autopilot, by its own failsafe. And whether positions can still be
//! compared with those of the mission.
//!
//! Somebody else who flies is never fought: see the row `somebody_else_flies`. Whether somebody does is decided by the skill manager alone,
//! which tells it here. The flag falls by an operator's order, which takes control back, or on the ground with motors off; the mission then
//! waits for an operator. A skill manager that was started again together with the backend has forgotten it, and in flight does not end it.

use domain::contingency::{AUTOPILOT_PREEMPTS, FRAME_MOVED, LEFT_TO_OTHERS, SOMEBODY_ELSE_FLIES};
use domain::flight_state::status_limit;
use domain::geodesy::Origin;
use domain::geometry::Ned;
use domain::time::Time;
use domain::trust::Known;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

use super::{SELF, World};
use crate::clients::skills::Sending;
use crate::config::Limits;
use crate::vehicle::{ConfirmedState, Vehicle};

/// Origins nearer than this to each other are the same place. (ENG: less than the tolerance of any goal.)
const SAME_ORIGIN_M: f64 = 1.0;

/// A vehicle that stands farther from where it came to rest was carried, in metres. (ENG: more than an estimate wanders on the ground.)
const CARRIED_M: f64 = 20.0;

/// Why nothing is flown but a landing where the vehicle is.
pub(crate) const OF_ITS_OWN: &str = "the autopilot flies a failsafe of its own";

#[derive(Debug, Default)]
pub(super) struct Control {
    /// An operator has ordered to take control back: then, and when a skill was flown since.
    taking: Option<Taking>,
    /// How the skill manager sees that somebody else flies, empty where nobody does; and when it said so.
    other: String,
    told_at: Time,
    /// When a skill was pre-empted by the autopilot: until a newer status shows otherwise it still is.
    pre_empted_at: Time,
    /// The autopilot has last been seen, or heard, to fly by itself with its motors on.
    flew_by_itself: bool,
    /// The local frame, and where it had its origin when positions could last be compared with those of the mission; restored until its origin
    /// was compared with the present one.
    frame: Option<Known<Frame>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    epoch: u64,
    origin: Option<Origin>,
}

impl From<Frame> for v1::MissionFrame {
    fn from(frame: Frame) -> v1::MissionFrame {
        v1::MissionFrame { epoch: frame.epoch, origin: frame.origin.map(Into::into) }
    }
}

impl TryFrom<v1::MissionFrame> for Frame {
    type Error = InvalidMessage;

    fn try_from(frame: v1::MissionFrame) -> Result<Frame, InvalidMessage> {
        Ok(Frame { epoch: frame.epoch, origin: frame.origin.map(Origin::try_from).transpose()? })
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Taking {
    flown: Option<Time>,
}

impl World {
    /// The skill manager says how it sees that somebody else flies, or, with nothing, that nobody does.
    pub(super) fn told_who_flies(&mut self, other: String) {
        (self.control.other, self.control.told_at) = (other, self.now.time);
    }

    /// Whether the skill manager says that somebody else flies, also where that raises no flag.
    pub(crate) fn is_other_reported(&self) -> bool {
        !self.control.other.is_empty()
    }

    pub(super) fn skill_flown(&mut self) {
        if let Some(taking) = &mut self.control.taking {
            taking.flown.get_or_insert(self.now.time);
        }
    }

    pub(super) fn skill_pre_empted(&mut self, by_other: bool, reason: &str) {
        if by_other {
            // Also while control is being taken back: somebody has taken it again.
            self.control.taking = None;
            if !self.is_other_reported() {
                self.told_who_flies(reason.to_owned());
            }
            return;
        }
        (self.control.pre_empted_at, self.control.flew_by_itself) = (self.now.time, true);
        self.raise(AUTOPILOT_PREEMPTS, SELF, reason);
    }

    /// Whether the vehicle flies, and nobody else flies it: by a status, and what the skill manager says, from since it has lifted off, which
    /// would tell; of those that are silent no more is to be expected.
    pub(crate) fn flies_unattended(&self) -> bool {
        let flies = self.seen.flies.filter(|it| it.is_live() && it.value);
        let (Some(vehicle), Some(Known { since, .. })) = (self.seen.vehicle, flies) else { return false };
        let is_told = since <= vehicle.status_at.min(self.control.told_at)
            || status_limit(self.setup.limits.pace) <= self.now.time - since;
        vehicle.flying && is_told && !self.is_flown_by_other()
    }

    /// In the previous process an operator had ordered to take control back, and the vehicle has not obeyed yet.
    pub(super) fn restore_taking(&mut self, takes_control: bool) {
        self.control.taking = takes_control.then(Taking::default);
    }

    pub(super) fn sending(&self) -> Sending {
        Sending { quietly: self.is_flown_by_other(), takes_control: self.control.taking.is_some() }
    }

    /// An operator orders something that is flown: what was left to others is taken back. Returns whether anything was.
    pub(super) fn take_control_back(&mut self, by: &str) -> bool {
        let left = LEFT_TO_OTHERS.into_iter().filter(|it| self.flags.is_up(it)).collect::<Vec<_>>();
        for flag in &left {
            self.lower(flag);
            self.say("operator", format!("{by} takes control back: `{flag}` no longer counts"));
        }
        if !left.is_empty() {
            self.control.taking = Some(Taking::default());
        }
        !left.is_empty()
    }

    pub(super) fn watch_control(&mut self) {
        let Some(vehicle) = self.seen.vehicle else { return };
        let stands = !vehicle.armed && !vehicle.flying;
        let told_at = vehicle.status_at.min(self.control.told_at);
        let is_known = |it: &Taking| it.flown.is_some_and(|at| at < told_at);
        if stands || self.control.taking.as_ref().is_some_and(is_known) {
            // From here on the pilot is another one, or still the same, whom the order did not reach.
            self.control.taking = None;
        }
        let is_over = self.mission.over.is_some() && !vehicle.flying;
        let is_up = self.is_flown_by_other();
        if self.is_other_reported() && !stands && !is_up && self.control.taking.is_none() && !is_over {
            self.raise(SOMEBODY_ELSE_FLIES, SELF, self.control.other.clone());
        } else if is_up && stands && self.has_settled() {
            self.leave_to_operator();
        }
        self.leave_what_autopilot_ended(&vehicle);
        let is_pre_empted = vehicle.pre_empted || vehicle.status_at <= self.control.pre_empted_at;
        if !is_pre_empted && self.flags.is_up(AUTOPILOT_PREEMPTS) {
            self.flags.condition_gone(AUTOPILOT_PREEMPTS, SELF);
        }
        self.watch_frame();
    }

    /// The autopilot has ended a takeoff or a landing by a failsafe of its own, at the ground: nothing begins by itself, whether or not it has
    /// switched the motors off. (After a landing of its own in flight the touchdown says so already.)
    fn leave_what_autopilot_ended(&mut self, vehicle: &Vehicle) {
        if self.control.taking.is_some() {
            // An operator has just ordered to end it.
            self.control.flew_by_itself = false;
            return;
        }
        let is_newer = self.control.pre_empted_at < vehicle.status_at;
        // For a moment each change of the mode looks like one.
        let flies_by_itself = vehicle.pre_empted && vehicle.armed && self.flags.is_up(AUTOPILOT_PREEMPTS);
        if vehicle.flying && !vehicle.near_ground && is_newer {
            // In the air what was interrupted goes on once it is over.
            self.control.flew_by_itself = flies_by_itself;
            return;
        }
        self.control.flew_by_itself |= flies_by_itself;
        let is_left = !vehicle.flying && !flies_by_itself && is_newer;
        if is_left && std::mem::take(&mut self.control.flew_by_itself) && self.mission.over.is_none() {
            let why = "the autopilot has ended a takeoff or a landing by itself".to_owned();
            self.say("contingency", format!("waits for an operator: {why}"));
            self.has_landed_unplanned(why);
        }
    }

    /// Nobody flies any more, and nothing begins by itself.
    fn leave_to_operator(&mut self) {
        self.lower(SOMEBODY_ELSE_FLIES);
        self.say(
            "contingency",
            format!("`{SOMEBODY_ELSE_FLIES}` is over: the vehicle is on the ground, with its motors off"),
        );
        if self.mission.over.is_none() {
            self.has_landed_unplanned("somebody else has flown the vehicle".to_owned());
        }
    }

    /// The frame that the places of the mission are in, for as long as one is under way.
    pub(super) fn mission_frame(&self) -> Option<Frame> {
        let is_under_way = self.mission.over.is_none() || self.was_flying();
        self.control.frame.filter(|_| self.mission.started_s.is_some() && is_under_way).map(|it| it.value)
    }

    /// The frame of a mission that was under way before a restart. Without one, the places of the mission are in the frame that there is when
    /// it begins.
    pub(super) fn restore_frame(&mut self, frame: Option<Frame>) {
        self.control.frame = frame.map(Known::restored);
    }

    /// Notices a local frame that is another one than before.
    fn watch_frame(&mut self) {
        let Some(vehicle) = self.seen.vehicle else { return };
        let (epoch, origin) = (vehicle.frame_epoch, vehicle.origin);
        let present = Known::live(Frame { epoch, origin }, self.now.time);
        let known = *self.control.frame.get_or_insert(present);
        let Frame { epoch: before, origin: reference } = known.value;
        let is_same = reference.zip(origin).map(|(a, b)| is_same_place(a, b));
        let value = Frame { epoch, origin: reference.or(origin.filter(|_| before == epoch)) };
        self.control.frame =
            Some(if is_same.is_some() { Known { value, ..present } } else { Known { value, ..known } });
        // If everything was started again at once, epochs may begin at zero again: then only the origins show that the frame is another one.
        let is_another = !known.is_live() && is_same == Some(false) && !self.flags.is_up(FRAME_MOVED);
        if before != epoch || is_another {
            self.seen.confirmed = ConfirmedState::default();
            self.landings.blocked_sites.clear();
            self.landings.rests_at = None;
            self.planner.withdraw("the autopilot's local frame moved");
            if self.mission.started_s.is_none() && !vehicle.flying {
                // Nothing was planned in the frame before.
                self.control.frame = Some(present);
            } else if is_same != Some(true) {
                let origins = match is_same {
                    Some(false) => "its origin is another place",
                    _ => "where its origin is, or was, is not known",
                };
                let reason = format!("the autopilot was started again or its local frame moved, and {origins}");
                self.raise(FRAME_MOVED, SELF, reason);
            }
        } else if self.is_planned_elsewhere(origin) {
            self.planner.withdraw("the vehicle's local frame has its origin elsewhere");
        } else if self.doubts_position() {
            // It says neither that the vehicle was carried nor that it was not.
        } else if let Some(reason) = self.was_carried(&vehicle) {
            self.raise(FRAME_MOVED, SELF, reason);
        } else if is_same == Some(true) && self.flags.is_up(FRAME_MOVED) {
            self.flags.condition_gone(FRAME_MOVED, SELF);
        }
    }

    /// Whether a flag says that the position may be another one than is heard.
    pub(super) fn doubts_position(&self) -> bool {
        self.flags.rows_up().any(|it| self.setup.table.rows()[it].doubts_position())
    }

    /// Where `vehicle` stands although it came to rest elsewhere, before a takeoff: home, and all places, would be elsewhere than they were meant.
    fn was_carried(&self, vehicle: &Vehicle) -> Option<String> {
        if vehicle.flying || vehicle.armed || self.mission.over.is_some() || self.was_flying() {
            return None;
        }
        let (from, words) = match self.landings.rests_at {
            Some(at) => (at, "where it came down"),
            None => (Ned::default(), "the take-off point of its local frame"),
        };
        let away_m = vehicle.position.horizontal_distance_m(from);
        (CARRIED_M < away_m).then(|| {
            format!(
                "it stands {away_m:.0} m from {words}, and home and all places stay where they were: power it on again where it stands, or start \
                 or resume to fly all the same"
            )
        })
    }

    /// Whether the present step was planned for a local frame with another origin than this one, by a mission for which that matters.
    fn is_planned_elsewhere(&self, origin: Option<Origin>) -> bool {
        let apart = self.planner.planned_from.zip(origin).is_some_and(|(a, b)| !is_same_place(a, b));
        apart && self.planner.flight.step().is_some() && self.planner.mission.status.origin.is_some()
    }

    /// An operator lets a mission on the ground go on in the frame that there is now. Returns whether another one was.
    ///
    /// # Errors
    /// If the vehicle flies: where it is cannot be known.
    pub(super) fn accept_frame(&mut self) -> Result<bool, String> {
        if !self.flags.is_up(FRAME_MOVED) {
            return Ok(false);
        }
        if self.is_flying() {
            let why = "the local frame has moved, and where the vehicle is in that of the mission is not known";
            return Err(format!("{why}; order an abort, which lands it where it is"));
        }
        self.lower(FRAME_MOVED);
        let present = self.seen.vehicle.map(|it| Frame { epoch: it.frame_epoch, origin: it.origin });
        self.control.frame = present.map(|it| Known::live(it, self.now.time));
        self.landings.rests_at = self.seen.vehicle.map(|it| it.position);
        Ok(true)
    }

    /// Sends the effects of this wake: requests first, then messages that are only read.
    pub(crate) fn flush(&mut self) {
        let (now, Limits { request_timeout, skill_silence, .. }) = (self.now.time, self.setup.limits);
        self.skills.flush(self.now.time, self.sending(), request_timeout, &mut self.out.outbox);
        self.skills.tend(now, skill_silence, request_timeout, &mut self.out.outbox);
    }
}

fn is_same_place(a: Origin, b: Origin) -> bool {
    let apart_m = a.altitude_m.zip(b.altitude_m).map_or(0.0, |(a, b)| (a - b).abs());
    a.place.distance_m(b.place) < SAME_ORIGIN_M && apart_m < SAME_ORIGIN_M
}
