//! Encoding and decoding of message bytes, and macros for the registers that hold one value.

use super::Message;
use crate::error::{Error, Result};

/// Reads the fields of a message one after another. Bytes after the last field are padding.
pub struct Bytes<'a> {
    name: &'static str,
    data: &'a [u8],
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub fn new(name: &'static str, data: &'a [u8]) -> Self {
        Self { name, data, rest: data }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some((head, rest)) = self.rest.split_first_chunk::<N>() else {
            let needed = self.data.len() - self.rest.len() + N;
            let unit = if needed == 1 { "byte" } else { "bytes" };
            return Err(Error::malformed(self.name, format!("at least {needed} {unit}"), self.data.len()));
        };
        self.rest = rest;
        Ok(*head)
    }

    pub fn u8(&mut self) -> Result<u8> {
        Ok(self.take::<1>()?[0])
    }

    pub fn u16(&mut self) -> Result<u16> {
        Ok(u16::from_le_bytes(self.take()?))
    }

    pub fn u24(&mut self) -> Result<u32> {
        let [low, middle, high] = self.take()?;
        Ok(u32::from_le_bytes([low, middle, high, 0]))
    }

    pub fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    pub fn u16s<const N: usize>(&mut self) -> Result<[u16; N]> {
        let mut values = [0; N];
        for value in &mut values {
            *value = self.u16()?;
        }
        Ok(values)
    }
}

/// Little-endian bytes of a sequence of 16-bit fields.
pub fn from_u16s(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Check the range of a register value; the error names the register.
pub fn in_range(name: &str, value: u32, low: u32, high: u32) -> Result<u32> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(Error::value(name, format!("{low} to {high}"), value))
}

/// Refuse a decoded message with a field out of range, which could not be encoded.
pub fn checked<M: Message>(message: M) -> Result<M> {
    message.encode()?;
    Ok(message)
}

/// Declare whether a message can be read, written, or both.
macro_rules! direction {
    ($name:ident, read) => {
        impl crate::command::Readable for $name {}
    };
    ($name:ident, write) => {
        impl crate::command::Writable for $name {}
    };
    ($name:ident, both) => {
        impl crate::command::Readable for $name {}
        impl crate::command::Writable for $name {}
    };
}

/// Named values of a field of some bits.
macro_rules! values {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $value:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$variant_doc])* $variant = $value),+ }

        impl $name {
            /// The value of these bits; the error names `field` and the known values.
            fn from_bits(field: &str, bits: u8) -> crate::error::Result<Self> {
                match bits {
                    $($value => Ok(Self::$variant),)+
                    other => {
                        let known = [$(concat!(stringify!($value), " ", stringify!($variant))),+].join(", ");
                        Err(crate::error::Error::malformed(field, known, other))
                    }
                }
            }
        }
    };
}

/// A register of one byte that chooses among named values.
macro_rules! choice {
    ($(#[$doc:meta])* $name:ident, $word:literal, $title:literal, $direction:ident, { $($values:tt)+ }) => {
        crate::command::bytes::values! { $(#[$doc])* $name { $($values)+ } }

        impl crate::command::Message for $name {
            const WORD: u16 = $word;
            const NAME: &'static str = $title;

            fn encode(&self) -> crate::error::Result<Vec<u8>> {
                Ok(vec![*self as u8])
            }

            fn decode(data: &[u8]) -> crate::error::Result<Self> {
                Self::from_bits($title, crate::command::bytes::Bytes::new($title, data).u8()?)
            }
        }

        direction!($name, $direction);
    };
}

/// A register that holds one number, of type `u8` or `u16`, up to a greatest value.
macro_rules! number {
    ($(#[$doc:meta])* $name:ident, $word:literal, $title:literal, $direction:ident, $kind:ident up to $last:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct $name(pub $kind);

        impl crate::command::Message for $name {
            const WORD: u16 = $word;
            const NAME: &'static str = $title;

            fn encode(&self) -> crate::error::Result<Vec<u8>> {
                crate::command::bytes::in_range($title, self.0.into(), 0, $last)?;
                Ok(self.0.to_le_bytes().to_vec())
            }

            fn decode(data: &[u8]) -> crate::error::Result<Self> {
                let number = crate::command::bytes::Bytes::new($title, data).$kind()?;
                crate::command::bytes::checked(Self(number))
            }
        }

        direction!($name, $direction);
    };
}

/// A register of one byte whose bits have names; the others are zero.
macro_rules! bits {
    ($(#[$doc:meta])* $name:ident, $word:literal, $title:literal, $direction:ident,
     { $($(#[$field_doc:meta])* $field:ident = $bit:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct $name { $($(#[$field_doc])* pub $field: bool),+ }

        impl crate::command::Message for $name {
            const WORD: u16 = $word;
            const NAME: &'static str = $title;

            fn encode(&self) -> crate::error::Result<Vec<u8>> {
                Ok(vec![$(u8::from(self.$field) << $bit)|+])
            }

            fn decode(data: &[u8]) -> crate::error::Result<Self> {
                let byte = crate::command::bytes::Bytes::new($title, data).u8()?;
                Ok(Self { $($field: byte & (1 << $bit) != 0),+ })
            }
        }

        direction!($name, $direction);
    };
}

/// A register of one byte that holds a switch.
macro_rules! switch {
    ($(#[$doc:meta])* $name:ident, $word:literal, $title:literal, $direction:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct $name(pub bool);

        impl crate::command::Message for $name {
            const WORD: u16 = $word;
            const NAME: &'static str = $title;

            fn encode(&self) -> crate::error::Result<Vec<u8>> {
                Ok(vec![u8::from(self.0)])
            }

            fn decode(data: &[u8]) -> crate::error::Result<Self> {
                Ok(Self(crate::command::bytes::Bytes::new($title, data).u8()? & 1 != 0))
            }
        }

        direction!($name, $direction);
    };
}

pub(crate) use {bits, choice, direction, number, switch, values};
