//! The setpoints that were sent last, by which one of somebody else is told from ours.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::Time;

use crate::said::Target;

/// What was sent in the last seconds.
#[derive(Debug, Default)]
pub(crate) struct Sent {
    targets: VecDeque<(Time, Target)>,
    /// Points against: two for each that is not ours, one less for each that is.
    suspicion: u32,
}

/// What the autopilot follows may be as old as this.
const MEMORY: Duration = Duration::from_millis(1_500);
/// More are not kept: 20 Hz for the time above.
const KEPT: usize = 60;
/// Two setpoints that are not ours, or one in every two of several.
const SUSPICIOUS: u32 = 4;

impl Sent {
    /// This was sent.
    pub(crate) fn note(&mut self, target: Target, now: Time) {
        while self.targets.len() >= KEPT || self.targets.get(1).is_some_and(|(at, _)| MEMORY < now - *at) {
            self.targets.pop_front();
        }
        self.targets.push_back((now, target));
    }

    /// What was sent is followed no more.
    pub(crate) fn forget(&mut self) {
        self.targets.clear();
        self.suspicion = 0;
    }

    /// Whether what the autopilot follows is not ours, again and again.
    pub(crate) fn is_of_somebody_else(&mut self, mask: u16, position: [f64; 3], velocity: [f64; 3]) -> bool {
        if self.targets.is_empty() {
            return false;
        }
        // POSITION_TARGET_TYPEMASK: all three parts ignored.
        let (no_position, no_velocity) = (mask & 0x007 == 0x007, mask & 0x038 == 0x038);
        let is_ours = self.targets.iter().any(|(_, sent)| match (sent.position, sent.velocity) {
            (Some(sent), along) if !no_position => {
                // Between two messages it goes on at the velocity that came with the position.
                let speed_m_s = along.map_or(0.0, length);
                apart(sent, position) <= 1.0 + 0.5 * speed_m_s
            }
            (None, Some(sent)) if no_position && !no_velocity => apart(sent, velocity) <= 0.5,
            _ => false,
        });
        self.suspicion = if is_ours { self.suspicion.saturating_sub(1) } else { self.suspicion + 2 };
        SUSPICIOUS <= self.suspicion
    }
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    length(std::array::from_fn(|i| a[i] - b[i]))
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|it| it * it).sum::<f64>().sqrt()
}
