//! Prescribed boundaries: rectangles, uniform curvature, single vertices.

use crate::command::{build_small, document, verify};
use crate::real_models::arrays::array;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

fn disk() -> PathBuf {
    PathBuf::from("fixtures/good/disk-mask.obj")
}

/// The chart's corner coordinates along the only boundary loop, in order, with the vertex of each.
fn outline(atlas: &Path) -> Vec<(u32, [f64; 2])> {
    let faces: Vec<u32> = array(atlas, "faces");
    let uv: Vec<f64> = array(atlas, "central_uv");
    let edges: Vec<[usize; 2]> = (0..faces.len() / 3)
        .flat_map(|f| (0..3).map(move |k| [3 * f + k, 3 * f + (k + 1) % 3]))
        .collect();
    let ends = |e: &[usize; 2]| (faces[e[0]], faces[e[1]]);
    let known: std::collections::BTreeSet<(u32, u32)> = edges.iter().map(ends).collect();
    let next: BTreeMap<u32, (u32, usize)> = edges
        .iter()
        .filter(|e| !known.contains(&(faces[e[1]], faces[e[0]])))
        .map(|e| (faces[e[0]], (faces[e[1]], e[0])))
        .collect();
    let first = *next.keys().next().expect("a boundary");
    let mut outline = Vec::new();
    let mut vertex = first;
    loop {
        let (following, corner) = next[&vertex];
        outline.push((vertex, [uv[2 * corner], uv[2 * corner + 1]]));
        vertex = following;
        if vertex == first {
            assert_eq!(outline.len(), next.len(), "more than one loop");
            return outline;
        }
    }
}

/// Exterior angle at every boundary vertex of the developed outline.
fn turns(outline: &[(u32, [f64; 2])]) -> Vec<(u32, f64)> {
    let n = outline.len();
    let edge = |i: usize| {
        let (a, b) = (outline[i % n].1, outline[(i + 1) % n].1);
        [b[0] - a[0], b[1] - a[1]]
    };
    (0..n)
        .map(|i| {
            let (d, e) = (edge(i + n - 1), edge(i));
            let turn = (d[0] * e[1] - d[1] * e[0]).atan2(d[0] * e[0] + d[1] * e[1]);
            (outline[i].0, turn)
        })
        .collect()
}

/// Vertices of the file along the only boundary loop, in order; those that flips put there are left out.
fn rim(atlas: &Path) -> Vec<u32> {
    let source: Vec<u32> = array(atlas, "source_vertex");
    let along = outline(atlas).into_iter();
    along
        .map(|(v, _)| source[v as usize])
        .filter(|&v| v != u32::MAX)
        .collect()
}

