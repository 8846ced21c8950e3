//! Patches stitched along their seams into one mesh.
//!
//! *Guaranteed:* no edge joins a vertex to itself and no two edges join the same two vertices: where two patches, or two
//! parts of one, are so thin that each joins the same seam points across, all such edges but one get a vertex in their middle.

use super::band::Band;
use super::border::Borders;
use super::chain::Chain;
use super::collinear::Faces;
use super::frame::Frame;
use super::{Images, RebuildError, Rebuilt};
use crate::geometry::connectivity::Connectivity;
use rustc_hash::FxHashMap;

/// Passes that look for double edges; each parts all that there are, and what it makes is hardly ever double again.
const PASSES: usize = 8;
/// Texels around a point where a covered one is looked for.
const REACH: i64 = 2;

/// The mesh while it is stitched. A *corner point* is a vertex as one place of one patch sees it: a vertex of a seam has several.
struct Stitched {
    positions: Vec<[f64; 3]>,
    /// Vertex of every corner point.
    vertex: Vec<u32>,
    /// Its patch coordinates.
    uv: Vec<[f64; 2]>,
    /// Corner points of every face.
    faces: Vec<[u32; 3]>,
    patch: Vec<u32>,
}

/// Puts all patches together.
pub(super) fn stitch(
    images: &Images,
    frames: &[Frame],
    borders: &Borders,
    chains: &[Chain],
    bands: Vec<Band>,
) -> Result<Rebuilt, RebuildError> {
    let inner = chains.iter().map(|c| c.points.len() - 2).sum::<usize>();
    let texels = bands.iter().map(|b| b.texels.len()).sum::<usize>();
    let vertices = borders.vertices + inner + texels;
    // Every vertex has a few corner points, which are numbered too.
    let most = u32::MAX as usize / 8;
    if vertices > most {
        return Err(RebuildError::TooLarge { vertices, most });
    }
    let mut mesh = Stitched {
        positions: vec![[0.0; 3]; borders.vertices],
        vertex: Vec::new(),
        uv: Vec::new(),
        faces: Vec::new(),
        patch: Vec::new(),
    };
    // Vertex of every point of every chain.
    let mut of_chain: Vec<Vec<u32>> = Vec::with_capacity(chains.len());
    for (chain, ends) in chains.iter().zip(&borders.ends) {
        let last = chain.points.len() - 1;
        let numbers = chain.points.iter().enumerate().map(|(i, point)| {
            if i == 0 || i == last {
                let end = ends[usize::from(i == last)];
                mesh.positions[end] = point.position;
                end as u32
            } else {
                mesh.positions.push(point.position);
                (mesh.positions.len() - 1) as u32
            }
        });
        of_chain.push(numbers.collect());
    }
    let mut suspects = Vec::new();
    let mut chords: FxHashMap<[u32; 2], (usize, usize)> = FxHashMap::default();
    for (id, band) in bands.into_iter().enumerate() {
        let (base, n) = (mesh.vertex.len() as u32, band.polygon.uv.len() as u32);
        for (i, &(seam, point)) in band.polygon.point.iter().enumerate() {
            mesh.vertex.push(of_chain[seam][point]);
            mesh.uv.push(band.polygon.uv[i]);
            let i = i as u32;
            chords.insert(
                [base + i, base + (i + 1) % n],
                band.polygon.chord[i as usize],
            );
        }
        let (image, frame) = (&images.patches[id], &frames[id]);
        for &at in &band.texels {
            let (i, k) = (at as usize % frame.width, at as usize / frame.width);
            let p = image.position[frame.index(i, k)];
            mesh.vertex.push(mesh.positions.len() as u32);
            mesh.uv.push(frame.centre(i, k));
            mesh.positions
                .push(std::array::from_fn(|x| f64::from(p[x]) + images.origin[x]));
        }
        let first = mesh.faces.len();
        suspects.extend(first..first + band.band_faces);
        mesh.faces
            .extend(band.faces.iter().map(|f| f.map(|c| base + c)));
        mesh.patch.resize(mesh.faces.len(), id as u32);
    }
    let mut thin = ThinPlaces {
        images,
        frames,
        chords,
        // Texels belong to one place; only edges with an end on a seam can be double.
        suspects,
    };
    for _ in 0..PASSES {
        if !thin.part_double_edges(&mut mesh) {
            break;
        }
    }
    drop(thin);
    let mut faces = Faces {
        positions: &mesh.positions,
        vertex: &mesh.vertex,
        uv: &mesh.uv,
        faces: &mut mesh.faces,
    };
    faces.give_area();
    mesh.finish()
}

/// Where edges could be double.
struct ThinPlaces<'a> {
    images: &'a Images<'a>,
    frames: &'a [Frame],
    /// Directed edges of corner points that are chords of seams.
    chords: FxHashMap<[u32; 2], (usize, usize)>,
    /// Faces with edges that could be.
    suspects: Vec<usize>,
}

