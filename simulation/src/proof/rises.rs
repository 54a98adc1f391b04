//! What each expression comes to over all that its sources can say: whether its flag rises, whether each of its fields decides anything,
//! whether it would fall while it is raised, and whether its row ever responds.
//!
//! A pure function of the table, which evaluates the expressions; it does not matter how they are written.

use std::collections::BTreeMap;

use domain::contingency::expression::{Expression, Verdict};
use domain::contingency::hazard::reach::{Reach, may_be_missing, reach, well};
use domain::contingency::narrowing::{Narrows, narrowing};
use domain::contingency::snapshot::{Field, Kind, Snapshot};
use domain::contingency::when::{During, Finding, When};
use domain::contingency::{Clears, Contingencies, Phase, Raised, Row, Severity, responder};

use super::hazards::{moments, up};
use super::review::{Place, Remark};

/// Values of a field that are tried, by the number of fields of an expression.
const POINTS: [usize; 5] = [60, 60, 16, 8, 5];
/// How often the border between two neighbours is halved, of which one holds.
const HALVINGS: usize = 40;
/// How many of the values that raise a flag are tried beside all other rows.
const TRIED: usize = 200;
/// Beside a threshold, relative to the threshold.
const BESIDE: f64 = 1e-6;

/// What is wrong with the row of this number.
pub(super) fn of_row(rows: &[Row], number: usize) -> Vec<Remark> {
    let row = &rows[number];
    let Some(when) = &row.when else { return Vec::new() };
    let remark = |what: String, help| Remark { place: Place::Row(row.flag.clone()), what, help };
    let grid = Grid::of(when);
    let mut remarks: Vec<Remark> =
        is_wrong_while_all_is_well(row, when).map(|(what, help)| remark(what, help)).into_iter().collect();
    let raised = grid.raised();
    if raised.is_empty() {
        let what =
            format!("`{}` never rises: nothing that its sources can say raises it ({})", row.flag, grid.limits());
        remarks.push(remark(what, "choose a threshold that is reached"));
        return remarks;
    }
    if let Some(field) = grid.idle_field() {
        let what = format!("`{}`: {} decides nothing within {}", row.flag, field.name(), limits(field));
        remarks.push(remark(what, "choose a threshold that is reached, or leave the field out"));
    }
    if let Some(at) = grid.falls_while_raised(when) {
        let what = format!("`{}` would fall while what raises it holds: at {at}", row.flag);
        remarks.push(remark(what, "`clear_when` lies at the threshold of `when` or on its safe side"));
    }
    if let Some(other) = hidden_by(rows, number, &raised) {
        let what = format!(
            "`{}` never responds: whenever its flag is up, so is `{}`, which comes before it in each of its phases",
            row.flag, rows[other].flag
        );
        remarks.push(remark(
            what,
            "give the row that is raised later the more severe response, or the more urgent priority",
        ));
    }
    remarks
}

/// A flag that is up, or stays up, while all is well; or falls while it is not.
fn is_wrong_while_all_is_well(row: &Row, when: &When) -> Option<(String, &'static str)> {
    let (flag, text) = (&row.flag, when.raises.text());
    for in_air in [false, true].into_iter().filter(|it| counts(when, *it)) {
        let place = if in_air { "in the air" } else { "on the ground" };
        let (all, mut least) = (well(in_air), well(in_air));
        Field::ALL.iter().copied().filter(|it| may_be_missing(*it)).for_each(|it| least.set(it, None));
        match (when.finding(&all), when.finding(&least)) {
            (Finding::Raises, _) => {
                let what = format!("`{flag}` is up while all is well, {place}: `{text}` holds");
                return Some((what, "look at the direction of its comparison, and at its threshold"));
            }
            (_, Finding::Unknown(Some(field))) => {
                let what =
                    format!("`{flag}` is up {place} where nothing says {}, which may never be said", field.name());
                return Some((what, "ask `known(..)` first"));
            }
            (Finding::Between, _) => {
                let what = format!("`{flag}` stays up {place} although all is well again: `clear_when` does not hold");
                return Some((what, "choose a `clear_when` that holds while all is well"));
            }
            _ => {}
        }
    }
    (row.clears == Clears::AfterAction).then(|| {
        let what = format!("`{flag}` falls after its response, although `{text}` still holds");
        (what, "set `clears = \"with-condition\"` or `\"never\"`")
    })
}

fn counts(when: &When, in_air: bool) -> bool {
    when.during.applies(&well(in_air)) == Some(true)
}

