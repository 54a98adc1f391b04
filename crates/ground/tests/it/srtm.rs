//! SRTM tiles.

use super::{check, check_bounds, check_refused, open, place, write_hgt, write_level};
use domain::ground::GroundModel as _;
use ground::Ground;
use proptest::prelude::*;

#[test]
fn tiles_of_both_sizes_are_read() {
    for side in [1_201, 3_601] {
        let folder = tempfile::tempdir().unwrap();
        // A metre up for each step to the east, and 100 m in the row that is farthest north.
        let row = |altitude_m: fn(u32) -> i16| (0..side).flat_map(move |it| altitude_m(it).to_be_bytes());
        let [north, others] = [row(|_| 100), row(|column| (column % 1_000) as i16)].map(Vec::from_iter);
        let bytes = [north, others.repeat(side as usize - 1)].concat();
        std::fs::write(folder.path().join("N54E006.hgt"), bytes).unwrap();
        let ground = open(folder.path());
        let step = 1.0 / f64::from(side - 1);
        check(&ground, 54.0, 6.0, Some(0.0));
        check(&ground, 54.0, 6.0 + 7.0 * step, Some(7.0));
        check(&ground, 54.0, 6.0 + 7.25 * step, Some(7.25));
        check(&ground, 55.0, 6.5, Some(100.0));
        check(&ground, 55.0 - 0.5 * step, 6.0 + 8.0 * step, Some(54.0));
        check(&ground, 53.9, 6.5, None);
        check(&ground, 54.5, 7.1, None);
        check_bounds(&ground, [(54.2, 6.0 + 3.5 * step), (54.3, 6.0 + 8.5 * step)], Some([3.0, 9.0]));
        check_bounds(&ground, [(54.2, 6.0), (55.0, 6.0 + 2.0 * step)], Some([0.0, 100.0]));
        check_bounds(&ground, [(54.2, 6.9), (54.3, 7.1)], None);
        assert_eq!(ground.bounds_m(&[]), None);
    }
}

#[test]
fn names_say_where_a_tile_is_in_all_quarters() {
    let folder = tempfile::tempdir().unwrap();
    for (name, altitude_m) in
        [("S34E018.hgt", 1), ("n00w001.SRTMGL1.hgt", 2), ("S01W001.HGT", 3), ("N10E179.hgt", 4), ("N10W180.hgt", 5)]
    {
        write_level(&folder.path().join(name), altitude_m);
    }
    let ground = open(folder.path());
    check(&ground, -33.9, 18.4, Some(1.0));
    check(&ground, 0.5, -0.5, Some(2.0));
    check(&ground, -0.5, -0.5, Some(3.0));
    check(&ground, -0.5, 0.5, None);
    check_bounds(&ground, [(-0.5, -0.9), (0.5, -0.1)], Some([2.0, 3.0]));
    // The short way across the antimeridian.
    check_bounds(&ground, [(10.2, 179.7), (10.3, -179.8)], Some([4.0, 5.0]));
    check_bounds(&ground, [(10.2, 178.7), (10.3, -179.8)], None);
}

#[test]
fn a_post_without_data_is_not_known() {
    let folder = tempfile::tempdir().unwrap();
    let is_void = |row: u32, column: u32| (row, column) == (600, 600);
    let altitude_m = |row, column| if is_void(row, column) { i16::MIN } else { 40 };
    write_hgt(&folder.path().join("N54E006.hgt"), altitude_m);
    let ground = open(folder.path());
    check(&ground, 54.5, 6.5, None);
    check(&ground, 54.5001, 6.5001, None);
    check(&ground, 54.5, 6.501, Some(40.0));
    check_bounds(&ground, [(54.499, 6.499), (54.501, 6.501)], None);
    check_bounds(&ground, [(54.501, 6.501), (54.6, 6.6)], Some([40.0, 40.0]));
}

#[test]
fn what_is_no_srtm_tile_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let check = |name: &str, content: &[u8], expected: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        check_refused(folder.path(), &format!("/{name}: {expected}"));
        std::fs::remove_file(path).unwrap();
    };
    check("N54E006.hgt", b"short", "has 5 bytes, expected 2884802 or 25934402");
    for name in ["harbour.hgt", "N54.hgt", "N90E006.hgt", "N54E180.hgt", "N5+E006.hgt", "É54E06.hgt", "N54E0066.hgt"] {
        check(name, b"", "its name is not that of an SRTM tile");
    }
    check("N54E006.hgt.zip", b"", "a packed file");
    std::fs::write(folder.path().join("readme.txt"), "").unwrap();
    check_refused(folder.path(), ": no tile of the ground is in it");
}

/// A tile of noise, which the cases share.
fn noise() -> (tempfile::TempDir, Ground) {
    let folder = tempfile::tempdir().unwrap();
    write_hgt(&folder.path().join("N54E006.hgt"), |row, column| noise_m(row, column) as i16);
    let ground = open(folder.path());
    (folder, ground)
}

fn noise_m(row: u32, column: u32) -> f64 {
    f64::from((row.wrapping_mul(2_654_435_761) ^ column.wrapping_mul(40_503)) % 800)
}

#[test]
fn the_ground_between_posts_lies_between_their_heights() {
    let (_folder, ground) = noise();
    proptest!(|(north in 0.0..1.0_f64, east in 0.0..1.0_f64, height in 0.0..0.01_f64, width in 0.0..0.01_f64)| {
        let (row, column) = ((1.0 - north) * 1_200.0, east * 1_200.0);
        let rows = [row.floor() as u32, row.ceil() as u32];
        let columns = [column.floor() as u32, column.ceil() as u32];
        let posts = rows.map(|row| columns.map(|column| noise_m(row, column)));
        let (low, high) = posts.iter().flatten().fold((f64::MAX, f64::MIN), |(a, b), it| (a.min(*it), b.max(*it)));
        let here = place(54.0 + north, 6.0 + east);
        let found = ground.altitude_m(here).unwrap();
        prop_assert!(low - 1e-6 <= found && found <= high + 1e-6, "{} of {:?}", found, posts);
        // What is found anywhere in a rectangle is within its bounds.
        let there = place((54.0 + north + height).min(55.0), (6.0 + east + width).min(7.0));
        let [lowest, highest] = ground.bounds_m(&[here, there]).unwrap();
        let middle = place(
            f64::midpoint(here.latitude_deg(), there.latitude_deg()),
            f64::midpoint(here.longitude_deg(), there.longitude_deg()),
        );
        for at in [here, middle, there] {
            let found = ground.altitude_m(at).unwrap();
            prop_assert!(lowest - 1e-6 <= found && found <= highest + 1e-6, "{}: {}, {} to {}", at, found, lowest, highest);
        }
    });
}
