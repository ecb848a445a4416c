//! A run of any number of bodies as three tables, in and out of any streams: `states`, `contacts`
//! and `steps`, each in CSV with one header line; and where joints tie bodies, a fourth: `joints`,
//! and where gears tie joints, a fifth: `gears`.
//!
//! - `states`: one row a body and step: `k,t_s,body`, then the 13 numbers of the state at step k.
//!   `body` is the index in [`World::bodies`](tumble_core::world::World::bodies).
//! - `contacts`: one row a candidate contact of the step k → k+1: who touches whom, where (the
//!   touching point at k, m, world), across which normal (unit, world, at k, away from the
//!   partner), the force on `body` (N, world; the opposite one acts on the partner), the mean slip
//!   over the step (m/s, world), the gap at k (m), the radius by which the point is rounded (m), how
//!   fast the contact must part where it bounces (m/s, eq. 29), and the key that the contact keeps from step to step ([`KeyText`]).
//! - `steps`: one row a step: how it ended, its residual with the five parts, how deep pieces
//!   overlap at k+1, the smallest part of the restitution that an island took, and the
//!   [energy](tumble_core::simulation::energy) at k: kinetic, and potential in gravity from the world's origin; and where there are
//!   joints their [stiffness](tumble_core::simulation::StepRecord::stiffness), h ω.
//!
//! - `joints`: one row a joint and step: `k,t_s,joint`, `joint` being the index in
//!   [`World::joints`](tumble_core::world::World::joints); its coordinates at step k, the place of A's anchor along
//!   the axes of B's frame and the [turns](tumble_core::joint::Joint::turns) about them, the angle of a hinge with
//!   all its turns; their mean rates over the step k → k+1; the [force and torque](tumble_core::joint::JointForce)
//!   on A; and the two parts of the residual that are the joint's own. A frame in the world that moves is where it is
//!   when the step ends: the coordinates at k are what is left of its way.
//! - `gears`: one row a gear and step: `k,t_s,gear`, the index in
//!   [`World::gears`](tumble_core::world::World::gears); its two coordinates at step k, m or rad with all turns; its force over the step
//!   along the first one, N or N m; and its part of the residual.
//! - `ends`, of a run that does not keep every step: as `states`, with the states at step k+1, where the step k of the same
//!   row ended, so that each step that is kept can be judged by itself.
//!
//! All rows are in the order of k; states within a step in that of the bodies, contacts in that of
//! the solution. The last step is a state alone, of status `end`. Numbers have the fewest digits
//! that read back to the same double.

mod key;
mod named;
mod read;
mod rebuild;
mod write;

pub use key::KeyText;
pub use named::Misplaced;
pub use read::{ContactRow, GearTableRow, JointRow, StepRow, TableStep, TablesReader};
pub use write::TablesWriter;

use std::fmt;

/// One of the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Table {
    /// Where the bodies are.
    States,
    /// Which contacts a step had.
    Contacts,
    /// How a step ended.
    Steps,
    /// What ties bodies.
    Joints,
    /// What ties joints.
    Gears,
    /// Where the bodies are after a step, where the next one is not kept.
    Ends,
}

impl Table {
    /// All of them, in the order of the [`Streams`].
    pub const ALL: [Self; 6] =
        [Self::States, Self::Contacts, Self::Steps, Self::Joints, Self::Gears, Self::Ends];

    /// Those that every run has.
    pub const ALWAYS: [Self; 3] = [Self::States, Self::Contacts, Self::Steps];

    /// The name, a file's without `.csv`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::States => "states",
            Self::Contacts => "contacts",
            Self::Steps => "steps",
            Self::Joints => "joints",
            Self::Gears => "gears",
            Self::Ends => "ends",
        }
    }

    /// The names of the columns, of a run with joints or without.
    #[must_use]
    pub fn columns(self, joints: bool) -> &'static [&'static str] {
        match self {
            Self::States | Self::Ends => &STATE_COLUMNS,
            Self::Contacts => &CONTACT_COLUMNS,
            Self::Steps if joints => &STEP_COLUMNS,
            Self::Steps => &STEP_COLUMNS[..STEP_COLUMNS.len() - 1],
            Self::Joints => &JOINT_COLUMNS,
            Self::Gears => &GEAR_COLUMNS,
        }
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// One of each table: streams to write to or to read from.
#[derive(Debug)]
pub struct Streams<S> {
    /// [`Table::States`].
    pub states: S,
    /// [`Table::Contacts`]; without one, contacts are neither written nor read.
    pub contacts: Option<S>,
    /// [`Table::Steps`].
    pub steps: S,
    /// [`Table::Joints`], of a world with joints.
    pub joints: Option<S>,
    /// [`Table::Gears`], of a world with gears.
    pub gears: Option<S>,
    /// [`Table::Ends`], of a run of which steps are left out.
    pub ends: Option<S>,
}

impl<S> Streams<S> {
    /// What `make` makes of each.
    pub(crate) fn each<T, E>(
        self,
        mut make: impl FnMut(Table, S) -> Result<T, E>,
    ) -> Result<Streams<T>, E> {
        let Self { states, contacts, steps, joints, gears, ends } = self;
        Ok(Streams {
            states: make(Table::States, states)?,
            contacts: contacts.map(|stream| make(Table::Contacts, stream)).transpose()?,
            steps: make(Table::Steps, steps)?,
            joints: joints.map(|stream| make(Table::Joints, stream)).transpose()?,
            gears: gears.map(|stream| make(Table::Gears, stream)).transpose()?,
            ends: ends.map(|stream| make(Table::Ends, stream)).transpose()?,
        })
    }
}

const STATE_COLUMNS: [&str; 16] = [
    "k", "t_s", "body", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s",
    "wx_rad_s", "wy_rad_s", "wz_rad_s",
];

const CONTACT_COLUMNS: [&str; 21] = [
    "k",
    "contact",
    "body",
    "partner",
    "partner_index",
    "x_m",
    "y_m",
    "z_m",
    "nx",
    "ny",
    "nz",
    "fx_N",
    "fy_N",
    "fz_N",
    "slip_x_m_s",
    "slip_y_m_s",
    "slip_z_m_s",
    "gap_m",
    "radius_m",
    "rebound_m_s",
    "key",
];

const JOINT_COLUMNS: [&str; 23] = [
    "k",
    "t_s",
    "joint",
    "x_m",
    "y_m",
    "z_m",
    "angle_x_rad",
    "angle_y_rad",
    "angle_z_rad",
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
    "wx_rad_s",
    "wy_rad_s",
    "wz_rad_s",
    "fx_N",
    "fy_N",
    "fz_N",
    "tx_N_m",
    "ty_N_m",
    "tz_N_m",
    "joint_m_s",
    "joint_law_m_s",
];

const GEAR_COLUMNS: [&str; 7] = ["k", "t_s", "gear", "first", "second", "force", "gear_m_s"];

/// The last one where there are joints alone.
const STEP_COLUMNS: [&str; 22] = [
    "k",
    "t_s",
    "status",
    "iterations",
    "start",
    "contacts",
    "residual_m_s",
    "dynamics_m_s",
    "penetration_m_s",
    "normal_law_m_s",
    "friction_law_m_s",
    "cone_m_s",
    "overlap_m",
    "restitution_share",
    "energy_J",
    "loads_J",
    "drives_J",
    "reactions_J",
    "impacts_J",
    "friction_J",
    "discretisation_J",
    "stiffness",
];
