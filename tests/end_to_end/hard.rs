//! Degenerate and extreme meshes: each is built and passes `verify`, or is refused for a reason of its own; nothing panics, and nothing wrong
//! is published.

use affine_atlas::config::Config;
use affine_atlas::flow::cones::ConeStrategy;
use affine_atlas::flow::ricci::Solver;
use affine_atlas::flow::schemes::Scheme;
use affine_atlas::job;
use affine_atlas::outcome::FailureKind;
use affine_atlas::verify::{VerifyOptions, verify};

#[path = "../hard/shapes.rs"]
mod shapes;

use shapes::{
    Faces, Points, bipyramid, cusp, fan, flattened, moved, noisy, of_two_sizes, one_far, polygon,
    random_positions, triangle, two_tetrahedra_at_an_edge, with_needles, write,
};

fn configurations() -> Vec<(&'static str, Config)> {
    let mut base = Config::default();
    base.pictures.enabled = false;
    base.report.enabled = false;
    base.patches.texel_budget = 4096;
    let with = |change: &dyn Fn(&mut Config)| {
        let mut config = base.clone();
        change(&mut config);
        config
    };
    vec![
        ("defaults", base.clone()),
        (
            "gradient",
            with(&|c| {
                c.flow.solver = Solver::Gradient;
                c.flow.max_gradient_steps = 3000;
            }),
        ),
        ("no flips", with(&|c| c.flow.delaunay = false)),
        ("thurston", with(&|c| c.flow.scheme = Scheme::Thurston)),
        ("single", with(&|c| c.cones.strategy = ConeStrategy::Single)),
        ("narrow range", with(&|c| c.patches.log_scale_range = 0.01)),
    ]
}

/// Builds a mesh with every configuration; gives how many of them were built.
fn tried(name: &str, mesh: (Points, Faces)) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    write(&path, &mesh);
    let mut built = 0;
    for (which, config) in configurations() {
        let out = folder.path().join(which);
        let outcome = job::run(&path, "mesh.obj", &out, "mesh", &config, &());
        for (_, failure) in outcome.failures() {
            assert_ne!(
                failure.kind,
                FailureKind::Internal,
                "{name}, {which}: {}",
                failure.message
            );
        }
        if outcome.state_name() == "built" {
            built += 1;
            let verdicts = verify(&out.join("mesh"), &VerifyOptions::default()).unwrap();
            assert!(verdicts.all_passed(), "{name}, {which}: {verdicts}");
        }
    }
    built
}

/// Meshes that the defaults build, and perhaps other settings.
#[test]
fn what_can_be_built_is_built() {
    let meshes = [
        ("flattened by 1e-8", flattened(1e-8)),
        ("noisy", noisy(0.5)),
        ("needles of 1e-6", with_needles(1e-6)),
        ("cusp over 2^12", cusp(12)),
        ("fan", fan(300)),
        ("polygon", polygon(300)),
        ("bipyramid", bipyramid(300)),
        ("one far vertex", one_far(1e4)),
        ("far from the origin", moved(1e8)),
        ("two sizes", of_two_sizes()),
        ("two tetrahedra", two_tetrahedra_at_an_edge()),
        ("triangle", triangle(1.0)),
    ];
    for (name, mesh) in meshes {
        assert!(tried(name, mesh) > 0, "{name}");
    }
}

/// Meshes of which nothing is asked but that no wrong atlas is published.
#[test]
fn nothing_wrong_is_published() {
    let meshes = [
        ("flattened by 1e-12", flattened(1e-12)),
        ("flat", flattened(0.0)),
        ("very noisy", noisy(4.0)),
        ("needles of 1e-12", with_needles(1e-12)),
        ("cusp over 2^300", cusp(300)),
        ("one vertex beyond", one_far(1e18)),
        ("too far from the origin", moved(1e12)),
        ("random positions", random_positions()),
        ("needle", triangle(1e-12)),
    ];
    for (name, mesh) in meshes {
        tried(name, mesh);
    }
}

/// Fans of very many needles: all of them meet in one point, so that whoever compares them pair by pair does not come to an end.
#[test]
fn tens_of_thousands_of_needles_at_one_vertex_are_built() {
    let folder = tempfile::tempdir().unwrap();
    let (_, config) = configurations().swap_remove(0);
    for (name, mesh) in [("fan", fan(30_000)), ("polygon", polygon(30_000))] {
        let path = folder.path().join(format!("{name}.obj"));
        write(&path, &mesh);
        let outcome = job::run(&path, name, folder.path(), name, &config, &());
        let messages: Vec<String> = outcome.failures().map(|f| f.1.message.clone()).collect();
        assert_eq!(outcome.state_name(), "built", "{name}: {messages:?}");
        let verdicts = verify(&folder.path().join(name), &VerifyOptions::default()).unwrap();
        assert!(verdicts.all_passed(), "{name}: {verdicts}");
    }
}

/// The overlay of two fans of n needles has n² vertices: it is refused before it is made.
#[test]
fn triangulations_that_cross_too_often_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (_, mut config) = configurations().swap_remove(0);
    config.cones.strategy = ConeStrategy::Spread;
    config.cones.count = Some(4);
    let path = folder.path().join("bipyramid.obj");
    write(&path, &bipyramid(7000));
    let outcome = job::run(&path, "bipyramid", folder.path(), "bipyramid", &config, &());
    let failures: Vec<_> = outcome.failures().collect();
    assert_eq!(failures.len(), 1);
    let failure = failures[0].1;
    assert_eq!(failure.kind, FailureKind::Input, "{}", failure.message);
    for words in [
        "21000 edges",
        "times (most: 700000)",
        "divide the long faces",
    ] {
        assert!(failure.message.contains(words), "{}", failure.message);
    }
}
