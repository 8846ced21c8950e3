//! Pictures, rendered by the program itself: no display, no font file, the same bytes for any number of threads.
//!
//! *Enters:* an [`AffineAtlas`], or several metrics on one mesh. *Leaves:* images in memory.
//!
//! * [`surface()`]: the surface in space with a checkerboard in flat coordinates, cones and cut; and coloured by the log scale.
//! * [`Scene`]: all components of an asset.
//! * [`painted`]: any surface in space in colours of its own.
//! * [`layout()`]: the central chart and the packed patches in the plane.
//! * [`convergence()`]: curvature error against flow time (Fig. 7 of the tutorial).
//! * [`Gallery`]: log scales of several metrics on one surface, side by side.
//! * [`encode_png`]: an image as the bytes of a PNG file.
//!
//! `view` looks for a direction that shows much of the surface (of a coarse `proxy`), `raster` finds what each sample of each pixel sees, `studio`
//! paints it, and `light` and `ambient` light it.
//!
//! Not guaranteed: equal bytes on different platforms (sines and powers differ in the last bit).

mod ambient;
mod aspect;
mod brush;
mod canvas;
pub(crate) mod checkerboard;
pub(crate) mod colour;
pub(crate) mod convergence;
mod floor;
mod gallery;
mod layout;
mod light;
mod normals;
mod proxy;
mod raster;
pub(crate) mod scale;
mod studio;
mod surface;
mod text;
mod view;
mod whole;

pub use canvas::SIDE_RANGE;
pub use convergence::convergence;
pub use gallery::{Gallery, Panel};
pub use layout::layout;
pub use surface::{painted, surface};
pub use whole::{Exhibit, Scene};

use crate::export::ExportError;
use crate::export::folder::Staging;
use crate::export::names;
use crate::product::AffineAtlas;
use image::{ImageBuffer, ImageEncoder, PixelWithColorType, RgbImage};

/// Draws all pictures of an atlas into a staging folder; `subfolder` as for
/// [`write_component`](crate::export::write_component).
pub fn write(
    staging: &Staging,
    subfolder: &str,
    atlas: &AffineAtlas,
    size: usize,
) -> Result<(), ExportError> {
    let [preview, log_scale] = surface(atlas, size);
    let pictures = [
        (names::PREVIEW, preview),
        ("layout.png", layout(atlas, size)),
        ("log-scale.png", log_scale),
        ("convergence.png", convergence(atlas, size)),
    ];
    for (name, picture) in pictures {
        let path = match subfolder {
            "" => name.to_owned(),
            _ => format!("{subfolder}/{name}"),
        };
        put(staging, &path, &picture)?;
    }
    Ok(())
}

/// Draws the picture of an asset of several components.
pub fn write_whole(staging: &Staging, scene: Scene, size: usize) -> Result<(), ExportError> {
    put(staging, names::PREVIEW, &scene.draw(size))
}

fn put(staging: &Staging, path: &str, picture: &RgbImage) -> Result<(), ExportError> {
    let bytes = encode_png(picture).map_err(|error| ExportError::Encode {
        path: staging.target().join(path),
        message: error.to_string(),
    })?;
    staging.write(path, &bytes)
}

/// An image as a PNG file in memory.
pub fn encode_png<P>(image: &ImageBuffer<P, Vec<u8>>) -> Result<Vec<u8>, image::ImageError>
where
    P: image::Pixel<Subpixel = u8> + PixelWithColorType,
{
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Paeth)
        .write_image(image.as_raw(), image.width(), image.height(), P::COLOR_TYPE)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
