//! Against another program: Newton in Penner coordinates with numpy and scipy, written apart from this one. It was given these triangulations, lengths, loops and signatures, and takes
//! every edge for equally heavy. λ of six edges, and Σ λ² of all.

use super::*;

/// Edge and λ.
type Sample = (usize, f64);

const TORUS: [Sample; 6] = [
    (0, 0.9929783504588),
    (31, 0.6942585855008),
    (63, 0.5241139333919),
    (94, 1.6245152891183),
    (126, 0.5779951847143),
    (157, 0.7742242042280),
];
const GENUS_2: [Sample; 6] = [
    (0, -1.2336462651143),
    (100, -0.4713996409594),
    (200, -1.6604585125526),
    (300, -1.0378752634900),
    (400, -1.6286604252978),
    (500, -1.8661984737894),
];
const GENUS_3: [Sample; 6] = [
    (0, -1.1852203896475),
    (136, -1.0284145972391),
    (272, -0.9219477427556),
    (408, -1.0354244452364),
    (544, -1.3098870194036),
    (680, -1.4850382593995),
];

// Vertices of three and of five quarter turns; the others have four.
const TORUS_CONES: [&[usize]; 2] = [&[0, 7, 14, 35, 42, 50], &[17, 24, 31, 53, 58, 59]];
const GENUS_2_CONES: [&[usize]; 2] = [
    &[0, 4, 44, 50, 79, 158, 163, 190, 192],
    &[
        18, 22, 33, 35, 65, 67, 74, 77, 97, 101, 109, 111, 135, 137, 144, 147, 152,
    ],
];
const GENUS_3_CONES: [&[usize]; 2] = [
    &[0, 4, 44, 50, 79, 218, 228, 233, 260, 262],
    &[
        18, 22, 33, 35, 65, 67, 74, 77, 85, 97, 101, 109, 111, 135, 137, 144, 147, 153, 167, 171,
        179, 181, 205, 207, 214, 217,
    ],
];

#[test]
fn another_program_finds_the_same_lengths() {
    let cases = [
        (
            shapes::torus(9, 7),
            (TORUS_CONES, vec![3, 0]),
            TORUS,
            142.287807030497,
            5,
        ),
        (
            shapes::plate(2, 2),
            (GENUS_2_CONES, vec![2, 0, -1, 1]),
            GENUS_2,
            907.501224680668,
            5,
        ),
        (
            shapes::plate(3, 2),
            (GENUS_3_CONES, vec![2, 0, -1, 1, -2, 1]),
            GENUS_3,
            1147.4385887202,
            4,
        ),
    ];
    for (shape, (cones, turning), samples, squares, steps) in cases {
        let mut prepared = prepare(&shape);
        let mut cone = VertexVec::filled(4, prepared.c.vertex_count());
        for (quarters, vertices) in [3, 5].into_iter().zip(cones) {
            vertices
                .iter()
                .for_each(|&v| cone[VertexId::new(v)] = quarters);
        }
        prepared.signature = Signature { cone, turning };
        let norm = Norm::uniform(&prepared.c, 0.0);
        let (problem, params) = (prepared.problem(), SeamlessParams::default());
        let (start, reuse) = (prepared.start(), Reuse::AtTheEnd);
        let found = newton::solve(&problem, start, &norm, reuse, &params, &()).unwrap();
        assert_eq!(found.history.len() - 1, steps);
        for (e, expected) in samples {
            let penner = found.penner[EdgeId::new(e)];
            // Logarithms of lengths to 1e-8.
            assert!(
                (penner - expected).abs() < 2e-8,
                "{}: {penner} against {expected}",
                shape.name
            );
        }
        let sum: f64 = found.penner.iter().map(|l| l * l).sum();
        assert!(
            (sum / squares - 1.0).abs() < 1e-9,
            "{}: {sum} against {squares}",
            shape.name
        );
    }
}
