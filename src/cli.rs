//! The command line.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::PathBuf;

use bus::sockets::read_locator;
use clap::builder::PossibleValuesParser;
use clap::{Arg, Args, CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use crate::airspace::args::AirspaceArgs;
use crate::backend::Backend;
use crate::composition::{Composition, ONBOARD};
use crate::config::VehicleName;
use crate::operate::args::{AuditArgs, MissionArgs, PermissionArgs, PicturesArgs, SiteArgs, VehicleArgs, WhyArgs};
use crate::plan::WindArg;
use crate::ros_bridge::RosBridgeArgs;
use crate::run::run_file;
use crate::service::Service;
use crate::settings::{Settings, default_config};
use crate::simulate::args::{ReplayArgs, SimulateArgs};
use crate::skill::SkillArgs;

/// Onboard mission and contingency manager for unmanned aircraft.
///
/// Without a command it does what `kittiwake up` does: it starts every process, flies the mission
/// and shows its progress.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do; nothing means `up`.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// For `up`, when it is not named.
    #[command(flatten)]
    pub up: UpArgs,
}

/// The program's commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Start every process and fly the mission (the default)
    Up(UpArgs),
    /// Fly the shipped mission with the page open in a browser, and buttons that make it go wrong
    Demo(DemoArgs),
    /// Print what would be flown: legs, time, energy, permissions, what is left out and why; start nothing
    Plan(PlanArgs),
    /// Fly in virtual time, many times faster than real time, with faults and random trouble; judge every run
    Simulate(SimulateArgs),
    /// Check every file that `up` and the routers read, and prove by flights in virtual time that the table answers everything
    Check(CheckArgs),
    /// Print what the gateway of a running system says about its vehicle
    Status(StatusArgs),
    /// Tell why the vehicle did what it did: its decisions as sentences, each under the one that led to it
    Why(WhyArgs),
    /// Read the state of a vehicle or order something, over the gateway
    Vehicle(VehicleArgs),
    /// Read, try out or change a mission, over the gateway
    Mission(MissionArgs),
    /// List permissions or decide about them, over the gateway
    Permission(PermissionArgs),
    /// Report whether a place to land at is ready, over the gateway
    Site(SiteArgs),
    /// Show a vehicle of a gateway to ROS 2 as a node with topics, services and an action, without ROS installed
    #[command(name = "ros-bridge")]
    RosBridge(RosBridgeArgs),
    /// Raise a flag or inject a fault into a running system
    Inject(InjectArgs),
    /// Check data sets of zones, compare their editions, and put them into a mission, also into one that is flown
    Airspace(AirspaceArgs),
    /// List the skills of a vehicle, or examine a process that carries out one of your own
    Skill(SkillArgs),
    /// Compare a configuration with the one that this version ships
    Config(ConfigArgs),
    /// Write the places of the pictures in a recording as CSV or GeoJSON
    Pictures(PicturesArgs),
    /// Give the mission manager and the planner of a recorded flight the same again, and compare every decision
    Replay(ReplayArgs),
    /// Check the files in which a gateway records orders
    Audit(AuditArgs),
    /// Print what this machine lacks to fly
    Doctor(DoctorArgs),
    /// Make a token for an operator of a gateway, if there is none yet, and print the link to the page
    Access(AccessArgs),
    /// Make, revoke or renew the certificates of the routers at both ends of the link
    Certs(CertsArgs),
    /// Listen to a PX4, and check whether its parameters make its failsafes the net below ours; command nothing
    #[command(name = "px4-check")]
    Px4Check(Px4CheckArgs),
    /// Read the parameters of an autopilot over MAVLink, and check whether they make its failsafes the net below ours
    #[command(name = "autopilot-check")]
    AutopilotCheck(AutopilotCheckArgs),
    /// Print what a shell needs to complete this program's arguments
    Completions(CompletionsArgs),
    /// Write the manual's pages, one for each command, for `man -l FILE` or a folder of the manual
    Man(ManArgs),
    /// Run one process of the system, as systemd and containers do
    Run(RunArgs),
    /// Check whether a process is on the bus and makes progress: exit code 0 if so, 1 if not
    Health(HealthArgs),
    /// Measure: fly real systems and print the reference's tables beside our figures; starts `kittiwake-kpi`
    #[command(disable_help_flag = true)]
    Kpi(CompanionArgs),
    /// Trouble: fly real systems while processes die, hang and lose their state, and judge them; starts `kittiwake-chaos`
    #[command(disable_help_flag = true)]
    Chaos(CompanionArgs),
}

