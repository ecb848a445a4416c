//! Problems with a closed-form answer, for any solver of the contact step.
//!
//! Each [`Problem`] poses one or more runs, lets a [`Laboratory`] simulate them with the
//! solver under test, and compares what came out with two answers. The *exact* one is that
//! of the continuous problem: Newton's and Coulomb's laws, solved by hand. The *discrete*
//! one is what the step of `docs/formulation.md` makes of the same motion: its equations for
//! this motion, summed over the steps in closed form, or as a recurrence of one unknown
//! where there is no such sum. Both stand above the code that computes them, one file a
//! problem, and nothing of the simulator's mechanics is called for them.
//!
//! A [`Quantity`] holds if what was measured is the discrete answer to within rounding and
//! what the residuals of the run's steps allow (`slack.rs`). How the discrete answer comes
//! to the exact one as the time step shrinks is declared for each ([`Convergence`]) and
//! checked ([`Quantity::converges`]).

mod arch;
mod axis;
mod blocks;
mod bouncing;
mod bricard;
mod chain;
mod collision;
mod compass;
mod cradle;
mod crank;
mod dominoes;
mod door;
mod dragging;
mod edge;
mod elastic;
mod falling;
mod grid;
mod heap;
mod incline;
mod inputs;
mod laboratory;
mod leaning;
mod pair;
mod pendulum;
mod planar;
mod prelude;
mod quantity;
mod residual;
mod rocking;
mod rolling;
mod slack;
mod slope;
mod spinning;
mod squeezer;
mod stack;
mod stewart;
mod stopping;
mod threshold;
mod toppling;
mod tumbling;
mod turntable;
mod windows;

pub use inputs::{Input, Inputs};
pub use laboratory::{Laboratory, MakeSolver, Run, Setup, Subject, Taken, Torque, Until};
pub use quantity::{Claim, Convergence, Quantity};
pub use residual::Residual;

use crate::error::Error;
use quantity::Label;

/// A problem with an answer.
pub trait Problem: Sync {
    /// The word by which it is asked for.
    fn name(&self) -> &'static str;

    /// What happens in it and what the answer is, in a sentence or two; formulas in
    /// Unicode.
    fn about(&self) -> &'static str;

    /// The numbers it depends on, with their usual values.
    fn inputs(&self) -> Inputs;

    /// How many bodies are in it.
    fn bodies(&self) -> usize {
        1
    }

    /// Why it is not asked of Ipopt, in words that follow its name; `None` where it is.
    fn beyond_ipopt(&self) -> Option<&'static str> {
        None
    }

    /// The unit of `input` in it.
    fn unit(&self, input: Input) -> &'static str {
        input.unit()
    }

    /// Simulates it and compares.
    ///
    /// # Errors
    /// [`Unsuitable`] inputs, for which the closed form is not the answer.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable>;
}

/// What solving a problem comes to.
type Solved = Result<Findings, Unsuitable>;

/// A problem of [`PROBLEMS`]: what is told of it, and the function that solves it.
struct Posed {
    name: &'static str,
    about: &'static str,
    /// Usually, s.
    time_step: f64,
    /// With their usual values.
    inputs: &'static [(Input, f64)],
    bodies: usize,
    beyond_ipopt: Option<&'static str>,
    /// Of [`Input::Speed`].
    unit_of_speed: &'static str,
    solve: fn(&Inputs, &mut Laboratory<'_>) -> Solved,
}

impl Posed {
    /// A problem of one body that any solver is asked, yet without a name.
    const fn by(solve: fn(&Inputs, &mut Laboratory<'_>) -> Solved) -> Self {
        Self {
            name: "",
            about: "",
            time_step: 0.0,
            inputs: &[],
            bodies: 1,
            beyond_ipopt: None,
            unit_of_speed: "m/s",
            solve,
        }
    }
}

impl Problem for Posed {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn inputs(&self) -> Inputs {
        Inputs::new(self.time_step, self.inputs)
    }

