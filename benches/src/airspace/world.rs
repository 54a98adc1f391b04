//! Rows of areas between which there is room to fly, and a mission from one end to the other, at an angle, so that no row is open.

use std::f64::consts::TAU;
use std::time::Duration;

use domain::aircraft::{Aircraft, Flight};
use domain::airspace::{Airspace, Clock, Grants};
use domain::area::{Area, AreaKind};
use domain::area_map::AreaMap;
use domain::energy::EnergyModel;
use domain::geometry::Ned;
use domain::known_ground::LEVEL;
use domain::mission::{Mission, Objective};
use domain::plan::Basis;
use domain::site::SiteKind;
use domain::speeds::Speeds;
use domain::state::State;
use domain::time::{Now, Pace};
use domain::way::{FlightLimits, MOST_LEGS, Surroundings};
use kittiwake_proto::topics::{Request, Response};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};
use planner::Planner;
use planner::config::Config;

/// Metres from one area to the next.
const APART_M: f64 = 300.0;
/// Metres from an area's centre to its farthest corners.
const RADIUS_M: f64 = 120.0;

#[derive(serde::Deserialize)]
struct Shipped {
    planner: Config,
    flight: Flight,
    energy: EnergyModel,
}

/// What stands in the rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct World {
    pub(crate) areas: usize,
    /// Of each area.
    pub(crate) corners: usize,
    pub(crate) shape: Shape,
    pub(crate) heights: Heights,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Shape {
    Circles,
    /// They have corners that a way may touch from many sides, circles none.
    Stars,
}

/// From where to where the areas reach.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Heights {
    /// From the ground up, without limit.
    All,
    /// From the ground to 40, 60 or 80 m.
    Ceilings,
    /// From 6, 20 or 30 m up, without limit: two of three lie above the height at which plans fly.
    Floors,
    /// Between two of these.
    Bands,
}

impl World {
    /// The largest one that is measured.
    pub(crate) const LARGEST: World = World::circles(2000, 50);

    /// Circles that reach to all heights.
    pub(crate) const fn circles(areas: usize, corners: usize) -> World {
        World { areas, corners, shape: Shape::Circles, heights: Heights::All }
    }

    pub(crate) const fn stars(areas: usize, corners: usize) -> World {
        World { shape: Shape::Stars, ..World::circles(areas, corners) }
    }

    fn columns(self) -> usize {
        (self.areas as f64).sqrt().ceil() as usize
    }

    /// Every fifth area asks for a permission; the others are closed.
    fn area(self, index: usize) -> Area {
        let (row, column) = (index / self.columns(), index % self.columns());
        let shift_m = if row.is_multiple_of(2) { 0.0 } else { APART_M / 2.0 };
        let corner = |corner: usize| {
            let angle = TAU * corner as f64 / self.corners as f64;
            let is_inner = matches!(self.shape, Shape::Stars) && corner.is_multiple_of(2);
            let distance_m = RADIUS_M * if is_inner { 0.9 } else { 1.0 };
            let (north, east) = (APART_M * row as f64, APART_M * column as f64 + shift_m);
            Ned::new(north + distance_m * angle.cos(), east + distance_m * angle.sin(), 0.0)
        };
        let (floor_m, ceiling_m) = ([6.0, 20.0, 30.0][index % 3], [40.0, 60.0, 80.0][index / 3 % 3]);
        let (floor_m, ceiling_m) = match self.heights {
            Heights::All => (None, None),
            Heights::Ceilings => (None, Some(ceiling_m)),
            Heights::Floors => (Some(floor_m), None),
            Heights::Bands => (Some(floor_m), Some(ceiling_m)),
        };
        let name = format!("area {index}");
        let kind = if index.is_multiple_of(5) { AreaKind::Permission } else { AreaKind::KeepOut };
        Area { floor_m, ceiling_m, ..Area::new(name, kind, (0..self.corners).map(corner).collect()) }
    }

    pub(crate) fn all_areas(self) -> Vec<Area> {
        (0..self.areas).map(|it| self.area(it)).collect()
    }

    /// Before the first area.
    pub(crate) fn start(self) -> Ned {
        Ned::new(-200.0, -200.0, 0.0)
    }

    /// Closed all round the start, with a hole there.
    pub(crate) fn fence(self) -> Area {
        let start = self.start();
        let square = |half_m: f64| {
            let corner = |(north, east)| Ned::new(start.north_m + half_m * north, start.east_m + half_m * east, 0.0);
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec()
        };
        Area { holes: vec![square(40.0)], ..Area::new("fence", AreaKind::KeepOut, square(70.0)) }
    }

