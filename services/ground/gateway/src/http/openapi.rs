//! The OpenAPI 3.1 document of the routes; its schemas are those of the contract's messages.

use std::collections::BTreeSet;

use kittiwake_proto::{schema, v1};
use prost::Name;
use serde_json::{Map, Value, json};

use crate::http::events::EVENT_STREAM;
use crate::http::problem::Kind;
use crate::http::routes::{Access, Reply, Route};

/// The schema of the two members that `Reply::Stamped` adds.
const STAMP: &str = "Stamp";

/// What a key does, and what it does not.
const REPEATED: &str = "Chosen by the client. Once an order was carried out or refused for good, the gateway repeats that answer under the \
    same key and does nothing else, for the newest 512 such answers, and the newest 8 of more than 16 KiB. While the first request is under way, after `outcome-unknown` and when the answer is not kept any more, \
    the order is sent again: the mission manager recognises its key, so that it has no second effect. A decision \
    about a permission, `permissions/accept-loss`, `sites/{site}/report`, `simulation/flags` and `simulation/faults` reach nobody who recognises a key: they are \
    carried out again.";

/// Describes every route of `table`.
pub(crate) fn document<'a>(table: impl Iterator<Item = &'a Route> + Clone) -> Value {
    let mut paths: Map<String, Value> = Map::new();
    for route in table.clone() {
        let path = paths.entry(route.path).or_insert_with(|| json!({}));
        path[route.method.name()] = operation(route);
    }
    let requests: Vec<String> = table.filter_map(|route| route.body).map(full_name).collect();
    let mut schemas = schema::schemas(&requests);
    schemas.insert(STAMP.to_owned(), stamp());
    schemas[&full_name(v1::Problem::NAME)]["properties"]["type"] = problem_types();
    let events: Vec<_> = EVENTS.iter().map(|(kind, message)| (event_name(kind), event(&schemas, message))).collect();
    schemas.extend(events);
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Kittiwake gateway",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "What an operator sees and orders. JSON is canonical proto3 JSON; errors are problem details (RFC 9457).",
            "license": { "name": "MIT OR Apache-2.0" },
        },
        "paths": paths,
        "components": {
            "schemas": schemas,
            "securitySchemes": { "bearer": { "type": "http", "scheme": "bearer" } },
        },
    })
}

fn operation(route: &Route) -> Value {
    let roles: Vec<&str> = route.access.roles().iter().map(|role| role.name()).collect();
    let path = route.path.strip_prefix("/api/v1").unwrap_or(route.path);
    let words: Vec<&str> = path.split(['/', '{', '}', '-', '.']).filter(|word| !word.is_empty()).collect();
    let id = [&[route.method.name()], &words[..]].concat().join("-");
    let tag = if route.access.needs_key() { "orders" } else { words.first().unwrap_or(&"page") };
    let names = route.path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let mut parameters: Vec<Value> = names
        .map(|name| json!({ "name": name, "in": "path", "required": true, "schema": { "type": "string" } }))
        .collect();
    if route.access.needs_key() {
        parameters.push(json!({
            "name": "Idempotency-Key", "in": "header", "required": true,
            "description": REPEATED,
            "schema": { "type": "string", "minLength": 1, "maxLength": 64 },
        }));
    }
    let mut operation = json!({
        "operationId": id,
        "tags": [tag],
        "summary": route.summary,
        "parameters": parameters,
        "responses": { "200": reply(route.reply), "default": {
            "description": "Why the request was not carried out.",
            "content": { "application/problem+json": { "schema": reference(v1::Problem::NAME) } },
        } },
        "security": match route.access {
            Access::Anyone => json!([]),
            _ => json!([{ "bearer": &roles }]),
        },
    });
    if matches!(route.access, Access::InCommand(_)) {
        operation["description"] = json!("An operator needs command of the vehicle.");
    }
    if let Some(body) = route.body {
        let content = json!({ "application/json": { "schema": reference(body) } });
        operation["requestBody"] = json!({ "required": !route.body_is_optional, "content": content });
    }
    operation
}

