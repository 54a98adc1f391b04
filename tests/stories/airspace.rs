//! A new edition of a data set, from the file to the mission that is flown.

use std::path::PathBuf;
use std::process::Output;

use serde_json::{Value, json};

use crate::support::{System, kittiwake, wait_for};

/// A mission with an area of its own, and two kilometres of flight.
const MISSION: &str = "\
# By hand.
name = \"far\"

[origin]
latitude_deg = 54.0
longitude_deg = 6.6
altitude_m = 20.0

[[objective]]
name = \"there\"
north_m = 0.0
east_m = 2000.0
height_m = 20.0
flying = true

# The pier.
[[area]]
name = \"pier\"
kind = \"keep-out\"
corners_m = [[200.0, 100.0], [300.0, 100.0], [300.0, 200.0]]
";

/// A folder with the files of the story.
struct Desk(tempfile::TempDir);

impl Desk {
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.path(name), text).expect("the file can be written");
        self.text_of_path(name)
    }

    fn text_of_path(&self, name: &str) -> String {
        self.path(name).to_str().expect("a readable path").to_owned()
    }

    /// An edition with square zones, each with its name and its degrees east of the take-off point.
    fn edition(&self, name: &str, issued: &str, zones: &[(&str, f64)]) -> String {
        let zone = |&(name, east): &(&str, f64)| {
            let (west, east) = (6.6 + east, 6.602 + east);
            let ring = [[west, 53.999], [east, 53.999], [east, 54.001], [west, 54.001], [west, 53.999]];
            let projection = json!({ "type": "Polygon", "coordinates": [ring] });
            json!({ "identifier": name, "country": "XXX", "name": name, "type": "COMMON", "restriction": "PROHIBITED",
                "applicability": [{ "permanent": "YES" }],
                "geometry": [{ "uomDimensions": "M", "lowerLimit": 0, "lowerVerticalReference": "AGL",
                    "upperLimit": 500, "upperVerticalReference": "AMSL", "horizontalProjection": projection }] })
        };
        let zones: Vec<Value> = zones.iter().map(zone).collect();
        self.write(name, &json!({ "title": "Zones", "createdAt": issued, "features": zones }).to_string())
    }
}

#[track_caller]
fn expect(output: &Output, code: i32, parts: &[&str]) -> String {
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{said}");
    for part in parts {
        assert!(said.contains(part), "`{part}` is missing: {said}");
    }
    said
}

#[test]
fn a_new_edition_is_checked_compared_tried_out_and_adopted_in_flight() {
    let desk = Desk(tempfile::tempdir().expect("a temporary folder can be made"));
    let mission = desk.write("far.toml", MISSION);
    let first = desk.edition("zones.json", "2026-05-01T00:00:00Z", &[("DEPOT", 0.1)]);
    let second = desk.edition("zones-2.json", "2026-06-01T00:00:00Z", &[("DEPOT", 0.1), ("RANGE", 0.2)]);
    // The objective is at 2,000 m, 0.0305 degrees to the east.
    let closing = desk.edition("zones-3.json", "2026-07-01T00:00:00Z", &[("DEPOT", 0.1), ("THERE", 0.0295)]);
    expect(&kittiwake(&["airspace", "check", &first, "--strict"]), 0, &["zones: 1 (1 keep-out)", "issued 2026-05-01"]);
    let picture = desk.text_of_path("diff.html");
    let differs = ["closed: keep-out `RANGE`", "closed: 1, opened: 0, changed: 0, unchanged: 1"];
    expect(&kittiwake(&["airspace", "diff", &first, &second, "--html", &picture]), 0, &differs);
    assert!(std::fs::read_to_string(&picture).expect("a page").contains("<path class=\"closed\""));
    let flown = desk.text_of_path("flown.toml");
    expect(&kittiwake(&["airspace", "import", &mission, &first, "--out", &flown]), 0, &["own areas: 1, from feeds: 1"]);
    assert!(std::fs::read_to_string(&flown).expect("a mission").starts_with(MISSION), "what a human wrote stays");

    let system = System::start(&["--mission", &flown, "--speed", "2"]);
    system.wait_for(": fly to (0, 2000, 20)");
    let pid = system.pid().to_string();
    let adopt = |file: &str, more: &[&str]| kittiwake(&[&["airspace", "adopt", file, "--pid", &pid], more].concat());
    let feeds = || {
        let shown = kittiwake(&["mission", "show", "--json", "--pid", &pid]);
        let shown: Value = serde_json::from_slice(&shown.stdout).expect("the mission as a document");
        (shown["feeds"][0]["name"].clone(), shown["objectives"][0]["state"].clone())
    };
    let waiting = Value::from("OBJECTIVE_STATE_WAITING");
    let tried = ["closed: keep-out `RANGE`", "would be adopted", "there: ", "nothing was changed: --dry-run"];
    wait_for("the gateway", || (kittiwake(&["mission", "show", "--pid", &pid]).status.success()).then_some(()));
    expect(&adopt(&second, &["--dry-run"]), 0, &tried);
    let refused = "objective `there` lies in keep-out area `THERE`";
    expect(&adopt(&closing, &[]), 3, &["closed: keep-out `THERE`", refused]);
    assert_eq!(feeds(), ("zones.json".into(), waiting.clone()), "a refusal leaves the old one");
    expect(&adopt(&second, &[]), 0, &["new airspace adopted; feed `zones-2.json`", "in place of feed `zones.json`"]);
    assert_eq!(feeds(), ("zones-2.json".into(), waiting));
    let audit = system.http().json("/api/v1/audit");
    let records = audit["records"].as_array().expect("records");
    let adopted = records.iter().find(|it| it["what"] == "mission/airspace" && it["status"] == 200).expect("a record");
    let outcome = adopted["outcome"].as_str().expect("an outcome");
    assert!(outcome.contains("issued 2026-06-01") && outcome.contains("issued 2026-05-01"), "{outcome}");
}

