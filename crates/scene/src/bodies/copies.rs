//! Copies of an entry in a grid or a ring.

use super::entries::{CopiesTable, RingTable, turn};
use crate::bodies::place::Place;
use nalgebra::Vector3;

/// Maximum number of bodies of a scene, so that a short file cannot exhaust the memory.
///
/// A body needs some 25 kB while it runs, half a gigabyte in all.
pub const MOST_BODIES: usize = 20_000;

/// Maximum number of fixed pieces of a scene.
pub const MOST_FIXED: usize = 10_000;

/// Pose of one copy of an entry.
#[derive(Clone, Copy)]
pub struct Copied {
    /// Pose in the frame of the entry.
    pub place: Place,
    /// Rotation relative to the entry. It also applies to the velocity.
    pub turned: Place,
}

/// Poses of the copies of an object at `place`, at most `room`. Without grid and ring there is one.
pub fn copies(
    place: Place,
    grid: Option<&CopiesTable>,
    ring: Option<&RingTable>,
    room: usize,
    what: &str,
) -> Result<Vec<Copied>, String> {
    let count = match (grid, ring) {
        (Some(_), Some(_)) => {
            return Err("copies: only one of `copies` and `ring` can be given".to_owned());
        }
        (Some(grid), None) => grid.count.0.iter().map(|&count| u128::from(count)).product(),
        (None, Some(ring)) => u128::from(ring.count),
        (None, None) => 1,
    };
    let field = if ring.is_some() { "ring.count" } else { "copies.count" };
    if count == 0 {
        return Err(format!("{field}: counts of 1 or more are needed"));
    }
    if count > room as u128 {
        let most = if what == "bodies" { MOST_BODIES } else { MOST_FIXED };
        return Err(format!("{field}: with these {count} there are more than {most} {what}"));
    }
    let plain = Copied { place, turned: Place::ORIGIN };
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
        let only = Place { position: [0.0; 3], attitude };
        let moved = Place { position: (about - only.rotation() * about).into(), attitude };
        // The first copy keeps its exact place.
        let place = if number == 0 { place } else { place.within(&moved) };
        Ok(Copied { place, turned: only })
    };
    (0..ring.count).map(turned).collect()
}

/// Name of a copy, the `number`-th of `count`.
///
/// It is made from the name of the entry, or else from the kind of object and its index.
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
