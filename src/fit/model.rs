//! What is identified: a body on a ground, or bodies with all that ties and drives them; and the numbers of it that may
//! be looked for.

use super::error::FitError;
use super::parameter::{Parameter, ParameterValues};
use super::recording::Toss;
use crate::contact::Partner;
use crate::error::Error;
use crate::geometry::Piece;
use crate::joint::{Course, Knots};
use crate::mechanics::{Load, RigidBody, State};
use crate::simulation::{Motion, Simulation};
pub use crate::world::Constant;
use crate::world::{Parameters, Plane, World, constants};
use nalgebra::{Matrix3, Vector3};

/// The constants of a body on a ground that a fit may look for, each by its [one number](Constant::one_number).
pub const SOUGHT: [Constant; 7] = [
    Constant::Friction,
    Constant::Restitution,
    Constant::Inertia,
    Constant::Size,
    Constant::Radius,
    Constant::Gravity,
    Constant::Ground,
];

/// The constant of a name that a fit of a body on a ground may look for.
///
/// # Errors
/// A sentence: what there is, or why a constant is not looked for.
pub fn sought(name: &str) -> Result<Constant, String> {
    let known = Constant::of_name(name);
    if let Some(constant) = known.filter(|constant| SOUGHT.contains(constant)) {
        return Ok(constant);
    }
    let names = SOUGHT.map(Constant::name).join(", ");
    let why = match known {
        Some(Constant::Mass) => {
            "; mass and inertia count as their ratio alone, so look for inertia"
        }
        Some(Constant::TimeStep) => "; the time step is that of the recordings and --substeps",
        _ => "",
    };
    Err(format!("{name:?} is no parameter; there are {names}{why}"))
}

/// What simulations are made of: one body of points with a common radius on a ground, which tosses are of, or the bodies of
/// a whole scene, with its joints, loads and courses.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Of tosses: its body has no coefficients and no pieces of its own.
    world: World,
    /// Of tosses alone.
    ground: Option<Plane>,
    /// One a body, where they are not all of tosses.
    loads: Vec<Load>,
    /// Of joints whose frames in the world move.
    courses: Vec<(usize, Knots)>,
}

impl Model {
    /// The model of tosses in a world: its body, ground and constants.
    ///
    /// # Errors
    /// A world of several bodies, without a ground, with fixed pieces, without gravity, or whose
    /// body is a point mass, or has points of several radii.
    pub fn of_world(world: &World) -> Result<Self, FitError> {
        let refused = |why: &str| Err(FitError::Scene(format!("a fit needs {why}")));
        let [body] = world.bodies() else { return refused("a scene of one body") };
        let Some(ground) = world.ground() else {
            return refused("a ground: without one nothing lands");
        };
        if !world.fixed().is_empty() {
            return refused("a scene without fixed pieces: the ground is what tosses land on");
        }
        if *world.gravity() == Vector3::zeros() {
            return refused("gravity: without it nothing lands");
        }
        let points = body.contact_points();
        let radius = points[0].radius;
        if points.iter().any(|point| point.radius != radius) {
            return refused("a body whose points have one radius");
        }
        let made = || {
            let corners: Vec<_> = points.iter().map(|point| point.position).collect();
            let bare = if radius > 0.0 {
                let piece = Piece::hull(&corners, radius)?;
                RigidBody::of_pieces(body.mass(), *body.inertia(), vec![piece])?
            } else {
                RigidBody::new(body.mass(), *body.inertia(), &corners)?
            };
            let friction = world.friction_between(0, Partner::Ground);
            let bodies = vec![bare];
            World::new(Parameters { bodies, friction, ..world.parameters().clone() })?
                .with_restitution(world.restitution_between(0, Partner::Ground))
        };
        if constants::extents(body).min() <= 0.0 {
            return refused("a body with an extent along each of its axes");
        }
        let ground = Some(ground.clone());
        let world = made().map_err(|error| FitError::Scene(error.to_string()))?;
        Ok(Self { world, ground, loads: Vec::new(), courses: Vec::new() })
    }

    /// The model of any world, whose bodies `loads` pull, one each, and in which `courses` move frames of joints: recordings
    /// are of all its bodies.
    ///
    /// # Errors
    /// Another number of loads than bodies, or a course of a joint that is not there.
    pub fn of_bodies(
        world: World,
        loads: Vec<Load>,
        courses: Vec<(usize, Knots)>,
    ) -> Result<Self, FitError> {
        let refused = |why: String| Err(FitError::Scene(why));
        if loads.len() != world.bodies().len() {
            let (loads, bodies) = (loads.len(), world.bodies().len());
            return refused(format!(
                "there are {loads} loads and {bodies} bodies; one a body is needed"
            ));
        }
        let joints = world.joints().len();
        if let Some((joint, _)) = courses.iter().find(|(joint, _)| *joint >= joints) {
            return refused(format!(
                "joint {joint} has a course; there are {joints}, counted from 0"
            ));
        }
        Ok(Self { world, ground: None, loads, courses })
    }

