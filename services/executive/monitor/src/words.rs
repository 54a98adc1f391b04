//! Why a flag was raised, in words and numbers.

use domain::contingency::expression::Expression;
use domain::contingency::snapshot::{Field, Kind, Snapshot};
use domain::contingency::source::DataSource;
use domain::contingency::when::{Finding, When};
use domain::measured::{Measured, Unit};
use domain::time::Time;

use crate::sources::{Sources, Update};

/// Why a flag was raised.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Evidence {
    /// For operators.
    pub(crate) reason: String,
    /// The value and its threshold, where the expression is one comparison.
    pub(crate) measured: Option<Measured>,
}

/// Why the expression raises its flag.
pub(crate) fn for_raising(
    when: &When,
    finding: Finding,
    now: Time,
    snapshot: &Snapshot,
    sources: &Sources,
) -> Evidence {
    let (text, hold_s) = (when.raises.text(), when.hold.as_secs_f64());
    let lasting = if when.hold.is_zero() { String::new() } else { format!(" for {hold_s:.1} s") };
    let values = match finding {
        Finding::Unknown(Some(field)) => format!("{} is not known, which counts as raised", field.name()),
        Finding::Unknown(None) => "the rule has no result, which counts as raised".to_owned(),
        Finding::Raises | Finding::Between | Finding::Clears => {
            when.fields().iter().map(|it| of_field(*it, now, snapshot, sources)).collect::<Vec<_>>().join(", ")
        }
    };
    Evidence { reason: format!("{values}; the rule is `{text}`{lasting}"), measured: measured(&when.raises, snapshot) }
}

/// A field with its value: `battery.charge_percent 4.20 %`, or in words of its own.
fn of_field(field: Field, now: Time, snapshot: &Snapshot, sources: &Sources) -> String {
    let Some(value) = snapshot.get(field) else { return format!("{} not known", field.name()) };
    if let Some(source) = field.silence() {
        return of_silence(source, value, sources.last_update(source));
    }
    if let (Field::TouchdownSpeed, Some(from_m)) = (field, sources.fell_from_m()) {
        // While it falls, its speed is not yet that of the touchdown.
        return format!("the motors were stopped at {from_m:.0} m: it fell");
    }
    if let (Field::SkillMissing, Some(why)) = (field, sources.missing_skill(now).flatten()) {
        return why;
    }
    let Some((subject, state)) = report(field) else { return format!("{} {}", field.name(), field.in_words(value)) };
    let reported = if value > 0.5 { "is reported" } else { "is not reported" };
    let says = match field {
        Field::NotReady | Field::Preempts => sources.status.latest().map_or("", |it| it.reason.as_str()),
        _ => "",
    };
    let colon = if says.is_empty() { "" } else { ": " };
    format!("{subject} {reported} {state}{colon}{says}")
}

/// What is reported by a yes, and of what.
fn report(field: Field) -> Option<(&'static str, &'static str)> {
    Some(match field {
        Field::EstimatorInvalid => ("the estimator", "invalid"),
        Field::SetpointsLost => ("the offboard signal", "lost"),
        Field::GnssLost => ("satellite navigation", "lost"),
        Field::MotorFailed => ("a motor", "failed"),
        Field::BatteryFaulty => ("the battery", "faulty"),
        Field::OwnLinkLost => ("the ground link", "lost"),
        Field::DetectorContradicts => ("the land detector", "against motors and height"),
        Field::NotReady => ("the autopilot", "not ready to arm"),
        Field::Preempts => ("the autopilot", "flying something else than what was asked for"),
        _ => return None,
    })
}

fn of_silence(source: DataSource, silent_s: f64, update: Option<Update>) -> String {
    let subject = match source {
        DataSource::Status => "vehicle status",
        DataSource::Attitude => "attitude",
        DataSource::LocalPosition => "local position",
        DataSource::GlobalPosition => "global position",
        DataSource::LandDetected => "land detector",
        DataSource::Battery => "battery status",
        DataSource::GroundLink => "the link to the ground",
        DataSource::Planner => "the planner",
        DataSource::SkillManager => "the skill manager",
        DataSource::MissionManager => "the mission manager",
        DataSource::ControlTower => "the control tower",
    };
    match update {
        Some(Update { frozen: false, .. }) => format!("{subject} has been silent for {silent_s:.1} s"),
        Some(Update { frozen: true, .. }) => format!("{subject} has repeated the same values for {silent_s:.1} s"),
        None => format!("{subject} was not heard in the {silent_s:.1} s since the first other source"),
    }
}

/// The value and its threshold, where the expression is one comparison.
fn measured(expression: &Expression, snapshot: &Snapshot) -> Option<Measured> {
    let threshold = expression.threshold()?;
    let Kind::Number { unit, .. } = threshold.field.kind() else { return None };
    Measured::new(snapshot.get(threshold.field)?, threshold.value, Unit::try_from(unit).ok()?)
}
