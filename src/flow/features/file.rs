//! Edges that shall become lines, as other programs write them: a text of vertices in a row.
//!
//! *Enters:* a text whose lines hold the numbers of two vertices or more, each joined to the next by an edge, and the number that
//! the text gives the first vertex (0 or 1). *Leaves:* the rows in their order, or a [`ColumnError`] with the place.
//! Blank lines and what follows a `#` are skipped. *Not guaranteed:* that the mesh has such edges: that is checked where the
//! mesh is known.

use crate::flow::columns::{self, ColumnError};

/// Reads a text. `first_vertex` is the number that it gives the first vertex.
///
/// # Errors
/// The first line that holds a single word, no number, a vertex below `first_vertex` or one that is its own neighbour; and a text
/// without any edge.
pub fn parse(text: &str, first_vertex: u32) -> Result<Vec<Vec<u32>>, ColumnError> {
    let mut rows = Vec::new();
    for (_, words) in columns::lines(text) {
        if let [word] = &words[..] {
            return Err(ColumnError {
                span: word.clone(),
                reason: "a line of features.file must have 2 vertices or more, but this has 1"
                    .to_owned(),
            });
        }
        let mut row: Vec<u32> = Vec::with_capacity(words.len());
        for at in words {
            let vertex = columns::vertex(&text[at.clone()], first_vertex, "features.file");
            let vertex = vertex.map_err(|reason| {
                let span = at.clone();
                ColumnError { span, reason }
            })?;
            if row.last() == Some(&vertex) {
                return Err(ColumnError {
                    reason: format!(
                        "an edge joins two vertices, but {} follows itself",
                        &text[at.clone()]
                    ),
                    span: at,
                });
            }
            row.push(vertex);
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(ColumnError {
            span: 0..0,
            reason: "the file names no edge".to_owned(),
        });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_vertices_are_read_in_their_order() {
        let text = "\u{feff}# sharp\r\n1 2\r\n\r\n 7\t8 9 7 # closed\n#3 4\n2 1";
        let rows = parse(text, 1).expect("reads");
        assert_eq!(rows, [vec![0, 1], vec![6, 7, 8, 6], vec![1, 0]]);
    }

    #[test]
    fn refusals_name_what_is_wrong_and_where() {
        for (text, first, place, words) in [
            ("1 2\n3", 0, "3", "2 vertices or more, but this has 1"),
            ("1 edge", 0, "edge", "a whole number, but \"edge\" is none"),
            ("1 1.5", 0, "1.5", "\"1.5\" is none"),
            ("1 0", 1, "0", "count from 1, but it names vertex 0"),
            ("1 2\n5 5", 0, "5", "5 follows itself"),
            ("1 4294967295", 0, "4294967295", "more than any mesh has"),
            ("# none", 0, "", "names no edge"),
        ] {
            let error = parse(text, first).expect_err(text);
            assert_eq!(&text[error.span.clone()], place, "{text}");
            assert!(error.reason.contains(words), "{error}");
        }
    }
}
