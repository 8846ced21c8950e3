//! What a seamless metric is asked for: cone angles and turnings of loops, in quarter turns.
//!
//! *Enters:* integers from a cross field. *Leaves:* a [`Signature`], and a refusal of those that no metric has. *Guaranteed:* what is refused does not
//! exist. *Not guaranteed:* that what passes exists: "almost any" signature does (Shen, Zhu, Capouellez, Panozzo, Campen, Zorin 2022), and the
//! exceptions known are these.

use crate::flow::holonomy::DualLoops;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{VertexId, VertexVec};

/// Quarter turns of an angle of 2π.
pub const FULL_TURN: i64 = 4;

/// Prescribed cone angles and turnings, in units of π/2.
#[derive(Clone, Debug, PartialEq)]
pub struct Signature {
    /// Cone angle Θ̂ of every vertex; 4 where the surface is flat.
    pub cone: VertexVec<i64>,
    /// Turning κ̂ of every loop.
    pub turning: Vec<i64>,
}

/// Why no metric has a signature.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Infeasible {
    /// Lists have other lengths than the surface has vertices and the loops are many.
    #[error("{given} {what} were given for {needed}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A cone angle is not positive.
    #[error(
        "vertex {vertex} is to have a cone angle of {quarters} quarter turns, but a cone has at least one"
    )]
    BadCone {
        /// Vertex.
        vertex: VertexId,
        /// Its angle, quarter turns.
        quarters: i64,
    },
    /// Gauss–Bonnet (5) is missed.
    #[error(
        "the curvatures of the cones sum to {prescribed} quarter turns, but the surface needs {required} (4 times its Euler characteristic)"
    )]
    GaussBonnet {
        /// Σ (4 − k).
        prescribed: i64,
        /// 4χ.
        required: i64,
    },
    /// A torus without cones is the plane modulo a lattice.
    #[error(
        "loop {of} is to turn by {turning} quarter turns on a torus without cones, where no loop turns at all: ask for turnings of 0, or for cones"
    )]
    FlatTorus {
        /// The loop.
        of: usize,
        /// Its turning.
        turning: i64,
    },
    /// A torus with two cones of opposite curvature: the rotations along all its loops must be more than the powers of the one around the cone
    /// (Izmestiev, Kusner, Rote, Springborn, Sullivan 2013).
    #[error("no torus has just two cones, of {} and {} quarter turns, unless some loop turns by what is no multiple of {} quarter turns (Izmestiev, Kusner, Rote, Springborn, Sullivan 2013): ask for no cones, or for more", cone[0], cone[1], multiple_of)]
    TwoConesOnTorus {
        /// Their angles, quarter turns, ascending.
        cone: [i64; 2],
        /// Every turning is a multiple of this.
        multiple_of: i64,
    },
    /// A half-translation surface of genus 2 with these cones does not exist.
    #[error(
        "no surface of genus 2 has cones of {} quarter turns alone where all loops turn by half turns (the strata Q(4) and Q(3,1) of quadratic differentials are empty; Masur, Smillie 1993): ask for other cones",
        list(cones)
    )]
    EmptyStratum {
        /// Angles of the cones, quarter turns, ascending.
        cones: Vec<i64>,
    },
}

fn list(cones: &[i64]) -> String {
    let words: Vec<String> = cones.iter().map(i64::to_string).collect();
    words.join(" and ")
}

impl Signature {
    /// Refuses what no metric on the surface has; see the module docs.
    pub fn check(&self, connectivity: &Connectivity, loops: &DualLoops) -> Result<(), Infeasible> {
        let counts = [
            ("cone angles", self.cone.len(), connectivity.vertex_count()),
            ("turnings", self.turning.len(), loops.len()),
        ];
        for (what, given, needed) in counts {
            if given != needed {
                return Err(Infeasible::Count {
                    what,
                    given,
                    needed,
                });
            }
        }
        if let Some((vertex, &quarters)) = self.cone.enumerate().find(|(_, k)| **k < 1) {
            return Err(Infeasible::BadCone { vertex, quarters });
        }
        let topology = connectivity.topology();
        let prescribed = self.cone.iter().map(|k| FULL_TURN - k).sum();
        let required = FULL_TURN * topology.euler_characteristic;
        if prescribed != required {
            return Err(Infeasible::GaussBonnet {
                prescribed,
                required,
            });
        }
        // What follows is said of one surface; several pieces have been cut apart along features.
        let mut joined = UnionFind::new(connectivity.vertex_count());
        let ends = connectivity.edges().map(|e| connectivity.edge_vertices(e));
        let joins = ends.filter(|[a, b]| joined.join(a.index(), b.index()));
        if joins.count() + 1 < connectivity.vertex_count() {
            return Ok(());
        }
        // On a double some loops are not listed.
        let are_all = loops.len() as i64 == 2 * topology.genus;
        match (topology.genus, are_all) {
            (1, true) => self.check_torus(),
            (1, false) if self.cones().is_empty() => self.check_torus(),
            (2, true) => self.check_genus_2(),
            _ => Ok(()),
        }
    }

    /// Angles of the cones, ascending.
    fn cones(&self) -> Vec<i64> {
        let cones = self.cone.iter().copied().filter(|&k| k != FULL_TURN);
        let mut cones: Vec<i64> = cones.collect();
        cones.sort_unstable();
        cones
    }

    fn check_torus(&self) -> Result<(), Infeasible> {
        match self.cones()[..] {
            [] => match self.turning.iter().enumerate().find(|(_, t)| **t != 0) {
                Some((of, &turning)) => Err(Infeasible::FlatTorus { of, turning }),
                None => Ok(()),
            },
            [low, high] => {
                // The rotation about either cone generates the quarter turns that are multiples of this.
                let multiple_of = if (FULL_TURN - low) % 2 == 0 { 2 } else { 1 };
                match self.turning.iter().all(|t| t % multiple_of == 0) {
                    true => Err(Infeasible::TwoConesOnTorus {
                        cone: [low, high],
                        multiple_of,
                    }),
                    false => Ok(()),
                }
            }
            _ => Ok(()),
        }
    }

    fn check_genus_2(&self) -> Result<(), Infeasible> {
        let cones = self.cones();
        let half_turns = self.turning.iter().all(|t| t % 2 == 0);
        let trivial = self.turning.iter().all(|t| t % FULL_TURN == 0);
        let is_empty = match cones[..] {
            [12] => half_turns && !trivial,
            [6, 10] => half_turns,
            _ => false,
        };
        match is_empty {
            true => Err(Infeasible::EmptyStratum { cones }),
            false => Ok(()),
        }
    }
}
