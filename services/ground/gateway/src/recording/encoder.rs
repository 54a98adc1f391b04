//! A recording as bytes: messages in, MCAP out.
//!
//! One channel for each topic, named by its key, with the file descriptors of its message, so that
//! any reader of MCAP understands it without our `.proto` files. The bytes that [`Encoder::take_bytes`]
//! returns end with a whole record: a file that got no further can be read up to there.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use kittiwake_proto::schema;
use kittiwake_proto::topics::Topic;
use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};
use mcap::{Compression, McapResult, WriteOptions, Writer};

use crate::recording::capture::RecordedMessage;

/// The name of the metadata records: one at the start, one at the end.
pub(crate) const METADATA: &str = "kittiwake";
/// The encoding of the payloads, and of their descriptors.
const PROTOBUF: &str = "protobuf";
/// Bytes after which a chunk ends; a flush ends it earlier.
const CHUNK: u64 = 256 * 1024;

/// A recording under way.
pub(crate) struct Encoder {
    writer: Writer<NoSeek<Buffer>>,
    buffer: Buffer,
    channels: BTreeMap<Topic, Channel>,
}

struct Channel {
    id: u16,
    /// The number of the next message; messages count from 0.
    sequence: u32,
}

/// Holds what the writer has written until it is taken.
#[derive(Clone, Default)]
struct Buffer(Arc<Mutex<Vec<u8>>>);

impl Encoder {
    /// Begins with a metadata record.
    ///
    /// # Errors
    /// Never for lack of space: it writes to memory.
    pub(crate) fn new(metadata: BTreeMap<String, String>) -> McapResult<Encoder> {
        let buffer = Buffer::default();
        let options =
            WriteOptions::new().compression(Some(Compression::Zstd)).chunk_size(Some(CHUNK)).disable_seeking(true);
        let writer = options.library(concat!("kittiwake ", env!("CARGO_PKG_VERSION")));
        let mut encoder =
            Encoder { writer: writer.create(NoSeek::new(buffer.clone()))?, buffer, channels: BTreeMap::new() };
        encoder.add_metadata(metadata)?;
        Ok(encoder)
    }

    /// Adds a message.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub(crate) fn add(&mut self, message: &RecordedMessage) -> McapResult<()> {
        let channel = match self.channels.entry(message.topic) {
            std::collections::btree_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::btree_map::Entry::Vacant(new) => {
                let name = message.topic.type_name();
                let descriptors = schema::file_descriptor_set(&name).unwrap_or_default();
                let schema = self.writer.add_schema(&name, PROTOBUF, &descriptors)?;
                let id = self.writer.add_channel(schema, message.topic.key(), PROTOBUF, &BTreeMap::new())?;
                new.insert(Channel { id, sequence: 0 })
            }
        };
        let time = u64::try_from(message.utc_ms).unwrap_or(0).saturating_mul(1_000_000);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.sequence,
            log_time: time,
            // A node knows when its messages arrived, not when they were published.
            publish_time: time,
        };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &message.bytes)
    }

    /// The bytes since the last call, ending with a whole record.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub(crate) fn take_bytes(&mut self) -> McapResult<Vec<u8>> {
        self.writer.flush()?;
        Ok(self.buffer.take())
    }

    /// The last bytes, with a second metadata record and the index.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub(crate) fn finish(mut self, metadata: BTreeMap<String, String>) -> McapResult<Vec<u8>> {
        self.add_metadata(metadata)?;
        self.writer.finish()?;
        Ok(self.buffer.take())
    }

    fn add_metadata(&mut self, metadata: BTreeMap<String, String>) -> McapResult<()> {
        self.writer.write_metadata(&Metadata { name: METADATA.into(), metadata })
    }
}

impl Buffer {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
    }
}

impl Write for Buffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
