//! What is exported and imported again is what it was, but for what the format cannot say.

use super::samples::PLAN;
use super::{import, mission, origin, settings, source};
use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::hours::WeeklyHours;
use domain::mission::terms::{Order, Terms};
use domain::mission::{Mission, Objective};
use domain::site::{Site, SiteKind};
use domain::survey::Survey;
use formats::assemble::Settings;
use formats::export::{Target, export};
use proptest::prelude::*;
use std::time::Duration;

/// Positions are written to a tenth of a millimetre, and heights in centimetres.
const NEAR_M: f64 = 0.01;

#[track_caller]
fn written(mission: &Mission, target: Target) -> (String, Vec<String>) {
    let (text, notes) = export(&source("m.toml", ""), mission, origin(), target, &[]);
    (text, notes.into_iter().map(|it| format!("{}: {}", it.place, it.text)).collect())
}

/// The origin comes from the file.
#[track_caller]
fn back(text: &str) -> Mission {
    let assembled = import("back", text, &Settings { origin: None, ..settings() }).unwrap_or_else(|it| panic!("{it}"));
    assert!(assembled.notes.is_empty() || text.contains("fileType"), "{:?}", assembled.notes);
    mission(&assembled)
}

fn is_same_ring(a: &[Ned], b: &[Ned]) -> bool {
    let turned = |by: usize| b.iter().cycle().skip(by).take(b.len());
    let near = |it: (&Ned, &Ned)| it.0.horizontal_distance_m(*it.1) < NEAR_M;
    a.len() == b.len() && (0..b.len()).any(|by| a.iter().zip(turned(by)).all(near))
}

/// In whatever direction the corners run.
fn is_same_outline(a: &[Ned], b: &[Ned]) -> bool {
    let reversed: Vec<Ned> = b.iter().rev().copied().collect();
    is_same_ring(a, b) || is_same_ring(a, &reversed)
}

/// The holes in the same order.
fn are_same_rings(a: &Area, b: &Area) -> bool {
    a.holes.len() == b.holes.len() && a.rings().zip(b.rings()).all(|(a, b)| is_same_outline(a, b))
}

fn is_same_area(a: &Area, b: &Area) -> bool {
    let band = |it: &Area| [it.floor_m, it.ceiling_m].map(|it| it.map(|it| (it * 100.0).round()));
    let rest = |it: &Area| (it.name.clone(), it.kind, it.from_utc_ms, it.until_utc_ms, it.hours.clone(), band(it));
    rest(a) == rest(b) && are_same_rings(a, b)
}

fn is_same_objective(a: &Objective, b: &Objective) -> bool {
    let apart_m = (a.position.height_m() - b.position.height_m()).abs();
    let is_same_way = match (&a.survey, &b.survey) {
        // Its lines follow from these. Where a corner is as far away as a whole number of spacings, a tenth of a millimetre adds a line.
        (Some(a), Some(b)) => {
            // A heading is read to the last digit but one.
            let is_near = |a: f64, b: f64| (a - b).abs() < 1e-9;
            let is_same_heading = match (a.heading_deg(), b.heading_deg()) {
                (Some(a), Some(b)) => is_near(a, b),
                (a, b) => a == b,
            };
            apart_m < NEAR_M
                && is_same_outline(a.corners(), b.corners())
                && is_near(a.spacing_m(), b.spacing_m())
                && is_same_heading
        }
        (None, None) => a.position.distance_m(b.position) < NEAR_M,
        _ => false,
    };
    a.name == b.name && a.flying == b.flying && a.terms == b.terms && is_same_way
}

