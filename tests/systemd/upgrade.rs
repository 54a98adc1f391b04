//! The program is replaced while the vehicle flies.

use crate::systemd::documented::commands;
use crate::systemd::site::{Site, unpack_upgrade};

const SPEED: u32 = 5;

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test stories -- --ignored systemd::"]
fn upgraded_in_flight_one_process_after_the_other_the_mission_is_achieved() {
    let site = Site::start("upgrade", SPEED);
    let machine = &site.aircraft;
    site.wait_for_flight();
    unpack_upgrade(machine, SPEED);
    machine.run(&commands("cp -rT config /run/kittiwake-config"));
    let one_by_one = commands("for name in");
    let names = one_by_one.split_once(" in ").and_then(|(_, it)| it.split_once(';')).expect("a list of names").0;
    let before: Vec<_> = names.split(' ').map(|it| (it, machine.process_id(it))).collect();
    assert_eq!(before.len(), 5, "{names}");

    site.check_flies("before the processes are started again");
    machine.run(&one_by_one);
    site.check_flies("after the processes were started again");
    for (process, before) in before {
        // `systemctl restart` has waited until it is ready.
        let id = machine.process_id(process).expect("it runs");
        assert_ne!(Some(id), before, "{process} was not started again");
        let program = machine.run(&format!("readlink /proc/{id}/exe"));
        assert_eq!(program.trim(), "/usr/local/bin/kittiwake", "{process} is not the new program");
    }
    site.wait_for_success();
    site.check_active();
}
