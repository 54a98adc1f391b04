//! Who may say what over the link, as a list without sides: "the aircraft may publish this key".
//!
//! Both routers take the same list; what one of them lets out the other lets in.

use kittiwake_proto::topics::Service;

use super::{Crossing, Side};
use crate::keys::{self, ROOT};

/// Something that may cross.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Grant {
    /// From whom it comes.
    pub(crate) from: Side,
    pub(crate) act: Act,
    pub(crate) key: String,
}

/// What is done with a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Act {
    Publish,
    Subscribe,
    Ask,
    Answer,
    /// To declare that one answers.
    Serve,
    /// To show that one is there.
    Appear,
    /// To watch who is there.
    Watch,
}

impl Crossing {
    /// What may cross between the ground and one vehicle. What the ground listens to it declares for
    /// every vehicle at once; what it gets to hear is this vehicle's own all the same.
    pub(crate) fn grants(&self, vehicle: &str) -> Vec<Grant> {
        let own = |key: &str| format!("{ROOT}/{vehicle}/{key}");
        let any = |key: &str| format!("{ROOT}/*/{key}");
        let grant = |from, act, key| Grant { from, act, key };
        let mut grants = Vec::new();
        for row in &self.topics {
            let key = row.topic.key();
            grants.push(grant(row.from, Act::Publish, own(key)));
            grants.push(match row.from {
                Side::Aircraft => grant(Side::Ground, Act::Subscribe, any(key)),
                Side::Ground => grant(Side::Aircraft, Act::Subscribe, own(key)),
            });
        }
        for row in &self.services {
            let key = Service::key(row.service);
            grants.push(grant(row.answered_by, Act::Answer, own(key)));
            grants.extend(match row.answered_by {
                Side::Aircraft => {
                    [grant(Side::Ground, Act::Ask, own(key)), grant(Side::Aircraft, Act::Serve, own(key))]
                }
                Side::Ground => [grant(Side::Aircraft, Act::Ask, own(key)), grant(Side::Ground, Act::Serve, any(key))],
            });
        }
        let everyone = keys::alive("*", "*");
        grants.push(grant(Side::Aircraft, Act::Appear, own(&everyone)));
        grants.push(grant(Side::Ground, Act::Watch, any(&everyone)));
        grants
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::file::Source;

    #[test]
    fn nobody_speaks_for_another_and_the_ground_flies_nothing() {
        let text = include_str!("../../../../config/zenoh/link.toml").to_owned();
        let table = Crossing::read(&Source { path: "link.toml".into(), text }).unwrap();
        for grant in table.grants("uav1") {
            let wide = grant.key.starts_with("kw/*/");
            let listening = matches!(grant.act, Act::Subscribe | Act::Serve | Act::Watch) && grant.from == Side::Ground;
            assert!(grant.key.starts_with("kw/uav1/") || (wide && listening), "{grant:?}");
            let flies = grant.key.contains("/fmu/") && grant.from == Side::Ground && grant.act != Act::Subscribe;
            assert!(!flies, "{grant:?}");
        }
    }
}
