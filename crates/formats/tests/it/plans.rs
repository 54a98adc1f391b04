//! A plan is flown as an autopilot flies it, or refused by the name of what cannot be.

use super::{import, mission, notes, settings, source};
use domain::mission::Mission;
use formats::LeaveOut;
use formats::assemble::{Assembled, Settings, assemble};

pub(super) const JUMP: &str = include_str!("samples/plans/jump.plan");
pub(super) const WPL: &str = include_str!("samples/plans/wpl.waypoints");
const LAND_START: &str = include_str!("samples/plans/land-start-mid.plan");
const LAND_HERE: &str = include_str!("samples/plans/survey-land-here.plan");
const VTOL: &str = include_str!("samples/plans/spline-vtol.plan");
const OLD_FENCE: &str = include_str!("samples/plans/old-fence.plan");
const LAND_HIGH: &str = include_str!("samples/plans/land-alt20.plan");
const SET_HOME: &str = include_str!("samples/plans/set-home.plan");
const VERSION_2: &str = include_str!("samples/plans/version2.plan");

/// A line for each objective: metres north, east and up, how long it stays, and what it does there.
fn in_words(mission: &Mission) -> Vec<String> {
    let line = |it: &domain::mission::Objective| {
        let kind = if it.flying { "" } else { " ground" };
        let dwell = match it.terms.dwell.as_secs() {
            0 => String::new(),
            seconds => format!(" {seconds} s"),
        };
        let drop = if it.terms.drop { " drop" } else { "" };
        let actions: String =
            it.terms.actions.iter().map(|it| format!(" [{}]", it.trim_start_matches("MAV_CMD_"))).collect();
        format!("{}{kind}{dwell}{drop}{actions}", it.position)
    };
    mission.objectives.iter().map(line).collect()
}

#[track_caller]
fn read(name: &str, text: &str) -> Assembled {
    import(name, text, &Settings { origin: None, ..settings() }).unwrap_or_else(|it| panic!("{it}"))
}

/// What becomes of a file: its objectives and something that is said, or the mistake.
#[track_caller]
fn check_file(text: &str, expected: Result<(&[&str], &str), &str>) {
    match (import("f", text, &Settings { origin: None, ..settings() }), expected) {
        (Ok(read), Ok((objectives, said))) => {
            assert_eq!(in_words(&mission(&read)), objectives);
            assert!(notes(&read).contains(said), "expected `{said}`\n{}", notes(&read));
        }
        (Err(mistakes), Err(expected)) => {
            let told = mistakes.to_string();
            assert!(told.starts_with(&format!("f: {expected}")), "expected `{expected}`, got `{told}`");
        }
        (Ok(read), Err(expected)) => panic!("read, expected `{expected}`\n{}", read.text),
        (Err(mistakes), Ok(_)) => panic!("{mistakes}"),
    }
}

#[test]
fn plans_like_those_that_people_have() {
    check_file(
        LAND_START,
        Ok((
            &["(100, 0, 30)", "(0, 0, 0) ground"],
            "/mission/items/4: after the return of the plan, in a landing sequence",
        )),
    );
    let round = ["(100, 0, 30)", "(100, 100, 30)"];
    let flown: Vec<&str> = round.into_iter().cycle().take(8).chain(["(0, 0, 0) ground"]).collect();
    check_file(JUMP, Ok((&flown, "")));
    let vtol = ["(100, 0, 30)", "(200, 0, 30)", "(223, 197, 30)", "(100, 301, 30)", "(0, 0, 0) ground"];
    check_file(
        VTOL,
        Ok((&vtol, "/mission/items/2: a curve through its place has no counterpart: it is flown to straight")),
    );
    let high = ["(100, 0, 30)", "(100, 100, 0) ground"];
    check_file(LAND_HIGH, Ok((&high, "/mission/items/2: the altitude of a landing is not that of the ground")));
    check_file(SET_HOME, Err("/mission/items/1: MAV_CMD_DO_SET_HOME (179): a return would lead elsewhere"));
    check_file(VERSION_2, Err("/version: version 2 of a plan of QGroundControl, expected 1"));
    check_file(WPL, Ok((&["(111, 0, 30)", "(0, 0, 0) ground"], "line 3: the planner takes off by itself")));
}

