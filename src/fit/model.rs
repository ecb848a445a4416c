//! What is identified: a body on a ground, and the numbers of it that may be looked for.

use super::error::FitError;
use crate::contact::Partner;
use crate::geometry::Piece;
use crate::mechanics::RigidBody;
pub use crate::world::Constant;
use crate::world::{Parameters, Plane, World, constants};
use nalgebra::{Matrix3, Vector3};

/// The constants that a fit may look for, each by its [one number](Constant::one_number), in the
/// order of [`ParameterValues`].
pub const SOUGHT: [Constant; 7] = [
    Constant::Friction,
    Constant::Restitution,
    Constant::Inertia,
    Constant::Size,
    Constant::Radius,
    Constant::Gravity,
    Constant::Ground,
];

/// The constant of a name that a fit may look for.
///
/// # Errors
/// A sentence: what there is, or why a constant is not looked for.
pub fn sought(name: &str) -> Result<Constant, String> {
    let known = Constant::of_name(name);
    if let Some(parameter) = known.filter(|parameter| place(*parameter).is_some()) {
        return Ok(parameter);
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

/// How far around a found value of `parameter` the loss is looked at: as far as it is smooth. It is
/// sharpest in the friction.
pub(super) fn usual_reach(parameter: Constant, value: f64, bounds: [f64; 2]) -> f64 {
    let share = (bounds[1] - bounds[0]) / 6.0;
    if parameter == Constant::Friction { share.min(0.1 * value.max(0.05)) } else { share }
}

/// The first step of a search for `parameter`, where nothing is known but the bounds: a sixth of
/// their distance, and no more than a fifth of the friction at the start.
pub(super) fn usual_step(parameter: Constant, start: f64, bounds: [f64; 2]) -> f64 {
    let share = (bounds[1] - bounds[0]) / 6.0;
    if parameter == Constant::Friction { share.min(0.2 * start.max(0.05)) } else { share }
}

/// A value for every constant of [`SOUGHT`], in that order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterValues(pub [f64; SOUGHT.len()]);

impl ParameterValues {
    /// The value of a parameter; NaN of one that no fit looks for.
    #[must_use]
    pub fn get(&self, parameter: Constant) -> f64 {
        place(parameter).map_or(f64::NAN, |place| self.0[place])
    }

    /// These, but for one parameter. One that no fit looks for changes nothing.
    #[must_use]
    pub fn with(mut self, parameter: Constant, value: f64) -> Self {
        if let Some(place) = place(parameter) {
            self.0[place] = value;
        }
        self
    }
}

/// Where a parameter stands among [`SOUGHT`].
pub(super) fn place(parameter: Constant) -> Option<usize> {
    SOUGHT.iter().position(|sought| *sought == parameter)
}

/// One body of points with a common radius, on a ground: what the scene says.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Its body has no coefficients and no pieces of its own.
    world: World,
    ground: Plane,
}

impl Model {
    /// The model of a world: its body, ground and constants.
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
        let world = made().map_err(|error| FitError::Scene(error.to_string()))?;
        Ok(Self { ground: ground.clone(), world })
    }

    /// Half the extents of the body along its axes, m: half the sides of a box.
    #[must_use]
    pub fn extents(&self) -> Vector3<f64> {
        constants::extents(self.body())
    }

    /// Where `parameter` is looked for, if nothing else is said.
    #[must_use]
    pub fn usual_bounds(&self, parameter: Constant) -> [f64; 2] {
        let least = self.extents().min();
        match parameter {
            Constant::Friction => [0.02, 1.0],
            Constant::Restitution => [0.0, 0.6],
            Constant::Size => [0.9, 1.1],
            Constant::Radius => [0.0, 0.3 * least],
            Constant::Gravity => [0.9, 1.1].map(|factor| factor * self.gravity().norm()),
            Constant::Ground => [-0.1, 0.1].map(|factor| factor * least),
            Constant::TimeStep => [0.5, 1.0].map(|factor| factor * self.world.time_step()),
            _ => [0.5, 2.0],
        }
    }

    fn body(&self) -> &RigidBody {
        &self.world.bodies()[0]
    }

    /// The scene's own values.
    #[must_use]
    pub fn values(&self) -> ParameterValues {
        ParameterValues(SOUGHT.map(|parameter| parameter.one_number(&self.world)))
    }

    /// g of the scene, m/s², world.
    #[must_use]
    pub fn gravity(&self) -> &Vector3<f64> {
        self.world.gravity()
    }

    /// The ground of the scene.
    #[must_use]
    pub fn ground(&self) -> &Plane {
        &self.ground
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

    /// What the numbers of `parameter` in the world with these `values` change by with its one number: they follow
    /// it on a line. Sizes of that world are counted from what they are in it.
    pub(super) fn slope(&self, parameter: Constant, values: &ParameterValues) -> Vec<f64> {
        if parameter == Constant::Size {
            return vec![1.0 / values.get(parameter)];
        }
        let [from, to] = [0.0, 1.0].map(|number| parameter.from_one_number(&self.world, number));
        from.iter().zip(to).map(|(from, to)| to - from).collect()
    }

    /// The world with these values and `time_step` (s).
    ///
    /// # Errors
    /// As [`World::with_constants`].
    pub fn world(
        &self,
        values: &ParameterValues,
        time_step: f64,
    ) -> Result<World, crate::error::Error> {
        let numbers = SOUGHT.map(|parameter| {
            (parameter, parameter.from_one_number(&self.world, values.get(parameter)))
        });
        let mut given: Vec<_> =
            numbers.iter().map(|(parameter, numbers)| (*parameter, numbers.as_slice())).collect();
        let step = [time_step];
        given.push((Constant::TimeStep, &step));
        self.world.with_constants(&given)
    }
}
