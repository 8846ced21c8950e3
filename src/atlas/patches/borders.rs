//! What lies beside a set of faces on the slit disk.

use super::slit::Slit;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId};
use std::collections::BTreeMap;

/// Border length in space between a patch and each of its neighbours on the slit disk.
pub(super) fn borders(
    slit: &Slit,
    faces: &[FaceId],
    label: &FaceVec<u32>,
    own: u32,
) -> BTreeMap<u32, f64> {
    let mut borders = BTreeMap::new();
    for &f in faces {
        for h in slit.connectivity.face_halfedges(f) {
            if let Some(n) = slit.beside(h) {
                let other = label[n];
                if other != own {
                    *borders.entry(other).or_insert(0.0) += slit.source_length(h);
                }
            }
        }
    }
    borders
}

/// The other faces at the tail of a halfedge, on its copy of the slit disk; a face may come twice.
pub(super) fn around<'a>(slit: &'a Slit, start: HalfedgeId) -> impl Iterator<Item = FaceId> + 'a {
    let c = slit.connectivity;
    let turn = move |forward: bool| {
        std::iter::successors(Some(start), move |&h| {
            let next = if forward {
                slit.across(c.prev(h))
            } else {
                slit.across(h).map(|t| c.next(t))
            };
            next.filter(|&n| n != start)
        })
    };
    turn(true).chain(turn(false)).map(move |h| c.face(h))
}
