//! What an operator may do to a mission while it is flown.

use super::*;
use v1::mission_request::Request as Ask;

impl Story {
    pub(super) fn ask(&mut self, request: Ask) -> v1::MissionReply {
        let request = v1::MissionRequest {
            request_id: String::new(),
            operator: "anna".into(),
            state: Some(self.state.clone()),
            request: Some(request),
        };
        let (ends, is_flown, next_waits) = self.end.clone();
        let request = v1::EditRequest {
            basis: Some(self.basis(true)),
            request: Some(request),
            ends,
            is_flown,
            next_waits,
            closed: self.closed.clone(),
        };
        let Some(Response::Edit(edited)) = self.request(Request::Edit(request)) else { panic!("no reply") };
        if let Some(it) = course(edited.mission, edited.notes).unwrap() {
            self.go_on(it);
        }
        if let Some(areas) = edited.areas {
            self.areas = MissionAreas::decode(areas).unwrap();
        }
        if edited.voids_plan {
            self.voids += 1;
            self.steps.clear();
            self.flown.clear();
        }
        edited.reply.unwrap()
    }

    /// The first step is under way, 50 m to the east.
    pub(super) fn under_way(text: &str) -> Story {
        let mut story = Story::of(text);
        story.plan();
        story.fly(1);
        story.airborne_at([0.0, 50.0, 10.0]);
        story
    }
}

fn text(text: &str) -> v1::MissionText {
    v1::MissionText { text: text.into(), wind: None }
}

fn insert(index: u32, name: &str, east_m: f64) -> Ask {
    let position = Some(v1::Ned { east_m, down_m: -10.0, ..Default::default() });
    let objective = Some(v1::NewObjective { name: name.into(), position, flying: true });
    Ask::Insert(v1::InsertObjective { index, objective })
}

fn remove(name: &str) -> Ask {
    Ask::Remove(v1::RemoveObjective { name: name.into() })
}

fn skip(name: &str) -> Ask {
    Ask::Skip(v1::SkipObjective { name: name.into() })
}

/// Asks while the reference mission is under way; what is left of the mission, and how often its plan became void, then.
#[track_caller]
fn check(ask: Ask, accepted: bool, words: &str, objectives: &[&str], voids: u64) {
    let mut story = Story::under_way(REFERENCE);
    let reply = story.ask(ask);
    assert_eq!((reply.accepted, reply.text.as_str()), (accepted, words));
    let status = story.status();
    assert_eq!(story.voids, voids);
    let word = |it: &v1::Objective| match it.state() {
        v1::ObjectiveState::Failure => format!("{} ({})", it.name, it.reason),
        _ => it.name.clone(),
    };
    assert_eq!(status.objectives.iter().map(word).collect::<Vec<_>>(), objectives);
}

#[test]
fn what_a_mission_needs_is_answered_without_flying_it() {
    let mut story = Story::of(REFERENCE);
    let before = story.status();
    let reply = story.ask(Ask::Validate(text(REFERENCE)));
    assert!(reply.accepted, "{}", reply.text);
    let [there, back] = &reply.forecast[..] else { panic!("{:?}", reply.forecast) };
    assert_eq!((there.objective.as_str(), there.permissions.join(" ").as_str()), ("deliver", "A B"));
    assert_eq!((there.length_m, back.length_m), (520.0, 520.0));
    assert!(there.reachable && back.reachable && back.permissions.is_empty());
    assert_eq!(there.plan.as_ref().map(|it| it.steps.len()), Some(5));
    assert_eq!(story.status(), before);
}

#[test]
fn every_mistake_in_the_text_is_reported() {
    let mut story = Story::of(REFERENCE);
    let reply = story.ask(Ask::Validate(text("name = \"x\"\n")));
    assert_eq!((reply.accepted, reply.text.as_str()), (false, "1 mistake in the text"));
    assert!(reply.mistakes[0].contains("a mission without objectives"), "{:?}", reply.mistakes);
    let shut_in = across(&area("shut", "keep-out", [450.0, 550.0], ""));
    let reply = story.ask(Ask::Upload(text(&shut_in)));
    assert!(!reply.accepted && reply.mistakes[0].contains("lies in keep-out area `shut`"), "{:?}", reply.mistakes);
}

