//! Patches divided where their parts hold the surface better with the same number of texels.
//!
//! *Enters:* patches, a budget of texels. *Leaves:* patches that fill their images better, vary less in scale, and meet along creases.
//!
//! What a patch costs is its error plus what its texels are worth, both by [`Demand`](super::demand::Demand) with the texel that makes the sum least. Costs add up, and a
//! division that lowers their sum lets all images together hold the surface better with as many texels: where the error falls with the square of their number,
//! the cube of the sum is what it comes to. So each division gains a number of decibels, and the best is made first, until none gains enough.
//!
//! Divisions that are tried: along creases, and by straight lines. Parts of what is injective and within the range of scale are so too; each is
//! kept a disk. *Not guaranteed:* the best of all divisions.

use super::demand::{self, Budget, Demand, Sums};
use super::rectangle::in_rectangle;
use super::segment::{Placement, Sets, centroid, place, rounded_ln, split_at_holes};
use super::slit::Slit;
use super::{Domain, PatchParams};
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId, NONE};
use crate::geometry::mesh::{Mesh, cross, norm, sub};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::VecDeque;

/// Decibels that each patch more must gain.
const LEAST_GAIN: f64 = 0.03;
/// Directions of lines, from that of the patch's rectangle on.
const DIRECTIONS: usize = 4;
/// Lines that are estimated in each direction; the ends of their strips meet no regular grid.
const LINES: usize = 40;
const OFFSET: f64 = 0.3719;
/// The best of them that are looked at closely.
const CANDIDATES: usize = 2;
/// Cosine of the dihedral angle of a crease.
const CREASE: f64 = 0.8;
/// A part smaller than this share of the patch goes to the other side of the line, or of the crease.
const CRUMB: f64 = 0.02;

/// A patch in parts.
struct Division {
    parts: Vec<Vec<FaceId>>,
    /// What they cost less.
    saved: f64,
}

struct Divider<'a> {
    sets: Sets<'a>,
    slit: &'a Slit<'a>,
    budget: Budget,
    /// Texels that an image has on its longer side at the least.
    min_side: f64,
    /// Areas of every face, and the bend of its edges, half of which belongs to the face on the other side.
    faces: FaceVec<Sums>,
    /// θ² L, and that over a.
    bend: EdgeVec<[f64; 2]>,
    /// Scratch space of [`Divider::by_creases`].
    label: FaceVec<u32>,
    is_crease: EdgeVec<bool>,
    /// Whether lines are tried: rectangles have lines of their own.
    with_lines: bool,
}

/// Divides patches; see the module docs. `own` is scratch space, a place a copy.
pub(super) fn divide(
    slit: &Slit,
    patches: Vec<Vec<FaceId>>,
    domain: Domain,
    params: &PatchParams,
    own: &mut [[f64; 2]],
) -> Vec<Vec<FaceId>> {
    let mut divider = Divider::new(slit, params);
    divider.with_lines = domain == Domain::Flat;
    let demands: Vec<Demand> = patches
        .iter()
        .map(|faces| {
            divider.placed(faces, own, |divider, placement| {
                divider.demand(faces, placement).0
            })
        })
        .collect();
    let least: Vec<f64> = demands.iter().map(|d| divider.coarsest(d)).collect();
    divider.budget = demand::budget(&demands, &least, params);
    let mut rows: Vec<(Vec<FaceId>, Option<Division>)> = Vec::new();
    let mut sum: f64 = demands.iter().map(|d| divider.cost(d)).sum();
    for faces in patches {
        let division = divider.best_division(&faces, own);
        rows.push((faces, division));
    }
    loop {
        let room = params.max_count.map(|most| most.saturating_sub(rows.len()));
        let fits = |d: &&Division| room.is_none_or(|room| d.parts.len() <= room + 1);
        let gain = |row: &(Vec<FaceId>, Option<Division>)| {
            let division = row.1.as_ref().filter(fits);
            division.map_or(0.0, |division| division.gain(sum))
        };
        // Rounded: the last digits must not decide.
        let best = (0..rows.len()).max_by_key(|&i| ((gain(&rows[i]) * 1e6) as i64, Reverse(i)));
        let Some(best) = best.filter(|&i| gain(&rows[i]) >= LEAST_GAIN) else {
            break;
        };
        let (_, division) = rows.swap_remove(best);
        let Some(division) = division else { break };
        sum -= division.saved;
        for faces in division.parts {
            let division = divider.best_division(&faces, own);
            rows.push((faces, division));
        }
    }
    let mut patches: Vec<Vec<FaceId>> = rows.into_iter().map(|row| row.0).collect();
    for patch in &mut patches {
        patch.sort();
    }
    patches.sort_by_key(|p| p.first().copied());
    patches
}

