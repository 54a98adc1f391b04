//! Every set of flags of one group, at every moment: which row responds, by the function that the mission manager asks, against the
//! order as it is written down.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use domain::contingency::label::Label;
use domain::contingency::{Contingencies, Moment, Raised, Row, Severity, responder};

/// A group of more rows is not tried in every set, but in every set of up to [`FEW`] and of all but up to as many.
const MOST: usize = 18;
/// The same in a hurry.
const MOST_QUICK: usize = 10;
const FEW: u32 = 3;

/// What was found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sets {
    /// Sets times moments.
    pub tried: u64,
    /// Groups of which not every set was tried, with their sizes.
    pub sampled: Vec<(String, usize)>,
    /// Sets that are answered otherwise than the order says.
    pub wrong: Vec<String>,
}

/// Tries all sets of each group, and all pairs of which one is under way.
pub fn try_sets(table: &Contingencies, is_quick: bool) -> Sets {
    let rows = table.rows();
    let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (index, row) in rows.iter().enumerate() {
        let name = row.group.map_or_else(|| "no group".to_owned(), |it| it.to_string());
        groups.entry(name).or_default().push(index);
    }
    let mut sets = Sets::default();
    for (name, members) in groups {
        let most = if is_quick { MOST_QUICK } else { MOST };
        let is_whole = members.len() <= most;
        if !is_whole {
            sets.sampled.push((name, members.len()));
        }
        // More flags than bits are tried in parts.
        for members in members.chunks(MOST.max(most)) {
            try_group(rows, members, is_whole, &mut sets);
        }
    }
    try_under_way(rows, &mut sets);
    try_without_comfort(rows, &mut sets);
    sets
}

fn try_group(rows: &[Row], members: &[usize], is_whole: bool, sets: &mut Sets) {
    let count = members.len() as u32;
    for moment in Moment::ALL {
        // The order as it is written down: safety first, then the most severe, of equally severe ones the upper row.
        let mut order: Vec<usize> = (0..members.len())
            .filter(|it| moment.counts(&rows[members[*it]]) && !rows[members[*it]].only_slows())
            .collect();
        order.sort_by_key(|it| {
            let row = &rows[members[*it]];
            (row.label == Label::Comfort, Reverse(row.severity()), row.priority)
        });
        for set in 0..1_u32 << count {
            let size = set.count_ones();
            if !is_whole && FEW < size && size + FEW < count {
                continue;
            }
            let up = (0..members.len()).filter(|it| set >> it & 1 == 1).map(|it| up(members[it]));
            let found = responder(rows, up, moment);
            let expected = order.iter().find(|it| set >> **it & 1 == 1).map(|it| members[*it]);
            sets.tried += 1;
            if found != expected {
                let names: Vec<&str> = members
                    .iter()
                    .enumerate()
                    .filter(|(it, _)| set >> it & 1 == 1)
                    .map(|(_, it)| rows[*it].flag.as_str())
                    .collect();
                sets.wrong.push(wrong(rows, &names.join(", "), moment, found, expected));
            }
        }
    }
}

/// A response that is under way, at each of its actions, and another flag.
fn try_under_way(rows: &[Row], sets: &mut Sets) {
    for (flown, of_flown) in rows.iter().enumerate().filter(|(_, it)| !it.only_slows()) {
        for action in &of_flown.actions {
            for (other, of_other) in rows.iter().enumerate().filter(|(it, _)| *it != flown) {
                for moment in Moment::ALL {
                    let raised = [Raised { under_way: Some(action.severity), ..up(flown) }, up(other)];
                    let found = responder(rows, raised, moment);
                    let reached: Severity = action.severity.max(of_flown.severity());
                    let order =
                        |severity: Severity, row: &Row| (row.label != Label::Comfort, severity, Reverse(row.priority));
                    let yields = moment.counts(of_other)
                        && !of_other.only_slows()
                        && order(reached, of_flown) < order(of_other.severity(), of_other);
                    let expected = Some(if yields { other } else { flown });
                    sets.tried += 1;
                    if found != expected {
                        let names = format!("{} (under way by {}), {}", of_flown.flag, action.tree, of_other.flag);
                        sets.wrong.push(wrong(rows, &names, moment, found, expected));
                    }
                }
            }
        }
    }
}

/// Comfort is optional: with all its flags up, and each of its responses under way, a flag of safety has the answer that it has without.
fn try_without_comfort(rows: &[Row], sets: &mut Sets) {
    let of = |is_comfort: bool| {
        let is = move |row: &Row| (row.label == Label::Comfort) == is_comfort && !row.only_slows();
        rows.iter().enumerate().filter(move |(_, row)| is(row)).map(|(number, _)| number)
    };
    for (safety, moment) in of(false).flat_map(|row| Moment::ALL.map(|moment| (row, moment))) {
        let Some(alone) = responder(rows, [up(safety)], moment) else { continue };
        for flown in of(true).map(Some).chain([None]) {
            let of_comfort =
                of(true).map(|it| Raised { under_way: (Some(it) == flown).then_some(Severity::Hold), ..up(it) });
            let found = responder(rows, of_comfort.chain([up(safety)]), moment);
            sets.tried += 1;
            if found != Some(alone) {
                let names = format!("{} beside all comfort", rows[safety].flag);
                sets.wrong.push(wrong(rows, &names, moment, found, Some(alone)));
            }
        }
    }
}

fn up(row: usize) -> Raised {
    Raised { row, overrides: false, is_overridden: false, under_way: None }
}

fn wrong(rows: &[Row], names: &str, moment: Moment, found: Option<usize>, expected: Option<usize>) -> String {
    let name = |row: Option<usize>| row.map_or("nothing", |it| rows[it].flag.as_str()).to_owned();
    let Moment { situation, phase } = moment;
    format!("{names} {phase}, {situation}: {} responds, by the order it is {}", name(found), name(expected))
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::file::Source;
    use std::path::Path;

    #[test]
    fn every_set_of_the_shipped_table_is_answered_by_the_order() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
        let trees = mcm::Trees::read(&config.join("trees")).unwrap();
        let table =
            Contingencies::read(&Source::read(&config.join("contingencies.toml")).unwrap(), &trees.actions()).unwrap();
        let sets = try_sets(&table, true);
        assert_eq!(sets.wrong, Vec::<String>::new());
        let pairs = table.rows().len() * (table.rows().len() - 1) * Moment::ALL.len();
        assert!(pairs as u64 <= sets.tried, "{sets:?}");
    }
}
