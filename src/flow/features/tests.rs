use super::*;
use crate::geometry::mesh::{Soup, bounding_box};
use crate::geometry::polycube::polycube;
use crate::repair::{RepairParams, repair};

/// A unit square with two squares of other materials, of sides 0.5 and 0.004, each between grid lines with `n` edges on every side.
fn marked(n: u32) -> Mesh {
    let breaks = [0.0, 0.1, 0.6, 0.75, 0.754, 1.0];
    let mut line: Vec<f64> = breaks
        .windows(2)
        .flat_map(|part| {
            (0..n).map(|k| part[0] + (part[1] - part[0]) * f64::from(k) / f64::from(n))
        })
        .collect();
    line.push(1.0);
    let count = line.len() as u32;
    let positions = line.iter().flat_map(|y| line.iter().map(|x| [*x, *y, 0.0]));
    let mut faces = Vec::new();
    let mut materials = Vec::new();
    for (i, j) in (0..5 * n).flat_map(|j| (0..5 * n).map(move |i| (i, j))) {
        let a = count * j + i;
        faces.extend([[a, a + 1, a + count + 1], [a, a + count + 1, a + count]]);
        let material = match [i / n, j / n] {
            [1, 1] => 1,
            [3, 3] => 2,
            _ => 0,
        };
        materials.extend([material; 2]);
    }
    let mut soup = Soup::from_triangles(positions.collect(), faces);
    soup.face_material = materials;
    let repaired = repair(&soup, &RepairParams::default()).expect("a plain square");
    let first = repaired.components.into_iter().next().expect("one");
    first.mesh.expect("connected")
}

fn surface(positions: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Mesh {
    let soup = Soup::from_triangles(positions, faces);
    let repaired = repair(&soup, &RepairParams::default()).expect("a plain surface");
    let first = repaired.components.into_iter().next().expect("one");
    first.mesh.expect("connected")
}

#[test]
fn single_edges_count_where_there_is_room_beside_them() {
    let sharp = |mesh: &Mesh| features(mesh, &FeatureParams::default(), &[]).chains.len();
    // All edges of a box, whichever way its sides are divided.
    let cube = polycube([[0, 0, 0]], |_, _, _| true);
    assert_eq!(sharp(&cube), 12);
    // Without a side: nothing is lost but the border.
    let faces = cube.connectivity.to_faces();
    let open = surface(cube.positions.as_slice().to_vec(), faces[2..].to_vec());
    assert_eq!(sharp(&open), 8);
    // Corners of 45° and 60°, …
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let tetrahedron = |height| {
        let corners = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, height],
        ];
        surface(corners.to_vec(), faces.clone())
    };
    assert_eq!(sharp(&tetrahedron(1.0)), 6);
    // … and of 18° and less, where three edges end: what is left are the three around the foot.
    assert_eq!(sharp(&tetrahedron(3.0)), 3);
    let left_out = |height| features(&tetrahedron(height), &FeatureParams::default(), &[]).left_out;
    assert_eq!(left_out(1.0), 0.0);
    let (upright, foot) = (3.0 + 2.0 * 10.0_f64.sqrt(), 2.0 + 2.0_f64.sqrt());
    assert!((left_out(3.0) - upright / (upright + foot)).abs() < 1e-12);
}

#[test]
fn chains_of_few_edges_count_where_they_are_ridges_or_valleys_throughout() {
    // Four edges in a row along the middle of a strip, each with a corner on both sides that lies as high as asked.
    let strip = |heights: [f64; 4]| {
        let middle = (0..5).map(|i| [f64::from(i) * 4.0, 0.0, 0.0]);
        let side = |y: f64| (0..4).map(move |i| [2.0 + 4.0 * f64::from(i), y]);
        let sides = [1.0, -1.0].map(|y| side(y).zip(heights).map(|([x, y], z)| [x, y, z]));
        let positions = middle.chain(sides.into_iter().flatten()).collect();
        let at = |i: u32| [[i, i + 1, i + 5], [i + 1, i, i + 9]];
        let between = |i: u32| [[i + 1, i + 6, i + 5], [i + 1, i + 9, i + 10]];
        let faces = (0..4).flat_map(at).chain((0..3).flat_map(between));
        surface(positions, faces.collect())
    };
    let found = |heights| {
        let found = features(&strip(heights), &FeatureParams::default(), &[]);
        // The others are no edges that should be lines.
        assert_eq!(found.left_out, 0.0);
        found.chains.len()
    };
    assert_eq!(found([0.5; 4]), 1);
    assert_eq!(found([-0.5; 4]), 1);
    assert_eq!(found([0.5, -0.5, 0.5, -0.5]), 0);
    assert_eq!(found([0.5, 0.5, 0.5, -0.5]), 0);
}

/// Squares over the columns at `x`, `rows` of them of depth 1, at heights of each corner.
fn heights(x: &[f64], rows: u32, z: impl Fn(usize, u32) -> f64) -> Mesh {
    let columns = x.len() as u32;
    let corners = (0..=rows).flat_map(|j| (0..x.len()).map(move |i| (i, j)));
    let positions = corners.map(|(i, j)| [x[i], f64::from(j), z(i, j)]);
    let squares = (0..rows).flat_map(|j| (0..columns - 1).map(move |i| columns * j + i));
    let halves = squares.flat_map(|a| {
        [
            [a, a + 1, a + columns + 1],
            [a, a + columns + 1, a + columns],
        ]
    });
    surface(positions.collect(), halves.collect())
}

