//! Pictures of the surface in space.

use super::checkerboard::{Checkerboard, weighted_quantile};
use super::coarse::{Coarse, coarse};
use super::colour::{CUT, INK, Linear, NEGATIVE, POSITIVE, diverging, mix, to_bytes, to_linear};
use super::floor::Floor;
use super::light::{Shade, bake};
use super::raster::{Band, NOTHING};
use super::scene::Marks;
use super::text::{self, Anchor};
use super::view::{Camera, Vec3, along, choose_direction, dot, unit};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{cross, norm, sub, triangle_area};
use crate::product::AffineAtlas;
use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// Samples along each side of a pixel.
const SAMPLES: usize = 3;
/// Rows of pixels that are drawn at a time.
const BAND: usize = 16;
/// Faces that meet at less than this share a smooth normal: cosine of 40°.
const CREASE: f64 = 0.766;
/// Surfaces of more faces have a stand-in where the direction is chosen, with so many cells along their longest side …
const VIEWED: (usize, u32) = (60_000, 96);
/// … and where light is baked.
const LIT: (usize, u32) = (200_000, 192);

/// The surface with a checkerboard in flat coordinates, cones (red where the curvature is positive, blue where it is
/// negative) and the cut; `size` × `size` pixels.
///
/// Where the log scale is so extreme that cells would be too small or too large to read, their size changes by
/// powers of two, one fading into the next.
pub fn preview(atlas: &AffineAtlas, size: usize) -> RgbImage {
    Studio::new(atlas, size).preview()
}

/// The surface coloured by the log scale, blue where the flat metric shrinks it and red where it grows, with a
/// bar of colours; `size` × `size` pixels. The middle is the median over the area.
pub fn log_scale(atlas: &AffineAtlas, size: usize) -> RgbImage {
    Studio::new(atlas, size).log_scale()
}

/// What a point of a face looks like without light: face, barycentric weights, and size of a pixel there in source units.
type Colour<'a> = dyn Fn(usize, [f64; 3], f64) -> Linear + Sync + 'a;

/// What a sample sees, and its column and row.
type Sample = (u32, [f64; 2]);

/// How often the colour must be asked for.
enum Paint<'a> {
    /// Without edges: once a pixel and face.
    Smooth(&'a Colour<'a>),
    /// At every sample of a pixel where an edge goes through it.
    Edged(&'a Colour<'a>),
}

/// The surface with its view, marks and light, ready to be painted in several ways.
pub(super) struct Studio<'a> {
    atlas: &'a AffineAtlas,
    camera: Camera,
    positions: &'a [Vec3],
    faces: Vec<[u32; 3]>,
    /// Vertices of the surface and, after those, of the marks, on the screen.
    screen: Vec<Vec3>,
    /// Objects that some sample sees, a list a band: faces of the surface and, after those, of the marks.
    seen: Vec<Vec<u32>>,
    /// Unit normals of the corners of faces that are seen, and where they stand for each face.
    normals: Vec<[Vec3; 3]>,
    normals_of: Vec<u32>,
    /// Light on the outside and on the inside of every vertex that is seen; of a closed surface on the outside only.
    shade: [Vec<Shade>; 2],
    marks: Marks,
    mark_shade: Vec<Shade>,
    floor: Floor,
    lamp: Vec3,
    fill: Vec3,
    /// Pixels along a side of the picture.
    size: usize,
    /// Samples along a side of the picture.
    side: usize,
}

