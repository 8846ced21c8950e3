//! From a studio and colours to pixels.

use super::colour::{Linear, mix, to_bytes};
use super::light::Shade;
use super::raster::{Band, NOTHING};
use super::studio::{BAND, Props, SAMPLES, Studio};
use super::view::{Vec3, along, unit};
use crate::geometry::mesh::{cross, dot, sub};
use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// What a point of a face looks like without light: face, barycentric weights, and size of a pixel there in source units.
pub(super) type Colour<'a> = dyn Fn(usize, [f64; 3], f64) -> Linear + Sync + 'a;

/// What a sample sees, and its column and row.
type Sample = (u32, [f64; 2]);

/// How often the colour must be asked for.
pub(super) enum Paint<'a> {
    /// Without edges: once a pixel and face.
    Smooth(&'a Colour<'a>),
    /// At every sample of a pixel where an edge goes through it.
    Edged(&'a Colour<'a>),
}

impl Studio<'_> {
    /// The picture of the surface in the paint given, with marks on it.
    pub fn draw(&self, props: &Props, paint: &Paint) -> RgbImage {
        let size = self.size;
        // What no sample sees hides nothing, and is left out.
        let pixels: Vec<[u8; 3]> = (0..self.seen.len())
            .into_par_iter()
            .flat_map_iter(|b| self.draw_band(b, props, paint))
            .collect();
        RgbImage::from_fn(size as u32, size as u32, |x, y| {
            Rgb(pixels[y as usize * size + x as usize])
        })
    }

    /// What the samples of a band see: faces of the surface and, numbered after those, of the marks.
    fn raster(&self, b: usize, props: &Props) -> Band {
        let mut band = self.band(b * BAND);
        for &face in &self.seen[b] {
            band.draw(&self.on_screen(face as usize), face);
        }
        for &mark in &props.members[b] {
            let face = props.marks.faces[mark as usize];
            let screen = face.map(|v| props.screen[v as usize]);
            band.draw(&screen, self.faces.len() as u32 + mark);
        }
        band
    }

    fn draw_band(&self, b: usize, props: &Props, paint: &Paint) -> Vec<[u8; 3]> {
        let (size, top) = (self.size, b * BAND);
        let rows = BAND.min(size - top);
        let band = self.raster(b, props);
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
                pixels.push(self.pixel(&mut seen, props, paint));
            }
        }
        pixels
    }

    /// Colour of a pixel by what its samples see and where they are.
    ///
    /// Light is smooth inside a pixel, so one look at the middle of an object's samples does for all of
    /// them; only the paint may have edges.
    fn pixel(&self, seen: &mut [Sample], props: &Props, paint: &Paint) -> [u8; 3] {
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
                match (object as usize).checked_sub(self.faces.len()) {
                    None => self.shaded(middle, of_one, object as usize, paint),
                    Some(mark) => self.mark(middle, mark, props),
                }
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

    /// The middle of the samples of one face.
    fn shaded(&self, at: [f64; 2], samples: &[Sample], face: usize, paint: &Paint) -> Linear {
        let screen = self.on_screen(face);
        let (weights, depth) = weights(&screen, at);
        let toward_eye = unit(self.camera.sight(at).map(|x| -x));
        let vertices = self.faces[face];
        let [a, b, c] = vertices.map(|v| self.positions[v as usize]);
        let behind = dot(cross(sub(b, a), sub(c, a)), toward_eye) < 0.0;
        let corners = &self.normals[self.normals_of[face] as usize];
        let mut normal = blend(weights, |k| corners[k]);
        if behind {
            normal = normal.map(|x| -x);
        }
        let footprint = depth * SAMPLES as f64 / self.camera.zoom;
        let grazing = dot(normal, toward_eye).abs().max(0.05);
        let footprint = footprint / grazing;
        let mut albedo = self.painted(&screen, (&weights, samples), face, footprint, paint);
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
        let shade = mean(weights, shades, vertices);
        self.lit(albedo, normal, toward_eye, shade, 0.10)
    }

    /// The middle of the samples of one triangle of a mark.
    fn mark(&self, at: [f64; 2], mark: usize, props: &Props) -> Linear {
        let face = props.marks.faces[mark];
        let (weights, _) = weights(&face.map(|v| props.screen[v as usize]), at);
        let toward_eye = unit(self.camera.sight(at).map(|x| -x));
        let normal = blend(weights, |k| props.marks.normals[face[k] as usize]);
        let shade = mean(weights, &props.shade, face);
        // Marks stay readable in the shade.
        let shade = Shade {
            sky: 0.5 + 0.5 * shade.sky,
            lamp: 0.25 + 0.75 * shade.lamp,
        };
        self.lit(props.marks.colours[mark], normal, toward_eye, shade, 0.22)
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

/// Unit vector between those of three corners.
fn blend(weights: [f64; 3], of: impl Fn(usize) -> Vec3) -> Vec3 {
    unit(std::array::from_fn(|i| {
        (0..3).map(|k| weights[k] * of(k)[i]).sum()
    }))
}

/// Light between that of three corners.
fn mean(weights: [f64; 3], shade: &[Shade], corners: [u32; 3]) -> Shade {
    let sum = |part: &dyn Fn(&Shade) -> f32| -> f32 {
        (0..3)
            .map(|k| weights[k] as f32 * part(&shade[corners[k] as usize]))
            .sum()
    };
    Shade {
        sky: sum(&|s| s.sky),
        lamp: sum(&|s| s.lamp),
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
