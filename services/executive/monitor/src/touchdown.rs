//! How fast the vehicle came down on the ground.

use std::time::Duration;

use domain::time::Time;

/// The fastest descent in the last one to two of these before the vehicle counts as on the ground counts as the touchdown.
/// (PX4's land detector takes about a second: LNDMC_TRIG_TIME.)
const WINDOW: Duration = Duration::from_millis(1500);

/// Watches descents and landings.
#[derive(Debug, Clone, Default)]
pub(crate) struct Touchdown {
    /// The fastest descent in this window and in the one before it, in metres per second.
    this_window_m_s: f64,
    last_window_m_s: f64,
    ends: Time,
    flying: bool,
    speed_m_s: Option<f64>,
}

impl Touchdown {
    /// The vehicle moves downwards so fast, in metres per second.
    pub(crate) fn descends(&mut self, now: Time, speed_m_s: f64) {
        if self.ends <= now {
            (self.last_window_m_s, self.this_window_m_s) = (self.this_window_m_s, 0.0);
            self.ends = now + WINDOW;
        }
        self.this_window_m_s = self.this_window_m_s.max(speed_m_s);
    }

    /// The vehicle flies, or stands on the ground.
    pub(crate) fn flies(&mut self, flying: bool) {
        if flying {
            self.speed_m_s = Some(0.0);
        } else if self.flying {
            self.speed_m_s = Some(self.this_window_m_s.max(self.last_window_m_s));
        }
        self.flying = flying;
    }

    /// The speed of the last touchdown, 0 in the air; `None` where none was seen.
    pub(crate) fn speed_m_s(&self) -> Option<f64> {
        self.speed_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_descent_of_the_last_seconds_is_the_touchdown() {
        /// A descent at one speed a tenth of a second, then the ground.
        #[track_caller]
        fn check(descents_m_s: &[f64], expected_m_s: f64) {
            let mut touchdown = Touchdown::default();
            touchdown.flies(false);
            assert_eq!(touchdown.speed_m_s(), None, "it has not come down yet");
            touchdown.flies(true);
            assert_eq!(touchdown.speed_m_s(), Some(0.0));
            for (index, speed_m_s) in descents_m_s.iter().enumerate() {
                touchdown.descends(Time::after(Duration::from_millis(100) * index as u32), *speed_m_s);
            }
            touchdown.flies(false);
            touchdown.flies(false);
            assert_eq!(touchdown.speed_m_s(), Some(expected_m_s));
        }
        check(&[0.7; 40], 0.7);
        check(&[1.5, 6.0, 0.0, 0.0], 6.0);
        let long_ago: Vec<f64> = [6.0].into_iter().chain([0.7; 40]).collect();
        check(&long_ago, 0.7);
    }
}
