//! Materials, textures and images (glTF 2.0, 3.8 and 3.9).
//!
//! `KHR_texture_transform` has no place in a [`Material`]; its maps are returned and written into the texture
//! coordinates of the primitives that use the material.

use super::buffers::{Buffers, load_uri, lookup};
use super::schema::{Root, TextureInfo, TextureTransform};
use crate::geometry::mesh::{Appearance, Material, Texture, TextureUse};
use crate::read::build::SoupBuilder;
use crate::read::error::ReadProblem;
use crate::read::folder::Folder;
use std::collections::BTreeMap;

/// glTF's default wrap mode, `REPEAT`.
const REPEAT: u32 = 10497;

/// u′ = m00 u + m01 v + m02 and so on.
pub type TextureMap = [[f64; 3]; 2];

/// The maps of one material by set of texture coordinates.
pub type TextureMaps = BTreeMap<u32, TextureMap>;

/// Scale, then rotate counterclockwise as seen in the image (v points down), then move.
///
/// The specification's example (lower left quadrant turned clockwise: offset (0, 1), rotation π/2, scale ½)
/// holds with these signs, which are those of the reference viewer; its GLSL lines have the other sign.
pub fn texture_map(transform: &TextureTransform) -> TextureMap {
    let (sin, cos) = transform.rotation.sin_cos();
    let ([u, v], [su, sv]) = (transform.offset, transform.scale);
    [[cos * su, sin * sv, u], [-sin * su, cos * sv, v]]
}

const IDENTITY: TextureMap = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Where the bytes of an image are: two images of one place are one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source<'a> {
    Uri(&'a str),
    View(usize),
}

struct Gather<'a, 'b> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    folder: &'b mut Folder,
    build: &'b mut SoupBuilder,
    appearance: Appearance,
    textures: BTreeMap<usize, Option<usize>>,
    images: BTreeMap<Source<'a>, Option<usize>>,
}

/// Fills the soup's appearance; returns the texture maps of every material.
pub fn gather(
    root: &Root,
    buffers: &Buffers,
    folder: &mut Folder,
    build: &mut SoupBuilder,
) -> Result<Vec<TextureMaps>, ReadProblem> {
    let mut gather = Gather {
        root,
        buffers,
        folder,
        build,
        appearance: Appearance::default(),
        textures: BTreeMap::new(),
        images: BTreeMap::new(),
    };
    let mut maps = Vec::with_capacity(root.materials.len());
    for i in 0..root.materials.len() {
        maps.push(gather.material(i)?);
    }
    let appearance = gather.appearance;
    build.soup.appearance = appearance;
    Ok(maps)
}

