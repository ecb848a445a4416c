//! The joints and gears of the program: their coordinates, and what acts along them.
//!
//! The impulse of a row acts along the row's own slope where nothing has moved yet, as docs/joints.md has it: a force f
//! changes the velocities of a body by
//!
//! ```text
//! δv⁺ = h/m ∂g/∂r f,   δω⁺ = h I⁻¹ (½ L(q) H)ᵀ ∂g/∂q f   at X_k                            (eq. 37)
//! ```

use super::PosedStep;
use super::bond::{Act, Bond, Law, Start, laws};
use super::component::{Component, Place};
use super::coordinate::Coordinate;
use crate::error::Error;
use crate::joint::{Axis, Drive, GearAxis, JointAxis, JointForce, Turning};
use crate::mechanics::quaternion::attitude_map;
use crate::mechanics::{State, Wrench};
use nalgebra::{Vector3, Vector4};

/// A stop, or a bound of a force, that only a thousand times the world's [speed](crate::world::World::speed_scale)
/// would meet is none: limits of 10¹² mean that there is no limit.
const FAR: f64 = 1e3;

/// Within this part of that speed something may hold as well as slip: how a force that is known as a sum is told apart.
const NEAR: f64 = 1e-4;

/// All of them, in a step.
#[derive(Debug, Clone, Default)]
pub(super) struct Ties {
    pub(super) coordinates: Vec<Coordinate>,
    pub(super) bonds: Vec<Bond>,
    /// What acts along joints at any speed, on each body: force (world) and torque (body).
    pub(super) pushes: Vec<Wrench>,
    axes: Vec<AxisOf>,
    /// The bond of every gear, and what makes its force one along its first coordinate: 1, or ℓ (m).
    gears: Vec<(usize, f64)>,
    /// Joints of the world.
    joints: usize,
    pub(super) variables: usize,
    pub(super) rows: usize,
    near: f64,
    time_step: f64,
}

/// An axis of a joint that something acts along.
#[derive(Debug, Clone)]
struct AxisOf {
    joint: usize,
    axis: JointAxis,
    coordinate: usize,
    /// 1, or ℓ (m): forces of the program are N.
    length: f64,
    /// What acts at any speed, N.
    constant: f64,
    /// Its bonds without gears.
    bonds: std::ops::Range<usize>,
    /// x_k.
    start: f64,
}

/// What a builder of ties looks things up in.
struct Given<'a, P> {
    step: &'a PosedStep<'a>,
    /// The place in the program of a body of the world.
    place: P,
    /// Where the velocities of step k came from.
    before: Vec<State>,
}

impl Ties {
    /// Those of `step`; `place` gives the place in the program of a body of the world.
    pub(super) fn new(
        step: &PosedStep<'_>,
        place: impl Fn(usize) -> Result<usize, Error>,
    ) -> Result<Self, Error> {
        let (world, h) = (step.world, step.world.time_step());
        let near = NEAR * world.speed_scale();
        let pushes = vec![Wrench::zero(); step.bodies.len()];
        let joints = world.joints().len();
        let mut ties = Self { pushes, near, time_step: h, joints, ..Self::default() };
        if joints == 0 {
            return Ok(ties);
        }
        let before = step.states.iter().map(|state| state.coasted(-h)).collect();
        let given = Given { step, place, before };
        for index in 0..joints {
            for k in 0..3 {
                ties.add_axis(&given, index, JointAxis::Linear(k))?;
            }
            for k in 0..3 {
                ties.add_axis(&given, index, JointAxis::Angular(k))?;
            }
        }
        for gear in world.gears() {
            if gear.drive().is_some() {
                let what = "a drive of a sum of coordinates in Ipopt's program";
                let why = "it knows gears that are held; take the native solver";
                return Err(Error::Unsupported { what, why });
            }
            let length = gear.length(world.joints(), world.bodies());
            let [first, second] = gear.axes();
            let (one, two) = (ties.geared(first), ties.geared(second));
            let (Some(one), Some(two)) = (one, two) else {
                let allowed = "axes of joints of the world";
                return Err(Error::Count { field: "gear", count: first.joint, allowed });
            };
            let (one, two) = (&ties.axes[one], &ties.axes[two]);
            let missed = one.start - gear.ratio() * two.start - gear.offset();
            let along = vec![
                (one.coordinate, length / one.length),
                (two.coordinate, -gear.ratio() * length / two.length),
            ];
            ties.gears.push((ties.bonds.len(), length));
            ties.add_bond(&given, along, Law::held(-length * missed / h))?;
        }
        Ok(ties)
    }

    fn geared(&self, at: &GearAxis) -> Option<usize> {
        self.axes.iter().position(|of| of.joint == at.joint && of.axis == at.axis)
    }