impl Division {
    /// Decibels for each patch more, where all patches together cost `sum`.
    fn gain(&self, sum: f64) -> f64 {
        let more = self.parts.len().saturating_sub(1).max(1);
        let then = (sum - self.saved).max(f64::MIN_POSITIVE);
        30.0 * (sum / then).log10() / more as f64
    }
}

/// θ² L and θ² L / a of every edge that is not cut, and whether it is a crease.
///
/// Faces that are parts of one face of the source lie in its plane however narrow they are, so that normals, and the distance a, are those of
/// source faces.
pub(crate) fn bends(
    mesh: &Mesh,
    area: &FaceVec<f64>,
    across: impl Fn(HalfedgeId) -> Option<HalfedgeId>,
) -> (EdgeVec<[f64; 2]>, EdgeVec<bool>) {
    let c = &mesh.connectivity;
    let source = &mesh.source_face;
    let extent = mesh.diagonal().max(f64::MIN_POSITIVE);
    let mut normals: FxHashMap<u32, ([f64; 3], f64)> = FxHashMap::default();
    for f in c.faces() {
        let p = mesh.face_positions(f);
        let side = |k: usize| sub(p[k], p[0]).map(|x| x / extent);
        let n = cross(side(1), side(2));
        let (sum, whole) = normals.entry(source[f]).or_default();
        (0..3).for_each(|i| sum[i] += n[i]);
        *whole += area[f];
    }
    let between = |e: EdgeId| {
        let h = c.edge_halfedge(e);
        let t = across(h)?;
        let (f, g) = (source[c.face(h)], source[c.face(t)]);
        (f != g).then(|| (f.min(g), f.max(g)))
    };
    let mut lengths: FxHashMap<(u32, u32), f64> = FxHashMap::default();
    for e in c.edges() {
        if let Some(pair) = between(e) {
            *lengths.entry(pair).or_default() += mesh.edge_length(e);
        }
    }
    let mut bend = EdgeVec::filled([0.0; 2], c.edge_count());
    let mut is_crease = EdgeVec::filled(false, c.edge_count());
    for e in c.edges() {
        let Some(pair) = between(e) else { continue };
        let ((n, of_n), (m, of_m)) = (normals[&pair.0], normals[&pair.1]);
        let cosine = (0..3).map(|i| n[i] * m[i]).sum::<f64>() / (norm(n) * norm(m));
        let crease = cosine.clamp(-1.0, 1.0).acos().powi(2) * mesh.edge_length(e);
        let apart = (of_n + of_m) / (3.0 * lengths[&pair]);
        if crease.is_finite() && apart > 0.0 && apart.is_finite() {
            bend[e] = [crease, crease / apart];
            is_crease[e] = cosine < CREASE;
        }
    }
    (bend, is_crease)
}

/// Areas and bend of patches.
pub(super) fn sums(slit: &Slit, patches: &[Vec<FaceId>], params: &PatchParams) -> Vec<Sums> {
    let mut divider = Divider::new(slit, params);
    patches.iter().map(|faces| divider.sums(faces)).collect()
}

