//! Materials, textures and images of `surface.glb`: those that the component uses, each once.

use super::builder::Builder;
use super::vertices::SetNumbers;
use crate::geometry::ids::NONE;
use crate::geometry::mesh::{Appearance, Material, TextureUse};
use gltf::json::image::MimeType;
use gltf::json::material::{
    AlphaCutoff, AlphaMode, EmissiveFactor, NormalTexture, OcclusionTexture, PbrBaseColorFactor,
    PbrMetallicRoughness, StrengthFactor,
};
use gltf::json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Image, Index, Texture};
use std::collections::BTreeMap;

/// Writes materials in the order in which they are asked for.
pub(super) struct Writer<'a> {
    appearance: &'a Appearance,
    sets: &'a SetNumbers,
    textures: BTreeMap<usize, Index<Texture>>,
    images: BTreeMap<usize, Index<Image>>,
}

impl<'a> Writer<'a> {
    pub(super) fn new(appearance: &'a Appearance, sets: &'a SetNumbers) -> Self {
        Self {
            appearance,
            sets,
            textures: BTreeMap::new(),
            images: BTreeMap::new(),
        }
    }

    /// Adds the material of a number, or the default one.
    pub(super) fn write(&mut self, id: u32, builder: &mut Builder) -> Index<gltf::json::Material> {
        let known = (id != NONE).then(|| self.appearance.materials.get(id as usize));
        let default = Material {
            name: Some("default".into()),
            ..Material::default()
        };
        let material = known.flatten().unwrap_or(&default);
        let json = self.describe(material, builder);
        builder.root.push(json)
    }

    fn describe(&mut self, m: &Material, builder: &mut Builder) -> gltf::json::Material {
        let alpha_mode = match m.alpha_mode.as_str() {
            "MASK" => AlphaMode::Mask,
            "BLEND" => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        let mut info = |used: &Option<TextureUse>| self.texture(used.as_ref(), builder);
        let base_color_texture = info(&m.base_color_texture);
        let metallic_roughness_texture = info(&m.metallic_roughness_texture);
        let normal = info(&m.normal_texture);
        let occlusion = info(&m.occlusion_texture);
        let emissive_texture = info(&m.emissive_texture);
        let scale = |used: &Option<TextureUse>| match used {
            Some(used) if used.scale.is_finite() => used.scale,
            _ => 1.0,
        };
        gltf::json::Material {
            // Allowed with this mode only.
            alpha_cutoff: (alpha_mode == AlphaMode::Mask).then(|| {
                AlphaCutoff(if m.alpha_cutoff >= 0.0 {
                    m.alpha_cutoff.min(f32::MAX)
                } else {
                    0.5
                })
            }),
            alpha_mode: Checked::Valid(alpha_mode),
            double_sided: m.double_sided,
            name: m.name.clone(),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor(m.base_color.map(|x| share(x, 1.0))),
                base_color_texture,
                metallic_factor: StrengthFactor(share(m.metallic, 0.0)),
                roughness_factor: StrengthFactor(share(m.roughness, 1.0)),
                metallic_roughness_texture,
                extensions: None,
                extras: None,
            },
            normal_texture: normal.map(|info| NormalTexture {
                index: info.index,
                scale: scale(&m.normal_texture),
                tex_coord: info.tex_coord,
                extensions: None,
                extras: None,
            }),
            occlusion_texture: occlusion.map(|info| OcclusionTexture {
                index: info.index,
                strength: StrengthFactor(share(scale(&m.occlusion_texture), 1.0)),
                tex_coord: info.tex_coord,
                extensions: None,
                extras: None,
            }),
            emissive_texture,
            emissive_factor: EmissiveFactor(m.emissive.map(|x| share(x, 0.0))),
            extensions: None,
            extras: None,
        }
    }

    /// The texture with its set one up. A texture is left out where its image is neither PNG nor
    /// JPEG (glTF allows no other) or where the surface lacks its texture coordinates.
    fn texture(&mut self, used: Option<&TextureUse>, builder: &mut Builder) -> Option<Info> {
        let used = used?;
        let tex_coord = self.sets.shifted(used.tex_coord)?;
        let texture = self.appearance.textures.get(used.texture)?;
        let index = match self.textures.get(&used.texture) {
            Some(&index) => index,
            None => {
                let source = self.image(texture.image, builder)?;
                let sampler = builder.root.push(Sampler {
                    mag_filter: texture.mag_filter.and_then(mag_filter).map(Checked::Valid),
                    min_filter: texture.min_filter.and_then(min_filter).map(Checked::Valid),
                    wrap_s: Checked::Valid(wrap(texture.wrap[0])),
                    wrap_t: Checked::Valid(wrap(texture.wrap[1])),
                    ..Sampler::default()
                });
                let index = builder.root.push(Texture {
                    name: None,
                    sampler: Some(sampler),
                    source,
                    extensions: None,
                    extras: None,
                });
                self.textures.insert(used.texture, index);
                index
            }
        };
        Some(Info {
            index,
            tex_coord,
            extensions: None,
            extras: None,
        })
    }

