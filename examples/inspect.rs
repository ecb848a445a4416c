//! Values and derivatives of the tutorial's nonlinear program at a point, as JSON. `data/README.md`
//! describes the numbers of a point and of the result.
//!
//! `cargo run --release --features program --example inspect -- POINT.json`; `-` reads standard
//! input.

use nalgebra::{Matrix3, SVector, Vector3};
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::process::ExitCode;
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::{SMOOTHING, StepNlp};
use tumble::{Parameters, RigidBody, State, World, Wrench, tutorial_parameters};

/// Point and constants. A missing constant has the tutorial's value.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Point {
    state: Vec<f64>,
    alpha: Vec<f64>,
    x: Vec<f64>,
    obj_factor: f64,
    multipliers: Vec<f64>,
    dt: Option<f64>,
    mu: Option<f64>,
    mass: Option<f64>,
    inertia: Option<[[f64; 3]; 3]>,
    gravity: Option<[f64; 3]>,
    epsilon: Option<f64>,
}

#[derive(Serialize)]
struct Evaluation {
    objective: f64,
    gradient: Vec<f64>,
    constraints: Vec<f64>,
    jacobian: Entries,
    hessian: Entries,
}

/// Entries of a sparse matrix.
#[derive(Serialize)]
struct Entries {
    rows: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
}

impl Entries {
    fn zeros(pattern: &SparsityPattern) -> Self {
        let (rows, cols) = (pattern.rows().to_vec(), pattern.cols().to_vec());
        Self { rows, cols, values: vec![0.0; pattern.len()] }
    }
}

impl Point {
    /// Program of a step of the tutorial's cube with the constants of the point.
    fn program(&self) -> Result<StepNlp, Box<dyn Error>> {
        let usual = tutorial_parameters()?;
        let cube = &usual.bodies[0];
        // The matrix is symmetric: its rows are its columns.
        let inertia = self.inertia.map_or(*cube.inertia(), Matrix3::from);
        let mass = self.mass.unwrap_or(cube.mass());
        let world = World::new(Parameters {
            bodies: vec![RigidBody::with_box_corners(mass, inertia, Vector3::repeat(1.0))?],
            gravity: self.gravity.map_or(usual.gravity, Vector3::from),
            friction: self.mu.unwrap_or(usual.friction),
            time_step: self.dt.unwrap_or(usual.time_step),
            ..usual
        })?;
        let mut nlp = StepNlp::new(world, self.epsilon.unwrap_or(SMOOTHING))?;
        for (name, found, needed) in [
            ("state", self.state.len(), State::LEN),
            ("alpha", self.alpha.len(), nlp.layout().contacts()),
            ("x", self.x.len(), nlp.layout().variables()),
            ("multipliers", self.multipliers.len(), nlp.layout().constraints()),
        ] {
            if found != needed {
                return Err(format!("{name} has {found} numbers; {needed} are needed").into());
            }
        }
        let state = State::from_vector(&SVector::from_column_slice(&self.state));
        nlp.set_step(&state, &Wrench::zero(), self.alpha.iter().copied());
        Ok(nlp)
    }

    fn evaluation(&self) -> Result<Evaluation, Box<dyn Error>> {
        let nlp = self.program()?;
        let mut values = Evaluation {
            objective: nlp.objective(&self.x),
            gradient: vec![0.0; nlp.layout().variables()],
            constraints: vec![0.0; nlp.layout().constraints()],
            jacobian: Entries::zeros(nlp.jacobian_pattern()),
            hessian: Entries::zeros(nlp.hessian_pattern()),
        };
        nlp.gradient(&self.x, &mut values.gradient);
        nlp.constraints(&self.x, &mut values.constraints);
        nlp.jacobian(&self.x, &mut values.jacobian.values);
        let hessian = &mut values.hessian.values;
        nlp.hessian(&self.x, self.obj_factor, &self.multipliers, hessian);
        Ok(values)
    }
}

/// JSON of the values at the point in the file of the first argument.
fn evaluated() -> Result<String, Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("a file is needed, for example point.json")?;
    let text = match file.as_str() {
        "-" => std::io::read_to_string(std::io::stdin()),
        path => std::fs::read_to_string(path),
    };
    let text = text.map_err(|error| format!("{file} cannot be read: {error}"))?;
    let point: Point = serde_json::from_str(&text)
        .map_err(|error| format!("{file} is not a point of the program: {error}"))?;
    Ok(serde_json::to_string(&point.evaluation()?)?)
}

fn main() -> ExitCode {
    match evaluated() {
        Ok(json) => {
            println!("{json}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}
