//! Speeds, heights and energy of a flight without a plan, as they are now.

use domain::energy::{EnergyModel, Wind};
use domain::headway::STRETCH;
use domain::speeds::Speeds;
use domain::way::FlightLimits;

use super::World;

impl World {
    /// This speed over ground, or less while a flag slows the vehicle, in metres per second.
    pub(super) fn slowed(&self, speed_m_s: f64) -> f64 {
        match self.narrowing().slow {
            Some(_) => speed_m_s.min(self.setup.limits.config.slow_speed_m_s.get()),
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
        self.setup.limits.aircraft.energy.taking(self.seen.consumption.factor())
    }

    /// The wind that ways are reckoned in.
    pub(super) fn wind(&self) -> Wind {
        let energy = &self.setup.limits.aircraft.energy;
        let measured = self.seen.vehicle.and_then(|it| it.wind);
        measured.map_or(energy.usual_wind(), |it| energy.wind_where_measured(it))
    }

    /// Speeds, heights and distances of a flight without a plan in the wind as it is.
    pub(super) fn limits_in_wind(&self) -> FlightLimits {
        let limits = self.flight_limits();
        // In a wind in which it holds no place the vehicle still needs a way down, and a time for it that ends; it flies nowhere else.
        match self.holds_in_wind() {
            true => FlightLimits { speeds: self.speeds_in_wind(), ..limits },
            false => limits,
        }
    }

    /// Whether it flies against the wind as it is.
    pub(super) fn holds_in_wind(&self) -> bool {
        self.speeds_in_wind().hold_in_wind()
    }

    fn speeds_in_wind(&self) -> Speeds {
        let (airspeed_m_s, wind) = (self.setup.limits.aircraft.flight.airspeed_m_s.get(), self.wind());
        Speeds { airspeed_m_s, wind, ..self.flight_limits().speeds }
    }

    /// Why it flies to no place, if the wind has blown it away for longer than a gust.
    pub(super) fn why_blown_away(&self) -> Option<String> {
        let since = self.watch.progress.blown_since?;
        let blown = self.now.time - since;
        let (wind_m_s, airspeed_m_s) = (self.wind().speed_m_s(), self.setup.limits.aircraft.flight.airspeed_m_s.get());
        (STRETCH <= blown).then(|| {
            let blown_s = blown.as_secs();
            format!("the wind has been {wind_m_s:.1} m/s for {blown_s} s, and it flies {airspeed_m_s:.1} m/s")
        })
    }
}
