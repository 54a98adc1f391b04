//! The pair matrix: which row responds to each ordered pair, and whether its flights have shown it; as text, as a picture, as a page.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Duration;

use domain::contingency::{Contingencies, Moment, Phase, Raised, Severity, responder};
use domain::situation::Situation;
use simulation::proof::classes;
use simulation::proof::flight::Flown;
use simulation::proof::stage::Stage;

use super::proof::{Proof, case};
use crate::plan::escape;

/// The moment for which the picture is drawn.
const ON_THE_WAY: Moment = Moment { situation: Situation::Flying, phase: Phase::Cruise };
/// Side of a cell of the picture, in pixels.
const CELL: usize = 12;
/// Room for the names of rows.
const NAMES: usize = 190;

/// What a cell shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cell {
    /// A row and itself.
    Same,
    /// This one is answered, and every flight of their kinds has shown it; `None`: neither counts on the way.
    Shown(Option<usize>),
    /// The same, and none was flown.
    NotFlown(Option<usize>),
    /// A flight has something against it.
    Faulty,
}

/// The matrix of a table.
pub struct Matrix<'a> {
    table: &'a Contingencies,
    /// For each pair of rows that was flown its flights.
    flights: BTreeMap<(usize, usize), Vec<&'a Flown>>,
    /// For each row the first and the last one of its kind.
    kinds: Vec<(usize, usize)>,
}

