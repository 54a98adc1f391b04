//! AIXM 5.1 as states publish airspace in it.

use super::{areas, check_areas, check_refused, mission, settings, source};
use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use formats::assemble::assemble;
use proptest::prelude::*;

const SQUARE: &str = "<gml:LinearRing><gml:posList>54.004 6.606 54.004 6.609 54.006 6.609 54.006 6.606 54.004 6.606</gml:posList></gml:LinearRing>";
const LIMITS: &str = "<aixm:upperLimit uom='FT'>2000</aixm:upperLimit><aixm:upperLimitReference>MSL</aixm:upperLimitReference>\
                      <aixm:lowerLimit uom='FT'>GND</aixm:lowerLimit><aixm:lowerLimitReference>SFC</aixm:lowerLimitReference>";

fn message(inside: &str) -> String {
    format!(
        "<?xml version='1.0' encoding='UTF-8'?><message:AIXMBasicMessage xmlns:message='m' xmlns:aixm='a' xmlns:gml='g' xmlns:xlink='x'>\
         {inside}</message:AIXMBasicMessage>"
    )
}

fn surface(srs: &str, ring: &str) -> String {
    format!(
        "<aixm:horizontalProjection><aixm:Surface srsName='{srs}'><gml:patches><gml:PolygonPatch><gml:exterior>{ring}</gml:exterior>\
         </gml:PolygonPatch></gml:patches></aixm:Surface></aixm:horizontalProjection>"
    )
}

/// A time slice of airspace of a type, with what stands beside its geometry, and its volume.
fn slice(kind: &str, beside: &str, volume: &str) -> String {
    let volume = if volume.is_empty() {
        String::new()
    } else {
        format!(
            "<aixm:geometryComponent><aixm:AirspaceGeometryComponent><aixm:theAirspaceVolume><aixm:AirspaceVolume>{volume}\
             </aixm:AirspaceVolume></aixm:theAirspaceVolume></aixm:AirspaceGeometryComponent></aixm:geometryComponent>"
        )
    };
    format!(
        "<aixm:timeSlice><aixm:AirspaceTimeSlice>{beside}<aixm:type>{kind}</aixm:type><aixm:designator>EGX1</aixm:designator>{volume}\
         </aixm:AirspaceTimeSlice></aixm:timeSlice>"
    )
}

fn airspace(slices: &str) -> String {
    message(&format!("<message:hasMember><aixm:Airspace gml:id='uuid.1'>{slices}</aixm:Airspace></message:hasMember>"))
}

const EPSG: &str = "urn:ogc:def:crs:EPSG::4326";

fn one(kind: &str, beside: &str, limits: &str) -> String {
    airspace(&slice(kind, beside, &format!("{limits}{}", surface(EPSG, SQUARE))))
}

#[test]
fn a_polygon_straight_in_the_airspace_is_read() {
    let polygon = format!("<gml:Polygon><gml:exterior>{SQUARE}</gml:exterior></gml:Polygon>");
    let text = message(&format!(
        "<message:hasMember><aixm:Airspace><aixm:designator>EGX001A</aixm:designator><aixm:type>R</aixm:type>{polygon}</aixm:Airspace></message:hasMember>"
    ));
    check_areas(text.as_bytes(), &["EGX001A: keep-out, 4 corners, None to None, (None, None)"], &[]);
}

#[test]
fn a_type_says_what_a_drone_needs() {
    #[track_caller]
    fn check(kind: &str, expected: &str, said: &[&str]) {
        let area = format!("EGX1: {expected}, 4 corners, None to Some(589.6), (None, None)");
        check_areas(one(kind, "", LIMITS).as_bytes(), &[&area], said);
    }
    check("P", "keep-out", &[]);
    check("R", "keep-out", &[]);
    check("D", "permission", &[]);
    check("CTR", "permission", &[]);
    check("OTHER:FRZ", "permission", &[]);
    check("XYZ", "keep-out", &["NOT UNDERSTOOD: the type `XYZ` is not known"]);
    check_refused(one("FIR", "", LIMITS).as_bytes(), "no area was found in this file (AIXM)");
}

