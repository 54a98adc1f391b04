//! What a mission manager remembers, over disks that work, hang and fail.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender};

use control_tower::ControlTower;
use control_tower::policy::Policy;
use domain::time::Pace;
use kittiwake_proto::topics::{Message, Request};
use kittiwake_proto::v1;
use mcm::Mcm;
use planner::Planner;
use v1::mission_request::Request as Ask;

use super::*;
use crate::check_inputs::{self, Inputs};
use crate::run::state_folder;
use crate::settings::Settings;

/// One that has taken in its first moment.
fn manager() -> Mcm {
    let settings = Settings::of_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config/kittiwake.toml"));
    let Inputs { config, mission, contingencies, trees, .. } = check_inputs::read(&settings).unwrap();
    let pace = config.speed.pace();
    let mut mcm = Mcm::new(&config.mcm, &config.aircraft(), "uav1", 1, &trees, contingencies, pace).unwrap();
    mcm = mcm.of_mission(&mission);
    mcm.act(Now::default(), &mut Vec::new());
    mcm
}

/// A manager with its memory in `folder`.
fn in_folder(folder: &Path) -> Result<Persisted<Mcm>, StartError> {
    let folder = folder.to_owned();
    let open = move || state_folder::open(&folder, "mcm", "uav1", Mcm::FORMAT, false);
    Persisted::new(manager(), 1, open, || {})
}

/// Another mission takes the place of the present one, as a planner answers; the replies that come at once.
fn upload(persisted: &mut Persisted<Mcm>) -> usize {
    let text =
        "name = \"other\"\n[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 50\nheight_m = 5\nflying = true\n";
    let request = v1::MissionRequest {
        request_id: "1".into(),
        request: Some(Ask::Upload(v1::MissionText { text: text.into(), wind: None })),
        ..Default::default()
    };
    let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request: Request::Mission(request) };
    let mut effects = Vec::new();
    persisted.on(Now::default(), event, &mut effects);
    persisted.act(Now::default(), &mut effects);
    assert!(persisted.answers_later(Token(1)), "the planner works it out");
    let (call, request) = effects
        .iter()
        .find_map(|it| match it {
            Effect::Call { call, request: request @ Request::Edit(_), .. } => Some((*call, request.clone())),
            _ => None,
        })
        .expect("the planner is asked");
    let settings = Settings::of_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config/kittiwake.toml"));
    let config = check_inputs::read(&settings).unwrap().config;
    let mut planner = Planner::new(&config.planner, &config.aircraft(), config.speed.pace());
    let mut answers = Vec::new();
    planner.on(Now::default(), Event::Request { vehicle: "uav1".into(), token: Token(2), request }, &mut answers);
    let Some(Effect::Reply { response, .. }) = answers.pop() else { panic!("{answers:?}") };
    let mut effects = Vec::new();
    persisted.on(Now::default(), Event::Reply { call, result: Ok(response) }, &mut effects);
    persisted.act(Now::default(), &mut effects);
    replies(&effects)
}

fn replies(effects: &[Effect]) -> usize {
    effects.iter().filter(|it| matches!(it, Effect::Reply { .. })).count()
}

/// Lets it act until it replies.
fn act_until_reply(persisted: &mut Persisted<Mcm>, woken: &Receiver<()>) {
    loop {
        let mut effects = Vec::new();
        persisted.act(Now::default(), &mut effects);
        if 0 < replies(&effects) {
            return;
        }
        assert!(persisted.answers_later(Token(1)), "the reply is neither there nor to come");
        // The loop turns without being woken, too.
        let _ = woken.recv_timeout(Duration::from_millis(20));
    }
}

fn mission(persisted: &Persisted<Mcm>) -> String {
    persisted.service.memory().mission.and_then(|it| it.status).unwrap().mission
}

fn loss(persisted: &Persisted<Mcm>) -> Option<String> {
    persisted.service.memory().loss.map(|it| it.why)
}

/// A disk of which a test decides what happens with each state. What it has written it writes a second time without being asked.
struct Gate {
    verdicts: Receiver<io::Result<()>>,
    written: Vec<u8>,
}

