//! The gateway's documents on a few lines.

use domain::feed::Feed;
use serde_json::Value;

use crate::operate::words::{each, heading, number, place, row, table, text, word};
use crate::plan::now;

/// Every vehicle on a line.
pub fn fleet(document: &Value) -> String {
    let mut lines = heading([
        "VEHICLE",
        "CONTACT",
        "PHASE",
        "FLYING",
        "HEIGHT",
        "BATTERY",
        "OBJECTIVE",
        "RESPONDS TO",
        "WORST",
        "OUTCOME",
        "WAITS FOR",
    ]);
    let (lost, heard): (Vec<_>, Vec<_>) = each(&document["vehicles"]).partition(|it| it["contact"]["lost"] == true);
    for it in lost.into_iter().chain(heard) {
        let flying = match it["flying"].as_bool() {
            Some(true) => "yes",
            Some(false) => "no",
            None => "-",
        };
        lines.push(vec![
            text(&it["vehicle"]).to_owned(),
            contact(&it["contact"]),
            word(&it["phase"], "MISSION_PHASE_"),
            flying.to_owned(),
            format!("{} m", number(&it["heightM"], 0)),
            percent(&it["batteryRemaining"]),
            objective_of(&it["currentObjective"], it["objectives"].as_u64()),
            text(&it["acting"]).to_owned(),
            text(&it["worst"]).to_owned(),
            word(&it["outcome"], "MISSION_OUTCOME_"),
            waits_for(&it["waitsFor"]),
        ]);
    }
    table(lines)
}

/// When a vehicle was last heard, if not just now.
fn contact(contact: &Value) -> String {
    match (contact["wallAgeS"].as_f64(), contact["lost"] == true) {
        (Some(age), true) => format!("none for {age:.0} s"),
        (Some(_), false) => "yes".to_owned(),
        (None, _) => "not yet".to_owned(),
    }
}

/// One vehicle.
pub fn vehicle(it: &Value) -> String {
    let (mission, aircraft) = (&it["mission"], &it["aircraft"]);
    let status = &aircraft["status"];
    let armed = match status["armed"].as_bool() {
        Some(true) => "armed",
        Some(false) => "disarmed",
        None => "-",
    };
    let phase = word(&mission["phase"], "MISSION_PHASE_");
    let mut lines = vec![
        vec![
            text(&it["vehicle"]).to_owned(),
            format!("{phase}, {}, {armed}", word(&status["actualMode"], "FLIGHT_MODE_")),
        ],
        vec!["command".into(), command(&it["command"])],
        vec![
            "position".into(),
            format!(
                "{} north, east, height in m; {} m/s",
                place(&aircraft["localPosition"]["position"]),
                number(&aircraft["derived"]["groundSpeedMS"], 1)
            ),
        ],
        vec!["battery".into(), percent(&aircraft["battery"]["remaining"])],
        vec!["mission".into(), progress(mission, &it["plan"]["current"])],
    ];
    if it["energy"].is_object() {
        lines.insert(4, vec!["energy".into(), energy(&it["energy"])]);
    }
    let mut add = |name: &str, found: String| {
        if !found.is_empty() {
            lines.push(vec![name.to_owned(), found]);
        }
    };
    add("waits for", waits_for(&it["waitsFor"]));
    add("holding", said(&mission["hold"]));
    let contingency = |it: &Value| {
        let seen = it["acknowledgedBy"].as_str().filter(|it| !it.is_empty());
        let seen = seen.map(|by| format!(", acknowledged by {by}")).unwrap_or_default();
        format!("{} ({}{seen})", text(&it["flag"]), text(&it["reason"]))
    };
    add("flags", joined(each(&it["contingencies"]["active"]).map(contingency)));
    let permission = |it: &Value| format!("{} {}", text(&it["area"]), word(&it["state"], "PERMISSION_STATE_"));
    add("permissions", joined(each(&it["permissions"]).map(permission)));
    add("stale", said(&it["tower"]["stale"]));
    if it["contact"]["lost"] == true {
        add("contact", format!("{}: all of this is as old", contact(&it["contact"])));
    }
    let unwell = each(&it["processes"]).filter(|it| it["health"] != "alive" && it["health"] != "unheard");
    add("processes", joined(unwell.map(|it| format!("{} is {}", text(&it["service"]), text(&it["health"])))));
    add("pictures", it["pictures"].as_u64().filter(|it| *it != 0).map(|it| it.to_string()).unwrap_or_default());
    let report = &it["report"];
    if report.is_object() {
        add("report", format!("{}: {}", word(&report["outcome"], "MISSION_OUTCOME_"), text(&report["reason"])));
    }
    table(lines)
}

