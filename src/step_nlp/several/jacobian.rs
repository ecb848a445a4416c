//! The Jacobian of the program of several bodies.

use super::component::MotionComponent;
use super::touch::ProgramSide;
use super::{Friction, SeveralNlp};
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{
    ATTITUDE, ATTITUDE_ROWS, POSITION, POSITION_ROWS, SPIN, SPIN_ROWS, VELOCITY, VELOCITY_ROWS,
};
use nalgebra::Matrix2;

impl SeveralNlp {
    /// Emits all entries. The pattern depends on the step alone, never on x.
    pub(super) fn emit_jacobian(&self, x: &[f64], sink: &mut impl EntrySink) {
        for body in 0..self.members.len() {
            self.emit_motion_rows(x, body, sink);
        }
        for (i, touch) in self.touches.iter().enumerate() {
            for side in touch.sides() {
                self.emit_forces(i, side, sink);
            }
        }
        for i in 0..self.touches.len() {
            self.emit_normal_rows(x, i, sink);
            if let Some(friction) = self.layout.friction(i) {
                self.emit_friction_rows(x, i, friction, sink);
            }
        }
    }

    /// Emits eq. 8 of one body with respect to its X⁺, as in the tutorial's program.
    fn emit_motion_rows(&self, x: &[f64], body: usize, sink: &mut impl EntrySink) {
        let (member, first, h) =
            (&self.members[body], self.layout.state(body).start, self.time_step);
        let next = self.next_state(x, body);
        let by_spin = member.advanced_attitude(&next.spin).jacobian() * member.attitude_rate;
        for k in 0..3 {
            let row = first + POSITION_ROWS.start + k;
            sink.put(row, first + POSITION.start + k, -1.0);
            sink.put(row, first + VELOCITY.start + k, h);
            sink.put(first + VELOCITY_ROWS.start + k, first + VELOCITY.start + k, -1.0);
        }
        for k in 0..4 {
            let row = first + ATTITUDE_ROWS.start + k;
            sink.put(row, first + ATTITUDE.start + k, -1.0);
            sink.put_row(row, first + SPIN.start, by_spin.row(k).iter().copied());
        }
        let by_spin = -h * member.gyroscopic.slope(&next.spin);
        for k in 0..3 {
            for j in 0..3 {
                let (row, column) = (first + SPIN_ROWS.start + k, first + SPIN.start + j);
                if j == k {
                    sink.put(row, column, by_spin[(k, j)] - 1.0);
                } else if member.gyroscopic.depends(k, j) {
                    sink.put(row, column, by_spin[(k, j)]);
                }
            }
        }
    }

    /// Emits eqs. 8c and 8d of one side of a contact with respect to its force (eq. D5).
    fn emit_forces(&self, i: usize, side: &ProgramSide, sink: &mut impl EntrySink) {
        let first = self.layout.state(side.body).start;
        let normal = self.layout.normal(i).first;
        let tangential = self.layout.friction(i).map(|friction| friction.force);
        for (axis, column) in tangential.into_iter().flatten().chain([normal]).enumerate() {
            let axis = if tangential.is_some() { axis } else { 2 };
            for k in 0..3 {
                let share = side.velocity_per_force[(k, axis)];
                if share != 0.0 {
                    sink.put(first + VELOCITY_ROWS.start + k, column, share);
                }
                if side.spin_per_force.row(k).amax() > 0.0 {
                    let share = side.spin_per_force[(k, axis)];
                    sink.put(first + SPIN_ROWS.start + k, column, share);
                }
            }
        }
    }

    /// Emits φ⁺ and s1 − f_n φ⁺ of a contact.
    fn emit_normal_rows(&self, x: &[f64], i: usize, sink: &mut impl EntrySink) {
        let (of, row) = (self.layout.normal(i), self.layout.normal_rows(i));
        let touch = &self.touches[i];
        let gap = match touch.bounces() {
            true => self.rebounded(x, i),
            false => touch.gap(&touch.component(2, self.places(x, i))),
        };
        self.emit_gap(x, i, row.first, 1.0, sink);
        self.emit_gap(x, i, row.second, -x[of.first], sink);
        sink.put(row.second, of.first, -gap);
        sink.put(row.second, of.second, 1.0);
    }

