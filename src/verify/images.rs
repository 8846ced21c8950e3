//! Geometry images: layout, mask, and that every texel inside a patch holds its surface point.

use super::Verdicts;
use super::arrays::Arrays;
use super::channels;
use super::document::{Document, Patch};
use super::formulas::{Point2, Point3, Worst, diagonal3, distance2, mix3, norm3};
use super::patches::Groups;
use super::sides::{self, Sides};
use crate::parallel;
use crate::read::exr::{self, Image, Read};
use std::path::Path;

/// Largest distance between a texel and the surface point, in diagonals of the surface.
const TEXEL_TOLERANCE: f64 = 1e-5;
/// A texel counts as inside where its barycentric coordinates exceed this …
const STRICTLY_INSIDE: f64 = 1e-6;
/// … and as outside where it is further than this from every face (texels).
const BORDER: f64 = 1e-4;

/// What is measured of one image.
#[derive(Default)]
struct Tally {
    unreadable: Option<String>,
    wrong_size: bool,
    layout: Option<String>,
    text: Option<String>,
    infinite: usize,
    tested: usize,
    uncovered: usize,
    wrong: usize,
    far: f64,
    twice: usize,
    marked_outside: usize,
    neither: usize,
    wild: usize,
    beyond: Worst,
    wrong_face: usize,
    wrong_normal: usize,
    wrong_source_normal: usize,
    wrong_log_scale: usize,
    sides: Option<Sides>,
}

pub(super) fn check(
    folder: &Path,
    arrays: &Arrays,
    document: &Document,
    groups: &Groups,
    verdicts: &mut Verdicts,
) {
    let size = diagonal3(&arrays.positions);
    let mut tallies = parallel::map(&document.patches, |_, patch| {
        let mut tally = Tally::default();
        match read(&folder.join(&patch.image), patch, &mut tally) {
            Ok(Some(image)) => {
                if document.is_generated()
                    && let Some(what) = channels::lacking(&image, &document.images)
                {
                    tally.layout.get_or_insert(what);
                }
                tally.infinite += channels::infinite(&image);
                tally.wrong_source_normal =
                    channels::wrong_source_normals(&image, &document.images, patch);
                tally.text = check_text(image.text.as_deref(), patch, document);
                if patch.domain == "grid" {
                    tally.sides = Some(sides::sides(&image, patch));
                }
                let faces = groups.of(patch.id);
                Raster::new(arrays, document, patch, faces, size).compare(&image, &mut tally);
            }
            Ok(None) => {}
            Err(error) => tally.unreadable = Some(error),
        }
        tally
    });
    report(document, &tallies, verdicts);
    let read: Vec<Option<Sides>> = tallies.iter_mut().map(|t| t.sides.take()).collect();
    sides::check(document, &read, verdicts);
}

