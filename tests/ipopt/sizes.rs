//! Sizes of the terms in the rows, their Jacobian and the Hessian of the tutorial's cube. The rows
//! are written as in `data/generate/step_nlp.py`.

use super::points::Input;
use super::terms::{Terms, VARIABLES};
use nalgebra::DMatrix;
use std::array::from_fn;

/// Sizes of the terms of the rows (62), the Jacobian (62 × 61) and the Hessian (61 × 61, lower
/// triangle).
pub struct Sizes {
    pub rows: Vec<f64>,
    pub jacobian: DMatrix<f64>,
    pub hessian: DMatrix<f64>,
}

type Vector = [Terms; 3];

fn constants<const N: usize>(values: &[f64]) -> [Terms; N] {
    from_fn(|k| Terms::constant(values[k]))
}

fn sum(terms: impl IntoIterator<Item = Terms>) -> Terms {
    terms.into_iter().fold(Terms::constant(0.0), |sum, term| sum + term)
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

fn times(matrix: &[Vector; 3], vector: &Vector) -> Vector {
    from_fn(|i| sum((0..3).map(|j| matrix[i][j] * vector[j])))
}

fn transposed(matrix: &[Vector; 3]) -> [Vector; 3] {
    from_fn(|i| from_fn(|j| matrix[j][i]))
}

/// A(q) = (w² − u·u) E + 2 u uᵀ + 2 w [u]×, with q = (w, u).
fn rotation(q: &[Terms; 4]) -> [Vector; 3] {
    let (w, u) = (q[0], [q[1], q[2], q[3]]);
    from_fn(|i| {
        from_fn(|j| {
            let squares = w * w - sum(u.map(|u| u * u));
            match (j + 3 - i) % 3 {
                0 => squares + u[i] * u[i] * 2.0,
                1 => u[i] * u[j] * 2.0 - w * u[3 - i - j] * 2.0,
                _ => u[i] * u[j] * 2.0 + w * u[3 - i - j] * 2.0,
            }
        })
    })
}

/// Inverse by cofactors.
fn inverse(matrix: &[Vector; 3]) -> [Vector; 3] {
    let cofactor = |i: usize, j: usize| {
        let [(a, b), (c, d)] = [i, j].map(|k| ((k + 1) % 3, (k + 2) % 3));
        matrix[a][c] * matrix[b][d] - matrix[a][d] * matrix[b][c]
    };
    let over_determinant = sum((0..3).map(|j| matrix[0][j] * cofactor(0, j))).power(-1.0);
    from_fn(|i| from_fn(|j| cofactor(j, i) * over_determinant))
}

/// Corner `i`: x changes fastest, then y, then z.
fn corner(i: usize) -> Vector {
    [1, 2, 4].map(|bit| Terms::constant(if i & bit == 0 { -1.0 } else { 1.0 }))
}

/// Indices of the local variables of contact `i` among the 61.
fn places(i: usize) -> [usize; VARIABLES] {
    from_fn(|k| if k < 13 { k } else { 13 + 8 * (k - 13) + i })
}

impl Sizes {
    pub fn from_input(input: &Input) -> Self {
        let mut sizes = Self {
            rows: vec![0.0; 62],
            jacobian: DMatrix::zeros(62, 61),
            hessian: DMatrix::zeros(61, 61),
        };
        for (row, terms) in body_rows(input).into_iter().enumerate() {
            sizes.add(input, row, &terms, &places(0));
        }
        for i in 0..8 {
            for (row, terms) in contact_rows(input, i) {
                sizes.add(input, row, &terms, &places(i));
            }
        }
        // ∇²(s1² + s2²) = 2.
        for k in 37..53 {
            sizes.hessian[(k, k)] += 2.0 * input.obj_factor.abs();
        }
        sizes
    }

    fn add(&mut self, input: &Input, row: usize, terms: &Terms, places: &[usize; VARIABLES]) {
        let multiplier = input.multipliers[row].abs();
        self.rows[row] += terms.size;
        for (i, &at) in places.iter().enumerate() {
            self.jacobian[(row, at)] += terms.slope[i];
            for (j, &below) in places.iter().enumerate().filter(|(_, below)| **below <= at) {
                self.hessian[(at, below)] += multiplier * terms.curvature[i][j];
            }
        }
    }
}

/// X⁺ as variables: r⁺, q⁺, v⁺, ω⁺.
fn end(input: &Input) -> (Vector, [Terms; 4], Vector, Vector) {
    let variable = |k: usize| Terms::variable(k, input.x[k]);
    let three = |first: usize| from_fn(|k| variable(first + k));
    (three(0), from_fn(|k| variable(3 + k)), three(7), three(10))
}

/// Eqs. 8 and 9 without the contact forces: rows 0 to 13.
fn body_rows(input: &Input) -> Vec<Terms> {
    let (r, q, v, w) = end(input);
    let old: [Terms; 13] = constants(&input.state);
    let (h, gravity) = (input.dt(), constants::<3>(&input.gravity()));
    let inertia = input.inertia().map(|row| constants::<3>(&row));

    // L(q) H ω = (−u·ω, w ω + u × ω).
    let u = [old[4], old[5], old[6]];
    let across = cross(&u, &w);
    let turning: [Terms; 4] = from_fn(|k| match k {
        0 => sum((0..3).map(|j| u[j] * w[j])),
        _ => old[3] * w[k - 1] + across[k - 1],
    });
    let turned: [Terms; 4] = from_fn(|k| old[3 + k] + turning[k] * (0.5 * h));
    let over_norm = sum(turned.map(|p| p * p)).power(-0.5);
    let gyroscopic = times(&inverse(&inertia), &cross(&w, &times(&inertia, &w)));

    let mut rows = Vec::with_capacity(14);
    rows.extend((0..3).map(|k| old[k] + v[k] * h - r[k]));
    rows.extend((0..4).map(|k| turned[k] * over_norm - q[k]));
    rows.extend((0..3).map(|k| old[7 + k] + gravity[k] * h - v[k]));
    rows.extend((0..3).map(|k| old[10 + k] - gyroscopic[k] * h - w[k]));
    rows.push(sum(q.map(|q| q * q)) - Terms::constant(1.0));
    rows
}

/// Rows of contact `i` (eqs. 10 and 12 to 15), and the terms of its force in eqs. 8c and 8d.
fn contact_rows(input: &Input, i: usize) -> Vec<(usize, Terms)> {
    let (r, q, ..) = end(input);
    let old: [Terms; 13] = constants(&input.state);
    let [fx, fy, fz, s1, s2, slip_speed] =
        from_fn(|k| Terms::variable(13 + k, input.x[places(i)[13 + k]]));
    let (h, mass, mu) = (input.dt(), input.mass(), Terms::constant(input.mu()));
    let (alpha, epsilon) = (input.alpha[i], Terms::constant(input.epsilon()));
    let inertia = input.inertia().map(|row| constants::<3>(&row));
    let (corner, force) = (corner(i), [fx, fy, fz]);

    let attitude = rotation(&[old[3], old[4], old[5], old[6]]);
    let torque = cross(&corner, &times(&transposed(&attitude), &force));
    let spin = times(&inverse(&inertia), &torque);
    let mut rows: Vec<_> = (0..3).map(|k| (7 + k, force[k] * (h / mass))).collect();
    rows.extend((0..3).map(|k| (10 + k, spin[k] * h)));

    let (before, after) = (times(&attitude, &corner), times(&rotation(&q), &corner));
    let after: Vector = from_fn(|k| r[k] + after[k]);
    let norm = (fx * fx + fy * fy + epsilon * epsilon).power(0.5) - epsilon;
    let over_norm = (norm + epsilon).power(-1.0);
    for axis in 0..2 {
        let slip = (after[axis] - old[axis] - before[axis]) * (1.0 / h);
        let row = slip + slip_speed * force[axis] * over_norm;
        rows.push((14 + 2 * i + axis, row * alpha));
    }
    let room = mu * fz - norm;
    rows.push((30 + i, after[2]));
    rows.push((38 + i, room));
    rows.push((46 + i, s1 - fz * after[2]));
    rows.push((54 + i, s2 - slip_speed * room));
    rows
}
