mod automatic;
mod boundary;

use super::*;
use crate::repair::corpus::{self, soup};
use crate::repair::{RepairParams, Repaired, repair};
use std::collections::BTreeSet;

/// A flat sheet of n × n squares, a disk.
fn sheet(n: u32) -> crate::geometry::mesh::Soup {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let positions = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| [f64::from(i), f64::from(j), 0.0]))
        .collect();
    let faces = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    soup(positions, faces)
}

/// A torus of n × n squares with the squares of `holes` left out.
fn torus(n: u32, holes: &[u32]) -> crate::geometry::mesh::Soup {
    let at = |i: u32, j: u32| i % n * n + j % n;
    let angle = |i: u32| TAU * f64::from(i) / f64::from(n);
    let positions = (0..n * n)
        .map(|v| {
            let (s, t) = (angle(v / n), angle(v % n));
            let r = 2.0 + t.cos() + 0.1 * (2.0 * s).sin();
            [r * s.cos(), r * s.sin(), t.sin()]
        })
        .collect();
    let faces = (0..n * n)
        .filter(|q| !holes.contains(q))
        .flat_map(|q| {
            let (i, j) = (q / n, q % n);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    soup(positions, faces)
}

/// A sphere of latitudes.
fn sphere(n: u32) -> crate::geometry::mesh::Soup {
    let mut positions = vec![[0.0, 0.0, 1.3]];
    for i in 1..n {
        let t = PI * f64::from(i) / f64::from(n);
        for j in 0..n {
            let s = TAU * f64::from(j) / f64::from(n);
            positions.push([t.sin() * s.cos(), 1.1 * t.sin() * s.sin(), 1.3 * t.cos()]);
        }
    }
    positions.push([0.0, 0.0, -1.3]);
    let at = |i: u32, j: u32| match i {
        0 => 0,
        _ if i == n => 1 + (n - 1) * n,
        _ => 1 + (i - 1) * n + j % n,
    };
    let faces = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .filter(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0])
        .collect();
    soup(positions, faces)
}

fn multiple(n: i64, d: i64) -> PiMultiple {
    PiMultiple::fraction(n, d).unwrap()
}

fn at_vertex(vertex: u32, n: i64, d: i64) -> ConeSpec {
    ConeSpec {
        vertex: Some(vertex),
        point: None,
        curvature: multiple(n, d),
    }
}

fn listed(list: Vec<ConeSpec>) -> ConeParams {
    ConeParams {
        list,
        ..ConeParams::default()
    }
}

fn by(strategy: ConeStrategy) -> ConeParams {
    ConeParams {
        strategy,
        ..ConeParams::default()
    }
}

fn uniform() -> BoundaryParams {
    BoundaryParams {
        condition: Some(BoundaryCondition::Uniform),
        ..BoundaryParams::default()
    }
}

fn all(
    repaired: &Repaired,
    cones: &ConeParams,
    boundary: &BoundaryParams,
) -> Result<Vec<Prescription>, ConeError> {
    let requests = assign(repaired, cones, boundary, &Default::default())?;
    let components = repaired.components.iter().zip(&requests);
    components
        .map(|(c, r)| {
            prescribe(
                c.mesh.as_ref().unwrap(),
                r,
                cones,
                boundary,
                &Default::default(),
            )
        })
        .collect()
}

fn one(
    soup: &crate::geometry::mesh::Soup,
    cones: &ConeParams,
    boundary: &BoundaryParams,
) -> Result<Prescription, ConeError> {
    let repaired = repair(soup, &RepairParams::default()).unwrap();
    assert_eq!(repaired.components.len(), 1);
    let prescription = all(&repaired, cones, boundary)?.remove(0);
    let mesh = repaired.components[0].mesh.as_ref().unwrap();
    let topology = mesh.connectivity.topology();
    // Gauss–Bonnet, positive angles, and a list of cones that says what the targets say.
    let total: f64 = prescription.target.iter().sum();
    let required = TAU * topology.euler_characteristic as f64;
    if topology.boundary_loops == 0 || prescription.boundary != BoundaryCondition::Free {
        assert!(
            (total - required).abs() < 1e-12 * (1.0 + required.abs()),
            "{total} {required}"
        );
    }
    for (v, &k) in prescription.target.enumerate() {
        let on_boundary = mesh.connectivity.is_boundary_vertex(v);
        assert!(k < if on_boundary { PI } else { TAU });
        let cone = prescription.cones.iter().find(|c| c.vertex == v);
        assert_eq!(cone.map_or(0.0, |c| c.curvature), k);
    }
    Ok(prescription)
}

fn curvatures(prescription: &Prescription) -> Vec<f64> {
    prescription
        .cones
        .iter()
        .map(|c| c.curvature / PI)
        .collect()
}

fn message(result: Result<Prescription, ConeError>) -> String {
    result.unwrap_err().to_string()
}

/// What the automatic choice promises of its cones inside a surface that needs no more than eight, beside what [`one`] checks of every
/// prescription.
fn assert_within_limits(prescription: &Prescription) {
    let params = ConeParams::default();
    let given = curvatures(prescription);
    assert!(given.len() <= DEFAULT_COUNT + 16, "{given:?}");
    let range = params.min_curvature.multiple() - 1e-9..=params.max_curvature.multiple() + 1e-9;
    assert!(given.iter().all(|k| range.contains(k)), "{given:?}");
}

#[test]
fn spread_cones_keep_off_the_boundary_and_each_other() {
    let cones = ConeParams {
        strategy: ConeStrategy::Spread,
        count: Some(2),
        curvature: Some(multiple(1, 4)),
        ..ConeParams::default()
    };
    let plain = sheet(12);
    let result = one(&plain, &cones, &BoundaryParams::default()).unwrap();
    for cone in &result.cones {
        let p = plain.positions[cone.vertex.index()];
        assert!(p[..2].iter().all(|&x| (2.0..=10.0).contains(&x)), "{p:?}");
    }
    assert_eq!(curvatures(&result), [0.25; 2]);
}

#[test]
fn welded_vertices_are_found_by_any_of_their_names() {
    let plain = sphere(6);
    let positions: Vec<[f64; 3]> = plain
        .faces
        .iter()
        .flatten()
        .map(|&v| plain.positions[v as usize])
        .collect();
    let faces: Vec<[u32; 3]> = (0..plain.faces.len() as u32)
        .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .collect();
    let exploded = soup(positions.clone(), faces);
    let last = positions.len() as u32 - 1;
    let first = positions
        .iter()
        .position(|p| *p == positions[last as usize])
        .unwrap() as u32;
    let others: Vec<u32> = [1, 23, 60].into_iter().filter(|&v| v != first).collect();
    let mut list = vec![at_vertex(last, 1, 1)];
    list.extend(others.iter().map(|&v| at_vertex(v, 1, 1)));
    assert_eq!(list.len(), 4);
    let result = one(&exploded, &listed(list.clone()), &BoundaryParams::default()).unwrap();
    assert_eq!(curvatures(&result), [1.0; 4]);
    list[1] = at_vertex(first, 1, 1);
    let error = message(one(&exploded, &listed(list), &BoundaryParams::default()));
    assert!(
        error.contains(&format!("vertices {last} and {first} are both named")),
        "{error}"
    );
}

#[test]
fn points_and_vertices_find_their_component() {
    let mut two = sphere(6);
    let offset = two.positions.len() as u32;
    let far = sphere(6);
    two.positions
        .extend(far.positions.iter().map(|p| [p[0] + 10.0, p[1], p[2]]));
    two.faces
        .extend(far.faces.iter().map(|f| f.map(|v| v + offset)));
    two.positions.push([50.0; 3]);
    two.face_material = vec![crate::geometry::ids::NONE; two.faces.len()];
    let repaired = repair(&two, &RepairParams::default()).unwrap();
    let near = |point: [f64; 3]| ConeSpec {
        vertex: None,
        point: Some(point),
        curvature: multiple(4, 3),
    };
    let list = vec![
        near([10.0, 0.0, 9.0]),
        near([10.0, 0.0, -9.0]),
        at_vertex(offset + 14, 4, 3),
    ];
    let results = all(&repaired, &listed(list.clone()), &BoundaryParams::default()).unwrap();
    // No entry: the default, as if the component were alone.
    let alone = one(
        &sphere(6),
        &ConeParams::default(),
        &BoundaryParams::default(),
    );
    assert_eq!(results[0].cones, alone.unwrap().cones);
    let strictly = ConeParams {
        strategy: ConeStrategy::Listed,
        ..listed(list.clone())
    };
    let strictly = all(&repaired, &strictly, &BoundaryParams::default()).unwrap();
    assert_eq!(strictly[0].cones, results[0].cones);
    assert_eq!(strictly[1].cones, results[1].cones);
    assert_eq!(results[1].cones.len(), 3);
    assert_eq!(results[1].cones[0].vertex, VertexId::new(0));
    for (spec, text) in [
        (
            at_vertex(2 * offset, 1, 1),
            format!("cones.list[0] names vertex {}, which no face", 2 * offset),
        ),
        (
            at_vertex(999, 1, 1),
            format!("the file has {} vertices", 2 * offset + 1),
        ),
        (
            near([f64::NAN; 3]),
            "cones.list[0].point has a coordinate".into(),
        ),
    ] {
        let error = all(&repaired, &listed(vec![spec]), &BoundaryParams::default());
        let error = error.unwrap_err().to_string();
        assert!(error.contains(&text), "{error}");
    }
    let mut both = list[0];
    both.vertex = Some(1);
    let error = all(&repaired, &listed(vec![both]), &BoundaryParams::default());
    assert!(matches!(error, Err(ConeError::NoPlace { .. })));
}

#[test]
fn impossible_cones_are_refused() {
    let none = BoundaryParams::default();
    let cases: Vec<(ConeParams, &str)> = vec![
        (
            listed(vec![at_vertex(3, 1, 2), at_vertex(3, 1, 2)]),
            "vertex 3 is named twice",
        ),
        (
            listed(vec![at_vertex(3, 2, 1), at_vertex(5, 2, 1)]),
            "vertex 3 has curvature 2π",
        ),
        (
            listed(vec![at_vertex(3, 3, 2), at_vertex(5, 3, 2)]),
            "needs at least 3 cones",
        ),
        (
            listed(vec![at_vertex(3, 0, 2), at_vertex(5, 3, 2)]),
            "curvature 0",
        ),
        (
            by(ConeStrategy::Single),
            "a single cone would need curvature 4π",
        ),
        (by(ConeStrategy::None), "needs cones of total curvature 4π"),
        (by(ConeStrategy::Listed), "cones.list is empty"),
        (
            listed(vec![
                at_vertex(3, 1, 1),
                at_vertex(5, 1, 1),
                at_vertex(9, 1, 1),
            ]),
            "sum to 3π (9.424777961 rad), but Gauss–Bonnet requires 2πχ = 4π (12.566370614 rad) on a surface with χ = 2 (genus 0, 0 boundary loops): change the total by 1π",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(0),
                ..ConeParams::default()
            },
            "cones.count is 0",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(1000),
                ..ConeParams::default()
            },
            "has 32 interior vertices",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(2),
                ..ConeParams::default()
            },
            "less than 2π",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                ..listed(vec![at_vertex(3, 1, 1)])
            },
            "cones.list and cones.strategy = \"spread\" exclude each other",
        ),
    ];
    for (params, text) in cases {
        let error = message(one(&sphere(6), &params, &none));
        assert!(error.contains(text), "{error}");
    }
    let spread = message(one(&torus(5, &[]), &by(ConeStrategy::Spread), &none));
    assert!(spread.contains("χ = 0"), "{spread}");
}

