//! World constants of a scene as named numbers.

use crate::rollout::parameter;
use crate::scene::PyScene;
use pyo3::prelude::*;
use tumble_core::world::Constant;
use tumble_scene::label::label;

/// Values of one constant.
#[derive(IntoPyObject)]
pub struct ConstantNumbers {
    /// Values of the scene.
    own: Vec<f64>,
    /// Name of each number: its body, piece, pair or axis. A single number has the name of its
    /// owner.
    names: Vec<String>,
    /// Scalar that varies the constant as a whole.
    whole: f64,
    /// Values at the scalar 0.
    at_zero: Vec<f64>,
    /// Values at the scalar 1.
    at_one: Vec<f64>,
}

/// Values of the constant `name` of a scene.
#[pyfunction]
pub fn constant_numbers(name: &str, scene: PyRef<'_, PyScene>) -> PyResult<ConstantNumbers> {
    let (constant, world) = (parameter(name)?, &scene.content.world);
    Ok(ConstantNumbers {
        own: constant.values(world),
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
