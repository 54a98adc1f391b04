//! New editions of the data sets that areas came from, while a mission is flown.

use super::*;
use v1::mission_request::Request as Ask;

/// An edition with these areas.
fn edition(issued: &str, areas: &str) -> v1::MissionText {
    let text = format!("name = \"x\"\n[[feed]]\nname = \"z.json\"\nissued_utc = \"{issued}T00:00:00Z\"\n{areas}");
    v1::MissionText { text, wind: None }
}

fn of_feed(name: &str, east_m: [f64; 2]) -> String {
    area(name, "keep-out", east_m, "feed = \"z.json\"")
}

fn names(status: &v1::MissionStatus) -> Vec<&str> {
    status.areas.iter().map(|it| it.name.as_str()).collect()
}

#[test]
fn only_the_areas_of_feeds_are_replaced_and_what_was_done_stays_done() {
    let mut story = Story::under_way(REFERENCE);
    assert!(story.ask(Ask::Skip(v1::SkipObjective { name: "deliver".into() })).accepted);
    let (before, voids) = (story.status(), story.voids);
    let first = edition("2026-01-01", &of_feed("Z", [700.0, 800.0]));
    let tried = story.ask(Ask::ValidateAirspace(first.clone()));
    let told =
        "new airspace would be adopted; feed `z.json`, issued 2026-01-01T00:00:00Z (1 areas) in place of no feed";
    assert_eq!((tried.accepted, tried.text.as_str()), (true, told));
    assert_eq!(tried.forecast.iter().map(|it| it.objective.as_str()).collect::<Vec<_>>(), ["return"]);
    assert_eq!(story.status(), before, "it was only tried");

    assert!(story.ask(Ask::AdoptAirspace(first)).accepted);
    let after = story.status();
    assert_eq!((names(&after), after.feeds[0].areas.as_slice()), (vec!["A", "B", "Z"], &[2][..]));
    assert_eq!((&after.objectives, story.voids), (&before.objectives, voids + 1));

    let second = edition("2026-02-01", &of_feed("Y", [700.0, 800.0]));
    let reply = story.ask(Ask::AdoptAirspace(second.clone()));
    let told = "new airspace adopted; feed `z.json`, issued 2026-02-01T00:00:00Z (1 areas) in place of feed `z.json`, \
                issued 2026-01-01T00:00:00Z (1 areas)";
    assert_eq!((reply.accepted, reply.text.as_str()), (true, told));
    let voids = story.voids;
    assert_eq!(names(&story.status()), ["A", "B", "Y"]);
    // The same areas again leave the plan as it is.
    assert!(story.ask(Ask::AdoptAirspace(v1::MissionText { text: second.text + "\n# again\n", wind: None })).accepted);
    assert_eq!(story.voids, voids);
}

#[test]
fn airspace_that_the_mission_cannot_be_flown_in_is_refused_and_the_old_one_stays() {
    #[track_caller]
    fn check(text: &str, expected: &str) {
        let mut story = Story::under_way(REFERENCE);
        let before = story.status();
        let reply = story.ask(Ask::AdoptAirspace(v1::MissionText { text: text.into(), wind: None }));
        let told = format!("{}\n{}", reply.text, reply.mistakes.join("\n"));
        assert!(!reply.accepted && told.contains(expected), "expected `{expected}`: {told}");
        assert_eq!(story.status(), before);
    }
    let with = |areas: &str| edition("2026-01-01", areas).text;
    check(&with(&of_feed("Z", [450.0, 550.0])), "objective `deliver`: keep-out area Z: it cannot");
    let window = "feed = \"z.json\"\nuntil_utc = \"2027-01-01T00:00:00Z\"";
    check(&with(&area("Z", "keep-out", [450.0, 550.0], window)), "objective `deliver`: ");
    check(
        &with(&of_feed("Z", [-50.0, 50.0])),
        "objective `return` lies in keep-out area `Z`, which always applies; skip",
    );
    check(&with(&of_feed("A", [700.0, 800.0])), "the mission has an area `A` of its own already");
    let origin = "[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\n";
    check(&format!("{}{origin}", with("")), "the origin in the text is not that of the present mission");
    check(&with(&of_feed("Z", [700.0, 800.0])).replace("feed = \"z.json\"", "feed = \"y\""), "names feed `y`");
}

#[test]
fn a_landing_site_that_new_airspace_takes_is_told_and_the_airspace_is_adopted() {
    let site = "[[site]]\nkind = \"landing\"\nname = \"quay\"\nnorth_m = 0.0\neast_m = 750.0\nheight_m = 0.0\n";
    let mut story = Story::under_way(&format!("{REFERENCE}{site}"));
    let reply = story.ask(Ask::AdoptAirspace(edition("2026-01-01", &of_feed("Z", [700.0, 800.0]))));
    assert!(reply.accepted && reply.text.contains("site `quay` "), "{}", reply.text);
}

#[test]
fn airspace_after_the_end_is_left_to_the_next_mission() {
    let mut story = Story::under_way(REFERENCE);
    story.end = ("`operator_abort`".into(), true, false);
    let reply = story.ask(Ask::AdoptAirspace(edition("2026-01-01", "")));
    assert_eq!(reply.text, "`operator_abort`: upload the next mission with the new airspace");
}

#[test]
fn an_upload_says_which_editions_come_and_go_and_whether_they_are_out_of_date() {
    let mut story = Story::of(REFERENCE);
    let old = "[[feed]]\nname = \"z.json\"\nvalid_until_utc = \"2025-12-31T00:00:00Z\"\n";
    let reply = story.ask(Ask::Upload(v1::MissionText { text: format!("{REFERENCE}{old}"), wind: None }));
    let told =
        "feed `z.json`, valid until 2025-12-31T00:00:00Z (0 areas) in place of no feed; feed `z.json` is OUT OF DATE";
    assert!(reply.accepted && reply.text.contains(told), "{}", reply.text);
}