impl<'a> Divider<'a> {
    fn new(slit: &'a Slit<'a>, params: &PatchParams) -> Self {
        let (bend, is_crease) = bends(slit.mesh, &slit.source_area, |h| slit.across(h));
        let faces = slit.connectivity.faces();
        let faces = faces.map(|f| of_face(slit, &bend, f, |_| true)).collect();
        Self {
            sets: Sets::new(slit),
            slit,
            budget: Budget::default(),
            min_side: params.min_side as f64,
            faces,
            bend,
            label: FaceVec::filled(NONE, slit.connectivity.face_count()),
            is_crease,
            with_lines: true,
        }
    }

    /// Calls with the coordinates of a patch.
    fn placed<T>(
        &mut self,
        faces: &[FaceId],
        own: &mut [[f64; 2]],
        then: impl FnOnce(&mut Self, &Placement) -> T,
    ) -> T {
        let slit = self.slit;
        let highest = faces.iter().map(|&f| slit.log_scale[f]);
        let highest = highest.fold(f64::NEG_INFINITY, f64::max);
        let root = faces.iter().copied().min().unwrap_or(FaceId::new(0));
        let stamp = self.sets.mark(faces);
        let member = |f: FaceId| self.sets.has(f, stamp);
        let placement = place(slit, faces.iter().copied(), root, highest, member, own);
        then(self, &placement)
    }

    /// How a patch is best divided.
    fn best_division(&mut self, faces: &[FaceId], own: &mut [[f64; 2]]) -> Option<Division> {
        self.placed(faces, own, |divider, placement| {
            let (demand, angle) = divider.demand(faces, placement);
            let now = divider.cost(&demand);
            let mut tried = vec![divider.by_creases(faces)];
            if divider.with_lines {
                tried.extend(divider.by_lines(faces, placement, angle));
            }
            let mut found: Vec<(i64, Division)> = Vec::new();
            for sides in tried {
                let division = divider.in_parts(sides, now, placement);
                found.extend(division.map(|division| {
                    let share = division.saved / now.max(f64::MIN_POSITIVE);
                    let more = division.parts.len() as f64 - 1.0;
                    (-(share / more * 1e9) as i64, division)
                }));
            }
            // Stable: of equals the first.
            found.sort_by_key(|f| f.0);
            let mut found = found.into_iter().map(|f| f.1);
            found.find(|division| {
                division.parts.iter().all(|faces| {
                    let positions = placement.positions;
                    let own = Placement::new(divider.slit, positions, faces.iter().copied());
                    own.is_injective(divider.slit, faces)
                })
            })
        })
    }

    /// The parts of several sides that are disks; `None` where there is one part only, or they cost more.
    fn in_parts(
        &mut self,
        sides: Vec<Vec<FaceId>>,
        now: f64,
        placement: &Placement,
    ) -> Option<Division> {
        let mut parts = Vec::new();
        for side in sides {
            for component in self.sets.components(&side) {
                split_at_holes(&mut self.sets, component, placement, &mut parts);
            }
        }
        if parts.len() < 2 {
            return None;
        }
        let mut saved = now;
        for faces in &parts {
            let own = Placement::new(self.slit, placement.positions, faces.iter().copied());
            let (demand, _) = self.demand(faces, &own);
            saved -= self.cost(&demand);
            if saved <= 0.0 {
                return None;
            }
        }
        Some(Division { parts, saved })
    }

    /// Areas and bend of a patch.
    fn sums(&mut self, faces: &[FaceId]) -> Sums {
        let slit = self.slit;
        let stamp = self.sets.mark(faces);
        let mut sums = Sums::default();
        for &f in faces {
            let inner = |h: &HalfedgeId| {
                let other = slit.across(*h).map(|t| slit.connectivity.face(t));
                other.is_some_and(|g| self.sets.has(g, stamp))
            };
            sums = sums.and(of_face(slit, &self.bend, f, inner));
        }
        sums
    }

