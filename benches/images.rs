//! How well geometry images hold a surface, at equal total texels: ours in all domains, beside the same sampler on the atlases of other programs.
//!
//! `cargo bench --bench images -- [--peers DIR] [--flat | --grid] MESH…`: 128², 256² and 512² texels in all images together, their margins included. DIR holds
//! `NAME.TOOL.obj`, the mesh with the texture coordinates of a tool, as `benches/peers/atlases.py` writes them. PSNR is
//! 20 log10(diagonal / symmetric RMS distance) of the mesh that is rebuilt from images and seam samples. `--flat` and `--grid` leave the other domain out; grids are uniform, then by curvature. Flat images are those of
//! `preset = "geometry-image-256"`, but without padding, as are charts of other programs. Nothing here is timed.

mod common;

use affine_atlas::atlas::geometry_image::{image_origin, sample};
use affine_atlas::atlas::patches::{Domain, PatchLayout, PatchParams, charts_of};
use affine_atlas::config::{self, Config};
use affine_atlas::geometry::deviation::{Sampling, Triangles, deviation};
use affine_atlas::geometry::frame::Frame;
use affine_atlas::geometry::ids::{FaceVec, VertexVec};
use affine_atlas::geometry::mesh::{AttributeKind, Mesh, Soup};
use affine_atlas::grid::Density;
use affine_atlas::rebuild::{Images, rebuild};
use affine_atlas::{job, read, repair};
use std::collections::HashSet;
use std::error::Error;
use std::path::{Path, PathBuf};

const SIDES: [usize; 3] = [128, 256, 512];
const SAMPLING: Sampling = Sampling {
    samples: 200_000,
    vertices: 20_000,
};
/// For small budgets: below this a patch asks for more texels than the rest allows.
const MIN_SIDE: usize = 8;

/// Cells of a grid along a side of a square of all of them.
const CELLS_ON_SIDE: usize = 32;

/// Budgets that are tried until one is kept.
const ROUNDS: usize = 8;

/// Images of one's own: label, domain, and where cells are smaller.
type Kind = (&'static str, Domain, Density);
const UNIFORM: Kind = ("ours, grid", Domain::Grid, Density::Uniform);
const BY_CURVATURE: Kind = ("ours, grid by curvature", Domain::Grid, Density::Curvature);
const FLAT: Kind = ("ours, flat", Domain::Flat, Density::Uniform);

fn main() -> Result<(), Box<dyn Error>> {
    let mut peers: Option<PathBuf> = None;
    let mut meshes: Vec<PathBuf> = Vec::new();
    let mut kinds = vec![UNIFORM, BY_CURVATURE, FLAT];
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--peers" => peers = Some(arguments.next().ok_or("--peers needs a folder")?.into()),
            "--flat" => kinds = vec![FLAT],
            "--grid" => kinds = vec![UNIFORM, BY_CURVATURE],
            // What cargo adds.
            "--bench" => {}
            _ => meshes.push(argument.into()),
        }
    }
    println!("| model | atlas | patches | 128²: texels, PSNR | 256² | 512² |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for path in &meshes {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let asset = read::read(path, &Default::default())?;
        for &(label, domain, density) in &kinds {
            row(&name, label, |side| {
                ours(&asset.soup, domain, density, side)
            });
        }
        for tool in ["xatlas", "lscm", "slim"] {
            let file = format!("{name}.{tool}.obj");
            let Some(file) = peers.as_ref().map(|p| p.join(file)).filter(|f| f.exists()) else {
                continue;
            };
            let mesh = component(&file)?;
            row(&name, tool, |side| theirs(&mesh, side));
        }
    }
    Ok(())
}

/// Patches, texels and PSNR.
struct Found {
    patches: usize,
    texels: usize,
    /// Vertices of the rebuilt mesh that are in no image: points of seams.
    beside: usize,
    psnr: f64,
}

fn row(name: &str, atlas: &str, of: impl Fn(usize) -> Result<Found, Box<dyn Error>>) {
    let found = SIDES.map(of);
    let cells = found.each_ref().map(|found| match found {
        Ok(f) => format!("{} + {}, {:.2}", f.texels, f.beside, f.psnr),
        Err(e) => e.to_string(),
    });
    let patches = found.iter().flatten().map(|f| f.patches).max();
    let patches = patches.unwrap_or(0);
    println!("| {name} | {atlas} | {patches} | {} |", cells.join(" | "));
}

/// Flat images as the preset for them makes them, grids by default.
fn settings(domain: Domain) -> Result<Config, Box<dyn Error>> {
    let mut config = match domain {
        Domain::Flat => config::parse("settings", "preset = \"geometry-image-256\"", &[])?,
        Domain::Grid => config::parse("settings", "", &[])?,
    };
    // What is rebuilt needs no texels beside a patch.
    config.patches.padding = 0;
    Ok(config)
}

