//! `surface.glb` of an asset of several components: all of them as one mesh, one primitive for each material and set of attributes.
//!
//! *Enters:* the split vertices of one component after the other. *Leaves:* the file. The packed patches of the components lie beside each other in one
//! square, as large as each component is: texels are as dense on all of them.
//!
//! *Not guaranteed:* what 32-bit floats cannot hold. Where components are too far apart for their sizes, those of the components' own files say more.

use super::builder::Builder;
use super::vertices::{Primitive, SetNumbers, next_index};
use super::{Surface, materials};
use crate::atlas::patches::pack;
use crate::export::ExportError;
use crate::geometry::mesh::Appearance;
use gltf::json::Mesh;
use gltf::json::extras::RawValue;
use serde::Serialize;
use std::collections::BTreeMap;

/// Whole numbers to which rectangles are packed, along a square of their area.
const FINE: f64 = 16384.0;

/// Sizes of the whole that its distance from the origin may be before positions are written relative to its middle.
const FAR: f64 = 16.0;

/// The components so far.
#[derive(Default)]
pub struct Whole {
    parts: Vec<Part>,
}

struct Part {
    component: usize,
    surface: Surface,
    /// Room around its patches, source units.
    padding: f64,
}

/// Where the patches of a component lie: p ↦ scale · p + shift, v down.
struct Place {
    scale: f64,
    shift: [f64; 2],
}

/// What `meshes[0].extras` holds, under the key `affineAtlas`.
#[derive(Serialize)]
struct Extras {
    #[serde(rename = "affineAtlas")]
    whole: WholeExtras,
}

#[derive(Serialize)]
struct WholeExtras {
    version: u32,
    components: Vec<Placed>,
}

/// Where the packed square of a component lies.
#[derive(Serialize)]
struct Placed {
    component: usize,
    packed_to_whole: Packing,
}

/// p ↦ scale · p + translation, v up.
#[derive(Serialize)]
struct Packing {
    scale: f64,
    translation: [f64; 2],
}

/// What primitives must have in common to be one: material, texture-coordinate sets and how many of them, number of colours, tangents.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Key<'a>(u32, &'a SetNumbers, usize, usize, bool);

