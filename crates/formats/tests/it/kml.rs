//! KML as Google Earth and its users write it.

use super::{areas, check_areas, check_refused, settings};
use formats::assemble::Settings;

const SQUARE: &str = "6.606,54.004,90 6.609,54.004,90 6.609,54.006,90 6.606,54.006,90 6.606,54.004,90";
const NO_KIND: &str = "a placemark without `kind`";

fn ring(coordinates: &str) -> String {
    format!("<LinearRing><coordinates>{coordinates}</coordinates></LinearRing>")
}

fn polygon(inside: &str, coordinates: &str) -> String {
    format!("<Polygon>{inside}<outerBoundaryIs>{}</outerBoundaryIs></Polygon>", ring(coordinates))
}

fn kml(inside: &str) -> String {
    format!("<kml xmlns:gx='http://www.google.com/kml/ext/2.2'><Document>{inside}</Document></kml>")
}

/// A placemark named `a` of the kind permission, so that there is nothing to note.
fn placemark(inside: &str) -> String {
    kml(&format!(
        "<Placemark><name>a</name><ExtendedData><Data name='kind'><value>permission</value></Data></ExtendedData>{inside}</Placemark>"
    ))
}

#[test]
fn comments_and_cdata_divide_no_text() {
    let text = "<kml xmlns='http://www.opengis.net/kml/2.2'><Placemark><name>com<!-- x -->men<![CDATA[ted]]></name><Polygon><outerBoundaryIs>\
                <LinearRing><coordinates>6.6010,54.0010,0 6.6030,54.0010,0 6.6030,54.0030,0\n<!-- north side: surveyed 2024 -->\n\
                6.6050,54.0080,0 <![CDATA[6.6010,54.0080,0]]> 6.6010,54.0010,0</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>";
    check_areas(text.as_bytes(), &["commented: keep-out, 5 corners, None to None, (None, None)"], &[NO_KIND]);
}

#[test]
fn any_namespace_and_any_root_is_read() {
    #[track_caller]
    fn check(text: &str) {
        let (found, _) = areas(text.as_bytes(), &settings()).unwrap_or_else(|it| panic!("{it}"));
        assert_eq!(found, ["a: keep-out, 4 corners, None to None, (None, None)"]);
    }
    let placemark = format!("<Placemark><name>a</name><visibility>0</visibility>{}</Placemark>", polygon("", SQUARE));
    for namespace in
        ["http://earth.google.com/kml/2.0", "http://earth.google.com/kml/2.1", "http://www.opengis.net/kml/2.2", ""]
    {
        check(&format!(
            "<kml xmlns='{namespace}'><Style id='s'><PolyStyle/></Style><Folder>{placemark}</Folder></kml>"
        ));
    }
    check(&format!(
        "<k:kml xmlns:k='http://www.opengis.net/kml/2.2'>{}</k:kml>",
        placemark
            .replace("</", "</k:")
            .replace("<P", "<k:P")
            .replace("<n", "<k:n")
            .replace("<v", "<k:v")
            .replace("<o", "<k:o")
            .replace("<L", "<k:L")
            .replace("<c", "<k:c")
    ));
    check(&placemark);
}

#[test]
fn coordinates_are_read_however_they_are_spaced() {
    #[track_caller]
    fn check(coordinates: &str, corners: usize) {
        let text = placemark(&polygon("", coordinates));
        check_areas(text.as_bytes(), &[&format!("a: permission, {corners} corners, None to None, (None, None)")], &[]);
    }
    check("\n\t6.606,54.004\n\t6.609,54.004\n\t6.609,54.006\n6.606,54.004\n", 3);
    check("6.606, 54.004, 0 6.609 ,54.004 , 0 6.609,54.006,0 6.606,54.004,0", 3);
    check("6.606,54.004,0,7 6.609,54.004,0,7 6.609,54.006,0,7 6.606,54.004,0,7", 3);
    #[track_caller]
    fn wrong(coordinates: &str, expected: &str) {
        check_refused(placemark(&polygon("", coordinates)).as_bytes(), expected);
    }
    // Two places with a comma between them are not one with four numbers.
    wrong("6.606,54.004, 6.609,54.004, 6.609,54.006, 6.606,54.004", "found `6.606,54.004, 6.609,54.004,");
    wrong("6.606,54.004\n6.609;54.004\n6.609,54.006", "areas: line 2 column 1: found `6.609;54.004`, expected a place");
    wrong("6.606,94.004 6.609,54.004 6.609,54.006", "latitude 94.004");
    wrong("6.606 54.004 6.609 54.004", "found `6.606`, expected a place");
    wrong("", "a ring of 0 different corners");
    check_refused(placemark("<Polygon/>").as_bytes(), "a polygon without an outer border");
}

