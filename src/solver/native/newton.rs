//! Semismooth Newton on the natural map of the contact law, after Alart and Curnier
//! (1991), with every contact eliminated to a 6 × 6 system.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::effort::Effort;
use super::elimination::{Elimination, MotionSystem};
use super::equations::{Candidate, StepEquations, Velocity};
use super::tolerances::{
    CORRECTIONS, NEWTON_ITERATIONS, SHORTEST_STEP, SUFFICIENT_DECREASE, WHOLE_STEPS,
};
use nalgebra::{Matrix3, Vector3};

/// A point of the iteration.
#[derive(Debug, Clone)]
pub(super) struct Iterate {
    pub(super) velocity: Velocity,
    /// p̂ of every candidate, m/s, world.
    pub(super) impulses: Vec<Vector3<f64>>,
    /// u of every candidate (N2), kept from the last evaluation.
    points: Vec<Vector3<f64>>,
    /// The arguments of every candidate's projections, for the law evaluated last.
    pulls: Vec<Pull>,
    /// The residual of the equations of motion, which no contact law changes.
    motion: Residual,
    /// The law evaluated last.
    law: Law,
}

/// Scratch of the iteration, sized once.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    trial: Iterate,
    modes: Vec<Mode>,
    eliminations: Vec<Elimination>,
}

/// The contact law to be solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Law {
    /// ε in û = u + ε p̂ (N6).
    pub(super) compliance: f64,
    /// Factor on ρ_t. The natural map has the same zeros for every one; a large one tells
    /// the directions of slips that are slow against the impulses.
    pub(super) sharpness: f64,
    /// A contact within this relative margin of its cone counts as sticking.
    pub(super) stick_margin: f64,
}

impl Law {
    /// No compliance.
    pub(super) const EXACT: Self = Self::with_compliance(0.0);

    pub(super) const fn with_compliance(compliance: f64) -> Self {
        Self { compliance, sharpness: 1.0, stick_margin: 0.0 }
    }
}

/// The piece of the natural map that a contact is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Open,
    Stick,
    Slip,
}

/// Size of all residuals at a point.
#[derive(Debug, Clone, Copy, Default)]
struct Residual {
    /// Largest entry, m/s.
    largest: f64,
    /// Sum of squares, m²/s².
    squared: f64,
}

impl Newton {
    pub(super) fn new(contacts: usize) -> Self {
        Self {
            trial: Iterate::new(contacts),
            modes: Vec::with_capacity(contacts),
            eliminations: Vec::with_capacity(contacts),
        }
    }

    /// Solves `law` from `iterate`, with the compliance `matrix` in the Newton matrix: that
    /// of the law, or any where the law has none. Returns whether it converged.
    pub(super) fn solve(
        &mut self,
        equations: &StepEquations,
        law: &Law,
        matrix: f64,
        iterate: &mut Iterate,
        effort: &mut Effort<'_>,
    ) -> bool {
        let mut merit = evaluate(equations, law, iterate);
        let tolerances = equations.tolerances();
        let mut whole_steps = WHOLE_STEPS;
        for _ in 0..NEWTON_ITERATIONS {
            if merit.largest <= tolerances.newton {
                return true;
            }
            if !effort.spend() {
                return false;
            }
            self.find_modes(equations, law, iterate);
            let Some(step) = self.direction(equations, matrix, iterate) else {
                return false;
            };
            if merit.largest <= tolerances.whole_steps && whole_steps > 0 {
                self.try_step(iterate, &step, 1.0);
                let trial = evaluate(equations, law, &mut self.trial);
                whole_steps -= u32::from(trial.squared >= merit.squared);
                std::mem::swap(iterate, &mut self.trial);
                merit = trial;
            } else if let Some(better) = self.search(equations, law, iterate, &step, &merit) {
                merit = better;
            } else {
                return false;
            }
        }
        merit.largest <= tolerances.newton
    }

    /// Moves a solution of `law` to the limit of vanishing compliance (N9): the law without
    /// compliance, every contact on the piece that `law` puts it on, and the compliance in
    /// the matrix alone, which leaves the undetermined part of the impulses where it is.
    /// Returns the residual of the law without compliance. The iterate must have been evaluated.
    pub(super) fn take_limit(
        &mut self,
        equations: &StepEquations,
        law: &Law,
        iterate: &mut Iterate,
        effort: &mut Effort<'_>,
    ) -> f64 {
        if iterate.law != *law {
            evaluate_again(equations, law, iterate);
        }
        self.find_modes(equations, law, iterate);
        let mut merit = evaluate_again(equations, &Law::EXACT, iterate);
        for _ in 0..CORRECTIONS {
            if merit.largest <= equations.limit() || !effort.spend() {
                break;
            }
            let Some(step) = self.direction(equations, law.compliance, iterate) else {
                break;
            };
            self.try_step(iterate, &step, 1.0);
            let corrected = evaluate(equations, &Law::EXACT, &mut self.trial);
            if corrected.largest >= merit.largest {
                break;
            }
            std::mem::swap(iterate, &mut self.trial);
            merit = corrected;
        }
        merit.largest
    }

