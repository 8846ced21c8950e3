//! Closed components whose faces look inward.
//!
//! *Enters:* components. *Leaves:* those that are closed, have a negative volume, and lie in the box of no other closed one: the others may bound cavities. *Not guaranteed:* that
//! components which cross themselves have a volume that says which side is out.

use super::Component;
use crate::geometry::mesh::{Mesh, bounding_box, cross, dot, sub};

/// Signed volume of a closed mesh, cubed units of its own; `None` of an open one.
fn volume(mesh: &Mesh) -> Option<f64> {
    let c = &mesh.connectivity;
    if c.topology().boundary_loops > 0 {
        return None;
    }
    let from = mesh.positions.iter().next()?;
    let six = c.faces().map(|f| {
        let [p, q, r] = mesh.face_positions(f).map(|p| sub(p, *from));
        dot(p, cross(q, r))
    });
    Some(six.sum::<f64>() / 6.0)
}

/// Least and greatest coordinates, source units.
type Bounds = ([f64; 3], [f64; 3]);

/// See the module docs; ascending.
pub fn inside_out(components: &[Component]) -> Vec<usize> {
    let closed = |component: &Component| -> Option<(f64, Bounds)> {
        let mesh = component.mesh.as_ref().ok()?;
        let volume = volume(mesh)?;
        let (low, high) = bounding_box(mesh.positions.as_slice());
        let [low, high] = [low, high].map(|p| component.frame.leave(p));
        Some((volume, (low, high)))
    };
    let closed: Vec<Option<(f64, Bounds)>> = components.iter().map(closed).collect();
    let is_around = |(low, high): Bounds, (from, to): Bounds| {
        (0..3).all(|i| low[i] <= from[i] && to[i] <= high[i])
    };
    let looks_inward = |&i: &usize| {
        let Some((volume, own)) = closed[i] else {
            return false;
        };
        let mut others = closed.iter().enumerate().filter(|(j, _)| *j != i);
        volume < 0.0
            && !others.any(|(_, other)| other.is_some_and(|(_, bounds)| is_around(bounds, own)))
    };
    (0..components.len()).filter(looks_inward).collect()
}
