//! Runs of any number of bodies as tables in CSV, each with one header line.
//!
//! The rows of a table are in the order of k. A run has `states`, `contacts` and `steps`, unless
//! fewer tables are requested. It has `joints` and `gears` if its scene has any.
//!
//! - `states`: one row per body and step: `k,t_s,body`, then the 13 numbers of the state at step k.
//!   `body` is the index in [`World::bodies`](tumble_core::world::World::bodies).
//! - `contacts`: one row per candidate contact of the step k → k+1. The columns are listed below.
//! - `steps`: one row per step: status, residual with its five parts, overlap at k+1, smallest
//!   restitution share of an island, and [energy](tumble_core::simulation::energy) at k. The
//!   potential energy is relative to the world's origin. With joints the last column is the
//!   [stiffness number](tumble_core::simulation::StepRecord::stiffness) h ω.
//! - `joints`: one row per joint and step: `k,t_s,joint`, coordinates at k, mean rates over the
//!   step, [force and torque](tumble_core::joint::JointForce) on A, and two residuals. `joint` is
//!   the index in [`World::joints`](tumble_core::world::World::joints). The coordinates are the
//!   position of A's anchor along the axes of B's frame and the
//!   [angles](tumble_core::joint::Joint::turns) about them. Hinge angles include full turns. A
//!   moving frame in the world is taken at the end of the step, so its coordinates at k are the
//!   remaining motion.
//! - `gears`: one row per gear and step: `k,t_s,gear`, both coordinates at k, the force along the
//!   first one over the step (N or N m), and the residual. `gear` is the index in
//!   [`World::gears`](tumble_core::world::World::gears). Coordinates are in m, or in rad with full
//!   turns.
//! - `ends`: one row per body and step, with the columns of `states` and the states at k+1. It
//!   exists if a run does not keep every step, so that each kept step can be verified.
//!
//! | columns of `contacts` | unit | frame |
//! |---|---|---|
//! | body and partner | | |
//! | touching point at k | m | world |
//! | unit normal at k, away from the partner | | world |
//! | force on `body`; the partner has the opposite force | N | world |
//! | mean slip over the step | m/s | world |
//! | gap at k | m | |
//! | rounding radius of the point | m | |
//! | required rebound speed (eq. 29) | m/s | |
//! | persistent key ([`KeyText`]) | | |
//!
//! Within a step, states are in the order of the bodies and contacts in the order of the solution.
//! The last step is a state of status `end` without contacts. Numbers have the fewest digits that
//! read back to the same double.

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

/// Table of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Table {
    /// States of the bodies.
    States,
    /// Contacts of the steps.
    Contacts,
    /// Results of the steps.
    Steps,
    /// Coordinates and forces of the joints.
    Joints,
    /// Coordinates and forces of the gears.
    Gears,
    /// States after each step, if the next step is not kept.
    Ends,
}

impl Table {
    /// All tables, in the order of [`Streams`].
    pub const ALL: [Self; 6] =
        [Self::States, Self::Contacts, Self::Steps, Self::Joints, Self::Gears, Self::Ends];

    /// Tables that every run has, unless fewer are requested.
    pub const ALWAYS: [Self; 3] = [Self::States, Self::Contacts, Self::Steps];

    /// Name, the file's without `.csv`.
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

    /// Names of the columns, for a run with or without joints.
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

/// One stream per table, for reading or writing.
#[derive(Debug)]
pub struct Streams<S> {
    /// Stream of [`Table::States`].
    pub states: S,
    /// Stream of [`Table::Contacts`]; `None` skips the contacts.
    pub contacts: Option<S>,
    /// Stream of [`Table::Steps`].
    pub steps: S,
    /// Stream of [`Table::Joints`], for a world with joints.
    pub joints: Option<S>,
    /// Stream of [`Table::Gears`], for a world with gears.
    pub gears: Option<S>,
    /// Stream of [`Table::Ends`], for a run that omits steps.
    pub ends: Option<S>,
}

impl<S> Streams<S> {
    /// Streams in the order of [`Table::ALL`].
    pub fn in_order(self) -> impl Iterator<Item = S> {
        let Self { states, contacts, steps, joints, gears, ends } = self;
        [Some(states), contacts, Some(steps), joints, gears, ends].into_iter().flatten()
    }

    /// Applies `make` to each stream.
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

/// The last column exists only with joints.
const STEP_COLUMNS: [&str; 23] = [
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
    "placement_m",
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
