//! Derivative of the offset of a slip (eqs. 38 and 38a).
//!
//! The offset is a function of the poses, of the velocities w of the middle before the step and of the
//! velocities V of its start. With the slip s of V, and the slip u_t of a step that ends with 2V − w,
//! it changes by
//!
//! ```text
//! (38)  δo = δŝ (ŝ·u_t) + ŝ (δŝ·u_t + ŝ·δu_t) − δu_t,   δŝ = (E − ŝ ŝᵀ) δs/|s|        (G22)
//! (38a) δo = ½ (E − n nᵀ) (δΩ_A × m_A + Ω_A × δm_A − δΩ_B × m_B − Ω_B × δm_B)
//!            − ½ (δn nᵀ + n δnᵀ) (Ω_A × m_A − Ω_B × m_B)                              (G22a)
//! ```
//!
//! with the ways m of the touching point in A and in B. Equation numbers are those of
//! `docs/gradients.md`.

use super::curved::{rolled_over, slid};
use super::{ContactTangent, RateSlopes, RowSlopes, across};
use crate::contact::{Contact, CorePair, Curved, EllipsoidPoint};
use crate::derivative::placement::FeatureChange;
use crate::derivative::side::{SideChangeInput, StepSide};
use crate::derivative::{EndMap, PlacedFeatures};
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::{Matrix3, Matrix3x6, Vector3};

/// States from which a step starts, with the velocities V of the instant, and those after a step
/// with the velocities 2V − w.
#[derive(Debug, Clone, Default)]
pub(crate) struct PredictedStep {
    instants: Vec<State>,
    ends: Vec<State>,
    /// States after free flight.
    free: Vec<State>,
}

impl PredictedStep {
    /// States with the velocities of the instant; empty if they are not known.
    pub(crate) fn instants(&self) -> &[State] {
        &self.instants
    }

    /// Predicts the step from `states`, whose velocities are w. The states after free flight are
    /// `free`. Without `instants` there is no offset.
    pub(crate) fn set(
        &mut self,
        world: &World,
        states: &[State],
        free: &[State],
        instants: &[State],
    ) {
        free.clone_into(&mut self.free);
        let map = world.step_map();
        instants.clone_into(&mut self.instants);
        self.ends.clear();
        self.ends.extend(instants.iter().zip(states).map(|(instant, state)| {
            let velocity = 2.0 * instant.velocity - state.velocity;
            let spin = 2.0 * instant.spin - state.spin;
            map.coasted(&State { velocity, spin, ..*instant })
        }));
    }
}

/// Offset of a slip, prepared for differentiation.
#[derive(Debug, Clone)]
pub(super) struct OffsetTangent {
    /// The contact in the predicted step.
    predicted: ContactTangent,
    /// Rotation at the end of that step (rad, world) by the spins of A and B (rad/s, body).
    turnings: [Matrix3<f64>; 2],
    /// Motion at the instant, of the offset (38); `None` for (38a).
    sliding: Option<Sliding>,
}

/// Motion of the touching points at the instant.
#[derive(Debug, Clone)]
struct Sliding {
    /// Spins Ω of A and B (rad/s, world).
    spins: [Vector3<f64>; 2],
    /// Relative velocity (m/s, world), and its slip s.
    velocity: Vector3<f64>,
    slip: Vector3<f64>,
}

/// Pose of one side at an end of the predicted step, and its change.
#[derive(Debug, Clone, Copy)]
struct MovedSide {
    origin: Vector3<f64>,
    rotation: Matrix3<f64>,
    /// δr (m) and δψ (rad), world.
    position: Vector3<f64>,
    turn: Vector3<f64>,
    stretch: Vector3<f64>,
}

impl MovedSide {
    /// World position of a point of the side (m), and its change with that of the point.
    fn place(&self, local: &Vector3<f64>, change: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let arm = self.rotation * local;
        let moved = self.position + self.turn.cross(&arm) + self.rotation * change;
        [self.origin + arm, moved]
    }

