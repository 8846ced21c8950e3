//! Primitives: from accessors or Draco data to vertices, triangles and corner attributes (glTF 2.0, 3.7).

use super::OBJECT_BYTES;
use super::accessor::{Component, Values};
use super::appearance::TextureMaps;
use super::buffers::{Buffers, lookup};
use super::draco;
use super::scene::{Affine, Instance};
use super::schema::{Primitive, Root};
use crate::geometry::ids::NONE;
use crate::geometry::mesh::{AttributeKind, CornerAttribute};
use crate::read::budget::Budget;
use crate::read::build::SoupBuilder;
use crate::read::error::{Place, ReadProblem, shorten};
use std::collections::HashMap;

const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// A primitive under a node, looked up and counted, nothing of it read yet.
pub struct Planned<'a> {
    transform: Affine,
    primitive: &'a Primitive,
    place: Place,
    name: String,
    mode: u32,
    position: Values<'a>,
    indices: Option<Values<'a>>,
    /// Triangles by the accessors' counts.
    faces: u64,
    /// Kind, numbers a corner, name and accessor.
    attributes: Vec<(usize, &'a str, Values<'a>)>,
}

/// Everything that is to be read, and the attributes it has together.
#[derive(Default)]
pub struct Plan<'a> {
    primitives: Vec<Planned<'a>>,
    vertices: u64,
    faces: u64,
    attributes: Vec<CornerAttribute>,
    /// Place of each kind in `attributes`.
    columns: HashMap<AttributeKind, usize>,
}

/// Bytes of a vertex in the soup, and of a triangle with its material.
const VERTEX_BYTES: u64 = 24;
const FACE_BYTES: u64 = 16;

/// The meaning of an attribute's name and the number of its components; `None` where it is of no use here.
fn meaning(name: &str, components: usize) -> Option<(AttributeKind, usize)> {
    let set = |prefix: &str| name.strip_prefix(prefix).and_then(|n| n.parse().ok());
    if name == "NORMAL" {
        Some((AttributeKind::Normal, 3))
    } else if name == "TANGENT" {
        Some((AttributeKind::Tangent, 4))
    } else if let Some(set) = set("TEXCOORD_") {
        Some((AttributeKind::TexCoord(set), 2))
    } else if let Some(set) = set("COLOR_") {
        Some((AttributeKind::Color(set), 4))
    } else if components > 0 {
        let custom = name.strip_prefix('_')?;
        Some((AttributeKind::Custom(custom.to_owned()), components))
    } else {
        None
    }
}

