//! Arrays of numbers as text in a page.
//!
//! *Enters:* arrays by name. *Leaves:* one text, and for each array where it begins and how its numbers are stored: as
//! differences or plain, the lowest bytes of all numbers first, then the next, which packs well; all of it deflated, in base64.
//! `surface.js` reads it.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Map, Value, json};
use std::io::{self, Write};

/// How hard the arrays are deflated: the default, 6, takes several times as long for a few per cent of the size.
const LEVEL: u32 = 3;

/// Arrays, one after the other.
#[derive(Default)]
pub(super) struct Archive {
    bytes: Vec<u8>,
    sections: Map<String, Value>,
}

impl Archive {
    /// Adds integers, `N` a row.
    pub fn integers<const N: usize>(&mut self, name: &str, rows: &[[u32; N]]) {
        let mut runs: Vec<Vec<u32>> = Vec::with_capacity(N);
        for c in 0..N {
            let mut last = 0u32;
            let differences = rows.iter().map(|row| {
                let step = row[c].wrapping_sub(last) as i32;
                last = row[c];
                // Zigzag: small differences of both signs are small numbers.
                ((step << 1) ^ (step >> 31)) as u32
            });
            runs.push(differences.collect());
        }
        let largest = runs.iter().flatten().copied().max().unwrap_or(0);
        let bytes = (32 - largest.leading_zeros()).div_ceil(8).max(1) as usize;
        self.add(name, &runs, bytes, false);
    }

    /// Adds single-precision numbers, `N` a row.
    pub fn floats<const N: usize>(&mut self, name: &str, rows: &[[f32; N]]) {
        let runs: Vec<Vec<u32>> = (0..N)
            .map(|c| rows.iter().map(|row| row[c].to_bits()).collect())
            .collect();
        self.add(name, &runs, 4, true);
    }

    fn add(&mut self, name: &str, runs: &[Vec<u32>], bytes: usize, float: bool) {
        let entry = json!({
            "components": runs.len(),
            "count": runs.first().map_or(0, Vec::len),
            "bytes": bytes,
            "at": self.bytes.len(),
            "float": float,
        });
        self.sections.insert(name.to_owned(), entry);
        for run in runs {
            for byte in 0..bytes {
                self.bytes
                    .extend(run.iter().map(|x| (x >> (8 * byte)) as u8));
            }
        }
    }

    /// Where each array is, and the text.
    pub fn finish(self) -> io::Result<(Value, String)> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
        encoder.write_all(&self.bytes)?;
        Ok((Value::Object(self.sections), base64(&encoder.finish()?)))
    }
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, i| {
            word << 8 | u32::from(group.get(i).copied().unwrap_or(0))
        });
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= group.len() {
                char::from(letter)
            } else {
                '='
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn base64_of_the_standard() {
        for (text, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xff, 0xef, 0xbe]), "/+++");
    }

    /// Reads the planes as `surface.js` does.
    #[test]
    fn arrays_come_back() {
        let rows = [[3, u32::MAX], [0, 0], [70_000, 5], [69_999, 1 << 31]];
        let reals = [[0.5f32], [-1e30], [f32::MIN_POSITIVE], [7.0]];
        let mut archive = Archive::default();
        archive.integers("rows", &rows);
        archive.floats("reals", &reals);
        let bytes = archive.bytes.clone();
        let (sections, _) = archive.finish().unwrap();
        let read = |name: &str, c: usize, i: usize| {
            let number = |key: &str| sections[name][key].as_u64().unwrap() as usize;
            let (count, width) = (number("count"), number("bytes"));
            let start = number("at") + c * width * count;
            (0..width).fold(0u32, |x, b| {
                x | u32::from(bytes[start + b * count + i]) << (8 * b)
            })
        };
        for c in 0..2 {
            let mut last = 0u32;
            for (i, row) in rows.iter().enumerate() {
                let step = read("rows", c, i);
                last = last.wrapping_add((step >> 1) ^ (step & 1).wrapping_neg());
                assert_eq!(last, row[c]);
            }
        }
        for (i, row) in reals.iter().enumerate() {
            assert_eq!(read("reals", 0, i), row[0].to_bits());
        }
    }

    #[test]
    fn the_text_unpacks() {
        let mut archive = Archive::default();
        archive.integers("a", &[[7u32], [7], [7]]);
        let raw = archive.bytes.clone();
        let (_, text) = archive.finish().unwrap();
        let mut packed = Vec::new();
        for group in text.as_bytes().chunks(4) {
            let value = |c: u8| match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => 0,
            };
            let word = group
                .iter()
                .fold(0u32, |w, &c| w << 6 | u32::from(value(c)));
            let used = 3 - group.iter().filter(|&&c| c == b'=').count();
            packed.extend(&word.to_be_bytes()[1..1 + used]);
        }
        let mut back = Vec::new();
        flate2::read::ZlibDecoder::new(&packed[..])
            .read_to_end(&mut back)
            .unwrap();
        assert_eq!(back, raw);
    }
}
