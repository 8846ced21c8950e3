//! Pictures of small atlases made by hand.

use super::*;
use crate::atlas::charts::Charts;
use crate::atlas::cut::{CutGraph, Segment};
use crate::atlas::develop::Development;
use crate::atlas::geometry_image::ImageParams;
use crate::atlas::patch::Domain;
use crate::atlas::patches::{Patch, PatchLayout};
use crate::atlas::plane::{Similarity, distance};
use crate::flow::cones::{BoundaryCondition, Cone, Prescription};
use crate::flow::refine::ConnectivityRepair;
use crate::flow::ricci::{FlatMetric, FlowParams, FlowStep};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, NONE, PatchId, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use crate::product::{AffineAtlas, Quality};
use image::RgbImage;
use std::f64::consts::TAU;

/// A torus of `n` × `m` quadrilaterals, conformally flat: u, v with radius 1/(√2 − cos v) times e^(k sin u) in flat
/// units, so that `k` sets how much cells vary. Cut along both generators; two patches.
fn torus(n: u32, m: u32, k: f64) -> AffineAtlas {
    let position = |i: u32, j: u32| {
        let (u, v) = (
            TAU * f64::from(i) / f64::from(n),
            TAU * f64::from(j) / f64::from(m),
        );
        let w = 1.0 / (2.0_f64.sqrt() - v.cos());
        [
            w * u.cos(),
            v.sin() * w + 0.12 * (2.0 * u).sin(),
            w * u.sin(),
        ]
    };
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let (mut faces, mut uv) = (Vec::new(), Vec::new());
    for i in 0..n {
        for j in 0..m {
            let corners = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)];
            let plane = |(i, j): (u32, u32)| {
                let x = TAU * f64::from(i) / f64::from(n);
                let y = TAU * f64::from(j) / f64::from(m);
                // exp(k (y + i x)) is conformal; k = 0 is the flat torus.
                if k == 0.0 {
                    [y, x]
                } else {
                    let r = (k * y).exp() / k;
                    [r * (k * x).cos(), r * (k * x).sin()]
                }
            };
            for triple in [[0, 1, 2], [0, 2, 3]] {
                faces.push(triple.map(|c: usize| at(corners[c].0, corners[c].1)));
                uv.push(triple.map(|c: usize| plane(corners[c])));
            }
        }
    }
    let connectivity = Connectivity::from_faces(&faces, (n * m) as usize).unwrap();
    let positions: VertexVec<[f64; 3]> = (0..n)
        .flat_map(|i| (0..m).map(move |j| position(i, j)))
        .collect();
    let edges = connectivity.edge_count();
    let mut segment: EdgeVec<u32> = EdgeVec::filled(NONE, edges);
    let mut segments = vec![Segment { halfedges: vec![] }, Segment { halfedges: vec![] }];
    for h in connectivity.halfedges() {
        let [a, b] = [connectivity.tail(h), connectivity.head(h)].map(|v| v.index() as u32);
        let along_u = a % m == 0 && b % m == 0 && b == (a + m) % (n * m);
        let along_v = a / m == 0 && b / m == 0 && b == (a + 1) % m;
        for (s, is) in [along_u, along_v].into_iter().enumerate() {
            if is {
                segment[connectivity.edge(h)] = s as u32;
                segments[s].halfedges.push(h);
            }
        }
    }
    let mut length: EdgeVec<f64> = EdgeVec::filled(0.0, edges);
    for h in connectivity.halfedges() {
        let corners: &[[f64; 2]; 3] = &uv[connectivity.face(h).index()];
        let k = connectivity.corner(h);
        length[connectivity.edge(h)] = distance(corners[k], corners[(k + 1) % 3]);
    }
    let cone = |v: u32, curvature: f64| Cone {
        vertex: VertexId::new(v as usize),
        curvature,
    };
    let vertices = (n * m) as usize;
    let face_count = faces.len();
    let (low, high) = uv
        .iter()
        .flatten()
        .fold(([f64::MAX; 2], [f64::MIN; 2]), |(l, h), p| {
            (
                [l[0].min(p[0]), l[1].min(p[1])],
                [h[0].max(p[0]), h[1].max(p[1])],
            )
        });
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let half = |f: usize| f / (face_count / 2).max(1);
    let patch = |p: usize| Patch {
        domain: Domain::Flat,
        to_chart: Some(Similarity {
            scale: 1.0,
            rotation: 0.0,
            translation: [0.0; 2],
        }),
        width: 64,
        height: 64,
        texel_to_patch: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        packed_scale: 0.48 / extent,
        packed_offset: [
            0.01 + 0.5 * p as f64 - low[0] * 0.48 / extent,
            0.02 - low[1] * 0.48 / extent,
        ],
    };
    AffineAtlas {
        topology: connectivity.topology(),
        prescription: Prescription {
            target: VertexVec::filled(0.0, vertices),
            cones: vec![cone(0, -1.0), cone(m / 2 + 3 * m, 1.0)],
            boundary: BoundaryCondition::Free,
            field: None,
        },
        flow: FlowParams::default(),
        metric: FlatMetric {
            intrinsic: None,
            log_scale: positions.iter().map(|p| p[0]).collect(),
            length,
            curvature: VertexVec::filled(0.0, vertices),
            history: (0..9)
                .map(|i| FlowStep {
                    iteration: i,
                    max_error: 10_f64.powi(-((i * i) as i32) / 5),
                    flow_time: i as f64,
                    ..FlowStep::default()
                })
                .collect(),
            max_curvature_error: 1e-12,
            fit: None,
            opened: None,
            quarter_turns: None,
        },
        cut: CutGraph {
            is_cut: segment.iter().map(|&s| s != NONE).collect(),
            segment,
            segments,
            nodes: vec![VertexId::new(0)],
        },
        central: Development::from_coordinates(
            uv.clone().into(),
            vec![0; 3 * face_count].into(),
            1,
        ),
        charts: Charts {
            charts: vec![],
            transitions: vec![],
            gluings: vec![],
        },
        patches: PatchLayout {
            face_patch: (0..face_count).map(|f| PatchId::new(half(f))).collect(),
            uv: uv.into(),
            patches: vec![patch(0), patch(1)],
            seams: vec![],
            packed: None,
        },
        images: vec![],
        grid: None,
        no_grid: None,
        image_params: ImageParams::default(),
        image_origin: [0.0; 3],
        repair: Default::default(),
        connectivity_repair: ConnectivityRepair::default(),
        quality: Quality::default(),
        repair_log: Default::default(),
        image_distance: None,
        seamless: false,
        mesh: Mesh {
            source_vertex: (0..vertices as u32).collect(),
            source_face: (0..face_count as u32).collect(),
            face_material: vec![NONE; face_count].into(),
            attributes: vec![],
            connectivity,
            positions,
        },
    }
}

