use super::*;
use crate::export::sample;
use crate::geometry::mesh::Appearance;
use serde_json::Value;

fn text_of(atlas: &AffineAtlas, provenance: &Provenance, params: &ReportParams) -> String {
    page(atlas, provenance, params, &[], |error| panic!("{error}")).unwrap()
}

/// Attributes of the elements that have `data-key`.
fn keyed(text: &str) -> Vec<(String, String)> {
    let pairs = text.split("data-key=\"").skip(1).map(|rest| {
        let (key, rest) = rest.split_once("\" data-value=\"").unwrap();
        let (value, _) = rest.split_once('"').unwrap();
        (key.to_owned(), value.to_owned())
    });
    pairs.collect()
}

#[test]
fn numbers_are_those_of_the_document() {
    let appearance = Appearance::default();
    let provenance = sample::provenance(&appearance);
    let mut atlas = sample::torus(6, 4);
    atlas.quality.area_distortion = 0.1 + 0.2;
    atlas.quality.angle_error.mean = 1.0 / 3.0;
    atlas.repair.insert("welded_vertices".into(), 7);
    let text = text_of(&atlas, &provenance, &ReportParams::default());
    let document = serde_json::json!(atlas_json::describe(&atlas, &provenance).unwrap());
    let keyed = keyed(&text);
    assert!(keyed.len() > 20, "{keyed:?}");
    for (key, value) in keyed {
        let shown: Value = serde_json::from_str(&value).unwrap();
        assert_eq!(Some(&shown), document.pointer(&key), "{key}");
    }
    for t in document["transitions"].as_array().unwrap() {
        let rotation = t["rotation"].as_f64().unwrap();
        assert!(text.contains(&format!("data-value=\"{rotation:?}\"")));
    }
}

#[test]
fn hostile_names_stay_text() {
    let appearance = Appearance::default();
    let mut provenance = sample::provenance(&appearance);
    provenance.asset = "</title><script>alert('asset')</script>";
    provenance.path = "models/\"><img src=x onerror=alert(1)>.obj";
    let text = text_of(&sample::torus(5, 3), &provenance, &ReportParams::default());
    assert!(!text.contains("<script>alert"), "the name became a script");
    assert!(!text.contains("<img"), "the path became an element");
    assert!(text.contains("&lt;/title&gt;&lt;script&gt;alert(&#39;asset&#39;)"));
    for address in ["http://", "https://", "src="] {
        let shown = text.replace("&quot;&gt;&lt;img src=x", "");
        assert!(!shown.contains(address), "{address} asks for something");
    }
}

#[test]
fn pages_are_the_same_every_time() {
    let appearance = Appearance::default();
    let provenance = sample::provenance(&appearance);
    for (_, atlas) in sample::all() {
        let params = ReportParams::default();
        let first = text_of(&atlas, &provenance, &params);
        assert!(first == text_of(&atlas, &provenance, &params));
        // Scripts may name it, and base64 may spell it.
        let (words, _) = first.split_once("<script").unwrap();
        assert!(!words.contains("NaN"), "{words}");
    }
}

#[test]
fn large_surfaces_are_left_out_with_both_numbers() {
    let appearance = Appearance::default();
    let provenance = sample::provenance(&appearance);
    let params = ReportParams {
        max_faces: 10,
        ..ReportParams::default()
    };
    let atlas = sample::torus(6, 4);
    let text = text_of(&atlas, &provenance, &params);
    assert!(text.contains("48 faces, more than the 10 of <code>report.max_faces</code>"));
    assert!(!text.contains("id=\"surface-data\""));
    assert!(text.contains("id=\"transitions\""));
}
