//! A file of posts.

use std::path::PathBuf;

use crate::grid::Grid;
use crate::{Problem, geotiff, hgt};

/// No ground lies lower or higher, in metres: such a post has no data, whether the file says so or not. (The shore of the Dead Sea is at
/// -430 m, Mount Everest at 8,849 m.)
const GROUND_M: std::ops::RangeInclusive<f32> = -500.0..=9_000.0;

/// What a file says of itself.
#[derive(Debug)]
pub(crate) struct Tile {
    pub(crate) path: PathBuf,
    pub(crate) grid: Grid,
    pub(crate) format: Format,
}

/// How its posts are stored.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Format {
    /// SRTM.
    Hgt,
    /// GeoTIFF; a post of this value has no data.
    GeoTiff {
        /// As the file says.
        no_data: Option<f32>,
    },
}

/// A tile whose posts are being read.
#[derive(Debug)]
pub(crate) enum OpenTile {
    Hgt(std::fs::File),
    GeoTiff(Box<geotiff::Posts>),
}

impl OpenTile {
    pub(crate) fn open(tile: &Tile) -> Result<OpenTile, Problem> {
        let file = crate::open(&tile.path)?;
        Ok(match tile.format {
            Format::Hgt => OpenTile::Hgt(file),
            Format::GeoTiff { .. } => OpenTile::GeoTiff(Box::new(geotiff::Posts::open(file)?)),
        })
    }

    /// The altitudes of a part, row by row; NaN where there is no data.
    pub(crate) fn read(&mut self, tile: &Tile, part: u32) -> Result<Vec<f32>, Problem> {
        let (rows, columns) = tile.grid.posts_of(part);
        let count = rows.count() * columns.count();
        let mut posts = match self {
            OpenTile::Hgt(file) => hgt::part(file, &tile.grid, part)?,
            OpenTile::GeoTiff(posts) => posts.part(part, count)?,
        };
        // The file may be another one by now.
        if posts.len() != count {
            let message = format!("part {part} has {} posts, expected {count}", posts.len());
            return Err(Problem::new(message, "leave the folder alone while it is read"));
        }
        let no_data = match tile.format {
            Format::Hgt => None,
            Format::GeoTiff { no_data } => no_data,
        };
        for post in &mut posts {
            if !GROUND_M.contains(post) || Some(*post) == no_data {
                *post = f32::NAN;
            }
        }
        Ok(posts)
    }
}