fn area() -> impl Strategy<Value = Area> {
    let window = (prop::option::of(1_i64..2_000_000_000), prop::option::of(2_000_000_001_i64..4_000_000_000));
    let band = (prop::option::of(1.0..50.0_f64), prop::option::of(60.0..110.0_f64));
    // Within 100 km everything is in reach, and farther than 100 m nothing is too near to the take-off point.
    let place = (200.0..60_000.0_f64, 0.0..std::f64::consts::TAU, 20.0..90.0_f64, 3_usize..9, any::<bool>());
    let hours = prop::option::of(prop::collection::vec((0..10_080_i64, 1..2_000_i64), 1..4));
    (any::<bool>(), window, hours, band, place).prop_map(
        |(keep_out, window, hours, band, (distance_m, direction, radius_m, count, has_hole))| {
            let (sin, cos) = direction.sin_cos();
            let ring = |radius_m: f64| -> Vec<Ned> {
                let corner = |index: usize| {
                    let (east, north) = (std::f64::consts::TAU * index as f64 / count as f64).sin_cos();
                    Ned::new(distance_m * cos + radius_m * north, distance_m * sin + radius_m * east, 0.0)
                };
                (0..count).map(corner).collect()
            };
            Area {
                name: String::new(),
                kind: if keep_out { AreaKind::KeepOut } else { AreaKind::Permission },
                corners: ring(radius_m),
                holes: if has_hole { vec![ring(0.5 * radius_m)] } else { Vec::new() },
                floor_m: band.0,
                ceiling_m: band.1,
                from_utc_ms: window.0.map(|it| it * 1000),
                until_utc_ms: window.1.map(|it| it * 1000),
                hours: hours.map(|spans| WeeklyHours::new(spans).expect("some, and few")),
                ground: Default::default(),
            }
        },
    )
}

/// What a mission asks of its objectives: each comes after some of those before it.
fn terms() -> impl Strategy<Value = Terms> {
    let seconds = || (0..100_000_u64).prop_map(Duration::from_millis);
    let by = prop::option::of((1_i64..2_000_000_000).prop_map(|it| it * 1000));
    let worth = prop::option::of((0..4000_u16).prop_map(|it| f64::from(it) / 4.0));
    (worth, prop::option::of(seconds()), by, on_site()).prop_map(|(worth, within, by_utc_ms, terms)| Terms {
        worth,
        within,
        by_utc_ms,
        ..terms
    })
}

/// What is done at an objective: that can be said in a plan too.
fn on_site() -> impl Strategy<Value = Terms> {
    let known = [
        "MAV_CMD_DO_SET_CAM_TRIGG_DIST",
        "MAV_CMD_DO_SET_ROI_LOCATION 0 0 0 0 54.001 6.6 20.5 frame=3",
        "MAV_CMD_DO_MOUNT_CONTROL nan 0 -90 0 0 0 2",
        "MAV_CMD_DO_GRIPPER 1 1",
    ];
    let actions = prop::collection::vec(prop::sample::select(known.map(str::to_owned).to_vec()), 0..4);
    let dwell = (0..1_000_u64).prop_map(|it| Duration::from_millis(it * 100));
    (dwell, any::<bool>(), actions).prop_map(|(dwell, drop, actions)| Terms {
        dwell,
        drop,
        actions,
        ..Terms::default()
    })
}

/// With terms, in any order, and with a survey at the end.
fn missions_with_terms() -> impl Strategy<Value = Mission> {
    let pictures = prop::option::of(0.1..100.0_f64);
    let survey = (-60.0..0.0_f64, 20.0..80.0_f64, prop::option::of(-360.0..360.0), pictures);
    (missions(), prop::collection::vec(terms(), 6), any::<bool>(), survey).prop_map(
        |(mut mission, terms, is_free, (low_m, side_m, heading_deg, picture_distance_m))| {
            let corner = |north: f64, east: f64| Ned::new(low_m + north * side_m, 0.7 * low_m + east * side_m, 0.0);
            let corners = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.2, 0.4), corner(0.0, 1.0)];
            let lines = Survey::new(corners, 7.0, heading_deg).expect("an arrowhead");
            let survey = lines.with_pictures(picture_distance_m).expect("in range");
            let end = survey.turns().last().expect("its end").at.at_height(30.0);
            let look = Objective {
                name: "look".into(),
                position: end,
                flying: true,
                terms: Terms::default(),
                survey: Some(survey),
            };
            mission.objectives.push(look);
            let names: Vec<String> = mission.objectives.iter().map(|it| it.name.clone()).collect();
            for (index, (objective, terms)) in mission.objectives.iter_mut().zip(terms).enumerate() {
                // A load is dropped in flight.
                let drop = terms.drop && objective.flying;
                objective.terms = Terms { after: names[..index].to_vec(), drop, ..terms };
            }
            mission.order = if is_free { Order::Free } else { Order::Given };
            mission
        },
    )
}

