//! Parameters of a film as text.

use crate::film::{Fact, Film, FilmBody, FilmGround};
use crate::shape::{FilmHull, FilmPiece, Outline, is_box};
use nalgebra::{Matrix3, Vector3};

/// Facts on `film`, followed by its parameters.
pub fn facts(film: &Film) -> Vec<Fact> {
    let mut facts = film.facts.clone();
    let mut add = |name, value| facts.push(Fact::new(name, value));
    add("rows", film.frames.len().to_string());
    add("time step h", format!("{} s", number(film.time_step)));
    if film.every > 1 {
        add("rows of steps", format!("one of {}", film.every));
    }
    let mass = film.bodies.iter().map(|body| body.mass).sum::<f64>();
    add("bodies", film.bodies.len().to_string());
    if !film.fixed.is_empty() {
        add("fixed", film.fixed.len().to_string());
    }
    if !film.joints.is_empty() {
        add("joints", film.joints.len().to_string());
    }
    add("mass of all", format!("{} kg", number(mass)));
    if film.may_touch() {
        add("friction μ", number(film.friction));
    }
    add("gravity g", format!("{} m/s²", vector(&film.gravity)));
    add("ground", film.ground.as_ref().map_or("none".to_owned(), plane));
    facts
}

/// Parameters and initial state of body `b`.
pub fn of_body(film: &Film, b: usize) -> Vec<Fact> {
    let body = &film.bodies[b];
    let mut facts = Vec::new();
    let mut add = |name, value| facts.push(Fact::new(name, value));
    add("mass m", format!("{} kg", number(body.mass)));
    let load = &body.load;
    for (name, knots, unit) in [("force", &load.force, "N"), ("torque", &load.torque, "N m, body")]
    {
        if !knots.is_empty() {
            add(name, polyline(knots, unit));
        }
    }
    if load.point != Vector3::zeros() {
        add("force at", format!("{} m, body", vector(&load.point)));
    }
    add("inertia I", format!("{} kg m²", inertia(&body.inertia)));
    add("body", shape(body));
    if let Some(pose) = film.frames.first().map(|frame| &frame.poses[b]) {
        // Velocity scale: a body that falls by its own size.
        let reach = body.reach();
        let speed = (film.gravity.norm() * reach).sqrt();
        let (at, v, spin) = (&pose.position, &pose.velocity, &pose.spin);
        add("start position", format!("{} m", cleaned(at, reach)));
        add("start velocity", format!("{} m/s", cleaned(v, speed)));
        add("start spin", format!("{} rad/s", cleaned(spin, speed / reach)));
    }
    facts
}

