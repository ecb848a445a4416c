//! Text out.

use crate::problem::{ContactProblem, Form, Law, ProblemError, SparseMatrix};
use std::fmt::Write as _;

/// Writes a problem of contacts, as Siconos 4.4 reads it: a local one with blocks, a global one with sparse
/// matrices. Every number keeps its bits.
///
/// # Errors
/// Groups that are no contacts, or contacts of different dimensions: the text has no words for them.
pub fn write(problem: &ContactProblem) -> Result<String, ProblemError> {
    let (count, first) = (problem.laws().len(), problem.laws().first());
    // Without a contact any dimension is as good.
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
    let friction = problem.laws().iter().map(|law| match law {
        Law::Contact { friction, .. } => *friction,
        Law::Rows(_) => 0.0,
    });
    write_numbers(&mut text, friction);
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

/// The blocks that are not all zero, row after row.
fn write_blocks(text: &mut String, matrix: &SparseMatrix, size: usize) {
    let count = matrix.rows() / size;
    // Of every row of blocks the columns; the matrix goes column after column.
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

/// As CSparse prints triplets, which Siconos reads back; 1 is its word for them.
fn write_sparse(text: &mut String, matrix: &SparseMatrix) {
    let (rows, columns, entries) = (matrix.rows(), matrix.columns(), matrix.entries());
    let _ = write!(text, "2\n{rows}\n{columns}\n1\n");
    let _ = writeln!(text, "CSparse Version 3.2.0, written by tumble");
    let _ = writeln!(text, "triplet: {rows}-by-{columns}, nzmax: {entries} nnz: {entries}");
    for (row, column, value) in matrix.triplets() {
        let _ = writeln!(text, "    {row} {column} : {value:e}");
    }
}
