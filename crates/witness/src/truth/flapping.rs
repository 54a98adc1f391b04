//! A flag that rises again and again for one cause: its response undoes the cause, its end brings it back.

use std::collections::BTreeMap;

use domain::contingency::LANDING_TARGET_LOST;
use domain::time::Time;
use kittiwake_proto::v1::{DecisionKind, DecisionRecord};

pub(super) const IN_WORDS: &str = "no flag rises three times for one cause: without a trouble, a lost message, an order, a permission or a finished step between (issue 44, P5)";
/// So often.
const OFTEN: u32 = 3;

#[derive(Debug, Default)]
pub(super) struct Flapping {
    /// By flag and evidence without its figures.
    rises: BTreeMap<(String, String), u32>,
    /// Messages are lost until then.
    losing_until: Option<Time>,
}

impl Flapping {
    /// The situation is another one.
    pub(super) fn caused(&mut self) {
        self.rises.clear();
    }

    pub(super) fn losing(&mut self, until: Time) {
        self.losing_until = self.losing_until.max(Some(until));
    }

    pub(super) fn decided(&mut self, at: Time, it: &DecisionRecord) -> Option<super::Against> {
        use DecisionKind::{ContingencyRaised, OrderAccepted, PermissionDecided, StepSucceeded};
        if Some(at) < self.losing_until {
            self.caused();
        }
        match it.kind() {
            OrderAccepted | PermissionDecided | StepSucceeded => self.caused(),
            // Each landing looks for it again, and landings are counted.
            ContingencyRaised if it.flag == LANDING_TARGET_LOST => {}
            ContingencyRaised => {
                let words: String = it.text.chars().filter(|it| !it.is_ascii_digit()).collect();
                let count = self.rises.entry((it.flag.clone(), words)).or_default();
                *count += 1;
                if *count == OFTEN {
                    return Some((
                        super::Rule::Flapping,
                        format!("`{}` rose {OFTEN} times for one cause: {}", it.flag, it.text),
                    ));
                }
            }
            _ => {}
        }
        None
    }
}
