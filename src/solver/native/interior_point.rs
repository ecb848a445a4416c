//! A primal–dual interior point on the contact complementarity and Coulomb's
//! second-order cone: slower than Newton's method, but with a large region of
//! convergence. Its answer is where Newton's method starts again.
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::effort::Effort;
use super::equations::{Answer, Candidate, Elimination, Equations, Point, Velocities, reserve};
use super::newton::Iterate;
use super::tolerances::COMPLIANCE;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// The variables of one contact besides V, in its own frame (t₁, t₂, n).
#[derive(Debug, Clone, Copy)]
struct Cone {
    /// μ.
    friction: f64,
    /// γ > 0, normal impulse.
    normal: f64,
    /// β, |β| < μγ.
    tangential: Vector2<f64>,
    /// s > 0, gap speed.
    gap: f64,
    /// ψ > |η|, dual speed.
    dual: f64,
    /// η, tangential speed.
    slip: Vector2<f64>,
}

/// Scratch of the iteration.
#[derive(Debug, Clone)]
pub(super) struct InteriorPoint<E: Equations> {
    cones: Vec<Cone>,
    steps: Vec<Cone>,
    /// Of every contact: (η, s) − û, and the right-hand side of (N7b).
    errors: Vec<(Vector3<f64>, f64)>,
    eliminations: Vec<Elimination<E::Slope>>,
    points: Vec<Vector3<f64>>,
    step: E::Velocity,
    moved: E::Velocity,
    scratch: E::Scratch,
    system: E::System,
}

/// What a direction aims at.
#[derive(Debug, Clone, Copy)]
enum Aim {
    /// κ = 0 to first order: the predictor.
    Boundary,
    /// This κ, to second order along the predictor found before.
    Centre(f64),
}

const MOST_ITERATIONS: u32 = 60;
/// How much of the way to the boundary a step may go.
const TO_BOUNDARY: f64 = 0.995;
/// Complementarity (m²/s², relative to the speed scale) at which Newton takes over.
const GOOD_ENOUGH: f64 = 1e-13;
/// The error of the equations (relative to the speed scale) that goes with it.
const NEAR: f64 = 1e-9;
/// The least speed and friction that a start is scaled with, in parts of the world's scale.
const LEAST: f64 = 1e-6;

impl<E: Equations> InteriorPoint<E> {
    pub(super) fn new() -> Self {
        Self {
            cones: Vec::new(),
            steps: Vec::new(),
            errors: Vec::new(),
            eliminations: Vec::new(),
            points: Vec::new(),
            step: E::Velocity::empty(),
            moved: E::Velocity::empty(),
            scratch: E::Scratch::default(),
            system: E::System::default(),
        }
    }

