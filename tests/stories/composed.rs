//! Several nodes in one process: the same flights, the same signs of life, and one death for all of them.

use std::time::Duration;

use kittiwake_proto::topics::Service;
use kittiwake_proto::v1::{MissionRequest, MissionText, mission_request};
use nix::sys::signal::Signal;
use prost::Message as _;
use serde_json::Value;
use zenoh::Wait;

use crate::stories::bad_messages::stranger;
use crate::support::files::{Files, state_folder};
use crate::support::{KITTIWAKE, LIMIT, System, kittiwake, shipped, wait_for};

/// What flies along, but for the simulated vehicle.
const USUAL: &str = "mcm,skill-manager,monitor,planner";

/// A system with the usual nodes in one process, on a long leg in the air.
#[track_caller]
fn on_long_leg(speed: &str) -> System {
    flying_with(&Files::with_long_leg(), speed)
}

#[track_caller]
fn flying_with(files: &Files, speed: &str) -> System {
    let config = files.config();
    let config = config.to_str().expect("a readable path");
    let system = System::start(&["--onboard", USUAL, "--config", config, "--speed", speed]);
    system.wait_for_long_leg();
    system
}

/// The names of the launcher's children.
fn children(system: &System) -> Vec<String> {
    let mut names: Vec<_> = system.children().into_iter().map(|(name, _)| name).collect();
    names.sort();
    names
}

#[test]
fn the_reference_mission_is_achieved_with_four_nodes_in_one_process() {
    let system = System::start(&["--onboard", USUAL]);
    system.wait_for(" is up: ");
    assert_eq!(children(&system), ["control-tower", "gateway", "onboard", "router", "vehicle-sim"]);
    let ending = system.end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    // No node has heard anything twice: each step begins and succeeds once.
    for step in 1..=5 {
        let begun = format!("step {step} of 5: ");
        let count = ending.lines.iter().filter(|it| it.contains(&begun)).count();
        assert_eq!(count, 1, "`{begun}` in:\n{}", ending.lines.join("\n"));
    }
}

#[test]
fn the_whole_vehicle_in_one_process_achieves_the_mission() {
    let all = "vehicle-sim,mcm,skill-manager,monitor,planner";
    let system = System::start(&["--onboard", all]);
    system.wait_for(" is up: ");
    assert_eq!(children(&system), ["control-tower", "gateway", "onboard", "router"]);
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}

#[test]
fn each_hosted_node_is_healthy_under_its_own_name() {
    let system = System::start(&["--onboard", USUAL, "--speed", "1"]);
    let locator = system.locator();
    for node in USUAL.split(',') {
        let args = ["health", "--process", node, "--vehicle", "uav1", "--connect", &locator];
        wait_for(&format!("the health of {node}"), || {
            let output = kittiwake(&args);
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            (output.status.success() && said.starts_with(&format!("{node}: up for "))).then_some(())
        });
    }
    let http = system.http();
    wait_for("readiness", || (http.get("/readyz").status == 200).then_some(()));
    let processes = wait_for("the processes", || system.status()["processes"].as_array().cloned());
    let of = |name: &str| processes.iter().find(|it| it["service"] == name).map(|it| it["heartbeat"]["pid"].clone());
    let pid = Value::from(system.process("onboard").id().as_raw());
    for node in USUAL.split(',') {
        assert_eq!(of(node).as_ref(), Some(&pid), "{processes:?}");
    }
}

#[test]
fn a_composition_that_is_killed_in_flight_comes_back_with_its_memory_and_the_mission_is_achieved() {
    let system = on_long_leg("3");
    let killed = system.process("onboard");
    killed.signal(Signal::SIGKILL);
    system.wait_for("onboard ended by signal 9");
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    // From where it is: nodes without their memory would have waited on the ground, or taken off.
    ending.expect_in_order(&["onboard ended by signal 9", ": fly to (0, 2000, 10); land", "step 1 of 2: fly to"]);
}

#[test]
fn a_composition_that_hangs_is_killed_and_started_again_as_one() {
    let system = on_long_leg("2");
    let hung = system.process("onboard");
    hung.signal(Signal::SIGSTOP);
    system.wait_for("onboard does not answer for 3s: killed");
    wait_for("the process to be gone", || (!hung.runs()).then_some(()));
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    let accused = |name: &str| ending.lines.iter().any(|it| it.contains(&format!("{name} does not answer")));
    assert!(!["router", "gateway", "vehicle-sim"].into_iter().any(accused), "{}", ending.lines.join("\n"));
}

