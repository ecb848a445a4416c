//! `--export-problems`: writes the contact problem of every step of a run to a file.

use super::directory::{OutputClaims, OutputDirectory, names_in};
use super::outcome::Failure;
use super::output::PendingFile;
use super::scene::Scene;
use std::path::Path;
use tumble::problem::{ContactProblem, dat};
use tumble_core::simulation::StepRecord;
use tumble_core::world::World;
use tumble_model::shown;

/// A checked folder for contact problems.
pub struct ExportPath<'a>(&'a Path);

/// A folder with the problems written so far.
pub struct Exported {
    directory: OutputDirectory,
    count: u64,
    /// Number of removed problems of an earlier run.
    removed: usize,
}

impl Exported {
    /// Checks that the steps of `scene` have contact problems. `out` is the folder of the run's own
    /// files.
    pub fn check<'a>(path: &'a Path, scene: &Scene, out: &Path) -> Result<ExportPath<'a>, Failure> {
        let refused = |why: &str| {
            Err(Failure::Input(format!("--export-problems {}: {why}", shown::path(path))))
        };
        match &scene.contact {
            None => refused("the scene floats: its steps have no contacts"),
            Some(contact) if contact.ipopt.is_some() => {
                refused("Ipopt's steps are not exact enough; use --solver native")
            }
            Some(_) if !scene.world.joints().is_empty() => {
                refused("the scene has joints, which contact problems do not support")
            }
            Some(_) if scene.world.has_turning_friction() => refused(
                "the scene has rolling or torsional friction, which Siconos' format cannot hold; leave it out",
            ),
            Some(_) if is_same(path, out) => {
                refused("this is the directory of the run itself; choose another")
            }
            Some(_) => Ok(ExportPath(path)),
        }
    }

    /// Creates the folder. Problems from step `from` on are refused, or removed with `overwrite`.
    /// All problems in the folder must belong to one run.
    pub fn begin(
        path_of_export: ExportPath<'_>,
        from: u64,
        overwrite: bool,
    ) -> Result<Self, Failure> {
        let is_former = |name: &String| index_of(name).is_some_and(|index| index >= from);
        let alike = names_in(path_of_export.0).into_iter().filter(is_former).collect();
        let claims = OutputClaims { files: Vec::new(), alike, overwrite, continues: false };
        let directory = OutputDirectory::for_run(path_of_export.0, claims)?;
        let removed = directory.remove_former(&[])?.len();
        Ok(Self { directory, count: 0, removed })
    }

    /// Writes the problems of a step with contacts, one an interval.
    pub fn write(&mut self, world: &World, record: &StepRecord) -> Result<(), Failure> {
        let failed = |error| Failure::Other(format!("step {}: {error}", record.index));
        for (number, interval) in record.intervals().iter().enumerate() {
            if interval.contacts.is_empty() {
                continue;
            }
            let world = interval.world(world);
            let (problem, _) = ContactProblem::from_interval(&world, interval).map_err(failed)?;
            let text = dat::write(&problem).map_err(failed)?;
            let file = PendingFile::create(&self.directory, &name_of(record.index, number))?;
            file.write(text.as_bytes())?;
            file.publish()?;
            self.count += 1;
        }
        Ok(())
    }

    /// Summary of the written files.
    pub fn described(&self) -> String {
        let folder = shown::path(self.directory.path());
        let mut text = format!("wrote {} contact problems to {folder}\n", self.count);
        if self.removed > 0 {
            text += &format!("removed {} from an earlier run there\n", self.removed);
        }
        text
    }
}

/// True if two paths are the same place. Their last parts need not exist.
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

/// File name that sorts by step. Later intervals of a step have their number.
fn name_of(index: u64, interval: usize) -> String {
    match interval {
        0 => format!("step-{index:08}.dat"),
        later => format!("step-{index:08}-{later:05}.dat"),
    }
}

/// Step index of a file with such a name.
fn index_of(name: &str) -> Option<u64> {
    let numbers = name.strip_prefix("step-")?.strip_suffix(".dat")?;
    let (index, interval) = numbers.split_once('-').unwrap_or((numbers, "0"));
    let (index, interval) = (index.parse().ok()?, interval.parse().ok()?);
    (name_of(index, interval) == name).then_some(index)
}
