//! An allocator that counts, for each thread by itself: tests beside one another do not disturb each
//! other, and a loop knows what it allocates whatever the transport's threads do meanwhile.
//!
//! ```
//! #[global_allocator]
//! static ALLOCATOR: counting_allocator::Counting = counting_allocator::Counting;
//!
//! assert_eq!(counting_allocator::allocations(|| drop(vec![1])), 1);
//! ```

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Passes everything on to the system's allocator, and counts.
pub struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static LIVE: Cell<i64> = const { Cell::new(0) };
    static PEAK: Cell<i64> = const { Cell::new(0) };
}

/// The number of allocations of the present thread so far.
pub fn so_far() -> u64 {
    ALLOCATIONS.get()
}

/// The number of allocations `action` makes.
pub fn allocations(action: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    action();
    ALLOCATIONS.get() - before
}

/// The most memory `action` holds at a time, in bytes.
pub fn peak(action: impl FnOnce()) -> i64 {
    let before = LIVE.get();
    PEAK.set(before);
    action();
    PEAK.get() - before
}

fn note(allocated: usize, freed: usize) {
    // While a thread ends its counters are gone, and nobody looks at them any more.
    let _ = ALLOCATIONS.try_with(|it| it.set(it.get() + u64::from(allocated != 0)));
    let live = LIVE.try_with(|it| {
        it.set(it.get() + allocated as i64 - freed as i64);
        it.get()
    });
    let _ = PEAK.try_with(|it| it.set(it.get().max(live.unwrap_or(0))));
}

// SAFETY: every call is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size(), 0);
        // SAFETY: the caller keeps the contract of `GlobalAlloc::alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        note(0, layout.size());
        // SAFETY: the pointer came from `System`, by way of `alloc` above.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        note(new_size, layout.size());
        // SAFETY: the pointer came from `System`, by way of `alloc` above.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}