#[test]
fn limits_are_read_in_their_units() {
    /// The lower and the upper limit, each as value, unit and reference.
    #[track_caller]
    fn check(lower: [&str; 3], upper: [&str; 3], expected: &str, said: &[&str]) {
        let limit = |name: &str, [value, unit, reference]: [&str; 3]| {
            format!(
                "<aixm:{name} uom='{unit}'>{value}</aixm:{name}><aixm:{name}Reference>{reference}</aixm:{name}Reference>"
            )
        };
        let text = one("R", "", &format!("{}{}", limit("lowerLimit", lower), limit("upperLimit", upper)));
        check_areas(text.as_bytes(), &[&format!("EGX1: keep-out, 4 corners, {expected}, (None, None)")], said);
    }
    check(["50", "M", "MSL"], ["100", "M", "MSL"], "Some(30.0) to Some(80.0)", &[]);
    check(["0", "FT", "SFC"], ["UNL", "FT", "STD"], "None to None", &[]);
    check(["FLOOR", "", ""], ["CEILING", "", ""], "None to None", &[]);
    // FL 100 is 3048 m: 2743.2 m - 600 m, and FL 195 is 5943.6 m: 6537.96 m + 400 m, less the 20 m of the take-off point.
    check(["100", "FL", "STD"], ["195", "FL", "STD"], "Some(2123.2) to Some(6917.96)", &[]);
    check(["10000", "FT", "STD"], ["19500", "FT", "STD"], "Some(2123.2) to Some(6917.96)", &[]);
    check(
        ["50", "M", "MSL"],
        ["1", "KM", "MSL"],
        "Some(30.0) to None",
        &["NOT UNDERSTOOD: the unit of upperLimit is `KM`"],
    );
    check(["high", "M", "MSL"], ["100", "M", "MSL"], "None to Some(80.0)", &["NOT UNDERSTOOD: lowerLimit is `high`"]);
    check(
        ["50", "M", "AGL"],
        ["100", "M", "MSL"],
        "None to Some(80.0)",
        &["NOT UNDERSTOOD: lowerLimitReference is `AGL`"],
    );
    let second = format!("{LIMITS}<aixm:maximumLimit uom='FL'>65</aixm:maximumLimit>");
    check_areas(one("R", "", &second).as_bytes(), &["EGX1: keep-out, 4 corners, None to None, (None, None)"], &[]);
}

#[test]
fn the_order_of_the_numbers_is_that_of_the_coordinate_system() {
    #[track_caller]
    fn check(srs: &str, list: &str) {
        let ring = format!("<gml:LinearRing><gml:posList>{list}</gml:posList></gml:LinearRing>");
        let text = airspace(&slice("R", "", &surface(srs, &ring)));
        check_areas(text.as_bytes(), &["EGX1: keep-out, 3 corners, None to None, (None, None)"], &[]);
    }
    check(EPSG, "54.004 6.606 54.004 6.609 54.006 6.609 54.004 6.606");
    check("", "54.004 6.606 54.004 6.609 54.006 6.609 54.004 6.606");
    check("urn:ogc:def:crs:OGC:1.3:CRS84", "6.606 54.004 6.609 54.004 6.609 54.006 6.606 54.004");
    check("http://www.opengis.net/gml/srs/epsg.xml#4326", "6.606 54.004 6.609 54.004 6.609 54.006 6.606 54.004");
    let three = SQUARE
        .replacen("<gml:posList>", "<gml:posList srsDimension='3'>", 1)
        .replace(" 54.", " 7 54.")
        .replace("6.606</", "6.606 7</");
    let text = airspace(&slice("R", "", &surface(EPSG, &three)));
    check_areas(text.as_bytes(), &["EGX1: keep-out, 4 corners, None to None, (None, None)"], &[]);
    let national = airspace(&slice("R", "", &surface("urn:ogc:def:crs:EPSG::27700", SQUARE)));
    check_refused(national.as_bytes(), "the coordinate system `urn:ogc:def:crs:EPSG::27700` is not read");
}

/// A ring of segments of one curve.
fn curve(segments: &str) -> String {
    format!(
        "<gml:Ring><gml:curveMember><gml:Curve><gml:segments>{segments}</gml:segments></gml:Curve></gml:curveMember></gml:Ring>"
    )
}

fn arc(from_deg: f64, to_deg: f64) -> String {
    format!(
        "<gml:ArcByCenterPoint numArc='1'><gml:pointProperty><gml:Point><gml:pos>54.02 6.6</gml:pos></gml:Point></gml:pointProperty>\
         <gml:radius uom='M'>1000</gml:radius><gml:startAngle uom='deg'>{from_deg}</gml:startAngle><gml:endAngle uom='deg'>{to_deg}</gml:endAngle></gml:ArcByCenterPoint>"
    )
}

