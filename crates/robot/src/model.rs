//! What a robot's file says, whichever it is: links in a tree, joints, shapes, motors.

use super::frame::LinkFrame;
use nalgebra::{Matrix3, Vector3};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use tumble_core::joint::Drive;

/// A robot as its file has it. The world is link 0.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Robot {
    /// What it is called.
    pub name: String,
    /// Parents before their children; the first one is the world.
    pub links: Vec<RobotLink>,
    /// In the order of the links; of one link in the order in which they act, the first one on the parent.
    pub joints: Vec<RobotJoint>,
    /// What can touch, and what has mass.
    pub shapes: Vec<RobotShape>,
    /// What links look like; those that have none here look like their shapes.
    pub looks: Vec<RobotLook>,
    /// Frames on links that have names.
    pub sites: Vec<NamedSite>,
    /// What drives joints.
    pub actuators: Vec<Actuator>,
    /// What else holds links together.
    pub ties: Vec<RobotTie>,
    /// Which joints go with others.
    pub follows: Vec<MimicJoint>,
    /// What acts on sums of coordinates.
    pub sums: Vec<TieForces>,
    /// Pairs of links that do not touch each other.
    pub apart: Vec<[usize; 2]>,
    /// μ of pairs of shapes that touch whatever their groups and links say: indices, the smaller one first.
    pub pairs: BTreeMap<(usize, usize), f64>,
    /// Poses that have names.
    pub keys: Vec<Key>,
    /// What the file says of the simulation.
    pub options: RobotOptions,
    /// What stands in the file and has no meaning here, each in one sentence.
    pub notes: Vec<String>,
}

/// A link, called body in MJCF.
#[derive(Debug, Clone)]
pub struct RobotLink {
    /// What it is called.
    pub name: String,
    /// An index of the links before it; the world's is its own.
    pub parent: usize,
    /// In the parent, where all joints are at their reference; of the world, where the world of the file is.
    pub frame: LinkFrame,
    /// What it weighs, and where.
    pub mass: LinkMass,
    /// How much of its weight is held up by a force on its centre: 0 for none, 1 for all.
    pub weightless: f64,
    /// Whether a program is to move it, as `mocap` of MJCF: it stays where it is.
    pub is_mocap: bool,
    /// Whether it is none of the file's, but stands between two joints of the link below it, with hardly any mass.
    pub is_between: bool,
    /// Its joints: the first one, and how many.
    pub joints: (usize, usize),
    /// Where it stands in the file, for sentences.
    pub at: String,
}

/// A frame on a link, where something is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotSite {
    /// The number of the link, 0 being the world.
    pub link: usize,
    /// In the frame of the link.
    pub frame: LinkFrame,
}

/// A frame of which the file says a name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedSite {
    /// What it is called.
    pub name: String,
    /// Where it is.
    pub site: RobotSite,
}

/// Mass, centre and inertia of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkMass {
    /// kg.
    pub mass: f64,
    /// m, frame of the link.
    pub centre: Vector3<f64>,
    /// About the centre along the axes of the link, kg m².
    pub inertia: Matrix3<f64>,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moves {
    /// In any way.
    Free,
    /// Turns about its anchor in any way.
    Ball,
    /// Slides along its axis.
    Slide,
    /// Turns about its axis.
    Hinge,
}

impl Moves {
    /// How many coordinates it has, and how many rates.
    #[must_use]
    pub fn counts(self) -> (usize, usize) {
        match self {
            Self::Free => (7, 6),
            Self::Ball => (4, 3),
            Self::Slide | Self::Hinge => (1, 1),
        }
    }
}

/// A joint between a link and its parent.
#[derive(Debug, Clone)]
pub struct RobotJoint {
    /// What it is called.
    pub name: String,
    /// The link that it moves.
    pub link: usize,
    /// How.
    pub moves: Moves,
    /// m, frame of the link.
    pub anchor: Vector3<f64>,
    /// A unit vector, frame of the link.
    pub axis: Vector3<f64>,
    /// The coordinate where the link is as the file places it, m or rad.
    pub reference: f64,
    /// Of the coordinate.
    pub range: Option<[f64; 2]>,
    /// N s/m or N m s/rad.
    pub damping: f64,
    /// Dry friction, N or N m.
    pub friction: f64,
    /// kg or kg m².
    pub armature: f64,
    /// N/m or N m/rad.
    pub stiffness: f64,
    /// The coordinate at which the spring is slack.
    pub rest: f64,
    /// What all its motors together have, N or N m.
    pub effort: Option<[f64; 2]>,
    /// Where it stands in the file, for sentences.
    pub at: String,
}