/// The commands as the overview shows them.
const GROUPS: [(&str, &[&str]); 6] = [
    ("Fly", &["up", "demo", "plan", "simulate", "check"]),
    ("Operate", &["status", "why", "vehicle", "mission", "permission", "site", "inject", "ros-bridge"]),
    ("Files", &["airspace", "skill", "config", "pictures", "replay", "audit"]),
    ("Install", &["doctor", "access", "certs", "px4-check", "autopilot-check", "completions", "man"]),
    ("Processes", &["run", "health"]),
    ("Measure", &["kpi", "chaos"]),
];

/// The command line: an overview in groups, and for each process only the options that it reads.
pub fn command() -> clap::Command {
    let command = Cli::command().mut_subcommand("run", |run| {
        let run = Service::ALL.into_iter().fold(run, |run, service| {
            run.mut_subcommand(service.name(), |it| it.mut_args(|arg| hide_unread(arg, &[service])))
        });
        run.mut_subcommand(ONBOARD, |it| it.mut_args(|arg| hide_unread(arg, &Service::on_board())))
    });
    let overview = overview(&command);
    command.help_template(format!("{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{overview}"))
}

/// Reads the arguments of this process; ends it where they have a mistake, or ask for help.
pub fn read() -> Cli {
    Cli::from_arg_matches(&command().get_matches()).unwrap_or_else(|mistake| mistake.exit())
}

/// Hides an option of [`Settings`] that none of these services reads.
fn hide_unread(arg: Arg, services: &[Service]) -> Arg {
    let settings = Settings::augment_args(clap::Command::new("settings"));
    let is_setting = settings.get_arguments().any(|it| it.get_id() == arg.get_id());
    let option = arg.get_long().map(|it| format!("--{it}")).unwrap_or_default();
    let is_unread = is_setting && !services.iter().any(|it| it.reads(&option));
    if is_unread { arg.hide(true) } else { arg }
}

fn overview(command: &clap::Command) -> String {
    let mut text = String::new();
    for (group, names) in GROUPS {
        _ = writeln!(text, "{group}:");
        for name in names {
            let about = command.find_subcommand(name).and_then(clap::Command::get_about).map(ToString::to_string);
            _ = writeln!(text, "  {name:<16} {}", about.unwrap_or_default());
        }
        text.push('\n');
    }
    text + "`kittiwake COMMAND --help` says what a command does, its options and exit codes."
}

/// For `kittiwake demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// The configuration file
    #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
    pub config: PathBuf,
}

impl DemoArgs {
    /// As if `up` were told so.
    pub fn up(self) -> UpArgs {
        UpArgs {
            settings: Settings::of_file(&self.config),
            backend: Some(Backend::Sim),
            listen: None,
            onboard: None,
            exit_when_done: false,
            json: false,
            opens_page: true,
        }
    }
}

/// For `kittiwake doctor`.
#[derive(Debug, Args)]
#[command(after_help = "Exit codes:\n    0  nothing is missing\n    1  something is; the line says what to do")]
pub struct DoctorArgs {
    /// The configuration file
    #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
    pub config: PathBuf,
}

/// For `kittiwake config`.
#[derive(Debug, Args)]
pub struct ConfigArgs {
    #[command(subcommand)]
    pub command: ConfigCommand,
}

/// What is done with a configuration.
#[derive(Debug, Subcommand)]
pub enum ConfigCommand {
    /// Print each key that differs from the shipped configuration, and the files of trees that do
    Diff(DiffArgs),
}

/// For `kittiwake config diff`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes:\n    0  no difference\n    1  a difference\n    2  a file has a mistake or cannot be read"
)]
pub struct DiffArgs {
    /// The configuration file; the other files are beside it
    #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
    pub config: PathBuf,
}

/// For `kittiwake completions`.
#[derive(Debug, Args)]
#[command(after_help = "For bash: kittiwake completions bash > ~/.local/share/bash-completion/completions/kittiwake")]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}

/// For `kittiwake man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// The folder to write them to, which must exist
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

