//! The equations of one body that touches fixed things alone: six unknowns, on the stack.

use super::equations::{
    Answer, Candidate, Elimination, Equations, Gain, Point, Residual, Slope, Velocity, reserve,
};
use super::fixed_motion::{point_velocity, slope};
use super::tolerances::{LARGE_TURN, TURN_GAIN, Tolerances};
use super::turning::Turning;
use crate::contact::Contact;
use crate::mechanics::Rotation;
use crate::mechanics::quaternion::rotation;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// The step of one body; M is its mass.
#[derive(Debug, Clone)]
pub(super) struct Single {
    time_step: f64,
    /// ℓ, m.
    reach: f64,
    /// A(q), body → world.
    rotation: Matrix3<f64>,
    /// v + h (f/m + g), m/s.
    free_linear: Vector3<f64>,
    /// ω of free flight, rad/s.
    free_spin: Vector3<f64>,
    /// v and ω at step k.
    old: Velocity,
    /// Î = I/m, m².
    inertia: Matrix3<f64>,
    /// Î⁻¹.
    inertia_inverse: Matrix3<f64>,
    /// h τ/m of the external torque, m²/s.
    torque_impulse: Vector3<f64>,
    /// By which equation the body turns.
    form: Rotation,
    /// Whether the gyroscopic term of that equation is nothing.
    turns_alike: bool,
    tolerances: Tolerances,
    unsettled: f64,
    candidates: Vec<Candidate>,
    all_give_alike: bool,
}

impl Single {
    /// Room for the steps of a body.
    pub(super) fn new(world: &World) -> Self {
        Self {
            time_step: world.time_step(),
            reach: 0.0,
            rotation: Matrix3::identity(),
            free_linear: Vector3::zeros(),
            free_spin: Vector3::zeros(),
            old: Velocity::zero(),
            inertia: Matrix3::identity(),
            inertia_inverse: Matrix3::identity(),
            torque_impulse: Vector3::zeros(),
            form: world.rotation(),
            turns_alike: false,
            tolerances: Tolerances::of(world, 0.0),
            unsettled: f64::INFINITY,
            candidates: Vec::new(),
            all_give_alike: true,
        }
    }

    /// Sets the step's constants for body `index`, whose impulses changed by `unsettled` in the
    /// steps before; no candidates yet.
    pub(super) fn begin(&mut self, step: &Step<'_>, index: usize, unsettled: f64) {
        let (state, free) = (&step.states[index], &step.free[index]);
        let body = &step.world.bodies()[index];
        self.time_step = step.world.time_step();
        self.form = step.world.rotation();
        self.reach = body.reach();
        self.inertia = *body.specific_inertia();
        self.inertia_inverse = *body.specific_inertia_inverse();
        self.turns_alike = self.form == Rotation::Tutorial && body.is_isotropic();
        self.rotation = rotation(&state.attitude);
        self.free_linear = free.velocity;
        self.free_spin = free.spin;
        self.old = Velocity { linear: state.velocity, spin: state.spin };
        self.torque_impulse = step.wrenches[index].torque * (self.time_step / body.mass());
        self.tolerances = Tolerances::of(step.world, self.speed());
        self.unsettled = unsettled;
        self.candidates.clear();
        self.all_give_alike = true;
    }

