//! Large patches divided, so that rectangles hold the surface about equally well.
//!
//! *Enters:* a [`Drawing`], and a budget of texels. *Leaves:* more walls on it. *Guaranteed:* every part is a disk. *Not guaranteed:* the best of all divisions.
//!
//! Strips of rectangles wander over the whole surface, so nearly all rectangles have as many samples: how densely a place is sampled is decided by how large the
//! rectangles there are. A patch of n sides becomes n of them; with area A its texels are √(A / n) long, in some unit, and its squared error is about b (A / n)^{3/2}, where b is the bend of
//! its edges (θ² L, as in `patches::demand`). Each division makes some rectangles more, with fewer texels for all others. It is made where the sum of errors falls by it.

use super::RectangleError;
use super::division::{best_line, draw_between, part, places, regions};
use super::sides::{Drawing, Role};
use crate::geometry::ids::FaceId;
use crate::geometry::triangle::area;

/// Decibels that a division must gain.
const LEAST_GAIN: f64 = 0.03;
/// Divisions in one round are those that gain at least this part of what the best one gains: the others are judged again.
const SHARE: f64 = 0.5;
const ROUNDS: usize = 24;
/// Quads that a division adds: six, for its line and two sides of neighbours are each counted on both sides, less what becomes of short sides.
const ADDED: f64 = 4.0;
/// Where nothing bends, texels are at most about twice as long as the mean: errors are equal where they follow the bend to the power of −1/5.
const FLOOR: f64 = 1.0 / 32.0;
/// Parts with fewer faces have no room for lines.
const LEAST_FACES: usize = 12;

/// A patch as its rectangles see it.
struct Size {
    start: FaceId,
    sides: f64,
    /// Squared error, if its rectangles had one texel each.
    error: f64,
    /// The same if it were divided.
    divided: f64,
}

/// Divides until nothing is gained.
pub(super) fn divide(drawing: &mut Drawing, budget: usize) -> Result<(), RectangleError> {
    let floor = FLOOR * mean_bend(drawing);
    for _ in 0..ROUNDS {
        let sizes: Vec<Size> = regions(drawing)
            .into_iter()
            .map(|start| size(drawing, start, floor))
            .collect::<Result<_, _>>()?;
        let quads: f64 = sizes.iter().map(|s| s.sides).sum();
        let error: f64 = sizes.iter().map(|s| s.error).sum();
        let before = total(error, quads, budget);
        let gain = |s: &Size| {
            let after = total(error - s.error + s.divided, quads + ADDED, budget);
            // Rounded: the last digits must not decide.
            let gain = (10.0 * (before / after).log10() * 1e6).round() / 1e6;
            if gain.is_finite() { gain } else { 0.0 }
        };
        let best = sizes.iter().map(gain).fold(0.0, f64::max);
        let mut drawn = 0;
        for size in sizes
            .iter()
            .filter(|s| gain(s) >= (SHARE * best).max(LEAST_GAIN))
        {
            let mut disk = part(drawing, size.start)?;
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

/// Squared error of rectangles that have equal shares of a budget. One row and column of each lie on its border twice.
fn total(error: f64, quads: f64, budget: usize) -> f64 {
    let samples = (budget as f64 / quads).sqrt();
    error / (samples - 1.0).max(1.0).powi(3)
}

fn mean_bend(drawing: &Drawing) -> f64 {
    let (mut bend, mut whole) = (0.0, 0.0);
    for f in drawing.fine.connectivity.faces() {
        let area = face_area(drawing, f);
        bend += area * drawing.bend[drawing.fine.parent[f]];
        whole += area;
    }
    if whole > 0.0 { bend / whole } else { 0.0 }
}

fn face_area(drawing: &Drawing, f: FaceId) -> f64 {
    let c = &drawing.fine.connectivity;
    let lengths = c.face_edges(f).map(|e| drawing.fine.edge_length(e));
    area(lengths).unwrap_or(0.0)
}

fn size(drawing: &Drawing, start: FaceId, floor: f64) -> Result<Size, RectangleError> {
    let disk = part(drawing, start)?;
    let sides = places(drawing, &disk, |role| role == Role::Node).count() as f64;
    let (mut bend, mut whole) = (0.0, 0.0);
    for &f in &disk.faces {
        let area = face_area(drawing, f);
        bend += area * drawing.bend[drawing.fine.parent[f]].max(floor);
        whole += area;
    }
    let border = disk.border.iter();
    let perimeter: f64 = border
        .map(|&h| drawing.fine.edge_length(disk.edge(&drawing.fine, h)))
        .sum();
    // Four for a square: long patches have long rectangles, whose longer texels decide.
    let long = (perimeter / (4.0 * whole.sqrt())).max(1.0);
    let error = bend * (whole / sides).powf(1.5) * long.powf(1.5);
    let divided = bend * (whole / (sides + 4.0)).powf(1.5) * long.powf(0.75);
    let is_fine = error.is_finite() && divided.is_finite() && disk.faces.len() >= LEAST_FACES;
    Ok(Size {
        start,
        sides,
        error: if is_fine { error } else { 0.0 },
        divided: if is_fine { divided } else { 0.0 },
    })
}
