//! Arguments and their help texts.

use affine_atlas::batch::shard::{self, Shard};
use affine_atlas::export::step::LengthUnit;
use affine_atlas::job::texture::{DEFAULT_SIZE, SIZE_RANGE, TILES_RANGE};
use affine_atlas::spline::DEFAULT_ANGLE;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

const EXIT_CODES: &str = "\
Exit codes:
    0  all good
    1  some meshes (or checks) failed
    2  wrong arguments or configuration
    3  nothing to do
    4  an error of this program
  130  stopped by Ctrl-C or SIGTERM";

/// Unwraps triangle meshes: conformal UVs, affine atlases, geometry images.
///
/// An affine atlas covers the surface with flat charts whose transitions are rotations and
/// translations. It is computed by discrete Ricci flow and written as a GLB with texture
/// coordinates, NumPy arrays and geometry images (EXR).
#[derive(Debug, Parser)]
#[command(name = "affine-atlas", version, after_help = EXIT_CODES, after_long_help = EXIT_CODES)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub global: Global,
}

/// Options of every command.
#[derive(Clone, Debug, Default, Args)]
pub struct Global {
    /// Show errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Show each step; twice: everything
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Progress and errors as text, or as one JSON object a line (both on standard error)
    #[arg(
        long,
        global = true,
        value_enum,
        value_name = "FORMAT",
        default_value_t
    )]
    pub log_format: LogFormat,
    /// Threads to use, in `build` for each mesh; 0 takes one for each core, shared by the meshes that are built at the same time
    /// [default: run.threads of the configuration]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub threads: Option<u16>,
}

/// How progress and errors are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// For programs.
    Json,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Build an atlas of each mesh
    #[command(after_help = BUILD_EXAMPLES, after_long_help = BUILD_EXAMPLES)]
    Build(Build),
    /// Write down what a build would do, for several machines
    #[command(after_help = PLAN_EXAMPLES, after_long_help = PLAN_EXAMPLES)]
    Plan(Plan),
    /// Build one shard of a plan
    #[command(after_help = RUN_EXAMPLES, after_long_help = RUN_EXAMPLES)]
    Run(Run),
    /// Put what all shards of a plan built together, as one build
    #[command(after_help = MERGE_EXAMPLES, after_long_help = MERGE_EXAMPLES)]
    Merge(Merge),
    /// Say what a build would do, and build nothing
    #[command(after_help = CHECK_EXAMPLES, after_long_help = CHECK_EXAMPLES)]
    Check(Check),
    /// Show what more or fewer cones gain, and write lists of them
    #[command(after_help = CONES_EXAMPLES, after_long_help = CONES_EXAMPLES)]
    Cones(Cones),
    /// Read atlases back and check every property they must have
    #[command(after_help = VERIFY_EXAMPLES, after_long_help = VERIFY_EXAMPLES)]
    Verify(Verify),
    /// Make a mesh again from the geometry images of an atlas
    #[command(after_help = REBUILD_EXAMPLES, after_long_help = REBUILD_EXAMPLES)]
    Rebuild(Rebuild),
    /// Fit a smooth spline surface to a mesh: USD, STEP, G+Smo
    #[command(after_help = FIT_EXAMPLES, after_long_help = FIT_EXAMPLES)]
    Fit(Fit),
    /// Lay a repeating image over the whole surface as one texture
    #[command(after_help = TEXTURE_EXAMPLES, after_long_help = TEXTURE_EXAMPLES)]
    Texture(Texture),
    /// Say in plain words why an asset failed, or where it is distorted
    #[command(after_help = EXPLAIN_EXAMPLES, after_long_help = EXPLAIN_EXAMPLES)]
    Explain(Explain),
    /// Print a JSON schema of what is written, or of the configuration
    #[command(after_help = SCHEMA_EXAMPLES, after_long_help = SCHEMA_EXAMPLES)]
    Schema(Schema),
    /// Write a configuration file that explains every key
    #[command(after_help = INIT_EXAMPLES, after_long_help = INIT_EXAMPLES)]
    Init(Init),
    /// Build one mesh, told by `build` through a pipe
    #[command(hide = true)]
    Worker(Worker),
}

