//! Damage to the charts, the cut and the transitions.

use super::*;

pub fn mutations() -> Vec<Mutation> {
    vec![
        mutation!(
            torus,
            "a corner of the central chart off",
            |a| a.arrays.central_uv[33][2][0] += 1e-5,
            [
                "central chart continuous off the cut",
                "central chart keeps flat lengths",
                "patches are similar to the central chart, positive, injective",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            torus,
            "a face of the central chart turned over",
            |a| a.arrays.central_uv[33].swap(0, 1),
            [
                "area distortion (9) as stated",
                "central chart continuous off the cut",
                "central chart keeps flat lengths",
                "central chart orientation positive",
                "patches are similar to the central chart, positive, injective",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            torus,
            "a cut edge forgotten on one side",
            |a| {
                let f = a.arrays.cut.iter().position(|c| c[0] == 1).expect("one");
                a.arrays.cut[f][0] = 0;
            },
            [
                "central chart continuous off the cut",
                "cut and segment arrays agree",
                "cut length as stated",
                "gluings are rigid motions",
                "gluings state their residual",
                "holonomy fixes the vertex it turns about",
                "seams run along every patch border",
                "segments cover the cut",
                "segments run from node to node"
            ]
        ),
        mutation!(
            torus,
            "a cut edge of another segment",
            |a| {
                let f = a.arrays.cut.iter().position(|c| c[0] == 1).expect("one");
                a.arrays.segment[f][0] ^= 1;
            },
            [
                "cut and segment arrays agree",
                "gluings are rigid motions",
                "gluings state their residual",
                "holonomy fixes the vertex it turns about",
                "segments cover the cut",
                "segments run from node to node"
            ]
        ),
        mutation!(
            torus,
            "a gluing shifted",
            |a| a.json["segments"][0]["gluing"]["translation"][0] = json!(0.5),
            [
                "gluings are rigid motions",
                "gluings are the transitions from left to right",
                "gluings state their residual"
            ]
        ),
        mutation!(
            torus,
            "a gluing turned",
            |a| a.json["segments"][0]["gluing"]["rotation"] = json!(1e-4),
            [
                "a torus without cones has translations only",
                "gluings are rigid motions",
                "gluings are the transitions from left to right",
                "gluings state their residual",
                "holonomy fixes the vertex it turns about",
                "quarter turns are listed truthfully",
                "seamless flag is true to the gluings"
            ]
        ),
        mutation!(
            torus,
            "a gluing inverted",
            |a| {
                for i in 0..2 {
                    let t = a.json["segments"][0]["gluing"]["translation"][i]
                        .as_f64()
                        .expect("a number");
                    a.json["segments"][0]["gluing"]["translation"][i] = json!(-t);
                }
            },
            [
                "gluings are rigid motions",
                "gluings are the transitions from left to right",
                "gluings state their residual"
            ]
        ),
        mutation!(
            torus,
            "a residual untrue",
            |a| a.json["segments"][0]["gluing"]["residual"] = json!(0.1),
            ["gluings state their residual"]
        ),
        mutation!(
            torus,
            "a segment reversed",
            |a| {
                let vertices = a.json["segments"][0]["vertices"]
                    .as_array_mut()
                    .expect("a list");
                vertices.reverse();
            },
            ["gluings are rigid motions", "gluings state their residual"]
        ),
        mutation!(
            torus,
            "a segment cut short",
            |a| {
                let vertices = a.json["segments"][0]["vertices"]
                    .as_array_mut()
                    .expect("a list");
                vertices.pop();
                a.json["segments"][0]["to"] = a.json["segments"][0]["vertices"]
                    .as_array()
                    .and_then(|v| v.last().cloned())
                    .expect("one");
            },
            [
                "charts cover the surface but its cones",
                "holonomy fixes the vertex it turns about",
                "no chain of the cut dangles",
                "node charts cover flat and boundary nodes",
                "segments cover the cut"
            ]
        ),
        mutation!(
            pillow,
            "the seamless flag untrue",
            |a| a.json["flags"]["seamless"] = json!(false),
            ["seamless flag is true to the gluings"]
        ),
        mutation!(
            cone,
            "the seamless flag untrue on a cone",
            |a| a.json["flags"]["seamless"] = json!(true),
            ["seamless flag is true to the gluings"]
        ),
        mutation!(
            pillow,
            "a quarter turn untrue",
            |a| a.json["transitions"][0]["quarter_turns"] = json!(1),
            ["quarter turns are listed truthfully"]
        ),
        mutation!(
            pillow,
            "a quarter turn kept back",
            |a| a.json["transitions"][0]
                .as_object_mut()
                .map(|t| t.remove("quarter_turns")),
            ["quarter turns are listed truthfully"]
        ),
        mutation!(
            pillow,
            "a rotation of more than a turn",
            |a| {
                let r = a.json["transitions"][0]["rotation"]
                    .as_f64()
                    .expect("a number");
                a.json["transitions"][0]["rotation"] = json!(r + std::f64::consts::TAU);
            },
            ["rotations lie in (-pi, pi]"]
        ),
        mutation!(
            torus,
            "stated periods of a sublattice",
            |a| a.json["periods"] = json!([[16.0, 0.0], [3.0, 9.0]]),
            ["stated periods span the same lattice"]
        ),
        mutation!(
            torus,
            "a boundary chart missing",
            |a| drop_chart(a, 1),
            [
                "boundary charts cover the inner vertices of their segments",
                "boundary charts glue both sides of every cut edge",
                "charts cover the surface but its cones",
                "every segment has a boundary chart with two sides"
            ]
        ),
        mutation!(
            torus,
            "the node chart missing",
            |a| {
                let c = chart_of(a, "node");
                drop_chart(a, c)
            },
            [
                "charts cover the surface but its cones",
                "node charts cover flat and boundary nodes"
            ]
        ),
        mutation!(
            tube,
            "a node chart on the boundary missing",
            |a| {
                let c = chart_of(a, "node");
                drop_chart(a, c)
            },
            [
                "charts cover the surface but its cones",
                "node charts cover flat and boundary nodes"
            ]
        ),
        mutation!(
            torus,
            "a transition missing",
            |a| a.json["transitions"].as_array_mut().map(|t| t.remove(0)),
            [
                "every chart has its transitions",
                "every segment has a boundary chart with two sides"
            ]
        ),
        mutation!(
            torus,
            "a transition twice",
            |a| {
                let t = a.json["transitions"][0].clone();
                append(a, "transitions", t);
            },
            [
                "every chart has its transitions",
                "no face is in a sector twice"
            ]
        ),
        mutation!(
            torus,
            "a transition shifted",
            |a| {
                let t = &mut a.json["transitions"][0]["translation"][0];
                *t = json!(t.as_f64().expect("a number") + 1e-4);
            },
            [
                "cocycle holds on shared faces, both ways",
                "cocycle holds on triple overlaps",
                "gluings are the transitions from left to right",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            torus,
            "a transition's faces miscounted",
            |a| a.json["transitions"][0]["faces"] = json!(1),
            ["transitions state their faces and residual"]
        ),
        mutation!(
            torus,
            "an entry of a chart in the wrong sector",
            |a| a.arrays.chart_sector[0] = 1,
            [
                "cocycle holds on shared faces, both ways",
                "cocycle holds on triple overlaps",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            torus,
            "a corner of a chart off",
            |a| a.arrays.chart_uv[4][0][0] += 1e-5,
            [
                "boundary charts cover the inner vertices of their segments",
                "boundary charts glue both sides of every cut edge",
                "charts cover the surface but its cones",
                "charts keep flat lengths",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            torus,
            "a face of a chart turned over",
            |a| a.arrays.chart_uv[4].swap(0, 2),
            [
                "boundary charts cover the inner vertices of their segments",
                "boundary charts glue both sides of every cut edge",
                "charts cover the surface but its cones",
                "charts keep flat lengths",
                "charts' orientation positive",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            torus,
            "a face of a chart twice",
            |a| {
                a.arrays.chart_face[1] = a.arrays.chart_face[0];
                a.arrays.chart_uv[1] = a.arrays.chart_uv[0]
            },
            [
                "boundary charts cover the inner vertices of their segments",
                "charts cover the surface but its cones",
                "no face is in a sector twice"
            ]
        ),
        mutation!(
            torus,
            "a face of a chart that is not there",
            |a| a.arrays.chart_face[1] = 5000,
            ["indices stay in range"]
        ),
        mutation!(
            torus,
            "chart offsets that go back",
            |a| a.arrays.chart_offset.swap(2, 3),
            ["chart list matches arrays"]
        ),
    ]
}
