//! Derivatives of batches against differences of the same batches, and refused input.

use super::*;
use crate::common::prelude::*;
use std::num::NonZeroUsize;
use tumble::rollout::{
    Batch, By, Cotangents, Gradients, RolloutOutputs, RolloutWatch, Varied, gradients, roll_out,
};

const STEPS: usize = 25;
const ROLLOUTS: usize = 3;

/// Batch of a box that slides and is pushed: three rollouts with different constants.
struct Slides {
    world: World,
    starts: Vec<f64>,
    controls: Vec<f64>,
    friction: Vec<f64>,
    masses: Vec<f64>,
    inertias: Vec<f64>,
}

impl Slides {
    fn new() -> Self {
        let (world, states) = on_a_slope(0.1, 0.3, 1.5);
        let numbers = states[0].to_vector();
        let push = |k: usize| (0..6).map(move |i| 0.05 * ((6 * k + i) as f64).sin());
        let own = *world.bodies()[0].inertia();
        Self {
            starts: numbers.as_slice().to_vec(),
            controls: (0..ROLLOUTS * STEPS).flat_map(push).collect(),
            friction: vec![0.25, 0.3, 0.35],
            masses: vec![1.9, 2.0, 2.3],
            inertias: [0.9, 1.0, 1.2].iter().flat_map(|k| (own * *k).as_slice().to_vec()).collect(),
            world,
        }
    }

    fn with_batch<T>(&self, work: impl FnOnce(&Batch<'_>) -> T) -> T {
        let parameters = [
            Varied { constant: Constant::Friction, values: &self.friction },
            Varied { constant: Constant::Mass, values: &self.masses },
            Varied { constant: Constant::Inertia, values: &self.inertias },
        ];
        work(&Batch {
            world: &self.world,
            motion: &|world| Ok(Motion::native(world)),
            loads: &[],
            courses: &[],
            index: 7,
            rollouts: ROLLOUTS,
            steps: STEPS,
            starts: &self.starts,
            controls: &self.controls,
            motors: &[],
            joint_forces: &[],
            parameters: &parameters,
        })
    }

    /// Weighted sum of each rollout's states over its steps. The weights are the position and
    /// velocity components of `cotangents` [m, m/s].
    fn sums(&self, cotangents: &[f64]) -> Vec<f64> {
        let mut states = vec![0.0; ROLLOUTS * STEPS * 13];
        let outputs = RolloutOutputs { states: &mut states, ..RolloutOutputs::default() };
        let one = NonZeroUsize::MIN;
        self.with_batch(|batch| roll_out(batch, outputs, one, RolloutWatch::default())).unwrap();
        let step = |(state, by): (&[f64], &[f64])| {
            let positions = state[..3].iter().zip(&by[..3]);
            positions.chain(state[7..10].iter().zip(&by[6..9])).map(|(x, y)| x * y).sum::<f64>()
        };
        let each = states.chunks_exact(13).zip(cotangents.chunks_exact(12)).map(step);
        let each: Vec<f64> = each.collect();
        each.chunks_exact(STEPS).map(|steps| steps.iter().sum()).collect()
    }

    fn gradients(&self, cotangents: &[f64], threads: usize) -> Gradients {
        let by = [Constant::Friction, Constant::Mass, Constant::Inertia, Constant::Gravity];
        let threads = NonZeroUsize::new(threads).unwrap();
        let cotangents = Cotangents::States(cotangents);
        let watch = RolloutWatch::default();
        let by = By { constants: &by, smoothing: None };
        self.with_batch(|batch| gradients(batch, cotangents, by, threads, watch)).unwrap()
    }
}

/// Weights for positions and velocities only. Rotations and spins have a curved chart.
fn weights() -> Vec<f64> {
    let of = |k: usize| if k % 6 < 3 { (k as f64).cos() } else { 0.0 };
    (0..ROLLOUTS * STEPS * 12).map(of).collect()
}

#[test]
fn batch_gradient_covers_all_varied_inputs() {
    let (slides, weights) = (Slides::new(), weights());
    let found = slides.gradients(&weights, 1);
    assert_eq!(found, slides.gradients(&weights, 3));
    for noted in &found.noted {
        assert_eq!([noted.unsolved, noted.unknown, noted.kept, noted.limited], [0; 4]);
        assert!(noted.margin.0 > 0.0 && noted.margin.1 >= 7 && noted.margin.1 < 7 + STEPS as u64);
    }
    let check = |change: &dyn Fn(&mut Slides, f64), slopes: [f64; ROLLOUTS]| {
        let by = 1e-6;
        let at = |by: f64| {
            let mut moved = Slides::new();
            change(&mut moved, by);
            moved.sums(&weights)
        };
        let (above, below) = (at(by), at(-by));
        for (rollout, slope) in slopes.into_iter().enumerate() {
            let difference = (above[rollout] - below[rollout]) / (2.0 * by);
            // Rounding error of the differences: about 1e-9.
            assert!(
                (difference - slope).abs() <= 1e-6 * slope.abs() + 1e-8,
                "{difference} {slope}"
            );
        }
    };
    let three = |numbers: &[f64], place: usize| {
        let width = numbers.len() / ROLLOUTS;
        std::array::from_fn(|rollout| numbers[rollout * width + place])
    };
    check(&|s, by| s.friction.iter_mut().for_each(|x| *x += by), three(&found.constants[0], 0));
    // The inertias are given, so they do not change with the masses.
    check(&|s, by| s.masses.iter_mut().for_each(|x| *x += by), three(&found.constants[1], 0));
    let turned = |s: &mut Slides, by: f64| s.inertias.iter_mut().step_by(9).for_each(|x| *x += by);
    check(&turned, three(&found.constants[2], 0));
    for place in 0..3 {
        check(&|s, by| s.starts[7 + place] += by, three(&found.starts, 6 + place));
        for step in [0, 11, STEPS - 1] {
            let at = 6 * step + place;
            let pushed = |s: &mut Slides, by: f64| {
                s.controls.iter_mut().skip(at).step_by(6 * STEPS).for_each(|x| *x += by);
            };
            check(&pushed, three(&found.controls, at));
        }
    }
}

#[test]
fn invalid_batches_are_rejected() {
    let slides = Slides::new();
    let refused = |cotangents: Cotangents<'_>| {
        let (threads, watch) = (NonZeroUsize::MIN, RolloutWatch::default());
        let by = By { constants: &[], smoothing: None };
        let found = slides.with_batch(|batch| gradients(batch, cotangents, by, threads, watch));
        found.unwrap_err().error
    };
    let short = refused(Cotangents::Ends(&[0.0; 13]));
    let (field, allowed) = ("numbers in the cotangents", "(B or 1, N, 12)");
    assert_eq!(short, Error::Count { field, count: 13, allowed });
    assert!(matches!(refused(Cotangents::States(&[0.0; 12])), Error::Count { count: 12, .. }));
}

