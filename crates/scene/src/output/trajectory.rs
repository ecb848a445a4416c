//! Trajectory of the tutorial's body as CSV, one row per step [record](StepRecord), for plotting.
//!
//! For a body with n contact points, the columns are:
//!
//! - `k,time_s` and the 13 numbers of the state at step k
//! - variables of the tutorial's program for each point in the step k → k+1: `fx…,fy…,fz…` (N,
//!   world), `s1_…` (N m), `s2_…` (W), `lam…` (m/s), `alpha…`
//! - `status,ipopt_status,iterations,certificate_m_s`, the second empty for the native solver
//!
//! A point without contact has zeros. `s1`, `s2` and `lam` are Ipopt's variables where it solved the
//! tutorial's program to the letter. Otherwise they are the smallest slacks for the row's forces and
//! motion, and the slip speed ([`products`]). `alpha` is 1 if the point carries a force.
//!
//! The last row is a state without a step, with zeros in the step columns and the status `end`.

use super::rows::{RowChoice, RowWriter};
use super::tables::STATE_COLUMNS;
use std::io::{self, Write};
use tumble::step_nlp::SMOOTHING;
use tumble::step_nlp::layout::Layout;
use tumble::step_nlp::point::{Products, products};
use tumble_core::contact::{Contact, ContactKey, Partner, rounding};
use tumble_core::simulation::record::Share;
use tumble_core::simulation::{Interval, StepRecord};
use tumble_core::step::{ContactForce, StepStatus};
use tumble_core::world::World;

/// Prefix and suffix of the columns of a contact point.
const POINT_COLUMNS: [(&str, &str); 7] = [
    ("fx", "_N"),
    ("fy", "_N"),
    ("fz", "_N"),
    ("s1_", ""),
    ("s2_", ""),
    ("lam", ""),
    ("alpha", ""),
];

/// Columns after the contact points.
const REPORT_COLUMNS: [&str; 4] = ["status", "ipopt_status", "iterations", "certificate_m_s"];

/// Writes a trajectory row by row.
pub struct TrajectoryWriter<W: Write> {
    rows: RowWriter<W>,
    world: World,
    kept: RowChoice,
    /// Numbers of the row in the columns of the contact points but `alpha`.
    numbers: Vec<f64>,
    carrying: Vec<bool>,
}

impl<W: Write> TrajectoryWriter<W> {
    /// Writes the header of a trajectory of the first body of `world`.
    pub fn new(stream: W, world: &World) -> Self {
        let count = points(world);
        let of_points = POINT_COLUMNS
            .iter()
            .flat_map(|(prefix, suffix)| (0..count).map(move |i| format!("{prefix}{i}{suffix}")));
        let fixed = |names: &'static [&str]| names.iter().map(|&name| name.to_owned());
        let columns = fixed(&["k", "time_s"])
            .chain(fixed(&STATE_COLUMNS))
            .chain(of_points)
            .chain(fixed(&REPORT_COLUMNS));
        let columns: Vec<_> = columns.collect();
        Self::with_writer(RowWriter::new(stream, columns.iter().map(String::as_str)), world)
    }

    /// Continues a trajectory that already has a header, and possibly rows.
    pub fn after(stream: W, world: &World) -> Self {
        Self::with_writer(RowWriter::after(stream), world)
    }

    fn with_writer(rows: RowWriter<W>, world: &World) -> Self {
        let count = points(world);
        let numbers = vec![0.0; (POINT_COLUMNS.len() - 1) * count];
        let carrying = vec![false; count];
        Self { rows, world: world.clone(), kept: RowChoice::ALL, numbers, carrying }
    }

    /// Writes only every `every`-th step, counted from the step `first`, and the last state.
    ///
    /// 0 means every step.
    #[must_use]
    pub fn every(mut self, every: u64, first: u64) -> Self {
        self.kept = RowChoice::new(every, first);
        self
    }

