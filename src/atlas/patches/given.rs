//! Patches that are the charts of coordinates made elsewhere.
//!
//! *Enters:* a surface and plane coordinates of its face corners. *Leaves:* a [`PatchLayout`] whose patches are the connected parts.
//!
//! This is how images over the atlases of other programs are made, with the same resolution, sampler and seams as our own, so that they can be
//! compared. Parts with holes are slit open, because a patch's border is one chain. *Not guaranteed:* that a patch is injective, or of any quality:
//! it is what was given.

use super::demand::Sums;
use super::params::{PatchError, PatchParams};
use super::places::with_images;
use super::rectangle::in_rectangle;
use super::seams::seams;
use crate::atlas::cut::slit_copies;
use crate::atlas::patch::PatchLayout;
use crate::atlas::plane::doubled_area;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, PatchId};
use crate::geometry::mesh::{Mesh, triangle_area};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Charts of plane coordinates, `uv` a corner of every face in any unit, v up: faces belong together across an edge at both of whose ends they agree
/// exactly. Charts that turn the surface over are mirrored.
///
/// # Errors
/// A parameter out of range, or a coordinate that is not finite.
pub fn charts_of(
    mesh: &Mesh,
    uv: &FaceVec<[[f64; 2]; 3]>,
    params: &PatchParams,
) -> Result<PatchLayout, PatchError> {
    params.validate()?;
    let c = &mesh.connectivity;
    for (f, corners) in uv.enumerate() {
        if let Some(&value) = corners.iter().flatten().find(|x| !x.is_finite()) {
            return Err(PatchError::NotFinite {
                face: f.raw(),
                value,
            });
        }
    }
    let mut parts = UnionFind::new(c.face_count());
    let mut is_cut = EdgeVec::filled(false, c.edge_count());
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else { continue };
        let corner = |h| uv[c.face(h)][c.corner(h)];
        if corner(h) == corner(c.next(t)) && corner(c.next(h)) == corner(t) {
            parts.join(c.face(h).index(), c.face(t).index());
        } else {
            is_cut[e] = true;
        }
    }
    let mut number = FaceVec::filled(None, c.face_count());
    let mut sets: Vec<Vec<FaceId>> = Vec::new();
    for f in c.faces() {
        let root = FaceId::new(parts.find(f.index()));
        let set = *number[root].get_or_insert_with(|| {
            sets.push(Vec::new());
            sets.len() - 1
        });
        sets[set].push(f);
    }
    let mut face_patch = FaceVec::filled(PatchId::new(0), c.face_count());
    let mut placed = FaceVec::filled([[0.0; 2]; 3], c.face_count());
    let mut oriented = Vec::with_capacity(sets.len());
    let mut sums = Vec::with_capacity(sets.len());
    for (i, faces) in sets.iter().enumerate() {
        let mut corners: Vec<[[f64; 2]; 3]> = faces.iter().map(|&f| uv[f]).collect();
        let mut area: f64 = corners.iter().map(|&t| 0.5 * doubled_area(t)).sum();
        if area < 0.0 {
            corners.iter_mut().flatten().for_each(|p| p[0] = -p[0]);
            area = -area;
        }
        let patch = in_rectangle(&corners, area);
        for (&f, &corners) in faces.iter().zip(&patch.uv) {
            face_patch[f] = PatchId::new(i);
            placed[f] = corners;
        }
        oriented.push(patch);
        let in_space = |&f: &FaceId| triangle_area(mesh.face_positions(f));
        // Nothing is known to bend: texels are spread evenly over the surface.
        sums.push(Sums {
            area: faces.iter().map(in_space).sum(),
            flat: area,
            bend: [0.0; 2],
        });
    }
    open_holes(mesh, &mut is_cut);
    let (patches, packed) = with_images(&oriented, &sums, params);
    let seams = seams(mesh, &is_cut, &face_patch, &placed);
    Ok(PatchLayout {
        face_patch,
        uv: placed,
        patches,
        seams,
        packed,
    })
}

