//! When what happened within a wake, for measurements. Nothing is decided by it.
//!
//! The meters are handed in; without them every stamp is zero, so that a flight on a virtual clock
//! stays the same to the bit.

use std::sync::Arc;

use kittiwake_proto::v1::{McmTiming, SkillKind, TimingMark, TimingPoint};

use crate::tick_time::TickTimes;

/// What is beyond 2^31 is counted as of that.
const BUCKETS: usize = 32;

/// What the measurements read, handed in. Nothing is decided by it.
#[derive(Debug, Clone, Copy)]
pub struct Meters {
    /// Nanoseconds of any one clock.
    pub now_ns: fn() -> u64,
    /// How often the present thread has allocated memory.
    pub allocations: fn() -> u64,
}

/// Without meters all takes no time and no memory.
const NONE: Meters = Meters { now_ns: || 0, allocations: || 0 };

/// Put into a record once everything is decided.
#[derive(Debug)]
struct Mark {
    point: TimingPoint,
    at_ns: u64,
    skill: SkillKind,
    flag: Option<Arc<str>>,
}

/// What the meters showed as a tick began.
pub(crate) struct Begun {
    ns: u64,
    allocations: u64,
}

/// Collects the marks of a wake.
#[derive(Debug)]
pub(crate) struct Timing {
    meters: Meters,
    woken_ns: Option<u64>,
    marks: Vec<Mark>,
    ticks: [u64; BUCKETS],
    allocations: [u64; BUCKETS],
    pub(crate) recent: TickTimes,
}

impl Default for Timing {
    fn default() -> Timing {
        Timing::new(NONE)
    }
}

impl Timing {
    pub(crate) fn new(meters: Meters) -> Timing {
        Timing {
            meters,
            woken_ns: None,
            marks: Vec::new(),
            ticks: [0; BUCKETS],
            allocations: [0; BUCKETS],
            recent: TickTimes::default(),
        }
    }

    fn now_ns(&self) -> u64 {
        (self.meters.now_ns)()
    }

    /// Something is taken in; the first since the last wake begins one.
    pub(crate) fn wake(&mut self) {
        if self.woken_ns.is_none() {
            self.woken_ns = Some(self.now_ns());
        }
    }

    pub(crate) fn mark(&mut self, point: TimingPoint) {
        self.mark_flag(point, SkillKind::Unspecified, None);
    }

    pub(crate) fn mark_skill(&mut self, point: TimingPoint, skill: SkillKind) {
        self.mark_flag(point, skill, None);
    }

    pub(crate) fn mark_flag(&mut self, point: TimingPoint, skill: SkillKind, flag: Option<Arc<str>>) {
        let at_ns = self.now_ns();
        self.marks.push(Mark { point, at_ns, skill, flag });
    }

    /// A tick begins.
    pub(crate) fn tick(&self) -> Begun {
        Begun { allocations: (self.meters.allocations)(), ns: self.now_ns() }
    }

    /// Counts a tick that began then.
    pub(crate) fn ticked(&mut self, begun: Begun) {
        let took = self.now_ns().saturating_sub(begun.ns);
        let allocated = (self.meters.allocations)().saturating_sub(begun.allocations);
        self.ticks[took.checked_ilog2().map_or(0, bucket)] += 1;
        self.allocations[allocated.checked_ilog2().map_or(0, |it| bucket(it + 1))] += 1;
        self.recent.add(took);
    }

    /// Ends the wake; its record, if anything was marked.
    pub(crate) fn end_wake(&mut self) -> Option<McmTiming> {
        let woken_ns = self.woken_ns.take().unwrap_or_default();
        if self.marks.is_empty() {
            return None;
        }
        Some(McmTiming {
            woken_ns,
            decided_ns: self.now_ns(),
            marks: self.marks.drain(..).map(TimingMark::from).collect(),
            tick_histogram: self.ticks.to_vec(),
            allocation_histogram: self.allocations.to_vec(),
        })
    }
}

impl From<Mark> for TimingMark {
    fn from(Mark { point, at_ns, skill, flag }: Mark) -> TimingMark {
        let flag = flag.map(|it| it.to_string()).unwrap_or_default();
        TimingMark { point: point as i32, at_ns, skill: skill as i32, flag }
    }
}

fn bucket(exponent: u32) -> usize {
    (exponent as usize).min(BUCKETS - 1)
}
