//! Feeds: on the wire each names its areas by their places in the list of all areas, since names would double a large status.

use std::collections::BTreeMap;

use kittiwake_proto::v1;

use super::{InvalidMessage, out_of_range};
use crate::area::Area;
use crate::feed::Feed;

/// The feeds of a mission with these areas.
pub(crate) fn feeds_to_wire(feeds: &[Feed], areas: &[Area]) -> Vec<v1::Feed> {
    let indices: BTreeMap<&str, u32> = areas.iter().map(|it| it.name.as_str()).zip(0..).collect();
    let feed = |it: &Feed| v1::Feed {
        name: it.name.clone(),
        provider: it.provider.clone().unwrap_or_default(),
        issued_utc_ms: it.issued_utc_ms,
        valid_from_utc_ms: it.valid_from_utc_ms,
        valid_until_utc_ms: it.valid_until_utc_ms,
        areas: it.areas.iter().filter_map(|it| indices.get(it.as_str()).copied()).collect(),
    };
    feeds.iter().map(feed).collect()
}

/// The feeds in a message with these areas.
pub(crate) fn feeds_from_wire(feeds: Vec<v1::Feed>, areas: &[v1::Area]) -> Result<Vec<Feed>, InvalidMessage> {
    let name = |index: u32| {
        let area = areas.get(index as usize);
        area.map(|it| it.name.clone()).ok_or_else(|| out_of_range("feeds.areas", index, "the place of an area"))
    };
    let feed = |it: v1::Feed| {
        Ok(Feed {
            name: it.name,
            provider: Some(it.provider).filter(|it| !it.is_empty()),
            issued_utc_ms: it.issued_utc_ms,
            valid_from_utc_ms: it.valid_from_utc_ms,
            valid_until_utc_ms: it.valid_until_utc_ms,
            areas: it.areas.into_iter().map(name).collect::<Result<_, _>>()?,
        })
    };
    feeds.into_iter().map(feed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feed_of_an_area_that_is_not_there_is_refused() {
        let feed = v1::Feed { areas: vec![1], ..Default::default() };
        let told = feeds_from_wire(vec![feed], &[v1::Area::default()]).unwrap_err().to_string();
        assert_eq!(told, "`feeds.areas` is 1, expected the place of an area");
    }
}
