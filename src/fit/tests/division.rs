//! Division of blocks that are drawn by hand.

use crate::fit::{Block, Blocks, Division, FitError, Neighbours, divide};
use crate::grid::blocks::Piece;
use std::collections::BTreeMap;

/// A border between cells, from the block on its left: block, side, number along the side counterclockwise.
type Edge = (usize, usize, usize);

/// Blocks from rectangles in the plane (first column, first row, columns, rows): those that touch there meet; `glued` are pairs of borders that meet besides.
fn blocks(rectangles: &[[usize; 4]], glued: &[(Edge, Edge)]) -> Vec<Block> {
    let edges = |b: usize| {
        let [_, _, w, h] = rectangles[b];
        (0..4).flat_map(move |s| (0..[w, h][s % 2]).map(move |i| (b, s, i)))
    };
    let ends = |(b, s, i): Edge| {
        let [x, y, w, h] = rectangles[b];
        match s {
            0 => [[x + i, y], [x + i + 1, y]],
            1 => [[x + w, y + i], [x + w, y + i + 1]],
            2 => [[x + w - i, y + h], [x + w - i - 1, y + h]],
            _ => [[x, y + h - i], [x, y + h - i - 1]],
        }
    };
    let all = (0..rectangles.len()).flat_map(edges);
    let by_ends: BTreeMap<[[usize; 2]; 2], Edge> = all.map(|edge| (ends(edge), edge)).collect();
    let across = |edge: Edge| {
        let [a, b] = ends(edge);
        let in_list = glued.iter().find_map(|&(p, q)| match edge {
            _ if edge == p => Some(q),
            _ if edge == q => Some(p),
            _ => None,
        });
        in_list.or_else(|| by_ends.get(&[b, a]).copied())
    };
    let side = |b: usize, s: usize| {
        let mut pieces: Vec<Piece> = Vec::new();
        for edge in edges(b).filter(|edge| edge.1 == s) {
            let across = across(edge);
            match (pieces.last_mut(), across) {
                (
                    Some(Piece {
                        length,
                        across: None,
                        ..
                    }),
                    None,
                ) => *length += 1,
                (
                    Some(Piece {
                        length,
                        across: Some(last),
                        ..
                    }),
                    Some((c, t, i)),
                ) if (c, t, i + 1) == *last => {
                    *length += 1;
                    last.2 -= 1;
                }
                _ => pieces.push(Piece {
                    start: edge.2,
                    length: 1,
                    across,
                }),
            }
        }
        pieces
    };
    let described = rectangles
        .iter()
        .enumerate()
        .map(|(b, &[_, _, w, h])| Block {
            cells: [w, h],
            sides: std::array::from_fn(|s| side(b, s)),
        });
    described.collect()
}

/// The division, if it covers all cells once and its sides meet as they must.
fn divided(rectangles: &[[usize; 4]], glued: &[(Edge, Edge)]) -> (Division, Neighbours) {
    let checked = Blocks::new(blocks(rectangles, glued)).expect("they fit each other");
    let division = divide(&checked);
    let mut is_covered: Vec<Vec<bool>> = rectangles
        .iter()
        .map(|&[_, _, w, h]| vec![false; w * h])
        .collect();
    for part in &division.parts {
        for j in part.first[1]..part.first[1] + part.cells[1] {
            for i in part.first[0]..part.first[0] + part.cells[0] {
                let cell = &mut is_covered[part.block][j * rectangles[part.block][2] + i];
                assert!(!std::mem::replace(cell, true), "{part:?} lies on another");
            }
        }
    }
    assert!(is_covered.iter().flatten().all(|&covered| covered));
    let samples: Vec<[usize; 2]> = division
        .parts
        .iter()
        .map(|part| part.cells.map(|n| 3 * n + 1))
        .collect();
    let neighbours = Neighbours::new(&samples, division.interfaces.clone());
    (division, neighbours.expect("whole sides"))
}

fn euler((division, neighbours): &(Division, Neighbours)) -> i64 {
    let edges = neighbours.interfaces.len() + neighbours.boundary.len();
    neighbours.corners as i64 - edges as i64 + division.parts.len() as i64
}

fn parts(division: &Division) -> Vec<(usize, [usize; 2], [usize; 2])> {
    let parts = division.parts.iter();
    parts
        .map(|part| (part.block, part.first, part.cells))
        .collect()
}

/// Blocks that meet whole stay whole.
#[test]
fn blocks_without_t_junctions_are_their_own_parts() {
    let found = divided(
        &[[0, 0, 2, 3], [2, 0, 4, 3], [0, 3, 2, 1], [2, 3, 4, 1]],
        &[],
    );
    assert_eq!(found.0.parts.len(), 4);
    assert_eq!((found.1.corners, found.1.interfaces.len()), (9, 4));
    assert_eq!(euler(&found), 1);
}

