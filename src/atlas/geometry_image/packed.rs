//! One image of all patches: every patch's own image, texel for texel, at its place in the packed square.
//!
//! *Enters:* the images of a layout, and their places. *Leaves:* one [`GeometryImage`]. The mask says where a patch is (occupancy).
//! *Guaranteed:* inside the box of an image all channels are that image's, bit for bit; in between they are those of the nearest
//! texel of any image, with mask 0.

use super::dilation::nearest_sources;
use super::image::{GeometryImage, Sampled, Values};
use crate::atlas::patch::PackedPlaces;
use crate::geometry::ids::NONE;

/// Puts the images of all patches into one; all must hold the same attributes, and lie inside the square.
#[must_use]
pub fn pack_images(images: &[GeometryImage], places: &PackedPlaces) -> GeometryImage {
    let side = places.side;
    let count = side * side;
    let first = images.first();
    let mut packed = GeometryImage {
        width: side,
        height: side,
        position: vec![[0.0; 3]; count],
        alpha: vec![0.0; count],
        normal: vec![[0.0, 0.0, 1.0]; count],
        face: vec![NONE; count],
        log_scale: vec![0.0; count],
        attributes: first.map_or_else(Vec::new, |image| {
            image.attributes.iter().map(|a| empty(a, count)).collect()
        }),
    };
    let mut filled = vec![false; count];
    for (image, &[left, top]) in images.iter().zip(&places.corners) {
        for row in 0..image.height {
            let (from, to) = (image.width * row, side * (top + row) + left);
            packed.take_row(image, from, to, image.width);
            filled[to..to + image.width].fill(true);
        }
    }
    // What lies between the images is like what is next to it, so that filters find no hole.
    let nearest = nearest_sources(&filled, side);
    let all = packed.clone();
    for (at, &from) in nearest.iter().enumerate().filter(|(at, from)| at != *from) {
        packed.take_row(&all, from, at, 1);
        packed.alpha[at] = 0.0;
    }
    packed
}

/// Room for an attribute of so many texels.
fn empty(like: &Sampled, texels: usize) -> Sampled {
    let values = match &like.values {
        Values::Numbers { components, .. } => Values::Numbers {
            components: *components,
            values: vec![0.0; texels * components],
        },
        Values::Ids(_) => Values::Ids(vec![NONE; texels]),
    };
    Sampled {
        channel: like.channel,
        values,
    }
}

impl GeometryImage {
    /// Takes `count` texels in a row from another image, all channels.
    fn take_row(&mut self, other: &Self, from: usize, to: usize, count: usize) {
        let (from, to) = (from..from + count, to..to + count);
        self.position[to.clone()].copy_from_slice(&other.position[from.clone()]);
        self.alpha[to.clone()].copy_from_slice(&other.alpha[from.clone()]);
        self.normal[to.clone()].copy_from_slice(&other.normal[from.clone()]);
        self.face[to.clone()].copy_from_slice(&other.face[from.clone()]);
        self.log_scale[to.clone()].copy_from_slice(&other.log_scale[from.clone()]);
        for (own, theirs) in self.attributes.iter_mut().zip(&other.attributes) {
            match (&mut own.values, &theirs.values) {
                (
                    Values::Numbers { components, values },
                    Values::Numbers { values: others, .. },
                ) => {
                    let n = *components;
                    values[n * to.start..n * to.end]
                        .copy_from_slice(&others[n * from.start..n * from.end]);
                }
                (Values::Ids(ids), Values::Ids(others)) => {
                    ids[to.clone()].copy_from_slice(&others[from.clone()]);
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::geometry_image::Channel;

    fn image(width: usize, height: usize, value: f32) -> GeometryImage {
        let count = width * height;
        let number = |at: usize| value + at as f32;
        GeometryImage {
            width,
            height,
            position: (0..count).map(|at| [number(at); 3]).collect(),
            alpha: (0..count).map(|at| (at % 2) as f32).collect(),
            normal: vec![[1.0, 0.0, 0.0]; count],
            face: (0..count).map(|at| number(at) as u32).collect(),
            log_scale: (0..count).map(number).collect(),
            attributes: vec![
                Sampled {
                    channel: Channel::Texcoord,
                    values: Values::Numbers {
                        components: 2,
                        values: (0..count).flat_map(|at| [number(at), 0.5]).collect(),
                    },
                },
                Sampled {
                    channel: Channel::Material,
                    values: Values::Ids((0..count).map(|at| number(at) as u32).collect()),
                },
            ],
        }
    }

    #[test]
    fn images_keep_their_texels_and_the_rest_is_that_of_the_nearest() {
        let images = [image(4, 2, 10.0), image(2, 3, 50.0)];
        let places = PackedPlaces {
            side: 8,
            corners: vec![[1, 1], [6, 5]],
        };
        let packed = pack_images(&images, &places);
        let mut inside = vec![None; 64];
        for (image, [left, top]) in images.iter().zip(&places.corners) {
            for at in 0..image.face.len() {
                let (x, y) = (left + at % image.width, top + at / image.width);
                inside[8 * y + x] = Some((image, at));
            }
        }
        let number = |at: usize| packed.position[at][0];
        for at in 0..64 {
            // Every channel tells the same story.
            assert_eq!(packed.face[at], number(at) as u32);
            assert_eq!(packed.log_scale[at], number(at));
            assert_eq!(packed.normal[at], [1.0, 0.0, 0.0]);
            let Values::Numbers { values, .. } = &packed.attributes[0].values else {
                panic!("numbers");
            };
            assert_eq!(values[2 * at..2 * at + 2], [number(at), 0.5]);
            let Values::Ids(ids) = &packed.attributes[1].values else {
                panic!("ids");
            };
            assert_eq!(ids[at], packed.face[at]);
            match inside[at] {
                Some((image, own)) => {
                    assert_eq!(packed.position[at], image.position[own]);
                    assert_eq!(packed.alpha[at], image.alpha[own]);
                }
                None => {
                    assert_eq!(packed.alpha[at], 0.0);
                    let squared = |other: usize| {
                        let (x, y) = ((other % 8).abs_diff(at % 8), (other / 8).abs_diff(at / 8));
                        x * x + y * y
                    };
                    let boxes = (0..64).filter(|&i| inside[i].is_some());
                    let nearest = boxes.clone().map(squared).min().unwrap();
                    let mut sources = boxes.filter(|&i| squared(i) == nearest);
                    assert!(sources.any(|i| number(i) == number(at)), "{at}");
                }
            }
        }
        let none = PackedPlaces {
            side: 3,
            corners: Vec::new(),
        };
        assert_eq!(pack_images(&[], &none).alpha, [0.0; 9]);
    }
}
