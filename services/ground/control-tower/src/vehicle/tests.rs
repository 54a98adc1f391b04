//! Ledgers that are larger than what the link lets pass.

use domain::permission::PermissionState::{Granted, Revoked};
use domain::wire::permission::ledger;
use kittiwake_proto::topics::{Message, Request};
use node::{Effect, Event, Node, Token};
use signed_permissions::belief::Belief;
use signed_permissions::key::SecretKey;

use super::*;
use crate::ControlTower;
use crate::policy::Policy;
use crate::stories::request;

const CONFIG: &str = "
    delay_s = 5.0
    random_denial = 0.5
    denial_reason = 'closed'
    grant_valid_s = 900.0
    ledger_rate_hz = 1.0
";
const LINK: &str = include_str!("../../../../../config/zenoh/link.toml");

/// A tower that has granted as many areas as it keeps, and what the vehicle hears.
struct Rig {
    tower: ControlTower,
    now: Now,
    belief: Belief,
    /// Heard so far, with the second.
    heard: Vec<(f64, v1::PermissionLedger)>,
}

impl Rig {
    fn with(areas: impl Iterator<Item = String>) -> Rig {
        let key = SecretKey::of_seed([1; 32]).unwrap();
        let belief = Belief::new("uav1", "f".into(), Some(key.public()));
        let tower = ControlTower::new(&toml::from_str(CONFIG).unwrap(), Policy::Grant, 1, Pace::REAL_TIME, u64::MAX);
        let now = Now { time: Time::ZERO, utc_ms: 1_700_000_000_000 };
        let mut rig = Rig { tower: tower.that_signs_with(key), now, belief, heard: Vec::new() };
        for (n, area) in areas.enumerate() {
            let request_id = format!("{n:0>64}");
            rig.send(Request::Permission(request(&request_id, &area)));
        }
        rig
    }

    fn revoke(&mut self, area: &str) {
        let (area, reason) = (area.to_owned(), "x".repeat(256));
        let decision = v1::Decision::Revoke as i32;
        self.send(Request::Decide(v1::DecideRequest { area, decision, reason, ..Default::default() }));
    }

    fn send(&mut self, request: Request) {
        let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request };
        self.tower.on(self.now, event, &mut Vec::new());
    }

    /// Publishes what is due until `s` seconds; `passes`: whether the link lets this one pass.
    fn until(&mut self, s: u64, passes: impl FnMut(&v1::PermissionLedger) -> bool) {
        self.until_ms(1000 * s, passes);
    }

    fn until_ms(&mut self, ms: u64, mut passes: impl FnMut(&v1::PermissionLedger) -> bool) {
        let end = Time::after(Duration::from_millis(ms));
        loop {
            let mut effects = Vec::new();
            self.tower.act(self.now, &mut effects);
            for effect in effects {
                let Effect::Publish { vehicle, message: Message::PermissionLedger(part) } = effect else { continue };
                if vehicle.as_deref() == Some("uav1") && passes(&part) {
                    let lines = ledger(part.clone()).unwrap();
                    let taken = self.belief.take(self.now, Pace::REAL_TIME, lines);
                    assert_eq!((taken.refused, taken.to_ask), (Vec::new(), Vec::new()));
                    self.heard.push((self.now.time.since_start().as_secs_f64(), part));
                }
            }
            let next = self.tower.deadline().unwrap();
            assert!(self.now.time < next, "all that was due is published");
            if end < next {
                break;
            }
            let passed_ms = (next - self.now.time).as_millis() as i64;
            self.now = Now { time: next, utc_ms: self.now.utc_ms + passed_ms };
        }
    }

    fn state(&self, area: &str) -> Option<domain::permission::PermissionState> {
        self.belief.permission(area).map(|it| it.state)
    }
}

fn short_names() -> impl Iterator<Item = String> {
    (0..256).map(|n| format!("area {n:0>3}"))
}

#[test]
fn the_largest_ledger_arrives_in_parts_that_the_link_lets_pass() {
    let names = || (0..256).map(|n| format!("{n:0>400}"));
    let mut rig = Rig::with(names());
    rig.until(0, |_| false);
    let revoked = |n: usize| n.is_multiple_of(2);
    names().enumerate().filter(|(n, _)| revoked(*n)).for_each(|(_, area)| rig.revoke(&area));
    rig.tower.memory_written(Err("x".repeat(5000)), None);
    rig.until(40, |_| true);
    for (n, area) in names().enumerate() {
        assert_eq!(rig.state(&area), Some(if revoked(n) { Revoked } else { Granted }), "area {n}");
    }
    let link: toml::Table = toml::from_str(LINK).unwrap();
    let link_bytes = link["carrier"]["largest_message_bytes"].as_integer().unwrap() as usize;
    let largest = rig.heard.iter().map(|(_, part)| Message::from(part.clone()).encode().len()).max().unwrap();
    assert!(largest <= 8000 && 8000 < link_bytes, "{largest} bytes, {link_bytes} pass");
    assert!(rig.heard[0].1.memory.as_ref().unwrap().failing.ends_with('…'));
    for (second, _) in &rig.heard {
        let within = rig.heard.iter().filter(|(other, _)| (0.0..1.0).contains(&(other - second))).count();
        assert!(within <= 3, "{within} parts in the second from {second}");
    }
}

