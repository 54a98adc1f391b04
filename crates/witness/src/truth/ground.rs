//! The ground is where it is, whatever height the take-off point has.

use super::View;

pub(super) const IN_WORDS: &str = "never flies into the ground of a place from the side, and never along it: at 3 m/s or more at least 1 m \
     above (issue 44, P1; ENG: a landing drifts slower)";
/// Nearer to the ground than this, in metres, the vehicle only takes off and lands.
const LOW_M: f64 = 1.0;
/// As fast as this over ground it does neither.
const FAST_M_S: f64 = 3.0;

#[derive(Debug, Default)]
pub(super) struct Ground {
    skims: bool,
}

impl Ground {
    pub(super) fn see(&mut self, view: &View<'_>) -> Option<String> {
        let truth = view.truth;
        if view.before.collisions < truth.collisions {
            let top_m = truth.ground_m.max(view.before.ground_m);
            let height_m = truth.position.height_m();
            return Some(format!(
                "it flew into something at ({}), {height_m:.1} m high; ground here {top_m:.0} m",
                truth.position
            ));
        }
        let (clearance_m, speed_m_s) = (truth.clearance_m(), truth.velocity.north_m_s.hypot(truth.velocity.east_m_s));
        let skims = !truth.standing && view.heard.flies_itself && clearance_m < LOW_M && FAST_M_S < speed_m_s;
        let began = skims && !std::mem::replace(&mut self.skims, skims);
        began.then(|| format!("it flew at {speed_m_s:.1} m/s, {clearance_m:.1} m above the ground"))
    }
}
