//! Squeezed faces, made wider vertex by vertex.
//!
//! *Enters:* places of vertices at which no face is turned over. *Leaves:* places of less energy: Newton's method for one vertex at a time, over those of faces that are nearly flat, as long as it gains.
//! *Guaranteed:* every face keeps a positive area; what may not move stays; the same for any number of threads.
//!
//! A step of all vertices together ends before the first face loses its area: a few faces that are nearly flat stop the whole surface. Where they are wide again, steps are whole, and
//! half as many suffice.

use super::energy::{Energy, Places};
use super::fan::{self, Around};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceId, VertexId};

/// Part of the way to where a face loses its area that a step goes.
pub(super) const BEFORE_FLAT: f64 = 0.9;
/// Part of the decrease that the gradient promises (Armijo).
pub(super) const SUFFICIENT: f64 = 1e-4;
pub(super) const MOST_HALVINGS: usize = 30;

/// ‖J‖² + ‖J⁻¹‖² of squeezed faces; 4 is an isometry.
pub(super) const SQUEEZED: f64 = 50.0;
/// Rounds over vertices of squeezed faces.
const MOST_ROUNDS: usize = 30;
/// Most moves: this part of the vertices, and so many besides. Where more are wanted, not a few faces are squeezed but the surface, and steps of all vertices together do better.
const MOST_MOVES: (f64, usize) = (0.5, 10_000);
/// Part of the energy around a vertex that it gains at least, to be looked at again.
const LEAST_GAIN: f64 = 1e-3;

/// See the module docs. `is_free`: of every vertex, whether it may move along each axis. `see` is shown the places after every round, in which each vertex moves once.
pub(super) fn widen(
    energy: &Energy,
    c: &Connectivity,
    place: &mut Places,
    is_free: &[[bool; 2]],
    see: &mut dyn FnMut(&Places),
) {
    let mut squeezed = energy.above(SQUEEZED, place);
    let mut left = MOST_MOVES.1 + (MOST_MOVES.0 * c.vertex_count() as f64) as usize;
    let (mut star, mut fan) = (Vec::new(), Vec::new());
    for _ in 0..MOST_ROUNDS {
        let mut touched = Vec::new();
        let mut vertices = distinct(squeezed.iter().flat_map(|&f| c.face_vertices(f)));
        vertices.retain(|v| is_free[v.index()] != [false; 2]);
        vertices.truncate(left);
        left -= vertices.len();
        for v in vertices {
            star.clear();
            star.extend(c.outgoing(v).map(|h| c.face(h)));
            fan.clear();
            fan.extend(star.iter().map(|&f| energy.around(f, v, place)));
            if move_vertex(energy, &star, &fan, v, place, is_free[v.index()]) {
                touched.extend_from_slice(&star);
            }
        }
        see(place);
        squeezed = distinct(touched.into_iter());
        squeezed.retain(|&f| energy.is_above(SQUEEZED, f, place));
        if squeezed.is_empty() {
            break;
        }
    }
}

/// Ascending.
fn distinct<T: Ord>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut all: Vec<T> = all.collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Takes a step of Newton's method with one vertex; `fan` are the faces of its star. Whether that gains much.
fn move_vertex(
    energy: &Energy,
    star: &[FaceId],
    fan: &[Around],
    v: VertexId,
    place: &mut Places,
    is_free: [bool; 2],
) -> bool {
    let Some((step, slope)) = fan::newton_step(fan, is_free) else {
        return false;
    };
    let mut length = (BEFORE_FLAT * fan::longest(fan, step)).min(1.0);
    let (from, before) = (place[v.index()], fan::energy(fan, [0.0; 2]));
    for _ in 0..MOST_HALVINGS {
        let by = step.map(|x| length * x);
        let there = fan::energy(fan, by);
        if there <= before + SUFFICIENT * length * slope {
            place[v.index()] = [0, 1].map(|i| from[i] + by[i]);
            // Rounded places may say otherwise.
            if star.iter().all(|&f| energy.of(f, place).is_finite()) {
                return before - there > LEAST_GAIN * before;
            }
        }
        length *= 0.5;
    }
    place[v.index()] = from;
    false
}

