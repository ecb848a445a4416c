//! The Hessian of the Lagrangian, σ∇²f + Σ yⱼ∇²gⱼ, lower triangle.
//!
//! It couples three groups of variables: q⁺ with itself, ω⁺ with itself, and the six variables of
//! each contact with themselves, r⁺_z and q⁺, in the variant with a product also r⁺. Position and
//! velocity rows are linear. Below, α is the factor of the rows (10).

use super::entries::EntrySink;
use super::layout::{ATTITUDE, ATTITUDE_ROWS, POSITION, SPIN, SPIN_ROWS, UNIT_NORM_ROW};
use super::{DissipationFactor, StepNlp};
use nalgebra::{Matrix3, Matrix4, Vector2, Vector3, Vector4};
use tumble_core::mechanics::State;

/// Multipliers of one contact's rows.
struct ContactMultipliers {
    dissipation: Vector2<f64>,
    height: f64,
    cone: f64,
    normal: f64,
    friction: f64,
}

impl StepNlp {
    /// Emits all entries. The pattern depends on the model alone.
    pub(super) fn emit_hessian(
        &self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        sink: &mut impl EntrySink,
    ) {
        let next = self.next_state(x);
        self.emit_attitude_block(x, multipliers, sink);
        self.emit_spin_block(&next, multipliers, sink);
        for i in 0..self.layout.contacts() {
            let y = self.contact_multipliers(multipliers, i);
            self.emit_force_block(x, &y, i, sink);
            self.emit_normal_block(x, &next, &y, i, sink);
            self.emit_slip_row(x, &y, i, sink);
            // Eq. 16: ∇²(s1² + s2²) = 2.
            let [_, _, _, s1, s2, _] = self.layout.contact_variables(i);
            sink.put(s1, s1, 2.0 * objective_factor);
            sink.put(s2, s2, 2.0 * objective_factor);
        }
    }

    /// Emits q⁺ × q⁺: 2 y E of eq. 9, and the constant forms Q_k of eq. 3 weighted with the
    /// multipliers of eqs. 10 (times α/h), 12 and 14 (times −f_z).
    fn emit_attitude_block(&self, x: &[f64], multipliers: &[f64], sink: &mut impl EntrySink) {
        let h = self.world.time_step();
        let mut block = Matrix4::identity() * (2.0 * multipliers[UNIT_NORM_ROW]);
        let mut present = Matrix4::<f64>::identity();
        for (i, forms) in self.forms.iter().enumerate() {
            let y = self.contact_multipliers(multipliers, i);
            let slip = y.dissipation * (self.dissipation_factor(x, i) / h);
            let fz = x[self.layout.contact_variables(i)[2]];
            let weights = [slip[0], slip[1], y.height - y.normal * fz];
            for (form, weight) in forms.iter().zip(weights) {
                block += form * weight;
                present += form.abs();
            }
        }
        for row in 0..4 {
            for col in 0..=row {
                if present[(row, col)] > 0.0 {
                    let (row_index, col_index) = (ATTITUDE.start + row, ATTITUDE.start + col);
                    sink.put(row_index, col_index, block[(row, col)]);
                }
            }
        }
    }

    /// Emits ω⁺ × ω⁺: ∇²(y·u) of eq. 8b (eqs. D2 and D12) and −h ∇²(y·I⁻¹ G) of eq. 8d (eqs. D6 and D11).
    fn emit_spin_block(&self, next: &State, multipliers: &[f64], sink: &mut impl EntrySink) {
        let y = Vector4::from_column_slice(&multipliers[ATTITUDE_ROWS]);
        let b = &self.step.attitude_rate;
        let map = self.world.step_map();
        let advanced = self.advanced_attitude(&next.spin);
        let stretched = b * map.stretch(&next.spin).slope(&next.spin);
        let mut block: Matrix3<f64> = stretched.transpose() * advanced.hessian(y) * stretched;
        block += map.stretch_curvature(&next.spin, &b.tr_mul(&(advanced.jacobian() * y)));
        let y = Vector3::from_column_slice(&multipliers[SPIN_ROWS]);
        block -= self.gyroscopic.curvature(&y, &next.spin) * self.world.time_step();
        sink.put_lower(SPIN.start, &block);
    }

