//! The constants of a scene as numbers with names.

use crate::rollout::parameter;
use crate::scene::PyScene;
use pyo3::prelude::*;
use tumble_core::world::Constant;
use tumble_scene::label::label;

/// The numbers of one constant.
#[derive(IntoPyObject)]
pub struct ConstantNumbers {
    /// The scene's own numbers.
    own: Vec<f64>,
    /// The name of each number: its body, piece, pair or axis. A number that its owner has alone has the owner's name.
    names: Vec<String>,
    /// The one number by which the constant varies as a whole.
    whole: f64,
    /// The numbers where the one number is 0.
    at_zero: Vec<f64>,
    /// The numbers where the one number is 1.
    at_one: Vec<f64>,
}

/// The numbers of the constant `name` of a scene.
#[pyfunction]
#[pyo3(signature = (name, scene))]
pub fn constant_numbers(name: &str, scene: PyRef<'_, PyScene>) -> PyResult<ConstantNumbers> {
    let (constant, world) = (parameter(name)?, &scene.content.world);
    Ok(ConstantNumbers {
        own: constant.of(world),
        names: names(&scene, constant),
        whole: constant.one_number(world),
        at_zero: constant.from_one_number(world, 0.0),
        at_one: constant.from_one_number(world, 1.0),
    })
}

fn names(scene: &PyScene, constant: Constant) -> Vec<String> {
    let content = &scene.content;
    let count = constant.width(&content.world);
    let labels: Vec<_> = (0..count).map(|number| label(content, constant, number)).collect();
    let owner = |label: &str| label.split_once(", ").map_or(label, |(owner, _)| owner).to_owned();
    let short = |label: &String| {
        let own = owner(label);
        let is_alone = labels.iter().filter(|other| owner(other) == own).count() == 1;
        if is_alone { own } else { label.clone() }
    };
    labels.iter().map(short).collect()
}