/// Formats nine significant digits without trailing zeros. Very small and large numbers have a
/// power of ten.
fn number(value: f64) -> String {
    let rounded = format!("{value:.8e}").parse().unwrap_or(value);
    // Turns −0 into 0.
    let value: f64 = rounded + 0.0;
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

/// Formats a vector with rounding errors removed. Components below 1e-12 of its length, or of
/// `size` if that is larger, become 0.
fn cleaned(v: &Vector3<f64>, size: f64) -> String {
    let least = 1e-12 * if size.is_finite() { size.max(v.norm()) } else { v.norm() };
    vector(&v.map(|x| if x.abs() < least { 0.0 } else { x }))
}

/// Height of a horizontal plane. Otherwise slope and n · x = d, with four digits.
fn plane(ground: &FilmGround) -> String {
    if ground.normal == Vector3::z() {
        return format!("level, z = {} m", number(ground.offset));
    }
    let round = |x: f64| (x * 1e4).round() / 1e4;
    let normal = vector(&ground.normal.map(round));
    format!("slope {}°, normal {normal}, offset {} m", round(ground.slope()), number(ground.offset))
}

/// First knots of a load over time.
fn polyline(knots: &[(f64, Vector3<f64>)], unit: &str) -> String {
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

fn shape(body: &FilmBody) -> String {
    let looks = Outline::of(&body.pieces, &body.points);
    match looks.as_slice() {
        [Outline::Solid(piece)] => solid(piece),
        [Outline::Points(points)] => {
            let s = if points.len() == 1 { "" } else { "s" };
            format!("{} contact point{s}", points.len())
        }
        pieces => {
            let is_mesh = |look: &Outline| matches!(look, Outline::Solid(FilmPiece::Mesh(_)));
            let convex = if pieces.iter().any(is_mesh) { "" } else { "convex " };
            format!("{} {convex}pieces", pieces.len())
        }
    }
}

fn solid(piece: &FilmPiece) -> String {
    match piece {
        FilmPiece::Sphere { radius, .. } => format!("sphere of radius {} m", number(*radius)),
        FilmPiece::Capsule { ends: [a, b], radius } => {
            format!("capsule of radius {} m about {} m", number(*radius), number((b - a).norm()))
        }
        FilmPiece::Mesh(mesh) => format!("mesh of {} triangles", mesh.triangles.len()),
        FilmPiece::Hull(FilmHull { name: Some(name), .. }) => name.clone(),
        FilmPiece::Hull(FilmHull { vertices, faces, radius, .. }) => {
            let core = if is_box(vertices) {
                let edges = [1, 2, 4].map(|corner| number((vertices[corner] - vertices[0]).norm()));
                format!("box {} × {} × {} m", edges[0], edges[1], edges[2])
            } else {
                format!("hull of {} corners and {} faces", vertices.len(), faces.len())
            };
            if *radius == 0.0 { core } else { format!("{core}, rounded by {} m", number(*radius)) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::floating_cube;

    #[test]
    fn rounding_is_no_part_of_an_inertia() {
        let mut matrix = Matrix3::from_diagonal(&Vector3::new(2.0, 1.5, 1.0));
        (matrix[(0, 1)], matrix[(1, 0)]) = (8e-19, 8e-19);
        assert_eq!(inertia(&matrix), "diag(2, 1.5, 1)");
        (matrix[(0, 1)], matrix[(1, 0)]) = (1e-9, 1e-9);
        assert_eq!(inertia(&matrix), "[2, 1e-9, 0; 1e-9, 1.5, 0; 0, 0, 1]");
    }

    #[test]
    fn rounding_is_no_part_of_a_start() {
        assert_eq!(cleaned(&Vector3::new(1.2e-17, -0.3, 2.5), 1.0), "(0, -0.3, 2.5)");
        assert_eq!(cleaned(&Vector3::new(1e-17, 0.0, 0.0), 1.0), "(0, 0, 0)");
        assert_eq!(cleaned(&Vector3::new(1e-17, 0.0, 0.0), 0.0), "(1e-17, 0, 0)");
        assert_eq!(cleaned(&Vector3::new(1e-9, 0.0, 1.0), f64::NAN), "(1e-9, 0, 1)");
    }

    #[test]
    fn matrices_and_bodies_are_as_short_as_they_can_be() {
        assert_eq!(inertia(&(Matrix3::identity() * 0.01)), "0.01 E₃");
        assert_eq!(inertia(&Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0))), "diag(1, 2, 3)");
        let full = Matrix3::new(1.0, 0.5, -0.0, 0.5, 2.0, 0.0, 0.0, 0.0, 3.0);
        assert_eq!(inertia(&full), "[1, 0.5, 0; 0.5, 2, 0; 0, 0, 3]");
        assert_eq!(inertia(&(Matrix3::identity() * 1e-12)), "1e-12 E₃");
        assert_eq!(number(1.0 / 3.0), "0.333333333");
        assert_eq!(number(0.1 + 0.2), "0.3");
        let mut body = floating_cube(0).bodies.remove(0);
        assert_eq!(shape(&body), "box 2 × 2 × 2 m");
        body.points.truncate(1);
        assert_eq!(shape(&body), "1 contact point");
        body.pieces.push(FilmPiece::Sphere { centre: Vector3::zeros(), radius: 0.5 });
        assert_eq!(shape(&body), "sphere of radius 0.5 m");
        let ends = [Vector3::zeros(), Vector3::x() * 2.0];
        body.pieces = vec![FilmPiece::Capsule { ends, radius: 0.25 }];
        assert_eq!(shape(&body), "capsule of radius 0.25 m about 2 m");
    }
}
