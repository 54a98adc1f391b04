//! What a flight without a plan takes out of the battery.

use domain::energy::Shortfall;
use domain::geometry::Ned;

use super::World;

impl World {
    /// Why the vehicle must not be sent to land at `site`: it would get there with less than the reserve, or not at all. A site that
    /// takes no more than the way home is never too far; what an operator overrides may cost the reserve. Nothing is judged
    /// where the charge is not known.
    pub(super) fn too_far_to_land(&self, site: Ned, overrides: bool) -> Option<Shortfall> {
        let vehicle = self.vehicle?;
        let budget = self.limits.energy.budget(vehicle.charge?);
        let needs_wh = self.landing_flight_wh(vehicle.position, site, self.clear_height_m(vehicle.position));
        let home_wh = self.landing_flight_wh(vehicle.position, Ned::default(), self.limits.return_height_m);
        let (beyond_all, beyond_reserve) = (budget.without_reserve().shortfall(needs_wh), budget.shortfall(needs_wh));
        beyond_all.or(beyond_reserve.filter(|_| !overrides && home_wh < needs_wh))
    }

    /// What it takes to fly to `site` and land there in the usual wind, in Wh; straight, where there is no way yet.
    fn landing_flight_wh(&self, from: Ned, site: Ned, height_m: f64) -> f64 {
        let (energy, speeds) = (&self.limits.energy, &self.limits.flight.speeds);
        let mut way =
            self.way_to(site, height_m).unwrap_or_else(|| vec![from.at_height(height_m), site.at_height(height_m)]);
        way.push(site);
        energy.landing_flight_wh(from, &way, speeds, energy.usual_wind())
    }
}
