//! Tables `[[robots]]` as deserialised.

use crate::bodies::entries::AttitudeEntry;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use tumble_model::fields::Numbers;
use tumble_robot::MeshPieces;

#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "a table [[robots]]")]
pub struct RobotEntry {
    /// File in URDF, SDF or MJCF.
    pub file: String,
    /// Prefix of the names of links and joints.
    pub prefix: Option<String>,
    /// Position of the file's world, or of the root link of a URDF (m).
    pub position: Option<Numbers<3>>,
    /// Its attitude.
    pub attitude: Option<AttitudeEntry>,
    /// Name of a keyframe at the start.
    pub pose: Option<String>,
    /// Initial coordinates of joints by name (m or rad).
    pub coordinates: Option<BTreeMap<String, f64>>,
    /// False if links of the robot do not touch each other.
    pub self_collision: Option<bool>,
    /// False if links that are fixed to each other stay separate.
    pub merge_fixed: Option<bool>,
    /// True if the root link is fixed to the world.
    pub fixed: Option<bool>,
    /// Number of sides of the prisms that other bodies touch instead of cylinders.
    pub sides: Option<usize>,
    /// Folder of `package://` and `model://`.
    pub packages: Option<String>,
    /// Convex pieces of meshes by the name of the mesh.
    pub meshes: Option<MeshPieces>,
    /// Parts of the file to ignore.
    pub leave_out: Option<Vec<String>>,
    /// True if contacts of an MJCF file have sliding friction only.
    pub point_contacts: Option<bool>,
    /// Collision groups of all its links.
    pub groups: Option<Vec<String>>,
    /// Groups that its links collide with.
    pub collides_with: Option<Vec<String>>,
}
