//! The phases of a mission in which flags are raised, and how each is reached.

use std::fmt;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::declared_skill::{DeclaredSkill, DeclaredSkills};
use domain::task::Stance;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, MissionPhase, SkillKind};

use vehicle_sim::ground::{Ground, Patch, Surface};

use crate::{Conduct, Simulation};

/// An area across the way, and a place on a hill behind it, with water between: short, since every flight begins with it.
const GATE: &str = "name = \"gate\"
[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 130\nheight_m = 4\nflying = false
[[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false
[[area]]\nname = \"gate\"\nkind = \"permission\"\ncorners_m = [[-40, 50], [40, 50], [40, 90], [-40, 90]]
[[area]]\nname = \"water\"\nkind = \"no-landing\"\ncorners_m = [[-200, 95], [200, 95], [200, 112], [-200, 112]]\n";
/// Hardly more than a takeoff and a landing, on a hill, from inside an area.
const HOP: &str = "name = \"hop\"
[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 40\nheight_m = 4\nflying = false
[[area]]\nname = \"yard\"\nkind = \"permission\"\ncorners_m = [[-12, -12], [12, -12], [12, 12], [-12, 12]]\n";
/// A task of a declared skill, and back.
fn task_mission(skill: &DeclaredSkill) -> String {
    let inputs = skill.example(&[]).inputs.into_iter().map(|(name, value)| format!(", {name} = {value}"));
    let (key, east_m) = if skill.stance == Stance::Flies { ("along", 130) } else { ("do", 40) };
    format!(
        "name = \"task\"
        [[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = {east_m}\nheight_m = {:?}\nflying = {}
        {key} = [{{ skill = \"{}\"{} }}]
        [[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n",
        // One that could be used nowhere was not read.
        skill.usable_at_m().unwrap_or_default(),
        skill.stance != Stance::Stands,
        skill.name,
        inputs.collect::<String>()
    )
}

/// The height of the hills, above the take-off point.
const HILL_M: f64 = 4.0;
/// The area of the first, from west to east.
const AREA_M: (f64, f64) = (50.0, 90.0);
/// No stage takes longer to come.
const LIMIT: Duration = Duration::from_secs(240);
/// For how long a plan is awaited: less than a silence of the planner that raises a flag.
const PLANS: Duration = Duration::from_millis(600);
/// How often it is looked whether it has come.
const STEP: Duration = Duration::from_millis(100);

/// A phase of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Before the takeoff.
    OnGround,
    /// While it climbs from the ground.
    Takeoff,
    /// On the way.
    Cruise,
    /// In the air before a border, until the tower answers.
    Waiting,
    /// Inside an area with a permission.
    InsideArea,
    /// While the planner is asked again.
    Replanning,
    /// While a transition is flown meanwhile.
    Transition,
    /// While it comes down.
    Landing,
    /// While another flag is answered.
    Responding,
    /// After the end of the mission, on the ground.
    AfterEnd,
    /// While a process carries out the declared skill of this number, and does so from then on.
    Task(usize, Conduct),
}

impl Stage {
    /// All of them.
    pub const ALL: [Stage; 10] = [
        Stage::OnGround,
        Stage::Takeoff,
        Stage::Cruise,
        Stage::Waiting,
        Stage::InsideArea,
        Stage::Replanning,
        Stage::Transition,
        Stage::Landing,
        Stage::Responding,
        Stage::AfterEnd,
    ];

    /// Whether a declared skill is under way in it.
    fn is_task(self) -> bool {
        matches!(self, Stage::Task(..))
    }

    /// The mission that leads there.
    pub(super) fn mission(self, skills: &DeclaredSkills) -> String {
        match self {
            Stage::OnGround | Stage::Takeoff | Stage::Landing | Stage::AfterEnd => HOP.to_owned(),
            Stage::Task(number, _) => skills.all().get(number).map_or(String::new(), task_mission),
            _ => GATE.to_owned(),
        }
    }

    /// The ground under it.
    pub(super) fn ground(self) -> Ground {
        let hill = |east_m: f64| Patch::square((0.0, east_m), 20.0, HILL_M, Surface::Land);
        let water = Patch { north_m: [-200.0, 200.0], east_m: [95.0, 112.0], height_m: 0.0, surface: Surface::Water };
        let patches = match self {
            Stage::Task(..) => Vec::new(),
            Stage::OnGround | Stage::Takeoff | Stage::Landing | Stage::AfterEnd => vec![hill(40.0)],
            _ => vec![water, hill(130.0)],
        };
        Ground { patches, ..Ground::default() }
    }

    /// How the tower answers.
    pub(super) fn permissions(self) -> Policy {
        match self {
            Stage::Waiting => Policy::Silent,
            _ => Policy::Grant,
        }
    }

    /// Flies there; whether it came.
    pub(super) fn reach(self, simulation: &mut Simulation<'_>) -> bool {
        if self.is_task() {
            simulation.skills_conduct(Conduct::Endless);
        }
        if matches!(self, Stage::Replanning | Stage::Transition) {
            if !Stage::Cruise.reach(simulation) {
                return false;
            }
            // A planner that answers at once is never waited for.
            simulation.freeze("planner", PLANS);
            simulation.order(Verb::Replan(v1::ReplanMission {}));
        }
        let mut waited = Duration::ZERO;
        while waited < LIMIT {
            simulation.pass(STEP);
            waited += STEP;
            if self.is_there(simulation) {
                if let Stage::Task(_, conduct) = self {
                    simulation.skills_conduct(conduct);
                }
                return true;
            }
        }
        false
    }

    fn is_there(self, simulation: &Simulation<'_>) -> bool {
        let seen = simulation.seen.borrow();
        let Some(aircraft) = &seen.aircraft else { return false };
        let (position, velocity) = (aircraft.position.unwrap_or_default(), aircraft.velocity.unwrap_or_default());
        let (height_m, east_m) = (-position.down_m, position.east_m);
        let speed_m_s = velocity.north_m_s.hypot(velocity.east_m_s);
        let skill = seen.manager.skill();
        match self {
            Stage::OnGround => seen.manager.phase() != MissionPhase::Unspecified,
            Stage::Takeoff => skill == SkillKind::Takeoff && 2.0 < height_m,
            Stage::Cruise | Stage::Responding => {
                skill == SkillKind::Offboard && 5.0 < height_m && 5.0 < east_m && !seen.manager.in_transition
            }
            Stage::Waiting => 5.0 < height_m && 10.0 < east_m && speed_m_s < 0.5,
            Stage::InsideArea => AREA_M.0 + 5.0 < east_m && east_m < AREA_M.1 - 5.0 && 5.0 < height_m,
            Stage::Replanning => seen.manager.phase() == MissionPhase::Replanning && 5.0 < height_m,
            Stage::Transition => seen.manager.in_transition && 5.0 < height_m,
            Stage::Landing => skill == SkillKind::Land && HILL_M + 3.0 < height_m,
            Stage::AfterEnd => seen.report.is_some() && seen.is_on_ground(),
            Stage::Task(..) => {
                let flies = skill == SkillKind::Offboard && 5.0 < east_m && !seen.manager.in_transition;
                skill == SkillKind::Task || (flies && seen.has_task_along())
            }
        }
    }
}

/// As users read it.
impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Stage::Task(_, Conduct::Deaf) => "a declared skill under way, whose process hears nothing more",
            Stage::Task(_, Conduct::Gone) => "a declared skill under way, whose process has died",
            Stage::Task(..) => "a declared skill under way",
            Stage::OnGround => "on the ground",
            Stage::Takeoff => "takeoff",
            Stage::Cruise => "cruise",
            Stage::Waiting => "waiting for a permission",
            Stage::InsideArea => "inside an area",
            Stage::Replanning => "replanning",
            Stage::Transition => "transition",
            Stage::Landing => "landing",
            Stage::Responding => "response under way",
            Stage::AfterEnd => "after the end",
        })
    }
}
