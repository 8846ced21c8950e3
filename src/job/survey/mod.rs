//! What cones gain: the same surface flattened with different numbers of them.
//!
//! *Enters:* a mesh, a configuration and how many cones to try. *Leaves:* a [`Survey`]: for every component and number one [`Row`]
//! with the cones that the automatic choice places, the distortion they leave and the cut they need; for comparison what equal
//! cones far apart give, or none where the surface needs none; and a suggestion.
//!
//! A row's figures belong to its list of cones: the choice is written down as [`ConeSpec`]s first and flattened from
//! these, so that a configuration with this list gives the same metric to the last bit. *Not guaranteed:* that every choice can be
//! written down: a vertex that repair split has no number of its own in the file.

mod figures;
mod files;
mod suggestion;
mod text;

pub use figures::{Figures, Marked, Scene};
pub use files::folder_name;
pub use suggestion::Suggestion;

use super::BuildError;
use super::components::Observed;
use super::flatten::{flatten, prescribed};
use crate::atlas::patch::Domain;
use crate::config::Config;
use crate::flow::cones::{
    self, Cone, ConeParams, ConeSpec, ConeStrategy, PiMultiple, Prescription, Requests,
};
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::VertexVec;
use crate::geometry::mesh::{Mesh, Soup, triangle_area};
use crate::observe::Observer;
use crate::outcome::{AssetOutcome, AssetState, ComponentOutcome, Failure};
use crate::read;
use crate::repair::{self, Repaired};
use std::f64::consts::PI;
use std::path::Path;
use std::time::Instant;

/// Numbers of cones that are tried where nobody names others.
pub const DEFAULT_COUNTS: [usize; 5] = [0, 4, 8, 16, 32];
/// The number of cones of the row that everything is compared with.
const COMPARED: usize = 8;

/// The survey of one asset.
#[derive(Debug)]
pub struct Survey {
    /// Name of the asset.
    pub id: String,
    /// The mesh as the user wrote it.
    pub given: String,
    /// What the reader left out.
    pub notes: Vec<String>,
    /// In the order of their first face.
    pub components: Vec<ComponentSurvey>,
}

/// The survey of one component.
#[derive(Debug)]
pub struct ComponentSurvey {
    /// Which, from 0.
    pub index: usize,
    /// The surface, or why there is none.
    pub surface: Result<Surface, Failure>,
    /// The first is what everything is compared with.
    pub rows: Vec<Row>,
    /// How many cones to take; absent where no row could be built.
    pub suggestion: Option<Suggestion>,
}

/// A component before it is flattened.
#[derive(Debug)]
pub struct Surface {
    /// After repair, before connectivity repair.
    pub mesh: Mesh,
    /// Its counts.
    pub topology: Topology,
    /// Area in space, square source units.
    pub area: f64,
}

/// One number of cones.
#[derive(Debug)]
pub struct Row {
    /// How the cones were chosen: `spread` or `none` for comparison, else `auto`.
    pub strategy: ConeStrategy,
    /// How many were asked for.
    pub asked: usize,
    /// What came of it.
    pub result: Result<Figures, Failure>,
    /// Wall time of choice, flow, overlay and cut.
    pub seconds: f64,
}

impl ComponentSurvey {
    /// The rows of the automatic choice, and that without cones.
    pub fn chosen(&self) -> impl Iterator<Item = &Row> {
        let without_spread = |row: &&Row| row.strategy != ConeStrategy::Spread;
        self.rows.iter().filter(without_spread)
    }

    /// What a row is compared with: equal cones in the same number, or none.
    pub fn before(&self, asked: usize) -> Option<&Row> {
        self.rows.iter().find(|row| match row.strategy {
            ConeStrategy::Spread => row.asked == asked,
            strategy => strategy == ConeStrategy::None,
        })
    }
}

/// Surveys every component of a mesh in memory. `counts` are numbers of cones; absent: [`DEFAULT_COUNTS`], as far as the
/// topology allows. One bad row or component does not spoil the others; what concerns the whole mesh is the outer error.
pub fn survey(
    soup: &Soup,
    config: &Config,
    counts: Option<&[usize]>,
    observer: &dyn Observer,
) -> Result<Vec<ComponentSurvey>, BuildError> {
    observer.stage("repair", 0, 1);
    let config = &for_survey(config)?;
    let repaired = repair::repair(soup, &config.repair)?;
    // What is wrong with the configuration is said once, not in every row.
    let automatic = with_cones(config, ConeStrategy::Auto, COMPARED);
    let features = &automatic.features;
    cones::assign(&repaired, &automatic.cones, &automatic.boundary, features)?;
    let surveyed = (0..repaired.components.len()).map(|index| {
        let task = Task {
            repaired: &repaired,
            index,
            config,
            observer,
        };
        task.component(counts)
    });
    surveyed.collect()
}

/// The configuration of flat patches: the cones of a grid are those of its field.
fn for_survey(config: &Config) -> Result<Config, BuildError> {
    let config = config.clone().resolved()?;
    Ok(match config.domain() {
        Domain::Flat => config,
        Domain::Grid => config.on_flat_patches(),
    })
}

