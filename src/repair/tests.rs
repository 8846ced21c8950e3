use super::assemble::doubled_edges;
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
        // First copies ascend in input order.
        let firsts: Vec<u32> = mesh
            .source_vertex
            .enumerate()
            .filter(|&(v, &s)| s != NONE && repaired.locate(s) == Some((c, v)))
            .map(|(_, &s)| s)
            .collect();
        assert!(firsts.is_sorted());
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
fn an_unwelded_soup_is_closed_again() {
    let result = repaired(&exploded(&cube(2)));
    let topology = only(&result).connectivity.topology();
    assert_eq!((topology.vertices, topology.boundary_loops), (26, 0));
    assert_eq!(count(&result, "welded_vertices"), 3 * 48 - 26);
    // All copies of a corner are found again.
    let located = result.locate(3 * 48 - 1).unwrap().1;
    assert_eq!(
        only(&result).positions[located],
        exploded(&cube(2)).positions[3 * 48 - 1]
    );
}

#[test]
fn minus_zero_is_zero() {
    let mut halves = exploded(&soup(
        vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
        ],
        vec![[0, 1, 2], [0, 3, 1]],
    ));
    halves.positions[3] = [-0.0, 0.0, -0.0];
    assert_eq!(only(&repaired(&halves)).connectivity.vertex_count(), 4);
}

#[test]
fn closed_sheets_that_touch_stay_apart() {
    let cubes = together(&cube(2), &moved(&cube(2), [2.0, 0.0, 0.0]));
    let result = repaired(&cubes);
    assert_eq!(result.components.len(), 2);
    assert!(result.log.is_empty());
    let separate = RepairParams {
        weld: false,
        ..RepairParams::default()
    };
    // Without welding an unwelded soup falls to pieces, one a face.
    let pieces = repair(&exploded(&octahedron()), &separate).unwrap();
    assert_eq!(pieces.components.len(), 8);
    let few = RepairParams {
        max_components: 7,
        ..separate
    };
    let error = repair(&exploded(&octahedron()), &few)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("8 components") && error.contains("max_components = 7"),
        "{error}"
    );
}

#[test]
fn tolerant_welding_is_not_transitive() {
    let mut soup = exploded(&cube(1));
    for (i, p) in soup.positions.iter_mut().enumerate() {
        p[0] += 1e-6 * ((i * 7 % 5) as f64 - 2.0);
    }
    let tolerant = RepairParams {
        weld_tolerance: 1e-5,
        ..RepairParams::default()
    };
    let result = repair(&soup, &tolerant).unwrap();
    check(&result, &soup);
    assert_eq!(only(&result).connectivity.topology().vertices, 8);
    assert_eq!(chi(only(&result)), 2);
    let bad = RepairParams {
        weld_tolerance: 0.5,
        ..RepairParams::default()
    };
    assert!(matches!(
        repair(&soup, &bad),
        Err(RepairError::WeldTolerance { .. })
    ));
}

#[test]
fn an_edge_of_length_zero_is_collapsed() {
    let mut cube = cube(4);
    // Two neighbours in the middle of the bottom.
    let at = |p: [f64; 3]| cube.positions.iter().position(|&q| q == p).unwrap();
    let (v, w) = (at([2.0, 2.0, 0.0]), at([2.0, 3.0, 0.0]));
    cube.positions[v] = cube.positions[w];
    let result = repaired(&cube);
    assert_eq!(chi(only(&result)), 2);
    assert_eq!(count(&result, "welded_vertices"), 1);
    assert_eq!(count(&result, "removed_degenerate_faces"), 2);
    assert_eq!(result.locate(v as u32), result.locate(w as u32));
}

/// A cube of 4, in whose bottom the corner of a face is moved to the side opposite, all but this part of the way.
fn squeezed_cube(aside: f64) -> Soup {
    let mut cube = cube(4);
    let at = |p: [f64; 3]| cube.positions.iter().position(|&q| q == p).unwrap();
    let v = at([2.0, 2.0, 0.0]);
    let face = *cube.faces.iter().find(|f| f.contains(&(v as u32))).unwrap();
    let others: Vec<u32> = face.into_iter().filter(|&w| w as usize != v).collect();
    let [p, q] = [others[0], others[1]].map(|w| cube.positions[w as usize]);
    let own = cube.positions[v];
    cube.positions[v] =
        std::array::from_fn(|i| (1.0 - aside) * (0.25 * p[i] + 0.75 * q[i]) + aside * own[i]);
    cube
}