    /// Adds an axis, if anything acts along it.
    fn add_axis<P: Fn(usize) -> Result<usize, Error>>(
        &mut self,
        given: &Given<'_, P>,
        index: usize,
        axis: JointAxis,
    ) -> Result<(), Error> {
        let (step, world) = (given.step, given.step.world);
        let joint = &world.joints()[index];
        let (is_turn, k) = match axis {
            JointAxis::Linear(k) => (false, k),
            JointAxis::Angular(k) => (true, k),
        };
        if is_turn && joint.turning() == Turning::Free {
            return Ok(());
        }
        if is_turn && joint.turning() == Turning::Driven {
            let what = "drives of a turn in any way in Ipopt's program";
            let why = "it knows those of hinges, gimbals and cones; take the native solver";
            return Err(Error::Unsupported { what, why });
        }
        let (of, push) = match is_turn {
            false => (&joint.linear()[k], joint.push()[0][k]),
            true => (&joint.angular()[k], joint.push()[1][k]),
        };
        let is_geared = world
            .gears()
            .iter()
            .flat_map(|gear| gear.axes())
            .any(|at| at.joint == index && at.axis == axis);
        let idle = *of == Axis::Free(Drive::NONE) && push == 0.0;
        if idle && !is_geared {
            return Ok(());
        }
        let h = world.time_step();
        let unknown = Error::Count {
            field: "body of a joint",
            count: joint.body(),
            allowed: "a body with a state",
        };
        let known = |states: &[State], near: &Vector3<f64>| {
            let at = joint.coordinates(states).ok_or(unknown.clone())?;
            let turns = joint.counted(&at, near);
            Ok::<_, Error>((turns, if is_turn { turns[k] } else { at.place[k] }))
        };
        let near = step.angles.get(index).copied().unwrap_or_default();
        let (turns, start) = known(step.states, &near)?;
        let (_, came) = known(&given.before, &turns)?;
        let length = if is_turn { joint.length(world.bodies()) } else { 1.0 };
        let side = |body: usize| Ok::<_, Error>(((given.place)(body)?, &step.states[body]));
        let sides = (side(joint.body())?, joint.other().map(side).transpose()?);
        let locked = *of == Axis::Locked;
        let coordinate = Coordinate::new(joint, axis, sides, (length, &turns), locked);
        self.coordinates.push(coordinate);
        let coordinate = self.coordinates.len() - 1;
        let first = self.bonds.len();
        let mut constant = 0.0;
        let of_axis = match of {
            Axis::Locked => vec![Law::held(0.0)],
            Axis::Free(drive) => {
                let mut drive = *drive;
                if let (Turning::Ball, JointAxis::Angular(0), Some([_, most])) =
                    (joint.turning(), axis, drive.limits)
                {
                    // A swing is never below zero.
                    drive.limits = Some([f64::NEG_INFINITY, most]);
                }
                let rate = (start - came) / h;
                let start = Start { coordinate: start, rate, time_step: h, length };
                let far = FAR * world.speed_scale();
                let mass = world.bodies().iter().fold(0.0, |most, body| body.mass().max(most));
                let (force, laws) = laws(&drive, push, &start, (far, mass));
                constant = force;
                laws
            }
        };
        for law in of_axis {
            self.add_bond(given, vec![(coordinate, 1.0)], law)?;
        }
        let bonds = first..self.bonds.len();
        if constant != 0.0 {
            for (body, slope) in self.slopes(&[(coordinate, 1.0)], |body| start_of(given, body)) {
                let old = &step.states[step.bodies[body]];
                self.pushes[body].force += slope.0 * constant;
                self.pushes[body].torque += torque(old, &slope.1) * constant;
            }
        }
        let joint = index;
        self.axes.push(AxisOf { joint, axis, coordinate, length, constant, bonds, start });
        Ok(())
    }

    fn add_bond<P>(
        &mut self,
        given: &Given<'_, P>,
        along: Vec<(usize, f64)>,
        law: Law,
    ) -> Result<(), Error> {
        let h = self.time_step;
        let slopes = self.slopes(&along, |body| start_of(given, body));
        let act = |(body, (force, by_attitude)): (usize, Slope)| {
            let index = given.step.bodies[body];
            let (of, state) = (&given.step.world.bodies()[index], &given.step.states[index]);
            let spin = of.inertia_inverse() * torque(state, &by_attitude) * h;
            Act { body, velocity: force * (h / of.mass()), spin }
        };
        let acts = slopes.into_iter().map(act).collect();
        let (variable, row) = (self.variables, self.rows);
        self.variables += law.variables();
        self.rows += law.rows();
        self.bonds.push(Bond { along, law, variable, row, acts });
        Ok(())
    }

