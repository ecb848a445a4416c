//! Tables of a scenario file.

use super::driven::{DrivenEntry, SurfaceEntry};
use super::entries::{ApartEntry, BodyEntry, FixedEntry, PairEntry};
use super::gears::GearEntry;
use super::joints::{JointEntry, MotorEntry};
use super::robots::RobotEntry;
use super::terrain::TerrainEntry;
use tumble_core::world::Coefficient;

/// Tables of a scenario file, as deserialised.
#[derive(Default)]
pub struct SceneEntries {
    /// Place of the only body in error messages, if it is not `bodies[0]`.
    pub at: &'static str,
    /// Entries of `[[bodies]]`.
    pub bodies: Vec<BodyEntry>,
    /// Entries of `[[fixed]]`: static geometry.
    pub fixed: Vec<FixedEntry>,
    /// Entries of `[[terrain]]`: height fields and surfaces of triangles.
    pub terrain: Vec<TerrainEntry>,
    /// Entries of `[[friction]]`: coefficients of single pairs.
    pub friction: Vec<PairEntry>,
    /// Entries of `[[static_friction]]` and the other laws: coefficients of single pairs.
    pub coefficients: [Vec<PairEntry>; Coefficient::ALL.len()],
    /// Entries of `[[restitution]]`: coefficients of single pairs.
    pub restitution: Vec<PairEntry>,
    /// Entries of `[[joints]]`.
    pub joints: Vec<JointEntry>,
    /// Entries of `[[motors]]`, each on an axis of a joint.
    pub motors: Vec<MotorEntry>,
    /// Entries of `[[gears]]`.
    pub gears: Vec<GearEntry>,
    /// Entries of `[[driven]]`: bodies with a prescribed motion.
    pub driven: Vec<DrivenEntry>,
    /// Entries of `[[surfaces]]`: conveyor belts.
    pub surfaces: Vec<SurfaceEntry>,
    /// Entries of `[[apart]]`: pairs that do not collide.
    pub apart: Vec<ApartEntry>,
    /// Entries of `[[robots]]`: URDF, SDF and MJCF files.
    pub robots: Vec<RobotEntry>,
}