impl Medium for Gate {
    fn prepare(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn lock(&mut self, _: &str) -> io::Result<bool> {
        Ok(true)
    }

    fn read(&mut self, _: &str) -> io::Result<Option<Vec<u8>>> {
        Ok(None)
    }

    fn write(&mut self, _: &str, record: &[u8]) -> io::Result<()> {
        // After the lines of the header, of which one is the generation.
        let state = record.split(|it| *it == b'\n').next_back().unwrap_or_default();
        if state == self.written {
            return Ok(());
        }
        // Open once the test drops its end.
        self.verdicts.recv().unwrap_or(Ok(()))?;
        self.written = state.to_owned();
        Ok(())
    }

    fn rename(&mut self, _: &str, _: &str) -> io::Result<()> {
        Ok(())
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn exists(&mut self, _: &str) -> bool {
        false
    }

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }
}

/// A service over a gate, through which the first state has gone.
fn gated<N: Resumable>(service: N) -> (Persisted<N>, Sender<io::Result<()>>, Receiver<()>) {
    #[expect(clippy::disallowed_methods, reason = "a handful of verdicts")]
    let (verdicts, received) = mpsc::channel();
    let (wake, woken): (SyncSender<()>, _) = mpsc::sync_channel(1);
    verdicts.send(Ok(())).unwrap();
    let gate = Gate { verdicts: received, written: Vec::new() };
    let open = || Store::over(gate, "service", "uav1", N::FORMAT);
    let persisted = Persisted::new(service, 1, open, move || _ = wake.try_send(())).unwrap();
    assert_eq!(persisted.outcome, Some(Ok(())));
    (persisted, verdicts, woken)
}

#[test]
fn an_uploaded_mission_is_there_after_a_restart_and_gone_with_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = in_folder(folder.path()).unwrap();
    upload(&mut first);
    drop(first);
    let second = in_folder(folder.path()).unwrap();
    assert_eq!((mission(&second), loss(&second)), ("other".into(), None));
    let elsewhere = tempfile::tempdir().unwrap();
    assert_eq!(mission(&in_folder(elsewhere.path()).unwrap()), "reference");
}

#[test]
fn a_state_that_cannot_be_used_is_a_loss() {
    #[track_caller]
    fn check(text: &str, format: u32, expected: Option<&str>) {
        let folder = tempfile::tempdir().unwrap();
        let (mut store, _) = state_folder::open(folder.path(), "mcm", "uav1", format, false).unwrap();
        store.save(text.as_bytes()).unwrap();
        drop(store);
        let persisted = in_folder(folder.path()).unwrap();
        let found = loss(&persisted);
        assert_eq!((mission(&persisted), found.is_some()), ("reference".into(), expected.is_some()), "{text}");
        assert!(expected.is_none_or(|it| found.is_some_and(|found| found.contains(it))), "{text}");
    }
    let of_this = to_json(&manager().memory()).to_string();
    check(&of_this, Mcm::FORMAT, None);
    check(&of_this, 2, Some("an earlier version of the program has saved it, in format 2, expected 3"));
    check("{", Mcm::FORMAT, Some(""));
    check("{\"a\":1}", Mcm::FORMAT, Some(""));
    // A state without a mission belongs to another one.
    check("{}", Mcm::FORMAT, None);
}

/// On the ground it is refused, and an operator decides; a vehicle in the air holds until an operator decides.
#[test]
fn a_state_of_another_version_begins_nothing_on_the_ground_and_holds_the_vehicle_in_the_air() {
    #[track_caller]
    fn check(flying: bool, expected: &[&str]) {
        let folder = tempfile::tempdir().unwrap();
        let (mut store, _) = state_folder::open(folder.path(), "mcm", "uav1", Mcm::FORMAT - 1, false).unwrap();
        store.save(to_json(&manager().memory()).to_string().as_bytes()).unwrap();
        drop(store);
        let mut persisted = in_folder(folder.path()).unwrap();
        let (mut asked, mut reasons) = (Vec::new(), Vec::new());
        for tick in 1..20 {
            let now = Now { time: Time::after(Duration::from_millis(100) * tick), ..Now::default() };
            let (vehicle, message) = ("uav1".into(), Message::Introspection(seen(flying)));
            let mut effects = Vec::new();
            persisted.on(now, Event::Message { vehicle, message }, &mut effects);
            persisted.act(now, &mut effects);
            for effect in effects {
                match effect {
                    Effect::Call { request: Request::Skill(request), .. } => asked.extend(request.goal),
                    Effect::Call { request: Request::Replan(_), .. } => panic!("a plan is asked for"),
                    Effect::Publish { message: Message::McmStatus(status), .. } => {
                        reasons = status.contingencies.into_iter().map(|it| it.reason).collect();
                    }
                    _ => {}
                }
            }
        }
        let goals: Vec<_> = asked.iter().map(|it| format!("{:?}", it.goal)).collect();
        assert!(goals.iter().all(|it| it.contains("Stop")) && !(flying && goals.is_empty()), "{goals:?}");
        assert_eq!(reasons, expected);
    }
    let why = ["an earlier version of the program has saved it, in format 2, expected 3"];
    check(false, &why);
    check(true, &why);
}

/// What the monitor says of a vehicle that hovers, or stands.
fn seen(flying: bool) -> v1::Introspection {
    let mode = v1::FlightMode::Loiter as i32;
    let position = Some(v1::Ned { down_m: if flying { -10.0 } else { 0.0 }, ..Default::default() });
    let velocity = Some(v1::NedVelocity::default());
    let zero = Some(0.0);
    v1::Introspection {
        status: Some(v1::VehicleStatus { armed: flying, intended_mode: mode, actual_mode: mode, ..Default::default() }),
        local_position: Some(v1::VehicleLocalPosition {
            position,
            velocity,
            vertical_valid: true,
            ..Default::default()
        }),
        land_detected: Some(v1::VehicleLandDetected { landed: !flying, ..Default::default() }),
        battery: Some(v1::BatteryStatus { remaining: 1.0, ..Default::default() }),
        ages: Some(v1::SourceAges {
            status_s: zero,
            local_position_s: zero,
            land_detected_s: zero,
            battery_s: zero,
            ..Default::default()
        }),
        ..Default::default()
    }
}

