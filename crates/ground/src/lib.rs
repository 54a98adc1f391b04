//! How high the ground is, from a folder of tiles that others publish: SRTM (`.hgt`) and GeoTIFF (`.tif`, `.tiff`).
//!
//! A tile is a grid of *posts*, places with a height. [`Ground::open`] reads what a tile says of itself and refuses a tile that it cannot
//! place; posts are read when somebody asks for the ground there. Heights are taken to be above mean sea level as they are: those
//! of SRTM are above the geoid EGM96, which is that within a metre or two.
//!
//! Tiles may overlap: the finer one counts, and the coarser one where the finer one has no data.

use std::cell::RefCell;
use std::fs::File;
use std::path::{Path, PathBuf};

use domain::file::{Mistake, Mistakes};
use domain::geodesy::LatLon;
use domain::ground::GroundModel;

use crate::extent::Extent;
use crate::tile::Tile;
use crate::tiles::Tiles;

mod extent;
mod geokeys;
mod geotiff;
mod grid;
mod hgt;
mod tile;
mod tiles;

/// The most tiles in a folder: Europe has 1,500 of a degree each.
const MOST_TILES: usize = 2_000;

/// A folder of tiles.
#[derive(Debug)]
pub struct Ground {
    /// The first one that knows a place counts.
    layers: Vec<Layer>,
    tiles: RefCell<Tiles>,
}

/// Where a tile counts.
#[derive(Debug, Clone, Copy)]
struct Layer {
    extent: Extent,
    /// Its index.
    tile: usize,
}

impl Ground {
    /// Reads what the tiles in `folder` say of themselves. Other files and folders in it do not matter, but packed ones do: a tile that is
    /// left out must not look like ground that nobody knows.
    ///
    /// # Errors
    /// If the folder cannot be read, has no tile or too many, or a tile is packed, broken, or in a form that is not read.
    pub fn open(folder: &Path) -> Result<Ground, Mistakes> {
        let unreadable = |error: std::io::Error| {
            let help = "give a folder of SRTM tiles (.hgt) or GeoTIFF (.tif)";
            Mistakes(vec![mistake(folder, format!("cannot be read: {error}"), help)])
        };
        let mut mistakes = Mistakes::default();
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            match Kind::of(&path) {
                Some(Kind::Packed) => mistakes.push(mistake(&path, "a packed file", "unpack it, or move it elsewhere")),
                Some(_) => paths.push(path),
                None => {}
            }
        }
        if MOST_TILES < paths.len() {
            let message = format!("{} tiles, expected at most {MOST_TILES}", paths.len());
            return Err(Mistakes(vec![mistake(folder, message, "give a folder with those round the mission")]));
        }
        if paths.is_empty() && mistakes.0.is_empty() {
            let message = "no tile of the ground is in it";
            return Err(Mistakes(vec![mistake(folder, message, "give a folder with files N54E006.hgt or .tif")]));
        }
        // Of two tiles that are equally fine, the one whose name comes first.
        paths.sort();
        let mut tiles = Vec::new();
        for path in paths {
            match read_head(&path) {
                Ok(tile) => tiles.push(tile),
                Err(Problem { message, help }) => mistakes.push(mistake(&path, message, help)),
            }
        }
        mistakes.or(())?;
        Ok(Ground { layers: layers(&tiles), tiles: RefCell::new(Tiles::new(tiles)) })
    }

    /// The tiles that turned out to be broken when their posts were read. Ask after the last question: where they are, the ground was said not
    /// to be known.
    ///
    /// # Errors
    /// A mistake for each broken tile.
    pub fn check_tiles_read(&self) -> Result<(), Mistakes> {
        Mistakes(self.tiles.borrow().broken().to_vec()).or(())
    }

    /// As [`GroundModel::bounds_m`], by the layers from the first of `layers` on.
    fn bounds_within(&self, layers: &[Layer], area: Extent) -> Option<[f64; 2]> {
        let (index, (layer, inside)) = layers
            .iter()
            .enumerate()
            .find_map(|(index, layer)| Some((index, (layer, area.intersection(layer.extent)?))))?;
        let others = &layers[index + 1..];
        let mut found = Vec::new();
        let (known, is_whole) = self.tiles.borrow_mut().bounds_m(layer.tile, inside);
        found.extend(known);
        if !is_whole {
            found.push(self.bounds_within(others, inside)?);
        }
        for rest in area.without(inside) {
            found.push(self.bounds_within(others, rest)?);
        }
        found.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}

impl GroundModel for Ground {
    /// Between posts it is bilinear. It is not known if one of the four posts round the place has no data.
    fn altitude_m(&self, at: LatLon) -> Option<f64> {
        let mut tiles = self.tiles.borrow_mut();
        self.layers.iter().filter(|it| it.extent.contains(at)).find_map(|it| tiles.altitude_m(it.tile, at))
    }

    fn bounds_m(&self, corners: &[LatLon]) -> Option<[f64; 2]> {
        let parts = Extent::of(corners).into_iter().map(|it| self.bounds_within(&self.layers, it));
        let parts: Vec<[f64; 2]> = parts.collect::<Option<_>>()?;
        parts.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }
}

/// The finer tile first. Half a step beyond its outermost posts a tile counts where no other does: tiles that are published without the posts of
/// their neighbours leave such a gap.
fn layers(tiles: &[Tile]) -> Vec<Layer> {
    let mut order: Vec<usize> = (0..tiles.len()).collect();
    order.sort_by(|a, b| tiles[*a].grid.cell_deg2().total_cmp(&tiles[*b].grid.cell_deg2()));
    let within = order.iter().map(|it| Layer { extent: tiles[*it].grid.extent(0.0), tile: *it });
    let beside = order.iter().map(|it| Layer { extent: tiles[*it].grid.extent(0.5), tile: *it });
    within.chain(beside).collect()
}

/// What a file is, by its name.
enum Kind {
    Hgt,
    GeoTiff,
    Packed,
}

impl Kind {
    fn of(path: &Path) -> Option<Kind> {
        match path.extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
            "hgt" => Some(Kind::Hgt),
            "tif" | "tiff" => Some(Kind::GeoTiff),
            "zip" | "gz" | "tgz" | "bz2" | "xz" | "7z" | "tar" => Some(Kind::Packed),
            _ => None,
        }
    }
}

fn read_head(path: &Path) -> Result<Tile, Problem> {
    let file = open(path)?;
    match Kind::of(path) {
        Some(Kind::Hgt) => hgt::head(path, &file),
        _ => geotiff::head(path, file),
    }
}

/// A regular file: a pipe would hold the process up.
fn open(path: &Path) -> Result<File, Problem> {
    regular_file::open(path).map_err(unreadable)
}

/// What is wrong with a tile, and what to do.
#[derive(Debug)]
struct Problem {
    message: String,
    help: &'static str,
}

impl Problem {
    fn new(message: impl Into<String>, help: &'static str) -> Problem {
        Problem { message: message.into(), help }
    }
}

fn unreadable(error: std::io::Error) -> Problem {
    Problem::new(format!("cannot be read: {error}"), "fetch the tile again")
}

fn mistake(path: &Path, message: impl Into<String>, help: &str) -> Mistake {
    Mistake { path: PathBuf::from(path), place: None, message: message.into(), help: help.into() }
}
