//! Interface between the methods (Newton, interior point) and the equations of a step.
//!
//! The equations belong to one body ([`super::single`]) or to several in contact
//! ([`super::island`]). Impulses are divided by one mass M, p̂ = h f/M in m/s, so that every
//! unknown is a velocity. M is the mass of the body, or a reference mass of the island. Equation
//! numbers refer to `docs/native-solver.md`.

use super::coupling::Coupling;
use super::islands::IslandView;
use super::law::{Gain, LocalSolution};
use super::settings::Settings;
use super::tolerances::Tolerances;
use crate::contact::FrictionTensor;
use crate::joint::Graph;
use crate::step::Step;
use nalgebra::Vector3;

/// New velocities of a body, V = (v⁺, ω⁺).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Velocity {
    /// v⁺ (m/s, world).
    pub(super) linear: Vector3<f64>,
    /// ω⁺ (rad/s, body).
    pub(super) spin: Vector3<f64>,
}

impl Velocity {
    pub(super) fn zero() -> Self {
        Self { linear: Vector3::zeros(), spin: Vector3::zeros() }
    }

    /// This plus `length` times `step`.
    #[inline]
    pub(super) fn moved(&self, length: f64, step: &Self) -> Self {
        Self { linear: self.linear + length * step.linear, spin: self.spin + length * step.spin }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.linear.iter().chain(&self.spin).all(|number| number.is_finite())
    }
}

/// Velocities of all bodies of an island.
pub(super) trait Velocities: Clone + PartialEq + std::fmt::Debug {
    /// Empty value as memory.
    fn empty() -> Self;
    /// Sets this to `from` plus `length` times `step`.
    fn set_moved(&mut self, from: &Self, length: f64, step: &Self);
    /// Copies `from`.
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
        from.clone_into(self);
    }

    fn is_finite(&self) -> bool {
        self.iter().all(Velocity::is_finite)
    }
}

/// Reserves memory for `count` entries in total.
pub(super) fn reserve<T>(list: &mut Vec<T>, count: usize) {
    list.reserve(count.saturating_sub(list.len()));
}

/// Norms of all residuals at a point.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MapResidual {
    /// Largest entry (m/s).
    pub(super) largest: f64,
    /// Sum of squares (m²/s²).
    pub(super) squared: f64,
}

impl MapResidual {
    /// Adds scalar residuals.
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
    fn velocity_change(&self, change: &Self::Velocity) -> Vector3<f64>;
}

/// Eliminated coupling: its local solution and the derivative of its rows by the velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elimination<S> {
    pub(super) local_solution: LocalSolution,
    /// Unused for a zero gain.
    pub(super) slope: S,
}

impl<S: Slope> Elimination<S> {
    /// δp̂ for a change of the velocities, of a moment at fixed normal impulse.
    #[inline]
    pub(super) fn impulse_step(&self, change: &S::Velocity) -> Vector3<f64> {
        let offset = self.local_solution.offset;
        match &self.local_solution.gain {
            Gain::Zero => offset,
            Gain::Spring(stiffness) => offset - self.velocity_change(change) * *stiffness,
            Gain::Full(gain) => offset + gain * self.velocity_change(change),
            Gain::Moment(gain) => offset + gain.matrix() * self.velocity_change(change),
        }
    }

    /// δu for a change of the velocities.
    #[inline]
    pub(super) fn velocity_change(&self, change: &S::Velocity) -> Vector3<f64> {
        self.slope.velocity_change(change)
    }
}

/// Data shared by all kinds of equations: couplings and step parameters.
#[derive(Debug, Clone)]
pub(super) struct StepSetting {
    pub(super) couplings: Vec<Coupling>,
    /// Graphs of joint axes.
    pub(super) graphs: Vec<Graph>,
    /// True if the compliance of all couplings is isotropic (N6).
    pub(super) all_isotropic: bool,
    pub(super) tolerances: Tolerances,
    /// Change of the impulses over the last steps, relative to the largest.
    pub(super) unsettled: f64,
}

