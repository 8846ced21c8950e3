//! Cone triangulations and steps of surfaces whose grids are known.

use super::blocks::{Blocks, Piece};
use super::complex::{Complex, turned};
use super::cone_triangulation::{ConeTriangulation, complex, reduce};
use super::error::GridError;
use super::lattice::Lattice;
use super::quads::QuadMesh;
use super::quantise::quantise;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, NONE, VertexVec};
use crate::geometry::mesh::Mesh;
use std::collections::HashMap;

/// A surface made of squares of side 1, each cut into n × n and these into triangles, with inner vertices moved about; every face in a frame of its own.
pub(super) struct Squares {
    connectivity: Connectivity,
    pub(super) uv: FaceVec<[[f64; 2]; 3]>,
    is_line: EdgeVec<bool>,
    /// Of vertices, in space.
    place: Vec<[f64; 3]>,
}

fn sequence(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl Squares {
    /// `squares`: corners in space, counterclockwise, and where sides are alike they are glued. `line`: whether the edge between two points in space is a line.
    fn new(
        squares: &[[[f64; 3]; 4]],
        n: usize,
        identify: impl Fn([i64; 3]) -> [i64; 3],
        line: impl Fn([f64; 3], [f64; 3]) -> bool,
    ) -> Self {
        let mut random = sequence(3);
        let mut number: HashMap<[i64; 3], u32> = HashMap::new();
        let (mut faces, mut uv, mut place) = (Vec::new(), Vec::new(), Vec::new());
        for corners in squares {
            let at = |s: f64, t: f64| -> [f64; 3] {
                std::array::from_fn(|i| {
                    let [a, b, c, d] = corners.map(|p| p[i]);
                    (1.0 - s) * (1.0 - t) * a + s * (1.0 - t) * b + s * t * c + (1.0 - s) * t * d
                })
            };
            let mut points = HashMap::new();
            for i in 0..=n {
                for j in 0..=n {
                    let inside = 0 < i && i < n && 0 < j && j < n;
                    let mut moved = |x: usize| {
                        let off = if inside { 0.3 * (random() - 0.5) } else { 0.0 };
                        (x as f64 + off) / n as f64
                    };
                    let flat = [moved(i), moved(j)];
                    let key = at(i as f64 / n as f64, j as f64 / n as f64);
                    let key = identify(key.map(|x| (x * n as f64).round() as i64));
                    let count = number.len() as u32;
                    let v = *number.entry(key).or_insert(count);
                    points.insert((i, j), (v, flat, at(flat[0], flat[1])));
                }
            }
            for i in 0..n {
                for j in 0..n {
                    let q = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|p| points[&p]);
                    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                        let turns = (4.0 * random()) as u8;
                        faces.push([q[a].0, q[b].0, q[c].0]);
                        uv.push([a, b, c].map(|k| super::complex::turned(q[k].1, turns)));
                        place.push([a, b, c].map(|k| q[k].2));
                    }
                }
            }
        }
        let connectivity = Connectivity::from_faces(&faces, number.len()).unwrap();
        let is_line = connectivity.edges().map(|e| {
            let h = connectivity.edge_halfedge(e);
            let (p, k) = (place[connectivity.face(h).index()], connectivity.corner(h));
            line(p[k], p[(k + 1) % 3])
        });
        let is_line = is_line.collect();
        let mut of_vertex = vec![[0.0; 3]; number.len()];
        for (f, corners) in faces.iter().zip(&place) {
            (0..3).for_each(|k| of_vertex[f[k] as usize] = corners[k]);
        }
        Self {
            place: of_vertex,
            is_line,
            uv: uv.into(),
            connectivity,
        }
    }

    fn complex(&self) -> Complex {
        complex(&self.connectivity, &self.uv, &self.is_line).unwrap()
    }

    fn reduced(&self) -> ConeTriangulation {
        reduce(self.complex(), self.connectivity.vertex_count()).unwrap()
    }
}

pub(super) fn no_lines(_: [f64; 3], _: [f64; 3]) -> bool {
    false
}

