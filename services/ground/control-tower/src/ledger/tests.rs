//! What is kept of requests and decisions, and what is forgotten.

use super::*;
use crate::persisted;
use crate::policy::Verdict;
use crate::stories::request;
use crate::vehicle::Rhythm;
use domain::time::Pace;
use std::collections::BTreeSet;
use std::time::Duration;

fn ask(ledger: &mut Ledger, id: &str, area: &str) -> Result<(), Refusal> {
    let request = request(id, area);
    let fresh = Expiry::after(Now::default(), Duration::from_secs(900), Pace::REAL_TIME);
    let answer = || Some(Answer { after: Duration::ZERO, verdict: Verdict::Grant });
    let taken = ledger.request(Now::default(), &mut Numbers::default(), &request, fresh, answer);
    ledger.settle(Time::ZERO, |_| true);
    taken
}

/// A ledger on which things happen second by second.
#[derive(Default)]
struct Tower {
    ledger: Ledger,
    numbers: Numbers,
    second: u64,
}

impl Tower {
    fn now(&self) -> Now {
        let utc_ms = 1000 * self.second as i64;
        Now { time: Time::after(Duration::from_secs(self.second)), utc_ms }
    }

    fn until(&self, s: u64) -> Expiry {
        Expiry::after(self.now(), Duration::from_secs(s), Pace::REAL_TIME)
    }

    /// The vehicle asks, and the policy answers at once, if at all. A second passes.
    fn ask(&mut self, area: &str, verdict: Option<Verdict>) -> Result<(), Refusal> {
        let (now, fresh) = (self.now(), self.until(900));
        let request_id = format!("{area} at {}", self.second);
        let request = request(&request_id, area);
        let answer = || Some(Answer { after: Duration::ZERO, verdict: verdict? });
        self.passes(|it| it.ledger.request(now, &mut it.numbers, &request, fresh, answer))
    }

    /// Somebody decides, and a second passes.
    fn rule(&mut self, area: &str, ruling: Ruling) -> Result<(), Refusal> {
        let now = self.now();
        self.passes(|it| it.ledger.rule(now, &mut it.numbers, area, ruling, false))
    }

    fn deny(&mut self, area: &str) -> Result<(), Refusal> {
        self.rule(area, Ruling::Deny { reason: "closed".into() })
    }

    /// For a moment, which is over when the next thing happens.
    fn grant(&mut self, area: &str) -> Result<(), Refusal> {
        let expiry = self.until(1);
        self.rule(area, Ruling::Grant { expiry })
    }

    fn passes<T>(&mut self, happens: impl FnOnce(&mut Tower) -> T) -> T {
        let happened = happens(self);
        let (now, fresh) = (self.now(), self.until(900));
        self.ledger.advance(now, &mut self.numbers, fresh, |_, _| None);
        self.second += 1;
        happened
    }

    /// Another process goes on with what this one knew.
    fn restarted(self) -> Tower {
        let memory = persisted::to_memory(&"uav1".into(), &self.ledger, &self.numbers);
        let mut ledgers = persisted::restored(self.now(), Pace::REAL_TIME, &[memory]).unwrap();
        let (ledger, numbers) = ledgers.pop_first().unwrap().1;
        Tower { ledger, numbers, ..self }
    }

    fn state(&self, area: &str) -> Option<&Standing> {
        self.ledger.permissions.get(area).map(|it| &it.line.standing)
    }

    fn has(&self, area: &str) -> bool {
        self.state(area).is_some()
    }
}

#[test]
fn decisions_about_names_that_there_are_not_leave_room_for_the_vehicle() {
    #[track_caller]
    fn check(decide: fn(&mut Tower, &str) -> Result<(), Refusal>, restarts: bool, expected: Result<(), Refusal>) {
        let mut tower = Tower::default();
        tower.deny("closed by hand").unwrap();
        let made_up: Vec<_> = (0..2 * MAX_AREAS).map(|n| decide(&mut tower, &format!("made up {n}"))).collect();
        assert_eq!(made_up.last(), Some(&expected));
        if restarts {
            tower = tower.restarted();
        }
        let last = tower.numbers.last();
        for n in 0..MAX_UNASKED {
            assert_eq!(tower.ask(&format!("area {n}"), Some(Verdict::Grant)), Ok(()), "area {n}");
            assert!(matches!(tower.state(&format!("area {n}")), Some(Standing::Granted { .. })), "area {n}");
        }
        assert!(last < tower.ledger.permissions["area 0"].line.decision, "numbers go on");
        assert!(tower.ledger.permissions.len() <= MAX_AREAS);
        assert!(matches!(tower.state("closed by hand"), Some(Standing::Denied { by: By::Operator, .. })));
        assert_eq!(tower.deny("area 0"), Ok(()), "what the vehicle has asked for can be decided about");
    }
    for restarts in [false, true] {
        check(Tower::grant, restarts, Ok(()));
        check(Tower::deny, restarts, Err(Refusal::TooManyUnasked));
    }
}

