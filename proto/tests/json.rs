//! Messages as JSON.

use kittiwake_proto::json::*;
use kittiwake_proto::v1;
use prost_reflect::MessageDescriptor;
use serde_json::json;

#[test]
fn enums_go_by_name_and_defaults_are_shown() {
    let json = to_json(&v1::ObjectiveReport { name: "deliver".into(), state: 2, ..Default::default() });
    assert_eq!(json["state"], "OBJECTIVE_STATE_SUCCESS");
    assert_eq!(json["planSteps"], 0);
}

#[test]
fn a_field_with_presence_is_left_out_while_it_is_not_set() {
    assert_eq!(to_json(&v1::CommandAuthority::default()), json!({}));
    let offered = v1::CommandAuthority { holder: Some("anna".into()), offered_to: Some(String::new()) };
    assert_eq!(to_json(&offered), json!({ "holder": "anna", "offeredTo": "" }));
}

#[test]
fn what_is_written_is_read_and_what_is_unknown_is_refused() {
    let message = v1::DecidePlan { revision: 3, approve: true };
    assert_eq!(from_json(&to_json(&message)), Ok(message));
    let wrong = json!({ "revision": "3", "aprove": true });
    assert!(from_json::<v1::DecidePlan>(&wrong).unwrap_err().contains("aprove"));
}

#[test]
fn a_place_names_its_coordinates() {
    let check = |position, expected: Option<&str>| {
        let land_at = json!({ "position": position });
        assert_eq!(wrong_coordinate::<v1::LandAt>(&land_at).as_deref(), expected, "{land_at}");
        let insert = json!({ "index": 0, "objective": land_at });
        let expected = expected.map(|it| format!("/objective{it}"));
        assert_eq!(wrong_coordinate::<v1::InsertObjective>(&insert), expected, "{insert}");
    };
    check(json!({ "northM": 0, "eastM": -1.5 }), None);
    check(json!({ "north_m": "1.5", "east_m": 2, "downM": -10 }), None);
    check(json!({}), Some("/position/northM"));
    check(json!({ "northM": 1 }), Some("/position/eastM"));
    check(json!({ "northM": null, "eastM": 1 }), Some("/position/northM"));
    check(json!({ "northM": "NaN", "eastM": 1 }), Some("/position/northM"));
    check(json!({ "northM": 1, "eastM": "-Infinity" }), Some("/position/eastM"));
    let survey = json!({ "corners": [{ "northM": 1, "eastM": 1 }, { "northM": 2 }] });
    assert_eq!(wrong_coordinate::<v1::Survey>(&survey).as_deref(), Some("/corners/1/eastM"));
    assert_eq!(wrong_coordinate::<v1::Survey>(&json!([])), None);
}

#[test]
fn a_mistake_has_a_place() {
    let check = |json, expected: Option<&str>| {
        assert_eq!(wrong_member::<v1::InsertObjective>(&json).as_deref(), expected, "{json}");
        assert_eq!(from_json::<v1::InsertObjective>(&json).is_ok(), expected.is_none() && json.is_object());
    };
    check(json!({ "index": 1, "objective": { "name": "a", "position": { "northM": 1.5 } } }), None);
    check(json!({ "index": "one" }), Some("/index"));
    check(json!({ "indx": 1 }), Some("/indx"));
    check(json!({ "a/b~c": 1 }), Some("/a~1b~0c"));
    check(json!({ "objective": 7 }), Some("/objective"));
    check(json!({ "objective": { "position": { "eastM": 1, "northM": "far" } } }), Some("/objective/position/northM"));
    check(json!([]), None);
    let status = json!({ "objectives": [{ "name": "a" }, { "name": 7 }] });
    assert_eq!(wrong_member::<v1::MissionStatus>(&status).as_deref(), Some("/objectives/1/name"));
}

#[test]
fn not_a_number_survives() {
    let json = to_json(&v1::Ned { north_m: f64::NAN, east_m: f64::INFINITY, down_m: 1.0 });
    assert_eq!(json["northM"], "NaN");
    assert_eq!(json["eastM"], "Infinity");
}

#[test]
fn any_json_survives_as_a_field() {
    for arguments in [json!(null), json!([1.5, "a", true]), json!({ "a": { "b": [] }, "c": null })] {
        let record = v1::AuditRecord { arguments: any(&arguments), ..Default::default() };
        assert_eq!(to_json(&record)["arguments"], arguments);
    }
}

/// A value inside this many lists.
fn lists(levels: usize) -> prost_types::Value {
    use prost_types::value::Kind::{BoolValue, ListValue};
    (0..levels).fold(prost_types::Value { kind: Some(BoolValue(true)) }, |inner, _| prost_types::Value {
        kind: Some(ListValue(prost_types::ListValue { values: vec![inner] })),
    })
}

#[test]
fn json_that_is_nested_too_deep_is_no_field() {
    type Wrap = fn(serde_json::Value) -> serde_json::Value;
    let wraps: [Wrap; 2] = [|it| json!([it]), |it| json!({ "a": it })];
    for wrap in wraps {
        let nested = |levels| (1..levels).fold(wrap(json!(true)), |it, _| wrap(it));
        for levels in [1, MAX_DEPTH - 1, MAX_DEPTH, MAX_DEPTH + 1, 49, 50, 51, 127] {
            let arguments = nested(levels);
            assert_eq!(depth(&arguments), levels);
            let field = any(&arguments);
            assert_eq!(field.is_some(), levels <= MAX_DEPTH, "{levels}");
            let record = v1::AuditRecord { arguments: field, ..Default::default() };
            let log = to_json(&v1::AuditLog { records: vec![record] });
            let expected = (levels <= MAX_DEPTH).then_some(&arguments);
            assert_eq!(log["records"][0].get("arguments"), expected, "{levels}");
        }
        let too_deep = Some(lists(60));
        assert!(try_to_json(&v1::AuditRecord { arguments: too_deep, ..Default::default() }).is_err());
    }
}

/// How many messages are within one another in `message` at most; `above` are those that it is in.
fn nested(message: &MessageDescriptor, above: &[String]) -> usize {
    let name = message.full_name().to_owned();
    if name.starts_with("google.protobuf.") {
        return 2 * MAX_DEPTH + 1;
    }
    assert!(!above.contains(&name), "{name} may be in itself: nothing bounds its depth");
    let above = [above, &[name]].concat();
    let fields: Vec<_> = message.fields().map(|it| it.kind()).collect();
    let inner = fields.iter().filter_map(|it| it.as_message()).map(|it| nested(it, &above)).max();
    1 + inner.unwrap_or_default()
}

#[test]
fn no_message_of_the_contract_nests_more_than_a_reader_takes() {
    for message in pool().all_messages() {
        assert!(nested(&message, &[]) < 100, "{}", message.full_name());
    }
}
