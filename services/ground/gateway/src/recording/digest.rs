//! A recorded mission in short, folded from its messages: what was to be done, what was decided, what
//! went wrong, and how it ended. Bounded, whatever the recording holds.

use std::collections::BTreeMap;

use kittiwake_proto::json::to_json;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use serde_json::{Value, json};

use crate::occurrence::{self, Occurrence};
use crate::view;

/// Lines of each kind; a mission has dozens.
const MOST_LINES: usize = 5000;
/// Bytes of all lines together.
const MOST_BYTES: usize = 4 * 1024 * 1024;

/// What is known of a mission.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Digest {
    /// Whose; empty if nothing says so.
    pub vehicle: String,
    /// The mission's name, as the planner last had it.
    pub mission: String,
    /// When its first and its last message came, in milliseconds since the Unix epoch.
    pub started_ms: Option<i64>,
    /// See there.
    pub ended_ms: Option<i64>,
    /// How it ended, once it has.
    pub report: Option<v1::MissionReport>,
    /// How many messages there are.
    pub messages: u64,
    objectives: Vec<v1::Objective>,
    decisions: Vec<(i64, v1::DecisionRecord)>,
    contingencies: BTreeMap<String, Contingency>,
    permissions: Vec<(i64, v1::Permission)>,
    ledger: Option<v1::PermissionLedger>,
    bytes: usize,
    /// Lines that are not told because there are too many.
    left_out: u64,
}

#[derive(Debug, Clone, PartialEq)]
struct Contingency {
    from_ms: i64,
    until_ms: i64,
    newest: v1::ActiveContingency,
    acted: bool,
}

impl Digest {
    /// Of a mission of which nothing was heard yet.
    pub fn of(vehicle: &str) -> Digest {
        Digest { vehicle: vehicle.to_owned(), ..Digest::default() }
    }

    /// What a recording says of itself.
    pub fn knows(&mut self, known: &BTreeMap<String, String>) {
        if let Some(vehicle) = known.get("vehicle") {
            self.vehicle.clone_from(vehicle);
        }
    }

    /// The first or the last words of a recording about itself.
    pub fn known(&self) -> BTreeMap<String, String> {
        let outcome = self.report.as_ref().map(|it| it.outcome().as_str_name());
        let facts = [
            ("vehicle", Some(self.vehicle.as_str())),
            ("mission", Some(self.mission.as_str()).filter(|it| !it.is_empty())),
            ("outcome", outcome),
        ];
        facts.into_iter().filter_map(|(name, it)| Some((name.to_owned(), it?.to_owned()))).collect()
    }

    /// Takes in a message; one that is not what its topic promises counts, and no more.
    pub fn on(&mut self, topic: Topic, utc_ms: i64, bytes: &[u8]) {
        self.messages += 1;
        self.started_ms.get_or_insert(utc_ms);
        self.ended_ms = self.ended_ms.max(Some(utc_ms));
        let told =
            [Topic::PlannerStatus, Topic::McmStatus, Topic::DecisionRecord, Topic::PermissionLedger].contains(&topic);
        let Some(message) = told.then(|| Message::decode(topic, bytes).ok()).flatten() else { return };
        match message {
            Message::PlannerStatus(it) => {
                self.mission = it.mission;
                self.objectives = it.objectives;
            }
            Message::McmStatus(it) => self.on_status(utc_ms, it),
            Message::DecisionRecord(it) => self.on_decision(utc_ms, it),
            Message::PermissionLedger(it) => {
                let before = self.ledger.replace(it.clone());
                for changed in occurrence::decided(before.as_ref(), &it) {
                    if let Occurrence::Permission(it) = changed
                        && self.has_room(self.permissions.len(), it.reason.len())
                    {
                        self.permissions.push((utc_ms, it));
                    }
                }
            }
            _ => {}
        }
    }

    fn on_decision(&mut self, utc_ms: i64, decision: v1::DecisionRecord) {
        if self.has_room(self.decisions.len(), decision.text.len()) {
            self.decisions.push((utc_ms, decision));
        }
    }

    fn on_status(&mut self, utc_ms: i64, status: v1::McmStatus) {
        for it in status.contingencies {
            let acts = it.flag == status.acting;
            if let Some(known) = self.contingencies.get_mut(&it.flag) {
                (known.until_ms, known.acted, known.newest) = (utc_ms, known.acted || acts, it);
            } else if self.has_room(self.contingencies.len(), it.reason.len()) {
                let from_ms = utc_ms;
                let contingency = Contingency { from_ms, until_ms: utc_ms, newest: it.clone(), acted: acts };
                self.contingencies.insert(it.flag, contingency);
            }
        }
        if status.report.is_some() {
            self.report = status.report;
        }
    }

    fn has_room(&mut self, lines: usize, bytes: usize) -> bool {
        let has_room = lines < MOST_LINES && self.bytes + bytes <= MOST_BYTES;
        if has_room {
            self.bytes += bytes;
        } else {
            self.left_out += 1;
        }
        has_room
    }

    /// A line of a list.
    pub fn card(&self) -> Value {
        json!({
            "vehicle": self.vehicle,
            "mission": self.mission,
            "started": self.started_ms.map(view::utc),
            "ended": self.ended_ms.map(view::utc),
            "outcome": self.report.as_ref().map(|it| it.outcome().as_str_name()),
            "reason": self.report.as_ref().map(|it| &it.reason),
        })
    }

