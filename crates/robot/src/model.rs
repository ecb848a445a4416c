//! Format-independent description of a robot: tree of links, joints, shapes and motors.

use super::frame::LinkFrame;
use nalgebra::{Matrix3, Vector3};
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble_core::geometry::terrain::HeightField;
use tumble_core::joint::Drive;

/// A robot as described by its URDF, SDF or MJCF file. The world is link 0.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Robot {
    /// Name of the robot.
    pub name: String,
    /// Links, parents before children. The first is the world.
    pub links: Vec<RobotLink>,
    /// Joints in the order of the links. Joints of one link are in the order in which they act, the
    /// one next to the parent first.
    pub joints: Vec<RobotJoint>,
    /// Geometry that collides or contributes mass.
    pub shapes: Vec<RobotShape>,
    /// Visual geometry. A link without an entry is drawn with its collision shapes.
    pub looks: Vec<RobotLook>,
    /// Named frames on links.
    pub sites: Vec<NamedSite>,
    /// Motors of the joints.
    pub actuators: Vec<Actuator>,
    /// Constraints between links beyond the tree of joints.
    pub ties: Vec<RobotTie>,
    /// Joints whose coordinate is coupled to that of another joint.
    pub follows: Vec<MimicJoint>,
    /// Springs, dampers and friction on linear combinations of two coordinates.
    pub sums: Vec<TieForces>,
    /// Pairs of links that never collide.
    pub apart: Vec<[usize; 2]>,
    /// Friction coefficient μ of explicit contact pairs, which collide whatever their groups and
    /// links. The key holds the two shape indices, the smaller first.
    pub pairs: BTreeMap<(usize, usize), PairFriction>,
    /// Named poses (keyframes).
    pub keys: Vec<Key>,
    /// Simulation options of the file.
    pub options: RobotOptions,
    /// Content of the file that has no effect, one sentence per item.
    pub notes: Vec<String>,
}

impl Robot {
    /// Robot with the link of the world only.
    pub(super) fn new(name: &str, options: RobotOptions) -> Self {
        let world = RobotLink {
            name: "world".to_owned(),
            parent: 0,
            frame: LinkFrame::identity(),
            mass: LinkMass::NONE,
            weightless: 0.0,
            is_mocap: false,
            is_between: false,
            joints: (0, 0),
            at: "the world".to_owned(),
        };
        Self {
            name: name.to_owned(),
            links: vec![world],
            joints: Vec::new(),
            shapes: Vec::new(),
            looks: Vec::new(),
            sites: Vec::new(),
            actuators: Vec::new(),
            ties: Vec::new(),
            follows: Vec::new(),
            sums: Vec::new(),
            apart: Vec::new(),
            pairs: BTreeMap::new(),
            keys: Vec::new(),
            options,
            notes: Vec::new(),
        }
    }
}

/// A link (`body` in MJCF).
#[derive(Debug, Clone)]
pub struct RobotLink {
    /// Name of the link.
    pub name: String,
    /// Index of the parent, smaller than the link's own. The world is its own parent.
    pub parent: usize,
    /// Pose in the parent's frame with all joints at their reference. For the world: pose of the
    /// file's world.
    pub frame: LinkFrame,
    /// Mass, centre of mass and inertia.
    pub mass: LinkMass,
    /// Fraction of the weight that a force at the centre of mass compensates, from 0 (none) to 1
    /// (all).
    pub weightless: f64,
    /// True for a `mocap` body of MJCF. It stays in place unless a program moves it.
    pub is_mocap: bool,
    /// True for an auxiliary link of tiny mass between two joints of the link below it. The file
    /// does not contain it.
    pub is_between: bool,
    /// Index of its first joint, and number of its joints.
    pub joints: (usize, usize),
    /// Position in the file, for messages.
    pub at: String,
}

/// A measurement frame on a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotSite {
    /// Index of the link. 0 is the world.
    pub link: usize,
    /// Pose in the frame of the link.
    pub frame: LinkFrame,
}

/// A frame with a name in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedSite {
    /// Name of the frame.
    pub name: String,
    /// Link and pose of the frame.
    pub site: RobotSite,
}

