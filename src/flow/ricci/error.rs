//! Why the flow ends without a metric: every variant names what in the input is at fault, and what to change.

use crate::flow::feasibility::Violation;
use crate::flow::field::FieldError;
use crate::flow::looped::LoopedError;
use crate::flow::packing::PackingError;
use crate::flow::pi_multiple::in_pi;
use crate::flow::schemes::Scheme;
use crate::flow::seamless::SeamlessError;
use crate::flow::solve::SolveError;
use crate::flow::straighten::StraightenError;
use crate::geometry::connectivity::ConnectivityError;
use crate::geometry::ids::{EdgeId, FaceId, VertexId};

/// Why there is no flat metric.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// A list has another length than the connectivity.
    #[error("{given} {what} were given for {needed}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A source length is zero, negative, or no number.
    #[error(
        "edge {edge} between vertices {} and {} has length {length:e}; weld or remove the degenerate faces at it", vertices[0], vertices[1]
    )]
    BadLength {
        /// Edge.
        edge: EdgeId,
        /// Its ends.
        vertices: [VertexId; 2],
        /// Its length, source units.
        length: f64,
    },
    /// A prescribed curvature leaves no positive cone angle, or is no number.
    #[error(
        "vertex {vertex} has a target curvature of {curvature}, which must be a number below {bound} so that its cone angle is positive"
    )]
    BadTarget {
        /// Vertex.
        vertex: VertexId,
        /// Its K̄, radians.
        curvature: f64,
        /// 2π, or π on the boundary.
        bound: f64,
    },
    /// The prescription misses Gauss–Bonnet (5).
    #[error(
        "the prescribed curvatures sum to {prescribed}, but the surface needs {required} (2π times its Euler characteristic)"
    )]
    GaussBonnet {
        /// Σ K̄, radians.
        prescribed: f64,
        /// 2πχ, radians.
        required: f64,
    },
    /// A circle packing cannot exist (6).
    #[error(transparent)]
    Infeasible(#[from] Violation),
    /// No packing close to the mesh was found.
    #[error(transparent)]
    Packing(#[from] PackingError),
    /// A linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Quarter turns need cones of quarter turns.
    #[error(
        "vertex {vertex} has a target curvature of {}π, but transitions that are quarter turns (flow.holonomy = \"quarter-turns\") need multiples of π/2: set cones.quantum = \"1/2\" or cones.strategy = \"field\", or flow.holonomy = \"free\"", in_pi(*.curvature)
    )]
    NoQuarterTurns {
        /// Vertex.
        vertex: VertexId,
        /// Its K̄, radians.
        curvature: f64,
    },
    /// A free border has no corners that are multiples of π/2.
    #[error(
        "flow.holonomy = \"quarter-turns\" needs straight borders, but the boundary condition of {boundary_loops} boundary loop{} is \"free\": set cones.strategy = \"field\", which chooses corners, or boundary.condition = \"corners\" or \"prescribed\", or flow.holonomy = \"free\"", if *.boundary_loops == 1 { "" } else { "s" }
    )]
    QuarterTurnsOnFreeBoundary {
        /// Number of boundary loops.
        boundary_loops: usize,
    },
    /// Quarter turns are found by flips alone.
    #[error(
        "flow.holonomy = \"quarter-turns\" contradicts {setting}: it needs flow.scheme = \"vertex-scaling\", flow.delaunay = true, flow.solver = \"newton\" and no connectivity.enabled"
    )]
    QuarterTurnsWithout {
        /// The key and its value.
        setting: &'static str,
    },
    /// No metric has such quarter turns, or none was found.
    #[error(transparent)]
    Seamless(#[from] SeamlessError),
    /// The loops of the surface could not be found.
    #[error(transparent)]
    Loops(#[from] LoopedError),
    /// The lines of features could not be made edges.
    #[error(transparent)]
    Lines(#[from] StraightenError),
    /// The field with fewer features has no signature.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// The minimum was not reached, or it has broken faces.
    #[error("{}", not_converged_message(*.method, *.iterations, *.max_error, *.tolerance, *.broken, .faces))]
    NotConverged {
        /// What was tried.
        method: Method,
        /// Steps taken.
        iterations: usize,
        /// max |K − K̄| where it ended, radians.
        max_error: f64,
        /// What was asked for, radians.
        tolerance: f64,
        /// Number of faces that break the triangle inequality there.
        broken: usize,
        /// The first of them; none where edges were flipped, since those faces are not the surface's.
        faces: Vec<FaceId>,
    },
    /// The curvatures are met, but `u` runs away: a packing that (6) rules out by equality has curvatures that reach the target
    /// only in the limit.
    #[error("{}", runaway_message(*.method, *.iterations, *.range, *.change))]
    Runaway {
        /// What was tried.
        method: Method,
        /// Steps taken.
        iterations: usize,
        /// Largest minus smallest `u` where it ended.
        range: f64,
        /// By how much a further step would still change the difference of two `u`; infinite where no step exists.
        change: f64,
    },
    /// The flat metric exists, but its scales leave float64.
    #[error(
        "the flat metric exists, but its lengths are scaled by factors more than e^{range:.0} apart (reached after {iterations} steps), and float64 holds numbers from e^-708 to e^709 only; spread the strongest cones' curvature over more vertices, or leave the boundary free"
    )]
    ScaleRange {
        /// Steps taken.
        iterations: usize,
        /// Largest minus smallest `u` where it ended.
        range: f64,
    },
    /// The double of the surface could not be made.
    #[error(transparent)]
    Double(#[from] ConnectivityError),
    /// The observer asked to stop.
    #[error("the flow was cancelled")]
    Cancelled,
}

/// What was tried when a flow failed: the advice depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method {
    /// Which conformal structure.
    pub scheme: Scheme,
    /// Whether edges were flipped.
    pub flips: bool,
    /// The key of the configuration that bounds the number of steps, where that ended the flow.
    pub out_of_steps: Option<&'static str>,
}

