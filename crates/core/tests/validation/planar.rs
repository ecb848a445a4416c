//! Planar linkages: the bodies and joints of a setup, and the scheme in two dimensions.

use crate::prelude::*;
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3};

const HEIGHT: f64 = 2.0; // The plane's origin above the ground, m
const ROUNDS: usize = 12; // Newton iterations until a step settles to the last digit

/// The plane of the linkage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlanarSurface {
    /// x and y.
    Level,
    /// x and z.
    Upright,
}

/// A body: kg, kg m².
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bar {
    pub mass: f64,
    pub moment: f64,
}

/// Holds the point `at` of body `a` (m, body axes) on the point `there` of body `b`, or of the plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlanarPin {
    pub a: usize,
    pub at: Vector2<f64>,
    pub b: Option<usize>,
    pub there: Vector2<f64>,
}

impl PlanarPin {
    /// Both sides: body, point, and the sign of the force.
    fn sides(&self) -> [(Option<usize>, Vector2<f64>, f64); 2] {
        [(Some(self.a), self.at, 1.0), (self.b, self.there, -1.0)]
    }

    /// The distance vector of the pinned points.
    pub fn gap(&self, bodies: &[PlanarBody]) -> Vector2<f64> {
        let there = self.b.map_or(self.there, |b| bodies[b].point(&self.there));
        bodies[self.a].point(&self.at) - there
    }
}

/// The planar state of a body in m, rad, m/s and rad/s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlanarBody {
    pub place: Vector2<f64>,
    pub angle: f64,
    pub velocity: Vector2<f64>,
    pub spin: f64,
}

impl PlanarBody {
    /// A body at rest.
    pub fn at(place: Vector2<f64>, angle: f64) -> Self {
        Self { place, angle, velocity: Vector2::zeros(), spin: 0.0 }
    }

    /// The vector from the centre to the point `at`, in the plane's axes.
    fn lever(&self, at: &Vector2<f64>) -> Vector2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        Vector2::new(cos * at[0] - sin * at[1], sin * at[0] + cos * at[1])
    }

    /// The point `at`.
    pub fn point(&self, at: &Vector2<f64>) -> Vector2<f64> {
        self.place + self.lever(at)
    }
}

/// An external load on a body: N, N m.
pub(crate) type PlanarLoad = (Vector2<f64>, f64);

/// Bars and pins.
#[derive(Debug, Clone)]
pub(crate) struct Linkage {
    pub plane: PlanarSurface,
    pub bars: Vec<Bar>,
    pub pins: Vec<PlanarPin>,
    pub start: Vec<PlanarBody>,
}

/// A quarter turn.
fn across(v: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v[1], v[0])
}

impl Linkage {
    /// A setup of the linkage; its joints are hinges in the order of the pins.
    pub fn setup(&self, gravity: f64, duration: f64) -> Result<Setup, Refusal> {
        let out: Vector3<f64> = match self.plane {
            PlanarSurface::Level => Vector3::z(),
            PlanarSurface::Upright => -Vector3::y(),
        };
        let in_body = |v: &Vector2<f64>| match self.plane {
            PlanarSurface::Level => v3(v[0], v[1], 0.0),
            PlanarSurface::Upright => v3(v[0], 0.0, v[1]),
        };
        let in_world = |v: &Vector2<f64>| in_body(v) + Vector3::z() * HEIGHT;
        let subjects = self.bars.iter().zip(&self.start).enumerate().map(|(k, (bar, start))| {
            let of_a = self.pins.iter().filter(|pin| pin.a == k).map(|pin| pin.at);
            let of_b = self.pins.iter().filter(|pin| pin.b == Some(k)).map(|pin| pin.there);
            let points: Vec<_> = of_a.chain(of_b).map(|at| in_body(&at)).collect();
            let inertia = Matrix3::from_diagonal_element(bar.moment);
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
            let there = if pin.b.is_some() { in_body(&pin.there) } else { in_world(&pin.there) };
            hinge(pin.a, pin.b, [in_body(&pin.at), there], out, Drive::NONE)
        });
        let joints = joints.collect::<Result<_, Error>>()?;
        let bodies = subjects.collect::<Result<_, Error>>()?;
        Ok(Setup { joints, ..Setup::new(bodies, gravity, 0.5, duration) })
    }

