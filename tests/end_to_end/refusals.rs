//! Every bad fixture is built after repair or refused with its golden message.

use crate::command::{build_small, document, verify};
use std::fmt::Write;
use std::path::Path;

/// Exit code, what became of each component, and the message.
fn account(name: &str) -> String {
    let built = build_small(Path::new(&format!("fixtures/bad/{name}")), &[]);
    let code = built.code().expect("no crash");
    let mut text = format!("{name}: exit {code}\n");
    for atlas in built.atlases() {
        verify(&atlas);
        let document = document(&atlas);
        let repair = document["repair"].as_object().expect("a table");
        let changes: Vec<String> = (repair.iter())
            .filter(|(_, count)| **count != 0)
            .map(|(what, count)| format!("{what} {count}"))
            .collect();
        let component = &document["source"]["component"];
        let changes = match &changes[..] {
            [] => "as it is".to_owned(),
            changes => changes.join(", "),
        };
        writeln!(text, "  built component {component}: {changes}").expect("written");
    }
    assert!(!built.message().contains("panic"), "{}", built.message());
    assert_eq!(code == 0, built.message().is_empty(), "{}", built.message());
    for line in built.message().lines() {
        writeln!(text, "  {line}").expect("written");
    }
    text
}

#[test]
fn every_bad_fixture_is_repaired_or_refused() {
    let entries = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/bad"));
    let mut names: Vec<String> = (entries.expect("committed"))
        .map(|e| e.expect("readable").file_name().into_string())
        .collect::<Result<_, _>>()
        .expect("UTF-8");
    names.sort();
    let text: String = names.iter().map(|name| account(name)).collect();
    insta::assert_snapshot!(text, @r"
    accessor-overrun.glb: exit 1
      failed: accessor-overrun (input): fixtures/bad/accessor-overrun.glb: accessor 0 needs 480000 bytes of buffer view 0, which has 2880; the file is truncated or its offsets are wrong, so export it again
    duplicated-face.obj: exit 0
      built component 0: removed_duplicate_faces 1, removed_faces 1
    empty.obj: exit 1
      failed: empty (input): fixtures/bad/empty.obj: holds no triangle (0 vertices, 0 faces); export a surface mesh, not points or curves
    flipped-faces.off: exit 0
      built component 0: flipped_faces 392
    huge-count.off: exit 1
      failed: huge-count (input): fixtures/bad/huge-count.off: has 99999999999 vertices or more, beyond max_vertices = 50000000; raise the limit or simplify the mesh
    huge-count.ply: exit 1
      failed: huge-count (input): fixtures/bad/huge-count.ply: has 4294967295 vertices or more, beyond max_vertices = 50000000; raise the limit or simplify the mesh
    index-out-of-range.gltf: exit 1
      failed: index-out-of-range (input): fixtures/bad/index-out-of-range.gltf: face 5 (node 0, mesh 0, primitive 0) refers to vertex 246, but there are 240, counted from 0; correct the index or add what is missing
    index-out-of-range.obj: exit 1
      failed: index-out-of-range (input): fixtures/bad/index-out-of-range.obj: face 5 (line 248) refers to vertex 247, but there are 240, counted from 1; correct the index or add what is missing
    index-out-of-range.off: exit 1
      failed: index-out-of-range (input): fixtures/bad/index-out-of-range.off: face 5 (line 248) refers to vertex 246, but there are 240, counted from 0; correct the index or add what is missing
    index-zero.obj: exit 1
      failed: index-zero (input): fixtures/bad/index-zero.obj: face 476 (line 719) refers to vertex 0, but there are 240, counted from 1; correct the index or add what is missing
    infinite-position.ply: exit 1
      failed: infinite-position (input): fixtures/bad/infinite-position.ply: vertex 23 (byte 745) has y = inf; every coordinate must be a finite number, so repair or remove that vertex
    moebius-strip.obj: exit 1
      failed: moebius-strip (input): the component of 96 faces is one-sided like a Möbius strip: going round it, face 53 comes back turned over where it meets face 48; cut it open along a line across the strip, so that it has two sides
    nan-position.glb: exit 1
      failed: nan-position (input): fixtures/bad/nan-position.glb: vertex 17 (node 0, mesh 0, primitive 0) has y = NaN; every coordinate must be a finite number, so repair or remove that vertex
    nan-position.obj: exit 1
      failed: nan-position (input): fixtures/bad/nan-position.obj: vertex 17 (line 20) has y = NaN; every coordinate must be a finite number, so repair or remove that vertex
    no-faces.obj: exit 1
      failed: no-faces (input): fixtures/bad/no-faces.obj: holds no triangle (3 vertices, 0 faces); export a surface mesh, not points or curves
    non-manifold-edge.obj: exit 0
      built component 0: cut_edges 1, split_vertices 2
      built component 1: as it is
    non-manifold-vertex.obj: exit 0
      built component 0: split_vertices 1
      built component 1: as it is
    one-bad-component.obj: exit 1
      built component 0: as it is
      built component 2: as it is
      failed: one-bad-component, component 1 (input): the component of 96 faces is one-sided like a Möbius strip: going round it, face 529 comes back turned over where it meets face 524; cut it open along a line across the strip, so that it has two sides
    only-degenerate-faces.off: exit 1
      failed: only-degenerate-faces (input): none of the 476 faces encloses any area, so there is no surface: check that the file holds triangles with distinct corners
    repeated-vertex.obj: exit 0
      built component 0: removed_degenerate_faces 1, removed_faces 1
    truncated.glb: exit 1
      failed: truncated (input): fixtures/bad/truncated.glb: ends after 6402 bytes where the GLB file needs 9604; the file is truncated or its counts are wrong, so export or download it again
    truncated.ply: exit 1
      failed: truncated (input): fixtures/bad/truncated.ply: ends after 9775 bytes where a list needs 9778; the file is truncated or its counts are wrong, so export or download it again
    truncated.stl: exit 1
      failed: truncated (input): fixtures/bad/truncated.stl: ends after 23764 bytes where binary STL needs 23884; the file is truncated or its counts are wrong, so export or download it again
    unknown-required-extension.glb: exit 1
      failed: unknown-required-extension (input): fixtures/bad/unknown-required-extension.glb: requires the glTF extension ACME_folded_space, which is not supported; export the asset without it
    unreferenced-vertex.off: exit 0
      built component 0: unreferenced_vertices 1
    unwelded-soup.stl: exit 0
      built component 0: welded_vertices 2940
    uri-absolute.gltf: exit 1
      failed: uri-absolute (input): fixtures/bad/uri-absolute.gltf: the URI `/secret.bin` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path
    uri-backslash-parent.gltf: exit 1
      failed: uri-backslash-parent (input): fixtures/bad/uri-backslash-parent.gltf: the URI `..\secret.bin` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path
    uri-file-scheme.gltf: exit 1
      failed: uri-file-scheme (input): fixtures/bad/uri-file-scheme.gltf: the URI `file:///secret.bin` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path
    uri-http-scheme.gltf: exit 1
      failed: uri-http-scheme (input): fixtures/bad/uri-http-scheme.gltf: the URI `https://example.com/secret.bin` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path
    uri-missing-file.gltf: exit 1
      failed: uri-missing-file (input): fixtures/bad/uri-missing-file.gltf: the file `not-there.bin` it refers to cannot be read (it does not exist); put the file beside the asset
    uri-not-utf-8.gltf: exit 1
      failed: uri-not-utf-8 (input): fixtures/bad/uri-not-utf-8.gltf: the URI `%FF.bin` is malformed (escapes must be %XX of UTF-8, data must be base64); correct it
    uri-parent.gltf: exit 1
      failed: uri-parent (input): fixtures/bad/uri-parent.gltf: the URI `../secret.bin` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path
    uri-percent-encoded-parent.gltf: exit 1
      failed: uri-percent-encoded-parent (input): fixtures/bad/uri-percent-encoded-parent.gltf: the URI `%2e%2e/secret.bin` leads out of the asset's folder; put the file beside the asset and refer to it by a relative path
    zero-area-face.obj: exit 0
      built component 0: removed_collinear_faces 1, removed_faces 1, split_faces 1
    zero-length-edge.obj: exit 0
      built component 0: removed_degenerate_faces 2, removed_faces 2, welded_vertices 1
    ");
}

#[test]
fn strict_repair_refuses_what_it_would_have_changed() {
    let refusal = |name: &str| {
        let mesh = format!("fixtures/bad/{name}");
        let built = build_small(Path::new(&mesh), &["repair.strict=true"]);
        assert_eq!(built.code(), Some(1));
        assert!(built.atlases().is_empty());
        built.message()
    };
    insta::assert_snapshot!(refusal("flipped-faces.off"), @"failed: flipped-faces (input): the mesh needs repair (392 flipped faces; first: face 1 is oriented against its neighbours), which repair.strict refuses: mend the file or set repair.strict = false");
    insta::assert_snapshot!(refusal("duplicated-face.obj"), @"failed: duplicated-face (input): the mesh needs repair (1 removed duplicate face; first: face 476 has the same vertices as face 12), which repair.strict refuses: mend the file or set repair.strict = false");
    insta::assert_snapshot!(refusal("non-manifold-edge.obj"), @"failed: non-manifold-edge (input): the mesh needs repair (1 cut edge, 2 split vertices; first: the edge from vertex 3 to vertex 4 has 3 faces), which repair.strict refuses: mend the file or set repair.strict = false");
}
