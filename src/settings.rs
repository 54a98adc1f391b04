//! What can be set for one run on top of the configuration file. The launcher hands on to each child what that reads.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use control_tower::policy::Policy;

use crate::config::{Speed, VehicleName};
use crate::service::Service;

/// Where configurations are looked for: that of the folder that the program is started in comes first, as in the repository, then
/// that of an installed system, where docs/deployment.md puts it.
const CONFIG_FILES: [&str; 2] = ["config/kittiwake.toml", "/etc/kittiwake/config/kittiwake.toml"];

/// The configuration file where none is named: `config/kittiwake.toml`, or the installed one if only that is there. If neither is,
/// the first one, so that it is the one that is reported as missing.
pub fn default_config() -> PathBuf {
    first_file(&CONFIG_FILES).into()
}

fn first_file<'a>(files: &[&'a str]) -> &'a str {
    files.iter().find(|it| Path::new(it).is_file()).unwrap_or(&files[0])
}

/// The configuration file and what overrides it.
#[derive(Debug, Clone, clap::Args)]
pub struct Settings {
    /// The configuration file; paths in it are relative to its folder
    #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
    pub config: PathBuf,
    /// The mission to fly, instead of the configured one
    #[arg(long, value_name = "FILE")]
    pub mission: Option<PathBuf>,
    /// Mission time runs N times as fast as the wall clock, 0.1 to 100
    #[arg(long, value_name = "N")]
    pub speed: Option<Speed>,
    /// How the control tower answers requests
    #[arg(long, value_name = "POLICY", value_parser = policies())]
    pub permissions: Option<Policy>,
    /// Seed of every random draw: wind, sensor noise, random denials
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Where the gateway listens; port 0 takes a free one
    #[arg(long, value_name = "ADDR:PORT")]
    pub http: Option<SocketAddr>,
    /// The access folder, with `tokens.toml`, which only its owner may read, and the audit records. Without it `up`
    /// makes one for this run, and a gateway accepts no token
    #[arg(long, value_name = "DIR")]
    pub access: Option<PathBuf>,
    /// Where missions are recorded. Without it `up` takes `kittiwake/recordings` in the user's state
    /// folder, and a gateway what the configuration file says
    #[arg(long, value_name = "DIR")]
    pub recordings: Option<PathBuf>,
    /// Where the mission manager and the planner write what they are given and decide, each a file, for `kittiwake replay`
    #[arg(long, value_name = "DIR")]
    pub record_inputs: Option<PathBuf>,
    /// The folder of the persisted state: the mission's progress, what was ordered, whether the mission is over, and what
    /// the control tower has decided, for processes that are started again. Without it `up` makes a folder for this run, in memory
    /// (with `nohup` among the temporary files: memory is cleared when its user logs out),
    /// and a mission manager and a control tower start without a state
    #[arg(long, value_name = "DIR")]
    pub state: Option<PathBuf>,
    /// The process has run before, in this run of `up`: a state that is not in its folder was lost
    #[arg(long, hide = true)]
    pub has_run: bool,
    /// What flies is the simulator of this run of `up`, and ends with it. A real aircraft may be in the air before a process first starts
    #[arg(long, hide = true)]
    pub simulated: bool,
    /// The public key of the control tower: with it a mission manager believes only permissions that the tower has signed.
    /// Without it `up` takes that of its own tower
    #[arg(long, value_name = "FILE")]
    pub tower_key: Option<PathBuf>,
    /// The key with which the control tower signs permissions. Without it the tower makes one in its `--state` folder
    #[arg(long, value_name = "FILE")]
    pub tower_secret: Option<PathBuf>,
    /// The certificate that the gateway shows, as PEM: with it and its key it speaks HTTPS
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    pub tls_certificate: Option<PathBuf>,
    /// The key of that certificate
    #[arg(long, value_name = "FILE", requires = "tls_certificate")]
    pub tls_key: Option<PathBuf>,
    /// Allow the gateway to speak plain HTTP on other addresses than the loopback's, where others can read tokens
    #[arg(long)]
    pub plain_http_beyond_loopback: bool,
    /// The vehicle's name; with `up` also what flies it: `sim`, `px4` or `mavlink`
    #[arg(long, value_name = "NAME")]
    pub vehicle: Option<VehicleName>,
    /// Where PX4's Zenoh module connects to, such as `tcp/127.0.0.1:7447`. Any client that reaches it can fly the
    /// vehicle
    #[arg(long, value_name = "LOCATOR")]
    pub px4_endpoint: Option<px4_bridge::config::Endpoint>,
    /// Where the autopilot that speaks MAVLink is: `udpin:127.0.0.1:14540`, `tcpout:127.0.0.1:5760` or `serial:/dev/ttyACM0:921600`
    #[arg(long, value_name = "WHERE")]
    pub connect_autopilot: Option<mavlink_bridge::socket::Endpoint>,
    /// Where ground stations may watch over MAVLink: `udpout:127.0.0.1:14550` of one that listens, or `udpin:0.0.0.0:14550`
    #[arg(long, value_name = "WHERE")]
    pub ground: Option<mavlink_bridge::ground::GroundEndpoint>,
    /// The file of the key with which everything is signed that is said over MAVLink, 64 hexadecimal digits; what has no signature is not
    /// believed
    #[arg(long, value_name = "FILE")]
    pub signing_key: Option<PathBuf>,
}

