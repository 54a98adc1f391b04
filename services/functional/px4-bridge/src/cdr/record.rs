//! A message with its values, from bytes and to bytes.

use super::HEADER;
use super::definition::{Definition, Kind};

/// A number of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// True or false.
    Bool(bool),
    /// Zero or more.
    Unsigned(u64),
    /// Any whole number.
    Signed(i64),
    /// A single-precision number; it may be none at all.
    Single(f32),
    /// A double-precision number; it may be none at all.
    Double(f64),
}

/// Why bytes are not the message that their key promises, or a value is not in a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The first four bytes say something else.
    #[error("found the header {0:02x?}, expected little-endian CDR, 00 01 00 00")]
    Header(Vec<u8>),
    /// The bytes end within the message.
    #[error("it ends within `{field}`, after {length} bytes")]
    Short {
        /// The field that is not whole.
        field: String,
        /// How many bytes there are.
        length: usize,
    },
    /// This version of the message has no such field.
    #[error("this version of `{topic}` has no field `{field}` of that kind")]
    NoField {
        /// The topic.
        topic: String,
        /// The field.
        field: String,
    },
}

/// A message: the values of its fields, arrays written out.
#[derive(Debug, Clone, PartialEq)]
pub struct Record<'a> {
    definition: &'a Definition,
    values: Vec<Value>,
}