#[test]
fn a_landing_here_after_a_survey_is_at_the_end_of_its_last_line() {
    let mission = mission(&read("s.plan", LAND_HERE));
    let [survey, land] = mission.objectives.as_slice() else { panic!("{mission:?}") };
    assert!(survey.position.horizontal_distance_m(land.position) < 0.01 && 55.0 < land.position.north_m, "{mission:?}");
    assert!(!land.flying && land.position.height_m() == 0.0);
    assert_eq!(survey.terms.actions, ["MAV_CMD_DO_SET_CAM_TRIGG_DIST 25 0 1"]);
}

#[test]
fn a_fence_of_before_there_were_several_is_kept() {
    // Its first place lies outside of the fence, so that no mission is written.
    check_file(OLD_FENCE, Err("/mission/items/1: `waypoint 1` lies outside of a fence to stay inside"));
    let wide = OLD_FENCE.replace("54.0005", "54.005");
    let read_wide = read("f.plan", &wide);
    assert!(read_wide.areas > 0 && notes(&read_wide).contains("/geoFence/polygon: a fence to stay inside"));
    assert!(notes(&read_wide).contains("/geoFence/breachReturn: the contingency table says what is flown"));
    let fence = "\"geoFence\": {";
    let circle = wide.replacen(fence, "\"geoFence\": {\"circle\": {\"center\": [54, 6.6], \"radius\": 900}, ", 1);
    assert!(notes(&read("f.plan", &circle)).contains("/geoFence/circle: a fence to stay inside"));
    let version = "\"geoFence\": {\"version\": ";
    check_file(
        &wide.replacen(&format!("{version}1"), &format!("{version}3"), 1),
        Err("/geoFence/version: version 3 of a fence of QGroundControl, expected 1 or 2"),
    );
}

/// A plan of these items: command, frame, parameters; numbered from 1.
fn plan(items: &[(i64, i64, &str)]) -> String {
    let item = |(index, (command, frame, params)): (usize, &(i64, i64, &str))| {
        format!(
            r#"{{"type": "SimpleItem", "command": {command}, "doJumpId": {}, "frame": {frame}, "params": [{params}]}}"#,
            index + 1
        )
    };
    let items: Vec<String> = items.iter().enumerate().map(item).collect();
    plan_of(&items.join(",\n"))
}

fn plan_of(items: &str) -> String {
    format!(
        r#"{{"fileType": "Plan", "version": 1, "mission": {{"version": 2, "plannedHomePosition": [54, 6.6, 20], "items": [
        {items}]}}}}"#
    )
}

#[track_caller]
fn check(items: &[(i64, i64, &str)], expected: Result<(&[&str], &str), &str>) {
    check_file(&plan(items), expected);
}

/// 111 m and 223 m north of the take-off point.
const NEAR: (i64, i64, &str) = (16, 3, "0, 0, 0, null, 54.001, 6.6, 30");
const FAR: (i64, i64, &str) = (16, 3, "0, 0, 0, null, 54.002, 6.6, 30");
const RETURN: (i64, i64, &str) = (20, 2, "0, 0, 0, 0, 0, 0, 0");
const LAND: (i64, i64, &str) = (21, 3, "0, 0, 0, 0, 54.002, 6.6, 0");
const TAKEOFF: (i64, i64, &str) = (22, 3, "0, 0, 0, 0, 54, 6.6, 20");
const MARK: (i64, i64, &str) = (189, 2, "0, 0, 0, 0, 0, 0, 0");
const TRIGGER: (i64, i64, &str) = (206, 2, "25, 0, 1, 0, 0, 0, 0");

#[test]
fn nothing_is_flown_after_a_return() {
    let home = "(0, 0, 0) ground";
    check(
        &[NEAR, RETURN, FAR],
        Err("/mission/items/2: it comes after the return of the plan, where an autopilot flies nothing"),
    );
    check(
        &[NEAR, RETURN, TRIGGER],
        Ok((&["(111, 0, 30)", home], "/mission/items/2: it comes after the return of the plan")),
    );
    check(&[NEAR, RETURN, MARK, FAR, LAND], Ok((&["(111, 0, 30)", home], "/mission/items/4: after the return")));
    check(&[NEAR, RETURN, MARK, LAND, FAR], Err("/mission/items/4: it comes after the return"));
    // In the order of the plan the mark does nothing.
    check(
        &[NEAR, MARK, FAR, LAND],
        Ok((&["(111, 0, 30)", "(223, 0, 30)", "(223, 0, 0) ground"], "/mission/items/1: the mark")),
    );
    check(
        &[NEAR, LAND, MARK, FAR, LAND],
        Ok((&["(111, 0, 30)", "(223, 0, 0) ground"], "/mission/items/3: after the landing")),
    );
    let both = ["(111, 0, 30)", "(223, 0, 0) ground", "(223, 0, 30)", home];
    check(
        &[TAKEOFF, NEAR, LAND, TAKEOFF, FAR, RETURN],
        Ok((&both, "/mission/items/3: the planner takes off by itself")),
    );
    check(&[NEAR, LAND, FAR, RETURN], Ok((&both, "/mission/items/2: no takeoff stands between")));
    // To stay for ever is an end too.
    let ever = (17, 3, "0, 0, 0, 0, 54.001, 6.6, 30");
    check(&[ever], Ok((&["(111, 0, 30)"], "/mission/items/0: it would stay there for ever")));
    check(&[ever, FAR], Err("/mission/items/1: it comes after the stay without an end"));
}

