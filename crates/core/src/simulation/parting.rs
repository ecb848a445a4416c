//! Overlaps of initial states. They are removed by a displacement, which gives no velocity: a step of
//! bodies at rest without loads, drives and moving surfaces, of which only the poses are kept.

use super::Motion;
use super::inputs::Inputs;
use super::interval::Interval;
use super::moment::Moment;
use super::one_interval;
use super::workspace::Workspace;
use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::World;
use nalgebra::Vector3;

/// Depth that counts as rounding, as a share of the world's reach.
const ROUNDING: f64 = 1e-12;
/// Largest number of displacements. Contact planes are fixed during each.
const MOST: u32 = 4;

/// Displacement of a body by which overlaps of an initial state were removed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Parting {
    /// Body with the largest displacement.
    pub body: usize,
    /// Length of its displacement (m).
    pub distance: f64,
}

/// Removes the overlaps at the states of `moment` that are deeper than rounding. Returns the largest
/// displacement; `None` without overlaps, if they cannot be removed, for other solvers than the
/// native one, and with [`Integrator::Euler`](crate::world::Integrator). The first step then removes them
/// at the speed depth/h.
pub(super) fn part(
    world: &World,
    moment: &mut Moment,
    workspace: &mut Workspace<'_>,
) -> Option<Parting> {
    moment.instants.as_ref()?;
    let Motion::Contact { solver, .. } = &mut workspace.motion else { return None };
    solver.islands()?;
    let least = ROUNDING * world.reach();
    if depth(world, &moment.now.states, moment, workspace) <= least {
        return None;
    }
    let still = world.without_motion();
    let zero = Vector3::zeros();
    let at_rest = |state: &State| State { velocity: zero, spin: zero, ..*state };
    let starts = moment.now.states.clone();
    let mut parted = Moment { instants: None, ..moment.clone() };
    parted.forget_past();
    let mut taken = Interval::default();
    for _ in 0..MOST {
        parted.now.states.iter_mut().for_each(|state| *state = at_rest(state));
        let lift =
            |body: &RigidBody| Wrench { force: -world.gravity() * body.mass(), torque: zero };
        workspace.wrenches.clear();
        workspace.wrenches.extend(world.bodies().iter().map(lift));
        workspace.forget();
        let inputs = Inputs::none(starts.len());
        let solved = one_interval::solve(&still, &mut parted, &inputs, workspace, &mut taken);
        if solved.is_err() || !taken.report.status.is_solved() {
            break;
        }
        parted.now.states.clone_from(&taken.solution.states);
        if depth(world, &taken.solution.states, moment, workspace) <= least {
            break;
        }
    }
    workspace.forget();
    let before = depth(world, &starts, moment, workspace);
    if depth(world, &parted.now.states, moment, workspace) >= 0.5 * before {
        return None;
    }
    let angles: Vec<_> = moment.now.joints.iter().map(|joint| joint.angles).collect();
    let near = world.angles_near(&parted.now.states, &angles);
    moment.now.joints.iter_mut().zip(near).for_each(|(joint, angles)| joint.angles = angles);
    let pose = |to: &mut State, from: &State| {
        (to.position, to.attitude) = (from.position, from.attitude);
    };
    for (body, state) in parted.now.states.iter().enumerate() {
        pose(&mut moment.now.states[body], state);
        moment.instants.iter_mut().for_each(|instants| pose(&mut instants.states[body], state));
    }
    let moved = starts.iter().zip(&moment.now.states).zip(world.bodies()).enumerate();
    let moved = moved.map(|(body, ((from, to), of))| {
        let turned = (to.pose().rotation - from.pose().rotation).norm() * of.reach();
        Parting { body, distance: (to.position - from.position).norm() + turned }
    });
    moved.max_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Largest depth of a body at `states` in another one or below the ground (m).
fn depth(world: &World, states: &[State], moment: &Moment, workspace: &mut Workspace<'_>) -> f64 {
    let mut search = moment.search.clone();
    let overlap = workspace.search(world, &mut search, |candidates| {
        candidates.deepest_overlap(world, states).map_or(0.0, |(depth, ..)| depth)
    });
    let heights = states
        .iter()
        .enumerate()
        .flat_map(|(body, state)| world.heights(body, &state.pose()).collect::<Vec<_>>());
    heights.fold(overlap, |depth, height| depth.max(-height))
}
