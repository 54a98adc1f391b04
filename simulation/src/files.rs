//! The configuration files, read for the services that fly here.

use domain::contingency::Contingencies;
use domain::energy::EnergyModel;
use domain::file::{Mistake, Mistakes, Source};
use domain::mission::Mission;
use domain::time::Pace;
use mcm::Mcm;
use serde::Deserialize;

use crate::{Setup, read_mission, read_table};

pub(crate) struct Files {
    pub(crate) contingencies: Contingencies,
    pub(crate) mission: Mission,
    pub(crate) mcm: Mcm,
    pub(crate) vehicle_sim: vehicle_sim::config::Config,
    pub(crate) skill_manager: skill_manager::config::Config,
    pub(crate) monitor: monitor::config::Config,
    pub(crate) planner: planner::config::Config,
    pub(crate) energy: EnergyModel,
    pub(crate) control_tower: control_tower::config::Config,
    pub(crate) gateway: gateway::config::Config,
}

/// The services' sections; those of the processes and their launcher are not used here.
#[derive(Deserialize)]
struct Sections {
    mission: std::path::PathBuf,
    vehicle_sim: vehicle_sim::config::Config,
    skill_manager: skill_manager::config::Config,
    monitor: monitor::config::Config,
    planner: planner::config::Config,
    energy: EnergyModel,
    mcm: mcm::config::Config,
    control_tower: control_tower::config::Config,
    gateway: gateway::config::Config,
}

impl Files {
    pub(crate) fn read(setup: &Setup<'_>) -> Result<Files, Mistakes> {
        let sections: Sections = Source::read(&setup.config.join("kittiwake.toml"))?.parse()?;
        let mission = match setup.mission {
            Some(path) => read_mission(path)?,
            None => read_mission(&setup.config.join(&sections.mission))?,
        };
        let (trees, contingencies) = read_table(setup.config)?;
        let (table, pace) = (contingencies.clone(), Pace::REAL_TIME);
        let mcm = Mcm::new(&sections.mcm, &sections.energy, crate::VEHICLE, setup.seed, &trees, table, pace);
        let mcm = mcm.map_err(|error| {
            let (path, message) = (setup.config.join("trees"), error.to_string());
            Mistakes(vec![Mistake { path, place: None, message, help: String::new() }])
        })?;
        Ok(Files {
            contingencies,
            mission,
            mcm,
            vehicle_sim: sections.vehicle_sim,
            skill_manager: sections.skill_manager,
            monitor: sections.monitor,
            planner: sections.planner,
            energy: sections.energy,
            control_tower: sections.control_tower,
            gateway: sections.gateway,
        })
    }
}