#[test]
fn a_collinear_face_goes_and_the_surface_stays_closed() {
    let cube = squeezed_cube(0.0);
    let result = repaired(&cube);
    let mesh = only(&result);
    assert_eq!(chi(mesh), 2);
    assert_eq!(mesh.connectivity.topology().boundary_loops, 0);
    assert!((area(mesh) - 6.0 * 16.0).abs() < 1e-12);
    assert_eq!(count(&result, "removed_collinear_faces"), 1);
    assert_eq!(count(&result, "split_faces"), 1);
    for f in mesh.connectivity.faces() {
        assert!(triangle_area(mesh.face_positions(f)) > 1e-3);
    }
}

#[test]
fn what_float32_rounds_twice_is_one_point() {
    // Two neighbours in the middle of the bottom, so near that all faces at their edge are needles, or not quite.
    for (apart, welded) in [(1e-7, 1), (1e-4, 0)] {
        let mut cube = cube(4);
        let at = |p: [f64; 3]| cube.positions.iter().position(|&q| q == p).unwrap();
        let (v, w) = (at([2.0, 2.0, 0.0]), at([2.0, 3.0, 0.0]));
        cube.positions[v] = [2.0, 3.0 - apart, 0.0];
        let result = repaired(&cube);
        assert_eq!(chi(only(&result)), 2);
        assert_eq!(count(&result, "welded_vertices"), welded);
        assert_eq!(count(&result, "removed_degenerate_faces"), 2 * welded);
        assert_eq!(
            result.locate(v as u32) == result.locate(w as u32),
            welded == 1
        );
    }
    // A short edge with one face that is no needle stays, and so does a chain that is long in all.
    let positions: Vec<[f64; 3]> = (0..=3)
        .map(|i| [1.5e-6 * f64::from(i), 0.0, 0.0])
        .chain([[0.0, 1.0, 0.0], [2e-6, -2e-6, 0.0]])
        .collect();
    let fan: Vec<[u32; 3]> = (0..3).map(|i| [i, i + 1, 4]).collect();
    let soup_of_fan = soup(positions.clone(), fan.clone());
    let welded = count(
        &repair(&soup_of_fan, &RepairParams::default()).unwrap(),
        "welded_vertices",
    );
    assert_eq!(welded, 2);
    let below = soup(
        positions,
        [fan, vec![[1, 0, 5], [2, 1, 5], [3, 2, 5]]].concat(),
    );
    assert_eq!(count(&repaired(&below), "welded_vertices"), 0);
}

#[test]
fn a_corner_that_float32_rounds_off_its_line_is_on_it() {
    for (aside, removed) in [(5e-7, 1), (1e-4, 0)] {
        let result = repaired(&squeezed_cube(aside));
        assert_eq!(chi(only(&result)), 2);
        assert!((area(only(&result)) - 6.0 * 16.0).abs() < 1e-12);
        assert_eq!(count(&result, "removed_collinear_faces"), removed);
    }
}

#[test]
fn attributes_are_interpolated_where_a_face_is_split_and_reversed_where_it_is_flipped() {
    // Vertex 4 lies on the diagonal of a square; face 1 has no area; face 2 runs the wrong way.
    let positions = vec![
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 4.0, 0.0],
        [0.0, 4.0, 0.0],
        [1.0, 1.0, 0.0],
    ];
    let faces: Vec<[u32; 3]> = vec![[0, 1, 2], [0, 4, 2], [4, 0, 3], [4, 2, 3]];
    let uv = |v: u32| positions[v as usize][..2].iter().map(|&x| x as f32);
    let mut square = soup(positions.clone(), faces.clone());
    square.attributes = vec![
        CornerAttribute {
            kind: AttributeKind::Tangent,
            components: 4,
            values: faces
                .iter()
                .flatten()
                .flat_map(|_| [1.0, 0.0, 0.0, 1.0])
                .collect(),
        },
        CornerAttribute {
            kind: AttributeKind::TexCoord(0),
            components: 2,
            values: faces.iter().flatten().flat_map(|&v| uv(v)).collect(),
        },
        CornerAttribute {
            kind: AttributeKind::Normal,
            components: 3,
            values: (0..faces.len())
                .flat_map(|f| [[0.0, 0.0, if f == 2 { -1.0 } else { 1.0 }]; 3])
                .flatten()
                .collect(),
        },
    ];
    let result = repaired(&square);
    let mesh = only(&result);
    assert_eq!(count(&result, "flipped_faces"), 1);
    assert_eq!(count(&result, "split_faces"), 1);
    assert!((area(mesh) - 16.0).abs() < 1e-12);
    assert_eq!(chi(mesh), 1);
    for f in mesh.connectivity.faces() {
        for (k, p) in mesh.face_positions(f).iter().enumerate() {
            let [tangent, uv, normal] = [0, 1, 2].map(|a| mesh.attributes[a].corner(f.index(), k));
            assert!(
                (f64::from(uv[0]) - p[0]).abs() < 1e-6 && (f64::from(uv[1]) - p[1]).abs() < 1e-6
            );
            assert_eq!(
                normal,
                [0.0, 0.0, 1.0],
                "negated where it pointed against the turned face"
            );
            let flipped = mesh.source_face[f] == 2;
            assert_eq!(tangent[3], if flipped { -1.0 } else { 1.0 });
        }
    }
}

