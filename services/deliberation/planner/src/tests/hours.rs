//! Areas that apply at hours of the week. The stories begin on a Thursday at midnight UTC.

use super::*;

fn hours(texts: &str) -> String {
    format!("hours_utc = [{texts}]")
}

#[test]
fn an_area_counts_if_any_moment_of_the_passage_lies_in_its_hours() {
    #[track_caller]
    fn check_hours(texts: &str, expected_asked: bool) {
        let mut story = Story::of(&across(&area("A", "permission", [200.0, 300.0], &hours(texts))));
        assert_eq!(story.plan().contains("ask A"), expected_asked, "{texts}");
    }
    // It is entered after 23 s and left after 33 s, as planned.
    check_hours("\"Thu 00:00-01:00\"", true);
    check_hours("\"Wed 22:00-00:10\"", true);
    check_hours("\"Mon-Fri 00:00-24:00\"", true);
    check_hours("\"Wed 22:00-24:00\"", false);
    check_hours("\"Thu 12:00-13:00\"", false);
    check_hours("\"Thu 00:04-00:05\"", false);
    check_hours("\"Fri-Wed 00:00-24:00\"", false);
    // Of several hours one is enough.
    check_hours("\"Sat 08:00-09:00\", \"Thu 00:00-00:02\"", true);
}

#[test]
fn a_keep_out_area_whose_hours_begin_on_the_way_is_flown_round() {
    let wall = "[[area]]\nname = \"K\"\nkind = \"keep-out\"\nhours_utc = [\"Thu 00:01-12:00\"]\n\
                corners_m = [[-90.0, 2000.0], [90.0, 2000.0], [90.0, 2100.0], [-90.0, 2100.0]]\n";
    let far = across(wall).replace("east_m = 500", "east_m = 3000");
    check(
        &Story::of(&far).plan(),
        "1 takeoff 10 m
         2 position 100 1990 10
         3 position 100 2110 10
         4 position 0 3000 10
         5 land",
    );
    // Gone through before they begin.
    check(
        &Story::of(&far.replace("00:01", "00:06")).plan(),
        "1 takeoff 10 m
         2 position 0 3000 10
         3 land",
    );
}

#[test]
fn hours_that_are_over_soon_are_waited_for() {
    #[track_caller]
    fn check_closed(texts: &str, expected: &str) -> Story {
        let mut story = Story::of(&across(&area("K", "keep-out", [450.0, 550.0], &hours(texts))));
        check(&story.plan(), expected);
        story
    }
    let mut story = check_closed("\"Wed,Thu 00:00-00:01\"", "hold 61 s: area K is closed for 61 s more");
    check_closed("\"Thu 00:00-00:02\"", "finished");
    check_closed("\"Thu 00:00-24:00\"", "finished");
    // Then it is flown to, although the hours come again next week.
    story.wait(62);
    let plan = story.plan();
    assert!(plan.contains("position 0 500 10") && plan.ends_with("land\n"), "{plan}");
}

#[test]
fn what_ends_elsewhere_is_not_waited_for() {
    #[track_caller]
    fn check_elsewhere(until: &str) {
        let closed = area("K", "keep-out", [450.0, 550.0], &hours("\"Wed,Thu 00:00-00:01\""));
        let elsewhere = area("U", "keep-out", [900.0, 950.0], &format!("until_utc = \"2026-01-01T00:{until}Z\""));
        // K would be over before the end of a way past the corners of U; a shorter wait is sooner.
        check(
            &Story::of(&across(&(closed + &elsewhere))).plan(),
            "hold 22 s: area K is closed for 60 s more: waits 22 s, until 2026-01-01T00:00:22Z, and arrives 58 s sooner than by the \
             way round it",
        );
    }
    check_elsewhere("00:30");
    check_elsewhere("01:40");
    // With the second behind it, that would be longer than anything is waited for.
    check_elsewhere("02:00");
}

#[test]
fn an_area_that_has_closed_meanwhile_takes_no_permission() {
    // The hours come again next week.
    for window in [hours("\"Thu 00:00-00:01\""), "until_utc = \"2026-01-01T00:01:00Z\"".to_owned()] {
        let mut story = Story::of(&across(&area("A", "permission", [200.0, 300.0], &window)));
        assert!(story.plan().contains("position 0 180 10, hold, ask A\n"));
        story.fly(1);
        story.airborne_at([0.0, 100.0, 10.0]);
        story.wait(70);
        story.interrupted = true;
        check(&story.fail(&[]), "5 position 0 500 10\n6 land");
    }
}

#[test]
fn hours_stand_in_the_status_of_the_planner() {
    let mut story = Story::of(&across(&area("A", "permission", [200.0, 300.0], &hours("\"Sat 22:00-02:00\""))));
    assert_eq!(story.status().areas[0].hours_utc, ["Sat 22:00-02:00"]);
}