/// The same configuration with other cones; how the automatic choice shall choose stays.
fn with_cones(config: &Config, strategy: ConeStrategy, count: usize) -> Config {
    let cones = ConeParams {
        strategy,
        count: Some(count.max(1)),
        list: Vec::new(),
        file: None,
        file_lines: Vec::new(),
        file_first_vertex: 0,
        curvature: None,
        vertex: None,
        ..config.cones.clone()
    };
    Config {
        cones,
        features: Default::default(),
        ..config.clone()
    }
}

/// One component to be surveyed.
struct Task<'a> {
    repaired: &'a Repaired,
    index: usize,
    config: &'a Config,
    observer: &'a dyn Observer,
}

impl Task<'_> {
    fn component(&self, counts: Option<&[usize]>) -> Result<ComponentSurvey, BuildError> {
        let index = self.index;
        let component = &self.repaired.components[index];
        let frame = component.frame;
        let mut mesh = match &component.mesh {
            Ok(mesh) => mesh.clone(),
            Err(error) => {
                return Ok(ComponentSurvey {
                    index,
                    surface: Err(Failure::from(&BuildError::Component(error.clone()))),
                    rows: Vec::new(),
                    suggestion: None,
                });
            }
        };
        let c = &mesh.connectivity;
        let topology = c.topology();
        let faces = c.faces().map(|f| triangle_area(mesh.face_positions(f)));
        let area = frame.area(faces.sum());
        let mut rows = Vec::new();
        for (strategy, asked) in candidates(&mesh, &topology, counts) {
            rows.push(self.row(&mesh, strategy, asked)?);
        }
        frame.leave_all(&mut mesh.positions);
        let mut survey = ComponentSurvey {
            index,
            surface: Ok(Surface {
                mesh,
                topology,
                area,
            }),
            rows,
            suggestion: None,
        };
        survey.suggestion = suggestion::suggest(&survey);
        Ok(survey)
    }

    /// The outer error is Ctrl-C.
    fn row(&self, mesh: &Mesh, strategy: ConeStrategy, asked: usize) -> Result<Row, BuildError> {
        let start = Instant::now();
        let result = match self.flatten(mesh, strategy, asked) {
            Ok(figures) => Ok(figures),
            Err(BuildError::Cancelled) => return Err(BuildError::Cancelled),
            Err(error) => Err(Failure::from(&error)),
        };
        Ok(Row {
            strategy,
            asked,
            result,
            seconds: start.elapsed().as_secs_f64(),
        })
    }

    fn flatten(
        &self,
        mesh: &Mesh,
        strategy: ConeStrategy,
        asked: usize,
    ) -> Result<Figures, BuildError> {
        let stages = Observed {
            observer: self.observer,
            component: self.index,
            components: self.repaired.components.len(),
        };
        stages.enter(match strategy {
            ConeStrategy::Spread => "spread cones",
            ConeStrategy::None => "no cones",
            _ => "chosen cones",
        })?;
        let config = with_cones(self.config, strategy, asked);
        let requests = self.requests(&config)?;
        let chosen = prescribed(mesh, &requests, &config)?;
        let specs = self.written(mesh, &chosen.cones);
        let prescription = match &specs {
            Some(list) if !list.is_empty() => self.listed(mesh, &config, list)?,
            // Without cones, and where they cannot be written down.
            _ => chosen,
        };
        let inside = inside(mesh, &prescription);
        // A row is one stage for who watches.
        let enter = |_| match self.observer.cancelled() {
            true => Err(BuildError::Cancelled),
            false => Ok(()),
        };
        let flat = flatten(mesh.clone(), prescription, &config, self.observer, &enter)?;
        let frame = &self.repaired.components[self.index].frame;
        Ok(Figures::measure(mesh, &flat, inside, specs, frame))
    }

    fn requests(&self, config: &Config) -> Result<Requests, BuildError> {
        let (cones, boundary) = (&config.cones, &config.boundary);
        let mut all = cones::assign(self.repaired, cones, boundary, &config.features)?;
        Ok(all.swap_remove(self.index))
    }

    /// The cones inside the surface as a list names them; none where the file has no name for one of them.
    fn written(&self, mesh: &Mesh, cones: &[Cone]) -> Option<Vec<ConeSpec>> {
        let inside = (cones.iter()).filter(|c| !mesh.connectivity.is_boundary_vertex(c.vertex));
        let write = |cone: &Cone| {
            let vertex = mesh.source_vertex[cone.vertex];
            let found = self.repaired.locate(vertex);
            (found == Some((self.index, cone.vertex))).then_some(ConeSpec {
                vertex: Some(vertex),
                point: None,
                curvature: multiple_of_pi(cone.curvature)?,
            })
        };
        inside.map(write).collect()
    }

    fn listed(
        &self,
        mesh: &Mesh,
        config: &Config,
        list: &[ConeSpec],
    ) -> Result<Prescription, BuildError> {
        let mut config = config.clone();
        config.cones.strategy = ConeStrategy::Listed;
        config.cones.list = list.to_vec();
        let requests = self.requests(&config)?;
        Ok(prescribed(mesh, &requests, &config)?)
    }
}

