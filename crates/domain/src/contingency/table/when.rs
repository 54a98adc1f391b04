//! Reads the expression of a row and the keys that belong to it.

use std::time::Duration;

use toml::Spanned;

use super::{Entry, former};
use crate::contingency::expression::{Expression, Problem};
use crate::contingency::when::{During, When};
use crate::file::{Mistake, Source};

/// The longest time for which an expression must hold or be over, in seconds.
const LONGEST_S: f64 = 3600.0;

/// The expression of a row; `None` where it has none, or what is wrong with it was reported as a mistake.
pub(super) fn read(source: &Source, entry: &Entry, mistakes: &mut Vec<Mistake>) -> Option<When> {
    if let Some(raise) = &entry.raise {
        mistakes.push(former::mistake(source, raise));
        return None;
    }
    let Some(raises) = &entry.when else {
        check_alone(source, entry, mistakes);
        return None;
    };
    let hold = seconds(source, entry.for_s.as_ref(), "for_s", mistakes);
    let clears_after = seconds(source, entry.clears_after_s.as_ref(), "clears_after_s", mistakes);
    let raised_by = expression(source, raises, mistakes);
    let cleared_by = entry.clear_when.as_ref().map(|text| expression(source, text, mistakes));
    let clears = match cleared_by {
        Some(text) => Some(text?),
        None => None,
    };
    let during = entry.during.as_ref().map_or(During::Always, |it| *it.as_ref());
    let when = When { raises: raised_by?, clears, hold, clears_after, during };
    if let Some(text) = entry.clear_when.as_ref().filter(|_| when.contradicts_itself()) {
        let help = "`clear_when` lies at the threshold of `when` or on its safe side";
        mistakes.push(source.mistake(Some(text.span()), "this rule would clear while it still holds", help));
    }
    Some(when)
}

/// Without `when` the keys that belong to it say nothing.
fn check_alone(source: &Source, entry: &Entry, mistakes: &mut Vec<Mistake>) {
    let keys = [
        ("clear_when", entry.clear_when.as_ref().map(Spanned::span)),
        ("for_s", entry.for_s.as_ref().map(Spanned::span)),
        ("clears_after_s", entry.clears_after_s.as_ref().map(Spanned::span)),
        ("during", entry.during.as_ref().map(Spanned::span)),
    ];
    for (key, span) in keys {
        if span.is_some() {
            let message = format!("`{key}` belongs to an expression, and `{}` has no `when`", entry.flag.as_ref());
            mistakes.push(source.mistake(span, message, "add `when = \"...\"`"));
        }
    }
}

fn seconds(source: &Source, key: Option<&Spanned<f64>>, name: &str, mistakes: &mut Vec<Mistake>) -> Duration {
    let Some(value) = key else { return Duration::ZERO };
    let seconds = *value.as_ref();
    if (0.0..=LONGEST_S).contains(&seconds) {
        return Duration::from_secs_f64(seconds);
    }
    let message = format!("`{name}` is {seconds}, expected seconds from 0 to {LONGEST_S}");
    mistakes.push(source.mistake(Some(value.span()), message, ""));
    Duration::ZERO
}

