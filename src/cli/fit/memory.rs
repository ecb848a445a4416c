//! The state of a fit in a file, so that it can be interrupted and taken up again: one line for
//! each evaluation, in their order.

use crate::cli::directory::OutputDirectory;
use crate::cli::outcome::Failure;
use crate::cli::{input, shown};
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use tumble::fit::{FitError, Query, ScoreMemory, TossScore};

/// The name of the file.
const NAME: &str = "fit-state.jsonl";
/// More bytes than this are no state.
const LARGEST_FILE: u64 = 1 << 31;

/// The first line.
#[derive(Serialize, Deserialize)]
struct Head {
    fit: String,
}

/// What was asked, and the scores of each toss: position, rotation, end, steps, failed, residual.
#[derive(Serialize, Deserialize, PartialEq)]
struct Entry {
    values: Vec<f64>,
    substeps: usize,
    tosses: usize,
    scores: Vec<(f64, f64, f64, u32, u32, f64)>,
}

/// The bits of the values of a query.
fn bits(query: &Query<'_>) -> impl Iterator<Item = u64> {
    query.values.all().iter().map(|(_, value)| value.to_bits())
}

/// Evaluations in the order in which they are made.
pub struct FileMemory {
    path: PathBuf,
    file: File,
    known: VecDeque<Entry>,
    count: usize,
    made: usize,
    bar: ProgressBar,
    failure: Option<Failure>,
}

impl FileMemory {
    /// Takes up the state in `out`, or begins one. A last line that is not whole is dropped: the
    /// program was ended while it wrote it.
    pub fn open(
        out: &OutputDirectory,
        fingerprint: &str,
        bar: ProgressBar,
    ) -> Result<Self, Failure> {
        let path = out.path().join(NAME);
        let name = shown::path(&path);
        let cannot = |what: &str, error: io::Error| {
            Failure::Other(format!("{name} cannot be {what}: {error}"))
        };
        let (mut known, mut whole) = (VecDeque::new(), 0);
        if path.exists() {
            let text = input::bytes(&path, LARGEST_FILE).map_err(|error| cannot("read", error))?;
            for (index, line) in text.split_inclusive(|byte| *byte == b'\n').enumerate() {
                if !line.ends_with(b"\n") {
                    break;
                }
                if index == 0 {
                    let head: Option<Head> = serde_json::from_slice(line).ok();
                    if head.is_none_or(|head| head.fit != fingerprint) {
                        return Err(Failure::Input(format!(
                            "{name} is the state of another fit; remove it, or choose another --out"
                        )));
                    }
                } else {
                    let entry = serde_json::from_slice(line).map_err(|error| {
                        Failure::Input(format!("{name}: line {}: {error}", index + 1))
                    })?;
                    known.push_back(entry);
                }
                whole += line.len() as u64;
            }
        }
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let file = file.map_err(|error| cannot("written", error))?;
        file.set_len(whole).map_err(|error| cannot("written", error))?;
        let count = known.len();
        let mut memory = Self { path, file, known, count, made: 0, bar, failure: None };
        if whole == 0 {
            let head = Head { fit: fingerprint.to_owned() };
            memory.write(&head).map_err(|error| cannot("written", error))?;
        }
        Ok(memory)
    }

    fn write(&mut self, line: &impl Serialize) -> io::Result<()> {
        let mut text = serde_json::to_string(line)?;
        text.push('\n');
        self.file.write_all(text.as_bytes())
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many evaluations were known at the start.
    pub fn known(&self) -> usize {
        self.count
    }

    /// How many were made or remembered so far.
    pub fn made(&self) -> usize {
        self.made
    }

    /// Why it failed to remember.
    pub fn failure(&mut self) -> Option<Failure> {
        self.failure.take()
    }

    /// Removes the state of a fit that is complete.
    pub fn remove(self) -> Result<(), Failure> {
        self.bar.finish_and_clear();
        fs::remove_file(&self.path).map_err(|error| {
            Failure::Other(format!("{} cannot be removed: {error}", shown::path(&self.path)))
        })
    }
}

impl ScoreMemory for FileMemory {
    fn recall(&mut self, query: &Query<'_>) -> Option<Vec<TossScore>> {
        let entry = self.known.pop_front()?;
        let same = entry.values.iter().map(|value| value.to_bits()).eq(bits(query))
            && entry.substeps == query.substeps
            && entry.tosses == query.tosses.len()
            && entry.scores.len() == entry.tosses;
        if !same {
            // Of another program or processor: what follows is not to be used either, and the
            // file no longer tells one fit.
            self.known.clear();
            let name = shown::path(&self.path);
            self.failure = Some(Failure::Input(format!(
                "{name} does not tell this fit's evaluations; remove it, or choose another --out"
            )));
            return None;
        }
        self.bar.inc(1);
        self.made += 1;
        let score = |(position, rotation, end, steps, failed, residual)| TossScore {
            position,
            rotation,
            end,
            steps,
            failed,
            residual,
        };
        Some(entry.scores.into_iter().map(score).collect())
    }

    fn keep(&mut self, query: &Query<'_>, scores: &[TossScore]) -> Result<(), FitError> {
        let failed = || FitError::Request("the state of the fit cannot be kept".to_owned());
        if self.failure.is_some() {
            return Err(failed());
        }
        let row = |s: &TossScore| (s.position, s.rotation, s.end, s.steps, s.failed, s.residual);
        let entry = Entry {
            values: query.values.all().iter().map(|(_, value)| *value).collect(),
            substeps: query.substeps,
            tosses: query.tosses.len(),
            scores: scores.iter().map(row).collect(),
        };
        self.bar.inc(1);
        self.made += 1;
        self.write(&entry).map_err(|error| {
            let name = shown::path(&self.path);
            self.failure = Some(Failure::Other(format!("{name} cannot be written: {error}")));
            failed()
        })
    }
}
