//! Whether each hazard is answered: in each phase by a row whose response fits, within the time that the hazard leaves.
//!
//! A pure function of the table. The expressions are evaluated over what would be measured, all else being well, and the row that responds
//! is that of the function which the mission manager asks.

use std::collections::{BTreeMap, BTreeSet};

use domain::contingency::alarm::Alarm;
use domain::contingency::hazard::reach::{reach, well};
use domain::contingency::hazard::{Answer, HAZARDS, Hazard, Sign};
use domain::contingency::narrowing::narrowing;
use domain::contingency::snapshot::{Field, Snapshot};
use domain::contingency::when::Finding;
use domain::contingency::{Contingencies, Moment, Phase, Raised, Row, responder};
use domain::situation::Situation;

use super::review::{Place, Remark};

/// How finely it is looked where a row begins to be raised, on the way from what is well to the hazard.
const STEPS: u32 = 400;
/// The steps beyond it grow, up to three thousand times as far.
const GROWTH: f64 = 1.02;

/// Every hazard without its answer, every row that is raised too late for one, and every waiver of one that is answered.
pub(super) fn unanswered(table: &Contingencies) -> Vec<Remark> {
    let mut remarks: Vec<Remark> = HAZARDS.iter().flat_map(|hazard| of_hazard(table, hazard)).collect();
    for remark in HAZARDS.iter().flat_map(|hazard| late(table, hazard)) {
        // Of one row once.
        if remarks.iter().all(|it| it.place != remark.place) {
            remarks.push(remark);
        }
    }
    for waiver in table.waivers() {
        let Some(phase) = waiver.phases.iter().find(|it| is_answered_in(table.rows(), waiver.hazard, **it)) else {
            continue;
        };
        remarks.push(Remark {
            place: Place::Waiver(waiver.hazard.name),
            what: format!("`{}` is waived {phase}, and answered there", waiver.hazard.name),
            help: "take the phase, or the waiver, out",
        });
    }
    remarks
}

fn of_hazard(table: &Contingencies, hazard: &'static Hazard) -> Vec<Remark> {
    let rows = table.rows();
    // Phases with the same to say are one remark.
    let mut found: BTreeMap<(Place, String, String), Vec<Phase>> = BTreeMap::new();
    for phase in Phase::ALL.into_iter().filter(|it| !is_waived(table, hazard, *it)) {
        let Some(answer) = hazard.calls_for(phase) else { continue };
        let Some(moment) = moments(phase).find(|it| !is_answered(rows, hazard, answer, *it)) else { continue };
        let mut found = |place, why| found.entry((place, answer.to_string(), why)).or_default().push(phase);
        let suspects = suspects(rows, hazard, answer, moment);
        let nobody = if suspects.iter().any(|it| fits(&rows[it.row], answer)) { "" } else { "no row answers so; " };
        for Suspect { row, why, .. } in &suspects {
            found(Place::Row(rows[*row].flag.clone()), format!("{nobody}`{}` {why}", rows[*row].flag));
        }
        if suspects.is_empty() {
            found(Place::Table, "no row is about it".to_owned());
        }
    }
    let remark = |((place, answer, why), phases): ((Place, String, String), Vec<Phase>)| {
        let Hazard { name, sign, within_s, .. } = hazard;
        let phases = phases.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        Remark {
            place,
            what: format!("hazard `{name}` ({sign}) calls for {answer} within {within_s} s {phases}: {why}"),
            help: "mend the row, add one, or write a [[waiver]] with its reason",
        }
    };
    found.into_iter().map(remark).collect()
}

/// Rows that are raised later than a hazard leaves time for, also where another one answers it.
fn late(table: &Contingencies, hazard: &Hazard) -> Vec<Remark> {
    let phases = Phase::ALL.into_iter().filter(|it| hazard.calls_for(*it).is_some() && !is_waived(table, hazard, *it));
    let Some(moment) = phases.flat_map(moments).last() else { return Vec::new() };
    let seen = seen(hazard.sign, moment, 1.0);
    let is_late = |row: &&Row| is_about(row, hazard) && holds(row, hazard, &seen) && !is_up(row, hazard, &seen);
    let remark = |row: &Row| {
        let hold_s = row.when.as_ref().map_or(0.0, |it| it.hold.as_secs_f64());
        let Hazard { name, sign, within_s, .. } = hazard;
        Remark {
            place: Place::Row(row.flag.clone()),
            what: format!(
                "`{}` is raised after {hold_s} s, and hazard `{name}` ({sign}) leaves {within_s} s",
                row.flag
            ),
            help: "set a shorter `for_s`",
        }
    };
    table.rows().iter().filter(is_late).map(remark).collect()
}

fn is_waived(table: &Contingencies, hazard: &Hazard, phase: Phase) -> bool {
    table.waivers().iter().any(|it| it.hazard == hazard && it.phases.contains(&phase))
}