const EXPLAIN_EXAMPLES: &str = "\
Examples:
  affine-atlas explain broken.obj                     runs the checks of a build and flattens it
  affine-atlas explain broken.obj -o broken.glb       the faces at fault in colour
  affine-atlas explain my.toml broken.obj             with the settings of my.toml
  affine-atlas explain affine-atlas-out/bunny         where a finished atlas is distorted, and why

Exit code 1 where the asset fails.";

const SCHEMA_EXAMPLES: &str = "\
Examples:
  affine-atlas schema config > config.schema.json     for editors that complete TOML
  affine-atlas schema atlas                           of atlas.json
  affine-atlas schema manifest                        of each line of manifest.jsonl
  affine-atlas schema plan                            of each line of a plan";

const BUILD_EXAMPLES: &str = "\
Examples:
  affine-atlas build                              what ./config.toml says
  affine-atlas build bunny.obj --out atlases      one mesh, default settings
  affine-atlas build bunny.obj --set cones.strategy=spread --set cones.count=6
  affine-atlas build my.toml bunny.obj            settings of my.toml, another mesh
  affine-atlas build scans 'lib/**/*.glb' @extra.txt --out atlases
  affine-atlas build --dry-run                    what would be built, and why

Each mesh becomes a folder OUT/NAME with atlas.json, atlas.npz, surface.glb, images/, pictures and
report.html. It appears when it is complete; an older good folder stays if the build fails. Where
mesh, settings and version are the same as last time and the folder is whole, nothing is built. OUT
also gets manifest.jsonl and junit.xml (what became of each mesh), index.html (the same to look at)
and logs/NAME.log. docs/output.md of the source describes every file, key and array.";

const PLAN_EXAMPLES: &str = "\
Examples:
  affine-atlas plan my.toml --out atlases --plan night.jsonl --shards 16
  affine-atlas run --plan night.jsonl --shard 1/16       to 16/16, on any machines, in any order
  affine-atlas merge --plan night.jsonl

Machines need a common file system with the meshes and OUT, and the same version of this program.
Relative paths start at the folder in which the plan is made: start all three there. Shards are of
about the same expected time; how many there are is chosen with `run`, and --shards only shows what
it comes to. The plan holds all settings: no configuration is read again.";

const RUN_EXAMPLES: &str = "\
Examples:
  affine-atlas run --plan night.jsonl --shard 3/16
  affine-atlas run --plan night.jsonl --shard $SLURM_ARRAY_TASK_ID/20
  affine-atlas run --plan night.jsonl                    all of it

May be run again at any time, after a kill or by an engine that is not sure: what this plan has
built is not built again, and reported as before. A request to stop (SIGTERM, Ctrl-C) ends it within
seconds. Exit codes are those of a build of these meshes; a shard without meshes is good.";

const MERGE_EXAMPLES: &str = "\
Examples:
  affine-atlas merge --plan night.jsonl
  affine-atlas merge --plan night.jsonl --incomplete     also while some are not done

Writes manifest.jsonl, junit.xml and index.html of OUT as one build of all meshes would have, and
gives its exit code. Where a mesh is not done nothing is written, and the shards that it belongs to
are named: exit code 1. With --incomplete it is recorded as cancelled: exit code 130.";

const CHECK_EXAMPLES: &str = "\
Examples:
  affine-atlas check                  what ./config.toml says
  affine-atlas check scan.ply         one mesh, default settings
  affine-atlas check scan.ply --set flow.scheme=thurston --region region.glb

Shows for each mesh: components, vertices, faces, genus, boundary loops, the total curvature its
cones must have, what would be repaired, and whether the metric asked for exists.";

const CONES_EXAMPLES: &str = "\
Examples:
  affine-atlas cones bunny.obj                    0, 4, 8, 16 and 32 cones, as far as possible
  affine-atlas cones bunny.obj --counts 6,12 --out trials
  affine-atlas cones bunny.obj --set cones.quantum=1/2
  affine-atlas build affine-atlas-out/bunny.cones/bunny.cones-8.toml

Flattens the surface with each number of cones, chosen by the program, and shows area distortion
(9), log scale u and length of the cut, beside those of equal cones far apart (of none, where the
surface needs none). Each mesh gets a folder OUT/NAME.cones with, for each number N:
  NAME.cones-N.toml  a configuration that builds exactly this
  NAME.cones-N.txt   the same cones as two columns: vertex (from 0) and curvature in radians
  NAME.cones-N.png   the log scale before and after