#[test]
fn what_holds_no_more_makes_room_and_nothing_else_does() {
    #[track_caller]
    fn check(name: &str, known: fn(&mut Tower, &str) -> Result<(), Refusal>, makes_room: bool) {
        let mut tower = Tower::default();
        known(&mut tower, "known").unwrap();
        for n in 1..MAX_AREAS {
            tower.ask(&format!("open {n}"), None).unwrap();
        }
        let expected = if makes_room { Ok(()) } else { Err(Refusal::TooManyAreas) };
        assert_eq!(tower.ask("another", None), expected, "{name}");
        assert_eq!(tower.has("known"), !makes_room, "{name}");
    }
    check("a request without an answer", |tower, area| tower.ask(area, None), false);
    check("a grant", |tower, area| tower.ask(area, Some(Verdict::Grant)), false);
    check("a denial by the policy", |tower, area| tower.ask(area, Some(Verdict::Deny { reason: "".into() })), true);
    check("a denial by hand", Tower::deny, false);
    check("an expired grant", Tower::grant, true);
    check(
        "an expired grant of an area that was denied by hand",
        |tower, area| {
            tower.deny(area)?;
            tower.grant(area)
        },
        true,
    );
    check(
        "a revocation",
        |tower, area| {
            tower.ask(area, Some(Verdict::Grant))?;
            tower.rule(area, Ruling::Revoke { reason: "".into() })
        },
        false,
    );
}

#[test]
fn what_the_vehicle_never_asked_for_goes_first_and_then_what_was_decided_longest_ago() {
    let mut tower = Tower::default();
    for area in ["asked first", "asked second"] {
        tower.ask(area, None).unwrap();
        tower.grant(area).unwrap();
    }
    tower.grant("made up").unwrap();
    for n in 3..MAX_AREAS {
        tower.ask(&format!("open {n}"), None).unwrap();
    }
    for (n, forgotten) in ["made up", "asked first", "asked second"].into_iter().enumerate() {
        assert!(tower.has(forgotten));
        assert_eq!(tower.ask(&format!("another {n}"), None), Ok(()));
        assert!(!tower.has(forgotten));
    }
    assert_eq!(tower.ask("one too many", None), Err(Refusal::TooManyAreas));
}

#[test]
fn a_denial_of_an_area_that_the_vehicle_does_not_know_yet_finds_room_again_as_the_refusal_says() {
    let mut tower = Tower::default();
    for n in 0..MAX_UNASKED {
        tower.deny(&format!("made up {n}")).unwrap();
    }
    assert_eq!(tower.deny("closed"), Err(Refusal::TooManyUnasked));
    let nothing = Err(Refusal::NotGranted(NotGranted));
    assert_eq!(tower.rule("closed", Ruling::Revoke { reason: "".into() }), nothing, "what is refused takes no room");
    tower.grant("made up 7").unwrap();
    assert_eq!(tower.deny("closed"), Ok(()));
    assert!(tower.has("closed") && !tower.has("made up 7"));
}

#[test]
fn a_repeated_request_for_what_was_forgotten_is_answered_anew() {
    let mut ledger = Ledger::default();
    let deny = || Some(Answer { after: Duration::ZERO, verdict: Verdict::Deny { reason: "".into() } });
    let request = |n: usize| request(&n.to_string(), &format!("area {n}"));
    let mut numbers = Numbers::default();
    let fresh = Expiry::after(Now::default(), Duration::from_secs(900), Pace::REAL_TIME);
    for n in (0..=MAX_AREAS).chain([0]) {
        assert_eq!(ledger.request(Now::default(), &mut numbers, &request(n), fresh, deny), Ok(()));
        ledger.advance(Now::default(), &mut numbers, fresh, |_, _| None);
    }
    assert!(ledger.permissions.contains_key("area 0") && !ledger.permissions.contains_key("area 1"));
}

fn is_changed(ledger: &Ledger) -> bool {
    let rhythm = Rhythm { turn: Duration::from_secs(1) };
    ledger.changed_part(&ledger.parts(), Time::ZERO, rhythm).is_some()
}

#[test]
fn a_repeated_request_changes_nothing() {
    let mut ledger = Ledger::default();
    assert_eq!(ask(&mut ledger, "1", "a"), Ok(()));
    assert!(is_changed(&ledger));
    let parts = ledger.parts();
    ledger.say(&parts[0], Time::ZERO);
    assert_eq!(ask(&mut ledger, "1", "a"), Ok(()));
    assert!(!is_changed(&ledger));
}

#[test]
fn invalid_requests_are_refused_with_the_reason() {
    let mut ledger = Ledger::default();
    assert_eq!(ask(&mut ledger, "", "a"), Err(Refusal::NoRequestId));
    assert_eq!(ask(&mut ledger, "1", ""), Err(Refusal::NoArea));
    ask(&mut ledger, "1", "a").unwrap();
    let refusal = ask(&mut ledger, "1", "b").unwrap_err();
    assert_eq!(refusal.to_string(), "request `1` asked for area `a` before, and asks for `b` now");
}

