//! The verdict against all subsets of small triangulations, counted in exact arithmetic that shares nothing with the library's.

use super::gluing::{BOUNDED, CLOSED};
use super::*;
use crate::geometry::connectivity::Connectivity;

/// π in the unit of this test: 3 · 2⁸⁴, so that multiples of π/48 and doubles of ordinary size are whole numbers.
const HALF_TURN: i128 = 3 << 84;
/// π/48.
const STEP: i128 = HALF_TURN / 48;

/// What a double stands for: the multiple of π/48 within two units in the last place, or the double over π as it is.
fn exact(radians: f64) -> i128 {
    let x = radians / PI;
    let steps = (48.0 * x).round();
    if (x - steps / 48.0).abs() <= 2.0 * f64::EPSILON * x.abs().max(1.0) {
        return steps as i128 * STEP;
    }
    // x 2⁸⁴ is a double without loss, and a whole number where |x| > 2⁻³².
    3 * (x * (84.0_f64).exp2()) as i128
}

/// A random problem.
struct Case {
    connectivity: Connectivity,
    phi: Option<EdgeVec<f64>>,
    target: VertexVec<f64>,
    boundary: BoundaryCondition,
}

/// Least slack over all sets, by the formulas of `docs/method.md`, 1, as they stand there.
struct Brute {
    counted: Vec<VertexId>,
    theta: VertexVec<i128>,
    faces: Vec<[(VertexId, i128); 3]>,
    whole_is_a_set: bool,
}

impl Brute {
    fn new(case: &Case) -> Self {
        let c = &case.connectivity;
        let free = case.boundary == BoundaryCondition::Free;
        let counted: Vec<VertexId> = c
            .vertices()
            .filter(|&v| !(free && c.is_boundary_vertex(v)))
            .collect();
        let full = |v: VertexId| if c.is_boundary_vertex(v) { 1 } else { 2 };
        let theta = c
            .vertices()
            .map(|v| full(v) * HALF_TURN - exact(case.target[v]))
            .collect();
        // A corner's vertex, and Φ of the edge opposite.
        let phi = |h| {
            let e = c.edge(c.next(h));
            case.phi.as_ref().map_or(0, |phi| exact(phi[e]))
        };
        let corners = |f| c.face_halfedges(f).map(|h| (c.tail(h), phi(h)));
        Self {
            whole_is_a_set: counted.len() < c.vertex_count(),
            counted,
            theta,
            faces: c.faces().map(corners).collect(),
        }
    }

    /// Σ_faces h − Σ_I Θ, and Σ_I Θ − Σ_faces (three: π; two: Φ of their edge; one: 0).
    fn slacks(&self, set: &[VertexId]) -> [i128; 2] {
        let theta: i128 = set.iter().map(|&v| self.theta[v]).sum();
        let (mut most, mut least) = (0, 0);
        for corners in &self.faces {
            let inside = corners.map(|(v, _)| set.contains(&v));
            match inside.iter().filter(|&&i| i).count() {
                0 => {}
                1 => {
                    let k = inside.iter().position(|&i| i).unwrap();
                    most += HALF_TURN - corners[k].1;
                }
                2 => {
                    let k = inside.iter().position(|&i| !i).unwrap();
                    most += HALF_TURN;
                    least += corners[k].1;
                }
                _ => {
                    most += HALF_TURN;
                    least += HALF_TURN;
                }
            }
        }
        [most - theta, theta - least]
    }

    fn least(&self) -> i128 {
        let proper = |set: &Vec<VertexId>| set.len() < self.counted.len() || self.whole_is_a_set;
        let sets = subsets(&self.counted).filter(proper);
        sets.flat_map(|set| self.slacks(&set)).min().unwrap_or(1)
    }
}

/// A whole number from `low` to `high`.
fn between(random: &mut impl FnMut() -> f64, low: i64, high: i64) -> i64 {
    low + (random() * (high - low + 1) as f64) as i64
}

/// How Φ is drawn: none, 0 and π/2, multiples of π/12, any.
fn draw_phi(
    c: &Connectivity,
    kind: usize,
    random: &mut impl FnMut() -> f64,
) -> Option<EdgeVec<f64>> {
    let mut angle = || match kind {
        1 => between(random, 0, 1) as f64 * 0.5 * PI,
        2 => between(random, 0, 6) as f64 / 12.0 * PI,
        _ => (1.4 * random() - 0.2).clamp(0.0, 1.0) * 0.5 * PI,
    };
    (kind > 0).then(|| c.edges().map(|_| angle()).collect())
}

