//! Arrays of `atlas.npz`.

use npyz::NpyFile;
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
