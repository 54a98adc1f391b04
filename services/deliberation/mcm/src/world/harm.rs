//! How a flight ends with the least harm ([`domain::harm`]), and which areas it enters without permission for that, or by a pilot's order.
//!
//! Each entry without permission is announced: to the control tower, to the operators, and in the record.

use std::collections::BTreeSet;

use domain::alternates::Alternate;
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::harm::{Harm, least};
use domain::site::SiteKind;

use super::control::OF_ITS_OWN;
use super::{Choice, World};
use crate::journal::{CONTINGENCY, Cause, Said};
use crate::permits::{Beyond, held_for};

/// Where a vehicle comes down that has to land.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Down {
    /// Where it is.
    Here,
    /// At the end of these points.
    Aside(Vec<Ned>),
    /// At this place.
    At(Choice),
}

impl World {
    /// Where the landing of the response under way ends, and what that harms.
    pub(crate) fn least_harm(&self) -> (Harm, Down) {
        self.end_of_landing(self.is_ordered_here())
    }

    /// Where a landing ends, and what that harms: of the ground here and within a minute of flight, of the places that can be reached for sure, and
    /// of free ground farther off, where it harms least. `insists`: a pilot wants it here.
    fn end_of_landing(&self, insists: bool) -> (Harm, Down) {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return (Harm::NONE, Down::Here) };
        let below = (self.harm_below(here), Down::Here);
        if insists || self.is_near_ground() || self.position_is_missing().is_some() {
            return below;
        }
        let aside = |accepts: Harm| {
            let way = self.way_to_ground(accepts)?;
            Some((accepts, if way.is_empty() { Down::Here } else { Down::Aside(way) }))
        };
        if let Some(free) = aside(Harm::NONE) {
            return free;
        }
        let on_the_way = if self.answer.beyond.areas().next().is_some() { Harm::AIRSPACE } else { Harm::NONE };
        let ranked = self.ranked_alternates();
        let places = ranked.iter().filter(|it| it.is_sure());
        let places = places.map(|it| (it.harm() | on_the_way, Down::At(Choice::of(it))));
        let nearest = aside(Harm::AIRCRAFT).filter(|_| Harm::AIRCRAFT < below.0);
        let far_off = || self.way_to_ground_far_off().map(|way| (Harm::NONE, Down::Aside(way)));
        let places: Vec<_> = places.collect();
        let is_none = places.iter().all(|(harm, _)| *harm != Harm::NONE);
        let far_off = is_none.then(far_off).flatten();
        least([below].into_iter().chain(nearest).chain(places).chain(far_off)).unwrap_or((Harm::NONE, Down::Here))
    }

    /// What coming down from `here` harms, by the permissions that there are.
    fn harm_below(&self, here: Ned) -> Harm {
        self.airspace(&self.permits().grants, self.setup.limits.leave_lead).harm_below(here)
    }

    /// The landing for which areas would be entered without permission, and these areas, rather than come down at an end that harms so much.
    fn behind_areas(&self, harm: Harm) -> Option<(Choice, BTreeSet<String>)> {
        let ranked = self.ranked_alternates();
        let is_behind = |it: &&Alternate| it.candidate.kind == SiteKind::Landing && it.is_reachable() && it.asks();
        let place = ranked.iter().find(is_behind).filter(|it| it.failed_landings == 0)?;
        let entering = (Harm::AIRSPACE | place.harm(), Some(place));
        let (_, chosen) = least([(harm, None), entering])?;
        let needs = chosen?.way.iter().flat_map(|(way, _)| way.needs.iter().cloned());
        Some((Choice::of(place), needs.collect()))
    }

    /// The landing of the response enters areas without permission where everything else harms more: where it would come down among people.
    pub(crate) fn enter_rather_than_harm(&mut self) {
        let (harm, _) = self.least_harm();
        if self.is_ordered_here() || self.position_is_missing().is_some() {
            return;
        }
        if let Some((place, areas)) = self.behind_areas(harm) {
            self.enter(areas, &format!("to land at {}, where else it would come down {harm}", place.words));
        }
    }

    /// An order with override to come down at `site` enters what the only way there leads through.
    pub(crate) fn enter_as_ordered(&mut self, site: Ned) {
        if self.is_ordered_with_override() && self.way_to(site).is_none() {
            let areas = self.needed_for_way(site);
            self.enter(areas, "ordered with override");
        }
    }

    fn enter(&mut self, areas: BTreeSet<String>, why: &str) {
        let mut all: BTreeSet<String> = self.answer.beyond.areas().cloned().collect();
        if areas.is_subset(&all) {
            return;
        }
        let by = self.needed_by();
        for area in &areas {
            self.permissions.send(area, why, by, &mut self.out.outbox);
        }
        let names: Vec<&str> = areas.iter().map(String::as_str).collect();
        let text = format!("enters area {} without permission: {why}", names.join(", "));
        let said = Said::new(CONTINGENCY, DecisionKind::Note, text).led_to_by(Cause::Response);
        self.record(said.about(self.response_row()));
        all.extend(areas);
        self.go_beyond(Beyond::Into(all));
    }

    pub(super) fn entered_without_permission(&self) -> Vec<String> {
        let grants = &self.permits().grants;
        self.answer.beyond.areas().filter(|it| !grants.contains_key(*it)).cloned().collect()
    }

    /// The response under way goes so far.
    pub(super) fn go_beyond(&mut self, beyond: Beyond) {
        self.answer.beyond = beyond;
        self.answer.permits.take();
    }

    /// Why the vehicle does not land here, though the way elsewhere has failed: another action follows, and less is harmed elsewhere.
    /// `None`: it lands here.
    pub(crate) fn why_land_elsewhere(&self) -> Option<String> {
        let [_, _, ..] = self.actions_left() else { return None };
        let (_, Down::At(place)) = self.least_harm() else { return None };
        let harm = self.harm_below(self.seen.vehicle?.position);
        Some(format!("it would come down {harm}, and {} can be reached", place.words))
    }

    /// What an order to land does, in words; `insists`: with override.
    pub(super) fn landing_in_words(&self, insists: bool) -> String {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else {
            return "lands here and ends the mission".into();
        };
        let (harm, down) = self.end_of_landing(insists);
        let below = self.harm_below(here);
        let because = format!("here it would come down {below}; order it with override to land here all the same");
        if let Some((place, areas)) = self.behind_areas(harm).filter(|_| !insists) {
            let (away_m, areas) =
                (place.position.horizontal_distance_m(here), areas.into_iter().collect::<Vec<_>>().join(", "));
            let words = place.words;
            return format!(
                "flies to {words}, {away_m:.0} m away, entering {areas} without permission, lands there and ends the mission: {because}"
            );
        }
        match down {
            Down::Here if harm == Harm::NONE => "lands here and ends the mission".into(),
            Down::Here => format!("lands here, {harm}, and ends the mission"),
            Down::Aside(way) => {
                let away_m = way.last().map_or(0.0, |it| it.horizontal_distance_m(here));
                format!("flies {away_m:.0} m aside, lands there and ends the mission: {because}")
            }
            Down::At(Choice { position, words, .. }) => {
                let away_m = position.horizontal_distance_m(here);
                format!("flies to {words}, {away_m:.0} m away, lands there and ends the mission: {because}")
            }
        }
    }

    /// Records what forbids a landing where the vehicle is, and whether it flies elsewhere first.
    pub(crate) fn say_what_forbids_landing(&mut self, flies: bool) {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return };
        let areas = self.areas_that_forbid_landing(here).join(", ");
        let (harm, down) = self.least_harm();
        let text = match (areas.is_empty(), flies, down) {
            (true, true, _) => "no landing here: an area below is about to apply; flies aside first".to_owned(),
            (false, true, Down::At(place)) => {
                format!("no landing here, in or over {areas}, {}: flies to {}", self.harm_below(here), place.words)
            }
            (false, true, _) => format!("no landing here, in or over {areas}: flies aside first"),
            (true, false, _) => format!("{}: lands where it is", self.why_not_aside()),
            (false, false, _) => format!("{}: lands where it is, in or over {areas}, {harm}", self.why_not_aside()),
        };
        self.say("contingency", text);
    }

    fn why_not_aside(&self) -> String {
        match self.is_left_to_autopilot() {
            true => OF_ITS_OWN.to_owned(),
            false if self.is_ordered_here() => "ordered with override".to_owned(),
            false => "no free ground in reach".to_owned(),
        }
    }

    /// Looks ahead while it flies: which permissions a response may use, and the ways to the places where the flight may end.
    pub(crate) fn look_ahead(&mut self) {
        self.look_for_held_areas();
        self.look_at_alternates();
    }

    /// Lets a response that brings the vehicle down, and that no landing is in reach of otherwise, enter areas whose permission is held
    /// although a flag forbids it: what was granted counts until it expires, and to ditch or to land anywhere is worse.
    pub(super) fn look_for_held_areas(&mut self) {
        if !self.comes_down() || !self.is_flying() {
            self.go_beyond(Beyond::Nowhere);
            return;
        }
        if self.answer.beyond != Beyond::Nowhere {
            return;
        }
        let (held, usable) = (held_for(&self.permits().grants, self.setup.limits.permission_margin), self.enterable());
        let areas: Vec<String> = held.into_iter().filter(|it| !usable.contains(it)).collect();
        if areas.is_empty() || self.landing_in_reach().is_some() {
            return;
        }
        self.go_beyond(Beyond::Held);
        let Some(place) = self.landing_in_reach() else {
            self.go_beyond(Beyond::Nowhere);
            return;
        };
        let (areas, row) = (areas.join(", "), self.narrowing().no_new_area);
        let although = match row {
            Some(row) => format!("`{}` is up", self.flags.name(row)),
            None => "the tower has not decided about it again since the start".to_owned(),
        };
        let text =
            format!("area {areas} may be entered although {although}: it is held, and else no landing can be reached");
        let cause = row.map_or(Cause::Response, Cause::Raised);
        let said = Said::new(CONTINGENCY, DecisionKind::Note, text).about(row).led_to_by(cause);
        self.record(said.taking(place, "with the permissions that are held".to_owned()));
    }
}
