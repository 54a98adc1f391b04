//! The configuration is spoiled while the vehicle flies.

use crate::site::{ON_BOARD, Site};

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test systemd -- --ignored"]
fn files_that_are_spoiled_in_flight_count_from_the_next_start_of_the_target() {
    let site = Site::start("files", 4);
    let machine = &site.aircraft;
    site.wait_for_flight();
    machine.run("cd /etc/kittiwake/config && echo 'half a line' >kittiwake.toml && rm -r trees");
    for process in ["planner", "mcm", "monitor"] {
        let killed = machine.process_id(process).expect("it runs");
        machine.run(&format!("kill -KILL {killed}"));
        machine.wait_for_another(process, Some(killed));
    }
    site.check_flies("after the processes were started again");
    site.wait_for_success();

    machine.run("systemctl restart kittiwake.target");
    let said = machine.journal();
    assert!(said.contains("config/kittiwake.toml:1:"), "the mistake and its place are not in:\n{said}");
    for process in ON_BOARD {
        assert_eq!(machine.property(process, "ActiveState"), "inactive", "{process}");
    }
    // Mended, it starts, and the mission is still over.
    machine.run("rm -r /etc/kittiwake/config && cp -r config /etc/kittiwake/ && systemctl restart kittiwake.target");
    site.check_active();
}
