//! The surface with its view and its light, made once for all pictures of it, and the marks that stand on it.
//!
//! *Enters:* a mesh and a size. *Leaves:* a [`Studio`] that knows what each part of the picture shows and how light it is, for
//! [`paint`](super::paint) to be given colours; and [`Props`]: balls and bars in the same light. The view and the light
//! depend on the mesh only, so pictures of different metrics on one mesh can be laid side by side.

use super::coarse::{Coarse, coarse};
use super::floor::Floor;
use super::light::{Lights, Shade};
use super::raster::{Band, NOTHING};
use super::scene::Marks;
use super::view::{Camera, Vec3, along, choose_direction, unit};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{Mesh, cross, dot, norm, sub};
use rayon::prelude::*;

/// Samples along each side of a pixel.
pub(super) const SAMPLES: usize = 3;
/// Rows of pixels that are drawn at a time.
pub(super) const BAND: usize = 16;
/// Faces that meet at less than this share a smooth normal: cosine of 40°.
const CREASE: f64 = 0.766;
/// Surfaces of more faces have a stand-in where the direction is chosen, with so many cells along their longest side …
const VIEWED: (usize, u32) = (60_000, 96);
/// … and where light is baked.
const LIT: (usize, u32) = (200_000, 192);

/// The surface with its view and light, ready to be painted in several ways.
pub(super) struct Studio<'a> {
    pub mesh: &'a Mesh,
    pub camera: Camera,
    pub positions: &'a [Vec3],
    pub faces: Vec<[u32; 3]>,
    /// Vertices on the screen.
    pub screen: Vec<Vec3>,
    /// Faces that some sample sees, a list a band.
    pub seen: Vec<Vec<u32>>,
    /// Unit normals of the corners of faces that are seen, and where they stand for each face.
    pub normals: Vec<[Vec3; 3]>,
    pub normals_of: Vec<u32>,
    /// Light on the outside and on the inside of every vertex that is seen; of a closed surface on the outside only.
    pub shade: [Vec<Shade>; 2],
    pub floor: Floor,
    lights: Lights,
    pub lamp: Vec3,
    pub fill: Vec3,
    /// Pixels along a side of the picture.
    pub size: usize,
    /// Samples along a side of the picture.
    pub side: usize,
}

/// Marks with their place on the screen and their light.
pub(super) struct Props {
    pub marks: Marks,
    /// Their vertices on the screen.
    pub screen: Vec<Vec3>,
    /// Light on their vertices.
    pub shade: Vec<Shade>,
    /// Their triangles that reach into each band.
    pub members: Vec<Vec<u32>>,
}

