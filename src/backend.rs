//! What flies: the vehicle backends that `kittiwake up` can start.
//!
//! A backend is one process that speaks the `fmu/` topics; everything above is the same for all of them.

use std::fmt;

use clap::ValueEnum;

use crate::service::Service;

/// What flies. A further one is a variant here, and the process that it is in [`Service`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// The simulated vehicle with its autopilot
    Sim,
    /// A PX4, over its own Zenoh module
    Px4,
    /// A PX4 or an ArduPilot, over MAVLink
    Mavlink,
}

impl Backend {
    /// Every backend.
    pub const ALL: [Backend; 3] = [Backend::Sim, Backend::Px4, Backend::Mavlink];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Backend::Sim => "sim",
            Backend::Px4 => "px4",
            Backend::Mavlink => "mavlink",
        }
    }

    /// The backend of this name.
    pub fn of_name(name: &str) -> Option<Backend> {
        Backend::ALL.into_iter().find(|it| it.name() == name)
    }

    /// The process that is this backend.
    pub fn service(self) -> Service {
        match self {
            Backend::Sim => Service::VehicleSim,
            Backend::Px4 => Service::Px4Bridge,
            Backend::Mavlink => Service::MavlinkBridge,
        }
    }

    /// The backend that a process is; `None` if it is not one.
    pub fn of_service(service: Service) -> Option<Backend> {
        Backend::ALL.into_iter().find(|it| it.service() == service)
    }

    /// Every process of a system that flies with it, the layers that others build on first.
    pub fn services(self) -> Vec<Service> {
        Service::ALL.into_iter().filter(|it| Backend::of_service(*it).is_none_or(|other| other == self)).collect()
    }

    /// Whether mission time may run faster or slower than the wall clock: what flies for real has its own time.
    pub fn takes_any_speed(self) -> bool {
        match self {
            Backend::Sim => true,
            Backend::Px4 | Backend::Mavlink => false,
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_has_one_backend_and_everything_that_is_none() {
        for backend in Backend::ALL {
            let services = backend.services();
            assert_eq!(services.len(), Service::ALL.len() - Backend::ALL.len() + 1);
            assert!(services.contains(&backend.service()));
            assert_eq!(Backend::of_service(backend.service()), Some(backend));
            assert_eq!(Backend::of_name(backend.name()), Some(backend));
        }
        assert_eq!(Backend::of_service(Service::Mcm), None);
        assert_eq!(Backend::of_name("uav1"), None);
    }
}
