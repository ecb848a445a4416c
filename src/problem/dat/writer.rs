//! Writer of the text format.

use crate::problem::{ContactProblem, Form, Law, ProblemError, SparseMatrix};
use std::fmt::Write as _;

/// Writes a contact problem in the format of Siconos 4.4. A local problem has a block matrix, a
/// global one sparse matrices. Numbers are written without loss.
///
/// # Errors
/// Groups that are not contacts, or contacts of different dimensions: the format cannot express
/// them.
pub fn write(problem: &ContactProblem) -> Result<String, ProblemError> {
    let (count, first) = (problem.laws().len(), problem.laws().first());
    // Without contacts any dimension is valid.
    let dimension = first.map_or(3, Law::rows);
    let fits = |law: &Law| matches!(law, Law::Contact { .. }) && law.rows() == dimension;
    if let Some(group) = problem.laws().iter().position(|law| !fits(law)) {
        return Err(ProblemError::NoWords { group });
    }
    let mut text = format!("{dimension}\n{count}\n");
    match problem.form() {
        Form::Local { response, free } => {
            write_blocks(&mut text, response, dimension);
            write_numbers(&mut text, free.iter().copied());
        }
        Form::Global(global) => {
            write_sparse(&mut text, &global.mass);
            write_sparse(&mut text, &global.directions);
            write_numbers(&mut text, global.momentum.iter().copied());
            write_numbers(&mut text, global.offset.iter().copied());
        }
    }
    write_numbers(&mut text, problem.laws().iter().map(Law::friction));
    Ok(text)
}

fn write_numbers(text: &mut String, numbers: impl Iterator<Item = f64>) {
    for number in numbers {
        let _ = write!(text, "{number:e} ");
    }
    text.push('\n');
}

fn write_counts(text: &mut String, counts: impl Iterator<Item = usize>) {
    for count in counts {
        let _ = write!(text, "{count}\t");
    }
    text.push('\n');
}

/// Writes the blocks that are not all zero, row by row.
fn write_blocks(text: &mut String, matrix: &SparseMatrix, size: usize) {
    let count = matrix.rows() / size;
    // Block columns of every block row. The matrix itself is in column-major order.
    let mut rows: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (row, column, _) in matrix.triplets() {
        rows[row / size].push(column / size);
    }
    for columns in &mut rows {
        columns.sort_unstable();
        columns.dedup();
    }
    let blocks: usize = rows.iter().map(Vec::len).sum();
    let _ = write!(text, "1\n{0}\n{0}\n{blocks}\n", matrix.rows());
    if blocks == 0 {
        return;
    }
    let _ = write!(text, "{count}\n{count}\n");
    for _ in 0..2 {
        write_counts(text, (1..=count).map(|row| row * size));
    }
    let _ = write!(text, "{}\n{blocks}\n", count + 1);
    let ends = rows.iter().scan(0, |end, columns| {
        *end += columns.len();
        Some(*end)
    });
    write_counts(text, std::iter::once(0).chain(ends));
    write_counts(text, rows.iter().flatten().copied());
    let places = rows.iter().enumerate();
    let places = places.flat_map(|(row, columns)| columns.iter().map(move |column| (row, *column)));
    for (number, (row, column)) in places.enumerate() {
        let _ = writeln!(text, "{number}");
        for j in 0..size {
            for i in 0..size {
                let _ = writeln!(text, "{:e}", matrix.at(row * size + i, column * size + j));
            }
        }
    }
}

/// Writes triplets as CSparse prints them, which Siconos reads. The origin 1 means triplets.
fn write_sparse(text: &mut String, matrix: &SparseMatrix) {
    let (rows, columns, entries) = (matrix.rows(), matrix.columns(), matrix.entries());
    let _ = write!(text, "2\n{rows}\n{columns}\n1\n");
    let _ = writeln!(text, "CSparse Version 3.2.0, written by tumble");
    let _ = writeln!(text, "triplet: {rows}-by-{columns}, nzmax: {entries} nnz: {entries}");
    for (row, column, value) in matrix.triplets() {
        let _ = writeln!(text, "    {row} {column} : {value:e}");
    }
}
