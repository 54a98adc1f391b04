//! A model of how permissions travel: the tower itself, what vehicles believe, and between them a bus that loses, repeats,
//! reorders, delays, misdirects and changes messages, while both ends are killed and started again.
//!
//! Whatever happens, a vehicle believes no grant but one that the tower has given for that vehicle, flight, place and window, and none
//! about which it has heard a later decision. And a tower that is started again knows every grant that is out, and one that has
//! lost everything, its clock as well, can still take it back.

use std::collections::BTreeMap;
use std::time::Duration;

use control_tower::ControlTower;
use control_tower::policy::Policy;
use domain::area::{Area, AreaKind, Extent};
use domain::geometry::Ned;
use domain::memory::MemoryLoss;
use domain::permission::{Permission, PermissionState};
use domain::time::{Now, Pace, Time};
use domain::wire::permission::ledger;
use kittiwake_proto::topics::{Message, Request};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};
use proptest::prelude::*;
use signed_permissions::belief::Belief;
use signed_permissions::key::SecretKey;

const VEHICLES: [&str; 2] = ["uav1", "uav2"];
const AREAS: [&str; 2] = ["A", "B"];
const CONFIG: &str = "
    delay_s = 5.0
    random_denial = 0.5
    denial_reason = 'closed'
    grant_valid_s = 60.0
    ledger_rate_hz = 1.0
";

/// What happens next.
#[derive(Debug, Clone)]
enum Step {
    /// The vehicle asks for an area where it is by its present mission.
    Ask {
        vehicle: usize,
        area: usize,
    },
    /// An operator decides.
    Decide {
        vehicle: usize,
        area: usize,
        decision: i32,
    },
    /// The disk has taken what the tower knows.
    Store,
    /// The tower is killed, and the next one reads the disk.
    KillTower,
    /// The same, but the disk is empty, or what is on it cannot be used.
    LoseLedger {
        is_noticed: bool,
    },
    AcceptLoss,
    /// A ledger that was ever published, counted from the newest, reaches a vehicle, as it is or changed.
    Deliver {
        message: usize,
        vehicle: usize,
        change: Option<Change>,
    },
    /// The vehicle is killed, and continues with what it has stored.
    KillVehicle {
        vehicle: usize,
    },
    /// The next flight of the vehicle begins.
    NewFlight {
        vehicle: usize,
    },
    /// A mission is uploaded in which the areas lie elsewhere, or again where they were.
    Upload {
        vehicle: usize,
    },
    Pass {
        s: u64,
    },
}

/// What is done to each line of a ledger.
#[derive(Debug, Clone, Copy)]
enum Change {
    Area,
    Granted,
    Window,
    Length,
    Number(i8),
    Flight,
    Place,
    Unsigned,
    OtherKey,
}

fn step() -> impl Strategy<Value = Step> {
    use Step as S;
    let (vehicle, area) = (0..VEHICLES.len(), 0..AREAS.len());
    let change = prop_oneof![
        Just(Change::Area),
        Just(Change::Granted),
        Just(Change::Window),
        Just(Change::Length),
        any::<i8>().prop_map(Change::Number),
        Just(Change::Flight),
        Just(Change::Place),
        Just(Change::Unsigned),
        Just(Change::OtherKey),
    ];
    let deliver = (0..12usize, vehicle.clone(), prop::option::weighted(0.3, change));
    prop_oneof![
        3 => (vehicle.clone(), area.clone()).prop_map(|(vehicle, area)| S::Ask { vehicle, area }),
        3 => (vehicle.clone(), area, 1..4).prop_map(|(vehicle, area, decision)| S::Decide { vehicle, area, decision }),
        4 => Just(S::Store),
        1 => Just(S::KillTower),
        1 => any::<bool>().prop_map(|is_noticed| S::LoseLedger { is_noticed }),
        1 => Just(S::AcceptLoss),
        12 => deliver.prop_map(|(message, vehicle, change)| S::Deliver { message, vehicle, change }),
        1 => vehicle.clone().prop_map(|vehicle| S::KillVehicle { vehicle }),
        1 => vehicle.clone().prop_map(|vehicle| S::NewFlight { vehicle }),
        1 => vehicle.prop_map(|vehicle| S::Upload { vehicle }),
        2 => (1..40u64).prop_map(|s| S::Pass { s }),
    ]
}

