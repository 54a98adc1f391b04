//! What the tower publishes and when, as a log of its ledgers and replies.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use control_tower::ControlTower;
use control_tower::config::Config;
use control_tower::policy::Policy;
use domain::memory::MemoryLoss;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};

const CONFIG: &str = "
    delay_s = 5.0
    random_denial = 0.5
    denial_reason = 'closed'
    grant_valid_s = 900.0
    ledger_rate_hz = 1.0
    [[site]]
    name = 'wt12'
    rotor_stopped = true
    deck_clear = true
    wind_at_most_m_s = 10.0
    silent_after_s = 60.0
    [[site]]
    name = 'model'
    rotor_stopped = true
    deck_clear = true
    silent_after_s = 60.0
    simulated = { rotor_stops_s = 20.0, deck_occupied = false, wind_m_s = 6.0 }
";

/// A tower, its clock, and a log of its refusals and of ledgers that changed.
struct Story {
    tower: ControlTower,
    now: Now,
    log: Vec<String>,
    last_ledger: String,
    published: usize,
    /// The numbers of the decisions about each area of each vehicle.
    numbers: BTreeMap<(String, String), BTreeSet<u64>>,
}

impl Story {
    fn with(policy: Policy, seed: u64, pace: Pace) -> Story {
        let tower = ControlTower::new(&toml::from_str::<Config>(CONFIG).unwrap(), policy, seed, pace, 1);
        Story {
            tower,
            now: Now::default(),
            log: Vec::new(),
            last_ledger: String::new(),
            published: 0,
            numbers: BTreeMap::new(),
        }
    }

    fn of(policy: Policy) -> Story {
        Story::with(policy, 1, Pace::REAL_TIME)
    }

    /// The vehicle asks for an area.
    fn ask(mut self, id: &str, area: &str) -> Story {
        self.send("uav1", Request::Permission(request(id, area)));
        self
    }

    /// It asks for an area of the same name that lies elsewhere, or in another flight.
    fn ask_changed(mut self, id: &str, area: &str, change: impl FnOnce(&mut v1::PermissionRequest)) -> Story {
        let mut request = request(id, area);
        change(&mut request);
        self.send("uav1", Request::Permission(request));
        self
    }

    /// An operator decides about uav1.
    fn decide(self, decision: v1::Decision, area: &str) -> Story {
        self.decide_for(decision, area, None)
    }

    fn decide_for(mut self, decision: v1::Decision, area: &str, valid_for_s: Option<f64>) -> Story {
        let reason = "by hand".into();
        let decision = decision as i32;
        let request = v1::DecideRequest { vehicle: "uav1".into(), area: area.into(), decision, reason, valid_for_s };
        self.send("uav1", Request::Decide(request));
        self
    }

    /// The party at a site reports.
    fn report(mut self, site: &str, rotor: v1::Rotor, deck: v1::Deck, wind_m_s: Option<f64>) -> Story {
        let report = v1::SiteReport { site: site.into(), rotor: rotor as i32, deck: deck as i32, wind_m_s };
        // It holds for every vehicle, whichever one it is sent to.
        self.send("uav9", Request::SiteReport(report));
        self
    }

    fn send(&mut self, vehicle: &str, request: Request) {
        let mut effects = Vec::new();
        self.tower.on(self.now, Event::Request { vehicle: vehicle.into(), token: Token(1), request }, &mut effects);
        self.tower.act(self.now, &mut effects);
        self.note(effects);
    }

    /// Lets time pass, acting whenever the tower wants to.
    fn wait(mut self, s: f64) -> Story {
        let end = self.now.time + Duration::from_secs_f64(s);
        while let Some(deadline) = self.tower.deadline().filter(|it| *it <= end) {
            self.go_to(deadline);
            let mut effects = Vec::new();
            self.tower.act(self.now, &mut effects);
            self.note(effects);
        }
        self.go_to(end);
        self
    }

    fn go_to(&mut self, time: Time) {
        let passed_ms = (time - self.now.time).as_millis() as i64;
        self.now = Now { time, utc_ms: self.now.utc_ms + passed_ms };
    }

