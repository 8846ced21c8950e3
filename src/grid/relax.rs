//! The map of least distortion that is one to one: Newton's method on the symmetric Dirichlet energy.
//!
//! *Enters:* a [`GridMap`] without a face turned over. *Leaves:* the same with moved vertices: Σ area (‖J‖² + ‖J⁻¹‖²) over the faces is (nearly) least, where J takes the surface, lengths in cells, to the grid.
//! *Guaranteed:* every face keeps a positive area at every step, since the energy is infinite where one loses it; cones stay, lines stay on their lattice lines; the same for any number of threads. *Not guaranteed:* the
//! least of all maps: it is a local minimum.
//!
//! Steps end before the first face loses its area (Smith, Schaefer 2015); where that is early, the faces that are in the way are made wider first.

use super::density::Units;
use super::energy::{Energy, Places};
use super::error::GridError;
use super::map::{GridMap, Turning};
use super::squeezed::{BEFORE_FLAT, MOST_HALVINGS, SQUEEZED, SUFFICIENT, widen};
use super::system::Equations;
use super::triangle::is_turned_over;
use crate::geometry::ids::FaceId;
use crate::observe::{Observer, part};

/// Most steps.
const MOST_STEPS: usize = 40;
/// It ends where a step lowers the energy by less than this part.
const LEAST_GAIN: f64 = 1e-4;
/// It ends, too, where so many steps together …
const SEVERAL: usize = 5;
/// … lower the energy by less than this part: where a surface is thinner than a cell, each step ends at a face that it would turn over, and gains little for as long as there are more.
const LEAST_GAIN_OF_SEVERAL: f64 = 1e-2;
/// A step of less than this part of its length was stopped by squeezed faces.
const SHORT: f64 = 0.5;

/// What came of it.
#[derive(Clone, Copy, Debug)]
pub struct Relaxed {
    /// Steps.
    pub steps: usize,
    /// Mean of ‖J‖² + ‖J⁻¹‖² before and after, 4 for an isometry.
    pub energy: [f64; 2],
    /// Part of the area whose faces stay squeezed.
    pub squeezed: f64,
}

/// Moves vertices until the energy is least; see the module docs.
pub(crate) fn relax(
    map: &mut GridMap,
    unit: &Units,
    observer: &dyn Observer,
) -> Result<Relaxed, GridError> {
    let _part = part!("relax");
    let c = &map.sheet.fine.connectivity;
    let mut place: Vec<[f64; 2]> = c.vertices().map(|v| map.place(v)).collect();
    let energy = Energy::new(map, unit);
    let first = energy.total(&place);
    if !first.is_finite() {
        let flat = |f: &FaceId| energy.corners.corners(*f, &place);
        let over: Vec<FaceId> = c.faces().filter(|f| is_turned_over(flat(f))).collect();
        let face = over.first().copied().unwrap_or(FaceId::new(0));
        let count = over.len();
        return Err(GridError::TurnedOver { count, face });
    }
    let is_free: Vec<[bool; 2]> = map.freedom.iter().map(|f| f.axes()).collect();
    let may_move: Vec<bool> = is_free.iter().map(|axes| *axes != [false; 2]).collect();
    let triples = energy.faces.iter().map(|&f| energy.corners.vertices(f));
    let mut equations = Equations::new(triples, &may_move)?;
    let mut turning = Turning::new(map);
    let widened = |place: &mut Places, turning: &mut Turning| {
        let _part = part!("squeezed faces");
        let mut see = |place: &Places| turning.see(&energy.corners, place);
        widen(&energy, c, place, &is_free, &mut see);
        energy.total(place)
    };
    let mut now = widened(&mut place, &mut turning);
    let mut steps = 0;
    let mut before = vec![now];
    while steps < MOST_STEPS {
        if observer.cancelled() {
            return Err(GridError::Cancelled);
        }
        let of_face = |i: usize| energy.derivatives(energy.faces[i], &place);
        equations.sum(of_face, |v| is_free[v]);
        let (step, slope) = equations.newton_step()?;
        let Some((length, moved, there)) = search(&energy, &place, &step, now, slope) else {
            break;
        };
        steps += 1;
        let gain = (now - there) / now;
        let mean = there / energy.area;
        tracing::trace!(steps, energy = mean, length, "symmetric Dirichlet");
        (place, now) = (moved, there);
        turning.see(&energy.corners, &place);
        before.push(now);
        let is_slow =
            steps >= SEVERAL && now > (1.0 - LEAST_GAIN_OF_SEVERAL) * before[steps - SEVERAL];
        if is_slow || gain < LEAST_GAIN && length > SHORT {
            break;
        }
        if length < SHORT {
            now = widened(&mut place, &mut turning);
        }
    }
    let squeezed = energy.area_above(SQUEEZED, &place);
    let area = energy.area;
    turning.put(map, &energy.corners, &place);
    Ok(Relaxed {
        steps,
        squeezed: squeezed / area,
        energy: [first, now].map(|x| x / area),
    })
}

/// The length of the step that lowers the energy enough, where it leads, and the energy there.
fn search(
    energy: &Energy,
    place: &Places,
    step: &Places,
    now: f64,
    slope: f64,
) -> Option<(f64, Vec<[f64; 2]>, f64)> {
    let _part = part!("line search");
    let mut length = (BEFORE_FLAT * energy.longest_of_all(place, step)).min(1.0);
    for _ in 0..MOST_HALVINGS {
        let ends = place.iter().zip(step);
        let moved: Vec<[f64; 2]> = ends
            .map(|(p, s)| [p[0] + length * s[0], p[1] + length * s[1]])
            .collect();
        let there = energy.total(&moved);
        if there <= now + SUFFICIENT * length * slope {
            return Some((length, moved, there));
        }
        length *= 0.5;
    }
    None
}
