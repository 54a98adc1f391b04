//! Sites: whether a place to land at is ready, as its party reports it.
//!
//! The air round a site is the area `site NAME`. It is granted while every condition of the site holds, and revoked once one of them
//! does not, also if a person granted it. Each condition is known by the last report that names it, and for as long as a report counts.

use std::time::Duration;

use domain::quantity::Positive;
use domain::site::site_of;
use domain::time::{Pace, Time};
use kittiwake_proto::v1;

use crate::config;
use crate::permission::Standing;
use crate::texts::{MAX_REASON_BYTES, shortened};

/// The sites that the tower knows.
pub(crate) struct Sites {
    sites: Vec<Site>,
    /// When the tower began to hear: a grant of the one before holds until a report was due since.
    began: Option<Time>,
}

struct Site {
    config: config::Site,
    counts_for: Duration,
    rotor: Option<Report<v1::Rotor>>,
    deck: Option<Report<v1::Deck>>,
    wind_m_s: Option<Report<f64>>,
    /// When the rotor of a simulated site stands still; `None`: nobody has asked.
    stands_at: Option<Time>,
}

#[derive(Clone, Copy)]
struct Report<T> {
    value: T,
    at: Time,
}

impl Sites {
    pub(crate) fn new(sites: &[config::Site], pace: Pace) -> Sites {
        let site = |config: &config::Site| Site {
            counts_for: pace.limit(config.silent_after_s.seconds()),
            config: config.clone(),
            rotor: None,
            deck: None,
            wind_m_s: None,
            stands_at: None,
        };
        Sites { sites: sites.iter().map(site).collect(), began: None }
    }

    /// Takes a report; what it leaves out stays as it was reported last.
    ///
    /// # Errors
    /// Why it is refused.
    pub(crate) fn report(&mut self, now: Time, report: &v1::SiteReport) -> Result<(), String> {
        let Some(site) = self.sites.iter_mut().find(|it| it.config.name == report.site) else {
            return Err(unknown(&report.site));
        };
        let other = |key: &str, found: i32, expected: &str| format!("found `{key}` {found}, expected {expected}");
        let rotor = v1::Rotor::try_from(report.rotor);
        let rotor = rotor.map_err(|_| other("rotor", report.rotor, "stopped or turning"))?;
        let deck = v1::Deck::try_from(report.deck);
        let deck = deck.map_err(|_| other("deck", report.deck, "clear or occupied"))?;
        if let Some(wind_m_s) = report.wind_m_s.filter(|it| !(it.is_finite() && 0.0 <= *it)) {
            return Err(format!("found `wind_m_s` {wind_m_s}, expected metres per second from 0 up"));
        }
        let at = now;
        if rotor != v1::Rotor::Unspecified {
            site.rotor = Some(Report { value: rotor, at });
        }
        if deck != v1::Deck::Unspecified {
            site.deck = Some(Report { value: deck, at });
        }
        site.wind_m_s = report.wind_m_s.map(|value| Report { value, at }).or(site.wind_m_s);
        Ok(())
    }

    /// Time passes: rotors of simulated sites stop where `standings` of their areas ask for that, and turn again where nobody does.
    pub(crate) fn pass<'a>(&mut self, now: Time, standings: impl Iterator<Item = (&'a String, &'a Standing)> + Clone) {
        self.began.get_or_insert(now);
        for site in &mut self.sites {
            let Some(simulated) = &site.config.simulated else { continue };
            let own = standings.clone().filter(|(area, _)| site_of(area) == Some(site.config.name.as_str()));
            let stops_in = own.filter_map(|(_, standing)| match standing {
                Standing::Granted { .. } => Some(Duration::ZERO),
                Standing::Requested { .. } => Some(simulated.rotor_stops_s.seconds()),
                Standing::Denied { .. } | Standing::Revoked { .. } | Standing::Expired => None,
            });
            site.stands_at = stops_in.min().map(|stops_in| site.stands_at.unwrap_or(now + stops_in));
        }
    }

    /// What is missing for `area` to be granted, or to stay so; `None` where nothing is, and for an area that is not round a site.
    pub(crate) fn missing(&self, area: &str, is_granted: bool, now: Time) -> Option<String> {
        let name = site_of(area)?;
        let Some(site) = self.sites.iter().find(|it| it.config.name == name) else { return Some(unknown(name)) };
        let is_new = self.began.is_none_or(|began| now < began + site.counts_for);
        let missing = site.missing(now, is_granted && is_new)?;
        Some(shortened(&format!("not ready: {missing}"), MAX_REASON_BYTES))
    }

    /// When something else will be missing than at `now`, without another report.
    pub(crate) fn deadline(&self, now: Time) -> Option<Time> {
        let of_site = |site: &Site| {
            let reported = [site.rotor.map(|it| it.at), site.deck.map(|it| it.at), site.wind_m_s.map(|it| it.at)];
            let silent_at = reported.into_iter().chain([self.began]).flatten().map(|it| it + site.counts_for);
            silent_at.chain(site.stands_at).filter(|it| now < *it).min()
        };
        self.sites.iter().filter_map(of_site).min()
    }
}

impl Site {
    /// The first condition that does not hold, or of which nothing is known; of the latter none where `may_be_unheard`.
    fn missing(&self, now: Time, may_be_unheard: bool) -> Option<String> {
        let config::Site { rotor_stopped, deck_clear, wind_at_most_m_s, simulated, .. } = &self.config;
        let simulated = simulated.as_ref();
        let rotor = simulated.map(|_| match self.stands_at {
            Some(at) if at <= now => v1::Rotor::Stopped,
            _ => v1::Rotor::Turning,
        });
        let deck = simulated.map(|it| if it.deck_occupied { v1::Deck::Occupied } else { v1::Deck::Clear });
        let (rotor, deck) = (self.known(self.rotor, rotor, now), self.known(self.deck, deck, now));
        let wind_m_s = self.known(self.wind_m_s, simulated.map(|it| it.wind_m_s.get()), now);
        let unheard = |what: &str| {
            let text = format!("{what} was not reported for {} s", self.config.silent_after_s.get());
            (!may_be_unheard).then_some(text)
        };
        let rotor = || match rotor {
            Some(v1::Rotor::Stopped) => None,
            Some(_) => Some("the rotor still turns".to_owned()),
            None => unheard("the rotor"),
        };
        let deck = || match deck {
            Some(v1::Deck::Clear) => None,
            Some(_) => Some("the deck is occupied".to_owned()),
            None => unheard("the deck"),
        };
        // Without the measured number: each change of a reason is published.
        let wind = |most: &Positive| match wind_m_s {
            Some(wind_m_s) => {
                (most.get() < wind_m_s).then(|| format!("the wind at the deck is above {} m/s", most.get()))
            }
            None => unheard("the wind at the deck"),
        };
        let rotor = rotor_stopped.then(rotor).flatten();
        rotor.or_else(|| deck_clear.then(deck).flatten()).or_else(|| wind_at_most_m_s.as_ref().and_then(wind))
    }

    /// What is known by `report`, or by what the site says by itself. A report of a simulated site counts for ever.
    fn known<T>(&self, report: Option<Report<T>>, simulated: Option<T>, now: Time) -> Option<T> {
        let counts = |it: &Report<T>| simulated.is_some() || now < it.at + self.counts_for;
        report.filter(counts).map(|it| it.value).or(simulated)
    }
}

fn unknown(site: &str) -> String {
    shortened(&format!("the control tower knows no site `{site}`"), MAX_REASON_BYTES)
}
