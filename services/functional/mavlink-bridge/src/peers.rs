//! Which of those on the link is the autopilot that is flown.
//!
//! Both autopilots forward what others say, so that a ground station's, a gimbal's or a companion's heartbeat arrives as well. Only
//! component 1 of one system is believed, and only if it is a multirotor that there is a personality for.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;

use crate::frame::{Found, Frame};
use crate::heard::{Heard, Heartbeat, heard};
use crate::link::Voice;

/// MAV_COMP_ID_AUTOPILOT1.
const AUTOPILOT_COMPONENT: u8 = 1;
/// MAV_COMP_ID_CAMERA to MAV_COMP_ID_CAMERA6.
const CAMERA_COMPONENTS: std::ops::RangeInclusive<u8> = 100..=105;
/// A second autopilot that was silent for this long is gone.
const GONE: Duration = Duration::from_secs(5);
/// MAV_TYPE of multirotors and helicopters: quadrotor, coaxial, helicopter, hexarotor, octorotor, tricopter, dodecarotor, decarotor.
const COPTERS: [u8; 8] = [2, 3, 4, 13, 14, 15, 29, 35];
/// MAV_AUTOPILOT_INVALID: a component that is not a flight controller.
const NO_AUTOPILOT: u8 = 8;

/// What was heard of whom.
#[derive(Debug, Default)]
pub(crate) struct Peers {
    /// 0: any.
    wanted: u8,
    chosen: Option<(u8, u8)>,
    /// Autopilots by system, with when they were heard and why they cannot be flown.
    autopilots: BTreeMap<u8, (Time, Option<String>)>,
    /// Why something that has arrived was not believed, if anything was.
    pub(crate) refused: Option<String>,
}

/// Whether an autopilot speaks in what a link has handed on: with a heartbeat. All else may be forwarded by others.
pub fn autopilot_voice(found: &[Found]) -> Voice {
    let speaks = found.iter().any(|it| match it {
        Found::Frame(frame) if frame.component() == AUTOPILOT_COMPONENT => {
            matches!(heard(frame), Some(Heard::Heartbeat(it)) if it.autopilot != NO_AUTOPILOT)
        }
        _ => false,
    });
    if speaks { Voice::Believed } else { Voice::Unknown }
}

/// Who a heartbeat belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Whose {
    /// The one that is flown; `first`: with this one it was found.
    Flown {
        /// It was not known before.
        first: bool,
    },
    /// Not an autopilot that is flown.
    NotFlown,
}

impl Peers {
    /// Nobody was heard; `wanted` is the system to fly, 0 for any.
    pub(crate) fn new(wanted: u8) -> Peers {
        Peers { wanted, ..Peers::default() }
    }

    /// The system of the one that is flown.
    pub(crate) fn system(&self) -> Option<u8> {
        self.chosen.map(|(system, _)| system)
    }

    /// Whether a frame comes from the one that is flown.
    pub(crate) fn is_flown(&self, frame: &Frame) -> bool {
        Some(frame.system()) == self.system() && frame.component() == AUTOPILOT_COMPONENT
    }

    /// Whether a frame comes from a camera on board of the one that is flown.
    pub(crate) fn is_camera(&self, frame: &Frame) -> bool {
        Some(frame.system()) == self.system() && CAMERA_COMPONENTS.contains(&frame.component())
    }

    /// A heartbeat was heard. There is a personality for `has_personality`.
    pub(crate) fn beat(&mut self, frame: &Frame, heartbeat: &Heartbeat, has_personality: bool, now: Time) -> Whose {
        if frame.component() != AUTOPILOT_COMPONENT || heartbeat.autopilot == NO_AUTOPILOT {
            return Whose::NotFlown;
        }
        let system = frame.system();
        let misfit = match (has_personality, COPTERS.contains(&heartbeat.kind)) {
            _ if self.wanted != 0 && system != self.wanted => {
                Some(format!("its system id is {system}, expected {} (mavlink_bridge.system)", self.wanted))
            }
            (false, _) => Some(format!("its autopilot is {}, expected 12 (PX4) or 3 (ArduPilot)", heartbeat.autopilot)),
            (true, false) => Some(format!("its type is {}, expected a multirotor", heartbeat.kind)),
            (true, true) => None,
        };
        let fits = misfit.is_none();
        // As many systems as there are ids.
        self.autopilots.insert(system, (now, misfit));
        if !fits {
            return Whose::NotFlown;
        }
        let kind = (system, heartbeat.autopilot);
        match self.chosen {
            None => {
                self.chosen = Some(kind);
                Whose::Flown { first: true }
            }
            // The same system with another firmware is another autopilot.
            Some((chosen, autopilot)) if chosen == system => {
                self.chosen = Some(kind);
                Whose::Flown { first: autopilot != heartbeat.autopilot }
            }
            Some(_) => Whose::NotFlown,
        }
    }

    /// Why nothing is flown, or must not take off: nobody, somebody else, or more than one.
    pub(crate) fn problem(&self, now: Time) -> Option<String> {
        let present = || self.autopilots.iter().filter(|(_, (at, _))| now - *at <= GONE);
        let fitting = present().filter(|(_, (_, misfit))| misfit.is_none()).map(|(system, _)| system.to_string());
        let fitting = fitting.collect::<Vec<_>>();
        if 1 < fitting.len() {
            let systems = fitting.join(" and ");
            return Some(format!(
                "more than one autopilot on the link, systems {systems}: name one as mavlink_bridge.system"
            ));
        }
        if self.chosen.is_some() {
            return None;
        }
        let misfits =
            present().filter_map(|(system, (_, misfit))| Some(format!("system {system}: {}", misfit.as_ref()?)));
        let misfits = misfits.collect::<Vec<_>>();
        Some(match misfits.is_empty() {
            true => match &self.refused {
                None => "no autopilot is heard".to_owned(),
                Some(why) => format!("no autopilot is believed: {why}"),
            },
            false => format!("no autopilot to fly: {}", misfits.join("; ")),
        })
    }
}
