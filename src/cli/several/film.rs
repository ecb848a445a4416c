//! The tables of a run of several bodies as a film.

use super::run_file::SeveralRun;
use super::tables::RunTables;
use crate::cli::film::{Frames, settings_facts};
use crate::cli::outcome::Failure;
use crate::cli::run_file::heading;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::contact::Partner;
use tumble::film::{self, Cast, Keys};
use tumble::simulation::tables::TableStep;
use tumble::world::World;
use tumble_pictures::{Fact, Film};

/// All steps in memory, to be drawn; more than `most` of them, or more than memory should hold, are
/// refused. `None` if `interrupt` is raised.
pub fn film(
    mut tables: RunTables,
    most: usize,
    interrupt: &AtomicBool,
) -> Result<Option<Film>, Failure> {
    let (path, mut keys) = (tables.steps_file(), Keys::new());
    let mut frames = Frames::new(&path, most);
    while let Some(step) = tables.next_step()? {
        if interrupt.load(Ordering::Relaxed) {
            return Ok(None);
        }
        check_contacts(&tables.world, &step).map_err(|why| tables.odd(&why))?;
        frames.push(film::frame(&tables.world, &step, &mut keys))?;
    }
    let RunTables { run, world, loads, .. } = tables;
    let bodies: Vec<_> = run.model.bodies.iter().map(|body| body.name.as_str()).collect();
    let fixed: Vec<_> = run.model.fixed.iter().map(|fixed| fixed.name.as_str()).collect();
    let cast =
        Cast { world: &world, bodies: &bodies, fixed: &fixed, loads: &loads, floating: false };
    let mut film = film::film(cast, frames.all());
    film.title = title(&run);
    film.facts = facts(run);
    Ok(Some(film))
}

/// Contacts must be of what there is.
fn check_contacts(world: &World, step: &TableStep) -> Result<(), String> {
    let (bodies, fixed) = (world.bodies().len(), world.fixed().len());
    for (number, row) in step.contacts.iter().enumerate() {
        let is_there = match row.partner {
            Partner::Ground => world.ground().is_some(),
            Partner::Fixed(index) => index < fixed,
            Partner::Body(index) => index < bodies && index != row.body,
        };
        if row.body >= bodies || !is_there {
            return Err(format!(
                "contact {number} of step {} is between things that are not in run.json",
                step.row.index
            ));
        }
    }
    Ok(())
}

/// Scene, seed and solver.
fn title(run: &SeveralRun) -> String {
    let seed = if run.drawn { format!("seed {}, ", run.seed) } else { String::new() };
    format!("{}, {seed}{}", heading(&run.scene, &run.changed), run.solver.name)
}

/// What run.json says besides the model's constants.
fn facts(run: SeveralRun) -> Vec<Fact> {
    let seed = run.drawn.then_some(run.seed);
    let mut facts = settings_facts(run.scene, &run.changed, seed, run.solver);
    facts.push(Fact::new("largest overlap", format!("{:.1e} m", run.largest_overlap_m)));
    if run.outcome != "complete" {
        facts.push(Fact::new("outcome", run.outcome));
    }
    facts.push(Fact::new("tumble", run.tumble_version));
    facts
}