/// A box of unit squares, `size` along each axis.
fn cuboid(size: [usize; 3], n: usize, line: impl Fn([f64; 3], [f64; 3]) -> bool) -> Squares {
    let mut squares = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 0..size[u] {
            for j in 0..size[v] {
                for (level, is_top) in [(0, false), (size[axis], true)] {
                    let corner = |a: usize, b: usize| {
                        let mut p = [0.0; 3];
                        (p[axis], p[u], p[v]) = (level as f64, (i + a) as f64, (j + b) as f64);
                        p
                    };
                    let [p, q, r, s] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    squares.push(if is_top { [p, q, r, s] } else { [p, s, r, q] });
                }
            }
        }
    }
    Squares::new(&squares, n, |p| p, line)
}

/// Unit squares of the plane at some places.
pub(super) fn plate(
    cells: &[[usize; 2]],
    n: usize,
    line: impl Fn([f64; 3], [f64; 3]) -> bool,
) -> Squares {
    let square = |&[i, j]: &[usize; 2]| {
        let at = |a: usize, b: usize| [(i + a) as f64, (j + b) as f64, 0.0];
        [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]
    };
    let squares: Vec<_> = cells.iter().map(square).collect();
    Squares::new(&squares, n, |p| p, line)
}

fn area(complex: &Complex) -> f64 {
    complex.faces().map(|f| 0.5 * complex.double_area(f)).sum()
}

/// Faces are closed and counterclockwise, twins are each other's negative, areas are kept, and sides but lines are Delaunay.
fn assert_sound(x: &Complex, wanted: f64) {
    for f in x.faces() {
        assert!(x.double_area(f) > 0.0, "{f}");
        let h = crate::geometry::ids::HalfedgeId::new(3 * f.index());
        let sum = (0..2).map(|i| {
            [h, x.next(h), x.prev(h)]
                .map(|h| x.side(h).vector[i])
                .iter()
                .sum::<f64>()
                .abs()
        });
        assert!(sum.fold(0.0, f64::max) < 1e-12);
    }
    for h in x.sides() {
        let side = x.side(h);
        if let Some(t) = side.twin {
            assert_eq!(x.side(t).twin, Some(h));
            let there = super::complex::turned(side.vector, side.turns);
            let other = x.side(t).vector;
            assert!((there[0] + other[0]).hypot(there[1] + other[1]) < 1e-12);
            assert!(side.is_line || !x.is_wrong(h));
        }
    }
    assert!((area(x) - wanted).abs() < 1e-11 * wanted);
}

#[test]
fn a_box_has_its_corners() {
    let x = cuboid([2, 3, 1], 4, no_lines).reduced();
    assert_eq!(
        (x.vertex.len(), x.complex.faces().count(), x.flat),
        (8, 12, 0)
    );
    assert_sound(&x.complex, 22.0);
}

#[test]
fn lines_stay_and_their_ends_too() {
    // A line on the top, one square long, and a closed one around the box.
    let on_top = |p: [f64; 3]| p[2] == 2.0 && p[0] == 1.0 && (1.0..=2.0).contains(&p[1]);
    let around = |p: [f64; 3]| p[2] == 1.0;
    let line = |p, q| (on_top(p) && on_top(q)) || (around(p) && around(q));
    let x = cuboid([2, 3, 2], 4, line).reduced();
    // Eight corners, two ends, and the four points where the closed line crosses nothing are one.
    assert_eq!((x.vertex.len(), x.flat), (11, 0));
    assert_sound(&x.complex, 32.0);
    let lines = x.complex.sides().filter(|&h| x.complex.side(h).is_line);
    let length: f64 = lines
        .map(|h| x.complex.side(h).vector[0].hypot(x.complex.side(h).vector[1]))
        .sum();
    assert!((length - 2.0 * (1.0 + 10.0)).abs() < 1e-11, "{length}");
}

#[test]
fn a_plate_has_its_corners() {
    let cells = [[0, 0], [1, 0], [2, 0], [0, 1], [0, 2]];
    let x = plate(&cells, 5, no_lines).reduced();
    assert_eq!(
        (x.vertex.len(), x.complex.faces().count(), x.flat),
        (6, 4, 0)
    );
    assert_sound(&x.complex, 5.0);
}

/// Three by two squares whose opposite sides are glued.
fn torus(n: i64) -> Squares {
    let square = |i: usize, j: usize| {
        let at = |a: usize, b: usize| [(i + a) as f64, (j + b) as f64, 0.0];
        [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]
    };
    let squares: Vec<_> = (0..6).map(|k| square(k % 3, k / 3)).collect();
    let identify = |[x, y, z]: [i64; 3]| [x.rem_euclid(3 * n), y.rem_euclid(2 * n), z];
    Squares::new(&squares, n as usize, identify, no_lines)
}