    fn note(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            let line = match effect {
                Effect::Reply { response: Response::Permission(it), .. } if it.received => continue,
                Effect::Reply { response: Response::Permission(it), .. } => format!("refused: {}", it.refusal),
                Effect::Reply { response: Response::Decide(it), .. } if it.accepted => continue,
                Effect::Reply { response: Response::AcceptLoss(it), .. } if it.accepted => continue,
                Effect::Reply { response: Response::AcceptLoss(it), .. } => format!("refused: {}", it.refusal),
                Effect::Reply { response: Response::Decide(it), .. } => format!("refused: {}", it.refusal),
                Effect::Reply { response: Response::SiteReport(it), .. } if it.accepted => continue,
                Effect::Reply { response: Response::SiteReport(it), .. } => format!("refused: {}", it.refusal),
                Effect::Publish { vehicle, message: Message::PermissionLedger(it) } => {
                    self.published += 1;
                    let vehicle = vehicle.expect("the tower belongs to no vehicle");
                    let ledger = format!("{vehicle}: {}", self.text(&vehicle, &it));
                    if ledger == self.last_ledger {
                        continue;
                    }
                    self.last_ledger = ledger.clone();
                    ledger
                }
                other => panic!("unexpected {other:?}"),
            };
            self.log.push(format!("{} {line}", self.now.utc_ms / 1000));
        }
    }

    /// A line for each area; decisions by how many there were, since their numbers are times.
    fn text(&mut self, vehicle: &str, ledger: &v1::PermissionLedger) -> String {
        let permission = |it: &v1::Permission| {
            let state = it.state().as_str_name().trim_start_matches("PERMISSION_STATE_").to_lowercase();
            let until =
                if 0 < it.expires_utc_ms { format!(" until {}", it.expires_utc_ms / 1000) } else { String::new() };
            let reason = if it.reason.is_empty() { String::new() } else { format!(" ({})", it.reason) };
            let known = self.numbers.entry((vehicle.to_owned(), it.area.clone())).or_default();
            assert!(known.last().is_none_or(|last| *last <= it.decision), "{} comes after {known:?}", it.decision);
            if 0 < it.decision {
                known.insert(it.decision);
            }
            let count = if it.decision == 0 { 0 } else { known.len() };
            let entered = if it.entered_because.is_empty() { "" } else { ", entered: " };
            let entered = format!("{entered}{}", it.entered_because);
            format!("{} {state}{until}{reason}{entered} [{}, decision {count}]", it.area, it.request_id)
        };
        let lines: Vec<_> = ledger.permissions.iter().map(permission).collect();
        let lost = ledger.memory.as_ref().and_then(|it| it.loss.as_ref());
        lines.join("; ") + &lost.map(|it| format!(" LOST: {}", it.why)).unwrap_or_default()
    }

    /// The tower is killed, and started again with what it has stored, `after_s` later.
    fn restart(mut self, policy: Policy, after_s: i64, change: impl FnOnce(&mut ControlTower)) -> Story {
        let memory = self.tower.memory();
        let config = toml::from_str::<Config>(CONFIG).unwrap();
        self.tower = ControlTower::new(&config, policy, 1, Pace::REAL_TIME, 2).that_is_stored();
        self.tower.resume(memory).unwrap();
        change(&mut self.tower);
        self.now = Now { time: Time::ZERO, utc_ms: self.now.utc_ms + 1000 * after_s };
        self.stored().act()
    }

    /// What was decided is on the disk.
    fn stored(mut self) -> Story {
        let memory = self.tower.memory();
        self.tower.memory_saved(&memory);
        self
    }

    fn act(mut self) -> Story {
        let mut effects = Vec::new();
        self.tower.act(self.now, &mut effects);
        self.note(effects);
        self
    }

    #[track_caller]
    fn expect_log(self, expected: &[&str]) {
        assert_eq!(self.log, expected);
    }
}

