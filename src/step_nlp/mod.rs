//! The nonlinear program of one contact step, with analytic derivatives.
//!
//! This is the program of the tutorial that `docs/formulation.md` derives: one body above the
//! ground. The equation numbers are those of that page.
//!
//! ```text
//! min  s1ᵀs1 + s2ᵀs2
//! s.t. the semi-implicit dynamics                             13 rows  (eq. 8)   = 0
//!      ‖q⁺‖² − 1                                               1 row   (eq. 9)   = 0
//!      α_i (c_xy,i + κ (f_xy,i − f_0,i) + λ_i f_xy,i / (‖f_xy,i‖_ε + ε))
//!                                                             2n rows  (eq. 10)  = 0
//!      z⁺_i                                                    n rows  (eq. 12)  ≥ 0
//!      μ f_z,i − ‖f_xy,i‖_ε                                    n rows  (eq. 13)  ≥ 0
//!      s1_i − f_z,i z⁺_i                                       n rows  (eq. 14)  ≥ 0
//!      s2_i − λ_i (μ f_z,i − ‖f_xy,i‖_ε)                       n rows  (eq. 15)  ≥ 0
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | X⁺ = (r⁺, q⁺, v⁺, ω⁺) | state at the end of the step; q⁺ is the attitude |
//! | f_i | force on contact point i (N): f_xy,i along the ground's tangents, f_z,i along its normal |
//! | c_xy,i | mean tangential velocity of the point over the step (m/s) |
//! | z⁺_i | height of the point above the plane at the end of the step (m) |
//! | λ_i | multiplier of the friction cone, at a solution the slip speed (m/s) |
//! | s1_i, s2_i | slacks of the two complementarity conditions (N m, W) |
//! | α_i | contact flag, 1 if the point may touch in this step, otherwise 0 |
//! | ε, μ | smoothing of ‖f_xy‖ (N), coefficient of friction |
//! | κ, f_0,i | compliance of friction, (m/s)/N, and anchor force (N); κ is 0 in the tutorial |
//!
//! In the tutorial's variant with a product, α_i in eq. 10 is α_i f_z,i ([`DissipationFactor`]).
//!
//! The unknowns are x = (X⁺, f_x, f_y, f_z, s1, s2, λ), see [`layout`]. Tangents and normal are the
//! ground's [frame](tumble_core::contact::Plane::frame); on level ground they are the world's axes.
//!
//! The Jacobian and the Hessian of the Lagrangian are each implemented once, as a function that
//! emits matrix entries in a fixed order (`entries.rs`). One receiver of these entries stores the
//! positions, another the values. Structure and values therefore always agree.

mod entries;
mod gyroscopic;
mod hessian;
mod jacobian;
mod kernels;
pub mod layout;
pub mod point;

pub use point::ProgramPoint;

use crate::sparsity::SparsityPattern;
use entries::{PatternSink, ValueSink};
use gyroscopic::Gyroscopic;
use kernels::{Normalised, SmoothForce};
use layout::Layout;
use nalgebra::{Matrix3, Matrix4, Matrix4x3, SVector, Vector2, Vector3};
use tumble_core::contact::{Partner, Plane};
use tumble_core::error::{Error, in_range};
use tumble_core::geometry::ContactPoint;
use tumble_core::mechanics::quaternion::{attitude_map, rotated_point_forms, rotation};
use tumble_core::mechanics::{RigidBody, State, Wrench};
use tumble_core::world::World;

/// Smoothing ε of the tutorial (N). It smooths the norm of the friction force (eq. 11) and keeps
/// the denominator of eq. 10 positive.
pub const SMOOTHING: f64 = 1e-6;

/// Index of the only body.
const BODY: usize = 0;

/// Reason for refusing worlds without a ground.
const NO_GROUND: &str = "the tutorial's program needs a ground";

