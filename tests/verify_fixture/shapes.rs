//! Four surfaces with a flat metric.

use super::builder::build;
use super::{Atlas, P2, Plan};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// A grid of squares, each cut along a diagonal (those of one `parity` along the rising one); `at` gives the vertex and the place in the plane of a node.
fn grid(
    columns: u32,
    rows: u32,
    parity: u32,
    vertex: impl Fn(u32, u32) -> u32,
    place: impl Fn(f64, f64) -> P2,
) -> (Vec<[u32; 3]>, Vec<[P2; 3]>) {
    let (mut faces, mut uv) = (Vec::new(), Vec::new());
    for j in 0..rows {
        for i in 0..columns {
            let square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let triangles = if (i + j) % 2 == parity {
                [[0, 1, 2], [0, 2, 3]]
            } else {
                [[0, 1, 3], [1, 2, 3]]
            };
            for t in triangles {
                faces.push(t.map(|k: usize| vertex(square[k].0, square[k].1)));
                uv.push(t.map(|k| place(f64::from(square[k].0), f64::from(square[k].1))));
            }
        }
    }
    (faces, uv)
}

/// A flat torus on a surface of revolution, two loops of cut through one flat node; two patches.
pub fn torus() -> Atlas {
    let (m, n) = (8, 12);
    // This parity puts a face at the node that has both cut edges: a triple overlap.
    let (faces, uv) = grid(
        m,
        n,
        1,
        |i, j| (i % m) + m * (j % n),
        |x, y| [x + 0.25 * y, 0.75 * y],
    );
    let positions = (0..n)
        .flat_map(|j| (0..m).map(move |i| (i, j)))
        .map(|(i, j)| {
            let (a, b) = (
                TAU * f64::from(i) / f64::from(m),
                TAU * f64::from(j) / f64::from(n),
            );
            let r = 3.0 + a.cos();
            [r * b.cos(), r * b.sin(), a.sin()]
        })
        .collect();
    let mut cut: Vec<(u32, u32)> = (0..m).map(|i| (i, (i + 1) % m)).collect();
    cut.extend((0..n).map(|j| (m * j, m * ((j + 1) % n))));
    let half = faces.len() / 2;
    let patch = (0..faces.len()).map(|f| u32::from(f >= half)).collect();
    build(Plan {
        positions,
        faces,
        uv,
        cut,
        cones: Vec::new(),
        patch,
        topology: (1, 0),
    })
}

/// Two squares sewn along their border and blown up a little: four cones of π, a path as cut.
pub fn pillow() -> Atlas {
    let n = 6;
    let mut ids: BTreeMap<(u32, u32, bool), u32> = BTreeMap::new();
    let is_rim = |i: u32, j: u32| i.is_multiple_of(n) || j.is_multiple_of(n);
    let mut positions = Vec::new();
    for back in [false, true] {
        for j in 0..=n {
            for i in 0..=n {
                if back && is_rim(i, j) {
                    let front = ids[&(i, j, false)];
                    ids.insert((i, j, true), front);
                    continue;
                }
                ids.insert((i, j, back), positions.len() as u32);
                let (x, y) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let z = x * (1.0 - x) * y * (1.0 - y);
                positions.push([x, y, if back { -z } else { z }]);
            }
        }
    }
    // Front and back side by side; the back is seen from behind, so its columns run the other way.
    let (faces, uv) = grid(
        2 * n,
        n,
        0,
        |i, j| {
            if i <= n {
                ids[&(i, j, false)]
            } else {
                ids[&(2 * n - i, j, true)]
            }
        },
        |x, y| [x, y],
    );
    let corner = |i: u32, j: u32| ids[&(i, j, false)];
    let mut cut = Vec::new();
    for i in 0..n {
        cut.push((corner(i, 0), corner(i + 1, 0)));
        cut.push((corner(0, i), corner(0, i + 1)));
        cut.push((corner(i, n), corner(i + 1, n)));
    }
    let cones = [(0, 0), (n, 0), (n, n), (0, n)].map(|(i, j)| (corner(i, j), PI));
    let patch = vec![0; faces.len()];
    build(Plan {
        positions,
        faces,
        uv,
        cut,
        cones: cones.to_vec(),
        patch,
        topology: (0, 0),
    })
}

/// A prism without lids, cut from rim to rim.
pub fn tube() -> Atlas {
    let (m, n) = (9, 5);
    let side = 2.0 * (PI / f64::from(m)).sin();
    let (faces, uv) = grid(m, n, 0, |i, j| i % m + m * j, |x, y| [x * side, 0.5 * y]);
    let positions = (0..=n)
        .flat_map(|j| (0..m).map(move |i| (i, j)))
        .map(|(i, j)| {
            let a = TAU * f64::from(i) / f64::from(m);
            [a.cos(), a.sin(), 0.5 * f64::from(j)]
        })
        .collect();
    let cut = (0..n).map(|j| (m * j, m * (j + 1))).collect();
    let patch = vec![0; faces.len()];
    build(Plan {
        positions,
        faces,
        uv,
        cut,
        cones: Vec::new(),
        patch,
        topology: (0, 2),
    })
}

/// A cone of 5/6 of a turn, its tip a flat vertex's worth of curvature π/3, on a free boundary.
pub fn cone() -> Atlas {
    let (sectors, rings) = (10u32, 4u32);
    let opening = TAU * 5.0 / 6.0;
    let vertex = |i: u32, j: u32| {
        if j == 0 {
            0
        } else {
            1 + (j - 1) * sectors + i % sectors
        }
    };
    let place = |i: u32, j: u32| {
        let a = opening * f64::from(i) / f64::from(sectors);
        let (s, c) = a.sin_cos();
        [c * f64::from(j), s * f64::from(j)]
    };
    let mut positions = vec![[0.0, 0.0, 2.0]];
    for j in 1..=rings {
        for i in 0..sectors {
            let (s, c) = (TAU * f64::from(i) / f64::from(sectors)).sin_cos();
            let r = f64::from(j) * 0.8;
            positions.push([c * r, s * r, 2.0 - 0.6 * f64::from(j)]);
        }
    }
    let (mut faces, mut uv) = (Vec::new(), Vec::new());
    for j in 0..rings {
        for i in 0..sectors {
            let quad = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)];
            let triangles: &[[usize; 3]] = if j == 0 {
                &[[0, 1, 2]]
            } else {
                &[[0, 1, 2], [0, 2, 3]]
            };
            for t in triangles {
                faces.push(t.map(|k| vertex(quad[k].0, quad[k].1)));
                uv.push(t.map(|k| place(quad[k].0, quad[k].1)));
            }
        }
    }
    let cut = (0..rings)
        .map(|j| (vertex(0, j), vertex(0, j + 1)))
        .collect();
    let patch = vec![0; faces.len()];
    build(Plan {
        positions,
        faces,
        uv,
        cut,
        cones: vec![(0, PI / 3.0)],
        patch,
        topology: (0, 1),
    })
}
