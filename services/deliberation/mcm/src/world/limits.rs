//! Speeds, heights and energy of a flight without a plan, as they are now.

use domain::energy::{EnergyModel, Wind};
use domain::speeds::Speeds;
use domain::way::FlightLimits;

use super::World;

impl World {
    /// This speed over ground, or less while a flag slows the vehicle, in metres per second.
    pub(super) fn slowed(&self, speed_m_s: f64) -> f64 {
        match self.narrowing().slow {
            Some(_) => speed_m_s.min(self.setup.limits.slow_speed_m_s),
            None => speed_m_s,
        }
    }

    /// Speeds, heights and distances of a flight without a plan, as they are narrowed now.
    pub(crate) fn flight_limits(&self) -> FlightLimits {
        let flight = self.setup.limits.flight;
        let cruise_m_s = self.slowed(flight.speeds.cruise_m_s);
        FlightLimits { speeds: Speeds { cruise_m_s, ..flight.speeds }, ..flight }
    }

    /// The vehicle's figures, corrected by what the flight was measured to take.
    pub(super) fn energy(&self) -> EnergyModel {
        self.setup.limits.energy.taking(self.seen.consumption.factor())
    }

    /// The wind that ways are reckoned in.
    pub(super) fn wind(&self) -> Wind {
        let energy = &self.setup.limits.energy;
        let measured = self.seen.vehicle.and_then(|it| it.wind);
        measured.map_or(energy.usual_wind(), |it| energy.wind_where_measured(it))
    }

    /// Speeds, heights and distances of a flight without a plan in the wind as it is.
    pub(super) fn limits_in_wind(&self) -> FlightLimits {
        let limits = self.flight_limits();
        let in_wind = Speeds { airspeed_m_s: self.setup.limits.airspeed_m_s, wind: self.wind(), ..limits.speeds };
        // In a wind in which it holds no place the vehicle still needs a way down, and a time for it that ends.
        match in_wind.hold_in_wind() {
            true => FlightLimits { speeds: in_wind, ..limits },
            false => limits,
        }
    }
}
