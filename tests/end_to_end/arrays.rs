//! Arrays of `atlas.npz`.

use npyz::NpyFile;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// One array, flat in C order.
pub fn array<T: npyz::Deserialize>(atlas: &Path, name: &str) -> Vec<T> {
    let file = File::open(atlas.join("atlas.npz")).expect("atlas.npz");
    let mut archive = zip::ZipArchive::new(file).expect("a zip file");
    let mut bytes = Vec::new();
    let entry = archive.by_name(&format!("{name}.npy"));
    let mut entry = entry.unwrap_or_else(|e| panic!("{name}: {e}"));
    entry.read_to_end(&mut bytes).expect("readable");
    let array = NpyFile::new(&bytes[..]).expect("a NumPy array");
    array.into_vec().unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// NumPy's name of the type and the shape of every array.
pub fn shapes(atlas: &Path) -> BTreeMap<String, (&'static str, Vec<u64>)> {
    let file = File::open(atlas.join("atlas.npz")).expect("atlas.npz");
    let mut archive = zip::ZipArchive::new(file).expect("a zip file");
    let mut found = BTreeMap::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).expect("an entry");
        let file_name = entry.name().expect("a name").into_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("readable");
        let array = NpyFile::new(&bytes[..]).expect("a NumPy array");
        let dtype = match array.dtype().descr().trim_matches('\'') {
            "<f8" => "float64",
            "<u4" => "uint32",
            "|u1" => "uint8",
            other => panic!("{file_name}: {other}"),
        };
        let name = file_name.trim_end_matches(".npy").to_owned();
        found.insert(name, (dtype, array.shape().to_vec()));
    }
    found
}
