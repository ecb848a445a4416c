//! A trajectory as CSV: one row a step, from the step's
//! [record](crate::simulation::StepRecord), in and out of any stream.
//!
//! Columns, for n contact points: `k,t_s`, the 13 numbers of the state at step k, then
//! the solution of the step k → k+1 (`fx…,fy…,fz…` in N, world, `s1_…` in N m, `s2_…` in W,
//! `lam…` in m/s, `alpha…`), then `status,iterations,certificate_m_s`. The last row is a
//! state without a step: its step columns are 0 and its status is `end`. Numbers have the
//! fewest digits that read back to the same double.

use crate::simulation::StepRecord;
use crate::solver::StepStatus;
use crate::state::State;
use crate::step_nlp::layout::{Layout, STATE};
use nalgebra::{SVector, Vector3};
use std::io::{Read, Write};

/// The names of the columns before the per-contact ones.
const STATE_COLUMNS: [&str; 15] = [
    "k", "t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s",
    "wx_rad_s", "wy_rad_s", "wz_rad_s",
];

/// Prefix and suffix of the per-contact columns, in the order of the decision vector,
/// α last.
const CONTACT_COLUMNS: [(&str, &str); 7] = [
    ("fx", "_N"),
    ("fy", "_N"),
    ("fz", "_N"),
    ("s1_", ""),
    ("s2_", ""),
    ("lam", ""),
    ("alpha", ""),
];

/// The names of the columns after the per-contact ones.
const REPORT_COLUMNS: [&str; 3] = ["status", "iterations", "certificate_m_s"];

/// The header for `contacts` contact points.
#[must_use]
pub fn header(contacts: usize) -> Vec<String> {
    let per_contact = CONTACT_COLUMNS
        .iter()
        .flat_map(|(prefix, suffix)| (0..contacts).map(move |i| format!("{prefix}{i}{suffix}")));
    let fixed = |names: &'static [&str]| names.iter().map(|&name| name.to_owned());
    fixed(&STATE_COLUMNS).chain(per_contact).chain(fixed(&REPORT_COLUMNS)).collect()
}

/// Writes a trajectory row by row.
pub struct TrajectoryWriter<W: Write> {
    csv: csv::Writer<W>,
    time_step: f64,
}

impl<W: Write> TrajectoryWriter<W> {
    /// Writes the header. `time_step` (s) gives the column `t_s`.
    ///
    /// # Errors
    /// The stream's.
    pub fn new(stream: W, contacts: usize, time_step: f64) -> csv::Result<Self> {
        let mut csv = csv::WriterBuilder::new().has_headers(false).from_writer(stream);
        csv.write_record(header(contacts))?;
        Ok(Self { csv, time_step })
    }

    /// Writes one row.
    ///
    /// # Errors
    /// The stream's.
    pub fn write(&mut self, record: &StepRecord) -> csv::Result<()> {
        let is_end = record.report.status == StepStatus::End;
        // k h in one rounding, so that times do not drift.
        let time = record.index as f64 * self.time_step;
        let step = &record.solution.as_slice()[STATE.end..];
        self.csv.serialize((
            record.index,
            time,
            record.state.to_vector().as_slice(),
            step,
            record.active.iter().map(|&active| u8::from(active)).collect::<Vec<_>>(),
            record.report.status.name(),
            record.report.iterations,
            if is_end { 0.0 } else { record.certificate.worst() },
        ))
    }

    /// Flushes and gives the stream back.
    ///
    /// # Errors
    /// The stream's.
    pub fn finish(self) -> std::io::Result<W> {
        self.csv.into_inner().map_err(csv::IntoInnerError::into_error)
    }
}

/// One row as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryRow {
    /// k.
    pub index: u64,
    /// t, s.
    pub time: f64,
    /// X at step k.
    pub state: State,
    /// f_x, f_y, f_z, s1, s2, λ of all contacts: the decision vector after X⁺.
    pub step: Vec<f64>,
    /// α.
    pub active: Vec<bool>,
    /// How the step ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// The certificate as the file has it, m/s.
    pub certificate: f64,
}

impl TrajectoryRow {
    /// f_i, N, world, ground on body.
    #[must_use]
    pub fn force(&self, i: usize) -> Vector3<f64> {
        let n = self.active.len();
        Vector3::new(self.step[i], self.step[i + n], self.step[i + 2 * n])
    }

    /// f_i of all contacts, N.
    pub fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        (0..self.active.len()).map(|i| self.force(i))
    }
}

