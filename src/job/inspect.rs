//! What a build would do with an asset, without building it.

mod existence;

use super::flatten::{prepared_at_first, prescribed};
use super::listing::{self, MOST_LISTED, counted, left_out};
use super::warnings::inside_out;
use super::{BuildError, refine_for, shares};
use crate::atlas::patch::Domain;
use crate::config::Config;
use crate::export::ExportError;
use crate::export::glb::region::{self, RegionOf};
use crate::flow::cones::{self, BoundaryCondition, Prescription, in_pi};
use crate::flow::refine;
use crate::flow::refine::ConnectivityRepair;
use crate::geometry::mesh::Mesh;
use crate::outcome::Failure;
use crate::read;
use crate::repair::inside_out::inside_out as find_inside_out;
use crate::repair::{self, Component};
use existence::Verdict;
use std::f64::consts::PI;
use std::fmt::{self, Write as _};
use std::path::Path;

/// What `check` says of one asset.
pub struct Inspection {
    text: String,
    failures: Vec<Failure>,
    regions: Vec<RegionOf>,
}

impl Inspection {
    /// Why parts of the asset would be refused, as far as that is known before the flow.
    pub fn failures(&self) -> &[Failure] {
        &self.failures
    }

    /// A GLB of the components for which no circle packing exists before connectivity repair, each with its worst region in
    /// colour; `None` where there is none, or where the scheme is no circle packing.
    pub fn region_glb(&self) -> Option<Result<Vec<u8>, ExportError>> {
        (!self.regions.is_empty()).then(|| region::encode(&self.regions))
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Reads and repairs an asset, and says topology, Gauss–Bonnet budget, cones, and what would change.
pub fn inspect(path: &Path, config: &Config) -> Result<Inspection, BuildError> {
    let config = &config.clone().resolved()?;
    let otherwise = &config.on_flat_patches();
    let asset = read::read(path, &config.limits)?;
    let soup = &asset.soup;
    let repaired = repair::repair(soup, &config.repair)?;
    let assigned = |c: &Config| cones::assign(&repaired, &c.cones, &c.boundary, &c.features);
    let (requests, of_flat) = (assigned(config)?, assigned(otherwise)?);
    let mut text = String::new();
    let count = repaired.components.len();
    let mut whole = |s: String| {
        let _ = writeln!(text, "{s}");
    };
    whole(format!(
        "{}, {}, {}",
        counted(soup.positions.len(), "vertex", "vertices"),
        counted(soup.faces.len(), "triangle", "triangles"),
        counted(count, "component", "components")
    ));
    for note in &asset.notes {
        whole(format!("note: {note}"));
    }
    if let Some(note) = inside_out(
        &path.to_string_lossy(),
        &find_inside_out(&repaired.components),
    ) {
        whole(format!("note: {note}"));
    }
    let (mut failures, mut regions, mut others) = (Vec::new(), Vec::new(), 0);
    let shares = shares::shares(&repaired.components);
    let parts = repaired.components.into_iter().zip(shares);
    let parts = parts.zip(requests.into_iter().zip(of_flat));
    for (i, ((component, share), (requests, of_flat))) in parts.enumerate() {
        let config = &shares::of_share(config, share)?;
        let mut of_part = Vec::new();
        let mut is_listed = i < MOST_LISTED;
        let mut line = |s: String| of_part.push(s);
        if count > 1 {
            line(format!("component {i}:"));
        }
        let changes = component.log.summary();
        let changes = if component.log.is_empty() {
            "nothing"
        } else {
            changes.as_str()
        };
        line(format!("  repair: {changes}"));
        let frame = component.frame;
        let mut offend = |mut region: RegionOf| {
            region.component = i;
            frame.leave_all(&mut region.mesh.positions);
            regions.push(region)
        };
        let again = component.clone();
        let mut planned = plan(component, &requests, config, &mut line, &mut offend);
        if let (Err(error), Domain::Grid, Ok(_)) = (&planned, config.domain(), &again.mesh) {
            line(format!("  no grid, but flat patches: {error}"));
            is_listed = true;
            planned = plan(again, &of_flat, otherwise, &mut line, &mut offend);
        }
        match planned {
            Ok(()) => {}
            Err(error) => {
                line(format!("  refused: {error}"));
                is_listed = true;
                failures.push(Failure::from(&error));
            }
        }
        match is_listed {
            true => of_part.into_iter().for_each(&mut whole),
            false => others += 1,
        }
    }
    if others > 0 {
        whole(left_out(others));
    }
    Ok(Inspection {
        text,
        failures,
        regions,
    })
}

/// Everything up to the flow, with a line for each thing worth knowing.
fn plan(
    component: Component,
    requests: &cones::Requests,
    config: &Config,
    line: &mut impl FnMut(String),
    offend: &mut impl FnMut(RegionOf),
) -> Result<(), BuildError> {
    let mesh = prepared_at_first(component.mesh?, requests, config)?;
    let prescription = prescribed(&mesh, requests, config)?;
    let given = existence::decide(&mesh, &prescription, &config.flow)
        .map_err(|e| BuildError::flow(e, &mesh))?;
    if let Some(Verdict::Impossible(violation)) = &given {
        offend(RegionOf {
            component: 0,
            mesh: mesh.clone(),
            violation: violation.clone(),
        });
        let violation = refine::in_source(violation.clone(), &mesh);
        if !config.connectivity.is_enabled(&config.flow) {
            describe(&mesh, &prescription, None, line);
            return Err(BuildError::Flow(violation.into()));
        }
        let said = violation.inequality();
        line(format!(
            "  circle packing: none on the connectivity as given: {said}"
        ));
    }
    let (mesh, prescription, repair) = refine_for(config, mesh, prescription)?;
    let enabled = config.connectivity.is_enabled(&config.flow);
    describe(&mesh, &prescription, enabled.then_some(&repair), line);
    let verdict = match repair.splits {
        0 => given,
        _ => existence::decide(&mesh, &prescription, &config.flow)
            .map_err(|e| BuildError::flow(e, &mesh))?,
    };
    line(existence::line(verdict.as_ref(), &mesh, &config.flow));
    Ok(())
}

fn describe(
    mesh: &Mesh,
    prescription: &Prescription,
    repair: Option<&ConnectivityRepair>,
    line: &mut impl FnMut(String),
) {
    let t = mesh.connectivity.topology();
    line(format!(
        "  topology: genus {}, {}, Euler characteristic {}",
        t.genus,
        counted(t.boundary_loops, "boundary loop", "boundary loops"),
        t.euler_characteristic
    ));
    line(match repair.map(|repair| repair.splits) {
        None => "  connectivity repair: off".to_owned(),
        Some(0) => "  connectivity repair: nothing".to_owned(),
        Some(splits) => format!(
            "  connectivity repair: {}, then {} vertices and {} faces",
            counted(splits, "split", "splits"),
            t.vertices,
            t.faces
        ),
    });
    let required = in_pi(2.0 * PI * t.euler_characteristic as f64);
    let given = in_pi(prescription.cones.iter().map(|c| c.curvature).sum());
    let free = t.boundary_loops > 0 && prescription.boundary == BoundaryCondition::Free;
    line(if free {
        format!(
            "  Gauss–Bonnet: {required} required, {given} on cones, the rest falls on the free boundary"
        )
    } else {
        format!("  Gauss–Bonnet: {required} required, {given} prescribed")
    });
    for words in listing::cones(mesh, prescription) {
        line(format!("  {words}"));
    }
}
