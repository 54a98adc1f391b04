//! A gateway that is started again in flight: what it knew it knows again, from the recordings.

use std::path::Path;

use crate::stories::http::*;

/// When the mission was begun, as the mission manager says.
const BEGAN: i64 = 1_767_225_600_000;

impl World {
    /// A gateway with this folder of recordings, started `seconds` after the mission.
    fn recording_into(folder: &Path, seconds: i64) -> World {
        let mut config = config();
        (config.recording.folder, config.recording.most_files) = (Some(folder.to_owned()), 9);
        let mut world = World::of(&config);
        world.now.utc_ms = BEGAN + 1000 * seconds;
        world
    }

    /// uav1's mission manager tells the time of the mission that was begun then.
    fn manager_says(&mut self, began_utc_ms: i64) {
        let mission_time_s = Some((self.now.utc_ms + 1000 - began_utc_ms) as f64 / 1000.0);
        self.say(v1::McmStatus { mission_time_s, began_utc_ms, ..Default::default() });
    }

    /// uav1 is `north_m` north of its start, a second after the last event.
    fn vehicle_is_at(&mut self, north_m: f64) {
        let position = Some(v1::Ned { north_m, ..Default::default() });
        let local_position = Some(v1::VehicleLocalPosition { position, ..Default::default() });
        self.say(v1::Introspection { local_position, ..Default::default() });
    }

    /// The decisions, and the metres north and the mission's seconds of each point of the track.
    async fn flown(&self) -> (Vec<String>, Vec<(f64, f64)>) {
        let decisions = self.get("/api/v1/vehicles/uav1/decisions").await.body;
        let texts = decisions["decisions"].as_array().unwrap().iter().map(|it| &it["record"]["text"]);
        let track = self.get("/api/v1/vehicles/uav1/track").await.body;
        let point = |it: &Value| (it["position"]["northM"].as_f64().unwrap(), it["missionTimeS"].as_f64().unwrap());
        let points = track["points"].as_array().unwrap().iter().map(point).collect();
        (texts.map(|it| it.as_str().unwrap().to_owned()).collect(), points)
    }

    /// Waits until the recordings were read.
    async fn recalls(&mut self, decision: &str) {
        let recalled = async {
            while !self.flown().await.0.iter().any(|it| it == decision) {
                self.say(v1::VehicleStatus::default());
                tokio::task::yield_now().await;
            }
        };
        tokio::time::timeout(LIMIT, recalled).await.expect("the recordings are read");
    }
}

/// A flight that an earlier gateway heard and recorded until `seconds`.
fn heard_before(folder: &Path, began_utc_ms: i64) {
    let mut world = World::recording_into(folder, 0);
    world.manager_says(began_utc_ms);
    world.decide("one");
    world.vehicle_is_at(10.0);
    world.vehicle_is_at(20.0);
    // The recording is complete when the gateway has ended.
}

#[tokio::test(flavor = "multi_thread")]
async fn a_restart_in_flight_loses_neither_time_nor_journal_nor_track() {
    let folder = tempfile::tempdir().unwrap();
    heard_before(folder.path(), BEGAN);
    let mut world = World::recording_into(folder.path(), 60);
    world.say(v1::VehicleStatus::default());
    assert_eq!(world.get("/api/v1/vehicles/uav1").await.body.get("missionTimeS"), None, "not known yet");
    world.manager_says(BEGAN);
    assert_eq!(world.get("/api/v1/vehicles/uav1").await.body["missionTimeS"], 62.0);
    world.decide("two");
    world.vehicle_is_at(30.0);
    world.recalls("one").await;
    let points = vec![(10.0, 3.0), (20.0, 4.0), (30.0, 64.0)];
    assert_eq!(world.flown().await, (vec!["one".to_owned(), "two".to_owned()], points.clone()));
    world.events(None).await.expect(&["decision one", "decision two", "status"]).await;
    // A page that was open meanwhile has an id of the first gateway.
    let id = format!("{}-1", BEGAN + 2000);
    world.events(Some(&id)).await.expect(&["resync", "decision one"]).await;
    drop(world);

    // Once more: of two recordings now.
    let mut world = World::recording_into(folder.path(), 120);
    world.manager_says(BEGAN);
    world.recalls("one").await;
    assert_eq!(world.flown().await, (vec!["one".to_owned(), "two".to_owned()], points));
    world.events(None).await.expect(&["decision one", "decision two", "status"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_recorded_of_another_mission_is_not_taken_for_this_one() {
    let folder = tempfile::tempdir().unwrap();
    heard_before(folder.path(), BEGAN - 100_000);
    let another = World::recording_into(folder.path(), 60);
    drop(another);
    let mut world = World::recording_into(folder.path(), 70);
    world.manager_says(BEGAN);
    world.decide("two");
    // What is looked for in vain cannot be waited for: another vehicle's past, which is asked for later, is found.
    let mut other = World::recording_into(folder.path(), 80);
    other.manager_says(BEGAN - 100_000);
    other.recalls("one").await;
    (0..20).for_each(|_| world.say(v1::VehicleStatus::default()));
    assert_eq!(world.flown().await.0, ["two"]);
    world.events(None).await.expect(&["decision two"]).await;
}
