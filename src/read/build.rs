//! The soup under construction: limits, finite positions, corner attributes that not every face has.

use super::ReadParams;
use super::budget::Budget;
use super::error::{Place, ReadProblem, shorten};
use crate::geometry::ids::NONE;
use crate::geometry::mesh::{AttributeKind, CornerAttribute, EmbeddedImage, Part, Soup};

/// Notes beyond this number say nothing new.
const MAX_NOTES: usize = 64;

/// What kind of image it is that glTF does not know.
fn kind_of(bytes: &[u8]) -> String {
    let kind = match bytes {
        [b'B', b'M', ..] => "BMP",
        [b'G', b'I', b'F', b'8', ..] => "GIF",
        [b'R', b'I', b'F', b'F', ..] => "WebP",
        [b'I', b'I', b'*', 0, ..] | [b'M', b'M', 0, b'*', ..] => "TIFF",
        [b'D', b'D', b'S', b' ', ..] => "DDS",
        [b'v', b'/', b'1', 1, ..] => "OpenEXR",
        _ => return "neither PNG nor JPEG: convert it to PNG".into(),
    };
    format!("{kind}, not PNG or JPEG: convert it to PNG")
}

/// Collects vertices, triangles and attributes; refuses what exceeds the limits.
pub(super) struct SoupBuilder {
    pub soup: Soup,
    pub budget: Budget,
    notes: Vec<String>,
    /// Polygons that are no faces: how many, and where the first is.
    short: Option<(usize, Place)>,
    max_vertices: u64,
    max_faces: u64,
}

impl SoupBuilder {
    pub fn new(params: &ReadParams) -> Self {
        // 2³² − 1 means "none" in every array of ids.
        let ids = u64::from(NONE) - 1;
        Self {
            soup: Soup::default(),
            budget: Budget::new(params.max_file_bytes),
            notes: Vec::new(),
            short: None,
            max_vertices: params.max_vertices.min(ids),
            max_faces: params.max_faces.min(ids),
        }
    }

    /// Refuses a number of further vertices before anything is set aside for them.
    pub fn expect_vertices(&self, more: u64) -> Result<(), ReadProblem> {
        let count = (self.soup.positions.len() as u64).saturating_add(more);
        let limit = self.max_vertices;
        match count > limit {
            true => Err(ReadProblem::TooManyVertices { count, limit }),
            false => Ok(()),
        }
    }

    /// Refuses a number of further triangles before anything is set aside for them.
    pub fn expect_faces(&self, more: u64) -> Result<(), ReadProblem> {
        let count = (self.soup.faces.len() as u64).saturating_add(more);
        let limit = self.max_faces;
        match count > limit {
            true => Err(ReadProblem::TooManyFaces { count, limit }),
            false => Ok(()),
        }
    }

    /// How many vertices and triangles may still come.
    pub fn room(&self) -> (u64, u64) {
        let (vertices, faces) = (self.soup.positions.len(), self.soup.faces.len());
        let vertices = self.max_vertices.saturating_sub(vertices as u64);
        (vertices, self.max_faces.saturating_sub(faces as u64))
    }

    /// Appends a vertex.
    pub fn vertex(&mut self, position: [f64; 3], place: Place) -> Result<(), ReadProblem> {
        self.expect_vertices(1)?;
        if let Some(k) = position.iter().position(|x| !x.is_finite()) {
            return Err(ReadProblem::NotFinite {
                vertex: self.soup.positions.len(),
                place,
                axis: ['x', 'y', 'z'][k],
                value: position[k],
            });
        }
        self.soup.positions.push(position);
        Ok(())
    }

    /// Appends a triangle whose indices the caller has checked or will check.
    pub fn face(&mut self, corners: [u32; 3], material: u32) -> Result<(), ReadProblem> {
        self.expect_faces(1)?;
        self.soup.faces.push(corners);
        self.soup.face_material.push(material);
        Ok(())
    }

    /// Leaves out a polygon of fewer than 3 corners: a line or a point, which some programs write among the faces.
    pub fn short_polygon(&mut self, place: Place) {
        self.short.get_or_insert((0, place)).0 += 1;
    }

