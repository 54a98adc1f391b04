use proptest::prelude::*;

use super::super::snapshot::{Field, Snapshot};
use super::{Expression, Threshold, Verdict};

/// A vehicle in the air, of which the wind is not known.
fn snapshot() -> Snapshot {
    let mut it = Snapshot::UNKNOWN;
    it.set(Field::BatteryCharge, Some(24.0));
    it.set(Field::Height, Some(50.0));
    it.set(Field::DistanceHome, Some(100.0));
    it.set(Field::Climb, Some(-2.0));
    it.set(Field::GroundSpeed, Some(10.0));
    it.set_truth(Field::Armed, Some(true));
    it.set_truth(Field::Failsafe, Some(false));
    it.set_choice(Field::Mode, "offboard");
    it.set_choice(Field::IntendedMode, "offboard");
    it
}

#[track_caller]
fn check(text: &str, expected: Verdict) {
    let expression = Expression::parse(text).unwrap_or_else(|problem| panic!("{text}: {problem:?}"));
    assert_eq!(expression.verdict(&snapshot()), expected, "{text}");
}

/// The rule is refused at its part `place`, with this message and this help.
#[track_caller]
fn check_refused(text: &str, place: &str, message: &str, help: &str) {
    let problem = Expression::parse(text).expect_err(text);
    assert!(problem.message.contains(message), "{text}: {problem:?}");
    assert!(problem.help.contains(help), "{text}: {problem:?}");
    assert_eq!(&text[problem.span], place, "{text}");
}

#[test]
fn a_rule_compares_fields_with_constants_and_with_each_other() {
    use Verdict::{DoesNotHold, Holds};
    check("battery.charge_percent < 25", Holds);
    check("battery.charge_percent < 25 %", Holds);
    check("25 % > battery.charge_percent", Holds);
    check("battery.charge_percent <= 24 %", Holds);
    check("battery.charge_percent < 24 %", DoesNotHold);
    check("position.height_m < position.distance_home_m", Holds);
    check("position.height_m >= 0.05 km", Holds);
    check("motion.ground_speed_m_s >= 36 km/h", Holds);
    check("motion.climb_m_s < -1.5 m/s", Holds);
    check("vehicle.armed", Holds);
    check("not autopilot.failsafe", Holds);
    check("autopilot.failsafe == true", DoesNotHold);
    check("autopilot.mode == offboard", Holds);
    check("autopilot.mode != land", Holds);
    check("autopilot.mode != autopilot.intended_mode", DoesNotHold);
}

#[test]
fn what_binds_more_strongly_comes_first() {
    use Verdict::{DoesNotHold, Holds};
    check("position.height_m + 2 * 10 m < 80", Holds);
    check("(position.height_m + 2) * 10 < 80", DoesNotHold);
    check("position.height_m - 20 m - 20 m < 11 m", Holds);
    check("position.distance_home_m / position.height_m / 2 < 1.5", Holds);
    check("position.distance_home_m / motion.ground_speed_m_s < 11 s", Holds);
    check("position.height_m + motion.climb_m_s * 3 s < 45 m", Holds);
    check("vehicle.armed or vehicle.armed and autopilot.failsafe", Holds);
    check("(vehicle.armed or vehicle.armed) and autopilot.failsafe", DoesNotHold);
    check("not autopilot.failsafe and autopilot.failsafe", DoesNotHold);
    check("not (autopilot.failsafe and autopilot.failsafe)", Holds);
    check("abs(motion.climb_m_s) > 1.9 m/s", Holds);
    check("min(position.height_m, 20 m) < 21 m", Holds);
    check("max(motion.climb_m_s, 0) > 0.1 m/s", DoesNotHold);
}