/// An edge as a thing of its own: a chord of a seam, or an edge inside a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Edge {
    Chord(usize, usize),
    Inner([u32; 2]),
}

impl ThinPlaces<'_> {
    /// Splits all but one of the edges that join the same two vertices, and all that join a vertex to itself. True where there
    /// were any.
    fn part_double_edges(&mut self, mesh: &mut Stitched) -> bool {
        let mut edges: Vec<([u32; 2], Edge)> = Vec::new();
        for &f in &self.suspects {
            for k in 0..3 {
                let [a, b] = [mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]];
                let [u, v] = [a, b].map(|c| mesh.vertex[c as usize]);
                let edge = match self.chords.get(&[a, b]) {
                    Some(&(seam, chord)) => Edge::Chord(seam, chord),
                    None => Edge::Inner([a.min(b), a.max(b)]),
                };
                edges.push(([u.min(v), u.max(v)], edge));
            }
        }
        edges.sort_unstable();
        edges.dedup();
        let mut double = Vec::new();
        for group in edges.chunk_by(|a, b| a.0 == b.0) {
            let is_loop = group[0].0[0] == group[0].0[1];
            for &(_, edge) in &group[usize::from(!is_loop)..] {
                if let Edge::Inner(ends) = edge {
                    double.push((ends, is_loop));
                }
            }
        }
        if double.is_empty() {
            return false;
        }
        let mut at: FxHashMap<[u32; 2], usize> = FxHashMap::default();
        for &f in &self.suspects {
            for k in 0..3 {
                at.insert([mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]], f);
            }
        }
        for ([a, b], is_loop) in double {
            let (Some(&f), Some(&g)) = (at.get(&[a, b]), at.get(&[b, a])) else {
                continue;
            };
            let patch = mesh.patch[f];
            let [p, q] = [a, b].map(|c| mesh.uv[c as usize]);
            let uv = [0, 1].map(|i| 0.5 * (p[i] + q[i]));
            let [x, y] = [a, b].map(|c| mesh.positions[mesh.vertex[c as usize] as usize]);
            let middle = [0, 1, 2].map(|i| x[i] + 0.5 * (y[i] - x[i]));
            // An edge from a vertex to itself runs around something: its middle is where the image has it.
            let position = match is_loop {
                true => self.covered(patch as usize, uv).unwrap_or(middle),
                false => middle,
            };
            let m = mesh.vertex.len() as u32;
            mesh.vertex.push(mesh.positions.len() as u32);
            mesh.positions.push(position);
            mesh.uv.push(uv);
            for (face, [a, b]) in [(f, [a, b]), (g, [b, a])] {
                let old = mesh.faces[face];
                let apex = old.into_iter().find(|c| *c != a && *c != b).unwrap_or(a);
                let new = mesh.faces.len();
                mesh.faces[face] = [a, m, apex];
                mesh.faces.push([m, b, apex]);
                mesh.patch.push(patch);
                self.suspects.push(new);
                for (face, edge) in [
                    (face, [a, m]),
                    (face, [m, apex]),
                    (new, [m, b]),
                    (new, [b, apex]),
                    (new, [apex, m]),
                ] {
                    at.insert(edge, face);
                }
            }
        }
        true
    }

    /// The position of the nearest covered texel.
    fn covered(&self, patch: usize, uv: [f64; 2]) -> Option<[f64; 3]> {
        let (image, frame) = (&self.images.patches[patch], &self.frames[patch]);
        let [x, y] = frame.texel(uv);
        let (column, row) = (x.floor() as i64, y.floor() as i64);
        let mut best: Option<(f64, usize)> = None;
        for k in row - REACH..=row + REACH {
            for i in column - REACH..=column + REACH {
                let within = |x: i64, size: usize| (0..size as i64).contains(&x);
                if !(within(i, frame.width) && within(k, frame.height)) {
                    continue;
                }
                let at = frame.index(i as usize, k as usize);
                let off = (i as f64 + 0.5 - x).hypot(k as f64 + 0.5 - y);
                if image.alpha[at] > 0.0 && best.is_none_or(|(least, _)| off < least) {
                    best = Some((off, at));
                }
            }
        }
        let p = image.position[best?.1];
        Some(std::array::from_fn(|x| {
            f64::from(p[x]) + self.images.origin[x]
        }))
    }
}

impl Stitched {
    fn finish(self) -> Result<Rebuilt, RebuildError> {
        let faces: Vec<[u32; 3]> = self
            .faces
            .iter()
            .map(|f| f.map(|c| self.vertex[c as usize]))
            .collect();
        // Gone before coordinates are laid out: either takes as much memory as all the rest.
        let topology = Connectivity::from_faces(&faces, self.positions.len())
            .map_err(|error| RebuildError::NotManifold {
                problem: error.to_string(),
            })?
            .topology();
        Ok(Rebuilt {
            topology,
            patch_uv: self
                .faces
                .iter()
                .map(|f| f.map(|c| self.uv[c as usize]))
                .collect(),
            face_patch: self.patch,
            positions: self.positions,
            faces,
        })
    }
}
