//! What was known before a process died in flight: that the vehicle flies, in which frame, and that its autopilot holds by itself. No
//! death makes the vehicle fly on.

use nix::sys::signal::Signal;
use serde_json::Value;

use crate::support::{System, wait_for};

/// Flies, then something happens that raises `flag`, then these processes die; the flag stays up, and the vehicle where it is.
#[track_caller]
fn check(fault: &[&str], flag: &str, dying: &[&str]) {
    let system = System::on_long_leg("5");
    let is_up = |status: &Value| {
        let active = status["contingencies"]["active"].as_array().cloned().unwrap_or_default();
        active.iter().any(|it| it["flag"] == flag)
    };
    let injected = system.inject(&[&["fault"], fault].concat());
    assert!(injected.status.success(), "{injected:?}");
    wait_for(&format!("`{flag}`"), || is_up(&system.status()).then_some(()));
    let back = format!("flag `{flag}` is up since before the mission manager was started again");
    for process in dying {
        system.process(process).signal(Signal::SIGKILL);
    }
    system.wait_for(&back);
    // The gateway has nothing to show until it hears the new manager.
    wait_for(&format!("`{flag}` again"), || is_up(&system.status()).then_some(()));
    let time_s = |it: &Value| it["missionTimeS"].as_f64().unwrap_or_default();
    let until = time_s(&system.status()) + 30.0;
    wait_for("half a minute", || {
        let status = system.status();
        assert!(is_up(&status), "`{flag}` was forgotten: {}", status["contingencies"]);
        (until <= time_s(&status)).then_some(())
    });
    assert_eq!(system.status()["aircraft"]["status"]["actualMode"], "FLIGHT_MODE_LOITER");
    system.launcher().signal(Signal::SIGINT);
    let ending = system.end();
    let mut since = ending.lines.iter().skip_while(|it| !it.contains(&back));
    let is_over = format!("`{flag}` is over");
    assert!(
        !since.any(|it| it.contains(": fly to (") || it.contains(&is_over)),
        "no step follows:\n{}",
        ending.lines.join("\n")
    );
}

#[test]
fn a_frame_that_moved_is_not_that_of_the_mission_for_another_manager() {
    check(&["frame_jump", "60", "0", "0"], "frame_moved", &["mcm"]);
    check(&["frame_jump", "60", "0", "0"], "frame_moved", &["monitor", "mcm", "skill-manager"]);
}

#[test]
fn an_autopilot_that_holds_by_itself_is_left_alone_by_those_who_come_back() {
    check(&["autopilot_failsafe", "hold"], "autopilot_preempts", &["mcm", "monitor", "skill-manager"]);
}

#[test]
fn a_manager_that_comes_back_before_the_monitor_stops_the_vehicle() {
    let system = System::on_long_leg("2");
    let monitor = system.process("monitor");
    monitor.signal(Signal::SIGSTOP);
    system.process("mcm").signal(Signal::SIGKILL);
    system.wait_for("contingency: `introspection_lost`: stop");
    system.wait_for("monitor does not answer for 3s: killed");
    system.wait_for("contingency: `introspection_lost` is over");
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
}