#[test]
fn what_is_not_known_is_no_number_and_is_named() {
    use Verdict::{DoesNotHold, Holds, Unknown};
    let wind = Unknown(Some(Field::WindSpeed));
    check("wind.speed_m_s > 10 m/s", wind);
    check("not (wind.speed_m_s > 10 m/s)", wind);
    check("min(wind.speed_m_s, 1 m/s) > 10 m/s", wind);
    check("vehicle.armed and wind.speed_m_s > 10 m/s", wind);
    // What decides alone needs no other.
    check("autopilot.failsafe and wind.speed_m_s > 10 m/s", DoesNotHold);
    check("vehicle.armed or wind.speed_m_s > 10 m/s", Holds);
    check("known(wind.speed_m_s) and wind.speed_m_s > 10 m/s", DoesNotHold);
    check("known(position.height_m)", Holds);
    // All is known, and there is no result.
    check("position.height_m / (motion.climb_m_s + 2) > 10 s", Unknown(None));
}

#[test]
fn a_rule_that_does_not_parse_is_refused_where_it_goes_wrong() {
    check_refused("", "", "found the end of the rule, expected a field", "");
    check_refused("position.height_m <", "", "found the end of the rule", "");
    check_refused("position.height_m 5", "5", "found a number, expected `and`, `or` or the end", "");
    check_refused("(position.height_m < 5 m", "", "expected `)`", "");
    check_refused("position.height_m = 5 m", "=", "found `=`", "compare with `==`");
    check_refused("position.height_m < 5 m & vehicle.armed", "&", "found `&`", "write `and`");
    check_refused("position.height_m < 5 mtr", "mtr", "there is no unit `mtr`", "did you mean `m`?");
    check_refused("position.height_m < 1.2.3 m", "1.2.3", "is not a number", "");
    check_refused("1 m < position.height_m < 5 m", "<", "a comparison compares two values", "a < b and b < c");
    check_refused("position.height_m < 5 m ¤", "¤", "found `¤`", "");
    let deep = "(".repeat(100) + "vehicle.armed" + &")".repeat(100);
    assert!(Expression::parse(&deep).unwrap_err().message.contains("more than 40 parts"));
    let long = format!("vehicle.armed{}", " or vehicle.armed".repeat(100));
    assert!(Expression::parse(&long).unwrap_err().message.contains("at most 1000 are read"));
}

#[test]
fn names_types_units_and_ranges_are_checked() {
    check_refused(
        "battery.charg_percent < 5",
        "battery.charg_percent",
        "there is no field",
        "`battery.charge_percent`",
    );
    check_refused("position.height_m < 5 s", "position.height_m < 5 s", "m and s are compared", "ends in its unit");
    check_refused(
        "position.height_m + 2 s < 5 m",
        "position.height_m + 2 s",
        "m and s are added or subtracted, expected two values of one unit",
        "",
    );
    check_refused("position.height_m / 2 s < 5 m", "position.height_m / 2 s < 5 m", "m/s and m are compared", "");
    check_refused("battery.charge_percent < 250", "250", "250 % is beyond the range", "expected 0 to 100 %");
    check_refused("-1 > position.distance_home_m", "-1", "-1 m is beyond the range", "expected 0 to 1000000 m");
    check_refused("1 < 2", "1 < 2", "two constants are compared", "one side reads a field");
    check_refused("position.height_m", "position.height_m", "is a number in m, and not yet a condition", "compare it");
    check_refused("position.height_m + 1", "position.height_m + 1", "not yet a condition", "");
    check_refused("autopilot.mode", "autopilot.mode", "is one of loiter", "`autopilot.mode == loiter`");
    check_refused("autopilot.mode == lnad", "lnad", "there is no `lnad` here", "did you mean `land`?");
    check_refused("autopilot.mode < land", "autopilot.mode", "is one of loiter", "`==`");
    check_refused("autopilot.mode == vehicle.armed", "autopilot.mode", "never have the same name", "");
    check_refused("position.height_m == 5 m", "position.height_m", "never equals another one", "`<`");
    check_refused("vehicle.armed < 1", "vehicle.armed", "is one of false, true", "");
    check_refused(
        "(vehicle.armed and vehicle.flying) + 1 < 2",
        "(vehicle.armed and vehicle.flying)",
        "is not a number",
        "",
    );
    check_refused("position.height_m / 0 < 1", "0", "divides by zero", "");
    check_refused("position.height_m * (1 / (2 - 2)) < 1", "(2 - 2)", "divides by zero", "");
    let huge = "9".repeat(200);
    check_refused(&format!("position.height_m < {huge} * {huge}"), &format!("{huge} * {huge}"), "has no result", "");
    check_refused("abs(position.height_m, 1) < 2", "abs(position.height_m, 1)", "takes one argument, found 2", "");
    check_refused("mni(position.height_m, 1) < 2", "mni(position.height_m, 1)", "no function `mni`", "`min`");
    check_refused("known(1)", "known(1)", "asks for one field", "");
}

