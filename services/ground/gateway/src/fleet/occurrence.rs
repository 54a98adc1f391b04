//! Events, as opposed to state: what a vehicle's journal holds.
//!
//! Most are messages of their own. Objectives, permissions and the report come in statuses that are
//! repeated, and become an event when they differ from the status before.

use domain::wire::decision::sentence;
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1;
use serde_json::Value;

use crate::audit::json_of;

/// An event of a vehicle's journal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Occurrence {
    /// The mission manager decided something.
    Decision(v1::DecisionRecord),
    /// A skill changed its state.
    Skill(v1::SkillEvent),
    /// A flag was raised or cleared.
    Flag(v1::FlagEvent),
    /// The control tower decided about an area, or a permission expired.
    Permission(v1::Permission),
    /// An objective was seen for the first time, or has changed.
    Objective(v1::Objective),
    /// The mission ended.
    Report(v1::MissionReport),
    /// An order was given.
    Audit(v1::AuditRecord),
    /// Command was taken, released or offered.
    Command(v1::CommandAuthority),
}

impl Occurrence {
    /// The type of its server-sent event.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Occurrence::Decision(_) => "decision",
            Occurrence::Skill(_) => "skill",
            Occurrence::Flag(_) => "flag",
            Occurrence::Permission(_) => "permission",
            Occurrence::Objective(_) => "objective",
            Occurrence::Report(_) => "report",
            Occurrence::Audit(_) => "audit",
            Occurrence::Command(_) => "command",
        }
    }

    /// Its message in canonical JSON; a decision with its `sentence`, so that no client has to put it into words itself.
    pub(crate) fn to_json(&self) -> Value {
        match self {
            Occurrence::Decision(decision) => {
                let mut json = to_json(decision);
                json["sentence"] = Value::String(sentence(decision));
                json
            }
            Occurrence::Skill(event) => to_json(event),
            Occurrence::Flag(event) => to_json(event),
            Occurrence::Permission(permission) => to_json(permission),
            Occurrence::Objective(objective) => to_json(objective),
            Occurrence::Report(report) => to_json(report),
            Occurrence::Audit(record) => json_of(record),
            Occurrence::Command(authority) => to_json(authority),
        }
    }
}

/// The permissions that differ from before by more than the time that has passed.
pub(crate) fn permissions(
    before: Option<&v1::PermissionLedger>,
    after: &v1::PermissionLedger,
) -> impl Iterator<Item = Occurrence> {
    let before = before.map_or(&[][..], |ledger| &ledger.permissions);
    let timeless = |it: &v1::Permission| v1::Permission { valid_for_s: 0.0, ..it.clone() };
    let known = move |it: &v1::Permission| before.iter().any(|before| timeless(before) == timeless(it));
    after.permissions.iter().filter(move |it| !known(it)).cloned().map(Occurrence::Permission)
}

/// The objectives that are new or have changed.
pub(crate) fn objectives(
    before: Option<&v1::MissionStatus>,
    after: &v1::MissionStatus,
) -> impl Iterator<Item = Occurrence> {
    let before = before.map_or(&[][..], |status| &status.objectives);
    let changed = |(index, it): &(usize, &v1::Objective)| before.get(*index) != Some(*it);
    after.objectives.iter().enumerate().filter(changed).map(|(_, it)| Occurrence::Objective(it.clone()))
}

/// The report, when it is new.
pub(crate) fn report(before: Option<&v1::McmStatus>, after: &v1::McmStatus) -> Option<Occurrence> {
    let report = after.report.as_ref()?;
    (before.and_then(|status| status.report.as_ref()) != Some(report)).then(|| Occurrence::Report(report.clone()))
}
