//! A winch that is not there: it takes the time of one, and says what it does. `cargo run -p kittiwake-skill --example winch -- LOCATOR`

use std::time::Duration;

use kittiwake_skill::{CANCELLED, Offer, Stop, Task, offer};

const STEP_S: f64 = 0.1;

fn main() {
    let Some(connect) = std::env::args().nth(1) else { panic!("usage: winch LOCATOR, as `kittiwake up` prints it") };
    let (skill, vehicle) = ("winch_down".to_owned(), "uav1".to_owned());
    println!("offers {skill} to {vehicle}");
    let ended = offer(Offer { connect, vehicle, skill, version: 1 }, &Stop::new(), winch_down);
    ended.unwrap_or_else(|cause| panic!("{cause}"));
}

/// A metre a second.
fn winch_down(task: &Task) -> String {
    let (length_m, mut out_m) = (task.inputs["length_m"], 0.0);
    println!("lowers the load by {length_m:.0} m");
    while out_m < length_m {
        if task.is_cancelled_within(Duration::from_secs_f64(STEP_S)) {
            println!("interrupted: drops the rope");
            return CANCELLED.to_owned();
        }
        out_m += STEP_S;
        task.has_come(out_m / length_m);
    }
    task.has_found("rope_m", out_m);
    println!("unhooked, and the rope is in");
    "delivered".to_owned()
}
