//! Regions with an even number of corners divided into quads by lines between corners.
//!
//! *Enters:* a [`Drawing`] whose regions have an even number of corners, four at least. *Leaves:* more walls on it. *Guaranteed:* every region has four corners, so that what was
//! conforming stays it. *Not guaranteed:* the best of all divisions: one region after the other takes its best one, until none changes.
//!
//! 2 n corners make n − 1 quads, where a centre joined to the middles of the sides makes 2 n. Where three regions meet, as they mostly do, one line more makes
//! four right angles there; what a division is worth is so how near to right angles are all that it makes, and how alike opposite sides are.

use super::RectangleError;
use super::disk::Disk;
use super::division::{angle, draw_between, part, places, regions};
use super::relax::is_pinned;
use super::sides::{Drawing, Role};
use crate::geometry::ids::{EdgeId, VertexId};
use crate::geometry::mesh::distance;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// What unequal opposite sides cost: their logarithms' squared difference, in squared radians of angles.
const SHAPE: f64 = 0.5;
/// Regions with more corners have too many divisions to try them all; they are halved first.
const MOST_CORNERS: usize = 10;
/// Divisions of each half that are tried then.
const MOST_DIVISIONS: usize = 12;
/// How often all regions are looked at.
const ROUNDS: usize = 100;
/// Changes that gain less are rounding.
const GAIN: f64 = 1e-9;

/// A line between two corners, by their places.
type Line = [usize; 2];

/// Draws the lines.
pub(super) fn quadrangulate(drawing: &mut Drawing) -> Result<(), RectangleError> {
    let mut length: BTreeMap<EdgeId, f64> = BTreeMap::new();
    for side in drawing.chains() {
        let whole = drawing.length(&side);
        length.extend(side.edges.iter().map(|&e| (e, whole)));
    }
    let starts = regions(drawing);
    let all = starts.iter().map(|&start| {
        let disk = part(drawing, start)?;
        Region::new(drawing, &disk, &length)
    });
    let mut all: Vec<Region> = all.collect::<Result<_, _>>()?;
    choose(drawing, &mut all);
    for (start, region) in starts.into_iter().zip(all) {
        let disk = part(drawing, start)?;
        let corners: Vec<usize> = (0..region.corners.len()).collect();
        let lines = &region.options[region.chosen].0;
        region.draw(drawing, disk, &corners, lines)?;
    }
    Ok(())
}

/// A region and how it may be divided.
struct Region {
    /// Nodes around it; one may be there more than once.
    corners: Vec<VertexId>,
    /// Angles there, radians.
    angle: Vec<f64>,
    /// Lines, and what the shapes of their quads cost.
    options: Vec<(Vec<Line>, f64)>,
    chosen: usize,
}

impl Region {
    fn new(
        drawing: &Drawing,
        disk: &Disk,
        length: &BTreeMap<EdgeId, f64>,
    ) -> Result<Self, RectangleError> {
        let places: Vec<usize> = places(drawing, disk, |role| role == Role::Node).collect();
        let n = places.len();
        if n < 4 || n % 2 == 1 {
            return Err(RectangleError::Inconsistent {
                what: "the corners of a region",
            });
        }
        let corners: Vec<VertexId> = places.iter().map(|&p| disk.border_vertex(p)).collect();
        let edge = |&p: &usize| length.get(&disk.edge(&drawing.fine, disk.border[p]));
        let sides: Vec<f64> = places
            .iter()
            .map(|p| edge(p).copied().unwrap_or(0.0))
            .collect();
        let span = |a: usize, b: usize| match (b + n - a) % n {
            1 => sides[a],
            d if d == n - 1 => sides[b],
            _ => distance(
                drawing.fine.position[corners[a]],
                drawing.fine.position[corners[b]],
            ),
        };
        let unequal = |a: f64, b: f64| {
            let log = (a / b).ln();
            if log.is_finite() { log * log } else { 0.0 }
        };
        let shape = |lines: &[Line]| -> f64 {
            let quads = quads((0..n).collect(), lines).into_iter();
            let costs = quads.map(|q| {
                let side = |k: usize| span(q[k], q[(k + 1) % 4]);
                unequal(side(0), side(2)) + unequal(side(1), side(3))
            });
            SHAPE * costs.sum::<f64>()
        };
        let lengths = disk.lengths(&drawing.fine);
        let options = divisions(&(0..n).collect::<Vec<usize>>()).into_iter();
        let options = options.map(|lines| {
            let shape = shape(&lines);
            (lines, shape)
        });
        Ok(Self {
            options: options.collect(),
            angle: places.iter().map(|&p| angle(disk, &lengths, p)).collect(),
            corners,
            chosen: 0,
        })
    }

