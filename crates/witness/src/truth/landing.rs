//! What is harmed by coming down: people first, then the aircraft.

use domain::quantity::Fraction;
use kittiwake_proto::v1::SkillKind;
use vehicle_sim::ground::Surface;

use super::View;
use super::reach::{Best, Reach};

pub(super) const IN_WORDS: &str = "comes down neither in water nor among people while a place to land at was in reach with 3 % above the reserve when \
     the landing began, or while 10 % above it were left to wait with; unless the vehicle cannot fly on or an operator ordered a landing there. \
     Drops nothing among people (issue 44, P2 and P3)";
/// So much above the reserve, 0 to 1: what the forecast is off by.
const SURE: f64 = 0.03;
/// So much above the reserve leaves time to wait: what cannot be undone comes last. (ENG: two and a half minutes of hovering.)
const SLACK: f64 = 0.1;
/// Of the rows of [`AT_ONCE`], those that still let it reach a place: it has no time to wait.
const HURRIES: [&str; 2] = ["battery_hot", "vibration_extreme"];
/// Rows that bring down what cannot fly on, and an operator's orders to land where the vehicle is.
pub(super) const AT_ONCE: [&str; 14] = [
    "motor_failure",
    "attitude_exceeded",
    "sinking",
    "estimator_lost",
    "battery_emergency",
    "battery_hot",
    "vibration_extreme",
    "wind_too_strong",
    "gust_too_strong",
    "crashed",
    "land_detector_contradicts",
    "operator_abort",
    "operator_land",
    "somebody_else_flies",
];

#[derive(Debug, Default)]
pub(super) struct Landing {
    /// What was in reach when the landing began.
    choice: Option<Best>,
    lands: bool,
    /// Somebody else has flown, or the vehicle could not fly anywhere, during the landing.
    excused: bool,
    hurries: bool,
}

impl Landing {
    pub(super) fn see(&mut self, view: &View<'_>, reach: &Reach) -> Option<String> {
        let (truth, manager) = (view.truth, view.heard.manager);
        if !truth.holds_load && view.before.holds_load && truth.surface == Surface::People && !truth.standing {
            return Some(format!("it dropped its load among people at ({})", truth.position));
        }
        if view.touched_down() {
            return self.touched_down(view);
        }
        let lands = manager.skill() == SkillKind::Land;
        if !lands || !self.lands {
            (self.choice, self.excused, self.hurries) = (reach.best.clone(), false, false);
        }
        self.lands = lands;
        let acting = manager.acting.as_str();
        // Others may be about to take the place, and it cannot wait for them.
        let hurries = HURRIES.contains(&acting) && truth.traffic.is_empty();
        self.hurries |= hurries;
        self.excused |= !view.heard.flies_itself || AT_ONCE.contains(&acting) && !hurries;
        None
    }

    fn touched_down(&mut self, view: &View<'_>) -> Option<String> {
        self.lands = false;
        let (truth, choice) = (view.truth, self.choice.take());
        if truth.surface == Surface::Land || self.excused {
            return None;
        }
        let reserve = view.energy.budget(Fraction::ZERO).reserve.get();
        let instead = match choice.filter(|it| SURE < it.margin) {
            Some(Best { place, position, margin }) => {
                let (away_m, percent) = (position.horizontal_distance_m(truth.position), margin * 100.0);
                format!("`{place}`, {away_m:.0} m away, was in reach with {percent:.0} % above the reserve")
            }
            None if !self.hurries && reserve + SLACK < truth.charge => {
                format!("{:.0} % were left to wait with", truth.charge * 100.0)
            }
            None => return None,
        };
        let (surface, acting, at) = (truth.surface, &view.heard.manager.acting, truth.position);
        Some(format!("it came down in {surface} at ({at}) because of `{acting}`; {instead}"))
    }
}
