//! Bodies that come, go and are held between steps.
//!
//! What a simulation remembers follows them: forces and loads find their bodies under other numbers, and
//! what did not touch a body that went goes on as if it had never been there.

use super::{Outside, Simulation, start};
use crate::error::Error;
use crate::mechanics::{RigidBody, State};
use crate::simulation::Motion;
use crate::step::{ContactForce, StepSolution};
use crate::world::World;
use nalgebra::Vector3;

impl Simulation<'_> {
    /// Adds a `body` in this `state`, without load, as the last one; returns its index. The last step cannot be
    /// taken back any more.
    ///
    /// # Errors
    /// A state that [`Simulation::new`] refuses; a solver that is made for one world. Nothing has changed
    /// then.
    pub fn add_body(&mut self, body: RigidBody, state: State) -> Result<usize, Error> {
        let state = state.checked()?;
        let (index, world) = (self.world.bodies().len(), self.world.with_body(body)?);
        let mut states = self.now.states.clone();
        states.push(state);
        let mut candidates = self.scratch.candidates.clone();
        candidates.add(&world);
        let touches = matches!(self.motion, Motion::Contact { .. });
        start::check(&world, &states, &self.angles(), touches, &mut candidates, |body| {
            body == index
        })?;
        self.change_solver(&world)?;
        self.scratch.candidates = candidates;
        self.outside.push(Outside::nothing());
        for solution in self.solutions() {
            solution.states.push(state);
        }
        self.take_world(world);
        Ok(index)
    }

    /// Takes the body `index` out, with its load and all forces on it; bodies after it move up by one. Returns
    /// it. The last step cannot be taken back any more.
    ///
    /// # Errors
    /// A body that is not there, the only one, or one that a joint ties; a solver that is made for one
    /// world. Nothing has changed then.
    pub fn remove_body(&mut self, index: usize) -> Result<(RigidBody, State), Error> {
        let world = self.world.without_body(index)?;
        self.leave(world, index)
    }

    /// The same, with all joints that tie it; those after them move up.
    ///
    /// # Errors
    /// As [`Simulation::remove_body`], but for the joints.
    pub fn remove_body_and_joints(&mut self, index: usize) -> Result<(RigidBody, State), Error> {
        let world = self.world.untied(index).without_body(index)?;
        self.leave(world, index)
    }

    /// Goes on in `world`, in which the body `index` is no more, nor are joints that tie it.
    fn leave(&mut self, world: World, index: usize) -> Result<(RigidBody, State), Error> {
        self.change_solver(&world)?;
        let before = self.world.clone();
        let body = before.bodies()[index].clone();
        self.scratch.candidates.remove(&world, index, body.pieces().len());
        self.outside.remove(index);
        let stays: Vec<_> = before.joints().iter().map(|joint| !joint.ties(index)).collect();
        self.driving.keep(&stays);
        let kept = before.gears().iter().map(|gear| gear.keeping(&stays).is_some());
        let gears: Vec<_> = kept.collect();
        let state = self.now.states[index];
        for solution in self.solutions() {
            solution.leave_out(index, &stays, &gears);
        }
        self.take_world(world);
        Ok((body, state))
    }

    /// Holds the body `index`, at rest where it is: it touches nothing and costs nothing, until it is
    /// let go (`held` = false), from rest. The last step cannot be taken back any more.
    ///
    /// # Errors
    /// A body that is not there, or that a joint ties; a body that would be let go deeper in another
    /// one, or in the ground, than a start may be. Nothing has changed then.
    pub fn hold_body(&mut self, index: usize, held: bool) -> Result<(), Error> {
        let world = self.world.clone().with_held(index, held)?;
        if self.world.is_held(index) == held {
            return Ok(());
        }
        let mut candidates = self.scratch.candidates.clone();
        candidates.hold(&world, index);
        let touches = matches!(self.motion, Motion::Contact { .. });
        start::check(&world, &self.now.states, &self.angles(), touches, &mut candidates, |body| {
            body == index
        })?;
        self.scratch.candidates = candidates;
        let still = Vector3::zeros();
        let state = State { velocity: still, spin: still, ..self.now.states[index] };
        self.now.states[index] = state;
        let touched = |force: &ContactForce| force.key.bodies().all(|body| body != index);
        self.now.contacts.retain(touched);
        self.take_world(world);
        Ok(())
    }

    /// The solutions that the next steps see.
    fn solutions(&mut self) -> impl Iterator<Item = &mut StepSolution> {
        let before = self.before.iter_mut().chain(&mut self.long_before);
        std::iter::once(&mut self.now).chain(before)
    }

    fn change_solver(&mut self, world: &World) -> Result<(), Error> {
        match &mut self.motion {
            Motion::Contact { solver, .. } => solver.change_world(world),
            Motion::Floating => Ok(()),
        }
    }

    fn take_world(&mut self, world: World) {
        self.world = world;
        self.scratch.rest.end();
        self.taken_back = true;
        #[cfg(feature = "save")]
        self.digest.take();
    }

    /// The angles of every joint now, rad, with the turns that were made since the start
    /// ([`Joint::counted`](crate::joint::Joint::counted)).
    pub fn joint_angles(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.now.joints.iter().map(|joint| &joint.angles)
    }

    fn angles(&self) -> Vec<Vector3<f64>> {
        self.joint_angles().copied().collect()
    }
}
