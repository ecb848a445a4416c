//! `tumble fit`: parameters from recorded tosses.

mod data;
mod describe;
mod files;
mod memory;
mod names;
mod page;
mod results;
mod task;

use super::args::FitArgs;
use super::directory::OutputDirectory;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, Voice, progress_bar};
use super::shown;
use super::signals::raise_on_signals;
use memory::FileMemory;
use rayon::ThreadPoolBuilder;
use results::Results;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use task::Task;
use tumble::fit::FitError;

/// What is written at last; the state of a fit is not among them.
const FILES: [&str; 4] = ["fit.json", "tosses.csv", "fitted.toml", "fit.html"];

/// `tumble fit`.
pub fn run(args: &FitArgs) -> Result<Outcome, Failure> {
    let task = Task::new(args)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let out = OutputDirectory::for_run(&args.out)?;
    let bar = progress_bar(task.evaluations() as u64, "evaluations", args.quiet);
    let mut memory = FileMemory::open(&out, &task.fingerprint(), bar)?;
    let mut voice = Voice::new(args.quiet);
    if memory.known() > 0 {
        voice.say(&format!("going on after {} evaluations\n", memory.known()));
    }
    let mut pool = ThreadPoolBuilder::new();
    if let Some(threads) = args.threads {
        pool = pool.num_threads(threads.get());
    }
    let pool = pool
        .build()
        .map_err(|error| Failure::Other(format!("the threads cannot be started: {error}")))?;
    let found = pool.install(|| Results::find(&task, &mut memory, &interrupt));
    let results = match found {
        Ok(results) => results,
        Err(FitError::Interrupted) => {
            let state = shown::path(memory.path());
            voice.say(&format!(
                "interrupted after {} evaluations, which {state} keeps: the same command goes on\n",
                memory.made()
            ));
            return voice.end(Outcome::Interrupted);
        }
        Err(error) => return Err(memory.failure().unwrap_or_else(|| refused(error))),
    };
    let texts = [
        files::json(&task, &results)?,
        files::table(&task, &results)?,
        files::scenario(&task, &results)?,
        page::page(&task, &results),
    ];
    let mut written = Vec::new();
    // Not before: a fit takes long, and one that is killed would leave them behind.
    for (name, text) in FILES.into_iter().zip(texts) {
        let file = PendingFile::create(&out, name)?;
        file.write(text.as_bytes())?;
        written.push(file);
    }
    let written = written.into_iter().map(PendingFile::publish);
    let written = written.collect::<Result<Vec<_>, _>>()?;
    memory.remove()?;
    let paths: Vec<_> = written.iter().map(|path| shown::path(path)).collect();
    voice.say(&(describe::describe(&task, &results) + &format!("wrote {}\n", paths.join(", "))));
    let failed = results.failed > 0;
    voice.end(if failed { Outcome::Unconverged } else { Outcome::Done })
}

/// The library refuses: bad input.
fn refused(error: FitError) -> Failure {
    Failure::Input(error.to_string())
}
