//! Andrews' squeezing mechanism: seven bars, three closed loops, and a driving torque.
//!
//! Problem and notation are those of the Test Set for IVP Solvers (Mazzia and Magherini). The bars
//! K1 … K7 move in a plane. A constant torque turns the crank K1 about the origin. A spring from
//! the fixed point C acts on K3, which hangs on the fixed point B. K5 and K7 hang on the fixed
//! point A.

use crate::planar::{Bar, Linkage, PlanarBody, PlanarLoad, PlanarPin, PlanarSurface};
use crate::prelude::*;
use crate::runner::Torque;
use std::f64::consts::FRAC_PI_2;

/// Parameters with the names of the problem statement, in m, kg, kg m², N/m and N m. MASSES and
/// MOMENTS have one entry per bar, K1 … K7.
const MASSES: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const MOMENTS: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
const A: Vector2<f64> = Vector2::new(-0.06934, -0.00227);
const B: Vector2<f64> = Vector2::new(-0.03635, 0.03273);
const C: Vector2<f64> = Vector2::new(0.014, 0.072);
const SPRING: f64 = 4530.0;
const SLACK_LENGTH: f64 = 0.07785;
const TORQUE: f64 = 0.033;
const D: f64 = 0.028;
const DA: f64 = 0.0115;
const E: f64 = 0.02;
const EA: f64 = 0.01421;
const RR: f64 = 0.007;
const RA: f64 = 0.00092;
const SS: f64 = 0.035;
const SA: f64 = 0.01874;
const SB: f64 = 0.01043;
const SC: f64 = 0.018;
const SD: f64 = 0.02;
const TA: f64 = 0.02308;
const TB: f64 = 0.00916;
const U: f64 = 0.04;
const UA: f64 = 0.01228;
const UB: f64 = 0.00449;
const ZF: f64 = 0.02;
const ZT: f64 = 0.04;
const FA: f64 = 0.01421;

/// Initial joint angles β, Θ, γ, Φ, δ, Ω and ε (rad). The mechanism starts at rest.
const START: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.455_279_819_163_070_4,
    0.222_668_390_165_885_9,
    0.487_364_979_543_842_6,
    -0.222_668_390_165_885_9,
    1.230_547_444_549_821,
];
/// Published angles β, Θ, γ and Φ at the end (rad).
const END: [f64; 4] = [
    15.810_771_196_299_04,
    -15.756_371_059_842_98,
    0.040_822_240_130_731_01,
    -0.534_730_116_322_694_8,
];
const DURATION: f64 = 0.03; // s
/// Indices of the crank K1 and of the sprung bar K3.
const CRANK: usize = 0;
const SPRUNG: usize = 2;
const LONGEST_STEP: f64 = 1e-4; // The longest step, by the rotation of the crank, s

/// Andrews' squeezing mechanism: seven bars on ten pins, held nine times more often than they need,
/// which a torque on the crank turns around within 30 ms. Its angles are those of the IVP test set.
pub(crate) const SQUEEZER: TestProblem = TestProblem {
    name: "squeezer",
    time_step: 1e-5,
    bodies: 7,
    ..TestProblem::solved_by(squeezer)
};

/// The bars K1 … K7 (indices 0 … 6) with their ten pins, at the initial angles.
fn mechanism() -> Linkage {
    let [beta, theta, gamma, phi, delta, omega, epsilon] = START;
    let v = Vector2::new;
    let bars = MASSES.iter().zip(MOMENTS).map(|(&mass, moment)| Bar { mass, moment }).collect();
    let pin = |a: usize, at, b, there| PlanarPin { a, at, b, there };
    // Positions of the common point of K2, K3, K4 and K6 in the axes of each bar (m).
    let joined = [v(DA - D, 0.0), v(-SB, SA - SS), v(EA, 0.0), v(FA, 0.0)];
    let pins = vec![
        pin(0, v(-RA, 0.0), None, v(0.0, 0.0)),
        pin(1, v(DA, 0.0), Some(0), v(RR - RA, 0.0)),
        pin(2, v(-SB, SA), None, B),
        pin(4, v(-TA, -TB), None, A),
        pin(6, v(-UB, UA), None, A),
        pin(3, v(EA - E, 0.0), Some(4), v(ZT - TA, -TB)),
        pin(5, v(FA - ZF, 0.0), Some(6), v(-UB, UA - U)),
        pin(2, joined[1], Some(1), joined[0]),
        pin(3, joined[2], Some(1), joined[0]),
        pin(5, joined[3], Some(1), joined[0]),
    ];
    let angles =
        [beta, beta + theta, gamma, phi + delta - FRAC_PI_2, delta, omega + epsilon, epsilon];
    let mut start: Vec<_> =
        angles.iter().map(|angle| PlanarBody::at(v(0.0, 0.0), *angle)).collect();
    // Pairs (bar, pin): the bar's position follows from this pin and the bars placed before.
    for (body, pinned) in [(0, 0), (1, 1), (2, 2), (4, 3), (6, 4), (3, 5), (5, 6)] {
        let PlanarPin { at, b, there, .. } = pins[pinned];
        let held = b.map_or(there, |b: usize| start[b].point(&there));
        start[body].place = held - start[body].point(&at);
    }
    Linkage { plane: PlanarSurface::Level, bars, pins, start }
}

