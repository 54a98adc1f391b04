//! A recording as bytes: messages in, MCAP out.
//!
//! One channel for each topic, named by its key, with the file descriptors of its message, so that
//! any reader of MCAP understands it without our `.proto` files; beside them those of [`foxglove`]. The bytes that [`Encoder::take_bytes`]
//! returns end with a whole record: a file that got no further can be read up to there.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use kittiwake_proto::schema;
use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};
use mcap::{Attachment, Compression, McapResult, WriteOptions, Writer};

use crate::recording::capture::RecordedMessage;
use crate::recording::foxglove::{self, Picture};

/// The name of the metadata records: one at the start, one at the end.
pub(crate) const METADATA: &str = "kittiwake";
/// The encoding of the payloads, and of their descriptors.
const PROTOBUF: &str = "protobuf";
/// The encoding of what is made for Foxglove, and of its schemas.
const JSON: &str = "json";
const JSON_SCHEMA: &str = "jsonschema";
/// Bytes after which a chunk ends; a flush ends it earlier.
const CHUNK: u64 = 256 * 1024;

/// A recording under way.
pub(crate) struct Encoder {
    writer: Writer<NoSeek<Buffer>>,
    buffer: Buffer,
    channels: BTreeMap<&'static str, Channel>,
    picture: Picture,
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
        let mut encoder = Encoder {
            writer: writer.create(NoSeek::new(buffer.clone()))?,
            buffer,
            channels: BTreeMap::new(),
            picture: Picture::default(),
        };
        encoder.add_metadata(metadata)?;
        Ok(encoder)
    }

    /// Adds a file.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub(crate) fn attach(&mut self, name: &str, text: &str, utc_ms: i64) -> McapResult<()> {
        let time = nanoseconds(utc_ms);
        let data = Cow::Borrowed(text.as_bytes());
        let (name, media_type) = (name.to_owned(), "text/plain".to_owned());
        self.writer.attach(&Attachment { log_time: time, create_time: time, name, media_type, data })
    }

    /// Adds a message, and its drawings for Foxglove.
    ///
    /// # Errors
    /// As [`Encoder::new`].
    pub(crate) fn add(&mut self, message: &RecordedMessage) -> McapResult<()> {
        let RecordedMessage { topic, utc_ms, bytes } = message;
        let name = topic.type_name();
        let schema = || (PROTOBUF, schema::file_descriptor_set(&name).unwrap_or_default());
        self.write(topic.key(), PROTOBUF, &name, schema, *utc_ms, bytes)?;
        for drawing in self.picture.on_message(*topic, *utc_ms, bytes) {
            let schema = || (JSON_SCHEMA, foxglove::schema(drawing.schema).into_bytes());
            let bytes = drawing.message.to_string();
            self.write(drawing.channel, JSON, drawing.schema, schema, *utc_ms, bytes.as_bytes())?;
        }
        Ok(())
    }

    fn write(
        &mut self,
        channel: &'static str,
        encoding: &str,
        schema_name: &str,
        schema: impl FnOnce() -> (&'static str, Vec<u8>),
        utc_ms: i64,
        bytes: &[u8],
    ) -> McapResult<()> {
        let channel = match self.channels.entry(channel) {
            std::collections::btree_map::Entry::Occupied(known) => known.into_mut(),
            std::collections::btree_map::Entry::Vacant(new) => {
                let (schema_encoding, schema) = schema();
                let schema = self.writer.add_schema(schema_name, schema_encoding, &schema)?;
                let id = self.writer.add_channel(schema, channel, encoding, &BTreeMap::new())?;
                new.insert(Channel { id, sequence: 0 })
            }
        };
        let time = nanoseconds(utc_ms);
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.sequence,
            log_time: time,
            // A node knows when its messages arrived, not when they were published.
            publish_time: time,
        };
        channel.sequence = channel.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, bytes)
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

/// A time as MCAP writes it.
fn nanoseconds(utc_ms: i64) -> u64 {
    u64::try_from(utc_ms).unwrap_or(0).saturating_mul(1_000_000)
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
