//! What Newton's method and the interior point ask of the equations of a step, whether of one
//! body ([`super::single`]) or of several that touch each other ([`super::island`]).
//!
//! Impulses are divided by one mass M, p̂ = h f/M in m/s, so that every unknown is a velocity:
//! that of the body, or a reference for all bodies of an island. Equation numbers are those of
//! `docs/native-solver.md`.

use super::tolerances::{COMPLIANCE, ROLLING_GIVE, Tolerances};
use crate::contact::Contact;
use nalgebra::{Matrix3, Vector3};

/// A contact that may carry an impulse in this step, as the solver needs it. Vectors are in the
/// world's axes where no frame is named.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    /// n.
    pub(super) normal: Vector3<f64>,
    /// (t₁, t₂, n) as columns.
    pub(super) frame: Matrix3<f64>,
    /// a, m, frame of A: the middle of the feature that touches, its point where nothing is rounded.
    pub(super) centre: Vector3<f64>,
    /// A a, m.
    pub(super) arm: Vector3<f64>,
    /// ρ, m.
    pub(super) radius: f64,
    /// G = [y]× Aᵀ, m: the torque (frame of A) of an impulse (world) at the touching point y.
    pub(super) torque_map: Matrix3<f64>,
    /// φ/h at step k, m/s.
    pub(super) approach: f64,
    /// e c_n⁻, m/s, where the contact bounces; 0 elsewhere.
    pub(super) rebound: f64,
    /// μ.
    pub(super) friction: f64,
    /// κ: how much more the contact gives across its normal than along it (N6).
    pub(super) give: f64,
    /// ρ_n and ρ_t: the inverse of the contact's own response, which scale the natural map.
    pub(super) normal_scale: f64,
    pub(super) tangential_scale: f64,
}

impl Candidate {
    /// Whether the contact bounces.
    pub(super) fn bounces(&self) -> bool {
        self.rebound != 0.0
    }

    /// u where `departing` is the velocity with which the touching points part after the impulses, of a
    /// contact that bounces: along the normal the smaller one of the gap speed and of what is left of
    /// the rebound (eq. 29). The second is whether that is the latter.
    pub(super) fn bounded(
        &self,
        u: Vector3<f64>,
        departing: &Vector3<f64>,
    ) -> (Vector3<f64>, bool) {
        let (along, left) = (self.normal.dot(&u), self.normal.dot(departing) - self.rebound);
        if left >= along { (u, false) } else { (u + self.normal * (left - along), true) }
    }

    /// Whether it gives in all directions alike.
    pub(super) fn gives_alike(&self) -> bool {
        self.give == 1.0
    }

    /// D p̂ = γ n + κ β (N6) of an impulse p̂ = γ n + β.
    #[inline]
    pub(super) fn given(&self, impulse: &Vector3<f64>) -> Vector3<f64> {
        if self.gives_alike() {
            return *impulse;
        }
        impulse * self.give + self.normal * (self.normal.dot(impulse) * (1.0 - self.give))
    }

    /// That of `contact`, `share` being M over the mass of its body A.
    pub(super) fn new(contact: &Contact, time_step: f64, share: f64) -> Self {
        let (normal, radius) = (contact.normal(), contact.features.radius);
        let tangential = share * contact.response.tangential;
        Self {
            normal,
            frame: contact.frame,
            centre: contact.features.point,
            arm: if radius > 0.0 { contact.arm + radius * normal } else { contact.arm },
            radius,
            torque_map: contact.torque_map,
            approach: contact.gap / time_step,
            rebound: contact.rebound,
            friction: contact.law.friction,
            give: match contact.is_rounded() {
                true => (ROLLING_GIVE * tangential / COMPLIANCE).max(1.0),
                false => 1.0,
            },
            normal_scale: 1.0 / (share * contact.response.normal),
            tangential_scale: 1.0 / tangential,
        }
    }
}

/// The new velocities of a body, V = (v⁺, ω⁺).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Velocity {
    /// v⁺, m/s, world.
    pub(super) linear: Vector3<f64>,
    /// ω⁺, rad/s, body.
    pub(super) spin: Vector3<f64>,
}

