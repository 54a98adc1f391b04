//! A recorded mission in short, folded from its messages: what was to be done, what was decided, what went wrong and
//! how it ended. Its size is bounded, whatever the recording holds.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::wire::decision::sentence;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use kittiwake_proto::v1::recording as doc;

use crate::fleet::ledger::with_part;
use crate::fleet::occurrence::{self, Occurrence};
use crate::view;

/// The most lines of each list; a mission has dozens.
const MAX_LINES: usize = 5000;
/// The most bytes of all lists together.
const MAX_BYTES: usize = 4 * 1024 * 1024;

/// What is known of a mission.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Summary {
    /// The vehicle; empty if it is unknown.
    pub(crate) vehicle: String,
    /// The mission's name, as the mission manager had it last.
    pub(crate) mission: String,
    /// When the first message arrived, in milliseconds since the Unix epoch.
    pub(crate) started_ms: Option<i64>,
    /// When the last message arrived.
    pub(crate) ended_ms: Option<i64>,
    /// How the mission ended.
    pub(crate) report: Option<v1::MissionReport>,
    /// Number of messages.
    pub(crate) messages: u32,
    objectives: Vec<v1::Objective>,
    decisions: Vec<doc::Decision>,
    contingencies: BTreeMap<String, Contingency>,
    permissions: Vec<doc::Permission>,
    ledger: Option<v1::PermissionLedger>,
    bytes: usize,
    /// Lines left out because there are too many.
    left_out: u32,
}

#[derive(Debug, Clone, PartialEq)]
struct Contingency {
    from_ms: i64,
    until_ms: i64,
    newest: v1::ActiveContingency,
    acted: bool,
}

impl Summary {
    /// The summary of a vehicle's mission before its first message.
    pub(crate) fn of(vehicle: &str) -> Summary {
        Summary { vehicle: vehicle.to_owned(), ..Summary::default() }
    }

    /// Takes in a metadata record.
    pub(crate) fn on_metadata(&mut self, metadata: &BTreeMap<String, String>) {
        if let Some(vehicle) = metadata.get("vehicle") {
            self.vehicle.clone_from(vehicle);
        }
    }

    /// The metadata record of what is known.
    pub(crate) fn metadata(&self) -> BTreeMap<String, String> {
        let outcome = self.report.as_ref().map(|report| report.outcome().as_str_name());
        let facts = [
            ("vehicle", Some(self.vehicle.as_str())),
            ("mission", Some(self.mission.as_str()).filter(|name| !name.is_empty())),
            ("outcome", outcome),
        ];
        facts.into_iter().filter_map(|(name, fact)| Some((name.to_owned(), fact?.to_owned()))).collect()
    }

    /// Takes in a message; one that is malformed is only counted.
    pub(crate) fn on_message(&mut self, topic: Topic, utc_ms: i64, bytes: &[u8]) {
        self.messages = self.messages.saturating_add(1);
        self.started_ms.get_or_insert(utc_ms);
        self.ended_ms = self.ended_ms.max(Some(utc_ms));
        let summed_up =
            [Topic::MissionStatus, Topic::McmStatus, Topic::DecisionRecord, Topic::PermissionLedger].contains(&topic);
        let Some(message) = summed_up.then(|| Message::decode(topic, bytes).ok()).flatten() else { return };
        match message {
            Message::MissionStatus(status) => {
                self.mission = status.mission;
                self.objectives = status.objectives;
            }
            Message::McmStatus(status) => self.on_status(utc_ms, status),
            Message::DecisionRecord(decision) => self.on_decision(utc_ms, decision),
            Message::PermissionLedger(ledger) => self.on_ledger(utc_ms, ledger),
            _ => {}
        }
    }

    fn on_decision(&mut self, utc_ms: i64, decision: v1::DecisionRecord) {
        let text = sentence(&decision);
        if self.has_room(self.decisions.len(), text.len()) {
            let utc = view::utc(utc_ms);
            self.decisions.push(doc::Decision { utc, at_s: decision.at_s, topic: decision.topic, text });
        }
    }

    fn on_ledger(&mut self, utc_ms: i64, ledger: v1::PermissionLedger) {
        // What remains of a permission is not told here.
        let before = self.ledger.as_ref().map(|it| (it, Duration::ZERO));
        let ledger = with_part(before, ledger);
        let before = self.ledger.replace(ledger.clone());
        for changed in occurrence::permissions(before.as_ref(), &ledger) {
            if let Occurrence::Permission(v1::Permission { area, state, reason, .. }) = changed
                && self.has_room(self.permissions.len(), reason.len())
            {
                self.permissions.push(doc::Permission { utc: view::utc(utc_ms), area, state, reason });
            }
        }
    }

    fn on_status(&mut self, utc_ms: i64, status: v1::McmStatus) {
        for newest in status.contingencies {
            let acts = newest.flag == status.acting;
            if let Some(known) = self.contingencies.get_mut(&newest.flag) {
                (known.until_ms, known.acted, known.newest) = (utc_ms, known.acted || acts, newest);
            } else if self.has_room(self.contingencies.len(), newest.reason.len()) {
                let flag = newest.flag.clone();
                self.contingencies.insert(flag, Contingency { from_ms: utc_ms, until_ms: utc_ms, newest, acted: acts });
            }
        }
        if status.report.is_some() {
            self.report = status.report;
        }
    }

    fn has_room(&mut self, lines: usize, bytes: usize) -> bool {
        let has_room = lines < MAX_LINES && self.bytes + bytes <= MAX_BYTES;
        if has_room {
            self.bytes += bytes;
        } else {
            self.left_out = self.left_out.saturating_add(1);
        }
        has_room
    }

