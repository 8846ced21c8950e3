//! Where a flat metric is far from the surface, near what, and what to change.
//!
//! The parts with the most extreme log scale, a hundredth of the area at either end, are gathered into connected regions, and each is told
//! with its area, its scale and the nearest cone. Two causes are told apart by that: around a cone the log scale grows without bound
//! (like −K/2π times the logarithm of the distance), so a region at a strong cone is that cone's doing; a region far from all cones
//! is a feature, such as an ear, whose curvature has no cone of its own to gather it.

use super::counted;
use crate::atlas::patch::Domain;
use crate::export::glb::marked::{Mark, Marked};
use crate::flow::cones::{Prescription, in_pi};
use crate::flow::ricci::FlatMetric;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::frame::Frame;
use crate::geometry::ids::NONE;
use crate::geometry::mesh::{Mesh, bounding_box, distance};
use crate::read::metric::StoredMetric;
use crate::report::{FaceDistortion, distortions};
use std::f64::consts::PI;

/// Share of the area at either end that is looked at.
const EXTREME: f64 = 0.01;
/// Regions that are told of at either end.
const TOLD: usize = 3;
/// Angle errors above this are told of, radians (about 11°).
const SHEARED: f64 = 0.2;
/// Standard deviations of the log scale below this are hardly seen: lengths differ by less than a tenth.
const EVEN: f64 = 0.1;
/// A region within this many of its own diameters of a cone is that cone's.
const NEAR: f64 = 1.0;

/// A cone in space.
struct Cone {
    vertex: usize,
    source_vertex: Option<u32>,
    curvature: f64,
}

/// A surface with its flat lengths.
pub(super) struct Flat {
    positions: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    source_face: Vec<u32>,
    cones: Vec<Cone>,
    of: Vec<Option<FaceDistortion>>,
    domain: Domain,
    /// Whether all transitions are quarter turns.
    has_quarter_turns: bool,
}

/// Faces that hang together.
struct Region {
    faces: Vec<usize>,
    weight: f64,
    /// Its most extreme face.
    peak: usize,
}

impl Flat {
    /// Of a metric in memory, on a surface in its frame.
    pub fn of(
        mesh: &Mesh,
        metric: &FlatMetric,
        prescription: &Prescription,
        frame: &Frame,
        domain: Domain,
    ) -> Flat {
        let cones = prescription.cones.iter().map(|cone| {
            let source = mesh.source_vertex[cone.vertex];
            Cone {
                vertex: cone.vertex.index(),
                source_vertex: (source != NONE).then_some(source),
                curvature: cone.curvature,
            }
        });
        Flat {
            positions: mesh.positions.iter().map(|&p| frame.leave(p)).collect(),
            faces: mesh.connectivity.to_faces(),
            source_face: mesh.source_face.as_slice().to_vec(),
            cones: cones.collect(),
            of: crate::report::face_distortions(mesh, metric).into_vec(),
            domain,
            has_quarter_turns: metric.quarter_turns.is_some(),
        }
    }

    /// Of a folder.
    pub fn stored(stored: StoredMetric) -> Flat {
        let corners = |f: &[u32; 3]| f.map(|v| stored.positions[v as usize]);
        let rows = stored
            .faces
            .iter()
            .map(corners)
            .zip(stored.flat_length.iter().copied());
        let of = distortions(rows);
        let has_quarter_turns = stored.turns.is_some();
        let cones = stored.cones.iter().map(|cone| Cone {
            vertex: cone.vertex,
            source_vertex: cone.source_vertex,
            curvature: cone.curvature,
        });
        Flat {
            cones: cones.collect(),
            of,
            domain: stored.domain,
            has_quarter_turns,
            positions: stored.positions,
            faces: stored.faces,
            source_face: stored.source_face,
        }
    }

    /// Sentences, and the surface with the faces they are about in colour.
    pub fn explain(self, name: String) -> (Vec<String>, Marked) {
        let mut lines = vec![self.summary()];
        let mut marks = vec![Mark::Plain; self.faces.len()];
        let std = self.deviation();
        if std < EVEN {
            lines.push(format!(
                "hardly distorted: the standard deviation of the log scale is {std:.3}, below {EVEN}"
            ));
        } else {
            let (mut far, mut peaks) = (0, Vec::new());
            for (mark, sign) in [(Mark::Grown, 1.0), (Mark::Shrunk, -1.0)] {
                for region in self.regions(sign).iter().take(TOLD) {
                    for &f in &region.faces {
                        marks[f] = mark;
                    }
                    let (line, cone) = self.tell(region, mark);
                    match cone {
                        Some(cone) => peaks.push((mark, cone.curvature)),
                        None => far += 1,
                    }
                    lines.push(line);
                }
            }
            lines.extend(self.advice(far, &peaks));
        }
        lines.extend(self.angles(&mut marks));
        let surface = Marked {
            name,
            positions: self.positions,
            faces: self.faces,
            marks,
        };
        (lines, surface)
    }

