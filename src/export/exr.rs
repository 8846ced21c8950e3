//! `images/PPPP.exr`: one geometry image a patch; `images/packed.exr`: all in one.
//!
//! One part, scan lines, ZIP16, `R G B A` as 32-bit floats: the layout that all common readers
//! take (`X Y Z` names and several parts lose data in some). Further channels, where they are asked for, are
//! `normal.X/Y/Z`, `surface.face` (unsigned integers), `surface.logScale`, and of the source `sourceNormal.X/Y/Z`,
//! `color.R/G/B/A`, `texcoord0.U/V` and `material.id` (unsigned integers). Normals may have 16 bits.
//!
//! The encoder keeps custom attributes in a hash map, whose order changes from run to run: so
//! there is exactly one, the JSON text `affineAtlas`, and the bytes are reproducible.

use crate::atlas::geometry_image::{
    Channel, GeometryImage, ImageParams, Precision, Sampled, Values,
};
use crate::atlas::patches::Domain;
use crate::export::atlas_json::{Document, Packed, Similarity, Units};
use crate::export::{EncodeError, Provenance};
use ::exr::image::write::WritableImage;
use ::exr::meta::attribute::{AttributeValue, LineOrder, Text};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, f16,
};
use serde::{Deserialize, Serialize};
use std::io::{Seek, Write};

/// Name of the custom attribute.
pub const ATTRIBUTE: &str = "affineAtlas";

/// What an image says about itself, so that it can be used without `atlas.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// `"affine-atlas"`.
    pub format: String,
    /// Version of the output format (`docs/format.md`).
    pub version: u32,
    /// Name of the asset.
    pub asset: String,
    /// Component of the asset.
    pub component: usize,
    /// Number of the patch.
    pub patch: usize,
    /// How texels lie in the patch.
    pub domain: Domain,
    /// (column, row, 1) to patch coordinates, row 0 at the top, texel centres at halves.
    pub texel_to_patch: [[f64; 3]; 2],
    /// Patch coordinates to central-chart coordinates.
    pub patch_to_chart: Option<Similarity>,
    /// Added to `R G B` to give source coordinates.
    pub image_origin: [f64; 3],
    /// Units of lengths and angles.
    pub units: Units,
    /// BLAKE3 hash of the input, hexadecimal.
    pub blake3: String,
    /// BLAKE3 hash of the configuration, hexadecimal.
    pub config_blake3: String,
}

/// The label of the image of a patch, which must be one of the document's.
pub fn label(document: &Document, patch: usize, provenance: &Provenance) -> Label {
    let described = &document.patches[patch];
    Label {
        format: document.format.clone(),
        version: document.version,
        asset: provenance.asset.into(),
        component: provenance.component,
        patch,
        domain: described.domain,
        texel_to_patch: described.texel_to_patch,
        patch_to_chart: described.patch_to_chart,
        image_origin: document.image_origin,
        units: document.units.clone(),
        blake3: provenance.blake3.into(),
        config_blake3: provenance.config_blake3.into(),
    }
}

impl Label {
    /// The JSON text in pure ASCII, because the attribute holds bytes of no stated encoding.
    pub fn to_text(&self) -> String {
        to_text(self)
    }
}

/// What the image of all patches says about itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedLabel {
    /// `"affine-atlas"`.
    pub format: String,
    /// Version of the output format (`docs/format.md`).
    pub version: u32,
    /// Name of the asset.
    pub asset: String,
    /// Component of the asset.
    pub component: usize,
    /// Columns and rows, and column and row of the upper left texel of each patch's image.
    pub packed: Packed,
    /// Added to `R G B` to give source coordinates.
    pub image_origin: [f64; 3],
    /// Units of lengths and angles.
    pub units: Units,
    /// BLAKE3 hash of the input, hexadecimal.
    pub blake3: String,
    /// BLAKE3 hash of the configuration, hexadecimal.
    pub config_blake3: String,
}

/// The label of the image of all patches, if the document has one.
pub fn packed_label(document: &Document, provenance: &Provenance) -> Option<PackedLabel> {
    Some(PackedLabel {
        format: document.format.clone(),
        version: document.version,
        asset: provenance.asset.into(),
        component: provenance.component,
        packed: document.images.as_ref()?.packed.clone()?,
        image_origin: document.image_origin,
        units: document.units.clone(),
        blake3: provenance.blake3.into(),
        config_blake3: provenance.config_blake3.into(),
    })
}

impl PackedLabel {
    /// As [`Label::to_text`].
    pub fn to_text(&self) -> String {
        to_text(self)
    }
}

fn to_text<T: Serialize>(label: &T) -> String {
    let json = serde_json::to_string(label)
        .expect("string keys and no custom serialiser, so that serialisation cannot fail");
    ascii(&json)
}

