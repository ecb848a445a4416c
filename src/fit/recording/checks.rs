//! What a recording must be, before it is believed.

use super::Toss;
use crate::fit::error::FitError;
use crate::fit::protocol::turn_between;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use nalgebra::{Vector3, Vector4};

/// What the length of an attitude may be off: single precision and the digits of a file.
const LONG: f64 = 1e-3;
/// Fewer frames than this are no motion.
const LEAST_FRAMES: usize = 5;
/// How far recorded velocities may be from differences of positions, as parts of them, over most
/// frames. Filters and half a frame of delay leave a few hundredths; another unit or frame, one and
/// more.
const APART: f64 = 0.5;
/// Speeds below these say nothing, m/s and rad/s.
const SLOW: f64 = 0.05;
const SLOW_SPIN: f64 = 0.5;

/// One frame beside the next: what was recorded, and what the poses say.
type Beside = (Vector3<f64>, Vector3<f64>);

impl Toss {
    fn refused<T>(&self, why: impl Into<String>) -> Result<T, FitError> {
        Err(FitError::Toss { toss: self.name.clone(), why: why.into() })
    }

    fn row<T>(&self, row: usize, why: String) -> Result<T, FitError> {
        Err(FitError::Row { toss: self.name.clone(), row, why })
    }

    /// The toss with attitudes of unit length, if it can be one.
    ///
    /// # Errors
    /// Fewer than five frames, no rate; a number that is none, an attitude whose length differs
    /// from 1 by more than 1e-3, a jump of more than a third of a turn between frames; velocities
    /// that are not those of the positions, or spins not those of the attitudes, with what they
    /// look like: millimetres, degrees, the world's frame, another order of the quaternion.
    pub fn checked(mut self) -> Result<Self, FitError> {
        if self.count() < LEAST_FRAMES {
            return self.refused(format!(
                "it has {} frames; {LEAST_FRAMES} or more are needed",
                self.count()
            ));
        }
        if !(1.0..=1e5).contains(&self.rate) {
            return self.refused(format!(
                "its rate is {} frames a second; 1 to 100000 are allowed",
                self.rate
            ));
        }
        for row in 0..self.frames.len() {
            let frame = &self.frames[row];
            for (value, name) in frame.to_vector().iter().zip(NAMES) {
                if !value.is_finite() {
                    return self.row(row, format!("{name} is {value}; a finite number is needed"));
                }
            }
            let norm = frame.attitude.norm();
            if (norm - 1.0).abs() > LONG {
                return self.row(
                    row,
                    format!("the attitude quaternion has length {norm:.4}; 1 is needed"),
                );
            }
            self.frames[row].attitude /= norm;
        }
        let bodies = self.bodies;
        for row in bodies..self.frames.len() {
            let [a, b] = [&self.frames[row - bodies].attitude, &self.frames[row].attitude];
            let turn = turn_between(a, b).norm().to_degrees();
            if turn > 120.0 {
                let why = format!("it turns by {turn:.0}° from one frame to the next: a gap?");
                return self.row(row, why);
            }
        }
        for body in 0..bodies {
            self.check_velocities(body)?;
            self.check_spins(body)?;
        }
        Ok(self)
    }

    /// Velocities against differences of positions.
    fn check_velocities(&self, body: usize) -> Result<(), FitError> {
        let one = |(a, b): (&State, &State)| (b.velocity, (b.position - a.position) * self.rate);
        let beside: Vec<Beside> =
            self.of_body(body).zip(self.of_body(body).skip(1)).map(one).collect();
        let Some(misfit) = misfit(&beside, SLOW) else { return Ok(()) };
        let why = match ratio(&beside) {
            _ if misfit <= APART => return Ok(()),
            ratio if (ratio / 1000.0 - 1.0).abs() < 0.3 => "they look like mm/s; m/s are needed",
            ratio if (ratio * 1000.0 - 1.0).abs() < 0.3 => {
                "the positions look like millimetres; metres are needed"
            }
            _ => "m, m/s and the right rate are needed",
        };
        let of = self.of_one(body);
        self.refused(format!("the velocities{of} are not those of the positions: {why}"))
    }

