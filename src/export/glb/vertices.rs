//! Vertices of `surface.glb`: a vertex of the surface is split where its corners differ in any attribute.

use crate::export::ExportError;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId, NONE, VertexId, VertexVec};
use crate::geometry::mesh::{AttributeKind, CornerAttribute, Mesh, cross, norm, sub};
use crate::product::AffineAtlas;

/// Corners of one patch at one vertex of the slit disk are the same point; beyond this
/// distance in the packed square they are kept apart all the same.
pub(super) const PACKED_TOLERANCE: f64 = 1e-6;

/// How far the length of a source tangent may be from 1.
const TANGENT_TOLERANCE: f64 = 1e-2;

/// Vertices and triangles of one material.
#[derive(Clone, Debug)]
pub(super) struct Primitive {
    pub(super) indices: Vec<u32>,
    pub(super) position: Vec<[f32; 3]>,
    pub(super) normal: Vec<[f32; 3]>,
    pub(super) tangent: Option<Vec<[f32; 4]>>,
    /// Set 0 is the packed patches, the others are the source's in order.
    pub(super) tex_coords: Vec<Vec<[f32; 2]>>,
    pub(super) colors: Vec<Vec<[f32; 4]>>,
    pub(super) log_scale: Vec<[f32; 1]>,
}

/// The source attributes that glTF has a place for, in the order of their sets.
pub(super) struct Sets<'a> {
    normal: Option<&'a CornerAttribute>,
    tangent: Option<&'a CornerAttribute>,
    tex_coords: Vec<(u32, &'a CornerAttribute)>,
    colors: Vec<(u32, &'a CornerAttribute)>,
}

impl<'a> Sets<'a> {
    pub(super) fn of(attributes: &'a [CornerAttribute]) -> Self {
        let mut sets = Sets {
            normal: None,
            tangent: None,
            tex_coords: Vec::new(),
            colors: Vec::new(),
        };
        for attribute in attributes {
            match (&attribute.kind, attribute.components) {
                (AttributeKind::Normal, 3) => sets.normal = sets.normal.or(Some(attribute)),
                (AttributeKind::Tangent, 4) => sets.tangent = sets.tangent.or(Some(attribute)),
                (&AttributeKind::TexCoord(n), 2) => sets.tex_coords.push((n, attribute)),
                (&AttributeKind::Color(n), 4) => sets.colors.push((n, attribute)),
                _ => {}
            }
        }
        for list in [&mut sets.tex_coords, &mut sets.colors] {
            list.sort_by_key(|&(n, _)| n);
            list.dedup_by_key(|&mut (n, _)| n);
        }
        sets
    }

    pub(super) fn numbers(&self) -> SetNumbers {
        SetNumbers(self.tex_coords.iter().map(|&(n, _)| n).collect())
    }
}

/// The source's numbers of its texture-coordinate sets, in their order.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SetNumbers(Vec<u32>);

impl SetNumbers {
    /// Where the source's texture-coordinate set goes: one up, closed up where the source leaves sets out.
    pub(super) fn shifted(&self, source_set: u32) -> Option<u32> {
        let place = self.0.iter().position(|&n| n == source_set);
        place.map(|i| i as u32 + 1)
    }
}

/// Splits the vertices of one primitive after another.
pub(super) struct Splitter<'a> {
    atlas: &'a AffineAtlas,
    sets: &'a Sets<'a>,
    /// Subtracted from positions before they become 32-bit floats.
    origin: [f32; 3],
    vertex_normal: VertexVec<[f64; 3]>,
    face_normal: FaceVec<[f64; 3]>,
    /// Last output vertex of every vertex, `NONE` between primitives.
    last: VertexVec<u32>,
}

/// What is known of an output vertex beside its attributes.
struct Corner {
    copy: u32,
    patch: u32,
    packed: [f64; 2],
    /// The output vertex of the same vertex that came before.
    previous: u32,
}

impl<'a> Splitter<'a> {
    pub(super) fn new(atlas: &'a AffineAtlas, sets: &'a Sets<'a>) -> Result<Self, ExportError> {
        let origin = atlas.image_origin.map(|x| x as f32);
        for (v, p) in atlas.mesh.positions.enumerate() {
            for i in 0..3 {
                let coordinate = p[i] - f64::from(origin[i]);
                if !((coordinate as f32).is_finite() && origin[i].is_finite()) {
                    return Err(ExportError::TooLarge {
                        vertex: v.index(),
                        coordinate,
                    });
                }
            }
        }
        let (vertex_normal, face_normal) = normals(&atlas.mesh);
        Ok(Self {
            atlas,
            sets,
            origin,
            vertex_normal,
            face_normal,
            last: VertexVec::filled(NONE, atlas.mesh.positions.len()),
        })
    }

    /// Translation of the node.
    pub(super) fn origin(&self) -> [f32; 3] {
        self.origin
    }

