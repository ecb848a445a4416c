//! Constants of a world that can vary between rollouts, in a fit or in a derivative.

use super::reshape::{Form, radius};
use super::{Coefficient, Parameters, Plane, World};
use crate::error::Error;
use crate::mechanics::RigidBody;
use nalgebra::Matrix3;

pub use super::reshape::extents;

/// A constant of a world, with its name, its numbers, and how to read and set them.
///
/// | constant | numbers | as [one number](Constant::one_number) |
/// |---|---|---|
/// | `Friction` | μ of the world | μ |
/// | `Restitution` | e of the world | e |
/// | `Coefficient` | all [coefficients](World::with_coefficient) of a law: of the world, of fixed pieces, of bodies, of pairs | factor on the world's |
/// | `FrictionFactor` | factor along each [friction axis](World::friction_axes) | factor on the world's |
/// | `BodyFriction`, `BodyRestitution` | μ and e of each body with its own coefficient | factor on the world's |
/// | `FixedFriction`, `FixedRestitution` | μ and e of each fixed piece with its own coefficient | factor on the world's |
/// | `PairFriction`, `PairRestitution` | μ and e of each pair with its own coefficient | factor on the world's |
/// | `Mass` | mass of every body (kg) | factor on the world's |
/// | `Inertia` | inertia of every body (kg m²), body frame, 3 × 3 matrices | factor on the world's |
/// | `Size` | scale factor of the extents of every body; mass and inertia stay | the same factor for all |
/// | `Radius` | radius of every body's edges and corners (m); extents stay | the same radius for all |
/// | `Gravity` | g (m/s²), world frame, three components | \|g\| |
/// | `Ground` | displacement of the ground along its normal (m) | the same |
/// | `TimeStep` | h (s) | h |
/// | `JointFriction`, `JointStiffness`, `JointRest`, `JointDamping`, `JointForce`, `Armature`, `JointRestitution` | one per [driven axis](World::driven_axes) | factor on the world's |
/// | `JointLimits` | lower and upper limit of each [limited axis](World::limited_axes), (L, 2) | factor on the world's |
/// | `MotorTarget`, `MotorStiffness`, `MotorDamping`, `MotorMaxForce` | one per [motor](World::motors) | factor on the world's |
/// | `Anchor` | anchors of each joint in A and in B (m), (J, 2, 3) | factor on the world's |
/// | `GearRatio`, `GearOffset` | one per [gear](World::gears) | factor on the world's |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Constant {
    /// μ of the world. Bodies and pieces with their own coefficient keep it.
    Friction,
    /// e of the world. Bodies with their own coefficient keep it.
    Restitution,
    /// All [coefficients](World::with_coefficient) of a law: of world, fixed pieces, bodies, pairs.
    Coefficient(Coefficient),
    /// Factor of friction along each of the [friction axes](World::friction_axes).
    FrictionFactor,
    /// μ of each body with its own coefficient, in order of the bodies.
    BodyFriction,
    /// e of each body with its own coefficient, in order of the bodies.
    BodyRestitution,
    /// μ of each fixed piece with its own coefficient, in order of the pieces.
    FixedFriction,
    /// e of each fixed piece with its own coefficient, in order of the pieces.
    FixedRestitution,
    /// μ of each pair with its own coefficient, in order of the pairs.
    PairFriction,
    /// e of each pair with its own coefficient, in order of the pairs.
    PairRestitution,
    /// Mass of every body (kg). The inertia scales with it, as with a change of density.
    Mass,
    /// Inertia of every body (kg m²), body frame. It is not scaled if [`Constant::Mass`] is also
    /// set.
    Inertia,
    /// Scale factor of the extents of every body. Mass and inertia stay, and the radius of edges
    /// and corners does too. The radius of a sphere or capsule has the same factor.
    Size,
    /// Radius of every body's edges and corners (m), or of a sphere or capsule. The extents along
    /// the body axes stay, besides those across a sphere or capsule.
    Radius,
    /// Gravity g (m/s²), world frame.
    Gravity,
    /// Displacement of the ground along its normal (m).
    Ground,
    /// Time step h (s).
    TimeStep,
    /// Dry friction of each [driven axis](World::driven_axes) (N or N m).
    JointFriction,
    /// Spring stiffness of each driven axis (N/m or N m/rad).
    JointStiffness,
    /// Rest position of the spring of each driven axis (m or rad).
    JointRest,
    /// Damping of each driven axis (N s/m or N m s/rad).
    JointDamping,
    /// Constant force of each driven axis (N or N m).
    JointForce,
    /// Armature of each driven axis (kg or kg m²).
    Armature,
    /// Restitution of the stops of each driven axis.
    JointRestitution,
    /// Lower and upper limit of each [limited axis](World::limited_axes) (m or rad). The lower
    /// limit of a cone stays 0.
    JointLimits,
    /// Target of each [motor](World::motors) (m/s, rad/s, m or rad).
    MotorTarget,
    /// Stiffness of each motor; 0 for a speed motor.
    MotorStiffness,
    /// Damping of each motor; 0 for a speed motor.
    MotorDamping,
    /// Force limit of each motor (N or N m).
    MotorMaxForce,
    /// Anchors of each joint in the frames of A and B, or in the world frame (m).
    Anchor,
    /// Ratio r of each [gear](crate::joint::Gear), in units of its first coordinate over its
    /// second.
    GearRatio,
    /// Offset q₀ of each gear (m or rad).
    GearOffset,
}

