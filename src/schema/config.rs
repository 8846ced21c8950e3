//! The schema of `config.toml`, so that editors complete and check it.

use super::DRAFT;
use crate::config::keys::{self, KEYS, Key, Kind};
use crate::config::scope::OF_THE_RUN;
use crate::config::{COMMENTED_DEFAULT, Limit};
use serde_json::{Map, Value, json};

/// A curvature as text: a number, a fraction, or an angle in radians.
const CURVATURE_TEXT: &str =
    r"^\s*[+-]?(\d+\s*/\s*[+-]?\d+|(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?(\s*rad)?)\s*$";

/// The schema of a configuration.
#[must_use]
pub fn config() -> Value {
    let words = Words::read();
    let mut root = object("Configuration of affine-atlas");
    for (key, description) in KEYS.iter().zip(&words.keys) {
        place(&mut root, key, description);
    }
    for (section, words) in words.sections {
        if let Some(entry) = root["properties"].get_mut(section) {
            entry["description"] = words;
        }
    }
    let settings = settings_of_assets(&root);
    if let Some(Value::Object(entries)) = root.pointer_mut("/properties/asset/items/properties") {
        entries.extend(settings);
    }
    root["$schema"] = DRAFT.into();
    root["title"] = "config.toml of affine-atlas".into();
    root
}

/// What an `[[asset]]` table may hold beside what says for which meshes it is: all that does not concern the whole run.
fn settings_of_assets(root: &Value) -> Map<String, Value> {
    let mut settings = root["properties"].as_object().cloned().unwrap_or_default();
    for path in OF_THE_RUN {
        match path.split_once('.') {
            None => {
                settings.remove(path);
            }
            Some((section, key)) => {
                let members = settings.get_mut(section);
                let members = members.and_then(|s| s.get_mut("properties")?.as_object_mut());
                if let Some(members) = members {
                    members.remove(key);
                }
            }
        }
    }
    settings
}

/// A table without keys that are not listed.
fn object(description: &str) -> Value {
    json!({
        "type": "object",
        "description": description,
        "properties": {},
        "additionalProperties": false,
    })
}

/// Puts a key where it belongs; tables on the way are made.
fn place(root: &mut Value, key: &Key, description: &str) {
    let mut table = root;
    let mut parts = key.path.split('.').peekable();
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            table["properties"][part] = schema(key, description);
            if key.default == "required" {
                let required = table
                    .as_object_mut()
                    .map(|t| t.entry("required").or_insert(json!([])));
                if let Some(Value::Array(names)) = required {
                    names.push(part.into());
                }
            }
            return;
        }
        table = match part.strip_suffix("[]") {
            Some(list) => &mut table["properties"][list]["items"],
            None => {
                let entry = &mut table["properties"][part];
                if entry.is_null() {
                    *entry = object("");
                }
                entry
            }
        };
    }
}

fn schema(key: &Key, description: &str) -> Value {
    let mut schema = of_kind(key.kind);
    let unit = match key.unit {
        "" => String::new(),
        unit => format!(" Unit: {unit}."),
    };
    if let Some(entries) = schema.as_object_mut() {
        entries.insert("description".into(), format!("{description}{unit}").into());
        if let Some(default) = default_of(key) {
            entries.insert("default".into(), default);
        }
    }
    schema
}

fn of_kind(kind: Kind) -> Value {
    let curvature = || {
        json!([
            { "type": "number" },
            { "type": "string", "pattern": CURVATURE_TEXT },
        ])
    };
    match kind {
        Kind::Bool => json!({ "type": "boolean" }),
        Kind::Integer { min, max } => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Kind::Limit(max) => json!({ "anyOf": [
            { "enum": Limit::WORDS },
            { "type": "integer", "minimum": 1, "maximum": max },
        ]}),
        Kind::Number { min, max } => json!({ "type": "number", "minimum": min, "maximum": max }),
        Kind::ZeroOr { min, max } => json!({ "anyOf": [
            { "const": 0 },
            { "type": "number", "minimum": min, "maximum": max },
        ]}),
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Text => json!({ "type": "string" }),
        Kind::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        Kind::Choices(words) => json!({ "type": "array", "items": { "enum": words } }),
        Kind::Curvature => json!({ "anyOf": curvature() }),
        // What a text stands for is checked when it is read.
        Kind::CurvatureIn { min, below } => json!({ "anyOf": [
            { "type": "number", "minimum": min, "exclusiveMaximum": below },
            { "type": "string", "pattern": CURVATURE_TEXT },
        ]}),
        Kind::Curvatures => json!({ "type": "array", "items": { "anyOf": curvature() } }),
        Kind::Point => json!({
            "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3,
        }),
        Kind::Rows => {
            let row = json!({ "type": "array", "items": of_kind(keys::VERTEX), "minItems": 2 });
            json!({ "type": "array", "items": row })
        }
        Kind::Tables(_) => json!({ "type": "array", "items": object("") }),
    }
}

