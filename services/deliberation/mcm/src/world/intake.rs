//! Messages and replies, parsed as they come in. Content that makes no sense is refused here, with its reason, and
//! changes nothing.

use domain::decision::DecisionKind;
use domain::permission::Permission;
use domain::plan::Answered;
use domain::skill::{SkillEvent, SkillOutcome, SkillPhase};
use domain::wire::{InvalidMessage, decision, finite, permission};
use kittiwake_proto::topics::{Message, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{CallError, CallId};
use signed_permissions::belief::{Taken, ToAsk, Why};

use super::World;
use super::monitor_flags::{Level, ListedFlag};
use crate::clients::planner::{NoAnswer, Question};
use crate::config::Config;
use crate::journal::{Cause, Said};
use crate::outbox::Purpose;
use crate::vehicle::Vehicle;

/// Of the words in which a tower refuses a request, in characters: as many as its reason for a decision may have bytes.
const LONGEST_REFUSAL: usize = 256;

impl World {
    pub(crate) fn take_in(&mut self, message: Message) {
        let topic = message.topic();
        if let Err(invalid) = self.parse_and_take_in(message) {
            self.out.outbox.refuse(topic, invalid);
        }
    }

    pub(crate) fn monitor_started(&mut self, vehicle: &str) {
        if vehicle == self.mission.vehicle_name {
            self.monitor.listed.monitor_started();
        }
    }

    fn parse_and_take_in(&mut self, message: Message) -> Result<(), InvalidMessage> {
        let now = self.now.time;
        match message {
            Message::Introspection(mut introspection) => {
                self.monitor.spoke = Some(now);
                let judge = (&mut self.seen.flight, self.setup.limits.pace);
                let vehicle = Vehicle::from_wire(now, &introspection, judge);
                let traffic = self.seen.traffic.hear(&mut introspection);
                self.seen.skills = std::mem::take(&mut introspection.skills);
                self.monitor.told.hear(&introspection, now);
                let flags = std::mem::take(&mut introspection.flags).into_iter();
                let undecided = std::mem::take(&mut introspection.undecided_flags).into_iter().collect();
                let level = Level { up: flags.map(listed).collect(), undecided };
                self.monitor.flags.extend(self.monitor.listed.compare(level));
                let vehicle = vehicle?;
                self.seen.skills_in_flight = vehicle.map_or(self.seen.skills_in_flight, |it| it.flying);
                self.monitor.vehicle = vehicle.or(self.monitor.vehicle);
                traffic?;
            }
            Message::SkillEvent(event) => {
                let event = SkillEvent::try_from(event)?;
                self.skills.on_event(now, &event);
                self.skills.take_along_failures().into_iter().for_each(|it| self.along_failed(it));
                match event.phase {
                    _ if !event.along.is_empty() => return Ok(()),
                    SkillPhase::Execute => self.skill_flown(),
                    SkillPhase::Ended(SkillOutcome::Preempted) => {
                        self.skill_pre_empted(event.flown_by_other, &event.reason);
                    }
                    _ => {}
                }
                self.seen.confirmed.learn_from(now, &event);
                self.seen.vehicle =
                    self.seen.vehicle.map(|vehicle| self.seen.confirmed.correct(vehicle, now, &self.setup.limits));
            }
            Message::SkillControl(control) => self.told_who_flies(control.flown_by_other),
            Message::SkillFeedback(feedback) => {
                let distance_left_m = finite("distance_left_m", feedback.distance_left_m)?;
                self.skills.on_feedback(now, feedback.skill_id, distance_left_m);
            }
            Message::PermissionLedger(ledger) => {
                let tower_start = ledger.tower_start;
                let is_whole = ledger.after_area.is_empty() && ledger.through_area.is_empty();
                let ledger: Vec<Permission> = permission::ledger(ledger)?;
                if self.permissions.on_tower(now, tower_start, is_whole) {
                    self.watch.airspace.invalidate();
                    self.say("permission", "the control tower was started again".to_owned());
                }
                let pace = self.setup.limits.pace;
                let Taken { decided, refused, to_ask } = self.permissions.on_ledger(self.now, pace, ledger);
                for decided in decided {
                    self.watch.airspace.invalidate();
                    let said = Said::new("permission", DecisionKind::PermissionDecided, decided.to_string());
                    let asked = Cause::Asked(decided.area.clone());
                    self.record(said.about_area(decided.area).led_to_by(asked));
                }
                for (area, refusal) in refused {
                    self.out.outbox.refuse(Topic::PermissionLedger, format_args!("area {area}: {refusal}"));
                    if self.permissions.is_news(&area, &refusal) {
                        self.say("permission", format!("area {area}: a permission is not believed: {refusal}"));
                    }
                }
                for line in to_ask {
                    let (now, by) = (self.now.time, self.needed_by());
                    if self.permissions.doubt(now, &line, by, &mut self.out.outbox) {
                        self.record(asking_about(line));
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    pub(crate) fn take_reply(&mut self, call: CallId, result: Result<Response, CallError>) {
        let Some(purpose) = self.out.outbox.purpose(call) else { return };
        let (now, timeout) = (self.now.time, self.setup.limits.request_timeout);
        match purpose {
            Purpose::StartSkill(id) => {
                let reply = result.map(|response| match response {
                    Response::Skill(reply) if reply.skill_id != 0 => Ok(reply.skill_id),
                    Response::Skill(reply) => Err(reply.refusal),
                    _ => Err("the skill manager answered something else".into()),
                });
                self.skills.on_reply(now, &id, reply, timeout, &mut self.out.outbox);
            }
            Purpose::SkillTable => {
                if let Ok(Response::SkillTable(table)) = result {
                    match table.skills.into_iter().map(SkillEvent::try_from).collect::<Result<Vec<_>, _>>() {
                        Ok(table) => {
                            self.skills.on_table(now, &table);
                            self.skills.take_along_failures().into_iter().for_each(|it| self.along_failed(it));
                        }
                        Err(invalid) => self.out.outbox.refuse(Service::SkillTable, invalid),
                    }
                }
            }
            Purpose::Replan(id) => {
                let (basis, state) = (self.basis(), self.planning_state());
                let (present, moved_m) = (basis.clone(), self.setup.limits.config.arrival_radius_m.get());
                let holds = |question: &Question| state.is_some_and(|state| question.holds(&state, &present, moved_m));
                let Config { plan_approval, plan_approval_limit_s, .. } = self.setup.limits.config;
                let approval = (plan_approval, plan_approval_limit_s.seconds());
                let reply = plan_reply(result);
                if let Err(NoAnswer::Invalid(invalid)) = &reply {
                    self.out.outbox.refuse(Service::Replan, invalid);
                }
                let words = self.planner.on_plan(now, &id, reply, timeout, (basis, holds), approval);
                if let Some((kind, words)) = words {
                    let is_finished = kind == DecisionKind::PlanFinished;
                    self.record(Said::new("plan", kind, words).ending_mission(is_finished));
                }
            }
            Purpose::Edit(number) => self.take_edit_reply(number, result),
            Purpose::Permission(area) => match result {
                Err(error) => self.permissions.on_undelivered(&area, error),
                Ok(Response::Permission(receipt)) if !receipt.received => {
                    self.permission_request_refused(&area, &receipt.refusal);
                }
                Ok(_) => {}
            },
            // An event of the skill itself says that it was cancelled.
            Purpose::CancelSkill(skill_id) if result.is_err() => self.skills.cancel_again(self.now.time, skill_id),
            Purpose::CancelSkill(_) => {}
        }
    }

    /// The control tower does not take the request: nothing will be decided about it.
    fn permission_request_refused(&mut self, area: &str, refusal: &str) {
        let why: String = refusal.chars().take(LONGEST_REFUSAL).collect();
        let why = if why.is_empty() { "it gives no reason" } else { &why };
        let reason = format!("the control tower has refused the request: {why}");
        self.permissions.on_refused(area, reason.clone());
        let said = Said::new("permission", DecisionKind::PermissionDecided, format!("area {area}: {reason}"));
        self.record(said.about_area(area.to_owned()).led_to_by(Cause::Asked(area.to_owned())));
    }
}

/// The record of a question to the tower about this line.
fn asking_about(line: ToAsk) -> Said {
    let ToAsk { area, decision, why } = line;
    let granted = match why {
        Why::InAdvance => "in advance",
        Why::BeforeTheStart => "before the start",
        Why::SaysNo { latest } => {
            let text = format!(
                "area {area}: a decision is not believed: number {decision} says no, and a later decision is known: {latest}; the tower is asked again"
            );
            return Said::new("permission", DecisionKind::Note, text);
        }
    };
    let text = format!("asking for area {area}, which was granted {granted}");
    Said::new("permission", DecisionKind::PermissionAsked, text).about_area(area)
}

fn listed(flag: v1::RaisedFlag) -> ListedFlag {
    let v1::RaisedFlag { name, reason, value, threshold, unit, rise, .. } = flag;
    ListedFlag { name, rise, reason, measured: decision::measured(value, threshold, &unit) }
}

fn plan_reply(result: Result<Response, CallError>) -> Result<Answered, NoAnswer> {
    match result? {
        Response::Replan(reply) => Ok(Answered::try_from(reply)?),
        _ => Err(InvalidMessage::Missing("reply").into()),
    }
}