/// Mass, centre of mass and inertia of a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkMass {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass (m), in the frame of the link.
    pub centre: Vector3<f64>,
    /// Inertia about the centre of mass along the axes of the link (kg m²).
    pub inertia: Matrix3<f64>,
}

/// Type of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moves {
    /// Six degrees of freedom.
    Free,
    /// Three rotations about its anchor.
    Ball,
    /// Translation along its axis.
    Slide,
    /// Rotation about its axis.
    Hinge,
}

impl Moves {
    /// Number of coordinates and number of rates.
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
    /// Name of the joint.
    pub name: String,
    /// Index of the link that it moves.
    pub link: usize,
    /// Type of the joint.
    pub moves: Moves,
    /// Anchor (m), in the frame of the link.
    pub anchor: Vector3<f64>,
    /// Unit vector of the axis, in the frame of the link.
    pub axis: Vector3<f64>,
    /// Coordinate at which the link has its pose of the file (m or rad).
    pub reference: f64,
    /// Limits of the coordinate (m or rad).
    pub range: Option<[f64; 2]>,
    /// Viscous damping (N s/m or N m s/rad).
    pub damping: f64,
    /// Dry friction (N or N m).
    pub friction: f64,
    /// Armature (kg or kg m²).
    pub armature: f64,
    /// Spring stiffness (N/m or N m/rad).
    pub stiffness: f64,
    /// Coordinate at which the spring is relaxed (m or rad).
    pub rest: f64,
    /// Limits of the total force of all its motors (N or N m).
    pub effort: Option<[f64; 2]>,
    /// Position in the file, for messages.
    pub at: String,
}

impl RobotJoint {
    /// True if the joint has damping, friction, armature or stiffness.
    pub fn resists(&self) -> bool {
        [self.damping, self.friction, self.armature, self.stiffness].iter().any(|one| *one != 0.0)
    }

    /// A joint without limits, damping, friction, armature or spring.
    pub(crate) fn bare(name: String, link: usize, moves: Moves, at: String) -> Self {
        Self {
            name,
            link,
            moves,
            anchor: Vector3::zeros(),
            axis: Vector3::z(),
            reference: 0.0,
            range: None,
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            stiffness: 0.0,
            rest: 0.0,
            effort: None,
            at,
        }
    }
}

/// Geometry of a shape, lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum RobotForm {
    /// Radius.
    Sphere(f64),
    /// Half the distance between the centres of its ends, and radius. The axis is z.
    Capsule(f64, f64),
    /// Half length and radius. The axis is z.
    Cylinder(f64, f64),
    /// Half height and radius of the base. The axis is z, and the apex is above.
    Cone(f64, f64),
    /// Half extents.
    Box(Vector3<f64>),
    /// Half axes.
    Ellipsoid(Vector3<f64>),
    /// The half space z ≤ 0.
    Plane,
    /// Convex hull of the vertices of a mesh.
    Hull(Vec<[f64; 3]>),
    /// Height field. Only the world can have one.
    Field(Arc<HeightField>),
}

/// Triangle mesh for drawing. Triangles are counter-clockwise seen from outside.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Vertices (m).
    pub vertices: Vec<[f64; 3]>,
    /// Vertex indices of the triangles.
    pub triangles: Vec<[usize; 3]>,
    /// Number of triangles in the file. It exceeds the length of `triangles` if the mesh was
    /// simplified.
    pub total: usize,
}

/// Geometry of a [`RobotLook`].
#[derive(Debug, Clone)]
pub enum LookForm {
    /// A primitive shape or a convex hull.
    Form(RobotForm),
    /// A mesh, which may be open and non-convex.
    Mesh(Surface),
}

/// Visual geometry of a link, distinct from its collision geometry.
#[derive(Debug, Clone)]
pub struct RobotLook {
    /// Index of the link.
    pub link: usize,
    /// Geometry.
    pub seen: LookForm,
    /// Red, green and blue of the file. `None` if it names none.
    pub colour: Option<[u8; 3]>,
    /// Pose in the frame of the link.
    pub frame: LinkFrame,
}

impl RobotLook {
    /// Number of triangles of its mesh; 0 for other geometry.
    pub fn triangles(&self) -> usize {
        match &self.seen {
            LookForm::Form(_) => 0,
            LookForm::Mesh(surface) => surface.triangles.len(),
        }
    }
}

