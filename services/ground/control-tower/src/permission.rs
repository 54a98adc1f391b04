//! A vehicle's permission for one area: its states, and what every event does in every state.

use std::time::Duration;

use domain::time::{Now, Pace, Time};

use crate::policy::{Answer, Verdict};

/// The end of a grant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Expiry {
    /// In mission time.
    pub(crate) at: Time,
    /// The same moment, milliseconds since the Unix epoch, UTC.
    pub(crate) utc_ms: i64,
    /// For how long it was granted, in mission time.
    pub(crate) granted_for: Duration,
}

impl Expiry {
    /// Of a grant given now that is valid for `valid` of mission time.
    pub(crate) fn after(now: Now, valid: Duration, pace: Pace) -> Expiry {
        let wall_ms = i64::try_from(pace.to_wall(valid).as_millis()).unwrap_or(i64::MAX);
        Expiry { at: now.time + valid, utc_ms: now.utc_ms.saturating_add(wall_ms), granted_for: valid }
    }

    /// Of a grant that another process gave: it lasts until the same moment, and never longer than it was given for, so
    /// that a clock that stands in the past after a restart of the machine does not prolong it.
    pub(crate) fn restored(now: Now, utc_ms: i64, granted_for: Duration, pace: Pace) -> Expiry {
        let left_ms = u64::try_from(utc_ms.saturating_sub(now.utc_ms)).unwrap_or_default();
        let left = pace.wall(Duration::from_millis(left_ms)).min(granted_for);
        Expiry { at: now.time + left, utc_ms, granted_for }
    }
}

/// Who decided. No policy changes the decision of an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum By {
    Policy,
    Operator,
}

/// The state of a permission that was requested or decided about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Standing {
    /// Requested, not decided. `due` is the policy's decision and its time; `None`: never. A grant waits for what is `missing`.
    Requested { due: Option<(Time, Verdict)>, missing: String },
    /// The area may be entered until the expiry.
    Granted { expiry: Expiry, by: By },
    /// The area may not be entered.
    Denied { reason: String, by: By },
    /// Was granted, and an operator took the grant back, or a site is no longer ready.
    Revoked { reason: String, by: By },
    /// Was granted, and the grant has expired.
    Expired,
}

impl Standing {
    /// What holds at `now`: a grant that has ended holds no more, also where nobody has said so yet.
    fn at(self, now: Time) -> Standing {
        match self {
            Standing::Granted { expiry, .. } if expiry.at <= now => Standing::Expired,
            other => other,
        }
    }

    /// Whether an operator has said no.
    pub(crate) fn is_forbidden_by_hand(&self) -> bool {
        matches!(self, Standing::Denied { by: By::Operator, .. } | Standing::Revoked { by: By::Operator, .. })
    }

    /// Whether nothing holds at `now`: without it the vehicle has the same rights, and gets an answer when it asks
    /// again.
    pub(crate) fn may_be_forgotten(&self, now: Time) -> bool {
        match self {
            Standing::Expired | Standing::Denied { by: By::Policy, .. } => true,
            Standing::Granted { expiry, .. } => expiry.at <= now,
            Standing::Requested { .. } | Standing::Denied { by: By::Operator, .. } | Standing::Revoked { .. } => false,
        }
    }
}

/// A decision by an operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ruling {
    Grant { expiry: Expiry },
    Deny { reason: String },
    Revoke { reason: String },
}

/// A revocation without a grant to revoke.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("nothing to revoke: the area is not granted")]
pub(crate) struct NotGranted;

/// The outcome of an event.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Next {
    pub(crate) standing: Standing,
    /// Whether it is a decision: an answer to a request, or an operator's ruling.
    pub(crate) decided: bool,
}

