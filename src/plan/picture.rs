//! A forecast as a drawing: areas, legs, objectives and sites from above, north up.

use std::fmt::Write;

use kittiwake_proto::v1;

use super::html::escape;

/// Width and height of the drawing, in the units of its strokes and letters.
const SIZE: f64 = 1000.0;
/// Room around what is drawn, as a share of its extent.
const ROOM: f64 = 0.08;

/// Maps metres to the drawing.
pub struct Scale {
    north_m: f64,
    east_m: f64,
    per_m: f64,
}

impl Scale {
    /// One for a drawing of 1000 by 1000 that shows the take-off point and these points, each its metres north and east.
    pub fn of(points: &[(f64, f64)]) -> Scale {
        let bounds = |of: fn(&(f64, f64)) -> f64| {
            let values = || points.iter().map(of);
            (values().fold(0.0, f64::min), values().fold(0.0, f64::max))
        };
        let ((south_m, north_m), (west_m, east_m)) = (bounds(|it| it.0), bounds(|it| it.1));
        let extent_m = (north_m - south_m).max(east_m - west_m).max(50.0);
        let room_m = extent_m * ROOM;
        let per_m = SIZE / (extent_m + 2.0 * room_m);
        // In the middle of the square.
        let (middle_north_m, middle_east_m) = (f64::midpoint(south_m, north_m), f64::midpoint(west_m, east_m));
        let half_m = extent_m / 2.0 + room_m;
        Scale { north_m: middle_north_m + half_m, east_m: middle_east_m - half_m, per_m }
    }

    /// Where a point is in the drawing: to the right, and down.
    pub fn at(&self, (north_m, east_m): (f64, f64)) -> (f64, f64) {
        ((east_m - self.east_m) * self.per_m, (self.north_m - north_m) * self.per_m)
    }
}

/// The corners of an area's outline, then those of each hole.
fn rings(area: &v1::Area) -> impl Iterator<Item = &[v1::Ned]> {
    std::iter::once(&area.corners).chain(area.holes.iter().map(|it| &it.corners)).map(Vec::as_slice)
}

/// Those of them that a drawing shows whole: what is round a hole may end far away.
fn shown(area: &v1::Area) -> impl Iterator<Item = &[v1::Ned]> {
    rings(area).skip(usize::from(!area.holes.is_empty()))
}

/// The drawing as an SVG element.
pub(super) fn draw(reply: &v1::MissionReply) -> String {
    let status = reply.status.clone().unwrap_or_default();
    let place = |it: &v1::Ned| (it.north_m, it.east_m);
    let corners = status.areas.iter().flat_map(shown).flatten().map(place);
    let legs: Vec<&v1::LegForecast> = reply.forecast.iter().flat_map(|it| &it.legs).collect();
    let ends = legs.iter().flat_map(|it| [&it.from, &it.to]).flatten().map(place);
    let places = status.objectives.iter().filter_map(|it| it.position.as_ref().map(place));
    let sites = status.sites.iter().filter_map(|it| it.position.as_ref().map(place));
    let points: Vec<(f64, f64)> = corners.chain(ends).chain(places).chain(sites).collect();
    let scale = Scale::of(&points);
    let mut svg =
        format!("<svg viewBox=\"0 0 {SIZE} {SIZE}\" role=\"img\" aria-label=\"areas, legs, objectives and sites\">\n");
    for area in &status.areas {
        let corner = |it: &v1::Ned| {
            let (x, y) = scale.at(place(it));
            format!("{x:.1} {y:.1}")
        };
        let ring = |ring: &[v1::Ned]| format!("M{}Z", ring.iter().map(corner).collect::<Vec<_>>().join("L"));
        let kind = if area.kind() == v1::AreaKind::KeepOut { "keep-out" } else { "permission" };
        let path: String = rings(area).map(ring).collect();
        let _ = writeln!(svg, "<path class=\"{kind}\" fill-rule=\"evenodd\" d=\"{path}\"/>");
        if let Some((x, y)) = shown(area).flatten().next().map(|it| scale.at(place(it))) {
            let _ = writeln!(svg, "<text class=\"area\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", escape(&area.name));
        }
    }
    for leg in &legs {
        if let (Some(from), Some(to)) = (&leg.from, &leg.to) {
            let ((x1, y1), (x2, y2)) = (scale.at(place(from)), scale.at(place(to)));
            let _ = writeln!(
                svg,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"><title>{}</title></line>",
                escape(&leg.text)
            );
        }
    }
    let (x, y) = scale.at((0.0, 0.0));
    let _ =
        writeln!(svg, "<rect class=\"home\" x=\"{:.1}\" y=\"{:.1}\" width=\"14\" height=\"14\"/>", x - 7.0, y - 7.0);
    for site in &status.sites {
        let Some(position) = site.position else { continue };
        let (x, y) = scale.at(place(&position));
        let class = if site.kind() == v1::SiteKind::Ditch { "ditch" } else { "landing" };
        let _ = writeln!(
            svg,
            "<rect class=\"{class}\" x=\"{:.1}\" y=\"{:.1}\" width=\"14\" height=\"14\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            x - 7.0,
            y - 7.0,
            x + 12.0,
            y + 6.0,
            escape(&site.name)
        );
    }
    for (number, objective) in (1..).zip(&reply.forecast) {
        let known = status.objectives.iter().find(|it| it.name == objective.objective);
        let Some(position) = known.and_then(|it| it.position) else { continue };
        let (x, y) = scale.at(place(&position));
        let class = if objective.reachable { "reached" } else { "missed" };
        let _ = writeln!(
            svg,
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\"/>\n<text x=\"{:.1}\" y=\"{:.1}\">{number} {}</text>",
            x + 12.0,
            y - 6.0,
            escape(&objective.objective)
        );
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_is_open_and_as_large_as_the_picture_whatever_is_round_it() {
        let ring = |side_m: f64| {
            let corners = [(-side_m, -side_m), (side_m, -side_m), (side_m, side_m), (-side_m, side_m)];
            corners.map(|(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 }).to_vec()
        };
        let holes = vec![v1::Ring { corners: ring(100.0) }];
        let area = v1::Area { name: "F".into(), corners: ring(140e3), holes, ..Default::default() };
        let status = v1::MissionStatus { areas: vec![area], ..Default::default() };
        let svg = draw(&v1::MissionReply { status: Some(status), ..Default::default() });
        let hole = "M69.0 931.0L69.0 69.0L931.0 69.0L931.0 931.0Z\"/>";
        assert!(svg.contains("fill-rule=\"evenodd\" d=\"M") && svg.contains(hole), "{svg}");
        assert!(svg.contains("<text class=\"area\" x=\"69.0\" y=\"931.0\">F</text>"), "{svg}");
    }
}
