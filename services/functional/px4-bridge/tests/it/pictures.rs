//! Pictures, where PX4 sends `camera_capture`.

use kittiwake_proto::topics::Message;

use crate::stories::rig::Rig;

#[test]
fn a_capture_that_has_not_failed_is_a_picture_with_its_place() {
    let mut rig = Rig::new();
    let mut capture = |result: f64, latitude: f64| {
        let numbers = [("seq", 7.0), ("lat", latitude), ("lon", 8.5), ("alt", 488.0), ("q", 1.0), ("result", result)];
        rig.sample("camera_capture", &numbers, &[])
    };
    let published = capture(1.0, 47.4);
    let [Message::Picture(picture)] = &published[..] else { panic!("{published:?}") };
    let place = picture.place.expect("a place");
    assert_eq!((picture.number, place.latitude_deg, place.altitude_amsl_m), (7, 47.4, 488.0));
    assert_eq!(picture.attitude.map(|it| it.yaw_rad), Some(0.0));
    assert_eq!(capture(0.0, 47.4), []);
    let published = capture(-1.0, f64::NAN);
    let [Message::Picture(picture)] = &published[..] else { panic!("{published:?}") };
    assert_eq!(picture.place, None);
}
