//! The nonlinear program of a contact step of several bodies: the [tutorial's](super), with the
//! gap and the slip of each contact as functions of both its bodies' next states.
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
//! A contact that bounces has h (ċ⁺ − e c_n⁻) in the place of φ⁺ (eq. 25d): of both rows of eq. 29 that
//! which holds where bodies turn by little in a step; where the other one does, the certificate says
//! so.
//!
//! A contact is a point of A, rounded or not, against a plane of B or of something fixed. Only
//! contacts that take part are in it, so that no row needs a flag; the rows |q⁺|² = 1, which the
//! dynamics imply, are left out, and so is all of friction where μ = 0. For one body on the ground
//! the rows are those of the reduced program (section 6 of `docs/formulation.md`), number for
//! number. Joints and gears add their own rows behind all others (eq. 36), forces along coordinates of which each has a
//! law: what is locked is an equation, drives are complementarities. Its matrices are written once, as a sequence of
//! entries, as the tutorial's are.

mod bond;
pub(crate) mod component;
mod coordinate;
mod hessian;
mod jacobian;
mod layout;
mod round;
mod ties;
pub(crate) mod touch;

pub use layout::{ContactVariables, Friction, FrictionRows, Layout, Normal};

use super::entries::{PatternSink, ValueSink};
use super::gyroscopic::Gyroscopic;
use super::kernels::{Normalised, SmoothForce};
use super::layout::{ATTITUDE_ROWS, POSITION_ROWS, SPIN_ROWS, VELOCITY_ROWS};
use crate::contact::Contact;
use crate::error::{Error, in_range};
use crate::joint::JointForce;
use crate::mechanics::quaternion::attitude_map;
use crate::mechanics::{State, Wrench};
use crate::sparsity::SparsityPattern;
use crate::world::World;
use component::Place;
use nalgebra::{Matrix3, Matrix4x3, SVector, Vector2, Vector3};
use ties::Ties;
use touch::Touch;

/// One step that the program is of; lists go over the bodies of the world.
#[derive(Debug, Clone, Copy)]
pub struct PosedStep<'a> {
    /// The constants.
    pub world: &'a World,
    /// X at step k.
    pub states: &'a [State],
    /// External wrenches, without gravity.
    pub wrenches: &'a [Wrench],
    /// The turns of the joints of the world at step k, rad, from which those are counted; those nearest to zero
    /// of joints without any.
    pub angles: &'a [Vector3<f64>],
    /// The bodies that take part, indices of the world in ascending order; those that joints tie all do.
    pub bodies: &'a [usize],
    /// The contacts that take part, between those bodies and with what is fixed.
    pub contacts: &'a [Contact],
}

/// The program of one step. Points x have [`Layout::variables`] numbers, rows and multipliers
/// [`Layout::constraints`]; methods panic on shorter slices.
#[derive(Debug, Clone)]
pub struct SeveralNlp {
    time_step: f64,
    /// ε, N.
    smoothing: f64,
    members: Vec<Member>,
    touches: Vec<Touch>,
    ties: Ties,
    /// κ, m/s a N, and f_0 of every contact.
    yielding: Vec<(f64, Vector3<f64>)>,
    /// σ, m²: what a normal force costs that differs from f_0.
    stiffness: f64,
    /// The same of forces of joints that no law bounds, and these forces f_0, N, one a bond.
    tied_stiffness: f64,
    tied_anchors: Vec<f64>,
    layout: Layout,
    jacobian_pattern: SparsityPattern,
    hessian_pattern: SparsityPattern,
}

/// One body of the program.
#[derive(Debug, Clone)]
struct Member {
    old: State,
    /// h (f_ext/m + g), m/s.
    push: Vector3<f64>,
    /// h I⁻¹ τ_ext, rad/s.
    twist: Vector3<f64>,
    inertia_inverse: Matrix3<f64>,
    gyroscopic: Gyroscopic,
    /// ½ h L(q) H.
    attitude_rate: Matrix4x3<f64>,
    /// Whether a plane of the body meets a point of another, or a round feature of it any other.
    holds: bool,
    /// Whether it has a round feature that meets another.
    is_round: bool,
}

