//! `tumble inspect`: the step's nonlinear program at a point, as JSON; of one body the tutorial's, of
//! several theirs.

mod several;

use super::args::InspectArgs;
use super::fields::{self, Exactly, Numbers};
use super::names::FileKind;
use super::outcome::{Failure, Outcome};
use super::output::say;
use super::physics::matrix;
use super::{input, shown};
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
use tumble::mechanics::Rotation;
use tumble::mechanics::body::RigidBody;
use tumble::mechanics::state::{State, Wrench};
use tumble::simulation::scene;
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::{SMOOTHING, StepNlp};
use tumble::world::{Parameters, World};

/// A point has some hundred numbers; more bytes than this are something else.
const LARGEST_POINT: u64 = 1 << 20;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with state, alpha, x, obj_factor, multipliers")]
struct PointFile {
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

/// A number (downwards) or a vector.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "a number (downwards) or three are needed")]
enum Gravity {
    Downwards(f64),
    Vector(Numbers<3>),
}

/// The part of a point that says of how many bodies it is.
#[derive(Deserialize)]
struct Kind {
    bodies: Option<serde::de::IgnoredAny>,
}

#[derive(Serialize)]
struct Evaluation {
    objective: f64,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    jacobian: SparseMatrix,
    hessian: SparseMatrix,
}

#[derive(Serialize)]
struct SparseMatrix {
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
        Ok(Kind { bodies: Some(_) }) => {
            let point: several::PointFile = fields::json(&text).map_err(no_point)?;
            point.evaluation().map_err(refused)?
        }
        _ => {
            let point: PointFile = fields::json(&text).map_err(no_point)?;
            point.evaluation().map_err(refused)?
        }
    };
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

impl Gravity {
    fn vector(self) -> Vector3<f64> {
        match self {
            Self::Downwards(g) => Vector3::new(0.0, 0.0, -g),
            Self::Vector(vector) => vector.0.into(),
        }
    }
}

impl PointFile {
    /// What the program has at the point; a sentence where it is none.
    fn evaluation(&self) -> Result<Evaluation, Failure> {
        let mut nlp = StepNlp::new(self.world()?, self.epsilon.unwrap_or(SMOOTHING))?;
        self.check(&nlp).map_err(Failure::Input)?;
        let state = State::from_vector(&SVector::from_column_slice(&self.state));
        nlp.set_step(&state, &Wrench::zero(), self.alpha.iter().copied());
        let sizes = (nlp.layout().variables(), nlp.layout().constraints());
        let patterns = (nlp.jacobian_pattern(), nlp.hessian_pattern());
        Ok(evaluate(sizes, patterns, |values| {
            nlp.gradient(&self.x, &mut values.gradient);
            nlp.constraints(&self.x, &mut values.constraints);
            nlp.jacobian(&self.x, &mut values.jacobian.values);
            let hessian = &mut values.hessian.values;
            nlp.hessian(&self.x, self.obj_factor, &self.multipliers, hessian);
            values.objective = nlp.objective(&self.x);
        }))
    }

    /// The tutorial's cube with the constants given.
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
            ("state", &self.state, State::LEN),
            ("alpha", &self.alpha, layout.contacts()),
            ("x", &self.x, layout.variables()),
            ("multipliers", &self.multipliers, layout.constraints()),
        ];
        for (name, array, expected) in arrays {
            if array.len() != expected {
                return Err(format!("{name} has {} numbers, {expected} are needed", array.len()));
            }
        }
        if self.state[3..7].iter().all(|&component| component == 0.0) {
            return Err("the quaternion in state is zero; a non-zero one is needed".to_owned());
        }
        Ok(())
    }
}

impl Evaluation {
    fn is_finite(&self) -> bool {
        let arrays =
            [&self.gradient, &self.constraints, &self.jacobian.values, &self.hessian.values];
        self.objective.is_finite()
            && arrays.iter().all(|array| array.iter().all(|value| value.is_finite()))
    }
}

/// An evaluation of (variables, rows) with the patterns of Jacobian and Hessian, filled in by `fill`.
fn evaluate(
    (variables, rows): (usize, usize),
    (jacobian, hessian): (&SparsityPattern, &SparsityPattern),
    fill: impl FnOnce(&mut Evaluation),
) -> Evaluation {
    let mut values = Evaluation {
        objective: 0.0,
        gradient: vec![0.0; variables],
        constraints: vec![0.0; rows],
        jacobian: sparse(jacobian),
        hessian: sparse(hessian),
    };
    fill(&mut values);
    values
}

fn sparse(pattern: &SparsityPattern) -> SparseMatrix {
    let (rows, cols) = (pattern.rows().to_vec(), pattern.cols().to_vec());
    SparseMatrix { rows, cols, values: vec![0.0; pattern.len()] }
}
