//! Reads and checks all files that a human wrote, before anything starts.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use domain::contingency::Contingencies;
use domain::declared_skill::DeclaredSkills;
use domain::file::{Mistake, Mistakes, Source};
use domain::mission::Mission;
use domain::time::Pace;
use gateway::access::{InvalidTokens, Tokens};
use gateway::tls::{Demand, Encryption};
use mcm::{LoadedTrees, Trees};

use crate::backend::Backend;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::output;
use crate::settings::Settings;
use crate::setup::access::TOKENS;
use crate::signing_key;

/// Everything that a process may need, checked.
pub struct Inputs {
    /// Where the configuration comes from.
    pub config_file: PathBuf,
    /// The configuration with the settings of this run in it, and the simulated vehicle where the mission has it stand.
    pub config: Config,
    /// The mission.
    pub mission: Mission,
    /// The trees.
    pub trees: LoadedTrees,
    /// The contingency table.
    pub contingencies: Contingencies,
    /// The declared skills.
    pub skills: DeclaredSkills,
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
    let mut config = read_config(settings)?;
    let skills = DeclaredSkills::read(&config.skills);
    let mission = Source::read(&config.mission).and_then(|it| match &skills {
        Ok(skills) => Mission::read_with(&it, skills, Some(&config.control_tower.site_names())),
        Err(_) => Mission::read(&it),
    });
    let behavior = read_behavior(&config);
    match (mission, behavior, skills) {
        (Ok(mission), Ok((trees, contingencies)), Ok(skills)) => {
            let stands = config.vehicle_sim.origin.of_mission(mission.origin);
            config.vehicle_sim.origin = stands.map_err(|why| mistake(&config.mission, why, ""))?;
            let (access, state) = (settings.access.clone(), settings.state.clone());
            let (tower_key, tower_secret) = (settings.tower_key.clone(), settings.tower_secret.clone());
            let config_file = settings.config.clone();
            Ok(Inputs {
                config_file,
                config,
                mission,
                trees,
                contingencies,
                skills,
                access,
                state,
                tower_key,
                tower_secret,
            })
        }
        (mission, behavior, skills) => {
            let mistakes = [mission.err(), behavior.err(), skills.err()].into_iter().flatten().flat_map(|it| it.0);
            Err(Mistakes(mistakes.collect()))
        }
    }
}

impl Inputs {
    /// What is not a mistake and should be known before the flight, a line for each.
    pub fn notes(&self) -> Vec<String> {
        let near = self.mission.too_near_in_wind(self.config.planner.wind_m_s.get());
        let out_of_date = self.mission.out_of_date_feeds(crate::plan::now().utc_ms);
        out_of_date.into_iter().chain(near).map(|it| format!("note: {}: {it}", self.config.mission.display())).collect()
    }

    /// The files that say what is flown, name and text: configuration, mission, table and trees.
    pub fn texts(&self) -> Vec<(String, String)> {
        let trees = std::fs::read_dir(&self.config.trees).into_iter().flatten().flatten().map(|it| it.path());
        let files = [&self.config_file, &self.config.mission, &self.config.contingencies].into_iter().cloned();
        let named = |path: PathBuf| Some((path.file_name()?.to_str()?.to_owned(), Source::read(&path).ok()?.text));
        files.chain(trees.filter(|it| it.extension().is_some_and(|it| it == "xml"))).filter_map(named).collect()
    }

    /// What forbids to start a vehicle backend, if anything does.
    ///
    /// # Errors
    /// What is wrong, and what to do.
    pub fn suits(&self, backend: Backend) -> Result<(), Mistakes> {
        if backend == Backend::Sim {
            return self.stands_at_origin();
        }
        if let (Backend::Mavlink, Some(path)) = (backend, &self.config.mavlink_bridge.signing_key) {
            signing_key::read(path)?;
        }
        if backend.takes_any_speed() || self.config.speed.pace() == Pace::REAL_TIME {
            return Ok(());
        }
        let message = format!("found speed {}, expected 1: `{backend}` is not our simulation", self.config.speed);
        Err(mistake(&self.config_file, message, "leave `--speed` out, and set `speed = 1.0` in the configuration"))
    }

    /// For those who start the simulated vehicle: that it stands where the mission takes off. Elsewhere the planner would refuse the
    /// mission.
    ///
    /// # Errors
    /// How far away it stands, where the configuration wants that.
    fn stands_at_origin(&self) -> Result<(), Mistakes> {
        let Some(origin) = self.mission.origin else { return Ok(()) };
        let away_m = origin.place.distance_m(self.config.vehicle_sim.origin.in_wgs84().place);
        let most_m = self.config.planner.origin_tolerance_m.get();
        if away_m <= most_m {
            return Ok(());
        }
        let message = format!(
            "its origin lies {away_m:.0} m from where the simulated vehicle stands, expected at most {most_m} m: it would not be flown"
        );
        let help = "set `at_mission_origin = true` in [vehicle_sim.origin], or move the one to the other";
        Err(mistake(&self.config.mission, message, help))
    }
}

fn mistake(path: &Path, message: String, help: &str) -> Mistakes {
    Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: help.into() }])
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
pub fn read_tls(config: &Config, demand: Demand) -> Result<Option<Encryption>, Outcome> {
    gateway::tls::encryption(&config.gateway, config.http, demand, SystemTime::now()).map_err(|refusal| {
        output::error_line(refusal);
        Outcome::BadInput
    })
}

/// Whether the gateway would find the tokens in the access folder, if one is named. Read only by the gateway and by those who
/// start it: nobody else may read the file.
pub fn check_access(access: Option<&Path>) -> Result<(), Mistakes> {
    let Some(folder) = access else { return Ok(()) };
    match Tokens::read(&folder.join(TOKENS)) {
        Ok(_) => Ok(()),
        Err(InvalidTokens::Mistakes(mistakes)) => Err(mistakes),
        Err(InvalidTokens::Unreadable(path, cause)) => {
            let message = format!("{cause}; expected the tokens of those who may use the gateway");
            Err(mistake(
                &path,
                message,
                &format!(
                    "make the folder if there is none, and a token in it: `kittiwake access {} --secret FILE`",
                    folder.display()
                ),
            ))
        }
        Err(InvalidTokens::Exposed(path, mode)) => {
            let message = format!("its mode is {mode:04o}; only its owner may have access");
            Err(mistake(&path, message, &format!("`chmod 600 {}`", path.display())))
        }
    }
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
    config.skills = beside(&config.skills);
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
    if let Some(endpoint) = &settings.connect_autopilot {
        config.mavlink_bridge.connect = endpoint.clone();
    }
    let mavlink = &mut config.mavlink_bridge;
    mavlink.signing_key = settings.signing_key.clone().or_else(|| mavlink.signing_key.as_ref().map(beside));
    config.mavlink_bridge.ground = settings.ground.or(config.mavlink_bridge.ground);
    if let Some(endpoint) = &settings.px4_endpoint {
        config.px4_bridge.endpoint = endpoint.clone();
    }
    if let Some(vehicle) = &settings.vehicle {
        config.vehicle = vehicle.clone();
    }
    Ok(config)
}

#[cfg(test)]
mod tests;
