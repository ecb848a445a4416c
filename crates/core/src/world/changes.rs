//! Changes of a world during a simulation: added, removed and held bodies, and moving surfaces.

use super::{GroupMasks, Partner, SurfaceMotion, World};
use crate::error::{Error, all_in_range};
use crate::joint::{Gear, Joint, Knots};
use crate::mechanics::RigidBody;
use nalgebra::Vector3;

/// Parts of a world that a simulation can change.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Changeable {
    /// Held flag of each body; empty if no body is held.
    held: Vec<bool>,
    /// Joints and gears with their current drives.
    pub(crate) joints: Vec<Joint>,
    gears: Vec<Gear>,
    /// Motions of surfaces, each with its collider.
    surfaces: Vec<(Partner, SurfaceMotion)>,
}

#[cfg(feature = "save")]
impl Changeable {
    /// True if these are parts of `world`, up to changes of a simulation.
    pub(crate) fn fits(&self, world: &World) -> bool {
        let Self { held, joints, gears, .. } = self;
        joints.iter().map(Joint::lasting).eq(world.joints().iter().map(Joint::lasting))
            && gears.iter().map(Gear::lasting).eq(world.gears().iter().map(Gear::lasting))
            && (held.is_empty() || held.len() == world.bodies().len())
    }
}

impl World {
    /// Returns this world with `body` held or released. A held body stays at rest under any load
    /// and has no contacts.
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist; [`Error::Tied`] if a joint connects it.
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

    /// Returns this world with exactly the flagged bodies held. An empty list holds none.
    #[cfg(feature = "save")]
    pub(crate) fn holding(self, held: &[bool]) -> Result<Self, Error> {
        let held = held.iter().enumerate().filter(|(_, held)| **held);
        held.map(|(body, _)| body)
            .try_fold(self.released(), |world, body| world.with_held(body, true))
    }

    /// Copy of this world without held bodies.
    #[cfg(feature = "save")]
    pub(crate) fn released(&self) -> Self {
        Self { held: Vec::new(), ..self.clone() }
    }

    /// Copy of this world without the parts that a simulation can change: held bodies, surface
    /// velocities and drives.
    #[cfg(feature = "save")]
    pub(crate) fn lasting(&self) -> Self {
        let joints = self.joints.iter().map(Joint::lasting).collect();
        let gears = self.gears.iter().map(Gear::lasting).collect();
        Self { held: Vec::new(), surfaces: Vec::new(), joints, gears, ..self.clone() }
    }

    /// Returns this world with the changes of a simulation applied, each of them checked.
    #[cfg(feature = "save")]
    pub(crate) fn with_changes(&self, changes: &Changeable) -> Result<Self, Error> {
        let Changeable { held, joints, gears, surfaces } = changes;
        let mut world = self.clone().holding(held)?;
        world.surfaces.clear();
        for &(of, motion) in surfaces {
            world.set_surface(of, motion)?;
        }
        for (known, joint) in world.joints.iter_mut().zip(joints) {
            *known = joint.clone().checked(world.parameters.bodies.len())?;
        }
        world.with_gears(gears.clone())
    }

    /// Parts of this world that a simulation can change.
    pub(crate) fn changeable(&self) -> Changeable {
        let Self { held, joints, gears, surfaces, .. } = self;
        let (held, joints) = (held.clone(), joints.clone());
        Changeable { held, joints, gears: gears.clone(), surfaces: surfaces.clone() }
    }

    /// Sets the changeable parts to those that this world had before.
    pub(crate) fn set_changeable(&mut self, before: &Changeable) {
        self.held.clone_from(&before.held);
        self.joints.clone_from(&before.joints);
        self.gears.clone_from(&before.gears);
        self.surfaces.clone_from(&before.surfaces);
    }

    /// True if `body` is [held](World::with_held).
    #[inline]
    pub fn is_held(&self, body: usize) -> bool {
        self.held.get(body).copied().unwrap_or(false)
    }

    /// Returns this world without `body`. Bodies after it move up by one.
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist or is the only one; [`Error::Tied`] if a joint
    /// connects it.
    pub fn without_body(&self, body: usize) -> Result<Self, Error> {
        let count = self.bodies().len();
        if body >= count || count == 1 {
            let allowed = "an index of a body; two or more bodies";
            return Err(Error::Count { field: "body", count: body, allowed });
        }
        self.refuse_tied(body)?;
        // The constructor computes reach and speed scale anew.
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
        // Everything named by a body is renumbered; entries of the removed one go.
        let number = |index: usize| without(index, body);
        let renumbered = |&(a, partner): &(usize, Partner)| {
            let partner = match partner {
                Partner::Body(other) => Partner::Body(number(other)?),
                fixed => fixed,
            };
            Some((number(a)?, partner))
        };
        let untouched = self.untouched.iter().filter_map(|body| number(*body)).collect();
        let kept_apart = self.kept_apart.iter().filter_map(renumbered).collect();
        let owner = |owner: Partner| match owner {
            Partner::Body(index) => Some(Partner::Body(number(index)?)),
            fixed => Some(fixed),
        };
        let coefficients = self.coefficients.each_ref().map(|of| of.renumbered(owner, renumbered));
        let friction_axes = self.renumbered_axes(owner);
        let groups = self.groups.as_ref().map(|groups| Box::new(groups.without(body)));
        let groups = groups.and_then(GroupMasks::if_any);
        let joints = self.joints.iter().map(|joint| joint.without(body)).collect();
        let surface = |(of, motion): &(Partner, SurfaceMotion)| Some((owner(*of)?, *motion));
        let world = Self {
            parameters,
            reach,
            speed_scale,
            held,
            surfaces: self.surfaces.iter().filter_map(surface).collect(),
            coefficients,
            friction_axes,
            kept_apart,
            untouched,
            groups,
            ..self.clone()
        };
        Ok(world.tied_by(joints))
    }

