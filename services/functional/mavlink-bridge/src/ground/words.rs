//! Texts to a ground station in our name.

use kittiwake_proto::v1::{DecisionKind, DecisionRecord};

use crate::frame::Frame;

pub(super) const COMMAND_INT: u32 = 75;
pub(super) const COMMAND_LONG: u32 = 76;
pub(super) const COMMAND_ACK: u32 = 77;
pub(super) const STATUSTEXT: u32 = 253;

/// The text of one frame.
const CHUNK: usize = 50;
/// The longest text: a decision has a line.
const MOST_CHUNKS: usize = 5;

/// MAV_SEVERITY.
const WARNING: u8 = 4;
const NOTICE: u8 = 5;
const INFO: u8 = 6;

/// The payloads of STATUSTEXT that tell a decision: more than one where it is longer than a frame's text.
pub(super) fn status_texts(decision: &DecisionRecord, id: u16) -> Vec<Vec<u8>> {
    let plain = |it: char| if it.is_ascii() && !it.is_ascii_control() { it as u8 } else { b'?' };
    let text: Vec<u8> = decision.text.chars().filter(|it| *it != '`').map(plain).collect();
    let text = &text[..text.len().min(CHUNK * MOST_CHUNKS - 1)];
    // A text that fills a frame ends with it; one of several frames ends with the first zero.
    let is_one = text.len() <= CHUNK;
    let chunks = if is_one { 1 } else { text.len() / CHUNK + 1 };
    let payload = |number: usize| {
        let part = text.get(number * CHUNK..).unwrap_or_default();
        let part = &part[..part.len().min(CHUNK)];
        let mut payload = vec![severity(decision.kind())];
        payload.extend_from_slice(part);
        payload.resize(1 + CHUNK, 0);
        payload.extend(if is_one { [0, 0] } else { id.to_le_bytes() });
        payload.push(number as u8);
        payload
    };
    (0..chunks).map(payload).collect()
}

/// How much it matters to who watches.
fn severity(kind: DecisionKind) -> u8 {
    use DecisionKind::{
        ContingencyAnswered, ContingencyRaised, ContingencyWaits, OrderRefused, PlanHold, PlanLate, PlanRejected,
        ResponseFailed, ResponseSkipped, ResponseWaits,
    };
    match kind {
        ContingencyRaised | ContingencyAnswered | ResponseFailed | ResponseSkipped => WARNING,
        ContingencyWaits | ResponseWaits | OrderRefused | PlanLate | PlanRejected | PlanHold => NOTICE,
        _ => INFO,
    }
}

/// The number of the command that a frame has.
pub(super) fn command_in(frame: &Frame) -> Option<u16> {
    let byte = |at: usize| frame.payload().get(at).copied().unwrap_or(0);
    [COMMAND_INT, COMMAND_LONG].contains(&frame.id()).then(|| u16::from_le_bytes([byte(28), byte(29)]))
}

/// The payload of COMMAND_ACK: we carry out no command of MAVLink.
pub(super) fn not_supported(command: u16, (system, component): (u8, u8)) -> Vec<u8> {
    /// MAV_RESULT_UNSUPPORTED.
    const UNSUPPORTED: u8 = 3;
    let [low, high] = command.to_le_bytes();
    vec![low, high, UNSUPPORTED, 0, 0, 0, 0, 0, system, component]
}
