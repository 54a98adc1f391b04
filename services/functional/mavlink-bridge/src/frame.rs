//! MAVLink 2 frames in bytes: found in a datagram or in a stream, and written.
//!
//! It knows where a frame begins and ends and whether it arrived whole; what a frame says is read in [`crate::heard`]. The reader of the
//! `mavlink` crate is a byte stream, also over UDP: a frame with an unknown id whose payload looks like a long frame makes it wait for
//! bytes that never come. Here each datagram is read by itself, and a stream never holds back more than one frame's length.

use mavlink::Message as _;
use mavlink::calculate_crc;
use mavlink::dialects::ardupilotmega::MavMessage;

/// Begins a frame of MAVLink 2, and of MAVLink 1.
const MAGIC: u8 = 0xFD;
const OLD_MAGIC: u8 = 0xFE;
const HEADER: usize = 10;
const OLD_HEADER: usize = 6;
const CHECKSUM: usize = 2;
const SIGNATURE: usize = 13;
/// The only incompatibility flag that is understood: the frame is signed.
const SIGNED: u8 = 0x01;
/// The longest frame; a stream holds two at most.
pub const LONGEST: usize = HEADER + 255 + CHECKSUM + SIGNATURE;

/// One whole frame of MAVLink 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    bytes: Vec<u8>,
    /// Its id is known, so that its checksum could be checked.
    known: bool,
}

impl Frame {
    /// The sender's system.
    pub fn system(&self) -> u8 {
        self.bytes[5]
    }

    /// The sender's component.
    pub fn component(&self) -> u8 {
        self.bytes[6]
    }

    /// Counts the sender's frames on this link.
    pub fn sequence(&self) -> u8 {
        self.bytes[4]
    }

    /// Which message it is.
    pub fn id(&self) -> u32 {
        u32::from_le_bytes([self.bytes[7], self.bytes[8], self.bytes[9], 0])
    }

    /// Whether its checksum was checked: it is not where the message is unknown.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// Whether it carries a signature.
    pub fn is_signed(&self) -> bool {
        self.bytes[2] & SIGNED != 0
    }

    /// Its content, without the zeros at the end that MAVLink 2 leaves out.
    pub fn payload(&self) -> &[u8] {
        &self.bytes[HEADER..HEADER + usize::from(self.bytes[1])]
    }

    /// As it travels.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// A frame of our own.
    pub fn new(sequence: u8, system: u8, component: u8, id: u32, payload: &[u8]) -> Frame {
        // At least one byte stays.
        let kept = payload.iter().rposition(|it| *it != 0).map_or(1, |last| last + 1).min(payload.len());
        let [id_low, id_middle, id_high, _] = id.to_le_bytes();
        let mut bytes = vec![MAGIC, kept as u8, 0, 0, sequence, system, component, id_low, id_middle, id_high];
        bytes.extend_from_slice(&payload[..kept]);
        let checksum = calculate_crc(&bytes[1..], MavMessage::extra_crc(id));
        bytes.extend_from_slice(&checksum.to_le_bytes());
        Frame { bytes, known: true }
    }

    /// What a signature is made of, and the signature: id of the link, six bytes of time, six bytes of the hash. `None` if it has none.
    pub fn signature(&self) -> Option<(&[u8], &[u8])> {
        self.is_signed().then(|| self.bytes.split_at(self.bytes.len() - SIGNATURE))
    }

    /// The same frame with the signature that `sign` makes of its bytes.
    pub(crate) fn signed(mut self, sign: impl FnOnce(&[u8]) -> Vec<u8>) -> Frame {
        self.bytes[2] |= SIGNED;
        let checked = HEADER + usize::from(self.bytes[1]);
        self.bytes.truncate(checked);
        // The checksum is also over the flag.
        let checksum = calculate_crc(&self.bytes[1..], MavMessage::extra_crc(self.id()));
        self.bytes.extend_from_slice(&checksum.to_le_bytes());
        let signature = sign(&self.bytes);
        self.bytes.extend_from_slice(&signature);
        self
    }
}

/// What was found in the bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Found {
    /// A frame.
    Frame(Frame),
    /// A frame of MAVLink 1, which is not read.
    Version1,
}

/// Finds frames in bytes, and skips the rest.
#[derive(Debug, Default)]
pub struct Framer {
    bytes: Vec<u8>,
    skipped: u64,
}

impl Framer {
    /// All frames of one datagram; what is left over at its end belongs to no other.
    pub fn datagram(bytes: &[u8]) -> Vec<Found> {
        let mut framer = Framer::default();
        framer.push(bytes)
    }

    /// The frames that these bytes of a stream complete.
    pub fn push(&mut self, bytes: &[u8]) -> Vec<Found> {
        self.bytes.extend_from_slice(bytes);
        let mut found = Vec::new();
        let mut at = 0;
        while at < self.bytes.len() {
            match next(&self.bytes[at..]) {
                Next::Frame(frame) => {
                    at += frame.bytes.len();
                    found.push(Found::Frame(frame));
                }
                Next::Version1(length) => {
                    at += length;
                    found.push(Found::Version1);
                }
                Next::Skip => {
                    at += 1;
                    self.skipped += 1;
                }
                Next::Incomplete => break,
            }
        }
        self.bytes.drain(..at);
        found
    }