/// For `kittiwake kpi` and `kittiwake chaos`.
#[derive(Debug, Args)]
pub struct CompanionArgs {
    /// Arguments of the program that is started; `--help` lists them
    #[arg(value_name = "ARGS", trailing_var_arg = true, allow_hyphen_values = true)]
    pub args: Vec<OsString>,
}

/// For `kittiwake up`.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXIT_CODES)]
pub struct UpArgs {
    #[command(flatten)]
    pub settings: Settings,
    /// What flies. `--vehicle px4` says the same where the vehicle keeps the name of the configuration file
    #[arg(long, value_name = "BACKEND")]
    pub backend: Option<Backend>,
    /// Where the router listens; without it on a socket that only this user can reach. With `tcp/127.0.0.1:0` every user of
    /// this machine can fly
    #[arg(long, value_name = "LOCATOR", value_parser = read_locator)]
    pub listen: Option<String>,
    /// Run these nodes in one process in place of one for each, such as `mcm,skill-manager,monitor,planner`
    #[arg(long, value_name = "NODES")]
    pub onboard: Option<Composition>,
    /// End once the mission is over, with an exit code that says how it ended
    #[arg(long)]
    pub exit_when_done: bool,
    /// Print the mission report as JSON, and nothing else, on standard output
    #[arg(long)]
    pub json: bool,
    /// Open the operator's page in a browser, at the buttons that make the flight go wrong; for `demo`.
    #[arg(skip)]
    pub opens_page: bool,
}

impl UpArgs {
    /// What flies, and the settings of its processes: a backend's name as `--vehicle` names no vehicle.
    pub fn flown(&self) -> (Backend, Settings) {
        let named = self.settings.vehicle.as_ref().and_then(|it| Backend::of_name(it.as_str()));
        let vehicle = self.settings.vehicle.clone().filter(|_| named.is_none());
        let backend = self.backend.or(named).unwrap_or(Backend::Sim);
        (backend, Settings { vehicle, ..self.settings.clone() })
    }
}

const EXIT_CODES: &str = "\
Exit codes:
    0  all objectives achieved
    2  bad input, nothing was started
    3  the mission ended with objectives failed
    4  the mission ended by an emergency response
    5  the system could not be kept up
    6  the vehicle crashed
  130  interrupted before the mission was over

Examples:
    kittiwake up --speed 5                                    fly the configured mission, five times as fast
    kittiwake up --mission config/missions/rounds.toml        another mission
    kittiwake up --exit-when-done --speed 20 --permissions silent   until it is over, with a tower that never answers";

/// For `kittiwake check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes:\n    0  nothing found\n    1  the table does not answer everything, or the mission cannot be flown\n    2  a file has a mistake or cannot be read"
)]
pub struct CheckArgs {
    /// The same settings as `up` takes, so that the files it would read are checked
    #[command(flatten)]
    pub settings: Settings,
    /// What crosses the link; without it `zenoh/link.toml` beside the configuration file, if it is there
    #[arg(long, value_name = "FILE")]
    pub link: Option<PathBuf>,
    /// Print only the tree that the contingency table becomes, as XML
    #[arg(long)]
    pub print_tree: bool,
    /// Print only the contingencies: what raises each, how loudly it calls, what is flown, and where its numbers come from
    #[arg(long, conflicts_with = "print_tree")]
    pub print_contingencies: bool,
    /// Only read the files: fly nothing
    #[arg(long, conflicts_with_all = ["quick", "html", "jobs"])]
    pub files_only: bool,
    /// Fly a sample: each kind of row alone, and two pairs of each, in turn through the phases of a mission; seconds instead of minutes
    #[arg(long)]
    pub quick: bool,
    /// Write the pair matrix as a page with the story behind each cell; or as a picture alone, if the name ends with .svg
    #[arg(long, value_name = "FILE", conflicts_with_all = ["print_tree", "print_contingencies"])]
    pub html: Option<PathBuf>,
    /// Flights at a time; without it as many as the machine has processors
    #[arg(long, value_name = "J")]
    pub jobs: Option<std::num::NonZeroUsize>,
}