/// JSON text with every character beyond ASCII escaped; such characters occur inside strings only.
fn ascii(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    let mut units = [0u16; 2];
    for c in json.chars() {
        if c.is_ascii() {
            text.push(c);
        } else {
            for unit in c.encode_utf16(&mut units) {
                text.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    text
}

/// Names of a channel's components, where it has several numbers a texel.
fn component_names(channel: Channel) -> &'static [&'static str] {
    match channel {
        Channel::Normal => &["normal.X", "normal.Y", "normal.Z"],
        Channel::SourceNormal => &["sourceNormal.X", "sourceNormal.Y", "sourceNormal.Z"],
        Channel::Color => &["color.R", "color.G", "color.B", "color.A"],
        Channel::Texcoord => &["texcoord0.U", "texcoord0.V"],
        Channel::LogScale => &["surface.logScale"],
        Channel::Face | Channel::Material => &[],
    }
}

/// The channels of an image with their names.
fn channels(
    image: &GeometryImage,
    params: &ImageParams,
) -> Result<Vec<(&'static str, FlatSamples)>, EncodeError> {
    let position = |i: usize| FlatSamples::F32(image.position.iter().map(|p| p[i]).collect());
    let mut list = vec![
        ("R", position(0)),
        ("G", position(1)),
        ("B", position(2)),
        ("A", FlatSamples::F32(image.alpha.clone())),
    ];
    for &channel in &params.channels {
        match channel {
            Channel::Normal => {
                list.extend(numbers(channel, image.normal.as_flattened(), params));
            }
            Channel::LogScale => list.extend(numbers(channel, &image.log_scale, params)),
            Channel::Face => list.push(("surface.face", FlatSamples::U32(image.face.clone()))),
            Channel::SourceNormal | Channel::Color | Channel::Texcoord | Channel::Material => {
                let mut sampled = image.attributes.iter();
                match sampled.find(|sampled| sampled.channel == channel) {
                    Some(Sampled {
                        values: Values::Numbers { values, .. },
                        ..
                    }) => list.extend(numbers(channel, values, params)),
                    Some(Sampled {
                        values: Values::Ids(ids),
                        ..
                    }) => list.push(("material.id", FlatSamples::U32(ids.clone()))),
                    None => {
                        let what = format!("the channel {} was not sampled", channel.name());
                        return Err(EncodeError::Format(what));
                    }
                }
            }
        }
    }
    Ok(list)
}

/// The components of a channel, whose numbers stand texel by texel.
fn numbers(
    channel: Channel,
    values: &[f32],
    params: &ImageParams,
) -> Vec<(&'static str, FlatSamples)> {
    let names = component_names(channel);
    let is_half = params.normal_precision == Precision::Half
        && matches!(channel, Channel::Normal | Channel::SourceNormal);
    let components = names.iter().enumerate().map(|(i, &name)| {
        let component = values.iter().skip(i).step_by(names.len()).copied();
        let samples = match is_half {
            true => FlatSamples::F16(component.map(f16::from_f32).collect()),
            false => FlatSamples::F32(component.collect()),
        };
        (name, samples)
    });
    components.collect()
}

/// Writes an image with the channels that are asked for and the text of its label. Expects all that it has to have `width` × `height` values.
pub fn write<W: Write + Seek>(
    image: &GeometryImage,
    params: &ImageParams,
    label: &str,
    writer: W,
) -> Result<(), EncodeError> {
    check(image)?;
    let list = channels(image, params)?
        .into_iter()
        .map(|(name, samples)| AnyChannel::new(name, samples))
        .collect();
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut attributes = LayerAttributes::default();
    let text = Text::new_or_none(label)
        .ok_or_else(|| EncodeError::Format("the label is not ASCII".into()))?;
    attributes
        .other
        .insert(Text::from(ATTRIBUTE), AttributeValue::Text(text));
    let layer = Layer::new(
        (image.width, image.height),
        attributes,
        encoding,
        AnyChannels::sort(list),
    );
    let image = Image::from_layer(layer);
    // Compression on one thread: images of several patches may be written at once by the caller.
    image
        .write()
        .non_parallel()
        .to_buffered(writer)
        .map_err(|error| match error {
            ::exr::error::Error::Io(source) => EncodeError::Io(source),
            other => EncodeError::Format(other.to_string()),
        })
}

/// Refuses what the encoder would panic on or what readers stumble over.
fn check(image: &GeometryImage) -> Result<(), EncodeError> {
    let texels = image.width.saturating_mul(image.height);
    let lengths = [
        image.position.len(),
        image.alpha.len(),
        image.normal.len(),
        image.face.len(),
        image.log_scale.len(),
    ];
    let lengths = lengths
        .into_iter()
        .chain(image.attributes.iter().map(|a| a.values.texels()));
    let lengths: Vec<usize> = lengths.collect();
    if texels == 0 || lengths.iter().any(|&n| n != texels) {
        return Err(EncodeError::Format(format!(
            "an image of {} by {} texels with channels of {lengths:?} values",
            image.width, image.height
        )));
    }
    let finite = |i: usize| {
        image.position[i]
            .iter()
            .chain(&image.normal[i])
            .all(|x| x.is_finite())
            && image.alpha[i].is_finite()
            && image.log_scale[i].is_finite()
    };
    let attributes_finite = |i: usize| {
        image
            .attributes
            .iter()
            .all(|sampled| match &sampled.values {
                Values::Numbers { components, values } => {
                    let texel = &values[i * components..(i + 1) * components];
                    texel.iter().all(|x| x.is_finite())
                }
                Values::Ids(_) => true,
            })
    };
    match (0..texels).find(|&i| !finite(i) || !attributes_finite(i)) {
        Some(i) => Err(EncodeError::NotFinite(format!(
            "texel ({}, {}) of a geometry image",
            i % image.width,
            i / image.width
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{atlas_json, sample};
    use crate::geometry::mesh::Appearance;
    use ::exr::prelude::{ReadChannels, ReadLayers, read};
    use std::io::Cursor;

    fn encoded() -> (GeometryImage, Label, Vec<u8>) {
        let atlas = sample::torus(5, 3);
        let appearance = Appearance::default();
        let mut provenance = sample::provenance(&appearance);
        provenance.asset = "größe 𝕋";
        let document = atlas_json::describe(&atlas, &provenance).unwrap();
        let label = label(&document, 0, &provenance);
        let mut cursor = Cursor::new(Vec::new());
        let text = label.to_text();
        write(&atlas.images[0], &atlas.image_params, &text, &mut cursor).unwrap();
        (atlas.images[0].clone(), label, cursor.into_inner())
    }

    #[test]
    fn an_image_reads_back_the_same() {
        let (image, label, bytes) = encoded();
        let back = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .unwrap();
        let layer = &back.layer_data;
        assert_eq!((layer.size.0, layer.size.1), (image.width, image.height));
        assert_eq!(layer.encoding.compression, Compression::ZIP16);
        let AttributeValue::Text(text) = &layer.attributes.other[&Text::from(ATTRIBUTE)] else {
            panic!("no text attribute");
        };
        assert_eq!(layer.attributes.other.len(), 1);
        assert_eq!(
            serde_json::from_str::<Label>(&text.to_string()).unwrap(),
            label
        );
        let channels: Vec<_> = layer.channel_data.list.iter().collect();
        let names: Vec<_> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(
            names,
            [
                "A",
                "B",
                "G",
                "R",
                "normal.X",
                "normal.Y",
                "normal.Z",
                "surface.face",
                "surface.logScale"
            ]
        );
        let red: Vec<f32> = image.position.iter().map(|p| p[0]).collect();
        assert_eq!(channels[3].sample_data, FlatSamples::F32(red));
        assert_eq!(channels[0].sample_data, FlatSamples::F32(image.alpha));
        assert_eq!(channels[7].sample_data, FlatSamples::U32(image.face));
        assert_eq!(channels[8].sample_data, FlatSamples::F32(image.log_scale));
    }

    #[test]
    fn two_files_are_equal_byte_by_byte() {
        assert_eq!(encoded().2, encoded().2);
    }

    #[test]
    fn text_beyond_ascii_is_escaped() {
        assert_eq!(ascii("\"größe 𝕋\""), "\"gr\\u00f6\\u00dfe \\ud835\\udd4b\"");
    }

    #[test]
    fn holes_and_empty_images_are_refused() {
        let (mut image, label, _) = encoded();
        image.position[3][1] = f32::NAN;
        let error = write(
            &image,
            &ImageParams::default(),
            &label.to_text(),
            Cursor::new(Vec::new()),
        )
        .unwrap_err();
        assert!(matches!(error, EncodeError::NotFinite(_)), "{error}");
        (image.width, image.height) = (0, 0);
        let error = write(
            &image,
            &ImageParams::default(),
            &label.to_text(),
            Cursor::new(Vec::new()),
        )
        .unwrap_err();
        assert!(matches!(error, EncodeError::Format(_)), "{error}");
    }

    /// A disk with room for so many bytes.
    struct Disk {
        room: u64,
        file: Cursor<Vec<u8>>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.file.position() + bytes.len() as u64 > self.room {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.file.write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
            self.file.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_an_error_wherever_it_comes() {
        let (image, label, bytes) = encoded();
        for room in (0..bytes.len() as u64).step_by(bytes.len() / 40) {
            let file = Cursor::new(Vec::new());
            let error = write(
                &image,
                &ImageParams::default(),
                &label.to_text(),
                Disk { room, file },
            )
            .unwrap_err();
            let EncodeError::Io(source) = error else {
                panic!("{error}");
            };
            assert_eq!(source.kind(), std::io::ErrorKind::StorageFull);
        }
        let (room, file) = (bytes.len() as u64, Cursor::new(Vec::new()));
        write(
            &image,
            &ImageParams::default(),
            &label.to_text(),
            Disk { room, file },
        )
        .unwrap();
    }
}
