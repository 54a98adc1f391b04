//! An operator's orders: each verb in each state, and the answers in words.
//!
//! The response to an order is a row of the contingency table like any other (`operator_*`); an order raises its flag
//! and does nothing else. With override it comes before other responses. An order that is repeated under its request id
//! gets the answer to the first one and does nothing.

use std::collections::BTreeSet;

use domain::contingency::{
    Clears, FRAME_MOVED, LEFT_TO_OTHERS, OPERATOR_ABORT as ABORT, OPERATOR_LAND as LAND, OPERATOR_PAUSE as PAUSE,
    OPERATOR_RETURN as RETURN, Then,
};
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::skill::Goal;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;
use v1::operator_command::Verb;

use super::World;
use super::crash::INSPECT_FIRST;
use super::orders::{ORDERS, SOURCE};
use crate::config::Verdict;
use crate::journal::Said;

/// A landing site farther from the origin than this is a typing mistake.
const FARTHEST_M: f64 = 100_000.0;

/// A vehicle on the ground this near to a place is there, in metres. (The planner's `horizontal_tolerance_m`.)
const AT_M: f64 = 3.0;

type Outcome = Result<String, String>;

#[derive(Debug, Clone, Copy)]
struct Order<'a> {
    by: &'a str,
    overrides: bool,
}

impl World {
    pub(crate) fn obey(&mut self, command: v1::OperatorCommand) -> v1::OperatorReply {
        let v1::OperatorCommand { request_id, operator, verb } = command;
        if let Some(reply) = self.people.operator.answers.get(&request_id) {
            return reply.clone();
        }
        let by = if operator.is_empty() { "the operator".to_owned() } else { operator };
        let order = |overrides| Order { by: &by, overrides };
        let (name, result) = match verb {
            _ if request_id.is_empty() => ("a command", Err("the order has no request id".to_owned())),
            None => ("a command", Err("it has no verb".to_owned())),
            Some(Verb::Start(_)) => ("start", self.start(&by)),
            Some(Verb::Pause(it)) => ("pause", self.pause(order(it.overrides))),
            Some(Verb::Resume(_)) => ("resume", self.go_on(&by)),
            Some(Verb::Abort(it)) => ("abort", self.abort(order(it.overrides))),
            Some(Verb::Return(it)) => ("return", self.return_home(order(it.overrides))),
            Some(Verb::LandAt(it)) => ("land at", self.land_at(it, order(it.overrides))),
            Some(Verb::Replan(_)) => ("replan", self.replan(&by)),
            Some(Verb::Acknowledge(request)) => ("acknowledge", self.acknowledge(&request.flag, &by)),
            Some(Verb::Inspected(_)) => ("inspected", self.inspected()),
            Some(Verb::DecidePlan(request)) => ("decide about the plan", self.decide(request, &by)),
        };
        let done = result.is_ok();
        let text = result.unwrap_or_else(|refusal| refusal);
        let (kind, outcome) =
            if done { (DecisionKind::OrderAccepted, "") } else { (DecisionKind::OrderRefused, "refused: ") };
        self.record(Said::new("operator", kind, format!("{by}: {name}: {outcome}{text}")));
        let reply = v1::OperatorReply { done, text };
        if !request_id.is_empty() {
            self.people.operator.answers.remember(request_id, reply.clone());
        }
        reply
    }

    pub(super) fn is_paused(&self) -> bool {
        self.flags.get(PAUSE).is_some_and(|it| it.holds())
    }

    fn start(&mut self, by: &str) -> Outcome {
        if self.over().is_some() {
            return self.begin_next_flight();
        }
        if self.uninspected_crash().is_some() {
            return Err(INSPECT_FIRST.into());
        }
        if !self.awaits_start() {
            return Err("the mission has started already".into());
        }
        self.accept_loss()?;
        self.accept_frame()?;
        self.take_control_back(by);
        self.people.operator.has_started = true;
        self.go_ahead();
        Ok("the mission starts".into())
    }

