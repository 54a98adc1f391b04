//! Stories through the planner's own interface: requests in, plans out, rendered as text.

use std::time::Duration;

use domain::file::Source;
use domain::mission::Mission;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};

use crate::Planner;
use crate::config::{Config, energy_for_tests};

mod airspace;
mod alternates;
mod asking_ahead;
mod drops;
mod giving_up;
mod hours;
mod memory;
mod new_airspace;
mod operator;
mod origin;
mod permissions;
mod properties;
mod protocol;
mod reference_mission;
mod survey;
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
    /// What is held, and for how long, where that is known.
    held: Vec<v1::HeldPermission>,
    /// The grants that failed a step were too short.
    too_short: bool,
    /// The loss of memory that the operator has accepted.
    accepted_loss: u64,
    /// Something interrupted the step, which did not fail by itself.
    interrupted: bool,
    requests: u64,
    steps: Vec<v1::PlanStep>,
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
        Story {
            planner: Planner::new(&Config::for_tests(), &energy_for_tests(), mission(mission_text), Pace::REAL_TIME),
            now: Now { time: Time::ZERO, utc_ms: UTC_START_MS },
            state: v1::PlanningState { position: Some(v1::Ned::default()), ..Default::default() },
            held: Vec::new(),
            too_short: false,
            accepted_loss: 0,
            interrupted: false,
            requests: 0,
            steps: Vec::new(),
        }
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

    /// The mission manager tells its status.
    fn hear_manager(&mut self, status: v1::McmStatus) {
        let event = Event::Message { vehicle: "uav1".into(), message: status.into() };
        self.planner.on(self.now, event, &mut Vec::new());
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
        self.replan(0, &[])
    }

    /// The first step of the plan fails; each denial is an area and the tower's reason, or none if
    /// it was silent.
    fn fail(&mut self, denials: &[(&str, Option<&str>)]) -> String {
        self.replan(self.steps[0].id, denials)
    }

    fn replan(&mut self, failed_step_id: u64, denials: &[(&str, Option<&str>)]) -> String {
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
            state: Some(self.state.clone()),
            failed_step_id,
            failure: "it failed".into(),
            denials: denials.iter().map(denial).collect(),
            held: self.held.clone(),
            accepted_loss: self.accepted_loss,
            interrupted: self.interrupted,
        };
        let Some(Response::Replan(reply)) = self.request(Request::Replan(request)) else { panic!("no reply") };
        let text = render(&reply);
        self.steps = match reply.reply {
            Some(v1::replan_reply::Reply::Plan(plan)) => plan.steps,
            _ => Vec::new(),
        };
        text
    }

    /// Flies this many steps of the plan, to the state each reaches; every request is granted.
    fn fly(&mut self, count: usize) {
        for step in self.steps.drain(..count).collect::<Vec<_>>() {
            let goal = step.goal_state.unwrap();
            self.state = v1::PlanningState { permissions: self.state.permissions.clone(), ..goal };
            self.state.permissions.extend(step.ask_permissions);
            let done = v1::StepDone { step_id: step.id, state: Some(self.state.clone()) };
            let reply = self.request(Request::StepDone(done));
            assert_eq!(reply, Some(Response::StepDone(v1::StepDoneReply { accepted: true, refusal: String::new() })));
        }
    }

    fn status(&mut self) -> v1::PlannerStatus {
        let mut effects = Vec::new();
        self.planner.act(self.now, &mut effects);
        match effects.pop() {
            Some(Effect::Publish { message: Message::PlannerStatus(status), .. }) => status,
            other => panic!("no status is due: {other:?}"),
        }
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
