//! Coordinates of a robot, and its kinematics and dynamics.
//!
//! Coordinates q and rates v follow the order of [`Robot::joints`](super::model::Robot::joints).
//! Their layout is that of MuJoCo:
//!
//! - free: position of the link's origin (m) and attitude (w, x, y, z). The rates are the velocity
//!   of the origin (m/s, world) and the angular velocity (rad/s, link).
//! - ball: attitude and angular velocity.
//! - slide: displacement (m) and its rate (m/s).
//! - hinge: angle (rad) and its rate (rad/s).

use super::frame::{LinkFrame, about};
use super::model::{MimicJoint, Moves, Robot, RobotJoint};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector4};
use tumble_core::mechanics::quaternion::{conjugated, product, rotation, rotation_vector};

/// Motion of everything below a joint per unit of one rate: ω = axis, and velocity `along` + axis ×
/// x at the point x (world).
#[derive(Debug, Clone, Copy)]
struct Screw {
    axis: Vector3<f64>,
    along: Vector3<f64>,
}

impl Screw {
    /// Velocity at a point.
    fn at(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.along + self.axis.cross(point)
    }

    fn about(axis: Vector3<f64>, through: &Vector3<f64>) -> Self {
        Self { axis, along: through.cross(&axis) }
    }
}

/// Pose and velocity of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkMotion {
    /// Pose in the world.
    pub frame: LinkFrame,
    /// Angular velocity (rad/s), world.
    pub spin: Vector3<f64>,
    /// Velocity of its origin (m/s), world.
    pub velocity: Vector3<f64>,
}

impl LinkMotion {
    /// Rest at a pose.
    pub fn still(frame: LinkFrame) -> Self {
        Self { frame, spin: Vector3::zeros(), velocity: Vector3::zeros() }
    }
}

/// Kinematics of all links at given coordinates and rates.
#[derive(Debug, Clone)]
pub struct RobotMotion {
    links: Vec<LinkMotion>,
    /// Angular acceleration and acceleration of the origin of each link at constant rates.
    turning: Vec<[Vector3<f64>; 2]>,
    screws: Vec<Screw>,
    /// Indices of the rates that move each link.
    movers: Vec<Vec<usize>>,
}