/// What the sources of an expression can say, point by point.
struct Grid<'a> {
    raises: &'a Expression,
    axes: Vec<(Field, Vec<Option<f64>>)>,
    /// All being well otherwise: on the ground, in the air, as far as the row counts there.
    bases: Vec<Snapshot>,
}

impl Grid<'_> {
    fn of(when: &When) -> Grid<'_> {
        let mut fields: Vec<Field> = when.fields().to_vec();
        for field in when.clears.iter().flat_map(|it| it.fields()) {
            if !fields.contains(field) {
                fields.push(*field);
            }
        }
        // Where the vehicle is is said by the base.
        fields.retain(|it| !matches!(it, Field::Armed | Field::Flying));
        let points = POINTS[fields.len().min(POINTS.len() - 1)];
        let axis = |field: Field| (field, values(field, when, points));
        let bases = [false, true].into_iter().filter(|it| counts(when, *it)).map(well).collect();
        Grid { raises: &when.raises, axes: fields.into_iter().map(axis).collect(), bases }
    }

    /// All points, each with its place on every axis.
    fn points(&self) -> impl Iterator<Item = (usize, Snapshot)> + '_ {
        let size: usize = self.axes.iter().map(|(_, values)| values.len()).product();
        self.bases.iter().flat_map(move |base| (0..size).map(move |at| (at, self.point(base, at))))
    }

    fn point(&self, base: &Snapshot, at: usize) -> Snapshot {
        let (mut snapshot, mut rest) = (*base, at);
        for (field, values) in &self.axes {
            snapshot.set(*field, values[rest % values.len()]);
            rest /= values.len();
        }
        snapshot
    }

    fn raised(&self) -> Vec<Snapshot> {
        let holds = |it: &Snapshot| self.raises.verdict(it) == Verdict::Holds;
        self.points().map(|(_, it)| it).filter(holds).collect()
    }

    /// Each point and its neighbour on the axis of `field`.
    fn neighbours(&self, axis: usize) -> impl Iterator<Item = (Snapshot, Snapshot)> + '_ {
        let stride: usize = self.axes[..axis].iter().map(|(_, values)| values.len()).product();
        let (field, values) = &self.axes[axis];
        self.points().filter_map(move |(at, point)| {
            let next = values.get(at / stride % values.len() + 1)?;
            let mut other = point;
            other.set(*field, *next);
            Some((point, other))
        })
    }

    /// A field of which no value makes a difference.
    fn idle_field(&self) -> Option<Field> {
        let decides = |axis: usize| {
            self.neighbours(axis).any(|(a, b)| {
                let (a, b) = (self.raises.verdict(&a), self.raises.verdict(&b));
                matches!((a, b), (Verdict::Holds, Verdict::DoesNotHold) | (Verdict::DoesNotHold, Verdict::Holds))
            })
        };
        let read = |axis: &usize| self.raises.fields().contains(&self.axes[*axis].0);
        (0..self.axes.len()).filter(read).find(|it| !decides(*it)).map(|it| self.axes[it].0)
    }

    /// What is measured where both expressions hold, if that can be.
    fn falls_while_raised(&self, when: &When) -> Option<String> {
        let clears = when.clears.as_ref()?;
        let both = |it: &Snapshot| self.raises.verdict(it) == Verdict::Holds && clears.verdict(it) == Verdict::Holds;
        let border = |axis: usize| {
            self.neighbours(axis).filter_map(move |(a, b)| {
                let is_border = self.raises.verdict(&a) != self.raises.verdict(&b);
                is_border.then(|| self.border(self.axes[axis].0, a, b))
            })
        };
        let borders = (0..self.axes.len()).flat_map(border);
        let found = self.points().map(|(_, it)| it).chain(borders).find(both)?;
        let value = |(field, _): &(Field, _)| {
            let value = found.get(*field).map_or_else(|| "unknown".to_owned(), |it| field.in_words(it));
            format!("{} {value}", field.name())
        };
        Some(self.axes.iter().map(value).collect::<Vec<_>>().join(", "))
    }

    /// Where on the way from one to the other the expression still holds, as near to the border as numbers tell.
    fn border(&self, field: Field, a: Snapshot, b: Snapshot) -> Snapshot {
        let holds = |it: &Snapshot| self.raises.verdict(it) == Verdict::Holds;
        let (mut inside, mut outside) = if holds(&a) { (a, b) } else { (b, a) };
        for _ in 0..HALVINGS {
            let (Some(one), Some(other)) = (inside.get(field), outside.get(field)) else { break };
            let mut middle = inside;
            middle.set(field, Some((one + other) / 2.0));
            if holds(&middle) { inside = middle } else { outside = middle }
        }
        inside
    }

    fn limits(&self) -> String {
        let of = |(field, _): &(Field, _)| format!("{} {}", field.name(), limits(*field));
        self.axes.iter().map(of).collect::<Vec<_>>().join(", ")
    }
}

