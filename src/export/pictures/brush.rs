//! The brush that fills rows of pixels by what their samples see.
//!
//! Pixels of one face share what depends on the face only ([`Aspect`]). Where such pixels follow each other in a row, light and weights are
//! worked out for the first and the last of a few and go evenly from the one to the other.

use super::aspect::{Aspect, Spot};
use super::colour::{Linear, mix, to_bytes};
use super::raster::{Band, NOTHING, SAMPLES, place};
use super::studio::{BAND, Mark, Studio};
use image::RgbImage;
use rayon::prelude::*;

/// Columns of which light and weights are worked out for the ends only.
const STRETCH: usize = 8;

/// Tint of the back of the surface.
const INSIDE: Linear = [0.55, 0.40, 0.30];

/// What the surface looks like without light, in each of `N` pictures.
pub trait Paint<const N: usize>: Sync {
    /// What all spots of a face share.
    type OfFace;

    fn of_face(&self, face: usize) -> Self::OfFace;

    /// Of a spot of that face.
    fn colours(&self, of_face: &mut Self::OfFace, spot: &Spot) -> [Linear; N];
}

/// What fills the rows of a band, one after the other.
pub struct Brush<'a, const N: usize, P: Paint<N>> {
    studio: &'a Studio,
    bars: &'a [Mark],
    paint: &'a P,
    /// The face that was painted last.
    last: Option<(Aspect, P::OfFace)>,
}

/// A surface in some light.
#[derive(Clone, Copy)]
struct Lit {
    spot: Spot,
    diffuse: Linear,
    gloss: f32,
}

impl Lit {
    /// What lies at this share of the way to another.
    fn towards(&self, other: &Lit, share: f64) -> Lit {
        let between = |i: usize| {
            let (from, to) = (self.spot.weights[i], other.spot.weights[i]);
            from + share * (to - from)
        };
        Lit {
            spot: Spot {
                weights: [between(0), between(1), between(2)],
                ..self.spot
            },
            diffuse: mix(self.diffuse, other.diffuse, share as f32),
            gloss: self.gloss + share as f32 * (other.gloss - self.gloss),
        }
    }
}

fn shade(albedo: Linear, diffuse: Linear, gloss: f32) -> Linear {
    let shade = |i: usize| albedo[i] * diffuse[i] + gloss;
    [shade(0), shade(1), shade(2)]
}

impl<'a, const N: usize, P: Paint<N>> Brush<'a, N, P> {
    /// For a studio with marks, numbered after its faces.
    pub fn new(studio: &'a Studio, bars: &'a [Mark], paint: &'a P) -> Self {
        Brush {
            studio,
            bars,
            paint,
            last: None,
        }
    }

    /// Fills a row of each picture; `seen` has the objects of its samples, row by row.
    pub fn row(&mut self, row: usize, seen: &[u32], mut lines: [&mut [u8]; N]) {
        let size = self.studio.size;
        let [a, b, c, d] = [0, 1, 2, 3].map(|s: usize| &seen[s * size..][..size]);
        let faces = self.studio.faces().len() as u32;
        let background = self.studio.light.row(row);
        let mut set = |column: usize, colours: [[u8; 3]; N]| {
            for (line, colour) in lines.iter_mut().zip(colours) {
                line[3 * column..3 * column + 3].copy_from_slice(&colour);
            }
        };
        let mut column = 0;
        while column < size {
            let object = a[column];
            let is_whole =
                |k: usize| a[k] == object && b[k] == object && c[k] == object && d[k] == object;
            if !is_whole(column) {
                let samples = [a[column], b[column], c[column], d[column]];
                set(column, self.pixel((column, row), samples));
                column += 1;
            } else if object == NOTHING {
                set(column, [background.colour(column); N]);
                column += 1;
            } else if object >= faces {
                let colours = self.object(object, [column as f64 + 0.5, row as f64 + 0.5]);
                set(column, colours.map(to_bytes));
                column += 1;
            } else {
                let most = ((column / STRETCH + 1) * STRETCH).min(size);
                let end = (column + 1..most).find(|&k| !is_whole(k)).unwrap_or(most);
                self.stretch(object, row, (column, end), &mut set);
                column = end;
            }
        }
    }

    /// Colours of pixels of a row that all show one face.
    fn stretch(
        &mut self,
        face: u32,
        row: usize,
        (start, end): (usize, usize),
        set: &mut impl FnMut(usize, [[u8; 3]; N]),
    ) {
        let (studio, paint) = (self.studio, self.paint);
        let (aspect, of_face) = self.of_face(face);
        let at = |column: usize| lit(studio, aspect, [column as f64 + 0.5, row as f64 + 0.5]);
        let first = at(start);
        let last = match end - start {
            1 => first,
            _ => at(end - 1),
        };
        let step = 1.0 / (end - 1 - start).max(1) as f64;
        for column in start..end {
            let here = first.towards(&last, step * (column - start) as f64);
            let mut colours = [[0; 3]; N];
            let painted = paint.colours(of_face, &here.spot);
            for (bytes, albedo) in colours.iter_mut().zip(painted) {
                *bytes = to_bytes(colour_of(albedo, &here, aspect.is_behind));
            }
            set(column, colours);
        }
    }

