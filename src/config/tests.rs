use super::keys::{KEYS, Kind};
use super::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

mod presets;

/// Keys with a default that presets set: in the commented configuration they have no effect, so that presets have one.
fn preset_keys() -> BTreeSet<String> {
    let settings = Preset::ALL.map(Preset::settings);
    let tables = settings.map(|text| toml::from_str::<toml::Table>(text).expect("TOML"));
    let has_default = |path: &String| keys::find(path).is_some_and(|key| key.has_default());
    tables.iter().flat_map(leaves).filter(has_default).collect()
}

/// Section of a key, empty above all sections, and its name.
fn section_and_name(path: &str) -> (&str, &str) {
    path.rsplit_once('.').unwrap_or(("", path))
}

/// The section of `config.toml` that a key stands in.
fn section_of(path: &str) -> &str {
    match section_and_name(path).0 {
        "asset[]" => "",
        parent => parent.split('.').next().unwrap_or(parent),
    }
}

/// Paths of all leaves of a table, `section.key`.
fn leaves(table: &toml::Table) -> BTreeSet<String> {
    let mut paths = BTreeSet::new();
    for (section, keys) in table {
        for key in keys.as_table().expect("only sections at the top").keys() {
            paths.insert(format!("{section}.{key}"));
        }
    }
    paths
}

fn default_table() -> toml::Table {
    toml::Table::try_from(Config::default()).expect("defaults can be written as TOML")
}

fn resolved_default() -> Config {
    Config::default().resolved().expect("nothing contradicts")
}

fn top_level_keys() -> impl Iterator<Item = &'static keys::Key> {
    KEYS.iter().filter(|key| !key.path.contains("[]"))
}

/// Sets keys of the commented configuration, by replacing or uncommenting their line.
fn commented_with(path: &str, value: &str) -> Result<Config, ConfigError> {
    parse(
        "config.toml",
        COMMENTED_DEFAULT,
        &[format!("{path}={value}")],
    )
}

#[test]
fn commented_default_is_the_default() {
    let mut config = parse("config.toml", COMMENTED_DEFAULT, &[]).expect("parses");
    assert!(!config.input.paths.is_empty());
    config.input.paths.clear();
    assert_eq!(config, resolved_default());
    assert_eq!(parse("empty", "", &[]).expect("parses"), resolved_default());
}

/// What `init` writes differs from the configuration of this repository by the meshes alone.
#[test]
fn the_configuration_for_a_folder_names_the_folder() {
    let text = commented_for_its_folder();
    let mut config = parse("config.toml", &text, &[]).expect("parses");
    assert_eq!(config.input.paths, [PathBuf::from(".")]);
    config.input.paths.clear();
    assert_eq!(config, resolved_default());
    let lines = text.lines().zip(COMMENTED_DEFAULT.lines());
    assert_eq!(lines.filter(|(own, other)| own != other).count(), 1);
    assert_eq!(text.lines().count(), COMMENTED_DEFAULT.lines().count());
}

#[test]
fn key_table_default_and_commented_default_have_the_same_keys() {
    let known: BTreeSet<String> = top_level_keys()
        .filter(|key| key.has_default())
        .map(|key| key.path.to_owned())
        .collect();
    assert_eq!(known, leaves(&default_table()));
    let commented: toml::Table = toml::from_str(COMMENTED_DEFAULT).expect("parses");
    let mut commented = leaves(&commented);
    let of_presets = preset_keys();
    assert!(!of_presets.is_empty() && commented.is_disjoint(&of_presets));
    commented.extend(of_presets);
    assert_eq!(known, commented);
}

#[test]
fn key_table_states_the_defaults() {
    let table = default_table();
    for key in top_level_keys().filter(|key| key.has_default()) {
        let (section, name) = key.path.split_once('.').expect("section.key");
        let stated: toml::Table = toml::from_str(&format!("v = {}", key.default)).expect(key.path);
        assert_eq!(stated["v"], table[section][name], "{}", key.path);
    }
}