fn policies() -> impl TypedValueParser<Value = Policy> {
    PossibleValuesParser::new(Policy::ALL.map(Policy::name)).try_map(|it| it.parse::<Policy>())
}

impl Settings {
    /// The configuration file without any other settings.
    pub fn of_file(config: &Path) -> Settings {
        let config = config.to_owned();
        Settings {
            config,
            mission: None,
            speed: None,
            permissions: None,
            seed: None,
            http: None,
            access: None,
            recordings: None,
            record_inputs: None,
            state: None,
            has_run: false,
            simulated: false,
            tower_key: None,
            tower_secret: None,
            tls_certificate: None,
            tls_key: None,
            plain_http_beyond_loopback: false,
            vehicle: None,
            px4_endpoint: None,
            connect_autopilot: None,
            ground: None,
            signing_key: None,
        }
    }

    /// The options that are given, each with its value if it has one.
    pub fn given(&self) -> Vec<(&'static str, Option<OsString>)> {
        let with_value: [(&str, Option<OsString>); 19] = [
            ("--config", Some(self.config.clone().into())),
            ("--mission", self.mission.clone().map(Into::into)),
            ("--speed", self.speed.map(|it| it.to_string().into())),
            ("--permissions", self.permissions.map(|it| it.to_string().into())),
            ("--seed", self.seed.map(|it| it.to_string().into())),
            ("--http", self.http.map(|it| it.to_string().into())),
            ("--access", self.access.clone().map(Into::into)),
            ("--recordings", self.recordings.clone().map(Into::into)),
            ("--record-inputs", self.record_inputs.clone().map(Into::into)),
            ("--state", self.state.clone().map(Into::into)),
            ("--tower-key", self.tower_key.clone().map(Into::into)),
            ("--tower-secret", self.tower_secret.clone().map(Into::into)),
            ("--tls-certificate", self.tls_certificate.clone().map(Into::into)),
            ("--tls-key", self.tls_key.clone().map(Into::into)),
            ("--vehicle", self.vehicle.as_ref().map(|it| it.to_string().into())),
            ("--px4-endpoint", self.px4_endpoint.as_ref().map(|it| it.to_string().into())),
            ("--connect-autopilot", self.connect_autopilot.as_ref().map(|it| it.to_string().into())),
            ("--ground", self.ground.as_ref().map(|it| it.to_string().into())),
            ("--signing-key", self.signing_key.clone().map(Into::into)),
        ];
        let switches = [
            ("--has-run", self.has_run),
            ("--simulated", self.simulated),
            ("--plain-http-beyond-loopback", self.plain_http_beyond_loopback),
        ];
        let with_value = with_value.into_iter().filter(|(_, value)| value.is_some());
        with_value.chain(switches.into_iter().filter(|(_, is_on)| *is_on).map(|(name, _)| (name, None))).collect()
    }

    /// The arguments that make the same settings in a process of these services; options that it does not read are left out.
    pub fn to_args(&self, services: &[Service]) -> Vec<OsString> {
        let read = self.given().into_iter().filter(|(name, _)| services.iter().any(|it| it.reads(name)));
        read.flat_map(|(name, value)| std::iter::once(name.into()).chain(value)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        settings: Settings,
    }

    #[test]
    fn the_first_configuration_file_that_is_there_is_read() {
        #[track_caller]
        fn check(files: &[&str], expected: &str) {
            assert_eq!(first_file(files), expected);
        }
        check(&["config/kittiwake.toml", "Cargo.toml"], "config/kittiwake.toml");
        check(&["no/such.toml", "Cargo.toml"], "Cargo.toml");
        check(&["no/such.toml", "nor/this.toml"], "no/such.toml");
    }

    #[test]
    fn what_is_handed_on_is_what_was_given() {
        let given = [
            "--config",
            "a b.toml",
            "--mission",
            "m.toml",
            "--speed",
            "2.5",
            "--permissions",
            "deny",
            "--seed",
            "7",
            "--http",
            "127.0.0.1:0",
            "--access",
            "keys",
            "--recordings",
            "kept",
            "--record-inputs",
            "inputs",
            "--state",
            "kept",
            "--tower-key",
            "tower.pub",
            "--tower-secret",
            "tower.key",
            "--tls-certificate",
            "cert.pem",
            "--tls-key",
            "cert.key",
            "--vehicle",
            "uav2",
            "--px4-endpoint",
            "tcp/127.0.0.1:7448",
            "--connect-autopilot",
            "udpin:127.0.0.1:14541",
            "--signing-key",
            "signing.key",
            "--has-run",
            "--simulated",
            "--plain-http-beyond-loopback",
        ];
        let cli = Cli::parse_from(["kittiwake"].iter().chain(&given));
        assert_eq!(cli.settings.to_args(&Service::ALL), given);
        let planner = cli.settings.to_args(&[Service::Planner]);
        let expected = ["--config", "a b.toml", "--mission", "m.toml", "--speed", "2.5", "--record-inputs", "inputs"];
        assert_eq!(planner, [&expected[..], &["--vehicle", "uav2", "--has-run", "--simulated"]].concat());
    }
}
