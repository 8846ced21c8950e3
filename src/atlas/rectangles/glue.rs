//! The rectangles put together again to one surface.
//!
//! *Enters:* a drawing and the rectangle of every quad, each refined on its own. *Leaves:* first rectangles whose borders fit
//! ([`Added::new`]), then, when they have coordinates, a [`Subdivision`] of the surface. *Guaranteed:* an oriented surface without a crack:
//! what either side of a wall added to it, the other side gets too, by splitting its border edge there.
//!
//! The final triangulation of a quad is that of its double, whose edges may cross the border, at a right angle: hence the new vertices.

use super::RectangleError;
use super::flow::{Piece, Rectangle};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{
    EdgeId, EdgeVec, FaceId, HalfedgeId, HalfedgeVec, NONE, PatchId, VertexId, VertexVec,
};
use crate::geometry::subdivision::{Corner, Subdivision};

/// Places that the two sides of a wall added this near to each other (in lengths of the edge) are one.
const SAME: f64 = 1e-9;

/// A vertex that is put on a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OnWall {
    /// Along the edge's halfedge.
    fraction: f64,
    /// Whether the side of that halfedge has it already, and the other side.
    has: [bool; 2],
}

/// The vertices that are put on every edge of a drawing, in the direction of its halfedge.
pub(super) struct Added(EdgeVec<Vec<OnWall>>);

impl Added {
    /// Gives every rectangle the vertices that the other sides of its walls have.
    pub fn new(
        drawing: &Subdivision,
        rectangles: &mut [Rectangle],
    ) -> Result<Self, RectangleError> {
        let added = merge(drawing, rectangles);
        for rectangle in rectangles {
            insert(drawing, rectangle, &added)?;
        }
        Ok(Self(added))
    }
}

/// The whole surface, and the rectangle of every face.
pub(super) fn glue(
    drawing: &Subdivision,
    rectangles: &[Rectangle],
    Added(added): &Added,
) -> Result<(Subdivision, Vec<PatchId>), RectangleError> {
    let c = &drawing.connectivity;
    // Edges of a rectangle along every halfedge of the drawing, with the rectangle's number.
    let mut pieces: HalfedgeVec<(usize, Vec<EdgeId>)> =
        HalfedgeVec::filled((usize::MAX, Vec::new()), c.halfedge_count());
    for (i, rectangle) in rectangles.iter().enumerate() {
        for piece in &rectangle.border {
            pieces[piece.wall].0 = i;
            pieces[piece.wall].1.push(piece.edge);
        }
    }
    let mut position = drawing.position.clone();
    let mut first_on_wall = EdgeVec::filled(0usize, c.edge_count());
    for e in c.edges() {
        first_on_wall[e] = position.len();
        let [p, q] = c.edge_vertices(e).map(|v| drawing.position[v]);
        for x in &added[e] {
            let t = x.fraction;
            position.push(std::array::from_fn(|i| (1.0 - t) * p[i] + t * q[i]));
        }
    }
    let mut first_halfedge = Vec::with_capacity(rectangles.len());
    let mut tail: HalfedgeVec<VertexId> = HalfedgeVec::default();
    let mut twin = Vec::new();
    let mut parent = Vec::new();
    let mut corner: HalfedgeVec<Corner> = HalfedgeVec::default();
    let mut face_patch = Vec::new();
    for (i, rectangle) in rectangles.iter().enumerate() {
        let offset = tail.len();
        first_halfedge.push(offset);
        let own = &rectangle.fine.connectivity;
        let mut vertex: VertexVec<u32> = rectangle.known.iter().map(|v| v.raw()).collect();
        while vertex.len() < own.vertex_count() {
            vertex.push(NONE);
        }
        for own_pieces in rectangle.border.chunk_by(|a, b| a.wall == b.wall) {
            let h = own_pieces[0].wall;
            let e = c.edge(h);
            let forward = c.edge_halfedge(e) == h;
            let count = added[e].len();
            for (k, piece) in own_pieces.iter().enumerate().skip(1) {
                let at = if forward { k - 1 } else { count - k };
                vertex[own.tail(own.edge_halfedge(piece.edge))] = (first_on_wall[e] + at) as u32;
            }
        }
        for v in own
            .vertices()
            .filter(|&v| vertex[v] == NONE)
            .collect::<Vec<_>>()
        {
            vertex[v] = position.push(rectangle.fine.position[v]).raw();
        }
        for h in own.halfedges() {
            tail.push(VertexId::new(vertex[own.tail(h)] as usize));
            twin.push(own.twin(h).map(|t| HalfedgeId::new(offset + t.index())));
            let drawn = rectangle.fine.parent[own.face(h)];
            corner.push(composed(drawing, drawn, rectangle.fine.corner[h]));
        }
        for f in own.faces() {
            parent.push(drawing.parent[rectangle.fine.parent[f]]);
            face_patch.push(PatchId::new(i));
        }
    }
    let whole = |(i, piece): (usize, EdgeId)| {
        let own = rectangles[i].fine.connectivity.edge_halfedge(piece);
        HalfedgeId::new(first_halfedge[i] + own.index())
    };
    let unfit = RectangleError::Inconsistent {
        what: "the two sides of a quad's border",
    };
    for h in c.halfedges() {
        let (i, own) = &pieces[h];
        let Some((j, other)) = c.twin(h).map(|t| &pieces[t]).filter(|t| !t.1.is_empty()) else {
            continue;
        };
        if own.len() != other.len() {
            return Err(unfit);
        }
        for (&a, &b) in own.iter().zip(other.iter().rev()) {
            twin[whole((*i, a)).index()] = Some(whole((*j, b)));
        }
    }
    let subdivision = Subdivision {
        connectivity: Connectivity::from_gluing(tail, &twin, position.len())?,
        position,
        parent: parent.into(),
        corner,
    };
    Ok((subdivision, face_patch))
}