#[test]
fn of_very_many_mistakes_a_short_answer_is_made() {
    let mut story = Story::of(REFERENCE);
    let objective = |number, lines: &str| {
        format!(
            "[[objective]]\nname = \"{number:0>100}\"\nnorth_m = 0\neast_m = 9\nheight_m = 9\nflying = true\n{lines}\n"
        )
    };
    let objectives: String = (0..100).map(|number| objective(number, "")).collect();
    let mut check = |count: usize, expected: &str| {
        let hostile = objective(100, &format!("after = [{}]", "\"\",".repeat(count)));
        let reply = story.ask(Ask::Validate(text(&format!("name = \"m\"\n{objectives}{hostile}"))));
        assert_eq!((reply.accepted, reply.text.as_str()), (false, expected));
        let bytes: usize = reply.mistakes.iter().map(String::len).sum();
        assert!(bytes < 100_000, "{bytes} bytes");
    };
    check(19, "19 mistakes in the text");
    check(101, "at least 20 mistakes in the text");
    check(12_000, "1 mistake in the text");
}

#[test]
fn an_upload_is_a_swap_and_the_plan_of_before_no_longer_holds() {
    let mut story = Story::under_way(REFERENCE);
    let reply = story.ask(Ask::Upload(text(KEEP_OUT)));
    assert!(reply.accepted, "{}", reply.text);
    let status = story.status();
    assert_eq!((story.voids, status.plan.unwrap().steps.len()), (1, 0));
}

#[test]
fn what_cannot_be_flown_does_not_take_the_place_of_what_can() {
    let mut story = Story::under_way(REFERENCE);
    let before = story.status();
    let window = "until_utc = \"2027-01-01T00:00:00Z\"";
    let shut_in = across(&area("shut", "keep-out", [450.0, 550.0], window));
    let reply = story.ask(Ask::Upload(text(&shut_in)));
    assert!(!reply.accepted && reply.text.starts_with("objective `there`: "), "{}", reply.text);
    assert!(!reply.forecast[0].reachable);
    assert_eq!(story.status(), before);
}

#[test]
fn a_change_to_what_is_flown_withdraws_the_plan_any_other_does_not() {
    check(insert(2, "look", 90.0), true, "objective `look` inserted at 2", &["deliver", "return", "look"], 0);
    check(insert(0, "look", 90.0), true, "objective `look` inserted at 0", &["look", "deliver", "return"], 1);
    check(remove("return"), true, "objective `return` removed", &["deliver"], 0);
    check(remove("deliver"), true, "objective `deliver` removed", &["return"], 1);
    check(skip("return"), true, "objective `return` skipped", &["deliver", "return (skipped by anna)"], 0);
    check(skip("deliver"), true, "objective `deliver` skipped", &["deliver (skipped by anna)", "return"], 1);
}

#[test]
fn a_place_that_wind_brings_too_near_to_a_border_is_told_when_it_is_inserted() {
    let mut story = Story::under_way(REFERENCE);
    let reply = story.ask(insert(1, "look", 95.0));
    assert!(reply.accepted && reply.text.contains("lies 15.0 m from the border of area `A`"), "{}", reply.text);
}

#[test]
fn what_makes_no_sense_changes_nothing() {
    #[track_caller]
    fn refused(ask: Ask, words: &str) {
        check(ask, false, words, &["deliver", "return"], 0);
    }
    refused(remove("nowhere"), "there is no objective `nowhere`");
    refused(insert(3, "look", 1.0), "cannot insert at 3: the mission has 2 objectives, and the limit is 500");
    refused(
        insert(1, "look", 104.0),
        "objective `look` lies 6.0 m from the border of area `A`, expected at least 10 m",
    );
    refused(insert(1, "deliver", 1.0), "there is an objective `deliver` already");
    refused(insert(1, "", 1.0), "an objective has a name of 1 to 100 characters, without control characters");
    refused(insert(1, "d\nover", 1.0), "an objective has a name of 1 to 100 characters, without control characters");
    refused(insert(1, "x", 2e5), "objective `x` is farther than 100000 m from the origin, or higher than 10000 m");
    refused(
        insert(1, "x", f64::NAN),
        "`objective.position`: `position` is north 0.0, east NaN, down -10.0, expected metres within 1,000 km",
    );
    refused(Ask::Insert(v1::InsertObjective::default()), "`objective` is missing");
    let long = "#".repeat(domain::file::LARGEST_BYTES as usize + 1);
    refused(Ask::Upload(text(&long)), "the text has 33554433 bytes, more than the limit of 33554432");
}

