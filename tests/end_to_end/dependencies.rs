//! Licences, sources and versions of the crates that this one is made of are those that `deny.toml` allows.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// `deny.toml`.
fn rules() -> toml::Table {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("deny.toml");
    let text = std::fs::read_to_string(path).expect("deny.toml");
    text.parse().expect("TOML")
}

fn words<'t>(table: &'t toml::Table, section: &str, key: &str) -> BTreeSet<&'t str> {
    let list = table[section][key].as_array().expect("a list");
    list.iter()
        .map(|word| word.as_str().expect("a text"))
        .collect()
}

/// The crates named in a list of `[bans]`, as they stand there: `name` or `name@version`.
fn crates<'t>(table: &'t toml::Table, key: &str) -> Vec<&'t str> {
    let list = table["bans"][key].as_array().expect("a list");
    let named = list.iter().map(|entry| {
        assert!(
            entry["reason"]
                .as_str()
                .is_some_and(|reason| !reason.is_empty())
        );
        entry["crate"].as_str().expect("a name")
    });
    named.collect()
}

/// What cargo knows of all crates that are used on this system, tests included.
fn packages() -> Vec<Value> {
    let version = Command::new(env!("CARGO"))
        .arg("-vV")
        .output()
        .expect("cargo");
    let version = String::from_utf8(version.stdout).expect("UTF-8");
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(["--filter-platform", host.expect("a host")])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let metadata: Value = serde_json::from_slice(&output.stdout).expect(&said);
    let nodes = metadata["resolve"]["nodes"].as_array().expect("nodes");
    let used: BTreeSet<&str> = nodes
        .iter()
        .filter_map(|node| node["id"].as_str())
        .collect();
    let all = metadata["packages"].as_array().expect("packages");
    let used = all
        .iter()
        .filter(|p| used.contains(p["id"].as_str().expect("an id")));
    let packages: Vec<Value> = used.cloned().collect();
    assert!(packages.len() > 100, "{}", packages.len());
    packages
}

/// Whether a licence expression of SPDX, or of the older form with slashes, can be met with the allowed licences.
fn is_met(expression: &str, allowed: &BTreeSet<&str>) -> bool {
    let spaced = expression
        .replace('/', " OR ")
        .replace('(', " ( ")
        .replace(')', " ) ");
    let tokens: Vec<&str> = spaced.split_whitespace().collect();
    let mut rest = &tokens[..];
    let met = any(&mut rest, allowed);
    met && rest.is_empty()
}

fn any(tokens: &mut &[&str], allowed: &BTreeSet<&str>) -> bool {
    let mut met = all(tokens, allowed);
    while let ["OR", rest @ ..] = *tokens {
        *tokens = rest;
        met |= all(tokens, allowed);
    }
    met
}

fn all(tokens: &mut &[&str], allowed: &BTreeSet<&str>) -> bool {
    let mut met = one(tokens, allowed);
    while let ["AND", rest @ ..] = *tokens {
        *tokens = rest;
        met &= one(tokens, allowed);
    }
    met
}

fn one(tokens: &mut &[&str], allowed: &BTreeSet<&str>) -> bool {
    match *tokens {
        ["(", rest @ ..] => {
            *tokens = rest;
            let met = any(tokens, allowed);
            let closed = matches!(*tokens, [")", ..]);
            *tokens = tokens.get(1..).unwrap_or_default();
            met && closed
        }
        [licence, "WITH", exception, rest @ ..] => {
            *tokens = rest;
            allowed.contains(&*format!("{licence} WITH {exception}"))
        }
        [licence, rest @ ..] => {
            *tokens = rest;
            allowed.contains(licence)
        }
        [] => false,
    }
}

#[test]
fn licence_expressions_are_read() {
    let allowed = BTreeSet::from(["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"]);
    for (expression, met) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("GPL-3.0 OR MIT", true),
        ("GPL-3.0/MIT", true),
        ("MIT AND GPL-3.0", false),
        ("(MIT OR GPL-3.0) AND Zlib", true),
        ("(MIT OR Zlib) AND GPL-3.0", false),
        ("MIT OR Zlib AND GPL-3.0", true),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("Apache-2.0", false),
        ("(MIT", false),
        ("MIT Zlib", false),
        ("", false),
    ] {
        assert_eq!(is_met(expression, &allowed), met, "{expression}");
    }
}

#[test]
fn every_crate_is_allowed() {
    let rules = rules();
    let licences = words(&rules, "licenses", "allow");
    let registries = words(&rules, "sources", "allow-registry");
    let denied: BTreeSet<&str> = crates(&rules, "deny").into_iter().collect();
    let skipped = crates(&rules, "skip");
    let mut versions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in packages() {
        let text = |key: &str| package[key].as_str().unwrap_or_default().to_owned();
        let (name, version) = (text("name"), text("version"));
        let what = format!("{name} {version}");
        let licence = text("license");
        assert!(is_met(&licence, &licences), "{what} is under {licence:?}");
        // Only the crates of this workspace have no source.
        let source = text("source");
        let registry = source.strip_prefix("registry+").unwrap_or(&source);
        let own = name.starts_with(env!("CARGO_PKG_NAME")) && source.is_empty();
        assert!(
            own || registries.contains(registry),
            "{what} comes from {source:?}"
        );
        assert!(!denied.contains(&*name), "{what} is denied");
        versions.entry(name).or_default().push(version);
    }
    for (name, versions) in versions {
        let is_skipped = |version: &String| {
            let same = |of: &str| version == of || version.starts_with(&format!("{of}."));
            let skips = skipped.iter().filter_map(|skip| skip.split_once('@'));
            skips
                .into_iter()
                .any(|(other, of)| other == name && same(of))
        };
        let counted = versions.iter().filter(|version| !is_skipped(version));
        assert!(counted.count() <= 1, "{name} is there as {versions:?}");
    }
}
