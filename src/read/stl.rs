//! STL, text and binary: loose triangles.
//!
//! Every triangle brings three vertices of its own (repair welds them). A file is binary where its size is
//! 84 + 50 × the number in bytes 80 to 83, because many binary files begin with `solid` too. Facet normals
//! follow from the triangles and are not kept.

use super::build::SoupBuilder;
use super::error::{Place, ReadProblem, shorten};
use super::text::{Lines, number, words};
use crate::geometry::ids::NONE;

const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads an STL file.
pub(super) fn read_stl(bytes: &[u8], build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let declared = bytes
        .get(80..HEADER)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let needed = declared.map(|n| HEADER as u64 + RECORD as u64 * u64::from(n));
    let size = bytes.len() as u64;
    let is_text = bytes.trim_ascii_start().len() >= 5
        && bytes.trim_ascii_start()[..5].eq_ignore_ascii_case(b"solid")
        && !bytes.contains(&0);
    match needed {
        Some(needed) if needed == size || (needed < size && !is_text) => {
            if needed < size {
                build.note(format!(
                    "{} bytes after the last triangle are skipped",
                    size - needed
                ));
            }
            read_binary(&bytes[HEADER..needed as usize], build)
        }
        _ if is_text => read_text(bytes, build),
        needed => Err(ReadProblem::Truncated {
            what: "binary STL",
            unit: "bytes",
            needed: needed.unwrap_or(HEADER as u64),
            available: size,
        }),
    }
}

fn triangle(build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let next = build.soup.positions.len() as u32;
    build.face([next - 3, next - 2, next - 1], NONE)
}

fn read_binary(records: &[u8], build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let triangles = (records.len() / RECORD) as u64;
    build.expect_vertices(3 * triangles)?;
    build.expect_faces(triangles)?;
    build.part(String::new());
    for (i, record) in records.chunks_exact(RECORD).enumerate() {
        for k in 0..3 {
            let position = std::array::from_fn(|c| {
                let at = 12 * (k + 1) + 4 * c;
                let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
                f64::from(f32::from_le_bytes(bytes))
            });
            let place = Place::Byte(HEADER + RECORD * i + 12 * (k + 1));
            build.vertex(position, place)?;
        }
        triangle(build)?;
    }
    Ok(())
}

fn read_text(bytes: &[u8], build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let mut lines = Lines::new(bytes);
    // Vertices of the loop that is open.
    let mut corners: Option<usize> = None;
    let mut inside = false;
    while let Some(line) = lines.next() {
        let place = Place::Line(lines.number);
        let expected = |expected| ReadProblem::Expected {
            place,
            expected,
            found: shorten(line.trim_ascii()),
        };
        let mut words = words(line);
        let Some(keyword) = words.next() else {
            continue;
        };
        match (keyword.to_ascii_lowercase().as_slice(), corners) {
            (b"solid", None) => {
                inside = true;
                let name = line.trim_ascii()[keyword.len()..].trim_ascii();
                build.part(String::from_utf8_lossy(name).into_owned());
            }
            (b"endsolid", None) => inside = false,
            (b"facet" | b"endfacet", None) => {}
            (b"outer", None) => corners = Some(0),
            (b"vertex", Some(3)) => {
                return Err(expected(
                    "`endloop` after 3 vertices (STL holds triangles only)",
                ));
            }
            (b"vertex", Some(n)) => {
                let mut position = [0.0; 3];
                for x in &mut position {
                    let word = words.next().ok_or_else(|| expected("`vertex x y z`"))?;
                    *x = number(word, place)?;
                }
                build.vertex(position, place)?;
                corners = Some(n + 1);
            }
            (b"endloop", Some(3)) => {
                triangle(build)?;
                corners = None;
            }
            (b"endloop", Some(corners)) => {
                return Err(ReadProblem::ShortPolygon {
                    face: build.soup.faces.len(),
                    place,
                    corners,
                });
            }
            (_, Some(_)) => return Err(expected("`vertex` or `endloop`")),
            (_, None) => return Err(expected("`facet`, `outer loop` or `endsolid`")),
        }
    }
    if inside || corners.is_some() {
        return Err(ReadProblem::Expected {
            place: Place::Line(lines.number),
            expected: "`endsolid`",
            found: "end of file".into(),
        });
    }
    Ok(())
}
