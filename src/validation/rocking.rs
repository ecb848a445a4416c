//! A tall box that is tilted over an edge and falls back.

use super::edge::{Edges, Planar};
use super::prelude::*;

/// μ: enough for the edge not to slip.
const FRICTION: f64 = 1.0;
/// Corners as low as this may carry a force, m.
const BAND: f64 = crate::contact::detection::CONTACT_BAND;

/// A face tilted by no more than this has landed, rad.
const LANDED: f64 = 1e-6;

/// A tall box, a to the edge and c to the top, that turns about the edge x = a.
pub(super) struct TallBox {
    pub half_sides: Vector3<f64>,
    pub mass: f64,
    pub gravity: f64,
}

impl TallBox {
    pub fn new(inputs: &Inputs) -> Result<Self, Unsuitable> {
        Ok(Self {
            half_sides: Vector3::new(0.1, 0.1, 0.3),
            mass: inputs.get(Input::Mass)?,
            gravity: inputs.get(Input::Gravity)?,
        })
    }

    /// R = √(a² + c²): from the edge to the centre, m.
    pub fn radius(&self) -> f64 {
        self.half_sides[0].hypot(self.half_sides[2])
    }

    /// α = atan(a/c): the tilt at which the centre is above the edge, rad.
    pub fn balance(&self) -> f64 {
        self.half_sides[0].atan2(self.half_sides[2])
    }

    /// I = ⁴⁄₃ m R²: the inertia about the edge, kg m².
    pub fn inertia(&self) -> f64 {
        4.0 / 3.0 * self.mass * self.radius().powi(2)
    }

    /// √(2 m g (R − c)/I): the spin that just reaches the balance, rad/s, from the energy
    /// ½ I ω² = m g (R − c).
    pub fn critical_spin(&self) -> f64 {
        let rise = self.radius() - self.half_sides[2];
        (2.0 * self.mass * self.gravity * rise / self.inertia()).sqrt()
    }

    /// √(I/(m g R)): the time in which a tilt from the balance grows e-fold, s.
    pub fn growth_time(&self) -> f64 {
        (self.inertia() / (self.mass * self.gravity * self.radius())).sqrt()
    }

    /// m g a/I: how fast gravity slows the tilt at its start, rad/s².
    pub fn deceleration(&self) -> f64 {
        self.mass * self.gravity * self.half_sides[0] / self.inertia()
    }

    /// Upright and turning about the edge with `spin`.
    pub fn pushed(&self, spin: f64) -> State {
        let mut start = resting(self.half_sides[2]);
        start.spin = Vector3::new(0.0, spin, 0.0);
        // v = ω × (r − p) with r − p = (−a, 0, c).
        start.velocity = Vector3::new(spin * self.half_sides[2], 0.0, spin * self.half_sides[0]);
        start
    }

    /// The same, and what follows by the step's own equations: the tilt (rad) and spin
    /// (rad/s) of each state, for `steps` or until `past` a state.
    pub fn discrete(
        &self,
        spin: f64,
        (h, steps): (f64, usize),
        past: impl Fn(f64, f64) -> bool,
    ) -> Vec<(f64, f64)> {
        let (a, c) = (self.half_sides[0], self.half_sides[2]);
        let half_sides = Vector2::new(a, c);
        let (gravity, friction) = (self.gravity, FRICTION);
        let edges = Edges { half_sides, gravity, friction, time_step: h };
        let velocity = Vector2::new(spin * c, spin * a);
        let mut state = Planar { position: Vector2::new(0.0, c), tilt: 0.0, velocity, spin };
        let mut motion = vec![(0.0, spin)];
        for _ in 0..steps {
            let Some(next) = edges.step(&state) else { break };
            state = next;
            motion.push((state.tilt, state.spin));
            if past(state.tilt, state.spin) {
                break;
            }
        }
        motion
    }

    /// The change of the spin at the start, ω, that does as much to the motion as the
    /// residuals of `run`, rad/s.
    ///
    /// A change of spin or tilt matters the less the later it comes, in energy: I ω_k δω_k
    /// and m g R sin(α − φ) δφ_k are no more than I ω δω for δω = δω_k and m g a/(I ω) δφ_k.
    /// Let d_k be the vector from the edge to the centre and U_k all that the centre's
    /// velocity has besides (d_k − d_{k−1})/h: an edge that lifts (2 δ_n) or slips (2 δ_f,
    /// by (b) of `slack.rs` with τ ≤ ⁶⁄₇), and what the positions lack. About the edge
    ///
    /// ```text
    /// (I/m) Σ δω_k = Σ d_k × (U_{k+1} − U_k),   |.| ≤ 3 R max U
    /// ```
    ///
    /// by summation in parts, for a motion of at most one radian in all; I = ⁴⁄₃ m R². What
    /// velocities lack counts in full, and so does a force δ_n on each corner of the other
    /// edge, 2a away, as long as it is low enough for one.
    pub fn spin_slack(&self, run: &Run, spin: f64) -> f64 {
        let (h, radius) = (run.time_step, self.radius());
        let reach = self.half_sides.amax();
        let astray = 2.0 * run.largest(|residual| residual.normal + residual.friction)
            + run.largest(|residual| residual.kinematics);
        let pushed = run.sum(|residual| residual.momentum) * (0.75 / radius + 0.25 / reach);
        let low = |state: &State| 2.0 * self.half_sides[0] * tilt(state).sin() < BAND;
        let touched = run.residuals.iter().zip(run.states(0)).filter(|(_, state)| low(state));
        let touched: f64 = touched.map(|(residual, _)| residual.normal).sum();
        let turned = h / reach * run.sum(|residual| residual.kinematics);
        let rounding = run.rounding(spin) + 16.0 * f64::EPSILON / h;
        3.0 * astray / radius
            + pushed
            + 3.0 * self.half_sides[0] / radius.powi(2) * touched
            + self.deceleration() / spin * turned
            + rounding
    }