#[test]
fn a_grant_comes_at_once_and_expires() {
    Story::of(Policy::Grant)
        .ask("1", "a")
        .wait(1000.0)
        .expect_log(&["0 uav1: a granted until 900 [1, decision 1]", "900 uav1: a expired [1, decision 1]"]);
}

#[test]
fn a_delayed_grant_is_first_seen_as_requested() {
    Story::of(Policy::Delay)
        .wait(10.0)
        .ask("1", "a")
        .wait(60.0)
        .expect_log(&["10 uav1: a requested [1, decision 0]", "15 uav1: a granted until 915 [1, decision 1]"]);
}

#[test]
fn asking_again_during_a_delay_does_not_restart_the_delay() {
    Story::of(Policy::Delay).ask("1", "a").wait(4.0).ask("2", "a").wait(60.0).expect_log(&[
        "0 uav1: a requested [1, decision 0]",
        "4 uav1: a requested [2, decision 0]",
        "5 uav1: a granted until 905 [2, decision 1]",
    ]);
}

#[test]
fn a_denial_has_a_reason_and_counts_up_when_asked_again() {
    Story::of(Policy::Deny)
        .ask("1", "a")
        .wait(30.0)
        .ask("1", "a")
        .ask("2", "a")
        .expect_log(&["0 uav1: a denied (closed) [1, decision 1]", "30 uav1: a denied (closed) [2, decision 2]"]);
}

#[test]
fn a_silent_tower_never_decides_but_repeats_its_ledger() {
    let story = Story::of(Policy::Silent).ask("1", "a").wait(100.0);
    assert_eq!(story.published, 101);
    story.expect_log(&["0 uav1: a requested [1, decision 0]"]);
}

#[test]
fn the_ledger_is_repeated_once_a_second_of_wall_time() {
    let story = Story::with(Policy::Grant, 1, Pace::new(20.0).unwrap()).ask("1", "a").wait(200.0);
    assert_eq!(story.published, 11);
}

#[test]
fn random_denials_follow_the_seed() {
    let ask_often = |seed| {
        let story = Story::with(Policy::Random, seed, Pace::REAL_TIME);
        (0..20).fold(story, |story, n| story.ask(&n.to_string(), &format!("area {n}"))).log
    };
    assert_eq!(ask_often(1), ask_often(1));
    assert_ne!(ask_often(1), ask_often(2));
    let last = ask_often(1).pop().unwrap();
    assert!(last.contains(" granted until ") && last.contains(" denied (closed) "), "{last}");
}

#[test]
fn asking_again_extends_a_grant() {
    Story::of(Policy::Delay).ask("1", "a").wait(100.0).ask("2", "a").wait(800.0).expect_log(&[
        "0 uav1: a requested [1, decision 0]",
        "5 uav1: a granted until 905 [1, decision 1]",
        "100 uav1: a granted until 1000 [2, decision 2]",
    ]);
}

#[test]
fn an_operator_decides_for_a_silent_tower() {
    Story::of(Policy::Silent)
        .ask("1", "a")
        .wait(3.0)
        .decide(v1::Decision::Grant, "a")
        .wait(10.0)
        .expect_log(&["0 uav1: a requested [1, decision 0]", "3 uav1: a granted until 903 [1, decision 1]"]);
}

#[test]
fn an_operators_denial_comes_before_the_policy_and_lasts() {
    Story::of(Policy::Delay)
        .ask("1", "a")
        .wait(3.0)
        .decide(v1::Decision::Deny, "a")
        .wait(30.0)
        .ask("2", "a")
        .expect_log(&[
            "0 uav1: a requested [1, decision 0]",
            "3 uav1: a denied (by hand) [1, decision 1]",
            "33 uav1: a denied (by hand) [2, decision 2]",
        ]);
}

#[test]
fn a_revoked_permission_stays_denied_until_an_operator_grants_it() {
    let story = Story::of(Policy::Grant).ask("1", "a").wait(3.0).decide(v1::Decision::Revoke, "a");
    story.wait(30.0).ask("2", "a").decide(v1::Decision::Grant, "a").expect_log(&[
        "0 uav1: a granted until 900 [1, decision 1]",
        "3 uav1: a revoked (by hand) [1, decision 2]",
        "33 uav1: a denied (by hand) [2, decision 3]",
        "33 uav1: a granted until 933 [2, decision 4]",
    ]);
}