    /// The same for a point that the size of the body stretches.
    fn place_stretched(&self, local: &Vector3<f64>) -> [Vector3<f64>; 2] {
        self.place(local, &self.stretch.component_mul(local))
    }
}

/// Touching point x (m, world) at an end of the predicted step, and its change.
struct Touching {
    place: [Vector3<f64>; 2],
    /// Change of the parameters of the nearest points of two cores.
    slid: (f64, f64),
}

impl OffsetTangent {
    /// `None` if the contact has no offset.
    pub(super) fn new(
        world: &World,
        contact: &Contact,
        placed: &PlacedFeatures,
        states: &[State],
        step: &PredictedStep,
    ) -> Option<Box<Self>> {
        let PredictedStep { instants, ends, free } = step;
        if contact.slip_offset == Vector3::zeros() || ends.len() != states.len() {
            return None;
        }
        let zero = Vector3::zeros();
        let plain = Contact { slip_offset: zero, rebound: 0.0, struck: false, ..*contact };
        let predicted =
            ContactTangent::new(world, &plain, placed, states, ends, &PredictedStep::default());
        let bodies = [Some(contact.key.body), contact.key.partner.body()];
        let turnings = bodies.map(|body| {
            body.map_or(Matrix3::zeros(), |body| {
                let end = &ends[body];
                let map = EndMap::new(&end.velocity, &end.spin, &world.step_map());
                end.pose().rotation * map.turning()
            })
        });
        let spins = bodies.map(|body| {
            body.map_or(zero, |body| instants[body].pose().rotation * instants[body].spin)
        });
        let velocity = contact.point_velocity(world, instants);
        let normal = contact.normal();
        let slip = velocity - normal * normal.dot(&velocity);
        let is_slow = contact.is_slow(&slip, world, states, free);
        let sliding = (!is_slow).then_some(Sliding { spins, velocity, slip });
        Some(Box::new(Self { predicted, turnings, sliding }))
    }

    /// Differential δo for the differentials of both sides and of h (s).
    pub(super) fn change(&self, sides: [&SideChangeInput; 2], time_step: f64) -> Vector3<f64> {
        let rows = self.predicted.change(sides[0], sides[1], time_step, 0.0);
        let n = self.predicted.contact.normal();
        let turned = rows.turn.cross(&n);
        // Differential of the part of a vector across the normal.
        let projected = |vector: &Vector3<f64>, change: &Vector3<f64>| {
            across(&n, change) - turned * n.dot(vector) - n * turned.dot(vector)
        };
        let Some(Sliding { spins, velocity, slip }) = &self.sliding else {
            let [rolling, change] = self.rolling(sides, time_step);
            return projected(&rolling, &change);
        };
        let predicted = &self.predicted;
        let motion = rows.motion + self.by_velocities(sides);
        let u = across(&n, &predicted.motion);
        let u_change = projected(&predicted.motion, &motion);
        let mut faster = Vector3::zeros();
        let arms = predicted.arms();
        let signed = [(&predicted.a, 1.0), (&predicted.b, -1.0)];
        let surfaces = predicted.surface_change(sides, &rows, false, 0.0);
        for (k, (side, sign)) in signed.into_iter().enumerate() {
            let given = sides[k];
            let spin = side.rotation * given.instant_spin + given.turn.cross(&spins[k]);
            let turning = spin.cross(&arms[k]) + spins[k].cross(&rows.arms[k]);
            faster += (given.instant_velocity + turning + surfaces[k]) * sign;
        }
        let slip_change = projected(velocity, &faster);
        let speed = slip.norm();
        let along = slip / speed;
        let along_change = (slip_change - along * along.dot(&slip_change)) / speed;
        along_change * along.dot(&u) + along * (along_change.dot(&u) + along.dot(&u_change))
            - u_change
    }

    /// True if it is the offset (38a).
    pub(super) fn rolls(&self) -> bool {
        self.sliding.is_none()
    }

