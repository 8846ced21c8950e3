//! The committed fixtures are what their generator makes, and are as small as promised.

#[path = "../../fixtures/generate/mod.rs"]
pub mod generate;

use std::collections::BTreeMap;
use std::path::Path;

#[test]
fn committed_fixtures_are_what_the_generator_makes() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let made: BTreeMap<String, Vec<u8>> = (generate::all().into_iter())
        .map(|fixture| (fixture.path, fixture.bytes))
        .collect();
    for (path, bytes) in &made {
        let committed = std::fs::read(root.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"));
        assert!(
            &committed == bytes,
            "{path} differs: run `cargo run --example generate-fixtures`"
        );
        assert!(bytes.len() <= 1 << 20, "{path} holds more than 1 MiB");
    }
    let total: usize = made.values().map(Vec::len).sum();
    assert!(total <= 8 << 20, "{total} bytes together");
    for folder in ["good", "bad"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("the folder is committed") {
            let name = entry.expect("readable").file_name();
            let path = format!("{folder}/{}", name.to_string_lossy());
            assert!(made.contains_key(&path), "{path} is made by nobody");
        }
    }
}