#[test]
fn jumps_are_made_as_often_as_they_say() {
    let (near, far, home) = ("(111, 0, 30)", "(223, 0, 30)", "(0, 0, 0) ground");
    let jump = |params| (177, 2, params);
    check(&[NEAR, jump("1, 2, 0, 0, 0, 0, 0"), RETURN], Ok((&[near, near, near, home], "")));
    // A jump inside of a loop is made in the first round only.
    let nested = [NEAR, FAR, jump("2, 1, 0, 0, 0, 0, 0"), jump("1, 1, 0, 0, 0, 0, 0"), RETURN];
    check(&nested, Ok((&[near, far, far, near, far, home], "")));
    let forwards = [NEAR, jump("4, 1, 0, 0, 0, 0, 0"), FAR, RETURN];
    check(&forwards, Ok((&[near, home], "/mission/items/2: a jump always leads past it: never flown")));
    // Each round does again what it does at the places.
    let (dropped, release) = ("(111, 0, 30) drop [DO_SET_CAM_TRIGG_DIST 25 0 1]", (211, 2, "1, 0, 0, 0, 0, 0, 0"));
    check(&[NEAR, release, TRIGGER, jump("1, 1, 0, 0, 0, 0, 0")], Ok((&[dropped, dropped], "")));
    check(&[NEAR, jump("1, 0, 0, 0, 0, 0, 0")], Ok((&[near], "a jump that is made 0 times")));
    check(&[NEAR, jump("1, -1, 0, 0, 0, 0, 0")], Err("/mission/items/1: MAV_CMD_DO_JUMP (177): it repeats for ever"));
    check(&[NEAR, jump("7, 1, 0, 0, 0, 0, 0")], Err("/mission/items/1: a jump to item 7, and there is none"));
    check(&[NEAR, jump("1, 501, 0, 0, 0, 0, 0")], Err("/mission/items/1: MAV_CMD_DO_JUMP (177): it repeats 501 times"));
    check(
        &[NEAR, FAR, jump("1, 300, 0, 0, 0, 0, 0")],
        Err("/mission/items: the plan makes 602 objectives, at most 500 are allowed"),
    );
    let spin: Vec<_> = std::iter::once(NEAR).chain(std::iter::repeat_n(jump("2, 500, 0, 0, 0, 0, 0"), 700)).collect();
    check(&spin, Err("/mission/items/"));
}

#[test]
fn a_place_of_0_0_is_here() {
    let here =
        |command, height| (command, 3, if height { "0, 0, 0, null, 0, 0, 30" } else { "0, 0, 0, null, null, null, 0" });
    check(&[here(16, true)], Ok((&["(0, 0, 30)"], "")));
    check(&[FAR, here(19, true), here(21, false)], Ok((&["(223, 0, 30)", "(223, 0, 30)", "(223, 0, 0) ground"], "")));
    check(
        &[FAR, (16, 3, "0, 0, 0, 0, 54.1, null, 30")],
        Err("/mission/items/1: a place with a latitude or a longitude alone"),
    );
}

