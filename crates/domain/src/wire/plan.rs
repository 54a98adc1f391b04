//! Plans, their steps, and the questions about them.
//!
//! A plan is accepted or refused as a whole, before any step is flown.

use std::collections::BTreeSet;
use std::time::Duration;

use kittiwake_proto::{PLANNING_PROTOCOL, v1};

use super::task::{along_from_wire, along_to_wire};
use super::{InvalidMessage, duration, feeds_from_wire, feeds_to_wire, flight_mode, gripper, out_of_range};
use crate::area::Area;
use crate::geodesy::Origin;
use crate::mission::terms::Order;
use crate::plan::{
    Answered, AskAhead, Basis, Condition, Course, Denial, DenialKind, Failure, FlownStep, MissionStatus, Parameters,
    PermissionNeed, Plan, PlanReply, PlanRequest, Step, StepId,
};
use crate::quantity::Fraction;
use crate::site::Site;
use crate::state::State;
use crate::task::Task;
use crate::time::{Now, Time};

impl From<State> for v1::PlanningState {
    fn from(state: State) -> v1::PlanningState {
        v1::PlanningState {
            position: Some(state.position.into()),
            flying: state.flying,
            mode: state.mode.map_or(v1::FlightMode::Unspecified, Into::into) as i32,
            permissions: state.permissions.into_iter().collect(),
            charge: state.charge.map(Fraction::get),
            gripper: state.gripper.map_or(v1::Gripper::Unspecified, Into::into) as i32,
            done: state.done.iter().map(Into::into).collect(),
        }
    }
}

impl TryFrom<v1::PlanningState> for State {
    type Error = InvalidMessage;
    fn try_from(state: v1::PlanningState) -> Result<State, InvalidMessage> {
        let fraction = |it: f64| Fraction::try_from(it).map_err(|_| out_of_range("charge", it, "from 0 to 1"));
        Ok(State {
            charge: state.charge.map(fraction).transpose()?,
            mode: flight_mode(state.mode()),
            gripper: gripper(state.gripper()),
            position: state.position.ok_or(InvalidMessage::Missing("position"))?.try_into()?,
            flying: state.flying,
            permissions: state.permissions.into_iter().collect(),
            done: state.done.into_iter().map(Task::try_from).collect::<Result<_, _>>()?,
        })
    }
}

impl From<Condition> for v1::Condition {
    fn from(condition: Condition) -> v1::Condition {
        v1::Condition {
            flying: condition.flying,
            mode: condition.mode.map(|mode| v1::FlightMode::from(mode) as i32),
            permissions: condition.permissions,
            skill: condition.skill.unwrap_or_default(),
        }
    }
}

impl TryFrom<v1::Condition> for Condition {
    type Error = InvalidMessage;
    fn try_from(condition: v1::Condition) -> Result<Condition, InvalidMessage> {
        // A clause that cannot be read must not count as absent.
        let mode = match condition.mode {
            None => None,
            Some(_) => Some(flight_mode(condition.mode()).ok_or(InvalidMessage::Missing("mode"))?),
        };
        let skill = Some(condition.skill).filter(|it| !it.is_empty());
        Ok(Condition { flying: condition.flying, mode, permissions: condition.permissions, skill })
    }
}

impl From<Parameters> for v1::ParameterSet {
    fn from(parameters: Parameters) -> v1::ParameterSet {
        v1::ParameterSet {
            goal: Some(parameters.goal.into()),
            precondition: Some(parameters.precondition.into()),
            invariant: Some(parameters.invariant.into()),
        }
    }
}

impl TryFrom<v1::ParameterSet> for Parameters {
    type Error = InvalidMessage;
    fn try_from(parameters: v1::ParameterSet) -> Result<Parameters, InvalidMessage> {
        Ok(Parameters {
            goal: parameters.goal.ok_or(InvalidMessage::Missing("goal"))?.try_into()?,
            precondition: parameters.precondition.unwrap_or_default().try_into()?,
            invariant: parameters.invariant.unwrap_or_default().try_into()?,
        })
    }
}

