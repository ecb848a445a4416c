//! Joints: constraints between two bodies, or a body and the world, satisfied at the end of every
//! step.
//!
//! A joint has an anchor and a frame in each of its bodies. Its coordinates are the position of A's
//! anchor in B's frame and the rotation of A's frame relative to B's,
//!
//! ```text
//! l(X) = F_Bᵀ (A_Bᵀ (r_A + A_A a − r_B) − b),   Q(X) = (q_B ⊗ j_B)* ⊗ q_A ⊗ j_A      (J1)
//! ```
//!
//! where F_B is the rotation of B's joint frame in B, and A_B the rotation of B in the world.
//!
//! Each of the six axes, three of l and three of the rotation, is [locked](Axis::Locked), or free
//! under a [drive](Drive): limits, dry friction, a motor, a spring, damping, a constant force.
//! Bodies keep all 13 state variables. Coordinates are not reduced, constraints are not stabilised,
//! and there is no drift. Locked axes hold at the end of every step to rounding, by impulses along
//! the directions at its start (SHAKE; Ryckaert, Ciccotti and Berendsen, J. Comput. Phys. 23,
//! 1977).
//!
//! Equation numbers J1, J2, … are those of `docs/joints.md`.

mod course;
mod drive;
mod frame;
mod friction_curve;
mod gear;
mod gimbal;
mod graph;
mod held_back;
mod kinds;
mod motion;
mod piece;
mod turn;

pub use course::{Course, JointLoad, Knots};
pub(crate) use drive::AxisStart;
pub use drive::{Axis, Drive, Motor};
pub use frame::JointFrame;
pub use friction_curve::FrictionCurve;
pub(crate) use gear::angles_near;
pub use gear::{GEAR_AT_THE_START, Gear, GearAxis};
pub use gimbal::{Hinges, Middle};
pub use graph::Graph;
pub(crate) use graph::Segment;
pub(crate) use held_back::HeldBack;
pub use motion::{Coordinates, JointForce, JointResidual};
pub(crate) use motion::{JointMotion, JointWork};
pub(crate) use piece::{AxisChange, GraphPlace, PieceChange};
pub(crate) use turn::Turn;

use crate::error::{Error, in_range};
use crate::mechanics::quaternion::product;
use crate::mechanics::{Pose, RigidBody, State};
use nalgebra::{Vector3, Vector4};
use std::borrow::Cow;

/// One axis of a joint; 0, 1 or 2 for x, y or z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum JointAxis {
    /// Axis of the anchor's position.
    Linear(usize),
    /// Axis of the rotation.
    Angular(usize),
}

/// Joint between body A and body B, or between A and the world.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Joint {
    body: usize,
    other: Option<usize>,
    pub(crate) frames: [JointFrame; 2],
    linear: [Axis; 3],
    angular: [Axis; 3],
    /// Middle axis of a gimbal; `None` for other joints.
    middle: Option<Middle>,
    length: Option<f64>,
    collides: bool,
    /// Loads along the linear and the angular axes in a step (N and N m).
    pub(crate) push: [Vector3<f64>; 2],
    /// Time over which the drives act in a step, in lengths of the step (eq. 37).
    pub(crate) kick: f64,
    /// Velocity of A relative to B by the fall that their velocities lack (eq. 37) (m/s, world).
    pub(crate) fall: Vector3<f64>,
    /// Rates up to which the linear axes (m/s) and the angular ones (rad/s) do not bounce off their stops, and
    /// the changes of their rates by gravity in a step.
    rebound_rates: [f64; 2],
    falls: [f64; 2],
    /// True if the world frame moves.
    moves: bool,
    /// Inverse inertias of both bodies along the linear axes (1/kg) and about the angular ones
    /// (1/(kg m²)).
    inverse_inertias: [[f64; 3]; 2],
    /// True if springs and dampers may act at the middle of velocities.
    is_middle: bool,
}