and cones.png (all in a row) and cones.json (the table). It appears when it is complete.";

const VERIFY_EXAMPLES: &str = "\
Examples:
  affine-atlas verify affine-atlas-out/bunny
  affine-atlas verify affine-atlas-out/bunny --source bunny.obj --cones 8 --json

Uses nothing but the files in the folder. Exit code 0 if every check passed, 1 if not.";

const REBUILD_EXAMPLES: &str = "\
Examples:
  affine-atlas rebuild affine-atlas-out/bunny -o bunny-again.glb
  affine-atlas rebuild affine-atlas-out/bunny -o bunny-again.glb --against bunny.obj

Uses the images, atlas.json and the seam samples of atlas.npz, and nothing else of the folder. The mesh is
watertight where the surface is: patches share the vertices of their seams. With --against it says how far the
mesh is from that one: PSNR = 20 log10(diagonal / RMS distance), Hausdorff distance over 200,000 samples and all
vertices of each, and angles between normals.";

const FIT_EXAMPLES: &str = "\
Examples:
  affine-atlas fit bunny.obj
  affine-atlas fit bunny.obj --cells 8000 --unit m -o bunny-spline
  affine-atlas fit bunny.obj --tolerance 0.1mm
  affine-atlas fit affine-atlas-out/bunny

Fits one smooth surface to a mesh: the Catmull-Clark limit surface on the integer grid of its atlas, with
creases on sharp edges. Of a folder that `build` wrote it takes the grid there. The new folder holds
  NAME.cage.obj, NAME.usda  the control mesh; USD with creases and corners, for subdivision surfaces
  NAME.step                 the same surface as B-spline faces of one shell, a solid where it is closed (AP242)
  NAME.xml                  the same as a MultiPatch of G+Smo, with interfaces and boundary
  NAME.glb                  triangles with normals
  NAME.zebra.png            zebra stripes
  fit.json, fit.html        distances, angles between normals, control points
for each component. It appears when it is complete.";

const TEXTURE_EXAMPLES: &str = "\
Examples:
  affine-atlas build bunny.obj --set preset=texture
  affine-atlas texture affine-atlas-out/bunny --pattern tiles.png
  affine-atlas texture affine-atlas-out/bunny --pattern tiles.png --tiles 2 --size 4096 -o bunny-tiled

The image is laid on the integer grid of the atlas (images.domain = grid), a whole number of tiles along a
side of a cell. Where it looks the same after a quarter turn it has no seams; elsewhere it jumps where
frames of the grid turn. The new folder holds
  NAME.png           the texture for the TEXCOORD_0 of surface.glb (one a component)
  NAME.glb           the surface with that texture
  NAME.preview.png   a picture of it
  texture.json       number and size of tiles, colour steps across seams and beside them
It appears when it is complete.";

const INIT_EXAMPLES: &str = "\
Examples:
  affine-atlas init                   writes ./config.toml for the meshes in and below this folder
  affine-atlas init settings/my.toml  for those in and below settings";

/// Meshes and settings.
#[derive(Debug, Args)]
pub struct Inputs {
    /// A configuration (ends in .toml), meshes (glTF, GLB, OBJ, PLY, STL, OFF), or both: meshes
    /// then take the place of `input.paths`. Folders, globs and `@LIST`, a text file with one of all these a line, stand for the meshes that are found [default: config.toml]
    #[arg(value_name = "CONFIG|MESH")]
    pub inputs: Vec<PathBuf>,
    /// Set a key of the configuration, for example `flow.scheme=thurston`; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

#[derive(Debug, Args)]
pub struct Build {
    #[command(flatten)]
    pub inputs: Inputs,
    /// Folder for the atlases [default: output.folder of the configuration, or affine-atlas-out]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Build also what is there, whole, and of the same mesh, settings and version
    #[arg(short, long)]
    pub force: bool,
    /// Say what would be built, and why, and build nothing
    #[arg(short = 'n', long)]
    pub dry_run: bool,
    /// Write for Make and Ninja which files OUT/manifest.jsonl was made from
    #[arg(long, value_name = "FILE")]
    pub depfile: Option<PathBuf>,
    /// Write where the time goes, as a trace that Perfetto (ui.perfetto.dev) opens
    #[arg(long, value_name = "FILE")]
    pub profile: Option<PathBuf>,
    /// Meshes to build at the same time; 0 takes one for each core [default: run.jobs of the configuration]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub jobs: Option<u16>,
}

#[derive(Debug, Args)]
pub struct Plan {
    #[command(flatten)]
    pub inputs: Inputs,
    /// Folder for the atlases [default: output.folder of the configuration, or affine-atlas-out]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Build also what is there, whole, and of the same mesh, settings and version
    #[arg(short, long)]
    pub force: bool,
    /// Say how even so many shards would be
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(shard::MOST)))]
    pub shards: Option<u32>,
    /// File to write, replacing an older one
    #[arg(short, long, value_name = "PLAN.jsonl")]
    pub plan: PathBuf,
}

