//! Directions of friction and of the moment against rolling with [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
//!
//! The law opposes friction to the slip of the step, which belongs to its middle, half a step after
//! its forces. Where the direction of the slip turns, this is an error of first order in h. The
//! velocities V of the instant and w of the middle before it predict the slip of the step. With the
//! slip s of the instant and the mean slip u_t of a step with the velocities 2V − w,
//!
//! ```text
//! o = −(E − ŝ ŝᵀ) u_t(2V − w)                                            (eq. 38)
//! ```
//!
//! The law takes the slip u_t + o, whose direction is that of the instant to second order. The
//! offset o is perpendicular to s, so that it does not change when a body stops. It is left out of
//! slips that may stop or start within a few steps.
//!
//! Slow contacts that touch, and whose touching point x moves over A, take another offset. A body with an impact in
//! the interval before has none, so that it can stop between two surfaces. Rolling has no slip at the touching point
//! of the middle of the step, but the slip (10) is that at the point of its start. With the angular velocities Ω of
//! 2V − w, the vectors z from the centre of A's feature to x, and ζ from the point of B that x touches at the start,
//!
//! ```text
//! o = ½ (E − n nᵀ) (Ω_A × m_A − Ω_B × m_B),   m_A = z⁺ − z,   m_B = ζ⁺ − ζ    (eq. 38a)
//! ```
//!
//! where ⁺ is the end of a step with 2V − w. The slip of a point against a plane is seen from B, and there
//! m_B = m_A − A_B A_B⁺ᵀ ζ⁺.
//!
//! The moment against rolling likewise opposes the angular velocity of the step. With the tangential parts s of the
//! relative angular velocity of V, and W of that of w,
//!
//! ```text
//! o = (E − ŝ ŝᵀ) W                                                       (eq. 43a)
//! ```
//!
//! is (38), because the angular velocity of a step with 2V − w is 2 s − W.

use super::Contact;
use crate::kinematics::StepMap;
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{Pose, State};
use crate::world::{StickSpeed, World};
use nalgebra::Vector3;

/// Smallest slip with an offset, in units of the change of velocity that smooth accelerations
/// explain in a step.
const FAST: f64 = 1.0;
/// Slip along the initial one below which a contact has stopped, times the world's speed scale.
const SLOWEST: f64 = 1e-9;
/// Rounding error of a slip, times the world's speed scale.
const ROUNDING: f64 = 1e-12;
/// Distance of the friction from its limit at which it counts as reached, as a share of the limit.
const AT_LIMIT: f64 = 1e-9;

/// Motions of the bodies at the instant from which a step starts, for the offsets of slips.
#[derive(Debug, Clone, Default)]
pub struct InstantMotions {
    /// States with the velocities of the instant, and after free flight.
    instants: Vec<State>,
    free: Vec<State>,
    /// Motion of each body, computed on first use.
    now: Vec<Option<Motion>>,
    /// Poses of each body at the instant and after a step with 2V − w, computed on first use.
    predicted: Vec<Option<[Pose; 2]>>,
}

/// Motion of a body, and its change in a step that smooth accelerations explain (m/s).
#[derive(Debug, Clone, Copy)]
struct Motion {
    velocity: BodyVelocity,
    smooth_change: f64,
}

/// Velocity of a body in the world.
#[derive(Debug, Clone, Copy)]
struct BodyVelocity {
    position: Vector3<f64>,
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

impl BodyVelocity {
    fn new(state: &State) -> Self {
        let angular = rotation(&state.attitude) * state.spin;
        Self { position: state.position, linear: state.velocity, angular }
    }

    fn at(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.linear + self.angular.cross(&(point - self.position))
    }
}

/// Change of velocity of a body in a step that smooth accelerations explain (m/s): those of loads and
/// gyroscopic terms from `state` to the `free` flight, and centripetal ones.
fn smooth_change(world: &World, body: usize, state: &State, free: &State) -> f64 {
    let reach = world.bodies()[body].reach();
    (free.velocity - state.velocity).norm()
        + (free.spin - state.spin).norm() * reach
        + world.time_step() * state.spin.norm_squared() * reach
}

impl Contact {
    /// Relative velocity of the touching points at `states` (m/s, world), with the motion of
    /// surfaces.
    pub(crate) fn point_velocity(&self, world: &World, states: &[State]) -> Vector3<f64> {
        let of = |body: usize| BodyVelocity::new(&states[body]);
        let velocities = [Some(of(self.key.body)), self.key.partner.body().map(of)];
        let point = states[self.key.body].position + self.arm;
        self.relative_velocity(world, states, velocities, &point)
    }

