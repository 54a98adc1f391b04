//! The arguments of `kittiwake vehicle`, `mission`, `permission` and `site`, a subcommand for each route of the gateway, and of
//! `kittiwake audit` and `kittiwake why`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use domain::geodesy::{LatLon, NORTHERNMOST_ORIGIN_DEG, Origin};

use crate::config::VehicleName;

/// Which gateway, and how to print its answer.
#[derive(Debug, Clone, Default, Args)]
pub struct GatewayArgs {
    /// The gateway's address, such as `https://ground:8443`; else KITTIWAKE_URL, else the system that runs here
    #[arg(long, value_name = "URL", global = true)]
    pub url: Option<String>,
    /// The launcher's process id, where several systems run
    #[arg(long, global = true)]
    pub pid: Option<u32>,
    /// A file with your token, which only its owner may read; else KITTIWAKE_TOKEN where KITTIWAKE_URL is the gateway's address, else the
    /// token of the system that runs here
    #[arg(long, value_name = "FILE", global = true)]
    pub token_file: Option<PathBuf>,
    /// The private CA that signed the gateway's certificate, as PEM
    #[arg(long, value_name = "FILE", global = true)]
    pub ca: Option<PathBuf>,
    /// The vehicle, where the gateway knows several
    #[arg(long, value_name = "NAME", global = true)]
    pub vehicle: Option<VehicleName>,
    /// Take command from a holder who has offered it
    #[arg(long, global = true)]
    pub hand_over: bool,
    /// Print the gateway's answer as JSON, and nothing else, on standard output
    #[arg(long, global = true)]
    pub json: bool,
}

const EXIT_CODES: &str = "\
An order that needs command of the vehicle takes command if nobody has it, and says so.

Exit codes:
    0  done
    2  bad input
    3  refused by the system, for the reason printed
    5  the gateway or a service behind it is not reachable

Examples:
    kittiwake vehicle list                                   every vehicle, those in trouble first
    kittiwake vehicle pause                                  hold until `kittiwake vehicle resume`
    kittiwake mission upload config/missions/harbour.toml    while flying: checked first, then swapped at once
    kittiwake permission pending                             areas that wait for a decision
    kittiwake vehicle show --url https://ground:8443 --token-file token --vehicle uav1";

/// For `kittiwake vehicle`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct VehicleArgs {
    #[command(subcommand)]
    pub what: VehicleCommand,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// How an order is given.
#[derive(Debug, Clone, Copy, Args)]
pub struct Override {
    /// Put the order before every other response, except those that may not be overridden; to land here whatever is below, and to enter areas
    /// without permission where the only way leads through them
    #[arg(long = "override")]
    pub overrides: bool,
}

/// What is read or ordered of a vehicle.
#[derive(Debug, Subcommand)]
pub enum VehicleCommand {
    /// The vehicles that the gateway knows
    List,
    /// The state of one vehicle
    Show,
    /// Start a mission that waits for it
    Start,
    /// Hold until resumed
    Pause(Override),
    /// Go on after a pause
    Resume,
    /// Land here and end the mission
    Abort(Override),
    /// Fly home, land and end the mission
    Return(Override),
    /// Land at a place and end the mission
    LandAt {
        /// Metres north of the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        north_m: f64,
        /// Metres east of the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        east_m: f64,
        #[command(flatten)]
        over: Override,
    },
    /// Give up the present step and replan
    Replan,
    /// The vehicle was inspected after a crash and may fly; before this order nothing starts
    Inspected,
    /// Acknowledge a contingency: you have seen it
    Acknowledge {
        /// The contingency's flag
        flag: String,
    },
    /// Take command of the vehicle
    Take,
    /// Release command
    Release,
    /// Offer command to another operator; you have it until they take it
    HandOver {
        /// The operator's name
        to: String,
    },
    /// Print events, first those of the journal, until you stop the command
    Events {
        /// Stop after this many events
        #[arg(long, value_name = "N")]
        count: Option<usize>,
        /// Also print the state, which comes twice a second
        #[arg(long)]
        status: bool,
    },
}

/// For `kittiwake mission`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct MissionArgs {
    #[command(subcommand)]
    pub what: MissionCommand,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// What is read or ordered about a mission.
