//! Settings for some meshes only: the `[[asset]]` tables.

use super::Config;
use super::error::{ConfigError, Location};
use super::scope::SELECTORS;
use super::source::Source;
use std::path::Path;
use toml::de::DeTable;

/// One `[[asset]]` table.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// `glob` or `path` as written.
    pub pattern: String,
    selector: Selector,
    pub(super) settings: toml::Table,
    /// Where the table stands.
    pub at: Box<Location>,
}

#[derive(Clone, Debug, PartialEq)]
enum Selector {
    Glob(glob::Pattern),
    Path(String),
}

impl Override {
    /// Whether it is for the mesh that the user gave as `given`. A glob without a slash is compared with the file's name.
    #[must_use]
    pub fn concerns(&self, given: &Path) -> bool {
        let whole = given.to_string_lossy().replace('\\', "/");
        let whole = without_dot(&whole);
        let options = glob::MatchOptions {
            case_sensitive: true,
            require_literal_separator: true,
            require_literal_leading_dot: false,
        };
        match &self.selector {
            Selector::Path(path) => path == whole,
            Selector::Glob(glob) if glob.as_str().contains('/') => {
                glob.matches_with(whole, options)
            }
            Selector::Glob(glob) => {
                let name = given.file_name().unwrap_or_default().to_string_lossy();
                glob.matches_with(&name, options)
            }
        }
    }
}

fn without_dot(path: &str) -> &str {
    path.strip_prefix("./").unwrap_or(path)
}

/// Takes the `[[asset]]` tables out of a layer whose keys have been checked.
pub(super) fn take(
    source: &Source,
    checked: &DeTable<'_>,
    layer: &mut toml::Table,
) -> Result<Option<Vec<Override>>, ConfigError> {
    let Some(toml::Value::Array(tables)) = layer.remove("asset") else {
        return Ok(None);
    };
    let spans = checked.iter().find(|(name, _)| name.get_ref() == "asset");
    let spans = spans.and_then(|(_, value)| value.get_ref().as_array());
    let mut overrides = Vec::new();
    for (i, table) in tables.into_iter().enumerate() {
        let span = spans
            .and_then(|spans| spans.get(i))
            .map_or(0..0, |table| table.span());
        let toml::Value::Table(mut settings) = table else {
            continue; // Refused before.
        };
        let at = source.at(span);
        let [glob, path] = SELECTORS.map(|key| match settings.remove(key) {
            Some(toml::Value::String(text)) => Some(text),
            _ => None,
        });
        let (pattern, selector) = match (glob, path) {
            (Some(text), None) => {
                let glob = glob::Pattern::new(without_dot(&text));
                let glob = glob.map_err(|error| ConfigError::Refused {
                    at: at.clone(),
                    key: "asset[].glob".to_owned(),
                    reason: format!("`{text}` is no glob: {}", error.msg),
                })?;
                (text, Selector::Glob(glob))
            }
            (None, Some(text)) => {
                let path = without_dot(&text.replace('\\', "/")).to_owned();
                (text, Selector::Path(path))
            }
            (given, _) => {
                return Err(ConfigError::NotOnePattern {
                    at,
                    both: given.is_some(),
                });
            }
        };
        Config::of_table(&settings).map_err(|reason| ConfigError::Refused {
            at: at.clone(),
            key: "asset".to_owned(),
            reason,
        })?;
        overrides.push(Override {
            pattern,
            selector,
            settings,
            at,
        });
    }
    Ok(Some(overrides))
}

#[cfg(test)]
mod tests {
    use super::super::load::parse_layers;
    use super::*;
    use crate::atlas::patches::Domain;
    use crate::config::Limit;
    use crate::flow::ricci::Scheme;

    fn config_of(text: &str, set: &[&str], given: &str) -> Config {
        let set: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
        let layers = parse_layers("f", text, &set).expect("parses");
        let mine: Vec<usize> = (0..layers.overrides.len())
            .filter(|&i| layers.overrides[i].concerns(Path::new(given)))
            .collect();
        layers.config(&mine).expect("fits")
    }