/// The mission's objectives and what became of them.
pub fn mission(status: &Value) -> String {
    let mut lines = heading(["", "OBJECTIVE", "PLACE", "STATE", "PLANNED", "PERMISSIONS", "REASON"]);
    for (index, it) in each(&status["objectives"]).enumerate() {
        let current = status["currentObjective"].as_u64() == Some(index as u64);
        let flying = if it["flying"] == true { " in flight" } else { "" };
        lines.push(vec![
            format!("{}{index}", if current { ">" } else { " " }),
            text(&it["name"]).to_owned(),
            format!("{}{flying}", place(&it["position"])),
            word(&it["state"], "OBJECTIVE_STATE_"),
            format!("{} steps, {} replans", number(&it["planSteps"], 0), number(&it["replans"], 0)),
            row(&it["permissions"]),
            said(&it["reason"]),
        ]);
    }
    let hold = status["hold"].as_str().filter(|it| !it.is_empty());
    let hold = hold.map(|why| format!("\nholding: {why}")).unwrap_or_default();
    let degrees = |key: &str| status["origin"][key].as_f64();
    let origin = degrees("latitudeDeg").zip(degrees("longitudeDeg"));
    let origin =
        origin.map(|(latitude, longitude)| format!(", origin {latitude:.6}, {longitude:.6}")).unwrap_or_default();
    let feeds: String = each(&status["feeds"]).map(|it| format!("\n{}", feed(it))).collect();
    format!("mission `{}`{origin}\n{}{hold}{feeds}", text(&status["mission"]), table(lines))
}

/// Where areas come from, and loudly if that is out of date.
fn feed(it: &Value) -> String {
    let moment = |key: &str| it[key].as_str().and_then(|it| it.parse().ok());
    let feed = Feed {
        name: text(&it["name"]).to_owned(),
        provider: it["provider"].as_str().filter(|it| !it.is_empty()).map(str::to_owned),
        issued_utc_ms: moment("issuedUtcMs"),
        valid_from_utc_ms: moment("validFromUtcMs"),
        valid_until_utc_ms: moment("validUntilUtcMs"),
        areas: Vec::new(),
    };
    let out_of_date = feed.out_of_date(now().utc_ms).map(|it| format!("\nWARNING: {it}")).unwrap_or_default();
    format!("airspace: {}: {} areas{out_of_date}", feed.in_words(), each(&it["areas"]).count())
}

/// The steps of the present plan.
pub fn plan(status: &Value) -> String {
    let plan = &status["plan"];
    let steps: Vec<String> = each(&plan["steps"])
        .enumerate()
        .map(|(index, it)| format!("\n{:3}. {}", index + 1, text(&it["text"])))
        .collect();
    if steps.is_empty() {
        return "no plan".to_owned();
    }
    format!("plan {} for objective {}{}", text(&plan["revision"]), number(&plan["objective"], 0), steps.concat())
}

/// What a mission would need, a line for each objective.
pub fn forecast(reply: &Value) -> String {
    let line = |it: &Value| {
        let name = text(&it["objective"]);
        if it["reachable"] != true {
            return format!("\n  {name}: cannot be reached: {}", text(&it["reason"]));
        }
        let steps = each(&it["plan"]["steps"]).count();
        let (length, time) = (number(&it["lengthM"], 0), number(&it["flightTimeS"], 0));
        let permissions = match row(&it["permissions"]).as_str() {
            "" => String::new(),
            areas => format!(", permission for {areas}"),
        };
        let energy = number(&it["energyWh"], 1);
        format!("\n  {name}: {steps} steps, {length} m in {time} s of flight, {energy} Wh{permissions}")
    };
    each(&reply["forecast"]).map(line).collect()
}