    fn pause(&mut self, order: Order) -> Outcome {
        if !self.may_fly() {
            self.refuse_if_not_under_way()?;
        }
        // An order that is replaced does not come back by itself: who resumes flies the mission on.
        let ended_by = ORDERS.into_iter().find(|it| *it != PAUSE && self.flags.is_up(it));
        let words = ended_by.filter(|_| self.mission.over.is_none()).map(|it| {
            format!("holds until resumed; `{it}` no longer counts: order it again, or a resume flies the mission on")
        });
        self.order(PAUSE, order, words.as_deref().unwrap_or("holds until resumed"))
    }

    fn go_on(&mut self, by: &str) -> Outcome {
        let is_left = LEFT_TO_OTHERS.into_iter().any(|it| self.flags.is_up(it));
        // In the air a response goes on after the pause, also when the mission is over.
        if !(self.is_flying() && (self.is_paused() || is_left)) {
            self.refuse_if_over()?;
        }
        if self.landings.unplanned.is_some() {
            // One order is enough, also where the vehicle touched down during a pause.
            if self.is_paused() {
                self.flags.take_back(PAUSE);
            }
            return self.start(by);
        }
        if self.awaits_start() {
            return Err("the mission has not started".into());
        }
        let is_frame_moved = self.flags.is_up(FRAME_MOVED);
        if !self.is_paused() && !self.memory.is_lost() && !is_left && !is_frame_moved {
            return Err("it does not hold for an operator".into());
        }
        if !is_left {
            // Who takes the vehicle back must not be kept from it; the row of the frame then holds.
            self.accept_frame()?;
        }
        let is_frame_forgotten = self.memory.is_lost() && self.is_flying();
        self.accept_loss()?;
        self.take_control_back(by);
        if self.is_paused() {
            self.flags.take_back(PAUSE);
        }
        let is_over = |row: &usize| {
            let holds = self.flags.get(self.flags.name(*row)).is_some_and(|it| it.holds());
            self.setup.table.rows()[*row].clears == Clears::WithCondition && !holds
        };
        Ok(match self.next_responder().filter(|it| !is_over(it)) {
            None if is_frame_forgotten => {
                let unknown = "an earlier order, such as an abort, may be forgotten, and whether the local frame moved \
                               meanwhile is not known: see that the vehicle is where it is shown";
                format!("goes on with a new plan; {unknown}")
            }
            None => "goes on with a new plan".into(),
            Some(other) if self.over().is_some() => format!("no longer holds; {} goes on", self.what_it_does(other)),
            Some(other) if self.setup.table.rows()[other].then != Then::Resume => {
                format!("no longer holds; {} goes on, and ends the mission", self.what_it_does(other))
            }
            Some(other) => format!("goes on once `{}` is over", self.flags.name(other)),
        })
    }

    fn abort(&mut self, order: Order) -> Outcome {
        if self.may_fly() {
            let does = self.landing_in_words(order.overrides);
            return self.order(ABORT, order, &does);
        }
        self.refuse_if_over()?;
        self.order(ABORT, order, "ends the mission on the ground")
    }

    /// An order to come down, to a vehicle on the ground whose mission is under way, whatever that waits for: it stays there, at
    /// `to` or not. It does not fly there, since an operator who wants it on the ground must never see it lift off.
    fn stay_down(&mut self, here: Ned, to: Ned, order: Order) -> Outcome {
        self.refuse_if_over()?;
        if self.landings.unplanned.is_none() {
            self.refuse_if_not_under_way()?;
        }
        if matches!(self.skills.present(), Some((Goal::Takeoff { .. }, _))) {
            return self.order(ABORT, order, "has not lifted off yet: stays, and ends the mission on the ground");
        }
        let does = match here.horizontal_distance_m(to) < AT_M {
            true => "is on the ground there: stays, and ends the mission on the ground".to_owned(),
            false => format!(
                "is on the ground at ({:.0}, {:.0}) and does not fly to ({:.0}, {:.0}): stays, and ends the mission on the ground",
                here.north_m, here.east_m, to.north_m, to.east_m
            ),
        };
        self.order(ABORT, order, &does)
    }

