//! Short sides contracted: two nodes near to each other become one.
//!
//! *Enters:* a [`Drawing`] with its nodes. *Leaves:* the same patches with fewer sides. *Guaranteed:* patches stay disks with at least three sides; the cut,
//! the surface's border and creases stay. *Not guaranteed:* that all short sides go.
//!
//! Where two walls end on a third one from both sides, hardly ever at one place, the piece between them is a side of both patches there. Each side makes a quad, and all quads of
//! a strip have as many samples: a short one wastes them, and is long and thin. So the walls that end at one of the nodes are drawn to the other one.

use super::RectangleError;
use super::disk::region;
use super::division::{draw_between, part};
use super::relax::{Arm, arms, only_place};
use super::sides::{Chain, Drawing, Role};
use crate::geometry::ids::{EdgeId, FaceId, FaceVec, NONE, VertexId};

/// Sides shorter than this part of the mean one of both patches are contracted.
const SHORT: f64 = 0.4;
/// Those shorter than this part too, where four walls at most meet then and both patches keep four sides: these have the squarest quads.
const SOMEWHAT_SHORT: f64 = 0.5;
const FEW_ARMS: usize = 4;
/// Passes over all sides: in one of them a patch changes once.
const PASSES: usize = 12;
/// Least sides that a patch keeps.
const LEAST_SIDES: usize = 3;
/// Most walls that meet at a node: their angles are corners of quads.
const MOST_ARMS: usize = 6;

/// Contracts short sides, shortest first.
pub(super) fn contract(drawing: &mut Drawing) -> Result<(), RectangleError> {
    for _ in 0..PASSES {
        if pass(drawing)? == 0 {
            break;
        }
    }
    Ok(())
}

/// A side with the patches beside it.
struct Side {
    chain: Chain,
    length: f64,
    parts: [Option<usize>; 2],
}

fn pass(drawing: &mut Drawing) -> Result<usize, RectangleError> {
    let c = &drawing.fine.connectivity;
    let mut label = FaceVec::filled(NONE, c.face_count());
    let mut count = 0;
    for f in c.faces() {
        if label[f] == NONE {
            for g in region(&drawing.fine, &drawing.is_wall, f) {
                label[g] = count;
            }
            count += 1;
        }
    }
    let sides: Vec<Side> = drawing
        .chains()
        .into_iter()
        .filter_map(|chain| {
            let h = c.edge_halfedge(*chain.edges.first()?);
            let part = |h| label[c.face(h)] as usize;
            Some(Side {
                length: drawing.length(&chain),
                parts: [Some(part(h)), c.twin(h).map(part)],
                chain,
            })
        })
        .collect();
    // Sides and their length around every part.
    let mut around = vec![(0usize, 0.0); count as usize];
    for side in &sides {
        for part in side.parts.into_iter().flatten() {
            around[part].0 += 1;
            around[part].1 += side.length;
        }
    }
    let mean = |side: &Side| {
        let parts = side.parts.into_iter().flatten();
        let (n, l) = parts.fold((0, 0.0), |(n, l), p| (n + around[p].0, l + around[p].1));
        l / n.max(1) as f64
    };
    let mut short: Vec<(&Side, f64)> = sides
        .iter()
        .map(|side| (side, side.length / mean(side)))
        .filter(|(_, ratio)| *ratio < SOMEWHAT_SHORT)
        .collect();
    short.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut touched = vec![false; count as usize];
    let mut contracted = 0;
    for (side, ratio) in short {
        let (least_sides, most_arms) = if ratio < SHORT {
            (LEAST_SIDES, MOST_ARMS)
        } else {
            (LEAST_SIDES + 1, FEW_ARMS)
        };
        let [first, .., last] = side.chain.vertices[..] else {
            continue;
        };
        // A part on both sides of it would lose two sides.
        if side.parts[0] == side.parts[1] {
            continue;
        }
        let mut parts = side.parts.into_iter().flatten();
        if parts.any(|p| around[p].0 <= least_sides) {
            continue;
        }
        for [keep, gone] in [[first, last], [last, first]] {
            let Some(moved) = movable(drawing, &side.chain, keep, gone, most_arms) else {
                continue;
            };
            // Every part at either end changes, and none may change twice in a pass.
            let c = &drawing.fine.connectivity;
            // Faces that this pass made have no label: they belong to parts that changed.
            let near: Option<Vec<usize>> = [keep, gone]
                .into_iter()
                .flat_map(|v| c.outgoing(v))
                .map(|h| Some(*label.as_slice().get(c.face(h).index())? as usize))
                .collect();
            let Some(near) = near.filter(|near| near.iter().all(|&p| !touched[p])) else {
                continue;
            };
            if slide(drawing, &side.chain, keep, gone, &moved)? {
                near.into_iter().for_each(|p| touched[p] = true);
                contracted += 1;
                break;
            }
        }
    }
    Ok(contracted)
}

