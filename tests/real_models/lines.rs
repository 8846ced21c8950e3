//! How much of the sharp edges of an atlas are lines of it, from its arrays alone.

use super::arrays::array;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Least angle between normals, degrees, and fewest edges of a chain, of the input's.
const SHARP: f64 = 40.0;
const LEAST_EDGES: usize = 5;

/// Largest angle to an axis, radians.
const STRAIGHT: f64 = 1e-7;

/// What was found.
#[derive(Debug, Default)]
pub struct Lines {
    /// Number of chains of sharp edges, and their length.
    pub chains: usize,
    pub length: f64,
    /// Length of the edges that are parallel to an axis of the central chart on both sides.
    pub on_lines: f64,
    /// Vertices where three, four or more chains meet.
    pub junctions: BTreeMap<usize, usize>,
    /// Length of what atlas.json says are no lines.
    pub named: f64,
}

impl Lines {
    /// Part of the length that is on lines; all of nothing.
    pub fn share(&self) -> f64 {
        if self.length > 0.0 {
            self.on_lines / self.length
        } else {
            1.0
        }
    }
}

fn sub(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| p[i] - q[i])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Finds the chains and measures them.
pub fn lines(atlas: &Path) -> Lines {
    let triples = |name| -> Vec<[f64; 3]> {
        let flat: Vec<f64> = array(atlas, name);
        flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
    };
    let positions = triples("positions");
    let faces: Vec<u32> = array(atlas, "faces");
    let source_face: Vec<u32> = array(atlas, "source_face");
    let source_vertex: Vec<u32> = array(atlas, "source_vertex");
    let uv: Vec<f64> = array(atlas, "central_uv");
    // Faces of the atlas are pieces of those of the input; small ones have no normal of their own.
    let mut normal: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for (f, corners) in faces.chunks_exact(3).enumerate() {
        let [p, q, r] = [0, 1, 2].map(|k| positions[corners[k] as usize]);
        let part = cross(sub(q, p), sub(r, p));
        let sum = normal.entry(source_face[f]).or_default();
        *sum = std::array::from_fn(|i| sum[i] + part[i]);
    }
    let mut sides: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for h in 0..faces.len() {
        let (a, b) = (faces[h], faces[3 * (h / 3) + (h + 1) % 3]);
        sides.entry([a.min(b), a.max(b)]).or_default().push(h);
    }
    let is_sharp = |pair: &[usize]| {
        let [Some(m), Some(n)] = [0, 1].map(|i| normal.get(&source_face[pair[i] / 3])) else {
            return false;
        };
        let across = cross(*m, *n);
        dot(across, across).sqrt().atan2(dot(*m, *n)).to_degrees() >= SHARP
    };
    let sharp: BTreeMap<[u32; 2], [usize; 2]> = (sides.iter())
        .filter(|(_, h)| h.len() == 2 && is_sharp(h))
        .map(|(ends, h)| (*ends, [h[0], h[1]]))
        .collect();
    let mut ways: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in sharp.keys() {
        ways.entry(a).or_default().push(b);
        ways.entry(b).or_default().push(a);
    }
    let direction = |h: usize| {
        let at = |h: usize| [uv[2 * h], uv[2 * h + 1]];
        let (p, q) = (at(h), at(3 * (h / 3) + (h + 1) % 3));
        (q[1] - p[1]).atan2(q[0] - p[0])
    };
    let chains = chains(&ways);
    let long = |chain: &&Vec<u32>| {
        let of_input = chain
            .iter()
            .filter(|&&v| source_vertex[v as usize] != u32::MAX);
        of_input.count() > LEAST_EDGES
    };
    let mut found = Lines::default();
    let mut edges = Vec::new();
    let mut ends: BTreeMap<u32, usize> = BTreeMap::new();
    for chain in chains.iter().filter(long) {
        found.chains += 1;
        if let ([first, ..], [.., last]) = (&chain[..], &chain[..]) {
            *ends.entry(*first).or_default() += 1;
            *ends.entry(*last).or_default() += 1;
        }
        edges.extend(chain.windows(2).map(|p| [p[0].min(p[1]), p[0].max(p[1])]));
    }
    ends.values()
        .for_each(|n| *found.junctions.entry(*n).or_default() += 1);
    let length = |[a, b]: [u32; 2]| {
        let along = sub(positions[a as usize], positions[b as usize]);
        dot(along, along).sqrt()
    };
    let quarter = |x: f64| (x / FRAC_PI_2 - (x / FRAC_PI_2).round()).abs() * FRAC_PI_2;
    let directions: Vec<([f64; 2], f64)> = (edges.iter())
        .map(|e| (sharp[e].map(direction), length(*e)))
        .collect();
    let is_along = |d: &[f64; 2]| d.iter().all(|&x| quarter(x) < STRAIGHT);
    found.length = directions.iter().map(|(_, l)| l).sum();
    let along = directions.iter().filter(|(d, _)| is_along(d));
    found.on_lines = along.map(|(_, l)| l).sum();
    let json = std::fs::read(atlas.join("atlas.json")).expect("atlas.json");
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    let features = json["features"].as_array().into_iter().flatten();
    let others = features.filter(|f| f["is_line"] == false);
    found.named = others.filter_map(|f| f["length"].as_f64()).sum();
    found
}

/// Longest chains of edges between vertices where other than two meet, then closed ones.
fn chains(ways: &BTreeMap<u32, Vec<u32>>) -> Vec<Vec<u32>> {
    let mut walked = std::collections::BTreeSet::new();
    let mut chains = Vec::new();
    let ends = ways.iter().filter(|(_, w)| w.len() != 2);
    for (&start, others) in ends.chain(ways.iter().filter(|(_, w)| w.len() == 2)) {
        for &first in others {
            let (mut v, mut w) = (start, first);
            let mut chain = vec![v];
            while walked.insert([v.min(w), v.max(w)]) {
                chain.push(w);
                let next = ways[&w].iter().find(|&&x| x != v);
                match next.filter(|_| ways[&w].len() == 2) {
                    Some(&x) => (v, w) = (w, x),
                    None => break,
                }
            }
            if chain.len() > 1 {
                chains.push(chain);
            }
        }
    }
    chains
}
