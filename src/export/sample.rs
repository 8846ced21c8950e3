//! Hand-made atlases for the tests of this module: flat grids whose every coordinate is known.
//!
//! A grid of `n` by `m` unit squares, each cut along its rising diagonal, is closed around
//! (cylinder) or in both directions (torus). The central chart is the rectangle [0, n] × [0, m].

use crate::atlas::charts::{Chart, ChartFace, ChartKind, Charts, Gluing, Transition};
use crate::atlas::cut::{CutGraph, Segment};
use crate::atlas::develop::Development;
use crate::atlas::geometry_image::{GeometryImage, ImageParams};
use crate::atlas::patch::Domain;
use crate::atlas::patches::{Patch, PatchLayout, Seam, SeamSample};
use crate::atlas::plane::{RigidMotion, Similarity, distance};
use crate::export::Provenance;
use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::flow::refine::ConnectivityRepair;
use crate::flow::ricci::{FlatMetric, FlowParams, FlowStep};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{
    ChartId, EdgeVec, FaceId, FaceVec, HalfedgeId, NONE, PatchId, SegmentId, VertexId, VertexVec,
};
use crate::geometry::mesh::{
    Appearance, AttributeKind, CornerAttribute, EmbeddedImage, Material, Mesh, Part, Texture,
    TextureUse, triangle_area,
};
use crate::product::{AffineAtlas, Quality};
use crate::repair::RepairLog;
use std::f64::consts::TAU;

/// Texels on the longer side of the rectangle.
const TEXELS: usize = 64;
/// Texels around the rectangle.
const MARGIN: usize = 2;

/// What files say about where a sample comes from.
pub(crate) fn provenance(appearance: &Appearance) -> Provenance<'_> {
    static PARTS: std::sync::LazyLock<Vec<Part>> = std::sync::LazyLock::new(|| {
        vec![Part {
            name: "grid".into(),
            first_vertex: 0,
            vertices: 15,
            first_face: 0,
            faces: 30,
        }]
    });
    Provenance {
        path: "models/grid.obj",
        blake3: "0123456789abcdef",
        config_blake3: "fedcba9876543210",
        component: 0,
        components: 1,
        parts: &PARTS,
        appearance,
        asset: "grid",
    }
}

/// A flat torus on a torus of revolution; `n`, `m` ≥ 3.
pub(crate) fn torus(n: usize, m: usize) -> AffineAtlas {
    Grid { n, m, closed: true }.atlas()
}

/// A flat annulus on a cylinder with free boundary; `n` ≥ 3.
pub(crate) fn cylinder(n: usize, m: usize) -> AffineAtlas {
    Grid {
        n,
        m,
        closed: false,
    }
    .atlas()
}

/// A torus with two materials, one of them textured, and faces without a material.
pub(crate) fn textured() -> AffineAtlas {
    let mut atlas = torus(6, 4);
    let faces = atlas.mesh.connectivity.face_count();
    atlas.mesh.face_material = (0..faces).map(|f| [0, 2, NONE][f * 3 / faces]).collect();
    atlas
}

/// Every attribute that glTF knows, with values that it forbids, far from the origin.
pub(crate) fn dressed() -> AffineAtlas {
    let mut atlas = textured();
    let corners = 3 * atlas.mesh.connectivity.face_count();
    let attribute = |kind, components: usize, values: &[f32]| CornerAttribute {
        kind,
        components,
        values: values
            .iter()
            .copied()
            .cycle()
            .take(corners * components)
            .collect(),
    };
    atlas.mesh.attributes.extend([
        attribute(
            AttributeKind::Normal,
            3,
            &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, f32::NAN, 0.0, 1.0],
        ),
        attribute(AttributeKind::Tangent, 4, &[0.0, 1.001, 0.0, -1.0]),
        attribute(
            AttributeKind::Color(0),
            4,
            &[1.5, -0.5, 0.5, 1.0, f32::NAN, 0.0, 0.0, 0.0],
        ),
        attribute(
            AttributeKind::TexCoord(5),
            2,
            &[7.5, -3.0, f32::INFINITY, 0.0],
        ),
        attribute(AttributeKind::Custom("_HEAT".into()), 1, &[0.0]),
    ]);
    atlas.image_origin = [5e8, -1e9, 0.0];
    for p in atlas.mesh.positions.as_mut_slice() {
        *p = std::array::from_fn(|i| p[i] + atlas.image_origin[i]);
    }
    for seam in &mut atlas.patches.seams {
        for sample in &mut seam.samples {
            let p = sample.position;
            sample.position = std::array::from_fn(|i| p[i] + atlas.image_origin[i]);
        }
    }
    atlas
}

