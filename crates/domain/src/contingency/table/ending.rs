//! Checks that a response which brings the vehicle down ends in an action that nothing can refuse.

use toml::Spanned;

use super::{Actions, Entry, find};
use crate::contingency::label::Label;
use crate::contingency::{LEFT_TO_OTHERS, Phase, SOMEBODY_ELSE_FLIES, Severity, Then};
use crate::file::{Mistake, Source};

/// A response that brings the vehicle down ends in an action that needs no way: nothing that is asked for can refuse it.
pub(super) fn check_end(source: &Source, entry: &Entry, actions: &Actions, mistakes: &mut Vec<Mistake>) {
    let severity = |name: &Spanned<String>| find(actions, name.as_ref()).map(|it| it.severity);
    // Who flies it brings it down.
    let is_left = LEFT_TO_OTHERS.contains(&entry.flag.as_ref().as_str());
    let brings_down = !is_left && entry.actions.as_ref().iter().filter_map(severity).any(Severity::comes_down);
    if brings_down && severity(&entry.emergency).is_some_and(|it| it < Severity::Land) {
        let flag = entry.flag.as_ref();
        let message = format!(
            "`{flag}` brings the vehicle down, and its emergency action `{}` may be refused",
            entry.emergency.as_ref()
        );
        let help = "name an action of severity land, ditch or terminate, which needs no way";
        mistakes.push(source.mistake(Some(entry.emergency.span()), message, help));
    } else if let Some(need) =
        find(actions, entry.emergency.as_ref()).and_then(|it| it.needs.first()).filter(|_| brings_down)
    {
        let name = entry.emergency.as_ref();
        let message = format!("the emergency action `{name}` needs {need}, and would be tried without");
        let help = "name an action without `needs`, such as a landing where the vehicle is";
        mistakes.push(source.mistake(Some(entry.emergency.span()), message, help));
    }
}

/// While somebody else flies nothing is commanded, wherever the vehicle is, and no order given before changes that. Nothing else yields.
pub(super) fn check_yields(source: &Source, entry: &Entry, actions: &Actions, mistakes: &mut Vec<Mistake>) {
    let flag = entry.flag.as_ref();
    let yields =
        |name: &&Spanned<String>| find(actions, name.as_ref()).is_some_and(|it| it.severity == Severity::Yield);
    let all_yield = entry.chain().all(|it| yields(&it));
    if flag == SOMEBODY_ELSE_FLIES {
        let is_binding = entry.label.as_ref().is_some_and(|it| *it.as_ref() == Label::Binding);
        if !all_yield || entry.phases.is_some() || entry.situations.is_some() || !is_binding {
            let message = format!("`{flag}` must command nothing, in every phase, and whatever was ordered before");
            let help =
                "name an action of severity yield, leave `phases` and `situations` out, and set `label = \"binding\"`";
            mistakes.push(source.mistake(Some(entry.flag.span()), message, help));
        }
    } else if let Some(action) = entry.chain().find(yields) {
        let message = format!("`{flag}` yields, and nobody else flies: the vehicle would be left alone");
        let help = format!("`{SOMEBODY_ELSE_FLIES}` alone yields");
        mistakes.push(source.mistake(Some(action.span()), message, help));
    }
}

/// Without such a row nothing would bring down a vehicle in the air.
pub(super) fn check_brings_down(source: &Source, entry: &Entry, actions: &Actions, mistakes: &mut Vec<Mistake>) {
    let flag = entry.flag.as_ref();
    let ends = |name: &Spanned<String>| find(actions, name.as_ref()).is_some_and(|it| it.severity.comes_down());
    if !ends(&entry.emergency) {
        let message = format!("`{flag}` brings the vehicle down, and its emergency action does not");
        let help = "name an action of severity return, land or ditch";
        mistakes.push(source.mistake(Some(entry.emergency.span()), message, help));
    }
    if entry.then == Then::Resume {
        let help = "set `then = \"end-mission\"`";
        let message = format!("`{flag}` brings the vehicle down, and the mission would continue");
        mistakes.push(source.mistake(Some(entry.flag.span()), message, help));
    }
    if let Some(situations) = &entry.situations {
        let message = format!("`{flag}` must count in every situation before the end of the mission");
        mistakes.push(source.mistake(Some(situations.span()), message, "leave the key out"));
    }
    let missing = |it: &Phase| {
        *it != Phase::OnGround && entry.phases.as_ref().is_some_and(|phases| !phases.as_ref().contains(it))
    };
    if let Some(phase) = Phase::ALL.iter().find(|it| missing(it)) {
        let message = format!("`{flag}` must count everywhere in the air, and does not {phase}");
        let place = entry.phases.as_ref().map(Spanned::span);
        mistakes.push(source.mistake(place, message, "add the phase, or leave the key out"));
    }
}

#[cfg(test)]
mod tests {
    use crate::contingency::Contingencies;
    use crate::file::{Mistakes, Source};
    use crate::testing::{ACTIONS, check_mistake, table};

    const RETURNS: &str = r#"
[[contingency]]
flag = "battery_low"
priority = 40
actions = ["return_home"]
emergency = "land"
clears = "never"
then = "end-mission"
"#;

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: text.into() }, &ACTIONS)
    }

    #[test]
    fn an_emergency_action_needs_nothing() {
        let text = table(RETURNS).replacen("severity = \"land\"", "severity = \"land\"\nneeds = [\"position\"]", 1);
        let (what, problem) = ("emergency = \"land\"", "the emergency action `land` needs a position, and would be");
        check_mistake(&text, what, what, read, &format!("c.toml:19:13: {problem}"));
        check_mistake(
            &text,
            "[\"position\"]",
            "[\"positon\"]",
            read,
            "c.toml:11:10: unknown variant `positon`, expected one of",
        );
    }
}
