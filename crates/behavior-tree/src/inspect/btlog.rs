//! A log of status changes that Groot2 replays: BehaviorTree.CPP's `.btlog`, version 1.

use std::io::{self, Write};
use std::time::Duration;

use crate::machine::Tree;
use crate::record::changes::StatusChange;

/// Writes the status changes of one tree to a file.
///
/// ```
/// # use std::time::Duration;
/// # use behavior_tree::{BtlogWriter, Library, Registry};
/// # let xml = r#"<root BTCPP_format="4"><BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree></root>"#;
/// # let mut tree = Library::load(&Registry::<()>::new(), [("main.xml", xml)])?.instantiate("Main", &[])?;
/// let mut file = Vec::new();
/// let since_1970 = Duration::from_secs(1_700_000_000);
/// let now = Duration::ZERO;
/// tree.record_changes(1024, || 0);
/// let mut log = BtlogWriter::new(&mut file, &tree, since_1970, now)?;
/// tree.tick_once(now, &mut ());
/// log.write_changes(&mut tree)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A tree that a leaf holds is not part of the log and needs a log of its own. The example `reactive_guard` writes a
/// log to a file.
pub struct BtlogWriter<W> {
    out: W,
    start: Duration,
}

const MAGIC: &[u8] = b"BTCPP4-FileLogger2";
const VERSION: u8 = 1;

impl<W: Write> BtlogWriter<W> {
    /// Starts a log. `wall_time` is the time since 1970; `now` is the same moment on the clock of the ticks.
    pub fn new<Ctx>(mut out: W, tree: &Tree<Ctx>, wall_time: Duration, now: Duration) -> io::Result<Self> {
        let xml = tree.to_document().to_xml();
        let length = i32::try_from(xml.len()).map_err(|_| io::Error::other("the tree is too large for a log"))?;
        let wall_time = i64::try_from(wall_time.as_micros()).unwrap_or(i64::MAX);
        out.write_all(MAGIC)?;
        out.write_all(&[VERSION])?;
        out.write_all(&length.to_le_bytes())?;
        out.write_all(xml.as_bytes())?;
        out.write_all(&wall_time.to_le_bytes())?;
        Ok(BtlogWriter { out, start: now })
    }

    /// Writes the changes that the tree recorded since the last call. Returns how many were lost.
    pub fn write_changes<Ctx>(&mut self, tree: &mut Tree<Ctx>) -> io::Result<u64> {
        let mut result = Ok(());
        let lost = tree.take_changes(|change| {
            if result.is_ok() {
                result = self.write(change);
            }
        });
        result?;
        self.out.flush()?;
        Ok(lost)
    }

    /// A record has nine bytes: 48 bits for the microseconds since the start, 16 for the node's number, 8 for its status.
    fn write(&mut self, change: StatusChange) -> io::Result<()> {
        let micros = u64::try_from(change.at.saturating_sub(self.start).as_micros()).unwrap_or(u64::MAX);
        let uid = u16::try_from(change.node.index() + 1).unwrap_or(u16::MAX);
        self.out.write_all(&micros.to_le_bytes()[..6])?;
        self.out.write_all(&uid.to_le_bytes())?;
        self.out.write_all(&[change.to as u8])
    }
}
