//! Which flag is answered, the progress of its response, and what the other flags wait for.

use std::sync::Arc;
use std::time::Duration;

use domain::contingency::group::Group;
use domain::contingency::label::Label;
use domain::contingency::{Clears, OPERATOR_LAND, Phase, Severity, Then};
use domain::decision::{DecisionKind, Rejected};
use domain::geometry::Ned;
use domain::harm::Harm;
use domain::mission::MissionOutcome;
use domain::skill::Goal;
use domain::task::TaskGoal;
use domain::time::Time;

use super::control::OF_ITS_OWN;
use super::orders::is_order;
use super::places::SAME_SITE_M;
use super::{Stay, World};
use crate::clients::skills::Handle;
use crate::flags::age_s;
use crate::journal::{CONTINGENCY, Cause, Entry, Passed, Said};
use crate::permits::Beyond;

/// The longest wait for a way of a response to a fault of the vehicle or its battery, or while a flag bars areas: slack counts neither. (ENG: 12 % of the battery
/// by hovering; a tower that closes an area for a crossing opens it within one or two minutes.)
pub(super) const WITH_FAULT: Duration = Duration::from_secs(180);
/// The longest stay in an area in which the vehicle must not be. (ENG: five minutes: an area that applies for longer is left, or landed in.)
const INSIDE: Duration = Duration::from_secs(300);
/// A failsafe of the autopilot passes within this time, or lasts. (ENG: as long as a control tower takes to answer.)
const PASSING: Duration = Duration::from_secs(10);
/// Who sees the autopilot's failsafe has acted by then. (ENG: a person's time.)
const PILOT_ACTS: Duration = Duration::from_secs(180);

/// The pause before the next try of a response, by the number of failed tries. (ENG: none before the second try, since
/// a command may have been lost; later long enough that the table's other actions get their turn within seconds.)
const PAUSES: [Duration; 6] = [
    Duration::ZERO,
    Duration::from_millis(500),
    Duration::from_secs(1),
    Duration::from_secs(2),
    Duration::from_secs(4),
    Duration::from_secs(8),
];
/// Time within which the vehicle must be on the ground after an action that brings it down has succeeded.
const TOUCHDOWN_LIMIT: Duration = Duration::from_secs(10);

/// Rows that are recorded as not answered when another one responds. (ENG: a sentence that can be read.)
const MOST_REJECTED: usize = 8;

/// The response that is under way.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ActiveResponse {
    pub(super) row: usize,
    /// The action that is tried, and the number of its tries so far.
    pub(super) action: usize,
    tries: u32,
    failures: usize,
    not_before: Time,
    /// Since when no action is left to fly.
    flown: Option<Time>,
    /// Since when the action holds because there is no way that may be flown.
    waits_since: Option<Time>,
    /// Since when it waits until a failsafe of the autopilot's own is over.
    left_since: Option<Time>,
    /// Something was flown for the present try.
    has_flown: bool,
}

/// What follows for a flag whose response has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reset {
    Down,
    /// It stays up as long as its condition holds.
    Awaited,
    StillInAir,
}

impl World {
    /// Why no objective is flown any more; `None` while the mission goes on.
    pub(super) fn ending(&self) -> Option<String> {
        if let Some(over) = &self.mission.over {
            return Some(format!("the mission is over: {}", over.reason));
        }
        let row = self.responder().filter(|row| self.setup.table.rows()[*row].then != Then::Resume)?;
        Some(format!("`{}` ends the mission", self.flags.name(row)))
    }

    pub(crate) fn answered_flag(&self) -> Option<&Arc<str>> {
        Some(self.flags.name(self.responder()?))
    }

    pub(crate) fn begin_response(&mut self, row: usize) {
        self.answer.response = Some(ActiveResponse { row, not_before: self.now.time, ..Default::default() });
        self.answer.has_rested = false;
        self.go_beyond(Beyond::Nowhere);
        let phase = self.flight_phase();
        // One that only slows is in force beside it.
        let others = self.flags.rows_up().filter(|it| *it != row && !self.setup.table.rows()[*it].only_slows());
        let others = others.take(MOST_REJECTED);
        let passed = others.map(|other| (other, self.why_passed(other, row, phase))).collect();
        self.out.journal.decided(self.now, Entry::Responding(row, passed));
    }

    /// Whether the last response was over for a while: what follows is another one.
    pub(crate) fn has_rested(&self) -> bool {
        self.answer.has_rested
    }