#[test]
fn asking_again_does_not_move_the_expiry_that_an_operator_has_set() {
    let story = Story::of(Policy::Grant).decide_for(v1::Decision::Grant, "a", Some(60.0));
    story.wait(30.0).ask("1", "a").wait(40.0).ask("2", "a").expect_log(&[
        "0 uav1: a granted until 60 [, decision 1]",
        "30 uav1: a granted until 60 [1, decision 2]",
        "60 uav1: a expired [1, decision 2]",
        "70 uav1: a granted until 970 [2, decision 3]",
    ]);
}

#[test]
fn an_invalid_decision_is_refused_with_the_reason() {
    let mut story = Story::of(Policy::Grant)
        .decide(v1::Decision::Revoke, "a")
        .decide(v1::Decision::Grant, "")
        .decide(v1::Decision::Unspecified, "a")
        .decide_for(v1::Decision::Grant, "a", Some(f64::NAN));
    let unknown = v1::DecideRequest { area: "a".into(), decision: 7, ..Default::default() };
    story.send("uav1", Request::Decide(unknown));
    story.expect_log(&[
        "0 refused: nothing to revoke: the area is not granted",
        "0 refused: `area` is missing",
        "0 refused: `decision` is missing",
        "0 refused: `valid_for_s`: found NaN, expected a number between 0.000001 and 1000000",
        "0 refused: found `decision` 7, expected grant, deny or revoke",
    ]);
}

#[test]
fn an_invalid_request_is_refused_with_the_reason() {
    Story::of(Policy::Grant).ask("", "a").ask("1", "").ask("1", "a").ask("1", "b").expect_log(&[
        "0 refused: `request_id` is missing",
        "0 refused: `area` is missing",
        "0 uav1: a granted until 900 [1, decision 1]",
        "0 refused: request `1` asked for area `a` before, and asks for `b` now",
    ]);
}

#[test]
fn vehicles_beyond_the_limit_are_refused_with_the_reason() {
    let mut story = Story::of(Policy::Grant);
    for n in 0..65 {
        story.send(&format!("uav{n}"), Request::Permission(request("1", "a")));
    }
    // A vehicle that is known is still served.
    story.send("uav0", Request::Permission(request("2", "a")));
    let last = story.log.split_off(64);
    let refused = "0 refused: 64 vehicles have asked already, the most that are served";
    assert_eq!(last, [refused, "0 uav0: a granted until 900 [2, decision 2]"]);
}

#[test]
fn each_vehicle_has_its_own_ledger() {
    let mut story = Story::of(Policy::Grant).ask("1", "a");
    story.send("uav2", Request::Permission(request("1", "b")));
    let request = v1::DecideRequest { vehicle: "uav1".into(), area: "b".into(), decision: 2, ..Default::default() };
    story.send("uav2", Request::Decide(request));
    story.expect_log(&[
        "0 uav1: a granted until 900 [1, decision 1]",
        "0 uav2: b granted until 900 [1, decision 1]",
        "0 refused: sent to vehicle `uav2`, but names `uav1`",
    ]);
}

#[test]
fn a_tower_that_was_killed_goes_on_with_what_it_has_decided() {
    let killed = || Story::of(Policy::Grant).ask("1", "a").decide(v1::Decision::Deny, "b").wait(10.0);
    let before = "0 uav1: a granted until 900 [1, decision 1]; b denied (by hand) [, decision 1]";
    let first = "0 uav1: a granted until 900 [1, decision 1]";
    killed().restart(Policy::Grant, 20, |_| {}).ask("2", "b").wait(1.0).decide(v1::Decision::Revoke, "a").expect_log(
        &[
            first,
            before,
            "30 uav1: a granted until 900 [1, decision 1]; b denied (by hand) [2, decision 2]",
            "31 uav1: a revoked (by hand) [1, decision 2]; b denied (by hand) [2, decision 2]",
        ],
    );
    killed().restart(Policy::Grant, 2000, |_| {}).wait(1.0).expect_log(&[
        first,
        before,
        "2010 uav1: a expired [1, decision 1]; b denied (by hand) [, decision 1]",
    ]);
}

