//! Made-up flights, and what the witness says of them.

use super::*;
use v1::PermissionState::{Denied, Expired, Granted, Requested, Revoked};

#[test]
fn an_area_of_the_file_applies_and_is_missed_whatever_the_planner_lists() {
    let corners = [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)];
    let area = |name: &str, scale: f64| {
        Area::new(
            name,
            AreaKind::Permission,
            corners.map(|(north_m, east_m)| Ned { north_m: north_m * scale, east_m, down_m: 0.0 }).to_vec(),
        )
    };
    /// What is said about a vehicle that is in area A, as the file has it, after the planner has listed these areas one
    /// after the other.
    #[track_caller]
    fn check(file: &Area, listed: &[Option<Area>], expected: &[&str]) {
        let mut witness = Witness::default().expecting(vec![file.clone()]);
        let mut see = |second: u64, message: Message| {
            witness.take_in(Now { time: Time::after(Duration::from_secs(second)), utc_ms: 0 }, &message);
        };
        for areas in listed {
            let areas = areas.iter().map(Into::into).collect();
            see(0, v1::MissionStatus { areas, ..Default::default() }.into());
        }
        let mode = v1::FlightMode::Offboard as i32;
        see(1, v1::VehicleStatus { armed: true, intended_mode: mode, ..Default::default() }.into());
        let position = Some(v1::Ned { north_m: 40.0, east_m: 0.0, down_m: -10.0 });
        see(2, v1::VehicleLocalPosition { position, ..Default::default() }.into());
        let said: Vec<String> = witness.breaches().iter().map(Breach::what).collect();
        let fits = said.len() == expected.len() && said.iter().zip(expected).all(|(it, part)| it.contains(part));
        assert!(fits, "expected {expected:?}, found {said:?}");
    }
    let file = area("A", 1.0);
    let (lacks, entered) = ("status lacked area A", "entered area A");
    check(&file, &[], &[entered]);
    check(&file, &[Some(file.clone())], &[entered]);
    check(&file, &[None], &[lacks, entered]);
    check(&file, &[None, None, Some(file.clone()), None], &[lacks, lacks, entered]);
    check(&file, &[Some(area("A", 0.5))], &[lacks, entered]);
    check(&file, &[Some(area("B", 0.5))], &[lacks, entered]);
    check(&file, &[Some(Area { kind: AreaKind::KeepOut, ..file.clone() })], &[lacks, entered]);
    check(&file, &[Some(Area { from_utc_ms: Some(1), ..file.clone() })], &[lacks, entered]);
    // Its window comes from a clock that may have been set.
    let windowed = |from_utc_ms| Area { from_utc_ms: Some(from_utc_ms), ..file.clone() };
    check(&windowed(5_000), &[Some(windowed(7_000))], &[]);
    check(&windowed(5_000), &[Some(windowed(-7_000))], &[entered]);
}

