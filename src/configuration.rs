//! `kittiwake config diff`: what a configuration has otherwise than the one that this version ships, key by key.

use std::collections::BTreeMap;
use std::path::Path;

use domain::file::Source;
use toml::{Table, Value};

use crate::check_inputs;
use crate::cli::{ConfigArgs, ConfigCommand, DiffArgs};
use crate::outcome::Outcome;
use crate::output;

/// The files of the shipped configuration that an upgrade may change. Missions and skills are the user's own.
const SHIPPED: [(&str, &str); 6] = [
    ("kittiwake.toml", include_str!("../config/kittiwake.toml")),
    ("contingencies.toml", include_str!("../config/contingencies.toml")),
    ("zenoh/link.toml", include_str!("../config/zenoh/link.toml")),
    ("trees/mission.xml", include_str!("../config/trees/mission.xml")),
    ("trees/actions.xml", include_str!("../config/trees/actions.xml")),
    ("trees/step.xml", include_str!("../config/trees/step.xml")),
];

/// What names an entry of an array of tables, in place of its number.
const NAMES: [&str; 3] = ["flag", "name", "key"];

/// Does what the arguments say.
pub fn config(args: &ConfigArgs) -> Outcome {
    match &args.command {
        ConfigCommand::Diff(args) => diff(args),
    }
}

fn diff(args: &DiffArgs) -> Outcome {
    let folder = args.config.parent().unwrap_or(Path::new(""));
    let mut lines = Vec::new();
    for (name, shipped) in SHIPPED {
        let path = if name == "kittiwake.toml" { args.config.clone() } else { folder.join(name) };
        let own = match Source::read(&path) {
            Ok(source) => source,
            Err(mistakes) => return check_inputs::tell(&mistakes),
        };
        match differences(&own, shipped) {
            Ok(found) => lines.extend(found.into_iter().map(|it| format!("{name}: {it}"))),
            Err(mistakes) => return check_inputs::tell(&mistakes),
        }
    }
    for line in &lines {
        output::line(line);
    }
    if lines.is_empty() {
        output::line("no difference from the configuration of this version");
        return Outcome::Success;
    }
    Outcome::Differs
}

/// A sentence for each difference.
fn differences(own: &Source, shipped: &str) -> Result<Vec<String>, domain::file::Mistakes> {
    if own.path.extension().is_some_and(|it| it == "xml") {
        let is_same = own.text.split_whitespace().eq(shipped.split_whitespace());
        return Ok(if is_same { Vec::new() } else { vec!["differs".into()] });
    }
    let own = flat(&own.parse::<Table>()?);
    let shipped: Table =
        shipped.parse().expect("the shipped files can be read: `kittiwake check` of this version reads them");
    let shipped = flat(&shipped);
    let changed = own.iter().filter_map(|(key, value)| match shipped.get(key) {
        Some(theirs) if theirs == value => None,
        Some(theirs) => Some(format!("{key}: yours {value}, shipped {theirs}")),
        None => Some(format!("{key}: only yours, {value}")),
    });
    let missing = shipped
        .iter()
        .filter(|(key, _)| !own.contains_key(*key))
        .map(|(key, value)| format!("{key}: only shipped, {value}"));
    Ok(changed.chain(missing).collect())
}

/// Every value by the path to it, such as `energy.reserve_percent` or `contingency[battery_low].priority`.
fn flat(table: &Table) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for (key, value) in table {
        add(&mut found, key.clone(), value);
    }
    found
}

fn add(found: &mut BTreeMap<String, String>, path: String, value: &Value) {
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| add(found, format!("{path}.{key}"), value)),
        Value::Array(entries) if entries.iter().any(Value::is_table) => {
            for (number, entry) in entries.iter().enumerate() {
                add(found, format!("{path}[{}]", name_of(entry, number)), entry);
            }
        }
        value => _ = found.insert(path, value.to_string()),
    }
}

fn name_of(entry: &Value, number: usize) -> String {
    let named = NAMES.iter().find_map(|it| entry.get(it)?.as_str());
    named.map_or_else(|| (number + 1).to_string(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(own: &str, shipped: &str, expected: &[&str]) {
        let own = Source { path: "own.toml".into(), text: own.into() };
        assert_eq!(differences(&own, shipped).unwrap(), expected);
    }

    #[test]
    fn a_difference_is_named_by_its_key() {
        check("a = 1\n[b]\nc = \"x\"\n", "a = 1.0\n[b]\nc = \"x\"\n", &["a: yours 1, shipped 1.0"]);
        check("[b]\nc = 1\nd = 2\n", "[b]\nc = 1\ne = 3\n", &["b.d: only yours, 2", "b.e: only shipped, 3"]);
        check("# a comment\na = 1", "a   =   1", &[]);
    }

    #[test]
    fn a_row_is_compared_by_its_name_wherever_it_stands() {
        let row = |flag: &str, priority: u32| format!("[[row]]\nflag = \"{flag}\"\npriority = {priority}\n");
        let own = row("wind", 3) + &row("battery", 1);
        check(&own, &(row("battery", 1) + &row("wind", 4)), &["row[wind].priority: yours 3, shipped 4"]);
        check(&row("wind", 3), "", &["row[wind].flag: only yours, \"wind\"", "row[wind].priority: only yours, 3"]);
    }

    #[test]
    fn a_tree_with_other_indents_is_the_same() {
        let own = Source { path: "own.xml".into(), text: "<root>\n  <a/>\n</root>".into() };
        assert!(differences(&own, "<root> <a/> </root>").unwrap().is_empty());
        assert_eq!(differences(&own, "<root> <b/> </root>").unwrap(), ["differs"]);
    }

    #[test]
    fn the_shipped_configuration_is_its_own() {
        for (name, shipped) in SHIPPED {
            let own = Source { path: name.into(), text: shipped.into() };
            assert!(differences(&own, shipped).unwrap().is_empty(), "{name}");
        }
    }
}