fn not_converged_message(
    method: Method,
    iterations: usize,
    max_error: f64,
    tolerance: f64,
    broken: usize,
    faces: &[FaceId],
) -> String {
    let met = max_error <= tolerance;
    let mut message = match met {
        // Then it is the broken faces.
        true => format!(
            "the flow has no solution on this connectivity: after {iterations} steps the curvatures are met"
        ),
        false => format!(
            "the flow did not converge: after {iterations} steps the largest curvature error is {max_error:.3e} (bound {tolerance:.1e})"
        ),
    };
    let breaks = if broken == 1 { "breaks" } else { "break" };
    let counted = |n: usize| format!("{n} face{}", if n == 1 { "" } else { "s" });
    if broken > 0 && method.flips {
        message += &format!(
            "{} {} of the flipped triangulation {breaks} the triangle inequality",
            if met { ", but" } else { " and" },
            counted(broken),
        );
    } else if broken > 0 {
        let listed: Vec<String> = faces.iter().map(FaceId::to_string).collect();
        let more = if broken > faces.len() { ", …" } else { "" };
        message += &format!(
            "{} {} {breaks} the triangle inequality (faces {}{more})",
            if met { ", but" } else { " and" },
            counted(broken),
            listed.join(", ")
        );
    }
    message + &remedy(method, iterations, broken)
}

fn runaway_message(method: Method, iterations: usize, range: f64, change: f64) -> String {
    let what = match method.scheme {
        Scheme::Tangential | Scheme::Thurston => {
            "circles drift apart in size without end: some region meets (6) with equality only"
        }
        Scheme::VertexScaling | Scheme::InversiveDistance => {
            "scales drift apart without end: the minimum lies at infinity"
        }
    };
    let still = match change.is_finite() {
        true => format!("a further step would change that by {change:.1e}"),
        false => "the system has become singular".to_string(),
    };
    let claim = match method.flips {
        true => "the flow has not settled",
        false => "the flow has no solution on this connectivity",
    };
    format!(
        "{claim}: the curvatures are met after {iterations} steps, but the {what} (log scales differ by {range:.1}, and {still}){}",
        remedy(method, iterations, 0)
    )
}

/// Newton's method with flips takes a few dozen steps at the most where float64 holds the angles of all faces.
const MANY_STEPS: usize = 100;

