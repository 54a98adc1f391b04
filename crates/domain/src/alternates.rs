//! Where a flight may end early, and which of those places comes first.
//!
//! Two steps, so that the first can be taken ahead: the way to a place is searched ([`Viewpoint::look_at`]), and then the places
//! are compared for the charge that is left by now ([`rank`]). Nothing here asks for a permission or flies.

use std::cmp::Ordering;

use crate::energy::{EnergyModel, Shortfall, Wind};
use crate::geometry::Ned;
use crate::harm::Harm;
use crate::mission::Objective;
use crate::quantity::Fraction;
use crate::site::{Site, SiteKind};
use crate::way::{Found, Surroundings, WayToAsk};

mod reasons;

/// Who names a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// It is the take-off point.
    Home,
    /// The mission, as a site.
    Site,
    /// The mission, as an objective on the ground.
    Objective,
    /// An operator, by an order to land there.
    Ordered,
}

/// A place to come down at.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Who names it.
    pub role: Role,
    /// Unique among those of its role; without meaning for home and an ordered place.
    pub name: String,
    /// On the ground, or on the water.
    pub position: Ned,
    /// What happens to a vehicle there.
    pub kind: SiteKind,
}

impl Candidate {
    /// The take-off point.
    pub fn home() -> Candidate {
        Candidate { role: Role::Home, name: "home".into(), position: Ned::default(), kind: SiteKind::Landing }
    }
}

/// Two candidates of one kind this near to each other are one, in metres.
const SAME_PLACE_M: f64 = 1.0;

/// Home, the place `ordered` by an operator, `sites`, and those of `objectives` that are on the ground; each place once.
pub fn candidates<'a>(
    ordered: Option<Ned>,
    sites: &[Site],
    objectives: impl IntoIterator<Item = &'a Objective>,
) -> Vec<Candidate> {
    let landing = |role, name: &str, position| Candidate { role, name: name.into(), position, kind: SiteKind::Landing };
    let ordered = ordered.map(|it| landing(Role::Ordered, "ordered", it));
    let sites = sites.iter().map(|it| Candidate { kind: it.kind, ..landing(Role::Site, &it.name, it.position) });
    let on_ground = objectives.into_iter().filter(|it| !it.flying);
    let objectives = on_ground.map(|it| landing(Role::Objective, &it.name, it.position));
    let mut candidates = vec![Candidate::home()];
    for candidate in ordered.into_iter().chain(sites).chain(objectives) {
        let is_same = |it: &Candidate| {
            it.kind == candidate.kind && it.position.horizontal_distance_m(candidate.position) < SAME_PLACE_M
        };
        if !candidates.iter().any(is_same) {
            candidates.push(candidate);
        }
    }
    candidates
}

/// `home`, `site `field``, `the place of `deliver``.
impl std::fmt::Display for Candidate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = &self.name;
        match (self.role, self.kind) {
            (Role::Home, _) => f.write_str("home"),
            (Role::Site, SiteKind::Landing) => write!(f, "site `{name}`"),
            (Role::Site, SiteKind::Ditch) => write!(f, "ditch `{name}`"),
            (Role::Objective, _) => write!(f, "the place of `{name}`"),
            (Role::Ordered, _) => f.write_str("the ordered place"),
        }
    }
}

/// The way to a place and down to the ground there.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    /// In metres, the climb and the descent included.
    pub length_m: f64,
    /// In seconds.
    pub time_s: f64,
    /// In Wh, the landing included.
    pub energy_wh: f64,
    /// Permissions that it takes and that are not held.
    pub needs: Vec<String>,
}

/// From where, and how, a flight would go to a place.
#[derive(Debug, Clone, Copy)]
pub struct Viewpoint<'a> {
    /// In the air.
    pub from: Ned,
    /// As they are then.
    pub around: Surroundings<'a>,
    /// The vehicle's figures.
    pub energy: &'a EnergyModel,
    /// The wind.
    pub wind: Wind,
}

impl Viewpoint<'_> {
    /// The way to `candidate`: one that may be flown as the permissions are, else one that takes more of them. Each search looks at no
    /// more than `most_legs` legs.
    pub fn look_at(&self, candidate: &Candidate, most_legs: u32) -> Found<Way> {
        let Viewpoint { from, .. } = *self;
        let (place, around) = (candidate.position, Surroundings { ends_at: candidate.kind, ..self.around });
        let free = around.way_within(from, place, most_legs);
        if let Some(points) = free.way {
            return Found { way: Some(self.measured(&points, place, Vec::new())), legs: free.legs };
        }
        let Found { way, legs } = around.way_if_granted(from, place, most_legs);
        let way = way.filter(|it| !it.needs.is_empty());
        let way = way.map(|WayToAsk { points, needs }| self.measured(&points, place, needs.into_iter().collect()));
        Found { way, legs: free.legs + legs }
    }

    fn measured(&self, points: &[Ned], place: Ned, needs: Vec<String>) -> Way {
        let mut flown = points.to_vec();
        flown.push(place);
        let speeds = &self.around.limits.speeds;
        Way {
            length_m: std::iter::once(&self.from).chain(&flown).zip(&flown).map(|(a, b)| a.distance_m(*b)).sum(),
            time_s: speeds.time_along_s(self.from, &flown),
            energy_wh: self.energy.landing_flight_wh(self.from, &flown, speeds, self.wind),
            needs,
        }
    }
}

/// How far the battery suffices for a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// The reserve is left.
    WithReserve,
    /// The reserve is used, but no response ends the flight for want of energy on the way.
    OnReserve,
    /// It is not known: the charge is not.
    Unknown,
    /// The vehicle would land on the way.
    TooFar(Shortfall),
}