impl SeveralNlp {
    /// The program of `step` with the smoothing ε (N).
    ///
    /// # Errors
    /// A smoothing outside 1e-12…1 N, a world with surfaces that move, a body of a joint or of a contact that does not take
    /// part.
    pub fn new(step: &PosedStep<'_>, smoothing: f64) -> Result<Self, Error> {
        in_range("smoothing epsilon (N)", smoothing, 1e-12, 1.0, "1e-12 to 1")?;
        let (world, h) = (step.world, step.world.time_step());
        if world.has_surfaces() {
            let why = "it knows no surfaces that move; give a world without";
            return Err(Error::Unsupported { what: "the program of several bodies", why });
        }
        let place = |body: usize| {
            let missing = Error::Count {
                field: "body of a contact or a joint",
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
            members.push(Member {
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
            let index = contact.key.body;
            let a = (place(index)?, &world.bodies()[index], &step.states[index]);
            let mut b = None;
            if let Some(index) = contact.key.partner.body() {
                let at = place(index)?;
                members[at].holds = true;
                b = Some((at, &world.bodies()[index], &step.states[index]));
            }
            let touch = Touch::new(contact, a, b, h);
            if touch.is_round() {
                for side in touch.sides() {
                    (members[side.body].holds, members[side.body].is_round) = (true, true);
                }
            }
            touches.push(touch);
        }
        let ties = Ties::new(step, place)?;
        for ((member, push), &index) in members.iter_mut().zip(&ties.pushes).zip(step.bodies) {
            let body = &world.bodies()[index];
            member.push += h * push.force / body.mass();
            member.twist += h * (body.inertia_inverse() * push.torque);
        }
        for coordinate in &ties.coordinates {
            if let (_, Some(b)) = coordinate.bodies {
                members[b].holds = members[b].holds || coordinate.is_place();
            }
        }
        let rough = touches.iter().map(|touch| touch.friction > 0.0);
        let layout = Layout::new(members.len(), rough).with_ties(ties.variables, ties.rows);
        let mut nlp = Self {
            time_step: h,
            smoothing,
            yielding: vec![(0.0, Vector3::zeros()); touches.len()],
            stiffness: 0.0,
            tied_stiffness: 0.0,
            tied_anchors: vec![0.0; ties.bonds.len()],
            members,
            touches,
            ties,
            layout,
            jacobian_pattern: SparsityPattern::new(),
            hessian_pattern: SparsityPattern::new(),
        };
        let (x, y) = (vec![0.0; nlp.layout.variables()], vec![0.0; nlp.layout.constraints()]);
        nlp.jacobian_pattern = PatternSink::of(|sink| nlp.emit_jacobian(&x, sink));
        nlp.hessian_pattern = PatternSink::of(|sink| nlp.emit_hessian(&x, 0.0, &y, sink));
        Ok(nlp)
    }

    /// Makes friction yield to what differs from the forces f_0 (N, along each contact's frame) by
    /// κ = `share` h (1/m_A + 1/m_B), m/s a N: row (10) becomes (25a). Points that stick leave their
    /// forces open where they pull against each other, and these rows dependent; with κ > 0 they are
    /// neither, and a solution with f_t = f_0 is one of (10). And adds
    ///
    /// ```text
    /// σ Σ (f_n,i − f_0,n,i)²,   σ = `stiffness`, m²                         (eq. 27)
    /// ```
    ///
    /// to the objective: where bodies touch in more points than carry them, their normal forces are
    /// not determined, and without this Ipopt wanders among them. Both are 0 until this is called,
    /// and both are nothing where the forces are those of f_0.
    pub fn anchor(
        &mut self,
        (share, stiffness): (f64, f64),
        forces: impl IntoIterator<Item = Vector3<f64>>,
    ) {
        self.stiffness = stiffness;
        for ((slot, touch), force) in self.yielding.iter_mut().zip(&self.touches).zip(forces) {
            // h/m of a side: the velocity by a unit of force.
            let answer = |side: &touch::Side| side.velocity_per_force.column(2).norm();
            let both = answer(&touch.a) + touch.b.as_ref().map_or(0.0, answer);
            *slot = (share * both, force);
        }
    }

    /// The order of variables and rows.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Where the Jacobian can be non-zero.
    #[must_use]
    pub fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian_pattern
    }

    /// Where the Hessian of the Lagrangian can be non-zero, lower triangle.
    #[must_use]
    pub fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian_pattern
    }

    /// s1ᵀs1 + s2ᵀs2 (eq. 16) and what is added to it (eq. 27) at the point `x`, N²m² + W².
    #[must_use]
    pub fn objective(&self, x: &[f64]) -> f64 {
        let slacks = self.slacks().chain(self.tied_slacks());
        let slacks: f64 = slacks.map(|slack| x[slack] * x[slack]).sum();
        let anchored = self.yielding.iter().enumerate();
        let apart = anchored.map(|(i, (_, force))| x[self.layout.normal(i).first] - force[2]);
        let tied = self.held().map(|(force, anchor)| (x[force] - anchor) * (x[force] - anchor));
        slacks
            + self.stiffness * apart.map(|apart| apart * apart).sum::<f64>()
            + self.tied_stiffness * tied.sum::<f64>()
    }

    /// The gradient of the objective at the point `x`, one number per variable.
    pub fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        for slack in self.slacks().chain(self.tied_slacks()) {
            gradient[slack] = 2.0 * x[slack];
        }
        for (i, (_, force)) in self.yielding.iter().enumerate() {
            let normal = self.layout.normal(i).first;
            gradient[normal] = 2.0 * self.stiffness * (x[normal] - force[2]);
        }
        for (force, anchor) in self.held() {
            gradient[force] = 2.0 * self.tied_stiffness * (x[force] - anchor);
        }
    }