    /// The primitive of some faces, with at least `least_sets` texture-coordinate sets of the source.
    pub(super) fn primitive(
        &mut self,
        faces: &[FaceId],
        least_sets: usize,
    ) -> Result<Primitive, ExportError> {
        let sets = self.sets;
        let count = used(&sets.tex_coords, faces).max(least_sets);
        let tex_coords = &sets.tex_coords[..count.min(sets.tex_coords.len())];
        let colors = &sets.colors[..used(&sets.colors, faces)];
        let tangent = sets
            .tangent
            .filter(|t| sets.normal.is_some() && tangents_are_valid(t, faces));
        let mut primitive = Primitive {
            indices: Vec::with_capacity(3 * faces.len()),
            position: Vec::new(),
            normal: Vec::new(),
            tangent: tangent.map(|_| Vec::new()),
            tex_coords: vec![Vec::new(); 1 + tex_coords.len()],
            colors: vec![Vec::new(); colors.len()],
            log_scale: Vec::new(),
        };
        let atlas = self.atlas;
        let connectivity = &atlas.mesh.connectivity;
        let mut corners: Vec<Corner> = Vec::new();
        let mut row = Row::default();
        for &f in faces {
            for (k, h) in connectivity.face_halfedges(f).into_iter().enumerate() {
                let v = connectivity.tail(h);
                let corner = self.corner(f, k, h, v)?;
                row.normal = self.normal(f, k, v);
                row.tangent = tangent.map(|t| unit_tangent(t.corner(f.index(), k)));
                row.tex_coords.clear();
                row.tex_coords.extend(tex_coords.iter().map(|(_, a)| {
                    let uv = a.corner(f.index(), k);
                    [0, 1].map(|c| finite(uv[c], 0.0))
                }));
                row.colors.clear();
                row.colors.extend(colors.iter().map(|(_, a)| {
                    let rgba = a.corner(f.index(), k);
                    [0, 1, 2, 3].map(|c| finite(rgba[c], 1.0).clamp(0.0, 1.0))
                }));
                let index = match self.find(v, &corner, &row, &corners, &primitive) {
                    Some(index) => index,
                    None => {
                        let index = next_index(corners.len())?;
                        self.push(v, &row, &corner, &mut primitive)?;
                        corners.push(corner);
                        self.last[v] = index;
                        index
                    }
                };
                primitive.indices.push(index);
            }
        }
        for &f in faces {
            for v in connectivity.face_vertices(f) {
                self.last[v] = NONE;
            }
        }
        Ok(primitive)
    }

    fn corner(
        &self,
        f: FaceId,
        k: usize,
        h: HalfedgeId,
        v: VertexId,
    ) -> Result<Corner, ExportError> {
        let layout = &self.atlas.patches;
        let id = layout.face_patch[f];
        let patch = &layout.patches[id.index()];
        let packed = patch.packed(layout.uv[f][k]);
        if !packed.iter().all(|x| (*x as f32).is_finite()) {
            return Err(ExportError::NotFinite {
                place: format!("surface.glb TEXCOORD_0 of face {f}"),
            });
        }
        Ok(Corner {
            copy: self.atlas.central.copy[h],
            patch: id.raw(),
            packed,
            previous: self.last[v],
        })
    }

    /// The source's normal where it has one, else that of the vertex, else that of the face.
    fn normal(&self, f: FaceId, k: usize, v: VertexId) -> [f32; 3] {
        let source = self.sets.normal.map(|a| a.corner(f.index(), k));
        let source = source.map(|n| [0, 1, 2].map(|i| f64::from(n[i])));
        let candidates = [
            source,
            Some(self.vertex_normal[v]),
            Some(self.face_normal[f]),
        ];
        let mut units = candidates.into_iter().flatten().filter_map(unit);
        units
            .next()
            .unwrap_or([0.0, 0.0, 1.0])
            .map(|x| x as f32 + 0.0)
    }

    /// The output vertex with the same attributes, the latest first.
    fn find(
        &self,
        v: VertexId,
        corner: &Corner,
        row: &Row,
        corners: &[Corner],
        primitive: &Primitive,
    ) -> Option<u32> {
        let mut candidate = self.last[v];
        while candidate != NONE {
            let i = candidate as usize;
            let other = &corners[i];
            let near = |c: usize| (other.packed[c] - corner.packed[c]).abs() <= PACKED_TOLERANCE;
            let same = other.copy == corner.copy
                && other.patch == corner.patch
                && near(0)
                && near(1)
                && primitive.normal[i] == row.normal
                && primitive.tangent.as_ref().map(|t| t[i]) == row.tangent
                && (primitive.tex_coords[1..].iter().zip(&row.tex_coords)).all(|(a, b)| a[i] == *b)
                && primitive
                    .colors
                    .iter()
                    .zip(&row.colors)
                    .all(|(a, b)| a[i] == *b);
            if same {
                return Some(candidate);
            }
            candidate = other.previous;
        }
        None
    }