impl RobotJoint {
    /// Whether anything acts on it by itself.
    #[must_use]
    pub fn resists(&self) -> bool {
        [self.damping, self.friction, self.armature, self.stiffness].iter().any(|one| *one != 0.0)
    }

    /// One without anything that acts on it.
    pub(crate) fn bare(name: String, link: usize, moves: Moves, at: String) -> Self {
        let (anchor, axis) = (Vector3::zeros(), Vector3::z());
        let (range, effort) = (None, None);
        let [reference, damping, friction, armature, stiffness, rest] = [0.0; 6];
        Self {
            name,
            link,
            moves,
            anchor,
            axis,
            reference,
            range,
            damping,
            friction,
            armature,
            stiffness,
            rest,
            effort,
            at,
        }
    }
}

/// What a shape is, m.
#[derive(Debug, Clone, PartialEq)]
pub enum RobotForm {
    /// Its radius.
    Sphere(f64),
    /// Along z: half of the length between the centres of its ends, and the radius.
    Capsule(f64, f64),
    /// Along z: half of its length, and the radius.
    Cylinder(f64, f64),
    /// Half of its sides.
    Box(Vector3<f64>),
    /// Half of its axes.
    Ellipsoid(Vector3<f64>),
    /// Everything below z = 0.
    Plane,
    /// The convex hull of the vertices of a mesh.
    Hull(Vec<[f64; 3]>),
}

/// Triangles for the eye, counter-clockwise seen from outside.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// m.
    pub vertices: Vec<[f64; 3]>,
    /// Indices of vertices.
    pub triangles: Vec<[usize; 3]>,
    /// Triangles of the file: more than there are here where the mesh is drawn coarser.
    pub total: usize,
}

/// What a [`RobotLook`] is.
#[derive(Debug, Clone)]
pub enum LookForm {
    /// As a shape.
    Form(RobotForm),
    /// A mesh, which may be open and need not be convex.
    Mesh(Surface),
}

/// What a link looks like where that is not what it touches with.
#[derive(Debug, Clone)]
pub struct RobotLook {
    /// Whose it is.
    pub link: usize,
    /// What it is.
    pub seen: LookForm,
    /// Where it is in the link.
    pub frame: LinkFrame,
}

impl RobotLook {
    /// How many triangles its mesh has; 0 without one.
    #[must_use]
    pub fn triangles(&self) -> usize {
        match &self.seen {
            LookForm::Form(_) => 0,
            LookForm::Mesh(surface) => surface.triangles.len(),
        }
    }
}

/// A shape of a link.
#[derive(Debug, Clone)]
pub struct RobotShape {
    /// What it is called.
    pub name: String,
    /// Whose it is.
    pub link: usize,
    /// What it is.
    pub form: RobotForm,
    /// Where it is in the link.
    pub frame: LinkFrame,
    /// Two shapes touch if a bit of the first of one is in the second of the other.
    pub groups: [u32; 2],
    /// μ; `None` for the world's.
    pub friction: Option<f64>,
    /// Whether friction acts in its contacts.
    pub rubs: bool,
    /// Of two shapes, the friction of the one with the higher priority counts.
    pub priority: i64,
    /// Where it stands in the file, for sentences.
    pub at: String,
}

impl RobotShape {
    /// Whether it and another one touch, by their groups.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        self.groups[0] & other.groups[1] != 0 || other.groups[0] & self.groups[1] != 0
    }

    /// The coefficient between two shapes of a file: that of the one that counts more, or else the larger one; `usual` of what
    /// has none.
    #[must_use]
    pub fn friction_with(&self, other: &Self, usual: f64) -> f64 {
        if !(self.rubs || other.rubs) {
            return 0.0;
        }
        let [ours, theirs] = [self, other].map(|shape| shape.friction.unwrap_or(usual));
        match self.priority.cmp(&other.priority) {
            Ordering::Greater => ours,
            Ordering::Less => theirs,
            Ordering::Equal => ours.max(theirs),
        }
    }
}

