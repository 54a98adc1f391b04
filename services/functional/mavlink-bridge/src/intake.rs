//! Takes frames out of a link: so much in one turn, and the rest in the next one, which comes at once.
//!
//! Whatever arrives, believed or not, and however fast: the layers above are listened to in between, and the loop of the process turns.

use domain::time::Time;

use crate::frame::{Found, Framer};
use crate::link::Link;

/// As many pieces are taken in before the layers above are listened to again.
const PIECES: usize = 256;
/// And as many bytes, but for the rest of the last piece: more than the fullest link brings in a second. Where they are made so that a frame
/// might begin everywhere, looking at them takes some hundredths of a second.
const BYTES: usize = 128 * 1024;

/// What one link has brought.
#[derive(Debug, Default)]
pub(crate) struct Intake {
    framer: Framer,
    /// What is left of this turn.
    pieces: usize,
    bytes: usize,
    /// This turn ended before the link was empty, as far as is known: nothing else may wake the loop for the rest.
    goes_on_at: Option<Time>,
}

impl Intake {
    /// A turn begins.
    pub(crate) fn begin_turn(&mut self) {
        (self.pieces, self.bytes, self.goes_on_at) = (PIECES, BYTES, None);
    }

    /// What was found in the next piece, which may be nothing; `None` ends the turn.
    pub(crate) fn next(&mut self, link: &mut impl Link, now: Time) -> Option<Vec<Found>> {
        if self.pieces == 0 || self.bytes == 0 {
            self.goes_on_at = Some(now);
            return None;
        }
        let bytes = link.receive(now)?;
        self.pieces -= 1;
        self.bytes = self.bytes.saturating_sub(bytes.len() + link.not_believed());
        Some(if link.is_datagram() { Framer::datagram(&bytes) } else { self.framer.push(&bytes) })
    }

    /// When the rest is taken in, if there may be one.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.goes_on_at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// There is always one more piece.
    #[derive(Debug)]
    struct Flood {
        piece: usize,
        not_believed: usize,
    }

    impl Link for Flood {
        fn receive(&mut self, _: Time) -> Option<Vec<u8>> {
            Some(vec![0; self.piece])
        }
        fn send(&mut self, _: &[u8], _: Time) {}
        fn is_datagram(&self) -> bool {
            true
        }
        fn not_believed(&self) -> usize {
            self.not_believed
        }
    }

    /// In each turn `expected` pieces are taken in, and the next one comes at once.
    #[track_caller]
    fn check(piece: usize, not_believed: usize, expected: usize) {
        let (mut link, mut intake) = (Flood { piece, not_believed }, Intake::default());
        for _ in 0..2 {
            intake.begin_turn();
            assert_eq!(intake.deadline(), None);
            let taken = std::iter::from_fn(|| intake.next(&mut link, Time::ZERO)).count();
            assert_eq!((taken, intake.deadline()), (expected, Some(Time::ZERO)));
        }
    }

    #[test]
    fn a_turn_ends_after_so_many_pieces_or_bytes_believed_or_not() {
        check(20, 0, PIECES);
        check(0, 20, PIECES);
        check(9_000, 0, BYTES.div_ceil(9_000));
        check(0, 9_000, BYTES.div_ceil(9_000));
        check(4_000, 5_000, BYTES.div_ceil(9_000));
    }
}
