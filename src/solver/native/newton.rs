//! Semismooth Newton on the natural map of the contact law, after Alart and Curnier
//! (1991), with every contact eliminated to a 6 × 6 system.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::elimination::{Elimination, MotionSystem};
use super::equations::{Candidate, StepEquations, Velocity};
use nalgebra::{Matrix3, Vector2, Vector3};

/// A point of the iteration.
#[derive(Debug, Clone)]
pub(super) struct Iterate {
    pub(super) velocity: Velocity,
    /// p̂ of every candidate, m/s, world.
    pub(super) impulses: Vec<Vector3<f64>>,
    /// u of every candidate (N2), kept from the last residual.
    points: Vec<Vector3<f64>>,
}

/// Scratch of the iteration, sized once.
#[derive(Debug, Clone)]
pub(super) struct Newton {
    trial: Iterate,
    modes: Vec<Mode>,
    eliminations: Vec<Elimination>,
}

/// How an iteration ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct NewtonReport {
    pub(super) converged: bool,
    pub(super) iterations: u32,
}

/// The contact law to be solved.
#[derive(Debug, Clone, Copy)]
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
#[derive(Debug, Clone, Copy)]
struct Residual {
    /// Largest entry, m/s.
    largest: f64,
    /// Sum of squares, m²/s².
    squared: f64,
}

const MOST_ITERATIONS: u32 = 40;
/// Corrections towards the limit of vanishing compliance.
const MOST_CORRECTIONS: u32 = 3;
/// Residual to converge to, m/s.
const TOLERANCE: f64 = 1e-11;
/// Residual at which the limit is reached: rounding of z⁺/h, m/s.
const LIMIT_TOLERANCE: f64 = 1e-12;
/// Below this residual (m/s) whole steps are taken even where the residual grows: the
/// natural map has kinks at the scale of the compliance, on which a search along the
/// direction stalls although the next piece of the map has the solution.
const DARING_RESIDUAL: f64 = 1e-5;
/// How many of them.
const MOST_DARING_STEPS: u32 = 6;
/// A step shorter than this fraction of Newton's is taken for a stall.
const SHORTEST_STEP: f64 = 1e-4;
/// How much of the decrease that the linear model promises a step must bring.
const SUFFICIENT_DECREASE: f64 = 1e-4;

impl Newton {
    pub(super) fn new(contacts: usize) -> Self {
        Self {
            trial: Iterate::new(contacts),
            modes: Vec::with_capacity(contacts),
            eliminations: Vec::with_capacity(contacts),
        }
    }

    /// Solves `law` from `iterate`, with the compliance `matrix` in the Newton matrix: that
    /// of the law, or any where the law has none.
    pub(super) fn solve(
        &mut self,
        equations: &StepEquations,
        law: &Law,
        matrix: f64,
        iterate: &mut Iterate,
    ) -> NewtonReport {
        let mut merit = residual(equations, law, iterate);
        let mut daring = MOST_DARING_STEPS;
        for iterations in 0..MOST_ITERATIONS {
            if merit.largest <= TOLERANCE {
                return NewtonReport { converged: true, iterations };
            }
            self.find_modes(equations, law, iterate);
            let Some(step) = self.direction(equations, law, matrix, iterate) else {
                return NewtonReport { converged: false, iterations };
            };
            if merit.largest <= DARING_RESIDUAL && daring > 0 {
                self.try_step(iterate, &step, 1.0);
                let trial = residual(equations, law, &mut self.trial);
                daring -= u32::from(trial.squared >= merit.squared);
                std::mem::swap(iterate, &mut self.trial);
                merit = trial;
            } else if let Some(better) = self.search(equations, law, iterate, &step, &merit) {
                merit = better;
            } else {
                return NewtonReport { converged: false, iterations };
            }
        }
        NewtonReport { converged: merit.largest <= TOLERANCE, iterations: MOST_ITERATIONS }
    }

