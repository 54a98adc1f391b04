//! What the manager knows of the mission's areas. The planner tells them; until it has been heard, those of the mission's file count if
//! they are the ones that were flown among before.

use std::sync::Arc;

use domain::area::Area;
use domain::mission::identity_of_areas;

/// The areas, and whether there may be others.
#[derive(Debug, Default)]
pub(crate) struct KnownAreas {
    /// None as long as they are unknown.
    all: Arc<[Area]>,
    from: KnownFrom,
    /// Of these areas, or, as long as they are unknown, of those that were known before a restart; empty if none were.
    identity: String,
    of_file: Arc<[Area]>,
}

/// Where the areas are known from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum KnownFrom {
    /// Nowhere: the vehicle may be in the air among areas that nobody has told.
    #[default]
    Nowhere,
    /// The mission's file has those that are remembered.
    Memory,
    Planner,
}

impl KnownAreas {
    /// All of them, as far as they are known.
    pub(crate) fn all(&self) -> &Arc<[Area]> {
        &self.all
    }

    /// Whether they are known at all.
    pub(crate) fn is_known(&self) -> bool {
        self.from != KnownFrom::Nowhere
    }

    /// What tells the areas that are known from others, to be remembered.
    pub(crate) fn identity(&self) -> &str {
        &self.identity
    }

    /// The mission's file has these areas.
    pub(crate) fn expect(&mut self, of_file: &[Area]) {
        self.of_file = of_file.into();
    }

    /// Before a restart the areas of this identity were known.
    pub(crate) fn restore(&mut self, identity: String) {
        if identity == identity_of_areas(&self.of_file) {
            (self.all, self.from) = (self.of_file.clone(), KnownFrom::Memory);
        }
        self.identity = identity;
    }

    /// The memory is lost or outdated, so the areas may have changed since. What the planner told stays.
    pub(crate) fn doubt_memory(&mut self) {
        if self.from != KnownFrom::Planner {
            self.forget();
        }
    }

    /// Drops the areas: they may be those of another mission.
    pub(crate) fn forget(&mut self) {
        (self.all, self.from) = (Arc::default(), KnownFrom::Nowhere);
        self.identity.clear();
    }

