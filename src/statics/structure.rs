//! Bodies, contacts, joints and loads of a structure at rest.

use super::loads::{LoadCase, Twist};
use crate::{
    Axis, Contact, ContactKey, Drive, Error, Joint, JointAxis, Motor, State, World, Wrench,
};
use nalgebra::{Matrix3, Vector3};
use tumble_core::joint::TurnKind;

/// Largest gap of a contact, as a fraction of the world's reach, if bodies do not fall farther in a
/// step.
const TOUCH: f64 = 1e-6;
/// Distance from a limit of a joint within which it acts, as a fraction of its unit (m or rad).
const AT_LIMIT: f64 = 1e-6;

/// A structure at rest: rows of its contacts and joints, and its loads.
#[derive(Debug, Clone)]
pub struct Structure {
    /// Reach of each body (m), which makes torques forces.
    pub(super) reaches: Vec<f64>,
    /// Centre of mass of each body (m, world).
    pub(super) centres: Vec<Vector3<f64>>,
    pub(super) rotations: Vec<Matrix3<f64>>,
    pub(super) masses: Vec<f64>,
    /// True for bodies that are held in the world.
    pub(super) held: Vec<bool>,
    pub(super) gravity: Vector3<f64>,
    /// True if loads other than gravity act, or joints with forces of limited size.
    pub(super) has_other_loads: bool,
    pub(super) contacts: Vec<ContactRow>,
    pub(super) axes: Vec<AxisRow>,
    /// Loads w of the scene.
    pub(super) loads: LoadCase,
}

/// A contact of a structure.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct ContactRow {
    /// Identity of the contact.
    pub key: ContactKey,
    /// Touching point (m, world).
    pub point: Vector3<f64>,
    /// Normal from B to A (world).
    pub normal: Vector3<f64>,
    /// Coefficient of friction at rest; on a moving surface, the kinetic one.
    pub friction: f64,
    /// Coefficients of rolling and torsional friction (m).
    pub turning: [f64; 2],
    /// Direction of the force of a surface that moves under its partner (unit, world): friction on A is
    /// a load there, of μ times the normal force.
    pub dragged: Option<Vector3<f64>>,
    /// Direction along which friction is scaled (unit, world), and the scale.
    pub(super) scaled: Option<(Vector3<f64>, f64)>,
    /// Tangents (world).
    pub(super) tangents: [Vector3<f64>; 2],
}

/// Force along or about an axis of a joint, or of a gear.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct AxisRow {
    /// Joint and axis; `None` for a gear.
    pub joint: Option<(usize, JointAxis)>,
    /// Gear.
    pub gear: Option<usize>,
    /// Force (N, world) and torque about the centre (N m, world) of each body per unit force.
    pub(super) on: Vec<(usize, Twist)>,
    /// Range of the force at rest (N or N m).
    pub range: [f64; 2],
}

impl ContactRow {
    fn new(world: &World, states: &[State], contact: &Contact) -> Self {
        let key = contact.key;
        let carried = contact.carried(world, states);
        let turning = contact.turning_friction(world);
        let scaled = contact
            .friction_tensor(world, states)
            .and_then(|tensor| Some((tensor.across.try_normalize(1e-8)?, tensor.stretch())));
        let axis = |k: usize| contact.frame.column(k).into_owned();
        let tangents = match scaled {
            Some((along, _)) => [along, contact.normal().cross(&along)],
            None => [axis(0), axis(1)],
        };
        Self {
            key,
            point: states[key.body].position + contact.arm,
            normal: contact.normal(),
            friction: contact.law.friction,
            turning: [turning.rolling, turning.torsional],
            dragged: carried.try_normalize(1e-12).map(|slip| -slip),
            scaled,
            tangents,
        }
    }

    /// Scales of both tangents.
    pub(super) fn scales(&self) -> [f64; 2] {
        [self.scaled.map_or(1.0, |(_, scale)| scale), 1.0]
    }
}

