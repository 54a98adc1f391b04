//! How often each topic comes, and how evenly, from the stamps of its publisher.

#![expect(clippy::disallowed_methods, reason = "rates are measured over wall time, and all that comes is kept")]

use std::collections::BTreeMap;
use std::time::Duration;

use bus::{Link, Tap, Tapped};
use kittiwake_proto::topics::Topic;
use serde::Serialize;

/// A topic and its rate in the reference's table 4.1, or ours.
pub(crate) const RATES: &[(Topic, f64)] = &[
    (Topic::VehicleAttitude, 240.0),
    (Topic::VehicleLocalPosition, 123.0),
    (Topic::VehicleGlobalPosition, 123.0),
    (Topic::BatteryStatus, 99.0),
    (Topic::VehicleStatus, 2.0),
    (Topic::VehicleLandDetected, 1.0),
    (Topic::Introspection, 100.0),
];

/// What a topic achieved.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Rate {
    pub topic: &'static str,
    pub wanted_hz: f64,
    pub achieved_hz: f64,
    /// How far from its regular moment a sample was published, in milliseconds; half of them, and 99 %.
    pub jitter_p50_ms: f64,
    pub jitter_p99_ms: f64,
    /// Samples that were published and did not come by.
    pub lost: u64,
}

/// Listens to everything for a while. It loads the bus: nothing else should be measured meanwhile.
pub(crate) fn measure(link: &Link, over: Duration) -> Result<Vec<Rate>, String> {
    let (hear, heard) = std::sync::mpsc::channel();
    let topics: Vec<Topic> = RATES.iter().map(|it| it.0).collect();
    let tap = Tap::open(link, &topics, move |it| {
        // Fails only at the end of the measurement.
        let _ = hear.send(it);
    })
    .map_err(|it| it.to_string())?;
    std::thread::sleep(over);
    drop(tap);
    let mut by_topic: BTreeMap<Topic, Vec<Tapped>> = BTreeMap::new();
    heard.into_iter().for_each(|it| by_topic.entry(it.message.topic()).or_default().push(it));
    let of = |(topic, wanted_hz): &(Topic, f64)| rate(*topic, *wanted_hz, by_topic.get(topic).map_or(&[], |it| it));
    Ok(RATES.iter().filter_map(of).collect())
}

fn rate(topic: Topic, wanted_hz: f64, samples: &[Tapped]) -> Option<Rate> {
    let (first, last) = (samples.first()?, samples.last()?);
    let published = last.sequence.checked_sub(first.sequence).filter(|it| 0 < *it)?;
    let span_s = last.published_ns.checked_sub(first.published_ns)? as f64 / 1e9;
    let period_ns = 1e9 / wanted_hz;
    let gap = |pair: &[Tapped]| {
        let count = (pair[1].sequence - pair[0].sequence) as f64;
        let took = pair[1].published_ns.saturating_sub(pair[0].published_ns) as f64;
        (took - count * period_ns).abs() / 1e6
    };
    let mut jitter: Vec<f64> = samples.windows(2).map(gap).collect();
    jitter.sort_by(f64::total_cmp);
    let at = |share: f64| jitter[((share * jitter.len() as f64) as usize).min(jitter.len() - 1)];
    Some(Rate {
        topic: topic.key(),
        wanted_hz,
        achieved_hz: published as f64 / span_s,
        jitter_p50_ms: at(0.5),
        jitter_p99_ms: at(0.99),
        lost: published + 1 - samples.len() as u64,
    })
}
