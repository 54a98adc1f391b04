//! A difference as a page that needs nothing else: no script, no font, no address.

use std::fmt::Write as _;

use formats::compare::{Difference, Item};

use crate::airspace::diff::lines;
use crate::plan::escape;
use crate::plan::picture::Scale;

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1a2a33;background:#fff}
svg{width:100%;height:auto;border:1px solid #c8d3d9;background:#f5f9fb}
path{fill-rule:evenodd;stroke-width:2}
path.unchanged{fill:#5b6b7320;stroke:#5b6b73;stroke-width:1}
path.opened{fill:#0b7a3e22;stroke:#0b7a3e;stroke-dasharray:8 5}
path.closed{fill:#b3261e33;stroke:#b3261e}
path.before{fill:none;stroke:#a87900;stroke-dasharray:8 5}
path.changed{fill:#e8a80033;stroke:#a87900}
text{font:18px system-ui,sans-serif;fill:#1a2a33}";

/// The whole page: `heads` say which editions are compared.
pub(super) fn page(heads: &[String], difference: &Difference) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Two editions of airspace</title>\n\
         <style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>Two editions of airspace</h1>\n<p>Red: closed. Green, dashed: opened. \
         Yellow: changed, dashed as it was. Grey: unchanged. North is up.</p>\n"
    );
    page += &draw(difference);
    page += "<ul>\n";
    for line in heads.iter().chain(&lines(difference)) {
        let _ = writeln!(page, "<li>{}</li>", escape(line));
    }
    page + "</ul>\n</body>\n</html>\n"
}

fn draw(difference: &Difference) -> String {
    let Difference { closed, opened, changed, unchanged } = difference;
    // What matters is drawn last, above the others.
    let of = |class: &'static str, items: &'_ [Item]| items.iter().map(|it| (class, it.clone())).collect::<Vec<_>>();
    let mut items = of("unchanged", unchanged);
    items.extend(of("opened", opened));
    items.extend(changed.iter().flat_map(|it| [("before", it.old.clone()), ("changed", it.new.clone())]));
    items.extend(of("closed", closed));
    let items: Vec<_> = items.into_iter().map(|(class, it)| (class, it.rings(), escape(&it.name))).collect();
    let points: Vec<(f64, f64)> = items.iter().flat_map(|(_, rings, _)| rings.iter().flatten()).copied().collect();
    let scale = Scale::of(&points);
    let mut svg = "<svg viewBox=\"0 0 1000 1000\" role=\"img\" aria-label=\"zones of both editions\">\n".to_owned();
    for (class, rings, name) in &items {
        let path = path(rings, &scale);
        let _ = writeln!(svg, "<path class=\"{class}\" d=\"{path}\"><title>{name}</title></path>");
        let first = rings.iter().flatten().next().filter(|_| !matches!(*class, "unchanged" | "before"));
        if let Some((x, y)) = first.map(|it| scale.at(*it)) {
            let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\">{name}</text>");
        }
    }
    svg + "</svg>\n"
}

fn path(rings: &[Vec<(f64, f64)>], scale: &Scale) -> String {
    let mut path = String::new();
    for ring in rings {
        for (index, corner) in ring.iter().enumerate() {
            let (x, y) = scale.at(*corner);
            let _ = write!(path, "{}{x:.1} {y:.1}", if index == 0 { "M" } else { "L" });
        }
        path.push('Z');
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::area::{Area, AreaKind};
    use domain::geometry::Ned;
    use formats::compare::{Change, of_areas};

    fn item(name: &str) -> Item {
        let corners = [(0.0, 0.0), (0.0, 9.0), (9.0, 9.0)].map(|(north, east)| Ned::new(north, east, 0.0));
        let area = Area { ceiling_m: Some(30.0), ..Area::new(name, AreaKind::KeepOut, corners.to_vec()) };
        of_areas([&area]).remove(0)
    }

    #[test]
    fn each_zone_is_drawn_and_names_cannot_become_parts_of_the_page() {
        let evil = "<script>alert(1)</script>\"&";
        let what = vec![evil.to_owned()];
        let difference = Difference {
            closed: vec![item(evil)],
            opened: vec![item(evil)],
            changed: vec![Change { old: item("was"), new: item(evil), what }],
            unchanged: vec![item("same")],
        };
        let page = page(&[evil.to_owned()], &difference);
        assert!(!page.contains("<script") && page.contains("&lt;script&gt;"), "{page}");
        assert!(!page.contains("http"), "it refers to nothing: {page}");
        for class in ["closed", "opened", "before", "changed", "unchanged"] {
            assert_eq!(page.matches(&format!("<path class=\"{class}\"")).count(), 1, "{class}: {page}");
        }
    }
}
