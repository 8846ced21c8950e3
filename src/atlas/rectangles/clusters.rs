//! Faces in clusters: parts of the surface of about equal difficulty, as round as can be.
//!
//! *Enters:* a surface, and how many clusters are wanted. *Leaves:* the cluster of every face. *Guaranteed:* every cluster is a disk. *Not guaranteed:* the number: parts that are no
//! disks, or stand out from their border like fingers, are divided. Nor the least energy.
//!
//! The clusters minimize Σ w |x − c|² with c the mean of their cluster, by moving faces from one to the next while that is gained (S. Valette, J.-M. Chassery, *Approximated centroidal
//! Voronoi diagrams for uniform polygonal mesh coarsening*, 2004). x is the place of a face and its normal times the radius of a cluster, so that clusters do not lap around edges
//! and are longer where the surface does not bend (D. Cohen-Steiner, P. Alliez, M. Desbrun, *Variational shape approximation*, 2004, with the normal alone). With β the bend of a place, rectangles of area a have an error β a^{3/2} an area,
//! least in sum for a ∝ β^{−2/5}; clusters have areas like w^{−1/2} for weight w an area, so w = β^{4/5}.

use crate::atlas::patches::edge_bends;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId, PatchId};
use crate::geometry::mesh::{Mesh, cross, norm, sub, triangle_area};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Three of a place, three of a normal.
const COORDINATES: usize = 6;
/// Where nothing bends, clusters have at most about four times the mean area.
const FLOOR: f64 = 1.0 / 32.0;
/// Weight of an area follows this power of its bend.
const POWER: f64 = 0.8;
/// How often clusters are repaired and settle again.
const ROUNDS: usize = 8;
/// How often all edges are looked at, at most, until nothing moves.
const SWEEPS: usize = 400;
/// Moves that gain less than this part of the energy's scale are rounding.
const GAIN: f64 = 1e-12;
/// Clusters with more area for their squared perimeter stand out from their border: a flat hexagon has 0.07, a half sphere 0.16; perimeters that follow edges are longer by a sixth to a third.
const TALL: f64 = 0.13;

type Point = [f64; COORDINATES];

/// Clusters of a surface's faces.
struct Clusters<'a> {
    mesh: &'a Mesh,
    area: FaceVec<f64>,
    point: FaceVec<Point>,
    /// Of every face.
    weight: FaceVec<f64>,
    /// Clusters of every face.
    label: FaceVec<usize>,
    all: Vec<Cluster>,
}

/// Sums over the faces of a cluster.
#[derive(Clone, Copy, Debug, Default)]
struct Cluster {
    faces: usize,
    weight: f64,
    point: Point,
}

/// The cluster of every face, numbered from 0 without a gap.
pub(super) fn clusters(mesh: &Mesh, count: usize) -> FaceVec<PatchId> {
    let mut clusters = Clusters::new(mesh, count);
    let count = count.max(1);
    // How the surface bends is known for clusters only: one face says little.
    clusters.seed(count);
    clusters.settle();
    clusters.weigh();
    clusters.seed(count);
    for _ in 0..ROUNDS {
        clusters.settle();
        let mut is_repaired = clusters.keep_largest_parts();
        is_repaired |= clusters.divide_others();
        if !is_repaired {
            break;
        }
    }
    // Every division leaves fewer faces in a cluster, and a single face is a disk.
    clusters.keep_largest_parts();
    while clusters.divide_others() {
        clusters.keep_largest_parts();
    }
    let mut number = BTreeMap::new();
    let mut numbered = |label| {
        let next = number.len();
        PatchId::new(*number.entry(label).or_insert(next))
    };
    clusters
        .label
        .iter()
        .map(|&label| numbered(label))
        .collect()
}

impl Cluster {
    fn add(&mut self, sign: f64, weight: f64, point: Point) {
        self.weight += sign * weight;
        for (sum, x) in self.point.iter_mut().zip(point) {
            *sum += sign * weight * x;
        }
    }

