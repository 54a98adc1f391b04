//! How many stories have a browser at a time: a page with its browser takes a core for itself, and more of them than cores
//! wait for each other in vain.

use std::cell::Cell;
use std::sync::{Condvar, Mutex};

/// Stories with a browser at a time.
const MOST: usize = 2;

static TAKEN: Mutex<usize> = Mutex::new(0);
static FREED: Condvar = Condvar::new();

thread_local! {
    /// Browsers of this story, each test being a thread of its own.
    static OWN: Cell<usize> = const { Cell::new(0) };
}

/// A place for one browser. A story that has one gets more at once, so that no two stories wait for each other.
#[derive(Debug)]
pub struct Seat(());

impl Seat {
    /// Waits until this story may have a browser.
    pub fn take() -> Seat {
        if OWN.get() == 0 {
            let taken = TAKEN.lock().expect("no holder panics");
            let mut taken = FREED.wait_while(taken, |taken| *taken == MOST).expect("no holder panics");
            *taken += 1;
        }
        OWN.set(OWN.get() + 1);
        Seat(())
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        OWN.set(OWN.get() - 1);
        if OWN.get() == 0 {
            // A story that fails gives its seat back like any other.
            *TAKEN.lock().expect("no holder panics") -= 1;
            FREED.notify_one();
        }
    }
}
