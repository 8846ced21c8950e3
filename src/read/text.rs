//! Lines, tokens and numbers of text formats, on bytes: comments may be in any encoding.

use super::error::{Place, ReadProblem, shorten};

/// Lines that end in `\n`, `\r\n` or `\r`, with their number from 1.
pub(super) struct Lines<'a> {
    rest: Option<&'a [u8]>,
    /// Number of the line returned last.
    pub number: usize,
}

impl<'a> Lines<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        // A byte-order mark is not part of the first word.
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self {
            rest: Some(bytes),
            number: 0,
        }
    }

    /// What follows the line returned last.
    pub fn rest(&self) -> &'a [u8] {
        self.rest.unwrap_or_default()
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest.filter(|rest| !rest.is_empty())?;
        self.number += 1;
        let Some(end) = rest.iter().position(|&b| b == b'\n' || b == b'\r') else {
            self.rest = None;
            return Some(rest);
        };
        let newline = 1 + usize::from(rest[end..].starts_with(b"\r\n"));
        self.rest = Some(&rest[end + newline..]);
        Some(&rest[..end])
    }
}

/// The words of a line up to a word that begins with `#`.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|b| b.is_ascii_whitespace())
        .filter(|word| !word.is_empty())
        .take_while(|word| word[0] != b'#')
}

/// What follows the keyword, blanks included.
pub(super) fn after_keyword(line: &[u8]) -> String {
    let line = line.trim_ascii();
    let start = line.iter().position(|b| b.is_ascii_whitespace());
    let name = start.map_or(&[][..], |start| line[start..].trim_ascii());
    String::from_utf8_lossy(name).into_owned()
}

/// A number in full precision. `nan` and `inf` are numbers here; who needs finite ones says so.
pub(super) fn number(word: &[u8], place: Place) -> Result<f64, ReadProblem> {
    let parsed = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    parsed.ok_or_else(|| ReadProblem::BadNumber {
        place,
        found: shorten(word),
    })
}

/// A whole number.
pub(super) fn integer(
    word: &[u8],
    place: Place,
    expected: &'static str,
) -> Result<i64, ReadProblem> {
    let parsed = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    parsed.ok_or_else(|| ReadProblem::Expected {
        place,
        expected,
        found: shorten(word),
    })
}
