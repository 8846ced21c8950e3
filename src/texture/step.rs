//! How much the colour changes across seams, beside how much it changes right beside them.
//!
//! *Enters:* a painted surface. *Leaves:* [`Steps`]: mean differences of channels (of 255) between pairs of points two texels apart.
//!
//! Points are looked up in the texture as a viewer would. A pair across an edge has one point half a texel on one side and the other one and a
//! half on the other side, both ways: pairs at the same distance from an edge would find nothing where it is a mirror of the pattern, as
//! borders of tiles often are. A pattern is not equally varied everywhere, and edges of patches are borders of tiles: so each
//! pair is also looked up one whole tile farther into the patch of its second point, where the pattern is the same. Pairs that would lie outside of that
//! patch are left out of both.

use super::paint::Painted;
use super::tiling::Tiling;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::HalfedgeId;
use crate::read::gridded::{GriddedSurface, Packing};

/// Distances of the two points of a pair from the edge, texels: the first outside, the second inside.
const PAIR: [f64; 2] = [-0.5, 1.5];

/// Most places along an edge.
const MOST_PLACES: f64 = 1e4;

/// Mean differences, `None` where there is no such edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps {
    /// Across edges where frames of the grid turn: there a pattern jumps that changes when it is turned.
    pub cut: Option<f64>,
    /// Right beside these, on either side.
    pub beside_cut: Option<f64>,
    /// Across edges where texture coordinates jump.
    pub seams: Option<f64>,
    /// Right beside these, on either side.
    pub beside_seams: Option<f64>,
}

/// Differences across edges of one kind and beside them.
#[derive(Clone, Copy, Default)]
struct Means {
    across: f64,
    beside: f64,
    length: f64,
}

impl Means {
    fn add(&mut self, other: Means) {
        self.across += other.across;
        self.beside += other.beside;
        self.length += other.length;
    }

    fn values(&self) -> [Option<f64>; 2] {
        [self.across, self.beside].map(|x| (self.length > 0.0).then(|| x / self.length))
    }
}

/// Measures a painted surface.
#[must_use]
pub fn steps(
    surface: &GriddedSurface,
    connectivity: &Connectivity,
    tiling: &Tiling,
    painted: &Painted,
) -> Steps {
    let viewer = Viewer {
        surface,
        painted,
        ranges: ranges(surface),
        tile: 1.0 / f64::from(tiling.tiles_per_cell),
    };
    let (mut cut, mut seams) = (Means::default(), Means::default());
    for e in connectivity.edges() {
        let h = connectivity.edge_halfedge(e);
        let Some(twin) = connectivity.twin(h) else {
            continue;
        };
        let (f, corner) = (connectivity.face(h).index(), connectivity.corner(h));
        let is_cut = surface.turns[f][(corner + 2) % 3] != 0;
        let left = Side::new(surface, connectivity, h);
        let right = Side::new(surface, connectivity, twin).reversed();
        let is_seam = viewer.is_apart(&left, &right);
        if is_cut || is_seam {
            let found = viewer.along([left, right]);
            if is_cut {
                cut.add(found);
            }
            if is_seam {
                seams.add(found);
            }
        }
    }
    let ([cut, beside_cut], [seams, beside_seams]) = (cut.values(), seams.values());
    Steps {
        cut,
        beside_cut,
        seams,
        beside_seams,
    }
}

/// Least and greatest coordinates of every patch.
fn ranges(surface: &GriddedSurface) -> Vec<[[f64; 2]; 2]> {
    let mut ranges = vec![[[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]]; surface.patches.len()];
    for (&patch, corners) in surface.patch.iter().zip(&surface.patch_uv) {
        let [low, high] = &mut ranges[patch as usize];
        for p in corners {
            *low = std::array::from_fn(|i| low[i].min(p[i]));
            *high = std::array::from_fn(|i| high[i].max(p[i]));
        }
    }
    ranges
}

/// Looks up colours at places of patches.
struct Viewer<'a> {
    surface: &'a GriddedSurface,
    painted: &'a Painted,
    ranges: Vec<[[f64; 2]; 2]>,
    /// Side of a tile, cells.
    tile: f64,
}