    /// Returns this world with one more body at the end.
    ///
    /// # Errors
    /// Those of [`World::new`]. A checked body causes none.
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

    /// Returns this world without the joints of `body` and without the gears of these joints.
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

    /// Mutable joints, for changes of their drives during a simulation.
    pub(crate) fn joints_mut(&mut self) -> &mut [Joint] {
        &mut self.joints
    }

    /// Mutable gears, for changes of their drives during a simulation.
    pub(crate) fn gears_mut(&mut self) -> &mut [Gear] {
        &mut self.gears
    }

    /// Moves the world frames of the joints in `courses` along their prescribed motions to `time`
    /// (s). It reproduces the world of a step that ends at `time` under
    /// [`Simulation::set_course`](crate::simulation::Simulation::set_course), for readers of
    /// recorded steps. Only joints that fix all axes of a body in the world move; others are
    /// skipped.
    pub fn follow(&mut self, courses: &[(usize, Knots)], time: f64) {
        for (joint, knots) in courses {
            if let Some(joint) = self.joints.get_mut(*joint).filter(|joint| joint.holds_in_world())
            {
                joint.move_to(knots.at(time));
            }
        }
    }

    /// Returns this world with a surface velocity, as on a conveyor belt. The surface of `of` moves
    /// with `velocity` (m/s) relative to its collider and drags touching bodies by friction. The
    /// velocity is in the body frame, or in the world frame for the ground and fixed pieces. Its
    /// component along a contact normal is ignored. The last call for a collider counts.
    ///
    /// # Errors
    /// [`Error::Count`] if the body, the fixed piece or the ground does not exist;
    /// [`Error::OutOfRange`] if a component is beyond ±1e5 m/s.
    pub fn with_surface(self, of: Partner, velocity: Vector3<f64>) -> Result<Self, Error> {
        self.with_surface_motion(of, SurfaceMotion { velocity, ..SurfaceMotion::default() })
    }

    /// Same as [`World::with_surface`] for a surface that may also turn, as that of a turntable or of a belt in a curve
    /// (eq. 10d).
    ///
    /// # Errors
    /// Those of [`World::with_surface`]; [`Error::OutOfRange`] if a component of the spin is beyond ±1e5 rad/s, or one of
    /// the centre beyond ±1e6 m.
    pub fn with_surface_motion(
        mut self,
        of: Partner,
        motion: SurfaceMotion,
    ) -> Result<Self, Error> {
        self.set_surface(of, motion)?;
        Ok(self)
    }

    /// Sets the motion of the surface of `of` in place; see [`World::with_surface_motion`].
    pub(crate) fn set_surface(&mut self, of: Partner, motion: SurfaceMotion) -> Result<(), Error> {
        let SurfaceMotion { velocity, spin, centre } = motion;
        all_in_range("velocity of a surface (m/s)", &velocity, -1e5, 1e5, "-1e5 to 1e5")?;
        all_in_range("spin of a surface (rad/s)", &spin, -1e5, 1e5, "-1e5 to 1e5")?;
        all_in_range("centre of a surface (m)", &centre, -1e6, 1e6, "-1e6 to 1e6")?;
        let (known, count) = match of {
            Partner::Ground => (self.ground().is_some(), 0),
            Partner::Fixed(index) => (index < self.fixed_count(), index),
            Partner::Body(index) => (index < self.bodies().len(), index),
        };
        if !known {
            let allowed = "a body or a fixed piece of the world";
            return Err(Error::Count { field: "owner of a surface", count, allowed });
        }
        match self.surfaces.iter_mut().find(|(owner, _)| *owner == of) {
            Some((_, known)) => *known = motion,
            None => self.surfaces.push((of, motion)),
        }
        Ok(())
    }

    /// Motion of the surface of a body (body frame), of a fixed piece or of the ground (world frame).
    pub fn surface_of(&self, owner: Partner) -> SurfaceMotion {
        let known = self.surfaces.iter().find(|(of, _)| *of == owner);
        known.map_or(SurfaceMotion::default(), |(_, motion)| *motion)
    }

    /// True if any surface moves.
    pub fn has_surfaces(&self) -> bool {
        !self.surfaces.is_empty()
    }
}

/// Index of the body `index` after the removal of `removed`; `None` for the removed body.
pub(crate) fn without(index: usize, removed: usize) -> Option<usize> {
    match index.cmp(&removed) {
        std::cmp::Ordering::Less => Some(index),
        std::cmp::Ordering::Equal => None,
        std::cmp::Ordering::Greater => Some(index - 1),
    }
}
