//! Patches divided by lines from border to border, until each part has few sides and no corner at the end of a corridor.
//!
//! *Enters:* a [`Drawing`] with its nodes. *Leaves:* more walls and nodes on it. *Guaranteed:* every part is a disk with at least
//! three sides. *Not guaranteed:* at most [`MOST_SIDES`], since a neighbour may put a node on a side afterwards, nor that every
//! corridor is cut: in parts of a few faces there is no room for lines.
//!
//! A centre that is joined to many middles has sharp angles, and a map that opens a sharp angle α to π/2 shrinks what is at a distance r
//! from it like r^{π/2α}: at ten degrees, r⁹. So lines begin where there is room: at a node with an obtuse angle, or at the middle of a side,
//! which becomes a node for the neighbour too. Of all such lines the one is drawn that is shortest for the border that it cuts off.

use super::RectangleError;
use super::chord::{Crossing, aim, zero_level};
use super::disk::{Disk, region};
use super::sides::{Drawing, Role};
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId, VertexId, VertexVec};
use crate::geometry::triangle::angles;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// Parts with more sides are divided.
pub(super) const MOST_SIDES: usize = 6;
/// Parts in which some corner is seen less than this are divided.
const VISIBLE: f64 = 0.004;
/// Parts with fewer faces are too coarse to be called crowded.
const LEAST_FACES: usize = 60;
/// Places that are tried along the border of a crowded part.
const ANCHORS: f64 = 32.0;
/// A line is a good one to cut a crowded part where it is shorter than this part of the border that it cuts off.
const NARROW: f64 = 0.5;
/// How often all parts are looked at.
const ROUNDS: usize = 4;
/// How often one patch is halved in a round.
const DEPTH: usize = 32;
/// Angle of a node from which a line may begin, radians.
const ROOM: f64 = 2.0 * PI / 3.0;
/// A line that begins at a node is preferred to one that makes a new node, up to this factor of its length.
const NEW_NODE: f64 = 1.25;

/// A place on a border where a line may begin.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Anchor {
    place: usize,
    /// False where a node would be made.
    is_node: bool,
    /// Number of nodes on the border before it.
    nodes_before: usize,
    /// Length of the border before it.
    along: f64,
}

/// Divides all regions between walls that have too many sides or are crowded. A line may put a node on the side of a neighbour that was
/// finished, so all are looked at again, a few times.
pub(super) fn divide(drawing: &mut Drawing) -> Result<(), RectangleError> {
    for _ in 0..ROUNDS {
        let starts = regions(drawing).into_iter();
        let mut waiting: Vec<(FaceId, usize)> = starts.map(|f| (f, 0)).collect();
        let before = waiting.len();
        let mut parts = 0;
        while let Some((start, depth)) = waiting.pop() {
            parts += 1;
            let mut disk = part(drawing, start)?;
            // Sides are counted from a node.
            let first = places(drawing, &disk, |role| role == Role::Node).next();
            disk.border.rotate_left(first.unwrap_or(0));
            let line = match depth < DEPTH {
                true => best_line(drawing, &disk, false)?,
                false => None,
            };
            if let Some(line) = line {
                parts -= 1;
                let halves = draw_between(drawing, &disk, line)?;
                waiting.extend(halves.map(|f| (f, depth + 1)));
            }
        }
        if parts == before {
            break;
        }
    }
    Ok(())
}

pub(super) fn draw_between(
    drawing: &mut Drawing,
    disk: &Disk,
    [from, to]: [usize; 2],
) -> Result<[FaceId; 2], RectangleError> {
    for place in [from, to] {
        drawing.role[disk.border_vertex(place)] = Role::Node;
    }
    let n = disk.border.len();
    let ahead = |place: usize| (place + n - from) % n < (to + n - from) % n;
    let given = (0..n).map(|p| if ahead(p) { -1.0 } else { 1.0 }).collect();
    let mut value =
        disk.harmonic(&drawing.fine, &[given])?
            .pop()
            .ok_or(RectangleError::Inconsistent {
                what: "the sides of a patch",
            })?;
    let length = disk.lengths(&drawing.fine);
    aim(disk, &length, &mut value, from, [-1.0, 1.0]);
    aim(disk, &length, &mut value, to, [1.0, -1.0]);
    cross(drawing, disk, &value, from, to)
}

