//! `/metrics` in OpenMetrics: what the processes report of themselves, and how old the known state is. The text is made
//! for each request, from the same snapshot as every other answer.

use std::sync::atomic::AtomicU64;

use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::{Metric, Registry};

use crate::audit::Audit;
use crate::fleet::processes::{Health, Processes};
use crate::fleet::{Seen, Snapshot, message_of};
use crate::http::latency::Latencies;
use crate::recording::status::WriterStatus;
use crate::view::Ages;

/// The media type of the text.
pub(crate) const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

type Labels = Vec<(&'static str, String)>;
type Gauges = Family<Labels, Gauge<f64, AtomicU64>>;
/// Exported with the suffix `_total`.
type Counters = Family<Labels, Counter>;

/// The metrics of everything that `snapshot` knows.
pub(crate) fn text(
    snapshot: &Snapshot,
    ages: Ages,
    audit: &Audit,
    writer: Option<&WriterStatus>,
    latencies: &Latencies,
) -> String {
    let mut registry = Registry::with_prefix("kittiwake");
    gateway(&mut registry, audit, writer);
    latencies.register(&mut registry);
    processes(&mut registry, snapshot, ages);
    vehicles(&mut registry, snapshot, ages);
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = encode(&mut text, &registry);
    text
}

fn gateway(registry: &mut Registry, audit: &Audit, writer: Option<&WriterStatus>) {
    let build: Gauges = family(registry, "build_info", "1, labelled with the version of the program");
    build.get_or_create(&vec![("version", env!("CARGO_PKG_VERSION").to_owned())]).set(1.0);
    let audit_lost: Counters = family(registry, "audit_lost", "Audit records that could not be written");
    let dropped: Counters = family(registry, "recording_dropped", "Messages that could not be recorded");
    let waiting: Gauges = family(registry, "recording_waiting_bytes", "Bytes that wait to be written");
    let failing: Gauges = family(registry, "recording_failing", "1 while missions cannot be recorded");
    let refused: Counters = family(registry, "refused_requests", "Requests that were refused, besides orders");
    audit_lost.get_or_create(&Vec::new()).inc_by(audit.lost());
    for (reason, count) in audit.refusals.by_reason() {
        refused.get_or_create(&vec![("reason", reason)]).inc_by(count);
    }
    if let Some(writer) = writer {
        dropped.get_or_create(&Vec::new()).inc_by(writer.dropped());
        waiting.get_or_create(&Vec::new()).set(writer.waiting() as f64);
        failing.get_or_create(&Vec::new()).set(one_if(writer.problem().is_some()));
    }
}

fn processes(registry: &mut Registry, snapshot: &Snapshot, ages: Ages) {
    let uptime: Gauges = family(registry, "process_uptime_seconds", "Mission time since the process started");
    let healthy: Gauges = family(registry, "process_healthy", "1 while the process has a link and makes progress");
    let handled: Counters = family(registry, "process_handled", "Events that the process has handled");
    let dropped: Counters = family(registry, "process_dropped", "Messages dropped because its mailbox was full");
    let malformed: Counters = family(registry, "process_malformed", "Messages refused as malformed or too large");
    let late: Counters = family(registry, "process_late", "Orders and messages from the ground refused as late");
    let refused: Counters = family(registry, "process_refused", "Messages refused because their content is invalid");
    let unanswered: Counters = family(registry, "process_unanswered", "Requests that the process left without a reply");
    let now = snapshot.now.time;
    let export = |vehicle: &str, of: &Processes| {
        for (service, process) in of.iter() {
            let labels = vec![("vehicle", vehicle.to_owned()), ("service", service.to_owned())];
            let is_healthy = process.health(now, ages.stale_after) == Health::Alive;
            healthy.get_or_create(&labels).set(one_if(is_healthy));
            if let Some((_, heartbeat)) = &process.heartbeat {
                uptime.get_or_create(&labels).set(heartbeat.uptime_s);
                handled.get_or_create(&labels).inc_by(heartbeat.handled);
                dropped.get_or_create(&labels).inc_by(heartbeat.dropped);
                malformed.get_or_create(&labels).inc_by(heartbeat.malformed);
                late.get_or_create(&labels).inc_by(heartbeat.late);
                refused.get_or_create(&labels).inc_by(heartbeat.refused);
                unanswered.get_or_create(&labels).inc_by(heartbeat.unanswered);
            }
        }
    };
    export("", &snapshot.fleet.ground);
    snapshot.fleet.vehicles.iter().for_each(|(name, state)| export(name, &state.processes));
}

fn vehicles(registry: &mut Registry, snapshot: &Snapshot, ages: Ages) {
    let source_age: Gauges = family(registry, "source_age_wall_seconds", "Wall time since the source's last message");
    let ticks: Counters = family(registry, "tree_ticks", "Ticks of the mission tree");
    let flag_up: Gauges = family(registry, "flag_up", "1 for each flag that is up");
    let flying: Gauges = family(registry, "flying", "1 while the vehicle flies");
    let battery: Gauges = family(registry, "battery_remaining_ratio", "Battery charge, 0 empty to 1 full");
    let now = snapshot.now.time;
    for (name, state) in &snapshot.fleet.vehicles {
        let labels = || -> Labels { vec![("vehicle", name.to_string())] };
        let with = |label: &'static str, value: &str| [labels(), vec![(label, value.to_owned())]].concat();
        let age = |source: &str, age_s: Option<f64>| {
            if let Some(age_s) = age_s {
                source_age.get_or_create(&with("source", source)).set(age_s);
            }
        };
        age("vehicle_status", age_s(&state.status, now, ages));
        age("introspection", age_s(&state.introspection, now, ages));
        age("mission_status", age_s(&state.mission, now, ages));
        age("mcm_status", age_s(&state.mcm, now, ages));
        age("permission_ledger", age_s(&state.ledger, now, ages));
        age("tree_snapshot", age_s(&state.tree, now, ages));
        if let Some(mcm) = message_of(&state.mcm) {
            ticks.get_or_create(&labels()).inc_by(mcm.ticks);
        }
        for flag in state.flags.up(now) {
            flag_up.get_or_create(&with("flag", &flag.name)).set(1.0);
        }
        if let Some(introspection) = message_of(&state.introspection) {
            let is_flying = introspection.derived.as_ref().is_some_and(|it| it.flying);
            flying.get_or_create(&labels()).set(one_if(is_flying));
            if let Some(status) = &introspection.battery {
                battery.get_or_create(&labels()).set(status.remaining);
            }
        }
    }
}

fn family<M: Metric + Default + Clone>(registry: &mut Registry, name: &str, help: &str) -> M {
    let metrics = M::default();
    registry.register(name, help, metrics.clone());
    metrics
}

fn age_s<M>(seen: &Option<Seen<M>>, now: domain::time::Time, ages: Ages) -> Option<f64> {
    seen.as_ref().map(|seen| ages.wall(seen, now).as_secs_f64())
}

fn one_if(condition: bool) -> f64 {
    f64::from(u8::from(condition))
}
