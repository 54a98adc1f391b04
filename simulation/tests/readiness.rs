//! A place to land at that must be ready: asked for, waited for, given up, and lost in the approach.

use control_tower::policy::Policy;
use kittiwake_proto::v1::{Deck, MissionOutcome};
use simulation::Simulation;

use crate::stories::support::story::{ends, s, when_flown};
use crate::stories::support::{config, simulation};

/// To a simulated turbine, whose rotor takes 25 s to stop.
fn turbine() -> Simulation<'static> {
    simulation(Some(&config().join("missions/turbine.toml")), Policy::Grant)
}

const TURNS: &str = "area site wt12: requested (not ready: the rotor still turns)";
const OCCUPIED: &str = "area site wt12: requested (not ready: the deck is occupied)";
const GRANTED: &str = "area site wt12: granted";

#[test]
fn it_is_landed_once_the_rotor_stands_still() {
    let expected =
        ["asking for area site wt12", TURNS, GRANTED, "step 3 of 4: fly to (0, 400, 10)", "step 4 of 4: land"];
    ends(turbine(), MissionOutcome::Success, &expected);
}

#[test]
fn a_deck_that_is_cleared_in_time_is_waited_for() {
    let mut simulation = turbine();
    simulation.report_deck(Deck::Occupied);
    let mut simulation = when_flown(simulation, "area site wt12: denied");
    simulation.pass(s(5));
    simulation.report_deck(Deck::Clear);
    ends(simulation, MissionOutcome::Success, &[TURNS, OCCUPIED, GRANTED, "step 2 of 2: land"]);
}

#[test]
fn a_deck_that_stays_occupied_is_given_up_for_what_comes_next() {
    let mut simulation = turbine();
    simulation.report_deck(Deck::Occupied);
    ends(
        simulation,
        MissionOutcome::Failure,
        &[
            TURNS,
            OCCUPIED,
            "hold for 30 s: area site wt12: denied by the control tower: not ready: the deck is occupied",
            "step 1 of 2: fly to (0, 0, 10)",
            "objective `wt12` failed: area site wt12: denied twice by the control tower: not ready: the deck is occupied",
        ],
    );
}

#[test]
fn a_site_that_is_lost_in_the_approach_is_left_and_landed_at_once_it_is_ready_again() {
    let mut simulation = when_flown(turbine(), GRANTED);
    while simulation.position().is_none_or(|it| it.east_m < 399.0 || 5.0 < -it.down_m) {
        simulation.pass(s(1));
    }
    simulation.report_deck(Deck::Occupied);
    simulation.pass(s(30));
    let away_m = simulation.position().map(|it| it.north_m.hypot(it.east_m - 400.0));
    assert!(away_m.is_some_and(|it| 80.0 < it), "{away_m:?}\n{}", simulation.decision_log());
    simulation.report_deck(Deck::Clear);
    ends(
        simulation,
        MissionOutcome::Success,
        &[GRANTED, "revoked (not ready: the deck is occupied)", "leave_area", GRANTED, "step 3 of 3: land"],
    );
}
