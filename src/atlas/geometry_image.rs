//! Geometry images: the surface sampled over each patch.
//!
//! *Enters:* surface, patches, log scale. *Leaves:* one image a patch.
//!
//! *Guaranteed:* every texel whose centre lies in the closed patch is covered and holds the surface
//! point there: the faces are rasterised one by one, positions are interpolated on the face in `f64`
//! and rounded once. A centre on an edge belongs to the lower face. Outside, every channel is that of
//! the nearest covered texel (of several the one further left, then further up), so no value is ever
//! missing. Attributes of the source come in a second pass (`attributes`). The same for any number of threads.

mod attributes;
mod channels;
mod dilation;
mod image;
mod interpolation;
mod packed;

pub use attributes::{SourceSurface, sample_attributes};
pub use channels::{Channel, ImageParams, Precision};
pub(crate) use dilation::nearest_sources;
pub use image::{GeometryImage, Sampled, Values};
pub use packed::pack_images;

use crate::atlas::patch::{Patch, PatchLayout};
use crate::atlas::raster::cover;
use crate::geometry::frame::Frame;
use crate::geometry::ids::{FaceId, NONE, VertexVec};
use crate::geometry::mesh::{
    AttributeKind, CornerAttribute, Mesh, bounding_box, cross, distance, norm, sub,
};
use crate::parallel;
use interpolation::unit;
pub(crate) use interpolation::{in_texels, mix};

/// A model farther from the origin than this many diagonals of its bounding box gets an image origin.
const FAR_DIAGONALS: f64 = 10.0;

/// What is subtracted from positions before they are rounded to `f32`, in source units: zero, but the
/// middle of the bounding box (rounded to `f32`) where that lies more than ten diagonals from the origin. The mesh is in `frame`.
pub fn image_origin(mesh: &Mesh, frame: &Frame) -> [f64; 3] {
    let (low, high) = bounding_box(mesh.positions.as_slice());
    let middle = frame.leave(std::array::from_fn(|i| low[i] + 0.5 * (high[i] - low[i])));
    if norm(middle) > FAR_DIAGONALS * frame.length(distance(low, high)) {
        middle.map(|x| f64::from(x as f32))
    } else {
        [0.0; 3]
    }
}

/// Samples every patch of a layout of this mesh; `log_scale` is a number a vertex, `origin` what is
/// subtracted from positions ([`image_origin`]).
///
/// Normals are the source's where it has them, else those of the vertices, weighted by area.
pub fn sample(
    mesh: &Mesh,
    layout: &PatchLayout,
    log_scale: &VertexVec<f64>,
    origin: [f64; 3],
) -> Vec<GeometryImage> {
    let mut faces: Vec<Vec<FaceId>> = vec![Vec::new(); layout.patches.len()];
    for (f, &p) in layout.face_patch.enumerate() {
        faces[p.index()].push(f);
    }
    let size = mesh.diagonal().max(f64::MIN_POSITIVE);
    let surface = Surface {
        mesh,
        log_scale,
        origin,
        size,
        vertex_normal: vertex_normals(mesh, size),
        source_normal: mesh
            .attributes
            .iter()
            .find(|a| a.kind == AttributeKind::Normal && a.components == 3),
    };
    parallel::map(&layout.patches, |i, patch| {
        sample_patch(&surface, layout, patch, &faces[i])
    })
}

struct Surface<'a> {
    mesh: &'a Mesh,
    log_scale: &'a VertexVec<f64>,
    origin: [f64; 3],
    size: f64,
    vertex_normal: VertexVec<[f64; 3]>,
    source_normal: Option<&'a CornerAttribute>,
}

/// A face with everything that is interpolated on it.
struct Corners {
    position: [[f64; 3]; 3],
    normal: [[f64; 3]; 3],
    log_scale: [f64; 3],
    /// For texels where the interpolated normal vanishes.
    face_normal: [f64; 3],
}

impl Surface<'_> {
    fn corners(&self, f: FaceId) -> Corners {
        let vertices = self.mesh.connectivity.face_vertices(f);
        let p = self.mesh.face_positions(f);
        let source = |k: usize| {
            let n = self.source_normal?.corner(f.index(), k);
            let n: [f64; 3] = std::array::from_fn(|i| f64::from(n[i]));
            let length = norm(n);
            (length.is_finite() && length > 0.0).then(|| n.map(|x| x / length))
        };
        Corners {
            position: p.map(|p| sub(p, self.origin)),
            normal: std::array::from_fn(|k| source(k).unwrap_or(self.vertex_normal[vertices[k]])),
            log_scale: vertices.map(|v| self.log_scale[v]),
            face_normal: unit(face_normal(p, self.size)).unwrap_or([0.0, 0.0, 1.0]),
        }
    }
}

