//! A model whose constants are those of another world.

use super::joint::JointModel;
use super::model::Model;
use crate::contact::Partner;
use crate::joint::{Axis, Drive, Joint};
use crate::world::World;

impl Model {
    /// This model with the constants of `world`, which is this one's but for them: coefficients, masses, inertias, gravity, the
    /// height of the ground, drives, limits, anchors and gears. Shapes and the time step stay.
    #[must_use]
    pub fn with_constants_of(mut self, world: &World) -> Self {
        self.gravity = (*world.gravity()).into();
        self.mu = world.friction();
        self.restitution = world.restitution();
        if let (Some(plane), Some(ground)) = (&mut self.plane, world.ground()) {
            plane.offset = ground.offset();
        }
        for (model, body) in self.bodies.iter_mut().zip(world.bodies()) {
            model.mass = body.mass();
            // Symmetric: its columns are its rows.
            model.inertia = (*body.inertia()).into();
            model.friction = body.friction();
            model.restitution = body.restitution();
        }
        for (model, fixed) in self.fixed.iter_mut().zip(world.fixed()) {
            model.friction = fixed.friction;
        }
        let between = |pairs: &[((usize, Partner), f64)], body, partner| {
            let known = pairs.iter().find(|(pair, _)| *pair == (body, partner));
            known.map(|(_, coefficient)| *coefficient)
        };
        for pair in &mut self.frictions {
            let own = between(world.pair_frictions(), pair.body, pair.partner.into());
            pair.coefficient = own.unwrap_or(pair.coefficient);
        }
        for pair in &mut self.restitutions {
            let own = between(world.pair_restitutions(), pair.body, pair.partner.into());
            pair.coefficient = own.unwrap_or(pair.coefficient);
        }
        for (model, joint) in self.joints.iter_mut().zip(world.joints()) {
            model.take_constants(joint);
        }
        for (model, gear) in self.gears.iter_mut().zip(world.gears()) {
            model.ratio = gear.ratio();
            model.offset = gear.offset();
            model.drive = gear.drive().copied();
        }
        self
    }
}

impl JointModel {
    fn take_constants(&mut self, joint: &Joint) {
        let axes = [&joint.linear()[..], &joint.angular()[..]].concat();
        let drive = |axis: usize| match &axes[axis] {
            Axis::Free(drive) => *drive,
            Axis::Locked => Drive::NONE,
        };
        let driven = self.kind.driven();
        for (own, (_, axis)) in self.drives.iter_mut().zip(driven) {
            *own = drive(*axis);
        }
        if let (Some(cone), Some([_, most])) = (&mut self.cone, drive(3).limits) {
            *cone = most;
        }
        for (place, frame) in self.frames.iter_mut().zip(joint.frames()) {
            place.position = frame.anchor.into();
        }
    }
}
