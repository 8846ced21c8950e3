//! From a planar development to everything that an atlas states.

use super::picture::{glb, picture};
use super::plane::{Motion, angle, area, area3, distance, distance3, rotate, wrap};
use super::{Arrays, Atlas, NONE, P2, Plan};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Patch coordinates are central coordinates turned by −0.5 and halved.
pub const PATCH_SCALE: f64 = 2.0;
pub const PATCH_ROTATION: f64 = 0.5;
/// Texels along the longer side.
pub const SIDE: usize = 48;

pub struct Builder {
    plan: Plan,
    /// Face and opposite corner of the halfedge between two vertices.
    halfedge: HashMap<(u32, u32), (usize, usize)>,
    is_cut: BTreeSet<(u32, u32)>,
    segment_of: BTreeMap<(u32, u32), (usize, bool)>,
    segments: Vec<Vec<u32>>,
    gluings: Vec<Motion>,
    on_boundary: Vec<bool>,
}

impl Builder {
    fn new(plan: Plan) -> Self {
        let mut halfedge = HashMap::new();
        for (f, face) in plan.faces.iter().enumerate() {
            for k in 0..3 {
                let ends = (face[(k + 1) % 3], face[(k + 2) % 3]);
                assert!(halfedge.insert(ends, (f, k)).is_none(), "{ends:?} twice");
            }
        }
        let mut on_boundary = vec![false; plan.positions.len()];
        for (a, b) in halfedge.keys() {
            if !halfedge.contains_key(&(*b, *a)) {
                on_boundary[*a as usize] = true;
                on_boundary[*b as usize] = true;
            }
        }
        let is_cut = plan.cut.iter().flat_map(|(a, b)| [(*a, *b), (*b, *a)]);
        let mut builder = Builder {
            is_cut: is_cut.collect(),
            halfedge,
            plan,
            segment_of: BTreeMap::new(),
            segments: Vec::new(),
            gluings: Vec::new(),
            on_boundary,
        };
        builder.trace();
        builder
    }

    fn at(&self, f: usize, v: u32) -> P2 {
        let k = (0..3)
            .find(|k| self.plan.faces[f][*k] == v)
            .expect("a corner");
        self.plan.uv[f][k]
    }

    fn trace(&mut self) {
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (a, b) in &self.is_cut {
            next.entry(*a).or_default().push(*b);
        }
        let is_node = |v: u32| {
            next[&v].len() != 2
                || self.on_boundary[v as usize]
                || self.plan.cones.iter().any(|cone| cone.0 == v)
        };
        for start in next.keys().copied().filter(|v| is_node(*v)) {
            for first in &next[&start] {
                if self.segment_of.contains_key(&(start, *first)) {
                    continue;
                }
                let mut chain = vec![start, *first];
                loop {
                    let [a, b] = [chain[chain.len() - 2], chain[chain.len() - 1]];
                    let id = self.segments.len();
                    self.segment_of.insert((a, b), (id, true));
                    self.segment_of.insert((b, a), (id, false));
                    if is_node(b) {
                        break;
                    }
                    chain.extend(next[&b].iter().find(|c| **c != a));
                }
                let (a, b) = (chain[0], chain[1]);
                let (left, right) = (self.halfedge[&(a, b)].0, self.halfedge[&(b, a)].0);
                let turn = |f: usize| {
                    let (p, q) = (self.at(f, a), self.at(f, b));
                    (q[1] - p[1]).atan2(q[0] - p[0])
                };
                let rotation = wrap(turn(right) - turn(left));
                let (p, q) = (rotate(self.at(left, a), rotation), self.at(right, a));
                self.gluings
                    .push(Motion(rotation, [q[0] - p[0], q[1] - p[1]]));
                self.segments.push(chain);
            }
        }
    }

    /// Takes coordinates left of a → b to those on its right.
    fn across(&self, a: u32, b: u32) -> Motion {
        let (segment, along) = self.segment_of[&(a, b)];
        if along {
            self.gluings[segment]
        } else {
            self.gluings[segment].inverse()
        }
    }