/// Cuts along shortest chains of edges from border to border of each part until every part has one border.
fn open_holes(mesh: &Mesh, is_cut: &mut EdgeVec<bool>) {
    let c = &mesh.connectivity;
    let (copy, copies) = slit_copies(c, is_cut);
    let ends = |h| [copy[h], copy[c.next(h)]].map(|v| v as usize);
    let mut borders = UnionFind::new(copies);
    let mut on_border = vec![false; copies];
    let mut ways: Vec<Vec<(usize, EdgeId)>> = vec![Vec::new(); copies];
    for h in c.halfedges() {
        let ([a, b], e) = (ends(h), c.edge(h));
        if is_cut[e] || c.is_boundary_edge(e) {
            borders.join(a, b);
            (on_border[a], on_border[b]) = (true, true);
        } else {
            // Its twin is the way back.
            ways[a].push((b, e));
        }
    }
    // From all borders at once: how far each vertex is from the nearest, and by which edge it was reached.
    let mut reached = vec![(f64::INFINITY, None); copies];
    let mut queue = BinaryHeap::new();
    for v in (0..copies).filter(|&v| on_border[v]) {
        reached[v] = (0.0, None);
        queue.push(Reverse((0, v)));
    }
    let mut origin: Vec<usize> = (0..copies).collect();
    while let Some(Reverse((bits, v))) = queue.pop() {
        let from = f64::from_bits(bits);
        if from > reached[v].0 {
            continue;
        }
        for &(w, e) in &ways[v] {
            let distance = from + mesh.edge_length(e);
            if distance < reached[w].0 {
                reached[w] = (distance, Some((v, e)));
                origin[w] = origin[v];
                // Non-negative floats compare like their bits.
                queue.push(Reverse((distance.to_bits(), w)));
            }
        }
    }
    // The shortest bridges that join different borders, each taken once.
    let mut bridges = Vec::new();
    for (v, ways) in ways.iter().enumerate() {
        for &(w, e) in ways.iter().filter(|way| v < way.0) {
            if borders.find(origin[v]) != borders.find(origin[w]) {
                let length = reached[v].0 + mesh.edge_length(e) + reached[w].0;
                bridges.push((length, v, w, e));
            }
        }
    }
    bridges.sort_by(|a, b| {
        a.0.total_cmp(&b.0)
            .then((a.1, a.2, a.3).cmp(&(b.1, b.2, b.3)))
    });
    for (_, v, w, e) in bridges {
        if !borders.join(origin[v], origin[w]) {
            continue;
        }
        is_cut[e] = true;
        for end in [v, w] {
            let mut at = end;
            while let Some((before, e)) = reached[at].1 {
                is_cut[e] = true;
                at = before;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout;
    use super::super::samples::{build, ramp};
    use super::*;
    use crate::atlas::geometry_image::{image_origin, sample};
    use crate::rebuild::{Images, rebuild};
    use std::collections::BTreeSet;

    /// A flat ring of eight squares around a hole.
    #[test]
    fn a_chart_with_a_hole_is_slit_open() {
        let at = |i: u32, j: u32| 4 * i + j;
        let place = |v: u32| [f64::from(v / 4), f64::from(v % 4)];
        let mut faces = Vec::new();
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            if (i, j) != (1, 1) {
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        let positions = (0..16).map(|v| [place(v)[0], place(v)[1], 0.0]).collect();
        // Mirrored, as some programs have it.
        let uv: Vec<_> = faces
            .iter()
            .map(|f| f.map(|v| [-place(v)[0], place(v)[1]]))
            .collect();
        let s = build(&faces, positions, uv.clone(), |_, _| false, [0.0; 2]);
        let layout = charts_of(&s.mesh, &uv.into(), &PatchParams::default()).unwrap();
        assert_eq!(layout.patches.len(), 1);
        let origin = image_origin(&s.mesh, &crate::geometry::frame::Frame::default());
        let images = sample(&s.mesh, &layout, &s.log_scale, origin);
        let rebuilt = rebuild(&Images::new(&layout, &images, origin)).unwrap();
        rebuilt.expect_topology(0, 0, 2).unwrap();
    }

    #[test]
    fn coordinates_of_patches_give_the_same_patches() {
        let s = ramp(60, 12, 5.0);
        let params = PatchParams::default();
        let development = &s.development;
        let ours = layout(&s.mesh, &s.length, &s.cut, development, None, &params);
        let ours = ours.unwrap();
        // Apart from each other, since all lie in [0, 1].
        let mut uv = ours.uv.clone();
        for f in s.mesh.connectivity.faces() {
            let patch = ours.face_patch[f].index();
            uv[f].iter_mut().for_each(|p| p[0] += 2.0 * patch as f64);
        }
        let found = charts_of(&s.mesh, &uv, &params).unwrap();
        let faces = s.mesh.connectivity.faces();
        let pairs: BTreeSet<_> = faces
            .map(|f| (ours.face_patch[f], found.face_patch[f]))
            .collect();
        assert!(ours.patches.len() > 1);
        assert_eq!(
            (pairs.len(), found.patches.len()),
            (ours.patches.len(), ours.patches.len())
        );
    }

    #[test]
    fn coordinates_must_be_numbers() {
        let s = ramp(2, 2, 1.0);
        let mut uv: FaceVec<_> = s.mesh.connectivity.faces().map(|_| [[0.0; 2]; 3]).collect();
        uv[FaceId::new(3)][1][0] = f64::NAN;
        let refused = charts_of(&s.mesh, &uv, &PatchParams::default());
        assert!(matches!(
            refused,
            Err(PatchError::NotFinite { face: 3, .. })
        ));
    }
}