    /// Factors of the differentials of u_t and of the slip in (G22).
    fn factors(&self, sliding: &Sliding) -> [Matrix3<f64>; 2] {
        let unit = Matrix3::identity();
        let n = self.predicted.contact.normal();
        let u = across(&n, &self.predicted.motion);
        let speed = sliding.slip.norm();
        let along = sliding.slip / speed;
        let beside = along * along.transpose() - unit;
        let turned = unit * along.dot(&u) + along * u.transpose();
        [beside, turned * beside * (-1.0 / speed)]
    }

    /// Derivatives of the offset (38) with respect to the position of A, the rotation of A and that of B (world), for
    /// features fixed in their bodies.
    pub(super) fn pose_slopes(&self) -> Option<[Matrix3<f64>; 3]> {
        let sliding = self.sliding.as_ref()?;
        let Sliding { spins, velocity, .. } = sliding;
        let predicted = &self.predicted;
        let slopes = predicted.rigid_slopes()?;
        let [by_motion, by_slip] = self.factors(sliding);
        let arms = predicted.arms();
        let n = predicted.contact.normal();
        let tangential = Matrix3::identity() - n * n.transpose();
        let turning = |side: usize| arms[side].cross_matrix() * spins[side].cross_matrix();
        let turned = [Matrix3::zeros(), turning(0), -turning(1)];
        Some([0, 1, 2].map(|k| {
            let RowSlopes { motion, turn, arms } = &slopes[k];
            let [of_a, of_b] = [0, 1].map(|side| spins[side].cross_matrix() * arms[side]);
            // δn = φ × n
            let normal = -n.cross_matrix() * turn;
            let tilted = |x: &Vector3<f64>| normal * n.dot(x) + n * normal.tr_mul(x).transpose();
            by_motion * (tangential * motion - tilted(&predicted.motion))
                + by_slip * (tangential * (turned[k] + of_a - of_b) - tilted(velocity))
        }))
    }

    /// Derivatives of the offset (38) with respect to the velocities of A and of B.
    pub(super) fn rate_slopes(&self) -> Option<[RateSlopes; 2]> {
        let sliding = self.sliding.as_ref()?;
        let predicted = &self.predicted;
        let [by_motion, by_slip] = self.factors(sliding);
        let n = predicted.contact.normal();
        let tangential = Matrix3::identity() - n * n.transpose();
        let arms = predicted.arms();
        let sides = [(&predicted.a, 1.0), (&predicted.b, -1.0)];
        Some([0, 1].map(|k| {
            let (side, sign) = sides[k];
            let mut by_predicted = Matrix3x6::zeros();
            for column in 0..6 {
                let unit = Vector3::ith(column % 3, 1.0);
                let mut given = [[Vector3::zeros(); 2]; 3];
                if column < 3 {
                    given[0][k] = unit;
                } else {
                    given[1][k] = self.turnings[k] * unit;
                    given[2][k] = side.rotation * unit;
                }
                let [linear, turns, spins] = given;
                by_predicted.set_column(column, &predicted.end_change(linear, turns, spins));
            }
            let along = by_motion * tangential * by_predicted;
            let mut slip = Matrix3x6::zeros();
            slip.fixed_columns_mut::<3>(0).copy_from(&(Matrix3::identity() * sign));
            let turning = arms[k].cross_matrix() * side.rotation * -sign;
            slip.fixed_columns_mut::<3>(3).copy_from(&turning);
            RateSlopes {
                by_velocity: -along,
                by_instant: along * 2.0 + by_slip * tangential * slip,
            }
        }))
    }

    /// Part of δu by the velocities 2V − w of the predicted step (m/s), up to its part along the normal.
    fn by_velocities(&self, sides: [&SideChangeInput; 2]) -> Vector3<f64> {
        let Self { predicted, turnings, .. } = self;
        let [linear, spins] = predicted_change(sides);
        let turns = [turnings[0] * spins[0], turnings[1] * spins[1]];
        let rolling = [predicted.a.rotation * spins[0], predicted.b.rotation * spins[1]];
        predicted.end_change(linear, turns, rolling)
    }

