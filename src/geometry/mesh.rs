//! Surfaces with positions and attributes: what a file holds ([`Soup`]) and what the pipeline
//! works on ([`Mesh`]).
//!
//! Attributes are stored a *corner* (face × 3 × components), so that seams of normals and texture
//! coordinates survive welding, and are interpolated through every edit.

use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeId, FaceId, FaceVec, NONE, VertexId, VertexVec};

/// What a corner attribute means.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum AttributeKind {
    /// Unit normal, 3 components.
    Normal,
    /// Unit tangent and handedness, 4 components.
    Tangent,
    /// Texture coordinates of one set, 2 components; glTF orientation (v down).
    TexCoord(u32),
    /// Linear colour of one set, 4 components.
    Color(u32),
    /// Anything else the source calls by name.
    Custom(String),
}

/// One value a face corner.
#[derive(Clone, Debug, PartialEq)]
pub struct CornerAttribute {
    /// Meaning.
    pub kind: AttributeKind,
    /// Numbers a corner.
    pub components: usize,
    /// Faces × 3 × `components`. NaN where the source has no value for that part of the surface.
    pub values: Vec<f32>,
}

impl CornerAttribute {
    /// The numbers of one corner.
    pub fn corner(&self, face: usize, corner: usize) -> &[f32] {
        let at = (3 * face + corner) * self.components;
        &self.values[at..at + self.components]
    }

    /// The same attribute of other faces.
    pub fn with_values(&self, values: Vec<f32>) -> Self {
        Self {
            kind: self.kind.clone(),
            components: self.components,
            values,
        }
    }

    /// Appends the value on a side of a face, at a fraction from the corner where the side begins; directions stay unit vectors.
    pub fn interpolate(&self, face: usize, corner: usize, fraction: f64, into: &mut Vec<f32>) {
        let from = self.corner(face, corner);
        if fraction == 0.0 {
            into.extend_from_slice(from);
            return;
        }
        let to = self.corner(face, (corner + 1) % 3);
        let mix =
            |(&a, &b): (&f32, &f32)| (1.0 - fraction) * f64::from(a) + fraction * f64::from(b);
        let direction = matches!(self.kind, AttributeKind::Normal | AttributeKind::Tangent);
        let length = match direction {
            true => from
                .iter()
                .zip(to)
                .take(3)
                .map(mix)
                .map(|x| x * x)
                .sum::<f64>()
                .sqrt(),
            false => 1.0,
        };
        let scale = if length > 0.0 { length } else { 1.0 };
        let values = from.iter().zip(to).map(mix).enumerate();
        // The fourth component of a tangent is a sign.
        into.extend(values.map(|(i, x)| (if direction && i > 2 { x } else { x / scale }) as f32));
    }

    fn set(&mut self, face: usize, corner: usize, value: &[f32]) {
        let at = (3 * face + corner) * self.components;
        self.values[at..at + self.components].copy_from_slice(value);
    }

    /// The value between corners of a face, each with its weight; directions stay unit vectors.
    pub fn mix(&self, face: usize, terms: &[(usize, f64)]) -> Vec<f32> {
        let mut sum: Vec<f64> = (0..self.components)
            .map(|c| {
                let term = |&(k, w): &(usize, f64)| f64::from(self.corner(face, k)[c]) * w;
                terms.iter().map(term).sum()
            })
            .collect();
        if matches!(self.kind, AttributeKind::Normal | AttributeKind::Tangent) {
            let length = sum[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                sum[..3].iter_mut().for_each(|x| *x /= length);
            }
        }
        sum.into_iter().map(|x| x as f32).collect()
    }
}

/// A texture used by a material.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`Appearance::textures`].
    pub texture: usize,
    /// Which set of texture coordinates of the *source*.
    pub tex_coord: u32,
    /// Normal scale or occlusion strength; 1 elsewhere.
    pub scale: f32,
}