    /// Behind the last one.
    pub(crate) fn goal(self) -> Ned {
        let end_m = APART_M * self.columns() as f64 - 100.0;
        Ned::new(end_m, end_m * 0.8, 0.0)
    }

    /// A planner that has not been asked anything.
    pub(crate) fn planner(self) -> Planner {
        let text = include_str!("../../../config/kittiwake.toml");
        let shipped = toml::from_str::<Shipped>(text).expect("the shipped configuration is one");
        let aircraft = Aircraft { flight: shipped.flight, energy: shipped.energy };
        Planner::new(&shipped.planner, &aircraft, Pace::REAL_TIME)
    }

    /// A mission from one end of the areas to the other.
    fn mission(self, areas: Vec<Area>) -> Mission {
        let (name, position) = ("there".into(), self.goal());
        let there = Objective { name, position, flying: false, terms: Default::default(), survey: None };
        Mission {
            name: "across".into(),
            objectives: vec![there],
            areas,
            order: Default::default(),
            sites: Vec::new(),
            origin: None,
            feeds: Vec::new(),
        }
    }
}

/// The request for the first plan.
pub(crate) fn first_request(world: World) -> v1::ReplanRequest {
    request(world, "first", world.all_areas())
}

fn request(world: World, request_id: &str, areas: Vec<Area>) -> v1::ReplanRequest {
    let basis = Basis::beginning(&world.mission(areas), State::new(world.start(), false), Now::default());
    v1::ReplanRequest { request_id: request_id.to_owned(), basis: Some(basis.into()), ..Default::default() }
}

/// The steps that `planner` answers with.
pub(crate) fn plan(planner: &mut Planner, request: v1::ReplanRequest) -> Vec<v1::PlanStep> {
    let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request: Request::Replan(request) };
    let mut effects = Vec::new();
    planner.on(Now::default(), event, &mut effects);
    let steps = effects.into_iter().find_map(|it| match it {
        Effect::Reply { response: Response::Replan(reply), .. } => match reply.reply {
            Some(v1::replan_reply::Reply::Plan(plan)) => Some(plan.steps),
            other => panic!("{other:?}"),
        },
        _ => None,
    });
    steps.filter(|it| 3 < it.len()).expect("a plan with turns")
}

/// The request for a plan of a mission whose area in the middle lies a metre farther north.
pub(crate) fn with_area_moved(world: World) -> v1::ReplanRequest {
    let mut areas = world.all_areas();
    let middle = areas.len() / 2;
    for corner in &mut areas[middle].corners {
        corner.north_m += 1.0;
    }
    request(world, "changed", areas)
}

/// The first step of a plan that asks for a permission ends with a denial for good: the request for the next plan.
pub(crate) fn denied(world: World, steps: &[v1::PlanStep]) -> v1::ReplanRequest {
    let at = steps.iter().position(|it| !it.ask_permissions.is_empty()).expect("the plan asks for a permission");
    let denial = v1::Denial { area: steps[at].ask_permissions[0].clone(), silent: true, ..Default::default() };
    let first = first_request(world);
    let state = steps[at].goal_state.clone();
    let basis = first.basis.map(|it| v1::PlanningBasis { state, rest: steps[at..].to_vec(), ..it });
    v1::ReplanRequest {
        request_id: "denied".into(),
        basis,
        failed: true,
        failure: "not granted".into(),
        denials: vec![denial],
        ..Default::default()
    }
}

/// The way from the goal back to the start, as a response searches it without any permission; figures as shipped.
pub(crate) fn way_home(world: World, areas: &[Area], map: &AreaMap) -> Option<Vec<Ned>> {
    let limits = FlightLimits {
        speeds: Speeds::calm(10.0, 3.0, 1.5),
        least_height_m: 5.0,
        return_height_m: 15.0,
        highest_m: 120.0,
        clearance_m: 20.0,
        margin_m: 10.0,
        height_clearance_m: 2.0,
    };
    let (grants, clock) = (Grants::new(), Clock { utc_ms: 0, pace: Pace::REAL_TIME });
    let airspace = Airspace {
        areas,
        grants: &grants,
        clock,
        lead: Duration::from_secs(30),
        vertical_margin_m: 2.0,
        ground: &LEVEL,
    };
    let around = Surroundings { airspace, map, limits: &limits, ends_at: SiteKind::Landing };
    around.way_within(world.goal().at_height(15.0), world.start(), MOST_LEGS).way
}
