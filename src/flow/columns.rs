//! Texts of columns, as other programs write them: words between blanks, line by line.
//!
//! *Enters:* a text. *Leaves:* the words of each line with their places in the text, for messages. Blank lines and what
//! follows a `#` are skipped; a byte-order mark and line ends of other systems are understood.

use std::ops::Range;

/// What is wrong with a text, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct ColumnError {
    /// The offending bytes.
    pub span: Range<usize>,
    /// One sentence without the place.
    pub reason: String,
}

/// Every line that has words, by its number from 1, with the places of its words.
pub fn lines(text: &str) -> impl Iterator<Item = (u32, Vec<Range<usize>>)> + '_ {
    // Lines and words are parts of the text, so that their distance from its start is their place.
    let place = |part: &str| part.as_ptr() as usize - text.as_ptr() as usize;
    let words = move |line: &str| {
        let content = line.split('#').next().unwrap_or("");
        let words = content.trim_start_matches('\u{feff}').split_whitespace();
        words
            .map(|word| place(word)..place(word) + word.len())
            .collect()
    };
    let numbered = (1_u32..).zip(text.split('\n'));
    numbered
        .flat_map(|(number, line)| line.split('\r').map(move |part| (number, part)))
        .map(move |(number, line)| (number, words(line)))
        .filter(|(_, words): &(u32, Vec<_>)| !words.is_empty())
}

/// A vertex, counted from 0, of a word that counts from `first_vertex`; `key` is the configuration key that named the file.
///
/// # Errors
/// A reason where the word is no such number.
pub fn vertex(word: &str, first_vertex: u32, key: &str) -> Result<u32, String> {
    let number: u64 = word.parse().map_err(|_| {
        format!(
            "in {key} a vertex is a whole number, but {} is none",
            shown(word)
        )
    })?;
    let Some(vertex) = number.checked_sub(u64::from(first_vertex)) else {
        return Err(format!(
            "the vertices of this file count from {first_vertex}, but it names vertex {number}: set {key}_first_vertex = 0 if they count from 0"
        ));
    };
    match u32::try_from(vertex) {
        Ok(vertex) if vertex < u32::MAX => Ok(vertex),
        _ => Err(format!(
            "vertex {number} is more than any mesh has ({})",
            u32::MAX - 1
        )),
    }
}

/// A word of the text in quotes, shortened where it is long.
pub fn shown(word: &str) -> String {
    let mut start: String = word.chars().take(40).collect();
    if start.len() < word.len() {
        start.push('…');
    }
    format!("{start:?}")
}
