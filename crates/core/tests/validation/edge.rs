//! The scheme of boxes that turn on their edges in a plane: one that rocks, and one that falls on another.
//!
//! The box has the half sides a and c and stands on the edges c_j = (±a, −c). It turns about +y by
//! the tilt φ, and A(φ) rotates (x, z). Per unit mass, with ι = (a² + c²)/3:
//!
//! ```text
//! φ⁺ = φ + 2 atan(½ h ω⁺),   r⁺ = r + h v⁺,   P = Σ p_j = v⁺ − v + h g e_z
//! ι (w(ω⁺) − w(ω)) = Σ ρ_j × p_j,   ρ_j = A(φ) c_j,   (ρ × p) = ρ_z p_x − ρ_x p_z
//! ```
//!
//! (docs/validation.md, "Tall boxes and dominoes")

use crate::prelude::*;
use nalgebra::Matrix3;

/// The box in its plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Planar {
    pub position: Vector2<f64>, // r, m: x and z
    pub tilt: f64,              // φ, rad
    pub velocity: Vector2<f64>, // v, m/s
    pub spin: f64,              // ω, rad/s
}

impl Planar {
    /// The planar motion of a body.
    pub fn from_state(state: &State) -> Self {
        let (position, velocity) = (state.position.xz(), state.velocity.xz());
        Self { position, tilt: tilt(state), velocity, spin: state.spin[1] }
    }

    /// The point `c` of the box.
    fn point(&self, c: Vector2<f64>) -> Vector2<f64> {
        self.position + turned(self.tilt, c)
    }

    /// The state after a step of `h` with the spin `spin` at its end and the point `c` at `foot`.
    fn turned_on(&self, c: Vector2<f64>, foot: Vector2<f64>, spin: f64, h: f64) -> Self {
        let tilt = self.tilt + turn(h, spin).0;
        let position = foot - turned(tilt, c);
        Self { position, tilt, velocity: (position - self.position) / h, spin }
    }
}

/// The tilt about the y axis, rad.
pub(crate) fn tilt(state: &State) -> f64 {
    angle_about(1, state)
}

/// Boxes on their edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edges {
    pub half_sides: Vector2<f64>, // a and c, m
    pub gravity: f64,
    pub friction: f64,
    pub time_step: f64, // h, s
}

const ROUNDS: usize = 6; // Newton iterations for one box; three or four suffice
const PAIR_ROUNDS: usize = 40; // Newton iterations for two, with differences for derivatives

impl Edges {
    /// The state after a step; `None` if no edge holds.
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

    /// The edge c_j of `side`, 1 in front and −1 at the back.
    pub fn corner(&self, side: f64) -> Vector2<f64> {
        Vector2::new(side * self.half_sides.x, -self.half_sides.y)
    }

    fn place(&self, state: &Planar, side: f64) -> Vector2<f64> {
        state.point(self.corner(side))
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
            after = state.turned_on(corner, foot, after.spin, h);
            let torque = cross(lever, self.impulse(state, &after));
            let change = -turned_slope(after.tilt, corner) * (turn(h, after.spin).1 / h);
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

    /// The distance of the first box's upper front edge from the second one's face, m.
    pub fn apart(&self, [first, second]: &[Planar; 2]) -> f64 {
        let edge = first.point(self.half_sides) - second.position;
        -turned(-second.tilt, edge).x - self.half_sides.x
    }

    /// A step of two boxes on their front edges that ends with the first one's upper edge on the second
    /// one's face: Newton's method for ω₁⁺, ω₂⁺ and the impulse P between them.
    pub fn step_pair(&self, before: &[Planar; 2]) -> [Planar; 2] {
        let mut unknown = v3(before[0].spin, before[1].spin, 0.0);
        for _ in 0..PAIR_ROUNDS {
            let mut slopes = Matrix3::zeros();
            for j in 0..3 {
                let size = 1e-6 * (1.0 + unknown[j].abs());
                let moved = |sign: f64| {
                    let mut moved = unknown;
                    moved[j] += sign * size;
                    self.missed(before, &moved)
                };
                slopes.set_column(j, &((moved(1.0) - moved(-1.0)) / (2.0 * size)));
            }
            let Some(change) = slopes.lu().solve(&self.missed(before, &unknown)) else { break };
            unknown -= change;
        }
        self.turned_pair(before, &unknown)
    }

    /// Both boxes turned on their front edges with the spins ω₁⁺ and ω₂⁺.
    fn turned_pair(&self, before: &[Planar; 2], unknown: &Vector3<f64>) -> [Planar; 2] {
        [0, 1].map(|j| {
            let foot = Vector2::new(self.place(&before[j], 1.0).x, 0.0);
            before[j].turned_on(self.corner(1.0), foot, unknown[j], self.time_step)
        })
    }

    /// The residuals of the two torques and the gap for (ω₁⁺, ω₂⁺, P). P is normal to the second one's face
    /// at the start; the rest of the impulse acts at the feet.
    fn missed(&self, before: &[Planar; 2], unknown: &Vector3<f64>) -> Vector3<f64> {
        let after = self.turned_pair(before, unknown);
        let edge = before[0].point(self.half_sides);
        let push = turned(before[1].tilt, Vector2::new(-unknown[2], 0.0));
        let torque = |j: usize, push: Vector2<f64>| {
            let (old, new) = (&before[j], &after[j]);
            let held = self.impulse(old, new) - push;
            let [before, after] = [old, new].map(|state| momentum(self.time_step, state.spin).0);
            self.inertia() * (after - before)
                - cross(turned(old.tilt, self.corner(1.0)), held)
                - cross(edge - old.position, push)
        };
        v3(torque(0, push), torque(1, -push), self.apart(&after) / self.time_step)
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
fn cross(lever: Vector2<f64>, p: Vector2<f64>) -> f64 {
    lever.y * p.x - lever.x * p.y
}
