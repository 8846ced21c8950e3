//! Quads: every patch with n sides divided into n four-sided disks, as Catmull and Clark do (1978): a centre joined to the middles of
//! its sides.
//!
//! *Enters:* a [`Drawing`]. *Leaves:* the quads, each with its corners (centre, middle, node, middle; counterclockwise) on its
//! border. *Guaranteed:* conforming: every side of a quad is a whole side of the quad across, corner to corner, since both are
//! the same half of a patch's side or the same line to a centre. Quads are disks.
//! *Not guaranteed:* the least number of quads.
//!
//! The centre is where the corners are seen as equally as can be: the product of the harmonic measures of the borders between
//! middles is largest there, on a line through the best vertex. Lines leave it at equal angles ([`aim`]).

// A ring of new vertices around the centre was tried, to tell directions apart in coarse parts: it keeps the shapes of the faces that
// are there, so nothing is won, and its small faces are where the flow of a quad ran out of digits.

use super::RectangleError;
use super::chord::{Crossing, aim, zero_level};
use super::disk::Disk;
use super::division::{cross, draw, joining, part, places, regions};
use super::sides::{Drawing, Role};
use crate::geometry::ids::{EdgeId, FaceId, VertexId, VertexVec};
use crate::geometry::subdivision::Subdivision;

/// A four-sided part of a patch.
pub(super) struct Quad {
    /// The disk.
    pub disk: Disk,
    /// Places of its corners on the disk's border, in the order of the border.
    pub corners: [usize; 4],
}

impl Quad {
    /// The edges of the drawing on a side, from corner `k` on.
    pub fn side(&self, drawing: &Subdivision, k: usize) -> Vec<EdgeId> {
        let n = self.disk.border.len();
        let (from, to) = (self.corners[k % 4], self.corners[(k + 1) % 4]);
        let count = (to + n - from) % n;
        let place = |i| self.disk.border[(from + i) % n];
        (0..count)
            .map(|i| self.disk.edge(drawing, place(i)))
            .collect()
    }
}

/// Divides all regions between walls; walls are drawn between quads. In the order of their first faces.
pub(super) fn quads(drawing: &mut Drawing) -> Result<Vec<Quad>, RectangleError> {
    for start in regions(drawing) {
        let disk = part(drawing, start)?;
        let nodes: Vec<usize> = places(drawing, &disk, |role| role == Role::Node).collect();
        let middles: Vec<usize> = places(drawing, &disk, |role| role == Role::Middle).collect();
        if nodes.len() != middles.len() {
            return Err(RectangleError::Inconsistent {
                what: "the sides of a patch",
            });
        }
        star(drawing, disk, &middles, &nodes)?;
    }
    // Splits may have moved halfedges of parts that were finished: taken out at the end.
    regions_as_quads(drawing)
}

/// All regions between walls, which must have four corners.
pub(super) fn regions_as_quads(drawing: &Drawing) -> Result<Vec<Quad>, RectangleError> {
    let quad = |start| {
        let disk = part(drawing, start)?;
        let corners: Vec<usize> = places(drawing, &disk, |role| role != Role::Plain).collect();
        let corners = corners
            .try_into()
            .map_err(|_| RectangleError::Inconsistent {
                what: "the corners of a quad",
            })?;
        Ok(Quad { disk, corners })
    };
    regions(drawing).into_iter().map(quad).collect()
}

/// Joins places on a disk's border, in its order, to a centre; between any two that follow each other one of `separators` must lie. The centre's vertex.
pub(super) fn star(
    drawing: &mut Drawing,
    disk: Disk,
    ends: &[usize],
    separators: &[usize],
) -> Result<VertexId, RectangleError> {
    let vertices: Vec<VertexId> = ends.iter().map(|&p| disk.border_vertex(p)).collect();
    let start = disk.faces.first().copied();
    let centre = slit_to_centre(drawing, &disk, ends, separators)?;
    let mut waiting = Vec::from_iter(start);
    while let Some(start) = waiting.pop() {
        let disk = part(drawing, start)?;
        let halves = halve(drawing, disk, centre, &vertices)?;
        waiting.extend(halves.into_iter().flatten());
    }
    Ok(centre)
}

