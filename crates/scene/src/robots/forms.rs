//! Conversion of a robot's shapes to shapes of a scene, with a limit on contact points.

use super::place_of;
use crate::bodies::entries::{ConeTable, PieceEntry, TubeTable};
use crate::tables::Sides;
use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_decompose::{LEAST_CORNERS, reduced};
use tumble_model::fields::numbers;
use tumble_robot::LinkFrame;
use tumble_robot::frame::attitude_from_matrix;
use tumble_robot::model::{LinkMass, RobotForm, RobotShape};

/// Scene geometry of a shape; `None` for a plane without contacts.
pub(super) fn form_of(shape: &RobotShape, sides: usize) -> Result<Option<PieceEntry>, String> {
    let form = scene_form(&shape.form, sides);
    match shape.form {
        _ if form.is_some() || shape.groups == [0, 0] => Ok(form),
        _ => Err(format!("{}: a plane or a height field must belong to the world", shape.at)),
    }
}

/// Scene geometry; `None` for a plane and a height field.
pub(super) fn scene_form(form: &RobotForm, sides: usize) -> Option<PieceEntry> {
    let none = PieceEntry::default();
    let some_sides = Some(sides);
    let tube = |half: f64, radius: f64| Some(TubeTable { length: 2.0 * half, radius });
    Some(match form {
        RobotForm::Sphere(radius) => PieceEntry { sphere: Some(*radius), ..none },
        RobotForm::Capsule(half, radius) => PieceEntry { capsule: tube(*half, *radius), ..none },
        RobotForm::Box(half) => {
            PieceEntry { cuboid: Some(Sides::Box(numbers(&(half * 2.0)))), ..none }
        }
        RobotForm::Cylinder(half, radius) => {
            PieceEntry { cylinder: tube(*half, *radius), sides: some_sides, ..none }
        }
        RobotForm::Cone(half, radius) => {
            let cone = Some(ConeTable { height: 2.0 * half, radius: *radius });
            PieceEntry { cone, sides: some_sides, ..none }
        }
        RobotForm::Hull(points) => PieceEntry::from_hull(points.iter().copied()),
        RobotForm::Ellipsoid(half) => {
            PieceEntry { ellipsoid: Some(numbers(half)), sides: some_sides, ..none }
        }
        RobotForm::Plane | RobotForm::Field(_) => return None,
    })
}

/// Maximum number of contact points of a body.
const MOST_POINTS: usize = 1000;
/// Minimum number of sides of the core of a cylinder.
const LEAST_SIDES: usize = 3;

/// Reduces hulls if the shapes together exceed the point limit of a body. Returns a note in that
/// case.
pub(super) fn fit(shapes: &mut [PieceEntry]) -> Result<Option<String>, Error> {
    let counts = shapes.iter().map(|shape| {
        let sides = shape.sides.unwrap_or(0);
        match shape.field() {
            "box" => 8,
            "sphere" => 1,
            "capsule" | "ellipsoid" => 2,
            "cylinder" => 2 * sides + 4,
            "cone" => sides + 3,
            _ => shape.hull.as_ref().map_or(0, Vec::len),
        }
    });
    let counts: Vec<usize> = counts.collect();
    let within = |most: usize| counts.iter().map(|count| *count.min(&most)).sum::<usize>();
    if within(usize::MAX) <= MOST_POINTS {
        return Ok(None);
    }
    let Some(most) = (LEAST_CORNERS..MOST_POINTS).rev().find(|most| within(*most) <= MOST_POINTS)
    else {
        return Ok(None);
    };
    let mut farthest = 0.0_f64;
    for shape in shapes {
        if let (Some(_), Some(sides)) = (&shape.cylinder, &mut shape.sides) {
            *sides = (*sides).min((most.saturating_sub(4) / 2).max(LEAST_SIDES));
        }
        let Some(points) = &mut shape.hull else { continue };
        if points.len() > most {
            let all: Vec<_> = points.iter().map(|point| point.0.into()).collect();
            let (piece, outside) = reduced(&all, most)?;
            *points = piece.core().vertices().iter().map(numbers).collect();
            farthest = farthest.max(outside);
        }
    }
    Ok(Some(format!(
        "its hulls are reduced to at most {most} corners each, {MOST_POINTS} in all; the removed \
         corners are up to {farthest:.1e} m outside"
    )))
}

/// Drawing of a body without shapes: the box with its inertia, or a ball if no such box exists.
pub(super) fn equivalent(mass: &LinkMass) -> PieceEntry {
    let eigen = mass.inertia.symmetric_eigen();
    let moments = eigen.eigenvalues;
    let squares = Vector3::repeat(0.5 * moments.sum()) - moments;
    let sides = squares.map(|square| (12.0 * square / mass.mass).max(0.0).sqrt());
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let attitude = attitude_from_matrix(&axes);
    let frame = LinkFrame { position: mass.centre, attitude };
    let form = if sides.min() > 1e-2 * sides.max() {
        PieceEntry { cuboid: Some(Sides::Box(numbers(&sides))), ..PieceEntry::default() }
    } else {
        let radius = (2.5 * moments.max() / mass.mass).sqrt().max(1e-3);
        PieceEntry { sphere: Some(radius), ..PieceEntry::default() }
    };
    form.placed_at(&place_of(&frame))
}
