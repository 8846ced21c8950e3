//! The measures against known values and against all triangles, one by one.

use super::boxes::squared_distance;
use super::*;
use crate::geometry::mesh::distance_to_segment;
use std::f64::consts::{FRAC_PI_2, PI};

/// A number in [0, 1) that depends on nothing but `i` (the finaliser of SplitMix64).
fn uniform(i: u64) -> f64 {
    let mut z = i.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 53) as f64
}

/// Distance from the plane's foot where it lies inside, and else from the sides: another way than the tree's.
fn brute_distance(p: [f64; 3], t: [[f64; 3]; 3]) -> f64 {
    let sides = (0..3).map(|k| distance_to_segment(p, t[k], t[(k + 1) % 3]));
    let nearest_side = sides.fold(f64::INFINITY, f64::min);
    let n = normal(t);
    let length = norm(n);
    if length == 0.0 {
        return nearest_side;
    }
    let dot = |a: [f64; 3], b: [f64; 3]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let height = dot(sub(p, t[0]), n) / length;
    let foot = std::array::from_fn(|i| p[i] - height * n[i] / length);
    let inside = (0..3).all(|k| {
        let side = sub(t[(k + 1) % 3], t[k]);
        dot(cross(side, sub(foot, t[k])), n) >= 0.0
    });
    if inside { height.abs() } else { nearest_side }
}

fn random_triangles(count: u64, size: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let at = |i: u64| 3.0 * uniform(i) - 1.0;
    let mut positions = Vec::new();
    for t in 0..count {
        let middle = [0, 1, 2].map(|x| at(1000 * t + x));
        for k in 0..3 {
            positions
                .push([0, 1, 2].map(|x| middle[x] + size * at(1000 * t + 10 + 3 * k + x as u64)));
        }
    }
    let faces = (0..count as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    (positions, faces)
}

#[test]
fn points_and_triangles_agree_with_the_plane_and_the_sides() {
    let (positions, faces) = random_triangles(300, 0.7);
    for (i, f) in faces.iter().enumerate() {
        let t = f.map(|v| positions[v as usize]);
        for j in 0..20 {
            let p = [0, 1, 2].map(|x| 4.0 * uniform(77 * i as u64 + 3 * j + x) - 2.0);
            let (d, brute) = (squared_distance(p, t).sqrt(), brute_distance(p, t));
            assert!((d - brute).abs() < 1e-12, "{d} {brute}");
        }
    }
}

#[test]
fn degenerate_triangles_are_segments_and_points() {
    let (a, b) = ([0.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
    let p = [1.0, 3.0, 4.0];
    for t in [[a, b, a], [a, a, b], [b, a, a], [a, b, [1.0, 0.0, 0.0]]] {
        assert_eq!(squared_distance(p, t).sqrt(), 5.0);
    }
    assert_eq!(squared_distance([3.0, 4.0, 0.0], [a; 3]).sqrt(), 5.0);
}

#[test]
fn the_tree_finds_what_a_search_through_all_finds() {
    for size in [0.05, 0.8] {
        let (positions, faces) = random_triangles(500, size);
        let surface = Triangles {
            positions: &positions,
            faces: &faces,
        };
        let tree = BoxTree::new(surface).expect("triangles");
        for i in 0..400 {
            let p = [0, 1, 2].map(|x| 6.0 * uniform(5 * i + x) - 3.0);
            let all = faces
                .iter()
                .map(|&f| brute_distance(p, corners(surface, f)));
            let brute = all.fold(f64::INFINITY, f64::min);
            for near in [0, 499, i as usize] {
                assert!((tree.nearest(p, near).distance - brute).abs() < 1e-12);
            }
        }
    }
}

/// Boxes of needles that meet in one point all overlap.
#[test]
fn looks_into_a_fan_do_not_grow_with_it() {
    let looks = [1000_u32, 16_000].map(|sides| {
        let at = |i: u32| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / f64::from(sides)).sin_cos();
            [c, s, 0.1 * c]
        };
        let positions: Vec<[f64; 3]> = std::iter::once([0.0; 3])
            .chain((0..sides).map(at))
            .collect();
        let faces: Vec<[u32; 3]> = (0..sides)
            .map(|i| [0, 1 + i, 1 + (i + 1) % sides])
            .collect();
        let tree = BoxTree::new(Triangles {
            positions: &positions,
            faces: &faces,
        })
        .expect("triangles");
        let of = (0..500).map(|i| {
            let p = [0, 1, 2].map(|x| 1.6 * uniform(7 * i + x) - 0.8);
            tree.search(p, 0).1
        });
        of.sum::<usize>() as f64 / 500.0
    });
    assert!(looks[1] < 2.0 * looks[0], "{looks:?}");
    assert!(looks[1] < 160.0, "{looks:?}");
}

const SQUARE: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn square(height: f64, side: f64) -> Vec<[f64; 3]> {
    vec![
        [0.0, 0.0, height],
        [side, 0.0, height],
        [side, side, height],
        [0.0, side, height],
    ]
}

const MANY: Sampling = Sampling {
    samples: 20_000,
    vertices: usize::MAX,
};

#[test]
fn parallel_squares_are_their_distance_apart() {
    let (a, b) = (square(0.0, 1.0), square(0.25, 1.0));
    let measure = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let of = |positions| Triangles {
            positions,
            faces: &SQUARE,
        };
        deviation(of(a), of(b), MANY).expect("area")
    };
    let d = measure(&a, &b);
    assert!((d.rms - 0.25).abs() < 1e-12 && (d.hausdorff - 0.25).abs() < 1e-12);
    assert_eq!((d.mean_normal_angle, d.max_normal_angle), (0.0, 0.0));
    assert!((d.psnr(25.0).expect("finite") - 40.0).abs() < 1e-9);
    assert_eq!(Deviation::default().psnr(1.0), None);
    assert!(measure(&a, &a).rms < 1e-15);
    // A square within one of twice the side: beyond it d is the distance to the smaller square.
    let d = measure(&square(0.0, 2.0), &a);
    let corner = 2f64.sqrt();
    assert!((d.hausdorff - corner).abs() < 1e-12, "the corner is tested");
    // ∫ d² = 2 ∫₀¹ x² + ∫∫ (x² + y²) = 2/3 + 2/3, over the areas 4 and 1.
    let exact = (4.0 / 3.0 / 5.0f64).sqrt();
    assert!((d.rms / exact - 1.0).abs() < 2e-3, "{}", d.rms);
}