impl<'a> Gather<'a, '_> {
    fn material(&mut self, index: usize) -> Result<TextureMaps, ReadProblem> {
        let source = &self.root.materials[index];
        let pbr = &source.pbr_metallic_roughness;
        let slots = [
            &pbr.base_color_texture,
            &pbr.metallic_roughness_texture,
            &source.normal_texture,
            &source.occlusion_texture,
            &source.emissive_texture,
        ];
        let mut maps = TextureMaps::new();
        let mut uses = [const { None }; 5];
        for (slot, used) in slots.into_iter().zip(&mut uses) {
            let Some(info) = slot else { continue };
            *used = self.texture_use(index, info)?;
            let transform = info.extensions.transform.as_ref();
            let set = transform
                .and_then(|t| t.tex_coord)
                .unwrap_or(info.tex_coord);
            let map = transform.map_or(IDENTITY, texture_map);
            if *maps.entry(set).or_insert(map) != map {
                self.build.note(format!("material {index}: textures of set {set} have different transforms, and the first one's is used"));
            }
        }
        maps.retain(|_, map| *map != IDENTITY);
        let [base_color, metallic_roughness, normal, occlusion, emissive] = uses;
        self.appearance.materials.push(Material {
            name: source.name.clone(),
            base_color: pbr.base_color_factor,
            metallic: pbr.metallic_factor,
            roughness: pbr.roughness_factor,
            emissive: source.emissive_factor,
            alpha_mode: match source.alpha_mode.as_deref() {
                Some(mode @ ("MASK" | "BLEND")) => mode.into(),
                _ => "OPAQUE".into(),
            },
            alpha_cutoff: source.alpha_cutoff.unwrap_or(0.5),
            double_sided: source.double_sided,
            base_color_texture: base_color,
            metallic_roughness_texture: metallic_roughness,
            normal_texture: normal,
            occlusion_texture: occlusion,
            emissive_texture: emissive,
        });
        Ok(maps)
    }

    fn texture_use(
        &mut self,
        material: usize,
        info: &TextureInfo,
    ) -> Result<Option<TextureUse>, ReadProblem> {
        let index = info.index;
        let texture = match self.textures.get(&index) {
            Some(known) => *known,
            None => {
                let texture = self.texture(material, index)?;
                self.textures.insert(index, texture);
                texture
            }
        };
        let transform = info.extensions.transform.as_ref();
        Ok(texture.map(|texture| TextureUse {
            texture,
            tex_coord: transform
                .and_then(|t| t.tex_coord)
                .unwrap_or(info.tex_coord),
            scale: info.scale.or(info.strength).unwrap_or(1.0),
        }))
    }

    fn texture(&mut self, material: usize, index: usize) -> Result<Option<usize>, ReadProblem> {
        let textures = &self.root.textures;
        let texture = lookup(textures, index, "texture", || {
            format!("material {material}")
        })?;
        let Some(source) = texture.source else {
            self.build.note(format!(
                "texture {index} is skipped: its image is neither PNG nor JPEG"
            ));
            return Ok(None);
        };
        let Some(image) = self.image(index, source)? else {
            return Ok(None);
        };
        let sampler = match texture.sampler {
            Some(sampler) => {
                let samplers = &self.root.samplers;
                Some(lookup(samplers, sampler, "sampler", || {
                    format!("texture {index}")
                })?)
            }
            None => None,
        };
        self.appearance.textures.push(Texture {
            image,
            wrap: [
                sampler.and_then(|s| s.wrap_s).unwrap_or(REPEAT),
                sampler.and_then(|s| s.wrap_t).unwrap_or(REPEAT),
            ],
            mag_filter: sampler.and_then(|s| s.mag_filter),
            min_filter: sampler.and_then(|s| s.min_filter),
        });
        Ok(Some(self.appearance.textures.len() - 1))
    }

    /// An image file; none, with a note, where it cannot be had: the surface does not depend on it.
    fn image(&mut self, texture: usize, index: usize) -> Result<Option<usize>, ReadProblem> {
        let from = || format!("texture {texture}");
        let root: &'a Root = self.root;
        let image = lookup(&root.images, index, "image", from)?;
        let source = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => Source::Uri(uri),
            (None, Some(view)) => Source::View(view),
            (None, None) => {
                self.build.note(format!(
                    "image {index} is skipped: it has neither URI nor buffer view"
                ));
                return Ok(None);
            }
        };
        if let Some(known) = self.images.get(&source) {
            return Ok(*known);
        }
        let image = self.load(index, source)?;
        self.images.insert(source, image);
        Ok(image)
    }

    fn load(&mut self, index: usize, source: Source) -> Result<Option<usize>, ReadProblem> {
        let what = || format!("image {index}");
        let budget = &mut self.build.budget;
        let loaded;
        let bytes = match source {
            Source::Uri(uri) => match load_uri(uri, self.folder, budget) {
                Ok(bytes) => {
                    loaded = bytes;
                    loaded.as_slice()
                }
                Err(missing @ ReadProblem::ReferencedFile { .. }) => {
                    let note = format!("image {index} is skipped: {missing}");
                    self.build.note(note);
                    return Ok(None);
                }
                Err(other) => return Err(other),
            },
            Source::View(view) => self.buffers.view(view, what)?,
        };
        let image = self.build.image(bytes, what)?;
        Ok(image.map(|image| {
            self.appearance.images.push(image);
            self.appearance.images.len() - 1
        }))
    }
}
