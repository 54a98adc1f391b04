//! Every route in one table: who may use it, what it takes and what it answers. The router, the guard and the
//! OpenAPI document all come from this table, so that none of them can lack a route.

use axum::Router;
use axum::body::Bytes;
use axum::handler::Handler;
use axum::http::header::CONTENT_TYPE;
use axum::middleware::from_fn;
use axum::routing::{MethodFilter, on};

use crate::access::Role;
use crate::http::site::Site;
use crate::http::{guard, openapi};

/// One route.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Route {
    pub(crate) method: Method,
    /// The path, with `{parameters}`.
    pub(crate) path: &'static str,
    pub(crate) access: Access,
    /// What the route does, in a line.
    pub(crate) summary: &'static str,
    /// The name of the message in the body.
    pub(crate) body: Option<&'static str>,
    /// Whether the body may be left out.
    pub(crate) body_is_optional: bool,
    pub(crate) reply: Reply,
}

/// What is done to the resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// Reads it.
    Get,
    /// Does something.
    Post,
    /// Replaces it.
    Put,
    /// Removes it.
    Delete,
}

/// What a route answers.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Reply {
    /// Something of this media type.
    Media(&'static str),
    /// The message of this name as JSON.
    Document(&'static str),
    /// The message of this name as JSON, with `missionTimeS` and `utc` added.
    Stamped(&'static str),
}

/// Who may use a route.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Access {
    /// Everybody, without a token.
    Anyone,
    /// Clients with one of these roles.
    OneOf(&'static [Role]),
    /// Clients with one of these roles, under an idempotency key.
    Keyed(&'static [Role]),
    /// The operator who has command of the vehicle, and clients with one of these roles, under an idempotency key.
    InCommand(&'static [Role]),
}

/// Every role may read.
pub(crate) const READERS: Access = Access::OneOf(&Role::ALL);

impl Access {
    /// The roles that may use the route; one of them is enough.
    pub(crate) fn roles(self) -> Vec<Role> {
        match self {
            Access::Anyone => Vec::new(),
            Access::OneOf(roles) | Access::Keyed(roles) => roles.to_vec(),
            Access::InCommand(or) => [Role::Operator].into_iter().chain(or.iter().copied()).collect(),
        }
    }

    /// Whether a request needs an idempotency key.
    pub(crate) fn needs_key(self) -> bool {
        matches!(self, Access::Keyed(_) | Access::InCommand(_))
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

    /// Its name in OpenAPI.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Method::Get => "get",
            Method::Post => "post",
            Method::Put => "put",
            Method::Delete => "delete",
        }
    }
}

impl Route {
    /// A route that reads.
    pub(crate) fn read(path: &'static str, access: Access, summary: &'static str, reply: Reply) -> Route {
        Route { method: Method::Get, path, access, summary, body: None, body_is_optional: false, reply }
    }
}

/// The routes added so far.
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

    /// The router of all routes, and of one that describes them.
    pub(crate) fn finish(self) -> Router<Site> {
        let reply = Reply::Media("application/json");
        let route = Route::read("/openapi.json", Access::Anyone, "The description of every route", reply);
        // One text, which all answers share.
        let document = Bytes::from(openapi::document(self.table.iter().chain([&route])).to_string());
        self.add(route, async move || ([(CONTENT_TYPE, "application/json")], document)).router
    }
}