/// The corner between 0 and 1 divides 2, and the line goes on through 3. The corner between 2 and 3 divides 4, whose line ends at the boundary at once.
///
/// ```text
/// ┌─────────┬──┐
/// │    3    │  │
/// ├─────────┤ 4│
/// │    2    │  │
/// ├───┬─────┼──┤
/// │ 0 │  1  │ 5│
/// └───┴─────┴──┘
/// ```
#[test]
fn a_t_junction_goes_on_through_two_blocks() {
    let rectangles = [
        [0, 0, 2, 1],
        [2, 0, 3, 1],
        [0, 1, 5, 2],
        [0, 3, 5, 2],
        [5, 1, 1, 4],
        [5, 0, 1, 1],
    ];
    let found = divided(&rectangles, &[]);
    assert_eq!(
        parts(&found.0),
        [
            (0, [0, 0], [2, 1]),
            (1, [0, 0], [3, 1]),
            (2, [0, 0], [2, 2]),
            (2, [2, 0], [3, 2]),
            (3, [0, 0], [2, 2]),
            (3, [2, 0], [3, 2]),
            (4, [0, 0], [1, 2]),
            (4, [0, 2], [1, 2]),
            (5, [0, 0], [1, 1]),
        ]
    );
    assert_eq!(found.1.corners, 16);
    assert_eq!((found.1.interfaces.len(), found.1.boundary.len()), (12, 12));
    assert_eq!(euler(&found), 1);
}

/// Four bricks around a fifth, which meets each with a part of that one's side: lines go around until they meet the boundary.
#[test]
fn a_pinwheel_is_divided_into_nine() {
    let rectangles = [
        [1, 1, 1, 1],
        [0, 0, 2, 1],
        [2, 0, 1, 2],
        [1, 2, 2, 1],
        [0, 1, 1, 2],
    ];
    let found = divided(&rectangles, &[]);
    assert_eq!(found.0.parts.len(), 9);
    assert!(found.0.parts.iter().all(|part| part.cells == [1, 1]));
    assert_eq!((found.1.corners, euler(&found)), (16, 1));
}

/// The sides of one block glued crosswise, the second pair moved by `shift` cells.
fn torus([w, h]: [usize; 2], shift: usize) -> Vec<(Edge, Edge)> {
    let across = (0..h).map(|i| ((0, 1, i), (0, 3, h - 1 - i)));
    let up = (0..w).map(|i| ((0, 2, i), (0, 0, (2 * w - 1 - i - shift) % w)));
    across.chain(up).collect()
}

#[test]
fn a_torus_of_one_block_meets_itself() {
    let found = divided(&[[0, 0, 4, 3]], &torus([4, 3], 0));
    assert_eq!(found.0.parts.len(), 1);
    assert_eq!((found.1.corners, found.1.interfaces.len()), (1, 2));
    assert_eq!(euler(&found), 0);
    assert!(found.1.interfaces.iter().all(|i| !i.reversed));
}

/// Where the seam is moved by a cell, the line that begins at the corner goes around until every column is one of its own; moved by two of six, until it comes back.
#[test]
fn lines_around_a_torus_end_where_they_began() {
    for (w, shift, columns) in [(5, 1, 5), (5, 2, 5), (6, 2, 3), (6, 3, 2)] {
        let found = divided(&[[0, 0, w, 3]], &torus([w, 3], shift));
        assert_eq!(found.0.parts.len(), columns, "{w} {shift}");
        assert_eq!(euler(&found), 0);
        assert_eq!(found.1.corners, columns);
    }
}

/// A cube of six blocks, two of them joined into one: where its long side bends there is a T-junction on either side of it.
#[test]
fn a_cube_keeps_its_eight_corners() {
    // Front and right side in one, then the back, the left, the top and the bottom, each of 2 by 2 cells, laid apart.
    let rectangles = [
        [0, 0, 4, 2],
        [10, 0, 2, 2],
        [20, 0, 2, 2],
        [30, 0, 2, 2],
        [40, 0, 2, 2],
    ];
    let meet = |a: (usize, usize, usize), b: (usize, usize, usize)| {
        [
            ((a.0, a.1, a.2), (b.0, b.1, b.2 + 1)),
            ((a.0, a.1, a.2 + 1), b),
        ]
    };
    let glued: Vec<(Edge, Edge)> = [
        meet((0, 1, 0), (1, 3, 0)),
        meet((1, 1, 0), (2, 3, 0)),
        meet((2, 1, 0), (0, 3, 0)),
        // The top's bottom, right, top and left side are above front, right, back and left.
        meet((3, 0, 0), (0, 2, 2)),
        meet((3, 1, 0), (0, 2, 0)),
        meet((3, 2, 0), (1, 2, 0)),
        meet((3, 3, 0), (2, 2, 0)),
        // The bottom's top, right, bottom and left side are below them.
        meet((4, 2, 0), (0, 0, 0)),
        meet((4, 1, 0), (0, 0, 2)),
        meet((4, 0, 0), (1, 0, 0)),
        meet((4, 3, 0), (2, 0, 0)),
    ]
    .into_iter()
    .flatten()
    .collect();
    let found = divided(&rectangles, &glued);
    assert_eq!(found.0.parts.len(), 6);
    assert_eq!((found.1.corners, found.1.interfaces.len()), (8, 12));
    assert_eq!(euler(&found), 2);
}

/// A block of no cells has no sides to speak of.
#[test]
fn a_block_without_cells_is_refused() {
    let block = Block {
        cells: [0, 2],
        sides: [const { Vec::new() }; 4],
    };
    let refused = Blocks::new(vec![block]).expect_err("refused");
    let cells = [0, 2];
    assert_eq!(refused, FitError::NoCells { patch: 0, cells });
    insta::assert_snapshot!(refused, @"patch 0 has 0 columns and 2 rows of cells; it must have one of each at least");
}
