//! `report.html` and `index.html` in a browser: everything on them answers, nothing complains, nothing is asked of the network.
//!
//! Needs Chromium on the path (or named by `CHROMIUM`) and Playwright for `AFFINE_ATLAS_PYTHON` (or `python3`); without them the cases are
//! reported as ignored. `SCREENSHOTS=DIR` keeps pictures of the pages.

use libtest_mimic::{Failed, Trial};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A name that would be markup if it were not text.
const HOSTILE: &str = "<img src=x onerror=alert(1)>&amp;\"'";

pub fn trials() -> Vec<Trial> {
    let ignored = !has_browser();
    let trial = |name: &str, test: fn() -> Result<(), Failed>| {
        Trial::test(format!("pages/{name}"), test).with_ignored_flag(ignored)
    };
    vec![
        trial("closed", || report("genus-3-pretzel.obj", "closed", &[])),
        trial("hostile_name", || {
            report("three-boundaries-rabbit.ply", HOSTILE, &[])
        }),
        trial("flat", || {
            report("genus-1-mug.off", "flat", &["images.domain=flat"])
        }),
        trial("undrawn", undrawn),
        trial("index", index),
    ]
}

fn python() -> OsString {
    std::env::var_os("AFFINE_ATLAS_PYTHON").unwrap_or_else(|| "python3".into())
}

fn has_browser() -> bool {
    let works = |command: &mut Command| command.output().is_ok_and(|o| o.status.success());
    let chromium = std::env::var_os("CHROMIUM").unwrap_or_else(|| "chromium".into());
    works(Command::new(python()).args(["-c", "import playwright"]))
        && works(Command::new(chromium).arg("--version"))
}

fn good(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/good")
        .join(name)
}

fn build(folder: &Path, inputs: &[PathBuf], settings: &[&str]) -> Result<Output, Failed> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command.current_dir(folder).arg("build").args(inputs);
    command.args(["--quiet", "--out", "out"]);
    let cheap = ["pictures.enabled=false", "patches.texel_budget=65536"];
    for setting in cheap.iter().chain(settings) {
        command.args(["--set", setting]);
    }
    Ok(command.output()?)
}

fn click(pages: &[PathBuf]) -> Result<(), Failed> {
    let output = Command::new(python())
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/click_reports.py"))
        .args(pages)
        .output()?;
    match output.status.success() {
        true => Ok(()),
        false => Err(format!(
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        )
        .into()),
    }
}

/// The page of one fixture under a name of its own.
fn report(fixture: &str, name: &str, settings: &[&str]) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let extension = fixture.rsplit('.').next().unwrap_or_default();
    let input = folder.path().join(format!("{name}.{extension}"));
    std::fs::copy(good(fixture), &input)?;
    let output = build(folder.path(), &[input], settings)?;
    // Folders have plainer names than files may have; the page names the file.
    let entries = std::fs::read_dir(folder.path().join("out"))?;
    let pages = entries.flatten().map(|e| e.path().join("report.html"));
    match &pages.filter(|page| page.is_file()).collect::<Vec<_>>()[..] {
        [page] => click(std::slice::from_ref(page)),
        _ => Err(String::from_utf8_lossy(&output.stderr).into_owned().into()),
    }
}

/// A surface that is not drawn leaves a page whose tables answer.
fn undrawn() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let input = good("disk-mask.obj");
    build(folder.path(), &[input], &["report.max_faces=10"])?;
    let page = folder.path().join("out/disk-mask/report.html");
    let text = std::fs::read_to_string(&page)?;
    if !text.contains("report.max_faces") || text.contains("id=\"view-space\"") {
        return Err("the surface is drawn".into());
    }
    click(&[page])
}

/// Two runs: what failed is mended, what was good fails, one is new.
fn index() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let place = |name: &str| folder.path().join(name);
    let bad = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/bad/moebius-strip.obj");
    let hostile = format!("{HOSTILE}.obj");
    std::fs::copy(&bad, place("mended.obj"))?;
    std::fs::copy(good("disk-mask.obj"), place("breaks.obj"))?;
    std::fs::copy(good("disk-mask.obj"), place(&hostile))?;
    let first = [place("mended.obj"), place("breaks.obj"), place(&hostile)];
    build(folder.path(), &first, &[])?;
    std::fs::copy(good("disk-mask.obj"), place("mended.obj"))?;
    std::fs::copy(&bad, place("breaks.obj"))?;
    std::fs::copy(good("genus-0-cube.obj"), place("new.obj"))?;
    let second = [&first[..], &[place("new.obj")]].concat();
    build(folder.path(), &second, &[])?;
    let page = place("out/index.html");
    let text = std::fs::read_to_string(&page)?;
    for group in ["</b> New failures", "</b> Fixed", "</b> New"] {
        if !text.contains(group) {
            return Err(format!("index.html has no group {group}").into());
        }
    }
    click(&[page])
}