/// The sides of a developed polygon: from each vertex that turns to the next, with the points on the way.
fn sides(atlas: &Path) -> Vec<Vec<[f64; 2]>> {
    let outline = outline(atlas);
    let n = outline.len();
    let turns = turns(&outline);
    let corners: Vec<usize> = (0..n).filter(|&i| turns[i].1.abs() > 1e-3).collect();
    (0..corners.len())
        .map(|c| {
            let (from, to) = (corners[c], corners[(c + 1) % corners.len()]);
            let steps = (to + n - from - 1) % n + 1;
            (0..=steps).map(|i| outline[(from + i) % n].1).collect()
        })
        .collect()
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Every side is a straight line, walked forwards; `slack` is a length. The vectors of the sides.
fn straight(sides: &[Vec<[f64; 2]>], slack: f64) -> Vec<[f64; 2]> {
    let vector = |side: &Vec<[f64; 2]>| {
        let (first, last) = (side[0], side[side.len() - 1]);
        let along = minus(last, first);
        let length = dot(along, along).sqrt();
        for pair in side.windows(2) {
            assert!(dot(minus(pair[1], pair[0]), along) > 0.0, "folded");
        }
        for &p in side {
            let off = cross(along, minus(p, first)).abs() / length;
            assert!(off <= slack, "{off:e} off the line, {slack:e} allowed");
        }
        along
    };
    sides.iter().map(vector).collect()
}

fn diameter(sides: &[Vec<[f64; 2]>]) -> f64 {
    let ends: Vec<[f64; 2]> = sides.iter().map(|s| s[0]).collect();
    let far = |p: &[f64; 2]| {
        let distances = ends.iter().map(|q| minus(*p, *q));
        distances.map(|d| dot(d, d).sqrt()).fold(0.0, f64::max)
    };
    ends.iter().map(far).fold(0.0, f64::max)
}

/// Four straight sides, opposite ones parallel and equal, adjacent ones perpendicular, to 1e-8 of the diameter.
fn assert_rectangle(atlas: &Path) {
    assert_eq!(document(atlas)["segments"], serde_json::json!([]), "a cut");
    let sides = sides(atlas);
    assert_eq!(sides.len(), 4);
    let slack = 1e-8 * diameter(&sides);
    let along = straight(&sides, slack);
    for i in 0..4 {
        let (side, next, opposite) = (along[i], along[(i + 1) % 4], along[(i + 2) % 4]);
        // Lengths by which the far end of one side misses where the other says it lies.
        let size = |v: [f64; 2]| dot(v, v).sqrt();
        assert!(cross(side, opposite).abs() / size(side) <= slack);
        assert!(dot(side, next).abs() / size(side) <= slack);
        assert!((size(side) - size(opposite)).abs() <= slack);
        assert!(cross(side, next) > 0.0);
    }
}

/// Three corners of π/3 each are an equilateral triangle, whatever the disk; a fourth listed vertex of 0 changes nothing.
#[test]
fn a_disk_becomes_an_equilateral_triangle() {
    let rim = rim(&build_small(&disk(), &[]).atlas());
    let at = |i: usize| rim[i * rim.len() / 5];
    let list = format!(
        "boundary.list=[{{vertex={},curvature=\"2/3\"}},{{vertex={},curvature=\"2/3\"}},{{vertex={},curvature=\"2/3\"}},{{vertex={},curvature=0}}]",
        at(0),
        at(1),
        at(3),
        at(4)
    );
    let built = build_small(&disk(), &[&list]);
    verify(&built.atlas());
    assert_eq!(document(&built.atlas())["metric"]["boundary"], "prescribed");
    let sides = sides(&built.atlas());
    assert_eq!(sides.len(), 3);
    let slack = 1e-8 * diameter(&sides);
    let along = straight(&sides, slack);
    let length = along.iter().map(|&v| dot(v, v).sqrt());
    let length: Vec<f64> = length.collect();
    for l in &length {
        assert!((l - length[0]).abs() <= slack, "{length:?}");
    }
}

/// One corner of π/2 is listed, and a dent of −π/3; all others turn by the same, so that the whole is 2π.
#[test]
fn boundary_vertices_that_are_not_listed_share_the_rest() {
    let rim = rim(&build_small(&disk(), &[]).atlas());
    let (corner, dent) = (rim[0], rim[rim.len() / 2]);
    let list = format!(
        "boundary.list=[{{vertex={corner},curvature=0.5}},{{vertex={dent},curvature=\"-1/3\"}}]"
    );
    let built = build_small(&disk(), &[&list]);
    let atlas = built.atlas();
    verify(&atlas);
    let source: Vec<u32> = array(&atlas, "source_vertex");
    let share = (2.0 - 0.5 + 1.0 / 3.0) * PI / (rim.len() - 2) as f64;
    for (vertex, turn) in turns(&outline(&atlas)) {
        let expected = match source[vertex as usize] {
            v if v == corner => 0.5 * PI,
            v if v == dent => -PI / 3.0,
            u32::MAX => 0.0,
            _ => share,
        };
        assert!((turn - expected).abs() < 1e-8, "{turn} at {vertex}");
    }
}

/// Four given corners, and straight sides between them: the disk becomes a rectangle.
#[test]
fn a_disk_becomes_a_rectangle_with_the_corners_given() {
    // Four boundary vertices of the file, found from a build with a free boundary.
    let free = build_small(&disk(), &[]);
    let rim = rim(&free.atlas());
    let given: Vec<u32> = (0..4).map(|i| rim[i * (rim.len() / 4)]).collect();
    let tables: Vec<String> = given.iter().map(|v| format!("{{vertex={v}}}")).collect();
    let corners = format!("boundary.corners=[{}]", tables.join(","));

    let built = build_small(&disk(), &["boundary.condition=corners", &corners]);
    let atlas = built.atlas();
    verify(&atlas);
    let source: Vec<u32> = array(&atlas, "source_vertex");
    let mut turned = Vec::new();
    for (vertex, turn) in turns(&outline(&atlas)) {
        if turn.abs() > 1e-6 {
            assert!((turn - 0.5 * PI).abs() < 1e-8, "{turn} at {vertex}");
            turned.push(source[vertex as usize]);
        }
    }
    turned.sort_unstable();
    let mut given = given;
    given.sort_unstable();
    assert_eq!(turned, given);
    assert_rectangle(&atlas);
    assert_eq!(document(&atlas)["metric"]["boundary"], "corners");
    assert_eq!(document(&atlas)["flags"]["seamless"], true);
}

#[test]
fn corners_are_chosen_where_none_are_given() {
    let built = build_small(&disk(), &["boundary.condition=corners"]);
    verify(&built.atlas());
    let turns = turns(&outline(&built.atlas()));
    let corners = turns
        .iter()
        .filter(|(_, turn)| (turn - 0.5 * PI).abs() < 1e-8);
    let straight = turns.iter().filter(|(_, turn)| turn.abs() < 1e-8);
    assert_eq!(corners.count(), 4);
    assert_eq!(straight.count(), turns.len() - 4);
    assert_rectangle(&built.atlas());
}

/// The shape decides the ratio of the sides and nothing else: with every scheme it is a rectangle.
#[test]
fn a_rectangle_of_circles() {
    let corners = ["boundary.condition=corners", "flow.scheme=tangential"];
    let built = build_small(&disk(), &corners);
    verify(&built.atlas());
    assert_rectangle(&built.atlas());
}

/// Two models of other people.
#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn real_disks_become_rectangles() {
    let Some(corpus) = std::env::var_os("AFFINE_ATLAS_CORPUS") else {
        return;
    };
    for name in ["face.obj", "lilium.obj"] {
        let built = build_small(
            &Path::new(&corpus).join(name),
            &["boundary.condition=corners"],
        );
        verify(&built.atlas());
        assert_rectangle(&built.atlas());
    }
}

