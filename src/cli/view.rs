//! `tumble view`, and `--html` of a simulation: trajectories as a page for the browser.

use super::args::{SimulateArgs, ViewArgs};
use super::job::Job;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, create_directory, directory_of, say};
use super::run_file::RunFile;
use super::source::TrajectoryFile;
use crate::pictures::Film;
use crate::pictures::view::{Fact, Run, page};
use std::path::Path;
use tumble::solver::StepStatus;

/// Rows that a run of the page may have: they are all in memory, 0.8 kB each.
pub const MOST_ROWS: usize = 1_000_000;

/// `tumble view`.
pub fn run(args: &ViewArgs) -> Result<Outcome, Failure> {
    let mut films = Vec::new();
    let mut notes = String::new();
    for path in &args.files {
        let file = TrajectoryFile::open(path, &args.physics)?;
        if !file.source.note.is_empty() {
            notes += &format!("note: {}: {}\n", path.display(), file.source.note);
        }
        films.push((path.as_path(), file.film(MOST_ROWS)?));
    }
    let directory = directory_of(args.out.as_deref(), &args.files[0]);
    create_directory(directory)?;
    let shown: Vec<_> = films.iter().map(|(path, film)| (*path, film)).collect();
    let written = write(pending(directory)?, &shown)?;
    if !args.quiet {
        say(&(notes + &written))?;
    }
    let failed = |film: &Film| film.rows.iter().any(|row| row.status == StepStatus::Failed);
    let unconverged = films.iter().any(|(_, film)| failed(film));
    Ok(if unconverged { Outcome::Unconverged } else { Outcome::Done })
}

/// Refuses, before a simulation, what would be refused after it.
pub fn check(args: &SimulateArgs, job: &Job) -> Result<(), Failure> {
    if args.html && job.rows > MOST_ROWS as u64 {
        return Err(Failure::Input(format!("--html: a page is made of at most {MOST_ROWS} rows")));
    }
    Ok(())
}

/// Opens a temporary file for the page: what stands in the way shows before the work.
pub fn pending(directory: &Path) -> Result<PendingFile, Failure> {
    PendingFile::create(directory, "view.html")
}

/// Writes the page of one or two films, which were read from the files named; the sentence
/// on it.
pub fn write(pending: PendingFile, films: &[(&Path, &Film)]) -> Result<String, Failure> {
    let several = films.len() > 1;
    let runs = films.iter().map(|(path, film)| {
        let mut facts = known_facts(path)?;
        if several {
            facts.insert(0, Fact::new("file", path.display().to_string()));
        }
        Ok(Run { film, facts })
    });
    let page = page(&runs.collect::<Result<Vec<_>, Failure>>()?)
        .map_err(|why| Failure::Other(format!("the page cannot be made: {why}")))?;
    pending.write(page.as_bytes())?;
    let path = pending.publish()?;
    Ok(format!("wrote {} ({:.2} MB)\n", path.display(), page.len() as f64 / 1e6))
}

/// What run.json beside the trajectory says besides the model's constants.
fn known_facts(trajectory: &Path) -> Result<Vec<Fact>, Failure> {
    let Some(run) = RunFile::read(&trajectory.with_file_name("run.json"))? else {
        return Ok(Vec::new());
    };
    let solver = run.solver;
    let mut facts = vec![Fact::new("scene", run.scene)];
    if run.start.random {
        facts.push(Fact::new("seed", run.seed.to_string()));
    }
    facts.push(Fact::new("solver", solver.name));
    let mut add = |name, value: Option<String>| facts.extend(value.map(|v| Fact::new(name, v)));
    add("detection", solver.detection);
    add("on failure", solver.on_failure);
    add("tolerance", solver.tol.map(|tol| format!("{tol:e}")));
    add("iteration limit", solver.max_iter.map(|limit| limit.to_string()));
    add("outcome", Some(run.outcome).filter(|outcome| outcome != "complete"));
    add("tumble", Some(run.tumble_version));
    Ok(facts)
}