/// Who has command.
pub fn command(authority: &Value) -> String {
    let holder = authority["holder"].as_str().map_or_else(|| "nobody".to_owned(), str::to_owned);
    match authority["offeredTo"].as_str() {
        Some(to) => format!("{holder}, offered to {to}"),
        None => holder,
    }
}

/// How far the battery suffices.
fn energy(it: &Value) -> String {
    let place = |it: &Value| {
        let share = it["margin"].as_f64().map_or_else(|| "-".to_owned(), |it| format!("{:.0} %", it * 100.0));
        format!("{} in {} s leaves {share} above the reserve", text(&it["place"]), number(&it["timeS"], 0))
    };
    let mut parts = vec![format!("hovers for {} s", number(&it["enduranceS"], 0))];
    parts.extend(Some(&it["home"]).filter(|it| it.is_object()).map(place));
    parts.extend(Some(&it["best"]).filter(|it| it.is_object() && it["place"] != "home").map(place));
    parts.extend(it["turnHomeS"].as_f64().map(|it| format!("turn home within {it:.0} s")));
    parts.extend(it["consumption"].as_f64().map(|it| format!("takes {:.0} % of the figures", it * 100.0)));
    parts.join("; ")
}

fn waits_for(waits: &Value) -> String {
    let words = |it: &Value| match it["untilS"].as_f64() {
        Some(left) => format!("{}: {} by default in {left:.0} s", text(&it["what"]), text(&it["default"])),
        None => text(&it["what"]).to_owned(),
    };
    joined(each(waits).map(words))
}

fn progress(mission: &Value, current: &Value) -> String {
    let objectives = mission["objectives"].as_array().map_or(0, Vec::len);
    let mut text = format!(
        "{}, objective {}",
        text(&mission["name"]),
        objective_of(&mission["currentObjective"], Some(objectives as u64))
    );
    if current["stepNumber"].as_u64().is_some_and(|it| 0 < it) {
        let left = number(&current["distanceLeftM"], 0);
        text += &format!(", step {} of {}, {left} m left", current["stepNumber"], current["stepCount"]);
    }
    text
}

