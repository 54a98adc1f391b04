//! Commands and their results, in MAVLink's numbers.

/// MAV_RESULT_ACCEPTED.
pub const ACCEPTED: u8 = 0;
/// MAV_RESULT_IN_PROGRESS: another acknowledgement follows.
pub const IN_PROGRESS: u8 = 5;

/// A command of seven numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberedCommand {
    /// MAV_CMD.
    pub number: u16,
    /// Its parameters.
    pub params: [f64; 7],
    /// How often it was sent before.
    pub repeats: u8,
}

/// A MAV_RESULT that is a refusal.
pub fn in_words(result: u8) -> &'static str {
    match result {
        1 => "temporarily rejected",
        2 => "denied",
        3 => "unsupported",
        4 => "failed",
        6 => "cancelled",
        _ => "refused",
    }
}