    /// Rate along the normal of A's point that takes the force at `states`, relative to B's, with the velocities of
    /// `next` (m/s).
    pub(crate) fn rate_along(&self, states: &[State], next: &[State]) -> f64 {
        let point = states[self.key.body].position + self.arm;
        let of = |body: usize| {
            let State { position, attitude, .. } = states[body];
            let State { velocity, spin, .. } = next[body];
            BodyVelocity::new(&State { position, attitude, velocity, spin }).at(&point)
        };
        self.normal()
            .dot(&(of(self.key.body) - self.key.partner.body().map_or(Vector3::zeros(), of)))
    }

    /// Sets the coefficient of friction of the step (eq. 42), if there is a static one above the kinetic one:
    /// the [share](World::stick_speed) of both at the slip at `states`, the start of the step.
    pub fn set_friction(&mut self, world: &World, states: &[State]) {
        if self.law.static_friction.is_some() {
            let slip = self.initial_slip(world, states).norm();
            self.law.friction = self.friction_at(world, slip, self.arc_slip(world, states));
        }
    }

    /// Takes the friction of a contact without slip if the step `states` → `next` ends or reverses its slip, and
    /// otherwise the kinetic one, because its slip begins.
    ///
    /// # Panics
    /// If a list has no state of one of the bodies.
    pub fn hold(&mut self, world: &World, states: &[State], next: &[State]) {
        if self.reverses(world, states, next, SLOWEST) {
            self.law.friction = self.friction_at(world, 0.0, 0.0);
        } else {
            self.law.friction = world.friction_between(self.key.body, self.key.partner);
        }
    }

    /// True if this contact has the coefficient `friction` in the step from `states`, would have it without slip, or
    /// if its slip begins.
    pub fn may_have_friction(&self, world: &World, states: &[State], friction: f64) -> bool {
        let kinetic = || world.friction_between(self.key.body, self.key.partner);
        friction == self.law.friction
            || friction == self.friction_at(world, 0.0, 0.0)
            || self.sticks_at(world, states) && friction == kinetic()
    }

    /// True if the contact has a static coefficient that acts up to a stick speed, and is slower at `states`.
    fn sticks_at(&self, world: &World, states: &[State]) -> bool {
        let has_limit = matches!(world.stick_speed(), StickSpeed::Limit(_));
        self.law.static_friction.is_some_and(|most| {
            let slip = self.initial_slip(world, states).norm();
            has_limit && self.friction_at(world, slip, self.arc_slip(world, states)) == most
        })
    }

    /// True if the contact has this `slip` (m/s) in a step from `states` in spite of its static friction. In a short
    /// step the slip is small, but the friction in the `force` (N) is at its limit.
    pub(crate) fn breaks_away(
        &self,
        world: &World,
        states: &[State],
        force: &Vector3<f64>,
        slip: &Vector3<f64>,
    ) -> bool {
        let normal = self.normal();
        let friction = (force - normal * normal.dot(force)).norm();
        let pressing = normal.dot(&self.pressing_force(world, force));
        let is_at_limit = friction >= (1.0 - AT_LIMIT) * self.law.friction * pressing;
        self.law.static_friction == Some(self.law.friction)
            && slip.norm()
                > if is_at_limit { ROUNDING } else { SLOWEST } * world.speed_scale()
                    + self.slip_on_turning_surfaces(world)
            && self.sticks_at(world, states)
    }

    /// True if the contact has a static coefficient and has stopped within the step `states` → `next`: its slip
    /// along the one at the start is less than `slowest` times the world's speed scale.
    pub(crate) fn reverses(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
        slowest: f64,
    ) -> bool {
        let is_slower = self.law.friction < self.friction_at(world, 0.0, 0.0);
        if !is_slower || self.sticks_at(world, states) {
            return false;
        }
        let before = self.initial_slip(world, states);
        let along = self.slip(world, states, next).dot(&before);
        along < slowest * world.speed_scale() * before.norm()
    }

    /// Coefficient of friction at a `slip` that is known to within `arc` (m/s).
    fn friction_at(&self, world: &World, slip: f64, arc: f64) -> f64 {
        let Some(most) = self.law.static_friction else { return self.law.friction };
        let (share, _) = world.stick_speed().share(slip, arc);
        let least = world.friction_between(self.key.body, self.key.partner);
        (1.0 - share) * least + share * most
    }

    /// Slip of the touching points at `states` (m/s, world).
    pub(crate) fn initial_slip(&self, world: &World, states: &[State]) -> Vector3<f64> {
        let velocity = self.point_velocity(world, states);
        let normal = self.normal();
        velocity - normal * normal.dot(&velocity)
    }