/// Every picture of an atlas.
fn all(atlas: &AffineAtlas, size: usize) -> [RgbImage; 4] {
    let [preview, log_scale] = surface(atlas, size);
    [
        preview,
        log_scale,
        layout(atlas, size),
        convergence(atlas, size),
    ]
}

#[test]
fn pictures_have_their_size_and_show_something() {
    let atlas = torus(24, 12, 0.0);
    let [preview, scale, layout, convergence] = all(&atlas, 120);
    assert_eq!(preview.dimensions(), (120, 120));
    assert_eq!(scale.dimensions(), (120, 120));
    assert_eq!(layout.dimensions(), (240, 120));
    assert_eq!(convergence.dimensions(), (120, 75));
    for image in [preview, scale, layout, convergence] {
        let mut colours: Vec<[u8; 3]> = image.pixels().map(|p| p.0).collect();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() > 20, "{}", colours.len());
    }
}

#[test]
fn pictures_do_not_depend_on_the_thread_count() {
    let atlas = torus(20, 10, 0.3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| all(&atlas, 100).map(|image| encode_png(&image).unwrap()))
    };
    let (one, three) = (with(1), with(3));
    assert!(one == three);
    for png in one {
        assert_eq!(&png[1..4], b"PNG");
    }
}

/// Mean lightness of the middle of the surface changes with the checkerboard, so both colours must be there.
#[test]
fn extreme_scales_leave_cells_readable() {
    // Scales from 1 to e^37 over the surface.
    for k in [0.0, 0.5, 2.0, 5.9] {
        let atlas = torus(48, 24, k);
        let [image, _] = surface(&atlas, 200);
        let (mut dark, mut light) = (0, 0);
        for p in image.pixels() {
            let [r, g, b] = p.0.map(i32::from);
            // Dark cells are blue-green, light cells yellowish.
            dark += i32::from(b - r > 25 && g > r);
            light += i32::from(r - b > 6 && r > 120);
        }
        assert!(
            dark > 1000 && light > 1000,
            "k = {k}: {dark} dark, {light} light"
        );
    }
}

