//! Velocities of the instant between intervals, and their errors.

use crate::mechanics::State;
use nalgebra::Vector3;

/// States of the instant, and the smoothness of the motion.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Instants {
    /// States at k, with the velocities of the instant.
    pub states: Vec<State>,
    /// Estimated errors e of the positions since the start (m).
    pub errors: Vec<f64>,
    /// Shares of dry friction in its limit along the axes of each joint in the last interval, with located impacts.
    pub axis_shares: Vec<[f64; 6]>,
    /// Motion of each body up to now, and before the last step.
    pub motions: Vec<Motion>,
    past: (Vec<f64>, Vec<Motion>),
}

/// Motion of a body since its last start or abrupt change of velocity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Motion {
    /// Time since the last impact (s).
    pub since: f64,
    /// The last kick, if the velocities did not change abruptly in it.
    pub last: Option<LastKick>,
    /// Accelerations in the last kick (m/s² and rad/s²), if they go on.
    pub acceleration: Option<[Vector3<f64>; 2]>,
    /// Second derivatives of velocity (m/s³) and spin (rad/s³), from two accelerations.
    pub jerk: Option<[Vector3<f64>; 2]>,
    /// Second half of the change of velocity (m/s) and spin (rad/s) by external forces in the last interval, if V is w⁺
    /// and lacks it.
    pub missing: [Vector3<f64>; 2],
}

/// Times since the change of velocity in an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct LastKick {
    /// Time from the middle of the kick to now (s).
    pub middle: f64,
    /// Time from the start of the interval to now (s).
    pub start: f64,
}

impl Instants {
    /// Start of bodies at `states`.
    pub(super) fn at(states: &[State]) -> Self {
        let bodies = states.len();
        let errors = vec![0.0; bodies];
        let motions = vec![Motion::default(); bodies];
        Self {
            states: states.to_vec(),
            errors: errors.clone(),
            axis_shares: Vec::new(),
            motions: motions.clone(),
            past: (errors, motions),
        }
    }

    /// True if the velocity of the instant of `body` is extrapolated.
    pub(super) fn is_extrapolated(&self, body: usize) -> bool {
        self.motions[body].acceleration.is_some()
    }

    /// True if `body` had an impact in the last interval, or has just started.
    pub(super) fn is_struck(&self, body: usize) -> bool {
        self.motions[body].since == 0.0
    }

    /// True if the acceleration of `body` is known in two intervals.
    pub(super) fn is_steady(&self, body: usize) -> bool {
        self.motions[body].jerk.is_some()
    }

    /// The last kick on `body`, if it was smooth.
    pub(super) fn last_kick(&self, body: usize) -> Option<LastKick> {
        self.motions[body].last
    }

    /// Takes the last step back, before which the velocities of the instant were those of `states`.
    pub(super) fn take_back(&mut self, states: &[State]) {
        self.states.clear();
        self.states.extend_from_slice(states);
        self.errors.clone_from(&self.past.0);
        self.motions.clone_from(&self.past.1);
    }

    /// Stores the errors and motions before an interval.
    pub(super) fn remember(&mut self) {
        self.past.0.clone_from(&self.errors);
        self.past.1.clone_from(&self.motions);
    }

    /// State from which `body` starts anew: V with the change by external forces that it lacks. Without it, each start
    /// after an abrupt change would lose half of an interval of gravity.
    pub(super) fn restart(&self, body: usize) -> State {
        let mut state = self.states[body];
        let [velocity, spin] = self.motions[body].missing;
        state.velocity += velocity;
        state.spin += spin;
        state
    }

    /// Sets the state of `body` as a start.
    pub(super) fn start(&mut self, body: usize, state: State) {
        self.states[body] = state;
        self.motions[body] = Motion::default();
    }

    /// True if this holds finite states of `bodies` bodies.
    #[cfg(feature = "save")]
    pub(super) fn fits(&self, bodies: usize) -> bool {
        let numbers = self.states.iter().map(State::to_vector);
        let numbers_of = [self.states.len(), self.errors.len(), self.past.0.len()];
        [numbers_of[0], numbers_of[1], numbers_of[2], self.motions.len(), self.past.1.len()]
            == [bodies; 5]
            && numbers.into_iter().all(|numbers| numbers.iter().all(|x| x.is_finite()))
    }

    /// Adds a body at the end.
    pub(super) fn push(&mut self, state: State) {
        self.states.push(state);
        self.errors.push(0.0);
        self.motions.push(Motion::default());
        self.past.0.push(0.0);
        self.past.1.push(Motion::default());
    }

    /// Removes the body `index`. Bodies after it move up by one.
    pub(super) fn remove(&mut self, index: usize) {
        self.states.remove(index);
        self.errors.remove(index);
        self.motions.remove(index);
        self.past.0.remove(index);
        self.past.1.remove(index);
    }
}

/// Largest errors of bodies in a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct AddedError {
    /// Estimate (40) of bodies in smooth motion, and of those with an abrupt change of velocity (m).
    pub smooth: f64,
    pub abrupt: f64,
    /// The latter of bodies whose velocity jumps (m).
    pub jumped: f64,
    /// Largest change of velocity where friction ends or turns a motion (m/s). It is the error of the velocity if
    /// the motion turns.
    pub turned: f64,
    /// Error of the velocity of the instant, from the change of the second differences (m/s).
    pub velocity: f64,
    /// Error of the velocity of an axis that breaks away (m/s), which no shorter interval has less.
    pub late: f64,
    /// True if a body moved by less than its error between two impacts: in the exact motion, they may
    /// come in the other order.
    pub is_ambiguous: bool,
}
