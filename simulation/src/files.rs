//! The configuration files, read for the services that fly here.

use std::path::{Path, PathBuf};

use domain::aircraft::{Aircraft, Flight};
use domain::contingency::Contingencies;
use domain::declared_skill::DeclaredSkills;
use domain::energy::EnergyModel;
use domain::file::{Mistake, Mistakes, Source};
use domain::mission::Mission;
use domain::quantity::Positive;
use domain::time::Pace;
use mcm::{LoadedTrees, Mcm};
use planner::Planner;
use serde::Deserialize;

use crate::Setup;

/// Names of files in a recording.
pub(crate) const CONFIG: &str = "kittiwake.toml";
pub(crate) const MISSION: &str = "mission.toml";
const TABLE: &str = "contingencies.toml";
const TREES: &str = "trees";
const SKILLS: &str = "skills";

pub(crate) struct Files {
    pub(crate) contingencies: Contingencies,
    pub(crate) skills: DeclaredSkills,
    pub(crate) mission: Mission,
    pub(crate) mcm: mcm::config::Config,
    trees: LoadedTrees,
    trees_path: PathBuf,
    pub(crate) vehicle_sim: vehicle_sim::config::Config,
    pub(crate) skill_manager: skill_manager::config::Config,
    pub(crate) monitor: monitor::config::Config,
    pub(crate) planner: planner::config::Config,
    pub(crate) aircraft: Aircraft,
    pub(crate) control_tower: control_tower::config::Config,
    /// Whether somebody reads the tree that the mission manager publishes.
    pub(crate) shows_tree: bool,
}

/// The services' sections; those of the processes and their launcher are not used here.
#[derive(Deserialize)]
struct Sections {
    mission: PathBuf,
    contingencies: PathBuf,
    trees: PathBuf,
    skills: PathBuf,
    vehicle_sim: vehicle_sim::config::Config,
    skill_manager: skill_manager::config::Config,
    monitor: monitor::config::Config,
    planner: planner::config::Config,
    flight: Flight,
    energy: EnergyModel,
    mcm: mcm::config::Config,
    control_tower: control_tower::config::Config,
}

impl Files {
    pub(crate) fn read(setup: &Setup<'_>) -> Result<Files, Mistakes> {
        let (folder, file) = places(setup.config);
        let sections: Sections = Source::read(&file)?.parse()?;
        let (trees, table) = (folder.join(&sections.trees), folder.join(&sections.contingencies));
        let skills = DeclaredSkills::read(&folder.join(&sections.skills))?;
        Files::read_beside(setup, sections, trees, table, skills)
    }

    /// Those of an unpacked recording, wherever its configuration had them.
    pub(crate) fn read_unpacked(setup: &Setup<'_>) -> Result<Files, Mistakes> {
        let (folder, file) = places(setup.config);
        let skills = folder.join(SKILLS);
        // A recording keeps no empty folder.
        let skills = if skills.is_dir() { DeclaredSkills::read(&skills)? } else { DeclaredSkills::default() };
        Files::read_beside(setup, Source::read(&file)?.parse()?, folder.join(TREES), folder.join(TABLE), skills)
    }

    /// What a recording needs of them, by their names in it; `mission` is the text that is flown, if that is not a
    /// file.
    pub(crate) fn texts(setup: &Setup<'_>, mission: Option<String>) -> Result<Vec<(String, String)>, Mistakes> {
        let (folder, file) = places(setup.config);
        let config = Source::read(&file)?;
        let sections: Sections = config.parse()?;
        let path = setup.mission.map_or_else(|| folder.join(&sections.mission), Path::to_owned);
        let mission = mission.map_or_else(|| Ok(Source::read(&path)?.text), Ok)?;
        let table = Source::read(&folder.join(&sections.contingencies))?.text;
        let mut texts =
            vec![(CONFIG.to_owned(), config.text), (MISSION.to_owned(), mission), (TABLE.to_owned(), table)];
        for name in crate::recording::trees() {
            let text = Source::read(&folder.join(&sections.trees).join(name))?.text;
            texts.push((format!("{TREES}/{name}"), text));
        }
        texts.extend(crate::recording::skills(&folder.join(&sections.skills))?);
        Ok(texts)
    }