/// Collision geometry of a link.
#[derive(Debug, Clone)]
pub struct RobotShape {
    /// Name of the shape in the file, if it has one.
    pub name: Option<String>,
    /// Index of the link.
    pub link: usize,
    /// Geometry.
    pub form: RobotForm,
    /// Pose in the frame of the link.
    pub frame: LinkFrame,
    /// Collision bit masks (`contype` and `conaffinity` of MJCF). Two shapes collide if the first
    /// mask of either shares a bit with the second mask of the other.
    pub groups: [u32; 2],
    /// Friction coefficient μ. `None` selects the default of the world.
    pub friction: Option<f64>,
    /// Coefficients of torsional and rolling friction (m).
    pub turning: [f64; 2],
    /// Directions that its contacts resist (`condim` of MJCF): 1 without friction, 3 with sliding friction,
    /// 4 with torsional, 6 with rolling friction too.
    pub condim: i64,
    /// Priority of its friction over that of the other shape of a contact.
    pub priority: i64,
    /// Position in the file, for messages.
    pub at: String,
}

impl RobotShape {
    /// True if the groups of both shapes let them collide.
    pub fn meets(&self, other: &Self) -> bool {
        self.groups[0] & other.groups[1] != 0 || other.groups[0] & self.groups[1] != 0
    }

    /// Friction between two shapes: that of the shape with the higher priority, or the larger
    /// coefficients and directions at equal priority. `usual` replaces a missing coefficient.
    pub fn friction_with(&self, other: &Self, usual: f64) -> PairFriction {
        let [ours, theirs] = [self, other].map(|shape| {
            let [torsional, rolling] = shape.turning;
            (shape.condim, [shape.friction.unwrap_or(usual), torsional, rolling])
        });
        let (condim, all) = match self.priority.cmp(&other.priority) {
            Ordering::Greater => ours,
            Ordering::Less => theirs,
            Ordering::Equal => {
                let larger = std::array::from_fn(|k| f64::max(ours.1[k], theirs.1[k]));
                (ours.0.max(theirs.0), larger)
            }
        };
        PairFriction::new(condim, all)
    }

    /// Friction of this shape alone.
    pub fn own_friction(&self, usual: f64) -> PairFriction {
        self.friction_with(self, usual)
    }
}

/// Coefficients of the contacts of two shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairFriction {
    /// Sliding friction μ.
    pub sliding: f64,
    /// Torsional friction (m).
    pub torsional: f64,
    /// Rolling friction (m).
    pub rolling: f64,
}

impl PairFriction {
    /// Coefficients of sliding, torsional and rolling friction that act in contacts with `condim` directions.
    pub fn new(condim: i64, [sliding, torsional, rolling]: [f64; 3]) -> Self {
        let with = |least: i64, friction: f64| if condim >= least { friction } else { 0.0 };
        Self { sliding: with(3, sliding), torsional: with(4, torsional), rolling: with(6, rolling) }
    }
}

/// A motor. Its force on the axes of its joints is
///
/// ```text
/// f = gear clamp(gain u + b₀ + b₁ gear x + b₂ gear ẋ)
/// ```
///
/// with control u, coordinate x and rate ẋ.
#[derive(Debug, Clone)]
pub struct Actuator {
    /// Name of the motor.
    pub name: String,
    /// Indices of the joints (hinges or slides), each with a factor of the gear. The factor is 1
    /// for a motor on one joint and the tendon's coefficient for a motor on a tendon.
    pub joints: Vec<(usize, f64)>,
    /// Index into [`Robot::sums`], and ratio of the tendon's length to that sum. It is set if the
    /// force depends on the length of a tendon of two joints. The coordinate x is then that length.
    pub sum: Option<(usize, f64)>,
    /// Factor of both the force and the coordinate.
    pub gear: f64,
    /// Factor of the control.
    pub gain: f64,
    /// Coefficients b₀, b₁, b₂.
    pub bias: [f64; 3],
    /// Limits of the control.
    pub control_range: Option<[f64; 2]>,
    /// Limits of the force before the gear.
    pub force_range: Option<[f64; 2]>,
    /// Position in the file, for messages.
    pub at: String,
}

