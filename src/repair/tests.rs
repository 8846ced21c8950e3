mod clean;
mod glue;
mod order;
mod weld;

use super::assemble::{MOST_IN_ANY_ORDER, doubled_edges};
use super::corpus::{self, soup};
use super::*;
use crate::geometry::mesh::{AttributeKind, CornerAttribute, triangle_area};

/// What comes out, in source units.
fn repaired(soup: &Soup) -> Repaired {
    let mut repaired = repair(soup, &RepairParams::default()).unwrap();
    check(&repaired, soup);
    for component in &mut repaired.components {
        if let Ok(mesh) = &mut component.mesh {
            component.frame.leave_all(&mut mesh.positions);
        }
    }
    repaired
}

/// What must hold for whatever comes out.
fn check(repaired: &Repaired, soup: &Soup) {
    assert!(!repaired.components.is_empty());
    let mut last_face = None;
    for (c, component) in repaired.components.iter().enumerate() {
        assert!(last_face <= Some(component.first_source_face));
        last_face = Some(component.first_source_face);
        let Ok(mesh) = &component.mesh else { continue };
        let connectivity = &mesh.connectivity;
        connectivity.validate().unwrap();
        assert_eq!(doubled_edges(connectivity), []);
        // A list of triples says it all: that is what files hold.
        let again = crate::geometry::connectivity::Connectivity::from_faces(
            &connectivity.to_faces(),
            connectivity.vertex_count(),
        );
        assert_eq!(again.unwrap().topology(), connectivity.topology());
        let known: Vec<u32> = mesh
            .source_vertex
            .iter()
            .copied()
            .filter(|&v| v != NONE)
            .collect();
        assert_eq!(known.iter().min(), Some(&component.first_source_vertex));
        for (v, &source) in mesh.source_vertex.enumerate() {
            if source != NONE {
                let position = component.frame.leave(mesh.positions[v]);
                assert_eq!(position, soup.positions[source as usize]);
                assert!(repaired.locate(source).is_some());
            }
        }
        // First copies ascend in input order, where there are not very many faces.
        let firsts: Vec<u32> = mesh
            .source_vertex
            .enumerate()
            .filter(|&(v, &s)| s != NONE && repaired.locate(s) == Some((c, v)))
            .map(|(_, &s)| s)
            .collect();
        assert!(firsts.is_sorted() || component.faces > MOST_IN_ANY_ORDER);
        for attribute in &mesh.attributes {
            let corners = 3 * connectivity.face_count();
            assert_eq!(attribute.values.len(), corners * attribute.components);
        }
        assert_eq!(mesh.source_face.len(), connectivity.face_count());
        assert_eq!(mesh.face_material.len(), connectivity.face_count());
    }
    let shared: usize = repaired
        .components
        .iter()
        .map(|c| c.log.changes.len())
        .sum();
    assert!(shared <= repaired.log.changes.len());
}

fn area(mesh: &Mesh) -> f64 {
    let faces = mesh.connectivity.faces();
    faces.map(|f| triangle_area(mesh.face_positions(f))).sum()
}

fn only(repaired: &Repaired) -> &Mesh {
    assert_eq!(repaired.components.len(), 1);
    repaired.components[0].mesh.as_ref().unwrap()
}

fn count(repaired: &Repaired, name: &str) -> u64 {
    repaired.log.counts()[name]
}

fn chi(mesh: &Mesh) -> i64 {
    mesh.connectivity.topology().euler_characteristic
}

/// Octahedron: 8 faces, poles 0 and 5, equator 1 to 4.
fn octahedron() -> Soup {
    let positions = vec![
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0],
    ];
    let faces = (1..5)
        .map(|i| [0, i, i % 4 + 1])
        .chain((1..5).map(|i| [5, i % 4 + 1, i]))
        .collect();
    soup(positions, faces)
}

