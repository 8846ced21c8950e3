//! Measures an atlas from its data; trusts no figure that a stage gave.
//!
//! *Enters:* mesh, flat lengths, cut, charts. *Leaves:* [`Quality`]: distortion (9), log scale, angle error, cut
//! length, and the residuals of what makes the atlas affine: transitions, holonomy, cocycle.

mod blocks;
mod images;

pub use blocks::SurfaceImages;
pub use images::measure_images;

use crate::atlas::charts::{Chart, ChartKind, Charts, Transition};
use crate::atlas::cut::CutGraph;
use crate::atlas::develop::{Development, diameter};
use crate::atlas::plane::{RigidMotion, distance, doubled_area, wrap_angle};
use crate::flow::prescription::Prescription;
use crate::flow::ricci::FlatMetric;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId, NONE, VertexId};
use crate::geometry::mesh::{Mesh, distance as distance3, triangle_area};
use crate::geometry::triangle::{angles, area};
use crate::product::{MeanMax, Quality, RmsMax, Spread, Verdict};
use rayon::prelude::*;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

/// Bound below which a rotation counts as a quarter turn, radians.
pub const QUARTER_TURN_TOLERANCE: f64 = 1e-8;

/// Measures everything that can be measured before patches and images exist; [`measure_images`] adds the rest.
pub fn measure(
    mesh: &Mesh,
    metric: &FlatMetric,
    cut: &CutGraph,
    central: &Development,
    charts: &Charts,
    prescription: &Prescription,
) -> Quality {
    let chart = |f: FaceId| Some(0.5 * doubled_area(central.uv[f]));
    let Distortion {
        area_distortion,
        log_scale,
        angle_error,
    } = distortion_in(mesh, metric, chart);
    Quality {
        area_distortion,
        log_scale,
        verdict: Verdict::of(&log_scale),
        angle_error,
        conformal_error: metric.quarter_turns.as_ref().map(|met| RmsMax {
            rms: met.conformal_error[0],
            max: met.conformal_error[1],
        }),
        layout_closing_error: closing_error(mesh, cut, central, metric),
        cut_length: cut_length(mesh, cut),
        transition_residual: transition_residual(charts, cut, central, mesh),
        holonomy_error: holonomy_error(mesh, cut, charts, prescription),
        cocycle_error: cocycle_error(mesh, cut, central, charts),
        image_psnr_db: None,
        image_hausdorff: None,
        image_normal_error: None,
    }
}

/// True where every gluing turns by a multiple of π/2.
pub fn is_seamless(charts: &Charts) -> bool {
    charts
        .gluings
        .iter()
        .all(|g| quarter_turns(g.motion.rotation).is_some())
}

/// The number of quarter turns, 0 to 3, that an angle is to 1e-8.
pub fn quarter_turns(rotation: f64) -> Option<u8> {
    let turns = (rotation / FRAC_PI_2).round();
    let is_quarter = wrap_angle(rotation - turns * FRAC_PI_2).abs() < QUARTER_TURN_TOLERANCE;
    is_quarter.then(|| (turns as i64).rem_euclid(4) as u8)
}

/// One face in space, in the central chart and by its flat lengths.
struct Row {
    source_area: f64,
    chart_area: f64,
    flat_area: f64,
    source_angles: [f64; 3],
    flat_angles: [f64; 3],
}

impl Row {
    /// ½ ln of the ratio of areas, with logarithms apart: flat areas span more than a quotient can hold.
    fn log_scale(&self, source_total: f64, flat_total: f64) -> f64 {
        let log = |part: f64, total: f64| part.ln() - total.ln();
        0.5 * (log(self.flat_area, flat_total) - log(self.source_area, source_total))
    }

    fn angle_errors(&self) -> [f64; 3] {
        std::array::from_fn(|k| (self.source_angles[k] - self.flat_angles[k]).abs())
    }
}

/// Measures a face; nothing where it has no area in space or by its flat lengths.
fn row(p: [[f64; 3]; 3], flat: [f64; 3], chart_area: f64) -> Option<Row> {
    let space = [
        distance3(p[1], p[2]),
        distance3(p[2], p[0]),
        distance3(p[0], p[1]),
    ];
    Some(Row {
        source_area: triangle_area(p),
        chart_area,
        flat_area: area(flat)?,
        source_angles: angles(space)?,
        flat_angles: angles(flat)?,
    })
}

/// Areas of all faces in space and by their flat lengths.
fn totals<'a>(rows: impl Iterator<Item = &'a Row>) -> (f64, f64) {
    rows.fold((0.0, 0.0), |(source, flat), row| {
        (source + row.source_area, flat + row.flat_area)
    })
}