#[test]
fn thresholds_are_what_fields_are_compared_with() {
    #[track_caller]
    fn check(text: &str, expected: &[(Field, f64, bool)], alone: bool) {
        let expression = Expression::parse(text).unwrap();
        let found: Vec<_> = expression.thresholds().iter().map(|it| (it.field, it.value, it.above)).collect();
        assert_eq!(found, expected, "{text}");
        assert_eq!(expression.threshold().is_some(), alone, "{text}");
    }
    check("battery.charge_percent < 25 %", &[(Field::BatteryCharge, 25.0, false)], true);
    check("2 * 5 m/s < wind.speed_m_s", &[(Field::WindSpeed, 10.0, true)], true);
    check(
        "vehicle.flying and (battery.charge_percent < 25 % or wind.speed_m_s > 9)",
        &[(Field::BatteryCharge, 25.0, false), (Field::WindSpeed, 9.0, true)],
        false,
    );
    check(
        "known(battery.charge_percent) and battery.charge_percent < 25 %",
        &[(Field::BatteryCharge, 25.0, false)],
        true,
    );
    check("not (battery.charge_percent < 25 %)", &[], false);
    check("position.height_m < position.distance_home_m", &[], false);
    let expression = Expression::parse(" battery.charge_percent<25 % ").unwrap();
    let threshold = Threshold { field: Field::BatteryCharge, value: 25.0, above: false };
    assert_eq!((expression.threshold(), expression.text()), (Some(threshold), "battery.charge_percent<25 %"));
    assert_eq!(expression.fields(), [Field::BatteryCharge]);
}

/// Pieces of rules, in any order.
fn pieces() -> impl Strategy<Value = String> {
    let piece = prop::sample::select(vec![
        "battery.charge_percent",
        "vehicle.armed",
        "autopilot.mode",
        "land",
        "wind.speed_m_s",
        "25 %",
        "4 m/s",
        "7",
        "0",
        "-",
        "*",
        "/",
        "<",
        ">=",
        "==",
        "and",
        "or",
        "not",
        "(",
        ")",
        "min(",
        "abs(",
        "known(",
        ",",
        "9e9",
        "ä",
        ".",
    ]);
    prop::collection::vec(piece, 0..12).prop_map(|it| it.join(" "))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Every text is read, or refused with a place inside the text; every rule that is read has a verdict.
    #[test]
    fn no_text_panics(text in prop_oneof![pieces(), ".{0,60}"]) {
        match Expression::parse(&text) {
            Ok(expression) => {
                let verdict = expression.verdict(&snapshot());
                if let Verdict::Unknown(Some(field)) = verdict {
                    prop_assert_eq!(snapshot().get(field), None);
                }
                prop_assert!(!expression.fields().is_empty());
            }
            Err(problem) => {
                prop_assert!(text.get(problem.span.clone()).is_some(), "{:?}", problem);
                prop_assert!(!problem.message.is_empty());
            }
        }
    }

    /// A comparison is the comparison of the numbers, from either side.
    #[test]
    fn a_comparison_holds_when_the_numbers_compare_so(charge in 0.0..100.0_f64, limit in 0..=100_u32) {
        let mut snapshot = Snapshot::UNKNOWN;
        snapshot.set(Field::BatteryCharge, Some(charge));
        let verdict = |holds| if holds { Verdict::Holds } else { Verdict::DoesNotHold };
        let below = Expression::parse(&format!("battery.charge_percent < {limit} %")).unwrap();
        let above = Expression::parse(&format!("{limit} % <= battery.charge_percent")).unwrap();
        prop_assert_eq!(below.verdict(&snapshot), verdict(charge < f64::from(limit)));
        prop_assert_eq!(above.verdict(&snapshot), verdict(f64::from(limit) <= charge));
    }
}
