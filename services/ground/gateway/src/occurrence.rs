//! What happened, as opposed to what is: the lines of a vehicle's history.
//!
//! Most are messages of their own; objectives, permissions and the report come in statuses that
//! are repeated, and are told when they differ from the one before.

use kittiwake_proto::v1;

/// Something worth a line in a vehicle's history.
#[derive(Debug, Clone, PartialEq)]
pub enum Occurrence {
    /// The mission manager decided something.
    Decision(v1::DecisionRecord),
    /// A skill changed its state.
    Skill(v1::SkillEvent),
    /// A flag rose or fell.
    Flag(v1::FlagEvent),
    /// The control tower decided about an area, or a permission ran out.
    Permission(v1::Permission),
    /// An objective was seen first, or fared better or worse.
    Objective(v1::Objective),
    /// The mission ended.
    Report(v1::MissionReport),
}

impl Occurrence {
    /// The type of its server-sent event.
    pub fn kind(&self) -> &'static str {
        match self {
            Occurrence::Decision(_) => "decision",
            Occurrence::Skill(_) => "skill",
            Occurrence::Flag(_) => "flag",
            Occurrence::Permission(_) => "permission",
            Occurrence::Objective(_) => "objective",
            Occurrence::Report(_) => "report",
        }
    }
}

/// The permissions that differ, by more than the time that has passed.
pub fn decided(
    before: Option<&v1::PermissionLedger>,
    after: &v1::PermissionLedger,
) -> impl Iterator<Item = Occurrence> {
    let before = before.map_or(&[][..], |it| &it.permissions);
    let timeless = |it: &v1::Permission| v1::Permission { valid_for_s: 0.0, ..it.clone() };
    let known = move |it: &v1::Permission| before.iter().any(|before| timeless(before) == timeless(it));
    after.permissions.iter().filter(move |it| !known(it)).cloned().map(Occurrence::Permission)
}

/// The objectives that are new or stand differently.
pub fn progressed(before: Option<&v1::PlannerStatus>, after: &v1::PlannerStatus) -> impl Iterator<Item = Occurrence> {
    let before = before.map_or(&[][..], |it| &it.objectives);
    let changed = |(index, it): &(usize, &v1::Objective)| before.get(*index) != Some(*it);
    after.objectives.iter().enumerate().filter(changed).map(|(_, it)| Occurrence::Objective(it.clone()))
}

/// The report, when it is new.
pub fn reported(before: Option<&v1::McmStatus>, after: &v1::McmStatus) -> Option<Occurrence> {
    let report = after.report.as_ref()?;
    (before.and_then(|it| it.report.as_ref()) != Some(report)).then(|| Occurrence::Report(report.clone()))
}
