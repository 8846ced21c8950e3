//! What a material library says, line by line.

use crate::read::error::shorten;
use crate::read::text::{Lines, after_keyword, words};
use std::collections::BTreeMap;

/// Materials that are taken from one library.
const MOST: usize = 4096;

/// A texture of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    pub file: String,
    pub is_clamped: bool,
    /// Factor of bumps.
    pub scale: f32,
    /// Options that change it in ways that are not kept.
    pub changes: Vec<String>,
}

/// A library as it is read.
#[derive(Default)]
pub struct Library {
    pub materials: BTreeMap<String, Described>,
    /// Lines that say nothing that could be understood, by number from 1.
    pub unclear: Vec<(usize, String)>,
}

/// What a library says of one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Described {
    pub diffuse: Option<[f32; 3]>,
    pub emissive: Option<[f32; 3]>,
    opacity: Option<f32>,
    transparency: Option<f32>,
    shininess: Option<f32>,
    illumination: Option<f32>,
    roughness: Option<f32>,
    pub metallic: Option<f32>,
    pub color_map: Option<Map>,
    pub emissive_map: Option<Map>,
    pub normal_map: Option<Map>,
    pub bump_map: Option<Map>,
    pub opacity_map: Option<Map>,
    /// Keywords of textures that a glTF material has no place for.
    pub others: Vec<String>,
}

/// The materials of a library.
pub fn parse(bytes: &[u8]) -> Library {
    let mut library = Library::default();
    let mut current: Option<(String, Described)> = None;
    let mut lines = Lines::new(bytes);
    while let Some(line) = lines.next() {
        let Some(keyword) = words(line).next() else {
            continue;
        };
        let is_clear = if keyword.eq_ignore_ascii_case(b"newmtl") {
            let next = (after_keyword(line), Described::default());
            let is_named = !next.0.is_empty();
            library.put(current.replace(next));
            is_named
        } else {
            match &mut current {
                Some((_, described)) => described.state(keyword, line),
                None => true,
            }
        };
        if !is_clear {
            library.unclear.push((lines.number, shorten(line)));
        }
    }
    library.put(current);
    library
}

impl Library {
    /// The first of a name stays, and so many in all: each may name files that are looked for.
    fn put(&mut self, material: Option<(String, Described)>) {
        if let Some((name, described)) = material.filter(|_| self.materials.len() < MOST) {
            self.materials.entry(name).or_insert(described);
        }
    }
}

impl Described {
    /// Whether the line was understood, or is of no interest.
    fn state(&mut self, keyword: &[u8], line: &[u8]) -> bool {
        let keyword = String::from_utf8_lossy(keyword).into_owned();
        let texture = match keyword.to_ascii_lowercase().as_str() {
            "kd" => return set(&mut self.diffuse, color(line)),
            "ke" => return set(&mut self.emissive, color(line)),
            "d" => return set(&mut self.opacity, last_number(line)),
            "tr" => return set(&mut self.transparency, last_number(line)),
            "ns" => return set(&mut self.shininess, last_number(line)),
            "illum" => return set(&mut self.illumination, last_number(line)),
            "pr" => return set(&mut self.roughness, last_number(line)),
            "pm" => return set(&mut self.metallic, last_number(line)),
            "map_kd" => &mut self.color_map,
            "map_ke" => &mut self.emissive_map,
            "norm" => &mut self.normal_map,
            "map_bump" | "bump" => &mut self.bump_map,
            "map_d" => &mut self.opacity_map,
            other => {
                if other.starts_with("map_") || ["refl", "disp", "decal"].contains(&other) {
                    self.others.push(keyword);
                }
                return true;
            }
        };
        set(texture, map(&after_keyword(line)))
    }

    /// 0 to 1.
    pub fn alpha(&self) -> f32 {
        let transparency = self.transparency.map(|t| 1.0 - t);
        self.opacity.or(transparency).unwrap_or(1.0).clamp(0.0, 1.0)
    }

    /// 0 to 1.
    pub fn roughness(&self) -> f32 {
        let is_dull = self.illumination.is_some_and(|model| model < 2.0);
        let shininess = self.shininess.filter(|_| !is_dull);
        let otherwise = shininess.map(|s| 1.0 - (s.clamp(0.0, 1000.0) / 1000.0).sqrt());
        self.roughness.or(otherwise).unwrap_or(1.0).clamp(0.0, 1.0)
    }
}

/// Whether something was stated.
fn set<T>(value: &mut Option<T>, stated: Option<T>) -> bool {
    let is_stated = stated.is_some();
    if is_stated {
        *value = stated;
    }
    is_stated
}

fn finite(word: &[u8]) -> Option<f32> {
    let number: f32 = std::str::from_utf8(word).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}

/// The last number of a line, which may have an option before it (`d -halo 0.5`).
fn last_number(line: &[u8]) -> Option<f32> {
    finite(words(line).skip(1).last()?)
}

/// Three numbers, held to 0 to 1, or one for all. Spectral curves are not numbers.
fn color(line: &[u8]) -> Option<[f32; 3]> {
    let numbers: Option<Vec<f32>> = words(line).skip(1).map(finite).collect();
    let color = match numbers?[..] {
        [grey] => [grey; 3],
        [red, green, blue] => [red, green, blue],
        _ => return None,
    };
    Some(color.map(|c| c.clamp(0.0, 1.0)))
}

/// A texture: options, then the name of a file, which may hold blanks.
pub fn map(text: &str) -> Option<Map> {
    let mut map = Map {
        file: String::new(),
        is_clamped: false,
        scale: 1.0,
        changes: Vec::new(),
    };
    let mut rest = text;
    while rest.starts_with('-') {
        let (option, after) = first_word(rest);
        let (value, beyond) = first_word(after);
        rest = match option {
            // Up to three numbers.
            "-o" | "-s" | "-t" => {
                let neutral = if option == "-s" { 1.0 } else { 0.0 };
                let (mut after, mut is_neutral) = (after, true);
                for _ in 0..3 {
                    let (value, beyond) = first_word(after);
                    let Some(number) = finite(value.as_bytes()) else {
                        break;
                    };
                    is_neutral &= number == neutral;
                    after = beyond;
                }
                if !is_neutral {
                    map.changes.push(option.to_owned());
                }
                after
            }
            "-mm" => {
                let (second, beyond) = first_word(beyond);
                if [value, second].map(|v| finite(v.as_bytes())) != [Some(0.0), Some(1.0)] {
                    map.changes.push(option.to_owned());
                }
                beyond
            }
            "-clamp" => {
                map.is_clamped = value == "on";
                beyond
            }
            "-bm" => {
                map.scale = finite(value.as_bytes()).unwrap_or(1.0);
                beyond
            }
            "-blendu" | "-blendv" | "-boost" | "-cc" | "-imfchan" | "-texres" | "-type" => beyond,
            // Not an option, then.
            _ => break,
        };
    }
    map.file = rest.to_owned();
    (!rest.is_empty()).then_some(map)
}

/// The first word, and what follows it.
fn first_word(text: &str) -> (&str, &str) {
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_start())
}