    /// Largest slip of points that stick, at an instant (m/s): h Σ |(ω × (ω × y))_t|, because they move along
    /// arcs and a step along chords.
    fn arc_slip(&self, world: &World, states: &[State]) -> f64 {
        let point = states[self.key.body].position + self.arm;
        let arc = |body: usize| {
            let of = BodyVelocity::new(&states[body]);
            let inward = of.angular.cross(&of.angular.cross(&(point - of.position)));
            (inward - self.normal() * self.normal().dot(&inward)).norm()
        };
        let h = world.time_step();
        let arcs = h * self.key.bodies().map(arc).sum::<f64>();
        if world.has_surfaces() { arcs + self.arc_of_surfaces(world, states) } else { arcs }
    }

    /// Share of the static coefficient in the friction of the step in `world`.
    pub fn static_share(&self, world: &World) -> f64 {
        let Some(most) = self.law.static_friction else { return 0.0 };
        let least = world.friction_between(self.key.body, self.key.partner);
        (self.law.friction - least) / (most - least)
    }

    /// Largest change of [`Contact::point_velocity`] in a step that smooth accelerations explain
    /// (m/s).
    pub(crate) fn smooth_change(&self, world: &World, states: &[State], free: &[State]) -> f64 {
        self.key.bodies().map(|body| smooth_change(world, body, &states[body], &free[body])).sum()
    }

    /// True if a `slip` (m/s) may stop or start within a few steps: its offset is (38a).
    pub(crate) fn is_slow(
        &self,
        slip: &Vector3<f64>,
        world: &World,
        states: &[State],
        free: &[State],
    ) -> bool {
        slip.norm() <= FAST * self.smooth_change(world, states, free)
    }

    fn relative_velocity(
        &self,
        world: &World,
        states: &[State],
        [own, other]: [Option<BodyVelocity>; 2],
        point: &Vector3<f64>,
    ) -> Vector3<f64> {
        let at = |of: Option<BodyVelocity>| of.map_or(Vector3::zeros(), |of| of.at(point));
        let relative = at(own) - at(other);
        if world.has_surfaces() {
            relative + self.carried_after(world, states, 0.0)
        } else {
            relative
        }
    }

    /// Offset of the slip in the law: the motion of surfaces, and the [offset](Self::slip_offset) of
    /// its direction (m/s, world).
    pub(crate) fn law_offset(&self, world: &World, states: &[State]) -> Vector3<f64> {
        if world.has_surfaces() {
            self.carried(world, states) + self.slip_offset
        } else {
            self.slip_offset
        }
    }

    /// True if the law takes another slip than that of the touching points.
    #[inline]
    pub(crate) fn has_law_offset(&self, world: &World) -> bool {
        world.has_surfaces() || self.slip_offset != Vector3::zeros()
    }
}

impl InstantMotions {
    /// Takes the states with the velocities of the instant, and those after free flight. Without
    /// states, slips have no offset.
    pub fn set(&mut self, instants: &[State], free: &[State]) {
        instants.clone_into(&mut self.instants);
        free.clone_into(&mut self.free);
        self.now.clear();
        self.predicted.clear();
    }

    /// True if there are states.
    pub(super) fn are_known(&self) -> bool {
        !self.instants.is_empty()
    }

