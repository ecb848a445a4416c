//! Tables of tosses as CSV.

use super::Toss;
use crate::fit::error::FitError;
use crate::mechanics::State;
use flate2::read::MultiGzDecoder;
use nalgebra::SVector;
use std::io::{Cursor, Read};

/// The columns of a state, in the order of [`State::to_vector`].
pub(super) const STATE: [&str; State::LEN] = [
    "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s", "wx_rad_s",
    "wy_rad_s", "wz_rad_s",
];
/// The first bytes of what gzip compressed.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// More bytes than this, decompressed, are no table of tosses.
const MOST_BYTES: u64 = 1 << 30;

/// The tosses of a table with a header: `toss_id`, `step`, `t_s`, position `x_m` …, attitude
/// `qw` … (body → world), velocity `vx_m_s` … (world), spin `wx_rad_s` … (body). Columns are found
/// by their names; others are let be. Rows of a toss follow each other, `step` from 0 on. Plain or
/// compressed by gzip. The rate is that of `t_s`.
///
/// # Errors
/// What is no such table, with the toss and the row; as [`Toss::checked`].
pub fn read_csv(bytes: &[u8]) -> Result<Vec<Toss>, FitError> {
    tosses(plain(bytes))
}

/// The bytes of a table, of which `bytes` may be compressed by gzip.
pub(super) fn plain<'a>(bytes: &'a [u8]) -> Box<dyn Read + 'a> {
    match bytes.starts_with(&GZIP) {
        true => Box::new(MultiGzDecoder::new(Cursor::new(bytes)).take(MOST_BYTES)),
        false => Box::new(Cursor::new(bytes)),
    }
}

/// Where the columns are.
struct Columns {
    toss: usize,
    step: usize,
    time: usize,
    state: [usize; State::LEN],
}

impl Columns {
    fn find(header: &csv::StringRecord) -> Result<Self, FitError> {
        let find = |name: &str| {
            let known = header.iter().position(|column| column.trim() == name);
            known.ok_or_else(|| {
                let all = STATE.join(", ");
                let why = format!(
                    "the table has no column {name}; toss_id, step, t_s, {all} are needed, in SI \
                     units"
                );
                FitError::File(why)
            })
        };
        let mut state = [0; State::LEN];
        for (place, name) in state.iter_mut().zip(STATE) {
            *place = find(name)?;
        }
        Ok(Self { toss: find("toss_id")?, step: find("step")?, time: find("t_s")?, state })
    }
}

fn tosses(stream: impl Read) -> Result<Vec<Toss>, FitError> {
    let unreadable = |error: csv::Error| FitError::File(format!("it is no table: {error}"));
    let mut reader = csv::Reader::from_reader(stream);
    let columns = Columns::find(reader.headers().map_err(unreadable)?)?;
    let (mut tosses, mut times): (Vec<Toss>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(unreadable)? {
        let name = record[columns.toss].trim();
        if tosses.last().is_none_or(|toss| toss.name != name) {
            finish(&mut tosses, &times)?;
            times.clear();
            if tosses.iter().any(|toss| toss.name == name) {
                let why = "its rows do not follow each other".to_owned();
                return Err(FitError::Toss { toss: name.to_owned(), why });
            }
            tosses.push(Toss::new(name, 0.0, Vec::new()));
        }
        let row = times.len();
        let number = |column: usize, what: &str| {
            let text = record[column].trim();
            text.parse::<f64>().map_err(|_| FitError::Row {
                toss: name.to_owned(),
                row,
                why: format!("{what} is `{text}`; a number is needed"),
            })
        };
        let step = number(columns.step, "step")?;
        if step != row as f64 {
            let why = format!("step is {step}, {row} is needed: rows are missing or out of order");
            return Err(FitError::Row { toss: name.to_owned(), row, why });
        }
        times.push(number(columns.time, "t_s")?);
        let mut x = SVector::<f64, { State::LEN }>::zeros();
        for ((value, &column), what) in x.iter_mut().zip(&columns.state).zip(STATE) {
            *value = number(column, what)?;
        }
        if let Some(toss) = tosses.last_mut() {
            toss.frames.push(State::from_vector(&x));
        }
    }
    finish(&mut tosses, &times)?;
    if tosses.is_empty() {
        return Err(FitError::File("the table has no rows".to_owned()));
    }
    Ok(tosses)
}

/// What a time may be off, in parts of an interval: the digits of a file.
const LATE: f64 = 0.01;

/// Gives the last toss its rate, and checks it.
pub(super) fn finish(tosses: &mut Vec<Toss>, times: &[f64]) -> Result<(), FitError> {
    let Some(mut toss) = tosses.pop() else { return Ok(()) };
    let (first, last) = (times[0], times[times.len() - 1]);
    toss.begin = first;
    toss.rate = (times.len() - 1) as f64 / (last - first);
    if times.len() > 1 {
        for (row, time) in times.iter().enumerate() {
            let expected = first + row as f64 / toss.rate;
            let near = (time - expected).abs() * toss.rate <= LATE;
            if !near {
                let why = format!("t_s is {time}, {expected:.8} is needed for equal intervals");
                return Err(FitError::Row { toss: toss.name, row, why });
            }
        }
        // A file's digits: 148 frames a second, not 148.00003.
        let whole = toss.rate.round();
        if (toss.rate - whole).abs() < 1e-4 * whole {
            toss.rate = whole;
        }
    }
    tosses.push(toss.checked()?);
    Ok(())
}
