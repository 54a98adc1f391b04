//! Rates and load at real time: in a hover, over a mission, landed with nothing left to do, and the same
//! without the processes that publish at fixed rates, so that what is left is what polls.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake::inject::Injector;
use kittiwake::service::Service;
use kittiwake::settings::Settings;
use kittiwake::up::supervise::Child;
use kittiwake_proto::v1::{FlagEvent, SkillKind, SkillState};
use serde::Serialize;

use crate::load::{Load, Watch};
use crate::rates::{self, Rate};
use crate::system::{System, await_skill, is_report};

/// By the process's name.
pub(crate) type Loads = BTreeMap<&'static str, Load>;

/// What was measured.
#[derive(Debug, Serialize)]
pub(crate) struct RealTime {
    pub hover: Loads,
    pub mission: Loads,
    pub landed: Loads,
    /// Landed, with the vehicle and the monitor gone: no topic of a fixed rate is left. Empty if they have no process of their own.
    pub silent: Loads,
    pub rates: Vec<Rate>,
}

/// Rates are counted for this time.
const RATES: Duration = Duration::from_secs(20);
/// How long the landed system is measured.
const LANDED: Duration = Duration::from_secs(20);
/// A flight of the mission takes three minutes.
const FLIGHT: Duration = Duration::from_secs(600);
/// Holds until it is lowered.
const PAUSE: &str = "operator_pause";

/// Flies the mission once with the executable `program`, with a hover on its way.
pub(crate) fn measure(
    program: &Path,
    config: &Path,
    vehicle: &str,
    processes: &[Child],
    hover: Duration,
    say: impl Fn(&str),
) -> Result<RealTime, String> {
    let mut settings = Settings::of_file(config);
    settings.permissions = Some(Policy::Grant);
    settings.http = Some(([127, 0, 0, 1], 0).into());
    let mut system = System::start(program, &settings, vehicle, processes)?;
    let mut heard = Vec::new();
    say("taking off");
    await_skill(&system, SkillKind::Offboard, SkillState::Execute, &mut heard)?;
    system.listen(Duration::from_secs(5), &mut heard, |_| false)?;
    system.join(pause(true));
    await_skill(&system, SkillKind::Stop, SkillState::Ended, &mut heard)?;
    say("hovering");
    let watch = Watch::begin(&system);
    system.listen(hover, &mut heard, |_| false)?;
    let hover = watch.end();
    say("counting rates");
    let rates = rates::measure(system.link(), RATES)?;
    system.join(pause(false));
    say("flying on");
    let watch = Watch::begin(&system);
    if !system.listen(FLIGHT, &mut heard, is_report)? {
        return Err("the mission did not end".into());
    }
    let mission = watch.end();
    say("landed");
    let watch = Watch::begin(&system);
    system.listen(LANDED, &mut heard, |_| false)?;
    let landed = watch.end();
    let of_fixed_rates = [Service::Monitor, Service::VehicleSim].map(Child::Service);
    // A monitor that has no process of its own cannot be ended alone.
    if !of_fixed_rates.iter().all(|it| processes.contains(it)) {
        return Ok(RealTime { hover, mission, landed, silent: Loads::new(), rates });
    }
    say("landed, without the topics of fixed rates");
    system.end(&of_fixed_rates);
    let watch = Watch::begin(&system);
    system.listen(LANDED, &mut heard, |_| false)?;
    Ok(RealTime { hover, mission, landed, silent: watch.end(), rates })
}

fn pause(raised: bool) -> Injector {
    Injector::flag(FlagEvent { name: PAUSE.to_owned(), raised, reason: "measurement".into(), ..Default::default() })
}