impl Robot {
    /// Coordinates at which every link has its pose of the file.
    pub fn reference(&self) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.counts().0);
        for joint in &self.joints {
            match joint.moves {
                Moves::Free => {
                    let placed = self.links[0].frame.then(&self.links[joint.link].frame);
                    let LinkFrame { position, attitude } = placed;
                    all.extend(position.iter().chain(&attitude));
                }
                Moves::Ball => all.extend([1.0, 0.0, 0.0, 0.0]),
                Moves::Slide | Moves::Hinge => all.push(joint.reference),
            }
        }
        all
    }

    /// Offset of each joint in the coordinates and in the rates.
    pub fn places(&self) -> Vec<(usize, usize)> {
        let mut at = (0, 0);
        let place = |joint: &RobotJoint| {
            let here = at;
            let (q, v) = joint.moves.counts();
            at = (at.0 + q, at.1 + v);
            here
        };
        self.joints.iter().map(place).collect()
    }

    /// Sets the coordinates and rates of dependent joints from those they depend on. Chains of
    /// dependent joints are resolved. Slices may be shorter than the robot; missing entries are
    /// skipped.
    pub fn follow(&self, q: &mut [f64], v: &mut [f64]) {
        let places = self.places();
        // Enough passes for the longest possible chain.
        let count = self.follows.len();
        for MimicJoint { joints, ratio, offset, .. } in
            self.follows.iter().cycle().take(count * count)
        {
            let [own, other] = joints.map(|joint| places[joint]);
            if let Some(&leader) = q.get(other.0)
                && let Some(coordinate) = q.get_mut(own.0)
            {
                *coordinate = ratio * leader + offset;
            }
            if let Some(&leader) = v.get(other.1)
                && let Some(rate) = v.get_mut(own.1)
            {
                *rate = ratio * leader;
            }
        }
    }

    /// Kinematics of all links at coordinates `q` and rates `v`.
    ///
    /// # Errors
    /// A wrong number of entries; an entry that is not finite; a quaternion of zero length.
    pub fn motion(&self, q: &[f64], v: &[f64]) -> Result<RobotMotion, String> {
        let (positions, rates) = self.counts();
        for (what, given, needed) in [("coordinates", q, positions), ("rates", v, rates)] {
            if given.len() != needed {
                return Err(format!("{what}: {} are given; {needed} are needed", given.len()));
            }
            if let Some(invalid) = given.iter().find(|number| !number.is_finite()) {
                return Err(format!("{what}: {invalid:?} is not a finite number"));
            }
        }
        let places = self.places();
        let mut motion = RobotMotion {
            links: vec![LinkMotion::still(self.links[0].frame)],
            turning: vec![[Vector3::zeros(); 2]],
            screws: Vec::with_capacity(rates),
            movers: vec![Vec::new()],
        };
        for link in &self.links[1..] {
            let (above, [turn, pull]) = (motion.links[link.parent], motion.turning[link.parent]);
            let mut stage = MovingFrame { motion: above, turn, pull };
            stage.step(&(above.frame.rotation() * link.frame.position));
            stage.motion.frame.attitude = above.frame.then(&link.frame).attitude;
            let mut movers = motion.movers[link.parent].clone();
            let (first, count) = link.joints;
            let joints = self.joints[first..].iter().zip(&places[first..]).take(count);
            for (joint, &(at, rate)) in joints {
                let before = motion.screws.len();
                stage.add(joint, &q[at..], &v[rate..], &mut motion.screws)?;
                movers.extend(before..motion.screws.len());
            }
            motion.links.push(stage.motion);
            motion.turning.push([stage.turn, stage.pull]);
            motion.movers.push(movers);
        }
        Ok(motion)
    }

    /// Coordinates of links with the poses `frames` (world), one per link. Angles are those nearest
    /// to `near`.
    ///
    /// # Errors
    /// A wrong number of frames or coordinates.
    pub fn coordinates(&self, frames: &[LinkFrame], near: &[f64]) -> Result<Vec<f64>, String> {
        if frames.len() != self.links.len() || near.len() != self.counts().0 {
            return Err(format!(
                "frames: {} are given; {} are needed",
                frames.len(),
                self.links.len()
            ));
        }
        let places = self.places();
        let mut q = near.to_vec();
        for (index, link) in self.links.iter().enumerate().skip(1) {
            let (first, count) = link.joints;
            let joints = &self.joints[first..first + count];
            let Some(begin) = places.get(first).map(|place| place.0).filter(|_| count > 0) else {
                continue;
            };
            let own = frames[index].relative_to(&frames[link.parent]).relative_to(&link.frame);
            match joints {
                [RobotJoint { moves: Moves::Free, .. }] => {
                    let LinkFrame { position, attitude } = frames[index];
                    q[begin..begin + 3].copy_from_slice(position.as_slice());
                    q[begin + 3..begin + 7].copy_from_slice(attitude.as_slice());
                }
                [RobotJoint { moves: Moves::Ball, .. }] => {
                    q[begin..begin + 4].copy_from_slice(own.attitude.as_slice());
                }
                _ => self.chain(joints, &own, &mut q[begin..begin + count]),
            }
        }
        Ok(q)
    }

    /// Solves for the coordinates of a chain of slides and hinges that brings a link to `own`, its
    /// pose relative to the reference. Newton's method, starting from `q`.
    fn chain(&self, joints: &[RobotJoint], own: &LinkFrame, q: &mut [f64]) {
        const MOST: usize = 30;
        for _ in 0..MOST {
            let mut stage = MovingFrame::still();
            let mut screws = Vec::with_capacity(joints.len());
            for (joint, at) in joints.iter().zip(q.iter()) {
                // Cannot fail: each of these joints has one coordinate.
                if stage.add(joint, &[*at], &[0.0], &mut screws).is_err() {
                    return;
                }
            }
            let there = stage.motion.frame;
            let turn = product(&own.attitude, &conjugated(&there.attitude));
            let turn = rotation_vector(&turn);
            let missing = own.position - there.position;
            let rates = solved(&screws, &there.position, &missing, &turn);
            for (at, rate) in q.iter_mut().zip(rates.iter()) {
                *at += rate;
            }
            let scale = own.position.norm().max(1.0);
            if missing.norm() <= 1e-15 * scale && turn.norm() <= 1e-15 {
                return;
            }
        }
    }
}

/// Least-squares rates of `screws` for a velocity at `point` and an angular velocity.
fn solved(
    screws: &[Screw],
    point: &Vector3<f64>,
    velocity: &Vector3<f64>,
    spin: &Vector3<f64>,
) -> DVector<f64> {
    /// Smallest relative diagonal entry of R for independent screws.
    const INDEPENDENT: f64 = 1e-6;
    let columns = DMatrix::from_fn(6, screws.len(), |row, column| match row {
        0..3 => screws[column].at(point)[row],
        _ => screws[column].axis[row - 3],
    });
    let wanted = DVector::from_fn(6, |row, _| if row < 3 { velocity[row] } else { spin[row - 3] });
    // QR before SVD: this SVD has an accuracy of only 1e-4 for equal singular values, as of a ball.
    let triangular = columns.clone().qr();
    let r = triangular.r();
    let (least, most) = (r.diagonal().abs().min(), r.diagonal().abs().max());
    if screws.len() <= 6 && least > INDEPENDENT * most {
        let along = triangular.q().tr_mul(&wanted);
        if let Some(found) = r.solve_upper_triangular(&along) {
            return found;
        }
    }
    let found = columns.svd(true, true).solve(&wanted, 1e-12);
    found.unwrap_or_else(|_| DVector::zeros(screws.len()))
}