#[test]
fn contacts_of_another_world_are_refused() {
    let (world, states) = on_a_slope(0.1, 0.3, 1.5);
    let (_, record) = step(&world, &states, &[]).unwrap();
    let step = Step {
        world: &world,
        states: &states,
        wrenches: &[Wrench::zero()],
        free: &states,
        previous: &record.first().solution,
        earlier: None,
        interrupt: None,
    };
    let mut contacts = record.first().contacts.clone();
    contacts[0].key.partner = Partner::Fixed(3);
    let refused = StepDerivative::new().linearise(&step, &contacts, &record.first().solution);
    let (field, allowed) = ("fixed piece of a contact", "an index of a fixed piece of the world");
    assert_eq!(refused, Err(Error::Count { field, count: 3, allowed }));
}

#[test]
fn failed_gradient_leaves_the_simulation_unchanged() {
    let (world, states) = on_a_slope(0.1, 0.3, 1.5);
    let mut simulation =
        Simulation::new(world.clone(), states.clone(), Motion::native(&world)).unwrap();
    let mut before = |simulation: &mut Simulation<'_>| match simulation.index() {
        5 => Err(Error::Interrupted),
        _ => Ok(()),
    };
    let mut run = Run {
        steps: 10,
        before: &mut before,
        by_states: &mut |_, _| None,
        constants: &[],
        inputs: &[],
        checkpoints: Checkpoints::default(),
        smoothing: None,
        has_impact_times: false,
    };
    assert_eq!(simulation.gradient(&mut run), Err(Error::Interrupted));
    assert_eq!((simulation.index(), simulation.states()), (0, &states[..]));
}
