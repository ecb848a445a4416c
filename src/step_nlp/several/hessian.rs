//! The Hessian of the Lagrangian of the program of several bodies, lower triangle.
//!
//! Its blocks (eq. D9):
//!
//! - q⁺ and ω⁺ of a body with themselves;
//! - r⁺ with q⁺ of a body whose plane is touched, and both with themselves for round features;
//! - the poses of two touching bodies with each other;
//! - the variables of a contact with themselves and with the poses of its bodies.

use super::SeveralNlp;
use super::component::Curvature;
use crate::step_nlp::entries::EntrySink;
use crate::step_nlp::layout::{ATTITUDE, ATTITUDE_ROWS, POSITION, SPIN, SPIN_ROWS};
use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector2, Vector3, Vector4};

/// Second derivatives of two touching bodies i < j with respect to each other's poses.
struct BodyPair {
    bodies: (usize, usize),
    /// Block q_j × q_i.
    turning: Matrix4<f64>,
    /// Block r_i × q_j if a plane of j is touched, and r_j × q_i if a plane of i is touched. Round
    /// features need both.
    first_moves: Option<Matrix3x4<f64>>,
    second_moves: Option<Matrix3x4<f64>>,
    /// Block r_j × r_i for round features.
    positions: Option<Matrix3<f64>>,
}

/// Blocks q × q, r × q and r × r of a body.
#[derive(Default, Clone, Copy)]
struct OwnCurvature {
    turning: Matrix4<f64>,
    moving: Matrix3x4<f64>,
    positions: Matrix3<f64>,
}

/// Pose blocks of all bodies and pairs.
struct HessianPoses {
    bodies: Vec<OwnCurvature>,
    /// Body pairs in ascending order.
    pairs: Vec<BodyPair>,
}

impl SeveralNlp {
    /// Emits all entries. The pattern depends on the step alone.
    pub(super) fn emit_hessian(
        &self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        sink: &mut impl EntrySink,
    ) {
        self.emit_poses(&self.poses(x, multipliers), sink);
        for body in 0..self.members.len() {
            self.emit_spin_block(x, multipliers, body, sink);
        }
        for i in 0..self.touches.len() {
            let (of, row) = (self.layout.normal(i), self.layout.normal_rows(i));
            // f_n × poses: −y ∂φ⁺ of s1 − f_n φ⁺.
            self.emit_gap(x, i, of.first, -multipliers[row.second], sink);
            // Eqs. 16 and 27: ∇²(s1² + s2²) = 2, and 2 σ.
            sink.put(of.first, of.first, 2.0 * self.stiffness * objective_factor);
            sink.put(of.second, of.second, 2.0 * objective_factor);
            self.emit_friction_block(x, objective_factor, multipliers, i, sink);
        }
    }

    /// Curvatures (eq. D8) of slips and gaps, weighted with the multipliers of their rows: eq. 10
    /// over h, the gap, and s1 − f_n φ⁺ times −f_n.
    fn poses(&self, x: &[f64], multipliers: &[f64]) -> HessianPoses {
        let bodies = vec![OwnCurvature::default(); self.members.len()];
        let mut poses = HessianPoses { bodies, pairs: self.pairs() };
        for (i, touch) in self.touches.iter().enumerate() {
            let (at, row) = (self.places(x, i), self.layout.normal_rows(i));
            let force = x[self.layout.normal(i).first];
            let along = match touch.bounces() {
                true => 0.0,
                false => multipliers[row.first] - multipliers[row.second] * force,
            };
            let across = self.layout.friction_rows(i).map_or([0.0; 2], |row| {
                [0, 1].map(|axis| multipliers[row.dissipation + axis] / self.time_step)
            });
            for (axis, weight) in [across[0], across[1], along].into_iter().enumerate() {
                let curvature = touch.curvature(axis, at);
                let (a, b) = (touch.a.body, touch.b.as_ref().map(|b| b.body));
                poses.add(a, b, &curvature, weight);
            }
        }
        poses
    }

    /// Pairs of touching bodies with zero blocks.
    fn pairs(&self) -> Vec<BodyPair> {
        let mut pairs: Vec<BodyPair> = Vec::new();
        for touch in &self.touches {
            let (a, Some(b)) = (touch.a.body, touch.b.as_ref().map(|b| b.body)) else { continue };
            let is_round = touch.is_round();
            let bodies = (a.min(b), a.max(b));
            let place = pairs.binary_search_by(|pair| pair.bodies.cmp(&bodies));
            let place = place.unwrap_or_else(|place| {
                let pair = BodyPair {
                    bodies,
                    turning: Matrix4::zeros(),
                    first_moves: None,
                    second_moves: None,
                    positions: None,
                };
                pairs.insert(place, pair);
                place
            });
            let pair = &mut pairs[place];
            if a < b || is_round {
                pair.first_moves = Some(Matrix3x4::zeros());
            }
            if a > b || is_round {
                pair.second_moves = Some(Matrix3x4::zeros());
            }
            if is_round {
                pair.positions = Some(Matrix3::zeros());
            }
        }
        pairs
    }

