//! What a response is for: safety, or only the comfort of the mission.

use serde::Deserialize;

use super::Severity;
use super::alarm::Alarm;

/// What a row is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Label {
    /// Optional: without its response the mission is worse, and nobody is harmed. It holds, waits behind every row of safety and
    /// every order, and interrupts no landing.
    Comfort,
    /// Without its response somebody may be harmed, or the vehicle. An order comes before it only with override.
    Safety,
    /// Safety, and no order comes before it.
    Binding,
}

impl Label {
    /// That of a row which names none: a hold that is only to be known is comfort.
    pub(super) fn usual(severity: Severity, alarm: Alarm) -> Label {
        if severity == Severity::Hold && alarm == Alarm::Advisory { Label::Comfort } else { Label::Safety }
    }
}

/// The name as the table has it.
impl std::fmt::Display for Label {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Label::Comfort => "comfort",
            Label::Safety => "safety",
            Label::Binding => "binding",
        })
    }
}
