//! What a map that is cut along blocks says about every face and every point of the quad mesh.
//!
//! *Enters:* a [`GridMap`] after [`cut`](super::cut), the quad mesh and its blocks. *Leaves:* the block of every face, its coordinates there, and where the points of the quad mesh lie in space. *Guaranteed:* every face is in one
//! block, coordinates are exact, points on borders of blocks are vertices.

use super::blocks::{Blocks, corner};
use super::complex::turned;
use super::cut::Placed;
use super::error::GridError;
use super::map::GridMap;
use super::quads::QuadMesh;
use super::triangle::double_area;
use crate::geometry::ids::{FaceId, FaceVec, NONE, VertexId};
use rustc_hash::FxHashMap;

/// See the module docs.
pub(crate) struct Located {
    /// Of every face.
    pub block: FaceVec<u32>,
    /// Coordinates of its corners in [0, w] × [0, h].
    pub uv: FaceVec<[[f64; 2]; 3]>,
    /// Points of the quad mesh, source units.
    pub points: Vec<[f64; 3]>,
}

/// Locates faces and points.
pub(crate) fn locate(
    map: &GridMap,
    mesh: &QuadMesh,
    blocks: &Blocks,
    placed: &[Option<Placed>],
) -> Result<Located, GridError> {
    let sheet = &map.sheet;
    let c = &sheet.fine.connectivity;
    let mut block: FaceVec<u32> = FaceVec::filled(NONE, c.face_count());
    let mut uv = FaceVec::filled([[0.0; 2]; 3], c.face_count());
    for (b, own) in blocks.blocks.iter().enumerate() {
        let edge = own.squares[0];
        let begin = super::cut::start(map, mesh, placed, edge);
        let square = edge.0;
        let begin = begin.ok_or(GridError::NoRectangle { square })?;
        // Which quarter turn takes the bottom side to the first axis.
        let [x, y] = sheet.vector(begin);
        let turns = match (x.abs() > y.abs(), x > 0.0, y > 0.0) {
            (true, true, _) => 0,
            (true, false, _) => 2,
            (false, _, true) => 3,
            (false, _, false) => 1,
        };
        let origin = turned(sheet.at(begin), turns);
        let mut waiting = vec![(c.face(begin), turns, origin.map(|x| -x))];
        while let Some((f, turns, shift)) = waiting.pop() {
            match block[f] {
                NONE => block[f] = b as u32,
                known if known == b as u32 => continue,
                _ => return Err(GridError::NoTriangle { face: f }),
            }
            uv[f] = c.face_halfedges(f).map(|h| {
                let [x, y] = turned(sheet.at(h), turns);
                [x + shift[0], y + shift[1]]
            });
            for h in c.face_halfedges(f) {
                let Some(t) = c.twin(h) else { continue };
                if sheet.line[c.edge(h)] != NONE || block[c.face(t)] != NONE {
                    continue;
                }
                let beyond = (turns + 4 - sheet.turns[h]) & 3;
                let ([x, y], [a, b]) = (
                    turned(sheet.at(h), turns),
                    turned(sheet.at(c.next(t)), beyond),
                );
                let shift = [x + shift[0] - a, y + shift[1] - b];
                waiting.push((c.face(t), beyond, shift));
            }
        }
    }
    if let Some((face, _)) = block.enumerate().find(|(_, b)| **b == NONE) {
        return Err(GridError::NoTriangle { face });
    }
    let position = |v: VertexId| sheet.fine.position[v];
    let mut points: Vec<Option<[f64; 3]>> = placed
        .iter()
        .map(|p| p.as_ref().map(|p| position(p.vertex)))
        .collect();
    for f in c.faces() {
        let own = &blocks.blocks[block[f] as usize];
        let p = uv[f];
        let range = |i: usize| {
            let of = p.map(|p| p[i]);
            let low = of[0].min(of[1]).min(of[2]).ceil().max(0.0) as usize;
            let high = of[0].max(of[1]).max(of[2]).floor().max(0.0) as usize;
            low..=high.min(own.cells[i])
        };
        for i in range(0) {
            for j in range(1) {
                let q = [i as f64, j as f64];
                let w = [
                    double_area([q, p[1], p[2]]),
                    double_area([p[0], q, p[2]]),
                    double_area([p[0], p[1], q]),
                ];
                let point = corner(mesh.squares(), own, [i, j]) as usize;
                if w.iter().any(|w| *w < 0.0) || points[point].is_some() {
                    continue;
                }
                let sum = w[0] + w[1] + w[2];
                let at = c.face_vertices(f).map(position);
                let mixed = |x: usize| (0..3).map(|k| w[k] / sum * at[k][x]).sum();
                points[point] = Some(std::array::from_fn(mixed));
            }
        }
    }
    let known = points.into_iter().enumerate().map(|(i, p)| {
        let missing = GridError::Open {
            face: FaceId::new(0),
            at: [i as i64, 0],
        };
        p.ok_or(missing)
    });
    Ok(Located {
        block,
        uv,
        points: known.collect::<Result<_, _>>()?,
    })
}

/// Names of the texels on the border of blocks that do not depend on the block: a point of the quad mesh, or how far along an edge of it.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Name {
    Point(u32),
    /// A side of a square, the lower one of both, and texels from where it begins.
    Along(u32, u8, usize),
}

/// Calls `same` with pairs of texels (image, column, row) that are the same point of the surface: of each point the first, and another.
pub(crate) fn shared_texels(
    mesh: &QuadMesh,
    blocks: &Blocks,
    samples: usize,
    mut same: impl FnMut([usize; 3], [usize; 3]),
) {
    let mut first: FxHashMap<Name, [usize; 3]> = FxHashMap::default();
    for (b, block) in blocks.blocks.iter().enumerate() {
        let [w, h] = block.cells.map(|n| n * samples);
        for s in 0..4 {
            let side = super::blocks::side_of(block, s);
            for (i, &(q, k)) in side.iter().enumerate() {
                for t in 0..=samples {
                    let along = i * samples + t;
                    let texel = match s {
                        0 => [b, along, 0],
                        1 => [b, w, along],
                        2 => [b, w - along, h],
                        _ => [b, 0, h - along],
                    };
                    let corners = mesh.quads[q as usize];
                    let name = match t {
                        0 => Name::Point(corners[usize::from(k)]),
                        t if t == samples => Name::Point(corners[usize::from((k + 1) & 3)]),
                        t => match mesh.across[q as usize][usize::from(k)] {
                            Some(other) if other < (q, k) => {
                                Name::Along(other.0, other.1, samples - t)
                            }
                            _ => Name::Along(q, k, t),
                        },
                    };
                    let known = *first.entry(name).or_insert(texel);
                    if known != texel {
                        same(known, texel);
                    }
                }
            }
        }
    }
}