#[derive(Debug, Args)]
pub struct Run {
    /// File that `affine-atlas plan` wrote
    #[arg(short, long, value_name = "PLAN.jsonl")]
    pub plan: PathBuf,
    /// Which part, from 1, and of how many
    #[arg(short, long, value_name = "I/N", default_value_t = Shard::WHOLE)]
    pub shard: Shard,
    /// Meshes to build at the same time; 0 takes one for each core [default: run.jobs of the configuration]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub jobs: Option<u16>,
}

#[derive(Debug, Args)]
pub struct Merge {
    /// File that `affine-atlas plan` wrote
    #[arg(short, long, value_name = "PLAN.jsonl")]
    pub plan: PathBuf,
    /// Record meshes that are not done as cancelled instead of refusing
    #[arg(long)]
    pub incomplete: bool,
    /// Write for Make and Ninja which files OUT/manifest.jsonl was made from
    #[arg(long, value_name = "FILE")]
    pub depfile: Option<PathBuf>,
}

/// What `build` tells a worker beside its job.
#[derive(Debug, Args)]
pub struct Worker {
    /// The mesh
    pub input: PathBuf,
    /// The output root
    pub output: PathBuf,
}

#[derive(Debug, Args)]
pub struct Check {
    #[command(flatten)]
    pub inputs: Inputs,
    /// Where no circle packing exists for the mesh as it is: write the surface in grey with the worst
    /// region in colour, and the region's vertices in its extras; with several meshes, a file each
    #[arg(long, value_name = "FILE.glb")]
    pub region: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Cones {
    #[command(flatten)]
    pub inputs: Inputs,
    /// Folder for the results [default: output.folder of the configuration, or affine-atlas-out]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Numbers of cones to try [default: 0,4,8,16,32, as far as the surface allows]
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub counts: Option<Vec<u32>>,
    /// Write one JSON array instead of tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Verify {
    /// Folders that `build` wrote: of one mesh, or of many
    #[arg(value_name = "DIR", required = true)]
    pub folders: Vec<PathBuf>,
    /// Write one JSON array instead of text
    #[arg(long)]
    pub json: bool,
    /// Compare with the mesh the atlas was made from
    #[arg(long, value_name = "MESH")]
    pub source: Option<PathBuf>,
    /// Refuse components with more cones than this
    #[arg(long, value_name = "N")]
    pub cones: Option<usize>,
}

#[derive(Debug, Args)]
pub struct Rebuild {
    /// Folder that `build` wrote for a mesh
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// File to write, replacing an older one
    #[arg(short, long, value_name = "MESH.glb")]
    pub out: PathBuf,
    /// Measure the distance from this mesh
    #[arg(long, value_name = "MESH")]
    pub against: Option<PathBuf>,
    /// Write JSON instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Fit {
    /// Mesh, or folder that `build` wrote for one
    #[arg(value_name = "MESH")]
    pub input: PathBuf,
    /// Folder to write, replacing an older one [default: NAME.fit here for NAME.obj, beside it for a folder]
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Cells of the control mesh, about; each is a bicubic piece [default: 2000]
    #[arg(long, value_name = "N", conflicts_with = "tolerance", value_parser = clap::value_parser!(u32).range(1..))]
    pub cells: Option<u32>,
    /// Take the coarsest grid with which no place of the mesh is farther from the surface: a part of the diagonal
    /// such as 0.001, or a length with a unit such as 0.1mm
    #[arg(long, value_name = "DISTANCE", value_parser = tolerance)]
    pub tolerance: Option<Tolerance>,
    /// How far normals of STEP faces may differ beside irregular points, degrees; less takes more control points
    #[arg(long, value_name = "DEGREES", default_value_t = DEFAULT_ANGLE, value_parser = angle)]
    pub angle: f64,
    /// Unit of the mesh's coordinates: mm, cm, m or in [default: m for glTF, which is in metres, else mm]
    #[arg(long, value_name = "UNIT", value_parser = unit)]
    pub unit: Option<LengthUnit>,
    /// Write JSON instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Texture {
    /// Folder that `build` wrote for a mesh
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Image that repeats in both directions (PNG or JPEG)
    #[arg(short, long, value_name = "IMAGE")]
    pub pattern: PathBuf,
    /// Folder to write, replacing an older one [default: DIR.texture]
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Tiles along a side of a cell of the grid; `grid.cells` of the build says how large cells are
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(TILES_RANGE))]
    pub tiles: u32,
    /// Texels along a side of the texture; several components have as many in all, by their areas
    #[arg(long, value_name = "N", default_value_t = DEFAULT_SIZE, value_parser = clap::value_parser!(u32).range(SIZE_RANGE))]
    pub size: u32,
    /// Write JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// A largest distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// As a part of the diagonal.
    OfDiagonal(f64),
    /// In metres.
    Metres(f64),
}

