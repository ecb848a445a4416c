//! Addition, removal and holding of bodies between steps.
//!
//! Stored solutions and loads are renumbered. Bodies that did not touch a removed body continue
//! exactly as if it had never existed.

use super::{ExternalLoads, Simulation, start};
use crate::error::Error;
use crate::mechanics::{RigidBody, State};
use crate::simulation::Motion;
use crate::step::{ContactForce, StepSolution};
use crate::world::{Touching, World};
use nalgebra::Vector3;

impl Simulation<'_> {
    /// Adds `body` at the end, with the initial `state` and without load, and returns its index.
    /// The last step cannot be taken back afterwards.
    ///
    /// # Errors
    /// If [`Simulation::new`] would reject the state, or if the solver supports one world only. The
    /// simulation is then unchanged.
    pub fn add_body(&mut self, body: RigidBody, state: State) -> Result<usize, Error> {
        self.add_body_with(body, state, Touching::default())
    }

    /// Adds `body` with the contact exclusions `touching`; see [`Simulation::add_body`].
    ///
    /// # Errors
    /// Same as [`Simulation::add_body`].
    pub fn add_body_with(
        &mut self,
        body: RigidBody,
        state: State,
        touching: Touching,
    ) -> Result<usize, Error> {
        let (state, index) = (state.checked()?, self.world.bodies().len());
        let world = self.world.with_body(body)?.with_touching(index, touching)?;
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
        self.outside.push(ExternalLoads::zero());
        for solution in self.solutions() {
            solution.states.push(state);
        }
        if let Some(instants) = &mut self.instants {
            instants.push(state);
        }
        self.take_world(world);
        Ok(index)
    }

    /// Removes and returns the body `index` with its load and all forces on it. Bodies after it
    /// move up by one. The last step cannot be taken back afterwards.
    ///
    /// # Errors
    /// If the body does not exist, is the only one or has a joint, or if the solver supports one
    /// world only. The simulation is then unchanged.
    pub fn remove_body(&mut self, index: usize) -> Result<(RigidBody, State), Error> {
        let world = self.world.without_body(index)?;
        self.leave(world, index)
    }

    /// Removes and returns the body `index` and all its joints. Bodies and joints after them move
    /// up. The last step cannot be taken back afterwards.
    ///
    /// # Errors
    /// Same as [`Simulation::remove_body`], except for joints.
    pub fn remove_body_and_joints(&mut self, index: usize) -> Result<(RigidBody, State), Error> {
        let world = self.world.untied(index).without_body(index)?;
        self.leave(world, index)
    }

    /// Continues in `world`, which lacks the body `index` and its joints.
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
        let state = self.states()[index];
        if let Some(instants) = &mut self.instants {
            instants.remove(index);
        }
        for solution in self.solutions() {
            solution.leave_out(index, &stays, &gears);
        }
        self.take_world(world);
        Ok((body, state))
    }

    /// Holds the body `index` at rest at its present pose, or releases it from rest (`held` =
    /// false). A held body has no contacts and no cost. The last step cannot be taken back
    /// afterwards.
    ///
    /// # Errors
    /// If the body does not exist or has a joint, or if a released body overlaps another one or the
    /// ground by more than an initial state may. The simulation is then unchanged.
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
        if let Some(instants) = &mut self.instants {
            instants.start(index, state);
        }
        let touched = |force: &ContactForce| force.key.bodies().all(|body| body != index);
        self.now.contacts.retain(touched);
        self.take_world(world);
        Ok(())
    }

    /// All stored solutions that the next steps use.
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

    /// Present angles of every joint (rad), including full turns since the start
    /// ([`Joint::counted`](crate::joint::Joint::counted)).
    pub fn joint_angles(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.now.joints.iter().map(|joint| &joint.angles)
    }

    fn angles(&self) -> Vec<Vector3<f64>> {
        self.joint_angles().copied().collect()
    }
}
