//! Cross-validation: a fit on some tosses, judged by the others.

use super::error::FitError;
use super::model::Values;
use super::rollout::{Evaluator, Query, TossScore};
use super::search::{Found, Plan};
use rand_mt::Mt;

/// One fold.
#[derive(Debug, Clone, PartialEq)]
pub struct Fold {
    /// The tosses that were kept back, by their place in the list.
    pub kept: Vec<usize>,
    /// What was found on the others.
    pub found: Found,
    /// The scores of the kept ones with it, and with the values of the start.
    pub scores: Vec<TossScore>,
    /// The same with the values of the start.
    pub scores_at_start: Vec<TossScore>,
}

/// Parts of `count` tosses, drawn with `seed`, as equal as can be, each in ascending order.
///
/// # Errors
/// Less than two parts, or parts of less than two tosses.
pub fn parts(count: usize, folds: usize, seed: u32) -> Result<Vec<Vec<usize>>, FitError> {
    if folds < 2 || count < 2 * folds {
        return Err(FitError::Request(format!(
            "{folds} folds of {count} tosses: 2 folds or more, of 2 tosses or more, are needed"
        )));
    }
    let (mut order, mut draws) = ((0..count).collect::<Vec<_>>(), Mt::new(seed));
    for k in (1..count).rev() {
        order.swap(k, draws.next_u32() as usize % (k + 1));
    }
    let part = |fold: usize| {
        let mut part: Vec<usize> = order.iter().copied().skip(fold).step_by(folds).collect();
        part.sort_unstable();
        part
    };
    Ok((0..folds).map(part).collect())
}

/// Fits anew without the tosses `kept`, and scores these.
///
/// # Errors
/// As [`Plan::search`].
pub fn fold(
    plan: &Plan,
    start: &Values,
    evaluator: &mut Evaluator<'_>,
    kept: &[usize],
) -> Result<Fold, FitError> {
    let others = (0..evaluator.tosses().len()).filter(|toss| kept.binary_search(toss).is_err());
    let others: Vec<usize> = others.collect();
    let found = plan.search(start, evaluator, &others)?;
    let substeps = evaluator.protocol().substeps;
    let mut score = |values: &Values| evaluator.evaluate(&Query { values, substeps, tosses: kept });
    let (scores, scores_at_start) = (score(&found.values)?, score(start)?);
    Ok(Fold { kept: kept.to_vec(), found, scores, scores_at_start })
}
