//! The node tree: which mesh stands where (glTF 2.0, 3.5).

use super::buffers::lookup;
use super::schema::{Node, Root};
use crate::geometry::mesh::norm;
use crate::read::error::ReadProblem;

/// An affine map of space: rows of the linear part, and the translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    pub linear: [[f64; 3]; 3],
    pub translation: [f64; 3],
}

impl Affine {
    pub const IDENTITY: Self = Self {
        linear: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        translation: [0.0; 3],
    };

    /// The linear part applied to a vector.
    pub fn vector(&self, v: [f64; 3]) -> [f64; 3] {
        self.linear
            .map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// The image of a point.
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let v = self.vector(p);
        std::array::from_fn(|i| v[i] + self.translation[i])
    }

    /// First `inner`, then this.
    pub fn after(&self, inner: &Self) -> Self {
        let column = |c: usize| self.vector([0, 1, 2].map(|r| inner.linear[r][c]));
        let columns = [column(0), column(1), column(2)];
        Self {
            linear: [0, 1, 2].map(|r| [0, 1, 2].map(|c: usize| columns[c][r])),
            translation: self.point(inner.translation),
        }
    }

    /// Cofactors of the linear part: the inverse transpose times the determinant, which exists where the
    /// inverse does not.
    fn cofactors(&self) -> [[f64; 3]; 3] {
        let m = &self.linear;
        [0, 1, 2].map(|r: usize| {
            [0, 1, 2].map(|c: usize| {
                let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
                m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
            })
        })
    }

    /// Determinant of the linear part; negative where the map mirrors.
    pub fn determinant(&self) -> f64 {
        let row = self.cofactors()[0];
        (0..3).map(|c| self.linear[0][c] * row[c]).sum()
    }

    /// The unit normal of a surface after the map, by the inverse transpose; NaN where there is none.
    pub fn normal(&self, n: [f64; 3]) -> [f64; 3] {
        let cofactors = Self {
            linear: self.cofactors(),
            translation: [0.0; 3],
        };
        let sign = if self.determinant() < 0.0 { -1.0 } else { 1.0 };
        unit(cofactors.vector(n).map(|x| sign * x))
    }

    /// The unit tangent after the map; NaN where there is none.
    pub fn tangent(&self, t: [f64; 3]) -> [f64; 3] {
        unit(self.vector(t))
    }

    fn is_finite(&self) -> bool {
        let numbers = self.linear.as_flattened().iter().chain(&self.translation);
        numbers.into_iter().all(|x| x.is_finite())
    }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = norm(v);
    v.map(|x| if length > 0.0 { x / length } else { f64::NAN })
}

/// The transform of a node in its parent.
fn local(node: &Node) -> Option<Affine> {
    if let Some(m) = &node.matrix {
        return Some(Affine {
            linear: [0, 1, 2].map(|r: usize| [m[r], m[4 + r], m[8 + r]]),
            translation: [m[12], m[13], m[14]],
        });
    }
    let q = node.rotation.as_deref().copied();
    let q = q.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    // Files hold single precision: unnormalised, it would scale the mesh by 1 ± 1e-7.
    let length = norm([norm([q[0], q[1], q[2]]), q[3], 0.0]);
    if length == 0.0 {
        return None;
    }
    let [x, y, z, w] = q.map(|c| c / length);
    let rotation = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ];
    let scale = node.scale.as_deref().copied().unwrap_or([1.0; 3]);
    let translation = node.translation.as_deref().copied();
    Some(Affine {
        linear: rotation.map(|row| std::array::from_fn(|c| row[c] * scale[c])),
        translation: translation.unwrap_or([0.0; 3]),
    })
}

/// A mesh under a node.
#[derive(Debug)]
pub struct Instance {
    pub node: usize,
    pub mesh: usize,
    pub transform: Affine,
}

/// All meshes of the default scene, or of all nodes where the file names no default scene, in order of the nodes' indices.
///
/// A node may be reached once only, as glTF demands: then the number of instances is bounded by the file's
/// size, whatever it contains. Skinned meshes are taken in the bind pose: there every joint times its inverse
/// bind matrix is the identity, so vertices stand where they are stored, and the node's own transform does not
/// act on them (3.7.3.3).
pub fn instances(root: &Root) -> Result<(Vec<Instance>, Vec<String>), ReadProblem> {
    let mut notes = Vec::new();
    let nodes = &root.nodes;
    let mut is_child = vec![false; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            lookup(nodes, child, "node", || format!("node {i}"))?;
            is_child[child] = true;
        }
    }
    let roots = match root.scene {
        Some(scene) => {
            let scene = lookup(&root.scenes, scene, "scene", || "the asset".into())?;
            scene.nodes.clone()
        }
        None => (0..nodes.len()).filter(|&i| !is_child[i]).collect(),
    };
    let mut placed: Vec<Option<Affine>> = vec![None; nodes.len()];
    let mut open: Vec<(usize, Affine)> = roots.iter().map(|&r| (r, Affine::IDENTITY)).collect();
    while let Some((i, parent)) = open.pop() {
        let node = lookup(nodes, i, "node", || "the scene".into())?;
        let transform = local(node).map(|inner| parent.after(&inner));
        let transform = transform.filter(Affine::is_finite);
        let transform = transform.ok_or(ReadProblem::NodeTransform { node: i })?;
        if placed[i].replace(transform).is_some() {
            return Err(ReadProblem::NodeRepeated { node: i });
        }
        open.extend(node.children.iter().map(|&child| (child, transform)));
    }
    let mut instances = Vec::new();
    let mut outside = 0;
    for (i, (node, placed)) in nodes.iter().zip(placed).enumerate() {
        let Some(transform) = placed else {
            if root.scene.is_none() {
                // Every tree was walked from its root: who was not reached has no root.
                return Err(ReadProblem::NodeRepeated { node: i });
            }
            outside += usize::from(node.mesh.is_some());
            continue;
        };
        let Some(mesh) = node.mesh else {
            continue;
        };
        if node.skin.is_some() {
            notes.push(format!(
                "node {i}: the skinned mesh is taken in its bind pose"
            ));
        }
        if node.extensions.instancing.is_some() {
            notes.push(format!("node {i}: the copies of EXT_mesh_gpu_instancing are skipped, its mesh is taken once"));
        }
        let skinned = node.skin.is_some();
        instances.push(Instance {
            node: i,
            mesh,
            transform: if skinned { Affine::IDENTITY } else { transform },
        });
    }
    if outside > 0 {
        notes.push(format!(
            "{outside} nodes with meshes lie outside the default scene and are skipped"
        ));
    }
    Ok((instances, notes))
}
