//! A real PX4, software in the loop with its built-in quadrotor, in a network namespace that has nothing but a loopback.
//!
//! The namespace is made by util-linux's `unshare`, which needs no privileges where users may make namespaces. PX4 keeps its
//! parameters in a folder of its own, so that every story starts from the defaults.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::px4::support::{KITTIWAKE, System};

/// Names the executable.
const VARIABLE: &str = "KITTIWAKE_PX4";
/// The parameters that docs/px4.md asks for.
const PARAMETERS: [(&str, &str); 5] = [
    ("PX4_PARAM_ZENOH_ENABLE", "1"),
    ("PX4_PARAM_COM_OBL_RC_ACT", "5"),
    ("PX4_PARAM_COM_LOW_BAT_ACT", "3"),
    ("PX4_PARAM_COM_RCL_EXCEPT", "7"),
    ("PX4_PARAM_COM_DLL_EXCEPT", "7"),
];
/// In the namespace: PX4 beside the system, a shell that carries out what a story does to them, and an end of all of them with the first.
/// PX4's instance keeps its sockets apart from those of others, since `/tmp` is everybody's.
const SCRIPT: &str = r#"
ip link set lo up || exit 90
export PX4_BIN="$(dirname "$PX4_PROGRAM")"
(cd "$PX4_FOLDER" && exec "$PX4_PROGRAM" -d -i "$PX4_INSTANCE" -w "$PX4_FOLDER" "$PX4_ETC" >px4.log 2>&1) &
px4=$!
"$@" &
export SYSTEM=$!
(tail --pid=$$ -f /dev/null; [ -e "$PX4_FOLDER/ended" ] || kill "$px4" "$SYSTEM") >/dev/null 2>&1 &
(cd "$PX4_FOLDER" && exec sh orders >orders.log 2>&1) &
wait "$SYSTEM"
code=$?
kill "$px4"
wait "$px4"
: >"$PX4_FOLDER/ended"
exit "$code"
"#;

/// What happens in a story, in order.
enum Step {
    /// The system must say this.
    Says(&'static str),
    /// A command of PX4's own shell: another ground station, or a fault.
    Px4(&'static str),
    /// A command of ours to the system that runs.
    Kittiwake(&'static str),
}
use Step::{Kittiwake, Px4, Says};

/// A mission over a PX4 that was never started before.
struct Story {
    name: &'static str,
    /// Apart from those of others that fly at the same time.
    instance: u16,
    args: &'static [&'static str],
    steps: &'static [Step],
    /// The exit code of `kittiwake up`.
    code: i32,
    /// What PX4's own log must say so often: nobody else was asked about it.
    px4_says: &'static [(&'static str, usize)],
}

/// The executable that the environment names.
#[track_caller]
fn program() -> PathBuf {
    let path = std::env::var_os(VARIABLE).unwrap_or_else(|| panic!("{VARIABLE} has to name a px4 executable"));
    let path = PathBuf::from(path);
    path.canonicalize().unwrap_or_else(|cause| panic!("{VARIABLE}: {}: {cause}", path.display()))
}

/// Starts the system over a PX4 that was never started before; `orders` is where its shell reads what to do.
fn start(program: &Path, folder: &Path, story: &Story) -> System {
    // It is there only if an earlier run has left it.
    let _ = std::fs::remove_dir_all(folder);
    std::fs::create_dir_all(folder).expect("a folder");
    let made = Command::new("mkfifo").arg(folder.join("orders")).status().expect("coreutils");
    assert!(made.success());
    // A build has `bin/px4` beside `etc`.
    let etc = program.parent().and_then(Path::parent).expect("a build folder").join("etc");
    let mut command = Command::new("unshare");
    command.args(["--user", "--map-root-user", "--net", "--", "sh", "-c", SCRIPT, "sh", KITTIWAKE]);
    command.args(["up", "--vehicle", "px4", "--exit-when-done"]).args(story.args);
    command.env("PX4_FOLDER", folder).env("PX4_PROGRAM", program).env("PX4_ETC", etc);
    command.env("PX4_INSTANCE", story.instance.to_string()).env("KITTIWAKE", KITTIWAKE);
    command.env("PX4_SIM_MODEL", "sihsim_quadx").envs(PARAMETERS);
    System::start(command)
}

