//! Material libraries of OBJ files (MTL): colours and textures of materials.
//!
//! *Enters:* an OBJ file whose faces name materials, and the libraries beside it. *Leaves:* metallic–roughness materials, with their images. The surface does
//! not depend on any of it: what is missing or broken is noted, not refused. Files are looked for where they are said to be, and then in the mesh's folder, where they end up when
//! they are handed on.
//!
//! | statement | becomes |
//! | --- | --- |
//! | `Kd`, `d`, `Tr`, `map_Kd` | base colour; white where it has a texture, as other readers have it |
//! | `Ke`, `map_Ke` | emission |
//! | `Pr`, `Pm` | roughness and metalness |
//! | `Ns` where there is no `Pr` | roughness 1 − √(Ns / 1000), which is what Blender means by it; 1 where `illum` says that nothing shines |
//! | `norm`, else `map_Bump` or `bump` | normal map; a grey PNG is a height map, which glTF does not have |
//! | `map_d` | transparency, where it names the image of `map_Kd` |

mod library;

use super::build::SoupBuilder;
use super::error::{ReadProblem, shorten};
use super::folder::{self, Folder};
use super::text::{Lines, after_keyword, words};
use crate::geometry::mesh::{Appearance, Material, Texture, TextureUse};
use library::{Described, Map, parse};
use std::collections::BTreeMap;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

/// Longer lines name no library. Bytes.
const LONGEST: u64 = 1 << 16;

/// Libraries beyond this number are not looked at.
const MOST_LIBRARIES: usize = 64;

/// Places that one file is looked for at.
const MOST_PLACES: usize = 8;

/// A larger file is no material library. Bytes.
pub(super) const LARGEST: u64 = 16 << 20;

/// glTF's wrap modes.
const REPEAT: u32 = 10497;
const CLAMP_TO_EDGE: u32 = 33071;

/// What follows `mtllib` in the lines of an OBJ file, in order, each once. Both the reader and the fingerprint ask this.
pub(super) fn libraries(mut obj: impl BufRead) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    let mut text = Vec::new();
    loop {
        text.clear();
        let read = (&mut obj).take(LONGEST).read_until(b'\n', &mut text)?;
        if read == 0 || names.len() == MOST_LIBRARIES {
            return Ok(names);
        }
        for line in Lines::new(&text) {
            if words(line)
                .next()
                .is_some_and(|w| w.eq_ignore_ascii_case(b"mtllib"))
            {
                let name = after_keyword(line);
                if !name.is_empty() && !names.contains(&name) {
                    names.push(name);
                }
            }
        }
    }
}

/// The files that the words after `mtllib` may mean: first one whose name has blanks, then one a word; each at several places.
fn library_places(name: &str) -> Vec<Vec<String>> {
    let mut files = vec![places("", name)];
    let words: Vec<&str> = name.split_whitespace().collect();
    if words.len() > 1 {
        files.extend(words.into_iter().map(|word| places("", word)));
    }
    files
}

/// All of them.
pub(super) fn library_files(name: &str) -> impl Iterator<Item = String> {
    library_places(name).into_iter().flatten()
}

/// The files that a library's textures may be.
pub(super) fn texture_files(library: &str, bytes: &[u8]) -> Vec<String> {
    let maps = parse(bytes).materials.into_values().flat_map(|d| {
        [
            d.color_map,
            d.emissive_map,
            d.normal_map,
            d.bump_map,
            d.opacity_map,
        ]
    });
    let maps = maps.flatten();
    maps.flat_map(|map| places(library, &map.file)).collect()
}

/// Where a file may be that a file in the folder of `from` names: there, or in the mesh's folder, with as many of the folders of its path as are there. A comment may follow its name.
fn places(from: &str, name: &str) -> Vec<String> {
    let folder = from.rsplit_once('/').map_or("", |(folder, _)| folder);
    let name = name.trim().trim_matches('"').replace('\\', "/");
    let before_comment = name
        .split(" #")
        .next()
        .unwrap_or_default()
        .trim()
        .to_owned();
    let mut found = Vec::new();
    for name in [name, before_comment] {
        if !folder.is_empty() {
            found.push(format!("{folder}/{name}"));
        }
        let mut rest = Some(name.as_str());
        while let Some(part) = rest {
            found.push(part.to_owned());
            rest = part.split_once('/').map(|(_, rest)| rest);
        }
    }
    let mut places = Vec::new();
    for place in found {
        let place = place.trim_start_matches("./").to_owned();
        if folder::is_inside(&place) && !places.contains(&place) && places.len() < MOST_PLACES {
            places.push(place);
        }
    }
    places
}

