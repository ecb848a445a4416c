//! Conversion of a robot's shapes to shapes of a scene, with a limit on contact points.

use super::place_of;
use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_decompose::{LEAST_CORNERS, reduced};
use tumble_model::shape::{ModelForm, PlacedForm};
use tumble_robot::LinkFrame;
use tumble_robot::frame::attitude_from_matrix;
use tumble_robot::model::{LinkMass, RobotForm, RobotShape};

/// Scene geometry of a shape; `None` for a plane without contacts.
pub(super) fn form_of(shape: &RobotShape, sides: usize) -> Result<Option<ModelForm>, String> {
    let form = scene_form(&shape.form, sides);
    match shape.form {
        _ if form.is_some() || shape.groups == [0, 0] => Ok(form),
        _ => Err(format!("{}: a plane or a height field must belong to the world", shape.at)),
    }
}

/// Scene geometry; `None` for a plane and a height field.
pub(super) fn scene_form(form: &RobotForm, sides: usize) -> Option<ModelForm> {
    Some(match form {
        RobotForm::Sphere(radius) => ModelForm::Sphere { radius: *radius },
        RobotForm::Capsule(half, radius) => {
            ModelForm::Capsule { length: 2.0 * half, radius: *radius }
        }
        RobotForm::Box(half) => ModelForm::Box { sides: (half * 2.0).into() },
        RobotForm::Cylinder(half, radius) => {
            ModelForm::Cylinder { length: 2.0 * half, radius: *radius, sides }
        }
        RobotForm::Cone(half, radius) => {
            ModelForm::Cone { height: 2.0 * half, radius: *radius, sides }
        }
        RobotForm::Hull(points) => ModelForm::Hull { points: points.clone(), radius: 0.0 },
        RobotForm::Ellipsoid(half) => ModelForm::Ellipsoid { half_axes: (*half).into(), sides },
        RobotForm::Plane | RobotForm::Field(_) => return None,
    })
}

/// Maximum number of contact points of a body.
const MOST_POINTS: usize = 1000;
/// Minimum number of sides of the core of a cylinder.
const LEAST_SIDES: usize = 3;

/// Reduces hulls if the shapes together exceed the point limit of a body. Returns a note in that
/// case.
pub(super) fn fit(shapes: &mut [PlacedForm]) -> Result<Option<String>, Error> {
    let counts = shapes.iter().map(|shape| match &shape.form {
        ModelForm::Box { .. } => 8,
        ModelForm::Sphere { .. } => 1,
        ModelForm::Capsule { .. } => 2,
        ModelForm::Cylinder { sides, .. } => 2 * sides + 4,
        ModelForm::Cone { sides, .. } => sides + 3,
        ModelForm::Ellipsoid { .. } => 2,
        ModelForm::Hull { points, .. } => points.len(),
        ModelForm::Mesh { vertices, .. } => vertices.len(),
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
        let points = match &mut shape.form {
            ModelForm::Hull { points, .. } => points,
            ModelForm::Cylinder { sides, .. } => {
                *sides = (*sides).min((most.saturating_sub(4) / 2).max(LEAST_SIDES));
                continue;
            }
            _ => continue,
        };
        if points.len() > most {
            let all: Vec<_> = points.iter().copied().map(Vector3::from).collect();
            let (piece, outside) = reduced(&all, most)?;
            *points = piece.core().vertices().iter().map(|&corner| corner.into()).collect();
            farthest = farthest.max(outside);
        }
    }
    Ok(Some(format!(
        "its hulls are reduced to at most {most} corners each, {MOST_POINTS} in all; the removed \
         corners are up to {farthest:.1e} m outside"
    )))
}

/// Drawing of a body without shapes: the box with its inertia, or a ball if no such box exists.
pub(super) fn equivalent(mass: &LinkMass) -> PlacedForm {
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
        ModelForm::Box { sides: sides.into() }
    } else {
        ModelForm::Sphere { radius: (2.5 * moments.max() / mass.mass).sqrt().max(1e-3) }
    };
    PlacedForm { form, place: place_of(&frame) }
}
