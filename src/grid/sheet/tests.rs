use super::*;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::subdivision::Corner;
use crate::grid::triangle::double_area;

/// A surface that lies in the plane as it is.
fn plane(places: &[[f64; 2]], faces: &[[u32; 3]], near: f64) -> Sheet {
    let connectivity = Connectivity::from_faces(faces, places.len()).unwrap();
    let corner = |h| {
        let mut weights = [0.0; 3];
        weights[connectivity.corner(h)] = 1.0;
        Corner {
            weights,
            uv: places[connectivity.tail(h).index()],
        }
    };
    let fine = Subdivision {
        corner: connectivity.halfedges().map(corner).collect(),
        parent: connectivity.faces().collect(),
        position: places.iter().map(|&[x, y]| [x, y, 0.0]).collect(),
        connectivity,
    };
    let halfedges = fine.connectivity.halfedge_count();
    Sheet::new(fine, HalfedgeVec::filled(0, halfedges), near)
}

/// The line from 0 to 2 passes vertices 4 and 5, the upper one of which cannot come down to it: the lower one is in the way.
#[test]
fn a_vertex_near_a_line_stays_where_its_star_is_smaller_than_the_way() {
    for (off, apart) in [(5e-5, 1e-6), (5e-5, 1e-9), (9e-5, 2e-5)] {
        let places = [
            [0.0, 0.0],
            [1.0, -1.0],
            [2.0, 0.0],
            [1.0, 1.0],
            [1.0, off - apart],
            [1.0, off],
        ];
        let faces = [
            [0, 1, 4],
            [1, 2, 4],
            [0, 4, 5],
            [4, 2, 5],
            [0, 5, 3],
            [5, 2, 3],
        ];
        let mut sheet = plane(&places, &faces, 1e-4);
        let [from, goal] = [0, 2].map(VertexId::new);
        let (corner, _) = sheet.corner_at(from, sheet_bearing(&sheet, from)).unwrap();
        let target = [2.0, 0.0];
        let aims = sheet.near(Aim { corner, target });
        let end = sheet.draw(aims, 1, Some(goal), |_| true).unwrap();
        assert_eq!(end, goal);
        let c = &sheet.fine.connectivity;
        for f in c.faces() {
            let corners = c.face_halfedges(f).map(|h| sheet.at(h));
            assert!(double_area(corners) > 0.0, "{off} {apart}: {corners:?}");
        }
    }
}

/// Of the direction along the first axis.
fn sheet_bearing(sheet: &Sheet, v: VertexId) -> f64 {
    let first = sheet.fine.connectivity.vertex_halfedge(v);
    let [x, y] = sheet.vector(first);
    -y.atan2(x)
}
