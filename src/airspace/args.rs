//! The arguments of `kittiwake airspace`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use domain::geodesy::Origin;

use crate::operate::args::{GatewayArgs, origin, relief};

const EXIT_CODES: &str = "\
Data sets are files of zones in any format that `mission import` reads: see docs/airspace.md.

Exit codes:
    0  done; `diff` ends with it also where something differs, and --json says which
    2  a file has a mistake, or `check` found something that it refuses
    3  refused by the system, for the reason printed
    5  the gateway or a service behind it is not reachable

Examples:
    kittiwake airspace check zones.json --strict                        before an edition is used
    kittiwake airspace diff old.json zones.json --html diff.html        what opened, closed and changed
    kittiwake airspace import harbour.toml zones.json --out next.toml   a mission file with the new edition
    kittiwake airspace adopt zones.json --vehicle uav1 --dry-run        what it would mean for the mission in flight";

/// For `kittiwake airspace`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct AirspaceArgs {
    #[command(subcommand)]
    pub what: AirspaceCommand,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// What is done with data sets.
#[derive(Debug, Subcommand)]
pub enum AirspaceCommand {
    /// Say what data sets have: edition, validity, zones, and what is not understood
    Check(CheckArgs),
    /// Compare two editions: what opened, closed and changed
    Diff(DiffArgs),
    /// Write a mission file with new editions in place of those that it has; its own areas stay
    Import(ImportArgs),
    /// Give new editions to the mission that is flown, over the gateway: compared and tried out first, then adopted with one order
    Adopt(AdoptArgs),
}

/// Which zones are looked at.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Reach {
    /// Only zones near to this place; without it, all
    #[arg(long, value_name = "LAT,LON[,ALT]", allow_hyphen_values = true, value_parser = origin)]
    pub origin: Option<Origin>,
    /// How near, in kilometres
    #[arg(long, value_name = "KM", default_value_t = 100.0, value_parser = kilometres, requires = "origin")]
    pub within: f64,
}

/// For `kittiwake airspace check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The data sets
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    #[command(flatten)]
    pub reach: Reach,
    /// Refuse a data set with something that is not understood, and one that is out of date
    #[arg(long)]
    pub strict: bool,
}

/// For `kittiwake airspace diff`.
#[derive(Debug, Args)]
pub struct DiffArgs {
    /// The data set before
    pub old: PathBuf,
    /// The data set now
    pub new: PathBuf,
    #[command(flatten)]
    pub reach: Reach,
    /// Also write a page with a picture of both
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
}

/// New editions, and how they are read.
#[derive(Debug, Args)]
pub struct NewFeeds {
    /// The data sets: all that the mission has, since they take the place of all
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// A feed of the mission that no file replaces; its areas are removed. May be given several times
    #[arg(long, value_name = "FEED")]
    pub drop: Vec<String>,
    /// The ground of all areas lies at most this much above or below the take-off point; without it, limits above the ground
    /// are not converted, and areas reach from the ground upwards
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = relief)]
    pub relief: Option<f64>,
    /// Refuse a zone that is not understood, in place of barring more
    #[arg(long)]
    pub strict: bool,
    /// A data set may have no area within reach
    #[arg(long)]
    pub allow_empty: bool,
}

/// For `kittiwake airspace import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// The mission file; it is not changed
    pub mission: PathBuf,
    #[command(flatten)]
    pub feeds: NewFeeds,
    /// Where to write the new mission file
    #[arg(long, value_name = "MISSION")]
    pub out: PathBuf,
}

/// For `kittiwake airspace adopt`.
#[derive(Debug, Args)]
pub struct AdoptArgs {
    #[command(flatten)]
    pub feeds: NewFeeds,
    /// Compare and try out, and adopt nothing
    #[arg(long)]
    pub dry_run: bool,
}

fn kilometres(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|it| (0.001..=20_000.0).contains(it));
    found.ok_or_else(|| format!("found `{text}`, expected kilometres from 0.001 to 20000"))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use crate::cli::Cli;

    #[test]
    fn the_arguments_are_read_and_invalid_ones_are_refused() {
        #[track_caller]
        fn check(line: &str, refused: Option<&str>) {
            let words = ["kittiwake", "airspace"].into_iter().chain(line.split(' '));
            match (Cli::try_parse_from(words), refused) {
                (Ok(_), None) => {}
                (Err(error), Some(part)) => assert!(error.to_string().contains(part), "{line}: {error}"),
                (Ok(_), Some(part)) => panic!("{line} was taken, expected {part}"),
                (Err(error), None) => panic!("{line}: {error}"),
            }
        }
        check("check a.json b.kml --origin -33.9,18.4 --within 5 --strict --json", None);
        check("check", Some("<FILES>"));
        check("check a.json --within 5", Some("--origin"));
        check("check a.json --origin 54,6 --within 0", Some("kilometres from 0.001"));
        check("diff old.json new.json --html d.html", None);
        check("diff old.json", Some("<NEW>"));
        check("import m.toml z.json y.json --drop x.json --relief 5 --out n.toml", None);
        check("import m.toml --out n.toml", Some("<FILES>"));
        check("adopt z.json --dry-run --vehicle uav1 --url http://127.0.0.1:1", None);
    }
}