    /// What a patch asks for, and the direction of its rectangle.
    fn demand(&mut self, faces: &[FaceId], placement: &Placement) -> (Demand, f64) {
        let sums = self.sums(faces);
        let slit = self.slit;
        let corners: Vec<_> = faces.iter().map(|&f| placement.triangle(slit, f)).collect();
        let rectangle = in_rectangle(&corners, sums.flat);
        let width = rectangle.to_chart.scale;
        let sides = [width, width * rectangle.height];
        (Demand { sums, sides }, rectangle.to_chart.rotation)
    }

    /// The widest texel that an image may have.
    fn coarsest(&self, demand: &Demand) -> f64 {
        demand.sides[0].max(demand.sides[1]) / self.min_side
    }

    /// Error and texels, as if they were one.
    fn cost(&self, demand: &Demand) -> f64 {
        let texel = demand.texel(&self.budget).min(self.coarsest(demand));
        let cost =
            demand.error(texel) + self.budget.worth * demand.texels(texel, self.budget.margin);
        // A patch without extent has no texel.
        if cost.is_finite() { cost } else { 0.0 }
    }

    /// Parts between creases; crumbs belong to the part that is fewest faces away. None where creases enclose nothing large.
    fn by_creases(&mut self, faces: &[FaceId]) -> Vec<Vec<FaceId>> {
        let slit = self.slit;
        let c = slit.connectivity;
        let stamp = self.sets.mark(faces);
        let beside = |sets: &Sets, f: FaceId| {
            c.face_halfedges(f).map(|h| {
                let g = slit.across(h).map(|t| c.face(t));
                g.filter(|&g| sets.has(g, stamp)).map(|g| (g, c.edge(h)))
            })
        };
        let mut parts: Vec<(Vec<FaceId>, f64)> = Vec::new();
        faces.iter().for_each(|&f| self.label[f] = NONE);
        for &first in faces {
            if self.label[first] != NONE {
                continue;
            }
            self.label[first] = 0;
            let (mut part, mut area) = (vec![first], 0.0);
            let mut next = 0;
            while let Some(&f) = part.get(next) {
                next += 1;
                area += slit.source_area[f];
                for (g, e) in beside(&self.sets, f).into_iter().flatten() {
                    if !self.is_crease[e] && self.label[g] == NONE {
                        self.label[g] = 0;
                        part.push(g);
                    }
                }
            }
            parts.push((part, area));
        }
        let least = CRUMB * parts.iter().map(|part| part.1).sum::<f64>();
        parts.retain(|part| part.1 >= least);
        if parts.len() < 2 {
            return Vec::new();
        }
        faces.iter().for_each(|&f| self.label[f] = NONE);
        let mut queue: VecDeque<FaceId> = VecDeque::new();
        for (own, (part, _)) in (0u32..).zip(&parts) {
            part.iter().for_each(|&f| self.label[f] = own);
            queue.extend(part);
        }
        while let Some(f) = queue.pop_front() {
            for (g, _) in beside(&self.sets, f).into_iter().flatten() {
                if self.label[g] == NONE {
                    self.label[g] = self.label[f];
                    queue.push_back(g);
                }
            }
        }
        // In the order given, as all sets of faces are.
        let mut sides = vec![Vec::new(); parts.len()];
        for &f in faces {
            if let Some(side) = sides.get_mut(self.label[f] as usize) {
                side.push(f);
            }
        }
        sides
    }

