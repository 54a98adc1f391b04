//! For tests of this and of other crates: files that are as short as they can be.

use std::fmt::Write;

use crate::contingency::snapshot::Kind;
use crate::contingency::{BRING_DOWN, REQUIRED, REQUIRED_FIELDS, SOMEBODY_ELSE_FLIES};
use crate::file::Mistakes;

/// How the aircraft of the shipped configuration flies, as a file has it.
pub const FLIGHT: &str = "
[flight]
cruise_m_s = 10.0
airspeed_m_s = 15.0
climb_m_s = 3.0
descent_m_s = 1.5
least_height_m = 5.0
return_height_m = 15.0
highest_m = 120.0
stand_off_m = 20.0
margin = 0.5
vertical_margin_m = 2.0
";

/// The energy model of the shipped configuration, as a file has it.
pub const ENERGY: &str = "
[energy]
capacity_wh = 300.0
reserve = 0.25
hover_w = 725.0
cruise_w = 812.0
cruise_m_s = 10.0
climb_w = 758.0
climb_m_s = 3.0
descent_w = 714.0
descent_m_s = 1.5
takeoff_s = 8.0
landing_s = 10.0
stop_s = 3.0
headwind_m_s = 4.0
";

/// The actions of [`table`]; each is also the name of a tree.
pub const ACTIONS: [&str; 3] = ["stop", "return_home", "land"];

/// A contingency file of `rows`, preceded by their actions and followed by the other rows that every table needs.
/// The priorities of these begin at 1,000.
pub fn table(rows: &str) -> String {
    let severities = ["hold", "return", "land"];
    let mut text = String::new();
    for (action, severity) in ACTIONS.iter().zip(severities) {
        let _ = writeln!(text, "[action.{action}]\nseverity = \"{severity}\"\ntries = 2\n");
    }
    text += rows;
    let missing = REQUIRED.iter().filter(|flag| !rows.contains(&format!("\"{flag}\"")));
    for (flag, priority) in missing.zip(1000..) {
        let (action, then, more) = match *flag {
            SOMEBODY_ELSE_FLIES => ("yield_control", "resume", "label = \"binding\"\n"),
            flag if BRING_DOWN.contains(&flag) => ("land", "end-mission", ""),
            _ => ("stop", "resume", ""),
        };
        let _ = write!(
            text,
            "[[contingency]]\nflag = \"{flag}\"\npriority = {priority}\nactions = [\"{action}\"]\n\
             emergency = \"{action}\"\nclears = \"after-action\"\nthen = \"{then}\"\n{more}"
        );
    }
    let unwatched = REQUIRED_FIELDS.iter().filter(|it| !rows.contains(it.name()));
    for (field, priority) in unwatched.zip(2000..) {
        // So late that no test meets it.
        let name = field.name();
        let (when, hold_s) = match field.kind() {
            Kind::Number { .. } => (format!("{name} >= 3600 s"), 0.0),
            Kind::Choice(_) => (format!("known({name}) and {name}"), 3600.0),
        };
        let _ = writeln!(
            text,
            "[[contingency]]\nflag = \"watched_{priority}\"\npriority = {priority}\nwhen = \"{when}\"\nfor_s = {hold_s:?}\n\
             during = \"flying\"\nactions = [\"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\""
        );
    }
    text + "[action.yield_control]\nseverity = \"yield\"\ntries = 1\n"
}

/// Replaces `find` in a good file by `replace`, and checks that the mistake is reported as `expected`, with its place.
///
/// # Panics
/// If the file does not contain `find`, is accepted, or another mistake is reported.
#[track_caller]
pub fn check_mistake<T>(good: &str, find: &str, replace: &str, read: fn(&str) -> Result<T, Mistakes>, expected: &str) {
    assert!(good.contains(find), "the test's own text lacks `{find}`");
    match read(&good.replacen(find, replace, 1)) {
        Ok(_) => panic!("read without a mistake; expected `{expected}`"),
        Err(mistakes) => {
            let told = mistakes.to_string();
            assert!(told.starts_with(expected), "expected `{expected}`, got `{told}`");
        }
    }
}
