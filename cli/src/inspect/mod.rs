//! `tumble inspect`: evaluates the step's nonlinear program at a point, as JSON. One body uses the
//! tutorial's program, several bodies their own.

/// Evaluates either program at the x, σ and multipliers of a point file.
macro_rules! evaluation {
    ($nlp:expr, $point:expr) => {{
        let (nlp, point) = (&$nlp, $point);
        let mut values = $crate::inspect::PointEvaluation {
            objective: nlp.objective(&point.x),
            gradient: vec![0.0; nlp.layout().variables()],
            constraints: vec![0.0; nlp.layout().constraints()],
            jacobian: $crate::inspect::sparse(nlp.jacobian_pattern()),
            hessian: $crate::inspect::sparse(nlp.hessian_pattern()),
        };
        nlp.gradient(&point.x, &mut values.gradient);
        nlp.constraints(&point.x, &mut values.constraints);
        nlp.jacobian(&point.x, &mut values.jacobian.values);
        let hessian = &mut values.hessian.values;
        nlp.hessian(&point.x, point.obj_factor, &point.multipliers, hessian);
        values
    }};
}

mod several;

use super::args::InspectArgs;
use super::input;
use super::outcome::{Failure, Outcome};
use super::output::say;
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::{SMOOTHING, StepNlp};
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::body::RigidBody;
use tumble_core::mechanics::state::{State, Wrench};
use tumble_core::simulation::scene;
use tumble_core::world::{Parameters, World};
use tumble_model::fields::{self, Exactly, Numbers};
use tumble_model::fields::{Gravity, matrix};
use tumble_model::names::FileKind;
use tumble_model::shown;

/// Largest size of a point file, bytes. A point has some hundred numbers.
const LARGEST_POINT: u64 = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with state, alpha, x, obj_factor, multipliers")]
struct PointHeader {
    state: Vec<f64>,
    alpha: Vec<f64>,
    x: Vec<f64>,
    obj_factor: f64,
    multipliers: Vec<f64>,
    dt: Option<f64>,
    rotation: Option<Rotation>,
    mu: Option<f64>,
    mass: Option<f64>,
    inertia: Option<Exactly<Numbers<3>, 3>>,
    gravity: Option<Gravity>,
    epsilon: Option<f64>,
}

/// Part of a point file that decides between the programs.
#[derive(Deserialize)]
struct PointKind {
    bodies: Option<serde::de::IgnoredAny>,
}

#[derive(Serialize)]
struct PointEvaluation {
    objective: f64,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    jacobian: SparseEntries,
    hessian: SparseEntries,
}

#[derive(Serialize)]
struct SparseEntries {
    rows: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
}

pub fn run(args: &InspectArgs) -> Result<Outcome, Failure> {
    let name = shown::path(&args.file);
    let odd = |why: &dyn std::fmt::Display| Failure::Input(format!("{name}: {why}"));
    let text = read(args).map_err(|error| odd(&format!("cannot be read as a point: {error}")))?;
    let refused = |failure: Failure| failure.in_file(&args.file, FileKind::Point, &[]);
    let no_point = |why: String| odd(&format!("not a point: {why}"));
    let evaluation = match serde_json::from_str(&text) {
        Ok(PointKind { bodies: Some(_) }) => {
            fields::json::<several::SeveralPointFile>(&text).map_err(no_point)?.evaluation()
        }
        _ => fields::json::<PointHeader>(&text).map_err(no_point)?.evaluation(),
    }
    .map_err(refused)?;
    if !evaluation.is_finite() {
        return Err(odd(&"the numbers are too large: a result is not finite"));
    }
    let mut json = serde_json::to_string(&evaluation)
        .map_err(|error| Failure::Other(format!("the result cannot be written: {error}")))?;
    json.push('\n');
    say(&json)?;
    Ok(Outcome::Done)
}

fn read(args: &InspectArgs) -> std::io::Result<String> {
    if args.file.as_os_str() == "-" {
        input::bounded(std::io::stdin(), LARGEST_POINT)
    } else {
        input::text(&args.file, LARGEST_POINT)
    }
}

impl PointHeader {
    /// Values of the program at the point.
    fn evaluation(&self) -> Result<PointEvaluation, Failure> {
        let mut nlp = StepNlp::new(self.world()?, self.epsilon.unwrap_or(SMOOTHING))?;
        self.check(&nlp).map_err(Failure::Input)?;
        let state = State::from_vector(&SVector::from_column_slice(&self.state));
        nlp.set_step(&state, &Wrench::zero(), self.alpha.iter().copied());
        Ok(evaluation!(nlp, self))
    }

    /// The tutorial's cube with the constants of the file.
    fn world(&self) -> Result<World, Failure> {
        let usual = scene::tutorial_parameters()?;
        let cube = &usual.bodies[0];
        let inertia = self.inertia.as_ref().map_or(*cube.inertia(), matrix);
        let gravity = self.gravity.map_or(usual.gravity, Gravity::vector);
        Ok(World::new(Parameters {
            bodies: vec![RigidBody::with_box_corners(
                self.mass.unwrap_or(cube.mass()),
                inertia,
                Vector3::repeat(scene::CUBE_HALF_SIDE),
            )?],
            ground: usual.ground,
            gravity,
            friction: self.mu.unwrap_or(usual.friction),
            time_step: self.dt.unwrap_or(usual.time_step),
            rotation: self.rotation.unwrap_or(usual.rotation),
        })?)
    }

    fn check(&self, nlp: &StepNlp) -> Result<(), String> {
        let layout = nlp.layout();
        let arrays = [
            ("state", self.state.len(), State::LEN),
            ("alpha", self.alpha.len(), layout.contacts()),
            ("x", self.x.len(), layout.variables()),
            ("multipliers", self.multipliers.len(), layout.constraints()),
        ];
        check_lengths(&arrays)?;
        if self.state[3..7].iter().all(|&component| component == 0.0) {
            return Err("the quaternion in state is zero; a non-zero one is needed".to_owned());
        }
        Ok(())
    }
}

impl PointEvaluation {
    fn is_finite(&self) -> bool {
        let arrays =
            [&self.gradient, &self.constraints, &self.jacobian.values, &self.hessian.values];
        self.objective.is_finite()
            && arrays.iter().all(|array| array.iter().all(|value| value.is_finite()))
    }
}

/// Checks the lengths of arrays: name, actual length, required length.
fn check_lengths(arrays: &[(&str, usize, usize)]) -> Result<(), String> {
    match arrays.iter().find(|(_, found, needed)| found != needed) {
        Some((name, found, needed)) => {
            Err(format!("{name} has {found} numbers; {needed} are needed"))
        }
        None => Ok(()),
    }
}

fn sparse(pattern: &SparsityPattern) -> SparseEntries {
    let (rows, cols) = (pattern.rows().to_vec(), pattern.cols().to_vec());
    SparseEntries { rows, cols, values: vec![0.0; pattern.len()] }
}