/// How far a flat metric is from the one in space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// (9), both areas normalised to 1.
    pub area_distortion: f64,
    /// ½ ln(flat area / source area) a face, both totals 1, weighted by source area.
    pub log_scale: Spread,
    /// Difference of corner angles, radians.
    pub angle_error: MeanMax,
}

/// The distortion of a metric that need not be developed: of (9) the flat areas are those by its lengths, which differ from
/// a chart's by rounding only.
pub fn distortion(mesh: &Mesh, metric: &FlatMetric) -> Distortion {
    let flat = |f| area(mesh.connectivity.face_edges(f).map(|e| metric.length[e]));
    distortion_in(mesh, metric, flat)
}

/// What flattening does to one face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceDistortion {
    /// Area in space over the whole surface's.
    pub weight: f64,
    /// ½ ln(flat area / source area), both totals 1.
    pub log_scale: f64,
    /// Difference of each corner's angle, radians.
    pub angle_error: [f64; 3],
}

/// The distortion of every face by its flat lengths; nothing for those without an area in space or in the plane, which [`measure`]
/// leaves out.
pub fn face_distortions(mesh: &Mesh, metric: &FlatMetric) -> FaceVec<Option<FaceDistortion>> {
    let c = &mesh.connectivity;
    let flat = |f| c.face_edges(f).map(|e| metric.length[e]);
    distortions(c.faces().map(|f| (mesh.face_positions(f), flat(f)))).into()
}

/// The same of faces given by their corners in space and their flat lengths, each opposite its corner.
pub fn distortions(
    faces: impl Iterator<Item = ([[f64; 3]; 3], [f64; 3])>,
) -> Vec<Option<FaceDistortion>> {
    // The chart's areas are not asked for.
    let rows: Vec<Option<Row>> = faces.map(|(p, flat)| row(p, flat, 0.0)).collect();
    let (source, flat) = totals(rows.iter().flatten());
    let of = |row: &Row| FaceDistortion {
        weight: row.source_area / source,
        log_scale: row.log_scale(source, flat),
        angle_error: row.angle_errors(),
    };
    rows.iter().map(|row| row.as_ref().map(of)).collect()
}

/// Length of the cut in space, source units.
pub fn cut_length(mesh: &Mesh, cut: &CutGraph) -> f64 {
    let edges = cut.is_cut.enumerate().filter(|&(_, &is_cut)| is_cut);
    // The sum of nothing is −0.
    edges.map(|(e, _)| mesh.edge_length(e)).sum::<f64>() + 0.0
}

/// (9) for the areas of the chart, log scale and angle error; faces without area in space have no scale and are left out.
fn distortion_in(
    mesh: &Mesh,
    metric: &FlatMetric,
    chart_area: impl Fn(FaceId) -> Option<f64> + Sync,
) -> Distortion {
    let c = &mesh.connectivity;
    let faces = (0..c.face_count()).into_par_iter().map(FaceId::new);
    let row = |f| {
        let flat = c.face_edges(f).map(|e| metric.length[e]);
        row(mesh.face_positions(f), flat, chart_area(f)?)
    };
    let rows: Vec<Row> = faces.filter_map(row).collect();
    let chart_total: f64 = rows.iter().map(|r| r.chart_area).sum();
    let (source_total, flat_total) = totals(rows.iter());
    let mut area_distortion = 0.0;
    let mut scale = Spread {
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        std: 0.0,
    };
    let mut angle = MeanMax::default();
    let (mut mean, mut mean_square) = (0.0, 0.0);
    for row in rows {
        let weight = row.source_area / source_total;
        area_distortion += (row.chart_area / chart_total / weight - 1.0).powi(2) * weight;
        let log = row.log_scale(source_total, flat_total);
        scale.min = scale.min.min(log);
        scale.max = scale.max.max(log);
        mean += weight * log;
        mean_square += weight * log * log;
        for error in row.angle_errors() {
            angle.mean += weight * error / 3.0;
            angle.max = angle.max.max(error);
        }
    }
    scale.std = (mean_square - mean * mean).max(0.0).sqrt();
    Distortion {
        area_distortion,
        log_scale: scale,
        angle_error: angle,
    }
}