#[test]
fn an_area_that_begins_to_apply_around_a_vehicle_is_to_be_left_and_one_that_applies_is_entered() {
    const MS: i64 = 1_000;
    /// What is seen of a vehicle that is inside from 10 s on, by a clock that shows `utc_ms` then and a second later, and goes on.
    #[track_caller]
    fn check(utc_ms: [i64; 2], expected: &[&str]) {
        let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
        let area = v1::Area {
            name: "A".into(),
            kind: v1::AreaKind::Permission as i32,
            corners: [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)].map(corner).to_vec(),
            from_utc_ms: Some(100 * MS),
            ..Default::default()
        };
        let mut witness = Witness::default();
        let mut see = |second: u64, utc_ms: i64, message: Message| {
            witness.take_in(Now { time: Time::after(Duration::from_secs(second)), utc_ms }, &message);
        };
        see(0, utc_ms[0], v1::MissionStatus { areas: vec![area], ..Default::default() }.into());
        see(0, utc_ms[0], v1::VehicleLandDetected { landed: false, ..Default::default() }.into());
        let mode = v1::FlightMode::Offboard as i32;
        let status = v1::VehicleStatus { armed: true, actual_mode: mode, intended_mode: mode, ..Default::default() };
        see(0, utc_ms[0], status.into());
        let at = v1::VehicleLocalPosition {
            position: Some(v1::Ned { north_m: 0.0, east_m: 0.0, down_m: -10.0 }),
            horizontal_valid: true,
            vertical_valid: true,
            ..Default::default()
        };
        see(10, utc_ms[0], at.into());
        for second in 0..100 {
            see(11 + second, utc_ms[1] + second as i64 * MS, at.into());
        }
        let of_place = witness.breaches().iter().filter_map(|it| match it {
            Breach::Entered { .. } => Some("entered"),
            Breach::Stayed { .. } => Some("stayed"),
            _ => None,
        });
        assert_eq!(of_place.collect::<Vec<_>>(), expected, "{utc_ms:?}");
    }
    check([0, MS], &[]);
    check([99 * MS, 100 * MS], &["stayed"]);
    // The clock is set by an hour.
    check([0, 3_600 * MS], &["stayed"]);
    check([100 * MS, 101 * MS], &["entered"]);
    check([100 * MS, 0], &["entered"]);
}

#[test]
fn a_permission_that_is_withdrawn_counts_once_the_vehicle_can_know_it() {
    /// What is said of a vehicle that enters area A at `enters_s` and stays, after its permission ended in `state` at 10 s. `disturbed`: from
    /// when on somebody is away, and for how long.
    #[track_caller]
    fn check(heeds_s: u64, state: v1::PermissionState, disturbed: &[(u64, u64)], enters_s: u64, expected: &[&str]) {
        check_until(900_000, heeds_s, state, disturbed, enters_s, expected);
    }
    /// The same of a permission that would have ended by itself.
    #[track_caller]
    fn check_until(
        expires_utc_ms: i64,
        heeds_s: u64,
        state: v1::PermissionState,
        disturbed: &[(u64, u64)],
        enters_s: u64,
        expected: &[&str],
    ) {
        let limits = Limits { heeds: Duration::from_secs(heeds_s), ..Limits::default() };
        let corner = |(north_m, east_m)| Ned::new(north_m, east_m, 0.0);
        let area = Area::new(
            "A",
            AreaKind::Permission,
            [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)].map(corner).to_vec(),
        );
        let extent = Some(area.extent().into());
        let mut witness = Witness::with(limits).expecting(vec![area]);
        let mode = v1::FlightMode::Offboard as i32;
        for second in 0..200 {
            let now = Now { time: Time::after(Duration::from_secs(second)), utc_ms: second as i64 * 1000 };
            let state = if second < 10 { Granted } else { state };
            let (area, state, extent) = ("A".into(), state as i32, extent.clone());
            let permission = v1::Permission { area, state, expires_utc_ms, extent, ..Default::default() };
            witness.take_in(now, &v1::PermissionLedger { permissions: vec![permission], ..Default::default() }.into());
            for &(at_s, for_s) in disturbed.iter().filter(|it| it.0 == second) {
                witness.disturbed(Time::after(Duration::from_secs(at_s)), Duration::from_secs(for_s));
            }
            let status =
                v1::VehicleStatus { armed: true, actual_mode: mode, intended_mode: mode, ..Default::default() };
            witness.take_in(now, &status.into());
            let north_m = if second < enters_s { 50.0 } else { 0.0 };
            let position = Some(v1::Ned { north_m, east_m: 0.0, down_m: -10.0 });
            witness.take_in(now, &v1::VehicleLocalPosition { position, ..Default::default() }.into());
        }
        let of_place = witness.breaches().iter().filter_map(|it| match it {
            Breach::Entered { at, .. } => Some(format!("entered {}", at.as_secs_f64())),
            Breach::Stayed { at, .. } => Some(format!("stayed {}", at.as_secs_f64())),
            _ => None,
        });
        assert_eq!(of_place.collect::<Vec<_>>(), expected);
    }
    check(0, Revoked, &[], 10, &["entered 10"]);
    // It braked too late, and does not leave either: 20 s to notice, and 5 m.
    check(5, Revoked, &[], 14, &["stayed 40"]);
    check(5, Denied, &[], 14, &["stayed 40"]);
    check(5, Revoked, &[], 15, &["entered 15"]);
    check(5, Expired, &[], 10, &["entered 10"]);
    // It had ended by itself before.
    check_until(9_500, 5, Revoked, &[], 10, &["entered 10"]);
    // Somebody is away when it is withdrawn, or soon after.
    check(5, Revoked, &[(8, 20)], 32, &["stayed 58"]);
    check(5, Revoked, &[(8, 20)], 33, &["entered 33"]);
    check(5, Revoked, &[(14, 20)], 34, &["stayed 60"]);
    // What is known already is not forgotten by who comes back.
    check(5, Revoked, &[(16, 20)], 20, &["entered 20"]);
    // Inside, it has longer.
    check(5, Revoked, &[(20, 30)], 14, &["stayed 70"]);
    // Two who are away at once are not away for longer.
    check(5, Revoked, &[(8, 20), (9, 19), (9, 5)], 33, &["entered 33"]);
    check(5, Revoked, &[(14, 20), (20, 20)], 40, &["stayed 66"]);
    check(5, Revoked, &[(14, 20), (20, 20)], 41, &["entered 41"]);
}

