//! Which row responds, of those whose flags are up.

use std::collections::BTreeMap;

use super::group::Group;
use super::{Phase, Row, Severity};
use crate::situation::Situation;

/// When a row is asked whether it counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// The situation of the vehicle.
    pub situation: Situation,
    /// The phase of the flight.
    pub phase: Phase,
}

impl Moment {
    /// Every moment that there can be.
    pub const ALL: [Moment; 13] = [
        Moment::new(Situation::Unseen, Phase::Cruise),
        Moment::new(Situation::Standing, Phase::OnGround),
        Moment::new(Situation::TouchingDown, Phase::OnGround),
        Moment::new(Situation::Ended, Phase::OnGround),
        Moment::new(Situation::LiftingOff, Phase::Takeoff),
        Moment::new(Situation::LiftingOff, Phase::Waiting),
        Moment::new(Situation::TouchingDown, Phase::Landing),
        Moment::new(Situation::TouchingDown, Phase::Waiting),
        Moment::new(Situation::Flying, Phase::Takeoff),
        Moment::new(Situation::Flying, Phase::Cruise),
        Moment::new(Situation::Flying, Phase::Waiting),
        Moment::new(Situation::Flying, Phase::InsideArea),
        Moment::new(Situation::Flying, Phase::Landing),
    ];

    const fn new(situation: Situation, phase: Phase) -> Moment {
        Moment { situation, phase }
    }

    /// Whether a row begins to respond.
    pub fn counts(self, row: &Row) -> bool {
        row.situations.contains(&self.situation) && row.phases.contains(&self.phase)
    }
}

/// A row whose flag is up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Raised {
    /// Its place in the table.
    pub row: usize,
    /// An operator ordered it with override.
    pub overrides: bool,
    /// It was up, and the operator knew that, at the last order with override.
    pub is_overridden: bool,
    /// The severity of the action that its response has reached, if the response is under way.
    pub under_way: Option<Severity>,
}

/// The row that responds: of the rows that count at this moment, one of safety before one of comfort; of those, the one with the most
/// severe response; of equally severe ones, the one that is higher in the table ([`Row::order`]). A response that is under way counts at every moment, with the
/// severity of its present action if that is higher than that of its first one. An order with override counts in every phase. It comes before all
/// rows that were up when it was given and may be overridden, and before what is no more severe in their groups; whatever
/// else rises later is answered as ever.
///
/// So a hold never delays a landing, and never interrupts one. A row that only slows the vehicle responds never: it is in force beside
/// whatever is flown ([`super::narrowing`]).
pub fn responder(rows: &[Row], raised: impl IntoIterator<Item = Raised> + Clone, moment: Moment) -> Option<usize> {
    let is_ordered = raised.clone().into_iter().any(|it| it.overrides);
    let known = || raised.clone().into_iter().filter(|it| it.is_overridden).filter_map(|it| rows.get(it.row));
    // The most severe one that was known in each group, found once: a table may have many rows, and all of them may be up.
    let mut most: BTreeMap<Group, Severity> = BTreeMap::new();
    for (group, row) in known().filter(|_| is_ordered).filter_map(|row| Some((row.group?, row))) {
        let severity = most.entry(group).or_insert(row.severity());
        *severity = row.severity().max(*severity);
    }
    let is_known = |it: Raised, row: &Row| {
        let in_group = || row.group.and_then(|group| most.get(&group)).is_some_and(|known| row.severity() <= *known);
        it.is_overridden || in_group()
    };
    let rank = |it: Raised| {
        let row = rows.get(it.row).filter(|row| !row.only_slows())?;
        let is_ordered_now = it.overrides && row.situations.contains(&moment.situation);
        let counts = it.under_way.is_some() || is_ordered_now || moment.counts(row);
        let gives_way = is_ordered && row.may_be_overridden() && !it.overrides && is_known(it, row);
        let severity = it.under_way.map_or(row.severity(), |reached| reached.max(row.severity()));
        (counts && !gives_way).then_some((row.order(severity), it.row))
    };
    raised.clone().into_iter().filter_map(rank).max().map(|(_, row)| row)
}

