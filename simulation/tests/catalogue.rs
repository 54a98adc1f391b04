//! docs/contingencies.md is written from the table, and each row names the story that shows it.
//!
//! `KITTIWAKE_WRITE_DOCS=1` writes the page again.

use std::collections::BTreeMap;
use std::path::Path;

use domain::contingency::group::Group;
use domain::contingency::listing::{HEADINGS, cells, lattice_markdown, markdown_of};
use domain::contingency::snapshot::{Field, Kind};
use domain::contingency::{Contingencies, Row};
use domain::file::Source;
use simulation::proof::hazards;

/// The repository, from this crate.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const PAGE: &str = "docs/contingencies.md";

/// For each row a file and a test in it: the fault or the order, the flag, the response and the outcome.
const STORIES: [(&str, &str, &str); 70] = [
    ("somebody_else_flies", "simulation/tests/others.rs", "a_pilot_who_takes_over_in_any_phase_is_not_fought"),
    ("crashed", "simulation/tests/responses.rs", "a_crash_is_raised_once"),
    (
        "motor_failure",
        "simulation/tests/responses.rs",
        "a_motor_that_fails_is_a_crash_or_a_landing_and_never_a_takeoff_again",
    ),
    ("attitude_exceeded", "simulation/tests/rules.rs", "tilted_too_far_it_lands_where_it_is"),
    ("sinking", "simulation/tests/rules.rs", "a_vehicle_that_falls_is_seen_to_sink"),
    (
        "frame_moved",
        "simulation/tests/others.rs",
        "a_vehicle_whose_frame_has_moved_holds_and_lands_where_it_is_by_an_order",
    ),
    (
        "autopilot_preempts",
        "simulation/tests/others.rs",
        "a_failsafe_of_the_autopilot_is_left_alone_until_an_operator_resumes",
    ),
    ("estimator_lost", "simulation/tests/flights.rs", "a_fault_of_the_vehicle_is_seen_and_answered"),
    (
        "autopilot_comes_down",
        "simulation/tests/others.rs",
        "an_autopilot_that_returns_by_itself_is_left_alone_until_it_has_landed",
    ),
    ("local_position_stale", "simulation/tests/flights.rs", "a_source_that_freezes_and_comes_back_is_waited_for"),
    ("heading_fault", "simulation/tests/cases.rs", "a_heading_that_is_off_slows_it_until_it_is_right_again"),
    ("introspection_lost", "simulation/tests/frozen.rs", "a_monitor_that_hangs_is_noticed_by_the_manager"),
    ("gnss_lost", "simulation/tests/rules.rs", "it_holds_without_satellites_and_flies_on_when_they_are_back_in_time"),
    (
        "attitude_stale",
        "simulation/tests/rules.rs",
        "sources_that_are_silent_for_seconds_are_recorded_and_cost_nothing",
    ),
    ("position_uncertain", "simulation/tests/rules.rs", "a_position_that_is_uncertain_for_a_while_is_recorded"),
    ("position_jumped", "simulation/tests/cases.rs", "a_position_that_jumps_is_not_followed_at_once"),
    ("battery_emergency", "simulation/tests/rules.rs", "the_last_of_the_battery_brings_it_down_at_once"),
    (
        "battery_critical",
        "simulation/tests/flights.rs",
        "once_a_critical_battery_has_brought_it_down_the_vehicle_stays_down",
    ),
    (
        "energy_short",
        "simulation/tests/cases.rs",
        "who_would_come_home_with_less_than_the_reserve_turns_back_while_it_is_so_little",
    ),
    ("battery_low", "simulation/tests/flights.rs", "a_low_battery_brings_the_vehicle_home_and_ends_the_mission"),
    (
        "home_out_of_reach",
        "simulation/tests/cases.rs",
        "behind_the_point_of_no_return_it_flies_on_to_where_the_mission_ends",
    ),
    ("battery_gone", "simulation/tests/flights.rs", "a_fault_of_the_vehicle_is_seen_and_answered"),
    ("battery_stale", "simulation/tests/landing.rs", "nothing_lifts_off_before_the_battery_was_heard"),
    ("battery_hot", "simulation/tests/rules.rs", "a_battery_that_is_too_hot_brings_it_to_the_nearest_fit_place"),
    ("battery_hot_on_ground", "simulation/tests/rules.rs", "hot_on_the_ground_it_waits_until_its_cells_have_cooled"),
    (
        "traffic_near",
        "simulation/tests/rules.rs",
        "it_keeps_out_of_the_way_of_another_aircraft_and_goes_on_once_it_has_passed",
    ),
    (
        "area_ahead",
        "simulation/tests/course.rs",
        "a_border_that_closed_in_front_of_it_is_flown_round_once_it_has_stopped",
    ),
    ("area_breached", "simulation/tests/leaving.rs", "a_paused_vehicle_leaves_an_area_that_is_revoked"),
    ("too_high", "simulation/tests/cases.rs", "who_is_too_high_flies_home_lower"),
    ("wind_too_strong", "simulation/tests/rules.rs", "wind_that_is_too_strong_brings_it_home"),
    ("wind_high", "simulation/tests/rules.rs", "in_much_wind_nothing_takes_off_until_there_is_less"),
    ("gust_too_strong", "simulation/tests/cases.rs", "a_gust_beyond_the_limit_of_a_cruise_brings_it_home"),
    (
        "land_detector_contradicts",
        "simulation/tests/land_detector.rs",
        "nothing_takes_off_with_a_detector_that_reports_the_air_on_the_ground",
    ),
    ("status_stale", "simulation/tests/rules.rs", "sources_that_are_silent_for_seconds_are_recorded_and_cost_nothing"),
    ("gust_at_landing", "simulation/tests/cases.rs", "too_gusty_to_land_it_climbs_holds_and_lands_once_it_is_calm"),
    (
        "vibration_extreme",
        "simulation/tests/cases.rs",
        "a_frame_that_shakes_slows_it_and_one_that_shakes_too_much_brings_it_home",
    ),
    (
        "vibration_high",
        "simulation/tests/cases.rs",
        "a_frame_that_shakes_slows_it_and_one_that_shakes_too_much_brings_it_home",
    ),
    ("offboard_link_lost", "simulation/tests/rules.rs", "a_failsafe_that_misses_our_setpoints_is_ours_to_end"),
    ("autopilot_not_ready", "simulation/tests/others.rs", "nothing_takes_off_until_the_autopilot_would_arm"),
    ("vessel_near", "simulation/tests/course.rs", "a_landing_waits_until_a_ship_below_has_passed"),
    ("drone_near", "simulation/tests/cases.rs", "it_keeps_out_of_the_way_of_a_drone_and_of_a_ship"),
    ("path_deviated", "simulation/tests/course.rs", "who_is_led_beside_its_way_is_told_of_and_flies_on_to_its_place"),
    (
        "consumption_high",
        "simulation/tests/cases.rs",
        "what_the_motors_take_too_much_is_measured_and_counts_for_the_way_home",
    ),
    ("flight_too_long", "simulation/tests/course.rs", "in_the_air_for_an_hour_it_comes_home"),
    ("link_gone", "simulation/tests/rules.rs", "without_contact_for_two_minutes_it_returns"),
    ("link_lost", "simulation/tests/responses.rs", "a_lost_link_does_not_interrupt_a_landing"),
    ("tower_lost", "simulation/tests/cases.rs", "a_tower_that_is_silent_lets_no_new_area_be_entered_until_it_is_back"),
    (
        "skill_manager_lost",
        "simulation/tests/frozen.rs",
        "a_skill_manager_that_hangs_on_the_way_is_stopped_when_it_is_back",
    ),
    ("planner_gone", "simulation/tests/frozen.rs", "without_a_planner_for_a_minute_the_vehicle_returns"),
    ("planner_lost", "simulation/tests/frozen.rs", "who_waits_for_a_plan_holds_until_the_planner_is_back"),
    ("manager_lost", "simulation/tests/frozen.rs", "what_a_hanging_manager_has_ordered_is_flown_and_goes_on_after_it"),
    (
        "clock_jumped",
        "simulation/tests/course.rs",
        "a_clock_that_was_set_is_told_and_lets_no_area_be_entered_for_a_while",
    ),
    ("transition_failed", "services/deliberation/mcm/tests/stories.rs", "a_transition_that_fails_raises_its_flag"),
    ("cancel_ignored", "simulation/tests/cases.rs", "a_skill_that_does_not_end_is_told"),
    ("skill_overruns", "simulation/tests/course.rs", "a_leg_that_takes_too_long_is_told_and_flown_to_its_end"),
    ("battery_faulty", "simulation/tests/cases.rs", "a_battery_that_reports_a_fault_brings_it_to_a_fit_place"),
    ("no_plan", "simulation/tests/course.rs", "with_every_way_closed_it_waits_as_long_as_the_battery_lasts_for_it"),
    ("obstacle", "simulation/tests/flights.rs", "a_flag_that_passes_costs_a_stop_and_a_new_plan"),
    ("operator_abort", "simulation/tests/operator.rs", "an_aborted_mission_lands_where_it_is"),
    ("operator_return", "simulation/tests/operator.rs", "a_vehicle_that_is_ordered_to_return_lands_at_home"),
    ("operator_land", "simulation/tests/operator.rs", "a_vehicle_lands_at_the_place_that_was_ordered"),
    ("operator_pause", "simulation/tests/operator.rs", "a_pause_is_a_pause_and_the_mission_goes_on_to_its_end"),
    ("memory_unusable", "tests/stories/memory.rs", "no_unusable_memory_lets_an_aborted_vehicle_take_off_again"),
    ("memory_unwritable", "tests/stories/memory.rs", "a_disk_that_cannot_be_written_to_lets_nothing_begin"),
    ("operator_silent", "simulation/tests/cases.rs", "a_pause_that_nobody_ends_ends_at_home"),
    (
        "record_unwritable",
        "services/ground/gateway/tests/contract.rs",
        "a_record_that_cannot_be_written_raises_a_flag_and_decides_nothing",
    ),
    ("skill_missing", "simulation/tests/tasks.rs", "nothing_takes_off_for_a_skill_that_nobody_offers"),
    (
        "landing_target_lost",
        "simulation/tests/target.rs",
        "a_target_that_is_lost_at_5_m_is_looked_for_from_above_and_landed_on",
    ),
    (
        "ended_in_air",
        "simulation/tests/responses.rs",
        "a_mission_whose_last_objective_is_in_the_air_ends_at_home_on_the_ground",
    ),
    (
        "skill_failed",
        "simulation/tests/tasks.rs",
        "a_process_that_does_not_do_its_task_fails_the_objective_and_nothing_else",
    ),
];

