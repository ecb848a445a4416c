//! The nonlinear program of a contact step of several bodies. It generalises the
//! [tutorial's](super): gap and slip of a contact depend on the next states of both its bodies.
//!
//! ```text
//! min  s1ᵀs1 + s2ᵀs2
//! s.t. the semi-implicit dynamics of every body              13n rows  (eq. 8)   = 0
//!      c_i + κ_i (f_t,i − f_0,i) + λ_i f_t,i / (‖f_t,i‖_ε + ε)   2K rows (eq. 25a) = 0
//!      φ⁺_i                                                    K rows  (eq. 25b)  ≥ 0
//!      μ_i f_n,i − ‖f_t,i‖_ε                                   K rows  (eq. 13)  ≥ 0
//!      s1_i − f_n,i φ⁺_i                                       K rows  (eq. 25c)  ≥ 0
//!      s2_i − λ_i (μ_i f_n,i − ‖f_t,i‖_ε)                      K rows  (eq. 15)  ≥ 0
//! ```
//!
//! For a bouncing contact h (ċ⁺ − e c_n⁻) replaces φ⁺ (eq. 25d). Of both rows of eq. 29, this one
//! holds if bodies turn little in a step. If the other one holds, the certificate shows it.
//!
//! A contact is a point of A, rounded or not, against a plane of B or of a fixed piece. The program
//! contains only selected contacts, so no row needs a flag. It omits the rows |q⁺|² = 1, which the
//! dynamics imply, and all friction where μ = 0. For one body on the ground the rows equal those of
//! the reduced program (section 6 of `docs/formulation.md`) to the last digit. Worlds with joints
//! are not supported. Its matrices are implemented as sequences of entries, like the tutorial's.

pub(crate) mod component;
mod ellipsoid;
mod hessian;
mod jacobian;
mod layout;
mod round;
pub(crate) mod touch;

pub use layout::{ContactVariables, Friction, FrictionRows, Normal, SeveralLayout};

use super::entries::{PatternSink, ValueSink};
use super::gyroscopic::Gyroscopic;
use super::kernels::{Normalised, SmoothForce};
use super::layout::{ATTITUDE_ROWS, POSITION_ROWS, SPIN_ROWS, VELOCITY_ROWS};
use crate::sparsity::SparsityPattern;
use component::{PosePair, ProgramPose};
use nalgebra::{Matrix3, Matrix4x3, SVector, Vector2, Vector3};
use touch::{ContactBody, ProgramContact};
use tumble_core::contact::Contact;
use tumble_core::error::{Error, in_range};
use tumble_core::mechanics::quaternion::attitude_map;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::world::World;

/// Input of the program for one step. States and wrenches cover all bodies of the world.
#[derive(Debug, Clone, Copy)]
pub struct PosedStep<'a> {
    /// World constants.
    pub world: &'a World,
    /// States X at step k.
    pub states: &'a [State],
    /// External wrenches, without gravity.
    pub wrenches: &'a [Wrench],
    /// Bodies in the program: ascending indices of the world.
    pub bodies: &'a [usize],
    /// Contacts in the program, between those bodies and with fixed pieces.
    pub contacts: &'a [Contact],
}

/// Program of one step. Points x have [`SeveralLayout::variables`] numbers, rows and multipliers
/// [`SeveralLayout::constraints`]. Methods panic on shorter slices.
#[derive(Debug, Clone)]
pub struct SeveralNlp {
    time_step: f64,
    /// Smoothing ε, N.
    smoothing: f64,
    members: Vec<ProgramBody>,
    touches: Vec<ProgramContact>,
    /// Friction compliance κ, (m/s)/N, and anchor force f_0 of every contact.
    yielding: Vec<(f64, Vector3<f64>)>,
    /// σ, m²: cost of a normal force's deviation from f_0.
    stiffness: f64,
    layout: SeveralLayout,
    jacobian_pattern: SparsityPattern,
    hessian_pattern: SparsityPattern,
}

/// One body of the program.
#[derive(Debug, Clone)]
struct ProgramBody {
    old: State,
    /// h (f_ext/m + g), m/s.
    push: Vector3<f64>,
    /// h I⁻¹ τ_ext, rad/s.
    twist: Vector3<f64>,
    inertia_inverse: Matrix3<f64>,
    gyroscopic: Gyroscopic,
    /// ½ h L(q) H.
    attitude_rate: Matrix4x3<f64>,
    /// True if a plane of the body touches a point of another body, or a round feature of it
    /// touches any other.
    holds: bool,
    /// True if the body has a round feature that touches another round feature.
    is_round: bool,
}