/// For `kittiwake px4-check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes:\n    0  PX4 is heard, and no parameter is the wrong way round\n    1  it is not, or one is\n    2  a file has a mistake or cannot be read\n    5  the endpoint is taken"
)]
pub struct Px4CheckArgs {
    #[command(flatten)]
    pub settings: Settings,
    /// PX4's parameters, as QGroundControl saves them or as `param show` prints them: over Zenoh they cannot be read
    #[arg(long, value_name = "FILE")]
    pub params: Option<PathBuf>,
    /// Seconds for which it listens; 0 does not
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub listen_s: u64,
}

/// For `kittiwake autopilot-check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes:\n    0  an autopilot is heard, and no parameter is otherwise than it should be\n    1  none is heard, or one is\n    2  a file has a mistake or cannot be read\n    5  the address is taken, or the device cannot be opened"
)]
pub struct AutopilotCheckArgs {
    #[command(flatten)]
    pub settings: Settings,
    /// Change what is otherwise than it should be, where there is one good value
    #[arg(long)]
    pub write: bool,
    /// Seconds after which an autopilot that was not heard is given up
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub limit_s: u64,
}

/// For `kittiwake plan`.
#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes:\n    0  the mission can be flown\n    1  it cannot: no way, too late, or too little energy\n    2  a file has a mistake or cannot be read"
)]
pub struct PlanArgs {
    /// The mission file
    #[arg(value_name = "MISSION")]
    pub mission: PathBuf,
    /// The configuration file, with the speeds and the vehicle's energy
    #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
    pub config: PathBuf,
    /// The mean wind, in metres per second, and the direction it comes from in degrees; without a direction it blows against every
    /// leg, and without this option the wind of the configuration does
    #[arg(long, value_name = "M_S[,FROM_DEG]")]
    pub wind: Option<WindArg>,
    /// Also write a page with a picture
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Print the planner's answer as JSON
    #[arg(long)]
    pub json: bool,
}

/// For `kittiwake run router`.
#[derive(Debug, Args)]
pub struct RouterArgs {
    /// Where to listen: `unixsock-stream/PATH`, a socket in a folder that only this user may enter, or an address such as
    /// `tcp/127.0.0.1:7447`, where port 0 takes a free one. Every process that connects here is trusted
    #[arg(long, value_name = "LOCATOR", value_parser = read_locator, default_values_t = [run_file::router_locator()])]
    pub listen: Vec<String>,
    /// On the ground: listen for aircraft here, such as `tls/0.0.0.0:7448`
    #[arg(
        long,
        value_name = "LOCATOR",
        value_parser = read_locator,
        conflicts_with = "dial",
        requires_all = ["certificates", "vehicle"]
    )]
    pub accept: Option<String>,
    /// On board: call the ground here, such as `tls/ground-router:7448`, until it answers
    #[arg(long, value_name = "LOCATOR", value_parser = read_locator, requires_all = ["certificates", "vehicle"])]
    pub dial: Option<String>,
    /// What crosses the link
    #[arg(long, value_name = "FILE", default_value = "config/zenoh/link.toml")]
    pub link: Option<PathBuf>,
    /// The folder with this router's certificate, as `kittiwake certs` makes them
    #[arg(long, value_name = "DIR")]
    pub certificates: Option<PathBuf>,
    /// On board: the vehicle; on the ground: each vehicle that may connect
    #[arg(long, value_name = "NAME")]
    pub vehicle: Vec<VehicleName>,
    /// End when standard input ends
    #[arg(long, hide = true)]
    pub exit_with_parent: bool,
}

fn days(text: &str) -> Result<f64, String> {
    let days = text.parse::<f64>().ok().filter(|it| it.abs() <= 36_500.0);
    days.ok_or_else(|| "expected a number of days, at most 36500".into())
}

/// For `kittiwake certs`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct CertsArgs {
    /// What to do; nothing means to make them.
    #[command(subcommand)]
    pub command: Option<CertsCommand>,
    /// Where to write them: a folder for each router, to be copied to its machine, and one for the authority
    #[arg(value_name = "DIR", required = true)]
    pub folder: Option<PathBuf>,
    /// A vehicle; may be given several times
    #[arg(long, value_name = "NAME", default_value = "uav1")]
    pub vehicle: Vec<VehicleName>,
    /// The name of the ground's router, as in the table of the link
    #[arg(long, value_name = "NAME", default_value = "ground-router")]
    pub ground_name: String,
    /// A further host name or address under which aircraft call the ground; may be given several times
    #[arg(long, value_name = "HOST")]
    pub ground_host: Vec<String>,
    /// Days for which they are valid; fractions are allowed
    #[arg(long, value_name = "N", default_value_t = 30.0, value_parser = days)]
    pub days: f64,
    /// Accept a complete set that exists already, and leave it as it is
    #[arg(long)]
    pub keep: bool,
}

