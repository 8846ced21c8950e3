//! Wavefront OBJ: polygons with shared positions, texture coordinates and normals.
//!
//! Every `v` is a vertex, in file order and also where no face uses it. Materials get their colours and
//! textures from the libraries ([`mtl`](super::mtl)); of `v` weights nothing is kept (they concern curves).
//! Colours written after positions, as many programs do, are kept as they are where every vertex has one.

use super::build::SoupBuilder;
use super::error::{Place, ReadProblem, shorten};
use super::folder::Folder;
use super::mtl;
use super::polygon::triangulate;
use super::text::{Lines, after_keyword, integer, number, words};
use crate::geometry::ids::NONE;
use crate::geometry::mesh::{AttributeKind, Material};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// What `f` indexes, in the order of its slashes.
const LISTS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The greatest index that pointed beyond the end of its list when it was read.
#[derive(Clone, Copy, Default)]
struct Ahead {
    index: usize,
    face: usize,
    line: usize,
}

#[derive(Default)]
struct Obj {
    texture: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<[f32; 4]>,
    materials: BTreeMap<Vec<u8>, u32>,
    material: Option<u32>,
    ahead: [Ahead; 3],
    /// Texture coordinate and normal of every corner of every triangle, as indices; empty until a face has one.
    corners: [Vec<u32>; 2],
    polygon: Vec<[u32; 3]>,
}

/// Reads an OBJ file and its material libraries.
pub(super) fn read_obj(
    bytes: &[u8],
    folder: &mut Folder,
    build: &mut SoupBuilder,
) -> Result<(), ReadProblem> {
    let mut obj = Obj::default();
    let mut lines = Lines::new(bytes);
    build.part(String::new());
    while let Some(first) = lines.next() {
        let place = Place::Line(lines.number);
        let mut line = Cow::Borrowed(first);
        while line.last() == Some(&b'\\') {
            let joined = line.to_mut();
            joined.pop();
            joined.push(b' ');
            match lines.next() {
                Some(next) => joined.extend_from_slice(next),
                None => break,
            }
        }
        obj.line(&line, place, build)?;
    }
    obj.finish(build)?;
    mtl::describe(bytes, folder, build)
}

impl Obj {
    fn line(
        &mut self,
        line: &[u8],
        place: Place,
        build: &mut SoupBuilder,
    ) -> Result<(), ReadProblem> {
        let mut words = words(line);
        match words.next() {
            Some(b"v") => self.vertex(line, words, place, build),
            Some(b"vt") => {
                let u = number(words.next().unwrap_or_default(), place)? as f32;
                // A one-dimensional texture has no v.
                let v = number(words.next().unwrap_or(b"0"), place)? as f32;
                // glTF counts v downwards.
                self.texture.push([u, 1.0 - v]);
                Ok(())
            }
            Some(b"vn") => {
                self.normals.push(normal(line, words, place)?);
                Ok(())
            }
            Some(b"f") => self.face(words, place, build),
            Some(b"o" | b"g") => {
                build.part(after_keyword(line));
                Ok(())
            }
            Some(word) if word.eq_ignore_ascii_case(b"usemtl") => {
                let next = self.materials.len() as u32;
                let name = after_keyword(line);
                let id = *self
                    .materials
                    .entry(name.clone().into_bytes())
                    .or_insert(next);
                if id == next {
                    build.soup.appearance.materials.push(Material {
                        name: Some(name),
                        ..Material::default()
                    });
                }
                self.material = Some(id);
                Ok(())
            }
            Some(b"p" | b"l") => {
                build.note("points and lines (`p`, `l`) are skipped");
                Ok(())
            }
            None | Some(b"s") => Ok(()),
            Some(word) if word.eq_ignore_ascii_case(b"mtllib") => Ok(()),
            Some(other) => {
                build.note(format!(
                    "lines that begin with `{}` are skipped",
                    shorten(other)
                ));
                Ok(())
            }
        }
    }

