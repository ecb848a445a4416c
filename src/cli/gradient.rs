//! `tumble gradient`: derivatives of a number that a run decides.

use super::args::{GradientArgs, Quantity};
use super::directory::OutputDirectory;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, say};
use super::scenario::read_text;
use super::signals::raise_on_signals;
use super::{input, shown};
use nalgebra::Vector3;
use serde::Serialize;
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::derivative::StateChange;
use tumble::error::Error;
use tumble::mechanics::{RigidBody, State, Wrench};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::simulation::{Checkpoints, Run, RunGradient, Simulation, StepRecord};
use tumble::step::StepStatus;
use tumble::world::Constant;

/// What a number is differentiated by.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Argument {
    /// Three numbers of the start, from this place among the twelve of a state's change.
    Start(&'static str, &'static str, usize),
    /// Three numbers of a wrench that acts through all steps, from this place.
    Push(&'static str, &'static str, usize),
    Constant(Constant),
}

const ARGUMENTS: [Argument; 6] = [
    Argument::Start("position", "m", 0),
    Argument::Start("turn", "rad", 3),
    Argument::Start("velocity", "m/s", 6),
    Argument::Start("spin", "rad/s", 9),
    Argument::Push("force", "N", 0),
    Argument::Push("torque", "N m", 3),
];

/// One derivative.
#[derive(Debug, Serialize)]
struct Row {
    argument: &'static str,
    /// Which of its numbers.
    component: usize,
    unit: &'static str,
    derivative: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    difference: Option<f64>,
}

/// What gradient.json says.
#[derive(Debug, Serialize)]
struct Report<'a> {
    scene: &'a str,
    of: String,
    body: &'a str,
    steps: u64,
    value: f64,
    /// m/s, and the step that it is of; null where nothing is near.
    margin: Option<(f64, u64)>,
    feature_margin: Option<(f64, u64)>,
    /// Steps that failed or are wild, in which features are not known as functions of the poses, and in which shares
    /// of forces follow the history.
    unsolved: u64,
    unknown: u64,
    kept: u64,
    /// Steps that took a part of their restitution.
    limited: u64,
    derivatives: &'a [Row],
}

/// `tumble gradient`.
pub fn run(args: &GradientArgs) -> Result<Outcome, Failure> {
    let arguments = arguments(&args.by)?;
    if args.differences.is_some_and(|by| !(by > 0.0 && by < 1.0)) {
        return Err(Failure::Input(
            "--differences: a size above 0 and below 1 is needed".to_owned(),
        ));
    }
    let text = read_text(&args.file)?;
    let flags = Settings {
        seed: args.seed,
        steps: args.steps.map(|steps| steps + 1),
        ..Settings::default()
    };
    let scene = Scene::of_text(&text, &args.file, flags, &input::bytes)?;
    if scene.solver() == "ipopt" {
        let why = "derivatives are those of steps that are solved to rounding; leave the solver out, \
                   or name the native one";
        return Err(Failure::Input(format!("{}: solver: {why}", shown::path(&args.file))));
    }
    let body = body_of(&scene, args.body.as_deref())?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let task = Task { scene: &scene, body, of: args.of, interrupt: &interrupt };
    let (value, found, rows) = match task.derivatives(&arguments, args.differences) {
        Ok(found) => found,
        Err(Stop::Interrupted) => return Ok(Outcome::Interrupted),
        Err(Stop::Failed(failure)) => return Err(failure),
    };
    let near = |(margin, at): (f64, u64)| margin.is_finite().then_some((margin, at));
    let report = Report {
        scene: &scene.name,
        of: name_of(args.of),
        body: &scene.bodies[body],
        steps: scene.rows - 1,
        value,
        margin: near(found.margin),
        feature_margin: near(found.feature_margin),
        unsolved: found.unsolved,
        unknown: found.unknown,
        kept: found.kept,
        limited: found.limited,
        derivatives: &rows,
    };
    let directory = OutputDirectory::for_pictures(&args.out)?;
    let (csv, json) = (
        PendingFile::create(&directory, "gradient.csv")?,
        PendingFile::create(&directory, "gradient.json")?,
    );
    csv.write(table(&rows).as_bytes())?;
    let text = serde_json::to_string_pretty(&report);
    let text = text.map_err(|error| Failure::Other(format!("gradient.json: {error}")))?;
    json.write((text + "\n").as_bytes())?;
    let (csv, json) = (csv.publish()?, json.publish()?);
    if !args.quiet {
        say(&(described(&report)
            + &format!("wrote {} and {}\n", shown::path(&csv), shown::path(&json))))?;
    }
    Ok(if found.unsolved > 0 { Outcome::Unconverged } else { Outcome::Done })
}

