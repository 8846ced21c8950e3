//! The control mesh around one cell: all that the surface of the cell depends on, and how it is subdivided.
//!
//! *Enters:* a cell of a [`Cage`]. *Leaves:* [`Rings`]: the cells around its four corners with their points numbered in the order of a walk, so that places of a mesh that are alike give equal rings; and one step of Catmull–Clark
//! subdivision of these to the rings of a quarter of the cell (E. Catmull, J. Clark 1978; creases, darts and corners after H. Hoppe et al. 1994 and T. DeRose, M. Kass, T. Truong 1998).

use super::cage::Cage;

/// Cells around a cell.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Rings {
    /// Number of points.
    pub points: usize,
    /// The cell, then those around its corners; numbers of points, counterclockwise.
    pub cells: Vec<[u16; 4]>,
    /// Edges at a corner of the cell that are creases, those on the border included; the lower number first, in order.
    pub creases: Vec<[u16; 2]>,
    /// Corners of the cell that the surface passes through.
    pub is_corner: [bool; 4],
}

/// A point after subdivision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Child {
    Point(u16),
    /// Of an edge, the lower number first.
    Edge(u16, u16),
    Cell(u16),
}

fn sorted(a: u16, b: u16) -> [u16; 2] {
    [a.min(b), a.max(b)]
}

/// A quarter of a cell: its rings, and each of their points as weights of points of the whole.
pub(super) struct Quarter {
    /// Cells around it.
    pub rings: Rings,
    /// Row by row.
    pub weights: Vec<f64>,
}

impl Rings {
    /// The rings of a cell, and the points of the control mesh that theirs are.
    pub fn of(cage: &Cage, cell: u32) -> (Self, Vec<u32>) {
        let mut cells = vec![cell];
        for k in 0..4 {
            let star = cage.star((cell, k));
            cells.extend(star.iter().map(|side| side.0));
        }
        cells[1..].sort_unstable();
        cells.dedup();
        if let Some(again) = cells.iter().skip(1).position(|&c| c == cell) {
            cells.remove(again + 1);
        }
        let corners: Vec<[u32; 4]> = cells.iter().map(|&c| cage.cells[c as usize]).collect();
        let is_crease = |a: u32, b: u32| {
            let mut sides = cells.iter().flat_map(|&c| (0..4).map(move |k| (c, k)));
            sides.any(|side| {
                let ends = [cage.tail(side), cage.tail((side.0, side.1 + 1))];
                (ends == [a, b] || ends == [b, a]) && cage.is_crease(side)
            })
        };
        numbered(&corners, is_crease, |v| cage.is_corner[v as usize])
    }

    fn is_crease(&self, a: u16, b: u16) -> bool {
        self.creases.binary_search(&sorted(a, b)).is_ok()
    }

    /// Neighbours of a corner of the cell along edges, and cells around it with its place in them.
    fn around(&self, v: u16) -> (Vec<u16>, Vec<(usize, usize)>) {
        let mut neighbours = Vec::new();
        let mut around = Vec::new();
        for (f, corners) in self.cells.iter().enumerate() {
            if let Some(p) = corners.iter().position(|&x| x == v) {
                around.push((f, p));
                for x in [corners[(p + 1) % 4], corners[(p + 3) % 4]] {
                    if !neighbours.contains(&x) {
                        neighbours.push(x);
                    }
                }
            }
        }
        (neighbours, around)
    }