/// What `kittiwake certs` does besides making a set.
#[derive(Debug, Subcommand)]
pub enum CertsCommand {
    /// Revoke every certificate that a router has had: its links are cut once the others have the new list
    Revoke(RevokeArgs),
    /// Renew a router's certificate and key, under the same authority, for the same name and hosts
    Renew(RenewArgs),
}

/// For `kittiwake certs revoke`.
#[derive(Debug, Args)]
pub struct RevokeArgs {
    /// The folder that `kittiwake certs` has made; `revoked.pem` in each router's folder is to be copied to its machine
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The router, such as `uav1-router`
    #[arg(value_name = "NAME")]
    pub name: String,
    /// Only those that have been renewed since
    #[arg(long)]
    pub former: bool,
}

/// For `kittiwake certs renew`.
#[derive(Debug, Args)]
pub struct RenewArgs {
    /// The folder that `kittiwake certs` has made; the router's own folder is to be copied to its machine
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The router, such as `uav1-router`
    #[arg(value_name = "NAME")]
    pub name: String,
    /// Days for which it is valid; fractions are allowed
    #[arg(long, value_name = "N", default_value_t = 30.0, value_parser = days)]
    pub days: f64,
}

/// For `kittiwake run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Which process
    #[command(subcommand)]
    pub process: ProcessCommand,
}

/// The processes of the system.
#[derive(Debug, Subcommand)]
pub enum ProcessCommand {
    /// The router that every process connects to; prints where it listens
    Router(RouterArgs),
    #[command(flatten)]
    Service(ServiceCommand),
    /// Several processes on board of one vehicle as one, in one thread: smaller and quicker, and they die together
    Onboard(OnboardArgs),
}

/// The services, one process each.
#[derive(Debug, Subcommand)]
pub enum ServiceCommand {
    /// The autopilot and its vehicle, simulated
    VehicleSim(ProcessArgs),
    /// Between a PX4 and the `fmu/` topics: the router that PX4's Zenoh module connects to, commands, setpoints, telemetry
    #[command(name = "px4-bridge")]
    Px4Bridge(ProcessArgs),
    /// Between an autopilot that speaks MAVLink and the `fmu/` topics: PX4 or ArduPilot, over UDP, TCP or a serial line
    #[command(name = "mavlink-bridge")]
    MavlinkBridge(ProcessArgs),
    /// Turns skills into commands to the autopilot
    SkillManager(ProcessArgs),
    /// Watches the vehicle's state and raises flags
    Monitor(ProcessArgs),
    /// Turns objectives into plans
    Planner(ProcessArgs),
    /// Decides what the vehicle does: mission and contingencies
    Mcm(ProcessArgs),
    /// Grants and denies permissions to enter areas
    ControlTower(ProcessArgs),
    /// Serves the operator over HTTP; prints its address
    Gateway(ProcessArgs),
}

impl ServiceCommand {
    /// Which service, and its arguments.
    pub fn split(self) -> (Service, ProcessArgs) {
        match self {
            ServiceCommand::VehicleSim(args) => (Service::VehicleSim, args),
            ServiceCommand::Px4Bridge(args) => (Service::Px4Bridge, args),
            ServiceCommand::MavlinkBridge(args) => (Service::MavlinkBridge, args),
            ServiceCommand::SkillManager(args) => (Service::SkillManager, args),
            ServiceCommand::Monitor(args) => (Service::Monitor, args),
            ServiceCommand::Planner(args) => (Service::Planner, args),
            ServiceCommand::Mcm(args) => (Service::Mcm, args),
            ServiceCommand::ControlTower(args) => (Service::ControlTower, args),
            ServiceCommand::Gateway(args) => (Service::Gateway, args),
        }
    }
}

