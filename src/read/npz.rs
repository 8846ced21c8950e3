//! A bounded reader of `.npz`: a zip container of NumPy arrays.
//!
//! Only what the output format (`docs/format.md`) uses: little-endian f64 and u32, u8, C order. The header's shape must agree
//! with the entry's size before anything is read, memory grows only with data that is really there, and all arrays together
//! unpack to no more than [`unpacked_limit`] grants for the size of the container.

use super::bounded::{open_regular, unpacked_limit};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;
use zip::read::ZipFile;

/// Longest header that is read (NumPy writes less than 200 bytes for arrays like ours).
const HEADER_LIMIT: usize = 1 << 16;

/// Bytes that the arrays of any container may unpack to.
const FLOOR: u64 = 64 << 20;

/// A number type of the format, or rows of one.
pub(crate) trait Element: Copy {
    /// NumPy's names for it.
    const DESCR: &'static [&'static str];
    /// In words.
    const NAME: &'static str;
    /// Bytes.
    const SIZE: usize;
    /// Numbers in it.
    const NUMBERS: usize = 1;
    /// From `SIZE` bytes.
    fn from_le(bytes: &[u8]) -> Self;
}

macro_rules! element {
    ($type:ty, $name:literal, $($descr:literal),+) => {
        impl Element for $type {
            const DESCR: &'static [&'static str] = &[$($descr),+];
            const NAME: &'static str = $name;
            const SIZE: usize = size_of::<$type>();
            fn from_le(bytes: &[u8]) -> Self {
                let mut buffer = [0; size_of::<$type>()];
                buffer.copy_from_slice(bytes);
                <$type>::from_le_bytes(buffer)
            }
        }
    };
}
element!(f64, "float64", "<f8");
element!(i64, "int64", "<i8");
element!(u32, "uint32", "<u4");
element!(u8, "uint8", "|u1", "<u1", "u1");

/// A row of numbers, so that an array of several axes need not be copied into its rows.
impl<T: Element, const N: usize> Element for [T; N] {
    const DESCR: &'static [&'static str] = T::DESCR;
    const NAME: &'static str = T::NAME;
    const SIZE: usize = N * T::SIZE;
    const NUMBERS: usize = N * T::NUMBERS;
    fn from_le(bytes: &[u8]) -> Self {
        std::array::from_fn(|i| T::from_le(&bytes[i * T::SIZE..(i + 1) * T::SIZE]))
    }
}

/// An open container.
pub(crate) struct Npz {
    archive: ZipArchive<BufReader<File>>,
    /// Bytes of the container.
    size: u64,
    /// Bytes that its arrays may still unpack to.
    left: u64,
}

impl Npz {
    pub fn open(path: &Path) -> Result<Self, String> {
        let (file, size) = open_regular(path).map_err(|error| error.to_string())?;
        let archive = ZipArchive::new(BufReader::new(file)).map_err(|error| error.to_string())?;
        let left = unpacked_limit(FLOOR, size);
        Ok(Self {
            archive,
            size,
            left,
        })
    }

    /// Whether an array of that name is there.
    pub fn has(&mut self, name: &str) -> bool {
        self.archive.by_name(&format!("{name}.npy")).is_ok()
    }

    /// One array, whose shape must be `shape`; `None` stands for any extent. Returns the numbers in C order, or rows of them
    /// where `T` is a row as long as the last axes of `shape`, and the first extent.
    pub fn read<T: Element>(
        &mut self,
        name: &str,
        shape: &[Option<usize>],
    ) -> Result<(Vec<T>, usize), String> {
        let at = |what: String| format!("{name}: {what}");
        let kind = Kind {
            descr: T::DESCR,
            name: T::NAME,
            size: T::SIZE,
            numbers: T::NUMBERS,
        };
        let mut entry = self.entry(name, shape, &kind)?;
        let mut values = Vec::with_capacity(entry.count.min(1 << 16));
        let mut buffer = vec![0; T::SIZE * (1_usize << 16).div_ceil(T::SIZE)];
        let mut left = T::SIZE * entry.count;
        while left > 0 {
            let now = left.min(buffer.len());
            let read = entry.data.read_exact(&mut buffer[..now]);
            read.map_err(|error| at(format!("is cut short: {error}")))?;
            values.extend(buffer[..now].chunks_exact(T::SIZE).map(T::from_le));
            left -= now;
        }
        // Reading past the end makes the container test its checksum.
        match entry.data.read(&mut buffer) {
            Ok(0) => Ok((values, entry.extent)),
            Ok(_) => Err(at("holds more than its shape says".to_owned())),
            Err(error) => Err(at(error.to_string())),
        }
    }

