//! Airspace belongs to the ground: an upload opens nothing.

use std::collections::{BTreeMap, BTreeSet};

use domain::area::Area;
use kittiwake_proto::v1::{self, PermissionState};

use super::View;
use crate::inside::is_inside;

pub(super) const IN_WORDS: &str = "does not enter an area that the tower has denied or revoked because a mission that was uploaded since does not list it (issue 44, P6)";

#[derive(Debug, Default)]
pub(super) struct Upload {
    /// Areas that were closed and are not listed any more.
    removed: Vec<Area>,
    told: BTreeSet<String>,
}

impl Upload {
    /// The status lists these areas in place of those before.
    pub(super) fn listed(
        &mut self,
        before: &v1::MissionStatus,
        now: &v1::MissionStatus,
        permissions: &BTreeMap<String, v1::Permission>,
    ) {
        self.removed.retain(|removed| now.areas.iter().all(|it| it.name != removed.name));
        let was_closed = |area: &&v1::Area| {
            let state = permissions.get(&area.name).map(v1::Permission::state);
            matches!(state, Some(PermissionState::Denied | PermissionState::Revoked))
        };
        let is_gone = |area: &&v1::Area| now.areas.iter().all(|it| it.name != area.name);
        let gone = before.areas.iter().filter(was_closed).filter(is_gone);
        self.removed.extend(gone.cloned().filter_map(|it| it.try_into().ok()));
    }

    pub(super) fn see(&mut self, view: &View<'_>) -> Option<String> {
        if view.truth.standing || !view.heard.flies_itself {
            return None;
        }
        let (at, utc_ms) = (view.truth.position, view.heard.now.utc_ms);
        let entered = self.removed.iter().find(|it| is_inside(it, at) && view.is_closed(it, utc_ms))?;
        let is_news = self.told.insert(entered.name.clone());
        is_news.then(|| {
            format!("it entered area {}, which the tower had closed before an upload left it out", entered.name)
        })
    }
}
