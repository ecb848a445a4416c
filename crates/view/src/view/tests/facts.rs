//! Unit tests of `facts.rs`.

use super::*;
use crate::samples::{ball, floating_cube};
use tumble_core::geometry::Piece;

#[test]
fn inertia_is_shown_without_rounding_errors() {
    let mut matrix = Matrix3::from_diagonal(&Vector3::new(2.0, 1.5, 1.0));
    (matrix[(0, 1)], matrix[(1, 0)]) = (8e-19, 8e-19);
    assert_eq!(inertia(&matrix), "diag(2, 1.5, 1)");
    (matrix[(0, 1)], matrix[(1, 0)]) = (1e-9, 1e-9);
    assert_eq!(inertia(&matrix), "[2, 1e-9, 0; 1e-9, 1.5, 0; 0, 0, 1]");
}

#[test]
fn start_is_shown_without_rounding_errors() {
    assert_eq!(cleaned(&Vector3::new(1.2e-17, -0.3, 2.5), 1.0), "(0, -0.3, 2.5)");
    assert_eq!(cleaned(&Vector3::new(1e-17, 0.0, 0.0), 1.0), "(0, 0, 0)");
    assert_eq!(cleaned(&Vector3::new(1e-17, 0.0, 0.0), 0.0), "(1e-17, 0, 0)");
    assert_eq!(cleaned(&Vector3::new(1e-9, 0.0, 1.0), f64::NAN), "(1e-9, 0, 1)");
}

#[test]
fn diagonal_matrices_and_boxes_are_shown_in_short_form() {
    assert_eq!(inertia(&(Matrix3::identity() * 0.01)), "0.01 E₃");
    assert_eq!(inertia(&Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0))), "diag(1, 2, 3)");
    let full = Matrix3::new(1.0, 0.5, -0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 3.0);
    assert_eq!(inertia(&full), "[1, 0.5, 0; 0.5, 2, 0; 0, 0, 3]");
    assert_eq!(inertia(&(Matrix3::identity() * 1e-12)), "1e-12 E₃");
    assert_eq!(number(1.0 / 3.0), "0.333333");
    assert_eq!(number(0.1 + 0.2), "0.3");
    let shapes = floating_cube(0).bodies.remove(0).shapes;
    assert_eq!(shape(&shapes), "box 2 × 2 × 2 m");
    assert_eq!(shape(&[Shape::Points(vec![Vector3::x()])]), "1 contact point");
    assert_eq!(shape(&[ball(Vector3::zeros(), 0.5)]), "sphere of radius 0.5 m");
    let capsule = Shape::from(&Piece::capsule(1.0, 0.25).unwrap());
    assert_eq!(shape(&[capsule]), "capsule of radius 0.25 m about 2 m");
}
