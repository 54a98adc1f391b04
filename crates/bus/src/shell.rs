//! The loop that runs the nodes of a process, on one thread.

#![expect(clippy::disallowed_methods, reason = "deadlines of nodes are moments of the wall clock")]

use std::time::Instant;

use crate::BusError;
use crate::seat::Seat;
use crate::turns::take_turns;
use crate::wake::Wake;

/// Runs until all nodes are over or `wake` is stopped, and takes them off the bus.
pub(crate) fn run(mut seats: Vec<Seat<'_>>, wake: &Wake) -> Result<(), BusError> {
    let result = keep_turning(&mut seats, wake);
    seats.into_iter().for_each(Seat::leave);
    result
}

fn keep_turning(seats: &mut Vec<Seat<'_>>, wake: &Wake) -> Result<(), BusError> {
    loop {
        let has_mail = || seats.iter().any(Seat::has_mail).then(Instant::now);
        let next = || has_mail().or_else(|| seats.iter().map(Seat::next_wake).min()).unwrap_or_else(Instant::now);
        wake.wait(next, seats.iter().flat_map(Seat::descriptors));
        let go_on = !wake.is_stopped();
        seats.iter_mut().for_each(Seat::read);
        let now = Instant::now();
        let is_due = |it: &Seat<'_>| it.has_mail() || it.next_wake() <= now;
        take_turns(seats, is_due, Seat::has_mail, Seat::turn)?;
        while let Some(over) = seats.iter().position(Seat::is_over) {
            let over = seats.remove(over);
            seats.iter_mut().for_each(|it| it.goes_on_without(over.name()));
            over.leave();
        }
        if !go_on || seats.is_empty() {
            return Ok(());
        }
    }
}
