//! Stories through the planner's own interface: questions in, plans out, rendered as text. The story keeps what the mission manager keeps.

use std::time::Duration;

use domain::file::Source;
use domain::geodesy::Origin;
use domain::mission::{Mission, MissionAreas};
use domain::plan::{Basis, Course, FlownStep, MissionStatus};
use domain::time::{Now, Pace, Time};
use domain::wire::plan::course;
use kittiwake_proto::topics::{Request, Response};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};

use crate::Planner;
use crate::config::Config;
use crate::rules::Rules;

mod airspace;
mod alternates;
mod asking_ahead;
mod drops;
mod giving_up;
mod hours;
mod lasting_areas;
mod new_airspace;
mod operator;
mod origin;
mod permissions;
mod properties;
mod protocol;
mod reference_mission;
mod survey;
mod tasks;
mod terms;
mod waiting;

const REFERENCE: &str = include_str!("../../../../../config/missions/reference.toml");
const KEEP_OUT: &str = include_str!("../../../../../config/missions/keep_out.toml");
const HARBOUR: &str = include_str!("../../../../../config/missions/harbour.toml");
const ALTITUDE_BAND: &str = include_str!("../../../../../config/missions/altitude_band.toml");

/// 2026-01-01T00:00:00Z.
const UTC_START_MS: i64 = 1_767_225_600_000;

/// A planner and a vehicle that is wherever the story puts it.
struct Story {
    planner: Planner,
    now: Now,
    state: v1::PlanningState,
    origin: Option<Origin>,
    /// As the vehicle estimates it, towards north and east in m/s.
    wind: Option<(f64, f64)>,
    /// The mission as far as it has come, and the steps that were flown since.
    mission: MissionStatus,
    notes: Option<v1::PlannerNotes>,
    areas: MissionAreas,
    flown: Vec<FlownStep>,
    /// Why a task along the next step that is flown fails.
    along_failure: Option<String>,
    /// How often what was planned for was changed.
    voids: u64,
    /// What is held, and for how long, where that is known.
    held: Vec<v1::HeldPermission>,
    /// The grants that failed a step were too short.
    too_short: bool,
    /// Something interrupted the step, which did not fail by itself.
    interrupted: bool,
    requests: u64,
    steps: Vec<v1::PlanStep>,
    /// What the tower has closed.
    closed: Vec<v1::ClosedArea>,
    /// The end, as the mission manager tells it: why, whether the report is still awaited, and whether the next mission waits.
    end: (String, bool, bool),
}

fn mission(text: &str) -> Mission {
    Mission::read(&Source { path: "mission.toml".into(), text: text.into() }).unwrap()
}

/// A mission with one objective on the ground, 500 m to the east, and these areas.
fn across(areas: &str) -> String {
    format!(
        "name = \"across\"\n[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 500\nheight_m = 0\nflying = false\n{areas}"
    )
}

/// A mission file's area: a rectangle from 90 m south to 90 m north.
fn area(name: &str, kind: &str, east_m: [f64; 2], more: &str) -> String {
    let [west, east] = east_m.map(|it| format!("{it:.1}"));
    format!(
        "[[area]]\nname = \"{name}\"\nkind = \"{kind}\"\n{more}\n\
         corners_m = [[-90.0, {west}], [90.0, {west}], [90.0, {east}], [-90.0, {east}]]\n"
    )
}

impl Story {
    /// On the ground at the origin, no permission held, at time zero.
    fn of(mission_text: &str) -> Story {
        let mission = mission(mission_text);
        Story {
            planner: Planner::new(&Config::for_tests(), &Rules::for_tests().aircraft, Pace::REAL_TIME),
            now: Now { time: Time::ZERO, utc_ms: UTC_START_MS },
            state: v1::PlanningState { position: Some(v1::Ned::default()), ..Default::default() },
            origin: None,
            wind: None,
            areas: MissionAreas::of(&mission.areas, &mission.feeds),
            mission: MissionStatus::beginning(&mission),
            notes: None,
            flown: Vec::new(),
            along_failure: None,
            voids: 0,
            held: Vec::new(),
            too_short: false,
            interrupted: false,
            requests: 0,
            steps: Vec::new(),
            closed: Vec::new(),
            end: (String::new(), false, false),
        }
    }

    /// The planner is another process, with this configuration.
    fn restart_with(&mut self, config: &Config) {
        self.planner = Planner::new(config, &Rules::for_tests().aircraft, Pace::REAL_TIME);
    }