#[test]
fn a_grant_that_has_ended_while_no_tower_ran_is_not_given_anew_without_a_decision() {
    // What arrives first comes together with the first moment that the new tower knows of.
    let arrives = |request: Request| {
        move |tower: &mut ControlTower| {
            let now = Now { time: Time::ZERO, utc_ms: 2_010_000 };
            tower.on(now, Event::Request { vehicle: "uav1".into(), token: Token(1), request }, &mut Vec::new());
        }
    };
    let killed = || Story::of(Policy::Grant).ask("1", "a").wait(10.0);
    let asked = request("2", "a");
    killed()
        .restart(Policy::Deny, 2000, arrives(Request::Permission(asked)))
        .expect_log(&["0 uav1: a granted until 900 [1, decision 1]", "2010 uav1: a denied (closed) [2, decision 2]"]);
    let revoke = v1::Decision::Revoke as i32;
    let revoked = v1::DecideRequest { area: "a".into(), decision: revoke, reason: "fog".into(), ..Default::default() };
    killed()
        .restart(Policy::Deny, 2000, arrives(Request::Decide(revoked)))
        .expect_log(&["0 uav1: a granted until 900 [1, decision 1]", "2010 uav1: a expired [1, decision 1]"]);
}

#[test]
fn a_request_that_was_not_decided_yet_is_decided_by_the_next_tower() {
    Story::of(Policy::Delay)
        .ask("1", "a")
        .wait(3.0)
        .restart(Policy::Delay, 4, |_| {})
        .wait(6.0)
        .stored()
        .act()
        .expect_log(&["0 uav1: a requested [1, decision 0]", "13 uav1: a granted until 912 [1, decision 1]"]);
}

#[test]
fn a_grant_is_published_once_it_is_on_the_disk_and_a_revocation_at_once() {
    let story = Story::of(Policy::Grant).restart(Policy::Grant, 1, |_| {});
    let story = story.ask("1", "a").wait(3.0).stored().act().decide(v1::Decision::Revoke, "a");
    story.expect_log(&[
        "1 uav1: ",
        "4 uav1: a granted until 901 [1, decision 1]",
        "4 uav1: a revoked (by hand) [1, decision 2]",
    ]);
}

#[test]
fn a_tower_that_has_lost_its_decisions_grants_nothing_until_an_operator_accepts_that() {
    let lose = |tower: &mut ControlTower| tower.memory_lost(MemoryLoss { id: 7, why: "garbled".into() });
    let story = Story::of(Policy::Grant).ask("1", "a").wait(3.0).restart(Policy::Grant, 1, lose);
    let mut story =
        story.ask("2", "b").decide(v1::Decision::Grant, "b").decide(v1::Decision::Revoke, "c").stored().act();
    story.send("uav1", Request::AcceptLoss(v1::AcceptLossRequest::default()));
    story.send("uav1", Request::AcceptLoss(v1::AcceptLossRequest::default()));
    let refused = "4 refused: earlier decisions of the tower are lost (garbled): nothing is granted before an operator accepts \
                   that with `kittiwake permission accept-loss`";
    story.stored().act().expect_log(&[
        "0 uav1: a granted until 900 [1, decision 1]",
        "4 uav1:  LOST: garbled",
        "4 uav1: b requested [2, decision 0] LOST: garbled",
        refused,
        "4 uav1: b requested [2, decision 0]; c revoked (by hand) [, decision 1] LOST: garbled",
        "4 uav1: a granted until 900 [1, decision 1]; b requested [2, decision 0]; c revoked (by hand) [, decision 1]",
        "4 refused: nothing to accept: the tower knows its earlier decisions",
        "4 uav1: a granted until 900 [1, decision 1]; b granted until 904 [2, decision 1]; c revoked (by hand) [, decision 1]",
    ]);
}

