//! Rules over what is true of a simulated vehicle, which nothing on board sees: where it is, the ground under it, wind, charge and traffic.
//!
//! Each rule is one type in a file of its own. It reads the same stream as the witness, and the truth beside it.

use std::collections::BTreeMap;

use domain::area::{Area, AreaKind};
use domain::energy::EnergyModel;
use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use vehicle_sim::truth::Truth;

mod flapping;
mod ground;
mod landing;
mod progress;
mod reach;
mod reserve;
mod separation;
mod upload;

use flapping::Flapping;
use ground::Ground;
use landing::Landing;
use progress::Progress;
use reach::Reach;
use reserve::Reserve;
use separation::Separation;
use upload::Upload;

/// What is judged by the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    /// Never into the ground of a place, nor along it.
    Ground,
    /// Keeps away from traffic that it was warned of.
    Separation,
    /// No flag rises again and again for one cause.
    Flapping,
    /// Comes forward, or says why not.
    Progress,
    /// Comes down neither in water nor among people while another place is in reach.
    Landing,
    /// Comes down with the reserve as long as it could.
    Reserve,
    /// No upload opens an area that the tower has closed.
    Upload,
}

impl Rule {
    /// What the rule says, with its numbers and their sources.
    pub fn in_words(self) -> &'static str {
        match self {
            Rule::Ground => ground::IN_WORDS,
            Rule::Separation => separation::IN_WORDS,
            Rule::Flapping => flapping::IN_WORDS,
            Rule::Progress => progress::IN_WORDS,
            Rule::Landing => landing::IN_WORDS,
            Rule::Reserve => reserve::IN_WORDS,
            Rule::Upload => upload::IN_WORDS,
        }
    }
}

/// What a flight did that breaks no rule, and is counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Figures {
    /// Crewed aircraft that came nearer than well clear.
    pub well_clear_lost: u32,
    /// The longest that it stayed in one place in the air, in seconds.
    pub longest_hold_s: f64,
    /// The lowest charge with which it came down, 0 to 1.
    pub lowest_landing: Option<f64>,
}

/// What everybody hears.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Heard<'a> {
    pub(crate) now: Now,
    /// In the air, and neither a pilot nor a failsafe flies.
    pub(crate) flies_itself: bool,
    /// Those of the mission as the witness judges by them.
    pub(crate) areas: &'a [Area],
    pub(crate) permissions: &'a BTreeMap<String, v1::Permission>,
    pub(crate) manager: &'a v1::McmStatus,
}

/// What a rule reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) heard: Heard<'a>,
    pub(crate) truth: &'a Truth,
    pub(crate) before: &'a Truth,
    pub(crate) mission: &'a v1::MissionStatus,
    pub(crate) energy: &'a EnergyModel,
}

impl View<'_> {
    /// Whether it has just touched the ground.
    pub(crate) fn touched_down(&self) -> bool {
        self.truth.standing && !self.before.standing
    }

    /// Whether it has just left the ground.
    pub(crate) fn lifted_off(&self) -> bool {
        !self.truth.standing && self.before.standing
    }

    /// Whether the area applies and may not be entered.
    pub(crate) fn is_closed(&self, area: &Area, utc_ms: i64) -> bool {
        let is_for_it = |it: &v1::Permission| {
            super::is_valid(it, utc_ms) && it.extent.as_ref().is_none_or(|extent| *extent == area.extent().into())
        };
        let is_open =
            area.kind == AreaKind::Permission && self.heard.permissions.get(&area.name).is_some_and(is_for_it);
        area.is_active(utc_ms) && !is_open
    }
}

/// Something against the flight.
pub(crate) type Against = (Rule, String);

/// All rules.
#[derive(Debug)]
pub(crate) struct Rules {
    energy: EnergyModel,
    mission: v1::MissionStatus,
    before: Option<Truth>,
    ground: Ground,
    separation: Separation,
    flapping: Flapping,
    progress: Progress,
    reach: Reach,
    landing: Landing,
    reserve: Reserve,
    upload: Upload,
    pub(crate) figures: Figures,
}

impl Rules {
    pub(crate) fn new(energy: EnergyModel) -> Rules {
        Rules {
            energy,
            mission: v1::MissionStatus::default(),
            before: None,
            ground: Ground::default(),
            separation: Separation::default(),
            flapping: Flapping::default(),
            progress: Progress::default(),
            reach: Reach::default(),
            landing: Landing::default(),
            reserve: Reserve::default(),
            upload: Upload::default(),
            figures: Figures::default(),
        }
    }

    /// Something happened from outside: whatever follows has a cause.
    pub(crate) fn troubled(&mut self) {
        self.flapping.caused();
        self.reserve.troubled();
    }

    /// Messages are lost until then: each loss is a cause.
    pub(crate) fn losing(&mut self, until: Time) {
        self.flapping.losing(until);
    }

    /// A message passes by.
    pub(crate) fn hear(
        &mut self,
        at: Time,
        message: &Message,
        permissions: &BTreeMap<String, v1::Permission>,
    ) -> Vec<Against> {
        match message {
            Message::MissionStatus(it) => {
                self.upload.listed(&self.mission, it, permissions);
                self.mission = it.clone();
            }
            Message::DecisionRecord(it) => return self.flapping.decided(at, it).into_iter().collect(),
            _ => {}
        }
        Vec::new()
    }

    /// The world is like this.
    pub(crate) fn see(&mut self, truth: &Truth, heard: Heard<'_>) -> Vec<Against> {
        let before = self.before.replace(truth.clone());
        let Some(before) = before else { return Vec::new() };
        let view = View { heard, truth, before: &before, mission: &self.mission, energy: &self.energy };
        self.reach.look(&view);
        let against = [
            (Rule::Ground, self.ground.see(&view)),
            (Rule::Separation, self.separation.see(&view)),
            (Rule::Progress, self.progress.see(&view, &self.reach)),
            (Rule::Landing, self.landing.see(&view, &self.reach)),
            (Rule::Reserve, self.reserve.see(&view, &self.reach)),
            (Rule::Upload, self.upload.see(&view)),
        ];
        self.figures.well_clear_lost = self.separation.well_clear_lost();
        self.figures.longest_hold_s = self.progress.longest_hold_s();
        if view.touched_down() {
            self.figures.lowest_landing =
                Some(self.figures.lowest_landing.map_or(truth.charge, |it| it.min(truth.charge)));
        }
        against.into_iter().filter_map(|(rule, what)| Some((rule, what?))).collect()
    }
}

#[cfg(test)]
mod tests;
