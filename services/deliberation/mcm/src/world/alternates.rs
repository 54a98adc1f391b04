//! Where the flight may end early, looked at ahead: a response takes the best place from here and searches one way, the one that
//! it flies.
//!
//! Without the planner: sites and objectives are those of the mission, which the manager keeps.

use domain::airspace::Grants;
use domain::alternates::{Alternate, Candidate, Charge, Viewpoint, Way, candidates, rank, to_divert_to};
use domain::decision::{DecisionKind, Rejected};
use domain::energy::EnergyModel;
use domain::geometry::Ned;
use domain::measured::{Measured, Unit};
use domain::site::SiteKind;
use domain::way::{FlightLimits, Found, MOST_LEGS};

use super::places::SAME_SITE_M;
use super::responses::WITH_FAULT;
use super::{WhatMayBeEntered, World};
use crate::journal::{CONTINGENCY, Said};

/// A look ends after this many legs of ways, and each search in it after half of them: it runs in the loop that answers
/// flags, twice a second. (Measured: 2 to 10 us for a leg.)
const LEGS_OF_A_LOOK: u32 = 2_000;
/// A reason names at most this many places. (ENG: a sentence that can be read.)
const MOST_BARRED: usize = 3;
/// The most places that are published. (ENG: an operator's screen, and a link that may be narrow.)
pub(super) const MOST_TOLD: usize = 8;

#[derive(Debug, Default)]
pub(super) struct Alternates {
    looks: Vec<Look>,
    /// What the ways keep to.
    entered: Option<WhatMayBeEntered>,
    /// The candidate that the next look begins with.
    turn: usize,
}

#[derive(Debug, Clone, PartialEq)]
struct Look {
    candidate: Candidate,
    /// The outer `None`: it was not looked at yet.
    way: Option<Option<Way>>,
}

/// A place to go to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice {
    pub(crate) position: Ned,
    /// What happens to the vehicle there.
    pub(crate) kind: SiteKind,
    pub(crate) words: String,
    /// The way there took a permission that was not held.
    pub(crate) asks: bool,
}

impl Choice {
    pub(super) fn of(alternate: &Alternate) -> Choice {
        let candidate = &alternate.candidate;
        let (position, words) = (candidate.position, candidate.to_string());
        Choice { position, kind: candidate.kind, words, asks: alternate.asks() }
    }
}

impl World {
    /// Looks at the ways to as many places as the effort of one look suffices for: new ones first, then in turn.
    pub(super) fn look_at_alternates(&mut self) {
        let Some(vehicle) = self.seen.vehicle.filter(|it| it.flying) else {
            self.watch.alternates = Alternates::default();
            return;
        };
        let entered = self.what_may_be_entered();
        let is_same = self.watch.alternates.entered.as_ref() == Some(&entered);
        let mut looks: Vec<Look> = self
            .candidates()
            .into_iter()
            .map(|candidate| Look { way: self.known_way(&candidate).filter(|_| is_same).cloned(), candidate })
            .collect();
        let turn = self.watch.alternates.turn;
        let in_turn = (0..looks.len()).map(|it| (turn + it) % looks.len());
        let (new, known): (Vec<usize>, Vec<usize>) = in_turn.partition(|it| looks[*it].way.is_none());
        let grants = self.permits_of_responses();
        let (limits, energy) = (self.limits_in_wind(), self.energy());
        let view = self.viewpoint(vehicle.position, &grants, &limits, &energy);
        let (mut legs_left, mut next) = (LEGS_OF_A_LOOK, turn);
        for index in new.into_iter().chain(known) {
            let Found { way, legs } = view.look_at(&looks[index].candidate, LEGS_OF_A_LOOK / 2);
            looks[index].way = Some(way);
            next = index + 1;
            legs_left = legs_left.saturating_sub(legs.max(1));
            if legs_left == 0 {
                break;
            }
        }
        self.watch.alternates = Alternates { looks, entered: Some(entered), turn: next };
    }

    /// The places as they were looked at last, best first; none on the ground.
    pub(super) fn seen_alternates(&self) -> Vec<Alternate> {
        let looks = self.watch.alternates.looks.iter();
        let seen = looks.filter_map(|it| Some(self.alternate(it.candidate.clone(), it.way.clone()?)));
        let mut alternates: Vec<Alternate> = seen.collect();
        rank(&mut alternates);
        alternates
    }