/// The walls that would be drawn to the other end, if all of them may be.
fn movable(
    drawing: &Drawing,
    chain: &Chain,
    keep: VertexId,
    gone: VertexId,
    most_arms: usize,
) -> Option<Vec<Arm>> {
    if keep == gone || drawing.role[keep] != Role::Node || drawing.role[gone] != Role::Node {
        return None;
    }
    // On the surface's border a wall may arrive that does not leave: not all arms are seen from there.
    if drawing.fine.connectivity.is_boundary_vertex(gone) {
        return None;
    }
    let is_fixed = |edges: &[EdgeId]| edges.iter().any(|&e| drawing.is_fixed[e]);
    let is_free = !is_fixed(&chain.edges);
    let is_chain = |arm: &Arm| arm.edges.iter().all(|e| chain.edges.contains(e));
    let all = arms(drawing, gone)?;
    let (own, others): (Vec<Arm>, Vec<Arm>) = all.into_iter().partition(is_chain);
    let (fixed, free): (Vec<Arm>, Vec<Arm>) =
        others.into_iter().partition(|arm| is_fixed(&arm.edges));
    // A node of the cut stays; where the cut passes through, it may be left.
    let passes = match is_free {
        true => fixed.is_empty(),
        false => fixed.len() == 1,
    };
    let kept = arms(drawing, keep)?.len();
    let loops = free.iter().any(|arm| arm.end == keep || arm.end == gone);
    (own.len() == 1
        && passes
        && !loops
        && !free.is_empty()
        && kept + free.len() <= most_arms + usize::from(is_free))
    .then_some(free)
}

/// Draws the walls at `gone` to `keep`. False where the surface is too coarse there, or a part meets itself; some walls may have been drawn anew then, to where they were.
fn slide(
    drawing: &mut Drawing,
    chain: &Chain,
    keep: VertexId,
    gone: VertexId,
    moved: &[Arm],
) -> Result<bool, RectangleError> {
    let is_free = chain.edges.iter().all(|&e| !drawing.is_fixed[e]);
    // All or nothing: what would be in the way is found before anything is drawn.
    let c = &drawing.fine.connectivity;
    let mut regions: Vec<FaceId> = Vec::new();
    for h in c.outgoing(gone) {
        let face = region(&drawing.fine, &drawing.is_wall, c.face(h))[0];
        if !drawing.is_wall[c.edge(h)] {
            continue;
        }
        if regions.contains(&face) {
            return Ok(false);
        }
        regions.push(face);
    }
    // From the walls next to the side on, so that the side borders on what is drawn next.
    let mut waiting: Vec<&Arm> = moved.iter().collect();
    let mut drawn = 0;
    while let Some(arm) = waiting.pop() {
        let is_last = waiting.is_empty();
        let mut erased = arm.edges.clone();
        if is_last && is_free {
            erased.extend(&chain.edges);
        }
        for &e in &erased {
            drawing.is_wall[e] = false;
        }
        let c = &drawing.fine.connectivity;
        let start = c.face(c.edge_halfedge(arm.edges[0]));
        let disk = part(drawing, start)?;
        let places = [keep, arm.end].map(|v| only_place(&disk, v));
        let n = disk.border.len();
        match places {
            [Some(a), Some(b)] if (a + n - b) % n > 1 && (b + n - a) % n > 1 => {
                draw_between(drawing, &disk, [a, b])?;
                drawn += 1;
            }
            _ => {
                for &e in &erased {
                    drawing.is_wall[e] = true;
                }
                return Ok(drawn > 0);
            }
        }
    }
    drawing.role[gone] = Role::Plain;
    Ok(true)
}