    /// Weights of a point after subdivision.
    fn stencil(&self, child: Child) -> Vec<f64> {
        let mut row = vec![0.0; self.points];
        let add_cell = |row: &mut [f64], f: usize, weight: f64| {
            for &v in &self.cells[f] {
                row[usize::from(v)] += weight / 4.0;
            }
        };
        match child {
            Child::Cell(f) => add_cell(&mut row, usize::from(f), 1.0),
            Child::Edge(a, b) => {
                let beside = [[a, b], [b, a]]
                    .into_iter()
                    .filter_map(|ends| self.across(ends));
                let is_crease = self.is_crease(a, b);
                let weight = if is_crease { 0.5 } else { 0.25 };
                row[usize::from(a)] += weight;
                row[usize::from(b)] += weight;
                if !is_crease {
                    beside.for_each(|(f, _)| add_cell(&mut row, f, 0.25));
                }
            }
            Child::Point(v) => {
                let (neighbours, around) = self.around(v);
                let creases: Vec<u16> = neighbours
                    .iter()
                    .copied()
                    .filter(|&x| self.is_crease(v, x))
                    .collect();
                let place = self.cells[0].iter().position(|&x| x == v);
                match (place.is_some_and(|k| self.is_corner[k]), &creases[..]) {
                    (false, &[x, y]) => {
                        row[usize::from(v)] += 0.75;
                        row[usize::from(x)] += 0.125;
                        row[usize::from(y)] += 0.125;
                    }
                    (false, [] | [_]) => {
                        let n = neighbours.len() as f64;
                        row[usize::from(v)] += (n - 2.0) / n;
                        for x in neighbours {
                            row[usize::from(x)] += 1.0 / (n * n);
                        }
                        for (f, _) in around {
                            add_cell(&mut row, f, 1.0 / (n * n));
                        }
                    }
                    _ => row[usize::from(v)] = 1.0,
                }
            }
        }
        row
    }

    /// The quarter of a cell at one of its corners; its own corners are in the order of the cell's.
    pub fn quarter(&self, corner: usize) -> Quarter {
        let cell = self.cells[0];
        let mut parts: Vec<(usize, usize)> = vec![(0, corner)];
        let mut push = |part| {
            if !parts.contains(&part) {
                parts.push(part);
            }
        };
        self.around(cell[corner]).1.into_iter().for_each(&mut push);
        (0..4).for_each(|p| push((0, p)));
        // Both cells at an edge, at both of its ends.
        for k in [corner, (corner + 3) % 4] {
            let [a, b] = [cell[k], cell[(k + 1) % 4]];
            for (f, p) in [[a, b], [b, a]]
                .into_iter()
                .filter_map(|ends| self.across(ends))
            {
                push((f, p));
                push((f, (p + 1) % 4));
            }
        }
        // Names of points in the order in which they are met.
        let mut children: Vec<Child> = Vec::new();
        let mut number = |child: Child| match children.iter().position(|c| *c == child) {
            Some(i) => i as u32,
            None => {
                children.push(child);
                children.len() as u32 - 1
            }
        };
        let mut cells: Vec<[u32; 4]> = Vec::new();
        for (f, p) in parts {
            let at = |i: usize| self.cells[f][(p + i) % 4];
            let edge = |a, b| {
                let [a, b] = sorted(a, b);
                Child::Edge(a, b)
            };
            let mut quad = [0; 4];
            for (i, child) in [
                Child::Point(at(0)),
                edge(at(0), at(1)),
                Child::Cell(f as u16),
                edge(at(3), at(0)),
            ]
            .into_iter()
            .enumerate()
            {
                quad[(p + i) % 4] = number(child);
            }
            cells.push(quad);
        }
        let is_crease = |a: u32, b: u32| {
            let half = |v: Child, e: Child| match (v, e) {
                (Child::Point(v), Child::Edge(a, b)) => (v == a || v == b) && self.is_crease(a, b),
                _ => false,
            };
            let (a, b) = (children[a as usize], children[b as usize]);
            half(a, b) || half(b, a)
        };
        let is_corner = |v: u32| match children[v as usize] {
            Child::Point(v) => (0..4).any(|k| cell[k] == v && self.is_corner[k]),
            _ => false,
        };
        let (rings, points) = numbered(&cells, is_crease, is_corner);
        let weights = points
            .iter()
            .flat_map(|&v| self.stencil(children[v as usize]));
        Quarter {
            weights: weights.collect(),
            rings,
        }
    }

