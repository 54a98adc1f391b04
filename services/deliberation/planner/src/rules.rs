//! All that a plan goes by beside the mission and the state.

use std::sync::Arc;

use domain::aircraft::Aircraft;
use domain::declared_skill::DeclaredSkills;
use domain::energy::Wind;
use domain::speeds::Speeds;
use domain::state::Tolerance;
use domain::way::FlightLimits;

use crate::config::Config;

/// The planner's own parameters, the aircraft, and the wind.
#[derive(Debug, Clone)]
pub(crate) struct Rules {
    pub(crate) config: Config,
    pub(crate) aircraft: Aircraft,
    /// What tasks take.
    pub(crate) skills: Arc<DeclaredSkills>,
    /// The wind that legs are timed in and energy is judged in.
    pub(crate) wind: Wind,
}

impl Rules {
    /// In the usual wind.
    pub(crate) fn new(config: Config, aircraft: Aircraft) -> Rules {
        Rules { config, aircraft, skills: Arc::default(), wind: aircraft.energy.usual_wind() }
    }

    /// The same in another wind.
    pub(crate) fn in_wind(&self, wind: Wind) -> Rules {
        Rules { wind, ..self.clone() }
    }

    /// How far apart two states may be and still count as one.
    pub(crate) fn tolerance(&self) -> Tolerance {
        Tolerance {
            horizontal_m: self.config.horizontal_tolerance_m.get(),
            vertical_m: self.config.vertical_tolerance_m.get(),
            ground_m: self.config.ground_tolerance_m.get(),
        }
    }

    /// How fast plans are flown.
    pub(crate) fn speeds(&self) -> Speeds {
        self.aircraft.flight.speeds(self.wind)
    }

    /// How the vehicle flies.
    pub(crate) fn flight_limits(&self) -> FlightLimits {
        self.aircraft.flight.limits(self.speeds())
    }
}

#[cfg(test)]
impl Rules {
    /// The shipped ones.
    pub(crate) fn for_tests() -> Rules {
        Rules::of(Config::for_tests())
    }

    /// The same with these parameters.
    pub(crate) fn of(config: Config) -> Rules {
        let aircraft = [domain::testing::FLIGHT, domain::testing::ENERGY].concat();
        Rules::new(config, toml::from_str(&aircraft).expect("the shipped values parse"))
    }
}
