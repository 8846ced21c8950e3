//! Points and tangents of Catmull–Clark limit surfaces at any place of any cell, as weights of control points.
//!
//! *Enters:* a [`Cage`], then a cell and a place (s, t) in it: along its first side, and from that to the opposite one. *Leaves:* weights of the points and of the derivatives by s and t.
//!
//! A cell whose surroundings are regular is a bicubic B-spline piece. Of others the quarter that the place is in is taken, until one is regular (J. Stam 1998); what belongs to a quarter is computed once for
//! all cells whose surroundings are alike, and a quarter at an irregular point soon is like its own. *Guaranteed:* limit positions to rounding: beside an irregular point after 64 halvings, by when
//! less than 1e-9 of a cell is left. Derivatives within 2⁻²⁴ of one are those at that distance.

use super::cage::Cage;
use super::rings::Rings;
use super::surface::Jet;
use rustc_hash::FxHashMap;

/// Halvings towards an irregular point, for positions.
const MOST_DEPTH: usize = 64;
/// And for derivatives, which lose a digit with 3.3 halvings.
const MOST_DEPTH_OF_DERIVATIVES: usize = 24;

/// What is computed once for a kind of surroundings.
struct Node {
    points: usize,
    /// Sixteen control points as weights of the points, where the piece is bicubic.
    regular: Option<Vec<[f64; 16]>>,
    /// Where each is one of the points, which of the sixteen each point is.
    order: Option<[u8; 16]>,
    /// Quarters at the four corners: their kind, and their points as weights, row by row. None where regular.
    quarters: Vec<(u32, Vec<f64>)>,
}

/// See the module docs.
pub struct Evaluator {
    nodes: Vec<Node>,
    /// Of each cell: its kind, and where its points begin.
    cell: Vec<(u32, u32)>,
    points: Vec<u32>,
}

/// Weights at a place, in the order of [`Evaluator::points`].
#[derive(Clone, Debug, Default)]
pub struct Weights {
    /// Of the point.
    pub value: Vec<f64>,
    /// Of the derivatives by s and t.
    pub derivative: [Vec<f64>; 2],
}

/// A bicubic piece of the surface: a square part of a cell.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Its lower left corner in the cell.
    pub corner: [f64; 2],
    /// Its side.
    pub side: f64,
    /// Control points of the uniform bicubic B-spline, first by column; the piece lies over the middle of nine.
    pub control: [[f64; 3]; 16],
}

/// Weights of the four control points of a uniform cubic B-spline, and their derivatives.
pub(super) fn uniform(t: f64) -> [[f64; 4]; 2] {
    let r = 1.0 - t;
    let (t2, r2) = (t * t, r * r);
    [
        [
            r2 * r / 6.0,
            (3.0 * t2 * t - 6.0 * t2 + 4.0) / 6.0,
            (3.0 * r2 * r - 6.0 * r2 + 4.0) / 6.0,
            t2 * t / 6.0,
        ],
        [
            -r2 / 2.0,
            1.5 * t2 - 2.0 * t,
            -(1.5 * r2 - 2.0 * r),
            t2 / 2.0,
        ],
    ]
}

/// The quarter that a place is in, and the place there.
fn descend([s, t]: [f64; 2]) -> (usize, [f64; 2]) {
    let quarter = match (s < 0.5, t < 0.5) {
        (true, true) => 0,
        (false, true) => 1,
        (false, false) => 2,
        (true, false) => 3,
    };
    let low = CORNER[quarter];
    (quarter, [2.0 * s - low[0], 2.0 * t - low[1]])
}

/// Where the corners of a cell are.
pub const CORNER: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

impl Evaluator {
    /// Prepares the cells of a control mesh.
    pub fn new(cage: &Cage) -> Self {
        let mut known: FxHashMap<Rings, u32> = FxHashMap::default();
        let mut evaluator = Self {
            nodes: Vec::new(),
            cell: Vec::with_capacity(cage.cells.len()),
            points: Vec::new(),
        };
        for cell in 0..cage.cells.len() as u32 {
            let (rings, points) = Rings::of(cage, cell);
            let node = evaluator.node(rings, &mut known);
            evaluator.cell.push((node, evaluator.points.len() as u32));
            evaluator.points.extend(points);
        }
        evaluator
    }

    fn node(&mut self, rings: Rings, known: &mut FxHashMap<Rings, u32>) -> u32 {
        if let Some(&node) = known.get(&rings) {
            return node;
        }
        let mut waiting = vec![(self.enter(&rings), rings.clone())];
        let first = waiting[0].0;
        known.insert(rings, first);
        while let Some((node, rings)) = waiting.pop() {
            if self.nodes[node as usize].regular.is_some() {
                continue;
            }
            for corner in 0..4 {
                let quarter = rings.quarter(corner);
                let child = match known.get(&quarter.rings) {
                    Some(&child) => child,
                    None => {
                        let child = self.enter(&quarter.rings);
                        known.insert(quarter.rings.clone(), child);
                        waiting.push((child, quarter.rings));
                        child
                    }
                };
                self.nodes[node as usize]
                    .quarters
                    .push((child, quarter.weights));
            }
        }
        first
    }