impl<'a> Studio<'a> {
    /// Chooses the view and lights the scene for a picture of `size` × `size` pixels, held to the range of sizes.
    pub fn new(mesh: &'a Mesh, size: usize) -> Studio<'a> {
        Self::seen_from(mesh, size, direction(mesh))
    }

    /// The same from a direction, a unit vector from the scene to the eye.
    pub fn seen_from(mesh: &'a Mesh, size: usize, direction: Vec3) -> Studio<'a> {
        let size = super::size::side(size);
        let connectivity = &mesh.connectivity;
        let positions = mesh.positions.as_slice();
        let faces = connectivity.to_faces();
        let vertex_normals = vertex_normals(positions, &faces);
        let few = stand_in(LIT, positions, &vertex_normals, &faces);
        let side = size * SAMPLES;
        let camera = Camera::looking_from(direction, positions, side as f64);
        let oriented = |r: f64, u: f64, b: f64| {
            let frame = [camera.right, camera.up, camera.back];
            unit(std::array::from_fn(|i| {
                r * frame[0][i] + u * frame[1][i] + b * frame[2][i]
            }))
        };
        let (lamp, fill) = (oriented(-0.55, 0.75, 0.55), oriented(0.8, 0.15, 0.5));
        let up = [0.0, 1.0, 0.0];
        let lights = match few {
            Some(few) => Lights::new(&few.positions, &few.faces, lamp, up),
            None => Lights::new(positions, &faces, lamp, up),
        };
        let mut studio = Studio {
            mesh,
            size,
            screen: positions.iter().map(|&p| camera.project(p)).collect(),
            seen: Vec::new(),
            normals: Vec::new(),
            normals_of: Vec::new(),
            shade: Default::default(),
            floor: Floor::new(positions),
            lights,
            camera,
            positions,
            faces,
            lamp,
            fill,
            side,
        };
        studio.seen = studio.look();
        studio.light(&vertex_normals);
        studio.smooth();
        studio
    }

    /// Source units that a share of the picture's side has at a point's depth.
    pub fn length(&self, share: f64, p: Vec3) -> f64 {
        let (camera, side) = (&self.camera, self.side as f64);
        share * side / (camera.zoom * camera.project(p)[2]).max(f64::MIN_POSITIVE)
    }

    /// Puts marks into the scene.
    pub fn place(&self, marks: Marks) -> Props {
        let screen: Vec<Vec3> = (marks.positions.iter())
            .map(|&p| self.camera.project(p))
            .collect();
        let points: Vec<(Vec3, Vec3)> = (marks.positions.iter().copied())
            .zip(marks.normals.iter().copied())
            .collect();
        Props {
            shade: self.lights.shade(&points),
            members: self.by_band(&marks.faces, &screen),
            screen,
            marks,
        }
    }

    /// The triangles that reach into each band, so that each draws only its own.
    fn by_band(&self, faces: &[[u32; 3]], screen: &[Vec3]) -> Vec<Vec<u32>> {
        let bands = self.size.div_ceil(BAND);
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); bands];
        for (object, face) in faces.iter().enumerate() {
            let rows = face.map(|v| screen[v as usize][1]);
            let low = rows.iter().copied().fold(f64::INFINITY, f64::min);
            let high = rows.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let band = |row: f64| (row / (BAND * SAMPLES) as f64).max(0.0) as usize;
            if low <= high && low < self.side as f64 && high >= 0.0 {
                for member in &mut members[band(low)..=band(high).min(bands - 1)] {
                    member.push(object as u32);
                }
            }
        }
        members
    }

    /// The faces that some sample sees, a list a band, each in their order.
    fn look(&self) -> Vec<Vec<u32>> {
        let members = self.by_band(&self.faces, &self.screen);
        let seen = |(b, member): (usize, &Vec<u32>)| {
            let mut band = self.band(b * BAND);
            for &face in member {
                band.draw(&self.on_screen(face as usize), face);
            }
            let rows = b * BAND * SAMPLES..((b + 1) * BAND * SAMPLES).min(self.side);
            let mut seen: Vec<u32> = rows
                .flat_map(|y| (0..self.side).map(move |x| (x, y)))
                .map(|(x, y)| band.object(x, y))
                .filter(|&face| face != NOTHING)
                .collect();
            seen.sort_unstable();
            seen.dedup();
            seen
        };
        members.par_iter().enumerate().map(seen).collect()
    }

    /// Samples of a band, empty; `top` is its first row of pixels.
    pub fn band(&self, top: usize) -> Band {
        let rows = BAND.min(self.size - top);
        Band::new(self.side, top * SAMPLES, rows * SAMPLES)
    }

    /// Corners of a face on the screen.
    pub fn on_screen(&self, face: usize) -> [Vec3; 3] {
        self.faces[face].map(|v| self.screen[v as usize])
    }

