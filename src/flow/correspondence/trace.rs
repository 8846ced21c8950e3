//! From the integers to the curves.
//!
//! *Enters:* a correspondence and its two triangulations. *Leaves:* every base edge as its crossings. *Guaranteed:* what is
//! returned is consistent: every base halfedge leaves from one place, every curve ends where its other halfedge leaves, and all
//! crossings counted are met once. Time and memory are linear in the number of crossings.

use super::{Arcs, COINCIDENT, Correspondence, CorrespondenceError, Crossing, Curves};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec};

use CorrespondenceError::Inconsistent;

/// One base halfedge as a curve on the current triangulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// The current halfedge that it is, if it is one.
    pub along: Option<HalfedgeId>,
    /// What it crosses, in order.
    pub crossing: Vec<Crossing>,
}

/// How a base halfedge sets out from its tail.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Departure {
    /// It is this current halfedge.
    Along(HalfedgeId),
    /// Into a face, whose opposite side it crosses here.
    Through(Crossing),
}

impl Correspondence {
    /// Every base edge as the sequence of current edges that it crosses. `base` is what [`Self::identity`] was given, `current` what
    /// has undergone all the flips that were told since.
    ///
    /// # Errors
    /// Coordinates that overflowed earlier, more than 2³² − 1 crossings, or triangulations that do not belong to the integers.
    pub fn trace(
        &self,
        base: &Connectivity,
        current: &Connectivity,
    ) -> Result<Curves, CorrespondenceError> {
        let count = self.crossings()?;
        let too_many = || CorrespondenceError::TooManyCrossings { count };
        let total = u32::try_from(count).map_err(|_| too_many())? as usize;
        let tracer = Tracer::new(self, base, current)?;
        let mut crossing = Vec::new();
        crossing.try_reserve_exact(total).map_err(|_| too_many())?;
        let mut first = Vec::with_capacity(base.edge_count() + 1);
        let mut coincident = EdgeVec::filled(None, base.edge_count());
        for e in base.edges() {
            first.push(crossing.len() as u32);
            coincident[e] = tracer.follow(base.edge_halfedge(e), total, &mut crossing)?;
        }
        first.push(crossing.len() as u32);
        if crossing.len() != total {
            return Err(Inconsistent("there are crossings on no base edge"));
        }
        Ok(Curves {
            first,
            crossing,
            coincident,
        })
    }

    /// Some base halfedges alone.
    pub fn follow(
        &self,
        base: &Connectivity,
        current: &Connectivity,
        runs: &[HalfedgeId],
    ) -> Result<Vec<Followed>, CorrespondenceError> {
        let count = self.crossings()?;
        let total =
            u32::try_from(count).map_err(|_| CorrespondenceError::TooManyCrossings { count });
        let total = total? as usize;
        // What sets out elsewhere does not matter.
        let mut ends: Vec<VertexId> = (runs.iter())
            .flat_map(|&b| [base.tail(b), base.head(b)])
            .collect();
        ends.sort_unstable();
        ends.dedup();
        let tracer = Tracer::at(self, base, current, &ends)?;
        let follow = |&b: &HalfedgeId| {
            let mut crossing = Vec::new();
            let along = tracer.follow(b, total, &mut crossing)?;
            Ok(Followed { along, crossing })
        };
        runs.iter().map(follow).collect()
    }
}

pub(super) struct Tracer<'a> {
    integers: &'a Correspondence,
    base: &'a Connectivity,
    current: &'a Connectivity,
    /// Base halfedges around every vertex, in the order in which roundabouts count; `None` for the edge that closes the fan
    /// of a boundary vertex.
    around: Vec<Option<HalfedgeId>>,
    /// Where a vertex begins in `around`; [`NONE`] where nobody asked for it.
    first: VertexVec<u32>,
    /// Where a base halfedge stands in `around`; [`NONE`] where nobody asked for its tail.
    place: HalfedgeVec<u32>,
    /// How each of `around` sets out.
    departure: Vec<Option<Departure>>,
}

impl<'a> Tracer<'a> {
    pub(super) fn new(
        integers: &'a Correspondence,
        base: &'a Connectivity,
        current: &'a Connectivity,
    ) -> Result<Self, CorrespondenceError> {
        Self::at(
            integers,
            base,
            current,
            &base.vertices().collect::<Vec<_>>(),
        )
    }

    /// What is needed to follow base edges between some vertices.
    fn at(
        integers: &'a Correspondence,
        base: &'a Connectivity,
        current: &'a Connectivity,
        vertices: &[VertexId],
    ) -> Result<Self, CorrespondenceError> {
        if !integers.has_size_of(base) || !integers.has_size_of(current) {
            return Err(CorrespondenceError::OtherSize);
        }
        let mut around = Vec::new();
        let mut first = VertexVec::filled(NONE, base.vertex_count());
        for &v in vertices {
            let start = around.len();
            first[v] = start as u32;
            around.extend(base.outgoing(v).map(Some));
            around.extend(base.is_boundary_vertex(v).then_some(None));
            if around.len() - start != integers.valence[v] as usize {
                return Err(Inconsistent("a base vertex has another number of edges"));
            }
        }
        let mut place = HalfedgeVec::filled(NONE, base.halfedge_count());
        for (at, h) in (0..).zip(&around) {
            if let Some(h) = h {
                place[*h] = at;
            }
        }
        let mut tracer = Tracer {
            place,
            integers,
            base,
            current,
            departure: vec![None; around.len()],
            around,
            first,
        };
        for &v in vertices {
            for h in current.outgoing(v) {
                tracer.depart(h)?;
            }
        }
        Ok(tracer)
    }