    /// The sixteen control points of a bicubic piece as weights of the points, row by row (u first), where the cell is one.
    pub fn regular(&self) -> Option<Vec<[f64; 16]>> {
        let cell = self.cells[0];
        let mut creases = [0; 4];
        for (k, &v) in cell.iter().enumerate() {
            let (neighbours, around) = self.around(v);
            let own = [cell[(k + 1) % 4], cell[(k + 3) % 4]].map(|x| self.is_crease(v, x));
            creases[k] = neighbours.iter().filter(|&&x| self.is_crease(v, x)).count();
            let is_regular = match own {
                [false, false] => !self.is_corner[k] && creases[k] == 0 && around.len() == 4,
                [true, true] => self.is_corner[k],
                _ => !self.is_corner[k] && creases[k] == 2 && self.sector(k) == 2,
            };
            if !is_regular {
                return None;
            }
        }
        // Points by column and row from −1 to 2; those beyond creases are mirrored below.
        let mut at: [[Option<Vec<f64>>; 4]; 4] = Default::default();
        let unit = |v: u16| {
            let mut row = vec![0.0; self.points];
            row[usize::from(v)] = 1.0;
            Some(row)
        };
        const CORNERS: [[usize; 2]; 4] = [[1, 1], [2, 1], [2, 2], [1, 2]];
        let step = |[x, y]: [usize; 2], d: usize| match d & 3 {
            0 => [x + 1, y],
            1 => [x, y + 1],
            2 => [x - 1, y],
            _ => [x, y - 1],
        };
        for k in 0..4 {
            let [x, y] = CORNERS[k];
            at[y][x] = unit(cell[k]);
        }
        for k in 0..4 {
            // The cell across side k, and that across its corner k.
            let ends = [cell[(k + 1) % 4], cell[k]];
            let beyond = self
                .across(ends)
                .filter(|_| !self.is_crease(ends[0], ends[1]));
            let Some((f, p)) = beyond else { continue };
            let far = [self.cells[f][(p + 2) % 4], self.cells[f][(p + 3) % 4]];
            let [x, y] = step(CORNERS[k], k + 3);
            at[y][x] = unit(far[0]);
            let [x, y] = step(CORNERS[(k + 1) % 4], k + 3);
            at[y][x] = unit(far[1]);
            // From the side of that cell at corner k on to the one beyond.
            let ends = [cell[k], far[0]];
            if let Some((f, p)) = self
                .across([ends[1], ends[0]])
                .filter(|_| !self.is_crease(ends[0], ends[1]))
            {
                let [x, y] = step(step(CORNERS[k], k + 3), k + 2);
                at[y][x] = unit(self.cells[f][(p + 3) % 4]);
            }
        }
        let mirrored = |near: &Option<Vec<f64>>, next: &Option<Vec<f64>>| {
            let pair = near.as_ref()?.iter().zip(next.as_ref()?);
            Some(pair.map(|(a, b)| 2.0 * a - b).collect())
        };
        // First whole rows, then columns, whose ends may be in these.
        let rows = (0..4).flat_map(|x| [[[0, x], [1, x], [2, x]], [[3, x], [2, x], [1, x]]]);
        let columns = (0..4).flat_map(|y| [[[y, 0], [y, 1], [y, 2]], [[y, 3], [y, 2], [y, 1]]]);
        for [far, near, next] in rows.chain(columns) {
            if at[far[0]][far[1]].is_none() {
                at[far[0]][far[1]] = mirrored(&at[near[0]][near[1]], &at[next[0]][next[1]]);
            }
        }
        let mut weights = vec![[0.0; 16]; self.points];
        for (i, row) in at.iter().flatten().enumerate() {
            for (weights, w) in weights.iter_mut().zip(row.as_ref()?) {
                weights[i] = *w;
            }
        }
        Some(weights)
    }

