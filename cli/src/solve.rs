//! `tumble solve`: standalone contact problems.

use super::args::{Rule, SolveArgs};
use super::directory::OutputDirectory;
use super::input;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, Voice, complain, directory_of, progress_bar};
use super::signals::raise_on_signals;
use std::collections::HashSet;
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use tumble::problem::{ContactProblem, ProblemError, Selection, Solution, SolveOptions, dat};
use tumble_model::shown;

/// Largest size of a problem's file, bytes: about 100 000 contacts.
const LARGEST_FILE: u64 = 1 << 30;
/// First bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF";

/// Result of a problem, converged or not.
struct SolvedProblem {
    name: String,
    groups: usize,
    rows: usize,
    /// Table of the solution.
    csv: String,
    solution: Solution,
    seconds: f64,
}

/// A file that cannot be read as a problem.
struct Unread {
    name: String,
    failure: Failure,
}

/// Target of the files: a directory, or a directory and a file name.
enum SolutionFile<'a> {
    Directory(&'a Path),
    File(&'a Path, &'a OsStr),
}

/// Runs `tumble solve`.
pub fn run(args: &SolveArgs) -> Result<Outcome, Failure> {
    if args.residual.is_nan() || args.residual <= 0.0 {
        return Err(Failure::Input(format!(
            "--residual {}: a number above 0 is needed",
            args.residual
        )));
    }
    let files = files_of(&args.problems)?;
    let target = args.out.as_deref().map(|out| target(out, &files)).transpose()?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let mut voice = Voice::new(args.quiet);
    let bar = progress_bar(files.len() as u64, "problems", args.quiet || files.len() == 1);
    let (mut all, mut unread) = (Vec::with_capacity(files.len()), Vec::new());
    for file in &files {
        let problem = match read(file) {
            Ok(problem) => problem,
            Err(failure) if files.len() == 1 => return Err(failure),
            Err(failure) => {
                unread.push(Unread { name: name_of(file), failure });
                continue;
            }
        };
        let options = SolveOptions {
            residual: args.residual,
            selection: match args.rule {
                Rule::Any => Selection::Any,
                Rule::Compliance => Selection::Compliance,
            },
            interrupt: Some(&*interrupt),
            ..SolveOptions::default()
        };
        let clock = Instant::now();
        let solution = match problem.solve(&options) {
            Ok(solution) => solution,
            Err(ProblemError::Interrupted) => return Ok(Outcome::Interrupted),
            Err(error) => return Err(refused(file, &error)),
        };
        let seconds = clock.elapsed().as_secs_f64();
        let csv = if target.is_some() { table_of(&problem, &solution) } else { String::new() };
        let (groups, rows) = (problem.laws().len(), problem.row_count());
        all.push(SolvedProblem { name: name_of(file), groups, rows, csv, solution, seconds });
        bar.inc(1);
    }
    bar.finish_and_clear();
    for Unread { failure, .. } in &unread {
        complain(failure);
    }
    voice.say(&described(&all, &unread));
    let written = target.map(|target| write(&target, &all, &unread)).transpose()?;
    if let Some(written) = written {
        voice.say(&format!("wrote {written}\n"));
    }
    let is_solved = unread.is_empty() && all.iter().all(|solved| solved.solution.is_solved());
    voice.end(if is_solved { Outcome::Done } else { Outcome::Unconverged })
}

/// Files named on the command line, and sorted files of directories.
fn files_of(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let failed = |error| {
            Failure::Input(format!("{}: cannot be read as a folder: {error}", shown::path(path)))
        };
        let mut inside = Vec::new();
        for entry in std::fs::read_dir(path).map_err(failed)? {
            let file = entry.map_err(failed)?.path();
            if file.is_file() && file.extension().is_some_and(|end| end == "dat") {
                inside.push(file);
            }
        }
        if inside.is_empty() {
            let why = "no file in it ends in .dat; problems in Siconos' text format are needed";
            return Err(Failure::Input(format!("{}: {why}", shown::path(path))));
        }
        inside.sort();
        files.append(&mut inside);
    }
    Ok(files)
}

/// File name without directory and extension.
fn name_of(file: &Path) -> String {
    file.file_stem().unwrap_or(OsStr::new("problem")).to_string_lossy().into_owned()
}

/// Target of `--out`.
fn target<'a>(out: &'a Path, files: &[PathBuf]) -> Result<SolutionFile<'a>, Failure> {
    let refused = |why: &str| Err(Failure::Input(format!("--out {}: {why}", shown::path(out))));
    let is_file = out.extension().is_some_and(|end| end == "csv") && !out.is_dir();
    match (out.file_name(), is_file) {
        (Some(_), true) if files.len() > 1 => {
            refused("a directory is needed for the solutions of several problems")
        }
        (Some(name), true) => Ok(SolutionFile::File(directory_of(None, out), name)),
        _ => {
            let mut names = HashSet::new();
            match files.iter().map(|file| name_of(file)).find(|name| !names.insert(name.clone())) {
                Some(twice) => refused(&format!(
                    "two problems have the name {}; rename one",
                    shown::line(&twice)
                )),
                None => Ok(SolutionFile::Directory(out)),
            }
        }
    }
}

