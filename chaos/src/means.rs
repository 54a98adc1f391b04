//! What a campaign needs besides processes, and has on some machines only.

use std::path::{Path, PathBuf};

use kittiwake::output;
use kittiwake::run::run_file::RunFolder;

use crate::args::Args;
use crate::clock;
use crate::disk::Disk;
use crate::trouble::Kind;

/// What can be troubled on this machine, apart from processes.
#[derive(Debug, Clone, Default)]
pub struct Means {
    /// The state is on a small disk of its own, which can be full.
    pub has_disk: bool,
    /// The library by which wall clocks are set.
    pub clock: Option<PathBuf>,
}

impl Means {
    /// Finds the available means. Prints each missing one and leaves it out of every run.
    pub(crate) fn find(args: &Args, program: &Path) -> Result<Means, String> {
        let probe = RunFolder::create("disk").map_err(|it| it.to_string())?;
        let has_disk = args.own_mounts && Disk::mount(&probe.0).is_some();
        if !has_disk {
            output::error_line("chaos: full disk: not possible here: needs root; left out");
        }
        let clock = clock::find_library(program);
        if clock.is_none() {
            output::error_line(
                "chaos: steps of the wall clock: not possible here: needs libfaketime (Debian: faketime); left out",
            );
        }
        Ok(Means { has_disk, clock })
    }

    /// Whether such a trouble is possible.
    pub(crate) fn allow(&self, kind: Kind) -> bool {
        match kind {
            Kind::FullDisk => self.has_disk,
            Kind::ClockStep => self.clock.is_some(),
            _ => true,
        }
    }
}