/// Normal of a triangle whose corners are measured in units of the model's `size`, so that products
/// neither underflow nor overflow; as long as twice the area.
fn face_normal(p: [[f64; 3]; 3], size: f64) -> [f64; 3] {
    let side = |k: usize| sub(p[k], p[0]).map(|x| x / size);
    cross(side(1), side(2))
}

/// Unit normals of the vertices, weighted by the areas of their faces.
fn vertex_normals(mesh: &Mesh, size: f64) -> VertexVec<[f64; 3]> {
    let c = &mesh.connectivity;
    let mut sum = VertexVec::filled([0.0; 3], c.vertex_count());
    for f in c.faces() {
        let n = face_normal(mesh.face_positions(f), size);
        for v in c.face_vertices(f) {
            for i in 0..3 {
                sum[v][i] += n[i];
            }
        }
    }
    sum.iter()
        .map(|&n| unit(n).unwrap_or([0.0, 0.0, 1.0]))
        .collect()
}

fn sample_patch(
    surface: &Surface,
    layout: &PatchLayout,
    patch: &Patch,
    faces: &[FaceId],
) -> GeometryImage {
    let (width, height) = (patch.width, patch.height);
    let count = width * height;
    let mut image = GeometryImage {
        width,
        height,
        position: vec![[0.0; 3]; count],
        alpha: vec![0.0; count],
        normal: vec![[0.0, 0.0, 1.0]; count],
        face: vec![NONE; count],
        log_scale: vec![0.0; count],
        attributes: Vec::new(),
    };
    let texels = |f: FaceId| layout.uv[f].map(|p| in_texels(patch, p));
    for &f in faces {
        let corners = surface.corners(f);
        cover(texels(f), width, height, |column, row, weights| {
            let at = width * row + column;
            // Faces come in ascending order: the first one stays.
            if image.alpha[at] == 0.0 {
                image.alpha[at] = 1.0;
                image.set(at, f, &corners, weights);
            }
        });
    }
    let mut sources: Vec<bool> = image.alpha.iter().map(|&a| a > 0.0).collect();
    if !sources.contains(&true)
        && let Some(&f) = faces.first()
    {
        // A patch without area covers no centre: its middle stands for it, unmasked.
        let t = texels(f);
        let middle: [f64; 2] = std::array::from_fn(|i| (t[0][i] + t[1][i] + t[2][i]) / 3.0);
        let column = (middle[0].max(0.0) as usize).min(width.saturating_sub(1));
        let row = (middle[1].max(0.0) as usize).min(height.saturating_sub(1));
        let at = width * row + column;
        image.set(at, f, &surface.corners(f), [1.0 / 3.0; 3]);
        sources[at] = true;
    }
    image.dilate(&sources);
    image
}

impl GeometryImage {
    fn set(&mut self, at: usize, f: FaceId, corners: &Corners, weights: [f64; 3]) {
        let normal = mix(&corners.normal, weights);
        self.position[at] = mix(&corners.position, weights).map(|x| x as f32);
        // A mean of unit normals: its square neither overflows nor, where it is of any use, underflows.
        let square: f64 = normal.iter().map(|x| x * x).sum();
        let normal = if square > f64::MIN_POSITIVE {
            let length = square.sqrt();
            normal.map(|x| x / length)
        } else {
            corners.face_normal
        };
        self.normal[at] = normal.map(|x| x as f32);
        self.face[at] = f.raw();
        self.log_scale[at] = mix(&corners.log_scale.map(|s| [s]), weights)[0] as f32;
    }

