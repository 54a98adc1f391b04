//! The control tower's answers about each area so far, and how long it is worth waiting for one.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::airspace::Grants;
use domain::plan::{Denial, DenialKind};
use domain::time::Time;

use crate::rules::Rules;

/// The record of every area that was ever refused or held for.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Permissions {
    pub(crate) records: BTreeMap<String, Record>,
}

/// Grants whose lengths differ by less than this are equally long: the younger one is nearer to its full length.
const SAME_GRANT: Duration = Duration::from_secs(5);

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Record {
    pub(crate) standing: Standing,
    /// Total time that the vehicle has held for this permission; a grant does not reset it.
    pub(crate) held: Duration,
    pub(crate) short_grant: Option<ShortGrant>,
}

/// A grant that was too short.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShortGrant {
    /// How long it held when it was found to be too short.
    pub(crate) length: Duration,
    pub(crate) ends: Time,
}

/// Where the asking for an area stands.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) enum Standing {
    /// Never refused since it was last granted.
    #[default]
    Open,
    /// Refused; asked once more from `retry_at` on.
    DeniedOnce {
        /// By whom, and why.
        reason: String,
        /// When it may be asked again.
        retry_at: Time,
    },
    /// Not asked any more.
    DeniedForGood {
        /// For the mission report.
        reason: String,
    },
}

impl Permissions {
    pub(crate) fn standing(&self, area: &str) -> Standing {
        self.records.get(area).map(|it| it.standing.clone()).unwrap_or_default()
    }

    /// It is held: a grant, however late, clears what was before.
    pub(crate) fn granted(&mut self, area: &str) {
        if let Some(record) = self.records.get_mut(area) {
            record.standing = Standing::Open;
        }
    }

    /// For how long it is granted at most, if a grant was too short and none was longer since.
    pub(crate) fn longest_grant(&self, area: &str) -> Option<Duration> {
        Some(self.records.get(area)?.short_grant?.length)
    }

    /// How much longer the grant holds that was too short: until then the tower gives the same one again.
    pub(crate) fn short_grant_left(&self, area: &str, now: Time) -> Option<Duration> {
        let ends = self.records.get(area)?.short_grant?.ends;
        (now < ends).then(|| ends - now)
    }

    /// Grants that were too short and have ended say no more about the next ones.
    pub(crate) fn forget_ended_grants(&mut self, now: Time) {
        for record in self.records.values_mut() {
            record.short_grant = record.short_grant.filter(|grant| now < grant.ends);
        }
    }

    /// These are held, each for this time from now on: one that holds for longer than the longest known ends what was known.
    pub(crate) fn held(&mut self, grants: &Grants) {
        for (area, remaining) in grants {
            if let Some(record) = self.records.get_mut(area) {
                record.short_grant = record.short_grant.filter(|grant| *remaining <= grant.length + SAME_GRANT);
            }
        }
    }

    /// It was granted, and holds for no longer than this, which is too short.
    pub(crate) fn too_short(&mut self, area: &str, granted: Duration, now: Time) {
        let record = self.records.entry(area.into()).or_default();
        // In whole seconds, as the tower grants: a part of one has passed since.
        let length = Duration::from_secs(granted.as_secs() + u64::from(granted.subsec_nanos() > 0));
        record.short_grant = Some(ShortGrant { length, ends: now + granted });
    }

    /// It was refused, or not answered.
    pub(crate) fn denied(&mut self, denial: &Denial, now: Time, rules: &Rules) {
        let record = self.records.entry(denial.area.clone()).or_default();
        let why = colon(&denial.reason);
        let (once, twice) = match denial.kind {
            DenialKind::Silent => {
                if !matches!(record.standing, Standing::DeniedForGood { .. }) {
                    let reason = "no answer from the control tower".into();
                    record.standing = Standing::DeniedForGood { reason };
                }
                return;
            }
            DenialKind::Refused | DenialKind::TooShort => {
                ("denied by the control tower", "denied twice by the control tower")
            }
            DenialKind::Withheld => ("not entered", "not entered"),
        };
        record.standing = match std::mem::take(&mut record.standing) {
            standing @ Standing::DeniedForGood { .. } => standing,
            Standing::Open => Standing::DeniedOnce {
                reason: format!("{once}{why}"),
                retry_at: now + rules.config.retry_after_denial_s.seconds(),
            },
            // Not asked since, so it is the same denial again.
            Standing::DeniedOnce { reason, retry_at } if now < retry_at => Standing::DeniedOnce { reason, retry_at },
            Standing::DeniedOnce { .. } => Standing::DeniedForGood { reason: format!("{twice}{why}") },
        };
    }

