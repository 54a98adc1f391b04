//! What an upload does to airspace that belongs to the ground.

use super::*;
use v1::mission_request::Request as Ask;

/// Home again, with these areas.
fn home(areas: &str) -> String {
    format!(
        "name = \"back\"\n[[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n{areas}"
    )
}

fn upload(text: &str) -> Ask {
    Ask::Upload(v1::MissionText { text: text.into(), wind: None })
}

fn feed(issued: &str) -> String {
    format!("[[feed]]\nname = \"z.json\"\nissued_utc = \"{issued}T00:00:00Z\"\n")
}

fn closed(area: &str) -> Vec<v1::ClosedArea> {
    vec![v1::ClosedArea { area: area.into(), decision: UTC_START_MS as u64 }]
}

/// `present` is under way, and the tower has closed A. The answer to an upload of `text`, and the areas then, with their sources.
#[track_caller]
fn check(present: &str, text: &str, expected: &str, areas: &str) {
    let mut story = Story::under_way(present);
    story.closed = closed("A");
    let reply = story.ask(upload(text));
    assert!(reply.text.contains(expected), "expected `{expected}`: {} {:?}", reply.text, reply.mistakes);
    let status = story.status();
    let source = |index: usize| {
        let feed = status.feeds.iter().find(|it| it.areas.contains(&(index as u32)));
        feed.map_or(String::new(), |it| format!(" ({})", it.name))
    };
    let listed: Vec<String> =
        status.areas.iter().enumerate().map(|(index, it)| format!("{}{}", it.name, source(index))).collect();
    assert_eq!(listed.join(", "), areas, "{}", reply.text);
}

#[test]
fn no_upload_leaves_out_what_the_tower_has_closed() {
    let with_a = |east_m, kind, more| home(&area("A", kind, east_m, more));
    let (taken, other) = ("takes the place of", "area `A` is another one than that of the control tower");
    check(REFERENCE, &home(""), "; not listed, and stays: A", "A (control tower)");
    check(REFERENCE, &with_a([110.0, 290.0], "permission", ""), taken, "A (control tower)");
    // To a centimetre, as the page writes it.
    check(REFERENCE, &with_a([110.0, 290.0], "permission", "").replace("290.0", "290.004"), taken, "A (control tower)");
    check(REFERENCE, &with_a([110.0, 280.0], "permission", ""), other, "A, B");
    check(REFERENCE, &with_a([110.0, 290.0], "permission", "floor_m = 50.0"), other, "A, B");
    check(REFERENCE, &with_a([110.0, 290.0], "permission", "until_utc = \"2026-01-01T00:00:01Z\""), other, "A, B");
    // Neither a floor nor a ceiling moves.
    let high = |heights: &str| home(&area("A", "permission", [110.0, 290.0], heights));
    let present = high("floor_m = 50.0\nceiling_m = 80.0").replace("north_m = 0", "north_m = 200");
    check(&present, &high("floor_m = 50.004\nceiling_m = 79.996"), taken, "A (control tower)");
    check(&present, &high("floor_m = 51.0\nceiling_m = 80.0"), other, "A");
    check(&present, &high("floor_m = 50.0\nceiling_m = 79.0"), other, "A");
    check(&present, &high("floor_m = 50.0"), other, "A");
    // Of others the mission disposes.
    let elsewhere = home(&area("B", "permission", [700.0, 800.0], ""));
    check(REFERENCE, &elsewhere, "stays: A", "B, A (control tower)");
}

#[test]
fn what_the_tower_has_closed_stays_until_it_opens_it_however_many_uploads_follow() {
    let mut story = Story::under_way(REFERENCE);
    story.closed = closed("A");
    let areas = |story: &mut Story| story.status().areas.iter().map(|it| it.name.clone()).collect::<Vec<_>>().join(" ");
    for text in [home(""), KEEP_OUT.to_owned(), home("")] {
        let reply = story.ask(upload(&text));
        assert!(reply.accepted && areas(&mut story).contains('A'), "{}", reply.text);
    }
    // The next edition of a data set does not open it either.
    let edition = format!("name = \"x\"\n{}", feed("2026-01-01"));
    let reply = story.ask(Ask::AdoptAirspace(v1::MissionText { text: edition, wind: None }));
    assert!(reply.accepted, "{}", reply.text);
    assert_eq!(areas(&mut story), "A");
    story.closed.clear();
    assert!(story.ask(upload(&home(""))).accepted);
    assert_eq!(areas(&mut story), "");
}

