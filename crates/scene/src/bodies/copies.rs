//! Copies of what a scenario file says once: in a grid, or in a ring.

use super::entries::{CopiesTable, RingTable, turn};
use nalgebra::Vector3;
use tumble_model::shape::ModelPlace;

/// The most bodies of a scene, so that a short file does not ask for more than memory holds: some 25 kB each while it
/// runs, and 1 kB in run.json, of which [`LARGEST_FILE`](crate::run_file::LARGEST_FILE) is read.
pub const MOST_BODIES: usize = 200_000;
/// The most fixed pieces of a scene.
pub const MOST_FIXED: usize = 10_000;
/// Where one copy is, in its frame, and how its directions are turned against the entry's.
#[derive(Clone, Copy)]
pub struct Copied {
    pub place: ModelPlace,
    pub turned: ModelPlace,
}

/// The copies of what is at `place`: one without copies or ring, at most `room`.
pub fn copies(
    place: ModelPlace,
    grid: Option<&CopiesTable>,
    ring: Option<&RingTable>,
    room: usize,
    what: &str,
) -> Result<Vec<Copied>, String> {
    let count = match (grid, ring) {
        (Some(_), Some(_)) => {
            return Err("copies: either `copies` or `ring` can be given".to_owned());
        }
        (Some(grid), None) => grid.count.0.iter().map(|&count| u128::from(count)).product(),
        (None, Some(ring)) => u128::from(ring.count),
        (None, None) => 1,
    };
    let field = if ring.is_some() { "ring.count" } else { "copies.count" };
    if count == 0 {
        return Err(format!("{field}: counts of 1 and more are needed"));
    }
    if count > room as u128 {
        let most = if what == "bodies" { MOST_BODIES } else { MOST_FIXED };
        return Err(format!("{field}: with these {count} there are more than {most} {what}"));
    }
    let plain = Copied { place, turned: ModelPlace::ORIGIN };
    if let Some(grid) = grid {
        let [nx, ny, nz] = grid.count.0;
        let cells =
            (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        return Ok(cells
            .map(|cell| {
                let mut copy = plain;
                for (axis, number) in cell.into_iter().enumerate() {
                    copy.place.position[axis] += f64::from(number) * grid.step.0[axis];
                }
                copy
            })
            .collect());
    }
    let Some(ring) = ring else { return Ok(vec![plain]) };
    let axis = ring.axis.map_or([0.0, 0.0, 1.0], |axis| axis.0);
    let about = ring.about.map_or(Vector3::zeros(), |about| about.0.into());
    let turned = |number: u32| {
        let attitude =
            turn(&axis, f64::from(number) * ring.degrees).map_err(|why| format!("ring.{why}"))?;
        let only = ModelPlace { position: [0.0; 3], attitude };
        let moved = ModelPlace { position: (about - only.rotation() * about).into(), attitude };
        // The first stays where it is, to the last bit.
        let place = if number == 0 { place } else { place.within(&moved) };
        Ok(Copied { place, turned: only })
    };
    (0..ring.count).map(turned).collect()
}

/// The name of a copy, the `number`-th of `count`: the entry's, or else of what kind it is and its
/// index.
pub fn name_of(
    given: Option<&str>,
    kind: &str,
    index: usize,
    number: usize,
    count: usize,
) -> String {
    match (given, count) {
        (None, _) => format!("{kind}-{index}"),
        (Some(name), 1) => name.to_owned(),
        (Some(name), _) => format!("{name}-{number}"),
    }
}
