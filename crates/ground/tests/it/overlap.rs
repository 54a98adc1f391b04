//! Tiles over and beside each other.

use super::geotiff::{Head, head, slope_m, write};
use super::{check, check_bounds, open, write_hgt, write_level};
use tiff::encoder::colortype;

#[test]
fn the_finer_tile_counts_and_the_coarser_one_where_the_finer_has_no_data() {
    let folder = tempfile::tempdir().unwrap();
    // 54.03 to 54.0 north, 6.0 to 6.04 east, coarse; and two holes in the fine one, of which the coarse one knows the first.
    write::<colortype::GrayI16>(folder.path(), "a.tif", &head(), &slope_m());
    let is_hole = |row: u32, column: u32| [(1_188, 12), (600, 600)].contains(&(row, column));
    let fine_m = |row, column| if is_hole(row, column) { i16::MIN } else { 7 };
    write_hgt(&folder.path().join("N54E006.hgt"), fine_m);
    let ground = open(folder.path());
    check(&ground, 54.02, 6.02, Some(7.0));
    check(&ground, 54.01, 6.01, Some(121.0));
    check_bounds(&ground, [(54.02, 6.02), (54.021, 6.021)], Some([7.0, 7.0]));
    check_bounds(&ground, [(54.009, 6.009), (54.011, 6.011)], Some([7.0, 132.0]));
    check_bounds(&ground, [(54.009, 6.009), (54.1, 6.011)], Some([7.0, 132.0]));
    check(&ground, 54.5, 6.5, None);
    check_bounds(&ground, [(54.009, 6.009), (54.6, 6.6)], None);
}

#[test]
fn bounds_reach_over_several_tiles() {
    let folder = tempfile::tempdir().unwrap();
    for (name, altitude_m) in [("N54E006.hgt", 1), ("N54E007.hgt", 2), ("N53E006.hgt", 3), ("N53E007.hgt", 4)] {
        write_level(&folder.path().join(name), altitude_m);
    }
    let ground = open(folder.path());
    check_bounds(&ground, [(54.5, 6.5), (53.5, 7.5)], Some([1.0, 4.0]));
    check_bounds(&ground, [(54.5, 6.5), (54.5, 7.5)], Some([1.0, 2.0]));
    check_bounds(&ground, [(54.5, 6.5), (53.5, 8.1)], None);
}

#[test]
fn tiles_without_the_posts_of_their_neighbours_leave_no_gap() {
    let folder = tempfile::tempdir().unwrap();
    let east = Head { tie: vec![0.0, 0.0, 0.0, 6.05, 54.03, 0.0], ..head() };
    write::<colortype::GrayI16>(folder.path(), "west.tif", &head(), &[10; 20]);
    write::<colortype::GrayI16>(folder.path(), "east.tif", &east, &[20; 20]);
    let ground = open(folder.path());
    for (longitude_deg, expected_m) in [
        (5.994, None),
        (5.996, Some(10.0)),
        (6.044, Some(10.0)),
        (6.046, Some(20.0)),
        (6.095, Some(20.0)),
        (6.096, None),
    ] {
        check(&ground, 54.01, longitude_deg, expected_m);
    }
    check_bounds(&ground, [(54.0, 6.0), (54.02, 6.09)], Some([10.0, 20.0]));
    check_bounds(&ground, [(54.0, 6.0), (54.02, 6.0449)], Some([10.0, 10.0]));
}