    fn enter(&mut self, rings: &Rings) -> u32 {
        let regular = rings.regular();
        self.nodes.push(Node {
            points: rings.points,
            order: regular.as_deref().and_then(order),
            regular,
            quarters: Vec::new(),
        });
        self.nodes.len() as u32 - 1
    }

    /// Control points that the surface of a cell depends on.
    pub fn points(&self, cell: u32) -> &[u32] {
        let (node, first) = self.cell[cell as usize];
        &self.points[first as usize..][..self.nodes[node as usize].points]
    }

    /// Weights of the point at a place of a cell, in the order of [`points`](Self::points), put in the place of what is in `value`.
    pub fn value(&self, cell: u32, place: [f64; 2], value: &mut Vec<f64>) {
        let root = self.cell[cell as usize].0;
        if let Some(order) = &self.nodes[root as usize].order {
            let [[s, _], [t, _]] = place.map(uniform);
            value.clear();
            value.extend(
                order
                    .iter()
                    .map(|&i| s[usize::from(i % 4)] * t[usize::from(i / 4)]),
            );
            return;
        }
        let mut path = [(0u32, 0u8); MOST_DEPTH];
        let (depth, node, at, _) = self.path(root, place, MOST_DEPTH, &mut path);
        let [s, t] = at.map(uniform);
        *value = self.back(&path[..depth], self.leaf(node, &s[0], &t[0], 1.0));
    }

    /// The same of the point and of the derivatives by s and t.
    pub fn weights(&self, cell: u32, place: [f64; 2]) -> Weights {
        let mut path = [(0u32, 0u8); MOST_DEPTH];
        let root = self.cell[cell as usize].0;
        let (depth, node, at, is_end) =
            self.path(root, place, MOST_DEPTH_OF_DERIVATIVES, &mut path);
        let [s, t] = at.map(uniform);
        let scale = 2f64.powi(depth as i32);
        let path = &path[..depth];
        Weights {
            value: match is_end {
                false => self.back(path, self.leaf(node, &s[0], &t[0], 1.0)),
                true => {
                    let mut value = Vec::new();
                    self.value(cell, place, &mut value);
                    value
                }
            },
            derivative: [
                self.back(path, self.leaf(node, &s[1], &t[0], scale)),
                self.back(path, self.leaf(node, &s[0], &t[1], scale)),
            ],
        }
    }

    /// Weights of the points of a bicubic piece.
    fn leaf(&self, node: u32, s: &[f64; 4], t: &[f64; 4], scale: f64) -> Vec<f64> {
        let regular = self.nodes[node as usize].regular.as_deref().unwrap_or(&[]);
        let tensor: [f64; 16] = std::array::from_fn(|i| scale * s[i % 4] * t[i / 4]);
        let weight = |row: &[f64; 16]| row.iter().zip(&tensor).map(|(a, b)| a * b).sum();
        regular.iter().map(weight).collect()
    }

    /// Quarters down to a bicubic piece: how many, its kind, the place in it, and whether the way ended before there was one, so that the nearest was taken.
    fn path(
        &self,
        root: u32,
        place: [f64; 2],
        most: usize,
        path: &mut [(u32, u8); MOST_DEPTH],
    ) -> (usize, u32, [f64; 2], bool) {
        let (mut node, mut at) = (root, place);
        for (depth, step) in path.iter_mut().enumerate().take(most) {
            let own = &self.nodes[node as usize];
            if own.regular.is_some() {
                return (depth, node, at, false);
            }
            let is_last = depth + 1 == most;
            let (mut quarter, mut inside) = descend(at);
            if is_last {
                // Away from the irregular point, which is at the corner of this quarter.
                let opposite = (0..4).map(|k| (quarter + 2 + k) % 4);
                let is_regular =
                    |q: &usize| self.nodes[own.quarters[*q].0 as usize].regular.is_some();
                quarter = opposite.into_iter().find(is_regular).unwrap_or(quarter);
                let low = CORNER[quarter];
                inside = [0, 1].map(|i| (2.0 * at[i] - low[i]).clamp(0.0, 1.0));
            }
            *step = (node, quarter as u8);
            (node, at) = (own.quarters[quarter].0, inside);
            if is_last {
                return (most, node, at, true);
            }
        }
        (most, node, at, true)
    }

