//! What is forbidden while a flag is up, whatever is flown: the nominal flight, the response of another row, or nothing.
//!
//! Responses exclude each other, so that the most severe one is flown alone ([`super::responder`]). What is narrowed adds up.

use serde::Deserialize;

use super::{Phase, Raised, Row};

/// What a row forbids.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Narrows {
    /// To enter an area in which the vehicle is not already.
    NoNewArea,
    /// To land where the vehicle was when the flag rose.
    NoLandingHere,
    /// To fly faster than the configured speed for that.
    Slow,
}

impl Narrows {
    /// Everything that can be narrowed.
    pub const ALL: [Narrows; 3] = [Narrows::NoNewArea, Narrows::NoLandingHere, Narrows::Slow];

    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Narrows::NoNewArea => "no-new-area",
            Narrows::NoLandingHere => "no-landing-here",
            Narrows::Slow => "slow",
        }
    }
}

/// What is narrowed now, each by the number of the most urgent row that asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Narrowing {
    /// No area is entered in which the vehicle is not already.
    pub no_new_area: Option<usize>,
    /// No landing where the vehicle was when the flag rose.
    pub no_landing_here: Option<usize>,
    /// No faster than the configured speed for that.
    pub slow: Option<usize>,
}

impl Narrowing {
    /// The row that asks for it, if one does.
    pub fn by(self, what: Narrows) -> Option<usize> {
        match what {
            Narrows::NoNewArea => self.no_new_area,
            Narrows::NoLandingHere => self.no_landing_here,
            Narrows::Slow => self.slow,
        }
    }

    fn add(&mut self, what: Narrows, row: usize) {
        let by = match what {
            Narrows::NoNewArea => &mut self.no_new_area,
            Narrows::NoLandingHere => &mut self.no_landing_here,
            Narrows::Slow => &mut self.slow,
        };
        by.get_or_insert(row);
    }
}

/// What the rows whose flags are up narrow together; `raised` has the most urgent row first. What a row narrows counts in every phase,
/// as long as its flag is up: so a caution that is answered on the ground only can narrow a flight without interrupting it. A row
/// that does nothing but slow does so in its phases. An operator who overrides a flag overrides what it narrows.
pub fn narrowing(rows: &[Row], raised: impl IntoIterator<Item = Raised> + Clone, phase: Phase) -> Narrowing {
    let is_ordered = raised.clone().into_iter().any(|it| it.overrides);
    let mut narrowing = Narrowing::default();
    for it in raised {
        let Some(row) = rows.get(it.row) else { continue };
        if is_ordered && it.is_overridden && row.may_be_overridden() && !it.overrides {
            continue;
        }
        row.narrows.iter().for_each(|what| narrowing.add(*what, it.row));
        if row.only_slows() && row.phases.contains(&phase) {
            narrowing.add(Narrows::Slow, it.row);
        }
    }
    narrowing
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::arbitration::tests::{at, row, up};
    use super::super::label::Label;
    use super::super::{Severity, responder};
    use super::*;
    use Narrows::{NoLandingHere, NoNewArea, Slow};

    fn narrowing_row(priority: u32, severity: Severity, narrows: &[Narrows], phases: &[Phase]) -> Row {
        Row { narrows: narrows.iter().copied().collect(), ..row(priority, severity, phases) }
    }

    #[test]
    fn what_the_rows_narrow_adds_up_whichever_of_them_responds() {
        let ground = [Phase::OnGround];
        let rows = [
            narrowing_row(1, Severity::Land, &[], &Phase::ALL),
            narrowing_row(2, Severity::Hold, &[NoNewArea, Slow], &ground),
            narrowing_row(3, Severity::Hold, &[NoNewArea, NoLandingHere], &Phase::ALL),
            narrowing_row(4, Severity::Slow, &[], &[Phase::Cruise]),
        ];
        #[track_caller]
        fn check(rows: &[Row], raised: &[Raised], phase: Phase, expected: [Option<usize>; 3]) {
            let found = narrowing(rows, raised.iter().copied(), phase);
            assert_eq!(Narrows::ALL.map(|what| found.by(what)), expected, "{raised:?} {phase:?}");
        }
        let cruise = Phase::Cruise;
        check(&rows, &[], cruise, [None; 3]);
        check(&rows, &[up(0)], cruise, [None; 3]);
        // It does not count in this phase, and narrows all the same.
        check(&rows, &[up(1)], cruise, [Some(1), None, Some(1)]);
        // Of two that ask for the same the more urgent one is named, and a more severe one beside them changes nothing.
        check(&rows, &[up(0), up(1), up(2)], cruise, [Some(1), Some(2), Some(1)]);
        // Who does nothing but slow does so in its phases.
        check(&rows, &[up(2), up(3)], cruise, [Some(2), Some(2), Some(3)]);
        check(&rows, &[up(3)], Phase::Waiting, [None; 3]);
        // What an operator overrides narrows nothing; what rose after the order does.
        let known = |row| Raised { is_overridden: true, ..up(row) };
        let ordered = Raised { overrides: true, ..up(0) };
        check(&rows, &[ordered, known(1), up(2)], cruise, [Some(2), Some(2), None]);
        let mut rows = rows;
        rows[1].label = Label::Binding;
        check(&rows, &[ordered, known(1)], cruise, [Some(1), None, Some(1)]);
    }

    #[test]
    fn a_row_that_only_slows_never_responds_and_keeps_no_other_from_it() {
        let rows = [row(1, Severity::Slow, &Phase::ALL), row(2, Severity::Hold, &Phase::ALL)];
        assert_eq!(responder(&rows, [up(0)], at(Phase::Cruise)), None);
        assert_eq!(responder(&rows, [up(0), up(1)], at(Phase::Cruise)), Some(1));
        assert_eq!(narrowing(&rows, [up(0), up(1)], Phase::Cruise).slow, Some(0));
    }

    proptest! {
        /// One more flag never takes away what is narrowed.
        #[test]
        fn one_more_flag_never_widens(
            narrows in prop::collection::vec(prop::sample::subsequence(Narrows::ALL.to_vec(), 0..=3), 1..8),
            raised in any::<u8>(),
            another in 0..8usize,
        ) {
            let row = |(index, narrows): (usize, &Vec<Narrows>)| {
                narrowing_row(index as u32, Severity::Hold, narrows, &Phase::ALL)
            };
            let rows: Vec<Row> = narrows.iter().enumerate().map(row).collect();
            let of = |bits: u8| (0..rows.len()).filter(move |it| bits >> it & 1 == 1).map(up);
            let (less, more) = (narrowing(&rows, of(raised), Phase::Cruise), narrowing(&rows, of(raised | 1 << another), Phase::Cruise));
            for what in Narrows::ALL {
                prop_assert!(less.by(what).is_none() || more.by(what).is_some());
                prop_assert_eq!(less.by(what).is_some(), of(raised).any(|it| rows[it.row].narrows.contains(&what)));
            }
        }
    }
}