    /// Moves a solution of `law` to the limit of vanishing compliance (N9): the law without
    /// compliance, every contact on the piece that `law` puts it on, and the compliance in
    /// the matrix alone, which leaves the undetermined part of the impulses where it is.
    /// Returns the residual of the law without compliance.
    pub(super) fn take_limit(
        &mut self,
        equations: &StepEquations,
        law: &Law,
        iterate: &mut Iterate,
        iterations: &mut u32,
    ) -> f64 {
        let mut merit = residual(equations, &Law::EXACT, iterate);
        self.find_modes(equations, law, iterate);
        for _ in 0..MOST_CORRECTIONS {
            if merit.largest <= LIMIT_TOLERANCE {
                break;
            }
            let Some(step) = self.direction(equations, &Law::EXACT, law.compliance, iterate) else {
                break;
            };
            *iterations += 1;
            self.try_step(iterate, &step, 1.0);
            let corrected = residual(equations, &Law::EXACT, &mut self.trial);
            if corrected.largest >= merit.largest {
                break;
            }
            std::mem::swap(iterate, &mut self.trial);
            merit = corrected;
        }
        merit.largest
    }

    fn find_modes(&mut self, equations: &StepEquations, law: &Law, iterate: &Iterate) {
        let contacts = equations.candidates().iter().zip(&iterate.impulses).zip(&iterate.points);
        self.modes.clear();
        self.modes.extend(contacts.map(|((candidate, impulse), u)| {
            Pull::new(law, candidate, u, impulse).mode(equations.friction(), law.stick_margin)
        }));
    }

    /// The Newton direction of the velocities for the modes found before; the impulses'
    /// part follows from the eliminations.
    fn direction(
        &mut self,
        equations: &StepEquations,
        law: &Law,
        matrix: f64,
        iterate: &Iterate,
    ) -> Option<Velocity> {
        let velocity = &iterate.velocity;
        let mut system = MotionSystem::new(equations, velocity, &iterate.impulses);
        let turning = equations.turning(velocity);
        self.eliminations.clear();
        let contacts = equations.candidates().iter().zip(&iterate.impulses);
        for (((candidate, impulse), u), mode) in contacts.zip(&iterate.points).zip(&self.modes) {
            let pull = Pull::new(law, candidate, u, impulse);
            let (offset, gain) = pull.linearise(*mode, equations.friction(), matrix, impulse);
            let slope = turning.point_slope(candidate, u);
            let elimination = Elimination { offset, gain, slope };
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
            let trial = residual(equations, law, &mut self.trial);
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
        }
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
    }
}

/// The residual of the law without compliance, m/s.
pub(super) fn exact_residual(equations: &StepEquations, iterate: &mut Iterate) -> f64 {
    residual(equations, &Law::EXACT, iterate).largest
}

/// The equations of motion (N1) and the natural map (N4) at a point, all as velocities.
fn residual(equations: &StepEquations, law: &Law, iterate: &mut Iterate) -> Residual {
    let (linear, angular) = equations.motion_residual(&iterate.velocity, &iterate.impulses);
    let angular = equations.as_speed(&angular);
    let mut size = Residual {
        largest: linear.amax().max(angular.amax()),
        squared: linear.norm_squared() + angular.norm_squared(),
    };
    let turning = equations.turning(&iterate.velocity);
    iterate.points.clear();
    for (candidate, impulse) in equations.candidates().iter().zip(&iterate.impulses) {
        let u = turning.point_velocity(candidate);
        iterate.points.push(u);
        let map = Pull::new(law, candidate, &u, impulse).natural_map(equations.friction(), impulse);
        size.largest = size.largest.max(map.amax());
        size.squared += map.norm_squared();
    }
    if !size.squared.is_finite() {
        // A maximum drops NaN; a sum does not.
        size.largest = f64::INFINITY;
    }
    size
}