/// A new request arrives; `answer` asks the policy, `fresh` is the expiry of a grant given now.
pub(crate) fn on_request(
    before: Option<Standing>,
    now: Time,
    fresh: Expiry,
    answer: impl FnOnce() -> Option<Answer>,
) -> Next {
    use Standing as S;
    match before.map(|it| it.at(now)) {
        None | Some(S::Expired | S::Denied { by: By::Policy, .. } | S::Revoked { by: By::Policy, .. }) => {
            let due = answer().map(|it| (now + it.after, it.verdict));
            undecided(S::Requested { due, missing: String::new() })
        }
        // Requested again before the answer: the first answer serves both requests.
        Some(requested @ S::Requested { .. }) => undecided(requested),
        // The vehicle may be in the area: an extension is left neither to chance nor to a delay.
        Some(S::Granted { by: By::Policy, .. }) => decided(S::Granted { expiry: fresh, by: By::Policy }),
        // The operator has set the expiry; another request does not move it.
        Some(S::Granted { expiry, by: By::Operator }) => decided(S::Granted { expiry, by: By::Operator }),
        Some(S::Denied { reason, by: By::Operator } | S::Revoked { reason, by: By::Operator }) => {
            decided(S::Denied { reason, by: By::Operator })
        }
    }
}

/// Time passes; `None`: it changes nothing yet. `fresh` is the expiry of a grant given now. No grant is given, or holds on, while
/// something is `missing`.
pub(crate) fn on_time(before: &Standing, now: Time, fresh: Expiry, missing: Option<String>) -> Option<Next> {
    use Standing as S;
    match before {
        S::Requested { due: Some((at, Verdict::Deny { reason })), .. } if *at <= now => {
            Some(decided(S::Denied { reason: reason.clone(), by: By::Policy }))
        }
        S::Requested { due: Some((at, Verdict::Grant)), .. } if *at <= now && missing.is_none() => {
            Some(decided(S::Granted { expiry: fresh, by: By::Policy }))
        }
        S::Requested { due, missing: before } => {
            let missing = missing.unwrap_or_default();
            (missing != *before).then(|| undecided(S::Requested { due: due.clone(), missing }))
        }
        // Expiry is not a decision: it answers no request.
        S::Granted { expiry, .. } if expiry.at <= now => Some(undecided(S::Expired)),
        S::Granted { .. } => missing.map(|reason| decided(S::Revoked { reason, by: By::Policy })),
        S::Denied { .. } | S::Revoked { .. } | S::Expired => None,
    }
}

/// The policy is asked about a request that nothing was to answer: the process that was to do it may be gone.
pub(crate) fn on_question(before: &Standing, now: Time, answer: impl FnOnce() -> Option<Answer>) -> Option<Next> {
    let Standing::Requested { due: None, missing } = before else { return None };
    let (after, verdict) = answer().map(|it| (it.after, it.verdict))?;
    Some(undecided(Standing::Requested { due: Some((now + after, verdict)), missing: missing.clone() }))
}

/// An operator decides at `now`. `may_be_granted`: decisions were lost, so a grant may be out that nobody knows of.
pub(crate) fn on_ruling(
    before: Option<&Standing>,
    now: Time,
    ruling: Ruling,
    may_be_granted: bool,
) -> Result<Next, NotGranted> {
    use Standing as S;
    let granted = may_be_granted || matches!(before, Some(S::Granted { expiry, .. }) if now < expiry.at);
    Ok(decided(match ruling {
        Ruling::Grant { expiry } => S::Granted { expiry, by: By::Operator },
        // The loss of a grant is always a revocation, also when the operator denies: the vehicle may be
        // inside and must leave.
        Ruling::Deny { reason } if granted => S::Revoked { reason, by: By::Operator },
        Ruling::Deny { reason } => S::Denied { reason, by: By::Operator },
        Ruling::Revoke { reason } if granted => S::Revoked { reason, by: By::Operator },
        Ruling::Revoke { .. } => return Err(NotGranted),
    }))
}

