//! Checks which rows explain others: while one of them is up, the other one calls for nobody.

use std::collections::BTreeSet;

use toml::Spanned;

use super::Entry;
use crate::file::{Mistake, Source, did_you_mean};

/// Every flag that is named has a row, and no row is explained by itself, whatever lies between: all of such a circle would be silent.
pub(super) fn check_explained(source: &Source, entries: &[Entry], mistakes: &mut Vec<Mistake>) {
    let flags: Vec<&str> = entries.iter().map(|it| it.flag.as_ref().as_str()).collect();
    for entry in entries {
        for name in named(entry) {
            if !flags.contains(&name.as_ref().as_str()) {
                let message = format!("no row for the flag `{}`", name.as_ref());
                mistakes.push(source.mistake(Some(name.span()), message, did_you_mean(name.as_ref(), &flags)));
            } else if leads_to(entries, name.as_ref(), entry.flag.as_ref()) {
                let message = format!("`{}` would be explained by itself, and call for nobody", entry.flag.as_ref());
                let help = "name only flags that are not explained by this one";
                mistakes.push(source.mistake(Some(name.span()), message, help));
            }
        }
    }
}

fn named(entry: &Entry) -> impl Iterator<Item = &Spanned<String>> {
    entry.explained_by.iter().flat_map(|it| it.as_ref())
}

/// Whether `from` is `to`, or explained by it, whatever lies between.
fn leads_to(entries: &[Entry], from: &str, to: &str) -> bool {
    let (mut reached, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(flag) = next.pop() {
        if flag == to {
            return true;
        }
        if reached.insert(flag) {
            let of_flag = entries.iter().filter(|it| it.flag.as_ref() == flag);
            next.extend(of_flag.flat_map(named).map(|it| it.as_ref().as_str()));
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use crate::contingency::Contingencies;
    use crate::contingency::alarm::Alarm;
    use crate::file::{Mistakes, Source};
    use crate::testing::{ACTIONS, check_mistake, table};

    /// Two rows, the second of which names what explains it.
    fn rows(first: &str, second: &str) -> String {
        let row = |flag: &str, priority: u32, key: &str| {
            format!(
                "[[contingency]]\nflag = \"{flag}\"\npriority = {priority}\n{key}\nactions = [\"stop\"]\nemergency = \"stop\"\n\
                 clears = \"with-condition\"\nthen = \"resume\"\n"
            )
        };
        table(&format!("{}{}", row("gust", 40, first), row("wind", 41, second)))
    }

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: text.into() }, &ACTIONS)
    }

    #[test]
    fn what_another_flag_explains_is_to_be_known_and_calls_for_nobody() {
        let table = read(&rows("", "explained_by = [\"gust\"]")).unwrap();
        let alarm = |flag: &str, up: &[&str]| table.row(flag).unwrap().alarm_beside(|it| up.contains(&it));
        assert_eq!(alarm("wind", &["wind"]), Alarm::Caution);
        assert_eq!(alarm("wind", &["wind", "gust"]), Alarm::Advisory);
        assert_eq!(alarm("gust", &["wind", "gust"]), Alarm::Caution);
    }

    #[test]
    fn a_mistake_in_what_explains_a_row_is_reported_with_its_place() {
        let good = rows("", "explained_by = [\"gust\"]");
        check_mistake(&good, "[\"gust\"]", "[\"gusts\"]", read, "c.toml:24:17: no row for the flag `gusts`");
        check_mistake(&good, "[\"gust\"]", "[\"wind\"]", read, "c.toml:24:17: `wind` would be explained by itself");
        let circle = rows("explained_by = [\"wind\"]", "explained_by = [\"gust\"]");
        check_mistake(&circle, "\"wind\"]", "\"wind\"]", read, "c.toml:16:17: `gust` would be explained by itself");
    }
}
