//! GeoTIFF.

use std::io::Cursor;
use std::path::Path;

use super::{check, check_bounds, check_refused, open};
use tiff::encoder::colortype::{self, ColorType};
use tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, TiffValue};
use tiff::tags::Tag;

/// What a file says of itself.
#[derive(Clone)]
pub(super) struct Head {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) scale: [f64; 3],
    pub(super) tie: Vec<f64>,
    /// Each with its value.
    pub(super) keys: Vec<(u16, u16)>,
    pub(super) texts: Vec<(u16, &'static str)>,
    pub(super) compression: Compression,
    pub(super) predictor: Predictor,
    /// Rows of a strip.
    pub(super) strip: u32,
}

const MODEL: (u16, u16) = (1024, 2);
const POINT: (u16, u16) = (1025, 2);
const NO_DATA: u16 = 42113;

/// Five columns and four rows, a hundredth of a degree apart, from 54.03, 6.0 to the south and the east.
pub(super) fn head() -> Head {
    Head {
        columns: 5,
        rows: 4,
        scale: [0.01, 0.01, 0.0],
        tie: vec![0.0, 0.0, 0.0, 6.0, 54.03, 0.0],
        keys: vec![MODEL, POINT, (2048, 4326)],
        texts: Vec::new(),
        compression: Compression::Uncompressed,
        predictor: Predictor::None,
        strip: 3,
    }
}

pub(super) fn file<C: ColorType>(head: &Head, values: &[C::Inner]) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut encoder = encoder.with_compression(head.compression).with_predictor(head.predictor);
    let mut image = encoder.new_image::<C>(head.columns, head.rows).unwrap();
    image.rows_per_strip(head.strip).unwrap();
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &head.scale[..]).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &head.tie[..]).unwrap();
    tags.write_tag(Tag::GeoKeyDirectoryTag, &directory(&head.keys)[..]).unwrap();
    for (tag, text) in &head.texts {
        tags.write_tag(Tag::from_u16_exhaustive(*tag), *text).unwrap();
    }
    image.write_data(values).unwrap();
    bytes.into_inner()
}

fn directory(keys: &[(u16, u16)]) -> Vec<u16> {
    let head = [1, 1, 0, keys.len() as u16];
    head.into_iter().chain(keys.iter().flat_map(|(id, value)| [*id, 0, 1, *value])).collect()
}

pub(super) fn write<C: ColorType>(folder: &Path, name: &str, head: &Head, values: &[C::Inner])
where
    [C::Inner]: TiffValue,
{
    std::fs::write(folder.join(name), file::<C>(head, values)).unwrap();
}

/// Row by row: 100, 101, .. 104; 110, ..; 120, ..; 130, .. metres.
pub(super) fn slope_m() -> Vec<i16> {
    (0..4).flat_map(|row| (0..5).map(move |column| 100 + 10 * row + column)).collect()
}

#[track_caller]
fn check_slope<C: ColorType>(head: &Head, values: &[C::Inner])
where
    [C::Inner]: TiffValue,
{
    let folder = tempfile::tempdir().unwrap();
    write::<C>(folder.path(), "slope.tif", head, values);
    let ground = open(folder.path());
    check(&ground, 54.03, 6.0, Some(100.0));
    check(&ground, 54.01, 6.03, Some(123.0));
    check(&ground, 54.015, 6.025, Some(117.5));
    check(&ground, 54.0, 6.04, Some(134.0));
    check_bounds(&ground, [(54.001, 6.011), (54.019, 6.019)], Some([111.0, 132.0]));
}

#[test]
fn heights_are_read_whatever_their_numbers_and_their_compression() {
    let slope = slope_m();
    let with = |compression| Head { compression, ..head() };
    let compressions =
        [Compression::Uncompressed, Compression::Lzw, Compression::Deflate(DeflateLevel::Fast), Compression::Packbits];
    for compression in compressions {
        check_slope::<colortype::GrayI16>(&with(compression), &slope);
        let floats: Vec<f32> = slope.iter().map(|it| f32::from(*it)).collect();
        check_slope::<colortype::Gray32Float>(&with(compression), &floats);
    }
    let predicted = Head { predictor: Predictor::Horizontal, ..with(Compression::Lzw) };
    check_slope::<colortype::GrayI16>(&predicted, &slope);
    check_slope::<colortype::Gray8>(&head(), &slope.iter().map(|it| *it as u8).collect::<Vec<_>>());
    check_slope::<colortype::Gray16>(&head(), &slope.iter().map(|it| *it as u16).collect::<Vec<_>>());
    check_slope::<colortype::GrayI32>(&head(), &slope.iter().map(|it| i32::from(*it)).collect::<Vec<_>>());
    check_slope::<colortype::Gray64Float>(&head(), &slope.iter().map(|it| f64::from(*it)).collect::<Vec<_>>());
    for strip in [1, 4, 100] {
        check_slope::<colortype::GrayI16>(&Head { strip, ..head() }, &slope);
    }
}

#[test]
fn the_tie_point_and_the_kind_of_raster_say_where_posts_are() {
    let slope = slope_m();
    let moved = Head { tie: vec![1.0, 2.0, 0.0, 6.01, 54.01, 0.0], ..head() };
    check_slope::<colortype::GrayI16>(&moved, &slope);
    // The corner of an area lies half a step beyond its middle.
    let area = Head {
        keys: vec![MODEL, (1025, 1), (2048, 4258), (4096, 5773), (4099, 9001)],
        tie: vec![0.0, 0.0, 0.0, 5.995, 54.035, 0.0],
        ..head()
    };
    check_slope::<colortype::GrayI16>(&area, &slope);
    check_slope::<colortype::GrayI16>(&Head { keys: vec![(2048, 4326)], ..area }, &slope);
}