/// What a grant was given for: vehicle, area, number, end, flight and place.
type Given = (String, String, u64, i64, String, Option<Extent>);

struct Model {
    now: Now,
    tower: ControlTower,
    starts: u64,
    requests: u64,
    disk: Option<v1::TowerMemory>,
    /// Every ledger that was ever published, and for which vehicle.
    published: Vec<(String, v1::PermissionLedger)>,
    given: Vec<Given>,
    beliefs: Vec<Belief>,
    flights: Vec<u64>,
    /// Where the areas of each vehicle's mission lie.
    places: Vec<f64>,
    /// The highest number of a decision other than a grant that the vehicle has heard from the tower.
    refused: BTreeMap<(String, String), u64>,
    believed: usize,
}

fn key() -> SecretKey {
    SecretKey::of_seed([1; 32]).expect("32 bytes make a key")
}

/// The areas of a mission, so far to the north.
fn areas(north_m: f64) -> Vec<Area> {
    let area = |name: &str| {
        Area::new(
            name,
            AreaKind::Permission,
            [(0.0, 0.0), (9.0, 0.0), (0.0, 9.0)].map(|(n, e)| Ned::new(n + north_m, e, 0.0)).to_vec(),
        )
    };
    AREAS.map(area).into()
}

impl Model {
    fn new() -> Model {
        let mut model = Model {
            now: Now { time: Time::ZERO, utc_ms: 1_700_000_000_000 },
            tower: tower(0),
            starts: 0,
            requests: 0,
            disk: None,
            published: Vec::new(),
            given: Vec::new(),
            beliefs: Vec::new(),
            flights: vec![1; VEHICLES.len()],
            places: vec![0.0; VEHICLES.len()],
            refused: BTreeMap::new(),
            believed: 0,
        };
        model.beliefs = (0..VEHICLES.len()).map(|it| model.belief(it)).collect();
        model.store();
        model
    }

    fn flight(&self, vehicle: usize) -> String {
        format!("flight {}", self.flights[vehicle])
    }

    /// Of a process that starts.
    fn belief(&self, vehicle: usize) -> Belief {
        let mut belief = Belief::new(VEHICLES[vehicle], self.flight(vehicle), Some(key().public()));
        belief.know_areas(&areas(self.places[vehicle]).into());
        belief
    }

    fn take(&mut self, step: &Step) {
        match step {
            Step::Ask { vehicle, area } => self.ask(*vehicle, AREAS[*area].into()),
            Step::Decide { vehicle, area, decision } => {
                let (area, decision) = (AREAS[*area].into(), *decision);
                self.send(*vehicle, Request::Decide(v1::DecideRequest { area, decision, ..Default::default() }));
            }
            Step::Store => self.store(),
            Step::KillTower => self.restart(|tower, disk| {
                if let Some(memory) = disk {
                    tower.resume(memory).expect("it was stored like this");
                }
            }),
            Step::LoseLedger { is_noticed } => {
                self.disk = None;
                let is_noticed = *is_noticed;
                self.restart(|tower, _| {
                    if is_noticed {
                        tower.memory_lost(MemoryLoss { id: 1, why: "garbled".into() });
                    }
                });
            }
            Step::AcceptLoss => self.send(0, Request::AcceptLoss(v1::AcceptLossRequest::default())),
            Step::Deliver { message, vehicle, change } => self.deliver(*message, *vehicle, *change),
            Step::KillVehicle { vehicle } => {
                let next = self.belief(*vehicle);
                let before = std::mem::replace(&mut self.beliefs[*vehicle], next);
                let after = &mut self.beliefs[*vehicle];
                before.stored().for_each(|(area, decision, grant)| after.restore(area, decision, grant));
                after.begin(self.now, Pace::REAL_TIME);
            }
            Step::NewFlight { vehicle } => {
                self.flights[*vehicle] += 1;
                let flight = self.flight(*vehicle);
                self.beliefs[*vehicle].begin_flight(flight);
            }
            Step::Upload { vehicle } => {
                self.places[*vehicle] = 100.0 - self.places[*vehicle];
                self.beliefs[*vehicle].know_areas(&areas(self.places[*vehicle]).into());
            }
            Step::Pass { s } => self.pass(*s),
        }
        self.act();
    }

