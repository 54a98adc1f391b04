//! `/metrics` in OpenMetrics: what the processes say of themselves and how old what is known is,
//! made when it is asked for from the same snapshot as every other answer.

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use std::sync::atomic::AtomicU64;

use crate::audit::Audit;
use crate::process::Processes;
use crate::recording::gauges::Gauges;
use crate::state::{Seen, Snapshot};
use crate::view::Ages;

/// What the text is.
pub(crate) const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

type Labels = Vec<(&'static str, String)>;
type Values = Family<Labels, Gauge<f64, AtomicU64>>;

/// The metrics of everything that `snapshot` knows.
pub(crate) fn text(snapshot: &Snapshot, ages: Ages, audit: &Audit, recording: Option<&Gauges>) -> String {
    let mut registry = Registry::with_prefix("kittiwake");
    let mut family = |name: &str, help: &str| {
        let gauges = Values::default();
        registry.register(name, help, gauges.clone());
        gauges
    };
    let uptime = family("process_uptime_seconds", "Since the process started, in mission time");
    let handled = family("process_handled", "Events that the process has handled");
    let dropped = family("process_dropped", "Messages dropped because its queue was full");
    let malformed = family("process_malformed", "Messages refused as malformed");
    let healthy = family("process_healthy", "1 while the process is there and makes progress");
    let source_age = family("source_age_wall_seconds", "Since the source was heard last, by the wall clock");
    let ticks = family("tree_ticks", "Ticks of the mission tree");
    let flag = family("flag_up", "1 for each flag that is up");
    let flying = family("flying", "1 while the vehicle flies");
    let battery = family("battery_remaining_ratio", "What is left of the battery");
    let lost = family("audit_lost", "Audit records that could not be written");
    let unrecorded = family("recording_dropped", "Messages that could not be recorded");
    let unwritten = family("recording_waiting_bytes", "Bytes on their way to the disk");
    let failing = family("recording_failing", "1 while missions cannot be recorded");

    if let Some(it) = recording {
        unrecorded.get_or_create(&Vec::new()).set(it.lost() as f64);
        unwritten.get_or_create(&Vec::new()).set(it.waiting() as f64);
        failing.get_or_create(&Vec::new()).set(f64::from(u8::from(it.problem().is_some())));
    }
    lost.get_or_create(&Vec::new()).set(audit.lost() as f64);
    let now = snapshot.now.time;
    let processes = |vehicle: &str, of: &Processes| {
        for (service, process) in of.iter() {
            let labels = vec![("vehicle", vehicle.to_owned()), ("service", service.to_owned())];
            let health = process.health(now, ages.stale_after).name();
            healthy.get_or_create(&labels).set(f64::from(u8::from(health == "alive")));
            if let Some((_, it)) = &process.heartbeat {
                uptime.get_or_create(&labels).set(it.uptime_s);
                handled.get_or_create(&labels).set(it.handled as f64);
                dropped.get_or_create(&labels).set(it.dropped as f64);
                malformed.get_or_create(&labels).set(it.malformed as f64);
            }
        }
    };
    processes("", &snapshot.fleet.ground);
    for (name, vehicle) in &snapshot.fleet.vehicles {
        processes(name, &vehicle.processes);
        let labels = |more: &[(&'static str, &str)]| -> Labels {
            let more = more.iter().map(|(key, value)| (*key, (*value).to_owned()));
            [("vehicle", name.to_string())].into_iter().chain(more).collect()
        };
        let age = |source: &str, at: Option<domain::time::Time>| {
            if let Some(at) = at {
                let age = ages.pace.to_wall(now - at).as_secs_f64();
                source_age.get_or_create(&labels(&[("source", source)])).set(age);
            }
        };
        age("vehicle_status", at(&vehicle.status));
        age("introspection", at(&vehicle.introspection));
        age("planner_status", at(&vehicle.planner));
        age("mcm_status", at(&vehicle.mcm));
        age("permission_ledger", at(&vehicle.ledger));
        age("tree_snapshot", at(&vehicle.tree));
        if let Some(mcm) = &vehicle.mcm {
            ticks.get_or_create(&labels(&[])).set(mcm.message.ticks as f64);
        }
        for it in vehicle.flags.up(now) {
            flag.get_or_create(&labels(&[("flag", it.name)])).set(1.0);
        }
        if let Some(seen) = &vehicle.introspection {
            let is_flying = seen.message.derived.as_ref().is_some_and(|it| it.flying);
            flying.get_or_create(&labels(&[])).set(f64::from(u8::from(is_flying)));
            if let Some(it) = &seen.message.battery {
                battery.get_or_create(&labels(&[])).set(it.remaining);
            }
        }
    }
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = encode(&mut text, &registry);
    text
}

fn at<M>(seen: &Option<Seen<M>>) -> Option<domain::time::Time> {
    seen.as_ref().map(|it| it.at)
}
