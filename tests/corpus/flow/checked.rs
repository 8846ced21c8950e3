//! What the flow found, as a whole atlas: the program builds it, its own `verify` and an independent checker look at it.

use super::models::Model;
use super::prescriptions;
use crate::real_models::{checked, comparable, succeed};
use std::path::Path;
use std::process::Command;

/// The first of the random prescriptions of a model.
pub fn first_prescription(file: &Path) -> Result<(), String> {
    let model = Model::read(file);
    let prescription = prescriptions::random(&model, 0, prescriptions::RANGE);
    let cones: Vec<String> = prescription
        .cones
        .iter()
        .map(|cone| {
            let vertex = model.source_vertex[cone.vertex.index()];
            let curvature = cone.curvature / std::f64::consts::PI;
            format!("{{ vertex = {vertex}, curvature = {curvature:?} }}")
        })
        .collect();
    let list = format!("cones.list=[{}]", cones.join(", "));
    let strategy = match cones.is_empty() {
        true => "cones.strategy=none",
        false => "cones.strategy=listed",
    };
    build_and_check(file, &[&list, strategy], cones.len())
}

/// All curvature at one vertex, with the connectivity as it is.
pub fn single_cone(file: &Path, genus: i64) -> Result<(), String> {
    assert_eq!(Model::read(file).connectivity.topology().genus, genus);
    let settings = ["cones.strategy=single", "connectivity.enabled=false"];
    build_and_check(file, &settings, 1)
}

fn build_and_check(file: &Path, settings: &[&str], cones: usize) -> Result<(), String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let mut command = program();
    command
        .arg("build")
        .arg(file)
        .arg("--out")
        .arg(folder.path());
    let fixed = ["flow.scheme=vertex-scaling", "pictures.enabled=false"];
    for setting in fixed.iter().chain(settings) {
        command.arg("--set").arg(setting);
    }
    succeed("build", &mut command)?;
    let atlas = folder.path().join(file.file_stem().unwrap_or_default());
    let text = std::fs::read(atlas.join("atlas.json")).map_err(|e| e.to_string())?;
    let json: serde_json::Value = serde_json::from_slice(&text).map_err(|e| e.to_string())?;
    let error = json["metric"]["max_curvature_error"].as_f64();
    if error.is_none_or(|e| e > 1e-10) {
        return Err(format!("curvature error {error:?}"));
    }
    succeed("verify", program().arg("verify").arg(&atlas))?;
    checked(&atlas, comparable(file), Some(cones))
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_affine-atlas"))
}