/// A closed cube of 2·6·n² faces, vertices on a grid.
fn cube(n: u32) -> Soup {
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    let mut index = std::collections::BTreeMap::new();
    let mut vertex = |p: [u32; 3]| -> u32 {
        *index.entry(p).or_insert_with(|| {
            positions.push(p.map(f64::from));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let corner = |a: u32, b: u32| {
                        let mut p = [0; 3];
                        p[axis] = side;
                        p[(axis + 1) % 3] = a;
                        p[(axis + 2) % 3] = b;
                        p
                    };
                    let q = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                        .map(|(a, b)| vertex(corner(a, b)));
                    let [a, b, c, d] = if side == n {
                        q
                    } else {
                        [q[0], q[3], q[2], q[1]]
                    };
                    faces.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    soup(positions, faces)
}

fn exploded(soup: &Soup) -> Soup {
    let positions = soup
        .faces
        .iter()
        .flatten()
        .map(|&v| soup.positions[v as usize]);
    let faces = (0..soup.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]);
    corpus::soup(positions.collect(), faces.collect())
}

/// `b` after `a`, its vertices renumbered.
fn together(a: &Soup, b: &Soup) -> Soup {
    let offset = a.positions.len() as u32;
    let positions = [a.positions.clone(), b.positions.clone()].concat();
    let moved = b.faces.iter().map(|f| f.map(|v| v + offset));
    soup(positions, a.faces.iter().copied().chain(moved).collect())
}

fn moved(soup: &Soup, by: [f64; 3]) -> Soup {
    let mut soup = soup.clone();
    for p in &mut soup.positions {
        *p = std::array::from_fn(|i| p[i] + by[i]);
    }
    soup
}

fn moebius(n: u32) -> Soup {
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for i in 0..n {
        let t = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        for s in [-0.3, 0.3] {
            let r = 1.0 + s * (t / 2.0).cos();
            positions.push([r * t.cos(), r * t.sin(), s * (t / 2.0).sin()]);
        }
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, a + 3) } else { (1, 0) };
        faces.extend([[a, c, b], [b, c, d]]);
    }
    soup(positions, faces)
}

#[test]
fn a_clean_mesh_is_left_alone() {
    for clean in [octahedron(), cube(3)] {
        let result = repaired(&clean);
        assert!(result.log.is_empty(), "{}", result.log.summary());
        let mesh = only(&result);
        assert_eq!(mesh.connectivity.to_faces(), clean.faces);
        assert_eq!(mesh.positions.as_slice(), clean.positions);
        let strict = RepairParams {
            strict: true,
            ..RepairParams::default()
        };
        assert!(repair(&clean, &strict).is_ok());
    }
}

#[test]
fn strict_refuses_and_says_where() {
    let mut soup = octahedron();
    soup.faces[2].swap(0, 1);
    soup.positions.push([9.0; 3]);
    let strict = RepairParams {
        strict: true,
        ..RepairParams::default()
    };
    let error = repair(&soup, &strict).unwrap_err().to_string();
    assert!(
        error.contains("face 2 is oriented against its neighbours"),
        "{error}"
    );
    assert!(error.contains("repair.strict = false"), "{error}");
}

#[test]
fn input_that_is_no_surface_is_refused() {
    let nothing = soup(vec![[0.0; 3]; 3], vec![[0, 1, 2]]);
    let error = repair(&nothing, &RepairParams::default()).unwrap_err();
    assert_eq!(error, RepairError::NoFaces { faces: 1 });
    let line = soup(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2]]);
    assert!(repair(&line, &RepairParams::default()).is_err());
    assert!(repair(&Soup::default(), &RepairParams::default()).is_err());
    let mut wrong = octahedron();
    wrong.faces[1][1] = 6;
    let error = repair(&wrong, &RepairParams::default()).unwrap_err();
    assert!(matches!(
        error,
        RepairError::VertexOutOfRange {
            face: 1,
            vertex: 6,
            vertices: 6
        }
    ));
    let mut wrong = octahedron();
    wrong.positions[4][2] = f64::NAN;
    let error = repair(&wrong, &RepairParams::default()).unwrap_err();
    assert_eq!(error, RepairError::NonFinitePosition { vertex: 4 });
    let mut wrong = octahedron();
    wrong.face_material.pop();
    let error = repair(&wrong, &RepairParams::default()).unwrap_err();
    assert!(matches!(
        error,
        RepairError::WrongLength {
            given: 7,
            required: 8,
            ..
        }
    ));
}

/// Small numbers from a fixed sequence.
struct Sequence(u64);

impl Sequence {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) % n
    }
}