impl SeveralNlp {
    /// Reason why the program does not support `world`, or `None`.
    #[must_use]
    pub fn unsuitable(world: &World) -> Option<&'static str> {
        if !world.joints().is_empty() {
            Some("joints and gears are not supported; use the native solver")
        } else if world.has_surfaces() {
            Some("moving surfaces are not supported; use the native solver")
        } else {
            None
        }
    }

    /// Creates the program of `step` with the smoothing ε (N).
    ///
    /// # Errors
    /// A smoothing outside 1e-12…1 N; a world with joints or moving surfaces; a contact of a body
    /// that is not in the program.
    pub fn new(step: &PosedStep<'_>, smoothing: f64) -> Result<Self, Error> {
        in_range("smoothing epsilon (N)", smoothing, 1e-12, 1.0, "1e-12 to 1")?;
        let (world, h) = (step.world, step.world.time_step());
        if let Some(why) = Self::unsuitable(world) {
            return Err(Error::Unsupported { what: "the program of several bodies", why });
        }
        let place = |body: usize| {
            let missing = Error::Count {
                field: "body of a contact",
                count: body,
                allowed: "a body that takes part in the program",
            };
            step.bodies.binary_search(&body).map_err(|_| missing)
        };
        let mut members = Vec::with_capacity(step.bodies.len());
        for &index in step.bodies {
            let known = (world.bodies().get(index), step.states.get(index));
            let (Some(body), Some(state), Some(wrench)) =
                (known.0, known.1, step.wrenches.get(index))
            else {
                let allowed = "a body of the world with a state and a wrench";
                return Err(Error::Count { field: "body", count: index, allowed });
            };
            members.push(ProgramBody {
                old: *state,
                push: h * (wrench.force / body.mass() + world.gravity()),
                twist: h * (body.inertia_inverse() * wrench.torque),
                inertia_inverse: *body.inertia_inverse(),
                gyroscopic: Gyroscopic::new(body, world.rotation(), h),
                attitude_rate: attitude_map(&state.attitude) * (0.5 * h),
                holds: false,
                is_round: false,
            });
        }
        let mut touches = Vec::with_capacity(step.contacts.len());
        for contact in step.contacts {
            let of = |index: usize| {
                let (body, state) = (&world.bodies()[index], &step.states[index]);
                Ok::<_, Error>(ContactBody { place: place(index)?, body, state })
            };
            let a = of(contact.key.body)?;
            let b = contact.key.partner.body().map(of).transpose()?;
            if let Some(b) = &b {
                members[b.place].holds = true;
            }
            let touch = ProgramContact::new(contact, a, b, h);
            if touch.is_round() {
                for side in touch.sides() {
                    (members[side.body].holds, members[side.body].is_round) = (true, true);
                }
            }
            touches.push(touch);
        }
        let rough = touches.iter().map(|touch| touch.friction > 0.0);
        let layout = SeveralLayout::new(members.len(), rough);
        let mut nlp = Self {
            time_step: h,
            smoothing,
            yielding: vec![(0.0, Vector3::zeros()); touches.len()],
            stiffness: 0.0,
            members,
            touches,
            layout,
            jacobian_pattern: SparsityPattern::new(),
            hessian_pattern: SparsityPattern::new(),
        };
        let (x, y) = (vec![0.0; nlp.layout.variables()], vec![0.0; nlp.layout.constraints()]);
        nlp.jacobian_pattern = PatternSink::of(|sink| nlp.emit_jacobian(&x, sink));
        nlp.hessian_pattern = PatternSink::of(|sink| nlp.emit_hessian(&x, 0.0, &y, sink));
        Ok(nlp)
    }

    /// Regularises forces towards the anchor forces f_0 (N, in each contact's frame).
    ///
    /// Friction becomes compliant with κ = `share` h (1/m_A + 1/m_B), (m/s)/N: row (10) becomes
    /// (25a). Sticking points leave internal friction forces undetermined and these rows dependent.
    /// With κ > 0 both problems vanish, and a solution with f_t = f_0 is one of (10). The objective
    /// becomes
    ///
    /// ```text
    /// … + σ Σ (f_n,i − f_0,n,i)²,   σ = `stiffness`, m²                     (eq. 27)
    /// ```
    ///
    /// Hyperstatic normal forces are otherwise undetermined, and Ipopt converges slowly. Both terms
    /// are 0 until this is called, and vanish at the forces f_0.
    pub fn anchor(
        &mut self,
        share: f64,
        stiffness: f64,
        forces: impl IntoIterator<Item = Vector3<f64>>,
    ) {
        self.stiffness = stiffness;
        for ((slot, touch), force) in self.yielding.iter_mut().zip(&self.touches).zip(forces) {
            // h/m of a side: the velocity change per unit of force.
            let answer = |side: &touch::ProgramSide| side.velocity_per_force.column(2).norm();
            let both = answer(&touch.a) + touch.b.as_ref().map_or(0.0, answer);
            *slot = (share * both, force);
        }
    }

    /// Order of variables and rows.
    #[must_use]
    pub fn layout(&self) -> &SeveralLayout {
        &self.layout
    }

    /// Structural non-zeros of the Jacobian.
    #[must_use]
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian_pattern
    }

    /// Structural non-zeros of the Hessian of the Lagrangian, lower triangle.
    #[must_use]
    pub fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian_pattern
    }

    /// Objective s1ᵀs1 + s2ᵀs2 (eq. 16) plus the anchor term (eq. 27) at the point `x`, N²m² + W².
    #[must_use]
    pub fn objective(&self, x: &[f64]) -> f64 {
        let slacks: f64 = self.slacks().map(|slack| x[slack] * x[slack]).sum();
        let anchored = self.yielding.iter().enumerate();
        let apart = anchored.map(|(i, (_, force))| x[self.layout.normal(i).first] - force[2]);
        slacks + self.stiffness * apart.map(|apart| apart * apart).sum::<f64>()
    }

    /// Gradient of the objective at the point `x`, one number per variable.
    pub fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        for slack in self.slacks() {
            gradient[slack] = 2.0 * x[slack];
        }
        for (i, (_, force)) in self.yielding.iter().enumerate() {
            let normal = self.layout.normal(i).first;
            gradient[normal] = 2.0 * self.stiffness * (x[normal] - force[2]);
        }
    }

    fn slacks(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.layout.contacts()).flat_map(|i| {
            let friction = self.layout.friction(i).map(|friction| friction.slack);
            std::iter::once(self.layout.normal(i).second).chain(friction)
        })
    }

    /// Writes all constraint rows at the point `x` in the layout's order.
    pub fn constraints(&self, x: &[f64], rows: &mut [f64]) {
        self.dynamics_rows(x, rows);
        for i in 0..self.touches.len() {
            self.contact_rows(x, i, rows);
        }
    }

    /// Writes the Jacobian's values at the point `x` in the order of its pattern.
    pub fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        self.emit_jacobian(x, &mut ValueSink::new(values));
    }

    /// Writes the values of σ∇²f + Σ yⱼ∇²gⱼ at the point `x` in the order of its pattern. σ is the
    /// `objective_factor` and y the `multipliers`, one per row.
    pub fn hessian(
        &self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    ) {
        self.emit_hessian(x, objective_factor, multipliers, &mut ValueSink::new(values));
    }

    /// Eq. 8 of every body: the semi-implicit step minus X⁺.
    fn dynamics_rows(&self, x: &[f64], rows: &mut [f64]) {
        let h = self.time_step;
        for (body, member) in self.members.iter().enumerate() {
            let (old, next) = (&member.old, self.next_state(x, body));
            let position = old.position + h * next.velocity - next.position;
            let attitude = member.advanced_attitude(&next.spin).unit - next.attitude;
            let velocity = old.velocity + member.push - next.velocity;
            let gyroscopic = member.gyroscopic.term(&old.spin, &next.spin);
            let spin =
                old.spin + member.twist - h * (member.inertia_inverse * gyroscopic) - next.spin;
            let rows = &mut rows[self.layout.state(body)];
            rows[POSITION_ROWS].copy_from_slice(position.as_slice());
            rows[ATTITUDE_ROWS].copy_from_slice(attitude.as_slice());
            rows[VELOCITY_ROWS].copy_from_slice(velocity.as_slice());
            rows[SPIN_ROWS].copy_from_slice(spin.as_slice());
        }
        for (i, touch) in self.touches.iter().enumerate() {
            let force = self.force(x, i);
            for side in touch.sides() {
                let rows = &mut rows[self.layout.state(side.body)];
                let (velocity, spin) =
                    (side.velocity_per_force * force, side.spin_per_force * force);
                for k in 0..3 {
                    rows[VELOCITY_ROWS.start + k] += velocity[k];
                    rows[SPIN_ROWS.start + k] += spin[k];
                }
            }
        }
    }

    /// Eqs. 13, 15 and 25 of one contact.
    fn contact_rows(&self, x: &[f64], i: usize, rows: &mut [f64]) {
        let (touch, at) = (&self.touches[i], self.places(x, i));
        let gap = match touch.bounces() {
            true => self.rebounded(x, i),
            false => touch.gap(&touch.component(2, at)),
        };
        let (of, row) = (self.layout.normal(i), self.layout.normal_rows(i));
        rows[row.first] = gap;
        rows[row.second] = x[of.second] - x[of.first] * gap;
        let (Some(friction), Some(row)) = (self.layout.friction(i), self.layout.friction_rows(i))
        else {
            return;
        };
        let force = self.smooth_force(x, friction);
        let (compliance, anchor) = self.yielding[i];
        for axis in 0..2 {
            let slip = touch.slipped(axis, &touch.component(axis, at)) / self.time_step
                + self.rolled(x, i, axis);
            let yielding = compliance * (x[friction.force[axis]] - anchor[axis]);
            let sliding = x[friction.slip_speed] * force.direction[axis];
            rows[row.dissipation + axis] = slip + yielding + sliding;
        }
        let room = touch.friction * x[of.first] - force.norm;
        rows[row.cone] = room;
        rows[row.complementarity] = x[friction.slack] - x[friction.slip_speed] * room;
    }

    /// Contribution of the spins to the slip of a rounded feature, m/s (eq. 10a, 10b).
    fn rolled(&self, x: &[f64], i: usize, axis: usize) -> f64 {
        let touch = &self.touches[i];
        let of_side = |side: &touch::ProgramSide| {
            let spin = self.next_state(x, side.body).spin;
            side.rolling.map_or(0.0, |rolling| (rolling * spin)[axis])
        };
        touch.sides().map(of_side).sum()
    }

    /// h (ċ⁺ − e c_n⁻) of a bouncing contact, m: the replacement of its gap (eq. 25d).
    fn rebounded(&self, x: &[f64], i: usize) -> f64 {
        let touch = &self.touches[i];
        let of_side = |side: &touch::ProgramSide| {
            let next = self.next_state(x, side.body);
            let spin = self.members[side.body].gyroscopic.departing(&next.spin);
            side.sign * touch.normal.dot(&next.velocity) + side.lever.dot(&spin)
        };
        self.time_step * (touch.sides().map(of_side).sum::<f64>() - touch.rebound)
    }

    /// State X⁺ of a body.
    fn next_state(&self, x: &[f64], body: usize) -> State {
        State::from_vector(&SVector::from_column_slice(&x[self.layout.state(body)]))
    }

    /// End poses of the bodies of a contact.
    fn places(&self, x: &[f64], i: usize) -> PosePair {
        let touch = &self.touches[i];
        let place = |side: &touch::ProgramSide| ProgramPose::of(&self.next_state(x, side.body));
        PosePair { a: place(&touch.a), b: touch.b.as_ref().map(place) }
    }

    /// Force f_i in the contact's frame.
    fn force(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let [t1, t2] = match self.layout.friction(i) {
            Some(friction) => friction.force.map(|variable| x[variable]),
            None => [0.0; 2],
        };
        Vector3::new(t1, t2, x[self.layout.normal(i).first])
    }

    /// Tangential force f_t with the smoothed norm.
    fn smooth_force(&self, x: &[f64], friction: Friction) -> SmoothForce {
        let [t1, t2] = friction.force;
        SmoothForce::new(Vector2::new(x[t1], x[t2]), self.smoothing)
    }
}

impl ProgramBody {
    /// q + ½ h L(q) H ω⁺, normalised.
    fn advanced_attitude(&self, spin: &Vector3<f64>) -> Normalised {
        Normalised::new(self.old.attitude + self.attitude_rate * spin)
    }
}