    /// The sides of the lines that promise most, by the rectangles in their direction.
    fn by_lines(
        &mut self,
        faces: &[FaceId],
        placement: &Placement,
        angle: f64,
    ) -> Vec<Vec<Vec<FaceId>>> {
        let slit = self.slit;
        let mut promised: Vec<(i64, usize, usize)> = Vec::new();
        let mut strips: Vec<Vec<u8>> = Vec::new();
        for direction in 0..DIRECTIONS {
            let angle = angle + std::f64::consts::PI * direction as f64 / DIRECTIONS as f64;
            let axis = [angle.cos(), angle.sin()];
            let along = |p: [f64; 2]| {
                [
                    axis[0] * p[0] + axis[1] * p[1],
                    axis[0] * p[1] - axis[1] * p[0],
                ]
            };
            let mut range = Extent::default();
            for copy in faces.iter().flat_map(|&f| slit.copies(f)) {
                range.add(along(placement.positions[copy]));
            }
            let (low, length) = (range.low[0], range.high[0] - range.low[0]);
            let mut strip = Vec::with_capacity(faces.len());
            let mut rows = vec![(Sums::default(), Extent::default()); LINES + 1];
            for &f in faces {
                let t = placement.triangle(slit, f).map(along);
                let at = (centroid(&t)[0] - low) / length.max(f64::MIN_POSITIVE);
                let at = (at * (LINES as f64 + OFFSET)).clamp(0.0, LINES as f64) as usize;
                strip.push(at as u8);
                rows[at].0 = rows[at].0.and(self.faces[f]);
                t.into_iter().for_each(|p| rows[at].1.add(p));
            }
            let below = self.running(rows.iter());
            let above = self.running(rows.iter().rev());
            for line in 1..=LINES {
                let (one, other) = (below[line - 1], above[LINES - line]);
                if one > 0.0 && other > 0.0 {
                    promised.push((rounded_ln(one + other), direction, line));
                }
            }
            strips.push(strip);
        }
        promised.sort_unstable();
        // One a direction: its neighbours are much the same.
        let mut seen = [false; DIRECTIONS];
        promised.retain(|&(_, direction, _)| !std::mem::replace(&mut seen[direction], true));
        promised.truncate(CANDIDATES);
        let sides = promised.into_iter().map(|(_, direction, line)| {
            let is_below = strips[direction].iter().map(|&s| usize::from(s) < line);
            let is_below: Vec<bool> = is_below.collect();
            self.without_crumbs(faces, &is_below)
        });
        sides.collect()
    }

    /// Cost of the rows so far, for every number of rows.
    fn running<'r>(&self, rows: impl Iterator<Item = &'r (Sums, Extent)>) -> Vec<f64> {
        let (mut sums, mut extent) = (Sums::default(), Extent::default());
        rows.map(|row| {
            sums = sums.and(row.0);
            extent.low = [0, 1].map(|i| extent.low[i].min(row.1.low[i]));
            extent.high = [0, 1].map(|i| extent.high[i].max(row.1.high[i]));
            let sides = [0, 1].map(|i| (extent.high[i] - extent.low[i]).max(0.0));
            self.cost(&Demand { sums, sides })
        })
        .collect()
    }

    /// Faces on the two sides, small pieces on the side that surrounds them.
    fn without_crumbs(&mut self, faces: &[FaceId], is_below: &[bool]) -> Vec<Vec<FaceId>> {
        let slit = self.slit;
        let area = |part: &[FaceId]| part.iter().map(|&f| slit.source_area[f]).sum::<f64>();
        let least = CRUMB * area(faces);
        let mut sides = [Vec::new(), Vec::new()];
        for side in [false, true] {
            let own = faces.iter().zip(is_below).filter(|row| *row.1 == side);
            let own: Vec<FaceId> = own.map(|row| *row.0).collect();
            for component in self.sets.components(&own) {
                let to = side != (area(&component) < least);
                sides[usize::from(to)].extend(component);
            }
        }
        sides.into()
    }
}

/// Areas of a face, and the bend of those of its edges that count.
fn of_face(
    slit: &Slit,
    bends: &EdgeVec<[f64; 2]>,
    f: FaceId,
    counts: impl Fn(&HalfedgeId) -> bool,
) -> Sums {
    let shrunk = (-slit.log_scale[f]).exp();
    let mut bend = [0.0; 2];
    for h in slit.connectivity.face_halfedges(f) {
        if counts(&h) {
            // Half of it belongs to the face on the other side.
            let [crease, bent] = bends[slit.connectivity.edge(h)];
            bend[0] += 0.5 * crease * shrunk.powi(3);
            bend[1] += 0.5 * bent * shrunk.powi(4);
        }
    }
    Sums {
        area: slit.source_area[f],
        flat: slit.flat_area[f],
        bend,
    }
}