    /// Opens one array at the first of its data. Its elements must be of the kind, its shape must be `shape`.
    fn entry(
        &mut self,
        name: &str,
        shape: &[Option<usize>],
        kind: &Kind,
    ) -> Result<Entry<'_>, String> {
        let at = |what: String| format!("{name}: {what}");
        let mut entry = self
            .archive
            .by_name(&format!("{name}.npy"))
            .map_err(|error| at(error.to_string()))?;
        let stored = entry.size();
        let (header, header_bytes) = read_header(&mut entry).map_err(at)?;
        if !kind.descr.contains(&header.descr.as_str()) {
            return Err(at(format!("type {} is not {}", header.descr, kind.name)));
        }
        if header.fortran_order && header.shape.len() > 1 {
            return Err(at("is in Fortran order, not C order".to_owned()));
        }
        let fits = header.shape.len() == shape.len()
            && shape
                .iter()
                .zip(&header.shape)
                .all(|(want, have)| want.is_none_or(|want| want == *have));
        if !fits {
            let want: Vec<String> = shape
                .iter()
                .map(|n| n.map_or("any".to_owned(), |n| n.to_string()))
                .collect();
            return Err(at(format!(
                "shape {:?} is not ({})",
                header.shape,
                want.join(", ")
            )));
        }
        let count = header
            .shape
            .iter()
            .try_fold(1usize, |product, n| product.checked_mul(*n));
        let count = count.filter(|count| count.is_multiple_of(kind.numbers));
        let count = count.map(|count| count / kind.numbers);
        let bytes = count.and_then(|count| count.checked_mul(kind.size));
        let (Some(count), Some(bytes)) = (count, bytes) else {
            return Err(at(format!("shape {:?} is impossible", header.shape)));
        };
        if stored != bytes as u64 + header_bytes as u64 {
            return Err(at(format!(
                "holds {stored} bytes, its shape {:?} needs {}",
                header.shape,
                bytes as u64 + header_bytes as u64
            )));
        }
        let Some(left) = self.left.checked_sub(bytes as u64) else {
            return Err(at(format!(
                "unpacks to {bytes} bytes, and the arrays of a container of {} bytes may unpack to {} together, of which {} are left",
                self.size,
                unpacked_limit(FLOOR, self.size),
                self.left
            )));
        };
        self.left = left;
        Ok(Entry {
            data: entry,
            count,
            extent: header.shape[0],
        })
    }
}

/// What an [`Element`] is.
struct Kind {
    descr: &'static [&'static str],
    name: &'static str,
    size: usize,
    numbers: usize,
}

/// An array that can be read.
struct Entry<'a> {
    data: ZipFile<'a, BufReader<File>>,
    /// Elements.
    count: usize,
    /// Along the first axis.
    extent: usize,
}

#[derive(Debug, PartialEq)]
struct Header {
    descr: String,
    fortran_order: bool,
    shape: Vec<usize>,
}

/// The header and the number of bytes before the data.
fn read_header(input: &mut impl Read) -> Result<(Header, usize), String> {
    let mut start = [0; 8];
    let cut = |error: std::io::Error| format!("is cut short: {error}");
    input.read_exact(&mut start).map_err(cut)?;
    if &start[..6] != b"\x93NUMPY" {
        return Err("is no NumPy array".to_owned());
    }
    let (length, before) = match start[6] {
        1 => {
            let mut n = [0; 2];
            input.read_exact(&mut n).map_err(cut)?;
            (usize::from(u16::from_le_bytes(n)), 10)
        }
        2 | 3 => {
            let mut n = [0; 4];
            input.read_exact(&mut n).map_err(cut)?;
            (u32::from_le_bytes(n) as usize, 12)
        }
        version => return Err(format!("has NumPy format version {version}, not 1 to 3")),
    };
    if length > HEADER_LIMIT {
        return Err(format!(
            "has a header of {length} bytes, more than {HEADER_LIMIT}"
        ));
    }
    let mut text = vec![0; length];
    input.read_exact(&mut text).map_err(cut)?;
    let text = String::from_utf8_lossy(&text);
    let header = parse_header(&text).ok_or_else(|| format!("has the header {:?}", text.trim()))?;
    Ok((header, before + length))
}

/// The Python dictionary of an array's header.
fn parse_header(text: &str) -> Option<Header> {
    let value = |key: &str| {
        let rest = &text[text.find(&format!("'{key}'"))? + key.len() + 2..];
        Some(rest.trim_start().strip_prefix(':')?.trim_start())
    };
    let descr = value("descr")?.strip_prefix('\'')?;
    let descr = descr[..descr.find('\'')?].to_owned();
    let order = value("fortran_order")?;
    let fortran_order = match (order.starts_with("True"), order.starts_with("False")) {
        (true, _) => true,
        (_, true) => false,
        _ => return None,
    };
    let shape = value("shape")?.strip_prefix('(')?;
    let shape = shape[..shape.find(')')?]
        .split(',')
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect::<Option<Vec<usize>>>()?;
    if shape.is_empty() {
        return None;
    }
    Some(Header {
        descr,
        fortran_order,
        shape,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_as_numpy_writes_them() {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (12, 3), }          \n";
        assert_eq!(
            parse_header(header),
            Some(Header {
                descr: "<f8".to_owned(),
                fortran_order: false,
                shape: vec![12, 3],
            })
        );
        let header = "{'descr': '|u1', 'fortran_order': False, 'shape': (7,), }";
        assert_eq!(parse_header(header).map(|h| h.shape), Some(vec![7]));
    }

    #[test]
    fn broken_headers_are_refused() {
        for text in [
            "",
            "{'descr': '<f8'",
            "{'descr': '<f8', 'fortran_order': maybe, 'shape': (1,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': ()}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
            "{'descr': 'é, 'fortran_order': False, 'shape': (1,",
        ] {
            assert_eq!(parse_header(text), None, "{text}");
        }
    }

    #[test]
    fn a_header_longer_than_the_limit_is_not_read() {
        let bytes = b"\x93NUMPY\x02\x00\xff\xff\xff\xff";
        let error = read_header(&mut &bytes[..]).expect_err("too long");
        assert!(error.contains("4294967295"), "{error}");
    }
}
