//! The lattice of a real model: whole numbers of cells, quads, blocks.

use affine_atlas::config::Config;
use affine_atlas::flow::cones::ConeStrategy;
use affine_atlas::flow::ricci::Holonomy;
use affine_atlas::geometry::ids::{EdgeVec, VertexId};
use affine_atlas::grid::cone_triangulation::{complex, reduce};
use affine_atlas::grid::quantise::quantise;
use affine_atlas::product::AffineAtlas;
use affine_atlas::read::{ReadParams, read};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::time::Instant;

/// How many cells are asked for.
const CELLS: [f64; 4] = [200.0, 500.0, 2000.0, 8000.0];
/// Part by which the number may miss where there are at least so many cells for each irregular point.
const MISS: f64 = 0.1;
const CELLS_OF_POINT: usize = 10;

/// Number of quad edges around every vertex that the curvature asks for, where it is not that of a regular one.
fn irregular(atlas: &AffineAtlas) -> Vec<usize> {
    let c = &atlas.mesh.connectivity;
    let valence = |(v, k): (VertexId, &f64)| {
        let quarters = (k / FRAC_PI_2).round() as i64;
        match c.is_boundary_vertex(v) {
            true => (3 - quarters) as usize,
            false => (4 - quarters) as usize,
        }
    };
    let regular = |v| if c.is_boundary_vertex(v) { 3 } else { 4 };
    let all = atlas.prescription.target.enumerate();
    let mut found: Vec<usize> = all
        .map(|(v, k)| (v, valence((v, k))))
        .filter(|&(v, n)| n != regular(v))
        .map(|(_, n)| n)
        .collect();
    found.sort_unstable();
    found
}

/// Builds a model with quarter turns, and grids on it. Prints a line of a table for every number of cells.
pub fn grids(model: &Path) -> Result<(), String> {
    let soup = read(model, &ReadParams::default())
        .map_err(|e| e.to_string())?
        .soup;
    let mut config = Config::default();
    config.cones.strategy = ConeStrategy::Field;
    config.flow.holonomy = Holonomy::QuarterTurns;
    config.patches.texel_budget = 4096;
    let mut atlases = affine_atlas::build(&soup, &config, &()).map_err(|e| e.to_string())?;
    let atlas = atlases.remove(0).map_err(|e| e.to_string())?;
    let c = &atlas.mesh.connectivity;
    let met = atlas
        .metric
        .quarter_turns
        .as_ref()
        .ok_or("no quarter turns")?;
    let pairs = met.lines.iter().flat_map(|line| line.vertices.windows(2));
    let pairs: BTreeSet<[VertexId; 2]> = pairs.map(|w| [w[0].min(w[1]), w[0].max(w[1])]).collect();
    let is_line = |e| {
        let [a, b] = c.edge_vertices(e);
        pairs.contains(&[a.min(b), a.max(b)])
    };
    let is_line: EdgeVec<bool> = c.edges().map(is_line).collect();
    let begin = Instant::now();
    let surface = complex(c, &atlas.central.uv, &is_line).map_err(|e| e.to_string())?;
    let cones = reduce(surface, c.vertex_count()).map_err(|e| e.to_string())?;
    let reduced = begin.elapsed().as_secs_f64();
    let wanted = irregular(&atlas);
    for cells in CELLS {
        let begin = Instant::now();
        let lattice =
            quantise(&cones.complex, cones.vertex.len(), cells).map_err(|e| e.to_string())?;
        let quantised = begin.elapsed().as_secs_f64();
        let mesh = lattice.quads().map_err(|e| e.to_string())?;
        let blocks = mesh.blocks().map_err(|e| e.to_string())?.blocks;
        let sides = lattice.complex.sides().count() as f64;
        let rms = (lattice.energy_on(lattice.complex.sides()) / sides).sqrt();
        println!(
            "| {} | {} | {} | {cells} | {} | {rms:.2} | {} | {reduced:.2}, {quantised:.2} |",
            model.file_stem().unwrap_or_default().to_string_lossy(),
            wanted.len(),
            cones.vertex.len(),
            mesh.quads.len(),
            blocks.len()
        );
        let is_border = border(&mesh.across, &mesh.quads, mesh.points.len());
        let mut found: Vec<usize> = mesh
            .points
            .iter()
            .zip(&is_border)
            .filter(|(p, border)| p.valence != if **border { 3 } else { 4 })
            .map(|(p, _)| p.valence)
            .collect();
        found.sort_unstable();
        if found != wanted {
            return Err(format!("irregular: {found:?} for {wanted:?}"));
        }
        let squares: usize = blocks.iter().map(|b| b.squares.len()).sum();
        if squares != mesh.quads.len() {
            return Err(format!(
                "{squares} squares in blocks of {}",
                mesh.quads.len()
            ));
        }
        let ratio = mesh.quads.len() as f64 / cells;
        let is_asked = cells as usize >= CELLS_OF_POINT * wanted.len() && wanted.len() <= 60;
        if is_asked && (ratio - 1.0).abs() > MISS {
            return Err(format!("{} quads for {cells}", mesh.quads.len()));
        }
    }
    Ok(())
}

type Across = [[Option<(u32, u8)>; 4]];

fn border(across: &Across, quads: &[[u32; 4]], points: usize) -> Vec<bool> {
    let mut is_border = vec![false; points];
    for (corners, across) in quads.iter().zip(across) {
        for k in (0..4).filter(|&k| across[k].is_none()) {
            is_border[corners[k] as usize] = true;
            is_border[corners[(k + 1) % 4] as usize] = true;
        }
    }
    is_border
}