    /// The pieces that `law`, which must be the one evaluated last, puts the contacts on.
    fn find_modes(&mut self, equations: &StepEquations, law: &Law, iterate: &Iterate) {
        let contacts = equations.candidates().iter().zip(&iterate.pulls);
        self.modes.clear();
        self.modes.extend(contacts.map(|(contact, pull)| pull.mode(contact, law.stick_margin)));
    }

    /// The Newton direction of the velocities for the law evaluated last and the modes found
    /// before; the impulses' part follows from the eliminations.
    fn direction(
        &mut self,
        equations: &StepEquations,
        matrix: f64,
        iterate: &Iterate,
    ) -> Option<Velocity> {
        let velocity = &iterate.velocity;
        let mut system = MotionSystem::new(equations, velocity, &iterate.impulses);
        let turning = equations.turning(velocity);
        self.eliminations.clear();
        let contacts = equations.candidates().iter().zip(&iterate.impulses);
        let pulls = iterate.points.iter().zip(&iterate.pulls).zip(&self.modes);
        for ((candidate, impulse), ((u, pull), mode)) in contacts.zip(pulls) {
            let elimination = match mode {
                Mode::Open => Elimination::open(impulse),
                Mode::Stick => {
                    let stiffness = 1.0 / matrix;
                    let slope = turning.point_slope(candidate, u);
                    Elimination::stick(-stiffness * pull.u, stiffness, slope)
                }
                Mode::Slip => {
                    let (offset, gain) = pull.linearise_slip(candidate, matrix);
                    Elimination::full(offset, gain, turning.point_slope(candidate, u))
                }
            };
            system.add(&candidate.torque_map, &elimination);
            self.eliminations.push(elimination);
        }
        system.solve()
    }

    /// Halves the step until the residual falls enough; moves `iterate` there.
    fn search(
        &mut self,
        equations: &StepEquations,
        law: &Law,
        iterate: &mut Iterate,
        step: &Velocity,
        merit: &Residual,
    ) -> Option<Residual> {
        let mut length = 1.0;
        while length >= SHORTEST_STEP {
            self.try_step(iterate, step, length);
            let trial = evaluate(equations, law, &mut self.trial);
            if trial.squared < (1.0 - SUFFICIENT_DECREASE * length) * merit.squared {
                std::mem::swap(iterate, &mut self.trial);
                return Some(trial);
            }
            length *= 0.5;
        }
        None
    }

    /// The trial point `length` along the direction.
    fn try_step(&mut self, iterate: &Iterate, step: &Velocity, length: f64) {
        let trial = &mut self.trial;
        trial.velocity.linear = iterate.velocity.linear + length * step.linear;
        trial.velocity.spin = iterate.velocity.spin + length * step.spin;
        trial.impulses.clear();
        let moved = iterate
            .impulses
            .iter()
            .zip(&self.eliminations)
            .map(|(impulse, contact)| impulse + length * contact.impulse_step(step));
        trial.impulses.extend(moved);
    }
}

impl Iterate {
    pub(super) fn new(contacts: usize) -> Self {
        Self {
            velocity: Velocity { linear: Vector3::zeros(), spin: Vector3::zeros() },
            impulses: Vec::with_capacity(contacts),
            points: Vec::with_capacity(contacts),
            pulls: Vec::with_capacity(contacts),
            motion: Residual::default(),
            law: Law::EXACT,
        }
    }

    /// The largest speed, up or down, at which a candidate that presses changes its gap, m/s; of
    /// the last residual's point.
    pub(super) fn gap_speed(&self, equations: &StepEquations) -> f64 {
        let contacts = equations.candidates().iter().zip(&self.impulses).zip(&self.points);
        contacts
            .filter(|((contact, impulse), _)| contact.normal.dot(impulse) > 0.0)
            .map(|((contact, _), u)| contact.normal.dot(u).abs())
            .fold(0.0, f64::max)
    }

    pub(super) fn is_finite(&self) -> bool {
        let Velocity { linear, spin } = &self.velocity;
        let vectors = self.impulses.iter().chain([linear, spin]);
        vectors.flatten().all(|number| number.is_finite())
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.velocity = other.velocity;
        self.impulses.clear();
        self.impulses.extend_from_slice(&other.impulses);
        self.points.clear();
        self.points.extend_from_slice(&other.points);
        self.pulls.clear();
        self.pulls.extend_from_slice(&other.pulls);
        self.motion = other.motion;
        self.law = other.law;
    }
}

/// The residual of the law without compliance, m/s.
pub(super) fn exact_residual(equations: &StepEquations, iterate: &mut Iterate) -> f64 {
    evaluate(equations, &Law::EXACT, iterate).largest
}

