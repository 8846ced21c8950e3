//! What readers of an output folder see in every case.

use super::unfinished::{MACHINE, PREFIX, exchange, set_aside};
use super::*;

fn registry() -> &'static Registry {
    Box::leak(Box::new(Registry::new()))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn publish(root: &Path, text: &str) {
    let staging = Staging::begin_in(registry(), Contents::Atlas, root, "spot").unwrap();
    staging.write("atlas.json", text.as_bytes()).unwrap();
    staging.write("images/0000.exr", b"texels").unwrap();
    staging.publish().unwrap();
}

#[test]
fn a_folder_appears_complete_and_replaces_the_older_one() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("a/b");
    let staging = Staging::begin_in(registry(), Contents::Atlas, &out, "spot").unwrap();
    staging.write("atlas.json", b"1").unwrap();
    assert!(!out.join("spot").exists());
    staging.publish().unwrap();
    assert_eq!(names(&out), ["spot"]);
    publish(&out, "2");
    assert_eq!(names(&out), ["spot"]);
    assert_eq!(fs::read(out.join("spot/atlas.json")).unwrap(), b"2");
    assert_eq!(
        list_files(&out.join("spot")).unwrap(),
        ["atlas.json", "images/0000.exr"]
    );
}

#[test]
fn a_dropped_staging_leaves_nothing_and_the_older_folder_as_it_was() {
    let root = tempfile::tempdir().unwrap();
    publish(root.path(), "old");
    let staging = Staging::begin_in(registry(), Contents::Atlas, root.path(), "spot").unwrap();
    staging.write("atlas.json", b"half").unwrap();
    drop(staging);
    assert_eq!(names(root.path()), ["spot"]);
    assert_eq!(
        fs::read(root.path().join("spot/atlas.json")).unwrap(),
        b"old"
    );
}

#[test]
fn an_interrupt_removes_unfinished_folders_and_refuses_more() {
    let root = tempfile::tempdir().unwrap();
    publish(root.path(), "old");
    let registry = registry();
    let staging = Staging::begin_in(registry, Contents::Atlas, root.path(), "spot").unwrap();
    let mut open = staging.create("atlas.npz").unwrap();
    registry.close();
    assert_eq!(names(root.path()), ["spot"]);
    open.write_all(b"late").unwrap();
    assert!(matches!(
        staging.write("atlas.json", b"late"),
        Err(ExportError::Interrupted)
    ));
    let again = Staging::begin_in(registry, Contents::Atlas, root.path(), "cow");
    assert!(matches!(again, Err(ExportError::Interrupted)));
    assert!(staging.publish().is_err());
    assert_eq!(names(root.path()), ["spot"]);
    assert_eq!(
        fs::read(root.path().join("spot/atlas.json")).unwrap(),
        b"old"
    );
}

#[test]
fn folders_of_others_are_not_replaced() {
    let root = tempfile::tempdir().unwrap();
    fs::create_dir(root.path().join("spot")).unwrap();
    publish(root.path(), "an empty folder may be replaced");
    fs::create_dir(root.path().join("holiday")).unwrap();
    fs::write(root.path().join("holiday/photo.png"), b"dear").unwrap();
    fs::write(root.path().join("file"), b"dear").unwrap();
    let begin =
        |name| Staging::begin_in(registry(), Contents::Atlas, root.path(), name).map(|_| ());
    assert!(matches!(
        begin("holiday"),
        Err(ExportError::ForeignFolder { .. })
    ));
    assert!(matches!(begin("file"), Err(ExportError::NotAFolder { .. })));
    for name in ["", ".", "..", ".hidden", "a/b", "a\\b", "manifest.jsonl"] {
        assert!(
            matches!(begin(name), Err(ExportError::AssetName { .. })),
            "{name:?}"
        );
    }
    assert_eq!(names(root.path()), ["file", "holiday", "spot"]);
}

#[test]
fn paths_stay_inside_the_staging_folder() {
    let root = tempfile::tempdir().unwrap();
    let staging = Staging::begin_in(registry(), Contents::Atlas, root.path(), "spot").unwrap();
    for path in ["", "../escape", "/etc/escape", "images/../../escape"] {
        assert!(
            matches!(staging.write(path, b""), Err(ExportError::Encode { .. })),
            "{path:?}"
        );
    }
}

#[test]
fn a_failed_component_keeps_its_older_folder() {
    let root = tempfile::tempdir().unwrap();
    let staging = Staging::begin_in(registry(), Contents::Atlas, root.path(), "spot").unwrap();
    staging.write("component-000/atlas.json", b"old 0").unwrap();
    staging
        .write("component-000/images/0000.exr", b"old image")
        .unwrap();
    staging.write("component-001/atlas.json", b"old 1").unwrap();
    staging.publish().unwrap();
    let staging = Staging::begin_in(registry(), Contents::Atlas, root.path(), "spot").unwrap();
    assert!(staging.keep_previous(&component_name(0)).unwrap());
    assert!(!staging.keep_previous(&component_name(7)).unwrap());
    staging.write("component-001/atlas.json", b"new 1").unwrap();
    staging.publish().unwrap();
    let spot = root.path().join("spot");
    assert_eq!(
        fs::read(spot.join("component-000/images/0000.exr")).unwrap(),
        b"old image"
    );
    assert_eq!(
        fs::read(spot.join("component-001/atlas.json")).unwrap(),
        b"new 1"
    );
    assert_eq!(
        list_files(&spot).unwrap(),
        [
            "component-000/atlas.json",
            "component-000/images/0000.exr",
            "component-001/atlas.json"
        ]
    );
}

