//! Which records the disk has. It tells only when it is asked to take what was written.
//!
//! A disk that fails tells that once: the system then counts what it was to take as taken, and the next time all is well. So the records that it
//! was asked to take when it failed stay in doubt for as long as the gateway runs, and it counts as failing until it has taken a later one.

use std::fmt;

/// What is known of the records that are in a file.
#[derive(Debug, Default)]
pub(super) struct OnDisk {
    /// The number of the newest one.
    written: u64,
    /// That of the newest one that the disk has taken.
    taken: u64,
    doubt: Option<Doubt>,
    /// The disk has failed, and has taken no later record.
    is_failing: bool,
    /// Why it could not be asked to take the newest records. That is tried again, and says nothing about the disk.
    not_asked: Option<String>,
}

/// The first and the last of the records that the disk may not have. It may have some of them.
#[derive(Debug)]
struct Doubt {
    first: u64,
    last: u64,
    why: String,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Doubt { first, last, why } = self;
        write!(
            f,
            "audit records {first} to {last} may not be on the disk, and would be lost with the power, all or some: {why}"
        )
    }
}

impl OnDisk {
    /// With this number of the newest record. Whether that is on the disk is not known: the gateway before may have been killed when it had
    /// just written it.
    pub(super) fn after(number: u64) -> OnDisk {
        OnDisk { written: number, taken: number.saturating_sub(1), ..OnDisk::default() }
    }

    /// A record is in a file.
    pub(super) fn written(&mut self, number: u64) {
        self.written = number;
    }

    /// The disk has taken the records up to this number, as it says.
    pub(super) fn taken(&mut self, number: u64) {
        self.taken = self.taken.max(number);
        let is_later = self.doubt.as_ref().is_some_and(|it| it.last < number);
        if is_later && std::mem::take(&mut self.is_failing) {
            tracing::warn!("the disk of the audit trail takes records again");
        }
    }

    /// The disk has failed to take what was written since it was asked last.
    pub(super) fn failed(&mut self, why: String) {
        if self.written == 0 {
            return;
        }
        let first = self.doubt.as_ref().map_or((self.taken + 1).min(self.written), |it| it.first);
        let doubt = Doubt { first, last: self.written, why };
        if !std::mem::replace(&mut self.is_failing, true) {
            tracing::error!("{doubt}; orders are carried out all the same");
        }
        self.doubt = Some(doubt);
    }

    /// The disk is asked to take what was written, or why it cannot be: that lasts until it is asked.
    pub(super) fn asked(&mut self, asked: Result<(), String>) {
        let why = asked.err();
        if let (None, Some(why)) = (&self.not_asked, &why) {
            tracing::warn!("the newest audit records are not brought to the disk yet: {why}; that is tried again");
        }
        self.not_asked = why;
    }

    pub(super) fn is_failing(&self) -> bool {
        self.is_failing
    }

    /// What an operator should know.
    pub(super) fn problems(&self) -> impl Iterator<Item = String> {
        let doubt = self.doubt.as_ref().map(|it| format!("gateway: {it}"));
        let not_asked = self.not_asked.as_ref().map(|why| {
            format!("gateway: the newest audit records are not brought to the disk yet, and would be lost with the power: {why}")
        });
        doubt.into_iter().chain(not_asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy)]
    enum Step {
        Written(u64),
        Taken(u64),
        Failed,
    }
    use Step::{Failed, Taken, Written};

    #[test]
    fn what_a_disk_failed_to_take_stays_in_doubt_and_it_fails_until_it_has_taken_more() {
        /// Whether it is failing after `steps`, and which records are in doubt.
        #[track_caller]
        fn check(steps: &[Step], is_failing: bool, in_doubt: Option<(u64, u64)>) {
            let mut disk = OnDisk::after(3);
            disk.taken(3);
            for step in steps {
                match *step {
                    Written(number) => disk.written(number),
                    Taken(number) => disk.taken(number),
                    Failed => disk.failed("EIO".to_owned()),
                }
            }
            let found = disk.doubt.as_ref().map(|it| (it.first, it.last));
            assert_eq!((disk.is_failing(), found), (is_failing, in_doubt), "{steps:?}");
        }
        check(&[Written(4), Taken(4)], false, None);
        check(&[Written(4), Failed], true, Some((4, 4)));
        check(&[Written(4), Written(5), Failed], true, Some((4, 5)));
        // What follows is not on the disk either until that says so.
        check(&[Written(4), Failed, Written(5)], true, Some((4, 4)));
        check(&[Written(4), Failed, Written(5), Taken(5)], false, Some((4, 4)));
        // It was not asked to take anything: the system counts it as taken.
        check(&[Written(4), Failed, Taken(4)], true, Some((4, 4)));
        // Written while the disk was asked to take the one before.
        check(&[Written(4), Written(5), Failed, Taken(5)], true, Some((4, 5)));
        check(&[Written(4), Taken(4), Written(5), Failed, Written(6), Failed], true, Some((5, 6)));
        check(&[Written(4), Failed, Written(5), Taken(5), Written(6), Failed], true, Some((4, 6)));
        check(&[Failed], true, Some((3, 3)));
    }

    #[test]
    fn the_newest_record_of_the_gateway_before_is_in_doubt_if_the_disk_fails_first() {
        let mut disk = OnDisk::after(3);
        disk.written(4);
        disk.failed("EIO".to_owned());
        assert_eq!(disk.doubt.map(|it| (it.first, it.last)), Some((3, 4)));
    }

    #[test]
    fn that_the_disk_cannot_be_asked_is_told_until_it_is_and_puts_no_record_in_doubt() {
        let mut disk = OnDisk::after(3);
        disk.asked(Err("EMFILE".to_owned()));
        let told: Vec<_> = disk.problems().collect();
        assert!(told.len() == 1 && told[0].ends_with("EMFILE") && !disk.is_failing(), "{told:?}");
        disk.asked(Ok(()));
        assert_eq!(disk.problems().next(), None);
    }

    #[test]
    fn where_there_is_no_record_none_is_in_doubt() {
        let mut disk = OnDisk::after(0);
        disk.failed("EIO".to_owned());
        assert_eq!((disk.is_failing(), disk.problems().next()), (false, None));
    }
}
