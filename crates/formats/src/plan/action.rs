//! Commands to camera, gimbal and other payload as the text of a mission's action, and back.
//!
//! The text is the name of the command, then its parameters in MAVLink's order: `nan` for one that is not given, zeros at the end left
//! out, and last the frame of its place, if it has one: `MAV_CMD_DO_SET_ROI_LOCATION 0 0 0 0 54.001 6.6 20 frame=3`.

use domain::mission::bounds::LONGEST_ACTION;

use super::commands::{COMMANDS, Meaning};
use super::item::{Item, NO_PLACE};
use crate::findings::Wrong;

/// The action of an item.
pub(super) fn text(item: &Item, name: &str) -> Result<String, Wrong> {
    let count = item.params.iter().rposition(|it| *it != Some(0.0)).map_or(0, |it| it + 1);
    let number = |it: &Option<f64>| it.map_or_else(|| " nan".to_owned(), |it| format!(" {}", it + 0.0));
    let numbers: String = item.params.iter().take(count).map(number).collect();
    let frame = if item.frame == NO_PLACE { String::new() } else { format!(" frame={}", item.frame) };
    let text = format!("{name}{numbers}{frame}");
    if LONGEST_ACTION < text.len() {
        return Err(Wrong::at(&item.place, "a parameter that is too long to be one", ""));
    }
    Ok(text)
}

/// The command, the frame and the parameters of an action; `None` for another text.
pub(super) fn parse(text: &str) -> Option<(i64, i64, [Option<f64>; 7])> {
    let mut words = text.split(' ');
    let name = words.next()?;
    let is_kept = |it: Meaning| matches!(it, Meaning::Action | Meaning::Gripper);
    let number = COMMANDS.iter().find(|it| it.1 == name && is_kept(it.2))?.0;
    let (mut frame, mut params, mut count) = (NO_PLACE, [Some(0.0); 7], 0);
    for word in words {
        match word.strip_prefix("frame=") {
            Some(found) => frame = found.parse().ok()?,
            None => {
                let value: f64 = word.parse().ok()?;
                *params.get_mut(count)? = Some(value).filter(|it| it.is_finite());
                count += 1;
            }
        }
    }
    Some((number, frame, params))
}
