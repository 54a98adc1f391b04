//! Whether a process that was killed, or hung until it was killed, has a successor in time.
//!
//! It is judged by heartbeats, and only while others on the same side of the link are heard: a bus that is away says nothing of
//! those on it. The ground's router is there when anybody on the ground is heard, and judged while somebody on board is. The aircraft's,
//! or the only one, is not watched here: if it stays away the run has no end.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::v1;

use super::{DEAF, Violation};
use crate::trouble::{Trouble, Victim};

/// Who is missing.
#[derive(Debug)]
pub(super) struct ComesBack {
    pace: Pace,
    /// Mission time that the death of a process may take.
    interruption: Duration,
    /// With the processes that were lost since it was last heard.
    missing: BTreeMap<Victim, Vec<u32>>,
    /// When somebody of this side was last heard.
    heard: BTreeMap<Side, Time>,
    /// Until then something was under way that may keep a process away.
    troubled_until: Time,
}

/// A side of the link; with one router both hear the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    OnBoard,
    Ground,
}

/// Who has to be heard while it is not; none for the aircraft's router.
fn judged_by(victim: Victim) -> Option<Side> {
    match victim {
        Victim::Mcm | Victim::Planner | Victim::SkillManager | Victim::Monitor | Victim::Onboard => Some(Side::OnBoard),
        Victim::ControlTower | Victim::Gateway => Some(Side::Ground),
        Victim::GroundRouter => Some(Side::OnBoard),
        Victim::Router => None,
    }
}

impl ComesBack {
    pub(super) fn new(pace: Pace, interruption: Duration) -> ComesBack {
        let (missing, heard) = (BTreeMap::new(), BTreeMap::new());
        ComesBack { pace, interruption, missing, heard, troubled_until: Time::ZERO }
    }

    /// A trouble begins: whatever it does may go on until it is over.
    pub(super) fn troubled(&mut self, now: Time, trouble: &Trouble) {
        self.troubled_until = self.troubled_until.max(now + self.pace.wall(trouble.lasts()));
    }

    /// A process is about to be killed or stopped. The time limit begins again for everybody: its supervisor has more to do, and a router that dies
    /// keeps others away.
    pub(super) fn lost(&mut self, now: Time, victim: Victim, id: u32) {
        self.troubled_until = self.troubled_until.max(now);
        if judged_by(victim).is_some() {
            self.missing.entry(victim).or_default().push(id);
        }
    }

    /// A stopped process goes on: it is not missed.
    pub(super) fn continued(&mut self, now: Time, id: u32) {
        self.troubled_until = self.troubled_until.max(now);
        self.missing.retain(|_, ids| ids.last() != Some(&id));
    }

    /// The power is lost: nobody is expected back, since a new system is started.
    pub(super) fn power_lost(&mut self, now: Time) {
        self.missing.clear();
        self.heard.clear();
        self.troubled_until = now;
    }

    /// A node lives: perhaps in the successor of a process that was lost.
    pub(super) fn beats(&mut self, now: Time, beat: &v1::Heartbeat) -> Vec<Violation> {
        let is_of = |victim: &Victim| victim.nodes().contains(&beat.service.as_str());
        let is_ground = [Victim::ControlTower, Victim::Gateway].iter().any(is_of);
        // What was under way when its router was lost may still arrive.
        let has_router = is_ground && self.troubled_until + self.pace.wall(DEAF) < now;
        self.missing.retain(|victim, ids| match victim {
            Victim::GroundRouter => !has_router,
            _ => !is_of(victim) || ids.contains(&beat.pid),
        });
        self.hears(now, if is_ground { Side::Ground } else { Side::OnBoard })
    }

    /// A process of that side is heard. Returns the others of that side that should have been heard too.
    fn hears(&mut self, now: Time, from: Side) -> Vec<Violation> {
        let before = self.heard.insert(from, now);
        if before.is_none_or(|it| it + self.pace.wall(DEAF) < now) {
            self.troubled_until = self.troubled_until.max(now);
        }
        if now <= self.troubled_until + self.interruption {
            return Vec::new();
        }
        let late = |victim: Victim| (judged_by(victim) == Some(from)).then_some(Violation::NotBack { victim, at: now });
        let late: Vec<Violation> = self.missing.keys().filter_map(|it| late(*it)).collect();
        // Once for each.
        self.missing.retain(|victim, _| judged_by(*victim) != Some(from));
        late
    }

    /// Of whom it is still open if they come back.
    pub(super) fn awaited(&self) -> impl Iterator<Item = Victim> {
        self.missing.keys().copied()
    }
}
