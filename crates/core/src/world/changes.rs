//! What changes of a world while it is simulated: bodies that come, go or are held, and surfaces that move.

use super::laws::PairLaws;
use super::{Partner, World};
use crate::error::{Error, all_in_range};
use crate::joint::{Gear, Joint, Knots};
use crate::mechanics::RigidBody;
use nalgebra::Vector3;

impl World {
    /// This world, in which the body `body` is held or moves: a body that is held stays where it is, whatever
    /// pushes it, touches nothing, and is touched by nothing.
    ///
    /// # Errors
    /// A body that is not there; one that a joint ties.
    pub fn with_held(mut self, body: usize, held: bool) -> Result<Self, Error> {
        let bodies = self.bodies().len();
        if body >= bodies {
            let allowed = "an index of a body";
            return Err(Error::Count { field: "body", count: body, allowed });
        }
        self.refuse_tied(body)?;
        self.held.resize(bodies, false);
        self.held[body] = held;
        if !self.held.contains(&true) {
            self.held.clear();
        }
        Ok(self)
    }

    /// This world, in which these bodies are held and no others; none where the list is empty.
    #[cfg(feature = "save")]
    pub(crate) fn holding(self, held: &[bool]) -> Result<Self, Error> {
        let held = held.iter().enumerate().filter(|(_, held)| **held);
        held.map(|(body, _)| body)
            .try_fold(self.released(), |world, body| world.with_held(body, true))
    }

    /// The same without a body that is held.
    #[cfg(feature = "save")]
    pub(crate) fn released(&self) -> Self {
        Self { held: Vec::new(), ..self.clone() }
    }

    /// What of it no simulation changes: without bodies that are held, surfaces that move, and drives.
    #[cfg(feature = "save")]
    pub(crate) fn lasting(&self) -> Self {
        let joints = self.joints.iter().map(Joint::lasting).collect();
        let gears = self.gears.iter().map(Gear::lasting).collect();
        Self { held: Vec::new(), surfaces: Vec::new(), joints, gears, ..self.clone() }
    }

    /// This world with what a simulation had changed of it: which bodies are held, the joints and gears as they
    /// were set, and the surfaces that moved.
    #[cfg(feature = "save")]
    pub(crate) fn with_changes(
        &self,
        held: &[bool],
        joints: &[Joint],
        gears: &[Gear],
        surfaces: &[(Partner, Vector3<f64>)],
    ) -> Result<Self, Error> {
        let mut world = self.clone().holding(held)?;
        world.surfaces.clear();
        for &(of, velocity) in surfaces {
            world.set_surface(of, velocity)?;
        }
        for (known, joint) in world.joints.iter_mut().zip(joints) {
            *known = joint.clone().checked(world.parameters.bodies.len())?;
        }
        world.with_gears(gears.to_vec())
    }

    /// The velocities of surfaces, each of an owner.
    #[cfg(feature = "save")]
    pub(crate) fn surfaces(&self) -> &[(Partner, Vector3<f64>)] {
        &self.surfaces
    }

    /// Whether each body is held; empty where none is.
    #[cfg(feature = "save")]
    pub(crate) fn held(&self) -> &[bool] {
        &self.held
    }

    /// Whether the body `body` is [held](World::with_held).
    #[must_use]
    #[inline]
    pub fn is_held(&self, body: usize) -> bool {
        self.held.get(body).copied().unwrap_or(false)
    }

    /// This world without the body `body`: those after it move up by one.
    ///
    /// # Errors
    /// A body that is not there, or is the last; one that a joint ties.
    pub fn without_body(&self, body: usize) -> Result<Self, Error> {
        let count = self.bodies().len();
        if body >= count || count == 1 {
            let allowed = "an index of a body, of two or more";
            return Err(Error::Count { field: "body", count: body, allowed });
        }
        self.refuse_tied(body)?;
        let mut parameters = self.parameters.clone();
        parameters.bodies.remove(body);
        let Self { parameters, reach, speed_scale, .. } = Self::new(parameters)?;
        let mut held = self.held.clone();
        if body < held.len() {
            held.remove(body);
        }
        if !held.contains(&true) {
            held.clear();
        }
        let number = |index: usize| without(index, body);
        let renumbered = |&(a, partner): &(usize, Partner)| {
            let partner = match partner {
                Partner::Body(other) => Partner::Body(number(other)?),
                fixed => fixed,
            };
            Some((number(a)?, partner))
        };
        let pairs = |pairs: &PairLaws| {
            let pair = |(pair, value): &((usize, Partner), f64)| Some((renumbered(pair)?, *value));
            pairs.iter().filter_map(pair).collect()
        };
        let untouched = self.untouched.iter().filter_map(|body| number(*body)).collect();
        let kept_apart = self.kept_apart.iter().filter_map(renumbered).collect();
        let (pair_frictions, pair_restitutions) =
            (pairs(&self.pair_frictions), pairs(&self.pair_restitutions));
        let joints = self.joints.iter().map(|joint| joint.without(body)).collect();
        let surface = |(of, velocity): &(Partner, Vector3<f64>)| match of {
            Partner::Body(other) => Some((Partner::Body(number(*other)?), *velocity)),
            fixed => Some((*fixed, *velocity)),
        };
        let world = Self {
            parameters,
            reach,
            speed_scale,
            held,
            surfaces: self.surfaces.iter().filter_map(surface).collect(),
            pair_frictions,
            pair_restitutions,
            kept_apart,
            untouched,
            ..self.clone()
        };
        Ok(world.tied_by(joints))
    }