#[test]
fn a_revocation_among_256_areas_arrives_at_once_and_again_if_the_link_loses_it() {
    #[track_caller]
    fn check(lost: usize, most_s: f64) {
        let mut rig = Rig::with(short_names());
        rig.until(60, |_| true);
        rig.revoke("area 200");
        let tells =
            |it: &v1::PermissionLedger| it.permissions.iter().any(|it| it.state() == v1::PermissionState::Revoked);
        let mut said = 0;
        rig.until(70, |part| {
            said += usize::from(tells(part));
            !tells(part) || lost < said
        });
        assert_eq!((rig.state("area 200"), rig.state("area 201")), (Some(Revoked), Some(Granted)));
        let (first_s, _) = rig.heard.iter().find(|(_, part)| tells(part)).unwrap();
        assert!(*first_s <= 60.0 + most_s, "{first_s}");
    }
    check(0, 0.1);
    check(1, 1.1);
    check(2, 2.1);
}

#[test]
fn every_area_has_its_turn_and_a_revocation_arrives_also_while_another_one_changes_all_the_time() {
    #[track_caller]
    fn check(period_ms: u64) {
        let mut rig = Rig::with(short_names());
        rig.until(60, |_| true);
        rig.heard.clear();
        for n in 0..40_000 / period_ms {
            if n == 5 {
                rig.revoke("area 200");
            }
            rig.send(Request::Permission(request(&format!("again {n}"), "area 000")));
            rig.until_ms(60_000 + (n + 1) * period_ms, |_| true);
            if (n + 1) * period_ms == 10_000 {
                assert_eq!(rig.state("area 200"), Some(Revoked), "every {period_ms} ms");
            }
        }
        for area in short_names() {
            let said = rig.heard.iter().filter(|(_, part)| part.permissions.iter().any(|it| it.area == area)).count();
            assert!(2 <= said, "{area} was said {said} times in 40 s, with a change every {period_ms} ms");
        }
    }
    [1000, 500, 200, 50].into_iter().for_each(check);
}

#[test]
fn a_mission_manager_that_is_started_hears_of_every_area_within_seconds() {
    let mut rig = Rig::with(short_names());
    rig.until(60, |_| true);
    rig.heard.clear();
    let (vehicle, service, instance) = ("uav1".into(), "mcm".into(), "2".into());
    rig.tower.on(rig.now, Event::Peer { vehicle, service, instance, alive: true }, &mut Vec::new());
    rig.until(70, |_| true);
    let said = |area: &String| rig.heard.iter().any(|(_, part)| part.permissions.iter().any(|it| it.area == *area));
    assert!(short_names().all(|area| said(&area)));
}

#[test]
fn what_has_expired_is_said_as_long_as_it_is_known() {
    // A vehicle that comes back with a clock that was set back believes in what it remembers until it hears that it is over.
    let mut rig = Rig::with(["area".to_owned()].into_iter());
    rig.until(10_000, |_| true);
    let last = &rig.heard.last().unwrap().1.permissions;
    assert_eq!(last.iter().map(v1::Permission::state).collect::<Vec<_>>(), [v1::PermissionState::Expired]);
}

#[test]
fn numbers_that_a_vehicle_names_move_those_of_no_other_vehicle() {
    let mut rig = Rig::with(["area".to_owned()].into_iter());
    let ask = |latest_decision, id: &str| {
        Request::Permission(v1::PermissionRequest { latest_decision, ..request(id, "another") })
    };
    let far_ms = 9_000_000_000_000;
    rig.send(ask(far_ms, "1"));
    let event = Event::Request { vehicle: "uav2".into(), token: Token(1), request: ask(0, "1") };
    rig.tower.on(rig.now, event, &mut Vec::new());
    rig.until(1, |_| true);
    let memory = rig.tower.memory();
    let last = |vehicle| memory.ledgers.iter().find(|it| it.vehicle == vehicle).unwrap().last_decision;
    assert!(far_ms < last("uav1") && last("uav2") < far_ms, "{} and {}", last("uav1"), last("uav2"));
}