/// Around the take-off point, where there are no areas.
fn sites() -> impl Strategy<Value = Vec<Site>> {
    // On one ground.
    let site = (-60.0..60.0_f64, -60.0..60.0_f64, 0..6_u8, any::<bool>());
    prop::collection::vec(site, 0..4).prop_map(|sites| {
        let site = |(index, (north_m, east_m, height_m, is_ditch)): (usize, (f64, f64, u8, bool))| Site {
            name: format!("site {index}"),
            position: Ned::new(north_m, east_m, -f64::from(height_m)),
            kind: if is_ditch { SiteKind::Ditch } else { SiteKind::Landing },
        };
        sites.into_iter().enumerate().map(site).collect()
    })
}

fn missions() -> impl Strategy<Value = Mission> {
    let areas = prop::collection::vec(area(), 0..8);
    // Around the take-off point, where there are no areas.
    let objectives = prop::collection::vec((-60.0..60.0_f64, -60.0..60.0_f64, 6.0..100.0_f64, any::<bool>()), 1..6);
    (areas, objectives, sites()).prop_map(|(mut areas, objectives, sites)| {
        for (index, area) in areas.iter_mut().enumerate() {
            area.name = format!("area {index}");
        }
        let objective = |(index, (north_m, east_m, height_m, flying))| Objective {
            name: format!("objective {index}"),
            position: Ned::new(north_m, east_m, if flying { -f64::round(height_m) } else { 0.0 }),
            flying,
            terms: Default::default(),
            survey: None,
        };
        let objectives = objectives.into_iter().enumerate().map(objective).collect();
        Mission {
            name: "sample".into(),
            objectives,
            areas,
            order: Default::default(),
            sites,
            origin: None,
            feeds: Vec::new(),
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn geojson_says_everything(mission in missions_with_terms()) {
        let (text, notes) = written(&mission, Target::GeoJson);
        prop_assert_eq!(notes, Vec::<String>::new());
        let read = back(&text);
        prop_assert!(read.objectives.len() == mission.objectives.len() && read.areas.len() == mission.areas.len());
        prop_assert_eq!(read.order, mission.order);
        for (a, b) in read.objectives.iter().zip(&mission.objectives) {
            prop_assert!(is_same_objective(a, b), "{a:?} {b:?}");
        }
        for (a, b) in read.areas.iter().zip(&mission.areas) {
            prop_assert!(is_same_area(a, b), "{a:?} {b:?}");
        }
        prop_assert_eq!(read.sites.len(), mission.sites.len());
        for (a, b) in read.sites.iter().zip(&mission.sites) {
            prop_assert!((&a.name, a.kind) == (&b.name, b.kind) && a.position.distance_m(b.position) < NEAR_M, "{a:?} {b:?}");
        }
        // What is written again is the same text but for where rings begin, which is seen above.
        prop_assert_eq!(written(&read, Target::GeoJson).0.lines().count(), text.lines().count());
    }

    #[test]
    fn a_plan_says_where_to_fly_and_what_to_keep_out_of(
        mission in missions(),
        terms in prop::collection::vec(on_site(), 6),
    ) {
        let mut mission = mission;
        for (objective, terms) in mission.objectives.iter_mut().zip(terms) {
            objective.terms = Terms { drop: terms.drop && objective.flying, ..terms };
        }
        let (text, notes) = written(&mission, Target::Plan);
        let read = back(&text);
        prop_assert_eq!(read.objectives.len(), mission.objectives.len());
        for (a, b) in read.objectives.iter().zip(&mission.objectives) {
            prop_assert!(a.flying == b.flying && a.position.distance_m(b.position) < NEAR_M, "{a:?} {b:?}");
            prop_assert_eq!(&a.terms, &b.terms);
        }
        let closed: Vec<_> = mission.areas.iter().filter(|it| it.kind == AreaKind::KeepOut).collect();
        prop_assert_eq!(read.areas.len(), closed.len());
        for (a, b) in read.areas.iter().zip(closed) {
            prop_assert!(a.kind == AreaKind::KeepOut && is_same_ring(&a.corners, &b.corners), "{a:?} {b:?}");
        }
        let landings: Vec<_> = mission.sites.iter().filter(|it| it.kind == SiteKind::Landing).collect();
        prop_assert_eq!(read.sites.len(), landings.len());
        for (a, b) in read.sites.iter().zip(landings) {
            let is_there = a.position.distance_m(b.position.at_height(0.0)) < NEAR_M;
            prop_assert!(a.kind == SiteKind::Landing && is_there, "{a:?} {b:?}");
        }
        for site in &mission.sites {
            let said = |part: &str| notes.iter().any(|it| it.starts_with(&format!("{}: ", site.name)) && it.contains(part));
            let is_ditch = site.kind == SiteKind::Ditch;
            prop_assert_eq!(said("a ditch has no counterpart"), is_ditch);
            prop_assert_eq!(said("the height of its ground"), !is_ditch && site.position.height_m() != 0.0);
        }
        for area in &mission.areas {
            let said = |part: &str| notes.iter().any(|it| it.starts_with(&format!("{}: ", area.name)) && it.contains(part));
            let is_closed = area.kind == AreaKind::KeepOut;
            prop_assert_eq!(said("permission area"), !is_closed);
            prop_assert_eq!(said("no heights"), is_closed && (area.floor_m.is_some() || area.ceiling_m.is_some()));
            prop_assert_eq!(said("no time window"), is_closed && (area.from_utc_ms.is_some() || area.until_utc_ms.is_some()));
            prop_assert_eq!(said("no hours"), is_closed && area.hours.is_some());
            prop_assert_eq!(said("no holes"), is_closed && !area.holes.is_empty());
        }
    }
}

#[test]
fn a_plan_says_how_long_to_stay_and_where_the_lines_of_a_survey_end() {
    let text = "name = \"m\"\norder = \"free\"\n[[objective]]\nname = \"look\"\nheight_m = 30\nflying = true\ndwell_s = 9\n\
                survey = { corners_m = [[100, 0], [300, 0], [300, 60], [100, 60]], spacing_m = 30 }\n\
                [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n\
                dwell_s = 5\nactions = [\"smile\"]\nafter = [\"look\"]\noptional = true\nworth = 1.0\nreach_within_s = 900\n";
    let mission = Mission::read(&source("m.toml", text)).unwrap_or_else(|it| panic!("{it}"));
    let (plan, notes) = written(&mission, Target::Plan);
    let found: Vec<_> =
        back(&plan).objectives.iter().map(|it| format!("{} {}", it.position, it.terms.dwell.as_secs())).collect();
    assert_eq!(found, ["(100, 15, 30) 0", "(300, 15, 30) 0", "(300, 45, 30) 0", "(100, 45, 30) 9", "(0, 0, 0) 5"]);
    let lost: Vec<_> = notes.iter().filter(|it| !it.contains("the name of")).map(String::as_str).collect();
    let expected = [
        "look: a survey is written as the ends of its lines",
        "home: action `smile` is not a command of MAVLink: left out",
        "home: that it may be left out has no counterpart in a plan: left out",
        "home: what comes before it has no counterpart in a plan: left out",
        "home: its time limit has no counterpart in a plan: left out",
        "order: that the order is free has no counterpart: it becomes the order of the file",
    ];
    assert_eq!(lost, expected);
}

#[test]
fn the_sample_plan_comes_back_as_it_was_read() {
    let first = back(PLAN);
    let again = back(&written(&first, Target::Plan).0);
    assert!(first.objectives.iter().zip(&again.objectives).all(|(a, b)| a.position.distance_m(b.position) < NEAR_M));
    assert!(first.areas.iter().zip(&again.areas).all(|(a, b)| are_same_rings(a, b)), "{first:?} {again:?}");
    assert_eq!(first.areas[0].holes.len(), 1);
    assert_eq!((first.objectives.len(), first.areas.len()), (again.objectives.len(), again.areas.len()));
}

#[test]
fn a_drop_is_a_release_after_its_waypoint() {
    let text = "name = \"m\"\n[[objective]]\nname = \"buoy\"\nnorth_m = 0\neast_m = 200\nheight_m = 30\nflying = true\n\
                drop = true\n[[objective]]\nname = \"look\"\nnorth_m = 50\neast_m = 200\nheight_m = 30\nflying = true\n\
                drop = true\ndwell_s = 9\n\
                [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";
    let mission = Mission::read(&source("m.toml", text)).unwrap_or_else(|it| panic!("{it}"));
    let (plan, notes) = written(&mission, Target::Plan);
    let drops: Vec<_> = back(&plan).objectives.iter().map(|it| (it.terms.drop, it.terms.dwell.as_secs())).collect();
    assert_eq!(drops, [(true, 0), (true, 9), (false, 0)]);
    assert!(notes.iter().all(|it| it.contains("the name of") || it.contains("origin")), "{notes:?}");
}
