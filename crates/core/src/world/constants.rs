//! The constants of a world that may vary: from rollout to rollout, in a fit, in a derivative.

use super::{Parameters, Plane, World};
use crate::error::{Error, in_range};
use crate::geometry::Piece;
use crate::mechanics::RigidBody;
use nalgebra::{Matrix3, Vector3};

/// A constant of a world: its name, what its numbers are, how they are read and set.
///
/// | constant | numbers | as [one number](Constant::one_number) |
/// |---|---|---|
/// | `Friction` | μ of the world | μ |
/// | `Restitution` | e of the world | e |
/// | `BodyFriction`, `BodyRestitution` | μ and e of each body that has its own | times the world's own |
/// | `FixedFriction` | μ of each fixed piece that has its own | times the world's own |
/// | `PairFriction`, `PairRestitution` | of each pair that was [given](World::pair_frictions) its own | times the world's own |
/// | `Mass` | m of every body, kg | times the world's own |
/// | `Inertia` | I of every body, kg m², body frame, matrices of 9 | times the world's own |
/// | `Size` | all lengths of every body, times its own; mass and inertia stay | the same of all |
/// | `Radius` | of every body's edges and corners, m; extents stay | the same of all |
/// | `Gravity` | g, m/s², world, three | \|g\| |
/// | `Ground` | how far the ground is moved along its normal, m | the same |
/// | `TimeStep` | h, s | h |
/// | `JointFriction`, `JointStiffness`, `JointRest`, `JointDamping`, `JointForce`, `Armature` | of each [axis](World::driven_axes) that a drive can act on | times the world's own |
/// | `JointLimits` | both of each axis that is [limited](World::limited_axes), (L, 2) | times the world's own |
/// | `MotorTarget`, `MotorStiffness`, `MotorDamping`, `MotorMost` | of each [motor](World::motors) | times the world's own |
/// | `Anchor` | of each joint in A and in B, m, (J, 2, 3) | times the world's own |
/// | `GearRatio`, `GearOffset` | of each [gear](World::gears) | times the world's own |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Constant {
    /// μ of the world. A body or piece that has a coefficient of its own keeps it.
    Friction,
    /// e of the world. A body that has a coefficient of its own keeps it.
    Restitution,
    /// μ of each body that has one of its own, in their order.
    BodyFriction,
    /// e of each body that has one of its own, in their order.
    BodyRestitution,
    /// μ of each fixed piece that has one of its own, in their order.
    FixedFriction,
    /// μ of each pair that was given one, in the order of [`World::pair_frictions`].
    PairFriction,
    /// e of each pair that was given one, in the order of [`World::pair_restitutions`].
    PairRestitution,
    /// m of every body, kg. Inertia goes with it, as that of another density.
    Mass,
    /// I of every body, kg m², body frame. With [`Constant::Mass`] it counts as given.
    Inertia,
    /// All lengths of every body, as a multiple of its own; mass, inertia and radius stay.
    Size,
    /// The radius of every body's edges and corners, m; its extents along its axes stay.
    Radius,
    /// g, m/s², world.
    Gravity,
    /// How far the ground is moved along its normal, m.
    Ground,
    /// h, s.
    TimeStep,
    /// Dry friction of each [axis](World::driven_axes) that a drive can act on, N or N m.
    JointFriction,
    /// The stiffness of the spring of each of these, N/m or N m/rad.
    JointStiffness,
    /// Where that spring is slack, m or rad.
    JointRest,
    /// The damping of each, N s/m or N m s/rad.
    JointDamping,
    /// The constant force of each, N or N m.
    JointForce,
    /// The armature of each, kg or kg m².
    Armature,
    /// The lower and the upper limit of each axis that is [limited](World::limited_axes), m or rad. The lower one of a cone
    /// stays 0.
    JointLimits,
    /// What each [motor](World::motors) holds or pulls to: m/s, rad/s, m or rad.
    MotorTarget,
    /// The stiffness of each, 0 of one that holds a speed.
    MotorStiffness,
    /// The damping of each, 0 of one that holds a speed.
    MotorDamping,
    /// The most force of each, N or N m.
    MotorMost,
    /// The anchors of each joint in the frames of A and of B, or of the world, m.
    Anchor,
    /// r of each [gear](crate::joint::Gear), in the units of its first coordinate over those of its second.
    GearRatio,
    /// q₀ of each, m or rad.
    GearOffset,
}

