//! Patches: connected, continuous, similar to the central chart, injective, of bounded scale.

use super::arrays::{Arrays, NONE};
use super::central::{FLOOR, Slit, at_corner, length_tolerance};
use super::document::{Document, Patch};
use super::formulas::{Extent2, Point2, Turn, Worst, distance2, is_positive, lengths2, longest};
use super::grid::Grid;
use super::shapes::Shapes;
use super::surface::{Surface, UnionFind};
use super::{Verdicts, VerifyOptions, border};
use crate::parallel;
use rayon::prelude::*;

/// Faces overlap where they share more than this, in diameters of the patch.
const OVERLAP_TOLERANCE: f64 = 1e-9;
/// Largest distance between the central chart and a patch moved onto it, in diameters of the chart.
const SIMILARITY_TOLERANCE: f64 = 1e-7;

/// Faces of every patch, ascending.
pub(super) struct Groups {
    start: Vec<usize>,
    faces: Vec<u32>,
}

impl Groups {
    fn new(patch: &[u32], patches: usize) -> Self {
        let mut start = vec![0; patches + 1];
        for p in patch {
            start[*p as usize + 1] += 1;
        }
        for p in 0..patches {
            start[p + 1] += start[p];
        }
        let mut next = start.clone();
        let mut faces = vec![0; patch.len()];
        for (face, p) in (0u32..).zip(patch) {
            faces[next[*p as usize]] = face;
            next[*p as usize] += 1;
        }
        Self { start, faces }
    }

    /// Faces of a patch.
    pub fn of(&self, patch: usize) -> &[u32] {
        &self.faces[self.start[patch]..self.start[patch + 1]]
    }
}

/// What is measured of one patch.
struct Measured {
    shape: f64,
    flipped: bool,
    dissimilar: bool,
    overlap: Overlap,
    log_scale_range: f64,
}

/// What came of looking for overlaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Overlap {
    /// There is none.
    None,
    /// These two triangles do.
    Pair(usize, usize),
    /// Too many long and thin triangles to be decided in bounded work.
    Undecided,
}

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    shapes: &Shapes,
    options: &VerifyOptions,
    slit: &Slit,
    verdicts: &mut Verdicts,
) -> Option<Groups> {
    let patches = document.patches.len();
    let stray = arrays
        .patch
        .iter()
        .filter(|p| **p as usize >= patches)
        .count();
    if !verdicts.note(
        "every face in a patch",
        stray == 0,
        format!("{patches} patches, {stray} faces outside"),
    ) {
        return None;
    }
    let groups = Groups::new(&arrays.patch, patches);
    let empty = (0..patches).filter(|p| groups.of(*p).is_empty()).count();
    verdicts.note(
        "every patch has faces",
        empty == 0,
        format!("{empty} empty"),
    );
    check_inside(surface, arrays, document, &groups, options, verdicts);
    let measured: Vec<Measured> = parallel::map(&document.patches, |_, patch| {
        measure(surface, arrays, patch, groups.of(patch.id), shapes, slit)
    });
    let mut shape = Worst::default();
    let mut range = Worst::default();
    let mut overlapping = Vec::new();
    let mut bad = 0;
    for (id, m) in measured.iter().enumerate() {
        shape.see(m.shape);
        range.see(m.log_scale_range);
        match m.overlap {
            Overlap::None => {}
            Overlap::Pair(a, b) => {
                let (a, b) = (groups.of(id)[a], groups.of(id)[b]);
                overlapping.push(format!("patch {id} at faces {a} and {b}"));
            }
            Overlap::Undecided => overlapping.push(format!("patch {id} is too thin to be tested")),
        }
        bad += usize::from(m.flipped || m.dissimilar || !matches!(m.overlap, Overlap::None));
    }
    verdicts.note(
        "patches keep flat lengths at their scale",
        shape.0 < length_tolerance(document),
        format!("{:.3e} of the face's longest edge", shape.0),
    );
    verdicts.note(
        "no two faces of a patch overlap",
        overlapping.is_empty(),
        overlapping[..overlapping.len().min(4)].join(", "),
    );
    verdicts.note(
        "patches are similar to the central chart, positive, injective",
        bad == 0,
        format!("{bad} patches"),
    );
    let bound = options.log_scale_range.unwrap_or(f64::MAX);
    verdicts.note(
        "log scale range inside a patch is bounded",
        range.0 <= bound * (1.0 + 1e-9),
        format!("{:.4}", range.0),
    );
    Some(groups)
}

