//! Bars in a plane with pins, as a problem poses them and as the step moves them, written out once more for two dimensions.

use super::axis::momentum;
use super::prelude::*;
use crate::error::Error;
use crate::joint::{Drive, Joint, JointFrame};
use nalgebra::{DMatrix, DVector};

/// Nothing comes near the ground, m.
pub(super) const HEIGHT: f64 = 2.0;
/// Enough for the pins of a step to settle to the last digit.
const ROUNDS: usize = 12;

/// Which plane it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Plane {
    /// x and y.
    Level,
    /// x and z.
    Upright,
}

/// A body: kg, kg m².
#[derive(Debug, Clone, Copy)]
pub(super) struct Bar {
    pub mass: f64,
    pub moment: f64,
}

/// Holds the point `at` of body `a` (m, from its centre, along its axes) on the point `there` of body `b`, or of the plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pin {
    pub a: usize,
    pub at: Vector2<f64>,
    pub b: Option<usize>,
    pub there: Vector2<f64>,
}

/// Where a body is and how it moves: m, rad; m/s, rad/s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placed {
    pub place: Vector2<f64>,
    pub angle: f64,
    pub velocity: Vector2<f64>,
    pub spin: f64,
}

impl Placed {
    /// At rest.
    pub fn at(place: Vector2<f64>, angle: f64) -> Self {
        Self { place, angle, velocity: Vector2::zeros(), spin: 0.0 }
    }

    /// From its centre to its point `at`, in the plane's axes.
    fn lever(&self, at: &Vector2<f64>) -> Vector2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        Vector2::new(cos * at[0] - sin * at[1], sin * at[0] + cos * at[1])
    }

    /// Its point `at`.
    pub fn point(&self, at: &Vector2<f64>) -> Vector2<f64> {
        self.place + self.lever(at)
    }
}

/// What acts on a body from outside: N, N m.
pub(super) type Load = (Vector2<f64>, f64);

/// Bars and pins.
#[derive(Debug, Clone)]
pub(super) struct Planar {
    pub plane: Plane,
    pub bars: Vec<Bar>,
    pub pins: Vec<Pin>,
    pub start: Vec<Placed>,
}

/// A quarter turn.
fn across(v: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v[1], v[0])
}

impl Planar {
    /// The problem's bodies and its joints, hinges in the order of the pins.
    pub fn posed(&self) -> Result<(Vec<Subject>, Vec<Joint>), Unsuitable> {
        let out: Vector3<f64> = match self.plane {
            Plane::Level => Vector3::z(),
            Plane::Upright => -Vector3::y(),
        };
        let in_body = |v: &Vector2<f64>| match self.plane {
            Plane::Level => Vector3::new(v[0], v[1], 0.0),
            Plane::Upright => Vector3::new(v[0], 0.0, v[1]),
        };
        let in_world = |v: &Vector2<f64>| in_body(v) + Vector3::z() * HEIGHT;
        let subjects =
            self.bars.iter().zip(&self.start).enumerate().map(|(index, (bar, start))| {
                let of_a = self.pins.iter().filter(|pin| pin.a == index).map(|pin| pin.at);
                let of_b = self.pins.iter().filter(|pin| pin.b == Some(index)).map(|pin| pin.there);
                let points: Vec<_> = of_a.chain(of_b).map(|at| in_body(&at)).collect();
                let inertia = nalgebra::Matrix3::from_diagonal_element(bar.moment);
                let (sin, cos) = (0.5 * start.angle).sin_cos();
                let state = State {
                    position: in_world(&start.place),
                    attitude: Vector4::new(cos, out[0] * sin, out[1] * sin, out[2] * sin),
                    velocity: in_body(&start.velocity),
                    spin: out * start.spin,
                };
                Ok(Subject::new(RigidBody::new(bar.mass, inertia, &points)?, state))
            });
        let joints = self.pins.iter().map(|pin| {
            let there = match pin.b {
                Some(_) => in_body(&pin.there),
                None => in_world(&pin.there),
            };
            let frames =
                [JointFrame::along(in_body(&pin.at), out)?, JointFrame::along(there, out)?];
            Ok(Joint::revolute(pin.a, pin.b, frames, Drive::NONE))
        });
        Ok((subjects.collect::<Result<_, Unsuitable>>()?, joints.collect::<Result<_, Error>>()?))
    }

