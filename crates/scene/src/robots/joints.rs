//! Joints, gears and constraints between the bodies of a robot.
//!
//! A *link* belongs to the robot file, a *body* to the scene. One body can carry several links that
//! are rigidly connected. Joint frames of the scene are relative to the centres of mass.

use super::{Assembled, Carried, Placing, place_of};
use crate::bodies::entries::ApartEntry;
use crate::bodies::joints::{JointEntry, MotorEntry};
use crate::bodies::place::Place;
use crate::document::Document;
use nalgebra::Vector4;
use std::collections::BTreeSet;
use tumble_core::joint::{Gear, GearAxis};
use tumble_core::simulation::JOINT_AT_THE_START;
use tumble_model::joint::JointKind;
use tumble_robot::LinkFrame;
use tumble_robot::frame::conjugated;
use tumble_robot::joining::{Joined, drive, joined, sum_drive};
use tumble_robot::model::{MimicJoint, RobotTie};

impl Assembled {
    /// Adds one joint per link that moves in its parent. It represents all joints of that link.
    ///
    /// The joint's first frame is on the link's body, the second on the parent's body or in the
    /// world.
    pub(super) fn add_joints(&mut self, document: &mut Document) -> Result<(), String> {
        for place in 0..self.bodies.len() {
            let Carried { link, body, centre, .. } = self.bodies[place];
            let (first, count) = self.robot.links[link].joints;
            let Some(Joined { kind, anchor, attitudes, middle, axes }) =
                joined(self.robot.joints_of(link))?
            else {
                continue;
            };
            let anchor = anchor.unwrap_or(centre);
            let (other, frame) = self.links[self.robot.links[link].parent];
            let outer = frame.then(&self.robot.links[link].frame);
            let [attitude, mut of_above] = attitudes;
            // The parent frame of a free joint has the axes of the file's world. With a spring it
            // has the attitude of the link at the reference of the file.
            let flies = kind == JointKind::Free;
            if flies && self.robot.joints[first].stiffness == 0.0 {
                of_above = conjugated(&self.robot.links[link].frame.attitude);
            }
            let above = LinkFrame {
                position: outer.point(&anchor),
                attitude: outer.then(&turned(of_above)).attitude,
            };
            let (other, above) = match other {
                Some(other) => {
                    let Carried { body: other, centre, .. } = self.bodies[other];
                    (Some(other), LinkFrame { position: above.position - centre, ..above })
                }
                None => (None, self.world().then(&above)),
            };
            let joints = first..first + count;
            let drives = axes.iter().map(|axis| drive(&self.robot, first + axis, &self.controls));
            let names: Vec<_> =
                joints.map(|joint| self.robot.joints[joint].name.as_str()).collect();
            let name = match names[..] {
                [one] => self.named(one),
                _ => self.named(&self.robot.links[link].name),
            };
            if document.joint_names().any(|known| known == name) {
                return Err(format!(
                    "{}: the joint name {name:?} is already used; set a prefix",
                    self.robot.links[link].at
                ));
            }
            let index = document.joints.len();
            let counted = kind.driven().iter().zip(&axes).filter(|_| !kind.turns_freely());
            for ((_, axis), joint) in counted {
                self.axes[first + joint] = Some((index, *axis));
            }
            let drives = drives.collect::<Result<Vec<_>, _>>()?;
            let frames = [
                Place { position: (anchor - centre).into(), attitude: attitude.into() },
                place_of(&above),
            ];
            let bodies = names_of(document, body, other);
            let joint = JointEntry::made(name.clone(), kind, bodies, frames, &drives);
            let collide = flies.then_some(true);
            document.joints.push(JointEntry { collide, middle, ..joint });
            for ((axis, _), drive) in kind.driven().iter().zip(&drives) {
                let axis = (drives.len() > 1).then_some(*axis);
                let motor = drive.motor.as_ref();
                document.motors.extend(motor.map(|motor| MotorEntry::exact(&name, axis, motor)));
            }
        }
        Ok(())
    }

