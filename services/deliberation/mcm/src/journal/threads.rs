//! Which record a later one follows from.

use std::collections::BTreeMap;

use domain::decision::DecisionKind;

use super::said::{Cause, Said};

/// The numbers of the records that later ones may follow from.
#[derive(Debug, Default)]
pub(super) struct Threads {
    /// That the flag of a row was raised.
    raised: BTreeMap<usize, u64>,
    /// The row whose response began last, as long as its flag is up.
    answered: Option<(usize, u64)>,
    plan: Option<u64>,
    step: Option<u64>,
    /// What a new plan is wanted for.
    replanning: Option<u64>,
    end: Option<u64>,
    /// That an area was asked for.
    asked: BTreeMap<String, u64>,
}

impl Threads {
    pub(super) fn parent(&self, said: &Said) -> Option<u64> {
        match &said.cause {
            Cause::Nothing => None,
            Cause::Raised(row) => self.raised.get(row).copied(),
            Cause::Case(row) => {
                let answered = self.answered.filter(|(answered, _)| answered == row);
                answered.map(|(_, number)| number).or_else(|| self.raised.get(row).copied())
            }
            Cause::Response => self.answered.map(|(_, number)| number),
            Cause::Plan => self.plan,
            Cause::Replanning => self.replanning,
            Cause::Step => self.step,
            Cause::Asked(area) => self.asked.get(area).copied(),
            Cause::End => self.end,
        }
    }

    /// This decision has the record `number`.
    pub(super) fn follow(&mut self, said: &Said, number: u64) {
        if said.ends_mission {
            self.end = Some(number);
        }
        match (said.kind, said.row, &said.area) {
            (DecisionKind::ContingencyRaised, Some(row), _) => {
                self.raised.insert(row, number);
            }
            (DecisionKind::ContingencyAnswered, Some(row), _) => self.answered = Some((row, number)),
            (DecisionKind::ContingencyCleared, Some(row), _) => {
                self.raised.remove(&row);
                self.answered = self.answered.filter(|(answered, _)| *answered != row);
                self.replanning = Some(number);
            }
            (DecisionKind::PlanAdopted, ..) => (self.plan, self.replanning) = (Some(number), None),
            (DecisionKind::StepBegun, ..) => self.step = Some(number),
            (DecisionKind::StepFailed, ..) => self.replanning = Some(number),
            (DecisionKind::PermissionAsked, _, Some(area)) => {
                self.asked.insert(area.clone(), number);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parent of the last decision, by the place of its record among them, from 1.
    #[track_caller]
    fn check(decisions: Vec<Said>, expected: Option<u64>) {
        let mut threads = Threads::default();
        let mut parent = None;
        for (number, said) in (1..).zip(&decisions) {
            parent = threads.parent(said);
            threads.follow(said, number);
        }
        assert_eq!(parent, expected, "{decisions:#?}");
    }

    fn contingency(kind: DecisionKind, row: usize, cause: Cause) -> Said {
        Said::new("contingency", kind, "x").about(row).led_to_by(cause)
    }

    fn raised(row: usize) -> Said {
        contingency(DecisionKind::ContingencyRaised, row, Cause::Nothing)
    }

    fn answered(row: usize) -> Said {
        contingency(DecisionKind::ContingencyAnswered, row, Cause::Raised(row))
    }

    fn cleared(row: usize) -> Said {
        contingency(DecisionKind::ContingencyCleared, row, Cause::Case(row))
    }

    fn of(topic: &'static str, kind: DecisionKind) -> Said {
        Said::new(topic, kind, "x")
    }

    #[test]
    fn a_response_follows_from_its_flag_and_its_steps_from_the_response() {
        check(vec![raised(1)], None);
        check(vec![raised(1), raised(2), answered(1)], Some(1));
        check(vec![raised(1), answered(1), of("contingency", DecisionKind::SiteChosen)], Some(2));
        check(vec![raised(1), raised(2), answered(2), cleared(2)], Some(3));
        check(vec![raised(1), raised(2), answered(2), cleared(1)], Some(1));
        check(vec![raised(1), answered(1), cleared(1), of("contingency", DecisionKind::Note)], None);
        check(vec![raised(1), answered(1), cleared(1), answered(1)], None);
    }

    #[test]
    fn a_plan_follows_from_what_made_it_necessary_and_its_steps_from_the_plan() {
        let plan = || of("plan", DecisionKind::PlanAdopted);
        let begun = || of("step", DecisionKind::StepBegun).led_to_by(Cause::Plan);
        let failed = || of("step", DecisionKind::StepFailed);
        check(vec![plan()], None);
        check(vec![plan(), begun()], Some(1));
        check(vec![plan(), begun(), failed()], Some(2));
        check(vec![plan(), begun(), failed(), plan()], Some(3));
        check(vec![raised(1), answered(1), cleared(1), plan()], Some(3));
        check(vec![plan(), begun(), failed(), plan(), plan()], None);
    }

    #[test]
    fn a_grant_follows_from_the_request_and_the_end_from_what_ended_the_mission() {
        let asked = |area: &str| of("permission", DecisionKind::PermissionAsked).about_area(area);
        let decided = |area: &str| {
            let said = of("permission", DecisionKind::PermissionDecided).about_area(area);
            said.led_to_by(Cause::Asked(area.to_owned()))
        };
        check(vec![asked("A"), asked("B"), decided("A")], Some(1));
        check(vec![asked("A"), decided("B")], None);
        let over = || of("mission", DecisionKind::MissionOver).led_to_by(Cause::End);
        check(vec![raised(1), cleared(1).ending_mission(true), raised(2), cleared(2), over()], Some(2));
        check(vec![raised(1), cleared(1), over()], None);
    }
}