    /// Writes the row of a step, if the step is selected.
    ///
    /// # Errors
    /// The errors of the stream; a record without states, or with a contact that is not between the
    /// points of the first body and the ground. Nothing is written for such a record.
    pub fn write(&mut self, record: &StepRecord) -> io::Result<()> {
        let status = record.status();
        if !self.kept.has(record.index, status) {
            return Ok(());
        }
        let ([state], [_]) = (record.instant_states(), record.next_states()) else {
            return Err(refused("a trajectory needs a record with the states of one body"));
        };
        self.numbers.fill(0.0);
        self.carrying.fill(false);
        // Means of the forces over the step. The other columns of a point are those of its last contact.
        for (share, interval) in record.shares() {
            self.add_contacts(share, interval)?;
        }
        let report = record.report();
        let rows = &mut self.rows;
        rows.whole(record.index);
        // k h with one rounding, so that times do not drift.
        rows.number(record.index as f64 * self.world.time_step());
        rows.numbers(state.to_vector().as_slice());
        rows.numbers(&self.numbers);
        self.carrying.iter().for_each(|carries| rows.whole((*carries).into()));
        rows.text(status.name());
        rows.text(report.message.unwrap_or_default());
        rows.whole(report.iterations.into());
        let is_end = status == StepStatus::End;
        rows.number(if is_end { 0.0 } else { record.residual() });
        rows.end_row()
    }

    /// Adds the contacts of an interval to the numbers of the row.
    fn add_contacts(&mut self, share: Share<'_>, interval: &Interval) -> io::Result<()> {
        let share = share.forces(0, None);
        let count = self.carrying.len();
        for (contact, found) in interval.contacts.iter().zip(&interval.solution.contacts) {
            let ContactKey { body, partner, point, .. } = contact.key;
            if body != 0 || partner != Partner::Ground || point >= count {
                return Err(refused("a trajectory needs contacts at the points of its body"));
            }
            for (column, force) in found.force.iter().enumerate() {
                let mean = &mut self.numbers[column * count + point];
                // The only interval keeps the sign of a zero.
                *mean = if share == 1.0 { *force } else { *mean + share * force };
            }
            let slacks = match &interval.solution.variables[..] {
                [] => {
                    let world = interval.world(&self.world);
                    smallest_slacks(&world, interval, contact, found)
                }
                variables => {
                    let [.., s1, s2, slip] = Layout::new(count).contact_variables(point);
                    [s1, s2, slip]
                        .map(|variable| variables.get(variable).copied().unwrap_or(f64::NAN))
                }
            };
            for (column, value) in slacks.into_iter().enumerate() {
                self.numbers[(3 + column) * count + point] = value;
            }
            self.carrying[point] |= found.carries_force();
        }
        Ok(())
    }

    /// Flushes and returns the stream, with all rows written so far.
    ///
    /// # Errors
    /// The errors of the stream.
    pub fn flushed(&mut self) -> io::Result<&mut W> {
        self.rows.flushed()
    }

    /// Flushes and returns the stream. The last rows may be missing from it before this call.
    ///
    /// # Errors
    /// The errors of the stream.
    pub fn finish(self) -> io::Result<W> {
        self.rows.finish()
    }
}

/// Number of contact points of the first body of `world`.
fn points(world: &World) -> usize {
    world.bodies().first().map_or(0, |body| body.contact_points().len())
}

/// Smallest slacks s1 (N m) and s2 (W) and slip speed (m/s) of a contact with the ground in an interval.
fn smallest_slacks(
    world: &World,
    interval: &Interval,
    contact: &Contact,
    found: &ContactForce,
) -> [f64; 3] {
    let (h, normal, slip) = (world.time_step(), contact.normal(), found.slip.norm());
    let (states, next) = (&interval.states, &interval.solution.states);
    let pose = next[0].pose();
    let gap = contact.gap_at(&pose, None);
    let height = if contact.bounces() {
        h * normal.dot(&contact.law_motion(normal * (gap / h), world, states, next))
    } else {
        gap
    };
    let noise = rounding::gap(&normal, &pose.position, contact.features.offset, &contact.arm);
    let height = if height.abs() <= noise { 0.0 } else { height };
    let force = contact.frame.tr_mul(&found.force);
    let Products { normal, friction, slip_speed } =
        products(&force, slip, height, contact.law.friction, SMOOTHING);
    // Slip that moves the point by less than rounding counts as zero.
    let sticks = slip * h <= noise;
    [normal, if sticks { 0.0 } else { friction }, slip_speed]
}

fn refused(why: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}
