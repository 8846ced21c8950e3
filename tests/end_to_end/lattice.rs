//! Texels of all patches on one lattice, from the files alone.

use crate::command::{build, document, verify};
use affine_atlas::read::atlas::{BOUNDARY, read_images};
use serde_json::Value;
use std::path::Path;

type Complex = [f64; 2];

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().expect("a number"))
}

fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn minus(a: Complex, b: Complex) -> Complex {
    [a[0] - b[0], a[1] - b[1]]
}

/// How a patch lies in the central chart: p ↦ turn · p + shift.
struct Place {
    turn: Complex,
    shift: Complex,
    /// Of its texels, in the chart.
    width: f64,
    /// Where the image's upper left corner lies in the chart.
    corner: Complex,
}

impl Place {
    fn of(patch: &Value) -> Self {
        let to_chart = &patch["patch_to_chart"];
        let number = |name: &str| to_chart[name].as_f64().expect("a number");
        let (sine, cosine) = number("rotation").sin_cos();
        let turn = [cosine, sine].map(|x| number("scale") * x);
        let shift: Complex = numbers(&to_chart["translation"]);
        let rows = &patch["texel_to_patch"];
        let [[a, b, left], [c, d, top]]: [[f64; 3]; 2] = [0, 1].map(|i| numbers(&rows[i]));
        assert_eq!((b, c), (0.0, 0.0));
        assert_eq!(a, -d, "texels are square");
        let mut place = Self {
            turn,
            shift,
            width: a * number("scale"),
            corner: [0.0; 2],
        };
        place.corner = place.apply([left, top]);
        place
    }

    fn apply(&self, p: Complex) -> Complex {
        let q = times(self.turn, p);
        [q[0] + self.shift[0], q[1] + self.shift[1]]
    }
}

/// The distance from whole numbers, both parts.
fn off(p: Complex) -> f64 {
    p.map(|x| (x - x.round()).abs())
        .into_iter()
        .fold(0.0, f64::max)
}

#[test]
fn texels_are_squares_of_one_lattice_and_rows_go_on_across_quarter_turns() {
    // Without handles all transitions are made of the turns around cones.
    for mesh in ["genus-0-animal.ply", "genus-0-cube.obj"] {
        let settings = [
            "cones.count=8",
            "cones.quantum=1/2",
            "patches.shared_lattice=true",
        ];
        let built = build(&Path::new("fixtures/good").join(mesh), &settings);
        let atlas = built.atlas();
        verify(&atlas);
        let document = document(&atlas);
        let patches = document["patches"].as_array().expect("a list");
        let places: Vec<Place> = patches.iter().map(Place::of).collect();
        let widths = places.iter().map(|p| p.width);
        let finest = widths.fold(f64::INFINITY, f64::min);
        for p in &places {
            let levels = (p.width / finest).log2();
            assert!(off([levels, 0.0]) < 1e-9, "{mesh}: {levels}");
            let corner = p.corner.map(|x| x / p.width);
            assert!(off(corner) < 1e-6, "{mesh}: {corner:?}");
            // Rows of the image are parallel to an axis.
            let along = p.turn.map(|x| x / p.turn[0].hypot(p.turn[1]));
            assert!(off(along) < 1e-12, "{mesh}: {along:?}");
        }
        let folder = read_images(&atlas).expect("readable");
        let seams = folder.seam_patch.iter().zip(folder.seam_offset.windows(2));
        let (mut off_the_cut, mut across) = (0, 0);
        for (&[left, right], rows) in seams {
            if right == BOUNDARY {
                continue;
            }
            let (left, right) = (&places[left as usize], &places[right as usize]);
            let samples = &folder.seam_uv[rows[0] as usize..rows[1] as usize];
            let step = |place: &Place, side: usize| {
                minus(place.apply(samples[1][side]), place.apply(samples[0][side]))
            };
            let (a, b) = (step(left, 0), step(right, 1));
            let square = a[0] * a[0] + a[1] * a[1];
            let turn = times(b, [a[0], -a[1]]).map(|x| x / square);
            assert!(off(turn) < 1e-6, "{mesh}: turned by {turn:?}");
            let [p, q] = [left.apply(samples[0][0]), right.apply(samples[0][1])];
            let same = minus(p, q).map(|x| (x / finest).abs());
            if same[0].max(same[1]) < 1e-6 {
                off_the_cut += 1;
            } else {
                across += 1;
            }
        }
        assert!(
            off_the_cut > 0 && across > 0,
            "{mesh}: {off_the_cut} {across}"
        );
    }
}