/// A part of the diagonal, or a length.
fn tolerance(text: &str) -> Result<Tolerance, String> {
    let wanted = "it must be a part of the diagonal below 1, such as 0.001, or a length such as 0.1mm (mm, cm, m, in)";
    // Millimetres end with the symbol of metres.
    let mut units = LengthUnit::ALL
        .iter()
        .filter_map(|u| Some((text.strip_suffix(u.symbol())?, u)));
    let found = units.find_map(|(number, unit)| Some((number.trim().parse::<f64>().ok()?, unit)));
    let is_good = |x: &f64| x.is_finite() && *x > 0.0;
    match found {
        Some((length, unit)) => Some(length)
            .filter(is_good)
            .map(|x| Tolerance::Metres(x * unit.metres())),
        None => text
            .parse()
            .ok()
            .filter(|x| is_good(x) && *x < 1.0)
            .map(Tolerance::OfDiagonal),
    }
    .ok_or_else(|| wanted.to_owned())
}

/// An angle that grids of knots can reach.
fn angle(text: &str) -> Result<f64, String> {
    let number = text
        .parse()
        .ok()
        .filter(|x| (LEAST_ANGLE..=90.0).contains(x));
    number.ok_or_else(|| format!("it must be a number from {LEAST_ANGLE} to 90"))
}

/// Least angle between normals that may be asked for, degrees.
const LEAST_ANGLE: f64 = 0.001;

fn unit(text: &str) -> Result<LengthUnit, String> {
    let unit = LengthUnit::ALL.into_iter().find(|u| u.symbol() == text);
    unit.ok_or_else(|| "it must be mm, cm, m or in".to_owned())
}

#[derive(Debug, Args)]
pub struct Init {
    /// File to write, or folder to write config.toml into
    #[arg(value_name = "PATH", default_value = "config.toml")]
    pub path: PathBuf,
    /// Replace an existing file
    #[arg(long)]
    pub force: bool,
}

/// What to explain.
#[derive(Debug, Args)]
pub struct Explain {
    #[command(flatten)]
    pub inputs: Inputs,
    /// Write the faces at fault, in colour on the surface around them
    #[arg(short, long, value_name = "FILE.glb")]
    pub out: Option<PathBuf>,
}

/// What to print.
#[derive(Clone, Copy, Debug, Args)]
pub struct Schema {
    /// Which file
    #[arg(value_name = "FILE", value_enum)]
    pub of: SchemaOf,
}

/// What there are schemas of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SchemaOf {
    /// atlas.json
    Atlas,
    /// components.json
    Components,
    /// a line of manifest.jsonl
    Manifest,
    /// config.toml
    Config,
    /// a line of a plan
    Plan,
    /// fit.json
    Fit,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn global_options_stand_anywhere() {
        for line in [
            ["affine-atlas", "--threads", "3", "build"],
            ["affine-atlas", "build", "--threads", "3"],
        ] {
            let arguments = Arguments::try_parse_from(line).expect("parses");
            assert_eq!(arguments.global.threads, Some(3));
        }
    }
}
