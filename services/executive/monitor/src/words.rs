//! Why a flag rose or fell, in words and numbers.

use domain::contingency::Rule;
use domain::contingency::rule::{Condition, DataSource, During, Quantity};
use domain::time::Time;

use crate::derived::value;
use crate::fact::Fact;
use crate::sources::{Heard, Sources};

/// What speaks for a change.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    /// In words.
    pub reason: String,
    /// What was measured, in the unit of the rule; for a stale source its age in seconds.
    pub value: Option<f64>,
    /// What it was compared with.
    pub threshold: Option<f64>,
}

/// Why the fact holds.
pub fn rise(fact: &Fact, sources: &Sources, now: Time) -> Evidence {
    match fact.rule {
        Rule::Below { value: quantity, threshold, for_s, .. } => {
            compared(quantity, sources, "is below", threshold, &lasting(for_s))
        }
        Rule::Above { value: quantity, threshold, for_s, .. } => {
            compared(quantity, sources, "is above", threshold, &lasting(for_s))
        }
        Rule::Reported { condition, for_s, .. } => {
            let (subject, state) = condition_words(condition);
            Evidence { reason: format!("{subject} is reported {state}{}", lasting(for_s)), ..Evidence::default() }
        }
        Rule::Stale { source, .. } => stale(fact, source, sources, now),
    }
}

/// Why it does not any more.
pub fn fall(fact: &Fact, sources: &Sources) -> Evidence {
    match fact.rule {
        _ if !fact.counts(sources) => {
            let situation = if fact.during() == During::Flying { "flying" } else { "armed" };
            Evidence { reason: format!("the vehicle is not {situation} any more"), ..Evidence::default() }
        }
        Rule::Below { value: quantity, clear, .. } => compared(quantity, sources, "is no longer below", clear, ""),
        Rule::Above { value: quantity, clear, .. } => compared(quantity, sources, "is no longer above", clear, ""),
        Rule::Reported { condition, .. } => {
            let (subject, state) = condition_words(condition);
            Evidence { reason: format!("{subject} is no longer reported {state}"), ..Evidence::default() }
        }
        Rule::Stale { source, .. } => {
            Evidence { reason: format!("{} is heard again", source_words(source)), ..Evidence::default() }
        }
    }
}

fn compared(quantity: Quantity, sources: &Sources, how: &str, threshold: f64, lasting: &str) -> Evidence {
    let (name, unit) = quantity_words(quantity);
    let value = value(quantity, sources);
    let reason = match value {
        Some(value) => {
            let (value, threshold) = told_apart(value, threshold);
            format!("{name} {value}{unit} {how} {threshold}{unit}{lasting}")
        }
        None => format!("{name} {how} {threshold}{unit}{lasting}"),
    };
    Evidence { reason, value, threshold: Some(threshold) }
}

fn stale(fact: &Fact, source: DataSource, sources: &Sources, now: Time) -> Evidence {
    let name = source_words(source);
    let (since, limit, what) = match sources.heard(source) {
        Some(Heard { at, frozen: false }) => (at, fact.stale_after, "has been silent"),
        Some(Heard { at, frozen: true }) => (at, fact.stale_after, "has repeated the very same"),
        None => (sources.first_heard.unwrap_or(now), fact.absent_after, "was never heard, others have been"),
    };
    let (age_s, limit_s) = ((now - since).as_secs_f64(), limit.as_secs_f64());
    Evidence {
        reason: format!("{name} {what} for {age_s:.1} s, the limit is {limit_s:.1} s"),
        value: Some(age_s),
        threshold: Some(limit_s),
    }
}

fn lasting(for_s: f64) -> String {
    if for_s > 0.0 { format!(" for {for_s:.1} s") } else { String::new() }
}

/// Both numbers with as few decimals, two at least, as show whether they differ.
fn told_apart(a: f64, b: f64) -> (String, String) {
    let with = |decimals: usize| (format!("{a:.decimals$}"), format!("{b:.decimals$}"));
    (2..6).map(with).find(|(shown_a, shown_b)| shown_a != shown_b || a == b).unwrap_or_else(|| with(6))
}

fn quantity_words(quantity: Quantity) -> (&'static str, &'static str) {
    match quantity {
        Quantity::BatteryRemaining => ("battery remaining", ""),
        Quantity::BatteryVoltage => ("battery voltage", " V"),
        Quantity::BatteryTemperature => ("battery temperature", " °C"),
        Quantity::HorizontalAccuracy => ("horizontal standard deviation", " m"),
        Quantity::VerticalAccuracy => ("vertical standard deviation", " m"),
        Quantity::Height => ("height", " m"),
        Quantity::DistanceHome => ("distance home", " m"),
        Quantity::GroundSpeed => ("ground speed", " m/s"),
        Quantity::Tilt => ("tilt", " rad"),
    }
}

fn condition_words(condition: Condition) -> (&'static str, &'static str) {
    match condition {
        Condition::EstimatorInvalid => ("the estimator", "invalid"),
        Condition::OffboardSignalLost => ("the offboard signal", "lost"),
        Condition::GnssLost => ("satellite navigation", "lost"),
        Condition::MotorFailure => ("a motor", "failed"),
        Condition::BatteryFailure => ("the battery", "faulty"),
        Condition::GroundLinkLost => ("the ground link", "lost"),
    }
}

fn source_words(source: DataSource) -> &'static str {
    match source {
        DataSource::Status => "vehicle status",
        DataSource::Attitude => "attitude",
        DataSource::LocalPosition => "local position",
        DataSource::GlobalPosition => "global position",
        DataSource::LandDetected => "land detector",
        DataSource::Battery => "battery status",
        DataSource::GroundLink => "the link to the ground",
    }
}