    fn push(
        &self,
        v: VertexId,
        row: &Row,
        corner: &Corner,
        primitive: &mut Primitive,
    ) -> Result<(), ExportError> {
        let p = self.atlas.mesh.positions[v];
        let position = [0, 1, 2].map(|i| (p[i] - f64::from(self.origin[i])) as f32);
        let log_scale = self.atlas.metric.log_scale[v] as f32;
        if !log_scale.is_finite() {
            return Err(ExportError::NotFinite {
                place: format!("log scale of vertex {v}"),
            });
        }
        primitive.position.push(position);
        primitive.normal.push(row.normal);
        if let (Some(list), Some(value)) = (&mut primitive.tangent, row.tangent) {
            list.push(value);
        }
        // glTF texture coordinates go down, the packed square goes up.
        let [u, v] = corner.packed;
        primitive.tex_coords[0].push([u as f32, (1.0 - v) as f32]);
        for (list, value) in primitive.tex_coords[1..].iter_mut().zip(&row.tex_coords) {
            list.push(*value);
        }
        for (list, value) in primitive.colors.iter_mut().zip(&row.colors) {
            list.push(*value);
        }
        primitive.log_scale.push([log_scale]);
        Ok(())
    }
}

/// Source attributes of one corner, as they will be written; all finite, so that `==` compares them.
#[derive(Default)]
struct Row {
    normal: [f32; 3],
    tangent: Option<[f32; 4]>,
    tex_coords: Vec<[f32; 2]>,
    colors: Vec<[f32; 4]>,
}

/// The number of the next output vertex. The greatest number is reserved by the format.
pub(super) fn next_index(vertices: usize) -> Result<u32, ExportError> {
    let index = u32::try_from(vertices).ok().filter(|&n| n < NONE);
    index.ok_or(ExportError::Inconsistent {
        what: "vertices of a glTF primitive",
        found: vertices + 1,
        expected: NONE as usize,
    })
}

/// How many sets, counted from the first, have a value anywhere on the faces: sets may not be left out in between.
fn used(sets: &[(u32, &CornerAttribute)], faces: &[FaceId]) -> usize {
    let has_value = |attribute: &CornerAttribute| {
        let mut corners = faces.iter().flat_map(|f| (0..3).map(|k| (f.index(), k)));
        corners.any(|(f, k)| attribute.corner(f, k).iter().all(|x| x.is_finite()))
    };
    let last = sets.iter().rposition(|(_, attribute)| has_value(attribute));
    last.map_or(0, |i| i + 1)
}

/// True where every corner has a unit tangent and a handedness of ±1. Interpolation across a
/// mirrored seam breaks the handedness: then the client had better compute tangents itself.
fn tangents_are_valid(tangent: &CornerAttribute, faces: &[FaceId]) -> bool {
    let mut corners = faces.iter().flat_map(|f| (0..3).map(|k| (f.index(), k)));
    corners.all(|(f, k)| {
        let t = tangent.corner(f, k);
        let length = norm([0, 1, 2].map(|i| f64::from(t[i])));
        (length - 1.0).abs() <= TANGENT_TOLERANCE && t[3].abs() == 1.0
    })
}

fn unit_tangent(t: &[f32]) -> [f32; 4] {
    let direction = unit([0, 1, 2].map(|i| f64::from(t[i]))).unwrap_or([1.0, 0.0, 0.0]);
    let [x, y, z] = direction.map(|x| x as f32 + 0.0);
    [x, y, z, t[3]]
}

/// The value with −0 made 0, or a default where it is not finite.
fn finite(value: f32, default: f32) -> f32 {
    if value.is_finite() {
        value + 0.0
    } else {
        default
    }
}

pub(super) fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = norm(v);
    (length.is_finite() && length > 0.0).then(|| v.map(|x| x / length))
}

/// Normals of vertices and faces, weighted by area, in units of the model's size so that nothing underflows.
pub(super) fn normals(mesh: &Mesh) -> (VertexVec<[f64; 3]>, FaceVec<[f64; 3]>) {
    let diagonal = mesh.diagonal();
    let scale = if diagonal > 0.0 { diagonal } else { 1.0 };
    let mut of_vertex = VertexVec::filled([0.0; 3], mesh.positions.len());
    let of_face: FaceVec<[f64; 3]> = mesh
        .connectivity
        .faces()
        .map(|f| {
            let [a, b, c] = mesh.face_positions(f);
            let side = |p| sub(p, a).map(|x| x / scale);
            cross(side(b), side(c))
        })
        .collect();
    for (f, n) in of_face.enumerate() {
        for v in mesh.connectivity.face_vertices(f) {
            for i in 0..3 {
                of_vertex[v][i] += n[i];
            }
        }
    }
    (of_vertex, of_face)
}