#[test]
fn the_only_objective_is_not_removed() {
    let mut story = Story::under_way(&across(""));
    let reply = story.ask(remove("there"));
    assert_eq!(reply.text, "`there` is the only objective; skip it, or upload another mission");
}

#[test]
fn a_mission_that_is_over_stays_over() {
    let mut story = Story::under_way(REFERENCE);
    assert!(story.ask(skip("deliver")).accepted);
    assert!(story.ask(skip("return")).accepted);
    let reply = story.ask(Ask::Upload(text(REFERENCE)));
    let over =
        "the mission is over: every objective is settled: nobody would fly it; upload it once the vehicle has landed";
    assert_eq!((reply.accepted, reply.text.as_str()), (false, over));
    assert_eq!(story.ask(skip("return")).text, "objective `return` has failed: skipped by anna");
}

#[test]
fn on_the_ground_the_next_mission_is_taken_and_waits() {
    let mut story = Story::of(REFERENCE);
    assert!(story.ask(skip("deliver")).accepted);
    assert!(story.ask(skip("return")).accepted);
    let voids = story.voids;
    let reply = story.ask(Ask::Upload(text(KEEP_OUT)));
    assert_eq!((reply.accepted, reply.text.as_str()), (true, "`keep-out` waits for an operator's start"));
    let status = story.status();
    assert_eq!((status.mission.as_str(), status.current_objective), ("keep-out", 0));
    assert!(voids < story.voids, "the manager sees that it is another one");
    // What could not be flown is refused, and the one that waits stays.
    let reply = story.ask(Ask::Upload(text("name = \"x\"\n")));
    assert_eq!((reply.accepted, story.status().mission.as_str()), (false, "keep-out"));
}

#[test]
fn what_the_tower_has_refused_on_the_last_flight_is_asked_for_on_the_next() {
    let shut_in = across(
        "[[area]]\nname = \"W\"\nkind = \"permission\"\n\
         corners_m = [[-90.0, 400.0], [90.0, 400.0], [90.0, 600.0], [-90.0, 600.0]]\n",
    );
    let mut story = Story::of(&shut_in);
    story.plan();
    // Nobody has answered: that counts for the whole flight.
    super::check(&story.fail(&[("W", None)]), "finished");
    story.end.0 = "the mission is over".into();
    let reply = story.ask(Ask::Validate(text(&shut_in)));
    assert!(reply.accepted, "{}", reply.text);
    let reply = story.ask(Ask::Upload(text(&shut_in)));
    assert!(reply.accepted, "{}", reply.text);
    let plan = story.plan();
    assert!(plan.contains("ask W"), "{plan}");
}

#[test]
fn until_the_end_is_reported_the_mission_is_the_one_that_was_flown() {
    #[track_caller]
    fn check(ends: &str, start_awaited: bool, is_reported: bool, expected: &str) {
        let mut story = Story::of(REFERENCE);
        assert!(story.ask(skip("deliver")).accepted && story.ask(skip("return")).accepted);
        story.end = (ends.to_owned(), !is_reported && !start_awaited, start_awaited);
        assert_eq!(story.ask(Ask::Upload(text(KEEP_OUT))).text, expected, "{ends} {start_awaited} {is_reported}");
    }
    let taken = "`keep-out` waits for an operator's start";
    let early = |why| format!("{why}: nobody would fly it; upload it once its end is reported");
    check("ordered by anna", false, false, &early("ordered by anna"));
    check("ordered by anna", false, true, taken);
    // The manager has not noticed yet that all is settled.
    check("", false, false, &early("the mission is over: every objective is settled"));
    // Nothing has begun, or the next one waits.
    check("", true, false, taken);
    check("ordered by anna", true, true, taken);
}