/// The equations of motion (N1) and the natural map (N4) at a point, all as velocities.
fn evaluate(equations: &StepEquations, law: &Law, iterate: &mut Iterate) -> Residual {
    let (linear, angular) = equations.motion_residual(&iterate.velocity, &iterate.impulses);
    let angular = equations.as_speed(&angular);
    iterate.motion = Residual {
        largest: linear.amax().max(angular.amax()),
        squared: linear.norm_squared() + angular.norm_squared(),
    };
    let turning = equations.turning(&iterate.velocity);
    iterate.points.clear();
    let points = equations.candidates().iter().map(|contact| turning.point_velocity(contact));
    iterate.points.extend(points);
    evaluate_again(equations, law, iterate)
}

/// The same for another law at the point that was evaluated last.
fn evaluate_again(equations: &StepEquations, law: &Law, iterate: &mut Iterate) -> Residual {
    let mut size = iterate.motion;
    iterate.law = *law;
    iterate.pulls.clear();
    let contacts = equations.candidates().iter().zip(&iterate.impulses).zip(&iterate.points);
    for ((candidate, impulse), u) in contacts {
        let pull = Pull::new(law, candidate, u, impulse);
        iterate.pulls.push(pull);
        let map = pull.natural_map(candidate);
        size.largest = size.largest.max(map.amax());
        size.squared += map.norm_squared();
    }
    if !size.squared.is_finite() {
        // A maximum drops NaN; a sum does not.
        size.largest = f64::INFINITY;
    }
    size
}

/// One contact's arguments of the projections in the natural map (N4), with û = u + ε p̂ and
/// both split along and across the normal, p̂ = γ n + β:
///
/// ```text
/// γ − ρ_n û_n   and   β − ρ_t û_t
/// ```
#[derive(Debug, Clone, Copy)]
struct Pull {
    /// û.
    u: Vector3<f64>,
    /// û_n.
    u_n: f64,
    /// γ.
    gamma: f64,
    /// β.
    beta: Vector3<f64>,
    rho_n: f64,
    rho_t: f64,
    /// γ − ρ_n û_n.
    normal: f64,
    /// β − ρ_t û_t.
    tangential: Vector3<f64>,
    /// Its length.
    size: f64,
}

impl Pull {
    #[inline]
    fn new(law: &Law, candidate: &Candidate, u: &Vector3<f64>, impulse: &Vector3<f64>) -> Self {
        let n = &candidate.normal;
        let u = u + law.compliance * impulse;
        let (u_n, gamma) = (n.dot(&u), n.dot(impulse));
        let beta = impulse - n * gamma;
        let rho_n = candidate.normal_scale;
        let rho_t = candidate.tangential_scale * law.sharpness;
        let tangential = beta - rho_t * (u - n * u_n);
        let size = tangential.norm();
        Self { u, u_n, gamma, beta, rho_n, rho_t, normal: gamma - rho_n * u_n, tangential, size }
    }

    /// The natural map (N4), as a velocity:
    ///
    /// ```text
    /// n (γ − max(0, γ − ρ_n û_n))/ρ_n + (β − Π_{μ max(0, γ − ρ_n û_n)}(β − ρ_t û_t))/ρ_t
    /// ```
    #[inline]
    fn natural_map(&self, candidate: &Candidate) -> Vector3<f64> {
        let normal = self.normal.max(0.0);
        let radius = candidate.friction * normal;
        let shrink = if self.size > radius { radius / self.size } else { 1.0 };
        let tangential = (self.beta - shrink * self.tangential) / self.rho_t;
        tangential + candidate.normal * ((self.gamma - normal) / self.rho_n)
    }

    /// The piece of the natural map; within `stick_margin` of the cone it is stick.
    fn mode(&self, candidate: &Candidate, stick_margin: f64) -> Mode {
        if self.normal <= 0.0 {
            Mode::Open
        } else if self.size <= candidate.friction * (1.0 + stick_margin) * self.normal {
            Mode::Stick
        } else {
            Mode::Slip
        }
    }

    /// The slip piece linearised and solved for the impulse (N5): (offset, gain) of
    /// δp̂ = offset + gain · δu, with δû = δu + ε δp̂ and ε = `compliance`.
    ///
    /// û_n = 0, and β = μ (γ − ρ_n û_n) t with t the direction of the pull β − ρ_t û_t. By
    /// δû_n = −û_n and δt = s sᵀ (δβ − ρ_t δû_t)/|pull|, s = n × t.
    fn linearise_slip(
        &self,
        candidate: &Candidate,
        compliance: f64,
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let stiffness = 1.0 / compliance;
        let (n, friction) = (&candidate.normal, candidate.friction);
        let size = self.size.max(f64::MIN_POSITIVE);
        let t = self.tangential / size;
        let s = n.cross(&t);
        let bend = (friction * self.normal / size).min(1.0);
        let across = 1.0 - bend + self.rho_t * compliance * bend;
        let normal_offset = -stiffness * self.u_n;
        let along = friction * (self.gamma + normal_offset) - t.dot(&self.beta);
        let sideways = -s.dot(&self.beta) / across;
        let turn = (-self.rho_t * bend / across) * s * s.transpose();
        let press = (-stiffness * friction) * t - stiffness * n;
        (along * t + sideways * s + normal_offset * n, turn + press * n.transpose())
    }
}
