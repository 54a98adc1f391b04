//! A forecast as a page that needs nothing else: no script, no font, no address.

use std::fmt::Write;

use kittiwake_proto::v1;

use super::{WindArg, picture, text};

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1a2a33;background:#fff}
svg{width:100%;height:auto;border:1px solid #c8d3d9;background:#f5f9fb}
table{border-collapse:collapse;width:100%;margin:.5rem 0 1.5rem}
th,td{text-align:left;padding:.2rem .6rem;border-bottom:1px solid #dde5e9}
td.figure,th.figure{text-align:right;font-variant-numeric:tabular-nums}
line{stroke:#0b5cab;stroke-width:3}
circle{stroke:#fff;stroke-width:2}
circle.reached{fill:#0b7a3e}circle.missed{fill:#b3261e}
rect.home{fill:#1a2a33}
rect.landing{fill:#0b5cab}rect.ditch{fill:#fff;stroke:#0b5cab;stroke-width:3}
path.permission{fill:#e8a80033;stroke:#a87900;stroke-width:2}
path.keep-out{fill:#b3261e33;stroke:#b3261e;stroke-width:2}
text{font:20px system-ui,sans-serif;fill:#1a2a33}text.area{font-style:italic;fill:#5b4a00}";

/// The whole page.
pub(super) fn page(reply: &v1::MissionReply, wind: Option<WindArg>, notes: &[String]) -> String {
    let mission = escape(reply.status.as_ref().map_or("", |it| &it.mission));
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Plan of {mission}</title>\n\
         <style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>Plan of {mission}</h1>\n<p>Judged in {}.</p>\n",
        escape(&text::wind_in_words(wind))
    );
    page += &picture::draw(reply);
    page += "<ul>\n";
    for line in text::totals(reply).iter().chain(notes) {
        let _ = writeln!(page, "<li>{}</li>", escape(line));
    }
    page += "</ul>\n";
    for (number, objective) in (1..).zip(&reply.forecast) {
        page += &of_objective(number, objective, text::survey(reply, objective));
    }
    page + "</body>\n</html>\n"
}

/// `text` as it stands between tags and in attributes.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn of_objective(number: usize, it: &v1::ObjectiveForecast, survey: Option<String>) -> String {
    let mut section = format!("<h2>{number}. {}</h2>\n", escape(&it.objective));
    if let Some(worth) = it.worth {
        let _ = writeln!(section, "<p>Optional, worth {worth}.</p>");
    }
    if !it.reachable {
        let _ = writeln!(section, "<p>Not reached: {}.</p>", escape(&it.reason));
        return section;
    }
    if let Some(survey) = survey {
        let _ = writeln!(section, "<p>{}.</p>", escape(&survey));
    }
    if !it.reason.is_empty() {
        let _ = writeln!(section, "<p>Waits: {}.</p>", escape(&it.reason));
    }
    section += "<table>\n<tr><th>At</th><th>Leg</th><th class=\"figure\">Metres</th><th class=\"figure\">Time</th>\
                <th class=\"figure\">Wh</th><th class=\"figure\">Left</th><th>Areas</th><th>Alternate</th></tr>\n";
    let mut at_s = it.begins_s;
    for leg in &it.legs {
        let left = leg.charge.map_or_else(|| "-".to_owned(), |it| format!("{:.0} %", it * 100.0));
        let _ = writeln!(
            section,
            "<tr><td>{}</td><td>{}</td><td class=\"figure\">{:.0}</td><td class=\"figure\">{}</td><td class=\"figure\">{:.1}</td>\
             <td class=\"figure\">{left}</td><td>{}</td><td>{}</td></tr>",
            text::clock(at_s),
            escape(&leg.text),
            leg.length_m,
            text::clock(leg.time_s),
            leg.energy_wh,
            escape(&text::areas(leg)),
            escape(&text::alternate(leg))
        );
        at_s += leg.time_s;
    }
    section += "</table>\n";
    if 0.0 < it.stay_s {
        let _ = writeln!(section, "<p>Stays for {} from {} on.</p>", text::clock(it.stay_s), text::clock(at_s));
    }
    section
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_become_parts_of_the_page() {
        let evil = "<script>alert(1)</script>\"&";
        let (position, corner) = (v1::Ned::default(), v1::Ned { north_m: f64::MAX, ..Default::default() });
        let objective = v1::Objective { name: evil.into(), position: Some(position), ..Default::default() };
        let area = v1::Area { name: evil.into(), corners: vec![corner, position], ..Default::default() };
        let alternate = Some(v1::Alternate { name: evil.into(), why_not: evil.into(), ..Default::default() });
        let (from, to) = (Some(position), Some(position));
        let leg = v1::LegForecast { text: evil.into(), from, to, alternate, ..Default::default() };
        let site = v1::Site { name: evil.into(), position: Some(position), ..Default::default() };
        let forecast =
            v1::ObjectiveForecast { objective: evil.into(), reachable: true, legs: vec![leg], ..Default::default() };
        let status = v1::MissionStatus {
            mission: evil.into(),
            objectives: vec![objective],
            areas: vec![area],
            sites: vec![site],
            ..Default::default()
        };
        let reply = v1::MissionReply {
            text: evil.into(),
            forecast: vec![forecast],
            status: Some(status),
            order: evil.into(),
            ..Default::default()
        };
        let page = page(&reply, None, &[evil.to_owned()]);
        assert!(!page.contains("<script") && page.contains("&lt;script&gt;"), "{page}");
        assert!(!page.contains("http"), "it refers to nothing: {page}");
    }
}
