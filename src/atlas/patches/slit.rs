//! The slit disk as the patches see it: who is next to whom without crossing the cut, how large each
//! face is in space and in the flat metric, and where it lies in the plane.
//!
//! Central coordinates resolve about 1e-16 of the chart's diameter, and a chart can span a scale
//! range of e⁴⁰. So there are two ways to place faces: *central*, the development as it is, and
//! *own*, developed from the flat lengths around one face. The second is taken where the first
//! would be too coarse ([`Slit::is_deep`]).

use crate::atlas::cut::CutGraph;
use crate::atlas::develop::{Development, Unfolded};
use crate::atlas::overlay::Layout;
use crate::atlas::plane;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, HalfedgeId, HalfedgeVec, NONE, VertexVec};
use crate::geometry::mesh::{Mesh, distance, triangle_area};
use rayon::prelude::*;
use rustc_hash::{FxHashMap as Map, FxHashSet as Set};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A region whose expected extent is less than this part of the chart's diameter is placed in its own
/// frame. Central coordinates are good to about 1e-13 of the diameter after the development, hence
/// to 1e-10 of the region's extent where they are kept.
const DEEP: f64 = 1e-3;

/// The slit disk; see the module docs.
pub(super) struct Slit<'a> {
    /// Who touches whom.
    pub connectivity: &'a Connectivity,
    /// The source surface.
    pub mesh: &'a Mesh,
    /// The cut.
    pub cut: &'a CutGraph,
    /// The central chart.
    pub development: &'a Development,
    /// The layout under the surface and how it was slit, where the surface is finer.
    pub under: Option<(&'a Layout, &'a Unfolded)>,
    /// Flat length of every edge.
    pub length: &'a EdgeVec<f64>,
    /// Face on the other side of every halfedge where the slit disk goes on there, else `NONE`: asked for far more often than anything else.
    beside: HalfedgeVec<u32>,
    /// Central coordinates of every copy.
    pub central: Vec<[f64; 2]>,
    /// Area of every face in space.
    pub source_area: FaceVec<f64>,
    /// Area of every face in the flat metric.
    pub flat_area: FaceVec<f64>,
    /// Regional log scale of every face, see [`regional_log_scale`].
    pub log_scale: FaceVec<f64>,
    /// Diagonal of the central chart's bounding box.
    pub diameter: f64,
    /// Diagonal of the surface's bounding box.
    pub extent: f64,
}

