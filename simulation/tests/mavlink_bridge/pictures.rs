//! Pictures that the autopilots take along a line.

use domain::declared_skill::{DeclaredSkill, DeclaredSkills};
use domain::file::Source;
use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use fake_autopilots::Kind;
use fake_autopilots::wire::Faults;
use kittiwake_proto::v1;

use crate::stories::mavlink_bridge::rig::{OFFBOARD, Rig};

const CAMERA: &str =
    "version = 1\nsummary = \"Takes a picture each time a distance was flown\"\nseconds = 1.0\nlimit_s = 60.0
    outcome = { on = \"success\" }\n[input.every_m]\nleast = 1.0\nmost = 100.0
    [mavlink]\ncommand = \"DO_SET_CAM_TRIGG_DIST\"\nparams = [\"every_m\", 0, 1]";

/// What is published on 100 m to the east with a picture every 10 m.
fn taken(kind: Kind, faults: Faults) -> Vec<v1::Picture> {
    let skill = DeclaredSkill::read(&Source { path: "camera.toml".into(), text: CAMERA.into() }).unwrap();
    let mut rig = Rig::over(kind, faults).skilled(&DeclaredSkills::of(vec![skill]));
    rig.airborne();
    let inputs = vec![v1::TaskValue { name: "every_m".into(), value: 10.0, ..Default::default() }];
    rig.tell(v1::TaskOrder { request_id: "r".into(), skill: "camera".into(), inputs, cancel: false });
    rig.target(Ned::new(0.0, 105.0, -10.0), Some(4.0));
    assert_eq!(rig.command(OFFBOARD), Ok(()), "{kind:?}");
    rig.pass(60.0);
    rig.published.pictures
}

#[test]
fn each_picture_along_a_line_is_published_once_with_its_place() {
    for kind in [Kind::Px4, Kind::ArduPilot] {
        let pictures = taken(kind, Faults::default());
        let numbers: Vec<u32> = pictures.iter().map(|it| it.number).collect();
        assert_eq!(numbers, (0..=10).collect::<Vec<_>>(), "{kind:?}");
        let places = pictures.iter().map(|it| it.place.expect("a place"));
        let places: Vec<LatLon> =
            places.map(|it| LatLon::new(it.latitude_deg, it.longitude_deg).expect("on Earth")).collect();
        for pair in places.windows(2) {
            let step = LocalFrame::at(pair[0]).local(pair[1]);
            assert!((9.9..11.0).contains(&step.east_m) && step.north_m.abs() < 0.5, "{kind:?}: {step}");
        }
        assert!(pictures.windows(2).all(|it| it[0].utc_ms + 1_000 < it[1].utc_ms), "{kind:?}: {pictures:?}");
        // Frames are lost and doubled: some pictures are missing, and none counts twice.
        let lossy: Vec<u32> = taken(kind, Faults::LOSSY).iter().map(|it| it.number).collect();
        assert!(5 < lossy.len() && lossy.is_sorted_by(|a, b| a < b), "{kind:?}: {lossy:?}");
    }
}
