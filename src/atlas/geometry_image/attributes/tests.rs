use super::*;
use crate::atlas::patches::samples::{self, Sample};
use crate::atlas::patches::{PatchParams, layout};
use crate::geometry::mesh::AttributeKind;
use std::collections::BTreeSet;

fn params(channels: &[Channel]) -> ImageParams {
    ImageParams {
        channels: channels.iter().copied().collect(),
        ..ImageParams::default()
    }
}

fn sampled(sample: &Sample, source: &Mesh, channels: &[Channel]) -> Vec<GeometryImage> {
    let layout = layout(
        &sample.mesh,
        &sample.length,
        &sample.cut,
        &sample.development,
        None,
        &PatchParams::default(),
    )
    .unwrap();
    let images = super::super::sample(&sample.mesh, &layout, &sample.log_scale, [0.0; 3]);
    let source = SourceSurface::of(source, &params(channels)).unwrap();
    sample_attributes(&sample.mesh, &layout, images, &source)
}

fn attribute(kind: AttributeKind, components: usize, values: Vec<f32>) -> CornerAttribute {
    CornerAttribute {
        kind,
        components,
        values,
    }
}

#[test]
fn barycentric_coordinates_reproduce_the_point_and_forgive() {
    let t = [[1.0, 2.0, 3.0], [4.0, 2.5, 3.0], [0.0, 7.0, 5.0]];
    let weights = [0.2, 0.5, 0.3];
    let p = mix(&t, weights);
    let found = barycentric(t, p);
    assert!((0..3).all(|k| (found[k] - weights[k]).abs() < 1e-14));
    // The smallest and the greatest numbers.
    for scale in [1e-200, 1e200] {
        let t = t.map(|p| p.map(|x| scale * x));
        let found = barycentric(t, mix(&t, weights));
        assert!(
            (0..3).all(|k| (found[k] - weights[k]).abs() < 1e-13),
            "{found:?}"
        );
    }
    assert_eq!(barycentric([p; 3], p), [1.0 / 3.0; 3]);
    let inside = into_triangle([-1e-9, 0.4, 0.6]);
    assert!(inside[0] == 0.0 && (inside[1] + inside[2] - 1.0).abs() < 1e-15);
}

#[test]
fn where_a_corner_has_no_value_the_texel_has_that_of_the_glb() {
    let mut sample = samples::square(3);
    let corners = 3 * sample.mesh.connectivity.face_count();
    let mut color = [0.25f32, 0.5, 0.75, 1.0].repeat(corners);
    color[4] = f32::NAN;
    let mut texcoord = [0.5f32, 0.25].repeat(corners);
    texcoord[..6].fill(f32::NAN);
    sample.mesh.attributes = vec![
        attribute(AttributeKind::Color(0), 4, color),
        attribute(AttributeKind::TexCoord(0), 2, texcoord),
        attribute(AttributeKind::Normal, 3, vec![0.0; 3 * corners]),
    ];
    let channels = [Channel::Color, Channel::Texcoord, Channel::SourceNormal];
    let image = &sampled(&sample, &sample.mesh, &channels)[0];
    let kept: BTreeSet<Channel> = image.attributes.iter().map(|a| a.channel).collect();
    assert_eq!(kept, BTreeSet::from(channels));
    for sampled in &image.attributes {
        let Values::Numbers { components, values } = &sampled.values else {
            panic!("numbers");
        };
        for (texel, (&face, normal)) in values
            .chunks(*components)
            .zip(image.face.iter().zip(&image.normal))
        {
            let expected: &[f32] = match (sampled.channel, face) {
                (Channel::Color, 0) => &[1.0; 4],
                (Channel::Color, _) => &[0.25, 0.5, 0.75, 1.0],
                (Channel::Texcoord, 0) => &[0.0; 2],
                (Channel::Texcoord, _) => &[0.5, 0.25],
                _ => normal,
            };
            let near = texel
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(near, "{texel:?} {expected:?}");
        }
    }
}

/// A face of the file that repair divided is several rows; the texel takes the one it lies on.
#[test]
fn parts_of_a_face_are_told_apart() {
    let mut sample = samples::square(3);
    let faces = sample.mesh.connectivity.face_count();
    let own: Vec<f32> = (0..faces).flat_map(|f| [f as f32, 0.0].repeat(3)).collect();
    sample.mesh.attributes = vec![attribute(AttributeKind::TexCoord(0), 2, own)];
    sample.mesh.face_material = (0..faces as u32).map(|f| f / 2).collect();
    sample.mesh.source_face = vec![7; faces].into();
    let image = &sampled(
        &sample,
        &sample.mesh,
        &[Channel::Texcoord, Channel::Material],
    )[0];
    let [first, second] = &image.attributes[..] else {
        panic!("two channels");
    };
    let Values::Numbers { values, .. } = &first.values else {
        panic!("numbers");
    };
    let mut strictly_inside = 0;
    for (at, &f) in image.face.iter().enumerate() {
        // On an edge either face may be taken.
        let whole = values[2 * at].fract() == 0.0;
        strictly_inside += usize::from(whole && values[2 * at] == f as f32);
    }
    assert!(10 * strictly_inside > 9 * image.face.len());
    let materials: Vec<u32> = image.face.iter().map(|f| f / 2).collect();
    assert_eq!(second.values, Values::Ids(materials));
}

#[test]
fn nothing_is_kept_where_nothing_is_asked_for() {
    let sample = samples::square(3);
    assert!(SourceSurface::of(&sample.mesh, &ImageParams::default()).is_none());
    assert!(SourceSurface::of(&sample.mesh, &params(&[Channel::Color])).is_none());
}