impl Constant {
    /// All of them.
    pub const ALL: [Self; 28] = [
        Self::Friction,
        Self::Restitution,
        Self::BodyFriction,
        Self::BodyRestitution,
        Self::FixedFriction,
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
        Self::JointLimits,
        Self::MotorTarget,
        Self::MotorStiffness,
        Self::MotorDamping,
        Self::MotorMost,
        Self::Anchor,
        Self::GearRatio,
        Self::GearOffset,
    ];

    /// The word of the command line, of files and of arrays.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Restitution => "restitution",
            Self::BodyFriction => "body_friction",
            Self::BodyRestitution => "body_restitution",
            Self::FixedFriction => "fixed_friction",
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
            Self::JointLimits => "joint_limits",
            Self::MotorTarget => "motor_target",
            Self::MotorStiffness => "motor_stiffness",
            Self::MotorDamping => "motor_damping",
            Self::MotorMost => "motor_most",
            Self::Anchor => "anchor",
            Self::GearRatio => "gear_ratio",
            Self::GearOffset => "gear_offset",
        }
    }

    /// The constant of a name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|constant| constant.name() == name)
    }

    /// Whether it is of the shapes of bodies, which not all can vary.
    #[cfg(feature = "save")]
    pub(crate) fn is_of_shapes(self) -> bool {
        matches!(self, Self::Size | Self::Radius)
    }

    /// What its one number is in: empty for a pure number.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Friction | Self::Restitution => "",
            Self::Radius | Self::Ground => "m",
            Self::Gravity => "m/s²",
            Self::TimeStep => "s",
            _ => "times the scene's",
        }
    }

    /// The shape of its numbers in `world`; empty of a single number.
    #[must_use]
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

    /// How many numbers it has in `world`.
    #[must_use]
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

    /// Its numbers in `world`: those with which [`World::with_constants`] changes nothing. Of points
    /// with several radii the largest counts.
    #[must_use]
    pub fn of(self, world: &World) -> Vec<f64> {
        let each = |of: &dyn Fn(&RigidBody) -> f64| world.bodies().iter().map(of).collect();
        match self {
            Self::Friction => vec![world.friction()],
            Self::Restitution => vec![world.restitution()],
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
            of if of.is_of_laws() => of.of_laws(world),
            of_joints => of_joints.of_joints(world),
        }
    }

    /// The one number by which it may be varied as a whole, in `world`.
    #[must_use]
    pub fn one_number(self, world: &World) -> f64 {
        match self {
            Self::Radius => world.bodies().iter().map(radius).fold(0.0, f64::max),
            Self::Gravity => world.gravity().norm(),
            Self::Friction | Self::Restitution | Self::Ground | Self::TimeStep => self.of(world)[0],
            _ => 1.0,
        }
    }

    /// Its numbers where that one is `number`. Gravity keeps its direction, and without one stays zero.
    #[must_use]
    pub fn from_one_number(self, world: &World, number: f64) -> Vec<f64> {
        let own = self.of(world);
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

/// Numbers of a constant.
pub type ConstantValue<'a> = (Constant, &'a [f64]);

