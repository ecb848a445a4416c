//! Friction that depends on the direction: surfaces with an axis.

use super::{Partner, World};
use crate::error::{Error, all_in_range, in_range};
use crate::partner::FrictionAxis;
use nalgebra::Vector3;

impl World {
    /// Returns this world with friction that depends on the direction of sliding on the surface of `of`,
    /// a body, a fixed collider or the ground. Along `direction` (body frame, or world frame for fixed
    /// geometry) the coefficient is `factor` times that of the contact, across it the coefficient itself
    /// (eq. 46). The last call for an owner counts.
    ///
    /// Contact between two owners with axes has no such law: [`World::check_start`] refuses pairs of them
    /// that may touch.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the direction is zero or beyond ±1e6, or if the factor is outside
    /// 0.001…1000; [`Error::Count`] if the owner does not exist.
    pub fn with_friction_axis(
        mut self,
        of: Partner,
        direction: Vector3<f64>,
        factor: f64,
    ) -> Result<Self, Error> {
        self.add_friction_axis(of, FrictionAxis { direction, body: None, factor })?;
        Ok(self)
    }

    /// Returns this world with a [friction axis](World::with_friction_axis) on the surface of `of`, with its
    /// `direction` in the frame of another `body`. Joints must connect both. The rollers of a mecanum wheel at the
    /// ground, for example, keep their direction in the chassis.
    ///
    /// # Errors
    /// Those of [`World::with_friction_axis`]. [`World::check_start`] refuses a body without a joint to the owner.
    pub fn with_friction_axis_in(
        mut self,
        of: Partner,
        body: usize,
        direction: Vector3<f64>,
        factor: f64,
    ) -> Result<Self, Error> {
        self.check_owner("body of a friction axis", Partner::Body(body))?;
        self.add_friction_axis(of, FrictionAxis { direction, body: Some(body), factor })?;
        Ok(self)
    }

    fn add_friction_axis(&mut self, of: Partner, axis: FrictionAxis) -> Result<(), Error> {
        let known = of == Partner::Ground && self.ground().is_some();
        if !known {
            self.check_owner("owner of a friction axis", of)?;
        }
        all_in_range("friction axis", &axis.direction, -1e6, 1e6, "-1e6 to 1e6")?;
        let length = axis.direction.norm();
        in_range("length of the friction axis", length, 1e-6, 2e6, "1e-6 to 2e6")?;
        let direction = axis.direction / length;
        let axis = FrictionAxis { direction, factor: checked(axis.factor)?, ..axis };
        match self.friction_axes.binary_search_by(|(owner, _)| owner.cmp(&of)) {
            Ok(place) => self.friction_axes[place].1 = axis,
            Err(place) => self.friction_axes.insert(place, (of, axis)),
        }
        Ok(())
    }

    /// Owner of an axis in the frame of a body to which no joints connect it.
    pub(crate) fn loose_friction_axis(&self) -> Option<Partner> {
        let is_tied = |owner: Partner, body: usize| {
            let Some(first) = owner.body() else { return false };
            let mut known = vec![first];
            let mut next = 0;
            while let Some(&at) = known.get(next) {
                next += 1;
                for joint in self.joints().iter().filter(|joint| joint.ties(at)) {
                    let ends = [Some(joint.body()), joint.other()].into_iter().flatten();
                    let new = ends.filter(|end| !known.contains(end)).collect::<Vec<_>>();
                    known.extend(new);
                }
            }
            known.contains(&body)
        };
        let mut axes = self.friction_axes.iter();
        let loose = axes.find(|(of, axis)| axis.body.is_some_and(|body| !is_tied(*of, body)));
        loose.map(|(of, _)| *of)
    }

    /// Owners whose surface has an axis, sorted, in the order of [`Constant::FrictionFactor`](super::Constant::FrictionFactor).
    #[inline]
    pub fn friction_axes(&self) -> &[(Partner, FrictionAxis)] {
        &self.friction_axes
    }

    /// Index in [`World::friction_axes`] of the axis between `body` and `partner`. `None` if both are
    /// isotropic.
    pub fn friction_axis_between(&self, body: usize, partner: Partner) -> Option<usize> {
        let find = |of: Partner| self.friction_axes.binary_search_by(|(owner, _)| owner.cmp(&of));
        find(Partner::Body(body)).or_else(|_| find(partner)).ok()
    }

    /// Two owners with axes that may touch.
    pub(crate) fn touching_friction_axes(&self) -> Option<(Partner, Partner)> {
        let owners = || self.friction_axes.iter().map(|(owner, _)| *owner);
        let pairs =
            owners().enumerate().flat_map(|(k, of)| owners().skip(k + 1).map(move |b| (of, b)));
        pairs.into_iter().find(|pair| match *pair {
            (Partner::Body(body), other) | (other, Partner::Body(body)) => {
                self.may_touch(body, other)
            }
            _ => false,
        })
    }

    /// Sets the values of [`Constant::FrictionFactor`](super::Constant::FrictionFactor).
    pub(super) fn set_friction_factors(&mut self, numbers: &[f64]) -> Result<(), Error> {
        for ((_, axis), number) in self.friction_axes.iter_mut().zip(numbers) {
            axis.factor = checked(*number)?;
        }
        Ok(())
    }

    /// Axes without the owners and the bodies that `owner` leaves out.
    pub(super) fn renumbered_axes(
        &self,
        owner: impl Fn(Partner) -> Option<Partner>,
    ) -> Vec<(Partner, FrictionAxis)> {
        let axes = self.friction_axes.iter();
        let body = |body: Option<usize>| match body {
            Some(body) => Some(owner(Partner::Body(body))?.body()),
            None => Some(None),
        };
        let kept = |(of, axis): &(Partner, FrictionAxis)| {
            Some((owner(*of)?, FrictionAxis { body: body(axis.body)?, ..*axis }))
        };
        axes.filter_map(kept).collect()
    }

    /// Body in whose frame an axis is; `None` for the world.
    pub(crate) fn body_of_friction_axis(&self, index: usize) -> Option<usize> {
        let (owner, axis) = self.friction_axes.get(index)?;
        axis.body.or(owner.body())
    }

    /// Owner of the number at `index` of [`Constant::FrictionFactor`](super::Constant::FrictionFactor).
    pub fn friction_axis_owner(&self, index: usize) -> Option<Partner> {
        self.friction_axes.get(index).map(|(owner, _)| *owner)
    }
}

fn checked(factor: f64) -> Result<f64, Error> {
    in_range("factor of friction along an axis", factor, 1e-3, 1e3, "0.001 to 1000")
}
