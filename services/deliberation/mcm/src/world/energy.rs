//! What the flight takes out of the battery, how far it suffices, and what a flight without a plan takes.

use domain::alternates::{Alternate, Role};
use domain::energy::{Shortfall, Wind};
use domain::geometry::Ned;
use domain::site::SiteKind;
use kittiwake_proto::v1;

use super::World;

const HOUR_S: f64 = 3600.0;

impl World {
    /// Compares what the battery gives with what the figures say, for as long as the vehicle flies.
    pub(super) fn measure_consumption(&mut self) {
        let Some(vehicle) = self.seen.vehicle.filter(|it| it.flying) else {
            self.seen.consumption = Default::default();
            return;
        };
        let Some(power_w) = vehicle.power_w else { return };
        let wind = vehicle.wind.map_or(Wind::CALM, |(north_m_s, east_m_s)| Wind::Towards { north_m_s, east_m_s });
        let over_ground = (vehicle.velocity.north_m_s, vehicle.velocity.east_m_s);
        let expected_w =
            self.setup.limits.aircraft.energy.flight_w(over_ground, vehicle.velocity.climb_rate_m_s(), wind);
        self.seen.consumption.measure(vehicle.heard.at, power_w, expected_w);
    }

    /// How far the battery suffices; `None` on the ground, and while the charge is not known.
    pub(super) fn told_energy(&self) -> Option<v1::EnergyOutlook> {
        let vehicle = self.seen.vehicle.filter(|it| it.flying)?;
        let energy = self.energy();
        let budget = energy.budget(vehicle.charge?);
        let left_wh = budget.charge_wh - budget.capacity_wh * budget.reserve.get();
        let told = |it: &Alternate| {
            // None can be reached in a wind that blows it away.
            let (way, _) = it.way.as_ref().filter(|_| self.holds_in_wind())?;
            let margin_wh = left_wh - way.energy_wh;
            Some(v1::PlaceOutlook {
                place: it.candidate.to_string(),
                time_s: way.time_s,
                energy_wh: way.energy_wh,
                margin_wh,
                margin: margin_wh / budget.capacity_wh,
            })
        };
        let seen = self.seen_alternates();
        let home = seen.iter().find(|it| it.candidate.role == Role::Home).and_then(told);
        // As the permissions are; with others only where nothing else can be landed at.
        let landings = || seen.iter().filter(|it| it.candidate.kind == SiteKind::Landing && it.failed_landings == 0);
        let nearest = |asks: bool| {
            let places = landings().filter(|it| it.asks() == asks).filter_map(told);
            places.max_by(|a, b| a.margin_wh.total_cmp(&b.margin_wh))
        };
        let hover_w = energy.hover_wh(HOUR_S, self.wind());
        let wind = match self.wind() {
            Wind::Towards { north_m_s, east_m_s } => Some(v1::WindEstimate { north_m_s, east_m_s }),
            Wind::Against(_) => None,
        };
        let airspeed_m_s = self.setup.limits.aircraft.flight.airspeed_m_s.get();
        Some(v1::EnergyOutlook {
            charge_wh: budget.charge_wh,
            usable_wh: budget.usable_wh,
            consumption: self.seen.consumption.ratio(),
            wind,
            airspeed_left_m_s: wind.map(|_| airspeed_m_s - self.wind().speed_m_s()),
            endurance_s: budget.usable_wh / hover_w * HOUR_S,
            turn_home_s: home.as_ref().map(|it| it.margin_wh.max(0.0) / self.leaving_home_w() * HOUR_S),
            best: nearest(false).or_else(|| nearest(true)),
            home,
        })
    }

    /// What flying on as the vehicle does takes of what is left after a flight home: what it takes itself, and what the way back takes
    /// more for each second that leads away from home, in W.
    fn leaving_home_w(&self) -> f64 {
        let (energy, wind, speeds) = (self.energy(), self.wind(), self.limits_in_wind().speeds);
        let Some(vehicle) = self.seen.vehicle else { return energy.hover_wh(HOUR_S, wind) };
        let (here, velocity) = (vehicle.position, vehicle.velocity);
        let home_m = here.horizontal_distance_m(Ned::default());
        let away_m_s = match 1.0 < home_m {
            true => ((velocity.north_m_s * here.north_m + velocity.east_m_s * here.east_m) / home_m).max(0.0),
            false => velocity.ground_speed_m_s(),
        };
        let back = (-here.north_m / home_m.max(1.0), -here.east_m / home_m.max(1.0));
        let back_m_s = speeds.cruise_m_s;
        let back_w = energy.flight_w((back.0 * back_m_s, back.1 * back_m_s), 0.0, wind);
        let on_w = energy.flight_w((velocity.north_m_s, velocity.east_m_s), velocity.climb_rate_m_s(), wind);
        on_w.max(1.0) + back_w * away_m_s / back_m_s
    }

    /// Why the vehicle must not be sent to land at `site`: it would get there with less than the reserve, or not at all. A site that
    /// takes no more than the way home is never too far; what an operator overrides may cost the reserve. Nothing is judged
    /// where the charge is not known.
    pub(super) fn too_far_to_land(&self, site: Ned, overrides: bool) -> Option<Shortfall> {
        let vehicle = self.seen.vehicle?;
        let budget = self.energy().budget(vehicle.charge?);
        let needs_wh = self.landing_flight_wh(vehicle.position, site);
        let home_wh = self.landing_flight_wh(vehicle.position, Ned::default());
        let (beyond_all, beyond_reserve) = (budget.without_reserve().shortfall(needs_wh), budget.shortfall(needs_wh));
        beyond_all.or(beyond_reserve.filter(|_| !overrides && home_wh < needs_wh))
    }

    /// What it takes to fly to `site` and land there in the wind as it is, in Wh; straight, where there is no way yet.
    pub(super) fn landing_flight_wh(&self, from: Ned, site: Ned) -> f64 {
        let limits = self.limits_in_wind();
        let approach_m = self.planner.mission.ground.approach_m(from, site, &limits);
        let straight = || vec![from.at_height(approach_m), site.at_height(approach_m)];
        let mut way = self.way_to(site).unwrap_or_else(straight);
        way.push(site);
        self.energy().landing_flight_wh(from, &way, &limits.speeds, self.wind())
    }
}
