//! Block-diagonal mass matrix with factorised blocks.

use super::{ProblemError, SparseMatrix};
use crate::sets::DisjointSets;
use crate::sparse::{Fronts, SymbolicFactorisation};
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// Largest block that is factorised as a dense matrix.
const DENSE: usize = 48;

/// Mass matrix M as independent blocks.
#[derive(Debug, Clone)]
pub(crate) struct MassMatrix {
    components: Vec<MassComponent>,
    /// Block of each row, and index in that block.
    places: Vec<(usize, usize)>,
}

/// Block of M.
#[derive(Debug, Clone)]
pub(crate) struct MassComponent {
    /// Rows of the block, ascending.
    pub(crate) numbers: Vec<usize>,
    factors: MassFactors,
}

#[derive(Debug, Clone)]
enum MassFactors {
    Dense(LU<f64, Dyn, Dyn>),
    Sparse(Box<(SymbolicFactorisation, Fronts)>),
}

impl MassComponent {
    /// Multiplies a vector over the rows of this block by M⁻¹, in place.
    pub(crate) fn solve(&self, values: &mut [f64]) {
        match &self.factors {
            MassFactors::Dense(factors) => {
                let mut vector = DVector::from_column_slice(values);
                factors.solve_mut(&mut vector);
                values.copy_from_slice(vector.as_slice());
            }
            MassFactors::Sparse(both) => {
                let (plan, fronts) = &**both;
                let mut placed = vec![0.0; values.len()];
                for (node, value) in values.iter().enumerate() {
                    placed[plan.place(node)] = *value;
                }
                fronts.solve(plan, &mut placed, &mut Vec::new());
                for (node, value) in values.iter_mut().enumerate() {
                    *value = placed[plan.place(node)];
                }
            }
        }
    }
}

impl MassMatrix {
    /// # Errors
    /// [`ProblemError::Mass`] if a block is singular or not positive definite.
    pub(super) fn new(matrix: &SparseMatrix) -> Result<Self, ProblemError> {
        let parts = components(matrix);
        // Component of each row, and its place there.
        let mut places = vec![(0, 0); matrix.rows()];
        for (part, numbers) in parts.iter().enumerate() {
            for (place, number) in numbers.iter().enumerate() {
                places[*number] = (part, place);
            }
        }
        let mut components = Vec::with_capacity(parts.len());
        for numbers in parts {
            let refusal = ProblemError::Mass { row: numbers[0] };
            let place = |number: usize| places[number].1;
            let of =
                |column: usize| matrix.column(column).map(move |(row, value)| (row, column, value));
            let entries: Vec<_> = numbers.iter().flat_map(|&column| of(column)).collect();
            // Small components are dense, with Cholesky's method as the test of definiteness.
            let factors = if numbers.len() <= DENSE {
                let mut dense = DMatrix::zeros(numbers.len(), numbers.len());
                for &(row, column, value) in &entries {
                    dense[(place(row), place(column))] = value;
                }
                let symmetric = 0.5 * (&dense + dense.transpose());
                if symmetric.cholesky().is_none() {
                    return Err(refusal);
                }
                MassFactors::Dense(dense.lu())
            } else {
                // Large ones are sparse. Their diagonal has to be positive.
                let pairs = entries.iter().map(|(row, column, _)| (place(*row), place(*column)));
                let plan = SymbolicFactorisation::new(
                    &vec![1; numbers.len()],
                    pairs.filter(|(row, column)| row != column),
                );
                let mut fronts = Fronts::default();
                fronts.begin(&plan);
                for (row, column, value) in entries {
                    let at = (plan.place(place(row)), plan.place(place(column)));
                    fronts.add(&plan, at.0, at.1, 1, &[value]);
                }
                let is_positive = numbers.iter().all(|&number| matrix.at(number, number) > 0.0);
                if !is_positive || !fronts.factorise(&plan) {
                    return Err(refusal);
                }
                MassFactors::Sparse(Box::new((plan, fronts)))
            };
            components.push(MassComponent { numbers, factors });
        }
        Ok(Self { components, places })
    }

    pub(crate) fn components(&self) -> &[MassComponent] {
        &self.components
    }

    /// Block of a row, and index in that block.
    pub(crate) fn place(&self, number: usize) -> (usize, usize) {
        self.places[number]
    }

    /// Multiplies a vector by M⁻¹, in place.
    pub(crate) fn solve(&self, values: &mut [f64]) {
        for component in &self.components {
            let mut own: Vec<f64> = component.numbers.iter().map(|&k| values[k]).collect();
            component.solve(&mut own);
            component.numbers.iter().zip(own).for_each(|(&k, value)| values[k] = value);
        }
    }

    /// Multiplies a sparse vector by M⁻¹ and writes the result to `moved`, which must be zero.
    /// Returns the indices of possible nonzeros.
    pub(crate) fn solve_sparse(
        &self,
        entries: impl Iterator<Item = (usize, f64)>,
        moved: &mut [f64],
    ) -> Vec<usize> {
        let mut parts = Vec::new();
        for (row, value) in entries {
            moved[row] = value;
            parts.push(self.places[row].0);
        }
        parts.sort_unstable();
        parts.dedup();
        let mut touched = Vec::new();
        for part in parts {
            let component = &self.components[part];
            let mut own: Vec<f64> = component.numbers.iter().map(|&k| moved[k]).collect();
            component.solve(&mut own);
            component.numbers.iter().zip(own).for_each(|(&k, value)| moved[k] = value);
            touched.extend_from_slice(&component.numbers);
        }
        touched
    }
}

/// Connected components of a matrix, each with ascending rows, ordered by their first row.
fn components(matrix: &SparseMatrix) -> Vec<Vec<usize>> {
    let mut sets = DisjointSets::new(matrix.rows());
    for (row, column, _) in matrix.triplets() {
        sets.join(row, column);
    }
    sets.lists()
}
