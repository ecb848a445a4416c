//! Places and masses in a URDF file.

use crate::robot::frame::{Frame, about, left_times};
use crate::robot::model::Mass;
use crate::robot::xml::{Attributes, Element};
use nalgebra::{Matrix3, Vector3, Vector4};

/// `<inertial>`; nothing where there is none.
pub(super) fn inertial(link: &Element) -> Result<Mass, String> {
    let Some(inertial) = link.one("inertial")? else { return Ok(Mass::NONE) };
    let mass = inertial.one("mass")?.ok_or_else(|| inertial.wrong("<mass> is needed"))?;
    mass.needed("value")?;
    let mass = mass.bounded("value", 0.0, [0.0, 1e9])?;
    let inertia = match inertial.one("inertia")? {
        None => Matrix3::zeros(),
        Some(element) => {
            let [xx, xy, xz, yy, yz, zz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]
                .map(|field| element.number(field).map(|number| number.unwrap_or(0.0)));
            let (xx, xy, xz, yy, yz, zz) = (xx?, xy?, xz?, yy?, yz?, zz?);
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    Ok(Mass { mass, centre: Vector3::zeros(), inertia }.placed(&origin(inertial)?))
}

/// `<origin>`: a place, and turns about x, y and z that stay, one after the other.
pub(super) fn origin(element: &Element) -> Result<Frame, String> {
    let Some(origin) = element.one("origin")? else { return Ok(Frame::identity()) };
    let position = origin.exactly::<3>("xyz")?.unwrap_or_default();
    let [roll, pitch, yaw] = origin.exactly::<3>("rpy")?.unwrap_or_default();
    Ok(Frame { position: position.into(), attitude: of_angles(roll, pitch, yaw) })
}

fn of_angles(roll: f64, pitch: f64, yaw: f64) -> Vector4<f64> {
    let turned = left_times(&about(&Vector3::y(), pitch), &about(&Vector3::x(), roll));
    left_times(&about(&Vector3::z(), yaw), &turned).normalize()
}
