//! The raw cost of the hops: two bare processes play an end of a skill, or a flag, the request that
//! follows from it and the command that follows from that, over the same router, with messages of the
//! same size and the same loop, and nothing else to do.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use bus::{Direct, Link, Process, Scope, Stop, monotonic_ns};
use domain::time::{Now, Time};
use kittiwake::outcome::Outcome;
use kittiwake::run::end::stop_on_end;
use kittiwake::settings::Settings;
use kittiwake::{output, telemetry};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{CallId, Effect, Event, Node};

use crate::analysis::{EXECUTOR, Samples, analyse};
use crate::args::FloorArgs;
use crate::system::System;

/// Its part of the keys.
const VEHICLE: &str = "floor";
/// One round after the other, far enough apart not to meet.
const PERIOD: Duration = Duration::from_millis(10);
/// The number of rounds.
const ROUNDS: usize = 1000;
/// They take ten seconds.
const LIMIT: Duration = Duration::from_secs(40);

/// Runs one of the two processes.
pub fn run(args: &FloorArgs) -> Outcome {
    let telemetry = telemetry::start("kpi-floor", VEHICLE, &telemetry::Config { otlp_endpoint: None });
    let link = Link {
        connect: args.connect.clone(),
        scope: Scope::Vehicle(VEHICLE.to_owned()),
        open_timeout: Duration::from_secs(10),
    };
    let stop = Stop::new();
    let (own, other): (&str, &[&str]) = if args.far { ("far", &[]) } else { ("near", &["far"]) };
    let connect = other.iter().map(|it| it.to_string()).collect();
    let direct = Direct { folder: args.direct.clone(), listen: Some(own.to_owned()), connect };
    let mut node: Box<dyn Node> = if args.far { Box::new(Far::default()) } else { Box::new(Near::default()) };
    let result = stop_on_end(&stop, args.exit_with_parent).map_err(|it| it.to_string()).and_then(|()| {
        let process = Process { direct: Some(&direct), ..Process::of(node.as_mut(), &link) };
        process.run(&stop).map_err(|it| it.to_string())
    });
    telemetry.end();
    match result {
        Ok(()) => Outcome::Success,
        Err(cause) => {
            output::error_line(cause);
            Outcome::NotKeptUp
        }
    }
}

/// Measures the rounds, over the router of the executable `program`.
pub(crate) fn measure(program: &Path, config: &Path) -> Result<Samples, String> {
    let system = System::start(program, &Settings::of_file(config), VEHICLE, &[])?;
    let _bare = [Bare::start(&system, true)?, Bare::start(&system, false)?];
    let (mut heard, mut rounds) = (Vec::new(), 0);
    let complete = system.listen(LIMIT, &mut heard, |it| {
        rounds += usize::from(matches!(it.message, Message::VehicleCommandAck(_)));
        ROUNDS <= rounds
    })?;
    if complete { Ok(analyse(&heard)) } else { Err(format!("{rounds} of {ROUNDS} rounds within {LIMIT:?}")) }
}

/// A bare process; ends with the value.
struct Bare(std::process::Child);

impl Bare {
    fn start(system: &System, far: bool) -> Result<Bare, String> {
        let program = std::env::current_exe().map_err(|it| it.to_string())?;
        let mut command = Command::new(program);
        command.args(["floor", "--exit-with-parent"]).args(far.then_some("--far"));
        command.arg("--direct").arg(system.sockets());
        for locator in &system.link().connect {
            command.args(["--connect", locator]);
        }
        command.stdin(Stdio::piped()).spawn().map(Bare).map_err(|it| it.to_string())
    }
}

impl Drop for Bare {
    fn drop(&mut self) {
        drop(self.0.stdin.take());
        // It has ended, or cannot be waited for.
        let _ = self.0.wait();
    }
}

