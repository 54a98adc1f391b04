//! What the vehicle may do with its permissions. Three questions, each with one rule for what was granted before a restart: restored
//! knowledge is enough to stay, not to begin.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::airspace::Grants;

/// The permissions at one wake, and what limits their use.
#[derive(Debug, Clone, Default)]
pub(crate) struct Permits {
    /// What the control tower has granted, and for how long from now on.
    pub(crate) grants: Grants,
    /// Areas among them that were granted before the start of this process and not confirmed since.
    pub(crate) restored: BTreeSet<String>,
    /// The areas around the vehicle.
    pub(crate) around: BTreeSet<String>,
    /// Areas around the vehicle that take a permission, while the tower has not been heard since the start and may still be.
    pub(crate) unknown: BTreeSet<String>,
    /// The vehicle flies.
    pub(crate) flying: bool,
    /// There is time left to hear the tower after the start.
    pub(crate) may_hear: bool,
    /// A flag forbids to enter an area in which the vehicle is not already.
    pub(crate) no_new_area: bool,
    /// The response that is under way reaches no landing otherwise: what is held may be entered, whatever a flag or a restart says.
    pub(crate) needs_held: bool,
}

impl Permits {
    /// May it stay where it is, and go on with a step in the air? With everything that was granted, and until the tower is heard in every
    /// area around it: a restart turns no vehicle out.
    pub(crate) fn to_stay(&self) -> Grants {
        let unknown = self.unknown.iter().map(|name| (name.clone(), Duration::MAX));
        let mut grants: Grants = unknown.collect();
        grants.extend(self.grants.clone());
        grants
    }

    /// May it continue into what is right ahead? Not into another area by a restored permission: the vehicle stops before it.
    pub(crate) fn to_continue(&self) -> Grants {
        let mut grants = self.to_stay();
        grants.retain(|name, _| !self.restored.contains(name) || self.around.contains(name));
        grants
    }

    /// May a way, a plan or a step on the ground begin? Not into another area by a restored permission once the tower should have
    /// confirmed it, which costs nothing on the ground; nor into one that a flag forbids.
    pub(crate) fn to_begin(&self) -> Grants {
        let mut grants = self.grants.clone();
        grants.retain(|name, _| self.needs_held || (self.is_allowed(name) && !self.is_unconfirmed(name)));
        grants
    }

    /// The same with everything that is held, as a response may if it reaches no landing otherwise.
    pub(crate) fn with_all_held(&self) -> Grants {
        self.grants.clone()
    }

    /// Whether `area` is held, and only a flag forbids to enter it.
    pub(crate) fn is_only_forbidden(&self, area: &str) -> bool {
        self.grants.contains_key(area) && !self.is_unconfirmed(area)
    }

    fn is_allowed(&self, area: &str) -> bool {
        !self.no_new_area || self.around.contains(area)
    }

    fn is_unconfirmed(&self, area: &str) -> bool {
        let is_due = !self.flying || !self.may_hear;
        let stays = self.flying && self.around.contains(area);
        self.restored.contains(area) && is_due && !stays
    }
}

/// The areas that are held for longer than `margin`.
pub(crate) fn held_for(grants: &Grants, margin: Duration) -> Vec<String> {
    grants.iter().filter(|(_, left)| margin < **left).map(|(name, _)| name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `here` is around the vehicle, `there` is not, `old` is not and was granted before the start.
    fn permits() -> Permits {
        let names = |names: &[&str]| names.iter().map(|it| (*it).to_owned()).collect::<BTreeSet<_>>();
        let grants = ["here", "there", "old"].map(|it| (it.to_owned(), Duration::from_secs(60)));
        Permits {
            grants: grants.into(),
            restored: names(&["here", "old"]),
            around: names(&["here", "unknown"]),
            unknown: names(&["unknown"]),
            flying: true,
            may_hear: true,
            no_new_area: false,
            needs_held: false,
        }
    }

    #[track_caller]
    fn check(permits: &Permits, stay: &str, go_on: &str, begin: &str) {
        let names = |grants: Grants| grants.into_keys().collect::<Vec<_>>().join(" ");
        assert_eq!(names(permits.to_stay()), stay, "to stay");
        assert_eq!(names(permits.to_continue()), go_on, "to continue");
        assert_eq!(names(permits.to_begin()), begin, "to begin");
    }

    #[test]
    fn restored_knowledge_is_enough_to_stay_not_to_begin() {
        let all = permits();
        check(&all, "here old there unknown", "here there unknown", "here old there");
        // The tower should have been heard by now.
        let late = Permits { may_hear: false, unknown: BTreeSet::new(), ..permits() };
        check(&late, "here old there", "here there", "here there");
        // On the ground waiting costs nothing.
        let on_ground = Permits { flying: false, ..permits() };
        check(&on_ground, "here old there unknown", "here there unknown", "there");
        // A flag forbids new areas.
        let narrowed = Permits { no_new_area: true, ..permits() };
        check(&narrowed, "here old there unknown", "here there unknown", "here");
        let needs = Permits { needs_held: true, may_hear: false, unknown: BTreeSet::new(), ..narrowed };
        check(&needs, "here old there", "here there", "here old there");
    }
}
