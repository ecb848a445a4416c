//! What Newton's method and the interior point ask of the equations of a step, whether of one
//! body ([`super::single`]) or of several that touch each other ([`super::island`]).
//!
//! Impulses are divided by one mass M, p̂ = h f/M in m/s, so that every unknown is a velocity:
//! that of the body, or a reference for all bodies of an island. Equation numbers are those of
//! `docs/native-solver.md`.

use super::coupling::Coupling;
use super::islands::IslandView;
use super::law::{Answer, Gain};
use super::settings::Settings;
use super::tolerances::Tolerances;
use crate::joint::Graph;
use crate::step::Step;
use nalgebra::Vector3;

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
pub(super) trait Velocities: Clone + PartialEq + std::fmt::Debug {
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
pub(super) struct MapResidual {
    /// Largest entry, m/s.
    pub(super) largest: f64,
    /// Sum of squares, m²/s².
    pub(super) squared: f64,
}

impl MapResidual {
    /// Adds numbers that have no axes.
    pub(super) fn add_all(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.largest = self.largest.max(number.abs());
            self.squared += number * number;
        }
    }

    #[inline]
    pub(super) fn add(&mut self, part: &Vector3<f64>) {
        self.largest = self.largest.max(part.amax());
        self.squared += part.norm_squared();
    }
}

/// ∂u/∂V of one coupling.
pub(super) trait Slope: Copy + std::fmt::Debug {
    type Velocity: Velocities;

    /// δu for a change of the velocities.
    fn point_step(&self, change: &Self::Velocity) -> Vector3<f64>;
}

/// A coupling eliminated: its answer, and what its rows answer to the velocities.
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

/// What the equations of one body and of several have alike: the couplings, and what a solver is to
/// know of the step.
#[derive(Debug, Clone)]
pub(super) struct StepSetting {
    pub(super) couplings: Vec<Coupling>,
    /// The graphs of joints' axes.
    pub(super) graphs: Vec<Graph>,
    /// Whether all of them give in all directions alike (N6).
    pub(super) all_give_alike: bool,
    pub(super) tolerances: Tolerances,
    /// How much the impulses changed in the steps before, in parts of the largest.
    pub(super) unsettled: f64,
}

impl StepSetting {
    /// No couplings yet.
    pub(super) fn new(tolerances: Tolerances) -> Self {
        Self {
            couplings: Vec::new(),
            graphs: Vec::new(),
            all_give_alike: true,
            tolerances,
            unsettled: f64::INFINITY,
        }
    }

    /// Begins a step: no couplings yet.
    pub(super) fn begin(&mut self, tolerances: Tolerances, unsettled: f64) {
        self.couplings.clear();
        self.graphs.clear();
        self.all_give_alike = true;
        self.tolerances = tolerances;
        self.unsettled = unsettled;
    }

    /// Has the step solved to `factor` times the usual residual.
    pub(super) fn loosen(&mut self, factor: f64) {
        if factor > 1.0 {
            self.tolerances = self.tolerances.loosened(factor);
        }
    }

    pub(super) fn admit(&mut self, coupling: Coupling) {
        self.all_give_alike &= coupling.rows.give_alike();
        self.couplings.push(coupling);
    }

    /// Adds what surfaces carry to the motion of the coupling that was admitted last, m/s.
    pub(super) fn carry(&mut self, carried: &Vector3<f64>) {
        if let Some(coupling) = self.couplings.last_mut() {
            coupling.offset += carried;
        }
    }

    /// Makes all couplings give in all directions alike.
    pub(super) fn give_alike(&mut self) {
        self.all_give_alike = true;
        self.couplings.iter_mut().for_each(|coupling| coupling.rows.give = 1.0);
    }
}

/// What is known of whether the rows are independent of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Determined {
    /// They are.
    Surely,
    /// It is to be seen of the solution.
    Maybe,
}

/// The equations of bodies that move together in a step: what is constant during the step, and
/// the motion of the couplings' rows as a function of the new velocities.
pub(super) trait Equations {
    /// V of all bodies.
    type Velocity: Velocities;
    type Slope: Slope<Velocity = Self::Velocity>;
    /// The linear system, factorised, and its memory.
    type System: Clone + std::fmt::Debug + Default;
    /// Memory of an evaluation: [`motion_residual`](Self::motion_residual), then
    /// [`set_points`](Self::set_points) at the same velocities.
    type Scratch: Clone + std::fmt::Debug + Default;

    /// Whether joints may tie the bodies.
    const MAY_BE_TIED: bool = false;

