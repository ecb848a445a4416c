//! Points of the step's program and their conversion from solutions of the step.
//!
//! The program's variables (X⁺, f_x, f_y, f_z, s1, s2, λ) contain slacks and the multiplier λ in
//! addition to a step's solution. [`products`] computes them.

use super::layout::{self, Layout};
use nalgebra::{SVector, Vector3};
use tumble_core::contact::Plane;
use tumble_core::mechanics::State;
use tumble_core::step::StepSolution;

/// Point of the step problem: (X⁺, f_x, f_y, f_z, s1, s2, λ), 13 + 6n numbers in the order of
/// [`Layout`]. Forces are in the ground's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramPoint {
    layout: Layout,
    values: Vec<f64>,
}

impl ProgramPoint {
    /// Creates the zero vector.
    pub fn zeros(contacts: usize) -> Self {
        let layout = Layout::new(contacts);
        Self { layout, values: vec![0.0; layout.variables()] }
    }

    /// Creates the point `state` with all forces, slacks and multipliers zero.
    pub fn free(state: &State, contacts: usize) -> Self {
        let mut point = Self::zeros(contacts);
        point.set_free(state);
        point
    }

    /// Sets the point to `state` with all forces, slacks and multipliers zero.
    pub fn set_free(&mut self, state: &State) {
        self.values.fill(0.0);
        self.set_state(state);
    }

    /// Copies the point `other`.
    ///
    /// # Panics
    /// If `other` has another number of contacts.
    pub fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    /// Sets the point to a solution of a step on `ground`. The slacks are the smallest that satisfy
    /// the rows (14) and (15). λ satisfies (10) with the smoothing ε (N). `heights` are the end
    /// heights of the points, m. Contacts at points outside the program are skipped. A solution
    /// without a state changes nothing.
    pub fn set_solution(
        &mut self,
        solution: &StepSolution,
        ground: &Plane,
        heights: impl Fn(usize) -> f64,
        friction: f64,
        smoothing: f64,
    ) {
        let Some(state) = solution.states.first() else { return };
        self.set_free(state);
        let points = self.layout.contacts();
        for contact in solution.contacts.iter().filter(|contact| contact.key.point < points) {
            let point = contact.key.point;
            let force = ground.frame().tr_mul(&contact.force);
            let height = heights(point);
            let products = products(&force, contact.slip.norm(), height, friction, smoothing);
            self.set_contact(point, &force, &products);
        }
    }

    /// Sets X⁺.
    pub fn set_state(&mut self, state: &State) {
        self.values[layout::STATE].copy_from_slice(state.to_vector().as_slice());
    }

    /// Sets the force f_i (N, in the ground's frame), the slacks and λ of contact `i`.
    ///
    /// # Panics
    /// If there is no contact `i`.
    pub fn set_contact(&mut self, i: usize, force: &Vector3<f64>, products: &Products) {
        let [fx, fy, fz, s1, s2, slip] = self.layout.contact_variables(i);
        let x = &mut self.values;
        (x[fx], x[fy], x[fz]) = (force[0], force[1], force[2]);
        (x[s1], x[s2], x[slip]) = (products.normal, products.friction, products.slip_speed);
    }

    /// Offsets of the parts.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// All numbers.
    pub fn as_slice(&self) -> &[f64] {
        &self.values
    }

    /// All numbers, mutable.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// State X⁺.
    pub fn state(&self) -> State {
        State::from_vector(&SVector::from_column_slice(&self.values[layout::STATE]))
    }

    /// Force f_i of the ground on the body, N, in the ground's frame.
    ///
    /// # Panics
    /// If there is no contact `i`.
    pub fn force(&self, i: usize) -> Vector3<f64> {
        let [fx, fy, fz, ..] = self.layout.contact_variables(i);
        Vector3::new(self.values[fx], self.values[fy], self.values[fz])
    }
}

/// Least slacks and λ of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Products {
    /// s1 = max(0, f_z z⁺), N m: the least slack of row (14).
    pub normal: f64,
    /// s2 = max(0, λ (μ f_z − |f_xy|)), W: the least slack of row (15), without smoothing.
    pub friction: f64,
    /// λ, m/s: the slip speed where there is friction.
    pub slip_speed: f64,
}

/// Relative size of a difference below which it counts as zero, in units of rounding.
const ROUNDINGS: f64 = 16.0;

/// Slacks and λ of a contact with `force` (N, in its frame), `slip_speed` (m/s) and end `height`
/// (m). The height is zero below rounding. With ρ = √(f·f + ε²), ε being the `smoothing` (N),
///
/// ```text
/// c_xy + λ f_xy/ρ = 0  ⇒  λ = |c_xy| ρ/|f_xy|                              (eq. 10)
/// ```
pub fn products(
    force: &Vector3<f64>,
    slip_speed: f64,
    height: f64,
    friction: f64,
    smoothing: f64,
) -> Products {
    let tangential = force.xy().norm();
    let slip_speed = if tangential > 0.0 {
        slip_speed * libm::hypot(tangential, smoothing) / tangential
    } else {
        0.0
    };
    let room = friction * force[2] - tangential;
    let is_room = room > ROUNDINGS * f64::EPSILON * tangential;
    Products {
        normal: (force[2] * height).max(0.0),
        friction: if is_room { slip_speed * room } else { 0.0 },
        slip_speed,
    }
}
