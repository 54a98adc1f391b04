//! Broken tables: the shipped one with an edit, as data. Each is refused at the row that is wrong, or by the hazard that has no row; nothing
//! is flown for it.

use std::path::Path;

use domain::contingency::Contingencies;
use domain::contingency::hazard::{HAZARDS, Hazard};
use domain::file::Source;
use simulation::proof::review::{Place, Remark, review};

use Edit::{Add, Set, Unset, Without, WithoutGroups};

/// An edit of the shipped table.
enum Edit {
    /// These rows are taken out.
    Without(&'static [&'static str]),
    /// All rows of these groups are, but for those without which no table is read.
    WithoutGroups(&'static [&'static str]),
    /// In the row of this flag, this key has this value.
    Set(&'static str, &'static str, &'static str),
    /// It is left out.
    Unset(&'static str, &'static str),
    /// Lines after the last row.
    Add(&'static str),
}

/// Rows that each table needs: see `domain::contingency`.
const NEEDED: [&str; 5] =
    ["somebody_else_flies", "autopilot_preempts", "frame_moved", "land_detector_contradicts", "area_breached"];

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config")
}

/// The shipped table, row by row: what precedes the first one comes first.
fn chunks() -> Vec<String> {
    let text = std::fs::read_to_string(folder().join("contingencies.toml")).unwrap();
    text.split("[[contingency]]").map(str::to_owned).collect()
}

fn flag_of(chunk: &str) -> Option<&str> {
    chunk.lines().find_map(|it| it.strip_prefix("flag = \"")?.strip_suffix('"'))
}

fn set(chunk: &str, key: &str, value: Option<&str>) -> String {
    let is_key = |line: &&str| line.split_once(" = ").is_some_and(|(it, _)| it == key);
    let (head, rest) = chunk.split_once("\n\n").unwrap_or((chunk, ""));
    let others = head.lines().filter(|it| !is_key(it)).collect::<Vec<_>>().join("\n");
    let line = value.map_or_else(String::new, |it| format!("{key} = {it}\n"));
    format!("{others}\n{line}\n{rest}")
}

fn without(chunks: &mut Vec<String>, is_out: impl Fn(&str) -> bool) {
    let out: Vec<String> =
        chunks.iter().filter_map(|it| flag_of(it)).filter(|it| is_out(it)).map(str::to_owned).collect();
    assert!(!out.is_empty());
    chunks.retain(|it| flag_of(it).is_none_or(|flag| !is_out(flag)));
    // Nobody is explained by a row that is not there.
    for chunk in chunks {
        let Some(line) = chunk.lines().find(|it| it.starts_with("explained_by = [")) else { continue };
        let left: Vec<&str> =
            line.split('"').skip(1).step_by(2).filter(|it| !out.iter().any(|out| out == it)).collect();
        let value = format!("[{}]", left.iter().map(|it| format!("\"{it}\"")).collect::<Vec<_>>().join(", "));
        *chunk = set(chunk, "explained_by", (!left.is_empty()).then_some(value.as_str()));
    }
}

fn edited(edits: &[Edit]) -> String {
    let mut chunks = chunks();
    for edit in edits {
        let mut change = |flag: &str, key: &str, value: Option<&str>| {
            let chunk = chunks.iter_mut().find(|it| flag_of(it) == Some(flag));
            let chunk = chunk.unwrap_or_else(|| panic!("there is no row `{flag}`"));
            *chunk = set(chunk, key, value);
        };
        match edit {
            Without(flags) => without(&mut chunks, |it| flags.contains(&it)),
            WithoutGroups(groups) => {
                let is_of = |chunk: &String| groups.iter().any(|it| chunk.contains(&format!("\ngroup = \"{it}\"\n")));
                let out: Vec<String> =
                    chunks.iter().filter(|it| is_of(it)).filter_map(|it| flag_of(it)).map(str::to_owned).collect();
                without(&mut chunks, |it| out.iter().any(|out| out == it) && !NEEDED.contains(&it));
            }
            Set(flag, key, value) => change(flag, key, Some(value)),
            Unset(flag, key) => change(flag, key, None),
            Add(lines) => chunks.last_mut().unwrap().push_str(lines),
        }
    }
    chunks.join("[[contingency]]")
}

fn remarks(edits: &[Edit]) -> Vec<Remark> {
    let trees = mcm::Trees::read(&folder().join("trees")).unwrap();
    let source = Source { path: "c.toml".into(), text: edited(edits) };
    review(&Contingencies::read(&source, &trees.actions()).unwrap_or_else(|mistakes| panic!("{mistakes}")))
}