fn reply(reply: Reply) -> Value {
    let content = match reply {
        Reply::Media(EVENT_STREAM) => json!({ EVENT_STREAM: event_stream() }),
        Reply::Media(media_type) => json!({ media_type: {} }),
        Reply::Document(name) => json!({ "application/json": { "schema": reference(name) } }),
        Reply::Stamped(name) => {
            let both = json!({ "allOf": [schema::reference(STAMP), reference(name)] });
            json!({ "application/json": { "schema": both } })
        }
    };
    json!({ "description": "done", "content": content })
}

/// The kinds of problems, each with what a client can do. No closed set: a client that was generated from this document must be able to read
/// a problem of a later gateway.
fn problem_types() -> Value {
    let known = Kind::ALL.iter().map(|it| format!("- `{}`: {}", it.uri(), it.summary()));
    let description = format!("One of these, or one that is new:\n{}", known.collect::<Vec<_>>().join("\n"));
    let examples: Vec<_> = Kind::ALL.iter().map(|it| it.uri()).collect();
    json!({ "type": "string", "description": description, "examples": examples })
}

/// The events of a vehicle's stream, each with the message in its data.
const EVENTS: [(&str, &str); 10] = [
    ("status", v1::Vehicle::NAME),
    ("decision", v1::DecisionRecord::NAME),
    ("skill", v1::SkillEvent::NAME),
    ("flag", v1::FlagEvent::NAME),
    ("permission", v1::Permission::NAME),
    ("objective", v1::Objective::NAME),
    ("report", v1::MissionReport::NAME),
    ("audit", v1::AuditRecord::NAME),
    ("command", v1::CommandAuthority::NAME),
    ("resync", v1::Resync::NAME),
];

/// The schema of the data of an event of this kind, such as `DecisionEvent`.
fn event_name(kind: &str) -> String {
    let (first, rest) = kind.split_at(1);
    format!("{}{rest}Event", first.to_uppercase())
}

/// The message of an event with what is added to it: flat, and open even where the same message as a request is not.
fn event(schemas: &Map<String, Value>, message: &str) -> Value {
    // It has both of the stamp's members of its own.
    if message == v1::Vehicle::NAME {
        return reference(message);
    }
    let mut schema = schemas.get(&full_name(message)).cloned().unwrap_or_else(|| json!({ "type": "object" }));
    let mut added = stamp();
    if message == v1::DecisionRecord::NAME {
        added["properties"]["sentence"] = json!({ "type": "string" });
        added["required"] = json!(["utc", "sentence"]);
    }
    if let Some(members) = schema.as_object_mut() {
        members.remove("additionalProperties");
    }
    for (name, of) in added["properties"].as_object().into_iter().flatten() {
        schema["properties"][name] = of.clone();
    }
    let required = [&schema["required"], &added["required"]].map(|it| it.as_array().cloned().unwrap_or_default());
    // Some messages have a `utc` of their own.
    let required: BTreeSet<String> = required.concat().iter().filter_map(|it| it.as_str().map(str::to_owned)).collect();
    schema["required"] = json!(required);
    schema
}

/// A stream of server-sent events: what the data of each may be, and which belongs to which `event:`.
fn event_stream() -> Value {
    let name = |kind: &str| schema::reference(&event_name(kind));
    let by_kind: Map<String, Value> = EVENTS.iter().map(|(kind, _)| ((*kind).to_owned(), name(kind))).collect();
    let any: Vec<Value> = EVENTS.iter().map(|(kind, _)| name(kind)).collect();
    json!({ "schema": { "anyOf": any }, "x-events": by_kind })
}

fn stamp() -> Value {
    json!({
        "type": "object",
        "properties": { "missionTimeS": { "type": "number" }, "utc": { "type": "string", "format": "date-time" } },
        "required": ["utc"],
    })
}

fn reference(name: &str) -> Value {
    schema::reference(&full_name(name))
}

fn full_name(name: &str) -> String {
    format!("{}.{name}", v1::Problem::PACKAGE)
}