    /// Remembers something that the soup does not hold.
    pub fn note(&mut self, note: impl Into<String>) {
        let note = note.into();
        if self.notes.len() > MAX_NOTES || self.notes.contains(&note) {
            return;
        }
        self.notes.push(match self.notes.len() {
            MAX_NOTES => "there is more to note than is listed here".into(),
            _ => note,
        });
    }

    /// An image file; none, with a note, where it is of a kind that glTF does not know: the surface does not depend on it.
    pub fn image(
        &mut self,
        bytes: &[u8],
        what: impl Fn() -> String,
    ) -> Result<Option<EmbeddedImage>, ReadProblem> {
        // The bytes decide: declared types and names are often wrong.
        let mime_type = match bytes {
            [0x89, b'P', b'N', b'G', ..] => "image/png",
            [0xff, 0xd8, 0xff, ..] => "image/jpeg",
            other => {
                let note = format!("{} is skipped: {}", what(), kind_of(other));
                self.note(note);
                return Ok(None);
            }
        };
        let has_end = bytes.windows(4).rev().any(|name| name == b"IEND");
        if mime_type == "image/png" && !has_end {
            let note = format!("{} is skipped: it is cut off", what());
            self.note(note);
            return Ok(None);
        }
        self.budget.unpack(bytes.len() as u64, what)?;
        Ok(Some(EmbeddedImage {
            mime_type: mime_type.into(),
            bytes: bytes.to_vec(),
        }))
    }

    /// Begins a part here; it ends where the next begins.
    pub fn part(&mut self, name: String) {
        self.close_part();
        self.soup.parts.push(Part {
            name,
            first_vertex: self.soup.positions.len(),
            vertices: 0,
            first_face: self.soup.faces.len(),
            faces: 0,
        });
    }

    fn close_part(&mut self) {
        let (vertices, faces) = (self.soup.positions.len(), self.soup.faces.len());
        if let Some(part) = self.soup.parts.last_mut() {
            part.vertices = vertices - part.first_vertex;
            part.faces = faces - part.first_face;
            if part.vertices == 0 && part.faces == 0 {
                self.soup.parts.pop();
            }
        }
    }

    /// Adds an attribute whose values follow the corners of the first faces; the others get NaN.
    pub fn attribute_values(&mut self, kind: AttributeKind, components: usize, values: Vec<f32>) {
        self.soup.attributes.push(CornerAttribute {
            kind,
            components,
            values,
        });
    }

    /// Spreads a value a vertex over the corners of all faces so far.
    pub fn vertex_attribute(
        &mut self,
        kind: AttributeKind,
        components: usize,
        values: &[f32],
    ) -> Result<(), ReadProblem> {
        let bytes = (12 * components as u64).saturating_mul(self.soup.faces.len() as u64);
        self.budget.unpack(bytes, || match &kind {
            AttributeKind::Custom(name) => format!("the attribute {}", shorten(name.as_bytes())),
            known => format!("the attribute {known:?}"),
        })?;
        let corners = self.soup.faces.iter().flatten();
        let row = |&v: &u32| &values[v as usize * components..(v as usize + 1) * components];
        let values = corners.flat_map(row).copied().collect();
        self.attribute_values(kind, components, values);
        Ok(())
    }

    /// The finished soup and its notes.
    pub fn finish(mut self) -> Result<(Soup, Vec<String>), ReadProblem> {
        if self.soup.faces.is_empty() {
            let vertices = self.soup.positions.len();
            return Err(ReadProblem::EmptyMesh { vertices });
        }
        match self.short {
            Some((1, place)) => self.note(format!(
                "1 face of fewer than 3 corners is skipped ({place})"
            )),
            Some((count, place)) => self.note(format!(
                "{count} faces of fewer than 3 corners are skipped (the first: {place})"
            )),
            None => {}
        }
        self.close_part();
        let corners = 3 * self.soup.faces.len();
        for attribute in &mut self.soup.attributes {
            attribute
                .values
                .resize(corners * attribute.components, f32::NAN);
            // NaN says "no value"; infinity would spread through every interpolation.
            for value in attribute.values.iter_mut().filter(|v| v.is_infinite()) {
                *value = f32::NAN;
            }
        }
        Ok((self.soup, self.notes))
    }
}
