//! Other traffic: where it will be, how far is far enough, and what is the way out of its way.
//!
//! Nothing here asks what the vehicle flies at present: that is what a response changes.

use std::f64::consts::TAU;

use crate::fmu::TrafficKind;
use crate::geometry::{Ned, NedVelocity};
use crate::speeds::Speeds;

/// How far ahead both are thought to fly on, in seconds. (ENG: ArduPilot warns 30 s ahead; twice that for a vehicle that is slow.)
pub const AHEAD_S: f64 = 60.0;
/// A way out of the way is looked at for this long, in seconds: until what is that far ahead has passed. (ENG)
const LOOKS_S: u32 = 90;
/// Nearer than this share of well clear it lands, where it may: near what counts as a near mid-air collision. (ASTM
/// F3442: 500 ft of 2000 ft, 100 ft of 250 ft.)
const TOO_NEAR: f64 = 0.4;
/// What is chosen is kept unless something else is better by this much of well clear. (ENG: less is not worth a turn.)
const WORTH_A_TURN: f64 = 0.15;
/// Directions that are tried, and how far, as multiples of well clear.
const DIRECTIONS: u32 = 16;
const ASIDE: [f64; 3] = [0.5, 1.1, 1.6];

/// Traffic as it moves now.
#[derive(Debug, Clone, PartialEq)]
pub struct Mover {
    /// Names it.
    pub id: String,
    /// What it is.
    pub kind: TrafficKind,
    /// Where it is.
    pub position: Ned,
    /// How fast, and which way.
    pub velocity: NedVelocity,
    /// How fast it turns to the right, in radians per second; 0: it flies straight.
    pub turn_rad_s: f64,
}

impl Mover {
    /// Where it is in this many seconds, if it goes on as it does.
    pub fn after(&self, seconds: f64) -> Ned {
        let (angle, NedVelocity { north_m_s, east_m_s, down_m_s }) = (self.turn_rad_s * seconds, self.velocity);
        // Along the chord of its arc.
        let (sin, cos) = (angle / 2.0).sin_cos();
        let chord_s = if angle.abs() < 1e-6 { seconds } else { seconds * sin / (angle / 2.0) };
        Ned::new(
            self.position.north_m + (north_m_s * cos - east_m_s * sin) * chord_s,
            self.position.east_m + (north_m_s * sin + east_m_s * cos) * chord_s,
            self.position.down_m + down_m_s * seconds,
        )
    }

    /// How far `own` is from it at `place`, as a share of well clear: 1 and more is well clear.
    fn clearance(&self, place: Ned, own: Ned) -> f64 {
        let WellClear { over_ground_m, height_m } = WellClear::of(self.kind, own.height_m());
        let (away_m, above_m) = (own.horizontal_distance_m(place), (own.down_m - place.down_m).abs());
        (away_m / over_ground_m).max(above_m / height_m)
    }
}

/// So far away is far enough: over ground, or in height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WellClear {
    /// Over ground, in metres.
    pub over_ground_m: f64,
    /// Above or below, in metres.
    pub height_m: f64,
}

impl WellClear {
    /// Of this kind of traffic, for a vehicle at this height, in metres above the origin. (ASTM F3442: 2000 ft and 250 ft. ArduPilot:
    /// UAV_XY 150 m, UAV_Z 25 m. SORA: what falls hits no farther aside than it was high; ENG: no less than 30 m.)
    pub fn of(kind: TrafficKind, own_height_m: f64) -> WellClear {
        match kind {
            TrafficKind::Crewed => WellClear { over_ground_m: 610.0, height_m: 76.0 },
            TrafficKind::Uncrewed => WellClear { over_ground_m: 150.0, height_m: 25.0 },
            // Who is below may be hit by what falls, from whatever height.
            TrafficKind::Vessel => WellClear { over_ground_m: own_height_m.max(30.0), height_m: f64::INFINITY },
        }
    }
}

/// What a vehicle does to get out of the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Evasion {
    /// It stays where it is.
    Stay,
    /// It flies straight to this place.
    To(Ned),
    /// It lands where it is.
    Land,
}

