//! Every route in one table: who may use it, what it takes and what it answers. The router, the
//! guard and the OpenAPI document all come from it, so that none of them can forget a route.

use axum::Router;
use axum::handler::Handler;
use axum::middleware::from_fn;
use axum::routing::{MethodFilter, on};
use kittiwake_proto::schema;
use serde_json::{Map, Value, json};

use crate::access::Role;
use crate::guard::{self, Site};

/// One route.
#[derive(Debug, Clone, Copy)]
pub struct Route {
    /// `get`, `post`, `put` or `delete`.
    pub method: Method,
    /// With `{parameters}`.
    pub path: &'static str,
    /// Who may use it.
    pub access: Access,
    /// What it does, in a line.
    pub summary: &'static str,
    /// The schema of the body it takes; empty for none.
    pub body: &'static str,
    /// The schema of what it answers; empty for a document without one.
    pub answer: &'static str,
}

/// What is done to the resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Reads.
    Get,
    /// Does something.
    Post,
    /// Takes the place of what is there.
    Put,
    /// Takes away.
    Delete,
}

/// Who may use a route.
#[derive(Debug, Clone, Copy)]
pub enum Access {
    /// Whoever asks.
    Anyone,
    /// Whoever has one of these roles.
    OneOf(&'static [Role]),
    /// Whoever has one of these roles, under an idempotency key.
    Keyed(&'static [Role]),
    /// The operator who holds command of the vehicle, or whoever has one of these roles, under an idempotency key.
    Helm(&'static [Role]),
}

/// Any role reads.
pub const READERS: Access = Access::OneOf(&Role::ALL);

impl Access {
    /// The roles that are let in, of which one is enough.
    pub fn roles(self) -> Vec<Role> {
        match self {
            Access::Anyone => Vec::new(),
            Access::OneOf(roles) | Access::Keyed(roles) => roles.to_vec(),
            Access::Helm(or) => [Role::Operator].into_iter().chain(or.iter().copied()).collect(),
        }
    }

    /// Whether a key is asked for.
    pub fn is_keyed(self) -> bool {
        matches!(self, Access::Keyed(_) | Access::Helm(_))
    }
}

impl Method {
    fn filter(self) -> MethodFilter {
        match self {
            Method::Get => MethodFilter::GET,
            Method::Post => MethodFilter::POST,
            Method::Put => MethodFilter::PUT,
            Method::Delete => MethodFilter::DELETE,
        }
    }

    /// As OpenAPI writes it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Method::Get => "get",
            Method::Post => "post",
            Method::Put => "put",
            Method::Delete => "delete",
        }
    }
}

/// The routes so far.
pub(crate) struct Routes {
    site: Site,
    router: Router<Site>,
    table: Vec<Route>,
}

impl Routes {
    pub(crate) fn new(site: Site) -> Routes {
        Routes { site, router: Router::new(), table: Vec::new() }
    }

    /// Adds a route behind its guard; there is no other way to add one.
    pub(crate) fn add<H, T>(mut self, route: Route, handler: H) -> Routes
    where
        H: Handler<T, Site>,
        T: 'static,
    {
        let site = self.site.clone();
        let guarded = on(route.method.filter(), handler)
            .route_layer(from_fn(move |request, next| guard::guard(site.clone(), route, request, next)));
        self.router = self.router.route(route.path, guarded);
        self.table.push(route);
        self
    }