fn geodesics(list: &str) -> String {
    format!("<gml:GeodesicString><gml:posList>{list}</gml:posList></gml:GeodesicString>")
}

#[test]
fn circles_and_borders_that_cannot_be_read() {
    let circle = "<gml:CircleByCenterPoint numArc='1'><gml:pos>54.02 6.6</gml:pos><gml:radius uom='[nmi_i]'>0.5</gml:radius></gml:CircleByCenterPoint>";
    let area = ["EGX1: keep-out, 24 corners, None to None, (None, None)"];
    check_areas(airspace(&slice("R", "", &surface(EPSG, &curve(circle)))).as_bytes(), &area, &[]);
    check_areas(airspace(&slice("R", "", &surface(EPSG, &curve(&arc(10.0, 370.0))))).as_bytes(), &area, &[]);
    #[track_caller]
    fn check(segments: &str, expected: &str) {
        check_refused(airspace(&slice("R", "", &surface(EPSG, &curve(segments)))).as_bytes(), expected);
    }
    check(&circle.replace("[nmi_i]", "cubit"), "the unit of the radius is `cubit`");
    check(&circle.replace("0.5", "x"), "`radius` is `x`, expected a number");
    check(&arc(10.0, 10.0), "an arc from 10 to 10 degrees");
    check("<gml:Arc><gml:posList>54 6 54 7 55 7</gml:posList></gml:Arc>", "a border drawn by `Arc` is not read");
    check("<gml:x xlink:href='#border'/>", "`x` is in another place of the file");
    check(&geodesics("54.0 6.6 54.1"), "found 3 numbers, expected 2 for each place");
    check(&geodesics("north 6.6"), "found `north`, expected degrees");
    check(&geodesics("94 6.6"), "latitude 94");
    check_refused(airspace(&slice("R", "", "<aixm:centreline/>")).as_bytes(), "a corridor along a line is not read");
    check_refused(airspace(&slice("R", "", "")).as_bytes(), "a version () of `EGX1` without a shape");
}

#[test]
fn validity_is_a_window_and_a_change_adds_to_what_it_changes() {
    let valid = |begin: &str, end: &str| {
        format!(
            "<gml:validTime><gml:TimePeriod><gml:beginPosition>{begin}</gml:beginPosition>{end}</gml:TimePeriod></gml:validTime>"
        )
    };
    let unknown = "<gml:endPosition indeterminatePosition='unknown'/>";
    let shape = surface(EPSG, SQUARE);
    let baseline = slice(
        "D",
        &format!("{}<aixm:interpretation>BASELINE</aixm:interpretation>", valid("2026-05-01T08:00:00Z", unknown)),
        &shape,
    );
    let end = "<gml:endPosition>2026-06-01T00:00:00Z</gml:endPosition>";
    let change = |shape: &str| {
        let beside =
            format!("{}<aixm:interpretation>TEMPDELTA</aixm:interpretation>", valid("2026-05-20T00:00:00Z", end));
        slice("D", &beside, shape)
    };
    let with_shape = airspace(&format!("{baseline}{}", change(&shape)));
    let expected = [
        "EGX1: permission, 4 corners, None to None, (Some(1777622400000), None)",
        "EGX1 2: permission, 4 corners, None to None, (Some(1779235200000), Some(1780272000000))",
    ];
    check_areas(with_shape.as_bytes(), &expected, &[]);
    // It may change anything.
    let without = airspace(&format!("{baseline}{}", change("")));
    let said = "NOT UNDERSTOOD: a version (TEMPDELTA) of `EGX1` without a shape";
    check_areas(without.as_bytes(), &["EGX1: permission, 4 corners, None to None, (None, None)"], &[said]);
    let broken = airspace(&slice("D", &valid("soon", unknown), &shape));
    check_areas(
        broken.as_bytes(),
        &["EGX1: permission, 4 corners, None to None, (None, None)"],
        &["NOT UNDERSTOOD: found `soon`"],
    );
}