#[test]
fn commands_are_flown_kept_or_refused_by_name() {
    let near = "(111, 0, 30)";
    let at = "0, 0, 0, 0, 54.001, 6.6, 30";
    check(&[(31, 3, at)], Ok((&[near], "to circle until a height is reached")));
    check(&[(18, 3, "3, 0, 20, 0, 54.001, 6.6, 30")], Ok((&[near], "turns round a place")));
    check(&[(19, 3, "12, 0, 20, 0, 54.001, 6.6, 30")], Ok((&["(111, 0, 30) 12 s"], "")));
    check(&[NEAR, (93, 2, "9, -1, -1, -1, 0, 0, 0")], Ok((&["(111, 0, 30) 9 s"], "")));
    check(
        &[NEAR, (93, 2, "-1, 8, 0, 0, 0, 0, 0")],
        Err("/mission/items/1: MAV_CMD_NAV_DELAY (93): it waits for a time of day"),
    );
    check(&[(93, 2, "9, -1, -1, -1, 0, 0, 0"), NEAR], Err("/mission/items/0: a delay before the first place"));
    check(
        &[NEAR, (93, 2, "90000, 0, 0, 0, 0, 0, 0")],
        Err("/mission/items/0: a stay of 90000 s, expected at most 86400 s"),
    );
    check(&[(16, 3, "0, 0, 5, 90, 54.001, 6.6, 30")], Ok((&[near], "/mission/items/0: which way to face")));
    check(&[(84, 3, "0, 0, 0, 0, 54.001, 6.6, 30"), FAR], Ok((&[near, "(223, 0, 30)"], "it takes off like one")));
    check(
        &[(22, 3, "0, 0, 0, 0, 54.001, 6.6, 30"), FAR],
        Ok((&["(223, 0, 30)"], "the place of a takeoff is not flown to")),
    );
    check(&[(179, 0, "0, 0, 0, 0, 54, 6.6, 20"), NEAR], Ok((&[near], "the home that it sets is the planned one")));
    check(&[NEAR, (207, 2, "1, 0, 0, 0, 0, 0, 0")], Ok((&[near], "a fence is on from the beginning")));
    check(
        &[NEAR, (207, 2, "0, 0, 0, 0, 0, 0, 0")],
        Err("/mission/items/1: MAV_CMD_DO_FENCE_ENABLE (207): it switches off"),
    );
    for refused in
        [23, 25, 30, 32, 33, 34, 35, 36, 83, 92, 113, 176, 180, 185, 190, 192, 208, 222, 224, 601, 4501, 5001]
    {
        let told = import("f", &plan(&[NEAR, (refused, 3, at)]), &settings()).unwrap_err().to_string();
        assert!(
            told.starts_with("f: /mission/items/1: MAV_CMD_") && told.contains(&format!(" ({refused}): ")),
            "{told}"
        );
    }
    check(&[NEAR, (90, 2, "0, 0, 0, 0, 0, 0, 0")], Err("/mission/items/1: command 90 is not known"));
    check(&[NEAR, (777, 3, at)], Err("/mission/items/1: command 777 is not known, and may fly"));
    check(
        &[NEAR, (777, 2, "1, 0, 0, 0, 0, 0, 0")],
        Ok((&[near], "/mission/items/1: command 777 is not known, and has no place")),
    );
    // What concerns the payload belongs to the place before it, and before the first place to that.
    let roi = (195, 0, "0, 0, 0, 0, 54.001, 6.6, 20.5");
    let speed = (178, 2, "1, 7.5, -1, 0, 0, 0, 0");
    let kept = "kept, not flown yet: a command to camera, gimbal, speed or other payload\n";
    let with = "(111, 0, 30) [DO_CHANGE_SPEED 1 7.5 -1] [DO_SET_ROI_LOCATION 0 0 0 0 54.001 6.6 20.5 frame=0]";
    check(&[speed, NEAR, roi, FAR], Ok((&[with, "(223, 0, 30)"], &format!("/mission/items/2: {kept}"))));
    check(
        &[NEAR, (205, 2, "null, 0, 0, 0, 0, 0, 2")],
        Ok((&["(111, 0, 30) [DO_MOUNT_CONTROL nan 0 0 0 0 0 2]"], kept)),
    );
    let many = vec![TRIGGER; 2_001];
    let many: Vec<_> = std::iter::once(NEAR).chain(many).collect();
    check(&many, Err("/mission/items: the plan makes 2001 actions, at most 2000 are allowed"));
}