/// Fig. 9: the same curvature at each of the m boundary vertices of the file, 2π together.
#[test]
fn a_uniform_boundary_turns_the_same_everywhere() {
    let built = build_small(&disk(), &["boundary.condition=uniform"]);
    verify(&built.atlas());
    let source: Vec<u32> = array(&built.atlas(), "source_vertex");
    let share = 2.0 * PI / rim(&built.atlas()).len() as f64;
    for (vertex, turn) in turns(&outline(&built.atlas())) {
        let new = source[vertex as usize] == u32::MAX;
        let expected = if new { 0.0 } else { share };
        assert!((turn - expected).abs() < 1e-8, "{turn} at {vertex}");
    }
}

/// Cones of fractions of π by vertex and by point on a disk with corners: −1/3 and 1/3 cancel.
#[test]
fn cones_inside_a_rectangle() {
    let cones = "cones.list=[{vertex=1100,curvature=\"1/3\"},{point=[0,0,9],curvature=\"-1/3\"}]";
    let built = build_small(&disk(), &["boundary.condition=corners", cones]);
    let atlas = built.atlas();
    verify(&atlas);
    let document = document(&atlas);
    let given = document["cones"].as_array().expect("a list");
    let mut curvature: Vec<f64> = given
        .iter()
        .filter_map(|cone| cone["curvature"].as_f64())
        .filter(|k| (k.abs() - PI / 3.0).abs() < 1e-12)
        .collect();
    curvature.sort_by(f64::total_cmp);
    assert_eq!(curvature.len(), 2, "{given:?}");
    assert!(curvature[0] < 0.0 && curvature[1] > 0.0);
}

/// One loop of the rabbit takes everything that the Euler characteristic asks for.
#[test]
fn totals_loop_by_loop() {
    let rabbit = Path::new("fixtures/good/three-boundaries-rabbit.ply");
    let totals = "boundary.totals=[0,\"-1/2\",-1.5]";
    let built = build_small(rabbit, &[totals]);
    let atlas = built.atlas();
    verify(&atlas);
    assert_eq!(document(&atlas)["metric"]["boundary"], "uniform");
    let target: Vec<f64> = array(&atlas, "target_curvature");
    let sum: f64 = target.iter().sum();
    assert!((sum + 2.0 * PI).abs() < 1e-9, "{sum}");
    let too_little = "boundary.totals=[0,\"-1/2\",-1]";
    let missed = build_small(rabbit, &[too_little, "cones.strategy=none"]);
    assert_eq!(missed.code(), Some(1));
    insta::assert_snapshot!(missed.message(), @"failed: three-boundaries-rabbit (prescription): the prescribed curvatures sum to -1.5π (-4.712388980 rad), but Gauss–Bonnet requires 2πχ = -2π (-6.283185307 rad) on a surface with χ = -1 (genus 0, 3 boundary loops): change the total by -0.5π");
    // Unless cones are ruled out, one takes what is missing.
    let filled = build_small(rabbit, &[too_little]);
    verify(&filled.atlas());
    let target: Vec<f64> = array(&filled.atlas(), "target_curvature");
    let sum: f64 = target.iter().sum();
    assert!((sum + 2.0 * PI).abs() < 1e-9, "{sum}");
    let missing = |k: &&f64| (**k + 0.5 * PI).abs() < 1e-9;
    assert_eq!(target.iter().filter(missing).count(), 1);
}
