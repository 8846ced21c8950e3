//! The triangulation of a flat surface whose vertices are its cones and corners alone.
//!
//! *Enters:* an atlas whose transitions are quarter turns, as a [`Complex`]. *Leaves:* a complex of the same surface that has a vertex at every cone, corner, end and junction of lines,
//! and hardly any other: about as many faces as there are cones, whatever the mesh. *Guaranteed:* lines (borders and features) are unions of sides; a piece without cones or corners
//! keeps one vertex, and a closed line without corners too; every side but lines is Delaunay. *Not guaranteed:* that every flat vertex goes: one that stays joined with itself stays, which harms nothing.
//!
//! A flat vertex is freed of edges by flips until three are left, and then its faces are one (the theorem behind it: flat surfaces with cones have Delaunay tessellations with exactly these
//! vertices; Bobenko, Springborn 2007). On a line it is freed on both sides until its faces are two on each.

use super::complex::{Complex, Side, turned};
use super::error::GridError;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use std::f64::consts::{FRAC_PI_2, PI};

/// Rounds over the vertices that could not be taken out, as long as any can.
const MOST_ROUNDS: usize = 8;
/// Flips after a vertex is gone, to make its neighbourhood Delaunay again.
const MOST_LOCAL_FLIPS: usize = 200;
/// Flips in all that make the whole Delaunay, an edge: rounding may make both diagonals look wrong.
const MOST_FLIPS_OF_EDGE: usize = 64;
/// By how much two sides may be off a straight line that are made one, radians.
const STRAIGHT: f64 = 1e-9;
/// By how much an angle around a vertex may miss a multiple of a quarter turn, quarter turns: what rounding does to the angles of thin faces.
const NEARLY: f64 = 0.05;
/// By how much sides may miss each other after a quarter turn, and sides of lines the axes: part of their length, or part of the surface's size.
const ROUNDING: [f64; 2] = [1e-6, 1e-9];

/// A surface on the plane: `uv` corners of faces, in one unit, such that sides that are glued differ by quarter turns and translations. `is_line`: edges that stay.
pub fn complex(
    c: &Connectivity,
    uv: &FaceVec<[[f64; 2]; 3]>,
    is_line: &EdgeVec<bool>,
) -> Result<Complex, GridError> {
    let vector = |h: HalfedgeId| {
        let (uv, k) = (&uv[c.face(h)], c.corner(h));
        let (p, q) = (uv[k], uv[(k + 1) % 3]);
        [q[0] - p[0], q[1] - p[1]]
    };
    let mut sides = Vec::with_capacity(c.halfedge_count());
    for h in c.halfedges() {
        let (own, twin) = (vector(h), c.twin(h));
        let turns = twin.map_or(0, |t| {
            let beyond = vector(t);
            // From −own to the vector of the twin.
            let turn = (own[1] * beyond[0] - own[0] * beyond[1])
                .atan2(-own[0] * beyond[0] - own[1] * beyond[1]);
            (turn / FRAC_PI_2).round() as i64
        });
        sides.push(Side {
            tail: c.tail(h),
            vector: own,
            bearing: 0.0,
            steps: [0; 2],
            twin,
            turns: turns.rem_euclid(4) as u8,
            is_line: is_line[c.edge(h)] || twin.is_none(),
        });
    }
    let mut sides: HalfedgeVec<Side> = sides.into();
    let length = |[x, y]: [f64; 2]| x.hypot(y);
    let longest = sides.iter().map(|s| length(s.vector)).fold(0.0, f64::max);
    for (h, side) in sides.enumerate() {
        let [of_length, of_size] = ROUNDING;
        let allowed = (of_length * length(side.vector)).max(of_size * longest);
        let off = match side.is_line {
            true => side.vector[0].abs().min(side.vector[1].abs()),
            false => 0.0,
        };
        let (gap, turns) = match side.twin {
            Some(t) => {
                let [x, y] = turned(side.vector, side.turns);
                let back = sides[t].vector;
                (
                    length([x + back[0], y + back[1]]),
                    side.turns + sides[t].turns,
                )
            }
            None => (0.0, 0),
        };
        let gap = gap.max(off);
        let is_quarter = gap <= allowed && turns.is_multiple_of(4);
        if !is_quarter {
            return Err(GridError::NoQuarterTurn {
                edge: c.edge(h),
                gap,
            });
        }
    }
    for v in c.vertices() {
        let mut bearing = 0.0;
        for h in c.outgoing(v) {
            sides[h].bearing = bearing;
            let (a, [x, y]) = (sides[h].vector, sides[c.prev(h)].vector);
            bearing += (x * a[1] - y * a[0]).atan2(-a[0] * x - a[1] * y);
        }
    }
    Ok(Complex::new(sides, c.vertex_count()))
}

