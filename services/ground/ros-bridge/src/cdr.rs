//! ROS's bytes: four bytes of header, then little-endian XCDR1, where every number is aligned to its own size, counted from after the
//! header.

use crate::stamp::Stamp;

/// CDR, little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Writes a message, field by field.
#[derive(Debug, Default)]
pub(crate) struct Writer(Vec<u8>);

impl Writer {
    pub(crate) fn bytes(mut self, bytes: &[u8]) -> Writer {
        self.0.extend(bytes);
        self
    }

    pub(crate) fn u8(self, value: u8) -> Writer {
        self.bytes(&[value])
    }

    pub(crate) fn bool(self, value: bool) -> Writer {
        self.u8(value.into())
    }

    pub(crate) fn i8(self, value: i8) -> Writer {
        self.bytes(&value.to_le_bytes())
    }

    pub(crate) fn u16(self, value: u16) -> Writer {
        self.aligned(&value.to_le_bytes())
    }

    pub(crate) fn u32(self, value: u32) -> Writer {
        self.aligned(&value.to_le_bytes())
    }

    pub(crate) fn f32(self, value: f64) -> Writer {
        self.aligned(&(value as f32).to_le_bytes())
    }

    pub(crate) fn f64(self, value: f64) -> Writer {
        self.aligned(&value.to_le_bytes())
    }

    pub(crate) fn f64s(self, values: impl IntoIterator<Item = f64>) -> Writer {
        values.into_iter().fold(self, Writer::f64)
    }

    pub(crate) fn string(self, text: &str) -> Writer {
        // ROS ends a text at its first zero byte.
        let text = text.split('\0').next().unwrap_or_default();
        self.length(text.len() + 1).bytes(text.as_bytes()).u8(0)
    }

    pub(crate) fn stamp(self, stamp: Stamp) -> Writer {
        self.aligned(&stamp.sec.to_le_bytes()).u32(stamp.nanosec)
    }

    /// `std_msgs/msg/Header`.
    pub(crate) fn header(self, stamp: Stamp, frame: &str) -> Writer {
        self.stamp(stamp).string(frame)
    }

    /// A sequence.
    pub(crate) fn each<T>(
        self,
        items: impl IntoIterator<Item = T, IntoIter: ExactSizeIterator>,
        write: impl FnMut(Writer, T) -> Writer,
    ) -> Writer {
        let items = items.into_iter();
        let writer = self.length(items.len());
        items.fold(writer, write)
    }

    pub(crate) fn end(self) -> Vec<u8> {
        [&HEADER[..], &self.0].concat()
    }

    fn length(self, length: usize) -> Writer {
        self.u32(u32::try_from(length).unwrap_or(u32::MAX))
    }

    fn aligned(mut self, bytes: &[u8]) -> Writer {
        self.0.resize(self.0.len().next_multiple_of(bytes.len()), 0);
        self.bytes(bytes)
    }
}

/// Reads a message, field by field; `None` where it ends too early or is another one.
#[derive(Debug)]
pub(crate) struct Reader<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(payload: &'a [u8]) -> Option<Reader<'a>> {
        payload.strip_prefix(&HEADER).map(|body| Reader { body, at: 0 })
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.at = self.at.next_multiple_of(4);
        Some(u32::from_le_bytes(self.array()?))
    }

    pub(crate) fn string(&mut self) -> Option<&'a str> {
        let length = usize::try_from(self.u32()?).ok()?;
        let text = self.take(length)?;
        std::str::from_utf8(text.strip_suffix(&[0])?).ok()
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.body.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_and_texts_end_with_a_zero() {
        let bytes = Writer::default().u8(7).u16(2).string("ab").f64(1.0).each([1_u8, 2], Writer::u8).end();
        let expected = [
            &HEADER[..],
            &[7, 0, 2, 0],
            &[3, 0, 0, 0, b'a', b'b', 0],
            &[0; 1],
            &[0; 4],
            &1.0_f64.to_le_bytes(),
            &[2, 0, 0, 0, 1, 2],
        ];
        assert_eq!(bytes, expected.concat());
    }

    #[test]
    fn what_was_written_is_read_and_what_is_cut_off_is_not() {
        let bytes = Writer::default().bytes(&[9; 3]).string("a mission").end();
        let read = |bytes: &[u8]| {
            let mut reader = Reader::new(bytes)?;
            Some((reader.array::<3>()?, reader.string()?.to_owned()))
        };
        assert_eq!(read(&bytes), Some(([9; 3], "a mission".to_owned())));
        (0..bytes.len()).for_each(|length| assert_eq!(read(&bytes[..length]), None, "{length}"));
        assert_eq!(read(&[&[0, 0, 0, 0][..], &bytes[4..]].concat()), None, "big-endian");
    }
}