/// Frame that is carried through the joints of a link.
struct MovingFrame {
    motion: LinkMotion,
    turn: Vector3<f64>,
    pull: Vector3<f64>,
}

impl MovingFrame {
    fn still() -> Self {
        let motion = LinkMotion::still(LinkFrame::identity());
        Self { motion, turn: Vector3::zeros(), pull: Vector3::zeros() }
    }

    /// Moves the origin by `arm` (world) to another point of the same rigid body.
    fn step(&mut self, arm: &Vector3<f64>) {
        let spin = self.motion.spin;
        self.motion.frame.position += arm;
        self.motion.velocity += spin.cross(arm);
        self.pull += self.turn.cross(arm) + spin.cross(&spin.cross(arm));
    }

    /// Applies a joint, whose coordinates and rates are at the start of `q` and `v`.
    fn add(
        &mut self,
        joint: &RobotJoint,
        q: &[f64],
        v: &[f64],
        screws: &mut Vec<Screw>,
    ) -> Result<(), String> {
        let turn = self.motion.frame.rotation();
        match joint.moves {
            Moves::Free => {
                let attitude = unit(&q[3..7])?;
                let position = Vector3::from_column_slice(&q[..3]);
                self.motion.frame = LinkFrame { position, attitude };
                let turn = self.motion.frame.rotation();
                self.motion.velocity = Vector3::from_column_slice(&v[..3]);
                self.motion.spin = turn * Vector3::from_column_slice(&v[3..6]);
                let slide =
                    |k: usize| Screw { axis: Vector3::zeros(), along: Vector3::ith(k, 1.0) };
                screws.extend((0..3).map(slide));
                screws.extend((0..3).map(|k| Screw::about(turn.column(k).into_owned(), &position)));
                (self.turn, self.pull) = (Vector3::zeros(), Vector3::zeros());
            }
            Moves::Slide => {
                let axis = turn * joint.axis;
                self.step(&(axis * (q[0] - joint.reference)));
                self.motion.velocity += axis * v[0];
                // Coriolis acceleration 2 ω × v
                self.pull += self.motion.spin.cross(&axis) * (2.0 * v[0]);
                screws.push(Screw { axis: Vector3::zeros(), along: axis });
            }
            Moves::Hinge => {
                let axis = turn * joint.axis;
                // Rotation about the anchor: to it, turn, and back
                self.step(&(turn * joint.anchor));
                screws.push(Screw::about(axis, &self.motion.frame.position));
                self.spin_up(&about(&joint.axis, q[0] - joint.reference), &(axis * v[0]));
                self.step(&-(self.motion.frame.rotation() * joint.anchor));
            }
            Moves::Ball => {
                self.step(&(turn * joint.anchor));
                let attitude = unit(&q[..4])?;
                let after = turn * rotation(&attitude);
                let anchor = self.motion.frame.position;
                screws.extend((0..3).map(|k| Screw::about(after.column(k).into_owned(), &anchor)));
                self.spin_up(&attitude, &(after * Vector3::from_column_slice(&v[..3])));
                self.step(&-(self.motion.frame.rotation() * joint.anchor));
            }
        }
        Ok(())
    }

    /// Rotates the frame by `turn` (own frame) and adds the angular velocity `spin` (world), which
    /// rotates with the frame.
    fn spin_up(&mut self, turn: &Vector4<f64>, spin: &Vector3<f64>) {
        let frame = &mut self.motion.frame;
        frame.attitude = product(&frame.attitude, turn).normalize();
        self.turn += self.motion.spin.cross(spin);
        self.motion.spin += spin;
    }
}

fn unit(four: &[f64]) -> Result<Vector4<f64>, String> {
    let attitude = Vector4::from_column_slice(four);
    if attitude.norm() > 1e-12 {
        Ok(attitude.normalize())
    } else {
        Err("coordinates: the length of an attitude quaternion is zero".to_owned())
    }
}

impl RobotMotion {
    /// Motion of all links, the world first.
    pub fn links(&self) -> &[LinkMotion] {
        &self.links
    }