    /// ½ (Ω_A × m_A − Ω_B × m_B) (m/s, world) of (38a), and its differential.
    fn rolling(&self, sides: [&SideChangeInput; 2], time_step: f64) -> [Vector3<f64>; 2] {
        let Self { predicted, turnings, .. } = self;
        let ContactTangent { a, b, time_step: h, .. } = predicted;
        let h = *h;
        let [linear, spins] = predicted_change(sides);
        // Poses of a side at k and at k+1 of the step with 2V − w, and their differentials.
        let ends = |k: usize, side: &StepSide| {
            let SideChangeInput { position, turn, stretch, .. } = *sides[k];
            let moved = side.linear * time_step + linear[k] * h;
            let turned = side.rate * time_step + turnings[k] * spins[k];
            let start =
                MovedSide { origin: side.origin, rotation: side.rotation, position, turn, stretch };
            let end = MovedSide {
                origin: side.origin + side.linear * h,
                rotation: side.turned,
                position: position + moved,
                turn: turn + turned,
                stretch,
            };
            [start, end]
        };
        let of_a = ends(0, a);
        let of_b = ends(1, b);
        let given = (a.change(sides[0]), b.change(sides[1]));
        let features = predicted.placed.placement.change(&predicted.contact, &given.0, &given.1);
        let radius = sides[0].radius;
        let touching = [0, 1].map(|k| self.touching(k, [&of_a[k], &of_b[k]], &features, radius));
        let contact = &predicted.contact;
        // Points from which the ways are counted: z from the centre of A's feature, ζ from the foot on B.
        let centre = contact.centre();
        let foot =
            contact.foot(&Pose { position: b.origin, rotation: b.rotation }, &touching[0].place[0]);
        let (centre_change, foot_change) = match &contact.features.curved {
            None => (features.point, None),
            Some(Curved::Ellipsoid(_)) => (sides[0].stretch.component_mul(&centre), None),
            Some(Curved::Cores(pair)) => {
                let (slid_a, slid_b) = touching[0].slid;
                (
                    sides[0].stretch.component_mul(&centre) + pair.of_a.along * slid_a,
                    Some(sides[1].stretch.component_mul(&foot) + pair.of_b.along * slid_b),
                )
            }
        };
        let foot_change = foot_change.unwrap_or_else(|| {
            let [place, change] = touching[0].place;
            let moved = change - sides[1].position - sides[1].turn.cross(&(place - b.origin));
            b.rotation.tr_mul(&moved)
        });
        // Way of the touching point in a side, and its differential.
        let way = |of: &[MovedSide; 2], local: &Vector3<f64>, change: &Vector3<f64>| {
            let at = [0, 1].map(|k| {
                let [place, moved] = of[k].place(local, change);
                let [touched, touched_change] = touching[k].place;
                [touched - place, touched_change - moved]
            });
            [at[1][0] - at[0][0], at[1][1] - at[0][1]]
        };
        let mut ways = [way(&of_a, &centre, &centre_change), way(&of_b, &foot, &foot_change)];
        if contact.features.curved.is_none() {
            // Seen from B: m_A − T ζ⁺ with T = A_B A_B⁺ᵀ.
            let [[way_a, way_a_change], [far, far_change]] = ways;
            let back = b.rotation * b.turned.transpose();
            let seen = back * far;
            let seen_change =
                of_b[0].turn.cross(&seen) + back * (far_change - of_b[1].turn.cross(&far));
            ways[1] = [way_a - seen, way_a_change - seen_change];
        }
        // Product rule of the cross products.
        let mut sums = [Vector3::zeros(); 2];
        for (k, (side, sign)) in [(a, 0.5), (b, -0.5)].into_iter().enumerate() {
            let spin = side.spin_world;
            let spin_change = side.rotation * spins[k] + sides[k].turn.cross(&spin);
            let [moved, change] = ways[k];
            sums[0] += spin.cross(&moved) * sign;
            sums[1] += (spin_change.cross(&moved) + spin.cross(&change)) * sign;
        }
        sums
    }