    /// Fixes the further bodies of each group of links to its first body. A group has one body for
    /// each set of contact rules.
    pub(super) fn add_parts(&self, document: &mut Document) {
        for Carried { link, body, parts, .. } in &self.bodies {
            for number in 1..parts.len() {
                let name = self.part_name(*link, number);
                let bodies = names_of(document, body + number, Some(*body));
                let frames = [Place::ORIGIN; 2];
                let joint = JointEntry::made(name, JointKind::Fixed, bodies, frames, &[]);
                document.joints.push(joint);
            }
        }
    }

    /// Adds a gear for each dependent joint and for each force on a combination of coordinates.
    ///
    /// A coordinate of the scene is a coordinate of the file minus its reference value. The offset
    /// of a gear changes accordingly.
    pub(super) fn add_gears(&mut self, document: &mut Document) -> Result<(), String> {
        let first = document.gears.len() + self.robot.follows.len();
        self.sums = first..first + self.robot.sums.len();
        let ties = self.robot.follows.iter().map(|follows| (follows, None));
        let sums = self.robot.sums.iter().enumerate().map(|(index, sum)| (&sum.of, Some(index)));
        for (of, sum) in ties.chain(sums) {
            let MimicJoint { joints, ratio, offset, at } = of;
            let [first, second] = joints.map(|joint| self.axes[joint]);
            let (Some(first), Some(second)) = (first, second) else {
                return Err(format!("{at}: one of its joints does not move a body"));
            };
            let [own, other] = joints.map(|joint| self.robot.joints[joint].reference);
            let drive =
                sum.map(|index| sum_drive(&self.robot, index, &self.controls)).transpose()?;
            let [first, second] = [first, second].map(|(joint, axis)| GearAxis::new(joint, axis));
            let gear = Gear::new(first, second, *ratio, offset - own + ratio * other);
            document.add_gear(&drive.map_or(gear, |drive| gear.with_drive(drive)));
        }
        Ok(())
    }

    /// Adds the constraints that close loops (`connect` and `weld` of MJCF), as joints.
    ///
    /// Their frames are computed with all coordinates at the reference of the file.
    pub(super) fn add_ties(&mut self, document: &mut Document) -> Result<(), String> {
        if self.robot.ties.is_empty() {
            return Ok(());
        }
        let rates = vec![0.0; self.robot.counts().1];
        let motion = self.robot.motion(&self.robot.reference(), &rates)?;
        let start = self.robot.motion(&self.coordinates, &rates)?;
        let mut moved = Vec::new();
        for (number, tie) in self.robot.ties.iter().enumerate() {
            let (kind, links, at) = match tie {
                RobotTie::Point { links, at, .. } => (JointKind::Spherical, links, at),
                RobotTie::Whole { links, at, .. } => (JointKind::Fixed, links, at),
            };
            let [first, second] = links.map(|link| motion.links()[link].frame);
            // Frame of the constraint, in the first link and in the second link.
            let (ours, theirs) = match tie {
                RobotTie::Point { anchor, .. } => {
                    let frame = LinkFrame { position: *anchor, ..second.relative_to(&first) };
                    (
                        frame,
                        LinkFrame {
                            position: first.then(&frame).relative_to(&second).position,
                            ..LinkFrame::identity()
                        },
                    )
                }
                RobotTie::Whole { frame, .. } => {
                    (frame.unwrap_or(second.relative_to(&first)), LinkFrame::identity())
                }
            };
            let sides = [(links[0], ours), (links[1], theirs)].map(|(link, frame)| {
                let (body, offset) = self.links[link];
                (body, offset.then(&frame))
            });
            let (mut a, mut b) = (sides[0], sides[1]);
            if a.0.is_none() {
                std::mem::swap(&mut a, &mut b);
            }
            let (Some(own), other) = (a.0, b.0) else {
                return Err(format!("{at}: neither of its bodies moves"));
            };
            if Some(own) == other {
                return Err(format!("{at}: both bodies are the same"));
            }
            // A `mocap` body is fixed in the scene. If a constraint to it is violated at the start,
            // the constraint holds the initial pose.
            let is_mocap = links.iter().any(|link| self.robot.links[*link].is_mocap);
            if is_mocap && other.is_none() {
                let link = self.bodies[own].link;
                let fits = start.links()[link].frame.then(&a.1);
                let there = self.world().then(&b.1);
                let off = (fits.position - there.position).norm();
                let turned = 2.0 * libm::acos(fits.attitude.dot(&there.attitude).abs().min(1.0));
                let is_whole = matches!(tie, RobotTie::Whole { .. });
                if off > JOINT_AT_THE_START || is_whole && turned > JOINT_AT_THE_START {
                    b.1 = fits.relative_to(self.world());
                    moved.push(format!(
                        "{at}: it keeps the initial pose, because the mocap body is {off:.1e} m \
                         from the pose that fits"
                    ));
                }
            }
            let from_centre = |place: usize, frame: LinkFrame| {
                let Carried { body, centre, .. } = self.bodies[place];
                (body, LinkFrame { position: frame.position - centre, ..frame })
            };
            let (body, ours) = from_centre(own, a.1);
            let (other, theirs) = match other {
                Some(other) => {
                    let (body, frame) = from_centre(other, b.1);
                    (Some(body), frame)
                }
                None => (None, self.world().then(&b.1)),
            };
            let name = self.named(&format!("tie-{number}"));
            let (bodies, frames) = (names_of(document, body, other), [ours, theirs]);
            let joint = JointEntry::made(name, kind, bodies, frames.each_ref().map(place_of), &[]);
            document.joints.push(JointEntry { collide: Some(true), ..joint });
        }
        self.robot.notes.extend(moved);
        Ok(())
    }