#[test]
fn any_soup_becomes_simple_surfaces() {
    let mut next = Sequence(7);
    let (mut doubled, mut one_sided) = (0, 0);
    for round in 0..3000 {
        let vertices = 4 + next.below(9);
        // Coordinates on a coarse grid, so that points coincide and lie on lines.
        let grid = 2 + next.below(4);
        let positions: Vec<[f64; 3]> = (0..vertices)
            .map(|_| [(); 3].map(|()| next.below(grid) as f64))
            .collect();
        let faces: Vec<[u32; 3]> = (0..1 + next.below(40))
            .map(|_| [(); 3].map(|()| next.below(vertices) as u32))
            .collect();
        let soup = soup(positions, faces);
        let Ok(result) = repair(&soup, &RepairParams::default()) else {
            continue;
        };
        check(&result, &soup);
        doubled += count(&result, "split_edges");
        one_sided += result.components.iter().filter(|c| c.mesh.is_err()).count();
        let failed: usize = result
            .components
            .iter()
            .filter(|c| !matches!(c.mesh, Ok(_) | Err(ComponentError::NonOrientable { .. })))
            .count();
        assert_eq!(failed, 0, "round {round}");
        assert_eq!(
            repair(&soup, &RepairParams::default()).unwrap().log,
            result.log
        );
    }
    assert!(doubled > 50 && one_sided > 5, "{doubled} {one_sided}");
}

#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn clean_models_keep_their_counts() {
    let Some(folder) = corpus::folder("clean_models_keep_their_counts") else {
        return;
    };
    // V, F, loops, χ as the folder's table has them.
    for (name, v, f, loops, euler) in [
        ("spot.obj", 2930, 5856, 0, 2),
        ("bunny-closed.off", 3485, 6966, 0, 2),
        ("nefertiti.obj", 49971, 99938, 0, 2),
        ("fandisk.off", 7229, 14454, 0, 2),
        ("bumpy-cube.obj", 19970, 39936, 0, 2),
        ("rocker-arm.obj", 10044, 20088, 0, 0),
        ("kitten.obj", 53123, 106246, 0, 0),
        ("brezel.obj", 2622, 5248, 0, -2),
        ("three-holes.off", 3596, 7200, 0, -4),
        ("elephant-genus3.obj", 24955, 49918, 0, -4),
        ("fertility.off", 4494, 9000, 0, -6),
        ("face.obj", 17157, 34144, 1, 1),
        ("camelhead.off", 11381, 22704, 1, 1),
        ("lilium.obj", 3389, 6590, 1, 1),
        ("punctured-torus.obj", 4599, 9184, 1, -1),
        ("stanford-bunny.obj", 35947, 69451, 5, -3),
        ("beetle.obj", 30024, 58738, 11, -9),
    ] {
        let soup = corpus::load(&folder.join(name));
        let result = repaired(&soup);
        let topology = only(&result).connectivity.topology();
        let unused = count(&result, "unreferenced_vertices") as usize;
        assert_eq!(topology.vertices + unused, v, "{name}");
        assert_eq!(topology.faces, f, "{name}");
        assert_eq!(topology.boundary_loops, loops, "{name}");
        assert_eq!(topology.euler_characteristic, euler, "{name}");
        assert_eq!(
            result.log.changes.len(),
            unused,
            "{name}: {}",
            result.log.summary()
        );
    }
}

#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn dirty_models_become_surfaces() {
    let Some(folder) = corpus::folder("dirty_models_become_surfaces") else {
        return;
    };
    for entry in std::fs::read_dir(folder.join("dirty")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "obj") {
            continue;
        }
        let soup = corpus::load(&path);
        let result = match repair(&soup, &RepairParams::default()) {
            Ok(result) => result,
            Err(error) => {
                println!("{}: {error}", path.file_name().unwrap().display());
                assert!(matches!(error, RepairError::TooManyComponents { .. }));
                continue;
            }
        };
        check(&result, &soup);
        println!(
            "{}: {} components, {} failed; {}",
            path.file_name().unwrap().display(),
            result.components.len(),
            result.components.iter().filter(|c| c.mesh.is_err()).count(),
            result.log.summary()
        );
        for component in result.components.iter().take(4) {
            match &component.mesh {
                Ok(mesh) => println!("    {:?}", mesh.connectivity.topology()),
                Err(error) => println!("    {error}"),
            }
        }
    }
}
