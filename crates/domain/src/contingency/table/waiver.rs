//! Reads what the table leaves unanswered on purpose.

use std::collections::BTreeSet;

use serde::Deserialize;
use toml::Spanned;

use crate::contingency::Phase;
use crate::contingency::hazard::{HAZARDS, Hazard, Waiver};
use crate::file::{Mistake, Source, did_you_mean};

/// The fewest words that are a reason.
const FEWEST_WORDS: usize = 4;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    /// The name of a hazard.
    hazard: Spanned<String>,
    /// Without the key in every phase in which it calls for an answer.
    phases: Option<Spanned<BTreeSet<Phase>>>,
    reason: Spanned<String>,
}

/// The waivers; what is wrong with one is reported as a mistake.
pub(super) fn read(source: &Source, entries: Vec<Entry>, mistakes: &mut Vec<Mistake>) -> Vec<Waiver> {
    let mut waivers: Vec<Waiver> = Vec::new();
    for Entry { hazard: name, phases, reason } in entries {
        let Some(hazard) = Hazard::named(name.as_ref()) else {
            let known: Vec<&str> = HAZARDS.iter().map(|it| it.name).collect();
            let message = format!("there is no hazard `{}`", name.as_ref());
            mistakes.push(source.mistake(Some(name.span()), message, did_you_mean(name.as_ref(), &known)));
            continue;
        };
        if reason.as_ref().split_whitespace().count() < FEWEST_WORDS {
            let help = "say what answers it instead, or why nothing needs to";
            mistakes.push(source.mistake(Some(reason.span()), "a waiver gives its reason in words", help));
        }
        let calls = |it: &Phase| hazard.calls_for(*it).is_some();
        if let Some(phases) = &phases
            && let Some(phase) = phases.as_ref().iter().find(|it| !calls(it))
        {
            let message = format!("`{}` calls for nothing {phase}", hazard.name);
            mistakes.push(source.mistake(Some(phases.span()), message, "leave the phase out"));
        }
        let all = || Phase::ALL.into_iter().filter(calls).collect();
        let phases = phases.map_or_else(all, Spanned::into_inner);
        let is_same = |it: &Waiver| it.hazard.name == hazard.name && !it.phases.is_disjoint(&phases);
        if phases.is_empty() || waivers.iter().any(is_same) {
            let message = format!("this waiver of `{}` waives nothing more", hazard.name);
            mistakes.push(source.mistake(Some(name.span()), message, "take it out"));
        }
        waivers.push(Waiver { hazard, phases, reason: reason.into_inner() });
    }
    waivers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contingency::Contingencies;
    use crate::file::Mistakes;
    use crate::testing::{ACTIONS, check_mistake, table};

    const GOOD: &str = "[[waiver]]\nhazard = \"battery-low\"\nphases = [\"takeoff\", \"cruise\"]\nreason = \"a tether feeds the vehicle\"\n";

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: table(text) }, &ACTIONS)
    }

    #[test]
    fn a_waiver_has_a_hazard_its_phases_and_a_reason() {
        let table =
            read(&format!("{GOOD}[[waiver]]\nhazard = \"wind-high\"\nreason = \"it stands in a hangar\"\n")).unwrap();
        let told: Vec<_> =
            table.waivers().iter().map(|it| (it.hazard.name, it.phases.len(), it.reason.as_str())).collect();
        assert_eq!(told, [("battery-low", 2, "a tether feeds the vehicle"), ("wind-high", 1, "it stands in a hangar")]);
    }

    #[test]
    fn a_mistake_in_a_waiver_has_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("battery-low", "battery-lo", "c.toml:14:10: there is no hazard `battery-lo`");
        check("a tether feeds the vehicle", "none", "c.toml:16:10: a waiver gives its reason in words");
        check("takeoff", "landing", "c.toml:15:10: `battery-low` calls for nothing while landing");
        check("\"takeoff\", \"cruise\"", "", "c.toml:14:10: this waiver of `battery-low` waives nothing more");
        check("phases = ", "during = ", "c.toml:15:1: unknown field `during`");
    }
}