/// What to change, as the end of a sentence.
fn remedy(method: Method, iterations: usize, broken: usize) -> String {
    let is_newton = method.out_of_steps == Some("flow.max_newton_steps");
    if is_newton && method.flips && broken == 0 && iterations >= MANY_STEPS {
        return "; so many steps are never needed where float64's 16 digits hold the angles of the thinnest faces: remove vertices that nearly coincide and faces without width from the mesh".to_string();
    }
    if let Some(key) = method.out_of_steps.filter(|_| broken == 0) {
        return format!("; raise {key}");
    }
    match method.scheme {
        // Gu, Luo, Sun, Wu 2018: only rounding can be in the way.
        Scheme::VertexScaling if method.flips => {
            "; a flat metric exists for these curvatures, but float64's 16 digits do not hold the angles of its thinnest faces: raise flow.curvature_tolerance, or spread the strongest cones' curvature over more vertices"
        }
        Scheme::VertexScaling => {
            "; cones.strategy = \"field\" stretches faces less, and flow.scheme = \"tangential\" breaks none, at the price of angles; where faces may be divided, set flow.delaunay = true: with flips a solution exists always"
        }
        Scheme::InversiveDistance => {
            "; use the scheme `vertex-scaling` with flow.delaunay = true: with flips a solution exists always"
        }
        Scheme::Tangential | Scheme::Thurston => {
            "; raise the valence around the cones by connectivity repair, spread the curvature over more cones, or use the scheme `vertex-scaling` with flow.delaunay = true"
        }
    }
    .to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_message_gives_an_error_below_its_bound_as_the_reason() {
        let broken = [FaceId::new(4)];
        let fixed = method(Scheme::VertexScaling, false);
        let met = not_converged_message(fixed, 9, 1e-12, 1e-10, 1, &broken);
        assert!(met.contains("the curvatures are met, but 1 face breaks"));
        assert!(!met.contains("error"));
        let missed = not_converged_message(fixed, 9, 1.5, 1e-10, 1, &broken);
        assert!(missed.contains("error is 1.500e0 (bound 1.0e-10) and 1 face breaks"));
        let away = runaway_message(method(Scheme::Thurston, false), 44, 52.0, 1.0);
        assert!(away.contains("(6) with equality only") && !away.contains("bound"));
    }

    fn method(scheme: Scheme, flips: bool) -> Method {
        Method {
            scheme,
            flips,
            out_of_steps: None,
        }
    }

    #[test]
    fn flips_are_the_remedy_where_there_were_none_and_only_there() {
        for scheme in [
            Scheme::Tangential,
            Scheme::Thurston,
            Scheme::InversiveDistance,
            Scheme::VertexScaling,
        ] {
            let method = method(scheme, false);
            for message in [
                not_converged_message(method, 9, 1.5, 1e-10, 0, &[]),
                runaway_message(method, 9, 52.0, 1.0),
            ] {
                assert!(message.contains("flow.delaunay = true"), "{message}");
                assert!(!message.contains("`tangential`"), "{message}");
            }
        }
        let flips = method(Scheme::VertexScaling, true);
        for message in [
            not_converged_message(flips, 9, 1.5e-9, 1e-10, 2, &[]),
            runaway_message(flips, 9, 52.0, 1.0),
        ] {
            assert!(message.contains("a flat metric exists"), "{message}");
            assert!(message.contains("float64's 16 digits"), "{message}");
            for wrong in ["delaunay", "connectivity", "no solution", "(6)", "(faces"] {
                assert!(!message.contains(wrong), "{wrong}: {message}");
            }
        }
    }

    #[test]
    fn a_flow_that_ran_out_of_steps_asks_for_more() {
        let method = Method {
            out_of_steps: Some("flow.max_newton_steps"),
            ..method(Scheme::VertexScaling, true)
        };
        let message = not_converged_message(method, 2, 1.5, 1e-10, 0, &[]);
        assert!(message.ends_with("; raise flow.max_newton_steps"));
        // More of what did not help is no advice.
        let message = not_converged_message(method, 200, 1.5, 1e-10, 0, &[]);
        assert!(
            message.contains("vertices that nearly coincide"),
            "{message}"
        );
        assert!(!message.contains("raise"), "{message}");
    }
}
