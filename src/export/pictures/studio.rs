//! A surface with its view and its light, and the pictures of it.
//!
//! *Enters:* a mesh, a size, marks and what the surface looks like without light. *Leaves:* pictures. The view and the light depend
//! on the mesh only, so pictures of different metrics on one mesh can be laid side by side.
//!
//! What the samples of each pixel see is found first; each object is then shaded once a pixel, at the middle of its samples. Light comes from
//! the sky and the ground, a lamp and a fill light; nearby parts of the surface take some of it ([`Ambient`]).

use super::ambient::{Ambient, COARSER, Point};
use super::colour::{CUT, Linear, NEGATIVE, POSITIVE, mix, to_bytes, to_linear};
use super::floor::Floor;
use super::raster::{Band, NOTHING, SAMPLES, place};
use super::view::{Camera, Vec3, along, is_behind, unit};
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{Mesh, cross, dot, norm, sub};
use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// Rows of pixels that are drawn at a time.
const BAND: usize = 32;
/// Faces that meet at less than this share a smooth normal: cosine of 40°.
const CREASE: f64 = 0.766;
/// Radius of a bar along the cut, in sides of the picture.
const CUT_RADIUS: f64 = 0.0026;
/// Radius of the ball at a cone, likewise.
const CONE_RADIUS: f64 = 0.0125;

/// Tint of the back of the surface.
const INSIDE: Linear = [0.55, 0.40, 0.30];

/// A point of the surface that a pixel shows.
pub struct Spot {
    /// Its face.
    pub face: usize,
    /// Its barycentric weights.
    pub weights: [f64; 3],
    /// By how much these change to the next pixel to the right, …
    pub right: [f64; 3],
    /// … and to the one below.
    pub down: [f64; 3],
}

/// What a spot looks like without light.
pub(super) type Paint<'a> = dyn Fn(&Spot) -> Linear + Sync + 'a;

/// A ball or a bar with round ends, by the ends of its axis.
pub(super) struct Mark {
    ends: [Vec3; 2],
    /// In sides of the picture.
    radius: f64,
    colour: Linear,
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

/// The surface with its view and light, ready to be painted in several ways.
pub(super) struct Studio {
    camera: Camera,
    positions: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// Vertices on the screen.
    screen: Vec<Vec3>,
    /// Unit normals of the corners of faces.
    normals: Vec<[Vec3; 3]>,
    floor: Floor,
    ambient: Ambient,
    lamp: Vec3,
    fill: Vec3,
    /// Pixels along a side of the picture.
    size: usize,
}

impl Studio {
    /// Lights the scene for a picture of `size` × `size` pixels, held to the range of sizes, seen from a direction, a unit vector from the
    /// scene to the eye.
    pub fn new(mesh: &Mesh, size: usize, direction: Vec3) -> Studio {
        let size = super::canvas::side(size);
        let positions = mesh.positions.as_slice().to_vec();
        let faces = mesh.connectivity.to_faces();
        let camera = Camera::looking_from(direction, &positions, size as f64);
        let [lamp, fill] = [[-0.55, 0.75, 0.55], [0.8, 0.15, 0.5]].map(|d| camera.oriented(d));
        let mut studio = Studio {
            size,
            screen: positions.iter().map(|&p| camera.project(p)).collect(),
            normals: corner_normals(mesh),
            floor: Floor::new(&positions, &faces),
            ambient: Ambient::default(),
            lamp,
            fill,
            camera,
            positions,
            faces,
        };
        studio.ambient = studio.look_around();
        studio
    }

    /// The points that a coarser picture shows, and what is near them.
    fn look_around(&self) -> Ambient {
        let side = self.size.div_ceil(COARSER);
        let coarser = |p: &Vec3| [p[0] / COARSER as f64, p[1] / COARSER as f64, p[2]];
        let screen: Vec<Vec3> = self.screen.iter().map(coarser).collect();
        let band = Band::of(side, 0..side * SAMPLES, &self.faces, &screen);
        let point = |at: usize| {
            let (column, row) = (at % side, at / side * SAMPLES + SAMPLES / 2);
            let (face, _) = band.seen(column, row);
            let at = place(column, row).map(|x| x * COARSER as f64);
            (face != NOTHING).then(|| self.point(&self.spot(face as usize, at)))
        };
        let points = (0..side * side).into_par_iter().map(point).collect();
        let picture = self.size as f64 * self.camera.depth / self.camera.zoom;
        Ambient::new(points, side, picture)
    }