#[test]
fn a_height_is_above_what_the_frame_says() {
    let at = |frame| (16, frame, "0, 0, 0, 0, 54.001, 6.6, 40");
    check(&[at(3), at(6)], Ok((&["(111, 0, 40)"; 2], "")));
    // The take-off point is 20 m above sea level.
    check(&[at(0), at(5)], Ok((&["(111, 0, 20)"; 2], "")));
    for ground in [10, 11] {
        check(&[at(ground)], Err("/mission/items/0: its height is above the ground, which is not known there"));
    }
    check(&[at(2)], Err("/mission/items/0: frame 2, expected 0 (above sea level), 3"));
    check(&[(16, 3, "0, 0, 0, 0, 54.001, 6.6, 0")], Err("/mission/items/0: its altitude is 0: on ArduPilot"));
    check(&[(16, 0, "0, 0, 0, 0, 54.001, 6.6, null")], Err("/mission/items/0: its altitude is not given"));
    let moded = |mode: i64| plan(&[at(3)]).replacen("\"frame\"", &format!("\"AltitudeMode\": {mode}, \"frame\""), 1);
    check_file(&moded(1), Ok((&["(111, 0, 40)"], "")));
    check_file(&moded(4), Err("/mission/items/0/AltitudeMode: altitude mode 4 does not fit frame 3"));
}

