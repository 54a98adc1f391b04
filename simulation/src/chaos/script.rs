//! What is flown and what goes wrong meanwhile, as data.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::quantity::Positive;
use vehicle_sim::ground::Ground;

use super::trouble::Trouble;
use crate::Machine;

/// One flight.
#[derive(Debug, Clone)]
pub struct Script {
    /// Of every draw of the simulator and the services.
    pub seed: u64,
    /// What is flown.
    pub mission: Choice,
    /// How the control tower answers.
    pub permissions: Policy,
    /// Mission seconds for which its grants hold; `None`: as configured.
    pub grant_valid_s: Option<Positive>,
    /// On what it is flown.
    pub machine: Machine,
    /// What happens, each with its time after the start, in order.
    pub troubles: Vec<(Duration, Trouble)>,
    /// A while after the last trouble all ends that can end: faults are cleared, flags lowered, and an operator resumes the mission.
    /// A mission that is still not over in the end has something against it.
    pub settles: bool,
    /// The ground: level at the height of the take-off point, but under a drawn mission.
    pub ground: Ground,
}

/// Which mission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Choice {
    /// The one that the configuration names.
    Configured,
    /// That of a file.
    File(PathBuf),
    /// This text of a mission file, which nobody designed.
    Drawn(String),
}

/// Faults with which the vehicle does not know where it is, or cannot fly where it wants to: by name, and by topic if the fault takes
/// one. Where it then flies is not judged by the rules of the airspace.
const MISLEADING: [(&str, Option<&str>); 13] = [
    ("gnss_loss", None),
    ("estimator_drift", None),
    ("estimator_invalid", None),
    ("position_jump", None),
    ("frame_jump", None),
    ("restart_autopilot", None),
    ("steering_error", None),
    ("motor_failure", None),
    ("wind", None),
    // Another pilot flies it where he wants.
    ("pilot_takes_over", None),
    ("autopilot_failsafe", None),
    ("freeze", Some("vehicle_local_position")),
    ("drop", Some("vehicle_local_position")),
];

/// The wind that plans allow for, gusts included. (`[planner] wind_m_s`)
const PLANNED_M_S: f64 = 8.0;

/// The mean of a fault `wind` and two standard deviations of its gusts.
fn strongest_m_s(args: &[String]) -> f64 {
    let number = |at: usize| args.get(at).and_then(|it| it.parse::<f64>().ok()).unwrap_or_default();
    number(0).hypot(number(1)) + 2.0 * number(2)
}

impl Script {
    /// With grants as configured, over level ground; all trouble ends in the end.
    pub fn new(
        seed: u64,
        mission: Choice,
        permissions: Policy,
        machine: Machine,
        troubles: Vec<(Duration, Trouble)>,
    ) -> Script {
        let ground = Ground::default();
        Script { seed, mission, permissions, grant_valid_s: None, machine, troubles, settles: true, ground }
    }

    /// Whether the vehicle knows all the time where it is, and can fly there.
    pub fn knows_its_place(&self) -> bool {
        !self.has_fault(|name, args| {
            let is_of = |topic: &Option<&str>| topic.is_none_or(|topic| args.first().is_some_and(|it| it == topic));
            let is_weak = name == "wind" && strongest_m_s(args) <= PLANNED_M_S;
            !is_weak && MISLEADING.iter().any(|(misleading, topic)| *misleading == name && is_of(topic))
        })
    }

    /// Whether it knows all the time where it is, also where a wind carries it away.
    pub fn knows_its_place_in_wind(&self) -> bool {
        self.without("wind").knows_its_place()
    }

    /// Whether it flies as fast as it wants to.
    pub fn flies_its_speed(&self) -> bool {
        !self.has_fault(|name, _| name == "slow_flight")
    }

    /// Whether other traffic appears.
    pub fn has_traffic(&self) -> bool {
        self.has_fault(|name, _| matches!(name, "intruder" | "head_on" | "circling"))
    }

    fn without(&self, fault: &str) -> Script {
        let is_it = |it: &Trouble| matches!(it, Trouble::Fault { name, .. } if name == fault);
        self.with(self.troubles.iter().filter(|(_, it)| !is_it(it)).cloned().collect())
    }

    /// Whether the vehicle says the truth about the mode that it flies in, if it says anything.
    pub fn tells_its_mode(&self) -> bool {
        !self.has_fault(|name, args| name == "freeze" && args.first().is_some_and(|it| it == "vehicle_status"))
    }

    /// Whether the battery is left as empty as no autopilot arms with: nobody here puts another one in.
    pub fn empties_battery(&self) -> bool {
        const NEARLY_EMPTY: f64 = 0.05;
        let is_empty = |it: &String| it.parse().is_ok_and(|charge: f64| charge < NEARLY_EMPTY);
        self.has_fault(|name, args| name == "battery" && args.first().is_some_and(is_empty))
    }

    fn has_fault(&self, is_it: impl Fn(&str, &[String]) -> bool) -> bool {
        self.troubles.iter().any(|(_, it)| matches!(it, Trouble::Fault { name, args } if is_it(name, args)))
    }

    /// The same flight with other troubles.
    pub fn with(&self, troubles: Vec<(Duration, Trouble)>) -> Script {
        Script { troubles, ..self.clone() }
    }
}

/// What is flown, in one line; without the troubles.
impl fmt::Display for Script {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.mission {
            Choice::Configured => f.write_str("configured mission")?,
            Choice::File(path) => write!(f, "{}", path.display())?,
            Choice::Drawn(_) => f.write_str("drawn mission")?,
        }
        write!(f, ", permissions: {}", self.permissions)?;
        if let Some(valid_s) = self.grant_valid_s {
            write!(f, " for {} s", valid_s.get())?;
        }
        if let Machine::Busy { .. } = self.machine {
            f.write_str(", busy machine")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(fault: &str, knows_its_place: bool, tells_its_mode: bool) {
        let mut words = fault.split(' ').map(str::to_owned);
        let trouble = Trouble::Fault { name: words.next().unwrap(), args: words.collect() };
        let troubles = vec![(Duration::ZERO, Trouble::Flag("obstacle".into())), (Duration::from_secs(9), trouble)];
        let script = Script::new(1, Choice::Configured, Policy::Grant, Machine::Ideal, troubles);
        assert_eq!(script.knows_its_place(), knows_its_place, "{fault}");
        assert_eq!(script.tells_its_mode(), tells_its_mode, "{fault}");
    }

    #[test]
    fn a_fault_says_what_cannot_be_judged() {
        check("battery 0.1", true, true);
        check("wind 6 6 2", false, true);
        check("wind 6 5", true, true);
        check("gnss_loss", false, true);
        check("steering_error 30 0", false, true);
        check("drain 4", true, true);
        check("freeze vehicle_local_position", false, true);
        check("freeze vehicle_land_detected", true, true);
        check("freeze vehicle_status", true, false);
        check("drop vehicle_status", true, true);
    }
}