/// The line that states type, unit and range stands right above each key, a sentence that says
/// what the key means above that.
#[test]
fn commented_default_describes_every_key() {
    let lines: Vec<&str> = COMMENTED_DEFAULT.lines().collect();
    let mut section = "";
    let mut described = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        if let Some(name) = line
            .strip_prefix('[')
            .and_then(|rest| rest.strip_suffix(']'))
        {
            section = name;
        }
        for key in KEYS.iter().filter(|key| section_of(key.path) == section) {
            let (parent, name) = section_and_name(key.path);
            let description = format!("# {}", key.describe());
            // A key of listed tables has a paragraph of its own that begins with its name and that of the table.
            let table = match parent {
                "cones.list[]" => "listed cone",
                "boundary.list[]" => "listed boundary vertex",
                "boundary.corners[]" => "corner",
                "asset[]" => "table",
                _ => "",
            };
            let here = if parent.ends_with("[]") {
                let begins = format!("# {name} of a {table}: ");
                assert!(!table.is_empty(), "{parent} has no name");
                **line == *description && lines[i - 1].starts_with(&begins)
            } else {
                let value = line.strip_prefix("# ").unwrap_or(line);
                value.starts_with(&format!("{name} = ")) && lines[i - 1] == description
            };
            if here {
                let meaning = lines[i - if parent.ends_with("[]") { 1 } else { 2 }];
                assert!(
                    meaning.starts_with("# ") && meaning.len() > 12,
                    "{}: {meaning}",
                    key.path
                );
                described.push(key.path);
            }
        }
    }
    let expected: Vec<&str> = KEYS.iter().map(|key| key.path).collect();
    assert_eq!(described, expected);
}

/// Lines such as `# list = […]` are examples that work when the `# ` is taken away.
#[test]
fn commented_examples_work() {
    let mut examples = 0;
    let mut section = "";
    for line in COMMENTED_DEFAULT.lines() {
        if let Some(name) = line
            .strip_prefix('[')
            .and_then(|rest| rest.strip_suffix(']'))
        {
            section = name;
        }
        let Some((name, value)) = line
            .strip_prefix("# ")
            .and_then(|rest| rest.split_once(" = "))
        else {
            continue;
        };
        let path = match section {
            "" => name.to_owned(),
            _ => format!("{section}.{name}"),
        };
        let Some(key) = keys::find(&path) else {
            continue;
        };
        if preset_keys().contains(&path) {
            assert_eq!(value, key.default, "{path}");
            continue;
        }
        let config = commented_with(&path, value).expect(line);
        // Of no effect on any but some meshes; the default where nothing else is said.
        if ["asset", "images.domain"].contains(&path.as_str()) {
            continue;
        }
        assert_ne!(
            config.hash(),
            Config::default().hash(),
            "{line} has no effect"
        );
        examples += 1;
    }
    assert!(examples >= 3);
}

#[test]
fn every_word_is_accepted_and_no_other_exists() {
    for key in top_level_keys() {
        let Kind::Choice(words) = key.kind else {
            continue;
        };
        for word in words {
            commented_with(key.path, word).expect(key.path);
        }
        let text = match section_and_name(key.path) {
            ("", name) => format!("{name} = \"no such word\""),
            (section, name) => format!("[{section}]\n{name} = \"no such word\""),
        };
        let message = toml::from_str::<Config>(&text)
            .expect_err("no such word")
            .message()
            .to_owned();
        let known: BTreeSet<&str> = message.split('`').skip(3).step_by(2).collect();
        assert_eq!(
            known,
            words.iter().copied().collect(),
            "{}: {message}",
            key.path
        );
    }
}

#[test]
fn bounds_are_accepted_and_beyond_is_refused() {
    for key in top_level_keys() {
        let (good, bad) = match key.kind {
            Kind::Integer { min, max } => (
                vec![min.to_string(), max.to_string()],
                vec![
                    (min - 1).to_string(),
                    (max + 1).to_string(),
                    "99999999999999999999".to_owned(),
                ],
            ),
            Kind::Limit(max) => (
                vec![
                    "1".into(),
                    max.to_string(),
                    "\"auto\"".into(),
                    "\"off\"".into(),
                ],
                vec!["0".into(), "-1".into(), (max + 1).to_string()],
            ),
            Kind::CurvatureIn { min, below } => (
                vec![format!("{min:?}"), format!("{}/1000", 1000.0 * below - 1.0)],
                vec![
                    format!("{below:?}"),
                    format!("{below}"),
                    format!("\"{below}\""),
                    format!("{}/1000", 1000.0 * min - 1.0),
                    "nan".to_owned(),
                    "inf".to_owned(),
                ],
            ),
            Kind::Number { min, max } | Kind::ZeroOr { min, max } => (
                vec![format!("{min:?}"), format!("{max:?}")],
                vec![
                    format!("{:?}", max * 2.0),
                    "-1.0".to_owned(),
                    "nan".to_owned(),
                    "inf".to_owned(),
                ],
            ),
            _ => continue,
        };
        for value in good {
            commented_with(key.path, &value).expect(key.path);
        }
        for value in bad {
            let error = commented_with(key.path, &value).expect_err(key.path);
            let (ConfigError::OutOfRange { .. } | ConfigError::Syntax { .. }) = error else {
                panic!("{}={value}: {error}", key.path);
            };
        }
    }
}