/// The autopilot takes a moment to stop, and a land detector to notice.
#[test]
fn a_takeoff_under_way_may_still_lift_off_when_its_permission_is_withdrawn() {
    #[track_caller]
    fn check(mode: v1::FlightMode, lifts_off_s: u64, expected: &[&str]) {
        let corner = |(north_m, east_m)| Ned::new(north_m, east_m, 0.0);
        let square = [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)].map(corner);
        let area = Area::new("A", AreaKind::Permission, square.to_vec());
        let extent = Some(area.extent().into());
        let mut witness = Witness::default().expecting(vec![area]);
        for second in 0..20 {
            let now = Now { time: Time::after(Duration::from_secs(second)), utc_ms: 0 };
            let (area, state) = ("A".into(), if second < 10 { Granted } else { Revoked } as i32);
            let permission =
                v1::Permission { area, state, expires_utc_ms: 900, extent: extent.clone(), ..Default::default() };
            let (actual_mode, timestamp_us) = (mode as i32, second);
            let intended_mode = actual_mode;
            let status =
                v1::VehicleStatus { armed: true, actual_mode, intended_mode, timestamp_us, ..Default::default() };
            witness.take_in(now, &status.into());
            witness.take_in(now, &v1::PermissionLedger { permissions: vec![permission], ..Default::default() }.into());
            let down_m = if second < lifts_off_s { 0.0 } else { -10.0 };
            let position = Some(v1::Ned { down_m, ..Default::default() });
            witness.take_in(now, &v1::VehicleLocalPosition { position, ..Default::default() }.into());
        }
        let said: Vec<String> = witness.breaches().iter().map(Breach::what).collect();
        assert_eq!(said, expected);
    }
    let entered = "it entered area A without a permission: Revoked";
    check(v1::FlightMode::Takeoff, 12, &[]);
    check(v1::FlightMode::Takeoff, 13, &[entered]);
    check(v1::FlightMode::Loiter, 12, &[entered]);
}

