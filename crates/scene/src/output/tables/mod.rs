//! Runs of any number of bodies as tables in CSV, each with one header line.
//!
//! The rows of a table are in the order of k. A run has `states`, `contacts` and `steps`, unless
//! fewer tables are requested. It has `joints` and `gears` if its scene has any.
//!
//! - `states`: one row per body and step: `k,time_s,body`, then the 13 numbers of the state at step k.
//!   `body` is the index in [`World::bodies`](tumble_core::world::World::bodies).
//! - `contacts`: one row per candidate contact of the step k → k+1, see [`ContactRow`]. Idle
//!   contacts may have no rows, see [`TablesWriter::without_idle_contacts`].
//! - `steps`: one row per step: status, residual with its five parts, overlap at k+1, smallest
//!   restitution share of an island, and [energy](tumble_core::simulation::energy) at k. The
//!   potential energy is relative to the world's origin. With joints the last column is the
//!   [stiffness number](tumble_core::simulation::StepRecord::stiffness) h ω.
//! - `joints`: one row per joint and step: `k,time_s,joint`, coordinates at k, mean rates over the
//!   step, [force and torque](tumble_core::joint::JointForce) on A, and two residuals. `joint` is
//!   the index in [`World::joints`](tumble_core::world::World::joints). The coordinates are the
//!   position of A's anchor along the axes of B's frame and the
//!   [angles](tumble_core::joint::Joint::turns) about them. Hinge angles include full turns. A
//!   moving frame in the world is taken at the end of the step, so its coordinates at k are the
//!   remaining motion.
//! - `gears`: one row per gear and step: `k,time_s,gear`, both coordinates at k, the force along the
//!   first one over the step (N or N m), and the residual. `gear` is the index in
//!   [`World::gears`](tumble_core::world::World::gears). Coordinates are in m, or in rad with full
//!   turns.
//! - `ends`: one row per body and step, with the columns of `states` and the states at k+1. It
//!   exists if a run does not keep every step, so that each kept step can be verified.
//!
//! Within a step, states are in the order of the bodies and contacts in the order of the solution.
//! The last step is a state of status `end` without contacts. Numbers have the fewest digits that
//! read back to the same double.

mod columns;
mod key;
mod named;
mod read;
mod rebuild;
mod write;

use columns::MIDDLE_COLUMNS;
pub(super) use columns::STATE_COLUMNS;
pub use columns::{ContactRow, GearTableRow, JointRow, StepRow};
pub use key::KeyText;
pub use named::Misplaced;
pub use read::{TableStep, TablesReader};
pub use write::TablesWriter;

use std::fmt;
use tumble_core::world::{Impacts, Integrator, World};

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

    /// Names of the columns in tables of this shape.
    #[must_use]
    pub fn columns(self, shape: &TableShape) -> Vec<&'static str> {
        let (first, others): (&[_], &[_]) = match self {
            Self::States if shape.has_middles => {
                return [&["k", "time_s", "body"][..], &STATE_COLUMNS, &MIDDLE_COLUMNS].concat();
            }
            Self::States | Self::Ends => (&["k", "time_s", "body"], &STATE_COLUMNS),
            Self::Contacts => {
                let count = ContactRow::COLUMNS.len() - shape.missing_columns_of_contacts();
                (&["k"], &ContactRow::COLUMNS[..count])
            }
            Self::Steps => {
                (&[], &StepRow::COLUMNS[..StepRow::COLUMNS.len() - shape.missing_columns()])
            }
            Self::Joints => (&["k", "time_s", "joint"], JointRow::COLUMNS),
            Self::Gears => (&["k", "time_s", "gear"], GearTableRow::COLUMNS),
        };
        [first, others].concat()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Numbers of objects of a run, and whether its states have middle velocities. They give the columns
/// of its tables and the rows of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TableShape {
    /// Number of bodies.
    pub bodies: usize,
    /// Number of joints.
    pub joints: usize,
    /// Number of gears.
    pub gears: usize,
    /// True with [`Integrator::Leapfrog`].
    pub has_middles: bool,
    /// True with an [accuracy](World::with_accuracy).
    pub has_substeps: bool,
    /// True with [rolling or torsional friction](World::has_turning_friction).
    pub has_moments: bool,
}

impl TableShape {
    /// Shape of the tables of a run in `world`.
    #[must_use]
    pub fn new(world: &World) -> Self {
        Self {
            bodies: world.bodies().len(),
            joints: world.joints().len(),
            gears: world.gears().len(),
            has_middles: world.integrator() == Integrator::Leapfrog,
            has_substeps: world.impacts() == Impacts::Located,
            has_moments: world.has_turning_friction(),
        }
    }

    /// Number of columns at the end of the table `steps` that it lacks: the substeps of a step without an
    /// accuracy, and the stiffness without joints as well.
    fn missing_columns(&self) -> usize {
        match (self.has_substeps, self.joints) {
            (true, _) => 0,
            (false, 1..) => 3,
            (false, 0) => 4,
        }
    }

    /// Number of columns at the end of the table `contacts` that it lacks: those of moments.
    fn missing_columns_of_contacts(&self) -> usize {
        if self.has_moments { 0 } else { 3 }
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
