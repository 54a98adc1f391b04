//! Questions that are repeated, invalid, or of another version; and a planner that is started again.

use super::*;

#[test]
fn an_emptied_plan_that_missed_its_goal_is_planned_again() {
    let mut story = Story::of(REFERENCE);
    story.hold_permissions(&["A", "B"]);
    story.plan();
    story.fly(2);
    let landing = story.steps.remove(0);
    story.state = v1::PlanningState {
        position: Some(v1::Ned { east_m: 480.0, ..Default::default() }),
        flying: false,
        ..story.state.clone()
    };
    let state = story.state.clone();
    story.flown(landing, state);
    check(
        &story.plan(),
        "4 takeoff 10 m, needs B
         5 position 0 500 10, needs B
         6 land, needs B",
    );
}

#[test]
fn a_repeated_request_gets_the_first_ones_answer() {
    let mut story = Story::of(REFERENCE);
    let first = story.plan();
    story.airborne_at([0.0, 50.0, 10.0]);
    story.requests = 0;
    check(&story.plan(), &first);
    story.requests = 7;
    check(story.plan().lines().next().unwrap(), "6 position 0 90 10, hold, ask A");
}

/// Nothing is kept between two questions but caches.
#[test]
fn a_planner_that_is_killed_before_each_question_gives_the_same_answers() {
    let tell = |is_killed: bool| {
        let mut story = Story::of(HARBOUR);
        let kill = |story: &mut Story| {
            if is_killed {
                story.restart();
            }
        };
        let mut told = story.plan();
        story.fly(1);
        kill(&mut story);
        told += &story.fail(&[("basin", Some("busy"))]);
        story.wait(40);
        kill(&mut story);
        told += &story.fail(&[("basin", None)]);
        kill(&mut story);
        told + &story.plan() + &story.objectives()
    };
    assert_eq!(tell(true), tell(false));
}

#[test]
fn a_mission_manager_of_another_version_is_refused_by_its_version() {
    let mut story = Story::of(REFERENCE);
    let mut refused = |basis: Option<v1::PlanningBasis>| {
        let request = v1::ReplanRequest { basis, ..Default::default() };
        render(&story.ask_for_plan(request))
    };
    let expected = |found| {
        format!(
            "refused: the mission manager speaks version {found} of the questions about plans, expected 4: start both from one \
             version of the program\n"
        )
    };
    // The first version had no such field.
    assert_eq!(refused(None), expected(1));
    assert_eq!(refused(Some(v1::PlanningBasis { protocol: 5, ..Default::default() })), expected(5));
}

#[test]
fn a_request_about_the_mission_is_refused_by_its_version_too_and_without_areas_asks_for_them() {
    let mut story = Story::of(REFERENCE);
    let mut asked = |basis| {
        let request = v1::EditRequest { basis: Some(basis), ..Default::default() };
        let Some(Response::Edit(reply)) = story.request(Request::Edit(request)) else { panic!("no reply") };
        reply
    };
    let other = asked(v1::PlanningBasis { protocol: 5, ..Default::default() });
    assert!(other.reply.is_some_and(|it| !it.accepted && it.text.contains("speaks version 5")));
    let without_areas = Story::of(REFERENCE).basis(false);
    assert!(asked(without_areas).areas_unknown);
    let nothing = asked(Story::of(REFERENCE).basis(true));
    assert_eq!(nothing.reply.map(|it| it.text), Some("no request in it".into()));
}

#[test]
fn it_answers_two_requests_and_listens_to_no_topic() {
    use kittiwake_proto::topics::Service;
    let planner = Story::of(REFERENCE).planner;
    assert_eq!((planner.name(), planner.subscriptions()), ("planner", &[][..]));
    assert_eq!(planner.serves(), [Service::Replan, Service::Edit]);
    assert_eq!(planner.deadline(), None, "it waits for questions only");
    let of_the_tower = Request::Permission(v1::PermissionRequest::default());
    assert_eq!(Story::of(REFERENCE).request(of_the_tower), None);
}

/// Of the mission that is flown, and of one that is tried out.
#[test]
fn the_areas_of_two_missions_are_remembered_and_those_used_last_are_kept() {
    let mut story = Story::of(REFERENCE);
    let mut knows = |text: &str, sends_areas: bool| {
        let basis = Some(Story::of(text).basis(sends_areas));
        let reply = story.ask_for_plan(v1::ReplanRequest { basis, ..Default::default() });
        !matches!(reply.reply, Some(v1::replan_reply::Reply::AreasUnknown(_)))
    };
    assert!(!knows(REFERENCE, false));
    assert!(knows(REFERENCE, true) && knows(KEEP_OUT, true));
    assert!(knows(REFERENCE, false));
    assert!(knows(HARBOUR, true));
    assert!(knows(REFERENCE, false) && knows(HARBOUR, false));
    assert!(!knows(KEEP_OUT, false), "it was used before the others");
}

#[test]
fn a_state_that_makes_no_sense_is_refused() {
    let mut story = Story::of(REFERENCE);
    let position = Some(v1::Ned { north_m: f64::NAN, ..Default::default() });
    let state = v1::PlanningState { position, ..Default::default() };
    story.state = state;
    let text = story.plan();
    assert!(text.starts_with("refused: `position` is north NaN"), "{text}");
}

#[test]
fn a_step_that_fails_on_the_spot_again_and_again_is_given_up() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    for _ in 0..4 {
        assert!(story.fail(&[]).starts_with(&format!("{} takeoff", story.steps[0].id)));
    }
    // The second objective is where the vehicle stands.
    check(&story.fail(&[]), "finished");
    assert_eq!(story.status().objectives[0].reason, "takeoff failed 5 times in a row: it failed");
}
