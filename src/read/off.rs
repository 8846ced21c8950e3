//! Object File Format, the text variants `[ST][C][N]OFF`.
//!
//! One vertex and one face a line, as every program writes them; `#` begins a comment. The counts may
//! stand on the line of the keyword, and the keyword may be missing. What follows a face's indices is its
//! colour and is skipped. Colours of whole numbers count to 255, others to 1.

use super::build::SoupBuilder;
use super::error::{Place, ReadProblem, shorten};
use super::polygon::triangulate;
use super::text::{Lines, integer, number, words};
use crate::geometry::ids::NONE;
use crate::geometry::mesh::AttributeKind;

/// Which attributes follow a vertex's position, in this order.
#[derive(Clone, Copy, Default)]
struct Layout {
    normal: bool,
    color: bool,
    texture: bool,
}

fn layout(keyword: &[u8]) -> Result<Option<Layout>, ReadProblem> {
    let Some(mut prefix) = keyword.strip_suffix(b"OFF") else {
        return Ok(None);
    };
    let mut take = |letters: &[u8]| {
        let rest = prefix.strip_prefix(letters);
        prefix = rest.unwrap_or(prefix);
        rest.is_some()
    };
    let layout = Layout {
        texture: take(b"ST"),
        color: take(b"C"),
        normal: take(b"N"),
    };
    match prefix {
        b"" => Ok(Some(layout)),
        b"4" | b"n" | b"4n" => Err(ReadProblem::Unsupported {
            variant: "an OFF file of a space that has not 3 dimensions (4OFF, nOFF)",
            remedy: "project the mesh to 3 dimensions and write plain OFF",
        }),
        _ => Ok(None),
    }
}

/// Lines that hold a word, with their words' place.
struct Content<'a>(Lines<'a>);

impl<'a> Content<'a> {
    fn next(&mut self) -> Option<(Vec<&'a [u8]>, Place)> {
        loop {
            let line = self.0.next()?;
            // There are no names that it could be part of.
            let end = line.iter().position(|&b| b == b'#');
            let words: Vec<_> = words(&line[..end.unwrap_or(line.len())]).collect();
            if !words.is_empty() {
                return Some((words, Place::Line(self.0.number)));
            }
        }
    }
}

/// Reads an OFF file.
pub(super) fn read_off(bytes: &[u8], build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let mut content = Content(Lines::new(bytes));
    let truncated = |what, needed, available| ReadProblem::Truncated {
        what,
        unit: "lines",
        needed,
        available,
    };
    let (mut header, mut place) = content.next().ok_or(truncated("the header", 1, 0))?;
    let mut layout_found = Layout::default();
    if let Some(found) = layout(header[0])? {
        layout_found = found;
        header.remove(0);
        if header.first() == Some(&b"BINARY".as_slice()) {
            return Err(ReadProblem::Unsupported {
                variant: "a binary OFF file",
                remedy: "write it as text, or as binary PLY",
            });
        }
        if header.is_empty() {
            (header, place) = content.next().ok_or(truncated("the header", 2, 1))?;
        }
    }
    let mut counts = [0; 2];
    for (k, count) in counts.iter_mut().enumerate() {
        let expected = "the keyword OFF, then the numbers of vertices and faces";
        let word = header.get(k).copied().unwrap_or_default();
        let value = integer(word, place, expected)?;
        *count = u64::try_from(value).map_err(|_| ReadProblem::Expected {
            place,
            expected,
            found: shorten(word),
        })?;
    }
    let [vertices, faces] = counts;
    build.expect_vertices(vertices)?;
    build.expect_faces(faces)?;
    build.part(String::new());
    let mut attributes = Attributes::default();
    for done in 0..vertices {
        let (words, place) =
            content
                .next()
                .ok_or(truncated("the list of vertices", vertices, done))?;
        read_vertex(&words, place, layout_found, &mut attributes, build)?;
    }
    for done in 0..faces {
        let (words, place) = content
            .next()
            .ok_or(truncated("the list of faces", faces, done))?;
        read_face(&words, place, build)?;
    }
    if content.next().is_some() {
        build.note("lines after the last face are skipped");
    }
    let Attributes {
        normals,
        colors,
        texture,
    } = attributes;
    if layout_found.normal {
        build.vertex_attribute(AttributeKind::Normal, 3, normals.as_flattened())?;
    }
    if layout_found.color {
        build.vertex_attribute(AttributeKind::Color(0), 4, colors.as_flattened())?;
    }
    if layout_found.texture {
        build.vertex_attribute(AttributeKind::TexCoord(0), 2, texture.as_flattened())?;
    }
    Ok(())
}

