//! Small surfaces of every topology for the tests of the flow, and real ones where a folder of them is given.

use crate::flow::cones::{BoundaryCondition, Cone, Prescription};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId, VertexId, VertexVec};
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::PI;
use std::path::PathBuf;

/// A surface as the flow sees it, with positions for areas only.
#[derive(Clone)]
pub(crate) struct Shape {
    pub name: String,
    pub connectivity: Connectivity,
    pub length: EdgeVec<f64>,
}

impl Shape {
    pub(crate) fn new(name: &str, faces: &[[u32; 3]], positions: &[[f64; 3]]) -> Self {
        let connectivity = Connectivity::from_faces(faces, positions.len()).unwrap();
        let length = connectivity
            .edges()
            .map(|e| {
                let [a, b] = connectivity.edge_vertices(e).map(|v| positions[v.index()]);
                (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
            })
            .collect();
        Self {
            name: name.into(),
            connectivity,
            length,
        }
    }

    /// Prescribed cones (vertex, curvature); every other vertex flat; free boundary.
    pub(crate) fn prescribe(&self, cones: &[(usize, f64)]) -> Prescription {
        let mut target = VertexVec::filled(0.0, self.connectivity.vertex_count());
        let mut list = Vec::new();
        for &(v, curvature) in cones {
            target[VertexId::new(v)] = curvature;
            list.push(Cone {
                vertex: VertexId::new(v),
                curvature,
            });
        }
        list.sort_by_key(|c| c.vertex);
        Prescription {
            target,
            cones: list,
            boundary: BoundaryCondition::Free,
            field: None,
        }
    }

    /// The same curvature at every boundary vertex, 2πχ in all, no cone inside.
    pub(crate) fn prescribe_uniform_boundary(&self) -> Prescription {
        let c = &self.connectivity;
        let on_boundary: Vec<usize> = c
            .vertices()
            .filter(|&v| c.is_boundary_vertex(v))
            .map(|v| v.index())
            .collect();
        let total = 2.0 * PI * c.topology().euler_characteristic as f64;
        let each = total / on_boundary.len() as f64;
        let cones: Vec<_> = on_boundary.into_iter().map(|v| (v, each)).collect();
        Prescription {
            boundary: BoundaryCondition::Uniform,
            ..self.prescribe(&cones)
        }
    }

    /// Equal cones: 8 of π/2 on spheres, none on tori, 2g − 2 of −2π above,
    /// spread by edge-graph distance; free boundaries.
    pub(crate) fn prescribe_default(&self) -> Prescription {
        let topology = self.connectivity.topology();
        if topology.boundary_loops > 0 {
            return self.prescribe(&[]);
        }
        let (count, curvature) = match topology.genus {
            0 => (8, PI / 2.0),
            g => (2 * g as usize - 2, -2.0 * PI),
        };
        let cones: Vec<_> = self
            .spread(count)
            .into_iter()
            .map(|v| (v, curvature))
            .collect();
        self.prescribe(&cones)
    }

    /// Without the faces around some vertices that lie far from each other.
    pub(crate) fn pierced(&self, holes: usize) -> Shape {
        let (c, places) = (&self.connectivity, self.spread(holes));
        let is_kept = |f: &[u32; 3]| f.iter().all(|&v| !places.contains(&(v as usize)));
        let kept: Vec<[u32; 3]> = c.to_faces().into_iter().filter(is_kept).collect();
        let mut number = BTreeMap::new();
        let faces = kept.iter().map(|f| {
            f.map(|v| {
                let next = number.len() as u32;
                *number.entry(v).or_insert(next)
            })
        });
        let faces: Vec<[u32; 3]> = faces.collect();
        let pierced = Connectivity::from_faces(&faces, number.len()).unwrap();
        let mut old = vec![0; number.len()];
        number.iter().for_each(|(&v, &n)| old[n as usize] = v);
        let between: BTreeMap<[u32; 2], f64> = c
            .edges()
            .map(|e| {
                let [a, b] = c.edge_vertices(e).map(|v| v.raw());
                ([a.min(b), a.max(b)], self.length[e])
            })
            .collect();
        let length = pierced.edges().map(|e| {
            let [a, b] = pierced.edge_vertices(e).map(|v| old[v.index()]);
            between[&[a.min(b), a.max(b)]]
        });
        Shape {
            name: format!("{} with {holes} holes", self.name),
            length: length.collect(),
            connectivity: pierced,
        }
    }

    /// Farthest-point vertices by edge-graph distance.
    pub(crate) fn spread(&self, count: usize) -> Vec<usize> {
        let mut chosen: Vec<usize> = Vec::new();
        let mut distance = vec![f64::INFINITY; self.connectivity.vertex_count()];
        while chosen.len() < count {
            let next = if chosen.is_empty() {
                0
            } else {
                (0..distance.len())
                    .max_by(|&i, &j| distance[i].total_cmp(&distance[j]).then(j.cmp(&i)))
                    .unwrap()
            };
            chosen.push(next);
            let mut heap = BinaryHeap::new();
            distance[next] = 0.0;
            heap.push((std::cmp::Reverse(0u64), next));
            while let Some((std::cmp::Reverse(bits), v)) = heap.pop() {
                // Positive floats order like their bits.
                let d = f64::from_bits(bits);
                if d > distance[v] {
                    continue;
                }
                let c = &self.connectivity;
                for h in c.outgoing(VertexId::new(v)) {
                    for side in [h, c.prev(h)] {
                        let n = c.head(side).index().max(c.tail(side).index());
                        let other = if n == v {
                            c.head(side).index().min(c.tail(side).index())
                        } else {
                            n
                        };
                        let through = d + self.length[c.edge(side)];
                        if through < distance[other] {
                            distance[other] = through;
                            heap.push((std::cmp::Reverse(through.to_bits()), other));
                        }
                    }
                }
            }
        }
        chosen
    }
}

/// Numbers in [0, 1) without pattern, reproducible.
pub(crate) fn sequence(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// An uneven torus of `n` × `m` quads.
pub(crate) fn torus(n: usize, m: usize) -> Shape {
    let mut random = sequence(3);
    let mut positions = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let a = (i as f64 + 0.4 * random()) * 2.0 * PI / n as f64;
            let b = (j as f64 + 0.4 * random()) * 2.0 * PI / m as f64;
            let r = 2.0 + (0.7 + 0.2 * (2.0 * a).sin()) * b.cos();
            positions.push([r * a.cos(), r * a.sin(), 0.7 * b.sin()]);
        }
    }
    let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    Shape::new("torus", &faces, &positions)
}