impl Velocity {
    pub(super) fn zero() -> Self {
        Self { linear: Vector3::zeros(), spin: Vector3::zeros() }
    }

    /// This and `length` times `step`.
    #[inline]
    pub(super) fn moved(&self, length: f64, step: &Self) -> Self {
        Self { linear: self.linear + length * step.linear, spin: self.spin + length * step.spin }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.linear.iter().chain(&self.spin).all(|number| number.is_finite())
    }
}

/// The velocities of all bodies of a part of the step.
pub(super) trait Velocities: Clone + std::fmt::Debug {
    /// Room for them.
    fn empty() -> Self;
    /// Makes this `from` and `length` times `step`.
    fn set_moved(&mut self, from: &Self, length: f64, step: &Self);
    /// Makes this the same as `from`.
    fn copy_from(&mut self, from: &Self);
    fn is_finite(&self) -> bool;
}

impl Velocities for Velocity {
    fn empty() -> Self {
        Self::zero()
    }

    #[inline]
    fn set_moved(&mut self, from: &Self, length: f64, step: &Self) {
        *self = from.moved(length, step);
    }

    fn copy_from(&mut self, from: &Self) {
        *self = *from;
    }

    fn is_finite(&self) -> bool {
        Self::is_finite(self)
    }
}

impl Velocities for Vec<Velocity> {
    fn empty() -> Self {
        Self::new()
    }

    fn set_moved(&mut self, from: &Self, length: f64, step: &Self) {
        self.clear();
        self.extend(from.iter().zip(step).map(|(from, step)| from.moved(length, step)));
    }

    fn copy_from(&mut self, from: &Self) {
        self.clear();
        self.extend_from_slice(from);
    }

    fn is_finite(&self) -> bool {
        self.iter().all(Velocity::is_finite)
    }
}

/// Makes room for `count` entries in all, whatever a list holds.
pub(super) fn reserve<T>(list: &mut Vec<T>, count: usize) {
    list.reserve(count.saturating_sub(list.len()));
}

/// Size of all residuals at a point.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Residual {
    /// Largest entry, m/s.
    pub(super) largest: f64,
    /// Sum of squares, m²/s².
    pub(super) squared: f64,
}

impl Residual {
    #[inline]
    pub(super) fn add(&mut self, part: &Vector3<f64>) {
        self.largest = self.largest.max(part.amax());
        self.squared += part.norm_squared();
    }
}

/// One contact solved for its impulse (N5): δp̂ = offset + gain · δu.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    pub(super) offset: Vector3<f64>,
    pub(super) gain: Gain,
}

/// What an impulse gains by a change of its point's motion.
#[derive(Debug, Clone, Copy)]
pub(super) enum Gain {
    /// An open contact: nothing.
    Zero,
    /// A sticking one: −k E.
    Spring(f64),
    Full(Matrix3<f64>),
}

impl Answer {
    /// p̂ = 0.
    pub(super) fn open(impulse: &Vector3<f64>) -> Self {
        Self { offset: -impulse, gain: Gain::Zero }
    }

    /// A spring of `stiffness` in all directions.
    pub(super) fn stick(offset: Vector3<f64>, stiffness: f64) -> Self {
        Self { offset, gain: Gain::Spring(stiffness) }
    }

    /// Any gain.
    pub(super) fn full(offset: Vector3<f64>, gain: Matrix3<f64>) -> Self {
        Self { offset, gain: Gain::Full(gain) }
    }
}

/// ∂u/∂V of one contact.
pub(super) trait Slope: Copy + std::fmt::Debug {
    type Velocity: Velocities;

    /// δu for a change of the velocities.
    fn point_step(&self, change: &Self::Velocity) -> Vector3<f64>;
}

/// A contact eliminated: its answer, and what its point answers to the velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elimination<S> {
    pub(super) answer: Answer,
    /// Unused where the gain is zero.
    pub(super) slope: S,
}

