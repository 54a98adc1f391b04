//! The areas of the last missions, with maps of them: a cache that may be thrown away.

use domain::area::Area;
use domain::area_map::AreaMap;
use domain::feed::Feed;
use domain::mission::MissionAreas;
use domain::wire::InvalidMessage;
use kittiwake_proto::Bytes;

/// The areas of the present mission, and those of one that is tried out.
const MOST_KNOWN: usize = 2;

/// Areas by name, those used last at the end.
#[derive(Debug, Default)]
pub(crate) struct KnownAreas(Vec<Known>);

/// The areas of a mission.
#[derive(Debug)]
pub(crate) struct Known {
    /// What tells them from others.
    pub(crate) id: String,
    pub(crate) areas: Vec<Area>,
    pub(crate) feeds: Vec<Feed>,
    /// Brought up to date when it is needed.
    pub(crate) map: AreaMap,
}

impl KnownAreas {
    /// The areas of this name, which may have been `sent`; `None` if they are not known. They are to be put back.
    ///
    /// # Errors
    /// If what was sent is something else.
    pub(crate) fn take(&mut self, id: &str, sent: Option<Bytes>) -> Result<Option<Known>, InvalidMessage> {
        if let Some(at) = self.0.iter().position(|it| it.id == id) {
            return Ok(Some(self.0.remove(at)));
        }
        let Some(sent) = sent.map(MissionAreas::decode).transpose()? else { return Ok(None) };
        // Most areas are the same as before.
        let map = self.0.last_mut().map(|it| std::mem::take(&mut it.map)).unwrap_or_default();
        let (areas, feeds) = (sent.areas().to_vec(), sent.feeds().to_vec());
        Ok(Some(Known { id: sent.id().to_owned(), areas, feeds, map }))
    }

    /// Remembers these.
    pub(crate) fn put_back(&mut self, known: Known) {
        if self.0.len() == MOST_KNOWN {
            self.0.remove(0);
        }
        self.0.push(known);
    }
}
