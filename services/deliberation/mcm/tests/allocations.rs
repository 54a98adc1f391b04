//! What a wake takes from the heap.

#[path = "../../../../crates/behavior-tree/tests/it/counting.rs"]
#[allow(dead_code)]
mod counting;
#[allow(dead_code)]
mod rig;

use counting::{Counting, allocations};
use domain::skill::Goal;
use kittiwake_proto::v1::FlightMode::Takeoff;
use rig::{Rig, plan, step};

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_wake_with_nothing_new_allocates_nothing() {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    rig.execute();
    rig.next(None);
    let say = |rig: &mut Rig| rig.vehicle(true, Takeoff, (0.0, 0.0, 5.0));
    say(&mut rig);
    // The one is the vehicle's name in the event, which the test makes anew.
    assert_eq!(allocations(|| say(&mut rig)), 1);
}
