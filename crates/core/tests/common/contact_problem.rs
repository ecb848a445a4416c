//! Contact problems given as matrices: made from plain numbers and at random.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code)]

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use tumble_core::problem::{ContactProblem, Law, SparseMatrix};
use tumble_core::simulation::random::Draws;

pub fn dense(matrix: &DMatrix<f64>) -> SparseMatrix {
    let (rows, columns) = matrix.shape();
    let entries = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    SparseMatrix::from_triplets(rows, columns, entries.map(|(i, j)| (i, j, matrix[(i, j)])))
        .unwrap()
}

pub fn local(w: &DMatrix<f64>, q: &[f64], laws: Vec<Law>) -> ContactProblem {
    ContactProblem::local(dense(w), q.to_vec(), laws).unwrap()
}

pub fn contacts(friction: &[f64]) -> Vec<Law> {
    Law::contacts(3, friction).unwrap()
}

pub fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Bodies with contacts at random points, with each other and with the world.
pub struct Random {
    pub mass: DMatrix<f64>,
    pub directions: DMatrix<f64>,
    pub momentum: Vec<f64>,
    pub offset: Vec<f64>,
    pub friction: Vec<f64>,
}

pub fn random(seed: u32, bodies: usize, count: usize) -> Random {
    let mut draws = Draws::new(seed);
    let mut signed = |size: f64| size * (2.0 * draws.unit() - 1.0);
    let size = 6 * bodies;
    let (mut mass, mut directions) = (DMatrix::zeros(size, size), DMatrix::zeros(size, 3 * count));
    for body in 0..bodies {
        let root = Matrix3::from_fn(|_, _| signed(0.3)) + Matrix3::identity() * 0.5;
        let m = 1.5 + signed(1.0);
        mass.fixed_view_mut::<3, 3>(6 * body, 6 * body).fill_with_identity();
        let mut linear = mass.fixed_view_mut::<3, 3>(6 * body, 6 * body);
        linear *= m;
        let inertia = root * root.transpose() * m;
        mass.fixed_view_mut::<3, 3>(6 * body + 3, 6 * body + 3).copy_from(&inertia);
    }
    for contact in 0..count {
        let normal = Vector3::new(signed(1.0), signed(1.0), 1.0 + signed(0.5)).normalize();
        let across = normal.cross(&Vector3::x()).normalize();
        let frame = Matrix3::from_columns(&[normal, across, normal.cross(&across)]);
        let a = contact % bodies;
        let other = (signed(0.5).abs() * 2.0 * (bodies + 1) as f64) as usize;
        for (body, sign) in [(a, 1.0), (other, -1.0)] {
            if body >= bodies || (sign < 0.0 && body == a) {
                continue;
            }
            let arm = Vector3::new(signed(0.7), signed(0.7), signed(0.7));
            let mut linear = directions.fixed_view_mut::<3, 3>(6 * body, 3 * contact);
            linear += sign * frame;
            let mut angular = directions.fixed_view_mut::<3, 3>(6 * body + 3, 3 * contact);
            angular += sign * arm.cross_matrix() * frame;
        }
    }
    let velocity = DVector::from_fn(size, |_, _| signed(3.0));
    let momentum = (&mass * velocity).as_slice().to_vec();
    let offset = vec![0.0; 3 * count];
    let friction = (0..count).map(|_| 0.35 + signed(0.35)).collect();
    Random { mass, directions, momentum, offset, friction }
}

impl Random {
    pub fn problem(&self) -> ContactProblem {
        let (mass, directions) = (dense(&self.mass), dense(&self.directions));
        let (f, w) = (self.momentum.clone(), self.offset.clone());
        ContactProblem::global(mass, directions, f, w, contacts(&self.friction)).unwrap()
    }

    /// Largest violation of the contact law, computed from the matrices alone. It covers gaps that
    /// close, tension, impulses at opening contacts, friction outside its cone and friction not
    /// opposed to the slip.
    pub fn missed(&self, impulses: &[f64]) -> f64 {
        let p = DVector::from_column_slice(impulses);
        let momentum = DVector::from_column_slice(&self.momentum) + &self.directions * &p;
        let velocity = self.mass.clone().lu().solve(&momentum).unwrap();
        let u = self.directions.transpose() * velocity;
        let mut missed = 0.0_f64;
        for (contact, friction) in self.friction.iter().enumerate() {
            let (p, u) = (p.fixed_rows::<3>(3 * contact), u.fixed_rows::<3>(3 * contact));
            let (slip, along) = (u.fixed_rows::<2>(1), p.fixed_rows::<2>(1));
            missed = missed.max(-p[0]).max(-u[0]).max(p[0].min(u[0]));
            missed = missed.max(along.norm() - friction * p[0].max(0.0));
            // Maximum dissipation: the friction force has its full size and opposes the slip.
            let power = (along.dot(&slip) + friction * p[0] * slip.norm()).abs();
            missed = missed.max(power);
        }
        missed
    }
}

pub fn plate() -> ContactProblem {
    // A plate of 4 kg that falls at 1 m/s on its four corners.
    let mut directions = DMatrix::zeros(6, 12);
    for (contact, (x, y)) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].iter().enumerate()
    {
        let arm = Vector3::new(*x, *y, -0.1);
        let frame = Matrix3::from_columns(&[Vector3::z(), Vector3::x(), Vector3::y()]);
        directions.fixed_view_mut::<3, 3>(0, 3 * contact).copy_from(&frame);
        directions.fixed_view_mut::<3, 3>(3, 3 * contact).copy_from(&(arm.cross_matrix() * frame));
    }
    let mass = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 4.0, 4.0, 1.4, 1.4, 2.7]));
    let f = vec![0.4, 0.0, -4.0, 0.0, 0.0, 0.0];
    let laws = contacts(&[0.5; 4]);
    ContactProblem::global(dense(&mass), dense(&directions), f, vec![0.0; 12], laws).unwrap()
}