#[test]
fn a_flat_torus_keeps_one_vertex() {
    let x = torus(4).reduced();
    assert_eq!((x.vertex.len(), x.complex.faces().count()), (1, 2));
    assert_sound(&x.complex, 6.0);
    let lattice = quantise(&x.complex, 1, 24.0).unwrap();
    assert_eq!(lattice.cells(), 24);
    assert_quads(
        &lattice,
        &Lattice::new(x.complex.clone(), 1.0).angles(1, false),
    );
    assert!(lattice.energy_on(lattice.complex.sides()) < 1e-12);
}

/// Nothing is missing, faces close, and angles are those of the surface.
fn assert_grid(lattice: &Lattice, x: &ConeTriangulation) {
    for f in lattice.complex.faces() {
        assert!(
            lattice.missing(f) == 0 && lattice.surplus(f) == [0, 0],
            "{f}"
        );
        assert!(lattice.complex.double_area(f) > 0.0, "{f}");
    }
    for h in lattice.complex.sides() {
        let side = lattice.complex.side(h);
        if let Some(t) = side.twin {
            let [a, b] = super::complex::turned(side.steps, side.turns);
            assert_eq!([-a, -b], lattice.complex.side(t).steps);
        }
        if let Some(d) = lattice.direction(h) {
            let [along, across] = super::complex::turned(side.steps, 4 - d);
            assert!(along >= 1 && across == 0);
        }
    }
    let wanted: VertexVec<Vec<i64>> =
        Lattice::new(x.complex.clone(), 1.0).angles(x.vertex.len(), false);
    assert_eq!(lattice.angles(x.vertex.len(), true), wanted);
    assert_quads(lattice, &wanted);
}

/// As many squares as area, each edge in two of them or on the border, as many edges around a vertex as quarter turns.
fn assert_quads(lattice: &Lattice, angles: &VertexVec<Vec<i64>>) {
    let mesh = lattice.quads().unwrap();
    assert_eq!(mesh.quads.len() as i64, lattice.cells());
    let mut uses: HashMap<[u32; 2], usize> = HashMap::new();
    for q in &mesh.quads {
        for k in 0..4 {
            *uses.entry([q[k], q[(k + 1) % 4]]).or_default() += 1;
        }
    }
    let (mut edges, mut border) = (0, 0);
    for ([a, b], n) in &uses {
        let back = uses.get(&[*b, *a]).copied().unwrap_or(0);
        edges += n;
        border += n.saturating_sub(back);
    }
    let edges = (edges + border) / 2;
    let degrees: usize = mesh.points.iter().map(|p| p.valence).sum();
    assert_eq!(degrees, 2 * edges);
    for (point, is_border) in mesh.points.iter().zip(border_points(&mesh)) {
        let flat = if is_border { 2 } else { 4 };
        let quarters = point.vertex.map_or(flat, |v| angles[v].iter().sum());
        let wanted = quarters as usize + usize::from(is_border);
        assert_eq!(point.valence, wanted, "{point:?}");
    }
    let complex = &lattice.complex;
    let (v, h) = (complex.vertices().count(), complex.sides().count());
    let inner = complex
        .sides()
        .filter(|&h| complex.side(h).twin.is_some())
        .count();
    let euler = v as i64 - (inner / 2 + h - inner) as i64 + complex.faces().count() as i64;
    let found = mesh.points.len() as i64 - edges as i64 + mesh.quads.len() as i64;
    assert_eq!(found, euler);
    assert_blocks(&mesh, euler);
}

fn border_points(mesh: &QuadMesh) -> Vec<bool> {
    let mut is_border = vec![false; mesh.points.len()];
    for (corners, across) in mesh.quads.iter().zip(&mesh.across) {
        for k in (0..4).filter(|&k| across[k].is_none()) {
            is_border[corners[k] as usize] = true;
            is_border[corners[(k + 1) % 4] as usize] = true;
        }
    }
    is_border
}

