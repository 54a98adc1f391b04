//! New editions of the data sets that areas came from, for the mission that is flown: their areas are replaced, everything else stays as
//! it is, with what was reached.

use domain::area::Area;
use domain::file::MOST_MISTAKES;
use domain::mission::feeds::Airspace;
use domain::mission::{Mission, unfit_landing_site};
use domain::state::State;
use domain::time::Now;

use crate::lasting_areas::{Closed, added_over_the_vehicle, with_lasting_areas};
use crate::mission_planner::MissionPlanner;
use crate::mission_request::{Reply, judged, mistakes_in_text, source};

/// The areas of the mission file `text` that came from feeds take the place of the present ones, if what is left of the mission can be
/// flown then. With `is_tried` nothing is changed. What the tower has closed stays.
pub(crate) fn adopt(
    planner: &mut MissionPlanner,
    (text, is_tried): (&str, bool),
    closed: &Closed,
    state: &State,
    now: Now,
) -> Result<Reply, Reply> {
    let airspace = Airspace::read(&source(text)?).map_err(mistakes_in_text)?;
    let mission = with_airspace(planner.rest_of_mission(), airspace)?;
    let (mission, stays) = with_lasting_areas(planner, closed, mission, |_| true)?;
    let last = mission.objectives.len().saturating_sub(1);
    let mut objectives = mission.objectives.iter().enumerate();
    if let Some(why) = objectives.find_map(|(index, it)| mission.unfit_place(it, index == last)) {
        return Err(Reply::new(format!("{why}; skip or remove it first, or leave that area out")));
    }
    let forecast = judged(planner, &mission, planner.rules().wind, state, now)?;
    let verb = if is_tried { "would be adopted" } else { "adopted" };
    let text = format!("new airspace {verb}");
    let text = with_feeds(text, planner.mission(), &mission, now);
    let over = added_over_the_vehicle(planner.mission(), &mission, state, now).into_iter();
    let over = over.map(|(_, words)| format!("{words}, and leaves it"));
    let text = [text].into_iter().chain(stays).chain(over).chain(closed_sites(&mission)).collect::<Vec<_>>();
    let text = planner.with_wind(text.join("; "), &mission);
    if !is_tried {
        planner.replace_airspace(mission.areas, mission.feeds);
    }
    Ok(Reply { forecast: Some(forecast), ..Reply::new(text) })
}

/// The mission with its own areas, and with those of feeds in place of the ones that came from feeds before.
fn with_airspace(mission: Mission, airspace: Airspace) -> Result<Mission, Reply> {
    if airspace.origin != mission.origin {
        return Err(Reply::new(
            "the origin in the text is not that of the present mission: its areas would lie elsewhere",
        ));
    }
    let is_own = |it: &&Area| mission.feed_of(&it.name).is_none_or(|feed| !feed.is_data_set());
    let mut areas: Vec<Area> = mission.areas.iter().filter(is_own).cloned().collect();
    let is_of_feed = |it: &Area| airspace.feeds.iter().any(|feed| feed.areas.contains(&it.name));
    for area in airspace.areas.iter().filter(|it| is_of_feed(it)) {
        if areas.iter().any(|own| own.name == area.name) {
            let text = format!(
                "the mission has an area `{}` of its own already: rename the one that came from a feed",
                area.name
            );
            return Err(Reply::new(text));
        }
        areas.push(area.clone());
    }
    Ok(Mission { areas, feeds: airspace.feeds, ..mission })
}

/// The landing sites that lie in areas which always apply. That is no reason to fly on in ignorance of the areas.
fn closed_sites(mission: &Mission) -> Vec<String> {
    let always = || mission.areas.iter().filter(|it| it.always_applies());
    let closed = |it: &domain::site::Site| {
        let unfit = unfit_landing_site(it.position, always().filter(|area| !area.takes(it.kind.harm())))?;
        Some(format!("site `{}` {unfit}", it.name))
    };
    mission.sites.iter().filter_map(closed).collect()
}

/// `text`, and which editions come in place of which, and those that are out of date: that is what the audit trail keeps.
pub(crate) fn with_feeds(text: String, before: &Mission, after: &Mission, now: Now) -> String {
    let told = |mission: &Mission| -> Vec<String> {
        mission.feeds.iter().map(|it| format!("{} ({} areas)", it.in_words(), it.areas.len())).collect()
    };
    let (old, new) = (told(before), told(after));
    if old == new {
        return text;
    }
    let list = |feeds: Vec<String>| if feeds.is_empty() { "no feed".to_owned() } else { feeds.join(" and ") };
    let change = format!("{} in place of {}", list(new), list(old));
    let out_of_date = after.out_of_date_feeds(now.utc_ms).into_iter().take(MOST_MISTAKES);
    [text, change].into_iter().chain(out_of_date).collect::<Vec<_>>().join("; ")
}