/// An uneven, wavy sheet of `n` × `n` quads, optionally with a square hole in the middle.
pub(crate) fn sheet(n: usize, hole: bool) -> Shape {
    let mut random = sequence(5);
    let inside = |i: usize| hole && 3 * i >= n && 3 * (i + 1) <= 2 * n;
    let mut index: BTreeMap<(usize, usize), u32> = BTreeMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for i in 0..n {
        for j in 0..n {
            if inside(i) && inside(j) {
                continue;
            }
            let q = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(x, y)| {
                *index.entry((x, y)).or_insert_with(|| {
                    let (x, y) = (x as f64 + 0.3 * random(), y as f64 + 0.3 * random());
                    let height = 1.5 * (x * 6.0 / n as f64).sin() * (y * 5.0 / n as f64).cos();
                    positions.push([x, y, height]);
                    positions.len() as u32 - 1
                })
            });
            faces.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    Shape::new(if hole { "annulus" } else { "disk" }, &faces, &positions)
}

/// The surface of a plate of cells with `genus` holes, each cell face cut into `level` × `level` quads, pulled out of shape.
pub(crate) fn plate(genus: usize, level: usize) -> Shape {
    let columns = 2 * genus + 1;
    let solid = |x: i64, y: i64, z: i64| {
        x >= 0 && x < columns as i64 && (0..3).contains(&y) && z == 0 && !(y == 1 && x % 2 == 1)
    };
    let mut quads: Vec<[[i64; 3]; 4]> = Vec::new();
    for x in 0..columns as i64 {
        for y in 0..3 {
            if !solid(x, y, 0) {
                continue;
            }
            for axis in 0..3 {
                for side in [0i64, 1] {
                    let mut n = [x, y, 0];
                    n[axis] += 2 * side - 1;
                    if solid(n[0], n[1], n[2]) {
                        continue;
                    }
                    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
                    let at = |s: i64, t: i64| {
                        let mut p = [x, y, 0];
                        p[axis] += side;
                        let mut p = p.map(|v| v * level as i64);
                        p[b] += s;
                        p[c] += t;
                        p
                    };
                    for s in 0..level as i64 {
                        for t in 0..level as i64 {
                            let mut q = [at(s, t), at(s + 1, t), at(s + 1, t + 1), at(s, t + 1)];
                            if side == 0 {
                                q.swap(1, 3);
                            }
                            quads.push(q);
                        }
                    }
                }
            }
        }
    }
    let mut random = sequence(11);
    let mut index: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for quad in quads {
        let q = quad.map(|p| {
            *index.entry(p).or_insert_with(|| {
                let [x, y, z] = p.map(|v| v as f64 / level as f64 + 0.25 / level as f64 * random());
                let bulge = 1.0 + 0.2 * (1.3 * x).sin();
                positions.push([x, y * bulge, z * bulge + 0.3 * (0.9 * x + 0.4 * y).sin()]);
                positions.len() as u32 - 1
            })
        });
        faces.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    }
    Shape::new(&format!("genus {genus}"), &faces, &positions)
}

/// Faces glued along equal letters; a capital runs the other way. All corners are glued as they must be.
pub(crate) fn glued(words: &[&str]) -> Connectivity {
    let sides: Vec<char> = words.iter().flat_map(|w| w.chars()).collect();
    let twin: Vec<Option<HalfedgeId>> = sides
        .iter()
        .enumerate()
        .map(|(h, s)| {
            let other = |o: char| o != *s && o.eq_ignore_ascii_case(s);
            let t = (0..sides.len()).find(|&t| t != h && other(sides[t]));
            t.map(HalfedgeId::new)
        })
        .collect();
    // Corners around a vertex by walking.
    let mut tail = vec![usize::MAX; sides.len()];
    let mut vertices = 0;
    for start in 0..sides.len() {
        let mut h = start;
        while tail[h] == usize::MAX {
            tail[h] = vertices;
            let prev = h - h % 3 + (h % 3 + 2) % 3;
            h = twin[prev].unwrap().index();
        }
        if tail[start] == vertices {
            vertices += 1;
        }
    }
    let tail: Vec<VertexId> = tail.into_iter().map(VertexId::new).collect();
    Connectivity::from_gluing(tail.into(), &twin, vertices).unwrap()
}

/// A small surface of every kind: genus 0 to 2, one and two boundary loops.
pub(crate) fn small() -> Vec<Shape> {
    vec![
        plate(0, 2),
        torus(9, 7),
        plate(2, 1),
        sheet(7, false),
        sheet(9, true),
    ]
}

/// Of models with more faces, which have four fifths of all, tests of one scheme or method are for `--ignored`.
const MOST_FACES: usize = 30_000;

/// The models in the folder that `AFFINE_ATLAS_CORPUS` names, but the large ones, by file name; none, with a note, where it is unset.
pub(crate) fn corpus() -> Vec<Shape> {
    let mut models = models();
    models.retain(|shape| shape.connectivity.face_count() <= MOST_FACES);
    models
}

/// The large models, which must be there.
pub(crate) fn large_models() -> Vec<Shape> {
    let mut models = models();
    models.retain(|shape| shape.connectivity.face_count() > MOST_FACES);
    assert!(!models.is_empty(), "AFFINE_ATLAS_CORPUS names none");
    models
}

fn models() -> Vec<Shape> {
    let Some(folder) = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from) else {
        println!("skipped: AFFINE_ATLAS_CORPUS is not set");
        return Vec::new();
    };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|f| f.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "obj" || e == "off"))
        .collect();
    files.sort();
    files.iter().map(|p| read(p)).collect()
}