/// Operators may ask for more than one thread can answer.
#[test]
fn a_burst_of_what_ifs_does_not_end_a_composed_aircraft() {
    let patient = Files::with_long_leg().with("kittiwake.toml", "hung_after_s = 3.0", "hung_after_s = 12.0");
    let system = flying_with(&patient, "1");
    let objective = |it: u32| {
        let (north, east) = (it % 20 * 10, it / 20 * 10);
        format!("[[objective]]\nname = \"{it}\"\nnorth_m = {north}\neast_m = {east}\nheight_m = 10\nflying = true\n")
    };
    // Each leg is compared with each site: a tenth of a second for each question, and 14 for all, which is longer than nobody may answer.
    let site = |it| format!("[[site]]\nname = \"{it}\"\nkind = \"landing\"\nnorth_m = {}\neast_m = -50\n", it * 10);
    let text = (0..200).map(objective).chain((0..32).map(site)).collect::<String>();
    let text = format!("name = \"many\"\n{text}");
    let validate = mission_request::Request::Validate(MissionText { text, ..Default::default() });
    let asking = stranger(&system.locator());
    let ask = |number: u32| {
        // Without one, the second gets the answer to the first.
        let request =
            MissionRequest { request_id: number.to_string(), request: Some(validate.clone()), ..Default::default() };
        // The first is answered, however busy the machine is.
        let limit = if number == 0 { LIMIT } else { Duration::from_secs(10) };
        let get = asking.get(format!("kw/uav1/{}", Service::Mission.key())).payload(request.encode_to_vec());
        get.timeout(limit).wait().unwrap()
    };
    let onboard = system.process("onboard").id();
    let answers: Vec<_> = (0..120).map(ask).collect();
    // Some wait for longer than an order counts; how many depends on the machine.
    let answered = answers.iter().filter(|it| it.recv().is_ok_and(|it| it.result().is_ok())).count();
    assert!(0 < answered, "no answer");
    // Held up by all of them at once it would have been killed as hung.
    assert_eq!(system.process("onboard").id(), onboard);
    let decisions = system.http().json("/api/v1/vehicles/uav1/decisions").to_string();
    assert!(decisions.contains("step 2 of 3") && !decisions.contains("step 3 of 3"), "on the leg: {decisions}");
    assert!(!decisions.contains("autopilot_preempts"), "{decisions}");
}

#[test]
fn a_memory_of_one_form_is_continued_by_the_other() {
    let files = Files::with_long_leg();
    let folder = state_folder();
    let (config, state) = (files.config(), folder.path().to_str().expect("a readable path").to_owned());
    let config = config.to_str().expect("a readable path");
    // Slow enough that a machine with too much to do is late by what a vehicle bears.
    let usual = ["--config", config, "--speed", "8", "--state", &state];
    System::start(&[&usual[..], &["--onboard", USUAL]].concat()).end().expect(0, &["SUCCESS"]);
    // A mission that is over stays over, no matter which process remembers it.
    System::start(&usual).end().expect(0, &["SUCCESS"]);
    let other = System::start(&[&usual[..], &["--onboard", "mcm,planner"]].concat());
    let ending = other.end();
    ending.expect(0, &["SUCCESS"]);
    assert!(!ending.lines.iter().any(|it| it.contains(": takeoff")), "{}", ending.lines.join("\n"));
}

#[test]
fn what_cannot_be_composed_is_refused_in_one_sentence() {
    #[track_caller]
    fn check(args: &[&str], words: &str) {
        let output = kittiwake(args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(words) && !said.contains("panicked"), "{args:?}: {said}");
    }
    check(&["run", "onboard", "--nodes", "mcm,planner,mcm"], "mcm is named twice: a vehicle has one");
    check(&["run", "onboard", "--nodes", "mcm,pilot"], "found node `pilot`, expected some of vehicle-sim");
    check(&["run", "onboard", "--nodes", "mcm,gateway"], "gateway is on the ground and has a process of its own");
    check(&["run", "onboard", "--nodes", "mcm,control-tower"], "control-tower is on the ground");
    check(
        &["run", "onboard", "--nodes", "vehicle-sim,px4-bridge"],
        "vehicle-sim and px4-bridge would both fly the vehicle",
    );
    check(
        &["run", "onboard", "--nodes", "mcm", "--vehicle", "uav1", "--vehicle", "uav2"],
        "'--vehicle <NAME>' cannot be used",
    );
    check(&["run", "onboard"], "--nodes <NODES>");
    let is_unread = "found `--state`, which is for mcm and control-tower only";
    check(&["run", "planner", "--state", "anywhere"], &format!("planner: {is_unread}"));
    check(&["run", "onboard", "--nodes", "planner,monitor", "--state", "anywhere"], &format!("onboard: {is_unread}"));
    check(&["up", "--onboard", "mcm,mcm"], "mcm is named twice: a vehicle has one");
    check(&["up", "--onboard", "mcm,px4-bridge"], "found px4-bridge among the nodes, but vehicle-sim flies here");
}

#[test]
fn a_node_that_runs_elsewhere_for_the_same_vehicle_is_not_hosted_a_second_time() {
    let system = on_long_leg("5");
    let locator = system.locator();
    let config = shipped().join("kittiwake.toml");
    let config = config.to_str().expect("a readable path");
    let elsewhere = state_folder();
    let state = elsewhere.path().to_str().expect("a readable path");
    let process = system.process("onboard").id();
    let second = ["--config", config, "--connect", &locator];
    for args in [&["run", "onboard", "--nodes", "monitor,planner"][..], &["run", "mcm", "--state", state][..]] {
        let mut command = std::process::Command::new(KITTIWAKE);
        command.args(args).args(second);
        let output = command.stdin(std::process::Stdio::null()).output().expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("runs already for the same vehicle") && !said.contains("panicked"), "{said}");
    }
    assert_eq!(system.process("onboard").id(), process, "the first one flies on");
    system.end().expect(0, &["SUCCESS"]);
}