/// Cases without a row, since a plan, a skill or a step answers them, with what is done: a file and a test in it.
const ANSWERED_ELSEWHERE: [(&str, &str, &str, &str); 16] = [
    (
        "permission denied",
        "the planner flies round the area, or gives the objective inside up and goes on",
        "simulation/tests/flights.rs",
        "denied_areas_are_flown_round_and_an_objective_inside_one_fails",
    ),
    (
        "permission not answered",
        "three tries of 10 s in front of the border, then as denied",
        "simulation/tests/flights.rs",
        "a_silent_tower_counts_as_a_denial",
    ),
    (
        "permission too short for the crossing",
        "a way round, or a new grant that is waited for",
        "simulation/tests/airspace.rs",
        "a_grant_that_is_too_short_for_the_crossing_costs_a_way_round_and_no_zigzag",
    ),
    (
        "permission expiring before the leg ends",
        "asked for again in time; refused, it is left before it ends (`area_breached`)",
        "simulation/tests/leaving.rs",
        "a_permission_whose_renewal_is_refused_is_left_before_it_expires",
    ),
    (
        "area opening on the way",
        "flown round, or asked for; over the vehicle: left before (`area_breached`)",
        "simulation/tests/airspace.rs",
        "an_area_that_opens_on_the_way_is_flown_round_or_asked_for",
    ),
    (
        "not enough energy for the mission",
        "refused before takeoff, with its figures; optional objectives are left out first",
        "simulation/tests/energy.rs",
        "a_mission_of_forty_kilometres_is_refused_before_takeoff",
    ),
    (
        "takeoff failed",
        "tried again with growing pauses, eight times; then the mission is given up on the ground",
        "simulation/tests/airspace.rs",
        "a_takeoff_that_never_succeeds_ends_the_mission",
    ),
    (
        "skill comes no nearer to its goal",
        "it ends as timed out after 30 s, and the mission is planned again from where the vehicle is",
        "services/executive/skill-manager/tests/stories/skills.rs",
        "a_position_skill_that_does_not_reach_its_target_times_out",
    ),
    (
        "landing site blocked",
        "up again, and to the next best place that the energy suffices for",
        "simulation/tests/blocked_landing.rs",
        "in_a_response_the_next_action_of_the_row_is_flown",
    ),
    (
        "load not released",
        "the objective fails, and the mission goes on by its rules",
        "tests/stories/drop.rs",
        "a_gripper_that_is_stuck_fails_the_delivery_and_the_vehicle_returns",
    ),
    (
        "plan that makes no sense",
        "refused before it is flown; the vehicle holds and asks again",
        "services/deliberation/mcm/tests/stories.rs",
        "a_plan_that_makes_no_sense_is_refused_before_it_is_flown",
    ),
    (
        "setpoints lost between two processes",
        "the autopilot loiters; `offboard_link_lost` answers its report",
        "services/functional/vehicle-sim/tests/stories/offboard_loss.rs",
        "it_loiters_when_the_proof_of_life_stops_and_resumes_by_itself",
    ),
    (
        "gateway dead",
        "nothing on board needs it; silent for 10 s it is `link_lost`",
        "tests/stories/disturbances.rs",
        "services_that_die_in_flight_come_back_and_the_mission_flies_on",
    ),
    (
        "mission manager dead",
        "what it has ordered is flown to its end, then the vehicle loiters until it is back",
        "tests/stories/disturbances.rs",
        "a_mission_manager_that_dies_leaves_the_vehicle_safe",
    ),
    (
        "control tower without its ledger",
        "it grants nothing until an operator accepts that",
        "tests/stories/tower.rs",
        "a_tower_whose_ledger_cannot_be_used_says_so_and_grants_nothing_until_an_operator_accepts_that",
    ),
    (
        "no ground to land on below",
        "clear of water or people, else where it is, and it says so",
        "simulation/tests/landing.rs",
        "where_no_ground_is_free_near_by_it_lands_and_says_so",
    ),
];

