//! The scheme of a box that stands on its edges and rocks in a plane, as a recurrence in one unknown.
//!
//! The box has the half sides a and c, turns about +y by the tilt φ, and stands on the edges
//! c_j = (±a, −c). Per unit mass, with ι = (a² + c²)/3 and A(φ), which turns (x, z):
//!
//! ```text
//! φ⁺ = φ + 2 atan(½ h ω⁺),   r⁺ = r + h v⁺,   P = Σ p_j = v⁺ − v + h g e_z
//! ι (w(ω⁺) − w(ω)) = Σ ρ_j × p_j,   ρ_j = A(φ) c_j,   (ρ × p) = ρ_z p_x − ρ_x p_z
//! ```
//!
//! (docs/validation.md, "Tall boxes and dominoes")

use crate::prelude::momentum;
use nalgebra::Vector2;

/// The box in its plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Planar {
    pub position: Vector2<f64>, // r, m: x and z
    pub tilt: f64,              // φ, rad
    pub velocity: Vector2<f64>, // v, m/s
    pub spin: f64,              // ω, rad/s
}

/// The step of a box on its edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edges {
    pub half_sides: Vector2<f64>, // a and c, m
    pub gravity: f64,
    pub friction: f64,
    pub time_step: f64, // h, s
}

const ROUNDS: usize = 6; // Newton iterations; three or four suffice

impl Edges {
    /// The state after a step; `None` if it is none of the above.
    pub fn step(&self, state: &Planar) -> Option<Planar> {
        // The front edge is at +a, the back edge at −a.
        let sides = [1.0, -1.0];
        let turned = sides.into_iter().find_map(|side| self.turn_on(state, side));
        turned.or_else(|| sides.into_iter().find_map(|side| self.land(state, side)))
    }

    /// ι, m².
    fn inertia(&self) -> f64 {
        self.half_sides.norm_squared() / 3.0
    }

    fn corner(&self, side: f64) -> Vector2<f64> {
        Vector2::new(side * self.half_sides.x, -self.half_sides.y)
    }

    fn place(&self, state: &Planar, side: f64) -> Vector2<f64> {
        state.position + turned(state.tilt, self.corner(side))
    }

    /// P, m/s.
    fn impulse(&self, before: &Planar, after: &Planar) -> Vector2<f64> {
        after.velocity - before.velocity + Vector2::new(0.0, self.gravity * self.time_step)
    }

    /// A step on the edge of `side`, which stays in its place: Newton's method for ω⁺ from ω.
    fn turn_on(&self, state: &Planar, side: f64) -> Option<Planar> {
        let (h, corner) = (self.time_step, self.corner(side));
        let foot = Vector2::new(self.place(state, side).x, 0.0);
        let lever = turned(state.tilt, corner);
        let mut after = *state;
        for _ in 0..ROUNDS {
            let half = 0.5 * h * after.spin;
            after.tilt = state.tilt + 2.0 * half.atan();
            after.position = foot - turned(after.tilt, corner);
            after.velocity = (after.position - state.position) / h;
            let torque = cross(lever, self.impulse(state, &after));
            // ∂φ⁺/∂ω⁺ = h/(1 + (½ h ω⁺)²)
            let change = -turned_slope(after.tilt, corner) / (1.0 + half * half);
            let (turning, slope) = momentum(h, after.spin);
            let residual = self.inertia() * (turning - momentum(h, state.spin).0) - torque;
            after.spin -= residual / (self.inertia() * slope - cross(lever, change));
        }
        let p = self.impulse(state, &after);
        let held = p.y >= 0.0 && p.x.abs() <= self.friction * p.y;
        (held && self.place(&after, -side).y >= 0.0).then_some(after)
    }

    /// A step that ends on both edges, φ⁺ = 0. The one of `side` sticks, the other one slips.
    fn land(&self, state: &Planar, side: f64) -> Option<Planar> {
        let h = self.time_step;
        let x = self.place(state, side).x - self.corner(side).x;
        let position = Vector2::new(x, self.half_sides.y);
        let velocity = (position - state.position) / h;
        let spin = -2.0 / h * (0.5 * state.tilt).tan();
        let after = Planar { position, tilt: 0.0, velocity, spin };

        let p = self.impulse(state, &after);
        let slip = self.place(&after, -side).x - self.place(state, -side).x;
        // The slipping edge has γ (σ, 1), the sticking one the rest of P.
        let slipping = Vector2::new(-self.friction * slip.signum(), 1.0);
        let [held_lever, slipping_lever] =
            [side, -side].map(|side| turned(state.tilt, self.corner(side)));
        let torque = self.inertia() * (momentum(h, spin).0 - momentum(h, state.spin).0);
        let normal = (torque - cross(held_lever, p)) / cross(slipping_lever - held_lever, slipping);
        let held = p - normal * slipping;
        let lawful = normal >= 0.0 && held.y >= 0.0 && held.x.abs() <= self.friction * held.y;
        lawful.then_some(after)
    }
}

/// A(φ) c: (x cos φ + z sin φ, z cos φ − x sin φ).
pub(crate) fn turned(tilt: f64, c: Vector2<f64>) -> Vector2<f64> {
    let (sin, cos) = tilt.sin_cos();
    Vector2::new(c.x * cos + c.y * sin, c.y * cos - c.x * sin)
}

/// ∂(A(φ) c)/∂φ.
fn turned_slope(tilt: f64, c: Vector2<f64>) -> Vector2<f64> {
    let (sin, cos) = tilt.sin_cos();
    Vector2::new(c.y * cos - c.x * sin, -c.x * cos - c.y * sin)
}

/// ρ × p about +y.
pub(crate) fn cross(lever: Vector2<f64>, p: Vector2<f64>) -> f64 {
    lever.y * p.x - lever.x * p.y
}
