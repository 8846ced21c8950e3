//! What a user may write in a configuration: every key with type, unit, range and default.
//!
//! The table serves three ends: unknown keys and values are refused with the nearest known one,
//! ranges are checked where the value was written, and `config.toml` states for each key exactly
//! the line that [`Key::describe`] gives (a test asserts it).

use super::presets;
use crate::grid::MOST_CELLS;
use std::fmt;

/// What values a key takes. Bounds are inclusive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// `true` or `false`.
    Bool,
    /// An integer in a range.
    Integer {
        /// Least value.
        min: i64,
        /// Greatest value.
        max: i64,
    },
    /// `"auto"`, `"off"`, or an integer from 1 to this.
    Limit(i64),
    /// A finite number in a range; integers are accepted.
    Number {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// Zero, which means something of its own, or a finite number in a range.
    ZeroOr {
        /// Least value beside zero.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// One word of a list.
    Choice(&'static [&'static str]),
    /// Text, for example a path.
    Text,
    /// A list of texts.
    Texts,
    /// A list of words of a list.
    Choices(&'static [&'static str]),
    /// A curvature in multiples of π: a number, or a fraction as text.
    Curvature,
    /// The same, held to a range of multiples of π.
    CurvatureIn {
        /// Least value.
        min: f64,
        /// What every value lies below.
        below: f64,
    },
    /// A list of curvatures.
    Curvatures,
    /// Three coordinates.
    Point,
    /// A list of lists of vertices of the input file.
    Rows,
    /// A list of tables; their keys are listed as `key[].name`. Holds an example of one.
    Tables(&'static str),
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool => write!(f, "true or false"),
            Self::Integer { min, max } => write!(f, "an integer from {min} to {max}"),
            Self::Limit(max) => write!(f, "\"auto\", \"off\", or an integer from 1 to {max}"),
            Self::Number { min, max } => write!(f, "a number from {min:?} to {max:?}"),
            Self::ZeroOr { min, max } => write!(f, "0.0, or a number from {min:?} to {max:?}"),
            Self::Choice(words) | Self::Choices(words) => {
                if matches!(self, Self::Choices(_)) {
                    write!(f, "a list of ")?;
                }
                for (i, word) in words.iter().enumerate() {
                    match i {
                        0 => {}
                        _ if i + 1 == words.len() => write!(f, " or ")?,
                        _ => write!(f, ", ")?,
                    }
                    write!(f, "\"{word}\"")?;
                }
                Ok(())
            }
            Self::Text => write!(f, "a text in quotes"),
            Self::Texts => write!(f, "a list of texts in quotes"),
            Self::Curvature => write!(f, "a number or a fraction such as \"1/2\""),
            Self::CurvatureIn { min, below } => write!(
                f,
                "a number or a fraction such as \"1/2\", from {min} to below {below}"
            ),
            Self::Curvatures => {
                write!(
                    f,
                    "a list of numbers or fractions such as [\"1/2\", \"-8\"]"
                )
            }
            Self::Rows => write!(f, "a list of lists of vertices such as [[0, 1, 2], [7, 8]]"),
            Self::Point => write!(f, "three numbers such as [0.0, 1.5, -2.0]"),
            Self::Tables(example) => write!(f, "a list of tables such as {example}"),
        }
    }
}

/// Keys of earlier versions, each with what is so in its stead.
const REMOVED: [(&str, &str); 2] = [
    (
        "cones.objective",
        "cones are chosen by one measure that weighs growing and shrinking alike and is near the best of both that there were",
    ),
    (
        "patches.shared_lattice",
        "images.domain = \"grid\" has one lattice on the whole surface, across the cut and around handles too",
    ),
];

/// Words of earlier versions: key, word, and what is so in its stead.
const REMOVED_WORDS: [(&str, &str, &str); 1] = [(
    "images.domain",
    "rectangle",
    "images.domain = \"grid\" samples rectangles of one grid on the whole surface, whose sides hold the same points",
)];

/// What is so in the stead of a word that a key had in earlier versions.
pub fn removed_word(path: &str, word: &str) -> Option<&'static str> {
    let found = REMOVED_WORDS
        .iter()
        .find(|(key, old, _)| *key == path && *old == word);
    found.map(|(_, _, instead)| *instead)
}

/// What is so in the stead of a key that earlier versions had.
pub fn removed(path: &str) -> Option<&'static str> {
    let found = REMOVED.iter().find(|(key, _)| *key == path);
    found.map(|(_, instead)| *instead)
}

