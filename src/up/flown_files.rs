//! The files that a run flies with: a copy in a folder of the run, made once they have been checked.
//!
//! A process that is started again in flight reads its files again. It reads the copy, so somebody who changes the files
//! meanwhile, or installs those of another version, changes the next run and not this one. The control tower's public key is in it too:
//! without it no mission manager comes back. Certificates, secret keys and tokens are not in it: they are replaced
//! while a system runs, and no copy of a secret is made.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::check_inputs;
use crate::config::Config;
use crate::run::run_file::{Remembered, RunFolder};
use crate::run::tower_key;
use crate::settings::Settings;

/// Names in the copy.
const CONFIG: &str = "kittiwake.toml";
const MISSION: &str = "mission.toml";
const CONTINGENCIES: &str = "contingencies.toml";
const TREES: &str = "trees";
const SKILLS: &str = "skills";

/// The copy; removed with the value.
pub struct FlownFiles {
    /// The settings of this run, of the copied configuration file.
    pub settings: Settings,
    folder: RunFolder,
    written: Remembered,
}

/// Why there is no copy.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A file cannot be read or written.
    #[error("{path} cannot be copied: {cause}", path = path.display())]
    File {
        /// Which one.
        path: PathBuf,
        /// What the operating system says.
        cause: io::Error,
    },
    /// There is no place for a copy.
    #[error("there is no folder for a copy of the configuration: {0}")]
    Folder(io::Error),
    /// What was copied is not what was checked.
    #[error("{path} or a file that it names was changed while it was read; start again", path = .0.display())]
    Changed(PathBuf),
}

impl FlownFiles {
    /// Copies the files of `settings`, which `checked` names; returns the configuration too, as read from the copy.
    pub fn copy(settings: &Settings, checked: &Config) -> Result<(FlownFiles, Config), Failure> {
        let folder = RunFolder::create("files").map_err(Failure::Folder)?;
        let into = |name: &str| folder.0.join(name);
        copy_config(&settings.config, &into(CONFIG))?;
        copy_file(&checked.mission, &into(MISSION))?;
        copy_file(&checked.contingencies, &into(CONTINGENCIES))?;
        copy_folder(&checked.trees, &into(TREES), "xml")?;
        copy_folder(&checked.skills, &into(SKILLS), "toml")?;
        let copied = Settings {
            config: into(CONFIG),
            mission: None,
            // Paths in a configuration file are relative to its folder, which the copy has left.
            recordings: checked.gateway.recording.folder.clone(),
            tls_certificate: checked.gateway.tls_certificate.clone(),
            tls_key: checked.gateway.tls_key.clone(),
            signing_key: checked.mavlink_bridge.signing_key.clone(),
            ..settings.clone()
        };
        match check_inputs::read(&copied) {
            Ok(inputs) => {
                let written = Remembered::of(&folder.0).map_err(Failure::Folder)?;
                Ok((FlownFiles { settings: copied, folder, written }, inputs.config))
            }
            Err(_) => Err(Failure::Changed(settings.config.clone())),
        }
    }
}

impl FlownFiles {
    /// Takes the control tower's public key into the copy as well; returns its path there.
    ///
    /// # Errors
    /// If it cannot be copied.
    pub fn keep_tower_key(&mut self, key: &Path) -> Result<PathBuf, Failure> {
        let copy = self.folder.0.join(tower_key::PUBLIC);
        copy_file(key, &copy)?;
        self.written = Remembered::of(&self.folder.0).map_err(Failure::Folder)?;
        Ok(copy)
    }

    /// Writes the copy again where it was removed; whether it was.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn restore(&self) -> io::Result<bool> {
        self.written.restore(&self.folder)
    }
}

/// The configuration, which names the copied files beside it.
fn copy_config(from: &Path, to: &Path) -> Result<(), Failure> {
    let text = regular_file::open(from).and_then(io::read_to_string).map_err(of(from))?;
    let mut config: toml::Table = text.parse().map_err(|_| Failure::Changed(from.to_owned()))?;
    for (key, name) in [("mission", MISSION), ("contingencies", CONTINGENCIES), ("trees", TREES), ("skills", SKILLS)] {
        config.insert(key.into(), name.into());
    }
    fs::write(to, config.to_string()).map_err(of(to))
}

fn copy_file(from: &Path, to: &Path) -> Result<(), Failure> {
    regular_file::open(from).and_then(|_| fs::copy(from, to)).map(drop).map_err(of(from))
}

/// The files with this extension.
fn copy_folder(from: &Path, to: &Path, extension: &str) -> Result<(), Failure> {
    fs::create_dir(to).map_err(of(to))?;
    for entry in fs::read_dir(from).map_err(of(from))? {
        let entry = entry.map_err(of(from))?;
        let path = entry.path();
        if path.extension().is_some_and(|it| it == extension) {
            copy_file(&path, &to.join(entry.file_name()))?;
        }
    }
    Ok(())
}

fn of(path: &Path) -> impl Fn(io::Error) -> Failure + use<> {
    let path = path.to_owned();
    move |cause| Failure::File { path: path.clone(), cause }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_copy_says_what_the_files_say() {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/kittiwake.toml");
        let mission = shipped.with_file_name("missions/harbour.toml");
        let settings = Settings { mission: Some(mission), ..Settings::of_file(&shipped) };
        let read = check_inputs::read(&settings).expect("the shipped files have no mistake");
        let (copy, mut config) = FlownFiles::copy(&settings, &read.config).expect("a folder of a run can be made");
        let folder = copy.settings.config.parent().expect("a file is in a folder");
        assert!(config.mission.starts_with(folder) && config.trees.starts_with(folder));
        let again = check_inputs::read(&copy.settings).expect("a process reads the copy");
        assert_eq!(again.mission.name, read.mission.name);
        assert!(!copy.restore().unwrap(), "it is there");
        fs::remove_dir_all(folder).unwrap();
        assert!(copy.restore().unwrap(), "it was removed");
        let again = check_inputs::read(&copy.settings).expect("a process reads what was written again");
        assert_eq!(again.mission.name, read.mission.name);
        config.mission.clone_from(&read.config.mission);
        config.contingencies.clone_from(&read.config.contingencies);
        config.trees.clone_from(&read.config.trees);
        config.skills.clone_from(&read.config.skills);
        assert_eq!(format!("{config:?}"), format!("{:?}", read.config));
    }
}