impl Viewer<'_> {
    fn in_texels(&self, patch: u32, p: [f64; 2]) -> [f64; 2] {
        let Packing { scale, translation } = self.surface.patches[patch as usize];
        let [u, v]: [f64; 2] = std::array::from_fn(|i| scale * p[i] + translation[i]);
        let size = self.painted.size as f64;
        [size * u, size * (1.0 - v)]
    }

    /// Side of a texel, cells.
    fn texel(&self, side: &Side) -> f64 {
        let packing = self.surface.patches[side.patch as usize];
        1.0 / (packing.scale * self.painted.size as f64)
    }

    /// True where the two faces have the edge at different places of the texture.
    fn is_apart(&self, left: &Side, right: &Side) -> bool {
        let is_far = |k: usize| {
            let [[a, b], [c, d]] =
                [left, right].map(|side| self.in_texels(side.patch, side.ends[k]));
            (a - c).hypot(b - d) > 1e-3
        };
        left.patch != right.patch || is_far(0) || is_far(1)
    }

    /// The mean difference of the channels at two places.
    fn difference(&self, places: [(u32, [f64; 2]); 2]) -> f64 {
        let [a, b] = places.map(|(patch, p)| self.painted.at(self.in_texels(patch, p)));
        (0..4).map(|i| (a[i] - b[i]).abs()).sum::<f64>() / 4.0
    }

    /// Across an edge and beside it.
    fn along(&self, [left, right]: [Side; 2]) -> Means {
        let texel = self.texel(&left).max(self.texel(&right));
        let count = (left.length / texel).ceil().clamp(1.0, MOST_PLACES);
        let mut means = Means::default();
        for k in 0..count as usize {
            let t = (k as f64 + 0.5) / count;
            for (side, other) in [(&left, &right), (&right, &left)] {
                let moved = PAIR.map(|x| side.tile_away(side.place(t, x * texel), self.tile));
                let [low, high] = self.ranges[side.patch as usize];
                let is_inside = |p: &[f64; 2]| (0..2).all(|i| low[i] <= p[i] && p[i] <= high[i]);
                if !moved.iter().all(is_inside) {
                    continue;
                }
                let near = other.place(t, -PAIR[0] * texel);
                let far = side.place(t, PAIR[1] * texel);
                let weight = left.length / count;
                means.add(Means {
                    across: weight * self.difference([(other.patch, near), (side.patch, far)]),
                    beside: weight * self.difference(moved.map(|p| (side.patch, p))),
                    length: weight,
                });
            }
        }
        means
    }
}

/// An edge as one of its faces has it in its patch.
struct Side {
    patch: u32,
    ends: [[f64; 2]; 2],
    /// Into the face, of length 1.
    inwards: [f64; 2],
    /// Cells.
    length: f64,
}

impl Side {
    /// From the tail of the halfedge to its head.
    fn new(surface: &GriddedSurface, connectivity: &Connectivity, h: HalfedgeId) -> Self {
        let (face, corner) = (connectivity.face(h).index(), connectivity.corner(h));
        let corners = surface.patch_uv[face];
        let ends = [corners[corner], corners[(corner + 1) % 3]];
        let [x, y] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let length = x.hypot(y);
        Self {
            patch: surface.patch[face],
            ends,
            inwards: [-y / length, x / length],
            length,
        }
    }

    /// The other way round.
    fn reversed(self) -> Self {
        let [a, b] = self.ends;
        Self {
            ends: [b, a],
            ..self
        }
    }

    fn place(&self, t: f64, inwards: f64) -> [f64; 2] {
        let [a, b] = self.ends;
        std::array::from_fn(|i| a[i] + t * (b[i] - a[i]) + inwards * self.inwards[i])
    }

    /// Moved by one tile along the axis that is nearest to the way into the face.
    fn tile_away(&self, p: [f64; 2], tile: f64) -> [f64; 2] {
        let [x, y] = self.inwards;
        match x.abs() > y.abs() {
            true => [p[0] + tile.copysign(x), p[1]],
            false => [p[0], p[1] + tile.copysign(y)],
        }
    }
}
