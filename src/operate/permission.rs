//! `kittiwake permission`.

use serde_json::{Value, json};

use crate::operate::Done;
use crate::operate::args::PermissionCommand;
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::words::{each, heading, on_one_line, table, text, word};

/// Reads or decides.
pub fn run(what: &PermissionCommand, gateway: &Gateway) -> Result<Done, Failure> {
    match what {
        PermissionCommand::List => list(gateway, |_| true),
        PermissionCommand::Pending => list(gateway, |it| it["state"] == "PERMISSION_STATE_REQUESTED"),
        PermissionCommand::Grant { area, valid_for_s, reason } => {
            let mut body = json!({ "decision": "DECISION_GRANT", "reason": reason });
            if let Some(seconds) = valid_for_s {
                body["validForS"] = json!(seconds);
            }
            decide(gateway, area, body)
        }
        PermissionCommand::Deny { area, reason } => {
            decide(gateway, area, json!({ "decision": "DECISION_DENY", "reason": reason }))
        }
        PermissionCommand::AcceptLoss => gateway.decide(&["accept-loss"], None).map(Done::of),
        PermissionCommand::Revoke { area, reason } => {
            decide(gateway, area, json!({ "decision": "DECISION_REVOKE", "reason": reason }))
        }
    }
}

fn list(gateway: &Gateway, wanted: fn(&Value) -> bool) -> Result<Done, Failure> {
    let vehicle = gateway.read(&[])?;
    let found: Vec<Value> = each(&vehicle["permissions"]).filter(|it| wanted(it)).cloned().collect();
    let (tower, permissions) = (&vehicle["tower"], &found);
    let document =
        json!({ "vehicle": vehicle["vehicle"], "utc": vehicle["utc"], "permissions": permissions, "tower": tower });
    let stale = tower["stale"].as_str().unwrap_or_default();
    let mut text = if found.is_empty() {
        "none".to_owned()
    } else {
        lines(&on_one_line(&document["permissions"]), !stale.is_empty())
    };
    if !stale.is_empty() {
        text += &format!("\nstale: {stale}");
    }
    Ok(Done { document, text })
}

/// `stale`: nobody knows whether the tower still says so.
fn lines(permissions: &Value, stale: bool) -> String {
    let mut lines = heading(["AREA", "STATE", "VALID FOR", "REASON"]);
    for it in each(permissions) {
        let seconds = it["validForS"].as_f64().filter(|_| it["state"] == "PERMISSION_STATE_GRANTED");
        lines.push(vec![
            text(&it["area"]).to_owned(),
            word(&it["state"], "PERMISSION_STATE_") + if stale { " (stale)" } else { "" },
            seconds.map_or_else(|| "-".to_owned(), |it| format!("{it:.0} s")),
            match text(&it["enteredBecause"]) {
                "-" => text(&it["reason"]).to_owned(),
                why => format!("entered without permission: {why}"),
            },
        ]);
    }
    table(lines)
}

fn decide(gateway: &Gateway, area: &str, body: Value) -> Result<Done, Failure> {
    gateway.decide(&[area, "decision"], Some(body)).map(Done::of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_granted_permission_has_a_validity() {
        let found = lines(
            &json!([
                { "area": "A", "state": "PERMISSION_STATE_GRANTED", "validForS": 899.6, "reason": "" },
                { "area": "B", "state": "PERMISSION_STATE_DENIED", "validForS": 0.0, "reason": "fog" },
                { "area": "C", "state": "PERMISSION_STATE_REQUESTED", "validForS": 0.0, "enteredBecause": "people below" },
            ]),
            false,
        );
        assert_eq!(
            found,
            "AREA  STATE      VALID FOR  REASON\nA     granted    900 s      -\nB     denied     -          fog\n\
             C     requested  -          entered without permission: people below"
        );
    }
}