/// By what the charge of a battery is judged.
#[derive(Debug, Clone, Copy)]
pub struct Charge<'a> {
    /// The vehicle's figures.
    pub energy: &'a EnergyModel,
    /// 0 to 1; `None` where it is not known.
    pub left: Option<Fraction>,
    /// Below this the vehicle lands where it is.
    pub lands_below: Fraction,
}

impl Charge<'_> {
    fn reach(&self, way: &Way) -> Reach {
        let Some(left) = self.left else { return Reach::Unknown };
        match self.energy.budget_above(left, self.lands_below).shortfall(way.energy_wh) {
            Some(shortfall) => Reach::TooFar(shortfall),
            None if self.energy.budget(left).shortfall(way.energy_wh).is_none() => Reach::WithReserve,
            None => Reach::OnReserve,
        }
    }

    fn after(&self, way: &Way) -> Option<f64> {
        Some(self.energy.charge_after(self.left?, way.energy_wh))
    }
}

/// A place among others, as it is reached from one place with one charge.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternate {
    /// The place.
    pub candidate: Candidate,
    /// The way there, and how far the battery suffices for it; `None` if no way was found.
    pub way: Option<(Way, Reach)>,
    /// The charge that is left after the landing, 0 to 1; `None` if it is not known, or there is no way.
    pub charge: Option<f64>,
    /// Landings that did not come down there.
    pub failed_landings: u32,
}

/// How sure it is that the flight ends there; earlier ones come first, of what harms as much.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Merit {
    /// The reserve is left.
    Sure,
    /// The reserve is used.
    OnReserve,
    /// Once a permission is granted.
    ToAskFor,
    /// A landing has failed there before: the place may be free by now.
    TriedBefore,
    /// The battery does not suffice.
    TooFar,
    /// There is no way.
    NoWay,
}

impl Alternate {
    /// `candidate` for a vehicle with this charge, after this number of failed landings there.
    pub fn new(candidate: Candidate, way: Option<Way>, charge: Charge<'_>, failed_landings: u32) -> Alternate {
        let left = way.as_ref().and_then(|it| charge.after(it));
        let way = way.map(|it| {
            let reach = charge.reach(&it);
            (it, reach)
        });
        Alternate { candidate, way, charge: left, failed_landings }
    }

    /// How sure it is that the flight ends there.
    pub fn merit(&self) -> Merit {
        let Some((way, reach)) = &self.way else { return Merit::NoWay };
        match reach {
            Reach::TooFar(_) => Merit::TooFar,
            _ if 0 < self.failed_landings => Merit::TriedBefore,
            _ if !way.needs.is_empty() => Merit::ToAskFor,
            Reach::OnReserve => Merit::OnReserve,
            Reach::WithReserve | Reach::Unknown => Merit::Sure,
        }
    }

    /// The harm of coming down there, once the permissions for the way are granted.
    pub fn harm(&self) -> Harm {
        self.candidate.kind.harm()
    }

    /// Whether it can be reached as the permissions are, and no landing has failed there.
    pub fn is_sure(&self) -> bool {
        self.merit() <= Merit::OnReserve
    }

    /// Whether the battery suffices for a way there.
    pub fn is_reachable(&self) -> bool {
        self.merit() < Merit::TooFar
    }

    /// Whether the way takes a permission that is not held.
    pub fn asks(&self) -> bool {
        self.way.as_ref().is_some_and(|(way, _)| !way.needs.is_empty())
    }

    /// Why it cannot be reached, if so.
    pub fn why_not(&self) -> Option<String> {
        match &self.way {
            None => Some("no way there that keeps out of areas which may not be entered".into()),
            Some((_, Reach::TooFar(shortfall))) => Some(format!("the way {shortfall}")),
            Some(_) => None,
        }
    }

    fn energy_wh(&self) -> f64 {
        self.way.as_ref().map_or(f64::INFINITY, |(way, _)| way.energy_wh)
    }

    /// Whether this one comes before `other`.
    pub fn compare(&self, other: &Alternate) -> Ordering {
        let out_of_reach = |it: &Alternate| Some(it.merit()).filter(|_| !it.is_reachable());
        let key = |it: &Alternate| (out_of_reach(it), it.harm(), it.merit(), it.failed_landings);
        key(self).cmp(&key(other)).then(self.energy_wh().total_cmp(&other.energy_wh()))
    }
}

/// Puts the best place first: of those in reach by what they harm, then by merit, by failed landings and by what the way takes.
pub fn rank(alternates: &mut [Alternate]) {
    alternates.sort_by(Alternate::compare);
}

/// A place other than home is worth going to only if it takes less than this share of the energy of the way home, where home has
/// the same merit. (ENG: at home there are people, tools and a charger; half of the way is a difference that no wind undoes.)
pub const WORTH_LEAVING_HOME: f64 = 0.5;

/// The places of `ranked` that can be reached, in the order in which a vehicle tries them whose flight has to end: home as long as it
/// can be reached with the reserve, or is as good as the best and not much farther; then the others, best first.
pub fn to_divert_to(ranked: &[Alternate]) -> Vec<&Alternate> {
    let mut order: Vec<&Alternate> = ranked.iter().filter(|it| it.is_reachable()).collect();
    let Some(home) = order.iter().position(|it| it.candidate.role == Role::Home) else { return order };
    let (best, at_home) = (order[0], order[home]);
    let has_reserve = at_home.merit() == Merit::Sure;
    let is_near = (at_home.harm(), at_home.merit()) == (best.harm(), best.merit())
        && at_home.failed_landings == best.failed_landings
        && WORTH_LEAVING_HOME * at_home.energy_wh() <= best.energy_wh();
    if has_reserve || is_near {
        order[..=home].rotate_right(1);
    }
    order
}

#[cfg(test)]
mod tests;
