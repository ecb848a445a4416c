//! Sources of the documentation site, for `scripts/site`.
//!
//! In the root of the repository, `site pages OUT RUST RUNS` writes the documents to OUT as a book's sources.
//! Formulas become MathML. Links to source files become links to rustdoc's pages, which are in RUST. A
//! gallery shows the scenarios, with the pictures of their runs from the folder RUNS, each in one of its
//! name. `links.py` checks the links of the finished site.

mod formulas;
mod pages;

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["pages", out, rust, runs] => {
            pages::write(Path::new(out), Path::new(rust), Path::new(runs))
        }
        _ => Err("site pages OUT RUST RUNS".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("site: {error}");
            ExitCode::FAILURE
        }
    }
}

type Done<T = ()> = Result<T, Box<dyn Error>>;

/// `path` from the folder in which `from` is, without `.` and `..`; `None` above the root.
fn beside(from: &Path, path: &str) -> Option<std::path::PathBuf> {
    let mut whole = from.parent()?.to_owned();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => whole = whole.parent()?.to_owned(),
            part => whole.push(part),
        }
    }
    Some(whole)
}