/// A metallic–roughness material, as glTF has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the source.
    pub name: Option<String>,
    /// Linear base colour with alpha.
    pub base_color: [f32; 4],
    /// Metalness, 0 to 1.
    pub metallic: f32,
    /// Roughness, 0 to 1.
    pub roughness: f32,
    /// Linear emitted colour.
    pub emissive: [f32; 3],
    /// `OPAQUE`, `MASK` or `BLEND`.
    pub alpha_mode: String,
    /// Alpha threshold of `MASK`.
    pub alpha_cutoff: f32,
    /// True where both sides are drawn, as by formats that do not speak of sides.
    pub double_sided: bool,
    /// Base colour texture.
    pub base_color_texture: Option<TextureUse>,
    /// Metal–roughness texture.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Normal map.
    pub normal_texture: Option<TextureUse>,
    /// Ambient occlusion.
    pub occlusion_texture: Option<TextureUse>,
    /// Emission.
    pub emissive_texture: Option<TextureUse>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: None,
            base_color: [1.0; 4],
            metallic: 0.0,
            roughness: 1.0,
            emissive: [0.0; 3],
            alpha_mode: "OPAQUE".into(),
            alpha_cutoff: 0.5,
            double_sided: true,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            occlusion_texture: None,
            emissive_texture: None,
        }
    }
}

/// An image file held in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct EmbeddedImage {
    /// `image/png` or `image/jpeg`.
    pub mime_type: String,
    /// The encoded file.
    pub bytes: Vec<u8>,
}

/// An image with its sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Appearance::images`].
    pub image: usize,
    /// glTF wrap modes (S, T).
    pub wrap: [u32; 2],
    /// glTF magnification filter.
    pub mag_filter: Option<u32>,
    /// glTF minification filter.
    pub min_filter: Option<u32>,
}

/// Materials and textures of a source file, shared by its components.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Appearance {
    /// Materials; a face names one by index, or [`NONE`].
    pub materials: Vec<Material>,
    /// Textures of the materials.
    pub textures: Vec<Texture>,
    /// Images of the textures.
    pub images: Vec<EmbeddedImage>,
}

/// A run of vertices and faces that one part of the file gave (a glTF primitive under one node).
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Part {
    /// Node, mesh and primitive, or the object name.
    pub name: String,
    /// Its first vertex in the running count.
    pub first_vertex: usize,
    /// Number of its vertices.
    pub vertices: usize,
    /// Its first face in the running count.
    pub first_face: usize,
    /// Number of its faces.
    pub faces: usize,
}

/// Triangles as a file gives them: nothing welded, nothing oriented, nothing removed.
///
/// Vertex indices are the file's; face indices count triangles after polygons are fanned from their
/// first vertex, in file order. Positions are finite and every index is in range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Soup {
    /// Position of every vertex of the file, in source units.
    pub positions: Vec<[f64; 3]>,
    /// Vertices of every triangle.
    pub faces: Vec<[u32; 3]>,
    /// Material of every triangle, or [`NONE`]; same length as `faces`.
    pub face_material: Vec<u32>,
    /// Corner attributes, same order of faces.
    pub attributes: Vec<CornerAttribute>,
    /// Materials and textures.
    pub appearance: Appearance,
    /// Where the parts of the file begin.
    pub parts: Vec<Part>,
}

impl Soup {
    /// Bare triangles: no attributes, no materials. Indices and positions are checked when the soup is repaired.
    pub fn from_triangles(positions: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Self {
        Self {
            face_material: vec![NONE; faces.len()],
            positions,
            faces,
            ..Self::default()
        }
    }
}

/// An oriented manifold connected surface in space.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Who touches whom.
    pub connectivity: Connectivity,
    /// Position of every vertex, in source units.
    pub positions: VertexVec<[f64; 3]>,
    /// Vertex of the input file (the first of those welded), [`NONE`] for a new one.
    pub source_vertex: VertexVec<u32>,
    /// Triangle of the input file that each face lies in.
    pub source_face: FaceVec<u32>,
    /// Material of each face, or [`NONE`].
    pub face_material: FaceVec<u32>,
    /// Corner attributes.
    pub attributes: Vec<CornerAttribute>,
}

