//! Curvature that cannot be prescribed, as the configuration says it.

use crate::command::{build_small, document, verify};
use std::path::Path;

fn refusal(fixture: &str, settings: &[&str]) -> String {
    let built = build_small(Path::new(&format!("fixtures/good/{fixture}")), settings);
    assert_eq!(built.code(), Some(1), "{}", built.message());
    assert!(built.atlases().is_empty());
    built.message()
}

#[test]
fn a_cone_named_twice() {
    let list = "cones.list=[{vertex=3,curvature=1},{vertex=9,curvature=1},{vertex=3,curvature=2}]";
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &[list]), @"failed: genus-0-cube (prescription): vertex 3 is named twice: remove one of the entries");
    // The nearest vertex to the point is vertex 0.
    let list = "cones.list=[{vertex=0,curvature=1},{point=[-9,-9,-9],curvature=1}]";
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &[list]), @"failed: genus-0-cube (prescription): vertex 0 is named twice: remove one of the entries");
}

#[test]
fn a_cone_beyond_the_last_vertex() {
    let list = "cones.list=[{vertex=56,curvature=1}]";
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &[list]), @"failed: genus-0-cube (prescription): cones.list[0] names vertex 56, but the file has 56 vertices (0 to 55): correct the index");
}

#[test]
fn a_cone_on_a_free_boundary() {
    // The point is far outside, so the nearest vertex lies on the rim.
    let list = "cones.list=[{point=[-99,0,0],curvature=\"1/2\"}]";
    insta::assert_snapshot!(refusal("disk-mask.obj", &[list]), @"failed: disk-mask (prescription): vertex 1917 lies on a free boundary, where no curvature can be prescribed: move the cone inside, or give it in boundary.list");
}

#[test]
fn no_angle_left() {
    let list = "cones.list=[{vertex=3,curvature=2},{vertex=9,curvature=1},{vertex=20,curvature=1}]";
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &[list]), @"failed: genus-0-cube (prescription): vertex 3 has curvature 2π (6.283185 rad), but in the interior it must be less than 2π (6.283185 rad), so that an angle remains: lower it or spread it over more cones");
}

#[test]
fn fewer_than_three_cones_on_a_sphere() {
    let list = "cones.list=[{vertex=3,curvature=\"3/2\"},{vertex=9,curvature=\"3/2\"}]";
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &[list]), @"failed: genus-0-cube (prescription): a closed surface of genus 0 needs at least 3 cones, because each has less than 2π of the 4π required, but 2 were given: add cones");
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &["cones.strategy=none"]), @r#"failed: genus-0-cube (prescription): a closed surface of genus 0 (χ = 2) needs cones of total curvature 4π, but there are none: set cones.strategy = "auto" or "spread", or list cones"#);
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &["cones.strategy=single"]), @r#"failed: genus-0-cube (prescription): a single cone would need curvature 4π (2πχ with χ = 2, less what the boundary takes), but a cone has less than 2π: set cones.strategy = "spread""#);
}

#[test]
fn totals_that_miss_gauss_bonnet() {
    let list = "cones.list=[{vertex=3,curvature=\"1/2\"},{vertex=9,curvature=\"1/2\"},{vertex=20,curvature=\"2/3\"}]";
    insta::assert_snapshot!(refusal("genus-0-cube.obj", &[list]), @"failed: genus-0-cube (prescription): the prescribed curvatures sum to 5/3π (5.235987756 rad), but Gauss–Bonnet requires 2πχ = 4π (12.566370614 rad) on a surface with χ = 2 (genus 0, 0 boundary loops): change the total by 7/3π");
    let list = "cones.list=[{vertex=3,curvature=-4.5}]";
    insta::assert_snapshot!(refusal("genus-2-amphora.glb", &[list]), @"failed: genus-2-amphora (prescription): the prescribed curvatures sum to -4.5π (-14.137166941 rad), but Gauss–Bonnet requires 2πχ = -4π (-12.566370614 rad) on a surface with χ = -2 (genus 2, 0 boundary loops): change the total by 0.5π");
}

