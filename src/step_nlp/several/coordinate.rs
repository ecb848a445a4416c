//! The coordinates of joints as functions of where their bodies end, with two derivatives.
//!
//! That of a place is the component of A's anchor along an axis of B's joint frame (eq. J1), as that of a contact's
//! point. Those of a turn are functions of E = R* ⊗ Q⁺ (eq. J4), of which each component is bilinear in both attitudes,
//!
//! ```text
//! E_k = q_Bᵀ N_k q_A,   g = ℓ γ(E),   ∂g/∂q_A = ℓ Σ γ_k N_kᵀ q_B,   ∂g/∂q_B = ℓ Σ γ_k N_k q_A      (eq. D14)
//! ```
//!
//! and angles are arguments of pairs of numbers that are linear in E (eqs. J11, J14).

use super::component::{Component, Curvature, Forms, Place};
use super::touch::Seen;
use crate::joint::{Joint, JointAxis, Turning};
use crate::mechanics::State;
use crate::mechanics::quaternion::{left, product, right, rotated_point_forms};
use nalgebra::{Matrix3x4, Matrix4, SMatrix, Vector3, Vector4};

/// What a pair of numbers counts at least, so that derivatives stay finite.
const LEAST: f64 = 1e-12;

/// A coordinate of a joint, m, that of a turn times ℓ: of what is locked itself, of what is free how much it has
/// changed since step k.
#[derive(Debug, Clone)]
pub(super) struct Coordinate {
    /// The places of the bodies in the program.
    pub(super) bodies: (usize, Option<usize>),
    /// Where it is counted from.
    base: f64,
    of: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Along(Box<Along>),
    About(Box<About>),
}

/// Along an axis of B's joint frame.
#[derive(Debug, Clone)]
struct Along {
    /// The axis in B's frame, or in the world.
    direction: Vector3<f64>,
    direction_forms: Forms,
    /// Those of A's anchor.
    point_forms: Forms,
}

/// About an axis of the turn.
#[derive(Debug, Clone)]
struct About {
    /// N_w, N_x, N_y, N_z.
    forms: [Matrix4<f64>; 4],
    /// ℓ, m.
    length: f64,
    measure: Measure,
}

/// γ.
#[derive(Debug, Clone)]
enum Measure {
    /// 2 E_k.
    Aside(usize),
    /// 2 (E_x E_y + E_w E_z).
    Crossing,
    /// Σ w · arg, modulo 2π.
    Angle(Box<[(f64, Arc); 2]>),
}

/// An argument.
#[derive(Debug, Clone, Copy)]
enum Arc {
    /// arg (a·E, b·E).
    Of([Vector4<f64>; 2]),
    /// arg (|first|, |second|) of two such pairs.
    Between([[Vector4<f64>; 2]; 2]),
}

/// A function of E with its derivatives.
struct Bent {
    value: f64,
    slope: Vector4<f64>,
    curvature: Matrix4<f64>,
}

impl Coordinate {
    /// That of `axis` of `joint`, whose length is `length` (m) and whose bodies A and B (places in the program, states at
    /// k) are given; `locked` if it is to be zero.
    pub(super) fn new(
        joint: &Joint,
        axis: JointAxis,
        (a, b): ((usize, &State), Option<(usize, &State)>),
        (length, turns): (f64, &Vector3<f64>),
        locked: bool,
    ) -> Self {
        let [of_a, of_b] = joint.frames();
        let bodies = (a.0, b.map(|b| b.0));
        let at = (Place::of(a.1), b.map(|b| Place::of(b.1)));
        let (of, base) = match axis {
            JointAxis::Linear(k) => {
                let direction = of_b.rotation().column(k).into_owned();
                let along = Along {
                    direction,
                    direction_forms: rotated_point_forms(&direction),
                    point_forms: rotated_point_forms(&of_a.anchor),
                };
                (Kind::Along(Box::new(along)), direction.dot(&of_b.anchor))
            }
            JointAxis::Angular(k) => {
                let turn = start(joint, at);
                let back = back(joint.turning(), &turn);
                let measure = measure(joint, k, turns);
                let forms = forms(joint, &back);
                (Kind::About(Box::new(About { forms, length, measure })), 0.0)
            }
        };
        let mut coordinate = Self { bodies, base, of };
        if !locked {
            coordinate.base = coordinate.base_at(at);
        }
        coordinate
    }

    fn base_at(&self, at: (Place, Option<Place>)) -> f64 {
        match &self.of {
            Kind::Along(along) => along.seen(at).component().value,
            Kind::About(about) => about.length * about.bent(&about.turned(at)).value,
        }
    }

    /// Whether it is one of a place, which depends on positions.
    pub(super) fn is_place(&self) -> bool {
        matches!(self.of, Kind::Along(_))
    }