/// The word for a quantity.
fn name_of(quantity: Quantity) -> String {
    use clap::ValueEnum;
    quantity.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

fn arguments(words: &[String]) -> Result<Vec<Argument>, Failure> {
    let of_word = |word: &String| {
        let own = ARGUMENTS.into_iter().find(|argument| argument.name() == word);
        let constant = || Constant::of_name(word).filter(|constant| constant.has_derivative());
        own.or_else(|| constant().map(Argument::Constant)).ok_or_else(|| {
            let own = ARGUMENTS.iter().map(Argument::name);
            let constants = Constant::ALL.into_iter().filter(|constant| constant.has_derivative());
            let all: Vec<_> = own.chain(constants.map(Constant::name)).collect();
            Failure::Input(format!("--by: {word:?} is none; there are {}", all.join(", ")))
        })
    };
    words.iter().map(of_word).collect()
}

fn body_of(scene: &Scene, wanted: Option<&str>) -> Result<usize, Failure> {
    let Some(wanted) = wanted else { return Ok(0) };
    let by_name = scene.bodies.iter().position(|name| name == wanted);
    let by_index = || wanted.parse().ok().filter(|index| *index < scene.bodies.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let last = scene.bodies.len() - 1;
        let why = format!("the scene has no such body; its names and 0 to {last} are allowed");
        Failure::Input(format!("--body {wanted}: {why}"))
    })
}

/// Why it ended early.
enum Stop {
    Interrupted,
    Failed(Failure),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        match error {
            Error::Interrupted => Self::Interrupted,
            other => Self::Failed(Failure::Input(other.to_string())),
        }
    }
}

impl From<Failure> for Stop {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// A number of a scene's run.
struct Task<'a> {
    scene: &'a Scene,
    body: usize,
    of: Quantity,
    interrupt: &'a Arc<AtomicBool>,
}

/// The number, what is to be known of the run, and the derivatives.
type Found = (f64, RunGradient, Vec<Row>);

impl Task<'_> {
    fn derivatives(&self, arguments: &[Argument], by: Option<f64>) -> Result<Found, Stop> {
        let steps = self.scene.rows - 1;
        let constants: Vec<Constant> = arguments.iter().filter_map(Argument::constant).collect();
        let mut simulation = self.scene.simulation(self.interrupt)?;
        let start = simulation.states().to_vec();
        let mut before = |_: &mut Simulation<'_>| Ok(());
        let mut by_states = |k: u64, states: &[State]| {
            (k == steps).then(|| {
                let mut all = vec![StateChange::zero(); states.len()];
                all[self.body] = self.slope(&start[self.body], &states[self.body]);
                all
            })
        };
        let mut run = Run {
            steps,
            before: &mut before,
            by_states: &mut by_states,
            constants: &constants,
            checkpoints: Checkpoints::default(),
        };
        let mut found = simulation.gradient(&mut run)?;
        // The distance is from where it started.
        let back = self.slope_by_start(&start[self.body], &simulation.states()[self.body]);
        found.states[self.body] = found.states[self.body].plus(1.0, &back);
        let value = self.value(&start[self.body], &simulation.states()[self.body]);
        let mut rows = Vec::new();
        for argument in arguments {
            let numbers = self.numbers(argument, &found, &constants);
            for (component, derivative) in numbers.into_iter().enumerate() {
                let difference =
                    by.map(|by| self.difference(argument, component, by)).transpose()?;
                let (name, unit) = (argument.name(), argument.unit());
                rows.push(Row { argument: name, component, unit, derivative, difference });
            }
        }
        Ok((value, found, rows))
    }

    /// The derivatives by an argument.
    fn numbers(
        &self,
        argument: &Argument,
        found: &RunGradient,
        constants: &[Constant],
    ) -> Vec<f64> {
        match *argument {
            Argument::Start(.., from) => {
                found.states[self.body].to_array()[from..from + 3].to_vec()
            }
            Argument::Push(.., from) => {
                let each = found.wrenches.iter().map(|wrenches| &wrenches[self.body]);
                let sum = each.fold(Wrench::zero(), |sum, wrench| sum.plus(wrench));
                if from == 0 {
                    sum.force.as_slice().to_vec()
                } else {
                    sum.torque.as_slice().to_vec()
                }
            }
            Argument::Constant(constant) => {
                let place = constants.iter().position(|known| *known == constant);
                place.map_or(Vec::new(), |place| found.constants[place].clone())
            }
        }
    }

    /// The central difference by one number of an argument.
    fn difference(&self, argument: &Argument, component: usize, by: f64) -> Result<f64, Stop> {
        let apart = self.moved(argument, component, by)? - self.moved(argument, component, -by)?;
        Ok(apart / (2.0 * by))
    }

    /// The number where one of an argument is `by` more.
    fn moved(&self, argument: &Argument, component: usize, by: f64) -> Result<f64, Stop> {
        let mut scene = self.scene.clone();
        let mut push = None;
        match *argument {
            Argument::Start(.., from) => {
                let mut change = [0.0; StateChange::LEN];
                change[from + component] = by;
                let start = &mut scene.starts[self.body];
                *start = StateChange::from_array(&change).applied(start);
            }
            Argument::Push(.., from) => {
                let vector = Vector3::ith(component, by);
                let (force, torque) =
                    if from == 0 { (vector, Vector3::zeros()) } else { (Vector3::zeros(), vector) };
                push = Some(Wrench { force, torque });
            }
            Argument::Constant(constant) => {
                let mut numbers = constant.of(&scene.world);
                numbers[component] += by;
                scene.world = scene.world.with_constants(&[(constant, &numbers)])?;
            }
        }
        let mut simulation = scene.simulation(self.interrupt)?;
        if let Some(push) = push {
            simulation.set_wrench(self.body, push)?;
        }
        let start = simulation.states()[self.body];
        let mut record = StepRecord::new();
        for _ in 0..scene.rows - 1 {
            simulation.step(&mut record)?;
            if record.report.status == StepStatus::Failed {
                break;
            }
        }
        Ok(self.value(&start, &simulation.states()[self.body]))
    }

    fn mechanics(&self) -> &RigidBody {
        &self.scene.world.bodies()[self.body]
    }

    fn value(&self, start: &State, end: &State) -> f64 {
        let (r, v) = (&end.position, &end.velocity);
        match self.of {
            Quantity::X => r[0],
            Quantity::Y => r[1],
            Quantity::Z => r[2],
            Quantity::Vx => v[0],
            Quantity::Vy => v[1],
            Quantity::Vz => v[2],
            Quantity::Speed => v.norm(),
            Quantity::Distance => (r - start.position).norm(),
            Quantity::KineticEnergy => {
                let body = self.mechanics();
                let turning = end.spin.dot(&(body.inertia() * end.spin));
                0.5 * (body.mass() * v.norm_squared() + turning)
            }
        }
    }

    /// Its derivatives by the body's state at the end.
    fn slope(&self, start: &State, end: &State) -> StateChange {
        let zero = StateChange::zero();
        let (position, velocity) = (end.position - start.position, end.velocity);
        let unit = |v: Vector3<f64>| v.try_normalize(0.0).unwrap_or_default();
        match self.of {
            Quantity::X | Quantity::Y | Quantity::Z => {
                StateChange { position: Vector3::ith(self.of as usize, 1.0), ..zero }
            }
            Quantity::Vx | Quantity::Vy | Quantity::Vz => {
                StateChange { velocity: Vector3::ith(self.of as usize - 3, 1.0), ..zero }
            }
            Quantity::Speed => StateChange { velocity: unit(velocity), ..zero },
            Quantity::Distance => StateChange { position: unit(position), ..zero },
            Quantity::KineticEnergy => {
                let body = self.mechanics();
                let spin = body.inertia() * end.spin;
                StateChange { velocity: velocity * body.mass(), spin, ..zero }
            }
        }
    }

    /// Its derivatives by the start beyond those through the end.
    fn slope_by_start(&self, start: &State, end: &State) -> StateChange {
        match self.of {
            Quantity::Distance => StateChange::zero().plus(-1.0, &self.slope(start, end)),
            _ => StateChange::zero(),
        }
    }
}