    /// Jacobians of the position of a point (m, frame of the link) and of the orientation of its
    /// link. Both have 3 rows and one column per rate, in world axes.
    ///
    /// # Panics
    /// If the link does not exist.
    pub fn jacobian(&self, link: usize, point: &Vector3<f64>) -> [DMatrix<f64>; 2] {
        let point = self.links[link].frame.point(point);
        let rates = self.screws.len();
        let [mut place, mut turn] = [(); 2].map(|()| DMatrix::zeros(3, rates));
        for &mover in &self.movers[link] {
            place.set_column(mover, &self.screws[mover].at(&point));
            turn.set_column(mover, &self.screws[mover].axis);
        }
        [place, turn]
    }

    /// Mass matrix, including armatures:
    ///
    /// ```text
    /// M = Σ m Jᵀ J + Jωᵀ I Jω + diag(armature)
    /// ```
    pub fn mass_matrix(&self, robot: &Robot) -> DMatrix<f64> {
        let rates = self.screws.len();
        let mut matrix = DMatrix::zeros(rates, rates);
        for (index, link) in robot.links.iter().enumerate() {
            let (centre, inertia) = self.heavy(robot, index);
            let movers = &self.movers[index];
            for &a in movers {
                let (pull, turn) =
                    (self.screws[a].at(&centre) * link.mass.mass, inertia * self.screws[a].axis);
                for &b in movers {
                    let other = &self.screws[b];
                    matrix[(a, b)] += pull.dot(&other.at(&centre)) + turn.dot(&other.axis);
                }
            }
        }
        for (joint, (_, rate)) in robot.joints.iter().zip(robot.places()) {
            for k in 0..joint.moves.counts().1 {
                matrix[(rate + k, rate + k)] += joint.armature;
            }
        }
        matrix
    }

    /// Bias forces (N and N m) under `gravity` (m/s²): Coriolis, centrifugal and gravity terms. The
    /// equation of motion is M v̇ + bias = τ, with τ the forces along the rates.
    ///
    /// ```text
    /// bias = Σ m Jᵀ (a − g) + Jωᵀ (I α + ω × I ω),
    /// ```
    ///
    /// The accelerations a and α are those at constant v.
    pub fn bias(&self, robot: &Robot, gravity: &Vector3<f64>) -> DVector<f64> {
        let mut bias = DVector::zeros(self.screws.len());
        for (index, link) in robot.links.iter().enumerate() {
            let (centre, inertia) = self.heavy(robot, index);
            let (LinkMotion { frame, spin, .. }, [turn, pull]) =
                (self.links[index], self.turning[index]);
            let arm = centre - frame.position;
            let pull = pull + turn.cross(&arm) + spin.cross(&spin.cross(&arm));
            let force = (pull - gravity) * link.mass.mass;
            let torque = inertia * turn + spin.cross(&(inertia * spin));
            for &mover in &self.movers[index] {
                bias[mover] += force.dot(&self.screws[mover].at(&centre))
                    + torque.dot(&self.screws[mover].axis);
            }
        }
        bias
    }

    /// Centre of mass and inertia of a link, world.
    fn heavy(&self, robot: &Robot, link: usize) -> (Vector3<f64>, Matrix3<f64>) {
        let (frame, mass) = (&self.links[link].frame, &robot.links[link].mass);
        let turn = frame.rotation();
        (frame.point(&mass.centre), turn * mass.inertia * turn.transpose())
    }

    /// Rates of the joints for links that move as in `moving`. Only links with joints and their
    /// parents matter.
    pub fn rates(&self, robot: &Robot, moving: &[LinkMotion]) -> Vec<f64> {
        let mut rates = vec![0.0; self.screws.len()];
        let places = robot.places();
        for (index, link) in robot.links.iter().enumerate().skip(1) {
            let (first, count) = link.joints;
            let Some(&(_, begin)) = places.get(first).filter(|_| count > 0) else { continue };
            let end = begin
                + robot.joints_of(index).iter().map(|joint| joint.moves.counts().1).sum::<usize>();
            let (own, above) = (&moving[index], &moving[link.parent]);
            let point = self.links[index].frame.position;
            let is_free = robot.joints_of(index)[0].moves == Moves::Free;
            let (velocity, spin) = if is_free {
                (own.velocity, own.spin)
            } else {
                let arm = own.frame.position - above.frame.position;
                (own.velocity - above.velocity - above.spin.cross(&arm), own.spin - above.spin)
            };
            let found = solved(&self.screws[begin..end], &point, &velocity, &spin);
            rates[begin..end].copy_from_slice(found.as_slice());
        }
        rates
    }
}
