use super::*;

fn tree(files: &[&str]) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    for file in files {
        let path = root.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "").unwrap();
    }
    root
}

fn found(root: &Path, entries: &[&str]) -> Vec<(String, Option<String>)> {
    let entries: Vec<PathBuf> = entries.iter().map(PathBuf::from).collect();
    let inputs = expand(&entries, root, &root.join("out")).unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    inputs
        .files
        .iter()
        .map(|input| {
            assert_eq!(input.path, root.join(&input.given));
            (text(&input.given), input.below.as_deref().map(text))
        })
        .collect()
}

fn pair(given: &str, below: &str) -> (String, Option<String>) {
    (given.to_owned(), Some(below.to_owned()))
}

const FILES: &[&str] = &[
    "scans/b.PLY",
    "scans/left/a.obj",
    "scans/right/a.obj",
    "scans/right/a.mtl",
    "scans/.hidden/c.obj",
    "scans/.d.obj",
    "out/a/surface.glb",
    "one.txt",
];

#[test]
fn folders_are_searched_in_order_without_what_was_written() {
    let root = tree(FILES);
    let expected = [
        pair("scans/b.PLY", "b.PLY"),
        pair("scans/left/a.obj", "left/a.obj"),
        pair("scans/right/a.obj", "right/a.obj"),
    ];
    assert_eq!(found(root.path(), &["scans"]), expected);
    let all = found(root.path(), &["."]);
    assert_eq!(all.len(), 3, "{all:?}");
    assert_eq!(all[1], pair("./scans/left/a.obj", "scans/left/a.obj"));
}

