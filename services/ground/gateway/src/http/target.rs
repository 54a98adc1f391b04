//! What a request is about, read once from the matched parameters of its path: the guard, the audit record and the
//! handler see the same vehicle, however its name is escaped.

use std::collections::BTreeMap;

use axum::extract::{FromRequestParts, Path};
use axum::http::StatusCode;
use axum::http::request::Parts;
use node::VehicleId;

use crate::fleet::Snapshot;
use crate::http::problem::Problem;
use crate::http::routes::Route;

/// The parameter that names the vehicle.
const VEHICLE: &str = "id";
/// The beginning of every path about a vehicle.
const ABOUT_VEHICLE: &str = "/api/v1/vehicles/{id}/";

/// What a request is about.
#[derive(Debug)]
pub(crate) struct Target {
    /// The parameters of the path by name, decoded.
    pub(crate) parameters: BTreeMap<String, String>,
    /// The path below the vehicle, or the whole path of a request that is about none.
    pub(crate) what: String,
    /// Why the path cannot be read.
    rejection: Option<(StatusCode, String)>,
}

impl Target {
    /// Reads the target of a request that `route` matches.
    pub(crate) async fn read(route: &Route, parts: &mut Parts) -> Target {
        match Path::<BTreeMap<String, String>>::from_request_parts(parts, &()).await {
            Ok(Path(parameters)) => {
                let what = route.path.strip_prefix(ABOUT_VEHICLE).unwrap_or(route.path).to_owned();
                let fill =
                    |what: String, (name, value): (&String, &String)| what.replace(&format!("{{{name}}}"), value);
                let what = parameters.iter().fold(what, fill);
                Target { parameters, what, rejection: None }
            }
            Err(rejection) => {
                let rejection = Some((rejection.status(), rejection.body_text()));
                Target { parameters: BTreeMap::new(), what: parts.uri.path().to_owned(), rejection }
            }
        }
    }

    /// The vehicle's name as the client gave it; empty for a request that is about none.
    pub(crate) fn vehicle_name(&self) -> &str {
        self.parameters.get(VEHICLE).map_or("", String::as_str)
    }

    /// The vehicle; `None` for a request that is about none.
    pub(crate) fn vehicle(&self, snapshot: &Snapshot) -> Result<Option<VehicleId>, Problem> {
        if let Some((status, why)) = &self.rejection {
            return Err(Problem::new(*status, why.clone()));
        }
        let Some(name) = self.parameters.get(VEHICLE) else { return Ok(None) };
        let known = snapshot.fleet.vehicles.get_key_value(name.as_str());
        known.map(|(id, _)| Some(id.clone())).ok_or_else(|| Problem::no_such_vehicle(name))
    }
}