#[test]
fn a_grant_for_another_area_of_the_name_lets_nobody_in() {
    #[track_caller]
    fn check(granted_to_east_m: f64, expected: &[&str]) {
        let area = |east_m: f64| {
            Area::new(
                "A",
                AreaKind::Permission,
                [(-5.0, -5.0), (20.0, 0.0), (-5.0, east_m)].map(|(n, e)| Ned::new(n, e, 0.0)).to_vec(),
            )
        };
        let mut witness = Witness::default().expecting(vec![area(5.0)]);
        let (name, state, extent) = ("A".into(), Granted as i32, Some(area(granted_to_east_m).extent().into()));
        let permission = v1::Permission { area: name, state, expires_utc_ms: 9, extent, ..Default::default() };
        let mode = v1::FlightMode::Offboard as i32;
        let position = Some(v1::Ned { north_m: 0.0, east_m: 0.0, down_m: -10.0 });
        let messages: [Message; 3] = [
            v1::PermissionLedger { permissions: vec![permission], ..Default::default() }.into(),
            v1::VehicleStatus { armed: true, intended_mode: mode, ..Default::default() }.into(),
            v1::VehicleLocalPosition { position, ..Default::default() }.into(),
        ];
        messages.iter().for_each(|it| witness.take_in(Now::default(), it));
        let said: Vec<String> = witness.breaches().iter().map(Breach::what).collect();
        assert_eq!(said, expected);
    }
    check(5.0, &[]);
    check(6.0, &["it entered area A without a permission: Granted"]);
}

#[test]
fn a_tower_that_asks_for_patience_takes_no_grant_away_and_one_that_decides_does() {
    #[track_caller]
    fn check(heard: &[v1::PermissionState], expected: v1::PermissionState) {
        let mut witness = Witness::default();
        for state in heard {
            let permission = v1::Permission { area: "A".into(), state: *state as i32, ..Default::default() };
            let ledger = v1::PermissionLedger { permissions: vec![permission], ..Default::default() };
            witness.take_in(Now { time: Time::ZERO, utc_ms: 0 }, &ledger.into());
        }
        assert_eq!(witness.permissions["A"].state(), expected, "{heard:?}");
    }
    check(&[Requested, Granted], Granted);
    check(&[Granted, Requested], Granted);
    for decided in [Denied, Revoked, Expired] {
        check(&[Granted, Requested, decided], decided);
        check(&[Granted, decided, Requested], Requested);
    }
}

#[test]
fn a_frozen_status_hides_no_flight_and_makes_none() {
    #[track_caller]
    fn check(lands: bool, detector: bool, freezes_position: bool, expected: bool) {
        let mut witness = Witness::default();
        let mut second = 0;
        let mut see = |height_m: f64, landed: bool, timestamp_us: u64| {
            second += 1;
            let now = Now { time: Time::after(Duration::from_secs(second)), utc_ms: 0 };
            // Its position is never without noise, unless it is frozen.
            let north_m = if freezes_position && timestamp_us == 9 { 0.0 } else { 1e-6 * second as f64 };
            let position = Some(v1::Ned { north_m, east_m: 0.0, down_m: -height_m });
            witness.take_in(now, &v1::VehicleLandDetected { landed, ..Default::default() }.into());
            witness.take_in(now, &v1::VehicleLocalPosition { position, ..Default::default() }.into());
            witness.take_in(now, &v1::VehicleStatus { armed: true, timestamp_us, ..Default::default() }.into());
            witness.is_airborne()
        };
        assert!(!see(0.0, true, 1));
        assert!(see(5.0, false, 2));
        let down_at_m = if lands && !freezes_position { 0.0 } else { 5.0 };
        let flies = [9, 9, 9, 9].map(|frozen| see(down_at_m, detector, frozen));
        assert_eq!(flies[3], expected, "{lands} {detector} {freezes_position}");
    }
    // It has landed, by both, or by the detector where the position is frozen.
    check(true, true, false, false);
    check(true, true, true, false);
    // It flies, by both; one of them that is stuck changes nothing.
    check(false, false, false, true);
    check(false, true, false, true);
    check(true, false, false, true);
}