/// Worst difference between an edge's length in the chart and its flat length, and between its ends
/// as its two faces see them.
fn closing_error(mesh: &Mesh, cut: &CutGraph, central: &Development, metric: &FlatMetric) -> f64 {
    let c = &mesh.connectivity;
    let corner = |h: HalfedgeId| central.uv[c.face(h)][c.corner(h)];
    let halfedges = (0..c.halfedge_count()).into_par_iter();
    let error = halfedges.map(HalfedgeId::new).map(|h| {
        let (a, b) = (corner(h), corner(c.next(h)));
        let of_length = (distance(a, b) - metric.length[c.edge(h)]).abs();
        let across = c.twin(h).filter(|_| !cut.is_cut[c.edge(h)]);
        across.map_or(of_length, |t| of_length.max(distance(a, corner(c.next(t)))))
    });
    error.reduce(|| central.closing_error, f64::max)
}

/// Worst residual of transitions and gluings, each applied again, relative to the chart's diameter
/// once the central chart's floor (1e-12 of its diameter) is taken off.
fn transition_residual(charts: &Charts, cut: &CutGraph, central: &Development, mesh: &Mesh) -> f64 {
    let c = &mesh.connectivity;
    let floor = 1e-12 * central.diameter();
    let mut worst = 0.0f64;
    for t in &charts.transitions {
        let chart = &charts.charts[t.to.index()];
        let size = chart_diameter(chart);
        for row in chart.faces.iter().filter(|row| row.sector == t.sector) {
            for (p, q) in central.uv[row.face].into_iter().zip(row.uv) {
                worst = worst.max((distance(t.motion.apply(p), q) - floor).max(0.0) / size);
            }
        }
    }
    let diameter = central.diameter();
    for (gluing, segment) in charts.gluings.iter().zip(&cut.segments) {
        for &h in &segment.halfedges {
            let Some(t) = c.twin(h) else { continue };
            let left = central.uv[c.face(h)][c.corner(h)];
            let right = central.uv[c.face(t)][c.corner(c.next(t))];
            worst = worst.max(distance(gluing.motion.apply(left), right) / diameter);
        }
    }
    worst
}

fn chart_diameter(chart: &Chart) -> f64 {
    diameter(chart.faces.iter().flat_map(|row| row.uv)).max(f64::MIN_POSITIVE)
}

/// Going once around a vertex of the cut must turn by its curvature: worst difference modulo 2π over
/// interior vertices of the cut.
fn holonomy_error(
    mesh: &Mesh,
    cut: &CutGraph,
    charts: &Charts,
    prescription: &Prescription,
) -> f64 {
    let c = &mesh.connectivity;
    // +1 where a halfedge runs along its segment, −1 against it.
    let mut along: HashMap<HalfedgeId, f64> = HashMap::new();
    for segment in &cut.segments {
        for &h in &segment.halfedges {
            along.insert(h, 1.0);
            if let Some(t) = c.twin(h) {
                along.insert(t, -1.0);
            }
        }
    }
    let mut on_cut: Vec<VertexId> = along.keys().map(|&h| c.tail(h)).collect();
    on_cut.sort_unstable();
    on_cut.dedup();
    let mut worst = 0.0f64;
    for v in on_cut.into_iter().filter(|&v| !c.is_boundary_vertex(v)) {
        let mut turn = 0.0;
        for h in c.outgoing(v) {
            let segment = cut.segment[c.edge(h)];
            if segment != NONE {
                // Counterclockwise around the tail the cut is crossed from right to left of h.
                turn -= along[&h] * charts.gluings[segment as usize].motion.rotation;
            }
        }
        worst = worst.max(wrap_angle(turn - prescription.target[v]).abs());
    }
    worst
}