/// One key of the configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Section and name, `flow.scheme`; keys of listed tables are `cones.list[].vertex`, keys above all sections a name alone.
    pub path: &'static str,
    /// Type and range.
    pub kind: Kind,
    /// Unit of the value; empty where it has none.
    pub unit: &'static str,
    /// Default as written in TOML; the words `absent` where the key may be left out and
    /// `required` where it may not.
    pub default: &'static str,
}

impl Key {
    /// Type, range, unit and default in one line, as `config.toml` states them.
    #[must_use]
    pub fn describe(&self) -> String {
        let unit = match self.unit {
            "" => String::new(),
            unit => format!(", in {unit}"),
        };
        format!("{}{unit}; default {}", self.kind, self.default)
    }

    /// Whether the key has a value in the default configuration.
    #[must_use]
    pub fn has_default(&self) -> bool {
        !matches!(self.default, "absent" | "required")
    }
}

const fn key(path: &'static str, kind: Kind, unit: &'static str, default: &'static str) -> Key {
    Key {
        path,
        kind,
        unit,
        default,
    }
}

const ASSET_EXAMPLE: &str = "[{ glob = \"scans/*.ply\", flow.scheme = \"thurston\" }]";
const CONE_EXAMPLE: &str = "[{ vertex = 0, curvature = \"1/2\" }]";
const BOUNDARY_EXAMPLE: &str = "[{ vertex = 0, curvature = \"1/3\" }]";
const CORNER_EXAMPLE: &str = "[{ vertex = 0 }, { vertex = 7 }, { vertex = 63 }, { vertex = 56 }]";
/// Vertex indices are stored in 32 bits and 2³²−1 means "none".
const MAX_INDEX: i64 = u32::MAX as i64 - 1;
/// The number of a vertex of the input file.
/// A vertex of the input file.
pub const VERTEX: Kind = Kind::Integer {
    min: 0,
    max: MAX_INDEX,
};