#[test]
fn a_vehicle_hears_from_the_tower_before_it_asks_for_anything() {
    let mut story = Story::of(Policy::Grant);
    let peer = |vehicle: &str| Event::Peer {
        vehicle: vehicle.into(),
        service: "mcm".into(),
        instance: "1".into(),
        alive: true,
    };
    for vehicle in ["uav1", ""] {
        story.tower.on(story.now, peer(vehicle), &mut Vec::new());
    }
    story.act().expect_log(&["0 uav1: "]);
}

#[test]
fn a_memory_that_makes_no_sense_is_refused_and_changes_nothing() {
    #[track_caller]
    fn check(change: fn(&mut v1::PermissionMemory)) {
        let mut story = Story::of(Policy::Grant).ask("1", "a");
        let mut memory = story.tower.memory();
        change(&mut memory.ledgers[0].permissions[0]);
        let before = story.tower.memory();
        assert!(story.tower.resume(memory).is_err());
        assert_eq!(story.tower.memory(), before);
    }
    check(|it| it.permission = None);
    check(|it| it.granted_for_s = f64::NAN);
    check(|it| it.permission.as_mut().unwrap().area.clear());
    check(|it| it.permission.as_mut().unwrap().state = 0);
}

/// In flight `f`, for an area that has the same place whatever its name.
pub(crate) fn request(id: &str, area: &str) -> v1::PermissionRequest {
    v1::PermissionRequest {
        request_id: id.into(),
        area: area.into(),
        step_id: 1,
        latest_decision: 0,
        flight: "f".into(),
        extent: Some(v1::AreaExtent { outline: vec![7; 32], ..Default::default() }),
        entered_because: String::new(),
    }
}

#[test]
fn who_enters_without_permission_is_told_with_the_reason_until_it_asks_again() {
    let enters = |it: &mut v1::PermissionRequest| it.entered_because = "people below".into();
    let story = Story::of(Policy::Silent).ask_changed("1", "a", enters).restart(Policy::Silent, 0, |_| {});
    story.ask("2", "a").expect_log(&[
        "0 uav1: a requested, entered: people below [1, decision 0]",
        "0 uav1: a requested [2, decision 0]",
    ]);
}

#[test]
fn what_was_granted_or_requested_for_another_place_or_flight_is_no_answer_and_a_denial_by_hand_is() {
    let elsewhere = |it: &mut v1::PermissionRequest| it.extent.as_mut().unwrap().outline[0] = 8;
    let higher = |it: &mut v1::PermissionRequest| it.extent.as_mut().unwrap().ceiling_tenth_mm = Some(1);
    let next_flight = |it: &mut v1::PermissionRequest| it.flight = "g".into();
    let changes: [fn(&mut v1::PermissionRequest); 3] = [elsewhere, higher, next_flight];
    for (change, restarts) in changes.into_iter().flat_map(|it| [(it, false), (it, true)]) {
        // A grant that holds is renewed at once; for anything else the policy takes its time again.
        let mut story = Story::of(Policy::Delay).ask("1", "a").wait(5.0).ask("2", "a").wait(1.0);
        if restarts {
            story = story.restart(Policy::Delay, 0, |_| {});
        }
        story = story.ask_changed("3", "a", change).ask("4", "a");
        story.decide(v1::Decision::Deny, "a").ask_changed("5", "a", change).expect_log(&[
            "0 uav1: a requested [1, decision 0]",
            "5 uav1: a granted until 905 [1, decision 1]",
            "5 uav1: a granted until 905 [2, decision 2]",
            "6 uav1: a requested [3, decision 2]",
            "6 uav1: a requested [4, decision 2]",
            "6 uav1: a denied (by hand) [4, decision 3]",
            "6 uav1: a denied (by hand) [5, decision 4]",
        ]);
    }
}

