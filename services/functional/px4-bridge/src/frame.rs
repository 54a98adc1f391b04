//! The local frame: where its origin is, and a number that changes when positions before and after cannot be compared.

use domain::geodesy::{AutopilotFrame, LatLon, Origin};
use domain::geometry::Ned;

use crate::cdr::{CdrError, Record};

/// A clock that goes back by more than this is another start of PX4. (Samples of one topic come in order.)
const RESTART_US: u64 = 500_000;

/// What is known of the frame.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    jump_m: f64,
    origin: Option<Origin>,
    reference: Option<Reference>,
    /// Starts of PX4 and jumps of the frame that were seen.
    moves: u16,
}

/// What the estimator says of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reference {
    /// When the origin was set, by PX4's clock.
    set_us: u64,
    resets: (u64, u64),
    is_valid: bool,
}

impl Frame {
    /// Not known yet. A reset that moves the vehicle by less than `jump_m` moves no frame.
    pub(crate) fn new(jump_m: f64) -> Frame {
        Frame { jump_m, origin: None, reference: None, moves: 0 }
    }

    /// The origin, while PX4 knows it.
    pub(crate) fn origin(&self) -> Option<Origin> {
        self.origin
    }

    /// A position of PX4's local frame as it is in ours, while the origin is known.
    pub(crate) fn to_ours(&self, position: Ned) -> Ned {
        self.of_px4().map_or(position, |it| it.to_ours(position))
    }

    /// A position of our local frame as it is in PX4's, while the origin is known.
    pub(crate) fn to_its(&self, position: Ned) -> Ned {
        self.of_px4().map_or(position, |it| it.to_its(position))
    }

    fn of_px4(&self) -> Option<AutopilotFrame> {
        Some(AutopilotFrame::of_px4(self.origin?.place))
    }

    /// Changes with the frame. The same for a bridge that was started again, as long as no reset was seen; 0 while there is no frame.
    pub(crate) fn epoch(&self) -> u64 {
        self.reference.filter(|it| it.is_valid).map_or(0, |it| (it.set_us << 16) | u64::from(self.moves))
    }

    /// PX4 was started again.
    pub(crate) fn restarted(&mut self) {
        self.moves = self.moves.wrapping_add(1);
        self.origin = None;
        self.reference = None;
    }

    /// Takes in a sample of the local position.
    ///
    /// # Errors
    /// If this version lacks a field.
    pub(crate) fn read(&mut self, position: &Record<'_>) -> Result<(), CdrError> {
        let number = |field| position.number(field);
        let place = LatLon::new(number("ref_lat")?, number("ref_lon")?).ok();
        let is_global = position.flag("xy_global")?;
        let altitude_m = Some(number("ref_alt")?).filter(|it| it.is_finite());
        let altitude_m = if position.flag("z_global")? { altitude_m } else { None };
        self.origin = place.filter(|_| is_global).map(|place| Origin { place, altitude_m });
        let reference = Reference {
            set_us: position.unsigned("ref_timestamp")?,
            resets: (position.unsigned("xy_reset_counter")?, position.unsigned("z_reset_counter")?),
            is_valid: position.flag("xy_valid")? && position.flag("z_valid")? && self.origin.is_some(),
        };
        let moved_m =
            (position.number_at("delta_xy", 0)?.hypot(position.number_at("delta_xy", 1)?), number("delta_z")?.abs());
        if let Some(before) = self.reference.filter(|it| it.is_valid) {
            // Treat NaN as a jump.
            let far = |counted: bool, moved_m: f64| counted && (moved_m.is_nan() || self.jump_m <= moved_m);
            let horizontal = far(before.resets.0 != reference.resets.0, moved_m.0);
            if horizontal || far(before.resets.1 != reference.resets.1, moved_m.1) {
                self.moves = self.moves.wrapping_add(1);
            }
        }
        self.reference = Some(reference);
        Ok(())
    }
}

/// Whether a clock that showed `before` and shows `now` was started again in between.
pub(crate) fn is_restart(before_us: u64, now_us: u64) -> bool {
    now_us.saturating_add(RESTART_US) < before_us
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_goes_back_by_far_was_started_again_whatever_it_shows() {
        #[track_caller]
        fn check(before_us: u64, now_us: u64, expected: bool) {
            assert_eq!(is_restart(before_us, now_us), expected, "{before_us}, {now_us}");
        }
        check(10_000_000, 9_500_000, false);
        check(10_000_000, 9_499_999, true);
        check(u64::MAX, u64::MAX - 1, false);
        check(10_000_000, u64::MAX, false);
        check(u64::MAX, 0, true);
    }
}
