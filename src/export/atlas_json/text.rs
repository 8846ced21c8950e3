//! The document as text.

use super::Document;
use crate::export::ExportError;

/// Keys whose value may be null; any other null is a number that JSON cannot hold.
const MAY_BE_NULL: [&str; 5] = [
    "source_vertex",
    "patch_to_chart",
    "patch",
    "side",
    "other_start",
];

impl Document {
    /// The text of the file: indented, keys in the order of the fields, arrays of numbers on one line,
    /// with a line end.
    pub fn to_text(&self) -> String {
        let mut text = join_plain_arrays(&self.to_lines());
        text.push('\n');
        text
    }

    /// Indented, every number on a line of its own.
    fn to_lines(&self) -> String {
        serde_json::to_string_pretty(self)
            .expect("string keys and no custom serialiser, so that serialisation cannot fail")
    }

    /// The members of the file. Through its text: a second writer of all types would cost as much to compile.
    pub(in crate::export) fn to_value(&self) -> serde_json::Value {
        serde_json::from_str(&self.to_text()).expect("what was written as JSON")
    }

    /// An error that names the first number which JSON cannot hold.
    pub(super) fn check_finite(&self) -> Result<(), ExportError> {
        // The tree of values is as large as the atlas where there are very many patches.
        if !self.to_lines().lines().any(is_lost_number) {
            return Ok(());
        }
        match first_null(&self.to_value(), "atlas.json") {
            Some(place) => Err(ExportError::NotFinite { place }),
            None => Ok(()),
        }
    }
}

/// Puts every array without objects on one line: a long segment is one line, not one line a vertex.
fn join_plain_arrays(pretty: &str) -> String {
    let mut text = String::with_capacity(pretty.len());
    // Where open arrays without an object so far begin in `text`; an object makes the list empty.
    let mut open: Vec<usize> = Vec::new();
    let (mut in_string, mut escaped) = (false, false);
    for c in pretty.chars() {
        text.push(c);
        if in_string {
            in_string = escaped || c != '"';
            escaped = !escaped && c == '\\';
            continue;
        }
        match c {
            '"' => in_string = true,
            '{' | '}' => open.clear(),
            '[' => open.push(text.len() - 1),
            ']' => {
                if let Some(start) = open.pop() {
                    let joined = join(&text[start..]);
                    text.truncate(start);
                    text.push_str(&joined);
                }
            }
            _ => {}
        }
    }
    text
}

/// An indented array of numbers and strings, on one line. Strings hold no raw line ends in JSON.
fn join(array: &str) -> String {
    let mut lines = array.lines().map(str::trim_start);
    let mut joined = lines.next().unwrap_or_default().to_owned();
    for line in lines {
        if joined.ends_with(',') {
            joined.push(' ');
        }
        joined.push_str(line);
    }
    joined
}

/// Whether a line holds a null that stands for a number.
fn is_lost_number(line: &str) -> bool {
    let line = line.trim_start().trim_end_matches(',');
    match line.strip_suffix("null") {
        Some("") => true,
        Some(before) => before.strip_suffix("\": ").is_some_and(|key| {
            let key = key.trim_start_matches('"');
            !MAY_BE_NULL.contains(&key)
        }),
        None => false,
    }
}

/// The place of the first null that stands for a number.
fn first_null(value: &serde_json::Value, place: &str) -> Option<String> {
    use serde_json::Value;
    match value {
        Value::Null => Some(place.to_owned()),
        Value::Array(items) => items
            .iter()
            .enumerate()
            .find_map(|(i, item)| first_null(item, &format!("{place}[{i}]"))),
        Value::Object(entries) => entries
            .iter()
            .filter(|(key, item)| !(item.is_null() && MAY_BE_NULL.contains(&key.as_str())))
            .find_map(|(key, item)| first_null(item, &format!("{place}.{key}"))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_numbers_are_on_one_line() {
        let value =
            serde_json::json!({"a": [1, [2, 3], "x, [ \" ]", []], "b": [{"c": [4, 5]}], "d": []});
        let text = join_plain_arrays(&serde_json::to_string_pretty(&value).unwrap());
        let expected = "{\n  \"a\": [1, [2, 3], \"x, [ \\\" ]\", []],\n  \"b\": [\n    {\n      \"c\": [4, 5]\n    }\n  ],\n  \"d\": []\n}";
        assert_eq!(text, expected);
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&text).unwrap(),
            value
        );
    }
}
