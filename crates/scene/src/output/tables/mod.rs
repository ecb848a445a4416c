//! Runs of any number of bodies as tables in CSV, each with one header line.
//!
//! A row belongs to an interval of a step: to the whole step, or to a part of it. All rows have the
//! columns `interval`, the number of the interval in its step, and `interval_s`, its length. The rows of
//! a table are in the order of k and of intervals. A run has `states`, `contacts` and `steps`, unless
//! fewer tables are requested. It has `joints` and `gears` if its scene has any.
//!
//! - `states`: one row per body and interval: `k,time_s,body`, then the 13 numbers of the state at its
//!   start. `body` is the index in [`World::bodies`](tumble_core::world::World::bodies).
//! - `contacts`: one row per candidate contact of the interval: `k,last_k`, then [`ContactRow`]. A contact
//!   that stays the same over several whole steps has one row for the steps k to `last_k`. Idle
//!   contacts may have no rows, see [`TablesWriter::without_idle_contacts`].
//! - `steps`: one row per interval: status, residual with its five parts, overlap at its end, smallest
//!   restitution share of an island, and [energy](tumble_core::simulation::energy) at its start. The
//!   potential energy is relative to the world's origin. With joints a column is the
//!   [stiffness number](tumble_core::simulation::Interval::stiffness) h ω.
//! - `joints`: one row per joint and interval: `k,time_s,joint`, coordinates at its start, mean rates over
//!   it, [force and torque](tumble_core::joint::JointForce) on A, and two residuals. `joint` is
//!   the index in [`World::joints`](tumble_core::world::World::joints). The coordinates are the
//!   position of A's anchor along the axes of B's frame and the
//!   [angles](tumble_core::joint::Joint::turns) about them. Hinge angles include full turns. A
//!   moving frame in the world is taken at the end of the step, so its coordinates at k are the
//!   remaining motion.
//! - `gears`: one row per gear and interval: `k,time_s,gear`, both coordinates at its start, the force
//!   along the first one (N or N m), and the residual. `gear` is the index in
//!   [`World::gears`](tumble_core::world::World::gears). Coordinates are in m, or in rad with full
//!   turns.
//! - `ends`: one row per body, with the columns of `states` and the states at the end of an interval. It
//!   has the intervals after which the next row does not start at their end: rows are omitted, or
//!   velocities are converted to another length. Each interval can be verified with it.
//!
//! Within an interval, states are in the order of the bodies and contacts in the order of the solution.
//! The last step is a state of status `end` without contacts. Numbers have the fewest digits that
//! read back to the same double. [Short](TablesWriter::short) tables have rounded numbers and no rows of
//! states that do not change.

mod columns;
mod contact_runs;
mod digits;
mod key;
mod named;
mod read;
mod rebuild;
mod steps;
mod write;

pub(super) use columns::STATE_COLUMNS;
pub use columns::{ContactRow, GearTableRow, JointRow, StepRow};
use columns::{INTERVAL_COLUMNS, MIDDLE_COLUMNS};
pub use digits::rounds;
pub use key::KeyText;
pub use named::Misplaced;
pub use read::{IntervalRows, TablesReader};
pub use steps::whole_steps;
pub use write::{OpenRows, TablesWriter};

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
    /// States after intervals from which the next row does not start.
    Ends,
}

impl Table {
    /// All tables, in the order of [`Streams`].
    pub const ALL: [Self; 6] =
        [Self::States, Self::Contacts, Self::Steps, Self::Joints, Self::Gears, Self::Ends];

    /// Tables that every run has, unless fewer are requested.
    pub const ALWAYS: [Self; 3] = [Self::States, Self::Contacts, Self::Steps];

    /// Name, the file's without `.csv`.
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
    pub fn columns(self, shape: &TableShape) -> Vec<&'static str> {
        let (first, others): (&[_], &[_]) = match self {
            Self::States if shape.has_middles => {
                let body = &["k", "time_s", "body"][..];
                return [body, &STATE_COLUMNS, &MIDDLE_COLUMNS, &INTERVAL_COLUMNS].concat();
            }
            Self::States | Self::Ends => (&["k", "time_s", "body"], &STATE_COLUMNS),
            Self::Contacts => {
                let count = ContactRow::COLUMNS.len() - shape.missing_columns_of_contacts();
                return [&["k", "last_k"][..], &ContactRow::COLUMNS[..count]].concat();
            }
            Self::Steps => {
                return StepRow::COLUMNS[..StepRow::COLUMNS.len() - shape.missing_columns()]
                    .to_vec();
            }
            Self::Joints => (&["k", "time_s", "joint"], JointRow::COLUMNS),
            Self::Gears => (&["k", "time_s", "gear"], GearTableRow::COLUMNS),
        };
        [first, others, &INTERVAL_COLUMNS].concat()
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
    /// True with an [accuracy](World::with_accuracy) or located impacts.
    pub has_errors: bool,
    /// True with [rolling or torsional friction](World::has_turning_friction).
    pub has_moments: bool,
}

impl TableShape {
    /// Shape of the tables of a run in `world`.
    pub fn new(world: &World) -> Self {
        Self {
            bodies: world.bodies().len(),
            joints: world.joints().len(),
            gears: world.gears().len(),
            has_middles: world.integrator() == Integrator::Leapfrog,
            has_errors: world.impacts() == Impacts::Located,
            has_moments: world.has_turning_friction(),
        }
    }

    /// Number of columns at the end of the table `steps` that it lacks: the error and the length of
    /// corrections without an accuracy, and the stiffness without joints as well.
    fn missing_columns(&self) -> usize {
        match (self.has_errors, self.joints) {
            (true, _) => 0,
            (false, 1..) => 2,
            (false, 0) => 3,
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
    /// Stream of [`Table::Ends`].
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
