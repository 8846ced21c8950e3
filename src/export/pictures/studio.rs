//! A surface with its view and its light, and the pictures of it.
//!
//! *Enters:* a mesh, a size, marks and what the surface looks like without light. *Leaves:* pictures. The view and the light depend
//! on the mesh only, so pictures of different metrics on one mesh can be laid side by side.
//!
//! What the samples of each pixel see is found first; each object is then shaded once a pixel, at the middle of its samples, by a [`Brush`].
//! Nearby parts of the surface take some of its light ([`Ambient`]).

use super::ambient::{Ambient, COARSER};
use super::aspect::{Aspect, Spot};
use super::colour::{CUT, Linear, NEGATIVE, POSITIVE, to_linear};
use super::floor::Floor;
use super::light::Light;
use super::normals::corner_normals;
use super::proxy::Proxy;
use super::raster::{Band, NOTHING, SAMPLES, place, row_at, sparse};
use super::view::{Camera, Vec3, along, choose_direction};
use crate::geometry::mesh::{Mesh, dot, sub};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Rows of pixels that are drawn at a time.
pub(super) const BAND: usize = 32;
/// Radius of a bar along the cut, in sides of the picture.
const CUT_RADIUS: f64 = 0.0026;
/// Radius of the ball at a cone, likewise.
const CONE_RADIUS: f64 = 0.0125;

/// A ball or a bar with round ends, by the ends of its axis.
pub(super) struct Mark {
    pub ends: [Vec3; 2],
    /// In sides of the picture.
    pub radius: f64,
    pub colour: Linear,
}

impl Mark {
    /// An edge of the cut.
    pub fn cut(ends: [Vec3; 2]) -> Mark {
        let colour = to_linear(CUT);
        Mark {
            ends,
            radius: CUT_RADIUS,
            colour,
        }
    }

    /// A cone: a ball so many times the usual size, red where the curvature is positive and blue where it is negative.
    pub fn cone(at: Vec3, curvature: f64, size: f64) -> Mark {
        let colour = to_linear(if curvature > 0.0 { POSITIVE } else { NEGATIVE });
        Mark {
            ends: [at; 2],
            radius: size * CONE_RADIUS,
            colour,
        }
    }
}

/// What is drawn: one surface, or several.
#[derive(Default)]
pub(super) struct Shape {
    pub positions: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
    /// Unit normals of the corners of faces.
    pub normals: Vec<[Vec3; 3]>,
}

impl Shape {
    /// Smooth but for creases.
    pub fn of(mesh: &Mesh) -> Shape {
        Shape {
            positions: mesh.positions.as_slice().to_vec(),
            faces: mesh.connectivity.to_faces(),
            normals: corner_normals(mesh),
        }
    }
}

/// The surface with its view and light, ready to be painted in several ways.
pub(super) struct Studio {
    pub camera: Camera,
    shape: Arc<Shape>,
    /// Vertices on the screen.
    screen: Vec<Vec3>,
    pub light: Light,
    pub ambient: Ambient,
    /// Faces that may be seen in each band of rows, in ascending order.
    pub in_band: Vec<Vec<u32>>,
    /// Pixels along a side of the picture.
    pub size: usize,
}

impl Studio {
    /// Lights the scene for pictures of `size` × `size` pixels, held to the range of sizes: one from where it is seen best, and where
    /// `around` says so one from half around the vertical.
    pub fn views(shape: Shape, size: usize, around: bool) -> Vec<Studio> {
        let shape = Arc::new(shape);
        let proxy = Proxy::of(&shape.positions, &shape.faces);
        let [x, y, z] = choose_direction(&proxy.positions, &proxy.faces);
        let directions = [[x, y, z], [-x, y, -z]];
        let views = directions[..if around { 2 } else { 1 }].iter();
        views
            .map(|&from| Studio::new(&shape, &proxy, size, from))
            .collect()
    }

