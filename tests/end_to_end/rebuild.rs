//! Meshes rebuilt from geometry images: watertight, near the input, and refused with the reason where a folder is damaged.

use crate::command::{Built, build, document, program, verify};
use crate::real_models::arrays::array;
use affine_atlas::geometry::connectivity::{Connectivity, Topology};
use affine_atlas::read::{ReadParams, read};
use std::path::{Path, PathBuf};
use std::process::Output;

fn rebuild(folder: &Path, into: &Path, more: &[&str]) -> Output {
    let mut command = program();
    command.arg("rebuild").arg(folder).arg("--out").arg(into);
    command.args(more).output().expect("the program starts")
}

/// Counted on the faces of the file, nothing welded.
fn topology(glb: &Path) -> Topology {
    let soup = read(glb, &ReadParams::default()).expect("a mesh").soup;
    let connectivity = Connectivity::from_faces(&soup.faces, soup.positions.len());
    connectivity.expect("a surface").topology()
}

fn fixture(name: &str) -> PathBuf {
    Path::new("fixtures/good").join(name)
}

/// Rebuilds what a setting makes: the mesh has the surface's topology, says how far it is, and the build says the same within so many decibels. Gives
/// the PSNR, the mean angle between normals, and the document.
fn comes_back(
    name: &str,
    (genus, loops): (i64, usize),
    setting: &str,
    within: f64,
) -> (f64, f64, serde_json::Value) {
    let built = build(&fixture(name), &[setting]);
    let atlas = built.atlas();
    verify(&atlas);
    let glb = atlas.join("again.glb");
    let mesh = fixture(name);
    let against = mesh.to_str().expect("UTF-8");
    let output = rebuild(&atlas, &glb, &["--json", "--against", against]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{name} {setting}: {said}");
    let found = topology(&glb);
    assert_eq!((found.genus, found.boundary_loops), (genus, loops));
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let psnr = figures["compared"]["psnr_db"].as_f64().expect("a number");
    let document = document(&atlas);
    let quality = &document["quality"];
    let stated = quality["image_psnr_db"].as_f64().expect("stated");
    // The build measures fewer samples.
    assert!(
        (psnr - stated).abs() < within || psnr.min(stated) > 140.0,
        "{name} {setting}: {psnr} {stated}"
    );
    let hausdorff = figures["compared"]["hausdorff"].as_f64().expect("a number");
    let stated = quality["image_hausdorff"].as_f64().expect("stated");
    assert!(
        stated <= 1.5 * hausdorff || psnr > 140.0,
        "{name} {setting}: {stated} of {hausdorff}"
    );
    let angle = quality["image_normal_error"]["mean"].as_f64();
    (psnr, angle.expect("a number"), document)
}

/// From flat images: finer is nearer.
fn comes_back_from_flat(name: &str, genus: i64, loops: usize) {
    let mut last = 0.0;
    for side in [64, 256] {
        let budget = format!("patches.texel_budget={}", side * side);
        let (psnr, angle, document) = comes_back(name, (genus, loops), &budget, 0.5);
        // Normals are off by the angle that the surface turns by within a texel.
        let number = |i: &serde_json::Value, side: &str| i[side].as_f64().expect("a number");
        let images = document["patches"].as_array().expect("images").iter();
        let texels: f64 = images
            .map(|i| number(i, "width") * number(i, "height"))
            .sum();
        let turned = angle * texels.sqrt();
        assert!(turned < 21.0, "{name} {side}: {turned:?}");
        // 64² texels are few for the animal, margins included.
        assert!(
            psnr > 43.0 && psnr > last + 5.0 || psnr > 120.0,
            "{name} {side}: {psnr} after {last}"
        );
        last = psnr;
    }
}

/// From the blocks of a grid, which a build measures in another way, as near as docs/output.md says: finer is nearer.
#[test]
fn from_blocks() {
    for (name, genus, loops) in [
        ("genus-0-animal.ply", 0, 0),
        ("genus-0-cube.obj", 0, 0),
        ("genus-2-amphora.glb", 2, 0),
        ("three-boundaries-rabbit.ply", 0, 3),
    ] {
        let at = |samples: usize| {
            let setting = format!("grid.samples_per_cell={samples}");
            let (psnr, angle, _) = comes_back(name, (genus, loops), &setting, 1.1);
            (psnr, angle)
        };
        let (coarse, fine) = (at(2), at(8));
        assert!(
            fine.0 > coarse.0 + 5.0 || fine.0 > 120.0,
            "{name}: {coarse:?} {fine:?}"
        );
        assert!(fine.1 <= coarse.1, "{name}: {coarse:?} {fine:?}");
    }
}

#[test]
fn genus_0_animal() {
    comes_back_from_flat("genus-0-animal.ply", 0, 0);
}

#[test]
fn genus_0_cube() {
    comes_back_from_flat("genus-0-cube.obj", 0, 0);
}

#[test]
fn genus_1_mug() {
    comes_back_from_flat("genus-1-mug.off", 1, 0);
}

#[test]
fn genus_2_amphora() {
    comes_back_from_flat("genus-2-amphora.glb", 2, 0);
}

#[test]
fn genus_3_pretzel() {
    comes_back_from_flat("genus-3-pretzel.obj", 3, 0);
}

#[test]
fn disk_mask() {
    comes_back_from_flat("disk-mask.obj", 0, 1);
}

#[test]
fn three_boundaries_rabbit() {
    comes_back_from_flat("three-boundaries-rabbit.ply", 0, 3);
}

/// The same bytes for any number of threads.
#[test]
fn threads_do_not_change_a_byte() {
    let built = build(&fixture("genus-3-pretzel.obj"), &[]);
    let atlas = built.atlas();
    let bytes = |threads: &str| {
        let glb = built.folder.path().join(format!("{threads}.glb"));
        let output = rebuild(&atlas, &glb, &["--threads", threads]);
        assert!(output.status.success());
        std::fs::read(glb).expect("written")
    };
    assert!(bytes("1") == bytes("3"));
}

/// Nothing but images, `atlas.json` and the seam arrays is read.
#[test]
fn the_surface_is_not_used() {
    let built = build(&fixture("genus-1-mug.off"), &[]);
    let atlas = built.atlas();
    let first = atlas.join("first.glb");
    assert!(rebuild(&atlas, &first, &[]).status.success());
    std::fs::remove_file(atlas.join("surface.glb")).expect("there");
    write_npz(&atlas, &Seams::of(&atlas));
    let second = atlas.join("second.glb");
    let output = rebuild(&atlas, &second, &[]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let read = |path: &Path| std::fs::read(path).expect("written");
    assert!(read(&first) == read(&second));
}

/// Every component becomes a mesh of the same file.
#[test]
fn components_stay_apart() {
    let built = build(Path::new("fixtures/bad/one-bad-component.obj"), &[]);
    assert_eq!(built.code(), Some(1), "one of them is one-sided");
    let folder = built.folder.path().join("one-bad-component");
    let glb = built.folder.path().join("again.glb");
    let output = rebuild(&folder, &glb, &[]);
    assert!(output.status.success());
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.starts_with("component-00"), "{said}");
    let soup = read(&glb, &ReadParams::default()).expect("a mesh").soup;
    assert_eq!(soup.parts.len(), built.atlases().len());
}

/// The arrays that a rebuilding reads.
#[derive(Clone)]
struct Seams {
    offset: Vec<u32>,
    position: Vec<f64>,
    uv: Vec<f64>,
    patch: Vec<u32>,
}

impl Seams {
    fn of(atlas: &Path) -> Self {
        Self {
            offset: array(atlas, "seam_offset"),
            position: array(atlas, "seam_position"),
            uv: array(atlas, "seam_uv"),
            patch: array(atlas, "seam_patch"),
        }
    }
}

/// Replaces `atlas.npz` by one with the seam arrays alone.
fn write_npz(atlas: &Path, seams: &Seams) {
    use std::io::Write;
    let file = std::fs::File::create(atlas.join("atlas.npz")).expect("writable");
    let mut zip = zip::ZipWriter::new(file);
    let mut add = |name: &str, kind: &str, shape: &str, bytes: Vec<u8>| {
        let mut header =
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let options = zip::write::SimpleFileOptions::default();
        zip.start_file(format!("{name}.npy"), options)
            .expect("an entry");
        zip.write_all(b"\x93NUMPY\x01\x00").expect("written");
        zip.write_all(&(header.len() as u16).to_le_bytes())
            .expect("written");
        zip.write_all(header.as_bytes()).expect("written");
        zip.write_all(&bytes).expect("written");
    };
    let words = |values: &[u32]| values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let doubles = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect();
    let (n, m, s) = (
        seams.offset.len(),
        seams.position.len() / 3,
        seams.patch.len() / 2,
    );
    add("seam_offset", "<u4", &format!("{n},"), words(&seams.offset));
    add(
        "seam_position",
        "<f8",
        &format!("{m}, 3"),
        doubles(&seams.position),
    );
    add(
        "seam_uv",
        "<f8",
        &format!("{}, 2, 2", seams.uv.len() / 4),
        doubles(&seams.uv),
    );
    add("seam_patch", "<u4", &format!("{s}, 2"), words(&seams.patch));
    zip.finish().expect("finished");
}

fn edit_json(atlas: &Path, edit: impl Fn(&mut serde_json::Value)) {
    let mut document = document(atlas);
    edit(&mut document);
    std::fs::write(atlas.join("atlas.json"), document.to_string()).expect("writable");
}

fn edit_seams(atlas: &Path, edit: impl Fn(&mut Seams)) {
    let mut seams = Seams::of(atlas);
    edit(&mut seams);
    write_npz(atlas, &seams);
}

/// What is wrong with a damaged folder: exit code 1, nothing written, one sentence. The folder's place is left out.
fn refusal(damage: impl Fn(&Path)) -> String {
    let built: Built = build(&fixture("genus-0-cube.obj"), &["patches.texel_budget=4096"]);
    let atlas = built.atlas();
    damage(&atlas);
    let glb = built.folder.path().join("again.glb");
    let output = rebuild(&atlas, &glb, &[]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(!glb.exists(), "nothing is written");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    let place = atlas.display().to_string();
    said.replace(&place, "CUBE").trim().to_owned()
}

#[test]
fn files_that_are_missing_or_do_not_fit() {
    let said = refusal(|atlas| std::fs::remove_file(atlas.join("images/0000.exr")).expect("there"));
    assert!(
        said.starts_with("failed: CUBE (input): CUBE/images/0000.exr: "),
        "{said}"
    );
    let said = refusal(|atlas| {
        std::fs::write(atlas.join("images/0000.exr"), b"v/1\x01").expect("writable")
    });
    assert!(
        said.starts_with("failed: CUBE (input): CUBE/images/0000.exr: "),
        "{said}"
    );
    let said = refusal(|atlas| edit_json(atlas, |d| d["patches"][0]["width"] = 7.into()));
    insta::assert_snapshot!(said, @"failed: CUBE (input): CUBE/images/0000.exr has 26 columns and 26 rows, but atlas.json states 7 and 26");
    let said = refusal(|atlas| edit_json(atlas, |d| d["patches"][0]["domain"] = "hexagon".into()));
    insta::assert_snapshot!(said, @r#"failed: CUBE (input): patch 0 of CUBE/atlas.json has the domain "hexagon"; it must be "flat" or "grid""#);
    let said = refusal(|atlas| edit_json(atlas, |d| d["version"] = 3.into()));
    insta::assert_snapshot!(said, @r#"failed: CUBE (input): CUBE/atlas.json says format "affine-atlas", version 3; this program reads "affine-atlas", versions 1 and 2"#);
    let said =
        refusal(|atlas| edit_json(atlas, |d| d["patches"][0]["image"] = "../0000.exr".into()));
    insta::assert_snapshot!(said, @r#"failed: CUBE (input): row 0 of the patches in CUBE/atlas.json has the id 0 and the image "../0000.exr"; ids count from 0 and images lie in the folder"#);
    let said = refusal(|atlas| edit_json(atlas, |d| d["patches"] = serde_json::json!([])));
    insta::assert_snapshot!(said, @"failed: CUBE (input): genus-0-cube: seam 0 names patch 0, but there are 0");
    let said = refusal(|atlas| edit_json(atlas, |d| d["topology"]["genus"] = 1.into()));
    insta::assert_snapshot!(said, @"failed: CUBE (input): genus-0-cube: the mesh rebuilt from the images has genus 0, but 1 is stated; images, seams and atlas.json do not belong together");
    let said = refusal(|atlas| {
        edit_json(atlas, |d| {
            d["patches"][0]["texel_to_patch"][1][1] = 0.0.into()
        })
    });
    insta::assert_snapshot!(said, @"failed: CUBE (input): genus-0-cube: texel_to_patch of patch 0 has determinant 0e0; it must be finite and not zero");
    let said = refusal(|atlas| {
        let bytes = std::fs::read(atlas.join("atlas.npz")).expect("there");
        std::fs::write(atlas.join("atlas.npz"), &bytes[..bytes.len() / 2]).expect("writable");
    });
    assert!(
        said.starts_with("failed: CUBE (input): CUBE/atlas.npz: "),
        "{said}"
    );
}

#[test]
fn seams_that_do_not_bound_patches() {
    let seams = |edit: fn(&mut Seams)| refusal(|atlas| edit_seams(atlas, edit));
    insta::assert_snapshot!(seams(|s| s.position[4] = f64::NAN), @"failed: CUBE (input): genus-0-cube: sample 1 of seam 0 has the position NaN; it must be finite");
    insta::assert_snapshot!(seams(|s| s.uv[0] = f64::INFINITY), @"failed: CUBE (input): genus-0-cube: sample 0 of seam 0 has the patch coordinate inf; it must be finite");
    insta::assert_snapshot!(seams(|s| s.uv[0] = 9.0), @"failed: CUBE (input): genus-0-cube: sample 0 of seam 0 lies at column 200.000, row 2.000 of patch 0, whose image has 26 columns and 26 rows");
    insta::assert_snapshot!(seams(|s| s.uv[0] += 1e-3), @"failed: CUBE (input): genus-0-cube: the seams do not close around patch 0: where seam 1 ends, no seam begins (the nearest begins 0.022 texels away)");
    insta::assert_snapshot!(seams(|s| s.patch[0] = 77), @"failed: CUBE (input): genus-0-cube: seam 0 names patch 77, but there are 6");
    insta::assert_snapshot!(seams(|s| s.offset[1] = 1), @"failed: CUBE (input): genus-0-cube: seam 0 has 1 samples; a seam has at least 2");
    insta::assert_snapshot!(seams(|s| { s.offset.pop(); }), @"failed: CUBE (input): seam_offset of CUBE/atlas.npz must rise from 0 to the 48 samples and have one entry more than the 12 seams; it has 12 entries and ends with 44");
    insta::assert_snapshot!(seams(|s| s.uv.truncate(8)), @"failed: CUBE (input): CUBE/atlas.npz: seam_uv: shape [2, 2, 2] is not (48, 2, 2); build the atlas again, or give its complete folder");
    insta::assert_snapshot!(
        seams(|s| {
            s.offset.truncate(1);
            s.position.clear();
            s.uv.clear();
            s.patch.clear();
        }),
        @"failed: CUBE (input): genus-0-cube: no seam runs along patch 0; the seams must close around every patch"
    );
    // One seam is no boundary any more.
    insta::assert_snapshot!(seams(|s| s.patch[1] = u32::MAX), @"failed: CUBE (input): genus-0-cube: the seams do not close around patch 2: where seam 9 ends, no seam begins (the nearest begins 22.000 texels away)");
}

#[test]
fn wrong_arguments() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = rebuild(folder.path(), &folder.path().join("a.obj"), &[]);
    assert_eq!(output.status.code(), Some(2));
    let output = rebuild(
        &folder.path().join("nowhere"),
        &folder.path().join("a.glb"),
        &[],
    );
    assert_eq!(output.status.code(), Some(2));
    let output = rebuild(folder.path(), &folder.path().join("a.glb"), &[]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("holds no atlas.json"), "{said}");
}