#[test]
fn nothing_breaks_on_what_cannot_be_drawn() {
    let mut atlas = torus(6, 5, 0.0);
    atlas.metric.history.clear();
    atlas.metric.max_curvature_error = f64::NAN;
    atlas.flow.curvature_tolerance = 0.0;
    atlas.patches.patches.clear();
    for (f, uv) in atlas.central.uv.as_mut_slice().iter_mut().enumerate() {
        match f % 4 {
            0 => *uv = [[f64::NAN; 2]; 3],
            1 => *uv = [[f64::INFINITY, 0.0]; 3],
            2 => *uv = [[1e300, -1e300]; 3],
            _ => {}
        }
    }
    for p in atlas.mesh.positions.as_mut_slice().iter_mut().step_by(3) {
        *p = [0.0, f64::NAN, f64::INFINITY];
    }
    atlas.metric.log_scale.as_mut_slice()[0] = f64::NAN;
    for size in [0, 70, 500] {
        all(&atlas, size);
    }
    for p in atlas.mesh.positions.as_mut_slice() {
        *p = [0.0; 3];
    }
    all(&atlas, 100);
}

/// Panels of a metric that grows along x, one of twice the scale, and one that is not finite.
fn panels(atlas: &AffineAtlas) -> [Vec<f64>; 3] {
    let along = |k: f64| (atlas.mesh.positions.iter().map(|p| k * p[0])).collect();
    [along(1.0), along(2.0), along(f64::NAN)]
}

fn panel(log_scale: &[f64]) -> Panel<'_> {
    Panel {
        title: vec!["above".to_owned(), "(9) 0.1".to_owned()],
        log_scale,
        cut: &[[[0.0; 3], [1.0, 0.5, 0.0]]],
        cones: vec![([1.0, 0.0, 0.0], 2.0), ([-1.0, 0.0, 0.0], -9.0)],
    }
}

#[test]
fn a_gallery_shows_panels_alike_and_side_by_side() {
    let atlas = torus(24, 12, 0.0);
    let [one, two, none] = panels(&atlas);
    let gallery = Gallery::new(&atlas.mesh, 128);
    let single = gallery.row(&[panel(&one)]);
    let pair = gallery.row(&[panel(&one), panel(&one)]);
    assert_eq!(single.dimensions().0 * 2, pair.dimensions().0);
    assert_eq!(single.dimensions().1, pair.dimensions().1);
    assert!(single.dimensions().1 >= 128 + 2 * 20);
    for (x, y, pixel) in single.enumerate_pixels() {
        assert_eq!(pixel, pair.get_pixel(x, y));
        assert_eq!(pixel, pair.get_pixel(x + 128, y));
    }
    // The same colours mean the same: a wider range beside it makes a panel paler, and itself is the more colourful.
    let mixed = gallery.row(&[panel(&one), panel(&two)]);
    let colour = |image: &RgbImage, from: u32| -> i64 {
        let inside = image
            .enumerate_pixels()
            .filter(|(x, ..)| (from..from + 128).contains(x));
        inside
            .map(|(.., p)| (i64::from(p.0[0]) - i64::from(p.0[2])).abs())
            .sum()
    };
    let [alone, beside, wide] = [colour(&single, 0), colour(&mixed, 0), colour(&mixed, 128)];
    assert!(beside < alone && alone < wide, "{beside} {alone} {wide}");
    // What has no number is drawn without a colour, and nothing breaks.
    gallery.row(&[panel(&one), panel(&none), panel(&[])]);
    gallery.row(&[]);
    let barred = Gallery::new(&atlas.mesh, 320).row(&[panel(&one)]);
    assert!(barred.dimensions().0 > 320);
}

#[test]
fn a_gallery_does_not_depend_on_the_thread_count() {
    let atlas = torus(20, 10, 0.3);
    let [one, two, _] = panels(&atlas);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let gallery = Gallery::new(&atlas.mesh, 100);
            encode_png(&gallery.row(&[panel(&one), panel(&two)])).unwrap()
        })
    };
    assert!(with(1) == with(3));
}