    fn slacks(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.layout.contacts()).flat_map(|i| {
            let friction = self.layout.friction(i).map(|friction| friction.slack);
            std::iter::once(self.layout.normal(i).second).chain(friction)
        })
    }

    /// Adds `stiffness` (m²) Σ (f − f_0)² to the objective, over the forces of what joints hold, with f_0 those at the point
    /// `x`: what is held more often than it needs leaves them open, and without this they grow among each other without
    /// end. It is 0 until this is called, and nothing where the forces are f_0.
    pub fn anchor_ties(&mut self, stiffness: f64, x: &[f64]) {
        let first = self.layout.untied();
        self.tied_stiffness = stiffness;
        for (anchor, bond) in self.tied_anchors.iter_mut().zip(&self.ties.bonds) {
            *anchor = x[first + bond.variable];
        }
    }

    /// The forces of what joints hold: the variable of each and its f_0.
    fn held(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = self.layout.untied();
        let bonds = self.ties.bonds.iter().zip(&self.tied_anchors);
        let held = bonds.filter(|(bond, _)| bond.law.is_held());
        held.map(move |(bond, anchor)| (first + bond.variable, *anchor))
    }

    /// The slacks of joints.
    fn tied_slacks(&self) -> impl Iterator<Item = usize> + '_ {
        let bounds = self.ties.bonds.iter().flat_map(bond::Bond::bounds);
        bounds.map(|bound| self.layout.untied() + bound.slack)
    }

    /// All constraint rows at the point `x`, in the layout's order.
    pub fn constraints(&self, x: &[f64], rows: &mut [f64]) {
        self.dynamics_rows(x, rows);
        for i in 0..self.touches.len() {
            self.contact_rows(x, i, rows);
        }
        self.tied_rows(x, rows);
    }

    /// The Jacobian's values at the point `x` in the order of its pattern, as many as it has
    /// entries.
    pub fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        self.emit_jacobian(x, &mut ValueSink::new(values));
    }

    /// The values of σ∇²f + Σ yⱼ∇²gⱼ at the point `x` in the order of its pattern, with σ the
    /// `objective_factor` and y the `multipliers`, one a row.
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

    /// (36) of all bonds, and what their forces change of the velocities.
    fn tied_rows(&self, x: &[f64], rows: &mut [f64]) {
        let first = self.layout.untied();
        let (of, at) = (&x[first..], |body: usize| Place::of(&self.next_state(x, body)));
        for bond in &self.ties.bonds {
            let force = of[bond.variable];
            for act in &bond.acts {
                let rows = &mut rows[self.layout.state(act.body)];
                for k in 0..3 {
                    rows[VELOCITY_ROWS.start + k] += act.velocity[k] * force;
                    rows[SPIN_ROWS.start + k] += act.spin[k] * force;
                }
            }
            let law = &bond.law;
            let mut missed = self.ties.speed(bond, at) + law.yields * force - law.target;
            for bound in bond.bounds() {
                missed -= bound.sign * of[bound.beside];
                rows[first + bound.row] = of[bound.slack] - of[bound.beside] * bound.room(force);
            }
            rows[first + bond.row] = missed;
        }
    }

    /// The forces along joints: the variable of each, and the bounds (N) that it has.
    pub fn tied_forces(&self) -> impl Iterator<Item = (usize, [Option<f64>; 2])> + '_ {
        let first = self.layout.untied();
        let bonds = self.ties.bonds.iter();
        bonds.map(move |bond| (first + bond.variable, [bond.law.low, bond.law.high]))
    }

    /// The rows that are equations; the others are ≥ 0.
    pub fn equations(&self) -> impl Iterator<Item = usize> + '_ {
        let first = self.layout.untied();
        let tied = self.ties.bonds.iter().map(move |bond| first + bond.row);
        (0..self.layout.equalities()).chain(tied)
    }

    /// Sets the variables of joints and gears in the point `x`, of which the states count, to those of their `forces`
    /// (N, N m; none, or one each).
    pub fn set_ties(&self, forces: &[JointForce], gears: &[f64], x: &mut [f64]) {
        let states: Vec<_> = (0..self.members.len()).map(|body| self.next_state(x, body)).collect();
        let at = |body: usize| Place::of(&states[body]);
        self.ties.set((forces, gears), at, &mut x[self.layout.untied()..]);
    }

    /// The forces of all joints of the world, N and N m, without their angles, and of its gears, at the point `x`.
    #[must_use]
    pub fn tie_forces(&self, x: &[f64]) -> (Vec<JointForce>, Vec<f64>) {
        self.ties.forces(&x[self.layout.untied()..])
    }

    /// What the spins add to the slip of a rounded feature, m/s (eq. 10a, 10b).
    fn rolled(&self, x: &[f64], i: usize, axis: usize) -> f64 {
        let touch = &self.touches[i];
        let of_side = |side: &touch::Side| {
            let spin = self.next_state(x, side.body).spin;
            side.rolling.map_or(0.0, |rolling| (rolling * spin)[axis])
        };
        touch.sides().map(of_side).sum()
    }

    /// h (ċ⁺ − e c_n⁻) of a contact that bounces, m: what stands in the place of its gap (eq. 25d).
    fn rebounded(&self, x: &[f64], i: usize) -> f64 {
        let touch = &self.touches[i];
        let of_side = |side: &touch::Side| {
            let next = self.next_state(x, side.body);
            let spin = self.members[side.body].gyroscopic.departing(&next.spin);
            side.sign * touch.normal.dot(&next.velocity) + side.lever.dot(&spin)
        };
        self.time_step * (touch.sides().map(of_side).sum::<f64>() - touch.rebound)
    }

    /// X⁺ of a body.
    fn next_state(&self, x: &[f64], body: usize) -> State {
        State::from_vector(&SVector::from_column_slice(&x[self.layout.state(body)]))
    }

    /// Where the bodies of a contact end.
    fn places(&self, x: &[f64], i: usize) -> (Place, Option<Place>) {
        let touch = &self.touches[i];
        let place = |side: &touch::Side| Place::of(&self.next_state(x, side.body));
        (place(&touch.a), touch.b.as_ref().map(place))
    }

    /// f_i along the contact's frame.
    fn force(&self, x: &[f64], i: usize) -> Vector3<f64> {
        let [t1, t2] = match self.layout.friction(i) {
            Some(friction) => friction.force.map(|variable| x[variable]),
            None => [0.0; 2],
        };
        Vector3::new(t1, t2, x[self.layout.normal(i).first])
    }

    /// f_t with the smoothed norm.
    fn smooth_force(&self, x: &[f64], friction: Friction) -> SmoothForce {
        let [t1, t2] = friction.force;
        SmoothForce::new(Vector2::new(x[t1], x[t2]), self.smoothing)
    }
}

impl Member {
    /// q + ½ h L(q) H ω⁺, normalised.
    fn advanced_attitude(&self, spin: &Vector3<f64>) -> Normalised {
        Normalised::new(self.old.attitude + self.attitude_rate * spin)
    }
}