/// Type of the relative rotation of a joint's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnKind {
    /// Free rotation without angular rows.
    Free,
    /// Free rotation with drives on the components of its rotation vector (J18), in A's frame.
    Driven,
    /// Rotation about z only.
    Hinge,
    /// Rotation about x of A's frame and y of B's.
    Universal,
    /// Rotation about x of A's frame, y of B's and a third axis orthogonal to both.
    Gimbal,
    /// Free rotation within a cone of the z axes, with a drive of the twist about z.
    Ball,
    /// No rotation.
    Locked,
}

impl Joint {
    /// Returns this joint with other axes: x, y, z of the anchor's position, and of the rotation.
    ///
    /// These rotations are supported: all axes locked; x and y locked, for a
    /// [hinge](Joint::revolute); z locked, for a [universal joint](Joint::universal); all free, for
    /// a [ball joint](Joint::ball) or a [gimbal](Joint::gimbal). Other drives on three free axes
    /// must have no limits. They act on the components of the rotation vector
    /// ([`TurnKind::Driven`]).
    #[must_use]
    pub fn with_axes(self, linear: [Axis; 3], angular: [Axis; 3]) -> Self {
        Self { linear, angular, ..self }
    }

    /// Returns this joint with `length` (m) instead of the default [length](Joint::length).
    #[must_use]
    pub fn with_length(self, length: f64) -> Self {
        Self { length: Some(length), ..self }
    }

    /// Returns this joint with `drive` on the free axis `axis`.
    ///
    /// # Errors
    /// If the axis is locked, or its index is above 2.
    pub fn with_drive(mut self, axis: JointAxis, drive: Drive) -> Result<Self, Error> {
        *self.drive_mut(axis)? = drive;
        Ok(self)
    }

    /// Replaces the drive of a free axis of a checked joint. A rejected drive leaves the present
    /// one.
    pub(crate) fn set_drive(&mut self, axis: JointAxis, drive: Drive) -> Result<(), Error> {
        let before = std::mem::replace(self.drive_mut(axis)?, drive);
        let checked = Axis::Free(drive).check().and_then(|()| self.check_turn());
        if checked.is_err() {
            *self.drive_mut(axis)? = before;
        }
        checked
    }

    /// Mutable drive of a free axis.
    pub(crate) fn drive_mut(&mut self, axis: JointAxis) -> Result<&mut Drive, Error> {
        let (axes, k) = match axis {
            JointAxis::Linear(k) => (&mut self.linear, k),
            JointAxis::Angular(k) => (&mut self.angular, k),
        };
        let count = Error::Count { field: "axis of a joint", count: k, allowed: "0 to 2" };
        match axes.get_mut(k).ok_or(count)? {
            Axis::Free(drive) => Ok(drive),
            Axis::Locked => Err(Error::Unsupported {
                what: "drive of a locked axis",
                why: "only free axes have a drive",
            }),
        }
    }

    /// Returns this joint with contacts between its bodies enabled.
    #[must_use]
    pub fn colliding(self) -> Self {
        Self { collides: true, ..self }
    }

    /// Body A, an index of [`World::bodies`](crate::world::World::bodies).
    pub fn body(&self) -> usize {
        self.body
    }

    /// Body B; `None` for the world.
    pub fn other(&self) -> Option<usize> {
        self.other
    }

    /// Frames in A, and in B or the world.
    pub fn frames(&self) -> &[JointFrame; 2] {
        &self.frames
    }

    /// Linear axes: x, y, z of B's frame.
    pub fn linear(&self) -> &[Axis; 3] {
        &self.linear
    }

    /// Angular axes.
    pub fn angular(&self) -> &[Axis; 3] {
        &self.angular
    }