    /// Touching point with A and B at `sides`, end `k` of the predicted step. `wider` is δρ (m) of A.
    fn touching(
        &self,
        k: usize,
        [a, b]: [&MovedSide; 2],
        features: &FeatureChange,
        wider: f64,
    ) -> Touching {
        let predicted = &self.predicted;
        let own = &predicted.contact.features;
        let rho = own.radius;
        let upright = predicted.b.rotation.tr_mul(&predicted.contact.normal());
        let n = b.rotation * upright;
        let n_change = b.turn.cross(&n) + b.rotation * features.normal;
        // A point beyond the centre by −ρ n.
        let beyond =
            |[place, change]: [Vector3<f64>; 2],
             n: &Vector3<f64>,
             turned: &Vector3<f64>,
             wider: f64| { [place - n * rho, change - turned * rho - n * wider] };
        match &own.curved {
            None => {
                let centre = a.place(&own.point, &features.point);
                let place = beyond(centre, &n, &n_change, features.radius);
                Touching { place, slid: (0.0, 0.0) }
            }
            Some(Curved::Ellipsoid(one)) => {
                let [place, change] = a.place_stretched(&one.shape.centre);
                let nearest = nearest(one, &a.rotation, &n);
                let local = a.rotation.tr_mul(&nearest);
                let stretched = a.rotation * a.stretch.component_mul(&local);
                let moved = a.turn.cross(&nearest)
                    + rolled_over(one, &a.rotation, &a.turn, (&n, &n_change));
                let point = [place + nearest, change + moved + stretched];
                Touching { place: beyond(point, &n, &n_change, wider), slid: (0.0, 0.0) }
            }
            Some(Curved::Cores(pair)) => {
                let shares = if k == 0 { pair.shares } else { predicted.end(pair).0 };
                let NearestCores { point, direction: [n, turned], slid } =
                    NearestCores::new(pair, shares, a, b);
                Touching { place: beyond(point, &n, &turned, wider), slid }
            }
        }
    }
}

/// Changes of the velocities 2V − w and of the spins (body) of both sides.
fn predicted_change(sides: [&SideChangeInput; 2]) -> [[Vector3<f64>; 2]; 2] {
    [
        sides.map(|given| 2.0 * given.instant_velocity - given.velocity),
        sides.map(|given| 2.0 * given.instant_spin - given.spin),
    ]
}

/// Vector from the centre of an ellipsoid with this rotation to its nearest point along −n (m).
fn nearest(one: &EllipsoidPoint, rotation: &Matrix3<f64>, n: &Vector3<f64>) -> Vector3<f64> {
    -(rotation * (one.shape.axes * one.shape.direction(&rotation.tr_mul(n))))
}

/// Nearest points of two cores.
struct NearestCores {
    /// Point of A (m, world) and the direction from B's to it, each with its change.
    point: [Vector3<f64>; 2],
    direction: [Vector3<f64>; 2],
    /// Changes of the parameters.
    slid: (f64, f64),
}

impl NearestCores {
    fn new(pair: &CorePair, shares: (f64, f64), a: &MovedSide, b: &MovedSide) -> Self {
        let of = |side: &MovedSide, along: &Vector3<f64>| {
            let way = side.rotation * along;
            let stretched = side.rotation * side.stretch.component_mul(along);
            [way, side.turn.cross(&way) + stretched]
        };
        let [[u, u_change], [v, v_change]] = [of(a, &pair.of_a.along), of(b, &pair.of_b.along)];
        let [x, x_change] = a.place_stretched(&pair.of_a.at(shares.0));
        let [y, y_change] = b.place_stretched(&pair.of_b.at(shares.1));
        let apart = x - y;
        let moved = x_change - y_change;
        let slid = slid(pair, shares, &[u, v], [u_change, v_change], (&apart, &moved));
        let n = apart.normalize();
        let turned = across(&n, &(moved + u * slid.0 - v * slid.1)) / apart.norm();
        Self { point: [x, x_change + u * slid.0], direction: [n, turned], slid }
    }
}
