//! Missions that nobody designed: one to three objectives among up to four areas, some of which open or close on the way.

use std::fmt::Write;
use std::time::{Duration, SystemTime};

use domain::file::Source;
use domain::mission::Mission;
use node::virtual_bus::UTC_START_MS;

use super::dice::Dice;

/// A mission that is not refused, as a file, and the names of its areas.
pub(super) fn random_mission(dice: &mut Dice) -> (String, Vec<String>) {
    loop {
        let text = draw(dice);
        if let Ok(mission) = Mission::read(&Source { path: "random.toml".into(), text: text.clone() }) {
            return (text, mission.areas.into_iter().map(|it| it.name).collect());
        }
    }
}

fn draw(dice: &mut Dice) -> String {
    let mut text = "name = \"random\"\n".to_owned();
    for number in 1..=dice.between(1, 3) {
        let (north, east) = (dice.between(-200, 200), dice.between(60, 700));
        objective(&mut text, &format!("place-{number}"), north, east, if dice.sometimes(40) { 0 } else { 15 });
    }
    match dice.below(10) {
        0 => {}
        1 => objective(&mut text, "elsewhere", dice.between(-300, 300), dice.between(100, 600), 0),
        _ => objective(&mut text, "return", 0, 0, 0),
    }
    for number in 1..=dice.below(5) {
        area(&mut text, number, dice);
    }
    text
}

fn objective(text: &mut String, name: &str, north: i64, east: i64, height: i64) {
    let flying = 0 < height;
    let _ = writeln!(
        text,
        "[[objective]]\nname = \"{name}\"\nnorth_m = {north}\neast_m = {east}\nheight_m = {height}\nflying = {flying}"
    );
}

fn area(text: &mut String, number: u64, dice: &mut Dice) {
    let kind = dice.one_of(&["permission", "permission", "keep-out"]);
    let (north, east) = (dice.between(-200, 200), dice.between(-20, 700));
    let (half_north, half_east) = (dice.between(20, 180), dice.between(20, 120));
    let (south, north, west, east) = (north - half_north, north + half_north, east - half_east, east + half_east);
    let _ = writeln!(
        text,
        "[[area]]\nname = \"area-{number}\"\nkind = \"{kind}\"\n\
         corners_m = [[{south}, {west}], [{north}, {west}], [{north}, {east}], [{south}, {east}]]"
    );
    match dice.below(6) {
        0 => text.push_str("ceiling_m = 12\n"),
        1 => text.push_str("floor_m = 25\n"),
        2 => text.push_str("ceiling_m = 60\n"),
        _ => {}
    }
    let utc = |seconds: i64| {
        let since = Duration::from_millis(UTC_START_MS as u64) + Duration::from_secs(seconds as u64);
        humantime::format_rfc3339_seconds(SystemTime::UNIX_EPOCH + since)
    };
    if dice.sometimes(30) {
        let from = dice.between(1, 300);
        let _ = writeln!(text, "from_utc = \"{}\"\nuntil_utc = \"{}\"", utc(from), utc(from + dice.between(30, 300)));
    } else if dice.sometimes(20) {
        let _ = writeln!(text, "until_utc = \"{}\"", utc(dice.between(20, 300)));
    }
}