#[test]
fn wrong_types_are_refused_for_every_key() {
    for key in top_level_keys() {
        let error = commented_with(key.path, "1979-05-27").expect_err(key.path);
        assert!(matches!(error, ConfigError::WrongType { .. }), "{error}");
        assert!(error.remedy().contains(&key.describe()));
    }
}

#[test]
fn overrides_replace_and_come_last() {
    let overrides = [
        "flow.scheme = thurston",
        "flow.scheme=vertex-scaling",
        "patches.padding=5",
        "cones.list=[{ vertex = 3, curvature = -0.5 }]",
        "input.paths=[\"a b.obj\"]",
        "output.folder=some folder",
    ]
    .map(str::to_owned);
    let config = parse(
        "f",
        "[flow]\nscheme = \"tangential\"\nsolver = \"gradient\"",
        &overrides,
    )
    .expect("parses");
    assert_eq!(
        config.flow.scheme,
        crate::flow::ricci::Scheme::VertexScaling
    );
    assert_eq!(config.flow.solver, crate::flow::ricci::Solver::Gradient);
    assert_eq!(config.patches.padding, 5);
    assert_eq!(config.cones.list.len(), 1);
    assert_eq!(config.input.paths, [PathBuf::from("a b.obj")]);
    assert_eq!(config.output.folder, Path::new("some folder"));
}

#[test]
fn cones_as_sections_are_cones_in_a_list() {
    let sections = "[[cones.list]]\nvertex = 3\ncurvature = 1\n[[cones.list]]\npoint = [0, 1.5, 2]\ncurvature = \"1/2\"";
    let list = "[cones]\nlist = [{ vertex = 3, curvature = 1 }, { point = [0.0, 1.5, 2.0], curvature = \"1/2\" }]";
    let parsed = |text: &str| parse("f", text, &[]).expect("parses");
    assert_eq!(parsed(sections), parsed(list));
    assert_eq!(parsed(sections).cones.list.len(), 2);
}

#[test]
fn the_first_error_of_the_file_is_reported() {
    let text = "[patches]\npading = 2\n[flow]\nscheme = \"newton\"\n";
    let error = parse("f.toml", text, &[]).expect_err("two errors");
    assert_eq!(
        error.to_string(),
        "f.toml:2:1: unknown key `patches.pading`"
    );
    assert_eq!(error.remedy(), "did you mean `patches.padding`?");
    assert_eq!(
        error.location().expect("in the text").excerpt(),
        "pading = 2\n^^^^^^"
    );
}