    /// Room for so many contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        reserve(&mut self.candidates, contacts);
    }

    /// Adds a contact of the body with something fixed.
    pub(super) fn admit(&mut self, contact: &Contact) {
        let candidate = Candidate::new(contact, self.time_step, 1.0);
        self.all_give_alike &= candidate.gives_alike();
        self.candidates.push(candidate);
    }

    /// An angular residual of (N1) as the speed of a point at the body's reach, m/s.
    fn as_speed(&self, angular: &Vector3<f64>) -> Vector3<f64> {
        self.inertia_inverse * angular * self.reach
    }

    /// The linear and angular parts of the equations of motion (N1):
    ///
    /// ```text
    /// v⁺ − v_free − Σ p̂,   Î (ω⁺ − ω) + h Ĝ(ω, ω⁺) − h τ/m − Σ [c]× Aᵀ p̂
    /// ```
    fn motion(
        &self,
        velocity: &Velocity,
        impulses: &[Vector3<f64>],
    ) -> (Vector3<f64>, Vector3<f64>) {
        let spin = &velocity.spin;
        let mut linear = velocity.linear - self.free_linear;
        let mut angular = self.inertia * (spin - self.old.spin) - self.torque_impulse;
        if !self.turns_alike {
            let (h, old) = (self.time_step, &self.old.spin);
            angular += h * self.form.gyroscopic(&self.inertia, old, spin, h);
        }
        for (candidate, impulse) in self.candidates.iter().zip(impulses) {
            linear -= impulse;
            angular -= candidate.torque_map * impulse;
        }
        (linear, angular)
    }

    /// ∂(angular part)/∂ω⁺ = Î + h ∂Ĝ/∂ω⁺.
    fn angular_slope(&self, spin: &Vector3<f64>) -> Matrix3<f64> {
        if self.turns_alike {
            return self.inertia;
        }
        let h = self.time_step;
        self.inertia + h * self.form.gyroscopic_slope(&self.inertia, spin, h)
    }

    fn turning(&self, velocity: &Velocity) -> Turning {
        Turning::new(&self.rotation, velocity.spin, self.time_step)
    }

    /// u of a candidate (N2).
    #[inline(always)]
    fn point_velocity(
        &self,
        candidate: &Candidate,
        turning: &Turning,
        velocity: &Velocity,
    ) -> Vector3<f64> {
        let u = point_velocity(candidate, turning, &velocity.linear);
        if !candidate.bounces() {
            return u;
        }
        candidate.bounded(u, &self.departing(candidate, velocity)).0
    }

    /// ∂u/∂ω⁺, `u` being the candidate's; ∂u/∂v⁺ is E.
    #[inline(always)]
    fn point_slope(
        &self,
        candidate: &Candidate,
        turning: &Turning,
        velocity: &Velocity,
        u: &Vector3<f64>,
    ) -> Matrix3<f64> {
        let normal = &candidate.normal;
        let swept = match candidate.radius > 0.0 || candidate.bounces() {
            true => turning.swept(&candidate.centre),
            false => u - velocity.linear - normal * candidate.approach,
        };
        let by_spin = slope(candidate, &self.rotation, turning, &swept);
        if !candidate.bounces() {
            return by_spin;
        }
        let u = point_velocity(candidate, turning, &velocity.linear);
        if !candidate.bounded(u, &self.departing(candidate, velocity)).1 {
            return by_spin;
        }
        let inertia = (&self.inertia, &self.inertia_inverse);
        let departing = self.form.departing_slope(inertia, &velocity.spin, self.time_step);
        let along = (candidate.torque_map * normal).tr_mul(&departing);
        by_spin + normal * (along - by_spin.tr_mul(normal).transpose())
    }

    /// v⁺ + Gᵀ ω̃⁺ (eq. 29): how the touching point parts after the impulses.
    fn departing(&self, candidate: &Candidate, velocity: &Velocity) -> Vector3<f64> {
        let inertia = (&self.inertia, &self.inertia_inverse);
        let spin = self.form.departing_spin(inertia, &velocity.spin, self.time_step);
        velocity.linear + candidate.torque_map.tr_mul(&spin)
    }
}

impl Equations for Single {
    type Velocity = Velocity;
    type Slope = SpinSlope;
    type System = ();
    type Scratch = Evaluated;

    #[inline]
    fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    fn all_give_alike(&self) -> bool {
        self.all_give_alike
    }

    fn give_alike(&mut self) {
        self.all_give_alike = true;
        self.candidates.iter_mut().for_each(|candidate| candidate.give = 1.0);
    }

    fn tolerances(&self) -> &Tolerances {
        &self.tolerances
    }

    fn bodies(&self) -> usize {
        1
    }

    fn unsettled(&self) -> f64 {
        self.unsettled
    }

    fn speed(&self) -> f64 {
        self.free_linear.norm() + self.free_spin.norm() * self.reach
    }

    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Velocity) {
        let (mut linear, mut torque) = (self.free_linear, Vector3::zeros());
        for (candidate, impulse) in self.candidates.iter().zip(impulses) {
            linear += impulse;
            torque += candidate.torque_map * impulse;
        }
        *velocity = Velocity { linear, spin: self.free_spin + self.inertia_inverse * torque };
    }

    fn keep_velocity(&self, velocity: &mut Velocity) {
        let (exact, old) = (self.tolerances.exact, &self.old);
        if (velocity.spin - old.spin).amax() * self.reach <= exact {
            velocity.spin = old.spin;
        }
        if (velocity.linear - old.linear).amax() <= exact {
            velocity.linear = old.linear;
        }
        for candidate in &self.candidates {
            let along = candidate.normal.dot(&(velocity.linear - old.linear));
            if along.abs() <= exact {
                velocity.linear -= candidate.normal * along;
            }
        }
    }

    fn turns_too_far(&self, velocity: &Velocity) -> bool {
        let turn = self.time_step * velocity.spin.norm();
        turn > LARGE_TURN && turn > TURN_GAIN * self.time_step * self.old.spin.norm()
    }

    #[inline]
    fn motion_residual(
        &self,
        velocity: &Velocity,
        impulses: &[Vector3<f64>],
        evaluated: &mut Evaluated,
    ) -> Residual {
        let (linear, angular) = self.motion(velocity, impulses);
        evaluated.residual = (linear, angular);
        let mut residual = Residual::default();
        residual.add(&linear);
        residual.add(&self.as_speed(&angular));
        residual
    }

    fn point(&self, index: usize, velocity: &Velocity) -> Vector3<f64> {
        self.point_velocity(&self.candidates[index], &self.turning(velocity), velocity)
    }

    fn push(&self, index: usize, impulse: &Vector3<f64>, velocity: &mut Velocity) {
        velocity.linear += impulse;
        let torque = self.candidates[index].torque_map * impulse;
        velocity.spin += self.inertia_inverse * torque;
    }

    #[inline]
    fn set_points(
        &self,
        velocity: &Velocity,
        evaluated: &mut Evaluated,
        points: &mut Vec<Vector3<f64>>,
    ) {
        let turning = self.turning(velocity);
        evaluated.turning = turning;
        points.clear();
        let candidates = self.candidates.iter();
        points
            .extend(candidates.map(|candidate| self.point_velocity(candidate, &turning, velocity)));
    }

    #[inline]
    fn direction(
        &self,
        at: Point<'_, Self>,
        mut answer: impl FnMut(usize, &Candidate, &Vector3<f64>) -> Option<Answer>,
        eliminations: &mut Vec<Elimination<SpinSlope>>,
        (): &mut (),
        step: &mut Velocity,
    ) -> bool {
        let Evaluated { residual: (linear, angular), turning } = at.scratch;
        let mut system = MotionSystem {
            linear_linear: Matrix3::identity(),
            linear_angular: Matrix3::zeros(),
            angular_linear: Matrix3::zeros(),
            angular_angular: self.angular_slope(&at.velocity.spin),
            linear: -linear,
            angular: -angular,
        };
        eliminations.clear();
        for (index, (candidate, u)) in self.candidates.iter().zip(at.points).enumerate() {
            let Some(answer) = answer(index, candidate, u) else { return false };
            let slope = match answer.gain {
                Gain::Zero => SpinSlope(Matrix3::zeros()),
                _ => SpinSlope(self.point_slope(candidate, turning, at.velocity, u)),
            };
            let elimination = Elimination { answer, slope };
            system.add(&candidate.torque_map, &elimination);
            eliminations.push(elimination);
        }
        match system.solve() {
            Some(change) => {
                *step = change;
                true
            }
            None => false,
        }
    }
}