impl<'a> Plan<'a> {
    /// Adds the primitives of an instance.
    pub fn add(
        &mut self,
        root: &'a Root,
        instance: &Instance,
        build: &mut SoupBuilder,
    ) -> Result<(), ReadProblem> {
        let (node, mesh_index) = (instance.node, instance.mesh);
        let mesh = lookup(&root.meshes, mesh_index, "mesh", || format!("node {node}"))?;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let place = Place::Primitive {
                node,
                mesh: mesh_index,
                primitive: i,
            };
            let parts = 1 + primitive.attributes.len() as u64;
            let budget = &mut build.budget;
            budget.unpack(OBJECT_BYTES * parts, || "its list of primitives".into())?;
            let mode = primitive.mode.unwrap_or(TRIANGLES);
            match mode {
                0..=3 => {
                    build.note(format!("{place}: points and lines are skipped"));
                    continue;
                }
                TRIANGLES | STRIP | FAN => {}
                other => {
                    return Err(ReadProblem::Expected {
                        place,
                        expected: "a primitive mode from 0 to 6",
                        found: other.to_string(),
                    });
                }
            }
            if !primitive.targets.is_empty() {
                build.note(format!("{place}: morph targets are not applied"));
            }
            let Some(&position) = primitive.attributes.get("POSITION") else {
                build.note(format!("{place}: it has no POSITION and is skipped"));
                continue;
            };
            let from = place.to_string();
            let position = Values::of(root, position, &from)?;
            let fits = position.components == 3 && position.component != Component::U32;
            position.require(fits, "POSITION", "VEC3 of floats or short integers")?;
            let indices = primitive.indices.map(|i| Values::of(root, i, &from));
            let indices = indices.transpose()?;
            if let Some(indices) = &indices {
                let unsigned = [Component::U8, Component::U16, Component::U32];
                let fits = indices.components == 1 && unsigned.contains(&indices.component);
                indices.require(fits, "indices", "SCALAR of unsigned integers")?;
            }
            let corners = indices.map_or(position.accessor.count, |i| i.accessor.count);
            let faces = match mode {
                TRIANGLES => corners / 3,
                _ => corners.saturating_sub(2),
            };
            if mode == TRIANGLES && corners % 3 > 0 {
                build.note(format!(
                    "{place}: {} corners after the last triangle are skipped",
                    corners % 3
                ));
            }
            if let Some(material) = primitive.material {
                lookup(&root.materials, material, "material", || from.clone())?;
            }
            self.vertices = self.vertices.saturating_add(position.accessor.count);
            self.faces = self.faces.saturating_add(faces);
            build.expect_vertices(self.vertices)?;
            build.expect_faces(self.faces)?;
            let attributes = self.attributes(root, primitive, &position, place, build)?;
            let title = |kind: &str, index: usize, name: &Option<String>| match name {
                Some(name) => format!("{kind} {index} ({})", shorten(name.as_bytes())),
                None => format!("{kind} {index}"),
            };
            let node_title = title("node", node, &root.nodes[node].name);
            let mesh_title = title("mesh", mesh_index, &mesh.name);
            self.primitives.push(Planned {
                transform: instance.transform,
                primitive,
                place,
                name: format!("{node_title}, {mesh_title}, primitive {i}"),
                mode,
                position,
                indices,
                faces,
                attributes,
            });
        }
        Ok(())
    }

    fn attributes(
        &mut self,
        root: &'a Root,
        primitive: &'a Primitive,
        position: &Values,
        place: Place,
        build: &mut SoupBuilder,
    ) -> Result<Vec<(usize, &'a str, Values<'a>)>, ReadProblem> {
        let mut found = Vec::new();
        for (name, &index) in &primitive.attributes {
            if name == "POSITION" {
                continue;
            }
            let short = || shorten(name.as_bytes());
            if name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_") {
                build.note("skin joints and weights are skipped");
                continue;
            }
            let values = Values::of(root, index, &place.to_string())?;
            let Some((kind, components)) = meaning(name, values.components) else {
                build.note(format!("the attribute {} is skipped", short()));
                continue;
            };
            let rgb = matches!(kind, AttributeKind::Color(_)) && values.components == 3;
            let fits = values.components == components || rgb;
            values.require(fits, &short(), "the type glTF gives this attribute")?;
            if values.accessor.count != position.accessor.count {
                return Err(ReadProblem::AttributeCount {
                    place,
                    name: short(),
                    count: values.accessor.count,
                    vertices: position.accessor.count,
                });
            }
            let column = *self.columns.entry(kind.clone()).or_insert_with(|| {
                self.attributes.push(CornerAttribute {
                    kind,
                    components,
                    values: Vec::new(),
                });
                self.attributes.len() - 1
            });
            if self.attributes[column].components != components {
                build.note(format!(
                    "{place}: {} has another type than before and is skipped",
                    short()
                ));
                continue;
            }
            found.push((column, name.as_str(), values));
        }
        Ok(found)
    }

    /// Bytes of the corner attributes of `faces` triangles: all have all.
    fn attribute_bytes(&self, faces: u64) -> u64 {
        let numbers: u64 = self.attributes.iter().map(|a| a.components as u64).sum();
        faces.saturating_mul(12).saturating_mul(numbers)
    }

    /// Reads everything into the soup.
    pub fn read(
        mut self,
        root: &Root,
        buffers: &Buffers,
        maps: &[TextureMaps],
        build: &mut SoupBuilder,
    ) -> Result<(), ReadProblem> {
        let what = || "corner attributes".to_owned();
        build
            .budget
            .unpack(self.attribute_bytes(self.faces), what)?;
        for planned in std::mem::take(&mut self.primitives) {
            let first_face = build.soup.faces.len();
            let unpacked = planned.unpack(buffers, build)?;
            if let Some(unpacked) = &unpacked {
                let more = (unpacked.triangles.len() as u64).saturating_sub(planned.faces);
                let bytes = self.attribute_bytes(more);
                build.budget.unpack(bytes, what)?;
            }
            let corners = planned.geometry(root, buffers, unpacked.as_ref(), build)?;
            for &(column, name, values) in &planned.attributes {
                let attribute = &mut self.attributes[column];
                let budget = &mut build.budget;
                let unpacked = unpacked.as_ref();
                let numbers = planned.numbers(root, buffers, unpacked, name, &values, budget)?;
                let set = match attribute.kind {
                    AttributeKind::TexCoord(set) => Some(set),
                    _ => None,
                };
                let map = planned.primitive.material.zip(set);
                let map = map.and_then(|(material, set)| maps[material].get(&set));
                let rows: Vec<[f32; 4]> = numbers
                    .chunks_exact(values.components)
                    .map(|row| {
                        let row = row_of(&attribute.kind, row, &planned.transform, map);
                        row.map(|x| x as f32)
                    })
                    .collect();
                let components = attribute.components;
                // Triangles before these that lack the attribute.
                attribute
                    .values
                    .resize(3 * first_face * components, f32::NAN);
                let row = |&corner: &u32| &rows[corner as usize][..components];
                attribute.values.extend(corners.iter().flat_map(row));
            }
        }
        build.soup.attributes = self.attributes;
        Ok(())
    }
}