    /// Emits `factor` times the derivatives of φ⁺ in `row`, or of its replacement for a bouncing
    /// contact. The row belongs to a constraint or to the Hessian's f_n.
    pub(super) fn emit_gap(
        &self,
        x: &[f64],
        i: usize,
        row: usize,
        factor: f64,
        sink: &mut impl EntrySink,
    ) {
        let touch = &self.touches[i];
        if !touch.bounces() {
            let component = touch.component(2, self.places(x, i));
            return self.emit_motion(i, 2, &component, row, factor, sink);
        }
        let factor = factor * self.time_step;
        for side in touch.sides() {
            let first = self.layout.state(side.body).start;
            let spin = self.next_state(x, side.body).spin;
            let slope = self.members[side.body].gyroscopic.departing_slope(&spin);
            let by_spin = slope.tr_mul(&side.lever);
            for k in 0..3 {
                sink.put(row, first + VELOCITY.start + k, factor * side.sign * touch.normal[k]);
                sink.put(row, first + SPIN.start + k, factor * by_spin[k]);
            }
        }
    }

    /// Emits maximum dissipation, cone and friction complementarity of a contact, as in the
    /// tutorial's program.
    fn emit_friction_rows(
        &self,
        x: &[f64],
        i: usize,
        friction: Friction,
        sink: &mut impl EntrySink,
    ) {
        let Some(row) = self.layout.friction_rows(i) else { return };
        let (touch, at) = (&self.touches[i], self.places(x, i));
        let (normal, mu) = (self.layout.normal(i).first, touch.friction);
        let force = self.smooth_force(x, friction);
        let slip_speed = x[friction.slip_speed];
        let yielding = Matrix2::from_diagonal_element(self.yielding[i].0);
        let by_force = force.direction_jacobian() * slip_speed + yielding;
        for axis in 0..2 {
            let (row, component) = (row.dissipation + axis, touch.component(axis, at));
            self.emit_motion(i, axis, &component, row, 1.0 / self.time_step, sink);
            for side in touch.sides() {
                let Some(rolling) = &side.rolling else { continue };
                let first = self.layout.state(side.body).start + SPIN.start;
                sink.put_row(row, first, rolling.row(axis).iter().copied());
            }
            sink.put(row, friction.force[0], by_force[(axis, 0)]);
            sink.put(row, friction.force[1], by_force[(axis, 1)]);
            sink.put(row, friction.slip_speed, force.direction[axis]);
        }
        for (column, d) in friction.force.into_iter().zip(&force.direction) {
            sink.put(row.cone, column, -d);
            sink.put(row.complementarity, column, slip_speed * d);
        }
        sink.put(row.cone, normal, mu);
        sink.put(row.complementarity, normal, -mu * slip_speed);
        sink.put(row.complementarity, friction.slack, 1.0);
        sink.put(row.complementarity, friction.slip_speed, force.norm - mu * x[normal]);
    }

    /// Emits `factor` times the derivatives of a component of the contact's motion (eq. D7) in
    /// `row`. The row belongs to a constraint or to the Hessian's f_n.
    pub(super) fn emit_motion(
        &self,
        i: usize,
        axis: usize,
        component: &MotionComponent,
        row: usize,
        factor: f64,
        sink: &mut impl EntrySink,
    ) {
        let touch = &self.touches[i];
        let first = self.layout.state(touch.a.body).start;
        for k in (0..3).filter(|&k| touch.moves(axis, k)) {
            sink.put(row, first + POSITION.start + k, factor * component.by_position[k]);
        }
        for k in (0..4).filter(|&k| touch.turns(axis, k)) {
            sink.put(row, first + ATTITUDE.start + k, factor * component.by_a[k]);
        }
        let Some(b) = &touch.b else { return };
        let first = self.layout.state(b.body).start;
        let (by_position, by_attitude) = (&component.by_position, &component.by_b);
        sink.put_row(row, first + POSITION.start, by_position.iter().map(|slope| -factor * slope));
        sink.put_row(row, first + ATTITUDE.start, by_attitude.iter().map(|slope| factor * slope));
    }
}