    /// It, and its slopes, where A and B are at `at`.
    pub(super) fn component(&self, at: (Place, Option<Place>)) -> Component {
        match &self.of {
            Kind::Along(along) => {
                let component = along.seen(at).component();
                Component { value: component.value - self.base, ..component }
            }
            Kind::About(about) => {
                let bent = about.bent(&about.turned(at));
                let (by_a, by_b) = about.slopes(at);
                let mut value = about.length * bent.value - self.base;
                if matches!(about.measure, Measure::Angle(_)) {
                    let around = std::f64::consts::TAU * about.length;
                    value -= around * (value / around).round();
                }
                Component {
                    value,
                    by_position: Vector3::zeros(),
                    by_a: about.length * by_a * bent.slope,
                    by_b: about.length * by_b * bent.slope,
                }
            }
        }
    }

    /// Its second derivatives.
    pub(super) fn curvature(&self, at: (Place, Option<Place>)) -> Curvature {
        match &self.of {
            Kind::Along(along) => {
                along.seen(at).curvature(&along.point_forms, &along.direction_forms)
            }
            Kind::About(about) => about.curvature(at),
        }
    }
}

impl Along {
    fn seen(&self, at: (Place, Option<Place>)) -> Seen {
        Seen::new((&self.point_forms, &self.direction, &self.direction_forms), at)
    }
}

/// The attitude of B's side: that of B, or none of the world's.
fn attitude((_, b): (Place, Option<Place>)) -> Vector4<f64> {
    b.map_or(Vector4::new(1.0, 0.0, 0.0, 0.0), |b| b.attitude)
}

/// Q of a joint.
fn start(joint: &Joint, at: (Place, Option<Place>)) -> Vector4<f64> {
    let [of_a, of_b] = joint.frames();
    let side = product(&attitude(at), &of_b.attitude);
    product(&conjugated(&side), &product(&at.0.attitude, &of_a.attitude))
}