    /// The face counterclockwise of `f` around `v`, and the edge v → w between them.
    fn turn(&self, f: usize, v: u32) -> (Option<usize>, u32) {
        let k = (0..3)
            .find(|k| self.plan.faces[f][*k] == v)
            .expect("a corner");
        let w = self.plan.faces[f][(k + 2) % 3];
        (self.halfedge.get(&(v, w)).map(|h| h.0), w)
    }

    fn turn_back(&self, f: usize, v: u32) -> (Option<usize>, u32) {
        let k = (0..3)
            .find(|k| self.plan.faces[f][*k] == v)
            .expect("a corner");
        let w = self.plan.faces[f][(k + 1) % 3];
        (self.halfedge.get(&(w, v)).map(|h| h.0), w)
    }

    /// Faces of a boundary chart, left and right.
    fn strip(&self, chain: &[u32]) -> [BTreeSet<usize>; 2] {
        let mut sides = [BTreeSet::new(), BTreeSet::new()];
        for ends in chain.windows(2) {
            sides[0].insert(self.halfedge[&(ends[0], ends[1])].0);
            sides[1].insert(self.halfedge[&(ends[1], ends[0])].0);
        }
        for ends in chain.windows(2).skip(1) {
            let v = ends[0];
            let mut f = self.halfedge[&(v, ends[1])].0;
            while let (Some(g), w) = self.turn(f, v) {
                if self.is_cut.contains(&(v, w)) {
                    break;
                }
                sides[0].insert(g);
                f = g;
            }
            f = self.halfedge[&(ends[1], v)].0;
            while let (Some(g), w) = self.turn_back(f, v) {
                if self.is_cut.contains(&(v, w)) {
                    break;
                }
                sides[1].insert(g);
                f = g;
            }
        }
        sides
    }

    /// Faces around a node, copy by copy, with the motion of every copy.
    fn ring(&self, v: u32) -> Vec<(Motion, Vec<usize>)> {
        let mut f = (0..self.plan.faces.len())
            .find(|f| self.plan.faces[*f].contains(&v))
            .expect("a used vertex");
        // Back to the boundary or to a cut edge.
        loop {
            let (g, w) = self.turn_back(f, v);
            match g {
                Some(g) if self.on_boundary[v as usize] || !self.is_cut.contains(&(v, w)) => f = g,
                _ => break,
            }
        }
        let start = f;
        let mut copies = vec![(Motion(0.0, [0.0, 0.0]), vec![f])];
        while let (Some(g), w) = self.turn(f, v) {
            if g == start {
                break;
            }
            if self.is_cut.contains(&(v, w)) {
                let motion = copies[copies.len() - 1].0.after(&self.across(v, w));
                copies.push((motion, Vec::new()));
            }
            copies.last_mut().expect("one copy").1.push(g);
            f = g;
        }
        copies
    }
}

