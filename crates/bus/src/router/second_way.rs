//! A second connection from the aircraft to the ground, over which what is urgent comes up as well.
//!
//! Over one TCP connection a lost packet makes everything behind it late by a round trip and more, so of a link that
//! loses one packet in fifty a few orders in a hundred are late. Orders and decisions therefore come twice, each copy with
//! losses of its own. The receiver knows them by their request ids: the later copy changes nothing, and its
//! answer is the same.

use zenoh::query::{ConsolidationMode, Query, QueryTarget};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::link::set_up;
use super::{LinkEnd, Way};
use crate::BusError;
use crate::crossing::{Class, Crossing, Side};
use crate::keys::ROOT;
use crate::session::{config, set};

/// Connections under one name that the router on `side` sees at the other end: an aircraft makes two, the ground takes part in
/// both with one router.
pub(super) fn connections(side: Side) -> usize {
    match side {
        Side::Ground => 2,
        Side::Aircraft => 1,
    }
}

/// On the aircraft: opens the second connection to the ground, and has it made again whenever it breaks.
pub(super) fn open(link: &LinkEnd, own: &Session) -> Result<Option<Session>, BusError> {
    let Way::Dial { vehicle, locator } = &link.way else { return Ok(None) };
    let mut config = config("peer")?;
    set_up(&mut config, link)?;
    set(&mut config, "listen/endpoints", "[]")?;
    set(&mut config, "scouting/delay", "0")?;
    let opened = zenoh::open(config).wait();
    let session = opened.map_err(|cause| BusError::Link { locator: locator.clone(), cause: cause.to_string() })?;
    pass_on(&link.table, vehicle, &session, own)?;
    Ok(Some(session))
}

/// Has what the ground says to `vehicle`, and is urgent, come over `second` as well, and go on into `own`, the
/// session of the aircraft's router. It lives as long as `second`.
fn pass_on(table: &Crossing, vehicle: &str, second: &Session, own: &Session) -> Result<(), BusError> {
    let urgent = |from: Side, class: Class| from == Side::Ground && class == Class::Command;
    for row in table.topics.iter().filter(|it| urgent(it.from, it.class)) {
        let (key, own) = (format!("{ROOT}/{vehicle}/{}", row.topic.key()), own.clone());
        let topic = key.clone();
        let declared =
            second.declare_subscriber(&key).callback(move |it| publish(&own, &topic, &it)).background().wait();
        declared.map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
    }
    let asked = |answered_by: Side, class: Class| answered_by == Side::Aircraft && class == Class::Command;
    for row in table.services.iter().filter(|it| asked(it.answered_by, it.class)) {
        let (key, own) = (format!("{ROOT}/{vehicle}/{}", row.service.key()), own.clone());
        let service = key.clone();
        let queryable = second.declare_queryable(&key).complete(true);
        let declared = queryable.callback(move |it| ask(&own, &service, it)).background().wait();
        declared.map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
    }
    Ok(())
}

/// Under the key itself, whatever the other end called it: a key with wildcards would go to others as well.
fn publish(own: &Session, key: &str, sample: &Sample) {
    let put = own
        .put(key, sample.payload().clone())
        .encoding(sample.encoding().clone())
        .congestion_control(sample.congestion_control())
        .priority(sample.priority())
        .express(sample.express())
        .attachment(sample.attachment().cloned());
    if let Err(cause) = put.wait() {
        tracing::warn!(key, %cause, "not passed on");
    }
}

/// The same for a question, which is without parameters in all our services.
fn ask(own: &Session, key: &str, query: Query) {
    let question = query.clone();
    let get = own
        .get(key)
        .target(QueryTarget::BestMatching)
        .consolidation(ConsolidationMode::None)
        .priority(question.priority())
        .congestion_control(question.congestion_control())
        .express(question.express())
        .payload(question.payload().cloned().unwrap_or_default())
        .encoding(question.encoding().cloned().unwrap_or_default())
        .attachment(question.attachment().cloned())
        // When nobody answers, the query is dropped with this, and the ground knows.
        .callback(move |reply| {
            let answered = match reply.result() {
                Ok(sample) => query.reply(sample.key_expr(), sample.payload().clone()).wait(),
                Err(refusal) => query.reply_err(refusal.payload().clone()).wait(),
            };
            if let Err(cause) = answered {
                tracing::warn!(key = query.key_expr().as_str(), %cause, "answer not passed on");
            }
        });
    if let Err(cause) = get.wait() {
        tracing::warn!(key, %cause, "not passed on");
    }
}