/// Least and greatest coordinates.
#[derive(Clone, Copy)]
struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Default for Extent {
    fn default() -> Self {
        Self {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }
}

impl Extent {
    fn add(&mut self, p: [f64; 2]) {
        self.low = [0, 1].map(|i| self.low[i].min(p[i]));
        self.high = [0, 1].map(|i| self.high[i].max(p[i]));
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{Sample, ramp, strip};
    use super::super::{Domain, PatchLayout, PatchParams, layout};
    use crate::atlas::geometry_image::{image_origin, sample};
    use crate::geometry::deviation::{Sampling, Triangles, deviation};
    use crate::rebuild::{Images, rebuild};
    use std::collections::BTreeSet;

    fn laid_out(s: &Sample, domain: Domain) -> PatchLayout {
        let params = PatchParams {
            texel_budget: 64 * 64,
            min_side: 8,
            ..PatchParams::default()
        };
        let development = &s.development;
        layout(
            &s.mesh,
            &s.length,
            &s.cut,
            development,
            None,
            domain,
            &params,
        )
        .unwrap()
    }

    #[test]
    fn patches_meet_along_a_crease() {
        let s = strip(
            24,
            10,
            |s, t| [(s - 0.5).abs(), t, s],
            |s, t| [std::f64::consts::SQRT_2 * s, t],
            [0.0; 2],
        );
        let layout = laid_out(&s, Domain::Flat);
        let side = |f| s.mesh.face_positions(f).iter().all(|p| p[2] <= 0.5 + 1e-9);
        let patches = s.mesh.connectivity.faces();
        let pairs: BTreeSet<_> = patches.map(|f| (side(f), layout.face_patch[f])).collect();
        assert_eq!(layout.patches.len(), 2);
        assert_eq!(pairs.len(), 2, "{pairs:?}");
        assert_eq!(laid_out(&s, Domain::Rectangle).patches.len(), 1);
    }

    /// What is promised, against the error of the mesh that is made of the images.
    #[test]
    fn parts_hold_the_surface_better_with_as_many_texels() {
        let mut bumpy = ramp(60, 40, 1.8);
        for v in bumpy.mesh.connectivity.vertices() {
            let p: &mut [f64; 3] = &mut bumpy.mesh.positions[v];
            p[2] = 0.05 * (9.0 * p[0]).sin() * (8.0 * p[1]).cos();
        }
        let measure = |domain| {
            let layout = laid_out(&bumpy, domain);
            let origin = image_origin(&bumpy.mesh);
            let images = sample(&bumpy.mesh, &layout, &bumpy.log_scale, origin);
            let texels: usize = images.iter().map(|i| i.width * i.height).sum();
            let made = rebuild(&Images::new(&layout, &images, origin)).unwrap();
            let faces = bumpy.mesh.connectivity.to_faces();
            let given = Triangles {
                positions: bumpy.mesh.positions.as_slice(),
                faces: &faces,
            };
            let made = Triangles {
                positions: &made.positions,
                faces: &made.faces,
            };
            let sampling = Sampling {
                samples: 20_000,
                vertices: 0,
            };
            let found = deviation(given, made, sampling).unwrap();
            (layout.patches.len(), texels as f64, found.rms)
        };
        let (one, two) = (measure(Domain::Rectangle), measure(Domain::Flat));
        assert!(one.0 < two.0, "{one:?} {two:?}");
        assert!(two.1 <= 1.05 * one.1, "{one:?} {two:?}");
        assert!(two.2 < 0.8 * one.2, "{one:?} {two:?}");
    }
}
