//! What quarter-turn gluings leave free: every corner's coordinate by one number a vertex and one translation a segment.
//!
//! *Enters:* a surface, its cut and the quarter turn of every segment. *Leaves:* [`Transitions`]. A field f in the slit surface has
//! coordinates that go over into each other across segment s by f_right = i^r f_left + T_s, with T_s still unknown. Walking around a
//! vertex v from its first corner, where f = u_v, every corner gets f = i^a u_v + Σ i^b T_s. The whole walk around v says
//! u_v = i^q u_v + Σ i^b T_s: where q is not 0, v is a cone and lies at the fixed point; where q = 0, the sum must vanish.

use super::TextureError;
use super::gaussian::Complex;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{HalfedgeId, NONE, VertexId};
use crate::read::flat::FlatSurface;
use rustc_hash::FxHashSet;

/// i^turns u + Σ i^b T_s over the pairs (s, b) of `terms`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Expression {
    pub turns: u8,
    pub terms: Vec<(u32, u8)>,
}

impl Expression {
    /// Across segment s from its left to its right: i^r (…) + T_s.
    fn cross_to_right(&mut self, segment: u32, turns: u8) {
        self.turn(turns);
        self.push(segment, 0);
    }

    /// From the right to the left: i^(−r) ((…) − T_s).
    fn cross_to_left(&mut self, segment: u32, turns: u8) {
        self.push(segment, 2);
        self.turn(4 - turns);
    }

    fn turn(&mut self, turns: u8) {
        self.turns = (self.turns + turns) % 4;
        for term in &mut self.terms {
            term.1 = (term.1 + turns) % 4;
        }
    }

    fn push(&mut self, segment: u32, turns: u8) {
        let opposite = (segment, (turns + 2) % 4);
        match self.terms.iter().position(|&term| term == opposite) {
            Some(at) => drop(self.terms.swap_remove(at)),
            None => self.terms.push((segment, turns)),
        }
    }

    /// Σ i^b T_s.
    pub fn translation(&self, translations: &[Complex]) -> Complex {
        let terms = self.terms.iter();
        let values =
            terms.map(|&(s, turns)| Complex::quarter_turns(turns) * translations[s as usize]);
        values.fold(Complex::ZERO, |sum, x| sum + x)
    }

    /// The point that the motion z ↦ i^turns z + Σ i^b T_s keeps; turns must not be 0.
    pub fn fixed_point(&self, translations: &[Complex]) -> Complex {
        let rest = Complex::ONE - Complex::quarter_turns(self.turns);
        self.translation(translations) * rest.inverse()
    }

    /// The factors of `terms` with a segment once.
    fn row(&self) -> Vec<(usize, Complex)> {
        let mut row: Vec<(usize, Complex)> = Vec::new();
        for &(segment, turns) in &self.terms {
            let factor = Complex::quarter_turns(turns);
            match row.iter_mut().find(|(s, _)| *s == segment as usize) {
                Some((_, sum)) => *sum += factor,
                None => row.push((segment as usize, factor)),
            }
        }
        row
    }
}

/// See the module's text.
#[derive(Clone, Debug)]
pub(super) struct Transitions {
    /// Expressions of corners; number 0 is u itself.
    pub expressions: Vec<Expression>,
    /// The expression of every corner.
    pub corner: Vec<[u32; 3]>,
    /// Cones, and the whole walk around each.
    pub cones: Vec<(VertexId, Expression)>,
    /// Sums of translations that must vanish.
    pub constraints: Vec<Vec<(usize, Complex)>>,
    /// Halfedges on the left of the cut, with their segment.
    pub left: Vec<(HalfedgeId, u32)>,
    /// Quarter turns of the segments.
    pub turns: Vec<u8>,
}

/// Walks around every vertex of the cut.
///
/// # Errors
/// A cut edge that its segment does not list.
pub(super) fn transitions(
    surface: &FlatSurface,
    connectivity: &Connectivity,
    turns: Vec<u8>,
) -> Result<Transitions, TextureError> {
    let segments = surface.segments.iter().enumerate();
    let along: FxHashSet<(u32, u32, u32)> = segments
        .flat_map(|(s, segment)| {
            segment
                .vertices
                .windows(2)
                .map(move |w| (s as u32, w[0], w[1]))
        })
        .collect();
    let segment_of = |h: HalfedgeId| {
        let (face, corner) = (connectivity.face(h), connectivity.corner(h));
        surface.segment[face.index()][(corner + 2) % 3]
    };
    // True where the halfedge's face lies on the left of its segment.
    let is_left = |h: HalfedgeId, segment: u32| {
        let ends = [connectivity.tail(h), connectivity.head(h)].map(|v| v.raw());
        match ends {
            [a, b] if along.contains(&(segment, a, b)) => Ok(true),
            [a, b] if along.contains(&(segment, b, a)) => Ok(false),
            ends => Err(TextureError::CutEdge { ends, segment }),
        }
    };
    let mut on_cut = vec![false; connectivity.vertex_count()];
    let mut left = Vec::new();
    for h in connectivity.halfedges() {
        let segment = segment_of(h);
        if segment == NONE || connectivity.twin(h).is_none() {
            continue;
        }
        for v in [connectivity.tail(h), connectivity.head(h)] {
            on_cut[v.index()] = true;
        }
        if is_left(h, segment)? {
            left.push((h, segment));
        }
    }
    let mut walked = Transitions {
        expressions: vec![Expression::default()],
        corner: vec![[0; 3]; surface.faces.len()],
        cones: Vec::new(),
        constraints: Vec::new(),
        left,
        turns,
    };
    for v in connectivity.vertices().filter(|v| on_cut[v.index()]) {
        let mut expression = Expression::default();
        let mut number = 0;
        for h in connectivity.outgoing(v) {
            walked.corner[connectivity.face(h).index()][connectivity.corner(h)] = number;
            let next = connectivity.prev(h);
            let segment = segment_of(next);
            if segment == NONE || connectivity.twin(next).is_none() {
                continue;
            }
            let turns = walked.turns[segment as usize];
            match is_left(next, segment)? {
                true => expression.cross_to_right(segment, turns),
                false => expression.cross_to_left(segment, turns),
            }
            number = walked.expressions.len() as u32;
            walked.expressions.push(expression.clone());
        }
        if connectivity.is_boundary_vertex(v) {
            continue;
        }
        match expression.turns {
            0 => {
                let row = expression.row();
                if row.iter().any(|(_, factor)| factor.squared() > 0.0) {
                    walked.constraints.push(row);
                }
            }
            _ => walked.cones.push((v, expression)),
        }
    }
    Ok(walked)
}
