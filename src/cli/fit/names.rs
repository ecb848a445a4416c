//! Parameters in the words of the command line: `joint_damping` of all joints together, `joint_damping:elbow` of one.

use tumble::scenario::label::{label, unit};
use tumble::fit::{Constant, Model, Parameter, sought};
use tumble::scenario::scene::Scene;

/// The parameter that `text` names.
///
/// # Errors
/// A sentence: what there is.
pub fn parameter(text: &str, scene: &Scene, model: &Model) -> Result<Parameter, String> {
    let (name, of) = match text.split_once(':') {
        Some((name, of)) => (name.trim(), Some(of.trim())),
        None => (text.trim(), None),
    };
    let constant = match Constant::of_name(name) {
        Some(constant) => constant,
        None if model.is_of_tosses() => sought(name)?,
        None => {
            let known =
                Constant::ALL.into_iter().filter(|constant| *constant != Constant::TimeStep);
            let known: Vec<_> = known.map(Constant::name).collect();
            return Err(format!("{name:?} is no parameter; there are {}", known.join(", ")));
        }
    };
    let Some(of) = of else { return model.parameter(constant, None) };
    // What cannot be looked for at all is said first.
    model.parameter(constant, None)?;
    let labels = labels(constant, scene);
    if labels.iter().filter(|label| *label == of).count() > 1 {
        return Err(format!(
            "{name}: {of:?} is of several of its numbers, which no name tells apart"
        ));
    }
    match labels.iter().position(|label| label == of) {
        Some(number) => model.parameter(constant, Some(number)),
        None if labels.iter().all(String::is_empty) => {
            Err(format!("{name}: the world has one alone; leave `:{of}` out"))
        }
        None => {
            Err(format!("{name}: {of:?} is none of its numbers; there are {}", labels.join("; ")))
        }
    }
}

/// The name of a parameter: what [`parameter`] reads.
pub fn name(parameter: Parameter, scene: &Scene) -> String {
    let name = parameter.constant.name();
    let of = parameter
        .number
        .and_then(|number| labels(parameter.constant, scene).into_iter().nth(number));
    of.map_or_else(|| name.to_owned(), |of| format!("{name}:{of}"))
}

/// What a parameter is in.
pub fn unit_of(parameter: Parameter) -> &'static str {
    match parameter.number {
        None => parameter.constant.unit(),
        Some(_) => unit(parameter.constant),
    }
}

/// What each number of a constant is of: what it belongs to where that has one alone, else with its part.
fn labels(constant: Constant, scene: &Scene) -> Vec<String> {
    let count = constant.width(&scene.world);
    let all: Vec<_> = (0..count).map(|number| label(scene, constant, number)).collect();
    let owner = |label: &str| label.split_once(", ").map_or(label, |(owner, _)| owner).to_owned();
    let is_alone = |of: &str| all.iter().filter(|other| owner(other) == of).count() == 1;
    let short = |label: &String| {
        let of = owner(label);
        if is_alone(&of) { of } else { label.clone() }
    };
    all.iter().map(short).collect()
}