fn conjugated(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

/// R*: of what turns about z the part of Q about it, of the others ±1.
fn back(turning: Turning, turn: &Vector4<f64>) -> Vector4<f64> {
    let about = Vector4::new(turn[0], 0.0, 0.0, -turn[3]);
    match turning {
        Turning::Hinge | Turning::Ball if about.norm() > 0.0 => about.normalize(),
        _ => Vector4::new(if turn[0] < 0.0 { -1.0 } else { 1.0 }, 0.0, 0.0, 0.0),
    }
}

/// N_w, N_x, N_y, N_z: E = R* ⊗ j_B* ⊗ q_B* ⊗ q_A ⊗ j_A.
fn forms(joint: &Joint, back: &Vector4<f64>) -> [Matrix4<f64>; 4] {
    let [of_a, of_b] = joint.frames();
    let before = left(&product(back, &conjugated(&of_b.attitude)));
    let after = right(&of_a.attitude);
    let by_unit: [Matrix4<f64>; 4] = std::array::from_fn(|i| {
        let unit = Vector4::from_fn(|k, _| if k == i { 1.0 } else { 0.0 });
        before * left(&conjugated(&unit)) * after
    });
    std::array::from_fn(|k| Matrix4::from_fn(|i, j| by_unit[i][(k, j)]))
}

/// What is measured about axis `k` of a joint that has turned to `turns` (rad) at step k.
fn measure(joint: &Joint, k: usize, turns: &Vector3<f64>) -> Measure {
    let pair = |first: [f64; 4], second: [f64; 4]| [Vector4::from(first), Vector4::from(second)];
    // (w, z) and (x, y); the sum and the difference of (J14).
    let about = pair([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
    let swung = pair([0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]);
    let sum = pair([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]);
    let difference = pair([1.0, 0.0, 0.0, -1.0], [0.0, -1.0, 1.0, 0.0]);
    let both = |arcs: [(f64, Arc); 2]| Measure::Angle(Box::new(arcs));
    let one = |weight: f64, arc: Arc| both([(weight, arc), (0.0, arc)]);
    match (joint.turning(), k) {
        (Turning::Hinge | Turning::Ball, 2) => one(2.0, Arc::Of(about)),
        (Turning::Ball, 0) => one(2.0, Arc::Between([about, swung])),
        (Turning::Gimbal | Turning::Universal, 0) => {
            both([(1.0, Arc::Of(sum)), (-1.0, Arc::Of(difference))])
        }
        (Turning::Gimbal | Turning::Universal, 1) => {
            both([(1.0, Arc::Of(sum)), (1.0, Arc::Of(difference))])
        }
        (Turning::Gimbal, 2) => {
            // Of (α + π, β + π, π − γ), which are the same turn, γ runs the other way.
            let middle = joint.middle();
            let sign = if middle.backwards { -1.0 } else { 1.0 };
            let is_other = libm::cos(sign * turns[2] + middle.zero) < 0.0;
            let weight = if is_other { -2.0 * sign } else { 2.0 * sign };
            one(weight, Arc::Between([difference, sum]))
        }
        (Turning::Universal, 2) => Measure::Crossing,
        _ => Measure::Aside(k + 1),
    }
}

impl About {
    /// E.
    fn turned(&self, at: (Place, Option<Place>)) -> Vector4<f64> {
        let (a, b) = (&at.0.attitude, attitude(at));
        Vector4::from_fn(|k, _| b.dot(&(self.forms[k] * a)))
    }

    /// (∂E/∂q_A)ᵀ and (∂E/∂q_B)ᵀ.
    fn slopes(&self, at: (Place, Option<Place>)) -> (Matrix4<f64>, Matrix4<f64>) {
        let (a, b) = (&at.0.attitude, attitude(at));
        let by_a = [0, 1, 2, 3].map(|k| self.forms[k].tr_mul(&b));
        let by_b = [0, 1, 2, 3].map(|k| self.forms[k] * a);
        (Matrix4::from_columns(&by_a), Matrix4::from_columns(&by_b))
    }

    fn curvature(&self, at: (Place, Option<Place>)) -> Curvature {
        let bent = self.bent(&self.turned(at));
        let (by_a, by_b) = self.slopes(at);
        let mixed: Matrix4<f64> =
            self.forms.iter().zip(&bent.slope).map(|(form, slope)| form.transpose() * *slope).sum();
        Curvature {
            aa: by_a * bent.curvature * by_a.transpose() * self.length,
            bb: by_b * bent.curvature * by_b.transpose() * self.length,
            ab: (by_a * bent.curvature * by_b.transpose() + mixed) * self.length,
            position_a: Matrix3x4::zeros(),
            ..Curvature::default()
        }
    }

    /// γ at E.
    fn bent(&self, e: &Vector4<f64>) -> Bent {
        match &self.measure {
            Measure::Aside(k) => {
                let mut slope = Vector4::zeros();
                slope[*k] = 2.0;
                Bent { value: 2.0 * e[*k], slope, curvature: Matrix4::zeros() }
            }
            Measure::Crossing => {
                let slope = 2.0 * Vector4::new(e[3], e[2], e[1], e[0]);
                let curvature = Matrix4::from_fn(|i, j| if i + j == 3 { 2.0 } else { 0.0 });
                Bent { value: 0.5 * slope.dot(e), slope, curvature }
            }
            Measure::Angle(arcs) => {
                let mut sum =
                    Bent { value: 0.0, slope: Vector4::zeros(), curvature: Matrix4::zeros() };
                for (weight, arc) in arcs.iter().filter(|(weight, _)| *weight != 0.0) {
                    let Bent { value, slope, curvature } = arc.bent(e);
                    sum.value += weight * value;
                    sum.slope += slope * *weight;
                    sum.curvature += curvature * *weight;
                }
                sum
            }
        }
    }
}

impl Arc {
    fn bent(&self, e: &Vector4<f64>) -> Bent {
        let linear =
            |a: &Vector4<f64>| Bent { value: a.dot(e), slope: *a, curvature: Matrix4::zeros() };
        match self {
            Self::Of([a, b]) => argument(&linear(a), &linear(b)),
            Self::Between([first, second]) => argument(&size(first, e), &size(second, e)),
        }
    }
}

/// |(a·E, b·E)|.
fn size([a, b]: &[Vector4<f64>; 2], e: &Vector4<f64>) -> Bent {
    let both = SMatrix::<f64, 4, 2>::from_columns(&[*a, *b]);
    let at = both.tr_mul(e);
    let value = at.norm().max(LEAST);
    let slope = both * at / value;
    let curvature = (both * both.transpose() - slope * slope.transpose()) / value;
    Bent { value, slope, curvature }
}

/// arg (p, q) by the chain rule:
///
/// ```text
/// ∂ = (p ∂q − q ∂p)/s,   s = p² + q²,
/// ∂² = (2pq (∂p∂pᵀ − ∂q∂qᵀ) + (q² − p²)(∂p∂qᵀ + ∂q∂pᵀ))/s² + (p ∂²q − q ∂²p)/s
/// ```
fn argument(p: &Bent, q: &Bent) -> Bent {
    let (x, y) = (p.value, q.value);
    let s = (x * x + y * y).max(LEAST * LEAST);
    let (pp, qq) = (p.slope * p.slope.transpose(), q.slope * q.slope.transpose());
    let pq = p.slope * q.slope.transpose();
    let outer = (pp - qq) * (2.0 * x * y) + (pq + pq.transpose()) * (y * y - x * x);
    Bent {
        value: libm::atan2(y, x),
        slope: (q.slope * x - p.slope * y) / s,
        curvature: outer / (s * s) + (q.curvature * x - p.curvature * y) / s,
    }
}