    /// Why `other`, whose flag is up, does not respond when `row` begins to.
    fn why_passed(&self, other: usize, row: usize, phase: Phase) -> Passed {
        let [passed, begun] = [other, row].map(|it| &self.setup.table.rows()[it]);
        if !passed.phases.contains(&phase) {
            Passed::OutOfPhase(phase)
        } else if passed.severity() < begun.severity() {
            Passed::LessSevere
        } else if self.flags.overrides(row) && passed.may_be_overridden() {
            Passed::Overridden
        } else if passed.label == Label::Comfort && begun.label != Label::Comfort {
            Passed::Optional
        } else {
            Passed::LessUrgent
        }
    }

    /// The next try of the response is one of `action`; returns when it may begin.
    pub(crate) fn await_try(&mut self, action: usize) -> Time {
        let Some(response) = &mut self.answer.response else { return self.now.time };
        if response.action != action {
            (response.action, response.tries, response.waits_since) = (action, 0, None);
        }
        (response.flown, response.has_flown) = (None, false);
        let not_before = response.not_before;
        self.look_for_held_areas();
        not_before
    }

    /// There is no way to `site` now, for the reason `why`. Asks for the permissions that may open one. Returns whether
    /// the response holds until then: before the latest moment, a missing way does not count as a failed try.
    pub(crate) fn may_wait_for_way(&mut self, site: Ned, why: &str) -> bool {
        self.ask_for_way(site);
        let row = self.response_row().map(|row| &self.setup.table.rows()[row]);
        let answers_a_fault = row.is_some_and(|it| matches!(it.group, Some(Group::Energy | Group::Vehicle)));
        let is_limited = answers_a_fault || self.narrowing().no_new_area.is_some();
        let at_most = match row {
            // It lands elsewhere. Where that harms somebody or the aircraft, it comes last.
            Some(row) if row.ends_a_wait() && self.least_harm().0 == Harm::NONE => Duration::ZERO,
            _ if is_limited => WITH_FAULT,
            _ => Duration::MAX,
        };
        self.may_wait(Duration::ZERO, (self.slack_for(site), at_most), &self.why_no_way(why, site))
    }

    /// The vehicle does not fly out of the area in which it must not be. Returns whether it may hold there until the area is
    /// over, or there is a way.
    pub(crate) fn may_stay_inside(&mut self, stay: &Stay) -> bool {
        stay.at_least.is_some_and(|it| self.may_wait(it, (self.slack_here(), INSIDE), &stay.why))
    }

    /// Whether the response may hold on, of which it must do `at_least` this much more: with this slack, and `at_most` in all. Says so when
    /// that begins.
    pub(super) fn may_wait(&mut self, at_least: Duration, (slack, at_most): (Duration, Duration), why: &str) -> bool {
        let now = self.now.time;
        let Some(response) = self.answer.response.as_mut() else { return false };
        let since = response.waits_since.unwrap_or(now);
        let left = slack.min(at_most.saturating_sub(now - since));
        if left.is_zero() || left < at_least {
            return false;
        }
        if response.waits_since.replace(since).is_none() {
            self.say_it_waits(why, left);
        }
        true
    }

    fn say_it_waits(&mut self, why: &str, slack: Duration) {
        let Some(row) = self.response_row() else { return };
        let text = format!("`{}` waits: {why}; holds for up to {} s", self.flags.name(row), slack.as_secs());
        let what = self.actions_left().first().map_or_else(String::new, |it| it.tree.clone());
        let said = Said::new(CONTINGENCY, DecisionKind::ResponseWaits, text).about(row);
        self.record(said.taking("holds", String::new()).rejecting(vec![Rejected { what, why: why.to_owned() }]));
    }

    /// Whether a flight of the response, which is not begun or was interrupted, may wait until a failsafe of the
    /// autopilot's own is over: until the latest moment, but for one that passes by itself, and for a pilot's time to
    /// act. An interrupted try does not count as failed.
    pub(crate) fn may_wait_for_autopilot(&mut self) -> bool {
        let (now, left) = (self.now.time, self.left_to_autopilot());
        let Some(response) = self.answer.response.as_mut() else { return false };
        if response.left_since.replace(response.left_since.unwrap_or(now)).is_none() && !left.is_zero() {
            self.say_it_waits(OF_ITS_OWN, left);
        }
        !left.is_zero()
    }

    fn left_to_autopilot(&self) -> Duration {
        let since = self.answer.response.as_ref().and_then(|it| it.left_since);
        let waited = since.map_or(Duration::ZERO, |it| self.now.time - it);
        self.slack_of_autopilot().clamp(PASSING.saturating_sub(waited), PILOT_ACTS.saturating_sub(waited))
    }