impl StepSetting {
    /// Setting without couplings.
    pub(super) fn new(tolerances: Tolerances) -> Self {
        Self {
            couplings: Vec::new(),
            graphs: Vec::new(),
            all_isotropic: true,
            tolerances,
            unsettled: f64::INFINITY,
        }
    }

    /// Begins a step without couplings.
    pub(super) fn begin(&mut self, tolerances: Tolerances, unsettled: f64) {
        self.couplings.clear();
        self.graphs.clear();
        self.all_isotropic = true;
        self.tolerances = tolerances;
        self.unsettled = unsettled;
    }

    /// Multiplies the residual tolerances by `factor`.
    pub(super) fn loosen(&mut self, factor: f64) {
        if factor > 1.0 {
            self.tolerances = self.tolerances.times(factor);
        }
    }

    /// Sets the tolerances of a preliminary solution.
    pub(super) fn make_preliminary(&mut self) {
        self.tolerances = self.tolerances.preliminary();
    }

    pub(super) fn admit(&mut self, coupling: Coupling) {
        self.all_isotropic &= coupling.rows.is_isotropic();
        self.couplings.push(coupling);
    }

    /// Sets the friction tensor of the contact added last.
    pub(super) fn set_friction_tensor(&mut self, tensor: &FrictionTensor) {
        if let Some(coupling) = self.couplings.last_mut() {
            coupling.set_friction_tensor(tensor);
        }
    }

    /// Adds a surface velocity to the motion of the coupling added last (m/s).
    pub(super) fn carry(&mut self, carried: &Vector3<f64>) {
        if let Some(coupling) = self.couplings.last_mut() {
            coupling.offset += carried;
        }
    }

    /// Makes the compliance of all couplings isotropic.
    pub(super) fn make_isotropic(&mut self) {
        self.all_isotropic = true;
        self.couplings.iter_mut().for_each(|coupling| coupling.rows.compliance_ratio = 1.0);
    }
}

/// Indices of the couplings of a contact and of its moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct MomentPlace {
    pub(super) moment: usize,
    pub(super) contact: usize,
}

/// Knowledge about the independence of the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Determined {
    /// Certainly independent.
    Surely,
    /// Possibly independent, to be decided at the solution.
    Maybe,
}

/// Equations of bodies that are solved together in a step.
///
/// They hold the constants of the step and the motion of the coupling rows as a function of the new
/// velocities.
pub(super) trait Equations {
    /// V of all bodies.
    type Velocity: Velocities;
    type Slope: Slope<Velocity = Self::Velocity>;
    /// Factorised linear system and its memory.
    type System: Clone + std::fmt::Debug + Default;
    /// Scratch of an evaluation: [`motion_residual`](Self::motion_residual), then
    /// [`set_points`](Self::set_points) at the same velocities.
    type Scratch: Clone + std::fmt::Debug + Default;

    /// True if the bodies may have joints.
    const MAY_BE_TIED: bool = false;