#[test]
fn only_a_later_edition_replaces_what_a_data_set_has_set() {
    let of_feed =
        |name: &str, east_m, more: &str| area(name, "keep-out", east_m, &format!("feed = \"z.json\"\n{more}"));
    let zone = |issued: &str, name: &str| format!("{}{}", feed(issued), of_feed(name, [700.0, 800.0], ""));
    let present = format!("{REFERENCE}{}", zone("2025-06-01", "Z"));
    let stays = "; not listed, and stays: A, Z";
    check(&present, &home(""), stays, "A (control tower), Z (z.json)");
    check(&present, &home(&zone("2025-06-01", "Y")), stays, "Y (z.json), A (control tower), Z (z.json)");
    check(&present, &home(&zone("2025-05-01", "Y")), stays, "Y (z.json), A (control tower), Z (z.json)");
    check(&present, &home(&zone("2025-07-01", "Y")), "stays: A", "Y (z.json), A (control tower)");
    // One that is not to be used yet replaces nothing.
    let early = zone("2025-07-01", "Y").replace("issued_utc", "valid_from_utc = \"2026-01-02T00:00:00Z\"\nissued_utc");
    check(&present, &home(&early), stays, "Y (z.json), A (control tower), Z (z.json)");
    let moved = format!("{}{}", feed("2025-06-01"), of_feed("Z", [710.0, 800.0], ""));
    check(&present, &home(&moved), "area `Z` is another one than that of feed `z.json`", "A, B, Z (z.json)");
    let moved = format!("{}{}", feed("2025-07-01"), of_feed("Z", [710.0, 800.0], ""));
    check(&present, &home(&moved), "stays: A", "Z (z.json), A (control tower)");
}

#[test]
fn of_very_many_areas_that_stay_some_are_named() {
    let set: String =
        (0..25).map(|n| area(&format!("Z{n:02}"), "keep-out", [700.0, 800.0], "feed = \"z.json\"")).collect();
    let mut story = Story::under_way(&format!("{REFERENCE}{}{set}", feed("2025-06-01")));
    let reply = story.ask(upload(&home("")));
    assert!(reply.text.ends_with("Z19 and 5 more areas"), "{}", reply.text);
    // All of them together are no more than a file may have.
    let others: String = (0..1_990).map(|n| area(&format!("Y{n}"), "keep-out", [900.0, 950.0], "")).collect();
    let reply = story.ask(upload(&home(&others)));
    assert!(
        reply.text.starts_with("the mission would have 2015 areas with 8060 corners, at most 2000"),
        "{}",
        reply.text
    );
}

#[test]
fn an_area_of_an_upload_does_not_lie_over_the_vehicle() {
    #[track_caller]
    fn check(text: &str, expected: &str) {
        let mut story = Story::under_way(REFERENCE);
        let before = story.status();
        let reply = story.ask(upload(text));
        assert!(reply.text.contains(expected), "expected `{expected}`: {}", reply.text);
        assert_eq!(reply.accepted, story.status() != before);
    }
    // It is 50 m to the east, and its mission ends to the north.
    let north = |areas: &str| home(areas).replace("north_m = 0", "north_m = 200");
    let over = |kind, more: &str| north(&area("over", kind, [20.0, 80.0], more));
    let out = ": fly it out first, or leave the area out";
    check(&over("keep-out", ""), &format!("the vehicle is inside keep-out area `over`{out}"));
    check(&over("permission", ""), &format!("the vehicle is inside area `over` without a permission{out}"));
    check(&over("keep-out", "floor_m = 50.0"), "takes the place of");
    check(&over("keep-out", "from_utc = \"2026-01-01T01:00:00Z\""), "takes the place of");
    // What a data set says counts at once.
    let set = north(&format!("{}{}", feed("2026-01-01"), area("over", "keep-out", [20.0, 80.0], "feed = \"z.json\"")));
    check(&set, "the vehicle is inside keep-out area `over`, and leaves it");
}