#[test]
fn a_generation_that_is_garbled_is_a_loss_and_the_one_before_is_used() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = in_folder(folder.path()).unwrap();
    upload(&mut first);
    drop(first);
    std::fs::write(folder.path().join("mcm.1"), "garbled").unwrap();
    let second = in_folder(folder.path()).unwrap();
    let why = loss(&second).unwrap();
    assert!(why.contains("is garbled") && why.ends_with("the state before it is used"), "{why}");
}

#[test]
fn an_order_outlives_either_file_of_the_state() {
    for file in ["mcm.0", "mcm.1"] {
        let folder = tempfile::tempdir().unwrap();
        let mut first = in_folder(folder.path()).unwrap();
        upload(&mut first);
        drop(first);
        std::fs::write(folder.path().join(file), "garbled").unwrap();
        let second = in_folder(folder.path()).unwrap();
        assert_eq!((mission(&second), loss(&second).is_some()), ("other".into(), true), "without {file}");
    }
}

#[test]
fn a_second_process_does_not_start() {
    let folder = tempfile::tempdir().unwrap();
    let _first = in_folder(folder.path()).unwrap();
    assert!(matches!(in_folder(folder.path()), Err(StartError::InUse(_))));
}

#[test]
fn an_answer_waits_until_what_it_depends_on_is_written() {
    let (mut persisted, verdicts, woken) = gated(manager());
    assert_eq!(upload(&mut persisted), 0);
    assert!(persisted.answers_later(Token(1)));
    verdicts.send(Ok(())).unwrap();
    act_until_reply(&mut persisted, &woken);
    assert!(!persisted.answers_later(Token(1)));
    drop(verdicts);
}

#[test]
fn an_answer_does_not_wait_for_a_disk_that_fails_or_hangs() {
    for fails in [true, false] {
        let (mut persisted, verdicts, woken) = gated(manager());
        assert_eq!(upload(&mut persisted), 0);
        if fails {
            verdicts.send(Err(io::ErrorKind::StorageFull.into())).unwrap();
        }
        act_until_reply(&mut persisted, &woken);
        let mut effects = Vec::new();
        persisted.act(Now::default(), &mut effects);
        let words = if fails { "there is no space" } else { "the disk has not answered" };
        assert!(persisted.outcome.clone().unwrap().unwrap_err().contains(words));
        // The retry works.
        drop(verdicts);
        while persisted.outcome != Some(Ok(())) {
            persisted.act(Now::default(), &mut Vec::new());
            let _ = woken.recv_timeout(Duration::from_millis(20));
        }
    }
}

/// A tower over a gate, through which the first state has gone.
fn gated_tower() -> (Persisted<ControlTower>, Sender<io::Result<()>>, Receiver<()>) {
    let settings = Settings::of_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config/kittiwake.toml"));
    let config = check_inputs::read(&settings).unwrap().config.control_tower;
    let tower = ControlTower::new(&config, Policy::Grant, 1, Pace::REAL_TIME, 1).that_is_stored();
    gated(tower)
}

#[test]
fn grants_are_published_although_each_state_that_is_saved_is_outdated_by_then() {
    let (mut persisted, verdicts, woken) = gated_tower();
    let mut published = std::collections::BTreeSet::new();
    for n in 0..30 {
        // The disk saves one state while the next ones arrive.
        for (vehicle, part) in [("uav1", "first"), ("uav1", "second"), ("uav2", "only")] {
            if vehicle == "uav2" && 0 < n {
                continue;
            }
            let (request_id, area) = (format!("{part} {n}"), "A".to_owned());
            let request = Request::Permission(v1::PermissionRequest {
                request_id,
                area,
                flight: "f".into(),
                extent: Some(v1::AreaExtent { outline: vec![0; 32], ..Default::default() }),
                ..Default::default()
            });
            let event = Event::Request { vehicle: vehicle.into(), token: Token(n), request };
            persisted.on(Now::default(), event, &mut Vec::new());
            let mut effects = Vec::new();
            persisted.act(Now::default(), &mut effects);
            published.extend(effects.into_iter().filter_map(granted_to));
        }
        assert!(persisted.handed_over.len() <= 3, "no more are kept than are under way");
        assert!(persisted.writer.progress().done < persisted.number(), "the newest still waits");
        verdicts.send(Ok(())).unwrap();
        woken.recv().unwrap();
    }
    assert_eq!(published.into_iter().collect::<Vec<_>>(), ["uav1", "uav2"]);
    drop(verdicts);
}

/// The vehicle that hears of a grant.
fn granted_to(effect: Effect) -> Option<String> {
    let Effect::Publish { vehicle, message: Message::PermissionLedger(ledger) } = effect else { return None };
    let is_granted = ledger.permissions.iter().any(|it| it.state() == v1::PermissionState::Granted);
    vehicle.filter(|_| is_granted).map(|it| it.to_string())
}