/// What each hazard is answered by, as humans read it, under [`HEADINGS`].
pub fn answers(table: &Contingencies) -> Vec<Vec<String>> {
    let joined = |phases: &[Phase]| phases.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let of_hazard = |hazard: &'static Hazard| {
        let of_group = move |(phases, answer): &(&[Phase], Answer)| {
            let by: BTreeSet<String> = phases.iter().map(|it| answered_by(table, hazard, *answer, *it)).collect();
            let within = format!("{} s", hazard.within_s);
            let by = by.into_iter().collect::<Vec<_>>().join("; ");
            let texts =
                [hazard.sign.to_string(), within, joined(phases), answer.to_string(), by, hazard.source.to_owned()];
            std::iter::once(format!("`{}`", hazard.name)).chain(texts).collect::<Vec<_>>()
        };
        hazard.calls_for.iter().map(of_group).collect::<Vec<_>>()
    };
    HAZARDS.iter().flat_map(of_hazard).collect()
}

/// What the columns of [`answers`] say.
pub const HEADINGS: [&str; 7] =
    ["hazard", "shown by", "within", "in which phases", "calls for", "answered by", "source"];

/// The row that answers it in this phase, its waiver, or nothing.
fn answered_by(table: &Contingencies, hazard: &Hazard, answer: Answer, phase: Phase) -> String {
    let rows = table.rows();
    if let Some(waiver) = table.waivers().iter().find(|it| it.hazard == hazard && it.phases.contains(&phase)) {
        return format!("waived: {}", waiver.reason);
    }
    let Some(moment) = moments(phase).last() else { return String::new() };
    let raised = raised(rows, hazard, moment);
    let row = match (answer, responder(rows, raised.clone(), moment)) {
        (Answer::Told, _) => raised.clone().find(|it| is_about(&rows[it.row], hazard)).map(|it| it.row),
        (Answer::Narrowed(what), None) => narrowing(rows, raised, phase).by(what),
        (_, responds) => responds,
    };
    row.map_or_else(|| "nothing".to_owned(), |row| format!("`{}`", rows[row].flag))
}

/// The rows whose flags are up when the hazard's time is over.
fn raised<'a>(rows: &'a [Row], hazard: &'a Hazard, moment: Moment) -> impl Iterator<Item = Raised> + Clone + 'a {
    let seen = seen(hazard.sign, moment, 1.0);
    rows.iter().enumerate().filter(move |(_, row)| is_up(row, hazard, &seen)).map(|(number, _)| up(number))
}

/// The moments of this phase in which any row begins to respond.
pub(super) fn moments(phase: Phase) -> impl Iterator<Item = Moment> {
    let begins = |it: &Situation| matches!(it, Situation::Standing | Situation::LiftingOff | Situation::Flying);
    Moment::ALL.into_iter().filter(move |it| it.phase == phase && begins(&it.situation))
}

pub(super) fn up(row: usize) -> Raised {
    Raised { row, overrides: false, is_overridden: false, under_way: None }
}

fn is_answered_in(rows: &[Row], hazard: &Hazard, phase: Phase) -> bool {
    hazard.calls_for(phase).is_none_or(|answer| moments(phase).all(|it| is_answered(rows, hazard, answer, it)))
}

fn is_answered(rows: &[Row], hazard: &Hazard, answer: Answer, moment: Moment) -> bool {
    let mut raised = raised(rows, hazard, moment);
    let responds = responder(rows, raised.clone(), moment);
    match answer {
        Answer::Told => raised.any(|it| is_about(&rows[it.row], hazard)),
        Answer::Narrowed(what) => responds.is_some() || narrowing(rows, raised, moment.phase).by(what).is_some(),
        Answer::Response(severities) => responds.is_some_and(|row| {
            severities.contains(&rows[row].severity())
                && (!calls_for_a_human(hazard, moment) || raised.any(|it| calls(rows, hazard, moment, it)))
        }),
    }
}

/// Whether people must look: not at what they have ordered or the manager tells them anyway, nor before a takeoff.
fn calls_for_a_human(hazard: &Hazard, moment: Moment) -> bool {
    matches!(hazard.sign, Sign::Fields(_)) && moment.phase != Phase::OnGround
}

/// Whether a row whose flag is up calls for a human, beside the others that are up.
fn calls(rows: &[Row], hazard: &Hazard, moment: Moment, it: Raised) -> bool {
    let is_up = |flag: &str| raised(rows, hazard, moment).any(|it| rows[it.row].flag == flag);
    Alarm::Caution <= rows[it.row].alarm_beside(is_up)
}

/// What is measured, of the way from all being well (0) to the hazard (1).
fn seen(sign: Sign, moment: Moment, share: f64) -> Snapshot {
    let mut snapshot = well(moment.phase != Phase::OnGround);
    if let Sign::Fields(fields) = sign {
        for (field, level) in fields {
            let (before, reach) = (snapshot.get(*field).unwrap_or_default(), reach(*field));
            let value = before + (level - before) * share;
            snapshot.set(*field, Some(value.clamp(reach.lowest, reach.highest)));
        }
    }
    snapshot
}

fn is_up(row: &Row, hazard: &Hazard, seen: &Snapshot) -> bool {
    holds(row, hazard, seen) && row.when.as_ref().is_none_or(|it| it.hold.as_secs_f64() <= hazard.within_s)
}