impl<'a> Matrix<'a> {
    /// Of what was flown.
    pub fn of(table: &'a Contingencies, proof: &'a Proof) -> Matrix<'a> {
        let mut flights: BTreeMap<(usize, usize), Vec<&Flown>> = BTreeMap::new();
        for flown in &proof.flown {
            let second = flown.case.second.map_or(flown.case.first, |(row, _)| row);
            flights.entry((flown.case.first, second)).or_default().push(flown);
        }
        let mut kinds = vec![(0, 0); table.rows().len()];
        for class in classes(table) {
            for row in &class {
                kinds[*row] = (class[0], class[class.len() - 1]);
            }
        }
        Matrix { table, flights, kinds }
    }

    /// The rows that were flown for this pair.
    fn flown_as(&self, first: usize, second: usize) -> (usize, usize) {
        let (one, other) = (self.kinds[first], self.kinds[second]);
        if one == other { (one.0, one.1) } else { (one.0, other.0) }
    }

    fn flights(&self, first: usize, second: usize) -> &[&'a Flown] {
        self.flights.get(&self.flown_as(first, second)).map_or(&[], Vec::as_slice)
    }

    fn cell(&self, first: usize, second: usize) -> Cell {
        if first == second {
            return Cell::Same;
        }
        let up = |row| Raised { row, overrides: false, is_overridden: false, under_way: None };
        let answered = responder(self.table.rows(), [up(first), up(second)], ON_THE_WAY);
        match self.flights(first, second) {
            [] => Cell::NotFlown(answered),
            flights if flights.iter().any(|it| !it.faults.is_empty()) => Cell::Faulty,
            _ => Cell::Shown(answered),
        }
    }

    /// As text: a line for each first flag, a column for each second one.
    pub fn text(&self) -> String {
        let rows = self.table.rows();
        let mut text = String::from(
            "pairs (line: first flag; column: second): 1 the first is answered, 2 the second, - neither counts on the way, \
             ! breach, a b c: the same as 1 2 -, not flown\n",
        );
        let width = rows.iter().map(|it| it.flag.len()).max().unwrap_or_default();
        for (first, row) in rows.iter().enumerate() {
            let cells: String = (0..rows.len()).map(|second| self.letter(first, second)).collect();
            let _ = writeln!(text, "{:3} {:width$} {cells}", first + 1, row.flag);
        }
        text
    }

    fn letter(&self, first: usize, second: usize) -> char {
        let place = |answered: Option<usize>, letters: [char; 3]| match answered {
            Some(row) if row == first => letters[0],
            Some(_) => letters[1],
            None => letters[2],
        };
        match self.cell(first, second) {
            Cell::Same => ' ',
            Cell::Faulty => '!',
            Cell::Shown(answered) => place(answered, ['1', '2', '-']),
            Cell::NotFlown(answered) => place(answered, ['a', 'b', 'c']),
        }
    }

    /// As a picture: the color of a cell says how severe the response is.
    pub fn picture(&self, has_links: bool) -> String {
        let rows = self.table.rows();
        let side = rows.len() * CELL;
        let (width, height) = (NAMES + side + 10, NAMES + side + 40);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"system-ui,sans-serif\" font-size=\"9\" \
             role=\"img\" aria-label=\"which row responds to each pair of flags\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
        );
        for (number, row) in rows.iter().enumerate() {
            let at = NAMES + number * CELL;
            let (x, y, name) = (NAMES - 4, at + CELL - 3, escape(&row.flag));
            let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"end\">{name}</text>");
            let _ = writeln!(svg, "<text transform=\"translate({y},{x}) rotate(-90)\">{name}</text>");
        }
        svg += &if has_links { self.linked_cells() } else { self.plain_cells() };
        let mut x = NAMES;
        for severity in Severity::ALL {
            let (y, color, name) = (NAMES + side + 15, color(severity), severity.name());
            let _ = writeln!(svg, "<rect x=\"{x}\" y=\"{y}\" width=\"10\" height=\"10\" fill=\"{color}\"/>");
            let _ = writeln!(svg, "<text x=\"{}\" y=\"{}\">{name}</text>", x + 14, y + 9);
            x += 58;
        }
        svg + "</svg>\n"
    }

    /// Each with its words, and a link to its story.
    fn linked_cells(&self) -> String {
        let mut cells = String::new();
        for (first, second) in self.pairs() {
            let (x, y) = (NAMES + second * CELL, NAMES + first * CELL);
            let (color, opacity, what) = self.drawn(first, second);
            let rect = format!(
                "<rect x=\"{x}\" y=\"{y}\" width=\"{0}\" height=\"{0}\" fill=\"{color}\" fill-opacity=\"{opacity}\"><title>{1}</title></rect>",
                CELL - 1,
                escape(&what)
            );
            let (one, other) = self.flown_as(first, second);
            let _ = match self.flights(first, second).is_empty() {
                false => writeln!(cells, "<a href=\"#p{one}-{other}\">{rect}</a>"),
                true => writeln!(cells, "{rect}"),
            };
        }
        cells
    }

    /// Squares alone, all of a color in one path: a picture that is small enough for a page of the documentation.
    fn plain_cells(&self) -> String {
        let (mut paths, side) = (BTreeMap::<_, String>::new(), CELL - 1);
        for (first, second) in self.pairs() {
            let (x, y) = (NAMES + second * CELL, NAMES + first * CELL);
            let (color, opacity, _) = self.drawn(first, second);
            let _ = write!(paths.entry((color, opacity)).or_default(), "M{x} {y}h{side}v{side}h-{side}z");
        }
        let path =
            |((color, opacity), path)| format!("<path fill=\"{color}\" fill-opacity=\"{opacity}\" d=\"{path}\"/>\n");
        paths.into_iter().map(path).collect()
    }

    /// Every pair of rows, line by line.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        let count = self.table.rows().len();
        (0..count).flat_map(move |first| (0..count).map(move |second| (first, second)))
    }

    fn drawn(&self, first: usize, second: usize) -> (&'static str, &'static str, String) {
        let rows = self.table.rows();
        let names = format!("{}, then {}", rows[first].flag, rows[second].flag);
        let of = |answered: Option<usize>| match answered {
            Some(row) => {
                (color(rows[row].severity()), format!("{names}: {} by {}", rows[row].response(), rows[row].flag))
            }
            None => ("#eceff1", format!("{names}: neither counts on the way")),
        };
        match self.cell(first, second) {
            Cell::Same => ("#ffffff", "1", rows[first].flag.clone()),
            Cell::Faulty => ("#d50000", "1", format!("{names}: breach")),
            Cell::Shown(answered) => {
                let (color, what) = of(answered);
                (color, "1", what)
            }
            Cell::NotFlown(answered) => {
                let (color, what) = of(answered);
                (color, "0.35", what + " (not flown)")
            }
        }
    }

    /// As a page that needs nothing else: the picture, and the story behind each cell.
    pub fn page(&self) -> String {
        let mut page = String::from(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Every pair of contingencies</title>\n<style>\n\
             body{font:15px/1.4 system-ui,sans-serif;max-width:80rem;margin:2rem auto;padding:0 1rem;color:#1a2a33}\n\
             svg{width:100%;height:auto}pre{background:#f5f9fb;padding:.5rem;overflow-x:auto}.breach{color:#b3261e}\n\
             </style>\n</head>\n<body>\n<h1>Every pair of contingencies</h1>\n\
             <p>Line: the flag that is raised first; column: the second. The color says what is flown on the way. A cell leads to its \
             flights; rows that nothing but their name and place tells apart are flown once.</p>\n",
        );
        page += &self.picture(true);
        for ((first, second), flights) in &self.flights {
            let rows = self.table.rows();
            let names = if first == second {
                format!("`{}` alone", rows[*first].flag)
            } else {
                format!("`{}`, then `{}`", rows[*first].flag, rows[*second].flag)
            };
            let _ = writeln!(page, "<details id=\"p{first}-{second}\"><summary>{}</summary>", escape(&names));
            for flown in flights {
                page += &self.story(flown);
            }
            page += "</details>\n";
        }
        page + "</body>\n</html>\n"
    }

    /// A line for a flight; on the way, and of one with a breach, with every decision.
    fn story(&self, flown: &Flown) -> String {
        let class = if flown.faults.is_empty() { "" } else { " class=\"breach\"" };
        let mut text = format!("<p{class}>{}: {}", escape(&case(self.table, &flown.case)), escape(&flown.ending));
        for fault in &flown.faults {
            let _ = write!(text, "<br>breach: {}", escape(fault));
        }
        text += "</p>\n";
        let is_told =
            flown.case.stage == Stage::Cruise && flown.case.second.is_none_or(|(_, gap)| gap == Duration::from_secs(2));
        if is_told || !flown.faults.is_empty() {
            let _ = writeln!(text, "<pre>{}</pre>", escape(&flown.story.join("\n")));
        }
        text
    }
}

fn color(severity: Severity) -> &'static str {
    match severity {
        Severity::Hold => "#90caf9",
        Severity::Leave => "#80cbc4",
        Severity::Slow => "#c5e1a5",
        Severity::Return => "#fff176",
        Severity::Divert => "#ffb74d",
        Severity::Avoid => "#ff8a65",
        Severity::Land => "#f06292",
        Severity::Ditch => "#8d6e63",
        Severity::Terminate => "#37474f",
        Severity::Yield => "#b39ddb",
    }
}