impl Argument {
    fn name(&self) -> &'static str {
        match self {
            Self::Start(name, ..) | Self::Push(name, ..) => name,
            Self::Constant(constant) => constant.name(),
        }
    }

    fn unit(&self) -> &'static str {
        match self {
            Self::Start(_, unit, _) | Self::Push(_, unit, _) => unit,
            Self::Constant(Constant::Mass) => "kg",
            Self::Constant(Constant::Inertia) => "kg m²",
            Self::Constant(Constant::Size) => "",
            Self::Constant(constant) => constant.unit(),
        }
    }

    fn constant(&self) -> Option<Constant> {
        match self {
            Self::Constant(constant) => Some(*constant),
            _ => None,
        }
    }
}

/// gradient.csv.
fn table(rows: &[Row]) -> String {
    let mut text = "argument,component,unit,derivative,difference\n".to_owned();
    for Row { argument, component, unit, derivative, difference } in rows {
        let difference = difference.map_or(String::new(), |difference| difference.to_string());
        let _ = writeln!(text, "{argument},{component},{unit},{derivative},{difference}");
    }
    text
}

/// What stands on the terminal.
fn described(report: &Report<'_>) -> String {
    let Report { of, body, steps, value, .. } = report;
    let mut text = format!("{of} of {body} after {steps} steps: {value}\n");
    for Row { argument, component, unit, derivative, difference } in report.derivatives {
        let per = if unit.is_empty() { String::new() } else { format!(" per {unit}") };
        let beside = difference
            .map_or(String::new(), |difference| format!("  (difference {difference:.9e})"));
        let _ = writeln!(text, "  {argument:>11} {component}  {derivative:>18.9e}{per}{beside}");
    }
    let near = |text: &mut String, what, margin: Option<(f64, u64)>| {
        if let Some((margin, at)) = margin {
            let _ = writeln!(text, "nearest kink {what}: {margin:.1e} m/s, in step {at}");
        }
    };
    near(&mut text, "of a law or a touch", report.margin);
    near(&mut text, "of what touches", report.feature_margin);
    for (count, what) in [
        (report.unsolved, "not solved: what follows them is no derivative"),
        (report.unknown, "with features that are taken for fixed in their bodies"),
        (report.kept, "with forces whose shares follow the history"),
        (report.limited, "with a part of their restitution, which is taken for a constant"),
    ] {
        if count > 0 {
            let _ = writeln!(text, "{count} steps {what}");
        }
    }
    text
}
