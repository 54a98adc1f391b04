//! `kittiwake inject`: raises a flag by hand, or injects a fault into the simulator.
//!
//! It is a process on the bus like the others, for as long as its one message takes; where only a gateway's address is known, an order to it.

use std::time::Duration;

use bus::{Link, Scope, Stop};
use domain::file::did_you_mean;
use domain::time::{Now, Time};
use kittiwake_proto::topics::{Request, Response, Topic};
use kittiwake_proto::v1::{FaultReply, FaultRequest, FlagEvent};
use node::{CallId, Effect, Event, Node};
use serde_json::{Value, json};
use vehicle_sim::faults::catalogue::catalogue;

use crate::cli::{InjectArgs, Injection, TargetArgs};
use crate::operate::args::GatewayArgs;
use crate::outcome::Outcome;
use crate::run::end;
use crate::settings::Settings;
use crate::target::Target;
use crate::{check_inputs, operate, output};

/// How long the receiver is waited for, and then its answer: longer than a companion that is busy with other things takes.
const LIMIT: Duration = Duration::from_secs(10);

/// Injects what the arguments say and prints the result.
pub fn inject(args: &InjectArgs) -> Outcome {
    match &args.what {
        Injection::Flag { name, lower, target } => flag(name, !lower, target),
        Injection::Fault { name: None, .. } => list_faults(),
        Injection::Fault { name: Some(name), args, target } => fault(name, args, target),
    }
}

fn flag(name: &str, raised: bool, args: &TargetArgs) -> Outcome {
    let target = match Target::find(args) {
        Ok(target) => target,
        Err(cause) => return told(Err(cause)),
    };
    if target.connect.is_empty() {
        return over_gateway(args, "flags", json!({ "name": name, "raised": raised, "reason": "by hand" }));
    }
    if let Err(unknown) = check_flag(name, &target) {
        output::error_line(unknown);
        return Outcome::BadInput;
    }
    let flag = FlagEvent { name: name.to_owned(), raised, reason: "by hand".into(), ..Default::default() };
    let mut injector = Injector::new(Task::Flag(flag));
    told(run(&mut injector, &target))
}

fn fault(name: &str, args: &[String], target: &TargetArgs) -> Outcome {
    let found = match Target::find(target) {
        Ok(found) if found.connect.is_empty() => {
            return over_gateway(target, "faults", json!({ "name": name, "args": args }));
        }
        found => found,
    };
    let request = FaultRequest { name: name.to_owned(), args: args.to_vec() };
    let mut injector = Injector::new(Task::Fault(request));
    match found.and_then(|target| run(&mut injector, &target)) {
        // The simulator refuses an unknown fault and lists the known ones.
        Ok(detail) if injector.refused => {
            output::error_line(detail);
            Outcome::BadInput
        }
        result => told(result),
    }
}

fn list_faults() -> Outcome {
    for it in catalogue() {
        output::line(format_args!("{:44} {}", format!("{} {}", it.name, it.arguments), it.effect));
    }
    Outcome::Success
}

/// Refuses a flag that the running system's contingency table does not know.
fn check_flag(name: &str, target: &Target) -> Result<(), String> {
    let Some(config) = &target.config else { return Ok(()) };
    let inputs = check_inputs::read(&Settings::of_file(config)).map_err(|it| it.to_string())?;
    let known: Vec<&str> = inputs.contingencies.rows().iter().map(|it| it.flag.as_str()).collect();
    if known.contains(&name) { Ok(()) } else { Err(format!("unknown flag `{name}`: {}", did_you_mean(name, &known))) }
}

fn over_gateway(target: &TargetArgs, what: &str, body: Value) -> Outcome {
    let (url, vehicle) = (target.http.clone(), target.vehicle.clone());
    operate::order(&GatewayArgs { url, vehicle, ..GatewayArgs::default() }, &["simulation", what], body)
}

fn run(injector: &mut Injector, target: &Target) -> Result<String, String> {
    let link = Link {
        connect: vec![target.connect.clone()],
        scope: Scope::Vehicle(target.vehicle.clone()),
        open_timeout: LIMIT,
    };
    let stop = Stop::new();
    end::stop_on_end(&stop, false).map_err(|it| it.to_string())?;
    bus::Process::of(injector, &link).run(&stop).map_err(|it| format!("unavailable: {it}"))?;
    injector.result.take().unwrap_or_else(|| Err("interrupted".into()))
}

fn told(result: Result<String, String>) -> Outcome {
    match result {
        Ok(done) => {
            output::line(done);
            Outcome::Success
        }
        Err(cause) => {
            output::error_line(cause);
            Outcome::Unavailable
        }
    }
}

enum Task {
    Flag(FlagEvent),
    Fault(FaultRequest),
}

/// Waits for the receiver, sends one message, and ends with its result.
pub struct Injector {
    task: Task,
    until: Option<Time>,
    sent: bool,
    refused: bool,
    result: Option<Result<String, String>>,
}

impl Injector {
    /// Sends a flag once the monitor is there.
    pub fn flag(flag: FlagEvent) -> Injector {
        Injector::new(Task::Flag(flag))
    }

    fn new(task: Task) -> Injector {
        Injector { task, until: None, sent: false, refused: false, result: None }
    }

    /// The vehicle of the message.
    fn receiver(&self) -> &'static str {
        match self.task {
            Task::Flag(_) => "monitor",
            Task::Fault(_) => "vehicle-sim",
        }
    }

    fn send(&mut self, effects: &mut Vec<Effect>) {
        self.sent = true;
        match &self.task {
            Task::Flag(flag) => {
                effects.push(Effect::publish(flag.clone()));
                let verb = if flag.raised { "raised" } else { "lowered" };
                self.result = Some(Ok(format!("flag `{}` {verb}", flag.name)));
            }
            Task::Fault(fault) => {
                let request = Request::Fault(fault.clone());
                effects.push(Effect::Call { call: CallId(1), vehicle: None, trace: None, request, timeout: LIMIT });
            }
        }
    }
}

impl Node for Injector {
    fn name(&self) -> &'static str {
        "injector"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn on(&mut self, _: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Peer { service, alive: true, .. } if service == self.receiver() && !self.sent => self.send(effects),
            Event::Reply { result: Ok(Response::Fault(FaultReply { accepted, detail, .. })), .. } => {
                self.refused = !accepted;
                self.result = Some(Ok(detail));
            }
            Event::Reply { result, .. } => {
                let cause = result.err().map_or("an answer to something else".into(), |it| it.to_string());
                self.result = Some(Err(cause));
            }
            Event::Message { .. } | Event::Request { .. } | Event::Peer { .. } => {}
        }
    }

    fn act(&mut self, now: Now, _: &mut Vec<Effect>) {
        let until = *self.until.get_or_insert(now.time + LIMIT);
        if !self.sent && until <= now.time {
            self.result = Some(Err(format!("unavailable: no {} within {LIMIT:?}", self.receiver())));
        }
    }

    fn deadline(&self) -> Option<Time> {
        if self.sent { None } else { self.until }
    }

    fn is_over(&self) -> bool {
        self.result.is_some()
    }
}
