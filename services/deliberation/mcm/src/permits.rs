//! What the vehicle may do with its permissions. Three questions; what a permission from before a restart is enough for is on the page of
//! rules, [`domain::trust`].

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::airspace::Grants;
use domain::trust::{Source, To};

/// The permissions at one wake, and what limits their use.
#[derive(Debug, Clone, Default)]
pub(crate) struct Permits {
    /// What the control tower has granted, and for how long from now on.
    pub(crate) grants: Grants,
    /// Where the grants are from that are not live.
    pub(crate) sources: BTreeMap<String, Source>,
    pub(crate) around: BTreeSet<String>,
    /// Areas around the vehicle that take a permission of which the tower has not been heard since the start: for three seconds at most.
    pub(crate) not_heard_yet: BTreeSet<String>,
    pub(crate) flying: bool,
    /// A flag forbids to enter an area in which the vehicle is not already.
    pub(crate) no_new_area: bool,
    /// How far beyond that the response that is under way goes.
    pub(crate) beyond: Beyond,
}

/// How far a response that comes down goes beyond what it is permitted, because anything else harms more, or a pilot has ordered it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) enum Beyond {
    #[default]
    Nowhere,
    /// It reaches no landing otherwise: what is held may be entered, whatever a flag or a restart says.
    Held,
    /// It also enters these areas, without permission.
    Into(BTreeSet<String>),
}

impl Beyond {
    /// The areas that are entered without permission.
    pub(crate) fn areas(&self) -> impl Iterator<Item = &String> {
        let areas = match self {
            Beyond::Into(areas) => Some(areas),
            Beyond::Nowhere | Beyond::Held => None,
        };
        areas.into_iter().flatten()
    }
}

impl Permits {
    /// May it stay where it is, and go on with a step in the air? With everything that was granted, and until the tower is heard in every
    /// area around it: a restart turns no vehicle out.
    pub(crate) fn to_stay(&self) -> Grants {
        let not_heard_yet = self.not_heard_yet.iter().map(|name| (name.clone(), Duration::MAX));
        let mut grants: Grants = not_heard_yet.collect();
        grants.extend(self.grants.clone());
        grants
    }

    /// May it continue into what is right ahead? If not, the vehicle stops before it.
    pub(crate) fn to_continue(&self) -> Grants {
        let mut grants = self.to_stay();
        grants.retain(|name, _| self.is_enough(name, To::GoOn));
        grants
    }

    /// Which areas may a way, a plan or a step on the ground enter? None that a flag forbids, and those that the response enters without
    /// permission.
    pub(crate) fn to_enter(&self) -> Grants {
        let mut grants = self.to_land();
        grants.extend(self.beyond.areas().map(|it| (it.clone(), Duration::MAX)));
        grants
    }

    /// May it come down there as well? Not in what is only entered on the way, without permission.
    pub(crate) fn to_land(&self) -> Grants {
        let mut grants = self.grants.clone();
        let takes_all = self.beyond != Beyond::Nowhere;
        let is_allowed = |area: &String| !self.no_new_area || self.around.contains(area);
        grants.retain(|name, _| takes_all || (is_allowed(name) && self.is_enough_to_begin(name)));
        grants
    }

    /// Whether `area` is held, and only a flag forbids to enter it.
    pub(crate) fn is_only_forbidden(&self, area: &str) -> bool {
        self.grants.contains_key(area) && self.is_enough_to_begin(area)
    }

    fn is_enough_to_begin(&self, area: &str) -> bool {
        self.is_enough(area, if self.flying { To::Plan } else { To::Begin })
    }

    /// In the air, whatever is done in an area around the vehicle is to stay there.
    fn is_enough(&self, area: &str, to: To) -> bool {
        let stays = to != To::Begin && self.around.contains(area);
        let source = self.sources.get(area).copied().unwrap_or(Source::Live);
        source.permits(if stays { To::Stay } else { to })
    }
}

pub(crate) fn held_for(grants: &Grants, margin: Duration) -> Vec<String> {
    grants.iter().filter(|(_, left)| margin < **left).map(|(name, _)| name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use domain::trust::Doubt;

    use super::*;

    /// `here` is around the vehicle, `there` is not, `old` is not; `here` and `old` are from this source.
    fn permits(source: Source) -> Permits {
        let names = |names: &[&str]| names.iter().map(|it| (*it).to_owned()).collect::<BTreeSet<_>>();
        let grants = ["here", "there", "old"].map(|it| (it.to_owned(), Duration::from_secs(60)));
        Permits {
            grants: grants.into(),
            sources: ["here", "old"].map(|it| (it.to_owned(), source)).into(),
            around: names(&["here", "unknown"]),
            not_heard_yet: names(&["unknown"]),
            flying: true,
            no_new_area: false,
            beyond: Beyond::Nowhere,
        }
    }

    #[track_caller]
    fn check(permits: &Permits, stay: &str, go_on: &str, begin: &str) {
        let names = |grants: Grants| grants.into_keys().collect::<Vec<_>>().join(" ");
        assert_eq!(names(permits.to_stay()), stay, "to stay");
        assert_eq!(names(permits.to_continue()), go_on, "to continue");
        assert_eq!(names(permits.to_enter()), begin, "to enter");
    }

    #[test]
    fn restored_knowledge_is_enough_to_stay_not_to_begin() {
        let restored = || permits(Source::Restored);
        let all = restored();
        check(&all, "here old there unknown", "here there unknown", "here old there");
        // The tower should have been heard by now.
        let doubted = || Permits { not_heard_yet: BTreeSet::new(), ..permits(Source::Doubted(Doubt::Unconfirmed)) };
        let late = doubted();
        check(&late, "here old there", "here there", "here there");
        // On the ground waiting costs nothing.
        let on_ground = Permits { flying: false, ..restored() };
        check(&on_ground, "here old there unknown", "here there unknown", "there");
        // A flag forbids new areas.
        let narrowed = Permits { no_new_area: true, ..restored() };
        check(&narrowed, "here old there unknown", "here there unknown", "here");
        let needs = |beyond| Permits { beyond, no_new_area: true, ..doubted() };
        check(&needs(Beyond::Held), "here old there", "here there", "here old there");
        let into = Beyond::Into(["denied".to_owned()].into());
        check(&needs(into), "here old there", "here there", "denied here old there");
    }
}
