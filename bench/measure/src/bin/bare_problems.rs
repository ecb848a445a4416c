//! Bare contact problems for `bench/problems.py`: `bare_problems FOLDER FILE`.
//!
//! Solves every `.dat` file of FOLDER and writes the times to standard output as JSON. Contact
//! problems with three rows per contact are also written to FILE for other solvers, in the format
//! of `local_problems`.

use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tumble::problem::{ContactProblem, Form, Law, Selection, SolveOptions, dat};

type BareFailure = Box<dyn std::error::Error>;

/// Number of runs per problem, of which the fastest counts; fewer if they exceed `LONG_SECONDS`.
const RUNS: usize = 5;
const LONG_SECONDS: f64 = 0.5;

/// Result of tumble for one problem.
#[derive(Serialize)]
struct BareResult {
    name: String,
    contacts: usize,
    /// Position in FILE; `None` if it is not there.
    place: Option<usize>,
    /// Processor time (s) and residual (m/s) of any solution, and of the solution by the selection
    /// rule.
    any: (f64, f64),
    rule: (f64, f64),
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (Some(folder), Some(file)) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: bare_problems FOLDER FILE");
        return ExitCode::from(2);
    };
    match run(Path::new(&folder), Path::new(&file)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bare_problems: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(folder: &Path, file: &Path) -> Result<(), BareFailure> {
    let entries = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    let mut paths: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|end| end == "dat"));
    paths.sort();
    if paths.is_empty() {
        return Err(format!("{}: no file there ends in .dat", folder.display()).into());
    }
    let mut written = BufWriter::new(std::fs::File::create(file)?);
    let (mut found, mut count) = (Vec::new(), 0);
    for path in &paths {
        let invalid = |why: String| format!("{}: {why}", path.display());
        let problem =
            dat::read(&std::fs::read_to_string(path)?).map_err(|e| invalid(e.to_string()))?;
        let (any, rule) =
            (solved(&problem, Selection::Any)?, solved(&problem, Selection::Compliance)?);
        let place = problem.dimension() == Some(3);
        if place {
            write(&mut written, count, any.0, &problem.to_local()?)?;
            count += 1;
        }
        found.push(BareResult {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            contacts: problem.laws().len(),
            place: place.then(|| count - 1),
            any,
            rule,
        });
    }
    written.flush()?;
    serde_json::to_writer(std::io::stdout(), &found)?;
    Ok(())
}

/// Processor time (s) and residual (m/s) of one problem, solved from zero impulses.
fn solved(problem: &ContactProblem, selection: Selection) -> Result<(f64, f64), BareFailure> {
    let options = SolveOptions { selection, ..SolveOptions::default() };
    let (mut least, mut spent, mut residual) = (f64::INFINITY, 0.0, f64::INFINITY);
    for _ in 0..RUNS {
        let start = clock();
        residual = problem.solve(&options)?.residual;
        let taken = clock() - start;
        (least, spent) = (least.min(taken), spent + taken);
        if spent > LONG_SECONDS {
            break;
        }
    }
    Ok((least, residual))
}

/// Writes a problem in little endian: n, the problem's number, seconds, W, q, μ and zero impulses.
fn write(
    file: &mut impl Write,
    number: usize,
    seconds: f64,
    problem: &ContactProblem,
) -> Result<(), BareFailure> {
    let Form::Local { response, free } = problem.form() else {
        return Err("it is not local".into());
    };
    let rows = problem.row_count();
    let friction = problem.laws().iter().map(|law| match law {
        Law::Contact { friction, .. } => Ok(*friction),
        Law::Rows(_) => Err("a law of rows in a problem of contacts"),
    });
    let mut dense = vec![0.0; rows * rows];
    for (row, column, value) in response.triplets() {
        dense[rows * row + column] += value;
    }
    let mut numbers = vec![seconds];
    numbers.extend(dense);
    numbers.extend(free);
    numbers.extend(friction.collect::<Result<Vec<_>, _>>()?);
    numbers.resize(numbers.len() + rows, 0.0);
    for head in [problem.laws().len() as u64, number as u64] {
        file.write_all(&head.to_le_bytes())?;
    }
    for number in numbers {
        file.write_all(&number.to_le_bytes())?;
    }
    Ok(())
}

/// Processor time of this process (s).
fn clock() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
