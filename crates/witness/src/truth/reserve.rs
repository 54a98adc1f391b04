//! Coming down with the reserve.

use std::time::Duration;

use domain::quantity::Fraction;
use domain::time::Time;

use super::View;
use super::reach::Reach;

pub(super) const IN_WORDS: &str = "does not come down with more than 5 % of the battery less than the reserve if for 30 s since the last trouble a place \
     to land at was in reach with 3 % above it (issue 44, P1 and P2)";
/// How much above the reserve counts as in reach, for how long, and how much below it as too little, 0 to 1.
const SURE: f64 = 0.03;
const FOR: Duration = Duration::from_secs(30);
const BELOW: f64 = 0.05;

#[derive(Debug, Default)]
pub(super) struct Reserve {
    since: Option<Time>,
    /// The last moment at which it had been in reach for long enough, and which place.
    missed: Option<(Time, String)>,
}

impl Reserve {
    /// What was in reach before counts no longer.
    pub(super) fn troubled(&mut self) {
        (self.since, self.missed) = (None, None);
    }

    pub(super) fn see(&mut self, view: &View<'_>, reach: &Reach) -> Option<String> {
        let (now, truth) = (view.heard.now.time, view.truth);
        if view.touched_down() {
            let charge = Fraction::try_from(truth.charge.clamp(0.0, 1.0)).ok()?;
            let reserve = view.energy.budget(charge).reserve.get();
            let (at, place) = self.missed.take()?;
            return (truth.charge < reserve - BELOW).then(|| {
                let (percent, ago_s) = (truth.charge * 100.0, (now - at).as_secs());
                format!("it came down with {percent:.0} %; {ago_s} s before `{place}` was in reach with the reserve")
            });
        }
        let best = reach.best.as_ref().filter(|it| SURE < it.margin && view.heard.flies_itself && !truth.standing);
        self.since = best.map(|_| self.since.unwrap_or(now));
        if let (Some(best), Some(since)) = (best, self.since)
            && since + FOR < now
        {
            self.missed = Some((now, best.place.clone()));
        }
        None
    }
}