/// A motor: a force on the axes of joints
///
/// ```text
/// f = gear clamp(gain u + b₀ + b₁ gear x + b₂ gear ẋ)
/// ```
///
/// of its control u, the coordinate x and its rate.
#[derive(Debug, Clone)]
pub struct Actuator {
    /// What it is called.
    pub name: String,
    /// Indices of joints, hinges or slides, and what the gear is multiplied with for each: one and 1, or those of a tendon.
    pub joints: Vec<(usize, f64)>,
    /// Of a tendon of two joints, on which the force depends, the index of its sum, and the tendon's length over that; its
    /// coordinate x is the length.
    pub sum: Option<(usize, f64)>,
    /// What the force and the coordinate are multiplied with.
    pub gear: f64,
    /// What the control is multiplied with.
    pub gain: f64,
    /// b₀, b₁, b₂.
    pub bias: [f64; 3],
    /// Of the control.
    pub control_range: Option<[f64; 2]>,
    /// Of the force before the gear.
    pub force_range: Option<[f64; 2]>,
    /// Where it stands in the file, for sentences.
    pub at: String,
}

/// What holds two links together besides the tree.
#[derive(Debug, Clone)]
pub enum RobotTie {
    /// A point of both stays one.
    Point {
        /// The links.
        links: [usize; 2],
        /// m, frame of the first.
        anchor: Vector3<f64>,
        /// Where it stands in the file.
        at: String,
    },
    /// The second stays where it is in the first.
    Whole {
        /// The links.
        links: [usize; 2],
        /// The second in the first; `None` for where it is at the reference.
        frame: Option<LinkFrame>,
        /// Where it stands in the file.
        at: String,
    },
}

/// A hinge or a slide that goes with one other, by a gear: its coordinate is
///
/// ```text
/// q₁ = r q₂ + q₀
/// ```
#[derive(Debug, Clone)]
pub struct MimicJoint {
    /// The one that goes with the other, and the other: indices of joints.
    pub joints: [usize; 2],
    /// r.
    pub ratio: f64,
    /// q₀, m or rad.
    pub offset: f64,
    /// Where it stands in the file.
    pub at: String,
}

/// What acts on `q₁ − r q₂ − q₀` in place of a tie, in the units of the first coordinate, besides actuators.
#[derive(Debug, Clone)]
pub struct TieForces {
    /// The two coordinates, r and q₀.
    pub of: MimicJoint,
    /// What acts.
    pub drive: Drive,
}

/// A pose with a name.
#[derive(Debug, Clone)]
pub struct Key {
    /// What it is called.
    pub name: String,
    /// Coordinates of all joints.
    pub positions: Option<Vec<f64>>,
    /// Rates of all joints.
    pub rates: Option<Vec<f64>>,
    /// Of all actuators.
    pub controls: Option<Vec<f64>>,
}

/// What a file says of the simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotOptions {
    /// h, s.
    pub time_step: f64,
    /// m/s².
    pub gravity: Vector3<f64>,
    /// Whether anything touches.
    pub contacts: bool,
    /// Whether links touch those that they are jointed to.
    pub neighbours_touch: bool,
    /// Whether the file has a world of its own, as MJCF: a ground, a gravity, and what is fixed.
    pub has_world: bool,
}

impl Robot {
    /// The joints of a link.
    #[must_use]
    pub fn joints_of(&self, link: usize) -> &[RobotJoint] {
        let (first, count) = self.links[link].joints;
        &self.joints[first..first + count]
    }

    /// How many coordinates and how many rates there are.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let add = |(q, v): (usize, usize), joint: &RobotJoint| {
            let (more, rates) = joint.moves.counts();
            (q + more, v + rates)
        };
        self.joints.iter().fold((0, 0), add)
    }

    /// The link of a name.
    #[must_use]
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// The site of a name.
    #[must_use]
    pub fn site(&self, name: &str) -> Option<&RobotSite> {
        self.sites.iter().find(|named| named.name == name).map(|named| &named.site)
    }

    /// The joint of a name.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Whether a shape can touch anything.
    #[must_use]
    pub fn touches(&self, shape: usize) -> bool {
        let groups = self.shapes.get(shape).is_some_and(|shape| shape.groups != [0, 0]);
        groups || self.pairs.keys().any(|(a, b)| [a, b].contains(&&shape))
    }

    /// μ of two shapes that touch by what is said of both together.
    #[must_use]
    pub fn pair(&self, a: usize, b: usize) -> Option<f64> {
        self.pairs.get(&(a.min(b), a.max(b))).copied()
    }

    /// The link that each link moves with: the first one above it that has a joint, or the world.
    #[must_use]
    pub fn carriers(&self) -> Vec<usize> {
        let mut carriers = Vec::with_capacity(self.links.len());
        for (index, link) in self.links.iter().enumerate() {
            let moves = index == 0 || link.joints.1 > 0;
            carriers.push(if moves { index } else { carriers[link.parent] });
        }
        carriers
    }
}
