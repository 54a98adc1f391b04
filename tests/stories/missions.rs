//! The reference mission under each permission policy: which steps, in which order, to which end.

use crate::support::{Ending, System};

/// The steps that were begun, in order, without their numbers.
fn steps(ending: &Ending) -> Vec<String> {
    let begun = |it: String| Some(it.strip_prefix("step ")?.split_once(" of ")?.1.split_once(": ")?.1.to_owned());
    ending.story("step").into_iter().filter_map(begun).collect()
}

#[track_caller]
fn check(policy: &str, code: i32, objectives: [&str; 2], expected: &[&str]) -> Ending {
    // A machine that is too busy for a speed flies other steps.
    let ending = System::start(&["--permissions", policy, "--speed", "8"]).end();
    ending.expect(code, &objectives);
    assert_eq!(steps(&ending), expected, "it said:\n{}", ending.lines.join("\n"));
    ending
}

const STRAIGHT_THERE_AND_BACK: [&str; 8] = [
    "takeoff by 10 m",
    "fly to (0, 90, 10), asking A",
    "fly to (0, 360, 10), asking B",
    "fly to (0, 500, 10)",
    "land",
    "takeoff by 10 m",
    "fly to (0, 0, 10)",
    "land",
];

#[test]
fn granted_at_once_it_flies_straight() {
    let ending = check("grant", 0, ["SUCCESS", "SUCCESS"], &STRAIGHT_THERE_AND_BACK);
    let report = ending.report();
    assert_eq!(report["outcome"], "MISSION_OUTCOME_SUCCESS");
    assert_eq!(report["vehicle"], "uav1");
    assert_eq!(report["objectives"][0]["name"], "deliver");
    assert_eq!(report["objectives"][0]["planSteps"], 5);
    assert_eq!(report["objectives"][0]["permissions"], serde_json::json!(["A", "B"]));
    let duration_s = report["durationS"].as_f64().unwrap();
    assert!((120.0..240.0).contains(&duration_s), "{duration_s} s for a kilometre at 10 m/s");
}

#[test]
fn granted_after_a_delay_it_flies_the_same() {
    check("delay", 0, ["SUCCESS", "SUCCESS"], &STRAIGHT_THERE_AND_BACK);
}

#[test]
fn denied_it_goes_round_a_asks_once_more_for_b_and_returns() {
    let ending = System::start(&["--permissions", "deny"]).end();
    ending.expect(3, &["FAILURE", "SUCCESS"]);
    let asked: Vec<_> = ending.story("permission").into_iter().filter(|it| it.starts_with("asking")).collect();
    assert_eq!(asked, ["asking for area A", "asking for area B ahead", "asking for area B"]);
    assert!(!steps(&ending).contains(&"fly to (0, 500, 10)".into()), "never into B");
    let report = ending.report();
    assert_eq!(report["outcome"], "MISSION_OUTCOME_FAILURE");
    let reason = report["objectives"][0]["reason"].as_str().unwrap();
    assert!(reason.contains("area B: denied twice"), "{reason}");
}

#[test]
fn denied_at_random_the_seed_decides_and_the_mission_goes_on() {
    // Seed 1 draws: A denied, B denied, B granted when it is asked again.
    let ending = System::start(&["--permissions", "random", "--seed", "1"]).end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    let decided: Vec<_> = ending.story("permission").into_iter().filter(|it| it.starts_with("area")).collect();
    assert_eq!(
        decided,
        ["area A: denied (the area is closed)", "area B: denied (the area is closed)", "area B: granted"]
    );
}

#[test]
fn never_answered_it_goes_round_a_gives_b_up_and_returns() {
    let ending = System::start(&["--permissions", "silent"]).end();
    ending.expect(3, &["FAILURE", "SUCCESS"]);
    let report = ending.report();
    let reason = report["objectives"][0]["reason"].as_str().unwrap();
    assert!(reason.contains("area B: no answer from the control tower"), "{reason}");
    assert!(report["reason"].as_str().unwrap().contains("deliver"), "{report}");
}

#[test]
fn two_systems_fly_side_by_side() {
    let granted = System::start(&[]);
    let denied = System::start(&["--permissions", "silent", "--vehicle", "uav2"]);
    let (granted, denied) = (granted.end(), denied.end());
    granted.expect(0, &["SUCCESS", "SUCCESS"]);
    denied.expect(3, &["FAILURE", "SUCCESS"]);
    assert_eq!(denied.report()["vehicle"], "uav2");
}