    /// What its energy is less than that of its faces around the origin.
    fn saved(&self) -> f64 {
        match self.weight > 0.0 {
            true => self.point.iter().map(|x| x * x).sum::<f64>() / self.weight,
            false => 0.0,
        }
    }
}

impl<'a> Clusters<'a> {
    fn new(mesh: &'a Mesh, count: usize) -> Self {
        let c = &mesh.connectivity;
        let area: FaceVec<f64> = c
            .faces()
            .map(|f| triangle_area(mesh.face_positions(f)))
            .collect();
        let whole: f64 = area.iter().sum();
        let radius = (whole / count as f64 / std::f64::consts::PI).sqrt();
        let corner = mesh.positions.iter().next().copied().unwrap_or_default();
        let point = |f| {
            let p = mesh.face_positions(f).map(|p| sub(p, corner));
            let normal = cross(sub(p[1], p[0]), sub(p[2], p[0]));
            let length = norm(normal);
            let normal = normal.map(|x| {
                if length > 0.0 {
                    radius * x / length
                } else {
                    0.0
                }
            });
            std::array::from_fn(|i| match i {
                0..3 => (p[0][i] + p[1][i] + p[2][i]) / 3.0,
                _ => normal[i - 3],
            })
        };
        Self {
            mesh,
            point: c.faces().map(point).collect(),
            weight: area.clone(),
            area,
            label: FaceVec::filled(usize::MAX, c.face_count()),
            all: Vec::new(),
        }
    }

