//! Why a flag was raised or cleared, in words and numbers.

use domain::contingency::Rule;
use domain::contingency::rule::{Condition, DataSource, During, Quantity};
use domain::measured::{Measured, Unit};
use domain::time::Time;

use crate::derived::value;
use crate::fact::Fact;
use crate::sources::{Sources, Update};

/// The evidence for a change of a flag.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Evidence {
    /// In words, for operators.
    pub(crate) reason: String,
    /// What was measured, in the unit of the rule; for a stale source its age in seconds.
    pub(crate) value: Option<f64>,
    /// What it was compared with.
    pub(crate) threshold: Option<f64>,
    /// The unit of both.
    pub(crate) unit: Option<Unit>,
}

impl Evidence {
    /// The value and its threshold, where there are both.
    pub(crate) fn measured(&self) -> Option<Measured> {
        Measured::new(self.value?, self.threshold?, self.unit?)
    }
}

/// Why the fact holds.
pub(crate) fn for_raising(fact: &Fact, sources: &Sources, now: Time) -> Evidence {
    match fact.rule {
        Rule::Below { value: quantity, threshold, for_s, .. } => {
            compared(quantity, sources, "below", threshold, &lasting(for_s))
        }
        Rule::Above { value: quantity, threshold, for_s, .. } => {
            let evidence = compared(quantity, sources, "above", threshold, &lasting(for_s));
            match sources.fell_from_m().filter(|_| quantity == Quantity::TouchdownSpeed) {
                // While it falls, its speed is not yet that of the touchdown.
                Some(from_m) => {
                    Evidence { reason: format!("the motors were stopped at {from_m:.0} m: it fell"), ..evidence }
                }
                None => evidence,
            }
        }
        Rule::Reported { condition, for_s, .. } => {
            let (subject, state) = condition_words(condition);
            let verb = if for_s > 0.0 { "has been" } else { "is" };
            let why = match condition {
                Condition::WouldNotArm | Condition::AutopilotPreempts => its_own_words(sources),
                _ => String::new(),
            };
            in_words(format!("{subject} {verb} reported {state}{}{why}", lasting(for_s)))
        }
        Rule::Stale { source, .. } => stale(fact, source, sources, now),
    }
}

/// Why the fact no longer holds.
pub(crate) fn for_clearing(fact: &Fact, sources: &Sources) -> Evidence {
    match fact.rule {
        _ if !fact.applies(sources) => {
            let situation = if fact.during() == During::Flying { "flying" } else { "armed" };
            in_words(format!("the vehicle is no longer {situation}"))
        }
        Rule::Below { value: quantity, clear, .. } => compared(quantity, sources, "no longer below", clear, ""),
        Rule::Above { value: quantity, clear, .. } => compared(quantity, sources, "no longer above", clear, ""),
        Rule::Reported { condition, .. } => {
            let (subject, state) = condition_words(condition);
            in_words(format!("{subject} is no longer reported {state}"))
        }
        Rule::Stale { source, .. } => in_words(format!("{} is heard again", source_words(source))),
    }
}

/// What the autopilot says about what it does: `: battery low`.
fn its_own_words(sources: &Sources) -> String {
    let reason = sources.status.latest().map(|it| it.reason.as_str()).filter(|it| !it.is_empty());
    reason.map_or_else(String::new, |it| format!(": {it}"))
}

fn in_words(reason: String) -> Evidence {
    Evidence { reason, ..Evidence::default() }
}

fn compared(quantity: Quantity, sources: &Sources, relation: &str, threshold: f64, lasting: &str) -> Evidence {
    let (name, unit) = quantity_words(quantity);
    let value = value(quantity, sources);
    let reason = match value {
        Some(value) => {
            let (value, threshold) = distinguishable(value, threshold);
            format!("{name} {value}{unit}, {relation} {threshold}{unit}{lasting}")
        }
        None => format!("{name} {relation} {threshold}{unit}{lasting}"),
    };
    Evidence { reason, value, threshold: Some(threshold), unit: Some(quantity.into()) }
}

fn stale(fact: &Fact, source: DataSource, sources: &Sources, now: Time) -> Evidence {
    let update = sources.last_update(source);
    let (since, limit) = match update {
        Some(update) => (update.at, fact.stale_after),
        None => (sources.first_heard().unwrap_or(now), fact.absent_after),
    };
    let (age_s, limit_s) = ((now - since).as_secs_f64(), limit.as_secs_f64());
    let problem = match update {
        Some(Update { frozen: false, .. }) => format!("has been silent for {age_s:.1} s"),
        Some(Update { frozen: true, .. }) => format!("has repeated the same values for {age_s:.1} s"),
        None => format!("was not heard in the {age_s:.1} s since the first other source"),
    };
    let reason = format!("{} {problem}, the limit is {limit_s:.1} s", source_words(source));
    Evidence { reason, value: Some(age_s), threshold: Some(limit_s), unit: Some(Unit::Second) }
}

fn lasting(for_s: f64) -> String {
    if for_s > 0.0 { format!(" for {for_s:.1} s") } else { String::new() }
}

/// Both numbers with two decimals, or with as many more as show that they differ.
fn distinguishable(a: f64, b: f64) -> (String, String) {
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
        Quantity::TouchdownSpeed => ("touchdown speed", " m/s"),
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
        Condition::LandDetectorContradicts => ("the land detector", "against motors and height"),
        Condition::WouldNotArm => ("the autopilot", "not ready to arm"),
        Condition::AutopilotPreempts => ("the autopilot", "flying something else than what was asked for"),
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
        DataSource::Planner => "the planner",
        DataSource::SkillManager => "the skill manager",
        DataSource::MissionManager => "the mission manager",
        DataSource::ControlTower => "the control tower",
    }
}