impl Evasion {
    /// Where a vehicle that was at `from` is after this many seconds; `None`: on the ground.
    fn place(self, from: Ned, speeds: &Speeds, seconds: f64) -> Option<Ned> {
        match self {
            Evasion::Stay => Some(from),
            Evasion::To(to) => {
                let all_s = speeds.time_s(from, to);
                Some(if all_s <= seconds { to } else { from.towards(to, seconds / all_s) })
            }
            Evasion::Land => {
                let height_m = from.height_m() - speeds.descent_m_s * seconds;
                (0.0 < height_m).then(|| from.at_height(height_m))
            }
        }
    }

    /// Whether a vehicle at `from` stays well clear of `traffic` by it.
    pub fn is_well_clear(self, from: Ned, speeds: &Speeds, traffic: &[Mover]) -> bool {
        1.0 <= self.clearance(from, speeds, traffic)
    }

    /// Whether it comes as near to `traffic` as what lands where it may.
    pub fn is_too_near(self, from: Ned, speeds: &Speeds, traffic: &[Mover]) -> bool {
        self.clearance(from, speeds, traffic) < TOO_NEAR
    }

    /// How near it comes to `traffic`, as a share of well clear; what is far is 2.
    fn clearance(self, from: Ned, speeds: &Speeds, traffic: &[Mover]) -> f64 {
        let at = |second: u32| {
            let seconds = f64::from(second);
            let own = self.place(from, speeds, seconds)?;
            traffic.iter().map(|it| it.clearance(it.after(seconds), own)).reduce(f64::min)
        };
        (0..=LOOKS_S).filter_map(at).fold(2.0, f64::min)
    }
}

