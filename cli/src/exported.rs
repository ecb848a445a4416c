//! `--export-problems`: the contact problem of every step of a run, a file each.

use super::directory::{Claims, OutputDirectory, names_in};
use super::outcome::Failure;
use super::output::PendingFile;
use super::scene::Scene;
use std::path::Path;
use tumble::problem::{ContactProblem, dat};
use tumble_core::simulation::StepRecord;
use tumble_core::world::World;
use tumble_model::shown;

/// The folder that problems go to, asked for and possible.
pub struct Wanted<'a>(&'a Path);

/// A folder with the problems written so far.
pub struct Exported {
    directory: OutputDirectory,
    count: u64,
    /// How many problems of an earlier run were removed.
    removed: usize,
}

impl Exported {
    /// Whether the steps of `scene`, whose run's own files go to `out`, have contact problems.
    pub fn check<'a>(path: &'a Path, scene: &Scene, out: &Path) -> Result<Wanted<'a>, Failure> {
        let refused = |why: &str| {
            Err(Failure::Input(format!("--export-problems {}: {why}", shown::path(path))))
        };
        match &scene.contact {
            None => refused("the scene floats: its steps have no contacts"),
            Some(contact) if contact.ipopt.is_some() => refused(
                "only the native solver's steps are exact enough; --solver native is needed",
            ),
            Some(_) if !scene.world.joints().is_empty() => {
                refused("the scene has joints, for which contact problems have no words")
            }
            Some(_) if is_same(path, out) => {
                refused("it is the folder of the run's own files; another one is needed")
            }
            Some(_) => Ok(Wanted(path)),
        }
    }

    /// Makes the folder. Problems of the steps `from` there on are in the way, because all in it are solved as one run's;
    /// only with `overwrite` they are removed.
    pub fn begin(wanted: Wanted<'_>, from: u64, overwrite: bool) -> Result<Self, Failure> {
        let is_former = |name: &String| index_of(name).is_some_and(|index| index >= from);
        let alike = names_in(wanted.0).into_iter().filter(is_former).collect();
        let claims = Claims { files: Vec::new(), alike, overwrite, continues: false };
        let directory = OutputDirectory::for_run(wanted.0, claims)?;
        let removed = directory.remove_former(&[])?.len();
        Ok(Self { directory, count: 0, removed })
    }

    /// Writes the problem of a step, where it has contacts.
    pub fn write(&mut self, world: &World, record: &StepRecord) -> Result<(), Failure> {
        if record.contacts.is_empty() {
            return Ok(());
        }
        let failed = |error| Failure::Other(format!("step {}: {error}", record.index));
        let (problem, _) = ContactProblem::of_step(world, record).map_err(failed)?;
        let text = dat::write(&problem).map_err(failed)?;
        let file = PendingFile::create(&self.directory, &name_of(record.index))?;
        file.write(text.as_bytes())?;
        file.publish()?;
        self.count += 1;
        Ok(())
    }

    /// What is said of them.
    pub fn described(&self) -> String {
        let folder = shown::path(self.directory.path());
        let mut text = format!("wrote {} contact problems to {folder}\n", self.count);
        if self.removed > 0 {
            text += &format!("removed {} of an earlier run there\n", self.removed);
        }
        text
    }
}

/// Whether two paths are one place, of which the last parts need not be there.
fn is_same(a: &Path, b: &Path) -> bool {
    let [a, b] = [a, b].map(|path| {
        let is_there = |path: &&Path| path.exists();
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let known = path.ancestors().find(is_there).unwrap_or(&path);
        let rest = path.strip_prefix(known).unwrap_or(Path::new("")).to_owned();
        known.canonicalize().unwrap_or_else(|_| known.to_owned()).join(rest)
    });
    a.components().eq(b.components())
}

/// Names that sort as the steps do.
fn name_of(index: u64) -> String {
    format!("step-{index:08}.dat")
}

/// The step of a file with such a name.
fn index_of(name: &str) -> Option<u64> {
    let index = name.strip_prefix("step-")?.strip_suffix(".dat")?.parse().ok()?;
    (name_of(index) == name).then_some(index)
}
