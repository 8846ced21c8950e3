//! Presets, and keys that are words in lists or depend on each other.

use super::super::presets::WORDS;
use super::*;

#[test]
fn every_word_is_a_preset_and_every_preset_changes_something() {
    let word = |preset: &Preset| serde_json::to_value(preset).expect("a word");
    assert_eq!(Preset::ALL.iter().map(word).collect::<Vec<_>>(), WORDS);
    let parsed = |text: &str| parse("f", text, &[]).expect("parses");
    let mut hashes = BTreeSet::from([Config::default().hash()]);
    for (preset, word) in Preset::ALL.into_iter().zip(WORDS) {
        let named = parsed(&format!("preset = \"{word}\""));
        assert_eq!(named.preset, Some(preset));
        assert!(hashes.insert(named.hash()), "{word}");
        // The effective values are handed on, not the word.
        let written = toml::to_string(&named).expect("TOML");
        assert!(!written.contains("preset"), "{written}");
        let again = parsed(&written);
        assert_eq!(
            Config {
                preset: None,
                ..named
            },
            again
        );
        assert_eq!(again.hash(), parsed(preset.settings()).hash());
    }
}

#[test]
fn a_preset_lies_below_the_file_and_the_file_below_set() {
    let budget = |text: &str, set: &[&str]| {
        let set: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
        parse("f", text, &set).expect("parses").patches.texel_budget
    };
    let named = "preset = \"geometry-image-256\"";
    let both = "preset = \"geometry-image-256\"\n[patches]\ntexel_budget = 5000";
    let file = "[patches]\ntexel_budget = 5000";
    assert_eq!(budget(named, &[]), 65536);
    assert_eq!(budget("", &["preset=geometry-image-256"]), 65536);
    assert_eq!(
        budget(COMMENTED_DEFAULT, &["preset=geometry-image-256"]),
        65536
    );
    assert_eq!(budget(both, &[]), 5000);
    assert_eq!(budget(file, &["preset=geometry-image-256"]), 5000);
    assert_eq!(budget(both, &["patches.texel_budget=6000"]), 6000);
    assert_eq!(budget(named, &["patches.texel_budget=6000"]), 6000);
    // The last preset is the only one: nothing of another stays.
    let other = parse("f", named, &["preset=texture".to_owned()]).expect("parses");
    assert_eq!(
        other.patches.texel_budget,
        Config::default().patches.texel_budget
    );
    assert_eq!(other.grid.cells, 500);
    // A key written with the value that it has by default counts as written.
    assert_eq!(
        budget(
            "preset = \"geometry-image-256\"\n[patches]\ntexel_budget = 262144",
            &[]
        ),
        262144
    );
}

#[test]
fn an_unknown_preset_is_refused_with_the_known_ones() {
    let error = parse("f", "preset = \"best\"", &[]).expect_err("unknown");
    assert_eq!(error.to_string(), "f:1:10: `preset` has no choice \"best\"");
    for word in WORDS {
        assert!(
            error.remedy().contains(&format!("\"{word}\"")),
            "{}",
            error.remedy()
        );
    }
    let error = parse("f", "", &["preset=textur".to_owned()]).expect_err("unknown");
    assert!(
        error
            .remedy()
            .starts_with("did you mean \"texture\"? Allowed: "),
        "{}",
        error.remedy()
    );
    let error = parse("f", "[preset]\nname = 1", &[]).expect_err("a section");
    assert!(matches!(error, ConfigError::WrongType { .. }), "{error}");
    let error = parse("f", "prest = \"texture\"", &[]).expect_err("misspelt");
    assert_eq!(error.remedy(), "did you mean `preset`?");
}

#[test]
fn channels_are_a_set_of_known_words() {
    let parsed = |list: &str| parse("f", &format!("[images]\nchannels = {list}"), &[]);
    let hash = |list: &str| parsed(list).expect("parses").hash();
    assert_eq!(
        hash("[\"log-scale\", \"normal\", \"face\", \"normal\"]"),
        Config::default().hash()
    );
    assert_ne!(hash("[]"), Config::default().hash());
    let Some(Kind::Choices(words)) = keys::find("images.channels").map(|key| key.kind) else {
        panic!("a list of words");
    };
    for word in words {
        let channels = parsed(&format!("[{word:?}]"))
            .expect("known")
            .images
            .channels;
        let names: Vec<&str> = channels.iter().map(|channel| channel.name()).collect();
        assert_eq!(names, [*word]);
    }
    let error = parsed("[\"normal\", \"colour\"]").expect_err("unknown");
    assert_eq!(
        error.to_string(),
        "f:2:23: `images.channels` has no choice \"colour\""
    );
    assert!(
        error.remedy().starts_with("did you mean \"color\"?"),
        "{}",
        error.remedy()
    );
    let error = parsed("\"normal\"").expect_err("no list");
    assert!(matches!(error, ConfigError::WrongType { .. }), "{error}");
}

#[test]
fn a_preset_and_a_key_that_contradict_each_other_are_refused() {
    for (text, set) in [
        ("preset = \"omage-1024\"", "images.domain=grid"),
        ("patches.packed_side = 512", "preset=spline-fit"),
    ] {
        let error = parse("f", text, &[set.to_owned()]).expect_err(text);
        assert!(matches!(error, ConfigError::Domain { .. }), "{error}");
    }
    let error = parse("f", "images.domain = \"rectangle\"", &[]).expect_err("gone");
    assert!(
        error.to_string().contains("images.domain = \"grid\""),
        "{error}"
    );
    let error = parse("f", "patches.shared_lattice = true", &[]).expect_err("gone");
    assert!(
        error.to_string().contains("images.domain = \"grid\""),
        "{error}"
    );
}