impl Structure {
    /// Structure of `world` at `states` with these `contacts` and `wrenches`, which act besides
    /// gravity: those of a [`Step`](crate::Step). Velocities count as zero.
    ///
    /// Contacts with a gap above δ = max(|g| h², 10⁻⁶ ℓ) are left out, with the time step h and the
    /// reach ℓ of the world: a body falls by |g| h² in a step from rest.
    ///
    /// # Errors
    /// [`Error::Count`] without one state for each body, or for a wrench or contact of another body;
    /// [`Error::Unsupported`] with adhesion.
    ///
    /// # Panics
    /// If a contact has a fixed piece that the world does not have.
    pub fn new(
        world: &World,
        states: &[State],
        wrenches: &[Wrench],
        contacts: &[Contact],
    ) -> Result<Self, Error> {
        let bodies = world.bodies();
        let count = states.len();
        if count != bodies.len() || wrenches.len() > count {
            return Err(Error::Count { field: "states", count, allowed: "one for each body" });
        }
        let is_known = |contact: &&Contact| contact.key.bodies().all(|body| body < count);
        if let Some(other) = contacts.iter().find(|contact| !is_known(contact)) {
            let count = other.key.body;
            return Err(Error::Count { field: "body of a contact", count, allowed: "a body" });
        }
        if world.has_adhesion() {
            let why = "equilibria have no adhesion; run the scene";
            return Err(Error::Unsupported { what: "adhesion", why });
        }
        // Contacts that touch and are not between held bodies
        let largest = largest_gap(world);
        let is_held = |body: usize| world.is_held(body);
        let moves = |contact: &&Contact| {
            contact.gap + contact.held_gap <= largest && !contact.key.bodies().all(is_held)
        };
        let rows = contacts.iter().filter(moves);
        let mut structure = Self {
            reaches: bodies.iter().map(crate::RigidBody::reach).collect(),
            centres: states.iter().map(|state| state.position).collect(),
            rotations: states.iter().map(|state| state.pose().rotation).collect(),
            masses: bodies.iter().map(crate::RigidBody::mass).collect(),
            held: (0..count).map(is_held).collect(),
            gravity: *world.gravity(),
            has_other_loads: false,
            contacts: rows.map(|contact| ContactRow::new(world, states, contact)).collect(),
            axes: axes(world, states),
            loads: LoadCase::none(count),
        };
        // Weights, wrenches and forces of one size are loads.
        structure.loads = LoadCase::base(&structure, -structure.gravity);
        for (body, wrench) in wrenches.iter().enumerate() {
            let torque = structure.rotations[body] * wrench.torque;
            let load = &mut structure.loads.wrenches[body];
            load.linear += wrench.force;
            load.angular += torque;
            structure.has_other_loads |= *wrench != Wrench::zero();
        }
        let is_bounded = |row: &AxisRow| row.range.iter().any(|end| end.is_finite() && *end != 0.0);
        structure.has_other_loads |= structure.axes.iter().any(is_bounded);
        // Springs and other forces of one size are loads.
        for row in structure.axes.extract_if(.., |row| row.range[0] == row.range[1]) {
            for (body, twist) in row.on {
                let load = &mut structure.loads.wrenches[body];
                *load = load.plus(twist.times(row.range[0]));
            }
        }
        Ok(structure)
    }

    /// Contacts.
    pub fn contacts(&self) -> &[ContactRow] {
        &self.contacts
    }

    /// Axes of joints and gears that can bear a force.
    pub fn axes(&self) -> &[AxisRow] {
        &self.axes
    }

    /// Loads of the scene: gravity and its other wrenches.
    pub fn loads(&self) -> &LoadCase {
        &self.loads
    }

    /// Copy with the coefficient of friction that `friction` gives each contact.
    #[must_use]
    pub fn with_friction(&self, friction: impl Fn(&ContactRow) -> f64) -> Self {
        let mut changed = self.clone();
        for contact in &mut changed.contacts {
            contact.friction = friction(contact).max(0.0);
        }
        changed
    }

    /// Copy without loads, whose joints have no forces of limited size: a force state of it remains one
    /// when it is scaled.
    pub(super) fn without_bounded_forces(&self) -> Self {
        let mut changed = self.clone();
        let unbounded = |end: f64| if end.is_finite() { 0.0 } else { end };
        changed.axes.iter_mut().for_each(|axis| axis.range = axis.range.map(unbounded));
        changed.loads = LoadCase::none(self.masses.len());
        changed
    }

    /// Largest load on a free body (N), with torques divided by its reach.
    pub(super) fn size(&self, loads: &LoadCase) -> f64 {
        let sizes = loads.wrenches.iter().zip(&self.reaches).zip(&self.held);
        sizes.filter(|(_, held)| !**held).fold(0.0, |most: f64, ((load, reach), _)| {
            most.max(load.linear.norm()).max(load.angular.norm() / reach)
        })
    }

    /// Copy with all coefficients of friction times `factor`, except those of moving surfaces.
    #[must_use]
    pub fn with_friction_times(&self, factor: f64) -> Self {
        self.with_friction(|contact| {
            contact.friction * if contact.dragged.is_some() { 1.0 } else { factor }
        })
    }
}

