//! `kittiwake autopilot-check`: whether the parameters of an autopilot make its failsafes the net below ours.

#![expect(
    clippy::disallowed_methods,
    reason = "it waits some seconds of wall time for an autopilot, and nothing waits for it"
)]

use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use domain::time::Time;
use mavlink_bridge::autopilot_voice;
use mavlink_bridge::check::{Check, Finding, expectations};
use mavlink_bridge::frame::{Found, Framer};
use mavlink_bridge::link::Link;
use mavlink_bridge::socket::Socket;

use crate::check_inputs;
use crate::cli::AutopilotCheckArgs;
use crate::outcome::Outcome;
use crate::{output, signing_key};

/// How often it looks whether something is due.
const PERIOD: Duration = Duration::from_millis(50);
/// As many pieces are taken in before it looks again, as in a turn of the bridge: an endless sender does not hold it
/// up.
const AT_ONCE: usize = 256;

/// Reads the parameters over the link, and changes them if that is asked for.
pub fn autopilot_check(args: &AutopilotCheckArgs) -> Outcome {
    let config = match check_inputs::read_or_tell(&args.settings) {
        Ok(inputs) => inputs.config.mavlink_bridge,
        Err(outcome) => return outcome,
    };
    let (arrived, arrivals) = sync_channel(1);
    // A full channel wakes it already.
    let socket = match Socket::open(&config.connect, move || _ = arrived.try_send(())) {
        Ok(socket) => socket,
        Err(cause) => {
            output::error_line(cause);
            return Outcome::NotKeptUp;
        }
    };
    let link = match signing_key::signed(&config, Box::new(socket), 2) {
        Ok(link) => link,
        Err(mistakes) => return check_inputs::tell(&mistakes),
    };
    let check = run(link, &arrivals, args.write, Duration::from_secs(args.limit_s));
    report(&check)
}

/// Asks until everything was answered, or nobody was heard within `limit`.
fn run(mut link: Box<dyn Link>, arrivals: &Receiver<()>, writes: bool, limit: Duration) -> Check {
    let (start, mut check, mut framer) = (Instant::now(), Check::new(writes), Framer::default());
    while !check.is_over() && (check.findings().0.is_some() || start.elapsed() < limit) {
        let now = Time::after(start.elapsed());
        for _ in 0..AT_ONCE {
            let Some(bytes) = link.receive(now) else { break };
            let found = if link.is_datagram() { Framer::datagram(&bytes) } else { framer.push(&bytes) };
            link.admit(autopilot_voice(&found));
            for it in found {
                if let Found::Frame(frame) = it {
                    check.take_in(&frame);
                }
            }
        }
        if let Some(frame) = check.due(now) {
            link.send(frame.bytes(), now);
        }
        // Woken by what arrives, or by the time.
        let _ = arrivals.recv_timeout(PERIOD);
    }
    check
}

fn report(check: &Check) -> Outcome {
    let (autopilot, findings) = check.findings();
    let Some((name, _)) = autopilot.and_then(expectations) else {
        output::error_line("no PX4 and no ArduPilot is heard");
        return Outcome::Unavailable;
    };
    output::line(name);
    findings.iter().for_each(|it| output::line(line(it)));
    if findings.iter().all(Finding::is_good) { Outcome::Success } else { Outcome::NotFlyable }
}

fn line(finding: &Finding) -> String {
    let name = finding.expectation.name;
    let why = finding.expectation.why;
    match (finding.value, finding.written) {
        (Some(value), Some(written)) => format!("changed  {name}: {value} -> {written}"),
        (Some(value), None) if finding.is_good() => format!("ok       {name}: {value}"),
        (Some(value), None) => format!("warning  {name}: {value}, expected {why}"),
        (None, _) => format!("warning  {name}: the autopilot does not say"),
    }
}
