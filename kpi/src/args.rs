//! The command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use kittiwake::composition::Composition;
use kittiwake::config::Speed;

/// Measures Kittiwake: flies real systems and prints the reference's tables beside our figures.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do; nothing means to measure.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// What to measure.
    #[command(flatten)]
    pub args: Args,
}

/// What the program does besides measuring.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// One of the two bare processes of `--floor`
    #[command(hide = true)]
    Floor(FloorArgs),
}

/// What is measured, and how often.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The configuration file; the tables and missions of the measurements are in `kpi` beside it
    #[arg(long, value_name = "FILE", default_value = "config/kittiwake.toml")]
    pub config: PathBuf,
    /// The program that is measured; without it, `kittiwake` beside this one
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
    /// Fly the mission at least so often at each tick period; more flights follow until there are enough samples
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub runs: u32,
    /// Tick periods of the mission manager, in milliseconds
    #[arg(long, value_name = "MS", value_delimiter = ',', default_values_t = [10, 5, 1])]
    pub tick_ms: Vec<u32>,
    /// At least this many samples of each class of transition
    #[arg(long, value_name = "N", default_value_t = 30)]
    pub samples: usize,
    /// Raise each of the sixteen flags at least so often
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub raises: usize,
    /// Mission time of the flights; tick period, transport and processing stay in wall time
    #[arg(long, value_name = "N", default_value = "10")]
    pub speed: Speed,
    /// Run these nodes in one process, as `kittiwake up --onboard` does, such as `mcm,skill-manager,monitor,planner`
    #[arg(long, value_name = "NODES", conflicts_with_all = ["operator", "link"])]
    pub onboard: Option<Composition>,
    /// Measure the raw cost of the same hops between two bare processes, and the ratio
    #[arg(long)]
    pub floor: bool,
    /// Also measure rates and load at real time, hovering for this many seconds and over a mission
    #[arg(long, value_name = "SECONDS")]
    pub load: Option<u32>,
    /// Measure only what the gateway does for those who look on: a thousand event streams at real time
    #[arg(long)]
    pub operator: bool,
    /// Measure only the link between aircraft and ground: clear, narrow, with losses, and cut
    #[arg(long, conflicts_with = "operator")]
    pub link: bool,
    /// Measure only how fast a flag is answered while the gateway or the control tower hangs, and during a flood of flags
    #[arg(long, conflicts_with_all = ["operator", "link"])]
    pub disturbed: bool,
    /// Write everything to this file as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Draw the figures into this folder, as SVG
    #[arg(long, value_name = "DIR")]
    pub plots: Option<PathBuf>,
}

/// For one of the two bare processes.
#[derive(Debug, clap::Args)]
pub struct FloorArgs {
    /// Plays the mission manager and the vehicle; else the skill manager
    #[arg(long)]
    pub far: bool,
    /// The router's locator
    #[arg(long, value_name = "LOCATOR")]
    pub connect: Vec<String>,
    /// The folder of the direct links
    #[arg(long, value_name = "DIR")]
    pub direct: PathBuf,
    /// End when standard input ends
    #[arg(long)]
    pub exit_with_parent: bool,
}
