//! The ranking as a table of cases and as properties; ways among areas.

use proptest::prelude::*;

use super::*;
use crate::airspace::Grants;
use crate::airspace::tests::{airspace, area, square};
use crate::area::{Area, AreaKind};
use crate::area_map::AreaMap;
use crate::speeds::Speeds;
use crate::testing;
use crate::way::FlightLimits;

const LIMITS: FlightLimits = FlightLimits {
    speeds: Speeds::calm(10.0, 3.0, 1.5),
    least_height_m: 5.0,
    return_height_m: 30.0,
    highest_m: 120.0,
    clearance_m: 20.0,
    margin_m: 10.0,
    height_clearance_m: 2.0,
};

fn energy() -> EnergyModel {
    #[derive(serde::Deserialize)]
    struct File {
        energy: EnergyModel,
    }
    toml::from_str::<File>(testing::ENERGY).unwrap().energy
}

fn fraction(value: f64) -> Fraction {
    Fraction::try_from(value).unwrap()
}

fn charge(energy: &EnergyModel, left: f64) -> Charge<'_> {
    Charge { energy, left: Some(fraction(left)), lands_below: fraction(0.1) }
}

fn candidate(role: Role, kind: SiteKind, name: &str) -> Candidate {
    Candidate { role, name: name.into(), position: Ned::default(), kind }
}

/// `home`, `ditch ..` and others by their name; the energy of the way, `asks` if it takes a permission, and failed landings.
fn alternate(name: &str, energy_wh: Option<f64>, asks: bool, failed: u32, left: f64) -> Alternate {
    let (role, kind) = match name {
        "home" => (Role::Home, SiteKind::Landing),
        name if name.starts_with("ditch") => (Role::Site, SiteKind::Ditch),
        _ => (Role::Site, SiteKind::Landing),
    };
    let needs = if asks { vec!["A".to_owned()] } else { Vec::new() };
    let way = energy_wh.map(|energy_wh| Way { length_m: 1.0, time_s: 1.0, energy_wh, needs });
    Alternate::new(candidate(role, kind, name), way, charge(&energy(), left), failed)
}

/// The names of `places` as they are ranked, and as a vehicle diverts to them.
#[track_caller]
fn check(left: f64, places: &[(&str, Option<f64>, bool, u32)], ranked: &[&str], diverts: &[&str]) {
    let mut all: Vec<_> = places.iter().map(|it| alternate(it.0, it.1, it.2, it.3, left)).collect();
    rank(&mut all);
    assert_eq!(all.iter().map(|it| it.candidate.name.as_str()).collect::<Vec<_>>(), ranked);
    assert_eq!(to_divert_to(&all).iter().map(|it| it.candidate.name.as_str()).collect::<Vec<_>>(), diverts);
}

#[test]
fn a_place_that_is_certain_comes_before_one_that_is_nearer() {
    let (far, near) = (Some(20.0), Some(5.0));
    // With 75 Wh above the reserve, everything leaves it.
    check(0.5, &[("home", far, false, 0), ("x", near, false, 0)], &["x", "home"], &["home", "x"]);
    check(0.5, &[("home", far, false, 0), ("x", near, true, 0)], &["home", "x"], &["home", "x"]);
    check(0.5, &[("home", far, false, 0), ("ditch", near, false, 0)], &["home", "ditch"], &["home", "ditch"]);
    check(0.5, &[("home", far, true, 0), ("ditch", near, false, 0)], &["home", "ditch"], &["home", "ditch"]);
    check(0.5, &[("home", None, false, 0), ("x", far, false, 0)], &["x", "home"], &["x"]);
    check(0.5, &[("x", near, false, 2), ("y", far, false, 0)], &["y", "x"], &["y", "x"]);
    check(0.5, &[("x", near, false, 2), ("y", far, true, 0)], &["y", "x"], &["y", "x"]);
    check(0.5, &[("x", near, false, 2), ("ditch", near, false, 0)], &["x", "ditch"], &["x", "ditch"]);
    check(0.5, &[("x", near, false, 2), ("y", far, false, 1)], &["y", "x"], &["y", "x"]);
    check(
        0.5,
        &[("ditch x", near, false, 1), ("ditch y", far, false, 0)],
        &["ditch y", "ditch x"],
        &["ditch y", "ditch x"],
    );
    check(0.5, &[], &[], &[]);
}