    /// Sets the collision flag of every joint of the robot, and removes redundant exclusions.
    pub(super) fn join_pairs(&self, placing: &Placing, document: &mut Document) {
        let touching = placing.touches_itself && self.robot.options.neighbours_touch;
        // An explicit pair of shapes lets their bodies collide. All shapes of a body have the same
        // contact rules.
        let name_of = |body: usize| document.bodies[body].name();
        let body_of = |shape: usize| {
            let Carried { body, parts, .. } =
                &self.bodies[self.links[self.robot.shapes[shape].link].0?];
            parts.iter().position(|part| part.contains(&shape)).map(|part| name_of(body + part))
        };
        let pairs = self.robot.pairs.keys();
        let paired: Vec<_> = pairs.map(|(a, b)| [body_of(*a), body_of(*b)]).collect();
        let own: BTreeSet<_> = self
            .bodies
            .iter()
            .flat_map(|one| (one.body..one.body + one.parts.len()).map(name_of))
            .collect();
        let collides = document.joints.iter().map(|joint| {
            let [first, second] = joint.ends();
            let ends = [first, second];
            let is_own = first.is_some_and(|first| own.contains(first));
            let may = touching || paired.contains(&ends) || paired.contains(&[second, first]);
            joint.collide == Some(true) || is_own && may
        });
        let collides: Vec<_> = collides.collect();
        for (joint, collides) in document.joints.iter_mut().zip(collides) {
            joint.collide = collides.then_some(true);
        }
        // A joint without collisions makes an exclusion redundant.
        let joints = document.joints.iter().filter(|joint| joint.collide.is_none());
        let tied: BTreeSet<_> = joints
            .flat_map(|joint| {
                let [first, second] = joint.ends();
                [(first, second), (second, first)]
            })
            .collect();
        let kept = document.apart.iter().filter(|ApartEntry { between }| {
            let [first, second] = between.0.each_ref().map(|name| Some(name.as_str()));
            !tied.contains(&(first, second))
        });
        document.apart = kept.cloned().collect();
    }
}

/// Names of the bodies of a joint.
fn names_of(document: &Document, body: usize, other: Option<usize>) -> Vec<String> {
    let bodies = [Some(body), other].into_iter().flatten();
    bodies.map(|body| document.bodies[body].name().to_owned()).collect()
}

/// Rotation without translation.
fn turned(attitude: Vector4<f64>) -> LinkFrame {
    LinkFrame { attitude, ..LinkFrame::identity() }
}
