//! Agreement with an independent prototype.

use super::models::Model;
use crate::real_models::arrays::Npy;
use std::io::Read;
use std::path::Path;

/// Bound on the difference of two u.
const TOLERANCE: f64 = 1e-7;

pub fn agree(corpus: &Path, reference: &Path) -> Result<(), String> {
    let file = std::fs::File::open(reference).unwrap();
    let mut archive = zip::ZipArchive::new(file).unwrap();
    let mut names: Vec<String> = (archive.file_names().flatten().map(|n| n.into_owned())).collect();
    names.retain(|n| n.ends_with(".u.npy"));
    names.sort();
    let mut failures = Vec::new();
    for name in &names {
        let entry = name.trim_end_matches(".u.npy");
        let model_name = entry.trim_end_matches("-one-cone");
        let model = ["obj", "off"]
            .map(|e| corpus.join(format!("{model_name}.{e}")))
            .into_iter()
            .find(|p| p.is_file())
            .ok_or(format!("no model {model_name}"))?;
        let model = Model::read(&model);
        let mut array = |what: &str| {
            let mut bytes = Vec::new();
            let mut file = archive.by_name(&format!("{entry}.{what}.npy")).unwrap();
            file.read_to_end(&mut bytes).unwrap();
            bytes
        };
        let floats = |bytes: Vec<u8>| Npy::new(&bytes).numbers::<f64>();
        let (u, curvature) = (floats(array("u")), floats(array("curvature")));
        let cones = array("cones");
        let cones = Npy::new(&cones).numbers::<u32>();
        let cones: Vec<(usize, f64)> = cones.iter().map(|&v| v as usize).zip(curvature).collect();
        let flat = model
            .flow(&model.prescribe(&cones), 1e-11)
            .map_err(|e| format!("{entry}: {e}"))?;
        let mean = flat.log_scale.iter().sum::<f64>() / u.len() as f64;
        let worst = flat
            .log_scale
            .iter()
            .zip(&u)
            .map(|(a, b)| (a - mean - b).abs())
            .fold(0.0, f64::max);
        println!("{entry}: {worst:.1e}, {:?}", flat.history.last());
        if worst.is_nan() || worst > TOLERANCE || u.len() != flat.log_scale.len() {
            failures.push(format!("{entry}: u differs by {worst:e}"));
        }
    }
    match failures.is_empty() && !names.is_empty() {
        true => Ok(()),
        false => Err(failures.join("\n")),
    }
}