    /// The pictures of the surface in each of the paints, with marks on it.
    pub fn draw<const N: usize>(&self, marks: &[Mark], paints: [&Paint; N]) -> [RgbImage; N] {
        let (size, count) = (self.size, self.faces.len() as u32);
        // On the screen, with the radius in pixels.
        let on_screen = |mark: &Mark| Mark {
            ends: mark.ends.map(|p| self.camera.project(p)),
            radius: mark.radius * size as f64,
            ..*mark
        };
        let bars: Vec<Mark> = marks.iter().map(on_screen).collect();
        let draw_band = |b: usize| {
            let rows = b * BAND..((b + 1) * BAND).min(size);
            let of_samples = rows.start * SAMPLES..rows.end * SAMPLES;
            let mut band = Band::of(size, of_samples, &self.faces, &self.screen);
            for (object, bar) in (count..).zip(&bars) {
                band.draw_bar(bar.ends, bar.radius, 1.0 / self.camera.zoom, object);
            }
            let pixels = rows.flat_map(|row| (0..size).map(move |column| (column, row)));
            let pixel = |(x, y)| self.pixel(&band, (x, y), &bars, paints);
            pixels.map(pixel).collect::<Vec<[[u8; 3]; N]>>()
        };
        let bands = (0..size.div_ceil(BAND)).into_par_iter();
        let pixels: Vec<[[u8; 3]; N]> = bands.flat_map_iter(draw_band).collect();
        std::array::from_fn(|n| {
            RgbImage::from_fn(size as u32, size as u32, |x, y| {
                Rgb(pixels[y as usize * size + x as usize][n])
            })
        })
    }

    /// Colour of a pixel in each of the paints.
    fn pixel<const N: usize>(
        &self,
        band: &Band,
        (column, row): (usize, usize),
        bars: &[Mark],
        paints: [&Paint; N],
    ) -> [[u8; 3]; N] {
        let samples: [(u32, [f64; 2]); SAMPLES] = std::array::from_fn(|k| {
            let row = SAMPLES * row + k;
            (band.seen(column, row).0, place(column, row))
        });
        let mut sums = [[0.0_f32; 3]; N];
        for (k, &(object, _)) in samples.iter().enumerate() {
            if samples[..k].iter().any(|s| s.0 == object) {
                continue;
            }
            let (mut count, mut at) = (0.0, [0.0; 2]);
            for (_, p) in samples.iter().filter(|s| s.0 == object) {
                count += 1.0;
                at = [at[0] + p[0], at[1] + p[1]];
            }
            let at = at.map(|x| x / count);
            let shade = |albedo: Linear, (diffuse, gloss): (Linear, f32)| -> Linear {
                std::array::from_fn(|i| albedo[i] * diffuse[i] + gloss)
            };
            let colours = if object == NOTHING {
                [self.background(at); N]
            } else if let Some(mark) = (object as usize).checked_sub(self.faces.len()) {
                let light = self.light(self.bar_normal(&bars[mark], at), at, 1.0, 0.22);
                [shade(bars[mark].colour, light); N]
            } else {
                let spot = self.spot(object as usize, at);
                let (position, normal) = self.point(&spot);
                let open = self.ambient.at(at, (position, normal));
                let light = self.light(normal, at, open, 0.10);
                let behind = is_behind(&self.on_screen(spot.face));
                paints.map(|paint| match paint(&spot) {
                    albedo if behind => shade(mix(albedo, INSIDE, 0.35), light).map(|c| 0.75 * c),
                    albedo => shade(albedo, light),
                })
            };
            for (sum, colour) in sums.iter_mut().zip(colours) {
                // Clamped before the mean, or highlights would have ragged edges.
                let share = count as f32 / SAMPLES as f32;
                *sum = std::array::from_fn(|i| sum[i] + share * colour[i].clamp(0.0, 1.0));
            }
        }
        sums.map(to_bytes)
    }

    /// Corners of a face on the screen.
    fn on_screen(&self, face: usize) -> [Vec3; 3] {
        self.faces[face].map(|v| self.screen[v as usize])
    }

