//! The gateway's documents in a human's words.

use serde_json::Value;

/// `FLIGHT_MODE_OFFBOARD` as `offboard`, given the prefix; a dash for what is not known.
pub fn word(value: &Value, prefix: &str) -> String {
    match value.as_str().map(|it| it.strip_prefix(prefix).unwrap_or(it)) {
        None | Some("" | "UNSPECIFIED") => "-".to_owned(),
        Some(it) => it.to_lowercase().replace('_', " "),
    }
}

/// A number with its decimals; a dash for what is not known.
pub fn number(value: &Value, decimals: usize) -> String {
    // Adding zero turns a negative zero into a positive one.
    let rounded = |it: f64| (it * 10f64.powi(decimals as i32)).round() / 10f64.powi(decimals as i32) + 0.0;
    value.as_f64().map_or_else(|| "-".to_owned(), |it| format!("{:.decimals$}", rounded(it)))
}

/// Text; a dash for what is not known or empty.
pub fn text(value: &Value) -> &str {
    value.as_str().filter(|it| !it.is_empty()).unwrap_or("-")
}

/// The elements of a list; none of what is no list.
pub fn each(list: &Value) -> impl Iterator<Item = &Value> {
    list.as_array().into_iter().flatten()
}

/// The texts of a list, in a row.
pub fn row(list: &Value) -> String {
    each(list).filter_map(Value::as_str).collect::<Vec<_>>().join(", ")
}

/// What a plan's step does.
pub fn step(step: &Value) -> String {
    let goal = &step["nominal"]["goal"];
    let action = match goal.as_object().and_then(|it| it.iter().next()) {
        Some((kind, it)) => match kind.as_str() {
            "takeoff" => format!("takeoff by {} m", number(&it["climbM"], 0)),
            "position" => format!("fly to {}", place(&it["target"])),
            "velocity" => "fly at a velocity".to_owned(),
            other => other.to_owned(),
        },
        None => "nothing".to_owned(),
    };
    match row(&step["askPermissions"]).as_str() {
        "" => action,
        areas => format!("{action}, asking {areas}"),
    }
}

/// A place as north, east and height, in metres.
pub fn place(at: &Value) -> String {
    let height = at["downM"].as_f64().map_or(Value::Null, |it| Value::from(-it));
    format!("({}, {}, {})", number(&at["northM"], 0), number(&at["eastM"], 0), number(&height, 0))
}

/// Lines of columns as wide as their widest entry; the first line is the heading.
pub fn table(lines: Vec<Vec<String>>) -> String {
    let count = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| lines.iter().filter_map(|it| it.get(column)).map(|it| it.chars().count()).max();
    let widths: Vec<usize> = (0..count).map(|it| width(it).unwrap_or(0)).collect();
    let line = |cells: &Vec<String>| {
        let cells: Vec<String> = cells.iter().zip(&widths).map(|(cell, &width)| format!("{cell:width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// A table's heading.
pub fn heading<const N: usize>(names: [&str; N]) -> Vec<Vec<String>> {
    vec![names.map(str::to_owned).to_vec()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn enumerations_and_numbers_read_like_words() {
        assert_eq!(word(&json!("FLIGHT_MODE_OFFBOARD"), "FLIGHT_MODE_"), "offboard");
        assert_eq!(word(&json!("PERMISSION_STATE_UNSPECIFIED"), "PERMISSION_STATE_"), "-");
        assert_eq!(word(&Value::Null, "X_"), "-");
        assert_eq!([number(&json!(-0.04), 1), number(&json!(2.25), 1), number(&json!("NaN"), 1)], ["0.0", "2.3", "-"]);
    }

    #[test]
    fn a_step_says_what_it_does() {
        #[track_caller]
        fn check(goal: Value, asks: Value, expected: &str) {
            assert_eq!(step(&json!({ "nominal": { "goal": goal }, "askPermissions": asks })), expected);
        }
        check(json!({ "takeoff": { "climbM": 10.0 } }), json!([]), "takeoff by 10 m");
        check(json!({ "land": {} }), json!([]), "land");
        let target = json!({ "northM": -0.2, "eastM": 90.0, "downM": -10.0 });
        check(json!({ "position": { "target": target } }), json!(["A", "B"]), "fly to (0, 90, 10), asking A, B");
        check(Value::Null, json!([]), "nothing");
    }

    #[test]
    fn columns_are_as_wide_as_they_must_be() {
        let mut lines = heading(["AREA", "STATE"]);
        lines.push(vec!["harbour".into(), "-".into()]);
        assert_eq!(table(lines), "AREA     STATE\nharbour  -");
    }
}