fn limits(field: Field) -> String {
    let Reach { lowest, highest, .. } = reach(field);
    format!("{} to {}", field.in_words(lowest), field.in_words(highest))
}

/// Values of a field, in their order: evenly, closer together at its low end, and beside each constant that it is compared with.
fn values(field: Field, when: &When, points: usize) -> Vec<Option<f64>> {
    let Reach { on_ground, in_air, lowest, highest, .. } = reach(field);
    let mut values: Vec<f64> = match field.kind() {
        Kind::Choice(names) => (0..names.len()).map(|it| it as f64).collect(),
        Kind::Number { .. } => {
            let share = |it: usize| it as f64 / points as f64;
            let even = (0..=points).map(|it| lowest + (highest - lowest) * share(it));
            let close = (0..=points).map(|it| lowest + (highest - lowest) * share(it).powi(4));
            let thresholds =
                when.raises.thresholds().into_iter().chain(when.clears.iter().flat_map(Expression::thresholds));
            let constants = thresholds.filter(|it| it.field == field).map(|it| it.value);
            let beside =
                constants.flat_map(|it| [it, it - it.abs().max(1.0) * BESIDE, it + it.abs().max(1.0) * BESIDE]);
            even.chain(close).chain(beside).chain([on_ground, in_air]).collect()
        }
    };
    values.retain(|it| lowest <= *it && *it <= highest);
    values.sort_by(f64::total_cmp);
    values.dedup();
    values.into_iter().map(Some).chain([None]).collect()
}

/// The row that responds whenever this one's flag is up, of which nothing is seen then.
fn hidden_by(rows: &[Row], number: usize, raised: &[Snapshot]) -> Option<usize> {
    let (row, when) = (&rows[number], rows[number].when.as_ref()?);
    // One that holds may be there to be shown, and for what it narrows.
    let is_shown_only =
        row.severity() == Severity::Hold && when.during == During::Flying && row.phases.iter().eq([&Phase::OnGround]);
    if is_shown_only {
        return None;
    }
    let mut before: BTreeMap<usize, usize> = BTreeMap::new();
    let mut tried = 0;
    for snapshot in raised.iter().step_by(raised.len().div_ceil(TRIED)) {
        let raised: Vec<Raised> = (0..rows.len()).filter(|it| is_up(&rows[*it], when, snapshot)).map(up).collect();
        let is_there = |phase: &Phase| (*phase != Phase::OnGround) == (snapshot.get(Field::Flying) == Some(1.0));
        for moment in Phase::ALL.into_iter().filter(is_there).flat_map(moments) {
            let narrowing = narrowing(rows, raised.iter().copied(), moment.phase);
            if Narrows::ALL.iter().any(|it| narrowing.by(*it) == Some(number)) {
                return None;
            }
            if responder(rows, raised.iter().copied(), moment) == Some(number) {
                return None;
            }
            if !moment.counts(row) {
                continue;
            }
            tried += 1;
            let comes_before = |it: &usize| {
                let other = &rows[*it];
                moment.counts(other) && !other.only_slows() && row.order(row.severity()) < other.order(other.severity())
            };
            for other in raised.iter().map(|it| it.row).filter(comes_before) {
                *before.entry(other).or_default() += 1;
            }
        }
    }
    // One that is always up, or else the one that is so most often.
    let always = before.iter().filter(|(_, times)| **times == tried).map(|(other, _)| *other).next_back();
    always.or_else(|| before.iter().max_by_key(|(_, times)| **times).map(|(other, _)| *other))
}

/// Whether another row is up at the moment at which the one with `own` rises.
fn is_up(row: &Row, own: &When, snapshot: &Snapshot) -> bool {
    row.when.as_ref().is_some_and(|it| {
        it.hold <= own.hold && it.during.applies(snapshot) == Some(true) && it.finding(snapshot) == Finding::Raises
    })
}

/// What is wrong with any row.
pub(super) fn of_all(table: &Contingencies) -> Vec<Remark> {
    let rows = table.rows();
    (0..rows.len()).flat_map(|number| of_row(rows, number)).collect()
}