impl From<Step> for v1::PlanStep {
    fn from(step: Step) -> v1::PlanStep {
        v1::PlanStep {
            id: step.id.0,
            objective: step.objective,
            goal_state: Some(step.reaches.into()),
            nominal: Some(step.nominal.into()),
            ask_for_s: step.ask.iter().map(|need| need.lasts.as_secs_f64()).collect(),
            ask_permissions: step.ask.into_iter().map(|need| need.area).collect(),
            ask_ahead: step.ask_ahead.into_iter().map(Into::into).collect(),
            auxiliary: step.auxiliary,
            text: step.text,
            from: Some(step.from.into()),
            passed: step.passed,
            along: along_to_wire(&step.along),
        }
    }
}

impl TryFrom<v1::PlanStep> for Step {
    type Error = InvalidMessage;
    fn try_from(step: v1::PlanStep) -> Result<Step, InvalidMessage> {
        let distinct: BTreeSet<&String> = step.ask_permissions.iter().collect();
        if distinct.len() < step.ask_permissions.len() {
            return Err(InvalidMessage::Twice("ask_permissions"));
        }
        let distinct_ahead: BTreeSet<&String> = step.ask_ahead.iter().map(|it| &it.area).collect();
        if distinct_ahead.len() < step.ask_ahead.len() {
            return Err(InvalidMessage::Twice("ask_ahead"));
        }
        let step = Step {
            id: step_id(step.id).ok_or(InvalidMessage::Missing("id"))?,
            objective: step.objective,
            from: step.from.ok_or(InvalidMessage::Missing("from"))?.try_into()?,
            reaches: step.goal_state.ok_or(InvalidMessage::Missing("goal_state"))?.try_into()?,
            nominal: step.nominal.ok_or(InvalidMessage::Missing("nominal"))?.try_into()?,
            ask: needs(step.ask_permissions, step.ask_for_s)?,
            ask_ahead: step.ask_ahead.into_iter().map(AskAhead::try_from).collect::<Result<_, _>>()?,
            auxiliary: step.auxiliary,
            passed: step.passed,
            along: along_from_wire(step.along)?,
            text: step.text,
        };
        if step.ends() { Ok(step) } else { Err(InvalidMessage::Endless) }
    }
}

impl From<AskAhead> for v1::AskAhead {
    fn from(ahead: AskAhead) -> v1::AskAhead {
        let AskAhead { need: PermissionNeed { area, lasts }, after } = ahead;
        v1::AskAhead { area, for_s: lasts.as_secs_f64(), after_s: after.as_secs_f64() }
    }
}

impl TryFrom<v1::AskAhead> for AskAhead {
    type Error = InvalidMessage;
    fn try_from(ahead: v1::AskAhead) -> Result<AskAhead, InvalidMessage> {
        let lasts = duration("ask_ahead.for_s", ahead.for_s)?;
        let after = duration("ask_ahead.after_s", ahead.after_s)?;
        Ok(AskAhead { need: PermissionNeed { area: ahead.area, lasts }, after })
    }
}

/// A need without a time is met by every grant.
fn needs(areas: Vec<String>, lasts_s: Vec<f64>) -> Result<Vec<PermissionNeed>, InvalidMessage> {
    let lasts_s = lasts_s.into_iter().chain(std::iter::repeat(0.0));
    let need = |(area, lasts_s)| Ok(PermissionNeed { area, lasts: duration("ask_for_s", lasts_s)? });
    areas.into_iter().zip(lasts_s).map(need).collect()
}

/// The id in a field in which zero stands for none.
fn step_id(id: u64) -> Option<StepId> {
    (id != 0).then_some(StepId(id))
}