    /// An order to come down elsewhere, to a vehicle that touches the ground or has hardly left it.
    fn land_at_once(&mut self, order: Order) -> Outcome {
        self.order(ABORT, order, "touches the ground, or has hardly left it: lands where it is, and ends the mission")
    }

    fn return_home(&mut self, order: Order) -> Outcome {
        if self.is_near_ground() {
            return self.land_at_once(order);
        }
        match self.seen.vehicle.filter(|it| !it.flying) {
            Some(vehicle) => self.stay_down(vehicle.position, Ned::default(), order),
            // One that was not heard yet may be in the air; on the ground the order ends the mission there.
            None => {
                let words = "flies home, lands and ends the mission".to_owned();
                let words = words + &self.areas_in_words(Ned::default(), RETURN, order);
                self.order(RETURN, order, &words)
            }
        }
    }

    /// What an order to come down at `site` does about areas whose permission is missing, as the end of a sentence; empty if there is a way, or
    /// none with permissions either.
    fn areas_in_words(&self, site: Ned, flag: &str, order: Order) -> String {
        let needed = match self.way_to(site) {
            Some(_) => BTreeSet::new(),
            None => self.needed_for_way(site),
        };
        let areas = needed.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        match (needed.is_empty(), order.overrides) {
            (true, _) => String::new(),
            (false, true) => format!("; enters {areas} without permission, which the only way leads through"),
            (false, false) => {
                let otherwise = self.what_follows(flag);
                format!(
                    "; asks for {areas} first, which the only way leads through; if refused: {otherwise}; order it with override to \
                     enter without permission"
                )
            }
        }
    }

    fn land_at(&mut self, request: v1::LandAt, order: Order) -> Outcome {
        let site = landing_site(request).map_err(|invalid| invalid.to_string())?;
        let site = site.at_height(self.planner.mission.ground.height_m(site));
        if FARTHEST_M < site.horizontal_distance_m(Ned::default()) {
            return Err(format!("the site is farther than {FARTHEST_M} m from the origin"));
        }
        let vehicle = self.seen.vehicle.ok_or("where the vehicle is, is not known")?;
        if !vehicle.flying {
            return self.stay_down(vehicle.position, site, order);
        }
        if self.is_near_ground() {
            return self.land_at_once(order);
        }
        if let Some(why) = self.unfit_to_land(site) {
            return Err(format!("the place {why}"));
        }
        if let Some(shortfall) = self.too_far_to_land(site, order.overrides) {
            return Err(format!("the place is too far: the way {shortfall}"));
        }
        let areas = self.areas_in_words(site, LAND, order);
        if areas.is_empty() && self.way_to(site).is_none() {
            return Err("there is no way to that place that keeps out of areas that may not be entered".into());
        }
        let is_another = self.people.operator.landing_site.replace(site) != Some(site);
        if is_another {
            // It is not the same order again if it names another place.
            self.lower(LAND);
        }
        let at = match site.height_m() {
            0.0 => String::new(),
            height_m => format!(", where the ground is at {height_m:.0} m"),
        };
        let words =
            format!("flies to ({:.0}, {:.0}){at}, lands there and ends the mission{areas}", site.north_m, site.east_m);
        self.order(LAND, order, &words)
    }

    fn replan(&mut self, by: &str) -> Outcome {
        self.refuse_if_not_under_way()?;
        if let Some(flag) = self.next_responder().map(|row| self.flags.name(row)) {
            return Err(format!("`{flag}` is answered; a new plan is made when that is over"));
        }
        self.planner.withdraw(format!("{by} wants a new plan"));
        Ok("a new plan is made".into())
    }

