//! Whether the autopilot's parameters make our reaction the earlier one and its failsafes the net below: read over the link, and
//! changed only if that is asked for.
//!
//! It is a table ([`expectations`]) and a state machine that asks for one parameter after the other. It opens no socket.

use std::time::Duration;

use domain::time::Time;

use crate::frame::Frame;
use crate::heard::{Heard, Parameter, heard};
use crate::said::{Said, Speaker};

/// What a parameter should be.
#[derive(Debug, Clone, Copy)]
pub struct Expectation {
    /// Its name.
    pub name: &'static str,
    /// Whether a value is good.
    pub is_good: fn(f64) -> bool,
    /// What `--write` sets; `None`: that is for the operator to choose.
    pub good: Option<f64>,
    /// What should hold, and why.
    pub why: &'static str,
}

const fn row(name: &'static str, is_good: fn(f64) -> bool, good: Option<f64>, why: &'static str) -> Expectation {
    Expectation { name, is_good, good, why }
}

const PX4: &[Expectation] = &[
    row(
        "COM_OF_LOSS_T",
        |it| 0.5 <= it && it <= 2.0,
        Some(1.0),
        "0.5 to 2 s: setpoints come at 20 Hz, and one that is lost must not end the flight",
    ),
    row(
        "COM_OBL_RC_ACT",
        |it| it == 5.0,
        Some(5.0),
        "5 (hold): without setpoints it waits for ours to return; by default it returns at once, through areas that are closed",
    ),
    row("COM_LOW_BAT_ACT", |it| it == 2.0 || it == 3.0, Some(3.0), "2 or 3: 0 only warns, and nothing is below ours"),
    row("BAT_CRIT_THR", |it| it < 0.25, None, "below 0.25, where `battery_low` brings the vehicle home"),
    row("BAT_EMERGEN_THR", |it| it < 0.15, None, "below 0.15: it lands at once, wherever it is"),
    row("COM_DL_LOSS_T", |it| 10.0 <= it, Some(15.0), "10 s or more: `link_lost` answers after 10 s"),
    row(
        "GF_ACTION",
        |it| it != 0.0 && it != 4.0,
        Some(2.0),
        "not 0 (nothing) and not 4 (terminate): the fence is the net",
    ),
    row("COM_DISARM_PRFLT", |it| 5.0 <= it || it < 0.0, Some(10.0), "5 s or more: a takeoff follows the arming"),
    row("MPC_XY_VEL_MAX", |it| 10.0 <= it, None, "10 m/s or more: the planner counts on it (`cruise_m_s`)"),
    row(
        "PLD_BTOUT",
        |it| 4.0 <= it,
        Some(5.0),
        "4 s or more: `landing_target_lost` answers 3 s after a target is lost; PX4 then searches by itself",
    ),
];

const ARDUPILOT: &[Expectation] = &[
    row(
        "GUID_TIMEOUT",
        |it| 1.0 <= it && it <= 3.0,
        Some(3.0),
        "1 to 3 s: it stops when nobody sends setpoints any more",
    ),
    row(
        "BATT_FS_LOW_ACT",
        |it| it == 1.0 || it == 2.0,
        Some(2.0),
        "1 or 2 (land, return): by default nothing is below ours",
    ),
    row("BATT_FS_CRT_ACT", |it| it == 1.0, Some(1.0), "1 (land): by default nothing is below ours"),
    row(
        "FS_GCS_TIMEOUT",
        |it| 10.0 <= it,
        Some(15.0),
        "10 s or more where FS_GCS_ENABLE is set: `link_lost` answers after 10 s, and our heartbeat does not feed it",
    ),
    row("FS_EKF_ACTION", |it| it == 1.0, Some(1.0), "1 (land): without a position nothing else is flown"),
    row("FENCE_ENABLE", |it| it == 1.0, None, "1, with a fence outside of every area that is flown: it is the net"),
    row(
        "FS_THR_ENABLE",
        |it| it == 0.0 || it == 1.0 || it == 3.0,
        None,
        "0 for a vehicle without a pilot: else it returns a second after the pulses stop, also from GUIDED",
    ),
    row("DISARM_DELAY", |it| 5.0 <= it || it == 0.0, Some(10.0), "5 s or more: a takeoff follows the arming"),
    row(
        "PLND_STRICT",
        |it| it == 0.0,
        Some(0.0),
        "0 where PLND_ENABLED is set: with 1 every landing without a target waits for 7 s at 8 m, with 2 for ever",
    ),
    row("WPNAV_SPEED", |it| 1000.0 <= it, None, "1000 cm/s or more: the planner counts on it (`cruise_m_s`)"),
];

