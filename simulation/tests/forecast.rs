//! The energy that is forecast before a mission against what the simulated vehicle uses on it, in ten winds.
//!
//! `KITTIWAKE_WRITE_DOCS=1` writes the table in docs/planning.md again. The vehicle has no parameter of the model: it has thrust, drag, and
//! cells with a resistance.

use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::aircraft::Aircraft;
use domain::energy::EnergyModel;
use domain::file::Source;
use domain::mission::Mission;
use domain::time::{Now, Pace};
use kittiwake_proto::v1;
use kittiwake_proto::v1::mission_request::Request as Ask;
use planner::Planner;

use crate::stories::support::{config, mission_file, simulation};

/// Between the lines of the page that the test writes.
const BEGIN: &str = "<!-- forecast -->\n";
const END: &str = "<!-- end of forecast -->";
const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/planning.md");
/// No forecast says less than is used by more than this, in per cent. (ENG: the reserve is 25 % of the battery; a mission that uses all the rest
/// would take less than a third of that.)
const TOO_BOLD_PERCENT: f64 = 10.0;
/// Nor more by more than this: a mission that can be flown would be refused.
const TOO_CAREFUL_PERCENT: f64 = 25.0;

#[derive(serde::Deserialize)]
struct Sections {
    planner: planner::config::Config,
    flight: domain::aircraft::Flight,
    energy: EnergyModel,
}

/// To the far place, at a height, and back to the ground at home: metres north, east and up.
type Flight = (f64, f64, f64);

/// A flight, the speed of the wind in m/s, and the direction it comes from in degrees.
const FLIGHTS: [(Flight, f64, f64); 10] = [
    ((0.0, 1500.0, 20.0), 0.0, 0.0),
    ((0.0, 1500.0, 20.0), 5.0, 90.0),
    ((0.0, 1500.0, 20.0), 9.0, 90.0),
    ((0.0, 1500.0, 20.0), 9.0, 270.0),
    ((0.0, 1500.0, 20.0), 9.0, 0.0),
    ((900.0, -1200.0, 60.0), 7.0, 225.0),
    ((-2500.0, 0.0, 100.0), 6.0, 180.0),
    ((2000.0, 2000.0, 40.0), 8.0, 45.0),
    ((300.0, 100.0, 80.0), 9.0, 300.0),
    ((0.0, -3500.0, 30.0), 4.0, 135.0),
];

fn text((north_m, east_m, height_m): Flight) -> String {
    format!(
        "name = \"there and back\"\n\
         [[objective]]\nname = \"there\"\nnorth_m = {north_m:.1}\neast_m = {east_m:.1}\nheight_m = {height_m:.1}\nflying = true\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n"
    )
}

/// What `kittiwake plan --wind` forecasts, in Wh.
fn forecast_wh(sections: &Sections, text: &str, speed_m_s: f64, from_deg: f64) -> f64 {
    let source = Source { path: "mission.toml".into(), text: text.to_owned() };
    let mission = Mission::read(&source).unwrap_or_else(|it| panic!("{it}"));
    let aircraft = Aircraft { flight: sections.flight, energy: sections.energy };
    let mut planner = Planner::new(&sections.planner, &aircraft, Pace::REAL_TIME);
    let state = v1::PlanningState { position: Some(v1::Ned::default()), charge: Some(1.0), ..Default::default() };
    let wind = Some(v1::ForecastWind { speed_m_s, from_deg: Some(from_deg) });
    let request = v1::MissionRequest {
        state: Some(state),
        request: Some(Ask::Validate(v1::MissionText { text: text.to_owned(), wind })),
        ..Default::default()
    };
    let reply = planner.try_out(&mission, request, Now::default());
    assert!(reply.accepted, "{reply:?}");
    reply.forecast.iter().map(|it| it.energy_wh).sum()
}

/// What the simulated vehicle uses from the takeoff to the end of the mission, in Wh.
fn used_wh(text: &str, speed_m_s: f64, from_deg: f64) -> f64 {
    let path = mission_file("forecast", text);
    let mut simulation = simulation(Some(&path), Policy::Grant);
    let blows_to = (from_deg + 180.0).to_radians();
    let wind = [blows_to.cos() * speed_m_s, blows_to.sin() * speed_m_s].map(|it| format!("{it:.3}"));
    simulation.inject_fault("wind", &[&wind[0], &wind[1]]);
    assert!(simulation.fly_until("takeoff", Duration::from_secs(60)), "{}", simulation.decision_log());
    let before = simulation.charge().expect("it is heard");
    let report = simulation.fly(Duration::from_secs(1800)).unwrap_or_else(|| panic!("{}", simulation.decision_log()));
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "{}", simulation.decision_log());
    (before - simulation.charge().expect("it is heard")) * 300.0
}

#[test]
fn a_forecast_is_within_a_few_per_cent_of_what_is_used_in_ten_winds() {
    let sections: Sections = Source::read(&config().join("kittiwake.toml")).unwrap().parse().unwrap();
    let mut lines = vec![
        "| there and back, north, east, up | wind | forecast | used | error |".to_owned(),
        "|---|---|---|---|---|".to_owned(),
    ];
    let mut errors = Vec::new();
    for (flight, speed_m_s, from_deg) in FLIGHTS {
        let text = text(flight);
        let (forecast, used) =
            (forecast_wh(&sections, &text, speed_m_s, from_deg), used_wh(&text, speed_m_s, from_deg));
        let error = (forecast - used) / used * 100.0;
        let (north_m, east_m, height_m) = flight;
        lines.push(format!(
            "| {north_m:.0}, {east_m:.0}, {height_m:.0} m | {speed_m_s:.0} m/s from {from_deg:.0}° | {forecast:.0} Wh | {used:.0} Wh | {error:+.0} % |"
        ));
        errors.push(error);
    }
    let table = lines.join("\n");
    assert!(errors.iter().all(|it| -TOO_BOLD_PERCENT <= *it && *it <= TOO_CAREFUL_PERCENT), "{errors:?}\n{table}");
    let page = std::fs::read_to_string(Path::new(PAGE)).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("the page has a place for the table");
    let (written, after) = rest.split_once(END).expect("the place has an end");
    let expected = format!("\n{table}\n\n");
    if std::env::var_os("KITTIWAKE_WRITE_DOCS").is_some() {
        std::fs::write(Path::new(PAGE), format!("{before}{BEGIN}{expected}{END}{after}")).unwrap();
    } else {
        assert_eq!(written, expected, "{PAGE} differs; KITTIWAKE_WRITE_DOCS=1 writes it again");
    }
}
