//! Addition, removal and holding of bodies between steps.
//!
//! Stored solutions and loads are renumbered. Bodies that did not touch a removed body continue
//! exactly as if it had never existed.

use super::inputs::ExternalLoads;
use super::moment::Arrival;
use super::{Simulation, Undo, start};
use crate::contact::Candidates;
use crate::error::Error;
use crate::mechanics::{RigidBody, State};
use crate::simulation::Motion;
use crate::step::ContactForce;
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

    /// Adds `body` with the contact exclusions and coefficients `touching`; see [`Simulation::add_body`].
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
        let mut states = self.moment.now.states.clone();
        states.push(state);
        let is_new = |body| body == index;
        self.searched_in(&world, &states, |candidates| candidates.add(&world), is_new)?;
        self.inputs.outside.push(ExternalLoads::zero());
        for solution in self.moment.solutions_mut() {
            solution.states.push(state);
        }
        let length = match &mut self.moment.instants {
            Some(instants) => {
                instants.push(state);
                0.0
            }
            None => world.time_step(),
        };
        self.moment.arrivals.push(Arrival::after(length));
        self.moment.arrivals_before.push(Arrival::after(length));
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
        let Self { moment, workspace, inputs, .. } = self;
        workspace.search(&before, &mut moment.search, |candidates| {
            candidates.remove(&world, index, body.pieces().len());
        });
        inputs.outside.remove(index);
        let stays: Vec<_> = before.joints().iter().map(|joint| !joint.ties(index)).collect();
        inputs.driving.keep(&stays);
        let kept = before.gears().iter().map(|gear| gear.keeping(&stays).is_some());
        let gears: Vec<_> = kept.collect();
        let state = moment.states()[index];
        if let Some(instants) = &mut moment.instants {
            instants.remove(index);
        }
        moment.arrivals.remove(index);
        moment.arrivals_before.remove(index);
        moment.failures.clear();
        for solution in moment.solutions_mut() {
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
        let states = self.moment.now.states.clone();
        let is_changed = |body| body == index;
        self.searched_in(&world, &states, |candidates| candidates.hold(&world, index), is_changed)?;
        let still = Vector3::zeros();
        let state = State { velocity: still, spin: still, ..states[index] };
        self.moment.now.states[index] = state;
        self.moment.start(&self.world, &[(index, state)]);
        let now = &mut self.moment.now;
        let touched = |force: &ContactForce| force.key.bodies().all(|body| body != index);
        now.contacts.retain(touched);
        self.take_world(world);
        Ok(())
    }

    /// Continues the contact search in `world` after `change`, if the states of the bodies selected by
    /// `asked` are valid initial ones there, and the solver supports that world.
    fn searched_in(
        &mut self,
        world: &World,
        states: &[State],
        change: impl FnOnce(&mut Candidates),
        asked: impl Fn(usize) -> bool,
    ) -> Result<(), Error> {
        let (near, touches) = (self.angles(), self.workspace.has_contacts());
        let mut search = self.moment.search.clone();
        let checked = self.workspace.search(world, &mut search, |candidates| {
            change(candidates);
            start::check(world, states, &near, touches, candidates, asked)
        });
        self.workspace.forget();
        checked?;
        if world.bodies().len() != self.world.bodies().len() {
            self.change_solver(world)?;
        }
        self.moment.search = search;
        Ok(())
    }

    fn change_solver(&mut self, world: &World) -> Result<(), Error> {
        match &mut self.workspace.motion {
            Motion::Contact { solver, .. } => solver.change_world(world),
            Motion::Floating => Ok(()),
        }
    }

    fn take_world(&mut self, world: World) {
        self.world = world;
        self.workspace.rest.end();
        self.undo = Undo::Impossible;
        #[cfg(feature = "save")]
        self.digest.take();
    }

    /// Present angles of every joint (rad), including full turns since the start
    /// ([`Joint::counted`](crate::joint::Joint::counted)).
    pub fn joint_angles(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.moment.now.joints.iter().map(|joint| &joint.angles)
    }

    fn angles(&self) -> Vec<Vector3<f64>> {
        self.joint_angles().copied().collect()
    }
}
