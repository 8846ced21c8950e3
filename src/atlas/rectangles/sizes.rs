//! Large patches divided, so that rectangles hold the surface about equally well.
//!
//! *Enters:* a [`Drawing`], and a budget of texels. *Leaves:* more walls on it. *Guaranteed:* every part is a disk. *Not guaranteed:* the best of all divisions.
//!
//! Strips of rectangles wander over the whole surface, so nearly all rectangles have as many samples: how densely a place is sampled is decided by how large the
//! rectangles there are. A patch of n sides becomes n of them; with area A its texels are √(A / n) long, in some unit, and its squared error is about b (A / n)^{3/2}, where b is the bend of
//! its edges (θ² L, as in `patches::demand`). Each division makes some rectangles more, with fewer texels for all others. It is made where the sum of errors falls by it.

use super::RectangleError;
use super::disk::Disk;
use super::division::{best_line, draw_between, part, places, regions};
use super::sides::{Drawing, Role};
use crate::geometry::ids::FaceId;
use crate::geometry::triangle::area;

/// Decibels that a division must gain.
const LEAST_GAIN: f64 = 0.03;
/// Divisions in one round are those that gain at least this part of what the best one gains: the others are judged again.
const SHARE: f64 = 0.5;
/// How often all patches are looked at.
const ROUNDS: usize = 24;
/// Quads that a division adds: six, for its line and two sides of neighbours are each counted on both sides, less what becomes of short sides.
const ADDED: f64 = 4.0;
/// Where nothing bends, texels are at most about twice as long as the mean: errors are equal where they follow the bend to the power of −1/5.
const FLOOR: f64 = 1.0 / 32.0;
/// Parts with fewer faces have no room for lines.
const LEAST_FACES: usize = 12;

/// A patch as its rectangles see it.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    sides: f64,
    /// Bend, over the patch.
    bend: f64,
    area: f64,
    /// Length of its border.
    border: f64,
}

impl Size {
    /// Squared error, if its rectangles had one texel each.
    fn error(&self) -> f64 {
        self.error_of(self.sides, 1.5)
    }

    /// The same if it were divided.
    fn divided(&self) -> f64 {
        self.error_of(self.sides + ADDED, 0.75)
    }

    fn error_of(&self, rectangles: f64, by_length: f64) -> f64 {
        // Four for a square: long patches have long rectangles, whose longer texels decide.
        let long = (self.border / (4.0 * self.area.sqrt())).max(1.0);
        let error = self.bend * (self.area / rectangles).powf(1.5) * long.powf(by_length);
        if error.is_finite() { error } else { 0.0 }
    }
}

/// Squared error of all, and their rectangles.
#[derive(Clone, Copy, Debug)]
struct Total {
    error: f64,
    rectangles: f64,
}

impl Total {
    fn of<'a>(sizes: impl Iterator<Item = &'a Size>) -> Self {
        let zero = Self {
            error: 0.0,
            rectangles: 0.0,
        };
        sizes.fold(zero, |sum, size| Self {
            error: sum.error + size.error(),
            rectangles: sum.rectangles + size.sides,
        })
    }

    /// Decibels of the squared error that are gained if this becomes `other`.
    fn gain(&self, other: Self, budget: usize) -> f64 {
        let before = self.with(budget);
        let gain = 10.0 * (before / other.with(budget)).log10();
        // Rounded: the last digits must not decide.
        let gain = (gain * 1e6).round() / 1e6;
        if gain.is_finite() { gain } else { 0.0 }
    }

    /// Squared error of rectangles that have equal shares of a budget. One row and column of each lie on its border twice.
    fn with(&self, budget: usize) -> f64 {
        let samples = (budget as f64 / self.rectangles).sqrt();
        self.error / (samples - 1.0).max(1.0).powi(3)
    }
}

/// Divides until nothing is gained.
pub(super) fn divide(drawing: &mut Drawing, budget: usize) -> Result<(), RectangleError> {
    let floor = floor(drawing);
    for _ in 0..ROUNDS {
        let found = regions(drawing).into_iter().map(|start| {
            let disk = part(drawing, start)?;
            let size = size(drawing, &disk, floor);
            Ok((start, size, disk.faces.len() >= LEAST_FACES))
        });
        let found: Vec<(FaceId, Size, bool)> = found.collect::<Result<_, RectangleError>>()?;
        let before = Total::of(found.iter().map(|(_, size, _)| size));
        let gain = |&(_, size, has_room): &(FaceId, Size, bool)| {
            let after = Total {
                error: before.error - size.error() + size.divided(),
                rectangles: before.rectangles + ADDED,
            };
            if has_room {
                before.gain(after, budget)
            } else {
                0.0
            }
        };
        let best = found.iter().map(gain).fold(0.0, f64::max);
        let mut drawn = 0;
        let worth = (SHARE * best).max(LEAST_GAIN);
        for (start, ..) in found.iter().filter(|one| gain(one) >= worth) {
            let mut disk = part(drawing, *start)?;
            let first = places(drawing, &disk, |role| role == Role::Node).next();
            disk.border.rotate_left(first.unwrap_or(0));
            if let Some(line) = best_line(drawing, &disk, true)? {
                draw_between(drawing, &disk, line)?;
                drawn += 1;
            }
        }
        if drawn == 0 {
            break;
        }
    }
    Ok(())
}

/// The least bend that a place counts as having.
fn floor(drawing: &Drawing) -> f64 {
    let (mut bend, mut whole) = (0.0, 0.0);
    for f in drawing.fine.connectivity.faces() {
        let area = face_area(drawing, f);
        bend += area * drawing.bend[drawing.fine.parent[f]];
        whole += area;
    }
    if whole > 0.0 {
        FLOOR * bend / whole
    } else {
        0.0
    }
}

fn face_area(drawing: &Drawing, f: FaceId) -> f64 {
    let c = &drawing.fine.connectivity;
    let lengths = c.face_edges(f).map(|e| drawing.fine.edge_length(e));
    area(lengths).unwrap_or(0.0)
}

fn size(drawing: &Drawing, disk: &Disk, floor: f64) -> Size {
    let mut size = Size {
        sides: places(drawing, disk, |role| role == Role::Node).count() as f64,
        ..Size::default()
    };
    for &f in &disk.faces {
        let area = face_area(drawing, f);
        size.bend += area * drawing.bend[drawing.fine.parent[f]].max(floor);
        size.area += area;
    }
    let border = disk.border.iter();
    size.border = border
        .map(|&h| drawing.fine.edge_length(disk.edge(&drawing.fine, h)))
        .sum();
    size
}
