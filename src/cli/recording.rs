//! A run as files, of one body or of several, to be drawn.

use super::args::PhysicsArgs;
use super::film::film;
use super::outcome::Failure;
use super::several::{self, RunTables};
use super::source::TrajectoryFile;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tumble_pictures::Film;

/// The files of a run.
pub enum Recording<'a> {
    One(Box<TrajectoryFile<'a>>),
    Several(Box<RunTables>),
}

impl<'a> Recording<'a> {
    /// Opens the files of which `path` is one: the run.json beside it says of which kind they are.
    pub fn open(path: &'a Path, flags: &PhysicsArgs) -> Result<Self, Failure> {
        if let Some(tables) = RunTables::open(path, flags)? {
            return Ok(Self::Several(Box::new(tables)));
        }
        TrajectoryFile::open(path, flags).map(|file| Self::One(Box::new(file)))
    }

    /// What must be said of parameters that no run.json has; empty where one has them.
    pub fn note(&self) -> &'static str {
        match self {
            Self::One(file) => file.source.note(),
            Self::Several(_) => "",
        }
    }

    /// The note as a line to print; empty where there is nothing to say.
    pub fn note_line(&self) -> String {
        let note = self.note();
        if note.is_empty() { String::new() } else { format!("note: {note}\n") }
    }

    /// All rows in memory, to be drawn; more than `most` of them, or more than memory should hold,
    /// are refused. `None` if `interrupt` is raised.
    pub fn film(self, most: usize, interrupt: &AtomicBool) -> Result<Option<Film>, Failure> {
        match self {
            Self::One(file) => film(*file, most, interrupt),
            Self::Several(tables) => several::film(*tables, most, interrupt),
        }
    }
}