#[test]
fn both_sides_count_and_threads_do_not() {
    let a = square(0.0, 1.0);
    let mut b = square(0.0, 1.0);
    b.extend([[0.5, 0.5, 0.0], [0.6, 0.5, 0.0], [0.5, 0.5, 3.0]]);
    let with_fin = [SQUARE[0], SQUARE[1], [4, 5, 6]];
    let (a, b) = (
        Triangles {
            positions: &a,
            faces: &SQUARE,
        },
        Triangles {
            positions: &b,
            faces: &with_fin,
        },
    );
    let run = |threads: usize, x, y| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| deviation(x, y, MANY))
    };
    let one = run(1, a, b).expect("area");
    assert_eq!(one.hausdorff, 3.0, "seen from one side only");
    assert!((one.max_normal_angle - FRAC_PI_2).abs() < 1e-12);
    assert_eq!(Some(one), run(3, a, b));
    let turned = run(2, b, a).expect("area");
    assert!((turned.rms - one.rms).abs() < 1e-12);
    assert_eq!(deviation(a, Triangles { faces: &[], ..b }, MANY), None);
}

/// A sphere of longitude and latitude.
fn sphere(n: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for j in 0..=n {
        for i in 0..2 * n {
            let (s, c) = (PI * f64::from(i) / f64::from(n)).sin_cos();
            let (r, z) = (PI * f64::from(j) / f64::from(n)).sin_cos();
            positions.push([r * c, r * s, z]);
            let (next, row) = ((i + 1) % (2 * n), 2 * n);
            if j < n {
                let (a, b) = (j * row + i, j * row + next);
                faces.extend([[a, a + row, b + row], [a, b + row, b]]);
            }
        }
    }
    (positions, faces)
}

/// Two spheres about one centre: the distance is the difference of the radii up to the error of the facets.
#[test]
fn concentric_spheres() {
    let (positions, faces) = sphere(64);
    let larger: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| 1.5 * x)).collect();
    let a = Triangles {
        positions: &positions,
        faces: &faces,
    };
    let b = Triangles {
        positions: &larger,
        faces: &faces,
    };
    let d = deviation(a, b, MANY).expect("area");
    assert!((d.rms - 0.5).abs() < 2e-3, "{d:?}");
    assert!((d.hausdorff - 0.5).abs() < 2e-3, "{d:?}");
    assert!(d.mean_normal_angle < 0.05);
}