/// Whether its expression holds, where it counts, or the mission manager raises it.
fn holds(row: &Row, hazard: &Hazard, seen: &Snapshot) -> bool {
    let by_expression = row.when.as_ref().is_some_and(|when| {
        let raises = matches!(when.finding(seen), Finding::Raises | Finding::Unknown(_));
        raises && when.during.applies(seen) == Some(true)
    });
    by_expression || hazard.sign == Sign::Flag(flag_of(row, hazard))
}

/// The row's flag, if it is that of the hazard.
fn flag_of(row: &Row, hazard: &Hazard) -> &'static str {
    match hazard.sign {
        Sign::Flag(flag) if flag == row.flag => flag,
        _ => "",
    }
}

pub(super) fn is_about(row: &Row, hazard: &Hazard) -> bool {
    let reads = |field: &Field| row.when.as_ref().is_some_and(|it| it.fields().contains(field));
    match hazard.sign {
        Sign::Fields(fields) => fields.iter().any(|(field, _)| reads(field)),
        Sign::Flag(flag) => row.flag == flag,
    }
}

/// A row that is about a hazard, and why it does not answer it.
struct Suspect {
    row: usize,
    why: String,
    /// From the level at which it is raised to that of the hazard.
    distance: f64,
}

/// The rows that may be wrong: of those whose response fits the one that is raised nearest to the hazard, and of those that are up
/// and answer by something else the nearest one.
fn suspects(rows: &[Row], hazard: &Hazard, answer: Answer, moment: Moment) -> Vec<Suspect> {
    let of_kind = |is_fit: bool| {
        let about = rows.iter().enumerate().filter(|(_, row)| is_about(row, hazard) && fits(row, answer) == is_fit);
        let suspect = |(number, row): (usize, &Row)| {
            let begins = begins(row, hazard, moment);
            let distance = match begins {
                Some(share) if share <= 1.0 && is_fit => 0.0,
                Some(share) => (share - 1.0).abs(),
                None => f64::INFINITY,
            };
            let is_up = begins.is_some_and(|it| it <= 1.0);
            let why = || why(rows, number, hazard, answer, moment, begins);
            (is_fit || is_up).then(|| Suspect { row: number, why: why(), distance })
        };
        let counts = |it: &Suspect| moment.counts(&rows[it.row]);
        about.filter_map(suspect).min_by(|a, b| a.distance.total_cmp(&b.distance).then(counts(b).cmp(&counts(a))))
    };
    [of_kind(true), of_kind(false)].into_iter().flatten().collect()
}

fn fits(row: &Row, answer: Answer) -> bool {
    match answer {
        Answer::Told => true,
        Answer::Narrowed(what) => row.narrows.contains(&what),
        Answer::Response(severities) => severities.contains(&row.severity()),
    }
}

/// At which share of the way to the hazard its expression begins to hold, also beyond it.
fn begins(row: &Row, hazard: &Hazard, moment: Moment) -> Option<f64> {
    let before = (0..=STEPS).map(|it| f64::from(it) / f64::from(STEPS));
    let beyond = (1..=STEPS).map(|it| GROWTH.powi(it as i32));
    before.chain(beyond).find(|it| holds(row, hazard, &seen(hazard.sign, moment, *it)))
}

/// Why a row that is about a hazard does not answer it, after its name.
fn why(rows: &[Row], number: usize, hazard: &Hazard, answer: Answer, moment: Moment, begins: Option<f64>) -> String {
    let row = &rows[number];
    let hold_s = row.when.as_ref().map_or(0.0, |it| it.hold.as_secs_f64());
    let seen_now = seen(hazard.sign, moment, 1.0);
    match begins {
        None if row.when.as_ref().is_some_and(|it| it.during.applies(&seen_now) != Some(true)) => {
            format!("is not raised {}", moment.phase)
        }
        None => "is not raised by it".to_owned(),
        Some(share) if 1.0 < share => {
            let Sign::Fields(fields) = hazard.sign else { return "is not raised by it".to_owned() };
            let reached = seen(hazard.sign, moment, share);
            let level = |(field, _): &(Field, f64)| {
                format!("{} {}", field.name(), field.in_words(reached.get(*field).unwrap_or_default()))
            };
            format!("is not raised before {}", fields.iter().map(level).collect::<Vec<_>>().join(", "))
        }
        Some(_) if hazard.within_s < hold_s => format!("is raised after {hold_s} s"),
        Some(_) if !fits(row, answer) => format!("answers by `{}` ({})", row.response(), row.severity().name()),
        Some(_) if !moment.counts(row) => format!("does not count {}, {}", moment.phase, moment.situation),
        Some(_) => match responder(rows, raised(rows, hazard, moment), moment) {
            Some(other) if other == number => "calls for nobody, nor does another flag that is up".to_owned(),
            Some(other) => format!("waits behind `{}`", rows[other].flag),
            None => format!("answers by `{}`", row.response()),
        },
    }
}
