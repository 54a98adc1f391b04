//! A planner that continues from the state of another one.

use super::*;
use crate::UnusableState;
use domain::memory::MemoryLoss;
use v1::mission_request::Request as Ask;

impl Story {
    /// The planner's process ends, and another one is started with this mission file.
    pub(super) fn restart(&mut self, text: &str) -> Result<(), UnusableState> {
        let memory = self.planner.memory();
        self.planner = Planner::new(&Config::for_tests(), &energy_for_tests(), mission(text), Pace::REAL_TIME);
        self.planner.resume(memory)
    }
}

#[test]
fn what_was_reached_is_not_flown_to_again() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(5);
    let (before, steps) = (story.objectives(), story.planner.core.last_step_id());
    story.restart(REFERENCE).unwrap();
    assert_eq!(story.objectives(), before);
    let plan = story.plan();
    assert!(plan.contains("takeoff 10 m") && plan.contains("position 0 0 10"), "{plan}");
    assert!(story.steps.iter().all(|it| steps < it.id), "an id means one step: {plan}");
}

#[test]
fn an_uploaded_mission_is_gone_on_with_and_its_flight_is_not_disturbed() {
    let mut story = Story::under_way(REFERENCE);
    assert!(story.ask(Ask::Upload(v1::MissionText { text: KEEP_OUT.into(), wind: None })).accepted);
    story.plan();
    let (before, flown) = (story.status(), story.steps[0].clone());
    story.restart(REFERENCE).unwrap();
    let after = story.status();
    assert_eq!((&after.mission, &after.areas, after.epoch), (&before.mission, &before.areas, before.epoch));
    // The step under way belongs to a plan that was not persisted: its report is accepted nevertheless.
    let done = v1::StepDone { step_id: flown.id, state: Some(story.state.clone()) };
    let reply = story.request(Request::StepDone(done));
    assert_eq!(reply, Some(Response::StepDone(v1::StepDoneReply { accepted: true, refusal: String::new() })));
    story.plan();
    assert!(before.plan.unwrap().revision < story.status().plan.unwrap().revision);
}

#[test]
fn the_sites_of_an_uploaded_mission_are_kept() {
    let text = format!(
        "{KEEP_OUT}[[site]]\nname = \"field\"\nkind = \"landing\"\nnorth_m = -50.0\neast_m = 0.0\n\
         [[site]]\nname = \"pond\"\nkind = \"ditch\"\nnorth_m = -90.0\neast_m = 0.0\n"
    );
    let mut story = Story::under_way(REFERENCE);
    assert!(story.ask(Ask::Upload(v1::MissionText { text, wind: None })).accepted);
    let before = story.status().sites;
    assert_eq!(
        before.iter().map(|it| (it.name.as_str(), it.kind())).collect::<Vec<_>>(),
        [("field", v1::SiteKind::Landing), ("pond", v1::SiteKind::Ditch)]
    );
    story.restart(REFERENCE).unwrap();
    assert_eq!(story.status().sites, before);
}

#[test]
fn another_mission_file_starts_from_its_beginning() {
    let mut story = Story::under_way(REFERENCE);
    story.planner.core.skip(0, "skipped".into());
    assert_eq!(story.restart(KEEP_OUT), Err(UnusableState::OfAnotherMission));
    let status = story.status();
    assert_eq!((status.mission.as_str(), status.current_objective), ("keep-out", 0));
}

#[test]
fn a_memory_that_makes_no_sense_changes_nothing() {
    #[track_caller]
    fn check(change: impl Fn(&mut v1::PlannerMemory), words: &str) {
        let mut story = Story::under_way(REFERENCE);
        let mut memory = story.planner.memory();
        change(&mut memory);
        let error = story.planner.resume(memory).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert_eq!(story.status().mission, "reference");
    }
    check(|it| it.status = None, "`status`");
    check(|it| it.status.as_mut().unwrap().objectives.clear(), "no objective");
    check(|it| it.status.as_mut().unwrap().objectives[0].position = None, "`position`");
    check(|it| it.status.as_mut().unwrap().objectives[0].name.clear(), "a name of 1 to");
    check(|it| it.status.as_mut().unwrap().areas[0].kind = 0, "kind");
    let nowhere = v1::Origin { latitude_deg: 91.0, ..Default::default() };
    check(|it| it.status.as_mut().unwrap().origin = Some(nowhere), "`origin`");
}

#[test]
fn without_its_memory_it_plans_nothing_until_an_operator_has_accepted_that() {
    let mut story = Story::of(REFERENCE);
    story.planner.memory_lost(MemoryLoss { id: 3, why: "planner.0 is garbled".into() });
    let told = |story: &mut Story| story.status().memory.unwrap();
    let words = "waits for an operator, since the planner's memory is unusable: planner.0 is garbled";
    for (accepted, waits) in [(0, true), (2, true), (3, false), (0, false)] {
        story.accepted_loss = accepted;
        assert_eq!(story.plan().contains(words), waits, "accepted {accepted}");
        assert_eq!(told(&mut story).loss.is_some(), waits);
        // Another planner that continues from here has not forgotten the loss either.
        story.restart(REFERENCE).unwrap();
        assert_eq!(told(&mut story).loss.is_some(), waits);
    }
}

#[test]
fn a_first_write_that_fails_is_a_loss_and_a_later_one_is_only_shown() {
    let mut story = Story::of(REFERENCE);
    story.planner.memory_written(Ok(()), Some(3));
    story.planner.memory_written(Err("no space".into()), None);
    let memory = story.status().memory.unwrap();
    assert_eq!((memory.loss, &*memory.failing), (None, "no space"));
    let mut story = Story::of(REFERENCE);
    story.planner.memory_written(Err("no space".into()), Some(3));
    assert_eq!(story.status().memory.unwrap().loss.unwrap().id, 3);
}