/// Every square in one block, sides that agree from both sides, and no more blocks than lines can make.
fn assert_blocks(mesh: &QuadMesh, euler: i64) {
    let Blocks { blocks, sides } = mesh.blocks().unwrap();
    let mut count = vec![0; mesh.quads.len()];
    for block in &blocks {
        assert_eq!(block.squares.len(), block.cells[0] * block.cells[1]);
        block.squares.iter().for_each(|s| count[s.0 as usize] += 1);
    }
    assert!(count.iter().all(|&n| n == 1));
    for (b, of_block) in sides.iter().enumerate() {
        for (s, pieces) in of_block.iter().enumerate() {
            let length: usize = pieces.iter().map(|p| p.length).sum();
            assert_eq!(length, blocks[b].cells[s % 2]);
            for piece in pieces {
                let Some((c, t, start)) = piece.across else {
                    continue;
                };
                let mirrored = Piece {
                    start,
                    length: piece.length,
                    across: Some((b, s, piece.start)),
                };
                // Blocks that would lie beside themselves if they were one stay two.
                let meets = |s: usize| {
                    sides[b][s]
                        .iter()
                        .any(|p| p.across.is_some_and(|a| a.0 == c))
                };
                let is_whole = c != b && pieces.len() == 1 && sides[c][t].len() == 1;
                let are_apart = (0..4).filter(|&s| meets(s)).count() == 1;
                assert!(!(is_whole && are_apart), "blocks {b} and {c} could be one");
                assert!(
                    sides[c][t].contains(&mirrored),
                    "{piece:?} {:?}",
                    sides[c][t]
                );
            }
        }
    }
    let is_border = border_points(mesh);
    let lines = mesh
        .points
        .iter()
        .zip(&is_border)
        .map(|(p, border)| match border {
            true => (p.valence as i64 - 3).max(0),
            false if p.valence == 4 => 0,
            false => p.valence as i64 - 1,
        });
    let most = lines.sum::<i64>() + euler;
    assert!(
        // One that would lie beside itself is two, or four.
        blocks.len() as i64 <= most.max(4),
        "{} of {most}",
        blocks.len()
    );
}

/// An annulus has no corner and no irregular point: one line cuts it open.
#[test]
fn an_annulus_is_two_blocks() {
    let square = |i: usize| {
        let at = |a: usize, b: usize| [(i + a) as f64, b as f64, 0.0];
        [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]
    };
    let squares: Vec<_> = (0..4).map(square).collect();
    let identify = |[x, y, z]: [i64; 3]| [x.rem_euclid(12), y, z];
    let x = Squares::new(&squares, 3, identify, no_lines).reduced();
    assert_eq!(
        (x.vertex.len(), x.complex.faces().count(), x.flat),
        (2, 2, 0)
    );
    let lattice = quantise(&x.complex, 2, 36.0).unwrap();
    assert_grid(&lattice, &x);
    let blocks = lattice.quads().unwrap().blocks().unwrap().blocks;
    assert!(blocks.len() == 2 && lattice.cells() == 36);
}

#[test]
fn whole_sizes_are_met_exactly() {
    let x = cuboid([2, 3, 1], 4, no_lines).reduced();
    for k in [1, 2, 5] {
        let cells = 22.0 * f64::from(k * k);
        let lattice = quantise(&x.complex, x.vertex.len(), cells).unwrap();
        assert_grid(&lattice, &x);
        assert_eq!(lattice.cells() as f64, cells);
        assert!(lattice.energy_on(lattice.complex.sides()) < 1e-9);
    }
}

/// Odd proportions, lines and corners: something is to be rounded, and some faces are to be mended.
#[test]
fn other_sizes_are_met_nearly() {
    let line = |p: [f64; 3], q: [f64; 3]| p[2] == 1.0 && q[2] == 1.0;
    let cells = [[0, 0], [1, 0], [2, 0], [0, 1], [0, 2]];
    let shapes = [
        cuboid([2, 3, 2], 3, no_lines).reduced(),
        cuboid([2, 3, 2], 3, line).reduced(),
        cuboid([1, 7, 1], 3, no_lines).reduced(),
        plate(&cells, 3, no_lines).reduced(),
    ];
    for x in &shapes {
        for cells in [30.0, 77.0, 300.0, 1234.0] {
            let lattice = quantise(&x.complex, x.vertex.len(), cells).unwrap();
            assert_grid(&lattice, x);
            let ratio = lattice.cells() as f64 / cells;
            assert!(
                (0.7..1.4).contains(&ratio),
                "{} for {cells}",
                lattice.cells()
            );
        }
    }
}

