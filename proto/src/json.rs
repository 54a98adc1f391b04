//! Canonical proto3 JSON of any message, by reflection.

use std::sync::LazyLock;

use prost::{Message, Name};
use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, SerializeOptions};

use crate::v1;

static POOL: LazyLock<DescriptorPool> = LazyLock::new(|| {
    let bytes = include_bytes!(concat!(env!("OUT_DIR"), "/descriptor.bin"));
    DescriptorPool::decode(bytes.as_slice()).expect("the descriptor set was written by this crate's build script")
});

/// How deep JSON may be nested in a field of a message: the most arrays and objects within one another. Each of them is
/// two messages on the wire, and a decoder refuses more than a hundred within one another.
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

/// The first coordinate in `json`, as a JSON pointer, that is not named or not a finite number: proto3 takes one that
/// is left out for zero, and an unnamed place is not a place.
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
pub fn pool() -> &'static DescriptorPool {
    &POOL
}