#[test]
fn globs_match_whole_names() {
    let root = tree(FILES);
    assert_eq!(
        found(root.path(), &["scans/*/a.*"]),
        [
            pair("scans/left/a.obj", "left/a.obj"),
            pair("scans/right/a.obj", "right/a.obj")
        ]
    );
    assert_eq!(found(root.path(), &["scans/*.obj"]), []);
    assert_eq!(
        found(root.path(), &["**/*.glb"]),
        [],
        "the output root was searched"
    );
    assert_eq!(
        found(root.path(), &["**/?.PLY"]),
        [pair("scans/b.PLY", "scans/b.PLY")]
    );
    let error = expand(&["a[".into()], root.path(), Path::new("out")).unwrap_err();
    assert!(matches!(error, InputError::Glob { .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn links_to_missing_files_are_inputs_and_those_to_folders_are_told() {
    use std::os::unix::fs::symlink;
    let root = tree(&["scans/a.obj", "more/b.obj"]);
    let scans = root.path().join("scans");
    symlink("nowhere.obj", scans.join("gone.obj")).unwrap();
    symlink("a.obj", scans.join("z.obj")).unwrap();
    symlink("../more", scans.join("more")).unwrap();
    symlink("nowhere", scans.join("notes")).unwrap();
    for given in ["scans", "scans/*.obj"] {
        let expected =
            ["a.obj", "gone.obj", "z.obj"].map(|name| pair(&format!("scans/{name}"), name));
        assert_eq!(found(root.path(), &[given]), expected);
    }
    let inputs = expand(&["scans".into()], root.path(), Path::new("out")).unwrap();
    let [note] = &inputs.notes[..] else {
        panic!("{:?}", inputs.notes);
    };
    assert!(note.contains("scans/more is a link to a folder"), "{note}");
}

#[cfg(target_os = "linux")]
#[test]
fn globs_pass_names_that_are_not_unicode_and_hidden_ones() {
    use std::os::unix::ffi::OsStrExt;
    let root = tree(FILES);
    let name = std::ffi::OsStr::from_bytes(b"scans/left/\xff.obj");
    fs::write(root.path().join(name), "").unwrap();
    let left = pair("scans/left/a.obj", "left/a.obj");
    let right = pair("scans/right/a.obj", "right/a.obj");
    assert_eq!(found(root.path(), &["scans/**/*.obj"]), [left, right]);
    let hidden = pair("scans/.hidden/c.obj", "c.obj");
    assert_eq!(found(root.path(), &["scans/.hidden/*.obj"]), [hidden]);
    let hidden = pair("scans/.d.obj", ".d.obj");
    assert_eq!(found(root.path(), &["scans/.*.obj"]), [hidden]);
}

#[test]
fn files_are_taken_as_they_are() {
    let root = tree(FILES);
    let single = |name: &str| (name.to_owned(), None);
    assert_eq!(
        found(
            root.path(),
            &["one.txt", "none.obj", "scans/left/a.obj", "scans/left"]
        ),
        [
            single("one.txt"),
            single("none.obj"),
            single("scans/left/a.obj")
        ]
    );
    fs::write(root.path().join("a[1].obj"), "").unwrap();
    assert_eq!(found(root.path(), &["a[1].obj"]), [single("a[1].obj")]);
}

#[test]
fn lists_start_at_their_folder() {
    let root = tree(FILES);
    let list = root.path().join("scans/list.txt");
    fs::write(
        &list,
        "# tonight\n\n left/a.obj \nright\n*.PLY\nmissing.obj\n",
    )
    .unwrap();
    assert_eq!(
        found(root.path(), &["@scans/list.txt"]),
        [
            pair("scans/left/a.obj", "scans/left/a.obj"),
            pair("scans/right/a.obj", "a.obj"),
            pair("scans/b.PLY", "b.PLY"),
            pair("scans/missing.obj", "scans/missing.obj"),
        ]
    );
    fs::write(&list, "left/a.obj\n@other\n").unwrap();
    let entry = [PathBuf::from("@scans/list.txt")];
    let error = expand(&entry, root.path(), Path::new("out")).unwrap_err();
    assert!(
        error.to_string().starts_with("line 2 of the list"),
        "{error}"
    );
    fs::write(&list, b"\xff").unwrap();
    let error = expand(&entry, root.path(), Path::new("out")).unwrap_err();
    assert!(
        error.to_string().ends_with("byte 0 is not UTF-8 text"),
        "{error}"
    );
}

#[test]
fn results_are_no_inputs() {
    let root = tree(&[
        "a/atlas.json",
        "a/surface.glb",
        "b/component-002/atlas.json",
        "b/surface.glb",
        "c/atlas.json",
        "c/c.glb",
        "d/component-001/d.obj",
        "e.fit/fit.json",
        "e.fit/e.glb",
        "e.texture/texture.json",
        "e.texture/e.glb",
    ]);
    for (result, format) in [
        ("a/atlas.json", ""),
        ("b/component-002/atlas.json", ""),
        ("e.fit/fit.json", "-fit"),
        ("e.texture/texture.json", "-texture"),
    ] {
        let text = format!("{{\n  \"format\": \"affine-atlas{format}\",");
        fs::write(root.path().join(result), text).unwrap();
    }
    assert_eq!(
        found(root.path(), &["."]),
        [
            pair("./c/c.glb", "c/c.glb"),
            pair("./d/component-001/d.obj", "d/component-001/d.obj")
        ]
    );
    let of = |folder: &str| expand(&[folder.into()], root.path(), Path::new("out")).unwrap();
    assert!(of("a").notes[0].contains("holds results of affine-atlas"));
    assert!(of("b").files.is_empty());
    // A file that is named is taken.
    assert_eq!(of("a/surface.glb").files.len(), 1);
}

#[test]
fn what_finds_nothing_is_said() {
    let root = tree(FILES);
    fs::create_dir(root.path().join("empty")).unwrap();
    let entries = ["empty".into(), "scans/*.stl".into()];
    let inputs = expand(&entries, root.path(), Path::new("out")).unwrap();
    assert!(inputs.files.is_empty());
    assert_eq!(
        inputs.notes,
        [
            "empty holds no mesh file (gltf, glb, obj, ply, stl, off)",
            "scans/*.stl matches no mesh file (gltf, glb, obj, ply, stl, off)"
        ]
    );
}
