//! What the arguments of a fit amount to.

use super::data::{self, Data};
use super::names;
use super::refused;
use crate::cli::args::FitArgs;
use crate::cli::outcome::Failure;
use crate::cli::{input, scenario, shown};
use std::path::Path;
use tumble::fit::neighbourhood::Neighbourhood;
use tumble::fit::plan::{Plan, Sought};
use tumble::fit::{Constant, FitError, Model, Parameter, ParameterValues, Protocol};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::scenario::written;

/// A fit, checked.
pub struct Task {
    /// The scene's file name.
    pub file: String,
    pub scene: Scene,
    pub model: Model,
    pub protocol: Protocol,
    pub data: Data,
    pub start: ParameterValues,
    /// Nothing is sought where the values are only scored.
    pub plan: Plan,
    pub neighbours: usize,
    pub folds: usize,
    /// Starts of every toss.
    pub ensemble: usize,
}

impl Task {
    pub fn new(args: &FitArgs) -> Result<Self, Failure> {
        let in_scene = |error| Failure::Input(format!("{}: {error}", shown::path(&args.scene)));
        let scene = scene(&args.scene)?;
        let model = model(&scene).map_err(in_scene)?;
        let protocol = Protocol::new(&model, usize::from(args.substeps));
        let named = |flag: &str, text: &str| {
            let found = names::parameter(text, &scene, &model);
            found.map_err(|why| Failure::setting(flag, why))
        };
        let wanted = args.parameters.0.iter().map(|text| named("parameters", text));
        let wanted = wanted.collect::<Result<Vec<_>, _>>()?;
        let bounds = args.bounds.iter().map(|(text, bounds)| Ok((named("bounds", text)?, *bounds)));
        let bounds = bounds.collect::<Result<Vec<_>, Failure>>()?;
        let own = |values: ParameterValues, parameter: &Parameter| {
            values.with(*parameter, model.own(*parameter))
        };
        let mut start = wanted.iter().fold(model.values(), own);
        for (text, value) in &args.set {
            start = start.with(named("set", text)?, *value);
        }
        if let Some(constant) = start.contradicted() {
            let name = constant.name();
            let why = format!(
                "{name} is given as a whole and by one of its numbers; one of the two is needed"
            );
            return Err(Failure::Input(why));
        }
        let mut sought = Vec::new();
        for parameter in wanted {
            let given = bounds.iter().rfind(|(bounded, _)| *bounded == parameter);
            let bounds = match given {
                Some((_, bounds)) => *bounds,
                None => model.usual_bounds(parameter).map_err(|_| {
                    let (name, own) = (names::name(parameter, &scene), model.own(parameter));
                    let why =
                        format!("{name} is {own} in the scene; --bounds {name}=LOW:HIGH is needed");
                    Failure::setting("parameters", why)
                })?,
            };
            sought.push(Sought { parameter, bounds });
        }
        let plan = Plan {
            sought,
            loss: args.loss.into(),
            evaluations: args.evaluations,
            rounds: args.rounds,
            polish: args.polish,
            seed: args.seed,
        };
        let neighbours = args.neighbours.unwrap_or(if model.is_of_tosses() { 60 } else { 0 });
        if !plan.sought.is_empty() {
            plan.check(&start).map_err(refused)?;
            if neighbours > 0 {
                Neighbourhood::check(&plan, neighbours).map_err(refused)?;
            }
        }
        let is_sought = |wanted: &Parameter| plan.sought.iter().any(|s| s.parameter == *wanted);
        if let Some((parameter, _)) = bounds.iter().find(|(parameter, _)| !is_sought(parameter)) {
            let why =
                format!("{} is not looked for; leave it out", names::name(*parameter, &scene));
            return Err(Failure::setting("bounds", why));
        }
        if args.ensemble > 0 && !model.is_of_tosses() {
            let why = "an ensemble is of the starts of tosses of one body; leave it out";
            return Err(Failure::setting("ensemble", why));
        }
        // Before the data, which may take longer: a body that cannot be, a scene that fitted.toml cannot say.
        model.world(&start, 0.001)?;
        if !model.is_of_tosses() {
            written::text(&scene)?;
        }
        let bodies = (!model.is_of_tosses()).then_some(&scene.bodies[..]);
        let data = data::read(&args.data, args.rate, bodies)?;
        if data.tosses.len() == 1 && args.neighbours.is_some_and(|count| count > 0) {
            let why = "the uncertainty is that of other samples of the recordings, and there is one alone; leave it out";
            return Err(Failure::setting("neighbours", why));
        }
        if model.is_of_tosses() {
            let corners = model.corners(&start);
            for toss in &data.tosses {
                let checked = toss.check_against(&corners, start.get(Constant::Radius));
                checked.map_err(|error| data.named(toss, error))?;
            }
        }
        if args.folds > 0 && !plan.sought.is_empty() {
            tumble::fit::folds::parts(&data.tosses, args.folds, args.seed).map_err(refused)?;
        }
        Ok(Self {
            file: shown::path(&args.scene),
            scene,
            model,
            protocol,
            data,
            start,
            plan,
            neighbours,
            folds: args.folds,
            ensemble: args.ensemble,
        })
    }

    /// Whether parameters are looked for, or values only scored.
    pub fn is_search(&self) -> bool {
        !self.plan.sought.is_empty()
    }

    /// About how many evaluations there will be.
    pub fn evaluations(&self) -> usize {
        if self.is_search() {
            1 + (1 + self.folds) * (self.plan.evaluations + self.plan.polish + 2) + self.neighbours
        } else {
            1
        }
    }

    /// How many recordings there are, in words.
    pub fn recordings(&self) -> String {
        let count = self.data.tosses.len();
        match (self.model.is_of_tosses(), count) {
            (true, _) => format!("{count} tosses"),
            (false, 1) => "1 recording".to_owned(),
            (false, _) => format!("{count} recordings"),
        }
    }

    /// What those end as that turn farthest from what was recorded.
    pub fn ended_elsewhere(&self) -> &'static str {
        if self.model.is_of_tosses() { "on another face" } else { "that end more than 45° apart" }
    }

    /// All that evaluations depend on, as text: a state that was kept is of this fit if it says the
    /// same.
    pub fn fingerprint(&self) -> String {
        format!(
            "tumble {}; data {:016x}; {:?}; {:?}; {:?}; {:?}; {} neighbours, {} folds",
            env!("CARGO_PKG_VERSION"),
            self.data.digest,
            self.model,
            self.protocol,
            self.start,
            self.plan,
            self.neighbours,
            self.folds
        )
    }
}

/// One body that is thrown on a ground, or all that a scene has.
fn model(scene: &Scene) -> Result<Model, FitError> {
    let world = &scene.world;
    let is_thrown =
        world.bodies().len() == 1 && world.joints().is_empty() && world.fixed().is_empty();
    match is_thrown {
        true => Model::of_world(world),
        false if scene.model().is_none() => {
            Err(FitError::Scene("a table [[bodies]] is needed in place of [body]".to_owned()))
        }
        false => Model::of_bodies(world.clone(), scene.loads.clone(), scene.courses.clone()),
    }
}

/// The scene of a file.
fn scene(path: &Path) -> Result<Scene, Failure> {
    let text = scenario::read_text(path)?;
    let scene = Scene::of_text(&text, path, Settings::default(), &input::bytes)?;
    if scene.contact.is_none() {
        let why = "a table [ground] is needed: without a ground nothing lands";
        return Err(Failure::Input(format!("{}: {why}", shown::path(path))));
    }
    Ok(scene)
}
