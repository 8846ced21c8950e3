//! The picture of an asset of several components: all of them in space, each with its own checkerboard.

use super::aspect::Spot;
use super::brush::Paint;
use super::checkerboard::{Checkerboard, FaceBoard};
use super::colour::Linear;
use super::studio::{Shape, Studio};
use crate::product::AffineAtlas;
use image::RgbImage;

/// The components so far.
#[derive(Default)]
pub struct Scene {
    shape: Shape,
    /// Of every face: its corners in cells of the checkerboard.
    cells: Vec<[[f64; 2]; 3]>,
}

/// What such a picture shows of one component.
pub struct Exhibit(Scene);

impl Exhibit {
    /// A surface with its checkerboard.
    pub fn of(atlas: &AffineAtlas) -> Self {
        let board = Checkerboard::new(atlas);
        let faces = atlas.mesh.connectivity.faces();
        Self(Scene {
            shape: Shape::of(&atlas.mesh),
            cells: faces.map(|f| board.in_cells(f)).collect(),
        })
    }
}

impl Scene {
    /// Puts a component into the scene.
    pub fn add(&mut self, Exhibit(Scene { shape, cells }): Exhibit) {
        let first = self.shape.positions.len() as u32;
        self.shape.positions.extend(shape.positions);
        let moved = shape.faces.iter().map(|f| f.map(|v| first + v));
        self.shape.faces.extend(moved);
        self.shape.normals.extend(shape.normals);
        self.cells.extend(cells);
    }

    /// The picture, `size` × `size` pixels.
    pub fn draw(self, size: usize) -> RgbImage {
        let studio = Studio::views(self.shape, size, false).swap_remove(0);
        let [picture] = studio.draw(&[], &Boards(&self.cells));
        picture
    }
}

struct Boards<'a>(&'a [[[f64; 2]; 3]]);

impl Paint<1> for Boards<'_> {
    type OfFace = FaceBoard;

    fn of_face(&self, face: usize) -> FaceBoard {
        FaceBoard::of_cells(self.0[face])
    }

    fn colours(&self, board: &mut FaceBoard, spot: &Spot) -> [Linear; 1] {
        [board.plain(spot)]
    }
}
