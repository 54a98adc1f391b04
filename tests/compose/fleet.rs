//! Three aircraft and one ground.

use crate::compose::support::Project;

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn three_fly_and_one_page_has_them_all() {
    let mut project = Project::new("fleet");
    project.with_profiles(&["three"]);
    // Fifteen more processes on the same machine.
    project.set("KITTIWAKE_SPEED", "5");
    project.up();
    let token = project.token();
    for vehicle in ["uav1", "uav2", "uav3"] {
        let report = project.wait_for_report(vehicle, &token);
        assert_eq!(report["outcome"], "MISSION_OUTCOME_SUCCESS", "{vehicle}: {report}");
        assert_eq!(report["vehicle"], vehicle);
    }
    let (_, fleet) = project.get("/api/v1/vehicles", &token).expect("the gateway answers");
    assert_eq!(fleet["vehicles"].as_array().map(Vec::len), Some(3), "{fleet}");
    assert_eq!(project.down(), Vec::<String>::new(), "left behind");
}