    /// Records that the response flies to `place` to land, what that takes, and why it flies to no other place that was looked at.
    pub(crate) fn record_place(&mut self, position: Ned, place: String) {
        let seen = self.seen_alternates();
        let text = format!("flies to {place} to land");
        let said = Said::new(CONTINGENCY, DecisionKind::SiteChosen, text).about(self.response_row());
        let Some(chosen) = seen.iter().find(|it| it.candidate.position == position) else {
            // A place beside one where a landing has failed is not an alternate, and nothing is known about it.
            return self.record(said.taking(place, String::new()));
        };
        let usable_wh = self.usable_wh();
        let energy_wh = chosen.way.as_ref().map(|(way, _)| way.energy_wh);
        let measured =
            energy_wh.zip(usable_wh).and_then(|(needs, usable)| Measured::new(needs, usable, Unit::WattHour));
        let others = seen.iter().filter(|it| it.candidate.position != position).take(MOST_TOLD);
        let why_not = |it: &Alternate| {
            let why = self.why_no_landing_at(it.candidate.position).or_else(|| it.why_not_instead_of(chosen));
            let why = why.unwrap_or_else(|| self.why_no_way("no way there when it chose", it.candidate.position));
            Rejected { what: it.candidate.to_string(), why }
        };
        let said = said.rejecting(others.map(why_not).collect()).measuring(measured);
        let figures = chosen.figures(usable_wh);
        self.record(said.taking(place, figures));
    }

    /// What the battery gives before the vehicle would land where it is, in Wh; `None` while the charge is not known.
    fn usable_wh(&self) -> Option<f64> {
        let charge = self.seen.vehicle?.charge?;
        Some(self.energy().budget_above(charge, self.setup.table.lands_below()).usable_wh)
    }

