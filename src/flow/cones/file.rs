//! Cones as other programs write them: a text of two columns.
//!
//! *Enters:* a text whose lines hold the number of a vertex and its curvature in radians, and the number that the text gives
//! the first vertex (0 as in CEPS, 1 as in MovingCones). *Leaves:* the cones in the order of their lines, every
//! curvature to the last bit, or a [`ColumnError`] with the place. Blank lines and what follows a `#` are skipped.
//!
//! *Guaranteed:* no vertex twice, all numbers finite; [`write()`] and [`parse`] are inverse to each other.
//! *Not guaranteed:* that the mesh has such vertices, nor Gauss–Bonnet: both are checked where the mesh is known.

use super::params::ConeSpec;
use crate::flow::columns::{self, ColumnError};
use crate::flow::pi_multiple::PiMultiple;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Reads a text; gives each cone with its line, counted from 1. `first_vertex` is the number that it gives the first vertex.
///
/// # Errors
/// The first line that holds no number, more or fewer than two columns, a vertex below `first_vertex` or one that an earlier
/// line has; and a text without any cone.
pub fn parse(text: &str, first_vertex: u32) -> Result<Vec<(u32, ConeSpec)>, ColumnError> {
    let mut cones = Vec::new();
    let mut lines_of = BTreeMap::new();
    for (number, words) in columns::lines(text) {
        let (vertex_at, curvature_at) = match &words[..] {
            [vertex, curvature] => (vertex.clone(), curvature.clone()),
            words => {
                let end = words.last().map_or(0, |last| last.end);
                return Err(ColumnError {
                    span: words.first().map_or(0, |first| first.start)..end,
                    reason: format!(
                        "a line of cones.file must have 2 columns, a vertex and a curvature in radians, but this has {}",
                        words.len()
                    ),
                });
            }
        };
        let vertex = columns::vertex(&text[vertex_at.clone()], first_vertex, "cones.file")
            .map_err(|reason| {
                let span = vertex_at.clone();
                ColumnError { span, reason }
            })?;
        let curvature = curvature(&text[curvature_at.clone()]).map_err(|reason| {
            let span = curvature_at;
            ColumnError { span, reason }
        })?;
        if let Some(earlier) = lines_of.insert(vertex, number) {
            return Err(ColumnError {
                reason: format!(
                    "vertex {} has a cone on line {earlier} already",
                    &text[vertex_at.clone()]
                ),
                span: vertex_at,
            });
        }
        cones.push((
            number,
            ConeSpec {
                vertex: Some(vertex),
                point: None,
                curvature,
            },
        ));
    }
    if cones.is_empty() {
        return Err(ColumnError {
            span: 0..0,
            reason: "the file names no cone".to_owned(),
        });
    }
    Ok(cones)
}

fn curvature(word: &str) -> Result<PiMultiple, String> {
    let curvature = word.parse().ok().and_then(PiMultiple::from_radians);
    curvature.ok_or_else(|| {
        format!(
            "a curvature is a finite number of radians, but {} is none",
            columns::shown(word)
        )
    })
}

/// The text of cones that are given by vertex (from 0) and curvature, radians; curvatures in 17 digits, from which every bit
/// can be read back. `heading` becomes comments.
pub fn write(heading: &[String], cones: &[(u32, f64)]) -> String {
    let mut text = String::new();
    for line in heading {
        let _ = writeln!(text, "# {line}");
    }
    for (vertex, curvature) in cones {
        let _ = writeln!(text, "{vertex} {curvature:.16e}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str, first: u32) -> (String, &str) {
        let error = parse(text, first).expect_err(text);
        (error.reason, &text[error.span])
    }

    #[test]
    fn what_is_written_is_read_back_to_the_last_bit() {
        let cones = [
            (7, 0.1 + 0.2),
            (0, -3.141592653589794),
            (u32::MAX - 1, 5e-324),
        ];
        let text = write(&["two lines".to_owned(), "of words".to_owned()], &cones);
        let read = parse(&text, 0).expect("reads");
        let again: Vec<(u32, f64)> = (read.iter())
            .map(|(_, cone)| (cone.vertex.expect("a vertex"), cone.curvature.radians()))
            .collect();
        assert_eq!(again, cones);
        assert_eq!(read.iter().map(|r| r.0).collect::<Vec<_>>(), [3, 4, 5]);
    }

    #[test]
    fn blank_lines_comments_tabs_and_line_ends_of_other_systems_are_understood() {
        let text = "\u{feff}# cones\r\n\r\n1\t1.57\r\n  37 -1.57e0 # an ear\n\n#3 1\n4 +2";
        let read = parse(text, 1).expect("reads");
        let cones: Vec<_> = (read.iter())
            .map(|(line, c)| (*line, c.vertex, c.curvature.radians()))
            .collect();
        assert_eq!(
            cones,
            [(3, Some(0), 1.57), (4, Some(36), -1.57), (7, Some(3), 2.0)]
        );
    }

    #[test]
    fn refusals_name_what_is_wrong_and_where() {
        let (reason, at) = refused("0 1\nnose 1.57\n", 0);
        assert_eq!(at, "nose");
        assert!(reason.contains("\"nose\" is none"), "{reason}");
        for (text, place, words) in [
            (
                "3 1.5 x",
                "3 1.5 x",
                "must have 2 columns, a vertex and a curvature in radians, but this has 3",
            ),
            ("0 1\n3", "3", "but this has 1"),
            (
                "0 one",
                "one",
                "a finite number of radians, but \"one\" is none",
            ),
            ("0 nan", "nan", "\"nan\" is none"),
            ("0 1e999", "1e999", "\"1e999\" is none"),
            ("-1 1", "-1", "\"-1\" is none"),
            ("1.5 1", "1.5", "\"1.5\" is none"),
            (
                "4294967295 1",
                "4294967295",
                "more than any mesh has (4294967294)",
            ),
            (
                "5 1\n6 1\n# again\n5 2",
                "5",
                "vertex 5 has a cone on line 1 already",
            ),
            ("# nothing\n\n", "", "names no cone"),
            ("", "", "names no cone"),
        ] {
            let (reason, at) = refused(text, 0);
            assert_eq!(at, place, "{text}");
            assert!(reason.contains(words), "{reason}");
        }
        let (reason, at) = refused("0 1", 1);
        assert_eq!(at, "0");
        assert!(
            reason.contains("count from 1, but it names vertex 0"),
            "{reason}"
        );
        // A long word is not repeated whole.
        let (reason, _) = refused(&format!("{} 1", "9x".repeat(1000)), 0);
        assert!(reason.len() < 200, "{reason}");
    }

    #[test]
    fn no_text_makes_it_panic() {
        let text = "# π cones\n12 1.57\r\n\t7 -3e0 # c\n";
        let places: Vec<usize> = (0..=text.len())
            .filter(|&i| text.is_char_boundary(i))
            .collect();
        for (n, &i) in places.iter().enumerate() {
            let stray = ['#', '\0', 'π', '\n', '\u{feff}', '-'][n % 6];
            for damaged in [
                text[..i].to_owned(),
                format!("{}{stray}{}", &text[..i], &text[i..]),
            ] {
                if let Err(error) = parse(&damaged, (n % 2) as u32) {
                    assert!(damaged.get(error.span.clone()).is_some(), "{error:?}");
                }
            }
        }
    }
}
