//! A depfile: which files the outputs were made from, as Make and Ninja read it.
//!
//! *Enters:* the file that stands for the outputs, and all files that were read. *Leaves:* one rule, and an empty one a file, so that Make
//! goes on where one of them was removed. Blanks, `#`, `$` and `:` are escaped as GCC and Clang do. A name with a line break has no spelling in this
//! format and is left out.

use std::collections::BTreeSet;
use std::path::Path;

/// The file's text.
#[must_use]
pub fn depfile<'p>(target: &Path, inputs: impl IntoIterator<Item = &'p Path>) -> String {
    let inputs: BTreeSet<String> = inputs.into_iter().filter_map(escaped).collect();
    let mut text = escaped(target).unwrap_or_default();
    text.push(':');
    for input in &inputs {
        text.push_str(" \\\n  ");
        text.push_str(input);
    }
    text.push('\n');
    for input in &inputs {
        text.push_str(&format!("{input}:\n"));
    }
    text
}

fn escaped(path: &Path) -> Option<String> {
    let name = path.to_str()?;
    if name.contains(['\n', '\r']) {
        return None;
    }
    let mut out = String::with_capacity(name.len());
    let mut backslashes = 0;
    for c in name.chars() {
        match c {
            // Backslashes count only in front of what they could escape.
            ' ' | '\t' | '#' => {
                out.extend(std::iter::repeat_n('\\', backslashes + 1));
                out.push(c);
            }
            ':' => out.push_str("\\:"),
            '$' => out.push_str("$$"),
            c => out.push(c),
        }
        backslashes = if c == '\\' { backslashes + 1 } else { 0 };
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped() {
        let inputs = ["a b.obj", "c#1$.bin", "a b.obj", "plain.ply"].map(Path::new);
        let text = depfile(Path::new("out/manifest.jsonl"), inputs);
        assert_eq!(
            text,
            "out/manifest.jsonl: \\\n  a\\ b.obj \\\n  c\\#1$$.bin \\\n  plain.ply\na\\ b.obj:\nc\\#1$$.bin:\nplain.ply:\n"
        );
        assert_eq!(depfile(Path::new("m"), [Path::new("a\nb")]), "m:\n");
    }
}