impl<S: Slope> Elimination<S> {
    /// δp̂ for a change of the velocities.
    #[inline]
    pub(super) fn impulse_step(&self, change: &S::Velocity) -> Vector3<f64> {
        let offset = self.answer.offset;
        match &self.answer.gain {
            Gain::Zero => offset,
            Gain::Spring(stiffness) => offset - self.point_step(change) * *stiffness,
            Gain::Full(gain) => offset + gain * self.point_step(change),
        }
    }

    /// δu for a change of the velocities.
    #[inline]
    pub(super) fn point_step(&self, change: &S::Velocity) -> Vector3<f64> {
        self.slope.point_step(change)
    }
}

/// The equations of bodies that move together in a step: what is constant during the step, and
/// the motion of the contact points as a function of the new velocities.
pub(super) trait Equations {
    /// V of all bodies.
    type Velocity: Velocities;
    type Slope: Slope<Velocity = Self::Velocity>;
    /// Memory of the linear system.
    type System: Clone + std::fmt::Debug + Default;
    /// Memory of an evaluation: [`motion_residual`](Self::motion_residual), then
    /// [`set_points`](Self::set_points) at the same velocities.
    type Scratch: Clone + std::fmt::Debug + Default;

    /// The contacts that may carry an impulse.
    fn candidates(&self) -> &[Candidate];
    /// Whether all of them give in all directions alike (N6).
    fn all_give_alike(&self) -> bool;
    /// Makes them.
    fn give_alike(&mut self);
    /// The tolerances of the step.
    fn tolerances(&self) -> &Tolerances;
    /// How many bodies there are.
    fn bodies(&self) -> usize;
    /// How much the impulses changed in the steps before, in parts of the largest.
    fn unsettled(&self) -> f64;
    /// The speed of the motion before any impulse, m/s: the scale of the step.
    fn speed(&self) -> f64;
    /// Sets the velocities to those that the impulses p̂ leave, the gyroscopic term as in free
    /// flight: the start of an iteration.
    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Self::Velocity);
    /// Of velocities, makes what is as it was at the step's start, to rounding, exactly so: spins,
    /// velocities, or their parts along a contact's normal.
    fn keep_velocity(&self, velocity: &mut Self::Velocity);
    /// Whether a body turns by more than a large angle in the step, and by more than a multiple of
    /// what it came with: the discrete equations have such solutions for slender bodies, and they
    /// make energy from nothing.
    fn turns_too_far(&self, velocity: &Self::Velocity) -> bool;
    /// The residual of the equations of motion (N1), as speeds.
    fn motion_residual(
        &self,
        velocity: &Self::Velocity,
        impulses: &[Vector3<f64>],
        scratch: &mut Self::Scratch,
    ) -> Residual;
    /// u of candidate `index` (N2), m/s, world.
    fn point(&self, index: usize, velocity: &Self::Velocity) -> Vector3<f64>;
    /// Adds to the velocities what an impulse p̂ more at candidate `index` makes of them.
    fn push(&self, index: usize, impulse: &Vector3<f64>, velocity: &mut Self::Velocity);
    /// u of every candidate (N2), m/s, world.
    fn set_points(
        &self,
        velocity: &Self::Velocity,
        scratch: &mut Self::Scratch,
        points: &mut Vec<Vector3<f64>>,
    );
    /// The direction of the velocities (N8) at a point that was evaluated, where `answer` solves each candidate for its impulse. The eliminations of all
    /// candidates are left behind. `false` where the system has no solution.
    fn direction(
        &self,
        at: Point<'_, Self>,
        answer: impl FnMut(usize, &Candidate, &Vector3<f64>) -> Option<Answer>,
        eliminations: &mut Vec<Elimination<Self::Slope>>,
        system: &mut Self::System,
        step: &mut Self::Velocity,
    ) -> bool;
}

/// A point of an iteration that was evaluated: the velocities, p̂ and u of every candidate, and
/// what the evaluation left in its memory.
pub(super) struct Point<'a, E: Equations + ?Sized> {
    pub(super) velocity: &'a E::Velocity,
    pub(super) points: &'a [Vector3<f64>],
    pub(super) scratch: &'a E::Scratch,
}
