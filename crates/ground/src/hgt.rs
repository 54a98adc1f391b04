//! SRTM tiles: a square of 1 degree, rows from north to south, each post two bytes with the high one first. Neither size nor place stands in the
//! file: its name is the latitude and longitude of its south-western corner.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use crate::grid::Grid;
use crate::tile::{Format, Tile};
use crate::{Problem, unreadable};

/// Posts in a row: of three arc seconds, and of one. Neighbours share the posts at their border.
const SIDES: [u32; 2] = [1_201, 3_601];
/// Rows that are read at once.
const PART_ROWS: u32 = 16;

/// What a file says by its name and its size.
pub(crate) fn head(path: &Path, file: &File) -> Result<Tile, Problem> {
    let name = path.file_name().map(|it| it.to_string_lossy()).unwrap_or_default();
    let (south_deg, west_deg) = corner(&name).ok_or_else(|| {
        Problem::new("its name is not that of an SRTM tile", "name it by its south-western corner, as in N54E006.hgt")
    })?;
    let size = file.metadata().map_err(unreadable)?.len();
    let bytes = |side: u32| u64::from(side) * u64::from(side) * 2;
    let side = SIDES.into_iter().find(|it| bytes(*it) == size).ok_or_else(|| {
        let [coarse, fine] = SIDES.map(bytes);
        Problem::new(format!("has {size} bytes, expected {coarse} or {fine}"), "fetch the tile again, and unpack it")
    })?;
    let step_deg = 1.0 / f64::from(side - 1);
    let grid = Grid {
        north_deg: south_deg + 1.0,
        west_deg,
        row_deg: step_deg,
        column_deg: step_deg,
        rows: side,
        columns: side,
        part_rows: PART_ROWS,
        part_columns: side,
    };
    Ok(Tile { path: path.to_owned(), grid: grid.checked()?, format: Format::Hgt })
}

/// Degrees north and east, of `N54E006.hgt` or `N54E006.SRTMGL1.hgt`.
fn corner(name: &str) -> Option<(f64, f64)> {
    let (stem, _) = name.split_once('.')?;
    let degrees = |text: &str, positive: char, negative: char, most: f64| {
        let (side, digits) = (text.chars().next()?.to_ascii_uppercase(), text.get(1..)?);
        let sign = [(positive, 1.0), (negative, -1.0)].into_iter().find(|it| it.0 == side)?.1;
        let all_digits = digits.bytes().all(|it| it.is_ascii_digit());
        let degrees: f64 = digits.parse().ok().filter(|_| all_digits)?;
        // The square reaches a degree farther north and east.
        Some(sign * degrees).filter(|it| -most <= *it && *it < most)
    };
    let [north, east] = [stem.get(..3)?, stem.get(3..).filter(|it| it.len() == 4)?];
    Some((degrees(north, 'N', 'S', 90.0)?, degrees(east, 'E', 'W', 180.0)?))
}

/// The posts of a part.
pub(crate) fn part(file: &mut File, grid: &Grid, part: u32) -> Result<Vec<f32>, Problem> {
    let (rows, columns) = grid.posts_of(part);
    let begin = u64::from(*rows.start()) * u64::from(grid.columns) * 2;
    let mut bytes = vec![0; rows.count() * columns.count() * 2];
    file.seek(SeekFrom::Start(begin)).and_then(|_| file.read_exact(&mut bytes)).map_err(unreadable)?;
    // -32768 stands for no data, and is lower than any ground.
    let altitude = |it: &[u8]| f32::from(i16::from_be_bytes([it[0], it[1]]));
    Ok(bytes.chunks_exact(2).map(altitude).collect())
}