#[test]
fn corners_where_there_is_no_disk() {
    let corners = "boundary.condition=corners";
    insta::assert_snapshot!(refusal("three-boundaries-rabbit.ply", &[corners]), @r#"failed: three-boundaries-rabbit (prescription): boundary.condition = "corners" needs a disk (genus 0, 1 boundary loop), but the component has genus 0 and 3 boundary loops: use "free", "uniform" or "prescribed""#);
}

/// (6) at one vertex: Φ ≡ 0 asks for enough faces around a strong cone, and repair may be forbidden.
#[test]
fn a_packing_that_cannot_exist() {
    let settings = [
        "cones.strategy=single",
        "connectivity.enabled=false",
        "flow.scheme=tangential",
    ];
    let message = refusal("genus-3-pretzel.obj", &settings);
    assert!(message.contains("(prescription)"), "{message}");
    // Both sides of the inequality, and what to do.
    for part in ["circle packing", "(6)", "-4π", "-8π", "vertex-scaling"] {
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn a_triangle_inequality_that_breaks_ends_without_an_atlas() {
    let settings = [
        "cones.strategy=single",
        "flow.scheme=vertex-scaling",
        "flow.delaunay=false",
    ];
    let message = refusal("genus-3-pretzel.obj", &settings);
    assert!(message.contains("(not_converged)"), "{message}");
    assert!(message.contains("face"), "{message}");
    assert!(message.contains("flow.delaunay = true"), "{message}");
}

/// What breaks a packing or a triangle above has a solution with flips, and no split is needed for it.
#[test]
fn all_curvature_at_one_vertex_with_flips() {
    let pretzel = Path::new("fixtures/good/genus-3-pretzel.obj");
    let built = build_small(pretzel, &["cones.strategy=single"]);
    verify(&built.atlas());
    let document = document(&built.atlas());
    assert_eq!(document["connectivity"]["splits"], 0);
    assert_eq!(document["metric"]["scheme"], "vertex-scaling");
    let flips = document["metric"]["flips"].as_u64();
    assert!(flips.is_some_and(|n| n > 0), "{flips:?}");
    let cones = document["cones"].as_array().expect("a list");
    let curvature = cones[0]["curvature"].as_f64().expect("a number");
    assert_eq!(cones.len(), 1);
    assert!((curvature + 8.0 * std::f64::consts::PI).abs() < 1e-9);
}

#[test]
fn boundary_vertices_that_cannot_be() {
    let inside = "boundary.list=[{vertex=1100,curvature=\"1/2\"}]";
    insta::assert_snapshot!(refusal("disk-mask.obj", &[inside]), @"failed: disk-mask (prescription): boundary.list names vertex 1100, which does not lie on the boundary: name a boundary vertex or a point");
    let free = ["boundary.condition=free", inside];
    insta::assert_snapshot!(refusal("disk-mask.obj", &free), @r#"failed: disk-mask (prescription): boundary.list and boundary.condition = "free" exclude each other: remove one of them"#);
    let much = "boundary.list=[{point=[-99,0,0],curvature=1}]";
    insta::assert_snapshot!(refusal("disk-mask.obj", &[much]), @"failed: disk-mask (prescription): vertex 1917 has curvature 1π (3.141593 rad), but on the boundary it must be less than 1π (3.141593 rad), so that an angle remains: lower it or spread it over more cones");
    insta::assert_snapshot!(refusal("disk-mask.obj", &["boundary.condition=prescribed"]), @r#"failed: disk-mask (prescription): boundary.condition is "prescribed", but boundary.list is empty: add boundary vertices or set the condition to "uniform""#);
}

/// The numbers of cones are those of the input file, also where repair renumbers.
#[test]
fn cones_by_vertex_and_point_and_fraction() {
    let mesh = Path::new("fixtures/bad/unreferenced-vertex.off");
    let list = "cones.list=[{vertex=239,curvature=\"4/3\"},{vertex=8,curvature=1.5},{point=[0.1,-9,0],curvature=\"7/6\"}]";
    let built = build_small(mesh, &[list]);
    let document = document(&built.atlas());
    let cones = document["cones"].as_array().expect("a list");
    let curvature = |vertex: u64| {
        let cone = cones.iter().find(|c| c["source_vertex"] == vertex);
        let cone = cone.unwrap_or_else(|| panic!("no cone at {vertex}: {cones:?}"));
        cone["curvature"].as_f64().expect("a number") / std::f64::consts::PI
    };
    assert_eq!(cones.len(), 3);
    assert!((curvature(239) - 4.0 / 3.0).abs() < 1e-15);
    assert!((curvature(8) - 1.5).abs() < 1e-15);
    let sum: f64 = cones.iter().filter_map(|c| c["curvature"].as_f64()).sum();
    assert!((sum - 4.0 * std::f64::consts::PI).abs() < 1e-9);
    // The vertex nearest to the point, by brute force over the file.
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/bad/unreferenced-vertex.off"),
    );
    let text = text.expect("committed");
    let rows = text
        .lines()
        .filter(|l| !l.starts_with('#') && !l.is_empty());
    let rows = rows.skip_while(|l| l.starts_with("OFF")).skip(1);
    let far = |row: &str| {
        let p: Vec<f64> = row.split_whitespace().flat_map(str::parse).collect();
        (p[0] - 0.1).hypot(p[1] + 9.0).hypot(p[2])
    };
    let distances = rows.take(241).map(far).enumerate();
    // Vertex 7 belongs to no face.
    let nearest = distances
        .filter(|(v, _)| *v != 7)
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let nearest = nearest.expect("241 vertices").0 as u64;
    assert!((curvature(nearest) - 7.0 / 6.0).abs() < 1e-15);
}