    fn send(&mut self, vehicle: usize, request: Request) {
        let event = Event::Request { vehicle: VEHICLES[vehicle].into(), token: Token(1), request };
        self.tower.on(self.now, event, &mut Vec::new());
    }

    fn ask(&mut self, vehicle: usize, area: String) {
        self.requests += 1;
        let request = v1::PermissionRequest {
            request_id: self.requests.to_string(),
            step_id: 1,
            latest_decision: self.beliefs[vehicle].highest(),
            flight: self.flight(vehicle),
            extent: self.beliefs[vehicle].extent(&area).map(Into::into),
            entered_because: String::new(),
            area,
        };
        self.send(vehicle, Request::Permission(request));
    }

    fn pass(&mut self, s: u64) {
        let time = self.now.time + Duration::from_secs(s);
        self.now = Now { time, utc_ms: self.now.utc_ms + 1000 * s as i64 };
    }

    fn store(&mut self) {
        let memory = self.tower.memory();
        self.disk = Some(memory.clone());
        self.tower.memory_saved(&memory);
    }

    fn restart(&mut self, prepare: impl FnOnce(&mut ControlTower, Option<v1::TowerMemory>)) {
        self.starts += 1;
        // No tower starts within the millisecond in which the one before has decided: a number is not given out twice.
        self.pass(1);
        self.tower = tower(self.starts);
        prepare(&mut self.tower, self.disk.clone());
        // As the shell does at each start.
        self.store();
    }

    fn act(&mut self) {
        let mut effects = Vec::new();
        self.tower.act(self.now, &mut effects);
        for effect in effects {
            let Effect::Publish { vehicle: Some(vehicle), message: Message::PermissionLedger(ledger) } = effect else {
                continue;
            };
            for it in ledger.permissions.iter().filter(|it| it.state() == v1::PermissionState::Granted) {
                let (area, number) = (it.area.clone(), it.decision);
                let of_vehicle = |it: &v1::TowerMemory| it.ledgers.iter().find(|it| *it.vehicle == *vehicle).cloned();
                let stored = self.disk.as_ref().and_then(of_vehicle).map_or(0, |it| it.last_decision);
                assert!(number <= stored, "grant {number} is out, and the disk knows those up to {stored}");
                let extent = it.extent.clone().map(|it| it.try_into().expect("an extent"));
                let given = (vehicle.to_string(), area, number, it.expires_utc_ms, it.flight.clone(), extent);
                self.given.push(given);
            }
            self.published.push((vehicle.to_string(), ledger));
        }
    }

    fn deliver(&mut self, message: usize, vehicle: usize, change: Option<Change>) {
        let Some((of, wire)) = self.published.iter().rev().nth(message).cloned() else { return };
        let mut lines = ledger(wire).expect("what the tower publishes makes sense");
        match change {
            Some(change) => lines.iter_mut().for_each(|it| change.of(it)),
            None if of == VEHICLES[vehicle] => self.note_refusals(&of, &lines),
            None => {}
        }
        let taken = self.beliefs[vehicle].take(self.now, Pace::REAL_TIME, lines);
        taken.to_ask.into_iter().for_each(|it| self.ask(vehicle, it.area));
    }

    fn note_refusals(&mut self, vehicle: &str, lines: &[Permission]) {
        use PermissionState::{Denied, Revoked};
        for it in lines.iter().filter(|it| [Denied, Revoked].contains(&it.state)) {
            let known = self.refused.entry((vehicle.to_owned(), it.area.clone())).or_default();
            *known = it.decision.max(*known);
        }
    }