#[test]
fn only_what_dead_processes_of_this_machine_left_is_swept() {
    let root = tempfile::tempdir().unwrap();
    let make = |name: &str| fs::create_dir_all(root.path().join(name).join("images")).unwrap();
    let machine = &*MACHINE;
    make(&format!("{PREFIX}staging-{machine}-111-0-"));
    make(&format!("{PREFIX}staging-{machine}-222-0-"));
    make(&format!("{PREFIX}staging-another0-111-0-"));
    make(&format!("{PREFIX}aside-{machine}-111-0-back-in-place"));
    make(&format!("{PREFIX}aside-{machine}-111-1-spot"));
    make(&format!("{PREFIX}staging-{machine}-nonsense-0-"));
    make("spot");
    fs::write(
        root.path()
            .join(format!("{PREFIX}staging-{machine}-111-2-")),
        b"",
    )
    .unwrap();
    sweep(root.path(), &|process| process == 111).unwrap();
    let mut expected = vec![
        "back-in-place".to_owned(),
        "spot".into(),
        format!("{PREFIX}staging-{machine}-222-0-"),
        format!("{PREFIX}staging-another0-111-0-"),
        format!("{PREFIX}staging-{machine}-nonsense-0-"),
    ];
    expected.sort();
    assert_eq!(names(root.path()), expected);
    assert!(!process_is_gone(std::process::id()));
}

#[test]
fn replacing_without_an_exchange_works_and_fails_safely() {
    let root = tempfile::tempdir().unwrap();
    let (new, target) = (root.path().join("new"), root.path().join("spot"));
    for (folder, text) in [(&new, "new"), (&target, "old")] {
        fs::create_dir(folder).unwrap();
        fs::write(folder.join("atlas.json"), text).unwrap();
    }
    set_aside(&new, &target).unwrap();
    assert_eq!(names(root.path()), ["spot"]);
    assert_eq!(fs::read(target.join("atlas.json")).unwrap(), b"new");
    // `new` is gone: the older folder must come back.
    assert!(set_aside(&new, &target).is_err());
    assert_eq!(names(root.path()), ["spot"]);
    assert_eq!(fs::read(target.join("atlas.json")).unwrap(), b"new");
}

#[test]
fn a_file_is_replaced_in_one_step() {
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("logs/manifest.jsonl");
    write_file_atomically(&path, b"1").unwrap();
    write_file_atomically(&path, b"2").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"2");
    assert_eq!(names(path.parent().unwrap()), ["manifest.jsonl"]);
    let blocked = root.path().join("logs/manifest.jsonl/inside");
    let error = write_file_atomically(&blocked, b"3")
        .unwrap_err()
        .to_string();
    assert!(error.contains("cannot create the folder"), "{error}");
}

#[test]
fn an_exchange_swaps_two_folders() {
    let root = tempfile::tempdir().unwrap();
    let (a, b) = (root.path().join("a"), root.path().join("b"));
    for (folder, text) in [(&a, "a"), (&b, "b")] {
        fs::create_dir(folder).unwrap();
        fs::write(folder.join("name"), text).unwrap();
    }
    let swapped = exchange(&a, &b);
    let read = |folder: &Path| fs::read_to_string(folder.join("name")).unwrap();
    // Where the system cannot do it, it must have done nothing.
    let expected = if swapped.is_ok() {
        ["b", "a"]
    } else {
        ["a", "b"]
    };
    assert_eq!([read(&a), read(&b)], expected);
    assert!(exchange(&a, &root.path().join("missing")).is_err());
    assert_eq!(read(&a), expected[0]);
    if let Err(error) = swapped {
        println!("skipped: no exchange of folders here: {error}");
    }
}

#[test]
fn one_kind_of_folder_never_replaces_another() {
    let root = tempfile::tempdir().unwrap();
    let begin = |contents, name| Staging::begin_in(registry(), contents, root.path(), name);
    let cones = begin(Contents::Cones, "spot.cones").unwrap();
    cones.write("cones.json", b"{}").unwrap();
    cones.write("spot.cones-8.component-000.png", b"").unwrap();
    cones.publish().unwrap();
    let refused = begin(Contents::Atlas, "spot.cones").map(|_| ());
    assert!(matches!(refused, Err(ExportError::ForeignFolder { .. })));
    begin(Contents::Cones, "spot.cones").unwrap();

    let atlas = begin(Contents::Atlas, "spot").unwrap();
    atlas.write("atlas.json", b"{}").unwrap();
    atlas.publish().unwrap();
    let refused = begin(Contents::Cones, "spot").map(|_| ());
    assert!(matches!(refused, Err(ExportError::ForeignFolder { .. })));
}

#[test]
fn a_withdrawn_asset_of_one_component_leaves_no_file_behind() {
    let (root, registry) = (tempfile::tempdir().unwrap(), registry());
    let staging = Staging::begin_in(registry, Contents::Atlas, root.path(), "spot").unwrap();
    staging.write("atlas.json", b"grid").unwrap();
    staging.write("images/0000.exr", b"of a block").unwrap();
    assert!(!staging.withdraw("").unwrap());
    staging.write("atlas.json", b"flat").unwrap();
    staging.publish().unwrap();
    let out = root.path().join("spot");
    assert_eq!(list_files(&out).unwrap(), ["atlas.json"]);
    assert_eq!(fs::read(out.join("atlas.json")).unwrap(), b"flat");
}
