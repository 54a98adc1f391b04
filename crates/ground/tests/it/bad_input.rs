//! Broken files, and what is not a file.

use std::io::Cursor;
use std::process::Command;

use super::geotiff::{Head, file, head, slope_m, write};
use super::{check_refused, place};
use counting_allocator::peak;
use domain::ground::GroundModel as _;
use ground::Ground;
use proptest::prelude::*;
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

#[test]
fn a_folder_or_a_tile_that_cannot_be_read_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    check_refused(&folder.path().join("none"), ": cannot be read: ");
    check_refused(folder.path(), ": no tile of the ground is in it");
    assert!(Command::new("mkfifo").arg(folder.path().join("N54E006.hgt")).status().unwrap().success());
    check_refused(folder.path(), "/N54E006.hgt: cannot be read: it is a pipe, not a regular file");
    std::fs::remove_file(folder.path().join("N54E006.hgt")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("a.tif")).unwrap();
    check_refused(folder.path(), "/a.tif: cannot be read: it is a device, not a regular file");
}

#[test]
fn all_broken_tiles_are_named_at_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.tif"), "GIF89a").unwrap();
    std::fs::write(folder.path().join("b.hgt"), "").unwrap();
    let told = Ground::open(folder.path()).map(|_| ()).unwrap_err().to_string();
    for expected in ["/a.tif: is not a GeoTIFF that can be read: ", "help: fetch the tile again", "/b.hgt: its name is"]
    {
        assert!(told.contains(expected), "{told}");
    }
}

#[test]
fn a_tile_that_is_cut_off_is_named_after_it_was_read() {
    let folder = tempfile::tempdir().unwrap();
    let floats: Vec<f32> = slope_m().into_iter().map(f32::from).collect();
    write::<colortype::Gray32Float>(folder.path(), "a.tif", &Head { strip: 4, ..head() }, &floats);
    let ground = Ground::open(folder.path()).unwrap();
    std::fs::write(folder.path().join("a.tif"), "II").unwrap();
    assert_eq!(ground.altitude_m(place(54.01, 6.01)), None);
    assert_eq!(ground.bounds_m(&[place(54.01, 6.01)]), None);
    let told = ground.check_tiles_read().unwrap_err().to_string();
    assert!(
        told.contains("/a.tif: is not a GeoTIFF that can be read: ") && told.matches("a.tif").count() == 1,
        "{told}"
    );
}

/// Replaces the value of a tag that has one number, in a file of little-endian numbers.
fn declare(bytes: &mut [u8], tag: u16, value: u32) {
    const LONG: u16 = 4;
    let directory = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let entries = bytes[directory + 2..].chunks_exact_mut(12);
    let mut found = entries.filter(|it| it[..2] == tag.to_le_bytes());
    let entry = found.next().unwrap();
    entry[2..4].copy_from_slice(&LONG.to_le_bytes());
    entry[8..].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn what_a_file_only_declares_takes_no_memory() {
    const WIDTH: u16 = 256;
    const LENGTH: u16 = 257;
    const STRIP: u16 = 278;
    #[track_caller]
    fn check(declared: &[(u16, u32)], expected: &str) {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = file::<colortype::GrayI16>(&Head { strip: 4, ..head() }, &slope_m());
        for (tag, value) in declared {
            declare(&mut bytes, *tag, *value);
        }
        std::fs::write(folder.path().join("a.tif"), bytes).unwrap();
        let held = peak(|| check_refused(folder.path(), &format!("/a.tif: {expected}")));
        assert!(held < 100_000, "{held} bytes");
    }
    check(&[(WIDTH, u32::MAX), (LENGTH, u32::MAX), (STRIP, u32::MAX)], "4294967295 x 4294967295 posts, expected ");
    check(&[(WIDTH, 2_000_000), (LENGTH, 2_000_000), (STRIP, u32::MAX)], "4000000000000 posts are stored as one piece");
    check(&[(LENGTH, u32::MAX)], "is not a GeoTIFF that can be read: ");
}

#[test]
fn numbers_whose_product_is_too_large_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut tags = encoder.image_directory().unwrap();
    // Values apart from each other, in tiles of one post: 2^80 of them.
    for (tag, value) in [
        (Tag::ImageWidth, u32::MAX),
        (Tag::ImageLength, u32::MAX),
        (Tag::BitsPerSample, 16),
        (Tag::SamplesPerPixel, 65_535),
        (Tag::PlanarConfiguration, 2),
        (Tag::PhotometricInterpretation, 1),
        (Tag::TileWidth, 1),
        (Tag::TileLength, 1),
        (Tag::TileOffsets, 8),
        (Tag::TileByteCounts, 1),
    ] {
        tags.write_tag(tag, value).unwrap();
    }
    tags.finish().unwrap();
    std::fs::write(folder.path().join("a.tif"), bytes.into_inner()).unwrap();
    check_refused(folder.path(), "/a.tif: is not a GeoTIFF that can be read");
}

#[test]
fn a_changed_byte_never_ends_in_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let good = file::<colortype::GrayI16>(&Head { strip: 2, ..head() }, &slope_m());
    let changes = prop::collection::vec((0..good.len(), any::<u8>()), 1..4);
    proptest!(ProptestConfig::with_cases(300), |(changes in changes)| {
        let mut bytes = good.clone();
        for (index, value) in changes {
            bytes[index] = value;
        }
        std::fs::write(folder.path().join("a.tif"), bytes).unwrap();
        if let Ok(ground) = Ground::open(folder.path()) {
            // Whatever is found: a number, or that it is not known.
            let found = ground.altitude_m(place(54.01, 6.01));
            prop_assert!(found.is_none_or(f64::is_finite));
        }
    });
}
