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

/// The border of a set of faces as one closed path with the set on its left; none where it is not one. `sides` are its halfedges, in any order, `member`
/// tells the faces of the set.
pub(super) fn closed_path(
    slit: &Slit,
    sides: &[HalfedgeId],
    member: impl Fn(FaceId) -> bool,
) -> Option<Vec<HalfedgeId>> {
    let c = slit.connectivity;
    let inner = |h: HalfedgeId| slit.across(h).filter(|&t| member(c.face(t)));
    let first = *sides.first()?;
    let mut path = vec![first];
    let mut h = first;
    loop {
        h = c.next(h);
        while let Some(t) = inner(h) {
            h = c.next(t);
        }
        if h == first {
            return (path.len() == sides.len()).then_some(path);
        }
        if path.len() == sides.len() {
            return None;
        }
        path.push(h);
    }
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
