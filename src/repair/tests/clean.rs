//! Faces that say nothing of the surface.

use super::*;

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
fn a_corner_that_float32_rounds_off_its_line_is_on_it() {
    for (aside, removed) in [(5e-7, 1), (1e-4, 0)] {
        let result = repaired(&squeezed_cube(aside));
        assert_eq!(chi(only(&result)), 2);
        assert!((area(only(&result)) - 6.0 * 16.0).abs() < 1e-12);
        assert_eq!(count(&result, "removed_collinear_faces"), removed);
    }
}

/// Every face into four, by the middles of its edges; nothing is welded.
fn divided(soup: &Soup) -> Soup {
    let (mut positions, mut faces) = (soup.positions.clone(), Vec::new());
    let mut middle = std::collections::BTreeMap::new();
    for &[a, b, c] in &soup.faces {
        let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
            *middle.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                let ends = [p, q].map(|v| soup.positions[v as usize]);
                positions.push(std::array::from_fn(|i| 0.5 * (ends[0][i] + ends[1][i])));
                positions.len() as u32 - 1
            })
        });
        faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    corpus::soup(positions, faces)
}

/// Parts of a face without area lie on each other: vertices that no edge joins are at one place.
#[test]
fn parts_of_collinear_faces_meet_in_one_point() {
    for aside in [0.0, 3e-7] {
        let mut cube = squeezed_cube(aside);
        for times in 1..=3 {
            cube = divided(&cube);
            let result = repaired(&cube);
            let mesh = only(&result);
            assert_eq!(chi(mesh), 2);
            assert_eq!(mesh.connectivity.topology().boundary_loops, 0);
            assert!((area(mesh) - 6.0 * 16.0).abs() < 1e-4);
            // What float32 rounds apart leaves short edges.
            let least = if aside == 0.0 { 1e-5 } else { 0.0 };
            for f in mesh.connectivity.faces() {
                assert!(triangle_area(mesh.face_positions(f)) > least, "{times}");
            }
        }
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

/// A strip of `count` rectangles that bends by 20° at each side, given from both sides. The back has the other diagonals.
fn bent_card(count: u32) -> Soup {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let (mut x, mut z) = (0.0, 0.0);
    for k in 0..=count {
        positions.extend([[x, 0.0, z], [x, 1.0, z]]);
        let angle = f64::from(k) * 20f64.to_radians();
        (x, z) = (x + angle.cos(), z + angle.sin());
        if k < count {
            let [a, d, b, c] = [0, 1, 2, 3].map(|i| 2 * k + i);
            faces.extend([[a, b, c], [a, c, d], [a, d, b], [b, d, c]]);
        }
    }
    soup(positions, faces)
}

#[test]
fn of_cards_with_other_diagonals_on_their_backs_one_side_stays() {
    for count in [1, 2, 7] {
        let result = repaired(&bent_card(count));
        let mesh = only(&result);
        assert_eq!(chi(mesh), 1);
        assert_eq!(mesh.connectivity.topology().boundary_loops, 1);
        assert!((area(mesh) - f64::from(count)).abs() < 1e-12);
        assert_eq!(self::count(&result, "removed_back_faces"), 2 * count as u64);
        assert!(mesh.source_face.iter().all(|f| f % 4 < 2));
    }
    // A hexagon, whose back has no triangle and no diagonal of the front.
    let corner = |k: u32| [f64::from(k).cos(), f64::from(k).sin(), 0.0];
    let front = [[0, 1, 2], [0, 2, 4], [2, 3, 4], [0, 4, 5]];
    let back = [[1, 0, 3], [1, 3, 2], [3, 0, 5], [3, 5, 4]];
    let hexagon = soup((0..6).map(corner).collect(), [front, back].concat());
    assert_eq!(count(&repaired(&hexagon), "removed_back_faces"), 4);
    // Nor is a double pyramid one, however flat: its sides have vertices of their own.
    let mut positions: Vec<_> = (0..6).map(corner).collect();
    positions.extend([[0.0, 0.0, 1e-9], [0.0, 0.0, -1e-9]]);
    let sides = (0..6).flat_map(|k| [[k, (k + 1) % 6, 6], [(k + 1) % 6, k, 7]]);
    let flat = soup(positions, sides.collect());
    assert_eq!(count(&repaired(&flat), "removed_back_faces"), 0);
    // A lens is no sheet: it holds volume.
    let mut lens = hexagon;
    lens.positions[2][2] = 1e-4;
    assert_eq!(count(&repaired(&lens), "removed_back_faces"), 0);
}