#[test]
fn a_grant_by_hand_in_advance_is_the_answer_to_the_first_request_and_to_no_other() {
    let mut story = Story::of(Policy::Silent).decide(v1::Decision::Grant, "a").ask("1", "a");
    story = story.ask_changed("2", "a", |it| it.flight = "g".into());
    story.expect_log(&[
        "0 uav1: a granted until 900 [, decision 1]",
        "0 uav1: a granted until 900 [1, decision 2]",
        "0 uav1: a requested [2, decision 2]",
    ]);
}

#[test]
fn a_request_that_does_not_say_for_what_is_refused() {
    let mut story = Story::of(Policy::Grant);
    story = story.ask_changed("1", "a", |it| it.flight.clear()).ask_changed("2", "a", |it| it.extent = None);
    story = story.ask_changed("3", "a", |it| it.flight = "f".repeat(65));
    story = story.ask_changed("4", "a", |it| it.extent = Some(v1::AreaExtent::default()));
    story.expect_log(&[
        "0 refused: `flight` is missing",
        "0 refused: `extent` is missing",
        "0 refused: `flight` has 65 bytes, more than the 64 that are served",
        "0 refused: `outline` is 0 bytes, expected a SHA-256, 32 bytes",
    ]);
}

#[test]
fn a_site_is_granted_while_it_is_ready() {
    use v1::{Deck, Rotor};
    Story::of(Policy::Grant)
        .ask("1", "site wt12")
        .wait(1.0)
        .report("wt12", Rotor::Turning, Deck::Occupied, Some(12.0))
        .wait(1.0)
        .report("wt12", Rotor::Stopped, Deck::Unspecified, None)
        .wait(1.0)
        .report("wt12", Rotor::Unspecified, Deck::Clear, None)
        .wait(1.0)
        .report("wt12", Rotor::Unspecified, Deck::Unspecified, Some(10.0))
        .wait(1.0)
        .report("wt12", Rotor::Unspecified, Deck::Occupied, None)
        .wait(1.0)
        .ask("2", "site wt12")
        .wait(1.0)
        .report("wt12", Rotor::Stopped, Deck::Clear, Some(3.0))
        .expect_log(&[
            "0 uav1: site wt12 requested (not ready: the rotor was not reported for 60 s) [1, decision 0]",
            "1 uav1: site wt12 requested (not ready: the rotor still turns) [1, decision 0]",
            "2 uav1: site wt12 requested (not ready: the deck is occupied) [1, decision 0]",
            "3 uav1: site wt12 requested (not ready: the wind at the deck is above 10 m/s) [1, decision 0]",
            "4 uav1: site wt12 granted until 904 [1, decision 1]",
            "5 uav1: site wt12 revoked (not ready: the deck is occupied) [1, decision 2]",
            "6 uav1: site wt12 requested (not ready: the deck is occupied) [2, decision 2]",
            "7 uav1: site wt12 granted until 907 [2, decision 3]",
        ]);
}

#[test]
fn a_site_whose_party_is_silent_is_not_ready() {
    use v1::{Deck, Rotor};
    Story::of(Policy::Grant)
        .report("wt12", Rotor::Stopped, Deck::Clear, Some(3.0))
        .wait(10.0)
        .ask("1", "site wt12")
        .wait(30.0)
        .report("wt12", Rotor::Stopped, Deck::Unspecified, Some(3.0))
        .wait(50.0)
        .expect_log(&[
            "10 uav1: site wt12 granted until 910 [1, decision 1]",
            "60 uav1: site wt12 revoked (not ready: the deck was not reported for 60 s) [1, decision 2]",
        ]);
}

