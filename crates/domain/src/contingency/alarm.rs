//! How loudly a row calls for a human.

use serde::Deserialize;

/// The class of a row's alarm, as cockpits have them (CS-25.1322, AMC 25.1322). Later variants are more urgent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Alarm {
    /// To be known: nothing is lost yet.
    Advisory,
    /// To be looked at at once: what follows may be needed soon.
    Caution,
    /// To be acted on at once.
    Warning,
}

/// The name as the table has it.
impl std::fmt::Display for Alarm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Alarm::Advisory => "advisory",
            Alarm::Caution => "caution",
            Alarm::Warning => "warning",
        })
    }
}