impl<'a> Slit<'a> {
    pub fn new(
        mesh: &'a Mesh,
        length: &'a EdgeVec<f64>,
        cut: &'a CutGraph,
        development: &'a Development,
        under: Option<(&'a Layout, &'a Unfolded)>,
    ) -> Slit<'a> {
        let connectivity = &mesh.connectivity;
        let mut central = vec![[f64::NAN; 2]; development.copies];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for f in connectivity.faces() {
            for (k, h) in connectivity.face_halfedges(f).into_iter().enumerate() {
                let uv = development.uv[f][k];
                let place = &mut central[development.copy[h] as usize];
                if place[0].is_nan() {
                    *place = uv;
                }
                for i in 0..2 {
                    low[i] = low[i].min(uv[i]);
                    high[i] = high[i].max(uv[i]);
                }
            }
        }
        let faces = (0..connectivity.face_count()).into_par_iter();
        let source = |f| triangle_area(mesh.face_positions(FaceId::new(f)));
        let source_area: FaceVec<f64> = faces.clone().map(source).collect::<Vec<_>>().into();
        let flat = |f| flat_area(connectivity.face_edges(FaceId::new(f)).map(|e| length[e]));
        let flat_area: FaceVec<f64> = faces.map(flat).collect::<Vec<_>>().into();
        let log_scale = regional_log_scale(connectivity, &source_area, &flat_area);
        let halfedges = (0..connectivity.halfedge_count()).into_par_iter();
        let beside = halfedges.map(HalfedgeId::new).map(|h| {
            let twin = connectivity.twin(h);
            let twin = twin.filter(|_| !cut.is_cut[connectivity.edge(h)]);
            twin.map_or(NONE, |t| connectivity.face(t).raw())
        });
        Slit {
            beside: beside.collect::<Vec<_>>().into(),
            connectivity,
            mesh,
            cut,
            development,
            under: under.filter(|(layout, _)| layout.is_refined()),
            length,
            central,
            source_area,
            flat_area,
            log_scale,
            diameter: plane::distance(low, high),
            extent: mesh.diagonal(),
        }
    }

    /// The halfedge on the other side, where the slit disk goes on there.
    #[inline]
    pub fn across(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let t = self.connectivity.twin(h)?;
        (!self.cut.is_cut[self.connectivity.edge(h)]).then_some(t)
    }

    /// The faces next to a face on the slit disk.
    #[inline]
    pub fn neighbours(&self, f: FaceId) -> impl Iterator<Item = FaceId> + '_ {
        let sides = self.connectivity.face_halfedges(f);
        sides.into_iter().filter_map(|h| self.beside(h))
    }

    /// The face on the other side of a halfedge, where the slit disk goes on there.
    #[inline]
    pub fn beside(&self, h: HalfedgeId) -> Option<FaceId> {
        let f = self.beside[h];
        (f != NONE).then(|| FaceId::new(f as usize))
    }

    /// The copies at the corners of a face.
    #[inline]
    pub fn copies(&self, f: FaceId) -> [usize; 3] {
        self.connectivity
            .face_halfedges(f)
            .map(|h| self.development.copy[h] as usize)
    }

    /// Length of an edge in space.
    pub fn source_length(&self, h: HalfedgeId) -> f64 {
        let c = self.connectivity;
        distance(
            self.mesh.positions[c.tail(h)],
            self.mesh.positions[c.head(h)],
        )
    }

    /// What a region of this greatest log scale is expected to measure in the plane.
    pub fn expected_extent(&self, highest_log_scale: f64) -> f64 {
        (highest_log_scale.exp() * self.extent).min(self.diameter)
    }

    /// True where central coordinates are too coarse for a region of this greatest log scale.
    pub fn is_deep(&self, highest_log_scale: f64) -> bool {
        self.expected_extent(highest_log_scale) < DEEP * self.diameter
    }

    /// Develops the faces that `member` accepts and that are connected to `root`, around the middle of
    /// `root`'s first edge (or the one it lies on in the layout), and writes the coordinates of their copies.
    ///
    /// Where the surface is an overlay, what is developed are the layout's cells under these faces: an overlay has slivers.
    pub fn develop(
        &self,
        root: FaceId,
        member: impl Fn(FaceId) -> bool,
        positions: &mut [[f64; 2]],
    ) {
        let disk = Disk {
            connectivity: self.connectivity,
            length: self.length,
            cut: self.cut,
            copy: &self.development.copy,
        };
        let Some((layout, unfolded)) = self.under else {
            disk.develop(root, member, |copy, p| positions[copy as usize] = p);
            return;
        };
        let mut faces = vec![root];
        let mut listed = Set::from_iter([root]);
        let mut cells = Set::default();
        let mut next = 0;
        while let Some(&f) = faces.get(next) {
            next += 1;
            cells.insert(layout.cell_under(f));
            let found = self
                .neighbours(f)
                .filter(|&g| member(g) && listed.insert(g));
            faces.extend(found);
        }
        let under = Disk {
            connectivity: &layout.connectivity,
            length: &layout.length,
            cut: &unfolded.cut,
            copy: &unfolded.copy,
        };
        let root = layout.carrier(self.connectivity.corner_halfedge(root, 0));
        let mut placed = Map::default();
        under.develop(
            layout.connectivity.face(root.halfedge),
            |f| cells.contains(&layout.cell[f]),
            |copy, p| {
                placed.insert(copy, p);
            },
        );
        // Neighbouring faces of one patch lie in the same cell or in neighbouring ones, so every corner has been reached.
        let at = |g| placed.get(&unfolded.copy[g]).copied().unwrap_or([0.0; 2]);
        for f in faces {
            for h in self.connectivity.face_halfedges(f) {
                positions[self.development.copy[h] as usize] = layout.place(h, at);
            }
        }
    }

    /// Largest difference between a face's sides in the plane and its flat lengths, relative to its
    /// longest side.
    pub fn length_error(&self, faces: &[FaceId], positions: &[[f64; 2]]) -> f64 {
        let c = self.connectivity;
        faces.iter().fold(0.0, |worst: f64, &f| {
            let copies = self.copies(f);
            let lengths = c.face_halfedges(f).map(|h| self.length[c.edge(h)]);
            let longest = lengths.iter().fold(f64::MIN_POSITIVE, |m, &l| m.max(l));
            (0..3).fold(worst, |worst, k| {
                let d = plane::distance(positions[copies[k]], positions[copies[(k + 1) % 3]]);
                worst.max((d - lengths[k]).abs() / longest)
            })
        })
    }
}

