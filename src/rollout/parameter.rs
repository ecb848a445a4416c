//! The constants of a world that may differ from rollout to rollout.

use crate::error::Error;
use crate::mechanics::RigidBody;
use crate::world::World;
use nalgebra::Matrix3;

/// A constant that rollouts may have each its own of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Parameter {
    /// μ of the world, one number a rollout. What has a coefficient of its own keeps it.
    Friction,
    /// e of the world, one number a rollout. What has a coefficient of its own keeps it.
    Restitution,
    /// m of every body, kg, N numbers a rollout. Inertia goes with it, as that of another density.
    Mass,
    /// I of every body, kg m², body frame, N matrices of 9 numbers a rollout. With
    /// [`Parameter::Mass`] it counts as given.
    Inertia,
    /// g, m/s², world, three numbers a rollout.
    Gravity,
    /// h, s, one number a rollout.
    TimeStep,
}

/// A parameter and its numbers, for B rollouts.
#[derive(Debug, Clone, Copy)]
pub struct Values<'a> {
    /// Which constant.
    pub parameter: Parameter,
    /// B times as many numbers as [`Parameter::width`] says.
    pub values: &'a [f64],
}

impl Parameter {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Friction,
        Self::Restitution,
        Self::Mass,
        Self::Inertia,
        Self::Gravity,
        Self::TimeStep,
    ];

    /// What it is called in a table or an array of parameters.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Restitution => "restitution",
            Self::Mass => "mass",
            Self::Inertia => "inertia",
            Self::Gravity => "gravity",
            Self::TimeStep => "time_step",
        }
    }

    /// The shape of the numbers of one rollout of `bodies` bodies; empty of a single number.
    #[must_use]
    pub fn shape(self, bodies: usize) -> Vec<usize> {
        match self {
            Self::Friction | Self::Restitution | Self::TimeStep => vec![],
            Self::Mass => vec![bodies],
            Self::Inertia => vec![bodies, 3, 3],
            Self::Gravity => vec![3],
        }
    }

    /// Numbers of one rollout of `bodies` bodies.
    #[must_use]
    pub fn width(self, bodies: usize) -> usize {
        self.shape(bodies).iter().product()
    }
}

/// `world` with the constants that `values` has for `rollout`.
pub(super) fn varied(world: &World, values: &[Values<'_>], rollout: usize) -> Result<World, Error> {
    let bodies = world.bodies().len();
    let of = |parameter: Parameter| {
        let width = parameter.width(bodies);
        let found = values.iter().rev().find(|values| values.parameter == parameter);
        found.map(|found| &found.values[rollout * width..][..width])
    };
    let mut parameters = world.parameters().clone();
    if let Some(friction) = of(Parameter::Friction) {
        parameters.friction = friction[0];
    }
    if let Some(step) = of(Parameter::TimeStep) {
        parameters.time_step = step[0];
    }
    if let Some(gravity) = of(Parameter::Gravity) {
        parameters.gravity.copy_from_slice(gravity);
    }
    let (mass, inertia) = (of(Parameter::Mass), of(Parameter::Inertia));
    if mass.is_some() || inertia.is_some() {
        let new = |(index, body): (usize, &RigidBody)| {
            let mass = mass.map_or(body.mass(), |mass| mass[index]);
            let inertia = match inertia {
                Some(inertia) => Matrix3::from_row_slice(&inertia[9 * index..][..9]),
                None => body.inertia() * (mass / body.mass()),
            };
            body.with_mass(mass, inertia)
        };
        parameters.bodies = world.bodies().iter().enumerate().map(new).collect::<Result<_, _>>()?;
    }
    let world = world.with_parameters(parameters)?;
    match of(Parameter::Restitution) {
        Some(restitution) => world.with_restitution(restitution[0]),
        None => Ok(world),
    }
}
