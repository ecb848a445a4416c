//! A tall box that is tilted over an edge and falls back.

use crate::edge::{Edges, Planar, tilt};
use crate::prelude::*;
use std::array::from_fn;
use std::iter::successors;
use tumble_core::contact::detection::CONTACT_BAND;

const FRICTION: f64 = 1.0; // μ: the edge does not slip
const LANDED: f64 = 1e-6; // A face with a smaller tilt has landed, rad

/// A tall box, a wide to the edge and c to the top, that turns about the edge x = a.
pub(crate) struct TallBox {
    pub half_sides: Vector3<f64>,
    pub mass: f64,
    pub gravity: f64,
}

impl TallBox {
    pub fn new(inputs: &TestInputs) -> Result<Self, Refusal> {
        let [mass, gravity] = inputs.all([Mass, Gravity])?;
        Ok(Self { half_sides: v3(0.1, 0.1, 0.3), mass, gravity })
    }

    /// R = √(a² + c²), from the edge to the centre, m.
    pub fn radius(&self) -> f64 {
        self.half_sides[0].hypot(self.half_sides[2])
    }

    /// The tilt α = atan(a/c) with the centre above the edge, rad.
    pub fn balance(&self) -> f64 {
        self.half_sides[0].atan2(self.half_sides[2])
    }

    /// The moment of inertia I = ⁴⁄₃ m R² about the edge, kg m².
    pub fn inertia(&self) -> f64 {
        4.0 / 3.0 * self.mass * self.radius().powi(2)
    }

    /// The spin √(2 m g (R − c)/I) that just reaches the balance, rad/s.
    pub fn critical_spin(&self) -> f64 {
        let rise = self.radius() - self.half_sides[2];
        (2.0 * self.mass * self.gravity * rise / self.inertia()).sqrt()
    }

    /// The time √(I/(m g R)) in which a tilt from the balance grows e-fold, s.
    pub fn growth_time(&self) -> f64 {
        (self.inertia() / (self.mass * self.gravity * self.radius())).sqrt()
    }

    /// The deceleration m g a/I by gravity at the start, rad/s².
    pub fn deceleration(&self) -> f64 {
        self.mass * self.gravity * self.half_sides[0] / self.inertia()
    }

    /// Upright and turning about the edge: v = ω × (r − p) with r − p = (−a, 0, c).
    pub fn pushed(&self, spin: f64) -> State {
        let velocity = v3(spin * self.half_sides[2], 0.0, spin * self.half_sides[0]);
        State { spin: v3(0.0, spin, 0.0), velocity, ..resting(self.half_sides[2]) }
    }

    /// The scheme with steps of `h` (s).
    pub fn edges(&self, h: f64) -> Edges {
        let (half_sides, gravity) = (self.half_sides.xz(), self.gravity);
        Edges { half_sides, gravity, friction: FRICTION, time_step: h }
    }

    /// The scheme's motion from [`Self::pushed`], for `duration` or until a state is `past`.
    pub fn discrete(
        &self,
        h: f64,
        spin: f64,
        duration: f64,
        past: impl Fn(&Planar) -> bool,
    ) -> Vec<Planar> {
        let (edges, steps) = (self.edges(h), (duration / h).round() as usize);
        let motion = successors(Some(Planar::from_state(&self.pushed(spin))), |state| {
            if past(state) { None } else { edges.step(state) }
        });
        motion.take(steps + 1).collect()
    }

    /// The effect of changing the initial spin by `change` on the result of `motion`, as the
    /// largest difference from `expected`.
    pub fn effect<const N: usize>(
        spin: f64,
        change: f64,
        expected: &[f64; N],
        motion: impl Fn(f64) -> [f64; N],
    ) -> [f64; N] {
        let trial = change.max(1e-7 * spin);
        let [less, more] = [-trial, trial].map(|change| motion(spin + change));
        from_fn(|i| {
            let moved = (less[i] - expected[i]).abs().max((more[i] - expected[i]).abs());
            2.0 * change / trial * moved
        })
    }