    /// Draws lines across a part of the region with some of its corners.
    fn draw(
        &self,
        drawing: &mut Drawing,
        mut disk: Disk,
        corners: &[usize],
        lines: &[Line],
    ) -> Result<(), RectangleError> {
        let Some((&[from, to], others)) = lines.split_first() else {
            return Ok(());
        };
        let error = || RectangleError::Inconsistent {
            what: "the corners of a region",
        };
        let here: Vec<usize> = places(drawing, &disk, |role| role == Role::Node).collect();
        let turn = self.turn(&disk, &here, corners).ok_or_else(error)?;
        // The part's corners from its first one on.
        disk.border.rotate_left(here[turn]);
        let here: Vec<usize> = places(drawing, &disk, |role| role == Role::Node).collect();
        let at = |corner: usize| corners.iter().position(|&k| k == corner);
        let (i, j) = (at(from).ok_or_else(error)?, at(to).ok_or_else(error)?);
        let (i, j) = (i.min(j), i.max(j));
        let halves = draw_between(drawing, &disk, [here[i], here[j]])?;
        let before = &corners[i..=j];
        let after = [&corners[j..], &corners[..=i]].concat();
        for start in halves {
            let disk = part(drawing, start)?;
            let here: Vec<usize> = places(drawing, &disk, |role| role == Role::Node).collect();
            let own = match self.turn(&disk, &here, before) {
                Some(_) => before,
                None => &after,
            };
            let inside = others
                .iter()
                .filter(|line| line.iter().all(|k| own.contains(k)));
            let inside: Vec<Line> = inside.copied().collect();
            self.draw(drawing, disk, own, &inside)?;
        }
        Ok(())
    }

    /// From which of a disk's nodes on it has just these corners.
    fn turn(&self, disk: &Disk, places: &[usize], corners: &[usize]) -> Option<usize> {
        let n = places.len();
        let vertex = |k: usize| disk.border_vertex(places[k % n]);
        let fits = |turn: &usize| {
            let mut pairs = corners.iter().enumerate();
            pairs.all(|(k, &corner)| vertex(turn + k) == self.corners[corner])
        };
        (0..n).filter(|_| n == corners.len()).find(fits)
    }
}

/// Lets every region take its best division, given those of the others.
fn choose(drawing: &Drawing, all: &mut [Region]) {
    // Of every node: angles around it and their sum, and lines of chosen divisions.
    let mut nodes: BTreeMap<VertexId, (usize, f64)> = BTreeMap::new();
    let mut arms: BTreeMap<VertexId, usize> = BTreeMap::new();
    for region in all.iter() {
        for (&v, angle) in region.corners.iter().zip(&region.angle) {
            let node = nodes.entry(v).or_default();
            *node = (node.0 + 1, node.1 + angle);
        }
        for &k in region.options[region.chosen].0.iter().flatten() {
            *arms.entry(region.corners[k]).or_default() += 1;
        }
    }
    let far = |angle: f64, among: usize| among as f64 * (angle / among as f64 - FRAC_PI_2).powi(2);
    let pinned: BTreeMap<VertexId, bool> =
        nodes.keys().map(|&v| (v, is_pinned(drawing, v))).collect();
    for _ in 0..ROUNDS {
        let mut is_changed = false;
        for region in all.iter_mut() {
            let ends = |option: usize, k: usize| {
                let lines = region.options[option].0.iter().flatten();
                lines.filter(|&&j| j == k).count()
            };
            let cost = |option: usize| -> f64 {
                let angles = region.corners.iter().enumerate().map(|(k, v)| {
                    let own = ends(option, k);
                    if pinned[v] {
                        return far(region.angle[k], own + 1);
                    }
                    // Walls are drawn anew afterwards and meet at even angles then, wherever they are now.
                    let others = arms.get(v).copied().unwrap_or(0) - ends(region.chosen, k);
                    far(TAU, nodes[v].0 + others + own)
                });
                angles.sum::<f64>() + region.options[option].1
            };
            let options = (0..region.options.len()).map(|option| (cost(option), option));
            let best = options.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let Some((least, best)) = best else { continue };
            if least >= cost(region.chosen) - GAIN {
                continue;
            }
            for &k in region.options[region.chosen].0.iter().flatten() {
                arms.entry(region.corners[k]).and_modify(|n| *n -= 1);
            }
            for &k in region.options[best].0.iter().flatten() {
                *arms.entry(region.corners[k]).or_default() += 1;
            }
            region.chosen = best;
            is_changed = true;
        }
        if !is_changed {
            break;
        }
    }
}

