//! The nearest triangle to a point, through a tree of boxes.

use super::{Triangles, corners, normal};
use crate::geometry::mesh::{cross, distance_to_segment, dot, norm, sub};
use crate::geometry::morton::along_curve;
use std::ops::Range;

/// Most triangles in a leaf.
const LEAF: usize = 4;
/// No number of a turned box.
const NONE: u32 = u32::MAX;
/// So many triangles side by side are longer than this part of their box only where they are long and thin.
const MANY: (usize, f64) = (8, 0.25);

/// Triangles sorted into nested boxes, along the Morton curve through their centres: each node is parted where the first bit of their codes
/// changes, which halves its cube (Lauterbach et al., *Fast BVH construction on GPUs*, 2009). Sorting numbers once takes a small part of
/// the time of looking for medians again and again.
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    turned: Vec<TurnedBox>,
    /// Corners of the triangles, in the order of the leaves.
    triangles: Vec<[[f64; 3]; 3]>,
}

struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// Number of its turned box, [`NONE`] where it needs none.
    turned: u32,
    /// First triangle of a leaf, or the second child; the first one follows its parent.
    at: u32,
    /// Triangles of a leaf; 0 for a node with children.
    count: u32,
}

/// A box along the longest side of some triangles. Boxes along the coordinates of long thin triangles side by side all overlap, these do not.
#[derive(Clone, Copy, Debug, Default)]
struct TurnedBox {
    /// Unit vectors; 0 where there is no such box.
    axes: [[f64; 3]; 3],
    low: [f64; 3],
    high: [f64; 3],
}

/// What is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nearest {
    pub distance: f64,
    /// Number in the tree.
    pub face: usize,
}

impl BoxTree {
    /// `None` where there are no triangles.
    pub fn new(surface: Triangles<'_>) -> Option<Self> {
        let count = surface.faces.len();
        if count == 0 || count > u32::MAX as usize / 2 {
            return None;
        }
        let (codes, order) = along_curve(count, |face| centre(surface, face));
        let mut division = Division {
            triangles: (order.iter())
                .map(|&f| corners(surface, surface.faces[f as usize]))
                .collect(),
            codes,
            nodes: Vec::with_capacity(count),
            turned: Vec::new(),
        };
        division.divide(0..count);
        Some(Self {
            nodes: division.nodes,
            turned: division.turned,
            triangles: division.triangles,
        })
    }

    /// Normal of a triangle, of any length.
    pub fn normal(&self, face: usize) -> [f64; 3] {
        normal(self.triangles[face])
    }

    /// The triangle nearest to a point. The search is quick where the triangle `near` is not far.
    pub fn nearest(&self, p: [f64; 3], near: usize) -> Nearest {
        self.search(p, near).0
    }

    /// The same, and the number of triangles that were looked at.
    pub(super) fn search(&self, p: [f64; 3], near: usize) -> (Nearest, usize) {
        let mut looks = 1;
        let near = near.min(self.triangles.len() - 1);
        let mut best = (squared_distance(p, self.triangles[near]), near);
        // Nodes with the least that their triangles can be away.
        let mut stack = Vec::with_capacity(64);
        stack.push((self.squared_bound(p, &self.nodes[0]), 0));
        while let Some((bound, at)) = stack.pop() {
            if bound >= best.0 {
                continue;
            }
            let node = &self.nodes[at];
            if node.count > 0 {
                let first = node.at as usize;
                looks += node.count as usize;
                for face in first..first + node.count as usize {
                    let d = squared_distance(p, self.triangles[face]);
                    if d < best.0 {
                        best = (d, face);
                    }
                }
                continue;
            }
            let child = |at: usize| (self.squared_bound(p, &self.nodes[at]), at);
            let (a, b) = (child(at + 1), child(node.at as usize));
            let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            // The nearer one is looked into first.
            stack.extend([far, near].into_iter().filter(|(bound, _)| *bound < best.0));
        }
        let found = Nearest {
            distance: best.0.sqrt(),
            face: best.1,
        };
        (found, looks)
    }

    /// What the squared distance to the triangles of a node is at the least.
    fn squared_bound(&self, p: [f64; 3], node: &Node) -> f64 {
        let upright = squared_to_box(p, node);
        match self.turned.get(node.turned as usize) {
            Some(turned) => upright.max(turned.squared_distance(p)),
            None => upright,
        }
    }
}

/// Three times the centre of a triangle.
fn centre(surface: Triangles<'_>, face: usize) -> [f64; 3] {
    let [a, b, c] = corners(surface, surface.faces[face]);
    [a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]]
}

/// A tree that is being made.
struct Division {
    triangles: Vec<[[f64; 3]; 3]>,
    codes: Vec<u64>,
    nodes: Vec<Node>,
    turned: Vec<TurnedBox>,
}

