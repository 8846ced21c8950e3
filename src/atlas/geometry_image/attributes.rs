//! Attributes of the source, sampled at the texels of finished images.
//!
//! *Enters:* the surface as repair left it, and the images of the surface that the atlas is defined on. *Leaves:* the same images with
//! [`GeometryImage::attributes`].
//!
//! *Guaranteed:* every texel inside the patch holds the barycentric interpolation, at its own point, of the corner values of the *source's*
//! face, in `f64`, rounded once. Faces of the atlas are smaller, and what they hold at their corners has been rounded on the way. Normals
//! are made unit vectors after interpolation; where repair turned a face over they point to its new side. Where the source has
//! no value: the surface's normal, white, texture coordinates 0, as in `surface.glb`. Outside the patch values are dilated like
//! the other channels.

use super::channels::{Channel, ImageParams};
use super::dilation::nearest_sources;
use super::image::{GeometryImage, Sampled, Values};
use super::interpolation::{in_texels, mix, unit};
use crate::atlas::patch::{Patch, PatchLayout};
use crate::atlas::raster::cover;
use crate::geometry::ids::{FaceId, NONE, VertexVec};
use crate::geometry::mesh::{CornerAttribute, Mesh, cross, sub};
use rayon::prelude::*;

/// The surface as it came out of repair, where its faces are the source's own (or parts of these), with what is to be sampled on it.
#[derive(Clone, Debug)]
pub struct SourceSurface {
    positions: VertexVec<[f64; 3]>,
    faces: Vec<[usize; 3]>,
    attributes: Vec<(Channel, CornerAttribute)>,
    with_materials: bool,
    /// Rows of `faces` by their face of the file.
    by_source: Vec<(u32, usize)>,
}

impl SourceSurface {
    /// What the images need of a repaired surface; nothing where they hold no attributes.
    #[must_use]
    pub fn of(mesh: &Mesh, params: &ImageParams) -> Option<Self> {
        let attributes: Vec<(Channel, CornerAttribute)> = params
            .channels
            .iter()
            .filter_map(|&channel| Some((channel, channel.attribute(&mesh.attributes)?.clone())))
            .collect();
        let with_materials = params.channels.contains(&Channel::Material);
        if attributes.is_empty() && !with_materials {
            return None;
        }
        let c = &mesh.connectivity;
        let mut by_source: Vec<(u32, usize)> = (mesh.source_face.enumerate())
            .map(|(f, &source)| (source, f.index()))
            .collect();
        by_source.sort_unstable();
        Some(Self {
            positions: mesh.positions.clone(),
            faces: c
                .faces()
                .map(|f| c.face_vertices(f).map(|v| v.index()))
                .collect(),
            attributes,
            with_materials,
            by_source,
        })
    }

    /// The rows that a face of the file became: one, but for slivers and doubled edges that were split.
    fn rows(&self, source: u32) -> &[(u32, usize)] {
        let from = self.by_source.partition_point(|row| row.0 < source);
        let to = self.by_source.partition_point(|row| row.0 <= source);
        &self.by_source[from..to]
    }

    /// The row of a face of the file that holds a point, and the point's barycentric coordinates there.
    fn locate(&self, source: u32, p: [f64; 3]) -> Option<(usize, [f64; 3])> {
        let placed = self.rows(source).iter().map(|&(_, row)| {
            let at = |k: usize| self.positions.as_slice()[self.faces[row][k]];
            let weights = barycentric([at(0), at(1), at(2)], p);
            let inside = weights.into_iter().fold(f64::INFINITY, f64::min);
            (row, weights, inside)
        });
        let best = placed.max_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((best.0, into_triangle(best.1)))
    }
}

/// Barycentric coordinates of the point of a triangle's plane nearest to `p`, with sum 1; those of the middle where the triangle has no area.
fn barycentric(t: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let side = [sub(t[1], t[0]), sub(t[2], t[0])];
    // In units of the triangle, so that products neither underflow nor overflow.
    let size = (side.iter().flatten()).fold(0.0, |most: f64, x| most.max(x.abs()));
    let scaled = |v: [f64; 3]| v.map(|x| x / size);
    let [a, b, q] = [side[0], side[1], sub(p, t[0])].map(scaled);
    let n = cross(a, b);
    let area = dot(n, n);
    let (v, w) = (dot(cross(q, b), n) / area, dot(cross(a, q), n) / area);
    match v.is_finite() && w.is_finite() {
        true => [1.0 - v - w, v, w],
        false => [1.0 / 3.0; 3],
    }
}