    /// Spins against differences of attitudes.
    fn check_spins(&self, body: usize) -> Result<(), FitError> {
        let beside = |spin: &dyn Fn(&State) -> Vector3<f64>,
                      attitude: &dyn Fn(&State) -> Vector4<f64>|
         -> Vec<Beside> {
            let one = |(a, b): (&State, &State)| {
                (spin(b), turn_between(&attitude(a), &attitude(b)) * self.rate)
            };
            self.of_body(body).zip(self.of_body(body).skip(1)).map(one).collect()
        };
        let own_spin = |state: &State| state.spin;
        let own_attitude = |state: &State| state.attitude;
        let own = beside(&own_spin, &own_attitude);
        let Some(found) = misfit(&own, SLOW_SPIN) else { return Ok(()) };
        if found <= APART {
            return Ok(());
        }
        let in_body = |state: &State| rotation(&state.attitude).tr_mul(&state.spin);
        let last_first = |state: &State| {
            let [x, y, z, w] = state.attitude.into();
            Vector4::new(w, x, y, z)
        };
        let conjugate = |state: &State| {
            let [w, x, y, z] = state.attitude.into();
            Vector4::new(w, -x, -y, -z)
        };
        let in_degrees = |state: &State| state.spin.map(f64::to_radians);
        let looks = [
            (
                beside(&in_degrees, &own_attitude),
                "they look like degrees a second; rad/s are needed",
            ),
            (
                beside(&in_body, &own_attitude),
                "they look like those of the world's frame; the body's are needed",
            ),
            (
                beside(&own_spin, &last_first),
                "the quaternions look like (x, y, z, w); (w, x, y, z) is needed",
            ),
            (
                beside(&own_spin, &conjugate),
                "the quaternions look like world → body; body → world is needed",
            ),
        ];
        let fits = looks.iter().map(|(beside, why)| {
            (misfit(beside, SLOW_SPIN.to_radians()).unwrap_or(f64::INFINITY), *why)
        });
        let why = match fits.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((misfit, why)) if misfit <= APART => why,
            _ => {
                "rad/s in the body's frame, quaternions (w, x, y, z) body → world and the right \
                 rate are needed"
            }
        };
        let of = self.of_one(body);
        self.refused(format!("the spins{of} are not those of the attitudes: {why}"))
    }

    /// Which of several bodies is meant.
    fn of_one(&self, body: usize) -> String {
        if self.bodies == 1 { String::new() } else { format!(" of body {body}") }
    }

    /// Whether a body with these `corners` (centres, m, body frame) and `radius` (m) can have made
    /// this above the ground z = 0: its lowest point must come to the ground and stay above it,
    /// each within a third of the body's half extent.
    ///
    /// # Errors
    /// It does not, with what it looks like: millimetres, z downwards, another height of the
    /// ground.
    pub fn check_against(&self, corners: &[Vector3<f64>], radius: f64) -> Result<(), FitError> {
        let size = corners.iter().map(Vector3::amax).fold(0.0, f64::max) + radius;
        let lowest = |frame: &State, up: f64| {
            let pose = frame.pose();
            let height =
                |corner: &Vector3<f64>| up * (pose.position + pose.rotation * corner).z - radius;
            corners.iter().map(height).fold(f64::INFINITY, f64::min)
        };
        let least = |up: f64| {
            self.frames.iter().map(|frame| lowest(frame, up)).fold(f64::INFINITY, f64::min)
        };
        let (found, allowed) = (least(1.0), size / 3.0);
        if found.abs() <= allowed {
            return Ok(());
        }
        let heights = self.frames.iter().map(|frame| frame.position.z.abs());
        let highest = heights.fold(0.0, f64::max);
        let why = if least(-1.0).abs() <= allowed {
            "z looks downwards; z upwards is needed"
        } else if highest > 100.0 * size {
            "the positions look like millimetres; metres are needed"
        } else {
            "the ground at z = 0 and the body of the scene are needed"
        };
        self.refused(format!("the body's lowest point comes to {found:.4} m of the ground: {why}"))
    }
}

/// The numbers of a state, in the order of [`State::to_vector`].
const NAMES: [&str; State::LEN] =
    ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"];

/// The median of |a − b| / |b| over what is not slow; nothing where less than three pairs are fast.
fn misfit(beside: &[Beside], slow: f64) -> Option<f64> {
    let fast = beside.iter().filter(|(a, b)| a.norm().max(b.norm()) > slow);
    let parts = fast.map(|(a, b)| (a - b).norm() / b.norm().max(slow)).collect::<Vec<_>>();
    (parts.len() >= 3).then(|| median(parts))
}

/// Σ|a| / Σ|b|: what is fast decides, not the noise of what rests.
fn ratio(beside: &[Beside]) -> f64 {
    let sum = |of: fn(&Beside) -> f64| beside.iter().map(of).sum::<f64>();
    sum(|(a, _)| a.norm()) / sum(|(_, b)| b.norm())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