    fn image(&mut self, id: usize, builder: &mut Builder) -> Option<Index<Image>> {
        if let Some(&index) = self.images.get(&id) {
            return Some(index);
        }
        let bytes = &self.appearance.images.get(id)?.bytes;
        // The declared type may be wrong: what the bytes say counts.
        let mime_type = sniff(bytes)?;
        let view = builder.view(bytes, None);
        let index = builder.root.push(Image {
            buffer_view: Some(view),
            mime_type: Some(MimeType(mime_type.into())),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        self.images.insert(id, index);
        Some(index)
    }
}

/// How many texture-coordinate sets of the source a primitive must have for a material's textures.
pub(super) fn texture_coordinate_sets(
    appearance: &Appearance,
    id: u32,
    sets: &SetNumbers,
) -> usize {
    let uses = appearance.materials.get(id as usize).map(textures_of);
    let used = uses.into_iter().flatten().flatten();
    let places = used.filter_map(|used| sets.shifted(used.tex_coord));
    places.max().unwrap_or(0) as usize
}

fn textures_of(m: &Material) -> [Option<&TextureUse>; 5] {
    [
        m.base_color_texture.as_ref(),
        m.metallic_roughness_texture.as_ref(),
        m.normal_texture.as_ref(),
        m.occlusion_texture.as_ref(),
        m.emissive_texture.as_ref(),
    ]
}

/// A factor in [0, 1], as glTF wants it.
fn share(x: f32, default: f32) -> f32 {
    if x.is_nan() {
        default
    } else {
        x.clamp(0.0, 1.0)
    }
}

fn wrap(gl: u32) -> WrappingMode {
    let modes = [WrappingMode::ClampToEdge, WrappingMode::MirroredRepeat];
    let known = modes.into_iter().find(|mode| mode.as_gl_enum() == gl);
    known.unwrap_or(WrappingMode::Repeat)
}

fn mag_filter(gl: u32) -> Option<MagFilter> {
    let filters = [MagFilter::Nearest, MagFilter::Linear];
    filters.into_iter().find(|filter| filter.as_gl_enum() == gl)
}

fn min_filter(gl: u32) -> Option<MinFilter> {
    let filters = [
        MinFilter::Nearest,
        MinFilter::Linear,
        MinFilter::NearestMipmapNearest,
        MinFilter::LinearMipmapNearest,
        MinFilter::NearestMipmapLinear,
        MinFilter::LinearMipmapLinear,
    ];
    filters.into_iter().find(|filter| filter.as_gl_enum() == gl)
}

/// The type of an image that begins like one and states its size; `None` for everything else.
fn sniff(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.len() >= 33 && bytes[12..16] == *b"IHDR" {
        return Some("image/png");
    }
    bytes.starts_with(&[0xFF, 0xD8, 0xFF]).then_some(())?;
    // Walk the segments up to the start of a frame, which holds the size.
    let mut at = 2;
    loop {
        let marker = bytes.get(at..at + 4)?;
        if marker[0] != 0xFF {
            return None;
        }
        let length = usize::from(u16::from_be_bytes([marker[2], marker[3]]));
        match marker[1] {
            // Padding before a marker.
            0xFF => at += 1,
            0xC0..=0xC3 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF => {
                return (bytes.len() >= at + 2 + length).then_some("image/jpeg");
            }
            _ => at += 2 + length,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_known_by_their_bytes() {
        let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        assert_eq!(sniff(&png), None);
        png.resize(33, 0);
        assert_eq!(sniff(&png), Some("image/png"));
        let jpeg = [
            0xFF, 0xD8, 0xFF, 0xE0, 0, 4, 1, 2, 0xFF, 0xFF, 0xC0, 0, 5, 8, 0, 1,
        ];
        assert_eq!(sniff(&jpeg), Some("image/jpeg"));
        for end in 0..jpeg.len() {
            assert_eq!(sniff(&jpeg[..end]), None);
        }
        assert_eq!(sniff(b"RIFF....WEBP"), None);
    }

    #[test]
    fn factors_and_filters_stay_in_their_ranges() {
        assert_eq!(share(f32::NAN, 0.5), 0.5);
        assert_eq!(share(7.0, 0.5), 1.0);
        assert_eq!(share(-7.0, 0.5), 0.0);
        assert_eq!(wrap(33071), WrappingMode::ClampToEdge);
        assert_eq!(wrap(1), WrappingMode::Repeat);
        assert_eq!(min_filter(9987), Some(MinFilter::LinearMipmapLinear));
        assert_eq!(mag_filter(9987), None);
    }
}