#[derive(Debug, Subcommand)]
pub enum MissionCommand {
    /// The mission as it stands
    Show,
    /// The steps still to fly
    Plan,
    /// What a mission would need, without flying it
    Validate {
        /// A mission file; see `config/missions/`
        file: PathBuf,
    },
    /// Replace the present mission, if every objective of the new one can be reached
    Upload {
        /// A mission file; see `config/missions/`
        file: PathBuf,
    },
    /// Insert an objective
    Insert {
        /// Its place in the list, from 0
        index: u32,
        /// A name that no other objective has
        name: String,
        /// Metres north of the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        north_m: f64,
        /// Metres east of the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        east_m: f64,
        /// Metres above the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        height_m: f64,
        /// Reach the place on the ground instead of in flight
        #[arg(long)]
        landed: bool,
    },
    /// Remove an objective
    Remove {
        /// The objective's name
        name: String,
    },
    /// Skip an objective: it counts as failed
    Skip {
        /// The objective's name
        name: String,
    },
    /// Approve the plan that waits for approval: it is flown
    Approve {
        /// The plan's revision; without it, that of the plan that waits
        revision: Option<u64>,
    },
    /// Reject the plan that waits for approval: the vehicle holds
    Reject {
        /// The plan's revision; without it, that of the plan that waits
        revision: Option<u64>,
    },
    /// Make a mission file of a plan of QGroundControl, GeoJSON, KML, AIXM, OpenAir, ED-269 or ED-318, and list what has no counterpart; no
    /// gateway is needed
    Import(ImportArgs),
    /// Print a mission file that has an origin as GeoJSON or as a plan of QGroundControl; no gateway is needed
    Export(ExportArgs),
}

/// For `kittiwake mission import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// Where to fly, and areas: a `.plan`, a mission of QGC WPL, or GeoJSON as `export` writes it; see `docs/formats.md`
    pub file: PathBuf,
    /// The take-off point in degrees, and its altitude above mean sea level in metres; without it, the planned home
    #[arg(long, value_name = "LAT,LON[,ALT]", allow_hyphen_values = true, value_parser = origin)]
    pub origin: Option<Origin>,
    /// A file of areas; may be given several times
    #[arg(long, value_name = "FILE")]
    pub areas: Vec<PathBuf>,
    /// The ground of all areas lies at most this much above or below the take-off point; without it, limits above the ground
    /// are not converted, and areas reach from the ground upwards
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = relief)]
    pub relief: Option<f64>,
    /// Refuse a zone that is not understood, in place of barring more
    #[arg(long)]
    pub strict: bool,
    /// A file of areas may have none
    #[arg(long)]
    pub allow_empty: bool,
    /// What to leave out: a place as a mistake prints it (/mission/items/3, "line 7"), or the name of a zone; may be given several
    /// times. One that several files have is written FILE:ITEM
    #[arg(long, value_name = "ITEM", value_parser = clap::builder::NonEmptyStringValueParser::new())]
    pub leave_out: Vec<String>,
    /// A folder with the heights of the ground: SRTM tiles (.hgt) or GeoTIFF (.tif). With it, heights above the ground are converted, and
    /// places to land at are as high as the ground there; see `docs/formats.md`
    #[arg(long, value_name = "FOLDER")]
    pub ground: Option<PathBuf>,
    /// Where to write the mission file
    #[arg(long, value_name = "MISSION")]
    pub out: PathBuf,
}

/// For `kittiwake mission export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// A mission file; see `config/missions/`
    pub file: PathBuf,
    /// The format
    #[arg(long)]
    pub format: ExportFormat,
    /// The take-off point, if the mission has no origin
    #[arg(long, value_name = "LAT,LON[,ALT]", allow_hyphen_values = true, value_parser = origin)]
    pub origin: Option<Origin>,
    /// Also the way that would be flown, in GeoJSON: the legs that `kittiwake plan` prints
    #[arg(long)]
    pub route: bool,
    /// The configuration file that the way is planned with
    #[arg(long, value_name = "FILE", default_value_os_t = crate::settings::default_config())]
    pub config: PathBuf,
    /// Where to write it; without it, on standard output
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// The formats of `kittiwake mission export`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ExportFormat {
    /// GeoJSON (RFC 7946)
    Geojson,
    /// A plan of QGroundControl
    Plan,
}

/// For `kittiwake permission`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct PermissionArgs {
    #[command(subcommand)]
    pub what: PermissionCommand,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// What is read or decided about permissions.