impl Division {
    /// Adds the nodes of some triangles; gives the square of their longest side.
    fn divide(&mut self, range: Range<usize>) -> f64 {
        let (at, count) = (self.nodes.len(), range.len());
        let is_leaf = count <= LEAF;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        // That of a node with children follows from theirs.
        let around = range.start..if is_leaf { range.end } else { range.start };
        for p in self.triangles[around].as_flattened() {
            for i in 0..3 {
                (low[i], high[i]) = (low[i].min(p[i]), high[i].max(p[i]));
            }
        }
        self.nodes.push(Node {
            low,
            high,
            turned: NONE,
            at: range.start as u32,
            count: if is_leaf { count as u32 } else { 0 },
        });
        if is_leaf {
            let sides = self.triangles[range].iter();
            let sides = sides.flat_map(|t| (0..3).map(|k| side(t, k)));
            return sides.map(|d| dot(d, d)).fold(0.0, f64::max);
        }
        let middle = self.middle(range.clone());
        let longest = self.divide(range.start..middle);
        self.nodes[at].at = self.nodes.len() as u32;
        let longest = longest.max(self.divide(middle..range.end));
        let [a, b] = [&self.nodes[at + 1], &self.nodes[self.nodes[at].at as usize]];
        let (mut low, mut high) = (a.low, a.high);
        for i in 0..3 {
            (low[i], high[i]) = (low[i].min(b.low[i]), high[i].max(b.high[i]));
        }
        (self.nodes[at].low, self.nodes[at].high) = (low, high);
        let diagonal = sub(high, low);
        if count > MANY.0 && longest > MANY.1 * MANY.1 * dot(diagonal, diagonal) {
            self.nodes[at].turned = self.turned.len() as u32;
            self.turned.push(TurnedBox::around(&self.triangles[range]));
        }
        longest
    }

    /// Where the first bit of the codes that is not the same for all changes; half where all codes are the same.
    fn middle(&self, range: Range<usize>) -> usize {
        let codes = &self.codes[range.clone()];
        let [first, last] = [codes[0], codes[codes.len() - 1]];
        let half = match (first ^ last).checked_ilog2() {
            Some(bit) => codes.partition_point(|code| code >> bit == first >> bit),
            None => codes.len() / 2,
        };
        range.start + half
    }
}

fn side(t: &[[f64; 3]; 3], k: usize) -> [f64; 3] {
    sub(t[(k + 1) % 3], t[k])
}

impl TurnedBox {
    /// Its axes: along the longest side of any of the triangles, along that triangle's normal, and across both.
    fn around(triangles: &[[[f64; 3]; 3]]) -> Self {
        let sides = triangles.iter().flat_map(|t| (0..3).map(move |k| (t, k)));
        let squared = |(t, k): (&_, _)| dot(side(t, k), side(t, k));
        let longer = |a, b| squared(a) >= squared(b);
        let Some(longest) = sides.reduce(|a, b| if longer(a, b) { a } else { b }) else {
            return Self::default();
        };
        let (along, upward) = (side(longest.0, longest.1), normal(*longest.0));
        let axes = [along, upward, cross(along, upward)].map(|d| {
            let length = norm(d);
            d.map(|x| x / length)
        });
        if !axes.as_flattened().iter().all(|x| x.is_finite()) {
            return Self::default();
        }
        let points = || triangles.as_flattened().iter();
        // Products are rounded a few times.
        let reach = points().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let margin = 16.0 * f64::EPSILON * reach;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points() {
            for (i, axis) in axes.iter().enumerate() {
                let at = dot(*axis, *p);
                low[i] = low[i].min(at - margin);
                high[i] = high[i].max(at + margin);
            }
        }
        Self { axes, low, high }
    }

    fn squared_distance(&self, p: [f64; 3]) -> f64 {
        let off = |i: usize| {
            let at = dot(self.axes[i], p);
            (self.low[i] - at).max(at - self.high[i]).max(0.0)
        };
        (0..3).map(|i| off(i) * off(i)).sum()
    }
}

fn squared_to_box(p: [f64; 3], node: &Node) -> f64 {
    let off = |i: usize| (node.low[i] - p[i]).max(p[i] - node.high[i]).max(0.0);
    let off = [off(0), off(1), off(2)];
    dot(off, off)
}

/// Squared distance of a point from a triangle: which of its corners, sides and inside is nearest follows from six
/// products (Ericson, *Real-Time Collision Detection*, 5.1.5).
///
/// ```text
///        c
///       / \        u, v: how far p lies along ab and ac, seen from a (1, 2), b (3, 4) and c (5, 6)
///      /   \
///     a --- b
/// ```
///
/// A triangle without area is a segment or a point.
pub(crate) fn squared_distance(p: [f64; 3], t: [[f64; 3]; 3]) -> f64 {
    let squared = squared_distance_by_region(p, t);
    if squared.is_finite() {
        return squared;
    }
    let sides = (0..3).map(|k| distance_to_segment(p, t[k], t[(k + 1) % 3]));
    let nearest = sides.fold(f64::INFINITY, f64::min);
    nearest * nearest
}

/// Not a number where the triangle has no area and the region is divided by it.
fn squared_distance_by_region(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let to = |q: [f64; 3]| {
        let d = sub(p, q);
        dot(d, d)
    };
    let along =
        |from: [f64; 3], side: [f64; 3], t: f64| to(std::array::from_fn(|i| from[i] + t * side[i]));
    let ap = sub(p, a);
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return to(a);
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return to(b);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, ab, d1 / (d1 - d3));
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return to(c);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, ac, d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return along(b, sub(c, b), t);
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    to(std::array::from_fn(|i| a[i] + v * ab[i] + w * ac[i]))
}
