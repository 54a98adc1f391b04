//! Reads a recording as far as it can be read. It never fails: a problem is returned beside what was understood.

use std::collections::BTreeMap;
use std::io::Read;

use kittiwake_proto::topics::Topic;
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::recording::encoder::METADATA;
use crate::recording::summary::Summary;

/// The longest record, in bytes. Our records are far shorter; a damaged length must not become an allocation.
const MAX_RECORD: usize = 16 * 1024 * 1024;

/// What was read of a file.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Reading {
    /// What was understood.
    pub(crate) summary: Summary,
    /// What is wrong with the file; `None` if it was read to its end.
    pub(crate) problem: Option<String>,
}

/// Something in a file.
pub(crate) enum Found<'a> {
    /// A metadata record of ours.
    Metadata(&'a BTreeMap<String, String>),
    /// A message of a known topic.
    Message {
        /// Its topic.
        topic: Topic,
        /// When it arrived.
        utc_ms: i64,
        /// As on the wire.
        bytes: &'a [u8],
    },
}

/// Reads the whole file.
pub(crate) fn read(file: impl Read) -> Reading {
    let mut summary = Summary::default();
    let problem = read_each(file, |found| match found {
        Found::Metadata(metadata) => summary.on_metadata(metadata),
        Found::Message { topic, utc_ms, bytes } => summary.on_message(topic, utc_ms, bytes),
    });
    Reading { summary, problem }
}

/// Gives `on` everything in the file in its order, as far as it can be read; returns what is wrong with it.
pub(crate) fn read_each(mut file: impl Read, mut on: impl FnMut(Found<'_>)) -> Option<String> {
    read_into(&mut file, &mut on).err().map(|error| in_words(&error))
}

fn read_into(file: &mut impl Read, on: &mut impl FnMut(Found<'_>)) -> Result<(), McapError> {
    let options = LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(MAX_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    // The topics of the channels, by their numbers in the file; `None` for an unknown topic.
    let mut channels: BTreeMap<u16, Option<Topic>> = BTreeMap::new();
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                let read = file.read(reader.insert(need))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => match mcap::parse_record(opcode, data)? {
                Record::Metadata(it) if it.name == METADATA => on(Found::Metadata(&it.metadata)),
                Record::Channel(it) => {
                    let topic = Topic::ALL.iter().find(|topic| topic.key() == it.topic).copied();
                    channels.insert(it.id, topic);
                }
                Record::Message { header, data } => {
                    let topic = channels.get(&header.channel_id);
                    let topic = *topic.ok_or(McapError::UnknownChannel(header.sequence, header.channel_id))?;
                    let utc_ms = i64::try_from(header.log_time / 1_000_000).unwrap_or(i64::MAX);
                    if let Some(topic) = topic {
                        on(Found::Message { topic, utc_ms, bytes: &data });
                    }
                }
                _ => {}
            },
        }
    }
    Ok(())
}

fn in_words(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => {
            "the file ends early: the gateway was killed while it wrote, or the file was cut".into()
        }
        McapError::BadMagic => "the file is not MCAP, or does not end like MCAP".into(),
        McapError::Io(cause) => format!("the file cannot be read: {cause}"),
        other => format!("the file is corrupt: {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::capture::RecordedMessage;
    use crate::recording::encoder::Encoder;
    use kittiwake_proto::topics::Message;
    use kittiwake_proto::v1;

    const STARTED: i64 = 1_767_225_600_000;

    /// A recording of `count` decisions a second apart, flushed after each, and the sizes it had then.
    fn recording(count: i64) -> (Vec<u8>, Vec<usize>) {
        let metadata = BTreeMap::from([("vehicle".to_owned(), "uav1".to_owned())]);
        let mut encoder = Encoder::new(metadata.clone()).unwrap();
        let (mut file, mut sizes) = (Vec::new(), Vec::new());
        for n in 0..count {
            let message: Message = v1::DecisionRecord { text: n.to_string(), ..Default::default() }.into();
            let (topic, bytes) = (message.topic(), message.encode());
            encoder.add(&RecordedMessage { topic, utc_ms: STARTED + 1000 * n, bytes }).unwrap();
            file.extend(encoder.take_bytes().unwrap());
            sizes.push(file.len());
        }
        file.extend(encoder.finish(metadata).unwrap());
        (file, sizes)
    }

    #[test]
    fn what_was_written_is_read() {
        let (file, _) = recording(3);
        let reading = read(file.as_slice());
        assert_eq!(reading.problem, None);
        assert_eq!((reading.summary.vehicle.as_str(), reading.summary.messages), ("uav1", 3));
        assert_eq!((reading.summary.started_ms, reading.summary.ended_ms), (Some(STARTED), Some(STARTED + 2000)));
    }

    #[test]
    fn other_readers_of_mcap_find_the_messages_and_their_descriptors() {
        let (file, _) = recording(3);
        let messages: Vec<_> = mcap::MessageStream::new(&file).unwrap().map(Result::unwrap).collect();
        // Each decision, and a line of Foxglove's log.
        assert_eq!(messages.len(), 6);
        let channel = &messages[0].channel;
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!((channel.topic.as_str(), channel.message_encoding.as_str()), ("mcm/decision", "protobuf"));
        assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("kittiwake.v1.DecisionRecord", "protobuf"));
        assert_eq!(Some(schema.data.to_vec()), kittiwake_proto::schema::file_descriptor_set(&schema.name));
        let log = &messages[1].channel;
        let schema = log.schema.as_ref().unwrap();
        assert_eq!((log.topic.as_str(), log.message_encoding.as_str()), ("foxglove/log", "json"));
        assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("foxglove.Log", "jsonschema"));
        assert_eq!(messages[4].log_time, (STARTED as u64 + 2000) * 1_000_000);
        assert_eq!(messages[4].sequence, 2);
        let summary = mcap::Summary::read(&file).unwrap().unwrap();
        assert_eq!(summary.stats.unwrap().message_count, 6);
    }

    #[test]
    fn a_file_that_was_cut_is_read_up_to_the_last_flush() {
        let (file, sizes) = recording(4);
        for cut in 0..file.len() {
            let reading = read(&file[..cut]);
            assert!(reading.problem.is_some(), "cut at {cut}");
            let flushed = sizes.iter().filter(|size| **size <= cut).count() as u32;
            assert!(flushed <= reading.summary.messages, "cut at {cut}: {} of {flushed}", reading.summary.messages);
        }
    }

    #[test]
    fn damage_is_reported_and_never_a_panic() {
        let (file, _) = recording(4);
        let whole = read(file.as_slice());
        for at in 0..file.len() {
            for bit in [0x01, 0x80] {
                let mut damaged = file.clone();
                damaged[at] ^= bit;
                let reading = read(damaged.as_slice());
                // Bytes that no checksum covers may go unnoticed; they change nothing else.
                assert!(reading.problem.is_some() || reading.summary.messages == whole.summary.messages, "at {at}");
            }
        }
        for garbage in [vec![], vec![0xff; 1000], b"\x89MCAP0\r\n".repeat(9)] {
            assert!(read(garbage.as_slice()).problem.is_some());
        }
    }
}