/// Which vertices stay: all around which something is not flat or a line not straight. The angle around a vertex, or from line to line, in quarter turns must be whole.
fn marked(complex: &Complex, vertices: usize) -> Result<VertexVec<bool>, GridError> {
    let mut is_marked = VertexVec::filled(false, vertices);
    // Four times χ, in quarter turns.
    let mut curvature = 0;
    for v in complex.vertices() {
        let star = complex.star(v);
        let is_border = complex.side(star[0]).twin.is_none();
        let has_line = star.iter().any(|&h| complex.side(h).is_line);
        let sectors = complex.sectors(&star, |h| complex.angle(h));
        let mut is_straight = true;
        curvature += if is_border { 2 } else { 4 };
        for angle in &sectors {
            let quarters = angle / FRAC_PI_2;
            if !((quarters - quarters.round()).abs() < NEARLY && quarters.round() >= 1.0) {
                return Err(GridError::NoQuarterAngle {
                    vertex: v,
                    quarters,
                });
            }
            let flat = if has_line { 2.0 } else { 4.0 };
            is_straight &= quarters.round() == flat;
            curvature -= quarters.round() as i64;
        }
        let wanted = if has_line && !is_border { 2 } else { 1 };
        is_marked[v] = !(is_straight && sectors.len() == wanted);
    }
    keep_one(complex, &mut is_marked);
    let edges = complex.sides().map(|h| match complex.side(h).twin {
        Some(_) => 1,
        None => 2,
    });
    let counts = [complex.vertices().count(), complex.faces().count()].map(|n| n as i64);
    let euler = counts[0] - edges.sum::<i64>() / 2 + counts[1];
    match curvature == 4 * euler {
        true => Ok(is_marked),
        false => Err(GridError::GaussBonnet { curvature, euler }),
    }
}

/// Marks a vertex of every closed line and of every piece that have none.
fn keep_one(complex: &Complex, is_marked: &mut VertexVec<bool>) {
    for along_lines in [true, false] {
        let mut joined = UnionFind::new(is_marked.len());
        let mut is_met = VertexVec::filled(!along_lines, is_marked.len());
        for h in complex
            .sides()
            .filter(|&h| !along_lines || complex.side(h).is_line)
        {
            let ends = [complex.side(h).tail, complex.head(h)];
            joined.join(ends[0].index(), ends[1].index());
            ends.iter().for_each(|&v| is_met[v] = true);
        }
        let mut has_one = VertexVec::filled(false, is_marked.len());
        let vertices: Vec<VertexId> = complex.vertices().filter(|&v| is_met[v]).collect();
        let mut root = |v: VertexId| VertexId::new(joined.find(v.index()));
        for &v in vertices.iter().filter(|&&v| is_marked[v]) {
            has_one[root(v)] = true;
        }
        for &v in &vertices {
            let root = root(v);
            if !has_one[root] {
                has_one[root] = true;
                is_marked[v] = true;
            }
        }
    }
}

/// What is left of a surface.
#[derive(Clone, Debug)]
pub struct ConeTriangulation {
    /// Triangles between cones.
    pub complex: Complex,
    /// Its vertices as vertices of the surface.
    pub vertex: VertexVec<VertexId>,
    /// How many of them are flat and could not be taken out.
    pub flat: usize,
}

/// Takes out what is flat; see the module docs. `vertices`: those of the surface.
pub fn reduce(mut complex: Complex, vertices: usize) -> Result<ConeTriangulation, GridError> {
    let complex = &mut complex;
    let is_marked = marked(complex, vertices)?;
    make_delaunay(complex);
    let mut left: Vec<VertexId> = complex.vertices().filter(|&v| !is_marked[v]).collect();
    for _ in 0..MOST_ROUNDS {
        let before = left.len();
        left.retain(|&v| !take_out(complex, v));
        make_delaunay(complex);
        if left.is_empty() || left.len() == before {
            break;
        }
    }
    let flat = left.len();
    let (complex, vertex) = complex.compact();
    Ok(ConeTriangulation {
        complex,
        vertex,
        flat,
    })
}

/// Frees a vertex of edges and takes it out; false where that cannot be done now.
fn take_out(complex: &mut Complex, v: VertexId) -> bool {
    loop {
        let star = complex.star(v);
        let is_border = complex.side(star[0]).twin.is_none();
        let lines = star.iter().filter(|&&h| complex.side(h).is_line).count();
        let has_loop = star
            .iter()
            .any(|&h| complex.head(h) == v || complex.side(complex.prev(h)).tail == v);
        let is_done = match (is_border, lines) {
            _ if has_loop => false,
            (true, _) => star.len() == 2,
            (false, 0) => star.len() == 3,
            (false, _) => straight(complex, &star).is_some(),
        };
        if is_done {
            let done = match (is_border, lines) {
                (true, _) => complex.merge_on_border(v),
                (false, 0) => complex.merge_inside(v),
                (false, _) => merge_straight(complex, v, &star),
            };
            if done {
                flip_around(complex, &star);
            }
            return done;
        }
        match best_flip(complex, v, &star, is_border, lines) {
            Some(h) => complex.flip(h),
            // Its neighbours may be on a line with it, so that no flip leaves it.
            None if has_loop || is_border || lines > 0 => return false,
            None => {
                let done = merge_straight(complex, v, &star);
                if done {
                    flip_around(complex, &star);
                }
                return done;
            }
        };
    }
}