impl<'a> Studio<'a> {
    /// Chooses the view and lights the scene for a picture of `size` × `size` pixels, held to the range of sizes.
    pub(super) fn new(atlas: &'a AffineAtlas, size: usize) -> Studio<'a> {
        let size = super::side(size);
        let connectivity = &atlas.mesh.connectivity;
        let positions = atlas.mesh.positions.as_slice();
        let faces = connectivity.to_faces();
        let vertex_normals = vertex_normals(positions, &faces);
        let stand_in = |(least, cells): (usize, u32)| -> Option<Coarse> {
            (faces.len() > least).then(|| coarse(positions, &vertex_normals, &faces, cells))
        };
        let direction = match stand_in(VIEWED) {
            Some(few) => choose_direction(&few.positions, &few.faces),
            None => choose_direction(positions, &faces),
        };
        let side = size * SAMPLES;
        let camera = Camera::looking_from(direction, positions, side as f64);
        let oriented = |r: f64, u: f64, b: f64| {
            let frame = [camera.right, camera.up, camera.back];
            unit(std::array::from_fn(|i| {
                r * frame[0][i] + u * frame[1][i] + b * frame[2][i]
            }))
        };
        let (lamp, fill) = (oriented(-0.55, 0.75, 0.55), oriented(0.8, 0.15, 0.5));
        let marks = marks(atlas, &camera, side as f64);
        let on_screen = positions.iter().chain(&marks.positions);
        let screen = on_screen.map(|&p| camera.project(p)).collect();
        let lit = stand_in(LIT).unwrap_or_else(|| Coarse {
            positions: positions.to_vec(),
            faces: faces.clone(),
        });
        let mut studio = Studio {
            atlas,
            size,
            screen,
            seen: Vec::new(),
            normals: Vec::new(),
            normals_of: Vec::new(),
            shade: Default::default(),
            mark_shade: Vec::new(),
            marks,
            floor: Floor::new(positions),
            camera,
            positions,
            faces,
            lamp,
            fill,
            side,
        };
        studio.seen = studio.look();
        studio.light(&vertex_normals, &lit);
        studio.smooth();
        studio
    }

    /// The objects that some sample sees, a list a band, each in their order.
    fn look(&self) -> Vec<Vec<u32>> {
        let bands = self.size.div_ceil(BAND);
        // Of all objects those that reach into a band, so that each draws only its own.
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); bands];
        for object in 0..self.faces.len() + self.marks.faces.len() {
            let rows = self.on_screen(object).map(|p| p[1]);
            let low = rows.iter().copied().fold(f64::INFINITY, f64::min);
            let high = rows.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let band = |row: f64| (row / (BAND * SAMPLES) as f64).max(0.0) as usize;
            if low <= high && low < self.side as f64 && high >= 0.0 {
                for member in &mut members[band(low)..=band(high).min(bands - 1)] {
                    member.push(object as u32);
                }
            }
        }
        let seen = |(b, member): (usize, &Vec<u32>)| {
            let band = self.raster(b * BAND, member);
            let rows = b * BAND * SAMPLES..((b + 1) * BAND * SAMPLES).min(self.side);
            let mut seen: Vec<u32> = rows
                .flat_map(|y| (0..self.side).map(move |x| (x, y)))
                .map(|(x, y)| band.object(x, y))
                .filter(|&object| object != NOTHING)
                .collect();
            seen.sort_unstable();
            seen.dedup();
            seen
        };
        members.par_iter().enumerate().map(seen).collect()
    }

    /// Lights what is seen: outside, inside where it can be seen, marks and floor, all in one bake.
    fn light(&mut self, vertex_normals: &[Vec3], lit: &Coarse) {
        let mut is_seen = vec![false; self.positions.len()];
        for &object in self.seen.iter().flatten() {
            if let Some(face) = self.faces.get(object as usize) {
                face.iter().for_each(|&v| is_seen[v as usize] = true);
            }
        }
        let vertices: Vec<usize> = (0..is_seen.len()).filter(|&v| is_seen[v]).collect();
        let sides: &[f64] = if self.atlas.mesh.connectivity.is_closed() {
            &[1.0]
        } else {
            &[1.0, -1.0]
        };
        let mut points: Vec<(Vec3, Vec3)> = Vec::new();
        for sign in sides {
            let normal = |v: usize| vertex_normals[v].map(|x| sign * x);
            points.extend(vertices.iter().map(|&v| (self.positions[v], normal(v))));
        }
        let marks = self.marks.positions.iter().zip(&self.marks.normals);
        points.extend(marks.map(|(&p, &n)| (p, n)));
        points.extend(self.floor.points());
        let up = [0.0, 1.0, 0.0];
        let mut shades = bake(&points, &lit.positions, &lit.faces, self.lamp, up).into_iter();
        for (shade, _) in self.shade.iter_mut().zip(sides) {
            shade.resize(self.positions.len(), Shade::default());
            for (&v, of) in vertices.iter().zip(shades.by_ref()) {
                shade[v] = of;
            }
        }
        let marks = self.marks.positions.len();
        self.mark_shade = shades.by_ref().take(marks).collect();
        self.floor.shade = shades.collect();
    }

    /// Finds the normals at the corners of what is seen.
    fn smooth(&mut self) {
        let connectivity = &self.atlas.mesh.connectivity;
        let normals = face_normals(connectivity, self.positions);
        self.normals_of = vec![NOTHING; self.faces.len()];
        for &object in self.seen.iter().flatten() {
            let Some(place) = self.normals_of.get_mut(object as usize) else {
                continue;
            };
            // A face can be seen in two bands.
            if *place == NOTHING {
                *place = self.normals.len() as u32;
                let f = FaceId::new(object as usize);
                self.normals.push(corner_normals(connectivity, &normals, f));
            }
        }
    }

    /// See [`preview`].
    pub(super) fn preview(&self) -> RgbImage {
        let board = Checkerboard::new(self.atlas);
        let mut image = self.draw(&Paint::Edged(&|face, weights, footprint| {
            board.colour(face, weights, footprint)
        }));
        legend(&mut image, self.atlas);
        image
    }

    /// See [`log_scale`].
    pub(super) fn log_scale(&self) -> RgbImage {
        let values = &self.atlas.metric.log_scale;
        let mesh = &self.atlas.mesh;
        // By area, for splits crowd the vertices around cones.
        let mut areas = vec![0.0; values.len()];
        for f in mesh.connectivity.faces() {
            let area = triangle_area(mesh.face_positions(f));
            for v in mesh.connectivity.face_vertices(f) {
                areas[v.index()] += area;
            }
        }
        let mut sorted: Vec<(f64, f64)> = (values.iter().copied().zip(areas))
            .filter(|(x, area)| x.is_finite() && area.is_finite())
            .collect();
        sorted.sort_by(|x, y| x.0.total_cmp(&y.0));
        let middle = weighted_quantile(&sorted, 0.5);
        // One percent of the area, usually that next to cones, may lie beyond the ends of the scale.
        let reach = (weighted_quantile(&sorted, 0.995) - middle)
            .max(middle - weighted_quantile(&sorted, 0.005));
        let reach = if reach > 0.0 { reach } else { 1.0 };
        let connectivity = &self.atlas.mesh.connectivity;
        let mut image = self.draw(&Paint::Smooth(&|face, weights, _| {
            let corners = connectivity.face_vertices(FaceId::new(face));
            let value: f64 = (0..3).map(|k| weights[k] * values[corners[k]]).sum();
            to_linear(diverging((value - middle) / reach))
        }));
        colour_bar(&mut image, middle, reach);
        image
    }

    /// Vertices of a triangle of the surface or, after those, of the marks.
    fn corners(&self, object: usize) -> [Vec3; 3] {
        match self.faces.get(object) {
            Some(face) => face.map(|v| self.positions[v as usize]),
            None => {
                let face = self.marks.faces[object - self.faces.len()];
                face.map(|v| self.marks.positions[v as usize])
            }
        }
    }

    /// The same on the screen.
    fn on_screen(&self, object: usize) -> [Vec3; 3] {
        match self.faces.get(object) {
            Some(face) => face.map(|v| self.screen[v as usize]),
            None => {
                let face = self.marks.faces[object - self.faces.len()];
                face.map(|v| self.screen[self.positions.len() + v as usize])
            }
        }
    }

    fn draw(&self, paint: &Paint) -> RgbImage {
        let size = self.size;
        // What no sample sees hides nothing, and is left out.
        let pixels: Vec<[u8; 3]> = (self.seen.par_iter().enumerate())
            .flat_map_iter(|(b, member)| self.draw_band(b * BAND, member, paint))
            .collect();
        RgbImage::from_fn(size as u32, size as u32, |x, y| {
            Rgb(pixels[y as usize * size + x as usize])
        })
    }

    /// The objects given as the samples of a band see them; `top` is its first row of pixels.
    fn raster(&self, top: usize, member: &[u32]) -> Band {
        let rows = BAND.min(self.size - top);
        let mut band = Band::new(self.side, top * SAMPLES, rows * SAMPLES);
        for &object in member {
            band.draw(&self.on_screen(object as usize), object);
        }
        band
    }

    fn draw_band(&self, top: usize, member: &[u32], paint: &Paint) -> Vec<[u8; 3]> {
        let size = self.size;
        let rows = BAND.min(size - top);
        let band = self.raster(top, member);
        let mut pixels = Vec::with_capacity(rows * size);
        for row in top..top + rows {
            for column in 0..size {
                let samples = (row * SAMPLES..(row + 1) * SAMPLES)
                    .flat_map(|y| (column * SAMPLES..(column + 1) * SAMPLES).map(move |x| [x, y]));
                let mut seen: [Sample; SAMPLES * SAMPLES] =
                    [(NOTHING, [0.0; 2]); SAMPLES * SAMPLES];
                for (entry, [x, y]) in seen.iter_mut().zip(samples) {
                    *entry = (band.object(x, y), [x as f64 + 0.5, y as f64 + 0.5]);
                }
                pixels.push(self.pixel(&mut seen, paint));
            }
        }
        pixels
    }

    /// Colour of a pixel by what its samples see and where they are.
    ///
    /// Light is smooth inside a pixel, so one look at the middle of an object's samples does for all of
    /// them; only the paint may have edges.
    fn pixel(&self, seen: &mut [Sample], paint: &Paint) -> [u8; 3] {
        seen.sort_by_key(|s| s.0);
        let mut sum = [0.0_f32; 3];
        for of_one in seen.chunk_by(|a, b| a.0 == b.0) {
            let count = of_one.len() as f64;
            let object = of_one[0].0;
            let middle =
                std::array::from_fn(|i| of_one.iter().map(|s| s.1[i]).sum::<f64>() / count);
            let colour = if object == NOTHING {
                self.background(middle)
            } else {
                self.shaded(middle, of_one, object as usize, paint)
            };
            for (s, c) in sum.iter_mut().zip(colour) {
                // Clamped before the mean, or highlights would have ragged edges.
                *s += count as f32 * c.clamp(0.0, 1.0);
            }
        }
        to_bytes(sum.map(|s| s / seen.len() as f32))
    }

    /// Mean paint of the samples of one face.
    fn painted(
        &self,
        screen: &[Vec3; 3],
        (middle, samples): (&[f64; 3], &[Sample]),
        face: usize,
        footprint: f64,
        paint: &Paint,
    ) -> Linear {
        let colour = match paint {
            Paint::Smooth(colour) => return colour(face, *middle, footprint),
            Paint::Edged(colour) => |at: [f64; 2]| colour(face, weights(screen, at).0, footprint),
        };
        // Where the first, the last and two between agree no edge goes through.
        let last = samples.len() - 1;
        let few = [0, last / 4, last - last / 4, last].map(|i| colour(samples[i].1));
        if few.iter().all(|c| *c == few[0]) {
            return few[0];
        }
        let mut sum = [0.0; 3];
        for (_, at) in samples {
            for (s, c) in sum.iter_mut().zip(colour(*at)) {
                *s += c / samples.len() as f32;
            }
        }
        sum
    }

    fn shaded(&self, at: [f64; 2], samples: &[Sample], object: usize, paint: &Paint) -> Linear {
        let screen = self.on_screen(object);
        let (weights, depth) = weights(&screen, at);
        let blend = |of: &dyn Fn(usize) -> Vec3| -> Vec3 {
            unit(std::array::from_fn(|i| {
                (0..3).map(|k| weights[k] * of(k)[i]).sum()
            }))
        };
        let toward_eye = unit(self.camera.sight(at).map(|x| -x));
        let mean = |shade: &[Shade], corners: [u32; 3]| {
            let sum = |part: &dyn Fn(&Shade) -> f32| -> f32 {
                (0..3)
                    .map(|k| weights[k] as f32 * part(&shade[corners[k] as usize]))
                    .sum()
            };
            Shade {
                sky: sum(&|s| s.sky),
                lamp: sum(&|s| s.lamp),
            }
        };
        if let Some(&face) = self.faces.get(object) {
            let [a, b, c] = self.corners(object);
            let behind = dot(cross(sub(b, a), sub(c, a)), toward_eye) < 0.0;
            let corners = &self.normals[self.normals_of[object] as usize];
            let mut normal = blend(&|k| corners[k]);
            if behind {
                normal = normal.map(|x| -x);
            }
            let footprint = depth * SAMPLES as f64 / self.camera.zoom;
            let grazing = dot(normal, toward_eye).abs().max(0.05);
            let footprint = footprint / grazing;
            let mut albedo = self.painted(&screen, (&weights, samples), object, footprint, paint);
            if behind {
                albedo = mix(albedo, [0.55, 0.40, 0.30], 0.35).map(|c| 0.75 * c);
            }
            // The back of a closed surface is never seen but by rounding.
            let [outside, inside] = &self.shade;
            let shades = if behind && !inside.is_empty() {
                inside
            } else {
                outside
            };
            let shade = mean(shades, face);
            self.lit(albedo, normal, toward_eye, shade, 0.10)
        } else {
            let mark = object - self.faces.len();
            let face = self.marks.faces[mark];
            let normal = blend(&|k| self.marks.normals[face[k] as usize]);
            let shade = mean(&self.mark_shade, face);
            // Marks stay readable in the shade.
            let shade = Shade {
                sky: 0.5 + 0.5 * shade.sky,
                lamp: 0.25 + 0.75 * shade.lamp,
            };
            self.lit(self.marks.colours[mark], normal, toward_eye, shade, 0.22)
        }
    }

    /// Light that leaves a point towards the eye: sky and ground, lamp, fill light, and a soft gloss.
    fn lit(
        &self,
        albedo: Linear,
        normal: Vec3,
        toward_eye: Vec3,
        shade: Shade,
        gloss: f32,
    ) -> Linear {
        let upward = 0.5 + 0.5 * normal[1] as f32;
        let sky = mix([0.35, 0.33, 0.31], [0.52, 0.55, 0.60], upward);
        let lamp = dot(normal, self.lamp).max(0.0) as f32 * shade.lamp;
        let fill = dot(normal, self.fill).max(0.0) as f32 * shade.sky;
        let halfway = unit(along(self.lamp, 1.0, toward_eye));
        let shine = gloss * dot(normal, halfway).max(0.0).powi(28) as f32 * shade.lamp;
        let rim = (1.0 - dot(normal, toward_eye).max(0.0)).powi(4) as f32 * 0.05 * shade.sky;
        std::array::from_fn(|i| {
            let light =
                sky[i] * shade.sky + [0.62, 0.585, 0.53][i] * lamp + [0.17, 0.185, 0.21][i] * fill;
            albedo[i] * light + shine + rim
        })
    }

    /// A pale studio whose floor takes the shadow.
    fn background(&self, at: [f64; 2]) -> Linear {
        let half = 0.5 * self.side as f64;
        let r = ((at[0] - half) / half).hypot((at[1] - 0.9 * half) / half) as f32;
        let studio = mix(
            [0.93, 0.935, 0.94],
            [0.76, 0.78, 0.81],
            (r / 1.45).powi(2).min(1.0),
        );
        let shadow = self.floor.shadow(self.camera.eye, self.camera.sight(at));
        studio.map(|c| c * (1.0 - 0.55 * shadow))
    }
}

