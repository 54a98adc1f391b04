//! Enabled once, the system comes up by itself, flies, and remembers that it has.

use crate::systemd::site::{ON_BOARD, Site, flies, is_armed, unpack_upgrade};

const SPEED: u32 = 20;

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test stories -- --ignored systemd::"]
fn installed_as_documented_it_flies_and_stays_down_after_a_power_cut_and_an_upgrade() {
    let site = Site::start("flight", SPEED);
    site.check_active();
    site.wait_for_success();
    for process in ON_BOARD {
        assert_eq!(site.aircraft.property(process, "NRestarts"), "0", "{process}\n{}", site.aircraft.journal());
    }

    site.aircraft.cut_power();
    ON_BOARD.iter().for_each(|it| site.aircraft.wait_for_another(it, None));
    check_stays_down(&site, "a power cut");

    let before = ON_BOARD.map(|it| site.aircraft.process_id(it));
    unpack_upgrade(&site.aircraft, SPEED);
    site.aircraft.run(&crate::systemd::documented::commands("\nsystemctl restart kittiwake.target"));
    for (process, before) in ON_BOARD.iter().zip(before) {
        site.aircraft.wait_for_another(process, before);
    }
    check_stays_down(&site, "an upgrade");
}

/// The mission is over for the processes that have been started again: nothing takes off within a minute of mission time.
#[track_caller]
fn check_stays_down(site: &Site, after: &str) {
    let is_new = |it: &serde_json::Value| {
        it["sources"]["introspection"]["wallAgeS"].as_f64().is_some_and(|it| it < 1.0) && it["missionTimeS"].is_number()
    };
    let heard = site.wait_until(&format!("the vehicle to be heard after {after}"), is_new);
    let time_s = |it: &serde_json::Value| it["missionTimeS"].as_f64().unwrap_or_default();
    let until = time_s(&heard) + 60.0;
    site.wait_until(&format!("a minute after {after}"), |it| {
        assert!(!is_armed(it) && !flies(it), "it took off after {after}: {it:#}");
        assert!(it["report"]["outcome"].is_string(), "the mission is not over after {after}: {it:#}");
        until <= time_s(it)
    });
    site.check_active();
}
