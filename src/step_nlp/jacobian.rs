//! The Jacobian of the constraints, ∂g/∂x.

use super::entries::EntrySink;
use super::layout::{
    ATTITUDE, ATTITUDE_ROWS, POSITION, POSITION_ROWS, SPIN, SPIN_ROWS, UNIT_NORM_ROW, VELOCITY,
    VELOCITY_ROWS,
};
use super::{DissipationFactor, StepNlp};

use nalgebra::{Matrix2, Matrix3, Vector4};
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::rotation;

impl StepNlp {
    /// Emits all entries by row blocks. The pattern depends on the model alone, never on x or the
    /// step.
    pub(super) fn emit_jacobian(&self, x: &[f64], sink: &mut impl EntrySink) {
        let next = self.next_state(x);
        self.emit_position_rows(sink);
        self.emit_attitude_rows(&next, sink);
        self.emit_velocity_rows(sink);
        self.emit_spin_rows(&next, sink);
        // Eq. 9: ∂(‖q⁺‖² − 1)/∂q⁺ = 2 q⁺ᵀ.
        sink.put_row(UNIT_NORM_ROW, ATTITUDE.start, next.attitude.iter().map(|q| 2.0 * q));
        for i in 0..self.layout.contacts() {
            self.emit_dissipation_rows(x, &next, i, sink);
            self.emit_height_row(&next, i, sink);
            self.emit_cone_row(x, i, sink);
            self.emit_normal_complementarity_row(x, &next, i, sink);
            self.emit_friction_complementarity_row(x, i, sink);
        }
    }

    /// Emits eq. 8a: r + h v⁺ − r⁺.
    fn emit_position_rows(&self, sink: &mut impl EntrySink) {
        for k in 0..3 {
            let row = POSITION_ROWS.start + k;
            sink.put(row, POSITION.start + k, -1.0);
            sink.put(row, VELOCITY.start + k, self.world.time_step());
        }
    }

    /// Emits eq. 8b: u(p) − q⁺ with p = q + B γ ω⁺, B = ½ h L(q) H: ∂/∂ω⁺ = ∂u/∂p B ∂(γ ω⁺)/∂ω⁺ (eqs. D1 and D12).
    fn emit_attitude_rows(&self, next: &State, sink: &mut impl EntrySink) {
        let stretch = self.world.step_map().stretch(&next.spin).slope(&next.spin);
        let by_spin =
            self.advanced_attitude(&next.spin).jacobian() * self.step.attitude_rate * stretch;
        for k in 0..4 {
            let row = ATTITUDE_ROWS.start + k;
            sink.put(row, ATTITUDE.start + k, -1.0);
            sink.put_row(row, SPIN.start, by_spin.row(k).iter().copied());
        }
    }

    /// Emits eq. 8c: v + h (Σ F f/m + g) − v⁺.
    fn emit_velocity_rows(&self, sink: &mut impl EntrySink) {
        let per_force = self.world.time_step() / self.body().mass();
        for k in 0..3 {
            let row = VELOCITY_ROWS.start + k;
            sink.put(row, VELOCITY.start + k, -1.0);
            for i in 0..self.layout.contacts() {
                for (axis, col) in self.layout.contact_variables(i)[..3].iter().enumerate() {
                    let share = self.frame()[(k, axis)];
                    if share != 0.0 {
                        sink.put(row, *col, per_force * share);
                    }
                }
            }
        }
    }

    /// Emits eq. 8d: ω + h I⁻¹ (τ − G(ω, ω⁺)) − ω⁺. ∂/∂ω⁺ = −E − h I⁻¹ ∂G/∂ω⁺ (eq. D6); ∂/∂f_i = h
    /// I⁻¹ [c_i]× Aᵀ F (eq. D5).
    fn emit_spin_rows(&self, next: &State, sink: &mut impl EntrySink) {
        let by_spin = -self.world.time_step() * self.gyroscopic.slope(&next.spin);
        for k in 0..3 {
            let row = SPIN_ROWS.start + k;
            for j in 0..3 {
                if j == k {
                    sink.put(row, SPIN.start + j, by_spin[(k, j)] - 1.0);
                } else if self.gyroscopic.depends(k, j) {
                    sink.put(row, SPIN.start + j, by_spin[(k, j)]);
                }
            }
            for (i, point) in self.body().contact_points().iter().enumerate() {
                let lever: Matrix3<f64> =
                    self.body().inertia_inverse() * point.position.cross_matrix();
                if lever.row(k).amax() > 0.0 {
                    for (axis, col) in self.layout.contact_variables(i)[..3].iter().enumerate() {
                        sink.put(row, *col, self.step.spin_per_force[i][(k, axis)]);
                    }
                }
            }
        }
    }