#[test]
fn a_feed_that_was_forgotten_does_not_vanish() {
    let desk = Desk(tempfile::tempdir().expect("a temporary folder can be made"));
    let mission = desk.write("far.toml", MISSION);
    let zones = desk.edition("zones.json", "2026-05-01T00:00:00Z", &[("DEPOT", 0.1)]);
    let crane = desk.write(
        "crane.kml",
        "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Placemark><name>crane</name><Polygon><outerBoundaryIs><LinearRing>\
         <coordinates>6.65,54.01 6.66,54.01 6.66,54.02 6.65,54.01</coordinates></LinearRing></outerBoundaryIs></Polygon>\
         </Placemark></kml>",
    );
    let (both, one) = (desk.text_of_path("both.toml"), desk.text_of_path("one.toml"));
    let import = |args: &[&str]| kittiwake(&[&["airspace", "import"], args].concat());
    expect(&import(&[&mission, &zones, &crane, "--out", &both]), 0, &["own areas: 1, from feeds: 2"]);
    let told = ["the 1 areas of feed `crane.kml` would vanish", "--drop \"crane.kml\""];
    expect(&import(&[&both, &zones, "--out", &one]), 2, &told);
    let dropped = ["opened: keep-out `crane`", "own areas: 1, from feeds: 1"];
    expect(&import(&[&both, &zones, "--drop", "crane.kml", "--out", &one]), 0, &dropped);
    let printed = ["airspace: feed `zones.json` of Zones, issued 2026-05-01T00:00:00Z: 1 areas"];
    expect(&kittiwake(&["plan", &one]), 0, &printed);
}

#[test]
fn a_data_set_that_nobody_should_use_is_refused() {
    #[track_caller]
    fn check(text: &str, strict: bool, code: i32, part: &str) {
        let desk = Desk(tempfile::tempdir().expect("a temporary folder can be made"));
        let file = desk.write("z.json", text);
        let strict: &[&str] = if strict { &["--strict"] } else { &[] };
        expect(&kittiwake(&[&["airspace", "check", &file], strict].concat()), code, &[part]);
    }
    let good = {
        let desk = Desk(tempfile::tempdir().expect("a temporary folder can be made"));
        let file = desk.edition("z.json", "2026-05-01T00:00:00Z", &[("DEPOT", 0.1), ("RANGE", 0.2)]);
        std::fs::read_to_string(file).expect("the file is there")
    };
    let unknown = good.replace("PROHIBITED", "BANNED");
    check(&unknown, false, 0, "2 x restriction: found ..");
    check(&unknown, true, 2, "--strict: not understood: 2");
    let over = good.replacen('{', "{\"metadata\": {\"validTo\": \"2020-01-01T00:00:00Z\"}, ", 1);
    check(&over, false, 0, "WARNING: feed `z.json` is OUT OF DATE");
    check(&over, true, 2, "--strict: feed `z.json` is OUT OF DATE");
    check("{\"features\": [], \"title\": \"Zones\"}", false, 2, "no zone was found");
    check(&good.replacen("\"Polygon\"", "\"Sphere\"", 1), false, 2, "1 zones have no shape that can be read");
    check("{", false, 2, "z.json");
}