/// Every key, in the order of `config.toml`.
pub const KEYS: &[Key] = &[
    key("preset", Kind::Choice(presets::WORDS), "", "absent"),
    key("asset", Kind::Tables(ASSET_EXAMPLE), "", "absent"),
    key("asset[].glob", Kind::Text, "", "absent"),
    key("asset[].path", Kind::Text, "", "absent"),
    key("input.paths", Kind::Texts, "", "[]"),
    key("output.folder", Kind::Text, "", "\"affine-atlas-out\""),
    key(
        "output.component_folders",
        Kind::Integer {
            min: 0,
            max: 1_000_000,
        },
        "components",
        "256",
    ),
    key(
        "limits.max_vertices",
        Kind::Integer {
            min: 3,
            max: MAX_INDEX,
        },
        "vertices",
        "50000000",
    ),
    key(
        "limits.max_faces",
        Kind::Integer {
            min: 1,
            max: MAX_INDEX,
        },
        "triangles",
        "100000000",
    ),
    key(
        "limits.max_file_bytes",
        Kind::Integer {
            min: 1,
            max: 1 << 40,
        },
        "bytes",
        "8589934592",
    ),
    key("repair.weld", Kind::Bool, "", "true"),
    key(
        "repair.weld_tolerance",
        Kind::ZeroOr {
            min: 1e-12,
            max: 0.1,
        },
        "diagonals of the bounding box",
        "0.0",
    ),
    key("repair.strict", Kind::Bool, "", "false"),
    key(
        "repair.max_components",
        Kind::Integer {
            min: 1,
            max: 1_000_000,
        },
        "components",
        "20000",
    ),
    key(
        "cones.strategy",
        Kind::Choice(&["auto", "listed", "field", "single", "spread", "none"]),
        "",
        "\"auto\"",
    ),
    key("cones.list", Kind::Tables(CONE_EXAMPLE), "", "[]"),
    key(
        "cones.list[].vertex",
        VERTEX,
        "vertices of the input file, counted from 0",
        "absent",
    ),
    key("cones.list[].point", Kind::Point, "source units", "absent"),
    key(
        "cones.list[].curvature",
        Kind::Curvature,
        "multiples of π",
        "required",
    ),
    key("cones.file", Kind::Text, "", "absent"),
    key(
        "cones.file_first_vertex",
        Kind::Integer { min: 0, max: 1 },
        "",
        "0",
    ),
    key(
        "cones.count",
        Kind::Integer {
            min: 1,
            max: 1_000_000,
        },
        "cones",
        "absent",
    ),
    key(
        "cones.log_scale_bound",
        Kind::Number {
            min: 0.01,
            max: 50.0,
        },
        "natural logarithms of length",
        "absent",
    ),
    key(
        "cones.quantum",
        Kind::CurvatureIn {
            min: 0.0,
            below: 2.0,
        },
        "multiples of π",
        "0",
    ),
    key(
        "cones.min_curvature",
        Kind::CurvatureIn {
            min: -100.0,
            below: 0.0,
        },
        "multiples of π",
        "-4",
    ),
    key(
        "cones.max_curvature",
        Kind::CurvatureIn {
            min: 0.0,
            below: 2.0,
        },
        "multiples of π",
        "\"9/8\"",
    ),
    key(
        "cones.boundary_distance",
        Kind::Number { min: 0.0, max: 1.0 },
        "square roots of the component's area",
        "0.0",
    ),
    key(
        "cones.curvature",
        Kind::Curvature,
        "multiples of π",
        "absent",
    ),
    key(
        "cones.vertex",
        VERTEX,
        "vertices of the input file, counted from 0",
        "absent",
    ),
    key(
        "boundary.condition",
        Kind::Choice(&["free", "uniform", "corners", "prescribed"]),
        "",
        "absent",
    ),
    key("boundary.totals", Kind::Curvatures, "multiples of π", "[]"),
    key("boundary.list", Kind::Tables(BOUNDARY_EXAMPLE), "", "[]"),
    key(
        "boundary.list[].vertex",
        VERTEX,
        "vertices of the input file, counted from 0",
        "absent",
    ),
    key(
        "boundary.list[].point",
        Kind::Point,
        "source units",
        "absent",
    ),
    key(
        "boundary.list[].curvature",
        Kind::Curvature,
        "multiples of π",
        "required",
    ),
    key("boundary.corners", Kind::Tables(CORNER_EXAMPLE), "", "[]"),
    key(
        "boundary.corners[].vertex",
        VERTEX,
        "vertices of the input file, counted from 0",
        "absent",
    ),
    key(
        "boundary.corners[].point",
        Kind::Point,
        "source units",
        "absent",
    ),
    key(
        "features.angle",
        Kind::Number {
            min: 1.0,
            max: 180.0,
        },
        "degrees",
        "40.0",
    ),
    key("features.materials", Kind::Bool, "", "false"),
    key(
        "features.list",
        Kind::Rows,
        "vertices of the input file, counted from 0",
        "[]",
    ),
    key("features.file", Kind::Text, "", "absent"),
    key(
        "features.file_first_vertex",
        Kind::Integer { min: 0, max: 1 },
        "",
        "0",
    ),
    key(
        "features.curvature",
        Kind::Number {
            min: 0.0,
            max: 100.0,
        },
        "",
        "0.003",
    ),
    key("connectivity.enabled", Kind::Bool, "", "absent"),
    key(
        "connectivity.rings",
        Kind::Integer { min: 0, max: 3 },
        "rings",
        "2",
    ),
    key(
        "connectivity.ring_valence",
        Kind::Integer { min: 3, max: 8 },
        "edges",
        "6",
    ),
    key(
        "connectivity.flat_vertex_valence",
        Kind::Integer { min: 0, max: 4 },
        "edges",
        "0",
    ),
    key(
        "flow.scheme",
        Kind::Choice(&[
            "vertex-scaling",
            "tangential",
            "thurston",
            "inversive-distance",
        ]),
        "",
        "\"vertex-scaling\"",
    ),
    key("flow.delaunay", Kind::Bool, "", "true"),
    key(
        "flow.holonomy",
        Kind::Choice(&["free", "quarter-turns"]),
        "",
        "\"free\"",
    ),
    key(
        "flow.conformality",
        Kind::Number { min: 0.0, max: 1e6 },
        "",
        "0.1",
    ),
    key(
        "flow.solver",
        Kind::Choice(&["newton", "gradient"]),
        "",
        "\"newton\"",
    ),
    key(
        "flow.curvature_tolerance",
        Kind::Number {
            min: 1e-13,
            max: 1e-9,
        },
        "radians",
        "1e-10",
    ),
    key(
        "flow.max_newton_steps",
        Kind::Integer {
            min: 1,
            max: 100_000,
        },
        "steps",
        "200",
    ),
    key(
        "flow.max_gradient_steps",
        Kind::Integer {
            min: 1,
            max: 1_000_000_000,
        },
        "steps",
        "1000000",
    ),
    key(
        "patches.log_scale_range",
        Kind::Number {
            min: 0.01,
            max: 50.0,
        },
        "natural logarithms of length",
        "2.0",
    ),
    key(
        "patches.texel_budget",
        Kind::Integer {
            min: 4096,
            max: 1 << 30,
        },
        "texels",
        "262144",
    ),
    key(
        "patches.min_side",
        Kind::Integer { min: 8, max: 4096 },
        "texels",
        "16",
    ),
    key(
        "patches.padding",
        Kind::Integer { min: 0, max: 64 },
        "texels",
        "2",
    ),
    key(
        "patches.max_count",
        Kind::Integer {
            min: 1,
            max: 1_000_000,
        },
        "patches",
        "absent",
    ),
    key(
        "patches.packed_side",
        Kind::Integer { min: 64, max: 8192 },
        "texels",
        "absent",
    ),
    key(
        "grid.cells",
        Kind::Integer {
            min: 1,
            max: MOST_CELLS as i64,
        },
        "cells",
        "2000",
    ),
    key(
        "grid.cell_size",
        Kind::Number {
            min: 1e-30,
            max: 1e30,
        },
        "source units",
        "absent",
    ),
    key(
        "grid.density",
        Kind::Choice(&["uniform", "curvature"]),
        "",
        "\"uniform\"",
    ),
    key(
        "grid.samples_per_cell",
        Kind::Integer { min: 1, max: 64 },
        "texels",
        "8",
    ),
    key(
        "images.domain",
        Kind::Choice(&["grid", "flat"]),
        "",
        "absent",
    ),
    key(
        "images.channels",
        Kind::Choices(&[
            "normal",
            "face",
            "log-scale",
            "source-normal",
            "color",
            "texcoord",
            "material",
        ]),
        "",
        "[\"normal\", \"face\", \"log-scale\"]",
    ),
    key(
        "images.normal_precision",
        Kind::Choice(&["float", "half"]),
        "",
        "\"float\"",
    ),
    key("pictures.enabled", Kind::Bool, "", "true"),
    key(
        "pictures.size",
        Kind::Integer { min: 64, max: 8192 },
        "pixels",
        "1024",
    ),
    key("report.enabled", Kind::Bool, "", "true"),
    key(
        "report.max_faces",
        Kind::Integer {
            min: 0,
            max: 4_294_967_294,
        },
        "faces",
        "500000",
    ),
    key(
        "report.max_components",
        Kind::Integer {
            min: 0,
            max: 1_000_000,
        },
        "components",
        "16",
    ),
    key(
        "report.distortion_warning",
        Kind::Number {
            min: 0.0,
            max: 1000.0,
        },
        "natural logarithms of length",
        "0.5",
    ),
    key(
        "run.jobs",
        Kind::Integer { min: 0, max: 1024 },
        "meshes",
        "0",
    ),
    key(
        "run.threads",
        Kind::Integer { min: 0, max: 1024 },
        "threads",
        "0",
    ),
    key(
        "run.timeout",
        Kind::Limit(31_536_000),
        "seconds",
        "\"auto\"",
    ),
    key("run.memory", Kind::Limit(1 << 44), "bytes", "\"auto\""),
    key(
        "run.total_memory",
        Kind::Integer {
            min: 0,
            max: 1 << 48,
        },
        "bytes",
        "0",
    ),
];