    /// The cell that has a side from the first to the second point, and which.
    fn across(&self, [a, b]: [u16; 2]) -> Option<(usize, usize)> {
        let find = |c: &[u16; 4]| (0..4).find(|&p| c[p] == a && c[(p + 1) % 4] == b);
        self.cells
            .iter()
            .enumerate()
            .find_map(|(f, c)| Some((f, find(c)?)))
    }

    /// Cells at a corner of the cell from crease to crease, the cell among them.
    fn sector(&self, corner: usize) -> usize {
        let v = self.cells[0][corner];
        let mut cells = 1;
        // Counterclockwise across the side that comes in, clockwise across that which leaves.
        for forward in [true, false] {
            let (mut f, mut p) = (0, corner);
            while cells <= self.cells.len() {
                let x = self.cells[f][if forward { (p + 3) % 4 } else { (p + 1) % 4 }];
                if self.is_crease(v, x) {
                    break;
                }
                let ends = if forward { [v, x] } else { [x, v] };
                let Some((g, q)) = self.across(ends) else {
                    break;
                };
                (f, p) = (g, if forward { q } else { (q + 1) % 4 });
                cells += 1;
            }
        }
        cells
    }
}

/// Rings with the points numbered: the first cell is the middle one.
fn numbered(
    cells: &[[u32; 4]],
    is_crease: impl Fn(u32, u32) -> bool,
    is_corner: impl Fn(u32) -> bool,
) -> (Rings, Vec<u32>) {
    let mut points: Vec<u32> = Vec::new();
    let mut placed: Vec<[u16; 4]> = Vec::new();
    let mut is_placed = vec![false; cells.len()];
    let mut place = |f: usize, p: usize, points: &mut Vec<u32>, placed: &mut Vec<[u16; 4]>| {
        if std::mem::replace(&mut is_placed[f], true) {
            return;
        }
        let quad = [0, 1, 2, 3].map(|i| {
            let v = cells[f][(p + i) % 4];
            let known = points.iter().position(|&x| x == v);
            let number = known.unwrap_or(points.len());
            if known.is_none() {
                points.push(v);
            }
            number as u16
        });
        placed.push(quad);
    };
    place(0, 0, &mut points, &mut placed);
    let find = |a: u32, b: u32| {
        let of = |c: &[u32; 4]| (0..4).find(|&p| c[p] == a && c[(p + 1) % 4] == b);
        cells
            .iter()
            .enumerate()
            .find_map(|(f, c)| Some((f, of(c)?)))
    };
    let middle = cells[0];
    for (k, &v) in middle.iter().enumerate() {
        let (mut f, mut p) = (0, k);
        let mut is_whole = false;
        for _ in 0..cells.len() {
            let Some((g, q)) = find(v, cells[f][(p + 3) % 4]) else {
                break;
            };
            (f, p) = (g, q);
            if f == 0 {
                is_whole = true;
                break;
            }
            place(f, p, &mut points, &mut placed);
        }
        if is_whole {
            continue;
        }
        (f, p) = (0, k);
        for _ in 0..cells.len() {
            let Some((g, q)) = find(cells[f][(p + 1) % 4], v) else {
                break;
            };
            (f, p) = (g, (q + 1) % 4);
            place(f, p, &mut points, &mut placed);
        }
    }
    let mut creases = Vec::new();
    for quad in &placed {
        for p in 0..4 {
            let [a, b] = [quad[p], quad[(p + 1) % 4]];
            // Corners of the cell have the first four numbers.
            let is_near = a < 4 || b < 4;
            if is_near && is_crease(points[usize::from(a)], points[usize::from(b)]) {
                creases.push(sorted(a, b));
            }
        }
    }
    creases.sort_unstable();
    creases.dedup();
    let rings = Rings {
        points: points.len(),
        cells: placed,
        creases,
        is_corner: middle.map(is_corner),
    };
    (rings, points)
}
