//! Rebuilt meshes of hand-made slit disks, checked by code that shares nothing with the rebuilding.

use super::*;
use crate::atlas::geometry_image::{image_origin, sample};
use crate::atlas::patches::samples::{self, Sample, build};
use crate::atlas::patches::{PatchParams, layout};
use crate::atlas::plane::doubled_area;
use crate::geometry::deviation::{Sampling, Triangles, deviation};
use crate::geometry::mesh::distance;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

struct Laid {
    layout: PatchLayout,
    images: Vec<GeometryImage>,
    origin: [f64; 3],
}

fn lay(s: &Sample, texels: usize) -> Laid {
    let params = PatchParams {
        texel_budget: texels,
        min_side: 1,
        ..PatchParams::default()
    };
    let layout = layout(&s.mesh, &s.length, &s.cut, &s.development, None, &params).unwrap();
    let origin = image_origin(&s.mesh, &crate::geometry::frame::Frame::default());
    let images = sample(&s.mesh, &layout, &s.log_scale, origin);
    Laid {
        layout,
        images,
        origin,
    }
}

impl Laid {
    fn images(&self) -> Images<'_> {
        Images::new(&self.layout, &self.images, self.origin)
    }
}

/// V, E, F, boundary loops, by counting sides.
fn count(mesh: &Rebuilt) -> (usize, usize, usize, usize) {
    let mut sides: BTreeSet<(u32, u32)> = BTreeSet::new();
    for f in &mesh.faces {
        assert_eq!(BTreeSet::from(*f).len(), 3, "three vertices");
        for k in 0..3 {
            assert!(sides.insert((f[k], f[(k + 1) % 3])), "a side once");
        }
    }
    let open: BTreeMap<u32, u32> = sides
        .iter()
        .filter(|&&(a, b)| !sides.contains(&(b, a)))
        .copied()
        .collect();
    let edges = (sides.len() + open.len()) / 2;
    let mut left: BTreeSet<u32> = open.keys().copied().collect();
    let mut loops = 0;
    while let Some(start) = left.pop_first() {
        loops += 1;
        let mut at = open[&start];
        while at != start {
            assert!(left.remove(&at), "one loop through a vertex");
            at = open[&at];
        }
    }
    let used: BTreeSet<u32> = mesh.faces.iter().flatten().copied().collect();
    assert_eq!(used.len(), mesh.positions.len(), "every vertex is used");
    (used.len(), edges, mesh.faces.len(), loops)
}

/// Rebuilds and checks everything that holds always; returns the mesh and its deviation from the surface.
fn check(s: &Sample, laid: &Laid) -> (Rebuilt, f64) {
    let mesh = rebuild(&laid.images()).unwrap();
    let (v, e, f, loops) = count(&mesh);
    let expected = s.mesh.connectivity.topology();
    let chi = v as i64 - e as i64 + f as i64;
    assert_eq!(
        (chi, loops),
        (expected.euler_characteristic, expected.boundary_loops)
    );
    assert_eq!(mesh.topology.genus, expected.genus);
    let mut area = vec![0.0; laid.layout.patches.len()];
    for (uv, &patch) in mesh.patch_uv.iter().zip(&mesh.face_patch) {
        let doubled = doubled_area(*uv);
        assert!(doubled > 0.0, "flipped: {doubled:e} {uv:?}");
        area[patch as usize] += doubled;
    }
    // The patches' areas in the plane, up to what thinning takes off at the border.
    for (p, area) in area.iter().enumerate() {
        let faces = s.mesh.connectivity.faces();
        let of_patch = faces.filter(|&f| laid.layout.face_patch[f].index() == p);
        let exact: f64 = of_patch.map(|f| doubled_area(laid.layout.uv[f])).sum();
        assert!(
            (area / exact - 1.0).abs() < 0.2,
            "patch {p}: {area} of {exact}"
        );
    }
    let faces = s.mesh.connectivity.to_faces();
    let surface = Triangles {
        positions: s.mesh.positions.as_slice(),
        faces: &faces,
    };
    let rebuilt = Triangles {
        positions: &mesh.positions,
        faces: &mesh.faces,
    };
    let sampling = Sampling {
        samples: 5000,
        vertices: 5000,
    };
    let d = deviation(surface, rebuilt, sampling).unwrap();
    (mesh, d.hausdorff / s.mesh.diagonal())
}

#[test]
fn a_flat_square_comes_back() {
    for n in [1, 2, 7, 40] {
        let s = samples::square(n);
        for texels in [16, 300, 5000] {
            let (_, off) = check(&s, &lay(&s, texels));
            assert!(off < 1e-6, "{off}");
        }
    }
}

#[test]
fn a_strip_of_several_patches_is_one_surface() {
    let s = samples::ramp(60, 6, 6.0);
    let laid = lay(&s, 20_000);
    assert!(laid.images.len() > 1);
    let (_, off) = check(&s, &laid);
    assert!(off < 1e-6, "{off}");
}