#[cfg(test)]
mod tests {
    use super::super::density::Units;
    use super::super::map::{Freedom, GridMap};
    use super::super::params::Density;
    use super::super::relax::relax;
    use super::super::sheet::Sheet;
    use super::super::tests::{mesh, no_lines, plate};
    use super::*;
    use crate::geometry::ids::{HalfedgeVec, VertexVec};
    use crate::geometry::subdivision::Subdivision;

    /// A square of 4 × 4 cells as it lies, whose inner vertices may move, with one of them nearly on the edge opposite.
    fn squeezed_square() -> (GridMap, Units, VertexId) {
        let mesh = mesh(&plate(&[[0, 0]], 4, no_lines));
        let mut fine = Subdivision::identity(&mesh);
        let c = &mesh.connectivity;
        let inner = c.vertices().find(|&v| !c.is_boundary_vertex(v)).unwrap();
        let opposite = c.next(c.vertex_halfedge(inner));
        let [a, b, own] = [c.tail(opposite), c.head(opposite), inner].map(|v| mesh.positions[v]);
        let at = |v: VertexId| -> [f64; 2] {
            let p = mesh.positions[v];
            [0, 1].map(|i| {
                let squeezed = 0.499 * (a[i] + b[i]) + 0.002 * own[i];
                4.0 * if v == inner { squeezed } else { p[i] }
            })
        };
        for h in c.halfedges() {
            fine.corner[h].uv = at(c.tail(h));
        }
        let freedom = c.vertices().map(|v| match c.is_boundary_vertex(v) {
            true => Freedom::Fixed,
            false => Freedom::Free,
        });
        let turns = HalfedgeVec::filled(0, c.halfedge_count());
        let map = GridMap {
            freedom: freedom.collect::<VertexVec<Freedom>>(),
            sheet: Sheet::new(fine, turns, 1e-9),
            anchors: Vec::new(),
        };
        let unit = Units::new(&mesh, 0.25, Density::Uniform).unwrap();
        (map, unit, inner)
    }

    #[test]
    fn a_squeezed_face_becomes_wide_and_nothing_else_moves() {
        let (map, unit, inner) = squeezed_square();
        let c = &map.sheet.fine.connectivity;
        let energy = Energy::new(&map, &unit);
        let is_free: Vec<[bool; 2]> = map.freedom.iter().map(|f| f.axes()).collect();
        let before: Vec<[f64; 2]> = c.vertices().map(|v| map.place(v)).collect();
        let mut place = before.clone();
        assert!(!energy.above(SQUEEZED, &place).is_empty());
        let mut rounds = 0;
        widen(&energy, c, &mut place, &is_free, &mut |_| rounds += 1);
        assert!(rounds > 0 && energy.above(SQUEEZED, &place).is_empty());
        assert!(energy.total(&place) < 0.5 * energy.total(&before));
        for v in c
            .vertices()
            .filter(|&v| place[v.index()] != before[v.index()])
        {
            let beside = c.outgoing(inner).any(|h| c.head(h) == v);
            assert!((v == inner || beside) && map.freedom[v] == Freedom::Free);
        }
    }

    #[test]
    fn a_squeezed_square_comes_back_to_an_isometry() {
        let (mut map, unit, _) = squeezed_square();
        let relaxed = relax(&mut map, &unit, &()).unwrap();
        assert!(relaxed.energy[0] > 100.0, "{relaxed:?}");
        assert!((relaxed.energy[1] - 4.0).abs() < 1e-6, "{relaxed:?}");
        let c = &map.sheet.fine.connectivity;
        for v in c.vertices() {
            let (p, at) = (map.place(v), map.sheet.fine.position[v]);
            assert!((0..2).all(|i| (p[i] - 4.0 * at[i]).abs() < 1e-3));
        }
    }
}