    fn bodies(&self) -> usize {
        self.bodies
    }

    fn beyond_ipopt(&self) -> Option<&'static str> {
        self.beyond_ipopt
    }

    fn unit(&self, input: Input) -> &'static str {
        if input == Input::Speed { self.unit_of_speed } else { input.unit() }
    }

    fn solve(&self, inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
        (self.solve)(inputs, laboratory)
    }
}

/// All problems, in the order of a first reading.
pub static PROBLEMS: [&dyn Problem; 43] = [
    &falling::FREE_FALL,
    &stopping::SLIDING_STOP,
    &slope::STICK,
    &slope::SLIDE,
    &stopping::FAST_PLATE,
    &spinning::SPINNING_BOX,
    &compass::COMPASS,
    &dragging::DRAGGED_CUBE,
    &rocking::ROCKING,
    &toppling::PUSHED_OVER,
    &toppling::SLOPE_TOPPLE,
    &tumbling::TUMBLE,
    &bouncing::BOUNCING_BOX,
    &bouncing::EDGE_IMPACT,
    &rolling::ROLLING_BALL,
    &rolling::SLIDING_BALL,
    &leaning::LADDER,
    &stack::STACK,
    &stack::MASS_RATIO,
    &collision::COLLISION,
    &collision::BALL_CHAIN,
    &cradle::CRADLE,
    &elastic::BOUNCING_BALLS,
    &pair::PAIR_IN_FLIGHT,
    &blocks::BLOCKS_ON_SLOPE,
    &blocks::PULLED_BLOCK,
    &leaning::CARD_TENT,
    &turntable::TURNTABLE,
    &arch::ARCH,
    &dominoes::DOMINOES,
    &grid::BALL_GRID,
    &heap::BALLS_666,
    &heap::ELASTIC_666,
    &pendulum::PENDULUM,
    &pendulum::STIFF_HINGE,
    &pendulum::SERVO,
    &crank::SLIDER_CRANK,
    &chain::FREE_CHAIN,
    &door::DOOR,
    &windows::FOUR_BAR_WINDOWS,
    &bricard::BRICARD,
    &squeezer::SQUEEZER,
    &stewart::STEWART,
];

/// The problem of that name.
#[must_use]
pub fn find(name: &str) -> Option<&'static dyn Problem> {
    PROBLEMS.iter().copied().find(|problem| problem.name() == name)
}

/// What a problem found out.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Measured, and what they should be.
    pub quantities: Vec<Quantity>,
    /// One of them over time, to be drawn.
    pub curve: Curve,
}

/// A quantity over time, as it was simulated and as the closed form has it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// What is drawn, in words.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// t, s.
    pub times: Vec<f64>,
    /// From the simulation.
    pub measured: Vec<f64>,
    /// From the closed form; NaN where it says nothing.
    pub exact: Vec<f64>,
}

impl Curve {
    /// `measured` of every state of `run`, beside nothing.
    fn of((name, unit): Label, run: &Run, measured: impl Fn(usize) -> f64) -> Self {
        let times: Vec<f64> = (0..run.states(0).len()).map(|k| run.time(k)).collect();
        let measured = (0..times.len()).map(measured).collect();
        Self { name, unit, measured, exact: vec![f64::NAN; times.len()], times }
    }

    /// The same beside `exact` of its times.
    fn beside(self, exact: impl Fn(f64) -> f64) -> Self {
        Self { exact: self.times.iter().map(|&t| exact(t)).collect(), ..self }
    }
}

/// Why a problem cannot be posed with these inputs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsuitable {
    /// The model refuses a number.
    #[error(transparent)]
    Model(#[from] Error),
    /// The closed form is the answer of another motion.
    #[error("{0}")]
    Motion(String),
}

impl Unsuitable {
    /// Refuses, in these words, what `is_so`.
    fn when(is_so: bool, words: impl FnOnce() -> String) -> Result<(), Self> {
        if is_so { Err(Self::Motion(words())) } else { Ok(()) }
    }
}