/// What the parameters of the autopilot with this MAV_AUTOPILOT should be; `None` for one that there is no personality for.
pub fn expectations(autopilot: u8) -> Option<(&'static str, &'static [Expectation])> {
    match autopilot {
        12 => Some(("PX4", PX4)),
        3 => Some(("ArduPilot", ARDUPILOT)),
        _ => None,
    }
}

/// What was found of one parameter.
#[derive(Debug, Clone, Copy)]
pub struct Finding {
    /// What is expected.
    pub expectation: Expectation,
    /// Its value; `None`: it did not say.
    pub value: Option<f64>,
    /// It was set to this.
    pub written: Option<f64>,
}

impl Finding {
    /// Whether nothing is to be done.
    pub fn is_good(&self) -> bool {
        self.value.is_some_and(self.expectation.is_good) || self.written.is_some()
    }
}

/// The check of one autopilot.
#[derive(Debug)]
pub struct Check {
    writes: bool,
    speaker: Speaker,
    autopilot: Option<(u8, u8, &'static [Expectation])>,
    findings: Vec<Finding>,
    asked: Option<(Time, u32)>,
    /// The value of the parameter at hand, where it is being changed.
    changing: Option<Parameter>,
}

/// A parameter that does not come is asked for again after this time, and so often in all.
const RETRY: Duration = Duration::from_millis(500);
const TRIES: u32 = 4;
/// MAV_PARAM_TYPE_INT32: PX4 sends its bits in the float.
const INT32: u8 = 6;
/// PX4's MAV_AUTOPILOT.
const PX4_AUTOPILOT: u8 = 12;

impl Check {
    /// Nothing was heard. What is not good is changed only if it `writes`.
    pub fn new(writes: bool) -> Check {
        Check {
            writes,
            speaker: Speaker::default(),
            autopilot: None,
            findings: Vec::new(),
            asked: None,
            changing: None,
        }
    }

    /// What was found so far, and the autopilot's MAV_AUTOPILOT.
    pub fn findings(&self) -> (Option<u8>, &[Finding]) {
        (self.autopilot.map(|(_, autopilot, _)| autopilot), &self.findings)
    }

    /// Whether everything was asked for.
    pub fn is_over(&self) -> bool {
        self.autopilot.is_some_and(|(.., rows)| rows.len() <= self.findings.len())
    }

    /// A frame has arrived.
    pub fn take_in(&mut self, frame: &Frame) {
        if frame.component() != 1 {
            return;
        }
        match heard(frame) {
            Some(Heard::Heartbeat(it)) if self.autopilot.is_none() => {
                let rows = expectations(it.autopilot);
                self.autopilot = rows.map(|(_, rows)| (frame.system(), it.autopilot, rows));
            }
            Some(Heard::Parameter(it)) if Some(frame.system()) == self.autopilot.map(|(system, ..)| system) => {
                self.answered(it);
            }
            _ => {}
        }
    }

    fn current(&self) -> Option<Expectation> {
        let (.., rows) = self.autopilot?;
        rows.get(self.findings.len()).copied()
    }

    fn answered(&mut self, parameter: Parameter) {
        let Some(expectation) = self.current().filter(|it| it.name == parameter.name) else { return };
        let value = self.number(&parameter);
        match &self.changing {
            None if self.writes && !(expectation.is_good)(value) && expectation.good.is_some() => {
                self.changing = Some(parameter);
                self.asked = None;
            }
            None => self.found(Finding { expectation, value: Some(value), written: None }),
            Some(before) if expectation.good.is_some_and(|good| (good - value).abs() < 1e-6) => {
                let before = self.number(before);
                self.found(Finding { expectation, value: Some(before), written: Some(value) });
            }
            Some(_) => {}
        }
    }

    fn found(&mut self, finding: Finding) {
        self.findings.push(finding);
        (self.asked, self.changing) = (None, None);
    }

    fn number(&self, parameter: &Parameter) -> f64 {
        let has_bits = parameter.kind == INT32 && self.autopilot.is_some_and(|(_, it, _)| it == PX4_AUTOPILOT);
        if has_bits { f64::from(parameter.value.to_bits() as i32) } else { f64::from(parameter.value) }
    }

