//! What goes over a direct link: packets with a short head, so that nothing is encoded twice.
//!
//! ```text
//! kind (1) · number (8) · length of the key (2) · length of the attachment (2) · key · attachment · payload
//! ```
//!
//! Numbers are little-endian. Key and attachment are those of the bus, the payload is the same message or request.

use std::io::IoSlice;

use prost::Message as _;

/// Counts changes of the packets: ends of different protocols do not speak with each other.
const PROTOCOL: u32 = 1;

const HEAD: usize = 13;

/// The greatest packet that is read: a payload of the bus and what belongs to it.
pub(super) const LONGEST: usize = 300 * 1024;

/// What a packet is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Who speaks: the first one of each end.
    Hello = 0,
    /// A message with the topic `key`.
    Message = 1,
    /// A request to the service `key`, with a number of the caller's own.
    Request = 2,
    /// The answer to the request of this number.
    Reply = 3,
    /// The request of this number was refused, or left without an answer.
    Failure = 4,
    /// The request of this number has not been seen by a node: it may be sent again.
    Unserved = 5,
}

/// One packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Packet<'a> {
    pub(super) kind: Kind,
    /// Of the request; 0 for a message.
    pub(super) number: u64,
    pub(super) key: &'a str,
    pub(super) attachment: &'a [u8],
    pub(super) payload: &'a [u8],
}

impl<'a> Packet<'a> {
    /// One about a request, with nothing but `payload`.
    pub(super) fn about(kind: Kind, number: u64, payload: &'a [u8]) -> Packet<'a> {
        Packet { kind, number, key: "", attachment: &[], payload }
    }

    /// Its head, for [`Packet::parts`]; `None` if its key or attachment is not ours.
    pub(super) fn head(&self) -> Option<[u8; HEAD]> {
        let mut head = [0; HEAD];
        head[0] = self.kind as u8;
        head[1..9].copy_from_slice(&self.number.to_le_bytes());
        head[9..11].copy_from_slice(&u16::try_from(self.key.len()).ok()?.to_le_bytes());
        head[11..13].copy_from_slice(&u16::try_from(self.attachment.len()).ok()?.to_le_bytes());
        Some(head)
    }

    /// What is sent, as one.
    pub(super) fn parts(&self, head: &'a [u8; HEAD]) -> [IoSlice<'a>; 4] {
        [
            IoSlice::new(head),
            IoSlice::new(self.key.as_bytes()),
            IoSlice::new(self.attachment),
            IoSlice::new(self.payload),
        ]
    }

    /// The packet in `bytes`; `None` if they are not one.
    pub(super) fn read(bytes: &'a [u8]) -> Option<Packet<'a>> {
        let (head, rest) = bytes.split_first_chunk::<HEAD>()?;
        let length = |at: usize| usize::from(u16::from_le_bytes([head[at], head[at + 1]]));
        let (key, rest) = rest.split_at_checked(length(9))?;
        let (attachment, payload) = rest.split_at_checked(length(11))?;
        let kind = match head[0] {
            0 => Kind::Hello,
            1 => Kind::Message,
            2 => Kind::Request,
            3 => Kind::Reply,
            4 => Kind::Failure,
            5 => Kind::Unserved,
            _ => return None,
        };
        let number = u64::from_le_bytes(head[1..9].try_into().ok()?);
        Some(Packet { kind, number, key: std::str::from_utf8(key).ok()?, attachment, payload })
    }
}

/// Who an end is, and what it wants to hear.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Hello {
    #[prost(uint32, tag = "1")]
    protocol: u32,
    #[prost(string, tag = "2")]
    pub(super) vehicle: String,
    #[prost(string, tag = "3")]
    pub(super) service: String,
    /// Keys of the topics it listens to.
    #[prost(string, repeated, tag = "4")]
    pub(super) topics: Vec<String>,
    /// Keys of what it answers.
    #[prost(string, repeated, tag = "5")]
    pub(super) services: Vec<String>,
}

impl Hello {
    pub(super) fn new(vehicle: &str, service: &str, topics: Vec<String>, services: Vec<String>) -> Hello {
        Hello { protocol: PROTOCOL, vehicle: vehicle.to_owned(), service: service.to_owned(), topics, services }
    }

    /// The one in `payload`, for an end of `vehicle`.
    ///
    /// # Errors
    /// Why the two do not speak with each other.
    pub(super) fn read(payload: &[u8], vehicle: &str) -> Result<Hello, String> {
        let hello = Hello::decode(payload).map_err(|_| "it does not say who it is".to_owned())?;
        if hello.protocol != PROTOCOL {
            return Err(format!("it speaks protocol {} of direct links, this process {PROTOCOL}", hello.protocol));
        }
        if hello.vehicle != vehicle {
            return Err(format!("it belongs to vehicle `{}`, this process to `{vehicle}`", hello.vehicle));
        }
        Ok(hello)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn bytes(packet: &Packet<'_>) -> Vec<u8> {
        let head = packet.head().unwrap();
        packet.parts(&head).iter().flat_map(|it| it.to_vec()).collect()
    }

    fn kind() -> impl Strategy<Value = Kind> {
        prop::sample::select(&[Kind::Hello, Kind::Message, Kind::Request, Kind::Reply, Kind::Failure, Kind::Unserved])
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            kind in kind(), number: u64, key in "[a-z/]{0,40}", attachment: Vec<u8>, payload: Vec<u8>,
        ) {
            let packet = Packet { kind, number, key: &key, attachment: &attachment, payload: &payload };
            let written = bytes(&packet);
            prop_assert_eq!(Packet::read(&written), Some(packet));
        }

        #[test]
        fn garbage_is_no_packet_or_one_within_its_bounds(garbage: Vec<u8>) {
            if let Some(packet) = Packet::read(&garbage) {
                prop_assert_eq!(bytes(&packet), garbage);
            }
        }
    }

    #[test]
    fn who_is_of_another_vehicle_or_protocol_is_not_spoken_with() {
        #[track_caller]
        fn check(hello: &Hello, expected: Result<(), &str>) {
            let read = Hello::read(&hello.encode_to_vec(), "uav1");
            assert_eq!(read.map(|_| ()).as_ref().map_err(String::as_str), expected.as_ref().map_err(|it| *it));
        }
        let hello = |vehicle| Hello::new(vehicle, "mcm", vec!["skill/event".into()], Vec::new());
        check(&hello("uav1"), Ok(()));
        check(&hello("uav2"), Err("it belongs to vehicle `uav2`, this process to `uav1`"));
        let later = Hello { protocol: 9, ..hello("uav1") };
        check(&later, Err("it speaks protocol 9 of direct links, this process 1"));
        assert_eq!(Hello::read(b"\xff\xff", "uav1").unwrap_err(), "it does not say who it is");
    }
}