/// The atlas of a plan, complete and right.
pub fn build(plan: Plan) -> Atlas {
    let builder = Builder::new(plan);
    let plan = &builder.plan;
    let faces = plan.faces.len();
    let mut arrays = Arrays {
        positions: plan.positions.clone(),
        faces: plan.faces.clone(),
        source_face: (0..faces as u32).collect(),
        source_vertex: (0..plan.positions.len() as u32).collect(),
        log_scale: plan.positions.iter().map(|p| 0.1 * p[0]).collect(),
        central_uv: plan.uv.clone(),
        patch: plan.patch.clone(),
        ..Arrays::default()
    };
    let closed = !builder.on_boundary.contains(&true);
    let mut curvature: Vec<f64> = builder
        .on_boundary
        .iter()
        .map(|b| if *b { PI } else { TAU })
        .collect();
    for (face, t) in plan.faces.iter().zip(&plan.uv) {
        arrays
            .flat_length
            .push([0, 1, 2].map(|k| distance(t[(k + 1) % 3], t[(k + 2) % 3])));
        let edges = [0, 1, 2].map(|k| (face[(k + 1) % 3], face[(k + 2) % 3]));
        let segment = edges.map(|e| builder.segment_of.get(&e).map_or(NONE, |s| s.0 as u32));
        arrays.cut.push(segment.map(|s| u8::from(s != NONE)));
        arrays.segment.push(segment);
        for k in 0..3 {
            curvature[face[k] as usize] -= angle(t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        }
    }
    arrays.target_curvature = (0..plan.positions.len())
        .map(|v| {
            let cone = plan.cones.iter().find(|cone| cone.0 as usize == v);
            match cone {
                Some(cone) => cone.1,
                None if builder.on_boundary[v] => curvature[v],
                None => 0.0,
            }
        })
        .collect();
    let (charts, transitions) = fill_charts(&builder, &mut arrays);
    arrays.patch_uv = plan
        .uv
        .iter()
        .map(|t| t.map(|p| rotate(p, -PATCH_ROTATION).map(|x| x / PATCH_SCALE)))
        .collect();
    fill_seams(&builder, &mut arrays);
    let patch_count = 1 + *plan.patch.iter().max().expect("faces") as usize;
    let mut pictures = Vec::new();
    let mut patches = Vec::new();
    for id in 0..patch_count {
        let (picture, record) = picture(&arrays, id as u32, SIDE);
        pictures.push(picture);
        patches.push(record);
    }
    let segments: Vec<Value> = builder
        .segments
        .iter()
        .zip(&builder.gluings)
        .enumerate()
        .map(|(id, (chain, gluing))| {
            json!({"id": id, "from": chain[0], "to": chain.last(), "vertices": chain,
                   "gluing": gluing.json(json!({"residual": 0.0}))})
        })
        .collect();
    let seamless = builder.gluings.iter().all(|g| {
        let turns = g.0 / FRAC_PI_2;
        (turns - turns.round()).abs() < 1e-9
    });
    let edges = (3 * faces
        + builder
            .halfedge
            .keys()
            .filter(|(a, b)| !builder.halfedge.contains_key(&(*b, *a)))
            .count())
        / 2;
    let chi = plan.positions.len() as i64 - edges as i64 + faces as i64;
    let cones: Vec<Value> = plan
        .cones
        .iter()
        .map(|(v, k)| json!({"vertex": v, "source_vertex": v, "curvature": k}))
        .collect();
    let json = json!({
        "format": "affine-atlas", "version": 1,
        "generator": {"name": "verifier's own fixture", "version": "1"},
        "source": {"path": "none", "blake3": "abc", "config_blake3": "", "component": 0, "components": 1},
        "topology": {"vertices": plan.positions.len(), "edges": edges, "faces": faces,
                     "euler_characteristic": chi, "genus": plan.topology.0,
                     "boundary_loops": plan.topology.1},
        "repair": {}, "connectivity": {"splits": 0, "flips": 0, "hausdorff": 0.0},
        "metric": {"scheme": "vertex-scaling", "solver": "newton",
                   "boundary": if closed { "none" } else { "free" },
                   "iterations": 0, "flips": 0, "max_curvature_error": 1e-14, "history": []},
        "cones": cones, "segments": segments, "charts": charts, "transitions": transitions,
        "patches": patches, "quality": quality(&arrays),
        "image_origin": [0.0, 0.0, 0.0], "flags": {"seamless": seamless},
    });
    let glb = glb(&arrays);
    Atlas {
        json,
        arrays,
        pictures,
        glb,
    }
}

pub fn fill_charts(builder: &Builder, arrays: &mut Arrays) -> (Vec<Value>, Vec<Value>) {
    let uv = &builder.plan.uv;
    let mut charts = vec![json!({"id": 0, "kind": "central"})];
    let mut transitions = Vec::new();
    arrays.chart_offset = vec![0, 0];
    let mut add = |record: Value, copies: Vec<(Motion, Vec<usize>)>, charts: &mut Vec<Value>| {
        let id = charts.len();
        for (sector, (motion, faces)) in copies.iter().enumerate() {
            transitions.push(motion.json(json!({
                "from": 0, "to": id, "sector": sector, "residual": 0.0, "faces": faces.len(),
            })));
            for f in faces {
                arrays.chart_face.push(*f as u32);
                arrays.chart_sector.push(sector as u8);
                arrays.chart_uv.push(uv[*f].map(|p| motion.apply(p)));
            }
        }
        arrays.chart_offset.push(arrays.chart_face.len() as u32);
        charts.push(record);
    };
    for (id, chain) in builder.segments.iter().enumerate() {
        let [left, right] = builder.strip(chain).map(Vec::from_iter);
        let copies = vec![(builder.gluings[id], left), (Motion(0.0, [0.0; 2]), right)];
        let record = json!({"id": charts.len(), "kind": "boundary", "segment": id});
        add(record, copies, &mut charts);
    }
    let ends = builder.segments.iter().flat_map(|s| [s[0], s[s.len() - 1]]);
    for v in BTreeSet::from_iter(ends) {
        let cone = builder.plan.cones.iter().any(|cone| cone.0 == v);
        if builder.on_boundary[v as usize] || !cone {
            let record = json!({"id": charts.len(), "kind": "node", "vertex": v});
            add(record, builder.ring(v), &mut charts);
        }
    }
    (charts, transitions)
}

/// One seam an edge.
pub fn fill_seams(builder: &Builder, arrays: &mut Arrays) {
    arrays.seam_offset.push(0);
    let mut edges: Vec<_> = builder.halfedge.iter().collect();
    edges.sort();
    for ((a, b), (f, k)) in edges {
        let twin = builder.halfedge.get(&(*b, *a));
        let ends = |f: usize, k: usize| {
            let t = arrays.patch_uv[f];
            [t[(k + 1) % 3], t[(k + 2) % 3]]
        };
        let left = ends(*f, *k);
        let (right, patch) = match twin {
            None => ([[f64::NAN; 2]; 2], NONE),
            Some((g, m)) => {
                let border =
                    builder.is_cut.contains(&(*a, *b)) || arrays.patch[*f] != arrays.patch[*g];
                if a > b || !border {
                    continue;
                }
                let [q, p] = ends(*g, *m);
                ([p, q], arrays.patch[*g])
            }
        };
        for (i, v) in [*a, *b].into_iter().enumerate() {
            arrays.seam_position.push(arrays.positions[v as usize]);
            arrays.seam_uv.push([left[i], right[i]]);
        }
        arrays.seam_patch.push([arrays.patch[*f], patch]);
        arrays.seam_offset.push(arrays.seam_position.len() as u32);
    }
}

pub fn quality(arrays: &Arrays) -> Value {
    let corner = |f: usize| arrays.faces[f].map(|v| arrays.positions[v as usize]);
    let n = arrays.faces.len();
    let before: Vec<f64> = (0..n).map(|f| area3(corner(f))).collect();
    let after: Vec<f64> = arrays.central_uv.iter().map(|t| area(*t)).collect();
    let (sum_before, sum_after) = (before.iter().sum::<f64>(), after.iter().sum::<f64>());
    let (mut distortion, mut mean, mut square) = (0.0, 0.0, 0.0);
    let (mut low, mut high, mut angle_mean, mut angle_max) = (f64::MAX, f64::MIN, 0.0, 0.0f64);
    let mut cut = 0.0;
    for f in 0..n {
        let (a, b) = (before[f] / sum_before, after[f] / sum_after);
        distortion += (b / a - 1.0).powi(2) * a;
        let scale = 0.5 * (b / a).ln();
        mean += a * scale;
        square += a * scale * scale;
        low = low.min(scale);
        high = high.max(scale);
        let t = corner(f);
        for k in 0..3 {
            let [x, y, z] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            let dot: f64 = (0..3).map(|i| (y[i] - x[i]) * (z[i] - x[i])).sum();
            let theta = (dot / (distance3(x, y) * distance3(x, z))).acos();
            let uv = arrays.central_uv[f];
            let flat = angle(uv[k], uv[(k + 1) % 3], uv[(k + 2) % 3]);
            angle_mean += a * (theta - flat).abs() / 3.0;
            angle_max = angle_max.max((theta - flat).abs());
            if arrays.cut[f][k] == 1 {
                cut += 0.5 * distance3(y, z);
            }
        }
    }
    json!({"area_distortion": distortion,
           "log_scale": {"min": low, "max": high, "std": (square - mean * mean).max(0.0).sqrt()},
           "angle_error": {"mean": angle_mean, "max": angle_max},
           "layout_closing_error": 0.0, "cut_length": cut})
}