/// Develops the whole disk from face 0 as a patch would be: the largest error of a side relative to the chart's diameter.
#[cfg(test)]
pub(crate) fn own_development_error(
    mesh: &Mesh,
    length: &EdgeVec<f64>,
    cut: &CutGraph,
    development: &Development,
    under: Option<(&Layout, &Unfolded)>,
) -> f64 {
    let slit = Slit::new(mesh, length, cut, development, under);
    let mut own = vec![[f64::NAN; 2]; development.copies];
    slit.develop(FaceId::new(0), |_| true, &mut own);
    let c = slit.connectivity;
    c.halfedges().fold(0.0, |worst: f64, h| {
        let [a, b] = [h, c.next(h)].map(|h| own[development.copy[h] as usize]);
        let error = (plane::distance(a, b) - length[c.edge(h)]).abs();
        assert!(error.is_finite());
        worst.max(error / slit.diameter)
    })
}

/// A triangulation slit along a cut, with its lengths.
struct Disk<'a> {
    connectivity: &'a Connectivity,
    length: &'a EdgeVec<f64>,
    cut: &'a CutGraph,
    copy: &'a HalfedgeVec<u32>,
}

impl Disk<'_> {
    /// Develops the faces that `member` accepts and that are connected to `root`; `put` is told every copy once. The longest
    /// edges are crossed first: an edge carries its direction further with an error in proportion to 1 / length.
    fn develop(
        &self,
        root: FaceId,
        member: impl Fn(FaceId) -> bool,
        mut put: impl FnMut(u32, [f64; 2]),
    ) {
        let c = self.connectivity;
        let mut placed: Map<u32, [f64; 2]> = Map::default();
        let mut visited = Set::from_iter([root]);
        let mut queue: BinaryHeap<(u64, Reverse<HalfedgeId>)> = BinaryHeap::new();
        // Non-negative floats compare like their bits.
        let key = |h: HalfedgeId| (self.length[c.edge(h)].to_bits(), Reverse(h));
        let mut place = |copy: u32, p: [f64; 2]| -> [f64; 2] {
            *placed.entry(copy).or_insert_with(|| {
                put(copy, p);
                p
            })
        };
        let copies = |f: FaceId| c.face_halfedges(f).map(|h| self.copy[h]);
        let first = c.corner_halfedge(root, 0);
        let [a, b, apex] = copies(root);
        let half = 0.5 * self.length[c.edge(first)];
        let (a, b) = (place(a, [-half, 0.0]), place(b, [half, 0.0]));
        let apex = place(apex, self.apex(first, a, b));
        let ends = [(a, b), (b, apex), (apex, a)];
        let mut between = Map::default();
        for (h, ends) in c.face_halfedges(root).into_iter().zip(ends) {
            between.insert(h, ends);
            queue.push(key(h));
        }
        while let Some((_, Reverse(h))) = queue.pop() {
            let Some((b, a)) = between.remove(&h) else {
                continue;
            };
            let Some(t) = c.twin(h).filter(|_| !self.cut.is_cut[c.edge(h)]) else {
                continue;
            };
            let f = c.face(t);
            if !member(f) || !visited.insert(f) {
                continue;
            }
            let apex = place(self.copy[c.prev(t)], self.apex(t, a, b));
            for (side, ends) in [(c.next(t), (b, apex)), (c.prev(t), (apex, a))] {
                between.insert(side, ends);
                queue.push(key(side));
            }
        }
    }

    /// Where the corner opposite to `h` lies, left of its ends `a` and `b`.
    fn apex(&self, h: HalfedgeId, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        let c = self.connectivity;
        let side = |h: HalfedgeId| self.length[c.edge(h)];
        apex(a, b, [side(h), side(c.next(h)), side(c.prev(h))])
    }
}