impl Constant {
    /// All constants.
    pub const ALL: [Self; 35] = [
        Self::Friction,
        Self::Restitution,
        Self::Coefficient(Coefficient::StaticFriction),
        Self::Coefficient(Coefficient::RollingFriction),
        Self::Coefficient(Coefficient::TorsionalFriction),
        Self::Coefficient(Coefficient::Adhesion),
        Self::FrictionFactor,
        Self::BodyFriction,
        Self::BodyRestitution,
        Self::FixedFriction,
        Self::FixedRestitution,
        Self::PairFriction,
        Self::PairRestitution,
        Self::Mass,
        Self::Inertia,
        Self::Size,
        Self::Radius,
        Self::Gravity,
        Self::Ground,
        Self::TimeStep,
        Self::JointFriction,
        Self::JointStiffness,
        Self::JointRest,
        Self::JointDamping,
        Self::JointForce,
        Self::Armature,
        Self::JointRestitution,
        Self::JointLimits,
        Self::MotorTarget,
        Self::MotorStiffness,
        Self::MotorDamping,
        Self::MotorMaxForce,
        Self::Anchor,
        Self::GearRatio,
        Self::GearOffset,
    ];

    /// Name on the command line, in files and in arrays.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Restitution => "restitution",
            Self::Coefficient(of) => of.name(),
            Self::FrictionFactor => "friction_factor",
            Self::BodyFriction => "body_friction",
            Self::BodyRestitution => "body_restitution",
            Self::FixedFriction => "fixed_friction",
            Self::FixedRestitution => "fixed_restitution",
            Self::PairFriction => "pair_friction",
            Self::PairRestitution => "pair_restitution",
            Self::Mass => "mass",
            Self::Inertia => "inertia",
            Self::Size => "size",
            Self::Radius => "radius",
            Self::Gravity => "gravity",
            Self::Ground => "ground",
            Self::TimeStep => "time_step",
            Self::JointFriction => "joint_friction",
            Self::JointStiffness => "joint_stiffness",
            Self::JointRest => "joint_rest",
            Self::JointDamping => "joint_damping",
            Self::JointForce => "joint_force",
            Self::Armature => "armature",
            Self::JointRestitution => "joint_restitution",
            Self::JointLimits => "joint_limits",
            Self::MotorTarget => "motor_target",
            Self::MotorStiffness => "motor_stiffness",
            Self::MotorDamping => "motor_damping",
            Self::MotorMaxForce => "motor_max_force",
            Self::Anchor => "anchor",
            Self::GearRatio => "gear_ratio",
            Self::GearOffset => "gear_offset",
        }
    }

    /// Constant with the name `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|constant| constant.name() == name)
    }

    /// True for constants of body shapes, which only some bodies support.
    #[cfg(feature = "save")]
    pub(crate) fn is_of_shapes(self) -> bool {
        matches!(self, Self::Size | Self::Radius)
    }

    /// Unit of the constant's one number; empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Friction | Self::Restitution => "",
            Self::Radius | Self::Ground => "m",
            Self::Gravity => "m/s²",
            Self::TimeStep => "s",
            _ => "times the scene's",
        }
    }

    /// Shape of the constant's array in `world`; empty for a single number.
    pub fn shape(self, world: &World) -> Vec<usize> {
        let bodies = world.bodies().len();
        match self {
            Self::Friction | Self::Restitution | Self::Ground | Self::TimeStep => vec![],
            Self::Mass | Self::Size | Self::Radius => vec![bodies],
            Self::Inertia => vec![bodies, 3, 3],
            Self::Gravity => vec![3],
            of if of.is_of_laws() => vec![of.law_width(world)],
            of_joints => of_joints.joint_shape(world),
        }
    }

    /// Number of values of the constant in `world`.
    pub fn width(self, world: &World) -> usize {
        let bodies = world.bodies().len();
        match self {
            Self::Friction | Self::Restitution | Self::Ground | Self::TimeStep => 1,
            Self::Mass | Self::Size | Self::Radius => bodies,
            Self::Inertia => 9 * bodies,
            Self::Gravity => 3,
            of if of.is_of_laws() => of.law_width(world),
            of_joints => of_joints.joint_shape(world).iter().product(),
        }
    }

    /// Values of the constant in `world`. [`World::with_constants`] with these values changes
    /// nothing. `Radius` is the largest radius of a body's points.
    pub fn values(self, world: &World) -> Vec<f64> {
        let each = |of: &dyn Fn(&RigidBody) -> f64| world.bodies().iter().map(of).collect();
        match self {
            Self::Mass => each(&RigidBody::mass),
            Self::Inertia => {
                let rows = |body: &RigidBody| body.inertia().transpose();
                world.bodies().iter().flat_map(|body| rows(body).as_slice().to_vec()).collect()
            }
            Self::Size => each(&|_| 1.0),
            Self::Radius => each(&radius),
            Self::Gravity => world.gravity().as_slice().to_vec(),
            Self::Ground => vec![0.0],
            Self::TimeStep => vec![world.time_step()],
            Self::Friction | Self::Restitution => self.law_values(world),
            law if law.is_of_laws() => law.law_values(world),
            joint => joint.joint_values(world),
        }
    }

    /// Single number that varies the constant as a whole, at its value in `world`.
    pub fn one_number(self, world: &World) -> f64 {
        match self {
            Self::Radius => world.bodies().iter().map(radius).fold(0.0, f64::max),
            Self::Gravity => world.gravity().norm(),
            Self::Friction | Self::Restitution | Self::Ground | Self::TimeStep => {
                self.values(world)[0]
            }
            _ => 1.0,
        }
    }

    /// Values of the constant for the single number `number`. Gravity keeps its direction; zero
    /// gravity stays zero.
    pub fn from_one_number(self, world: &World, number: f64) -> Vec<f64> {
        let own = self.values(world);
        match self {
            Self::Mass | Self::Inertia => own.iter().map(|value| value * number).collect(),
            of if of.is_of_joints() || of.is_of_laws() => {
                own.iter().map(|value| value * number).collect()
            }
            Self::Gravity => {
                let norm = world.gravity().norm();
                let strength = if norm > 0.0 { number / norm } else { 0.0 };
                own.iter().map(|value| value * strength).collect()
            }
            _ => vec![number; own.len()],
        }
    }
}

