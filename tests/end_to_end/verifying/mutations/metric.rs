//! Damage to the document, the surface and its flat metric.

use super::*;

pub fn mutations() -> Vec<Mutation> {
    vec![
        mutation!(
            torus,
            "another format",
            |a| a.json["format"] = json!("atlas"),
            ["format"]
        ),
        mutation!(
            torus,
            "a later version",
            |a| a.json["version"] = json!(3),
            ["format"]
        ),
        mutation!(
            torus,
            "a key removed",
            |a| a.json["quality"]
                .as_object_mut()
                .map(|q| q.remove("cut_length")),
            ["atlas.json has every key"]
        ),
        mutation!(
            torus,
            "a list removed",
            |a| a.json["patches"] = json!(null),
            ["atlas.json has every key"]
        ),
        mutation!(
            torus,
            "a number of the wrong type",
            |a| a.json["topology"]["genus"] = json!("one"),
            ["atlas.json's values have their types"]
        ),
        mutation!(
            torus,
            "a segment's id off",
            |a| a.json["segments"][1]["id"] = json!(7),
            ["atlas.json's ids point to its lists"]
        ),
        mutation!(
            torus,
            "an image outside the folder",
            |a| a.json["patches"][0]["image"] = json!("../0000.exr"),
            ["atlas.json's ids point to its lists"]
        ),
        mutation!(
            torus,
            "vertices reversed in one face",
            |a| a.arrays.faces[40].swap(0, 1),
            [
                "Euler characteristic as stated",
                "Gauss-Bonnet",
                "angle error as stated",
                "boundary loops as stated",
                "edges pair up (overlay is a simple mesh)",
                "every patch is connected off the cut",
                "genus as stated",
                "interior curvature is the target",
                "one component",
                "seams run along the surface's boundary",
                "seams sample every vertex of their chains",
                "slit surface connected",
                "target curvature keeps Gauss-Bonnet",
                "texels hold the log scale",
                "texels hold the surface point",
                "vertices are manifold",
                "vertices, edges and faces as stated"
            ]
        ),
        mutation!(
            torus,
            "a face twice",
            |a| {
                let f = a.arrays.faces[3];
                a.arrays.faces[90] = f
            },
            [
                "Euler characteristic as stated",
                "boundary charts cover the inner vertices of their segments",
                "boundary loops as stated",
                "charts cover the surface but its cones",
                "edges pair up (overlay is a simple mesh)",
                "every patch is connected off the cut",
                "genus as stated",
                "interior curvature is the target",
                "log scale as stated",
                "one component",
                "seams run along the surface's boundary",
                "seams sample every vertex of their chains",
                "segments run from node to node",
                "slit surface connected",
                "target curvature keeps Gauss-Bonnet",
                "texels hold the log scale",
                "texels hold the surface point",
                "vertices are manifold",
                "vertices, edges and faces as stated"
            ]
        ),
        mutation!(
            torus,
            "a vertex index out of range",
            |a| a.arrays.faces[5][1] = 9999,
            ["indices stay in range"]
        ),
        mutation!(
            torus,
            "a vertex nobody uses",
            |a| {
                a.arrays.positions.push([3.0, 0.0, 0.0]);
                a.arrays.source_vertex.push(0);
                a.arrays.log_scale.push(0.0);
                a.arrays.target_curvature.push(0.0);
            },
            [
                "Gauss-Bonnet",
                "every vertex used",
                "interior curvature is the target",
                "vertices, edges and faces as stated"
            ]
        ),
        mutation!(
            torus,
            "a NaN position",
            |a| a.arrays.positions[7][1] = f64::NAN,
            ["finite"]
        ),
        mutation!(
            torus,
            "an infinite coordinate",
            |a| a.arrays.central_uv[7][1][0] = f64::INFINITY,
            ["finite"]
        ),
        mutation!(
            torus,
            "another genus",
            |a| a.json["topology"]["genus"] = json!(0),
            ["genus as stated"]
        ),
        mutation!(
            torus,
            "another Euler characteristic",
            |a| a.json["topology"]["euler_characteristic"] = json!(2),
            ["Euler characteristic as stated"]
        ),
        mutation!(
            tube,
            "another number of boundary loops",
            |a| a.json["topology"]["boundary_loops"] = json!(1),
            ["boundary loops as stated"]
        ),
        mutation!(
            tube,
            "another number of edges",
            |a| a.json["topology"]["edges"] = json!(1),
            ["vertices, edges and faces as stated"]
        ),
        mutation!(
            torus,
            "a flat length of one side of an edge",
            |a| a.arrays.flat_length[33][1] *= 1.0 + 1e-6,
            [
                "central chart keeps flat lengths",
                "charts keep flat lengths",
                "interior curvature is the target",
                "one length an edge",
                "patches keep flat lengths at their scale"
            ]
        ),
        mutation!(
            torus,
            "a broken triangle inequality",
            |a| a.arrays.flat_length[33][1] *= 5.0,
            [
                "central chart keeps flat lengths",
                "charts keep flat lengths",
                "interior curvature is the target",
                "log scale as stated",
                "one length an edge",
                "patches keep flat lengths at their scale",
                "triangle inequality",
                "two period vectors tile the plane"
            ]
        ),
        mutation!(
            pillow,
            "a wrong target curvature",
            |a| a.arrays.target_curvature[24] = 1e-6,
            [
                "cones listed",
                "interior curvature is the target",
                "target curvature keeps Gauss-Bonnet"
            ]
        ),
        mutation!(
            pillow,
            "curvature moved from one cone to another",
            |a| {
                a.arrays.target_curvature[0] += 0.1;
                a.arrays.target_curvature[6] -= 0.1;
            },
            [
                "cones listed",
                "holonomy around every vertex of the cut is its curvature",
                "interior curvature is the target"
            ]
        ),
        mutation!(
            tube,
            "the curvature of a free boundary untrue",
            |a| {
                a.arrays.target_curvature[3] += 1e-4;
                a.arrays.target_curvature[4] -= 1e-4
            },
            ["free boundary's target is what was achieved"]
        ),
        mutation!(
            pillow,
            "a curvature error that is none of convergence",
            |a| a.json["metric"]["max_curvature_error"] = json!(1e-5),
            ["stated curvature error"]
        ),
        mutation!(
            pillow,
            "a cone not listed",
            |a| a.json["cones"].as_array_mut().map(|c| c.pop()),
            ["cones listed", "segments run from node to node"]
        ),
        mutation!(
            pillow,
            "a cone listed with another curvature",
            |a| a.json["cones"][0]["curvature"] = json!(1.0),
            ["cones listed"]
        ),
    ]
}