    /// Angular axes with active limits only. The swing of a cone is never negative, so its lower
    /// limit is removed. An active stop there would lock aligned axes.
    pub(crate) fn acting_axes(&self) -> Cow<'_, [Axis; 3]> {
        let mut axes = Cow::Borrowed(&self.angular);
        if self.turning() == TurnKind::Ball
            && let Axis::Free(Drive { limits: Some([low, _]), .. }) = &mut axes.to_mut()[0]
        {
            *low = f64::NEG_INFINITY;
        }
        axes
    }

    /// Flags of the linear and the angular axes whose forces can do work.
    pub(crate) fn active_axes(&self) -> [[bool; 3]; 2] {
        let [along, about] = &self.push;
        [Axis::active(&self.linear, along), Axis::active(&self.angular, about)]
    }

    /// True if contacts between its bodies are enabled.
    pub fn collides(&self) -> bool {
        self.collides
    }

    /// Length scale ℓ (m) that converts angular rates to speeds and torques to forces. The default
    /// follows from the bodies of the joint:
    ///
    /// ```text
    /// ℓ² = Σ (1/m + ⅓ tr Gᵀ I⁻¹ G) / Σ ⅓ tr I⁻¹,                               (J2)
    /// ```
    ///
    /// with `G = [a]×` of the anchor. It combines the radius of gyration and the lever arm. In an
    /// overconstrained mechanism it determines how forces and moments share the load.
    pub fn length(&self, bodies: &[RigidBody]) -> f64 {
        if let Some(length) = self.length {
            return length;
        }
        let (mut linear, mut angular) = (0.0, 0.0);
        let sides = [Some(self.body), self.other].into_iter().zip(&self.frames);
        for (body, frame) in sides.filter_map(|(body, frame)| Some((bodies.get(body?)?, frame))) {
            let (inverse, lever) = (body.inertia_inverse(), &frame.anchor);
            // tr Gᵀ I⁻¹ G = a² tr I⁻¹ − a·I⁻¹ a
            let trace = inverse.trace();
            let along = lever.dot(&(inverse * lever));
            linear += 1.0 / body.mass() + (lever.norm_squared() * trace - along) / 3.0;
            angular += trace / 3.0;
        }
        if angular > 0.0 { (linear / angular).sqrt() } else { 1.0 }
    }

    /// True if `load` acts on free axes only.
    pub(crate) fn takes(&self, load: &JointLoad) -> bool {
        let (bears, acts) = (self.bears(), load.acts());
        acts.iter().flatten().zip(bears.iter().flatten()).all(|(acts, bears)| !acts || *bears)
    }

    /// Copy without the parts that a simulation can change: drives, and a world frame with a
    /// prescribed motion.
    #[cfg(feature = "save")]
    pub(crate) fn lasting(&self) -> Self {
        let bare = |axis: &Axis| match axis {
            Axis::Locked => Axis::Locked,
            Axis::Free(_) => Axis::Free(Drive::NONE),
        };
        let mut frames = self.frames;
        if self.holds_in_world() {
            frames[1] = JointFrame::at(Vector3::zeros());
        }
        let (linear, angular) =
            (self.linear.each_ref().map(bare), self.angular.each_ref().map(bare));
        let push = [Vector3::zeros(); 2];
        let fall = Vector3::zeros();
        let own = Self { fall, rebound_rates: [0.0; 2], falls: [0.0; 2], ..self.clone() };
        let bare = Self { push, kick: 1.0, moves: false, ..own };
        Self { frames, linear, angular, ..bare }
    }

    /// True if the joint connects `body`.
    pub fn ties(&self, body: usize) -> bool {
        self.body == body || self.other == Some(body)
    }

    /// Copy with renumbered bodies after the removal of `removed`, which the joint does not
    /// connect.
    pub(crate) fn without(&self, removed: usize) -> Self {
        let number = |body: usize| if body > removed { body - 1 } else { body };
        Self { body: number(self.body), other: self.other.map(number), ..self.clone() }
    }

    /// Type of the relative rotation.
    pub fn turning(&self) -> TurnKind {
        match self.angular {
            [Axis::Locked, Axis::Locked, Axis::Locked] => TurnKind::Locked,
            [Axis::Locked, Axis::Locked, Axis::Free(_)] => TurnKind::Hinge,
            [Axis::Free(_), Axis::Free(_), Axis::Locked] => TurnKind::Universal,
            [Axis::Free(_), Axis::Free(_), Axis::Free(_)] if self.middle.is_some() => {
                TurnKind::Gimbal
            }
            [Axis::Free(Drive { limits: Some(_), .. }), Axis::Free(_), Axis::Free(_)] => {
                TurnKind::Ball
            }
            [Axis::Free(_), Axis::Free(_), Axis::Free(_)]
                if !self.angular.iter().all(Axis::is_idle) =>
            {
                TurnKind::Driven
            }
            _ => TurnKind::Free,
        }
    }

    /// Middle axis of a gimbal or a universal joint.
    pub fn middle(&self) -> Middle {
        self.middle.unwrap_or(Middle::STRAIGHT)
    }

    /// Sets the speed (m/s) up to which axes do not bounce off their stops, and the `fall` (m/s) in a step, for
    /// `bodies`.
    pub(crate) fn set_rebound(&mut self, speed: f64, fall: f64, bodies: &[RigidBody]) {
        let length = self.length(bodies);
        self.rebound_rates = [speed, speed / length];
        self.falls = [fall, fall / length];
    }

    /// Lets springs and dampers act at the middle of velocities, or at the end of steps
    /// (`is_middle` = false). The inertias are those of free `bodies`, without other joints.
    pub(crate) fn set_middle(&mut self, is_middle: bool, bodies: &[RigidBody]) {
        let sides = [Some(self.body), self.other].into_iter().zip(&self.frames);
        let mut inverse = [[0.0; 3]; 2];
        for (body, frame) in sides.filter_map(|(body, frame)| Some((bodies.get(body?)?, frame))) {
            let axes = frame.rotation();
            for (k, axis) in axes.column_iter().enumerate() {
                inverse[0][k] += 1.0 / body.mass();
                inverse[1][k] += axis.dot(&(body.inertia_inverse() * axis));
            }
        }
        (self.is_middle, self.inverse_inertias) = (is_middle, inverse);
    }

    /// True if the force of an axis depends on its rate before the step.
    pub(crate) fn needs_rates(&self) -> bool {
        let needs = |axis: &Axis| axis.needs_rate() || self.is_middle && axis.pulls();
        self.linear.iter().chain(&self.angular).any(needs)
    }

    /// True if any linear axis is locked or driven.
    pub(crate) fn holds_place(&self) -> bool {
        self.linear.iter().any(|axis| !axis.is_idle())
    }

    /// Flags of the linear and the angular axes that accept a drive.
    pub(crate) fn bears(&self) -> [[bool; 3]; 2] {
        let is_free = |axis: &Axis| *axis != Axis::Locked;
        let about = match self.turning() {
            TurnKind::Free => [false; 3],
            TurnKind::Ball => [false, false, true],
            _ => self.angular.each_ref().map(is_free),
        };
        [self.linear.each_ref().map(is_free), about]
    }

    /// True if it locks a body to the world in all six axes, so that the motion of its world frame
    /// can be prescribed.
    pub fn holds_in_world(&self) -> bool {
        self.other.is_none() && self.locks_all()
    }

    /// True if all six axes are locked.
    pub(crate) fn locks_all(&self) -> bool {
        self.linear.iter().chain(&self.angular).all(|axis| *axis == Axis::Locked)
    }

    /// Moves the world frame to `frame`.
    pub(crate) fn move_to(&mut self, frame: JointFrame) {
        self.frames[1] = frame;
        self.moves = true;
    }

    /// Copy with another frame in B or in the world.
    pub(crate) fn with_other_frame(self, frame: JointFrame) -> Self {
        Self { frames: [self.frames[0], frame], ..self }
    }

    /// Interpolated frame in B or in the world: `part` of the motion from its target to the present
    /// frame of A at `states`. `None` unless all linear axes are locked, and all or none of the
    /// angular ones.
    pub(crate) fn nearer_frame(&self, states: &[State], part: f64) -> Option<JointFrame> {
        let is_held = self.linear == [Axis::Locked; 3]
            && matches!(self.turning(), TurnKind::Locked | TurnKind::Free | TurnKind::Driven);
        let [own, theirs] = self.frames;
        if !is_held {
            return None;
        }
        let relative = own.placed(states.get(self.body)?);
        let relative = match self.other {
            None => relative,
            Some(other) => {
                let Pose { position, rotation } = states.get(other)?.pose();
                let [w, x, y, z]: [f64; 4] = states[other].attitude.into();
                let back = Vector4::new(w, -x, -y, -z);
                let anchor = rotation.tr_mul(&(relative.anchor - position));
                JointFrame { anchor, attitude: product(&back, &relative.attitude) }
            }
        };
        let near = if relative.attitude.dot(&theirs.attitude) < 0.0 {
            -relative.attitude
        } else {
            relative.attitude
        };
        let attitude = theirs.attitude + (near - theirs.attitude) * part;
        let anchor = theirs.anchor + (relative.anchor - theirs.anchor) * part;
        Some(JointFrame { anchor, attitude: attitude.normalize() })
    }

    /// Copy without loads and drives, whose limits stay.
    pub(crate) fn without_drives(&self) -> Self {
        let stopped = |axis: &Axis| axis.without_drive();
        let axes = [&self.linear, &self.angular].map(|axes| axes.each_ref().map(stopped));
        let [linear, angular] = axes;
        Self { linear, angular, push: [Vector3::zeros(); 2], ..self.clone() }
    }

    /// Copy without loads.
    pub(crate) fn without_push(self) -> Self {
        Self { push: [Vector3::zeros(); 2], ..self }
    }

    /// True if the world frame moves.
    pub(crate) fn moves(&self) -> bool {
        self.moves
    }

    /// Loads along the linear axes (N) and about the angular axes (N m) in a step, besides the
    /// drives.
    pub fn push(&self) -> &[Vector3<f64>; 2] {
        &self.push
    }

    /// Time over which the drives act, in lengths of the step.
    pub(crate) fn kick(&self) -> f64 {
        self.kick
    }

    /// Checks that the angular axes form a supported rotation.
    fn check_turn(&self) -> Result<(), Error> {
        let [x, y, _] = &self.angular;
        match self.turning() {
            TurnKind::Gimbal => self.middle().check(),
            _ if self.middle.is_some() => Err(Error::Unsupported {
                what: "middle axis of a joint that is not a gimbal",
                why: "only a joint with three free rotation axes has one",
            }),
            TurnKind::Locked | TurnKind::Hinge | TurnKind::Universal => Ok(()),
            TurnKind::Ball => {
                let allowed = "a ball joint has only a cone, the upper limit of its x axis, and a \
                               drive about z";
                let most = x.limits().map_or(f64::NAN, |[_, most]| most);
                in_range("cone of a ball joint (rad)", most, 0.01, 3.1, "0.01 to 3.1")?;
                if *x == Axis::cone(most) && y.is_idle() {
                    Ok(())
                } else {
                    let what = "drive about x or y of a ball joint";
                    Err(Error::Unsupported { what, why: allowed })
                }
            }
            TurnKind::Driven if self.angular.iter().all(|axis| axis.limits().is_none()) => Ok(()),
            TurnKind::Driven => Err(Error::Unsupported {
                what: "limits about an axis of a joint with free rotation",
                why: "use a ball joint, which has a cone about z as the limits of its x axis",
            }),
            TurnKind::Free if self.angular.iter().all(Axis::is_idle) => Ok(()),
            TurnKind::Free => Err(Error::Unsupported {
                what: "unsupported combination of rotation axes",
                why: "lock x and y, z alone, all axes or none",
            }),
        }
    }

    /// Checks the joint against the number of bodies of its world.
    pub(crate) fn checked(self, bodies: usize) -> Result<Self, Error> {
        let known = |body: usize| body < bodies;
        if !known(self.body) || self.other.is_some_and(|other| !known(other) || other == self.body)
        {
            let allowed = "two different bodies, or a body and the world";
            return Err(Error::Count { field: "bodies of a joint", count: self.body, allowed });
        }
        self.check_turn()?;
        for axis in self.linear.iter().chain(&self.angular) {
            axis.check()?;
        }
        if let Some(length) = self.length {
            in_range("length of a joint (m)", length, 1e-6, 1e6, "1e-6 to 1e6")?;
        }
        let frames = [self.frames[0].checked()?, self.frames[1].checked()?];
        Ok(Self { frames, ..self })
    }
}