    /// Copies every channel but alpha from the nearest source to all other texels.
    fn dilate(&mut self, sources: &[bool]) {
        let nearest = nearest_sources(sources, self.width);
        for (at, &from) in nearest.iter().enumerate() {
            if from != at {
                self.position[at] = self.position[from];
                self.normal[at] = self.normal[from];
                self.face[at] = self.face[from];
                self.log_scale[at] = self.log_scale[from];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::patches::samples::{self, Sample};
    use crate::atlas::patches::{PatchParams, layout};

    fn sampled(sample: &Sample) -> (PatchLayout, Vec<GeometryImage>) {
        let layout = layout(
            &sample.mesh,
            &sample.length,
            &sample.cut,
            &sample.development,
            None,
            &PatchParams::default(),
        )
        .unwrap();
        let origin = image_origin(&sample.mesh, &Frame::default());
        let images = super::sample(&sample.mesh, &layout, &sample.log_scale, origin);
        (layout, images)
    }

    #[test]
    fn far_models_get_an_origin_that_f32_holds() {
        let mut sample = samples::square(4);
        assert_eq!(image_origin(&sample.mesh, &Frame::default()), [0.0; 3]);
        for p in sample.mesh.positions.as_mut_slice() {
            p[0] += 123456.789;
        }
        let origin = image_origin(&sample.mesh, &Frame::default());
        assert!((origin[0] - 123457.289).abs() < 0.01);
        assert!(origin.iter().all(|&x| f64::from(x as f32) == x));
        let (_, images) = sampled(&sample);
        let far = images[0].position.iter().flatten().map(|x| x.abs());
        assert!(far.fold(0.0, f32::max) < 2.0);
    }

    #[test]
    fn source_normals_are_used_where_there_are_any() {
        let mut sample = samples::square(4);
        let faces = sample.mesh.connectivity.face_count();
        let mut values = [3.0f32, 0.0, 4.0].repeat(3 * faces);
        values[..9].fill(f32::NAN);
        sample.mesh.attributes.push(CornerAttribute {
            kind: AttributeKind::Normal,
            components: 3,
            values,
        });
        let (_, images) = sampled(&sample);
        for (n, &f) in images[0].normal.iter().zip(&images[0].face) {
            let expected = if f == 0 {
                [0.0, 0.0, 1.0]
            } else {
                [0.6, 0.0, 0.8]
            };
            assert!((0..3).all(|i| (n[i] - expected[i]).abs() < 1e-6));
        }
    }

    #[test]
    fn log_scale_is_interpolated() {
        let mut sample = samples::square(5);
        let positions = sample.mesh.positions.clone();
        sample.log_scale = positions.iter().map(|p| 2.0 * p[0] - p[1]).collect();
        let (_, images) = sampled(&sample);
        for (p, &s) in images[0].position.iter().zip(&images[0].log_scale) {
            assert!((2.0 * p[0] - p[1] - s).abs() < 1e-5);
        }
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let sample = samples::ramp(60, 6, 6.0);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| sampled(&sample).1)
        };
        let (one, three) = (run(1), run(3));
        assert!(one.len() > 1);
        assert!(one == three);
    }

    /// Point location in a constrained Delaunay triangulation knows nothing of rasters: it must find the
    /// same face for every texel, and the same point of the surface.
    #[test]
    fn point_location_in_a_triangulation_agrees() {
        use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
        let s = samples::ramp(14, 5, 3.0);
        let params = PatchParams {
            texel_budget: 10_000,
            ..PatchParams::default()
        };
        let layout = layout(&s.mesh, &s.length, &s.cut, &s.development, None, &params).unwrap();
        let images = sample(&s.mesh, &layout, &s.log_scale, [0.0; 3]);
        let c = &s.mesh.connectivity;
        let mut located = 0;
        for (p, (patch, image)) in layout.patches.iter().zip(&images).enumerate() {
            let faces: Vec<FaceId> = c
                .faces()
                .filter(|&f| layout.face_patch[f].index() == p)
                .collect();
            let mut plane = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
            let mut corners = std::collections::HashMap::new();
            for &f in &faces {
                let ends = layout.uv[f].map(|q| plane.insert(Point2::new(q[0], q[1])).unwrap());
                let mut key = ends.map(|v| v.index());
                key.sort_unstable();
                corners.insert(key, f);
                for k in 0..3 {
                    plane.add_constraint(ends[k], ends[(k + 1) % 3]);
                }
            }
            for (at, &alpha) in image.alpha.iter().enumerate() {
                let texel = [at % image.width, at / image.width].map(|x| x as f64 + 0.5);
                let q = patch
                    .texel_to_patch
                    .map(|r| r[0] * texel[0] + r[1] * texel[1] + r[2]);
                let spade::PositionInTriangulation::OnFace(face) =
                    plane.locate(Point2::new(q[0], q[1]))
                else {
                    continue;
                };
                let triangle = plane.face(face);
                let mut key = triangle.vertices().map(|v| v.fix().index());
                key.sort_unstable();
                let found = corners.get(&key);
                assert_eq!(alpha == 1.0, found.is_some(), "patch {p}, texel {at}");
                let Some(&f) = found else { continue };
                assert_eq!(image.face[at], f.raw());
                let weights = triangle.barycentric_interpolation(Point2::new(q[0], q[1]));
                for i in 0..3 {
                    let want: f64 = triangle
                        .vertices()
                        .iter()
                        .zip(weights)
                        .map(|(v, w)| {
                            let position = v.position();
                            let k = layout.uv[f]
                                .iter()
                                .position(|uv| *uv == [position.x, position.y])
                                .unwrap();
                            w * s.mesh.face_positions(f)[k][i]
                        })
                        .sum();
                    assert!((f64::from(image.position[at][i]) - want).abs() < 1e-5);
                }
                located += 1;
            }
        }
        assert!(located > 1000, "{located}");
    }
}