    /// How much longer `area` must not be asked for, and why.
    pub(crate) fn back_off(&self, area: &str, now: Time) -> Option<(Duration, &str)> {
        match &self.records.get(area)?.standing {
            Standing::DeniedOnce { reason, retry_at } if now < *retry_at => Some((*retry_at - now, reason)),
            _ => None,
        }
    }

    /// The vehicle has held for this long because of `area`.
    pub(crate) fn has_held(&mut self, area: &str, time: Duration) {
        let record = self.records.entry(area.into()).or_default();
        record.held = record.held.saturating_add(time);
    }

    /// Whether a hold of this length because of `area`, beside those before, is not too long.
    pub(crate) fn may_still_hold(&self, area: &str, wait: Duration, rules: &Rules) -> bool {
        let held = self.records.get(area).map_or(Duration::ZERO, |it| it.held);
        held.saturating_add(wait) <= rules.config.hold_at_most_s.seconds()
    }

    /// Whether the vehicle may hold for another `wait` because of `area`; if not, the area is not
    /// asked for any more.
    pub(crate) fn may_hold(&mut self, area: &str, wait: Duration, rules: &Rules) -> bool {
        if self.may_still_hold(area, wait, rules) {
            return true;
        }
        let record = self.records.entry(area.into()).or_default();
        let reason = match std::mem::take(&mut record.standing) {
            Standing::DeniedOnce { reason, .. } => reason,
            Standing::Open | Standing::DeniedForGood { .. } => "denied by the control tower".to_owned(),
        };
        let reason =
            format!("{reason}; not worth more than {} s of waiting", rules.config.hold_at_most_s.seconds().as_secs());
        record.standing = Standing::DeniedForGood { reason };
        false
    }
}

/// `reason` as the end of a sentence.
pub(crate) fn colon(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {reason}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn second(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    /// What the tower did, and when, in seconds.
    enum Course {
        Denied(u64),
        Silent(u64),
        Withheld(u64),
        Granted,
    }
    use Course::*;

    fn after(course: &[Course]) -> Standing {
        let rules = Rules::for_tests();
        let mut permissions = Permissions::default();
        let denial = |kind| Denial { area: "A".into(), kind, reason: "busy".into() };
        for it in course {
            match it {
                Denied(at) => permissions.denied(&denial(DenialKind::Refused), second(*at), &rules),
                Silent(at) => permissions.denied(&denial(DenialKind::Silent), second(*at), &rules),
                Withheld(at) => permissions.denied(&denial(DenialKind::Withheld), second(*at), &rules),
                Granted => permissions.granted("A"),
            }
        }
        permissions.standing("A")
    }

    #[test]
    fn a_denial_is_tried_once_more_and_silence_is_not() {
        #[track_caller]
        fn check(course: &[Course], expected: &str) {
            let text = match after(course) {
                Standing::Open => "open".into(),
                Standing::DeniedOnce { reason, retry_at } => format!("{reason}, again at {} s", retry_at.as_secs_f64()),
                Standing::DeniedForGood { reason } => reason,
            };
            assert_eq!(text, expected);
        }
        check(&[], "open");
        check(&[Denied(5)], "denied by the control tower: busy, again at 35 s");
        check(&[Denied(5), Denied(6)], "denied by the control tower: busy, again at 35 s");
        check(&[Denied(5), Denied(35)], "denied twice by the control tower: busy");
        check(&[Denied(5), Silent(36)], "no answer from the control tower");
        check(&[Silent(5)], "no answer from the control tower");
        check(&[Silent(5), Denied(50)], "no answer from the control tower");
        check(&[Silent(5), Granted], "open");
        check(&[Denied(5), Granted, Denied(50)], "denied by the control tower: busy, again at 80 s");
        check(&[Withheld(5)], "not entered: busy, again at 35 s");
        check(&[Withheld(5), Withheld(50)], "not entered: busy");
        check(&[Withheld(5), Granted], "open");
    }

    #[test]
    fn waiting_for_an_area_ends_once_it_has_taken_too_long_in_all() {
        let rules = Rules::for_tests();
        let mut permissions = Permissions::default();
        let half = Duration::from_secs(60);
        assert!(permissions.may_hold("A", half, &rules));
        permissions.has_held("A", half);
        permissions.granted("A");
        assert!(permissions.may_hold("A", half, &rules));
        permissions.has_held("A", half);
        assert!(!permissions.may_hold("A", Duration::from_secs(1), &rules));
        assert!(matches!(permissions.standing("A"), Standing::DeniedForGood { .. }));
    }
}
