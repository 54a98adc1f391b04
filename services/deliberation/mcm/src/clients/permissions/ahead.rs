//! Requests that are made ahead of the step that needs the permission: whatever becomes of them is for that step.

use domain::permission::PermissionState;
use domain::plan::{DenialKind, PermissionNeed, StepId};
use domain::time::Time;

use super::{PermissionRequest, Permissions};
use crate::outbox::Outbox;

impl Permissions {
    /// Asks for a permission that a later step needs, unless a request is under way already.
    pub(crate) fn ask_ahead(&mut self, now: Time, area: &str, by: StepId, outbox: &mut Outbox) {
        self.asked_ahead.insert(area.to_owned());
        self.ask(now, area, by, outbox);
    }

    /// The step that needs a permission begins: whether it was asked for ahead, so that the answer, or the rest of the wait for
    /// it, counts for this step. Otherwise it is to be asked for now, unless it is held: a grant that is too short by now, or
    /// silence until the last try, does not count.
    pub(crate) fn take_over(&mut self, need: &PermissionNeed, now: Time) -> bool {
        if !self.asked_ahead.remove(&need.area) {
            return false;
        }
        let has_grant = |after_decision: u64| {
            let decided = self.belief.permission(&need.area).filter(|it| after_decision < it.decision);
            decided.is_some_and(|it| it.state == PermissionState::Granted)
        };
        let counts = match self.requests.get(&need.area) {
            Some(PermissionRequest::Sent { after_decision, .. }) => !has_grant(*after_decision),
            Some(PermissionRequest::Denied(denial)) => denial.kind == DenialKind::Refused,
            None => false,
        };
        let goes_on = counts && !self.meets(need, now);
        if !goes_on {
            self.requests.remove(&need.area);
        }
        goes_on
    }

    /// What was asked for ahead is not refused, and not given as needed either: the step that needs it asks again. Returns
    /// whether that is so.
    pub(crate) fn forget_unless_refused(&mut self, area: &str) -> bool {
        let is_refused = self.denial(area).is_some_and(|it| it.kind == DenialKind::Refused);
        if !is_refused {
            self.requests.remove(area);
        }
        !is_refused
    }

    /// Denials from before a step do not count for it, but those of what was asked for ahead.
    pub(crate) fn forget_old_denials(&mut self) {
        let ahead = &self.asked_ahead;
        self.requests.retain(|area, it| matches!(it, PermissionRequest::Sent { .. }) || ahead.contains(area));
    }

    /// The plan is not flown any more: no step will take over what was asked for ahead. A late grant still counts.
    pub(crate) fn end_asking_ahead(&mut self) {
        for area in std::mem::take(&mut self.asked_ahead) {
            self.requests.remove(&area);
        }
    }
}
