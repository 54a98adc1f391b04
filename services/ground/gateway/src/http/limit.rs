//! Rate limits: a token bucket for each client, refilled as time passes.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// More than twice as many as there are operators; the names come from the token file, so this is never reached.
const MAX_BUCKETS: usize = 1024;

/// Whose requests, and which of them, are limited together.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Budget {
    /// Of all clients without a valid token.
    Strangers,
    /// What a client reads.
    Reads(Arc<str>),
    /// What a client orders: a page that asks too often is no reason to refuse an abort.
    Orders(Arc<str>),
}

/// The buckets.
#[derive(Debug)]
pub(crate) struct RateLimiter {
    per_second: f64,
    burst: f64,
    buckets: Mutex<BTreeMap<Budget, Bucket>>,
}

#[derive(Debug)]
struct Bucket {
    left: f64,
    at: Instant,
}

impl RateLimiter {
    /// Of each budget, a client may make `per_second` requests a second, and `burst` at once.
    pub(crate) fn new(per_second: f64, burst: f64) -> RateLimiter {
        RateLimiter { per_second, burst, buckets: Mutex::default() }
    }

    /// Takes one request out of the bucket of `budget`.
    ///
    /// # Errors
    /// The time to wait, if the bucket is empty.
    pub(crate) fn admit(&self, budget: Budget, now: Instant) -> Result<(), Duration> {
        // The data are whole even if a thread panicked while it held the lock.
        let mut buckets = self.buckets.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let fits = buckets.len() < MAX_BUCKETS || buckets.contains_key(&budget);
        let bucket = buckets
            .entry(if fits { budget } else { Budget::Strangers })
            .or_insert(Bucket { left: self.burst, at: now });
        let passed = now.saturating_duration_since(bucket.at).as_secs_f64();
        bucket.left = (bucket.left + passed * self.per_second).min(self.burst);
        bucket.at = now;
        if bucket.left < 1.0 {
            return Err(Duration::from_secs_f64((1.0 - bucket.left) / self.per_second));
        }
        bucket.left -= 1.0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_and_then_each_budget_is_limited_by_the_rate() {
        let (limiter, start) = (RateLimiter::new(2.0, 3.0), Instant::now());
        let admitted = |budget: &Budget, at| (0..10).filter(|_| limiter.admit(budget.clone(), at).is_ok()).count();
        let (anna, ben) = (Budget::Reads("anna".into()), Budget::Reads("ben".into()));
        assert_eq!(admitted(&anna, start), 3);
        assert_eq!(limiter.admit(anna.clone(), start), Err(Duration::from_millis(500)));
        assert_eq!(admitted(&ben, start), 3);
        assert_eq!(admitted(&Budget::Orders("anna".into()), start), 3);
        assert_eq!(admitted(&Budget::Strangers, start), 3);
        assert_eq!(admitted(&anna, start + Duration::from_secs(1)), 2);
        assert_eq!(admitted(&anna, start + Duration::from_secs(60)), 3);
    }
}
