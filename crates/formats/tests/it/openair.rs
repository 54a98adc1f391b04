//! Airspace as text in OpenAir.

use super::{check_areas, check_refused, mission, settings, source};
use domain::geodesy::{LatLon, LocalFrame};
use formats::assemble::assemble;

const SQUARE: &str = "DP 54:00:14.4 N 006:36:21.6 E\nDP 54:00:14.4 N 006:36:32.4 E\nDP 54:00:21.6 N 006:36:32.4 E\nDP 54:00:21.6 N 006:36:21.6 E\n";

fn zone(class: &str, lower: &str, upper: &str) -> String {
    format!("* made by hand\n\nAC {class}\nAN Harbour\nAL {lower}\nAH {upper}\n{SQUARE}")
}

#[test]
fn a_class_says_what_a_drone_needs() {
    #[track_caller]
    fn check(class: &str, expected: &str, said: &[&str]) {
        let area = format!("Harbour: {expected}, 4 corners, None to Some(589.6), (None, None)");
        check_areas(zone(class, "GND", "2000ft MSL").as_bytes(), &[&area], said);
    }
    check("P", "keep-out", &[]);
    for class in ["R", "Q", "A", "B", "C", "D", "CTR", "TMZ", "RMZ", "ZRT"] {
        check(class, "permission", &[]);
    }
    check("XYZ", "keep-out", &["NOT UNDERSTOOD: the class `XYZ` is not known"]);
    // In the second edition the class stands beside a type: the stricter one counts.
    check("UNC\nAY R", "permission", &[]);
    check("E\nAY P", "keep-out", &[]);
    check("P\nAY NONE", "keep-out", &[]);
    for class in ["E", "G", "W", "GP", "UNC"] {
        let two = format!("{}{}", zone(class, "GND", "2000ft MSL"), zone("P", "GND", "2000ft MSL"));
        let area = "Harbour: keep-out, 4 corners, None to Some(589.6), (None, None)";
        check_areas(two.as_bytes(), &[area], &["line 3: its class asks nothing of a drone: left out"]);
    }
}

#[test]
fn heights_are_read_as_they_are_written() {
    #[track_caller]
    fn check(lower: &str, upper: &str, expected: &str, said: &[&str]) {
        let area = format!("Harbour: keep-out, 4 corners, {expected}, (None, None)");
        check_areas(zone("P", lower, upper).as_bytes(), &[&area], said);
    }
    check("SFC", "UNL", "None to None", &[]);
    check("0 AGL", "unlimited", "None to None", &[]);
    check("500 ft AMSL", "1000FT MSL", "Some(132.4) to Some(284.8)", &[]);
    check("500", "1000F MSL", "Some(132.4) to Some(284.8)", &[]);
    check("152.4m MSL", "304.8 M AMSL", "Some(132.4) to Some(284.8)", &[]);
    check("500MSL", "1000ftAMSL", "Some(132.4) to Some(284.8)", &[]);
    check("FL100", "FL 195", "Some(2123.2) to Some(6917.96)", &[]);
    check("GND", "500ft AGL", "None to None", &["its upper limit is above the ground"]);
    check("GND", "BY NOTAM", "None to None", &["NOT UNDERSTOOD: found `BY NOTAM`, expected a height"]);
    check("UNL", "1000 MSL", "None to Some(284.8)", &["line 5: NOT UNDERSTOOD: a lower limit without a height"]);
    check("GND", "GND", "None to None", &["line 6: NOT UNDERSTOOD: an upper limit at the ground"]);
    let without = zone("P", "GND", "UNL").replace("AH UNL\n", "");
    let area = "Harbour: keep-out, 4 corners, None to None, (None, None)";
    check_areas(without.as_bytes(), &[area], &["NOT UNDERSTOOD: it has no upper limit (AH)"]);
}

#[test]
fn places_are_read_as_they_are_written() {
    #[track_caller]
    fn check(place: &str, expected: Result<(), &str>) {
        let text = zone("P", "GND", "UNL").replacen("DP 54:00:14.4 N 006:36:21.6 E", &format!("DP {place}"), 1);
        match expected {
            Ok(()) => check_areas(text.as_bytes(), &["Harbour: keep-out, 4 corners, None to None, (None, None)"], &[]),
            Err(expected) => check_refused(text.as_bytes(), &format!("areas: line 7: {expected}")),
        }
    }
    for good in ["54:00.24N 006:36.36E", "54.004 N 6.606 E", "54:00:14n 6:36:21e * a comment"] {
        check(good, Ok(()));
    }
    for bad in ["54:60:00 N 006:36:00 E", "54:00:00 N", "540003N 0063600E", "N 54 E 6", "-54 N 6 E", ""] {
        check(bad, Err(""));
    }
    check("54:00:14 N 006-36 E", Err("found `54:00:14 N 006-36 E`, expected a place like 54:00:03 N 006:36:00 E"));
}