/// Connected and continuous across edges that are not cut; blocks may lie across the cut, and then have the same coordinates on both sides.
fn check_inside(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    groups: &Groups,
    options: &VerifyOptions,
    verdicts: &mut Verdicts,
) {
    let patches = groups.start.len() - 1;
    let diameter: Vec<f64> = (0..patches)
        .map(|p| extent(arrays, groups.of(p)).diagonal())
        .collect();
    let mut sheets = UnionFind::new(arrays.faces.len());
    let mut gap = Worst::default();
    for (h, t) in surface.inner_edges() {
        let (f, g) = (h / 3, t / 3);
        let patch = document.patches.get(arrays.patch[f] as usize);
        if !goes_on(surface, arrays, patch, [h, t]) {
            continue;
        }
        sheets.join(f, g);
        for [a, b] in ends(surface, arrays, [h, t]) {
            gap.see(distance2(a, b) / diameter[arrays.patch[f] as usize]);
        }
    }
    let loose = (0..patches)
        .filter(|p| {
            let faces = groups.of(*p);
            let first = faces.first().map(|f| sheets.find(*f as usize));
            faces
                .iter()
                .any(|f| Some(sheets.find(*f as usize)) != first)
        })
        .count();
    verdicts.note(
        "every patch is connected off the cut",
        loose == 0,
        format!("{loose} patches in pieces"),
    );
    verdicts.note(
        "patches are continuous inside",
        gap.0 < options.tolerance,
        format!("{:.3e} of the patch's diameter", gap.0),
    );
}

/// Ends of an edge in its patch, each as either side has it.
fn ends(surface: &Surface<'_>, arrays: &Arrays, [h, t]: [usize; 2]) -> [[Point2; 2]; 2] {
    [
        (surface.tail_corner(h), surface.head_corner(t)),
        (surface.head_corner(h), surface.tail_corner(t)),
    ]
    .map(|(a, b)| [a, b].map(|corner| at_corner(&arrays.patch_uv, corner)))
}

/// Whether a patch goes on across an edge between two faces: off the cut, and over the cut where both sides agree in a block of a grid, which has
/// coordinates of its own.
fn goes_on(
    surface: &Surface<'_>,
    arrays: &Arrays,
    patch: Option<&Patch>,
    [h, t]: [usize; 2],
) -> bool {
    let is_block = || patch.is_some_and(|patch| patch.domain != "flat");
    let agree = || (ends(surface, arrays, [h, t]).iter()).all(|[a, b]| a == b);
    arrays.patch[h / 3] == arrays.patch[t / 3]
        && (arrays.cut.as_flattened()[h] == 0 || is_block() && agree())
}

pub(super) fn extent(arrays: &Arrays, faces: &[u32]) -> Extent2 {
    Extent2::of(faces.iter().flat_map(|f| arrays.patch_uv[*f as usize]))
}

fn measure(
    surface: &Surface<'_>,
    arrays: &Arrays,
    patch: &Patch,
    faces: &[u32],
    shapes: &Shapes,
    slit: &Slit,
) -> Measured {
    let extent = extent(arrays, faces);
    let (diameter, reach) = (extent.diagonal(), extent.reach());
    let uv = |f: u32| arrays.patch_uv[f as usize];
    let mut shape = Worst::default();
    let mut apart = Worst::default();
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    if let Some(map) = &patch.patch_to_chart {
        let turn = Turn::by(map.rotation);
        for f in faces {
            let flat = arrays.flat_length[*f as usize];
            let (l, central) = (lengths2(uv(*f)), arrays.central_uv[*f as usize]);
            let mut worst = Worst::default();
            for k in 0..3 {
                let error = (map.scale * l[k] - flat[k]).abs() - FLOOR * map.scale * diameter;
                worst.see(error.max(0.0));
                let p = turn.apply(uv(*f)[k]);
                let q = std::array::from_fn(|i| map.scale * p[i] + map.translation[i]);
                apart.see(distance2(q, central[k]));
            }
            shape.see(worst.0 / longest(flat));
        }
        shape.see(if map.scale > 0.0 { 0.0 } else { f64::INFINITY });
    }
    for f in faces.iter().map(|f| *f as usize) {
        if shapes.is_well[f] {
            let scale = shapes.log_scale[f];
            range = [range[0].min(scale), range[1].max(scale)];
        }
    }
    // Blocks of a grid are not similar to the chart.
    let lacks_map = patch.patch_to_chart.is_none() && patch.domain == "flat";
    let flipped = faces.iter().any(|f| !is_positive(uv(*f), reach));
    let tolerance = OVERLAP_TOLERANCE * diameter;
    let inside = |h: usize| {
        let beyond = surface.twin(h);
        beyond.is_some_and(|t| goes_on(surface, arrays, Some(patch), [h, t]))
    };
    let simple = !flipped && border::is_simple(surface, arrays, faces, inside, tolerance);
    let overlap = match simple {
        true => Overlap::None,
        false => {
            let triangles: Vec<[Point2; 3]> = faces.iter().map(|f| uv(*f)).collect();
            find_overlap(&triangles, tolerance)
        }
    };
    Measured {
        shape: shape.0,
        flipped,
        dissimilar: lacks_map || apart.0 > SIMILARITY_TOLERANCE * slit.diameter,
        overlap,
        log_scale_range: (range[1] - range[0]).max(0.0),
    }
}

