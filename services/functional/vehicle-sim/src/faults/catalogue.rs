//! The table of faults: name, arguments, effect.

use super::Fault;
use super::arguments::Arguments;
use crate::pilot::Mode;

/// A fault of the catalogue, as users read it.
#[derive(Debug)]
pub struct CatalogueEntry {
    /// Its name.
    pub name: &'static str,
    /// The arguments after the name; those in brackets may be left out.
    pub arguments: &'static str,
    /// What it does, in one line.
    pub effect: &'static str,
    pub(super) parse: fn(&mut Arguments) -> Result<Fault, String>,
}

/// Every fault of the simulator.
pub fn catalogue() -> &'static [CatalogueEntry] {
    CATALOGUE
}

const CATALOGUE: &[CatalogueEntry] = &[
    CatalogueEntry {
        name: "reject_acks",
        arguments: "COUNT",
        effect: "the next COUNT commands are not carried out and are acknowledged as rejected",
        parse: |it| Ok(Fault::RejectAcks(it.count("COUNT", 1..=1_000_000)?)),
    },
    CatalogueEntry {
        name: "swallow_acks",
        arguments: "COUNT",
        effect: "the next COUNT commands are carried out but not acknowledged",
        parse: |it| Ok(Fault::SwallowAcks(it.count("COUNT", 1..=1_000_000)?)),
    },
    CatalogueEntry {
        name: "freeze",
        arguments: "TOPIC",
        effect: "the topic repeats its present value at its rate",
        parse: |it| Ok(Fault::Freeze(it.topic()?)),
    },
    CatalogueEntry {
        name: "drop",
        arguments: "TOPIC",
        effect: "the topic falls silent",
        parse: |it| Ok(Fault::Drop(it.topic()?)),
    },
    CatalogueEntry {
        name: "thaw",
        arguments: "TOPIC",
        effect: "ends a freeze or a drop of the topic",
        parse: |it| Ok(Fault::Thaw(it.topic()?)),
    },
    CatalogueEntry {
        name: "battery",
        arguments: "FRACTION",
        effect: "sets the battery's charge to FRACTION (0 to 1)",
        parse: |it| Ok(Fault::Battery(it.number("FRACTION", 0.0..=1.0)?)),
    },
    CatalogueEntry {
        name: "battery_temperature",
        arguments: "DEGREES",
        effect: "sets the temperature of the battery's cells to DEGREES Celsius; they cool down by themselves",
        parse: |it| Ok(Fault::BatteryTemperature(it.number("DEGREES", -40.0..=150.0)?)),
    },
    CatalogueEntry {
        name: "battery_fault",
        arguments: "[on|off]",
        effect: "the battery reports a fault of its own, whatever its charge",
        parse: |it| Ok(Fault::FaultyBattery(it.switch()?)),
    },
    CatalogueEntry {
        name: "gnss_loss",
        arguments: "[on|off]",
        effect: "no satellites: dead reckoning for five seconds, then a blind descent",
        parse: |it| Ok(Fault::GnssLoss(it.switch()?)),
    },
    CatalogueEntry {
        name: "estimator_drift",
        arguments: "M_PER_S",
        effect: "the position estimate drifts away at M_PER_S; 0 ends the drift",
        parse: |it| Ok(Fault::EstimatorDrift(it.number("M_PER_S", 0.0..=100.0)?)),
    },
    CatalogueEntry {
        name: "estimator_invalid",
        arguments: "[on|off]",
        effect: "the estimator no longer vouches for the position",
        parse: |it| Ok(Fault::EstimatorInvalid(it.switch()?)),
    },
    CatalogueEntry {
        name: "motor_failure",
        arguments: "[COUNT]",
        effect: "COUNT motors fail (1 if left out): 1 is a spinning descent, 2 are a fall, 0 repairs them",
        parse: |it| Ok(Fault::MotorFailure(it.count_or("COUNT", 0..=4, 1)? as u8)),
    },
    CatalogueEntry {
        name: "wind",
        arguments: "NORTH EAST [GUST]",
        effect: "the wind blows towards NORTH EAST (m/s) with gusts of standard deviation GUST",
        parse: |it| {
            Ok(Fault::Wind {
                north_m_s: it.number("NORTH", -60.0..=60.0)?,
                east_m_s: it.number("EAST", -60.0..=60.0)?,
                gust_m_s: it.number_or("GUST", 0.0..=30.0, 0.0)?,
            })
        },
    },
    CatalogueEntry {
        name: "link_loss",
        arguments: "SECONDS",
        effect: "the autopilot reports for SECONDS of mission time that it does not hear its own ground station; the link to the gateway stays",
        parse: |it| Ok(Fault::LinkLoss(it.number("SECONDS", 0.0..=1e6)?)),
    },
    CatalogueEntry {
        name: "hide_target",
        arguments: "HEIGHT",
        effect: "a landing on a target does not see it at HEIGHT metres above the ground and below; 0 shows it",
        parse: |it| Ok(Fault::HideTarget(it.number("HEIGHT", 0.0..=1000.0)?)),
    },
    CatalogueEntry {
        name: "blocked_landing",
        arguments: "[on|off]",
        effect: "a landing stops above the ground and does not end",
        parse: |it| Ok(Fault::BlockedLanding(it.switch()?)),
    },
    CatalogueEntry {
        name: "gripper_stuck",
        arguments: "[on|off]",
        effect: "the gripper takes the command to release and does not open; freed, it opens at once",
        parse: |it| Ok(Fault::GripperStuck(it.switch()?)),
    },
    CatalogueEntry {
        name: "land_detector",
        arguments: "landed|flying|works",
        effect: "the land detector reports the ground, or the air, whatever is true; in the air it never disarms by itself",
        parse: |it| Ok(Fault::LandDetector(it.detector()?)),
    },
    CatalogueEntry {
        name: "intruder",
        arguments: "NORTH EAST HEIGHT VNORTH VEAST [KIND]",
        effect: "another aircraft appears at NORTH EAST HEIGHT (m) and flies straight and level at VNORTH VEAST (m/s); KIND is crewed \
                 (if left out), uncrewed or vessel",
        parse: |it| {
            Ok(Fault::Intruder {
                north_m: it.number("NORTH", -1e5..=1e5)?,
                east_m: it.number("EAST", -1e5..=1e5)?,
                height_m: it.number("HEIGHT", -1e3..=2e4)?,
                north_m_s: it.number("VNORTH", -400.0..=400.0)?,
                east_m_s: it.number("VEAST", -400.0..=400.0)?,
                kind: it.traffic_kind()?,
            })
        },
    },
    CatalogueEntry {
        name: "circling",
        arguments: "NORTH EAST HEIGHT RADIUS SPEED [KIND]",
        effect: "another aircraft appears and flies a level circle of RADIUS (m) round NORTH EAST HEIGHT (m) at SPEED (m/s); KIND as of an intruder",
        parse: |it| {
            Ok(Fault::Circling {
                north_m: it.number("NORTH", -1e5..=1e5)?,
                east_m: it.number("EAST", -1e5..=1e5)?,
                height_m: it.number("HEIGHT", -1e3..=2e4)?,
                radius_m: it.number("RADIUS", 1.0..=1e5)?,
                speed_m_s: it.number("SPEED", 0.0..=400.0)?,
                kind: it.traffic_kind()?,
            })
        },
    },
    CatalogueEntry {
        name: "head_on",
        arguments: "DISTANCE SPEED [KIND]",
        effect: "another aircraft appears DISTANCE (m) ahead of the vehicle, at its height, and flies at SPEED (m/s) to where the vehicle is \
                 now; KIND as of an intruder",
        parse: |it| {
            Ok(Fault::HeadOn {
                distance_m: it.number("DISTANCE", 1.0..=1e5)?,
                speed_m_s: it.number("SPEED", 0.0..=400.0)?,
                kind: it.traffic_kind()?,
            })
        },
    },
    CatalogueEntry {
        name: "pilot_takes_over",
        arguments: "[manual|hold|return|land]",
        effect: "a pilot or another ground station sets the mode, and keeps it until a mode is commanded; manual, which has no name \
                 here, if left out",
        parse: |it| Ok(Fault::PilotTakesOver(it.mode(Mode::Manual)?)),
    },
    CatalogueEntry {
        name: "autopilot_failsafe",
        arguments: "[hold|return|land] [REASON] | off",
        effect: "the autopilot flies this mode (return if left out) by a failsafe of its own, until a mode is commanded or it is off",
        parse: |it| {
            if it.is("off") {
                return Ok(Fault::AutopilotFailsafe(None));
            }
            let mode = it.mode(Mode::Return)?;
            Ok(Fault::AutopilotFailsafe(Some((mode, it.text().unwrap_or_else(|| "an injected failsafe".into())))))
        },
    },
    CatalogueEntry {
        name: "restart_autopilot",
        arguments: "[holds|falls]",
        effect: "the autopilot starts again: silent for 1.4 s, its clock at zero, its origin where it is; in the air it holds, or its \
                 motors stop",
        parse: |it| Ok(Fault::RestartAutopilot(it.holds()?)),
    },
    CatalogueEntry {
        name: "flight_termination",
        arguments: "",
        effect: "somebody terminates the flight: the motors stop at once, also in the air",
        parse: |_| Ok(Fault::FlightTermination),
    },
    CatalogueEntry {
        name: "frame_jump",
        arguments: "NORTH EAST DOWN",
        effect: "the local frame moves: positions jump by NORTH EAST DOWN (m) while the vehicle stays where it is",
        parse: |it| {
            Ok(Fault::FrameJump {
                north_m: it.number("NORTH", -1e5..=1e5)?,
                east_m: it.number("EAST", -1e5..=1e5)?,
                down_m: it.number("DOWN", -1e4..=1e4)?,
            })
        },
    },
    CatalogueEntry {
        name: "vibration",
        arguments: "M_PER_S2",
        effect: "the frame shakes: the accelerometer's fast part has a standard deviation of M_PER_S2",
        parse: |it| Ok(Fault::Vibration(it.number("M_PER_S2", 0.0..=500.0)?)),
    },
    CatalogueEntry {
        name: "drain",
        arguments: "FACTOR",
        effect: "the motors take FACTOR times what they should: more with ice on the propellers, next to nothing on a cable; 1 ends it",
        parse: |it| Ok(Fault::Drain(it.number("FACTOR", 0.01..=10.0)?)),
    },
    CatalogueEntry {
        name: "position_jump",
        arguments: "NORTH EAST [UP]",
        effect: "the position estimate jumps by NORTH EAST UP (m) and stays there; each one adds to those before",
        parse: |it| {
            Ok(Fault::PositionJump {
                north_m: it.number("NORTH", -1e4..=1e4)?,
                east_m: it.number("EAST", -1e4..=1e4)?,
                up_m: it.number_or("UP", -1e3..=1e3, 0.0)?,
            })
        },
    },
    CatalogueEntry {
        name: "not_ready",
        arguments: "[REASON]",
        effect: "the autopilot would not arm, for REASON; without one it would again",
        parse: |it| Ok(Fault::NotReady(it.text())),
    },
    CatalogueEntry {
        name: "heading_error",
        arguments: "DEGREES",
        effect: "the heading of the position estimate is off by DEGREES; 0 ends it",
        parse: |it| Ok(Fault::HeadingError(it.number("DEGREES", -180.0..=180.0)?)),
    },
    CatalogueEntry {
        name: "steering_error",
        arguments: "NORTH EAST",
        effect: "the autopilot steers for a place NORTH EAST (m) of each position that it is sent; 0 0 ends it",
        parse: |it| {
            Ok(Fault::SteeringError {
                north_m: it.number("NORTH", -1e3..=1e3)?,
                east_m: it.number("EAST", -1e3..=1e3)?,
            })
        },
    },
    CatalogueEntry {
        name: "slow_flight",
        arguments: "[M_PER_S]",
        effect: "the autopilot flies no faster than M_PER_S over ground, whatever it is asked for; without it, than its own limit",
        parse: |it| {
            let speed_m_s = it.number_or("M_PER_S", 0.5..=60.0, f64::INFINITY)?;
            Ok(Fault::SlowFlight(speed_m_s.is_finite().then_some(speed_m_s)))
        },
    },
    CatalogueEntry {
        name: "clear",
        arguments: "",
        effect: "ends all faults; the battery keeps its charge",
        parse: |_| Ok(Fault::Clear),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_catalogue_names_every_fault_once() {
        let mut names: Vec<_> = catalogue().iter().map(|it| it.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), catalogue().len());
        assert!(catalogue().iter().all(|it| !it.effect.is_empty()));
    }
}
