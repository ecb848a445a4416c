//! Start and end points of Ipopt, stored by body and candidate. This form is independent of the
//! program's layout.

use super::posed::PosedProgram;
use super::units::ProgramUnits;
use crate::step_nlp::point::products;
use crate::step_nlp::{ProgramPoint, SMOOTHING};
use nalgebra::Vector3;
use tumble_core::contact::{Contact, KeyIndex, Partner};
use tumble_core::mechanics::quaternion::advance;
use tumble_core::mechanics::{Pose, State};
use tumble_core::step::{ContactForce, Step, StepSolution};

/// Values of a contact in the program's units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ContactValues {
    /// Force f in the contact frame.
    pub(super) force: Vector3<f64>,
    /// Slacks s1 and s2, and multiplier λ.
    pub(super) normal_slack: f64,
    pub(super) friction_slack: f64,
    pub(super) slip_speed: f64,
}

/// A point: X⁺ of every body (SI) and the values of every candidate (program units).
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct ProgramStart {
    pub(super) states: Vec<State>,
    pub(super) values: Vec<ContactValues>,
    /// All variables of the tutorial's program, including points that are not candidates. Ipopt
    /// relaxes the bounds of clamped variables if few are free; the next start keeps the resulting
    /// values.
    pub(super) whole: Vec<f64>,
}

impl ProgramStart {
    /// Sets `states` and zero contact values.
    pub(super) fn reset(&mut self, states: &[State], candidates: usize) {
        self.states.clear();
        self.states.extend_from_slice(states);
        self.values.clear();
        self.values.resize(candidates, ContactValues::default());
        self.whole.clear();
    }

    /// Sets X of step k, and the contact values of the last solution. `known` is that solution as a
    /// point.
    pub(super) fn set_previous(
        &mut self,
        step: &Step<'_>,
        candidates: &[Contact],
        known: Option<&Self>,
        units: &ProgramUnits,
    ) {
        self.reset(step.states, candidates.len());
        let before = &step.previous.contacts;
        let mut index = KeyIndex::new();
        self.whole.extend(known.iter().flat_map(|known| &known.whole));
        for (place, contact) in candidates.iter().enumerate() {
            let Some(at) = index.place(before, &contact.key, place) else { continue };
            self.values[place] = match known.and_then(|known| known.values.get(at)) {
                Some(values) => *values,
                None => values_of(contact, &before[at], contact.gap, units),
            };
        }
    }

    /// Sets a point of the tutorial's program (SI).
    pub(super) fn set_point(
        &mut self,
        candidates: &[Contact],
        point: &ProgramPoint,
        units: &ProgramUnits,
    ) {
        self.reset(&[point.state()], candidates.len());
        let x = point.as_slice();
        self.whole.extend_from_slice(x);
        for (contact, slot) in candidates.iter().zip(&mut self.values) {
            let i = contact.key.point;
            let [.., s1, s2, slip_speed] = point.layout().contact_variables(i);
            *slot = ContactValues {
                force: point.force(i),
                normal_slack: x[s1],
                friction_slack: x[s2],
                slip_speed: x[slip_speed],
            };
            slot.convert(units);
        }
    }

    /// Moves the states of the `posed` bodies from step k by one step at their own velocities.
    /// Steadily sliding bodies are then at their solution.
    pub(super) fn coast(&mut self, step: &Step<'_>, posed: &PosedProgram) {
        let h = step.world.time_step();
        for &body in &posed.bodies {
            let state = &mut self.states[body];
            state.position += h * state.velocity;
            state.attitude = advance(&state.attitude, &state.spin, h);
        }
    }

    /// Sets a solution of `step`.
    pub(super) fn set_solution(
        &mut self,
        step: &Step<'_>,
        candidates: &[Contact],
        solution: &StepSolution,
        units: &ProgramUnits,
    ) {
        self.reset(&solution.states, candidates.len());
        let poses = ProgramPoses::of(step.states, &solution.states);
        for ((contact, force), slot) in
            candidates.iter().zip(&solution.contacts).zip(&mut self.values)
        {
            *slot = values_of(contact, force, poses.gap(contact), units);
        }
    }

    /// Sets free flight with each body's weight shared by its contacts in `posed`.
    pub(super) fn share_weight(
        &mut self,
        step: &Step<'_>,
        candidates: &[Contact],
        posed: &PosedProgram,
        units: &ProgramUnits,
    ) {
        self.reset(step.free, candidates.len());
        for &index in &posed.contacts {
            let body = candidates[index].key.body;
            let own = posed.contacts.iter().filter(|&&other| candidates[other].key.body == body);
            let weight = step.world.bodies()[body].mass() * step.world.gravity().norm();
            self.values[index].force[2] = weight / units.force() / own.count() as f64;
        }
    }

    /// Writes this point to `solution`.
    pub(super) fn write(
        &self,
        step: &Step<'_>,
        candidates: &[Contact],
        units: &ProgramUnits,
        solution: &mut StepSolution,
    ) {
        solution.set_free(&self.states);
        let (poses, h) = (ProgramPoses::of(step.states, &self.states), step.world.time_step());
        solution.contacts.extend(candidates.iter().enumerate().map(|(place, contact)| {
            let values = self.values.get(place).copied().unwrap_or_default();
            let force = values.force * units.force();
            let (normal, u) = (contact.normal(), poses.motion(contact, h));
            ContactForce {
                key: contact.key,
                force: contact.frame * force,
                normal_force: force[2],
                slip: u - normal * normal.dot(&u),
            }
        }));
    }
}

/// Values of a contact with `force` and the end gap `gap` (m).
fn values_of(
    contact: &Contact,
    force: &ContactForce,
    gap: f64,
    units: &ProgramUnits,
) -> ContactValues {
    let local = contact.frame.tr_mul(&force.force);
    let (friction, smoothing) = (contact.law.friction, SMOOTHING * units.force());
    let products = products(&local, force.slip.norm(), gap, friction, smoothing);
    let mut values = ContactValues {
        force: local,
        normal_slack: products.normal,
        friction_slack: products.friction,
        slip_speed: products.slip_speed,
    };
    values.convert(units);
    values
}

impl ContactValues {
    /// Converts from SI units to `units`.
    fn convert(&mut self, units: &ProgramUnits) {
        self.force /= units.force();
        self.normal_slack /= units.force() * units.length();
        self.friction_slack /= units.force() * units.speed();
        self.slip_speed /= units.speed();
    }
}

/// Poses of all bodies at both ends of a step.
pub(super) struct ProgramPoses(Vec<(Pose, Pose)>);

impl ProgramPoses {
    pub(super) fn of(states: &[State], next: &[State]) -> Self {
        Self(states.iter().zip(next).map(|(state, next)| (state.pose(), next.pose())).collect())
    }

    fn partner(&self, contact: &Contact) -> Option<&(Pose, Pose)> {
        match contact.key.partner {
            Partner::Body(index) => Some(&self.0[index]),
            Partner::Ground | Partner::Fixed(_) => None,
        }
    }

    /// Gap φ⁺ of a contact at the end of the step, m.
    pub(super) fn gap(&self, contact: &Contact) -> f64 {
        contact.gap_at(&self.0[contact.key.body].1, self.partner(contact).map(|b| &b.1))
    }

    /// Mean relative motion u of a contact over the step, m/s.
    fn motion(&self, contact: &Contact, h: f64) -> Vector3<f64> {
        let a = &self.0[contact.key.body];
        contact.motion([&a.0, &a.1], self.partner(contact).map(|b| [&b.0, &b.1]), h)
    }
}
