//! The Debian package of `deploy/release`: installed, flown, upgraded under way and after the end, removed.

use std::path::PathBuf;

use crate::systemd::documented::commands;
use crate::systemd::machine::Machine;
use crate::systemd::site::{ON_BOARD, Site};

/// Names the package.
const PACKAGE: &str = "KITTIWAKE_PACKAGE";
const CONFIG: &str = "/etc/kittiwake/config/kittiwake.toml";
const SPEED: u32 = 5;

/// Installs the package, or installs it again: what the user has changed is kept.
#[track_caller]
fn install(machine: &Machine) -> String {
    let package =
        PathBuf::from(std::env::var_os(PACKAGE).expect("KITTIWAKE_PACKAGE names a package of deploy/release"));
    machine.copy_in(&package, "kittiwake.deb");
    machine.run("dpkg --force-confold --install kittiwake.deb")
}

#[test]
#[ignore = "needs an image and a package: .ci/long package"]
fn a_package_is_installed_flown_upgraded_under_way_and_after_the_end_and_removed() {
    let site = Site::start_installed("package", |machine| {
        let said = install(machine);
        assert!(said.contains("ok       systemd: ") && said.contains("nothing is missing"), "doctor says: {said}");
        machine.run(&format!("sed -i 's/^speed = .*/speed = {SPEED}.0/' {CONFIG}"));
    });
    let machine = &site.aircraft;
    site.wait_for_flight();

    // What runs runs on; then one process after the other becomes the new one.
    let ids = || ON_BOARD.map(|it| machine.process_id(it));
    let before = ids();
    install(machine);
    site.check_flies("after the package was installed again");
    assert_eq!(ids(), before, "the package has started processes again");
    machine.run(&commands("for name in"));
    site.check_flies("after the processes were started again");
    site.wait_for_success();
    site.check_active();

    // A mission that is over stays over, and the user's speed is the user's.
    install(machine);
    machine.run("systemctl restart kittiwake.target");
    site.wait_for_success();
    machine.run(&format!("grep -q '^speed = {SPEED}.0' {CONFIG}"));

    machine.run("dpkg --remove kittiwake");
    assert_eq!(ids(), ON_BOARD.map(|_| None), "processes run on without their program");
    machine.run(&format!("test -f {CONFIG} && ! command -v kittiwake"));
    machine.run("dpkg --purge kittiwake && ! test -e /etc/kittiwake && ! test -e /var/lib/kittiwake && ! getent passwd kittiwake");
}