/// A table with these edits has a remark with these words; at the row of this flag, or without one at no row.
#[track_caller]
fn check(edits: &[Edit], flag: &str, words: &str) {
    let remarks = remarks(edits);
    let place = if flag.is_empty() { Place::Table } else { Place::Row(flag.to_owned()) };
    let found = remarks.iter().find(|it| it.place == place && it.what.contains(words));
    assert!(found.is_some(), "`{words}` is not said of `{flag}`: {remarks:#?}");
}

const AIR: &str = "[\"takeoff\", \"cruise\", \"waiting\", \"inside-area\"]";
const HOLDS: &str = "emergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"\n";
const RETURNS: &str = "emergency = \"land\"\nclears = \"never\"\nthen = \"end-mission\"\n";

#[test]
fn there_is_nothing_against_the_shipped_table_and_its_waivers_hide_no_response() {
    assert_eq!(remarks(&[]), []);
    let table = edited(&[]);
    let waived = HAZARDS.iter().filter(|it| table.contains(&format!("hazard = \"{}\"", it.name)));
    let names: Vec<&str> = waived.map(|it| it.name).collect();
    assert_eq!(
        names,
        ["battery-voltage-low", "global-position-silent", "land-detector-silent", "autopilots-own-link-lost"]
    );
}

#[test]
fn every_row_of_a_group_can_be_missed() {
    #[track_caller]
    fn check_all(edits: &[Edit], hazards: &[&str]) {
        let remarks = remarks(edits);
        for hazard in hazards {
            assert!(Hazard::named(hazard).is_some(), "{hazard}");
            let told = format!("hazard `{hazard}` (");
            assert!(remarks.iter().any(|it| it.what.contains(&told)), "{hazard}: {remarks:#?}");
        }
    }
    let energy =
        ["battery-low", "battery-nearly-empty", "battery-silent", "battery-hot", "battery-faulty", "energy-short"];
    let navigation = ["position-invalid", "satellites-lost", "position-silent", "position-coarse", "heading-wrong"];
    let vehicle = ["motor-failed", "turned-over", "falling", "vibration-extreme", "autopilot-returns"];
    check_all(&[WithoutGroups(&["energy"])], &energy);
    check_all(&[WithoutGroups(&["navigation", "vehicle"])], &navigation);
    check_all(&[WithoutGroups(&["navigation", "vehicle"])], &vehicle);
    check_all(&[WithoutGroups(&["weather"])], &["wind-too-strong", "wind-high", "gust-too-strong", "gust-at-landing"]);
    check_all(
        &[Without(&["link_lost", "link_gone", "tower_lost"])],
        &["link-lost", "link-lost-for-long", "tower-silent"],
    );
    check_all(
        &[Without(&["traffic_near", "drone_near", "vessel_near"])],
        &["aircraft-near", "drone-near", "vessel-near"],
    );
}

#[test]
fn a_hazard_without_a_row_is_named() {
    check(
        &[Without(&["battery_faulty"])],
        "",
        "hazard `battery-faulty` (battery.faulty true) calls for a response (return, divert)",
    );
    check(&[Without(&["clock_jumped"])], "", "hazard `clock-jumped`");
    check(&[Without(&["cancel_ignored"])], "", "hazard `skill-does-not-end`");
    check(
        &[Without(&["autopilot_comes_down"])],
        "autopilot_preempts",
        "no row answers so; `autopilot_preempts` answers by",
    );
}

