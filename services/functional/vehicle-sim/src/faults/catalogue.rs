//! The table of faults: name, arguments, effect.

use super::Fault;
use super::arguments::Arguments;

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
        effect: "the vehicle does not hear its ground station for SECONDS of mission time",
        parse: |it| Ok(Fault::LinkLoss(it.number("SECONDS", 0.0..=1e6)?)),
    },
    CatalogueEntry {
        name: "blocked_landing",
        arguments: "[on|off]",
        effect: "a landing stops above the ground and does not end",
        parse: |it| Ok(Fault::BlockedLanding(it.switch()?)),
    },
    CatalogueEntry {
        name: "land_detector",
        arguments: "landed|flying|works",
        effect: "the land detector reports the ground, or the air, whatever is true; in the air it never disarms by itself",
        parse: |it| Ok(Fault::LandDetector(it.detector()?)),
    },
    CatalogueEntry {
        name: "intruder",
        arguments: "NORTH EAST HEIGHT VNORTH VEAST",
        effect: "another aircraft appears at NORTH EAST HEIGHT (m) and flies straight and level at VNORTH VEAST (m/s)",
        parse: |it| {
            Ok(Fault::Intruder {
                north_m: it.number("NORTH", -1e5..=1e5)?,
                east_m: it.number("EAST", -1e5..=1e5)?,
                height_m: it.number("HEIGHT", -1e3..=2e4)?,
                north_m_s: it.number("VNORTH", -400.0..=400.0)?,
                east_m_s: it.number("VEAST", -400.0..=400.0)?,
            })
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
