//! Where a flight could end early, leg by leg, for a mission that is judged before it is flown.

use std::cmp::Ordering;
use std::time::Duration;

use domain::airspace::{Airspace, Clock, Grants};
use domain::alternates::{Alternate, Candidate, Charge, Viewpoint, candidates, rank};
use domain::area_map::AreaMap;
use domain::energy::Wind;
use domain::geometry::Ned;
use domain::known_ground::KnownGround;
use domain::mission::Mission;
use domain::quantity::Fraction;
use domain::site::SiteKind;
use domain::time::Now;
use domain::way::{Found, Surroundings};

use crate::forecast::{LegForecast, MissionForecast};
use crate::mission_planner::MissionPlanner;

/// The searches for one forecast look at no more legs of ways than this, and each one at a twentieth: the planner answers in the
/// loop that plans. (Measured: 2 to 10 us for a leg.)
const MOST_LEGS: u32 = 20_000;

/// `forecast` of `mission` by `planner`, with the best alternate of each leg in this wind; of the legs for which the effort suffices.
pub(crate) fn with_alternates(
    mut forecast: MissionForecast,
    planner: &MissionPlanner,
    mission: &Mission,
    wind: Wind,
    now: Now,
) -> MissionForecast {
    let places = candidates(None, &mission.sites, &mission.objectives);
    let map = AreaMap::new(&mission.areas);
    let ground =
        KnownGround::of(&mission.sites, mission.objectives.iter().filter(|it| !it.flying).map(|it| it.position));
    let mut search = Search { planner, mission, map, ground, places, wind, legs_left: MOST_LEGS };
    for objective in &mut forecast.objectives {
        let mut at_s = objective.begins_s;
        for leg in &mut objective.legs {
            at_s += leg.time_s;
            let at = planner.after(now, Duration::try_from_secs_f64(at_s).unwrap_or_default());
            leg.alternate = search.best_on(leg, at);
        }
    }
    forecast
}

struct Search<'a> {
    planner: &'a MissionPlanner,
    mission: &'a Mission,
    map: AreaMap,
    ground: KnownGround,
    places: Vec<Candidate>,
    wind: Wind,
    legs_left: u32,
}

impl Search<'_> {
    /// The best place from where on `leg` the vehicle is worse off, its middle or its end; `None` once the effort is used up.
    fn best_on(&mut self, leg: &LegForecast, at: Now) -> Option<Alternate> {
        let (from, to) = leg.way;
        let (middle, end) = (self.best(leg, from.towards(to, 0.5), at)?, self.best(leg, to, at)?);
        let worse = if middle.compare(&end) == Ordering::Greater { middle } else { end };
        (0 < self.legs_left).then_some(worse)
    }

    /// The best place from `here`, in the air on `leg`.
    fn best(&mut self, leg: &LegForecast, here: Ned, at: Now) -> Option<Alternate> {
        let rules = self.planner.rules();
        let limits = rules.in_wind(self.wind).flight_limits();
        let grants: Grants = leg.held.iter().map(|it| (it.clone(), Duration::MAX)).collect();
        let airspace = Airspace {
            areas: &self.mission.areas,
            grants: &grants,
            clock: Clock { utc_ms: at.utc_ms, pace: self.planner.pace() },
            lead: rules.config.grant_lead_s.seconds(),
            vertical_margin_m: rules.aircraft.flight.vertical_margin_m.get(),
            ground: &self.ground,
        };
        let view = Viewpoint {
            from: here,
            around: Surroundings { airspace, map: &self.map, limits: &limits, ends_at: SiteKind::Landing },
            energy: &rules.aircraft.energy,
            wind: self.wind,
        };
        // Nothing is known here of the charge below which a response lands: what is in the battery counts.
        let left = leg.charge.and_then(|it| Fraction::try_from(it).ok());
        let charge = Charge { energy: &rules.aircraft.energy, left, lands_below: Fraction::ZERO };
        let mut alternates: Vec<Alternate> = Vec::new();
        for place in &self.places {
            let Found { way, legs } = view.look_at(place, self.legs_left.min(MOST_LEGS / 20));
            self.legs_left = self.legs_left.saturating_sub(legs.max(1));
            alternates.push(Alternate::new(place.clone(), way, charge, 0));
        }
        rank(&mut alternates);
        alternates.into_iter().next()
    }
}
