//! A forecast as lines for a terminal.

use std::fmt::Write;

use kittiwake_proto::v1;

use super::WindArg;

/// The whole forecast.
pub(super) fn plan(reply: &v1::MissionReply, wind: Option<WindArg>, notes: &[String]) -> String {
    let mission = reply.status.as_ref().map_or("", |it| &it.mission);
    let mut text = format!("mission `{mission}`, judged in {}\n", wind_in_words(wind));
    for objective in &reply.forecast {
        text += &of_objective(objective, survey(reply, objective));
    }
    for line in totals(reply) {
        let _ = write!(text, "\n{line}");
    }
    for note in notes {
        let _ = write!(text, "\n{note}");
    }
    text + "\n"
}

/// What is true of the whole mission, a line each.
pub(super) fn totals(reply: &v1::MissionReply) -> Vec<String> {
    let mut lines = Vec::new();
    if !reply.order.is_empty() {
        lines.push(format!("order: {}", reply.order));
    }
    if let Some(energy) = &reply.energy {
        if 0.0 < energy.way_home_s {
            let (time, wh) = (clock(energy.way_home_s), energy.way_home_wh);
            lines.push(format!("it ends in the air; home from there, straight: {time}, {wh:.1} Wh"));
        }
        let length_m: f64 = reply.forecast.iter().map(|it| it.length_m).sum();
        let time_s: f64 = reply.forecast.iter().map(|it| it.flight_time_s + it.stay_s).sum();
        lines.push(format!(
            "total: {length_m:.0} m, {} without waits, {:.1} Wh of {:.0} usable ({:.0} of {:.0} Wh left, {:.0} % reserve)",
            clock(time_s + energy.way_home_s),
            energy.needs_wh,
            energy.usable_wh.floor(),
            energy.charge_wh,
            energy.capacity_wh,
            energy.reserve * 100.0
        ));
    }
    let verdict = if reply.accepted { "can be flown" } else { "must not be flown" };
    lines.push(format!("{verdict}: {}", reply.text));
    lines
}

/// The wind that times and energy are judged in.
pub(super) fn wind_in_words(wind: Option<WindArg>) -> String {
    match wind {
        None => "the wind of the configuration, against every leg".to_owned(),
        Some(WindArg { speed_m_s: 0.0, .. }) => "calm air".to_owned(),
        Some(WindArg { speed_m_s, from_deg: None }) => format!("a wind of {speed_m_s} m/s against every leg"),
        Some(WindArg { speed_m_s, from_deg: Some(from_deg) }) => {
            format!("a wind of {speed_m_s} m/s from {from_deg} degrees")
        }
    }
}

/// Minutes and seconds.
pub(super) fn clock(seconds: f64) -> String {
    let seconds = seconds.round().max(0.0) as u64;
    format!("{}:{:02}", seconds / 60, seconds % 60)
}

/// What a leg needs besides: the areas it leads through, and the permissions that are asked for when it begins, or
/// ahead.
pub(super) fn areas(leg: &v1::LegForecast) -> String {
    let through = (!leg.areas.is_empty()).then(|| format!("through {}", leg.areas.join(", ")));
    let ask = |it: &v1::PermissionForecast| {
        let ahead = if it.ahead { "ahead, " } else { "" };
        format!("asks for {} {ahead}at {}, needed until {}", it.area, clock(it.asked_s), clock(it.until_s))
    };
    through.into_iter().chain(leg.asks.iter().map(ask)).collect::<Vec<_>>().join("; ")
}