/// Why a file was not found at any of its places.
fn lost(name: &str) -> &'static str {
    let name = name.trim().trim_matches('"').replace('\\', "/");
    match folder::is_inside(&name) {
        true => "there is no such file in the mesh's folder",
        false => "only files in the mesh's folder are read, and there it is not",
    }
}

/// Gives the materials that faces name what the libraries say of them.
pub(super) fn describe(
    obj: &[u8],
    folder: &mut Folder,
    build: &mut SoupBuilder,
) -> Result<(), ReadProblem> {
    let names = libraries(obj).map_err(|source| ReadProblem::Io { source })?;
    let mut materials = BTreeMap::new();
    let mut has_library = false;
    for name in &names {
        for (library, bytes) in load(name, folder, build)? {
            has_library = true;
            let parsed = parse(&bytes);
            for (line, text) in parsed.unclear {
                build.note(format!(
                    "line {line} of material library `{library}` is not understood: `{text}`"
                ));
            }
            for (material, described) in parsed.materials {
                let from = || (library.clone(), described);
                materials.entry(material).or_insert_with(from);
            }
        }
    }
    let mut appearance = std::mem::take(&mut build.soup.appearance);
    let mut textures = Textures {
        folder,
        build,
        appearance: Appearance::default(),
        images: BTreeMap::new(),
        textures: BTreeMap::new(),
    };
    for material in &mut appearance.materials {
        let name = material.name.as_deref().unwrap_or_default();
        match materials.get(name) {
            Some((library, described)) => textures.describe(material, library, described)?,
            None if !has_library => {}
            None => textures.build.note(format!(
                "material `{}` is in no material library: only its name is kept",
                shorten(name.as_bytes())
            )),
        }
    }
    let Appearance {
        textures, images, ..
    } = textures.appearance;
    build.soup.appearance = Appearance {
        textures,
        images,
        ..appearance
    };
    Ok(())
}

/// The libraries that the words after `mtllib` mean, with their names.
fn load(
    name: &str,
    folder: &mut Folder,
    build: &mut SoupBuilder,
) -> Result<Vec<(String, Vec<u8>)>, ReadProblem> {
    let mut found = Vec::new();
    for (k, places) in library_places(name).into_iter().enumerate() {
        let Some((place, bytes)) = first_of(&places, folder, build)? else {
            continue;
        };
        if bytes.len() as u64 > LARGEST {
            build.note(format!(
                "material library `{place}` is skipped: it has {} bytes, {LARGEST} at most",
                bytes.len()
            ));
        } else if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
            build.note(format!(
                "material library `{place}` is skipped: it is UTF-16; save it as UTF-8"
            ));
        } else {
            found.push((place, bytes.to_vec()));
        }
        // All words are the name of one file.
        if k == 0 {
            return Ok(found);
        }
    }
    if found.is_empty() {
        build.note(format!(
            "material library `{}` is skipped: {}; materials keep their names only",
            shorten(name.as_bytes()),
            lost(name)
        ));
    }
    Ok(found)
}

/// A file with its place in the mesh's folder.
type Found = (String, Rc<Vec<u8>>);

