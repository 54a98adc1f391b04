//! Skills of one's own: a process that carries out a declared skill, beside real processes, and its examination.

use std::path::Path;
use std::time::Duration;

use bus::{Link, Scope};
use kittiwake::flood::Flood;
use kittiwake_proto::v1::{TaskReport, TaskState};
use kittiwake_skill::{CANCELLED, Offer, Stop, Task, offer};

use crate::support::files::Files;
use crate::support::{System, kittiwake};

const MISSION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/config/missions/winch.toml");

/// A process in a thread; it ends with this.
struct Background(Stop);

impl Background {
    fn offered_to(system: &System, work: fn(&Task) -> String) -> Background {
        let stop = Stop::new();
        let offered =
            Offer { connect: system.locator(), vehicle: "uav1".into(), skill: "winch_down".into(), version: 1 };
        let until = stop.clone();
        std::thread::spawn(move || offer(offered, &until, work));
        Background(stop)
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// A second, or until it is cancelled.
fn lowers(task: &Task) -> String {
    if task.is_cancelled_within(Duration::from_secs(1)) { CANCELLED.into() } else { "delivered".into() }
}

#[test]
fn a_mission_waits_for_its_winch_and_flies_with_it() {
    let system = System::start(&["--speed", "5", "--mission", MISSION]);
    let raised = system.wait_for("flag `skill_missing` raised");
    assert!(raised.contains("no process offers skill `winch_down`"), "{raised}");
    let _winch = Background::offered_to(&system, lowers);
    system.wait_for("winch_down (length_m 12) over (120, 60, 15)");
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}

/// Ten thousand reports a second, of a task that nobody has ordered, beside those of the winch.
#[test]
fn a_flood_of_reports_delays_no_mission() {
    let system = System::start(&["--speed", "3", "--mission", MISSION]);
    let _winch = Background::offered_to(&system, lowers);
    let link = Link {
        connect: vec![system.locator()],
        scope: Scope::Vehicle("uav1".into()),
        open_timeout: Duration::from_secs(10),
    };
    let report = |number| TaskReport {
        skill: "winch_down".into(),
        version: 1,
        request_id: "of nobody".into(),
        progress: number as f64 / 1e9,
        state: TaskState::Running as i32,
        ..Default::default()
    };
    let stop = Stop::new();
    std::thread::scope(|scope| {
        scope.spawn(|| bus::Process::of(&mut Flood::new(10_000, u64::MAX, report), &link).run(&stop));
        // Ends it also where the mission fails: the scope waits for it.
        let _flood = Background(stop.clone());
        system.wait_for("winch_down (length_m 12) over (120, 60, 15)");
        system.end().expect(0, &["SUCCESS", "SUCCESS"]);
    });
}

#[test]
fn an_examination_tells_a_process_that_keeps_to_the_exchange_from_one_that_does_not() {
    let system = System::waiting(&Files::begun_by_operator(), &[]);
    let examine = || {
        let output = kittiwake(&["skill", "test", "winch_down", "--pid", &system.pid().to_string()]);
        (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let failed = |told: &str| told.lines().filter(|it| it.starts_with("FAIL")).count();

    let (code, told) = examine();
    assert_eq!((code, failed(&told)), (Some(1), 1), "nobody is there:\n{told}");

    let winch = Background::offered_to(&system, lowers);
    let (code, told) = examine();
    assert_eq!((code, failed(&told)), (Some(0), 0), "{told}");
    assert_eq!(told.lines().count(), 8, "{told}");
    drop(winch);

    let with_words_of_its_own = |task: &Task| {
        let cancelled = task.is_cancelled_within(Duration::from_secs(1));
        if cancelled { "stopped".to_owned() } else { "lowered".to_owned() }
    };
    let _other = Background::offered_to(&system, with_words_of_its_own);
    let (code, told) = examine();
    assert_eq!((code, failed(&told)), (Some(1), 2), "{told}");
    let expected = ["lowered after", "stopped after"];
    assert!(expected.iter().all(|it| told.lines().any(|line| line.starts_with("FAIL") && line.contains(it))), "{told}");
}

#[test]
fn an_examination_kills_and_restarts_a_process_that_it_has_started() {
    let system = System::waiting(&Files::begun_by_operator(), &[]);
    let winch = Path::new(env!("CARGO_BIN_EXE_kittiwake")).with_file_name("examples/winch").display().to_string();
    let (pid, locator) = (system.pid().to_string(), system.locator());
    let output =
        kittiwake(&["skill", "test", "winch_down", "--input", "length_m=3", "--pid", &pid, "--", &winch, &locator]);
    let told = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{told}");
    assert!(told.contains("pass  killed in a task and started again, it is ready"), "{told}");
    assert_eq!(told.lines().count(), 9, "{told}");
}
