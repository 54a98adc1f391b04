//! Which nodes of a vehicle run in one process, and what speaks against it.

use std::fmt;
use std::str::FromStr;

use bus::Scope;

use crate::backend::Backend;
use crate::service::Service;

/// The name of the process: its subcommand, and the prefix of its log.
pub const ONBOARD: &str = "onboard";

/// Some nodes on board of one vehicle, each once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Composition([bool; Service::ALL.len()]);

impl Composition {
    /// The nodes, those that others build on first.
    pub fn services(self) -> Vec<Service> {
        Service::ALL.into_iter().zip(self.0).filter(|(_, is_hosted)| *is_hosted).map(|(service, _)| service).collect()
    }

    /// Whether it has this node.
    pub fn hosts(self, service: Service) -> bool {
        self.services().contains(&service)
    }

    /// Why it cannot be a part of a system that flies with `backend`.
    ///
    /// # Errors
    /// If it has another backend.
    pub fn suits(self, backend: Backend) -> Result<(), String> {
        match self.services().into_iter().find(|it| Backend::of_service(*it).is_some_and(|other| other != backend)) {
            Some(other) => {
                Err(format!("found {other} among the nodes, but {} flies here: leave it out", backend.service()))
            }
            None => Ok(()),
        }
    }
}

impl FromStr for Composition {
    type Err = String;

    fn from_str(text: &str) -> Result<Composition, String> {
        let mut hosted = [false; Service::ALL.len()];
        for name in text.split(',').map(str::trim) {
            let place = Service::ALL.iter().position(|it| it.name() == name);
            let place = place.ok_or_else(|| format!("found node `{name}`, expected some of {}", names().join(", ")))?;
            if Service::ALL[place].scope("") == Scope::Fleet {
                return Err(format!("{name} is on the ground and has a process of its own: leave it out"));
            }
            if std::mem::replace(&mut hosted[place], true) {
                return Err(format!("{name} is named twice: a vehicle has one"));
            }
        }
        let composition = Composition(hosted);
        let backends: Vec<_> = Backend::ALL.iter().map(|it| it.service()).filter(|it| composition.hosts(*it)).collect();
        match backends[..] {
            [one, other, ..] => Err(format!("{one} and {other} would both fly the vehicle: name one of them")),
            _ => Ok(composition),
        }
    }
}

fn names() -> Vec<&'static str> {
    Service::ALL.into_iter().filter(|it| it.scope("") != Scope::Fleet).map(Service::name).collect()
}

/// As it is named on the command line.
impl fmt::Display for Composition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.services().into_iter().map(Service::name).collect();
        f.write_str(&names.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_nodes_on_board_can_be_hosted() {
        #[track_caller]
        fn check(text: &str, expected: &[Service]) {
            let composition: Composition = text.parse().unwrap();
            assert_eq!(composition.services(), expected);
            assert_eq!(composition.to_string().parse(), Ok(composition));
        }
        check("mcm", &[Service::Mcm]);
        check("mcm, planner", &[Service::Planner, Service::Mcm]);
        let usual = [Service::SkillManager, Service::Monitor, Service::Planner, Service::Mcm];
        check("mcm,skill-manager,monitor,planner", &usual);
        check("vehicle-sim,mcm", &[Service::VehicleSim, Service::Mcm]);
        check("mavlink-bridge,skill-manager", &[Service::MavlinkBridge, Service::SkillManager]);
    }

    #[test]
    fn what_cannot_be_hosted_is_refused_in_one_sentence() {
        #[track_caller]
        fn check(text: &str, words: &str) {
            let refusal = text.parse::<Composition>().unwrap_err();
            assert!(refusal.contains(words) && refusal.lines().count() == 1, "{refusal}");
        }
        check("mcm,monitor,mcm", "mcm is named twice");
        check("mcm,pilot", "found node `pilot`, expected some of vehicle-sim, px4-bridge");
        check("", "found node ``");
        check("mcm,uav2/planner", "found node `uav2/planner`");
        check("mcm,router", "found node `router`");
        check("mcm,gateway", "gateway is on the ground");
        check("control-tower", "control-tower is on the ground");
        check("vehicle-sim,mcm,px4-bridge", "vehicle-sim and px4-bridge would both fly the vehicle");
    }

    #[test]
    fn a_backend_is_hosted_only_where_it_flies() {
        let composition: Composition = "mcm,px4-bridge".parse().unwrap();
        assert_eq!(composition.suits(Backend::Px4), Ok(()));
        let refusal = "found px4-bridge among the nodes, but vehicle-sim flies here: leave it out";
        assert_eq!(composition.suits(Backend::Sim), Err(refusal.to_owned()));
    }
}
