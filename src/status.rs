//! `kittiwake status`: what the gateway of a running system says.

#![expect(clippy::disallowed_methods, reason = "somebody waits for the answer, and nothing tells when to ask again")]

use std::time::{Duration, Instant};

use reqwest::StatusCode;
use reqwest::blocking::Client;
use serde_json::Value;

use crate::cli::StatusArgs;
use crate::http_client::{client, parse, root_cause};
use crate::operate::show;
use crate::outcome::Outcome;
use crate::output;
use crate::target::{Environment, Target};

/// Time without an answer after which the gateway counts as unavailable.
const LIMIT: Duration = Duration::from_secs(5);
/// Between two tries.
const PAUSE: Duration = Duration::from_millis(100);

/// Prints the vehicle's live state on a screen, or everything as JSON.
pub fn status(args: &StatusArgs) -> Outcome {
    let answer = Target::find(&args.target).and_then(|target| {
        let url = format!("{}/api/v1/vehicles/{}", target.http.trim_end_matches('/'), target.vehicle);
        let parsed = parse(&url)?;
        let token = Environment::read().token_for(&target.http, target.token)?;
        let client = client(&parsed, &token, target.ca.as_deref(), Some(LIMIT))?;
        answer(&client, &url, &target.vehicle).map_err(|cause| format!("unavailable: {url} {cause}"))
    });
    match answer {
        Ok(state) => {
            output::line(if args.all { format!("{state:#}") } else { show::vehicle(&state) });
            Outcome::Success
        }
        Err(cause) => {
            output::error_line(cause);
            Outcome::Unavailable
        }
    }
}

/// The answer to a request that is repeated while a gateway that has just started may not know the
/// vehicle yet, or is being started again.
fn answer(client: &Client, url: &str, vehicle: &str) -> Result<Value, String> {
    let until = Instant::now() + LIMIT;
    loop {
        let failure = match ask(client, url) {
            Ok((StatusCode::OK, body)) => match state(&body, vehicle) {
                Some(state) => return Ok(state),
                // A proxy's page, perhaps, while the gateway is being started again.
                None => "does not answer as a Kittiwake gateway".to_owned(),
            },
            Ok((status, body)) => format!("answered {status}: {body}"),
            Err(cause) => format!("does not answer: {}", root_cause(&cause)),
        };
        if until <= Instant::now() {
            return Err(failure);
        }
        std::thread::sleep(PAUSE);
    }
}

fn ask(client: &Client, url: &str) -> reqwest::Result<(StatusCode, String)> {
    let response = client.get(url).send()?;
    Ok((response.status(), response.text()?))
}

/// The state of this vehicle; `None` for anything else.
fn state(body: &str, vehicle: &str) -> Option<Value> {
    serde_json::from_str(body).ok().filter(|it: &Value| it["vehicle"] == vehicle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_that_of_the_vehicle_is_a_state() {
        assert_eq!(state(r#"{"vehicle":"uav1"}"#, "uav1"), Some(serde_json::json!({ "vehicle": "uav1" })));
        for other in ["<html></html>", "null", "[[[[", "7", "", r#"{"vehicle":"uav2"}"#, r#"{"status":"ok"}"#] {
            assert_eq!(state(other, "uav1"), None, "{other}");
        }
    }
}