    fn vertex<'a>(
        &mut self,
        line: &[u8],
        mut words: impl Iterator<Item = &'a [u8]>,
        place: Place,
        build: &mut SoupBuilder,
    ) -> Result<(), ReadProblem> {
        let mut values = [0.0; 7];
        let mut count = 0;
        for word in words.by_ref().take(7) {
            values[count] = number(word, place)?;
            count += 1;
        }
        if !matches!(count, 3 | 4 | 6 | 7) || words.next().is_some() {
            return Err(ReadProblem::Expected {
                place,
                expected: "`v x y z`, `v x y z w` or `v x y z r g b`",
                found: shorten(line),
            });
        }
        if count >= 6 && self.colors.len() == build.soup.positions.len() {
            let alpha = if count == 7 { values[6] } else { 1.0 };
            let color = [values[3], values[4], values[5], alpha];
            self.colors.push(color.map(|x| x as f32));
        }
        build.vertex([values[0], values[1], values[2]], place)
    }

    fn face<'a>(
        &mut self,
        words: impl Iterator<Item = &'a [u8]>,
        place: Place,
        build: &mut SoupBuilder,
    ) -> Result<(), ReadProblem> {
        let face = build.soup.faces.len();
        let counts = [
            build.soup.positions.len(),
            self.texture.len(),
            self.normals.len(),
        ];
        let mut polygon = std::mem::take(&mut self.polygon);
        polygon.clear();
        for word in words {
            let mut corner = [NONE; 3];
            let mut parts = word.split(|&b| b == b'/');
            for (list, index) in corner.iter_mut().enumerate() {
                let Some(part) = parts.next() else { break };
                if part.is_empty() && list > 0 {
                    continue;
                }
                *index = self.resolve(part, list, counts[list], face, place)?;
            }
            if parts.next().is_some() {
                return Err(ReadProblem::Expected {
                    place,
                    expected: "a corner like 1, 1/2, 1//3 or 1/2/3",
                    found: shorten(word),
                });
            }
            polygon.push(corner);
        }
        if polygon.len() < 3 {
            build.short_polygon(place);
            self.polygon = polygon;
            return Ok(());
        }
        let positions = &build.soup.positions;
        let triangles = triangulate(polygon.len(), |k| {
            positions.get(polygon[k][0] as usize).copied()
        });
        for triangle in triangles {
            let triangle = triangle.map(|k| polygon[k]);
            build.face(triangle.map(|c| c[0]), self.material.unwrap_or(NONE))?;
            for (list, indices) in self.corners.iter_mut().enumerate() {
                let values = triangle.map(|c| c[list + 1]);
                if !indices.is_empty() || values.iter().any(|&i| i != NONE) {
                    indices.resize(3 * (build.soup.faces.len() - 1), NONE);
                    indices.extend(values);
                }
            }
        }
        self.polygon = polygon;
        Ok(())
    }

    /// An index from 0. Those that count from the end are checked now, the others when all is read.
    fn resolve(
        &mut self,
        word: &[u8],
        list: usize,
        count: usize,
        face: usize,
        place: Place,
    ) -> Result<u32, ReadProblem> {
        let index = integer(word, place, "a whole number as index of a face corner")?;
        let bad = || ReadProblem::IndexOutOfRange {
            face,
            place,
            what: LISTS[list],
            index,
            count,
            first: 1,
        };
        let resolved = if index > 0 {
            index - 1
        } else if index < 0 {
            count as i64 + index
        } else {
            return Err(bad());
        };
        let resolved = u32::try_from(resolved).ok().filter(|&i| i != NONE);
        let resolved = resolved.ok_or_else(bad)?;
        let ahead = &mut self.ahead[list];
        if resolved as usize >= count && resolved as usize >= ahead.index {
            let Place::Line(line) = place else {
                return Err(bad());
            };
            *ahead = Ahead {
                index: resolved as usize,
                face,
                line,
            };
        }
        Ok(resolved)
    }

    fn finish(self, build: &mut SoupBuilder) -> Result<(), ReadProblem> {
        let counts = [
            build.soup.positions.len(),
            self.texture.len(),
            self.normals.len(),
        ];
        for ((ahead, count), what) in self.ahead.into_iter().zip(counts).zip(LISTS) {
            if ahead.line > 0 && ahead.index >= count {
                return Err(ReadProblem::IndexOutOfRange {
                    face: ahead.face,
                    place: Place::Line(ahead.line),
                    what,
                    index: ahead.index as i64 + 1,
                    count,
                    first: 1,
                });
            }
        }
        let [texture, normals] = &self.corners;
        gather(build, AttributeKind::TexCoord(0), texture, &self.texture);
        gather(build, AttributeKind::Normal, normals, &self.normals);
        if !self.colors.is_empty() {
            if self.colors.len() == build.soup.positions.len() {
                let colors = self.colors.as_flattened();
                build.vertex_attribute(AttributeKind::Color(0), 4, colors)?;
            } else {
                build.note("vertex colours are skipped because not every vertex has one");
            }
        }
        Ok(())
    }
}

/// The values of all corners that have one.
fn gather<const N: usize>(
    build: &mut SoupBuilder,
    kind: AttributeKind,
    indices: &[u32],
    values: &[[f32; N]],
) {
    if indices.is_empty() {
        return;
    }
    let value = |&i: &u32| values.get(i as usize).copied().unwrap_or([f32::NAN; N]);
    let values = indices.iter().flat_map(value).collect();
    build.attribute_values(kind, N, values);
}

/// The three numbers after `vn`.
fn normal<'a>(
    line: &[u8],
    mut words: impl Iterator<Item = &'a [u8]>,
    place: Place,
) -> Result<[f32; 3], ReadProblem> {
    let mut values = [0.0; 3];
    for value in &mut values {
        let word = words.next().ok_or_else(|| ReadProblem::Expected {
            place,
            expected: "`vn x y z`",
            found: shorten(line),
        })?;
        *value = number(word, place)? as f32;
    }
    Ok(values)
}
