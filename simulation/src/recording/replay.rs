//! Gives the nodes of a recording the same again, and compares what they decide.

use std::collections::VecDeque;
use std::fmt;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use domain::file::Mistakes;
use domain::time::{Now, Pace, Time};
use node::{Effect, Node};
use signed_permissions::key::PublicKey;

use super::content::{Entry, Header, Input};
use super::recorded::decision;
use super::{RECORDED, file};
use crate::files::{CONFIG, Files, MISSION};
use crate::{Machine, Setup};

/// Why nothing was compared.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The file is not a recording, or not a whole one.
    #[error(transparent)]
    Unreadable(#[from] file::Unreadable),
    /// What it holds cannot be flown by this program.
    #[error("the files in the recording are not those of this program: {0}")]
    Files(Mistakes),
    /// Something else in it.
    #[error("{0}")]
    Other(String),
}

/// What a replay has found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replayed {
    /// Decisions, calls and answers that were the same.
    pub same: usize,
    /// The first one that was not.
    pub difference: Option<Difference>,
}

/// The first decision that is another one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The number of the decision, from 1.
    pub number: usize,
    /// When.
    pub at: Time,
    /// The node.
    pub node: &'static str,
    /// What it did in the flight; `None`: nothing more.
    pub recorded: Option<String>,
    /// What it does now; `None`: nothing more.
    pub replayed: Option<String>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let side = |it: &Option<String>| it.clone().unwrap_or_else(|| "nothing".to_owned());
        write!(
            f,
            "{:.2} s, {}, decision {}:\n  recorded: {}\n  replayed: {}",
            self.at.as_secs_f64(),
            self.node,
            self.number,
            side(&self.recorded),
            side(&self.replayed)
        )
    }
}

/// Replays a file.
///
/// # Errors
/// If nothing can be compared.
pub fn replay(path: &Path) -> Result<Replayed, Refusal> {
    let (header, entries) = file::read(path)?;
    let mut nodes = nodes(&header)?;
    compare(&mut nodes, entries)
}

/// The two nodes, in the order of [`RECORDED`], and what they are made of.
struct Nodes {
    files: Files,
    vehicle: String,
    pace: Pace,
    tower_key: Option<PublicKey>,
    mcm: mcm::Mcm,
    planner: planner::Planner,
}

impl Nodes {
    /// The process of this node was killed, and is there again as this instance.
    fn restart(&mut self, node: u8, instance: u64) -> Result<(), Refusal> {
        match node {
            0 => self.mcm = manager(&self.files, &self.vehicle, instance, self.pace, self.tower_key)?,
            _ => self.planner = self.files.planner(self.pace),
        }
        Ok(())
    }
}

fn manager(
    files: &Files,
    vehicle: &str,
    instance: u64,
    pace: Pace,
    tower_key: Option<PublicKey>,
) -> Result<mcm::Mcm, Refusal> {
    let mcm = files.manager_of(vehicle, instance, pace).map_err(Refusal::Files)?.of_mission(&files.mission);
    Ok(match tower_key {
        None => mcm,
        Some(key) => mcm.that_verifies_with(key),
    })
}

fn nodes(header: &Header) -> Result<Nodes, Refusal> {
    let other = |what: &str| Refusal::Other(what.to_owned());
    let pace = Pace::new(header.speed).ok_or_else(|| other("the speed in the recording is invalid"))?;
    // One recording may be replayed twice at once.
    static REPLAYS: AtomicU64 = AtomicU64::new(0);
    let number = REPLAYS.fetch_add(1, Relaxed);
    let folder = std::env::temp_dir().join(format!("kittiwake-replay-{}-{number}", std::process::id()));
    let unpacked = unpack(header, &folder).and_then(|()| {
        let config = folder.join(CONFIG);
        let (mission, machine) = (folder.join(MISSION), Machine::Ideal);
        let permissions = control_tower::policy::Policy::Grant;
        let setup = Setup { config: &config, mission: Some(&mission), permissions, seed: header.instance, machine };
        Files::read_unpacked(&setup).map_err(Refusal::Files)
    });
    let removed = std::fs::remove_dir_all(&folder);
    let files = unpacked?;
    removed.map_err(|it| Refusal::Other(format!("{}: cannot be removed: {it}", folder.display())))?;
    let tower_key = match header.tower_key.as_str() {
        "" => None,
        key => Some(key.parse().map_err(|_| other("the tower's key in the recording is invalid"))?),
    };
    let mcm = manager(&files, &header.vehicle, header.instance, pace, tower_key)?;
    let planner = files.planner(pace);
    Ok(Nodes { files, vehicle: header.vehicle.clone(), pace, tower_key, mcm, planner })
}

/// Writes the files of a recording, for those who read them by their paths.
fn unpack(header: &Header, folder: &Path) -> Result<(), Refusal> {
    let unwritable =
        |path: &Path, it: std::io::Error| Refusal::Other(format!("{}: cannot be written: {it}", path.display()));
    for (name, text) in &header.files {
        // No name leads out of the folder.
        let is_plain = !name.is_empty() && name.split('/').all(|it| !it.is_empty() && it != ".." && it != ".");
        if !is_plain {
            return Err(Refusal::Other(format!("the recording holds a file with the name `{name}`")));
        }
        let path = folder.join(name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|it| unwritable(parent, it))?;
        }
        std::fs::write(&path, text).map_err(|it| unwritable(&path, it))?;
    }
    Ok(())
}

fn compare(nodes: &mut Nodes, entries: Vec<Entry>) -> Result<Replayed, Refusal> {
    let mut same = 0;
    let mut done: VecDeque<String> = VecDeque::new();
    let (mut node, mut at) = (0, Time::ZERO);
    let difference = |number, at, node: u8, recorded, replayed| {
        let node = RECORDED[usize::from(node)];
        Some(Difference { number, at, node, recorded, replayed })
    };
    for entry in entries {
        match entry {
            Entry::Did { node, what } => {
                let replayed = done.pop_front();
                if replayed.as_ref() != Some(&what) {
                    return Ok(Replayed { same, difference: difference(same + 1, at, node, Some(what), replayed) });
                }
                same += 1;
            }
            Entry::Given { node: next, now, input } => {
                if let Some(more) = done.pop_front() {
                    return Ok(Replayed { same, difference: difference(same + 1, at, node, None, Some(more)) });
                }
                (node, at) = (next, now.time);
                let mut effects = Vec::new();
                give(nodes, node, now, input, &mut effects)?;
                done.extend(effects.iter().filter_map(decision));
            }
        }
    }
    let difference = done.pop_front().and_then(|more| difference(same + 1, at, node, None, Some(more)));
    Ok(Replayed { same, difference })
}

fn give(nodes: &mut Nodes, node: u8, now: Now, input: Input, effects: &mut Vec<Effect>) -> Result<(), Refusal> {
    let receiver: &mut dyn Node = if node == 0 { &mut nodes.mcm } else { &mut nodes.planner };
    match input {
        Input::Event(event) => receiver.on(now, event, effects),
        Input::Act => receiver.act(now, effects),
        Input::Restart(instance) => nodes.restart(node, instance)?,
        Input::Lost(loss) => nodes.mcm.memory_lost(loss),
        Input::Written(outcome, loss) => nodes.mcm.memory_written(outcome, loss),
        Input::Resume(memory) => {
            use prost::Message as _;
            // A state that was refused then is refused now.
            let memory = kittiwake_proto::v1::McmMemory::decode(memory.as_slice());
            let _ = memory.map(|it| nodes.mcm.resume(it).is_ok());
        }
    }
    Ok(())
}
