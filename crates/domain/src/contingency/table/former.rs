//! Former forms, each a mistake that says what to write in its place: what raised a flag, `raise = { fact = .. }`, and times of actions.

use std::f64::consts::PI;

use toml::{Spanned, Table, Value};

use super::ActionEntry;
use crate::contingency::snapshot::{Field, Kind};
use crate::file::{Mistake, Source};

/// What the former form compared with a threshold: its name, the field, and what one of its unit is in that of the field.
const VALUES: [(&str, Field, f64); 10] = [
    ("battery-remaining", Field::BatteryCharge, 100.0),
    ("battery-voltage", Field::BatteryVoltage, 1.0),
    ("battery-temperature", Field::BatteryTemperature, 1.0),
    ("horizontal-accuracy", Field::HorizontalDeviation, 1.0),
    ("vertical-accuracy", Field::VerticalDeviation, 1.0),
    ("height", Field::Height, 1.0),
    ("distance-home", Field::DistanceHome, 1.0),
    ("ground-speed", Field::GroundSpeed, 1.0),
    ("touchdown-speed", Field::TouchdownSpeed, 1.0),
    ("tilt", Field::Tilt, 180.0 / PI),
];

/// What it asked for without a number: a condition that is reported, or a source that is silent.
const NAMES: [(&str, Field); 20] = [
    ("estimator-invalid", Field::EstimatorInvalid),
    ("offboard-signal-lost", Field::SetpointsLost),
    ("gnss-lost", Field::GnssLost),
    ("motor-failure", Field::MotorFailed),
    ("battery-failure", Field::BatteryFaulty),
    ("ground-link-lost", Field::OwnLinkLost),
    ("land-detector-contradicts", Field::DetectorContradicts),
    ("would-not-arm", Field::NotReady),
    ("autopilot-preempts", Field::Preempts),
    ("status", Field::StatusSilence),
    ("attitude", Field::AttitudeSilence),
    ("local-position", Field::PositionSilence),
    ("global-position", Field::GlobalPositionSilence),
    ("land-detected", Field::DetectorSilence),
    ("battery", Field::BatterySilence),
    ("ground-link", Field::LinkSilence),
    ("planner", Field::PlannerSilence),
    ("skill-manager", Field::SkillManagerSilence),
    ("mission-manager", Field::ManagerSilence),
    ("control-tower", Field::TowerSilence),
];

/// The mistake in a row with `raise`.
pub(super) fn mistake(source: &Source, raise: &Spanned<Table>) -> Mistake {
    let help = match lines(raise.as_ref()) {
        Some(lines) => format!("write in its place: {}", lines.join(", ")),
        None => {
            "write an expression: `when = \"battery.charge_percent < 25 %\"`; docs/contingencies.md lists the fields"
                .into()
        }
    };
    source.mistake(Some(raise.span()), "`raise` is the former form of a row, expected `when`", help)
}

/// The mistakes in an action with a time limit: progress says that a try has failed, and energy how long a wait may last.
pub(super) fn durations(source: &Source, name: &str, action: &ActionEntry) -> Vec<Mistake> {
    let limit = "a try has no time limit: it fails when the vehicle comes no nearer to its goal";
    let wait = "no time limits a wait: it lasts until a place to land at could no longer be reached";
    let keys = [("limit_s", &action.limit_s, limit), ("wait_s", &action.wait_s, wait)];
    let written = keys.into_iter().filter_map(|(key, value, why)| Some((key, value.as_ref()?, why)));
    written
        .map(|(key, value, why)| {
            let message = format!("`{key}` of action `{name}`: {why}");
            source.mistake(Some(value.span()), message, "delete the line")
        })
        .collect()
}

/// The lines to write in place of `raise`; `None` where it makes no sense.
fn lines(raise: &Table) -> Option<Vec<String>> {
    let text = |key: &str| raise.get(key).and_then(Value::as_str);
    let number =
        |key: &str| raise.get(key).and_then(|it| it.as_float().or_else(|| it.as_integer().map(|it| it as f64)));
    let named = |key: &str| NAMES.iter().find(|it| Some(it.0) == text(key)).map(|it| it.1);
    let fact = text("fact")?;
    let (when, clear_when) = match fact {
        "below" | "above" => {
            let (_, field, factor) = *VALUES.iter().find(|it| Some(it.0) == text("value"))?;
            let compared = |comparison: &str, key: &str| Some(compared(field, comparison, number(key)? * factor));
            let (raises, clears) = if fact == "below" { ("<", ">=") } else { (">", "<=") };
            (only_known(field, &compared(raises, "threshold")?), compared(clears, "clear"))
        }
        "reported" => {
            let field = named("condition")?;
            // The others are known for good once they are.
            let clears = (field == Field::DetectorContradicts).then(|| format!("not {}", field.name()));
            (only_known(field, field.name()), clears)
        }
        "stale" => {
            let field = named("source")?;
            let silent = compared(field, ">=", number("after_s")?);
            (if field.silence()?.is_optional() { only_known(field, &silent) } else { silent }, None)
        }
        _ => return None,
    };
    let mut lines = vec![format!("when = \"{when}\"")];
    lines.extend(clear_when.map(|it| format!("clear_when = \"{it}\"")));
    lines.extend(number("for_s").filter(|it| *it != 0.0).map(|it| format!("for_s = {it:?}")));
    lines.extend(text("during").filter(|it| *it != "always").map(|it| format!("during = \"{it}\"")));
    Some(lines)
}