#[derive(Default)]
struct Attributes {
    normals: Vec<[f32; 3]>,
    colors: Vec<[f32; 4]>,
    texture: Vec<[f32; 2]>,
}

fn read_vertex(
    words: &[&[u8]],
    place: Place,
    layout: Layout,
    attributes: &mut Attributes,
    build: &mut SoupBuilder,
) -> Result<(), ReadProblem> {
    let before = if layout.normal { 6 } else { 3 };
    let after = if layout.texture { 2 } else { 0 };
    let needed = before + after + if layout.color { 3 } else { 0 };
    if words.len() < needed {
        return Err(ReadProblem::Expected {
            place,
            expected: "the coordinates of a vertex and what the keyword announces",
            found: shorten(&words.join(&b' ')),
        });
    }
    let mut values = [0.0; 6];
    for (value, word) in values.iter_mut().zip(&words[..before]) {
        *value = number(word, place)?;
    }
    let [x, y, z, a, b, c] = values;
    build.vertex([x, y, z], place)?;
    if layout.normal {
        attributes.normals.push([a as f32, b as f32, c as f32]);
    }
    let texture = words.len() - after;
    if layout.color {
        attributes
            .colors
            .push(color(&words[before..texture], place)?);
    } else if texture > before {
        build.note("numbers after the coordinates of vertices are skipped");
    }
    if layout.texture {
        let u = number(words[texture], place)?;
        let v = number(words[texture + 1], place)?;
        // glTF counts v downwards.
        attributes.texture.push([u as f32, (1.0 - v) as f32]);
    }
    Ok(())
}

fn color(words: &[&[u8]], place: Place) -> Result<[f32; 4], ReadProblem> {
    let mut color = [1.0; 4];
    for (channel, word) in color.iter_mut().zip(words) {
        let whole = word.iter().all(u8::is_ascii_digit);
        *channel = (number(word, place)? / if whole { 255.0 } else { 1.0 }) as f32;
    }
    Ok(color)
}

fn read_face(words: &[&[u8]], place: Place, build: &mut SoupBuilder) -> Result<(), ReadProblem> {
    let face = build.soup.faces.len();
    let corners = integer(words[0], place, "the number of corners of a face")?;
    let corners = usize::try_from(corners).map_err(|_| ReadProblem::Expected {
        place,
        expected: "the number of corners of a face",
        found: shorten(words[0]),
    })?;
    let indices = words.get(1..).unwrap_or_default();
    if indices.len() < corners {
        return Err(ReadProblem::Expected {
            place,
            expected: "as many vertex indices as the face has corners",
            found: shorten(&words.join(&b' ')),
        });
    }
    if corners < 3 {
        build.short_polygon(place);
        return Ok(());
    }
    let count = build.soup.positions.len();
    let index = |word: &[u8]| {
        let index = integer(word, place, "a whole number as index of a face corner")?;
        let found = usize::try_from(index).ok().filter(|&i| i < count);
        found.map(|i| i as u32).ok_or(ReadProblem::IndexOutOfRange {
            face,
            place,
            what: "vertex",
            index,
            count,
            first: 0,
        })
    };
    let polygon = indices[..corners].iter().map(|word| index(word));
    let polygon = polygon.collect::<Result<Vec<u32>, _>>()?;
    let positions = &build.soup.positions;
    let triangles = triangulate(corners, |k| positions.get(polygon[k] as usize).copied());
    for triangle in triangles {
        build.face(triangle.map(|k| polygon[k]), NONE)?;
    }
    Ok(())
}