    /// The accelerations at rest under `loads`, a = M⁻¹ (f + Jᵀ λ) with J M⁻¹ Jᵀ λ = −J M⁻¹ f, m/s² and
    /// rad/s².
    pub fn accelerations(&self, loads: &[PlanarLoad]) -> Vec<(Vector2<f64>, f64)> {
        let bars = self.bars.iter().zip(loads);
        let free: Vec<_> =
            bars.map(|(bar, (force, torque))| (force / bar.mass, torque / bar.moment)).collect();
        let apart = self.stacked(|pin| {
            let of = |body: usize, at: &Vector2<f64>| {
                free[body].0 + across(&self.start[body].lever(at)) * free[body].1
            };
            of(pin.a, &pin.at) - pin.b.map_or(Vector2::zeros(), |b| of(b, &pin.there))
        });
        let compliance = |body: usize| {
            let bar = &self.bars[body];
            (1.0 / bar.mass, 1.0 / bar.moment)
        };
        let response = self.response(&self.start, &self.start, compliance);
        let forces = response.lu().solve(&-&apart).unwrap_or(apart * f64::NAN);
        let pinned = self.pinned(&self.start, &forces);
        let bars = self.bars.iter().zip(free).zip(pinned);
        bars.map(|((bar, (along, about)), (force, torque))| {
            (along + force / bar.mass, about + torque / bar.moment)
        })
        .collect()
    }

    /// A vector for each pin, stacked.
    fn stacked(&self, of: impl Fn(&PlanarPin) -> Vector2<f64>) -> DVector<f64> {
        let each = self.pins.iter().map(of);
        DVector::from_iterator(2 * self.pins.len(), each.flat_map(|v| [v[0], v[1]]))
    }

    /// The loads of the pins' forces on the bodies.
    fn pinned(&self, now: &[PlanarBody], forces: &DVector<f64>) -> Vec<PlanarLoad> {
        let mut loads = vec![(Vector2::zeros(), 0.0); now.len()];
        for (k, pin) in self.pins.iter().enumerate() {
            for (body, at, sign) in pin.sides() {
                let Some(body) = body else { continue };
                let force = Vector2::new(forces[2 * k], forces[2 * k + 1]) * sign;
                loads[body].0 += force;
                loads[body].1 += now[body].lever(&at).perp(&force);
            }
        }
        loads
    }