#[cfg(test)]
pub(super) mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::super::alarm::Alarm;
    use super::super::group::Group;
    use super::super::label::Label;
    use super::super::{Action, Clears, Then};
    use super::*;
    use Severity::{Divert, Hold, Land, Leave, Return};

    pub(crate) fn row(priority: u32, severity: Severity, phases: &[Phase]) -> Row {
        let action = Action { tree: "t".into(), severity, tries: 1, needs: BTreeSet::new() };
        Row {
            flag: format!("flag_{priority}"),
            priority,
            group: None,
            when: None,
            phases: phases.iter().copied().collect(),
            situations: Situation::ALL.into_iter().collect(),
            actions: vec![action],
            narrows: BTreeSet::new(),
            clears: Clears::AfterAction,
            then: Then::Resume,
            label: Label::Safety,
            alarm: Alarm::Caution,
            explained_by: BTreeSet::new(),
            source: None,
        }
    }

    pub(crate) fn up(row: usize) -> Raised {
        Raised { row, overrides: false, is_overridden: false, under_way: None }
    }

    /// In the air in this phase.
    pub(crate) fn at(phase: Phase) -> Moment {
        Moment { situation: Situation::Flying, phase }
    }

    #[test]
    fn the_most_severe_response_is_flown() {
        let all = Phase::ALL;
        let rows = [
            row(10, Land, &all),
            row(12, Hold, &all),
            row(22, Return, &all),
            row(52, Hold, &[Phase::Cruise, Phase::Waiting]),
            row(55, Leave, &all),
            row(80, Land, &all),
        ];
        #[track_caller]
        fn check(rows: &[Row], raised: &[Raised], phase: Phase, expected: Option<u32>) {
            let found = responder(rows, raised.iter().copied(), at(phase)).map(|it| rows[it].priority);
            assert_eq!(found, expected, "{raised:?} {phase:?}");
        }
        let cruise = Phase::Cruise;
        check(&rows, &[], cruise, None);
        check(&rows, &[up(1), up(2)], cruise, Some(22));
        check(&rows, &[up(2), up(5)], cruise, Some(80));
        check(&rows, &[up(0), up(5)], cruise, Some(10));
        check(&rows, &[up(1), up(3)], cruise, Some(12));
        check(&rows, &[up(3), up(4)], cruise, Some(55));
        // Who diverts does not insist on going home.
        let [home, divert] = [row(10, Return, &all), row(12, Divert, &all)];
        check(&[home, divert], &[up(0), up(1)], cruise, Some(12));
        // It does not count while landing, unless it responds already.
        check(&rows, &[up(3)], Phase::Landing, None);
        check(&rows, &[Raised { under_way: Some(Hold), ..up(3) }], Phase::Landing, Some(52));
        // A return that has come to its landing is as severe as a landing.
        check(&rows, &[Raised { under_way: Some(Land), ..up(2) }, up(5)], cruise, Some(22));
        check(&rows, &[Raised { under_way: Some(Return), ..up(2) }, up(5)], cruise, Some(80));
        // An order with override comes before what was up when it was given.
        let ordered = Raised { overrides: true, ..up(1) };
        let known = |row| Raised { is_overridden: true, ..up(row) };
        check(&rows, &[known(0), ordered], cruise, Some(12));
        check(&rows, &[known(0), up(2), ordered], cruise, Some(22));
        check(&rows, &[up(0), ordered], cruise, Some(10));
        check(&rows, &[known(0)], cruise, Some(10));
        let mut of_one_group = rows.clone();
        (of_one_group[0].group, of_one_group[2].group) = (Some(Group::Energy), Some(Group::Energy));
        check(&of_one_group, &[known(0), up(2), ordered], cruise, Some(12));
        check(&of_one_group, &[known(2), up(0), ordered], cruise, Some(10));
        let mut rows = rows;
        rows[0].label = Label::Binding;
        check(&rows, &[known(0), ordered], cruise, Some(10));
        check(&rows, &[known(2), ordered], cruise, Some(12));
    }

    #[test]
    fn comfort_waits_behind_safety_whatever_its_priority() {
        let comfort = Row { label: Label::Comfort, ..row(1, Hold, &[Phase::Cruise]) };
        let rows = [comfort, row(80, Hold, &[Phase::Cruise]), row(90, Land, &Phase::ALL)];
        #[track_caller]
        fn check(rows: &[Row], raised: &[Raised], expected: usize) {
            assert_eq!(responder(rows, raised.iter().copied(), at(Phase::Cruise)), Some(expected), "{raised:?}");
        }
        let under_way = Raised { under_way: Some(Hold), ..up(0) };
        check(&rows, &[up(0)], 0);
        check(&rows, &[up(0), up(1)], 1);
        check(&rows, &[under_way, up(1)], 1);
        check(&rows, &[under_way, up(1), up(2)], 2);
    }

    fn severity() -> impl Strategy<Value = Severity> {
        // One that slows never responds: it has a test of its own.
        prop::sample::select(Severity::ALL.into_iter().filter(|it| *it != Severity::Slow).collect::<Vec<_>>())
    }

    proptest! {
        /// For all combinations: the row that responds is up and counts, no row that counts is more severe, and one
        /// more flag never makes the response less severe.
        #[test]
        fn nothing_less_severe_is_flown_than_what_is_asked_for(
            severities in prop::collection::vec(severity(), 1..8),
            raised in any::<u8>(),
            another in 0..8usize,
        ) {
            let row = |(index, severity): (usize, &Severity)| row(index as u32, *severity, &Phase::ALL);
            let rows: Vec<Row> = severities.iter().enumerate().map(row).collect();
            let of = |bits: u8| (0..rows.len()).filter(move |it| bits >> it & 1 == 1).map(up);
            let chosen = responder(&rows, of(raised), at(Phase::Cruise));
            prop_assert_eq!(chosen.is_some(), of(raised).next().is_some());
            if let Some(chosen) = chosen {
                prop_assert!(of(raised).any(|it| it.row == chosen));
                prop_assert!(of(raised).all(|it| rows[it.row].severity() <= rows[chosen].severity()));
                let more = responder(&rows, of(raised | 1 << another), at(Phase::Cruise)).unwrap_or(chosen);
                prop_assert!(rows[chosen].severity() <= rows[more].severity());
            }
        }
    }
}