/// Curvatures in steps of π/12, strong ones at few vertices, with the total that Gauss–Bonnet asks for.
fn draw_curvatures(
    c: &Connectivity,
    free: bool,
    random: &mut impl FnMut() -> f64,
) -> Option<VertexVec<f64>> {
    let n = c.vertex_count();
    let border = |v: usize| c.is_boundary_vertex(VertexId::new(v));
    let counted: Vec<usize> = (0..n).filter(|&v| !(free && border(v))).collect();
    let mut twelfths = vec![0i64; n];
    let strength = [4, 12, 30][between(random, 0, 2) as usize];
    for &v in &counted {
        twelfths[v] = between(random, -strength, strength);
    }
    let mut missing = 24 * c.topology().euler_characteristic - twelfths.iter().sum::<i64>();
    while !free && missing != 0 {
        let step = missing.clamp(-5, 5);
        twelfths[counted[between(random, 0, counted.len() as i64 - 1) as usize]] += step;
        missing -= step;
    }
    let fits = |&v: &usize| twelfths[v] < if border(v) { 12 } else { 24 };
    counted
        .iter()
        .all(fits)
        .then(|| twelfths.iter().map(|&k| k as f64 / 12.0 * PI).collect())
}

/// Curvatures of corner angles in steps of π/48, each within (0, π − Φ) of the edge opposite: (6) holds. With `tight`, a set,
/// all that its faces hold lies in its corners, so that its slack is zero and no set has less.
fn draw_angles(
    c: &Connectivity,
    phi: Option<&EdgeVec<f64>>,
    tight: Option<&VertexVec<bool>>,
    random: &mut impl FnMut() -> f64,
) -> VertexVec<f64> {
    let mut angle = VertexVec::filled(0i64, c.vertex_count());
    for f in c.faces() {
        let corners = c.face_halfedges(f);
        let room = corners.map(|h| {
            let phi = phi.map_or(0.0, |phi| phi[c.edge(c.next(h))]);
            (48.0 * (1.0 - phi / PI) + 1e-9).floor() as i64
        });
        let inside = corners.map(|h| tight.is_some_and(|t| t[c.tail(h)]));
        let spare = i64::from(tight.is_none());
        let (mut low, mut high) = ([spare; 3], room.map(|r| r - spare));
        let (count, odd) = match inside.iter().filter(|&&i| i).count() {
            1 => (1, inside.iter().position(|&i| i)),
            n => (n, inside.iter().position(|&i| !i)),
        };
        if let (1 | 2, Some(k)) = (count, odd) {
            let value = if count == 1 { room[k] } else { 0 };
            (low[k], high[k]) = (value, value);
        }
        // One after the other, within what the rest can take.
        let mut left = 48;
        for k in 0..3 {
            let rest = |bound: &[i64; 3]| bound[k + 1..].iter().sum::<i64>();
            let own = between(
                random,
                low[k].max(left - rest(&high)),
                high[k].min(left - rest(&low)),
            );
            left -= own;
            angle[c.tail(corners[k])] += own;
        }
        assert_eq!(left, 0);
    }
    let full = |v| if c.is_boundary_vertex(v) { 48 } else { 96 };
    angle
        .enumerate()
        .map(|(v, &a)| (full(v) - a) as f64 / 48.0 * PI)
        .collect()
}

fn draw(round: usize, random: &mut impl FnMut() -> f64) -> Option<Case> {
    let word = match round % 2 {
        0 => &CLOSED[round / 2 % 4],
        _ => &BOUNDED[round / 2 % 4],
    };
    let connectivity = word.triangulate(4 + round % 5 + round / 8 % 2, random);
    let c = &connectivity;
    let boundary = match round / 8 % 2 {
        0 => BoundaryCondition::Free,
        _ => BoundaryCondition::Prescribed,
    };
    let free = boundary == BoundaryCondition::Free && !c.is_closed();
    let phi_kind = round / 16 % 4;
    let phi = draw_phi(c, phi_kind, random);
    let fractions = phi.as_ref().filter(|_| phi_kind < 3);
    let target = match round / 5 % 4 {
        0 => draw_curvatures(c, free, random)?,
        1 => draw_angles(c, phi.as_ref(), None, random),
        kind => {
            // Equality, or hardly more or less: only where the bounds are multiples of π/48.
            if phi.is_some() && fractions.is_none() {
                return None;
            }
            let set: VertexVec<bool> = c.vertices().map(|_| random() < 0.4).collect();
            let mut target = draw_angles(c, fractions, Some(&set), random);
            let prescribed = |v: &VertexId| !(free && c.is_boundary_vertex(*v));
            let ends = [true, false].map(|side| {
                let of_side = |v: &VertexId| set[*v] == side && prescribed(v);
                c.vertices().find(of_side)
            });
            if let (3, [Some(v), Some(w)]) = (kind, ends) {
                let size = [2.0e-6, 1.0e-9, 3.0e-12, 2.0e-14][between(random, 0, 3) as usize];
                let sign = if random() < 0.5 { 1.0 } else { -1.0 };
                // By an amount that rounding takes from the one as it gives it to the other.
                let whole = target.iter().map(|&k| exact(k)).sum::<i128>();
                let nudged = (0..1000).find_map(|k| {
                    let nudge = sign * size * (1.0 + 1e-3 * f64::from(k));
                    let mut target = target.clone();
                    target[v] += nudge;
                    target[w] -= nudge;
                    let total: i128 = target.iter().map(|&k| exact(k)).sum();
                    (total == whole).then_some(target)
                });
                target = nudged?;
            }
            target
        }
    };
    // Cone angles are positive.
    let positive = |(v, &k): (VertexId, &f64)| {
        (free && c.is_boundary_vertex(v))
            || k < if c.is_boundary_vertex(v) {
                PI
            } else {
                2.0 * PI
            }
    };
    let fits = target.enumerate().all(positive);
    fits.then_some(Case {
        connectivity,
        phi,
        target,
        boundary,
    })
}