    fn read_beside(
        setup: &Setup<'_>,
        mut sections: Sections,
        trees_path: PathBuf,
        table_path: PathBuf,
        skills: DeclaredSkills,
    ) -> Result<Files, Mistakes> {
        let (folder, file) = places(setup.config);
        let mission = match setup.mission {
            Some(path) => read_mission(path, &skills, &sections.control_tower)?,
            None => read_mission(&folder.join(&sections.mission), &skills, &sections.control_tower)?,
        };
        let of_mission = sections.vehicle_sim.origin.of_mission(mission.origin);
        sections.vehicle_sim.origin = of_mission.map_err(|message| {
            Mistakes(vec![Mistake { path: file.clone(), place: None, message, help: String::new() }])
        })?;
        let (trees, contingencies) = read_table(&trees_path, &table_path)?;
        Ok(Files {
            contingencies,
            skills,
            mission,
            mcm: sections.mcm,
            trees,
            trees_path,
            vehicle_sim: sections.vehicle_sim,
            skill_manager: sections.skill_manager,
            monitor: sections.monitor,
            planner: sections.planner,
            aircraft: Aircraft { flight: sections.flight, energy: sections.energy },
            control_tower: sections.control_tower,
            shows_tree: true,
        })
    }

    /// A mission manager that flies by them. `instance` makes its request ids unique among restarts.
    pub(crate) fn manager(&self, instance: u64) -> Result<Mcm, Mistakes> {
        self.manager_of(crate::VEHICLE, instance, Pace::REAL_TIME)
    }

    pub(crate) fn planner(&self, pace: Pace) -> Planner {
        Planner::new(&self.planner, &self.aircraft, pace).with_skills(self.skills.clone())
    }

    /// The same for another vehicle and another pace.
    pub(crate) fn manager_of(&self, vehicle: &str, instance: u64, pace: Pace) -> Result<Mcm, Mistakes> {
        let table = self.contingencies.clone();
        let mcm =
            Mcm::new(&self.mcm, &self.aircraft, vehicle, instance, &self.trees, table, pace).map_err(|error| {
                let message = error.to_string();
                Mistakes(vec![Mistake { path: self.trees_path.clone(), place: None, message, help: String::new() }])
            })?;
        Ok(if self.shows_tree { mcm } else { mcm.without_its_tree() })
    }

    /// Sends and looks as seldom as every limit of the services allows: what is decided stays the same, and costs a tenth.
    ///
    /// # Errors
    /// If one of the rates is not positive, which is a mistake in this function.
    pub(crate) fn made_coarse(mut self) -> Result<Files, String> {
        let rate = Positive::try_from;
        let rates = &mut self.vehicle_sim.rates;
        // Each limit on an age (config/kittiwake.toml) is at least five times the period.
        rates.vehicle_attitude = rate(10.0)?;
        rates.vehicle_local_position = rate(10.0)?;
        rates.vehicle_global_position = rate(2.0)?;
        rates.battery_status = rate(4.0)?;
        self.monitor.introspection_rate_hz = 10.0.try_into()?;
        self.skill_manager.setpoint_rate_hz = 5.0.try_into()?;
        self.skill_manager.feedback_rate_hz = rate(2.0)?;
        self.mcm.tick_period_ms = 100.0.try_into()?;
        self.shows_tree = false;
        Ok(self)
    }
}

/// The folder and the configuration file, of which either is named.
fn places(config: &Path) -> (PathBuf, PathBuf) {
    if config.is_dir() {
        return (config.to_owned(), config.join(CONFIG));
    }
    (config.parent().unwrap_or(Path::new("")).to_owned(), config.to_owned())
}

/// A tree folder and a table, read as the program reads them.
fn read_table(trees: &Path, table: &Path) -> Result<(mcm::LoadedTrees, Contingencies), Mistakes> {
    let trees = mcm::Trees::read(trees)?;
    let table = Contingencies::read(&Source::read(table)?, &trees.actions())?;
    Ok((trees.load(&table)?, table))
}

fn read_mission(
    path: &Path,
    skills: &DeclaredSkills,
    tower: &control_tower::config::Config,
) -> Result<Mission, Mistakes> {
    Mission::read_with(&Source::read(path)?, skills, Some(&tower.site_names()))
}