/// The default of a key as JSON.
fn default_of(key: &Key) -> Option<Value> {
    if !key.has_default() {
        return None;
    }
    let table: toml::Table = format!("value = {}", key.default).parse().ok()?;
    serde_json::to_value(table.get("value")?).ok()
}

/// What the commented configuration says of sections and keys.
struct Words {
    /// By key, in the order of the table.
    keys: Vec<String>,
    sections: Map<String, Value>,
}

impl Words {
    /// Reads the comments. Those of a key end with the line that states type, range and default.
    fn read() -> Words {
        let mut rest = KEYS.iter();
        let mut wanted = rest.next();
        let mut keys = Vec::with_capacity(KEYS.len());
        let mut sections = Map::new();
        let mut block: Vec<&str> = Vec::new();
        let mut title = "";
        for line in COMMENTED_DEFAULT.lines() {
            if let Some(words) = line.strip_prefix("# ---- ") {
                title = words.trim_end_matches('-').trim_end();
                block.clear();
            } else if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
                let words = std::iter::once(title)
                    .chain(block.drain(..))
                    .collect::<Vec<_>>();
                sections.insert(name.to_owned(), words.join(". ").into());
            } else if let Some(words) = line.strip_prefix("# ") {
                if wanted.is_some_and(|key| key.describe() == words) {
                    keys.push(block.join(" "));
                    block.clear();
                    wanted = rest.next();
                } else {
                    block.push(words);
                }
            } else {
                block.clear();
            }
        }
        keys.resize(KEYS.len(), String::new());
        Words { keys, sections }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_and_section_is_described() {
        let schema = config();
        let text = |pointer: &str| {
            let value = schema.pointer(pointer);
            value.and_then(Value::as_str).unwrap_or_default().to_owned()
        };
        for key in KEYS {
            let path = key
                .path
                .replace("[].", "/items/properties/")
                .replace('.', "/properties/");
            let words = text(&format!("/properties/{path}/description"));
            assert!(words.len() > 10, "{}: {words:?}", key.path);
        }
        assert!(
            text("/properties/flow/properties/scheme/description").starts_with("How log scales")
        );
        assert!(text("/properties/cones/description").starts_with("where the curvature goes"));
        assert!(text("/properties/run/description").contains("never changes a result"));
    }

    #[test]
    fn tables_of_assets_hold_what_is_not_for_the_whole_run() {
        let schema = config();
        let table = &schema["properties"]["asset"]["items"]["properties"];
        assert_eq!(table["flow"], schema["properties"]["flow"]);
        assert_eq!(table["glob"]["type"], "string");
        assert!(table["run"]["properties"]["memory"].is_object());
        assert!(table["output"]["properties"]["component_folders"].is_object());
        for pointer in [
            "/asset",
            "/input",
            "/output/properties/folder",
            "/run/properties/jobs",
            "/run/properties/total_memory",
        ] {
            assert!(table.pointer(pointer).is_none(), "{pointer}");
        }
    }

    #[test]
    fn defaults_and_ranges_are_there() {
        let schema = config();
        let scheme = &schema["properties"]["flow"]["properties"]["scheme"];
        assert_eq!(scheme["default"], "vertex-scaling");
        assert_eq!(scheme["enum"].as_array().unwrap().len(), 4);
        let side = &schema["properties"]["patches"]["properties"]["min_side"];
        assert_eq!(
            (&side["minimum"], &side["maximum"]),
            (&json!(8), &json!(4096))
        );
        let list = &schema["properties"]["cones"]["properties"]["list"]["items"];
        assert_eq!(list["required"], json!(["curvature"]));
        assert_eq!(list["additionalProperties"], false);
    }
}