#[test]
fn timesheets_become_hours() {
    /// The parts of timesheets: the hours of the area.
    #[track_caller]
    fn check(sheets: &[&str], expected: &str, said: &str) {
        let sheet = |it: &&str| format!("<aixm:timeInterval><aixm:Timesheet>{it}</aixm:Timesheet></aixm:timeInterval>");
        let sheets: String = sheets.iter().map(sheet).collect();
        let activation = format!(
            "<aixm:activation><aixm:AirspaceActivation><aixm:status>ACTIVE</aixm:status>{sheets}</aixm:AirspaceActivation></aixm:activation>"
        );
        let read = formats::read(&source("a.xml", &one("R", &activation, ""))).unwrap();
        let areas = formats::read(&source("m", r#"{"type": "FeatureCollection", "features": []}"#)).unwrap();
        let assembled = assemble(&areas, &[read], &settings()).unwrap();
        let hours = mission(&assembled).areas[0].hours.as_ref().map(|it| it.to_texts().join(" ")).unwrap_or_default();
        assert_eq!(hours, expected);
        assert!(
            super::notes(&assembled).contains(said) && (!said.is_empty() || assembled.notes.is_empty()),
            "{:?}",
            assembled.notes
        );
    }
    let reference = "<aixm:timeReference>UTC</aixm:timeReference>";
    let times = "<aixm:startTime>08:00</aixm:startTime><aixm:endTime>16:30</aixm:endTime>";
    let day = |day: &str| format!("<aixm:day>{day}</aixm:day>");
    check(&[], "", "");
    check(&[&format!("{reference}{}{times}", day("MON"))], "Mon 08:00-16:30", "");
    check(
        &[&format!("{reference}{}{times}", day("MON")), &format!("{reference}{}{times}", day("WED"))],
        "Mon,Wed 08:00-16:30",
        "",
    );
    // From one day till another it goes on.
    let till = format!("{reference}{}<aixm:dayTil>WED</aixm:dayTil>{times}", day("MON"));
    check(&[&till], "Mon 08:00-24:00 Tue 00:00-24:00 Wed 00:00-16:30", "");
    // Holidays are in no calendar here, and in summer the hours begin earlier.
    check(&[&format!("{reference}{}{times}", day("HOL"))], "Mon-Sun 08:00-16:30", "");
    check(
        &[&format!("{reference}{}{times}<aixm:daylightSavingAdjust>YES</aixm:daylightSavingAdjust>", day("MON"))],
        "Mon 07:00-16:30",
        "",
    );
    check(&[&format!("<aixm:timeReference>UTC+1</aixm:timeReference>{}{times}", day("MON"))], "Mon 07:00-15:30", "");
    check(&[&format!("{reference}{}{times}<aixm:excluded>YES</aixm:excluded>", day("MON"))], "", "");
    check(
        &[&format!("{reference}{}{times}", day("FULL_MOON"))],
        "",
        "NOT UNDERSTOOD: found `FULL_MOON`, expected a day",
    );
    check(
        &[&format!("<aixm:timeReference>LOCAL</aixm:timeReference>{times}")],
        "",
        "NOT UNDERSTOOD: `timeReference` is `LOCAL`",
    );
    let dawn = format!(
        "{reference}<aixm:startEvent>SR</aixm:startEvent><aixm:startTimeRelativeEvent uom='MIN'>-30</aixm:startTimeRelativeEvent>"
    );
    check(&[&dawn], "", "NOT UNDERSTOOD: `startTimeRelativeEvent` is not read");
    check(&[&format!("{reference}<aixm:startTime>late</aixm:startTime>")], "", "found `late+00:00`");
}

#[test]
fn airspace_may_have_the_shape_of_other_airspace() {
    let part = |href: &str| {
        format!(
            "<aixm:contributorAirspace><aixm:AirspaceVolumeDependency><aixm:theAirspace xlink:href='{href}'/>\
             </aixm:AirspaceVolumeDependency></aixm:contributorAirspace>"
        )
    };
    let whole = |href: &str| {
        let member = |id: &str, slice: &str| {
            format!(
                "<message:hasMember><aixm:Airspace gml:id='{id}'><gml:identifier>{id}</gml:identifier>{slice}</aixm:Airspace></message:hasMember>"
            )
        };
        let fir = slice("FIR", "", &surface(EPSG, SQUARE));
        message(&format!("{}{}", member("1-2", &fir), member("3-4", &slice("CTR", "", &part(href)))))
    };
    let (found, _) = areas(whole("urn:uuid:1-2").as_bytes(), &settings()).unwrap();
    assert_eq!(found, ["EGX1: permission, 4 corners, None to None, (None, None)"]);
    check_refused(
        whole("urn:uuid:9").as_bytes(),
        "its shape is that of the airspace `urn:uuid:9`, which is not in the file",
    );
    // It is its own part.
    check_refused(whole("#3-4").as_bytes(), "its shape is that of the airspace `#3-4`");
}

#[test]
fn other_things_in_the_file_are_listed() {
    let text = one("R", "", LIMITS).replacen(
        "<message:hasMember>",
        "<message:hasMember><aixm:Unit/></message:hasMember><message:hasMember><aixm:VerticalStructure/></message:hasMember><message:hasMember>",
        1,
    );
    let area = "EGX1: keep-out, 4 corners, None to Some(589.6), (None, None)";
    check_areas(text.as_bytes(), &[area], &["Unit, 1 times: not read", "a VerticalStructure without a radius"]);
    let smaller = one("R", "", "").replacen(
        "<aixm:theAirspaceVolume>",
        "<aixm:operation>SUBTR</aixm:operation><aixm:theAirspaceVolume>",
        1,
    );
    let base = airspace(&slice("R", "", &surface(EPSG, SQUARE)));
    let inside = |it: &str| {
        it.split_once("<aixm:geometryComponent>")
            .map(|it| it.1.rsplit_once("</aixm:geometryComponent>").unwrap().0.to_owned())
            .unwrap()
    };
    let both = base.replacen(
        "</aixm:geometryComponent>",
        &format!("</aixm:geometryComponent><aixm:geometryComponent>{}</aixm:geometryComponent>", inside(&smaller)),
        1,
    );
    check_areas(
        both.as_bytes(),
        &["EGX1: keep-out, 4 corners, None to None, (None, None)"],
        &["a volume that makes the airspace smaller (SUBTR)"],
    );
}

proptest! {
    /// A half circle with a notch of another one: whatever lies in it lies in the area, and the area reaches little farther.
    #[test]
    fn an_area_contains_what_its_arcs_enclose(bearing in -89.0..89.0_f64, is_clockwise in any::<bool>(), share in 0.0..1.0_f64) {
        let centre = LatLon::new(54.02, 6.6).unwrap();
        let at = |bearing_deg: f64, distance_m: f64| {
            let (sin, cos) = bearing_deg.to_radians().sin_cos();
            LocalFrame::at(centre).lat_lon(Ned::new(distance_m * cos, distance_m * sin, 0.0))
        };
        // Round the north, from the west to the east or back, closed by a line through the centre, which is 2.2 km north.
        let (first, last) = if is_clockwise { (-90.0, 90.0) } else { (90.0, -90.0) };
        let ends = [at(last, 1000.0), at(first, 1000.0)].map(|it| format!("{} {}", it.latitude_deg(), it.longitude_deg()));
        let ring = curve(&format!("{}{}", arc(first, last), geodesics(&ends.join(" "))));
        let text = airspace(&slice("R", "", &surface(EPSG, &ring)));
        let read = formats::read(&source("a.xml", &text)).unwrap();
        let empty = formats::read(&source("m", r#"{"type": "FeatureCollection", "features": []}"#)).unwrap();
        let areas = mission(&assemble(&empty, &[read], &settings()).unwrap()).areas;
        let frame = LocalFrame::at(LatLon::new(54.0, 6.6).unwrap());
        prop_assert!(areas[0].contains(frame.local(at(bearing, 999.99 * share.max(0.01)))));
        prop_assert!(!areas[0].contains(frame.local(at(bearing, 1003.0))));
        prop_assert!(!areas[0].contains(frame.local(at(bearing + 180.0, 5.0 + 900.0 * share))));
        // The same arc as a bite out of a square: nothing of what is left of the square is lost.
        let [west, east] = [at(-90.0, 1000.0), at(90.0, 1000.0)];
        let corners = [(54.05, east), (54.05, west)].map(|(latitude, it)| format!("{latitude} {}", it.longitude_deg()));
        let corners = if is_clockwise { corners.join(" ") } else { format!("{} {}", corners[1], corners[0]) };
        let ring = curve(&format!("{}{}", arc(first, last), geodesics(&corners)));
        let text = airspace(&slice("R", "", &surface(EPSG, &ring)));
        let read = formats::read(&source("a.xml", &text)).unwrap();
        let areas = mission(&assemble(&empty, &[read], &settings()).unwrap()).areas;
        let beyond = at(bearing, 1000.01);
        prop_assert!(areas[0].contains(frame.local(beyond)), "{beyond}");
        prop_assert!(!areas[0].contains(frame.local(at(bearing, 996.0))));
    }
}
