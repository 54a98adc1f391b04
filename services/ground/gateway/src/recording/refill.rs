//! What the gateway had heard of a mission before it was started again, from the recordings of that mission.
//!
//! Which mission a vehicle flies is known once its mission manager is heard. A thread then reads the recordings that an earlier gateway
//! has left, newest first, for as long as they are of the same mission, and folds them like messages that arrive. Without a folder, and
//! for a vehicle that does not say when its mission was begun, nothing is read: what came before is then not known.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use node::{Event, VehicleId};

use crate::fleet::{FleetState, MAX_VEHICLES, VehicleState};
use crate::journal::Journals;
use crate::recording::index;
use crate::recording::reading::{Found, read_each};

/// The most recordings that are read for one vehicle: the gateway was started that often during the mission.
const MAX_FILES: usize = 8;
/// The most bytes that are read of one recording: hours of a vehicle's messages.
const MAX_BYTES: u64 = 512 * 1024 * 1024;

/// Asks for what was heard before, and receives it.
pub(crate) struct Refill {
    /// Absent where nothing is recorded.
    wanted: Option<SyncSender<Wanted>>,
    found: Receiver<Past>,
    /// The vehicles that were asked for: each once.
    asked: BTreeSet<VehicleId>,
}

struct Wanted {
    vehicle: VehicleId,
    began_utc_ms: i64,
}

/// What was heard of a vehicle's mission before the gateway was started.
#[derive(Debug)]
pub(crate) struct Past {
    /// The vehicle.
    pub(crate) vehicle: VehicleId,
    /// Its state at the end.
    pub(crate) state: VehicleState,
    /// Its events.
    pub(crate) journals: Journals,
}

impl Refill {
    /// Reads from `folder`; a journal keeps `capacity` records.
    pub(crate) fn start(folder: Option<PathBuf>, pace: Pace, capacity: usize) -> Refill {
        // Each vehicle is asked for once, so that there is room for all that is found.
        let (sender, found) = sync_channel(MAX_VEHICLES);
        let wanted = folder.and_then(|folder| {
            let (wanted, asked) = sync_channel(MAX_VEHICLES);
            let work = move || run(&folder, pace, capacity, &asked, &sender);
            let spawned = std::thread::Builder::new().name("refill".into()).spawn(work);
            if let Err(cause) = &spawned {
                tracing::warn!(%cause, "what was recorded before this start is not shown");
            }
            spawned.is_ok().then_some(wanted)
        });
        Refill { wanted, found, asked: BTreeSet::new() }
    }

    /// The mission of a vehicle is known.
    pub(crate) fn on_mission(&mut self, vehicle: &VehicleId, began_utc_ms: i64) {
        if let Some(wanted) = &self.wanted
            && self.asked.len() < MAX_VEHICLES
            && self.asked.insert(vehicle.clone())
        {
            // There is room for every vehicle, each of which is asked for once.
            let _ = wanted.try_send(Wanted { vehicle: vehicle.clone(), began_utc_ms });
        }
    }

    /// What was found since the last call.
    pub(crate) fn next(&self) -> Option<Past> {
        self.found.try_recv().ok()
    }
}

fn run(folder: &Path, pace: Pace, capacity: usize, asked: &Receiver<Wanted>, found: &SyncSender<Past>) {
    while let Ok(wanted) = asked.recv() {
        if let Some(past) = past(folder, pace, capacity, wanted)
            && found.send(past).is_err()
        {
            return;
        }
    }
}