    fn setting(&self) -> &StepSetting;
    fn setting_mut(&mut self) -> &mut StepSetting;
    /// How their solution is sought.
    fn settings(&self) -> &'static Settings;
    /// How many bodies bring the momentum that the impulses share.
    fn bodies(&self) -> usize {
        1
    }
    /// The speed of the motion before any impulse, m/s: the scale of the step.
    fn speed(&self) -> f64;
    /// Sets the velocities to those that the impulses p̂ leave, the gyroscopic term as in free
    /// flight: the start of an iteration.
    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Self::Velocity);
    /// Sets the velocities from which the impulses of the last step are gone on from: those that they
    /// leave; where joints tie bodies those of the last step, because the reaction of a light hinge
    /// turns with it, and its old impulse leads astray.
    fn set_first_velocity(&self, impulses: &[Vector3<f64>], velocity: &mut Self::Velocity) {
        self.set_velocity_after(impulses, velocity);
    }
    /// Finds where the last two steps of its `island` lead, `previous` being the impulses p̂ of the last one.
    fn foresee(&mut self, _: &Step<'_>, _island: &IslandView<'_>, _previous: &[Vector3<f64>]) {}
    /// Sets the velocities and the impulses p̂ to that, with which an iteration may start, and tells how far it is from
    /// the last step's velocities, m/s. `None` where it is not known.
    fn set_foreseen(&self, _: &mut Self::Velocity, _: &mut Vec<Vector3<f64>>) -> Option<f64> {
        None
    }
    /// Whether all rows are independent of each other, so that there is nothing to select, or may be: `None` where they are
    /// not.
    fn determined(&self) -> Option<Determined> {
        None
    }
    /// Adds the impulses that joints had in the last step to those of the contacts.
    fn extend_previous(&self, _: &Step<'_>, _: &mut Vec<Vector3<f64>>) {}
    /// Of velocities, makes what is as it was at the step's start, to rounding, exactly so: spins,
    /// velocities, or their parts along a contact's normal.
    fn keep_velocity(&self, velocity: &mut Self::Velocity);
    /// Whether a body turns by more than a large angle in the step, and by more than a multiple of
    /// what it came with: the discrete equations have such solutions for slender bodies, and they
    /// make energy from nothing.
    fn turns_too_far(&self, velocity: &Self::Velocity) -> bool;
    /// What is made of energy where joints tie bodies, in parts of what they have, where it is a
    /// large part; 0 elsewhere. Their equations have such solutions, also without a large turn. `points` are
    /// u of every coupling there (N2).
    fn energy_made(
        &self,
        velocity: &Self::Velocity,
        impulses: &[Vector3<f64>],
        points: &[Vector3<f64>],
    ) -> f64;
    /// The residual of the equations of motion (N1), as speeds.
    fn motion_residual(
        &self,
        velocity: &Self::Velocity,
        impulses: &[Vector3<f64>],
        scratch: &mut Self::Scratch,
    ) -> MapResidual;
    /// u of every coupling (N2), m/s, world.
    fn set_points(
        &self,
        velocity: &Self::Velocity,
        scratch: &mut Self::Scratch,
        points: &mut Vec<Vector3<f64>>,
    );
    /// Linearises at a point that was evaluated, where `answer` solves each coupling for its impulse,
    /// and factorises the system of the velocities (N8). The eliminations of all couplings are left
    /// behind. `false` where an answer is missing or the system is singular.
    fn linearise(
        &self,
        at: EvaluatedPoint<'_, Self>,
        answer: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<Answer>,
        eliminations: &mut Vec<Elimination<Self::Slope>>,
        system: &mut Self::System,
    ) -> bool;
    /// The direction of the velocities (N8) with the matrix that was factorised last, the residuals
    /// of the motion evaluated last, and the offsets of `eliminations`. `false` where it is not finite.
    fn direction(
        &self,
        scratch: &Self::Scratch,
        eliminations: &[Elimination<Self::Slope>],
        system: &mut Self::System,
        step: &mut Self::Velocity,
    ) -> bool;

    #[inline]
    fn couplings(&self) -> &[Coupling] {
        &self.setting().couplings
    }

    fn graphs(&self) -> &[Graph] {
        &self.setting().graphs
    }

    fn tolerances(&self) -> &Tolerances {
        &self.setting().tolerances
    }
}

/// A point of an iteration that was evaluated: the velocities, u of every coupling, and
/// what the evaluation left in its memory.
pub(super) struct EvaluatedPoint<'a, E: Equations + ?Sized> {
    pub(super) velocity: &'a E::Velocity,
    pub(super) points: &'a [Vector3<f64>],
    pub(super) scratch: &'a E::Scratch,
}