    /// Friction enough for the edge not to slip, and as long as the motion takes.
    pub fn setup(&self, start: State, duration: f64) -> Result<Setup, Unsuitable> {
        let bodies = vec![Subject::solid_box(self.mass, self.half_sides, start)?];
        Ok(Setup::new(bodies, self.gravity, FRICTION, duration))
    }
}

/// The tilt about the y axis, rad.
pub(super) fn tilt(state: &State) -> f64 {
    2.0 * state.attitude[2].atan2(state.attitude[0])
}

/// A tall box on its edge.
pub static ROCKING: Posed = Posed {
    name: "rocking",
    about: "A tall box turns about an edge with a share (speed) of the spin that would topple it, \
            rises as far as its energy goes, falls back, and keeps 1 − ³⁄₂ sin²α of its spin when \
            its face meets the ground.",
    time_step: 0.001,
    inputs: &[(Input::Mass, 3.0), EARTH, (Input::Speed, 0.9)],
    unit_of_speed: "of the spin that topples it",
    ..Posed::by(rocking)
};

/// About the edge the energy ½ I ω² + m g R cos(α − φ) stays, up to the peak φ:
///
/// ```text
/// R cos(α − φ) = c + I ω²/(2 m g)
/// ```
///
/// When the face meets the ground again the box goes on about the other edge, whose
/// angular momentum the impact keeps (Housner 1963): ω⁺ = (1 − ³⁄₂ sin²α) ω⁻.
///
/// The step's motion is the recurrence of `edge.rs`, through the impact as well. Its spin
/// lags by up to a step of deceleration, m g a h/I, and the spins about the impact are
/// those of whole steps, up to two from it: how the steps fall decides.
fn rocking(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let tall = TallBox::new(inputs)?;
    let share = inputs.get(Input::Speed)?;
    Unsuitable::when(!(0.3..=0.98).contains(&share), || {
        format!("speed is {share}, a share of the spin that topples the box; 0.3 to 0.98 is needed")
    })?;
    let spin = share * tall.critical_spin();
    let (h, rise) = (laboratory.time_step(), spin / tall.deceleration());
    Unsuitable::when(rise < 2.0 * h, || {
        format!("the box rises for {rise:.3} s, which is less than two steps of {h} s")
    })?;
    let setup = tall.setup(tall.pushed(spin), 15.0 * tall.growth_time())?;
    // A little longer than until the face meets the ground.
    let beyond = -0.1 * tall.balance();
    let run = laboratory.run_until(&setup, &mut |step| tilt(&step.after[0]) < beyond)?;

    let (alpha, radius, fine) = (tall.balance(), tall.radius(), tall.growth_time() / h);
    let weight = tall.mass * tall.gravity;
    let rise = tall.half_sides[2] + 0.5 * tall.inertia() * spin * spin / weight;
    let peak = alpha - (rise / radius).acos();
    let motion: Vec<_> = run.states(0).iter().map(|state| (tilt(state), state.spin[1])).collect();
    let most = (setup.duration / h).round() as usize;
    let discrete = |spin: f64| tall.discrete(spin, (h, most), |tilt, _| tilt < beyond);
    let swing = Swing::of(&discrete(spin));

    // What a change of the first spin does, by the recurrence itself.
    let change = tall.spin_slack(&run, spin);
    let trial = change.max(1e-7 * spin);
    let [less, more] = [-trial, trial].map(|change| Swing::of(&discrete(spin + change)));
    let effect = |of: fn(&Swing) -> f64| {
        let moved = (of(&less) - of(&swing)).abs().max((of(&more) - of(&swing)).abs());
        2.0 * change / trial * moved
    };
    let measured = Swing::of(&motion);
    let bound = 2.0 * tall.deceleration() * h / swing.before;
    Ok(Findings {
        quantities: vec![
            exactly(("peak tilt", "rad"), measured.peak, peak, effect(|swing| swing.peak))
                .in_steps(swing.peak, Convergence::order(1, fine)),
            exactly(
                ("spin kept at impact", "1"),
                measured.kept,
                1.0 - 1.5 * alpha.sin().powi(2),
                effect(|swing| swing.kept) + 2.0 * change / swing.before,
            )
            .in_steps(swing.kept, Convergence::within(bound, fine)),
        ],
        curve: run.curve(("tilt", "rad"), 0, tilt),
    })
}

/// What is measured of a box that rises and falls back.
struct Swing {
    /// The largest tilt, rad.
    peak: f64,
    /// The largest spin in the four steps before the face meets the ground, rad/s.
    before: f64,
    /// The spin two steps later, as a share of it.
    kept: f64,
}

impl Swing {
    /// From the tilts and spins of the states.
    fn of(motion: &[(f64, f64)]) -> Self {
        let peak = motion.iter().map(|(tilt, _)| *tilt).fold(0.0, f64::max);
        let back = motion.iter().position(|&(tilt, spin)| spin < 0.0 && tilt <= LANDED);
        let Some(back) = back else { return Self { peak, before: f64::NAN, kept: f64::NAN } };
        let falling = &motion[back.saturating_sub(4)..back];
        let before = falling.iter().map(|(_, spin)| -spin).fold(f64::NAN, f64::max);
        let after = motion.get(back + 1).map_or(f64::NAN, |(_, spin)| -spin);
        Self { peak, before, kept: after / before }
    }
}