#[test]
fn verdict_and_least_slack_are_those_of_all_subsets() {
    let mut random = shapes::sequence(2024);
    // [holds, holds barely, equality, fails barely, fails] for closed, free and prescribed boundaries.
    let mut outcomes = [[0usize; 5]; 3];
    let (mut cases, mut loops, mut topologies) = (0, 0, std::collections::BTreeSet::new());
    let mut phis = [0usize; 4];
    let mut round = 0;
    while cases < 2000 {
        round += 1;
        let Some(case) = draw(round, &mut random) else {
            continue;
        };
        let Case {
            connectivity: c,
            phi,
            target,
            boundary,
        } = &case;
        let brute = Brute::new(&case);
        let least = brute.least();
        let mut constraint = Constraint::new(c, phi.as_ref(), target, *boundary, 1.0);
        let regions = constraint.offending_regions();
        assert_eq!(
            regions.is_empty(),
            least > 0,
            "round {round}: least slack {:e}π, {regions:?}",
            least as f64 / HALF_TURN as f64
        );
        let radians = |units: i128| units as f64 / HALF_TURN as f64 * PI;
        let near =
            |a: f64, b: f64| (a == 0.0) == (b == 0.0) && (a - b).abs() <= 3e-15 * (1.0 + b.abs());
        // What the regions lack together is what the worst set lacks.
        let total: f64 = regions.iter().map(|r| r.slack).sum();
        assert!(
            near(total, radians(least.min(0))),
            "round {round}: {total:e} {:e}",
            radians(least)
        );
        for region in &regions {
            let [upper, lower] = brute.slacks(&region.vertices);
            let own = if region.side == Side::Below {
                upper
            } else {
                lower
            };
            assert!(near(region.slack, radians(own)) && own <= 0);
            assert!(region.vertices.iter().all(|v| brute.counted.contains(v)));
        }
        // The message has the worst region, and its two sides.
        match check(&mut constraint) {
            Ok(()) => assert!(least > 0),
            Err(worst) => {
                assert!(least <= 0);
                assert!(regions.iter().all(|r| worst.slack <= r.slack));
                let curvature: f64 = worst.vertices.iter().map(|&v| target[v]).sum();
                assert!((curvature - worst.curvature).abs() < 1e-12);
                let gap = match worst.side {
                    Side::Below => worst.curvature - worst.bound,
                    Side::Above => worst.bound - worst.curvature,
                };
                assert!(
                    (gap - worst.slack).abs() < 1e-12 * (1.0 + worst.bound.abs()) && gap <= 1e-12
                );
            }
        }
        let singles = brute.counted.iter().map(|&v| brute.slacks(&[v]));
        let tightest = singles.map(|s| s[0].min(s[1])).min().map(radians);
        let own = constraint.tightest_vertex().map(|(_, slack)| slack);
        if let (Some(a), Some(b)) = (own, tightest) {
            assert!(near(a, b), "{a:e} {b:e}");
        }
        cases += 1;
        let ends_meet = |e| c.edge_vertices(e)[0] == c.edge_vertices(e)[1];
        loops += usize::from(c.edges().any(ends_meet));
        let topology = c.topology();
        topologies.insert((topology.genus, topology.boundary_loops));
        let kind = match (c.is_closed(), boundary) {
            (true, _) => 0,
            (false, BoundaryCondition::Free) => 1,
            (false, _) => 2,
        };
        let barely = least.abs() < HALF_TURN / 100_000;
        outcomes[kind][match (least.signum(), barely) {
            (1, false) => 0,
            (1, true) => 1,
            (0, _) => 2,
            (_, true) => 3,
            _ => 4,
        }] += 1;
        phis[match phi {
            None => 0,
            Some(phi) if phi.iter().all(|p| *p == 0.0 || *p == 0.5 * PI) => 1,
            Some(_) => 2 + usize::from(round / 16 % 4 == 3),
        }] += 1;
    }
    println!("{outcomes:?} {topologies:?} Φ {phis:?}, {loops} of {cases} with loops");
    assert!(outcomes.iter().flatten().all(|&n| n >= 5), "{outcomes:?}");
    assert_eq!(topologies.len(), 7);
    assert!(loops > cases / 4 && phis.iter().all(|&n| n > 50));
}
