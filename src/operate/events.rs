//! `kittiwake vehicle events`: events as they happen, a line each.

#![expect(clippy::disallowed_methods, reason = "nothing tells when to ask again")]

use std::io::{BufRead, BufReader};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::show;
use crate::operate::words::{number, on_one_line, text, word};
use crate::output;

/// A stream that broke is opened again until this has passed.
const LIMIT: Duration = Duration::from_secs(10);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(200);

/// One event.
#[derive(Debug, Default, PartialEq)]
struct Event {
    kind: String,
    id: String,
    data: String,
}

/// Prints `count` events, or all until the command is stopped; a stream that breaks is resumed where it was.
pub fn follow(gateway: &Gateway, count: Option<usize>, status: bool, json: bool) -> Result<(), Failure> {
    let (mut printed, mut after, mut since) = (0, String::new(), Instant::now());
    while count.is_none_or(|count| printed < count) {
        match gateway.events(&after) {
            Err(failure) if LIMIT <= since.elapsed() || !is_worth_repeating(&failure) => return Err(failure),
            Err(_) => std::thread::sleep(PAUSE),
            Ok(stream) => {
                for event in events(BufReader::new(stream)) {
                    since = Instant::now();
                    if !event.id.is_empty() {
                        after.clone_from(&event.id);
                    }
                    if event.kind == "status" && !status {
                        continue;
                    }
                    if !output::is_read(line(&event, json)) {
                        return Ok(());
                    }
                    printed += 1;
                    if count.is_some_and(|count| count <= printed) {
                        return Ok(());
                    }
                }
                std::thread::sleep(PAUSE);
            }
        }
    }
    Ok(())
}

fn is_worth_repeating(failure: &Failure) -> bool {
    failure.outcome == crate::outcome::Outcome::Unreachable
}

/// The events of a stream, until it ends.
fn events(stream: impl BufRead) -> impl Iterator<Item = Event> {
    let mut lines = stream.lines().map_while(Result::ok);
    std::iter::from_fn(move || {
        let mut event = Event::default();
        for line in lines.by_ref() {
            let (field, value) = line.split_once(':').unwrap_or((&line, ""));
            let value = value.strip_prefix(' ').unwrap_or(value);
            match field {
                // The end of an event; keep-alive comments come alone.
                "" if line.is_empty() && !event.data.is_empty() => return Some(event),
                "event" => value.clone_into(&mut event.kind),
                "id" => value.clone_into(&mut event.id),
                "data" => event.data.push_str(value),
                _ => {}
            }
        }
        None
    })
}

fn line(event: &Event, json: bool) -> String {
    let data: Value = serde_json::from_str(&event.data).unwrap_or_else(|_| json!(event.data));
    if json {
        return json!({ "event": event.kind, "id": event.id, "data": data }).to_string();
    }
    let at = data["missionTimeS"].as_f64().map(|it| format!("[{it:7.1} s] ")).unwrap_or_default();
    format!("{at}{}", words(&event.kind, &on_one_line(&data)))
}

fn words(kind: &str, it: &Value) -> String {
    let why =
        |it: &Value| it["reason"].as_str().filter(|it| !it.is_empty()).map(|it| format!(": {it}")).unwrap_or_default();
    match kind {
        "decision" => format!("{}: {}", text(&it["topic"]), text(&it["text"])),
        "skill" => {
            let outcome = match word(&it["outcome"], "SKILL_OUTCOME_").as_str() {
                "-" => word(&it["state"], "SKILL_STATE_"),
                outcome => outcome.to_owned(),
            };
            format!("skill: {} {outcome}{}", word(&it["kind"], "SKILL_KIND_"), why(it))
        }
        "flag" => {
            let verb = if it["raised"] == true { "raised" } else { "cleared" };
            format!("flag: `{}` {verb}{}", text(&it["name"]), why(it))
        }
        "permission" => {
            format!("permission: area {} {}{}", text(&it["area"]), word(&it["state"], "PERMISSION_STATE_"), why(it))
        }
        "objective" => {
            format!("objective: `{}` {}{}", text(&it["name"]), word(&it["state"], "OBJECTIVE_STATE_"), why(it))
        }
        "report" => format!("report: {}{}", word(&it["outcome"], "MISSION_OUTCOME_"), why(it)),
        "audit" => format!("order: {}: {}: {}", text(&it["who"]), text(&it["what"]), text(&it["outcome"])),
        "command" => format!("command: {}", show::command(it)),
        "status" => format!(
            "status: {}, {} m high",
            word(&it["mission"]["phase"], "MISSION_PHASE_"),
            number(&it["aircraft"]["derived"]["heightM"], 1)
        ),
        other => format!("{other}: {}", it["detail"].as_str().map_or_else(|| it.to_string(), str::to_owned)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_cut_into_its_events() {
        let text = ": hello\n\nid: 1-2\nevent: decision\ndata: {\"a\":1}\n\nevent:status\ndata:{}\n\nevent: cut off\n";
        let found: Vec<Event> = events(text.as_bytes()).collect();
        let event = |kind: &str, id: &str, data: &str| Event { kind: kind.into(), id: id.into(), data: data.into() };
        assert_eq!(found, [event("decision", "1-2", "{\"a\":1}"), event("status", "", "{}")]);
    }

    #[test]
    fn each_kind_has_a_line_of_its_own() {
        #[track_caller]
        fn check(kind: &str, data: Value, expected: &str) {
            let event = Event { kind: kind.into(), id: "1-1".into(), data: data.to_string() };
            assert_eq!(line(&event, false), expected);
            let json: Value = serde_json::from_str(&line(&event, true)).unwrap();
            assert_eq!((&json["event"], &json["data"]), (&json!(kind), &data));
        }
        check(
            "decision",
            json!({ "missionTimeS": 12.34, "topic": "plan", "text": "plan 2" }),
            "[   12.3 s] plan: plan 2",
        );
        check("flag", json!({ "name": "wind", "raised": true, "reason": "8 m/s" }), "flag: `wind` raised: 8 m/s");
        check(
            "skill",
            json!({ "kind": "SKILL_KIND_LAND", "state": "SKILL_STATE_EXECUTE", "outcome": "SKILL_OUTCOME_UNSPECIFIED" }),
            "skill: land execute",
        );
        check(
            "permission",
            json!({ "area": "A", "state": "PERMISSION_STATE_DENIED", "reason": "fog" }),
            "permission: area A denied: fog",
        );
        check("audit", json!({ "who": "anna", "what": "pause", "outcome": "holds" }), "order: anna: pause: holds");
        check("command", json!({}), "command: nobody");
        check("resync", json!({ "detail": "events were lost" }), "resync: events were lost");
        check("new", json!({ "a": 1 }), "new: {\"a\":1}");
    }
}