#[test]
fn a_response_that_does_not_fit_is_named_by_its_row() {
    let hover = |flag: &'static str| {
        [
            Set(flag, "actions", "[\"stop\"]"),
            Set(flag, "emergency", "\"stop\""),
            Set(flag, "clears", "\"with-condition\""),
        ]
    };
    let both: Vec<Edit> = hover("battery_critical").into_iter().chain(hover("battery_emergency")).collect();
    check(
        &both,
        "battery_critical",
        "hazard `battery-nearly-empty` (battery.charge_percent 6.00 %) calls for a response (land)",
    );
    check(&both, "battery_emergency", "`battery_emergency` answers by `stop` (hold)");
    check(
        &hover("battery_emergency"),
        "battery_emergency",
        "never responds: whenever its flag is up, so is `battery_critical`",
    );
    check(&hover("motor_failure"), "motor_failure", "hazard `motor-failed`");
    check(&hover("estimator_lost"), "estimator_lost", "hazard `position-invalid`");
    // In the water, or among people, although it still flies.
    let lands = |flag: &'static str, action: &'static str| {
        [Set(flag, "actions", action), Set(flag, "emergency", "\"land_now\"")]
    };
    check(&lands("battery_low", "[\"land_now\"]"), "battery_low", "`battery_low` answers by `land_now` (land)");
    check(
        &lands("battery_low", "[\"ditch\"]"),
        "battery_low",
        "`battery_low` answers by `ditch, else land_now` (ditch)",
    );
    check(&lands("link_gone", "[\"ditch\"]"), "link_gone", "hazard `link-lost-for-long`");
    check(
        &lands("area_breached", "[\"land_now\"]"),
        "area_breached",
        "hazard `area-closed` (`area_breached` is raised",
    );
    check(&lands("skill_manager_lost", "[\"terminate\"]"), "skill_manager_lost", "hazard `skill-manager-dead`");
    check(&lands("ended_in_air", "[\"land_now\"]"), "ended_in_air", "hazard `ended-in-the-air`");
}

#[test]
fn a_row_that_does_not_count_where_its_hazard_is_met_is_named() {
    check(
        &[Set("battery_low", "phases", "[\"on-ground\", \"takeoff\", \"landing\"]")],
        "battery_low",
        "`battery_low` does not count on the way",
    );
    check(
        &[Set("battery_low", "phases", AIR)],
        "battery_low",
        "within 10 s on the ground: `battery_low` does not count on the ground",
    );
    check(&[Set("traffic_near", "phases", "[\"landing\"]")], "traffic_near", "hazard `aircraft-near`");
    check(
        &[Set("local_position_stale", "phases", "[\"on-ground\"]")],
        "local_position_stale",
        "hazard `position-silent`",
    );
    check(&[Set("link_lost", "situations", "[\"unseen\"]")], "link_lost", "does not count on the way, flying");
    check(
        &[Set("battery_stale", "during", "\"flying\"")],
        "battery_stale",
        "`battery_stale` is not raised on the ground",
    );
    check(&[Unset("tower_lost", "narrows")], "tower_lost", "calls for a flag that narrows (no-new-area)");
    check(&[Set("heading_fault", "narrows", "[\"no-new-area\"]")], "heading_fault", "hazard `heading-wrong`");
}

#[test]
fn a_row_that_is_raised_too_late_is_named() {
    let late = |flag: &'static str, seconds: &'static str| [Set(flag, "for_s", seconds)];
    check(&late("battery_low", "600.0"), "battery_low", "`battery_low` is raised after 600 s");
    check(
        &late("battery_emergency", "600.0"),
        "battery_emergency",
        "is raised after 600 s, and hazard `battery-empty`",
    );
    check(&late("wind_too_strong", "300.0"), "wind_too_strong", "is raised after 300 s");
    check(&late("sinking", "5.0"), "sinking", "hazard `falling` (motion.climb_m_s -10.00 m/s)");
    check(&late("link_lost", "120.0"), "link_lost", "hazard `link-lost`");
    let when = |flag: &'static str, text: &'static str| [Set(flag, "when", text)];
    check(
        &when("planner_gone", "\"planner.silent_s >= 3000 s\""),
        "planner_gone",
        "is not raised before planner.silent_s",
    );
    check(&when("attitude_exceeded", "\"attitude.tilt_deg > 170 deg\""), "attitude_exceeded", "hazard `turned-over`");
    let lowered = [
        Set("battery_critical", "when", "\"battery.charge_percent < 3 %\""),
        Set("battery_emergency", "when", "\"battery.charge_percent < 2 %\""),
    ];
    check(&lowered, "battery_critical", "`battery_critical` is not raised before battery.charge_percent");
    check(
        &when("battery_hot", "\"battery.temperature_c > 60 degC and wind.speed_m_s > 20 m/s\""),
        "battery_hot",
        "`battery_hot` is not raised by it",
    );
}