/// The key of that path.
#[must_use]
pub fn find(path: &str) -> Option<&'static Key> {
    KEYS.iter().find(|key| key.path == path)
}

/// Whether keys begin with `path.`, so that `path` is a section (or a listed table).
#[must_use]
pub fn is_section(path: &str) -> bool {
    members(path).next().is_some()
}

/// The keys directly in a section, by their full paths; those above all sections are not among them.
pub fn members(section: &str) -> impl Iterator<Item = &'static Key> + use<'_> {
    KEYS.iter()
        .filter(move |key| key.path.rsplit_once('.').is_some_and(|(s, _)| s == section))
}

/// The keys that stand above all sections.
pub fn above_sections() -> impl Iterator<Item = &'static str> {
    (KEYS.iter().map(|key| key.path)).filter(|path| !path.contains('.'))
}

/// Names of all sections, in the order of `config.toml`.
#[must_use]
pub fn sections() -> Vec<&'static str> {
    let mut names = Vec::new();
    for name in KEYS
        .iter()
        .filter_map(|key| Some(key.path.split_once('.')?.0))
    {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The known key or section that `path` was probably meant to be.
///
/// A key is compared with its neighbours in the same section first, then with keys of the same
/// or a similar name in other sections, then as a whole path; a section with the sections.
/// Nothing is returned where nothing is similar.
#[must_use]
pub fn nearest(path: &str) -> Option<&'static str> {
    let Some((section, name)) = path.rsplit_once('.') else {
        return nearest_word(path, &sections()).or_else(|| nearest_last_name(path));
    };
    let neighbours: Vec<&str> = members(section).map(|key| last_name(key.path)).collect();
    if let Some(word) = nearest_word(name, &neighbours) {
        return members(section)
            .map(|key| key.path)
            .find(|path| last_name(path) == word);
    }
    let paths: Vec<&str> = KEYS.iter().map(|key| key.path).collect();
    nearest_last_name(name).or_else(|| nearest_word(path, &paths))
}