/// Finds the centre, and draws the line to it from the first of the places that are joined to it.
fn slit_to_centre(
    drawing: &mut Drawing,
    disk: &Disk,
    middles: &[usize],
    nodes: &[usize],
) -> Result<VertexId, RectangleError> {
    let error = || RectangleError::Inconsistent {
        what: "the sides of a patch",
    };
    let n = disk.border.len();
    let sides = middles.len();
    if sides < 3 {
        return Err(error());
    }
    // 1 between two places, going counterclockwise from the first, 0 elsewhere.
    let between = |from: usize, to: usize| -> Vec<f64> {
        let inside = (to + n - from) % n;
        let value = |place: usize| match (place + n - from) % n {
            0 => 0.5,
            d if d < inside => 1.0,
            d if d == inside => 0.5,
            _ => 0.0,
        };
        (0..n).map(value).collect()
    };
    let opposite = match sides % 2 {
        0 => middles[sides / 2],
        _ => {
            let node = nodes.iter().find(|&&node| node > middles[sides / 2]);
            *node.or(nodes.first()).ok_or_else(error)?
        }
    };
    let mut given: Vec<Vec<f64>> = (0..sides)
        .map(|i| between(middles[i], middles[(i + 1) % sides]))
        .collect();
    given.push(between(middles[0], opposite));
    let mut measures = disk.harmonic(&drawing.fine, &given)?;
    let ahead = measures.pop().ok_or_else(error)?;
    let log = |x: f64| x.max(f64::MIN_POSITIVE).ln();
    let score = |measure: &dyn Fn(&VertexVec<f64>) -> f64| -> f64 {
        measures.iter().map(|m| log(measure(m))).sum()
    };
    let c = &disk.connectivity;
    let inner = c.vertices().filter(|&v| !c.is_boundary_vertex(v));
    let scored = inner.map(|v| (score(&|m| m[v]), v));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let share = best.map_or(0.5, |(_, v)| ahead[v].clamp(0.01, 0.99));
    // Zero at the best vertex, negative ahead of the line.
    let mut value: VertexVec<f64> = ahead.iter().map(|&a| share - a).collect();
    let length = disk.lengths(&drawing.fine);
    aim(disk, &length, &mut value, middles[0], [-0.5, 0.5]);
    let crossings = zero_level(&drawing.fine, disk, &value, middles[0], opposite)?;
    let at = |x: &Crossing| {
        let ([p, q], t) = x.between;
        score(&|m| (1.0 - t) * m[p] + t * m[q])
    };
    let nearest = crossings.iter().map(at).enumerate();
    let nearest = nearest.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
    let from = disk.border_vertex(middles[0]);
    let centre = match nearest {
        Some((last, _)) => draw(drawing, from, &crossings[..=last])?,
        None => {
            // The two places are joined by an edge: its middle it is.
            let edge = joining(disk, middles[0], opposite).ok_or_else(error)?;
            let middle = Crossing {
                edge: disk.edge(&drawing.fine, edge),
                fraction: 0.5,
                between: ([c.tail(edge), c.head(edge)], 0.5),
            };
            draw(drawing, from, &[middle])?
        }
    };
    drawing.role[centre] = Role::Centre;
    Ok(centre)
}

/// Divides a part of a patch that has the centre on its border by a line from there; a face of each part, or nothing where
/// the part is a quad.
fn halve(
    drawing: &mut Drawing,
    disk: Disk,
    centre: VertexId,
    ends: &[VertexId],
) -> Result<Option<[FaceId; 2]>, RectangleError> {
    let error = || RectangleError::Inconsistent {
        what: "the centre of a patch",
    };
    let n = disk.border.len();
    let mut disk = disk;
    let mut at_centre = (0..n).filter(|&place| disk.border_vertex(place) == centre);
    let (Some(first), None) = (at_centre.next(), at_centre.next()) else {
        return Err(error());
    };
    disk.border.rotate_left(first);
    let is_end = |&place: &usize| ends.contains(&disk.border_vertex(place));
    let middles: Vec<usize> = (0..n).filter(is_end).collect();
    let [first, .., last] = middles[..] else {
        return Err(error());
    };
    let quads = middles.len() - 1;
    if quads < 2 {
        return Ok(None);
    }
    let before = quads / 2;
    let to = middles[before];
    // The angle at the centre is divided like the number of quads, other angles are halved.
    let portion = |quads_there: usize| 2.0 * quads_there as f64 / quads as f64;
    let value = |place: usize| match place {
        p if p <= first => -portion(before),
        p if p <= to => -1.0,
        p if p < last => 1.0,
        _ => portion(quads - before),
    };
    let given: Vec<f64> = (0..n).map(value).collect();
    let mut solved = disk.harmonic(&drawing.fine, &[given])?;
    let mut value = solved.pop().ok_or_else(error)?;
    let length = disk.lengths(&drawing.fine);
    aim(&disk, &length, &mut value, to, [1.0, -1.0]);
    let ends = [-portion(before), portion(quads - before)];
    aim(&disk, &length, &mut value, 0, ends);
    Ok(Some(cross(drawing, &disk, &value, 0, to)?))
}
