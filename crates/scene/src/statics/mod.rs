//! Questions of statics about a scene, and their answers.

mod report;

pub use report::{
    BodyMotion, ContactForce, FieldSlope, FrictionReport, LimitReport, MassSlope, PairSlope,
    Report, SimulatorReport, WeakPair,
};

use super::overrides::FieldOverride;
use super::scene::Scene;
use nalgebra::Vector3;
use tumble::statics::{FromRest, Limit, LoadCase, Slope, Structure, Verdict};
use tumble_model::failure::Failure;

/// Step of a derivative, relative to the number or to the reach of the world.
const STEP: f64 = 1e-5;

/// Question about a scene at rest.
#[derive(Debug, Clone, Default)]
pub struct Question {
    /// Loads whose largest factor is asked for.
    pub load: Option<Load>,
    /// True if the smallest friction is asked for.
    pub least_friction: bool,
    /// Range of all coefficients of friction; the answer is that of the worst case.
    pub friction: Option<[f64; 2]>,
    /// Derivatives of the largest factor.
    pub slopes: Vec<By>,
}

/// Loads with a factor, which act besides those of the scene.
#[derive(Debug, Clone)]
pub enum Load {
    /// Force on a body.
    Push {
        /// Name or number of the body.
        body: String,
        /// Force (N).
        force: [f64; 3],
        /// Point from the centre of mass (m, world axes).
        at: [f64; 3],
    },
    /// Mass on a body; the factor is the mass in kg.
    Mass {
        /// Name or number of the body.
        body: String,
        /// Point from the centre of mass (m, world axes).
        at: [f64; 3],
    },
    /// Tilt of gravity about a horizontal axis; the factor is the tangent of the angle.
    Tilt([f64; 3]),
    /// Acceleration of the base (m/s²).
    Base([f64; 3]),
}

/// Number by which the largest factor is differentiated.
#[derive(Debug, Clone)]
pub enum By {
    /// Field of the scene, at a value.
    Field(String, f64),
    /// Translation of a body along a direction (m).
    Move(String, [f64; 3]),
}

impl Scene {
    /// Structure of the scene at its start, and the simulator's step from rest.
    ///
    /// # Errors
    /// Those of `Structure::at_rest`.
    pub fn at_rest(&self) -> Result<(Structure, FromRest), Failure> {
        self.at_rest_from(&self.starts)
    }

    fn at_rest_from(&self, states: &[tumble::State]) -> Result<(Structure, FromRest), Failure> {
        let world = self.world_at(self.start_index);
        let loads = self.loads.iter().zip(states);
        let wrench = |(load, state): (&tumble::Load, &tumble::State)| {
            load.wrench(self.start_index, world.time_step(), &state.attitude)
        };
        let wrenches: Vec<_> = loads.map(wrench).collect();
        Structure::at_rest(&world, states, &wrenches)
            .map_err(|error| Failure::Input(error.display(self).to_string()))
    }

    /// Index of a body by its name or number.
    fn body(&self, field: &str, body: &str) -> Result<usize, Failure> {
        let named = self.bodies.iter().position(|name| name == body);
        let numbered = || body.parse().ok().filter(|index| *index < self.bodies.len());
        named.or_else(numbered).ok_or_else(|| {
            let names = self.bodies.iter().map(String::as_str);
            let hint = tumble_model::nearest::hint(body, names);
            Failure::setting(field, format!("no body has the name {body:?}{hint}"))
        })
    }
}

impl Load {
    /// Name of the flag or keyword.
    fn name(&self) -> &'static str {
        match self {
            Self::Push { .. } => "push",
            Self::Mass { .. } => "mass",
            Self::Tilt(_) => "tilt",
            Self::Base(_) => "base",
        }
    }

    /// Wrenches of the load on a structure of `scene`.
    ///
    /// # Errors
    /// An unknown body; a tilt that is not the only load.
    fn case(&self, scene: &Scene, structure: &Structure) -> Result<LoadCase, Failure> {
        let fault = |error: tumble::Error| Failure::setting(self.name(), error);
        match self {
            Self::Push { body, force, at } => {
                let body = scene.body(self.name(), body)?;
                LoadCase::push(structure, body, Vector3::from(*force), Vector3::from(*at))
                    .map_err(fault)
            }
            Self::Mass { body, at } => {
                let body = scene.body(self.name(), body)?;
                LoadCase::mass(structure, body, Vector3::from(*at)).map_err(fault)
            }
            Self::Tilt(axis) => LoadCase::tilt(structure, Vector3::from(*axis)).map_err(fault),
            Self::Base(acceleration) => Ok(LoadCase::base(structure, Vector3::from(*acceleration))),
        }
    }
}

