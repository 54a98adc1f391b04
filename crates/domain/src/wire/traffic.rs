//! Traffic that comes near, to and from its message.

use kittiwake_proto::v1;

use super::{InvalidMessage, finite};
use crate::fmu::TransponderReport;
use crate::traffic::Mover;

impl From<Mover> for v1::NearTraffic {
    fn from(it: Mover) -> v1::NearTraffic {
        let Mover { id, kind, position, velocity, turn_rad_s } = it;
        v1::NearTraffic { report: Some(TransponderReport { id, position, velocity, kind }.into()), turn_rad_s }
    }
}

impl TryFrom<v1::NearTraffic> for Mover {
    type Error = InvalidMessage;
    fn try_from(message: v1::NearTraffic) -> Result<Mover, InvalidMessage> {
        let turn_rad_s = finite("turn_rad_s", message.turn_rad_s)?;
        let report = message.report.ok_or(InvalidMessage::Missing("report"))?;
        let TransponderReport { id, position, velocity, kind } = report.try_into()?;
        Ok(Mover { id, kind, position, velocity, turn_rad_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fmu::TrafficKind;
    use crate::geometry::{Ned, NedVelocity};

    #[test]
    fn it_comes_back_as_it_was() {
        let mover = Mover {
            id: "a".into(),
            kind: TrafficKind::Vessel,
            position: Ned::new(1.0, -2.0, 3.0),
            velocity: NedVelocity::new(4.0, 5.0, -6.0),
            turn_rad_s: -0.1,
        };
        assert_eq!(Mover::try_from(v1::NearTraffic::from(mover.clone())), Ok(mover.clone()));
        let turns = v1::NearTraffic { turn_rad_s: f64::NAN, ..mover.into() };
        assert!(Mover::try_from(turns).is_err());
    }
}