/// A cylinder, cut open along one line: its only patch meets itself across the cut.
fn cylinder(columns: usize, rows: usize) -> Sample {
    let at = |i: usize, j: usize| ((i % columns) * (rows + 1) + j) as u32;
    let place = |i: usize, j: usize| [i as f64 / columns as f64, 0.5 * j as f64 / rows as f64];
    let mut faces = Vec::new();
    let mut uv = Vec::new();
    for i in 0..columns {
        for j in 0..rows {
            let (a, b, c, d) = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1));
            for t in [[a, b, c], [a, c, d]] {
                faces.push(t.map(|(i, j)| at(i, j)));
                uv.push(t.map(|(i, j)| place(i, j)));
            }
        }
    }
    let positions = (0..columns * (rows + 1))
        .map(|v| {
            let (s, c) = (TAU * (v / (rows + 1)) as f64 / columns as f64).sin_cos();
            let z = 0.5 * TAU * (v % (rows + 1)) as f64 / rows as f64;
            [c, s, z]
        })
        .collect();
    let on_cut = move |v: u32| (v as usize) <= rows;
    build(
        &faces,
        positions,
        uv,
        move |a, b| on_cut(a) && on_cut(b),
        [0.0; 2],
    )
}

#[test]
fn a_cylinder_closes_across_its_cut() {
    let s = cylinder(90, 20);
    let mut errors = Vec::new();
    for texels in [64, 256, 1024, 4096] {
        let (_, off) = check(&s, &lay(&s, texels));
        errors.push(off);
    }
    assert!(
        errors[3] < 1e-3 && errors[3] < 0.1 * errors[0],
        "{errors:?}"
    );
}

/// An annulus in the plane, with a slit: its sides lie on each other, the patch touches itself.
fn annulus(columns: usize, rows: usize, turn: f64) -> Sample {
    let at = |i: usize, j: usize| ((i % columns) * (rows + 1) + j) as u32;
    let place = |i: usize, j: usize| {
        let (s, c) = (TAU * i as f64 / columns as f64 + turn).sin_cos();
        let r = 1.0 + j as f64 / rows as f64;
        [r * c, r * s]
    };
    let mut faces = Vec::new();
    let mut uv = Vec::new();
    for i in 0..columns {
        for j in 0..rows {
            let (a, b, c, d) = ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j));
            for t in [[a, b, c], [a, c, d]] {
                faces.push(t.map(|(i, j)| at(i, j)));
                uv.push(t.map(|(i, j)| place(i, j)));
            }
        }
    }
    let positions = (0..columns * (rows + 1))
        .map(|v| {
            let [x, y] = place(v / (rows + 1), v % (rows + 1));
            [x, y, 0.0]
        })
        .collect();
    let on_cut = move |v: u32| (v as usize) <= rows;
    build(
        &faces,
        positions,
        uv,
        move |a, b| on_cut(a) && on_cut(b),
        [0.0; 2],
    )
}

#[test]
fn a_slit_annulus_comes_back_whole() {
    for turn in [0.0, 0.1, 1.0, 2.5] {
        let s = annulus(60, 8, turn);
        for texels in [100, 1000, 10_000] {
            let laid = lay(&s, texels);
            let (_, off) = check(&s, &laid);
            // The border is thinned to about a texel: a chord of two texels leaves the inner circle by less than this.
            let spacing = laid.layout.patches.iter().map(|p| {
                let [[a, _, _], [c, _, _]] = p.texel_to_patch;
                a.hypot(c) * p.to_chart.unwrap().scale
            });
            let chord = 2.0 * spacing.fold(0.0, f64::max);
            let off = off * s.mesh.diagonal();
            assert!(off < chord * chord / 8.0, "{off} with chords of {chord}");
        }
    }
}

/// The mesh is the same for any number of threads.
#[test]
fn threads_do_not_change_a_bit() {
    let s = samples::ramp(60, 6, 6.0);
    let laid = lay(&s, 20_000);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| rebuild(&laid.images()).unwrap())
    };
    assert!(run(1) == run(3));
}

/// Both sides of a seam see the same vertices: no position stands twice.
#[test]
fn seams_are_shared() {
    let s = cylinder(40, 10);
    let (mesh, _) = check(&s, &lay(&s, 2000));
    let mut seen: BTreeSet<[u64; 3]> = BTreeSet::new();
    for p in &mesh.positions {
        assert!(seen.insert(p.map(f64::to_bits)), "{p:?} twice");
    }
    // On the cut and on both boundary circles all vertices lie on the surface's edges.
    let on_cut = mesh
        .positions
        .iter()
        .filter(|p| distance(**p, [1.0, 0.0, p[2]]) < 1e-12);
    assert!(on_cut.count() > 5);
}