#[test]
fn a_zone_that_cannot_be_read_and_lies_far_away_is_left_out() {
    let far = polygon("", "16.6,54 16.7,54 16.7,55,x");
    let text = placemark(&format!("<MultiGeometry>{}{far}</MultiGeometry>", polygon("", SQUARE)));
    let area = "a: permission, 4 corners, None to None, (None, None)";
    check_areas(text.as_bytes(), &[area], &["its shape cannot be read (found `16.7,55,x`"]);
}

#[test]
fn a_polygon_counts_wherever_it_stands() {
    let inner = format!("<MultiGeometry><MultiGeometry>{}</MultiGeometry></MultiGeometry>", polygon("", SQUARE));
    let two = [
        "a: permission, 4 corners, None to None, (None, None)",
        "a 2: permission, 4 corners, None to None, (None, None)",
    ];
    check_areas(placemark(&format!("{inner}{}", polygon("", SQUARE))).as_bytes(), &two, &[]);
    let bare = kml(&polygon("", SQUARE));
    check_areas(bare.as_bytes(), &["placemark: keep-out, 4 corners, None to None, (None, None)"], &[]);
    // A closed ring is drawn where an area is meant; an open one is a line.
    check_areas(placemark(&ring(SQUARE)).as_bytes(), &two[..1], &["a LinearRing is a line; as it is closed"]);
    check_refused(
        placemark(&ring("6.606,54.004 6.609,54.004 6.609,54.006")).as_bytes(),
        "no area was found in this file (KML)",
    );
    // Nested deeper than any program draws.
    let deep = kml(&format!("{}{}{}", "<Folder>".repeat(50_000), polygon("", SQUARE), "</Folder>".repeat(50_000)));
    check_areas(deep.as_bytes(), &["placemark: keep-out, 4 corners, None to None, (None, None)"], &[]);
}

#[test]
fn a_point_with_a_radius_is_a_circle_and_other_places_are_listed() {
    let point = "<Point><coordinates>6.606,54.004</coordinates></Point>";
    let circle = |name: &str, value: &str| {
        kml(&format!(
            "<Placemark><name>a</name><ExtendedData><SchemaData><SimpleData name='{name}'>{value}</SimpleData>\
             <SimpleData name='kind'>permission</SimpleData></SchemaData></ExtendedData>{point}</Placemark>"
        ))
    };
    let area = "a: permission, 24 corners, None to None, (None, None)";
    check_areas(circle("radius", "100").as_bytes(), &[area], &[]);
    check_areas(circle("buffer_m", " 100 ").as_bytes(), &[area], &[]);
    check_refused(circle("radius", "wide").as_bytes(), "its radius is `wide`, expected metres");
    check_refused(circle("radius", "-1").as_bytes(), "a circle with a radius of -1 m");
    let line = "<LineString><coordinates>6.6,54 6.7,54</coordinates></LineString>";
    let others = placemark(&format!("{point}{line}<gx:Track/>"));
    let settings = Settings { allow_empty: true, ..settings() };
    let (found, notes) = areas(others.as_bytes(), &settings).unwrap();
    assert!(
        found.is_empty()
            && ["Point", "LineString", "Track"].iter().all(|it| notes.contains(&format!("a {it} without"))),
        "{notes}"
    );
}

