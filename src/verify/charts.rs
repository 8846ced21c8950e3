//! Boundary and node charts: shape, transitions, cocycle, and that together they cover the surface.

use super::Verdicts;
use super::arrays::Arrays;
use super::central::{FLOOR, Slit, length_error, length_tolerance};
use super::document::Document;
use super::formulas::{Extent2, Motion, Point2, Worst, distance2, is_positive};
use super::metric::FLAT;
use super::surface::Surface;
use std::collections::{BTreeMap, BTreeSet};

/// Largest residual of a transition, in diameters of its chart, beyond the floor.
const RESIDUAL_TOLERANCE: f64 = 1e-8;
/// Largest gap between entries that are glued, in diameters of the chart.
const GLUE_TOLERANCE: f64 = 1e-7;
/// Faces in more sectors than this are compared with their neighbours in the list only.
const PAIR_LIMIT: usize = 24;

/// Where a chart lies in its plane.
#[derive(Clone, Copy)]
struct Size {
    centre: Point2,
    diameter: f64,
}

/// Entries of one chart by face.
struct Entries<'a> {
    faces: &'a [u32],
    uv: &'a [[Point2; 3]],
    diameter: f64,
    /// (face, row), ascending.
    order: Vec<(u32, u32)>,
}

impl Entries<'_> {
    /// Rows of a face.
    fn rows(&self, face: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        let face = face as u32;
        let start = self.order.partition_point(|entry| entry.0 < face);
        self.order[start..]
            .iter()
            .take_while(move |entry| entry.0 == face)
            .map(|entry| entry.1 as usize)
    }

    /// Whether some entries of the two faces meet along both ends of a halfedge and its twin.
    fn glued(&self, surface: &Surface<'_>, h: usize, t: usize) -> bool {
        let near = |i: usize, a: usize, j: usize, b: usize| {
            let gap = distance2(self.uv[i][a % 3], self.uv[j][b % 3]);
            gap < GLUE_TOLERANCE * self.diameter
        };
        let (tail, head) = (surface.tail_corner(h), surface.head_corner(h));
        let (twin_tail, twin_head) = (surface.tail_corner(t), surface.head_corner(t));
        self.rows(h / 3).any(|i| {
            self.rows(t / 3)
                .any(|j| near(i, tail, j, twin_head) && near(i, head, j, twin_tail))
        })
    }

    /// Whether every face at a vertex is in the chart and meets the next across every inner edge, cut or not.
    fn has_star(&self, surface: &Surface<'_>, v: usize) -> bool {
        surface.corners_of(v).iter().all(|corner| {
            let h = surface.outgoing(*corner as usize);
            self.rows(h / 3).next().is_some()
                && surface.twin(h).is_none_or(|t| self.glued(surface, h, t))
        })
    }
}

