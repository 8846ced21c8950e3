//! Light on a surface and the studio around it: sky and ground, a lamp, a fill light, a soft gloss; a pale background whose floor takes the shadow.

use super::colour::{Linear, mix, to_bytes};
use super::floor::Floor;
use super::view::{Camera, Vec3};
use crate::geometry::mesh::dot;

/// Pixels between the places where the background is worked out.
const STEP: usize = 8;

/// What lights a scene that a camera looks at.
pub struct Light {
    camera: Camera,
    lamp: Vec3,
    fill: Vec3,
    /// Colours of the background at every [`STEP`]th pixel of every such row.
    background: Vec<Linear>,
    /// Of these a row.
    columns: usize,
}

impl Light {
    /// Of a picture of `size` × `size` pixels.
    pub fn new(camera: Camera, floor: &Floor, size: usize) -> Light {
        let [lamp, fill] = [[-0.55, 0.75, 0.55], [0.8, 0.15, 0.5]].map(|d| camera.oriented(d));
        let columns = size / STEP + 3;
        let place = |k: usize| (k * STEP) as f64;
        let at = |k: usize| [place(k % columns), place(k / columns)];
        let background = (0..columns * columns)
            .map(|k| background(&camera, floor, size, at(k)))
            .collect();
        Light {
            camera,
            lamp,
            fill,
            background,
            columns,
        }
    }

    /// Light on a place of the picture with this unit normal, of which this share is not hidden from it: what a matt surface sends back, and
    /// its gloss.
    pub fn on(&self, normal: Vec3, at: [f64; 2], open: f32, gloss: f32) -> (Linear, f32) {
        let sight = self.camera.sight(at);
        let to_eye = -1.0 / dot(sight, sight).sqrt();
        let toward_eye = to_eye * dot(normal, sight);
        let toward_lamp = dot(normal, self.lamp);
        let upward = 0.5 + 0.5 * normal[1] as f32;
        let sky = mix([0.35, 0.33, 0.31], [0.52, 0.55, 0.60], upward);
        let lamp = toward_lamp.max(0.0) as f32 * open;
        let fill = dot(normal, self.fill).max(0.0) as f32 * open;
        // Halfway between lamp and eye.
        let length2 = 2.0 + 2.0 * to_eye * dot(self.lamp, sight);
        let facing = (toward_lamp + toward_eye).max(0.0);
        let halfway2 = (facing * facing / length2.max(f64::MIN_POSITIVE)) as f32;
        let shine = halfway2.powi(14);
        let edge = 1.0 - toward_eye.max(0.0) as f32;
        let rim = (edge * edge) * (edge * edge);
        let diffuse = [
            sky[0] * open + 0.62 * lamp + 0.17 * fill,
            sky[1] * open + 0.585 * lamp + 0.185 * fill,
            sky[2] * open + 0.53 * lamp + 0.21 * fill,
        ];
        (diffuse, (gloss * shine + 0.05 * rim) * open)
    }

    /// The background at a place of the picture, between the nearest that were worked out.
    pub fn background(&self, at: [f64; 2]) -> Linear {
        let (x, y) = (at[0] as f32 / STEP as f32, at[1] as f32 / STEP as f32);
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = (x - column as f32, y - row as f32);
        let first = row * self.columns + column;
        let across = |k: usize| mix(self.background[k], self.background[k + 1], fx);
        mix(across(first), across(first + self.columns), fy)
    }

    /// The background of a row of pixels.
    pub fn row(&self, row: usize) -> Row {
        let y = row as f64 + 0.5;
        let at = |k: usize| self.background([(k * STEP) as f64, y]);
        Row {
            colours: (0..self.columns - 1).map(at).collect(),
        }
    }
}

/// The background of a row of pixels, at every [`STEP`]th.
pub struct Row {
    colours: Vec<Linear>,
}

impl Row {
    /// That of a pixel.
    pub fn colour(&self, column: usize) -> [u8; 3] {
        let (k, within) = (column / STEP, column % STEP);
        let share = (within as f32 + 0.5) / STEP as f32;
        to_bytes(mix(self.colours[k], self.colours[k + 1], share))
    }
}

/// A pale studio whose floor takes the shadow.
fn background(camera: &Camera, floor: &Floor, size: usize, at: [f64; 2]) -> Linear {
    let half = 0.5 * size as f64;
    let [x, y] = [(at[0] - half) / half, (at[1] - 0.9 * half) / half];
    let far = ((x * x + y * y) / (1.45 * 1.45)).min(1.0) as f32;
    let studio = mix([0.93, 0.935, 0.94], [0.76, 0.78, 0.81], far);
    let shadow = floor.shadow(camera.eye, camera.sight(at));
    studio.map(|c| c * (1.0 - 0.55 * shadow))
}