fn nearest_last_name(name: &str) -> Option<&'static str> {
    let names: Vec<&str> = KEYS.iter().map(|key| last_name(key.path)).collect();
    let word = nearest_word(name, &names)?;
    KEYS.iter()
        .map(|key| key.path)
        .find(|path| last_name(path) == word)
}

fn last_name(path: &'static str) -> &'static str {
    path.rsplit('.').next().unwrap_or(path)
}

/// The most similar of `words` (first on ties), or nothing where all differ too much.
#[must_use]
pub fn nearest_word<'w>(given: &str, words: &[&'w str]) -> Option<&'w str> {
    // Comparing costs the product of both lengths; nobody misspells a name this badly.
    if given.len() > 100 {
        return None;
    }
    let given = given.to_lowercase().replace('-', "_");
    let mut best: Option<(usize, &str)> = None;
    for &word in words {
        let known = word.to_lowercase().replace('-', "_");
        let edits = strsim::damerau_levenshtein(&given, &known);
        // A third of the letters may be wrong, two in short words.
        let allowed = (known.chars().count() / 3)
            .max(2)
            .min(known.chars().count() - 1);
        let prefix = given.len() >= 3 && known.starts_with(&given);
        if (edits <= allowed || prefix) && best.is_none_or(|(least, _)| edits < least) {
            best = Some((edits, word));
        }
    }
    best.map(|(_, word)| word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_key_in_section_other_section_and_whole() {
        assert_eq!(nearest("flow.shceme"), Some("flow.scheme"));
        assert_eq!(nearest("flow.rings"), Some("connectivity.rings"));
        assert_eq!(nearest("folw.scheme"), Some("flow.scheme"));
        assert_eq!(nearest("folw"), Some("flow"));
        assert_eq!(nearest("threads"), Some("run.threads"));
        assert_eq!(nearest("cones.list[].vertx"), Some("cones.list[].vertex"));
        assert_eq!(nearest("flow.entirely_unlike_anything"), None);
    }

    #[test]
    fn nearest_word_prefers_few_edits_and_refuses_far_ones() {
        let words = ["newton", "gradient"];
        assert_eq!(nearest_word("Newtn", &words), Some("newton"));
        assert_eq!(nearest_word("grad", &words), Some("gradient"));
        assert_eq!(nearest_word("bfgs", &words), None);
        assert_eq!(nearest_word("", &words), None);
        assert_eq!(nearest_word(&"n".repeat(1_000_000), &words), None);
    }

    #[test]
    fn paths_are_unique_and_sections_contiguous() {
        for (i, a) in KEYS.iter().enumerate() {
            assert!(KEYS[i + 1..].iter().all(|b| a.path != b.path), "{}", a.path);
        }
        let runs = KEYS.chunk_by(|a, b| a.path.split('.').next() == b.path.split('.').next());
        let above = above_sections().count();
        assert_eq!(runs.count(), above + sections().len());
        assert!(sections().iter().all(|name| is_section(name)));
    }

    #[test]
    fn kinds_read_as_prose() {
        assert_eq!(
            find("flow.solver").expect("listed").describe(),
            "\"newton\" or \"gradient\"; default \"newton\""
        );
        assert_eq!(
            find("flow.curvature_tolerance").expect("listed").describe(),
            "a number from 1e-13 to 1e-9, in radians; default 1e-10"
        );
    }
}