/// For each service.
#[derive(Debug, Args)]
pub struct ProcessArgs {
    #[command(flatten)]
    pub settings: Settings,
    /// The router's locator; the first that answers is used
    #[arg(long, value_name = "LOCATOR", value_parser = read_locator, default_values_t = [run_file::router_locator()])]
    pub connect: Vec<String>,
    /// The folder of the direct links: sockets between the processes on board, in addition to the router
    #[arg(long, value_name = "DIR")]
    pub direct: Option<PathBuf>,
    /// End when standard input ends
    #[arg(long, hide = true)]
    pub exit_with_parent: bool,
}

/// For `kittiwake run onboard`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n    kittiwake run onboard --nodes mcm,skill-manager,monitor,planner --vehicle uav1")]
pub struct OnboardArgs {
    /// The nodes, by the names of their own commands
    #[arg(long, value_name = "NODES")]
    pub nodes: Composition,
    #[command(flatten)]
    pub process: ProcessArgs,
}

/// For `kittiwake inject`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n    kittiwake inject flag obstacle         the vehicle stops, replans and goes on\n    kittiwake inject fault battery 0.2     a battery that drops to 20 %\n    kittiwake inject fault wind 6 0 3      wind to the north and to the east, and its gusts, in m/s"
)]
pub struct InjectArgs {
    #[command(subcommand)]
    pub what: Injection,
}

/// What is injected.
#[derive(Debug, Subcommand)]
pub enum Injection {
    /// Raise a flag by hand, as the monitor would
    Flag {
        /// A flag of the contingency table
        name: String,
        /// Lower it instead
        #[arg(long)]
        lower: bool,
        #[command(flatten)]
        target: TargetArgs,
    },
    /// Inject a fault into the simulator; without a name, list the faults there are
    Fault {
        /// A fault of the simulator's catalogue
        name: Option<String>,
        /// Its arguments
        #[arg(allow_negative_numbers = true)]
        args: Vec<String>,
        #[command(flatten)]
        target: TargetArgs,
    },
}

/// For `kittiwake status`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n    kittiwake status                                          of the system that runs here\n    kittiwake status --vehicle uav1                          of another, with KITTIWAKE_URL and KITTIWAKE_TOKEN\n    kittiwake status --all | jq .energy                      everything that is known, as JSON"
)]
pub struct StatusArgs {
    /// Prints everything that is known, as JSON
    #[arg(long)]
    pub all: bool,
    #[command(flatten)]
    pub target: TargetArgs,
}

/// For `kittiwake access`.
#[derive(Debug, Args)]
pub struct AccessArgs {
    /// The gateway's folder, its --access
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The file of the token itself; the gateway need not read it
    #[arg(long, value_name = "FILE")]
    pub secret: PathBuf,
    /// Where the operator's browser reaches the gateway
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    pub url: String,
}

/// For `kittiwake health`.
#[derive(Debug, Args)]
pub struct HealthArgs {
    /// Which process; without it, the one that this container runs
    #[arg(long, value_name = "NAME", value_parser = processes())]
    pub process: Option<String>,
    /// The locator of the router that the process is connected to
    #[arg(
        long,
        value_name = "LOCATOR",
        value_parser = read_locator,
        default_values_t = [run_file::router_locator()],
        requires = "process"
    )]
    pub connect: Vec<String>,
    /// The vehicle that the process belongs to
    #[arg(long, value_name = "NAME", requires = "process")]
    pub vehicle: Option<VehicleName>,
    /// The configuration file that names the vehicle, if --vehicle does not
    #[arg(long, value_name = "FILE", default_value_os_t = default_config(), requires = "process")]
    pub config: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

fn processes() -> PossibleValuesParser {
    PossibleValuesParser::new(std::iter::once("router").chain(Service::ALL.map(Service::name)))
}