fn report(document: &Document, tallies: &[Tally], verdicts: &mut Verdicts) {
    let first = |pick: fn(&Tally) -> Option<&String>| {
        let mut bad = tallies
            .iter()
            .enumerate()
            .filter(|(_, t)| pick(t).is_some());
        let (id, tally) = bad.next()?;
        let count = 1 + bad.count();
        Some(format!(
            "{count}; {}: {}",
            document.patches[id].image,
            pick(tally)?
        ))
    };
    let mut sentence = |name: &str, found: Option<String>| {
        verdicts.note(name, found.is_none(), found.unwrap_or_default());
    };
    sentence("images can be read", first(|t| t.unreadable.as_ref()));
    sentence(
        "images keep the contract's layout",
        first(|t| t.layout.as_ref()),
    );
    sentence("images describe themselves", first(|t| t.text.as_ref()));
    let sum = |pick: fn(&Tally) -> usize| tallies.iter().map(pick).sum::<usize>();
    let tested = sum(|t| t.tested);
    let mut count = |name: &str, pick: fn(&Tally) -> usize, of: &str| {
        let bad = sum(pick);
        verdicts.note(name, bad == 0, format!("{bad}{of}"));
    };
    let of = format!(" of {tested}");
    count("image sizes as stated", |t| usize::from(t.wrong_size), "");
    count("images finite everywhere", |t| t.infinite, "");
    count("texels inside a patch are covered", |t| t.uncovered, &of);
    count(
        "texels outside every face are not marked",
        |t| t.marked_outside,
        "",
    );
    count("the mask is 0 or 1", |t| t.neither, "");
    count("texels are covered at most once", |t| t.twice, &of);
    let far = tallies.iter().map(|t| t.far).fold(0.0, f64::max);
    let figure = format!("{of}; worst {far:.2e} of the diagonal");
    count("texels hold the surface point", |t| t.wrong, &figure);
    count("texels name their face", |t| t.wrong_face, &of);
    count("texels hold a unit normal", |t| t.wrong_normal, &of);
    if document
        .images
        .channels
        .iter()
        .any(|c| c == "source-normal")
    {
        count(
            "texels hold a unit source normal",
            |t| t.wrong_source_normal,
            "",
        );
    }
    count("texels hold the log scale", |t| t.wrong_log_scale, &of);
    count("dilated texels stay on the patch", |t| t.wild, "");
    let mut beyond = Worst::default();
    for tally in tallies {
        beyond.see(tally.beyond.0);
    }
    verdicts.note(
        "patches lie inside their images",
        beyond.0 < 1e-6,
        format!("{:.3e} texels outside", beyond.0),
    );
    verdicts.note(
        "images are fine enough to be tested",
        tested >= 16 * tallies.len(),
        format!("{tested} texels tested"),
    );
}

/// Reads an image; `None` where its size is not the stated one.
fn read(path: &Path, patch: &Patch, tally: &mut Tally) -> Result<Option<Image>, String> {
    match exr::read(path, [patch.width, patch.height])? {
        Read::WrongSize(_) => {
            tally.wrong_size = true;
            Ok(None)
        }
        Read::Image { image, layout } => {
            tally.layout = layout;
            Ok(Some(*image))
        }
    }
}

/// What is wrong with the text attribute.
fn check_text(text: Option<&str>, patch: &Patch, document: &Document) -> Option<String> {
    let Some(text) = text else {
        return document
            .is_generated()
            .then(|| "has no text attribute affineAtlas".to_owned());
    };
    let value: serde_json::Value = match serde_json::from_str(text) {
        Ok(value) => value,
        Err(error) => return Some(format!("affineAtlas is no JSON: {error}")),
    };
    if ![1, 2]
        .map(serde_json::Value::from)
        .contains(&value["version"])
    {
        return Some(format!("affineAtlas has version {}", value["version"]));
    }
    if value["patch"].as_u64() != Some(patch.id as u64) {
        return Some(format!("affineAtlas says patch {}", value["patch"]));
    }
    let matrix: Option<[[f64; 3]; 2]> =
        serde_json::from_value(value["texel_to_patch"].clone()).ok();
    if matrix != Some(patch.texel_to_patch) {
        return Some("affineAtlas has another texel_to_patch".to_owned());
    }
    // What else it may say of its surroundings must be what `atlas.json` says.
    let source = &document.source;
    for (key, hash) in [
        ("source_blake3", &source.blake3),
        ("config_blake3", &source.config_blake3),
    ] {
        if value[key].as_str().is_some_and(|said| said != hash) {
            return Some(format!("affineAtlas has another {key}"));
        }
    }
    let origin = value.get("image_origin").cloned();
    if origin.is_some_and(|said| {
        serde_json::from_value::<Point3>(said).ok() != Some(document.image_origin)
    }) {
        return Some("affineAtlas has another image_origin".to_owned());
    }
    None
}

/// A patch drawn onto its texels.
struct Raster<'a> {
    arrays: &'a Arrays,
    patch: &'a Patch,
    faces: &'a [u32],
    origin: Point3,
    size: f64,
}

