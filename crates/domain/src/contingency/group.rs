//! What a case is about: the seven groups in which a catalogue of contingencies is sorted.

use serde::Deserialize;

/// The group of a row. Rows of one group are one branch of the tree, and an operator who overrides one of them overrides
/// those of its group that are no more severe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// The battery, and the energy that the flight takes.
    Energy,
    /// Links to the ground, and the services behind them.
    Link,
    /// Where the vehicle is: satellites, sensors, estimator.
    Navigation,
    /// Where it may be: areas, permissions, other traffic.
    Airspace,
    /// Wind, and what else the air does.
    Weather,
    /// Motors, body and load.
    Vehicle,
    /// The mission, its software, operators and time.
    Mission,
}

impl Group {
    /// Every group.
    pub const ALL: [Group; 7] = [
        Group::Energy,
        Group::Link,
        Group::Navigation,
        Group::Airspace,
        Group::Weather,
        Group::Vehicle,
        Group::Mission,
    ];

    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Group::Energy => "energy",
            Group::Link => "link",
            Group::Navigation => "navigation",
            Group::Airspace => "airspace",
            Group::Weather => "weather",
            Group::Vehicle => "vehicle",
            Group::Mission => "mission",
        }
    }

    /// The group of this name.
    pub fn named(name: &str) -> Option<Group> {
        Group::ALL.into_iter().find(|it| it.name() == name)
    }
}

/// The name as the table has it.
impl std::fmt::Display for Group {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
