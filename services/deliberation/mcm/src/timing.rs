//! When what happened within a wake, for measurements. Nothing is decided by it.
//!
//! The stopwatch is handed in; without one every stamp is zero, so that a flight on a virtual clock
//! stays the same to the bit.

use kittiwake_proto::v1::{McmTiming, SkillKind, TimingMark, TimingPoint};

/// Ticks of 2^31 ns and more are counted as of that.
const BUCKETS: usize = 32;

/// Collects the marks of a wake.
#[derive(Debug)]
pub(crate) struct Timing {
    stopwatch: fn() -> u64,
    woken_ns: Option<u64>,
    marks: Vec<TimingMark>,
    ticks: [u64; BUCKETS],
}

impl Default for Timing {
    fn default() -> Timing {
        Timing::new(|| 0)
    }
}

impl Timing {
    pub(crate) fn new(stopwatch: fn() -> u64) -> Timing {
        Timing { stopwatch, woken_ns: None, marks: Vec::new(), ticks: [0; BUCKETS] }
    }

    pub(crate) fn now_ns(&self) -> u64 {
        (self.stopwatch)()
    }

    /// Something is taken in; the first since the last wake begins one.
    pub(crate) fn wake(&mut self) {
        if self.woken_ns.is_none() {
            self.woken_ns = Some(self.now_ns());
        }
    }

    pub(crate) fn mark(&mut self, point: TimingPoint) {
        self.mark_flag(point, SkillKind::Unspecified, "");
    }

    pub(crate) fn mark_skill(&mut self, point: TimingPoint, skill: SkillKind) {
        self.mark_flag(point, skill, "");
    }

    pub(crate) fn mark_flag(&mut self, point: TimingPoint, skill: SkillKind, flag: &str) {
        let at_ns = self.now_ns();
        self.marks.push(TimingMark { point: point as i32, at_ns, skill: skill as i32, flag: flag.to_owned() });
    }

    /// Counts a tick that began then.
    pub(crate) fn ticked(&mut self, begun_ns: u64) {
        let took = self.now_ns().saturating_sub(begun_ns);
        let bucket = took.checked_ilog2().unwrap_or(0) as usize;
        self.ticks[bucket.min(BUCKETS - 1)] += 1;
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
            marks: std::mem::take(&mut self.marks),
            tick_histogram: self.ticks.to_vec(),
        })
    }
}