#[derive(Default)]
struct Tally {
    missing: usize,
    repeated: usize,
    flipped: usize,
    untrue: usize,
    residual: Worst,
    length: Worst,
    edge_covered: Vec<bool>,
    inner_covered: BTreeSet<usize>,
    node_covered: BTreeSet<usize>,
}

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    slit: &Slit,
    verdicts: &mut Verdicts,
) {
    let mut transitions = BTreeMap::new();
    let mut tally = Tally {
        edge_covered: vec![false; surface.halfedges()],
        ..Tally::default()
    };
    for (row, t) in document.transitions.iter().enumerate() {
        tally.repeated += usize::from(transitions.insert((t.to, t.sector), row).is_some());
    }
    let mut used = vec![false; document.transitions.len()];
    let mut sizes = vec![Size {
        centre: [0.0, 0.0],
        diameter: slit.diameter,
    }];
    for chart in 1..document.charts.len() {
        let range = arrays.chart_range(chart);
        let (faces, uv) = (
            &arrays.chart_face[range.clone()],
            &arrays.chart_uv[range.clone()],
        );
        let extent = Extent2::of(uv.as_flattened().iter().copied());
        let diameter = extent.diagonal().max(1e-300);
        let centre = std::array::from_fn(|i| 0.5 * (extent.min[i] + extent.max[i]));
        sizes.push(Size { centre, diameter });
        if faces.is_empty() {
            tally.missing += 1;
            continue;
        }
        let sectors = &arrays.chart_sector[range];
        let reach = extent.reach();
        for (face, t) in faces.iter().zip(uv) {
            tally.flipped += usize::from(!is_positive(*t, reach));
            let flat = arrays.flat_length[*face as usize];
            tally.length.see(length_error(*t, flat, diameter));
        }
        for sector in BTreeSet::from_iter(sectors.iter().copied()) {
            let Some(row) = transitions.get(&(chart, sector)) else {
                tally.missing += 1;
                continue;
            };
            used[*row] = true;
            let transition = &document.transitions[*row];
            let motion = transition.motion();
            let mut residual = Worst::default();
            let mut count = 0;
            for i in (0..faces.len()).filter(|i| sectors[*i] == sector) {
                count += 1;
                let central = arrays.central_uv[faces[i] as usize];
                for k in 0..3 {
                    residual.see(distance2(motion.apply(central[k]), uv[i][k]));
                }
            }
            let beyond = (residual.0 - FLOOR * slit.diameter).max(0.0) / diameter;
            tally.residual.see(beyond);
            let off = (transition.residual.unwrap_or(residual.0) - residual.0).abs();
            let told = off <= RESIDUAL_TOLERANCE * diameter + FLOOR * slit.diameter;
            let counted = transition.faces.unwrap_or(count) == count;
            tally.untrue += usize::from(!(told && counted));
        }
        cover(surface, document, chart, arrays, diameter, &mut tally);
        let mut keys: Vec<(u32, u8)> = faces.iter().copied().zip(sectors.iter().copied()).collect();
        keys.sort_unstable();
        tally.repeated += keys.windows(2).filter(|pair| pair[0] == pair[1]).count();
    }
    tally.missing += used.iter().filter(|used| !**used).count();
    report(surface, arrays, document, slit, &tally, verdicts);
    check_cocycle(arrays, document, &transitions, &sizes, verdicts);
    check_sides(document, &transitions, &sizes, verdicts);
}

/// What one chart covers: cut edges glued across, inner vertices of a segment, or a node.
fn cover(
    surface: &Surface<'_>,
    document: &Document,
    chart: usize,
    arrays: &Arrays,
    diameter: f64,
    tally: &mut Tally,
) {
    let range = arrays.chart_range(chart);
    let faces = &arrays.chart_face[range.clone()];
    // Of a face that is in the same sector twice (a failed check of its own) the first entry counts.
    let mut order: Vec<(u32, u8, u32)> = (0u32..)
        .zip(faces)
        .map(|(row, face)| (*face, arrays.chart_sector[range.start + row as usize], row))
        .collect();
    order.sort_unstable();
    order.dedup_by_key(|entry| (entry.0, entry.1));
    let entries = Entries {
        faces,
        uv: &arrays.chart_uv[range.clone()],
        diameter,
        order: order
            .into_iter()
            .map(|(face, _, row)| (face, row))
            .collect(),
    };
    let listed = &document.charts[chart];
    match (listed.kind.as_str(), listed.segment, listed.vertex) {
        ("boundary", Some(segment), _) => {
            let (cut, of) = (arrays.cut.as_flattened(), arrays.segment.as_flattened());
            let mut distinct: Vec<u32> = entries.faces.to_vec();
            distinct.sort_unstable();
            distinct.dedup();
            for h in distinct
                .iter()
                .flat_map(|f| 3 * *f as usize..3 * *f as usize + 3)
            {
                if cut[h] == 0 || of[h] as usize != segment {
                    continue;
                }
                if let Some(t) = surface.twin(h).filter(|t| entries.glued(surface, h, *t)) {
                    tally.edge_covered[h] = true;
                    tally.edge_covered[t] = true;
                }
            }
            let vertices = &document.segments[segment].vertices;
            for v in &vertices[1..vertices.len() - 1] {
                if entries.has_star(surface, *v) {
                    tally.inner_covered.insert(*v);
                }
            }
        }
        ("node", _, Some(v)) if entries.has_star(surface, v) => {
            tally.node_covered.insert(v);
        }
        _ => {}
    }
}