/// Of four sides around a vertex, one that goes straight on with the side opposite; those of a line, where there is one.
fn straight(complex: &Complex, star: &[HalfedgeId]) -> Option<HalfedgeId> {
    let [a, b, c, d] = *star else { return None };
    let pairs = [[a, b, c, d], [b, c, d, a]];
    let has_line = star.iter().any(|&h| complex.side(h).is_line);
    let is_straight = |[a, b, c, _]: &[HalfedgeId; 4]| match has_line {
        true => complex.side(*a).is_line && complex.side(*c).is_line,
        false => (complex.angle(*a) + complex.angle(*b) - PI).abs() < STRAIGHT,
    };
    pairs.iter().find(|p| is_straight(p)).map(|p| p[0])
}

fn merge_straight(complex: &mut Complex, v: VertexId, star: &[HalfedgeId]) -> bool {
    straight(complex, star).is_some_and(|first| complex.merge_on_line(v, first))
}

/// Makes Delaunay what is left of the faces of a vertex that is gone.
fn flip_around(complex: &mut Complex, star: &[HalfedgeId]) {
    let sides = star
        .iter()
        .flat_map(|&h| (0..3).map(move |k| HalfedgeId::new(h.index() / 3 * 3 + k)));
    let left: Vec<HalfedgeId> = sides.filter(|&h| complex.is_left(h)).collect();
    flip_from(complex, left, MOST_LOCAL_FLIPS);
}

/// The edge of a vertex to be flipped: that with the smallest angle beyond, among those that leave it fewer edges, and enough on each side of a line.
fn best_flip(
    complex: &Complex,
    v: VertexId,
    star: &[HalfedgeId],
    is_border: bool,
    lines: usize,
) -> Option<HalfedgeId> {
    let inner = |h: HalfedgeId| !complex.side(h).is_line;
    // Inner edges between one line and the next: one must stay.
    let mut count = vec![0usize; star.len()];
    if is_border || lines > 0 {
        let begin = star.iter().position(|&h| !inner(h)).unwrap_or(0);
        let mut sector = Vec::new();
        let close = |sector: &mut Vec<usize>, count: &mut Vec<usize>| {
            let n = sector.len();
            sector.drain(..).for_each(|i| count[i] = n);
        };
        for i in (0..star.len()).map(|i| (begin + i) % star.len()) {
            match inner(star[i]) {
                true => sector.push(i),
                false => close(&mut sector, &mut count),
            }
        }
        close(&mut sector, &mut count);
    } else {
        count.fill(usize::MAX);
    }
    let mut best: Option<(f64, HalfedgeId)> = None;
    for (i, &h) in star.iter().enumerate() {
        if !inner(h) || count[i] < 2 || !complex.is_convex(h) {
            continue;
        }
        let Some(t) = complex.side(h).twin else {
            continue;
        };
        // Where the vertex is joined with itself, it may get an edge for that which it loses.
        let apexes = [complex.prev(h), complex.prev(t)].map(|h| complex.side(h).tail == v);
        let gains = apexes.iter().filter(|is_own| **is_own).count();
        if gains > usize::from(complex.head(h) == v) {
            continue;
        }
        let beyond = complex.angle(complex.next(h)) + complex.angle(t);
        if best.is_none_or(|(least, _)| beyond < least) {
            best = Some((beyond, h));
        }
    }
    best.map(|(_, h)| h)
}

fn make_delaunay(complex: &mut Complex) {
    let all: Vec<HalfedgeId> = complex.sides().collect();
    let most = MOST_FLIPS_OF_EDGE * all.len();
    flip_from(complex, all, most);
}

/// Flips sides that are not Delaunay, and those around them.
fn flip_from(complex: &mut Complex, mut stack: Vec<HalfedgeId>, most: usize) {
    let mut flips = 0;
    while let Some(h) = stack.pop() {
        if flips == most {
            break;
        }
        if complex.side(h).is_line || !complex.is_wrong(h) {
            continue;
        }
        let Some(t) = complex.side(h).twin else {
            continue;
        };
        complex.flip(h);
        flips += 1;
        stack.extend(
            [h, t]
                .into_iter()
                .flat_map(|h| [complex.next(h), complex.prev(h)]),
        );
    }
}