impl<'a> Raster<'a> {
    fn new(
        arrays: &'a Arrays,
        document: &'a Document,
        patch: &'a Patch,
        faces: &'a [u32],
        size: f64,
    ) -> Self {
        Self {
            arrays,
            patch,
            faces,
            origin: document.image_origin,
            size,
        }
    }

    /// Patch coordinates to texel coordinates in which texels are sampled at integers.
    fn to_texel(&self) -> Option<impl Fn(Point2) -> Point2 + use<>> {
        let [[a, b, x], [c, d, y]] = self.patch.texel_to_patch;
        let half = if self.patch.domain == "flat" {
            0.5
        } else {
            0.0
        };
        let det = a * d - b * c;
        (det != 0.0 && det.is_finite()).then_some(move |p: Point2| {
            let (u, v) = (p[0] - x, p[1] - y);
            [(d * u - b * v) / det - half, (a * v - c * u) / det - half]
        })
    }

    fn compare(&self, image: &Image, tally: &mut Tally) {
        let (width, height) = (self.patch.width, self.patch.height);
        let channels = image.rgb.iter().chain(image.normal.iter().flatten());
        for channel in channels.chain(&image.log_scale).chain([&image.alpha]) {
            tally.infinite += channel.iter().filter(|x| !x.is_finite()).count();
        }
        tally.neither = image
            .alpha
            .iter()
            .filter(|a| **a != 0.0 && **a != 1.0)
            .count();
        if self.patch.domain != "flat" {
            tally.uncovered += image.alpha.iter().filter(|a| **a < 0.5).count();
        }
        let Some(to_texel) = self.to_texel() else {
            tally.layout = Some("its texel_to_patch cannot be inverted".to_owned());
            return;
        };
        let mut owner = vec![0u8; width * height];
        let mut touched = vec![false; width * height];
        // Texels on the border of a block lie at grid corners.
        let ends = if self.patch.domain == "flat" {
            [-0.5, width as f64 - 0.5, height as f64 - 0.5]
        } else {
            [0.0, width as f64 - 1.0, height as f64 - 1.0]
        };
        for f in self.faces {
            let t = self.arrays.patch_uv[*f as usize].map(&to_texel);
            for p in t {
                for (i, end) in [ends[1], ends[2]].into_iter().enumerate() {
                    tally.beyond.see((ends[0] - p[i]).max(p[i] - end).max(0.0));
                }
            }
            self.draw(*f, t, image, &mut owner, &mut touched, tally);
            if tally.tested > 2 * width * height {
                break;
            }
        }
        tally.twice = owner.iter().filter(|n| **n > 1).count();
        let marked = image.alpha.iter().zip(&touched);
        tally.marked_outside = marked.filter(|(a, t)| **a >= 0.5 && !**t).count();
        self.check_dilation(image, tally);
    }

