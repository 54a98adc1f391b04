//! The latest moment: for how long a vehicle in the air may still wait, before a landing that it could have reached is out of reach.
//!
//! Every wait of a response asks it. A wait that ends by a clock ends too early with a full battery, and too late with an empty one. The
//! battery is all that it counts: the mission manager limits waits where something else is short, too.

use std::time::Duration;

use crate::energy::{EnergyModel, Wind};
use crate::quantity::Fraction;

/// After a wait other actions are tried, and areas may be entered on the way to what was waited for: it must still be in reach then. (ENG: the
/// pauses of a response, and a charge in whole per cent.)
const TRIES_S: f64 = 15.0;

/// What a wait is judged by.
#[derive(Debug, Clone, Copy)]
pub struct Waiting<'a> {
    /// The vehicle's figures.
    pub energy: &'a EnergyModel,
    /// The wind in which it hovers.
    pub wind: Wind,
    /// Of the battery.
    pub charge: Fraction,
    /// Below this charge the vehicle lands where it is.
    pub lands_below: Fraction,
}

impl Waiting<'_> {
    /// For how long it may hover and wait for what takes `awaited_wh` then, the landing included; `open_wh` is what the landing takes that
    /// can be reached without waiting, if there is one: that must not be lost, nor its reserve. Where there is none, what is
    /// waited for is worth the reserve.
    pub fn slack(&self, awaited_wh: f64, open_wh: Option<f64>) -> Duration {
        let left_wh = match open_wh {
            Some(open_wh) => self.energy.budget(self.charge).usable_wh - open_wh.max(awaited_wh),
            None => {
                let tries_wh = self.energy.hover_wh(TRIES_S, self.wind);
                self.energy.budget_above(self.charge, self.lands_below).usable_wh - awaited_wh - tries_wh
            }
        };
        // A way that takes for ever, as in a wind that cannot be flown against, leaves nothing.
        let slack_s = (left_wh / self.energy.hover_wh(1.0, self.wind)).max(0.0);
        Duration::try_from_secs_f64(slack_s).unwrap_or(Duration::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_wait_lasts_as_long_as_the_way_down_is_not_lost() {
        #[derive(serde::Deserialize)]
        struct File {
            energy: EnergyModel,
        }
        let energy = toml::from_str::<File>(testing::ENERGY).unwrap().energy;
        // Of 300 Wh; hovering takes 725 W, the reserve is 25 %.
        let check = |charge: f64, awaited_wh: f64, open_wh: Option<f64>, expected_s: f64| {
            let fraction = |it: f64| Fraction::try_from(it).unwrap();
            let charge = fraction(charge);
            let waiting = Waiting { energy: &energy, wind: Wind::CALM, charge, lands_below: fraction(0.1) };
            let slack_s = waiting.slack(awaited_wh, open_wh).as_secs_f64();
            assert!((slack_s - expected_s).abs() < 0.1, "{charge:?}, {awaited_wh} Wh, {open_wh:?}: {slack_s} s");
        };
        let hover_s = |wh: f64| wh * 3600.0 / 725.0;
        // Home opens later, and nothing else can be reached: the reserve is there for that.
        check(0.5, 10.0, None, hover_s(120.0 - 10.0) - TRIES_S);
        check(0.2, 10.0, None, hover_s(30.0 - 10.0) - TRIES_S);
        check(0.12, 10.0, None, 0.0);
        // A site can be reached: neither it nor its reserve is waited away, nor what is waited for.
        check(0.5, 10.0, Some(5.0), hover_s(75.0 - 10.0));
        check(0.5, 10.0, Some(40.0), hover_s(75.0 - 40.0));
        check(0.25, 10.0, Some(5.0), 0.0);
        check(1.0, f64::INFINITY, None, 0.0);
        check(1.0, f64::NAN, None, 0.0);
    }
}
