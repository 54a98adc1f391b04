//! A service whose state is persisted in a file, so that another process can continue from it.
//!
//! Written before an answer that changed it leaves, and only when it has changed. Not flushed to the
//! disk: the file must outlive the process, not the machine, with which the flight ends as well.

use std::io;
use std::path::{Path, PathBuf};

use domain::time::{Now, Time};
use kittiwake_proto::json::{from_json, to_json};
use kittiwake_proto::topics::{Service, Topic};
use kittiwake_proto::v1::{McmMemory, PlannerMemory};
use mcm::Mcm;
use node::{Effect, Event, Node};
use planner::Planner;
use prost::{Message, Name};

use crate::output;
use crate::run::run_file::write_private;

/// A service with a persisted state.
pub trait Resumable: Node {
    /// The persisted state.
    type Memory: Message + Name + Default + PartialEq;

    /// The present state.
    fn memory(&self) -> Self::Memory;

    /// Continues from a state; the error says why that is not possible, and then nothing is changed.
    fn resume(&mut self, memory: Self::Memory) -> Result<(), String>;
}

impl Resumable for Planner {
    type Memory = PlannerMemory;

    fn memory(&self) -> PlannerMemory {
        self.memory()
    }

    fn resume(&mut self, memory: PlannerMemory) -> Result<(), String> {
        self.resume(memory).map_err(|it| it.to_string())
    }
}

impl Resumable for Mcm {
    type Memory = McmMemory;

    fn memory(&self) -> McmMemory {
        self.memory()
    }

    fn resume(&mut self, memory: McmMemory) -> Result<(), String> {
        self.resume(memory).map_err(|it| it.to_string())
    }
}

/// A service and its file.
pub struct Persisted<N: Resumable> {
    service: N,
    path: PathBuf,
    written: Option<N::Memory>,
    /// The last attempt failed, and that was reported.
    is_failing: bool,
}

impl<N: Resumable> Persisted<N> {
    /// `service`, which continues from the state in `folder`, if there is one. A state that cannot be used is reported
    /// and ignored: for a vehicle in the air a service without its state is better than none.
    ///
    /// # Errors
    /// If the folder cannot be made.
    pub fn new(mut service: N, folder: &Path) -> io::Result<Persisted<N>> {
        std::fs::create_dir_all(folder)?;
        let path = folder.join(service.name()).with_extension("json");
        if let Err(cause) = resume(&mut service, &path) {
            output::error_line(format_args!("{}: not used: {cause}", path.display()));
        }
        Ok(Persisted { service, path, written: None, is_failing: false })
    }

    fn persist(&mut self) {
        let memory = self.service.memory();
        if self.written.as_ref() == Some(&memory) {
            return;
        }
        match write(&self.path, &memory) {
            Ok(()) => (self.written, self.is_failing) = (Some(memory), false),
            Err(cause) if !self.is_failing => {
                self.is_failing = true;
                output::error_line(format_args!(
                    "{}: cannot be written: {cause}; after a restart {} would not know what has happened",
                    self.path.display(),
                    self.service.name()
                ));
            }
            Err(_) => {}
        }
    }
}

fn resume<N: Resumable>(service: &mut N, path: &Path) -> Result<(), String> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(cause) => return Err(cause.to_string()),
    };
    let json = serde_json::from_str(&text).map_err(|it| it.to_string())?;
    service.resume(from_json(&json)?)
}

/// Readers see the whole file or none.
fn write<M: Message + Name>(path: &Path, memory: &M) -> io::Result<()> {
    let unfinished = path.with_extension("part");
    write_private(&unfinished, to_json(memory).to_string().as_bytes())?;
    std::fs::rename(&unfinished, path)
}

impl<N: Resumable> Node for Persisted<N> {
    fn name(&self) -> &'static str {
        self.service.name()
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.service.subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        self.service.serves()
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        self.service.on(now, event, effects);
        self.persist();
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.service.act(now, effects);
    }

    fn deadline(&self) -> Option<Time> {
        self.service.deadline()
    }

    fn is_over(&self) -> bool {
        self.service.is_over()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_inputs;
    use crate::settings::Settings;
    use kittiwake_proto::topics::Request;
    use kittiwake_proto::v1;
    use node::Token;
    use v1::mission_request::Request as Ask;

    fn planner() -> Planner {
        let settings = Settings::of_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("config/kittiwake.toml"));
        let inputs = check_inputs::read(&settings).unwrap();
        Planner::new(&inputs.config.planner, inputs.mission, inputs.config.speed.pace())
    }

    fn upload(persisted: &mut Persisted<Planner>) {
        let text = "name = \"other\"\n[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 50\nheight_m = 5\nflying = true\n";
        let request = v1::MissionRequest {
            request_id: "1".into(),
            request: Some(Ask::Upload(v1::MissionText { text: text.into() })),
            ..Default::default()
        };
        let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request: Request::Mission(request) };
        persisted.on(Now::default(), event, &mut Vec::new());
    }

    fn mission(persisted: &Persisted<Planner>) -> String {
        persisted.service.memory().status.unwrap().mission
    }

    #[test]
    fn an_uploaded_mission_is_there_after_a_restart_and_gone_with_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = Persisted::new(planner(), folder.path()).unwrap();
        upload(&mut first);
        drop(first);
        assert_eq!(mission(&Persisted::new(planner(), folder.path()).unwrap()), "other");
        let elsewhere = tempfile::tempdir().unwrap();
        assert_eq!(mission(&Persisted::new(planner(), elsewhere.path()).unwrap()), "reference");
    }

    #[test]
    fn a_state_that_cannot_be_used_is_ignored() {
        for text in ["", "{", "{}", "{\"status\":{}}", "{\"a\":1}"] {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("planner.json"), text).unwrap();
            assert_eq!(mission(&Persisted::new(planner(), folder.path()).unwrap()), "reference", "{text}");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_to_costs_only_the_state() {
        let folder = tempfile::tempdir().unwrap();
        let mut persisted = Persisted::new(planner(), folder.path()).unwrap();
        std::fs::remove_dir(folder.path()).unwrap();
        upload(&mut persisted);
        assert_eq!(mission(&persisted), "other");
        assert!(persisted.is_failing);
    }
}