/// What an evaluation leaves behind for the direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluated {
    /// The residuals of the equations of motion, linear and angular.
    residual: (Vector3<f64>, Vector3<f64>),
    turning: Turning,
}

impl Default for Evaluated {
    fn default() -> Self {
        let nothing = Vector3::zeros();
        let turning = Turning::new(&Matrix3::identity(), nothing, 0.0);
        Self { residual: (nothing, nothing), turning }
    }
}

/// ∂u/∂ω⁺; ∂u/∂v⁺ is E.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpinSlope(Matrix3<f64>);

impl Slope for SpinSlope {
    type Velocity = Velocity;

    #[inline]
    fn point_step(&self, change: &Velocity) -> Vector3<f64> {
        change.linear + self.0 * change.spin
    }
}

/// The linearised equations of motion with the contacts added one by one (N8):
///
/// ```text
/// ⎡ E − Σ D        − Σ D J          ⎤ ⎡δv⎤   ⎡ −r_v + Σ d          ⎤
/// ⎣ − Σ G D    M(ω) − Σ G D J       ⎦ ⎣δω⎦ = ⎣ −r_ω + Σ G d        ⎦
/// ```
///
/// with G = [c]× Aᵀ, J = ∂u/∂ω, and (d, D) the offset and gain of a contact.
struct MotionSystem {
    linear_linear: Matrix3<f64>,
    linear_angular: Matrix3<f64>,
    angular_linear: Matrix3<f64>,
    angular_angular: Matrix3<f64>,
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

impl MotionSystem {
    /// Adds a contact with its torque map G.
    #[inline(always)]
    fn add(&mut self, torque_map: &Matrix3<f64>, contact: &Elimination<SpinSlope>) {
        let (answer, slope) = (&contact.answer, &contact.slope.0);
        self.linear += answer.offset;
        self.angular += torque_map * answer.offset;
        match &answer.gain {
            Gain::Zero => {}
            Gain::Spring(stiffness) => {
                let by_spin = slope * -stiffness;
                for k in 0..3 {
                    self.linear_linear[(k, k)] += stiffness;
                }
                self.linear_angular -= by_spin;
                self.angular_linear += torque_map * *stiffness;
                self.angular_angular -= torque_map * by_spin;
            }
            Gain::Full(gain) => {
                let by_spin = gain * slope;
                self.linear_linear -= gain;
                self.linear_angular -= by_spin;
                self.angular_linear -= torque_map * gain;
                self.angular_angular -= torque_map * by_spin;
            }
        }
    }

    /// (δv, δω), `None` where the matrix is singular.
    fn solve(&self) -> Option<Velocity> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.linear_linear);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.linear_angular);
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.angular_linear);
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.angular_angular);
        let mut rhs = Vector6::zeros();
        rhs.fixed_rows_mut::<3>(0).copy_from(&self.linear);
        rhs.fixed_rows_mut::<3>(3).copy_from(&self.angular);
        let solvable = matrix.lu().solve_mut(&mut rhs) && rhs.iter().all(|x| x.is_finite());
        solvable.then(|| Velocity {
            linear: rhs.fixed_rows::<3>(0).into(),
            spin: rhs.fixed_rows::<3>(3).into(),
        })
    }
}
