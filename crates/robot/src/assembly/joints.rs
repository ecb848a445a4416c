//! Joints, gears and constraints between the bodies of a robot.
//!
//! A *link* belongs to the robot file, a *body* to the scene. One body can carry several links that
//! are rigidly connected. Joint frames of the scene are relative to the centres of mass.

use super::{Assembled, Carried, Placing, place_of};
use crate::frame::{LinkFrame, conjugated};
use crate::joining::{Joined, drive, joined, sum_drive};
use crate::model::{MimicJoint, RobotTie};
use nalgebra::Vector4;
use tumble_core::joint::{Drive, Gear, GearAxis};
use tumble_core::simulation::JOINT_AT_THE_START;
use tumble_model::joint::{JointKind, JointModel};
use tumble_model::shape::ModelPlace;
use tumble_model::{ApartModel, Model, PartnerModel};

impl Assembled {
    /// Adds one joint per link that moves in its parent. It represents all joints of that link.
    ///
    /// The joint's first frame is on the link's body, the second on the parent's body or in the
    /// world.
    pub(super) fn add_joints(&mut self, model: &mut Model) -> Result<(), String> {
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
            if model.joints.iter().any(|known| known.name == name) {
                return Err(format!(
                    "{}: the joint name {name:?} is already used; set a prefix",
                    self.robot.links[link].at
                ));
            }
            let index = model.joints.len();
            let counted = kind.driven().iter().zip(&axes).filter(|_| !kind.turns_freely());
            for ((_, axis), joint) in counted {
                self.axes[first + joint] = Some((index, *axis));
            }
            let drives = drives.collect::<Result<_, _>>()?;
            model.joints.push(JointModel {
                name,
                kind,
                body,
                other,
                frames: [
                    ModelPlace { position: (anchor - centre).into(), attitude: attitude.into() },
                    place_of(&above),
                ],
                length: None,
                collide: flies,
                cone: None,
                middle,
                drives,
                course: None,
            });
        }
        Ok(())
    }

    /// Fixes the further bodies of each group of links to its first body. A group has one body for
    /// each set of contact rules.
    pub(super) fn add_parts(&self, model: &mut Model) {
        for Carried { link, body, parts, .. } in &self.bodies {
            for number in 1..parts.len() {
                model.joints.push(JointModel {
                    name: self.part_name(*link, number),
                    kind: JointKind::Fixed,
                    body: body + number,
                    other: Some(*body),
                    frames: [ModelPlace::ORIGIN; 2],
                    length: None,
                    collide: false,
                    cone: None,
                    middle: None,
                    drives: Vec::new(),
                    course: None,
                });
            }
        }
    }

    /// Adds a gear for each dependent joint and for each force on a combination of coordinates.
    ///
    /// A coordinate of the scene is a coordinate of the file minus its reference value. The offset
    /// of a gear changes accordingly.
    pub(super) fn add_gears(&mut self, model: &mut Model) -> Result<(), String> {
        let first = model.gears.len() + self.robot.follows.len();
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
            model.gears.push(drive.map_or(gear, |drive| gear.with_drive(drive)));
        }
        Ok(())
    }

    /// Adds the constraints that close loops (`connect` and `weld` of MJCF), as joints.
    ///
    /// Their frames are computed with all coordinates at the reference of the file.
    pub(super) fn add_ties(&mut self, model: &mut Model) -> Result<(), String> {
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
            model.joints.push(JointModel {
                name: self.named(&format!("tie-{number}")),
                kind,
                body,
                other,
                frames: [place_of(&ours), place_of(&theirs)],
                length: None,
                collide: true,
                cone: None,
                middle: None,
                drives: vec![Drive::NONE; kind.driven().len()],
                course: None,
            });
        }
        self.robot.notes.extend(moved);
        Ok(())
    }

    /// Sets the collision flag of every joint of the robot, and removes redundant exclusions.
    pub(super) fn join_pairs(&self, placing: &Placing, model: &mut Model) {
        let touching = placing.touches_itself && self.robot.options.neighbours_touch;
        // An explicit pair of shapes lets their bodies collide. All shapes of a body have the same
        // contact rules.
        let body_of = |shape: usize| {
            let Carried { body, parts, .. } =
                &self.bodies[self.links[self.robot.shapes[shape].link].0?];
            parts.iter().position(|part| part.contains(&shape)).map(|part| body + part)
        };
        let paired: Vec<_> =
            self.robot.pairs.keys().map(|(a, b)| [body_of(*a), body_of(*b)]).collect();
        for joint in model.joints.iter_mut().filter(|joint| self.has_body(joint.body)) {
            let ends = [Some(joint.body), joint.other];
            joint.collide |=
                touching || paired.contains(&ends) || paired.contains(&[ends[1], ends[0]]);
        }
        // A joint without collisions makes an exclusion redundant.
        let tied = |pair: &ApartModel| {
            let PartnerModel::Body(other) = pair.partner else { return false };
            model.joints.iter().any(|joint| {
                let ends = [Some(joint.body), joint.other];
                !joint.collide && ends.contains(&Some(pair.body)) && ends.contains(&Some(other))
            })
        };
        let kept: Vec<_> = model.apart.iter().filter(|pair| !tied(pair)).cloned().collect();
        model.apart = kept;
    }
}

/// Rotation without translation.
fn turned(attitude: Vector4<f64>) -> LinkFrame {
    LinkFrame { attitude, ..LinkFrame::identity() }
}