/// How a vehicle at `from`, in the air, keeps out of the way of `traffic`: it stays, if that is well clear; else to the side, or down to
/// `lowest_m`, by what comes least near, of what `may_fly` allows; it lands, if it `may_land`, where it would come too near
/// otherwise. What was `chosen` is kept unless something else is clearly better.
pub fn evade(
    from: Ned,
    traffic: &[Mover],
    speeds: &Speeds,
    lowest_m: f64,
    chosen: Option<Evasion>,
    may_fly: impl Fn(Ned) -> bool,
    may_land: bool,
) -> Evasion {
    let clearance = |it: Evasion| it.clearance(from, speeds, traffic);
    let stay = clearance(Evasion::Stay);
    let kept = chosen.filter(|it| match it {
        Evasion::To(to) => may_fly(*to),
        Evasion::Stay | Evasion::Land => true,
    });
    if let Some(kept) = kept.filter(|it| *it != Evasion::Stay)
        && 1.0 <= clearance(kept)
    {
        return kept;
    }
    if 1.0 <= stay {
        return Evasion::Stay;
    }
    let radius_m = traffic.iter().map(|it| WellClear::of(it.kind, from.height_m()).over_ground_m).fold(0.0, f64::max);
    let heights_m = [Some(from.height_m()), Some(lowest_m).filter(|it| *it < from.height_m() - 1.0)];
    let aside = |height_m: f64, share: f64, direction: u32| {
        let (sin, cos) = (TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
        Ned::new(from.north_m + cos * share * radius_m, from.east_m + sin * share * radius_m, -height_m)
    };
    let places = heights_m.into_iter().flatten().flat_map(|height_m| {
        let all_round =
            ASIDE.into_iter().flat_map(move |share| (0..DIRECTIONS).map(move |it| aside(height_m, share, it)));
        std::iter::once(from.at_height(height_m)).chain(all_round)
    });
    let free = places.filter(|it| may_fly(*it)).map(Evasion::To);
    let better = |best: (Evasion, f64), it: Evasion| {
        // What is well clear suffices: the first of them, which is the nearest.
        let clear = if 1.0 <= best.1 { return best } else { clearance(it).min(1.0) };
        if best.1 < clear { (it, clear) } else { best }
    };
    let first = kept.map_or((Evasion::Stay, stay), |it| (it, clearance(it) + WORTH_A_TURN));
    let best = free.fold(first, better);
    match may_land && best.1 < TOO_NEAR && best.1 < clearance(Evasion::Land) {
        true => Evasion::Land,
        false => best.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEEDS: Speeds = Speeds::calm(12.0, 3.0, 1.5);
    const FROM: Ned = Ned::new(0.0, 0.0, -40.0);

    fn mover(kind: TrafficKind, position: Ned, velocity: NedVelocity) -> Mover {
        Mover { id: "a".into(), kind, position, velocity, turn_rad_s: 0.0 }
    }

    /// From the north at 30 m/s, so far to the east of the vehicle, and at this height.
    fn from_north(kind: TrafficKind, east_m: f64, height_m: f64) -> Mover {
        mover(kind, Ned::new(1500.0, east_m, -height_m), NedVelocity::new(-30.0, 0.0, 0.0))
    }

    #[test]
    fn what_turns_flies_a_circle() {
        // To the right from the north of a circle of 300 m.
        let circling = Mover {
            turn_rad_s: 20.0 / 300.0,
            ..mover(TrafficKind::Crewed, Ned::new(300.0, 0.0, -40.0), NedVelocity::new(0.0, 20.0, 0.0))
        };
        for second in 0..120 {
            let at = circling.after(f64::from(second));
            assert!((at.horizontal_distance_m(Ned::default()) - 300.0).abs() < 1e-6, "{at}");
        }
        let quarter = circling.after(std::f64::consts::FRAC_PI_2 * 300.0 / 20.0);
        assert!(quarter.distance_m(Ned::new(0.0, 300.0, -40.0)) < 1e-6, "{quarter}");
    }

    #[test]
    fn it_gets_out_of_the_way_by_the_free_side_and_stays_where_that_is_well_clear() {
        #[track_caller]
        fn check(traffic: &[Mover], may_fly: fn(Ned) -> bool, expected: fn(Ned) -> bool) {
            match evade(FROM, traffic, &SPEEDS, 15.0, None, may_fly, true) {
                Evasion::To(to) => assert!(expected(to), "to {to}"),
                other => panic!("{other:?}"),
            }
        }
        let stays = |traffic: &[Mover]| evade(FROM, traffic, &SPEEDS, 15.0, None, |_| true, true) == Evasion::Stay;
        let (crewed, uncrewed) = (TrafficKind::Crewed, TrafficKind::Uncrewed);
        assert!(stays(&[]) && stays(&[from_north(crewed, 700.0, 40.0)]) && stays(&[from_north(crewed, 0.0, 120.0)]));
        assert!(stays(&[from_north(uncrewed, 200.0, 40.0)]));
        // It passes in the east, or in the west.
        check(&[from_north(crewed, 200.0, 40.0)], |_| true, |it| it.east_m < -250.0);
        check(&[from_north(crewed, -200.0, 40.0)], |_| true, |it| 250.0 < it.east_m);
        check(&[from_north(uncrewed, 20.0, 40.0)], |_| true, |it| it.east_m < -60.0);
        // That side may not be flown to.
        check(&[from_north(crewed, 200.0, 40.0)], |it| -1.0 < it.east_m, |it| 250.0 < it.east_m);
    }

    #[test]
    fn it_lands_only_where_it_would_come_too_near_otherwise() {
        let near = mover(TrafficKind::Crewed, Ned::new(900.0, 0.0, -40.0), NedVelocity::new(-20.0, 0.0, 0.0));
        let evades = |may_fly: fn(Ned) -> bool, may_land| {
            evade(FROM, std::slice::from_ref(&near), &SPEEDS, 15.0, None, may_fly, may_land)
        };
        assert!(matches!(evades(|_| true, true), Evasion::To(_)));
        assert_eq!(evades(|_| false, true), Evasion::Land);
        assert_eq!(evades(|_| false, false), Evasion::Stay);
        // Straight down is better than to stay.
        let straight_down: fn(Ned) -> bool = |it| it.horizontal_distance_m(FROM) < 1.0;
        assert_eq!(evades(straight_down, false), Evasion::To(FROM.at_height(15.0)));
    }

    #[test]
    fn what_was_chosen_is_kept_as_long_as_it_leads_clear() {
        let traffic = [from_north(TrafficKind::Uncrewed, 20.0, 40.0)];
        let chosen = Evasion::To(Ned::new(0.0, 240.0, -40.0));
        assert_eq!(evade(FROM, &traffic, &SPEEDS, 15.0, Some(chosen), |_| true, true), chosen);
        // Across the track, too late.
        let late = [mover(TrafficKind::Uncrewed, Ned::new(150.0, 40.0, -40.0), NedVelocity::new(-20.0, 0.0, 0.0))];
        assert_ne!(evade(FROM, &late, &SPEEDS, 15.0, Some(chosen), |_| true, true), chosen);
    }
}