/// The same patches on images of a few texels, far fewer than any layout gives.
fn coarsen(s: &Sample, laid: &Laid, columns: usize) -> Laid {
    let mut layout = laid.layout.clone();
    for (id, patch) in layout.patches.iter_mut().enumerate() {
        let faces = s.mesh.connectivity.faces();
        let of_patch = faces.filter(|&f| layout.face_patch[f].index() == id);
        let corners = of_patch.flat_map(|f| laid.layout.uv[f]);
        let height = corners.map(|p| p[1]).fold(0.0, f64::max);
        let d = columns as f64;
        let rows = (d * height).ceil().max(1.0);
        (patch.width, patch.height) = (columns + 2, rows as usize + 2);
        patch.texel_to_patch = [[1.0 / d, 0.0, -1.0 / d], [0.0, -1.0 / d, (rows + 1.0) / d]];
    }
    let images = sample(&s.mesh, &layout, &s.log_scale, laid.origin);
    Laid {
        layout,
        images,
        origin: laid.origin,
    }
}

/// Where texels are wider than a patch there is only its border: still a surface of the right topology, and no face is flipped. A
/// patch that meets itself has edges from a vertex to itself there, which get a vertex in their middle.
#[test]
fn patches_thinner_than_a_texel() {
    let samples = [
        samples::square(9),
        samples::ramp(60, 6, 6.0),
        cylinder(90, 20),
        annulus(60, 8, 0.3),
    ];
    for s in &samples {
        let laid = lay(s, 3000);
        for columns in [1, 2, 3, 5, 8, 13] {
            let coarse = coarsen(s, &laid, columns);
            let mesh = rebuild(&coarse.images()).unwrap();
            let (v, e, f, loops) = count(&mesh);
            let expected = s.mesh.connectivity.topology();
            let chi = v as i64 - e as i64 + f as i64;
            assert_eq!(
                (chi, loops),
                (expected.euler_characteristic, expected.boundary_loops)
            );
            for uv in &mesh.patch_uv {
                assert!(doubled_area(*uv) > 0.0, "{columns}: flipped {uv:?}");
            }
        }
    }
}

/// Two vertices of the surface at one point stay two.
#[test]
fn vertices_at_one_point_stay_apart() {
    let mut s = cylinder(40, 10);
    // The cylinder is pinched: its two boundary circles touch each other in one point.
    let n = s.mesh.positions.len();
    let (a, b) = (20 * 11, 20 * 11 + 10);
    assert!(b < n);
    let p = s.mesh.positions.as_slice()[a];
    s.mesh.positions.as_mut_slice()[b] = p;
    let mesh = rebuild(&lay(&s, 2000).images()).unwrap();
    let (.., loops) = count(&mesh);
    assert_eq!((mesh.topology.euler_characteristic, loops), (0, 2));
}

/// Whatever is damaged, the answer is a surface or a reason.
#[test]
fn damaged_images_and_seams_never_panic() {
    let sources = [
        samples::ramp(30, 4, 5.0),
        cylinder(30, 8),
        annulus(30, 5, 0.4),
    ];
    let mut state = 11u64;
    let mut random = move |bound: usize| {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % bound.max(1)
    };
    let (mut made, mut refused) = (0, 0);
    for s in &sources {
        let whole = lay(s, 600);
        for _ in 0..250 {
            let mut layout = whole.layout.clone();
            let mut images = whole.images.clone();
            let extremes = [f64::NAN, f64::INFINITY, 1e300, -1.0, 0.0, 1e-300, 0.5];
            for _ in 0..1 + random(3) {
                let seam = random(layout.seams.len());
                let patch = random(layout.patches.len());
                let texel = random(images[patch].alpha.len());
                let seams = layout.seams.len();
                let chain = &mut layout.seams[seam];
                if chain.samples.is_empty() {
                    continue;
                }
                let sample = random(chain.samples.len());
                match random(12) {
                    0 => chain.samples[sample].left[random(2)] = extremes[random(7)],
                    1 => chain.samples[sample].right[random(2)] = extremes[random(7)],
                    2 => chain.samples[sample].position[random(3)] = extremes[random(7)],
                    3 => chain.samples[sample].left[random(2)] += 0.2,
                    4 => chain.samples.truncate(sample),
                    5 => chain.samples.reverse(),
                    6 => chain.right = None,
                    7 => chain.left = crate::geometry::ids::PatchId::new(random(4)),
                    8 => drop(layout.seams.remove(random(seams))),
                    9 => images[patch].alpha[texel..].fill([0.0, 1.0, f32::NAN][random(3)]),
                    10 => layout.patches[patch].texel_to_patch[random(2)][random(3)] *= 3.0,
                    _ => images[patch].position[texel][random(3)] = f32::NAN,
                }
                if layout.seams.is_empty() {
                    break;
                }
            }
            match rebuild(&Images::new(&layout, &images, whole.origin)) {
                Ok(mesh) => {
                    count(&mesh);
                    made += 1;
                }
                Err(error) => {
                    assert!(error.to_string().len() < 400, "{error}");
                    refused += 1;
                }
            }
        }
    }
    assert!(made > 50 && refused > 200, "{made} made, {refused} refused");
}