/// What is not known did not raise a flag.
fn only_known(field: Field, condition: &str) -> String {
    format!("known({}) and {condition}", field.name())
}

fn compared(field: Field, comparison: &str, value: f64) -> String {
    let unit = match field.kind() {
        Kind::Number { unit, .. } => unit.to_string(),
        Kind::Choice(_) => String::new(),
    };
    // A share in percent has more digits than were written.
    format!("{} {comparison} {} {unit}", field.name(), (value * 1e6).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use crate::contingency::Contingencies;
    use crate::contingency::when::When;
    use crate::file::{Mistakes, Source};
    use crate::testing::{ACTIONS, table};

    fn read(line: &str) -> Result<Contingencies, Mistakes> {
        let text = table(&format!(
            "[[contingency]]\nflag = \"watched\"\npriority = 1\n{line}\nactions = [\"stop\"]\nemergency = \"stop\"\n\
             clears = \"with-condition\"\nthen = \"resume\"\n"
        ));
        Contingencies::read(&Source { path: "c.toml".into(), text }, &ACTIONS)
    }

    /// A row in the former form is refused with the lines to write, and these are read.
    #[track_caller]
    fn check(raise: &str, expected: &[&str]) {
        let mistakes = read(&format!("raise = {{ {raise} }}")).unwrap_err().0;
        let [mistake] = mistakes.as_slice() else { panic!("{mistakes:#?}") };
        let place = mistake.place.as_ref().map(|it| (it.line, it.column));
        assert_eq!(place, Some((16, 9)));
        assert_eq!(mistake.message, "`raise` is the former form of a row, expected `when`");
        assert_eq!(mistake.help, format!("write in its place: {}", expected.join(", ")));
        let read = read(&expected.join("\n")).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        let when: &When = read.row("watched").unwrap().when.as_ref().unwrap();
        assert_eq!(format!("when = \"{}\"", when.raises.text()), expected[0]);
    }

    #[test]
    fn a_row_in_the_former_form_is_refused_with_the_lines_to_write() {
        check(
            r#"fact = "below", value = "battery-remaining", threshold = 0.07, clear = 0.12, for_s = 0.5, during = "armed""#,
            &[
                r#"when = "known(battery.charge_percent) and battery.charge_percent < 7 %""#,
                r#"clear_when = "battery.charge_percent >= 12 %""#,
                "for_s = 0.5",
                r#"during = "armed""#,
            ],
        );
        check(
            r#"fact = "above", value = "height", threshold = 120, clear = 110, for_s = 0, during = "always""#,
            &[
                r#"when = "known(position.height_m) and position.height_m > 120 m""#,
                r#"clear_when = "position.height_m <= 110 m""#,
            ],
        );
        check(
            r#"fact = "reported", condition = "gnss-lost", for_s = 4.0, during = "flying""#,
            &[r#"when = "known(gnss.lost) and gnss.lost""#, "for_s = 4.0", r#"during = "flying""#],
        );
        check(
            r#"fact = "reported", condition = "land-detector-contradicts", for_s = 3.0, during = "always""#,
            &[
                r#"when = "known(land_detector.contradicts) and land_detector.contradicts""#,
                r#"clear_when = "not land_detector.contradicts""#,
                "for_s = 3.0",
            ],
        );
        check(
            r#"fact = "stale", source = "planner", after_s = 1.0, during = "flying""#,
            &[r#"when = "planner.silent_s >= 1 s""#, r#"during = "flying""#],
        );
        check(
            r#"fact = "stale", source = "ground-link", after_s = 10.0, during = "always""#,
            &[r#"when = "known(link.silent_s) and link.silent_s >= 10 s""#],
        );
    }

    #[test]
    fn one_that_makes_no_sense_is_refused_too() {
        for raise in [r#"fact = "likely""#, r#"fact = "below", value = "luck", threshold = 1"#, "", r#"fact = "stale""#]
        {
            let told = read(&format!("raise = {{ {raise} }}")).unwrap_err().to_string();
            assert!(
                told.contains("c.toml:16:9: `raise` is the former form") && told.contains("write an expression"),
                "{told}"
            );
        }
    }
}
