//! The reference mission and what may happen to it.

use control_tower::policy::Policy;
use fake_autopilots::wire::Faults;

use super::{BOTH, assert_success, fly, reference};

#[test]
fn the_reference_mission_is_flown_over_both_autopilots() {
    for kind in BOTH {
        let mut simulation = reference(kind, Policy::Grant, Faults::default());
        let report = fly(&mut simulation);
        assert_success(&simulation, &report);
    }
}