    /// The spot of a face at a place of the picture.
    fn spot(&self, face: usize, at: [f64; 2]) -> Spot {
        let screen = self.on_screen(face);
        // Weights on the screen with their slopes; closeness undoes the perspective.
        let parts = [0, 1, 2].map(|k| {
            let (p, q, near) = (screen[(k + 1) % 3], screen[(k + 2) % 3], screen[k][2]);
            let (right, down) = (near * (p[1] - q[1]), near * (q[0] - p[0]));
            [right * (at[0] - p[0]) + down * (at[1] - p[1]), right, down]
        });
        let [sum, right, down] = [0, 1, 2].map(|i| parts[0][i] + parts[1][i] + parts[2][i]);
        let (weights, sum) = match sum != 0.0 && sum.is_finite() {
            true => (parts.map(|part| part[0] / sum), sum),
            false => ([1.0, 0.0, 0.0], f64::INFINITY),
        };
        let slope =
            |i: usize, of_sum: f64| [0, 1, 2].map(|k| (parts[k][i] - weights[k] * of_sum) / sum);
        Spot {
            face,
            weights,
            right: slope(1, right),
            down: slope(2, down),
        }
    }

    /// Position and unit normal, towards the eye, of a spot.
    fn point(&self, spot: &Spot) -> Point {
        let blend = |of: [Vec3; 3]| -> Vec3 {
            std::array::from_fn(|i| (0..3).map(|k| spot.weights[k] * of[k][i]).sum())
        };
        let normal = unit(blend(self.normals[spot.face]));
        let position = blend(self.faces[spot.face].map(|v| self.positions[v as usize]));
        match is_behind(&self.on_screen(spot.face)) {
            true => (position, normal.map(|x| -x)),
            false => (position, normal),
        }
    }

    /// Unit normal of a bar at a place of the picture.
    fn bar_normal(&self, bar: &Mark, at: [f64; 2]) -> Vec3 {
        let [a, b] = bar.ends.map(|p| [p[0], p[1], 0.0]);
        let (axis, d) = (sub(b, a), sub([at[0], at[1], 0.0], a));
        let t = dot(d, axis) / dot(axis, axis).max(f64::MIN_POSITIVE);
        let [x, y, _] = along(d, -t.clamp(0.0, 1.0), axis).map(|x| x / bar.radius);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        self.camera.oriented([x, -y, z])
    }

    /// Light on a point with this unit normal: from sky and ground, lamp and fill light, and a soft gloss.
    fn light(&self, normal: Vec3, at: [f64; 2], open: f32, gloss: f32) -> (Linear, f32) {
        let toward_eye = unit(self.camera.sight(at).map(|x| -x));
        let upward = 0.5 + 0.5 * normal[1] as f32;
        let sky = mix([0.35, 0.33, 0.31], [0.52, 0.55, 0.60], upward);
        let [lamp, fill] = [self.lamp, self.fill].map(|d| dot(normal, d).max(0.0) as f32 * open);
        let halfway = unit(along(self.lamp, 1.0, toward_eye));
        let shine = dot(normal, halfway).max(0.0).powi(28) as f32;
        let rim = (1.0 - dot(normal, toward_eye).max(0.0)).powi(4) as f32;
        let diffuse = std::array::from_fn(|i| {
            sky[i] * open + [0.62, 0.585, 0.53][i] * lamp + [0.17, 0.185, 0.21][i] * fill
        });
        (diffuse, (gloss * shine + 0.05 * rim) * open)
    }

    /// A pale studio whose floor takes the shadow.
    fn background(&self, at: [f64; 2]) -> Linear {
        let half = 0.5 * self.size as f64;
        let [x, y] = [(at[0] - half) / half, (at[1] - 0.9 * half) / half];
        let far = ((x * x + y * y) / (1.45 * 1.45)).min(1.0) as f32;
        let studio = mix([0.93, 0.935, 0.94], [0.76, 0.78, 0.81], far);
        let shadow = self.floor.shadow(self.camera.eye, self.camera.sight(at));
        studio.map(|c| c * (1.0 - 0.55 * shadow))
    }
}

/// Unit normals of the corners of all faces: the mean, by area, over the faces at the vertex that meet at a small angle.
fn corner_normals(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    let connectivity = &mesh.connectivity;
    let normals: Vec<(Vec3, f64)> = (connectivity.faces())
        .map(|f| {
            let [a, b, c] = mesh.face_positions(f);
            let n = cross(sub(b, a), sub(c, a));
            (unit(n), norm(n))
        })
        .collect();
    let of_face = |f: usize| {
        let own = normals[f].0;
        [0, 1, 2].map(|k| {
            let v = connectivity.tail(connectivity.corner_halfedge(FaceId::new(f), k));
            let around = connectivity
                .outgoing(v)
                .map(|h| normals[connectivity.face(h).index()]);
            let smooth = around.filter(|(n, _)| dot(*n, own) > CREASE);
            unit(smooth.fold([0.0; 3], |sum, (n, area)| along(sum, area, n)))
        })
    };
    (0..normals.len()).into_par_iter().map(of_face).collect()
}