/// The numbers of an attribute at one vertex, moved by the node and the texture's map.
fn row_of(
    kind: &AttributeKind,
    row: &[f64],
    transform: &Affine,
    map: Option<&[[f64; 3]; 2]>,
) -> [f64; 4] {
    let mut out = [0.0; 4];
    out[..row.len()].copy_from_slice(row);
    let direction = [out[0], out[1], out[2]];
    match kind {
        AttributeKind::Normal => {
            out[..3].copy_from_slice(&transform.normal(direction));
        }
        AttributeKind::Tangent => {
            out[..3].copy_from_slice(&transform.tangent(direction));
            // A mirror turns the bitangent over.
            if transform.determinant() < 0.0 {
                out[3] = -out[3];
            }
        }
        AttributeKind::TexCoord(_) => {
            if let Some(map) = map {
                let [u, v] = map.map(|m| m[0] * row[0] + m[1] * row[1] + m[2]);
                (out[0], out[1]) = (u, v);
            }
        }
        AttributeKind::Color(_) if row.len() == 3 => out[3] = 1.0,
        _ => {}
    }
    out
}

impl Planned<'_> {
    fn unpack(
        &self,
        buffers: &Buffers,
        build: &mut SoupBuilder,
    ) -> Result<Option<draco::Unpacked>, ReadProblem> {
        let Some(packed) = &self.primitive.extensions.draco else {
            return Ok(None);
        };
        let bytes = buffers.view(packed.buffer_view, || self.place.to_string())?;
        let (points, faces) = build.room();
        draco::unpack(bytes, points, faces, &mut build.budget, self.place).map(Some)
    }

    /// The numbers of an attribute, from the Draco data where that has it.
    fn numbers(
        &self,
        root: &Root,
        buffers: &Buffers,
        unpacked: Option<&draco::Unpacked>,
        name: &str,
        values: &Values,
        budget: &mut Budget,
    ) -> Result<Vec<f64>, ReadProblem> {
        // Colours are fractions of 1, whether the file says so or not.
        let normalized = values.accessor.normalized || name.starts_with("COLOR_");
        let packed = self.primitive.extensions.draco.as_ref().zip(unpacked);
        if let Some((draco, unpacked)) = packed {
            let numbers = unpacked.attribute(draco, name, values.components, budget)?;
            if let Some(mut numbers) = numbers {
                if normalized {
                    numbers
                        .iter_mut()
                        .for_each(|n| *n = values.component.normalize(*n));
                }
                return Ok(numbers);
            }
            if values.accessor.count != unpacked.points as u64 {
                return Err(ReadProblem::AttributeCount {
                    place: self.place,
                    name: shorten(name.as_bytes()),
                    count: values.accessor.count,
                    vertices: unpacked.points as u64,
                });
            }
        }
        values.read(buffers, root, normalized, budget)
    }

    /// Appends vertices and triangles; returns the primitive's own vertex at every corner.
    fn geometry(
        &self,
        root: &Root,
        buffers: &Buffers,
        unpacked: Option<&draco::Unpacked>,
        build: &mut SoupBuilder,
    ) -> Result<Vec<u32>, ReadProblem> {
        build.part(self.name.clone());
        let base = build.soup.positions.len();
        let first_face = build.soup.faces.len();
        let positions = self.numbers(
            root,
            buffers,
            unpacked,
            "POSITION",
            &self.position,
            &mut build.budget,
        )?;
        let what = || format!("the geometry of {}", self.place);
        let vertices = positions.len() as u64 / 3;
        build.budget.unpack(vertices * VERTEX_BYTES, what)?;
        for p in positions.chunks_exact(3) {
            let p = [p[0], p[1], p[2]];
            // What is not finite is reported as the file has it.
            let finite = p.iter().all(|x| x.is_finite());
            let moved = if finite { self.transform.point(p) } else { p };
            build.vertex(moved, self.place)?;
        }
        let count = build.soup.positions.len() - base;
        let determinant = self.transform.determinant();
        if determinant == 0.0 {
            build.note(format!(
                "{}: the node's transform flattens the mesh",
                self.place
            ));
        }
        let material = self.primitive.material.map_or(NONE, |m| m as u32);
        let mut corners = Vec::new();
        let mut emit = |mut triangle: [u32; 3], build: &mut SoupBuilder| {
            let outside = |&&i: &&u32| i as usize >= count;
            if let Some(&index) = triangle.iter().find(outside) {
                return Err(ReadProblem::IndexOutOfRange {
                    face: build.soup.faces.len(),
                    place: self.place,
                    what: "vertex",
                    index: i64::from(index),
                    count,
                    first: 0,
                });
            }
            if determinant < 0.0 {
                // A mirror turns counterclockwise into clockwise (3.7.4).
                triangle.swap(1, 2);
            }
            corners.extend(triangle);
            build.face(triangle.map(|i| base as u32 + i), material)
        };
        let faces = unpacked.map_or(self.faces, |unpacked| unpacked.triangles.len() as u64);
        if let Some(unpacked) = unpacked {
            build
                .budget
                .unpack(faces.saturating_mul(FACE_BYTES), what)?;
            // Draco holds triangles, whatever the primitive's mode.
            for &triangle in &unpacked.triangles {
                emit(triangle, build)?;
            }
            return Ok(corners);
        }
        let indices: Vec<u32> = match &self.indices {
            Some(indices) => {
                let numbers = indices.read(buffers, root, false, &mut build.budget)?;
                numbers.into_iter().map(|i| i as u32).collect()
            }
            None => (0..count as u32).collect(),
        };
        build
            .budget
            .unpack(faces.saturating_mul(FACE_BYTES), what)?;
        match self.mode {
            TRIANGLES => {
                for triangle in indices.chunks_exact(3) {
                    emit([triangle[0], triangle[1], triangle[2]], build)?;
                }
            }
            mode => {
                for (k, window) in indices.windows(3).enumerate() {
                    let [a, b, c] = [window[0], window[1], window[2]];
                    let triangle = match (mode, k % 2) {
                        (FAN, _) => [indices[0], b, c],
                        (_, 0) => [a, b, c],
                        _ => [a, c, b],
                    };
                    // Repeated vertices only join the pieces of a strip; they are no faces of the surface.
                    let [a, b, c] = triangle;
                    if a != b && b != c && c != a {
                        emit(triangle, build)?;
                    }
                }
            }
        }
        debug_assert_eq!(corners.len(), 3 * (build.soup.faces.len() - first_face));
        Ok(corners)
    }
}
