//! Unit tests of `matrix.rs`.

use super::*;

#[test]
fn entries_are_sorted_and_summed() {
    let entries = [(1, 1, 4.0), (0, 0, 1.0), (1, 0, 2.0), (1, 1, -1.0), (0, 1, 0.0)];
    let matrix = SparseMatrix::from_triplets(2, 2, entries).unwrap();
    assert_eq!(matrix, SparseMatrix::from_rows(2, 2, &[1.0, 0.0, 2.0, 3.0]).unwrap());
    assert_eq!(matrix.entries(), 3);
    assert_eq!(matrix.at(1, 0), 2.0);
    assert_eq!(matrix.at(7, 9), 0.0);
    let mut product = [0.0; 2];
    matrix.add_product(&[1.0, 2.0], &mut product);
    assert_eq!(product, [1.0, 8.0]);
    let mut product = [0.0; 2];
    matrix.add_transposed_product(&[1.0, 2.0], &mut product);
    assert_eq!(product, [5.0, 6.0]);
    assert_eq!(matrix.asymmetry(), (2.0 / 3.0, 1, 0));
}

#[test]
fn entries_outside_the_matrix_or_not_finite_are_rejected() {
    assert!(SparseMatrix::from_triplets(2, 2, [(2, 0, 1.0)]).is_err());
    assert!(SparseMatrix::from_triplets(2, 2, [(0, 0, f64::NAN)]).is_err());
    assert!(SparseMatrix::from_rows(2, 2, &[1.0; 3]).is_err());
}