impl Mesh {
    /// Positions and faces with nothing that they came from.
    ///
    /// # Errors
    /// Faces that make no surface.
    pub fn bare(positions: Vec<[f64; 3]>, faces: &[[u32; 3]]) -> Result<Self, ConnectivityError> {
        Ok(Self {
            connectivity: Connectivity::from_faces(faces, positions.len())?,
            source_vertex: VertexVec::filled(NONE, positions.len()),
            positions: positions.into(),
            source_face: FaceVec::filled(NONE, faces.len()),
            face_material: FaceVec::filled(NONE, faces.len()),
            attributes: Vec::new(),
        })
    }

    /// Positions of the corners of a face.
    pub fn face_positions(&self, f: FaceId) -> [[f64; 3]; 3] {
        self.connectivity
            .face_vertices(f)
            .map(|v| self.positions[v])
    }

    /// Length of an edge in space.
    pub fn edge_length(&self, e: EdgeId) -> f64 {
        let [a, b] = self.connectivity.edge_vertices(e);
        distance(self.positions[a], self.positions[b])
    }

    /// Diagonal of the bounding box.
    pub fn diagonal(&self) -> f64 {
        let (low, high) = bounding_box(self.positions.as_slice());
        distance(low, high)
    }

    /// Splits an edge at the fraction `t` from the tail of its halfedge. The surface stays where it is;
    /// attributes are interpolated on each side.
    pub fn split_edge(&mut self, e: EdgeId, t: f64) -> VertexId {
        let [a, b] = self.connectivity.edge_vertices(e);
        let (pa, pb) = (self.positions[a], self.positions[b]);
        let split = self.connectivity.split_edge(e);
        self.positions
            .push(std::array::from_fn(|i| pa[i] + t * (pb[i] - pa[i])));
        self.source_vertex.push(NONE);
        for (side, fraction) in split.sides.iter().zip([t, 1.0 - t]) {
            self.copy_face(side.old);
            let (old, k) = (side.old.index(), side.corner);
            for attribute in &mut self.attributes {
                let value = attribute.mix(old, &[(k, 1.0 - fraction), ((k + 1) % 3, fraction)]);
                attribute.set(old, (k + 1) % 3, &value);
                attribute.set(side.new.index(), k, &value);
            }
        }
        split.vertex
    }

    /// Splits a face at barycentric weights (summing to 1).
    pub fn split_face(&mut self, f: FaceId, weights: [f64; 3]) -> VertexId {
        let corners = self.face_positions(f);
        let split = self.connectivity.split_face(f);
        self.positions.push(std::array::from_fn(|i| {
            (0..3).map(|k| weights[k] * corners[k][i]).sum()
        }));
        self.source_vertex.push(NONE);
        let terms = [0, 1, 2].map(|k| (k, weights[k]));
        let values: Vec<_> = self
            .attributes
            .iter()
            .map(|a| a.mix(f.index(), &terms))
            .collect();
        self.copy_face(f);
        self.copy_face(f);
        for (attribute, value) in self.attributes.iter_mut().zip(values) {
            for (i, face) in split.faces.into_iter().enumerate() {
                attribute.set(face.index(), (i + 2) % 3, &value);
            }
        }
        split.vertex
    }

    fn copy_face(&mut self, f: FaceId) {
        self.source_face.push(self.source_face[f]);
        self.face_material.push(self.face_material[f]);
        for attribute in &mut self.attributes {
            let row = 3 * attribute.components;
            attribute
                .values
                .extend_from_within(f.index() * row..(f.index() + 1) * row);
        }
    }
}

/// Euclidean distance.
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
    norm(d)
}

/// Euclidean length, without overflow or underflow of squares.
#[inline]
pub fn norm(d: [f64; 3]) -> f64 {
    let square = dot(d, d);
    match PLAIN_SQUARES.contains(&square) {
        true => square.sqrt(),
        // `hypot` takes ten times as long.
        false => d[0].hypot(d[1]).hypot(d[2]),
    }
}

