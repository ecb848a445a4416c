//! Unit tests of `cma_es.rs`.

use super::*;

/// Cost of the best point after `generations`.
fn search(dimension: usize, generations: usize, cost: impl Fn(&DVector<f64>) -> f64) -> f64 {
    let mut search = CmaEs::new(dimension, 2 * (4 + dimension), 0.5, 7);
    let mut best = f64::INFINITY;
    for _ in 0..generations {
        let costs: Vec<f64> = search.draw().iter().map(&cost).collect();
        best = costs.iter().copied().fold(best, f64::min);
        search.adapt(&costs);
    }
    best
}

/// An ellipsoid with axes of ratio 1000 in ten coordinates, from a distance of 3.
#[test]
fn search_finds_the_minimum_of_a_rotated_narrow_ellipsoid() {
    let n = 10;
    let direction = DVector::repeat(n, 1.0 / (n as f64).sqrt());
    let cost = |x: &DVector<f64>| {
        let from = x - DVector::repeat(n, 1.0);
        let along = direction.dot(&from);
        from.norm_squared() + 1e6 * along * along
    };
    assert!(search(n, 400, cost) < 1e-12);
}

/// Rosenbrock's valley, whose direction turns.
#[test]
fn search_follows_a_curved_valley() {
    let cost = |x: &DVector<f64>| {
        let pairs = x.as_slice().windows(2);
        pairs.map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)).sum()
    };
    assert!(search(5, 400, cost) < 1e-12);
}

/// Equal costs do not move the mean far, and end the search.
#[test]
fn plateau_ends_a_search() {
    let mut search = CmaEs::new(3, 8, 0.5, 1);
    let mut generations = 0;
    while !search.has_converged() {
        let points = search.draw().len();
        search.adapt(&vec![1.0; points]);
        generations += 1;
        assert!(generations < 100);
    }
}
