//! Text of a scene in the notation `[body]`.

use super::quoted;
use crate::scene::Scene;
use nalgebra::Vector3;
use std::fmt::{Result, Write as _};
use tumble_core::mechanics::Polyline;
use tumble_core::mechanics::body::box_corners;
use tumble_model::fields::by_rows;

/// Writes a scene of one body, including the name of its solver.
pub fn text(out: &mut String, scene: &Scene) -> Result {
    let world = &scene.world;
    let (body, start, load) = (&world.bodies()[0], &scene.starts[0], &scene.loads[0]);
    let three = |vector: &Vector3<f64>| <[f64; 3]>::from(*vector);
    writeln!(out, "name = {}\nsteps = {}", quoted(&scene.name), scene.rows)?;
    if scene.start_index > 0 {
        writeln!(out, "start_index = {}", scene.start_index)?;
    }
    writeln!(out, "time_step = {:?}\ngravity = {:?}", world.time_step(), three(world.gravity()))?;
    if let (Some(contact), Some(ground)) = (&scene.contact, world.ground()) {
        writeln!(out, "rotation = \"{}\"\n\n[ground]", world.rotation().name())?;
        writeln!(out, "normal = {:?}\noffset = {:?}", three(ground.normal()), ground.offset())?;
        writeln!(out, "friction = {:?}", world.friction())?;
        if world.restitution() != 0.0 {
            writeln!(out, "restitution = {:?}", world.restitution())?;
        }
        if let Some(speed) = world.given_rebound_speed() {
            writeln!(out, "rebound_speed = {speed:?}")?;
        }
        writeln!(out, "\n[solver]\nname = \"{}\"", contact.solver_name())?;
    }
    let points: Vec<_> = body.contact_points().iter().map(|point| point.position).collect();
    let half = points.iter().fold(Vector3::zeros(), |half: Vector3<f64>, c| half.sup(&c.abs()));
    // In this notation the only possible piece is a box.
    if !body.pieces().is_empty() && points == box_corners(&half) {
        writeln!(out, "\n[body]\nbox = {:?}", three(&(2.0 * half)))?;
    } else {
        writeln!(out, "\n[body]\npoints = {:?}", points.iter().map(three).collect::<Vec<_>>())?;
    }
    let inertia = by_rows(body.inertia()).0.map(|row| row.0);
    writeln!(out, "mass = {:?}\ninertia = {inertia:?}", body.mass())?;
    writeln!(out, "\n[start]\nposition = {:?}", three(&start.position))?;
    writeln!(out, "attitude = {:?}", <[f64; 4]>::from(start.attitude))?;
    writeln!(out, "velocity = {:?}", three(&start.velocity))?;
    writeln!(out, "spin = {:?}", three(&start.spin))?;
    if load.is_none() {
        return Ok(());
    }
    writeln!(out, "\n[load]")?;
    for (field, line) in [("force", &load.force), ("torque", &load.torque)] {
        if !line.knots().is_empty() {
            writeln!(out, "{field} = {:?}", knots(line))?;
        }
    }
    if !load.force.knots().is_empty() {
        writeln!(out, "at = {:?}", three(load.point()))?;
    }
    Ok(())
}

fn knots(line: &Polyline) -> Vec<[f64; 4]> {
    line.knots().iter().map(|(time, v)| [*time, v[0], v[1], v[2]]).collect()
}