    /// Emits f_xy × f_xy: α λ ∇²(y·d) of eq. 10 (eq. D4), −y D of eq. 13 and y λ D of eq. 15 (eq.
    /// D3).
    fn emit_force_block(
        &self,
        x: &[f64],
        y: &ContactMultipliers,
        i: usize,
        sink: &mut impl EntrySink,
    ) {
        let [fx, fy, _, _, _, slip] = self.layout.contact_variables(i);
        let force = self.smooth_force(x, i);
        let factor = self.dissipation_factor(x, i);
        let block = force.direction_hessian(y.dissipation) * (factor * x[slip])
            + force.direction_jacobian() * (y.friction * x[slip] - y.cone);
        sink.put(fx, fx, block[(0, 0)]);
        sink.put(fy, fx, block[(1, 0)]);
        sink.put(fy, fy, block[(1, 1)]);
    }

    /// Emits f_z × (r⁺_z, q⁺): −y ∂z⁺ of eq. 14. With a product it has α y·∂(g/α f_z) of eq. 10 as well,
    /// with r⁺, q⁺, f_x and f_y.
    fn emit_normal_block(
        &self,
        x: &[f64],
        next: &State,
        y: &ContactMultipliers,
        i: usize,
        sink: &mut impl EntrySink,
    ) {
        let [fx, fy, fz, _, _, slip] = self.layout.contact_variables(i);
        if self.factor == DissipationFactor::Flag {
            self.emit_position_gradient(2, fz, -y.normal, sink);
            self.emit_attitude_gradient(next, i, 2, fz, -y.normal, sink);
            return;
        }
        let along = y.dissipation * self.step.alpha[i];
        let rate = along / self.world.time_step();
        let weights = Vector3::new(rate[0], rate[1], -y.normal);
        sink.put_row(fz, POSITION.start, (self.frame() * weights).iter().copied());
        let forms = || self.forms[i].iter();
        let form: Matrix4<f64> = forms().zip(&weights).map(|(form, weight)| form * *weight).sum();
        let gradient = form * next.attitude;
        for k in 0..4 {
            if forms().any(|form| form.row(k).amax() > 0.0) {
                sink.put(fz, ATTITUDE.start + k, gradient[k]);
            }
        }
        let force = self.smooth_force(x, i);
        let by_force = force.direction_jacobian() * along * x[slip] + along * self.step.compliance;
        sink.put(fz, fx, by_force[0]);
        sink.put(fz, fy, by_force[1]);
    }

    /// Emits λ × (f_x, f_y, f_z): α D y of eq. 10, with a product y·d too, and y d and −y μ of eq. 15.
    fn emit_slip_row(
        &self,
        x: &[f64],
        y: &ContactMultipliers,
        i: usize,
        sink: &mut impl EntrySink,
    ) {
        let [fx, fy, fz, _, _, slip] = self.layout.contact_variables(i);
        let force = self.smooth_force(x, i);
        let by_force = force.direction_jacobian() * y.dissipation * self.dissipation_factor(x, i)
            + force.direction * y.friction;
        sink.put(slip, fx, by_force[0]);
        sink.put(slip, fy, by_force[1]);
        let by_product = match self.factor {
            DissipationFactor::Flag => 0.0,
            DissipationFactor::Product => self.step.alpha[i] * y.dissipation.dot(&force.direction),
        };
        if self.world.friction() > 0.0 || self.factor == DissipationFactor::Product {
            sink.put(slip, fz, by_product - y.friction * self.world.friction());
        }
    }

    fn contact_multipliers(&self, multipliers: &[f64], i: usize) -> ContactMultipliers {
        let layout = self.layout;
        let first = layout.dissipation_rows().start + 2 * i;
        ContactMultipliers {
            dissipation: Vector2::new(multipliers[first], multipliers[first + 1]),
            height: multipliers[layout.height_rows().start + i],
            cone: multipliers[layout.cone_rows().start + i],
            normal: multipliers[layout.normal_complementarity_rows().start + i],
            friction: multipliers[layout.friction_complementarity_rows().start + i],
        }
    }
}