    fn c(&self) -> &'a Connectivity {
        &self.mesh.connectivity
    }

    /// The faces beside a face.
    fn beside(&self, f: FaceId) -> impl Iterator<Item = FaceId> + use<'a> {
        let c = self.c();
        let halfedges = c.face_halfedges(f).into_iter();
        halfedges.filter_map(|h| Some(c.face(c.twin(h)?)))
    }

    /// Weights from the bend of clusters, each with half of its neighbours'.
    fn weigh(&mut self) {
        let c = self.c();
        let (bends, _) = edge_bends(self.mesh, &self.area, |h| Some(c.face(c.twin(h)?)));
        let mut own = vec![[0.0; 2]; self.all.len()];
        let mut around = own.clone();
        for f in c.faces() {
            let bend: f64 = c.face_edges(f).map(|e| 0.5 * bends[e][0]).iter().sum();
            let sum = &mut own[self.label[f]];
            *sum = [sum[0] + bend, sum[1] + self.area[f]];
        }
        let mut pairs: Vec<[usize; 2]> = Vec::new();
        for f in c.faces() {
            let l = self.label[f];
            let others = self.beside(f).map(|g| self.label[g]).filter(|&m| m != l);
            pairs.extend(others.map(|m| [l, m]));
        }
        pairs.sort_unstable();
        pairs.dedup();
        for [l, m] in pairs {
            around[l] = [around[l][0] + own[m][0], around[l][1] + own[m][1]];
        }
        let whole = own.iter().fold([0.0; 2], |w, s| [w[0] + s[0], w[1] + s[1]]);
        let mean = whole[0] / whole[1];
        let density = |(own, around): (&[f64; 2], &[f64; 2])| {
            let bend = own[0] / own[1];
            let others = around[0] / around[1];
            let others = if others.is_finite() { others } else { bend };
            let density = (0.5 * (bend + others) / mean).max(FLOOR).powf(POWER);
            if density.is_finite() { density } else { 1.0 }
        };
        let density: Vec<f64> = own.iter().zip(&around).map(density).collect();
        for f in c.faces() {
            self.weight[f] = self.area[f] * density[self.label[f]];
        }
    }

    /// New clusters around faces that are far from each other; a few more where the surface has more parts than that.
    fn seed(&mut self, count: usize) {
        let c = self.c();
        let mut distance = FaceVec::filled(f64::INFINITY, c.face_count());
        let heaviest =
            |f: &FaceId, g: &FaceId| self.weight[*f].total_cmp(&self.weight[*g]).then(g.cmp(f));
        let mut start = c.faces().max_by(heaviest);
        let mut made = 0;
        while let Some(f) = start {
            self.grow(f, made, &mut distance, |_| true);
            made += 1;
            let farthest =
                |f: &FaceId, g: &FaceId| distance[*f].total_cmp(&distance[*g]).then(g.cmp(f));
            start = c.faces().max_by(farthest).filter(|&f| {
                let far = distance[f];
                far == f64::INFINITY || (far > 0.0 && made < count)
            });
        }
        self.count();
    }

    /// Gives the faces that are nearer to `start` than to what `distance` knows to a cluster.
    fn grow(
        &mut self,
        start: FaceId,
        label: usize,
        distance: &mut FaceVec<f64>,
        is_inside: impl Fn(FaceId) -> bool,
    ) {
        // Non-negative floats compare like their bits.
        let mut queue = BinaryHeap::from([Reverse((0u64, start))]);
        distance[start] = 0.0;
        self.label[start] = label;
        while let Some(Reverse((bits, f))) = queue.pop() {
            let here = f64::from_bits(bits);
            if here > distance[f] {
                continue;
            }
            for g in self.beside(f).filter(|&g| is_inside(g)) {
                let there = here + self.apart(f, g);
                if there < distance[g] {
                    distance[g] = there;
                    self.label[g] = label;
                    queue.push(Reverse((there.to_bits(), g)));
                }
            }
        }
    }

    /// Distance of two faces, longer where clusters are to be small.
    fn apart(&self, f: FaceId, g: FaceId) -> f64 {
        let (p, q) = (self.point[f], self.point[g]);
        let squared: f64 = p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum();
        let density = (self.weight[f] + self.weight[g]) / (self.area[f] + self.area[g]);
        let scale = density.powf(0.25);
        squared.sqrt() * if scale.is_finite() { scale } else { 1.0 }
    }

    /// Sums anew, without what rounding left.
    fn count(&mut self) {
        let count = self.label.iter().map(|&l| l + 1).max().unwrap_or(0);
        self.all = vec![Cluster::default(); count];
        for (f, &l) in self.label.enumerate() {
            self.all[l].add(1.0, self.weight[f], self.point[f]);
            self.all[l].faces += 1;
        }
    }

    /// Moves faces across the borders of clusters until no move lowers the energy.
    fn settle(&mut self) {
        let c = self.c();
        for _ in 0..SWEEPS {
            let mut moves = 0;
            for e in c.edges() {
                let h = c.edge_halfedge(e);
                let Some(t) = c.twin(h) else { continue };
                let (f, g) = (c.face(h), c.face(t));
                let (a, b) = (self.label[f], self.label[g]);
                if a == b {
                    continue;
                }
                let both = |p: &Cluster, q: &Cluster| p.saved() + q.saved();
                let mut most = both(&self.all[a], &self.all[b]) * (1.0 + GAIN);
                let mut best = None;
                for (f, from, to) in [(f, a, b), (g, b, a)] {
                    let (mut left, mut right) = (self.all[from], self.all[to]);
                    if left.faces < 2 {
                        continue;
                    }
                    left.add(-1.0, self.weight[f], self.point[f]);
                    right.add(1.0, self.weight[f], self.point[f]);
                    left.faces -= 1;
                    right.faces += 1;
                    let saved = both(&left, &right);
                    if saved > most {
                        most = saved;
                        best = Some((f, [(from, left), (to, right)]));
                    }
                }
                if let Some((f, [(from, left), (to, right)])) = best {
                    self.all[from] = left;
                    self.all[to] = right;
                    self.label[f] = to;
                    moves += 1;
                }
            }
            if moves == 0 {
                break;
            }
        }
        self.count();
    }

    /// The connected parts of all clusters.
    fn parts(&self) -> Vec<Vec<FaceId>> {
        let mut seen = FaceVec::filled(false, self.c().face_count());
        let mut parts = Vec::new();
        for f in self.c().faces() {
            if std::mem::replace(&mut seen[f], true) {
                continue;
            }
            let mut part = vec![f];
            let mut next = 0;
            while let Some(&g) = part.get(next) {
                next += 1;
                let same = self.beside(g).filter(|&x| self.label[x] == self.label[f]);
                for x in same {
                    if !std::mem::replace(&mut seen[x], true) {
                        part.push(x);
                    }
                }
            }
            parts.push(part);
        }
        parts
    }

    /// Gives all but the heaviest part of every cluster to the clusters that they border on most; whether there was one.
    fn keep_largest_parts(&mut self) -> bool {
        let mut is_changed = false;
        loop {
            let parts = self.parts();
            let mut heaviest: Vec<Option<(f64, usize)>> = vec![None; self.all.len()];
            for (i, part) in parts.iter().enumerate() {
                let weight: f64 = part.iter().map(|&f| self.weight[f]).sum();
                let most = &mut heaviest[self.label[part[0]]];
                if most.is_none_or(|(most, _)| weight > most) {
                    *most = Some((weight, i));
                }
            }
            let mut moved = false;
            for (i, part) in parts.iter().enumerate() {
                let own = self.label[part[0]];
                if heaviest[own].is_some_and(|(_, j)| j == i) {
                    continue;
                }
                let mut shared: BTreeMap<usize, f64> = BTreeMap::new();
                for h in part.iter().flat_map(|&f| self.c().face_halfedges(f)) {
                    let across = self.c().twin(h).map(|t| self.label[self.c().face(t)]);
                    if let Some(other) = across.filter(|&other| other != own) {
                        *shared.entry(other).or_default() +=
                            self.mesh.edge_length(self.c().edge(h));
                    }
                }
                let most = shared.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
                if let Some((other, _)) = most {
                    part.iter().for_each(|&f| self.label[f] = other);
                    moved = true;
                }
            }
            if !moved {
                break;
            }
            is_changed = true;
        }
        self.count();
        is_changed
    }

    /// Divides clusters that are no disks, or stand out; whether there was one.
    fn divide_others(&mut self) -> bool {
        let mut is_changed = false;
        let mut distance = FaceVec::filled(f64::INFINITY, self.c().face_count());
        for part in self.parts() {
            let own = self.label[part[0]];
            if part.len() < 2 || self.is_fit(&part) {
                continue;
            }
            is_changed = true;
            let inside: BTreeSet<FaceId> = part.iter().copied().collect();
            let mut from = part[0];
            // Twice the farthest: two ends.
            for _ in 0..2 {
                part.iter().for_each(|&f| distance[f] = f64::INFINITY);
                self.grow(from, own, &mut distance, |f| inside.contains(&f));
                let farthest = |f: &&FaceId, g: &&FaceId| {
                    distance[**f].total_cmp(&distance[**g]).then(g.cmp(f))
                };
                from = part.iter().max_by(farthest).copied().unwrap_or(from);
            }
            let new = self.all.len();
            self.all.push(Cluster::default());
            self.grow(from, new, &mut distance, |f| inside.contains(&f));
        }
        self.count();
        is_changed
    }

    /// Whether a part is a disk that does not stand out.
    fn is_fit(&self, part: &[FaceId]) -> bool {
        let c = self.c();
        let own = |h: HalfedgeId| self.label[c.face(h)] == self.label[part[0]];
        let (mut vertices, mut inner, mut perimeter, mut area) = (0usize, 0usize, 0.0, 0.0);
        for &f in part {
            area += self.area[f];
            for h in c.face_halfedges(f) {
                let is_inner = c.twin(h).is_some_and(own);
                if is_inner {
                    inner += 1;
                } else {
                    perimeter += self.mesh.edge_length(c.edge(h));
                }
                // Each fan of faces around a vertex is counted once: at its clockwise end, or where it is closed, at the least of its halfedges.
                let v = c.tail(h);
                let is_closed = !c.is_boundary_vertex(v) && c.outgoing(v).all(own);
                let is_first = match is_closed {
                    true => c.outgoing(v).all(|g| h <= g),
                    false => !is_inner,
                };
                vertices += usize::from(is_first);
            }
        }
        // χ = V − E + F with E = 3 F − inner / 2.
        let is_disk = 2 * vertices + inner == 4 * part.len() + 2;
        is_disk && area <= TALL * perimeter * perimeter
    }
}