/// How well the least seen corner of a disk is seen from where all are seen best: the harmonic measure of the border between two middles.
/// A corner at the end of a corridor is seen less by e^{−π · length / width}, and a rectangle from there to the centre would shrink it
/// so much.
fn visibility(
    drawing: &Drawing,
    disk: &Disk,
    nodes: &[usize],
    along: &[f64],
) -> Result<f64, RectangleError> {
    let n = disk.border.len();
    let middle = |i: usize| {
        let end = nodes.get(i + 1).copied().unwrap_or(n);
        0.5 * (along[nodes[i]] + along[end])
    };
    let sides = nodes.len();
    // The border around node i, from the middle before it to the one after it.
    let around = |i: usize| -> Vec<f64> {
        let (from, to) = (middle((i + sides - 1) % sides), middle(i));
        let is_around = |at: f64| match from <= to {
            true => (from..to).contains(&at),
            false => at >= from || at < to,
        };
        let value = |place: usize| f64::from(u8::from(is_around(along[place])));
        (0..n).map(value).collect()
    };
    let given: Vec<Vec<f64>> = (0..sides).map(around).collect();
    let measures = disk.harmonic(&drawing.fine, &given)?;
    let c = &disk.connectivity;
    let least = |v: VertexId| measures.iter().map(|m| m[v]).fold(1.0, f64::min);
    let inner = c.vertices().filter(|&v| !c.is_boundary_vertex(v));
    // A disk without a vertex inside is too coarse to tell.
    Ok(inner.map(least).reduce(f64::max).unwrap_or(1.0))
}

/// A face of every region between walls, in the order of the faces.
pub(super) fn regions(drawing: &Drawing) -> Vec<FaceId> {
    let c = &drawing.fine.connectivity;
    let mut seen = FaceVec::filled(false, c.face_count());
    let mut starts = Vec::new();
    for f in c.faces() {
        if !seen[f] {
            starts.push(f);
            for g in region(&drawing.fine, &drawing.is_wall, f) {
                seen[g] = true;
            }
        }
    }
    starts
}

/// The region of a face as a disk.
pub(super) fn part(drawing: &Drawing, start: FaceId) -> Result<Disk, RectangleError> {
    drawing.check_pieces()?;
    let faces = region(&drawing.fine, &drawing.is_wall, start);
    let patch = drawing.face_patch[drawing.fine.parent[start]].index();
    Disk::new(&drawing.fine, &drawing.is_wall, faces, patch)
}

/// Places on the border of a disk whose vertex has a certain role.
pub(super) fn places<'a>(
    drawing: &'a Drawing,
    disk: &'a Disk,
    wanted: impl Fn(Role) -> bool + 'a,
) -> impl Iterator<Item = usize> + 'a {
    let role = |place: &usize| drawing.role[disk.border_vertex(*place)];
    (0..disk.border.len()).filter(move |place| wanted(role(place)))
}

/// Draws the zero level of a function between two places of a disk, as [`zero_level`] has it; a face on each side of it.
pub(super) fn cross(
    drawing: &mut Drawing,
    disk: &Disk,
    value: &VertexVec<f64>,
    from: usize,
    to: usize,
) -> Result<[FaceId; 2], RectangleError> {
    let error = || RectangleError::Inconsistent {
        what: "a line across a patch",
    };
    let crossings = zero_level(&drawing.fine, disk, value, from, to)?;
    let ends = [from, to].map(|place| disk.border_vertex(place));
    let edge = if crossings.is_empty() {
        let joining = joining(disk, from, to).ok_or_else(error)?;
        let edge = disk.edge(&drawing.fine, joining);
        drawing.is_wall[edge] = true;
        edge
    } else {
        let end = draw(drawing, ends[0], &crossings)?;
        wall_between(drawing, end, ends[1])?
    };
    let c = &drawing.fine.connectivity;
    let left = c.edge_halfedge(edge);
    let right = c.twin(left).ok_or_else(error)?;
    Ok([left, right].map(|h| c.face(h)))
}

/// The inner edge between two places of a border.
pub(super) fn joining(disk: &Disk, from: usize, to: usize) -> Option<HalfedgeId> {
    let c = &disk.connectivity;
    let [a, b] = [from, to].map(|place| c.tail(disk.border[place]));
    c.outgoing(a)
        .find(|&h| c.head(h) == b && c.twin(h).is_some())
}

/// Splits the edges that a line crosses one after another and makes walls of what joins them, from a vertex on. Its last vertex.
pub(super) fn draw(
    drawing: &mut Drawing,
    from: VertexId,
    crossings: &[Crossing],
) -> Result<VertexId, RectangleError> {
    let mut last = from;
    for x in crossings {
        let v = drawing.split(x.edge, x.fraction);
        // A split joins its vertex to the apex on both sides; on the near side that is the one before.
        wall_between(drawing, v, last)?;
        last = v;
    }
    Ok(last)
}

fn wall_between(drawing: &mut Drawing, v: VertexId, w: VertexId) -> Result<EdgeId, RectangleError> {
    let c = &drawing.fine.connectivity;
    let joins = c.outgoing(v).find(|&h| c.head(h) == w);
    let edge = joins
        .map(|h| c.edge(h))
        .ok_or(RectangleError::Inconsistent {
            what: "a line across a patch",
        })?;
    drawing.is_wall[edge] = true;
    Ok(edge)
}

