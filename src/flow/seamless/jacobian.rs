//! Derivatives of cone angles and turnings by λ.
//!
//! *Enters:* a [`State`]. *Leaves:* sparse matrices by columns: one column an edge of the given triangulation, one row an equation. An edge that moves with another
//! one, its mirror image, adds to that one's column and has an empty one itself. *Guaranteed:* exact at
//! every λ, also across flips, where the derivative is continuous.
//!
//! By the lengths of the Delaunay triangulation, with w_k = ½ cot θ_k, a face has ∂θ_k/∂λ_k = w_i + w_j and ∂θ_k/∂λ_i = −w_j (λ_k opposite corner k). Those lengths
//! depend on λ by the rows of T: the unit row where an edge was never flipped, else d λ_dc = −d λ_ab + w (d λ_ad + d λ_bc) + (1 − w)(d λ_ca + d λ_db)
//! one flip after another; after flips that keep the metric likewise, with other factors.

use super::SeamlessError;
use super::state::{Problem, State};
use crate::flow::delaunay::PtolemyFlip;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, Id, IdVec, NONE, VertexId};
use crate::parallel;

/// Most products for each edge, of entries of T one flip after another or of the Jacobian by its transpose; ordinary meshes have about ten.
const MOST_PRODUCTS_OF_EDGE: usize = 60;
/// So many are allowed whatever the number of edges: less than half a gigabyte.
const ALLOWED_PRODUCTS: usize = 20_000_000;

/// Most products on a surface of so many edges.
pub(super) fn most_products(edges: usize) -> usize {
    (MOST_PRODUCTS_OF_EDGE * edges).max(ALLOWED_PRODUCTS)
}

/// A sparse matrix by columns; the rows of a column ascend.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    /// Column c has the entries `first[c]..first[c + 1]`.
    first: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
}

/// How flipped edges depend on λ.
struct FlippedRows {
    /// Number of the row of an edge, `NONE` where it was never flipped.
    number: EdgeVec<u32>,
    edge: Vec<EdgeId>,
    row: Vec<Vec<(u32, f64)>>,
}

/// Adds up the entries of one column.
struct Collector {
    sum: Vec<f64>,
    /// The column in which a row was last met.
    met: Vec<u32>,
    rows: Vec<u32>,
}

/// Where the entries of each row begin, and column and place in it of each entry.
pub(super) type ByRow = (Vec<u32>, Vec<(u32, u32)>);

/// Columns that are worked out by one thread, at least, and parts that there are at most: each has a place for every row.
const RUN: usize = 16_384;
const MOST_RUNS: usize = 32;

impl Columns {
    /// So many columns of so many rows; `add` adds the entries of one.
    fn new(columns: usize, rows: usize, add: impl Fn(usize, &mut Collector) + Sync) -> Self {
        let run = RUN.max(columns.div_ceil(MOST_RUNS));
        let parts = parallel::map_numbers(columns.div_ceil(run), |i| {
            let mut part = Self {
                first: vec![0],
                ..Self::default()
            };
            let mut collector = Collector::new(rows);
            for column in i * run..columns.min((i + 1) * run) {
                add(column, &mut collector);
                part.close(&mut collector);
            }
            part
        });
        let entries = parts.iter().map(|part| part.row.len()).sum();
        let mut all = Self {
            first: Vec::with_capacity(columns + 1),
            row: Vec::with_capacity(entries),
            value: Vec::with_capacity(entries),
        };
        all.first.push(0);
        for part in parts {
            let before = all.row.len() as u32;
            all.first
                .extend(part.first[1..].iter().map(|at| before + at));
            all.row.extend(part.row);
            all.value.extend(part.value);
        }
        all
    }

    /// Rows and values of a column.
    pub(super) fn column(&self, c: usize) -> (&[u32], &[f64]) {
        let range = self.first[c] as usize..self.first[c + 1] as usize;
        (&self.row[range.clone()], &self.value[range])
    }

    /// Number of columns.
    pub(super) fn count(&self) -> usize {
        self.first.len() - 1
    }

    /// The inner product of a column with `by`.
    pub(super) fn dot(&self, c: usize, by: &[f64]) -> f64 {
        let (rows, values) = self.column(c);
        let parts = rows.iter().zip(values).map(|(&r, v)| v * by[r as usize]);
        parts.sum()
    }

    /// The matrix times `by`, for `rows` rows.
    pub(super) fn times(&self, by: &EdgeVec<f64>, rows: usize) -> Vec<f64> {
        let mut product = vec![0.0; rows];
        for (c, by) in by.iter().enumerate() {
            let (rows, values) = self.column(c);
            for (&r, v) in rows.iter().zip(values) {
                product[r as usize] += v * by;
            }
        }
        product
    }