/// One contact's arguments of the projections in the natural map (N4), with û = u + ε p̂:
///
/// ```text
/// γ − ρ_n û_z   and   β − ρ_t û_xy
/// ```
#[derive(Debug, Clone, Copy)]
struct Pull {
    u: Vector3<f64>,
    rho_n: f64,
    rho_t: f64,
    normal: f64,
    tangential: Vector2<f64>,
    /// |β − ρ_t û_xy|.
    size: f64,
}

impl Pull {
    #[inline]
    fn new(law: &Law, candidate: &Candidate, u: &Vector3<f64>, impulse: &Vector3<f64>) -> Self {
        let u = u + law.compliance * impulse;
        let rho_n = candidate.normal_scale;
        let rho_t = candidate.tangential_scale * law.sharpness;
        let tangential = impulse.xy() - rho_t * u.xy();
        let size = tangential.norm();
        Self { u, rho_n, rho_t, normal: impulse[2] - rho_n * u[2], tangential, size }
    }

    /// The natural map (N4), as a velocity:
    ///
    /// ```text
    /// (γ − max(0, γ − ρ_n û_z)) / ρ_n,   (β − Π_{μ max(0, γ − ρ_n û_z)}(β − ρ_t û_xy)) / ρ_t
    /// ```
    fn natural_map(&self, friction: f64, impulse: &Vector3<f64>) -> Vector3<f64> {
        let normal = self.normal.max(0.0);
        let radius = friction * normal;
        let shrink = if self.size > radius { radius / self.size } else { 1.0 };
        let tangential = (impulse.xy() - shrink * self.tangential) / self.rho_t;
        Vector3::new(tangential[0], tangential[1], (impulse[2] - normal) / self.rho_n)
    }

    /// The piece of the natural map; within `stick_margin` of the cone it is stick.
    fn mode(&self, friction: f64, stick_margin: f64) -> Mode {
        if self.normal <= 0.0 {
            Mode::Open
        } else if self.size <= friction * (1.0 + stick_margin) * self.normal {
            Mode::Stick
        } else {
            Mode::Slip
        }
    }

    /// A piece linearised and solved for the impulse (N5): (offset, gain) of
    /// δp̂ = offset + gain · δu, with δû = δu + ε δp̂ and ε = `compliance`.
    fn linearise(
        &self,
        mode: Mode,
        friction: f64,
        compliance: f64,
        impulse: &Vector3<f64>,
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let stiffness = 1.0 / compliance;
        match mode {
            // p̂ = 0.
            Mode::Open => (-impulse, Matrix3::zeros()),
            // û = 0.
            Mode::Stick => (-stiffness * self.u, Matrix3::from_diagonal_element(-stiffness)),
            // û_z = 0, and β = μ (γ − ρ_n û_z) t with t the direction of the pull
            // β − ρ_t û_xy. By δû_z = −û_z and
            // δt = n nᵀ (δβ − ρ_t δû_xy)/|pull|, n across t.
            Mode::Slip => {
                let size = self.size.max(f64::MIN_POSITIVE);
                let t = self.tangential / size;
                let n = Vector2::new(-t[1], t[0]);
                let bend = (friction * self.normal / size).min(1.0);
                let across = 1.0 - bend + self.rho_t * compliance * bend;
                let normal_offset = -stiffness * self.u[2];
                let along = friction * (impulse[2] + normal_offset) - t.dot(&impulse.xy());
                let sideways = -n.dot(&impulse.xy()) / across;
                let offset = along * t + sideways * n;
                let turn = (-self.rho_t * bend / across) * n * n.transpose();
                let press = (-stiffness * friction) * t;
                (
                    Vector3::new(offset[0], offset[1], normal_offset),
                    Matrix3::new(
                        turn[(0, 0)],
                        turn[(0, 1)],
                        press[0],
                        turn[(1, 0)],
                        turn[(1, 1)],
                        press[1],
                        0.0,
                        0.0,
                        -stiffness,
                    ),
                )
            }
        }
    }
}
