//! The arguments of `kittiwake simulate`.

use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::Args;
use simulation::chaos::trouble::Trouble;

use crate::settings::default_config;

/// The latest that something given by hand may happen, in seconds: a day.
const LATEST_S: f64 = 86_400.0;

/// For `kittiwake simulate`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Exit codes:\n    0  no breach\n    1  a run has a breach\n    2  an argument or a file has a mistake; nothing was flown"
)]
pub struct SimulateArgs {
    /// The configuration file
    #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
    pub config: PathBuf,
    /// The mission to fly, instead of the configured one
    #[arg(long, value_name = "FILE")]
    pub mission: Option<PathBuf>,
    /// The first run's seed: the same seed is the same run, to the bit
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// A fault of the simulator, with its time in seconds after the start (0 without), such as `battery@60:0.2` or
    /// `wind@30:6,-6,2`; may be given several times. `kittiwake inject fault` lists them
    #[arg(long, value_name = "NAME[@SECONDS][:ARGS]")]
    pub fault: Vec<FaultArg>,
    /// A flag of the contingency table that is raised by hand, with its time in seconds after the start; may be given several times
    #[arg(long, value_name = "NAME@SECONDS")]
    pub flag: Vec<FlagArg>,
    /// Draw troubles from each seed: faults, flags, orders, decisions of the control tower, processes that hang. Without --mission
    /// three seeds of four also draw their mission
    #[arg(long)]
    pub chaos: bool,
    /// On a machine with too much to do: messages are late and overtake each other, processes wait
    #[arg(long)]
    pub busy: bool,
    /// Number of runs; each has a seed of its own, one more than the one before
    #[arg(long, value_name = "N", default_value = "1")]
    pub runs: NonZeroU32,
    /// Runs at a time
    #[arg(long, value_name = "J", default_value = "1")]
    pub jobs: NonZeroUsize,
    /// Fly the run that `--chaos` draws from this seed again and again, and print the fewest troubles with which it still breaks the
    /// same rule
    #[arg(long, value_name = "SEED", conflicts_with_all = ["seed", "runs", "jobs", "json"])]
    pub shrink: Option<u64>,
    /// Write everything that the mission manager and the planner are given and decide to this file, for `kittiwake replay`; of a
    /// single run
    #[arg(long, value_name = "FILE", conflicts_with_all = ["shrink", "runs"])]
    pub record: Option<PathBuf>,
    /// Print the result as JSON, and nothing else, on standard output
    #[arg(long)]
    pub json: bool,
}

/// For `kittiwake replay`.
#[derive(Debug, Clone, Args)]
#[command(
    after_help = "Exit codes:\n    0  every decision is the same\n    1  one is another one; both are printed\n    2  the file is not a whole recording of this format"
)]
pub struct ReplayArgs {
    /// What `kittiwake simulate --record` has written
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

impl SimulateArgs {
    /// What is given by hand, with the time after the start.
    pub fn troubles(&self) -> Vec<(Duration, Trouble)> {
        let faults = self.fault.iter().map(|it| (it.at, it.trouble.clone()));
        let flags = self.flag.iter().map(|it| (it.at, Trouble::Flag(it.name.clone())));
        faults.chain(flags).collect()
    }

    /// The command that flies the run of a seed again.
    pub fn again(&self, seed: u64) -> String {
        let mut words = vec![format!("kittiwake simulate --seed {seed}")];
        if self.config != default_config() {
            words.push(format!("--config {}", self.config.display()));
        }
        words.extend(self.mission.iter().map(|it| format!("--mission {}", it.display())));
        words.extend(self.fault.iter().map(|it| format!("--fault '{}'", it.text)));
        words.extend(self.flag.iter().map(|it| format!("--flag {}@{}", it.name, it.at.as_secs_f64())));
        words.extend(self.chaos.then(|| "--chaos".to_owned()));
        words.extend(self.busy.then(|| "--busy".to_owned()));
        words.join(" ")
    }
}

/// `NAME[@SECONDS][:ARGS]`: a fault that the simulator takes.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultArg {
    text: String,
    at: Duration,
    trouble: Trouble,
}

impl FromStr for FaultArg {
    type Err = String;
    fn from_str(text: &str) -> Result<FaultArg, String> {
        let (head, args) = text.split_once(':').unwrap_or((text, ""));
        let (name, at) = match head.split_once('@') {
            Some((name, at)) => (name, seconds(at)?),
            None => (head, Duration::ZERO),
        };
        let args: Vec<String> = args.split([',', ' ']).filter(|it| !it.is_empty()).map(str::to_owned).collect();
        vehicle_sim::faults::check(name, &args)?;
        Ok(FaultArg { text: text.to_owned(), at, trouble: Trouble::Fault { name: name.to_owned(), args } })
    }
}

/// `NAME@SECONDS`: a flag; whether there is one of this name the contingency table says.
#[derive(Debug, Clone, PartialEq)]
pub struct FlagArg {
    /// Its name.
    pub name: String,
    at: Duration,
}

impl FromStr for FlagArg {
    type Err = String;
    fn from_str(text: &str) -> Result<FlagArg, String> {
        let (name, at) = text.split_once('@').ok_or("expected NAME@SECONDS, such as `obstacle@40`")?;
        Ok(FlagArg { name: name.to_owned(), at: seconds(at)? })
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.trim().parse::<f64>().ok().filter(|it| (0.0..=LATEST_S).contains(it));
    let expected = || format!("found time `{text}`, expected seconds after the start, 0 to {LATEST_S}");
    seconds.map(Duration::from_secs_f64).ok_or_else(expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_has_a_name_and_maybe_a_time_and_arguments() {
        #[track_caller]
        fn check(text: &str, expected: Result<(f64, &str), &str>) {
            let found = text.parse::<FaultArg>().map(|it| (it.at.as_secs_f64(), it.trouble.to_string()));
            let expected = expected.map(|(at_s, trouble)| (at_s, trouble.to_owned())).map_err(str::to_owned);
            assert_eq!(found, expected, "{text}");
        }
        check("gnss_loss", Ok((0.0, "fault gnss_loss")));
        check("gnss_loss@12.5", Ok((12.5, "fault gnss_loss")));
        check("battery@60:0.2", Ok((60.0, "fault battery 0.2")));
        check("battery:0.2", Ok((0.0, "fault battery 0.2")));
        check("wind@30:6, -6, 2", Ok((30.0, "fault wind 6 -6 2")));
        check("batery@60:0.2", Err("there is no fault `batery`; did you mean `battery`?"));
        check("battery@60", Err("`battery`: FRACTION is missing; usage: battery FRACTION"));
        for time in ["-1", "soon", "", "NaN", "86401", "inf"] {
            let said = format!("found time `{time}`, expected seconds after the start, 0 to 86400");
            check(&format!("gnss_loss@{time}"), Err(&said));
        }
    }

    #[test]
    fn a_flag_has_a_time() {
        let flag: FlagArg = "obstacle@40".parse().unwrap();
        assert_eq!(flag, FlagArg { name: "obstacle".into(), at: Duration::from_secs(40) });
        assert_eq!("obstacle".parse::<FlagArg>().unwrap_err(), "expected NAME@SECONDS, such as `obstacle@40`");
        assert!("obstacle@-1".parse::<FlagArg>().unwrap_err().contains("`-1`"));
    }
}
