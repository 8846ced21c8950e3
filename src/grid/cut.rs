//! The borders of blocks drawn on the surface.
//!
//! *Enters:* a relaxed [`GridMap`], the quad mesh and its blocks. *Leaves:* a finer one in which every border of a block is a path of edges on its lattice line, and every point of the quad mesh on one a vertex.
//! *Guaranteed:* coordinates are multiples of 2⁻ᵏ (k as large as float64 holds them), so that what is computed from them is exact; every face has a positive area, or an error.

use super::blocks::Blocks;
use super::cells::unfold;
use super::density::Units;
use super::error::GridError;
use super::map::{Anchor, Corners, Freedom, GridMap};
use super::quads::QuadMesh;
use super::sheet::Aim;
use super::slivers::thicken;
use super::triangle::{THICK, THIN, is_turned_over};
use super::{energy, relax};
use crate::geometry::ids::{FaceId, HalfedgeId, NONE, VertexId};
use std::collections::{BTreeSet, VecDeque};
use std::f64::consts::FRAC_PI_2;

/// Binary digits behind the point that coordinates have at most.
const MOST_DIGITS: i32 = 40;
/// ‖J‖² + ‖J⁻¹‖² above which a face counts as squeezed: 4 is an isometry.
const SQUEEZED: f64 = 32.0;
/// Binary digits in all that leave room for differences.
const DIGITS: i32 = 51;

/// An edge of the quad mesh that leaves a point: a side of a square run forwards, with the square on its left, or backwards along the border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Out {
    pub edge: (u32, u8),
    pub is_backwards: bool,
    /// Angle in quarter turns from the anchor's edge.
    pub turns: i32,
}

/// A point of the quad mesh that is a vertex.
pub(crate) type Placed = Anchor;

/// Draws borders; see the module docs. `unfolded`: vertices that moved when cells were unfolded. The vertex of every point of the quad mesh that lies on one.
pub(crate) fn cut(
    map: &mut GridMap,
    mesh: &QuadMesh,
    blocks: &Blocks,
    unit: &Units,
    unfolded: &BTreeSet<VertexId>,
) -> Result<Vec<Option<Placed>>, GridError> {
    let mut is_wall = vec![[false; 4]; mesh.quads.len()];
    for block in &blocks.blocks {
        for s in 0..4 {
            for (q, k) in super::blocks::side_of(block, s) {
                is_wall[q as usize][usize::from(k)] = true;
            }
        }
    }
    map.sheet.clear();
    let mut placed: Vec<Option<Placed>> = vec![None; mesh.points.len()];
    let mut waiting = VecDeque::new();
    for anchor in map.anchors.clone() {
        let point = mesh.tail(anchor.edge);
        placed[point] = Some(anchor);
        waiting.push_back(anchor);
    }
    while let Some(anchor) = waiting.pop_front() {
        for out in mesh.around(anchor.edge) {
            let (q, k) = out.edge;
            let wall = &mut is_wall[q as usize][usize::from(k)];
            if !std::mem::take(wall) {
                continue;
            }
            if let Some((q, k)) = mesh.across[q as usize][usize::from(k)] {
                is_wall[q as usize][usize::from(k)] = false;
            }
            let end = match out.is_backwards {
                false => mesh.head(out.edge),
                true => mesh.tail(out.edge),
            };
            let arrived = draw(map, &anchor, out, placed[end].map(|p| p.vertex))?;
            match placed[end] {
                Some(p) if p.vertex == arrived.vertex => {}
                Some(_) => return Err(lost(map, out.edge)),
                None => {
                    placed[end] = Some(arrived);
                    waiting.push_back(arrived);
                }
            }
        }
    }
    let left = is_wall.iter().position(|walls| walls.contains(&true));
    if let Some(square) = left {
        let square = square as u32;
        return Err(GridError::NoRectangle { square });
    }
    settle(map, mesh, &placed, unit, unfolded)?;
    Ok(placed)
}

