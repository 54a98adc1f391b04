//! Where one vehicle stands with one area: the state, and every event in every state.

use domain::time::Time;

use crate::policy::{Answer, Verdict};

/// A grant's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expiry {
    /// In mission time.
    pub at: Time,
    /// The same moment, milliseconds since the Unix epoch, UTC.
    pub utc_ms: i64,
}

/// Who decided. What a hand has decided no policy changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// The tower's policy.
    Policy,
    /// An operator.
    Hand,
}

/// Where a vehicle stands with an area it has asked for, or that was decided about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Standing {
    /// Asked for, not decided.
    Requested {
        /// The policy's decision and when it is due; `None`: never.
        due: Option<(Time, Verdict)>,
    },
    /// May be entered until the expiry.
    Granted {
        /// When it ends.
        expiry: Expiry,
        /// Who granted.
        by: By,
    },
    /// May not be entered.
    Denied {
        /// Why.
        reason: String,
        /// Who denied.
        by: By,
    },
    /// Was granted, then taken back by hand.
    Revoked {
        /// Why.
        reason: String,
    },
    /// Was granted, and the time is up.
    Expired,
}

/// A decision by hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ruling {
    /// The vehicle may enter.
    Grant {
        /// Until then.
        expiry: Expiry,
    },
    /// The vehicle may not enter.
    Deny {
        /// Why.
        reason: String,
    },
    /// The vehicle may not enter any more.
    Revoke {
        /// Why.
        reason: String,
    },
}

/// A ruling that changes nothing, because there is nothing to take back.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("nothing to revoke, the area is not granted")]
pub struct NotGranted;

/// What an event made of a standing.
#[derive(Debug, PartialEq, Eq)]
pub struct Next {
    /// The new standing.
    pub standing: Standing,
    /// Whether it is a decision, that is, an answer to a request or an operator's ruling.
    pub decided: bool,
}

/// A new request arrives; `answer` asks the policy, `fresh` is the expiry of a grant given now.
pub fn on_request(before: Option<Standing>, now: Time, fresh: Expiry, answer: impl FnOnce() -> Option<Answer>) -> Next {
    use Standing as S;
    match before {
        None | Some(S::Expired | S::Denied { by: By::Policy, .. }) => {
            let due = answer().map(|it| (now + it.after, it.verdict));
            undecided(S::Requested { due })
        }
        // The vehicle asks again before the answer: the first answer serves both.
        Some(S::Requested { due }) => undecided(S::Requested { due }),
        // Who may be in an area may stay in it: an extension is not left to chance or delay.
        Some(S::Granted { by: By::Policy, .. }) => decided(S::Granted { expiry: fresh, by: By::Policy }),
        // The operator has set the end; asking does not move it.
        Some(S::Granted { expiry, by: By::Hand }) => decided(S::Granted { expiry, by: By::Hand }),
        Some(S::Denied { reason, by: By::Hand } | S::Revoked { reason }) => decided(S::Denied { reason, by: By::Hand }),
    }
}

/// Time passes; `None`: it changes nothing yet. `fresh` is the expiry of a grant given now.
pub fn on_time(before: &Standing, now: Time, fresh: Expiry) -> Option<Next> {
    use Standing as S;
    match before {
        S::Requested { due: Some((at, verdict)) } if *at <= now => Some(decided(match verdict {
            Verdict::Grant => S::Granted { expiry: fresh, by: By::Policy },
            Verdict::Deny { reason } => S::Denied { reason: reason.clone(), by: By::Policy },
        })),
        // Running out is no decision: nobody has answered anything.
        S::Granted { expiry, .. } if expiry.at <= now => Some(undecided(S::Expired)),
        S::Requested { .. } | S::Granted { .. } | S::Denied { .. } | S::Revoked { .. } | S::Expired => None,
    }
}

/// An operator decides.
pub fn on_ruling(before: Option<&Standing>, ruling: Ruling) -> Result<Next, NotGranted> {
    use Standing as S;
    let granted = matches!(before, Some(S::Granted { .. }));
    Ok(decided(match ruling {
        Ruling::Grant { expiry } => S::Granted { expiry, by: By::Hand },
        // A vehicle always hears the loss of a grant as a revocation, whatever the operator called it:
        // it may be inside and must leave.
        Ruling::Deny { reason } if granted => S::Revoked { reason },
        Ruling::Deny { reason } => S::Denied { reason, by: By::Hand },
        Ruling::Revoke { reason } if granted => S::Revoked { reason },
        Ruling::Revoke { .. } => return Err(NotGranted),
    }))
}

/// When [`on_time`] will next change this standing.
pub fn deadline(standing: &Standing) -> Option<Time> {
    match standing {
        Standing::Requested { due } => due.as_ref().map(|(at, _)| *at),
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
    use std::time::Duration;

    fn at(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    fn until(s: u64) -> Expiry {
        Expiry { at: at(s), utc_ms: s as i64 * 1000 }
    }

    const NOW_S: u64 = 10;
    const FRESH_S: u64 = 910;

    /// Every standing by a short name.
    fn named(name: &str) -> Option<Standing> {
        let granted = |s, by| Standing::Granted { expiry: until(s), by };
        let denied = |by| Standing::Denied { reason: "closed".into(), by };
        Some(match name {
            "unknown" => return None,
            "unanswered" => Standing::Requested { due: None },
            "grant later" => Standing::Requested { due: Some((at(15), Verdict::Grant)) },
            "grant due" => Standing::Requested { due: Some((at(NOW_S), Verdict::Grant)) },
            "denial due" => Standing::Requested { due: Some((at(3), Verdict::Deny { reason: "closed".into() })) },
            "granted" => granted(20, By::Policy),
            "granted afresh" => granted(FRESH_S, By::Policy),
            "granted, out" => granted(NOW_S, By::Policy),
            "hand-granted" => granted(20, By::Hand),
            "hand-granted afresh" => granted(FRESH_S, By::Hand),
            "denied" => denied(By::Policy),
            "hand-denied" => denied(By::Hand),
            "revoked" => Standing::Revoked { reason: "closed".into() },
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
        check("hand-granted", "hand-granted", true);
        check("denied", "grant later", false);
        check("hand-denied", "hand-denied", true);
        check("revoked", "hand-denied", true);
        check("expired", "grant later", false);
    }

    #[test]
    fn time_in_every_standing() {
        #[track_caller]
        fn check(before: &str, expected: Option<(&str, bool)>) {
            same(on_time(&named(before).unwrap(), at(NOW_S), until(FRESH_S)), expected);
        }
        check("unanswered", None);
        check("grant later", None);
        check("grant due", Some(("granted afresh", true)));
        check("denial due", Some(("denied", true)));
        check("granted", None);
        check("granted, out", Some(("expired", false)));
        check("denied", None);
        check("hand-denied", None);
        check("revoked", None);
        check("expired", None);
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
            same(on_ruling(named(before).as_ref(), ruling).ok(), expected.map(|it| (it, true)));
        }
        for before in ["unknown", "unanswered", "grant later", "denied", "hand-denied", "revoked", "expired"] {
            check(before, "grant", Some("hand-granted afresh"));
            check(before, "deny", Some("hand-denied"));
            check(before, "revoke", None);
        }
        for before in ["granted", "hand-granted"] {
            check(before, "grant", Some("hand-granted afresh"));
            check(before, "deny", Some("revoked"));
            check(before, "revoke", Some("revoked"));
        }
    }
}