    /// Σ w ∂g/∂(r, q) of the bodies, each once, where they are at `at`.
    pub(super) fn slopes(
        &self,
        along: &[(usize, f64)],
        at: impl Fn(usize) -> Place,
    ) -> Vec<(usize, Slope)> {
        let mut slopes: Vec<(usize, Slope)> = Vec::with_capacity(4);
        let mut add =
            |body: usize, by_position: Vector3<f64>, by_attitude: Vector4<f64>| match slopes
                .iter_mut()
                .find(|(known, _)| *known == body)
            {
                Some((_, slope)) => {
                    slope.0 += by_position;
                    slope.1 += by_attitude;
                }
                None => slopes.push((body, (by_position, by_attitude))),
            };
        for (coordinate, weight) in along {
            let coordinate = &self.coordinates[*coordinate];
            let (a, b) = coordinate.bodies;
            let Component { by_position, by_a, by_b, .. } =
                coordinate.component((at(a), b.map(&at)));
            add(a, by_position * *weight, by_a * *weight);
            if let Some(b) = b {
                add(b, -by_position * *weight, by_b * *weight);
            }
        }
        slopes
    }

    /// Whether any coordinate of a bond is one of a place.
    pub(super) fn moves(&self, bond: &Bond) -> bool {
        bond.along.iter().any(|(coordinate, _)| self.coordinates[*coordinate].is_place())
    }

    /// u of a bond, m/s, where the bodies are at `at`.
    pub(super) fn speed(&self, bond: &Bond, at: impl Fn(usize) -> Place) -> f64 {
        let of = |(coordinate, weight): &(usize, f64)| {
            let coordinate = &self.coordinates[*coordinate];
            let (a, b) = coordinate.bodies;
            weight * coordinate.component((at(a), b.map(&at))).value
        };
        bond.along.iter().map(of).sum::<f64>() / self.time_step
    }

    /// Sets the variables `x` of all bonds to those of the `forces` of the joints and `gears` (none, or one each), with
    /// the bodies at `at`. What several bonds of an axis share is told apart by the speed.
    pub(super) fn set(
        &self,
        (forces, gears): (&[JointForce], &[f64]),
        at: impl Fn(usize) -> Place,
        x: &mut [f64],
    ) {
        for of in &self.axes {
            let whole = forces.get(of.joint).map_or(0.0, |force| match of.axis {
                JointAxis::Linear(k) => force.force[k],
                JointAxis::Angular(k) => force.torque[k] / of.length,
            });
            let bonds = &self.bonds[of.bonds.clone()];
            let mut left = whole - of.constant;
            let known = |bond: &Bond| {
                bond.law.force_at(self.speed(bond, &at), self.near).filter(|_| !forces.is_empty())
            };
            left -= bonds.iter().filter_map(known).sum::<f64>();
            for bond in bonds {
                let force = known(bond).unwrap_or_else(|| {
                    let share = bond.law.clamped(left);
                    left -= share;
                    share
                });
                self.set_bond(bond, force, &at, x);
            }
        }
        for (number, (bond, length)) in self.gears.iter().enumerate() {
            let force = gears.get(number).map_or(0.0, |force| force / length);
            self.set_bond(&self.bonds[*bond], force, &at, x);
        }
    }

    fn set_bond(&self, bond: &Bond, force: f64, at: impl Fn(usize) -> Place, x: &mut [f64]) {
        let law = &bond.law;
        x[bond.variable] = force;
        let beyond = self.speed(bond, at) + law.yields * force - law.target;
        for bound in bond.bounds() {
            x[bound.beside] = (bound.sign * beyond).max(0.0);
            x[bound.slack] = (x[bound.beside] * bound.room(force)).max(0.0);
        }
    }

    /// The forces of all joints of the world, without their angles, and of the gears, from the variables `x` of the bonds.
    pub(super) fn forces(&self, x: &[f64]) -> (Vec<JointForce>, Vec<f64>) {
        let mut forces = vec![JointForce::none(Vector3::zeros()); self.joints];
        for of in &self.axes {
            let bonds = self.bonds[of.bonds.clone()].iter();
            let force = of.constant + bonds.map(|bond| x[bond.variable]).sum::<f64>();
            match of.axis {
                JointAxis::Linear(k) => forces[of.joint].force[k] = force,
                JointAxis::Angular(k) => forces[of.joint].torque[k] = force * of.length,
            }
        }
        let gears = self.gears.iter().map(|(bond, length)| length * x[self.bonds[*bond].variable]);
        (forces, gears.collect())
    }
}

/// ∂g/∂r and ∂g/∂q of a body.
type Slope = (Vector3<f64>, Vector4<f64>);

fn start_of<P>(given: &Given<'_, P>, body: usize) -> Place {
    Place::of(&given.step.states[given.step.bodies[body]])
}

/// (½ L(q) H)ᵀ ∂g/∂q: the torque (frame of the body) of a force of 1 N.
fn torque(state: &State, by_attitude: &Vector4<f64>) -> Vector3<f64> {
    attitude_map(&state.attitude).tr_mul(by_attitude) * 0.5
}