#[test]
fn messages() {
    let cases: &[(&str, &str, &str)] = &[
        (
            "flow = 3",
            "f:1:8: `flow` takes keys of its own, written below a line [flow], but was given the integer 3",
            "",
        ),
        (
            "threads = 3",
            "f:1:1: unknown key `threads`",
            "did you mean `run.threads`?",
        ),
        (
            "[folw]\n",
            "f:1:2: unknown section `folw`",
            "did you mean `flow`?",
        ),
        (
            "[flow]\nscheme = \"thurstn\"",
            "f:2:10: `flow.scheme` has no choice \"thurstn\"",
            "did you mean \"thurston\"?",
        ),
        (
            "[flow]\nscheme = true",
            "f:2:10: `flow.scheme` takes \"vertex-scaling\", \"tangential\", \"thurston\" or \"inversive-distance\", but was given true",
            "",
        ),
        (
            "[flow]\ncurvature_tolerance = 1.0",
            "f:2:23: `flow.curvature_tolerance` takes a number from 1e-13 to 1e-9, but was given 1.0",
            "`flow.curvature_tolerance`: a number",
        ),
        (
            "[cones]\nlist = [{ vertx = 1, curvature = 1 }]",
            "f:2:11: unknown key `cones.list[].vertx`",
            "did you mean `cones.list[].vertex`?",
        ),
        (
            "[cones]\nlist = [{ vertex = 1 }]",
            "f:2:9: `cones.list` is not usable: missing field `curvature`",
            "",
        ),
        (
            "[cones]\nlist = [{ point = [1, 2], curvature = 1 }]",
            "f:2:19: `cones.list[].point` takes three numbers such as [0.0, 1.5, -2.0], but was given 2 values",
            "",
        ),
        (
            "[cones]\ncurvature = nan",
            "f:2:13: `cones.curvature` takes a finite number, but was given nan",
            "",
        ),
        (
            "[input]\npaths = \"a.obj\"",
            "f:2:9: `input.paths` takes a list of texts in quotes, but was given the text \"a.obj\"",
            "",
        ),
        (
            "[input]\npaths = [1]",
            "f:2:10: `input.paths` takes a text in quotes, but was given the integer 1",
            "",
        ),
    ];
    for (text, message, remedy) in cases {
        let error = parse("f", text, &[]).expect_err(text);
        assert_eq!(error.to_string(), *message);
        assert!(error.remedy().starts_with(remedy), "{}", error.remedy());
    }
}

#[test]
fn errors_of_overrides_show_the_override() {
    let error = parse("f", "", &["flow.shceme=thurston".to_owned()]).expect_err("unknown");
    assert_eq!(error.to_string(), "--set:1:6: unknown key `flow.shceme`");
    assert_eq!(error.remedy(), "did you mean `flow.scheme`?");
    let error = parse("f", "", &["flow.scheme=tangental".to_owned()]).expect_err("unknown");
    assert_eq!(
        error.to_string(),
        "--set:1:15: `flow.scheme` has no choice \"tangental\""
    );
    let error = parse("f", "", &["flow.scheme".to_owned()]).expect_err("no value");
    assert_eq!(error.to_string(), "`--set flow.scheme` gives no value");
    let error = parse("f", "", &["cones.list=[{]".to_owned()]).expect_err("no TOML");
    assert!(matches!(error, ConfigError::Syntax { .. }), "{error}");
}

/// No text makes it panic, and every error has a place inside the text.
#[test]
fn damaged_texts_never_panic() {
    let text = COMMENTED_DEFAULT;
    let boundaries: Vec<usize> = text.char_indices().map(|(i, _)| i).collect();
    for (n, &i) in boundaries.iter().enumerate() {
        // Every cut, and a different stray character at every place.
        let stray = ['[', '"', '=', '\0', 'π', '{', '\n', ']'][n % 8];
        for damaged in [
            text[..i].to_owned(),
            format!("{}{stray}{}", &text[..i], &text[i..]),
        ] {
            // Most of the file is comments, where nothing can happen.
            if n % 7 != 0 && text[..i].rfind('#') > text[..i].rfind('\n') {
                continue;
            }
            if let Err(error) = parse("f", &damaged, &[]) {
                let at = error.location().expect("an error of the text");
                assert!(at.span.end <= damaged.len() && !at.excerpt().is_empty());
            }
        }
    }
    for deep in [
        "[".repeat(100_000),
        "a.".repeat(100_000),
        format!("a = {}", "{a=".repeat(100_000)),
    ] {
        parse("f", &deep, &[]).expect_err("no configuration");
    }
}

#[test]
fn hash_depends_on_values_that_change_a_result() {
    let hash = |text: &str| parse("f", text, &[]).expect("parses").hash();
    let default = Config::default().hash();
    assert_eq!(default.len(), 64);
    assert_eq!(hash(COMMENTED_DEFAULT), default);
    assert_eq!(
        hash("[run]\nthreads = 2\n[output]\nfolder = \"x\"\n[input]\npaths = [\"a.obj\"]"),
        default
    );
    for key in top_level_keys() {
        let section = key.path.split('.').next().expect("section");
        let value = match key.kind {
            Kind::Bool => (key.default != "true").to_string(),
            Kind::Integer { max, .. } | Kind::Limit(max) => max.to_string(),
            Kind::Number { max, .. } | Kind::ZeroOr { max, .. } => format!("{max:?}"),
            Kind::Choice(words) => words[words.len() - 1].to_owned(),
            Kind::Choices(words) => format!("[\"{}\"]", words[0]),
            _ => continue,
        };
        let changed = commented_with(key.path, &value).expect(key.path).hash();
        // Grids have quarter turns anyway.
        let has_no_effect = section == "run" || key.path == "flow.holonomy";
        assert_eq!(changed == default, has_no_effect, "{}={value}", key.path);
    }
}

