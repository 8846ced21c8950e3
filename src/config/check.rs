//! Checks a parsed text against [`KEYS`](super::keys::KEYS), where spans are still known.

use super::Config;
use super::error::ConfigError;
use super::keys::{self, Kind};
use super::limit::Limit;
use super::scope::OF_THE_RUN;
use super::source::{Source, syntax};
use crate::flow::cones::PiMultiple;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

impl Config {
    /// Refuses values that no configuration text may hold, of a configuration that was made in code. One that was loaded has none.
    ///
    /// # Errors
    /// The first such value, by key, at its place in the configuration as text.
    pub fn check(&self) -> Result<(), ConfigError> {
        let text = toml::to_string(self).unwrap_or_else(|_| with_large_integers(self));
        let source = Source::new("configuration", &text);
        let table = DeTable::parse(&source.text).map_err(|e| syntax(&source, &e))?;
        check(&source, table.get_ref())
    }
}

/// The configuration as TOML, but with integers that TOML does not have.
fn with_large_integers(config: &Config) -> String {
    let value = serde_json::to_value(config).unwrap_or_default();
    let members = value.as_object().into_iter().flatten();
    let lines = members.map(|(key, value)| format!("{key} = {}\n", as_toml(value)));
    lines.collect()
}

/// A value in one line of TOML.
fn as_toml(value: &serde_json::Value) -> String {
    use serde_json::Value;
    match value {
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(as_toml).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Object(members) => {
            let members = members.iter().filter(|(_, value)| !value.is_null());
            let members = members.map(|(key, value)| format!("{key} = {}", as_toml(value)));
            format!("{{ {} }}", members.collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

/// Refuses the first key or value of the text that [`KEYS`](super::keys::KEYS) does not allow.
pub(super) fn check(source: &Source, table: &DeTable<'_>) -> Result<(), ConfigError> {
    let mut errors = Vec::new();
    check_table(source, table, "", &mut errors);
    // Tables are sorted by key; a reader fixes a file from the top.
    let first = errors
        .into_iter()
        .min_by_key(|error| error.location().map_or(0, |at| at.span.start));
    first.map_or(Ok(()), Err)
}

fn check_table(source: &Source, table: &DeTable<'_>, prefix: &str, errors: &mut Vec<ConfigError>) {
    for (name, value) in table {
        let path = match prefix {
            "" => name.get_ref().to_string(),
            prefix => format!("{prefix}.{}", name.get_ref()),
        };
        check_entry(source, name.span(), path, value, errors);
    }
}

fn check_entry(
    source: &Source,
    name: Range<usize>,
    path: String,
    value: &Spanned<DeValue<'_>>,
    errors: &mut Vec<ConfigError>,
) {
    if let Some(key) = keys::find(&path) {
        check_value(source, &path, key.kind, value, errors);
    } else if keys::is_section(&path) {
        match value.get_ref() {
            DeValue::Table(inner) => check_table(source, inner, &path, errors),
            other => errors.push(ConfigError::WrongType {
                at: source.at(value.span()),
                expected: format!("keys of its own, written below a line [{path}]"),
                got: describe(other),
                key: path,
            }),
        }
    } else {
        errors.push(unknown_key(source, name, path, value.get_ref()));
    }
}

/// An `[[asset]]` table: which meshes, and any key that does not concern the whole run.
fn check_override(source: &Source, table: &DeTable<'_>, errors: &mut Vec<ConfigError>) {
    let not_for_one = |span: Range<usize>, key: String| ConfigError::NotForOneAsset {
        at: source.at(span),
        key,
    };
    for (name, value) in table {
        let key = name.get_ref().to_string();
        if OF_THE_RUN.contains(&key.as_str()) {
            errors.push(not_for_one(name.span(), key));
            continue;
        }
        if let DeValue::Table(members) = value.get_ref() {
            for (member, _) in members {
                let key = format!("{key}.{}", member.get_ref());
                if OF_THE_RUN.contains(&key.as_str()) {
                    errors.push(not_for_one(member.span(), key));
                }
            }
        }
        let is_setting = keys::is_section(&key) || keys::find(&key).is_some();
        let path = match is_setting {
            true => key,
            false => format!("asset[].{key}"),
        };
        check_entry(source, name.span(), path, value, errors);
    }
}

fn unknown_key(
    source: &Source,
    span: Range<usize>,
    path: String,
    value: &DeValue<'_>,
) -> ConfigError {
    if let Some(instead) = keys::removed(&path) {
        return ConfigError::RemovedKey {
            at: source.at(span),
            key: path,
            instead,
        };
    }
    let section = !path.contains('.') && matches!(value, DeValue::Table(_));
    let known = match path.rsplit_once('.') {
        Some((parent, _)) if keys::is_section(parent) => {
            keys::members(parent).map(|key| key.path).collect()
        }
        _ if section => keys::sections(),
        _ => keys::above_sections().chain(keys::sections()).collect(),
    };
    ConfigError::UnknownKey {
        at: source.at(span),
        nearest: keys::nearest(&path),
        section,
        known,
        key: path,
    }
}

fn check_value(
    source: &Source,
    path: &str,
    kind: Kind,
    value: &Spanned<DeValue<'_>>,
    errors: &mut Vec<ConfigError>,
) {
    let wrong_type = |value: &Spanned<DeValue<'_>>, kind: Kind| ConfigError::WrongType {
        at: source.at(value.span()),
        key: path.to_owned(),
        expected: kind.to_string(),
        got: describe(value.get_ref()),
    };
    let out_of_range = |given: &str| ConfigError::OutOfRange {
        at: source.at(value.span()),
        key: path.to_owned(),
        given: given.to_owned(),
        allowed: kind.to_string(),
    };
    match (kind, value.get_ref()) {
        (Kind::Bool, DeValue::Boolean(_))
        | (Kind::Text, DeValue::String(_))
        | (Kind::Curvature, DeValue::String(_)) => {}
        (Kind::Integer { min, max }, DeValue::Integer(given)) => {
            let number = i64::from_str_radix(given.as_str(), given.radix());
            if !number.is_ok_and(|number| (min..=max).contains(&number)) {
                errors.push(out_of_range(given.as_str()));
            }
        }
        (Kind::Limit(max), DeValue::Integer(given)) => {
            let number = i64::from_str_radix(given.as_str(), given.radix());
            if !number.is_ok_and(|number| (1..=max).contains(&number)) {
                errors.push(out_of_range(given.as_str()));
            }
        }
        (Kind::Limit(_), DeValue::String(given)) if Limit::WORDS.contains(&&**given) => {}
        (Kind::CurvatureIn { min, below }, DeValue::String(given)) => {
            // A text that is no curvature is left to the type, which says what is wrong with it.
            if let Ok(curvature) = given.parse::<PiMultiple>()
                && !(min..below).contains(&curvature.multiple())
            {
                errors.push(out_of_range(&format!("{given:?}")));
            }
        }
        (
            Kind::Number { .. } | Kind::ZeroOr { .. } | Kind::Curvature | Kind::CurvatureIn { .. },
            given @ (DeValue::Integer(_) | DeValue::Float(_)),
        ) => {
            // NaN and infinities are in no range.
            let (allowed, words) = match (kind, number(given)) {
                (Kind::Number { min, max }, Some(x)) => (min <= x && x <= max, kind.to_string()),
                (Kind::ZeroOr { min, max }, Some(x)) => {
                    (x == 0.0 || (min <= x && x <= max), kind.to_string())
                }
                (Kind::CurvatureIn { min, below }, Some(x)) => {
                    ((min..below).contains(&x), kind.to_string())
                }
                // Any multiple of π; the stage compares it with Gauss–Bonnet.
                (_, x) => (x.is_some_and(f64::is_finite), "a finite number".to_owned()),
            };
            if !allowed {
                errors.push(ConfigError::OutOfRange {
                    at: source.at(value.span()),
                    key: path.to_owned(),
                    given: raw(given).to_owned(),
                    allowed: words,
                });
            }
        }
        (Kind::Choice(words), DeValue::String(given)) => {
            if let Some(instead) = keys::removed_word(path, given) {
                errors.push(ConfigError::RemovedWord {
                    at: source.at(value.span()),
                    key: path.to_owned(),
                    word: given.to_string(),
                    instead,
                });
            } else if !words.contains(&given.as_ref()) {
                errors.push(ConfigError::UnknownChoice {
                    at: source.at(value.span()),
                    key: path.to_owned(),
                    given: given.to_string(),
                    allowed: kind.to_string(),
                    nearest: keys::nearest_word(given, words),
                });
            }
        }
        (Kind::Texts, DeValue::Array(items)) => {
            for item in items {
                check_value(source, path, Kind::Text, item, errors);
            }
        }
        (Kind::Choices(words), DeValue::Array(items)) => {
            for item in items {
                check_value(source, path, Kind::Choice(words), item, errors);
            }
        }
        (Kind::Curvatures, DeValue::Array(items)) => {
            for item in items {
                check_value(source, path, Kind::Curvature, item, errors);
            }
        }
        (Kind::Point, DeValue::Array(items)) => {
            if items.len() != 3 {
                errors.push(ConfigError::WrongType {
                    at: source.at(value.span()),
                    key: path.to_owned(),
                    expected: kind.to_string(),
                    got: format!("{} values", items.len()),
                });
            }
            for item in items {
                match number(item.get_ref()) {
                    Some(number) if number.is_finite() => {}
                    _ => errors.push(wrong_type(item, kind)),
                }
            }
        }
        (Kind::Rows, DeValue::Array(rows)) => {
            for row in rows {
                match row.get_ref() {
                    DeValue::Array(items) if items.len() > 1 => {
                        for item in items {
                            check_value(source, path, keys::VERTEX, item, errors);
                        }
                    }
                    _ => errors.push(wrong_type(row, kind)),
                }
            }
        }
        (Kind::Tables(_), DeValue::Array(items)) => {
            for item in items {
                match item.get_ref() {
                    DeValue::Table(table) if path == "asset" => {
                        check_override(source, table, errors);
                    }
                    DeValue::Table(table) => {
                        check_table(source, table, &format!("{path}[]"), errors);
                    }
                    _ => errors.push(wrong_type(item, kind)),
                }
            }
        }
        _ => errors.push(wrong_type(value, kind)),
    }
}

/// The value of an integer or float; none for other types and integers beyond 64 bits.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(given) => i64::from_str_radix(given.as_str(), given.radix())
            .ok()
            .map(|number| number as f64),
        DeValue::Float(given) => given.as_str().parse().ok(),
        _ => None,
    }
}

fn raw<'v>(value: &'v DeValue<'_>) -> &'v str {
    match value {
        DeValue::Integer(given) => given.as_str(),
        DeValue::Float(given) => given.as_str(),
        _ => "",
    }
}

/// A value in words, for "was given …".
fn describe(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => {
            let mut start: String = text.chars().take(40).collect();
            if start.len() < text.len() {
                start.push('…');
            }
            format!("the text {start:?}")
        }
        DeValue::Integer(given) => format!("the integer {}", given.as_str()),
        DeValue::Float(given) => format!("the number {}", given.as_str()),
        DeValue::Boolean(given) => given.to_string(),
        DeValue::Datetime(given) => format!("the date {given}"),
        DeValue::Array(items) if items.is_empty() => "an empty list".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