fn lengths(mesh: &Mesh) -> Vec<f64> {
    let found = features(mesh, &FeatureParams::default(), &[]);
    assert!(found.left_out < 0.05);
    found.chains.iter().map(|f| f.length).collect()
}

/// A number in [−1, 1) that depends on nothing but `i` (the finaliser of SplitMix64).
fn noise(i: u64) -> f64 {
    let mut x = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as f64 / 2.0_f64.powi(63) - 1.0
}

#[test]
fn noise_has_no_features_and_a_fold_in_it_has() {
    let x: Vec<f64> = (0..=40).map(f64::from).collect();
    for seed in 0..4_u64 {
        let at = |i: usize, j: u32| noise(seed << 32 | (i as u64) << 16 | u64::from(j));
        let rough = heights(&x, 40, |i, j| 0.4 * at(i, j));
        let c = &rough.connectivity;
        let sharp = c.edges().filter(|&e| bend(&rough, e).to_degrees() >= 40.0);
        assert!(sharp.count() > c.edge_count() / 20, "{seed}");
        assert_eq!(lengths(&rough), Vec::<f64>::new(), "{seed}");
        // The two sides at a right angle, with less noise.
        let folded = heights(&x, 40, |i, j| 0.1 * at(i, j) - (x[i] - 20.0).abs());
        let found = features(&folded, &FeatureParams::default(), &[]).chains;
        // Edges of noise that meet it may divide it, and what is short between them is lost.
        let (low, high) = bounding_box(folded.positions.as_slice());
        let middle = 0.5 * (low[0] + high[0]);
        let is_off = |v: &VertexId| (folded.positions[*v][0] - middle).abs() > 1e-9;
        let is_on = |f: &&Feature| !f.vertices.iter().any(is_off);
        let (on, off): (Vec<&Feature>, Vec<&Feature>) = found.iter().partition(is_on);
        let [on, off] = [on, off].map(|all| all.iter().map(|f| f.length).sum::<f64>());
        let depth = high[1] - low[1];
        assert!(on > 0.8 * depth && off < 0.1 * on, "{seed}: {on} {off}");
    }
}

#[test]
fn noise_that_meets_a_line_does_not_divide_it() {
    // A fold beside which a vertex stands out.
    let x: Vec<f64> = (0..=12).map(f64::from).collect();
    let mesh = heights(&x, 20, |i, j| match (i, j) {
        (7, 10) => -0.2,
        _ => -(x[i] - 6.0).abs(),
    });
    let c = &mesh.connectivity;
    let is_sharp = |e: EdgeId| bend(&mesh, e).to_degrees() >= 40.0;
    let met = |v: &VertexId| c.outgoing(*v).filter(|&h| is_sharp(c.edge(h))).count() > 2;
    let found = features(&mesh, &FeatureParams::default(), &[]).chains;
    let [fold] = &found[..] else {
        panic!("{} features", found.len());
    };
    assert_eq!(fold.edges.len(), 20);
    assert!(fold.vertices.iter().any(met));
}

#[test]
fn steps_as_wide_as_the_edges_of_a_mesh_are_no_features() {
    // Columns with four rises of 45°.
    let rises = |flat: &[f64], rise: &[f64]| {
        let (mut x, mut z) = (vec![0.0], vec![0.0]);
        for k in 0..9 {
            for width in if k % 2 == 0 { flat } else { rise } {
                x.push(x[x.len() - 1] + width);
                z.push(z[z.len() - 1] + if k % 2 == 0 { 0.0 } else { *width });
            }
        }
        let mesh = heights(&x, 40, |i, _| z[i]);
        lengths(&mesh).len()
    };
    // One column wide, as of a volume in two classes; …
    assert_eq!(rises(&[1.0; 5], &[1.0]), 0);
    // … two, or one between plain faces of a solid.
    assert_eq!(rises(&[1.0; 5], &[1.0; 2]), 8);
    assert_eq!(rises(&[10.0], &[1.0]), 8);
    // Steeper than those of volumes.
    let x: Vec<f64> = (0..=12).map(f64::from).collect();
    let cliffs = heights(&x, 40, |i, _| 3.0 * (i / 5) as f64);
    assert_eq!(lengths(&cliffs).len(), 4);
}

#[test]
fn ridges_look_away_from_each_other() {
    let cube = polycube([[0, 0, 0]], |_, _, _| true);
    let c = &cube.connectivity;
    let sharp = |e: &EdgeId| bend(&cube, *e) > 1.0;
    assert!(c.edges().filter(sharp).all(|e| is_ridge(&cube, e)));
    let faces = c.to_faces().into_iter().map(|[a, b, c]| [a, c, b]);
    let inside_out = surface(cube.positions.as_slice().to_vec(), faces.collect());
    let c = &inside_out.connectivity;
    let sharp = |e: &EdgeId| bend(&inside_out, *e) > 1.0;
    assert!(c.edges().filter(sharp).all(|e| !is_ridge(&inside_out, e)));
}

#[test]
fn which_chains_count_does_not_depend_on_the_density_of_the_mesh() {
    let params = FeatureParams {
        angle: 180.0,
        materials: true,
        ..FeatureParams::default()
    };
    for n in [2, 4, 8] {
        let found = features(&marked(n), &params, &[]).chains;
        assert_eq!(found.len(), 1, "{n}");
        assert_eq!(found[0].edges.len(), 4 * n as usize);
        assert!((found[0].length - 2.0).abs() < 1e-12);
    }
}
