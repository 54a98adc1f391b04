//! The latest moment of each wait of a response, by the one rule of [`domain::slack`].

use std::time::Duration;

use domain::geometry::Ned;
use domain::site::SiteKind;
use domain::slack::Waiting;

use super::World;

impl World {
    /// For how long it may wait for a way to `site`.
    pub(super) fn slack_for(&self, site: Ned) -> Duration {
        self.slack(|here| self.landing_flight_wh(here, site), self.open_wh())
    }

    /// For how long it may stay here, and fly on or land here then.
    pub(super) fn slack_here(&self) -> Duration {
        self.slack(|here| self.landing_here_wh(here), self.open_wh())
    }

    /// The landing in reach that waiting here would lose now.
    pub(crate) fn landing_about_to_be_lost(&self) -> Option<String> {
        self.landing_in_reach().filter(|_| self.slack_here().is_zero())
    }

    /// For how long it may be left to the autopilot, which flies where it will, and land then.
    pub(super) fn slack_of_autopilot(&self) -> Duration {
        self.slack(|here| self.landing_here_wh(here), None)
    }

    /// None where the place or the charge is not known, or the wind blows it away: what cannot be counted is not waited for.
    fn slack(&self, awaited_wh: impl Fn(Ned) -> f64, open_wh: Option<f64>) -> Duration {
        let seen = self.seen.vehicle.and_then(|it| Some((it.position, it.charge?)));
        let Some((here, charge)) = seen.filter(|_| self.holds_in_wind()) else { return Duration::ZERO };
        let (energy, lands_below) = (self.energy(), self.setup.table.lands_below());
        let waiting = Waiting { energy: &energy, wind: self.wind(), charge, lands_below };
        waiting.slack(awaited_wh(here), open_wh)
    }

    /// What the landing takes that can be reached without waiting, or the ditch, where no landing can.
    fn open_wh(&self) -> Option<f64> {
        let seen = self.seen_alternates();
        let least_wh = |kind: SiteKind| {
            let open = seen.iter().filter(|it| it.candidate.kind == kind && it.is_sure());
            open.filter_map(|it| it.way.as_ref().map(|(way, _)| way.energy_wh)).min_by(f64::total_cmp)
        };
        least_wh(SiteKind::Landing).or_else(|| least_wh(SiteKind::Ditch))
    }

    fn landing_here_wh(&self, here: Ned) -> f64 {
        let ground_m = self.planner.mission.ground.height_m(here);
        let down = [here.at_height(ground_m.min(here.height_m()))];
        self.energy().landing_flight_wh(here, &down, &self.limits_in_wind().speeds, self.wind())
    }
}