fn steps(steps: Vec<v1::PlanStep>) -> Result<Vec<Step>, InvalidMessage> {
    let steps: Vec<Step> = steps.into_iter().map(Step::try_from).collect::<Result<_, _>>()?;
    let distinct: BTreeSet<StepId> = steps.iter().map(|step| step.id).collect();
    if distinct.len() < steps.len() {
        return Err(InvalidMessage::Twice("steps.id"));
    }
    Ok(steps)
}

impl From<Plan> for v1::Plan {
    fn from(plan: Plan) -> v1::Plan {
        v1::Plan {
            objective: plan.objective,
            steps: plan.steps.into_iter().map(Into::into).collect(),
            revision: plan.revision,
        }
    }
}

impl TryFrom<v1::Plan> for Plan {
    type Error = InvalidMessage;
    fn try_from(plan: v1::Plan) -> Result<Plan, InvalidMessage> {
        let steps = steps(plan.steps)?;
        if steps.is_empty() {
            return Err(InvalidMessage::Missing("steps"));
        }
        Ok(Plan { objective: plan.objective, steps, revision: plan.revision })
    }
}

impl From<Denial> for v1::Denial {
    fn from(denial: Denial) -> v1::Denial {
        let is = |kind| denial.kind == kind;
        v1::Denial {
            silent: is(DenialKind::Silent),
            too_short: is(DenialKind::TooShort),
            withheld: is(DenialKind::Withheld),
            area: denial.area,
            reason: denial.reason,
        }
    }
}

impl From<v1::Denial> for Denial {
    fn from(denial: v1::Denial) -> Denial {
        let kind = match (denial.silent, denial.too_short, denial.withheld) {
            (true, ..) => DenialKind::Silent,
            (_, true, _) => DenialKind::TooShort,
            (.., true) => DenialKind::Withheld,
            (false, false, false) => DenialKind::Refused,
        };
        Denial { area: denial.area, kind, reason: denial.reason }
    }
}

impl From<FlownStep> for v1::FlownStep {
    fn from(flown: FlownStep) -> v1::FlownStep {
        v1::FlownStep {
            step: Some(flown.step.into()),
            state: Some(flown.state.into()),
            at_ns: to_ns(flown.at.time.since_start()),
            utc_ms: flown.at.utc_ms,
            along_failure: flown.along_failure.unwrap_or_default(),
        }
    }
}

impl TryFrom<v1::FlownStep> for FlownStep {
    type Error = InvalidMessage;
    fn try_from(flown: v1::FlownStep) -> Result<FlownStep, InvalidMessage> {
        Ok(FlownStep {
            step: flown.step.ok_or(InvalidMessage::Missing("step"))?.try_into()?,
            state: flown.state.ok_or(InvalidMessage::Missing("state"))?.try_into()?,
            at: moment(flown.at_ns, flown.utc_ms),
            along_failure: Some(flown.along_failure).filter(|it| !it.is_empty()),
        })
    }
}

