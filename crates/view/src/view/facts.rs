//! Parameters of a film as text.

use crate::film::{Fact, Film, slope};
use crate::shape::{Shape, is_box};
use nalgebra::{Matrix3, Vector3};
use tumble_core::mechanics::load::Polyline;
use tumble_core::world::Plane;

/// Facts of the run behind `film`, such as its number of rows and its time step.
pub fn record_facts(film: &Film) -> Vec<Fact> {
    let mut facts = vec![
        Fact::new("rows", film.frames.len().to_string()),
        Fact::new("time step h", format!("{} s", number(film.world.time_step()))),
    ];
    if film.every > 1 {
        facts.push(Fact::new("rows of steps", format!("one of {}", film.every)));
    }
    facts.extend_from_slice(&film.facts);
    facts
}

/// Scene of `film`.
pub fn scene_facts(film: &Film) -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut add = |name, value| facts.push(Fact::new(name, value));
    let mass = film.world.bodies().iter().map(|body| body.mass()).sum::<f64>();
    add("bodies", film.bodies.len().to_string());
    if !film.fixed.is_empty() {
        add("fixed", film.fixed.len().to_string());
    }
    if !film.joints.is_empty() {
        add("joints", film.joints.len().to_string());
    }
    add("mass of all", format!("{} kg", number(mass)));
    if film.may_touch() {
        add("friction μ", number(film.world.friction()));
    }
    add("gravity g", format!("{} m/s²", vector(film.world.gravity())));
    add("ground", film.ground.as_ref().map_or("none".to_owned(), plane));
    facts
}

/// Parameters and initial state of body `b`.
pub fn body_facts(film: &Film, b: usize) -> Vec<Fact> {
    let (body, look) = (&film.world.bodies()[b], &film.bodies[b]);
    let mut facts = Vec::new();
    let mut add = |name, value| facts.push(Fact::new(name, value));
    add("body", shape(&look.shapes));
    add("mass m", format!("{} kg", number(body.mass())));
    let load = &look.load;
    for (name, knots, unit) in [("force", &load.force, "N"), ("torque", &load.torque, "N m, body")]
    {
        if !knots.knots().is_empty() {
            add(name, polyline(knots, unit));
        }
    }
    if *load.point() != Vector3::zeros() {
        add("force at", format!("{} m, body", vector(load.point())));
    }
    if let Some(state) = film.frames.first().map(|frame| &frame.instant_states()[b]) {
        // Velocity scale: a body that falls by its own size.
        let reach = look.reach();
        let speed = (film.world.gravity().norm() * reach).sqrt();
        let (at, v, spin) = (&state.position, &state.velocity, &state.spin);
        add("start position", format!("{} m", cleaned(at, reach)));
        add("start velocity", format!("{} m/s", cleaned(v, speed)));
        add("start spin", format!("{} rad/s", cleaned(spin, speed / reach)));
    }
    add("inertia I", format!("{} kg m²", inertia(body.inertia())));
    facts
}

/// Formats six significant digits without trailing zeros. Very small and large numbers have a
/// power of ten.
fn number(value: f64) -> String {
    // The sum turns −0 into 0.
    let value = format!("{value:.5e}").parse::<f64>().unwrap_or(value) + 0.0;
    let size = value.abs();
    if size >= 1e6 || (size > 0.0 && size < 1e-4) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

fn list(values: impl Iterator<Item = f64>) -> String {
    values.map(number).collect::<Vec<_>>().join(", ")
}

fn vector(v: &Vector3<f64>) -> String {
    format!("({})", list(v.iter().copied()))
}

/// Formats a vector with rounding errors removed. Components below 1e-9 of its length, or of
/// `size` if that is larger, become 0.
fn cleaned(v: &Vector3<f64>, size: f64) -> String {
    let least = 1e-9 * if size.is_finite() { size.max(v.norm()) } else { v.norm() };
    vector(&v.map(|x| if x.abs() < least { 0.0 } else { x }))
}

/// Height of a horizontal plane. Otherwise slope and n · x = d, with four digits.
fn plane(ground: &Plane) -> String {
    if *ground.normal() == Vector3::z() {
        return format!("level, z = {} m", number(ground.offset()));
    }
    let round = |x: f64| (x * 1e4).round() / 1e4;
    let normal = vector(&ground.normal().map(round));
    format!(
        "slope {}°, normal {normal}, offset {} m",
        round(slope(ground)),
        number(ground.offset())
    )
}

/// First knots of a load over time.
fn polyline(line: &Polyline, unit: &str) -> String {
    let knots = line.knots();
    if let [(_, constant)] = knots {
        return format!("{} {unit}", vector(constant));
    }
    let shown = knots.iter().take(4);
    let mut words: Vec<_> =
        shown.map(|(t, value)| format!("{} at {} s", vector(value), number(*t))).collect();
    if knots.len() > words.len() {
        words.push(format!("… {} knots", knots.len()));
    }
    format!("{} {unit}", words.join(", "))
}

/// Inertia as a multiple of the identity, as a diagonal, or with all rows.
fn inertia(inertia: &Matrix3<f64>) -> String {
    // Entries at the level of rounding become 0.
    let least = 1e-15 * inertia.amax();
    let inertia = &inertia.map(|entry| if entry.abs() < least { 0.0 } else { entry });
    let moments = inertia.diagonal();
    if *inertia == Matrix3::from_diagonal_element(moments[0]) {
        return format!("{} E₃", number(moments[0]));
    }
    if *inertia == Matrix3::from_diagonal(&moments) {
        return format!("diag{}", vector(&moments));
    }
    let rows = inertia.row_iter().map(|row| list(row.iter().copied()));
    format!("[{}]", rows.collect::<Vec<_>>().join("; "))
}

fn shape(shapes: &[Shape]) -> String {
    match shapes {
        [one] => solid(one),
        pieces => {
            let is_mesh = |shape: &Shape| matches!(shape, Shape::Mesh(_));
            let convex = if pieces.iter().any(is_mesh) { "" } else { "convex " };
            format!("{} {convex}pieces", pieces.len())
        }
    }
}

fn solid(shape: &Shape) -> String {
    let (core, radius) = match shape {
        Shape::Points(points) => {
            let s = if points.len() == 1 { "" } else { "s" };
            return format!("{} contact point{s}", points.len());
        }
        Shape::Mesh(mesh) => return format!("mesh of {} triangles", mesh.triangles.len()),
        Shape::Convex { name: Some(name), .. } => return name.clone(),
        Shape::Convex { core, radius, .. } => (core, *radius),
    };
    let sharp = match core.vertices() {
        [_] => return format!("sphere of radius {} m", number(radius)),
        [a, b] => {
            let length = number((b - a).norm());
            return format!("capsule of radius {} m about {length} m", number(radius));
        }
        corners if is_box(corners) => {
            let edges = [1, 2, 4].map(|corner| number((corners[corner] - corners[0]).norm()));
            format!("box {} × {} × {} m", edges[0], edges[1], edges[2])
        }
        corners => format!("hull of {} corners and {} faces", corners.len(), core.faces().len()),
    };
    if radius == 0.0 { sharp } else { format!("{sharp}, rounded by {} m", number(radius)) }
}

#[cfg(test)]
#[path = "tests/facts.rs"]
mod tests;
