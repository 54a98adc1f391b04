//! Reads and checks all files that a human wrote, before anything starts.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use domain::contingency::Contingencies;
use domain::file::{Mistakes, Source};
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::Ned;
use domain::mission::Mission;
use mcm::{LoadedTrees, Trees};
use rustls::ServerConfig;

use crate::config::Config;
use crate::outcome::Outcome;
use crate::output;
use crate::settings::Settings;

/// The vehicle may stand this far from the origin of its mission, in metres: less than the margin to any border.
const TAKEOFF_AREA_M: f64 = 5.0;

/// Everything that a process may need, checked.
pub struct Inputs {
    /// The configuration with the settings of this run in it.
    pub config: Config,
    /// The mission.
    pub mission: Mission,
    /// Where the mission takes off, if it says so.
    pub origin: Option<Origin>,
    /// The trees.
    pub trees: LoadedTrees,
    /// The contingency table.
    pub contingencies: Contingencies,
    /// The access folder; without one no token is valid.
    pub access: Option<PathBuf>,
    /// The folder of the persisted state; without one nothing is persisted.
    pub state: Option<PathBuf>,
    /// The file with the public key of the control tower; without one no signature is verified.
    pub tower_key: Option<PathBuf>,
    /// The file with the tower's own key; without one it has one in the folder of its state.
    pub tower_secret: Option<PathBuf>,
}

/// Reads all inputs; every mistake in any of them is reported at once.
pub fn read(settings: &Settings) -> Result<Inputs, Mistakes> {
    let config = read_config(settings)?;
    let mission = Source::read(&config.mission).and_then(|it| Mission::read_with_origin(&it));
    let behavior = read_behavior(&config);
    match (mission, behavior) {
        (Ok((mission, origin)), Ok((trees, contingencies))) => {
            let (access, state) = (settings.access.clone(), settings.state.clone());
            let (tower_key, tower_secret) = (settings.tower_key.clone(), settings.tower_secret.clone());
            Ok(Inputs { config, mission, origin, trees, contingencies, access, state, tower_key, tower_secret })
        }
        (mission, behavior) => {
            let mistakes = [mission.err(), behavior.err()].into_iter().flatten().flat_map(|it| it.0);
            Err(Mistakes(mistakes.collect()))
        }
    }
}

impl Inputs {
    /// What is no mistake and should be known before the flight, a line for each.
    pub fn notes(&self) -> Vec<String> {
        let near = self.mission.too_near_in_wind(self.config.planner.wind_m_s.get());
        let notes = near.into_iter().chain(self.elsewhere());
        notes.map(|it| format!("note: {}: {it}", self.config.mission.display())).collect()
    }

    /// That the mission takes off where the simulated vehicle does not stand: it is flown from there, and so shifted.
    fn elsewhere(&self) -> Option<String> {
        let stands = &self.config.vehicle_sim.origin;
        let stands = LatLon::new(stands.latitude_deg.get(), stands.longitude_deg.get()).ok()?;
        let away_m = LocalFrame::at(self.origin?.place).local(stands).horizontal_distance_m(Ned::default());
        (TAKEOFF_AREA_M < away_m).then(|| {
            format!(
                "its origin lies {away_m:.0} m from where the simulated vehicle stands, expected at most {TAKEOFF_AREA_M} m: \
                 it is flown shifted"
            )
        })
    }
}

/// The trees and the table, in this order: the trees say which actions there are.
fn read_behavior(config: &Config) -> Result<(LoadedTrees, Contingencies), Mistakes> {
    let table = Source::read(&config.contingencies);
    let trees = Trees::read(&config.trees)?;
    let contingencies = Contingencies::read(&table?, &trees.actions())?;
    Ok((trees.load(&contingencies)?, contingencies))
}

/// The certificate and key of the gateway's connections, if they are encrypted. Read only by the processes that need
/// them: the others may not be allowed to read the files.
#[expect(clippy::disallowed_methods, reason = "certificates expire by UTC")]
pub fn read_tls(config: &Config) -> Result<Option<Arc<ServerConfig>>, Outcome> {
    gateway::tls::server_config(&config.gateway, config.http, SystemTime::now()).map_err(|refusal| {
        output::error_line(refusal);
        Outcome::BadInput
    })
}

/// As [`read`]; reports the mistakes on standard error.
pub fn read_or_tell(settings: &Settings) -> Result<Inputs, Outcome> {
    read(settings).map_err(|mistakes| tell(&mistakes))
}

/// Reports the mistakes on standard error.
pub fn tell(mistakes: &Mistakes) -> Outcome {
    output::error_line(mistakes);
    Outcome::BadInput
}

/// The configuration file with the settings of this run in it.
fn read_config(settings: &Settings) -> Result<Config, Mistakes> {
    let mut config: Config = Source::read(&settings.config)?.parse()?;
    let folder = settings.config.parent().unwrap_or(Path::new(""));
    let beside = |path: &PathBuf| folder.join(path);
    // A path on the command line is relative to the present folder, as everywhere.
    config.mission = settings.mission.clone().unwrap_or_else(|| beside(&config.mission));
    config.contingencies = beside(&config.contingencies);
    config.trees = beside(&config.trees);
    config.speed = settings.speed.unwrap_or(config.speed);
    config.permissions = settings.permissions.unwrap_or(config.permissions);
    config.seed = settings.seed.unwrap_or(config.seed);
    let recordings = config.gateway.recording.folder.as_ref().map(beside);
    config.gateway.recording.folder = settings.recordings.clone().or(recordings);
    config.http = settings.http.unwrap_or(config.http);
    let gateway = &mut config.gateway;
    gateway.tls_certificate = settings.tls_certificate.clone().or_else(|| gateway.tls_certificate.as_ref().map(beside));
    gateway.tls_key = settings.tls_key.clone().or_else(|| gateway.tls_key.as_ref().map(beside));
    gateway.plain_http_beyond_loopback |= settings.plain_http_beyond_loopback;
    if let Some(vehicle) = &settings.vehicle {
        config.vehicle = vehicle.clone();
    }
    Ok(config)
}