#[test]
fn a_low_battery_goes_to_the_nearest_landing_unless_home_is_about_as_near() {
    // 24 % of 300 Wh: 42 Wh are left above the tenth at which it lands where it is, none above the reserve.
    let low = 0.24;
    check(low, &[("home", Some(40.0), false, 0), ("x", Some(19.0), false, 0)], &["x", "home"], &["x", "home"]);
    check(low, &[("home", Some(40.0), false, 0), ("x", Some(20.0), false, 0)], &["x", "home"], &["home", "x"]);
    check(low, &[("home", Some(42.1), false, 0), ("x", Some(41.9), false, 0)], &["x", "home"], &["x"]);
    // A home at which a landing has failed is not preferred.
    check(low, &[("home", Some(20.0), false, 1), ("x", Some(40.0), false, 0)], &["x", "home"], &["x", "home"]);
    check(low, &[("home", Some(40.0), true, 0), ("x", Some(40.0), false, 0)], &["x", "home"], &["x", "home"]);
    // A ditch only if no landing can be reached, even with a permission.
    check(low, &[("home", Some(43.0), false, 0), ("ditch", Some(1.0), false, 0)], &["ditch", "home"], &["ditch"]);
    check(low, &[("x", Some(41.0), true, 0), ("ditch", Some(1.0), false, 0)], &["x", "ditch"], &["x", "ditch"]);
    // Nothing is in reach: what is nearest comes first, a landing before a ditch.
    let empty = 0.1;
    check(
        empty,
        &[("home", Some(9.0), false, 0), ("x", Some(5.0), false, 0), ("ditch", Some(1.0), false, 0)],
        &["x", "home", "ditch"],
        &[],
    );
}

#[test]
fn each_place_is_a_candidate_once_and_none_in_the_air_is_one() {
    let at = |north_m| Ned::new(north_m, 0.0, 0.0);
    let objective = |name: &str, north_m, flying| Objective {
        name: name.into(),
        position: at(north_m),
        flying,
        terms: Default::default(),
        survey: None,
    };
    let site = |name: &str, north_m, kind| Site { name: name.into(), position: at(north_m), kind };
    let sites = [
        site("field", 100.0, SiteKind::Landing),
        site("pond", 200.0, SiteKind::Ditch),
        site("at home", 0.5, SiteKind::Landing),
    ];
    let objectives = [
        objective("deliver", 300.0, false),
        objective("look", 400.0, true),
        objective("return", 0.0, false),
        // A landing in a ditch is another thing than the ditch.
        objective("shore", 200.5, false),
        objective("again", 100.9, false),
    ];
    let words = |ordered| {
        let found = candidates(ordered, &sites, &objectives);
        found.iter().map(|it| it.to_string()).collect::<Vec<_>>().join(", ")
    };
    assert_eq!(words(None), "home, site `field`, ditch `pond`, the place of `deliver`, the place of `shore`");
    assert_eq!(words(Some(at(300.0))), "home, the ordered place, site `field`, ditch `pond`, the place of `shore`");
}

#[test]
fn a_charge_that_is_not_known_judges_nothing() {
    let energy = energy();
    let unknown = Charge { energy: &energy, left: None, lands_below: fraction(0.1) };
    let way = Way { length_m: 1.0, time_s: 1.0, energy_wh: 1e6, needs: Vec::new() };
    let place = Alternate::new(Candidate::home(), Some(way), unknown, 0);
    assert_eq!((place.merit(), place.charge, place.why_not()), (Merit::Sure, None, None));
}

#[test]
fn why_a_place_cannot_be_reached_is_said_with_its_figures() {
    let place = alternate("x", Some(45.0), false, 0, 0.24);
    let expected = "the way needs 45 Wh of 42 usable (72 of 300 Wh left, 10 % reserve)";
    assert_eq!(place.why_not().as_deref(), Some(expected));
    let nowhere = alternate("x", None, false, 0, 0.24).why_not();
    assert_eq!(nowhere.as_deref(), Some("no way there that keeps out of areas which may not be entered"));
    assert_eq!(alternate("x", Some(1.0), true, 3, 0.24).why_not(), None);
}

/// The way from 30 m over the origin to `to` among `areas`: its length, and the permissions it takes.
#[track_caller]
fn check_way(areas: &[Area], held: &[&str], to: Ned, expected: Option<(f64, &[&str])>) {
    let grants: Grants = held.iter().map(|it| ((*it).to_owned(), std::time::Duration::from_secs(900))).collect();
    let energy = energy();
    let map = AreaMap::new(areas);
    let around =
        Surroundings { airspace: airspace(areas, &grants), map: &map, limits: &LIMITS, ends_at: SiteKind::Landing };
    let from = Ned::new(0.0, 0.0, -30.0);
    let view = Viewpoint { from, around, energy: &energy, wind: Wind::CALM };
    let found = view.look_at(&Candidate { position: to, ..Candidate::home() }, 20_000);
    let told =
        found.way.as_ref().map(|it| (it.length_m.round(), it.needs.iter().map(String::as_str).collect::<Vec<_>>()));
    assert_eq!(told, expected.map(|(length_m, needs)| (length_m, needs.to_vec())), "{found:?}");
    if let Some(way) = found.way {
        assert!(way.length_m / 10.0 <= way.time_s && 0.0 < way.energy_wh, "{way:?}");
    }
}

