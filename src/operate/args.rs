//! What `kittiwake vehicle`, `mission` and `permission` take: a word for each route of the gateway.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::config::VehicleName;

/// How the gateway is found, and how its answer is told.
#[derive(Debug, Clone, Default, Args)]
pub struct GatewayArgs {
    /// The gateway's address, such as `https://ground:8443`; else KITTIWAKE_URL, else the system that runs here
    #[arg(long, value_name = "URL", global = true)]
    pub url: Option<String>,
    /// The launcher's process id, where several systems run
    #[arg(long, global = true)]
    pub pid: Option<u32>,
    /// A file with one's token, which only its owner may read; else KITTIWAKE_TOKEN, else the token of the system
    /// that runs here
    #[arg(long, value_name = "FILE", global = true)]
    pub token_file: Option<PathBuf>,
    /// The certificate of a private CA that the gateway's certificate is checked with, as PEM
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
An order that needs command of the vehicle takes it where nobody holds it, and says so.

Exit codes:
    0  done
    2  bad input
    3  refused by the system, for the reason that is told
    5  the gateway, or who it asked, is not reachable";

/// For `kittiwake vehicle`.
#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub struct VehicleArgs {
    #[command(subcommand)]
    pub what: VehicleCommand,
    #[command(flatten)]
    pub gateway: GatewayArgs,
}

/// What is asked or ordered of a vehicle.
#[derive(Debug, Subcommand)]
pub enum VehicleCommand {
    /// The vehicles that the gateway knows
    List,
    /// What is known of one vehicle
    Show,
    /// Begin a mission that waits for it
    Start,
    /// Hold until resumed
    Pause,
    /// Go on after a pause
    Resume,
    /// Land here and end the mission
    Abort,
    /// Fly home, land and end the mission
    Return,
    /// Land at a place and end the mission
    LandAt {
        /// Metres north of the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        north_m: f64,
        /// Metres east of it
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        east_m: f64,
    },
    /// Give the present step up and plan anew
    Replan,
    /// Say that a contingency has been seen
    Acknowledge {
        /// Its flag
        flag: String,
    },
    /// Take command of the vehicle
    Take,
    /// Give command back
    Release,
    /// Let somebody else take command; one keeps it until they do
    HandOver {
        /// Their name
        to: String,
    },
    /// What happens, from what is remembered on, until it is ended
    Events {
        /// End after so many
        #[arg(long, value_name = "N")]
        count: Option<usize>,
        /// Also the whole state, as it comes twice a second
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

/// What is asked or ordered about a mission.
#[derive(Debug, Subcommand)]
pub enum MissionCommand {
    /// The mission as it stands
    Show,
    /// The steps that are still to be flown
    Plan,
    /// What a mission would take, without flying it
    Validate {
        /// A mission file; see `config/missions/`
        file: PathBuf,
    },
    /// Put another mission in the place of the present one, if all of it can be reached
    Upload {
        /// A mission file; see `config/missions/`
        file: PathBuf,
    },
    /// Insert an objective
    Insert {
        /// Its place in the list, from 0
        index: u32,
        /// A name that no other has
        name: String,
        /// Metres north of the take-off point
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        north_m: f64,
        /// Metres east of it
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        east_m: f64,
        /// Metres above it
        #[arg(allow_negative_numbers = true, value_parser = metres)]
        height_m: f64,
        /// To stand there, instead of being there in flight
        #[arg(long)]
        landed: bool,
    },
    /// Take an objective out
    Remove {
        /// Its name
        name: String,
    },
    /// Give an objective up: it counts as failed
    Skip {
        /// Its name
        name: String,
    },
    /// Have the plan flown that waits for approval
    Approve {
        /// Its number; without it, the one that waits
        revision: Option<u64>,
    },
    /// Refuse the plan that waits for approval: the vehicle holds
    Reject {
        /// Its number; without it, the one that waits
        revision: Option<u64>,
    },
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

/// What is asked or decided about permissions.
#[derive(Debug, Subcommand)]
pub enum PermissionCommand {
    /// Every permission that was asked for or decided
    List,
    /// Those that wait for a decision
    Pending,
    /// Grant the permission to enter an area
    Grant {
        /// Its name
        area: String,
        /// For so many mission seconds; without it, as long as the control tower grants
        #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seconds)]
        valid_for_s: Option<f64>,
        /// Why, for the record
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
    },
    /// Deny it
    Deny {
        /// The area's name
        area: String,
        /// Why, for the record
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
    },
    /// Take a permission back
    Revoke {
        /// The area's name
        area: String,
        /// Why, for the record
        #[arg(long, value_name = "TEXT", default_value = "")]
        reason: String,
    },
}

/// JSON has no word for a number that is none.
fn metres(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|it: &f64| it.is_finite());
    found.ok_or_else(|| format!("found `{text}`, expected metres"))
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
    fn the_words_are_taken_and_what_makes_no_sense_is_not() {
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
        check("permission grant A --valid-for-s 60", None);
        check("vehicle land-at 1", Some("EAST_M"));
        check("vehicle land-at NaN 0", Some("expected metres"));
        check("permission grant A --valid-for-s -1", Some("expected seconds above 0"));
        check("permission", Some("Usage"));
        check("vehicle pause --token secret", Some("unexpected argument"));
        check("vehicle pause --vehicle a/b", Some("lower-case"));
    }
}
