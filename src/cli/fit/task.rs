//! What the arguments of a fit amount to.

use super::data::{self, Data};
use super::refused;
use crate::cli::args::FitArgs;
use crate::cli::outcome::Failure;
use crate::cli::{input, scenario, shown};
use std::path::Path;
use tumble::fit::neighbourhood::Neighbourhood;
use tumble::fit::plan::{Plan, Sought};
use tumble::fit::{Constant, Model, ParameterValues, Protocol};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::world::World;

/// A fit, checked.
pub struct Task {
    /// The scene's file name.
    pub scene: String,
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
        let model = Model::of_world(&world(&args.scene)?).map_err(in_scene)?;
        let protocol = Protocol::new(&model, usize::from(args.substeps));
        let mut start = model.values();
        for &(parameter, value) in &args.set {
            start = start.with(parameter, value);
        }
        let sought = args.parameters.0.iter().map(|&parameter| Sought {
            parameter,
            bounds: args
                .bounds
                .iter()
                .rfind(|(bounded, _)| *bounded == parameter)
                .map_or_else(|| model.usual_bounds(parameter), |(_, bounds)| *bounds),
        });
        let plan = Plan {
            sought: sought.collect(),
            loss: args.loss.into(),
            evaluations: args.evaluations,
            rounds: args.rounds,
            polish: args.polish,
            seed: args.seed,
        };
        if !plan.sought.is_empty() {
            plan.check(&start).map_err(refused)?;
            if args.neighbours > 0 {
                Neighbourhood::check(&plan, args.neighbours).map_err(refused)?;
            }
        }
        let idle = args.bounds.iter().find(|(parameter, _)| !args.parameters.0.contains(parameter));
        if let Some((parameter, _)) = idle {
            let why = format!("{} is not looked for; leave it out", parameter.name());
            return Err(Failure::setting("bounds", why));
        }
        // Before the data, which may take longer: a body that cannot be.
        model.world(&start, 0.001)?;
        let data = data::read(&args.data, args.rate)?;
        let corners = model.corners(&start);
        for toss in &data.tosses {
            let checked = toss.check_against(&corners, start.get(Constant::Radius));
            checked.map_err(|error| data.named(toss, error))?;
        }
        if args.folds > 0 && !plan.sought.is_empty() {
            tumble::fit::folds::parts(&data.tosses, args.folds, args.seed).map_err(refused)?;
        }
        Ok(Self {
            scene: shown::path(&args.scene),
            model,
            protocol,
            data,
            start,
            plan,
            neighbours: args.neighbours,
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

/// The world of a scenario.
fn world(path: &Path) -> Result<World, Failure> {
    let text = scenario::read_text(path)?;
    let scene = Scene::of_text(&text, path, Settings::default(), &input::bytes)?;
    if scene.contact.is_none() {
        let why = "a table [ground] is needed: without a ground nothing lands";
        return Err(Failure::Input(format!("{}: {why}", shown::path(path))));
    }
    Ok(scene.world)
}