impl Whole {
    /// Adds a component; `padding` texels lie around it.
    pub fn add(&mut self, component: usize, surface: Surface, padding: usize) {
        self.parts.push(Part {
            component,
            padding: padding as f64 * surface.texel,
            surface,
        });
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// The bytes of the file; `None` where 32-bit floats do not hold the whole.
    pub fn encode(
        &self,
        asset: &str,
        version: u32,
        appearance: &Appearance,
    ) -> Result<Option<Vec<u8>>, ExportError> {
        let Some(origin) = self.origin() else {
            return Ok(None);
        };
        let mut primitives: BTreeMap<Key, Primitive> = BTreeMap::new();
        let mut placed = Vec::new();
        for (part, place) in self.parts.iter().zip(self.places()) {
            let Place {
                scale,
                shift: [left, top],
            } = place;
            placed.push(Placed {
                component: part.component,
                packed_to_whole: Packing {
                    scale,
                    translation: [left, 1.0 - top - scale],
                },
            });
            for (material, primitive) in &part.surface.primitives {
                let key = Key(
                    *material,
                    &part.surface.sets,
                    primitive.tex_coords.len(),
                    primitive.colors.len(),
                    primitive.tangent.is_some(),
                );
                let mut moved = primitive.clone();
                for [u, v] in &mut moved.tex_coords[0] {
                    *u = (left + scale * f64::from(*u)).clamp(0.0, 1.0) as f32;
                    *v = (top + scale * f64::from(*v)).clamp(0.0, 1.0) as f32;
                }
                let shift = [0, 1, 2].map(|i| f64::from(part.surface.origin[i]) - origin[i]);
                for p in &mut moved.position {
                    *p = [0, 1, 2].map(|i| (f64::from(p[i]) + shift[i]) as f32);
                }
                match primitives.get_mut(&key) {
                    Some(before) => append(before, moved)?,
                    None => {
                        primitives.insert(key, moved);
                    }
                }
            }
        }
        let mut builder = Builder::default();
        let mut writers: BTreeMap<&SetNumbers, materials::Writer> = BTreeMap::new();
        let mut written = BTreeMap::new();
        let mut drawn = Vec::new();
        for (key, primitive) in &primitives {
            let &Key(id, sets, ..) = key;
            let writer = writers
                .entry(sets)
                .or_insert_with(|| materials::Writer::new(appearance, sets));
            let material = *written
                .entry((id, sets))
                .or_insert_with(|| writer.write(id, &mut builder));
            drawn.push(builder.primitive(primitive, material));
        }
        let mesh = Mesh {
            extensions: None,
            extras: Some(extras(version, placed)),
            name: Some(asset.into()),
            primitives: drawn,
            weights: None,
        };
        builder.scene(mesh, origin.map(|x| x as f32));
        builder.finish().map(Some)
    }

    /// The patches of every component beside those of the others.
    fn places(&self) -> Vec<Place> {
        let boxes: Vec<[[f64; 2]; 2]> = self.parts.iter().map(Part::packed_box).collect();
        let lengths = |(part, [low, high]): (&Part, &[[f64; 2]; 2])| {
            [0, 1].map(|i| part.surface.side * (high[i] - low[i]) + part.padding)
        };
        let sizes: Vec<[f64; 2]> = self.parts.iter().zip(&boxes).map(lengths).collect();
        let area: f64 = sizes.iter().map(|[w, h]| w * h).sum();
        let unit = area.sqrt() / FINE;
        let (corners, side) = pack(
            &sizes
                .iter()
                .map(|size| size.map(|x| (x / unit).ceil().max(1.0) as usize))
                .collect::<Vec<_>>(),
        );
        let whole = side as f64 * unit;
        let parts = self.parts.iter().zip(&boxes).zip(&corners);
        let place = |((part, [low, _]), corner): ((&Part, &[[f64; 2]; 2]), &[usize; 2])| {
            let scale = part.surface.side / whole;
            Place {
                scale,
                shift: [0, 1].map(|i| {
                    (corner[i] as f64 * unit + 0.5 * part.padding) / whole - scale * low[i]
                }),
            }
        };
        parts.map(place).collect()
    }

    /// What positions are written relative to; `None` where 32-bit floats do not hold them.
    fn origin(&self) -> Option<[f64; 3]> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for part in &self.parts {
            let primitives = part.surface.primitives.iter();
            for p in primitives.flat_map(|(_, primitive)| &primitive.position) {
                for i in 0..3 {
                    let x = f64::from(p[i]) + f64::from(part.surface.origin[i]);
                    low[i] = low[i].min(x);
                    high[i] = high[i].max(x);
                }
            }
        }
        let size = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        let reach = (0..3)
            .map(|i| low[i].abs().max(high[i].abs()))
            .fold(0.0, f64::max);
        let is_held = size.is_finite()
            && reach <= f64::from(f32::MAX)
            && size >= f64::from(f32::MIN_POSITIVE);
        let middle = [0, 1, 2].map(|i| f64::from((0.5 * (low[i] + high[i])) as f32));
        is_held.then_some(match reach > FAR * size {
            true => middle,
            false => [0.0; 3],
        })
    }
}

impl Part {
    /// Lower and upper corner of its patches in their square.
    fn packed_box(&self) -> [[f64; 2]; 2] {
        let (mut low, mut high) = ([1.0_f64; 2], [0.0_f64; 2]);
        let primitives = self.surface.primitives.iter();
        for uv in primitives.flat_map(|(_, primitive)| &primitive.tex_coords[0]) {
            for i in 0..2 {
                low[i] = low[i].min(f64::from(uv[i]));
                high[i] = high[i].max(f64::from(uv[i]));
            }
        }
        [low, high]
    }
}

/// Adds vertices and triangles behind others with the same attributes.
fn append(to: &mut Primitive, from: Primitive) -> Result<(), ExportError> {
    let first = to.position.len();
    // The greatest number that there will be must be one.
    next_index((first + from.position.len()).saturating_sub(1))?;
    to.indices
        .extend(from.indices.iter().map(|i| i + first as u32));
    to.position.extend(from.position);
    to.normal.extend(from.normal);
    if let (Some(to), Some(from)) = (&mut to.tangent, from.tangent) {
        to.extend(from);
    }
    for (to, from) in to.tex_coords.iter_mut().zip(from.tex_coords) {
        to.extend(from);
    }
    for (to, from) in to.colors.iter_mut().zip(from.colors) {
        to.extend(from);
    }
    to.log_scale.extend(from.log_scale);
    Ok(())
}

fn extras(version: u32, components: Vec<Placed>) -> Box<RawValue> {
    let extras = Extras {
        whole: WholeExtras {
            version,
            components,
        },
    };
    gltf::json::serialize::to_string(&extras)
        .and_then(RawValue::from_string)
        .expect("string keys and no custom serialiser, so that serialisation cannot fail")
}