    fn setting(&self) -> &StepSetting;
    fn setting_mut(&mut self) -> &mut StepSetting;
    /// Solver settings for these equations.
    fn settings(&self) -> &'static Settings;
    /// Number of bodies whose momentum the impulses share.
    fn bodies(&self) -> usize {
        1
    }
    /// Speed of the motion without impulses (m/s), the scale of the step.
    fn speed(&self) -> f64;
    /// Sets the velocities that result from the impulses p̂, as the start of an iteration. The
    /// gyroscopic term is the one of free flight.
    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Self::Velocity);
    /// Sets the initial velocities for the impulses of the last step.
    ///
    /// By default they result from these impulses. With joints they are the velocities of the last
    /// step. The reaction of a light hinge turns with it, so that its old impulse would mislead.
    fn set_first_velocity(&self, impulses: &[Vector3<f64>], velocity: &mut Self::Velocity) {
        self.set_velocity_after(impulses, velocity);
    }
    /// Extrapolates the last two steps of the `island`. `previous` are the impulses p̂ of the last
    /// one.
    fn foresee(&mut self, _: &Step<'_>, _island: &IslandView<'_>, _previous: &[Vector3<f64>]) {}
    /// Sets velocities and impulses p̂ to the extrapolation of the last two steps.
    ///
    /// Returns its distance from the last velocities (m/s). `None` if there is no extrapolation.
    fn set_foreseen(&self, _: &mut Self::Velocity, _: &mut Vec<Vector3<f64>>) -> Option<f64> {
        None
    }
    /// Moments of contacts.
    fn moments(&self) -> &[MomentPlace] {
        &[]
    }
    /// Independence of the rows. `None` if they are dependent.
    fn determined(&self) -> Option<Determined> {
        None
    }
    /// Appends the last impulses of the moments to those of the contacts.
    fn extend_with_moments(&self, _: &IslandView<'_>, _: &mut Vec<Vector3<f64>>) {}
    /// Appends the last impulses of the joints to those of contacts and moments.
    fn extend_previous(&self, _: &Step<'_>, _: &mut Vec<Vector3<f64>>) {}
    /// Restores quantities that changed by rounding only to their values at the start of the step:
    /// spins, velocities, or their normal parts at contacts.
    fn keep_velocity(&self, velocity: &mut Self::Velocity);
    /// True if a body rotates by more than a large angle and by more than a multiple of its initial
    /// spin.
    ///
    /// The discrete equations have such solutions for slender bodies. They gain energy from
    /// nothing.
    fn turns_too_far(&self, velocity: &Self::Velocity) -> bool;
    /// Relative energy gain of bodies with joints, or 0 if small.
    ///
    /// The discrete equations have such solutions even without a large rotation. `points` are u of
    /// every coupling (N2).
    fn energy_made(
        &self,
        velocity: &Self::Velocity,
        impulses: &[Vector3<f64>],
        points: &[Vector3<f64>],
    ) -> f64;
    /// Residual of the equations of motion (N1), as speeds.
    fn motion_residual(
        &self,
        velocity: &Self::Velocity,
        impulses: &[Vector3<f64>],
        scratch: &mut Self::Scratch,
    ) -> MapResidual;
    /// Rounding error of the motion residual by the impulses (m/s), eq. 22a. 0 for one body, whose impulses are not
    /// larger than its momentum.
    fn rounding(&self, _: &[Vector3<f64>], _: &mut Self::Scratch) -> f64 {
        0.0
    }
    /// Power of the motion residual evaluated last along a change of the velocities, over the mass M
    /// (m²/s²). `None` if the [method of multipliers](super::newton::Newton::solve_by_multipliers) is not used.
    fn slope_along(&self, _: &Self::Scratch, _: &Self::Velocity) -> Option<f64> {
        None
    }
    /// Computes u of every coupling (N2) (m/s, world).
    fn set_points(
        &self,
        velocity: &Self::Velocity,
        scratch: &mut Self::Scratch,
        points: &mut Vec<Vector3<f64>>,
    );
    /// Linearises at an evaluated point and factorises the system of the velocities (N8).
    ///
    /// `local_solution` returns the local solution of each coupling. `eliminations` receives all eliminated
    /// couplings. Returns false if a local solution is missing or the system is singular.
    fn linearise(
        &self,
        at: EvaluatedPoint<'_, Self>,
        local_solution: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<LocalSolution>,
        eliminations: &mut Vec<Elimination<Self::Slope>>,
        system: &mut Self::System,
    ) -> bool;
    /// Computes the direction of the velocities (N8).
    ///
    /// Uses the matrix factorised last, the motion residuals evaluated last and the offsets of
    /// `eliminations`. Returns false if the direction is not finite.
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

/// Evaluated point of an iteration: velocities, u of every coupling and scratch of the evaluation.
pub(super) struct EvaluatedPoint<'a, E: Equations + ?Sized> {
    pub(super) velocity: &'a E::Velocity,
    pub(super) points: &'a [Vector3<f64>],
    pub(super) scratch: &'a E::Scratch,
}
