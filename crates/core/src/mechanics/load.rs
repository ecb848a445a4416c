//! External force and torque on a body as functions of time, for
//! [`Simulation::set_load`](crate::simulation::Simulation::set_load).

use crate::error::{Error, all_in_range, in_range};
use crate::kinematics::quaternion::rotation;
use crate::kinematics::state::Wrench;
use nalgebra::{Vector3, Vector4};

/// Piecewise linear vector function of time. It is constant before the first and after the last
/// knot. Two knots at the same time form a jump. Without knots it is zero.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Polyline {
    /// Knots (t, value), ordered by time t (s).
    knots: Vec<(f64, Vector3<f64>)>,
}

/// Force and torque as functions of time.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Load {
    /// Force (N), world frame.
    pub force: Polyline,
    /// Torque (N m), **body** frame, in addition to the torque of the force.
    pub torque: Polyline,
    point: Vector3<f64>,
}

/// Largest number of knots.
const MOST_KNOTS: usize = 1_000_000;

/// First of the increasing `times` after `from` and up to `to` (s) from which all others are at least as far as
/// `apart` (s). The times begin at `from` − `apart`. Knots that are closer are samples of a smooth function.
pub(crate) fn first_isolated(
    times: impl Iterator<Item = f64>,
    [from, to]: [f64; 2],
    apart: f64,
) -> Option<f64> {
    let mut times = times.take_while(|time| *time <= to + apart).peekable();
    let mut before = f64::NEG_INFINITY;
    while let Some(time) = times.next() {
        let next = times.peek().map_or(f64::INFINITY, |next| *next);
        if (time - before).min(next - time) >= apart && from < time && time <= to {
            return Some(time);
        }
        before = time;
    }
    None
}

impl Polyline {
    /// Creates a constant function.
    ///
    /// # Errors
    /// Same as [`Polyline::new`].
    pub fn constant(value: Vector3<f64>) -> Result<Self, Error> {
        Self::new(vec![(0.0, value)])
    }

    /// Creates a function from `knots` of time t (s) and value (N or N m).
    ///
    /// # Errors
    /// If there are more than a million knots or more than two at the same time, if times decrease
    /// or are beyond ±1e6 s, or if a component is beyond ±1e9.
    pub fn new(knots: Vec<(f64, Vector3<f64>)>) -> Result<Self, Error> {
        if knots.len() > MOST_KNOTS {
            return Err(Error::Count {
                field: "knots of the load",
                count: knots.len(),
                allowed: "0 to 1000000",
            });
        }
        let mut earliest = -1e6;
        for (time, value) in &knots {
            let allowed = "-1e6 to 1e6, not before the previous knot";
            earliest = in_range("time of the load (s)", *time, earliest, 1e6, allowed)?;
            all_in_range("load (N, N m)", value, -1e9, 1e9, "-1e9 to 1e9")?;
        }
        // Knots are ordered by time, so three are at the same time if the outer two are.
        if let Some(jump) = knots.windows(3).find(|three| three[0].0 == three[2].0) {
            return Err(Error::KnotsAtOneTime { time: jump[0].0 });
        }
        Ok(Self { knots })
    }

    /// Knots (t, value), ordered by time t (s).
    pub fn knots(&self) -> &[(f64, Vector3<f64>)] {
        &self.knots
    }

