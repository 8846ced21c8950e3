//! Prescribed boundaries: rectangles, uniform curvature.

use crate::arrays::array;
use crate::command::{build, document, verify};
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

/// Four given corners, and straight sides between them: the disk becomes a rectangle.
#[test]
fn a_disk_becomes_a_rectangle_with_the_corners_given() {
    // Four boundary vertices of the file, found from a build with a free boundary.
    let free = build(&disk(), &[]);
    let source: Vec<u32> = array(&free.atlas(), "source_vertex");
    let rim = outline(&free.atlas());
    let quarter = rim.len() / 4;
    let given: Vec<u32> = (0..4)
        .map(|i| source[rim[i * quarter].0 as usize])
        .collect();
    let tables: Vec<String> = given.iter().map(|v| format!("{{vertex={v}}}")).collect();
    let corners = format!("boundary.corners=[{}]", tables.join(","));

    let built = build(&disk(), &["boundary.condition=corners", &corners]);
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
    assert_eq!(document(&atlas)["metric"]["boundary"], "corners");
    assert_eq!(document(&atlas)["flags"]["seamless"], true);
}

#[test]
fn corners_are_chosen_where_none_are_given() {
    let built = build(&disk(), &["boundary.condition=corners"]);
    verify(&built.atlas());
    let turns = turns(&outline(&built.atlas()));
    let corners = turns
        .iter()
        .filter(|(_, turn)| (turn - 0.5 * PI).abs() < 1e-8);
    let straight = turns.iter().filter(|(_, turn)| turn.abs() < 1e-8);
    assert_eq!(corners.count(), 4);
    assert_eq!(straight.count(), turns.len() - 4);
}

/// Fig. 9: the same curvature at each of the m boundary vertices, 2π together.
#[test]
fn a_uniform_boundary_turns_the_same_everywhere() {
    let built = build(&disk(), &["boundary.condition=uniform"]);
    verify(&built.atlas());
    let turns = turns(&outline(&built.atlas()));
    let share = 2.0 * PI / turns.len() as f64;
    for (vertex, turn) in turns {
        assert!((turn - share).abs() < 1e-8, "{turn} at {vertex}");
    }
}

/// Cones of fractions of π by vertex and by point on a disk with corners: −1/3 and 1/3 cancel.
#[test]
fn cones_inside_a_rectangle() {
    let cones = "cones.list=[{vertex=1100,curvature=\"1/3\"},{point=[0,0,9],curvature=\"-1/3\"}]";
    let built = build(&disk(), &["boundary.condition=corners", cones]);
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
    let built = build(rabbit, &[totals]);
    let atlas = built.atlas();
    verify(&atlas);
    assert_eq!(document(&atlas)["metric"]["boundary"], "uniform");
    let target: Vec<f64> = array(&atlas, "target_curvature");
    let sum: f64 = target.iter().sum();
    assert!((sum + 2.0 * PI).abs() < 1e-9, "{sum}");
    let missed = build(rabbit, &["boundary.totals=[0,\"-1/2\",-1]"]);
    assert_eq!(missed.code(), Some(1));
    insta::assert_snapshot!(missed.message(), @"failed: three-boundaries-rabbit (prescription): the prescribed curvatures sum to -1.5π (-4.712388980 rad), but Gauss–Bonnet requires 2πχ = -2π (-6.283185307 rad) on a surface with χ = -1 (genus 0, 3 boundary loops): change the total by -0.5π");
}