fn expression(source: &Source, text: &Spanned<String>, mistakes: &mut Vec<Mistake>) -> Option<Expression> {
    match Expression::parse(text.as_ref().as_str()) {
        Ok(expression) => Some(expression),
        Err(Problem { span, message, help }) => {
            let written = text.span();
            // Between its quotes the file has the text itself, unless it has escapes: then the whole text is the place.
            let inside = source.text.get(written.clone()).and_then(|it| it.find(text.as_ref().as_str()));
            let place = inside.map_or(written.clone(), |quote| {
                let start = written.start + quote;
                start + span.start..start + span.end
            });
            mistakes.push(source.mistake(Some(place), message, help));
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use crate::contingency::Contingencies;
    use crate::contingency::alarm::Alarm;
    use crate::contingency::when::During;
    use crate::file::{Mistakes, Source};
    use crate::testing::{ACTIONS, check_mistake, table};

    fn good() -> String {
        table(
            r#"
[[contingency]]
flag = "wind_too_strong"
priority = 40
when = "wind.speed_m_s > 12 m/s and vehicle.armed"
clear_when = "wind.speed_m_s < 10 m/s"
for_s = 5
clears_after_s = 2.5
during = "flying"
actions = ["return_home"]
emergency = "land"
clears = "never"
then = "end-mission"
alarm = "advisory"
source = "ENG"

[[contingency]]
flag = "obstacle"
priority = 90
actions = ["stop"]
emergency = "stop"
clears = "after-action"
then = "resume"
"#,
        )
    }

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: text.into() }, &ACTIONS)
    }

    #[test]
    fn a_row_with_an_expression_is_read_with_its_times() {
        let table = read(&good()).unwrap();
        let row = table.row("wind_too_strong").unwrap();
        let when = row.when.as_ref().unwrap();
        assert_eq!(when.raises.text(), "wind.speed_m_s > 12 m/s and vehicle.armed");
        assert_eq!(when.clears.as_ref().map(|it| it.text()), Some("wind.speed_m_s < 10 m/s"));
        assert_eq!((when.hold, when.clears_after), (Duration::from_secs(5), Duration::from_millis(2500)));
        assert_eq!((when.during, row.alarm, row.source.as_deref()), (During::Flying, Alarm::Advisory, Some("ENG")));
        assert!(row.is_watched());
        let obstacle = table.row("obstacle").unwrap();
        assert_eq!((obstacle.alarm, obstacle.is_watched()), (Alarm::Caution, false));
        assert_eq!(table.row("operator_abort").unwrap().alarm, Alarm::Warning);
    }

    #[test]
    fn the_charge_below_which_it_lands_is_also_that_of_expressions() {
        #[track_caller]
        fn check(when: &str, action: &str, expected: f64) {
            let text = good().replacen("wind.speed_m_s > 12 m/s and vehicle.armed", when, 1);
            let text = text.replacen("[\"return_home\"]", &format!("[\"{action}\"]"), 1);
            assert_eq!(read(&text).unwrap().lands_below().get(), expected, "{when} {action}");
        }
        check("vehicle.armed and battery.charge_percent < 25 %", "land", 0.25);
        check("vehicle.armed and battery.charge_percent < 25 %", "return_home", 0.0);
        check("vehicle.armed and battery.charge_percent > 25 %", "land", 0.0);
    }

    #[test]
    fn a_mistake_in_an_expression_has_its_place_in_the_file() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(&good(), find, replace, read, expected);
        }
        check("> 12 m/s", "> 12 s", "c.toml:17:9: m/s and s are compared, expected two values of one unit");
        check("> 12 m/s", "> 12 mph", "c.toml:17:29: there is no unit `mph`");
        check("> 12 m/s", "> 120 m/s", "c.toml:17:26: 120 m/s is beyond the range of `wind.speed_m_s`");
        check("wind.speed_m_s > ", "wind.sped_m_s > ", "c.toml:17:9: there is no field `wind.sped_m_s`");
        check("vehicle.armed", "", "c.toml:17:37: found the end of the rule, expected a field, a number or `(`");
        check("for_s = 5", "for_s = -1", "c.toml:19:9: `for_s` is -1, expected seconds from 0 to 3600");
        check("clears_after_s = 2.5", "clears_after_s = nan", "c.toml:20:18: `clears_after_s` is NaN");
        check("\"flying\"", "\"swimming\"", "c.toml:21:10: unknown variant `swimming`");
        check("\"advisory\"", "\"loud\"", "c.toml:26:9: unknown variant `loud`");
        check("\"ENG\"", "\" \"", "c.toml:27:10: this source says nothing");
        check(
            "emergency = \"land\"",
            "emergency = \"return_home\"",
            "c.toml:23:13: `wind_too_strong` brings the vehicle down",
        );
        check(
            "when = \"wind.speed_m_s > 12 m/s and vehicle.armed\"\n",
            "",
            "c.toml:17:14: `clear_when` belongs to an expression, and `wind_too_strong` has no `when`",
        );
    }

    #[test]
    fn an_expression_that_would_clear_while_it_holds_is_refused() {
        let text = good().replacen(" and vehicle.armed", "", 1);
        check_mistake(
            &text,
            "wind.speed_m_s < 10",
            "wind.speed_m_s < 13",
            read,
            "c.toml:18:14: this rule would clear while it still holds",
        );
    }
}