    /// Mean over `from`…`to` (s), exact by the trapezoidal rule between knots. At times so late
    /// that `from` and `to` are the same double, the value there.
    pub fn mean(&self, from: f64, to: f64) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        let first_inside = self.knots.partition_point(|(time, _)| *time <= from);
        let mut start = (from, self.between(first_inside, from));
        if to <= from {
            return start.1;
        }
        for &(time, value) in self.knots[first_inside..].iter().take_while(|(time, _)| *time < to) {
            sum += 0.5 * (time - start.0) * (start.1 + value);
            start = (time, value);
        }
        let end = self.between(self.knots.partition_point(|(time, _)| *time < to), to);
        sum += 0.5 * (to - start.0) * (start.1 + end);
        sum / (to - from)
    }

    /// First isolated jump within the times `within` (s); see [`first_isolated`].
    pub(crate) fn jump_in(&self, within: [f64; 2], apart: f64) -> Option<f64> {
        let first = self.knots.partition_point(|(knot, _)| *knot <= within[0] - apart);
        let jumps = self.knots[first..].windows(2).filter(|two| two[0].0 == two[1].0);
        first_isolated(jumps.map(|two| two[0].0), within, apart)
    }

    /// Value at `time`, which lies between the knots `next` − 1 and `next`.
    fn between(&self, next: usize, time: f64) -> Vector3<f64> {
        let before = next.checked_sub(1).and_then(|last| self.knots.get(last));
        match (before, self.knots.get(next)) {
            (Some((t0, a)), Some((t1, b))) => a + (b - a) * ((time - t0) / (t1 - t0)),
            (Some((_, value)), None) | (None, Some((_, value))) => *value,
            (None, None) => Vector3::zeros(),
        }
    }
}

impl Load {
    /// Zero load.
    pub fn none() -> Self {
        Self::default()
    }

    /// Creates a load whose force acts at `point` (m, body frame, relative to the centre of mass).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the point is beyond ±1e4 m.
    pub fn new(force: Polyline, torque: Polyline, point: Vector3<f64>) -> Result<Self, Error> {
        all_in_range("point of the load (m)", &point, -1e4, 1e4, "-1e4 to 1e4")?;
        Ok(Self { force, torque, point })
    }

    /// First isolated jump within the times `within` (s); see [`first_isolated`].
    pub(crate) fn jump_in(&self, within: [f64; 2], apart: f64) -> Option<f64> {
        let lines = [&self.force, &self.torque].into_iter();
        lines.filter_map(|line| line.jump_in(within, apart)).reduce(f64::min)
    }

    /// True if there is no load.
    pub fn is_none(&self) -> bool {
        self.force.knots.is_empty() && self.torque.knots.is_empty()
    }

    /// Point of action of the force (m), body frame.
    pub fn point(&self) -> &Vector3<f64> {
        &self.point
    }

    /// Wrench of the step `index` → `index` + 1 of `time_step` h (s): the [mean](Self::mean) of the
    /// load over the step.
    pub fn wrench(&self, index: u64, time_step: f64, attitude: &Vector4<f64>) -> Wrench {
        self.mean(index as f64 * time_step, (index + 1) as f64 * time_step, attitude)
    }

    /// Mean wrench from time `from` to `to` (s), so that impulses are exact for any step. The torque
    /// of the force is taken at the `attitude` (body → world) at the start of the step, like torques
    /// of contact forces:
    ///
    /// ```text
    /// F = 1/h ∫ f dt,   τ = 1/h ∫ τ_0 dt + p × Aᵀ F                       (eq. 20)
    /// ```
    ///
    /// The force is in the world frame, the torque in the body frame.
    pub fn mean(&self, from: f64, to: f64, attitude: &Vector4<f64>) -> Wrench {
        let force = self.force.mean(from, to);
        let mut torque = self.torque.mean(from, to);
        if self.point != Vector3::zeros() {
            torque += self.point.cross(&(rotation(attitude).tr_mul(&force)));
        }
        Wrench { force, torque }
    }

    /// Derivative of the torque with respect to a rotation of the body, δτ = p × (Aᵀ F × δθ) (N m/rad).
    ///
    /// F is the mean force between the times `from` and `to` (s). `None` if the force acts at the centre
    /// of mass.
    #[cfg(feature = "save")]
    pub(crate) fn torque_by_turn(
        &self,
        [from, to]: [f64; 2],
        attitude: &Vector4<f64>,
    ) -> Option<nalgebra::Matrix3<f64>> {
        if self.point == Vector3::zeros() {
            return None;
        }
        let force = rotation(attitude).tr_mul(&self.force.mean(from, to));
        Some(self.point.cross_matrix() * force.cross_matrix())
    }
}

#[cfg(test)]
#[path = "tests/load.rs"]
mod tests;
