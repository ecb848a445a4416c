//! Recordings from tables.

use crate::arrays::{Numbers, numbers};
use crate::errors::refused;
use crate::recording::{PyRecording, add_forces};
use nalgebra::Vector3;
use pyo3::PyResult;
use std::sync::Arc;
use tumble_scene::output::tables::{IntervalRows, Streams, TableShape, TablesReader, whole_steps};
use tumble_scene::scene::Scene as Content;

/// Reads a run or a part of one from its tables, or with the `forces` (K - 1, N, 3) of a run without
/// recorded contacts. Unless `all_contacts` have rows, those without force may be missing, and unless they
/// are not short, unchanged states.
pub fn from_tables(
    content: Arc<Content>,
    streams: Streams<&[u8]>,
    (all_contacts, is_short): (bool, bool),
    forces: Option<Numbers<'_>>,
) -> PyResult<PyRecording> {
    let Streams { states, joints, gears, .. } = streams;
    let world = &content.world;
    let tied = (world.joints().len(), world.gears().len());
    for (what, table, count) in [
        ("bodies", Some(states), world.bodies().len()),
        ("joints", joints, tied.0),
        ("gears", gears, tied.1),
    ] {
        let found = table.map_or(count, rows_of_a_step);
        if found != count && found > 0 {
            let why = format!(
                "the tables belong to another scene: they have {found} {what}, this one has \
                 {count}; read them with the scene of their run"
            );
            return Err(refused(why));
        }
    }
    let reader = TablesReader::new(streams, TableShape::new(world));
    let reader = reader.map_err(refused)?.from_any_index().without_idle_contacts(!all_contacts);
    let mut reader = reader.short(is_short);
    let (mut rows, mut sums) = (Vec::<IntervalRows>::new(), Vec::new());
    while let Some(mut row) = reader.next_interval().map_err(refused)? {
        let (k, h) = (row.row.index, world.time_step());
        let begin = k as f64 * h;
        let is_within = row.row.interval > 0 && (begin..begin + h).contains(&row.row.time);
        if !is_within && (row.row.time - begin).abs() > 1e-9 * begin.max(h) {
            let found = row.row.time;
            let why = format!("step {k} has time_s = {found}, but the scene's time step is {h} s");
            return Err(refused(why));
        }
        if !row.contacts.iter().all(|contact| contact.is_in(world)) {
            return Err(refused(format!(
                "a contact of step {k} refers to a body or piece that the scene does not have"
            )));
        }
        if let Some(last) = rows.last_mut() {
            last.share_with(&mut row);
        }
        rows.push(row);
    }
    for step in whole_steps(world, &rows).iter().filter(|step| !step.is_end()) {
        add_forces(step, &mut sums);
    }
    let has_contacts = forces.is_none();
    if let Some(forces) = &forces {
        let given = numbers("forces", forces)?.chunks_exact(3);
        let given: Vec<_> = given.map(Vector3::from_column_slice).collect();
        if given.len() != sums.len() {
            return Err(refused("forces: one per body and step is needed"));
        }
        sums = given;
    }
    // The tables do not say which inputs moved the run.
    Ok(PyRecording { content, rows, forces: sums, has_contacts, is_of_scene: None })
}

/// Number of rows of the first interval in a table of bodies, joints or gears: their numbers in the third
/// column rise up to the next one.
fn rows_of_a_step(table: &[u8]) -> usize {
    let numbers = table.split(|byte| *byte == b'\n').skip(1).map_while(|line| {
        let number = line.split(|byte| *byte == b',').nth(2)?;
        str::from_utf8(number).ok()?.parse::<usize>().ok()
    });
    let mut last = None;
    let rises = |number: &usize| last.replace(*number).is_none_or(|last| last < *number);
    numbers.take_while(rises).count()
}