    /// Every texel that a face holds.
    fn draw(
        &self,
        f: u32,
        t: [Point2; 3],
        image: &Image,
        owner: &mut [u8],
        touched: &mut [bool],
        tally: &mut Tally,
    ) {
        let (width, height) = (self.patch.width, self.patch.height);
        let det =
            (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
        if det.is_nan() || det.abs() < 1e-14 || width == 0 || height == 0 {
            return;
        }
        let ys = t.map(|p| p[1]);
        let top = (ys[0].min(ys[1]).min(ys[2]) - BORDER).ceil().max(0.0);
        let bottom = (ys[0].max(ys[1]).max(ys[2]) + BORDER)
            .floor()
            .min(height as f64 - 1.0);
        if top.is_nan() || bottom.is_nan() || bottom < top {
            return;
        }
        // Barycentric coordinate k is constant[k] + across[k]·x + down[k]·y about the first corner, to which
        // the second and third belong; its gradient is 1 / (distance of corner k from its opposite edge).
        let gradient = |p: Point2, q: Point2| [-(q[1] - p[1]) / det, (q[0] - p[0]) / det];
        let gradients = [
            gradient(t[1], t[2]),
            gradient(t[2], t[0]),
            gradient(t[0], t[1]),
        ];
        let at = |x: f64, y: f64| -> [f64; 3] {
            let (x, y) = (x - t[0][0], y - t[0][1]);
            let b = gradients[1][0] * x + gradients[1][1] * y;
            let c = gradients[2][0] * x + gradients[2][1] * y;
            [1.0 - b - c, b, c]
        };
        let slack = gradients.map(|g| BORDER * distance2(g, [0.0; 2]));
        let corners = self.arrays.triangle(f as usize);
        for row in top as usize..=bottom as usize {
            let (mut from, mut to) = (0.0f64, width as f64 - 1.0);
            let start = at(0.0, row as f64);
            for k in 0..3 {
                let room = start[k] + slack[k];
                let slope = gradients[k][0];
                if slope > 0.0 {
                    from = from.max(-room / slope);
                } else if slope < 0.0 {
                    to = to.min(room / -slope);
                } else if room < 0.0 {
                    to = -1.0;
                }
            }
            let (from, to) = (from.ceil(), to.floor());
            if from.is_nan() || to.is_nan() || to < from {
                continue;
            }
            for column in from as usize..=to as usize {
                let texel = row * width + column;
                touched[texel] = true;
                let w = at(column as f64, row as f64);
                if w.iter().all(|w| *w > STRICTLY_INSIDE) {
                    owner[texel] = owner[texel].saturating_add(1);
                    self.test(f, texel, w, corners, image, tally);
                }
            }
        }
    }

    /// One texel strictly inside a face.
    fn test(
        &self,
        f: u32,
        texel: usize,
        w: [f64; 3],
        corners: [Point3; 3],
        image: &Image,
        tally: &mut Tally,
    ) {
        tally.tested += 1;
        // Written so that a NaN in the mask is uncovered.
        let covered = image.alpha[texel] >= 0.5;
        tally.uncovered += usize::from(!covered);
        let want = mix3(corners, w);
        let gap: Point3 =
            std::array::from_fn(|i| f64::from(image.rgb[i][texel]) + self.origin[i] - want[i]);
        let gap = norm3(gap) / self.size;
        let near = gap <= TEXEL_TOLERANCE;
        tally.wrong += usize::from(!near);
        tally.far = if gap.is_nan() {
            f64::INFINITY
        } else {
            tally.far.max(gap)
        };
        if let Some(face) = &image.face {
            tally.wrong_face += usize::from(face[texel] != f);
        }
        if let Some(normal) = &image.normal {
            let unit = channels::is_unit(normal, texel, image.half_normals);
            tally.wrong_normal += usize::from(!unit);
        }
        if let Some(log_scale) = &image.log_scale {
            let u = self.arrays.faces[f as usize].map(|v| self.arrays.log_scale[v as usize]);
            let want: f64 = (0..3).map(|k| w[k] * u[k]).sum();
            let error = (f64::from(log_scale[texel]) - want).abs();
            let near = error <= 1e-4 * (1.0 + want.abs());
            tally.wrong_log_scale += usize::from(!near);
        }
    }

    /// Outside the patch values come from its border, so they stay within what the patch holds.
    fn check_dilation(&self, image: &Image, tally: &mut Tally) {
        let slack = (TEXEL_TOLERANCE * self.size) as f32;
        for channel in &image.rgb {
            let covered = channel.iter().zip(&image.alpha).filter(|(_, a)| **a >= 0.5);
            let (low, high) = covered.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), (x, _)| {
                (l.min(*x), h.max(*x))
            });
            let outside = channel.iter().zip(&image.alpha).filter(|(_, a)| **a < 0.5);
            tally.wild += outside
                .filter(|(x, _)| **x < low - slack || **x > high + slack)
                .count();
        }
    }
}
