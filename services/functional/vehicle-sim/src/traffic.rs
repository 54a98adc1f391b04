//! Other traffic: it flies straight and level, or in a level circle.

use domain::fmu::{TrafficKind, TransponderReport};
use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;

/// How something moves.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Course {
    /// Straight and level, or not at all.
    Straight {
        /// Where it appears.
        from: Ned,
        /// Over ground.
        velocity: NedVelocity,
    },
    /// Level round a place, clockwise, beginning in its north.
    Circle {
        /// The place, at the height of the circle.
        round: Ned,
        /// In metres, more than 0.
        radius_m: f64,
        /// Along the circle.
        speed_m_s: f64,
    },
}

impl Course {
    /// Where it is this many seconds after it appeared, and its velocity.
    fn after(self, seconds: f64) -> (Ned, NedVelocity) {
        match self {
            Course::Straight { from, velocity } => {
                let north_m = from.north_m + velocity.north_m_s * seconds;
                let east_m = from.east_m + velocity.east_m_s * seconds;
                (Ned { north_m, east_m, ..from }, velocity)
            }
            Course::Circle { round, radius_m, speed_m_s } => {
                let (sin, cos) = (speed_m_s / radius_m * seconds).sin_cos();
                let north_m = round.north_m + radius_m * cos;
                let east_m = round.east_m + radius_m * sin;
                (Ned { north_m, east_m, ..round }, NedVelocity::new(-speed_m_s * sin, speed_m_s * cos, 0.0))
            }
        }
    }
}

#[derive(Debug)]
struct Intruder {
    id: String,
    appeared: Time,
    course: Course,
    kind: TrafficKind,
}

/// All other traffic.
#[derive(Debug, Default)]
pub(crate) struct Traffic {
    intruders: Vec<Intruder>,
    count: u32,
}

impl Traffic {
    /// Something appears; returns its id, which nothing had before.
    pub(crate) fn appear(&mut self, course: Course, kind: TrafficKind, now: Time) -> &str {
        self.count += 1;
        self.intruders.push(Intruder { id: format!("intruder-{}", self.count), appeared: now, course, kind });
        self.intruders.last().map_or("", |it| &it.id)
    }

    /// All of them disappear.
    pub(crate) fn clear(&mut self) {
        self.intruders.clear();
    }

    /// What a transponder receiver reports about each.
    pub(crate) fn reports(&self, now: Time) -> impl Iterator<Item = TransponderReport> {
        self.intruders.iter().map(move |Intruder { id, appeared, course, kind }| {
            let (position, velocity) = course.after((now - *appeared).as_secs_f64());
            TransponderReport { id: id.clone(), position, velocity, kind: *kind }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_keeps_its_radius_and_its_speed() {
        let round = Ned::new(100.0, 200.0, -50.0);
        let circle = Course::Circle { round, radius_m: 300.0, speed_m_s: 20.0 };
        for tenths in 0..1_200 {
            let (position, velocity) = circle.after(f64::from(tenths) / 10.0);
            assert!((position.horizontal_distance_m(round) - 300.0).abs() < 1e-6 && position.down_m == -50.0);
            assert!((velocity.north_m_s.hypot(velocity.east_m_s) - 20.0).abs() < 1e-9);
        }
        let quarter_s = std::f64::consts::FRAC_PI_2 * 300.0 / 20.0;
        let (position, velocity) = circle.after(quarter_s);
        assert!((position.east_m - 500.0).abs() < 1e-6 && (velocity.north_m_s + 20.0).abs() < 1e-6);
    }
}