    /// The frame to be sent now.
    pub fn due(&mut self, now: Time) -> Option<Frame> {
        let (system, autopilot, _) = self.autopilot?;
        let expectation = self.current()?;
        let tries = match self.asked {
            Some((at, _)) if now - at < RETRY => return None,
            Some((_, TRIES)) => {
                let value = self.changing.as_ref().map(|it| self.number(it));
                self.found(Finding { expectation, value, written: None });
                return None;
            }
            Some((_, tries)) => tries + 1,
            None => 1,
        };
        self.asked = Some((now, tries));
        let mut name = [0; 16];
        name[..expectation.name.len()].copy_from_slice(expectation.name.as_bytes());
        let said = match (&self.changing, expectation.good) {
            (Some(before), Some(good)) => {
                let has_bits = before.kind == INT32 && autopilot == PX4_AUTOPILOT;
                let value = if has_bits { f32::from_bits(good as i32 as u32) } else { good as f32 };
                Said::ParameterSet { name, value, kind: before.kind }
            }
            _ => Said::ParameterRead(name),
        };
        Some(self.speaker.frame(said, system))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    /// Answers every request with `value`; what was written is answered as it was set.
    fn answer(frame: &Frame, value: f32, kind: u8) -> Frame {
        let payload = frame.payload();
        let (name, value) = match frame.id() {
            20 => (&payload[4..], value),
            _ => (&payload[6..22], f32::from_le_bytes([payload[0], payload[1], payload[2], payload[3]])),
        };
        let mut reply = value.to_le_bytes().to_vec();
        reply.extend([0; 4]);
        reply.extend(name);
        reply.resize(24, 0);
        reply.push(kind);
        Frame::new(0, 1, 1, 22, &reply)
    }

    fn run(autopilot: u8, value: f32, kind: u8, writes: bool) -> (Check, usize) {
        let mut check = Check::new(writes);
        check.take_in(&Frame::new(0, 1, 1, 0, &[0, 0, 0, 0, 2, autopilot, 0, 3, 3]));
        let mut written = 0;
        for ms in 0..2_000 {
            if let Some(frame) = check.due(at(ms)) {
                written += usize::from(frame.id() == 23);
                check.take_in(&answer(&frame, value, kind));
            }
        }
        assert!(check.is_over());
        (check, written)
    }

    #[test]
    fn nothing_is_written_unless_it_is_asked_for() {
        for autopilot in [12, 3] {
            let (check, written) = run(autopilot, 0.0, 9, false);
            assert_eq!(written, 0);
            assert!(check.findings().1.iter().any(|it| !it.is_good()));
            let (check, written) = run(autopilot, -99.0, 9, true);
            let changeable =
                expectations(autopilot).unwrap().1.iter().filter(|it| it.good.is_some() && !(it.is_good)(-99.0));
            assert_eq!(written, changeable.count());
            assert_eq!(check.findings().1.iter().filter(|it| it.written.is_some()).count(), written);
        }
    }

    #[test]
    fn whole_numbers_of_px4_travel_as_bits() {
        let (check, _) = run(12, f32::from_bits(5), INT32, false);
        let (_, findings) = check.findings();
        let hold = findings.iter().find(|it| it.expectation.name == "COM_OBL_RC_ACT").unwrap();
        assert_eq!(hold.value, Some(5.0));
        let (check, _) = run(3, 1.0, INT32, false);
        assert_eq!(check.findings().1[1].value, Some(1.0));
    }

    #[test]
    fn an_autopilot_that_does_not_answer_is_given_up() {
        let mut check = Check::new(false);
        check.take_in(&Frame::new(0, 1, 1, 0, &[0, 0, 0, 0, 2, 3, 0, 3, 3]));
        for ms in 0..60_000 {
            check.due(at(ms));
        }
        assert!(check.is_over() && check.findings().1.iter().all(|it| it.value.is_none() && !it.is_good()));
    }

    #[test]
    fn what_is_written_is_good() {
        for autopilot in [12, 3] {
            for it in expectations(autopilot).unwrap().1 {
                assert!(it.good.is_none_or(it.is_good), "{}", it.name);
                assert!(it.name.len() <= 16);
            }
        }
    }
}