    /// Entries by rows.
    pub(super) fn by_row(&self, rows: usize) -> ByRow {
        let mut first = vec![0u32; rows + 1];
        for &r in &self.row {
            first[r as usize + 1] += 1;
        }
        for r in 0..rows {
            first[r + 1] += first[r];
        }
        let mut next = first.clone();
        let mut entries = vec![(0, 0); self.row.len()];
        for c in 0..self.count() {
            for (at, &r) in self.column(c).0.iter().enumerate() {
                entries[next[r as usize] as usize] = (c as u32, at as u32);
                next[r as usize] += 1;
            }
        }
        (first, entries)
    }

    fn close(&mut self, collector: &mut Collector) {
        collector.rows.sort_unstable();
        for &r in &collector.rows {
            self.row.push(r);
            self.value.push(collector.sum[r as usize]);
        }
        collector.rows.clear();
        self.first.push(self.row.len() as u32);
    }
}

impl Collector {
    fn new(rows: usize) -> Self {
        Self {
            sum: vec![0.0; rows],
            met: vec![NONE; rows],
            rows: Vec::new(),
        }
    }

    fn add(&mut self, column: usize, row: u32, value: f64) {
        let r = row as usize;
        if self.met[r] != column as u32 {
            self.met[r] = column as u32;
            self.sum[r] = 0.0;
            self.rows.push(row);
        }
        self.sum[r] += value;
    }
}

impl State {
    /// ∂(angles)/∂λ: a column an edge of the given triangulation.
    pub(super) fn by_edges(&self, problem: &Problem) -> Result<Columns, SeamlessError> {
        let c = &self.connectivity;
        let edges = c.edge_count();
        let flipped = FlippedRows::new(self, edges)?;
        let side = self.sides_of_features(problem);
        let (first, dependent) = flipped.by_edge(edges);
        let images = images(&problem.shares);
        Ok(Columns::new(edges, problem.equations(), |column, sum| {
            let e = EdgeId::new(column);
            let together = [Some(e), images[e]].into_iter().flatten();
            for part in together.filter(|_| problem.shares[e] == e) {
                if flipped.number[part] == NONE {
                    self.add_edge(problem, &side, part, 1.0, column, sum);
                }
                let range = first[part.index()] as usize..first[part.index() + 1] as usize;
                for &(of, share) in &dependent[range] {
                    self.add_edge(problem, &side, of, share, column, sum);
                }
            }
        }))
    }

    /// ∂(angles)/∂u for a scale u at every vertex: a column a vertex.
    pub(super) fn by_scales(&self, problem: &Problem, by_edges: &Columns) -> Columns {
        let c = &self.connectivity;
        if !self.glued.is_empty() {
            return self.by_scales_of_edges(problem, by_edges);
        }
        // Scales commute with flips by Ptolemy's theorem, so T is not needed.
        let images = images(&problem.vertex_shares);
        Columns::new(c.vertex_count(), problem.equations(), |column, sum| {
            let v = VertexId::new(column);
            let together = [Some(v), images[v]].into_iter().flatten();
            let together = together.filter(|_| problem.vertex_shares[v] == v);
            for h in together.flat_map(|part| c.outgoing(part)) {
                let (f, k) = (c.face(h), c.corner(h));
                let weight = self.shape[f].weight;
                // ∂θ_i/∂u_k is the weight of the third corner, and angles of a face sum to π.
                let derivative = |corner: usize| match corner == k {
                    true => -(weight[(k + 1) % 3] + weight[(k + 2) % 3]),
                    false => weight[3 - corner - k],
                };
                self.add_corners(problem, f, derivative, column, sum);
            }
        })
    }

    /// The same by the edges of the given triangulation at every vertex: those that move with others have empty columns.
    fn by_scales_of_edges(&self, problem: &Problem, by_edges: &Columns) -> Columns {
        let c = problem.base;
        let images = images(&problem.vertex_shares);
        Columns::new(c.vertex_count(), problem.equations(), |column, sum| {
            let v = VertexId::new(column);
            let together = [Some(v), images[v]].into_iter().flatten();
            let together = together.filter(|_| problem.vertex_shares[v] == v);
            let ends = together.flat_map(|part| c.outgoing(part));
            for h in ends.filter(|&h| problem.shares[c.edge(h)] == c.edge(h)) {
                let (rows, values) = by_edges.column(c.edge(h).index());
                for (&r, &value) in rows.iter().zip(values) {
                    sum.add(column, r, value);
                }
            }
        })
    }

    /// The equation that an edge is a side of, and its sign there; `NONE` for others.
    fn sides_of_features(&self, problem: &Problem) -> EdgeVec<(u32, f64)> {
        let mut side = EdgeVec::filled((NONE, 0.0), self.connectivity.edge_count());
        for (i, pair) in self.glued.iter().enumerate() {
            for (&e, sign) in pair.iter().zip([1.0, -1.0]) {
                side[e] = ((problem.cone_equations + i) as u32, sign);
            }
        }
        side
    }

