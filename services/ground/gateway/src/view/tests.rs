//! The documents of a vehicle after certain messages.

use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::json::to_json;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::Event;
use serde_json::{Value, json};

use super::vehicle::vehicle;
use super::{Ages, fleet};
use crate::fleet::Snapshot;

const AGES: Ages =
    Ages { pace: Pace::REAL_TIME, stale_after: Duration::from_secs(2), status_period: Duration::from_millis(500) };

fn view(snapshot: &Snapshot) -> Value {
    to_json(&vehicle(snapshot, "uav1", AGES, &v1::CommandAuthority::default()).unwrap())
}

/// The vehicle's JSON after these messages, one a second.
fn after(messages: impl IntoIterator<Item = Message>) -> Value {
    view(&snapshot_after(messages))
}

fn snapshot_after(messages: impl IntoIterator<Item = Message>) -> Snapshot {
    let mut snapshot = Snapshot::default();
    for (s, message) in messages.into_iter().enumerate() {
        snapshot.now = Now { time: Time::after(Duration::from_secs(s as u64)), utc_ms: 0 };
        let event = Event::Message { vehicle: "uav1".into(), message };
        snapshot.fleet.fold(snapshot.now, event, &mut Vec::new());
    }
    snapshot
}

fn planner(step_ids: &[u64], state: v1::ObjectiveState) -> Message {
    let steps = step_ids.iter().map(|&id| {
        let ask_permissions = if id == 2 { vec!["a".into(), "b".into()] } else { Vec::new() };
        let ahead = || v1::AskAhead { area: "a".into(), for_s: 60.0, after_s: 2.0 };
        let ask_ahead = if id == 1 { vec![ahead()] } else { Vec::new() };
        v1::PlanStep { id, ask_permissions, ask_ahead, ..Default::default() }
    });
    let objective = v1::Objective { name: "there".into(), state: state as i32, ..Default::default() };
    v1::MissionStatus {
        mission: "reference".into(),
        objectives: vec![objective],
        plan: Some(v1::Plan { steps: steps.collect(), revision: 3, ..Default::default() }),
        ..Default::default()
    }
    .into()
}

fn ledger(state: v1::PermissionState, valid_for_s: f64) -> Message {
    let permission = v1::Permission { area: "a".into(), state: state as i32, valid_for_s, ..Default::default() };
    v1::PermissionLedger { permissions: vec![permission], ..Default::default() }.into()
}

#[test]
fn what_was_never_seen_is_absent_and_not_a_default() {
    let view = after([v1::SkillFeedback::default().into()]);
    for absent in ["operator", "plan", "contingencies", "tree", "aircraft", "report", "wind"] {
        assert_eq!(view.get(absent), None, "{absent}");
    }
    assert_eq!(view["mission"], json!({ "objectives": [] }));
    assert_eq!(view["skill"], json!({ "active": [] }));
    assert_eq!(view["command"], json!({}));
    assert_eq!(view["sources"]["introspection"], json!({ "staleAfterWallS": 0.9 }));
}

#[test]
fn traffic_and_wind_are_shown_for_some_seconds() {
    let report = |id: &str| v1::TransponderReport { id: id.into(), ..Default::default() }.into();
    let wind = v1::WindEstimate { north_m_s: 3.0, east_m_s: -4.0 };
    let view = after([report("a"), wind.into(), report("b")]);
    let ids: Vec<_> = view["traffic"].as_array().unwrap().iter().map(|it| it["id"].as_str().unwrap()).collect();
    assert_eq!((ids, &view["traffic"][0]["wallAgeS"]), (vec!["a", "b"], &json!(2.0)));
    assert_eq!(view["wind"], json!({ "northMS": 3.0, "eastMS": -4.0 }));
    let silence = (0..5).map(|_| v1::SkillFeedback::default().into());
    let later = after([report("a"), wind.into(), report("b")].into_iter().chain(silence));
    assert_eq!(later["traffic"].as_array().unwrap().len(), 0, "{}", later["traffic"]);
    assert_eq!(later["wind"], Value::Null);
}

#[test]
fn the_pictures_of_the_present_mission_are_counted() {
    let began = |began_utc_ms| Message::from(v1::McmStatus { began_utc_ms, ..Default::default() });
    let taken = || Message::from(v1::Picture::default());
    assert_eq!(after([began(7), taken(), began(7), taken()])["pictures"], 2);
    assert_eq!(after([began(7), taken(), began(8), taken(), taken(), taken()])["pictures"], 3);
}

#[test]
fn the_plan_has_two_tracks_side_by_side() {
    let mcm = v1::McmStatus {
        step: Some(v1::PlanStep { id: 1, ..Default::default() }),
        step_number: 1,
        step_count: 2,
        ..Default::default()
    };
    let view =
        after([planner(&[1, 2], v1::ObjectiveState::Waiting), mcm.into(), ledger(v1::PermissionState::Granted, 900.0)]);
    let plan = &view["plan"];
    assert_eq!(plan["revision"], "3");
    assert_eq!(plan["current"]["stepId"], "1");
    assert_eq!(plan["actionTrack"][1]["id"], "2");
    assert_eq!(plan["actionTrack"][1].get("askPermissions"), None);
    let asked = json!([{ "area": "a", "state": "PERMISSION_STATE_GRANTED" }, { "area": "b" }]);
    let ahead = json!([{ "area": "a", "state": "PERMISSION_STATE_GRANTED" }]);
    assert_eq!(
        plan["communicationTrack"],
        json!([
            { "stepId": "1", "askPermissions": [], "askAhead": ahead },
            { "stepId": "2", "askPermissions": asked, "askAhead": [] },
        ])
    );
}