/// Every face of a box has at least one cell.
#[test]
fn too_few_cells_give_nearly_the_coarsest() {
    let x = cuboid([1, 1, 1], 3, no_lines).reduced();
    let lattice = quantise(&x.complex, x.vertex.len(), 1.0).unwrap();
    assert_grid(&lattice, &x);
    assert!((6..=10).contains(&lattice.cells()), "{}", lattice.cells());
}

#[test]
fn what_is_no_quarter_turn_is_refused() {
    let mut squares = cuboid([1, 1, 1], 2, no_lines);
    let f = FaceId::new(3);
    squares.uv[f] = squares.uv[f].map(|[x, y]| [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y]);
    let (c, uv) = (&squares.connectivity, &squares.uv);
    let refused = complex(c, uv, &squares.is_line).unwrap_err().to_string();
    assert!(refused.contains("quarter turn"), "{refused}");
    // A little off, and a border of a hundred sides, most of them along no axis.
    let mut squares = cuboid([1, 1, 1], 2, no_lines);
    let (sine, cosine) = 0.01f64.sin_cos();
    squares.uv[f] = squares.uv[f].map(|[x, y]| [cosine * x - sine * y, sine * x + cosine * y]);
    assert!(complex(&squares.connectivity, &squares.uv, &squares.is_line).is_err());
    let rim = |i: u32| {
        let (y, x) = (std::f64::consts::TAU * f64::from(i) / 100.0).sin_cos();
        [x, y]
    };
    let faces: Vec<[u32; 3]> = (0..100).map(|i| [100, i, (i + 1) % 100]).collect();
    let uv = faces.iter().map(|f| [[0.0; 2], rim(f[1]), rim(f[2])]);
    let c = Connectivity::from_faces(&faces, 101).unwrap();
    let is_line = EdgeVec::filled(false, c.edge_count());
    assert!(complex(&c, &uv.collect(), &is_line).is_err());
}

#[test]
fn numbers_that_are_none_are_refused() {
    let x = cuboid([1, 1, 1], 2, no_lines).reduced();
    for cells in [0.0, -3.0, f64::NAN, f64::INFINITY, 1e12] {
        let refused = quantise(&x.complex, x.vertex.len(), cells).unwrap_err();
        assert!(matches!(refused, GridError::Cells { .. }), "{refused}");
    }
    let refused = Lattice::new(x.complex, 1.0).quads().unwrap_err();
    assert!(matches!(refused, GridError::NoArea { .. }), "{refused}");
}

/// A surface of squares in space.
pub(super) fn mesh(squares: &Squares) -> Mesh {
    let (vertices, faces) = (
        squares.connectivity.vertex_count(),
        squares.connectivity.face_count(),
    );
    Mesh {
        connectivity: squares.connectivity.clone(),
        positions: squares.place.clone().into(),
        source_vertex: (0..vertices as u32).collect(),
        source_face: (0..faces as u32).collect(),
        face_material: FaceVec::filled(NONE, faces),
        attributes: Vec::new(),
    }
}

