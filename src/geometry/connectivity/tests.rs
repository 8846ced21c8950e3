use super::*;

fn tetrahedron() -> Connectivity {
    Connectivity::from_faces(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], 4).unwrap()
}

fn square() -> Connectivity {
    Connectivity::from_faces(&[[0, 1, 2], [0, 2, 3]], 4).unwrap()
}

/// One vertex, three loops, two faces.
fn one_vertex_torus() -> Connectivity {
    let twin = [3, 4, 5, 0, 1, 2].map(|t| Some(HalfedgeId::new(t)));
    Connectivity::from_gluing(HalfedgeVec::filled(VertexId::new(0), 6), &twin, 1).unwrap()
}

#[test]
fn topology_of_small_surfaces() {
    let t = tetrahedron().topology();
    assert_eq!(
        (t.euler_characteristic, t.genus, t.boundary_loops),
        (2, 0, 0)
    );
    let t = square().topology();
    assert_eq!(
        (t.euler_characteristic, t.genus, t.boundary_loops),
        (1, 0, 1)
    );
    let t = one_vertex_torus().topology();
    assert_eq!(
        (t.euler_characteristic, t.genus, t.boundary_loops),
        (0, 1, 0)
    );
}

#[test]
fn boundary_vertices_start_at_the_boundary() {
    let s = square();
    s.validate().unwrap();
    assert_eq!(
        s.boundary_loops(),
        vec![[0, 1, 4, 5].map(HalfedgeId::new).to_vec()]
    );
    assert_eq!(s.valence(VertexId::new(0)), 3);
    let around: Vec<_> = s.neighbours(VertexId::new(0)).map(VertexId::raw).collect();
    assert_eq!(around, [1, 2, 3]);
}

#[test]
fn refusals_name_the_offender() {
    let err = |faces: &[[u32; 3]], n| Connectivity::from_faces(faces, n).unwrap_err();
    assert!(matches!(
        err(&[[0, 1, 5]], 3),
        ConnectivityError::VertexOutOfRange { vertex: 5, .. }
    ));
    assert!(matches!(
        err(&[[0, 1, 1]], 3),
        ConnectivityError::DegenerateFace { vertex: 1, .. }
    ));
    assert!(matches!(
        err(&[[0, 1, 2], [0, 1, 3]], 4),
        ConnectivityError::DoubledHalfedge {
            first: 0,
            second: 1,
            ..
        }
    ));
    assert!(matches!(
        err(&[[0, 1, 2]], 4),
        ConnectivityError::UnusedVertex { vertex: 3 }
    ));
    assert!(matches!(
        err(&[[0, 1, 2], [0, 3, 4]], 5),
        ConnectivityError::NonManifoldVertex { vertex: 0 }
    ));
}

#[test]
fn flips_keep_every_invariant() {
    for mut c in [tetrahedron(), square(), one_vertex_torus()] {
        let topology = c.topology();
        // A fixed, mixed sequence of flips drives small complexes through loops and doubled edges.
        let mut state = 7u64;
        for _ in 0..200 {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let e = EdgeId::new((state >> 33) as usize % c.edge_count());
            let h = c.edge_halfedge(e);
            let expected = c.twin(h).map(|t| [c.apex(t), c.apex(h)]);
            if c.flip(e).is_some() {
                assert_eq!(Some(c.edge_vertices(e)), expected);
            }
            c.validate().unwrap();
            assert_eq!(c.topology(), topology);
        }
    }
}

#[test]
fn four_flips_restore_the_square() {
    let mut c = square();
    let e = c.edges().find(|&e| !c.is_boundary_edge(e)).unwrap();
    let ends = c.edge_vertices(e);
    c.flip(e);
    assert_ne!(c.edge_vertices(e), ends);
    for _ in 0..3 {
        c.flip(e);
    }
    assert_eq!(c.edge_vertices(e), ends);
}

#[test]
fn splits_keep_every_invariant() {
    for mut c in [tetrahedron(), square(), one_vertex_torus()] {
        let chi = c.topology().euler_characteristic;
        for i in 0..60 {
            let before = c.topology();
            if i % 3 == 0 {
                let f = FaceId::new((i * 7) % c.face_count());
                let corners = c.face_vertices(f);
                let split = c.split_face(f);
                assert_eq!(c.valence(split.vertex), 3);
                for (i, face) in split.faces.into_iter().enumerate() {
                    let mut expected = corners;
                    expected[(i + 2) % 3] = split.vertex;
                    assert_eq!(c.face_vertices(face), expected);
                }
            } else {
                let e = EdgeId::new((i * 5) % c.edge_count());
                let side = c.edge_halfedge(e);
                let corners = c.face_vertices(c.face(side));
                let boundary = c.is_boundary_edge(e);
                let split = c.split_edge(e);
                assert_eq!(split.sides.len(), if boundary { 1 } else { 2 });
                let s = split.sides[0];
                if split.sides.len() == 1 || split.sides[1].old != s.old {
                    let (mut old, mut new) = (corners, corners);
                    old[(s.corner + 1) % 3] = split.vertex;
                    new[s.corner] = split.vertex;
                    assert_eq!(c.face_vertices(s.old), old);
                    assert_eq!(c.face_vertices(s.new), new);
                }
            }
            c.validate().unwrap();
            assert_eq!(c.topology().euler_characteristic, chi);
            assert_eq!(c.topology().vertices, before.vertices + 1);
        }
    }
}
