//! The command line.

use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;
use std::time::Duration;

use clap::Parser;
use kittiwake::config::Speed;

/// Flies real systems through random troubles and judges them by where the vehicle is.
#[derive(Debug, Clone, Parser)]
#[command(version, after_help = "Exit codes:\n    0  no violation\n    1  a run could not be flown\n    3  violations")]
pub struct Args {
    /// The configuration file
    #[arg(long, value_name = "FILE", default_value = "config/kittiwake.toml")]
    pub config: PathBuf,
    /// The program that is troubled; without it, `kittiwake` beside this one
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
    /// Number of runs; each has a seed of its own, one more than the one before
    #[arg(long, value_name = "N", default_value = "10")]
    pub runs: NonZeroU32,
    /// The first run's seed: the same seed is the same schedule
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// Mission time runs K times as fast as the wall clock; processes die and come back in wall time at any speed
    #[arg(long, value_name = "K", default_value = "8")]
    pub speed: Speed,
    /// Wall time that the death of a process may take, in seconds, until its successor is heard: by default three until one that
    /// hangs is killed, three of the longest delay before it is started again, two to start; on a crowded machine more
    #[arg(long, value_name = "SECONDS", default_value_t = 8)]
    pub interruption: u16,
    /// Runs at a time
    #[arg(long, value_name = "J", default_value = "1")]
    pub jobs: NonZeroUsize,
    /// Print what is drawn for each run, and fly nothing
    #[arg(long)]
    pub list: bool,
    /// Print the story of every run, not only of those with violations
    #[arg(long)]
    pub stories: bool,
    /// Instead of a campaign: one system for this many minutes without trouble, and what its processes' memory, threads,
    /// descriptors and files grow by
    #[arg(long, value_name = "MINUTES")]
    pub soak: Option<NonZeroU32>,
    /// Has mounts of its own
    #[arg(long, hide = true)]
    pub own_mounts: bool,
}

impl Args {
    /// [`Args::interruption`].
    pub fn interruption(&self) -> Duration {
        Duration::from_secs(self.interruption.into())
    }
}