/// Three materials, of which [`textured`] uses the first and the last.
pub(crate) fn appearance() -> Appearance {
    let texture = |tex_coord| {
        Some(TextureUse {
            texture: 0,
            tex_coord,
            scale: 1.0,
        })
    };
    let named = |name: &str| Material {
        name: Some(name.into()),
        ..Material::default()
    };
    let pixels =
        image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8, 60 * y as u8, 90]));
    let mut png = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut png, image::ImageFormat::Png).unwrap();
    Appearance {
        materials: vec![
            Material {
                base_color_texture: texture(0),
                emissive_texture: texture(5),
                ..named("textured")
            },
            named("not used"),
            Material {
                alpha_mode: "MASK".into(),
                alpha_cutoff: 0.25,
                base_color: [2.0, 0.5, f32::NAN, 1.0],
                ..named("plain")
            },
        ],
        textures: vec![Texture {
            image: 0,
            wrap: [33071, 10497],
            mag_filter: Some(9729),
            min_filter: Some(9987),
        }],
        images: vec![EmbeddedImage {
            mime_type: "image/jpeg".into(),
            bytes: png.into_inner(),
        }],
    }
}

/// All samples, by name.
pub(crate) fn all() -> [(&'static str, AffineAtlas); 5] {
    [
        ("torus", torus(12, 7)),
        ("cylinder", cylinder(9, 5)),
        ("textured", textured()),
        ("dressed", dressed()),
        ("large", torus(300, 250)),
    ]
}

#[derive(Clone, Copy)]
struct Grid {
    n: usize,
    m: usize,
    closed: bool,
}

impl Grid {
    fn rows(self) -> usize {
        self.m + usize::from(!self.closed)
    }

    fn vertex(self, i: usize, j: usize) -> VertexId {
        VertexId::new(j % self.rows() * self.n + i % self.n)
    }

    fn position(self, v: VertexId) -> [f64; 3] {
        let (i, j) = (v.index() % self.n, v.index() / self.n);
        let (s, c) = (TAU * i as f64 / self.n as f64).sin_cos();
        if !self.closed {
            return [c, s, j as f64];
        }
        let (t, d) = (TAU * j as f64 / self.m as f64).sin_cos();
        [(3.0 + d) * c, (3.0 + d) * s, t]
    }

    /// Grid points of the corners of all faces: below and above the diagonal of every square.
    fn corners(self) -> Vec<[[usize; 2]; 3]> {
        let squares = (0..self.m).flat_map(|j| (0..self.n).map(move |i| (i, j)));
        squares
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    fn lower(self, i: usize, j: usize) -> usize {
        2 * (j * self.n + i)
    }

    fn atlas(self) -> AffineAtlas {
        let mesh = self.mesh();
        let connectivity = &mesh.connectivity;
        let uv: FaceVec<[[f64; 2]; 3]> = self
            .corners()
            .iter()
            .map(|face| face.map(|p| p.map(|x| x as f64)))
            .collect();
        let mut length = EdgeVec::filled(0.0, connectivity.edge_count());
        for h in connectivity.halfedges() {
            let k = connectivity.corner(h);
            let face = uv[connectivity.face(h)];
            length[connectivity.edge(h)] = distance(face[k], face[(k + 1) % 3]);
        }
        let vertices = connectivity.vertex_count();
        let cut = self.cut(connectivity);
        let quality = Quality {
            area_distortion: self.area_distortion(&mesh),
            ..Quality::default()
        };
        AffineAtlas {
            topology: connectivity.topology(),
            prescription: Prescription {
                target: VertexVec::filled(0.0, vertices),
                cones: Vec::new(),
                boundary: BoundaryCondition::Free,
                field: None,
            },
            flow: FlowParams::default(),
            metric: FlatMetric {
                intrinsic: None,
                log_scale: (0..vertices).map(|v| 0.1 * v as f64 - 1.0).collect(),
                length,
                curvature: VertexVec::filled(0.0, vertices),
                history: vec![FlowStep::default()],
                max_curvature_error: 0.0,
                fit: None,
                opened: None,
                quarter_turns: None,
            },
            charts: self.charts(&uv, &cut),
            cut,
            central: Development::from_coordinates(
                uv.clone(),
                self.corners()
                    .iter()
                    .flatten()
                    .map(|p| (p[1] * (self.n + 1) + p[0]) as u32)
                    .collect(),
                (self.n + 1) * (self.m + 1),
            ),
            patches: self.patches(uv),
            images: vec![self.image(&mesh)],
            grid: None,
            no_grid: None,
            image_params: ImageParams::default(),
            image_origin: [0.0; 3],
            repair: [("welded_vertices".to_owned(), 0)].into(),
            connectivity_repair: ConnectivityRepair::default(),
            quality,
            repair_log: RepairLog::default(),
            image_distance: None,
            seamless: true,
            mesh,
        }
    }

    fn mesh(self) -> Mesh {
        let corners = self.corners();
        let faces: Vec<[u32; 3]> = corners
            .iter()
            .map(|face| face.map(|p| self.vertex(p[0], p[1]).raw()))
            .collect();
        let vertices = self.rows() * self.n;
        let texture = |p: &[usize; 2]| {
            [
                p[0] as f32 / self.n as f32,
                1.0 - p[1] as f32 / self.m as f32,
            ]
        };
        Mesh {
            connectivity: Connectivity::from_faces(&faces, vertices).unwrap(),
            positions: (0..vertices)
                .map(|v| self.position(VertexId::new(v)))
                .collect(),
            source_vertex: (0..vertices as u32).collect(),
            source_face: (0..faces.len() as u32).collect(),
            face_material: FaceVec::filled(NONE, faces.len()),
            attributes: vec![CornerAttribute {
                kind: AttributeKind::TexCoord(0),
                components: 2,
                values: corners.iter().flatten().flat_map(texture).collect(),
            }],
        }
    }

    fn area_distortion(self, mesh: &Mesh) -> f64 {
        let areas: Vec<f64> = mesh
            .connectivity
            .faces()
            .map(|f| triangle_area(mesh.face_positions(f)))
            .collect();
        let total: f64 = areas.iter().sum();
        let flat = 1.0 / areas.len() as f64;
        let term = |a: f64| (flat / a - 1.0).powi(2) * a;
        areas.iter().map(|a| term(a / total)).sum()
    }

    /// Segment 0 of the torus runs along the first row; the last segment runs along the first column.
    fn cut(self, connectivity: &Connectivity) -> CutGraph {
        let mut segments = Vec::new();
        if self.closed {
            let row = (0..self.n).map(|i| HalfedgeId::new(3 * self.lower(i, 0)));
            segments.push(Segment {
                halfedges: row.collect(),
            });
        }
        let column = (0..self.m).map(|j| HalfedgeId::new(3 * self.lower(self.n - 1, j) + 1));
        segments.push(Segment {
            halfedges: column.collect(),
        });
        let mut is_cut = EdgeVec::filled(false, connectivity.edge_count());
        let mut segment = EdgeVec::filled(NONE, connectivity.edge_count());
        for (id, s) in segments.iter().enumerate() {
            for &h in &s.halfedges {
                is_cut[connectivity.edge(h)] = true;
                segment[connectivity.edge(h)] = id as u32;
            }
        }
        let mut nodes = vec![self.vertex(0, 0)];
        if !self.closed {
            nodes.push(self.vertex(0, self.m));
        }
        CutGraph {
            is_cut,
            segment,
            segments,
            nodes,
        }
    }

    fn charts(self, uv: &FaceVec<[[f64; 2]; 3]>, cut: &CutGraph) -> Charts {
        let (n, m) = (self.n as f64, self.m as f64);
        let mut charts = vec![Chart {
            kind: ChartKind::Central,
            faces: Vec::new(),
        }];
        let mut transitions = Vec::new();
        let mut add = |kind, sectors: Vec<([f64; 2], Vec<usize>)>| {
            let to = ChartId::new(charts.len());
            let mut faces = Vec::new();
            for (sector, (t, members)) in sectors.into_iter().enumerate() {
                transitions.push(Transition {
                    from: ChartId::new(0),
                    to,
                    sector: sector as u8,
                    motion: RigidMotion {
                        rotation: 0.0,
                        translation: t,
                    },
                    residual: 0.0,
                    faces: members.len(),
                });
                faces.extend(members.into_iter().map(|f| ChartFace {
                    face: FaceId::new(f),
                    sector: sector as u8,
                    uv: uv[FaceId::new(f)].map(|p| [p[0] + t[0], p[1] + t[1]]),
                }));
            }
            charts.push(Chart { kind, faces });
        };
        // Faces with an edge on a segment or a corner at one of its inner vertices, side by side.
        let touching = |side: &dyn Fn([usize; 2]) -> bool, inner: &dyn Fn([usize; 2]) -> bool| {
            let corners = self.corners();
            let on = |f: &usize| {
                let on: Vec<_> = corners[*f].into_iter().filter(|&p| side(p)).collect();
                on.len() == 2 || on.iter().any(|&p| inner(p))
            };
            (0..corners.len()).filter(on).collect::<Vec<_>>()
        };
        let mut segment = 0;
        let mut gluings = Vec::new();
        if self.closed {
            let inner = |p: [usize; 2]| p[0] > 0 && p[0] < self.n;
            let left = touching(&|p| p[1] == 0, &inner);
            let right = touching(&|p| p[1] == self.m, &inner);
            let kind = ChartKind::Boundary(SegmentId::new(segment));
            add(kind, vec![([0.0, 0.0], left), ([0.0, -m], right)]);
            gluings.push([0.0, m]);
            segment += 1;
        }
        let inner = |p: [usize; 2]| p[1] > 0 && p[1] < self.m;
        let left = touching(&|p| p[0] == self.n, &inner);
        let right = touching(&|p| p[0] == 0, &inner);
        let kind = ChartKind::Boundary(SegmentId::new(segment));
        add(kind, vec![([-n, 0.0], left), ([0.0, 0.0], right)]);
        gluings.push([-n, 0.0]);
        for &node in &cut.nodes {
            let points = [[0, 0], [self.n, 0], [0, self.m], [self.n, self.m]];
            let copies = points
                .into_iter()
                .filter(|p| self.vertex(p[0], p[1]) == node);
            let sectors = copies.map(|p| {
                let t = [-(p[0] as f64), -(p[1] as f64)];
                (t, touching(&|q| q == p, &|_| true))
            });
            add(ChartKind::Node(node), sectors.collect());
        }
        let gluing = |translation| Gluing {
            motion: RigidMotion {
                rotation: 0.0,
                translation,
            },
            residual: 0.0,
        };
        Charts {
            charts,
            transitions,
            gluings: gluings.into_iter().map(gluing).collect(),
        }
    }

    /// One patch: the whole rectangle.
    fn patches(self, uv: FaceVec<[[f64; 2]; 3]>) -> PatchLayout {
        let (n, m) = (self.n, self.m);
        let seam = |points: Vec<[usize; 2]>, shift: Option<[f64; 2]>| Seam {
            left: PatchId::new(0),
            right: shift.map(|_| PatchId::new(0)),
            samples: points
                .into_iter()
                .map(|p| {
                    let left = p.map(|x| x as f64);
                    let shift = shift.unwrap_or([f64::NAN; 2]);
                    SeamSample {
                        position: self.position(self.vertex(p[0], p[1])),
                        left,
                        right: [left[0] + shift[0], left[1] + shift[1]],
                    }
                })
                .collect(),
        };
        let row = |j: usize| (0..=n).map(|i| [i, j]).collect::<Vec<_>>();
        let column = (0..=m).map(|j| [n, j]).collect();
        let mut seams = Vec::new();
        if self.closed {
            seams.push(seam(row(0), Some([0.0, m as f64])));
        }
        seams.push(seam(column, Some([-(n as f64), 0.0])));
        if !self.closed {
            seams.push(seam(row(0), None));
            seams.push(seam(row(m).into_iter().rev().collect(), None));
        }
        let (h, size) = self.texels();
        let packed_scale = 1.0 / (h * size[0].max(size[1]) as f64);
        PatchLayout {
            packed: None,
            face_patch: FaceVec::filled(PatchId::new(0), uv.len()),
            uv,
            patches: vec![Patch {
                domain: Domain::Flat,
                to_chart: Some(Similarity {
                    scale: 1.0,
                    rotation: 0.0,
                    translation: [0.0, 0.0],
                }),
                width: size[0],
                height: size[1],
                texel_to_patch: self.texel_to_patch(),
                packed_scale,
                packed_offset: [MARGIN as f64 * h * packed_scale; 2],
            }],
            seams,
        }
    }

    /// Side of a texel, and columns and rows.
    fn texels(self) -> (f64, [usize; 2]) {
        let h = self.n.max(self.m) as f64 / TEXELS as f64;
        let count = |side: usize| (side as f64 / h).ceil() as usize + 2 * MARGIN;
        (h, [count(self.n), count(self.m)])
    }

    fn texel_to_patch(self) -> [[f64; 3]; 2] {
        let (h, _) = self.texels();
        let margin = MARGIN as f64 * h;
        [[h, 0.0, -margin], [0.0, -h, self.m as f64 + margin]]
    }

    fn image(self, mesh: &Mesh) -> GeometryImage {
        let (_, [width, height]) = self.texels();
        let matrix = self.texel_to_patch();
        let mut image = GeometryImage {
            width,
            height,
            position: Vec::new(),
            alpha: Vec::new(),
            normal: Vec::new(),
            face: Vec::new(),
            log_scale: Vec::new(),
            attributes: Vec::new(),
        };
        for (row, column) in (0..height).flat_map(|r| (0..width).map(move |c| (r, c))) {
            let x = matrix[0][0] * (column as f64 + 0.5) + matrix[0][2];
            let y = matrix[1][1] * (row as f64 + 0.5) + matrix[1][2];
            let (cx, cy) = (x.clamp(0.0, self.n as f64), y.clamp(0.0, self.m as f64));
            let (i, j) = ((cx as usize).min(self.n - 1), (cy as usize).min(self.m - 1));
            let (fx, fy) = (cx - i as f64, cy - j as f64);
            let (f, weights) = if fy <= fx {
                (self.lower(i, j), [1.0 - fx, fx - fy, fy])
            } else {
                (self.lower(i, j) + 1, [1.0 - fy, fx, fy - fx])
            };
            let p = mesh.face_positions(FaceId::new(f));
            let at = |c: usize| (0..3).map(|k| weights[k] * p[k][c]).sum::<f64>() as f32;
            image.position.push([at(0), at(1), at(2)]);
            image.alpha.push(f32::from((x, y) == (cx, cy)));
            image.normal.push([0.0, 0.0, 1.0]);
            image.face.push(f as u32);
            image.log_scale.push(fx as f32);
        }
        image
    }
}
