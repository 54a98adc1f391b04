//! The legs that were looked at, with what they touch, whatever the time.

use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::legs::Touched;
use crate::geometry::Ned;
use crate::outline::Outline;
use crate::way::Exempt;

/// More legs than this are not kept: at 100 to 200 bytes each, what one process remembers stays below 20 MB. (A search looks at
/// 20,000 at most.)
const MOST_KEPT: usize = 100_000;

/// Where more areas than this have changed at once, all legs are forgotten: to tell which would take longer than to look again.
const MOST_CHANGED: usize = 16;

/// Legs, by all that decides what they touch.
#[derive(Debug, Clone, Default)]
pub(crate) struct KeptLegs(RefCell<HashMap<Key, Arc<Touched>>>);

/// A leg, and how it was looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    /// The bits of both ends' coordinates: equal ones are the same leg.
    ends: [u64; 6],
    /// As bits too.
    margin_m: u64,
    exempt: Exempt,
    stops_at_walls: bool,
}

impl KeptLegs {
    /// What the leg touches: as it was found before, or as `look` finds it now.
    pub(super) fn get(
        &self,
        (here, there): (Ned, Ned),
        margin_m: f64,
        exempt: Exempt,
        stops_at_walls: bool,
        look: impl FnOnce() -> Touched,
    ) -> Arc<Touched> {
        let ends = [here.north_m, here.east_m, here.down_m, there.north_m, there.east_m, there.down_m];
        let key = Key { ends: ends.map(f64::to_bits), margin_m: margin_m.to_bits(), exempt, stops_at_walls };
        let mut kept = self.0.borrow_mut();
        if let Some(touched) = kept.get(&key) {
            return touched.clone();
        }
        if kept.len() == MOST_KEPT {
            kept.clear();
        }
        let touched = Arc::new(look());
        kept.insert(key, touched.clone());
        touched
    }

    /// Forgets the legs that come near any of `changed`. The others touch the same areas as before, by the new index of each.
    pub(crate) fn forget_near(&mut self, changed: &[Outline], moved_to: &BTreeMap<usize, usize>) {
        if MOST_CHANGED < changed.len() {
            return self.0.get_mut().clear();
        }
        let is_same = moved_to.iter().all(|(before, now)| before == now);
        self.0.get_mut().retain(|key, touched| {
            let [north_m, east_m, down_m, there @ ..] = key.ends.map(f64::from_bits);
            let (here, there) = (Ned::new(north_m, east_m, down_m), Ned::new(there[0], there[1], there[2]));
            let margin_m = f64::from_bits(key.margin_m);
            if changed.iter().any(|it| !it.is_beyond(margin_m, here, there) && !it.is_aside(margin_m, here, there)) {
                return false;
            }
            if is_same {
                return true;
            }
            let moved = touched.moved(moved_to);
            let is_known = moved.is_some();
            moved.into_iter().for_each(|it| *touched = Arc::new(it));
            is_known
        });
    }

    #[cfg(test)]
    pub(super) fn count(&self) -> usize {
        self.0.borrow().len()
    }
}