    /// How many bytes belonged to no frame.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}

enum Next {
    Frame(Frame),
    Version1(usize),
    Skip,
    Incomplete,
}

fn next(bytes: &[u8]) -> Next {
    match bytes[0] {
        MAGIC => next_frame(bytes),
        OLD_MAGIC => next_version_1(bytes),
        _ => Next::Skip,
    }
}

fn next_frame(bytes: &[u8]) -> Next {
    let [_, length, flags, ..] = *bytes else { return Next::Incomplete };
    if flags & !SIGNED != 0 {
        return Next::Skip;
    }
    let checked = HEADER + usize::from(length);
    let total = checked + CHECKSUM + if flags & SIGNED != 0 { SIGNATURE } else { 0 };
    let Some(frame) = bytes.get(..total) else { return Next::Incomplete };
    let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
    let checksum = u16::from_le_bytes([frame[checked], frame[checked + 1]]);
    let known = is_known(id);
    // Where nothing can be checked, the next frame must follow at once.
    let is_whole = match known {
        true => calculate_crc(&frame[1..checked], MavMessage::extra_crc(id)) == checksum,
        false => bytes.get(total).is_none_or(|it| [MAGIC, OLD_MAGIC].contains(it)),
    };
    if is_whole { Next::Frame(Frame { bytes: frame.to_vec(), known }) } else { Next::Skip }
}

fn next_version_1(bytes: &[u8]) -> Next {
    let [_, length, ..] = *bytes else { return Next::Incomplete };
    let checked = OLD_HEADER + usize::from(length);
    let Some(frame) = bytes.get(..checked + CHECKSUM) else { return Next::Incomplete };
    let checksum = u16::from_le_bytes([frame[checked], frame[checked + 1]]);
    let id = u32::from(frame[5]);
    let is_whole = is_known(id) && calculate_crc(&frame[1..checked], MavMessage::extra_crc(id)) == checksum;
    if is_whole { Next::Version1(frame.len()) } else { Next::Skip }
}

/// Whether the dialect has this message. Those that it has and that have the extra byte 0 do not exist in it.
fn is_known(id: u32) -> bool {
    MavMessage::extra_crc(id) != 0 || MavMessage::default_message_from_id(id).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEARTBEAT: [u8; 9] = [4, 0, 0, 0, 2, 3, 81, 3, 3];

    fn heartbeat(sequence: u8) -> Frame {
        Frame::new(sequence, 1, 1, 0, &HEARTBEAT)
    }

    /// A frame of a message that nobody knows, whose payload looks like the beginning of a long one.
    fn unknown() -> Vec<u8> {
        vec![MAGIC, 4, 0, 0, 9, 1, 1, 0xF0, 0xFF, 0x0F, MAGIC, 255, 0, 0, 0xAA, 0xBB]
    }

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let frame = heartbeat(7);
        assert_eq!(Framer::datagram(frame.bytes()), [Found::Frame(frame.clone())]);
        assert_eq!((frame.system(), frame.component(), frame.sequence(), frame.id()), (1, 1, 7, 0));
        assert_eq!(frame.payload(), HEARTBEAT);
        let zeros = Frame::new(0, 1, 191, 76, &[0; 33]);
        assert_eq!(zeros.payload(), [0], "zeros at the end are left out, but for one");
    }

    #[test]
    fn an_unknown_message_holds_nothing_back() {
        let mut datagram = unknown();
        datagram.extend_from_slice(heartbeat(1).bytes());
        let found = Framer::datagram(&datagram);
        let [Found::Frame(first), Found::Frame(second)] = &found[..] else { panic!("{found:?}") };
        assert!(!first.is_known() && *second == heartbeat(1));
        let cut = Framer::datagram(&unknown()[..12]);
        assert_eq!(cut, [], "the rest of a datagram that was cut is not awaited");
    }

    #[test]
    fn a_stream_gives_every_frame_whatever_the_pieces() {
        let mut bytes = vec![1, 2, OLD_MAGIC, MAGIC];
        for sequence in 0..20 {
            bytes.extend_from_slice(heartbeat(sequence).bytes());
        }
        for size in 1..40 {
            let mut framer = Framer::default();
            let found = bytes.chunks(size).flat_map(|it| framer.push(it)).collect::<Vec<_>>();
            // A false start holds back no more than it announces, which here is less than what follows.
            assert!(18 <= found.len(), "pieces of {size}: {}", found.len());
            assert!(framer.bytes.len() <= LONGEST);
        }
    }

    #[test]
    fn a_damaged_frame_is_no_frame() {
        for at in 0..heartbeat(0).bytes().len() {
            let mut bytes = heartbeat(0).bytes().to_vec();
            bytes[at] ^= 0x10;
            let found = Framer::datagram(&bytes);
            assert!(!found.contains(&Found::Frame(heartbeat(0))), "byte {at}: {found:?}");
            assert!(!found.iter().any(|it| matches!(it, Found::Frame(frame) if frame.is_known())), "byte {at}");
        }
    }

    #[test]
    fn version_1_is_noticed_and_not_read() {
        let mut bytes = vec![OLD_MAGIC, 9, 0, 1, 1, 0];
        bytes.extend_from_slice(&HEARTBEAT);
        let checksum = calculate_crc(&bytes[1..], MavMessage::extra_crc(0));
        bytes.extend_from_slice(&checksum.to_le_bytes());
        assert_eq!(Framer::datagram(&bytes), [Found::Version1]);
    }
}