/// The whole way from a flat surface to blocks on it. What must hold exactly: transitions, areas, blocks.
fn assert_gridded(squares: &Squares, cells: usize) -> super::Grid {
    let params = super::GridParams {
        cells,
        samples_per_cell: 3,
        ..super::GridParams::default()
    };
    let mesh = mesh(squares);
    let (map, grid, located) =
        super::made(&mesh, &squares.uv, &squares.is_line, &params, 2, &()).unwrap();
    let c = &map.sheet.fine.connectivity;
    c.validate().unwrap();
    // Points found square by square are those found block by block.
    let squares_of = super::squares::Squares::new(&map, &grid.quads).unwrap();
    let mut found = vec![false; grid.points.len()];
    for f in c.faces() {
        for (h, v) in c.face_halfedges(f).into_iter().zip(c.face_vertices(f)) {
            let place = map.sheet.at(h);
            if place.map(f64::round) != place {
                continue;
            }
            let at = place.map(|x| x as i64);
            let seen = squares_of.at(f, place);
            let corner = seen.corner_at(at).unwrap();
            let point = grid.quads.quads[seen.square as usize][usize::from(corner)] as usize;
            found[point] = true;
            let apart =
                crate::geometry::mesh::distance(grid.points[point], map.sheet.fine.position[v]);
            assert!(apart < 1e-9, "{apart}");
        }
    }
    assert!(found.contains(&true));
    for h in c.halfedges() {
        let Some(t) = c.twin(h) else { continue };
        let shift = map.shift(h).map(|x| x as f64);
        for (here, there) in [(h, c.next(t)), (c.next(h), t)] {
            let [x, y] = turned(map.sheet.at(here), map.sheet.turns[h]);
            assert_eq!([x + shift[0], y + shift[1]], map.sheet.at(there));
        }
    }
    let double = |uv: &FaceVec<[[f64; 2]; 3]>| -> Vec<f64> {
        uv.iter()
            .map(|p| super::triangle::double_area(*p))
            .collect()
    };
    let (on_grid, in_blocks) = (double(&grid.uv), double(&located.uv));
    assert!(on_grid.iter().all(|area| *area > 0.0));
    assert!(in_blocks.iter().all(|area| *area > 0.0));
    for areas in [on_grid, in_blocks] {
        let sum: f64 = 0.5 * areas.iter().sum::<f64>();
        assert!((sum - grid.cells() as f64).abs() < 1e-9 * sum, "{sum}");
    }
    // Every block is filled by its faces.
    for (b, block) in grid.blocks.blocks.iter().enumerate() {
        let own = located.block.enumerate().filter(|(_, of)| **of == b as u32);
        let corners = own.map(|(f, _)| located.uv[f]);
        let mut area = 0.0;
        for p in corners {
            area += 0.5 * super::triangle::double_area(p);
            for [x, y] in p {
                assert!((0.0..=block.cells[0] as f64).contains(&x));
                assert!((0.0..=block.cells[1] as f64).contains(&y));
            }
        }
        let wanted = (block.cells[0] * block.cells[1]) as f64;
        assert!((area - wanted).abs() < 1e-9 * wanted);
    }
    grid
}

/// Squares whose grid has as many cells as they have: then the map is an isometry.
#[test]
fn a_grid_of_squares_is_an_isometry() {
    for (squares, cells) in [
        (cuboid([2, 3, 1], 3, no_lines), 22),
        (
            plate(&[[0, 0], [1, 0], [2, 0], [0, 1], [0, 2]], 3, no_lines),
            5,
        ),
    ] {
        let grid = assert_gridded(&squares, 4 * cells);
        assert_eq!(grid.cells(), 4 * cells);
        assert!((grid.cell_size - 0.5).abs() < 1e-9);
        let [p05, p95] = [
            grid.distortion.edge_ratio.p05,
            grid.distortion.edge_ratio.p95,
        ];
        // Vertices beside lines were moved onto them; Newton's method brings them back until a step gains less than 1e-4 of the energy, whose root is what lengths are off by.
        assert!(
            (p05 - 1.0).abs() < 1e-5 && (p95 - 1.0).abs() < 1e-5,
            "{p05} {p95}"
        );
        assert!(grid.distortion.symmetric_dirichlet.max < 4.0 + 1e-6);
        assert!(grid.distortion.angle.max < 1e-5);
    }
}

/// With other numbers of cells nothing fits, and all the same nothing is turned over.
#[test]
fn every_number_of_cells_has_a_map_without_a_fold() {
    let around = |p: [f64; 3]| p[2] == 1.0;
    let surfaces = [
        cuboid([2, 3, 1], 3, no_lines),
        cuboid([2, 3, 2], 3, |p, q| around(p) && around(q)),
        plate(
            &[
                [0, 0],
                [1, 0],
                [2, 0],
                [0, 1],
                [2, 1],
                [0, 2],
                [1, 2],
                [2, 2],
            ],
            3,
            no_lines,
        ),
        torus(4),
    ];
    for squares in &surfaces {
        for cells in [7, 30, 101, 500] {
            let grid = assert_gridded(squares, cells);
            let mut pairs = 0;
            super::layout::shared_texels(&grid.quads, &grid.blocks, 3, |_, _| pairs += 1);
            assert!(pairs > 0);
        }
    }
}