    /// From a direction, a unit vector from the scene to the eye.
    fn new(shape: &Arc<Shape>, proxy: &Proxy, size: usize, direction: Vec3) -> Studio {
        let size = super::canvas::side(size);
        let positions = &shape.positions;
        let camera = Camera::looking_from(direction, positions, size as f64);
        let screen: Vec<Vec3> = positions.iter().map(|&p| camera.project(p)).collect();
        let floor = Floor::new(&proxy.positions, &proxy.faces);
        let mut studio = Studio {
            size,
            in_band: in_bands(&shape.faces, &screen, size),
            screen,
            light: Light::new(camera.clone(), &floor, size),
            ambient: Ambient::default(),
            camera,
            shape: Arc::clone(shape),
        };
        studio.ambient = studio.look_around();
        studio
    }

    /// The points that a coarser picture shows, and what is near them.
    fn look_around(&self) -> Ambient {
        let side = self.size.div_ceil(COARSER);
        let coarser = |p: &Vec3| sparse([p[0] / COARSER as f64, p[1] / COARSER as f64, p[2]]);
        let screen: Vec<Vec3> = self.screen.iter().map(coarser).collect();
        let band = Band::of(side, 0..side, self.faces(), &screen);
        let point = |at: usize| {
            let face = band.objects()[at];
            let [x, y] = place(at % side, at / side);
            let at = [x * COARSER as f64, y * (COARSER * SAMPLES) as f64];
            (face != NOTHING).then(|| {
                let aspect = self.aspect(face);
                let spot = aspect.spot(at);
                (self.position(&spot), aspect.normal(at))
            })
        };
        let points = (0..side * side).into_par_iter().map(point).collect();
        let picture = self.size as f64 * self.camera.depth / self.camera.zoom;
        Ambient::new(points, side, picture)
    }

    /// Corners of the faces.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.shape.faces
    }

    /// Corners of a face on the screen.
    pub fn on_screen(&self, face: u32) -> [Vec3; 3] {
        self.faces()[face as usize].map(|v| self.screen[v as usize])
    }

    /// A face as the picture shows it.
    pub fn aspect(&self, face: u32) -> Aspect {
        Aspect::new(
            face,
            self.on_screen(face),
            &self.shape.normals[face as usize],
        )
    }

    /// The place of a spot in space.
    pub fn position(&self, spot: &Spot) -> Vec3 {
        let corners = self.faces()[spot.face].map(|v| self.shape.positions[v as usize]);
        std::array::from_fn(|i| (0..3).map(|k| spot.weights[k] * corners[k][i]).sum())
    }

    /// Unit normal of a bar at a place of the picture.
    pub fn bar_normal(&self, bar: &Mark, at: [f64; 2]) -> Vec3 {
        let [a, b] = bar.ends.map(|p| [p[0], p[1], 0.0]);
        let (axis, d) = (sub(b, a), sub([at[0], at[1], 0.0], a));
        let t = dot(d, axis) / dot(axis, axis).max(f64::MIN_POSITIVE);
        let [x, y, _] = along(d, -t.clamp(0.0, 1.0), axis).map(|x| x / bar.radius);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        self.camera.oriented([x, -y, z])
    }
}

/// The faces that reach into each band of rows.
fn in_bands(faces: &[[u32; 3]], screen: &[Vec3], size: usize) -> Vec<Vec<u32>> {
    let bands = |face: &[u32; 3]| -> Range<usize> {
        let rows = face.map(|v| screen[v as usize][1]);
        let first = row_at(rows.into_iter().fold(f64::INFINITY, f64::min));
        let end = row_at(rows.into_iter().fold(f64::NEG_INFINITY, f64::max)).min(size * SAMPLES);
        match first < end {
            true => first / (BAND * SAMPLES)..end.div_ceil(BAND * SAMPLES),
            false => 0..0,
        }
    };
    let mut lists = vec![Vec::new(); size.div_ceil(BAND)];
    for (number, face) in (0..).zip(faces) {
        for band in bands(face) {
            lists[band].push(number);
        }
    }
    lists
}
