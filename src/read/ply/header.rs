//! The header: which elements and properties follow, in which encoding.

use crate::read::error::{Place, ReadProblem, shorten};
use crate::read::text::Lines;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub fn named(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// What 1 is written as in a colour.
    pub fn one(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::I32 => f64::from(i32::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Text,
    Little,
    Big,
}

pub struct Property {
    pub name: String,
    /// Type of the length of a list.
    pub length: Option<Scalar>,
    pub scalar: Scalar,
}

pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    pub fn find(&self, names: &[&str]) -> Option<usize> {
        let found = |p: &Property| names.contains(&p.name.as_str());
        self.properties.iter().position(found)
    }

    pub fn scalar(&self, names: &[&str]) -> Option<usize> {
        self.find(names)
            .filter(|&i| self.properties[i].length.is_none())
    }

    pub fn list(&self, names: &[&str]) -> Option<usize> {
        self.find(names)
            .filter(|&i| self.properties[i].length.is_some())
    }
}

/// Most lines of a header that declare something; real files have a few dozen.
const MAX_DECLARATIONS: usize = 1024;

/// What the header says, and where it ends.
pub struct Header {
    pub elements: Vec<Element>,
    pub encoding: Encoding,
    /// First byte of the values.
    pub end: usize,
    /// Their first line.
    pub line: usize,
}

/// Reads all up to `end_header`.
pub fn read_header(bytes: &[u8]) -> Result<Header, ReadProblem> {
    let mut lines = Lines::new(bytes);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut first = true;
    let mut declarations = 0;
    loop {
        let Some(line) = lines.next() else {
            return Err(ReadProblem::Expected {
                place: Place::Line(lines.number + 1),
                expected: "`end_header`",
                found: "end of file".into(),
            });
        };
        let place = Place::Line(lines.number);
        let expected = |expected| ReadProblem::Expected {
            place,
            expected,
            found: shorten(line),
        };
        // Not `words`: a name may begin with `#`.
        let split = line.split(|b| b.is_ascii_whitespace());
        let words: Vec<&[u8]> = split.filter(|w| !w.is_empty()).collect();
        if first {
            if words != [b"ply"] {
                return Err(expected("`ply` on the first line"));
            }
            first = false;
            continue;
        }
        let text = |word: &[u8]| String::from_utf8_lossy(word).into_owned();
        match words.as_slice() {
            [] | [b"comment" | b"obj_info", ..] => continue,
            _ if declarations == MAX_DECLARATIONS => {
                return Err(expected("at most 1024 elements and properties"));
            }
            [b"format", name, ..] => {
                encoding = Some(match *name {
                    b"ascii" => Encoding::Text,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => {
                        return Err(expected("ascii, binary_little_endian or binary_big_endian"));
                    }
                });
            }
            [b"element", name, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok());
                let count = count.ok_or_else(|| expected("`element name count`"))?;
                let name = text(name);
                if elements.iter().any(|e| e.name == name) {
                    return Err(expected("every element once"));
                }
                elements.push(Element {
                    name,
                    count,
                    properties: Vec::new(),
                });
            }
            [b"property", rest @ ..] => {
                let (length, scalar, name) = match rest {
                    [b"list", length, scalar, name] => (Some(*length), *scalar, *name),
                    [scalar, name] => (None, *scalar, *name),
                    _ => return Err(expected("`property type name`")),
                };
                let kind = |word| {
                    Scalar::named(word).ok_or_else(|| expected("a PLY type (char to double)"))
                };
                let property = Property {
                    name: text(name),
                    length: length.map(kind).transpose()?,
                    scalar: kind(scalar)?,
                };
                let element = elements.last_mut();
                let element = element.ok_or_else(|| expected("`element` before `property`"))?;
                element.properties.push(property);
            }
            [b"end_header"] => break,
            _ => return Err(expected("a PLY header line")),
        }
        declarations += 1;
    }
    let encoding = encoding.ok_or(ReadProblem::Expected {
        place: Place::Line(lines.number),
        expected: "a `format` line in the header",
        found: "end_header".into(),
    })?;
    Ok(Header {
        elements,
        encoding,
        end: bytes.len() - lines.rest().len(),
        line: lines.number + 1,
    })
}