    /// The places to land at in the order in which a response tries them that does not land where it is: landings that can be
    /// reached as the permissions are; else, where a landing here has failed, places beside it; then ditches, and what the battery may not suffice for.
    pub(crate) fn places_elsewhere(&self) -> Vec<Choice> {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return Vec::new() };
        let mut ranked = self.ranked_alternates();
        ranked.retain(|it| it.failed_landings == 0 || SAME_SITE_M <= it.candidate.position.horizontal_distance_m(here));
        let is_landing = |it: &Alternate| it.is_reachable() && it.candidate.kind == SiteKind::Landing && !it.asks();
        let (landings, others): (Vec<Alternate>, Vec<Alternate>) = ranked.into_iter().partition(is_landing);
        let beside = if landings.is_empty() { self.places_beside(here) } else { Vec::new() };
        let beside = beside.into_iter().map(|position| Choice {
            position,
            kind: SiteKind::Landing,
            words: format!("a place {:.0} m aside", position.horizontal_distance_m(here)),
            asks: false,
        });
        landings.iter().map(Choice::of).chain(beside).chain(others.iter().map(Choice::of)).collect()
    }

    /// The places that can be reached, in the order in which a vehicle diverts to them.
    pub(crate) fn places_to_divert_to(&self) -> Vec<Choice> {
        to_divert_to(&self.ranked_alternates()).into_iter().map(Choice::of).collect()
    }

    /// The nearest landing that has no way now and may have one in time. A response that can go nowhere else waits for it.
    pub(crate) fn nearest_closed_landing(&self) -> Option<Ned> {
        let here = self.seen.vehicle?.position;
        let is_landing = |it: &&Alternate| it.candidate.kind == SiteKind::Landing && it.failed_landings == 0;
        let ranked = self.ranked_alternates();
        let closed = ranked.iter().filter(|it| it.way.is_none()).filter(is_landing).map(|it| it.candidate.position);
        let closed = closed.filter(|it| self.may_open_within(*it, WITH_FAULT));
        closed.min_by(|a, b| a.horizontal_distance_m(here).total_cmp(&b.horizontal_distance_m(here)))
    }

    /// What bars the places to land at, best first, when none of them can be flown to.
    pub(crate) fn why_no_place(&self) -> String {
        let what_bars = |it: &Alternate| {
            let why = it.why_not().filter(|_| it.way.is_some());
            why.unwrap_or_else(|| self.why_no_way("no way there that may be flown", it.candidate.position))
        };
        let ranked = self.ranked_alternates();
        let barred = ranked.iter().map(|it| format!("{}: {}", it.candidate, what_bars(it)));
        let candidates = self.candidates();
        let forbidden =
            candidates.iter().filter_map(|it| Some(format!("{it}: {}", self.why_no_landing_at(it.position)?)));
        let told: Vec<String> = barred.chain(forbidden).take(MOST_BARRED).collect();
        format!("no place to land at can be reached: {}", told.join("; "))
    }

    /// The ditches that can be reached, in the order in which they are tried.
    pub(crate) fn places_to_ditch(&self) -> Vec<Choice> {
        let ranked = self.ranked_alternates();
        let ditches =
            ranked.iter().filter(|it| it.candidate.kind == SiteKind::Ditch && it.is_reachable() && !it.asks());
        ditches.map(Choice::of).collect()
    }

    /// Whether the battery no longer suffices for the way to `place`, while it does for another one.
    pub(crate) fn is_out_of_reach(&self, place: Ned) -> bool {
        let seen = self.seen_alternates();
        let is_chosen = |it: &&Alternate| it.candidate.position == place;
        let is_lost = seen.iter().find(is_chosen).is_some_and(|it| it.way.is_some() && !it.is_reachable());
        is_lost && seen.iter().any(|it| it.candidate.kind == SiteKind::Landing && it.is_reachable())
    }

    /// The landing that can be reached as the permissions are, and at which none has failed: while there is one, no vehicle is given up.
    pub(crate) fn landing_in_reach(&self) -> Option<String> {
        let ranked = self.ranked_alternates();
        let is_sure = |it: &&Alternate| it.is_sure() && it.candidate.kind == SiteKind::Landing;
        ranked.iter().find(is_sure).map(|it| it.candidate.to_string())
    }

    /// Every candidate at which no flag forbids to land, best first. One that was not looked at under the present permissions is looked
    /// at now, as far as the effort suffices that any search of a response may take.
    pub(super) fn ranked_alternates(&self) -> Vec<Alternate> {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return Vec::new() };
        let is_same = self.watch.alternates.entered.as_ref() == Some(&self.what_may_be_entered());
        let grants = self.permits_of_responses();
        let (limits, energy) = (self.limits_in_wind(), self.energy());
        let view = self.viewpoint(here, &grants, &limits, &energy);
        let mut legs_left = MOST_LEGS;
        let mut look = |candidate: &Candidate| {
            let Found { way, legs } = view.look_at(candidate, legs_left.min(LEGS_OF_A_LOOK));
            legs_left = legs_left.saturating_sub(legs);
            way
        };
        let candidates = self.candidates().into_iter().filter(|it| self.landing_forbidden_by(it.position).is_none());
        let mut alternates: Vec<Alternate> = candidates
            .map(|candidate| {
                let known = self.known_way(&candidate).filter(|_| is_same).cloned();
                let way = known.unwrap_or_else(|| look(&candidate));
                self.alternate(candidate, way)
            })
            .collect();
        rank(&mut alternates);
        alternates
    }

    fn alternate(&self, candidate: Candidate, way: Option<Way>) -> Alternate {
        let energy = self.energy();
        let charge = Charge {
            energy: &energy,
            left: self.seen.vehicle.and_then(|it| it.charge),
            lands_below: self.setup.table.lands_below(),
        };
        let failed_landings = self.failed_landings_at(candidate.position);
        Alternate::new(candidate, way, charge, failed_landings)
    }

    fn known_way(&self, candidate: &Candidate) -> Option<&Option<Way>> {
        self.watch.alternates.looks.iter().find(|it| it.candidate == *candidate)?.way.as_ref()
    }

    fn viewpoint<'a>(
        &'a self,
        here: Ned,
        grants: &'a Grants,
        limits: &'a FlightLimits,
        energy: &'a EnergyModel,
    ) -> Viewpoint<'a> {
        let around = self.surroundings(grants, limits, SiteKind::Landing);
        Viewpoint { from: here, around, energy, wind: self.wind() }
    }

    fn candidates(&self) -> Vec<Candidate> {
        let objectives = self.planner.mission.status.objectives.iter().map(|it| &it.objective);
        candidates(self.people.operator.landing_site, self.mission_sites(), objectives)
    }
}
