//! The posts that were read last, in a bounded memory.

use std::collections::{HashMap, HashSet};

use domain::file::Mistake;
use domain::geodesy::LatLon;

use crate::extent::Extent;
use crate::mistake;
use crate::tile::{OpenTile, Tile};

/// The most posts in memory, 128 MiB. One part of the largest size is half of that, and takes as much again while it is read.
const MOST_POSTS: usize = 1 << 25;

/// All tiles, and some of their posts.
#[derive(Debug)]
pub(crate) struct Tiles {
    list: Vec<Tile>,
    /// The file that was read last.
    open: Option<(usize, OpenTile)>,
    /// By tile and number of the part.
    parts: HashMap<(usize, u32), Part>,
    /// In all parts.
    posts: usize,
    /// Counts questions, to find the part that was used least recently.
    questions: u64,
    unreadable: HashSet<usize>,
    broken: Vec<Mistake>,
}

#[derive(Debug)]
struct Part {
    altitudes_m: Vec<f32>,
    used: u64,
}

impl Tiles {
    pub(crate) fn new(list: Vec<Tile>) -> Tiles {
        Tiles {
            list,
            open: None,
            parts: HashMap::new(),
            posts: 0,
            questions: 0,
            unreadable: HashSet::new(),
            broken: Vec::new(),
        }
    }

    /// The tiles that could not be read.
    pub(crate) fn broken(&self) -> &[Mistake] {
        &self.broken
    }

    /// Bilinear between the four posts round the place.
    pub(crate) fn altitude_m(&mut self, tile: usize, at: LatLon) -> Option<f64> {
        let (row, column) = self.list[tile].grid.position(at);
        let (rows, columns) = ([row.floor(), row.ceil()], [column.floor(), column.ceil()]);
        let mut post = |row: f64, column: f64| self.post_m(tile, row as u32, column as u32);
        let between = |a: f64, b: f64, fraction: f64| a * (1.0 - fraction) + b * fraction;
        let [north, south] = [
            [post(rows[0], columns[0])?, post(rows[0], columns[1])?],
            [post(rows[1], columns[0])?, post(rows[1], columns[1])?],
        ]
        .map(|[west, east]| between(west, east, column.fract()));
        Some(between(north, south, row.fract()))
    }

    /// The lowest and the highest known post that the ground within `area` is made of, and whether all of them are known.
    pub(crate) fn bounds_m(&mut self, tile: usize, area: Extent) -> (Option<[f64; 2]>, bool) {
        let grid = self.list[tile].grid;
        let (rows, columns) = grid.posts_round(area);
        let [mut low, mut high] = [f32::INFINITY, f32::NEG_INFINITY];
        let mut is_whole = true;
        let mut row = *rows.start();
        while row <= *rows.end() {
            let mut column = *columns.start();
            while column <= *columns.end() {
                let part = grid.part_of(row, column);
                let (part_rows, part_columns) = grid.posts_of(part);
                let last_column = *part_columns.end().min(columns.end());
                let Some(altitudes_m) = self.part(tile, part) else { return (None, false) };
                let width = part_columns.clone().count();
                for row in row..=*part_rows.end().min(rows.end()) {
                    let begin = (row - part_rows.start()) as usize * width;
                    let [first, last] = [column, last_column].map(|it| (it - part_columns.start()) as usize);
                    for altitude_m in &altitudes_m[begin + first..=begin + last] {
                        is_whole &= !altitude_m.is_nan();
                        // Of a number and NaN the number.
                        (low, high) = (low.min(*altitude_m), high.max(*altitude_m));
                    }
                }
                column = last_column + 1;
            }
            row = *grid.posts_of(grid.part_of(row, *columns.start())).0.end() + 1;
        }
        ((low <= high).then_some([low, high].map(f64::from)), is_whole)
    }

    fn post_m(&mut self, tile: usize, row: u32, column: u32) -> Option<f64> {
        let grid = self.list[tile].grid;
        let part = grid.part_of(row, column);
        let (rows, columns) = grid.posts_of(part);
        let width = columns.clone().count();
        let index = (row - rows.start()) as usize * width + (column - columns.start()) as usize;
        self.part(tile, part).map(|it| f64::from(it[index])).filter(|it| !it.is_nan())
    }

    /// `None` if the tile is broken.
    fn part(&mut self, tile: usize, part: u32) -> Option<&[f32]> {
        self.questions += 1;
        let key = (tile, part);
        if !self.parts.contains_key(&key) {
            let altitudes_m = self.read(tile, part)?;
            self.make_room(altitudes_m.len());
            self.posts += altitudes_m.len();
            self.parts.insert(key, Part { altitudes_m, used: self.questions });
        }
        let found = self.parts.get_mut(&key)?;
        found.used = self.questions;
        Some(&found.altitudes_m)
    }

    fn read(&mut self, tile: usize, part: u32) -> Option<Vec<f32>> {
        if self.unreadable.contains(&tile) {
            return None;
        }
        let of_tile = &self.list[tile];
        let open =
            self.open.take().filter(|(of, _)| *of == tile).map_or_else(|| OpenTile::open(of_tile), |it| Ok(it.1));
        let read = open.and_then(|mut open| open.read(of_tile, part).map(|it| (it, open)));
        match read {
            Ok((posts, open)) => {
                self.open = Some((tile, open));
                Some(posts)
            }
            Err(problem) => {
                self.broken.push(mistake(&of_tile.path, problem.message, problem.help));
                self.unreadable.insert(tile);
                None
            }
        }
    }

    fn make_room(&mut self, count: usize) {
        while MOST_POSTS < self.posts + count
            && let Some(oldest) = self.parts.iter().min_by_key(|it| it.1.used).map(|it| *it.0)
            && let Some(part) = self.parts.remove(&oldest)
        {
            self.posts -= part.altitudes_m.len();
        }
    }
}