/// All transitions follow from those of the central chart: on a face that two charts share,
/// φ_{0c} ∘ φ_{0b}⁻¹ must take b's corners to c's; across a segment, φ_right⁻¹ ∘ φ_left must be its
/// gluing. Worst distance relative to the larger chart, above the central chart's floor.
fn cocycle_error(mesh: &Mesh, cut: &CutGraph, central: &Development, charts: &Charts) -> f64 {
    let c = &mesh.connectivity;
    let diameter = central.diameter();
    let floor = 4e-12 * diameter;
    let mut by_sector: HashMap<(usize, u8), &Transition> = HashMap::new();
    for t in &charts.transitions {
        by_sector.insert((t.to.index(), t.sector), t);
    }
    let mut rows: Vec<(FaceId, usize, usize)> = Vec::new();
    for (k, chart) in charts.charts.iter().enumerate() {
        rows.extend(chart.faces.iter().enumerate().map(|(i, r)| (r.face, k, i)));
    }
    rows.sort_unstable();
    let sizes: Vec<f64> = charts.charts.iter().map(chart_diameter).collect();
    let mut worst = 0.0f64;
    for group in rows.chunk_by(|a, b| a.0 == b.0) {
        for (n, &(_, kb, ib)) in group.iter().enumerate() {
            for &(_, kc, ic) in &group[n + 1..] {
                let (b, d) = (&charts.charts[kb].faces[ib], &charts.charts[kc].faces[ic]);
                let (Some(tb), Some(td)) = (
                    by_sector.get(&(kb, b.sector)),
                    by_sector.get(&(kc, d.sector)),
                ) else {
                    continue;
                };
                let motion = td.motion.after(&tb.motion.inverse());
                let size = sizes[kb].max(sizes[kc]);
                for (p, q) in b.uv.into_iter().zip(d.uv) {
                    let gap = (distance(motion.apply(p), q) - floor).max(0.0);
                    worst = worst.max(gap / size);
                }
            }
        }
    }
    for (k, chart) in charts.charts.iter().enumerate() {
        let ChartKind::Boundary(segment) = chart.kind else {
            continue;
        };
        let (Some(left), Some(right)) = (by_sector.get(&(k, 0)), by_sector.get(&(k, 1))) else {
            continue;
        };
        let across: RigidMotion = right.motion.inverse().after(&left.motion);
        let gluing = charts.gluings[segment.index()].motion;
        for &h in &cut.segments[segment.index()].halfedges {
            let p = central.uv[c.face(h)][c.corner(h)];
            worst = worst.max(distance(across.apply(p), gluing.apply(p)) / diameter);
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::charts::chart;
    use crate::atlas::cut::cut;
    use crate::atlas::develop::develop;
    use crate::atlas::overlay::Layout;
    use crate::flow::cones::{BoundaryCondition, Cone};
    use crate::geometry::ids::EdgeVec;
    use crate::geometry::polycube::{curvature, lengths, plate, polycube};

    /// Cuts, develops, charts and measures a surface whose own metric is flat but for `cones` at its corners.
    fn atlas_of(
        mesh: &Mesh,
        boundary: BoundaryCondition,
    ) -> (CutGraph, Development, Charts, Quality) {
        let c = &mesh.connectivity;
        let mut target = curvature(mesh);
        if boundary == BoundaryCondition::Free {
            for v in c.vertices().filter(|&v| c.is_boundary_vertex(v)) {
                target[v] = 0.0;
            }
        }
        let cones: Vec<Cone> = target
            .enumerate()
            .filter(|&(_, k)| k.abs() > 1e-12)
            .map(|(vertex, &curvature)| Cone { vertex, curvature })
            .collect();
        let length: EdgeVec<f64> = lengths(mesh);
        let metric = FlatMetric {
            intrinsic: None,
            log_scale: vec![0.0; c.vertex_count()].into(),
            curvature: target.clone(),
            length: length.clone(),
            history: Vec::new(),
            max_curvature_error: 0.0,
            fit: None,
            opened: None,
            quarter_turns: None,
        };
        let prescription = Prescription {
            target,
            cones,
            boundary,
            field: None,
        };
        let layout = Layout::identity(c, &length);
        let cut = cut(c, &length, &prescription).unwrap();
        let unfolded = develop(&layout, cut.clone()).unwrap();
        let central = Development::place(c, &cut, &layout, &unfolded);
        let charts = chart(c, &cut, &central, &layout, &unfolded, &prescription).unwrap();
        let quality = measure(mesh, &metric, &cut, &central, &charts, &prescription);
        // Every interior cone lies on the cut, and no chain ends elsewhere.
        for v in c.vertices() {
            let valence = c.outgoing(v).filter(|&h| cut.is_cut[c.edge(h)]).count();
            let is_cone = prescription.target[v].abs() > 1e-12;
            if !c.is_boundary_vertex(v) {
                assert!(!is_cone || valence > 0, "cone {v} is not on the cut");
                assert!(is_cone || valence != 1, "the cut dangles at {v}");
            }
        }
        for s in &cut.segments {
            let vertices = s.vertices(c);
            for (i, v) in vertices.iter().enumerate() {
                let is_end = i == 0 || i + 1 == vertices.len();
                assert_eq!(
                    cut.nodes.contains(v),
                    is_end,
                    "inner vertices of segments are no nodes"
                );
            }
        }
        (cut, central, charts, quality)
    }

    /// What must hold of every atlas of a surface that is flat to begin with.
    fn assert_exact(mesh: &Mesh, boundary: BoundaryCondition) -> (CutGraph, Charts) {
        let (cut, central, charts, q) = atlas_of(mesh, boundary);
        assert!(q.area_distortion < 1e-24, "{q:?}");
        assert!(q.log_scale.max - q.log_scale.min < 1e-12, "{q:?}");
        assert!(q.layout_closing_error < 1e-12 * central.diameter(), "{q:?}");
        assert!(q.transition_residual < 1e-12, "{q:?}");
        assert!(q.holonomy_error < 1e-12, "{q:?}");
        assert!(q.cocycle_error < 1e-12, "{q:?}");
        for uv in central.uv.iter() {
            assert!(
                (doubled_area(*uv) - 1.0).abs() < 1e-12,
                "faces stay half squares"
            );
        }
        assert!(is_seamless(&charts), "a polycube turns by quarters");
        (cut, charts)
    }

    #[test]
    fn a_cube_is_cut_by_a_tree() {
        let cube = polycube((0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2]), |_, _, _| true);
        let (cut, _) = assert_exact(&cube, BoundaryCondition::Free);
        let edges = cut.is_cut.iter().filter(|&&x| x).count();
        // Eight corners two edges apart: seven connections of two edges (or one diagonal each).
        assert!(edges <= 14, "{edges}");
    }

    #[test]
    fn handles_are_opened() {
        for holes in [&[[1, 1]][..], &[[1, 1], [3, 1]], &[[1, 1], [3, 1], [5, 1]]] {
            let mesh = plate(2 * holes.len() as i32 + 1, 3, holes);
            assert_eq!(mesh.connectivity.topology().genus, holes.len() as i64);
            assert_exact(&mesh, BoundaryCondition::Free);
        }
    }

    #[test]
    fn boundary_loops_are_reached() {
        // A cube of 4 with one, two, three squares taken away: disks and more loops.
        for holes in 1..4 {
            let mut cubes = Vec::new();
            for i in 0..64 {
                cubes.push([i & 3, i >> 2 & 3, i >> 4]);
            }
            let mesh = polycube(cubes, |low, axis, sign| {
                let taken = [([1, 1, 4], 2, 1), ([1, 1, 0], 2, -1), ([0, 2, 2], 0, -1)];
                !taken[..holes].contains(&(low, axis, sign))
            });
            assert_eq!(mesh.connectivity.topology().boundary_loops, holes);
            for boundary in [BoundaryCondition::Free, BoundaryCondition::Uniform] {
                assert_exact(&mesh, boundary);
            }
        }
        // A handle and a hole together.
        let cubes = (0..9)
            .map(|i| [i % 3, i / 3, 0])
            .filter(|c| c[..2] != [1, 1]);
        let mesh = polycube(cubes, |low, axis, sign| {
            (low, axis, sign) != ([0, 0, 1], 2, 1)
        });
        let topology = mesh.connectivity.topology();
        assert_eq!((topology.genus, topology.boundary_loops), (1, 1));
        assert_exact(&mesh, BoundaryCondition::Free);
    }

    #[test]
    fn boundary_charts_glue_both_sides() {
        let mesh = plate(5, 3, &[[1, 1], [3, 1]]);
        let c = &mesh.connectivity;
        let (cut, charts) = assert_exact(&mesh, BoundaryCondition::Free);
        for (segment, chart) in cut.segments.iter().zip(&charts.charts[1..]) {
            for &h in &segment.halfedges {
                let t = c.twin(h).unwrap();
                let left = chart
                    .faces
                    .iter()
                    .find(|r| r.face == c.face(h) && r.sector == 0);
                let right = chart
                    .faces
                    .iter()
                    .find(|r| r.face == c.face(t) && r.sector == 1);
                let (left, right) = (left.unwrap(), right.unwrap());
                let gap = distance(left.uv[c.corner(h)], right.uv[c.corner(c.next(t))]);
                assert!(gap < 1e-12);
            }
        }
    }

    #[test]
    fn a_wrong_gluing_is_seen() {
        let mesh = plate(3, 3, &[[1, 1]]);
        let (cut, central, mut charts, good) = atlas_of(&mesh, BoundaryCondition::Free);
        charts.gluings[0].motion.rotation += 1e-3;
        charts.gluings[0].motion.translation[0] += 0.1;
        let prescription = Prescription {
            target: curvature(&mesh),
            cones: Vec::new(),
            boundary: BoundaryCondition::Free,
            field: None,
        };
        assert!(holonomy_error(&mesh, &cut, &charts, &prescription) > 0.9e-3);
        assert!(transition_residual(&charts, &cut, &central, &mesh) > 1e-4);
        assert!(cocycle_error(&mesh, &cut, &central, &charts) > 1e-4);
        assert!(good.holonomy_error < 1e-12);
    }

    #[test]
    fn quarter_turns_are_counted() {
        assert_eq!(quarter_turns(-FRAC_PI_2), Some(3));
        assert_eq!(quarter_turns(std::f64::consts::PI + 1e-9), Some(2));
        assert_eq!(quarter_turns(0.1), None);
    }
}