#[test]
fn rounding_of_decimals_is_shared_out() {
    let third = |v: u32| ConeSpec {
        vertex: Some(v),
        point: None,
        curvature: PiMultiple::decimal(1.33333333333).unwrap(),
    };
    let list = vec![third(0), third(9), third(20)];
    // `one` checks the sum to 1e-12.
    assert_eq!(
        one(&sphere(6), &listed(list), &BoundaryParams::default())
            .unwrap()
            .cones
            .len(),
        3
    );
}

#[test]
fn parameters_survive_toml() {
    let text = "strategy = \"listed\"\n\n[[list]]\nvertex = 4\ncurvature = \"1/2\"\n\n[[list]]\npoint = [0.0, 1.0, 2.0]\ncurvature = -8\n";
    let params: ConeParams = toml::from_str(text).unwrap();
    assert_eq!(params.list[1].curvature.multiple(), -8.0);
    let again: ConeParams = toml::from_str(&toml::to_string(&params).unwrap()).unwrap();
    assert_eq!(again, params);
    assert!(toml::from_str::<ConeParams>("cuont = 3").is_err());
    let boundary: BoundaryParams = toml::from_str("totals = [\"1/2\", 1.5]").unwrap();
    assert_eq!(boundary.effective_condition(), BoundaryCondition::Uniform);
    assert_eq!(
        toml::from_str::<ConeParams>("").unwrap(),
        ConeParams::default()
    );
}