    /// Lights what is seen: outside, inside where it can be seen, and floor.
    fn light(&mut self, vertex_normals: &[Vec3]) {
        let mut is_seen = vec![false; self.positions.len()];
        for &face in self.seen.iter().flatten() {
            let corners = self.faces[face as usize];
            corners.iter().for_each(|&v| is_seen[v as usize] = true);
        }
        let vertices: Vec<usize> = (0..is_seen.len()).filter(|&v| is_seen[v]).collect();
        let sides: &[f64] = if self.mesh.connectivity.is_closed() {
            &[1.0]
        } else {
            &[1.0, -1.0]
        };
        for (shade, sign) in self.shade.iter_mut().zip(sides) {
            let normal = |v: usize| vertex_normals[v].map(|x| sign * x);
            let point = |&v: &usize| (self.positions[v], normal(v));
            let points: Vec<(Vec3, Vec3)> = vertices.iter().map(point).collect();
            shade.resize(self.positions.len(), Shade::default());
            for (&v, of) in vertices.iter().zip(self.lights.shade(&points)) {
                shade[v] = of;
            }
        }
        let floor: Vec<(Vec3, Vec3)> = self.floor.points().collect();
        self.floor.shade = self.lights.shade(&floor);
    }

    /// Finds the normals at the corners of what is seen.
    fn smooth(&mut self) {
        let connectivity = &self.mesh.connectivity;
        let normals = face_normals(connectivity, self.positions);
        self.normals_of = vec![NOTHING; self.faces.len()];
        for &face in self.seen.iter().flatten() {
            let place = &mut self.normals_of[face as usize];
            // A face can be seen in two bands.
            if *place == NOTHING {
                *place = self.normals.len() as u32;
                let f = FaceId::new(face as usize);
                self.normals.push(corner_normals(connectivity, &normals, f));
            }
        }
    }
}

/// A direction that shows much of the surface, a unit vector from the scene to the eye.
pub(super) fn direction(mesh: &Mesh) -> Vec3 {
    let positions = mesh.positions.as_slice();
    let faces = mesh.connectivity.to_faces();
    match stand_in(
        VIEWED,
        positions,
        &vertex_normals(positions, &faces),
        &faces,
    ) {
        Some(few) => choose_direction(&few.positions, &few.faces),
        None => choose_direction(positions, &faces),
    }
}

/// A coarser surface where there are more than so many faces.
fn stand_in(
    (least, cells): (usize, u32),
    positions: &[Vec3],
    normals: &[Vec3],
    faces: &[[u32; 3]],
) -> Option<Coarse> {
    (faces.len() > least).then(|| coarse(positions, normals, faces, cells))
}

/// Unit normals of the vertices, weighted by area.
fn vertex_normals(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![[0.0; 3]; positions.len()];
    for face in faces {
        let [a, b, c] = face.map(|v| positions[v as usize]);
        let n = cross(sub(b, a), sub(c, a));
        for &v in face {
            sums[v as usize] = along(sums[v as usize], 1.0, n);
        }
    }
    sums.into_iter().map(unit).collect()
}

/// Unit normal and twice the area of every face.
fn face_normals(connectivity: &Connectivity, positions: &[Vec3]) -> Vec<(Vec3, f64)> {
    connectivity
        .faces()
        .map(|f| {
            let [a, b, c] = connectivity.face_vertices(f).map(|v| positions[v.index()]);
            let n = cross(sub(b, a), sub(c, a));
            (unit(n), norm(n))
        })
        .collect()
}

/// Unit normals of the corners of a face: the mean over the faces at the vertex that meet at a small angle.
fn corner_normals(connectivity: &Connectivity, normals: &[(Vec3, f64)], f: FaceId) -> [Vec3; 3] {
    let own = normals[f.index()].0;
    [0, 1, 2].map(|k| {
        let v = connectivity.tail(connectivity.corner_halfedge(f, k));
        let sum = connectivity.outgoing(v).fold([0.0; 3], |sum, h| {
            let (n, weight) = normals[connectivity.face(h).index()];
            if dot(n, own) > CREASE {
                along(sum, weight, n)
            } else {
                sum
            }
        });
        unit(sum)
    })
}