    fn log(&self, f: usize) -> Option<f64> {
        self.of[f].as_ref().map(|d| d.log_scale)
    }

    fn mean(&self) -> f64 {
        self.of
            .iter()
            .flatten()
            .map(|d| d.weight * d.log_scale)
            .sum()
    }

    fn deviation(&self) -> f64 {
        let mean = self.mean();
        let squares = self
            .of
            .iter()
            .flatten()
            .map(|d| d.weight * (d.log_scale - mean).powi(2));
        squares.sum::<f64>().sqrt()
    }

    fn summary(&self) -> String {
        let logs = || self.of.iter().flatten().map(|d| d.log_scale);
        let (low, high) = logs().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
            (a.min(x), b.max(x))
        });
        if low > high {
            return "no face has an area".to_owned();
        }
        format!(
            "{}, {}: lengths are scaled by {} to {} (log scale {low:.3} to {high:.3}, standard deviation {:.3})",
            counted(self.faces.len(), "face", "faces"),
            counted(self.cones.len(), "cone", "cones"),
            factor(low),
            factor(high),
            self.deviation()
        )
    }

    /// Regions at one end of the log scale, the largest first.
    fn regions(&self, sign: f64) -> Vec<Region> {
        let mut order: Vec<(f64, usize)> = (0..self.faces.len())
            .filter_map(|f| Some((sign * self.log(f)?, f)))
            .collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let middle = sign * self.mean();
        let mut weight = 0.0;
        let mut taken = Vec::new();
        for (log, f) in order {
            // What does not differ from the mean is not extreme, however even the rest is.
            if weight >= EXTREME || log <= middle {
                break;
            }
            weight += self.of[f].as_ref().map_or(0.0, |d| d.weight);
            taken.push(f);
        }
        let mut sets = UnionFind::new(taken.len());
        let mut first_at = std::collections::HashMap::new();
        for (i, &f) in taken.iter().enumerate() {
            for v in self.faces[f] {
                let j = *first_at.entry(v).or_insert(i);
                sets.join(i, j);
            }
        }
        let mut regions: std::collections::BTreeMap<usize, Region> = Default::default();
        for (i, &f) in taken.iter().enumerate() {
            // Faces come the most extreme first.
            let region = regions.entry(sets.find(i)).or_insert_with(|| Region {
                faces: Vec::new(),
                weight: 0.0,
                peak: f,
            });
            region.faces.push(f);
            region.weight += self.of[f].as_ref().map_or(0.0, |d| d.weight);
        }
        let mut regions: Vec<Region> = regions.into_values().collect();
        regions.sort_by(|a, b| b.weight.total_cmp(&a.weight).then(a.peak.cmp(&b.peak)));
        regions
    }

    fn centre(&self, f: usize) -> [f64; 3] {
        let p = self.faces[f].map(|v| self.positions[v as usize]);
        std::array::from_fn(|i| (p[0][i] + p[1][i] + p[2][i]) / 3.0)
    }

    fn diagonal(&self) -> f64 {
        let (low, high) = bounding_box(&self.positions);
        distance(low, high).max(f64::MIN_POSITIVE)
    }

    /// The cone nearest to a point, straight through space.
    fn nearest(&self, p: [f64; 3]) -> Option<(&Cone, f64)> {
        let near = (self.cones.iter()).map(|cone| (cone, distance(self.positions[cone.vertex], p)));
        near.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// One sentence about a region, and the cone that it lies at.
    fn tell(&self, region: &Region, mark: Mark) -> (String, Option<&Cone>) {
        let at = self.centre(region.peak);
        let extent = region.faces.iter().map(|&f| distance(self.centre(f), at));
        let extent = extent.fold(0.0, f64::max);
        let log = self.log(region.peak).unwrap_or(0.0);
        let mut line = format!(
            "{} most at face {} of the file (near {:.4}, {:.4}, {:.4}): {} of the area, lengths times {} (log scale {log:.3})",
            mark.name(),
            self.source_face[region.peak],
            at[0],
            at[1],
            at[2],
            percent(region.weight),
            factor(log),
        );
        let Some((cone, away)) = self.nearest(at) else {
            return (line + "; there is no cone", None);
        };
        let near = away <= NEAR * extent.max(0.01 * self.diagonal());
        let place = match cone.source_vertex {
            Some(v) => format!("vertex {v} of the file"),
            None => format!("vertex {}", cone.vertex),
        };
        let curvature = short(cone.curvature);
        line += &match near {
            true => format!("; it lies at the cone of {curvature} at {place}"),
            false => format!(
                "; the nearest cone, {curvature} at {place}, is {} of the diagonal away",
                percent(away / self.diagonal())
            ),
        };
        (line, near.then_some(cone))
    }

    /// What to change, by where the regions are. `peaks` are the curvatures of the cones that some lie at.
    ///
    /// Measured on spot, camelhead, bunny and nefertiti: twice as many cones lower the deviation by 0.37 to 0.47 of itself; limits on
    /// curvature lower the peaks (on spot from a factor of 6.0 to 2.0), but with as many cones raise the deviation.
    fn advice(&self, far: usize, peaks: &[(Mark, f64)]) -> Vec<String> {
        if self.domain == Domain::Grid {
            return vec!["to change: a grid has its cones where its cross field turns: a larger features.angle asks for fewer lines along edges, cones.count for at most so many cones, and images.domain = \"flat\" for no grid and cones where scales are most even".to_owned()];
        }
        let count = self.cones.len();
        let more = (2 * count).max(4);
        let mut lines = Vec::new();
        if far > 0 {
            lines.push(format!(
                "to change: {far} of these regions have no cone near, so features there have nowhere to gather their curvature: raise cones.count from {count} to {more} (`affine-atlas cones MESH --counts {more}` shows what that gains)"
            ));
        }
        let at = |mark: Mark| {
            peaks
                .iter()
                .filter(move |peak| peak.0 == mark)
                .map(|peak| peak.1)
        };
        let strongest = at(Mark::Grown).fold(0.0, f64::max);
        if strongest > 0.75 * PI {
            lines.push(format!(
                "to change: where lengths grow most is a cone of {}: cones.max_curvature = \"1/2\" lowers that peak, but with {count} cones the rest gets less even, so set cones.count = {more} with it",
                short(strongest)
            ));
        }
        let strongest = at(Mark::Shrunk).fold(0.0, f64::min);
        if strongest < -PI {
            lines.push(format!(
                "to change: where lengths shrink most is a cone of {}: cones.min_curvature = -1 makes that less, but with {count} cones the rest gets less even, so set cones.count = {more} with it",
                short(strongest)
            ));
        }
        if lines.is_empty() {
            lines.push(format!(
                "to change: raise cones.count from {count} to {more}"
            ));
        }
        lines
    }

    /// Faces whose angles change much.
    fn angles(&self, marks: &mut [Mark]) -> Vec<String> {
        let mut worst: Option<(f64, usize)> = None;
        let (mut mean, mut share, mut count) = (0.0, 0.0, 0usize);
        for (f, d) in self.of.iter().enumerate() {
            let Some(d) = d else { continue };
            let largest = d.angle_error.into_iter().fold(0.0, f64::max);
            mean += d.weight * d.angle_error.iter().sum::<f64>() / 3.0;
            if worst.is_none_or(|(most, _)| largest > most) {
                worst = Some((largest, f));
            }
            if largest > SHEARED {
                share += d.weight;
                count += 1;
                if let Some(mark) = marks.get_mut(f).filter(|mark| **mark == Mark::Plain) {
                    *mark = Mark::Sheared;
                }
            }
        }
        let Some((most, f)) = worst else {
            return Vec::new();
        };
        let at = self.centre(f);
        let mut lines = vec![format!(
            "angles: mean error {mean:.4} rad, largest {most:.3} rad at face {} of the file (near {:.4}, {:.4}, {:.4}); {} with more than {SHEARED} rad, {} of the area",
            self.source_face[f],
            at[0],
            at[1],
            at[2],
            counted(count, "face", "faces"),
            percent(share)
        )];
        if share > EXTREME {
            lines.push(match (self.domain, self.has_quarter_turns) {
                (Domain::Grid, _) => "to change: quarter turns, and lines of the grid along sharp edges and borders, shear the surface there: a larger features.angle asks for fewer lines, and images.domain = \"flat\" for no grid".to_owned(),
                (Domain::Flat, true) => "to change: quarter turns shear the surface where it has handles: flow.holonomy = \"free\" keeps its angles, and cones whose directions fit need less (cones.strategy = \"field\")".to_owned(),
                (Domain::Flat, false) => format!(
                    "to change: faces there are large for how much the surface bends: divide them until less than {} of the area is above {SHEARED} rad (now {}); where flow.scheme is not \"vertex-scaling\", that one keeps angles better",
                    percent(EXTREME),
                    percent(share)
                ),
            });
        }
        lines
    }
}

/// e^x as a factor.
fn factor(log: f64) -> String {
    let x = log.exp();
    match (0.01..1000.0).contains(&x) {
        true => format!("{x:.2}"),
        false => format!("{x:.1e}"),
    }
}

fn percent(share: f64) -> String {
    match share {
        0.0 => "0 %".to_owned(),
        _ if share < 1e-3 => format!("{:.1e} %", 100.0 * share),
        _ => format!("{:.1} %", 100.0 * share),
    }
}

/// In multiples of π, to three digits where it is no short number.
fn short(radians: f64) -> String {
    let exact = in_pi(radians);
    match exact.chars().count() <= 7 {
        true => exact,
        false => format!("{:.3}π", radians / PI),
    }
}
