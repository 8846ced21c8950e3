//! Geometry images: `images/PPPP.exr` as the output format (`docs/format.md`) has them.
//!
//! *Guaranteed:* whatever the file holds nothing panics, and memory is bounded by the size that the caller states
//! and the bytes of the file.

use super::bounded::read_bounded;
use ::exr::prelude as openexr;
use ::exr::prelude::{Compression, FlatSamples, MetaData, ReadChannels, ReadLayers};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Largest image file that is read (bytes).
const SIZE_LIMIT: u64 = 1 << 32;

/// Bytes of channels that a file of so many may claim: no lossless compression of the format makes data smaller than by
/// 1100, and what is large and not plain is not made smaller than by 64.
fn claimable(bytes: u64) -> u64 {
    let any = bytes.saturating_mul(1100);
    any.min(bytes.saturating_mul(64).saturating_add(512 << 20))
}

/// The channels of an image.
pub(crate) struct Image {
    pub rgb: [Vec<f32>; 3],
    pub alpha: Vec<f32>,
    pub normal: Option<[Vec<f32>; 3]>,
    pub face: Option<Vec<u32>>,
    pub log_scale: Option<Vec<f32>>,
    /// Whether `normal` has 16 bits.
    pub half_normals: bool,
    /// All other channels, by name.
    pub others: BTreeMap<String, FlatSamples>,
    pub text: Option<String>,
}

/// What is in an image file.
pub(crate) enum Read {
    /// Columns and rows are not those that were stated, but these.
    WrongSize([usize; 2]),
    /// An image of the size that was stated.
    Image {
        image: Box<Image>,
        /// What of its layout is not as the format has it.
        layout: Option<String>,
    },
}

/// Reads an image of the size (columns, rows) that is stated elsewhere.
pub(crate) fn read(path: &Path, size: [usize; 2]) -> Result<Read, String> {
    let bytes = read_bounded(path, SIZE_LIMIT).map_err(|error| error.to_string())?;
    // The decoder is not ours: should it panic on hostile bytes, that is an unreadable image.
    let decoded = std::panic::catch_unwind(|| decode(&bytes, size));
    decoded.unwrap_or_else(|_| Err("cannot be decoded".to_owned()))
}

/// Floats of 16 or 32 bits.
pub(crate) fn numbers(samples: FlatSamples) -> Option<Vec<f32>> {
    match samples {
        FlatSamples::F32(values) => Some(values),
        FlatSamples::F16(values) => Some(values.into_iter().map(|x| x.to_f32()).collect()),
        FlatSamples::U32(_) => None,
    }
}

/// The image, and what of its layout is not as the format has it.
fn decode(bytes: &[u8], [width, height]: [usize; 2]) -> Result<Read, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| error.to_string())?;
    let [header] = meta.headers.as_slice() else {
        return Err(format!("has {} parts, not one", meta.headers.len()));
    };
    let size = [header.layer_size.x(), header.layer_size.y()];
    if size != [width, height] {
        return Ok(Read::WrongSize(size));
    }
    let channels = header.channels.list.len() as u64;
    let texels = (width as u64).saturating_mul(height as u64);
    let claimed = texels.saturating_mul(4 * channels);
    let limit = claimable(bytes.len() as u64);
    if claimed > limit {
        return Err(format!(
            "claims {texels} texels of {channels} channels, {claimed} bytes, more than the {limit} that its {} bytes may stand for",
            bytes.len()
        ));
    }
    let lossless = matches!(
        header.compression,
        Compression::ZIP16 | Compression::ZIP1 | Compression::RLE | Compression::Uncompressed
    );
    if header.deep || !lossless {
        return Err(format!("is {}, not ZIP scan lines", header.compression));
    }
    let zip = matches!(header.compression, Compression::ZIP16 | Compression::ZIP1);
    let is_tiled = matches!(header.blocks, ::exr::meta::BlockDescription::Tiles(_));
    let mut layout = None;
    if !zip || is_tiled {
        layout = Some(format!("{} instead of ZIP scan lines", header.compression));
    }
    if header
        .channels
        .list
        .iter()
        .any(|c| c.sampling != openexr::Vec2(1, 1))
    {
        return Err("has subsampled channels".to_owned());
    }
    let decoded = openexr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let text = decoded
        .layer_data
        .attributes
        .other
        .iter()
        .chain(&decoded.attributes.other)
        .find(|(name, _)| **name == *"affineAtlas")
        .and_then(|(_, value)| match value {
            openexr::AttributeValue::Text(text) => Some(text.to_string()),
            _ => None,
        });
    let texels = width * height;
    let list = decoded.layer_data.channel_data.list.into_iter();
    let mut others: BTreeMap<String, FlatSamples> = list
        .filter(|channel| channel.sample_data.len() == texels)
        .map(|channel| (channel.name.to_string(), channel.sample_data))
        .collect();
    let mut floats = |name: &str| match others.remove(name) {
        Some(FlatSamples::F32(values)) => Ok(values),
        Some(_) => Err(format!("channel {name} is not 32-bit float")),
        None => Err(format!("has no channel {name}")),
    };
    let rgb = [floats("R")?, floats("G")?, floats("B")?];
    let alpha = floats("A")?;
    let log_scale = floats("surface.logScale").ok();
    let axes = ["X", "Y", "Z"].map(|axis| format!("normal.{axis}"));
    let is_half = |name: &String| matches!(others.get(name), Some(FlatSamples::F16(_)));
    let half_normals = axes.iter().any(is_half);
    let normal = match axes.map(|name| others.remove(&name).and_then(numbers)) {
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => None,
    };
    let face = match others.remove("surface.face") {
        Some(FlatSamples::U32(values)) => Some(values),
        _ => None,
    };
    let image = Image {
        rgb,
        alpha,
        normal,
        face,
        log_scale,
        half_normals,
        others,
        text,
    };
    let image = Box::new(image);
    Ok(Read::Image { image, layout })
}