/// The third corner of a triangle, left of `a` and `b`, from the lengths ab, bc and ca.
fn apex(a: [f64; 2], b: [f64; 2], [l_ab, l_bc, l_ca]: [f64; 3]) -> [f64; 2] {
    let along = 0.5 * (l_ab + (l_ca - l_bc) * (l_ca + l_bc) / l_ab);
    let height = 2.0 * flat_area([l_ab, l_bc, l_ca]) / l_ab;
    let d = plane::distance(a, b);
    let unit = if d > 0.0 {
        [(b[0] - a[0]) / d, (b[1] - a[1]) / d]
    } else {
        [1.0, 0.0]
    };
    [
        a[0] + along * unit[0] - height * unit[1],
        a[1] + along * unit[1] + height * unit[0],
    ]
}

/// Area of a triangle from its sides, in any order, accurate for slivers (Kahan's arrangement of
/// Heron's formula); 0 where the triangle inequality fails.
pub(super) fn flat_area(mut l: [f64; 3]) -> f64 {
    l.sort_by(|a, b| b.total_cmp(a));
    let [a, b, c] = l;
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * product.max(0.0).sqrt()
}

/// ½ ln(flat area / source area), averaged over the stars of a face's corners with the source areas
/// as weights.
///
/// A single sliver can differ from its surroundings by any amount, whatever the metric, and would
/// shatter a patch without any use to the image: a texel sees an average anyway. The result is a
/// multiple of 2⁻²⁰, so that faces of one scale have one scale, whatever the last digits of the lengths.
pub(super) fn regional_log_scale(
    connectivity: &Connectivity,
    source_area: &FaceVec<f64>,
    flat_area: &FaceVec<f64>,
) -> FaceVec<f64> {
    const STEPS: f64 = (1u64 << 20) as f64;
    // (Σ area · log scale, Σ area) of every star.
    let mut star = VertexVec::filled((0.0, 0.0), connectivity.vertex_count());
    for f in connectivity.faces() {
        let (a, b) = (source_area[f], flat_area[f]);
        if a > 0.0 && b > 0.0 {
            for v in connectivity.face_vertices(f) {
                star[v].0 += a * 0.5 * (b / a).ln();
                star[v].1 += a;
            }
        }
    }
    connectivity
        .faces()
        .map(|f| {
            let known = connectivity
                .face_vertices(f)
                .into_iter()
                .map(|v| star[v])
                .filter(|s| s.1 > 0.0);
            let (sum, count) =
                known.fold((0.0, 0usize), |(s, n), (sum, area)| (s + sum / area, n + 1));
            let mean = if count == 0 { 0.0 } else { sum / count as f64 };
            (mean * STEPS).round() / STEPS
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_from_sides_agrees_with_known_triangles() {
        assert!((flat_area([3.0, 4.0, 5.0]) - 6.0).abs() < 1e-15);
        assert!((flat_area([1.0, 1.0, 1.0]) - 0.75f64.sqrt() / 2.0).abs() < 1e-15);
        // A needle: height 1e-9 over a base of 2 with equal sides.
        let side = (1.0f64 + 1e-12).sqrt();
        assert!((flat_area([2.0, side, side]) / 1e-6 - 1.0).abs() < 1e-3);
        assert_eq!(flat_area([1.0, 1.0, 3.0]), 0.0);
    }
}
