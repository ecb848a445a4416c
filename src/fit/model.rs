//! What is identified: a body on a ground, and the numbers of it that may be looked for.

use super::error::FitError;
use crate::contact::{Partner, Plane};
use crate::geometry::Piece;
use crate::mechanics::{RigidBody, Rotation};
use crate::world::{Parameters, World};
use nalgebra::{Matrix3, Vector3};

/// A number that may be looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parameter {
    /// μ.
    Friction,
    /// e.
    Restitution,
    /// The moments of inertia, as a multiple of the scene's. Mass and inertia count as their
    /// ratio alone, so that there is no parameter of the mass.
    Inertia,
    /// All lengths of the body, as a multiple of the scene's; the inertia stays.
    Size,
    /// The radius of edges and corners, m; the extents of the body along its axes stay.
    Radius,
    /// |g|, m/s².
    Gravity,
    /// How far the ground is moved along its normal, m.
    Ground,
}

impl Parameter {
    /// All of them, in the order of [`Values`].
    pub const ALL: [Self; 7] = [
        Self::Friction,
        Self::Restitution,
        Self::Inertia,
        Self::Size,
        Self::Radius,
        Self::Gravity,
        Self::Ground,
    ];

    /// The word of the command line and of files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Restitution => "restitution",
            Self::Inertia => "inertia",
            Self::Size => "size",
            Self::Radius => "radius",
            Self::Gravity => "gravity",
            Self::Ground => "ground",
        }
    }

    /// The parameter of a name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }

    /// What the number is in: empty for a pure number.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Friction | Self::Restitution => "",
            Self::Inertia | Self::Size => "times the scene's",
            Self::Radius | Self::Ground => "m",
            Self::Gravity => "m/s²",
        }
    }

    /// Where it is looked for, if nothing else is said: `model` has the scene's own values.
    #[must_use]
    pub fn usual_bounds(self, model: &Model) -> [f64; 2] {
        let least = model.extents().min();
        match self {
            Self::Friction => [0.02, 1.0],
            Self::Restitution => [0.0, 0.6],
            Self::Inertia => [0.5, 2.0],
            Self::Size => [0.9, 1.1],
            Self::Radius => [0.0, 0.3 * least],
            Self::Gravity => [0.9, 1.1].map(|factor| factor * model.gravity.norm()),
            Self::Ground => [-0.1, 0.1].map(|factor| factor * least),
        }
    }

    /// How far around a found value the loss is looked at: as far as it is smooth. It is sharpest
    /// in the friction.
    pub(super) fn usual_reach(self, value: f64, bounds: [f64; 2]) -> f64 {
        let share = (bounds[1] - bounds[0]) / 6.0;
        if self == Self::Friction { share.min(0.1 * value.max(0.05)) } else { share }
    }

    /// The first step of a search for it, where nothing is known but the bounds: a sixth of
    /// their distance, and no more than a fifth of the friction at the start.
    pub(super) fn usual_step(self, start: f64, bounds: [f64; 2]) -> f64 {
        let share = (bounds[1] - bounds[0]) / 6.0;
        if self == Self::Friction { share.min(0.2 * start.max(0.05)) } else { share }
    }
}

/// A value for every parameter, in the order of [`Parameter::ALL`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values(pub [f64; Parameter::ALL.len()]);

impl Values {
    /// The value of a parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f64 {
        self.0[parameter as usize]
    }

    /// These, but for one parameter.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self.0[parameter as usize] = value;
        self
    }
}

/// One body of points with a common radius, on a ground: what the scene says.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    mass: f64,
    inertia: Matrix3<f64>,
    /// Centres of the points' spheres, m, body frame.
    points: Vec<Vector3<f64>>,
    radius: f64,
    friction: f64,
    restitution: f64,
    gravity: Vector3<f64>,
    rotation: Rotation,
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
        let model = Self {
            mass: body.mass(),
            inertia: *body.inertia(),
            points: points.iter().map(|point| point.position).collect(),
            radius,
            friction: world.friction_between(0, Partner::Ground),
            restitution: world.restitution_between(0, Partner::Ground),
            gravity: *world.gravity(),
            rotation: world.rotation(),
            ground: ground.clone(),
        };
        if model.extents().min() <= 0.0 {
            return refused("a body with an extent along each of its axes");
        }
        Ok(model)
    }

    /// Half the extents of the body along its axes, m: half the sides of a box.
    #[must_use]
    pub fn extents(&self) -> Vector3<f64> {
        let extent =
            self.points.iter().fold(Vector3::zeros(), |most, point| point.abs().sup(&most));
        extent.add_scalar(self.radius)
    }

    /// The scene's own values.
    #[must_use]
    pub fn values(&self) -> Values {
        Values([self.friction, self.restitution, 1.0, 1.0, self.radius, self.gravity.norm(), 0.0])
    }

    /// g of the scene, m/s², world.
    #[must_use]
    pub fn gravity(&self) -> &Vector3<f64> {
        &self.gravity
    }

    /// The ground of the scene.
    #[must_use]
    pub fn ground(&self) -> &Plane {
        &self.ground
    }

    /// Centres of the corners with these values, m, body frame. With the scene's half extents a and
    /// radius ρ₀, a coordinate c becomes
    ///
    /// ```text
    /// s c (s a − ρ) / (s a − s ρ₀)
    /// ```
    ///
    /// with the size s and the radius ρ, so that the outermost stay outermost and the extents are
    /// s a.
    #[must_use]
    pub fn corners(&self, values: &Values) -> Vec<Vector3<f64>> {
        let (size, radius) = (values.get(Parameter::Size), values.get(Parameter::Radius));
        let outer = size * self.extents();
        let inner = outer.add_scalar(-size * self.radius);
        let factor = outer.add_scalar(-radius).component_div(&inner) * size;
        self.points.iter().map(|point| point.component_mul(&factor)).collect()
    }

    /// The inertia with these values, kg m².
    #[must_use]
    pub fn inertia(&self, values: &Values) -> Matrix3<f64> {
        self.inertia * values.get(Parameter::Inertia)
    }

    /// m, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// The world with these values and `time_step` (s).
    ///
    /// # Errors
    /// As [`RigidBody::of_pieces`] and [`World::new`].
    pub fn world(&self, values: &Values, time_step: f64) -> Result<World, crate::error::Error> {
        let corners = self.corners(values);
        let radius = values.get(Parameter::Radius);
        let inertia = self.inertia(values);
        let body = if radius > 0.0 {
            RigidBody::of_pieces(self.mass, inertia, vec![Piece::hull(&corners, radius)?])?
        } else {
            RigidBody::new(self.mass, inertia, &corners)?
        };
        let ground = &self.ground;
        let offset = ground.offset() + values.get(Parameter::Ground);
        let strength = values.get(Parameter::Gravity) / self.gravity.norm();
        let world = World::new(Parameters {
            bodies: vec![body],
            ground: Some(Plane::new(*ground.normal(), offset)?),
            gravity: self.gravity * strength,
            friction: values.get(Parameter::Friction),
            time_step,
            rotation: self.rotation,
        })?;
        world.with_restitution(values.get(Parameter::Restitution))
    }
}
