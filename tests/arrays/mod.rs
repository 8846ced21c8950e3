//! Arrays of `atlas.npz`, read by code that shares nothing with the program's.

// Not every test needs all of it.
#![allow(dead_code)]

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A NumPy array (format 1.0) as it lies in its file.
pub struct Npy<'a> {
    /// NumPy's name of the element type: `<f8`.
    pub descr: String,
    pub is_fortran: bool,
    pub shape: Vec<usize>,
    data: &'a [u8],
}

impl<'a> Npy<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(b"\x93NUMPY\x01\x00").expect("NumPy 1.0");
        let [low, high, rest @ ..] = rest else {
            panic!("no length");
        };
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        let (header, data) = rest.split_at(length);
        assert_eq!((bytes.len() - data.len()) % 64, 0, "data must be aligned");
        let header = std::str::from_utf8(header).expect("ASCII");
        let after = |key: &str| {
            let (_, rest) = header.split_once(key).unwrap_or_else(|| panic!("no {key}"));
            rest.trim_start_matches([':', ' '])
        };
        let descr = after("'descr'").split('\'').nth(1).expect("a type");
        let shape = after("'shape'").trim_start_matches('(').split(')').next();
        let numbers = shape.expect("a shape").split(',').map(str::trim);
        let numbers = numbers.filter(|n| !n.is_empty());
        Self {
            descr: descr.to_owned(),
            is_fortran: after("'fortran_order'").starts_with("True"),
            shape: numbers.map(|n| n.parse().expect("a number")).collect(),
            data,
        }
    }

    /// The numbers, in the order of the file.
    pub fn numbers<T: Number>(&self) -> Vec<T> {
        assert_eq!(self.descr, T::DESCR);
        let size = size_of::<T>();
        let numbers: Vec<T> = self.data.chunks_exact(size).map(T::from_le).collect();
        assert_eq!(numbers.len(), self.shape.iter().product::<usize>());
        assert_eq!(self.data.len() % size, 0);
        numbers
    }
}

/// A number type of the output contract.
pub trait Number {
    const DESCR: &'static str;
    fn from_le(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($type:ty, $descr:literal) => {
        impl Number for $type {
            const DESCR: &'static str = $descr;
            fn from_le(bytes: &[u8]) -> Self {
                Self::from_le_bytes(bytes.try_into().expect("as many bytes as it has"))
            }
        }
    };
}
number!(f64, "<f8");
number!(i64, "<i8");
number!(u32, "<u4");
number!(u8, "|u1");

/// One array of an atlas, flat in C order.
pub fn array<T: Number>(atlas: &Path, name: &str) -> Vec<T> {
    let file = File::open(atlas.join("atlas.npz")).expect("atlas.npz");
    let mut archive = zip::ZipArchive::new(file).expect("a zip file");
    let mut bytes = Vec::new();
    let entry = archive.by_name(&format!("{name}.npy"));
    let mut entry = entry.unwrap_or_else(|e| panic!("{name}: {e}"));
    entry.read_to_end(&mut bytes).expect("readable");
    let array = Npy::new(&bytes);
    assert!(!array.is_fortran, "{name}");
    array.numbers()
}