    /// Room for so many contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        reserve(&mut self.cones, contacts);
        reserve(&mut self.steps, contacts);
        reserve(&mut self.errors, contacts);
        reserve(&mut self.eliminations, contacts);
        reserve(&mut self.points, contacts);
    }

    /// Brings `iterate` near a solution from a centred start with normal impulses of
    /// `scale` times the momentum over the number of contacts.
    pub(super) fn solve(
        &mut self,
        equations: &E,
        scale: f64,
        iterate: &mut Iterate<E>,
        effort: &mut Effort<'_>,
    ) {
        let speed = self.start(equations, scale, iterate);
        let target = GOOD_ENOUGH * speed * speed;
        for _ in 0..MOST_ITERATIONS {
            let gap = self.complementarity(0.0);
            let there = gap <= target && self.error(equations, iterate) <= NEAR * speed;
            if there || !effort.spend() {
                return;
            }
            // The predictor's progress says how much to centre (Mehrotra).
            if !self.set_direction(equations, iterate, Aim::Boundary) {
                return;
            }
            let after = self.complementarity(self.longest_step());
            let centring = (after / gap).clamp(0.0, 1.0).powi(3);
            let aim = Aim::Centre(centring * gap);
            if !self.set_direction(equations, iterate, aim) {
                return;
            }
            self.advance(equations, iterate, self.longest_step());
        }
    }

    /// The centred start; returns the speed scale.
    fn start(&mut self, equations: &E, scale: f64, iterate: &mut Iterate<E>) -> f64 {
        let count = equations.candidates().len() as f64;
        let speed = equations.speed().max(LEAST);
        let centred = |candidate: &Candidate| Cone {
            friction: candidate.friction,
            normal: scale * speed / count,
            gap: speed,
            dual: speed / candidate.friction.max(LEAST),
            ..Cone::ZERO
        };
        self.cones.clear();
        self.cones.extend(equations.candidates().iter().map(centred));
        self.steps.clear();
        self.steps.extend(equations.candidates().iter().map(|_| Cone::ZERO));
        self.set_impulses(equations, iterate);
        equations.set_velocity_after(&[], &mut iterate.velocity);
        speed
    }

    /// Mean complementarity of all products after a step of `length` along `steps`.
    fn complementarity(&self, length: f64) -> f64 {
        let moved = self.cones.iter().zip(&self.steps).map(|(cone, step)| cone.moved(step, length));
        let total: f64 = moved.map(|cone| cone.products()).sum();
        total / (2 * self.cones.len()) as f64
    }

    /// Largest error of the equations of motion and of (η, s) = û, m/s.
    fn error(&mut self, equations: &E, iterate: &Iterate<E>) -> f64 {
        let Self { cones, points, scratch, .. } = self;
        let motion = equations.motion_residual(&iterate.velocity, &iterate.impulses, scratch);
        let mut largest = motion.largest;
        equations.set_points(&iterate.velocity, scratch, points);
        for ((candidate, cone), u) in equations.candidates().iter().zip(&*cones).zip(&*points) {
            let u = candidate.frame.tr_mul(u) + COMPLIANCE * cone.impulse();
            largest = largest.max((cone.speeds() - u).amax());
        }
        largest
    }

    /// Sets the direction of the velocities to `step` and that of the cones' variables to
    /// `steps`; `false` where there is none.
    fn set_direction(&mut self, equations: &E, iterate: &Iterate<E>, aim: Aim) -> bool {
        let Self { cones, steps, errors, eliminations, points, step, scratch, system, .. } = self;
        let (velocity, impulses) = (&iterate.velocity, iterate.impulses.as_slice());
        equations.motion_residual(velocity, impulses, scratch);
        equations.set_points(velocity, scratch, points);
        errors.clear();
        let solvable = equations.direction(
            Point { velocity, points, scratch },
            |index, candidate, u| {
                let cone = &cones[index];
                let targets = match aim {
                    Aim::Boundary => cone.targets(0.0, &Cone::ZERO),
                    Aim::Centre(kappa) => cone.targets(kappa, &steps[index]),
                };
                let frame = &candidate.frame;
                let gap_error = cone.speeds() - frame.tr_mul(u) - COMPLIANCE * cone.impulse();
                let (offset, gain) = cone.eliminate(&targets, &gap_error)?;
                errors.push((gap_error, targets.dual));
                Some(Answer::full(frame * offset, frame * gain * frame.transpose()))
            },
            eliminations,
            system,
            step,
        );
        if solvable {
            let contacts = equations.candidates().iter().zip(&*cones);
            let solved = eliminations.iter().zip(&*errors);
            for ((target, (candidate, cone)), (elimination, (gap_error, dual_target))) in
                steps.iter_mut().zip(contacts).zip(solved)
            {
                let impulse = candidate.frame.tr_mul(&elimination.impulse_step(step));
                let moved = candidate.frame.tr_mul(&elimination.point_step(step));
                *target = cone.step(&impulse, &moved, gap_error, *dual_target);
            }
        }
        solvable
    }

    /// The longest step that keeps every cone strictly inside.
    fn longest_step(&self) -> f64 {
        self.cones
            .iter()
            .zip(&self.steps)
            .map(|(cone, step)| cone.longest_step(step))
            .fold(1.0, f64::min)
    }

    fn advance(&mut self, equations: &E, iterate: &mut Iterate<E>, length: f64) {
        self.moved.set_moved(&iterate.velocity, length, &self.step);
        iterate.velocity.copy_from(&self.moved);
        for (cone, step) in self.cones.iter_mut().zip(&self.steps) {
            *cone = cone.moved(step, length);
        }
        self.set_impulses(equations, iterate);
    }

    /// The cones' impulses in the world's axes.
    fn set_impulses(&self, equations: &E, iterate: &mut Iterate<E>) {
        let contacts = equations.candidates().iter().zip(&self.cones);
        iterate.impulses.clear();
        iterate.impulses.extend(contacts.map(|(contact, cone)| contact.frame * cone.impulse()));
    }
}

/// Right-hand sides of the linearised (N7a), (N7b), (N7c).
#[derive(Debug, Clone, Copy)]
struct Targets {
    gap: f64,
    dual: f64,
    slip: Vector2<f64>,
}

impl Cone {
    const ZERO: Self = Self {
        friction: 0.0,
        normal: 0.0,
        tangential: Vector2::new(0.0, 0.0),
        gap: 0.0,
        dual: 0.0,
        slip: Vector2::new(0.0, 0.0),
    };

    /// p̂.
    fn impulse(&self) -> Vector3<f64> {
        Vector3::new(self.tangential[0], self.tangential[1], self.normal)
    }

    /// (η, s).
    fn speeds(&self) -> Vector3<f64> {
        Vector3::new(self.slip[0], self.slip[1], self.gap)
    }

    /// γ s + (μ γ ψ + β·η).
    fn products(&self) -> f64 {
        self.normal * self.gap
            + self.friction * self.normal * self.dual
            + self.tangential.dot(&self.slip)
    }

    /// μγη + ψβ.
    fn slip_product(&self, friction: f64) -> Vector2<f64> {
        friction * self.normal * self.slip + self.dual * self.tangential
    }