/// What rounding put outside of the triangle comes back to its border.
fn into_triangle(weights: [f64; 3]) -> [f64; 3] {
    let weights = weights.map(|w| w.clamp(0.0, 1.0));
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

/// The images of a layout of this mesh, as [`super::sample`] gives them, with the attributes of a source.
#[must_use]
pub fn sample_attributes(
    mesh: &Mesh,
    layout: &PatchLayout,
    images: Vec<GeometryImage>,
    source: &SourceSurface,
) -> Vec<GeometryImage> {
    let mut faces: Vec<Vec<FaceId>> = vec![Vec::new(); layout.patches.len()];
    for (f, &p) in layout.face_patch.enumerate() {
        faces[p.index()].push(f);
    }
    let patches = layout.patches.par_iter().zip(faces);
    let images = images.into_par_iter().zip(patches);
    let with_attributes = images.map(|(image, (patch, faces))| {
        let sampler = Sampler {
            mesh,
            layout,
            patch,
            faces: &faces,
            source,
        };
        let attributes = sampler.sample(&image);
        GeometryImage {
            attributes,
            ..image
        }
    });
    with_attributes.collect()
}

/// Everything that the attributes of one image depend on.
struct Sampler<'a> {
    mesh: &'a Mesh,
    layout: &'a PatchLayout,
    patch: &'a Patch,
    faces: &'a [FaceId],
    source: &'a SourceSurface,
}

impl Sampler<'_> {
    fn sample(&self, image: &GeometryImage) -> Vec<Sampled> {
        let texels = image.face.len();
        let attributes = &self.source.attributes;
        let mut layers: Vec<Vec<f32>> = (attributes.iter())
            .map(|(_, a)| vec![0.0; texels * a.components])
            .collect();
        let mut sources = vec![false; texels];
        let mut set = |at: usize, f: FaceId, weights: [f64; 3]| {
            let p = mix(&self.mesh.face_positions(f), weights);
            let place = self.source.locate(self.mesh.source_face[f], p);
            for ((channel, attribute), layer) in attributes.iter().zip(&mut layers) {
                let n = attribute.components;
                let value =
                    place.and_then(|(row, weights)| interpolate(*channel, attribute, row, weights));
                let row = &mut layer[n * at..n * (at + 1)];
                match (value, channel) {
                    (Some(value), _) => row.copy_from_slice(&value),
                    (None, Channel::SourceNormal) => row.copy_from_slice(&image.normal[at]),
                    (None, Channel::Color) => row.fill(1.0),
                    (None, _) => row.fill(0.0),
                }
            }
            sources[at] = true;
        };
        for &f in self.faces {
            let triangle = self.layout.uv[f].map(|p| in_texels(self.patch, p));
            cover(triangle, image.width, image.height, |x, y, weights| {
                let at = image.width * y + x;
                // The same face as for the position.
                if image.alpha[at] > 0.0 && image.face[at] == f.raw() {
                    set(at, f, weights);
                }
            });
        }
        if let (Some(&f), false) = (self.faces.first(), sources_are_there(image)) {
            // A patch without area: its middle stands for it, as for the position.
            (0..texels).for_each(|at| set(at, f, [1.0 / 3.0; 3]));
        }
        let nearest = nearest_sources(&sources, image.width);
        for ((_, attribute), layer) in attributes.iter().zip(&mut layers) {
            let n = attribute.components;
            for (at, &from) in nearest.iter().enumerate().filter(|(at, from)| at != *from) {
                layer.copy_within(n * from..n * (from + 1), n * at);
            }
        }
        let mut sampled: Vec<Sampled> = (attributes.iter().zip(layers))
            .map(|((channel, attribute), values)| Sampled {
                channel: *channel,
                values: Values::Numbers {
                    components: attribute.components,
                    values,
                },
            })
            .collect();
        if self.source.with_materials {
            // Faces are dilated already.
            let material = |&f: &u32| match f {
                NONE => NONE,
                f => self.mesh.face_material[FaceId::new(f as usize)],
            };
            sampled.push(Sampled {
                channel: Channel::Material,
                values: Values::Ids(image.face.iter().map(material).collect()),
            });
        }
        sampled
    }
}

/// Whether any texel lies inside the patch.
fn sources_are_there(image: &GeometryImage) -> bool {
    image.alpha.iter().any(|&a| a > 0.0)
}

/// The value at a point of a face; none where a corner has none, or where normals cancel.
fn interpolate(
    channel: Channel,
    attribute: &CornerAttribute,
    row: usize,
    weights: [f64; 3],
) -> Option<Vec<f32>> {
    let corner = |k: usize| attribute.corner(row, k);
    let value = |i: usize| -> f64 {
        let used = (0..3).filter(|&k| weights[k] != 0.0);
        used.map(|k| weights[k] * f64::from(corner(k)[i])).sum()
    };
    let mut sum: Vec<f64> = (0..attribute.components).map(value).collect();
    if channel == Channel::SourceNormal {
        sum = unit(std::array::from_fn(|i| sum.get(i).copied().unwrap_or(0.0)))?.to_vec();
    }
    let rounded: Vec<f32> = sum.into_iter().map(|x| x as f32).collect();
    rounded.iter().all(|x| x.is_finite()).then_some(rounded)
}

#[cfg(test)]
mod tests;
