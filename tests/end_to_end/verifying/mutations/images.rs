//! Damage to quality figures, patches, images, seams and the packed surface, and some that needs more words.

use super::*;

pub fn mutations() -> Vec<Mutation> {
    vec![
        mutation!(
            torus,
            "the area distortion untrue",
            |a| a.json["quality"]["area_distortion"] = json!(5.0),
            ["area distortion (9) as stated"]
        ),
        mutation!(
            torus,
            "the log scale untrue",
            |a| a.json["quality"]["log_scale"]["max"] = json!(5.0),
            ["log scale as stated"]
        ),
        mutation!(
            torus,
            "the angle error untrue",
            |a| a.json["quality"]["angle_error"]["max"] = json!(0.0),
            ["angle error as stated"]
        ),
        mutation!(
            torus,
            "the cut length untrue",
            |a| a.json["quality"]["cut_length"] = json!(1.0),
            ["cut length as stated"]
        ),
        mutation!(
            torus,
            "a closing error of less than nothing",
            |a| a.json["quality"]["layout_closing_error"] = json!(-1.0),
            ["layout closing error is stated"]
        ),
        mutation!(
            torus,
            "a position moved",
            |a| a.arrays.positions[30][0] += 0.05,
            ["texels hold the surface point"]
        ),
        mutation!(
            torus,
            "a face in a patch that is not there",
            |a| a.arrays.patch[3] = 9,
            ["every face in a patch"]
        ),
        mutation!(
            torus,
            "a face in a patch far away",
            |a| a.arrays.patch[3] = 1,
            [
                "every patch is connected off the cut",
                "patches lie inside their images",
                "seams run along every patch border",
                "seams sample every vertex of their chains",
                "texels outside every face are not marked",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            torus,
            "an empty patch",
            |a| {
                let mut patch = a.json["patches"][0].clone();
                patch["id"] = json!(2);
                patch["image"] = json!("images/0002.exr");
                append(a, "patches", patch);
                let picture = a.pictures[0].clone();
                a.pictures.push(picture);
            },
            [
                "every patch has faces",
                "images describe themselves",
                "texels outside every face are not marked",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            torus,
            "a patch moved onto itself",
            |a| {
                // The second half of the rows goes back over the first by whole cells.
                for f in 48..96 {
                    let back = a.arrays.patch_uv[f - 48];
                    a.arrays.patch_uv[f] = back;
                }
            },
            [
                "no two faces of a patch overlap",
                "patches are continuous inside",
                "patches are similar to the central chart, positive, injective",
                "patches keep flat lengths at their scale",
                "seam samples hold the surface point on both sides",
                "texels are covered at most once",
                "texels hold the log scale",
                "texels hold the surface point",
                "texels name their face",
                "texels outside every face are not marked"
            ]
        ),
        mutation!(
            torus,
            "a corner of a patch off",
            |a| a.arrays.patch_uv[33][2][0] += 1e-5,
            [
                "no two faces of a patch overlap",
                "patches are continuous inside",
                "patches are similar to the central chart, positive, injective",
                "patches keep flat lengths at their scale"
            ]
        ),
        mutation!(
            torus,
            "a face of a patch turned over",
            |a| a.arrays.patch_uv[33].swap(0, 1),
            [
                "patches are continuous inside",
                "patches are similar to the central chart, positive, injective",
                "patches keep flat lengths at their scale",
                "texels hold the log scale",
                "texels hold the surface point",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            torus,
            "another scale of a patch",
            |a| a.json["patches"][0]["patch_to_chart"]["scale"] = json!(2.001),
            [
                "patches are similar to the central chart, positive, injective",
                "patches keep flat lengths at their scale"
            ]
        ),
        mutation!(
            torus,
            "no similarity for a flat patch",
            |a| a.json["patches"][0]["patch_to_chart"] = json!(null),
            ["patches are similar to the central chart, positive, injective"]
        ),
        mutation!(
            torus,
            "another width of an image",
            |a| a.json["patches"][0]["width"] = json!(17),
            ["image sizes as stated"]
        ),
        mutation!(
            torus,
            "an image of a gigantic size",
            |a| {
                a.json["patches"][0]["width"] = json!(1u64 << 40);
                a.json["patches"][0]["height"] = json!(1u64 << 40)
            },
            ["image sizes as stated"]
        ),
        mutation!(
            torus,
            "texels shifted",
            |a| {
                let x = &mut a.json["patches"][0]["texel_to_patch"][0][2];
                *x = json!(x.as_f64().expect("a number") + 0.05);
            },
            [
                "images describe themselves",
                "texels hold the log scale",
                "texels hold the surface point",
                "texels inside a patch are covered",
                "texels name their face",
                "texels outside every face are not marked"
            ]
        ),
        mutation!(
            torus,
            "texels that cannot be placed",
            |a| a.json["patches"][0]["texel_to_patch"] = json!([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]),
            [
                "images describe themselves",
                "images keep the contract's layout"
            ]
        ),
        mutation!(
            torus,
            "a texel off",
            |a| {
                let t = texels(&a.pictures[0]).0;
                channel(a, "R")[t] += 0.01
            },
            ["texels hold the surface point"]
        ),
        mutation!(
            torus,
            "a NaN in a texel outside",
            |a| {
                let t = texels(&a.pictures[0]).1;
                channel(a, "G")[t] = f32::NAN
            },
            ["images finite everywhere"]
        ),
        mutation!(
            torus,
            "a wild value outside",
            |a| {
                let t = texels(&a.pictures[0]).1;
                channel(a, "G")[t] = 100.0
            },
            ["dilated texels stay on the patch"]
        ),
        mutation!(
            torus,
            "a hole in the mask",
            |a| {
                let t = texels(&a.pictures[0]).0;
                channel(a, "A")[t] = 0.0
            },
            ["texels inside a patch are covered"]
        ),
        mutation!(
            torus,
            "a mark outside",
            |a| {
                let t = texels(&a.pictures[0]).1;
                channel(a, "A")[t] = 1.0
            },
            ["texels outside every face are not marked"]
        ),
        mutation!(
            torus,
            "half a mark",
            |a| {
                let t = texels(&a.pictures[0]).0;
                channel(a, "A")[t] = 0.6
            },
            ["the mask is 0 or 1"]
        ),
        mutation!(
            torus,
            "a texel of another face",
            |a| {
                let t = texels(&a.pictures[0]).0;
                a.pictures[0].face[t] += 1
            },
            ["texels name their face"]
        ),
        mutation!(
            torus,
            "a normal too long",
            |a| {
                let t = texels(&a.pictures[0]).0;
                channel(a, "normal.Z")[t] = 2.0
            },
            ["texels hold a unit normal"]
        ),
        mutation!(
            torus,
            "a texel of another log scale",
            |a| {
                let t = texels(&a.pictures[0]).0;
                channel(a, "surface.logScale")[t] += 0.1
            },
            ["texels hold the log scale"]
        ),
        mutation!(
            torus,
            "no log scale channel",
            |a| a.pictures[0].floats.remove("surface.logScale"),
            ["images keep the contract's layout"]
        ),
        mutation!(
            torus,
            "no alpha channel",
            |a| a.pictures[0].floats.remove("A"),
            ["images can be read"]
        ),
        mutation!(
            torus,
            "lossy compression",
            |a| a.pictures[0].compression = exr::prelude::Compression::PXR24,
            ["images can be read"]
        ),
        mutation!(
            torus,
            "uncompressed",
            |a| a.pictures[0].compression = exr::prelude::Compression::Uncompressed,
            ["images keep the contract's layout"]
        ),
        mutation!(
            torus,
            "no text attribute",
            |a| a.pictures[0].text.clear(),
            ["images describe themselves"]
        ),
        mutation!(
            torus,
            "a text attribute that is no JSON",
            |a| a.pictures[0].text = "hello".to_owned(),
            ["images describe themselves"]
        ),
        mutation!(
            torus,
            "a text attribute of another patch",
            |a| a.pictures[0].text = a.pictures[1].text.clone(),
            ["images describe themselves"]
        ),
        mutation!(
            torus,
            "an image missing",
            |a| a.json["patches"][1]["image"] = json!("images/none.exr"),
            ["images can be read"]
        ),
        mutation!(
            torus,
            "a seam sample off in space",
            |a| a.arrays.seam_position[5][1] += 0.01,
            [
                "seam samples hold the surface point on both sides",
                "seams run along every patch border"
            ]
        ),
        mutation!(
            torus,
            "a seam sample off in the plane",
            |a| a.arrays.seam_uv[5][1][0] += 1e-3,
            [
                "seam samples hold the surface point on both sides",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            tube,
            "coordinates beyond the boundary",
            |a| {
                let s = a
                    .arrays
                    .seam_patch
                    .iter()
                    .position(|p| p[1] == u32::MAX)
                    .expect("one");
                let m = a.arrays.seam_offset[s] as usize;
                a.arrays.seam_uv[m][1] = [0.0, 0.0];
            },
            ["seam coordinates are NaN beyond the surface's boundary only"]
        ),
        mutation!(
            tube,
            "a NaN inside",
            |a| a.arrays.seam_uv[0][0] = [f64::NAN; 2],
            [
                "seam coordinates are NaN beyond the surface's boundary only",
                "seam samples hold the surface point on both sides",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            torus,
            "a seam missing",
            |a| {
                a.arrays.seam_patch.pop();
                a.arrays.seam_offset.pop();
                a.arrays
                    .seam_position
                    .truncate(a.arrays.seam_position.len() - 2);
                a.arrays.seam_uv.truncate(a.arrays.seam_uv.len() - 2);
            },
            [
                "seams run along every patch border",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            tube,
            "a seam of the boundary missing",
            |a| {
                let s = a
                    .arrays
                    .seam_patch
                    .iter()
                    .position(|p| p[1] == u32::MAX)
                    .expect("one");
                a.arrays.seam_patch.remove(s);
                a.arrays.seam_offset.remove(s);
                for offset in &mut a.arrays.seam_offset[s..] {
                    *offset -= 2;
                }
                a.arrays.seam_offset[0] = 0;
                a.arrays.seam_position.drain(2 * s..2 * s + 2);
                a.arrays.seam_uv.drain(2 * s..2 * s + 2);
            },
            [
                "seams run along the surface's boundary",
                "seams close once around every patch"
            ]
        ),
        mutation!(
            torus,
            "seam arrays of other lengths",
            |a| a.arrays.seam_offset.pop(),
            ["seam arrays match"]
        ),
        mutation!(
            torus,
            "a seam of a patch that is not there",
            |a| a.arrays.seam_patch[0][0] = 7,
            ["indices stay in range"]
        ),
        mutation!(
            torus,
            "no surface.glb",
            |a| a.glb.clear(),
            ["surface.glb can be read"]
        ),
        mutation!(
            torus,
            "a surface.glb of less faces",
            |a| {
                let mut part = a.arrays.clone();
                part.faces.pop();
                part.patch_uv.pop();
                a.glb = crate::verifying::fixture::glb(&part);
            },
            ["surface.glb holds every face"]
        ),
        mutation!(
            torus,
            "packed coordinates outside the square",
            |a| {
                let at = a.glb.len() - 4;
                a.glb[at..].copy_from_slice(&1.5f32.to_le_bytes());
            },
            ["packed texture coordinates lie in the unit square"]
        ),
        mutation!(
            torus,
            "a surface.glb of another size",
            |a| {
                let mut other = a.arrays.clone();
                other.positions[0][2] += 9.0;
                a.glb = crate::verifying::fixture::glb(&other);
            },
            ["surface.glb has the surface's bounding box"]
        ),
        mutation!(
            cone,
            "a cone off the cut",
            |a| {
                append(a, "cones", json!({"vertex": 15, "curvature": 0.0}));
            },
            ["cones listed", "every cone on the slit's border"]
        ),
        mutation!(
            torus,
            "a loop of the cut given up",
            |a| {
                for f in 0..a.arrays.cut.len() {
                    for k in 0..3 {
                        if a.arrays.segment[f][k] == 0 {
                            a.arrays.segment[f][k] = u32::MAX;
                            a.arrays.cut[f][k] = 0;
                        }
                    }
                }
            },
            [
                "central chart continuous off the cut",
                "cut length as stated",
                "gluings are rigid motions",
                "gluings state their residual",
                "segments run from node to node",
                "slit surface is a disk"
            ]
        ),
        mutation!(
            cone,
            "a target curvature of a full turn",
            |a| a.arrays.target_curvature[0] = 7.0,
            [
                "cone angles are positive",
                "cones listed",
                "holonomy around every vertex of the cut is its curvature",
                "interior curvature is the target",
                "target curvature keeps Gauss-Bonnet"
            ]
        ),
        mutation!(
            pillow,
            "gluings that are no quarter turns",
            |a| {
                for i in 0..3 {
                    let r = &mut a.json["segments"][i]["gluing"]["rotation"];
                    *r = json!(r.as_f64().expect("a number") * 0.9);
                    a.json["segments"][i]["gluing"]
                        .as_object_mut()
                        .map(|g| g.remove("quarter_turns"));
                }
            },
            [
                "gluings are rigid motions",
                "gluings are the transitions from left to right",
                "gluings state their residual",
                "holonomy around every vertex of the cut is its curvature",
                "holonomy fixes the vertex it turns about",
                "quarter-turn cones on a sphere or disk give quarter turns",
                "seamless flag is true to the gluings"
            ]
        ),
        mutation!(
            torus,
            "the transitions of the node chart shifted",
            |a| {
                let chart = chart_of(a, "node");
                for t in a.json["transitions"].as_array_mut().expect("a list") {
                    if t["to"] == chart {
                        let x = t["translation"][0].as_f64().expect("a number");
                        t["translation"][0] = json!(x + 1e-4);
                    }
                }
            },
            [
                "cocycle holds on shared faces, both ways",
                "cocycle holds on triple overlaps",
                "transitions are rigid motions",
                "transitions state their faces and residual"
            ]
        ),
        mutation!(
            pillow,
            "an image of a few texels",
            |a| {
                let (picture, record) = crate::verifying::fixture::picture(&a.arrays, 0, 7);
                a.pictures[0] = picture;
                a.json["patches"][0] = record;
            },
            ["images are fine enough to be tested"]
        ),
        mutation!(
            torus,
            "packed triangles over each other",
            |a| {
                let mut other = a.arrays.clone();
                other.patch_uv[70] = other.patch_uv[0];
                a.glb = crate::verifying::fixture::glb(&other);
            },
            ["packed triangles do not overlap"]
        ),
    ]
}
