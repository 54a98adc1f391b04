//! GeoTIFF: an image whose values are heights, with tags that say where it is. The first image of a file counts; the others are coarser copies.

use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;
use tiff::{ColorType, TiffError};

use crate::grid::Grid;
use crate::tile::{Format, Tile};
use crate::{Problem, geokeys};

/// The most that is decoded at once.
const MOST_BYTES: usize = 64 << 20;
/// A tag of GDAL, with scale and offset of the values in an XML text.
const GDAL_METADATA: Tag = Tag::Unknown(42112);
/// None, LZW, deflate by its two numbers, PackBits.
const COMPRESSIONS: [u16; 5] = [1, 5, 8, 32946, 32773];
/// Of the photometric interpretation: values as they are, not inverted.
const BLACK_IS_ZERO: u16 = 1;

const BROKEN: &str = "is not a GeoTIFF that can be read";
const HELP: &str = "fetch the tile again";

type Reader = Decoder<BufReader<File>>;

/// What the tags of a file say.
pub(crate) fn head(path: &Path, file: File) -> Result<Tile, Problem> {
    guarded(|| tags(path, file))
}

fn tags(path: &Path, file: File) -> Result<Tile, Problem> {
    let mut reader = open(file)?;
    let (columns, rows) = reader.dimensions().map_err(broken)?;
    let (part_columns, part_rows) = reader.chunk_dimensions();
    values(&mut reader)?;
    let keys = reader.find_tag_unsigned_vec::<u16>(Tag::GeoKeyDirectoryTag).map_err(broken)?;
    let scale = numbers(&mut reader, Tag::ModelPixelScaleTag)?;
    let tie = numbers(&mut reader, Tag::ModelTiepointTag)?;
    let (Some(keys), [column_deg, row_deg, ..], [column, row, _, longitude, latitude, _]) =
        (keys, &scale[..], &tie[..])
    else {
        let message = "it does not say where it is: expected a pixel scale, one tie point and geographic keys";
        return Err(Problem::new(message, "write the tile again as a GeoTIFF in EPSG 4326, north up"));
    };
    // Where values are those of areas, the tie point is a corner of one.
    let half = if geokeys::is_point(&keys)? { 0.0 } else { 0.5 };
    let grid = Grid {
        north_deg: latitude + (row - half) * row_deg,
        west_deg: longitude - (column - half) * column_deg,
        row_deg: *row_deg,
        column_deg: *column_deg,
        rows,
        columns,
        part_rows: part_rows.min(rows),
        part_columns,
    };
    let no_data = text(&mut reader, Tag::GdalNodata)?;
    let no_data = no_data.map(|it| {
        let number = it.trim().parse::<f64>().map(|it| it as f32);
        number.map_err(|_| Problem::new("its value for no data is not a number", "write the tile again"))
    });
    Ok(Tile { path: path.to_owned(), grid: grid.checked()?, format: Format::GeoTiff { no_data: no_data.transpose()? } })
}

/// Refuses what is not one height for each post.
fn values(reader: &mut Reader) -> Result<(), Problem> {
    let colour = reader.colortype().map_err(broken)?;
    // A list, with one number for each value of a post.
    let mut first = |tag| {
        let numbers = reader.find_tag_unsigned_vec::<u16>(tag).map_err(broken)?;
        Ok(numbers.and_then(|it| it.first().copied()).unwrap_or(1))
    };
    let (photometric, compression) = (first(Tag::PhotometricInterpretation)?, first(Tag::Compression)?);
    let format = first(Tag::SampleFormat)?;
    let is_height = match (colour, format) {
        (ColorType::Gray(8 | 16 | 32), 1 | 2) | (ColorType::Gray(32 | 64), 3) => photometric == BLACK_IS_ZERO,
        _ => false,
    };
    if !is_height {
        let message = format!(
            "its values are {colour:?} of sample format {format} and photometric interpretation {photometric}, expected one integer of \
             8, 16 or 32 bits or one float of 32 or 64 bits for each post"
        );
        return Err(Problem::new(message, "give a model of heights, not a picture of one"));
    }
    if !COMPRESSIONS.contains(&compression) {
        let message = format!("its compression is {compression}, expected none, LZW or deflate");
        return Err(Problem::new(message, "write the tile again with deflate"));
    }
    if text(reader, GDAL_METADATA)?.is_some_and(|it| it.contains("role=\"scale\"") || it.contains("role=\"offset\"")) {
        let message = "its values have a scale or an offset, expected metres as they are";
        return Err(Problem::new(message, "write the tile again with its values in metres"));
    }
    Ok(())
}

