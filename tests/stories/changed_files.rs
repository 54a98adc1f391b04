//! Files that are changed while a system flies: it flies on with what it was started with.

use std::path::{Path, PathBuf};

use gateway::access::Role;
use nix::sys::signal::Signal;

use crate::support::files::Files;
use crate::support::people::People;
use crate::support::{KITTIWAKE, System, kittiwake, wait_for};

/// What a human may leave behind who edits, or who installs another version.
fn spoil(folder: &Path) {
    for file in ["kittiwake.toml", "contingencies.toml", "missions/reference.toml", "trees/actions.xml"] {
        std::fs::write(folder.join(file), "half a line").expect("the file can be written");
    }
    std::fs::remove_file(folder.join("trees/step.xml")).expect("the file is there");
}

/// Where a run has its folder, or file, for this.
fn of_run(system: &System, what: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("kittiwake-{}", nix::unistd::getuid()));
    let (begins, ends) = (format!("{}-", system.pid()), format!(".{what}"));
    wait_for(what, || {
        let mut names =
            std::fs::read_dir(&folder).ok()?.flatten().map(|it| it.file_name().into_string().unwrap_or_default());
        names.find(|it| it.starts_with(&begins) && it.ends_with(&ends)).map(|it| folder.join(it))
    })
}

#[test]
fn files_that_are_spoiled_in_flight_keep_no_process_away() {
    let files = Files::with_long_leg();
    let config = files.config().to_str().expect("a readable path").to_owned();
    let system = System::start(&["--config", &config, "--speed", "5"]);
    system.wait_for_long_leg();
    spoil(files.config().parent().expect("a file is in a folder"));
    // The next run would say so, and name the file as its user does.
    let next = kittiwake(&["check", "--config", &config]);
    assert_eq!(next.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&next.stderr).contains(&config), "{}", String::from_utf8_lossy(&next.stderr));

    for service in ["planner", "mcm", "monitor", "skill-manager", "control-tower", "gateway"] {
        let killed = system.process(service);
        killed.signal(Signal::SIGKILL);
        wait_for(&format!("{service} to be started again"), || {
            let found = system.children().into_iter().find(|(name, _)| name == service)?;
            (found.1.id() != killed.id()).then_some(())
        });
    }
    // It reads the table of flags that is flown.
    let raised = system.inject(&["flag", "obstacle"]);
    assert!(raised.status.success(), "{}", String::from_utf8_lossy(&raised.stderr));
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    let refused: Vec<_> = ending.lines.iter().filter(|it| it.contains("ended with exit code 2")).collect();
    assert!(refused.is_empty(), "{refused:?}");
}

#[test]
fn a_program_that_is_replaced_in_flight_is_flown_to_the_end() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a temporary folder can be made");
    let (program, other) = (folder.path().join("kittiwake"), folder.path().join("kittiwake.new"));
    std::fs::hard_link(KITTIWAKE, &program).expect("the program is in the same file system");
    let config = crate::support::shipped().join("kittiwake.toml");
    let args = ["--exit-when-done", "--speed", "5", "--config", config.to_str().expect("a readable path")];
    let system = System::of(&program, &args, &[]);
    system.wait_for("step 4 of 5: fly to (0, 500, 10)");
    // As packages are installed: at once, by a new file of the same name.
    std::fs::write(&other, "no program").expect("the file can be written");
    std::fs::rename(&other, &program).expect("the file can be renamed");
    for service in ["planner", "mcm"] {
        system.process(service).signal(Signal::SIGKILL);
        system.wait_for(&format!("{service} ended by signal 9"));
    }
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}

#[test]
fn who_cleans_up_temporary_files_in_flight_keeps_no_process_away() {
    let system = System::on_long_leg("5");
    for what in ["files", "access", "links"] {
        std::fs::remove_dir_all(of_run(&system, what)).expect("the run has such a folder");
    }
    std::fs::remove_file(of_run(&system, "json")).expect("commands find the run");
    system.wait_for("the run file was removed: it is written again");
    system.status();
    system.wait_for("the router's socket was removed: the router is killed, to be started again");
    for service in ["mcm", "gateway"] {
        let killed = system.process(service);
        killed.signal(Signal::SIGKILL);
        wait_for(&format!("{service} to be started again"), || {
            let found = system.children().into_iter().find(|(name, _)| name == service)?;
            (found.1.id() != killed.id()).then_some(())
        });
    }
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    ending.expect_in_order(&["files of this run were removed or changed: they are written again"]);
}

#[test]
fn a_gateway_comes_back_where_the_tokens_are_spoiled_and_knows_its_operators_once_they_are_mended() {
    let people = People::new(&[("sam", Role::Safety)]);
    let system = System::up(&["--access", people.folder(), "--speed", "1"], &[]);
    let token = people.token_file("sam");
    let url = system.link_for("sam").replace("/#token=sam", "");
    let wait_for_gateway = || {
        wait_for("the gateway to know its operator", || {
            let shown = kittiwake(&["vehicle", "show", "--url", &url, "--token-file", &token, "--vehicle", "uav1"]);
            shown.status.success().then_some(())
        });
    };
    // One that has not run yet ends where it has no tokens.
    wait_for_gateway();
    let files = of_run(&system, "files");
    std::fs::write(Path::new(people.folder()).join("tokens.toml"), "[[").expect("the file can be written");
    std::fs::remove_dir_all(files).expect("the run has such a folder");
    let killed = system.process("gateway");
    killed.signal(Signal::SIGKILL);
    system.wait_for("gateway ended by signal 9");
    system.wait_for("until it can be used no token is valid");
    people.write_tokens();
    wait_for_gateway();
}