/// Text; nothing for what is unknown or empty.
fn said(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

/// The current objective, counted from 1, and how many there are.
fn objective_of(current: &Value, count: Option<u64>) -> String {
    match (current.as_u64(), count) {
        (Some(current), Some(count)) if current < count => format!("{} of {count}", current + 1),
        (Some(_), Some(count)) => format!("all {count} settled"),
        _ => "-".to_owned(),
    }
}

fn percent(ratio: &Value) -> String {
    ratio.as_f64().map_or_else(|| "-".to_owned(), |it| format!("{:.0} %", it * 100.0))
}

fn joined(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_is_unknown_is_a_dash_and_not_a_number() {
        let unknown = "uav1      -, -, -\ncommand   nobody\nposition  (-, -, -) north, east, height in m; - m/s\n\
                       battery   -\nmission   -, objective -";
        assert_eq!(vehicle(&json!({ "vehicle": "uav1" })), unknown);
    }

    #[test]
    fn a_vehicle_is_shown_in_lines() {
        let document = json!({
            "vehicle": "uav1",
            "command": { "holder": "anna", "offeredTo": "ben" },
            "waitsFor": [{ "what": "approval of plan 3", "untilS": 40.0, "default": "rejected" }, { "what": "the operator to resume" }],
            "mission": { "name": "reference", "phase": "MISSION_PHASE_NOMINAL", "currentObjective": 0,
                "objectives": [{}, {}], "hold": "" },
            "plan": { "current": { "stepNumber": 2, "stepCount": 5, "distanceLeftM": 41.2 } },
            "aircraft": { "status": { "armed": true, "actualMode": "FLIGHT_MODE_OFFBOARD" },
                "localPosition": { "position": { "northM": 0.2, "eastM": 90.0, "downM": -10.0 } },
                "derived": { "groundSpeedMS": 5.04 }, "battery": { "remaining": 0.82 } },
            "contingencies": { "active": [{ "flag": "obstacle", "reason": "by hand", "acknowledgedBy": "ben" }] },
            "permissions": [{ "area": "A", "state": "PERMISSION_STATE_GRANTED" }],
            "processes": [{ "service": "mcm", "health": "alive" }, { "service": "planner", "health": "stale" }],
            "pictures": 312,
        });
        let expected = "uav1         nominal, offboard, armed\ncommand      anna, offered to ben\n\
            position     (0, 90, 10) north, east, height in m; 5.0 m/s\nbattery      82 %\n\
            mission      reference, objective 1 of 2, step 2 of 5, 41 m left\nwaits for    approval of plan 3: rejected by default in 40 s, the operator to resume\n\
            flags        obstacle (by hand, acknowledged by ben)\npermissions  A granted\nprocesses    planner is stale\npictures     312";
        assert_eq!(vehicle(&document), expected);
    }

    #[test]
    fn how_far_the_battery_suffices_is_a_line() {
        let document = json!({ "vehicle": "uav1", "energy": {
            "enduranceS": 640.2, "turnHomeS": 210.7, "consumption": 0.963,
            "home": { "place": "home", "timeS": 95.4, "margin": 0.284 },
            "best": { "place": "site `field`", "timeS": 31.0, "margin": 0.41 },
        } });
        let expected = "energy    hovers for 640 s; home in 95 s leaves 28 % above the reserve; site `field` in 31 s leaves 41 % above the \
                        reserve; turn home within 211 s; takes 96 % of the figures";
        assert!(vehicle(&document).lines().any(|it| it == expected), "{}", vehicle(&document));
    }

    #[test]
    fn a_forecast_says_what_each_objective_needs() {
        let reply = json!({ "forecast": [
            { "objective": "there", "reachable": true, "plan": { "steps": [{}, {}] }, "lengthM": 500.4, "flightTimeS": 61.7, "energyWh": 17.24,
              "permissions": ["A"] },
            { "objective": "moon", "reachable": false, "reason": "no way" },
        ] });
        let expected =
            "\n  there: 2 steps, 500 m in 62 s of flight, 17.2 Wh, permission for A\n  moon: cannot be reached: no way";
        assert_eq!(forecast(&reply), expected);
    }

    #[test]
    fn a_mission_is_shown_with_its_origin_if_it_has_one() {
        let head = |status: Value| mission(&status).lines().next().unwrap_or_default().to_owned();
        assert_eq!(head(json!({ "mission": "reef" })), "mission `reef`");
        let origin = json!({ "latitudeDeg": -16.5, "longitudeDeg": 179.998, "altitudeAmslM": 5.0 });
        assert_eq!(
            head(json!({ "mission": "reef", "origin": origin })),
            "mission `reef`, origin -16.500000, 179.998000"
        );
    }

    #[test]
    fn a_mission_says_which_edition_its_areas_come_from() {
        let feed = json!({ "name": "z.json", "provider": "FOCA", "validUntilUtcMs": "1000", "areas": [0, 2] });
        let shown = mission(&json!({ "mission": "reef", "feeds": [feed, { "name": "y.json", "provider": "" }] }));
        let expected = [
            "airspace: feed `z.json` of FOCA, valid until 1970-01-01T00:00:01Z: 2 areas",
            "WARNING: feed `z.json` is OUT OF DATE: it was valid until 1970-01-01T00:00:01Z; get the present edition",
            "airspace: feed `y.json`: 0 areas",
        ];
        assert_eq!(shown.lines().skip(2).collect::<Vec<_>>(), expected, "{shown}");
    }

    #[test]
    fn a_plan_is_the_texts_of_its_steps() {
        let steps = json!([{ "text": "takeoff by 10 m" }, { "text": "fly to (0, 90, 10), asking A" }]);
        let status = json!({ "plan": { "revision": "3", "objective": 0, "steps": steps } });
        let expected = "plan 3 for objective 0\n  1. takeoff by 10 m\n  2. fly to (0, 90, 10), asking A";
        assert_eq!(plan(&status), expected);
        assert_eq!(plan(&json!({})), "no plan");
    }
}