#[test]
fn the_fewest_faces_are_flipped() {
    let mut soup = cube(3);
    for f in [4, 17, 30] {
        soup.faces[f].swap(0, 1);
    }
    let result = repaired(&soup);
    let flipped: Vec<u32> = result
        .log
        .changes
        .iter()
        .filter_map(|c| match c {
            Change::FlippedFace { face } => Some(*face),
            _ => None,
        })
        .collect();
    assert_eq!(flipped, [4, 17, 30]);
    assert_eq!(chi(only(&result)), 2);
}

#[test]
fn duplicates_and_repeated_vertices_go() {
    let mut soup = cube(2);
    let [a, b, c] = soup.faces[9];
    soup.faces.extend([[b, c, a], [b, a, c], [a, a, c]]);
    soup.face_material = vec![NONE; soup.faces.len()];
    let result = repaired(&soup);
    assert_eq!(count(&result, "removed_duplicate_faces"), 2);
    assert_eq!(count(&result, "removed_degenerate_faces"), 1);
    assert_eq!(count(&result, "removed_faces"), 3);
    assert_eq!(chi(only(&result)), 2);
    assert_eq!(only(&result).connectivity.to_faces(), cube(2).faces);
}

#[test]
fn sheets_without_volume_go_where_they_hang_on_something() {
    // A flap: the same triangle from both sides, on an edge of a cube.
    let mut soup = cube(2);
    let [a, b, _] = soup.faces[0];
    let tip = soup.positions.len() as u32;
    soup.positions.push([-1.0; 3]);
    soup.faces.extend([[a, b, tip], [b, a, tip]]);
    soup.face_material = vec![NONE; soup.faces.len()];
    let result = repaired(&soup);
    assert_eq!(only(&result).connectivity.to_faces(), cube(2).faces);
    assert_eq!(count(&result, "removed_duplicate_faces"), 1);
    assert_eq!(count(&result, "removed_flap_faces"), 1);
    // Two cubes with a wall between them, once for each: one box.
    let mut boxes = exploded(&together(&cube(1), &moved(&cube(1), [1.0, 0.0, 0.0])));
    let result = repaired(&boxes);
    assert_eq!(only(&result).connectivity.topology().vertices, 12);
    assert!((area(only(&result)) - 10.0).abs() < 1e-12);
    // Three leaves on one stem, each given from both sides: nothing but sheets, so one side of each is the surface.
    let leaves = super::corpus::soup(
        vec![
            [0.0; 3],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [-1.0, 1.0, 0.0],
            [-1.0, -1.0, 0.0],
        ],
        vec![
            [0, 1, 2],
            [0, 1, 3],
            [0, 1, 4],
            [1, 0, 2],
            [1, 0, 3],
            [1, 0, 4],
        ],
    );
    assert_eq!(count(&repaired(&leaves), "removed_duplicate_faces"), 3);
    assert_eq!(count(&repaired(&leaves), "removed_flap_faces"), 0);
    // A sheet given from both sides that hangs on nothing stays, once.
    boxes = super::corpus::soup(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2], [0, 2, 3], [1, 0, 2], [2, 0, 3]],
    );
    assert_eq!(
        only(&repaired(&boxes)).connectivity.to_faces(),
        boxes.faces[..2]
    );
}

#[test]
fn a_vertex_with_two_fans_is_split() {
    let mut two = together(&octahedron(), &moved(&octahedron(), [0.0, 0.0, 2.0]));
    // The lower pole of the second (6 + 5) is the upper pole of the first.
    for v in two.faces.iter_mut().flatten().filter(|v| **v == 11) {
        *v = 0;
    }
    let result = repaired(&two);
    assert_eq!(count(&result, "split_vertices"), 1);
    assert_eq!(count(&result, "unreferenced_vertices"), 1);
    assert_eq!(result.components.len(), 2);
    for component in &result.components {
        assert_eq!(chi(component.mesh.as_ref().unwrap()), 2);
    }
    let second = result.components[1].mesh.as_ref().unwrap();
    assert_eq!(second.source_vertex.as_slice(), [6, 7, 8, 9, 10, 0]);
    assert_eq!(result.locate(0), Some((0, VertexId::new(0))));
    assert_eq!(result.locate(11), None);
    assert_eq!(result.components[0].log.counts()["split_vertices"], 1);
}