    /// No failsafe of the autopilot is waited for any more.
    pub(crate) fn has_waited_for_autopilot(&mut self) {
        // A wait that has ended in a landing where the vehicle is was ended by that.
        let is_left = !self.left_to_autopilot().is_zero();
        let since = self.answer.response.as_mut().and_then(|it| Some((it.row, it.left_since.take()?)));
        if let Some((row, since)) = since.filter(|_| is_left) {
            let (flag, waited_s) = (self.flags.name(row).clone(), (self.now.time - since).as_secs());
            self.say(
                "contingency",
                format!("`{flag}` goes on after {waited_s} s: the autopilot's own failsafe is over"),
            );
        }
    }

    pub(crate) fn has_found_way(&mut self) {
        let waited = self.answer.response.as_mut().and_then(|it| it.waits_since.take());
        if let Some(since) = waited {
            let waited_s = (self.now.time - since).as_secs();
            self.say("contingency", format!("there is a way again after {waited_s} s"));
        }
    }

    pub(crate) fn try_failed(&mut self, why: &str) {
        let Some(response) = &mut self.answer.response else { return };
        response.tries += 1;
        response.failures += 1;
        let pause = PAUSES[(response.failures - 1).min(PAUSES.len() - 1)];
        response.not_before = self.now.time + pause;
        let ActiveResponse { row, action, tries, has_flown, .. } = *response;
        let Some(flown) = self.setup.table.rows()[row].actions.get(action) else { return };
        let actions = &self.setup.table.rows()[row].actions;
        let next = &actions[if flown.tries <= tries { (action + 1) % actions.len() } else { action }].tree;
        let flag = self.flags.name(row);
        let when = if pause.is_zero() { "next".to_owned() } else { format!("in {:.1} s", pause.as_secs_f64()) };
        let text = format!("`{flag}`: {} failed (try {tries} of {}): {why}; {when}: {next}", flown.tree, flown.tries);
        if flown.tries <= tries {
            // The next one may be the same action, which then has all its tries again.
            response.tries = 0;
        }
        let kind = if has_flown { DecisionKind::ResponseFailed } else { DecisionKind::ResponseSkipped };
        let given_up = (*next != flown.tree).then(|| Rejected { what: flown.tree.clone(), why: why.to_owned() });
        let said = Said::new(CONTINGENCY, kind, text).about(row).taking(next.clone(), String::new());
        self.record(said.rejecting(given_up.into_iter().collect()));
    }

    /// The response to the flag of this row has ended. Takes the flag down if the row says so.
    pub(crate) fn reset_flag(&mut self, number: usize) -> Reset {
        let (row, Some(flag)) = (&self.setup.table.rows()[number], self.flags.of_row(number)) else {
            return Reset::Down;
        };
        let may_fall = match row.clears {
            Clears::AfterAction => true,
            Clears::WithCondition => !flag.holds(),
            Clears::Never => (!flag.holds() && !row.is_watched()) || self.is_on_ground(),
        };
        let brings_down = row.clears == Clears::Never && row.then != Then::Resume;
        if !may_fall {
            let (now, is_flying) = (self.now.time, self.is_flying());
            let flown = self.answer.response.as_mut().map_or(now, |it| *it.flown.get_or_insert(now));
            let is_late = brings_down && is_flying && TOUCHDOWN_LIMIT <= now - flown;
            return if is_late { Reset::StillInAir } else { Reset::Awaited };
        }
        self.flag_answered(number);
        Reset::Down
    }

    /// Takes down the flag whose response has ended, and ends the mission if its row does.
    fn flag_answered(&mut self, number: usize) {
        let Some(flag) = self.flags.of_row(number) else { return };
        let then = self.setup.table.rows()[number].then;
        let reason = format!("`{}`: {}{}", self.flags.name(number), flag.reason, self.where_it_came_down(number));
        match then {
            Then::Resume => {}
            Then::EndMission => self.end_mission(MissionOutcome::Emergency, reason),
            Then::Crashed => self.end_mission(MissionOutcome::Crash, reason),
        }
        self.clear(number, "", then != Then::Resume);
    }