    /// (κ, κ, 0) less the products here and the quadratic terms of `predictor`.
    fn targets(&self, kappa: f64, predictor: &Self) -> Targets {
        let friction = self.friction;
        let dual_product =
            |cone: &Self| friction * cone.normal * cone.dual + cone.tangential.dot(&cone.slip);
        Targets {
            gap: kappa - self.normal * self.gap - predictor.normal * predictor.gap,
            dual: kappa - dual_product(self) - dual_product(predictor),
            slip: -self.slip_product(friction) - predictor.slip_product(friction),
        }
    }

    /// (N7) linearised and solved for the impulse: (δγ, δβ) = offset + gain δu.
    fn eliminate(
        &self,
        targets: &Targets,
        gap_error: &Vector3<f64>,
    ) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let friction = self.friction;
        // s δγ + γ δs = r_a with δs = δu_z + ε δγ − e_z.
        let across = self.gap + COMPLIANCE * self.normal;
        let normal_offset = (targets.gap + self.normal * gap_error[2]) / across;
        let normal_gain = -self.normal / across;
        if friction <= 0.0 {
            let gain = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, normal_gain));
            return Some((Vector3::new(0.0, 0.0, normal_offset), gain));
        }
        // δψ = (r_b − μψ δγ − η·δβ − β·δη)/(μγ), put into
        // μη δγ + μγ δη + β δψ + ψ δβ = r_c with δη = δu_xy + ε δβ − e_xy.
        let radius = friction * self.normal;
        let (beta, eta) = (&self.tangential, &self.slip);
        let by_slip = Matrix2::from_diagonal_element(radius) - beta * beta.transpose() / radius;
        let by_force = Matrix2::from_diagonal_element(self.dual) - beta * eta.transpose() / radius
            + COMPLIANCE * by_slip;
        let by_normal = friction * eta - beta * (self.dual / self.normal);
        let inverse = by_force.try_inverse()?;
        let pending = targets.slip - beta * (targets.dual / radius) - by_normal * normal_offset;
        let offset = inverse * (pending + by_slip * gap_error.xy());
        let turn = -inverse * by_slip;
        let press = -inverse * by_normal * normal_gain;
        Some((
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
                normal_gain,
            ),
        ))
    }

    /// The step of all variables of this contact for the steps of its impulse and of its point,
    /// both in its frame.
    fn step(
        &self,
        impulse: &Vector3<f64>,
        moved: &Vector3<f64>,
        gap_error: &Vector3<f64>,
        dual_target: f64,
    ) -> Self {
        let friction = self.friction;
        let speeds = moved + COMPLIANCE * impulse - gap_error;
        let mut step = Self {
            friction: 0.0,
            normal: impulse[2],
            tangential: impulse.xy(),
            gap: speeds[2],
            dual: 0.0,
            slip: speeds.xy(),
        };
        if friction > 0.0 {
            let products = friction * self.dual * step.normal
                + self.slip.dot(&step.tangential)
                + self.tangential.dot(&step.slip);
            step.dual = (dual_target - products) / (friction * self.normal);
        }
        step
    }

    fn moved(&self, step: &Self, length: f64) -> Self {
        Self {
            friction: self.friction,
            normal: self.normal + length * step.normal,
            tangential: self.tangential + length * step.tangential,
            gap: self.gap + length * step.gap,
            dual: self.dual + length * step.dual,
            slip: self.slip + length * step.slip,
        }
    }

    /// The longest step that keeps γ, s and both cones inside, at most 1.
    fn longest_step(&self, step: &Self) -> f64 {
        let friction = self.friction;
        let mut length = 1.0_f64;
        for (value, change) in [(self.normal, step.normal), (self.gap, step.gap)] {
            if change < 0.0 {
                length = length.min(-TO_BOUNDARY * value / change);
            }
        }
        if friction > 0.0 {
            let force = to_cone_boundary(
                friction * self.normal,
                self.tangential,
                friction * step.normal,
                step.tangential,
            );
            let speed = to_cone_boundary(self.dual, self.slip, step.dual, step.slip);
            length = length.min(TO_BOUNDARY * force).min(TO_BOUNDARY * speed);
        }
        length
    }
}

/// The smallest positive t with |x + t dx| = a + t da, for |x| < a.
fn to_cone_boundary(a: f64, x: Vector2<f64>, da: f64, dx: Vector2<f64>) -> f64 {
    // (a + t da)² − |x + t dx|² = p t² + 2 q t + r = 0 with r > 0.
    let p = da * da - dx.norm_squared();
    let q = a * da - x.dot(&dx);
    let r = a * a - x.norm_squared();
    let discriminant = q * q - p * r;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let root = discriminant.sqrt();
    // The numerically stable pair of roots.
    let sum = if q >= 0.0 { -(q + root) } else { -q + root };
    let roots = [sum / p, r / sum];
    roots.into_iter().filter(|t| *t > 0.0 && t.is_finite()).fold(f64::INFINITY, f64::min)
}
