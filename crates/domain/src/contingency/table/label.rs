//! Checks that comfort stays optional: it holds, and interrupts no landing.

use toml::Spanned;

use super::{Actions, Entry, find};
use crate::contingency::label::Label;
use crate::contingency::{Phase, Severity, Then};
use crate::file::{Mistake, Source};
use crate::situation::Situation;

/// A row of comfort only holds, resumes, and counts neither while landing nor while touching down.
pub(super) fn check_comfort(source: &Source, entry: &Entry, actions: &Actions, mistakes: &mut Vec<Mistake>) {
    let severity = |name: &Spanned<String>| find(actions, name.as_ref()).map_or(Severity::Hold, |it| it.severity);
    let first = entry.chain().next().map_or(Severity::Hold, severity);
    if entry.label(first) != Label::Comfort {
        return;
    }
    let (phases, situations) = (entry.phases.as_ref(), entry.situations.as_ref());
    let why = if entry.chain().any(|it| severity(it) != Severity::Hold) || entry.then != Then::Resume {
        "does more than to hold"
    } else if phases.is_none_or(|it| it.as_ref().contains(&Phase::Landing)) {
        "counts while landing"
    } else if situations.is_some_and(|it| it.as_ref().contains(&Situation::TouchingDown)) {
        "counts while touching down"
    } else {
        return;
    };
    let place = entry.label.as_ref().map_or(entry.flag.span(), Spanned::span);
    let message = format!("`{}` is comfort, and {why}", entry.flag.as_ref());
    let help = "set `label = \"safety\"`, or leave out what nobody but safety may do";
    mistakes.push(source.mistake(Some(place), message, help));
}

#[cfg(test)]
mod tests {
    use crate::contingency::Contingencies;
    use crate::contingency::label::Label;
    use crate::file::{Mistakes, Source};
    use crate::testing::{ACTIONS, check_mistake, table};

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: text.into() }, &ACTIONS)
    }

    fn row(more: &str) -> String {
        table(&format!(
            "[[contingency]]\nflag = \"x\"\npriority = 1\nactions = [\"stop\"]\nemergency = \"stop\"\n\
             clears = \"with-condition\"\nthen = \"resume\"\nphases = [\"cruise\"]\n{more}\n"
        ))
    }

    #[test]
    fn a_hold_that_is_only_to_be_known_is_comfort_and_the_rest_is_safety() {
        #[track_caller]
        fn check(more: &str, expected: Label) {
            assert_eq!(read(&row(more)).unwrap().row("x").unwrap().label, expected, "{more}");
        }
        check("", Label::Safety);
        check("alarm = \"advisory\"", Label::Comfort);
        check("alarm = \"warning\"", Label::Safety);
        check("alarm = \"advisory\"\nlabel = \"binding\"", Label::Binding);
        check("label = \"comfort\"", Label::Comfort);
        let lands =
            row("alarm = \"advisory\"").replace("\"stop\"]\nemergency = \"stop\"", "\"land\"]\nemergency = \"land\"");
        assert_eq!(read(&lands).unwrap().row("x").unwrap().label, Label::Safety);
    }

    #[test]
    fn comfort_that_does_more_than_to_hold_in_flight_is_a_mistake() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            let expected = format!("c.toml:21:9: `x` is comfort, and {expected}");
            check_mistake(&row("label = \"comfort\""), find, replace, read, &expected);
        }
        let stops = "actions = [\"stop\"]\nemergency = \"stop\"";
        check(stops, "actions = [\"land\"]\nemergency = \"land\"", "does more than to hold");
        check("\"resume\"", "\"end-mission\"", "does more than to hold");
        check("\"cruise\"", "\"landing\"", "counts while landing");
        let label = "label = \"comfort\"";
        let touches = format!("{label}\nsituations = [\"flying\", \"touching-down\"]");
        check(label, &touches, "counts while touching down");
        let everywhere = row("").replace("phases = [\"cruise\"]\n", "");
        check_mistake(
            &everywhere,
            "then = \"resume\"",
            "alarm = \"advisory\"\nthen = \"resume\"",
            read,
            "c.toml:14:8: `x` is",
        );
    }
}
