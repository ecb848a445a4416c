//! Equations of one body that touches only fixed objects: six unknowns, on the stack.

use super::body_equation::BodyEquation;
use super::coupling::Coupling;
use super::equations::{
    Elimination, Equations, EvaluatedPoint, MapResidual, Slope, StepSetting, Velocity, reserve,
};
use super::fixed_motion::{point_velocity, slope};
use super::law::{Gain, LocalSolution};
use super::settings::Settings;
use super::tolerances::Tolerances;
use super::turning::BodyTurning;
use crate::contact::Contact;
use crate::sparse::SixFactors;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Matrix6, Vector3};

/// Step equations of one body. M is its mass.
#[derive(Debug, Clone)]
pub(super) struct Single {
    /// h (s).
    time_step: f64,
    body: BodyEquation,
    setting: StepSetting,
}

impl Single {
    /// Empty equations for steps of a body.
    pub(super) fn new(world: &World) -> Self {
        let setting = StepSetting::new(Tolerances::new(world, 0.0, 0.0));
        Self { time_step: world.time_step(), body: BodyEquation::room(), setting }
    }

    /// Sets the step's constants for body `index`, without couplings. `unsettled` is the relative
    /// change of its impulses over the last steps.
    pub(super) fn begin(&mut self, step: &Step<'_>, index: usize, unsettled: f64) {
        self.time_step = step.world.time_step();
        self.body = BodyEquation::new(step, index, step.world.bodies()[index].mass());
        let tolerances = Tolerances::new(step.world, self.body.speed(), step.distance(index));
        self.setting.begin(tolerances, unsettled);
    }

    /// Reserves memory for `contacts` contacts.
    pub(super) fn reserve(&mut self, contacts: usize) {
        reserve(&mut self.setting.couplings, contacts);
    }

    /// Adds a contact of the body with a fixed object.
    pub(super) fn admit(&mut self, contact: &Contact) {
        self.setting.admit(Coupling::from_contact(contact, self.time_step, 1.0, 0.0));
    }

    /// Linear and angular residuals of the equations of motion (N1):
    ///
    /// ```text
    /// v⁺ − v_free − Σ p̂,   Î (ω⁺ − ω) + h Ĝ(ω, ω⁺) − h τ/m − Σ [c]× Aᵀ p̂
    /// ```
    fn motion(&self, velocity: &Velocity, impulses: &[Vector3<f64>]) -> Velocity {
        let mut motion = Velocity {
            linear: velocity.linear - self.body.free.linear,
            spin: self.body.turned(&velocity.spin) - self.body.torque_impulse,
        };
        if let Some(gyroscopic) = self.body.gyroscopic(&velocity.spin) {
            motion.spin += gyroscopic;
        }
        for (coupling, impulse) in self.setting.couplings.iter().zip(impulses) {
            motion.linear -= impulse;
            motion.spin -= coupling.lever.torque_map * impulse;
        }
        motion
    }

    /// u of a coupling (N2).
    #[inline(always)]
    fn point_velocity(
        &self,
        coupling: &Coupling,
        turning: &BodyTurning,
        velocity: &Velocity,
    ) -> Vector3<f64> {
        let u = point_velocity(coupling, turning, &velocity.linear);
        if !coupling.bounces() {
            return u;
        }
        coupling.bounded(u, &self.body.departing(velocity, &coupling.lever.torque_map)).0
    }

    /// ∂u/∂ω⁺ of a coupling with the motion `u`. The derivative ∂u/∂v⁺ is E.
    #[inline(always)]
    fn point_slope(
        &self,
        coupling: &Coupling,
        turning: &BodyTurning,
        velocity: &Velocity,
        u: &Vector3<f64>,
    ) -> Matrix3<f64> {
        let (normal, lever) = (&coupling.rows.normal(), &coupling.lever);
        let swept = if lever.radius > 0.0 || coupling.bounces() {
            turning.swept(&lever.centre)
        } else {
            u - velocity.linear - coupling.offset
        };
        let by_spin = slope(coupling, &self.body.rotation, turning, &swept);
        if !coupling.bounces() {
            return by_spin;
        }
        let u = point_velocity(coupling, turning, &velocity.linear);
        if !coupling.bounded(u, &self.body.departing(velocity, &lever.torque_map)).1 {
            return by_spin;
        }
        let along = self.body.departing_slope(velocity, &lever.torque_map, normal);
        by_spin + normal * (along - by_spin.tr_mul(normal).transpose())
    }
}

impl Equations for Single {
    type Velocity = Velocity;
    type Slope = SpinSlope;
    type System = Option<SixFactors>;
    type Scratch = Evaluated;

    #[inline]
    fn setting(&self) -> &StepSetting {
        &self.setting
    }

    fn setting_mut(&mut self) -> &mut StepSetting {
        &mut self.setting
    }

