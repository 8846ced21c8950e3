use super::super::samples::{Sample, ramp, strip};
use super::super::{PatchLayout, PatchParams, layout};
use crate::atlas::geometry_image::{image_origin, sample};
use crate::geometry::deviation::{Sampling, Triangles, deviation};
use crate::rebuild::{Images, rebuild};
use std::collections::BTreeSet;

fn laid_out(s: &Sample, max_count: Option<usize>) -> PatchLayout {
    let params = PatchParams {
        texel_budget: 64 * 64,
        min_side: 8,
        max_count,
        ..PatchParams::default()
    };
    let development = &s.development;
    layout(&s.mesh, &s.length, &s.cut, development, None, &params).unwrap()
}

#[test]
fn patches_meet_along_a_crease() {
    let s = strip(
        24,
        10,
        |s, t| [(s - 0.5).abs(), t, s],
        |s, t| [std::f64::consts::SQRT_2 * s, t],
        [0.0; 2],
    );
    let layout = laid_out(&s, None);
    let side = |f| s.mesh.face_positions(f).iter().all(|p| p[2] <= 0.5 + 1e-9);
    let patches = s.mesh.connectivity.faces();
    let pairs: BTreeSet<_> = patches.map(|f| (side(f), layout.face_patch[f])).collect();
    assert_eq!(layout.patches.len(), 2);
    assert_eq!(pairs.len(), 2, "{pairs:?}");
}

/// What is promised, against the error of the mesh that is made of the images.
#[test]
fn parts_hold_the_surface_better_with_as_many_texels() {
    let mut bumpy = ramp(60, 40, 1.8);
    for v in bumpy.mesh.connectivity.vertices() {
        let p: &mut [f64; 3] = &mut bumpy.mesh.positions[v];
        p[2] = 0.05 * (9.0 * p[0]).sin() * (8.0 * p[1]).cos();
    }
    let measure = |max_count| {
        let layout = laid_out(&bumpy, max_count);
        let origin = image_origin(&bumpy.mesh, &crate::geometry::frame::Frame::default());
        let images = sample(&bumpy.mesh, &layout, &bumpy.log_scale, origin);
        let texels: usize = images.iter().map(|i| i.width * i.height).sum();
        let made = rebuild(&Images::new(&layout, &images, origin)).unwrap();
        let faces = bumpy.mesh.connectivity.to_faces();
        let given = Triangles {
            positions: bumpy.mesh.positions.as_slice(),
            faces: &faces,
        };
        let made = Triangles {
            positions: &made.positions,
            faces: &made.faces,
        };
        let sampling = Sampling {
            samples: 20_000,
            vertices: 0,
        };
        let found = deviation(given, made, sampling).unwrap();
        (layout.patches.len(), texels as f64, found.rms)
    };
    let (one, two) = (measure(Some(1)), measure(None));
    assert!(one.0 < two.0, "{one:?} {two:?}");
    assert!(two.1 <= 1.05 * one.1, "{one:?} {two:?}");
    assert!(two.2 < 0.8 * one.2, "{one:?} {two:?}");
}