    fn acknowledge(&mut self, flag: &str, by: &str) -> Outcome {
        let Some(raised) = self.flags.get_mut(flag) else { return Err(format!("`{flag}` is not up")) };
        if let Some(other) = &raised.acknowledged_by {
            return Err(format!("{other} has acknowledged `{flag}` already"));
        }
        raised.acknowledged_by = Some(by.to_owned());
        Ok(format!("`{flag}` acknowledged"))
    }

    fn decide(&mut self, request: v1::DecidePlan, by: &str) -> Outcome {
        let Some((plan, _)) = self.planner.request.proposal() else {
            return Err("no plan waits for approval".into());
        };
        let waiting = plan.revision;
        if waiting != request.revision {
            return Err(format!("plan {waiting} waits for approval, not plan {}", request.revision));
        }
        let (verdict, words) = match request.approve {
            true => (Verdict::Approve, format!("plan {waiting} is flown")),
            false => (Verdict::Refuse, format!("plan {waiting} is not flown; holds until resumed")),
        };
        self.decide_plan(verdict, &format!("by {by}"));
        Ok(words)
    }

    /// Raises the flag of an operator's row, in place of the order before, and answers what follows: `does` at once,
    /// unless another response comes first.
    fn order(&mut self, flag: &str, order: Order, does: &str) -> Outcome {
        let Some(row) = self.flags.number(flag) else {
            return Err(format!("the contingency table has no row `{flag}`"));
        };
        let is_up = self.flags.get(flag).is_some_and(|it| it.holds());
        let overrides_already = self.flags.overrides(row);
        let takes_back = self.take_control_back(order.by);
        for other in ORDERS {
            if other != flag && self.flags.is_up(other) {
                self.lower(other);
                self.people.operator.landing_site.take_if(|_| other == LAND);
                self.say("operator", format!("`{other}` is replaced by `{flag}`"));
            }
        }
        self.raise(flag, SOURCE, format!("ordered by {}", order.by));
        let without_override = self.next_responder().filter(|it| *it != row);
        match order.overrides {
            true => self.flags.override_all(row),
            false => self.flags.override_nothing(row),
        }
        let first = self.next_responder().filter(|it| *it != row);
        if let (Some(other), None) = (without_override, first) {
            let other = self.flags.name(other).clone();
            self.say("operator", format!("{}: `{flag}` overrides `{other}`", order.by));
        }
        let changes_nothing = !takes_back && first == without_override && overrides_already == order.overrides;
        if is_up && changes_nothing {
            return Err(match first {
                None => format!("`{flag}` is under way already"),
                Some(other) => format!("ordered already; it waits behind {}", self.what_it_does(other)),
            });
        }
        Ok(match first {
            None => does.to_owned(),
            Some(other) if order.overrides => {
                format!("{does}, but not before {}: that may not be overridden", self.what_it_does(other))
            }
            Some(other) => {
                format!(
                    "{does}, but not before {}; order it with override to have it at once",
                    self.what_it_does(other)
                )
            }
        })
    }

    /// What the row of `flag` does if its first action fails.
    fn what_follows(&self, flag: &str) -> String {
        let actions = self.setup.table.row(flag).into_iter().flat_map(|row| row.actions.iter().skip(1));
        actions.map(|it| it.tree.as_str()).collect::<Vec<_>>().join(", else ")
    }

    fn what_it_does(&self, row: usize) -> String {
        let row = &self.setup.table.rows()[row];
        format!("`{}` ({})", row.flag, row.response())
    }

    pub(super) fn refuse_if_over(&self) -> Result<(), String> {
        self.over().map_or(Ok(()), |reason| Err(format!("the mission is over: {reason}")))
    }

    fn refuse_if_not_under_way(&self) -> Result<(), String> {
        self.refuse_if_over()?;
        if self.awaits_start() {
            return Err("the mission has not started".into());
        }
        Ok(())
    }
}

fn landing_site(request: v1::LandAt) -> Result<Ned, InvalidMessage> {
    let position = request.position.ok_or(InvalidMessage::Missing("position"))?;
    Ned::try_from(v1::Ned { down_m: 0.0, ..position })
}