#[test]
fn patterns_are_read_as_their_items_or_refused_by_name() {
    let pattern = |kind: &str, rest: &str| {
        plan_of(&format!(r#"{{"type": "ComplexItem", "complexItemType": "{kind}", "version": 2, {rest}}}"#))
    };
    let item = r#"{"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 54.001, 6.6, 40]}"#;
    let corridor =
        |items: &str| pattern("CorridorScan", &format!(r#""TransectStyleComplexItem": {{"Items": [{items}]}}"#));
    check_file(&corridor(item), Ok((&["(111, 0, 40)"], "a pattern is read as its items")));
    check_file(&corridor(""), Err("/mission/items/0: a pattern without its items"));
    check_file(
        &pattern("survey", r#""polygon": []"#),
        Err(
            "/mission/items/0: a pattern without its items, not read as a survey, since its polygon or its camera is missing",
        ),
    );
    check_file(
        &pattern("StructureScan", r#""polygon": []"#),
        Err("/mission/items/0: a pattern `StructureScan`, whose places"),
    );
    let landing = r#""landingApproachCoordinate": [54.001, 6.6, 40], "landCoordinate": [54, 6.6, 0], "loiterRadius": 75,
        "loiterClockwise": true, "altitudesAreRelative": true, "stopTakingPhotos": true, "useLoiterToAlt": false"#;
    for kind in ["fwLandingPattern", "vtolLandingPattern"] {
        check_file(
            &pattern(kind, landing),
            Ok((&["(111, 0, 40) [DO_SET_CAM_TRIGG_DIST] [IMAGE_STOP_CAPTURE]", "(0, 0, 0) ground"], "")),
        );
    }
    let old = landing
        .replace("landingApproachCoordinate", "loiterCoordinate")
        .replace("altitudesAreRelative", "loiterAltitudeRelative");
    check_file(
        &pattern("fwLandingPattern", &old.replace("true, \"stopT", "false, \"stopT")),
        Ok((&["(111, 0, 20) [DO_SET_CAM_TRIGG_DIST] [IMAGE_STOP_CAPTURE]", "(0, 0, 0) ground"], "")),
    );
    check_file(
        &pattern("fwLandingPattern", landing).replace("rn\", \"version\": 2", "rn\", \"version\": 5"),
        Err("/mission/items/0/version: version 5 of a landing pattern"),
    );
}

#[test]
fn older_files_of_qgroundcontrol_are_read() {
    let item = r#"{"type": "missionItem", "id": 1, "command": 16, "frame": 3, "autoContinue": true, "param1": 4, "param2": 0,
        "param3": 0, "param4": 0, "coordinate": [54.001, 6.6, 30]}"#;
    let old = format!(
        r#"{{"MAV_AUTOPILOT": 3, "complexItems": [], "groundStation": "QGroundControl", "version": "1.0", "items": [{item}],
        "plannedHomePosition": {{"id": 0, "type": "missionItem", "command": 16, "frame": 0, "coordinate": [54, 6.6, 20]}}}}"#
    );
    check_file(&old, Ok((&["(111, 0, 30) 4 s"], "")));
    check_file(
        &old.replace("\"complexItems\": []", "\"complexItems\": [{}]"),
        Err("/complexItems/0: a pattern of version 1"),
    );
    check_file(
        &old.replace("1.0", "3.0"),
        Err("/version: version \"3.0\" of a mission of QGroundControl, expected 1 or 2"),
    );
    let second = old.replace("\"1.0\"", "2, \"fileType\": \"Mission\"");
    check_file(&second, Ok((&["(111, 0, 30) 4 s"], "")));
    check_file(&old.replace("Continue\": true", "Continue\": false"), Err("/items/0: `autoContinue` is off"));
    check_file(&old.replace("\"param3\": 0,", ""), Err("/items/0: `param3` is missing"));
    check_file(&plan(&[NEAR]).replace("null, 54.001", "54.001"), Err("/mission/items/0: 6 parameters, expected 7"));
}

#[test]
fn lines_of_wpl_are_read_by_the_same_rules() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: Result<(&[&str], &str), &str>) {
        assert!(WPL.contains(find), "{find}");
        check_file(&WPL.replacen(find, replace, 1), expected);
    }
    let flown = ["(111, 0, 30)", "(0, 0, 0) ground"];
    check("\t", "  ", Ok((&flown, "")));
    check("54.001", "94", Err("line 4: latitude 94"));
    check("110", "120", Err("line 1: QGC WPL 120, expected QGC WPL 110"));
    check("\t1\t0\t16", "\t1\t0\t22", Err("line 2: command 22, expected 16: the first item is home"));
    check("54.0\t6.6\t20", "0\t0\t0", Err("the take-off point is not known"));
    check("54.001", "north", Err("line 4: found `north`, expected a number"));
    check("54.001\t", "", Err("line 4: 11 columns, expected 12"));
    check("3\t0\t3\t20\t0\t0", "3\t0\t3\t177\t2\t1", Ok((&["(111, 0, 30)"; 2], "")));
}

#[test]
fn a_person_may_leave_an_item_out() {
    #[track_caller]
    fn check(items: &[&str], expected: Result<&[&str], &str>) {
        let leave_out = LeaveOut::new(&items.iter().map(|it| (*it).to_owned()).collect::<Vec<_>>());
        let text = plan(&[NEAR, (34, 3, "0, 0, 0, 0, 54.001, 6.6, 30"), FAR]).replacen(
            "\"version\": 1",
            r#""geoFence": {"version": 2, "circles": [], "polygons": [{"version": 1, "inclusion": false,
                "polygon": [[54.01, 6.6], [54.02, 6.6], [54.02, 6.61]]}]}, "version": 1"#,
            1,
        );
        let area = r#"{"type": "Feature", "properties": {"kind": "keep-out", "name": "EDR7"}, "geometry": {"type": "Polygon",
            "coordinates": [[[6.61, 54.01], [6.62, 54.01], [6.62, 54.02], [6.61, 54.01]]]}}"#;
        let areas = |name: &str| formats::read_without(&source(name, area), &leave_out).unwrap();
        let read = formats::read_without(&source("f", &text), &leave_out)
            .and_then(|it| assemble(&it, &[areas("a"), areas("b")], &settings()));
        match (read, expected) {
            (Ok(read), Ok(names)) => {
                let mission = mission(&read);
                let found: Vec<_> = mission
                    .objectives
                    .iter()
                    .map(|it| &it.name)
                    .chain(mission.areas.iter().map(|it| &it.name))
                    .collect();
                assert_eq!(found, names);
                let said = read.notes.iter().filter(|it| it.weight == formats::Weight::LeftOut).count();
                assert_eq!(said, items.len(), "{}", notes(&read));
            }
            (read, expected) => {
                let told = read.map(|it| it.text).unwrap_err().to_string();
                assert!(told.contains(expected.unwrap_err()), "{told}");
            }
        }
    }
    let orbit = "/mission/items/1";
    check(&[], Err("help: correct it, or leave it out: --leave-out \"/mission/items/1\""));
    check(&[orbit], Ok(&["waypoint 1", "waypoint 2", "fence 1", "EDR7", "EDR7 2"]));
    // What could be read is left out as well.
    check(&[orbit, "/mission/items/2"], Ok(&["waypoint 1", "fence 1", "EDR7", "EDR7 2"]));
    check(&[orbit, "/geoFence/polygons/0", "b: EDR7"], Ok(&["waypoint 1", "waypoint 2", "EDR7"]));
    check(
        &[orbit, "EDR7"],
        Err("b: --leave-out EDR7: it is in a as well\n  help: say which one: --leave-out \"b:EDR7\""),
    );
    check(&[orbit, "/mission/items/22"], Err("f: --leave-out /mission/items/22: there is no such item"));
}