/// Whether places, by latitude and longitude, lie in the only area of a file.
#[track_caller]
fn check_inside(text: &str, places: &[(f64, f64, bool)]) {
    let read = formats::read(&source("a.txt", text)).unwrap();
    let empty = formats::read(&source("m", r#"{"type": "FeatureCollection", "features": []}"#)).unwrap();
    let areas = mission(&assemble(&empty, &[read], &settings()).unwrap()).areas;
    let frame = LocalFrame::at(LatLon::new(54.0, 6.6).unwrap());
    for (latitude, longitude, expected) in places {
        let at = frame.local(LatLon::new(*latitude, *longitude).unwrap());
        assert_eq!(areas.iter().any(|it| it.contains(at)), *expected, "{latitude} {longitude}");
    }
}

#[test]
fn circles_and_arcs_are_read() {
    let head = "AC R\nAN a\nAL GND\nAH UNL\n";
    // A nautical mile is a minute of latitude, and 0.0283 degrees of longitude there.
    let centre = "V X=54:06:00 N 006:36:00 E\n";
    let circle = format!("{head}{centre}DC 1\n");
    check_inside(&circle, &[(54.1, 6.6, true), (54.1166, 6.6, true), (54.1170, 6.6, false), (54.0834, 6.6, true)]);
    // The eastern half, clockwise and counterclockwise.
    let half = [(54.1, 6.625, true), (54.1, 6.575, false), (54.11, 6.61, true), (54.11, 6.59, false)];
    check_inside(&format!("{head}{centre}DA 1,0,180\n"), &half);
    check_inside(&format!("{head}{centre}V D=-\nDA 1,180,0\n"), &half);
    let [north, south] = ["54:07:00 N 006:36:00 E", "54:05:00 N 006:36:00 E"];
    check_inside(&format!("{head}{centre}V D=+\nDB {north}, {south}\n"), &half);
    check_inside(&format!("{head}{centre}V D=-\nDB {south},{north}\n"), &half);
    // The direction and the centre end with their zone.
    let two = format!("{head}{centre}V D=-\nDA 1,180,0\nAC R\nAN b\nAL GND\nAH UNL\nDA 1,0,180\n");
    check_refused(two.as_bytes(), "areas: line 12: no centre (V X=) before it");
    check_refused(format!("{head}{centre}DA 1,0\n").as_bytes(), "line 6: expected a radius and two angles");
    check_refused(format!("{head}{centre}DC far\n").as_bytes(), "line 6: found `far`, expected nautical miles");
    check_refused(format!("{head}{centre}DC 0\n").as_bytes(), "line 6: a circle with a radius of 0 m");
    check_refused(format!("{head}DY 54:00:00 N 006:36:00 E\n").as_bytes(), "line 5: the record `DY` is not known");
}

#[test]
fn a_line_that_cannot_be_read_costs_its_zone_only() {
    // Far away, so that the file is read.
    let far = "AC R\nAN far\nAL GND\nAH UNL\nDP 40:00:00 N 010:00:00 E\nDP nowhere\nDP 40:01:00 N 010:00:00 E\n";
    let text = format!("{far}{}", zone("R", "GND", "UNL"));
    let said = "line 6: its shape cannot be read (found `nowhere`";
    check_areas(text.as_bytes(), &["Harbour: permission, 4 corners, None to None, (None, None)"], &[said]);
}

#[test]
fn labels_and_terrain_are_listed_once() {
    let text = format!(
        "{}AT 54:00:14 N 006:36:21 E\nAF 123.450\nAF 119.000\nTO Hill\nDP 54:00:00 N 006:36:00 E\n",
        zone("R", "GND", "UNL")
    );
    let said = ["AF, 2 times: not read", "AT, 1 times: not read", "lines outside of a zone, 2 times: not read"];
    check_areas(text.as_bytes(), &["Harbour: permission, 4 corners, None to None, (None, None)"], &said);
}

#[test]
fn a_text_of_windows_is_read() {
    let text = [
        b"* k\xfcste\r\nAC R\r\nAN K\xfcste\r\nAL GND\r\nAH UNL\r\n".as_slice(),
        SQUARE.replace('\n', "\r\n").as_bytes(),
    ]
    .concat();
    check_areas(&text, &["Küste: permission, 4 corners, None to None, (None, None)"], &[]);
}