fn read(file: &Path) -> Result<ContactProblem, Failure> {
    let bytes = input::bytes(file, LARGEST_FILE).map_err(|error| refused(file, &error))?;
    if bytes.starts_with(HDF5) {
        let why = "it is an HDF5 file; read it with the Python package, tumble.ContactProblem.read";
        return Err(refused(file, &why));
    }
    let text = String::from_utf8(bytes).map_err(|_| refused(file, &"it is not text"))?;
    dat::read(&text).map_err(|error| refused(file, &error))
}

fn refused(file: &Path, why: &dyn std::fmt::Display) -> Failure {
    let why = shown::line(&why.to_string());
    Failure::Input(format!("{}: cannot be read as a contact problem: {why}", shown::path(file)))
}

/// Table with a row for each row of the problem.
fn table_of(problem: &ContactProblem, solution: &Solution) -> String {
    let mut text = String::from("group,row,impulse,velocity\n");
    for group in 0..problem.laws().len() {
        for (k, row) in problem.rows(group).enumerate() {
            let (impulse, velocity) = (solution.impulses[row], solution.velocities[row]);
            let _ = writeln!(text, "{group},{k},{impulse:?},{velocity:?}");
        }
    }
    text
}

/// Table of all problems.
fn summary_of(all: &[SolvedProblem], unread: &[Unread]) -> String {
    let mut text = String::from(
        "problem,groups,rows,parts,status,residual,relative_error,iterations,start,selected,seconds\n",
    );
    for SolvedProblem { name, groups, rows, solution, seconds, .. } in all {
        let Solution { parts, residual, relative_error, iterations, start, selected, .. } =
            solution;
        let (name, status) = (plain(name), status_of(solution));
        let _ = writeln!(
            text,
            "{name},{groups},{rows},{parts},{status},{residual:e},{relative_error:e},{iterations},\
             {start},{selected},{seconds:e}"
        );
    }
    for Unread { name, .. } in unread {
        let _ = writeln!(text, "{},,,,unread,,,,,,", plain(name));
    }
    text
}

/// A name as a field of CSV without quotes.
fn plain(name: &str) -> String {
    name.replace(['"', ',', '\n', '\r'], "_")
}

fn status_of(solution: &Solution) -> &'static str {
    if solution.is_solved() { "solved" } else { "unsolved" }
}

/// Writes all files and describes them.
fn write(
    target: &SolutionFile<'_>,
    all: &[SolvedProblem],
    unread: &[Unread],
) -> Result<String, Failure> {
    let (folder, names) = match target {
        SolutionFile::File(folder, name) => (folder, vec![name.to_string_lossy().into_owned()]),
        SolutionFile::Directory(folder) => {
            (folder, all.iter().map(|solved| format!("{}.solution.csv", solved.name)).collect())
        }
    };
    let directory = OutputDirectory::for_pictures(folder)?;
    let mut files = Vec::with_capacity(all.len() + 1);
    for (name, solved) in names.iter().zip(all) {
        let file = PendingFile::create(&directory, name)?;
        file.write(solved.csv.as_bytes())?;
        files.push(file);
    }
    if matches!(target, SolutionFile::Directory(_)) {
        let file = PendingFile::create(&directory, "problems.csv")?;
        file.write(summary_of(all, unread).as_bytes())?;
        files.push(file);
    }
    let count = files.len();
    let paths = files.into_iter().map(PendingFile::publish).collect::<Result<Vec<_>, _>>()?;
    Ok(match (count, paths.last()) {
        (1, Some(path)) => shown::path(path),
        _ => format!("{} solutions and problems.csv to {}", all.len(), shown::path(folder)),
    })
}

/// Summary on the terminal.
fn described(all: &[SolvedProblem], unread: &[Unread]) -> String {
    let widest =
        all.iter().map(|solved| solved.name.chars().count()).max().unwrap_or(0).clamp(7, 60);
    let mut text = format!(
        "{:widest$}  groups  parts  status    residual m/s  relative error  iterations     ms  start\n",
        "problem"
    );
    for SolvedProblem { name, groups, solution, seconds, .. } in all {
        let _ = writeln!(
            text,
            "{:widest$} {groups:7} {:6}  {:8}  {:12.1e} {:15.1e} {:11} {:6.3}  {}",
            shown::line(name),
            solution.parts,
            status_of(solution),
            solution.residual,
            solution.relative_error,
            solution.iterations,
            seconds * 1e3,
            solution.start,
        );
    }
    let solved = all.iter().filter(|solved| solved.solution.is_solved()).count();
    if !unread.is_empty() {
        let _ = writeln!(text, "{} files could not be read", unread.len());
    }
    if all.len() > 1 {
        let seconds: f64 = all.iter().map(|solved| solved.seconds).sum();
        let worst = all.iter().map(|solved| solved.solution.residual).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "{solved} of {} solved, {:.3} ms on average, largest residual {worst:.1e} m/s",
            all.len(),
            seconds / all.len() as f64 * 1e3
        );
    }
    text
}
