//! `tumble inspect`: the step's nonlinear program at a point, as JSON.

use super::args::InspectArgs;
use super::fields::{self, Exactly, Numbers};
use super::names::FileKind;
use super::outcome::{Failure, Outcome};
use super::output::say;
use super::physics::matrix;
use super::{input, shown};
use nalgebra::{SVector, Vector3};
use serde::{Deserialize, Serialize};
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

#[derive(Serialize)]
struct Evaluation<'a> {
    objective: f64,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    jacobian: SparseMatrix<'a>,
    hessian: SparseMatrix<'a>,
}

#[derive(Serialize)]
struct SparseMatrix<'a> {
    rows: &'a [usize],
    cols: &'a [usize],
    values: Vec<f64>,
}

pub fn run(args: &InspectArgs) -> Result<Outcome, Failure> {
    let name = shown::path(&args.file);
    let odd = |why: &dyn std::fmt::Display| Failure::Input(format!("{name}: {why}"));
    let text = read(args).map_err(|error| odd(&format!("cannot be read as a point: {error}")))?;
    let point: PointFile =
        fields::json(&text).map_err(|why| odd(&format!("not a point: {why}")))?;
    let epsilon = point.epsilon.unwrap_or(SMOOTHING);
    let refused = |failure: Failure| failure.in_file(&args.file, FileKind::Point, &[]);
    let world = point.world().map_err(refused)?;
    let mut nlp = StepNlp::new(world, epsilon).map_err(|error| refused(error.into()))?;
    point.check(&nlp).map_err(|why| odd(&why))?;
    let state = State::from_vector(&SVector::from_column_slice(&point.state));
    nlp.set_step(&state, &Wrench::zero(), point.alpha.iter().copied());

    let evaluation = evaluate(&nlp, &point);
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

impl PointFile {
    /// The tutorial's cube with the constants given.
    fn world(&self) -> Result<World, Failure> {
        let usual = scene::tutorial_parameters()?;
        let cube = &usual.bodies[0];
        let inertia = self.inertia.as_ref().map_or(*cube.inertia(), matrix);
        let gravity = match self.gravity {
            None => usual.gravity,
            Some(Gravity::Downwards(g)) => Vector3::new(0.0, 0.0, -g),
            Some(Gravity::Vector(vector)) => vector.0.into(),
        };
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

impl Evaluation<'_> {
    fn is_finite(&self) -> bool {
        let arrays =
            [&self.gradient, &self.constraints, &self.jacobian.values, &self.hessian.values];
        self.objective.is_finite()
            && arrays.iter().all(|array| array.iter().all(|value| value.is_finite()))
    }
}

fn evaluate<'a>(nlp: &'a StepNlp, point: &PointFile) -> Evaluation<'a> {
    let layout = nlp.layout();
    let mut gradient = vec![0.0; layout.variables()];
    let mut constraints = vec![0.0; layout.constraints()];
    let mut jacobian = sparse(nlp.jacobian_pattern());
    let mut hessian = sparse(nlp.hessian_pattern());
    nlp.gradient(&point.x, &mut gradient);
    nlp.constraints(&point.x, &mut constraints);
    nlp.jacobian(&point.x, &mut jacobian.values);
    nlp.hessian(&point.x, point.obj_factor, &point.multipliers, &mut hessian.values);
    Evaluation { objective: nlp.objective(&point.x), gradient, constraints, jacobian, hessian }
}

fn sparse(pattern: &SparsityPattern) -> SparseMatrix<'_> {
    SparseMatrix { rows: pattern.rows(), cols: pattern.cols(), values: vec![0.0; pattern.len()] }
}