fn ours(
    soup: &Soup,
    domain: Domain,
    density: Density,
    side: usize,
) -> Result<Found, Box<dyn Error>> {
    let mut config = settings(domain)?;
    config.grid.density = density;
    match domain {
        Domain::Flat => {
            config.patches.texel_budget = side * side;
            config.patches.min_side = MIN_SIDE;
        }
        // About a thousand cells: as many as fit with their texels on both sides of borders.
        Domain::Grid => config.grid.samples_per_cell = side / CELLS_ON_SIDE,
    }
    let mut cells = (CELLS_ON_SIDE * CELLS_ON_SIDE) as f64;
    let mut atlas = None;
    for _ in 0..ROUNDS {
        if domain == Domain::Grid {
            config.grid.cells = cells as usize;
        }
        let built = job::build(soup, &config, &())?.swap_remove(0)?;
        let texels: usize = built.images.iter().map(|i| i.width * i.height).sum();
        let is_within = texels <= side * side || domain != Domain::Grid;
        atlas = Some(built);
        if is_within {
            break;
        }
        cells *= 0.98 * (side * side) as f64 / texels as f64;
    }
    let atlas = atlas.ok_or("no atlas")?;
    let images = Images::new(&atlas.patches, &atlas.images, atlas.image_origin);
    measure(&component_of(soup)?, &atlas.patches, &images)
}

/// The surface sampled over given charts, by the sampler of our own.
fn theirs(mesh: &Mesh, side: usize) -> Result<Found, Box<dyn Error>> {
    let set = mesh
        .attributes
        .iter()
        .find(|a| a.kind == AttributeKind::TexCoord(0))
        .ok_or("no texture coordinates")?;
    let faces = mesh.connectivity.faces();
    let uv: FaceVec<[[f64; 2]; 3]> = faces
        .map(|f| {
            std::array::from_fn(|k| {
                let uv = set.corner(f.index(), k);
                [f64::from(uv[0]), -f64::from(uv[1])]
            })
        })
        .collect();
    let mut params = PatchParams {
        texel_budget: side * side,
        min_side: MIN_SIDE,
        padding: settings(Domain::Flat)?.patches.padding,
        ..PatchParams::default()
    };
    let mut layout = charts_of(mesh, &uv, &params)?;
    // Square texels round to more than the budget; ours never do.
    for _ in 0..ROUNDS {
        let texels: usize = layout.patches.iter().map(|p| p.width * p.height).sum();
        let Some(over @ 1..) = texels.checked_sub(side * side) else {
            break;
        };
        params.texel_budget = params.texel_budget.saturating_sub(over).max(1);
        layout = charts_of(mesh, &uv, &params)?;
    }
    let log_scale = VertexVec::filled(0.0, mesh.connectivity.vertex_count());
    let origin = image_origin(mesh, &Frame::default());
    let images = sample(mesh, &layout, &log_scale, origin);
    measure(mesh, &layout, &Images::new(&layout, &images, origin))
}

fn measure(source: &Mesh, layout: &PatchLayout, images: &Images) -> Result<Found, Box<dyn Error>> {
    let rebuilt = rebuild(images)?;
    let faces = source.connectivity.to_faces();
    let given = Triangles {
        positions: source.positions.as_slice(),
        faces: &faces,
    };
    let made = Triangles {
        positions: &rebuilt.positions,
        faces: &rebuilt.faces,
    };
    let found = deviation(given, made, SAMPLING).ok_or("no area")?;
    let bits = |p: [f32; 3]| p.map(f32::to_bits);
    let stored = images.patches.iter().flat_map(|p| p.position);
    let stored: HashSet<[u32; 3]> = stored.map(|&p| bits(p)).collect();
    let is_beside = |p: &&[f64; 3]| {
        let local = std::array::from_fn(|k| (p[k] - images.origin[k]) as f32);
        !stored.contains(&bits(local))
    };
    Ok(Found {
        beside: rebuilt.positions.iter().filter(is_beside).count(),
        patches: layout.patches.len(),
        texels: layout.patches.iter().map(|p| p.width * p.height).sum(),
        psnr: found.psnr(source.diagonal()).unwrap_or(f64::INFINITY),
    })
}

fn component(file: &Path) -> Result<Mesh, Box<dyn Error>> {
    component_of(&read::read(file, &Default::default())?.soup)
}

fn component_of(soup: &Soup) -> Result<Mesh, Box<dyn Error>> {
    let mut repaired = repair::repair(soup, &Default::default())?;
    let component = repaired.components.swap_remove(0);
    let mut mesh = component.mesh?;
    component.frame.leave_all(&mut mesh.positions);
    Ok(mesh)
}