#[test]
fn the_way_goes_round_what_is_closed_and_through_what_a_permission_would_open() {
    let closed = || vec![Area { ceiling_m: None, ..square(AreaKind::KeepOut) }];
    let to_ask = || vec![Area { ceiling_m: None, ..square(AreaKind::Permission) }];
    let (beyond, inside) = (Ned::new(0.0, 400.0, 0.0), Ned::new(0.0, 200.0, 0.0));
    check_way(&[], &[], beyond, Some((430.0, &[])));
    check_way(&closed(), &[], beyond, Some((519.0, &[])));
    check_way(&to_ask(), &[], beyond, Some((519.0, &[])));
    check_way(&to_ask(), &["A"], beyond, Some((430.0, &[])));
    check_way(&closed(), &[], inside, None);
    check_way(&to_ask(), &[], inside, Some((230.0, &["A"])));
    check_way(&to_ask(), &["A"], inside, Some((230.0, &[])));
    // A permission does not help where something else is closed as well.
    let both =
        [to_ask(), vec![area("B", AreaKind::KeepOut, &[(-9.0, 190.0), (9.0, 190.0), (9.0, 210.0), (-9.0, 210.0)])]];
    check_way(&both.concat(), &[], inside, None);
}

#[test]
fn a_search_without_effort_finds_nothing_and_says_what_it_has_looked_at() {
    let areas = [Area { ceiling_m: None, ..square(AreaKind::KeepOut) }];
    let (grants, energy) = (Grants::new(), energy());
    let from = Ned::new(0.0, 0.0, -30.0);
    let map = AreaMap::new(&areas);
    let around =
        Surroundings { airspace: airspace(&areas, &grants), map: &map, limits: &LIMITS, ends_at: SiteKind::Landing };
    let view = Viewpoint { from, around, energy: &energy, wind: Wind::CALM };
    let to = Candidate { position: Ned::new(0.0, 400.0, 0.0), ..Candidate::home() };
    assert_eq!(view.look_at(&to, 0).way, None);
    let found = view.look_at(&to, 20_000);
    assert!(found.way.is_some() && 1 < found.legs && found.legs < 20_000, "{found:?}");
}

fn any_alternate() -> impl Strategy<Value = (SiteKind, bool, Option<f64>, bool, u32)> {
    let kind = prop::sample::select(vec![SiteKind::Landing, SiteKind::Ditch]);
    (kind, any::<bool>(), prop::option::weighted(0.9, 0.0..120.0), any::<bool>(), 0..3_u32)
}

proptest! {
    #[test]
    fn the_first_is_never_worse_than_another_in_what_counts_more(
        places in prop::collection::vec(any_alternate(), 1..9),
        left in 0.0..1.0,
    ) {
        let model = energy();
        let place = |(index, (kind, is_home, energy_wh, asks, failed)): (usize, (SiteKind, bool, Option<f64>, bool, u32))| {
            let kind = if is_home { SiteKind::Landing } else { kind };
            let role = if is_home { Role::Home } else { Role::Site };
            let needs = if asks { vec!["A".to_owned()] } else { Vec::new() };
            let way = energy_wh.map(|energy_wh| Way { length_m: 1.0, time_s: 1.0, energy_wh, needs });
            Alternate::new(candidate(role, kind, &index.to_string()), way, charge(&model, left), failed)
        };
        let mut all: Vec<Alternate> = places.into_iter().enumerate().map(place).collect();
        let count = all.len();
        rank(&mut all);
        prop_assert_eq!(all.len(), count);
        let (first, diverts) = (&all[0], to_divert_to(&all));
        let is_landing = |it: &Alternate| it.candidate.kind == SiteKind::Landing;
        let (wh, asks) = (|it: &Alternate| it.way.as_ref().unwrap().0.energy_wh, |it: &Alternate| !it.way.as_ref().unwrap().0.needs.is_empty());
        for it in &all {
            // What the battery suffices for comes first, and only that is diverted to.
            prop_assert!(first.is_reachable() || !it.is_reachable());
            prop_assert_eq!(it.is_reachable(), diverts.iter().any(|that| that.candidate == it.candidate));
            prop_assert_eq!(it.is_reachable(), it.why_not().is_none());
            if !it.is_reachable() {
                continue;
            }
            // A ditch only where no landing can be reached.
            prop_assert!(is_landing(first) || !is_landing(it));
            prop_assert!(is_landing(diverts[0]) || !is_landing(it));
            if is_landing(it) && it.failed_landings == 0 {
                // No landing that failed before one that was not tried, nothing to ask for before what is free.
                prop_assert_eq!(first.failed_landings, 0);
                prop_assert!(!asks(first) || asks(it));
                let keeps = |it: &Alternate| it.merit() == Merit::Sure;
                prop_assert!(keeps(first) || !keeps(it));
                if it.merit() == first.merit() {
                    prop_assert!(wh(first) <= wh(it));
                    prop_assert!(diverts[0].candidate.role == Role::Home || wh(diverts[0]) <= wh(it));
                }
            }
        }
        // Who diverts past the first goes home, which keeps the reserve or is as good and takes no more than twice as much.
        if let Some(to) = diverts.first().filter(|to| to.candidate != first.candidate) {
            prop_assert_eq!(to.candidate.role, Role::Home);
            prop_assert!(to.merit() == Merit::Sure || (to.merit() == first.merit() && wh(to) <= 2.0 * wh(first)));
        }
    }
}