/// Where the vehicle would best come down early during a leg; empty if that was not looked for.
pub(super) fn alternate(leg: &v1::LegForecast) -> String {
    let Some(it) = &leg.alternate else { return String::new() };
    let name = match it.role() {
        v1::AlternateRole::Home => "home".to_owned(),
        v1::AlternateRole::Objective => format!("the place of `{}`", it.name),
        _ if it.kind() == v1::SiteKind::Ditch => format!("ditch `{}`", it.name),
        _ => format!("site `{}`", it.name),
    };
    let (Some(length_m), Some(time_s), Some(energy_wh)) = (it.length_m, it.time_s, it.energy_wh) else {
        return format!("none: {}", it.why_not);
    };
    let way = format!("{name}, {length_m:.0} m, {}, {energy_wh:.1} Wh", clock(time_s));
    if !it.why_not.is_empty() {
        return format!("none within the battery; nearest is {way}: {}", it.why_not);
    }
    match it.permissions.as_slice() {
        [] => way,
        areas => format!("{way}, with permission for {}", areas.join(", ")),
    }
}

/// How close together the lines of an objective's survey are, and its pictures; `None` if it is not one.
pub(super) fn survey(reply: &v1::MissionReply, it: &v1::ObjectiveForecast) -> Option<String> {
    let known = reply.status.iter().flat_map(|it| &it.objectives).find(|known| known.name == it.objective)?;
    let survey = known.survey.as_ref()?;
    let pictures = survey.picture_distance_m.map(|it| format!(", a picture every {it} m")).unwrap_or_default();
    Some(format!("survey: lines {} m apart{pictures}", survey.spacing_m))
}

