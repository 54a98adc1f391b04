//! The table of faults: name, arguments, effect.

use kittiwake_proto::v1;

use super::Fault;
use super::arguments::Arguments;

/// A line of the catalogue.
#[derive(Debug)]
pub struct Entry {
    /// What one calls it.
    pub name: &'static str,
    /// What comes after the name; brackets: may be left out.
    pub arguments: &'static str,
    /// What it does, in one line for a human.
    pub effect: &'static str,
    pub(super) parse: fn(&mut Arguments) -> Result<Fault, String>,
}

/// Every fault there is.
pub fn catalogue() -> &'static [Entry] {
    CATALOGUE
}

/// The same, for whoever asks over the bus.
pub fn to_wire() -> Vec<v1::FaultKind> {
    let kind = |it: &Entry| v1::FaultKind {
        name: it.name.to_owned(),
        arguments: it.arguments.to_owned(),
        effect: it.effect.to_owned(),
    };
    CATALOGUE.iter().map(kind).collect()
}

const CATALOGUE: &[Entry] = &[
    Entry {
        name: "reject_acks",
        arguments: "COUNT",
        effect: "the next COUNT commands are not carried out and are acknowledged as rejected",
        parse: |it| Ok(Fault::RejectAcks(it.count("COUNT", 1..=1_000_000)?)),
    },
    Entry {
        name: "swallow_acks",
        arguments: "COUNT",
        effect: "the next COUNT commands are carried out but not acknowledged",
        parse: |it| Ok(Fault::SwallowAcks(it.count("COUNT", 1..=1_000_000)?)),
    },
    Entry {
        name: "freeze",
        arguments: "TOPIC",
        effect: "the topic goes on at its rate with the value it has now",
        parse: |it| Ok(Fault::Freeze(it.topic()?)),
    },
    Entry {
        name: "drop",
        arguments: "TOPIC",
        effect: "the topic falls silent",
        parse: |it| Ok(Fault::Drop(it.topic()?)),
    },
    Entry {
        name: "thaw",
        arguments: "TOPIC",
        effect: "the topic is neither frozen nor dropped any more",
        parse: |it| Ok(Fault::Thaw(it.topic()?)),
    },
    Entry {
        name: "battery",
        arguments: "FRACTION",
        effect: "the battery's charge is FRACTION (0 to 1) from now on",
        parse: |it| Ok(Fault::Battery(it.number("FRACTION", 0.0..=1.0)?)),
    },
    Entry {
        name: "gnss_loss",
        arguments: "[on|off]",
        effect: "no satellites: dead reckoning for five seconds, then a blind descent",
        parse: |it| Ok(Fault::GnssLoss(it.switch()?)),
    },
    Entry {
        name: "estimator_drift",
        arguments: "M_PER_S",
        effect: "the position estimate runs away from the truth at M_PER_S; 0 ends it",
        parse: |it| Ok(Fault::EstimatorDrift(it.number("M_PER_S", 0.0..=100.0)?)),
    },
    Entry {
        name: "estimator_invalid",
        arguments: "[on|off]",
        effect: "the estimator does not vouch for the position any more",
        parse: |it| Ok(Fault::EstimatorInvalid(it.switch()?)),
    },
    Entry {
        name: "motor_failure",
        arguments: "[COUNT]",
        effect: "COUNT motors fail (1 unless said): 1 is a spinning descent, 2 are a fall, 0 repairs them",
        parse: |it| Ok(Fault::MotorFailure(it.count_or("COUNT", 0..=4, 1)? as u8)),
    },
    Entry {
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
    Entry {
        name: "link_loss",
        arguments: "SECONDS",
        effect: "the vehicle does not hear its ground station for SECONDS of mission time",
        parse: |it| Ok(Fault::LinkLoss(it.number("SECONDS", 0.0..=1e6)?)),
    },
    Entry {
        name: "blocked_landing",
        arguments: "[on|off]",
        effect: "a landing stops above the ground and does not end",
        parse: |it| Ok(Fault::BlockedLanding(it.switch()?)),
    },
    Entry {
        name: "intruder",
        arguments: "NORTH EAST HEIGHT VNORTH VEAST",
        effect: "another aircraft appears there (m) and flies straight and level (m/s)",
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
    Entry {
        name: "clear",
        arguments: "",
        effect: "ends all faults; a battery stays as empty as it is",
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