    /// Colour of a pixel whose samples see different objects, in each picture.
    fn pixel(&mut self, (column, row): (usize, usize), objects: [u32; SAMPLES]) -> [[u8; 3]; N] {
        let mut sums = [[0.0_f32; 3]; N];
        for (k, &object) in objects.iter().enumerate() {
            if objects[..k].contains(&object) {
                continue;
            }
            let (mut count, mut at) = (0.0, [0.0; 2]);
            for s in (0..SAMPLES).filter(|&s| objects[s] == object) {
                let p = place(column, SAMPLES * row + s);
                count += 1.0;
                at = [at[0] + p[0], at[1] + p[1]];
            }
            let colours = self.object(object, [at[0] / count, at[1] / count]);
            for (sum, colour) in sums.iter_mut().zip(colours) {
                // Clamped before the mean, or highlights would have ragged edges.
                let share = count as f32 / SAMPLES as f32;
                for (sum, light) in sum.iter_mut().zip(colour) {
                    *sum += share * light.clamp(0.0, 1.0);
                }
            }
        }
        sums.map(to_bytes)
    }

    /// Colour of an object at a place of the picture, in each picture.
    fn object(&mut self, object: u32, at: [f64; 2]) -> [Linear; N] {
        let (studio, paint) = (self.studio, self.paint);
        if object == NOTHING {
            return [studio.light.background(at); N];
        }
        if let Some(mark) = (object as usize).checked_sub(studio.faces().len()) {
            let normal = studio.bar_normal(&self.bars[mark], at);
            let (diffuse, gloss) = studio.light.on(normal, at, 1.0, 0.22);
            return [shade(self.bars[mark].colour, diffuse, gloss); N];
        }
        let (aspect, of_face) = self.of_face(object);
        let here = lit(studio, aspect, at);
        let mut colours = paint.colours(of_face, &here.spot);
        for colour in &mut colours {
            *colour = colour_of(*colour, &here, aspect.is_behind);
        }
        colours
    }

    /// What all pixels of a face share.
    fn of_face(&mut self, face: u32) -> &mut (Aspect, P::OfFace) {
        let fresh = || (self.studio.aspect(face), self.paint.of_face(face as usize));
        match &mut self.last {
            Some(last) if last.0.face == face => {}
            last => *last = Some(fresh()),
        }
        self.last.get_or_insert_with(fresh)
    }
}

impl Studio {
    /// The pictures of the surface in a paint, with marks on it.
    pub fn draw<const N: usize>(&self, marks: &[Mark], paint: &impl Paint<N>) -> [RgbImage; N] {
        let (size, count) = (self.size, self.faces().len() as u32);
        // On the screen, with the radius in pixels.
        let on_screen = |mark: &Mark| Mark {
            ends: mark.ends.map(|p| self.camera.project(p)),
            radius: mark.radius * size as f64,
            ..*mark
        };
        let bars: Vec<Mark> = marks.iter().map(on_screen).collect();
        let draw_band = |(b, mut pictures): (usize, [&mut [u8]; N])| {
            let rows = b * BAND..((b + 1) * BAND).min(size);
            let mut band = Band::new(size, rows.start * SAMPLES..rows.end * SAMPLES);
            for &face in &self.in_band[b] {
                band.draw(&self.on_screen(face), face);
            }
            for (object, bar) in (count..).zip(&bars) {
                band.draw_bar(bar.ends, bar.radius, 1.0 / self.camera.zoom, object);
            }
            let mut brush = Brush::new(self, &bars, paint);
            for (k, row) in rows.enumerate() {
                let seen = &band.objects()[k * SAMPLES * size..][..SAMPLES * size];
                let line = 3 * k * size..3 * (k + 1) * size;
                let lines = pictures
                    .each_mut()
                    .map(|picture| &mut picture[line.clone()]);
                brush.row(row, seen, lines);
            }
        };
        let mut bytes: [Vec<u8>; N] = std::array::from_fn(|_| vec![0; 3 * size * size]);
        let mut parts = bytes.each_mut().map(|b| b.chunks_mut(3 * size * BAND));
        let bands: Vec<[&mut [u8]; N]> = (self.in_band.iter())
            .map(|_| parts.each_mut().map(|part| part.next().unwrap_or_default()))
            .collect();
        bands.into_par_iter().enumerate().for_each(draw_band);
        let side = size as u32;
        bytes.map(|bytes| RgbImage::from_raw(side, side, bytes).unwrap_or_default())
    }
}

/// A place of the picture that shows a face, in its light.
fn lit(studio: &Studio, aspect: &Aspect, at: [f64; 2]) -> Lit {
    let (spot, normal) = (aspect.spot(at), aspect.normal(at));
    let open = (studio.ambient).at(at, || (studio.position(&spot), normal));
    let (diffuse, gloss) = studio.light.on(normal, at, open, 0.10);
    Lit {
        spot,
        diffuse,
        gloss,
    }
}

fn colour_of(albedo: Linear, lit: &Lit, is_behind: bool) -> Linear {
    match is_behind {
        true => shade(mix(albedo, INSIDE, 0.35), lit.diffuse, lit.gloss).map(|c| 0.75 * c),
        false => shade(albedo, lit.diffuse, lit.gloss),
    }
}