#[test]
fn an_objective_that_takes_more_than_the_battery_gives_is_not_inserted() {
    let mut story = Story::under_way(REFERENCE);
    story.state.charge = Some(1.0);
    let before = story.status();
    let reply = story.ask(insert(1, "far", 20_000.0));
    let figures = "of 225 usable (300 of 300 Wh left, 25 % reserve)";
    let is_told = reply.text.starts_with("with it the mission needs ") && reply.text.ends_with(figures);
    assert!(!reply.accepted && is_told, "{}", reply.text);
    assert_eq!((story.status(), story.voids), (before, 0));
    assert!(story.ask(insert(1, "look", 90.0)).accepted);
}

#[test]
fn nothing_is_changed_in_a_mission_that_ends() {
    #[track_caller]
    fn check(change: Ask, why: &str) {
        let mut story = Story::of(REFERENCE);
        story.end = ("ordered by anna".into(), true, false);
        let reply = story.ask(change.clone());
        assert_eq!((reply.accepted, reply.text.as_str()), (false, why));
        // The end of the last flight does not end the next one.
        story.end = ("ordered by anna".into(), false, true);
        assert!(story.ask(change).accepted);
    }
    check(skip("deliver"), "ordered by anna: nothing is left to leave out");
    check(remove("deliver"), "ordered by anna: nothing is left to leave out");
    check(insert(1, "look", 90.0), "ordered by anna: nobody would fly it");
}

/// Each change in each state of a mission, in the order of [`CHANGES`].
#[test]
fn each_change_in_each_state() {
    #[track_caller]
    fn check(state: &str, story: impl Fn() -> Story, answers: [&str; 6]) {
        let changes = [
            Ask::Validate(text(KEEP_OUT)),
            Ask::Upload(text(KEEP_OUT)),
            insert(1, "look", 90.0),
            insert(0, "look", 90.0),
            remove("deliver"),
            skip("return"),
        ];
        for (change, expected) in changes.into_iter().zip(answers) {
            let reply = story().ask(change.clone());
            let mark = if reply.accepted { "" } else { "no: " };
            assert_eq!(format!("{mark}{}", reply.text), expected, "{change:?} {state}");
        }
    }
    const OVER: &str = "no: the mission is over: every objective is settled";
    const IN_THE_AIR: &str = "no: the mission is over: every objective is settled: nobody would fly it; upload it once the vehicle has landed";
    const POSSIBLE: &str = "every objective of `keep-out` can be reached";
    const SWAPPED: &str = "`keep-out` takes the place of `reference`";
    let (first, second) = ("objective `look` inserted at 0", "objective `look` inserted at 1");
    let (removed, skipped) = ("objective `deliver` removed", "objective `return` skipped");
    let open = [POSSIBLE, SWAPPED, second, first, removed, skipped];
    check("before it is begun", || Story::of(REFERENCE), open);
    check("in flight", || Story::under_way(REFERENCE), open);
    let waiting = || {
        let mut story = Story::under_way(REFERENCE);
        story.wait(30);
        story.fail(&[("A", None)]);
        story
    };
    check("while a new plan is made", waiting, open);
    let delivered = || {
        let mut story = Story::of(REFERENCE);
        story.plan();
        story.fly(5);
        story
    };
    let settled = "no: objective 0 is settled; the first place to insert at is 1";
    let reached = "no: objective `deliver` has been reached";
    check("half done", delivered, [POSSIBLE, SWAPPED, second, settled, reached, skipped]);
    let over = || {
        let mut story = Story::under_way(REFERENCE);
        story.ask(skip("deliver"));
        story.ask(skip("return"));
        story
    };
    let failed = "no: objective `deliver` has failed: skipped by anna";
    check(
        "over",
        over,
        [POSSIBLE, IN_THE_AIR, OVER, OVER, failed, "no: objective `return` has failed: skipped by anna"],
    );
}
