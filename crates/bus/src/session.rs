//! Zenoh's settings, and opening a session with them.

#![expect(
    clippy::disallowed_methods,
    reason = "opening a session is tried again until its time on the wall clock is up"
)]

use std::time::{Duration, Instant};

use zenoh::{Config, Session, Wait};

use crate::{BusError, Link, Scope, sockets};

/// Settings of every session with their reasons. Whatever is not here is zenoh's default.
const SETTINGS: &[(&str, &str, &str)] = &[
    ("scouting/multicast/enabled", "false", "endpoints are explicit: two systems on one machine never meet"),
    ("scouting/gossip/enabled", "false", "opens took 500 ms now and then and first messages were lost"),
    ("timestamping/enabled", "false", "source times travel in the attachment"),
    ("transport/link/tx/lease", "2000", "a frozen process counts as lost after two seconds"),
    ("transport/link/tx/keep_alive", "4", "probed every 500 ms"),
    (
        "transport/link/rx/max_message_size",
        "9437184",
        "the planner's status may have 8 MiB, and no message of ours may be larger",
    ),
    ("queries_default_timeout", "10000", "a backstop: calls have deadlines of their own"),
];

/// The shared settings, for the given mode.
pub(crate) fn config(mode: &str) -> Result<Config, BusError> {
    let mut config = Config::default();
    set(&mut config, "mode", &format!("\"{mode}\""))?;
    for (key, value, _reason) in SETTINGS {
        set(&mut config, key, value)?;
    }
    Ok(config)
}

pub(crate) fn set(config: &mut Config, key: &'static str, value: &str) -> Result<(), BusError> {
    config.insert_json5(key, value).map_err(|cause| BusError::Setting { key, cause: cause.to_string() })
}

/// The same for a value.
pub(crate) fn set_value(config: &mut Config, key: &'static str, value: &serde_json::Value) -> Result<(), BusError> {
    set(config, key, &value.to_string())
}

/// Opens a client session at the link's router, trying again until its time is up.
pub(crate) fn open(link: &Link) -> Result<Session, BusError> {
    let mut config = config("client")?;
    let locators = link.connect.iter().map(|it| format!("\"{it}\"")).collect::<Vec<_>>().join(",");
    set(&mut config, "connect/endpoints", &format!("[{locators}]"))?;
    // One object: its parts are optional and cannot be set one by one. A router that comes back is
    // found within half a second.
    set(&mut config, "connect/retry", "{ period_init_ms: 100, period_max_ms: 500, period_increase_factor: 2 }")?;
    let start = Instant::now();
    loop {
        // Each time: a folder may be made meanwhile, by anybody.
        link.connect.iter().filter_map(|it| sockets::path_in(it)).try_for_each(sockets::check_to_connect)?;
        match open_with(config.clone(), &link.scope) {
            Ok(session) => return Ok(session),
            Err(cause) if link.open_timeout <= start.elapsed() => {
                let (locators, waited) = (link.connect.join(", "), link.open_timeout);
                let cause = link.connect.iter().find_map(|it| sockets::why_unreachable(it)).unwrap_or(cause);
                return Err(BusError::Unreachable { locators, waited, cause });
            }
            Err(_) => std::thread::sleep(Duration::from_millis(50)),
        }
    }
}

/// Opens a session in the scope's namespace.
pub(crate) fn open_with(mut config: Config, scope: &Scope) -> Result<Session, String> {
    if let Some(namespace) = scope.namespace() {
        set(&mut config, "namespace", &format!("\"{namespace}\"")).map_err(|it| it.to_string())?;
    }
    zenoh::open(config).wait().map_err(|it| it.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zenoh_knows_every_setting() {
        for (key, value, _) in SETTINGS {
            let config = config("client").unwrap();
            assert_eq!(config.get_json(key).unwrap(), *value, "{key}");
        }
    }
}