    fn check(&mut self) -> Result<(), TestCaseError> {
        for (vehicle, belief) in self.beliefs.iter().enumerate() {
            let name = VEHICLES[vehicle].to_owned();
            for area in ["A", "B", "AA", "BA"] {
                let Some(remaining) = belief.remaining(area, self.now.time) else { continue };
                self.believed += 1;
                let it = belief.permission(area).expect("it is believed");
                let flight = self.flight(vehicle);
                let place = areas(self.places[vehicle]).iter().find(|it| it.name == area).map(Area::extent);
                let given = self.given.iter().find(|(of, what, number, expires_utc_ms, during, at)| {
                    // Of one that is remembered over a restart, the end is reckoned by the clock then.
                    let is_whole = it.signature.is_empty() || *expires_utc_ms == it.expires_utc_ms;
                    let is_for_it = (of, what, during, at) == (&name, &area.to_owned(), &flight, &place);
                    *number == it.decision && is_for_it && is_whole
                });
                prop_assert!(given.is_some(), "{it:?} was never given");
                let left_ms = given.map_or(0, |it| it.3) - self.now.utc_ms;
                prop_assert!(remaining.as_millis() as i64 <= left_ms, "{remaining:?} of {left_ms} ms");
                let refused = self.refused.get(&(name.clone(), area.to_owned())).copied().unwrap_or_default();
                prop_assert!(refused < it.decision, "{it:?} is believed after decision {refused}");
            }
        }
        Ok(())
    }
}

impl Change {
    fn of(self, line: &mut Permission) {
        match self {
            Change::Area => line.area.push('A'),
            Change::Granted => line.state = PermissionState::Granted,
            Change::Window => line.expires_utc_ms += 1_000_000,
            // Not signed, and bounded by what is.
            Change::Length => line.valid_for += Duration::from_secs(1000),
            Change::Number(by) => line.decision = line.decision.saturating_add_signed(by.into()),
            Change::Flight => line.flight = "flight 2".into(),
            Change::Place => line.extent = areas(100.0).first().map(Area::extent),
            Change::Unsigned => line.signature.clear(),
            Change::OtherKey => {
                line.state = PermissionState::Granted;
                line.signature = SecretKey::of_seed([2; 32]).expect("a key").sign(line);
            }
        }
    }
}

fn tower(start: u64) -> ControlTower {
    let config = toml::from_str(CONFIG).expect("it is a configuration");
    let tower = ControlTower::new(&config, Policy::Grant, 1, Pace::REAL_TIME, 1 + start);
    tower.that_is_stored().that_signs_with(key())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_vehicle_believes_only_what_the_tower_has_given_and_not_taken_back(
        steps in prop::collection::vec(step(), 1..120),
    ) {
        let mut model = Model::new();
        for step in &steps {
            model.take(step);
            model.check()?;
        }
    }
}

#[test]
fn without_an_adversary_a_grant_is_believed_until_it_is_revoked_over_restarts_of_both() {
    let mut model = Model::new();
    let deliver = Step::Deliver { message: 0, vehicle: 0, change: None };
    let mut held_after = |steps: &[Step]| {
        steps.iter().for_each(|it| model.take(it));
        model.check().unwrap();
        model.beliefs[0].remaining("A", model.now.time).is_some()
    };
    let ask = Step::Ask { vehicle: 0, area: 0 };
    assert!(!held_after(&[ask, deliver.clone()]), "it is not on the disk yet");
    assert!(held_after(&[Step::Store, deliver.clone()]));
    assert!(held_after(&[Step::KillTower, deliver.clone()]));
    assert!(held_after(&[Step::KillVehicle { vehicle: 0 }, deliver.clone()]));
    let revoke = Step::Decide { vehicle: 0, area: 0, decision: v1::Decision::Revoke as i32 };
    assert!(!held_after(&[revoke, deliver.clone()]));
    let late = |message| Step::Deliver { message, vehicle: 0, change: None };
    assert!(!held_after(&[Step::KillVehicle { vehicle: 0 }, late(1), late(2), late(3)]));
    assert!(0 < model.believed);
}

/// Hears the newest ledger.
const DELIVER: Step = Step::Deliver { message: 0, vehicle: 0, change: None };
const ASK: Step = Step::Ask { vehicle: 0, area: 0 };

impl Model {
    /// Whether the vehicle holds area A after this.
    fn holds_after(&mut self, steps: &[Step]) -> bool {
        steps.iter().for_each(|it| self.take(it));
        self.check().unwrap();
        self.beliefs[0].remaining("A", self.now.time).is_some()
    }
}