fn report(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    slit: &Slit,
    tally: &Tally,
    verdicts: &mut Verdicts,
) {
    verdicts.note(
        "every chart has its transitions",
        tally.missing == 0,
        format!("{} missing", tally.missing),
    );
    verdicts.note(
        "no face is in a sector twice",
        tally.repeated == 0,
        format!("{} repeated", tally.repeated),
    );
    verdicts.note(
        "transitions are rigid motions",
        tally.residual.0 < RESIDUAL_TOLERANCE,
        format!("{:.3e} of the chart's diameter", tally.residual.0),
    );
    verdicts.note(
        "transitions state their faces and residual",
        tally.untrue == 0,
        format!("{} untrue", tally.untrue),
    );
    verdicts.note(
        "charts keep flat lengths",
        tally.length.0 < length_tolerance(document),
        format!("{:.3e}", tally.length.0),
    );
    verdicts.note(
        "charts' orientation positive",
        tally.flipped == 0,
        format!("{} faces", tally.flipped),
    );
    let cut = arrays.cut.as_flattened();
    let bare = (0..surface.halfedges())
        .filter(|h| cut[*h] != 0 && surface.twin(*h).is_some() && !tally.edge_covered[*h])
        .count();
    verdicts.note(
        "boundary charts glue both sides of every cut edge",
        bare == 0,
        format!("{bare} halfedges uncovered"),
    );
    let inner: BTreeSet<usize> = document
        .segments
        .iter()
        .flat_map(|s| &s.vertices[1..s.vertices.len() - 1])
        .copied()
        .collect();
    let bare = inner.difference(&tally.inner_covered).count();
    verdicts.note(
        "boundary charts cover the inner vertices of their segments",
        bare == 0,
        format!("{bare} of {} uncovered", inner.len()),
    );
    let nodes: BTreeSet<usize> = document
        .segments
        .iter()
        .flat_map(|s| [s.from, s.to])
        .filter(|v| surface.on_boundary[*v] || arrays.target_curvature[*v].abs() < FLAT)
        .collect();
    let bare = nodes.difference(&tally.node_covered).count();
    verdicts.note(
        "node charts cover flat and boundary nodes",
        bare == 0,
        format!("{bare} of {} uncovered", nodes.len()),
    );
    // Off the cut the central chart covers a vertex; on it a boundary or node chart must, or a cone sits there.
    let mut on_cut = BTreeSet::new();
    for h in (0..surface.halfedges()).filter(|h| slit.is_glued(*h) || cut[*h] != 0) {
        on_cut.insert(surface.tail(h));
        on_cut.insert(surface.head(h));
    }
    let bare = on_cut
        .iter()
        .filter(|v| {
            let cone = !surface.on_boundary[**v] && arrays.target_curvature[**v].abs() >= FLAT;
            !cone && !tally.inner_covered.contains(v) && !tally.node_covered.contains(v)
        })
        .count();
    verdicts.note(
        "charts cover the surface but its cones",
        bare == 0,
        format!("{bare} vertices uncovered"),
    );
}