/// A constant with its values.
pub type ConstantValue<'a> = (Constant, &'a [f64]);

impl World {
    /// Returns this world with the constants in `given`. The last entry for a constant counts.
    ///
    /// # Errors
    /// - A wrong number of values, or a value outside the range of [`World::new`] or
    ///   [`RigidBody::new`].
    /// - A size outside 0.01…100.
    /// - A world coefficient if pairs have their own, because those would not vary.
    /// - A size or radius of a body that is not one convex piece or a set of points. A radius of a
    ///   cylinder, cone or ellipsoid.
    /// - A ground displacement in a world without a ground.
    pub fn with_constants(&self, given: &[ConstantValue<'_>]) -> Result<Self, Error> {
        for (constant, numbers) in given {
            if numbers.len() != constant.width(self) {
                let (field, count) = (constant.name(), numbers.len());
                return Err(Error::Count { field, count, allowed: "the numbers of one world" });
            }
        }
        let value = |constant: Constant| {
            given.iter().rev().find(|(known, _)| *known == constant).map(|(_, numbers)| *numbers)
        };
        // Constants of the whole world
        let mut parameters = self.parameters().clone();
        for (constant, law, pairs) in [
            (Constant::Friction, Coefficient::Friction, Constant::PairFriction),
            (Constant::Restitution, Coefficient::Restitution, Constant::PairRestitution),
        ] {
            let has_others = self.coefficients(law).has_pairs() && value(pairs).is_none();
            if value(constant).is_some() && has_others {
                let why = "some pairs have their own coefficients, which this constant does not \
                           change; add pair_friction or pair_restitution, or remove these pairs";
                return Err(Error::Unsupported { what: law.name(), why });
            }
        }
        if let Some(step) = value(Constant::TimeStep) {
            parameters.time_step = step[0];
        }
        if let Some(gravity) = value(Constant::Gravity) {
            parameters.gravity.copy_from_slice(gravity);
        }
        // The ground moves along its normal.
        if let Some(way) = value(Constant::Ground) {
            let Some(ground) = self.ground() else {
                let why = "the world has no ground; leave it out";
                return Err(Error::Unsupported { what: "ground", why });
            };
            let moved = Plane::new(*ground.normal(), ground.offset() + way[0])?;
            parameters.ground = Some(moved);
        }
        // Constants of bodies, laws and joints
        self.set_bodies(value, &mut parameters)?;
        let mut world = self.with_parameters(parameters)?;
        world.set_laws(given)?;
        let of_joints = given.iter().any(|(constant, _)| constant.is_of_joints());
        if of_joints { world.with_joint_constants(value) } else { Ok(world) }
    }

    /// Sets shapes, masses and inertias.
    fn set_bodies<'a>(
        &self,
        of: impl Fn(Constant) -> Option<&'a [f64]>,
        parameters: &mut Parameters,
    ) -> Result<(), Error> {
        let (size, radius) = (of(Constant::Size), of(Constant::Radius));
        let (mass, inertia) = (of(Constant::Mass), of(Constant::Inertia));
        for (index, body) in parameters.bodies.iter_mut().enumerate() {
            if size.is_some() || radius.is_some() {
                let size = size.map_or(1.0, |size| size[index]);
                *body = Form::from_body(body)?.reshaped(
                    body,
                    size,
                    radius.map(|radius| radius[index]),
                )?;
            }
            if mass.is_none() && inertia.is_none() {
                continue;
            }
            let mass = mass.map_or(body.mass(), |mass| mass[index]);
            let inertia = match inertia {
                Some(inertia) => Matrix3::from_row_slice(&inertia[9 * index..][..9]),
                None => body.inertia() * (mass / body.mass()),
            };
            *body = body.with_mass(mass, inertia)?;
        }
        Ok(())
    }
}