/// The ways to divide a polygon with an even number of corners into quads by lines that do not cross: all of them, but where there are too many some that halve it first.
fn divisions(corners: &[usize]) -> Vec<Vec<Line>> {
    let n = corners.len();
    if n <= 4 {
        return vec![Vec::new()];
    }
    if n > MOST_CORNERS {
        // An odd number of sides on both sides of the line.
        let half = n / 2 + (n / 2 + 1) % 2;
        let line = [corners[0], corners[half]];
        let behind = [&corners[half..], &corners[..1]].concat();
        let halves = [&corners[..=half], &behind];
        return combined(
            &[line],
            halves.map(|half| {
                let mut some = divisions(half);
                some.truncate(MOST_DIVISIONS);
                some
            }),
        );
    }
    // The quad on the first side has corners 0, 1, i and j.
    let mut all = Vec::new();
    for i in (2..n - 1).step_by(2) {
        for j in (i + 1..n).step_by(2) {
            let last = [&corners[j..], &corners[..1]].concat();
            let parts = [&corners[1..=i], &corners[i..=j], &last];
            let lines = parts.iter().filter(|part| part.len() > 2);
            let lines = lines.filter_map(|part| Some([*part.first()?, *part.last()?]));
            let lines: Vec<Line> = lines.collect();
            all.extend(combined(&lines, parts.map(divisions)));
        }
    }
    all
}

/// One of each, in all ways.
fn combined<const N: usize>(lines: &[Line], parts: [Vec<Vec<Line>>; N]) -> Vec<Vec<Line>> {
    parts.iter().fold(vec![lines.to_vec()], |all, part| {
        let with = |one: &Vec<Line>| {
            let one = one.clone();
            part.iter().map(move |more| [&one[..], more].concat())
        };
        all.iter().flat_map(with).collect()
    })
}

/// The quads that a polygon is divided into by lines.
fn quads(corners: Vec<usize>, lines: &[Line]) -> Vec<Vec<usize>> {
    let mut parts = vec![corners];
    for line in lines {
        let places = |part: &Vec<usize>| {
            let [i, j] = line.map(|k| part.iter().position(|&x| x == k));
            Some((i?.min(j?), i?.max(j?)))
        };
        let found = parts
            .iter()
            .enumerate()
            .find_map(|(k, part)| Some((k, places(part)?)));
        if let Some((k, (i, j))) = found {
            let part = parts.swap_remove(k);
            parts.push(part[i..=j].to_vec());
            parts.push([&part[j..], &part[..=i]].concat());
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_have_all_their_divisions_into_quads() {
        // Fuss–Catalan numbers: divisions of a polygon with 2 n + 2 corners into n quads.
        for (corners, count) in [(4, 1), (6, 3), (8, 12), (10, 55)] {
            let polygon: Vec<usize> = (0..corners).collect();
            let mut all = divisions(&polygon);
            assert_eq!(all.len(), count);
            for lines in &all {
                let quads = quads(polygon.clone(), lines);
                assert_eq!(quads.len(), corners / 2 - 1);
                assert!(quads.iter().all(|quad| quad.len() == 4));
            }
            all.iter_mut().for_each(|lines| lines.sort_unstable());
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), count);
        }
        for corners in [12, 14, 16, 30, 64] {
            let polygon: Vec<usize> = (0..corners).collect();
            let all = divisions(&polygon);
            assert!(!all.is_empty() && all.len() <= MOST_DIVISIONS.pow(2));
            for lines in &all {
                let quads = quads(polygon.clone(), lines);
                assert_eq!(quads.len(), corners / 2 - 1);
                assert!(quads.iter().all(|quad| quad.len() == 4));
            }
        }
    }
}
