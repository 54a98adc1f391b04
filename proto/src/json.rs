//! Canonical proto3 JSON of any message, by reflection.

use std::sync::LazyLock;

use prost::{Message, Name};
use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, SerializeOptions};

use crate::v1;

static POOL: LazyLock<DescriptorPool> = LazyLock::new(|| {
    let bytes = include_bytes!(concat!(env!("OUT_DIR"), "/descriptor.bin"));
    DescriptorPool::decode(bytes.as_slice()).expect("the descriptor set was written by this crate's build script")
});

/// How deep JSON may be nested in a field of a message: so many arrays and objects within one another. Each of them is two messages on
/// the wire, and whoever decodes a message refuses more than a hundred within one another.
pub const MAX_DEPTH: usize = 16;

/// The message as canonical proto3 JSON: lowerCamelCase names, enums by name, 64-bit integers as
/// strings. Fields at their default are written too, so that a reader sees `false` and `0`; a field
/// with presence that is not set is left out.
pub fn to_json<M: Message + Name>(message: &M) -> serde_json::Value {
    try_to_json(message).expect("a message nests few others, and JSON in it no more than `any` lets in")
}

/// The same of a message that may hold JSON from elsewhere than [`any`].
///
/// # Errors
/// That more messages are nested in it than a reader takes.
pub fn try_to_json<M: Message + Name>(message: &M) -> Result<serde_json::Value, String> {
    let descriptor = POOL.get_message_by_name(&M::full_name()).expect("every compiled message is in the pool");
    let mut dynamic = DynamicMessage::new(descriptor);
    dynamic.transcode_from(message).map_err(|error| error.to_string())?;
    let options = SerializeOptions::new().skip_default_fields(false);
    dynamic.serialize_with_options(serde_json::value::Serializer, &options).map_err(|error| error.to_string())
}

/// The message in canonical proto3 JSON; an unknown field is an error.
///
/// # Errors
/// What is wrong, in words.
pub fn from_json<M: Message + Name + Default>(json: &serde_json::Value) -> Result<M, String> {
    let descriptor = POOL.get_message_by_name(&M::full_name()).expect("every compiled message is in the pool");
    let dynamic = DynamicMessage::deserialize(descriptor, json).map_err(|error| error.to_string())?;
    dynamic.transcode_to().map_err(|error| error.to_string())
}

/// The first member of `json` that [`from_json`] refuses, as a JSON pointer such as `/position/northM`; `None` if the value as a whole
/// is of another kind, or nothing is wrong with it.
pub fn wrong_member<M: Name>(json: &serde_json::Value) -> Option<String> {
    wrong_in(&POOL.get_message_by_name(&M::full_name())?, json)
}

/// The first coordinate in `json`, as a JSON pointer, that is not named or is no finite number: proto3 takes one that is left out for zero,
/// and a place that nobody named is no place.
pub fn wrong_coordinate<M: Name>(json: &serde_json::Value) -> Option<String> {
    wrong_coordinate_in(&POOL.get_message_by_name(&M::full_name())?, json)
}

fn wrong_coordinate_in(message: &MessageDescriptor, json: &serde_json::Value) -> Option<String> {
    let members = json.as_object()?;
    let is_finite =
        |it: &serde_json::Value| it.as_f64().or_else(|| it.as_str()?.parse().ok()).is_some_and(f64::is_finite);
    if message.full_name() == v1::Ned::full_name() {
        let is_named = |field: &FieldDescriptor| {
            [field.json_name(), field.name()].iter().filter_map(|it| members.get(*it)).any(is_finite)
        };
        // Over ground: a height that is left out is that of the ground.
        let fields = ["north_m", "east_m"].iter().filter_map(|it| message.get_field_by_name(it));
        return fields.filter(|it| !is_named(it)).map(|it| member(it.json_name())).next();
    }
    members.iter().find_map(|(name, value)| {
        let field = message.get_field_by_json_name(name).or_else(|| message.get_field_by_name(name))?;
        let kind = field.kind();
        let inner = kind.as_message().filter(|_| !field.is_map())?;
        let within = match value.as_array().filter(|_| field.is_list()) {
            Some(items) => items
                .iter()
                .enumerate()
                .find_map(|(n, item)| wrong_coordinate_in(inner, item).map(|it| format!("/{n}{it}"))),
            None => wrong_coordinate_in(inner, value),
        };
        Some(member(name) + &within?)
    })
}