    /// Whether recordings are of one body that is thrown on a ground.
    #[must_use]
    pub fn is_of_tosses(&self) -> bool {
        self.ground.is_some()
    }

    /// How many bodies a recording has.
    #[must_use]
    pub fn bodies(&self) -> usize {
        self.world.bodies().len()
    }

    /// The parameter of a constant, or of one of its numbers.
    ///
    /// # Errors
    /// A sentence: a constant that a fit cannot look for, or one that the world has none of.
    pub fn parameter(
        &self,
        constant: Constant,
        number: Option<usize>,
    ) -> Result<Parameter, String> {
        let (name, count) = (constant.name(), constant.width(&self.world));
        if self.is_of_tosses() {
            sought(name)?;
        }
        if constant == Constant::TimeStep {
            return Err(format!("{name}: the time step is that of the recordings and --substeps"));
        }
        let is_of_shape = matches!(constant, Constant::Size | Constant::Radius);
        if is_of_shape && !self.is_of_tosses() {
            return Err(format!("{name}: shapes stay, but of one body that is thrown on a ground"));
        }
        match number {
            _ if count == 0 => Err(format!("{name}: the scene has none that could vary")),
            Some(number) if number >= count => {
                Err(format!("{name}[{number}]: there are {count}, counted from 0"))
            }
            _ => Ok(Parameter { constant, number }),
        }
    }

    /// Half the extents of the body along its axes, m: half the sides of a box. Of several bodies the first one's.
    #[must_use]
    pub fn extents(&self) -> Vector3<f64> {
        constants::extents(self.body())
    }

    /// The length that distances are told in, m: the longest side of a body.
    #[must_use]
    pub fn length(&self) -> f64 {
        let side = |body: &RigidBody| 2.0 * constants::extents(body).max();
        let longest = self.world.bodies().iter().map(side).fold(0.0, f64::max);
        if longest > 0.0 { longest } else { self.world.reach() }
    }

    /// Where `parameter` is looked for, if nothing else is said.
    ///
    /// # Errors
    /// A single number, or a constant of the shape of which nobody could guess it: bounds have to be given.
    pub fn usual_bounds(&self, parameter: impl Into<Parameter>) -> Result<[f64; 2], FitError> {
        let parameter = parameter.into();
        let own = parameter.of(&self.world);
        let is_offset = matches!(
            parameter.constant,
            Constant::JointRest
                | Constant::JointForce
                | Constant::JointLimits
                | Constant::MotorTarget
                | Constant::Anchor
                | Constant::GearRatio
                | Constant::GearOffset
                | Constant::Inertia
        );
        let least = self.extents().min();
        match (parameter.constant, parameter.number) {
            (Constant::Friction, None) => Ok([0.02, 1.0]),
            (Constant::Restitution, None) => Ok([0.0, 0.6]),
            (Constant::Size, _) => Ok([0.9, 1.1]),
            (Constant::Radius, _) if least > 0.0 => Ok([0.0, 0.3 * least]),
            (Constant::Gravity, None) => Ok([0.9, 1.1].map(|factor| factor * own)),
            (Constant::Ground, None) if least > 0.0 => Ok([-0.1, 0.1].map(|factor| factor * least)),
            (_, None) => Ok([0.5, 2.0]),
            (_, Some(_)) if own > 0.0 && !is_offset => Ok([own / 3.0, 3.0 * own]),
            _ => {
                let why = "where it lies has to be said: give its bounds";
                Err(FitError::Request(format!("{} is {own}; {why}", parameter.name())))
            }
        }
    }

    fn body(&self) -> &RigidBody {
        &self.world.bodies()[0]
    }

    /// The scene's own values: of tosses all of [`SOUGHT`], else none.
    #[must_use]
    pub fn values(&self) -> ParameterValues {
        let all = SOUGHT.iter().filter(|_| self.is_of_tosses());
        all.fold(ParameterValues::default(), |values, constant| {
            values.with(*constant, self.own(*constant))
        })
    }

    /// The scene's own value of a parameter.
    #[must_use]
    pub fn own(&self, parameter: impl Into<Parameter>) -> f64 {
        parameter.into().of(&self.world)
    }

    /// g of the scene, m/s², world.
    #[must_use]
    pub fn gravity(&self) -> &Vector3<f64> {
        self.world.gravity()
    }

    /// The ground that tosses land on.
    #[must_use]
    pub fn ground(&self) -> Option<&Plane> {
        self.ground.as_ref()
    }

