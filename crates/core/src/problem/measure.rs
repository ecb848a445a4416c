//! Residuals of impulses, computed from the problem and the impulses only.

use super::{ContactProblem, Form, Law};
use crate::contact::Response;
use crate::contact::law::{project_on_disc, project_on_interval};
use crate::mechanics::largest;
use crate::world::ContactLaw;
use nalgebra::Vector3;

/// Velocities and residuals for given impulses.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// Velocity u of every row (m/s).
    pub velocities: Vec<f64>,
    /// Velocity v of the global form, the solution of M v = H p + f; empty for the local form.
    pub body_velocities: Vec<f64>,
    /// Largest residual of a law (m/s), each group in its own scale (C3).
    pub residual: f64,
    /// Relative error as defined by Siconos and FCLIB, dimensionless (C4).
    pub relative_error: f64,
}

impl ContactProblem {
    /// Computes u, v and the residuals for given impulses. Missing impulses count as zero.
    ///
    /// W_ii is the diagonal block of a group, w_n = W_nn, and w_t is the mean over its tangents.
    /// The residual of a contact is the certificate's (m/s),
    ///
    /// ```text
    /// |min(w_n p_n, u_n)|,  ‖w_t p_t − Π(w_t p_t − u_t)‖,  max(0, w_t (‖p_t‖ − μ p_n))      (C3)
    /// ```
    ///
    /// and the one of another row is |p − P(p − u/w)| w. For a moment P is the projection on its limits.
    /// The relative error is
    ///
    /// ```text
    /// √(Σ |p − Π_K(p − u − μ‖u_t‖ n)|²) / ‖q‖                                              (C4)
    /// ```
    ///
    /// with the projection Π_K onto the cone, and q of the local form.
    pub fn evaluate(&self, impulses: &[f64]) -> Evaluation {
        let rows = self.row_count();
        let mut p = impulses.to_vec();
        p.resize(rows, 0.0);
        let (mut velocities, body_velocities, size) = match &self.form {
            Form::Local { response, free } => {
                let mut velocities = free.clone();
                response.add_product(&p, &mut velocities);
                (velocities, Vec::new(), norm(free))
            }
            Form::Global(global) => {
                let of = |momentum: &mut Vec<f64>| {
                    global.factors.solve(momentum);
                    let mut velocities = global.offset.clone();
                    global.directions.add_transposed_product(momentum, &mut velocities);
                    velocities
                };
                let mut momentum = global.momentum.clone();
                let size = norm(&of(&mut momentum));
                momentum.copy_from_slice(&global.momentum);
                global.directions.add_product(&p, &mut momentum);
                (of(&mut momentum), momentum, size)
            }
        };
        velocities.resize(rows, 0.0);
        let responses = self.responses();
        let (mut residual, mut squared) = (0.0, 0.0);
        for (group, law) in self.laws.iter().enumerate() {
            let range = self.rows(group);
            let pressed = match law {
                Law::Moment { contact, .. } => p[self.starts[*contact]].max(0.0),
                Law::Contact { .. } | Law::Rows(_) => 0.0,
            };
            let (p, u) = (&p[range.clone()], &velocities[range.clone()]);
            residual = largest(residual, law.residual(&responses[range], p, u, pressed));
            squared += law.squared_error(p, u, pressed);
        }
        let scale = if size > f64::EPSILON { size } else { 1.0 };
        Evaluation { velocities, body_velocities, residual, relative_error: squared.sqrt() / scale }
    }

    /// Diagonal of W (1/kg), with 1 instead of entries that are not positive.
    pub(crate) fn responses(&self) -> Vec<f64> {
        let mut responses: Vec<f64> = match &self.form {
            Form::Local { response, .. } => {
                (0..self.row_count()).map(|row| response.at(row, row)).collect()
            }
            Form::Global(global) => {
                let mut moved = vec![0.0; global.mass.rows()];
                let columns = 0..self.row_count();
                columns
                    .map(|column| {
                        let directions = global.directions.column(column);
                        let touched = global.factors.solve_sparse(directions, &mut moved);
                        let along = global.directions.column(column);
                        let response = along.map(|(row, value)| value * moved[row]).sum();
                        touched.iter().for_each(|&place| moved[place] = 0.0);
                        response
                    })
                    .collect()
            }
        };
        for response in &mut responses {
            if *response <= 0.0 {
                *response = 1.0;
            }
        }
        responses
    }
}