    fn emit_poses(&self, poses: &HessianPoses, sink: &mut impl EntrySink) {
        let at = |body: usize| self.layout.state(body).start;
        for (body, own) in poses.bodies.iter().enumerate() {
            let (position, attitude) = (at(body) + POSITION.start, at(body) + ATTITUDE.start);
            sink.put_lower(attitude, &own.turning);
            if self.members[body].holds {
                sink.put_block(attitude, position, &own.moving.transpose());
            }
            if self.members[body].is_round {
                sink.put_lower(position, &own.positions);
            }
        }
        for pair in &poses.pairs {
            let (i, j) = (at(pair.bodies.0), at(pair.bodies.1));
            sink.put_block(j + ATTITUDE.start, i + ATTITUDE.start, &pair.turning);
            if let Some(moving) = &pair.first_moves {
                sink.put_block(j + ATTITUDE.start, i + POSITION.start, &moving.transpose());
            }
            if let Some(moving) = &pair.second_moves {
                sink.put_block(j + POSITION.start, i + ATTITUDE.start, moving);
            }
            if let Some(positions) = &pair.positions {
                sink.put_block(j + POSITION.start, i + POSITION.start, positions);
            }
        }
    }

    /// Factor of ω̃⁺ of a body in the rows of its bouncing contacts (eq. 25d).
    fn rebound_weights(&self, x: &[f64], multipliers: &[f64], body: usize) -> Vector3<f64> {
        let mut weights = Vector3::zeros();
        for (i, touch) in self.touches.iter().enumerate().filter(|(_, touch)| touch.bounces()) {
            let (of, row) = (self.layout.normal(i), self.layout.normal_rows(i));
            let weight = multipliers[row.first] - multipliers[row.second] * x[of.first];
            for side in touch.sides().filter(|side| side.body == body) {
                weights += side.lever * (weight * self.time_step);
            }
        }
        weights
    }

    /// Emits ω⁺ × ω⁺ of a body: Bᵀ ∇²(y·u) B of eq. 8b (eq. D2) and −h ∇²(y·I⁻¹ G) of eq. 8d (eq.
    /// D6).
    fn emit_spin_block(
        &self,
        x: &[f64],
        multipliers: &[f64],
        body: usize,
        sink: &mut impl EntrySink,
    ) {
        let (member, range) = (&self.members[body], self.layout.state(body));
        let (first, own) = (range.start, &multipliers[range]);
        let y = Vector4::from_column_slice(&own[ATTITUDE_ROWS]);
        let (b, spin) = (&member.attitude_rate, self.next_state(x, body).spin);
        let mut block: Matrix3<f64> =
            b.transpose() * member.advanced_attitude(&spin).hessian(y) * b;
        let y = Vector3::from_column_slice(&own[SPIN_ROWS]);
        block -= member.gyroscopic.curvature(&y, &spin) * self.time_step;
        let y = self.rebound_weights(x, multipliers, body);
        block += member.gyroscopic.departing_curvature(&y, &spin);
        sink.put_lower(first + SPIN.start, &block);
    }

    /// Emits the friction variables of a contact with each other and with f_n, as in the tutorial's
    /// program.
    fn emit_friction_block(
        &self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        i: usize,
        sink: &mut impl EntrySink,
    ) {
        let (Some(of), Some(row)) = (self.layout.friction(i), self.layout.friction_rows(i)) else {
            return;
        };
        let y = Vector2::new(multipliers[row.dissipation], multipliers[row.dissipation + 1]);
        let (cone, complementarity) = (multipliers[row.cone], multipliers[row.complementarity]);
        let (force, slip_speed) = (self.smooth_force(x, of), x[of.slip_speed]);
        let block = force.direction_hessian(y) * slip_speed
            + force.direction_jacobian() * (complementarity * slip_speed - cone);
        let [t1, t2] = of.force;
        sink.put(t1, t1, block[(0, 0)]);
        sink.put(t2, t1, block[(1, 0)]);
        sink.put(t2, t2, block[(1, 1)]);
        let by_force = force.direction_jacobian() * y + force.direction * complementarity;
        sink.put(of.slip_speed, t1, by_force[0]);
        sink.put(of.slip_speed, t2, by_force[1]);
        let normal = self.layout.normal(i).first;
        sink.put(of.slip_speed, normal, -complementarity * self.touches[i].friction);
        sink.put(of.slack, of.slack, 2.0 * objective_factor);
    }
}

impl HessianPoses {
    /// Adds `weight` times the curvature of a motion component of a contact between A and B.
    fn add(&mut self, a: usize, b: Option<usize>, curvature: &Curvature, weight: f64) {
        let own = &mut self.bodies[a];
        own.turning += curvature.aa * weight;
        own.moving += curvature.position_a * weight;
        own.positions += curvature.positions * weight;
        let Some(b) = b else { return };
        let other = &mut self.bodies[b];
        other.turning += curvature.bb * weight;
        other.moving -= curvature.position_b * weight;
        other.positions += curvature.positions * weight;
        let bodies = (a.min(b), a.max(b));
        let Ok(place) = self.pairs.binary_search_by(|pair| pair.bodies.cmp(&bodies)) else {
            return;
        };
        let pair = &mut self.pairs[place];
        // r_A × q_B and r_B × q_A.
        let (turning, of_a, of_b) = if a < b {
            (curvature.ab.transpose(), &mut pair.first_moves, &mut pair.second_moves)
        } else {
            (curvature.ab, &mut pair.second_moves, &mut pair.first_moves)
        };
        pair.turning += turning * weight;
        if let Some(moves) = of_a {
            *moves += curvature.position_b * weight;
        }
        if let Some(moves) = of_b {
            *moves -= curvature.position_a * weight;
        }
        if let Some(positions) = &mut pair.positions {
            *positions -= curvature.positions * weight;
        }
    }
}
