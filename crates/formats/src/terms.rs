//! What a mission asks of an objective besides its place, as properties of GeoJSON under the names of a mission file.

use std::time::Duration;

use domain::mission::terms::Terms;
use domain::task::Task;
use serde_json::{Map, Value, json};

use crate::applicability;
use crate::findings::Wrong;
use crate::json::Node;

/// Their names.
pub(crate) const PROPERTIES: [&str; 11] = [
    "optional",
    "worth",
    "after",
    "reach_within_s",
    "reach_by_utc",
    "dwell_s",
    "drop",
    "land_on_target",
    "actions",
    "do",
    "along",
];

/// As they stand in `properties`. Whether they make sense together is asked of the mission file that they become part of.
pub(crate) fn read(properties: &Node<'_>) -> Result<Terms, Wrong> {
    let time = |key: &str| properties.get(key).map(|it| seconds(&it)).transpose();
    let truth = |key: &str| properties.get(key).map(|it| it.boolean()).transpose();
    let is_optional = truth("optional")?.unwrap_or_default();
    let worth = properties.get("worth").map(|it| it.number()).transpose()?;
    if is_optional != worth.is_some() {
        let message = "`optional` and `worth` stand together: what is worth least is left out first";
        return Err(Wrong::at(&properties.place, message, "give both, or none of them"));
    }
    let texts = |key: &str| -> Result<Vec<String>, Wrong> {
        properties.list(key)?.iter().map(|it| it.text().map(str::to_owned)).collect()
    };
    Ok(Terms {
        worth,
        after: texts("after")?,
        within: time("reach_within_s")?,
        by_utc_ms: properties.get("reach_by_utc").map(|it| applicability::moment(&it)).transpose()?,
        dwell: time("dwell_s")?.unwrap_or_default(),
        drop: truth("drop")?.unwrap_or_default(),
        land_on_target: truth("land_on_target")?.unwrap_or_default(),
        actions: texts("actions")?,
        tasks: properties.list("do")?.iter().map(task).collect::<Result<_, _>>()?,
        along: properties.list("along")?.iter().map(task).collect::<Result<_, _>>()?,
    })
}

/// `{ "skill": "winch_down", "length_m": 12 }`
fn task(node: &Node<'_>) -> Result<Task, Wrong> {
    let inputs = node.object()?.keys().filter(|it| *it != "skill");
    let inputs = inputs.map(|it| Ok((it.clone(), node.need(it)?.number()?))).collect::<Result<_, Wrong>>()?;
    Ok(Task { skill: node.need("skill")?.text()?.to_owned(), inputs })
}

/// A task as a mission file has it.
pub(crate) fn task_entry(task: &Task) -> Value {
    let inputs = task.inputs.iter().map(|(name, value)| (name.clone(), json!(value)));
    std::iter::once(("skill".to_owned(), json!(task.skill))).chain(inputs).collect::<Map<_, _>>().into()
}

/// A time that a mission may ask for.
pub(crate) fn seconds(node: &Node<'_>) -> Result<Duration, Wrong> {
    let seconds = node.number()?;
    Duration::try_from_secs_f64(seconds)
        .map_err(|_| Wrong::at(&node.place, format!("found {seconds}, expected seconds from 0 on"), ""))
}

/// Adds those that differ from what holds without them.
pub(crate) fn write(terms: &Terms, properties: &mut Map<String, Value>) {
    let mut add = |key: &str, value: Value| {
        properties.insert(key.to_owned(), value);
    };
    if let Some(worth) = terms.worth {
        add("optional", json!(true));
        add("worth", json!(worth));
    }
    if !terms.after.is_empty() {
        add("after", json!(terms.after));
    }
    if let Some(within) = terms.within {
        add("reach_within_s", json!(within.as_secs_f64()));
    }
    if let Some(by_utc_ms) = terms.by_utc_ms {
        add("reach_by_utc", json!(crate::export::utc(by_utc_ms)));
    }
    if !terms.dwell.is_zero() {
        add("dwell_s", json!(terms.dwell.as_secs_f64()));
    }
    if terms.drop {
        add("drop", json!(true));
    }
    if terms.land_on_target {
        add("land_on_target", json!(true));
    }
    if !terms.actions.is_empty() {
        add("actions", json!(terms.actions));
    }
    if !terms.tasks.is_empty() {
        add("do", terms.tasks.iter().map(task_entry).collect());
    }
    if !terms.along.is_empty() {
        add("along", terms.along.iter().map(task_entry).collect());
    }
}
