//! The moment by which a skill must have reached its goal.

use std::time::Duration;

use domain::time::Time;

/// Is not missed for lack of data: where they are missing when it comes, as after a pause of the whole process, it is
/// postponed once.
#[derive(Debug)]
pub(super) struct Deadline {
    at: Option<Time>,
    postponed: bool,
    data_wait: Duration,
}

impl Deadline {
    /// Not set yet; `data_wait` is how long it waits for data when it has come.
    pub(super) fn new(data_wait: Duration) -> Deadline {
        Deadline { at: None, postponed: false, data_wait }
    }

    /// Sets it, unless it is set.
    pub(super) fn set(&mut self, at: Time) {
        self.at.get_or_insert(at);
    }

    /// It comes later after all, with data that may be missing then.
    pub(super) fn move_to(&mut self, at: Time) {
        (self.at, self.postponed) = (Some(at), false);
    }

    /// When it is, once it is set.
    pub(super) fn at(&self) -> Option<Time> {
        self.at
    }

    /// Whether it has come. `has_data`: it can be judged whether the goal is reached.
    pub(super) fn is_missed(&mut self, now: Time, has_data: bool) -> bool {
        let Some(at) = self.at.filter(|at| *at <= now) else { return false };
        if !has_data && !std::mem::replace(&mut self.postponed, true) {
            self.at = Some(at.max(now) + self.data_wait);
            return false;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    #[test]
    fn it_is_postponed_once_for_data() {
        let mut deadline = Deadline::new(Duration::from_secs(2));
        assert!(!deadline.is_missed(at(100), true), "not set");
        deadline.set(at(10));
        deadline.set(at(20));
        assert!(!deadline.is_missed(at(9), false));
        assert!(!deadline.is_missed(at(11), false), "postponed");
        assert_eq!(deadline.at(), Some(at(13)));
        assert!(!deadline.is_missed(at(12), true));
        assert!(deadline.is_missed(at(13), false));
        deadline.move_to(at(30));
        assert!(!deadline.is_missed(at(29), false));
        assert!(!deadline.is_missed(at(30), false), "postponed again");
    }
}