/// Barycentric weights in space and depth at a point of the screen.
fn weights(screen: &[Vec3; 3], at: [f64; 2]) -> ([f64; 3], f64) {
    let part = |k: usize| {
        let (p, q) = (screen[(k + 1) % 3], screen[(k + 2) % 3]);
        (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0])
    };
    // Closeness undoes the perspective.
    let weights: [f64; 3] = std::array::from_fn(|k| part(k) * screen[k][2]);
    let sum: f64 = weights.iter().sum();
    if sum == 0.0 || !sum.is_finite() {
        return ([1.0, 0.0, 0.0], 1.0 / screen[0][2]);
    }
    let weights = weights.map(|w| (w / sum).clamp(0.0, 1.0));
    let depth: f64 = (0..3).map(|k| weights[k] / screen[k][2]).sum();
    (weights, depth)
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

/// Balls at the cones and bars along the cut, sized for the picture.
fn marks(atlas: &AffineAtlas, camera: &Camera, side: f64) -> Marks {
    let positions = &atlas.mesh.positions;
    let connectivity = &atlas.mesh.connectivity;
    let mut marks = Marks::default();
    // Source units that a share of the picture's side has at a point's depth.
    let length = |share: f64, p: Vec3| {
        share * side / (camera.zoom * camera.project(p)[2]).max(f64::MIN_POSITIVE)
    };
    let cut = to_linear(CUT);
    for e in connectivity.edges() {
        if atlas.cut.is_cut.as_slice().get(e.index()) == Some(&true) {
            let [a, b] = connectivity.edge_vertices(e).map(|v| positions[v]);
            let radius = length(0.0026, a);
            marks.bar(a, b, radius, cut);
            marks.sphere(a, radius, cut, 3);
            marks.sphere(b, radius, cut, 3);
        }
    }
    for cone in &atlas.prescription.cones {
        let p = positions[cone.vertex];
        let colour = if cone.curvature > 0.0 {
            POSITIVE
        } else {
            NEGATIVE
        };
        marks.sphere(p, length(0.0125, p), to_linear(colour), 14);
    }
    marks
}