/// For any two sectors that share a face, φ_0c ∘ φ_0b⁻¹ takes the face's coordinates in b to those in c, and
/// through a third sector it comes to the same.
fn check_cocycle(
    arrays: &Arrays,
    document: &Document,
    transitions: &BTreeMap<(usize, u8), usize>,
    sizes: &[Size],
    verdicts: &mut Verdicts,
) {
    let mut entries: Vec<(u32, u32, u32)> = Vec::with_capacity(arrays.chart_face.len());
    for chart in 1..document.charts.len() {
        for row in arrays.chart_range(chart) {
            entries.push((arrays.chart_face[row], chart as u32, row as u32));
        }
    }
    entries.sort_unstable();
    let known: Vec<(u32, u32, usize, Motion)> = entries
        .iter()
        .filter_map(|(face, chart, row)| {
            let sector = arrays.chart_sector[*row as usize];
            let at = transitions.get(&(*chart as usize, sector))?;
            Some((
                *face,
                *chart,
                *row as usize,
                document.transitions[*at].motion(),
            ))
        })
        .collect();
    let (mut two, mut three) = (Worst::default(), Worst::default());
    let (mut pairs, mut triples) = (0usize, 0usize);
    for shared in known.chunk_by(|x, y| x.0 == y.0).filter(|s| s.len() > 1) {
        let n = shared.len();
        let allowed = |i: usize, j: usize| {
            let size = |i: usize| sizes[shared[i].1 as usize].diameter;
            size(i).max(size(j)) + FLOOR / RESIDUAL_TOLERANCE * sizes[0].diameter
        };
        let gap = |via: &[usize], to: usize| {
            let start = &arrays.chart_uv[shared[via[0]].2];
            let mut worst = Worst::default();
            for (k, start) in start.iter().enumerate() {
                let mut p = *start;
                for step in via.windows(2) {
                    p = shared[step[1]].3.apply(shared[step[0]].3.inverse_apply(p));
                }
                let last = via[via.len() - 1];
                p = shared[to].3.apply(shared[last].3.inverse_apply(p));
                worst.see(distance2(p, arrays.chart_uv[shared[to].2][k]));
            }
            worst.0
        };
        for i in 0..n {
            for j in (0..n).filter(|j| *j != i) {
                if n > PAIR_LIMIT && j != (i + 1) % n {
                    continue;
                }
                pairs += 1;
                two.see(gap(&[i], j) / allowed(i, j));
                let Some(k) = (1..n).map(|d| (j + d) % n).find(|k| *k != i && *k != j) else {
                    continue;
                };
                triples += 1;
                three.see(gap(&[i, j], k) / allowed(i, k).max(allowed(i, j)));
            }
        }
    }
    // Two transitions may each be off by their tolerance.
    let bound = 3.0 * RESIDUAL_TOLERANCE;
    verdicts.note(
        "cocycle holds on shared faces, both ways",
        two.0 < bound,
        format!("{:.3e} of the diameter on {pairs} pairs", two.0),
    );
    verdicts.note(
        "cocycle holds on triple overlaps",
        three.0 < bound,
        format!("{:.3e} of the diameter on {triples} triples", three.0),
    );
}

/// The transitions to the two sides of a boundary chart differ by its segment's gluing: φ_right⁻¹ ∘ φ_left.
/// Compared at points of the chart, where the rotations count as much as they matter.
fn check_sides(
    document: &Document,
    transitions: &BTreeMap<(usize, u8), usize>,
    sizes: &[Size],
    verdicts: &mut Verdicts,
) {
    let mut worst = Worst::default();
    let mut glued = BTreeSet::new();
    for (chart, listed) in document.charts.iter().enumerate() {
        let sides = [0, 1].map(|sector| transitions.get(&(chart, sector)));
        let (Some(segment), [Some(left), Some(right)]) = (listed.segment, sides) else {
            continue;
        };
        let [left, right] = [left, right].map(|row| document.transitions[*row].motion());
        let around = right.inverse().after(&left);
        let gluing = document.segments[segment].gluing.motion();
        let Size { centre, diameter } = sizes[chart];
        let size = diameter + FLOOR / RESIDUAL_TOLERANCE * sizes[0].diameter;
        for offset in [[-0.5, -0.5], [0.5, -0.5], [0.0, 0.5]] {
            let p = std::array::from_fn(|i| centre[i] + offset[i] * diameter);
            let p = left.inverse_apply(p);
            worst.see(distance2(around.apply(p), gluing.apply(p)) / size);
        }
        glued.insert(segment);
    }
    verdicts.note(
        "gluings are the transitions from left to right",
        worst.0 < 3.0 * RESIDUAL_TOLERANCE,
        format!("{:.3e} of the chart's diameter", worst.0),
    );
    let lacking = document.segments.len() - glued.len();
    verdicts.note(
        "every segment has a boundary chart with two sides",
        lacking == 0,
        format!("{lacking} of {} without", document.segments.len()),
    );
}
