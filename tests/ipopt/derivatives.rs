//! Functions and derivatives of the step program: against CasADi at 250 points, and against central
//! differences for bodies of any shape.

use crate::common;
use crate::common::prelude::*;

use crate::common::{any_state, any_world, any_wrench, cases, state};
use crate::points::{Input, Output, Point, Triplets, compare, points};
use crate::slopes::{Program as _, hessian_error, jacobian_error};
use proptest::prelude::*;
use tumble::sparsity::SparsityPattern;
use tumble::step_nlp::DissipationFactor::{Flag, Product};
use tumble::step_nlp::StepNlp;

/// Program of a point's step.
fn nlp_of(input: &Input) -> StepNlp {
    let usual = common::tutorial_parameters();
    let inertia = Matrix3::from(input.inertia());
    let body = RigidBody::with_box_corners(input.mass(), inertia, Vector3::repeat(1.0)).unwrap();
    let parameters = Parameters {
        bodies: vec![body],
        gravity: input.gravity().into(),
        friction: input.mu(),
        time_step: input.dt(),
        ..usual
    };
    let mut nlp = StepNlp::new(World::new(parameters).unwrap(), input.epsilon()).unwrap();
    nlp.set_step(&state(&input.state), &Wrench::zero(), input.alpha.iter().copied());
    nlp
}

fn triplets(pattern: &SparsityPattern, values: Vec<f64>) -> Triplets {
    Triplets { rows: pattern.rows().to_vec(), cols: pattern.cols().to_vec(), values }
}

#[test]
fn values_and_derivatives_are_those_of_casadi() {
    for point in &points() {
        let (nlp, input) = (nlp_of(&point.input), &point.input);
        let hessian = nlp.hessian_at(&input.x, input.obj_factor, &input.multipliers);
        compare(
            point,
            &Output {
                objective: nlp.objective(&input.x),
                gradient: nlp.gradient_at(&input.x),
                constraints: nlp.constraints_at(&input.x),
                jacobian: triplets(nlp.jacobian_pattern(), nlp.jacobian_at(&input.x)),
                hessian: triplets(nlp.hessian_pattern(), hessian),
            },
        );
    }
}

/// Checks that every entry of the patterns is nonzero for some point, for each kind of world
/// (isotropic inertia or not, friction or none). The comparison above shows that no entry is
/// missing.
#[test]
fn the_patterns_hold_no_entry_that_is_always_zero() {
    let mut used: Vec<(SparsityPattern, Vec<bool>)> = Vec::new();
    for Point { input, .. } in &points() {
        let nlp = nlp_of(input);
        let hessian = nlp.hessian_at(&input.x, input.obj_factor, &input.multipliers);
        for (pattern, values) in
            [(nlp.jacobian_pattern(), nlp.jacobian_at(&input.x)), (nlp.hessian_pattern(), hessian)]
        {
            if !used.iter().any(|(known, _)| known == pattern) {
                used.push((pattern.clone(), vec![false; pattern.len()]));
            }
            let (_, used) = used.iter_mut().find(|(known, _)| known == pattern).unwrap();
            used.iter_mut().zip(values).for_each(|(used, value)| *used |= value != 0.0);
        }
    }
    // Without friction the data has only isotropic inertia. No Hessian depends on the inertia.
    assert_eq!(used.len(), 3 + 2, "Jacobians and Hessians");
    for (pattern, used) in used {
        for (at, used) in pattern.positions().zip(used) {
            assert!(used, "{at:?} is zero wherever the pattern of {} holds", pattern.len());
        }
    }
}

/// Step program of a random body, and a point to differentiate at: x and multipliers.
#[derive(Debug, Clone)]
struct Anywhere {
    nlp: StepNlp,
    x: Vec<f64>,
    multipliers: Vec<f64>,
}

fn anywhere() -> impl Strategy<Value = Anywhere> {
    let step = (any_world(), any_state(), any_wrench(), any_state());
    let numbers = proptest::collection::vec(-1.0..1.0, 2 * 86);
    // The smoothing is large enough for differences to follow the derivatives.
    let constants = (0.5..1.0, 0.0..1.0, prop_oneof![Just(Flag), Just(Product)]);
    (step, constants, numbers).prop_map(
        |((world, old, wrench, new), (smoothing, share, factor), numbers)| {
            let numbers: Vec<f64> = numbers;
            let mut nlp = StepNlp::with_factor(world, smoothing, factor).unwrap();
            let layout = nlp.layout();
            let mut x = new.to_vector().as_slice().to_vec();
            // f_x, f_y ±5 N, comparable to the smoothing, f_z 0…50 N, the rest 0…5.
            x.extend(numbers.iter().map(|u| 5.0 * u).take(2 * layout.contacts()));
            x.extend(numbers[24..].iter().map(|u| 50.0 * u.abs()).take(layout.contacts()));
            x.extend(numbers[36..].iter().map(|u| 5.0 * u.abs()).take(3 * layout.contacts()));
            nlp.set_step(&old, &wrench, numbers[72..84].iter().map(|u| u.abs()));
            nlp.anchor(share, numbers.iter().map(|u| Vector3::new(*u, -*u, 2.0 * u)));
            Anywhere { nlp, x, multipliers: numbers[86..][..layout.constraints()].to_vec() }
        },
    )
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn the_jacobian_is_the_slope_of_the_constraints(point in anywhere()) {
        let error = jacobian_error(&point.nlp, &point.x);
        prop_assert!(error < 1e-7, "{error:e}");
    }

    #[test]
    fn the_hessian_is_the_slope_of_the_lagrangians_gradient(
        point in anywhere(), factor in 0.0..2.0
    ) {
        let error = hessian_error(&point.nlp, &point.x, factor, &point.multipliers);
        prop_assert!(error < 1e-7, "{error:e}");
    }
}
