//! How requests are answered when no operator decides.
//!
//! A policy answers one request at a time. It does not know what was granted, nor to which vehicle
//! (see `ledger`).

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use rand::Rng;

use crate::config::Config;

/// How the tower answers a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Policy {
    /// Grants at once.
    Grant,
    /// Grants after a while.
    Delay,
    /// Denies at once, with a reason.
    Deny,
    /// Denies some requests, drawn from the seed, and grants the others, at once.
    Random,
    /// Confirms that a request has arrived and never decides.
    Silent,
}

impl Policy {
    /// Every policy there is.
    pub const ALL: [Policy; 5] = [Policy::Grant, Policy::Delay, Policy::Deny, Policy::Random, Policy::Silent];

    /// Its name, which parses back.
    pub fn name(self) -> &'static str {
        match self {
            Policy::Grant => "grant",
            Policy::Delay => "delay",
            Policy::Deny => "deny",
            Policy::Random => "random",
            Policy::Silent => "silent",
        }
    }

    /// The answer to one request; `None`: there will never be one.
    pub(crate) fn answer(self, config: &Config, chance: &mut impl Rng) -> Option<Answer> {
        let at_once = |verdict| Some(Answer { after: Duration::ZERO, verdict });
        let denial = || Verdict::Deny { reason: config.denial_reason.clone() };
        match self {
            Policy::Grant => at_once(Verdict::Grant),
            Policy::Delay => Some(Answer { after: config.delay_s.seconds(), verdict: Verdict::Grant }),
            Policy::Deny => at_once(denial()),
            Policy::Random if chance.random_bool(config.random_denial.get()) => at_once(denial()),
            Policy::Random => at_once(Verdict::Grant),
            Policy::Silent => None,
        }
    }
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Policy {
    type Err = UnknownPolicy;
    fn from_str(text: &str) -> Result<Policy, UnknownPolicy> {
        Policy::ALL.into_iter().find(|policy| policy.name() == text).ok_or_else(|| UnknownPolicy(text.to_owned()))
    }
}

/// Text that names no policy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("found permission policy `{0}`, expected `grant`, `delay`, `deny`, `random` or `silent`")]
pub struct UnknownPolicy(String);

/// A verdict and when it is given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Answer {
    /// Mission time from the request.
    pub(crate) after: Duration,
    pub(crate) verdict: Verdict,
}

/// Yes, or no with a reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Verdict {
    Grant,
    Deny { reason: String },
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn config(random_denial: f64) -> Config {
        Config {
            delay_s: 5.0.try_into().unwrap(),
            random_denial: random_denial.try_into().unwrap(),
            denial_reason: "closed".into(),
            grant_valid_s: 900.0.try_into().unwrap(),
            ledger_rate_hz: 1.0.try_into().unwrap(),
            sites: Vec::new(),
        }
    }

    #[test]
    fn each_policy_answers_in_its_own_way() {
        #[track_caller]
        fn check(policy: &str, expected: Option<(u64, Verdict)>) {
            let policy: Policy = policy.parse().unwrap();
            let answer = policy.answer(&config(1.0), &mut ChaCha8Rng::seed_from_u64(1));
            assert_eq!(answer, expected.map(|(s, verdict)| Answer { after: Duration::from_secs(s), verdict }));
        }
        let denied = || Verdict::Deny { reason: "closed".into() };
        check("grant", Some((0, Verdict::Grant)));
        check("delay", Some((5, Verdict::Grant)));
        check("deny", Some((0, denied())));
        check("random", Some((0, denied())));
        check("silent", None);
    }

    #[test]
    fn random_denials_repeat_with_the_seed_and_have_the_configured_frequency() {
        let draw = |seed| {
            let mut chance = ChaCha8Rng::seed_from_u64(seed);
            (0..1000).map(|_| Policy::Random.answer(&config(0.3), &mut chance)).collect::<Vec<_>>()
        };
        assert_eq!(draw(7), draw(7));
        assert_ne!(draw(7), draw(8));
        let denied = draw(7).iter().flatten().filter(|it| it.verdict != Verdict::Grant).count();
        assert!((250..350).contains(&denied), "{denied} of 1000 denied, expected about 300");
    }

    #[test]
    fn an_unknown_policy_is_reported_with_those_that_exist() {
        let error = "maybe".parse::<Policy>().unwrap_err();
        assert_eq!(
            error.to_string(),
            "found permission policy `maybe`, expected `grant`, `delay`, `deny`, `random` or `silent`"
        );
        for policy in Policy::ALL {
            assert_eq!(policy.to_string().parse(), Ok(policy));
        }
    }
}