/// One model of the corpus.
pub(crate) fn corpus_model(name: &str) -> Option<Shape> {
    let Some(folder) = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from) else {
        println!("skipped: AFFINE_ATLAS_CORPUS is not set");
        return None;
    };
    Some(read(&folder.join(name)))
}

fn read(path: &std::path::Path) -> Shape {
    let text = std::fs::read_to_string(path).unwrap();
    let (mut positions, mut faces): (Vec<[f64; 3]>, Vec<[u32; 3]>) = Default::default();
    let mut fan = |corners: Vec<u32>| {
        for k in 2..corners.len() {
            faces.push([corners[0], corners[k - 1], corners[k]]);
        }
    };
    let number = |w: &str| w.parse::<f64>().unwrap();
    if path.extension().is_some_and(|e| e == "off") {
        let mut words = text
            .lines()
            .filter(|l| !l.starts_with('#'))
            .flat_map(str::split_whitespace)
            .skip(1);
        let mut next = || words.next().unwrap();
        let [vertices, count, _] = [(); 3].map(|_| number(next()) as usize);
        for _ in 0..vertices {
            positions.push([(); 3].map(|_| number(next())));
        }
        for _ in 0..count {
            let n = number(next()) as usize;
            fan((0..n).map(|_| number(next()) as u32).collect());
        }
    } else {
        for line in text.lines() {
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => positions.push([(); 3].map(|_| number(words.next().unwrap()))),
                Some("f") => fan(words
                    .map(|w| number(w.split('/').next().unwrap()) as u32 - 1)
                    .collect()),
                _ => {}
            }
        }
    }
    // Unreferenced vertices go.
    let mut index = vec![u32::MAX; positions.len()];
    let mut kept = Vec::new();
    for v in faces.iter_mut().flatten() {
        if index[*v as usize] == u32::MAX {
            index[*v as usize] = kept.len() as u32;
            kept.push(positions[*v as usize]);
        }
        *v = index[*v as usize];
    }
    Shape::new(&path.file_name().unwrap().to_string_lossy(), &faces, &kept)
}
