//! `kittiwake px4-check`: what is heard of a PX4, and whether its failsafes are the net below ours.

#![expect(clippy::disallowed_methods, reason = "it listens for some seconds of wall time, and nothing waits for it")]

use std::path::Path;
use std::time::{Duration, Instant};

use bus::{Clock, Nudge};
use domain::file::Source;
use domain::time::Pace;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Effect, Node};
use px4_bridge::Px4Bridge;
use px4_bridge::params::{self, Level, Ours, Params};

use crate::check_inputs;
use crate::cli::Px4CheckArgs;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::output;
use crate::run::px4_port::Px4Port;

/// How often it looks at what has arrived.
const PERIOD: Duration = Duration::from_millis(20);

/// What was heard.
#[derive(Debug, Default)]
struct Heard {
    status: Option<v1::VehicleStatus>,
    refused: Vec<String>,
    samples: u64,
}

/// Reads the parameters, if a file is named, and listens to PX4.
pub fn px4_check(args: &Px4CheckArgs) -> Outcome {
    let config = match check_inputs::read_or_tell(&args.settings) {
        Ok(inputs) => inputs.config,
        Err(outcome) => return outcome,
    };
    let parameters = match &args.params {
        Some(path) => check_file(path, &config),
        None => {
            output::line(
                "parameters: not checked, since they cannot be read over Zenoh; save them to a file and name it with --params",
            );
            Outcome::Success
        }
    };
    match parameters {
        Outcome::BadInput => Outcome::BadInput,
        found if args.listen_s == 0 => found,
        found => match listen(&config, Duration::from_secs(args.listen_s)) {
            Outcome::Success => found,
            other => other,
        },
    }
}

fn check_file(path: &Path, config: &Config) -> Outcome {
    let params = match Source::read(path) {
        Ok(source) => Params::parse(&source.text),
        Err(mistakes) => return check_inputs::tell(&mistakes),
    };
    if params.is_empty() {
        output::error_line(format_args!(
            "{}: found no parameter, expected lines with a name and a value, as QGroundControl saves them",
            path.display()
        ));
        return Outcome::BadInput;
    }
    let ours = Ours {
        domain: config.px4_bridge.domain,
        speed_m_s: config.skill_manager.vehicle_speed_m_s.get(),
        setpoint_period_s: config.skill_manager.setpoint_rate_hz.period().as_secs_f64(),
    };
    let findings = params::check(&params, &ours);
    for finding in &findings {
        output::line(finding);
    }
    match findings.iter().filter(|it| it.level == Level::Wrong).count() {
        0 => Outcome::Success,
        _ => Outcome::NotFlyable,
    }
}

/// Listens as the bridge would, and tells what it would say.
fn listen(config: &Config, time: Duration) -> Outcome {
    let nudge = Nudge::default();
    let port = match Px4Port::open(&config.px4_bridge, &nudge) {
        Ok(port) => port,
        Err(cause) => {
            output::error_line(format_args!(
                "px4-check: {cause}; while `kittiwake up` runs, its page and log say the same"
            ));
            return Outcome::NotKeptUp;
        }
    };
    let mut bridge = Px4Bridge::new(&config.px4_bridge, port);
    let (clock, until, mut heard) = (Clock::start(Pace::REAL_TIME), Instant::now() + time, Heard::default());
    while Instant::now() < until {
        let mut effects = Vec::new();
        bridge.act(clock.now(), &mut effects);
        effects.into_iter().for_each(|it| heard.take(it));
        std::thread::sleep(PERIOD);
    }
    for line in heard.lines() {
        output::line(line);
    }
    match heard.status {
        Some(_) if heard.refused.is_empty() => Outcome::Success,
        _ => Outcome::NotFlyable,
    }
}

impl Heard {
    fn take(&mut self, effect: Effect) {
        match effect {
            Effect::Publish { message: Message::VehicleStatus(it), .. } => self.status = Some(it),
            Effect::Refused { why, .. } if !self.refused.contains(&why) => self.refused.push(why),
            _ => {}
        }
        self.samples += 1;
    }

    fn lines(&self) -> Vec<String> {
        let mut lines = self.refused.clone();
        match &self.status {
            None => {
                lines.push("PX4: not heard; is ZENOH_ENABLE 1, and does its zenoh/net.txt name this endpoint?".into())
            }
            Some(it) => {
                let armed = if it.armed { "armed" } else { "disarmed" };
                let arm = match it.can_arm {
                    Some(true) => "can arm",
                    Some(false) => "cannot arm",
                    None => "does not say whether it can arm in this mode",
                };
                let reason = if it.reason.is_empty() { String::new() } else { format!(": {}", it.reason) };
                lines.push(format!("PX4: heard, {} messages, {armed}, {arm}{reason}", self.samples));
            }
        }
        lines
    }
}
