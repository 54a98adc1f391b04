//! The way that would be flown, for `kittiwake mission export --route`: the legs that `kittiwake plan` prints.

use std::path::Path;

use domain::file::Mistakes;
use domain::geometry::Ned;
use formats::export::Leg;
use formats::{Note, Weight};
use kittiwake_proto::v1;

use crate::check_inputs;
use crate::plan;
use crate::settings::Settings;

/// The legs of a mission file, and why it must not be flown, if so.
///
/// # Errors
/// The mistakes in the mission, the configuration and what belongs to it.
pub(super) fn route(mission: &Path, config: &Path) -> Result<(Vec<Leg>, Option<Note>), Mistakes> {
    let settings = Settings { mission: Some(mission.to_owned()), ..Settings::of_file(config) };
    let reply = plan::forecast(&check_inputs::read(&settings)?, None)?;
    let refused = (!reply.accepted).then(|| Note {
        path: mission.to_owned(),
        place: "route".into(),
        text: format!("the mission must not be flown: {}", reply.text),
        weight: Weight::LeftOut,
    });
    Ok((reply.forecast.iter().flat_map(legs).collect(), refused))
}

fn legs(objective: &v1::ObjectiveForecast) -> Vec<Leg> {
    let mut begins_s = objective.begins_s;
    let leg = |leg: &v1::LegForecast| {
        let place = |it: Option<v1::Ned>| it.map_or(Ned::default(), |it| Ned::new(it.north_m, it.east_m, it.down_m));
        let found = Leg {
            objective: objective.objective.clone(),
            text: leg.text.clone(),
            way: (place(leg.from), place(leg.to)),
            begins_s,
            time_s: leg.time_s,
        };
        begins_s += leg.time_s;
        found
    };
    objective.legs.iter().map(leg).collect()
}
