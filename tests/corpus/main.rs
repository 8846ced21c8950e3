//! The program on real models and in the hands of others: builds, flows, images and rebuilt meshes, damaged meshes, independent checkers,
//! readers of what is written, a browser. One binary, so that no core waits for the last case of each kind.
//!
//! Cases that need what is not there are reported as ignored: `AFFINE_ATLAS_CORPUS` names a folder with the models, `AFFINE_ATLAS_CHECKER` an independent
//! checker (a Python script), `AFFINE_ATLAS_PYTHON` (or `python3`) its interpreter. Large models are for `--ignored`.

#[path = "../end_to_end/command.rs"]
mod command;
mod damage;
mod flow;
mod models;
mod pages;
mod readers;
#[path = "../real_models/mod.rs"]
mod real_models;
mod rebuild;

fn main() {
    let arguments = libtest_mimic::Arguments::from_args();
    // The longest come first, so that no core waits for them in the end.
    let trials = [
        pages::trials(),
        models::trials(),
        rebuild::trials(),
        flow::trials(),
        damage::trials(),
        readers::trials(),
    ];
    libtest_mimic::run(&arguments, trials.into_iter().flatten().collect()).exit();
}
