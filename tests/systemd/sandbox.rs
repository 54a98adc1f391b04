//! What a process under systemd may do.

use crate::systemd::site::Site;

/// The greatest exposure that `systemd-analyze security` may state, from 0 (confined) to 10.
const EXPOSURE: f64 = 1.5;

/// In the place of a process, with the same sandbox: prints every file and folder that it could write to.
const PROBE: &str = "mkdir -p /run/systemd/system/kittiwake@probe.service.d
cat >/run/systemd/system/kittiwake@probe.service.d/probe.conf <<'END'
[Service]
Type=oneshot
Restart=no
WatchdogSec=0
ExecStart=
ExecStart=/bin/sh -c 'find / -writable \"(\" -type d -o -type f \")\" ! -path \"/proc/*\" ! -path \"/sys/fs/cgroup/*\" 2>/dev/null; true'
StandardOutput=truncate:/run/probe
END
systemctl daemon-reload
systemctl start kittiwake@probe
cat /run/probe";

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test stories -- --ignored systemd::"]
fn a_process_writes_nowhere_but_to_its_own_state_and_little_else_is_open_to_it() {
    let site = Site::start("sandbox", 20);
    for process in ["mcm", "router"] {
        let said = site.aircraft.run(&format!("systemd-analyze security --no-pager kittiwake@{process}.service"));
        let line = said.lines().find(|it| it.contains("Overall exposure level")).unwrap_or_default();
        let stated = line.split(": ").nth(1).and_then(|it| it.split(' ').next()?.parse::<f64>().ok());
        assert!(stated.is_some_and(|it| it <= EXPOSURE), "{process}: {said}");
        eprintln!("{}", line.trim());
    }
    let said = site
        .aircraft
        .run("systemd-analyze verify kittiwake@mcm.service kittiwake-config.service kittiwake.target 2>&1");
    assert!(!said.contains("kittiwake"), "it finds nothing wrong with the units: {said}");
    let said = site.aircraft.run(PROBE);
    let mut found: Vec<_> = said.lines().collect();
    found.sort_unstable();
    // Its own state, the folder of the router's socket, and scratch folders that nobody else sees.
    let own = ["/run/kittiwake", "/run/kittiwake/router.sock.lock", "/tmp", "/var/lib/kittiwake/probe", "/var/tmp"];
    assert_eq!(found, own);
}
