//! Poses and masses of a URDF file.

use super::{UrdfReader, extra};
use crate::between::carried;
use crate::frame::{LinkFrame, about};
use crate::mass::solid;
use crate::model::LinkMass;
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::{Matrix3, Vector3, Vector4};
use tumble_core::mechanics::quaternion::product;

/// Minimum mass of a link (kg), equal to that of a scene body. Files use smaller masses for frames.
pub(crate) const LEAST_MASS: f64 = 1e-9;

/// Mass properties of `<inertial>`. Zero if it is absent or its mass is below [`LEAST_MASS`].
pub(super) fn inertial(link: &Element) -> Parsed<LinkMass> {
    let Some(inertial) = link.one("inertial")? else { return Ok(LinkMass::NONE) };
    if density(link)?.is_some() {
        return Ok(LinkMass::NONE);
    }
    // A moving link without `<mass>` takes the mass of its shapes.
    let Some(mass) = inertial.one("mass")? else { return Ok(LinkMass::NONE) };
    mass.needed("value")?;
    let mass = mass.bounded("value", 0.0, [0.0, 1e9])?;
    if mass < LEAST_MASS {
        return Ok(LinkMass::NONE);
    }
    let inertia = match inertial.one("inertia")? {
        None => Matrix3::zeros(),
        Some(element) => {
            let [xx, xy, xz, yy, yz, zz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]
                .map(|field| element.number(field).map(|number| number.unwrap_or(0.0)));
            let (xx, xy, xz, yy, yz, zz) = (xx?, xy?, xz?, yy?, yz?, zz?);
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        }
    };
    Ok(LinkMass { mass, centre: Vector3::zeros(), inertia }.placed(&origin(inertial)?))
}

/// True if the link has a positive mass below [`LEAST_MASS`].
pub(super) fn is_faint(link: &Element) -> Parsed<bool> {
    let Some(inertial) = link.one("inertial")? else { return Ok(false) };
    let mass = inertial.one("mass")?.map(|mass| mass.number("value")).transpose()?.flatten();
    Ok(mass.is_some_and(|mass| 0.0 < mass && mass < LEAST_MASS))
}

/// `<density>` (kg/m³) of an `<inertial>` without mass. It applies to the collision shapes.
pub(super) fn density(link: &Element) -> Parsed<Option<f64>> {
    let Some(inertial) = link.one("inertial")? else { return Ok(None) };
    let given = inertial.one("density")?.filter(|_| inertial.all("mass").next().is_none());
    given
        .map(|density| {
            density.needed("value")?;
            density.bounded("value", 0.0, [1e-6, 1e9])
        })
        .transpose()
}

/// Density of moving links without mass (kg/m³).
const USUAL_DENSITY: f64 = 1000.0;

impl UrdfReader<'_> {
    /// Sets missing masses from the collision shapes. This concerns:
    ///
    /// - links with a density,
    /// - moving links that have no mass, including all links fixed to them,
    /// - links without inertia.
    pub(super) fn fill_masses(&mut self) -> Parsed<()> {
        let carriers = self.robot.carriers();
        for link in 1..self.robot.links.len() {
            let element = self.tree.links[&*self.robot.links[link].name];
            if let Some(density) = density(element)? {
                let shapes = self.solid(link)?;
                self.robot.links[link].mass = shapes.times(density);
            }
        }
        // Each moving link with all that is fixed to it
        let (mut dense, mut spread) = (0, 0);
        for (index, mass) in carried(&self.robot).into_iter().enumerate().skip(1) {
            let has_inertia = mass.inertia.symmetric_eigenvalues().min() > 0.0;
            if has_inertia || self.robot.links[index].joints.1 == 0 {
                continue;
            }
            for link in (index..carriers.len()).filter(|link| carriers[*link] == index) {
                let shapes = self.solid(link)?;
                let own = &mut self.robot.links[link].mass;
                if mass.mass == 0.0 && shapes.mass > 0.0 {
                    *own = shapes.times(USUAL_DENSITY);
                    dense += 1;
                } else if own.mass > 0.0 && shapes.mass > 0.0 {
                    own.inertia = shapes.inertia * (own.mass / shapes.mass);
                    spread += 1;
                }
            }
        }
        if dense > 0 {
            self.notes.say(format!(
                "moving links without a mass get the mass of their shapes at {USUAL_DENSITY} \
                 kg/m³: {dense}"
            ));
        }
        if spread > 0 {
            self.notes.say(format!(
                "links with an invalid inertia get the inertia of their shapes with uniform \
                 density: {spread}"
            ));
        }
        Ok(())
    }

    /// Mass properties of the collision shapes of a link at 1 kg/m³.
    fn solid(&self, link: usize) -> Parsed<LinkMass> {
        let own = self.robot.shapes.iter().filter(|shape| shape.link == link);
        let parts = own.map(|shape| {
            let solid = solid(&shape.form).map_err(|why| format!("{}: {why}", shape.at))?;
            Ok(solid.placed(&shape.frame))
        });
        Ok(LinkMass::sum(&parts.collect::<Parsed<Vec<_>>>()?))
    }
}

/// Pose of `<origin>`: position, and rotations about the fixed axes x, y and z in this order or a
/// quaternion.
pub(super) fn origin(element: &Element) -> Parsed<LinkFrame> {
    let Some(origin) = element.one("origin")? else { return Ok(LinkFrame::identity()) };
    let position = origin.exactly::<3>("xyz")?.unwrap_or_default();
    let attitude = match origin.exactly::<4>(extra::ATTITUDE)? {
        Some(attitude) => attitude.into(),
        None => attitude_from_angles(origin.exactly::<3>("rpy")?.unwrap_or_default()),
    };
    Ok(LinkFrame { position: position.into(), attitude })
}

/// Quaternion of rotations about the fixed axes x, y and z in this order (rad).
pub fn attitude_from_angles([roll, pitch, yaw]: [f64; 3]) -> Vector4<f64> {
    let turned = product(&about(&Vector3::y(), pitch), &about(&Vector3::x(), roll));
    product(&about(&Vector3::z(), yaw), &turned).normalize()
}