    /// Centres of the corners with these values, m, body frame.
    #[must_use]
    pub fn corners(&self, values: &ParameterValues) -> Vec<Vector3<f64>> {
        let (size, radius) = (values.get(Constant::Size), values.get(Constant::Radius));
        constants::corners(self.body(), size, radius)
    }

    /// The inertia with these values, kg m².
    #[must_use]
    pub fn inertia(&self, values: &ParameterValues) -> Matrix3<f64> {
        self.body().inertia() * values.get(Constant::Inertia)
    }

    /// m, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.body().mass()
    }

    /// What the numbers of constants in the world with these `values` change by with `parameter`: they follow it on a line.
    /// Sizes of that world are counted from what they are in it; by a mass with its inertia goes what is not the inertia's own
    /// word.
    pub(super) fn slope(
        &self,
        parameter: Parameter,
        values: &ParameterValues,
    ) -> Vec<(Constant, Vec<f64>)> {
        let Parameter { constant, number } = parameter;
        let mut way = match number {
            None => {
                let [from, to] = [0.0, 1.0].map(|one| constant.from_one_number(&self.world, one));
                from.iter().zip(to).map(|(from, to)| to - from).collect()
            }
            Some(number) => {
                let mut way = vec![0.0; constant.width(&self.world)];
                way[number] = 1.0;
                way
            }
        };
        if constant == Constant::Size {
            way.iter_mut().for_each(|number| *number /= values.get(parameter));
        }
        let holds_inertia = constant == Constant::Mass
            && values.all().iter().any(|(given, _)| given.constant == Constant::Inertia);
        let mut all = vec![(constant, way)];
        if holds_inertia {
            let numbers = values.numbers(&self.world);
            let of = |wanted: Constant| {
                let given = numbers.iter().find(|(constant, _)| *constant == wanted);
                given.map_or_else(|| wanted.of(&self.world), |(_, numbers)| numbers.clone())
            };
            let (masses, inertias) = (of(Constant::Mass), of(Constant::Inertia));
            let carried = inertias.iter().enumerate().map(|(place, inertia)| {
                let body = place / 9;
                -inertia / masses[body] * all[0].1[body]
            });
            let carried = carried.collect();
            all.push((Constant::Inertia, carried));
        }
        all
    }

    /// The world with these values and `time_step` (s).
    ///
    /// # Errors
    /// As [`World::with_constants`].
    pub fn world(&self, values: &ParameterValues, time_step: f64) -> Result<World, Error> {
        let mut numbers = values.numbers(&self.world);
        numbers.push((Constant::TimeStep, vec![time_step]));
        let given: Vec<_> =
            numbers.iter().map(|(constant, numbers)| (*constant, &numbers[..])).collect();
        self.world.with_constants(&given)
    }

    /// A simulation of `world`, one of this model, from `starts`, one a body; where joints do not fit these are brought together first
    /// ([`World::assemble`]).
    ///
    /// # Errors
    /// What no simulation begins from.
    pub fn begun(world: &World, starts: &[State]) -> Result<Simulation<'static>, Error> {
        let from = |starts: &[State]| {
            Simulation::new(world.clone(), starts.iter().copied(), Motion::native(world))
        };
        match from(starts) {
            Err(Error::JointApart { .. } | Error::JointBeyond { .. } | Error::GearApart { .. }) => {
                from(&world.assemble(starts)?.0)
            }
            begun => begun,
        }
    }

    /// A simulation with these values and `time_step` (s) from `starts`, at the time `begin` (s) to the nearest step
    /// ([`Model::begun`]).
    pub(super) fn simulation(
        &self,
        values: &ParameterValues,
        (begin, time_step): (f64, f64),
        starts: &[State],
    ) -> Result<Simulation<'static>, Error> {
        let mut world = self.world(values, time_step)?;
        if self.is_of_tosses() {
            return Self::begun(&world, starts);
        }
        let index = (begin / time_step).round() as u64;
        world.follow(&self.courses, index as f64 * time_step);
        let mut simulation = Self::begun(&world, starts)?;
        simulation.set_index(index)?;
        for (body, load) in self.loads.iter().enumerate() {
            simulation.set_load(body, load.clone())?;
        }
        for (joint, knots) in &self.courses {
            simulation.set_course(*joint, Course::Through(knots.clone()))?;
        }
        Ok(simulation)
    }

    /// Refuses a recording of another number of bodies.
    pub(super) fn check(&self, toss: &Toss) -> Result<(), FitError> {
        let (recorded, bodies) = (toss.bodies, self.bodies());
        if recorded == bodies && toss.frames.len().is_multiple_of(bodies) {
            return Ok(());
        }
        let why = format!("is of {recorded} bodies, and the scene has {bodies}");
        Err(FitError::Toss { toss: toss.name.clone(), why })
    }
}
