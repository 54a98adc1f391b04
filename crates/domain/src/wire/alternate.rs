//! Where a flight may end early, as published.

use kittiwake_proto::v1;

use crate::alternates::{Alternate, Role};

impl From<Role> for v1::AlternateRole {
    fn from(role: Role) -> v1::AlternateRole {
        match role {
            Role::Home => v1::AlternateRole::Home,
            Role::Site => v1::AlternateRole::Site,
            Role::Objective => v1::AlternateRole::Objective,
            Role::Ordered => v1::AlternateRole::Ordered,
        }
    }
}

impl From<&Alternate> for v1::Alternate {
    fn from(it: &Alternate) -> v1::Alternate {
        let way = it.way.as_ref().map(|(way, _)| way);
        v1::Alternate {
            role: v1::AlternateRole::from(it.candidate.role) as i32,
            name: it.candidate.name.clone(),
            position: Some(it.candidate.position.into()),
            kind: v1::SiteKind::from(it.candidate.kind) as i32,
            length_m: way.map(|it| it.length_m),
            time_s: way.map(|it| it.time_s),
            energy_wh: way.map(|it| it.energy_wh),
            charge: it.charge,
            permissions: way.map_or_else(Vec::new, |it| it.needs.clone()),
            why_not: it.why_not().unwrap_or_default(),
            failed_landings: it.failed_landings,
        }
    }
}