    /// How fast bodies at rest become under `loads`, m/s² and rad/s²: with the forces λ of the pins,
    ///
    /// ```text
    /// J M⁻¹ Jᵀ λ = −J M⁻¹ f,   a = M⁻¹ (f + Jᵀ λ)
    /// ```
    pub fn accelerations(&self, loads: &[Load]) -> Vec<(Vector2<f64>, f64)> {
        let bars = self.bars.iter().zip(loads);
        let free: Vec<_> =
            bars.map(|(bar, (force, torque))| (force / bar.mass, torque / bar.moment)).collect();
        let mut gaps = DVector::zeros(2 * self.pins.len());
        for (k, pin) in self.pins.iter().enumerate() {
            let of = |body: usize, at: &Vector2<f64>| {
                free[body].0 + across(&self.start[body].lever(at)) * free[body].1
            };
            let apart = of(pin.a, &pin.at) - pin.b.map_or(Vector2::zeros(), |b| of(b, &pin.there));
            gaps.fixed_rows_mut::<2>(2 * k).copy_from(&apart);
        }
        let response = self.response(
            (&self.start, &self.start),
            |bar| (1.0 / bar.mass, 1.0 / bar.moment),
            |_| 1.0,
        );
        let forces =
            response.lu().solve(&-gaps).unwrap_or_else(|| DVector::zeros(2 * self.pins.len()));
        let pinned = self.pinned(&self.start, &forces);
        let bars = self.bars.iter().zip(free).zip(pinned);
        bars.map(|((bar, (along, about)), (force, torque))| {
            (along + force / bar.mass, about + torque / bar.moment)
        })
        .collect()
    }

    /// What the forces of the pins do to the bodies at `now`.
    fn pinned(&self, now: &[Placed], forces: &DVector<f64>) -> Vec<Load> {
        let mut loads = vec![(Vector2::zeros(), 0.0); now.len()];
        for (k, pin) in self.pins.iter().enumerate() {
            let force = Vector2::new(forces[2 * k], forces[2 * k + 1]);
            let sides = [(Some(pin.a), &pin.at, force), (pin.b, &pin.there, -force)];
            for (body, at, force) in sides {
                let Some(body) = body else { continue };
                loads[body].0 += force;
                loads[body].1 += now[body].lever(at).perp(&force);
            }
        }
        loads
    }