#[test]
fn an_expression_that_does_not_do_what_it_says_is_named_however_it_is_written() {
    let when = |flag: &'static str, text: &'static str| [Unset(flag, "clear_when"), Set(flag, "when", text)];
    check(&when("wind_too_strong", "\"wind.speed_m_s > 60 m/s\""), "wind_too_strong", "never rises");
    check(&when("wind_too_strong", "\"wind.speed_m_s / 2 > 20 m/s\""), "wind_too_strong", "never rises");
    check(&when("battery_hot", "\"battery.temperature_c - 100 degC > 60 degC\""), "battery_hot", "never rises");
    check(&when("gnss_lost", "\"not known(gnss.lost) and gnss.lost\""), "gnss_lost", "never rises");
    check(
        &when("wind_too_strong", "\"wind.speed_m_s > 14 m/s or wind.gust_m_s > 80 m/s\""),
        "wind_too_strong",
        "wind.gust_m_s decides nothing within 0.00 m/s to 45.00 m/s",
    );
    check(&when("battery_low", "\"battery.charge_percent > 25 %\""), "battery_low", "is up while all is well");
    let clear = |flag: &'static str, text: &'static str| [Set(flag, "clear_when", text)];
    check(
        &clear("battery_low", "\"battery.charge_percent * 2 >= 40 %\""),
        "battery_low",
        "would fall while what raises it holds",
    );
    check(
        &clear("wind_too_strong", "\"wind.speed_m_s - 2 m/s < 14 m/s\""),
        "wind_too_strong",
        "would fall while what raises it holds",
    );
    check(
        &clear("battery_critical", "\"max(battery.charge_percent, 0 %) > 9.9 %\""),
        "battery_critical",
        "would fall while",
    );
}

#[test]
fn a_flag_that_is_up_or_down_at_the_wrong_time_or_calls_for_nobody_is_named() {
    check(
        &[Set("battery_hot", "when", "\"battery.temperature_c > 60 degC\"")],
        "battery_hot",
        "is up in the air where nothing says battery.temperature_c",
    );
    check(
        &[Set("wind_high", "clear_when", "\"wind.speed_m_s < 1 m/s\"")],
        "wind_high",
        "stays up on the ground although all is well again",
    );
    check(&[Set("link_lost", "clears", "\"after-action\"")], "link_lost", "falls after its response, although");
    let silent = [
        Set("battery_critical", "alarm", "\"advisory\""),
        Set("battery_low", "alarm", "\"advisory\""),
        Set("battery_emergency", "alarm", "\"advisory\""),
    ];
    check(&silent, "battery_critical", "`battery_critical` calls for nobody");
    check(&[Set("operator_return", "actions", "[\"land\"]")], "operator_return", "hazard `order-to-return`");
    check(&[Set("operator_pause", "phases", "[\"waiting\"]")], "operator_pause", "hazard `order-to-pause`");
}

#[test]
fn a_row_that_another_one_hides_is_named_however_it_is_written() {
    #[track_caller]
    fn hidden(when: &'static str, more: &str, by: &str) {
        let row = format!(
            "\n[[contingency]]\nflag = \"hidden\"\npriority = 300\nwhen = \"{when}\"\nfor_s = 1.0\nduring = \"flying\"\nphases = {AIR}\n{more}"
        );
        let words = format!("`hidden` never responds: whenever its flag is up, so is `{by}`");
        check(&[Add(row.leak())], "hidden", &words);
    }
    let returns = format!("actions = [\"return_home\"]\n{RETURNS}");
    hidden("battery.charge_percent + 5 % < 20 %", &returns, "battery_low");
    hidden("min(battery.charge_percent, 80 %) * 2 < 30 %", &returns, "battery_low");
    hidden("not (battery.charge_percent >= 4 %)", &format!("actions = [\"land\"]\n{RETURNS}"), "battery_critical");
    hidden(
        "battery.silent_s - 5 s >= 20 s",
        &format!("actions = [\"stop\"]\nalarm = \"caution\"\n{HOLDS}"),
        "battery_gone",
    );
}

#[test]
fn a_waiver_of_what_is_answered_is_taken_out() {
    let remarks = remarks(&[Add("\n[[waiver]]\nhazard = \"battery-low\"\nreason = \"a tether feeds the vehicle\"\n")]);
    let told = "`battery-low` is waived on the ground, and answered there";
    assert!(remarks.iter().any(|it| it.place == Place::Waiver("battery-low") && it.what == told), "{remarks:#?}");
    let tethered = [
        Without(&["battery_low"]),
        Add("\n[[waiver]]\nhazard = \"battery-low\"\nreason = \"a tether feeds the vehicle\"\n"),
    ];
    let remarks = self::remarks(&tethered);
    assert!(!remarks.iter().any(|it| it.what.contains("battery-low")), "{remarks:#?}");
}