#[test]
fn posts_in_tiles_are_read_and_tiles_that_were_left_out_have_no_data() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut tags = encoder.image_directory().unwrap();
    // Two tiles of 16 by 16 beside each other, the second one cut off after four columns, and a row of two that were left out.
    let tile =
        |west: i16| -> Vec<i16> { (0..16).flat_map(|row| (0..16).map(move |it| 10 * row + west + it)).collect() };
    let offsets = [tile(0), tile(16)].map(|it| tags.write_data(&it[..]).unwrap() as u32);
    for (tag, value) in [
        (Tag::ImageWidth, 20_u16),
        (Tag::ImageLength, 20),
        (Tag::BitsPerSample, 16),
        (Tag::SampleFormat, 2),
        (Tag::PhotometricInterpretation, 1),
        (Tag::TileWidth, 16),
        (Tag::TileLength, 16),
    ] {
        tags.write_tag(tag, value).unwrap();
    }
    tags.write_tag(Tag::TileOffsets, &[offsets[0], offsets[1], 0, 0][..]).unwrap();
    tags.write_tag(Tag::TileByteCounts, &[512_u32, 512, 0, 0][..]).unwrap();
    tags.write_tag(Tag::ModelPixelScaleTag, &head().scale[..]).unwrap();
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, 6.0, 54.0, 0.0][..]).unwrap();
    tags.write_tag(Tag::GeoKeyDirectoryTag, &directory(&head().keys)[..]).unwrap();
    tags.finish().unwrap();
    std::fs::write(folder.path().join("tiled.tiff"), bytes.into_inner()).unwrap();
    let ground = open(folder.path());
    check(&ground, 54.0, 6.0, Some(0.0));
    check(&ground, 53.9, 6.155, Some(115.5));
    check(&ground, 53.85, 6.19, Some(169.0));
    check(&ground, 53.849, 6.1, None);
    check_bounds(&ground, [(54.0, 6.0), (53.85, 6.19)], Some([0.0, 169.0]));
    check_bounds(&ground, [(53.985, 6.145), (53.965, 6.165)], Some([24.0, 57.0]));
    check_bounds(&ground, [(54.0, 6.0), (53.83, 6.19)], None);
}

#[test]
fn no_data_is_what_the_file_says_and_what_no_ground_can_be() {
    #[track_caller]
    fn check_void(texts: Vec<(u16, &'static str)>, void: f32, is_known: bool) {
        let folder = tempfile::tempdir().unwrap();
        let mut values: Vec<f32> = slope_m().into_iter().map(f32::from).collect();
        values[6] = void;
        write::<colortype::Gray32Float>(folder.path(), "void.tif", &Head { texts, ..head() }, &values);
        check(&open(folder.path()), 54.02, 6.01, is_known.then_some(f64::from(void)));
    }
    check_void(Vec::new(), 0.0, true);
    check_void(vec![(NO_DATA, "0")], 0.0, false);
    check_void(vec![(NO_DATA, " -32767.00 ")], 0.0, true);
    check_void(vec![(NO_DATA, "-32767")], -32767.0, false);
    check_void(vec![(NO_DATA, "nan")], f32::NAN, false);
    for void in [f32::NAN, f32::INFINITY, -9999.0, -32768.0, 3.4e38] {
        check_void(Vec::new(), void, false);
    }
}

#[test]
fn what_cannot_be_placed_or_understood_is_refused() {
    #[track_caller]
    fn check(head: &Head, expected: &str) {
        let folder = tempfile::tempdir().unwrap();
        let values = vec![0; (head.columns * head.rows) as usize];
        write::<colortype::GrayI16>(folder.path(), "a.tif", head, &values);
        check_refused(folder.path(), &format!("/a.tif: {expected}"));
    }
    let keys = |keys: &[(u16, u16)]| Head { keys: [&[MODEL, POINT, (2048, 4326)], keys].concat(), ..head() };
    check(&Head { keys: vec![(1024, 1), (2048, 4326)], ..head() }, "its model type is 1, expected 2");
    check(&Head { keys: vec![MODEL, (2048, 4979)], ..head() }, "its coordinate system is EPSG 4979, expected 4326");
    check(&Head { keys: Vec::new(), ..head() }, "its coordinate system is EPSG 0");
    check(&keys(&[(4096, 5030)]), "its heights are above an ellipsoid (EPSG 5030)");
    check(&keys(&[(4099, 9002)]), "its heights are in the unit EPSG 9002, expected 9001 (metres)");
    check(&Head { tie: vec![0.0; 5], ..head() }, "it does not say where it is");
    check(&Head { tie: vec![0.0; 12], ..head() }, "it does not say where it is");
    for scale in [[0.0, 0.01, 0.0], [-0.01, 0.01, 0.0], [f64::NAN, 0.01, 0.0], [300.0, 300.0, 0.0]] {
        check(&Head { scale, ..head() }, "its posts lie from ");
    }
    check(
        &Head { tie: vec![0.0, 0.0, 0.0, 500_000.0, 5_980_000.0, 0.0], ..head() },
        "its posts lie from 499999.995 to ",
    );
    check(&Head { columns: 1, ..head() }, "1 x 4 posts, expected 2 x 2 at least");
    check(&Head { texts: vec![(NO_DATA, "none")], ..head() }, "its value for no data is not a number");
    let scaled = r#"<GDALMetadata><Item name="SCALE" sample="0" role="scale">0.1</Item></GDALMetadata>"#;
    check(&Head { texts: vec![(42112, scaled)], ..head() }, "its values have a scale or an offset");
}

#[test]
fn a_picture_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write::<colortype::RGB8>(folder.path(), "a.tif", &head(), &[0; 60]);
    check_refused(folder.path(), "/a.tif: its values are RGB(8) of sample format 1 and");
}