/// Weights in a face of the drawing as weights in the face of the surface.
fn composed(drawing: &Subdivision, drawn: FaceId, corner: Corner) -> Corner {
    let c = &drawing.connectivity;
    let outer = c.face_halfedges(drawn).map(|h| drawing.corner[h].weights);
    // A corner of the drawing keeps its digits.
    let weights = match corner.weights.iter().position(|&w| w == 1.0) {
        Some(k) => outer[k],
        None => std::array::from_fn(|i| (0..3).map(|k| corner.weights[k] * outer[k][i]).sum()),
    };
    Corner {
        weights,
        uv: corner.uv,
    }
}

/// What both sides of every edge add to it, in the direction of its halfedge.
fn merge(drawing: &Subdivision, rectangles: &[Rectangle]) -> EdgeVec<Vec<OnWall>> {
    let c = &drawing.connectivity;
    let mut sides: EdgeVec<[Vec<f64>; 2]> =
        EdgeVec::filled([Vec::new(), Vec::new()], c.edge_count());
    for rectangle in rectangles {
        for piece in rectangle.border.iter().filter(|piece| piece.from > 0.0) {
            let e = c.edge(piece.wall);
            let forward = c.edge_halfedge(e) == piece.wall;
            let fraction = if forward {
                piece.from
            } else {
                1.0 - piece.from
            };
            sides[e][usize::from(!forward)].push(fraction);
        }
    }
    sides
        .iter()
        .map(|[left, right]| merged(left, right))
        .collect()
}

/// Two sets of fractions as one sequence; of two that are the same the left one counts.
fn merged(left: &[f64], right: &[f64]) -> Vec<OnWall> {
    let sorted = |side: &[f64]| {
        let mut side = side.to_vec();
        side.sort_by(f64::total_cmp);
        side
    };
    let (left, right) = (sorted(left), sorted(right));
    let (mut i, mut j) = (0, 0);
    let mut all = Vec::with_capacity(left.len() + right.len());
    while i < left.len() || j < right.len() {
        let (a, b) = (left.get(i), right.get(j));
        let same = a.zip(b).is_some_and(|(a, b)| (a - b).abs() <= SAME);
        let own = b.is_none_or(|b| a.is_some_and(|a| a <= b));
        let has = [same || own, same || !own];
        let value = if has[0] { a } else { b };
        all.extend(value.map(|&fraction| OnWall { fraction, has }));
        i += usize::from(has[0]);
        j += usize::from(has[1]);
    }
    all
}

/// Gives a rectangle the vertices that the other sides of its walls added.
fn insert(
    drawing: &Subdivision,
    rectangle: &mut Rectangle,
    added: &EdgeVec<Vec<OnWall>>,
) -> Result<(), RectangleError> {
    let unfit = RectangleError::Inconsistent {
        what: "the border of a quad",
    };
    let c = &drawing.connectivity;
    let fine = &mut rectangle.fine;
    let mut border: Vec<Piece> = Vec::with_capacity(rectangle.border.len());
    for own in rectangle.border.chunk_by(|a, b| a.wall == b.wall) {
        let wall = own[0].wall;
        let e = c.edge(wall);
        let forward = c.edge_halfedge(e) == wall;
        let mut wanted: Vec<(f64, bool)> = added[e]
            .iter()
            .map(|x| match forward {
                true => (x.fraction, x.has[0]),
                false => (1.0 - x.fraction, x.has[1]),
            })
            .collect();
        if !forward {
            wanted.reverse();
        }
        let mut next = 1;
        let mut last = own[0];
        for (from, has) in wanted {
            if has {
                let following = *own.get(next).ok_or_else(|| unfit.clone())?;
                border.push(std::mem::replace(&mut last, following));
                next += 1;
                continue;
            }
            let to = own.get(next).map_or(1.0, |piece| piece.from);
            let t = ((from - last.from) / (to - last.from)).clamp(SAME, 1.0 - SAME);
            let t = if t.is_finite() { t } else { 0.5 };
            let second = Piece {
                wall,
                edge: EdgeId::new(fine.connectivity.edge_count()),
                from,
                length: (1.0 - t) * last.length,
            };
            fine.split_edge(last.edge, t);
            last.length *= t;
            border.push(std::mem::replace(&mut last, second));
        }
        border.push(last);
        if next != own.len() {
            return Err(unfit);
        }
    }
    rectangle.border = border;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_of_a_wall_get_what_either_has() {
        let all = merged(&[0.75, 0.25], &[0.5, 0.25 + 1e-12]);
        let expected = [
            (0.25, [true, true]),
            (0.5, [false, true]),
            (0.75, [true, false]),
        ];
        let expected = expected.map(|(fraction, has)| OnWall { fraction, has });
        assert_eq!(all, expected);
        // Two of one side stay two, however near.
        assert_eq!(merged(&[0.5, 0.5 + 1e-12], &[]).len(), 2);
        assert!(merged(&[], &[]).is_empty());
    }
}