#[test]
fn the_ledger_does_not_grow_without_end() {
    let mut ledger = Ledger::default();
    for n in 0..2 * REMEMBERED_REQUESTS {
        let expected = if n < MAX_AREAS { Ok(()) } else { Err(Refusal::TooManyAreas) };
        assert_eq!(ask(&mut ledger, &format!("new {n}"), &format!("area {n}")), expected);
        assert_eq!(ask(&mut ledger, &format!("again {n}"), "area 0"), Ok(()));
    }
    let known = |id: String| ledger.requests.get(&id).is_some();
    let (first_known, last) = (3 * REMEMBERED_REQUESTS / 2, 2 * REMEMBERED_REQUESTS - 1);
    assert!(!known("again 0".into()) && known(format!("again {first_known}")) && known(format!("again {last}")));
}

#[test]
fn a_grant_is_not_shown_before_it_is_given_for_good_and_everything_else_at_once() {
    let mut ledger = Ledger::default();
    let mut numbers = Numbers::default();
    let now = Now::default();
    let expiry = |s| Expiry::after(now, Duration::from_secs(s), Pace::REAL_TIME);
    let shown = |ledger: &mut Ledger| {
        let parts = ledger.parts();
        let lines = ledger.say(&parts[0], now.time).permissions.into_iter();
        lines.map(|it| (it.state().as_str_name().to_owned(), it.valid_for_s, it.decision)).collect::<Vec<_>>()
    };
    let mut rule = |ledger: &mut Ledger, ruling, stored: u64| {
        ledger.rule(now, &mut numbers, "a", ruling, false).unwrap();
        ledger.settle(now.time, |number| number <= stored);
    };
    rule(&mut ledger, Ruling::Grant { expiry: expiry(60) }, 0);
    assert_eq!(shown(&mut ledger), []);
    ledger.settle(now.time, |number| number <= 1);
    assert_eq!(shown(&mut ledger), [("PERMISSION_STATE_GRANTED".to_owned(), 60.0, 1)]);
    rule(&mut ledger, Ruling::Grant { expiry: expiry(90) }, 1);
    assert_eq!(shown(&mut ledger), [("PERMISSION_STATE_GRANTED".to_owned(), 60.0, 1)], "the one before holds");
    rule(&mut ledger, Ruling::Revoke { reason: String::new() }, 1);
    assert_eq!(shown(&mut ledger), [("PERMISSION_STATE_REVOKED".to_owned(), 0.0, 3)]);
}

#[test]
fn of_grants_that_come_faster_than_they_are_stored_some_are_shown() {
    let (mut ledger, mut numbers) = (Ledger::default(), Numbers::default());
    let mut shown = BTreeSet::new();
    for n in 1..20 {
        let now = Now { time: Time::after(Duration::from_secs(n)), ..Now::default() };
        let expiry = Expiry::after(now, Duration::from_secs(60), Pace::REAL_TIME);
        ledger.rule(now, &mut numbers, "a", Ruling::Grant { expiry }, false).unwrap();
        // The newest is never stored.
        ledger.settle(now.time, |number| number < n);
        let parts = ledger.parts();
        shown.extend(ledger.say(&parts[0], now.time).permissions.first().map(|it| it.decision));
    }
    assert!(5 < shown.len() && shown.last() == Some(&18), "{shown:?}");
}

#[test]
fn what_a_ledger_cannot_say_is_refused_with_the_limit() {
    #[track_caller]
    fn check(happens: impl Fn(&mut Tower) -> Result<(), Refusal>, expected: Result<(), &str>) {
        let happened = happens(&mut Tower::default()).map_err(|it| it.to_string());
        assert_eq!(happened, expected.map_err(str::to_owned));
    }
    let deny = |bytes| move |tower: &mut Tower| tower.rule("a", Ruling::Deny { reason: "x".repeat(bytes) });
    let ask = |bytes| move |tower: &mut Tower| ask(&mut tower.ledger, &"x".repeat(bytes), "a");
    check(deny(256), Ok(()));
    check(deny(257), Err("`reason` has 257 bytes, more than the 256 that reach a vehicle: say it shorter"));
    check(ask(64), Ok(()));
    check(ask(65), Err("`request_id` has 65 bytes, more than the 64 that are served"));
}

#[test]
fn expiry_is_published_in_utc_of_the_wall_clock() {
    let now = Now { time: Time::after(Duration::from_secs(100)), utc_ms: 1_000_000 };
    let expiry = Expiry::after(now, Duration::from_secs(900), Pace::new(20.0).unwrap());
    assert_eq!(expiry.at, Time::after(Duration::from_secs(1000)));
    assert_eq!(expiry.utc_ms, 1_045_000);
}
