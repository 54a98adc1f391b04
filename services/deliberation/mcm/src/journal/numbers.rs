//! The numbers of records, which never begin again within a flight, also where the process does.

/// Numbers are persisted in blocks, so that not every decision is a write to the disk. (ENG: a busy minute.)
const BLOCK: u64 = 256;

#[derive(Debug, Default)]
pub(crate) struct Numbers {
    newest: u64,
}

impl Numbers {
    pub(crate) fn take_next(&mut self) -> u64 {
        self.newest = self.newest.saturating_add(1);
        self.newest
    }

    /// A number above all that were given, to be persisted. It rises a block at a time, and at least a block before it is needed,
    /// so that it is on the disk by then.
    pub(crate) fn ceiling(&self) -> u64 {
        (self.newest / BLOCK).saturating_add(2).saturating_mul(BLOCK)
    }

    /// Goes on above the persisted ceiling of the process before.
    pub(crate) fn go_on_above(&mut self, ceiling: u64) {
        self.newest = self.newest.max(ceiling);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_persisted_a_block_before_it_is_used() {
        let (mut numbers, mut persisted) = (Numbers::default(), Vec::new());
        for expected in 1..=1000 {
            persisted.push(numbers.ceiling());
            assert_eq!(numbers.take_next(), expected);
        }
        // A process that is killed has saved at least what it knew a block of decisions ago.
        for (number, ceiling) in (1 + BLOCK..=1000).zip(&persisted) {
            assert!(number <= *ceiling, "{number} may be used while {ceiling} is on the disk");
        }
        persisted.dedup();
        assert_eq!(persisted, [2 * BLOCK, 3 * BLOCK, 4 * BLOCK, 5 * BLOCK]);
    }

    #[test]
    fn another_process_goes_on_above_the_ceiling() {
        let mut before = Numbers::default();
        (0..300).for_each(|_| {
            before.take_next();
        });
        let mut after = Numbers::default();
        after.go_on_above(before.ceiling());
        assert_eq!(after.take_next(), 3 * BLOCK + 1);
        after.go_on_above(5);
        assert_eq!(after.take_next(), 3 * BLOCK + 2, "never back");
    }
}