/// Which running system is meant; nothing is needed where only one runs.
#[derive(Debug, Clone, Default, Args)]
pub struct TargetArgs {
    /// The launcher's process id
    #[arg(long)]
    pub pid: Option<u32>,
    /// The router's locator
    #[arg(long, value_name = "LOCATOR", value_parser = read_locator)]
    pub connect: Option<String>,
    /// The gateway's address, such as `http://127.0.0.1:8080`; else KITTIWAKE_URL, else the system that runs here
    #[arg(long = "url", alias = "http", value_name = "URL")]
    pub http: Option<String>,
    /// The vehicle
    #[arg(long, value_name = "NAME")]
    pub vehicle: Option<VehicleName>,
    /// The configuration file of a system that was not started by `kittiwake up`
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        command().debug_assert();
    }

    #[test]
    fn every_command_is_in_one_group_of_the_overview() {
        let command = command();
        let mut names: Vec<_> = command.get_subcommands().map(clap::Command::get_name).collect();
        let mut shown: Vec<_> = GROUPS.iter().flat_map(|it| it.1).copied().collect();
        names.sort_unstable();
        shown.sort_unstable();
        assert_eq!(names, shown);
    }

    #[test]
    fn a_process_lists_only_the_options_that_it_reads() {
        #[track_caller]
        fn check(process: &str, shown: &str, hidden: &str) {
            let help = command().try_get_matches_from(["kittiwake", "run", process, "--help"]).unwrap_err().to_string();
            assert!(help.contains(shown) && !help.contains(hidden), "{help}");
        }
        check("mcm", "--tower-key", "--http");
        check("gateway", "--http", "--tower-key");
        check("monitor", "--vehicle", "--seed");
        check("onboard", "--record-inputs", "--tower-secret");
        check("router", "--dial", "--seed");
    }

    #[test]
    fn nothing_means_up() {
        let cli = Cli::parse_from(["kittiwake", "--exit-when-done"]);
        assert!(cli.command.is_none() && cli.up.exit_when_done);
    }

    #[test]
    fn a_backend_is_named_as_such_or_in_place_of_the_vehicle() {
        #[track_caller]
        fn check(args: &[&str], backend: Backend, vehicle: Option<&str>) {
            let (found, settings) = Cli::parse_from([&["kittiwake"], args].concat()).up.flown();
            assert_eq!((found, settings.vehicle.as_ref().map(|it| it.as_str())), (backend, vehicle), "{args:?}");
        }
        check(&[], Backend::Sim, None);
        check(&["--vehicle", "uav2"], Backend::Sim, Some("uav2"));
        check(&["--vehicle", "px4"], Backend::Px4, None);
        check(&["--vehicle", "sim"], Backend::Sim, None);
        check(&["--vehicle", "mavlink"], Backend::Mavlink, None);
        check(&["--backend", "px4", "--vehicle", "uav2"], Backend::Px4, Some("uav2"));
    }

    #[test]
    fn what_follows_a_companion_is_handed_on_as_it_is() {
        let cli = Cli::parse_from(["kittiwake", "kpi", "--floor", "--tick-ms", "10,5", "--help"]);
        let Some(Command::Kpi(args)) = cli.command else { panic!("{cli:?}") };
        assert_eq!(args.args, ["--floor", "--tick-ms", "10,5", "--help"]);
        let cli = Cli::parse_from(["kittiwake", "chaos", "--runs", "3"]);
        let Some(Command::Chaos(args)) = cli.command else { panic!("{cli:?}") };
        assert_eq!(args.args, ["--runs", "3"]);
    }

    #[test]
    fn arguments_out_of_range_are_refused() {
        #[track_caller]
        fn check(args: &[&str], said: &str) {
            let error = Cli::try_parse_from([&["kittiwake"], args].concat()).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(said), "{error}");
        }
        check(&["--speed", "0"], "0.1 to 100");
        check(&["up", "--speed", "101"], "0.1 to 100");
        check(&["up", "--speed", "NaN"], "0.1 to 100");
        check(&["up", "--permissions", "maybe"], "grant, delay, deny, random, silent");
        check(&["up", "--http", "here"], "invalid socket address");
        check(&["run", "mcm", "--vehicle", "a/b"], "lower-case");
        check(&["health", "--process", "autopilot"], "router, vehicle-sim, px4-bridge, mavlink-bridge, skill-manager");
        check(&["health", "--vehicle", "uav1"], "--process <NAME>");
        check(&["simulate", "--runs", "0"], "--runs");
        check(&["simulate", "--fault", "batery@60:0.2"], "did you mean `battery`?");
        check(&["simulate", "--fault", "gnss_loss@-3"], "expected seconds after the start");
        check(&["simulate", "--flag", "obstacle"], "NAME@SECONDS");
        check(&["simulate", "--shrink", "7", "--runs", "2"], "--runs");
        check(&["fly"], "unrecognized subcommand");
    }
}