    /// This world with one body more, the last.
    ///
    /// # Errors
    /// None for a body; the type is [`World::new`]'s.
    pub fn with_body(&self, body: RigidBody) -> Result<Self, Error> {
        let mut parameters = self.parameters.clone();
        parameters.bodies.push(body);
        let Self { parameters, reach, speed_scale, .. } = Self::new(parameters)?;
        let mut held = self.held.clone();
        if !held.is_empty() {
            held.push(false);
        }
        Ok(Self { parameters, reach, speed_scale, held, ..self.clone() })
    }

    /// This world without the joints that tie the body `body`.
    pub(crate) fn untied(&self, body: usize) -> Self {
        let stays: Vec<_> = self.joints.iter().map(|joint| !joint.ties(body)).collect();
        let gears = self.gears.iter().filter_map(|gear| gear.keeping(&stays)).collect();
        let joints = self.joints.iter().filter(|joint| !joint.ties(body)).cloned().collect();
        Self { gears, ..self.clone() }.tied_by(joints)
    }

    fn refuse_tied(&self, body: usize) -> Result<(), Error> {
        match self.joints.iter().position(|joint| joint.ties(body)) {
            Some(joint) => Err(Error::Tied { body, joint }),
            None => Ok(()),
        }
    }

    /// The joints, for a simulation to set what drives them.
    pub(crate) fn joints_mut(&mut self) -> &mut [Joint] {
        &mut self.joints
    }

    /// The gears, for a simulation to set what drives them.
    pub(crate) fn gears_mut(&mut self) -> &mut [Gear] {
        &mut self.gears
    }

    /// Has the frames in the world of these joints, which hold a body there in all their axes, be where their
    /// courses are at `time` (s): what a [course through knots](crate::simulation::Simulation::set_course) does to the
    /// world of a step that ends then, for what reads recorded steps. Others are passed over.
    pub fn follow(&mut self, courses: &[(usize, Knots)], time: f64) {
        for (joint, knots) in courses {
            if let Some(joint) = self.joints.get_mut(*joint).filter(|joint| joint.holds_in_world())
            {
                joint.move_to(knots.at(time));
            }
        }
    }

    /// This world with a surface that moves over what it is of, as the belt of a conveyor does: what
    /// lies on it is carried along with `velocity` (m/s; frame of the body, the world's for what is fixed), as
    /// far as friction reaches. The part along the normal of a contact does nothing. The last word on an
    /// owner counts.
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a ground where there is none; a component beyond ±1e5 m/s.
    pub fn with_surface(mut self, of: Partner, velocity: Vector3<f64>) -> Result<Self, Error> {
        self.set_surface(of, velocity)?;
        Ok(self)
    }

    /// The same of this world.
    pub(crate) fn set_surface(&mut self, of: Partner, velocity: Vector3<f64>) -> Result<(), Error> {
        all_in_range("velocity of a surface (m/s)", &velocity, -1e5, 1e5, "-1e5 to 1e5")?;
        let (known, count) = match of {
            Partner::Ground => (self.ground().is_some(), 0),
            Partner::Fixed(index) => (index < self.fixed.len(), index),
            Partner::Body(index) => (index < self.bodies().len(), index),
        };
        if !known {
            let allowed = "a body or a fixed thing of the world";
            return Err(Error::Count { field: "owner of a surface", count, allowed });
        }
        match self.surfaces.iter_mut().find(|(owner, _)| *owner == of) {
            Some((_, known)) => *known = velocity,
            None => self.surfaces.push((of, velocity)),
        }
        Ok(())
    }

    /// The velocity of the surface of a body (its frame) or of what is fixed (world), m/s.
    #[must_use]
    pub fn surface_of(&self, owner: Partner) -> Vector3<f64> {
        let known = self.surfaces.iter().find(|(of, _)| *of == owner);
        known.map_or(Vector3::zeros(), |(_, velocity)| *velocity)
    }

    /// Whether any surface moves over what it is of.
    #[must_use]
    pub fn has_surfaces(&self) -> bool {
        !self.surfaces.is_empty()
    }
}

/// The number of body `index` when `removed` is taken out.
pub(crate) fn without(index: usize, removed: usize) -> Option<usize> {
    match index.cmp(&removed) {
        std::cmp::Ordering::Less => Some(index),
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some(index - 1),
    }
}