#[derive(Debug, Subcommand)]
pub enum PermissionCommand {
    /// Every permission that was requested or decided
    List,
    /// The permissions that wait for a decision
    Pending,
    /// Grant the permission to enter an area
    Grant {
        /// The area's name
        area: String,
        /// Validity in mission seconds; without it, the control tower's default
        #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seconds)]
        valid_for_s: Option<f64>,
        /// Why, for the record
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
    },
    /// Deny the permission to enter an area
    Deny {
        /// The area's name
        area: String,
        /// Why, for the record
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
    },
    /// Let the control tower grant again, for every vehicle, although it has lost earlier decisions: see `list`
    AcceptLoss,
    /// Revoke a permission
    Revoke {
        /// The area's name
        area: String,
        /// Why, for the record
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
    },
}

/// For `kittiwake site`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct SiteArgs {
    #[command(subcommand)]
    pub what: SiteCommand,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// What is said of a site.
#[derive(Debug, Subcommand)]
pub enum SiteCommand {
    /// Report the state of a site; what is left out stays as it was reported last. It counts for as long as the control tower's
    /// configuration says
    #[command(group = clap::ArgGroup::new("state").required(true).multiple(true))]
    Report {
        /// The site's name in the control tower's configuration
        site: String,
        /// The rotor
        #[arg(long, group = "state")]
        rotor: Option<Rotor>,
        /// The deck
        #[arg(long, group = "state")]
        deck: Option<Deck>,
        /// The wind at the deck in metres per second
        #[arg(long, value_name = "M/S", group = "state", allow_negative_numbers = true, value_parser = wind)]
        wind: Option<f64>,
    },
}

/// Of a site.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Rotor {
    /// It stands still
    Stopped,
    /// It turns
    Turning,
}

/// Of a site.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Deck {
    /// Nothing and nobody is on it
    Clear,
    /// Something or somebody is
    Occupied,
}

/// For `kittiwake audit`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes:\n    0  intact\n    1  the chain breaks at the line that is printed\n    2  there is no audit trail, or it cannot be read"
)]
pub struct AuditArgs {
    #[command(subcommand)]
    pub what: AuditCommand,
}

/// What is done with the audit trail.
#[derive(Debug, Subcommand)]
pub enum AuditCommand {
    /// Check that no record was changed, removed or inserted, and name the first line that breaks the chain
    Verify {
        /// The gateway's access folder, or one file of its audit trail
        #[arg(value_name = "FOLDER|FILE", default_value = ".")]
        path: PathBuf,
    },
}

/// For `kittiwake why`.
#[derive(Debug, Args)]
#[command(
    after_help = "Without a file it asks the gateway of the system that runs here, which keeps the last 500 decisions; where none runs \
        it reads the newest recording.\n\nExit codes:\n    0  told\n    2  the file is not a recording, or bad input\n    \
        3  refused by the system, for the reason printed\n    5  the gateway is not reachable"
)]
pub struct WhyArgs {
    /// A recording of a mission; `kittiwake up` prints their folder
    #[arg(value_name = "FILE", conflicts_with_all = ["url", "pid", "token_file", "ca", "vehicle"])]
    pub file: Option<PathBuf>,
    /// Only the last N decisions
    #[arg(long, value_name = "N")]
    pub last: Option<NonZeroUsize>,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// For `kittiwake pictures`.
#[derive(Debug, Args)]
#[command(after_help = "Exit codes:\n    0  written\n    2  the file is not a recording, or bad input")]
pub struct PicturesArgs {
    /// A recording of a mission; `kittiwake up` prints their folder
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The format
    #[arg(long)]
    pub format: PicturesFormat,
    /// Where to write it; without it, on standard output
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// The formats of `kittiwake pictures`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PicturesFormat {
    /// Comma-separated values (RFC 4180) with a header
    Csv,
    /// GeoJSON (RFC 7946), a Point for each
    Geojson,
}

/// Finite: JSON cannot say anything else.
fn metres(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|it: &f64| it.is_finite());
    found.ok_or_else(|| format!("found `{text}`, expected metres"))
}

/// `LATITUDE,LONGITUDE` with an altitude or without.
pub fn origin(text: &str) -> Result<Origin, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|it| it.trim().parse().ok()).collect();
    let (latitude_deg, longitude_deg, altitude_m) = match numbers.as_deref() {
        Some([latitude, longitude]) => (*latitude, *longitude, None),
        Some([latitude, longitude, altitude]) => (*latitude, *longitude, Some(*altitude)),
        _ => return Err(format!("found `{text}`, expected LATITUDE,LONGITUDE or LATITUDE,LONGITUDE,ALTITUDE")),
    };
    if !altitude_m.is_none_or(|it| it.abs() <= 10_000.0) {
        return Err(format!("found `{text}`, expected an altitude of at most 10000 m"));
    }
    if NORTHERNMOST_ORIGIN_DEG < latitude_deg.abs() {
        return Err(format!("latitude {latitude_deg}: expected at most {NORTHERNMOST_ORIGIN_DEG}"));
    }
    let place = LatLon::new(latitude_deg, longitude_deg).map_err(|error| error.to_string())?;
    Ok(Origin { place, altitude_m })
}