    /// The derivative of the pins' gaps at `next` by their forces at `now`. `compliance` of a body
    /// holds its displacement by a unit force and its rotation by a unit torque.
    fn response(
        &self,
        now: &[PlanarBody],
        next: &[PlanarBody],
        compliance: impl Fn(usize) -> (f64, f64),
    ) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(2 * self.pins.len(), 2 * self.pins.len());
        for (row, of) in self.pins.iter().enumerate() {
            for (column, by) in self.pins.iter().enumerate() {
                let mut block = Matrix2::zeros();
                for (body, at, sign) in of.sides() {
                    for (other, there, opposite) in by.sides() {
                        let Some(body) = body.filter(|body| other == Some(*body)) else { continue };
                        let (along, about) = compliance(body);
                        let moved = across(&next[body].lever(&at));
                        let pushed = across(&now[body].lever(&there));
                        let turned = moved * pushed.transpose() * about;
                        block += (Matrix2::identity() * along + turned) * (sign * opposite);
                    }
                }
                matrix.fixed_view_mut::<2, 2>(2 * row, 2 * column).copy_from(&block);
            }
        }
        matrix
    }

    /// The states at the start and after each of `count` steps of `h` (s). The `loads` and the forces of
    /// the pins, which close the gaps at the step's end, act at its start:
    ///
    /// ```text
    /// v⁺ = v + h F/m,   r⁺ = r + h v⁺,   I (w(ω⁺) − w(ω)) = h T,   φ⁺ = φ + 2 atan ½hω⁺
    /// ```
    pub fn steps(
        &self,
        h: f64,
        count: usize,
        loads: impl Fn(&[PlanarBody]) -> Vec<PlanarLoad>,
    ) -> Vec<Vec<PlanarBody>> {
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
                    let spin = newton(next[body].spin, |spin| {
                        let (has, slope) = momentum(h, spin);
                        (has - wanted, slope)
                    });
                    let angle = before.angle + turn(h, spin).0;
                    next[body] =
                        PlanarBody { place: before.place + velocity * h, angle, velocity, spin };
                }
                let gaps = self.stacked(|pin| pin.gap(&next));
                let settled = gaps.amax() < 4.0 * f64::EPSILON;
                // dφ⁺/dT of dω⁺/dT = h/(I dw/dω) and dφ⁺/dω⁺.
                let compliance = |body: usize| {
                    let spin = next[body].spin;
                    let (bar, turned) = (&self.bars[body], turn(h, spin).1 / momentum(h, spin).1);
                    (h * h / bar.mass, h / bar.moment * turned)
                };
                let response = self.response(now, &next, compliance);
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

    /// The largest change of the energy over a track, J. The energy is the `potential` of a state
    /// plus the mean kinetic energy ½ Σ m v² + I w(ω)² of the state and the next one.
    pub fn energy_change(
        &self,
        track: &[Vec<PlanarBody>],
        h: f64,
        potential: impl Fn(&[PlanarBody]) -> f64,
    ) -> f64 {
        let kinetic = |at: &[PlanarBody]| {
            let each = self.bars.iter().zip(at).map(|(bar, at)| {
                bar.mass * at.velocity.norm_squared() + bar.moment * momentum(h, at.spin).0.powi(2)
            });
            0.5 * each.sum::<f64>()
        };
        let energy = |pair: &[Vec<PlanarBody>]| {
            0.5 * (kinetic(&pair[0]) + kinetic(&pair[1])) + potential(&pair[0])
        };
        let start = energy(&track[..2]);
        largest(track.windows(2).map(|pair| (energy(pair) - start).abs()))
    }

    /// The planar state of a body, with the angle nearest to `near` (rad).
    fn seen(&self, state: &State, near: f64) -> PlanarBody {
        let (r, v, q) = (&state.position, &state.velocity, &state.attitude);
        let (place, velocity, half, spin) = match self.plane {
            PlanarSurface::Level => (r.xy(), v.xy(), q[3], state.spin[2]),
            PlanarSurface::Upright => {
                (r.xz() - Vector2::new(0.0, HEIGHT), v.xz(), -q[2], -state.spin[1])
            }
        };
        let angle = 2.0 * half.atan2(q[0]);
        let turn = std::f64::consts::TAU;
        PlanarBody { place, angle: angle + turn * ((near - angle) / turn).round(), velocity, spin }
    }

    /// All bodies in all states of `run`, with continuous angles.
    pub fn track(&self, run: &TestRun) -> Vec<Vec<PlanarBody>> {
        let mut all = vec![self.start.clone()];
        for k in 0..=run.steps() {
            let last = &all[k];
            let now =
                (0..self.bars.len()).map(|b| self.seen(&run.states(b)[k], last[b].angle)).collect();
            all.push(now);
        }
        all.split_off(1)
    }

    /// The largest gap of a pin in any state, m.
    pub fn worst_gap(&self, track: &[Vec<PlanarBody>]) -> f64 {
        largest(track.iter().flat_map(|at| self.pins.iter().map(|pin| pin.gap(at).norm())))
    }
}
