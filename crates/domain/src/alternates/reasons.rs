//! Why a vehicle goes to one place and not to another, in words and figures.

use super::{Alternate, Merit, Role};

impl Alternate {
    /// What the way there takes: `1.9 km, 31 Wh of 54 usable`; empty if there is no way.
    pub fn figures(&self, usable_wh: Option<f64>) -> String {
        let Some((way, _)) = &self.way else { return String::new() };
        let length = match way.length_m {
            length_m if length_m < 1000.0 => format!("{length_m:.0} m"),
            length_m => format!("{:.1} km", length_m / 1000.0),
        };
        let usable = usable_wh.map_or_else(String::new, |it| format!(" of {:.0} usable", it.floor()));
        format!("{length}, {:.0} Wh{usable}", way.energy_wh.ceil())
    }

    /// Why a vehicle that flies to `chosen` does not fly here; `None`: nothing that is known of the two says it.
    pub fn why_not_instead_of(&self, chosen: &Alternate) -> Option<String> {
        if let Some(why) = self.why_not() {
            return Some(why);
        }
        if chosen.harm() < self.harm() {
            return Some("the vehicle would be given up there".to_owned());
        }
        let is_worse = chosen.merit() < self.merit();
        Some(match self.merit() {
            Merit::TriedBefore if is_worse || chosen.failed_landings < self.failed_landings => {
                "a landing there has failed before".to_owned()
            }
            Merit::ToAskFor if is_worse => {
                let needs = self.way.as_ref().map(|(way, _)| way.needs.join(" and ")).unwrap_or_default();
                format!("the way takes the permission for {needs}")
            }
            Merit::OnReserve if is_worse => match self.charge {
                Some(charge) => format!("would arrive with {:.0} %, on the reserve", charge * 100.0),
                None => "the way uses the reserve".to_owned(),
            },
            _ if chosen.energy_wh() < self.energy_wh() => {
                let [here, there] = [self, chosen].map(|it| it.energy_wh().ceil());
                format!("the way takes {here:.0} Wh, not {there:.0}")
            }
            _ if chosen.candidate.role == Role::Home => "home comes first where it can be reached so well".to_owned(),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Candidate, Reach, Way};
    use super::*;
    use crate::geometry::Ned;
    use crate::site::SiteKind;

    fn way(energy_wh: f64, needs: &[&str]) -> Way {
        let needs = needs.iter().map(|&it| it.to_owned()).collect();
        Way { length_m: 61.0 * energy_wh, time_s: 1.0, energy_wh, needs }
    }

    fn alternate(role: Role, kind: SiteKind, way: Option<(Way, Reach)>) -> Alternate {
        let candidate = Candidate { role, name: "there".into(), position: Ned::default(), kind };
        Alternate { candidate, way, charge: None, failed_landings: 0 }
    }

    fn site(energy_wh: f64, needs: &[&str], reach: Reach) -> Alternate {
        alternate(Role::Site, SiteKind::Landing, Some((way(energy_wh, needs), reach)))
    }

    #[test]
    fn a_way_is_told_by_its_length_and_its_energy() {
        #[track_caller]
        fn check(alternate: &Alternate, usable_wh: Option<f64>, expected: &str) {
            assert_eq!(alternate.figures(usable_wh), expected);
        }
        check(&site(30.5, &[], Reach::WithReserve), Some(54.9), "1.9 km, 31 Wh of 54 usable");
        check(&site(10.0, &[], Reach::Unknown), None, "610 m, 10 Wh");
        check(&alternate(Role::Site, SiteKind::Landing, None), Some(54.0), "");
    }

    #[test]
    fn each_place_that_is_not_gone_to_has_its_reason() {
        #[track_caller]
        fn check(chosen: &Alternate, other: &Alternate, expected: &str) {
            assert_eq!(other.why_not_instead_of(chosen).unwrap_or_default(), expected);
        }
        use Reach::{OnReserve, WithReserve};
        let chosen = site(10.0, &[], WithReserve);
        check(&chosen, &site(20.2, &[], WithReserve), "the way takes 21 Wh, not 10");
        check(&chosen, &site(5.0, &[], OnReserve), "the way uses the reserve");
        let with_charge = Alternate { charge: Some(0.232), ..site(5.0, &[], OnReserve) };
        check(&chosen, &with_charge, "would arrive with 23 %, on the reserve");
        check(&chosen, &site(5.0, &["A", "B"], WithReserve), "the way takes the permission for A and B");
        check(&chosen, &site(5.0, &[], WithReserve), "");
        let tried = |failed_landings| Alternate { failed_landings, ..site(5.0, &[], WithReserve) };
        check(&chosen, &tried(1), "a landing there has failed before");
        check(&tried(1), &tried(2), "a landing there has failed before");
        let ditch = |energy_wh| alternate(Role::Site, SiteKind::Ditch, Some((way(energy_wh, &[]), WithReserve)));
        check(&chosen, &ditch(5.0), "the vehicle would be given up there");
        check(&ditch(5.0), &ditch(7.0), "the way takes 7 Wh, not 5");
        let closed = alternate(Role::Site, SiteKind::Landing, None);
        check(&chosen, &closed, "no way there that keeps out of areas which may not be entered");
        let home = alternate(Role::Home, SiteKind::Landing, Some((way(10.0, &[]), WithReserve)));
        check(&home, &site(8.0, &[], WithReserve), "home comes first where it can be reached so well");
    }
}