/// A constraint between two links beyond the tree of joints.
#[derive(Debug, Clone)]
pub enum RobotTie {
    /// A common point of both links.
    Point {
        /// Indices of the links.
        links: [usize; 2],
        /// Common point (m), in the frame of the first link.
        anchor: Vector3<f64>,
        /// Position in the file.
        at: String,
    },
    /// A fixed pose of the second link in the first.
    Whole {
        /// Indices of the links.
        links: [usize; 2],
        /// Pose of the second link in the first. `None` selects the pose at the reference.
        frame: Option<LinkFrame>,
        /// Position in the file.
        at: String,
    },
}

/// A hinge or slide whose coordinate is coupled to that of another joint by
///
/// ```text
/// q₁ = r q₂ + q₀
/// ```
#[derive(Debug, Clone)]
pub struct MimicJoint {
    /// Indices of the dependent joint and of the joint that it depends on.
    pub joints: [usize; 2],
    /// Ratio r.
    pub ratio: f64,
    /// Offset q₀ (m or rad).
    pub offset: f64,
    /// Position in the file.
    pub at: String,
}

/// Spring, damper and friction on `q₁ − r q₂ − q₀`, in the units of q₁. They act beside the
/// actuators and replace a rigid coupling.
#[derive(Debug, Clone)]
pub struct TieForces {
    /// Coordinates, r and q₀ of the combination.
    pub of: MimicJoint,
    /// Drive that acts on the combination.
    pub drive: Drive,
}

/// A named pose.
#[derive(Debug, Clone)]
pub struct Key {
    /// Name of the pose.
    pub name: String,
    /// Coordinates of all joints.
    pub positions: Option<Vec<f64>>,
    /// Rates of all joints.
    pub rates: Option<Vec<f64>>,
    /// Controls of all actuators.
    pub controls: Option<Vec<f64>>,
}

/// Simulation options of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotOptions {
    /// Time step h (s).
    pub time_step: f64,
    /// Gravity (m/s²).
    pub gravity: Vector3<f64>,
    /// True if contacts are enabled.
    pub contacts: bool,
    /// True if a link collides with the link that it is jointed to.
    pub neighbours_touch: bool,
    /// True if the format describes a world with ground, gravity and fixed bodies, as MJCF does.
    pub has_world: bool,
}

impl RobotOptions {
    /// Options of a file that gives none.
    pub(crate) fn usual(has_world: bool) -> Self {
        let gravity = Vector3::new(0.0, 0.0, -9.81);
        Self { time_step: 0.002, gravity, contacts: true, neighbours_touch: false, has_world }
    }
}

impl Robot {
    /// Joints of a link.
    pub fn joints_of(&self, link: usize) -> &[RobotJoint] {
        let (first, count) = self.links[link].joints;
        &self.joints[first..first + count]
    }

    /// Number of coordinates and number of rates.
    pub fn counts(&self) -> (usize, usize) {
        let add = |(q, v): (usize, usize), joint: &RobotJoint| {
            let (more, rates) = joint.moves.counts();
            (q + more, v + rates)
        };
        self.joints.iter().fold((0, 0), add)
    }

    /// Index of the link with this name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// The site with this name.
    pub fn site(&self, name: &str) -> Option<&RobotSite> {
        self.sites.iter().find(|named| named.name == name).map(|named| &named.site)
    }

    /// Index of the joint with this name.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// True if the shape can collide with anything.
    pub fn touches(&self, shape: usize) -> bool {
        let groups = self.shapes.get(shape).is_some_and(|shape| shape.groups != [0, 0]);
        groups || self.pairs.keys().any(|(a, b)| [a, b].contains(&&shape))
    }

    /// Friction of an explicit contact pair.
    pub fn pair(&self, a: usize, b: usize) -> Option<PairFriction> {
        self.pairs.get(&(a.min(b), a.max(b))).copied()
    }

    /// Carrier of each link: the nearest link with a joint, from the link itself up to the world.
    pub fn carriers(&self) -> Vec<usize> {
        let mut carriers = Vec::with_capacity(self.links.len());
        for (index, link) in self.links.iter().enumerate() {
            let moves = index == 0 || link.joints.1 > 0;
            carriers.push(if moves { index } else { carriers[link.parent] });
        }
        carriers
    }
}