/// Two counterclockwise triangles that share more than `tolerance` (a length), if there are any.
pub(super) fn find_overlap(triangles: &[[Point2; 3]], tolerance: f64) -> Overlap {
    let limit = (256 * triangles.len() + 100_000).min(NONE as usize - 1);
    // So many entries or pairs come from triangles that all lie on each other, or that all are long and
    // thin: the first few tell the former.
    let few = &triangles[..triangles.len().min(512)];
    let Ok(grid) = Grid::new(triangles, tolerance, limit) else {
        return find_overlap_directly(few, tolerance);
    };
    let pairs: u64 = (0..grid.cells())
        .map(|cell| (grid.cell_items(cell).len() as u64).pow(2))
        .sum();
    if pairs > 5000 * triangles.len() as u64 + 10_000_000 {
        return find_overlap_directly(few, tolerance);
    }
    let found = (0..grid.cells()).into_par_iter().find_map_first(|cell| {
        let items = grid.cell_items(cell);
        for (i, a) in items.iter().enumerate() {
            for b in &items[i + 1..] {
                let (a, b) = (*a as usize, *b as usize);
                if overlap(&triangles[a], &triangles[b], tolerance) {
                    return Some(Overlap::Pair(a, b));
                }
            }
        }
        None
    });
    found.unwrap_or(Overlap::None)
}

fn find_overlap_directly(triangles: &[[Point2; 3]], tolerance: f64) -> Overlap {
    for (i, a) in triangles.iter().enumerate() {
        for (j, b) in triangles.iter().enumerate().skip(i + 1) {
            if overlap(a, b, tolerance) {
                return Overlap::Pair(i, j);
            }
        }
    }
    Overlap::Undecided
}

/// Whether the interiors of two counterclockwise triangles meet by more than `tolerance`: no edge of either
/// has the other triangle on its outer side.
fn overlap(a: &[Point2; 3], b: &[Point2; 3], tolerance: f64) -> bool {
    for i in 0..2 {
        let low = |t: &[Point2; 3]| t[0][i].min(t[1][i]).min(t[2][i]);
        let high = |t: &[Point2; 3]| t[0][i].max(t[1][i]).max(t[2][i]);
        if high(a) - low(b) <= tolerance || high(b) - low(a) <= tolerance {
            return false;
        }
    }
    !(separates(a, b, tolerance) || separates(b, a, tolerance))
}

/// Whether an edge of `a` has `b` on its outer side.
fn separates(a: &[Point2; 3], b: &[Point2; 3], tolerance: f64) -> bool {
    (0..3).any(|k| {
        let (p, q) = (a[k], a[(k + 1) % 3]);
        let length = distance2(p, q);
        length > 0.0
            && b.iter().all(|r| {
                let inward = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
                inward <= tolerance * length
            })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_touch_but_do_not_overlap() {
        let a = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let neighbour = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let shifted = neighbour.map(|p| [p[0] - 0.01, p[1]]);
        assert!(!overlap(&a, &neighbour, 1e-9));
        assert!(overlap(&a, &shifted, 1e-9));
        assert!(overlap(&a, &a, 1e-9));
        assert!(overlap(&a, &[[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]], 1e-9));
    }

    #[test]
    fn overlaps_agree_with_testing_every_pair() {
        // A strip that winds around and comes back over its own beginning, or stops before.
        for (steps, expected) in [(20u32, false), (30, true)] {
            let uv: Vec<[Point2; 3]> = (0..steps)
                .flat_map(|i| {
                    let at = |i: u32, r: f64| {
                        let (s, c) = (f64::from(i) * 0.25).sin_cos();
                        [r * c, r * s]
                    };
                    let (a, b) = (at(i, 1.0), at(i, 2.0));
                    let (c, d) = (at(i + 1, 2.0), at(i + 1, 1.0));
                    [[a, b, c], [a, c, d]]
                })
                .collect();
            let found = matches!(find_overlap(&uv, 4e-9), Overlap::Pair(..));
            let brute = uv
                .iter()
                .enumerate()
                .any(|(i, a)| uv[i + 1..].iter().any(|b| overlap(a, b, 4e-9)));
            assert_eq!((found, brute), (expected, expected));
        }
    }

    #[test]
    fn a_heap_of_the_same_face_is_found_in_bounded_work() {
        let heap = vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; 50_000];
        assert!(matches!(find_overlap(&heap, 1e-9), Overlap::Pair(..)));
    }
}