    const TEXT: &str = "
[patches]
padding = 3
[[asset]]
glob = \"scans/**/*.ply\"
flow.scheme = \"thurston\"
patches.padding = 4
[[asset]]
glob = \"*.ply\"
[asset.patches]
padding = 5
min_side = 20
[[asset]]
path = \"./one.obj\"
preset = \"texture\"
run.timeout = 7
";

    #[test]
    fn later_tables_win_and_the_rest_is_kept() {
        let config = config_of(TEXT, &[], "scans/deep/a.ply");
        assert_eq!(config.flow.scheme, Scheme::Thurston);
        assert_eq!((config.patches.padding, config.patches.min_side), (5, 20));
        let config = config_of(TEXT, &[], "./scans/a.obj");
        assert_eq!(
            (config.flow.scheme, config.patches.padding),
            (Scheme::VertexScaling, 3)
        );
        let config = config_of(TEXT, &[], "one.obj");
        assert_eq!(
            (config.images.domain, config.grid.cells),
            (Some(Domain::Grid), 500)
        );
        assert_eq!(config.run.timeout, Limit::At(7));
        let other = config_of(TEXT, &[], "other/one.obj");
        assert_eq!(other.run.timeout, Limit::Auto);
    }

    #[test]
    fn set_wins_over_tables() {
        let config = config_of(TEXT, &["patches.padding=9"], "scans/a.ply");
        assert_eq!(
            (config.flow.scheme, config.patches.padding),
            (Scheme::Thurston, 9)
        );
        let config = config_of(
            TEXT,
            &["asset=[{ glob = \"*\", patches.padding = 1 }]"],
            "a.ply",
        );
        assert_eq!((config.patches.padding, config.patches.min_side), (1, 16));
    }

    #[test]
    fn tables_are_checked_like_the_rest() {
        let cases = [
            (
                "[[asset]]\nglob = \"*\"\nflow.shceme = \"thurston\"",
                "f:3:6: unknown key `flow.shceme`",
            ),
            (
                "[[asset]]\nglob = \"*\"\n[asset.flow]\nscheme = \"thurstn\"",
                "f:4:10: `flow.scheme` has no choice \"thurstn\"",
            ),
            (
                "[[asset]]\nglbo = \"*\"",
                "f:2:1: unknown key `asset[].glbo`",
            ),
            (
                "[[asset]]\nglob = 3",
                "f:2:8: `asset[].glob` takes a text in quotes, but was given the integer 3",
            ),
            (
                "[[asset]]\nflow.scheme = \"thurston\"",
                "f:1:1: an `[[asset]]` table says neither by `glob` nor by `path` which meshes it is for",
            ),
            (
                "[[asset]]\nglob = \"*\"\npath = \"a\"",
                "f:1:1: an `[[asset]]` table says both by `glob` and by `path` which meshes it is for",
            ),
            (
                "[[asset]]\nglob = \"a[\"",
                "f:1:1: `asset[].glob` is not usable: `a[` is no glob: invalid range pattern",
            ),
            (
                "[[asset]]\nglob = \"*\"\nrun.jobs = 3",
                "f:3:5: `run.jobs` concerns the whole run and not single meshes",
            ),
            (
                "[[asset]]\nglob = \"*\"\noutput.folder = \"x\"",
                "f:3:8: `output.folder` concerns the whole run and not single meshes",
            ),
            (
                "[[asset]]\nglob = \"*\"\ncones.list = [{ vertex = 1 }]",
                "f:1:1: `asset` is not usable: missing field `curvature`",
            ),
            ("asset = 3", "f:1:9: `asset` takes a list of tables"),
        ];
        for (text, message) in cases {
            let error = parse_layers("f", text, &[]).expect_err(text);
            assert!(error.to_string().starts_with(message), "{error}");
            assert!(!error.remedy().is_empty());
        }
    }
}
