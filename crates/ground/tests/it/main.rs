//! Tiles that the tests write are read back.

mod bad_input;
mod geotiff;
mod overlap;
mod srtm;

use std::path::Path;

use domain::geodesy::LatLon;
use domain::ground::GroundModel as _;
use ground::Ground;

#[global_allocator]
static ALLOCATOR: counting_allocator::Counting = counting_allocator::Counting;

fn place(latitude_deg: f64, longitude_deg: f64) -> LatLon {
    LatLon::new(latitude_deg, longitude_deg).unwrap()
}

fn open(folder: &Path) -> Ground {
    Ground::open(folder).unwrap_or_else(|it| panic!("{it}"))
}

/// The altitude at a place, which is known to a centimetre or not at all.
#[track_caller]
fn check(ground: &Ground, latitude_deg: f64, longitude_deg: f64, expected_m: Option<f64>) {
    let found_m = ground.altitude_m(place(latitude_deg, longitude_deg));
    let is_same = found_m.zip(expected_m).map_or(found_m == expected_m, |(a, b)| (a - b).abs() < 0.01);
    assert!(is_same, "{found_m:?} at {latitude_deg}, {longitude_deg}, expected {expected_m:?}");
    ground.check_tiles_read().unwrap_or_else(|it| panic!("{it}"));
}

#[track_caller]
fn check_bounds(ground: &Ground, corners: [(f64, f64); 2], expected_m: Option<[f64; 2]>) {
    let corners = corners.map(|it| place(it.0, it.1));
    assert_eq!(ground.bounds_m(&corners), expected_m, "{corners:?}");
}

/// The folder is refused, and the text begins with its path and this.
#[track_caller]
fn check_refused(folder: &Path, expected: &str) {
    let told = Ground::open(folder).map(|_| ()).unwrap_err().to_string();
    let told = told.strip_prefix(&format!("{}", folder.display())).unwrap_or(&told);
    assert!(told.starts_with(expected), "{told}");
}

/// An SRTM tile of three arc seconds with all posts at one height.
fn write_level(path: &Path, altitude_m: i16) {
    std::fs::write(path, altitude_m.to_be_bytes().repeat(1_201 * 1_201)).unwrap();
}

/// An SRTM tile: `altitude_m` of a row from the north and a column from the west.
fn write_hgt(path: &Path, altitude_m: impl Fn(u32, u32) -> i16) {
    let posts = (0..1_201).flat_map(|row| (0..1_201).map(move |column| (row, column)));
    let bytes: Vec<u8> = posts.flat_map(|(row, column)| altitude_m(row, column).to_be_bytes()).collect();
    std::fs::write(path, bytes).unwrap();
}