/// Answers a `question` about `scene`. `with` makes the scene with another value of a field.
///
/// # Errors
/// Those of the scene at rest; a load, range or field that is not possible.
pub fn answer(
    scene: &Scene,
    question: &Question,
    with: &dyn Fn(FieldOverride) -> Result<Scene, Failure>,
) -> Result<Report, Failure> {
    let (structure, from_rest) = scene.at_rest()?;
    let worst = match question.friction {
        None => vec![structure],
        Some([least, most]) => structure
            .worst_friction(least, most)
            .map_err(|error| Failure::setting("friction", error))?,
    };
    let verdicts = worst.iter().map(|structure| (structure, structure.verdict()));
    let rank = |verdict: &Verdict| match verdict {
        Verdict::None(_) => 0,
        Verdict::Undecided => 1,
        Verdict::Equilibrium(_) => 2,
    };
    let found = verdicts.min_by_key(|(_, verdict)| rank(verdict));
    let Some((structure, verdict)) = found else {
        return Err(Failure::Other("a structure has no worst case".to_owned()));
    };
    let from_rest = question.friction.is_none().then_some(from_rest);
    let mut report = Report::new(scene, structure, &verdict, from_rest);
    report.friction = question.friction;
    if let Some(load) = &question.load {
        let mut limits = Vec::new();
        for structure in &worst {
            let case = load.case(scene, structure)?;
            limits.push((structure, structure.largest_factor(&case), case));
        }
        let height = |limit: &Limit| match limit {
            Limit::Never(_) => f64::NEG_INFINITY,
            Limit::Undecided => f64::MIN,
            Limit::Factor { lower, .. } => *lower,
            Limit::Unlimited(_) => f64::INFINITY,
        };
        let lowest = limits.iter().min_by(|a, b| height(&a.1).total_cmp(&height(&b.1)));
        if let Some((structure, limit, case)) = lowest {
            let mut found = LimitReport::new(scene, structure, load.name(), limit, case);
            for by in &question.slopes {
                found.slopes.push(slope(scene, load, by, with)?);
            }
            report.limit = Some(found);
        }
    }
    if question.least_friction {
        report.least_friction = Some(FrictionReport::new(&structure.smallest_friction()));
    }
    Ok(report)
}

/// Derivative of the largest factor of `load`.
fn slope(
    scene: &Scene,
    load: &Load,
    by: &By,
    with: &dyn Fn(FieldOverride) -> Result<Scene, Failure>,
) -> Result<FieldSlope, Failure> {
    let made = |scene: &Scene, states: &[tumble::State]| {
        let structure = scene.at_rest_from(states)?.0;
        let case = load.case(scene, &structure)?;
        Ok::<_, Failure>((structure, case))
    };
    let (name, found): (String, Option<Slope>) = match by {
        By::Field(field, value) => {
            let set =
                |value: f64| with(FieldOverride::labelled(field, field, &format!("{value:?}")));
            // Faults of the field itself are not those of a missing limit.
            set(*value)?;
            let at = |value: f64| {
                let scene = set(value).ok()?;
                made(&scene, &scene.starts).ok()
            };
            (field.clone(), Structure::slope(at, *value, STEP * value.abs().max(STEP)))
        }
        By::Move(name, direction) => {
            let body = scene.body("move", name)?;
            let at = |way: f64| {
                let mut states = scene.starts.clone();
                states[body].position += Vector3::from(*direction) * way;
                made(scene, &states).ok()
            };
            (format!("move {name}"), Structure::slope(at, 0.0, STEP * scene.world.reach()))
        }
    };
    Ok(FieldSlope::new(name, found))
}
