//! `kittiwake status`: what the gateway of a running system says.

use std::time::Duration;

use crate::cli::StatusArgs;
use crate::outcome::Outcome;
use crate::output;
use crate::target::Target;

/// A gateway that takes longer does not answer.
const LIMIT: Duration = Duration::from_secs(5);

/// Prints the vehicle's live state as JSON.
pub fn status(args: &StatusArgs) -> Outcome {
    let answer = Target::find(&args.target).and_then(|target| {
        let url = format!("{}/api/v1/vehicles/{}", target.http.trim_end_matches('/'), target.vehicle);
        get(&url, &target.token).map_err(|cause| format!("unavailable: {cause}"))
    });
    match answer {
        Ok(body) => {
            output::line(body);
            Outcome::Success
        }
        Err(cause) => {
            output::error_line(cause);
            Outcome::Unavailable
        }
    }
}

fn get(url: &str, token: &str) -> Result<String, String> {
    let ask = || {
        let client = reqwest::blocking::Client::builder().timeout(LIMIT).build()?;
        let response = client.get(url).bearer_auth(token).send()?;
        Ok::<_, reqwest::Error>((response.status(), response.text()?))
    };
    let (status, body) = ask().map_err(|cause| format!("{url}: {}", root_cause(&cause)))?;
    if !status.is_success() {
        return Err(format!("{url} answered {status}: {body}"));
    }
    let json: serde_json::Value = serde_json::from_str(&body).map_err(|cause| format!("{url}: {cause}"))?;
    Ok(format!("{json:#}"))
}

/// What lies at the bottom of an error; the layers above only say that something failed.
fn root_cause(error: &dyn std::error::Error) -> String {
    std::iter::successors(Some(error), |it| it.source()).last().map(ToString::to_string).unwrap_or_default()
}
