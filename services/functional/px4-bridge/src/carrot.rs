//! A moving target for a limited speed: offboard, PX4 knows no limit but its own, and flies to a position as fast as it can.
//!
//! The target moves along the line at the wanted speed, as far ahead of the vehicle as PX4's position loop needs. (Measured: 1.85 m/s
//! for 2 m/s, 2 to 3 m behind.)

use std::time::Duration;

use domain::geometry::Ned;
use domain::time::Time;

/// A stream with a longer gap begins again at the vehicle.
const GAP: Duration = Duration::from_millis(500);
/// The target is never kept nearer to the vehicle than this, in metres.
const LEAST_LEAD_M: f64 = 1.0;

/// Where the moving target is.
#[derive(Debug, Clone, Default)]
pub(crate) struct Carrot(Option<(Time, Ned)>);

impl Carrot {
    /// The next setpoint on the way to `target` at `speed_m_s`, at most `lead_s` ahead of the vehicle at `vehicle`.
    pub(crate) fn next(&mut self, target: Ned, speed_m_s: f64, lead_s: f64, vehicle: Ned, now: Time) -> Ned {
        let from = self.0.filter(|(at, _)| now - *at <= GAP);
        let (at, from) = from.unwrap_or((now, vehicle));
        let left_m = from.distance_m(target);
        let step_m = speed_m_s * (now - at).as_secs_f64();
        let next = if left_m <= step_m { target } else { from.towards(target, step_m / left_m) };
        let lead_m = (speed_m_s * lead_s).max(LEAST_LEAD_M);
        // A vehicle that is held back is waited for. One that the target has left behind is let come nearer.
        let waits = lead_m < next.distance_m(vehicle) && from.distance_m(vehicle) < next.distance_m(vehicle);
        let next = if waits { from } else { next };
        self.0 = Some((now, next));
        next
    }

    /// Setpoints go through as they are: the next limited one begins at the vehicle.
    pub(crate) fn end(&mut self) {
        self.0 = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PX4's position loop: the vehicle closes in at 0.95 of the distance a second (`MPC_XY_P`), at most 12 m/s.
    fn fly(speed_m_s: f64, limit_m_s: f64, seconds: u32) -> Vec<Ned> {
        let (target, mut vehicle, mut carrot) =
            (Ned::new(0.0, 100.0, -10.0), Ned::new(0.0, 0.0, -10.0), Carrot::default());
        (0..seconds * 20)
            .map(|tick| {
                let now = Time::after(Duration::from_millis(u64::from(tick) * 50));
                let next = carrot.next(target, speed_m_s, 1.2, vehicle, now);
                let gap = next.distance_m(vehicle);
                let step = (0.95 * gap).min(limit_m_s) * 0.05;
                vehicle = if gap < 1e-9 { vehicle } else { vehicle.towards(next, step / gap) };
                vehicle
            })
            .collect()
    }

    #[test]
    fn the_vehicle_flies_at_the_wanted_speed_and_arrives() {
        for speed_m_s in [1.0, 2.0, 5.0, 9.0] {
            let track = fly(speed_m_s, 12.0, (100.0 / speed_m_s) as u32 + 10);
            let fastest = track.windows(2).map(|it| it[0].distance_m(it[1]) * 20.0).fold(0.0, f64::max);
            assert!(fastest <= speed_m_s * 1.01, "{fastest} for {speed_m_s}");
            assert!(fastest >= speed_m_s * 0.95, "{fastest} for {speed_m_s}");
            let end = track.last().map(|it| it.distance_m(Ned::new(0.0, 100.0, -10.0)));
            assert!(end.is_some_and(|it| it < 0.1), "{end:?} for {speed_m_s}");
        }
    }

    #[test]
    fn a_vehicle_that_is_held_back_is_waited_for() {
        let mut carrot = Carrot::default();
        let (target, vehicle) = (Ned::new(0.0, 100.0, -10.0), Ned::new(0.0, 0.0, -10.0));
        for tick in 0..1000 {
            let next = carrot.next(target, 5.0, 1.2, vehicle, Time::after(Duration::from_millis(tick * 50)));
            assert!(next.distance_m(vehicle) <= 6.0 + 1e-9, "{next}");
        }
    }

    #[test]
    fn after_a_gap_it_begins_at_the_vehicle() {
        let mut carrot = Carrot::default();
        let target = Ned::new(0.0, 100.0, -10.0);
        carrot.next(target, 5.0, 1.2, Ned::new(0.0, 0.0, -10.0), Time::after(Duration::from_secs(1)));
        let elsewhere = Ned::new(50.0, 0.0, -10.0);
        assert_eq!(carrot.next(target, 5.0, 1.2, elsewhere, Time::after(Duration::from_secs(9))), elsewhere);
    }
}