    /// `share` times the derivatives by the length of one edge of this triangulation.
    fn add_edge(
        &self,
        problem: &Problem,
        side: &EdgeVec<(u32, f64)>,
        e: EdgeId,
        share: f64,
        column: usize,
        collector: &mut Collector,
    ) {
        let c = &self.connectivity;
        let h = c.edge_halfedge(e);
        let (row, sign) = side[e];
        if row != NONE {
            collector.add(column, row, sign * share);
        }
        for h in [Some(h), c.twin(h)].into_iter().flatten() {
            let opposite = (c.corner(h) + 2) % 3;
            let weight = self.shape[c.face(h)].weight;
            let derivative = |corner: usize| match corner == opposite {
                true => share * (weight[(corner + 1) % 3] + weight[(corner + 2) % 3]),
                false => -share * weight[3 - corner - opposite],
            };
            self.add_corners(problem, c.face(h), derivative, column, collector);
        }
    }

    /// Adds derivatives of the three angles of a face to the equations that they occur in.
    fn add_corners(
        &self,
        problem: &Problem,
        f: FaceId,
        derivative: impl Fn(usize) -> f64,
        column: usize,
        collector: &mut Collector,
    ) {
        let c = &self.connectivity;
        for (corner, v) in c.face_vertices(f).into_iter().enumerate() {
            if let Some(row) = problem.equation[v] {
                collector.add(column, row, derivative(corner));
            }
        }
        for turn in self.loops.turns_in(c, f) {
            let row = (problem.local_equations() + turn.of) as u32;
            collector.add(column, row, turn.sign * derivative(c.corner(turn.corner)));
        }
    }
}

/// What moves with something else, by that.
fn images<I: Id>(shares: &IdVec<I, I>) -> IdVec<I, Option<I>> {
    let mut images = IdVec::filled(None, shares.len());
    for (id, &with) in shares.enumerate() {
        if id != with {
            images[with] = Some(id);
        }
    }
    images
}

impl FlippedRows {
    fn new(state: &State, edges: usize) -> Result<Self, SeamlessError> {
        let most = most_products(edges);
        let mut products = 0;
        let mut rows = Self {
            number: EdgeVec::filled(NONE, edges),
            edge: Vec::new(),
            row: Vec::new(),
        };
        let mut collector = Collector::new(edges);
        let by_ptolemy = |flip: &PtolemyFlip| {
            let rest = 1.0 - flip.share;
            let by = [-1.0, rest, flip.share, rest, flip.share];
            (flip.edge, flip.outer, by)
        };
        let flips = state.flips.iter().map(by_ptolemy);
        let others = state.straightened.iter().map(|f| (f.edge, f.outer, f.by));
        for (i, (edge, outer, by)) in flips.chain(others).enumerate() {
            let [ca, ad, db, bc] = outer;
            for (e, share) in [edge, ca, ad, db, bc].into_iter().zip(by) {
                match rows.number[e] {
                    NONE => collector.add(i, e.raw(), share),
                    n => {
                        products += rows.row[n as usize].len();
                        for &(on, value) in &rows.row[n as usize] {
                            collector.add(i, on, share * value);
                        }
                    }
                }
            }
            let row = collector
                .rows
                .drain(..)
                .map(|r| (r, collector.sum[r as usize]));
            let row: Vec<(u32, f64)> = row.collect();
            match rows.number[edge] {
                NONE => {
                    rows.number[edge] = rows.row.len() as u32;
                    rows.edge.push(edge);
                    rows.row.push(row);
                }
                n => rows.row[n as usize] = row,
            }
            if products > most {
                return Err(SeamlessError::TooDense { products, most });
            }
        }
        Ok(rows)
    }

    /// Which flipped edges depend on an edge, and how: entries `first[e]..first[e + 1]` for the edge e.
    fn by_edge(&self, edges: usize) -> (Vec<u32>, Vec<(EdgeId, f64)>) {
        let mut first = vec![0u32; edges + 1];
        for &(on, _) in self.row.iter().flatten() {
            first[on as usize + 1] += 1;
        }
        for e in 0..edges {
            first[e + 1] += first[e];
        }
        let mut next = first.clone();
        let mut entries = vec![(EdgeId::new(0), 0.0); first[edges] as usize];
        for (row, &edge) in self.row.iter().zip(&self.edge) {
            for &(on, value) in row {
                let place = &mut next[on as usize];
                entries[*place as usize] = (edge, value);
                *place += 1;
            }
        }
        (first, entries)
    }
}