/// The first file that is there.
fn first_of(
    places: &[String],
    folder: &mut Folder,
    build: &mut SoupBuilder,
) -> Result<Option<Found>, ReadProblem> {
    for place in places {
        match folder.referenced(place, place, &mut build.budget) {
            Ok(bytes) => return Ok(Some((place.clone(), bytes))),
            Err(ReadProblem::ReferencedFile { .. } | ReadProblem::OutsideFolder { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    Ok(None)
}

/// Textures and images under construction.
struct Textures<'a> {
    folder: &'a mut Folder,
    build: &'a mut SoupBuilder,
    appearance: Appearance,
    /// By library and name: in the appearance, and whether it is grey.
    images: BTreeMap<(String, String), Option<(usize, bool)>>,
    /// By image and wrap mode.
    textures: BTreeMap<(usize, u32), usize>,
}

impl Textures<'_> {
    fn describe(
        &mut self,
        material: &mut Material,
        library: &str,
        described: &Described,
    ) -> Result<(), ReadProblem> {
        let name = material.name.clone().unwrap_or_default();
        let (alpha, white) = (described.alpha(), [1.0; 3]);
        material.base_color_texture = match &described.color_map {
            Some(map) => self.texture(library, map, false)?,
            None => None,
        };
        let [red, green, blue] = match material.base_color_texture {
            Some(_) => white,
            None => described.diffuse.unwrap_or(white),
        };
        material.base_color = [red, green, blue, alpha];
        material.emissive_texture = match &described.emissive_map {
            Some(map) => self.texture(library, map, false)?,
            None => None,
        };
        let emissive = described.emissive.filter(|e| e.iter().any(|&c| c > 0.0));
        material.emissive = match material.emissive_texture {
            Some(_) => emissive.unwrap_or(white),
            None => emissive.unwrap_or_default(),
        };
        let bumps = described
            .normal_map
            .as_ref()
            .or(described.bump_map.as_ref());
        material.normal_texture = match bumps {
            Some(map) => self.texture(library, map, true)?,
            None => None,
        };
        material.roughness = described.roughness();
        material.metallic = described.metallic.unwrap_or(0.0).clamp(0.0, 1.0);
        let color = described.color_map.as_ref().map(|map| &map.file);
        let opacity = described.opacity_map.as_ref().map(|map| &map.file);
        let is_translucent = opacity.is_some() && opacity == color;
        if alpha < 1.0 || is_translucent {
            material.alpha_mode = "BLEND".into();
        }
        let material = shorten(name.as_bytes());
        if opacity.is_some() && !is_translucent {
            self.build.note(format!(
                "`map_d` of material `{material}` is skipped: put transparency into the image of map_Kd"
            ));
        }
        for other in &described.others {
            self.build.note(format!(
                "`{other}` of material `{material}` is skipped: textures are those of map_Kd, map_Ke, norm and map_Bump"
            ));
        }
        Ok(())
    }

    fn texture(
        &mut self,
        library: &str,
        map: &Map,
        is_normal: bool,
    ) -> Result<Option<TextureUse>, ReadProblem> {
        let key = (library.to_owned(), map.file.clone());
        let image = match self.images.get(&key) {
            Some(known) => *known,
            None => {
                let image = self.image(library, &map.file)?;
                self.images.insert(key, image);
                image
            }
        };
        let Some((image, is_grey)) = image else {
            return Ok(None);
        };
        let file = shorten(map.file.as_bytes());
        if is_normal && is_grey {
            self.build.note(format!(
                "texture `{file}` is skipped: it is grey, a height map; glTF takes normal maps only"
            ));
            return Ok(None);
        }
        if !map.changes.is_empty() {
            self.build.note(format!(
                "texture `{file}` is used as it is, without {}",
                map.changes.join(" and ")
            ));
        }
        let wrap = match map.is_clamped {
            true => CLAMP_TO_EDGE,
            false => REPEAT,
        };
        let textures = &mut self.appearance.textures;
        let texture = *self.textures.entry((image, wrap)).or_insert_with(|| {
            textures.push(Texture {
                image,
                wrap: [wrap; 2],
                mag_filter: None,
                min_filter: None,
            });
            textures.len() - 1
        });
        Ok(Some(TextureUse {
            texture,
            tex_coord: 0,
            scale: if is_normal { map.scale } else { 1.0 },
        }))
    }

    /// An image, and whether it is a grey PNG; none, with a note, where it cannot be had.
    fn image(&mut self, library: &str, file: &str) -> Result<Option<(usize, bool)>, ReadProblem> {
        let what = || format!("texture `{}`", shorten(file.as_bytes()));
        let places = places(library, file);
        let Some((place, bytes)) = first_of(&places, self.folder, self.build)? else {
            let note = format!("{} is skipped: {}", what(), lost(file));
            self.build.note(note);
            return Ok(None);
        };
        if places.first() != Some(&place) || lost(file) != lost(&place) {
            let note = format!("{} is not there: `{place}` is used", what());
            self.build.note(note);
        }
        let Some(image) = self.build.image(&bytes, what)? else {
            return Ok(None);
        };
        // The colour type in the header: grey, or grey with alpha.
        let is_png = image.mime_type == "image/png";
        let is_grey = is_png && matches!(bytes.get(25), Some(0 | 4));
        self.appearance.images.push(image);
        Ok(Some((self.appearance.images.len() - 1, is_grey)))
    }
}

#[cfg(test)]
mod tests;
