//! From arguments to what is to be done: the configuration and the named assets.

use super::arguments::Inputs;
use super::problem::Problem;
use affine_atlas::batch::{Settings, Task, inputs};
use affine_atlas::config::assets::{Asset, name_assets};
use affine_atlas::config::{self, Config, Loaded};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is to be done.
#[derive(Debug)]
pub struct Selection {
    /// The effective configuration.
    pub config: Config,
    /// The output folder, relative to the current folder or absolute.
    pub output: PathBuf,
    /// At least one.
    pub assets: Vec<Asset>,
    /// The settings of each asset.
    pub settings: Vec<Arc<Settings>>,
    /// Files that were read to find that out.
    pub files: Vec<PathBuf>,
}

/// Reads the configuration and names the assets.
///
/// Positional arguments that end in `.toml` are a configuration, all others name meshes and take
/// the place of `input.paths`. Meshes without a configuration use the defaults; `config.toml` is
/// read only where nothing is named at all.
pub fn select(inputs: &Inputs, out: Option<&Path>) -> Result<Selection, Problem> {
    let (configs, meshes): (Vec<&PathBuf>, Vec<&PathBuf>) =
        inputs.inputs.iter().partition(|path| is_config(path));
    let default = PathBuf::from("config.toml");
    let file = match configs[..] {
        [] if meshes.is_empty() => Some(&default),
        [] => None,
        [only] => Some(only),
        [first, second, ..] => {
            return Err(Problem::TwoConfigs {
                first: first.clone(),
                second: second.clone(),
            });
        }
    };
    let mut loaded = match file {
        Some(file) => config::load(file, &inputs.set)?,
        None => config::defaults(&inputs.set)?,
    };
    if !meshes.is_empty() {
        loaded.config.input.paths = meshes.into_iter().cloned().collect();
        loaded.input_base = PathBuf::new();
    }
    if let Some(out) = out {
        loaded.config.output.folder = out.to_owned();
        loaded.output_base = PathBuf::new();
    }
    if loaded.config.input.paths.is_empty() {
        return Err(Problem::NoInputs);
    }
    let output = loaded.output_folder();
    let inputs = inputs::expand(&loaded.config.input.paths, &loaded.input_base, &output)?;
    if inputs.files.is_empty() {
        return Err(Problem::NothingFound {
            notes: inputs.notes,
            output,
        });
    }
    for note in &inputs.notes {
        tracing::warn!("{note}");
    }
    let assets = name_assets(inputs.files);
    let settings = settings(&mut loaded, &assets)?;
    let mut files = loaded.files;
    files.extend(inputs.lists);
    Ok(Selection {
        settings,
        config: loaded.config,
        output,
        assets,
        files,
    })
}

/// The settings of each asset; those for which the same tables are share theirs.
fn settings(loaded: &mut Loaded, assets: &[Asset]) -> Result<Vec<Arc<Settings>>, Problem> {
    let mut known: HashMap<Vec<usize>, Arc<Settings>> = HashMap::new();
    let mut of_assets = Vec::with_capacity(assets.len());
    for asset in assets {
        let tables = loaded.overrides_for(&asset.given);
        let settings = match known.get(&tables) {
            Some(settings) => Arc::clone(settings),
            None => {
                let settings = Arc::new(Settings::new(loaded.config_with(&tables)?));
                known.insert(tables, Arc::clone(&settings));
                settings
            }
        };
        of_assets.push(settings);
    }
    for (i, table) in loaded.overrides().iter().enumerate() {
        if !known.keys().any(|tables| tables.contains(&i)) {
            let pattern = &table.pattern;
            tracing::warn!(
                "{}: no mesh of this run matches `{pattern}`: this [[asset]] table has no effect",
                table.at
            );
        }
    }
    Ok(of_assets)
}