    /// The planner is another process, which knows nothing.
    fn restart(&mut self) {
        self.restart_with(&Config::for_tests());
    }

    fn basis(&self, sends_areas: bool) -> v1::PlanningBasis {
        let state = domain::state::State::try_from(v1::PlanningState {
            position: Some(v1::Ned::default()),
            ..self.state.clone()
        });
        let basis = Basis {
            at: self.now,
            state: state.unwrap(),
            vehicle_origin: self.origin,
            wind: self.wind,
            mission: self.mission.clone(),
            notes: self.notes.clone(),
            areas_id: self.areas.id().to_owned(),
            areas: sends_areas.then(|| self.areas.encoded().clone()),
            flown: self.flown.clone(),
            rest: Vec::new(),
        };
        v1::PlanningBasis { state: Some(self.state.clone()), rest: self.steps.clone(), ..basis.into() }
    }

    fn go_on(&mut self, it: Course) {
        (self.mission, self.notes) = (it.mission, Some(it.notes));
        self.flown.clear();
    }

    fn request(&mut self, request: Request) -> Option<Response> {
        let mut effects = Vec::new();
        let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request };
        self.planner.on(self.now, event, &mut effects);
        effects.retain(|it| !matches!(it, Effect::Refused { .. }));
        assert!(effects.len() <= 1, "{effects:?}");
        effects.pop().map(|it| match it {
            Effect::Reply { token: Token(1), response } => response,
            other => panic!("{other:?}"),
        })
    }

    fn wait(&mut self, seconds: u64) {
        self.now.time = self.now.time + Duration::from_secs(seconds);
        self.now.utc_ms += seconds as i64 * 1000;
    }

    /// The vehicle is in the air there, `[north, east, height]`.
    fn airborne_at(&mut self, [north_m, east_m, height_m]: [f64; 3]) {
        self.state.position = Some(v1::Ned { north_m, east_m, down_m: -height_m });
        self.state.flying = true;
    }

    fn hold_permissions(&mut self, areas: &[&str]) {
        self.state.permissions = areas.iter().map(|it| it.to_string()).collect();
    }

    /// Asks for a plan when no step failed.
    fn plan(&mut self) -> String {
        self.replan(false, &[])
    }

    /// The first step of the plan fails; each denial is an area and the tower's reason, or none if
    /// it was silent.
    fn fail(&mut self, denials: &[(&str, Option<&str>)]) -> String {
        self.replan(true, denials)
    }

    fn replan(&mut self, failed: bool, denials: &[(&str, Option<&str>)]) -> String {
        self.requests += 1;
        let denial = |&(area, reason): &(&str, Option<&str>)| v1::Denial {
            area: area.into(),
            silent: reason.is_none(),
            reason: reason.unwrap_or_default().into(),
            too_short: self.too_short && reason.is_some(),
            withheld: false,
        };
        let request = v1::ReplanRequest {
            request_id: format!("r{}", self.requests),
            basis: Some(self.basis(false)),
            failed,
            failure: "it failed".into(),
            denials: denials.iter().map(denial).collect(),
            held: self.held.clone(),
            interrupted: self.interrupted,
        };
        let mut reply = self.ask_for_plan(request.clone());
        if let Some(v1::replan_reply::Reply::AreasUnknown(_)) = reply.reply {
            let request_id = format!("{} with areas", request.request_id);
            reply = self.ask_for_plan(v1::ReplanRequest { request_id, basis: Some(self.basis(true)), ..request });
        }
        let text = render(&reply);
        if let Some(it) = course(reply.mission, reply.notes).unwrap() {
            self.go_on(it);
        }
        self.steps = match reply.reply {
            Some(v1::replan_reply::Reply::Plan(plan)) => plan.steps,
            _ => Vec::new(),
        };
        text
    }

    fn ask_for_plan(&mut self, request: v1::ReplanRequest) -> v1::ReplanReply {
        let Some(Response::Replan(reply)) = self.request(Request::Replan(request)) else { panic!("no reply") };
        reply
    }

    /// Flies this many steps of the plan, to the state each reaches; every request is granted.
    fn fly(&mut self, count: usize) {
        for step in self.steps.drain(..count).collect::<Vec<_>>() {
            let goal = step.goal_state.clone().unwrap();
            self.state = v1::PlanningState { permissions: self.state.permissions.clone(), ..goal };
            self.state.permissions.extend(step.ask_permissions.clone());
            let state = self.state.clone();
            self.flown(step, state);
        }
    }

    /// This step was flown, which left the vehicle so.
    fn flown(&mut self, step: v1::PlanStep, state: v1::PlanningState) {
        let (step, state) = (step.try_into().unwrap(), state.try_into().unwrap());
        self.flown.push(FlownStep { step, state, at: self.now, along_failure: self.along_failure.take() });
    }

    /// The mission, with what was flown.
    fn status(&mut self) -> v1::MissionStatus {
        let mut core = self.planner.go_on(Basis::try_from(self.basis(true)).unwrap()).unwrap().unwrap();
        let (status, _) = core.course();
        let (areas, feeds) = (self.areas.areas().to_vec(), self.areas.feeds().to_vec());
        let mut status = v1::MissionStatus::from(MissionStatus { areas, feeds, ..status });
        status.plan.as_mut().unwrap().steps.clone_from(&self.steps);
        status
    }

    /// One line an objective: name, state, reason, steps planned, replans, permissions asked.
    fn objectives(&mut self) -> String {
        let line = |it: &v1::Objective| {
            let state = it.state().as_str_name().trim_start_matches("OBJECTIVE_STATE_").to_lowercase();
            let reason = if it.reason.is_empty() { String::new() } else { format!(" ({})", it.reason) };
            format!(
                "{}: {state}{reason}, {} steps, {} replans, asked [{}]",
                it.name,
                it.plan_steps,
                it.replans,
                it.permissions.join(" ")
            )
        };
        lines(self.status().objectives.iter().map(line))
    }
}