/// The halfedge of the surface with which a side of a square on the border of blocks begins, when borders are drawn.
pub(crate) fn start(
    map: &GridMap,
    mesh: &QuadMesh,
    placed: &[Option<Placed>],
    edge: (u32, u8),
) -> Option<HalfedgeId> {
    let anchor = placed[mesh.tail(edge)].as_ref()?;
    let around = mesh.around(anchor.edge);
    let out = around.iter().find(|o| o.edge == edge && !o.is_backwards)?;
    let (sheet, c) = (&map.sheet, &map.sheet.fine.connectivity);
    let bearing = map.bearing(anchor) + f64::from(out.turns) * FRAC_PI_2;
    let total: f64 = c.outgoing(anchor.vertex).map(|h| sheet.angle(h)).sum();
    let is_inside = !c.is_boundary_vertex(anchor.vertex);
    let off = |h: HalfedgeId| {
        let off = (sheet.bearing(h) - bearing).abs();
        match is_inside {
            true => {
                let off = off.rem_euclid(total);
                off.min(total - off)
            }
            false => off,
        }
    };
    let on_lines = c
        .outgoing(anchor.vertex)
        .filter(|&h| sheet.line[c.edge(h)] != NONE || c.twin(h).is_none());
    let nearest = on_lines.min_by(|&g, &h| off(g).total_cmp(&off(h)));
    nearest.filter(|&h| off(h) < 0.25 * FRAC_PI_2)
}

fn lost(map: &GridMap, edge: (u32, u8)) -> GridError {
    let _ = map;
    GridError::Lost {
        line: edge.0,
        face: FaceId::new(0),
    }
}

/// Draws one edge of the quad mesh from an anchor. Its end, as an anchor.
fn draw(
    map: &mut GridMap,
    anchor: &Anchor,
    out: Out,
    goal: Option<VertexId>,
) -> Result<Anchor, GridError> {
    let bearing = map.bearing(anchor) + f64::from(out.turns) * FRAC_PI_2;
    let found = map.sheet.corner_at(anchor.vertex, bearing);
    let (corner, angle) = found.ok_or_else(|| lost(map, out.edge))?;
    let direction = (angle / FRAC_PI_2).round().rem_euclid(4.0) as usize;
    let [x, y] = map.sheet.at(corner);
    let [dx, dy] = super::lattice::UNIT[direction].map(|x| x as f64);
    let target = [x.round() + dx, y.round() + dy];
    let aims = map.sheet.near(Aim { corner, target });
    let (q, k) = out.edge;
    let freedom = &map.freedom;
    let is_free = |v: VertexId| v.index() >= freedom.len() || freedom[v] == Freedom::Free;
    let v = map.sheet.draw(aims, 4 * q + u32::from(k), goal, is_free)?;
    while map.freedom.len() < map.sheet.fine.connectivity.vertex_count() {
        map.freedom.push(Freedom::Free);
    }
    // The next line begins here.
    let place = map.place(v).map(f64::round);
    map.put(v, place);
    let c = &map.sheet.fine.connectivity;
    // The edge of the path that leaves the end: that of this line.
    let line = 4 * q + u32::from(k);
    let back = c.outgoing(v).find(|&h| map.sheet.line[c.edge(h)] == line);
    let bearing = match back {
        Some(h) => map.sheet.bearing(h),
        // Along the border, the last of its edges comes in.
        None => c.outgoing(v).map(|h| map.sheet.angle(h)).sum(),
    };
    let (edge, bearing) = match out.is_backwards {
        // With the square on the left, the next side is a quarter turn clockwise from the way back.
        false => ((q, (k + 1) & 3), bearing - FRAC_PI_2),
        true => (out.edge, bearing),
    };
    Ok(Anchor {
        vertex: v,
        edge,
        bearing,
        first: map.sheet.vector(c.vertex_halfedge(v)),
    })
}

impl QuadMesh {
    /// The point where a side of a square begins.
    fn tail(&self, (q, k): (u32, u8)) -> usize {
        self.quads[q as usize][usize::from(k)] as usize
    }

    /// The point where it ends.
    fn head(&self, (q, k): (u32, u8)) -> usize {
        self.quads[q as usize][usize::from((k + 1) & 3)] as usize
    }

