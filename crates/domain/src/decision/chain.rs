//! Records as lines in which what follows from a decision stands under it.

use std::collections::BTreeMap;

use super::DecisionRecord;

/// Deeper ones are indented no further, so that a file that was forged makes no lines without end.
const MOST_INDENTS: usize = 12;
/// A day, in milliseconds.
const DAY_MS: i64 = 24 * 60 * 60 * 1000;

/// A line for each record, with the time of day in UTC: `12:03:44.2  Area A: granted.` Those that follow from another one of them
/// stand under it, indented; otherwise they are in the order of `records`.
pub fn chain(records: &[DecisionRecord]) -> Vec<String> {
    // Of the records so far. The numbers of a manager that lost what it knew begin again: those before it led to nothing after it.
    let mut places: BTreeMap<u64, usize> = BTreeMap::new();
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); records.len()];
    let mut roots = Vec::new();
    for (place, record) in records.iter().enumerate() {
        // A cause has the lower number. Anything else is a forgery, and could be a circle.
        let parent = record.parent.filter(|parent| *parent < record.number);
        match parent.and_then(|parent| places.get(&parent)) {
            Some(parent) => children[*parent].push(place),
            None => roots.push(place),
        }
        places.insert(record.number, place);
    }
    let mut open: Vec<(usize, usize)> = roots.into_iter().rev().map(|place| (place, 0)).collect();
    let mut lines = Vec::with_capacity(records.len());
    while let Some((place, depth)) = open.pop() {
        let record = &records[place];
        let indent = "  ".repeat(depth.min(MOST_INDENTS));
        lines.push(format!("{}  {indent}{}", time_of_day(record.utc_ms), record.sentence()));
        open.extend(children[place].iter().rev().map(|child| (*child, depth + 1)));
    }
    lines
}

/// `12:03:44.2`, UTC.
fn time_of_day(utc_ms: i64) -> String {
    let tenths = utc_ms.rem_euclid(DAY_MS) / 100;
    let (seconds, minutes) = (tenths / 10, tenths / 600);
    format!("{:02}:{:02}:{:02}.{}", minutes / 60, minutes % 60, seconds % 60, tenths % 10)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::samples::note;
    use super::*;

    #[test]
    fn what_follows_from_a_decision_stands_under_it() {
        let records = [
            note(1, "a", None),
            note(2, "b", None),
            note(3, "a1", Some(1)),
            note(4, "b1", Some(2)),
            note(5, "a11", Some(3)),
            note(6, "a2", Some(1)),
            note(9, "its cause was not recorded", Some(7)),
        ];
        let at = |line: &str| format!("12:03:44.2  {line}");
        let whole = ["A.", "  A1.", "    A11.", "  A2.", "B.", "  B1.", "Its cause was not recorded."].map(at);
        assert_eq!(chain(&records), whole);
        assert_eq!(chain(&records[3..]), ["B1.", "A11.", "A2.", "Its cause was not recorded."].map(at));
        assert!(chain(&[]).is_empty());
    }

    #[test]
    fn where_numbers_begin_again_a_decision_stands_under_the_last_one_of_its_number() {
        let records = [
            note(1, "a", None),
            note(2, "a1", Some(1)),
            note(1, "b", None),
            note(2, "b1", Some(1)),
            note(3, "b11", Some(2)),
        ];
        let at = |line: &str| format!("12:03:44.2  {line}");
        assert_eq!(chain(&records), ["A.", "  A1.", "B.", "  B1.", "    B11."].map(at));
    }

    #[test]
    fn the_time_of_day_is_that_of_the_moment() {
        #[track_caller]
        fn check(utc_ms: i64, expected: &str) {
            assert_eq!(time_of_day(utc_ms), expected);
        }
        check(0, "00:00:00.0");
        check(DAY_MS - 1, "23:59:59.9");
        check(5 * DAY_MS + 43_424_299, "12:03:44.2");
        check(-1, "23:59:59.9");
    }

    proptest! {
        /// Whatever a file claims, each record appears once.
        #[test]
        fn every_record_is_told_once(links in prop::collection::vec((0..9_u64, prop::option::of(0..9_u64)), 0..30)) {
            let each = |(place, (number, parent)): (usize, &(u64, Option<u64>))| note(*number, &format!("#{place}"), *parent);
            let records: Vec<_> = links.iter().enumerate().map(each).collect();
            let mut told: Vec<String> = chain(&records)
                .iter()
                .map(|line| line.rsplit(' ').next().unwrap_or_default().to_owned())
                .collect();
            told.sort();
            let mut expected: Vec<String> = (0..records.len()).map(|place| format!("#{place}.")).collect();
            expected.sort();
            prop_assert_eq!(told, expected);
        }
    }
}