    /// How the points of all pins at `next` move by forces of all pins at `now`: a body moves by the first number of `gives` along a
    /// unit force, and turns by the second one and its share `left` about a unit torque.
    fn response(
        &self,
        (now, next): (&[Placed], &[Placed]),
        gives: impl Fn(&Bar) -> (f64, f64),
        left: impl Fn(usize) -> f64,
    ) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(2 * self.pins.len(), 2 * self.pins.len());
        let sides = |pin: &Pin| [(Some(pin.a), pin.at, 1.0), (pin.b, pin.there, -1.0)];
        for (row, of) in self.pins.iter().enumerate() {
            for (column, by) in self.pins.iter().enumerate() {
                let mut block = nalgebra::Matrix2::zeros();
                for (body, at, sign) in sides(of) {
                    for (other, there, opposite) in sides(by) {
                        let Some(body) = body.filter(|body| other == Some(*body)) else { continue };
                        let (along, about) = gives(&self.bars[body]);
                        let moved = across(&next[body].lever(&at));
                        let pushed = across(&now[body].lever(&there));
                        let turned = moved * pushed.transpose() * (about * left(body));
                        let shifted = nalgebra::Matrix2::identity() * along;
                        block += (shifted + turned) * (sign * opposite);
                    }
                }
                matrix.fixed_view_mut::<2, 2>(2 * row, 2 * column).copy_from(&block);
            }
        }
        matrix
    }

    /// The bodies at the start and after each of so many steps of `h` (s), the `loads` being those of where they are at a
    /// step's start:
    ///
    /// ```text
    /// v⁺ = v + h F/m,   r⁺ = r + h v⁺,
    /// I (w(ω⁺) − w(ω)) = h T,   φ⁺ = φ + 2 atan ½hω⁺,   w(ω) = ω (1 + (½ h ω)²)
    /// ```
    ///
    /// F and T being with the forces of the pins, which act where these are at the step's start and are such that they
    /// hold at its end.
    pub fn steps(
        &self,
        h: f64,
        count: usize,
        loads: impl Fn(&[Placed]) -> Vec<Load>,
    ) -> Vec<Vec<Placed>> {
        let mut all = vec![self.start.clone()];
        let mut forces = DVector::zeros(2 * self.pins.len());
        for k in 0..count {
            let now = &all[k];
            let outside = loads(now);
            let mut next = now.clone();
            for _ in 0..ROUNDS {
                let pinned = self.pinned(now, &forces);
                for (body, bar) in self.bars.iter().enumerate() {
                    let (force, torque) =
                        (outside[body].0 + pinned[body].0, outside[body].1 + pinned[body].1);
                    let before = &now[body];
                    let wanted = momentum(h, before.spin).0 + h * torque / bar.moment;
                    let velocity = before.velocity + force * (h / bar.mass);
                    let mut spin = next[body].spin;
                    for _ in 0..ROUNDS {
                        let (has, slope) = momentum(h, spin);
                        spin -= (has - wanted) / slope;
                    }
                    next[body] = Placed {
                        place: before.place + velocity * h,
                        angle: before.angle + 2.0 * (0.5 * h * spin).atan(),
                        velocity,
                        spin,
                    };
                }
                let mut gaps = DVector::zeros(2 * self.pins.len());
                for (k, pin) in self.pins.iter().enumerate() {
                    let there = pin.b.map_or(pin.there, |b| next[b].point(&pin.there));
                    gaps.fixed_rows_mut::<2>(2 * k)
                        .copy_from(&(next[pin.a].point(&pin.at) - there));
                }
                let settled = gaps.amax() < 4.0 * f64::EPSILON;
                // dφ⁺/dT of dω⁺/dT = h/(I (1 + 3θ²)), dφ⁺/dω⁺ = h/(1 + θ²).
                let turns = |body: usize| {
                    let square = (0.5 * h * next[body].spin).powi(2);
                    1.0 / ((1.0 + 3.0 * square) * (1.0 + square))
                };
                let gives = |bar: &Bar| (h * h / bar.mass, h * h / bar.moment);
                let response = self.response((now, &next), gives, turns);
                let Some(change) = response.lu().solve(&gaps) else { break };
                forces -= change;
                if settled {
                    break;
                }
            }
            all.push(next);
        }
        all
    }

    /// ½ Σ m v² + I w(ω)², J: of bodies that move so in steps of `h` (s).
    pub fn kinetic(&self, at: &[Placed], h: f64) -> f64 {
        let each = self.bars.iter().zip(at).map(|(bar, at)| {
            bar.mass * at.velocity.norm_squared() + bar.moment * momentum(h, at.spin).0.powi(2)
        });
        0.5 * each.sum::<f64>()
    }

    /// A body of the problem as one in the plane, its angle nearest to `near` (rad).
    pub fn seen(&self, state: &State, near: f64) -> Placed {
        let (r, v, q) = (&state.position, &state.velocity, &state.attitude);
        let (place, velocity, half, spin) = match self.plane {
            Plane::Level => {
                (Vector2::new(r[0], r[1]), Vector2::new(v[0], v[1]), q[3], state.spin[2])
            }
            Plane::Upright => {
                (Vector2::new(r[0], r[2]), Vector2::new(v[0], v[2]), -q[2], -state.spin[1])
            }
        };
        let lift = match self.plane {
            Plane::Level => Vector2::zeros(),
            Plane::Upright => Vector2::new(0.0, HEIGHT),
        };
        let angle = 2.0 * half.atan2(q[0]);
        let turn = std::f64::consts::TAU;
        let angle = angle + turn * ((near - angle) / turn).round();
        Placed { place: place - lift, angle, velocity, spin }
    }

    /// All bodies in all states of `run`, angles counted on.
    pub fn track(&self, run: &Run) -> Vec<Vec<Placed>> {
        let mut all: Vec<Vec<Placed>> = Vec::new();
        for k in 0..=run.steps() {
            let near =
                |body: usize| all.last().map_or(self.start[body].angle, |last| last[body].angle);
            let now = (0..self.bars.len()).map(|b| self.seen(&run.states(b)[k], near(b))).collect();
            all.push(now);
        }
        all
    }
}