#[test]
fn solids_that_share_an_edge_come_apart() {
    // Two cubes that share an edge: four faces there.
    let cubes = together(&cube(1), &moved(&cube(1), [1.0, 1.0, 0.0]));
    let mut shared = exploded(&cubes);
    shared.faces.reverse();
    let result = repaired(&shared);
    assert_eq!(result.components.len(), 2);
    assert_eq!(count(&result, "cut_edges"), 1);
    for component in &result.components {
        let mesh = component.mesh.as_ref().unwrap();
        assert_eq!(chi(mesh), 2);
        assert!((area(mesh) - 6.0).abs() < 1e-12);
    }
}

#[test]
fn a_fin_does_not_tear_the_body() {
    // Outside and inside: the fin is left open either way.
    for tip in [[-1.0, -1.0, 0.5], [0.4, 0.4, 0.5]] {
        let mut soup = cube(1);
        let at = |p: [f64; 3]| soup.positions.iter().position(|&q| q == p).unwrap() as u32;
        let (a, b) = (at([0.0, 0.0, 0.0]), at([0.0, 0.0, 1.0]));
        for fin in [[a, b, 8], [b, a, 8]] {
            let mut soup = soup.clone();
            soup.positions.push(tip);
            soup.faces.insert(0, fin);
            soup.face_material.push(NONE);
            let result = repaired(&soup);
            assert_eq!(result.components.len(), 2);
            assert_eq!(chi(result.components[1].mesh.as_ref().unwrap()), 2);
            assert_eq!(result.components[0].faces, 1);
            assert_eq!(count(&result, "cut_edges"), 1);
        }
        soup.positions.clear();
    }
}

#[test]
fn doubled_edges_are_split_at_their_midpoint() {
    // Two cells of a grid that touch along an edge, joined above and below that edge: its ends stay
    // one vertex each, and the edge is there twice.
    let cells: Vec<[i32; 3]> = vec![
        [0, 0, 0],
        [1, 1, 0],
        [0, 0, 1],
        [1, 0, 1],
        [1, 1, 1],
        [0, 0, -1],
        [1, 0, -1],
        [1, 1, -1],
    ];
    let solid = |p: [i32; 3]| cells.contains(&p);
    let mut faces = Vec::new();
    let mut positions = Vec::new();
    for &cell in &cells {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut next = cell;
                next[axis] += 2 * side - 1;
                if solid(next) {
                    continue;
                }
                let corner = |a: i32, b: i32| {
                    let mut p = cell;
                    p[axis] += side;
                    p[(axis + 1) % 3] += a;
                    p[(axis + 2) % 3] += b;
                    p.map(f64::from)
                };
                let q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let q = if side == 1 {
                    q
                } else {
                    [q[0], q[3], q[2], q[1]]
                };
                let start = positions.len() as u32;
                positions.extend(q);
                faces.extend([[start, start + 1, start + 2], [start, start + 2, start + 3]]);
            }
        }
    }
    let area_before = faces.len() as f64 / 2.0;
    let result = repaired(&soup(positions, faces));
    let mesh = only(&result);
    assert!((area(mesh) - area_before).abs() < 1e-12);
    assert_eq!(mesh.connectivity.topology().genus, 1);
    assert!(mesh.connectivity.is_closed());
    assert_eq!(count(&result, "cut_edges"), 1);
    assert_eq!(count(&result, "split_edges"), 1);
    let new: Vec<_> = mesh
        .source_vertex
        .enumerate()
        .filter(|(_, s)| **s == NONE)
        .collect();
    assert_eq!(mesh.positions[new[0].0], [1.0, 1.0, 0.5]);
}

#[test]
fn one_sided_strips_are_refused_and_the_others_built() {
    let both = together(&moebius(9), &octahedron());
    let result = repaired(&both);
    assert_eq!(result.components.len(), 2);
    let error = result.components[0].mesh.as_ref().unwrap_err();
    let ComponentError::NonOrientable {
        face,
        neighbour,
        faces,
    } = *error
    else {
        panic!("{error}");
    };
    assert!(face < 18 && neighbour < 18 && faces == 18);
    assert!(error.to_string().contains("Möbius"));
    assert_eq!(chi(result.components[1].mesh.as_ref().unwrap()), 2);
    assert_eq!(result.locate(3), Some((0, VertexId::new(3))));
    assert_eq!(count(&result, "flipped_faces"), 0);
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
