//! How much the colour changes across seams, beside how much it changes anywhere.
//!
//! *Enters:* a painted surface. *Leaves:* [`Steps`]: mean differences of channels (of 255) between two points at the same flat distance,
//! one texel of mean size, on the two sides of edges that are cut, of edges where patches end, and of all others.
//!
//! Points are looked up in the texture as a viewer would, half the distance to each side of an edge along its length. A pattern is not
//! equally varied everywhere, least of all at cones, where its centres lie: so seams are also compared with pairs of points of the
//! same direction right beside them, half the distance and one and a half from the edge.

use super::field::flat_area;
use super::paint::{Painted, in_texels};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{HalfedgeId, NONE};
use crate::read::flat::FlatSurface;

/// Mean differences, `None` where there is no such edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps {
    /// Across the cut.
    pub cut: Option<f64>,
    /// Right beside the cut, on either side.
    pub beside_cut: Option<f64>,
    /// Wherever texture coordinates jump: the cut, and where patches end without it.
    pub seams: Option<f64>,
    /// Right beside these, on either side.
    pub beside_seams: Option<f64>,
    /// Across all other edges.
    pub inside: Option<f64>,
    /// Distance between the two points, flat units.
    pub distance: f64,
}

struct Mean {
    sum: f64,
    length: f64,
}

impl Mean {
    const ZERO: Mean = Mean {
        sum: 0.0,
        length: 0.0,
    };

    fn add(&mut self, value: f64, length: f64) {
        self.sum += value * length;
        self.length += length;
    }

    fn value(&self) -> Option<f64> {
        (self.length > 0.0).then(|| self.sum / self.length)
    }
}

/// Measures a painted surface.
#[must_use]
pub fn steps(surface: &FlatSurface, connectivity: &Connectivity, painted: &Painted) -> Steps {
    let distance = (flat_area(surface) / painted.covered.max(1) as f64).sqrt();
    let [
        mut cut,
        mut beside_cut,
        mut seams,
        mut beside_seams,
        mut inside,
    ] = [const { Mean::ZERO }; 5];
    for e in connectivity.edges() {
        let h = connectivity.edge_halfedge(e);
        let Some(twin) = connectivity.twin(h) else {
            continue;
        };
        let sides = [(h, false), (twin, true)]
            .map(|(h, reversed)| Side::new(surface, connectivity, h, reversed, painted.size));
        let [Some(left), Some(right)] = sides else {
            continue;
        };
        let count = (left.length / distance).ceil().clamp(1.0, 1e4) as usize;
        let (mut sum, mut sum_beside) = (0.0, 0.0);
        for k in 0..count {
            let t = (k as f64 + 0.5) / count as f64;
            let near = [&left, &right].map(|side| painted.at(side.place(t, 0.5 * distance)));
            let far = [&left, &right].map(|side| painted.at(side.place(t, 1.5 * distance)));
            sum += difference(near[0], near[1]);
            sum_beside += 0.5 * (difference(near[0], far[0]) + difference(near[1], far[1]));
        }
        let [mean, beside] = [sum, sum_beside].map(|x| x / count as f64);
        let length = left.length;
        let (f, corner) = (connectivity.face(h).index(), connectivity.corner(h));
        if surface.segment[f][(corner + 2) % 3] != NONE {
            cut.add(mean, length);
            beside_cut.add(beside, length);
            seams.add(mean, length);
            beside_seams.add(beside, length);
        } else if left.is_apart(&right) {
            seams.add(mean, length);
            beside_seams.add(beside, length);
        } else {
            inside.add(mean, length);
        }
    }
    Steps {
        cut: cut.value(),
        beside_cut: beside_cut.value(),
        seams: seams.value(),
        beside_seams: beside_seams.value(),
        inside: inside.value(),
        distance,
    }
}

/// Where the inward normal of a side of a face, one flat unit long, comes to lie in a texture that is no similar copy of the chart. The side and
/// the third corner are given as corners.
fn straight_in(
    [from, to, apex]: [usize; 3],
    texels: [[f64; 2]; 3],
    chart: [[f64; 2]; 3],
) -> [f64; 2] {
    let span = |p: [[f64; 2]; 3], k: usize| [p[k][0] - p[from][0], p[k][1] - p[from][1]];
    let (side, rise) = (span(chart, to), span(chart, apex));
    let squared = side[0] * side[0] + side[1] * side[1];
    let height = (side[0] * rise[1] - side[1] * rise[0]) / squared.sqrt();
    let foot = (side[0] * rise[0] + side[1] * rise[1]) / squared;
    let (side, rise) = (span(texels, to), span(texels, apex));
    std::array::from_fn(|i| (rise[i] - foot * side[i]) / height)
}

/// Mean difference of the channels.
fn difference(a: [f64; 4], b: [f64; 4]) -> f64 {
    (0..4).map(|i| (a[i] - b[i]).abs()).sum::<f64>() / 4.0
}

/// An edge as one of its faces has it in the texture.
struct Side {
    ends: [[f64; 2]; 2],
    /// Into the face, texels a flat unit.
    inwards: [f64; 2],
    patch: u32,
    /// Flat length.
    length: f64,
}

impl Side {
    /// From the tail of the halfedge to its head, or the other way round. `None` where the edge has no length.
    fn new(
        surface: &FlatSurface,
        connectivity: &Connectivity,
        h: HalfedgeId,
        reversed: bool,
        size: usize,
    ) -> Option<Self> {
        let (face, corner) = (connectivity.face(h).index(), connectivity.corner(h));
        let (from, to) = (corner, (corner + 1) % 3);
        let texels = in_texels(surface, face, size);
        let chart = surface.central_uv[face];
        let span = |p: &[[f64; 2]; 3]| [p[to][0] - p[from][0], p[to][1] - p[from][1]];
        let (along, flat) = (span(&texels), span(&chart));
        let (texel_length, length) = (along[0].hypot(along[1]), flat[0].hypot(flat[1]));
        let inwards = match surface.patches[surface.patch[face] as usize].to_chart {
            // Rows run down, so that the left of the halfedge is on its right here.
            Some(_) => [along[1], -along[0]].map(|x| x / length),
            None => straight_in([from, to, (corner + 2) % 3], texels, chart),
        };
        let ends = if reversed {
            [texels[to], texels[from]]
        } else {
            [texels[from], texels[to]]
        };
        (texel_length > 0.0 && length > 0.0 && inwards.iter().all(|x| x.is_finite())).then_some(
            Self {
                ends,
                inwards,
                patch: surface.patch[face],
                length,
            },
        )
    }

    fn place(&self, t: f64, inwards: f64) -> [f64; 2] {
        let [a, b] = self.ends;
        std::array::from_fn(|i| a[i] + t * (b[i] - a[i]) + inwards * self.inwards[i])
    }

    /// True where the two faces have the edge at different places.
    fn is_apart(&self, other: &Side) -> bool {
        let far = |k: usize| {
            let [a, b] = [self.ends[k], other.ends[k]];
            (a[0] - b[0]).hypot(a[1] - b[1]) > 1e-3
        };
        self.patch != other.patch || far(0) || far(1)
    }
}