/// Flies a story.
#[track_caller]
fn check(story: &Story) {
    let program = program();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("px4-{}", story.name));
    let mut system = start(&program, &folder, story);
    // It waits for the shell that reads.
    let mut orders = std::fs::File::options().write(true).open(folder.join("orders")).expect("the shell");
    for step in story.steps {
        let order = match step {
            Says(text) => {
                system.wait_for(text);
                continue;
            }
            Px4(command) => {
                let (tool, arguments) = command.split_once(' ').expect("a tool and its arguments");
                format!(r#""$PX4_BIN/px4-{tool}" --instance "$PX4_INSTANCE" {arguments}"#)
            }
            Kittiwake(command) => format!(r#""$KITTIWAKE" {command} --pid "$SYSTEM""#),
        };
        writeln!(orders, "{order}").expect("the shell reads");
    }
    let (code, said) = system.end();
    let read = |file| std::fs::read_to_string(folder.join(file)).expect("a log");
    let (px4, done) = (read("px4.log"), read("orders.log"));
    assert_eq!(code, Some(story.code), "{said}\n{done}\n{px4}");
    for (text, times) in story.px4_says {
        assert_eq!(px4.matches(text).count(), *times, "`{text}`: {px4}\n{said}");
    }
}

/// PX4's words for a flight there, and one back.
const TWICE: &[(&str, usize)] = &[("Takeoff detected", 2), ("Landing detected", 2), ("Failsafe activated", 0)];
const ONCE: &[(&str, usize)] = &[("Takeoff detected", 1), ("Landing detected", 1), ("Failsafe activated", 0)];

/// One test for each story.
macro_rules! stories {
    ($($name:ident: $story:expr;)*) => {
        $(#[test]
        #[ignore = "needs a px4 executable: KITTIWAKE_PX4=PATH cargo test --test stories -- --ignored px4::"]
        fn $name() { check(&$story) })*
    };
}

const CRUISES: Step = Says("step 4 of 5, offboard, at");

stories! {
    the_reference_mission_is_flown: Story {
        name: "reference", instance: 41, args: &[], steps: &[], code: 0, px4_says: TWICE,
    };
    with_denied_areas_it_flies_round_the_first_and_comes_home_before_the_second: Story {
        name: "denied", instance: 42, args: &["--permissions", "deny"], steps: &[], code: 3, px4_says: ONCE,
    };
    with_a_silent_tower_it_flies_round_the_first_area_and_comes_home: Story {
        name: "silent", instance: 43, args: &["--permissions", "silent"], steps: &[], code: 3, px4_says: ONCE,
    };
    before_an_area_it_holds_until_it_is_granted: Story {
        name: "delay", instance: 44, args: &["--permissions", "delay"], steps: &[], code: 0, px4_says: TWICE,
    };
    an_obstacle_is_stopped_for: Story {
        name: "obstacle", instance: 45, args: &[], code: 0, px4_says: TWICE,
        steps: &[CRUISES, Kittiwake("inject flag obstacle"), Says("`obstacle`")],
    };
    an_empty_battery_brings_it_down: Story {
        name: "battery", instance: 46, args: &[], code: 4, px4_says: &[("Takeoff detected", 1)],
        steps: &[CRUISES, Px4("failure battery off"), Says("flag `battery_critical` raised")],
    };
    what_a_fence_of_px4_pre_empts_goes_on_by_an_order: Story {
        name: "fence", instance: 47, args: &[], code: 0, px4_says: &[("Takeoff detected", 2), ("Failsafe activated", 1)],
        steps: &[
            CRUISES, Px4("param set GF_MAX_HOR_DIST 30"), Says("flag `autopilot_preempts` raised"),
            Px4("param set GF_MAX_HOR_DIST 0"), Kittiwake("vehicle resume"),
        ],
    };
    another_ground_station_is_left_alone_until_an_order: Story {
        name: "taken", instance: 48, args: &[], code: 0, px4_says: TWICE,
        steps: &[
            CRUISES, Px4("commander mode auto:loiter"), Says("flag `somebody_else_flies` raised"),
            Kittiwake("vehicle resume"),
        ],
    };
}