fn norm(numbers: &[f64]) -> f64 {
    numbers.iter().map(|number| number * number).sum::<f64>().sqrt()
}

/// Vector of up to three numbers, padded with zeros.
pub(crate) fn three(numbers: &[f64]) -> Vector3<f64> {
    Vector3::from_fn(|k, _| numbers.get(k).copied().unwrap_or(0.0))
}

impl Law {
    /// Responses w_n and w_t of a contact from the diagonal of W.
    pub(crate) fn response(responses: &[f64]) -> Response {
        let tangents = &responses[1..];
        let tangential = tangents.iter().sum::<f64>() / tangents.len() as f64;
        Response { normal: responses[0], tangential }
    }

    /// Largest part of (C3) (m/s). `pressed` is the normal impulse of a moment's contact (N s).
    fn residual(&self, responses: &[f64], p: &[f64], u: &[f64], pressed: f64) -> f64 {
        match self {
            Self::Contact { friction, .. } => {
                let law = ContactLaw::plastic(*friction);
                let response = Self::response(responses);
                let missed = law.residual(&response, &Vector3::x(), &three(p), &three(u));
                largest(missed.normal, largest(missed.friction, missed.cone))
            }
            Self::Moment { rolling, torsional, .. } => {
                let across = 0.5 * (responses[0] + responses[1]);
                let scale = Vector3::new(across, across, responses[2]);
                let missed =
                    moment_error(&three(p), &three(u), &scale, pressed, [*rolling, *torsional]);
                largest(across * missed.xy().norm(), (scale[2] * missed[2]).abs())
            }
            Self::Rows(rows) => {
                let each = rows.iter().zip(responses).zip(p.iter().zip(u));
                each.map(|((row, w), (p, u))| row.graph(1.0).residual(*u, *p, 1.0 / w))
                    .fold(0.0, largest)
            }
        }
    }

    /// Squared contribution of a group to (C4).
    fn squared_error(&self, p: &[f64], u: &[f64], pressed: f64) -> f64 {
        match self {
            Self::Contact { friction, .. } => {
                let (p, mut projection) = (three(p), three(p) - three(u));
                projection[0] -= friction * three(u).yz().norm();
                (p - project_on_cone(projection, *friction)).norm_squared()
            }
            Self::Moment { rolling, torsional, .. } => {
                let scale = Vector3::repeat(1.0);
                let limits = [*rolling, *torsional];
                moment_error(&three(p), &three(u), &scale, pressed, limits).norm_squared()
            }
            Self::Rows(rows) => {
                let each = rows.iter().zip(p.iter().zip(u));
                each.map(|(row, (p, u))| (p - row.graph(1.0).projected(p - u, 1.0)).powi(2)).sum()
            }
        }
    }
}

/// p − P(p − u/w), with the projection P on the `limits` of a moment times the normal impulse `pressed`.
fn moment_error(
    p: &Vector3<f64>,
    u: &Vector3<f64>,
    w: &Vector3<f64>,
    pressed: f64,
    limits: [f64; 2],
) -> Vector3<f64> {
    let y = p - u.component_div(w);
    let across = project_on_disc(Vector3::new(y[0], y[1], 0.0), limits[0] * pressed);
    p - across - Vector3::z() * project_on_interval(y[2], limits[1] * pressed)
}

/// Projection onto the cone ‖x_t‖ ≤ μ x_n; the first component is normal.
fn project_on_cone(x: Vector3<f64>, friction: f64) -> Vector3<f64> {
    let (normal, tangential) = (x[0], x.yz().norm());
    if tangential <= friction * normal {
        return x;
    }
    if friction * tangential <= -normal {
        return Vector3::zeros();
    }
    let pressed = (friction * tangential + normal) / (1.0 + friction * friction);
    let shrink = friction * pressed / tangential;
    Vector3::new(pressed, shrink * x[1], shrink * x[2])
}
