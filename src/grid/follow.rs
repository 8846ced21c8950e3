//! Lines that are paths of edges already.
//!
//! *Enters:* a [`Sheet`], a vertex and the bearing of a line there. *Leaves:* the edges up to its end as parts of the line. *Guaranteed:* no vertex is moved and no edge split, so it does not matter how
//! near others lie; what is drawn later cannot cross it.

use super::error::GridError;
use super::sheet::Sheet;
use crate::geometry::ids::{EdgeVec, HalfedgeId, VertexId};

impl Sheet {
    /// Makes edges that are on a line already, or on the border, part of `line`: from a vertex, in the direction of a bearing, on to where it ends.
    pub fn follow(
        &mut self,
        from: VertexId,
        bearing: f64,
        line: u32,
        goal: VertexId,
        is_line: &EdgeVec<bool>,
    ) -> Result<(), GridError> {
        let c = &self.fine.connectivity;
        let is_on = |(h, _): &(HalfedgeId, f64)| is_line[c.edge(*h)] || c.twin(*h).is_none();
        // All edges of a vertex with their bearings; the last of a border comes in.
        let around = |v: VertexId| {
            let mut total = 0.0;
            let mut edges = Vec::new();
            for h in c.outgoing(v) {
                edges.push((h, total));
                total += self.angle(h);
                if c.twin(c.prev(h)).is_none() {
                    edges.push((c.prev(h), total));
                }
            }
            (edges, total)
        };
        let (edges, total) = around(from);
        let off = |(_, own): &(HalfedgeId, f64)| match c.is_boundary_vertex(from) {
            true => (own - bearing).abs(),
            false => {
                let off = (own - bearing).rem_euclid(total);
                off.min(total - off)
            }
        };
        let face = c.face(c.vertex_halfedge(from));
        let lost = GridError::Lost { line, face };
        let on = edges.into_iter().filter(is_on);
        let first = on.min_by(|a, b| off(a).total_cmp(&off(b)));
        let (mut v, (mut h, _)) = (from, first.ok_or(lost.clone())?);
        let mut path = vec![c.edge(h)];
        loop {
            v = if c.tail(h) == v { c.head(h) } else { c.tail(h) };
            if v == goal {
                break;
            }
            let on = around(v).0.into_iter().filter(is_on);
            let mut on = on.filter(|&(next, _)| c.edge(next) != c.edge(h));
            h = match [on.next(), on.next()] {
                [Some((next, _)), None] if path.len() <= c.edge_count() => next,
                _ => return Err(lost),
            };
            path.push(c.edge(h));
        }
        path.into_iter().for_each(|e| self.line[e] = line);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{mesh, no_lines, plate};
    use super::*;
    use crate::geometry::ids::{HalfedgeVec, NONE};
    use crate::geometry::subdivision::Subdivision;

    /// A square of 4 × 4, whose middle row of edges is a line, with a vertex above that is almost on it.
    #[test]
    fn a_line_goes_along_its_edges_whatever_lies_beside_it() {
        let mesh = mesh(&plate(&[[0, 0]], 4, no_lines));
        let c = mesh.connectivity.clone();
        // Its inner vertices lie a little beside their places.
        let place = |v: VertexId| [0, 1].map(|i| (4.0 * mesh.positions[v][i]).round() / 4.0);
        let vertex = |at: [f64; 2]| c.vertices().find(|&v| place(v) == at).unwrap();
        let row = [0.0, 0.25, 0.5, 0.75, 1.0].map(|x| vertex([x, 0.5]));
        let near = vertex([0.5, 0.75]);
        let mut fine = Subdivision::identity(&mesh);
        for h in c.halfedges() {
            let [x, y] = place(c.tail(h));
            fine.corner[h].uv = match c.tail(h) == near {
                true => [x + 1e-3, 0.5 + 1e-8],
                false => [x, y],
            };
        }
        let on_row = |e| c.edge_vertices(e).iter().all(|v| row.contains(v));
        let is_line: EdgeVec<bool> = c.edges().map(on_row).collect();
        assert_eq!(is_line.iter().filter(|on| **on).count(), 4);
        let mut sheet = Sheet::new(fine, HalfedgeVec::filled(0, c.halfedge_count()), 1e-4);
        // Both ways; the bearing is a little off.
        for (from, to) in [(row[0], row[4]), (row[4], row[0])] {
            sheet.clear();
            let along = |h: &HalfedgeId| is_line[c.edge(*h)];
            let bearing = sheet.bearing(c.outgoing(from).find(along).unwrap());
            sheet.follow(from, bearing + 0.01, 7, to, &is_line).unwrap();
            for e in c.edges() {
                assert_eq!(sheet.line[e], if is_line[e] { 7 } else { NONE });
            }
        }
        assert_eq!(sheet.fine.connectivity, c);
        // A line that ends elsewhere is none.
        let none = EdgeVec::filled(false, c.edge_count());
        let lost = sheet.follow(row[1], 0.0, 7, row[3], &none);
        assert!(matches!(lost, Err(GridError::Lost { line: 7, .. })));
    }
}