#[test]
fn relative_paths_start_at_the_file_or_the_current_folder() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("my.toml");
    std::fs::write(&file, "[input]\npaths = [\"a.obj\"]").expect("written");
    let loaded = load(&file, &["output.folder=there".to_owned()]).expect("loads");
    assert_eq!(loaded.input_base, folder.path());
    assert_eq!(loaded.output_base, Path::new(""));
    assert_eq!(loaded.output_folder(), Path::new("there"));
    let loaded = load(&file, &[]).expect("loads");
    assert_eq!(
        loaded.output_folder(),
        folder.path().join("affine-atlas-out")
    );
}

#[test]
fn unreadable_files_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("config.toml");
    assert!(matches!(
        load(&file, &[]),
        Err(ConfigError::NotFound { .. })
    ));
    assert!(matches!(
        load(folder.path(), &[]),
        Err(ConfigError::Unreadable { .. })
    ));
    std::fs::write(&file, [b'#', 0xff, 0xfe]).expect("written");
    let error = load(&file, &[]).expect_err("no UTF-8");
    assert!(
        error.to_string().ends_with("byte 1 is not UTF-8 text"),
        "{error}"
    );
}

/// A folder with a configuration and a file of cones beside it.
fn with_cone_file(cones: &str, keys: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("my.toml");
    std::fs::write(&file, format!("[cones]\nfile = \"my.cones.txt\"\n{keys}\n")).expect("written");
    std::fs::write(folder.path().join("my.cones.txt"), cones).expect("written");
    (folder, file)
}

#[test]
fn a_cone_file_becomes_the_list() {
    let (folder, file) = with_cone_file("# mine\n3 1.57\n\n9 0.5\n", "file_first_vertex = 1");
    let loaded = load(&file, &[]).expect("loads");
    let cones = &loaded.config.cones;
    let listed: Vec<_> = (cones.list.iter())
        .map(|c| (c.vertex, c.curvature.radians()))
        .collect();
    assert_eq!(listed, [(Some(2), 1.57), (Some(8), 0.5)]);
    assert_eq!(cones.file_lines, [2, 4]);
    // An override starts at the current folder.
    let there = folder.path().join("my.cones.txt");
    let set = [
        format!("cones.file={}", there.display()),
        "cones.file_first_vertex=1".to_owned(),
    ];
    assert_eq!(defaults(&set).expect("loads").config.cones.list, cones.list);
    assert!(matches!(
        load(&file, &["cones.file=my.cones.txt".to_owned()]),
        Err(ConfigError::NoListFile { .. })
    ));
}

#[test]
fn hash_depends_on_what_a_cone_file_says_and_not_on_how() {
    let hash = |cones: &str, keys: &str| {
        let (_folder, file) = with_cone_file(cones, keys);
        load(&file, &[]).expect("loads").config.hash()
    };
    let one = hash("3 1.57\n9 0.5\n", "");
    assert_eq!(one, hash("# same\n 3  1.57e0\n\n9 5e-1", ""));
    assert_eq!(one, hash("4 1.57\n10 0.5\n", "file_first_vertex = 1"));
    assert_ne!(one, hash("3 1.57\n9 0.50000000000000011\n", ""));
    assert_ne!(one, hash("4 1.57\n9 0.5\n", ""));
    assert_ne!(one, Config::default().hash());
}

#[test]
fn cone_files_that_are_refused() {
    let refused = |cones: &str, keys: &str| {
        let (_folder, file) = with_cone_file(cones, keys);
        load(&file, &[]).expect_err(cones)
    };
    let error = refused("3 1.57\n9 half\n", "");
    let at = error.location().expect("in the cone file");
    assert_eq!((at.line, at.column, at.offending()), (2, 3, "half"));
    assert!(error.remedy().contains("17 1.570796"), "{}", error.remedy());
    let error = refused("3 1.57\n", "list = [{ vertex = 0, curvature = 1 }]");
    assert!(matches!(error, ConfigError::Both { .. }), "{error}");
    let (folder, file) = with_cone_file("", "");
    std::fs::remove_file(folder.path().join("my.cones.txt")).expect("removed");
    let error = load(&file, &[]).expect_err("missing");
    let text = error.to_string();
    assert!(
        text.ends_with("my.cones.txt, which cannot be read: there is no such file"),
        "{text}"
    );
    std::fs::write(folder.path().join("my.cones.txt"), [b'3', 0xff]).expect("written");
    let text = load(&file, &[]).expect_err("no UTF-8").to_string();
    assert!(text.ends_with("byte 1 is not UTF-8 text"), "{text}");
}

