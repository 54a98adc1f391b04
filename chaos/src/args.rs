//! The command line.

use std::num::{NonZeroU32, NonZeroUsize};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Parser;
use kittiwake::config::Speed;

/// Flies real systems through random troubles and judges them by where the vehicle is.
#[derive(Debug, Clone, Parser)]
#[command(
    version,
    after_help = "Exit codes:\n    0  no violation\n    1  a run could not be flown, or the campaign was interrupted\n    3  violations; 3 comes before 1"
)]
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

    /// The command that flies the run of this seed again, from the same folder: with everything that its schedule and its verdict
    /// depend on, also what is so by default, since a default may change.
    pub fn again(&self, seed: u64) -> String {
        let (speed, interruption) = (&self.speed, self.interruption);
        let mut command =
            format!("kittiwake chaos --runs 1 --seed {seed} --speed {speed} --interruption {interruption}");
        command += &format!(" --config {}", for_a_shell(&self.config));
        if let Some(program) = &self.program {
            command += &format!(" --program {}", for_a_shell(program));
        }
        command
    }
}

/// As it is typed.
fn for_a_shell(path: &Path) -> String {
    let path = path.display().to_string();
    let is_plain = |it: char| it.is_alphanumeric() || "/._-+=:,@".contains(it);
    match path.chars().all(is_plain) {
        true => path,
        false => format!("'{}'", path.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_flown_again_by_a_command_with_all_that_it_was_flown_with() {
        #[track_caller]
        fn check(given: &[&str], expected: &str) {
            let args = Args::parse_from([&["chaos", "--runs", "9", "--jobs", "2"], given].concat());
            let again = args.again(4403);
            assert_eq!(again, format!("kittiwake chaos --runs 1 --seed 4403 {expected}"));
        }
        check(&[], "--speed 8 --interruption 8 --config config/kittiwake.toml");
        check(
            &["--seed", "4400", "--speed", "0.5", "--interruption", "24", "--config", "mine.toml"],
            "--speed 0.5 --interruption 24 --config mine.toml",
        );
        check(
            &["--config", "my files/it's.toml", "--program", "/opt/kittiwake"],
            r"--speed 8 --interruption 8 --config 'my files/it'\''s.toml' --program /opt/kittiwake",
        );
    }
}