    /// Emits the rows (10) with the derivatives (3) and (D3):
    ///
    /// ```text
    /// g = α (c_xy + κ (f_xy − f_0) + λ d(f_xy)),   c_xy = (r⁺ + A(q⁺) c − C)_xy/h
    /// ∂g/∂r⁺ = α/h,   ∂g/∂q⁺ = α (Q_k q⁺)ᵀ/h,   ∂g/∂f_xy = α (κ E + λ D),   ∂g/∂λ = α d
    /// ```
    ///
    /// The variant with a product has α f_z for α, and ∂g/∂f_z = g/f_z.
    fn emit_dissipation_rows(&self, x: &[f64], next: &State, i: usize, sink: &mut impl EntrySink) {
        let [fx, fy, fz, _, _, slip] = self.layout.contact_variables(i);
        let force = self.smooth_force(x, i);
        let compliance = Matrix2::identity() * self.step.compliance;
        let by_force = compliance + force.direction_jacobian() * x[slip];
        let factor = self.dissipation_factor(x, i);
        let rate = factor / self.world.time_step();
        let place =
            next.position + rotation(&next.attitude) * self.body().contact_points()[i].position;
        let sliding = self.dissipation(x, i, &force, &self.frame().tr_mul(&place).xy());
        for axis in 0..2 {
            let row = self.layout.dissipation_rows().start + 2 * i + axis;
            self.emit_position_gradient(axis, row, rate, sink);
            self.emit_attitude_gradient(next, i, axis, row, rate, sink);
            sink.put(row, fx, factor * by_force[(axis, 0)]);
            sink.put(row, fy, factor * by_force[(axis, 1)]);
            if self.factor == DissipationFactor::Product {
                sink.put(row, fz, self.step.alpha[i] * sliding[axis]);
            }
            sink.put(row, slip, factor * force.direction[axis]);
        }
    }

    /// Emits eq. 12: z⁺ = (r⁺ + A(q⁺) c)_z.
    fn emit_height_row(&self, next: &State, i: usize, sink: &mut impl EntrySink) {
        let row = self.layout.height_rows().start + i;
        self.emit_position_gradient(2, row, 1.0, sink);
        self.emit_attitude_gradient(next, i, 2, row, 1.0, sink);
    }

    /// Emits eq. 13: μ f_z − ‖f_xy‖_ε.
    fn emit_cone_row(&self, x: &[f64], i: usize, sink: &mut impl EntrySink) {
        let row = self.layout.cone_rows().start + i;
        let [fx, fy, fz, ..] = self.layout.contact_variables(i);
        let d = self.smooth_force(x, i).direction;
        sink.put(row, fx, -d[0]);
        sink.put(row, fy, -d[1]);
        if self.world.friction() > 0.0 {
            sink.put(row, fz, self.world.friction());
        }
    }

    /// Emits eq. 14: s1 − f_z z⁺.
    fn emit_normal_complementarity_row(
        &self,
        x: &[f64],
        next: &State,
        i: usize,
        sink: &mut impl EntrySink,
    ) {
        let row = self.layout.normal_complementarity_rows().start + i;
        let [_, _, fz, s1, ..] = self.layout.contact_variables(i);
        let (form, ground) = (&self.forms[i][2], &self.ground);
        let centre = ground.normal().dot(&next.position) - ground.offset();
        let height = centre + 0.5 * next.attitude.dot(&(form * next.attitude));
        self.emit_position_gradient(2, row, -x[fz], sink);
        self.emit_attitude_gradient(next, i, 2, row, -x[fz], sink);
        sink.put(row, fz, -height);
        sink.put(row, s1, 1.0);
    }

    /// Emits eq. 15: s2 − λ (μ f_z − ‖f_xy‖_ε).
    fn emit_friction_complementarity_row(&self, x: &[f64], i: usize, sink: &mut impl EntrySink) {
        let row = self.layout.friction_complementarity_rows().start + i;
        let [fx, fy, fz, _, s2, slip] = self.layout.contact_variables(i);
        let force = self.smooth_force(x, i);
        let friction = self.world.friction();
        sink.put(row, fx, x[slip] * force.direction[0]);
        sink.put(row, fy, x[slip] * force.direction[1]);
        if friction > 0.0 {
            sink.put(row, fz, -friction * x[slip]);
        }
        sink.put(row, s2, 1.0);
        sink.put(row, slip, force.norm - friction * x[fz]);
    }

    /// Emits `factor` times ∂(Fᵀ r⁺)_axis/∂r⁺ in `row`: column `axis` of F.
    pub(super) fn emit_position_gradient(
        &self,
        axis: usize,
        row: usize,
        factor: f64,
        sink: &mut impl EntrySink,
    ) {
        for (k, share) in self.frame().column(axis).iter().enumerate() {
            if *share != 0.0 {
                sink.put(row, POSITION.start + k, factor * share);
            }
        }
    }

    /// Emits `factor` times ∂(Fᵀ A(q⁺) c_i)_axis/∂q⁺ = (Q_axis q⁺)ᵀ (eq. 3) in `row`. A contact
    /// point at the centre of mass has no such entries.
    pub(super) fn emit_attitude_gradient(
        &self,
        next: &State,
        i: usize,
        axis: usize,
        row: usize,
        factor: f64,
        sink: &mut impl EntrySink,
    ) {
        let form = &self.forms[i][axis];
        let gradient: Vector4<f64> = form * next.attitude;
        for k in 0..4 {
            if form.row(k).amax() > 0.0 {
                sink.put(row, ATTITUDE.start + k, factor * gradient[k]);
            }
        }
    }
}