    /// Where the vehicle stands instead, if it did not come to the place to which the response of this row flies.
    fn where_it_came_down(&self, number: usize) -> String {
        let row = &self.setup.table.rows()[number];
        let Some(vehicle) = self.seen.vehicle.filter(|it| !it.flying && row.severity() == Severity::Return) else {
            return String::new();
        };
        let (place, words) = match self.landing_site().filter(|_| row.flag == OPERATOR_LAND) {
            Some(site) => (site, "the ordered place"),
            None => (Ned::default(), "home"),
        };
        let away_m = vehicle.position.horizontal_distance_m(place);
        if away_m < SAME_SITE_M { String::new() } else { format!("; came down {away_m:.0} m from {words}") }
    }

    /// Takes the flag of `row` down, and records it.
    fn clear(&mut self, row: usize, why: &str, ends_mission: bool) {
        let name = self.flags.name(row).clone();
        self.lower(&name);
        let text = format!("`{name}` is over{why}");
        let said =
            Said::new(CONTINGENCY, DecisionKind::ContingencyCleared, text).about(row).led_to_by(Cause::Case(row));
        self.record(said.ending_mission(ends_mission));
    }

    /// Takes a flag down, independent of its row.
    pub(super) fn lower(&mut self, name: &str) {
        self.flags.lower(name);
        self.answer.response = self.answer.response.take().filter(|it| &**self.flags.name(it.row) != name);
    }

    /// Takes down the flags whose condition has gone before their row had its turn: nothing is to be done about them any more.
    pub(super) fn let_unanswered_flags_fall(&mut self) {
        let waits =
            |row: usize| self.setup.table.rows()[row].clears == Clears::WithCondition && !self.is_under_way(row);
        let gone = self.flags.up().filter(|(row, flag)| !flag.holds() && waits(*row)).map(|(row, _)| row);
        for row in gone.collect::<Vec<_>>() {
            self.clear(row, ": what raised it is gone", false);
        }
    }

    /// On the ground at rest: ends a response that ends the mission, and takes down flags that count only in the air.
    pub(super) fn let_flags_fall_on_ground(&mut self) {
        let then = |row: &usize| self.setup.table.rows()[*row].then;
        // A crash counts more than the response during which it happened.
        let crashed = self.flags.rows_up().find(|row| then(row) == Then::Crashed);
        // An order to come down that waited for another response is carried out by now: nothing lifts off after it.
        let is_ordered = |row: &usize| is_order(self.flags.name(*row)) && then(row) != Then::Resume;
        let ends = || self.next_responder().filter(|row| then(row) != Then::Resume);
        if let Some(row) = crashed.or_else(ends).or_else(|| self.flags.rows_up().find(is_ordered)) {
            self.flag_answered(row);
        }
        for row in self.flags.rows_up().filter(|row| !self.stays_up_on_ground(*row)).collect::<Vec<_>>() {
            self.monitor.listed.fell_on_ground(self.flags.name(row));
            self.clear(row, ": the vehicle is on the ground", false);
        }
        if self.mission.over.is_some() {
            // Flags that are still up are reported, and no longer answered.
            self.answer.response = None;
        }
    }

    /// Whether the flag of `row`, which is up, says something of a vehicle at rest on the ground: one that counts there; after the end of the
    /// mission as long as its condition holds, or if it has risen since the vehicle came to rest. An order is obeyed by then.
    fn stays_up_on_ground(&self, row: usize) -> bool {
        let (is_over, name, flag) = (self.mission.over.is_some(), self.flags.name(row), self.flags.of_row(row));
        let (row, now) = (&self.setup.table.rows()[row], self.now.time);
        let lasts = || row.clears == Clears::WithCondition && flag.is_some_and(|it| it.holds());
        let rested_s = || self.seen.at_rest_since.map_or(0.0, |it| (now - it).as_secs_f64());
        let is_new = || flag.is_some_and(|it| age_s(it, now) < rested_s());
        row.phases.contains(&Phase::OnGround) && (!is_over || ((lasts() || is_new()) && !is_order(name)))
    }

    pub(crate) fn start_skill(&mut self, goal: Goal, along: Vec<Arc<TaskGoal>>) -> Handle {
        if let Some(response) = &mut self.answer.response {
            response.has_flown = true;
        }
        self.skills.start(self.now.time, goal, along)
    }

    /// The response lands where the vehicle is, instead of flying elsewhere.
    pub(crate) fn say_it_lands_at_once(&mut self) {
        if let Some(row) = self.response_row() {
            let flag = self.flags.name(row).clone();
            let text = format!("`{flag}`: lands where it is: it has hardly lifted off, or touches the ground");
            self.record(Said::new(CONTINGENCY, DecisionKind::Note, text).about(row));
        }
    }
}