fn render(reply: &v1::ReplanReply) -> String {
    use v1::replan_reply::Reply;
    match reply.reply.as_ref().unwrap() {
        Reply::Plan(plan) => lines(plan.steps.iter().map(render_step)),
        Reply::Hold(hold) => format!("hold {:.0} s: {}\n", hold.wait_s, hold.reason),
        Reply::Finished(_) => "finished\n".into(),
        Reply::Refused(refusal) => format!("refused: {}\n", refusal.reason),
        Reply::AreasUnknown(_) => "it does not know the areas\n".into(),
    }
}

/// Its id, the skill, whether it holds at the target, what is asked and what must be held.
fn render_step(step: &v1::PlanStep) -> String {
    use v1::skill_goal::Goal;
    let nominal = step.nominal.as_ref().unwrap();
    let (skill, hold) = match nominal.goal.as_ref().and_then(|it| it.goal.as_ref()).unwrap() {
        Goal::Land(_) => ("land".into(), false),
        Goal::Takeoff(it) => (format!("takeoff {:.0} m", it.climb_m), false),
        Goal::Stop(_) => ("stop".into(), false),
        Goal::Position(it) => {
            let at = it.target.unwrap();
            // Adding zero makes of a negative zero a positive one.
            let [north, east, height] = [at.north_m, at.east_m, -at.down_m].map(|it| it.round() + 0.0);
            (format!("position {north} {east} {height}"), it.hold_at_target)
        }
        Goal::Release(it) => {
            let at = it.over.unwrap();
            (format!("release over {} {}", at.north_m.round() + 0.0, at.east_m.round() + 0.0), false)
        }
        Goal::Task(it) => {
            let inputs = &it.task.as_ref().unwrap().inputs;
            let inputs: Vec<_> = inputs.iter().map(|it| format!(" {}", it.value)).collect();
            (format!("{}{}", it.task.as_ref().unwrap().skill, inputs.concat()), false)
        }
        Goal::Velocity(_) => panic!("no action flies at a velocity"),
    };
    let invariant = nominal.invariant.as_ref().unwrap();
    assert_eq!(invariant.permissions, nominal.precondition.as_ref().unwrap().permissions);
    let mut text = format!("{} {skill}", step.id);
    if hold {
        text += ", hold";
    }
    if !step.ask_permissions.is_empty() {
        text += &format!(", ask {}", step.ask_permissions.join(" "));
    }
    if !invariant.permissions.is_empty() {
        text += &format!(", needs {}", invariant.permissions.join(" "));
    }
    assert_eq!(step.auxiliary, !step.ask_permissions.is_empty(), "{text}");
    text
}

fn lines(lines: impl Iterator<Item = String>) -> String {
    lines.map(|it| it + "\n").collect()
}

/// `actual` is `expected`, which is indented as the code around it.
#[track_caller]
fn check(actual: &str, expected: &str) {
    let [actual, expected] = [actual, expected].map(|it| lines(it.lines().map(|line| line.trim().to_owned())));
    assert!(actual == expected, "expected:\n{expected}\ngot:\n{actual}");
}