/// What the marks mean, in the lower left corner; left out of small pictures.
fn legend(image: &mut RgbImage, atlas: &AffineAtlas) {
    let side = image.height() as usize;
    if side < 480 {
        return;
    }
    let mut entries: Vec<([u8; 3], String)> = Vec::new();
    let count = |positive: bool| {
        let cones = atlas.prescription.cones.iter();
        cones.filter(|c| (c.curvature > 0.0) == positive).count()
    };
    for (positive, colour, sign) in [(true, POSITIVE, '+'), (false, NEGATIVE, '-')] {
        let n = count(positive);
        if n > 0 {
            let plural = if n == 1 { "" } else { "s" };
            entries.push((colour, format!("{n} cone{plural} ({sign})")));
        }
    }
    if !atlas.cut.segments.is_empty() {
        entries.push((CUT, "cut".into()));
    }
    let bottom = side - 14 - 22 * entries.len();
    for (k, (colour, words)) in entries.iter().enumerate() {
        let y = (bottom + 22 * k + 11) as f64;
        for dy in -5_i32..=5 {
            for dx in -5_i32..=5 {
                if dx * dx + dy * dy <= 27 {
                    let (x, y) = ((21 + dx) as u32, (y as i32 + dy) as u32);
                    image.put_pixel(x, y, Rgb(*colour));
                }
            }
        }
        text::write(image, words, [34.0, y], Anchor::Start, INK);
    }
}

/// A vertical bar of colours with numbers, at the right.
fn colour_bar(image: &mut RgbImage, middle: f64, reach: f64) {
    let side = image.height() as usize;
    if side < 320 {
        return;
    }
    let (top, bottom) = (side / 4, 3 * side / 4);
    let left = side - 22;
    for y in top..bottom {
        let t = 1.0 - 2.0 * (y - top) as f64 / (bottom - top) as f64;
        for x in left..left + 10 {
            image.put_pixel(x as u32, y as u32, Rgb(diverging(t)));
        }
    }
    for t in [-1.0, 0.0, 1.0] {
        let y = 0.5 * ((top + bottom) as f64 - t * (bottom - top) as f64);
        let words = format!("{:+.2}", middle + t * reach);
        text::write(image, &words, [left as f64 - 6.0, y], Anchor::End, INK);
    }
    let at = [side as f64 - 12.0, top as f64 - 18.0];
    text::write(image, "log scale u", at, Anchor::End, INK);
}
