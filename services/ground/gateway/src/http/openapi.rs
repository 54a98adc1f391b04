//! The OpenAPI 3.1 document of the routes; its schemas are those of the contract's messages.

use kittiwake_proto::{schema, v1};
use prost::Name;
use serde_json::{Map, Value, json};

use crate::http::routes::{Access, Reply, Route};

/// The schema of the two members that `Reply::Stamped` adds.
const STAMP: &str = "Stamp";

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
    let id = format!("{}{}", route.method.name(), route.path.replace(['/', '{', '}'], " "));
    let id = id.split([' ', '-', '.']).filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-");
    let names = route.path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let mut parameters: Vec<Value> = names
        .map(|name| json!({ "name": name, "in": "path", "required": true, "schema": { "type": "string" } }))
        .collect();
    if route.access.needs_key() {
        parameters.push(json!({
            "name": "Idempotency-Key", "in": "header", "required": true,
            "description": "Chosen by the client: a request repeated with the same key gets the same answer and has no second effect.",
            "schema": { "type": "string", "minLength": 1, "maxLength": 64 },
        }));
    }
    let mut operation = json!({
        "operationId": id,
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
        Reply::Media(media_type) => json!({ media_type: {} }),
        Reply::Document(name) => json!({ "application/json": { "schema": reference(name) } }),
        Reply::Stamped(name) => {
            let both = json!({ "allOf": [schema::reference(STAMP), reference(name)] });
            json!({ "application/json": { "schema": both } })
        }
    };
    json!({ "description": "done", "content": content })
}

fn stamp() -> Value {
    json!({
        "type": "object",
        "properties": { "missionTimeS": { "type": "number" }, "utc": { "type": "string", "format": "date-time" } },
        "required": ["missionTimeS", "utc"],
    })
}

fn reference(name: &str) -> Value {
    schema::reference(&full_name(name))
}

fn full_name(name: &str) -> String {
    format!("{}.{name}", v1::Problem::PACKAGE)
}
