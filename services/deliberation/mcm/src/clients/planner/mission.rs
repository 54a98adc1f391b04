//! The mission that is flown, as far as it has come. The manager keeps it, and each question to the planner carries it.

use domain::area::Area;
use domain::geometry::Ned;
use domain::known_ground::KnownGround;
use domain::mission::{Mission, MissionAreas};
use domain::plan::{self, Course, FlownStep, MissionStatus, Step};
use domain::wire::InvalidMessage;
use domain::wire::plan::course;
use kittiwake_proto::v1;

use super::Viewpoint;

/// The mission, the planner's notes, its areas, and what was flown since the notes. Areas that are taken by traffic that stands
/// come on top: they are kept out of, and belong to no mission.
#[derive(Debug, Clone, Default)]
pub(crate) struct FlownMission {
    /// Its objectives and what became of them, without areas and steps.
    pub(crate) status: MissionStatus,
    /// `None` before the planner's first answer.
    notes: Option<v1::PlannerNotes>,
    areas: MissionAreas,
    /// What is taken by traffic that stands, and those areas with it; `None`: nothing is.
    pub(crate) taken: Vec<Area>,
    with_taken: Option<MissionAreas>,
    /// As its places say it, and where the vehicle stood.
    pub(crate) ground: KnownGround,
    /// Whether the planner is thought to know the areas.
    are_areas_told: bool,
    /// The steps that the planner has not taken in, first flown first.
    pub(super) flown: Vec<FlownStep>,
    /// The place in the order of the objective that a plan was adopted for last.
    pub(super) planned_for: Option<u32>,
    /// Counts changes by answers: one to an older question is void.
    version: u64,
}

impl FlownMission {
    /// `mission`, nothing of which has been attempted.
    pub(crate) fn beginning(mission: &Mission) -> FlownMission {
        let (status, areas) = (MissionStatus::beginning(mission), MissionAreas::of(&mission.areas, &mission.feeds));
        FlownMission { ground: ground(&status), status, areas, ..FlownMission::default() }
    }

    /// Its areas, and those that are taken by traffic that stands.
    pub(crate) fn areas(&self) -> &MissionAreas {
        self.with_taken.as_ref().unwrap_or(&self.areas)
    }

    /// Traffic that stands takes these areas from now on.
    pub(crate) fn take(&mut self, taken: Vec<Area>) {
        self.taken = taken;
        self.lay_over();
        self.are_areas_told = false;
    }

    fn lay_over(&mut self) {
        self.with_taken = (!self.taken.is_empty()).then(|| {
            let all: Vec<Area> = self.areas.areas().iter().chain(&self.taken).cloned().collect();
            MissionAreas::of(&all, self.areas.feeds())
        });
    }

    pub(crate) fn version(&self) -> u64 {
        self.version
    }

    /// How many steps were flown that the planner has not taken in.
    pub(crate) fn flown(&self) -> usize {
        self.flown.len()
    }

    /// Whether it has objectives, and each has reached its final state.
    pub(crate) fn is_settled(&self) -> bool {
        !self.status.objectives.is_empty() && self.status.is_settled()
    }

    /// What an answer about it depends on, and whether the areas are in it.
    pub(crate) fn basis(&mut self, viewpoint: Viewpoint, rest: Vec<Step>) -> (plan::Basis, bool) {
        let Viewpoint { at, state, origin: vehicle_origin, wind } = viewpoint;
        let sends_areas = !std::mem::replace(&mut self.are_areas_told, true);
        let basis = plan::Basis {
            at,
            state,
            vehicle_origin,
            wind,
            mission: self.status.clone(),
            notes: self.notes.clone(),
            areas_id: self.areas().id().to_owned(),
            areas: sends_areas.then(|| self.areas().encoded().clone()),
            flown: self.flown.clone(),
            rest,
        };
        (basis, sends_areas)
    }

    pub(crate) fn areas_are_unknown(&mut self) {
        self.are_areas_told = false;
    }

    /// It goes on as an answer says, which took in this many of the flown steps.
    pub(crate) fn go_on(&mut self, course: Course, flown: usize) {
        (self.status, self.notes) = (course.mission, Some(course.notes));
        self.ground.name(&self.status.sites, on_ground(&self.status));
        self.flown.drain(..flown.min(self.flown.len()));
        self.version += 1;
    }

    /// It has other areas, which the planner has named itself.
    pub(crate) fn replace_areas(&mut self, areas: MissionAreas) {
        // What was taken was among those that it was asked about.
        let kept = |it: &&Area| !self.taken.contains(it);
        self.areas = match areas.areas().iter().all(|it| kept(&it)) {
            true => areas,
            false => MissionAreas::of(&areas.areas().iter().filter(kept).cloned().collect::<Vec<_>>(), areas.feeds()),
        };
        self.lay_over();
        self.are_areas_told = self.taken.is_empty();
    }

    /// As it is published; `steps` are what is left of the plan, and `hold` is what is waited for.
    pub(crate) fn told(&self, steps: Vec<Step>, hold: String) -> MissionStatus {
        let mut told = MissionStatus {
            areas: self.areas.areas().to_vec(),
            feeds: self.areas.feeds().to_vec(),
            steps,
            hold,
            ..self.status.clone()
        };
        // What the planner has not heard of yet.
        let passed = self.flown.iter().map(|it| it.step.passed).max().unwrap_or_default() as usize;
        let current = told.objectives.get_mut(told.current_objective as usize);
        if let Some(survey) = current.and_then(|it| it.objective.survey.take_if(|it| it.passed() < passed)) {
            told.objectives[told.current_objective as usize].objective.survey = Some(survey.with_passed(passed));
        }
        told
    }

    pub(crate) fn stored(&self) -> v1::StoredMission {
        v1::StoredMission {
            status: Some(self.status.clone().into()),
            notes: self.notes.clone(),
            areas: self.areas.encoded().clone(),
            flown: self.flown.iter().cloned().map(Into::into).collect(),
            planned_for: self.planned_for,
        }
    }
}

/// The places of its objectives on the ground.
fn on_ground(status: &MissionStatus) -> impl Iterator<Item = Ned> {
    status.objectives.iter().map(|it| &it.objective).filter(|it| !it.flying).map(|it| it.position)
}

fn ground(status: &MissionStatus) -> KnownGround {
    KnownGround::of(&status.sites, on_ground(status))
}

impl TryFrom<v1::StoredMission> for FlownMission {
    type Error = InvalidMessage;

    fn try_from(stored: v1::StoredMission) -> Result<FlownMission, InvalidMessage> {
        let v1::StoredMission { status, notes, areas, flown, planned_for } = stored;
        let restored = course(status, notes.clone())?.ok_or(InvalidMessage::Missing("mission"))?;
        let flown = flown.into_iter().map(FlownStep::try_from).collect::<Result<_, _>>()?;
        let areas = MissionAreas::decode(areas)?;
        let ground = ground(&restored.mission);
        Ok(FlownMission {
            ground,
            status: restored.mission,
            notes,
            areas,
            flown,
            planned_for,
            ..FlownMission::default()
        })
    }
}