fn of_objective(it: &v1::ObjectiveForecast, survey: Option<String>) -> String {
    let worth = it.worth.map(|worth| format!(", optional, worth {worth}")).unwrap_or_default();
    if !it.reachable {
        return format!("\nobjective `{}`{worth}: not reached: {}\n", it.objective, it.reason);
    }
    let (length, time) = (it.length_m, clock(it.flight_time_s));
    let mut text = format!("\nobjective `{}`{worth}: {length:.0} m, {time}, {:.1} Wh\n", it.objective, it.energy_wh);
    if let Some(survey) = survey {
        let _ = writeln!(text, "  {survey}");
    }
    if !it.reason.is_empty() {
        let _ = writeln!(text, "  waits: {}", it.reason);
    }
    if !it.legs.is_empty() {
        let _ = writeln!(text, "  {:>6}  {:<44}{:>7}{:>7}{:>7}{:>6}", "at", "leg", "m", "time", "Wh", "left");
    }
    let mut at_s = it.begins_s;
    for leg in &it.legs {
        let left = leg.charge.map_or_else(|| "-".to_owned(), |it| format!("{:.0} %", it * 100.0));
        let (at, time) = (clock(at_s), clock(leg.time_s));
        let _ =
            write!(text, "  {at:>6}  {:<44}{:>7.0}{time:>7}{:>7.1}{left:>6}", leg.text, leg.length_m, leg.energy_wh);
        let _ = writeln!(
            text,
            "{}",
            Some(areas(leg)).filter(|it| !it.is_empty()).map(|it| format!("  {it}")).unwrap_or_default()
        );
        let alternate = alternate(leg);
        if !alternate.is_empty() {
            let _ = writeln!(text, "  {:>6}    alternate: {alternate}", "");
        }
        at_s += leg.time_s;
    }
    if 0.0 < it.stay_s {
        let _ = writeln!(text, "  {:>6}  stays for {}", clock(at_s), clock(it.stay_s));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_alternate_of_a_leg_is_told_with_what_it_takes() {
        #[track_caller]
        fn check(change: impl Fn(&mut v1::Alternate), expected: &str) {
            let mut it = v1::Alternate {
                role: v1::AlternateRole::Site as i32,
                name: "field".into(),
                kind: v1::SiteKind::Landing as i32,
                length_m: Some(120.4),
                time_s: Some(61.0),
                energy_wh: Some(12.34),
                ..Default::default()
            };
            change(&mut it);
            let leg = v1::LegForecast { alternate: Some(it), ..Default::default() };
            assert_eq!(alternate(&leg), expected);
        }
        check(|_| {}, "site `field`, 120 m, 1:01, 12.3 Wh");
        check(|it| it.role = v1::AlternateRole::Home as i32, "home, 120 m, 1:01, 12.3 Wh");
        check(|it| it.role = v1::AlternateRole::Objective as i32, "the place of `field`, 120 m, 1:01, 12.3 Wh");
        check(|it| it.kind = v1::SiteKind::Ditch as i32, "ditch `field`, 120 m, 1:01, 12.3 Wh");
        check(
            |it| it.permissions = vec!["A".into(), "B".into()],
            "site `field`, 120 m, 1:01, 12.3 Wh, with permission for A, B",
        );
        check(
            |it| it.why_not = "the way needs 13 Wh of 9 usable".into(),
            "none within the battery; nearest is site `field`, 120 m, 1:01, 12.3 Wh: the way needs 13 Wh of 9 usable",
        );
        check(|it| (it.length_m, it.why_not) = (None, "no way there".into()), "none: no way there");
        assert_eq!(alternate(&v1::LegForecast::default()), "", "it was not looked for");
    }

    #[test]
    fn a_forecast_is_printed_with_its_figures() {
        let ask = v1::PermissionForecast { area: "A".into(), asked_s: 3.0, until_s: 95.0, ahead: false };
        let ahead = v1::PermissionForecast { area: "C".into(), asked_s: 1.0, ahead: true, ..ask.clone() };
        let leg = v1::LegForecast {
            text: "fly to (0, 90, 10), asking A".into(),
            length_m: 90.0,
            time_s: 9.0,
            energy_wh: 2.94,
            charge: Some(0.982),
            areas: vec!["B".into()],
            asks: vec![ask, ahead],
            alternate: Some(v1::Alternate {
                role: v1::AlternateRole::Home as i32,
                length_m: Some(100.0),
                time_s: Some(17.0),
                energy_wh: Some(5.5),
                ..Default::default()
            }),
            ..Default::default()
        };
        let there = v1::ObjectiveForecast {
            objective: "there".into(),
            reachable: true,
            begins_s: 3.0,
            stay_s: 30.0,
            legs: vec![leg],
            length_m: 90.0,
            flight_time_s: 9.0,
            energy_wh: 8.94,
            ..Default::default()
        };
        let lost = v1::ObjectiveForecast {
            objective: "more".into(),
            reason: "left out".into(),
            worth: Some(2.0),
            ..Default::default()
        };
        let energy = v1::EnergyForecast {
            needs_wh: 12.0,
            way_home_wh: 3.06,
            way_home_s: 20.0,
            usable_wh: 225.0,
            charge_wh: 300.0,
            capacity_wh: 300.0,
            reserve: 0.25,
            ..Default::default()
        };
        let survey = v1::Survey { spacing_m: 18.0, picture_distance_m: Some(8.5), ..Default::default() };
        let surveyed = v1::Objective { name: "there".into(), survey: Some(survey), ..Default::default() };
        let reply = v1::MissionReply {
            accepted: true,
            text: "every required objective can be reached".into(),
            status: Some(v1::MissionStatus { objectives: vec![surveyed], ..Default::default() }),
            forecast: vec![there, lost],
            energy: Some(energy),
            order: "the best".into(),
            ..Default::default()
        };
        let expected = "\
mission ``, judged in a wind of 8 m/s from 270 degrees

objective `there`: 90 m, 0:09, 8.9 Wh
  survey: lines 18 m apart, a picture every 8.5 m
      at  leg                                               m   time     Wh  left
    0:03  fly to (0, 90, 10), asking A                     90   0:09    2.9  98 %  through B; asks for A at 0:03, needed until 1:35; asks for C ahead, at 0:01, needed until 1:35
            alternate: home, 100 m, 0:17, 5.5 Wh
    0:12  stays for 0:30

objective `more`, optional, worth 2: not reached: left out

order: the best
it ends in the air; home from there, straight: 0:20, 3.1 Wh
total: 90 m, 0:59 without waits, 12.0 Wh of 225 usable (300 of 300 Wh left, 25 % reserve)
can be flown: every required objective can be reached
note: wind
";
        let wind = "8,270".parse().unwrap();
        assert_eq!(plan(&reply, Some(wind), &["note: wind".into()]), expected);
    }
}