/// Metres from 0 to 10000.
pub fn relief(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|it| (0.0..=10_000.0).contains(it));
    found.ok_or_else(|| format!("found `{text}`, expected metres from 0 to 10000"))
}

fn wind(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|it: &f64| it.is_finite() && 0.0 <= *it);
    found.ok_or_else(|| format!("found `{text}`, expected metres per second from 0 up"))
}

fn seconds(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|it: &f64| it.is_finite() && 0.0 < *it);
    found.ok_or_else(|| format!("found `{text}`, expected seconds above 0"))
}

#[cfg(test)]
mod tests {
    use crate::cli::Cli;
    use clap::Parser;

    #[test]
    fn the_arguments_are_read_and_invalid_ones_are_refused() {
        #[track_caller]
        fn check(line: &str, refused: Option<&str>) {
            let words = ["kittiwake"].into_iter().chain(line.split(' '));
            match (Cli::try_parse_from(words), refused) {
                (Ok(_), None) => {}
                (Err(error), Some(part)) => {
                    assert_eq!(error.exit_code(), 2);
                    assert!(error.to_string().contains(part), "{line}: {error}");
                }
                (Ok(_), Some(part)) => panic!("{line} was taken, expected {part}"),
                (Err(error), None) => panic!("{line}: {error}"),
            }
        }
        check("vehicle land-at -3.5 40 --json", None);
        check("vehicle --url https://ground:8443 --token-file t --ca ca.pem --vehicle uav2 pause", None);
        check("vehicle events --count 3", None);
        check("mission insert 1 look -10 20 30 --hand-over", None);
        check("mission approve", None);
        check("mission reject 7", None);
        check(
            "mission import a.plan --origin -33.9,18.4,12 --areas z.json --areas y.kml --relief 5 --ground tiles --out m.toml",
            None,
        );
        check("mission export m.toml --format geojson", None);
        check("mission export m.toml --format geojson --route --config c.toml", None);
        check("mission import a.plan --leave-out /mission/items/3 --leave-out EDR7 --out m.toml", None);
        check("mission import a.plan --leave-out= --out m.toml", Some("a value is required"));
        check("mission import a.plan", Some("--out"));
        check("mission import a.plan --out m --origin 54", Some("expected LATITUDE,LONGITUDE"));
        check("mission import a.plan --out m --origin 89.5,0", Some("expected at most 89"));
        check("mission import a.plan --out m --origin nan,0", Some("expected degrees"));
        check("mission import a.plan --out m --origin 54,6,nan", Some("expected an altitude"));
        check("mission import a.plan --out m --relief -1", Some("expected metres from 0"));
        check("mission export m.toml --format kml", Some("possible values: geojson, plan"));
        check("permission grant A --valid-for-s 60", None);
        check("site report wt12 --rotor stopped --deck clear --wind 6", None);
        check("site report wt12", Some("required arguments were not provided"));
        check("site report wt12 --deck closed", Some("possible values: clear, occupied"));
        check("site report wt12 --wind -1", Some("expected metres per second from 0 up"));
        check("vehicle land-at 1", Some("EAST_M"));
        check("vehicle land-at NaN 0", Some("expected metres"));
        check("permission grant A --valid-for-s -1", Some("expected seconds above 0"));
        check("permission", Some("Usage"));
        check("audit verify access", None);
        check("audit", Some("Usage"));
        check("why", None);
        check("why --last 3 flight.mcap", None);
        check("why --json --url https://ground:8443 --vehicle uav2", None);
        check("pictures flight.mcap --format csv --out p.csv", None);
        check("pictures flight.mcap", Some("--format"));
        check("pictures flight.mcap --format kml", Some("possible values: csv, geojson"));
        check("why --last 0", Some("invalid value '0'"));
        check("why flight.mcap --vehicle uav1", Some("cannot be used with"));
        check("vehicle pause --token secret", Some("unexpected argument"));
        check("vehicle pause --vehicle a/b", Some("lower-case"));
    }
}