/// Reads the recordings of the mission; `None` if there are none.
fn past(folder: &Path, pace: Pace, capacity: usize, wanted: Wanted) -> Option<Past> {
    let files = index::left_of(folder, &wanted.vehicle).ok()?;
    let mut whole: Option<Past> = None;
    for file in files.into_iter().take(MAX_FILES) {
        let earlier = read(file, pace, capacity, &wanted.vehicle);
        match earlier.state.mission_began() {
            Some(began_utc_ms) if began_utc_ms == wanted.began_utc_ms => {}
            Some(_) => break,
            // It says nothing yet: the one that has just been begun, or one whose gateway was killed soon after its start.
            None => continue,
        }
        match &mut whole {
            None => whole = Some(earlier),
            Some(whole) => {
                whole.state.go_on_from(earlier.state);
                whole.journals.go_on_from(&wanted.vehicle, earlier.journals);
            }
        }
    }
    whole
}

/// Folds a recording as far as it can be read.
fn read(file: File, pace: Pace, capacity: usize, vehicle: &VehicleId) -> Past {
    let (mut fleet, mut journals) = (FleetState::default(), Journals::new(capacity));
    let (mut first_ms, mut occurrences) = (None, Vec::new());
    // A gateway that was killed has left it without its end, which does not matter here.
    let _ = read_each(BufReader::new(file.take(MAX_BYTES)), |found| {
        let Found::Message { topic, utc_ms, bytes } = found else { return };
        let Ok(message) = Message::decode(topic, bytes) else { return };
        let since_ms = u64::try_from(utc_ms - *first_ms.get_or_insert(utc_ms)).unwrap_or(0);
        let now = Now { time: Time::after(pace.wall(Duration::from_millis(since_ms))), utc_ms };
        fleet.fold(now, Event::Message { vehicle: vehicle.clone(), message }, &mut occurrences);
        let mission_time_s = fleet.vehicles.get(vehicle).and_then(|it| it.mission_time_s(now.time));
        for (vehicle, occurrence) in occurrences.drain(..) {
            journals.push(now, mission_time_s, &vehicle, &occurrence);
        }
    });
    let state = fleet.vehicles.remove(vehicle).unwrap_or_default();
    Past { vehicle: vehicle.clone(), state, journals }
}

#[cfg(test)]
mod tests {
    use kittiwake_proto::v1;

    use super::*;
    use crate::recording::capture::RecordedMessage;
    use crate::recording::encoder::Encoder;

    const BEGAN: i64 = 1_767_225_600_000;

    /// Leaves a recording of a mission begun at each of `missions`, in a file for each; none: one that says nothing yet.
    fn folder(missions: &[Option<i64>]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (second, began) in missions.iter().enumerate() {
            let mut encoder = Encoder::new([("vehicle".to_owned(), "uav1".to_owned())].into()).unwrap();
            if let Some(began_utc_ms) = *began {
                let message: Message = v1::McmStatus { began_utc_ms, ..Default::default() }.into();
                let (topic, bytes) = (message.topic(), message.encode());
                encoder.add(&RecordedMessage { topic, utc_ms: BEGAN + second as i64, bytes }).unwrap();
            }
            let name = format!("20260101T00000{second}000Z-uav1.mcap");
            std::fs::write(folder.path().join(name), encoder.take_bytes().unwrap()).unwrap();
        }
        folder
    }

    #[track_caller]
    fn check(missions: &[Option<i64>], is_found: bool) {
        let folder = folder(missions);
        let wanted = Wanted { vehicle: "uav1".into(), began_utc_ms: BEGAN };
        let past = past(folder.path(), Pace::REAL_TIME, 10, wanted);
        assert_eq!(past.map(|it| it.state.mission_began()), is_found.then_some(Some(BEGAN)), "{missions:?}");
    }

    #[test]
    fn recordings_are_read_as_far_back_as_they_are_of_the_mission() {
        check(&[], false);
        check(&[Some(BEGAN)], true);
        check(&[Some(BEGAN), Some(BEGAN)], true);
        check(&[Some(BEGAN), Some(BEGAN + 1)], false);
    }

    #[test]
    fn a_recording_that_says_nothing_yet_hides_none_before_it() {
        check(&[None], false);
        check(&[Some(BEGAN), None], true);
        check(&[Some(BEGAN), Some(BEGAN + 1), None], false);
    }
}
