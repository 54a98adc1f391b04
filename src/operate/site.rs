//! `kittiwake site`.

use reqwest::Method;
use serde_json::{Map, json};

use crate::operate::Done;
use crate::operate::args::{Deck, Rotor, SiteCommand};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;

/// Reports what was given. A report that is repeated says the same.
pub fn run(what: &SiteCommand, gateway: &Gateway) -> Result<Done, Failure> {
    let SiteCommand::Report { site, rotor, deck, wind } = what;
    let rotor = rotor.map(|it| match it {
        Rotor::Stopped => json!("ROTOR_STOPPED"),
        Rotor::Turning => json!("ROTOR_TURNING"),
    });
    let deck = deck.map(|it| match it {
        Deck::Clear => json!("DECK_CLEAR"),
        Deck::Occupied => json!("DECK_OCCUPIED"),
    });
    let members = [("rotor", rotor), ("deck", deck), ("windMS", wind.map(|it| json!(it)))];
    let body: Map<_, _> = members.into_iter().filter_map(|(name, it)| Some((name.to_owned(), it?))).collect();
    gateway.order(Method::POST, &["sites", site, "report"], Some(body.into())).map(Done::of)
}