    /// Sets the offsets of the slip (eq. 38) and of the turning (eq. 43a) of `contact` in a step from `states`, whose
    /// velocities are those of the middle of the step before. They are zero if a list lacks a body of the contact.
    pub fn set_offsets(&mut self, world: &World, states: &[State], contact: &mut Contact) {
        (contact.slip_offset, contact.turning_offset) = (Vector3::zeros(), Vector3::zeros());
        let known = states.len().min(self.instants.len()).min(self.free.len());
        if contact.key.bodies().any(|body| body >= known) {
            return;
        }
        if world.has_turning_friction() && contact.turning_friction(world).rolling > 0.0 {
            contact.turning_offset = self.turning_offset(world, states, contact);
        }
        // Without motion and surfaces there is no slip.
        let is_still = |body: usize| {
            let State { velocity, spin, .. } = &self.instants[body];
            [velocity, spin].iter().all(|motion| **motion == Vector3::zeros())
        };
        if contact.key.bodies().all(is_still) && !world.has_surfaces() {
            return;
        }
        self.now.resize(known, None);
        self.predicted.resize(known, None);
        let own = contact.key.body;
        let other = contact.key.partner.body();
        let a = self.now(world, states, own);
        let b = other.map(|body| self.now(world, states, body));
        let velocities = [Some(a.velocity), b.map(|b| b.velocity)];
        // Slip s of the instant at the touching point.
        let point = self.instants[own].position + contact.arm;
        let velocity = contact.relative_velocity(world, &self.instants, velocities, &point);
        let normal = contact.normal();
        let slip = velocity - normal * normal.dot(&velocity);
        let speed = slip.norm();
        // A slip that smooth accelerations explain has no direction. It has (38a), or no offset.
        let is_slow = speed <= FAST * (a.smooth_change + b.map_or(0.0, |b| b.smooth_change));
        let moves = contact.features.curved.is_some() || contact.rolls() && other.is_some();
        if is_slow && !(moves && self.goes_on(world, states, contact)) {
            return;
        }
        // Step with the velocities 2V − w.
        let map = world.step_map();
        let a = self.predicted(states, own, &map);
        let b = other.map(|body| self.predicted(states, body, &map));
        // (38a): o = ½(E − nnᵀ)(Ω_A×m_A − Ω_B×m_B), with the ways m of the touching point in A and B.
        contact.slip_offset = if is_slow {
            let spin = |body: usize| {
                let State { attitude, spin, .. } = self.extrapolated(states, body);
                rotation(&attitude) * spin
            };
            let touched = [0, 1].map(|k| contact.touching_point(&a[k], b.as_ref().map(|b| &b[k])));
            let way = |poses: &[Pose; 2], local: &Vector3<f64>| {
                let [from, to] = [0, 1].map(|k| touched[k] - poses[k].place(local));
                to - from
            };
            let way_a = way(&a, &contact.centre());
            let mut rolling = spin(own).cross(&way_a);
            if let Some((body, poses)) = other.zip(b.as_ref()) {
                let mut way_b = way(poses, &contact.foot(&poses[0], &touched[0]));
                // Seen from B, the plane has m_B = m_A − A_B A_B⁺ᵀ ζ⁺.
                if contact.features.curved.is_none() {
                    way_b = way_a - poses[0].rotation * poses[1].rotation.tr_mul(&way_b);
                }
                rolling -= spin(body).cross(&way_b);
            }
            (rolling - normal * normal.dot(&rolling)) * 0.5
        } else {
            // (38): o = −(E − ŝŝᵀ) u_t(2V − w).
            let mut u =
                contact.motion([&a[0], &a[1]], b.as_ref().map(|[from, to]| [from, to]), &map);
            if world.has_surfaces() {
                u += contact.carried(world, states);
            }
            u -= normal * normal.dot(&u);
            let along = slip / speed;
            along * along.dot(&u) - u
        };
    }

    /// Offset of the turning (eq. 43a): the part of W across the rolling of the instant.
    fn turning_offset(&self, world: &World, states: &[State], contact: &Contact) -> Vector3<f64> {
        let normal = contact.normal();
        let rolling = |states: &[State]| {
            let turning = contact.turning_at(states);
            turning - normal * normal.dot(&turning)
        };
        let smooth_change = |body: usize| {
            smooth_change(world, body, &states[body], &self.free[body])
                / world.bodies()[body].reach()
        };
        let least = FAST * contact.key.bodies().map(smooth_change).sum::<f64>();
        let (now, before) = (rolling(&self.instants), rolling(states));
        let rate = now.norm();
        if rate <= least {
            return Vector3::zeros();
        }
        let along = now / rate;
        before - along * along.dot(&before)
    }

    /// True if `contact` touches, and if a body of it starts or has extrapolated velocities: no impact came before.
    fn goes_on(&self, world: &World, states: &[State], contact: &Contact) -> bool {
        let goes_on = |body: usize| {
            let [now, instant] = [&states[body], &self.instants[body]];
            now.velocity != instant.velocity
                || now.spin != instant.spin
                || world.before().get(body) == Some(&0.0)
        };
        let solved = SLOWEST * world.speed_scale() * world.time_step();
        let touches = contact.gap <= world.touching_gap() + solved;
        touches && contact.key.bodies().any(goes_on)
    }

    /// State of `body` at the instant with the velocities 2V − w.
    fn extrapolated(&self, states: &[State], body: usize) -> State {
        let (State { velocity, spin, .. }, instant) = (&states[body], &self.instants[body]);
        let velocity = 2.0 * instant.velocity - velocity;
        State { velocity, spin: 2.0 * instant.spin - spin, ..*instant }
    }

    fn now(&mut self, world: &World, states: &[State], body: usize) -> Motion {
        let Self { instants, free, now, .. } = self;
        *now[body].get_or_insert_with(|| Motion {
            velocity: BodyVelocity::new(&instants[body]),
            smooth_change: smooth_change(world, body, &states[body], &free[body]),
        })
    }

    fn predicted(&mut self, states: &[State], body: usize, map: &StepMap) -> [Pose; 2] {
        *self.predicted[body].get_or_insert_with(|| {
            let (State { velocity, spin, .. }, instant) = (&states[body], &self.instants[body]);
            let attitude = map.advance(&instant.attitude, &(2.0 * instant.spin - spin));
            let position = instant.position + map.time_step * (2.0 * instant.velocity - velocity);
            [instant.pose(), State { position, attitude, ..*instant }.pose()]
        })
    }
}
