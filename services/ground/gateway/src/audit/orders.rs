//! The part of the audit trail that requests use. It is in memory, under a lock that nobody holds while a disk is accessed.
//!
//! A record gets its number and its place in the queue of the writer ([`writer`](super::writer)) at once, so that the lines
//! of the files have the order of the numbers.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use kittiwake_proto::v1::AuditRecord;
use regular_file::{DiskThread, NotTaken};
use tokio::sync::oneshot;

use super::on_disk::OnDisk;
use super::utc;
use super::writer::Job;

/// How long the oldest record may wait for the disk before orders are carried out without their lines: a disk that works
/// writes a line in less than a millisecond, and an operator who aborts a flight does not notice a fifth of a second.
pub(super) const ANSWER_LIMIT: Duration = Duration::from_millis(200);
/// The most records that wait for the disk: the orders of some minutes, in some hundred kilobytes.
pub(super) const MAX_WAITING: usize = 1024;
/// The most orders in memory.
pub(super) const MAX_ORDERS: usize = 1000;

/// The newest orders, and what is known of the files.
#[derive(Debug, Default)]
pub(super) struct Orders {
    /// To the writer; absent where nothing is kept, and after the end.
    pub(super) queue: Option<DiskThread<Job>>,
    /// The number of the newest record.
    pub(super) number: u64,
    pub(super) newest_last: VecDeque<AuditRecord>,
    /// When each record was queued that is not in a file yet, oldest first.
    pub(super) waiting: VecDeque<Instant>,
    /// When the writer began to look at the files, while it does.
    pub(super) looking_since: Option<Instant>,
    /// It was logged that the disk does not answer.
    pub(super) is_silence_logged: bool,
    /// Records that could not be written.
    pub(super) lost: u64,
    /// Why the last record could not be written.
    pub(super) failing: Option<String>,
    /// Whether the disk has what was written.
    pub(super) on_disk: OnDisk,
    pub(super) seen: Seen,
}

/// What the writer has seen of the files.
#[derive(Debug, Default)]
pub(super) struct Seen {
    /// The newest file, if it is not where it was opened.
    pub(super) gone: Option<PathBuf>,
    /// The newest file that was removed, renamed or replaced while it was written to.
    pub(super) replaced: Option<PathBuf>,
}

/// A record that is being written.
pub(super) struct Writing {
    /// Completes when it is written, or cannot be.
    pub(super) done: oneshot::Receiver<()>,
    /// When an order goes on without it.
    pub(super) until: Instant,
}

impl Orders {
    /// Gives a record its number and queues it; with nothing to wait for where it is not written.
    pub(super) fn add(&mut self, record: AuditRecord, now: Instant) -> (AuditRecord, Option<Writing>) {
        self.number += 1;
        let record = AuditRecord { utc: utc(), number: self.number, ..record };
        let writing = self.queue(&record, now);
        // Of an order that has ended, only its end.
        let asked = self.newest_last.iter().rposition(|it| Some(it.number) == record.asked);
        asked.map(|at| self.newest_last.remove(at));
        if self.newest_last.len() == MAX_ORDERS {
            self.newest_last.pop_front();
        }
        self.newest_last.push_back(record.clone());
        (record, writing)
    }

    fn queue(&mut self, record: &AuditRecord, now: Instant) -> Option<Writing> {
        let Some(queue) = &self.queue else {
            self.lost += u64::from(self.failing.is_some());
            return None;
        };
        let (written, done) = oneshot::channel();
        let why = match queue.hand_over(Job::Write(record.clone(), written)) {
            Ok(()) => {
                self.waiting.push_back(now);
                // Records are written one after the other: none is in its file before the oldest that waits.
                let until = self.waiting.front().map_or(now, |oldest| *oldest + ANSWER_LIMIT);
                return Some(Writing { done, until });
            }
            Err(NotTaken::Full) => format!("{MAX_WAITING} records wait for the disk already"),
            Err(NotTaken::Ended) => "the thread that writes them has ended".to_owned(),
        };
        self.failed(why);
        None
    }

    /// The oldest record that waits, which has this number, was written, or cannot be.
    pub(super) fn written(&mut self, number: u64, result: Result<(), String>, seen: Seen) {
        self.waiting.pop_front();
        self.seen = seen;
        match result {
            Ok(()) => {
                self.failing = None;
                self.on_disk.written(number);
            }
            Err(why) => self.failed(why),
        }
        if self.waiting.is_empty() && std::mem::take(&mut self.is_silence_logged) {
            tracing::warn!("the disk of the audit trail answers again");
        }
    }

    fn failed(&mut self, why: String) {
        if self.failing.is_none() {
            tracing::error!("audit records cannot be written: {why}; orders are carried out all the same");
        }
        self.lost += 1;
        self.failing = Some(why);
    }

    /// An order goes on without its record.
    pub(super) fn gave_up(&mut self) {
        // The writer may have come just now.
        if !self.waiting.is_empty() && !std::mem::replace(&mut self.is_silence_logged, true) {
            tracing::error!("the disk of the audit trail does not answer; orders are carried out all the same");
        }
    }

    pub(super) fn is_failing(&self, now: Instant) -> bool {
        let is_refusing = self.failing.is_some() || self.on_disk.is_failing();
        is_refusing || self.seen.gone.is_some() || self.silence(now).is_some()
    }

    /// How long the disk has not answered, if that is longer than orders wait for it.
    fn silence(&self, now: Instant) -> Option<Duration> {
        let since = self.waiting.front().copied().into_iter().chain(self.looking_since).min()?;
        Some(now.saturating_duration_since(since)).filter(|silence| ANSWER_LIMIT <= *silence)
    }

    pub(super) fn problems(&self, now: Instant) -> Vec<String> {
        let failing = self.failing.as_ref().map(|cause| {
            let lost = self.lost;
            format!("gateway: orders are carried out without a record: {cause} (audit records lost so far: {lost})")
        });
        let silence = self.silence(now).map(|silence| {
            let (seconds, waiting) = (silence.as_secs_f64(), self.waiting.len());
            format!(
                "gateway: the disk of the audit trail has not answered for {seconds:.1} s; orders are carried out before \
                 they are on record (records that wait for it: {waiting})"
            )
        });
        let gone = self.seen.gone.as_ref().filter(|_| failing.is_none());
        let gone =
            gone.map(|it| format!("gateway: {} is gone, which the next order is to be recorded in", it.display()));
        let replaced = self.seen.replaced.as_ref().map(|lost| {
            let lost = lost.display();
            format!(
                "gateway: {lost} was removed, renamed or replaced while orders were recorded in it; its records are \
                 missing there unless it was renamed, the chain goes on in a new file"
            )
        });
        let of_files = [silence, gone, replaced].into_iter().flatten();
        failing.into_iter().chain(self.on_disk.problems()).chain(of_files).collect()
    }
}