    /// The planner tells its areas. One that `has_lost` its memory may tell those of another mission: known areas then stay, and unknown ones stay
    /// unknown, unless the planner tells the same areas that were known before the restart.
    pub(crate) fn hear(&mut self, told: &[Area], has_lost: bool) {
        if !self.is_known() && has_lost && identity_of_areas(told) != self.identity {
            return;
        }
        let is_missing = |it: &&Area| has_lost && !told.contains(*it);
        let kept: Vec<&Area> = self.all.iter().filter(is_missing).collect();
        let is_news = self.all.len() != told.len() + kept.len() || !told.iter().eq(self.all.iter().take(told.len()));
        if is_news {
            self.all = told.iter().chain(kept).cloned().collect();
        }
        if is_news || !self.is_known() {
            self.identity = identity_of_areas(&self.all);
        }
        self.from = KnownFrom::Planner;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::area::AreaKind;
    use domain::geometry::Ned;

    fn areas(names: &str) -> Vec<Area> {
        let area = |name: char| {
            Area::new(
                name,
                AreaKind::KeepOut,
                [(0.0, 0.0), (9.0, 0.0), (9.0, 9.0)].map(|(north_m, east_m)| Ned::new(north_m, east_m, 0.0)).to_vec(),
            )
        };
        names.chars().map(area).collect()
    }

    fn names(known: &KnownAreas) -> String {
        known.all().iter().map(|it| it.name.as_str()).collect()
    }

    #[test]
    fn those_of_the_file_count_after_a_restart_if_they_are_the_ones_of_before() {
        /// `flown`: among which the manager before flew, by the planner's word; `None` if it had not heard any.
        #[track_caller]
        fn check(file: &str, flown: Option<&str>, expected: Option<&str>) {
            let mut before = KnownAreas::default();
            flown.into_iter().for_each(|it| before.hear(&areas(it), false));
            let mut known = KnownAreas::default();
            known.expect(&areas(file));
            known.restore(before.identity().to_owned());
            assert_eq!(known.is_known().then(|| names(&known)).as_deref(), expected);
            assert_eq!(known.identity(), before.identity(), "the next restart remembers the same");
        }
        check("ab", Some("ab"), Some("ab"));
        check("", Some(""), Some(""));
        check("ab", Some("a"), None);
        check("ab", Some("ba"), None);
        check("ab", None, None);
        check("", None, None);
    }

    #[test]
    fn after_both_are_started_again_a_planner_that_has_lost_what_it_knew_tells_nothing_of_what_was_known() {
        /// Known after a planner has told that, and has lost what it knew or has not. `flown`: among which the manager before flew; `None` if it has
        /// lost that as well.
        #[track_caller]
        fn check(flown: Option<&str>, told: &[(&str, bool)], expected: Option<&str>) {
            let mut known = KnownAreas::default();
            known.expect(&areas("ab"));
            known.restore(flown.map(|it| identity_of_areas(&areas(it))).unwrap_or_default());
            told.iter().for_each(|(names, has_lost)| known.hear(&areas(names), *has_lost));
            assert_eq!(known.is_known().then(|| names(&known)).as_deref(), expected);
        }
        check(Some("abx"), &[("ab", true)], None);
        check(Some("abx"), &[("ab", true), ("ab", true)], None);
        // An operator has accepted that.
        check(Some("abx"), &[("ab", true), ("ab", false)], Some("ab"));
        check(Some("abx"), &[("abx", true)], Some("abx"));
        check(Some("abx"), &[("abx", false)], Some("abx"));
        check(Some("ab"), &[("c", true)], Some("cab"));
        check(None, &[("ab", true)], None);
        check(None, &[("ab", true), ("ab", false)], Some("ab"));
        check(None, &[("ab", false)], Some("ab"));
    }

    #[test]
    fn what_is_known_from_a_memory_is_not_once_that_is_lost_and_what_the_planner_tells_is() {
        #[derive(Clone, Copy)]
        enum Then {
            /// It turns out to be lost.
            Doubt,
            /// The manager is started once more.
            Restart,
            /// A planner tells these, and has lost what it knew or has not.
            Hear(&'static str, bool),
        }
        use Then::{Doubt, Hear, Restart};
        /// Known after a restart over a memory that names the areas of the file, and what comes then.
        #[track_caller]
        fn check(events: &[Then], expected: Option<&str>) {
            let begun = |identity: String| {
                let mut known = KnownAreas::default();
                known.expect(&areas("ab"));
                known.restore(identity);
                known
            };
            let mut known = begun(identity_of_areas(&areas("ab")));
            for event in events {
                match *event {
                    Doubt => known.doubt_memory(),
                    Restart => known = begun(known.identity().to_owned()),
                    Hear(told, has_lost) => known.hear(&areas(told), has_lost),
                }
            }
            assert_eq!(known.is_known().then(|| names(&known)).as_deref(), expected);
        }
        check(&[], Some("ab"));
        check(&[Restart], Some("ab"));
        check(&[Doubt], None);
        check(&[Doubt, Restart], None);
        check(&[Doubt, Hear("ab", true)], None);
        check(&[Doubt, Restart, Hear("ab", true)], None);
        check(&[Doubt, Hear("abx", false)], Some("abx"));
        check(&[Hear("abx", false), Doubt], Some("abx"));
        check(&[Hear("abx", false), Restart, Doubt, Hear("abx", true)], None);
    }

    #[test]
    fn a_planner_that_has_lost_what_it_knew_adds_areas_and_takes_none_away() {
        #[track_caller]
        fn check(told: &[(&str, bool)], expected: &str) {
            let mut known = KnownAreas::default();
            for (names, has_lost) in told {
                known.hear(&areas(names), *has_lost);
                let all = known.all().clone();
                known.hear(&areas(names), *has_lost);
                assert!(Arc::ptr_eq(&all, known.all()), "the same again is no news");
                let identity = if known.is_known() { identity_of_areas(known.all()) } else { String::new() };
                assert_eq!(known.identity(), identity);
            }
            assert_eq!(names(&known), expected);
        }
        check(&[("ab", false), ("bc", false)], "bc");
        check(&[("ab", false), ("bc", true)], "bca");
        check(&[("ab", false), ("", true)], "ab");
        check(&[("ab", false), ("c", true), ("c", false)], "c");
        check(&[("ab", true)], "");
        check(&[("ab", true), ("a", false), ("ab", true)], "ab");
    }
}
