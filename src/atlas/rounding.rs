//! Lengths of a finer triangulation, rounded so that angles add up.
//!
//! *Enters:* lengths on a subdivision of a surface with a flat metric. *Leaves:* the same, a few of them changed in their last digits. *Guaranteed:* no length changes by more than [`MOST`] units in the last place.
//! *Not guaranteed:* that all angles add up: where a face is thin as 1e-9, no lengths in float64 do that.
//!
//! Where a line crosses a needle at a small angle, the piece cut off is a sliver, a ten millionth as wide as long. The rounding of its longest side to the nearest number alone moves its angles by 1e-9, so that
//! the surface is not flat there as far as lengths tell. A unit in the last place of one of its short sides moves them by a hundredth of that: of the numbers near the true length those are taken with which angles
//! around vertices add up as before.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, VertexId, VertexVec};
use crate::geometry::triangle::angles;
use std::collections::BTreeSet;

/// Error of an angle sum that is mended, radians; a tenth of what is promised.
const LARGE: f64 = 1e-10;
/// Faces that are thinner, height by longest side, have sides that are changed.
const THIN: f64 = 1e-4;
/// Units in the last place that a length changes by at most, and those that are tried at a time.
const MOST: i32 = 16;
const TRIED: [i32; 8] = [-4, 4, -2, 2, -1, 1, -8, 8];
/// Changes around one vertex, at most.
const MOST_CHANGES: usize = 64;

/// Sums of the angles at vertices; no number where a face is none.
pub(super) fn angle_sums(c: &Connectivity, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let mut sums = VertexVec::filled(0.0, c.vertex_count());
    for f in c.faces() {
        let angle = angles_of(c, length, f);
        for (v, angle) in c.face_vertices(f).into_iter().zip(angle) {
            sums[v] += angle;
        }
    }
    sums
}

fn angles_of(c: &Connectivity, length: &EdgeVec<f64>, f: FaceId) -> [f64; 3] {
    angles(c.face_edges(f).map(|e| length[e])).unwrap_or([f64::NAN; 3])
}

/// Changes lengths in their last places where angles do not add up to `wanted`.
pub(super) fn round(c: &Connectivity, length: &mut EdgeVec<f64>, wanted: &VertexVec<f64>) {
    let sums = angle_sums(c, length);
    let off = |v: VertexId, sum: f64| sum - wanted[v];
    let mut error: VertexVec<f64> = sums.enumerate().map(|(v, sum)| off(v, *sum)).collect();
    let large: Vec<VertexId> = c.vertices().filter(|&v| error[v].abs() > LARGE).collect();
    let mut changed: EdgeVec<i32> = EdgeVec::filled(0, c.edge_count());
    for v in large {
        for _ in 0..MOST_CHANGES {
            if error[v].abs() <= LARGE {
                break;
            }
            let Some(()) = mend(c, length, &mut error, &mut changed, v) else {
                break;
            };
        }
    }
}

/// The change of one side of a thin face at a vertex that lowers the errors around most; none where no change does.
fn mend(
    c: &Connectivity,
    length: &mut EdgeVec<f64>,
    error: &mut VertexVec<f64>,
    changed: &mut EdgeVec<i32>,
    v: VertexId,
) -> Option<()> {
    let is_thin = |f: FaceId| {
        let l = c.face_edges(f).map(|e| length[e]);
        let longest = l[0].max(l[1]).max(l[2]);
        let height = crate::geometry::triangle::area(l).map_or(0.0, |a| 2.0 * a / longest);
        height < THIN * longest
    };
    let thin = c.outgoing(v).map(|h| c.face(h)).filter(|&f| is_thin(f));
    let sides: BTreeSet<EdgeId> = thin.flat_map(|f| c.face_edges(f)).collect();
    let mut best: Option<(f64, EdgeId, i32)> = None;
    for e in sides {
        let faces = faces_of(c, e);
        let own = length[e];
        let before: Vec<[f64; 3]> = faces.iter().map(|&f| angles_of(c, length, f)).collect();
        for by in TRIED {
            if (changed[e] + by).abs() > MOST {
                continue;
            }
            length[e] = moved(own, by);
            let gain: f64 = differences(c, length, &faces, &before)
                .into_iter()
                .map(|(v, d)| error[v] * error[v] - (error[v] + d) * (error[v] + d))
                .sum();
            if gain > best.map_or(0.0, |b| b.0) {
                best = Some((gain, e, by));
            }
        }
        length[e] = own;
    }
    let (_, e, by) = best?;
    let faces = faces_of(c, e);
    let before: Vec<[f64; 3]> = faces.iter().map(|&f| angles_of(c, length, f)).collect();
    length[e] = moved(length[e], by);
    changed[e] += by;
    for (v, d) in differences(c, length, &faces, &before) {
        error[v] += d;
    }
    Some(())
}

fn faces_of(c: &Connectivity, e: EdgeId) -> Vec<FaceId> {
    let h = c.edge_halfedge(e);
    let both = [Some(h), c.twin(h)];
    both.into_iter().flatten().map(|h| c.face(h)).collect()
}

/// By how much the angle sums of the vertices of faces have changed, each vertex once.
fn differences(
    c: &Connectivity,
    length: &EdgeVec<f64>,
    faces: &[FaceId],
    before: &[[f64; 3]],
) -> Vec<(VertexId, f64)> {
    let mut changes: Vec<(VertexId, f64)> = Vec::with_capacity(6);
    for (&f, old) in faces.iter().zip(before) {
        let now = angles_of(c, length, f);
        for ((v, now), old) in c.face_vertices(f).into_iter().zip(now).zip(old) {
            match changes.iter_mut().find(|(known, _)| *known == v) {
                Some((_, change)) => *change += now - old,
                None => changes.push((v, now - old)),
            }
        }
    }
    changes
}

/// So many numbers farther; positive ones.
fn moved(x: f64, by: i32) -> f64 {
    f64::from_bits(x.to_bits().wrapping_add_signed(i64::from(by)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ids::VertexId;
    use std::f64::consts::TAU;

    /// A vertex on a needle, cut at a small angle: its four faces tile a rectangle, two of them are slivers.
    #[test]
    fn slivers_keep_the_plane_flat() {
        let mut worst = [0.0f64; 2];
        for i in 0..40 {
            let x = 0.3 + 0.011 * f64::from(i);
            let place = [
                [0.0, 0.0],
                [1.37, 0.0],
                [1.37, 3e-7],
                [0.0, 2e-7],
                [x, 1.3e-7],
            ];
            let faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
            let c = Connectivity::from_faces(&faces, 5).expect("a disk");
            let between = |e| {
                let [a, b] = c.edge_vertices(e).map(|v| place[v.index()]);
                f64::hypot(a[0] - b[0], a[1] - b[1])
            };
            let mut length: EdgeVec<f64> = c.edges().map(between).collect();
            let centre = VertexId::new(4);
            let mut wanted = angle_sums(&c, &length);
            wanted[centre] = TAU;
            let exact = length.clone();
            let off = |length: &EdgeVec<f64>| (angle_sums(&c, length)[centre] - TAU).abs();
            worst[0] = worst[0].max(off(&length));
            round(&c, &mut length, &wanted);
            worst[1] = worst[1].max(off(&length));
            for (new, old) in length.iter().zip(exact.iter()) {
                assert!((new - old).abs() <= 16.0 * f64::EPSILON * old);
            }
        }
        // The outer corners keep their angles too.
        assert!(worst[0] > 2e-9 && worst[1] < 1e-9, "{worst:?}");
    }
}