/// Squares of lengths that neither overflow nor lose digits by underflow.
pub(crate) const PLAIN_SQUARES: std::ops::Range<f64> = 1e-200..1e200;

/// Cross product.
#[inline]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Scalar product.
#[inline]
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Difference `a − b`.
#[inline]
pub fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Distance of a point from a segment, in any dimension.
pub fn distance_to_segment<const N: usize>(p: [f64; N], a: [f64; N], b: [f64; N]) -> f64 {
    let dot = |x: [f64; N], y: [f64; N]| -> f64 { x.iter().zip(y).map(|(x, y)| x * y).sum() };
    let minus = |x: [f64; N], y: [f64; N]| -> [f64; N] { std::array::from_fn(|i| x[i] - y[i]) };
    let (along, from) = (minus(b, a), minus(p, a));
    let length2 = dot(along, along);
    let t = if length2 > 0.0 {
        (dot(from, along) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let off: [f64; N] = std::array::from_fn(|i| from[i] - t * along[i]);
    dot(off, off).sqrt()
}

/// Area of a triangle in space.
pub fn triangle_area(p: [[f64; 3]; 3]) -> f64 {
    0.5 * norm(cross(sub(p[1], p[0]), sub(p[2], p[0])))
}

/// Lowest and highest coordinates; infinite where there are no points.
pub fn bounding_box(points: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    points.iter().fold(start, |(low, high), p| {
        (
            std::array::from_fn(|i| low[i].min(p[i])),
            std::array::from_fn(|i| high[i].max(p[i])),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        let faces = [[0, 1, 2], [0, 2, 3]];
        let positions = vec![
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [0.0, 2.0, 0.0],
        ];
        let uv = |v: u32| positions[v as usize][..2].iter().map(|&x| x as f32);
        Mesh {
            connectivity: Connectivity::from_faces(&faces, 4).unwrap(),
            attributes: vec![CornerAttribute {
                kind: AttributeKind::TexCoord(0),
                components: 2,
                values: faces.iter().flatten().flat_map(|&v| uv(v)).collect(),
            }],
            source_vertex: vec![0, 1, 2, 3].into(),
            source_face: vec![0, 1].into(),
            face_material: vec![NONE; 2].into(),
            positions: positions.clone().into(),
        }
    }

    #[test]
    fn splits_keep_area_and_interpolate_attributes() {
        let mut mesh = square();
        let diagonal = mesh
            .connectivity
            .edges()
            .find(|&e| !mesh.connectivity.is_boundary_edge(e))
            .unwrap();
        mesh.split_edge(diagonal, 0.25);
        mesh.split_face(FaceId::new(0), [0.5, 0.25, 0.25]);
        let side = mesh
            .connectivity
            .edges()
            .find(|&e| mesh.connectivity.is_boundary_edge(e));
        mesh.split_edge(side.unwrap(), 0.5);
        mesh.connectivity.validate().unwrap();
        let mut area = 0.0;
        for f in mesh.connectivity.faces() {
            let p = mesh.face_positions(f);
            area += triangle_area(p);
            for (k, corner) in p.iter().enumerate() {
                let uv = mesh.attributes[0].corner(f.index(), k);
                // The attribute is the position, so it must still be after every edit.
                assert!((f64::from(uv[0]) - corner[0]).abs() < 1e-6);
                assert!((f64::from(uv[1]) - corner[1]).abs() < 1e-6);
            }
            assert!(mesh.source_face[f] < 2);
        }
        assert!((area - 4.0).abs() < 1e-12);
    }

    #[test]
    fn distances_to_a_segment() {
        let (a, b) = ([0.0, 0.0], [2.0, 0.0]);
        assert_eq!(distance_to_segment([1.0, 3.0], a, b), 3.0);
        assert_eq!(distance_to_segment([5.0, 4.0], a, b), 5.0);
        assert_eq!(distance_to_segment([-3.0, -4.0], a, a), 5.0);
    }
}
