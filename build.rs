//! Says at compile time whether there is a corpus of real models, so that tests which need one are reported as
//! ignored where there is none, not as passed.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(corpus)");
    println!("cargo::rerun-if-env-changed=AFFINE_ATLAS_CORPUS");
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var_os("AFFINE_ATLAS_CORPUS").is_some() {
        println!("cargo::rustc-cfg=corpus");
    }
}
