//! Tables of several bodies' states as CSV: what runs of tumble write, and what is recorded like it.

use super::Toss;
use super::csv_table::{STATE, finish, plain};
use crate::fit::error::FitError;
use crate::mechanics::State;
use nalgebra::SVector;

/// The recordings of a table with a header: `t_s`, `body`, and a state as in
/// [`read_csv`](super::read_csv); `body` is the name of one of `bodies`, or its place among them from 0 on, and need not be
/// there where there is one. Rows of a frame follow each other, one a body. Of a table with a column `toss_id` each of these is a
/// recording; without it the table is one, `name`. Other columns are let be. Plain or compressed by gzip. The rate is that of `t_s`.
///
/// # Errors
/// What is no such table, with the recording and the row; as [`Toss::checked`].
pub fn read_bodies(bytes: &[u8], bodies: &[String], name: &str) -> Result<Vec<Toss>, FitError> {
    let unreadable = |error: csv::Error| FitError::File(format!("it is no table: {error}"));
    let mut reader = csv::Reader::from_reader(plain(bytes));
    let columns = Columns::find(reader.headers().map_err(unreadable)?, bodies.len())?;
    let mut read = Reading { bodies, tosses: Vec::new(), times: Vec::new(), frame: Vec::new() };
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(unreadable)? {
        let of = columns.toss.map_or(name, |column| record[column].trim());
        read.row(&columns, &record, of)?;
    }
    read.end()?;
    if read.tosses.is_empty() {
        return Err(FitError::File("the table has no rows".to_owned()));
    }
    Ok(read.tosses)
}

/// Where the columns are.
struct Columns {
    toss: Option<usize>,
    time: usize,
    body: Option<usize>,
    state: [usize; State::LEN],
}

impl Columns {
    fn find(header: &csv::StringRecord, bodies: usize) -> Result<Self, FitError> {
        let known = |name: &str| header.iter().position(|column| column.trim() == name);
        let find = |name: &str| {
            known(name).ok_or_else(|| {
                let all = STATE.join(", ");
                let why = format!(
                    "the table has no column {name}; t_s, body, {all} are needed of {bodies} bodies, in SI units, as \
                     states.csv of a run has them"
                );
                FitError::File(why)
            })
        };
        let mut state = [0; State::LEN];
        for (place, name) in state.iter_mut().zip(STATE) {
            *place = find(name)?;
        }
        let body = if bodies == 1 { known("body") } else { Some(find("body")?) };
        Ok(Self { toss: known("toss_id"), time: find("t_s")?, body, state })
    }
}

/// What was read so far.
struct Reading<'a> {
    bodies: &'a [String],
    tosses: Vec<Toss>,
    /// One a frame of the last of these.
    times: Vec<f64>,
    /// The frame that is being read, one a body.
    frame: Vec<Option<State>>,
}

impl Reading<'_> {
    fn row(
        &mut self,
        columns: &Columns,
        record: &csv::StringRecord,
        name: &str,
    ) -> Result<(), FitError> {
        if self.tosses.last().is_none_or(|toss| toss.name != name) {
            self.end()?;
            if self.tosses.iter().any(|toss| toss.name == name) {
                let why = "its rows do not follow each other".to_owned();
                return Err(FitError::Toss { toss: name.to_owned(), why });
            }
            let bodies = self.bodies.len();
            self.tosses.push(Toss { bodies, ..Toss::new(name, 0.0, Vec::new()) });
        }
        let row = self.times.len();
        let refused = |why: String| FitError::Row { toss: name.to_owned(), row, why };
        let number = |column: usize, what: &str| {
            let text = record[column].trim();
            let needed = || refused(format!("{what} is `{text}`; a number is needed"));
            text.parse::<f64>().map_err(|_| needed())
        };
        let time = number(columns.time, "t_s")?;
        if self.frame.is_empty() {
            self.times.push(time);
            self.frame.resize(self.bodies.len(), None);
        } else if self.times.last() != Some(&time) {
            let missing = self.frame.iter().position(Option::is_none).unwrap_or(0);
            let body = &self.bodies[missing];
            return Err(refused(format!(
                "at t_s = {time} another frame begins, and the one before has no {body}"
            )));
        }
        let body = match columns.body {
            None => 0,
            Some(column) => {
                let text = record[column].trim();
                let named = self.bodies.iter().position(|name| name == text);
                let place = named.or_else(|| text.parse().ok().filter(|k| *k < self.bodies.len()));
                place.ok_or_else(|| refused(format!("the scene has no body {text}")))?
            }
        };
        let mut x = SVector::<f64, { State::LEN }>::zeros();
        for ((value, &column), what) in x.iter_mut().zip(&columns.state).zip(STATE) {
            *value = number(column, what)?;
        }
        let body_name = &self.bodies[body];
        if self.frame[body].replace(State::from_vector(&x)).is_some() {
            return Err(refused(format!("it has {body_name} twice")));
        }
        if self.frame.iter().all(Option::is_some)
            && let Some(toss) = self.tosses.last_mut()
        {
            toss.frames.extend(self.frame.drain(..).flatten());
        }
        Ok(())
    }

    /// Ends the last recording.
    fn end(&mut self) -> Result<(), FitError> {
        let missing = self.frame.iter().position(Option::is_none);
        if let (Some(body), Some(toss)) = (missing, self.tosses.last()) {
            let why = format!("its last frame has no {}", self.bodies[body]);
            return Err(FitError::Toss { toss: toss.name.clone(), why });
        }
        finish(&mut self.tosses, &self.times)?;
        self.times.clear();
        Ok(())
    }
}