/// Cases that are flown over real processes, too.
const OVER_PROCESSES: [(&str, &str, &str); 12] = [
    ("`battery_critical`", "tests/stories/disturbances.rs", "a_critical_battery_ends_the_mission_on_the_ground"),
    (
        "`battery_hot`, `wind_too_strong`",
        "tests/stories/disturbances.rs",
        "what_an_expression_raises_ends_the_mission_at_a_landing_place",
    ),
    (
        "`local_position_stale`",
        "tests/stories/disturbances.rs",
        "a_frozen_source_stops_the_vehicle_until_it_is_heard_again",
    ),
    ("`obstacle`", "tests/stories/disturbances.rs", "a_flag_in_flight_stops_the_vehicle_and_the_mission_is_replanned"),
    ("`crashed`", "tests/stories/when_done.rs", "a_crash_is_told_by_the_exit_code"),
    (
        "`land_detector_contradicts`",
        "tests/stories/when_done.rs",
        "a_land_detector_that_reports_the_air_for_ever_does_not_keep_the_system_up",
    ),
    ("`planner_lost`", "tests/stories/hung.rs", "a_planner_that_hangs_is_killed_and_the_mission_is_achieved"),
    (
        "`skill_manager_lost`",
        "tests/stories/hung.rs",
        "an_emergency_action_is_tried_again_when_the_skill_manager_is_back",
    ),
    (
        "`area_breached`",
        "tests/stories/tower.rs",
        "a_vehicle_inside_is_made_to_leave_by_a_tower_that_was_killed_meanwhile",
    ),
    ("`memory_unusable`", "tests/stories/memory.rs", "no_unusable_memory_lets_an_aborted_vehicle_take_off_again"),
    ("`memory_unwritable`", "tests/stories/memory.rs", "a_disk_that_cannot_be_written_to_lets_nothing_begin"),
    (
        "permission denied, not answered",
        "tests/stories/missions.rs",
        "never_answered_it_goes_round_a_gives_b_up_and_returns",
    ),
];