    /// Everything.
    pub fn summary(&self) -> Value {
        let mut summary = self.card();
        let decision = |(utc_ms, it): &(i64, v1::DecisionRecord)| {
            json!({
                "utc": view::utc(*utc_ms), "atS": it.at_s, "topic": it.topic, "text": sentence(&it.text),
            })
        };
        let contingency = |it: &Contingency| {
            json!({
                "flag": it.newest.flag,
                "action": it.newest.action,
                "reason": it.newest.reason,
                "acted": it.acted,
                "acknowledgedBy": it.newest.acknowledged_by,
                "from": view::utc(it.from_ms),
                "until": view::utc(it.until_ms),
            })
        };
        let permission = |(utc_ms, it): &(i64, v1::Permission)| {
            json!({
                "utc": view::utc(*utc_ms), "area": it.area, "state": it.state().as_str_name(), "reason": it.reason,
            })
        };
        // In the order in which they came up.
        let mut contingencies: Vec<&Contingency> = self.contingencies.values().collect();
        contingencies.sort_by_key(|it| it.from_ms);
        summary["objectives"] = self.objectives.iter().map(to_json).collect();
        summary["report"] = self.report.as_ref().map_or(Value::Null, to_json);
        summary["decisions"] = self.decisions.iter().map(decision).collect();
        summary["contingencies"] = contingencies.into_iter().map(contingency).collect();
        summary["permissions"] = self.permissions.iter().map(permission).collect();
        summary["messages"] = json!(self.messages);
        summary["leftOut"] = json!(self.left_out);
        summary
    }
}

/// With a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let text = text.trim();
    let mut letters = text.chars();
    let Some(first) = letters.next() else { return String::new() };
    let stop = if text.ends_with(['.', '!', '?']) { "" } else { "." };
    format!("{}{}{stop}", first.to_uppercase(), letters.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fold(messages: Vec<Message>) -> Digest {
        let mut digest = Digest::default();
        for (n, message) in messages.into_iter().enumerate() {
            digest.on(message.topic(), 1000 * n as i64, &message.encode());
        }
        digest
    }

    fn status(flags: &[&str], acting: &str) -> Message {
        let contingency =
            |it: &&str| v1::ActiveContingency { flag: it.to_string(), action: "hold".into(), ..Default::default() };
        let contingencies = flags.iter().map(contingency).collect();
        v1::McmStatus { contingencies, acting: acting.into(), ..Default::default() }.into()
    }

    #[test]
    fn a_mission_is_told_in_short() {
        let permission = |state: v1::PermissionState| {
            let permissions = vec![v1::Permission { area: "A".into(), state: state.into(), ..Default::default() }];
            Message::from(v1::PermissionLedger { permissions })
        };
        let report = v1::MissionReport { outcome: v1::MissionOutcome::Success.into(), ..Default::default() };
        let objectives = vec![v1::Objective { name: "deliver".into(), ..Default::default() }];
        let told = fold(vec![
            v1::PlannerStatus { mission: "reference".into(), objectives, ..Default::default() }.into(),
            v1::DecisionRecord { at_s: 1.5, topic: "step".into(), text: "takeoff by 10 m".into(), sequence: 1 }.into(),
            permission(v1::PermissionState::Requested),
            permission(v1::PermissionState::Requested),
            permission(v1::PermissionState::Granted),
            status(&["wind"], ""),
            status(&["battery", "wind"], "wind"),
            v1::McmStatus { report: Some(report), ..Default::default() }.into(),
        ]);
        let summary = told.summary();
        assert_eq!(summary["mission"], "reference");
        assert_eq!(summary["outcome"], "MISSION_OUTCOME_SUCCESS");
        assert_eq!(
            (&summary["started"], &summary["ended"]),
            (&json!("1970-01-01T00:00:00.000Z"), &json!("1970-01-01T00:00:07.000Z"))
        );
        assert_eq!(summary["objectives"][0]["name"], "deliver");
        assert_eq!(summary["decisions"][0]["text"], "Takeoff by 10 m.");
        assert_eq!(summary["decisions"][0]["atS"], 1.5);
        let states: Vec<_> = summary["permissions"].as_array().unwrap().iter().map(|it| &it["state"]).collect();
        assert_eq!(states, ["PERMISSION_STATE_REQUESTED", "PERMISSION_STATE_GRANTED"]);
        let flags: Vec<_> =
            summary["contingencies"].as_array().unwrap().iter().map(|it| (&it["flag"], &it["acted"])).collect();
        assert_eq!(flags, [(&json!("wind"), &json!(true)), (&json!("battery"), &json!(false))]);
        assert_eq!((&summary["messages"], &summary["leftOut"]), (&json!(8), &json!(0)));
    }

    #[test]
    fn a_flood_is_cut_off_and_that_is_told() {
        #[track_caller]
        fn check(count: usize, length: usize, told: usize) {
            let decision = || v1::DecisionRecord { text: "x".repeat(length), ..Default::default() };
            let summary = fold((0..count).map(|_| decision().into()).collect()).summary();
            assert_eq!(summary["decisions"].as_array().unwrap().len(), told);
            assert_eq!(summary["leftOut"], count - told);
        }
        check(MOST_LINES + 7, 1, MOST_LINES);
        check(9, MOST_BYTES / 4, 4);
    }

    #[test]
    fn what_is_no_message_counts_and_no_more() {
        let mut digest = Digest::default();
        digest.on(Topic::McmStatus, 5, &[0xff; 9]);
        assert_eq!((digest.messages, digest.report), (1, None));
    }
}