/// Why a trajectory cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// The stream ended early or the CSV is malformed.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// A column is missing, misplaced or unknown.
    #[error("column {position} of the header is {found:?} where {expected:?} belongs")]
    Header {
        /// 1-based.
        position: usize,
        /// The name that is needed.
        expected: String,
        /// The name in the file, empty where the header ends.
        found: String,
    },
    /// A field that cannot be read.
    #[error("line {line}, column {column}: {found:?} is not {expected}")]
    Field {
        /// 1-based line of the file.
        line: u64,
        /// The column's name.
        column: String,
        /// What stands there.
        found: String,
        /// What is needed.
        expected: &'static str,
    },
    /// A row out of order.
    #[error("line {line}: k is {found} where {expected} follows")]
    Order {
        /// 1-based line of the file.
        line: u64,
        /// The k that is needed.
        expected: u64,
        /// The k in the file.
        found: u64,
    },
    /// No `end` row at the end, or rows after it.
    #[error("{0}")]
    End(&'static str),
}

/// Reads a trajectory row by row, checking header, order and every field.
pub struct TrajectoryReader<R: Read> {
    csv: csv::Reader<R>,
    columns: Vec<String>,
    contacts: usize,
    record: csv::StringRecord,
    next_index: u64,
    ended: bool,
}

impl<R: Read> TrajectoryReader<R> {
    /// Reads and checks the header; the number of contact points follows from it.
    ///
    /// # Errors
    /// [`TrajectoryError::Header`], or the stream's.
    pub fn new(stream: R) -> Result<Self, TrajectoryError> {
        let mut csv = csv::Reader::from_reader(stream);
        let found = csv.headers()?.clone();
        let fixed = STATE_COLUMNS.len() + REPORT_COLUMNS.len();
        // To the nearest, so that one missing column is named for what it is.
        let per_contact = CONTACT_COLUMNS.len();
        let contacts = ((found.len() + per_contact / 2).saturating_sub(fixed) / per_contact).max(1);
        let columns = header(contacts);
        for position in 0..columns.len().max(found.len()) {
            let expected = columns.get(position).map_or("the end", String::as_str);
            let name = found.get(position).unwrap_or("");
            if name != expected {
                return Err(TrajectoryError::Header {
                    position: position + 1,
                    expected: expected.to_owned(),
                    found: name.chars().take(40).collect(),
                });
            }
        }
        let record = csv::StringRecord::new();
        Ok(Self { csv, columns, contacts, record, next_index: 0, ended: false })
    }

    /// n.
    #[must_use]
    pub fn contacts(&self) -> usize {
        self.contacts
    }

    /// The next row; `None` after the `end` row.
    ///
    /// # Errors
    /// The first thing wrong with the row, by line and column.
    pub fn next_row(&mut self) -> Result<Option<TrajectoryRow>, TrajectoryError> {
        if !self.csv.read_record(&mut self.record)? {
            return if self.ended {
                Ok(None)
            } else {
                Err(TrajectoryError::End(
                    "the file has no row of status `end`: it is cut off, or no trajectory",
                ))
            };
        }
        if self.ended {
            return Err(TrajectoryError::End("there are rows after the one of status `end`"));
        }
        let row = self.parse()?;
        if row.index != self.next_index {
            return Err(TrajectoryError::Order {
                line: self.line(),
                expected: self.next_index,
                found: row.index,
            });
        }
        self.next_index += 1;
        self.ended = row.status == StepStatus::End;
        Ok(Some(row))
    }

    fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }

    fn parse(&self) -> Result<TrajectoryRow, TrajectoryError> {
        let n = self.contacts;
        let first_step = STATE_COLUMNS.len();
        let first_alpha = first_step + 6 * n;
        let first_report = first_alpha + n;
        let mut state = SVector::<f64, 13>::zeros();
        for (k, value) in state.iter_mut().enumerate() {
            *value = self.number(2 + k)?;
        }
        let status = self.field(first_report, "a status", StepStatus::from_name)?;
        Ok(TrajectoryRow {
            index: self.field(0, "a row number", |text| text.parse().ok())?,
            time: self.number(1)?,
            state: State::from_vector(&state),
            step: (first_step..first_alpha).map(|k| self.number(k)).collect::<Result<_, _>>()?,
            active: (first_alpha..first_report)
                .map(|k| {
                    self.field(k, "0 or 1", |text| match text {
                        "0" => Some(false),
                        "1" => Some(true),
                        _ => None,
                    })
                })
                .collect::<Result<_, _>>()?,
            status,
            iterations: self
                .field(first_report + 1, "a count of iterations", |text| text.parse().ok())?,
            certificate: self.number(first_report + 2)?,
        })
    }

    fn number(&self, column: usize) -> Result<f64, TrajectoryError> {
        self.field(column, "a finite number", |text| {
            text.parse().ok().filter(|value: &f64| value.is_finite())
        })
    }

    fn field<T>(
        &self,
        column: usize,
        expected: &'static str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<T, TrajectoryError> {
        let text = self.record.get(column).unwrap_or("");
        parse(text).ok_or_else(|| TrajectoryError::Field {
            line: self.line(),
            column: self.columns[column].clone(),
            found: text.chars().take(40).collect(),
            expected,
        })
    }
}

/// The number of per-contact columns follows the decision vector's; if one changes, so
/// must the other.
const _: () = assert!(Layout::new(1).variables() - STATE.end + 1 == CONTACT_COLUMNS.len());
