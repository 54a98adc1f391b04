//! Reads and checks the table of the link.

use std::time::Duration;

use domain::file::{Mistake, Mistakes, Source, did_you_mean};
use domain::quantity::Positive;
use kittiwake_proto::topics::{Service, Topic};
use serde::Deserialize;
use toml::Spanned;

use super::{Carrier, Class, Crossing, Priorities, ServiceRow, Side, TopicRow};

/// What only the executive layer says to the vehicle.
const FLIGHT_COMMANDS: &str = "fmu/in/";

impl Crossing {
    /// Parses and checks the table; every mistake that can be found is reported at once.
    ///
    /// # Errors
    /// With the place of each mistake.
    pub fn read(source: &Source) -> Result<Crossing, Mistakes> {
        let file: File = source.parse()?;
        let mut mistakes = Vec::new();
        let carrier = carrier(source, &file.carrier, &mut mistakes);
        check_name(source, &file.ground, &mut mistakes);
        let topics = file.topic.iter().enumerate().filter_map(|(index, row)| {
            twin(source, &row.name, file.topic[..index].iter().map(|it| &it.name), &mut mistakes);
            topic(source, row, &mut mistakes)
        });
        let topics: Vec<_> = topics.collect();
        let services = file.service.iter().enumerate().filter_map(|(index, row)| {
            twin(source, &row.name, file.service[..index].iter().map(|it| &it.name), &mut mistakes);
            service(source, row, &mut mistakes)
        });
        let services: Vec<_> = services.collect();
        let ground = file.ground.into_inner();
        Mistakes(mistakes).or(Crossing { ground, carrier, priority: file.priority, topics, services })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    ground: Spanned<String>,
    carrier: CarrierEntry,
    priority: Priorities,
    #[serde(default)]
    topic: Vec<TopicEntry>,
    #[serde(default)]
    service: Vec<ServiceEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CarrierEntry {
    lease_s: Spanned<Positive>,
    open_limit_s: Spanned<Positive>,
    batch_bytes: Spanned<u32>,
    queue_batches: Spanned<u32>,
    send_buffer_bytes: Spanned<u32>,
    largest_message_bytes: Spanned<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TopicEntry {
    name: Spanned<String>,
    direction: Spanned<Direction>,
    class: Class,
    rate_hz: Option<Spanned<Positive>>,
}

#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Direction {
    Down,
    Up,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ServiceEntry {
    name: Spanned<String>,
    answered_by: Side,
    class: Class,
}

fn carrier(source: &Source, entry: &CarrierEntry, mistakes: &mut Vec<Mistake>) -> Carrier {
    let mut bytes = |it: &Spanned<u32>, low: u32, high: u32| {
        let found = *it.as_ref();
        if found < low || high < found {
            let message = format!("found {found}, expected {low} to {high}");
            mistakes.push(source.mistake(Some(it.span()), message, ""));
        }
        found.clamp(low, high)
    };
    let batch_bytes = bytes(&entry.batch_bytes, 256, 65_535);
    let queue_batches = bytes(&entry.queue_batches, 1, 16);
    let send_buffer_bytes = bytes(&entry.send_buffer_bytes, 1024, 4_194_304);
    let largest_message_bytes = bytes(&entry.largest_message_bytes, 256, 1_048_576);
    let mut seconds = |it: &Spanned<Positive>| {
        let found = it.as_ref().seconds();
        if found < Duration::from_millis(100) || Duration::from_secs(60) < found {
            let message = format!("found {} s, expected 0.1 to 60", it.as_ref().get());
            mistakes.push(source.mistake(Some(it.span()), message, ""));
        }
        found
    };
    let (lease, open_limit) = (seconds(&entry.lease_s), seconds(&entry.open_limit_s));
    if batch_bytes * queue_batches < largest_message_bytes {
        let message = format!(
            "a message of {largest_message_bytes} bytes does not fit into {queue_batches} pieces of {batch_bytes}"
        );
        let help = "a message that does not fit into the queue never crosses: make it smaller, or the pieces larger";
        mistakes.push(source.mistake(Some(entry.largest_message_bytes.span()), message, help));
    }
    Carrier {
        lease,
        open_limit,
        batch_bytes: batch_bytes as u16,
        queue_batches: queue_batches as u8,
        send_buffer_bytes,
        largest_message_bytes,
    }
}

fn check_name(source: &Source, name: &Spanned<String>, mistakes: &mut Vec<Mistake>) {
    let allowed = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit() || matches!(it, '-' | '_' | '.');
    if name.as_ref().is_empty() || !name.as_ref().chars().all(allowed) {
        let help = "lower-case letters, digits, `-`, `_` and `.`, as in the certificate";
        mistakes.push(source.mistake(Some(name.span()), format!("`{}` is not a valid name", name.as_ref()), help));
    }
}

fn twin<'a>(
    source: &Source,
    name: &Spanned<String>,
    mut earlier: impl Iterator<Item = &'a Spanned<String>>,
    mistakes: &mut Vec<Mistake>,
) {
    if earlier.any(|it| it.as_ref() == name.as_ref()) {
        let message = format!("two rows for `{}`", name.as_ref());
        mistakes.push(source.mistake(Some(name.span()), message, "one topic or service has one row"));
    }
}

fn topic(source: &Source, row: &TopicEntry, mistakes: &mut Vec<Mistake>) -> Option<TopicRow> {
    let name = row.name.as_ref().as_str();
    let Some(&topic) = Topic::ALL.iter().find(|it| it.key() == name) else {
        let known: Vec<_> = Topic::ALL.iter().map(|it| it.key()).collect();
        let message = format!("there is no topic `{name}`");
        mistakes.push(source.mistake(Some(row.name.span()), message, did_you_mean(name, &known)));
        return None;
    };
    if name.starts_with(FLIGHT_COMMANDS) {
        let help = "only the vehicle's own executive layer flies it: orders go to `mcm/command`";
        mistakes.push(source.mistake(Some(row.name.span()), format!("`{name}` never crosses the link"), help));
    }
    let from = match row.direction.as_ref() {
        Direction::Down => Side::Aircraft,
        Direction::Up => Side::Ground,
    };
    if let (Side::Ground, true) = (from, name.starts_with("fmu/")) {
        let help = "what the autopilot says, only the vehicle says";
        mistakes.push(source.mistake(Some(row.direction.span()), format!("`{name}` does not go up"), help));
    }
    if let Some(rate) = &row.rate_hz
        && (row.class == Class::Command || from == Side::Ground)
    {
        let help = "only what goes down and is repeated can be thinned: leave `rate_hz` out";
        mistakes.push(source.mistake(Some(rate.span()), format!("`{name}` is not to be thinned"), help));
    }
    if let (Some(rate), Topic::Heartbeat) = (&row.rate_hz, topic) {
        let help = "all processes of a vehicle speak on one key, and one would drown the others: leave `rate_hz` out";
        mistakes.push(source.mistake(Some(rate.span()), format!("`{name}` cannot be thinned"), help));
    }
    let rate_hz = row.rate_hz.as_ref().map(|it| it.as_ref().get());
    Some(TopicRow { topic, from, class: row.class, rate_hz })
}

fn service(source: &Source, row: &ServiceEntry, mistakes: &mut Vec<Mistake>) -> Option<ServiceRow> {
    let name = row.name.as_ref().as_str();
    let Some(&service) = Service::ALL.iter().find(|it| it.key() == name) else {
        let known: Vec<_> = Service::ALL.iter().map(|it| it.key()).collect();
        let message = format!("there is no service `{name}`");
        mistakes.push(source.mistake(Some(row.name.span()), message, did_you_mean(name, &known)));
        return None;
    };
    Some(ServiceRow { service, answered_by: row.answered_by, class: row.class })
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) const SHIPPED: &str = include_str!("../../../../config/zenoh/link.toml");

    fn read(text: &str) -> Result<Crossing, Mistakes> {
        Crossing::read(&Source { path: "link.toml".into(), text: text.into() })
    }

    #[test]
    fn the_shipped_table_is_sound() {
        let table = read(SHIPPED).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        assert!(table.topics.iter().all(|it| !it.topic.key().starts_with(FLIGHT_COMMANDS)));
    }

    #[test]
    fn every_mistake_is_reported_with_its_place() {
        /// Replaces `find` and expects a mistake at the place of `at` in what took its place.
        #[track_caller]
        fn check(find: &str, replace: &str, at: &str, said: &str) {
            let text = SHIPPED.replacen(find, replace, 1);
            assert!(text != SHIPPED, "the table lacks `{find}`");
            let start = SHIPPED.find(find).unwrap() + replace.find(at).unwrap();
            let (line, column) =
                (text[..start].matches('\n').count() + 1, start - text[..start].rfind('\n').map_or(0, |it| it + 1) + 1);
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(&format!("link.toml:{line}:{column}: ")), "expected {line}:{column}, got:\n{error}");
            assert!(error.contains(said), "expected `{said}`, got:\n{error}");
        }
        check("ground = \"ground-router\"", "groun = \"ground-router\"", "groun", "unknown field `groun`");
        check("\"ground-router\"", "\"Ground Router\"", "\"Ground", "is not a valid name");
        check("\"mcm/status\"", "\"mcm/statu\"", "\"mcm", "did you mean `mcm/status`?");
        check("\"mcm/command\"", "\"mcm/comand\"", "\"mcm", "did you mean `mcm/command`?");
        check("\"mcm/tree\"", "\"mcm/status\"", "\"mcm/status", "two rows for `mcm/status`");
        check("\"mcm/tree\"", "\"fmu/in/vehicle_command\"", "\"fmu", "never crosses the link");
        check(
            "vehicle_status\"\ndirection = \"down\"",
            "vehicle_status\"\ndirection = \"up\"",
            "\"up",
            "does not go up",
        );
        check("rate_hz = 0.5", "rate_hz = 0.0", "0.0", "expected a number between");
        check("rate_hz = 0.5", "rate = 0.5", "rate", "unknown field `rate`");
        check(
            "direction = \"up\"\nclass = \"command\"",
            "direction = \"up\"\nclass = \"urgent\"",
            "\"urgent",
            "`bulk`",
        );
        check("name = \"health\"\n", "name = \"health\"\nrate_hz = 1.0\n", "1.0", "cannot be thinned");
        check("name = \"ground/contact\"\n", "name = \"ground/contact\"\nrate_hz = 1.0\n", "1.0", "not to be thinned");
        check("bulk = \"background\"", "bulk = \"later\"", "\"later", "unknown variant `later`");
        check("queue_batches = 16", "queue_batches = 17", "17", "expected 1 to 16");
        check("largest_message_bytes = 12000", "largest_message_bytes = 13000", "13000", "does not fit");
        check("lease_s = 2.0", "lease_s = 200.0", "200.0", "expected 0.1 to 60");
    }
}
