//! The search for the values of least loss: covariance matrix adaptation (CMA-ES, from `cmaes`),
//! started anew.
//!
//! The loss of chaotic motions is rough: a simplex shrinks onto the next small dent, and so does what follows a
//! derivative. CMA-ES asks for ranks of a population alone. Each round starts at the best point
//! so far, the first wide, the next narrower. What is in the first rounds simulated with half the
//! substeps is, in the last, with all of them. From the best point on, a [polish](super::polish) by derivatives.

use super::error::FitError;
use super::evaluator::{Evaluator, Query};
use super::parameter::ParameterValues;
use super::plan::Plan;
use super::polish::Polish;
use cmaes::{CMAESOptions, DVector};
use std::cell::RefCell;

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The values of least loss with all substeps.
    pub values: ParameterValues,
    /// Their loss.
    pub loss: f64,
    /// That of the start.
    pub loss_at_start: f64,
    /// Evaluations that were made.
    pub evaluations: usize,
    /// Evaluations that the library refused to simulate: they counted as worse than all.
    pub refused: usize,
    /// The least loss so far after each evaluation with all substeps.
    pub progress: Vec<f64>,
    /// What Gauss–Newton steps made of the best values, where they were asked for.
    pub polish: Option<Polish>,
}

impl Plan {
    /// ParameterValues from a point: coordinates in steps from the start.
    fn values(&self, start: &ParameterValues, point: &[f64]) -> (ParameterValues, f64) {
        let (mut values, mut outside) = (start.clone(), 0.0);
        for (sought, coordinate) in self.sought.iter().zip(point) {
            let (from, [low, high]) = (start.get(sought.parameter), sought.bounds);
            let step = sought.usual_step(from);
            let wanted = from + step * coordinate;
            let value = wanted.clamp(low, high);
            outside += (wanted - value).abs() / step;
            values = values.with(sought.parameter, value);
        }
        (values, outside)
    }

    /// Searches from `start` on some of the tosses.
    ///
    /// # Errors
    /// As [`Plan::check`]; an interrupt; a start that cannot be simulated; a memory that fails.
    pub fn search(
        &self,
        start: &ParameterValues,
        evaluator: &mut Evaluator<'_>,
        tosses: &[usize],
    ) -> Result<Found, FitError> {
        self.check(start)?;
        let full = evaluator.protocol().substeps;
        let coarse = full.div_ceil(2);
        let at_start = self.loss.mean(&evaluator.evaluate(&Query {
            values: start,
            substeps: full,
            tosses,
        })?);
        let task = RefCell::new(Task {
            plan: self,
            start,
            evaluator,
            tosses,
            substeps: coarse,
            left: 0,
            best: (vec![0.0; self.sought.len()], f64::INFINITY),
            failure: None,
            evaluations: 1,
            refused: 0,
            progress: vec![at_start],
        });
        // The evaluations that are made by the end of so many rounds; the product may be long.
        let budget = (self.evaluations - 1) as u128;
        let made = |rounds: usize| (rounds as u128 * budget / self.rounds as u128) as usize;
        for round in 0..self.rounds {
            let last = round + 1 == self.rounds;
            {
                let mut task = task.borrow_mut();
                task.left = made(round + 1) - made(round);
                if last && coarse != full {
                    // What was found with fewer substeps is judged anew.
                    task.substeps = full;
                    task.best.1 = f64::INFINITY;
                }
            }
            self.round(&task, round)?;
            if let Some(failure) = task.borrow_mut().failure.take() {
                return Err(failure);
            }
        }
        let task = task.into_inner();
        let (point, loss) = task.best;
        let (found, loss) = if loss < at_start {
            (self.values(start, &point).0, loss)
        } else {
            (start.clone(), at_start)
        };
        let (found, loss, polish) = match self.polish {
            0 => (found, loss, None),
            _ => {
                let (found, loss, polish) = self.polished((found, loss), task.evaluator, tosses)?;
                (found, loss, Some(polish))
            }
        };
        let tried = polish.as_ref().map_or(0, |polish| polish.tried);
        Ok(Found {
            values: found,
            loss,
            loss_at_start: at_start,
            evaluations: task.evaluations + tried,
            refused: task.refused,
            progress: task.progress,
            polish,
        })
    }

    /// One round: generations until its evaluations are used up or the population has shrunk to
    /// nothing. The first one is half a step of the search wide, each next a third of the one
    /// before.
    fn round(&self, task: &RefCell<Task<'_, '_>>, round: usize) -> Result<(), FitError> {
        let width = 0.5 / 3.0_f64.powi(round.min(20) as i32);
        let at = task.borrow().best.0.clone();
        task.borrow_mut().loss(&at);
        let population = self.population();
        let mut strategy = CMAESOptions::new(at, width)
            .population_size(population)
            .seed(u64::from(self.seed) + round as u64)
            .build(|point: &DVector<f64>| task.borrow_mut().loss(point.as_slice()))
            .map_err(|error| FitError::Request(format!("the optimiser: {error:?}")))?;
        while task.borrow().left >= population && task.borrow().failure.is_none() {
            if strategy.next().is_some() {
                break;
            }
        }
        Ok(())
    }
}

/// Above every loss; a population is ranked by it, and needs a number.
const WORST: f64 = 1e9;

/// What the populations ask.
struct Task<'a, 'b> {
    plan: &'a Plan,
    start: &'a ParameterValues,
    evaluator: &'a mut Evaluator<'b>,
    tosses: &'a [usize],
    substeps: usize,
    /// Evaluations of this round.
    left: usize,
    best: (Vec<f64>, f64),
    failure: Option<FitError>,
    evaluations: usize,
    refused: usize,
    progress: Vec<f64>,
}

impl Task<'_, '_> {
    /// The loss at a point. Outside of the bounds it is that of the nearest point inside and grows
    /// with the distance. Once something failed it is as bad as can be and costs nothing.
    fn loss(&mut self, point: &[f64]) -> f64 {
        if self.failure.is_some() {
            return WORST;
        }
        let (values, outside) = self.plan.values(self.start, point);
        let query = Query { values: &values, substeps: self.substeps, tosses: self.tosses };
        self.left = self.left.saturating_sub(1);
        self.evaluations += 1;
        let loss = match self.evaluator.evaluate(&query) {
            Ok(scores) => self.plan.loss.mean(&scores),
            Err(FitError::Rollout { .. }) => {
                self.refused += 1;
                return WORST * (1.0 + outside);
            }
            Err(error) => {
                self.failure = Some(error);
                return WORST;
            }
        };
        if loss < self.best.1 && outside == 0.0 {
            self.best = (point.to_vec(), loss);
        }
        if self.substeps == self.evaluator.protocol().substeps {
            let least = self.progress.iter().copied().fold(loss, f64::min);
            self.progress.push(least);
        }
        loss * (1.0 + 0.1 * outside)
    }
}