/// A length or a moment of mission time, which a message has as nanoseconds.
pub fn to_ns(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

fn moment(at_ns: u64, utc_ms: i64) -> Now {
    Now { time: Time::after(Duration::from_nanos(at_ns)), utc_ms }
}

impl From<Basis> for v1::PlanningBasis {
    fn from(basis: Basis) -> v1::PlanningBasis {
        v1::PlanningBasis {
            protocol: PLANNING_PROTOCOL,
            at_ns: to_ns(basis.at.time.since_start()),
            utc_ms: basis.at.utc_ms,
            state: Some(basis.state.into()),
            vehicle_origin: basis.vehicle_origin.map(Into::into),
            wind: basis.wind.map(|(north_m_s, east_m_s)| v1::WindEstimate { north_m_s, east_m_s }),
            mission: Some(basis.mission.into()),
            notes: basis.notes,
            areas_id: basis.areas_id,
            areas: basis.areas,
            flown: basis.flown.into_iter().map(Into::into).collect(),
            rest: basis.rest.into_iter().map(Into::into).collect(),
        }
    }
}

impl TryFrom<v1::PlanningBasis> for Basis {
    type Error = InvalidMessage;
    fn try_from(basis: v1::PlanningBasis) -> Result<Basis, InvalidMessage> {
        same_protocol("mission manager", basis.protocol)?;
        Ok(Basis {
            at: moment(basis.at_ns, basis.utc_ms),
            state: basis.state.ok_or(InvalidMessage::Missing("state"))?.try_into()?,
            vehicle_origin: basis.vehicle_origin.map(Origin::try_from).transpose()?,
            wind: basis.wind.map(wind).transpose()?,
            mission: basis.mission.ok_or(InvalidMessage::Missing("mission"))?.try_into()?,
            notes: basis.notes,
            areas_id: basis.areas_id,
            areas: basis.areas,
            flown: basis.flown.into_iter().map(FlownStep::try_from).collect::<Result<_, _>>()?,
            rest: steps(basis.rest)?,
        })
    }
}

fn wind(wind: v1::WindEstimate) -> Result<(f64, f64), InvalidMessage> {
    let v1::WindEstimate { north_m_s, east_m_s } = wind;
    match north_m_s.is_finite() && east_m_s.is_finite() {
        true => Ok((north_m_s, east_m_s)),
        false => Err(out_of_range("wind", north_m_s + east_m_s, "finite numbers")),
    }
}

/// The `of` which says that it speaks version `found` speaks the one of this program.
///
/// # Errors
/// If it speaks another one.
pub fn same_protocol(of: &'static str, found: u32) -> Result<(), InvalidMessage> {
    // The first one had no number.
    let found = found.max(1);
    if found == PLANNING_PROTOCOL { Ok(()) } else { Err(InvalidMessage::OtherProtocol { of, found }) }
}

impl From<PlanRequest> for v1::ReplanRequest {
    fn from(request: PlanRequest) -> v1::ReplanRequest {
        let failed = request.failed.is_some();
        let (failure, interrupted) = request.failed.map(|it| (it.reason, it.interrupted)).unwrap_or_default();
        v1::ReplanRequest {
            request_id: request.request_id,
            basis: Some(request.basis.into()),
            failed,
            failure,
            interrupted,
            denials: request.denials.into_iter().map(Into::into).collect(),
            held: request.grants.into_iter().map(held).collect(),
        }
    }
}

fn held((area, valid_for): (String, Duration)) -> v1::HeldPermission {
    v1::HeldPermission { area, valid_for_s: valid_for.as_secs_f64() }
}

impl TryFrom<v1::ReplanRequest> for PlanRequest {
    type Error = InvalidMessage;
    fn try_from(request: v1::ReplanRequest) -> Result<PlanRequest, InvalidMessage> {
        Ok(PlanRequest {
            request_id: request.request_id,
            basis: request.basis.unwrap_or_default().try_into()?,
            failed: request.failed.then_some(Failure { reason: request.failure, interrupted: request.interrupted }),
            denials: request.denials.into_iter().map(Into::into).collect(),
            grants: request
                .held
                .into_iter()
                .map(|held| Ok((held.area, duration("valid_for_s", held.valid_for_s)?)))
                .collect::<Result<_, InvalidMessage>>()?,
        })
    }
}

impl From<Answered> for v1::ReplanReply {
    fn from(answered: Answered) -> v1::ReplanReply {
        use v1::replan_reply::Reply;
        let reply = match answered.reply {
            PlanReply::Plan(plan) => Reply::Plan(plan.into()),
            PlanReply::Hold { wait, reason, planned } => {
                Reply::Hold(v1::HoldUntil { wait_s: wait.as_secs_f64(), reason, planned })
            }
            PlanReply::Finished => Reply::Finished(v1::Finished {}),
            PlanReply::Refused(reason) => Reply::Refused(v1::PlanRefusal { reason }),
            PlanReply::AreasUnknown => Reply::AreasUnknown(v1::AreasUnknown {}),
        };
        let course = answered.course.map(|it| (it.mission.into(), it.notes));
        let (mission, notes) = course.unzip();
        v1::ReplanReply { reply: Some(reply), protocol: PLANNING_PROTOCOL, mission, notes }
    }
}

impl TryFrom<v1::ReplanReply> for Answered {
    type Error = InvalidMessage;
    fn try_from(reply: v1::ReplanReply) -> Result<Answered, InvalidMessage> {
        use v1::replan_reply::Reply;
        same_protocol("planner", reply.protocol)?;
        let course = course(reply.mission, reply.notes)?;
        let reply = match reply.reply.ok_or(InvalidMessage::Missing("reply"))? {
            Reply::Plan(plan) => PlanReply::Plan(plan.try_into()?),
            Reply::Hold(v1::HoldUntil { wait_s, reason, planned }) => {
                PlanReply::Hold { wait: duration("wait_s", wait_s)?, reason, planned }
            }
            Reply::Finished(_) => PlanReply::Finished,
            Reply::Refused(refusal) => PlanReply::Refused(refusal.reason),
            Reply::AreasUnknown(_) => PlanReply::AreasUnknown,
        };
        let is_no_answer = matches!(reply, PlanReply::Refused(_) | PlanReply::AreasUnknown);
        if course.is_none() && !is_no_answer {
            return Err(InvalidMessage::Missing("mission"));
        }
        Ok(Answered { reply, course })
    }
}

/// A mission as far as it has come, if there is one in an answer.
///
/// # Errors
/// If it makes no sense, or has nothing to reach.
pub fn course(
    mission: Option<v1::MissionStatus>,
    notes: Option<v1::PlannerNotes>,
) -> Result<Option<Course>, InvalidMessage> {
    let Some(mission) = mission.map(MissionStatus::try_from).transpose()? else { return Ok(None) };
    if mission.objectives.is_empty() {
        return Err(InvalidMessage::Missing("mission.objectives"));
    }
    Ok(Some(Course { mission, notes: notes.unwrap_or_default() }))
}

impl From<MissionStatus> for v1::MissionStatus {
    fn from(status: MissionStatus) -> v1::MissionStatus {
        let plan = v1::Plan {
            objective: status.current_objective,
            steps: status.steps.into_iter().map(Into::into).collect(),
            revision: status.revision,
        };
        v1::MissionStatus {
            mission: status.mission,
            objectives: status.objectives.into_iter().map(Into::into).collect(),
            areas: status.areas.iter().map(Into::into).collect(),
            plan: Some(plan),
            current_objective: status.current_objective,
            hold: status.hold,
            free_order: status.order == Order::Free,
            sites: status.sites.iter().map(Into::into).collect(),
            origin: status.origin.map(Into::into),
            feeds: feeds_to_wire(&status.feeds, &status.areas),
        }
    }
}

impl TryFrom<v1::MissionStatus> for MissionStatus {
    type Error = InvalidMessage;
    fn try_from(status: v1::MissionStatus) -> Result<MissionStatus, InvalidMessage> {
        let plan = status.plan.unwrap_or_default();
        let feeds = feeds_from_wire(status.feeds, &status.areas)?;
        Ok(MissionStatus {
            mission: status.mission,
            objectives: status.objectives.into_iter().map(TryInto::try_into).collect::<Result<_, _>>()?,
            areas: status.areas.into_iter().map(Area::try_from).collect::<Result<_, _>>()?,
            steps: steps(plan.steps)?,
            revision: plan.revision,
            current_objective: status.current_objective,
            hold: status.hold,
            order: if status.free_order { Order::Free } else { Order::Given },
            sites: status.sites.into_iter().map(Site::try_from).collect::<Result<_, _>>()?,
            origin: status.origin.map(Origin::try_from).transpose()?,
            feeds,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::super::generators::{area, mode, name, ned, origin, site};
    use super::super::mission::tests::objective;
    use super::super::skill::tests::{goal, task_goal};
    use super::super::task::tests::task;
    use super::*;
    use crate::feed::Feed;
    use crate::fmu::Gripper;

    fn state() -> impl Strategy<Value = State> {
        let permissions = prop::collection::btree_set(name(), 0..3);
        let charge = prop::option::of((0.0..=1.0).prop_map(|it| Fraction::try_from(it).unwrap()));
        let gripper =
            prop::option::of(prop::sample::select(vec![Gripper::Holding, Gripper::Released, Gripper::Silent]));
        let done = prop::collection::vec(task(), 0..3);
        (ned(), any::<bool>(), prop::option::of(mode()), permissions, charge, gripper, done).prop_map(
            |(position, flying, mode, permissions, charge, gripper, done)| State {
                position,
                flying,
                mode,
                permissions,
                charge,
                gripper,
                done,
            },
        )
    }

    fn condition() -> impl Strategy<Value = Condition> {
        let permissions = prop::collection::vec(name(), 0..3);
        let skill = prop::option::of(name().prop_filter("none is empty", |it| !it.is_empty()));
        (prop::option::of(any::<bool>()), prop::option::of(mode()), permissions, skill)
            .prop_map(|(flying, mode, permissions, skill)| Condition { flying, mode, permissions, skill })
    }

    fn step() -> impl Strategy<Value = Step> {
        let parameters = (goal(), condition(), condition()).prop_map(|(goal, precondition, invariant)| Parameters {
            goal,
            precondition,
            invariant,
        });
        let ask = prop::collection::btree_map(name(), 0..1_000_000u64, 0..3).prop_map(|needs| {
            let need = |(area, lasts_ms)| PermissionNeed { area, lasts: Duration::from_millis(lasts_ms) };
            needs.into_iter().map(need).collect()
        });
        let times = (0..1_000_000u64, 0..1_000_000u64);
        let ask_ahead = prop::collection::btree_map(name(), times, 0..3).prop_map(|ahead| {
            let ahead = ahead.into_iter().map(|(area, (lasts_ms, after_ms))| AskAhead {
                need: PermissionNeed { area, lasts: Duration::from_millis(lasts_ms) },
                after: Duration::from_millis(after_ms),
            });
            ahead.collect()
        });
        let along = prop::collection::vec(task_goal().prop_map(Arc::new), 0..2);
        ((1..u64::MAX, any::<u32>()), (ned(), state()), parameters, ask, ask_ahead, any::<bool>(), (along, name()))
            .prop_map(|((id, objective), (from, reaches), nominal, ask, ask_ahead, auxiliary, (along, text))| Step {
                id: StepId(id),
                objective,
                passed: objective / 2,
                from,
                reaches,
                nominal,
                ask,
                ask_ahead,
                auxiliary,
                along,
                text,
            })
            .prop_filter("a step ends by itself", Step::ends)
    }

    fn distinct_steps(at_least: usize) -> impl Strategy<Value = Vec<Step>> {
        prop::collection::vec(step(), at_least..4).prop_map(|mut steps| {
            for (index, step) in steps.iter_mut().enumerate() {
                step.id = StepId(index as u64 + 1);
            }
            steps
        })
    }

    fn plan() -> impl Strategy<Value = Plan> {
        (any::<u32>(), distinct_steps(1), any::<u64>()).prop_map(|(objective, steps, revision)| Plan {
            objective,
            steps,
            revision,
        })
    }

    fn request() -> impl Strategy<Value = PlanRequest> {
        let failed = (name(), any::<bool>()).prop_map(|(reason, interrupted)| Failure { reason, interrupted });
        let kind = prop::sample::select(vec![
            DenialKind::Refused,
            DenialKind::Silent,
            DenialKind::TooShort,
            DenialKind::Withheld,
        ]);
        let denial = (name(), kind, name()).prop_map(|(area, kind, reason)| Denial { area, kind, reason });
        let grants = prop::collection::btree_map(name(), (0..1_000_000u64).prop_map(Duration::from_millis), 0..3);
        let denials = prop::collection::vec(denial, 0..3);
        (name(), basis(), grants, prop::option::of(failed), denials).prop_map(
            |(request_id, basis, grants, failed, denials)| PlanRequest { request_id, basis, grants, failed, denials },
        )
    }

    fn now() -> impl Strategy<Value = Now> {
        (any::<u64>(), any::<i64>()).prop_map(|(at_ns, utc_ms)| moment(at_ns, utc_ms))
    }

    fn basis() -> impl Strategy<Value = Basis> {
        let failure = prop::option::of(name().prop_filter("none is empty", |it| !it.is_empty()));
        let flown = (step(), state(), now(), failure).prop_map(|(step, state, at, along_failure)| FlownStep {
            step,
            state,
            at,
            along_failure,
        });
        let areas = prop::option::of(prop::collection::vec(any::<u8>(), 0..4).prop_map(Into::into));
        let plan = (prop::collection::vec(flown, 0..3), distinct_steps(0));
        let wind = prop::option::of((-40.0..40.0, -40.0..40.0));
        (now(), state(), (prop::option::of(origin()), wind), status(), (name(), areas), plan).prop_map(
            |(at, state, (vehicle_origin, wind), mission, (areas_id, areas), (flown, rest))| Basis {
                at,
                state,
                vehicle_origin,
                wind,
                mission,
                notes: areas.is_some().then(v1::PlannerNotes::default),
                areas_id,
                areas,
                flown,
                rest,
            },
        )
    }

    fn reply() -> impl Strategy<Value = Answered> {
        let hold = (0..1_000_000u64, name(), any::<bool>()).prop_map(|(wait_ms, reason, planned)| {
            let wait = Duration::from_millis(wait_ms);
            PlanReply::Hold { wait, reason, planned }
        });
        let reply = prop_oneof![
            plan().prop_map(PlanReply::Plan),
            hold,
            Just(PlanReply::Finished),
            name().prop_map(PlanReply::Refused),
            Just(PlanReply::AreasUnknown),
        ];
        let mission = status().prop_filter("it has objectives", |it| !it.objectives.is_empty());
        (reply, mission, any::<u64>()).prop_map(|(reply, mission, revision)| {
            let notes = v1::PlannerNotes { last_step_id: revision, ..Default::default() };
            Answered { reply, course: Some(Course { mission, notes }) }
        })
    }

    fn status() -> impl Strategy<Value = MissionStatus> {
        let sites = prop::collection::vec(site(), 0..3);
        let areas = prop::collection::vec(area(), 0..3);
        let mission = (name(), prop::collection::vec(objective(), 0..3), areas, sites, prop::option::of(origin()));
        (mission, distinct_steps(0), any::<u64>(), any::<u32>(), name(), any::<bool>()).prop_map(
            |((mission, objectives, areas, sites, origin), steps, revision, current_objective, hold, free)| {
                let names: std::collections::BTreeSet<&String> = areas.iter().map(|it| &it.name).collect();
                let feed = Feed {
                    name: hold.clone(),
                    provider: free.then(|| mission.clone()),
                    issued_utc_ms: Some(revision as i64),
                    // Names are found again where no two areas have the same.
                    areas: areas.iter().filter(|_| names.len() == areas.len()).map(|it| it.name.clone()).collect(),
                    ..Feed::default()
                };
                let feeds = vec![feed; usize::from(current_objective % 2 == 0)];
                MissionStatus {
                    mission,
                    objectives,
                    areas,
                    steps,
                    revision,
                    current_objective,
                    hold,
                    order: if free { Order::Free } else { Order::Given },
                    sites,
                    origin,
                    feeds,
                }
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

        #[test]
        fn what_planner_and_manager_say_survives_the_wire(
            plan in plan(),
            request in request(),
            reply in reply(),
            status in status(),
        ) {
            prop_assert_eq!(Plan::try_from(v1::Plan::from(plan.clone())), Ok(plan));
            prop_assert_eq!(PlanRequest::try_from(v1::ReplanRequest::from(request.clone())), Ok(request));
            prop_assert_eq!(Answered::try_from(v1::ReplanReply::from(reply.clone())), Ok(reply));
            prop_assert_eq!(MissionStatus::try_from(v1::MissionStatus::from(status.clone())), Ok(status));
        }
    }

    #[test]
    fn a_plan_that_makes_no_sense_is_refused_with_its_reason() {
        #[track_caller]
        fn check(change: fn(&mut v1::Plan), expected: &str) {
            let state = Some(v1::PlanningState { position: Some(v1::Ned::default()), ..Default::default() });
            let goal = Some(v1::SkillGoal { goal: Some(v1::skill_goal::Goal::Land(v1::LandGoal::default())) });
            let nominal = Some(v1::ParameterSet { goal, ..Default::default() });
            let step = |id| v1::PlanStep {
                id,
                from: Some(v1::Ned::default()),
                goal_state: state.clone(),
                nominal: nominal.clone(),
                ..Default::default()
            };
            let mut plan = v1::Plan { steps: vec![step(1), step(2)], ..Default::default() };
            assert!(Plan::try_from(plan.clone()).is_ok());
            change(&mut plan);
            assert_eq!(Plan::try_from(plan).unwrap_err().to_string(), expected);
        }
        fn nominal(plan: &mut v1::Plan) -> &mut v1::ParameterSet {
            plan.steps[1].nominal.as_mut().unwrap()
        }
        fn ahead(area: &str) -> v1::AskAhead {
            v1::AskAhead { area: area.into(), for_s: 60.0, after_s: 2.0 }
        }
        check(|plan| plan.steps.clear(), "`steps` is missing");
        check(|plan| plan.steps[1].id = 0, "`id` is missing");
        check(|plan| plan.steps[1].id = 1, "`steps.id` has the same entry twice");
        check(|plan| plan.steps[0].nominal = None, "`nominal` is missing");
        check(|plan| plan.steps[0].goal_state = None, "`goal_state` is missing");
        check(|plan| nominal(plan).goal = None, "`goal` is missing");
        check(
            |plan| nominal(plan).invariant = Some(v1::Condition { mode: Some(99), ..Default::default() }),
            "`mode` is missing",
        );
        check(
            |plan| plan.steps[0].ask_permissions = vec!["A".into(), "A".into()],
            "`ask_permissions` has the same entry twice",
        );
        check(|plan| plan.steps[0].ask_ahead = vec![ahead("A"), ahead("A")], "`ask_ahead` has the same entry twice");
        check(
            |plan| plan.steps[0].ask_ahead = vec![v1::AskAhead { after_s: -1.0, ..ahead("A") }],
            "`ask_ahead.after_s` is -1.0, expected seconds, zero or more",
        );
        let endless =
            "`goal` never ends, expected a step that flies to a place, and stays there only while it asks for an area";
        check(
            |plan| {
                let velocity = Some(v1::NedVelocity::default());
                let goal = v1::VelocityGoal { velocity, timeout_s: Some(5.0), ..Default::default() };
                nominal(plan).goal = Some(v1::SkillGoal { goal: Some(v1::skill_goal::Goal::Velocity(goal)) });
            },
            endless,
        );
        check(
            |plan| {
                let target = Some(v1::Ned::default());
                let goal = v1::PositionGoal { target, speed_limit_m_s: 5.0, hold_at_target: true, yaw_rad: None };
                nominal(plan).goal = Some(v1::SkillGoal { goal: Some(v1::skill_goal::Goal::Position(goal)) });
            },
            endless,
        );
    }
}