#[test]
fn a_tower_that_has_lost_its_numbers_and_whose_clock_was_set_back_takes_a_grant_back() {
    #[track_caller]
    fn check(is_noticed: bool, decision: v1::Decision) {
        let mut model = Model::new();
        assert!(model.holds_after(&[ASK, Step::Store, DELIVER]));
        model.now.utc_ms -= 7_200_000;
        let says_no = Step::Decide { vehicle: 0, area: 0, decision: decision as i32 };
        assert!(model.holds_after(&[Step::LoseLedger { is_noticed }, says_no, DELIVER]), "it looks like a recording");
        assert!(!model.holds_after(&[DELIVER]), "the vehicle has asked, and this is the answer");
        let grant = Step::Decide { vehicle: 0, area: 0, decision: v1::Decision::Grant as i32 };
        assert!(model.holds_after(&[Step::AcceptLoss, grant, Step::Store, DELIVER]), "later grants are believed");
    }
    check(true, v1::Decision::Revoke);
    check(true, v1::Decision::Deny);
    check(false, v1::Decision::Deny);
}

#[test]
fn a_recording_of_an_old_denial_takes_nothing_back() {
    let mut model = Model::new();
    let decide = |decision: v1::Decision| Step::Decide { vehicle: 0, area: 0, decision: decision as i32 };
    assert!(!model.holds_after(&[decide(v1::Decision::Deny), ASK, DELIVER]));
    assert!(model.holds_after(&[decide(v1::Decision::Grant), Step::Store, DELIVER]));
    let denied = |it: &(String, v1::PermissionLedger)| it.1.permissions[0].state() == v1::PermissionState::Denied;
    let is_denial = |(_, ledger): &&(String, v1::PermissionLedger)| !ledger.permissions.is_empty();
    let message = model.published.iter().rev().filter(is_denial).position(denied).expect("it was published");
    assert!(model.holds_after(&[Step::Deliver { message, vehicle: 0, change: None }]));
    assert!(model.holds_after(&[Step::Store, DELIVER]));
}

#[test]
fn a_recording_of_a_grant_that_was_revoked_during_a_restart_lets_nobody_in() {
    let mut model = Model::new();
    assert!(model.holds_after(&[ASK, Step::Store, DELIVER]));
    let granted = model.published.len() - 1;
    let revoke = Step::Decide { vehicle: 0, area: 0, decision: v1::Decision::Revoke as i32 };
    model.holds_after(&[revoke, Step::KillVehicle { vehicle: 0 }]);
    let message = model.published.len() - 1 - granted;
    let asked = model.requests;
    assert!(model.holds_after(&[Step::Deliver { message, vehicle: 0, change: None }]), "where it is it may stay");
    let is_restored = model.beliefs[0].decided("A").is_some_and(|it| !it.is_live());
    assert!(is_restored && asked < model.requests, "the tower is asked");
    assert!(!model.holds_after(&[Step::Store, DELIVER]));
}

#[test]
fn a_grant_is_over_with_its_flight_and_its_place_and_a_new_one_is_asked_for_over_restarts_of_both() {
    use Step::{KillTower, KillVehicle, NewFlight, Upload};
    let killed = [&[][..], &[KillTower, Step::Store, DELIVER], &[KillVehicle { vehicle: 0 }, DELIVER]];
    for (changed, killed) in
        [NewFlight { vehicle: 0 }, Upload { vehicle: 0 }].iter().flat_map(|it| killed.map(|k| (it, k)))
    {
        let mut model = Model::new();
        let decide = |decision: v1::Decision| Step::Decide { vehicle: 0, area: 0, decision: decision as i32 };
        assert!(model.holds_after(&[ASK, Step::Store, DELIVER]));
        let granted = model.published.len() - 1;
        assert!(!model.holds_after(&[changed.clone(), DELIVER]), "what was held is for something else");
        assert!(!model.holds_after(killed) && !model.holds_after(&[decide(v1::Decision::Revoke)]));
        // The vehicle has not heard that, and somebody plays it the grant.
        let message = model.published.len() - 1 - granted;
        assert!(!model.holds_after(&[Step::Deliver { message, vehicle: 0, change: None }]));
        assert!(!model.holds_after(&[ASK, Step::Store, DELIVER]), "it was revoked by hand");
        assert!(model.holds_after(&[decide(v1::Decision::Grant), Step::Store, DELIVER]), "for what was asked last");
    }
}