/// When [`on_time`] will next change this standing, if what is missing stays the same.
pub(crate) fn deadline(standing: &Standing) -> Option<Time> {
    match standing {
        Standing::Requested { due: Some((_, Verdict::Grant)), missing } if !missing.is_empty() => None,
        Standing::Requested { due, .. } => due.as_ref().map(|(at, _)| *at),
        Standing::Granted { expiry, .. } => Some(expiry.at),
        Standing::Denied { .. } | Standing::Revoked { .. } | Standing::Expired => None,
    }
}

fn decided(standing: Standing) -> Next {
    Next { standing, decided: true }
}

fn undecided(standing: Standing) -> Next {
    Next { standing, decided: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    fn until(s: u64) -> Expiry {
        Expiry { at: at(s), utc_ms: s as i64 * 1000, granted_for: Duration::from_secs(s) }
    }

    const NOW_S: u64 = 10;
    const FRESH_S: u64 = 910;

    /// Every standing by a short name.
    fn named(name: &str) -> Option<Standing> {
        let granted = |s, by| Standing::Granted { expiry: until(s), by };
        let denied = |by| Standing::Denied { reason: "closed".into(), by };
        let revoked = |by| Standing::Revoked { reason: "closed".into(), by };
        let requested = |due: Option<(u64, Verdict)>, missing: &str| Standing::Requested {
            due: due.map(|(s, verdict)| (at(s), verdict)),
            missing: missing.into(),
        };
        Some(match name {
            "unknown" => return None,
            "unanswered" => requested(None, ""),
            "grant later" => requested(Some((15, Verdict::Grant)), ""),
            "grant due" => requested(Some((NOW_S, Verdict::Grant)), ""),
            "grant held back" => requested(Some((NOW_S, Verdict::Grant)), "closed"),
            "denial due" => requested(Some((3, Verdict::Deny { reason: "closed".into() })), ""),
            "granted" => granted(20, By::Policy),
            "granted afresh" => granted(FRESH_S, By::Policy),
            "granted, out" => granted(NOW_S, By::Policy),
            "hand-granted" => granted(20, By::Operator),
            "hand-granted afresh" => granted(FRESH_S, By::Operator),
            "hand-granted, out" => granted(NOW_S, By::Operator),
            "denied" => denied(By::Policy),
            "hand-denied" => denied(By::Operator),
            "revoked" => revoked(By::Policy),
            "hand-revoked" => revoked(By::Operator),
            "expired" => Standing::Expired,
            _ => panic!("no standing is called {name}"),
        })
    }

    #[track_caller]
    fn same(next: Option<Next>, expected: Option<(&str, bool)>) {
        assert_eq!(next, expected.map(|(name, decided)| Next { standing: named(name).unwrap(), decided }));
    }

    #[test]
    fn a_request_in_every_standing() {
        #[track_caller]
        fn check(before: &str, expected: &str, decided: bool) {
            let answer = || Some(Answer { after: Duration::from_secs(5), verdict: Verdict::Grant });
            same(Some(on_request(named(before), at(NOW_S), until(FRESH_S), answer)), Some((expected, decided)));
        }
        check("unknown", "grant later", false);
        check("unanswered", "unanswered", false);
        check("grant due", "grant due", false);
        check("granted", "granted afresh", true);
        check("granted, out", "grant later", false);
        check("hand-granted", "hand-granted", true);
        check("hand-granted, out", "grant later", false);
        check("denied", "grant later", false);
        check("hand-denied", "hand-denied", true);
        check("revoked", "grant later", false);
        check("hand-revoked", "hand-denied", true);
        check("expired", "grant later", false);
    }

    #[test]
    fn time_in_every_standing() {
        #[track_caller]
        fn check(before: &str, expected: Option<(&str, bool)>) {
            same(on_time(&named(before).unwrap(), at(NOW_S), until(FRESH_S), None), expected);
        }
        check("unanswered", None);
        check("grant later", None);
        check("grant due", Some(("granted afresh", true)));
        check("denial due", Some(("denied", true)));
        check("granted", None);
        check("granted, out", Some(("expired", false)));
        check("hand-granted, out", Some(("expired", false)));
        check("denied", None);
        check("hand-denied", None);
        check("revoked", None);
        check("expired", None);
        check("grant held back", Some(("granted afresh", true)));
    }

    #[test]
    fn something_missing_in_every_standing() {
        #[track_caller]
        fn check(before: &str, expected: Option<(&str, bool)>) {
            let before = named(before).unwrap();
            let next = on_time(&before, at(NOW_S), until(FRESH_S), Some("closed".into()));
            let after = next.as_ref().map_or(&before, |it| &it.standing);
            assert!(deadline(after).is_none_or(|it| at(NOW_S) < it), "{after:?} would be looked at again at once");
            same(next, expected);
        }
        check("grant due", Some(("grant held back", false)));
        check("grant held back", None);
        check("denial due", Some(("denied", true)));
        check("granted", Some(("revoked", true)));
        check("granted, out", Some(("expired", false)));
        check("hand-granted", Some(("revoked", true)));
        check("hand-granted, out", Some(("expired", false)));
        for before in ["denied", "hand-denied", "revoked", "hand-revoked", "expired"] {
            check(before, None);
        }
    }

    #[test]
    fn a_ruling_in_every_standing() {
        #[track_caller]
        fn check(before: &str, ruling: &str, expected: Option<&str>) {
            let reason = "closed".to_string();
            let ruling = match ruling {
                "grant" => Ruling::Grant { expiry: until(FRESH_S) },
                "deny" => Ruling::Deny { reason },
                _ => Ruling::Revoke { reason },
            };
            same(on_ruling(named(before).as_ref(), at(NOW_S), ruling, false).ok(), expected.map(|it| (it, true)));
        }
        let held_no_more = ["granted, out", "hand-granted, out", "expired"];
        for before in ["unknown", "unanswered", "grant later", "denied", "hand-denied", "revoked", "hand-revoked"]
            .into_iter()
            .chain(held_no_more)
        {
            check(before, "grant", Some("hand-granted afresh"));
            check(before, "deny", Some("hand-denied"));
            check(before, "revoke", None);
        }
        for before in ["granted", "hand-granted"] {
            check(before, "grant", Some("hand-granted afresh"));
            check(before, "deny", Some("hand-revoked"));
            check(before, "revoke", Some("hand-revoked"));
        }
    }
    #[test]
    fn where_decisions_were_lost_everything_can_be_revoked() {
        for before in ["unknown", "unanswered", "denied", "granted", "expired"] {
            let ruling = Ruling::Revoke { reason: "closed".into() };
            same(on_ruling(named(before).as_ref(), at(NOW_S), ruling, true).ok(), Some(("hand-revoked", true)));
        }
    }

    #[test]
    fn only_what_nothing_was_to_answer_is_asked_again() {
        #[track_caller]
        fn check(before: &str, expected: Option<&str>) {
            let answer = || Some(Answer { after: Duration::from_secs(5), verdict: Verdict::Grant });
            same(on_question(&named(before).unwrap(), at(NOW_S), answer), expected.map(|it| (it, false)));
        }
        check("unanswered", Some("grant later"));
        for before in ["grant due", "granted", "hand-granted", "denied", "hand-denied", "revoked", "expired"] {
            check(before, None);
        }
    }

    #[test]
    fn a_grant_of_a_process_before_lasts_no_longer_than_it_was_given_for() {
        #[track_caller]
        fn check(utc_s: i64, speed: f64, expected_left_s: f64) {
            let now = Now { time: at(7), utc_ms: utc_s * 1000 };
            let pace = Pace::new(speed).unwrap();
            let restored = Expiry::restored(now, 1_000_000, Duration::from_secs(900), pace);
            assert_eq!((restored.at - at(7)).as_secs_f64(), expected_left_s, "at {utc_s} s");
            assert_eq!(restored.utc_ms, 1_000_000);
        }
        check(900, 1.0, 100.0);
        check(990, 20.0, 200.0);
        check(1000, 1.0, 0.0);
        check(2000, 1.0, 0.0);
        check(-5_000_000, 1.0, 900.0);
    }
}