fn text_of(path: &str) -> String {
    std::fs::read_to_string(Path::new(ROOT).join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn shipped() -> Contingencies {
    let config = crate::stories::support::config();
    let trees = mcm::Trees::read(&config.join("trees")).unwrap_or_else(|it| panic!("{it}"));
    let source = Source::read(&config.join("contingencies.toml")).unwrap_or_else(|it| panic!("{it}"));
    Contingencies::read(&source, &trees.actions()).unwrap_or_else(|it| panic!("{it}"))
}

/// The page as the table and the stories make it.
fn page(table: &Contingencies) -> String {
    let stories: BTreeMap<&str, (&str, &str)> =
        STORIES.iter().map(|(flag, file, test)| (*flag, (*file, *test))).collect();
    let shown_by = |file: &str, test: &str| format!("`{test}` in `{file}`");
    let case_and_source = |row: &Row| {
        let [case @ .., source] = cells(row);
        let (file, test) = stories.get(row.flag.as_str()).unwrap_or_else(|| panic!("no story for `{}`", row.flag));
        let source = vec![case[0].clone(), source, shown_by(file, test)];
        (Vec::from(case), source)
    };
    let (cases, sources): (Vec<_>, Vec<_>) = table.rows().iter().map(case_and_source).unzip();
    let [headings @ .., source_heading] = HEADINGS;
    let elsewhere = ANSWERED_ELSEWHERE
        .map(|(case, answer, file, test)| vec![case.to_owned(), answer.to_owned(), shown_by(file, test)]);
    let over_processes = OVER_PROCESSES.map(|(case, file, test)| vec![case.to_owned(), shown_by(file, test)]);
    let fields: Vec<Vec<String>> = Field::ALL.iter().copied().map(field).collect();
    format!(
        "# Contingencies\n\nWritten from `config/contingencies.toml` by the test in `simulation/tests/catalogue.rs`, which fails when this \
         page differs;\n`KITTIWAKE_WRITE_DOCS=1` has it write the page again. `kittiwake check --print-contingencies` prints the table of \
         your own\nfiles.\n\n## Cases\n\nMost urgent first: of equally severe responses that of the upper row is flown. Thresholds hold for \
         as long as is said before the\nflag is raised. What \"counts\" are the phases in which a flag is answered; in the others it is shown \
         and recorded.\nWhat a row \"narrows\" is forbidden for as long as its flag is up, in every phase and whichever row responds.\n\n{}\n## \
         Sources and stories\n\nWhere the numbers of each case come from, and a story that shows the case.\n\n{}\n## \
         Order of responses\n\nOf the rows whose flags are up, the most severe one is flown, and comfort after safety: without comfort the mission is \
         worse, and nobody\nis harmed. No order comes before a binding row; one with override comes before safety, any order before comfort. What is less \
         severe waits,\nbut for what it narrows. A response that is impossible now is skipped with its reason.\n\n{}\n## Answered without a row\n\nBy the plan, by a \
         skill, or by a step; what is left of them when that fails is a row above.\n\n{}\n## Over real processes\n\nThe stories above fly \
         on a virtual clock, but those below in `tests/`: with a process for each service, and a bus between them.\n\n{}\n## Hazards\n\nWhat every table must answer in each of these phases, or waive with a reason \
         (`crates/domain/src/contingency/hazard/list.rs`), and what\nanswers it in this one (`simulation/src/proof/hazards.rs`).\n\n{}\n## Fields\n\nWhat an expression (`when`, \
         `clear_when`) can read. A constant beyond the range of the field that it is compared with is a\nmistake.\n\n{}",
        markdown_of(&headings, &cases),
        markdown_of(&["flag", source_heading, "shown by"], &sources),
        lattice_markdown(),
        markdown_of(&["case", "answer", "shown by"], &elsewhere),
        markdown_of(&["case", "shown by"], &over_processes),
        markdown_of(&hazards::HEADINGS, &hazards::answers(table)),
        markdown_of(&["field", "unit or names", "range", "what it is"], &fields),
    )
}

fn field(field: Field) -> Vec<String> {
    let (unit, range) = match field.kind() {
        Kind::Number { unit, least, most } => (unit.to_string(), format!("{least} to {most}")),
        Kind::Choice(names) => (names.join(", "), String::new()),
    };
    vec![format!("`{}`", field.name()), unit, range, field.meaning().to_owned()]
}

#[test]
fn the_page_is_what_the_table_says() {
    let expected = page(&shipped());
    if std::env::var_os("KITTIWAKE_WRITE_DOCS").is_some() {
        std::fs::write(Path::new(ROOT).join(PAGE), &expected).unwrap();
    }
    let written = text_of(PAGE);
    let differs = written.lines().zip(expected.lines()).position(|(found, wanted)| found != wanted);
    assert!(
        written == expected,
        "{PAGE} differs from the table, first in line {:?}; KITTIWAKE_WRITE_DOCS=1 writes it again",
        differs.map(|line| line + 1)
    );
}

#[test]
fn every_row_has_a_group_and_every_group_has_a_row() {
    let table = shipped();
    for row in table.rows() {
        assert!(row.group.is_some(), "`{}` has no group", row.flag);
    }
    for group in Group::ALL {
        assert!(table.rows().iter().any(|row| row.group == Some(group)), "no row is about {group}");
    }
}

#[test]
fn every_row_has_a_story_that_exists() {
    let table = shipped();
    let flags: Vec<&str> = table.rows().iter().map(|row| row.flag.as_str()).collect();
    assert_eq!(STORIES.map(|(flag, ..)| flag).to_vec(), flags, "stories are in the order of the table");
    let elsewhere = ANSWERED_ELSEWHERE.map(|(case, _, file, test)| (case, file, test));
    for (flag, file, test) in STORIES.into_iter().chain(elsewhere).chain(OVER_PROCESSES) {
        assert!(text_of(file).contains(&format!("fn {test}()")), "{flag}: there is no `{test}` in {file}");
    }
}
