//! Cross-validation: a fit on some tosses, judged by the others.

use super::error::FitError;
use super::evaluator::{Evaluator, Query};
use super::loss::TossScore;
use super::parameter::ParameterValues;
use super::plan::Plan;
use super::recording::Toss;
use super::search::Found;
use crate::mechanics::State;
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

/// Two recordings are the same where no height is farther apart than this, m: a recording that was
/// moved or turned about the vertical is the same one.
const SAME: f64 = 1e-5;

/// Whether two tosses are one recording.
fn is_same(a: &Toss, b: &Toss) -> bool {
    let height = |frame: &State| frame.position.z;
    a.frames.len() == b.frames.len()
        && a.frames.iter().zip(&b.frames).all(|(a, b)| (height(a) - height(b)).abs() <= SAME)
}

/// Parts of the tosses, drawn with `seed`, as equal as can be, each in ascending order. Tosses that
/// are the same recording are in the same part: else what is kept back would have been seen.
///
/// # Errors
/// Less than two parts, or parts of less than two recordings.
pub fn parts(tosses: &[Toss], folds: usize, seed: u32) -> Result<Vec<Vec<usize>>, FitError> {
    let mut recordings: Vec<Vec<usize>> = Vec::new();
    for (place, toss) in tosses.iter().enumerate() {
        match recordings.iter_mut().find(|known| is_same(&tosses[known[0]], toss)) {
            Some(known) => known.push(place),
            None => recordings.push(vec![place]),
        }
    }
    let count = recordings.len();
    if folds < 2 || count / 2 < folds {
        return Err(FitError::Request(format!(
            "{folds} folds of {count} different recordings: 2 folds or more, of 2 or more, are \
             needed"
        )));
    }
    let mut draws = Mt::new(seed);
    for k in (1..count).rev() {
        recordings.swap(k, draws.next_u32() as usize % (k + 1));
    }
    let part = |fold: usize| {
        let mut part: Vec<usize> =
            recordings.iter().skip(fold).step_by(folds).flatten().copied().collect();
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
    start: &ParameterValues,
    evaluator: &mut Evaluator<'_>,
    kept: &[usize],
) -> Result<Fold, FitError> {
    let others = (0..evaluator.tosses().len()).filter(|toss| kept.binary_search(toss).is_err());
    let others: Vec<usize> = others.collect();
    let found = plan.search(start, evaluator, &others)?;
    let substeps = evaluator.protocol().substeps;
    let mut score =
        |values: &ParameterValues| evaluator.evaluate(&Query { values, substeps, tosses: kept });
    let (scores, scores_at_start) = (score(&found.values)?, score(start)?);
    Ok(Fold { kept: kept.to_vec(), found, scores, scores_at_start })
}