/// The cones of a prescription that are inside the surface.
fn inside(mesh: &Mesh, prescription: &Prescription) -> Vec<Cone> {
    let inside = |cone: &&Cone| !mesh.connectivity.is_boundary_vertex(cone.vertex);
    let cones = prescription.cones.iter().filter(inside);
    cones.copied().collect()
}

/// What is tried on a component, and in which order: what everything is compared with comes first.
fn candidates(
    mesh: &Mesh,
    topology: &Topology,
    counts: Option<&[usize]>,
) -> Vec<(ConeStrategy, usize)> {
    let c = &mesh.connectivity;
    let inside = c.vertices().filter(|&v| !c.is_boundary_vertex(v)).count();
    let closed = topology.boundary_loops == 0;
    let needs_cones = closed && topology.euler_characteristic != 0;
    let is_possible = |count: usize| match count {
        0 => !needs_cones,
        // Each has less than 2π of the 4π of a sphere.
        1 | 2 => !(closed && topology.euler_characteristic == 2),
        _ => count <= inside,
    };
    let mut wanted: Vec<usize> = match counts {
        Some(counts) => counts.to_vec(),
        None => (DEFAULT_COUNTS.into_iter())
            .filter(|&n| is_possible(n))
            .collect(),
    };
    wanted.sort_unstable();
    wanted.dedup();
    let mut all = Vec::new();
    if needs_cones {
        let compared = [COMPARED].into_iter().chain(wanted.iter().copied());
        let compared = compared.filter(|&n| n > 0 && is_possible(n));
        all.extend(compared.map(|n| (ConeStrategy::Spread, n)));
        // The one that is compared with all others is wanted anyway.
        if let Some(again) = all.iter().skip(1).position(|c| c.1 == COMPARED) {
            all.remove(again + 1);
        }
    } else {
        all.push((ConeStrategy::None, 0));
    }
    for &count in &wanted {
        match count {
            0 if !needs_cones => {} // stands first already
            0 => all.push((ConeStrategy::None, 0)),
            _ => all.push((ConeStrategy::Auto, count)),
        }
    }
    all
}

/// A curvature as a list writes it: as a fraction of small denominator where it is one to rounding.
fn multiple_of_pi(radians: f64) -> Option<PiMultiple> {
    let multiple = radians / PI;
    let as_fraction = |denominator: i64| {
        let numerator = (multiple * denominator as f64).round();
        let fraction = PiMultiple::fraction(numerator as i64, denominator)?;
        let is_same = (fraction.radians() - radians).abs() <= 4.0 * f64::EPSILON * radians.abs();
        is_same.then_some(fraction)
    };
    let fraction = (1..=12).find_map(as_fraction);
    fraction.or_else(|| PiMultiple::decimal(multiple))
}

/// The log scale of the vertices that a surface had before connectivity repair and overlay, which come first.
fn first_vertices(log_scale: &VertexVec<f64>, count: usize) -> Vec<f64> {
    log_scale.iter().copied().take(count).collect()
}

/// Surveys one asset and writes `output/ID.cones`: a configuration and a two-column text for each number of cones, pictures, and the
/// table as `cones.json`. `given` is the path as the user wrote it. The folder appears whole or not at all.
pub fn run(
    path: &Path,
    given: &str,
    output: &Path,
    id: &str,
    config: &Config,
    counts: Option<&[usize]>,
    observer: &dyn Observer,
) -> (Option<Survey>, AssetOutcome) {
    let start = Instant::now();
    let mut outcome = AssetOutcome::whole(id, AssetState::Built, 0.0);
    let mut surveyed = || -> Result<Survey, BuildError> {
        observer.stage("read", 0, 1);
        let asset = read::read(path, &config.limits)?;
        let survey = Survey {
            id: id.to_owned(),
            given: given.to_owned(),
            notes: asset.notes,
            components: survey(&asset.soup, config, counts, observer)?,
        };
        for component in &survey.components {
            let index = component.index;
            let rows = component
                .rows
                .iter()
                .filter_map(|r| r.result.as_ref().err());
            let whole = component.surface.as_ref().err();
            outcome
                .components
                .extend(
                    (whole.into_iter().chain(rows)).map(|failure| ComponentOutcome {
                        index,
                        result: Err(failure.clone()),
                    }),
                );
        }
        outcome.files = files::write(&survey, path, output, config, observer)?;
        Ok(survey)
    };
    let survey = match surveyed() {
        Ok(survey) => Some(survey),
        Err(error) => {
            outcome.state = match error {
                BuildError::Cancelled => AssetState::Cancelled,
                error => AssetState::Failed(Failure::from(&error)),
            };
            None
        }
    };
    outcome.seconds = start.elapsed().as_secs_f64();
    (survey, outcome)
}

#[cfg(test)]
mod tests;
