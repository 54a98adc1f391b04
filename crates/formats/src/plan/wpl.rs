//! Missions as lines of text, `QGC WPL 110`: item number, whether it is the current one, frame, command, four parameters, latitude,
//! longitude, altitude, and whether the mission goes on by itself. The first item is home.

use domain::geodesy::Origin;

use super::item::{Item, SEA_LEVEL};
use super::{commands, order, step};
use crate::content::{Content, Place};
use crate::findings::{Findings, Wrong};

/// What such a file begins with.
pub(crate) const BEGINNING: &str = "QGC WPL";
/// The version that is read. In 120 home is not among the items.
const VERSION: &str = "110";
/// An autopilot takes fewer items; more are a mistake.
const MOST_ITEMS: usize = 20_000;

/// Reads a file.
pub(crate) fn read(text: &str, findings: &mut Findings) -> Content {
    let mut content = Content::default();
    let outcome = mission(text, &mut content, findings);
    findings.unless_wrong(outcome);
    content
}

fn mission(text: &str, content: &mut Content, findings: &mut Findings) -> Result<(), Wrong> {
    let mut lines = text.lines().enumerate().filter(|(_, it)| !it.trim().is_empty());
    let version = lines.next().map_or("", |(_, it)| it.trim()).strip_prefix(BEGINNING).unwrap_or_default().trim();
    if version != VERSION {
        let message = format!("QGC WPL {}, expected QGC WPL {VERSION}", crate::json::short(version));
        return Err(Wrong::at(
            "line 1",
            message,
            "open it in the program that made it, and save it as 110 or as `.plan`",
        ));
    }
    let count = lines.clone().count();
    if MOST_ITEMS < count {
        return Err(Wrong::at("", format!("{count} items, expected at most {MOST_ITEMS}"), "cut it to one mission"));
    }
    let (mut steps, mut is_first) = (Vec::new(), true);
    for (index, line) in lines {
        let place = format!("line {}", index + 1);
        if std::mem::take(&mut is_first) {
            let origin = item(place, line).and_then(|it| home(&it));
            content.origin = findings.unless_wrong(origin).flatten();
        } else if !findings.leaves_out(&place, "") {
            let home = content.origin.map(|it| it.place);
            let found = item(place, line).and_then(|it| step::of(&it, home, findings));
            steps.extend(findings.unless_wrong(found).unwrap_or_default());
        }
    }
    if findings.has_mistakes() { Ok(()) } else { order::run(&steps, content, findings) }
}

/// Where the vehicle takes off; `None` if the program did not know it.
fn home(item: &Item) -> Result<Option<Origin>, Wrong> {
    if item.command != commands::WAYPOINT {
        let message = format!("command {}, expected 16: the first item is home", item.command);
        return Err(Wrong::at(&item.place, message, "put home before the other items"));
    }
    let altitude_m = item.given(7).filter(|_| item.frame == SEA_LEVEL);
    Ok(match item.at()? {
        Place::At(place) => Some(Origin { place, altitude_m }),
        Place::Here | Place::TakeOff => None,
    })
}

fn item(place: String, line: &str) -> Result<Item, Wrong> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [id, _, frame, command, params @ .., goes_on] = words.as_slice() else {
        return Err(columns(&place, words.len()));
    };
    let params = <[&str; 7]>::try_from(params).map_err(|_| columns(&place, words.len()))?;
    let wrong = |word: &str| Wrong::at(&place, format!("found `{}`, expected a number", crate::json::short(word)), "");
    let number = |word: &str| {
        let number: f64 = word.parse().map_err(|_| wrong(word))?;
        if number.is_infinite() { Err(wrong(word)) } else { Ok(Some(number).filter(|it| !it.is_nan())) }
    };
    let whole = |word: &str| match number(word)? {
        Some(number) if number.fract() == 0.0 => Ok(number as i64),
        _ => Err(wrong(word)),
    };
    let mut read = [None; 7];
    for (param, word) in read.iter_mut().zip(params) {
        *param = number(word)?;
    }
    Ok(Item {
        id: Some(whole(id)?),
        command: whole(command)?,
        frame: whole(frame)?,
        params: read,
        is_last_by_itself: whole(goes_on)? == 0,
        place,
    })
}

fn columns(place: &str, count: usize) -> Wrong {
    Wrong::at(place, format!("{count} columns, expected 12"), "")
}