#[test]
fn nobody_grants_a_site_that_is_not_ready_or_not_known() {
    use v1::{Decision, Deck, Rotor};
    Story::of(Policy::Silent)
        .decide(Decision::Grant, "site wt12")
        .report("wt12", Rotor::Stopped, Deck::Clear, Some(3.0))
        .ask("1", "site wt12")
        .wait(1.0)
        .decide(Decision::Grant, "site wt12")
        .wait(1.0)
        .report("wt12", Rotor::Turning, Deck::Clear, Some(3.0))
        .ask("2", "site wt12")
        .report("wt12", Rotor::Stopped, Deck::Clear, Some(3.0))
        .expect_log(&[
            "0 refused: not ready: the rotor was not reported for 60 s",
            "0 uav1: site wt12 requested [1, decision 0]",
            "1 uav1: site wt12 granted until 901 [1, decision 1]",
            "2 uav1: site wt12 revoked (not ready: the rotor still turns) [1, decision 2]",
            "2 uav1: site wt12 requested (not ready: the rotor still turns) [2, decision 2]",
            "2 uav1: site wt12 requested [2, decision 2]",
        ]);
    Story::of(Policy::Grant)
        .ask("1", "site wt21")
        .report("wt21", Rotor::Stopped, Deck::Clear, None)
        .report("wt12", Rotor::Stopped, Deck::Clear, Some(f64::NAN))
        .decide(Decision::Grant, "site wt21")
        .expect_log(&[
            "0 uav1: site wt21 requested (the control tower knows no site `wt21`) [1, decision 0]",
            "0 refused: the control tower knows no site `wt21`",
            "0 refused: found `wind_m_s` NaN, expected metres per second from 0 up",
            "0 refused: the control tower knows no site `wt21`",
        ]);
}

#[test]
fn a_simulated_site_stops_its_rotor_for_whoever_asks_and_a_report_counts_for_ever() {
    use v1::{Deck, Rotor};
    Story::of(Policy::Grant)
        .wait(100.0)
        .ask("1", "site model")
        .wait(100.0)
        .report("model", Rotor::Unspecified, Deck::Occupied, None)
        .wait(100.0)
        .ask("2", "site model")
        .wait(100.0)
        .report("model", Rotor::Unspecified, Deck::Clear, None)
        .expect_log(&[
            "100 uav1: site model requested (not ready: the rotor still turns) [1, decision 0]",
            "120 uav1: site model granted until 1020 [1, decision 1]",
            "200 uav1: site model revoked (not ready: the deck is occupied) [1, decision 2]",
            "300 uav1: site model requested (not ready: the rotor still turns) [2, decision 2]",
            "320 uav1: site model requested (not ready: the deck is occupied) [2, decision 2]",
            "400 uav1: site model granted until 1300 [2, decision 3]",
        ]);
}

#[test]
fn a_grant_of_the_tower_before_holds_until_a_report_is_overdue() {
    use v1::{Deck, Rotor};
    let granted = || {
        let story = Story::of(Policy::Grant).report("wt12", Rotor::Stopped, Deck::Clear, Some(3.0));
        story.ask("1", "site wt12").ask("2", "site model").wait(25.0).restart(Policy::Grant, 1, |_| {})
    };
    let last = |story: Story| story.log.last().cloned().unwrap_or_default();
    let holds = "site model granted until 920 [2, decision 1]; site wt12 granted until 900 [1, decision 1]";
    assert_eq!(last(granted().wait(59.0)), format!("20 uav1: {holds}"));
    let revoked = "site wt12 revoked (not ready: the rotor was not reported for 60 s) [1, decision 2]";
    assert!(last(granted().wait(61.0)).ends_with(revoked));
    let turning = granted().report("wt12", Rotor::Turning, Deck::Unspecified, None);
    assert!(last(turning).ends_with("site wt12 revoked (not ready: the rotor still turns) [1, decision 2]"));
}

#[test]
fn a_site_without_a_condition_or_with_the_name_of_another_is_a_mistake() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str) {
        assert!(CONFIG.contains(find));
        let error = toml::from_str::<Config>(&CONFIG.replacen(find, replace, 1)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    check("'model'", "'wt12'", "two sites with the name `wt12`");
    check("'model'", "''", "the name of a site has 0 bytes, expected 1 to 100");
    check("    rotor_stopped = true\n    deck_clear = true\n    silent", "    silent", "site `model` has no condition");
    check("silent_after_s = 60.0\n    [[site]]", "[[site]]", "missing field `silent_after_s`");
    check("rotor_stopped = true", "rotor_stoped = true", "unknown field `rotor_stoped`");
}