fn is_config(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

impl Selection {
    /// The folder that is written for an asset.
    pub fn folder(&self, asset: &Asset) -> PathBuf {
        self.output.join(&asset.id)
    }

    /// Every asset with its settings.
    pub fn items(&self) -> impl Iterator<Item = (&Asset, &Arc<Settings>)> {
        self.assets.iter().zip(&self.settings)
    }

    /// What is to be done, once all input files have been hashed.
    pub fn tasks(&self) -> Vec<Task> {
        let items: Vec<_> = self.items().collect();
        let look = |&(asset, settings): &(&Asset, &Arc<Settings>)| Task::new(asset, settings);
        items.par_iter().map(look).collect()
    }

    /// Refuses a selection in which an asset's folder, which is replaced as a whole, holds an input:
    /// `build spot/spot.obj --out .` must not delete `spot/spot.obj`.
    /// `folder` is that of an asset.
    pub fn keep_inputs(&self, folder: impl Fn(&Asset) -> PathBuf) -> Result<(), Problem> {
        let folders = self.assets.iter().map(folder);
        // A folder that does not exist holds nothing.
        let real = folders.filter_map(|folder| Some((folder.canonicalize().ok()?, folder)));
        let real: HashMap<PathBuf, PathBuf> = real.collect();
        if real.is_empty() {
            return Ok(());
        }
        for input in self.assets.iter().map(|asset| &asset.path) {
            let Ok(resolved) = input.canonicalize() else {
                continue;
            };
            if let Some(folder) = resolved.ancestors().find_map(|above| real.get(above)) {
                return Err(Problem::OverwritesInput {
                    folder: folder.clone(),
                    input: input.clone(),
                });
            }
        }
        Ok(())
    }
}

/// Sets up the threads of this run: the option, else the configuration, else one for each core.
pub fn start_threads(option: Option<u16>, config: &Config) -> Result<(), Problem> {
    let given = option.map_or(config.run.threads, usize::from);
    rayon::ThreadPoolBuilder::new()
        .num_threads(given)
        .build_global()
        .map_err(|error| Problem::Threads {
            given,
            reason: error.to_string(),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inputs(names: &[&Path], set: &[&str]) -> Inputs {
        Inputs {
            inputs: names.iter().map(|name| name.to_path_buf()).collect(),
            set: set.iter().map(|&text| text.to_owned()).collect(),
        }
    }

    #[test]
    fn meshes_use_the_defaults_and_start_at_the_current_folder() {
        let selected = select(&inputs(&[Path::new("m/a.obj")], &[]), None).expect("selected");
        assert_eq!(selected.assets[0].path, Path::new("m/a.obj"));
        assert_eq!(selected.output, Path::new("affine-atlas-out"));
        assert_eq!(
            selected.folder(&selected.assets[0]),
            Path::new("affine-atlas-out/a")
        );
    }

    #[test]
    fn meshes_beside_a_configuration_replace_its_paths() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("my.TOML");
        std::fs::write(
            &file,
            "[input]\npaths = [\"x.obj\"]\n[patches]\npadding = 7",
        )
        .expect("written");
        let own = select(&inputs(&[&file], &[]), Some(Path::new("out"))).expect("selected");
        assert_eq!(own.assets[0].path, folder.path().join("x.obj"));
        assert_eq!(own.output, Path::new("out"));
        let other = select(&inputs(&[Path::new("y.obj"), &file], &[]), None).expect("selected");
        assert_eq!(other.assets[0].path, Path::new("y.obj"));
        assert_eq!(other.output, folder.path().join("affine-atlas-out"));
        assert_eq!(other.config.patches.padding, 7);
    }

    #[test]
    fn two_configurations_and_no_mesh_are_refused() {
        let two = select(
            &inputs(&[Path::new("a.toml"), Path::new("b.toml")], &[]),
            None,
        );
        assert!(matches!(two, Err(Problem::TwoConfigs { .. })));
        let none = select(&inputs(&[Path::new("a.obj")], &["flow.scheme"]), None);
        assert!(matches!(none, Err(Problem::Config(_))));
    }

    #[test]
    fn an_input_inside_its_own_output_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let inner = folder.path().join("spot");
        std::fs::create_dir(&inner).expect("created");
        let mesh = inner.join("spot.obj");
        std::fs::write(&mesh, "").expect("written");
        let inside = select(&inputs(&[&mesh], &[]), Some(folder.path())).expect("selected");
        assert!(matches!(
            inside.keep_inputs(|asset| inside.folder(asset)),
            Err(Problem::OverwritesInput { .. })
        ));
        let beside = select(&inputs(&[&mesh], &[]), Some(&inner)).expect("selected");
        beside
            .keep_inputs(|asset| beside.folder(asset))
            .expect("spot/spot does not exist");
    }
}