/// Factor of the rows of maximum dissipation (eq. 10), which turns them off at a point without contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DissipationFactor {
    /// The flag α_i.
    #[default]
    Flag,
    /// The product α_i f_z,i, the tutorial's alternative. With bounds that clamp f_z,i to zero the rows
    /// are off without α_i.
    Product,
}

/// Step problem of one world. Structure and constants are fixed. [`StepNlp::set_step`] sets the
/// parameters of a step: the state X at its start, the external wrench and the contact flags α.
///
/// A point x has [`Layout::variables`] numbers. Rows and multipliers have [`Layout::constraints`].
/// Methods panic on shorter slices.
#[derive(Debug, Clone)]
pub struct StepNlp {
    world: World,
    /// Ground plane of the world.
    ground: Plane,
    /// Smoothing ε (N).
    smoothing: f64,
    factor: DissipationFactor,
    layout: Layout,
    /// Quadratic forms Q of every contact point (eq. 3), along both tangents and the normal of the
    /// ground.
    forms: Vec<[Matrix4<f64>; 3]>,
    gyroscopic: Gyroscopic,
    jacobian_pattern: SparsityPattern,
    hessian_pattern: SparsityPattern,
    /// Parameters of the current step and derived quantities.
    step: StepData,
}

/// Parameters of one step, with the terms that depend on them only.
#[derive(Debug, Clone)]
struct StepData {
    state: State,
    wrench: Wrench,
    alpha: Vec<f64>,
    /// ½ h L(q) H, the derivative of the unnormalised attitude with respect to ω⁺.
    attitude_rate: Matrix4x3<f64>,
    /// Compliance κ of friction, (m/s)/N, and the anchor force f_0 of every contact point (N).
    compliance: f64,
    anchors: Vec<Vector2<f64>>,
    /// Position C_xy of every contact point at the start, along the ground's tangents (m).
    old_positions: Vec<Vector2<f64>>,
    /// h I⁻¹ [c_i]× Aᵀ F, the derivative of ω⁺ with respect to f_i. A is the body's rotation, F the
    /// ground's frame.
    spin_per_force: Vec<Matrix3<f64>>,
}

impl StepNlp {
    /// Creates the step problem of `world` with the smoothing ε (N) and builds its structure. Until
    /// [`StepNlp::set_step`] is called, the body rests at the origin and no flag is set.
    ///
    /// # Errors
    /// A world refused by [`StepNlp::unsuitable`]; a smoothing outside 1e-12…1 N.
    pub fn new(world: World, smoothing: f64) -> Result<Self, Error> {
        Self::with_factor(world, smoothing, DissipationFactor::Flag)
    }

    /// Creates the step problem with this factor of the rows (10), like [`StepNlp::new`].
    ///
    /// # Errors
    /// Those of [`StepNlp::new`].
    pub fn with_factor(
        world: World,
        smoothing: f64,
        factor: DissipationFactor,
    ) -> Result<Self, Error> {
        in_range("smoothing epsilon (N)", smoothing, 1e-12, 1.0, "1e-12 to 1")?;
        let ground = match (Self::unsuitable(&world), world.ground()) {
            (None, Some(ground)) => ground.clone(),
            (why, _) => {
                let why = why.unwrap_or(NO_GROUND);
                return Err(Error::Unsupported { what: "this world", why });
            }
        };
        let body = &world.bodies()[BODY];
        let layout = Layout::new(body.contact_points().len());
        let state = State::at_rest(Vector3::zeros());
        let n = layout.contacts();
        let mut nlp = Self {
            smoothing,
            factor,
            layout,
            forms: forms_along(body, ground.frame()),
            gyroscopic: Gyroscopic::new(body, world.rotation(), world.time_step()),
            jacobian_pattern: SparsityPattern::new(),
            hessian_pattern: SparsityPattern::new(),
            step: StepData {
                state,
                wrench: Wrench::zero(),
                alpha: vec![0.0; n],
                compliance: 0.0,
                anchors: vec![Vector2::zeros(); n],
                attitude_rate: Matrix4x3::zeros(),
                old_positions: vec![Vector2::zeros(); n],
                spin_per_force: vec![Matrix3::zeros(); n],
            },
            world,
            ground,
        };
        // Patterns are those of the emitted entries at any point (section 5.2).
        nlp.set_step(&state, &Wrench::zero(), std::iter::repeat_n(0.0, n));
        let x = vec![0.0; layout.variables()];
        let y = vec![0.0; layout.constraints()];
        nlp.jacobian_pattern = PatternSink::collect(|sink| nlp.emit_jacobian(&x, sink));
        nlp.hessian_pattern = PatternSink::collect(|sink| nlp.emit_hessian(&x, 0.0, &y, sink));
        Ok(nlp)
    }

