//! `kittiwake pictures`: where the pictures in a recording were taken, for programs that make maps of them.

use std::fmt::Write as _;

use domain::geodesy::LatLon;
use domain::time::utc_text_with_millis;
use gateway::recorded;
use kittiwake_proto::v1;
use serde_json::{Value, json};

use super::report_failure;
use crate::operate::args::{PicturesArgs, PicturesFormat};
use crate::operate::convert::write_new;
use crate::operate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// `kittiwake pictures`.
pub fn pictures(args: &PicturesArgs) -> Outcome {
    match export(args) {
        Ok(()) => Outcome::Success,
        Err(failure) => report_failure(false, failure),
    }
}

/// As far as the file can be read; what is wrong with the rest goes to standard error.
fn export(args: &PicturesArgs) -> Result<(), Failure> {
    let found = recorded::pictures(&args.file).map_err(|error| Failure::bad_input(error.to_string()))?;
    if let Some(problem) = found.problem {
        output::error_line(format_args!("{}: {problem}; only the part before is written", args.file.display()));
    }
    if found.messages.is_empty() {
        output::error_line(format_args!("{}: no picture was reported", args.file.display()));
    }
    let text = match args.format {
        PicturesFormat::Csv => csv(&found.messages),
        PicturesFormat::Geojson => format!("{:#}\n", geojson(&found.messages)),
    };
    match &args.out {
        Some(out) => {
            write_new(out, &text)?;
            output::line(format_args!("written: {}, pictures: {}", out.display(), found.messages.len()));
        }
        None => output::line(text.trim_end()),
    }
    Ok(())
}

/// A cell that is not known is empty.
fn csv(pictures: &[v1::Picture]) -> String {
    let mut text = "number,utc,latitude_deg,longitude_deg,altitude_amsl_m,roll_deg,pitch_deg,yaw_deg\n".to_owned();
    for it in pictures {
        let cell = |value: Option<f64>, decimals: usize| value.map(|it| format!("{it:.decimals$}")).unwrap_or_default();
        let (place, turned) = (place(it), turned_deg(it));
        let [latitude, longitude] = [0, 1].map(|index| cell(place.map(|it| it[index]), 7));
        let altitude = cell(place.map(|it| it[2]), 3);
        let [roll, pitch, yaw] = [0, 1, 2].map(|index| cell(turned.map(|it| it[index]), 3));
        let _ = writeln!(
            text,
            "{},{},{latitude},{longitude},{altitude},{roll},{pitch},{yaw}",
            it.number,
            utc_text_with_millis(it.utc_ms)
        );
    }
    text
}

/// A picture without a place has no geometry.
fn geojson(pictures: &[v1::Picture]) -> Value {
    let feature = |it: &v1::Picture| {
        let geometry = place(it).map(|[latitude, longitude, altitude]| {
            let at = [rounded(longitude, 1e7), rounded(latitude, 1e7), rounded(altitude, 1e3)];
            json!({ "type": "Point", "coordinates": at })
        });
        let [roll, pitch, yaw] = [0, 1, 2].map(|index| turned_deg(it).map(|it| rounded(it[index], 1e3)));
        let properties = json!({ "number": it.number, "utc": utc_text_with_millis(it.utc_ms), "roll_deg": roll, "pitch_deg": pitch, "yaw_deg": yaw });
        json!({ "type": "Feature", "geometry": geometry, "properties": properties })
    };
    json!({ "type": "FeatureCollection", "features": pictures.iter().map(feature).collect::<Vec<_>>() })
}

/// Latitude, longitude and altitude, where they are one.
fn place(it: &v1::Picture) -> Option<[f64; 3]> {
    let it = it.place?;
    let is_place = LatLon::new(it.latitude_deg, it.longitude_deg).is_ok() && it.altitude_amsl_m.is_finite();
    is_place.then_some([it.latitude_deg, it.longitude_deg, it.altitude_amsl_m])
}

/// Roll, pitch, and yaw clockwise from north, 0 to 360.
fn turned_deg(it: &v1::Picture) -> Option<[f64; 3]> {
    let it = it.attitude?;
    let angles = [it.roll_rad.to_degrees(), it.pitch_rad.to_degrees(), it.yaw_rad.to_degrees().rem_euclid(360.0)];
    angles.iter().all(|it| it.is_finite()).then_some(angles)
}

fn rounded(number: f64, per_unit: f64) -> f64 {
    (number * per_unit).round() / per_unit
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken() -> [v1::Picture; 2] {
        let place =
            Some(v1::PicturePlace { latitude_deg: -33.876_543_21, longitude_deg: 18.4, altitude_amsl_m: 123.4 });
        let attitude =
            Some(v1::PictureAttitude { roll_rad: 0.0, pitch_rad: -0.1, yaw_rad: -std::f64::consts::FRAC_PI_2 });
        let utc_ms = 1_767_225_601_234;
        [v1::Picture { number: 7, utc_ms, place, attitude }, v1::Picture { number: 8, utc_ms, ..Default::default() }]
    }

    #[test]
    fn the_places_are_a_table() {
        let expected = "\
number,utc,latitude_deg,longitude_deg,altitude_amsl_m,roll_deg,pitch_deg,yaw_deg
7,2026-01-01T00:00:01.234Z,-33.8765432,18.4000000,123.400,0.000,-5.730,270.000
8,2026-01-01T00:00:01.234Z,,,,,,
";
        assert_eq!(csv(&taken()), expected);
    }

    #[test]
    fn the_places_are_points_with_the_longitude_first() {
        let utc = "2026-01-01T00:00:01.234Z";
        let expected = json!({ "type": "FeatureCollection", "features": [
            { "type": "Feature", "geometry": { "type": "Point", "coordinates": [18.4, -33.876_543_2, 123.4] },
              "properties": { "number": 7, "utc": utc, "roll_deg": 0.0, "pitch_deg": -5.73, "yaw_deg": 270.0 } },
            { "type": "Feature", "geometry": null,
              "properties": { "number": 8, "utc": utc, "roll_deg": null, "pitch_deg": null, "yaw_deg": null } },
        ] });
        assert_eq!(geojson(&taken()), expected);
    }
}