    /// The change of the spin at the start with the effect of the residuals of `run`, rad/s
    /// (docs/validation.md, "Tall boxes and dominoes").
    pub fn spin_tolerance(&self, run: &TestRun, spin: f64) -> f64 {
        let (h, radius) = (run.time_step, self.radius());
        let reach = self.half_sides.amax();
        let astray = 2.0 * run.largest(|r| r.normal + r.friction) + run.largest(|r| r.kinematics);
        let pushed = run.sum(|r| r.momentum) * (0.75 / radius + 0.25 / reach);
        let low = |state: &State| 2.0 * self.half_sides[0] * tilt(state).sin() < CONTACT_BAND;
        let touched = run.residuals.iter().zip(run.states(0)).filter(|(_, state)| low(state));
        let touched: f64 = touched.map(|(residual, _)| residual.normal).sum();
        let turned = h / reach * run.sum(|r| r.kinematics);
        let rounding = run.rounding(spin) + 16.0 * f64::EPSILON / h;
        3.0 * astray / radius
            + pushed
            + 3.0 * self.half_sides[0] / radius.powi(2) * touched
            + self.deceleration() / spin * turned
            + rounding
    }

    pub fn setup(&self, start: State, duration: f64) -> Result<Setup, Refusal> {
        Ok(Setup::from_box(self.mass, self.half_sides, start, self.gravity, FRICTION, duration)?)
    }
}

/// A tall box turns about an edge with a share (speed) of the spin that would topple it, rises as
/// far as its energy goes, falls back, and keeps 1 − ³⁄₂ sin²α of its spin when its face meets the
/// ground.
pub(crate) const ROCKING: TestProblem = TestProblem {
    name: "rocking",
    time_step: 0.001,
    inputs: &[(Mass, 3.0), EARTH, (Speed, 0.9)],
    ..TestProblem::solved_by(rocking)
};

/// R cos(α − φ) = c + I ω²/(2 m g) at the peak. ω⁺ = (1 − ³⁄₂ sin²α) ω⁻ in the impact (Housner
/// 1963).
fn rocking(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let tall = TallBox::new(inputs)?;
    let [share] = inputs.all([Speed])?;
    let why = format!(
        "speed is {share}, a share of the spin that topples the box; 0.3 to 0.98 is needed"
    );
    Refusal::when(!(0.3..=0.98).contains(&share), why)?;
    let spin = share * tall.critical_spin();
    let (h, rise) = (runner.time_step, spin / tall.deceleration());
    let why = format!(
        "the box rises for {rise:.3} s, less than two steps of {h} s; use a smaller time step"
    );
    Refusal::when(rise < 2.0 * h, why)?;
    let setup = tall.setup(tall.pushed(spin), 15.0 * tall.growth_time())?;
    // A little longer than until the face meets the ground.
    let beyond = -0.1 * tall.balance();
    let run = runner.run_until(&setup, |step| tilt(&step.after[0]) < beyond)?;

    let (alpha, radius, fine) = (tall.balance(), tall.radius(), tall.growth_time() / h);
    let rise = tall.half_sides[2] + 0.5 * tall.inertia() * spin * spin / (tall.mass * tall.gravity);
    let peak = alpha - (rise / radius).acos();
    let motion: Vec<_> = run.states(0).iter().map(Planar::from_state).collect();
    let discrete =
        |spin: f64| swing(&tall.discrete(h, spin, setup.duration, |state| state.tilt < beyond));
    let (measured, expected) = (swing(&motion), discrete(spin));

    let change = tall.spin_tolerance(&run, spin);
    let effect = TallBox::effect(spin, change, &expected, discrete);
    let [_, expected_kept, before] = expected;
    let kept = effect[1] + 2.0 * change / before;
    let bound = 2.0 * tall.deceleration() * h / before;
    let housner = 1.0 - 1.5 * alpha.sin().powi(2);
    Ok(vec![
        equal(("peak tilt", "rad"), measured[0], peak, effect[0])
            .stepped(expected[0], order(1, fine)),
        equal(("spin kept at impact", "1"), measured[1], housner, kept)
            .stepped(expected_kept, within(bound, fine)),
    ])
}

/// Results of a box that rises and falls back. They are the largest tilt (rad), the share of spin
/// two steps after the face meets the ground, and the largest spin in the four previous steps
/// (rad/s).
fn swing(motion: &[Planar]) -> [f64; 3] {
    let peak = largest(motion.iter().map(|state| state.tilt));
    let back = motion.iter().position(|state| state.spin < 0.0 && state.tilt <= LANDED);
    let Some(back) = back else { return [peak, f64::NAN, f64::NAN] };
    let falling = &motion[back.saturating_sub(4)..back];
    let before = falling.iter().map(|state| -state.spin).fold(f64::NAN, f64::max);
    let after = motion.get(back + 1).map_or(f64::NAN, |state| -state.spin);
    [peak, after / before, before]
}
