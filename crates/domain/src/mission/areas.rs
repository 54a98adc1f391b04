//! The areas of a mission as they are handed on: they may be megabytes, so they are encoded once and named afterwards.

use std::cell::OnceCell;
use std::sync::Arc;

use kittiwake_proto::{Bytes, v1};
use prost::Message as _;

use crate::area::Area;
use crate::area_map::AreaMap;
use crate::feed::Feed;
use crate::wire::{InvalidMessage, feeds_from_wire, feeds_to_wire};

/// The areas of a mission, and the data sets that they came from.
#[derive(Debug, Clone)]
pub struct MissionAreas {
    areas: Arc<[Area]>,
    feeds: Arc<[Feed]>,
    encoded: Bytes,
    id: String,
    map: OnceCell<AreaMap>,
}

impl PartialEq for MissionAreas {
    fn eq(&self, other: &MissionAreas) -> bool {
        self.id == other.id
    }
}

impl Default for MissionAreas {
    fn default() -> MissionAreas {
        MissionAreas::of(&[], &[])
    }
}

impl MissionAreas {
    /// These areas, which came from these data sets.
    pub fn of(areas: &[Area], feeds: &[Feed]) -> MissionAreas {
        let message =
            v1::MissionAreas { areas: areas.iter().map(Into::into).collect(), feeds: feeds_to_wire(feeds, areas) };
        let encoded = Bytes::from(message.encode_to_vec());
        let id = super::hash_of_bytes(&encoded);
        MissionAreas { areas: areas.into(), feeds: feeds.into(), id, encoded, map: OnceCell::new() }
    }

    /// The areas that were encoded.
    ///
    /// # Errors
    /// If these bytes are something else.
    pub fn decode(encoded: Bytes) -> Result<MissionAreas, InvalidMessage> {
        let message = v1::MissionAreas::decode(encoded.clone()).map_err(|_| InvalidMessage::Garbled("areas"))?;
        let feeds = feeds_from_wire(message.feeds, &message.areas)?;
        let areas: Vec<Area> = message.areas.into_iter().map(Area::try_from).collect::<Result<_, _>>()?;
        let id = super::hash_of_bytes(&encoded);
        Ok(MissionAreas { areas: areas.into(), feeds: feeds.into(), id, encoded, map: OnceCell::new() })
    }

    /// The areas.
    pub fn areas(&self) -> &Arc<[Area]> {
        &self.areas
    }

    /// Their map, made when it is first asked for.
    pub fn map(&self) -> &AreaMap {
        self.map.get_or_init(|| AreaMap::new(&self.areas))
    }

    /// The data sets.
    pub fn feeds(&self) -> &[Feed] {
        &self.feeds
    }

    /// The bytes that [`MissionAreas::decode`] reads.
    pub fn encoded(&self) -> &Bytes {
        &self.encoded
    }

    /// What tells them from others: a hash of their content.
    pub fn id(&self) -> &str {
        &self.id
    }
}