    /// What a list shows of the mission; the caller sets the fields of its file.
    pub(crate) fn overview(&self) -> v1::RecordingSummary {
        v1::RecordingSummary {
            vehicle: self.vehicle.clone(),
            mission: self.mission.clone(),
            started: self.started_ms.map(view::utc),
            ended: self.ended_ms.map(view::utc),
            outcome: self.report.as_ref().map(|report| report.outcome),
            reason: self.report.as_ref().map(|report| report.reason.clone()),
            ..Default::default()
        }
    }

    /// The whole recording, with the fields of `overview`.
    pub(crate) fn recording(&self, overview: v1::RecordingSummary) -> v1::Recording {
        let mut contingencies: Vec<&Contingency> = self.contingencies.values().collect();
        contingencies.sort_by_key(|contingency| contingency.from_ms);
        v1::Recording {
            id: overview.id,
            vehicle: overview.vehicle,
            mission: overview.mission,
            started: overview.started,
            ended: overview.ended,
            outcome: overview.outcome,
            reason: overview.reason,
            bytes: overview.bytes,
            state: overview.state,
            problem: overview.problem,
            objectives: self.objectives.clone(),
            report: self.report.clone(),
            decisions: self.decisions.clone(),
            contingencies: contingencies.into_iter().map(Contingency::document).collect(),
            permissions: self.permissions.clone(),
            messages: self.messages,
            left_out: self.left_out,
        }
    }
}

impl Contingency {
    fn document(&self) -> doc::Contingency {
        doc::Contingency {
            flag: self.newest.flag.clone(),
            action: self.newest.action.clone(),
            reason: self.newest.reason.clone(),
            acted: self.acted,
            acknowledged_by: self.newest.acknowledged_by.clone(),
            from: view::utc(self.from_ms),
            until: view::utc(self.until_ms),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::json::to_json;
    use serde_json::{Value, json};

    fn fold(messages: Vec<Message>) -> Summary {
        let mut summary = Summary::default();
        for (n, message) in messages.into_iter().enumerate() {
            summary.on_message(message.topic(), 1000 * n as i64, &message.encode());
        }
        summary
    }

    /// Everything as JSON.
    fn json_of(summary: &Summary) -> Value {
        to_json(&summary.recording(summary.overview()))
    }

    fn status(flags: &[&str], acting: &str) -> Message {
        let contingency =
            |it: &&str| v1::ActiveContingency { flag: it.to_string(), action: "hold".into(), ..Default::default() };
        let contingencies = flags.iter().map(contingency).collect();
        v1::McmStatus { contingencies, acting: acting.into(), ..Default::default() }.into()
    }

    #[test]
    fn a_ledger_in_parts_tells_of_each_permission_once() {
        let part = |area: &str, [after, through]: [&str; 2]| {
            let state = v1::PermissionState::Granted.into();
            let permissions = vec![v1::Permission { area: area.into(), state, ..Default::default() }];
            let (after_area, through_area) = (after.into(), through.into());
            Message::from(v1::PermissionLedger { permissions, after_area, through_area, ..Default::default() })
        };
        let round = || [part("A", ["", "A"]), part("B", ["A", ""])];
        let summary = json_of(&fold([round(), round()].concat()));
        let areas: Vec<_> = summary["permissions"].as_array().unwrap().iter().map(|it| &it["area"]).collect();
        assert_eq!(areas, ["A", "B"]);
    }

    #[test]
    fn a_mission_is_summarised() {
        let permission = |state: v1::PermissionState| {
            let permissions = vec![v1::Permission { area: "A".into(), state: state.into(), ..Default::default() }];
            Message::from(v1::PermissionLedger { permissions, ..Default::default() })
        };
        let report = v1::MissionReport { outcome: v1::MissionOutcome::Success.into(), ..Default::default() };
        let objectives = vec![v1::Objective { name: "deliver".into(), ..Default::default() }];
        let summary = fold(vec![
            v1::MissionStatus { mission: "reference".into(), objectives, ..Default::default() }.into(),
            v1::DecisionRecord {
                at_s: 1.5,
                topic: "step".into(),
                text: "takeoff by 10 m".into(),
                ..Default::default()
            }
            .into(),
            permission(v1::PermissionState::Requested),
            permission(v1::PermissionState::Requested),
            permission(v1::PermissionState::Granted),
            status(&["wind"], ""),
            status(&["battery", "wind"], "wind"),
            v1::McmStatus { report: Some(report), ..Default::default() }.into(),
        ]);
        let summary = json_of(&summary);
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
    fn lines_beyond_the_limit_are_left_out_and_counted() {
        #[track_caller]
        fn check(count: usize, length: usize, shown: usize) {
            let decision = || v1::DecisionRecord { text: "x".repeat(length), ..Default::default() };
            let summary = json_of(&fold((0..count).map(|_| decision().into()).collect()));
            assert_eq!(summary["decisions"].as_array().unwrap().len(), shown);
            assert_eq!(summary["leftOut"], count - shown);
        }
        check(MAX_LINES + 7, 1, MAX_LINES);
        // A full stop is added to each.
        check(9, MAX_BYTES / 4 - 1, 4);
    }

    #[test]
    fn a_malformed_message_is_only_counted() {
        let mut summary = Summary::default();
        summary.on_message(Topic::McmStatus, 5, &[0xff; 9]);
        assert_eq!((summary.messages, summary.report), (1, None));
    }
}