/// δ: largest gap of a contact at rest (m).
pub(super) fn largest_gap(world: &World) -> f64 {
    (world.gravity().norm() * world.time_step().powi(2)).max(TOUCH * world.reach())
}

/// Rows of all joints and gears of `world` that can bear a force at `states`.
fn axes(world: &World, states: &[State]) -> Vec<AxisRow> {
    let angles = world.angles_near(states, &vec![Vector3::zeros(); world.joints().len()]);
    let mut rows = Vec::new();
    for (index, joint) in world.joints().iter().enumerate() {
        let Some(at) = joint.coordinates(states) else { continue };
        let along = joint.linear().iter().zip(&at.place).enumerate();
        let along = along.map(|(k, (law, place))| (JointAxis::Linear(k), law, *place));
        let about = joint.angular().iter().zip(&angles[index]).enumerate();
        let about = about.map(|(k, (law, angle))| (JointAxis::Angular(k), law, *angle));
        for (axis, law, coordinate) in along.chain(about) {
            let is_cone = joint.turning() == TurnKind::Ball && axis == JointAxis::Angular(0);
            let range = range_at_rest(law, coordinate, is_cone);
            let on = wrenches(joint, states, axis);
            if range != [0.0; 2] && !on.is_empty() {
                rows.push(AxisRow { joint: Some((index, axis)), gear: None, on, range });
            }
        }
    }
    for (index, gear) in world.gears().iter().enumerate() {
        // The force acts on q₁ − r q₂.
        let mut on = Vec::new();
        for (axis, share) in gear.axes().iter().zip([1.0, -gear.ratio()]) {
            let of_axis = wrenches(&world.joints()[axis.joint], states, axis.axis);
            on.extend(of_axis.into_iter().map(|(body, twist)| (body, twist.times(share))));
        }
        let law = gear.drive().map_or(Axis::Locked, |drive| Axis::Free(*drive));
        let range = range_at_rest(&law, gear.coordinate(world.joints(), states, &angles), false);
        if range != [0.0; 2] {
            rows.push(AxisRow { joint: None, gear: Some(index), on, range });
        }
    }
    rows
}

/// World wrenches on the bodies of a `joint` by a unit force along an axis.
fn wrenches(joint: &Joint, states: &[State], axis: JointAxis) -> Vec<(usize, Twist)> {
    let Some(on) = joint.wrenches(states, axis, 1.0) else { return Vec::new() };
    let bodies = [Some(joint.body()), joint.other()].into_iter().zip(on);
    let placed = bodies.filter_map(|(body, wrench)| {
        let body = body?;
        let pose = states[body].pose();
        let twist = Twist { linear: wrench.force, angular: pose.rotation * wrench.torque };
        (wrench != Wrench::zero()).then_some((body, twist))
    });
    placed.collect()
}

/// Range of the force of an axis at rest at a `coordinate`: that of its drive's law at the rate 0. The
/// lower end of the swing of a cone is no stop.
///
/// | part | force |
/// |---|---|
/// | locked | any |
/// | stop that is reached | pushes back |
/// | dry friction, motor that holds a speed of 0 | at most its size |
/// | spring, constant force | as they are |
/// | motor with a target | its force at rest, within its limit |
fn range_at_rest(law: &Axis, coordinate: f64, is_cone: bool) -> [f64; 2] {
    let Axis::Free(drive) = law else { return [f64::NEG_INFINITY, f64::INFINITY] };
    let Drive { limits, stiffness, rest, force, motor, .. } = drive;
    let mut value = force + stiffness * (rest - coordinate);
    let mut holding = drive.holding_friction();
    match motor {
        None => {}
        Some(Motor::Speed { target, max_force }) if *target == 0.0 => holding += max_force,
        Some(Motor::Speed { target, max_force }) => value += max_force.copysign(*target),
        Some(Motor::Position { target, stiffness, damping: _, max_force }) => {
            value += (stiffness * (target - coordinate)).clamp(-max_force, *max_force);
        }
        Some(Motor::Damper { target, damping, max_force }) => {
            value += (damping * target).clamp(-max_force, *max_force);
        }
    }
    let [mut low, mut high] = [value - holding, value + holding];
    if let Some([least, most]) = limits {
        if coordinate <= least + AT_LIMIT && !is_cone {
            high = f64::INFINITY;
        }
        if coordinate >= most - AT_LIMIT {
            low = f64::NEG_INFINITY;
        }
    }
    [low, high]
}