/// A file whose posts are read.
pub(crate) struct Posts {
    reader: Reader,
    /// Bytes of each part as stored; 0: it was left out, and has no data.
    stored: Vec<u64>,
}

impl std::fmt::Debug for Posts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Posts").field("parts", &self.stored.len()).finish_non_exhaustive()
    }
}

impl Posts {
    pub(crate) fn open(file: File) -> Result<Posts, Problem> {
        guarded(|| {
            let mut reader = open(file)?;
            let mut sizes = |tag| reader.find_tag_unsigned_vec::<u64>(tag).map_err(broken);
            let stored = match sizes(Tag::TileByteCounts)? {
                Some(sizes) => sizes,
                None => sizes(Tag::StripByteCounts)?.unwrap_or_default(),
            };
            Ok(Posts { reader, stored })
        })
    }

    /// The values of a part that has `count` of them.
    pub(crate) fn part(&mut self, part: u32, count: usize) -> Result<Vec<f32>, Problem> {
        if self.stored.get(part as usize) == Some(&0) {
            return Ok(vec![f32::NAN; count]);
        }
        let values = guarded(|| self.reader.read_chunk(part).map_err(broken))?;
        Ok(match values {
            DecodingResult::U8(it) => it.into_iter().map(f32::from).collect(),
            DecodingResult::I8(it) => it.into_iter().map(f32::from).collect(),
            DecodingResult::U16(it) => it.into_iter().map(f32::from).collect(),
            DecodingResult::I16(it) => it.into_iter().map(f32::from).collect(),
            DecodingResult::U32(it) => it.into_iter().map(|it| it as f32).collect(),
            DecodingResult::I32(it) => it.into_iter().map(|it| it as f32).collect(),
            DecodingResult::F32(it) => it,
            DecodingResult::F64(it) => it.into_iter().map(|it| it as f32).collect(),
            // Refused when the folder was opened.
            DecodingResult::U64(_) | DecodingResult::I64(_) | DecodingResult::F16(_) => Vec::new(),
        })
    }
}

fn open(file: File) -> Result<Reader, Problem> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MOST_BYTES;
    limits.intermediate_buffer_size = MOST_BYTES;
    Ok(Decoder::new(BufReader::new(file)).map_err(broken)?.with_limits(limits))
}

fn numbers(reader: &mut Reader, tag: Tag) -> Result<Vec<f64>, Problem> {
    let value = reader.find_tag(tag).map_err(broken)?;
    value.map_or(Ok(Vec::new()), |it| it.into_f64_vec().map_err(broken))
}

fn text(reader: &mut Reader, tag: Tag) -> Result<Option<String>, Problem> {
    let value = reader.find_tag(tag).map_err(broken)?;
    value.map(|it| it.into_string().map_err(broken)).transpose()
}

/// The decoder multiplies some numbers of a file before it checks them; an overflow is a panic where overflows are checked.
fn guarded<T>(read: impl FnOnce() -> Result<T, Problem>) -> Result<T, Problem> {
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| Err(Problem::new(BROKEN, HELP)))
}

fn broken(error: TiffError) -> Problem {
    Problem::new(format!("{BROKEN}: {error}"), HELP)
}