/// A member as a JSON pointer has it, its name escaped as in RFC 6901.
fn member(name: &str) -> String {
    format!("/{}", name.replace('~', "~0").replace('/', "~1"))
}

fn wrong_in(message: &MessageDescriptor, json: &serde_json::Value) -> Option<String> {
    use serde_json::{Value, json};
    let is_wrong =
        |name: &str, value: &Value| DynamicMessage::deserialize(message.clone(), json!({ name: value })).is_err();
    let (name, value) = json.as_object()?.iter().find(|(name, value)| is_wrong(name, value))?;
    let here = member(name);
    let field = message.get_field_by_json_name(name).or_else(|| message.get_field_by_name(name));
    let Some(field) = field.filter(|it| !it.is_map()) else { return Some(here) };
    let inner = |value: &Value| field.kind().as_message().and_then(|it| wrong_in(it, value)).unwrap_or_default();
    let within = match value.as_array().filter(|_| field.is_list()) {
        Some(items) => match items.iter().position(|item| is_wrong(name, &json!([item]))) {
            Some(n) => format!("/{n}{}", inner(&items[n])),
            None => String::new(),
        },
        None => inner(value),
    };
    Some(here + &within)
}

/// Any JSON as a field of a message; `None` if it is nested deeper than [`MAX_DEPTH`], which nobody could read again.
pub fn any(json: &serde_json::Value) -> Option<prost_types::Value> {
    (depth(json) <= MAX_DEPTH).then(|| value_of(json))
}

/// How many arrays and objects are within one another at the deepest place.
pub fn depth(json: &serde_json::Value) -> usize {
    use serde_json::Value;
    match json {
        Value::Array(values) => 1 + values.iter().map(depth).max().unwrap_or_default(),
        Value::Object(fields) => 1 + fields.values().map(depth).max().unwrap_or_default(),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => 0,
    }
}

fn value_of(json: &serde_json::Value) -> prost_types::Value {
    use serde_json::Value;
    match json {
        Value::Null => {
            let null = prost_types::NullValue::NullValue.into();
            prost_types::Value { kind: Some(prost_types::value::Kind::NullValue(null)) }
        }
        Value::Bool(value) => (*value).into(),
        Value::Number(value) => value.as_f64().unwrap_or(f64::NAN).into(),
        Value::String(value) => value.clone().into(),
        Value::Array(values) => values.iter().map(value_of).collect::<Vec<_>>().into(),
        Value::Object(fields) => fields
            .iter()
            .map(|(name, value)| (name.clone(), value_of(value)))
            .collect::<std::collections::BTreeMap<_, _>>()
            .into(),
    }
}

/// Texts as a JSON array in a field.
pub fn text_list(texts: Vec<String>) -> prost_types::ListValue {
    prost_types::ListValue { values: texts.into_iter().map(Into::into).collect() }
}

/// Every message and enum of the contract.
pub(crate) fn pool() -> &'static DescriptorPool {
    &POOL
}

#[cfg(test)]
mod tests {
    use super::*;
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
        check(
            json!({ "objective": { "position": { "eastM": 1, "northM": "far" } } }),
            Some("/objective/position/northM"),
        );
        check(json!([]), None);
        let status = json!({ "objectives": [{ "name": "a" }, { "name": 7 }] });
        assert_eq!(wrong_member::<v1::PlannerStatus>(&status).as_deref(), Some("/objectives/1/name"));
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
            let too_deep = Some(value_of(&nested(60)));
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
        for message in POOL.all_messages() {
            assert!(nested(&message, &[]) < 100, "{}", message.full_name());
        }
    }
}