#[test]
fn the_running_skill_comes_with_its_own_feedback() {
    let event = |state: v1::SkillState| v1::SkillEvent { skill_id: 4, state: state as i32, ..Default::default() };
    let feedback = |skill_id| v1::SkillFeedback { skill_id, distance_left_m: 7.0, ..Default::default() };
    let execute = || Message::from(event(v1::SkillState::Execute));
    assert_eq!(after([execute(), feedback(4).into()])["skill"]["feedback"]["distanceLeftM"], 7.0);
    assert_eq!(after([execute(), feedback(3).into()])["skill"]["feedback"], Value::Null);
    let ended = after([execute(), event(v1::SkillState::Ended).into()]);
    assert_eq!(ended["skill"]["running"], Value::Null);
    assert_eq!(ended["skill"]["lastEnded"]["skillId"], "4");
}

#[test]
fn the_report_is_there_once_the_mission_is_over() {
    let outcome = v1::MissionOutcome::Success as i32;
    let report = v1::MissionReport { outcome, mission: "drop".into(), ..Default::default() };
    let over = || Message::from(v1::McmStatus { report: Some(report.clone()), ..Default::default() });
    let mission = |name: &str| Message::from(v1::MissionStatus { mission: name.into(), ..Default::default() });
    assert_eq!(after([mission("drop"), over()])["report"]["outcome"], "MISSION_OUTCOME_SUCCESS");
    assert_eq!(after([over(), mission("survey")])["report"], Value::Null, "it says nothing of the next mission");
}

#[test]
fn a_value_that_is_not_a_number_is_shown_as_such() {
    let battery = v1::BatteryStatus { remaining: f64::NAN, ..Default::default() };
    let view = after([v1::Introspection { battery: Some(battery), ..Default::default() }.into()]);
    assert_eq!(view["aircraft"]["battery"]["remaining"], "NaN");
}

#[test]
fn ages_count_from_the_arrival() {
    let heartbeat = v1::Heartbeat { service: "mcm".into(), instance: "1".into(), handled: 5, ..Default::default() };
    let quiet = || Message::from(v1::SkillFeedback::default());
    let process = |view: Value| {
        let process = &view["processes"][0];
        (process["health"].clone(), process["wallAgeS"].clone(), process["heartbeat"]["handled"].clone())
    };
    let fresh = after([heartbeat.clone().into(), quiet()]);
    assert_eq!(process(fresh), (json!("alive"), json!(1.0), json!("5")));
    let monitor = v1::Heartbeat { service: "monitor".into(), ..heartbeat.clone() };
    let old = after([heartbeat.into(), quiet(), quiet(), monitor.into()]);
    assert_eq!(process(old), (json!("stale"), json!(3.0), json!("5")));
}

#[test]
fn a_vehicle_that_falls_silent_as_a_whole_is_lost_and_nothing_is_known_about_its_processes() {
    let heartbeat =
        |service: &str| v1::Heartbeat { service: service.into(), instance: "1".into(), ..Default::default() }.into();
    let tower = || ledger(v1::PermissionState::Granted, 900.0);
    let health = |view: &Value| {
        let processes = view["processes"].as_array().unwrap().iter();
        processes.map(|it| it["health"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let heard = after([heartbeat("mcm"), heartbeat("monitor"), tower(), tower()]);
    assert_eq!(
        (&heard["contact"], health(&heard)),
        (&json!({ "wallAgeS": 2.0, "lost": false }), vec!["stale".into(), "alive".into()])
    );
    // What the tower says about it is not a sign of its life.
    let lost = after([heartbeat("mcm"), heartbeat("monitor"), tower(), tower(), tower()]);
    assert_eq!(
        (&lost["contact"], health(&lost)),
        (&json!({ "wallAgeS": 3.0, "lost": true }), vec!["unheard".into(); 2])
    );
    assert_eq!(after([tower(), tower(), tower(), tower()])["contact"], json!({ "lost": false }), "it was never heard");
}

#[test]
fn the_fleet_has_what_an_operator_of_several_looks_for() {
    let battery = v1::BatteryStatus { remaining: 0.6, ..Default::default() };
    let derived = v1::Derived { flying: true, height_m: 12.0, ..Default::default() };
    let introspection = v1::Introspection { battery: Some(battery), derived: Some(derived), ..Default::default() };
    let mcm = v1::McmStatus { acting: "battery_low".into(), ..Default::default() };
    let snapshot = snapshot_after([introspection.into(), mcm.into(), v1::SkillFeedback::default().into()]);
    let entry = &to_json(&fleet(&snapshot, AGES))["vehicles"][0];
    let expected = json!({
        "vehicle": "uav1", "phase": "MISSION_PHASE_UNSPECIFIED", "flying": true, "acting": "battery_low",
        "batteryRemaining": 0.6, "heightM": 12.0, "contact": { "wallAgeS": 1.0, "lost": false },
        "contingencies": [], "waitsFor": [],
    });
    assert_eq!(*entry, expected);
}

#[test]
fn no_skill_runs_once_the_skill_manager_is_gone() {
    let mut snapshot = Snapshot::default();
    let mut fold = |event| snapshot.fleet.fold(Now::default(), event, &mut Vec::new());
    let message = v1::SkillEvent { skill_id: 4, ..Default::default() }.into();
    fold(Event::Message { vehicle: "uav1".into(), message });
    let (service, instance) = ("skill-manager".to_string(), "1".to_string());
    fold(Event::Peer { vehicle: "uav1".into(), service, instance, alive: false });
    assert_eq!(view(&snapshot)["skill"], json!({ "active": [] }));
}