impl World {
    /// This world with the constants that are `given`, of which the last word counts.
    ///
    /// # Errors
    /// Another count of numbers than the constant's; a number out of its range, as [`World::new`] and
    /// [`RigidBody::new`] have them, a size outside 0.01…100; a coefficient of the world where pairs have
    /// their own, which would not vary; a size or radius of a body that is not of one convex piece, or of
    /// points, with one radius and an extent between its corners along each of its axes; a ground that
    /// is not there.
    pub fn with_constants(&self, given: &[ConstantValue<'_>]) -> Result<Self, Error> {
        for (constant, numbers) in given {
            if numbers.len() != constant.width(self) {
                let (field, count) = (constant.name(), numbers.len());
                return Err(Error::Count { field, count, allowed: "the numbers of one world" });
            }
        }
        let of = |constant: Constant| {
            given.iter().rev().find(|(known, _)| *known == constant).map(|(_, numbers)| *numbers)
        };
        let mut parameters = self.parameters().clone();
        if let Some(friction) = of(Constant::Friction) {
            let all = self.pair_frictions().is_empty() || of(Constant::PairFriction).is_some();
            refuse_pairs("friction", all)?;
            parameters.friction = friction[0];
        }
        if let Some(step) = of(Constant::TimeStep) {
            parameters.time_step = step[0];
        }
        if let Some(gravity) = of(Constant::Gravity) {
            parameters.gravity.copy_from_slice(gravity);
        }
        if let Some(way) = of(Constant::Ground) {
            let Some(ground) = self.ground() else {
                let why = "the world has none that could be moved; leave it out";
                return Err(Error::Unsupported { what: "ground", why });
            };
            let moved = Plane::new(*ground.normal(), ground.offset() + way[0])?;
            parameters.ground = Some(moved);
        }
        self.set_bodies(of, &mut parameters)?;
        let mut world = self.with_parameters(parameters)?;
        world.set_laws(of)?;
        let of_joints = given.iter().any(|(constant, _)| constant.is_of_joints());
        let world = if of_joints { world.with_joint_constants(of)? } else { world };
        match of(Constant::Restitution) {
            Some(restitution) => {
                let pairs = of(Constant::PairRestitution);
                refuse_pairs(
                    "restitution",
                    self.pair_restitutions().is_empty() || pairs.is_some(),
                )?;
                world.with_restitution(restitution[0])
            }
            None => Ok(world),
        }
    }

    /// Shapes, masses and inertias.
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
                *body = reshaped(body, size, radius.map(|radius| radius[index]))?;
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

fn refuse_pairs(what: &'static str, are_none: bool) -> Result<(), Error> {
    let why = "pairs of the world have coefficients of their own, which would not vary with it; give \
               theirs too, as pair_friction or pair_restitution, or leave them out";
    if are_none { Ok(()) } else { Err(Error::Unsupported { what, why }) }
}

/// The largest radius of a body's points, m.
fn radius(body: &RigidBody) -> f64 {
    body.contact_points().iter().map(|point| point.radius).fold(0.0, f64::max)
}

/// Half the extents of a body along its axes, m: half the sides of a box.
#[must_use]
pub fn extents(body: &RigidBody) -> Vector3<f64> {
    let points = body.contact_points().iter();
    let reach = |point: &crate::mechanics::body::ContactPoint| {
        point.position.abs().add_scalar(point.radius)
    };
    points.fold(Vector3::zeros(), |most, point| most.sup(&reach(point)))
}

/// The corners of a `body` of other size and radius, m, body frame. With its half extents a and its
/// radius ρ₀, a coordinate c becomes
///
/// ```text
/// s c (s a − ρ) / (s a − s ρ₀)
/// ```
///
/// with the size s and the radius ρ, so that the outermost stay outermost and the extents are s a.
#[must_use]
pub fn corners(body: &RigidBody, size: f64, new_radius: f64) -> Vec<Vector3<f64>> {
    let outer = size * extents(body);
    let inner = outer.add_scalar(-size * radius(body));
    let factor = outer.add_scalar(-new_radius).component_div(&inner) * size;
    body.contact_points().iter().map(|point| point.position.component_mul(&factor)).collect()
}

/// `body` of another size and radius (m), with its mass, inertia and coefficients.
fn reshaped(body: &RigidBody, size: f64, new_radius: Option<f64>) -> Result<RigidBody, Error> {
    let (own, least) = (radius(body), extents(body).min());
    let is_one = body.pieces().len() < 2
        && body.contact_points().iter().all(|point| point.radius == own)
        && least > own;
    if !is_one {
        let why = "a body that keeps its shape: it is not of one convex piece with one radius and \
                   corners apart along each of its axes; leave size and radius out";
        return Err(Error::Unsupported { what: "size and radius", why });
    }
    in_range("size, times the body's own", size, 0.01, 100.0, "0.01 to 100")?;
    let new_radius = new_radius.unwrap_or(own);
    in_range("radius (m)", new_radius, 0.0, size * least, "0 to half the least extent")?;
    let corners = corners(body, size, new_radius);
    let (mass, inertia) = (body.mass(), *body.inertia());
    let mut new = if new_radius > 0.0 || !body.pieces().is_empty() {
        RigidBody::of_pieces(mass, inertia, vec![Piece::hull(&corners, new_radius)?])?
    } else {
        RigidBody::new(mass, inertia, &corners)?
    };
    if let Some(friction) = body.friction() {
        new = new.with_friction(friction)?;
    }
    match body.restitution() {
        Some(restitution) => new.with_restitution(restitution),
        None => Ok(new),
    }
}
