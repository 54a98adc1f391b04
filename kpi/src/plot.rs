//! The figures, as SVG.

use std::fmt::Write;
use std::path::Path;

use crate::Measured;
use crate::analysis::{Class, Samples};

/// A set of points over numbered places.
struct Series {
    name: String,
    colour: &'static str,
    points: Vec<(f64, f64)>,
}

const COLOURS: [&str; 4] = ["#1b6ca8", "#d1495b", "#2e8b57", "#8a5a00"];

/// Draws every figure into `folder`.
pub(crate) fn draw(it: &Measured, folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    for (number, tick) in it.ticks.iter().enumerate() {
        let series = [("flat", &tick.flat), ("nested, 4 groups of 4", &tick.nested)];
        let series: Vec<Series> = series
            .iter()
            .zip(COLOURS)
            .map(|((name, samples), colour)| Series { name: (*name).to_owned(), colour, points: by_flag(samples) })
            .collect();
        let title = format!("Flag to action inside the mission manager, tick period {} ms", tick.tick_ms);
        let svg = scatter(&title, "flag", "microseconds", &series);
        std::fs::write(folder.join(format!("figure-5-{}.svg", 3 + number)), svg)?;
    }
    let series: Vec<Series> = it
        .ticks
        .iter()
        .zip(COLOURS)
        .map(|(tick, colour)| {
            let classes = [Class::N2N, Class::N2T, Class::T2N].iter().enumerate();
            let points = classes.flat_map(|(x, class)| spread(x as f64, tick.mission.of_class(*class), 1e6)).collect();
            Series { name: format!("{} ms", tick.tick_ms), colour, points }
        })
        .collect();
    let svg = scatter("Transitions inside the mission manager", "N2N, N2T, T2N", "microseconds", &series);
    std::fs::write(folder.join("table-5-1.svg"), svg)
}

fn by_flag(samples: &Samples) -> Vec<(f64, f64)> {
    let number = |flag: &str| flag.rsplit('_').next().and_then(|it| it.parse().ok()).unwrap_or(0.0);
    samples.reactions.iter().map(|it| (number(&it.flag), it.tick_to_action_s * 1e6)).collect()
}

/// Side by side around `x`, so that equal ones can be told apart.
fn spread(x: f64, values: Vec<f64>, unit: f64) -> impl Iterator<Item = (f64, f64)> {
    let count = values.len().max(1) as f64;
    values.into_iter().enumerate().map(move |(index, it)| (x + (index as f64 / count - 0.5) * 0.6, it * unit))
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 400.0;
const MARGIN: f64 = 60.0;

/// Points and, for each series, its mean as a line. The vertical axis begins at zero.
fn scatter(title: &str, x_axis: &str, y_axis: &str, series: &[Series]) -> String {
    let all = || series.iter().flat_map(|it| &it.points);
    let x_most = all().map(|it| it.0).fold(1.0, f64::max) + 0.5;
    let y_most = nice(all().map(|it| it.1).fold(0.0, f64::max));
    let x_at = |x: f64| MARGIN + (x + 0.5) / (x_most + 0.5) * (WIDTH - 1.5 * MARGIN);
    let y_at = |y: f64| HEIGHT - MARGIN - y / y_most * (HEIGHT - 2.0 * MARGIN);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let mut text = |x: f64, y: f64, anchor: &str, it: &str| {
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{it}</text>");
    };
    text(WIDTH / 2.0, 24.0, "middle", title);
    text(WIDTH / 2.0, HEIGHT - 16.0, "middle", x_axis);
    text(MARGIN, 44.0, "middle", y_axis);
    for step in 0..=4 {
        let y = y_most * f64::from(step) / 4.0;
        text(MARGIN - 6.0, y_at(y) + 4.0, "end", &format!("{y}"));
    }
    for (index, it) in series.iter().enumerate() {
        text(WIDTH - 120.0 * (series.len() - index) as f64, 44.0, "start", &format!("● {}", it.name));
    }
    for step in 0..=4 {
        let y = y_at(y_most * f64::from(step) / 4.0);
        let _ = writeln!(svg, "<path d=\"M{MARGIN} {y:.1}H{:.1}\" stroke=\"#ddd\"/>", WIDTH - MARGIN / 2.0);
    }
    for it in series {
        for (x, y) in &it.points {
            let (x, y, colour) = (x_at(*x), y_at(*y), it.colour);
            let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{colour}\" opacity=\"0.6\"/>");
        }
        if !it.points.is_empty() {
            let mean = it.points.iter().map(|it| it.1).sum::<f64>() / it.points.len() as f64;
            let (y, right, colour) = (y_at(mean), WIDTH - MARGIN / 2.0, it.colour);
            let _ = writeln!(svg, "<path d=\"M{MARGIN} {y:.1}H{right:.1}\" stroke=\"{colour}\" stroke-width=\"1.5\"/>");
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// A round number, no less than `most`.
fn nice(most: f64) -> f64 {
    let magnitude = 10f64.powf(most.max(1e-9).log10().floor());
    [1.0, 2.0, 4.0, 8.0, 10.0].map(|it| it * magnitude).into_iter().find(|it| most <= *it).unwrap_or(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_drawn_and_the_axis_ends_at_a_round_number() {
        let series = [Series { name: "flat".into(), colour: COLOURS[0], points: vec![(0.0, 3.0), (15.0, 4.5)] }];
        let svg = scatter("title", "flag", "microseconds", &series);
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(svg.contains(">8</text>"), "{svg}");
        assert_eq!(nice(0.0), 1e-9);
    }
}
