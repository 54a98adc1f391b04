//! A ground station that watches over the bridge, and takes over.

use std::collections::BTreeSet;

use domain::geometry::Ned;
use fake_autopilots::Kind;
use kittiwake_proto::v1::DecisionRecord;
use mavlink_bridge::frame::Frame;

use crate::stories::mavlink_bridge::rig::{LOITER, OFFBOARD, Rig, Station};

/// The command of ground station 255 that selects a mode: MAV_CMD_DO_SET_MODE.
fn select(mode: f32, sub_mode: f32) -> Frame {
    let params = [1.0, mode, sub_mode, 0.0, 0.0, 0.0, 0.0];
    let mut payload: Vec<u8> = params.iter().flat_map(|it: &f32| it.to_le_bytes()).collect();
    payload.extend([176, 0, 1, 1, 0]);
    Frame::new(1, 255, 190, 76, &payload)
}

#[test]
fn a_ground_station_sees_the_vehicle_and_kittiwake_and_takes_the_vehicle_by_a_mode() {
    // Position mode of PX4, position hold of ArduPilot.
    for (kind, mode) in [(Kind::Px4, 3.0), (Kind::ArduPilot, 16.0)] {
        let station = Station::default();
        let mut rig = Rig::watched(kind, station.clone());
        rig.airborne();
        rig.tell(DecisionRecord { text: "step 1 of 5: takeoff by 10 m".into(), ..DecisionRecord::default() });
        let heard = station.heard();
        let said: BTreeSet<(u8, u32)> = heard.iter().map(|it| (it.component(), it.id())).collect();
        // HEARTBEAT of both, LOCAL_POSITION_NED of the one, STATUSTEXT of the other.
        for expected in [(1, 0), (191, 0), (1, 32), (191, 253)] {
            assert!(said.contains(&expected), "{kind:?} {expected:?} {said:?}");
        }
        rig.target(Ned::new(0.0, 200.0, -10.0), Some(8.0));
        assert_eq!(rig.command(OFFBOARD), Ok(()), "{kind:?}");
        rig.pass(3.0);
        assert!(!rig.status().commanded_by_other, "{kind:?}");
        station.says(&select(mode, 0.0));
        rig.pass(12.0);
        assert!(rig.status().commanded_by_other && rig.speed_m_s() < 0.5, "{kind:?} {:?}", rig.status());
        // The autopilot's answer to the ground station has found it.
        assert!(station.heard().iter().any(|it| (it.component(), it.id()) == (1, 77)), "{kind:?}");
        assert_eq!(rig.command(LOITER), Ok(()), "{kind:?}");
        rig.pass(0.5);
        assert!(!rig.status().commanded_by_other, "{kind:?} {:?}", rig.status());
    }
}