#[test]
fn a_file_of_features_becomes_the_list() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("my.toml");
    let edges = folder.path().join("edges.txt");
    let written = |text: &str, keys: &str| {
        std::fs::write(&edges, text).expect("written");
        let keys = format!("[features]\nfile = \"edges.txt\"\n{keys}\n");
        std::fs::write(&file, keys).expect("written");
        load(&file, &[])
    };
    let loaded = written("# seam\n1 2 3\n7 8\n", "file_first_vertex = 1").expect("loads");
    assert_eq!(loaded.config.features.list, [vec![0, 1, 2], vec![6, 7]]);
    assert!(loaded.files.contains(&edges), "{:?}", loaded.files);
    // What it says counts, and not how.
    let listed = parse("f", "[features]\nlist = [[0, 1, 2], [6, 7]]", &[]).expect("parses");
    assert_eq!(loaded.config.hash(), listed.hash());
    assert_ne!(listed.hash(), Config::default().hash());
    let error = written("1 2\n3 x\n", "").expect_err("no number");
    let at = error.location().expect("in the file");
    assert_eq!((at.line, at.column, at.offending()), (2, 3, "x"));
    assert!(error.remedy().contains("`17 18 25`"), "{}", error.remedy());
    let error = written("1 2\n", "list = [[1, 2]]").expect_err("twice");
    assert!(matches!(error, ConfigError::Both { .. }), "{error}");
    for (list, place) in [("[[1]]", "[1]"), ("[[1, -2]]", "-2"), ("[7]", "7")] {
        let text = format!("[features]\nlist = {list}");
        let error = parse("f", &text, &[]).expect_err(list);
        assert_eq!(error.location().expect("there").offending(), place);
    }
}

#[test]
fn a_key_of_an_earlier_version_is_refused_with_what_is_so_instead() {
    let text = "[cones]\nobjective = \"log-scale\"\n";
    let error = parse("a.toml", text, &[]).expect_err("removed");
    let message = error.to_string();
    let start =
        "a.toml:2:1: there is no key `cones.objective` any more: cones are chosen by one measure";
    assert!(message.starts_with(start), "{message}");
    assert_eq!(error.remedy(), "remove `cones.objective`");
}

#[test]
fn configurations_made_in_code_are_checked() {
    assert_eq!(Config::default().check(), Ok(()));
    for preset in Preset::ALL {
        assert_eq!(
            parse("text", preset.settings(), &[]).unwrap().check(),
            Ok(())
        );
    }
    let text = r#"
        cones.list = [{ vertex = 3, curvature = "1/2" }, { point = [0, 1.5, -2], curvature = -0.5 }]
        features.list = [[1, 2], [3, 4, 5]]
        input.paths = ["a \"b\" \\ ü.obj"]
    "#;
    assert_eq!(parse("text", text, &[]).unwrap().check(), Ok(()));
    let refused = |change: &dyn Fn(&mut Config)| {
        let mut config = Config::default();
        change(&mut config);
        config.check().unwrap_err().to_string()
    };
    let says = |change: &dyn Fn(&mut Config), wanted: &str| {
        let said = refused(change);
        assert!(said.contains(wanted), "{said}");
    };
    let samples = "`grid.samples_per_cell` takes an integer from ";
    says(&|c| c.grid.samples_per_cell = 0, samples);
    says(&|c| c.grid.samples_per_cell = 1 << 40, samples);
    says(
        &|c| c.grid.cells = usize::MAX,
        "was given 18446744073709551615",
    );
    says(
        &|c| c.features.angle = f64::NAN,
        "`features.angle` takes a number from",
    );
    says(&|c| c.flow.curvature_tolerance = -1.0, "was given -1");
    says(
        &|c| c.repair.weld_tolerance = f64::INFINITY,
        "`repair.weld_tolerance`",
    );
}