    /// Weights of points of a quarter as those of the whole.
    fn back(&self, path: &[(u32, u8)], mut weights: Vec<f64>) -> Vec<f64> {
        for &(node, quarter) in path.iter().rev() {
            let node = &self.nodes[node as usize];
            let rows = node.quarters[usize::from(quarter)]
                .1
                .chunks_exact(node.points);
            let mut whole = vec![0.0; node.points];
            for (w, row) in weights.iter().zip(rows) {
                for (sum, x) in whole.iter_mut().zip(row) {
                    *sum += w * x;
                }
            }
            weights = whole;
        }
        weights
    }

    /// The bicubic piece around a place that is not an irregular point.
    pub fn piece(&self, control: &[[f64; 3]], cell: u32, place: [f64; 2]) -> Piece {
        let mut part = self.whole(control, cell);
        let mut at = place;
        for _ in 0..MOST_DEPTH {
            if self.nodes[part.node as usize].regular.is_some() {
                break;
            }
            let (quarter, inside) = descend(at);
            (part, at) = (self.quarter(&part, quarter), inside);
        }
        self.bicubic(&part)
    }

    /// All bicubic pieces of a cell whose side is at least 2⁻ᵈ.
    pub fn pieces(&self, control: &[[f64; 3]], cell: u32, depth: usize) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut parts = vec![self.whole(control, cell)];
        for d in 0..=depth {
            let (regular, irregular): (Vec<Part>, Vec<Part>) = parts
                .into_iter()
                .partition(|part| self.nodes[part.node as usize].regular.is_some());
            pieces.extend(regular.iter().map(|part| self.bicubic(part)));
            let last = d == depth;
            let quarters = irregular.iter().filter(|_| !last);
            parts = quarters
                .flat_map(|part| (0..4).map(move |q| self.quarter(part, q)))
                .collect();
        }
        pieces
    }

    fn whole(&self, control: &[[f64; 3]], cell: u32) -> Part {
        let points = self.points(cell).iter().map(|&v| control[v as usize]);
        Part {
            node: self.cell[cell as usize].0,
            points: points.collect(),
            corner: [0.0; 2],
            side: 1.0,
        }
    }

    fn quarter(&self, part: &Part, quarter: usize) -> Part {
        let own = &self.nodes[part.node as usize];
        let (node, rows) = &own.quarters[quarter];
        let side = part.side / 2.0;
        let combined = |row: &[f64]| {
            let mut sum = [0.0; 3];
            for (w, p) in row.iter().zip(&part.points) {
                (0..3).for_each(|c| sum[c] += w * p[c]);
            }
            sum
        };
        Part {
            node: *node,
            points: rows.chunks_exact(own.points).map(combined).collect(),
            corner: [0, 1].map(|i| part.corner[i] + side * CORNER[quarter][i]),
            side,
        }
    }

    fn bicubic(&self, part: &Part) -> Piece {
        let regular = self.nodes[part.node as usize]
            .regular
            .as_deref()
            .unwrap_or(&[]);
        let mut control = [[0.0; 3]; 16];
        for (row, p) in regular.iter().zip(&part.points) {
            for (sum, w) in control.iter_mut().zip(row) {
                (0..3).for_each(|c| sum[c] += w * p[c]);
            }
        }
        Piece {
            corner: part.corner,
            side: part.side,
            control,
        }
    }
}

/// Which of sixteen control points each point is, if that is all that it is.
fn order(rows: &[[f64; 16]]) -> Option<[u8; 16]> {
    let rows: &[[f64; 16]; 16] = rows.try_into().ok()?;
    let mut order = [0; 16];
    for (own, row) in order.iter_mut().zip(rows) {
        let one = row.iter().position(|&x| x == 1.0)?;
        if row.iter().filter(|&&x| x != 0.0).count() > 1 {
            return None;
        }
        *own = one as u8;
    }
    Some(order)
}

/// A square part of a cell with the points that its surface depends on.
struct Part {
    node: u32,
    points: Vec<[f64; 3]>,
    corner: [f64; 2],
    side: f64,
}

impl Piece {
    /// The point and the derivatives by the cell's parameters.
    pub fn at(&self, place: [f64; 2]) -> Jet {
        let [s, t] = [0, 1].map(|i| uniform((place[i] - self.corner[i]) / self.side));
        let mut jet = Jet {
            point: [0.0; 3],
            tangent: [[0.0; 3]; 2],
        };
        for (i, p) in self.control.iter().enumerate() {
            let (x, y) = (i % 4, i / 4);
            let w = [s[0][x] * t[0][y], s[1][x] * t[0][y], s[0][x] * t[1][y]];
            for (c, x) in p.iter().enumerate() {
                jet.point[c] += w[0] * x;
                jet.tangent[0][c] += w[1] * x;
                jet.tangent[1][c] += w[2] * x;
            }
        }
        jet.tangent = jet.tangent.map(|d| d.map(|x| x / self.side));
        jet
    }

    /// Whether a place lies in it.
    pub fn contains(&self, place: [f64; 2]) -> bool {
        (0..2).all(|i| self.corner[i] <= place[i] && place[i] <= self.corner[i] + self.side)
    }
}
