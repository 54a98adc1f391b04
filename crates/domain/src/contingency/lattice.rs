//! How severe responses are, and why each stands above the one before it.

use serde::Deserialize;

/// How severe an action is. Later variants are more severe: of the rows whose flags are up, the most severe one is flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Stays where it is.
    Hold,
    /// Leaves the area that it may not be in.
    Leave,
    /// Flies on, slower. It interrupts nothing: the limit is in force beside whatever is flown.
    Slow,
    /// Flies home, or to the place that was ordered, and lands there.
    Return,
    /// Flies to the best place that can be reached, and lands there.
    Divert,
    /// Keeps out of the way of what comes near.
    Avoid,
    /// Lands where it is.
    Land,
    /// Comes down where no landing is possible, and is given up.
    Ditch,
    /// Comes down at once, whatever is below.
    Terminate,
    /// Commands nothing: a pilot or another ground station flies.
    Yield,
}

impl Severity {
    /// Every severity, the least first.
    pub const ALL: [Severity; 10] = [
        Severity::Hold,
        Severity::Leave,
        Severity::Slow,
        Severity::Return,
        Severity::Divert,
        Severity::Avoid,
        Severity::Land,
        Severity::Ditch,
        Severity::Terminate,
        Severity::Yield,
    ];

    /// Whether it ends on the ground.
    pub fn comes_down(self) -> bool {
        Severity::Return <= self && self != Severity::Avoid
    }

    /// As the table has it.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Hold => "hold",
            Severity::Leave => "leave",
            Severity::Slow => "slow",
            Severity::Return => "return",
            Severity::Divert => "divert",
            Severity::Avoid => "avoid",
            Severity::Land => "land",
            Severity::Ditch => "ditch",
            Severity::Terminate => "terminate",
            Severity::Yield => "yield",
        }
    }

    /// What a vehicle does by a response this severe: `holds`.
    pub fn in_words(self) -> &'static str {
        match self {
            Severity::Hold => "holds",
            Severity::Leave => "leaves the area",
            Severity::Slow => "flies slower",
            Severity::Return => "flies to a landing site and lands",
            Severity::Divert => "flies to the best place that can be reached and lands",
            Severity::Avoid => "keeps out of the way of what comes near",
            Severity::Land => "lands where it is",
            Severity::Ditch => "comes down where it is given up",
            Severity::Terminate => "comes down at once, whatever is below",
            Severity::Yield => "is flown by somebody else, and nothing is commanded",
        }
    }

    /// Why it stands above the severity before it; `None` for the least one.
    pub fn why_above_the_one_before(self) -> Option<&'static str> {
        Some(match self {
            Severity::Hold => return None,
            Severity::Leave => {
                "a hold inside an area that may not be entered goes on with what is wrong, and it can hold outside as well"
            }
            Severity::Slow => {
                "it stops neither a hold nor a way out, which are flown beside it: no faster than it says, so that neither keeps it \
                 from acting"
            }
            Severity::Return => {
                "a return ends the mission, and whatever else is wrong is best answered at home; it is flown slower where that is \
                 asked for"
            }
            Severity::Divert => {
                "who diverts may not get home, where a return would insist on going; the best place may be home"
            }
            Severity::Avoid => {
                "people in another aircraft come before this one: who diverts goes on once it has passed, which takes a minute or two"
            }
            Severity::Land => "what calls for a landing at once does not last for a way to any place",
            Severity::Ditch => {
                "a landing where it is would be among people or cannot be survived: the vehicle is given up to keep harm from \
                 others, and what saves the vehicle does not interrupt that"
            }
            Severity::Terminate => "it cannot fly to any place any more, not even to a ditch",
            Severity::Yield => {
                "the pilot who has taken the vehicle sees what is wrong as well, and two controllers are worse than \
                 one; only an operator's order takes it back"
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_neighbours_has_its_reason() {
        assert!(Severity::ALL.is_sorted());
        for (less, more) in Severity::ALL.iter().zip(&Severity::ALL[1..]) {
            assert!(less < more, "{less:?} {more:?}");
            assert!(more.why_above_the_one_before().is_some_and(|it| 20 < it.len()), "{more:?}");
        }
        assert_eq!(Severity::ALL[0].why_above_the_one_before(), None);
    }

    #[test]
    fn the_table_has_each_by_its_name() {
        #[derive(Deserialize)]
        struct File {
            severity: Severity,
        }
        for severity in Severity::ALL {
            let read: File = toml::from_str(&format!("severity = \"{}\"", severity.name())).unwrap();
            assert_eq!(read.severity, severity);
        }
    }
}