    /// All edges that leave the point where a side begins.
    pub(super) fn around(&self, edge: (u32, u8)) -> Vec<Out> {
        let of = |(q, k): (u32, u8)| self.across[q as usize][usize::from(k & 3)];
        let out = |edge, is_backwards, turns| Out {
            edge,
            is_backwards,
            turns,
        };
        let mut all = vec![out(edge, false, 0)];
        // Counterclockwise.
        let (mut at, mut turns) = (edge, 0);
        loop {
            turns += 1;
            let before = (at.0, (at.1 + 3) & 3);
            match of(before) {
                Some(next) if next == edge => return all,
                Some(next) => {
                    all.push(out(next, false, turns));
                    at = next;
                }
                None => {
                    all.push(out(before, true, turns));
                    break;
                }
            }
        }
        let (mut at, mut turns) = (edge, 0);
        while let Some((q, k)) = of(at) {
            turns -= 1;
            at = (q, (k + 1) & 3);
            all.push(out(at, false, turns));
        }
        all
    }
}

/// Relaxes the map after drawing, which squeezes a few faces. Where cells were unfolded it stays, but about such faces.
fn relax_drawn(
    map: &mut GridMap,
    unit: &Units,
    unfolded: &BTreeSet<VertexId>,
) -> Result<(), GridError> {
    let c = &map.sheet.fine.connectivity;
    let mut kept = unfolded.clone();
    // New ones beside those that moved.
    let around = unfolded.iter().flat_map(|&v| c.outgoing(v));
    kept.extend(around.map(|h| c.head(h)));
    for (f, _) in energy::densities(map, unit).filter(|(_, density)| *density > SQUEEZED) {
        c.face_vertices(f).iter().for_each(|v| {
            kept.remove(v);
        });
    }
    let freedom = map.freedom.clone();
    kept.iter().for_each(|&v| map.freedom[v] = Freedom::Fixed);
    let relaxed = relax::relax(map, unit, &());
    map.freedom = freedom;
    relaxed.map(|_| ())
}

/// Puts vertices exactly where they are to be: those of lines on them, all on multiples of a power of two. In between the map is relaxed once more, since drawing
/// lines squeezes a few faces.
fn settle(
    map: &mut GridMap,
    mesh: &QuadMesh,
    placed: &[Option<Placed>],
    unit: &Units,
    unfolded: &BTreeSet<VertexId>,
) -> Result<(), GridError> {
    let c = map.sheet.fine.connectivity.clone();
    for v in placed.iter().flatten().map(|p| p.vertex) {
        map.freedom[v] = Freedom::Fixed;
        let place = map.place(v).map(f64::round);
        map.put(v, place);
    }
    for v in c.vertices() {
        let on_line = c
            .outgoing(v)
            .flat_map(|h| [h, c.prev(h)])
            .find(|&h| map.sheet.line[c.edge(h)] != NONE);
        if let (Some(h), false) = (on_line, map.freedom[v] == Freedom::Fixed) {
            // The axis that the line runs along, in the frame of the first corner.
            let frames = map.frames(v);
            let own = frames.iter().find(|f| f.0 == h || c.prev(f.0) == h);
            let turns = own.map_or(0, |f| f.1);
            let [x, y] = map.sheet.vector(h);
            let axis = u8::from(y.abs() > x.abs());
            map.freedom[v] = Freedom::Along((axis ^ turns) & 1);
        }
    }
    let most = c.faces().flat_map(|f| map.corners(f)).flatten();
    let most = most.fold(1.0, |m: f64, x| m.max(x.abs()));
    let digits = (DIGITS - most.log2().ceil() as i32).min(MOST_DIGITS);
    let least = 0.5f64.powi(digits);
    let corners = Corners::new(map);
    let round = |map: &mut GridMap| {
        let rounded = |v: VertexId| {
            let mut place = map.place(v).map(|x| (x / least).round() * least);
            match map.freedom[v] {
                Freedom::Fixed => place = place.map(f64::round),
                Freedom::Along(a) => {
                    let other = usize::from(1 - a);
                    place[other] = place[other].round();
                }
                Freedom::Free => {}
            }
            place
        };
        let places: Vec<[f64; 2]> = c.vertices().map(rounded).collect();
        corners.put(map, &places);
    };
    round(map);
    thicken(map, THICK);
    relax_drawn(map, unit, unfolded)?;
    unfold(map, mesh, unit)?;
    round(map);
    thicken(map, THIN);
    round(map);
    let over: Vec<FaceId> = c
        .faces()
        .filter(|&f| is_turned_over(map.corners(f)))
        .collect();
    match over[..] {
        [] => Ok(()),
        [face, ..] => Err(GridError::TurnedOver {
            count: over.len(),
            face,
        }),
    }
}
