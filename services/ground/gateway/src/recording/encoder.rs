//! A recording as bytes: messages in, MCAP out.
//!
//! One channel for each topic, named by its key, with the file descriptors of its message, so that
//! any reader of MCAP understands it without our `.proto` files. Whatever [`Encoder::take_bytes`]
//! gives ends with a whole record: a file that got no further can be read up to there.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use kittiwake_proto::schema;
use kittiwake_proto::topics::Topic;
use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};
use mcap::{McapResult, WriteOptions, Writer};

use crate::recording::tracks::Entry;

/// The name of the metadata records: what is known at the start, and at the end.
pub const METADATA: &str = "kittiwake";
/// What the payloads are, and what describes them.
const PROTOBUF: &str = "protobuf";
/// A chunk is written once it has so many bytes, whenever it is asked for otherwise.
const CHUNK: u64 = 256 * 1024;

/// A recording in the making.
pub struct Encoder {
    writer: Writer<NoSeek<Spool>>,
    spool: Spool,
    channels: BTreeMap<Topic, Channel>,
}

struct Channel {
    id: u16,
    /// Of the next message; they count from 0.
    sequence: u32,
}

/// Where the writer leaves its bytes until they are taken.
#[derive(Clone, Default)]
struct Spool(Arc<Mutex<Vec<u8>>>);

impl Encoder {
    /// Begins with what is known of it.
    ///
    /// # Errors
    /// Never for want of space: what it writes to is memory.
    pub fn new(known: BTreeMap<String, String>) -> McapResult<Encoder> {
        let spool = Spool::default();
        let options = WriteOptions::new().compression(None).chunk_size(Some(CHUNK)).disable_seeking(true);
        let writer = options.library(concat!("kittiwake ", env!("CARGO_PKG_VERSION")));
        let mut encoder =
            Encoder { writer: writer.create(NoSeek::new(spool.clone()))?, spool, channels: BTreeMap::new() };
        encoder.know(known)?;
        Ok(encoder)
    }

    /// Adds a message.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub fn add(&mut self, entry: &Entry) -> McapResult<()> {
        let channel = match self.channels.entry(entry.topic) {
            std::collections::btree_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::btree_map::Entry::Vacant(new) => {
                let name = entry.topic.type_name();
                let descriptors = schema::file_descriptor_set(&name).unwrap_or_default();
                let schema = self.writer.add_schema(&name, PROTOBUF, &descriptors)?;
                let id = self.writer.add_channel(schema, entry.topic.key(), PROTOBUF, &BTreeMap::new())?;
                new.insert(Channel { id, sequence: 0 })
            }
        };
        let time = u64::try_from(entry.utc_ms).unwrap_or(0).saturating_mul(1_000_000);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.sequence,
            log_time: time,
            // A node does not see when its messages were published, only when they came.
            publish_time: time,
        };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &entry.bytes)
    }

    /// What is to be written so far, ending with a whole record.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub fn take_bytes(&mut self) -> McapResult<Vec<u8>> {
        self.writer.flush()?;
        Ok(self.spool.take())
    }

    /// The last bytes, with what is known at the end, and the index.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub fn finish(mut self, known: BTreeMap<String, String>) -> McapResult<Vec<u8>> {
        self.know(known)?;
        self.writer.finish()?;
        Ok(self.spool.take())
    }

    fn know(&mut self, metadata: BTreeMap<String, String>) -> McapResult<()> {
        self.writer.write_metadata(&Metadata { name: METADATA.into(), metadata })
    }
}

impl Spool {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
    }
}

impl Write for Spool {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