    /// Reason why the program does not support `world`, or `None`. The program supports one body of
    /// points without radius, the ground, and one coefficient of friction.
    pub fn unsuitable(world: &World) -> Option<&'static str> {
        let points = world.bodies()[BODY].contact_points();
        if !world.joints().is_empty() {
            Some("the tutorial's program does not support joints")
        } else if world.has_surfaces() {
            Some("the tutorial's program does not support moving surfaces")
        } else if world.bodies().len() > 1 {
            Some("the tutorial's program supports one body only")
        } else if world.ground().is_none() {
            Some(NO_GROUND)
        } else if world.fixed_count() > 0 {
            Some("the tutorial's program does not support fixed pieces")
        } else if points.iter().any(|point| point.size() > 0.0) {
            Some("the tutorial's program does not support rounded points")
        } else if world.friction_between(BODY, Partner::Ground) != world.friction() {
            Some("the tutorial's program supports only the world's coefficient of friction")
        } else if world.has_turning_friction() {
            Some("the tutorial's program does not support rolling and torsional resistance")
        } else if !world.friction_axes().is_empty() {
            Some("the tutorial's program does not support friction that depends on the direction")
        } else if world.has_adhesion() {
            Some("the tutorial's program does not support adhesion")
        } else if world.has_static_friction() {
            Some("the tutorial's program does not support static friction")
        } else if world.has_restitution() {
            Some("the tutorial's program does not support restitution")
        } else if !world.may_touch(BODY, Partner::Ground) {
            Some("the tutorial's program needs a body that may touch the ground")
        } else {
            None
        }
    }

    /// Sets the step's parameters: the state X at step k, the external wrench, and one contact flag
    /// α per contact point. Missing flags keep their values.
    pub fn set_step(
        &mut self,
        state: &State,
        wrench: &Wrench,
        alpha: impl IntoIterator<Item = f64>,
    ) {
        let h = self.world.time_step();
        let body = &self.world.bodies()[BODY];
        let frame = self.ground.frame();
        let position = state.position;
        let rotation = rotation(&state.attitude);
        let step = &mut self.step;
        step.state = *state;
        step.wrench = *wrench;
        step.attitude_rate = attitude_map(&state.attitude) * (0.5 * h);
        for (slot, flag) in step.alpha.iter_mut().zip(alpha) {
            *slot = flag;
        }
        for (slot, point) in step.old_positions.iter_mut().zip(body.contact_points()) {
            *slot = frame.tr_mul(&(position + rotation * point.position)).xy();
        }
        for (slot, point) in step.spin_per_force.iter_mut().zip(body.contact_points()) {
            let lever = point.position.cross_matrix();
            *slot = h * body.inertia_inverse() * lever * rotation.transpose() * frame;
        }
    }

    /// Makes friction compliant with κ = `share` h/m, (m/s)/N, about the anchor forces f_0 (N), one
    /// per contact point in the ground's frame.
    ///
    /// Sticking points leave internal friction forces undetermined and their rows (10) dependent.
    /// With κ > 0 both problems vanish, and a solution with f_xy = f_0 is one of the tutorial's
    /// rows. κ is 0 until this is called.
    pub fn anchor(&mut self, share: f64, forces: impl IntoIterator<Item = Vector3<f64>>) {
        self.step.compliance = share * self.world.time_step() / self.body().mass();
        for (slot, force) in self.step.anchors.iter_mut().zip(forces) {
            *slot = force.xy();
        }
    }

    /// World of the program.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Smoothing ε (N).
    pub fn smoothing(&self) -> f64 {
        self.smoothing
    }

    /// Factor of the rows of maximum dissipation.
    pub fn factor(&self) -> DissipationFactor {
        self.factor
    }

    /// Body of the program.
    fn body(&self) -> &RigidBody {
        &self.world.bodies()[BODY]
    }

    /// Ground frame F: tangents and normal as columns.
    fn frame(&self) -> &Matrix3<f64> {
        self.ground.frame()
    }

    /// Order of variables and rows.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Contact flags α of the current step.
    pub fn alpha(&self) -> &[f64] {
        &self.step.alpha
    }

    /// Structural non-zeros of the Jacobian, a 62 × 61 matrix for the cube.
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian_pattern
    }

    /// Structural non-zeros of the Hessian of the Lagrangian, lower triangle.
    pub fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian_pattern
    }

    /// Objective s1ᵀs1 + s2ᵀs2 at the point `x` (eq. 16). Its terms have different units, N²m² and
    /// W², and are all zero at a solution.
    pub fn objective(&self, x: &[f64]) -> f64 {
        let (s1, s2) = (self.layout.slack_1(), self.layout.slack_2());
        x[s1].iter().chain(&x[s2]).map(|s| s * s).sum()
    }

    /// Gradient of the objective at the point `x`, one number per variable.
    pub fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        for k in self.layout.slack_1().chain(self.layout.slack_2()) {
            gradient[k] = 2.0 * x[k];
        }
    }

    /// Writes all constraint rows at the point `x` in the layout's order.
    pub fn constraints(&self, x: &[f64], rows: &mut [f64]) {
        self.dynamics_rows(x, rows);
        let next = self.next_state(x);
        // Eq. 9.
        rows[layout::UNIT_NORM_ROW] = next.attitude.norm_squared() - 1.0;
        self.contact_rows(x, &next, rows);
    }

    /// Writes the Jacobian's values at the point `x` in the order of its pattern.
    pub fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        self.emit_jacobian(x, &mut ValueSink::new(values));
    }

    /// Writes the values of σ∇²f + Σ yⱼ∇²gⱼ at the point `x` in the order of its pattern. σ is the
    /// `objective_factor` and y the `multipliers`, one per row.
    pub fn hessian(
        &self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    ) {
        self.emit_hessian(x, objective_factor, multipliers, &mut ValueSink::new(values));
    }

    /// Writes the rows of the dynamics (eq. 8): the semi-implicit step minus X⁺.
    fn dynamics_rows(&self, x: &[f64], rows: &mut [f64]) {
        let (body, h) = (self.body(), self.world.time_step());
        let (old, next) = (&self.step.state, self.next_state(x));
        let mut force = self.step.wrench.force;
        let mut spin = next.spin - old.spin;
        for i in 0..self.layout.contacts() {
            let f = self.force(x, i);
            force += self.frame() * f;
            spin -= self.step.spin_per_force[i] * f;
        }
        let gyroscopic = self.gyroscopic.term(&old.spin, &next.spin);
        spin += h * (body.inertia_inverse() * (gyroscopic - self.step.wrench.torque));

        let position = old.position + h * next.velocity - next.position;
        let attitude = self.advanced_attitude(&next.spin).unit - next.attitude;
        let acceleration = force / body.mass() + self.world.gravity();
        let velocity = old.velocity + h * acceleration - next.velocity;
        rows[layout::POSITION_ROWS].copy_from_slice(position.as_slice());
        rows[layout::ATTITUDE_ROWS].copy_from_slice(attitude.as_slice());
        rows[layout::VELOCITY_ROWS].copy_from_slice(velocity.as_slice());
        rows[layout::SPIN_ROWS].copy_from_slice((-spin).as_slice());
    }

    /// Writes the rows of every contact (eqs. 10 and 12–15).
    fn contact_rows(&self, x: &[f64], next: &State, rows: &mut [f64]) {
        let friction = self.world.friction();
        let (layout, rotation) = (self.layout, rotation(&next.attitude));
        for (i, point) in self.body().contact_points().iter().enumerate() {
            let position = next.position + rotation * point.position;
            let position = self.frame().tr_mul(&position);
            let height = position[2] - self.ground.offset();
            let [_, _, fz, s1, s2, slip] = layout.contact_variables(i);
            let force = self.smooth_force(x, i);
            let sliding = self.dissipation(x, i, &force, &position.xy());
            let dissipation = self.dissipation_factor(x, i) * sliding;
            let room = friction * x[fz] - force.norm;

            let first = layout.dissipation_rows().start + 2 * i;
            rows[first..first + 2].copy_from_slice(dissipation.as_slice());
            rows[layout.height_rows().start + i] = height;
            rows[layout.cone_rows().start + i] = room;
            rows[layout.normal_complementarity_rows().start + i] = x[s1] - x[fz] * height;
            rows[layout.friction_complementarity_rows().start + i] = x[s2] - x[slip] * room;
        }
    }

    /// Rows (10) of contact i without their factor, with the point at `place` along the tangents (m).
    fn dissipation(
        &self,
        x: &[f64],
        i: usize,
        force: &SmoothForce,
        place: &Vector2<f64>,
    ) -> Vector2<f64> {
        let [.., slip] = self.layout.contact_variables(i);
        let slip_velocity = (place - self.step.old_positions[i]) / self.world.time_step();
        let yielding = self.step.compliance * (self.force(x, i).xy() - self.step.anchors[i]);
        slip_velocity + yielding + x[slip] * force.direction
    }

    /// Factor of the rows (10) of contact i.
    fn dissipation_factor(&self, x: &[f64], i: usize) -> f64 {
        let [_, _, fz, ..] = self.layout.contact_variables(i);
        match self.factor {
            DissipationFactor::Flag => self.step.alpha[i],
            DissipationFactor::Product => self.step.alpha[i] * x[fz],
        }
    }

    /// State X⁺ at the end of the step.
    fn next_state(&self, x: &[f64]) -> State {
        State::from_vector(&SVector::from_column_slice(&x[layout::STATE]))
    }

    /// Force f_i in the ground's frame.
    fn force(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let [fx, fy, fz, ..] = self.layout.contact_variables(i);
        Vector3::new(x[fx], x[fy], x[fz])
    }

    /// Tangential force f_xy,i with the smoothed norm.
    fn smooth_force(&self, x: &[f64], i: usize) -> SmoothForce {
        SmoothForce::new(self.force(x, i).xy(), self.smoothing)
    }

    /// Attitude at the end of the step for the spin ω⁺ (eq. 8b): q + ½ h L(q) H γ ω⁺, normalised.
    fn advanced_attitude(&self, spin: &Vector3<f64>) -> Normalised {
        let stretched = self.world.step_map().stretched(spin);
        Normalised::new(self.step.state.attitude + self.step.attitude_rate * stretched)
    }
}

/// Quadratic forms of every contact point c along the columns j of `frame` F (eq. 3). They are
/// Σ_k F_kj Q_k, so that (Fᵀ A(q) c)_j = ½ qᵀ (Σ_k F_kj Q_k) q.
fn forms_along(body: &RigidBody, frame: &Matrix3<f64>) -> Vec<[Matrix4<f64>; 3]> {
    let along = |forms: &[Matrix4<f64>; 3], j: usize| -> Matrix4<f64> {
        forms.iter().enumerate().map(|(k, form)| form * frame[(k, j)]).sum()
    };
    let points = body.contact_points().iter();
    let of_point = |point: &ContactPoint| {
        let forms = rotated_point_forms(&point.position);
        [0, 1, 2].map(|j| along(&forms, j))
    };
    points.map(of_point).collect()
}
