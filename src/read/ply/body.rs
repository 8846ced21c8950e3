//! The values after the header, one property at a time.

use super::header::{Element, Encoding, Property, Scalar};
use crate::read::error::{Place, ReadProblem};
use crate::read::text::number;

/// The values after the header.
pub struct Body<'a> {
    pub bytes: &'a [u8],
    pub at: usize,
    pub line: usize,
    pub encoding: Encoding,
}

impl Body<'_> {
    /// Where the next value stands.
    pub fn place(&mut self) -> Place {
        match self.encoding {
            Encoding::Text => {
                self.skip_blanks();
                Place::Line(self.line)
            }
            _ => Place::Byte(self.at),
        }
    }

    pub fn skip_blanks(&mut self) {
        while let Some(b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            // A lone carriage return ends a line too.
            let pair = *b == b'\r' && self.bytes.get(self.at + 1) == Some(&b'\n');
            self.line += usize::from((*b == b'\n' || *b == b'\r') && !pair);
            self.at += 1;
        }
    }

    pub fn left(&self) -> u64 {
        (self.bytes.len() - self.at) as u64
    }

    /// Refuses a number of rows that what is left of the file cannot hold.
    pub fn expect_rows(&self, element: &Element) -> Result<(), ReadProblem> {
        let size = |p: &Property| match self.encoding {
            Encoding::Text => 1,
            _ => p.length.unwrap_or(p.scalar).bytes() as u64,
        };
        let row: u64 = element.properties.iter().map(size).sum();
        self.expect_bytes("an element's rows", element.count.saturating_mul(row))
    }

    pub fn expect_bytes(&self, what: &'static str, needed: u64) -> Result<(), ReadProblem> {
        match needed > self.left() {
            true => Err(ReadProblem::Truncated {
                what,
                unit: "bytes",
                needed: (self.at as u64).saturating_add(needed),
                available: self.bytes.len() as u64,
            }),
            false => Ok(()),
        }
    }

    pub fn scalar(&mut self, scalar: Scalar) -> Result<f64, ReadProblem> {
        if self.encoding == Encoding::Text {
            return self.word();
        }
        let size = scalar.bytes();
        self.expect_bytes("a value", size as u64)?;
        let mut b = [0; 8];
        b[..size].copy_from_slice(&self.bytes[self.at..self.at + size]);
        if self.encoding == Encoding::Big {
            b[..size].reverse();
        }
        self.at += size;
        Ok(match scalar {
            Scalar::I8 => f64::from(b[0] as i8),
            Scalar::U8 => f64::from(b[0]),
            Scalar::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Scalar::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Scalar::I32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Scalar::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Scalar::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Scalar::F64 => f64::from_le_bytes(b),
        })
    }

    pub fn word(&mut self) -> Result<f64, ReadProblem> {
        let place = self.place();
        self.expect_bytes("a value", 1)?;
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| b.is_ascii_whitespace());
        let word = &rest[..end.unwrap_or(rest.len())];
        let value = number(word, place)?;
        self.at += word.len();
        Ok(value)
    }

    /// All values of a property, replacing `values`.
    pub fn property(
        &mut self,
        property: &Property,
        values: &mut Vec<f64>,
    ) -> Result<(), ReadProblem> {
        values.clear();
        let Some(length) = property.length else {
            values.push(self.scalar(property.scalar)?);
            return Ok(());
        };
        let place = self.place();
        let length = self.scalar(length)?;
        if length < 0.0 || length.fract() != 0.0 {
            return Err(ReadProblem::Expected {
                place,
                expected: "a whole number as length of a list",
                found: length.to_string(),
            });
        }
        let size = match self.encoding {
            Encoding::Text => 1,
            _ => property.scalar.bytes() as u64,
        };
        self.expect_bytes("a list", (length as u64).saturating_mul(size))?;
        for _ in 0..length as u64 {
            values.push(self.scalar(property.scalar)?);
        }
        Ok(())
    }
}