#[test]
fn a_time_span_is_a_window_also_of_a_folder() {
    #[track_caller]
    fn check(begin: &str, end: &str, expected: &str) {
        let span = format!("<TimeSpan><begin>{begin}</begin><end>{end}</end></TimeSpan>");
        let own = placemark(&format!("{span}{}", polygon("", SQUARE)));
        let text = format!("a: permission, 4 corners, None to None, {expected}");
        check_areas(own.as_bytes(), &[&text], &[]);
        let of_folder = placemark(&polygon("", SQUARE)).replacen("<Document>", &format!("<Document>{span}"), 1);
        check_areas(of_folder.as_bytes(), &[&text], &[]);
    }
    // 2026-05-01T08:00:00Z.
    check("2026-05-01T08:00:00Z", "", "(Some(1777622400000), None)");
    check("2026-05-01T10:00:00+02:00", "", "(Some(1777622400000), None)");
    // To the end of the day, the month and the year.
    check("2026-05-01Z", "2026-05-01Z", "(Some(1777593600000), Some(1777680000000))");
    check("2026-05Z", "2026-05Z", "(Some(1777593600000), Some(1780272000000))");
    check("2026Z", "2026Z", "(Some(1767225600000), Some(1798761600000))");
    check("2026-12Z", "2026-12Z", "(Some(1796083200000), Some(1798761600000))");
    // Without an offset they may begin 14 hours earlier, and end 12 hours later.
    check("2026", "2026", "(Some(1767175200000), Some(1798804800000))");
    check("2026-05-01", "2026-05-01", "(Some(1777543200000), Some(1777723200000))");
    check("1900", "2026Z", "(None, Some(1798761600000))");
    check("", "", "(None, None)");
    let of_placemark = placemark(&format!("<TimeSpan><begin>2027Z</begin></TimeSpan>{}", polygon("", SQUARE)))
        .replacen("<Document>", "<Document><TimeSpan><begin>2026Z</begin></TimeSpan>", 1);
    let text = "a: permission, 4 corners, None to None, (Some(1798761600000), None)";
    check_areas(of_placemark.as_bytes(), &[text], &[]);
    // What is not understood applies always.
    for (span, said) in [
        ("<TimeSpan><begin>soon</begin></TimeSpan>", "NOT UNDERSTOOD: found `soon`, expected a date and time"),
        ("<TimeSpan><begin>2026-13Z</begin></TimeSpan>", "NOT UNDERSTOOD: found `2026-13Z`"),
        ("<TimeSpan><begin>2027Z</begin><end>2026Z</end></TimeSpan>", "NOT UNDERSTOOD: the period ends before"),
        ("<TimeStamp><when>2026</when></TimeStamp>", "a TimeStamp says when something was seen"),
    ] {
        let text = placemark(&format!("{span}{}", polygon("", SQUARE)));
        check_areas(text.as_bytes(), &["a: permission, 4 corners, None to None, (None, None)"], &[said]);
    }
}

#[test]
fn a_height_limits_what_stands_on_the_ground() {
    #[track_caller]
    fn check(inside: &str, coordinates: &str, ceiling: &str, said: &[&str]) {
        let text = placemark(&polygon(inside, coordinates));
        check_areas(text.as_bytes(), &[&format!("a: permission, 4 corners, None to {ceiling}, (None, None)")], said);
    }
    let flat = SQUARE.replace(",90", ",0");
    let mode = |extrude: &str, mode: &str| format!("<extrude>{extrude}</extrude><altitudeMode>{mode}</altitudeMode>");
    check(&mode("1", "absolute"), SQUARE, "Some(70.0)", &[]);
    check(&mode("true", "absolute"), SQUARE, "Some(70.0)", &[]);
    check(&mode("1", "clampToGround"), SQUARE, "None", &[]);
    check(&mode("0", "absolute"), SQUARE, "None", &["a polygon in the air that is not extruded"]);
    // A flat drawing would end at the sea.
    check(&mode("1", "absolute"), &flat, "None", &["its corners have no heights above 0"]);
    check(&mode("1", "high"), SQUARE, "None", &["NOT UNDERSTOOD: altitude mode `high` is not known"]);
    check("<gx:altitudeMode>clampToSeaFloor</gx:altitudeMode>", SQUARE, "None", &[]);
    check("<gx:altitudeMode>relativeToSeaFloor</gx:altitudeMode>", SQUARE, "None", &["a height above the sea floor"]);
}

#[test]
fn an_unknown_kind_is_a_keep_out_area_and_pictures_are_noted() {
    let text = placemark(&polygon("", SQUARE)).replacen("permission", "danger", 1);
    let area = "a: keep-out, 4 corners, None to None, (None, None)";
    check_areas(text.as_bytes(), &[area], &["NOT UNDERSTOOD: `kind` is `danger`, expected keep-out or permission"]);
    // A hole that is the border itself is filled.
    let hole = polygon(&format!("<innerBoundaryIs>{}</innerBoundaryIs>", ring(SQUARE)), SQUARE);
    let area = "a: permission, 4 corners, None to None, (None, None)";
    check_areas(placemark(&hole).as_bytes(), &[area], &["a hole that crosses or touches a border: filled"]);
    let picture = placemark(&polygon("", SQUARE)).replacen(
        "<Document>",
        "<Document><GroundOverlay><name>x</name></GroundOverlay>",
        1,
    );
    check_areas(picture.as_bytes(), &[area], &["GroundOverlay has no counterpart"]);
}