    /// Finds which base halfedges set out between a current halfedge and the next counterclockwise: the sector knows how
    /// many there are, and the roundabout which one is the first.
    fn depart(&mut self, h: HalfedgeId) -> Result<(), CorrespondenceError> {
        let along = i64::from(self.normal(h) == COINCIDENT);
        // Corners in the order tail, head, apex of h.
        let arcs = self.arcs(h);
        if along + arcs.from[0] > i64::from(self.integers.valence[self.current.tail(h)]) {
            return Err(Inconsistent("a corner sends out more edges than there are"));
        }
        for k in 0..along + arcs.from[0] {
            let slot = self
                .slot(h, k)
                .filter(|&slot| self.around[slot].is_some())
                .ok_or(Inconsistent("a boundary edge enters a face"))?;
            let departure = if k < along {
                Departure::Along(h)
            } else {
                let halfedge = self.current.next(h);
                // All coordinates fit 32 bits, since their sum does.
                let rank = (arcs.cut[1] + k - along) as u32;
                Departure::Through(Crossing { halfedge, rank })
            };
            if self.departure[slot].replace(departure).is_some() {
                return Err(Inconsistent("a base edge sets out twice"));
            }
        }
        Ok(())
    }

    /// How a base halfedge sets out.
    fn departure(&self, b: HalfedgeId) -> Option<Departure> {
        let place = self.place[b] as usize;
        self.departure.get(place).copied().flatten()
    }

    /// Runs along a base halfedge and adds its crossings; the current halfedge that it is, if it is one. Fails before there are
    /// more than `total` crossings.
    pub(super) fn follow(
        &self,
        b: HalfedgeId,
        total: usize,
        crossing: &mut Vec<Crossing>,
    ) -> Result<Option<HalfedgeId>, CorrespondenceError> {
        let mut at = match self.departure(b) {
            None => return Err(Inconsistent("a base edge does not set out")),
            Some(Departure::Along(h)) => {
                let back = self.base.twin(b).map(|t| self.departure(t));
                let expected = self.current.twin(h).map(|t| Some(Departure::Along(t)));
                return if back == expected {
                    Ok(Some(h))
                } else {
                    Err(Inconsistent("an edge is two base edges"))
                };
            }
            Some(Departure::Through(c)) => c,
        };
        loop {
            let n = self.normal(at.halfedge);
            let rank = n - 1 - i64::from(at.rank);
            if rank < 0 || crossing.len() == total {
                return Err(Inconsistent(
                    "a curve crosses an edge beyond its last place",
                ));
            }
            crossing.push(at);
            let t = self
                .current
                .twin(at.halfedge)
                .ok_or(Inconsistent("a curve leaves across the boundary"))?;
            // In the new face, rank counts from the tail of t.
            let arcs = self.arcs(t);
            let prev = self.current.prev(t);
            at = if rank < arcs.cut[0] {
                let beyond = self.normal(prev) - 1 - rank;
                Crossing {
                    halfedge: prev,
                    rank: u32::try_from(beyond)
                        .map_err(|_| Inconsistent("a curve has no place on an edge"))?,
                }
            } else if rank >= arcs.cut[0] + arcs.from[2] {
                // At this side's head the cutting arcs are met from the other end.
                Crossing {
                    halfedge: self.current.next(t),
                    rank: at.rank,
                }
            } else {
                let along = i64::from(self.normal(prev) == COINCIDENT);
                let end = self.base_halfedge(prev, along + rank - arcs.cut[0]);
                return if end.is_some() && end == self.base.twin(b) {
                    Ok(None)
                } else {
                    Err(Inconsistent("a base edge ends where another one sets out"))
                };
            };
        }
    }

    /// The k-th base halfedge counterclockwise at or after a current halfedge.
    fn base_halfedge(&self, h: HalfedgeId, k: i64) -> Option<HalfedgeId> {
        self.slot(h, k).and_then(|slot| self.around[slot])
    }

    /// Where that stands in `around`; `None` at a vertex that nobody asked for.
    fn slot(&self, h: HalfedgeId, k: i64) -> Option<usize> {
        let v = self.current.tail(h);
        let slot = i64::from(self.integers.roundabout[h]) + k;
        let slot = slot % i64::from(self.integers.valence[v]);
        (self.first[v] != NONE).then(|| self.first[v] as usize + slot as usize)
    }

    /// The arcs in the face of a halfedge, at its tail, head and apex in this order.
    fn arcs(&self, h: HalfedgeId) -> Arcs {
        let (next, prev) = (self.current.next(h), self.current.prev(h));
        Arcs::new([self.normal(next), self.normal(prev), self.normal(h)])
    }

    fn normal(&self, h: HalfedgeId) -> i64 {
        self.integers.normal[self.current.edge(h)]
    }
}