#[test]
fn a_forbidden_takeoff_is_seen_whether_the_land_detector_or_the_height_shows_it_first() {
    #[derive(Clone, Copy)]
    enum Sees {
        Armed(bool),
        Lands(bool),
        Height(f64),
        /// The mission is over.
        End,
        /// A flag is answered, or no more.
        Answers(bool),
        Start,
    }
    use Sees::{Answers, Armed, End, Height, Lands, Start};
    /// Each a second after the one before; how many takeoffs it reports.
    #[track_caller]
    fn check(sees: &[Sees], expected: usize) {
        let mut witness = Witness::default();
        for (second, it) in sees.iter().enumerate() {
            let now = Now { time: Time::after(Duration::from_secs(second as u64)), utc_ms: 0 };
            let report = |over: bool| over.then(v1::MissionReport::default);
            match *it {
                Armed(armed) => {
                    let mode = v1::FlightMode::Takeoff as i32;
                    let (intended_mode, actual_mode, timestamp_us) = (mode, mode, second as u64);
                    let status =
                        v1::VehicleStatus { armed, intended_mode, actual_mode, timestamp_us, ..Default::default() };
                    witness.take_in(now, &status.into());
                }
                Lands(landed) => {
                    witness.take_in(now, &v1::VehicleLandDetected { landed, ..Default::default() }.into());
                }
                Height(height_m) => {
                    let position = Some(v1::Ned { down_m: -height_m, ..Default::default() });
                    witness.take_in(now, &v1::VehicleLocalPosition { position, ..Default::default() }.into());
                }
                End => witness.take_in(now, &v1::McmStatus { report: report(true), ..Default::default() }.into()),
                Answers(answers) => {
                    let acting = if answers { "obstacle" } else { "" };
                    witness.take_in(now, &v1::McmStatus { acting: acting.into(), ..Default::default() }.into());
                }
                Start => {
                    witness.ordered_to_start();
                    witness.take_in(now, &v1::McmStatus::default().into());
                }
            }
        }
        let takeoffs = witness.breaches().iter().filter(|it| matches!(it, Breach::TookOff { .. })).count();
        assert_eq!(takeoffs, expected);
    }
    // By the detector first, as it is, by the height first, and by the height alone.
    check(&[End, Armed(true), Lands(false), Height(0.5), Height(2.0), Height(3.0)], 1);
    check(&[End, Armed(true), Height(2.0), Lands(false), Height(3.0)], 1);
    check(&[End, Armed(true), Lands(true), Height(2.0)], 1);
    check(&[Armed(true), Lands(false), Height(2.0), Lands(true), Height(0.0), End, Lands(false), Height(2.0)], 1);
    // One that hardly rises, a height that wavers in the air, and what an operator has ordered.
    check(&[End, Armed(true), Lands(false), Height(0.9), Lands(true), Height(0.0)], 0);
    check(&[Armed(true), Lands(false), Height(2.0), End, Height(0.4), Height(2.0)], 0);
    check(&[End, Start, Armed(true), Lands(false), Height(2.0)], 0);
    // A mission that ends, or a flag that rises, while it takes off.
    check(&[Armed(true), Lands(false), End, Height(2.0)], 0);
    check(&[Answers(true), Armed(true), Lands(false), Height(2.0)], 0);
    check(&[Answers(true), Armed(true), Answers(true), Answers(true), Lands(false), Height(2.0)], 1);
    check(&[Answers(true), Armed(true), Answers(true), Answers(false), Lands(false), Height(2.0)], 0);
    // A detector that is stuck in the air says nothing of a vehicle that stands.
    check(&[Armed(true), Lands(false), End, Height(0.0), Height(0.0), Height(0.0), Height(2.0)], 1);
    check(&[End, Armed(true), Lands(false), Height(0.0), Height(0.0), Armed(false)], 0);
    // Nor does what was forbidden when that spoke, long before the vehicle lifts off.
    let [low, high] = [Height(0.0), Height(2.0)];
    let answered = [Answers(true), Armed(true), Answers(true), Answers(true), Lands(false), Answers(false)];
    check(&answered.into_iter().chain([low, low, low, low, high]).collect::<Vec<_>>(), 0);
}