/// Length of the spring from C to the corner D of K3 at the angle γ (m), and its moment about B
/// (N m).
fn spring(gamma: f64) -> (f64, f64) {
    let (sin, cos) = gamma.sin_cos();
    let lever = Vector2::new(SD * cos + SC * sin, SD * sin - SC * cos);
    let along = B + lever - C;
    let length = along.norm();
    let force = along * (-SPRING * (length - SLACK_LENGTH) / length);
    (length, lever.perp(&force))
}

/// Runs the mechanism and compares its angles with two references.
///
/// The published angles solve the differential equation. [`Linkage::steps`] solves the discrete
/// scheme in the plane, and the run must agree with it up to its residuals. Velocities of the scheme belong to
/// the middle of a step, so they start half a step before time 0.
fn squeezer(_: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let h = runner.time_step;
    let why = format!("a step of {h} s turns the crank too far; allowed: up to {LONGEST_STEP} s");
    Refusal::when(h > LONGEST_STEP, why)?;
    let mut mechanism = mechanism();
    let loads = |now: &[PlanarBody]| {
        let mut loads: Vec<PlanarLoad> = vec![(Vector2::zeros(), 0.0); 7];
        loads[CRANK].1 = TORQUE;
        loads[SPRUNG].1 = spring(now[SPRUNG].angle).1;
        loads
    };
    let before = mechanism.accelerations(&loads(&mechanism.start));
    for (start, (along, about)) in mechanism.start.iter_mut().zip(before) {
        (start.velocity, start.spin) = (along * (-0.5 * h), about * (-0.5 * h));
    }
    let pull = |states: &[State]| spring(angle_about(2, &states[SPRUNG])).1;
    let torques: Vec<(usize, Torque)> = vec![(CRANK, |_| TORQUE), (SPRUNG, pull)];
    let run = runner.run(&Setup { torques, ..mechanism.setup(0.0, DURATION + h)? })?;
    let steps = run.steps();
    let (measured, discrete) = (mechanism.track(&run), mechanism.steps(h, steps, loads));
    // The joint angles β, Θ, γ and Φ from the angles of the bars.
    let [found, expected] = [&measured, &discrete].map(|track| {
        let a = |body: usize| track[steps - 1][body].angle;
        [a(0), a(1) - a(0), a(2), a(3) + FRAC_PI_2 - a(4)]
    });
    // Potential of the spring minus the work of the torque on the crank.
    let strayed = mechanism.energy_change(&measured, h, |at| {
        let stretch = spring(at[SPRUNG].angle).0 - SLACK_LENGTH;
        0.5 * SPRING * stretch * stretch - TORQUE * at[CRANK].angle
    });
    // Error of the crank's angle by the residuals of all steps, velocities at the radius RR (rad).
    let lacked = run.sum(|r| r.joint + r.momentum) * h / RR;
    let angle = |name: &'static str, k: usize| {
        equal((name, "rad"), found[k], END[k], 1e2 * lacked + 1e-10)
            .stepped(expected[k], order(2, DURATION / h))
    };
    let gap = mechanism.worst_gap(&measured);
    Ok(vec![
        angle("β at 0.03 s", 0),
        angle("Θ at 0.03 s", 1),
        angle("γ at 0.03 s", 2),
        angle("Φ at 0.03 s", 3),
        at_most(("largest way of a pin from its place", "m"), gap, 1e-12),
        at_most(("energy less work, its largest change", "J"), strayed, 1e6 * h * h),
    ])
}