fn skill_event(id: u64) -> v1::SkillEvent {
    v1::SkillEvent {
        skill_id: id,
        request_id: format!("mcm-18a3f5c2d9b7e640-{id}"),
        kind: v1::SkillKind::Offboard as i32,
        state: v1::SkillState::Ended as i32,
        outcome: v1::SkillOutcome::Succeeded as i32,
        reason: String::new(),
        position: Some(v1::Ned { north_m: 0.1, east_m: 90.2, down_m: -10.3 }),
        velocity: Some(v1::NedVelocity { north_m_s: 0.1, east_m_s: 0.2, down_m_s: 0.3 }),
        position_timestamp_us: 83_412_675,
        landed_timestamp_us: 82_900_113,
        flown_by_other: false,
        ..Default::default()
    }
}

/// Plays the skill manager: says that a skill has ended, and commands what is asked.
#[derive(Default)]
struct Near {
    next: Option<Time>,
    ended: u64,
    commanded: u64,
}

impl Node for Near {
    fn name(&self) -> &'static str {
        "near"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::VehicleCommandAck]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Skill]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Peer { service, alive: true, .. } if service == "far" => self.next = Some(now.time + 20 * PERIOD),
            Event::Request { token, request: Request::Skill(_), .. } => {
                let command =
                    v1::vehicle_command::Command::SetMode(v1::SetMode { mode: v1::FlightMode::Loiter as i32 });
                self.commanded += 1;
                effects.push(Effect::publish(v1::VehicleCommand { id: self.commanded, command: Some(command) }));
                let response = v1::SkillReply { skill_id: self.commanded, ..Default::default() };
                effects.push(Effect::Reply { token, response: Response::Skill(response) });
            }
            _ => {}
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.next.is_some_and(|it| it <= now.time) {
            self.next = Some(now.time + PERIOD);
            self.ended += 1;
            effects.push(Effect::publish(skill_event(self.ended)));
        }
    }

    fn deadline(&self) -> Option<Time> {
        self.next
    }
}

/// Plays the mission manager, which asks for the next skill, and the vehicle, which acknowledges.
#[derive(Default)]
struct Far {
    count: u64,
}

impl Node for Far {
    fn name(&self) -> &'static str {
        "far"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::SkillEvent, Topic::VehicleCommand]
    }

    fn on(&mut self, _: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Message { message, .. } = event else { return };
        match message {
            Message::SkillEvent(ended) => self.ask(&ended, effects),
            Message::VehicleCommand(it) => {
                let (id, result) = (it.id, v1::CommandResult::Accepted as i32);
                effects.push(Effect::publish(v1::VehicleCommandAck { id, result, reason: String::new() }));
            }
            _ => {}
        }
    }

    fn deadline(&self) -> Option<Time> {
        None
    }
}

impl Far {
    fn ask(&mut self, ended: &v1::SkillEvent, effects: &mut Vec<Effect>) {
        let woken_ns = monotonic_ns();
        self.count += 1;
        let goal = domain::skill::Goal::Position {
            target: domain::geometry::Ned::default(),
            speed_limit_m_s: 10.0,
            yaw_rad: None,
            hold_at_target: false,
        };
        let request = v1::SkillRequest {
            request_id: ended.request_id.clone(),
            goal: Some(goal.into()),
            when_busy: v1::WhenBusy::Replace as i32,
            gave_up_skill_id: ended.skill_id,
            ..Default::default()
        };
        let (call, request) = (CallId(self.count), Request::Skill(request));
        effects.push(Effect::Call { call, vehicle: None, trace: None, request, timeout: Duration::from_secs(1) });
        let executor = |after: v1::NodeStatus| v1::LeafChange {
            kind: EXECUTOR.to_owned(),
            after: after as i32,
            at_ns: woken_ns,
            ..Default::default()
        };
        effects.push(Effect::publish(v1::McmTiming {
            woken_ns,
            decided_ns: monotonic_ns(),
            changes: vec![executor(v1::NodeStatus::Success), executor(v1::NodeStatus::Running)],
            ..Default::default()
        }));
    }
}