/// Between which places a disk, which begins at a node, is divided best; nothing where it is good as it is, if it need not be.
pub(super) fn best_line(
    drawing: &Drawing,
    disk: &Disk,
    is_wanted: bool,
) -> Result<Option<[usize; 2]>, RectangleError> {
    let length = disk.lengths(&drawing.fine);
    let nodes: Vec<usize> = places(drawing, disk, |role| role == Role::Node).collect();
    let sides = nodes.len();
    let c = &disk.connectivity;
    let mut along = vec![0.0];
    for &h in &disk.border {
        along.push(along[along.len() - 1] + length[c.edge(h)]);
    }
    let perimeter = along[disk.border.len()];
    let many = sides > MOST_SIDES;
    let crowded = || {
        Ok::<_, RectangleError>(
            disk.faces.len() >= LEAST_FACES && visibility(drawing, disk, &nodes, &along)? < VISIBLE,
        )
    };
    if !many && !is_wanted && !crowded()? {
        return Ok(None);
    }
    // Where sides are many, every line must leave fewer on both of its sides.
    let spacing = if many {
        f64::INFINITY
    } else {
        perimeter / ANCHORS
    };
    let anchors = anchors(&nodes, &along, spacing);
    let roomy = |a: &&Anchor| !a.is_node || angle(disk, &length, a.place) >= ROOM;
    let roomy: Vec<Anchor> = anchors.iter().filter(roomy).copied().collect();
    let best = |anchors: &[Anchor], least_sides: usize| {
        let mut best: Option<(f64, [usize; 2])> = None;
        for (i, a) in anchors.iter().enumerate() {
            let distance = distances(disk, &length, a.place);
            for b in &anchors[i + 1..] {
                let ends = usize::from(a.is_node) + usize::from(b.is_node);
                // Nodes strictly between, on either side; the line is a side of both parts.
                let between = b.nodes_before - a.nodes_before - usize::from(a.is_node);
                let beyond = sides - between - ends;
                let fewest = between.min(beyond) + 2;
                if fewest < least_sides || (many && between.max(beyond) + 2 >= sides) {
                    continue;
                }
                let arc = b.along - a.along;
                let arc = arc.min(perimeter - arc);
                let made = NEW_NODE.powi(2 - ends as i32);
                let cost = made * distance[c.tail(disk.border[b.place])] / arc;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, [a.place, b.place]));
                }
            }
        }
        best
    };
    let found = best(&roomy, 4);
    let found = match many {
        true => found.or_else(|| best(&anchors, 4)),
        false => found.filter(|f| is_wanted || f.0 < NARROW),
    };
    Ok(found.map(|(_, line)| line))
}

/// All nodes, and on every side vertices inside it: near its middle, or more where it is longer than twice the spacing.
fn anchors(nodes: &[usize], along: &[f64], spacing: f64) -> Vec<Anchor> {
    let mut anchors = Vec::with_capacity(2 * nodes.len());
    let end = along.len() - 1;
    for (i, &node) in nodes.iter().enumerate() {
        anchors.push(Anchor {
            place: node,
            is_node: true,
            nodes_before: i,
            along: along[node],
        });
        let next = nodes.get(i + 1).copied().unwrap_or(end);
        let length = along[next] - along[node];
        let count = ((length / spacing).floor() as usize).clamp(1, 15);
        let mut last = node;
        for k in 1..=count {
            let wanted = along[node] + length * k as f64 / (count + 1) as f64;
            let far = |p: &usize| (along[*p] - wanted).abs();
            let nearest = (last + 1..next).min_by(|p, q| far(p).total_cmp(&far(q)));
            let Some(place) = nearest else { break };
            last = place;
            anchors.push(Anchor {
                place,
                is_node: false,
                nodes_before: i + 1,
                along: along[place],
            });
        }
    }
    anchors
}

/// The angle in space at a place of the border, radians.
pub(super) fn angle(disk: &Disk, length: &EdgeVec<f64>, place: usize) -> f64 {
    let c = &disk.connectivity;
    let corner = |h: HalfedgeId| {
        let angles = angles(c.face_edges(c.face(h)).map(|e| length[e]));
        angles.map_or(0.0, |a| a[c.corner(h)])
    };
    c.outgoing(c.tail(disk.border[place])).map(corner).sum()
}

/// Lengths of the shortest paths along edges to all vertices.
fn distances(disk: &Disk, length: &EdgeVec<f64>, place: usize) -> VertexVec<f64> {
    let c = &disk.connectivity;
    let mut distance = VertexVec::filled(f64::INFINITY, c.vertex_count());
    let start = c.tail(disk.border[place]);
    distance[start] = 0.0;
    // Non-negative floats compare like their bits.
    let mut queue = BinaryHeap::from([Reverse((0u64, start))]);
    while let Some(Reverse((bits, v))) = queue.pop() {
        if f64::from_bits(bits) > distance[v] {
            continue;
        }
        for h in c.outgoing(v) {
            // The edge that closes the fan of a border vertex leaves from its other end.
            for h in [h, c.prev(h)] {
                let w = if c.tail(h) == v { c.head(h) } else { c.tail(h) };
                let there = distance[v] + length[c.edge(h)];
                if there < distance[w] {
                    distance[w] = there;
                    queue.push(Reverse((there.to_bits(), w)));
                }
            }
        }
    }
    distance
}
