//! Corrections of infeasible initial states of robots.
//!
//! - Loop constraints that are violated are closed.
//! - Floating robots in the ground or in a fixed body are lifted out.
//! - Pairs that still overlap never collide.
//!
//! The notes of each robot report the corrections.

use super::Assembled;
use crate::bodies::entries::ApartEntry;
use crate::bodies::exact::Owner;
use crate::document::Document;
use nalgebra::Vector3;
use tumble_core::contact::detection::CONTACT_BAND;
use tumble_core::contact::{Candidates, Overlap, Partner};
use tumble_core::mechanics::State;
use tumble_core::simulation::JOINT_AT_THE_START;
use tumble_core::world::World;
use tumble_model::failure::Failure;
use tumble_model::fields::Exactly;

/// Maximum number of lifts of floating robots. Each lift equals the current depth.
const MOST_LIFTS: usize = 200;

/// World of a document in exact form, with the initial states of its robots corrected.
///
/// # Errors
/// A document that the world rejects.
pub fn settled(document: &mut Document, robots: &mut [Assembled]) -> Result<World, Failure> {
    let world = document.world()?;
    let mut states = document.states();
    bring_together(&mut states, robots, &world)?;
    let world = take_out_of_ground(document, &mut states, robots, world)?;
    let world = keep_overlaps_apart(document, &mut states, robots, world)?;
    document.set_starts(&states);
    Ok(world)
}

/// Excludes contacts of a body with a partner.
fn set_apart(
    document: &mut Document,
    world: World,
    body: usize,
    owner: Owner,
) -> Result<World, Failure> {
    let between = Exactly([Owner::Body(body), owner].map(|owner| document.name_of(owner)));
    document.apart.push(ApartEntry { between });
    Ok(world.with_apart(body, document.partner(owner))?)
}

/// Closes violated loop constraints of robots by the smallest change of the poses, if possible.
fn bring_together(
    states: &mut Vec<State>,
    robots: &mut [Assembled],
    world: &World,
) -> Result<(), Failure> {
    let is_off = |joint: usize| {
        let (place, turn) = world.joints()[joint].error(states).unwrap_or((f64::NAN, f64::NAN));
        place.max(turn) > JOINT_AT_THE_START
    };
    let has_odd = |robot: &Assembled| robot.ties().any(is_off);
    if !robots.iter().any(has_odd) {
        return Ok(());
    }
    // If the loops do not close, the world reports all violated joints later.
    let Ok((found, change)) = world.assemble(states) else { return Ok(()) };
    let tied: Vec<_> = robots.iter().map(has_odd).collect();
    for (robot, is_tied) in robots.iter_mut().zip(tied) {
        robot.start_at(&found).map_err(Failure::Input)?;
        if is_tied {
            robot.note(format!("its loops do not close in the initial pose of the file; {change}"));
        }
    }
    *states = found;
    Ok(())
}

/// Lifts floating trees of robots out of the ground. Disables ground contacts of bodies that are
/// attached to the world and start in the ground. Robots that share their world with others are
/// skipped.
fn take_out_of_ground(
    document: &mut Document,
    states: &mut [State],
    robots: &mut [Assembled],
    mut world: World,
) -> Result<World, Failure> {
    let Some(normal) = world.ground().map(|ground| *ground.normal()) else { return Ok(world) };
    for robot in robots.iter_mut().filter(|robot| robot.is_alone()) {
        let mut hanging = Vec::new();
        for (flying, bodies) in robot.trees() {
            let deep = |body: usize| {
                let heights = world.heights(body, &states[body].pose());
                let lowest = heights.fold(f64::INFINITY, f64::min);
                let allowed = CONTACT_BAND * world.bodies()[body].reach();
                (lowest < -allowed).then_some(-lowest)
            };
            let deep: Vec<_> =
                bodies.iter().filter_map(|body| Some((*body, deep(*body)?))).collect();
            let deepest = deep.iter().map(|(_, depth)| *depth).fold(0.0, f64::max);
            match flying {
                Some(joint) if deepest > 0.0 => {
                    let name = robot.lift(joint, &bodies, normal * deepest, states);
                    robot.note(format!("{name} was lifted {deepest:.3e} m out of the ground"));
                }
                Some(_) => {}
                None => hanging.extend(deep),
            }
        }
        if !hanging.is_empty() {
            let reported = |(body, depth): &(usize, f64)| {
                format!("{} ({depth:.1e} m)", document.bodies[*body].name())
            };
            let reported: Vec<_> = hanging.iter().map(reported).collect();
            robot.note(format!(
                "bodies attached to the world that start in the ground have no contact with it: {}",
                reported.join(", ")
            ));
            for (body, _) in hanging {
                world = set_apart(document, world, body, Owner::Ground)?;
            }
        }
    }
    Ok(world)
}

