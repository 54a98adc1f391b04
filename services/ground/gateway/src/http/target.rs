//! What a request is about, read once from the matched parameters of its path: the guard, the audit record and the
//! handler see the same vehicle, however its name is escaped.

use std::collections::BTreeMap;

use axum::extract::{FromRequestParts, Path};
use axum::http::StatusCode;
use axum::http::request::Parts;
use domain::control_character::is_control;
use node::VehicleId;

use crate::audit::refusals::cut;
use crate::fleet::Snapshot;
use crate::http::problem::Problem;
use crate::http::routes::Route;

/// The parameter that names the vehicle.
const VEHICLE: &str = "id";
/// The beginning of every path about a vehicle.
const ABOUT_VEHICLE: &str = "/api/v1/vehicles/{id}/";

/// The longest description of an order, in characters: the path has no limit of its own.
const MAX_WHAT: usize = 200;

/// What a request is about.
#[derive(Debug, Clone, Default)]
pub(crate) struct Target {
    /// A vehicle that is known; `None` for a request that is about none.
    pub(crate) vehicle: Option<VehicleId>,
    /// The parameters of the path by name, decoded.
    pub(crate) parameters: BTreeMap<String, String>,
    /// The path below the vehicle, or the whole path of a request that is about none.
    pub(crate) what: String,
}

impl Target {
    /// Reads the target of a request that `route` matches.
    ///
    /// # Errors
    /// When the path does not decode, has control characters, or names a vehicle that was never seen.
    pub(crate) async fn read(route: &Route, parts: &mut Parts, snapshot: &Snapshot) -> Result<Target, Problem> {
        let read = Path::<BTreeMap<String, String>>::from_request_parts(parts, &()).await;
        let Path(parameters) = read.map_err(|rejection| Problem::new(rejection.status(), rejection.body_text()))?;
        let vehicle = parameters.get(VEHICLE).map(|name| {
            let known = snapshot.fleet.vehicles.get_key_value(name.as_str());
            known.map(|(id, _)| id.clone()).ok_or_else(|| Problem::no_such_vehicle(&cut(name, MAX_WHAT)))
        });
        let vehicle = vehicle.transpose()?;
        if parameters.values().any(|it| it.contains(is_control)) {
            let detail = "the path is invalid: names in it may not have control characters";
            return Err(Problem::new(StatusCode::BAD_REQUEST, detail));
        }
        let what = route.path.strip_prefix(ABOUT_VEHICLE).unwrap_or(route.path);
        let value = |part: &str| {
            let name = part.strip_prefix('{').and_then(|it| it.strip_suffix('}'));
            name.and_then(|it| parameters.get(it)).cloned().unwrap_or_else(|| part.to_owned())
        };
        let what = what.split('/').map(value).collect::<Vec<_>>().join("/");
        let what = cut(&what, MAX_WHAT);
        Ok(Target { vehicle, parameters, what })
    }
}
