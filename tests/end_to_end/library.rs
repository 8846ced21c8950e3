//! The library in a program of one's own: from memory to memory, nothing on disk.

use affine_atlas::config::Config;
use affine_atlas::geometry::mesh::Soup;
use affine_atlas::job::BuildError;
use affine_atlas::observe::Observer;
use affine_atlas::outcome::FailureKind;
use affine_atlas::{build, spline};
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A torus with radii 3 and 1.
fn torus() -> Soup {
    let (m, n) = (36u32, 18u32);
    let at = |i: u32, count: u32| TAU * f64::from(i) / f64::from(count);
    let points = (0..m).flat_map(|i| (0..n).map(move |j| [i, j]));
    let points = points.map(|[i, j]| {
        let (u, v) = (at(i, m), at(j, n));
        let r = 3.0 + v.cos();
        [r * u.cos(), r * u.sin(), v.sin()]
    });
    let vertex = |i: u32, j: u32| (i % m) * n + j % n;
    let squares = (0..m).flat_map(|i| (0..n).map(move |j| [i, j]));
    let faces = squares.flat_map(|[i, j]| {
        let [a, b] = [vertex(i, j), vertex(i + 1, j)];
        let [c, d] = [vertex(i + 1, j + 1), vertex(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Soup::from_triangles(points.collect(), faces.collect())
}

#[test]
fn a_spline_of_an_atlas_in_memory_is_near_the_surface() {
    let mut config = Config::default();
    config.grid.cells = 300;
    let atlases = build(&torus(), &config, &()).expect("the torus is a surface");
    let atlas = atlases[0].as_ref().expect("it is built");
    let gridded = atlas.gridded().expect("it has a grid");
    assert_eq!(gridded.cells.len(), atlas.grid.as_ref().unwrap().cells());
    let spline = spline::fit(&gridded).expect("a surface");
    assert_eq!(spline.shape.turned_over, 0.0);
    spline.with_limit(|limit| {
        for cell in 0..gridded.cells.len() as u32 {
            let [x, y, z] = limit.at(cell, [0.3, 0.8]).point;
            let off = (x.hypot(y) - 3.0).hypot(z) - 1.0;
            assert!(off.abs() < 0.03, "cell {cell} is {off} off");
        }
    });
}

/// Asks to stop once a stage was entered, and counts what it hears after that.
struct Stopping {
    at: &'static str,
    stops: AtomicBool,
    steps: AtomicUsize,
    stages_after: AtomicUsize,
}

impl Observer for Stopping {
    fn stage(&self, name: &'static str, _: usize, _: usize) {
        match self.stops.load(Ordering::Relaxed) {
            true => _ = self.stages_after.fetch_add(1, Ordering::Relaxed),
            false => self.stops.store(name == self.at, Ordering::Relaxed),
        }
    }

    fn flow_step(&self, _: &affine_atlas::flow::ricci::FlowStep) {
        self.steps.fetch_add(1, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.stops.load(Ordering::Relaxed)
    }
}

#[test]
fn a_build_is_stopped_inside_its_long_stages() {
    for at in ["repair", "flow", "grid", "images"] {
        let observer = Stopping {
            at,
            stops: AtomicBool::new(false),
            steps: AtomicUsize::new(0),
            stages_after: AtomicUsize::new(0),
        };
        let error = build(&torus(), &Config::default(), &observer).expect_err(at);
        assert!(matches!(error, BuildError::Cancelled), "{at}: {error}");
        assert_eq!(error.kind(), FailureKind::Cancelled);
        assert_eq!(observer.stages_after.into_inner(), 0, "{at}");
        // The default flow tells its steps.
        let took_steps = observer.steps.into_inner() > 0;
        assert_eq!(took_steps, ["grid", "images"].contains(&at), "{at}");
    }
}

#[test]
fn settings_out_of_range_are_refused_before_anything_is_done() {
    let mut config = Config::default();
    config.grid.samples_per_cell = 0;
    let error = build(&torus(), &config, &()).expect_err("no texel a cell");
    assert_eq!(error.kind(), FailureKind::Prescription);
    let said = error.to_string();
    assert!(said.contains("`grid.samples_per_cell` takes"), "{said}");
}
