//! A configuration text, and what is said about a place in it.

use super::error::{ConfigError, Location};
use std::ops::Range;
use std::sync::Arc;
use toml::de::DeTable;

/// A configuration text and what to call it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    /// The file as given, or `--set`.
    pub name: String,
    /// The text.
    pub text: Arc<str>,
}

impl Source {
    pub fn new(name: &str, text: &str) -> Self {
        Self {
            name: name.to_owned(),
            text: Arc::from(text),
        }
    }

    pub fn at(&self, span: Range<usize>) -> Box<Location> {
        Box::new(Location::new(&self.name, &self.text, span))
    }
}

/// The text is no TOML.
pub(super) fn syntax(source: &Source, error: &toml::de::Error) -> ConfigError {
    let at = source.at(error.span().unwrap_or(0..0));
    let before = source.text[..at.span.start].trim_end();
    let word = at.offending();
    // The most frequent slip: the parser takes `scheme = thurston` for a misspelt `true`.
    let reason = if before.ends_with(['=', '[', ',']) && word.starts_with(char::is_alphabetic) {
        format!("the word {word} is no value; only true and false stand without quotes")
    } else {
        error.message().to_owned()
    };
    ConfigError::Syntax { at, reason }
}

/// A stage does not take a value.
pub(super) fn refused(source: &Source, error: &toml::de::Error) -> ConfigError {
    let span = error.span().unwrap_or(0..0);
    ConfigError::Refused {
        key: key_at(source, span.start).unwrap_or_else(|| "configuration".to_owned()),
        at: source.at(span),
        reason: error.message().to_owned(),
    }
}

/// Path of the `section.key`, or of the key above all sections, whose value holds byte `position`.
fn key_at(source: &Source, position: usize) -> Option<String> {
    let table = DeTable::parse(&source.text).ok()?;
    let holds = |key: Range<usize>, value: Range<usize>| {
        (key.start..value.end.max(key.end)).contains(&position)
    };
    for (section, keys) in table.get_ref() {
        let Some(members) = keys.get_ref().as_table() else {
            if holds(section.span(), keys.span()) {
                return Some(section.get_ref().to_string());
            }
            continue;
        };
        for (key, value) in members {
            if holds(key.span(), value.span()) {
                return Some(format!("{}.{}", section.get_ref(), key.get_ref()));
            }
        }
    }
    None
}
