//! Checks what a row does beside the response of another one: slow the vehicle, and narrow what is flown.

use toml::Spanned;

use super::{Actions, Entry, find};
use crate::contingency::{Clears, Severity, Then};
use crate::file::{Mistake, Source};

/// An action that slows holds beside whatever is flown: it is not a step of a response, and its row has no other.
pub(super) fn check_slowing(source: &Source, entry: &Entry, actions: &Actions, mistakes: &mut Vec<Mistake>) {
    let severity = |name: &Spanned<String>| find(actions, name.as_ref()).map(|it| it.severity);
    let slows = |name: &&Spanned<String>| severity(name) == Some(Severity::Slow);
    let Some(slowing) = entry.chain().find(slows) else { return };
    let flag = entry.flag.as_ref();
    let is_another = |name: &&Spanned<String>| severity(name).is_some_and(|it| it != Severity::Slow);
    if let Some(another) = entry.chain().find(is_another) {
        let (slowing, another_name) = (slowing.as_ref(), another.as_ref());
        let message = format!("`{flag}` slows the vehicle by `{slowing}`, and has the response `{another_name}`");
        let help = "a row that slows has no other action; beside a response, write `narrows = [\"slow\"]`";
        mistakes.push(source.mistake(Some(another.span()), message, help));
    } else if entry.clears != Clears::WithCondition || entry.then != Then::Resume {
        let message = format!("`{flag}` slows the vehicle, which has no end but that of its condition");
        let help = "set `clears = \"with-condition\"` and `then = \"resume\"`";
        mistakes.push(source.mistake(Some(entry.flag.span()), message, help));
    }
}

/// Everything that a row narrows is named once.
pub(super) fn check_narrows(source: &Source, entry: &Entry, mistakes: &mut Vec<Mistake>) {
    let Some(narrows) = &entry.narrows else { return };
    if narrows.as_ref().is_empty() {
        let help = "name what is forbidden while the flag is up, or leave the key out";
        mistakes.push(source.mistake(Some(narrows.span()), "this list says nothing", help));
    }
    for (index, what) in narrows.as_ref().iter().enumerate() {
        if narrows.as_ref().iter().take(index).any(|it| it.as_ref() == what.as_ref()) {
            let message = format!("`{}` is named twice", what.as_ref().name());
            mistakes.push(source.mistake(Some(what.span()), message, "leave one of them out"));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::contingency::Contingencies;
    use crate::contingency::narrowing::Narrows;
    use crate::file::{Mistakes, Source};
    use crate::testing::{ACTIONS, check_mistake, table};

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: text.into() }, &ACTIONS)
    }

    /// A row with this in it, and an action that slows.
    fn narrowing(row: &str) -> String {
        let action = "[action.slow]\nseverity = \"slow\"\ntries = 1\n\n";
        table(&format!("{action}[[contingency]]\nflag = \"gust\"\npriority = 40\n{row}"))
    }

    const SLOWS: &str = "actions = [\"slow\"]\nemergency = \"slow\"\nclears = \"with-condition\"\nthen = \"resume\"\n";
    const HOLDS: &str = "actions = [\"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"\n";

    #[test]
    fn what_a_row_narrows_is_read_and_an_action_that_slows_needs_no_tree() {
        let narrows = |row: &str| read(&narrowing(row)).unwrap().row("gust").unwrap().narrows.clone();
        assert_eq!(narrows(HOLDS), BTreeSet::new());
        let text = format!("narrows = [\"slow\", \"no-new-area\"]\n{HOLDS}");
        assert_eq!(narrows(&text), BTreeSet::from([Narrows::NoNewArea, Narrows::Slow]));
        let read = read(&narrowing(SLOWS)).unwrap();
        assert!(read.row("gust").unwrap().only_slows() && !read.row("transition_failed").unwrap().only_slows());
    }

    #[test]
    fn a_mistake_in_what_a_row_narrows_is_reported_with_its_place() {
        #[track_caller]
        fn check(row: &str, find: &str, replace: &str, expected: &str) {
            check_mistake(&narrowing(row), find, replace, read, expected);
        }
        let narrows = format!("narrows = [\"slow\", \"no-new-area\"]\n{HOLDS}");
        check(&narrows, "\"no-new-area\"", "\"no-area\"", "c.toml:20:20: unknown variant `no-area`, expected one of");
        check(&narrows, "\"no-new-area\"", "\"slow\"", "c.toml:20:20: `slow` is named twice");
        check(&narrows, "[\"slow\", \"no-new-area\"]", "[]", "c.toml:20:11: this list says nothing");
        let other = "`gust` slows the vehicle by `slow`, and has the response";
        check(SLOWS, "emergency = \"slow\"", "emergency = \"land\"", &format!("c.toml:21:13: {other} `land`"));
        check(
            HOLDS,
            "[\"stop\"]",
            "[\"stop\", \"slow\"]",
            "c.toml:20:20: `gust` holds, and its action `slow` is more severe",
        );
        let returns = HOLDS.replace("[\"stop\"]", "[\"return_home\", \"slow\"]").replace("= \"stop\"", "= \"land\"");
        check(&returns, "flag = \"gust\"", "flag = \"gust\"", &format!("c.toml:20:12: {other} `return_home`"));
        check(
            SLOWS,
            "with-condition",
            "after-action",
            "c.toml:18:8: `gust` slows the vehicle, which has no end but that of its",
        );
        check(
            SLOWS,
            "\"resume\"",
            "\"end-mission\"",
            "c.toml:18:8: `gust` slows the vehicle, which has no end but that of its",
        );
    }
}