    fn settings(&self) -> &'static Settings {
        Settings::for_island(1, self.setting.couplings.len(), false)
    }

    fn speed(&self) -> f64 {
        self.body.speed()
    }

    fn set_velocity_after(&self, impulses: &[Vector3<f64>], velocity: &mut Velocity) {
        let mut linear = self.body.free.linear;
        let mut torque = Vector3::zeros();
        for (coupling, impulse) in self.setting.couplings.iter().zip(impulses) {
            linear += impulse;
            torque += coupling.lever.torque_map * impulse;
        }
        let spin = self.body.free.spin + self.body.inertia_inverse * torque;
        *velocity = Velocity { linear, spin };
    }

    fn keep_velocity(&self, velocity: &mut Velocity) {
        let exact = self.setting.tolerances.exact;
        self.body.keep(exact, velocity);
        for coupling in &self.setting.couplings {
            self.body.keep_along(&coupling.rows.normal(), exact, velocity);
        }
    }

    fn turns_too_far(&self, velocity: &Velocity) -> bool {
        self.body.turns_too_far(velocity)
    }

    fn energy_made(&self, _: &Velocity, _: &[Vector3<f64>], _: &[Vector3<f64>]) -> f64 {
        0.0
    }

    #[inline]
    fn motion_residual(
        &self,
        velocity: &Velocity,
        impulses: &[Vector3<f64>],
        evaluated: &mut Evaluated,
    ) -> MapResidual {
        let motion = self.motion(velocity, impulses);
        evaluated.residual = motion;
        let mut residual = MapResidual::default();
        residual.add(&motion.linear);
        residual.add(&self.body.as_speed(&motion.spin));
        residual
    }

    #[inline]
    fn set_points(
        &self,
        velocity: &Velocity,
        evaluated: &mut Evaluated,
        points: &mut Vec<Vector3<f64>>,
    ) {
        let turning = self.body.turning(velocity.spin);
        evaluated.turning = turning;
        points.clear();
        let couplings = self.setting.couplings.iter();
        points.extend(couplings.map(|coupling| self.point_velocity(coupling, &turning, velocity)));
    }

    #[inline]
    fn linearise(
        &self,
        at: EvaluatedPoint<'_, Self>,
        mut local_solution: impl FnMut(usize, &Coupling, &Vector3<f64>) -> Option<LocalSolution>,
        eliminations: &mut Vec<Elimination<SpinSlope>>,
        factors: &mut Option<SixFactors>,
    ) -> bool {
        let turning = &at.scratch.turning;
        let mut matrix = MotionMatrix {
            linear_linear: Matrix3::identity(),
            linear_angular: Matrix3::zeros(),
            angular_linear: Matrix3::zeros(),
            angular_angular: self.body.angular_slope(&at.velocity.spin),
        };
        eliminations.clear();
        for (index, (coupling, u)) in self.setting.couplings.iter().zip(at.points).enumerate() {
            let Some(local_solution) = local_solution(index, coupling, u) else { return false };
            let slope = match local_solution.gain {
                Gain::Zero => SpinSlope(Matrix3::zeros()),
                _ => SpinSlope(self.point_slope(coupling, turning, at.velocity, u)),
            };
            let elimination = Elimination { local_solution, slope };
            matrix.add(&coupling.lever.torque_map, &elimination);
            eliminations.push(elimination);
        }
        *factors = matrix.factorised();
        true
    }

    #[inline]
    fn direction(
        &self,
        evaluated: &Evaluated,
        eliminations: &[Elimination<SpinSlope>],
        factors: &mut Option<SixFactors>,
        step: &mut Velocity,
    ) -> bool {
        let Velocity { linear, spin } = evaluated.residual;
        let (mut linear, mut angular) = (-linear, -spin);
        for (coupling, contact) in self.setting.couplings.iter().zip(eliminations) {
            linear += contact.local_solution.offset;
            angular += coupling.lever.torque_map * contact.local_solution.offset;
        }
        let change = factors.as_ref().and_then(|factors| solve(factors, &linear, &angular));
        change.map(|change| *step = change).is_some()
    }
}

/// Results of an evaluation that the direction needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluated {
    /// Residuals of the equations of motion.
    residual: Velocity,
    turning: BodyTurning,
}

impl Default for Evaluated {
    fn default() -> Self {
        let turning = BodyTurning::STILL;
        Self { residual: Velocity::zero(), turning }
    }
}

/// ∂u/∂ω⁺. The derivative ∂u/∂v⁺ is E.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpinSlope(Matrix3<f64>);

impl Slope for SpinSlope {
    type Velocity = Velocity;

    #[inline]
    fn velocity_change(&self, change: &Velocity) -> Vector3<f64> {
        change.linear + self.0 * change.spin
    }
}

/// Matrix of the linearised equations of motion, with couplings added one by one (N8):
///
/// ```text
/// ⎡ E − Σ D        − Σ D J          ⎤ ⎡δv⎤   ⎡ −r_v + Σ d          ⎤
/// ⎣ − Σ G D    M(ω) − Σ G D J       ⎦ ⎣δω⎦ = ⎣ −r_ω + Σ G d        ⎦
/// ```
///
/// with G = [c]× Aᵀ, J = ∂u/∂ω, and (d, D) the offset and gain of a coupling.
struct MotionMatrix {
    linear_linear: Matrix3<f64>,
    linear_angular: Matrix3<f64>,
    angular_linear: Matrix3<f64>,
    angular_angular: Matrix3<f64>,
}

impl MotionMatrix {
    /// Adds a coupling with its torque map G.
    #[inline(always)]
    fn add(&mut self, torque_map: &Matrix3<f64>, coupling: &Elimination<SpinSlope>) {
        let slope = &coupling.slope.0;
        match &coupling.local_solution.gain {
            Gain::Zero | Gain::Moment(_) => {}
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

    #[inline]
    fn factorised(&self) -> Option<SixFactors> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.linear_linear);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.linear_angular);
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.angular_linear);
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.angular_angular);
        SixFactors::new(&matrix)
    }
}

/// (δv, δω). `None` if not finite.
#[inline]
fn solve(factors: &SixFactors, linear: &Vector3<f64>, angular: &Vector3<f64>) -> Option<Velocity> {
    let mut rhs = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z];
    factors.solve(&mut rhs);
    rhs.iter().all(|x| x.is_finite()).then(|| Velocity {
        linear: Vector3::new(rhs[0], rhs[1], rhs[2]),
        spin: Vector3::new(rhs[3], rhs[4], rhs[5]),
    })
}