impl<'a> Record<'a> {
    /// All zero.
    pub fn zero(definition: &'a Definition) -> Record<'a> {
        let zero = |kind| match kind {
            Kind::Bool => Value::Bool(false),
            Kind::Unsigned(_) => Value::Unsigned(0),
            Kind::Signed(_) => Value::Signed(0),
            Kind::Float(4) => Value::Single(0.0),
            Kind::Float(_) => Value::Double(0.0),
        };
        let values = definition.fields.iter().flat_map(|it| std::iter::repeat_n(zero(it.kind), it.count)).collect();
        Record { definition, values }
    }

    /// The message in `payload`; what follows it is ignored.
    ///
    /// # Errors
    /// If the payload is too short or no CDR.
    pub fn decode(definition: &'a Definition, payload: &[u8]) -> Result<Record<'a>, CdrError> {
        let Some(body) = payload.strip_prefix(&HEADER) else {
            return Err(CdrError::Header(payload.iter().take(HEADER.len()).copied().collect()));
        };
        let (mut values, mut at) = (Vec::new(), 0_usize);
        for field in &definition.fields {
            for _ in 0..field.count {
                let size = field.kind.size();
                let start = at.next_multiple_of(size);
                let Some(bytes) = body.get(start..start + size) else {
                    return Err(CdrError::Short { field: field.name.clone(), length: payload.len() });
                };
                values.push(read(field.kind, bytes));
                at = start + size;
            }
        }
        Ok(Record { definition, values })
    }

    /// Its bytes, with nothing behind them.
    pub fn encode(&self) -> Vec<u8> {
        let mut body: Vec<u8> = Vec::new();
        let kinds = self.definition.fields.iter().flat_map(|it| std::iter::repeat_n(it.kind, it.count));
        for (kind, value) in kinds.zip(&self.values) {
            body.resize(body.len().next_multiple_of(kind.size()), 0);
            write(kind, *value, &mut body);
        }
        [&HEADER[..], &body].concat()
    }

    /// Its definition.
    pub fn definition(&self) -> &'a Definition {
        self.definition
    }

    /// The values of a field.
    ///
    /// # Errors
    /// If this version has no such field.
    pub fn values(&self, field: &str) -> Result<&[Value], CdrError> {
        let (start, count) = self.place(field)?;
        Ok(&self.values[start..start + count])
    }

    /// A field's first value as a number, whole or not.
    ///
    /// # Errors
    /// If this version has no such field of that kind.
    pub fn number(&self, field: &str) -> Result<f64, CdrError> {
        self.number_at(field, 0)
    }

    /// A number of a field that is an array.
    ///
    /// # Errors
    /// If this version has no such field of that kind, or the array is shorter.
    pub fn number_at(&self, field: &str, index: usize) -> Result<f64, CdrError> {
        match self.values(field)?.get(index) {
            Some(Value::Unsigned(it)) => Ok(*it as f64),
            Some(Value::Signed(it)) => Ok(*it as f64),
            Some(Value::Single(it)) => Ok(f64::from(*it)),
            Some(Value::Double(it)) => Ok(*it),
            Some(Value::Bool(_)) | None => Err(self.no_field(field)),
        }
    }

    /// A field that is a number of zero or more.
    ///
    /// # Errors
    /// If this version has no such field of that kind.
    pub fn unsigned(&self, field: &str) -> Result<u64, CdrError> {
        match self.values(field)?.first() {
            Some(Value::Unsigned(it)) => Ok(*it),
            _ => Err(self.no_field(field)),
        }
    }

    /// A field that is true or false.
    ///
    /// # Errors
    /// If this version has no such field of that kind.
    pub fn flag(&self, field: &str) -> Result<bool, CdrError> {
        match self.values(field)?.first() {
            Some(Value::Bool(it)) => Ok(*it),
            _ => Err(self.no_field(field)),
        }
    }

    /// Sets a field that is true or false.
    ///
    /// # Errors
    /// If this version has no such field of that kind.
    pub fn set_flag(&mut self, field: &str, value: bool) -> Result<(), CdrError> {
        self.set(field, 0, |_| Some(Value::Bool(value)), |it| matches!(it, Value::Bool(_)))
    }

    /// Sets a field to a number; a whole one takes its whole part.
    ///
    /// # Errors
    /// If this version has no such field of that kind.
    pub fn set_number(&mut self, field: &str, value: f64) -> Result<(), CdrError> {
        self.set_number_at(field, 0, value)
    }

    /// Sets a number of an array.
    ///
    /// # Errors
    /// If this version has no such field of that kind, or the array is shorter.
    pub fn set_number_at(&mut self, field: &str, index: usize, value: f64) -> Result<(), CdrError> {
        let of = |present: Value| {
            Some(match present {
                Value::Bool(_) => return None,
                Value::Unsigned(_) => Value::Unsigned(value as u64),
                Value::Signed(_) => Value::Signed(value as i64),
                Value::Single(_) => Value::Single(value as f32),
                Value::Double(_) => Value::Double(value),
            })
        };
        self.set(field, index, of, |it| !matches!(it, Value::Bool(_)))
    }

    fn set(
        &mut self,
        field: &str,
        index: usize,
        of: impl FnOnce(Value) -> Option<Value>,
        fits: impl FnOnce(Value) -> bool,
    ) -> Result<(), CdrError> {
        let (start, count) = self.place(field)?;
        let present = Some(start + index).filter(|_| index < count).map(|it| self.values[it]);
        match present.filter(|it| fits(*it)).and_then(of) {
            Some(value) => {
                self.values[start + index] = value;
                Ok(())
            }
            None => Err(self.no_field(field)),
        }
    }

    /// Where a field's values begin, and how many there are.
    fn place(&self, field: &str) -> Result<(usize, usize), CdrError> {
        let mut start = 0;
        for it in &self.definition.fields {
            if it.name == field {
                return Ok((start, it.count));
            }
            start += it.count;
        }
        Err(self.no_field(field))
    }

    fn no_field(&self, field: &str) -> CdrError {
        CdrError::NoField { topic: self.definition.topic.clone(), field: field.to_owned() }
    }
}

/// `bytes` are as many as the kind has.
fn read(kind: Kind, bytes: &[u8]) -> Value {
    let mut eight = [0; 8];
    eight[..bytes.len()].copy_from_slice(bytes);
    let raw = u64::from_le_bytes(eight);
    match kind {
        Kind::Bool => Value::Bool(raw != 0),
        Kind::Unsigned(_) => Value::Unsigned(raw),
        Kind::Signed(size) => {
            let unused = 64 - 8 * size as u32;
            Value::Signed((raw << unused).cast_signed() >> unused)
        }
        Kind::Float(4) => Value::Single(f32::from_bits(raw as u32)),
        Kind::Float(_) => Value::Double(f64::from_bits(raw)),
    }
}

fn write(kind: Kind, value: Value, into: &mut Vec<u8>) {
    let raw = match value {
        Value::Bool(it) => u64::from(it),
        Value::Unsigned(it) => it,
        Value::Signed(it) => it.cast_unsigned(),
        Value::Single(it) => u64::from(it.to_bits()),
        Value::Double(it) => it.to_bits(),
    };
    into.extend(&raw.to_le_bytes()[..kind.size()]);
}