    /// The router and the OpenAPI document of all routes.
    pub(crate) fn finish(self) -> (Router<Site>, Value) {
        let document = document(&self.table);
        (self.router, document)
    }
}

/// OpenAPI 3.1.
fn document(table: &[Route]) -> Value {
    let mut paths: Map<String, Value> = Map::new();
    for route in table {
        let path = paths.entry(route.path).or_insert_with(|| json!({}));
        path[route.method.name()] = operation(route);
    }
    let mut schemas = schema::schemas();
    schemas.extend(own_schemas());
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Kittiwake gateway",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "What an operator sees and does. JSON is canonical proto3 JSON; errors are problem details (RFC 9457).",
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
    let roles: Vec<&str> = route.access.roles().iter().map(|it| it.name()).collect();
    let id = format!("{}{}", route.method.name(), route.path.replace(['/', '{', '}'], " "));
    let id = id.split([' ', '-', '.']).filter(|it| !it.is_empty()).collect::<Vec<_>>().join("-");
    let names = route.path.split('/').filter_map(|it| it.strip_prefix('{')?.strip_suffix('}'));
    let mut parameters: Vec<Value> = names
        .map(|name| json!({ "name": name, "in": "path", "required": true, "schema": { "type": "string" } }))
        .collect();
    if route.access.is_keyed() {
        parameters.push(json!({
            "name": "Idempotency-Key", "in": "header", "required": true,
            "description": "Chosen by the client: the same key again gets the same answer and does nothing.",
            "schema": { "type": "string", "minLength": 1, "maxLength": 64 },
        }));
    }
    let answer = match route.answer {
        "" => json!({ "description": "done" }),
        media if media.contains('/') => json!({ "description": "done", "content": { media: {} } }),
        name => {
            json!({ "description": "done", "content": { "application/json": { "schema": schema::reference(name) } } })
        }
    };
    let mut operation = json!({
        "operationId": id,
        "summary": route.summary,
        "parameters": parameters,
        "responses": { "200": answer, "default": {
            "description": "why not",
            "content": { "application/problem+json": { "schema": schema::reference("Problem") } },
        } },
        "security": match route.access {
            Access::Anyone => json!([]),
            _ => json!([{ "bearer": &roles }]),
        },
    });
    if matches!(route.access, Access::Helm(_)) {
        operation["description"] = json!("An operator has to hold command of the vehicle.");
    }
    if !route.body.is_empty() {
        operation["requestBody"] = json!({
            "required": true,
            "content": { "application/json": { "schema": schema::reference(route.body) } },
        });
    }
    operation
}

/// In a list without what follows `problem`.
fn recording() -> Value {
    let text = json!({ "type": "string" });
    let or_null = json!({ "type": ["string", "null"] });
    let moment = json!({ "type": ["string", "null"], "format": "date-time" });
    let objects = json!({ "type": "array", "items": { "type": "object" } });
    json!({
        "type": "object",
        "properties": {
            "id": text, "vehicle": text, "mission": text, "started": moment, "ended": moment,
            "outcome": or_null, "reason": or_null, "bytes": { "type": "integer" },
            "state": { "enum": ["recording", "complete", "damaged"] }, "problem": or_null,
            "objectives": { "type": "array", "items": schema::reference("kittiwake.v1.Objective") },
            "decisions": objects, "contingencies": objects, "permissions": objects,
            "report": { "oneOf": [schema::reference("kittiwake.v1.MissionReport"), { "type": "null" }] },
            "messages": { "type": "integer" }, "leftOut": { "type": "integer" },
        },
        "required": ["id", "vehicle", "mission", "started", "ended", "outcome", "reason", "bytes", "state", "problem"],
    })
}

fn own_schemas() -> Map<String, Value> {
    let text = json!({ "type": "string" });
    let name_or_null = json!({ "type": ["string", "null"] });
    let object = |properties: Value, required: Value| json!({ "type": "object", "properties": properties, "required": required });
    let stamps = json!({ "missionTimeS": { "type": "number" }, "utc": { "type": "string", "format": "date-time" } });
    let stamped = |mut properties: Value| {
        if let (Value::Object(all), Value::Object(stamps)) = (&mut properties, stamps.clone()) {
            all.extend(stamps);
        }
        object(properties, json!(["missionTimeS", "utc"]))
    };
    let schemas = [
        (
            "Problem",
            object(
                json!({
                    "type": text, "title": text, "status": { "type": "integer" }, "detail": text,
                }),
                json!(["type", "title", "status", "detail"]),
            ),
        ),
        (
            "Session",
            object(
                json!({
                    "name": text, "roles": { "type": "array", "items": text }, "simulation": { "type": "boolean" },
                }),
                json!(["name", "roles", "simulation"]),
            ),
        ),
        ("Fleet", stamped(json!({ "vehicles": { "type": "array", "items": { "type": "object" } } }))),
        ("Vehicle", stamped(json!({ "vehicle": text, "command": schema::reference("Command") }))),
        (
            "Command",
            object(json!({ "holder": name_or_null, "offeredTo": name_or_null }), json!(["holder", "offeredTo"])),
        ),
        ("HandOver", object(json!({ "to": text }), json!(["to"]))),
        ("Done", stamped(json!({ "vehicle": text, "verb": text, "requestId": text, "text": text }))),
        (
            "Recordings",
            object(
                json!({
                    "folder": name_or_null,
                    "state": { "enum": ["ok", "off", "failing"] },
                    "problem": name_or_null,
                    "dropped": { "type": "integer" },
                    "recordings": { "type": "array", "items": schema::reference("Recording") },
                }),
                json!(["folder", "state", "problem", "dropped", "recordings"]),
            ),
        ),
        ("Recording", recording()),
        (
            "FaultList",
            stamped(json!({ "faults": { "type": "array", "items": schema::reference("kittiwake.v1.FaultKind") } })),
        ),
        ("Audit", object(json!({ "records": { "type": "array", "items": { "type": "object" } } }), json!(["records"]))),
    ];
    schemas.into_iter().map(|(name, schema)| (name.to_owned(), schema)).collect()
}