/// Disables contacts between bodies that overlap at the start.
///
/// - Two links of a robot that overlap beyond rounding never collide, since joints may prevent
///   their separation.
/// - A link attached to the world and a fixed body of the same file never collide if they overlap
///   by more than a start allows.
/// - A floating robot without others in its world is lifted out of fixed bodies.
/// - Other overlaps are kept.
fn keep_overlaps_apart(
    document: &mut Document,
    states: &mut [State],
    robots: &mut [Assembled],
    mut world: World,
) -> Result<World, Failure> {
    let up = -world.gravity();
    let up = if up.norm() > 0.0 { up.normalize() } else { Vector3::z() };
    let mut reported = vec![Vec::new(); robots.len()];
    let mut lifted: Vec<(usize, String, f64)> = Vec::new();
    let mut lifts = 0;
    'search: loop {
        // A search caches the pairs of its world, so each world needs a new one.
        let overlaps = Candidates::new().overlaps_at_start(&world, states);
        let mut is_over = true;
        for Overlap { depth, allowed, between } in overlaps {
            let Some(body) = between.0.body() else { break 'search };
            let within_one = |other: usize| {
                robots.iter().any(|robot| robot.has_body(body) && robot.has_body(other))
            };
            if depth <= allowed && !between.1.body().is_some_and(within_one) {
                continue;
            }
            // Other pieces of a pair that is already excluded.
            if !world.may_touch(body, between.1) {
                continue;
            }
            is_over = false;
            if between.1 == Partner::Ground {
                break 'search;
            }
            let both = |robot: &Assembled| match between.1 {
                Partner::Body(other) => robot.has_body(body) && robot.has_body(other),
                Partner::Fixed(fixed) => robot.has_body(body) && robot.has_fixed(fixed),
                Partner::Ground => false,
            };
            let Some(number) = robots.iter().position(both) else { break 'search };
            let robot = &mut robots[number];
            if matches!(between.1, Partner::Fixed(_)) && !robot.hangs(body) {
                let tree = robot.trees().into_iter().find(|(_, bodies)| bodies.contains(&body));
                let Some((Some(joint), bodies)) = tree.filter(|_| robot.is_alone()) else {
                    break 'search;
                };
                lifts += 1;
                if lifts > MOST_LIFTS {
                    break 'search;
                }
                let name = robot.lift(joint, &bodies, up * depth, states);
                match lifted.iter_mut().find(|known| (known.0, &known.1) == (number, &name)) {
                    Some(known) => known.2 += depth,
                    None => lifted.push((number, name, depth)),
                }
                continue 'search;
            }
            let owner = document.owner(between.1);
            let first = document.bodies[body].name();
            let second = document.object_name(owner);
            reported[number].push(format!("{first} and {second} ({depth:.1e} m)"));
            world = set_apart(document, world, body, owner)?;
        }
        if is_over {
            break;
        }
    }
    for (number, name, by) in lifted {
        robots[number].note(format!("{name} was lifted {by:.3e} m out of a fixed piece"));
    }
    for (robot, reported) in
        robots.iter_mut().zip(reported).filter(|(_, reported)| !reported.is_empty())
    {
        robot.note(format!(
            "pairs that overlap at the start have no contacts: {}",
            reported.join(", ")
        ));
    }
    Ok(world)
}
