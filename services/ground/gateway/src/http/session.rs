//! The client's name and roles, and the part of the configuration that it needs.

use axum::Extension;
use axum::extract::State;
use axum::response::Response;
use domain::contingency::snapshot::Field;
use domain::contingency::{Contingencies, Row, hazard};
use kittiwake_proto::v1;
use kittiwake_proto::v1::session::{Threshold, Waiver, WithoutContact};

use crate::http::answer::document;
use crate::http::guard::AuthorizedRequest;
use crate::http::page;
use crate::http::site::Site;

pub(crate) async fn session(State(site): State<Site>, Extension(request): Extension<AuthorizedRequest>) -> Response {
    document(&v1::Session {
        name: request.who.name.to_string(),
        roles: request.who.role_names(),
        simulation: site.api.config.simulation,
        status_rate_hz: site.api.config.status_rate_hz.get(),
        speed: site.api.ages.pace.speed(),
        page: page::tag(),
        ..v1::Session::clone(&site.api.of_table)
    })
}

/// The part of every session that comes from the contingency table.
pub(crate) fn of_table(table: &Contingencies) -> v1::Session {
    let rows = table.rows();
    v1::Session {
        thresholds: thresholds(rows),
        without_contact: without_contact(rows),
        waivers: waivers(table.waivers()),
        flags: rows.iter().map(|it| it.flag.clone()).collect(),
        ..Default::default()
    }
}

/// The values at which rows of the contingency table act, in the order of the rows. An expression has one if it is one
/// comparison of a field with a constant.
fn thresholds(rows: &[Row]) -> Vec<Threshold> {
    let of_row = |row: &Row| {
        let threshold = row.when.as_ref()?.raises.threshold()?;
        let (quantity, value, above) = (threshold.field.name().to_owned(), threshold.value, threshold.above);
        let is_level = threshold.field.silence().is_none();
        is_level.then(|| Threshold { flag: row.flag.clone(), quantity, value, above })
    };
    rows.iter().filter_map(of_row).collect()
}

/// What the table leaves unanswered on purpose.
fn waivers(waivers: &[hazard::Waiver]) -> Vec<Waiver> {
    let told = |it: &hazard::Waiver| Waiver {
        hazard: it.hazard.name.to_owned(),
        sign: it.hazard.sign.to_string(),
        phases: it.phases.iter().map(ToString::to_string).collect(),
        reason: it.reason.clone(),
    };
    waivers.iter().map(told).collect()
}

/// What a vehicle does that does not hear the ground in flight, the earliest first.
fn without_contact(rows: &[Row]) -> Vec<WithoutContact> {
    let of_row = |row: &Row| {
        let silence = row.when.as_ref()?.raises.threshold().filter(|it| it.field == Field::LinkSilence)?;
        let (flag, response) = (row.flag.clone(), row.severity().in_words().to_owned());
        Some(WithoutContact { flag, after_s: silence.value, response })
    };
    let mut responses: Vec<_> = rows.iter().filter_map(of_row).collect();
    responses.sort_by(|a, b| a.after_s.total_cmp(&b.after_s));
    responses
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::contingency::Contingencies;
    use domain::file::Source;
    use domain::testing;

    fn row(priority: usize, flag: &str, when: &str) -> String {
        format!(
            "[[contingency]]\nflag = \"{flag}\"\npriority = {priority}\nwhen = \"{when}\"\nactions = [\"stop\"]\n\
             emergency = \"stop\"\nclears = \"after-action\"\nthen = \"resume\"\n"
        )
    }

    #[test]
    fn what_a_vehicle_does_without_contact_is_told_in_the_order_in_which_it_happens() {
        let silence = |s| format!("known(link.silent_s) and link.silent_s >= {s} s");
        let text = testing::table(&(row(1, "link_gone", &silence(120)) + &row(2, "link_lost", &silence(10))));
        let table = Contingencies::read(&Source { path: "c.toml".into(), text }, &testing::ACTIONS).unwrap();
        let rows = without_contact(table.rows());
        let told: Vec<_> = rows.iter().map(|it| (it.flag.as_str(), it.after_s, it.response.as_str())).collect();
        assert_eq!(told, [("link_lost", 10.0, "holds"), ("link_gone", 120.0, "holds")]);
    }

    #[test]
    fn an_expression_that_is_one_comparison_has_a_threshold() {
        let text = testing::table(
            &(row(1, "wind_too_strong", "known(wind.speed_m_s) and wind.speed_m_s > 14 m/s")
                + &row(2, "battery_stale", "battery.silent_s >= 1 s")
                + &row(3, "far_and_low", "position.height_m < 5 m and position.distance_home_m > 1 km")),
        );
        let table = Contingencies::read(&Source { path: "c.toml".into(), text }, &testing::ACTIONS).unwrap();
        let (flag, quantity) = ("wind_too_strong".to_owned(), "wind.speed_m_s".to_owned());
        assert_eq!(thresholds(table.rows()), [Threshold { flag, quantity, value: 14.0, above: true }]);
    }

    #[test]
    fn a_waiver_is_told_with_its_phases_and_its_reason() {
        let text = testing::table("[[waiver]]\nhazard = \"wind-high\"\nreason = \"it starts in a hangar\"\n");
        let table = Contingencies::read(&Source { path: "c.toml".into(), text }, &testing::ACTIONS).unwrap();
        let (hazard, sign) = ("wind-high".to_owned(), "wind.speed_m_s 13.00 m/s".to_owned());
        let (phases, reason) = (vec!["on the ground".to_owned()], "it starts in a hangar".to_owned());
        assert_eq!(waivers(table.waivers()), [Waiver { hazard, sign, phases, reason }]);
    }
}
